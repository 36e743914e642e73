#pragma once
/// A CT volume of an abdomen from an anatomical description, with its truth. Tubes of varying
/// radius along smooth curves, ellipsoids and vertebrae are sampled with partial volume, blurred by
/// a point spread and given noise from a seed.
#include <cstdint>
#include <string>
#include <vector>

#include "preprocess/vessel.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

enum class PhantomTubeKind { kTissue, kVein, kArtery };  // what comes later is painted over it

/// A tube along a smooth curve (centripetal Catmull-Rom through the control points), its radius
/// linear between them; a half ball closes either end. Vessels, and by kTissue muscles and bowel.
struct PhantomTube {
  std::string name;
  PhantomTubeKind kind = PhantomTubeKind::kArtery;  // only arteries are in the true lumen
  double hu = 0.0;                                  //                                    [HU]
  double wall_mm = 0.0;     // of soft tissue around the lumen; 0: none                   [mm]
  Eigen::Matrix3Xd points;  // (3, c), c >= 2, neighbours apart                           [mm]
  Eigen::VectorXd radius;   // (c)                                                        [mm]
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
  double blur_mm = 0.5;    // sigma of the point spread                       [mm]
  double noise_hu = 20.0;  // sigma of the noise in the volume, correlated by the point spread
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

/// The axis of a tube with its radius, evenly resampled at most 0.5 mm apart, ends included.
Centerline phantom_axis(const PhantomTube& tube);

/// Paints, from below: air, skin, fat, body, organs, tissue tubes, vertebrae, walls and lumens of
/// veins, walls and lumens of arteries, calcium. Deterministic: the same spec gives the same bytes
/// at any thread count. Expects positive sizes, calcium on a tube that exists.
Phantom make_phantom(const PhantomSpec& spec);

}  // namespace wireplan::preprocess
