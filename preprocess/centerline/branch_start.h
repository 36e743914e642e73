#pragma once
/// Where a new line of the tree leaves the lines that are known; for use in this folder.
#include <cstddef>
#include <vector>

#include "preprocess/centerline/centerline.h"

namespace wireplan::preprocess {

struct BranchStart {
  int parent = 0;             // the line that it leaves ...
  Eigen::Index at = 0;        // ... and the point of that
  std::size_t own_first = 0;  // its first point that is its own
};

/// The cheapest ways to two ends may run side by side along a trunk, over which neither is cheaper,
/// and part tens of millimetres before the ostium; on the ridge their lines then are one. A line
/// leaves the known ones where it last is within a quarter of a radius of one of them: of `parent`,
/// whose way it left on the grid, of the lines before that and of those that begin at it. A line
/// that never is, since it begins beside its parent, leaves the nearest of `parent` and those
/// before. What leaves a line in the ball that this begins in leaves the line before: all three
/// arteries of a trifurcation leave one. Expects points on the ridge, and `known` with parents
/// before their branches.
BranchStart find_branch_start(const std::vector<Branch>& known, int parent,
                              const std::vector<Vec3>& line);

/// The start of a line with all of its points, at the nearest point of `parent`.
BranchStart start_whole(const std::vector<Branch>& known, int parent,
                        const std::vector<Vec3>& line);

/// The points of a line that are its own, behind the point of its parent's line `from`.
std::vector<Vec3> begin_line(const Centerline& from, const BranchStart& start,
                             std::vector<Vec3> line);

}  // namespace wireplan::preprocess
