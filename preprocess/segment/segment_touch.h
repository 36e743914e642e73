#pragma once
/// Touches: where a mask joins parts of a vessel that lie side by side and are far apart along it.
#include <cstddef>
#include <vector>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {

/// A place through which the way from the access to an end leads, though the vessel can also be
/// followed round.
struct Touch {
  Vec3 place = Vec3::Zero();  // the middle of the contact                               [mm]
  double level = 0.0;         // the most of it: value, or inscribed radius          [HU, mm]
  double side = 0.0;          // the same of the lesser side
  double through_mm = 0.0;    // the way through it to the end
  double round_mm = 0.0;      // and without it
  bool cut = false;           // it is no longer in the mask
};

/// Cuts touches at which the values dip, from `labels` (1 inside).
///   1. From the first of the ends, which is the access, the mask is filled from bright to dark,
///      and no voxel is taken that would close a loop. Of each loop a sheet is left out, where
///      it is darkest.
///   2. Where the shortest passable way (grid_search.h, Cost::kRoute) to another end crosses
///      such a sheet, and the way round is longer by 20 mm and five radii, the sheet is looked at.
///   3. It is cut if it is darker than both sides by a fifth of what they are above `edge`, the
///      value where the lumen ends; if both go on in two directions, as limbs that pass each other
///      do (at a stenosis a part ends); and if they come within 2.5 mm or three voxels of each
///      other undimmed (a bridge that is dark for longer is a thin vessel).
/// A contact within 2 mm of one of `kept` is real, and stays. All ends stay connected.
std::vector<Touch> cut_touches(const Grid& grid, const std::vector<float>& values, double edge,
                               const std::vector<std::size_t>& ends, const std::vector<Vec3>& kept,
                               Labels& labels);

/// Touches by the shape alone: the mask is filled from wide to narrow, and a sheet is told if its
/// inscribed radius is less than three quarters of that of both sides. Nothing is cut.
std::vector<Touch> find_touches(const Grid& grid, const Labels& labels,
                                const std::vector<std::size_t>& ends,
                                const std::vector<Vec3>& kept);

}  // namespace wireplan::preprocess
