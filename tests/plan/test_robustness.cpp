#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "plan/batch.h"
#include "plan/robustness.h"
#include "plan/statistics.h"
#include "tests/plan/tube_study.h"

namespace wireplan::plan {
namespace {

using simulate::Outcome;

// ---- statistics -------------------------------------------------------------------------------

TEST(Spread, InterpolatesBetweenNeighbours) {
  const Spread spread = find_spread({4.0, 0.0, 1.0, 3.0, 2.0});
  EXPECT_DOUBLE_EQ(spread.low, 0.2);  // 5 % of the way through 4 gaps
  EXPECT_DOUBLE_EQ(spread.median, 2.0);
  EXPECT_DOUBLE_EQ(spread.high, 3.8);
  EXPECT_EQ(find_spread({7.0}).high, 7.0);
  EXPECT_THROW(find_spread({}), LogicError);
}

TEST(WilsonInterval, IsWhereTheRateIsTwoDeviationsFromWhatWasSeen) {
  // By its definition: (seen - p)^2 = z^2 p (1 - p) / n at both ends.
  const double z = 1.959963984540054;
  for (const auto& [successes, count] : {std::pair{8, 10}, {15, 16}, {1, 1000}}) {
    const auto [low, high] = wilson_interval(successes, count);
    const double seen = double(successes) / count;
    for (const double p : {low, high}) {
      EXPECT_NEAR((seen - p) * (seen - p), z * z * p * (1.0 - p) / count, 1e-14);
    }
    EXPECT_LT(low, seen);
    EXPECT_GT(high, seen);
  }
  EXPECT_EQ(wilson_interval(16, 16)[1], 1.0);
  EXPECT_EQ(wilson_interval(0, 16)[0], 0.0);
}

TEST(Ranks, ShareTheMeanPlaceOfEquals) {
  EXPECT_EQ(find_ranks({0.3, -1.0, 0.3, 9.0}), (std::vector<double>{1.5, 0.0, 1.5, 3.0}));
}

// ---- disturbances -----------------------------------------------------------------------------

TEST(Disturbances, CoverEachRangeEvenlyAndStayWithinIt) {
  RobustnessOptions options;
  options.repeats = 64;
  const std::vector<Disturbance> drawn = draw_disturbances(options, {});
  ASSERT_EQ(drawn.size(), 64u);
  std::set<int> friction, wall, tilt, shift, lumen, tube;
  int stiff_with_stiff = 0;
  for (const Disturbance& d : drawn) {
    // The part of the range, by the inverse of how it is spread.
    const auto cell = [](double part) { return static_cast<int>(std::floor(64.0 * part)); };
    friction.insert(cell(d.friction));
    wall.insert(cell(std::log(d.wall_factor / 0.5) / std::log(4.0)));
    tilt.insert(cell(std::pow(d.tilt.norm() / options.unknowns.angle, 2)));
    shift.insert(cell(std::pow(d.shift.norm() / options.unknowns.entry, 2)));
    lumen.insert(cell(0.5 * (d.inward / options.unknowns.lumen + 1.0)));
    tube.insert(cell(d.tube));
    stiff_with_stiff += (d.tube > 0.5) == (d.wall_factor > 1.0) ? 1 : 0;
  }
  // Each cell once. Rounding could move a draw over the edge of its cell; it is that near in 1e-13.
  for (const auto* cells : {&friction, &wall, &tilt, &shift, &lumen, &tube}) {
    EXPECT_EQ(cells->size(), 64u);
    EXPECT_EQ(*cells->begin(), 0);
    EXPECT_EQ(*cells->rbegin(), 63);
  }
  EXPECT_NEAR(stiff_with_stiff, 32, 14) << "a stiff wall tells nothing of a catheter";
}

TEST(Disturbances, LeanToAllSides) {
  RobustnessOptions options;
  options.repeats = 256;
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();
  for (const Disturbance& d : draw_disturbances(options, {})) tilt += d.tilt / options.repeats;
  // The mean of independent draws has a deviation of 5 deg / 2 / sqrt(256) on each axis.
  EXPECT_LT(tilt.norm(), 3.0 * 5.0 * kRadPerDeg / 2.0 / 16.0);
}

TEST(Disturbances, FollowTheSeedAlone) {
  RobustnessOptions options;
  const auto first = draw_disturbances(options, {}), again = draw_disturbances(options, {});
  options.seed = 2;
  const auto other = draw_disturbances(options, {});
  for (std::size_t k = 0; k < first.size(); ++k) {
    EXPECT_EQ(first[k].friction, again[k].friction);
    EXPECT_EQ(first[k].tilt, again[k].tilt);
    EXPECT_NE(first[k].friction, other[k].friction);
  }
}

TEST(Disturbances, OfAWireFollowFromItsNameWhateverTheOthersAre) {
  RobustnessOptions options;
  options.repeats = 32;
  const simulate::Wire a{.name = "a", .radius = 0.4, .sections = {}},
      b{.name = "b", .radius = 0.4, .sections = {}};
  const auto one = draw_disturbances(options, {a}), both = draw_disturbances(options, {b, a});
  std::set<int> cells;
  int different = 0;
  for (std::size_t k = 0; k < one.size(); ++k) {
    ASSERT_EQ(both[k].stiffness.size(), 2u);
    EXPECT_EQ(one[k].stiffness[0], both[k].stiffness[1]);
    EXPECT_EQ(one[k].tilt, both[k].tilt);
    different += both[k].stiffness[0] != both[k].stiffness[1];
    cells.insert(static_cast<int>(32.0 * one[k].stiffness[0]));
  }
  EXPECT_EQ(different, 32);
  EXPECT_EQ(cells.size(), 32u) << "each part of its range once";
}

TEST(FactorSpread, HasItsBoundsOrItsStandardDeviation) {
  const FactorSpread even{.low = 0.5, .high = 2.0}, normal{.deviation = 0.3};
  EXPECT_TRUE(FactorSpread().known());
  EXPECT_FALSE(even.known());
  EXPECT_FALSE(normal.known());
  EXPECT_DOUBLE_EQ(even.at(0.0), 0.5);
  EXPECT_DOUBLE_EQ(even.at(0.5), 1.0);
  EXPECT_DOUBLE_EQ(even.at(1.0), 2.0);
  EXPECT_EQ(normal.at(0.5), 1.0);
  // Of the log-normal distribution with median 1: sd = m sqrt(1 + v) with m = sqrt(1 + v) its mean
  // and v the square of sd / mean, which is 0.3.
  double sum = 0.0, squares = 0.0;
  constexpr int kCount = 20000;
  for (int k = 0; k < kCount; ++k) {
    const double factor = normal.at((k + 0.5) / kCount);
    sum += factor;
    squares += factor * factor;
  }
  const double mean = sum / kCount, deviation = std::sqrt(squares / kCount - mean * mean);
  EXPECT_NEAR(deviation / mean, 0.3, 0.006);  // cut at 3 standard deviations
  EXPECT_NEAR(mean, std::sqrt(1.09), 0.005);
  EXPECT_NEAR(normal.at(0.0) * normal.at(1.0), 1.0, 1e-12);
}

TEST(DisturbedWire, HasItsOwnPartOfEachSpread) {
  Study study;
  study.wires = {{.name = "wire",
                  .radius = 0.4,
                  .sections = {{.length = 10.0, .bending_stiffness = 5.0},
                               {.length = 20.0,
                                .bending_stiffness = 5.0,
                                .proximal_bending_stiffness = 300.0,
                                .taper = simulate::Taper::kCone},
                               {.length = 60.0, .bending_stiffness = 300.0}},
                  .friction = 0.12}};
  study.insertion.friction = 0.5;
  Disturbance d{.friction = 1.0, .stiffness = {0.0}};
  EXPECT_EQ(disturbed_wire(study, 0, d).friction, 0.12) << "its values are known";
  const FactorSpread tip{.low = 0.5, .high = 3.0}, shaft{.low = 0.9, .high = 1.1};
  study.spreads = {{.friction = {.low = 0.5, .high = 2.0},
                    .stiffness = {{tip, tip}, {tip, shaft}, {shaft, shaft}}}};
  const simulate::Wire soft = disturbed_wire(study, 0, d);
  EXPECT_DOUBLE_EQ(soft.friction.value(), 0.24);
  EXPECT_DOUBLE_EQ(soft.sections[0].bending_stiffness, 2.5);
  EXPECT_FALSE(soft.sections[0].tapered());
  EXPECT_DOUBLE_EQ(soft.sections[1].bending_stiffness, 2.5);
  EXPECT_DOUBLE_EQ(soft.sections[1].proximal_EI(), 270.0);
  EXPECT_DOUBLE_EQ(soft.sections[2].bending_stiffness, 270.0);
  d.stiffness = {1.0};
  EXPECT_DOUBLE_EQ(disturbed_wire(study, 0, d).sections[2].bending_stiffness, 330.0);
  study.wires[0].friction.reset();
  EXPECT_DOUBLE_EQ(disturbed_wire(study, 0, d).friction.value(), 1.0) << "twice the insertion's";
}

// ---- disturbed trials -------------------------------------------------------------------------

TEST(RunDisturbed, PushesTheWireThatIsDisturbed) {
  TubeStudy tube;
  const simulate::VesselModel vessel = tube.vessel(0.056);
  tube.study.spreads = {{.friction = {.low = 0.25, .high = 4.0},
                         .stiffness = {{{{.low = 0.5, .high = 2.0}, {.low = 0.5, .high = 2.0}}}}}};
  const auto last = [&](const Disturbance& d) {
    const simulate::TrialResult trial = run_disturbed(tube.study, tube.candidate, vessel, d);
    EXPECT_FALSE(trial.pushes.empty()) << trial.reason;
    return trial.pushes.back();
  };
  const simulate::Push mean = last({}), rough = last({.friction = 1.0}),
                       smooth = last({.friction = 0.0}), stiff = last({.stiffness = {1.0}});
  EXPECT_GT(rough.friction_force, 1.5 * mean.friction_force);
  EXPECT_LT(smooth.friction_force, 0.6 * mean.friction_force);
  EXPECT_GT(stiff.total_contact_force, 1.3 * mean.total_contact_force);

  // As a study of that very wire.
  Study same = tube.study;
  same.wires[0] = disturbed_wire(tube.study, 0, {.friction = 1.0, .stiffness = {1.0}});
  same.spreads.clear();
  const simulate::TrialResult own = run_disturbed(same, tube.candidate, vessel, {});
  EXPECT_EQ(own.pushes.back().push_force, last({.friction = 1.0, .stiffness = {1.0}}).push_force);
}

TEST(RunDisturbed, IsTheTrialItselfWithoutADisturbance) {
  const TubeStudy tube;
  const simulate::VesselModel vessel = tube.vessel(0.056);
  Study as_repeats = tube.study;
  as_repeats.insertion.residual_tolerance *= kRepeatTolerance;
  const simulate::TrialResult plain = run_candidate(as_repeats, tube.candidate, vessel);
  const simulate::TrialResult same = run_disturbed(tube.study, tube.candidate, vessel, {});
  EXPECT_EQ(same.outcome, plain.outcome);
  EXPECT_EQ(same.nodes, plain.nodes);
  ASSERT_FALSE(plain.pushes.empty());
  EXPECT_GT(plain.pushes.back().peak_contact_force, 1e-3);
  EXPECT_EQ(same.pushes.back().peak_contact_force, plain.pushes.back().peak_contact_force);
}

TEST(RunDisturbed, AWallFactorIsAWallOfThatStiffness) {
  const TubeStudy tube;
  for (const double factor : {0.5, 2.0}) {
    SCOPED_TRACE(factor);
    const simulate::TrialResult direct =
        run_candidate(tube.study, tube.candidate, tube.vessel(0.056 * factor));
    Disturbance disturbance;
    disturbance.wall_factor = factor;
    const simulate::TrialResult scaled =
        run_disturbed(tube.study, tube.candidate, tube.vessel(0.056), disturbance);
    ASSERT_EQ(scaled.pushes.size(), direct.pushes.size());
    const Metrics a = compute_push_metrics(scaled.pushes), b = compute_push_metrics(direct.pushes);
    // They differ by the contact law, which gives way by 2 % of what the wall does.
    EXPECT_NEAR(a.peak_contact_force, b.peak_contact_force, 0.03 * b.peak_contact_force);
    EXPECT_NEAR(a.mean_contact_force, b.mean_contact_force, 0.03 * b.mean_contact_force);
    EXPECT_NEAR(a.peak_wall_displacement, b.peak_wall_displacement,
                0.03 * b.peak_wall_displacement);
    EXPECT_NEAR(a.push_work, b.push_work, 0.05 * std::abs(b.push_work));
    EXPECT_LT((scaled.nodes - direct.nodes).colwise().norm().maxCoeff(), 0.05);  // mm
  }
}

TEST(RunDisturbed, AWallFactorIsAWallOfThatStiffnessUnderCatheterAndWire) {
  TubeStudy tube;
  tube.study.catheters.push_back(
      {.tool = {.wire = {.name = "catheter",
                         .radius = 0.8,
                         .sections = {{.length = 200.0, .bending_stiffness = 300.0}}},
                .inner_radius = 0.5},
       .spread = {}});
  tube.candidate.catheter = 0;
  tube.candidate.steps = {{.tool = 1, .push = 25.0}, {.tool = 0, .push = 20.0}};
  const simulate::TrialResult direct =
      run_candidate(tube.study, tube.candidate, tube.vessel(0.056 * 2.0));
  Disturbance disturbance;
  disturbance.wall_factor = 2.0;
  const simulate::TrialResult scaled =
      run_disturbed(tube.study, tube.candidate, tube.vessel(0.056), disturbance);
  ASSERT_EQ(scaled.tools.size(), 2U);
  ASSERT_EQ(scaled.pushes.size(), direct.pushes.size());
  EXPECT_GT(direct.pushes.back().total_contact_force, 0.01);
  EXPECT_GT(direct.pushes.back().wall_displacement, 0.01);
  EXPECT_NEAR(scaled.pushes.back().total_contact_force, direct.pushes.back().total_contact_force,
              0.03 * direct.pushes.back().total_contact_force);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(scaled.tools[k].wall_force.back(), direct.tools[k].wall_force.back(),
                0.03 * direct.pushes.back().total_contact_force);
    EXPECT_NEAR(scaled.tools[k].push_force.back(), direct.tools[k].push_force.back(),
                0.03 * direct.pushes.back().total_contact_force);
  }
  EXPECT_LT((scaled.nodes - direct.nodes).colwise().norm().maxCoeff(), 0.05);  // mm
}

TEST(RunDisturbed, AnInwardWallIsANarrowerTube) {
  // Rigid, so that the curvature of the wall does not matter; its facets are off by 0.03 mm.
  const TubeStudy tube;
  const simulate::VesselModel wide(shapes::straight_tube(4.0, 50.0, 1.0));
  const simulate::VesselModel narrow(shapes::straight_tube(3.7, 50.0, 1.0));
  Disturbance disturbance;
  disturbance.inward = 0.3;
  const auto tip = [](const simulate::TrialResult& trial) -> Vec3 {
    return trial.nodes.rightCols<1>();
  };
  const Vec3 offset = tip(run_disturbed(tube.study, tube.candidate, wide, disturbance));
  const Vec3 direct = tip(run_candidate(tube.study, tube.candidate, narrow));
  const Vec3 wider = tip(run_candidate(tube.study, tube.candidate, wide));
  EXPECT_GT((offset - wider).norm(), 0.25);
  EXPECT_LT((offset - direct).norm(), 0.06);
}

TEST(RunDisturbed, TiltAndShiftAreThoseOfTheIntroducer) {
  TubeStudy tube;
  const simulate::VesselModel vessel = tube.vessel(0.056);
  Disturbance disturbance;
  disturbance.tilt = Eigen::Vector2d(0.0, 5.0 * kRadPerDeg);
  disturbance.shift = Eigen::Vector2d(0.5, 0.0);
  // By hand: from the axis, a tilt toward azimuth 90 deg is an inclination of 5 deg there, and
  // azimuth 0 is anterior.
  tube.candidate.inclination = 0.0;
  const simulate::TrialResult disturbed =
      run_disturbed(tube.study, tube.candidate, vessel, disturbance);
  tube.study.access += Vec3(0.0, -0.5, 0.0);
  const simulate::TrialResult direct = run_candidate(
      tube.study, {.wire = 0, .inclination = 5.0 * kRadPerDeg, .azimuth = 0.5 * kPi}, vessel);
  ASSERT_EQ(disturbed.nodes.cols(), direct.nodes.cols());
  EXPECT_LT((disturbed.nodes - direct.nodes).colwise().norm().maxCoeff(), 1e-6);  // rounding
}

TEST(RunDisturbed, AThrowFailsTheRepeatAlone) {
  const TubeStudy tube;
  Disturbance disturbance;
  disturbance.inward = -1.0;  // more than the wire's radius
  const simulate::TrialResult trial =
      run_disturbed(tube.study, tube.candidate, simulate::VesselModel(tube.surface), disturbance);
  EXPECT_EQ(trial.outcome, Outcome::kFailed);
  EXPECT_LT(largest_lumen_offset(tube.study), tube.study.wires[0].radius);
  EXPECT_NEAR(largest_entry_shift(tube.study, tube.vessel(0.056)), 2.0, 0.1);
}

// ---- what is made of repeats ------------------------------------------------------------------

Metrics reached(double peak_force) {
  Metrics metrics;
  metrics.reached = true;
  metrics.tip_to_target = 1.0;
  metrics.peak_contact_force = peak_force;
  metrics.mean_contact_force = metrics.peak_tip_force = 0.1;
  return metrics;
}

TEST(JudgeRepeat, AFailureCostsOneAndSaysWhy) {
  Study study;
  const auto judged = [&](const Metrics& metrics) {
    return judge_repeat({.outcome = Outcome::kReached, .metrics = metrics}, study, {}, {});
  };
  const Repeat good = judged(reached(0.3));
  EXPECT_TRUE(good.safe);
  EXPECT_EQ(good.score, compute_score(reached(0.3), study.goal, {}, {}).total);
  Metrics hard = reached(0.3);
  hard.peak_tip_force = 2.0;
  const Repeat broken = judged(hard);
  EXPECT_FALSE(broken.safe);
  EXPECT_EQ(broken.score, 1.0);
  EXPECT_NE(broken.reason.find("over the limit"), std::string::npos);
  EXPECT_EQ(broken.peak_tip_force, 2.0);
}

/// Plans whose nominal scores differ clearly.
struct Plans {
  Study study;
  std::vector<Candidate> candidates;
  std::vector<Measured> trials;
  Findings findings;

  explicit Plans(const std::vector<double>& forces) {
    study.wires.resize(2);
    for (const double force : forces) {
      candidates.push_back({.wire = 0});
      trials.push_back({.outcome = Outcome::kReached, .metrics = reached(force)});
      findings.errors.push_back(NumericalError{});  // exact
    }
  }
  void repeat(int trial, const std::vector<double>& scores) {
    RepeatedPlan& plan = findings.repeated.emplace_back();
    plan.trial = trial;
    for (const double score : scores) {
      Repeat& repeat = plan.repeats.emplace_back();
      repeat.safe = score < 1.0;
      repeat.score = score;
    }
  }
  Ranking ranked() const { return rank(study, candidates, trials, {}, {}, findings); }
};

TEST(Rank, PlansThatStaySafeUnderDisturbancesComeFirst) {
  Plans plans({0.1, 0.2, 0.3});
  plans.repeat(0, {0.2, 1.0, 1.0, 0.2});
  plans.repeat(1, {0.3, 0.3, 0.3, 0.3});
  const Ranking ranking = plans.ranked();
  ASSERT_EQ(ranking.plans.size(), 3u);
  const RankedPlan &first = ranking.plans[0], &second = ranking.plans[1], &last = ranking.plans[2];
  EXPECT_EQ(first.trial, 1);
  EXPECT_DOUBLE_EQ(first.robust_score.value(), 0.3);
  EXPECT_EQ(first.expected_score, first.robust_score);
  EXPECT_EQ(last.trial, 0);
  EXPECT_DOUBLE_EQ(last.robust_score.value(), 0.6);
  EXPECT_NE(last.sentence.find("safe in 2 of 4 perturbed repeats"), std::string::npos)
      << last.sentence;
  EXPECT_NE(last.sentence.find("behind it because it is safe less often"), std::string::npos)
      << last.sentence;
  EXPECT_DOUBLE_EQ(last.expected_safe, 0.5);
  EXPECT_DOUBLE_EQ(second.expected_safe, 0.75) << "the median of 1 and 0.5";
  // Not repeated: by what disturbances add to the others, in the median.
  EXPECT_EQ(second.trial, 2);
  EXPECT_FALSE(second.robust_score);
  EXPECT_NEAR(second.expected_score - second.score.total,
              0.5 * (0.3 - first.score.total + 0.6 - last.score.total), 1e-12);
}

TEST(Rank, APlanThatIsSafeMoreOftenComesBeforeABetterScoreThatIsNot) {
  // Mean scores of 0.29 and 0.5: as these stand, 0 would be first.
  Plans plans({0.1, 0.9, 0.2});
  plans.repeat(0, {0.05, 0.05, 0.05, 1.0});
  plans.repeat(1, {0.5, 0.5, 0.5, 0.5});
  plans.repeat(2, {0.4, 0.4, 0.4, 0.4});
  const Ranking ranking = plans.ranked();
  ASSERT_EQ(ranking.plans.size(), 3u);
  EXPECT_EQ(ranking.plans[0].trial, 2) << "of equal shares the smaller mean score";
  EXPECT_EQ(ranking.plans[1].trial, 1);
  EXPECT_EQ(ranking.plans[2].trial, 0);
  EXPECT_LT(*ranking.plans[2].robust_score, *ranking.plans[1].robust_score);
}

TEST(Rank, PairedDifferencesTellPlansApartThatSpreadMoreThanTheyDiffer) {
  // Both move by 0.5 with the unknowns, but always together: 1 is always a little worse.
  Plans plans({0.1, 0.2});
  plans.repeat(0, {0.2, 0.4, 0.6, 0.7});
  plans.repeat(1, {0.21, 0.41, 0.61, 0.71});
  EXPECT_TRUE(plans.ranked().plans[0].tied_with.empty());
}

TEST(Rank, PlansWhoseOrderTheUnknownsDecideAreTied) {
  // Better by far as assumed, but worse in half of the repeats.
  Plans plans({0.1, 0.9});
  plans.repeat(0, {0.2, 0.2, 0.5, 0.5});
  plans.repeat(1, {0.4, 0.4, 0.4, 0.4});
  const Ranking ranking = plans.ranked();
  EXPECT_EQ(ranking.plans[0].tied_with, std::vector<int>{1});
  EXPECT_EQ(ranking.plans[1].tied_with, std::vector<int>{0});
}

TEST(Rank, APlanWithFewerRepeatsGetsWhatTheFurtherOnesTypicallyAdd) {
  // Further repeats add 0.05 and 0.15 to the plans that have them. So 2 comes behind 1, though its
  // mean over the first two is smaller.
  Plans plans({0.1, 0.2, 0.3});
  plans.repeat(0, {0.1, 0.3, 0.3, 0.3});
  plans.repeat(1, {0.1, 0.3, 0.5, 0.5});
  plans.repeat(2, {0.28, 0.28});
  const Ranking ranking = plans.ranked();
  ASSERT_EQ(ranking.plans.size(), 3u);
  EXPECT_EQ(ranking.plans[0].trial, 0);
  EXPECT_EQ(ranking.plans[1].trial, 1);
  EXPECT_EQ(ranking.plans[2].trial, 2);
  EXPECT_DOUBLE_EQ(ranking.plans[0].expected_score, 0.25);
  EXPECT_DOUBLE_EQ(ranking.plans[2].robust_score.value(), 0.28);
  EXPECT_NEAR(ranking.plans[2].expected_score, 0.28 + 0.1, 1e-12);
  // Pairs are compared over the repeats that both have: 2 is worse in one of two, better in one.
  EXPECT_EQ(ranking.plans[2].tied_with, (std::vector<int>{0, 1}));
  EXPECT_NE(ranking.plans[2].sentence.find("safe in 2 of 2"), std::string::npos);
}

TEST(Rank, APlanWithoutRepeatsMayMoveAsFarAsThoseWithThem) {
  // Scores without error. Disturbances move 1 against 0 by more than 2, which has no repeats, is
  // behind 1, and by less than it is behind 0.
  Plans plans({0.1, 0.2, 0.35, 0.6});
  const Ranking before = plans.ranked();
  for (const RankedPlan& plan : before.plans) EXPECT_TRUE(plan.tied_with.empty());
  const auto score = [&](std::size_t place) { return before.plans[place].score.total; };
  const double moves = 0.5 * (score(2) - score(1) + score(2) - score(0));
  plans.repeat(0, std::vector<double>(4, score(0)));
  plans.repeat(1, std::vector<double>(4, score(1) + moves));
  const Ranking ranking = plans.ranked();
  ASSERT_EQ(ranking.plans.size(), 4u);
  EXPECT_EQ(ranking.plans[0].trial, 0);
  EXPECT_TRUE(ranking.plans[0].tied_with.empty());
  EXPECT_EQ(ranking.plans[1].trial, 1);
  EXPECT_EQ(ranking.plans[1].tied_with, std::vector<int>{2});
  EXPECT_EQ(ranking.plans[2].tied_with, (std::vector<int>{1, 3}));
}

TEST(ChoosePlansToRepeat, TakesTheFirstAndTheBestOfEachWireOnce) {
  Plans plans({0.1, 0.2, 0.3, 0.4});
  plans.candidates[3].wire = 1;
  const auto choose_of_two = [&](int count) {
    return choose_plans_to_repeat(plans.ranked(), plans.candidates, plans.findings.repeated, 2,
                                  count);
  };
  EXPECT_EQ(choose_of_two(1), (std::vector<int>{0, 1, 3}));
  plans.repeat(0, {1.0});
  plans.repeat(1, {0.3});
  plans.repeat(3, {0.5});
  // 0 fell behind, and 3 behind what is expected of 2.
  EXPECT_EQ(choose_of_two(1), std::vector<int>{2});
  plans.repeat(2, {0.6});
  EXPECT_TRUE(choose_of_two(1).empty());
  // More of those that are the best now.
  EXPECT_EQ(choose_of_two(2), (std::vector<int>{1, 3}));
}

TEST(ChoosePlansToRepeat, TakesTheBestOfEachCatheterToo) {
  Plans plans({0.1, 0.2, 0.3, 0.4, 0.5, 0.6});
  for (const int k : {0, 1, 2}) plans.candidates[static_cast<std::size_t>(k)].catheter = 1;
  for (const int k : {3, 4}) plans.candidates[static_cast<std::size_t>(k)].catheter = 0;
  const auto choose_of_one = [&] {
    return choose_plans_to_repeat(plans.ranked(), plans.candidates, plans.findings.repeated, 1, 1);
  };
  EXPECT_EQ(choose_of_one(), (std::vector<int>{0, 3}));
  const Ranking before = plans.ranked();
  plans.repeat(0, {before.plans[0].score.total});
  EXPECT_EQ(choose_of_one(), std::vector<int>{3});
  plans.repeat(3, {before.plans[3].score.total});
  EXPECT_TRUE(choose_of_one().empty());
}

}  // namespace
}  // namespace wireplan::plan
