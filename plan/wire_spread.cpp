#include "plan/wire_spread.h"

#include <algorithm>
#include <cmath>

namespace wireplan::plan {
namespace {

constexpr double kMostDeviations = 3.0;  // chosen: no bench tells of the tails

/// Standard deviations from the mean that a part of the normal distribution lies below, at most
/// kMostDeviations to either side; 0 at one half.
double normal_quantile(double part) {
  if (part == 0.5) return 0.0;
  double low = -kMostDeviations, high = kMostDeviations;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < part ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double FactorSpread::at(double part) const {
  expects(part >= 0.0 && part <= 1.0);
  if (deviation > 0.0) {
    return std::exp(std::sqrt(std::log1p(deviation * deviation)) * normal_quantile(part));
  }
  expects(low > 0.0 && low <= high);
  return low * std::pow(high / low, part);
}

bool WireSpread::stiffness_known() const {
  return std::all_of(stiffness.begin(), stiffness.end(),
                     [](const auto& ends) { return ends[0].known() && ends[1].known(); });
}

simulate::Wire at_part(const simulate::Wire& wire, const WireSpread& spread, double part) {
  expects(spread.stiffness.empty() || spread.stiffness.size() == wire.sections.size());
  simulate::Wire other = wire;
  for (std::size_t k = 0; k < spread.stiffness.size(); ++k) {
    simulate::Section& section = other.sections[k];
    const double tip = spread.stiffness[k][0].at(part), shaft = spread.stiffness[k][1].at(part);
    if (tip == 1.0 && shaft == 1.0) continue;
    if (section.tapered() || tip != shaft) {
      section.proximal_bending_stiffness = shaft * section.proximal_EI();
    }
    section.bending_stiffness *= tip;
    section.bending_stiffness_2 *= tip;
  }
  return other;
}

}  // namespace wireplan::plan
