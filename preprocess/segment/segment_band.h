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

/// Level: median in a ball of 1 mm (or one voxel) round the middle of the vessel. Noise: the less
/// of two figures that both err upward, from second differences over tissue and lumen within 10 mm,
/// to which edges add, and from the spread in the lumen within 4 mm, to which the wall adds. A
/// point without contrast keeps its own level.
LumenSample sample_lumen(const Image& image, const Vec3& point);

/// The band from the samples; those of seeds first. Surroundings count as 50 HU (soft tissue and
/// blood without contrast have 20 to 70, references B5), the lumen as the brightest of the samples
/// (in thin vessels the wall's share darkens it).
/// - lower: half way; upper: 40 % of the contrast and three sigma above the lumen;
/// - smoothing: the least of 0, 0.4, 0.6 and 0.8 mm that brings the noise under 5 % of the
/// contrast;
/// - neck: half a millimetre, or as much as it takes to ask for the nearest neighbours as well: a
///   vessel is three voxels wide at least, and rims of bone and of brighter veins are not;
/// - connect: 75 % of the contrast. With `to_target` the way from the first sample to the last is
///   looked for that nowhere needs less than it must, within 60 mm of both, but not below 30 %:
///   along it way_hu is enough, so that a narrow place does not lower the bar for veins elsewhere.
/// Throws `Error` with the measured HU where there is no contrast (below 150 HU) or where the
/// noise is more than 35 % of it.
/// `smoothing_mm` and `neck_mm` are used where they are given.
Band choose_band(const Image& image, const std::vector<LumenSample>& samples, bool to_target,
                 std::optional<double> smoothing_mm, std::optional<double> neck_mm);

/// Of the voxels within 2.5 mm of the point, the one that lies deepest in the band's lumen (all
/// voxels of a ball of the neck's radius round it are bright enough); none where there is none.
std::optional<Vec3> find_lumen_near(const Image& image, const Vec3& point, const Band& band);

}  // namespace wireplan::preprocess
