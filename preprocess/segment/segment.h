#pragma once
/// HU image -> mask of the arterial lumen.
#include <optional>
#include <string>
#include <vector>

#include "preprocess/segment/mask_shape.h"
#include "preprocess/segment/segment_band.h"
#include "preprocess/segment/segment_leak.h"
#include "preprocess/segment/segment_loops.h"
#include "preprocess/segment/segment_touch.h"
#include "preprocess/segment/way_doubts.h"
#include "preprocess/vessel.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

struct SegmentOptions {
  /// Band of contrast-filled lumen, inclusive, lower < upper. Give both or neither. Without them
  /// the lumen's level is measured at the seeds and the target, and followed between them; these
  /// points may lie up to 2.5 mm beside the lumen, where they have contrast themselves.     [HU]
  std::optional<double> lower_hu = {}, upper_hu = {};
  bool hounsfield = true;           // the volume's values are HU: a CT
  std::vector<Vec3> seeds = {};     // inside the lumen; at least one                       [mm]
  std::optional<Vec3> target = {};  // to be in one piece with the first seed               [mm]
  /// Gaussian sigma before the band is applied. Without it: 0 where the band is given, else chosen
  /// with the band.                                                                        [mm]
  std::optional<double> smoothing_mm = {};
  /// Contacts with other bright things are cut where they are thinner than twice this, and so are
  /// arteries. Without it: as smoothing_mm.                                                [mm]
  std::optional<double> neck_opening_mm = {};
  /// Without a band: how far from the box round the points arteries are looked for.        [mm]
  double reach_mm = 80.0;
  MaskLimits limits = {};  // of the mask, and of what the band connects (require_no_flood)
};

/// The lumen at a place of a way.
struct LevelAlong {
  Vec3 place = Vec3::Zero();  //                                                             [mm]
  double arc_mm = 0.0;        // from the first seed
  double level_hu = 0.0;      //                                                             [HU]
};

/// Figures of a segmentation for the log and the report.
struct SegmentStatistics {
  std::vector<LumenSample> samples;  // of seeds and target
  Band band;                         // that was used
  /// Where no band was given: the levels along the ways from the first seed, every 10 mm.
  std::vector<LevelAlong> along;
  double volume_mm3 = 0.0;
  double mean_hu = 0.0;                 // of the unsmoothed image inside the mask             [HU]
  double removed_by_opening_mm3 = 0.0;  // if it is much more than the vessel, a leak was cut
  double bright_boundary = 0.0;         // share of the surface that lies against bone or calcium
  bool touches_border = false;          // of the volume: the vessel is cut there
  LeakSearch search;                    // the way from seed to target, and the leaks cut
  /// Where no band was given: the ways from the first seed to those of the others and to the
  /// target, the last, that lie in other voxels.
  std::vector<Centerline> ways;
  std::vector<WayDoubt> way_doubts;  // where none was given
  std::vector<Leak> doubtful;        // what was kept, though it may be a vein
  std::vector<Leak> branches;        // side branches that were kept by their shape alone
  MaskShape shape;                   // where a band was given before touches are cut
  LoopSearch loops;                  // where none was given
  std::vector<Touch> touches;        // by their values, then by their shape [HU, mm]
  std::size_t dipping = 0;           // of these by their values
};

struct Segmentation {
  Mask mask;  // on the full grid of the image
  SegmentStatistics statistics;
};

/// With a band:
///   1. Smooth, and take the voxels in the band.
///   2. Keep what is connected to the seeds through voxel faces.
///   3. Cut thin necks (prototypes A).
///   4. Cut leaks (segment_leak.h).
/// Without one, within reach of the points:
///   1. Measure the lumen's level and noise at the points (segment_band.h), and smooth.
///   2. Find the ways between them (segment_way.h).
///   3. Find the lumen round the ways by the levels there, and cut what touches it
///      (segment_lumen.h). Smooth its boundary.
/// Then closed cavities are filled (calcium, noise; calcium on the wall stays out: no wire passes
/// there), what is no vessel is refused (mask_shape.h), and touches on the way are cut or told.
/// Throws `Error` when a seed lies outside the volume, outside the band (with the HU found there)
/// or in a vessel that the cut of necks removes; when there is no contrast; when the target is not
/// connected (with the nearest point reached); and when what was found lies in a shell of bone.
Segmentation segment(const Image& image, const SegmentOptions& options);

/// Whether the volume's values are HU. Where its file does not tell: a CT has air or fat, which no
/// other modality writes below zero, or no values that only others have.
bool in_hounsfield(const Image& image);

/// The same of the least and the largest value of a volume whose file does not tell.
bool looks_hounsfield(double least, double largest);

/// Volume, mean and whether the border is touched, of a mask on the image's grid.
void measure_mask(const Image& image, const Mask& mask, SegmentStatistics& statistics);

/// True where the voxel nearest to the point [mm] is labelled; false outside the grid.
bool contains(const Mask& mask, const Vec3& point);

/// From the point to the nearest centre of a labelled voxel, 0 in one [mm]; infinite for an empty
/// mask.
double compute_distance(const Mask& mask, const Vec3& point);

}  // namespace wireplan::preprocess
