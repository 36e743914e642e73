#pragma once
/// Which support of a vessel that moves as a whole (simulate/wall/section_chain.h) explains a wire
/// that was measured in the patient, and how well it is known by that.
#include <functional>
#include <optional>
#include <vector>

#include "preprocess/base.h"

namespace wireplan::plan {

// Where a support is sought: a hundred times softer and stiffer than 1 kPa/mm.      [MPa/mm]
inline constexpr double kSoftestSupport = 0.01 * kMpaPerKpa, kStiffestSupport = 100.0 * kMpaPerKpa;

/// Mean square of the distances between the measured wire and the one computed with a support
/// [MPa/mm], in mm^2; empty where no wire came of it.
using SupportMisfit = std::function<std::optional<double>(double support)>;

struct SupportRun {
  double support = 0.0;  //                                                            [MPa/mm]
  double misfit = 0.0;   // see SupportMisfit                                            [mm^2]
};

struct SupportFit {
  double support = 0.0;             // with the least misfit                             [MPa/mm]
  double misfit = 0.0;              // at it                                               [mm^2]
  std::optional<double> low, high;  // 95 % interval; empty: any softer, any stiffer one is in it
  std::vector<SupportRun> runs;     // that had a wire, by support
};

/// The support whose wire is nearest by least squares, for `points` independent measured places
/// with one standard deviation `sigma` [mm] each. First supports half a decade apart, then a golden
/// section (Kiefer 1953) round the best of them, to 5 %. The interval holds all supports that fit
/// worse by no more than chi^2 = 3.84 (one parameter, 95 %); where not even the best fits within
/// sigma, sigma counts as large as what is left (Birge 1932). Its ends are bisected to 5 %. Empty
/// where no run has a wire.
std::optional<SupportFit> fit_support(const SupportMisfit& misfit, int points, double sigma);

}  // namespace wireplan::plan
