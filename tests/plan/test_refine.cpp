#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "plan/judge.h"
#include "plan/make_plan.h"
#include "plan/refine.h"
#include "tests/plan/memory_log.h"
#include "tests/plan/tube_case.h"
#include "tests/plan/two_renals.h"
#include "tests/shapes.h"

namespace wireplan::plan {
namespace {

using simulate::Outcome;

constexpr double kLength = 40.0;  // of the wires made by hand                          [mm]

/// Richardson's factor for half an order.
const double kHalfOrder = std::sqrt(2.0) / (std::sqrt(2.0) - 1.0);

/// A wire along x with its tip at x = 0, displaced sideways by `offset` (h, distance from the tip).
RefinedRun run_of(double h, const std::function<double(double h, double s)>& offset, double force) {
  RefinedRun run;
  run.element_length = h;
  run.trial.outcome = Outcome::kMissed;
  const int edges = static_cast<int>(std::lround(kLength / h));
  run.trial.nodes.resize(3, edges + 1);
  for (int k = 0; k <= edges; ++k) {
    const double s = kLength - h * k;
    run.trial.nodes.col(k) = Vec3(-s, offset(h, s), 0.0);
  }
  simulate::Push push;
  push.insertion = kLength;
  push.iterations = 7;
  push.peak_contact_force = push.total_contact_force = push.tip_force = force;
  run.trial.metrics = compute_push_metrics({push});
  return run;
}

/// Runs at 2, 1 and 0.5 mm whose error is `size` h^order: sideways [mm], and of a force of 1 N.
std::vector<RefinedRun> runs_of_order(double order, double size) {
  std::vector<RefinedRun> runs;
  for (const double h : {2.0, 1.0, 0.5}) {
    runs.push_back(run_of(
        h, [&](double step, double) { return size * std::pow(step, order); },
        1.0 + size * std::pow(h, order)));
  }
  return runs;
}

TEST(ShapeDistance, IsTheDistanceBetweenParallelWires) {
  const auto a = run_of(
      2.0, [](double, double) { return 0.0; }, 0.0);
  const auto b = run_of(
      0.5, [](double, double) { return 0.3; }, 0.0);
  EXPECT_NEAR(shape_distance(a.trial.nodes, b.trial.nodes), 0.3, 1e-15);
  EXPECT_NEAR(shape_distance(b.trial.nodes, a.trial.nodes), 0.3, 1e-15);
}

TEST(ShapeDistance, IsZeroForTheSameLineCutAnew) {
  // A wire with a corner, in edges of 2 mm and of 0.5 mm; the corner is a node of both.
  const auto corner = [](double, double s) { return s > 20.0 ? 0.5 * (s - 20.0) : 0.0; };
  const auto a = run_of(2.0, corner, 0.0), b = run_of(0.5, corner, 0.0);
  EXPECT_LT(shape_distance(a.trial.nodes, b.trial.nodes), 1e-13);  // rounding of 40 sums
}

TEST(ShapeDistance, ComparesAsFarAsBothReach) {
  // The fine wire misses the 10 mm next to the introducer, where the coarse one strays.
  const auto a = run_of(
      2.0, [](double, double s) { return s > 31.0 ? 5.0 : 0.0; }, 0.0);
  const auto b = run_of(
      0.5, [](double, double) { return 0.0; }, 0.0);
  EXPECT_LT(shape_distance(a.trial.nodes, b.trial.nodes.rightCols(61)), 1e-13);
}

TEST(EstimateError, KnowsTheErrorsOfSecondOrderAndStatesMore) {
  const Refinement result = estimate_error(4, kLength, runs_of_order(2.0, 0.03));
  EXPECT_EQ(result.trial, 4);
  EXPECT_EQ(result.reason, "");
  ASSERT_TRUE(result.observed_order.has_value());
  EXPECT_NEAR(*result.observed_order, 2.0, 1e-12);  // rounding
  ASSERT_TRUE(result.error.has_value());
  // Half an order is assumed for what is stated: the change to h/2 is three quarters of 0.03.
  const double force = 0.75 * 0.03 * kHalfOrder;
  EXPECT_NEAR(result.error->position, force, 1e-13);
  EXPECT_NEAR(result.error->tip, force, 1e-13);
  EXPECT_NEAR(result.error->peak_force, force, 1e-13);
  EXPECT_NEAR(result.error->tip_force, force, 1e-13);
  EXPECT_NEAR(result.error->mean_force, 0.5 * force, 1e-13);  // from rest: half the last force

  ASSERT_EQ(result.rows.size(), 3u);
  for (const NumericsRow& row : result.rows) {
    const double error = 0.03 * row.element_length * row.element_length;
    ASSERT_TRUE(row.position_error.has_value());
    EXPECT_NEAR(*row.position_error, error, 1e-12);
    EXPECT_NEAR(row.peak_force, 1.0 + error, 1e-15);
    EXPECT_EQ(row.iterations, 7);
  }
  EXPECT_EQ(result.cpu_seconds.size(), 3u);
}

TEST(EstimateError, FollowsALowerOrder) {
  const Refinement result = estimate_error(0, kLength, runs_of_order(1.0, 0.03));
  EXPECT_NEAR(result.observed_order.value(), 1.0, 1e-12);
  EXPECT_NEAR(result.rows[1].position_error.value(), 0.03, 1e-13);
  EXPECT_NEAR(result.error.value().position, 0.5 * 0.03 * kHalfOrder, 1e-13);
}

TEST(EstimateError, DoesNotTrustAHigherOrderThanTheRodHas) {
  // Fourth order: the change to h is (16 - 1) 0.03 mm, of which second order makes a third.
  const Refinement result = estimate_error(0, kLength, runs_of_order(4.0, 0.03));
  EXPECT_NEAR(result.observed_order.value(), 4.0, 1e-9);
  EXPECT_NEAR(result.error.value().position, 15.0 / 3.0 * 0.03, 1e-12);
}

TEST(EstimateError, StaysFiniteWhereTheRunsDoNotConverge) {
  // Changes that grow: from 2h to h by 0.01 mm, from h to h/2 by 0.05 mm.
  const auto offset = [](double h, double) { return h == 2.0 ? 0.01 : h == 1.0 ? 0.0 : 0.05; };
  const Refinement result = estimate_error(
      0, kLength, {run_of(2.0, offset, 1.0), run_of(1.0, offset, 1.0), run_of(0.5, offset, 1.0)});
  EXPECT_LT(result.observed_order.value(), 0.0);
  EXPECT_NEAR(result.error.value().position, 0.05 * kHalfOrder, 1e-13);
}

TEST(EstimateError, AChangeThatHappensToBeSmallIsNotTrusted) {
  // From 2h to h by 0.3 mm and N, from h to h/2 by a thousandth.
  const auto offset = [](double h, double) { return h == 2.0 ? 0.3 : h == 1.0 ? 0.0 : 0.001; };
  const Refinement result = estimate_error(
      0, kLength, {run_of(2.0, offset, 1.3), run_of(1.0, offset, 1.0), run_of(0.5, offset, 1.001)});
  EXPECT_NEAR(result.error.value().tip, 0.1, 1e-13);
  EXPECT_NEAR(result.error.value().position, 0.1, 1e-13);
  EXPECT_NEAR(result.error.value().peak_force, 0.1, 1e-13);
}

TEST(EstimateError, HasNoOrderWhereNothingChanges) {
  const Refinement result = estimate_error(0, kLength, runs_of_order(2.0, 0.0));
  EXPECT_FALSE(result.observed_order.has_value());
  EXPECT_EQ(result.error.value().position, 0.0);
}

TEST(EstimateError, HasNoErrorWithoutTheFineRun) {
  auto runs = runs_of_order(2.0, 0.03);
  runs[2].trial.outcome = Outcome::kNotConverged;
  runs[2].trial.metrics.insertion = 31.5;
  runs[2].trial.reason = "no equilibrium";
  const Refinement result = estimate_error(0, kLength, runs);
  EXPECT_FALSE(result.error.has_value());
  EXPECT_FALSE(result.observed_order.has_value());
  EXPECT_EQ(result.reason,
            "with elements of 0.5 mm the wire came to 31.5 mm of 40 mm: no equilibrium");
  ASSERT_EQ(result.rows.size(), 2u);  // the longest can still be compared, the study's cannot
  EXPECT_TRUE(result.rows[0].position_error.has_value());
  EXPECT_FALSE(result.rows[1].position_error.has_value());
  EXPECT_EQ(result.cpu_seconds.size(), 2u);
}

TEST(EstimateError, NeedsNoCoarseRunForTheError) {
  auto runs = runs_of_order(2.0, 0.03);
  runs[0].trial = Measured{};
  const Refinement result = estimate_error(0, kLength, runs);
  EXPECT_NEAR(result.error.value().position, 0.75 * 0.03 * kHalfOrder, 1e-13);
  EXPECT_FALSE(result.observed_order.has_value());
  EXPECT_EQ(result.rows.size(), 2u);
  EXPECT_NE(result.reason.find("with elements of 2 mm"), std::string::npos);
}

/// Another end of the runs of an error of 0.03 mm: its wire lies `aside` mm off, and presses so.
SettingRun end_of(Setting setting, double aside, double force) {
  return {setting, run_of(
                       1.0, [&](double, double) { return 0.03 + aside; }, force)
                       .trial};
}

TEST(EstimateError, IsNoLessThanWhatSettingsMakeOfIt) {
  auto runs = runs_of_order(2.0, 0.03);
  for (RefinedRun& run : runs) run.trial.metrics.peak_push_force = 1.0;
  SettingRun step = end_of(Setting::kStep, 0.4, 1.03);
  step.trial.metrics.peak_push_force = 1.25;
  const SettingRun roll = end_of(Setting::kRoll, 0.01, 2.03);
  const Refinement result = estimate_error(0, kLength, runs, {step, roll});
  ASSERT_TRUE(result.error.has_value());
  EXPECT_NEAR(result.error->tip, 0.4, 1e-13);  // of the step
  EXPECT_NEAR(result.error->position, 0.4, 1e-13);
  EXPECT_NEAR(result.error->tip_force, 1.0, 1e-13);  // of the roll
  // The hand's force over shorter pushes is another figure, unless they lead elsewhere.
  EXPECT_NEAR(result.error->push_force, 1.0, 1e-13);  // of the roll too
  EXPECT_EQ(estimate_error(0, kLength, runs, {step}).error->push_force, 0.0);
  SettingRun far = end_of(Setting::kStep, 1.1, 1.03);
  far.trial.metrics.peak_push_force = 1.25;
  EXPECT_NEAR(estimate_error(0, kLength, runs, {far}).error->push_force, 0.25, 1e-13);
  ASSERT_EQ(result.others.size(), 2u);
  EXPECT_NEAR(result.others[0].change.push_force, 0.25, 1e-13);
  EXPECT_EQ(find_sensitivity(result), "");
  // What is smaller than the error of the elements leaves it as it is.
  const Refinement same = estimate_error(0, kLength, runs_of_order(2.0, 0.03),
                                         {end_of(Setting::kFriction, 0.02, 1.03)});
  EXPECT_NEAR(same.error.value().tip, 0.75 * 0.03 * kHalfOrder, 1e-13);
}

/// A script's runs at 2, 1, 0.5 and 0.25 mm whose tips lie so far aside; all but the first reach.
std::vector<RefinedRun> runs_of_script(const std::vector<double>& aside) {
  std::vector<RefinedRun> runs;
  double h = 2.0;
  for (const double y : aside) {
    runs.push_back(run_of(
        h, [&](double, double) { return y; }, 1.0));
    runs.back().trial.outcome = Outcome::kReached;
    h *= 0.5;
  }
  runs.front().trial.outcome = Outcome::kWrongBranch;
  runs.front().trial.reason = "the tip is in branch 7";
  return runs;
}

TEST(EstimateError, WithTheFinestRunLeavesTheLongestOut) {
  // Changes of half an order, 0.1 mm and 0.1 / sqrt(2): what is left of 0.1 mm is the whole series.
  const double next = 0.1 / std::sqrt(2.0);
  const Refinement result = estimate_error(0, {}, runs_of_script({60.0, 0.0, 0.1, 0.1 + next}));
  double series = 0.0;
  for (int k = 0; k < 200; ++k) series += 0.1 * std::pow(2.0, -0.5 * k);
  EXPECT_NEAR(result.error.value().tip, series, 1e-12);
  EXPECT_NEAR(result.error.value().position, series, 1e-12);
  EXPECT_NEAR(result.observed_order.value(), 0.5, 1e-9);
  ASSERT_EQ(result.rows.size(), 3U);
  EXPECT_EQ(result.rows.front().element_length, 1.0);
  EXPECT_EQ(result.left_out,
            "with elements of 2 mm the target is not reached: the tip is in branch 7");
  EXPECT_EQ(result.reason, "");
  EXPECT_EQ(result.not_finer, "");
}

TEST(EstimateError, AChangeThatHappensToBeSmallIsSeenByTheFinestRun) {
  const Refinement result = estimate_error(0, {}, runs_of_script({60.0, 0.0, 0.001, 0.5}));
  // The finest is 0.5 mm away, and its own error by half an order of the last change more.
  EXPECT_NEAR(result.error.value().tip, 0.5 + 0.499 / (std::sqrt(2.0) - 1.0), 1e-12);
}

TEST(EstimateError, OfAScriptNamesFinerRunsThatDoNotReach) {
  auto runs = runs_of_script({60.0, 0.0, 0.1, 44.0});
  runs[3].trial.outcome = Outcome::kPassedBy;
  runs[3].trial.reason = "the tip is in the aorta";
  SettingRun step = end_of(Setting::kStep, 0.0, 1.0);
  step.trial.outcome = Outcome::kReached;
  const std::string told =
      "with elements of 0.25 mm the target is not reached: the tip is in the aorta";
  const Refinement result = estimate_error(0, {}, runs, {step});
  EXPECT_NEAR(result.error.value().tip, 0.1 * kHalfOrder, 1e-12);
  EXPECT_EQ(find_sensitivity(result), told);
  EXPECT_EQ(result.reason, told);
  // Without that of half the length there is no error.
  runs.pop_back();
  runs[0].trial.outcome = Outcome::kReached;
  runs[2].trial.outcome = Outcome::kPassedBy;
  const Refinement none = estimate_error(0, {}, runs, {step});
  EXPECT_FALSE(none.error.has_value());
  EXPECT_EQ(find_sensitivity(none), "with elements of 0.5 mm the target is not reached: passed_by");
}

TEST(NeedsFinest, WhereTheLongestAloneDoesNotReach) {
  auto runs = runs_of_script({60.0, 0.0, 0.1});
  EXPECT_TRUE(needs_finest(runs));
  runs[2].trial.outcome = Outcome::kPassedBy;
  EXPECT_FALSE(needs_finest(runs)) << "the plan's own end is in doubt";
  runs[2].trial.outcome = runs[0].trial.outcome = Outcome::kReached;
  EXPECT_FALSE(needs_finest(runs));
}

/// A wire that comes along the axis of the aorta and turns into the branch, to so far out, `up` mm
/// above its axis.
Eigen::Matrix3Xd into_branch(double out, double up) {
  std::vector<Vec3> points;
  for (double z = 5.0; z < kLevel; z += 1.5) points.emplace_back(0.0, 0.0, z);
  for (double x = 0.0; x < out; x += 1.5) points.emplace_back(x, 0.0, kLevel + up);
  points.emplace_back(out, 0.0, kLevel + up);
  Eigen::Matrix3Xd nodes(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) {
    nodes.col(static_cast<Eigen::Index>(k)) = points[k];
  }
  return nodes;
}

TEST(CutAtGoal, EndsWhereTheWirePassesTheCrossSection) {
  const simulate::Goal goal = toward(1.0).goal;                          // 35 mm out
  for (const double out : {35.2, 36.0, 37.9, 35.0 - 1.3, 35.0 - 3.0}) {  // the last were drawn back
    SCOPED_TRACE(out);
    const Vec3 tip = cut_at_goal(into_branch(out, 0.4), goal).rightCols<1>();
    EXPECT_LT((tip - Vec3(35.0, 0.0, kLevel + 0.4)).norm(), 1e-9);
  }
  // One that is far from it ends where it ends.
  const Vec3 far = cut_at_goal(into_branch(20.0, 0.4), goal).rightCols<1>();
  EXPECT_LT((far - Vec3(20.0, 0.0, kLevel + 0.4)).norm(), 1e-9);
}

TEST(CutAtGoal, EndsWhereTheWireIsNearestToAPoint) {
  const simulate::Goal goal{.point = Vec3(30.0, 2.0, kLevel), .radius = 3.0};
  for (const double out : {31.0, 33.3}) {
    const Vec3 tip = cut_at_goal(into_branch(out, 0.0), goal).rightCols<1>();
    EXPECT_LT((tip - Vec3(30.0, 0.0, kLevel)).norm(), 1e-9);
  }
}

TEST(FinestRuns, AreOfScriptsAlone) {
  const Study study = toward(1.0);
  for (const int catheter : {0, -1}) {
    const std::vector<plan::Run> runs = refinement_runs(3, {.catheter = catheter}, 100.0);
    Measured there;
    there.nodes = into_branch(36.0, 0.0);
    there.metrics.insertion = 100.0;
    there.outcome = Outcome::kReached;
    std::vector<Measured> trials(runs.size(), there);
    EXPECT_TRUE(finest_runs(study, runs, trials).empty());
    trials[0].outcome = Outcome::kWrongBranch;
    const std::vector<plan::Run> finest = finest_runs(study, runs, trials);
    ASSERT_EQ(finest.size(), catheter >= 0 ? 1U : 0U);
    if (finest.empty()) continue;
    EXPECT_EQ(finest[0].id, 3);
    EXPECT_EQ(finest[0].elements.value().factor, 0.25);
    // Half a millimetre further on is no error, as long as it passes the same place: 0.2 mm aside.
    std::vector<plan::Run> all = runs;
    all.push_back(finest[0]);
    trials.push_back(there);
    trials.back().nodes = into_branch(36.5, 0.2);
    trials.back().metrics.insertion = 100.5;
    const Refinement result = estimate_error_of(study, 3, all, trials);
    EXPECT_NE(result.left_out, "");
    EXPECT_NEAR(result.error.value().tip, 0.2 / (1.0 - std::sqrt(0.5)), 1e-9);
  }
}

TEST(Sensitivity, IsToldWithTheSettingAndHowFarAwayItEnds) {
  const auto runs = runs_of_order(2.0, 0.03);
  const Refinement result =
      estimate_error(0, kLength, runs,
                     {end_of(Setting::kStep, 4.6, 1.03), end_of(Setting::kRoll, 0.99, 1.03),
                      end_of(Setting::kFriction, 1.01, 1.03)});
  EXPECT_EQ(find_sensitivity(result),
            "with pushes half as long its tip ends 4.6 mm away; with 0.1 % more friction its tip "
            "ends 1.0 mm away");
  EXPECT_FALSE(find_sensitivity(estimate_error(0, kLength, runs)).has_value());
}

TEST(Sensitivity, KnowsAnEndThatCameLessFar) {
  SettingRun stuck = end_of(Setting::kStep, 0.0, 1.03);
  stuck.trial.metrics.insertion = 31.5;
  stuck.trial.reason = "stuck at the bend";
  const Refinement result = estimate_error(3, kLength, runs_of_order(2.0, 0.03), {stuck});
  const std::string told =
      "with pushes half as long the wire came to 31.5 mm of 40 mm: stuck at the bend";
  EXPECT_EQ(find_sensitivity(result), told);
  const auto by_trial = sensitivity_by_trial({result}, 5);
  EXPECT_EQ(by_trial[3], told);
  EXPECT_FALSE(by_trial[2].has_value());
}

TEST(Sensitivity, IsNotKnownWhereThePlanItselfDidNotComeAsFar) {
  auto runs = runs_of_order(2.0, 0.03);
  runs[1].trial.metrics.insertion = 31.5;
  const Refinement result = estimate_error(0, kLength, runs, {end_of(Setting::kStep, 4.6, 1.03)});
  EXPECT_FALSE(find_sensitivity(result).has_value());
  EXPECT_FALSE(result.error.has_value());
}

TEST(SettingsThatAct, LeaveOutWhatTheWireDoesNotFeel) {
  Study study = TubeCase().study;
  study.wires = {{.name = "straight",
                  .radius = 0.4,
                  .sections = {{.length = 60.0, .bending_stiffness = 50.0}}},
                 {.name = "curved",
                  .radius = 0.4,
                  .sections = {{.length = 60.0, .bending_stiffness = 50.0, .rest_curvature = 0.05}},
                  .friction = 0.1}};
  study.insertion.friction = 0.0;
  EXPECT_EQ(settings_that_act(study, {.wire = 0}),
            (std::vector<Setting>{Setting::kStep, Setting::kTolerance}));
  EXPECT_EQ(settings_that_act(study, {.wire = 1}),
            (std::vector<Setting>{Setting::kStep, Setting::kTolerance, Setting::kRoll,
                                  Setting::kFriction}));
}

TEST(ChangeSetting, ChangesTheOneThatItNames) {
  for (const Setting setting :
       {Setting::kStep, Setting::kRoll, Setting::kFriction, Setting::kTolerance}) {
    SCOPED_TRACE(setting_name(setting));
    const Study before = TubeCase().study;
    Study study = before;
    Candidate candidate{.roll = 1.0};
    change_setting(setting, study, candidate);
    const simulate::InsertionOptions &is = study.insertion, &was = before.insertion;
    EXPECT_EQ(is.step / was.step, setting == Setting::kStep ? 0.5 : 1.0);
    EXPECT_NEAR(candidate.roll - 1.0, setting == Setting::kRoll ? 0.01 * kRadPerDeg : 0.0, 1e-15);
    EXPECT_EQ(is.friction_factor, setting == Setting::kFriction ? 1.001 : 1.0);
    EXPECT_NEAR(is.residual_tolerance / was.residual_tolerance,
                setting == Setting::kTolerance ? 0.1 : 1.0, 1e-12);
  }
}

TEST(ErrorsByTrial, PutsEachErrorIntoTheSlotOfItsTrial) {
  Refinement known, unknown;
  known.trial = 2;
  known.error = NumericalError{.position = 0.1};
  unknown.trial = 0;
  const auto errors = errors_by_trial({known, unknown}, 4);
  ASSERT_EQ(errors.size(), 4u);
  EXPECT_FALSE(errors[0].has_value());
  EXPECT_FALSE(errors[1].has_value());
  EXPECT_EQ(errors[2].value().position, 0.1);
}

TEST(EstimateError, TellsTheTipFromTheRestOfTheWire) {
  // The wire is wrong in its middle alone.
  std::vector<RefinedRun> runs;
  for (const double h : {2.0, 1.0, 0.5}) {
    runs.push_back(run_of(
        h, [](double step, double s) { return 0.03 * step * step * std::sin(kPi * s / kLength); },
        1.0));
  }
  const Refinement result = estimate_error(0, kLength, runs);
  // The slope lengthens the coarse wire.
  EXPECT_NEAR(result.error.value().position, 0.75 * 0.03 * kHalfOrder, 3e-4);
  EXPECT_LT(result.error.value().tip, 1e-15);
}

/// A study with real trials: askew into a straight tube, where the wire lies against the wall.
struct TubeStudy : TubeCase {
  TubeStudy() {
    study.wires = {
        {.name = "soft", .radius = 0.4, .sections = {{.length = 60.0, .bending_stiffness = 50.0}}}};
    study.inclinations = {15.0 * kRadPerDeg};
    study.azimuths = {0.0, 1.0};
    study.rolls = {0.0};
  }

  Plan planned(int threads) const {
    PlanOptions options{.manoeuvres = Manoeuvring::kNever, .batch = {.threads = threads}};
    options.robustness.repeats = 0;
    MemoryLog log;
    return plan(log, options);
  }
};

/// Plans 10, 11, ... in order, the first tied with those given.
Ranking ranking_of(int plans, const std::vector<int>& tied_with_first) {
  Ranking ranking;
  for (int k = 0; k < plans; ++k) ranking.plans.emplace_back().trial = 10 + k;
  ranking.plans[0].tied_with = tied_with_first;
  return ranking;
}

std::vector<Refinement> refinements_of(const std::vector<int>& trials) {
  std::vector<Refinement> known;
  for (const int trial : trials) known.emplace_back().trial = trial;
  return known;
}

TEST(ChoosePlansToRefine, StopsWhereNoAssumedErrorTouchesTheFirst) {
  const Ranking clear = ranking_of(12, {});
  EXPECT_EQ(choose_plans_to_refine(clear, {}, {}), (std::vector<int>{10, 11, 12}));
  EXPECT_TRUE(choose_plans_to_refine(clear, refinements_of({10, 11, 12}), {}).empty());

  const Ranking tied = ranking_of(12, {12, 14, 17});
  EXPECT_EQ(choose_plans_to_refine(tied, {}, {}), (std::vector<int>{10, 11, 12, 14, 17}));
  EXPECT_EQ(choose_plans_to_refine(tied, refinements_of({10, 11, 12, 14}), {}),
            (std::vector<int>{17}));
  EXPECT_TRUE(choose_plans_to_refine(tied, refinements_of({10, 11, 12, 14, 17}), {}).empty());
}

TEST(ChoosePlansToRefine, TakesNoMoreThanAskedButTheFirstAlways) {
  const Ranking all_tied = ranking_of(12, {11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21});
  EXPECT_EQ(choose_plans_to_refine(all_tied, {}, {}).size(), 8U);
  EXPECT_EQ(choose_plans_to_refine(all_tied, refinements_of({10, 12, 14, 15, 16, 17, 18, 19}), {}),
            (std::vector<int>{11}));
  EXPECT_TRUE(choose_plans_to_refine(Ranking{}, {}, {}).empty());
}

TEST(RefinePlans, EstimatesASmallErrorOfAWireAgainstTheWall) {
  const TubeStudy tube;
  const Plan plan = tube.planned(2);
  const std::vector<Refinement>& refinements = plan.refinements;
  const Ranking ranking = judge(tube.study, plan, {}, {}).ranking;
  ASSERT_EQ(ranking.plans.size(), 2u);
  ASSERT_EQ(refinements.size(), 2u);  // asked for three, there are two
  for (std::size_t k = 0; k < refinements.size(); ++k) {
    const Refinement& r = refinements[k];
    EXPECT_EQ(r.trial, ranking.plans[k].trial);
    ASSERT_TRUE(r.error.has_value()) << r.reason;
    EXPECT_GT(r.error->position, 0.0);
    EXPECT_LT(r.error->position, 1.0);  // an element's length: coarser would be no answer
    ASSERT_EQ(r.rows.size(), 3u);
    EXPECT_LT(r.rows[2].position_error.value(), r.rows[1].position_error.value());
    EXPECT_GT(r.rows[1].peak_force, 1e-3);  // it does press on the wall
    for (const double seconds : r.cpu_seconds) EXPECT_GT(seconds, 0.0);
    ASSERT_EQ(r.others.size(), 1u);  // straight, without friction: only the push's length
    EXPECT_EQ(r.others[0].setting, Setting::kStep);
    EXPECT_LT(r.others[0].change.tip, 0.1);  // no path to depend on
    EXPECT_EQ(find_sensitivity(r), "");
  }
}

TEST(RefinePlans, GivesTheSameAtAnyThreadCount) {
  const TubeStudy tube;
  const auto serial = tube.planned(1).refinements, parallel = tube.planned(3).refinements;
  ASSERT_EQ(serial.size(), parallel.size());
  ASSERT_FALSE(serial.empty());
  for (std::size_t k = 0; k < serial.size(); ++k) {
    ASSERT_TRUE(serial[k].error.has_value()) << serial[k].reason;
    EXPECT_EQ(serial[k].error->position, parallel[k].error->position);
    EXPECT_EQ(serial[k].error->peak_force, parallel[k].error->peak_force);
    EXPECT_EQ(serial[k].observed_order, parallel[k].observed_order);
  }
}

}  // namespace
}  // namespace wireplan::plan
