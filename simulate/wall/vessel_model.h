#pragma once
/// The vessel as wires feel it: built once per patient, shared read-only by all trials.
#include <memory>
#include <utility>

#include "preprocess/vessel.h"
#include "simulate/wall/compliance.h"
#include "simulate/wall/locator.h"
#include "simulate/wall/lumen.h"

namespace wireplan::simulate {

/// Of a field that follows this surface: cells of half a millimetre, or of two thirds of a
/// triangle's edge in the mean where that is less; not less than a tenth of a millimetre. Its
/// openings are open.
LumenOptions follow(const Surface& surface);

struct VesselModel {
  /// A wall that yields is felt further out than one that does not: ten cells, if that is more.
  static double yielding_band(const LumenOptions& options);

  /// Of a rigid vessel; with a wall, of one that yields, in its band.
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
