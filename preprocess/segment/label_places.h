#pragma once
/// Places in a labelled artery by its name: so far beyond where it leaves its parent, or at its
/// end.
#include <cstddef>
#include <string>
#include <vector>

#include "preprocess/segment/label_mask.h"

namespace wireplan::preprocess {

enum class BranchEnd {
  kDistal,    // the end farthest from the parent
  kSuperior,  // of a trunk, which has no parent: its end nearer to the head ...
  kInferior,  // ... or to the feet
};

/// The middle of a class, from where it leaves its parent to its farthest end; of the trunk, from
/// its superior to its inferior end.
struct LabelledWay {
  int parent = -1;           // index of the class that it leaves; -1: it is the trunk
  std::vector<Vec3> points;  // about a voxel apart                                   [mm]
  std::vector<double> arc;   // from the first of them                                [mm]
};

/// The trunk is the class with most voxels in the mask; a parent is the neighbour through fewest
/// classes from it, and of several that which most voxel faces join. The middle is that of the
/// voxels equally far (through the class) from the ostium, so lengths are good to about a voxel.
/// Throws `Error` where nothing of the class is in the mask, or nothing but bare contacts joins it.
LabelledWay find_labelled_way(const LabelMask& labels, const std::vector<LabelClass>& classes,
                              std::size_t index);

/// The point so far along the way [mm]. Throws `Error` with the way's length where that is less.
Vec3 find_beyond_ostium(const LabelledWay& way, double beyond_mm, const std::string& name);

/// The point a radius of the vessel before the end, so that it lies inside. Throws `Error` where
/// the end is one of a trunk and the class has a parent, or the other way round; or where the ends
/// of a trunk are equally high.
Vec3 find_end(const LabelMask& labels, const LabelledWay& way, BranchEnd end,
              const std::string& name);

}  // namespace wireplan::preprocess
