#include <gtest/gtest.h>

#include <cmath>

#include "plan/support_fit.h"

namespace wireplan::plan {
namespace {

constexpr double kUnit = 1.0 * kMpaPerKpa;  // [MPa/mm]

/// What a wire is off by whose shape goes with the logarithm of the support.
SupportMisfit parabola(double best, double least, double per_decade) {
  return [=](double support) {
    const double decades = std::log10(support / best);
    return least + per_decade * decades * decades;
  };
}

TEST(SupportFit, FindsTheLeastMisfitAndTheIntervalOfItsParabola) {
  // 20 places known to 0.5 mm: chi^2 = 20 * 4 * d^2 / 0.25 is 3.84 at d = 0.1095 decades.
  const auto fit = fit_support(parabola(0.7 * kUnit, 0.1, 4.0), 20, 0.5);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(std::log10(fit->support / (0.7 * kUnit)), 0.0, 0.02);
  ASSERT_TRUE(fit->low && fit->high);
  EXPECT_NEAR(std::log10(*fit->high / (0.7 * kUnit)), 0.1095, 0.021);
  EXPECT_NEAR(std::log10(*fit->low / (0.7 * kUnit)), -0.1095, 0.021);
  EXPECT_LE(fit->runs.size(), 40U);
  for (std::size_t k = 0; k + 1 < fit->runs.size(); ++k) {
    EXPECT_LT(fit->runs[k].support, fit->runs[k + 1].support);
  }
}

TEST(SupportFit, WhatNoSupportExplainsMakesTheIntervalWider) {
  // 1.8 mm^2 are left of 10 places known to 0.5 mm: 2 mm^2 in place of 0.25.
  const auto fit = fit_support(parabola(kUnit, 1.8, 4.0), 10, 0.5);
  ASSERT_TRUE(fit && fit->low && fit->high);
  const double end = std::sqrt(3.84 * 2.0 / 10.0 / 4.0);
  EXPECT_NEAR(std::log10(*fit->high / kUnit), end, 0.021);
  EXPECT_NEAR(std::log10(*fit->low / kUnit), -end, 0.021);
}

TEST(SupportFit, AWireThatTellsOneSideOnlyLeavesTheOtherOpen) {
  const auto stiff = fit_support(parabola(1e4 * kUnit, 0.0, 0.2), 20, 0.5);
  ASSERT_TRUE(stiff);
  EXPECT_NEAR(stiff->support / kStiffestSupport, 1.0, 1e-9);
  EXPECT_FALSE(stiff->high);
  EXPECT_TRUE(stiff->low);
  const auto nothing = fit_support([](double) { return 0.3; }, 20, 0.5);
  ASSERT_TRUE(nothing);
  EXPECT_FALSE(nothing->low || nothing->high);
}

TEST(SupportFit, RunsWithoutAWireAreLeftOut) {
  const SupportMisfit whole = parabola(0.7 * kUnit, 0.1, 4.0);
  const auto fit = fit_support(
      [&](double support) { return support < 0.5 * kUnit ? std::nullopt : whole(support); }, 20,
      0.5);
  ASSERT_TRUE(fit && fit->low);
  EXPECT_NEAR(std::log10(fit->support / (0.7 * kUnit)), 0.0, 0.02);
  EXPECT_GE(*fit->low, 0.5 * kUnit);
  EXPECT_FALSE(fit_support([](double) { return std::optional<double>(); }, 20, 0.5));
}

}  // namespace
}  // namespace wireplan::plan
