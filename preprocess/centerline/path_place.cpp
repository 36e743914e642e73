#include "preprocess/centerline/path_place.h"

#include <algorithm>
#include <cmath>

namespace wireplan::preprocess {
namespace {

/// What is further from a point than this is neither its place on the axis nor the ball nearest to
/// it: some points of the path tell.
double find_reach(const Vec3& p, const Centerline& path) {
  constexpr Eigen::Index kStride = 8;
  Eigen::Index near = 0;
  double squared = (p - path.points.col(0)).squaredNorm();
  for (Eigen::Index k = kStride; k < path.points.cols(); k += kStride) {
    const double own = (p - path.points.col(k)).squaredNorm();
    if (own < squared) {
      squared = own;
      near = k;
    }
  }
  const double axis = std::sqrt(squared);
  return std::max(axis, std::max(0.0, axis - path.radius[near]) + path.radius.maxCoeff());
}

}  // namespace

PathPlace find_place(const Vec3& p, const Centerline& path) {
  constexpr double kSurely = 0.99;  // of a length, for rounding
  const Eigen::Index count = path.points.cols();
  expects(count > 0 && path.radius.size() == count && path.arc_length.size() == count);
  const double reach = find_reach(p, path);
  PathPlace place{.radius = path.radius[0], .from_axis = (p - path.points.col(0)).norm()};
  place.from_lumen = std::max(0.0, place.from_axis - path.radius[0]);
  const double* const arc = path.arc_length.data();
  for (Eigen::Index k = 1; k < count; ++k) {
    const Vec3 a = path.points.col(k - 1);
    // The path comes within reach only where it has gone on so far: most of it is passed over.
    const double within = arc[k - 1] + kSurely * ((p - a).norm() - reach);
    if (arc[k] < within) {
      k = std::lower_bound(arc + k + 1, arc + count, within) - arc - 1;
      continue;
    }
    const Vec3 ab = path.points.col(k) - path.points.col(k - 1);
    const double squared = ab.squaredNorm();
    const double t = squared == 0.0 ? 0.0 : std::clamp((p - a).dot(ab) / squared, 0.0, 1.0);
    const double axis = (p - a - t * ab).norm();
    const double radius = (1.0 - t) * path.radius[k - 1] + t * path.radius[k];
    if (axis < place.from_axis) {
      place.arc = arc[k - 1] - arc[0] + t * std::sqrt(squared);
      place.from_axis = axis;
      place.radius = radius;
    }
    place.from_lumen = std::min(place.from_lumen, std::max(0.0, axis - radius));
  }
  return place;
}

bool is_on_path(const PathPlace& place) {
  constexpr double kBeside = 1.0, kBesidePart = 0.5;  // [mm], of the radius
  return place.from_lumen <= std::max(kBeside, kBesidePart * place.radius);
}

double find_progress(const Vec3& tip, const Centerline& path) {
  const PathPlace place = find_place(tip, path);
  return is_on_path(place) ? place.arc : 0.0;
}

}  // namespace wireplan::preprocess
