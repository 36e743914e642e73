#include "plan/statistics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "preprocess/base.h"

namespace wireplan::plan {

Spread find_spread(std::vector<double> values) {
  expects(!values.empty());
  std::sort(values.begin(), values.end());
  const auto quantile = [&](double part) {
    const double place = part * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return std::lerp(values[below], values[above], place - std::floor(place));
  };
  return {quantile(0.05), quantile(0.5), quantile(0.95)};
}

std::array<double, 2> wilson_interval(int successes, int count) {
  expects(count > 0 && successes >= 0 && successes <= count);
  const double z = 1.959963984540054;  // of a normal variable: 2.5 % are above
  const double n = count, rate = successes / n, z2 = z * z;
  const double middle = (rate + z2 / (2.0 * n)) / (1.0 + z2 / n);
  const double half = z / (1.0 + z2 / n) * std::sqrt(rate * (1.0 - rate) / n + z2 / (4.0 * n * n));
  // Rounding aside, none of none is 0 and all of all is 1.
  return {successes == 0 ? 0.0 : middle - half, successes == count ? 1.0 : middle + half};
}

std::array<double, 2> mean_interval(const std::vector<double>& values) {
  expects(values.size() >= 2);
  // Of Student's t: 5 % are above, by degrees of freedom; a normal variable's from 30 on.
  constexpr std::array<double, 30> kAbove = {
      6.3138, 2.9200, 2.3534, 2.1318, 2.0150, 1.9432, 1.8946, 1.8595, 1.8331, 1.8125,
      1.7959, 1.7823, 1.7709, 1.7613, 1.7531, 1.7459, 1.7396, 1.7341, 1.7291, 1.7247,
      1.7207, 1.7171, 1.7139, 1.7109, 1.7081, 1.7056, 1.7033, 1.7011, 1.6991, 1.6973};
  const double n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const std::size_t freedom = values.size() - 1;
  const double t = freedom <= kAbove.size() ? kAbove[freedom - 1] : 1.6449;
  const double half = t * std::sqrt(squares / (n - 1.0) / n);
  return {mean - half, mean + half};
}

std::vector<double> find_ranks(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    for (std::size_t k = begin; k < end; ++k) {
      ranks[order[k]] = 0.5 * static_cast<double>(begin + end - 1);
    }
    begin = end;
  }
  return ranks;
}

}  // namespace wireplan::plan
