#pragma once
/// The law that turns the gap between wire and wall into a force.
#include <algorithm>
#include <cmath>

namespace wireplan::simulate {

/// Potential of one millimetre of wire against the wall at the gap between wire surface and wall:
/// zero beyond `smoothing`, f = stiffness * penetration (paper 1.6) below -smoothing, a cubic
/// between, so that force and stiffness are continuous.
struct ContactLaw {
  double stiffness = 20.0;  // per length of wire                                        [N/mm^2]
  double smoothing = 0.05;  //                                                           [mm]

  struct Value {
    double energy = 0.0;     //                                                           [N]
    double slope = 0.0;      // d energy / d gap, never positive                          [N/mm]
    double curvature = 0.0;  //                                                           [N/mm^2]
  };
  Value at(double gap) const {
    const double s = smoothing, k = stiffness;
    if (gap >= s) return {};
    if (gap <= -s) return {0.5 * k * gap * gap + k * s * s / 6.0, k * gap, k};
    const double d = s - gap;
    return {k * d * d * d / (12.0 * s), -k * d * d / (4.0 * s), k * d / (2.0 * s)};
  }
  /// Mean stiffness between the gap and the one at which the force is `expected` >= 0 [N/mm]: the
  /// slope of the chord [N/mm^2].
  double chord(double gap, double expected) const {
    const Value here = at(gap);
    const double s = smoothing, k = stiffness;
    const double there = expected < k * s ? s - std::sqrt(4.0 * s * expected / k) : -expected / k;
    if (std::abs(there - gap) < 1e-9) return here.curvature;
    return std::max(0.0, (expected + here.slope) / (gap - there));
  }
};

}  // namespace wireplan::simulate
