#pragma once
/// Places at which a way between given points may leave its vessel for another that touches it.
#include <vector>

#include "preprocess/segment/segment_way.h"

namespace wireplan::preprocess {

/// Such a place.
struct WayDoubt {
  Vec3 place = Vec3::Zero();                //                                        [mm]
  double before_hu = 0.0, after_hu = 0.0;   // the lumen's level 10 mm from it        [HU]
  double neck_mm = 0.0;                     // inscribed radius of the widest way on  [mm]
  double beside_mm = 0.0;                   // of the lesser side, within 10 mm       [mm]
  bool by_level = false, by_width = false;  // what tells it
};

/// Of each way the place
/// - across which the level changes most over 20 mm, beyond its share of the change from one end to
///   the other, where that is 16 % of the contrast or more (in a CT alone): an artery's contrast
///   falls over its whole length;
/// - before and behind which, 10 mm on, the vessel is most wider than the widest connection between
///   the two, where that is half of the lesser or less and that is three voxels or more: a
///   stenosis, or vessels that touch.
/// `depth` is the inscribed radius in the lumen that was found round the ways [mm].
std::vector<WayDoubt> find_way_doubts(const LumenField& field, const std::vector<float>& depth,
                                      const std::vector<std::vector<WayLevel>>& ways);

}  // namespace wireplan::preprocess
