#pragma once
/// What the two ways to segment share: by a given band, and by levels that are measured. For use in
/// this folder.
#include <cstddef>
#include <string>
#include <vector>

#include "preprocess/segment/segment.h"
#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {

/// The part of the volume that is worked on, and what was found in it.
struct Region {
  Box box;
  Grid grid;
  Labels labels;
  std::vector<float> values;       // smoothed                                             [HU]
  std::vector<std::size_t> seeds;  // voxels; after them that of the target, where there is one
  double edge = 0.0;               // the least value where lumen ends                     [HU]
};

/// Up to the leaks; fill in samples, band, search and what was removed. By level either with an
/// upper bound of the lumen or, where no calcium or bone can be brighter, not `bounded`.
Region find_by_band(const Image& image, const SegmentOptions& options,
                    SegmentStatistics& statistics);
Region find_by_level(const Image& image, const SegmentOptions& options, bool bounded,
                     SegmentStatistics& statistics);

/// The seeds' voxels. Throws `Error` where one lies outside; points of another frame are the usual
/// mistake, so the message looks for it.
std::vector<Voxel> seed_voxels(const Grid& grid, const std::vector<Vec3>& seeds);

/// The error of a point that the lumen does not reach from the first seed, but comes as near as to
/// the voxel of `grid`. `values`: what counts as lumen ("160 to 300 HU").
Error not_connected(const Image& image, const SegmentOptions& options, const Vec3& point,
                    const Grid& grid, std::size_t nearest, const std::string& values);

/// "160 to 300 HU"
std::string band_text(const Band& band);

/// Refuses what counts as lumen where it fills all of its grid: a vessel has a wall, from which
/// depths count.
void require_wall(const Labels& labels, const Vec3& point, const Band& band);

/// How far beside what was found a target may lie [mm].
inline constexpr double kTargetReachMm = 3.0;

}  // namespace wireplan::preprocess
