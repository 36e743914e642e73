#pragma once
/// Lines of vessels that leave a vertical trunk of 10 mm radius, for tests of what a way is like.
#include <cmath>
#include <vector>

#include "preprocess/centerline/centerline.h"
#include "tests/shapes.h"

namespace wireplan::trees {

using shapes::line_through;

/// A branch of a trunk of 10 mm radius, sideways from its middle.
inline preprocess::Branch side_branch(double z, double x, double radius, double parent_arc) {
  preprocess::Branch branch{.line = line_through({Vec3(0, 0, z), Vec3(x, 0, z)}, radius),
                            .parent = 0,
                            .parent_arc = parent_arc};
  for (Eigen::Index k = 0; branch.line.arc_length(k) < 10.0; ++k) branch.line.radius(k) = 10.0;
  return branch;
}

/// Up a trunk of 10 mm radius to 100 mm, and 50 mm to the right.
inline Centerline right_renal_way(double radius) {
  Centerline way = line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(-50, 0, 100)}, radius);
  for (Eigen::Index k = 0; way.arc_length(k) < 110.0; ++k) way.radius(k) = 10.0;
  return way;
}

/// A line as it runs in a tree of the trunk and a branch to one side (1 left, -1 right), whose axes
/// meet at z = 100: up the trunk's axis to the ostium's level, across, and along the branch's axis.
inline std::vector<Vec3> into_branch(double side, double elevation) {
  const double c = std::cos(elevation), s = std::sin(elevation);
  const double level = 100.0 + 10.0 * s / c;
  return {Vec3(0, 0, level), Vec3(10.0 * side, 0, level),
          Vec3((10.0 + 40.0 * c) * side, 0, level + 40.0 * s)};
}

}  // namespace wireplan::trees
