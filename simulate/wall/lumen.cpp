#include "simulate/wall/lumen.h"

#include <algorithm>
#include <cmath>

#include "simulate/wall/sample_grid.h"

namespace wireplan::simulate {
namespace {

/// The four cubic B-splines at a fraction t of a cell, and their derivatives over it.
struct SplineWeights {
  using Row = Eigen::Array4d;
  double t;

  // Coefficients of the powers of t.
  static Row c0() { return Row(1.0, 4.0, 1.0, 0.0) / 6.0; }
  static Row c1() { return Row(-0.5, 0.0, 0.5, 0.0); }
  static Row c2() { return Row(0.5, -1.0, 0.5, 0.0); }
  static Row c3() { return Row(-1.0, 3.0, -3.0, 1.0) / 6.0; }

  Row value() const { return c0() + t * (c1() + t * (c2() + t * c3())); }
  Row first() const { return c1() + t * (2.0 * c2() + t * (3.0 * c3())); }
  Row second() const { return 2.0 * c2() + t * (6.0 * c3()); }
};

}  // namespace

Lumen::Place Lumen::find_place(const Vec3& point) const {
  Place place{nullptr, -1.0, {0, 0, 0}, Vec3::Zero()};
  std::array<int, 3> brick{};
  for (int d = 0; d < 3; ++d) {
    const double u = (point[d] - origin_[d]) / spacing_;
    if (!(u >= 0.0 && u < static_cast<double>(kCells) * bricks_[d])) return place;
    const int cell = static_cast<int>(u);
    brick[d] = cell / kCells;
    place.cell[d] = cell % kCells;
    place.fraction[d] = u - cell;
  }
  const std::size_t index =
      static_cast<std::size_t>(brick[0]) +
      static_cast<std::size_t>(bricks_[0]) *
          (static_cast<std::size_t>(brick[1]) +
           static_cast<std::size_t>(bricks_[1]) * static_cast<std::size_t>(brick[2]));
  const std::int32_t s = brick_[index];
  if (s >= 0) {
    place.coefficients =
        coefficients_.data() + static_cast<std::size_t>(s) * kNodes * kNodes * kNodes;
  } else if (s == SampleGrid::kInside) {
    place.sign = 1.0;
  }
  return place;
}

Eigen::Array4d Lumen::Place::row(int j, int k) const {
  const float* first = coefficients + cell[0] + kNodes * (cell[1] + j + kNodes * (cell[2] + k));
  return Eigen::Map<const Eigen::Array4f>(first).cast<double>();
}

double Lumen::distance(const Vec3& point) const {
  const Place place = find_place(point);
  if (place.coefficients == nullptr) return place.sign * band_;
  const SplineWeights x{place.fraction[0]}, y{place.fraction[1]}, z{place.fraction[2]};
  const Eigen::Array4d wy = y.value(), wz = z.value();
  Eigen::Array4d sum = Eigen::Array4d::Zero();
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) sum += (wz[k] * wy[j]) * place.row(j, k);
  }
  return std::clamp((x.value() * sum).sum(), -band_, band_);
}

WallSample Lumen::sample(const Vec3& point) const {
  const Place place = find_place(point);
  WallSample result;
  result.distance = place.sign * band_;
  if (place.coefficients == nullptr) return result;
  // Sums over z of sums over y, of four values along x each; names tell the derivatives taken.
  using Row = Eigen::Array4d;
  const SplineWeights x{place.fraction[0]}, y{place.fraction[1]}, z{place.fraction[2]};
  const Row y0 = y.value(), y1 = y.first(), y2 = y.second();
  const Row z0 = z.value(), z1 = z.first(), z2 = z.second();
  Row f = Row::Zero(), fy = Row::Zero(), fyy = Row::Zero(), fz = Row::Zero(), fyz = Row::Zero(),
      fzz = Row::Zero();
  for (int k = 0; k < 4; ++k) {
    Row g = Row::Zero(), gy = Row::Zero(), gyy = Row::Zero();
    for (int j = 0; j < 4; ++j) {
      const Row c = place.row(j, k);
      g += y0[j] * c;
      gy += y1[j] * c;
      gyy += y2[j] * c;
    }
    f += z0[k] * g;
    fy += z0[k] * gy;
    fyy += z0[k] * gyy;
    fz += z1[k] * g;
    fyz += z1[k] * gy;
    fzz += z2[k] * g;
  }
  const Row x0 = x.value(), x1 = x.first(), x2 = x.second();
  const double value = (x0 * f).sum();
  if (std::abs(value) >= band_) {
    result.distance = std::copysign(band_, value);
    return result;
  }
  result.distance = value;
  result.gradient << (x1 * f).sum(), (x0 * fy).sum(), (x0 * fz).sum();
  result.gradient /= spacing_;
  const double xx = (x2 * f).sum(), xy = (x1 * fy).sum(), xz = (x1 * fz).sum();
  const double yy = (x0 * fyy).sum(), yz = (x0 * fyz).sum(), zz = (x0 * fzz).sum();
  result.hessian << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  result.hessian /= spacing_ * spacing_;
  return result;
}

std::size_t Lumen::memory_bytes() const {
  return coefficients_.size() * sizeof(float) + brick_.size() * sizeof(std::int32_t);
}

}  // namespace wireplan::simulate
