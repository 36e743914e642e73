#pragma once
/// The way between given points of a volume, where the contrast changes along the vessel.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {

/// The part of a volume that a lumen is looked for in.
struct LumenField {
  Grid grid;
  std::vector<float> raw;     // as in the volume                                          [HU]
  std::vector<float> values;  // smoothed                                                  [HU]
  double smoothing_mm = 0.0;  // by this sigma
  double surroundings = 0.0;  // from which a lumen's contrast counts                      [HU]
  double upper = 0.0;         // calcium, bone and metal lie above                         [HU]
  double noise = 0.0;         // sigma in `raw`                                            [HU]
  double core_part = 0.0;     // of the contrast, that a vessel has in its middle
  bool hounsfield = true;     // a CT: a vessel's level changes slowly, and bone is beyond `upper`
};

/// How a vessel's level is followed, and what blur takes of it: a scanner's point spread (sigma of
/// 0.6 mm assumed), the voxels, and the smoothing.
class LevelRule {
 public:
  explicit LevelRule(const LumenField& field);

  /// What blur leaves of the contrast in the middle of a vessel of this inscribed radius [mm]: of a
  /// cylinder 1 - exp(-r^2 / (2 sigma^2)); in the smoothed values, and in those of the volume.
  double seen(float depth) const;
  double seen_raw(float depth) const;

  /// Sigma of all that blurs the smoothed values [mm].
  double blur() const { return blur_; }

  /// The level [HU] after a step [mm] to where the middle of the vessel has this value. It is
  /// followed over 10 mm; a vessel of which blur takes over a fifth tells nothing.
  float follow(float level, double value, double seen, double step) const;

 private:
  double surroundings_, half_voxel_, blur_raw_, blur_;
};

/// The darkest that a vessel's surroundings look from its edge: half way from the lumen's level to
/// this lies what blur leaves of a wall before fat. Of no CT the surroundings [HU].
double darkest_beside(const LumenField& field);

/// Voxels that may be lumen.
struct Candidates {
  Labels labels;
  std::vector<float> depth;  // inscribed radius in those beyond half of the contrast       [mm]
};

/// Values from 45 % of `least_contrast` [HU] above the surroundings to `upper` that are connected
/// with the starts.
Candidates find_candidates(const LumenField& field, std::vector<std::size_t> starts,
                           double least_contrast);

/// A voxel of a way and the lumen's level there, without what blur takes of it.
struct WayLevel {
  std::size_t voxel = 0;
  float level = 0.0F;  //                                                                  [HU]
};

/// From the first of the points to each (to itself: that point alone); empty where there is none.
///   1. Each candidate counts as the least of its own and its nearest neighbours' values, as part
///      of the contrast that is expected there: that of the points, by 1 / distance^2. The way
///      leads over voxels that have as much of it as any connection has in its worst place, less
///      what noise makes of it (1.5 sigma of the smoothed values; 2.5 where the way found so is
///      cheaper by a quarter: what is brighter is then a detour through veins); less than 30 %
///      joins nothing. Where that leaves points apart, the neighbours' contrast counts from what is
///      darkest within two voxels, as dark as fat at most: it makes thin arteries' rims so dark.
///   2. Of these ways the cheapest is taken. A millimetre costs more where values fall short of the
///      level that the way has had over the last 10 mm by more than 12 %, or their means over some
///      1.5 mm by more than 6 %, where they exceed it by 12 %, and in narrow places; blur is
///      allowed for. The level is followed no lower than 95 % of the contrast that the points let
///      expect: a vein would else be free once it is entered (means and this of a CT alone). So
///      does a way that has become narrower and widens again, as where a vessel touches another: 40
///      mm for a factor e.
///   3. A way that avoids this runs along the edge of wide vessels. It is found again without that
///      cost, in the vessels that it leads through.
///   4. The levels are then averaged along it, over 7 mm to both sides.
std::vector<std::vector<WayLevel>> find_level_ways(const LumenField& field,
                                                   const Candidates& candidates,
                                                   const std::vector<WayLevel>& points);

}  // namespace wireplan::preprocess
