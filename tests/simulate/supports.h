#pragma once
/// What holds a wire's end, for the verifications.
#include "simulate/equilibrium/problem.h"

namespace wireplan::simulate {

inline EndSupport pinned() {
  EndSupport end;
  end.hold_along = end.hold_across = true;
  return end;
}

}  // namespace wireplan::simulate
