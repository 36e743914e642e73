#pragma once
/// What contrast-filled lumen looks like at given points of a CT, and the band that follows from
/// it.
#include <cstddef>
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
  double scatter_hu = 0.0;    // sigma of the values of which the level is the median [HU]
  std::size_t voxels = 0;     // of which the level is the median
  double error_hu = 0.0;      // standard error of the level                         [HU]
};

/// How a vessel is told from what surrounds it. Where it was chosen, the values are those at the
/// brightest of the points: elsewhere they follow the vessel (segment_lumen.h).
struct Band {
  double lower_hu = 0.0;         // where the lumen ends: half of the contrast            [HU]
  double connect_hu = 0.0;       // what is to be one vessel holds this or more           [HU]
  double upper_hu = 0.0;         // calcium, bone and metal lie above                     [HU]
  double smoothing_mm = 0.0;     // Gaussian sigma before the band is applied             [mm]
  double neck_mm = 0.0;          // contacts thinner than twice this are cut              [mm]
  double surroundings_hu = 0.0;  // from which contrast counts                            [HU]
  double contrast_hu = 0.0;      // of the brightest of the points                        [HU]
};

/// Level: the median of the lumen within 6 mm of the vessel's middle, over `surroundings` [HU];
/// where that are too few voxels, of a ball of 1 mm (or one voxel) there. A point without contrast,
/// in a ball of 2 mm either, keeps the level at the point. Noise: the smaller of two estimates,
/// since each can only be too large. One is from second differences within 10 mm, to which edges
/// add; the other is the spread of the lumen within 6 mm, to which the wall adds.
LumenSample sample_lumen(const Image& image, const Vec3& point, double surroundings);

/// Samples again, without what is brighter than lumen, each point that lies in plaque: its core
/// scatters by a fifth of its contrast and 2.5 times the noise, and has 1.2 times the contrast of
/// the other points whose cores do not; or it has no core and 1.5 times theirs, or an even one and
/// twice theirs. The sample stays where no larger and even core is found beside it, of at most 1.3
/// times their contrast. Of a CT alone.
void sample_beside_calcium(const Image& image, double surroundings,
                           std::vector<LumenSample>& samples);

/// What surrounds the vessel at the points: in HU 50 (soft tissue and blood without contrast have
/// 20 to 70, references B5), in other units the median of what within 15 mm of the points holds
/// less than half of the value there.
double find_surroundings(const Image& image, const std::vector<Vec3>& points, bool hounsfield);

/// The band from the samples. The lumen's level is that of the brightest, since the wall darkens
/// thin vessels, and contrast what it has over `surroundings`.
/// - lower: half of it. connect: 65 %. upper: 40 % of the contrast and three sigma above the lumen.
/// - smoothing: the least of 0, 0.4, 0.6 and 0.8 mm that brings the noise under 5 % of the
///   contrast; 0.8 mm if none does.
/// - neck: half a millimetre, but always so much that a voxel's nearest neighbours have to be lumen
///   too. A vessel is at least three voxels wide; rims of bone and of brighter veins are not.
/// `smoothing_mm` and `neck_mm` are used where they are given. Throws `Error` with the measured
/// values where there is no contrast: in HU less than 100, and two standard errors, over blood
/// without contrast (40 HU); in other units less than five times the noise; at one of several
/// points less than 40 % of that at the brightest. And where a point lies in bone or metal (over
/// 800 HU), or the noise is more than 35 % of the contrast.
Band choose_band(const Image& image, const std::vector<LumenSample>& samples, double surroundings,
                 bool hounsfield, std::optional<double> smoothing_mm,
                 std::optional<double> neck_mm);

/// Below this contrast over blood [HU] edges are uncertain: a warning is due.
inline constexpr double kSureContrastHu = 150.0, kBloodHu = 40.0;

/// Of the voxels within 2.5 mm of the point that lie in the band's lumen with all of a ball of the
/// neck's radius round them, the one whose ball is brightest at its darkest voxel. Empty where
/// there is none.
std::optional<Vec3> find_lumen_near(const Image& image, const Vec3& point, const Band& band);

}  // namespace wireplan::preprocess
