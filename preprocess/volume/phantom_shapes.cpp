#include "preprocess/volume/phantom_shapes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace wireplan::preprocess {
namespace {

/// Unit vector normal to `tangent` from which angles round a tube are counted.
Vec3 reference_direction(const Vec3& tangent) {
  const Vec3 anterior = -Vec3::UnitY() + tangent.y() * tangent;
  if (anterior.norm() > 1e-3) return anterior.normalized();
  return (Vec3::UnitZ() - tangent.z() * tangent).normalized();
}

/// Where a point lies round a tube, counted from the reference direction [rad].
double angle_round(const TubeFoot& foot, const Vec3& p) {
  const TubeSegment& s = *foot.segment;
  const Vec3 tangent = s.ab.normalized(), anterior = reference_direction(tangent);
  const Vec3 outward = p - s.a - foot.t * s.ab;
  return std::atan2(outward.dot(tangent.cross(anterior)), outward.dot(anterior));
}

/// The segments of a tube less than `reach` from a place along it, and their least radius.
double take_stretch(const TubeShape& whole, double arc, double reach, TubeShape& stretch) {
  double radius = std::numeric_limits<double>::infinity();
  for (const TubeSegment& s : whole.segments) {
    if (std::abs(s.arc_a - arc) > reach) continue;
    stretch.segments.push_back(s);
    radius = std::min(radius, s.radius_a);
  }
  expects(!stretch.segments.empty());
  stretch.inverse_slope = whole.inverse_slope;
  return radius;
}

double length_of(const TubeShape& whole) {
  return whole.segments.back().arc_a + whole.segments.back().length;
}

// A stretch reaches past both ends of what lies on it, so that none of its points has its foot at
// an end of the stretch.                                                                  [mm]
constexpr double kBeyond = 2.0;

}  // namespace

double clearance(const EllipseShape& e, const Vec3& p) {
  const Vec3 d = p - e.center;
  return std::max(((e.to_unit * d).norm() - 1.0) * e.min_axis,
                  std::abs(d.dot(e.along)) - e.half_height);
}

TubeFoot find_foot(const TubeSegment& s, const Vec3& p) {
  const double t = std::clamp((p - s.a).dot(s.ab) * s.inverse_squared_length, 0.0, 1.0);
  return {&s, t, s.radius_a + t * s.radius_ab - (p - s.a - t * s.ab).norm()};
}

TubeFoot find_foot(const TubeShape& tube, const Vec3& p) {
  TubeFoot deepest{nullptr, 0.0, -std::numeric_limits<double>::infinity()};
  for (const TubeSegment& s : tube.segments) {
    const TubeFoot foot = find_foot(s, p);
    if (foot.depth > deepest.depth) deepest = foot;
  }
  return deepest;
}

double clearance(const TubeShape& tube, const Vec3& p) {
  return -find_foot(tube, p).depth * tube.inverse_slope;
}

double hu_at(const TubeShape& tube, const Vec3& p) {
  const TubeFoot foot = find_foot(tube, p);
  return foot.segment->hu_a + foot.t * foot.segment->hu_ab;
}

double clearance(const PlaqueShape& plaque, const Vec3& p) {
  const TubeFoot foot = find_foot(plaque.tube, p);
  if (foot.depth < 0.0) return -foot.depth * plaque.inverse_slope;
  // Where p lies along and round the tube, measured from the plaque's middle to its rim.
  const TubeSegment& s = *foot.segment;
  const double angle = angle_round(foot, p) - plaque.angle;
  const double along = (s.arc_a + foot.t * s.length - plaque.arc) / plaque.half_length;
  const double around = std::remainder(angle, 2.0 * kPi) / plaque.half_width;
  // A parabola, cut off beyond the rim so that its slope stays bounded.
  const double thickness = plaque.thickness * std::max(1.0 - along * along - around * around, -1.0);
  return (foot.depth - thickness) * plaque.inverse_slope;
}

double clearance(const StentShape& stent, const Vec3& p) {
  const TubeFoot foot = find_foot(stent.tube, p);
  const double half = 0.5 * stent.strut;
  const double across = std::abs(foot.depth + half) - half;
  if (across > stent.strut) return across * stent.inverse_slope;  // angles mean little at the axis
  // Along the tube from the zigzag of the nearest ring.
  const double arc = foot.segment->arc_a + foot.t * foot.segment->length - stent.first_arc -
                     stent.amplitude * std::sin(stent.crowns * angle_round(foot, p));
  const double ring = std::clamp(std::round(arc / stent.pitch), 0.0, stent.rings - 1.0);
  const double along = std::abs(arc - ring * stent.pitch) / stent.steepness - half;
  return std::max(across, along) * stent.inverse_slope;
}

EllipseShape make_ellipsoid(const Vec3& center, const Vec3& semi_axes, const Mat3& rotation) {
  expects((semi_axes.array() > 0.0).all());
  return {.center = center,
          .to_unit = semi_axes.cwiseInverse().asDiagonal() * rotation.transpose(),
          .min_axis = semi_axes.minCoeff()};
}

EllipseShape make_cylinder(const Vec3& center, const Vec3& semi_axes) {
  expects((semi_axes.array() > 0.0).all());
  return {.center = center,
          .to_unit = Vec3(1.0 / semi_axes.x(), 1.0 / semi_axes.y(), 0.0).asDiagonal(),
          .min_axis = semi_axes.head<2>().minCoeff(),
          .half_height = semi_axes.z()};
}

TubeShape make_tube(const PhantomTube& described, double margin) {
  const Centerline axis = phantom_axis(described);
  const Eigen::VectorXd hu = described.hu_along.size() > 0
                                 ? phantom_hu(described)
                                 : Eigen::VectorXd::Constant(axis.radius.size(), described.hu);
  TubeShape tube;
  double steepest = 0.0;
  for (Eigen::Index i = 0; i + 1 < axis.points.cols(); ++i) {
    const Vec3 a = axis.points.col(i), ab = axis.points.col(i + 1) - a;
    const double change = axis.radius(i + 1) - axis.radius(i);
    tube.segments.push_back({.a = a,
                             .ab = ab,
                             .inverse_squared_length = 1.0 / ab.squaredNorm(),
                             .radius_a = axis.radius(i) + margin,
                             .radius_ab = change,
                             .arc_a = axis.arc_length(i),
                             .length = ab.norm(),
                             .hu_a = hu(i),
                             .hu_ab = hu(i + 1) - hu(i)});
    steepest = std::max(steepest, std::abs(change) / ab.norm());
  }
  tube.inverse_slope = 1.0 / std::sqrt(1.0 + steepest * steepest);
  return tube;
}

PlaqueShape make_plaque(const PhantomCalcium& calcium, const PhantomTube& tube) {
  const TubeShape whole = make_tube(tube, 0.0);
  PlaqueShape plaque{.tube = {},
                     .arc = calcium.at * length_of(whole),
                     .half_length = 0.5 * calcium.length_mm,
                     .angle = calcium.angle_deg * kRadPerDeg,
                     .half_width = 0.5 * calcium.width_deg * kRadPerDeg,
                     .thickness = calcium.thickness_mm};
  const double radius = take_stretch(whole, plaque.arc, plaque.half_length + kBeyond, plaque.tube);
  expects(plaque.half_length > 0.0 && plaque.half_width > 0.0);
  expects(plaque.thickness > 0.0 && plaque.thickness < 0.5 * radius);
  // Largest slopes of the parabola, along and round the tube, down to its cut-off.
  const double steepness = 2.0 * std::numbers::sqrt2 * plaque.thickness;
  const double along = steepness / plaque.half_length;
  const double around = steepness / (plaque.half_width * (radius - plaque.thickness));
  plaque.inverse_slope = whole.inverse_slope / std::sqrt(1.0 + along * along + around * around);
  return plaque;
}

StentShape make_stent(const PhantomStent& described, const PhantomTube& tube) {
  expects(described.strut_mm > 0.0 && described.pitch_mm > 0.0 && described.amplitude_mm >= 0.0);
  expects(described.to > described.from && described.crowns >= 1);
  const TubeShape whole = make_tube(tube, 0.0);
  const double from = described.from * length_of(whole), to = described.to * length_of(whole);
  StentShape stent{.tube = {},
                   .first_arc = from + described.amplitude_mm,
                   .pitch = described.pitch_mm,
                   .strut = described.strut_mm,
                   .amplitude = described.amplitude_mm,
                   .crowns = described.crowns};
  const double room = std::max(to - from - 2.0 * described.amplitude_mm, 0.0);
  stent.rings = 1 + static_cast<int>(room / stent.pitch);
  const double radius =
      take_stretch(whole, 0.5 * (from + to), 0.5 * (to - from) + kBeyond, stent.tube);
  stent.steepness = std::hypot(1.0, stent.amplitude * stent.crowns / radius);
  // Where a tube bends, arc length changes up to twice as fast as the point moves.
  stent.inverse_slope = 0.5 * whole.inverse_slope;
  return stent;
}

}  // namespace wireplan::preprocess
