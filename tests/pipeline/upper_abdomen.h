#pragma once
/// A part of the bundled phantom, small enough for tests.
#include <filesystem>

#include "pipeline/files/phantom_file.h"

namespace wireplan::pipeline {

/// The part of the bundled abdomen above the aneurysm, up to the coeliac trunk: aorta, renal
/// arteries, SMA, coeliac trunk with its branches; vertebrae that touch, veins and kidneys beside
/// them. Spacing [mm], noise [HU].
inline preprocess::PhantomSpec upper_abdomen(double spacing, double noise) {
  preprocess::PhantomSpec spec = read_phantom_spec(std::filesystem::path(WIREPLAN_SOURCE_DIR) /
                                                   "cases" / "abdomen" / "phantom.json");
  const Vec3 low(-50, -46, 58), high(64, 60, 134);
  spec.grid.spacing = Vec3::Constant(spacing);
  spec.grid.origin = low;
  for (int axis = 0; axis < 3; ++axis) {
    spec.grid.size[axis] = static_cast<int>((high - low)[axis] / spacing);
  }
  spec.noise_hu = noise;
  return spec;
}

}  // namespace wireplan::pipeline
