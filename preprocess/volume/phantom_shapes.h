#pragma once
/// The shapes of which a phantom is painted; for use in this folder. Each has a clearance: negative
/// inside, zero on its surface, and never changing faster than the point moves. So |clearance| > r
/// at the middle of a ball of radius r proves that no surface of the shape crosses that ball, which
/// is what makes painting fast.
#include <limits>
#include <vector>

#include "preprocess/volume/phantom.h"

namespace wireplan::preprocess {

/// Ellipsoid, or elliptic cylinder along its third axis (`half_height` finite or infinite).
struct EllipseShape {
  Vec3 center = Vec3::Zero();
  Mat3 to_unit = Mat3::Identity();  // maps the ellipsoid to the unit ball, the cylinder to r < 1
  double min_axis = 1.0;
  Vec3 along = Vec3::UnitZ();  // direction of the cylinder
  double half_height = std::numeric_limits<double>::infinity();
};

double clearance(const EllipseShape& e, const Vec3& p);

/// A piece of a tube: all balls with centre on a segment and linearly changing radius.
struct TubeSegment {
  Vec3 a = Vec3::Zero(), ab = Vec3::Zero();
  double inverse_squared_length = 0.0;
  double radius_a = 0.0, radius_ab = 0.0;  // radius at a, and its change from a to b
  double arc_a = 0.0, length = 0.0;
  double hu_a = 0.0, hu_ab = 0.0;  // at a, and its change from a to b                  [HU]
};

struct TubeShape {
  std::vector<TubeSegment> segments;
  double inverse_slope = 1.0;  // 1/sqrt(1 + (dr/ds)^2), largest slope: bounds the clearance's
};

/// The point of a tube nearest to another, and how far it lies inside.
struct TubeFoot {
  const TubeSegment* segment = nullptr;
  double t = 0.0;      // along the segment, 0 to 1
  double depth = 0.0;  // below the tube's surface; negative outside                    [mm]
};

TubeFoot find_foot(const TubeSegment& segment, const Vec3& p);
/// The deepest of the tube's segments.
TubeFoot find_foot(const TubeShape& tube, const Vec3& p);
double clearance(const TubeShape& tube, const Vec3& p);
/// At the foot of the point [HU].
double hu_at(const TubeShape& tube, const Vec3& p);

/// The part of a tube less deep than a thickness that falls from the middle to the rim.
struct PlaqueShape {
  TubeShape tube;  // the stretch on which it lies
  double arc = 0.0, half_length = 0.0;
  double angle = 0.0, half_width = 0.0;  //                                             [rad]
  double thickness = 0.0;
  double inverse_slope = 1.0;
};

double clearance(const PlaqueShape& plaque, const Vec3& p);

/// Rings of a zigzag wire round a stretch of a tube.
struct StentShape {
  TubeShape tube;  // the stretch on which it lies
  double first_arc = 0.0, pitch = 0.0;
  int rings = 0;
  double strut = 0.0;      // thickness of the wire                                     [mm]
  double amplitude = 0.0;  // half height of the zigzag, along the tube                 [mm]
  int crowns = 0;          // round the tube
  double steepness = 0.0;  // of the zigzag on the wall
  double inverse_slope = 1.0;
};

double clearance(const StentShape& stent, const Vec3& p);

EllipseShape make_ellipsoid(const Vec3& center, const Vec3& semi_axes, const Mat3& rotation);
EllipseShape make_cylinder(const Vec3& center, const Vec3& semi_axes);
/// A tube round the axis of a described one, `margin` wider than it.
TubeShape make_tube(const PhantomTube& tube, double margin);
PlaqueShape make_plaque(const PhantomCalcium& calcium, const PhantomTube& tube);
StentShape make_stent(const PhantomStent& stent, const PhantomTube& tube);

}  // namespace wireplan::preprocess
