#pragma once
/// What contrast-filled lumen looks like at given points of a CT, and the band that follows from
/// it.
#include <optional>
#include <string>
#include <vector>

#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// "(1.0, 2.0, 3.0)" and a number in few digits, for messages.
std::string to_text(const Vec3& v);
std::string to_text(double value);

/// The lumen round a point that lies in it or within 2.5 mm of it.
struct LumenSample {
  Vec3 point = Vec3::Zero();  // as given                                            [mm]
  double level_hu = 0.0;      // median of the contrast                              [HU]
  double noise_hu = 0.0;      // sigma, between neighbouring voxels                  [HU]
};

/// How a vessel is told from what surrounds it.
struct Band {
  double lower_hu = 0.0;      // where the lumen ends: half of the contrast               [HU]
  double connect_hu = 0.0;    // what is to be one vessel holds this or more              [HU]
  double upper_hu = 0.0;      // calcium, bone and metal lie above                        [HU]
  double smoothing_mm = 0.0;  // Gaussian sigma before the band is applied                [mm]
  double neck_mm = 0.0;       // contacts thinner than twice this are cut                 [mm]
  double way_hu = 0.0;        // within 3 mm of the way this is enough to connect         [HU]
  std::vector<Vec3> way;      // voxels of the brightest way from seed to target; may be empty
};

/// Level: the median of the lumen within 4 mm of the vessel's middle; where that are too few
/// voxels, of a ball of 1 mm (or one voxel) there. A point without contrast keeps the level at the
/// point. Noise: the smaller of two estimates, since each can only be too large. One is from second
/// differences within 10 mm, to which edges add; the other is the spread of the lumen within 4 mm,
/// to which the wall adds.
LumenSample sample_lumen(const Image& image, const Vec3& point);

/// The band from the samples; those of seeds come first. The surroundings count as 50 HU (soft
/// tissue and blood without contrast have 20 to 70, references B5), the lumen as the brightest of
/// the samples, since the wall darkens thin vessels. Contrast is the difference of the two.
/// - lower: half way between them. upper: 40 % of the contrast and three sigma above the lumen.
/// - smoothing: the least of 0, 0.4, 0.6 and 0.8 mm that brings the noise under 5 % of the
///   contrast; 0.8 mm if none does.
/// - neck: half a millimetre, but always so much that a voxel's nearest neighbours have to be lumen
///   too. A vessel is at least three voxels wide; rims of bone and of brighter veins are not.
/// - connect: 75 % of the contrast.
/// - way: with `to_target`, the way from the first sample to the last, within 60 mm of both, whose
///   darkest place is as bright as can be, and not below 30 % of the contrast. That place's value
///   is way_hu, or connect_hu where that is less. It is enough along the way alone: a narrow place
///   does not lower the bar for veins elsewhere.
/// `smoothing_mm` and `neck_mm` are used where they are given. Throws `Error` with the measured HU
/// where there is no contrast (below 150 HU) or where the noise is more than 35 % of it.
Band choose_band(const Image& image, const std::vector<LumenSample>& samples, bool to_target,
                 std::optional<double> smoothing_mm, std::optional<double> neck_mm);

/// Of the voxels within 2.5 mm of the point that lie in the band's lumen with all of a ball of the
/// neck's radius round them, the one whose ball is brightest at its darkest voxel. Empty where
/// there is none.
std::optional<Vec3> find_lumen_near(const Image& image, const Vec3& point, const Band& band);

}  // namespace wireplan::preprocess
