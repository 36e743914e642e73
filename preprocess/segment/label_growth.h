#pragma once
/// An artery that labels lack, grown from the volume beyond them to a point in it.
#include "preprocess/segment/label_mask.h"
#include "preprocess/segment/mask_shape.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// What was added to the mask.
struct Growth {
  std::size_t from = 0;       // index of the class that it goes on from, and counts as
  Vec3 start = Vec3::Zero();  // where the way leaves the labels                          [mm]
  double length_mm = 0.0;     // of the way from there to the point
  double radius_mm = 0.0;     // inscribed, the least along that way
  double volume_mm3 = 0.0;
};

/// Segments the volume (segment.h) from the middle of the labels nearest to the point, with a band
/// chosen from there and from the point, and adds of what is found the vessel round the way between
/// them: all within 1.5 of its inscribed radius and a voxel. The image lies on the mask's grid.
/// Throws `Error` as segment() does with these limits: no contrast, or not connected.
Growth grow_to(const Image& image, const Vec3& point, LabelMask& labels,
               const MaskLimits& limits = {});

}  // namespace wireplan::preprocess
