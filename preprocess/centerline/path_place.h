#pragma once
/// Where a point is along and beside the path from access to target.
#include "preprocess/vessel.h"

namespace wireplan::preprocess {

struct PathPlace {
  double arc = 0.0;         // of the nearest point of the path's axis, from the access     [mm]
  double radius = 0.0;      // of the path there                                            [mm]
  double from_axis = 0.0;   // distance from the axis, exact to its segments                [mm]
  double from_lumen = 0.0;  // from the balls inscribed along it; 0 inside one              [mm]
};

/// Expects a path of at least one point, with the lengths along its points.
PathPlace find_place(const Vec3& p, const Centerline& path);

/// Whether a place is in the path's lumen, which the balls fill but for what is oval: at most half
/// their radius beside them, and a millimetre at least.
bool is_on_path(const PathPlace& place);

/// How far along the path a tip is; 0 where it is not on the path [mm].
double find_progress(const Vec3& tip, const Centerline& path);

}  // namespace wireplan::preprocess
