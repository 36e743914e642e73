#pragma once
/// Numbers about samples.
#include <array>
#include <vector>

namespace wireplan::plan {

/// Median and the bounds of the central 90 %, interpolated linearly between sorted values (type 7
/// of Hyndman and Fan, Am. Stat. 1996).
struct Spread {
  double low = 0.0, median = 0.0, high = 0.0;
};
/// Expects at least one value.
Spread find_spread(std::vector<double> values);

/// 95 % interval of a rate of which `successes` of `count` were seen (Wilson, JASA 1927). Expects
/// count > 0.
std::array<double, 2> wilson_interval(int successes, int count);

/// 90 % interval of the mean of a normal variable, of which these were drawn (Student, Biometrika
/// 1908). Expects at least two values.
std::array<double, 2> mean_interval(const std::vector<double>& values);

/// Place of each value in ascending order, from 0; equal values share the mean of their places.
std::vector<double> find_ranks(const std::vector<double>& values);

}  // namespace wireplan::plan
