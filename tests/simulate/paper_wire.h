#pragma once
/// The wire of the paper's experiments, of 40 mm: k_b = 100 N/m and k_s = 1e10 N/m^3 at 20 elements
/// of 2 mm, 0.2 g each.
#include "simulate/wire/rod.h"

namespace wireplan::simulate {

inline Wire paper_wire() {
  return {.name = "paper",
          .radius = 0.4,
          .sections = {{.length = 40.0,
                        .bending_stiffness = 0.8,
                        .axial_stiffness = 160.0,
                        .twist_stiffness = 0.62,
                        .mass_per_length = 0.1 * kTonnePerMmFromKgPerM}}};
}

}  // namespace wireplan::simulate
