#include "plan/anatomy/projection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace wireplan::plan {
namespace {

constexpr double kAngleTie = 1e-6;  // of rounding in a normal                             [rad]

double foreshortening(const Vec3& direction, const Vec3& detector) {
  return std::max(0.0, 1.0 - direction.cross(detector).norm());
}

Projection project(const View& view, const Vec3& trunk, const Vec3& branch,
                   const ArmLimits& limits) {
  const Vec3 detector = detector_direction(view);
  return {.view = view,
          .reachable = std::abs(view.rotation) <= limits.rotation + kAngleTie &&
                       std::abs(view.tilt) <= limits.tilt + kAngleTie,
          .trunk_foreshortening = foreshortening(trunk, detector),
          .branch_foreshortening = foreshortening(branch, detector)};
}

/// Of the two sides of a plane the one to look from.
Projection from_better_side(const Vec3& normal, const Vec3& trunk, const Vec3& branch,
                            const ArmLimits& limits) {
  const Projection a = project(view_from(normal), trunk, branch, limits),
                   b = project(view_from(-normal), trunk, branch, limits);
  if (a.reachable != b.reachable) return a.reachable ? a : b;
  const double turn_a = std::abs(a.view.rotation), turn_b = std::abs(b.view.rotation);
  if (std::abs(turn_a - turn_b) > kAngleTie) return turn_a < turn_b ? a : b;
  return a.view.rotation > b.view.rotation ? a : b;
}

/// The least cost(projection) of all whole degrees within reach; none where no cost is finite. Of
/// equal costs that with the least rotation and tilt.
template <typename Cost>
std::optional<Projection> search_reach(const Vec3& trunk, const Vec3& branch,
                                       const ArmLimits& limits, const Cost& cost) {
  constexpr double kPerDegree = 1e-9;  // far below what shows, and above rounding
  const int most_rotation = static_cast<int>(limits.rotation / kRadPerDeg + kAngleTie),
            most_tilt = static_cast<int>(limits.tilt / kRadPerDeg + kAngleTie);
  std::optional<Projection> best;
  double least = std::numeric_limits<double>::infinity();
  for (int a = most_rotation; a >= -most_rotation; --a) {
    for (int b = most_tilt; b >= -most_tilt; --b) {
      const Projection tried =
          project({.rotation = a * kRadPerDeg, .tilt = b * kRadPerDeg}, trunk, branch, limits);
      const double value = cost(tried) + kPerDegree * (std::abs(a) + std::abs(b));
      if (value >= least) continue;
      least = value;
      best = tried;
    }
  }
  return best;
}

}  // namespace

Vec3 detector_direction(const View& view) {
  return {std::sin(view.rotation) * std::cos(view.tilt),
          -std::cos(view.rotation) * std::cos(view.tilt), std::sin(view.tilt)};
}

View view_from(const Vec3& detector) {
  // Rounding may leave a -0, of which atan2 makes half a turn.
  const Vec3 d = detector.normalized() + Vec3::Zero();
  return {.rotation = std::atan2(d.x(), -d.y()), .tilt = std::asin(std::clamp(d.z(), -1.0, 1.0))};
}

Projections find_projections(const Vec3& trunk, const Vec3& branch, const ArmLimits& limits) {
  const double least_apart = std::cos(30.0 * kRadPerDeg), in_line = std::sin(5.0 * kRadPerDeg);
  const Vec3 normal = trunk.cross(branch);
  Projections found;
  if (normal.norm() > in_line) {
    found.best = from_better_side(normal, trunk, branch, limits);
  } else {
    const auto across = [](const Projection& p) { return p.branch_foreshortening; };
    found.best = *search_reach(trunk, branch, limits, across);
  }

  const Vec3 best = detector_direction(found.best.view);
  found.second = search_reach(trunk, branch, limits, [&](const Projection& p) {
    if (!found.best.reachable) return p.branch_foreshortening + p.trunk_foreshortening;
    const bool near = std::abs(detector_direction(p.view).dot(best)) > least_apart + 1e-9;
    return near ? std::numeric_limits<double>::infinity()
                : p.branch_foreshortening + 0.1 * p.trunk_foreshortening;
  });
  return found;
}

}  // namespace wireplan::plan
