// Who is repeated next: what may still come before the first plan, and once what tells of a
// catheter.
#include <gtest/gtest.h>

#include <cmath>

#include "plan/repeat_choice.h"
#include "plan/statistics.h"

namespace wireplan::plan {
namespace {

constexpr double kBroken = -1.0;  // a score that stands for a repeat that is not safe

RepeatedPlan repeats_of(int trial, const std::vector<double>& scores) {
  RepeatedPlan plan{.trial = trial, .repeats = {}};
  for (const double score : scores) {
    plan.repeats.push_back(
        {.reached = true, .safe = score >= 0.0, .score = score < 0.0 ? 1.0 : score});
  }
  return plan;
}

/// Plans 0, 1, ... in this order, each with the catheter of its own number.
struct Ranked {
  Ranking ranking;
  std::vector<Candidate> candidates;
  std::vector<RepeatedPlan> repeated;

  explicit Ranked(int count) {
    for (int k = 0; k < count; ++k) {
      RankedPlan& plan = ranking.plans.emplace_back();
      plan.trial = k;
      candidates.push_back({.wire = 0, .moves = {}, .catheter = k, .steps = {}});
    }
    ranking.wires.resize(1);
    ranking.wires[0].best_trial = 0;
  }
  RankedPlan& plan(int k) { return ranking.plans[static_cast<std::size_t>(k)]; }
  bool may_lead(int k) { return plan::may_lead(plan(k), plan(0), repeated); }
  NextRepeats choose(int among = 3, int most = 16) const {
    return choose_others_to_repeat(ranking, candidates, repeated, 1, among, most);
  }
};

TEST(MayLead, WhatWasUnsafeMoreOftenMayNot) {
  Ranked plans(4);
  plans.repeated = {repeats_of(0, {0.2, 0.2, kBroken, 0.2, 0.2, 0.2, 0.2, 0.2}),
                    repeats_of(1, {kBroken, kBroken, 0.1, 0.1}),
                    repeats_of(2, {0.9, 0.9, 0.9, 0.9}), repeats_of(3, {0.1, 0.1, kBroken, 0.1})};
  EXPECT_FALSE(plans.may_lead(1)) << "twice: never again, and it has one more than the first";
  EXPECT_TRUE(plans.may_lead(2)) << "never yet, whatever it scores";
  EXPECT_TRUE(plans.may_lead(3)) << "as often, and it scores better";
}

TEST(MayLead, OfPlansAsSafeWhatScoresWorseForSureMayNot) {
  Ranked plans(5);
  plans.repeated = {repeats_of(0, {0.20, 0.22, 0.21, 0.20, 0.20, 0.20, 0.20, 0.20}),
                    repeats_of(1, {0.25, 0.28, 0.26, 0.25}),  // differences 5 to 6 hundredths
                    repeats_of(2, {0.21, 0.19, 0.25, 0.20}),  // 1, -3, 4 and 0
                    repeats_of(3, {0.15, 0.17, 0.16, 0.15}), repeats_of(4, {0.9})};
  EXPECT_FALSE(plans.may_lead(1));
  EXPECT_TRUE(plans.may_lead(2));
  EXPECT_TRUE(plans.may_lead(3));
  EXPECT_TRUE(plans.may_lead(4)) << "of one repeat nothing is known";
}

TEST(MayLead, WithoutRepeatsItHangsOnTheFirst) {
  Ranked plans(3);
  plans.plan(0).tied_with = {2};
  plans.repeated = {repeats_of(0, {0.2, 0.2})};
  EXPECT_FALSE(plans.may_lead(1)) << "a first that is always safe is passed by its score alone";
  EXPECT_TRUE(plans.may_lead(2));
  plans.repeated = {repeats_of(0, {0.2, kBroken})};
  EXPECT_TRUE(plans.may_lead(1));
  plans.plan(1).sensitive = "its end hangs on the push";
  EXPECT_FALSE(plans.may_lead(1)) << "such plans stand last";
  plans.plan(0).tip_unsure = true;
  EXPECT_TRUE(plans.may_lead(1));
}

TEST(ChooseOthersToRepeat, GoesOnWithWhatMayLeadAndTakesEachCatheterOnce) {
  Ranked plans(6);
  plans.candidates[4].catheter = 3;
  EXPECT_TRUE(plans.choose().plans.empty()) << "the first has no repeats yet";
  plans.plan(0).tied_with = {1};
  plans.repeated = {repeats_of(0, std::vector<double>(8, 0.2))};
  NextRepeats next = plans.choose();
  EXPECT_EQ(next.plans, (std::vector<int>{1, 2, 3, 5})) << "4 is not the best of its catheter";
  EXPECT_EQ(next.count, 4);
  for (const int k : {1, 3, 5}) plans.repeated.push_back(repeats_of(k, {0.2, 0.2, 0.2, 0.2}));
  next = plans.choose();
  EXPECT_EQ(next.plans, std::vector<int>{2}) << "the fewest of each before the few of any";
  plans.repeated.push_back(repeats_of(2, {0.3, 0.31, 0.3, 0.3}));
  next = plans.choose();
  EXPECT_EQ(next.plans, (std::vector<int>{1, 3, 5}));
  EXPECT_EQ(next.count, 8);
  plans.repeated[1] = repeats_of(1, {0.2, kBroken, 0.2, 0.2});
  EXPECT_EQ(plans.choose().plans, (std::vector<int>{3, 5}));
  EXPECT_EQ(plans.choose(3, 4).plans, std::vector<int>{}) << "of four that are asked for";
}

TEST(MeanInterval, IsThatOfStudent) {
  // The part of Student's density between -t and t, with t read back from the interval.
  for (const int count : {2, 3, 4, 8, 16, 31}) {
    SCOPED_TRACE(count);
    std::vector<double> values;
    for (int k = 0; k < count; ++k) values.push_back(3.0 + (k % 2 == 0 ? 1.0 : -1.0) + 0.1 * k);
    const auto [low, high] = mean_interval(values);
    double mean = 0.0, squares = 0.0;
    for (const double value : values) mean += value / count;
    for (const double value : values) squares += (value - mean) * (value - mean) / (count - 1.0);
    EXPECT_NEAR(0.5 * (low + high), mean, 1e-12);
    const double t = 0.5 * (high - low) / std::sqrt(squares / count), nu = count - 1.0;
    const double at_middle =
        std::exp(std::lgamma(0.5 * (nu + 1.0)) - std::lgamma(0.5 * nu)) / std::sqrt(nu * kPi);
    constexpr int kParts = 20'000;
    double inside = 0.0;
    for (int k = 0; k < kParts; ++k) {
      const double x = t * (2.0 * (k + 0.5) / kParts - 1.0);
      inside += 2.0 * t / kParts * at_middle * std::pow(1.0 + x * x / nu, -0.5 * (nu + 1.0));
    }
    EXPECT_NEAR(inside, 0.9, 1e-4);  // the table has four digits
  }
  const auto [low, high] = mean_interval(std::vector<double>(100, 2.0));
  EXPECT_EQ(low, 2.0);
  EXPECT_EQ(high, 2.0);
}

}  // namespace
}  // namespace wireplan::plan
