#include "preprocess/segment/segment_loops.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <queue>
#include <utility>

#include "preprocess/segment/segment_leak.h"

namespace wireplan::preprocess {
namespace {

constexpr std::size_t kCubeVoxels = 27, kCubeMiddle = 13;
using Cube = std::array<bool, kCubeVoxels>;  // a voxel's neighbours, x first; the middle is itself

std::size_t cube_index(const Voxel& step) {
  return static_cast<std::size_t>(step[0] + 1 + 3 * (step[1] + 1) + 9 * (step[2] + 1));
}

/// Which voxels of a cube are neighbours, without the middle one.
struct CubeNeighbours {
  std::array<std::vector<std::size_t>, kCubeVoxels> by_faces, by_all;
  std::array<int, kCubeVoxels>
      steps{};  // from the middle: 1 by a face, 2 by an edge, 3 by a corner
};

CubeNeighbours make_cube_neighbours() {
  CubeNeighbours made;
  const auto place = [](std::size_t k) {
    const int n = static_cast<int>(k);
    return Voxel{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
  };
  for (std::size_t a = 0; a < kCubeVoxels; ++a) {
    const Voxel from = place(a);
    made.steps[a] = std::abs(from[0]) + std::abs(from[1]) + std::abs(from[2]);
    for (std::size_t b = 0; b < kCubeVoxels; ++b) {
      if (b == a || b == kCubeMiddle) continue;
      const Voxel to = place(b);
      const Voxel away = {std::abs(to[0] - from[0]), std::abs(to[1] - from[1]),
                          std::abs(to[2] - from[2])};
      if (*std::max_element(away.begin(), away.end()) > 1) continue;
      made.by_all[a].push_back(b);
      if (away[0] + away[1] + away[2] == 1) made.by_faces[a].push_back(b);
    }
  }
  return made;
}

/// Takes the piece that `start` is in out of `left`.
void take_piece(const std::array<std::vector<std::size_t>, kCubeVoxels>& neighbours,
                std::size_t start, Cube& left) {
  std::array<std::size_t, kCubeVoxels> queue{};
  std::size_t count = 0;
  queue[count++] = start;
  left[start] = false;
  for (std::size_t next = 0; next < count; ++next) {
    for (const std::size_t beside : neighbours[queue[next]]) {
      if (!left[beside]) continue;
      left[beside] = false;
      queue[count++] = beside;
    }
  }
}

/// Whether the middle can be added to what is `inside` without a change of topology.
bool is_simple(const Cube& inside) {
  static const CubeNeighbours kNeighbours = make_cube_neighbours();
  Cube near = inside, outside{};
  for (std::size_t k = 0; k < kCubeVoxels; ++k) {
    if (kNeighbours.steps[k] > 2 || k == kCubeMiddle) near[k] = false;
    outside[k] = !inside[k] && k != kCubeMiddle;
  }
  int pieces = 0;
  for (std::size_t k = 0; k < kCubeVoxels; ++k) {
    if (kNeighbours.steps[k] != 1 || !near[k]) continue;
    take_piece(kNeighbours.by_faces, k, near);
    ++pieces;
  }
  if (pieces != 1) return false;
  const auto first = std::find(outside.begin(), outside.end(), true);
  if (first == outside.end()) return false;
  take_piece(kNeighbours.by_all, static_cast<std::size_t>(first - outside.begin()), outside);
  return std::find(outside.begin(), outside.end(), true) == outside.end();
}

/// Step 1; the largest of `order` comes first.
Labels grow_simple(const Grid& grid, const Labels& labels, const std::vector<float>& order,
                   std::size_t seed) {
  Labels grown(labels.size(), 0), waiting(labels.size(), 0);
  std::priority_queue<std::pair<float, std::size_t>> queue;
  const auto take = [&](std::size_t n) {
    grown[n] = 1;
    for_each_neighbour(grid, n, [&](std::size_t m, const Voxel&) {
      if (labels[m] == 0 || grown[m] != 0 || waiting[m] != 0) return;
      waiting[m] = 1;
      queue.push({order[m], m});
    });
  };
  take(seed);
  while (!queue.empty()) {
    const std::size_t n = queue.top().second;
    queue.pop();
    waiting[n] = 0;
    Cube inside{};
    for_each_neighbour(grid, n, [&](std::size_t m, const Voxel& step) {
      inside[cube_index(step)] = grown[m] != 0;
    });
    if (is_simple(inside)) take(n);
  }
  return grown;
}

}  // namespace

LoopSearch cut_loops(const Grid& grid, std::size_t seed, const std::vector<Vec3>& way, double thin,
                     Labels& labels) {
  expects(seed < labels.size() && labels[seed] != 0 && thin >= 0.0);
  const std::vector<float> depth = measure_depth(grid, labels);
  std::vector<float> order = depth;
  for (const Vec3& place : way) {
    for (const std::size_t n : voxels_in_ball(grid, place, grid.spacing.maxCoeff())) {
      order[n] = std::numeric_limits<float>::infinity();
    }
  }
  const Labels grown = grow_simple(grid, labels, order, seed);
  LoopSearch found;
  Labels seen(labels.size(), 0);
  for (std::size_t n = 0; n < seen.size(); ++n) {
    if (labels[n] == 0 || grown[n] != 0 || seen[n] != 0) continue;
    std::vector<std::size_t> wall = {n};
    seen[n] = 1;
    std::size_t deepest = n;
    bool divides = false;  // else a piece of its own
    for (std::size_t next = 0; next < wall.size(); ++next) {
      if (depth[wall[next]] > depth[deepest]) deepest = wall[next];
      for_each_face_neighbour(grid, wall[next],
                              [&](std::size_t m) { divides = divides || grown[m] != 0; });
      for_each_neighbour(grid, wall[next], [&](std::size_t m, const Voxel&) {
        if (labels[m] == 0 || grown[m] != 0 || seen[m] != 0) return;
        seen[m] = 1;
        wall.push_back(m);
      });
    }
    if (!divides) continue;
    const auto radius = static_cast<double>(depth[deepest]);
    if (radius > thin) {
      found.left.push_back({center_of(grid, deepest), radius});
      continue;
    }
    for (const std::size_t m : wall) labels[m] = 0;
    ++found.cut;
  }
  std::stable_sort(found.left.begin(), found.left.end(),
                   [](const Loop& a, const Loop& b) { return a.radius_mm > b.radius_mm; });
  return found;
}

}  // namespace wireplan::preprocess
