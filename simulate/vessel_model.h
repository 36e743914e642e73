#pragma once
/// The vessel as wires feel it: built once per patient, shared read-only by all trials.
#include <memory>
#include <utility>

#include "preprocess/vessel.h"
#include "simulate/compliance.h"
#include "simulate/contact.h"
#include "simulate/locator.h"

namespace wireplan::simulate {

struct VesselModel {
  /// A wall that yields is felt further out than one that does not.
  static constexpr double kYieldingBand = 5.0;  //                                        [mm]

  /// Of a rigid vessel; with a wall, of one that yields: its band is at least kYieldingBand.
  explicit VesselModel(const Surface& surface, const LumenOptions& options = {})
      : lumen(surface, options), locator(surface) {}
  /// With the field as from_bytes() gives it.
  VesselModel(const Surface& surface, Lumen known) : lumen(std::move(known)), locator(surface) {}
  VesselModel(const Surface& surface, const Wall& wall, const LumenOptions& options = {});

  Lumen lumen;
  TriangleLocator locator;
  std::unique_ptr<const WallCompliance> compliance;  // null: the wall is rigid
};

}  // namespace wireplan::simulate
