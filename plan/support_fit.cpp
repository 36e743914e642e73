#include "plan/support_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace wireplan::plan {
namespace {

constexpr int kScanned = 9;          // supports, half a decade apart
constexpr double kFine = 0.02;       // of a decade: 5 %
constexpr double kChiSquare = 3.84;  // of one parameter, 95 %

constexpr double kNoWire = std::numeric_limits<double>::infinity();  // misfit where none came

/// The runs, in the order of their supports.
class Runs {
 public:
  explicit Runs(const SupportMisfit& misfit) : misfit_(misfit) {}

  /// Runs a support given by the logarithm of its size.
  void add(double decade) {
    const double support = std::pow(10.0, decade);
    const auto later = std::find_if(list_.begin(), list_.end(),
                                    [&](const SupportRun& run) { return run.support > support; });
    list_.insert(later, {support, misfit_(support).value_or(kNoWire)});
  }

  const std::vector<SupportRun>& list() const { return list_; }

  std::size_t best() const {
    const auto less = [](const SupportRun& a, const SupportRun& b) { return a.misfit < b.misfit; };
    return static_cast<std::size_t>(std::min_element(list_.begin(), list_.end(), less) -
                                    list_.begin());
  }

  double decade(std::size_t k) const { return std::log10(list_[k].support); }

 private:
  const SupportMisfit& misfit_;
  std::vector<SupportRun> list_;
};

/// Golden sections between the neighbours of the best run, each of the longer side.
void refine(Runs& runs) {
  constexpr double kPart = 2.0 - std::numbers::phi;
  for (;;) {
    const std::size_t best = runs.best();
    const double at = runs.decade(best);
    const double before = best > 0 ? at - runs.decade(best - 1) : 0.0;
    const double behind = best + 1 < runs.list().size() ? runs.decade(best + 1) - at : 0.0;
    if (std::max(before, behind) < kFine) return;
    runs.add(before > behind ? at - kPart * before : at + kPart * behind);
  }
}

/// The end of the interval on one side: between the outermost run with no more misfit than `most`
/// and the next one out; empty where that is the last of all.
std::optional<double> find_end(Runs& runs, double most, bool upward) {
  for (;;) {
    const std::vector<SupportRun>& list = runs.list();
    const auto fits = [&](std::size_t k) { return list[k].misfit <= most; };
    std::size_t inner = upward ? list.size() - 1 : 0, outer = inner;
    if (fits(inner)) return {};
    for (; !fits(inner); inner = upward ? inner - 1 : inner + 1) outer = inner;
    const double out = runs.decade(outer), in = runs.decade(inner);
    if (std::abs(out - in) < kFine) return list[inner].support;
    runs.add(0.5 * (out + in));
  }
}

}  // namespace

std::optional<SupportFit> fit_support(const SupportMisfit& misfit, int points, double sigma) {
  expects(points > 1 && sigma > 0.0);
  Runs runs(misfit);
  const double first = std::log10(kSoftestSupport), last = std::log10(kStiffestSupport);
  for (int k = 0; k < kScanned; ++k) runs.add(first + (last - first) * k / (kScanned - 1));
  if (runs.list()[runs.best()].misfit == kNoWire) return {};
  refine(runs);

  SupportFit fit;
  fit.support = runs.list()[runs.best()].support;
  fit.misfit = runs.list()[runs.best()].misfit;
  const double left = fit.misfit * points / (points - 1);  // mean square that is not explained
  const double most = fit.misfit + kChiSquare * std::max(sigma * sigma, left) / points;
  fit.low = find_end(runs, most, false);
  fit.high = find_end(runs, most, true);
  fit.runs = runs.list();
  std::erase_if(fit.runs, [](const SupportRun& run) { return run.misfit == kNoWire; });
  return fit;
}

}  // namespace wireplan::plan
