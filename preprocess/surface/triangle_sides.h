#pragma once
/// How triangles hang together, whatever they make: their sides by edges, their neighbours, and
/// disjoint sets.
#include <algorithm>
#include <cstddef>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

/// One side of a triangle: from corner `corner` to the next, stored with the lower vertex first.
struct Side {
  int low, high, triangle, corner;
  bool forward;  // the triangle runs from low to high
};

/// All sides, those of one edge next to each other.
inline std::vector<Side> sorted_sides(const Surface& surface) {
  std::vector<Side> sides;
  sides.reserve(3 * static_cast<std::size_t>(surface.triangles.cols()));
  for (int t = 0; t < surface.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = surface.triangles(k, t), b = surface.triangles((k + 1) % 3, t);
      sides.push_back({std::min(a, b), std::max(a, b), t, k, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.triangle, a.corner) <
           std::tie(b.low, b.high, b.triangle, b.corner);
  });
  return sides;
}

/// Calls `visit(begin, end)` for the sides of each edge.
template <typename Visit>
void for_each_edge(const std::vector<Side>& sides, Visit visit) {
  for (auto begin = sides.begin(); begin != sides.end();) {
    auto end = begin + 1;
    while (end != sides.end() && end->low == begin->low && end->high == begin->high) ++end;
    visit(begin, end);
    begin = end;
  }
}

/// (3, m) the triangle across the edge from corner k to the next, which runs along it the other
/// way; -1 where there is none, or where more than two triangles meet.
inline Eigen::Matrix3Xi triangle_neighbours(const Surface& surface) {
  Eigen::Matrix3Xi neighbours = Eigen::Matrix3Xi::Constant(3, surface.triangles.cols(), -1);
  for_each_edge(sorted_sides(surface), [&](auto begin, auto end) {
    if (end - begin != 2 || begin->forward == (begin + 1)->forward) return;
    const Side &a = *begin, &b = *(begin + 1);
    neighbours(a.corner, a.triangle) = b.triangle;
    neighbours(b.corner, b.triangle) = a.triangle;
  });
  return neighbours;
}

/// Disjoint sets of 0..n-1; a set is named by its lowest member.
class DisjointSets {
 public:
  explicit DisjointSets(int count) : parent_(static_cast<std::size_t>(count)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int find(int k) {
    while (parent_[k] != k) k = parent_[k] = parent_[parent_[k]];
    return k;
  }
  void unite(int a, int b) {
    const std::pair<int, int> roots = std::minmax({find(a), find(b)});
    parent_[roots.second] = roots.first;
  }

 private:
  std::vector<int> parent_;
};

}  // namespace wireplan::preprocess
