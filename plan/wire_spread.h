#pragma once
/// How well the values of a wire are known, and the wire as it may be instead.
#include <array>
#include <vector>

#include "simulate/wire/rod.h"

namespace wireplan::plan {

/// A factor on a value that may be wrong: spread evenly in its logarithm between two bounds, or,
/// where there is a relative standard deviation, by the log-normal distribution that has it and the
/// median 1, cut at 3 standard deviations. As it stands: 1, the value is taken for known.
struct FactorSpread {
  double low = 1.0, high = 1.0;  // expects 0 < low <= high
  double deviation = 0.0;        // above 0: low and high do not count

  bool known() const { return deviation == 0.0 && low == high; }
  /// The factor that a part of the distribution lies below. Expects a part from 0 to 1.
  double at(double part) const;
};

/// Of one wire. One and the same error acts on all of its sections, each at its own scale.
struct WireSpread {
  FactorSpread friction;
  /// Of EI at either end of each section, the tip's first; empty: known. EA and GJ follow EI where
  /// they are not given.
  std::vector<std::array<FactorSpread, 2>> stiffness = {};

  bool stiffness_known() const;
};

/// The wire whose EI lies at a part of its spread.
simulate::Wire at_part(const simulate::Wire& wire, const WireSpread& spread, double part);

}  // namespace wireplan::plan
