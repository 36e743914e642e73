#pragma once
/// Exact line search on the wire's energy, which is a quartic along any direction: paper Eq.
/// (22)-(23). Private to simulate.
#include <algorithm>
#include <cmath>
#include <limits>

namespace wireplan::simulate {

/// Energy along a step, a1 s + a2 s^2 + a3 s^3 + a4 s^4: exact for stretch, bend and loads, paper
/// Eq. (22).
struct Quartic {
  double a1 = 0.0, a2 = 0.0, a3 = 0.0, a4 = 0.0;
  double at(double s) const { return s * (a1 + s * (a2 + s * (a3 + s * a4))); }
  double slope(double s) const { return a1 + s * (2.0 * a2 + s * (3.0 * a3 + s * (4.0 * a4))); }
  double curvature(double s) const { return 2.0 * a2 + s * (6.0 * a3 + s * (12.0 * a4)); }
};

/// Where the slope is 0 between low and high, where it rises from below 0 to above: Newton's method
/// from `start`, with bisection where it would leave the bounds found so far.
inline double minimum_between(const Quartic& q, double low, double high, double start) {
  double s = start;
  for (int k = 0; k < 200; ++k) {
    const double slope = q.slope(s);
    (slope > 0.0 ? high : low) = s;
    double next = s - slope / q.curvature(s);
    if (!(next >= low && next <= high)) {
      next = std::isfinite(high) ? 0.5 * (low + high) : 2.0 * s;
    }
    const double change = std::abs(next - s);
    s = next;
    if (change <= 1e-9 * s) break;  // Newton's next change would be below rounding
  }
  return s;
}

/// The lowest point of a quartic that falls at 0 and rises in the end, within (0, cap], paper Eq.
/// (23). Where it never rises: cap, or 1 without one.
inline double lowest_point(const Quartic& q, double cap) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double a = 12.0 * q.a4, b = 3.0 * q.a3, c = 2.0 * q.a2;  // curvature: a s^2 + 2 b s + c
  // 1. A convex quartic has one lowest point.
  if (c > 0.0 && b * b <= a * c) {
    return std::min(cap, minimum_between(q, 0.0, kInfinity, -q.a1 / c));
  }

  // 2. Else the slope rises up to s_1, falls to s_2 and rises again.
  const double root = -(b + std::copysign(std::sqrt(std::max(0.0, b * b - a * c)), b));
  const double one = a > 0.0 ? root / a : -kInfinity, other = root != 0.0 ? c / root : 0.0;
  const double s_1 = std::min(one, other), s_2 = std::max({one, other, 0.0});
  double best = 0.0;
  if (s_1 > 0.0 && q.slope(s_1) > 0.0) best = std::min(cap, minimum_between(q, 0.0, s_1, 0.0));

  // 3. The valley beyond s_2, bounded by doubling.
  if (q.slope(s_2) < 0.0) {
    double reach = s_2 > 0.0 ? s_2 : c != 0.0 ? std::abs(q.a1 / c) : 1.0;
    while (q.slope(s_2 + reach) < 0.0 && s_2 + reach < cap && reach < 1e200) reach *= 2.0;
    if (q.slope(s_2 + reach) < 0.0) return std::isfinite(cap) ? cap : 1.0;
    const double far = std::min(cap, minimum_between(q, s_2, s_2 + reach, s_2 + reach));
    if (q.at(far) < q.at(best)) best = far;
  }
  return best;
}

}  // namespace wireplan::simulate
