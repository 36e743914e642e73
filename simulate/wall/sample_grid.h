#pragma once
/// The sparse grid on which the lumen's field is measured before splines follow it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::simulate {

/// Signed distances on the nodes of bricks of kSide^3, allocated where the wall is near. Only used
/// while the field is built.
struct SampleGrid {
  static constexpr int kSide = 8;
  static constexpr int kVolume = kSide * kSide * kSide;
  static constexpr std::int32_t kOutside = -1, kInside = -2, kUnknown = -3;

  Vec3 origin;
  double spacing, limit;  // distances are cut to +-limit
  std::array<int, 3> bricks;
  std::vector<std::int32_t> slot;           // of each brick; negative: no samples there
  std::vector<std::array<int, 3>> sampled;  // the brick of each slot
  std::vector<double> values;               // kVolume per slot

  std::size_t brick_index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(bricks[0]) *
               (static_cast<std::size_t>(j) +
                static_cast<std::size_t>(bricks[1]) * static_cast<std::size_t>(k));
  }
  static std::size_t node_index(int i, int j, int k) {
    return static_cast<std::size_t>(i + kSide * (j + kSide * k));
  }
  /// Value at a node by its index in the whole grid; beyond the samples +-limit.
  double at(const std::vector<double>& field, int i, int j, int k) const {
    const std::array<int, 3> brick = {i >> 3, j >> 3, k >> 3};
    for (int d = 0; d < 3; ++d) {
      if (brick[d] < 0 || brick[d] >= bricks[d]) return -limit;
    }
    const std::int32_t s = slot[brick_index(brick[0], brick[1], brick[2])];
    if (s == kOutside) return -limit;
    if (s == kInside) return limit;
    return field[static_cast<std::size_t>(s) * kVolume + node_index(i & 7, j & 7, k & 7)];
  }
};

/// Grid indices of the nodes in a box.
struct NodeBox {
  std::array<int, 3> low, high;
};

inline NodeBox node_box(const SampleGrid& grid, const Vec3& low, const Vec3& high) {
  NodeBox box{};
  for (int d = 0; d < 3; ++d) {
    box.low[d] = std::max(0, static_cast<int>(std::ceil((low[d] - grid.origin[d]) / grid.spacing)));
    box.high[d] = std::min(grid.bricks[d] * SampleGrid::kSide - 1,
                           static_cast<int>(std::floor((high[d] - grid.origin[d]) / grid.spacing)));
  }
  return box;
}

/// Nodes within the grid's limit of the box of a triangle.
inline NodeBox node_box(const SampleGrid& grid, const Surface& surface, Eigen::Index f) {
  const Eigen::Vector3i t = surface.triangles.col(f);
  const Vec3 a = surface.vertices.col(t[0]), b = surface.vertices.col(t[1]),
             c = surface.vertices.col(t[2]);
  return node_box(grid, a.cwiseMin(b).cwiseMin(c).array() - grid.limit,
                  a.cwiseMax(b).cwiseMax(c).array() + grid.limit);
}

inline NodeBox whole_box(const SampleGrid& grid) {
  NodeBox box{};
  for (int d = 0; d < 3; ++d) box.high[d] = grid.bricks[d] * SampleGrid::kSide - 1;
  return box;
}

inline bool overlap(const NodeBox& a, const NodeBox& b) {
  for (int d = 0; d < 3; ++d) {
    if (a.low[d] > b.high[d] || b.low[d] > a.high[d]) return false;
  }
  return true;
}

/// Calls visit(slot, i, j, k) for every brick of the box.
template <class Visit>
void for_each_brick(SampleGrid& grid, const NodeBox& box, const Visit& visit) {
  for (int k = box.low[2] >> 3; k <= box.high[2] >> 3; ++k) {
    for (int j = box.low[1] >> 3; j <= box.high[1] >> 3; ++j) {
      for (int i = box.low[0] >> 3; i <= box.high[0] >> 3; ++i) {
        visit(grid.slot[grid.brick_index(i, j, k)], i, j, k);
      }
    }
  }
}

/// Gives samples to the bricks of a box; their values come later.
inline void add_samples(SampleGrid& grid, const NodeBox& box) {
  for_each_brick(grid, box, [&](std::int32_t& s, int i, int j, int k) {
    if (s >= 0) return;
    s = static_cast<std::int32_t>(grid.sampled.size());
    grid.sampled.push_back({i, j, k});
  });
}

/// Calls visit(value, position) for every node of the box. Expects samples in all its bricks.
template <class Visit>
void for_each_node(SampleGrid& grid, const NodeBox& box, const Visit& visit) {
  for_each_brick(grid, box, [&](std::int32_t& s, int bi, int bj, int bk) {
    double* values = grid.values.data() + static_cast<std::size_t>(s) * SampleGrid::kVolume;
    for (int k = std::max(box.low[2], 8 * bk); k <= std::min(box.high[2], 8 * bk + 7); ++k) {
      for (int j = std::max(box.low[1], 8 * bj); j <= std::min(box.high[1], 8 * bj + 7); ++j) {
        for (int i = std::max(box.low[0], 8 * bi); i <= std::min(box.high[0], 8 * bi + 7); ++i) {
          visit(values[SampleGrid::node_index(i & 7, j & 7, k & 7)],
                Vec3(grid.origin + grid.spacing * Vec3(i, j, k)));
        }
      }
    }
  });
}

}  // namespace wireplan::simulate
