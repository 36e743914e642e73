#pragma once
/// Calcified plaque beside and in the lumen of a CT, as far as brightness tells it.
#include <optional>

#include "preprocess/vessel.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

struct CalciumOptions {
  double threshold_hu = 800.0;  // brighter is calcium; contrast in the lumen must stay below  [HU]
  double within_mm = 2.0;       // of the lumen                                               [mm]
};

struct Calcium {
  double beside = 0.0, inside = 0.0;   // outside the lumen's voxels, and among them       [mm^3]
  std::optional<Vec3> inside_at = {};  // the middle of the largest piece of the latter    [mm]
};

/// Volume of the voxels that are brighter than the threshold, lie within that distance of a voxel
/// of the lumen (between centres, less half a voxel) and beside the way: nearer to its line than
/// 1.5 radii there and that distance. Plaque that a segmentation took for lumen counts apart, where
/// two such voxels share a face: one alone may be noise of the contrast. Bone or metal that touches
/// the vessel counts too. Expects image and lumen on one grid.
Calcium measure_calcium(const Image& image, const Mask& lumen, const Centerline& way,
                        const CalciumOptions& options = {});

}  // namespace wireplan::preprocess
