#pragma once
/// Answers that theory gives for elastic wires, found without the solver: closed forms, and
/// ordinary differential equations integrated by Runge-Kutta's method. Inextensible, isotropic
/// rods.
#include <cmath>
#include <functional>

#include "preprocess/base.h"

namespace wireplan::analytic {

/// A planar cantilever, clamped along x, that bends under loads along -y.
struct Cantilever {
  double tip_angle = 0.0;  // below x [rad]
  double reach = 0.0;      // of the tip along x
  double drop = 0.0;       // of the tip along -y
};

/// The cantilever of the given length under a force at its tip and a weight per length. `EI` is the
/// bending stiffness at a distance from the tip and may jump at multiples of length/steps.
/// Integrated from the tip, (EI theta')' = (tip_force + weight s) sin(theta) with theta the angle
/// from the direction of the loads, for the tip angle that meets the clamp (shooting).
inline Cantilever bend_cantilever(double length, const std::function<double(double)>& EI,
                                  double tip_force, double weight, int steps) {
  const double h = length / steps;
  struct State {
    double theta, moment, x, y;
  };
  const auto shoot = [&](double tip) {
    State now{tip, 0.0, 0.0, 0.0};
    for (int i = 0; i < steps; ++i) {
      const double stiffness = EI((i + 0.5) * h);
      const auto rate = [&](const State& at, double s) {
        return State{at.moment / stiffness, (tip_force + weight * s) * std::sin(at.theta),
                     std::sin(at.theta), std::cos(at.theta)};
      };
      const auto ahead = [&now](const State& r, double by) {
        return State{now.theta + by * r.theta, now.moment + by * r.moment, now.x + by * r.x,
                     now.y + by * r.y};
      };
      const double s = i * h;
      const State a = rate(now, s), b = rate(ahead(a, 0.5 * h), s + 0.5 * h),
                  c = rate(ahead(b, 0.5 * h), s + 0.5 * h), d = rate(ahead(c, h), s + h);
      const State mean{(a.theta + 2.0 * (b.theta + c.theta) + d.theta) / 6.0,
                       (a.moment + 2.0 * (b.moment + c.moment) + d.moment) / 6.0,
                       (a.x + 2.0 * (b.x + c.x) + d.x) / 6.0,
                       (a.y + 2.0 * (b.y + c.y) + d.y) / 6.0};
      now = ahead(mean, h);
      if (now.theta > kPi) break;  // far past the clamp
    }
    return now;
  };
  // The tip hangs exponentially close to the loads' direction: bisect its angle on a log scale.
  double low = -60.0, high = std::log(0.5 * kPi);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (shoot(std::exp(middle)).theta < 0.5 * kPi ? low : high) = middle;
  }
  const State clamp = shoot(std::exp(low));
  return {0.5 * kPi - std::exp(low), clamp.x, clamp.y};
}

/// A pinned-pinned column buckled until its ends have turned by `end_angle`.
struct Column {
  double load = 0.0;        // over the Euler load pi^2 EI/L^2
  double shortening = 0.0;  // over L
  double deflection = 0.0;  // of the middle, over L
};

/// Euler's elastica in elliptic integrals, modulus k = sin(end_angle/2).
inline Column buckle_column(double end_angle) {
  const double k = std::sin(0.5 * end_angle);
  const double K = std::comp_ellint_1(k), E = std::comp_ellint_2(k);
  return {std::pow(2.0 * K / kPi, 2), 2.0 * (1.0 - E / K), k / K};
}

/// Buckling moment of a twisted straight rod, over EI/L.
/// Both ends clamped, under tension T: the lowest root M = 2 q of
///   1 = cos(Q)/cos(P) (S- + S+)/2 + sin(Q)/sin(P) (S- - S+)/2,
///   Q = q/2, P^2 = Q^2 - T/4 (T over EI/L^2), S+- = sin(P +- Q)/(P +- Q),
/// which for T = 0 is tan(Q) = Q, Greenhill's 8.987.
struct TwistBuckling {
  double tension, moment;
};
inline constexpr TwistBuckling kClampedTwistBuckling[] = {
    {-10.0, 7.4510}, {0.0, 8.9868}, {20.0, 11.8003}};
/// Both ends in ball joints, and the roll of the end edges held as that of a clamp is: directors
/// carried along with the edge by parallel transport, which makes the torque a semi-tangential one.
/// Twice the lowest root of tan(q) = -q/3. (An axial torque, which has no energy at ends that may
/// turn, would give Greenhill's 2 pi.)
inline constexpr double kBallJointTwistBuckling = 4.9113;

/// Twisted rod of infinite length under tension T and torque M, buckled into one localised helix
/// (Coyne; van der Heijden and Thompson): cosine of the angle between wire and axis at arc length s
/// from the middle, for bending stiffness B.
inline double localised_helix_cosine(double s, double B, double T, double M) {
  const double depth = 1.0 - M * M / (4.0 * B * T);
  const double sech = 1.0 / std::cosh(s * std::sqrt(depth * T / B));
  return 1.0 - 2.0 * depth * sech * sech;
}

}  // namespace wireplan::analytic
