#pragma once
/// The lumen's field in front of the openings of a vessel: free space, as if the vessel ended in a
/// flange there.
#include <Eigen/Geometry>
#include <vector>

#include "preprocess/surface/openings.h"
#include "simulate/wall/sample_grid.h"

namespace wireplan::simulate {

/// The free space before an opening: a disc's worth round the cap's axis, to Lumen::kFreeLength.
struct Mouth {
  const preprocess::Opening* opening;
  double rim_radius;    // of the farthest vertex of the cap                            [mm]
  double flange_width;  //                                                             [mm]
  Vec3 low, high;       // box of all that the opening changes                          [mm]

  double depth(const Vec3& p) const { return opening->normal.dot(p - opening->center); }
  double lateral(const Vec3& p) const {
    const Vec3 offset = p - opening->center;
    return (offset - opening->normal.dot(offset) * opening->normal).norm();
  }
};

/// Of an opening of the surface; the flange is at most `limit` wide.
Mouth describe_mouth(const Surface& surface, const preprocess::Opening& opening, double limit);

/// Measures anew, without the caps, near the openings of a grid that holds the closed surface's
/// distances and signs. What no wall is near keeps its sign, but before an opening it is free.
void open_caps(SampleGrid& grid, const Surface& surface, const std::vector<Mouth>& mouths);

}  // namespace wireplan::simulate
