#include <algorithm>
#include <cmath>

#include "preprocess/volume/phantom.h"

namespace wireplan::preprocess {
namespace {

/// A point between b and c, at u from 0 to 1, of the centripetal Catmull-Rom curve through a, b, c
/// and d, by the pyramid of Barry and Goldman (SIGGRAPH 1988).
Vec3 catmull_rom(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, double u) {
  const double t_b = std::sqrt((b - a).norm());
  const double t_c = t_b + std::sqrt((c - b).norm());
  const double t_d = t_c + std::sqrt((d - c).norm());
  const double t = t_b + u * (t_c - t_b);
  const auto mixed = [t](const Vec3& p, const Vec3& q, double t_p, double t_q) -> Vec3 {
    return ((t_q - t) * p + (t - t_p) * q) / (t_q - t_p);
  };
  const Vec3 ab = mixed(a, b, 0.0, t_b), bc = mixed(b, c, t_b, t_c), cd = mixed(c, d, t_c, t_d);
  const Vec3 abc = mixed(ab, bc, 0.0, t_c), bcd = mixed(bc, cd, t_b, t_d);
  return mixed(abc, bcd, t_b, t_c);
}

/// The same line with its points evenly spaced, at most `spacing` apart.
Centerline resample(const Centerline& line, double spacing) {
  const Eigen::Index last = line.points.cols() - 1;
  const double length = line.arc_length(last);
  const auto pieces = static_cast<Eigen::Index>(std::ceil(length / spacing));
  Centerline even{Eigen::Matrix3Xd(3, pieces + 1), Eigen::VectorXd(pieces + 1),
                  Eigen::VectorXd::LinSpaced(pieces + 1, 0.0, length)};
  Eigen::Index i = 0;
  for (Eigen::Index k = 0; k <= pieces; ++k) {
    while (i + 2 <= last && line.arc_length(i + 1) < even.arc_length(k)) ++i;
    const double t =
        (even.arc_length(k) - line.arc_length(i)) / (line.arc_length(i + 1) - line.arc_length(i));
    even.points.col(k) = (1.0 - t) * line.points.col(i) + t * line.points.col(i + 1);
    even.radius(k) = (1.0 - t) * line.radius(i) + t * line.radius(i + 1);
  }
  return even;
}

/// The curve through the control points with values that are linear between them in its radius.
Centerline trace(const Eigen::Matrix3Xd& points, const Eigen::VectorXd& values) {
  const Eigen::Index controls = points.cols();
  expects(controls >= 2 && values.size() == controls);
  // Beyond either end the polygon goes on straight.
  Eigen::Matrix3Xd polygon(3, controls + 2);
  polygon << 2.0 * points.col(0) - points.col(1), points,
      2.0 * points.col(controls - 1) - points.col(controls - 2);
  // Fine samples with their arc length.
  constexpr Eigen::Index kSamples = 100;  // per span
  const Eigen::Index count = (controls - 1) * kSamples + 1;
  Centerline fine{Eigen::Matrix3Xd(3, count), Eigen::VectorXd(count), {}};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index span = std::min(i / kSamples, controls - 2);
    const double u = static_cast<double>(i - span * kSamples) / static_cast<double>(kSamples);
    expects(polygon.col(span + 1) != polygon.col(span + 2));
    fine.points.col(i) = catmull_rom(polygon.col(span), polygon.col(span + 1),
                                     polygon.col(span + 2), polygon.col(span + 3), u);
    fine.radius(i) = (1.0 - u) * values(span) + u * values(span + 1);
  }
  fine.arc_length = arc_length_of(fine.points);
  return resample(fine, 0.5);
}

}  // namespace

Centerline phantom_axis(const PhantomTube& tube) {
  expects((tube.radius.array() > 0.0).all());
  return trace(tube.points, tube.radius);
}

Eigen::VectorXd phantom_hu(const PhantomTube& tube) {
  if (tube.hu_along.size() == 0) {
    return Eigen::VectorXd::Constant(phantom_axis(tube).radius.size(), tube.hu);
  }
  return trace(tube.points, tube.hu_along).radius;
}

}  // namespace wireplan::preprocess
