#pragma once
/// The vessel as wires feel it: built once per patient, shared read-only by all trials.
#include <memory>
#include <utility>

#include "preprocess/vessel.h"
#include "simulate/wall/compliance.h"
#include "simulate/wall/locator.h"
#include "simulate/wall/lumen.h"
#include "simulate/wall/section_chain.h"

namespace wireplan::simulate {

/// The options of a field that follows this surface, with its openings open. Its cells are two
/// thirds of the mean edge of the triangles, but at most 0.5 mm and at least 0.1 mm. Its band holds
/// contacts as far as `felt` [mm] from an axis: the radius of the thickest tool and its law's
/// reach.
LumenOptions follow(const Surface& surface, double felt = 0.0);

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
  std::unique_ptr<const SectionChain> sections;      // null: cross-sections do not move as wholes
};

}  // namespace wireplan::simulate
