#pragma once
/// Laws that turn the gap between wire and wall into a force, and the choice of one.
#include <algorithm>
#include <cmath>
#include <concepts>
#include <variant>

namespace wireplan::simulate {

/// What a law says of one millimetre of wire at a gap.
struct LawValue {
  double energy = 0.0;     //                                                             [N]
  double slope = 0.0;      // d energy / d gap, never positive                            [N/mm]
  double curvature = 0.0;  // never negative                                              [N/mm^2]
};

/// What a law gives: its potential over the gap between wire surface and wall, convex and with a
/// continuous curvature; the gap at which the force is `force` >= 0 [N/mm]; and the gap from which
/// on there is none [mm].
template <class T>
concept IsContactLaw = requires(const T& law, double gap, double force) {
  { law.at(gap) } -> std::same_as<LawValue>;
  { law.gap_of(force) } -> std::same_as<double>;
  { law.reach() } -> std::same_as<double>;
};

/// f = stiffness * penetration (paper 1.6) below -smoothing, zero beyond `smoothing`, the potential
/// a cubic between, so that force and stiffness are continuous.
struct LinearLaw {
  double stiffness = 20.0;  // per length of wire                                        [N/mm^2]
  double smoothing = 0.05;  //                                                           [mm]

  LawValue at(double gap) const {
    const double s = smoothing, k = stiffness;
    if (gap >= s) return {};
    if (gap <= -s) return {0.5 * k * gap * gap + k * s * s / 6.0, k * gap, k};
    const double d = s - gap;
    return {k * d * d * d / (12.0 * s), -k * d * d / (4.0 * s), k * d / (2.0 * s)};
  }
  double gap_of(double force) const {
    const double s = smoothing, k = stiffness;
    return force < k * s ? s - std::sqrt(4.0 * s * force / k) : -force / k;
  }
  double reach() const { return smoothing; }
};

template <IsContactLaw... Laws>
using OneLawOf = std::variant<Laws...>;

/// The law of a wire. One more law is a struct beside LinearLaw and a place in `choice`; nothing
/// else in simulate knows which laws there are.
struct ContactLaw {
  using Value = LawValue;
  OneLawOf<LinearLaw> choice = {};

  Value at(double gap) const {
    return std::visit([&](const auto& law) { return law.at(gap); }, choice);
  }
  /// Mean stiffness between the gap and the one at which the force is `expected` >= 0 [N/mm]: the
  /// slope of the chord [N/mm^2].
  double chord(double gap, double expected) const {
    const auto of = [&](const auto& law) {
      const Value here = law.at(gap);
      const double there = law.gap_of(expected);
      if (std::abs(there - gap) < 1e-9) return here.curvature;
      return std::max(0.0, (expected + here.slope) / (gap - there));
    };
    return std::visit(of, choice);
  }
  /// The gap from which on there is no force [mm].
  double reach() const {
    return std::visit([](const auto& law) { return law.reach(); }, choice);
  }
};

}  // namespace wireplan::simulate
