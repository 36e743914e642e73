#pragma once
/// Where the page of a report cuts the volume, and with which window.
#include <utility>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "pipeline/report/slices.h"
#include "preprocess/vessel.h"

namespace wireplan::pipeline {

struct SlicedVessel {
  const Surface& surface;
  const Centerline& path;  // access to target
  Vec3 access, target;     //                                                              [mm]
};

/// The window in which a vessel is looked at: its mean bright, as far below its edge as above it,
/// never past the values there are. `segment` is what the stage of that name tells. Black and white
/// [HU].
std::pair<double, double> vessel_window(const preprocess::Image& image, const Json& segment);

/// Slices at the access, the target, the place of the largest force on the wall and on the way.
/// `segment` is what the stage of that name tells; `peak_force` is per triangle [N].
Slices cut_vessel_slices(const preprocess::Image& image, const SlicedVessel& vessel,
                         const Json& segment, const std::vector<double>& peak_force);

}  // namespace wireplan::pipeline
