#pragma once
/// Loops of a mask that are no vessel's: thin bridges between branches, and holes of noise.
#include <cstddef>
#include <vector>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {

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
///   1. From the seed a second mask grows in the first, always by the deepest voxel that touches it
///      (along the way first) and leaves its topology as it is: a simple point, whose neighbours in
///      the mask are one piece and whose neighbours outside are one (Bertrand and Malandain, A new
///      characterization of three-dimensional simple points, Pattern Recognition Letters 15, 1994,
///      theorem 2.9; here 6 neighbours inside and 26 outside).
///   2. What it cannot take are walls one voxel thick across the loops. The thin ones are taken
///      out of `labels`.
LoopSearch cut_loops(const Grid& grid, std::size_t seed, const std::vector<Vec3>& way, double thin,
                     Labels& labels);

}  // namespace wireplan::preprocess
