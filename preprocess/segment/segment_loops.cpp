#include "preprocess/segment/segment_loops.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <functional>
#include <limits>

#include "preprocess/segment/segment_leak.h"

namespace wireplan::preprocess {
namespace {

constexpr int kBits = 27, kMiddleBit = 13;
constexpr std::uint32_t kAllRound = ((1U << kBits) - 1U) & ~(1U << kMiddleBit);

/// Which bits are neighbours: by faces, edges and corners; and by faces among those that share a
/// face or an edge with the middle.
struct BitsRound {
  std::array<std::uint32_t, kBits> touching{}, by_face{};
  std::uint32_t faces = 0, faces_and_edges = 0;
};

BitsRound make_bits_round() {
  BitsRound bits;
  const auto apart = [](int a, int b) {
    return std::array<int, 3>{std::abs(a % 3 - b % 3), std::abs(a / 3 % 3 - b / 3 % 3),
                              std::abs(a / 9 - b / 9)};
  };
  for (int a = 0; a < kBits; ++a) {
    const auto from_middle = apart(a, kMiddleBit);
    const int steps = from_middle[0] + from_middle[1] + from_middle[2];
    bits.faces |= steps == 1 ? 1U << a : 0U;
    bits.faces_and_edges |= steps == 1 || steps == 2 ? 1U << a : 0U;
  }
  for (int a = 0; a < kBits; ++a) {
    for (int b = 0; b < kBits; ++b) {
      const auto d = apart(a, b);
      if (a == b || a == kMiddleBit || b == kMiddleBit) continue;
      if (std::max({d[0], d[1], d[2]}) == 1) bits.touching[a] |= 1U << b;
      if (d[0] + d[1] + d[2] == 1) bits.by_face[a] |= 1U << b;
    }
    bits.by_face[a] &= bits.faces_and_edges;
  }
  return bits;
}

/// Of `all`, what hangs together with the lowest bit of `start`.
std::uint32_t grow_bits(const std::array<std::uint32_t, kBits>& neighbours, std::uint32_t all,
                        std::uint32_t start) {
  std::uint32_t grown = start & (~start + 1U), front = grown;
  while (front != 0) {
    const int bit = __builtin_ctz(front);
    front &= front - 1U;
    const std::uint32_t fresh = neighbours[static_cast<std::size_t>(bit)] & all & ~grown;
    grown |= fresh;
    front |= fresh;
  }
  return grown;
}

}  // namespace

int bit_of(const Voxel& step) { return kMiddleBit + step[0] + 3 * step[1] + 9 * step[2]; }

bool is_simple_by_corners(std::uint32_t inside) {
  static const BitsRound bits = make_bits_round();
  const std::uint32_t outside = ~inside & bits.faces_and_edges;
  if (inside == 0 || (outside & bits.faces) == 0) return false;
  return grow_bits(bits.touching, inside, inside) == inside &&
         ((outside & bits.faces) & ~grow_bits(bits.by_face, outside, outside & bits.faces)) == 0;
}

bool is_simple_by_faces(std::uint32_t inside) { return is_simple_by_corners(kAllRound & ~inside); }

std::vector<std::size_t> collect_part(const Grid& grid, std::size_t start, const Labels& marked,
                                      Labels& seen) {
  std::vector<std::size_t> queue = {start};
  seen[start] = 1;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    for_each_neighbour(grid, queue[next], [&](std::size_t m, const Voxel&) {
      if (marked[m] == 0 || seen[m] != 0) return;
      seen[m] = 1;
      queue.push_back(m);
    });
  }
  return queue;
}

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
  const Labels grown = grow_simple(grid, order, labels, seed, std::less<>(), is_simple_by_faces);
  Labels left = labels;
  for (std::size_t n = 0; n < left.size(); ++n) left[n] = grown[n] == 0 ? labels[n] : 0;
  LoopSearch found;
  Labels seen(labels.size(), 0);
  for (std::size_t n = 0; n < seen.size(); ++n) {
    if (left[n] == 0 || seen[n] != 0) continue;
    const std::vector<std::size_t> wall = collect_part(grid, n, left, seen);
    std::size_t deepest = n;
    bool divides = false;  // else a piece of its own
    for (const std::size_t m : wall) {
      if (depth[m] > depth[deepest]) deepest = m;
      for_each_face_neighbour(grid, m,
                              [&](std::size_t beside) { divides = divides || grown[beside] != 0; });
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
