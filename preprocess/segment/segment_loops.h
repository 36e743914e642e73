#pragma once
/// Loops of a mask that are no vessel's: thin bridges between branches, and holes of noise.
#include <cstddef>
#include <cstdint>
#include <queue>
#include <utility>
#include <vector>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {

/// The bit that tells of a voxel's neighbour that lies so from it, of the 26 round it.
int bit_of(const Voxel& step);

/// Whether taking a voxel changes no loop, piece or cavity of what is `inside`, which is connected
/// through corners too, the outside through faces: one part of the inside touches it, and one of
/// the outside shares a face with it (Bertrand and Malandain, A new characterization of
/// three-dimensional simple points, Pattern Recognition Letters 15, 1994, theorem 2.9).
bool is_simple_by_corners(std::uint32_t inside);

/// The same where the inside is connected through faces and the outside through corners too.
bool is_simple_by_faces(std::uint32_t inside);

/// What is marked and hangs together with the voxel, through corners too; becomes seen.
std::vector<std::size_t> collect_part(const Grid& grid, std::size_t start, const Labels& marked,
                                      Labels& seen);

using Ordered = std::pair<float, std::size_t>;  // a voxel with its value

/// Grows a mask in `labels` from the start by simple points, what `later` puts last first.
template <typename Later, typename IsSimple>
Labels grow_simple(const Grid& grid, const std::vector<float>& values, const Labels& labels,
                   std::size_t start, Later later, IsSimple is_simple) {
  std::priority_queue<Ordered, std::vector<Ordered>, Later> queue(later);
  Labels grown(labels.size(), 0), waiting(labels.size(), 0);
  const auto take = [&](std::size_t n) {
    grown[n] = 1;
    for_each_neighbour(grid, n, [&](std::size_t m, const Voxel&) {
      if (labels[m] == 0 || grown[m] != 0 || waiting[m] != 0) return;
      waiting[m] = 1;
      queue.push({values[m], m});
    });
  };
  take(start);
  while (!queue.empty()) {
    const std::size_t n = queue.top().second;
    queue.pop();
    waiting[n] = 0;  // it comes again when more round it is taken
    std::uint32_t inside = 0;
    for_each_neighbour(grid, n, [&](std::size_t m, const Voxel& step) {
      if (grown[m] != 0) inside |= 1U << bit_of(step);
    });
    if (is_simple(inside)) take(n);
  }
  return grown;
}

/// A loop where it is thinnest.
struct Loop {
  Vec3 place = Vec3::Zero();  //                                                             [mm]
  double radius_mm = 0.0;     // inscribed, there
};

struct LoopSearch {
  std::vector<Loop> left;  // real ones: a ring of arteries, a bypass; the widest first
  std::size_t cut = 0;
};

/// Cuts each loop of `labels` (1 inside, in one piece with the voxel `seed`) in its thinnest place,
/// where the inscribed radius there is at most `thin` [mm], and never on the way [mm].
///   1. From the seed a second mask grows in the first by simple points, always by the deepest
///   voxel
///      that touches it, along the way first.
///   2. What it cannot take are walls one voxel thick across the loops. The thin ones are taken
///      out of `labels`.
LoopSearch cut_loops(const Grid& grid, std::size_t seed, const std::vector<Vec3>& way, double thin,
                     Labels& labels);

}  // namespace wireplan::preprocess
