#pragma once
/// A CT volume from an anatomical description, with its truth. Tubes of varying radius along smooth
/// curves, ellipsoids and vertebrae are sampled with partial volume, blurred by a point spread and
/// given noise from a seed.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "preprocess/vessel.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// What comes later is painted over it. Thrombus lines a sac, in which the artery's lumen lies.
enum class PhantomTubeKind { kTissue, kVein, kThrombus, kArtery };

/// A tube along a smooth curve (centripetal Catmull-Rom through the control points), its radius
/// linear between them; a half ball closes either end. Vessels, and by kTissue muscles and bowel.
struct PhantomTube {
  std::string name;
  PhantomTubeKind kind = PhantomTubeKind::kArtery;  // only arteries are in the true lumen
  double hu = 0.0;                                  //                                    [HU]
  double wall_mm = 0.0;           // of soft tissue around the lumen; 0: none                   [mm]
  Eigen::Matrix3Xd points;        // (3, c), c >= 2, neighbours apart                           [mm]
  Eigen::VectorXd radius;         // (c)                                                        [mm]
  Eigen::VectorXd hu_along = {};  // (c) in place of `hu`, linear between the points; or (0)  [HU]
};

/// An organ, or with a shell a bone.
struct PhantomEllipsoid {
  std::string name;
  double hu = 0.0;                                       //                       [HU]
  Vec3 center = Vec3::Zero(), semi_axes = Vec3::Ones();  //                       [mm]
  Mat3 rotation = Mat3::Identity();         // columns: directions of the semi-axes, LPS
  double shell_mm = 0.0, shell_hu = 700.0;  // outermost layer; 0: none
};

/// A vertebra: an elliptic cylinder along z with a dense shell round a spongy core, and behind it
/// the arch round the spinal canal, two transverse processes and the spinous process, whose sizes
/// follow from the body's.
struct PhantomVertebra {
  Vec3 center = Vec3::Zero();     // of the body                                        [mm]
  Vec3 semi_axes = Vec3::Ones();  // half width, half depth, half height                [mm]
  double shell_mm = 1.5, shell_hu = 700.0, core_hu = 230.0;
};

/// Of the vertebra's parts the smallest semi-axis [mm]; its shell has to be thinner.
double thinnest_part(const PhantomVertebra& vertebra);

/// A plaque: a lens of calcium inside the lumen, flat on the wall of the named tube, which thins
/// out toward its rim. It narrows the lumen and is no part of the true one.
struct PhantomCalcium {
  std::string tube;
  double at = 0.5;            // middle, as a fraction of the tube's arc length
  double angle_deg = 0.0;     // round the tube: 0 anterior (-y made normal to the tangent; superior
                              // where the tube runs front to back), positive right-handed
  double length_mm = 5.0;     // along the tube, rim to rim
  double width_deg = 60.0;    // round the tube, rim to rim
  double thickness_mm = 1.5;  // in the middle; below half the tube's radius
  double hu = 900.0;
};

/// A stent: rings of zigzag wire (sines, `crowns` round the tube) on the outside of the lumen of
/// the named tube. It is no part of the true lumen.
struct PhantomStent {
  std::string tube;
  double from = 0.3, to = 0.5;  // fractions of the tube's arc length, from < to
  double strut_mm = 0.3;        // thickness of the wire
  double pitch_mm = 6.0;        // from ring to ring
  double amplitude_mm = 2.0;    // half the height of a ring
  int crowns = 6;
  double hu = 2500.0;
};

/// The patient moved between two slices: all above lies shifted.
struct PhantomBreath {
  double above_z_mm = 0.0;
  Vec3 shift_mm = Vec3::Zero();
};

struct PhantomSpec {
  Grid grid;
  Vec3 body_center = Vec3::Zero();
  Vec3 body_semi_axes = Vec3::Ones();  // elliptic cylinder along z; the third is not used  [mm]
  double air_hu = -1000.0, fat_hu = -100.0, tissue_hu = 45.0;  // tissue: skin, muscle, walls
  double skin_mm = 2.0;
  double fat_mm = 15.0;                  // thickness under the skin
  std::vector<PhantomEllipsoid> organs;  // a later one is painted over an earlier one
  std::vector<PhantomVertebra> vertebrae;
  std::vector<PhantomTube> tubes;
  std::vector<PhantomCalcium> calcium;
  std::vector<PhantomStent> stents;
  std::optional<PhantomBreath> breath = {};
  double blur_mm = 0.5;    // sigma of the point spread                       [mm]
  double noise_hu = 20.0;  // sigma of the noise in the volume
  /// 0: the point spread correlates the noise. Else it has the texture of a reconstruction kernel
  /// in the plane of the slices: white noise less its own blur, a difference of Gaussians of this
  /// sigma and twice it. That is a band as ramp filter and roll-off leave it: little power at low
  /// frequencies, most near 0.15 / sigma per mm. Between slices it is not correlated.     [mm]
  double noise_texture_mm = 0.0;
  std::uint64_t seed = 1;
  int supersampling = 3;  // samples per axis of a voxel that a boundary crosses: partial volume
};

struct Phantom {
  Image image;                          // HU
  Mask lumen;                           // voxels whose centre lies in an artery's lumen
  std::vector<std::string> names;       // of the arteries, in the order of `centerlines`
  std::vector<Centerline> centerlines;  // true axes, about every 0.5 mm, as far as they lie in the
                                        // volume; the radius is the tube's, before plaque
};

/// Expects that there is one of this name.
const PhantomTube& tube_named(const PhantomSpec& spec, const std::string& name);

/// The axis of a tube with its radius, evenly resampled at most 0.5 mm apart, ends included.
Centerline phantom_axis(const PhantomTube& tube);

/// HU at the points of the axis.
Eigen::VectorXd phantom_hu(const PhantomTube& tube);

/// Where a point of the description lies in the volume: moved where it is above a breath.
Vec3 moved_by_breath(const PhantomSpec& spec, const Vec3& point);

/// Paints, from below: air, skin, fat, body, organs, tissue tubes, vertebrae, walls and lumens of
/// veins, of thrombus and of arteries, calcium, stents. Deterministic: the same spec gives the same
/// bytes at any thread count. Expects positive sizes, calcium and stents on tubes that exist.
Phantom make_phantom(const PhantomSpec& spec);

}  // namespace wireplan::preprocess
