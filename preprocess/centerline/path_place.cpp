#include "preprocess/centerline/path_place.h"

#include <algorithm>
#include <cmath>

namespace wireplan::preprocess {

PathPlace find_place(const Vec3& p, const Centerline& path) {
  constexpr double kRounding = 1e-9;  // of a squared length
  expects(path.points.cols() > 0 && path.radius.size() == path.points.cols());
  PathPlace place{.radius = path.radius[0], .from_axis = (p - path.points.col(0)).norm()};
  place.from_lumen = std::max(0.0, place.from_axis - path.radius[0]);
  double before = 0.0;
  for (Eigen::Index k = 1; k < path.points.cols(); ++k) {
    const Vec3 a = path.points.col(k - 1), ab = path.points.col(k) - path.points.col(k - 1);
    const double squared = ab.squaredNorm(), length = std::sqrt(squared);
    // A segment that begins too far away to matter is not looked at: that is most of them.
    const double widest = std::max(path.radius[k - 1], path.radius[k]);
    const double matters = std::max(place.from_axis, place.from_lumen + widest) + length;
    if ((p - a).squaredNorm() > matters * matters * (1.0 + kRounding)) {
      before += length;
      continue;
    }
    const double t = squared == 0.0 ? 0.0 : std::clamp((p - a).dot(ab) / squared, 0.0, 1.0);
    const double axis = (p - a - t * ab).norm();
    const double radius = (1.0 - t) * path.radius[k - 1] + t * path.radius[k];
    if (axis < place.from_axis) {
      place.arc = before + t * length;
      place.from_axis = axis;
      place.radius = radius;
    }
    place.from_lumen = std::min(place.from_lumen, std::max(0.0, axis - radius));
    before += length;
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
