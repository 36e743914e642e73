#pragma once
/// HU image -> mask of the arterial lumen.
#include <optional>
#include <string>
#include <vector>

#include "preprocess/segment/segment_band.h"
#include "preprocess/segment/segment_leak.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

struct SegmentOptions {
  /// Band of contrast-filled lumen, inclusive, lower < upper; both or none. None: chosen from what
  /// the volume holds at the seeds and the target, which may then lie 2.5 mm beside the lumen. [HU]
  std::optional<double> lower_hu = {}, upper_hu = {};
  std::vector<Vec3> seeds = {};     // inside the lumen; at least one                       [mm]
  std::optional<Vec3> target = {};  // to be in one piece with the first seed               [mm]
  /// Gaussian sigma before the band is applied; none: 0 with a band given, chosen with it  [mm]
  std::optional<double> smoothing_mm = {};
  /// Contacts with other bright things thinner than twice this are cut, and so are arteries thinner
  /// than that; none: as above                                                               [mm]
  std::optional<double> neck_opening_mm = {};
};

/// Figures of a segmentation for the log and the report.
struct SegmentStatistics {
  std::vector<LumenSample> samples;  // of seeds and target
  Band band;                         // that was used
  double volume_mm3 = 0.0;
  double mean_hu = 0.0;                 // of the unsmoothed image inside the mask             [HU]
  double removed_by_opening_mm3 = 0.0;  // much more than the vessel itself where a leak was cut
  double bright_boundary = 0.0;         // share of the surface that lies against bone or calcium
  bool touches_border = false;          // of the volume: the vessel is cut there
  LeakSearch search;                    // the way from seed to target, and the leaks cut
};

struct Segmentation {
  Mask mask;  // on the full grid of the image
  SegmentStatistics statistics;
};

/// Smooth, take the band, keep what is connected to the seeds through voxel faces, cut thin necks
/// (prototypes A), add the rim down to half of the contrast where the band was chosen, cut leaks
/// (segment_leak.h), fill cavities closed in all directions (calcium, noise). Calcium on the wall
/// stays out: the wire cannot pass there. Works in the part of the volume that the vessel needs;
/// the answer does not depend on that. Throws `Error` when a seed lies outside the volume, outside
/// the band (with the HU found there), or in a vessel that the opening removes; without contrast;
/// when the target is not connected, with the nearest point reached; when what was found lies in
/// a shell of bone.
Segmentation segment(const Image& image, const SegmentOptions& options);

/// True where the voxel nearest to the point [mm] is labelled; false outside the grid.
bool contains(const Mask& mask, const Vec3& point);

/// From the point to the nearest centre of a labelled voxel [mm]; infinite for an empty mask.
double compute_distance(const Mask& mask, const Vec3& point);

}  // namespace wireplan::preprocess
