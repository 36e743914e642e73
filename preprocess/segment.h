#pragma once
/// HU image -> mask of the arterial lumen.
#include <vector>

#include "preprocess/image.h"

namespace wireplan::preprocess {

struct SegmentOptions {
  double lower_hu = 0.0;         // band of contrast-filled lumen, inclusive; lower < upper    [HU]
  double upper_hu = 0.0;         //                                                            [HU]
  std::vector<Vec3> seeds;       // inside the lumen; at least one                             [mm]
  double smoothing_mm = 0.0;     // Gaussian sigma before the band is applied; 0: none         [mm]
  double neck_opening_mm = 0.0;  // contacts with other bright things thinner than twice this are
                                 // cut, and so are arteries thinner than that; 0: none        [mm]
};

/// Figures of a segmentation for the log and the report.
struct SegmentStatistics {
  double volume_mm3 = 0.0;
  double mean_hu = 0.0;                 // of the unsmoothed image inside the mask             [HU]
  double removed_by_opening_mm3 = 0.0;  // much more than the vessel itself where a leak was cut
  bool touches_border = false;          // of the volume: the vessel is cut there
};

struct Segmentation {
  Mask mask;  // on the full grid of the image
  SegmentStatistics statistics;
};

/// Smooth, take the band, keep what is connected to the seeds through voxel faces, cut thin necks
/// (prototypes A), fill cavities closed in all directions (calcium, noise). Calcium on the wall
/// stays out: the wire cannot pass there. Works in the part of the volume that the vessel needs;
/// the answer does not depend on that. Throws `Error` when a seed lies outside the volume, outside
/// the band (with the HU found there), or in a vessel that the opening removes.
Segmentation segment(const Image& image, const SegmentOptions& options);

/// True where the voxel nearest to the point [mm] is labelled; false outside the grid.
bool contains(const Mask& mask, const Vec3& point);

/// From the point to the nearest centre of a labelled voxel [mm]; infinite for an empty mask.
double compute_distance(const Mask& mask, const Vec3& point);

}  // namespace wireplan::preprocess
