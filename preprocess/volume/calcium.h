#pragma once
/// Calcified plaque beside the lumen of a CT, as far as brightness tells it.
#include "preprocess/vessel.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

struct CalciumOptions {
  double threshold_hu = 800.0;  // brighter is calcium; contrast in the lumen must stay below  [HU]
  double within_mm = 2.0;       // of the lumen                                               [mm]
};

/// Volume [mm^3] of the voxels outside the lumen that are brighter than the threshold, lie within
/// that distance of a voxel of the lumen (between centres, less half a voxel) and beside the way:
/// nearer to its line than 1.5 radii there and that distance. Bone or metal that touches the vessel
/// counts too. Expects image and lumen on one grid.
double calcium_volume(const Image& image, const Mask& lumen, const Centerline& way,
                      const CalciumOptions& options = {});

}  // namespace wireplan::preprocess
