#pragma once
/// Where a drawn way leads.
#include <memory>
#include <utility>

#include "simulate/insertion/trial.h"

namespace wireplan::simulate {

/// The vessel's cross-section at the way's end.
inline Goal goal_at_end(std::shared_ptr<const Way> way) {
  return {.point = way->section().center,
          .radius = way->section().radius,
          .at_section = true,
          .way = std::move(way)};
}

}  // namespace wireplan::simulate
