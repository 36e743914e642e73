#include "preprocess/centerline/branch_start.h"

#include <algorithm>
#include <limits>

#include "preprocess/centerline/path_place.h"

namespace wireplan::preprocess {
namespace {

constexpr double kOneLine = 0.25;  // radii between lines that are one: chosen, noise is 0.1
constexpr double kParted = 0.6;    // ... and between lines that have parted

const Branch& branch_of(const std::vector<Branch>& known, int k) {
  return known.at(static_cast<std::size_t>(k));
}

/// Point of a line nearest to another: its index.
Eigen::Index nearest_point_of(const Centerline& line, const Vec3& p) {
  Eigen::Index best = 0;
  (line.points.colwise() - p).colwise().squaredNorm().minCoeff(&best);
  return best;
}

/// A branch, what begins at it, and all before it; those found first come first.
std::vector<int> family_of(const std::vector<Branch>& known, int branch) {
  std::vector<int> family;
  for (int k = branch; k >= 0; k = branch_of(known, k).parent) family.push_back(k);
  for (std::size_t k = 0; k < known.size(); ++k) {
    if (known[k].parent == branch) family.push_back(static_cast<int>(k));
  }
  std::sort(family.begin(), family.end());
  return family;
}

/// The one of these branches whose line is nearest to a point.
int nearest_of(const std::vector<Branch>& known, int parent, const Vec3& p) {
  int best = parent;
  double least = std::numeric_limits<double>::infinity();
  for (int k = parent; k >= 0; k = branch_of(known, k).parent) {
    const double off = find_place(p, branch_of(known, k).line).from_axis;
    if (off >= least) continue;
    least = off;
    best = k;
  }
  return best;
}

}  // namespace

BranchStart find_branch_start(const std::vector<Branch>& known, int parent,
                              const std::vector<Vec3>& line) {
  expects(!line.empty());
  BranchStart start{.parent = nearest_of(known, parent, line.front())};
  int on = parent;
  for (std::size_t i = 0; i < line.size(); ++i) {
    double nearest = std::numeric_limits<double>::infinity();
    int found = -1;
    for (const int k : family_of(known, on)) {
      const PathPlace place = find_place(line[i], branch_of(known, k).line);
      const double part = place.from_axis / std::max(place.radius, 1e-3);
      nearest = std::min(nearest, part);
      if (found < 0 && part <= kOneLine) found = k;
    }
    if (nearest > kParted) break;
    if (found < 0) continue;
    on = found;
    start = {.parent = found, .own_first = i};
  }
  const Vec3& first = line[start.own_first];
  start.at = nearest_point_of(branch_of(known, start.parent).line, first);
  for (const Branch* from = &branch_of(known, start.parent);
       from->parent >= 0 && from->line.arc_length(start.at) <= from->line.radius(0);
       from = &branch_of(known, start.parent)) {
    start.parent = from->parent;
    start.at = nearest_point_of(branch_of(known, start.parent).line, first);
  }
  return start;
}

BranchStart start_whole(const std::vector<Branch>& known, int parent,
                        const std::vector<Vec3>& line) {
  return {.parent = parent, .at = nearest_point_of(branch_of(known, parent).line, line.front())};
}

std::vector<Vec3> begin_line(const Centerline& from, const BranchStart& start,
                             std::vector<Vec3> line) {
  constexpr double kSame = 1e-9;  // mm
  line.erase(line.begin(), line.begin() + static_cast<std::ptrdiff_t>(start.own_first));
  const Vec3 at = from.points.col(start.at);
  if ((line.front() - at).norm() > kSame) line.insert(line.begin(), at);
  return line;
}

}  // namespace wireplan::preprocess
