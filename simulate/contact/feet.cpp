#include "simulate/contact/feet.h"

#include <algorithm>

namespace wireplan::simulate {

namespace {

/// A held foot is left where it is while its point is this near to where the foot was found [mm].
constexpr double kHeldFoot = 0.25;

}  // namespace

Feet::Feet(const TriangleLocator& locator, int points) : locator_(locator) {
  lag_.place.resize(static_cast<std::size_t>(points));
  lag_.found_from.setZero(3, points);
}

void Feet::forget() {
  std::fill(lag_.place.begin(), lag_.place.end(), SurfacePoint{});
  held_ = false;
}

void Feet::find(const ActivePoint& active, const std::vector<std::int32_t>& triangle) {
  const WallSample& wall = active.wall;
  const std::size_t point = static_cast<std::size_t>(active.point);
  SurfacePoint& foot = lag_.place[point];
  foot = locator_.pierced(
      active.position - (wall.distance / wall.gradient.squaredNorm()) * wall.gradient,
      wall.gradient, foot.triangle >= 0 ? foot.triangle : triangle[point]);
  lag_.found_from.col(active.point) = active.position;
}

bool Feet::refresh(const ContactSample& sample, const std::vector<std::int32_t>& triangle) {
  bool any = false;
  for (const ActivePoint& active : sample.active) {
    const double moved = (active.position - lag_.found_from.col(active.point)).norm();
    if (held_ && has(active.point) && moved < kHeldFoot) continue;
    find(active, triangle);
    any = true;
  }
  return any;
}

Mat3 Feet::weight_slopes(const ActivePoint& active, const SurfacePoint& foot) const {
  if (foot.triangle < 0) return Mat3::Zero();
  const Vec3& normal = active.wall.gradient;
  const double along = (locator_.position(foot) - active.position).dot(normal);
  return locator_.weight_slopes(foot, normal) *
         (Mat3::Identity() + (along / normal.squaredNorm()) * active.wall.hessian);
}

}  // namespace wireplan::simulate
