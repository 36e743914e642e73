#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "plan/ranking.h"

namespace wireplan::plan {
namespace {

using simulate::Outcome;

/// Trials made by hand: only what ranking reads.
struct Bench {
  Study study;
  std::vector<Candidate> candidates;
  std::vector<Measured> trials;
  std::vector<std::optional<NumericalError>> errors;
  Limits limits;
  Weights weights;

  explicit Bench(int wires = 2) {
    for (int k = 0; k < wires; ++k) {
      simulate::Wire wire;
      wire.name = "wire-" + std::to_string(k);
      study.wires.push_back(wire);
    }
    study.goal.radius = 4.0;
  }

  Metrics& add(int wire, double tip_to_target, double peak_force,
               Outcome outcome = Outcome::kReached) {
    candidates.push_back({.wire = wire});
    Metrics& m = trials.emplace_back(Measured{.outcome = outcome}).metrics;
    m.reached = outcome == Outcome::kReached;
    m.insertion = 120.0;
    m.tip_to_target = tip_to_target;
    m.peak_contact_force = peak_force;
    return m;
  }

  Ranking ranked() const {
    return rank(study, candidates, trials, limits, weights, {.errors = errors});
  }
};

std::vector<int> order_of(const Ranking& ranking) {
  std::vector<int> order;
  for (const RankedPlan& plan : ranking.plans) order.push_back(plan.trial);
  return order;
}

TEST(Score, FollowsItsFormulas) {
  Metrics m;
  m.tip_to_target = 1.0;
  m.peak_contact_force = 0.1;
  m.mean_contact_force = 0.3;
  m.peak_tip_force = 0.3;
  const Score score = compute_score(m, {.radius = 4.0}, Limits{}, Weights{});
  EXPECT_DOUBLE_EQ(score.reach, 0.25);
  EXPECT_DOUBLE_EQ(score.peak_force, 0.25);  // 0.1 / (0.1 + 0.3)
  EXPECT_DOUBLE_EQ(score.mean_force, 0.5);   // at the scale
  EXPECT_DOUBLE_EQ(score.margin, 0.2);       // 0.3 of 1.5 N used up
  EXPECT_DOUBLE_EQ(score.total, (0.25 + 0.25 + 0.5 * 0.5 + 0.5 * 0.2) / 3.0);
}

TEST(Score, StaysWithinZeroAndOneForAnyMetrics) {
  std::mt19937_64 generator(7);
  const auto magnitude = [&] { return std::pow(10.0, double(generator() % 1000) / 100.0 - 5.0); };
  for (int k = 0; k < 200; ++k) {
    Metrics m;
    m.tip_to_target = magnitude();
    m.peak_contact_force = magnitude();
    m.mean_contact_force = magnitude();
    m.peak_tip_force = magnitude();
    const Score score = compute_score(m, {.radius = 4.0}, Limits{}, Weights{});
    for (const double c :
         {score.total, score.reach, score.peak_force, score.mean_force, score.margin}) {
      EXPECT_GE(c, 0.0);
      EXPECT_LE(c, 1.0);
    }
  }
}

TEST(Score, ErrorIsTheFirstOrderChangeOfTheScore) {
  Metrics m;
  m.tip_to_target = 1.0;
  m.peak_contact_force = 0.5;
  m.mean_contact_force = 1.5;
  m.peak_tip_force = 0.3;
  const NumericalError error{
      .tip = 1e-5, .peak_force = 2e-5, .mean_force = 3e-5, .tip_force = 4e-5};
  Metrics worse = m;
  worse.tip_to_target += error.tip;
  worse.peak_contact_force += error.peak_force;
  worse.mean_contact_force += error.mean_force;
  worse.peak_tip_force += error.tip_force;
  const simulate::Goal goal{.radius = 4.0};
  const double change = compute_score(worse, goal, Limits{}, Weights{}).total -
                        compute_score(m, goal, Limits{}, Weights{}).total;
  ASSERT_GT(change, 1e-6);
  // The next order is a share of about (2e-5 N) / (0.3 N) of it.
  EXPECT_NEAR(compute_score_error(m, error, goal, Limits{}, Weights{}), change, 1e-4 * change);
}

Metrics seated(double support) {
  Metrics m;
  m.tip_to_target = 1.0;
  m.peak_contact_force = 0.1;
  m.mean_contact_force = 0.3;
  m.peak_tip_force = 0.3;
  m.script = ScriptMetrics{.support = support,
                           .hook_depth = 15.0,
                           .wire_beyond = 10.0,
                           .hand_force = 3.0,
                           .hub_torque = 5.0,
                           .moves = 30,
                           .exchanges = 1};
  return m;
}

TEST(Score, OfAScriptHasWhatTheHandDoesAndGets) {
  const Score score = compute_score(seated(0.3), {.radius = 4.0}, Limits{}, Weights{});
  EXPECT_DOUBLE_EQ(score.support, 0.25);                     // 0.1 / (0.1 + 0.3)
  EXPECT_DOUBLE_EQ(score.hook, 0.25);                        // 5 / (5 + 15)
  EXPECT_DOUBLE_EQ(score.wire_beyond, 0.75);                 // 30 / (30 + 10)
  EXPECT_DOUBLE_EQ(score.hand_force, 0.75);                  // 3 / (3 + 1)
  EXPECT_DOUBLE_EQ(score.hub_torque, 0.5);                   // 5 / (5 + 5)
  EXPECT_DOUBLE_EQ(score.exchanges, 0.5);                    // 1 / (1 + 1)
  EXPECT_DOUBLE_EQ(score.moves, 0.75);                       // 30 / (30 + 10)
  const double alone = 0.25 + 0.25 + 0.5 * 0.5 + 0.5 * 0.2;  // of the wire, by the weights
  EXPECT_DOUBLE_EQ(score.total,
                   (alone + 0.25 * 0.25 + 0.1 * (0.25 + 0.75 + 0.75 + 0.5 + 0.75 + 0.5)) / 3.85);
}

TEST(Score, ErrorOfTheSupportIsTheFirstOrderChangeOfTheScore) {
  const NumericalError error{.support = 1e-5};
  const simulate::Goal goal{.radius = 4.0};
  const Metrics m = seated(0.3), weaker = seated(0.3 - error.support);
  const double change = compute_score(weaker, goal, Limits{}, Weights{}).total -
                        compute_score(m, goal, Limits{}, Weights{}).total;
  ASSERT_GT(change, 1e-7);
  EXPECT_NEAR(compute_score_error(m, error, goal, Limits{}, Weights{}), change, 1e-4 * change);
}

TEST(Rank, TellsWhatTheSeatedCatheterBearsAndThatAPlanStandsBehindByIt) {
  Bench bench(1);
  bench.study.catheters.resize(1);
  bench.add(0, 1.0, 0.1) = seated(0.2);
  bench.add(0, 1.0, 0.1) = seated(2.0);
  for (Candidate& candidate : bench.candidates) candidate.catheter = 0;
  for (Measured& trial : bench.trials) trial.metrics.reached = true;
  bench.trials[1].metrics.script->bears_more = true;
  const Ranking ranking = bench.ranked();
  ASSERT_EQ(order_of(ranking), (std::vector<int>{1, 0}));
  EXPECT_NE(ranking.plans[0].sentence.find("its catheter ends 15.0 mm in the branch and bears a "
                                           "push of more than 2.0 N before it backs out"),
            std::string::npos)
      << ranking.plans[0].sentence;
  EXPECT_NE(ranking.plans[1].sentence.find("bears a push of 0.20 N before"), std::string::npos);
  EXPECT_NE(ranking.plans[1].sentence.find("behind it mostly by its catheter's support"),
            std::string::npos)
      << ranking.plans[1].sentence;
  bench.weights = {.reach = 0.0, .peak_force = 0.0, .mean_force = 0.0, .margin = 0.0};
  EXPECT_EQ(order_of(bench.ranked()), (std::vector<int>{1, 0})) << "by the others alone";
  bench.trials[0].metrics.script->hook_depth = 0.0;
  EXPECT_NE(bench.ranked().plans[1].sentence.find("stays before the ostium and bears no push"),
            std::string::npos);
}

TEST(Rank, OrdersByScoreAndThenByCandidate) {
  Bench bench;
  bench.add(0, 2.0, 0.4);
  bench.add(0, 1.0, 0.2);
  bench.add(1, 2.0, 0.4);
  bench.add(1, 1.0, 0.1);
  EXPECT_EQ(order_of(bench.ranked()), (std::vector<int>{3, 1, 0, 2}));
}

TEST(Rank, TheScoreOfAPlanDoesNotDependOnTheOthers) {
  Bench alone, crowd;
  alone.add(0, 2.0, 0.4);
  crowd.add(0, 2.0, 0.4);
  crowd.add(1, 0.1, 0.01);
  crowd.add(1, 3.9, 9.0);
  const Ranking ranking = crowd.ranked();
  const auto same = std::find_if(ranking.plans.begin(), ranking.plans.end(),
                                 [](const RankedPlan& plan) { return plan.trial == 0; });
  ASSERT_NE(same, ranking.plans.end());
  EXPECT_EQ(same->score.total, alone.ranked().plans.front().score.total);
}

TEST(Rank, FollowsTheWeights) {
  Bench bench;
  bench.add(0, 0.5, 0.8);  // near and hard
  bench.add(1, 3.0, 0.1);  // far and soft
  bench.weights = {.reach = 1.0, .peak_force = 0.0, .mean_force = 0.0, .margin = 0.0};
  EXPECT_EQ(order_of(bench.ranked()), (std::vector<int>{0, 1}));
  bench.weights = {.reach = 0.0, .peak_force = 2.0, .mean_force = 0.0, .margin = 0.0};
  EXPECT_EQ(order_of(bench.ranked()), (std::vector<int>{1, 0}));
  bench.weights = {.reach = 0.0, .peak_force = 0.0, .mean_force = 0.0, .margin = 0.0};
  EXPECT_THROW(bench.ranked(), LogicError);
}

TEST(Rank, ExcludesEveryTrialThatIsNoPlanWithItsReason) {
  Bench bench;
  bench.add(0, 12.34, 0.2, Outcome::kMissed).nearest_to_target = 5.0;  // it passed the goal
  bench.add(0, 50.0, 0.2, Outcome::kStuck);
  bench.add(0, 60.0, 0.2, Outcome::kLeftLumen);
  bench.add(0, 61.0, 0.2, Outcome::kProlapsed);
  bench.trials.back().reason = "it folded back at (1, 2, 3) mm";
  bench.add(0, 62.0, 0.2, Outcome::kLeftImage);
  bench.trials.back().reason = "the wire left the vessel through the opening at (1, 2, 3) mm";
  bench.add(0, 70.0, 0.2, Outcome::kNotConverged);
  bench.trials.back().reason = "no equilibrium after 200 iterations";
  bench.add(0, 80.0, 0.0, Outcome::kFailed);
  bench.trials.back().reason = "internal error: out of paper";
  bench.add(0, 1.0, 0.2).peak_tip_force = 1.9;
  bench.add(0, 1.0, 0.2).max_penetration = 0.42;
  bench.add(0, 1.0, 0.2).off_path = 44.26;
  bench.add(1, 1.0, 0.2);  // the only plan

  const Ranking ranking = bench.ranked();
  EXPECT_EQ(order_of(ranking), std::vector<int>{10});
  const std::vector<std::string> reasons = {
      "missed: tip ended 12.3 mm from the target and came no nearer than 5.0 mm, expected within "
      "4 mm",
      "stuck at 120.0 mm of wire, tip 50.0 mm from the target",
      "left the lumen at 120.0 mm of wire, tip 60.0 mm from the target",
      "folded back at 120.0 mm of wire, tip 61.0 mm from the target: it folded back at (1, 2, 3) "
      "mm",
      "left the imaged vessel at 120.0 mm of wire, tip 62.0 mm from the target: "
      "the wire left the vessel through the opening at (1, 2, 3) mm",
      "did not converge at 120.0 mm of wire, tip 70.0 mm from the target: "
      "no equilibrium after 200 iterations",
      "internal error: out of paper",
      "tip force 1.9 N over the limit of 1.5 N",
      "left the lumen: wire 0.42 mm past the wall, over the limit of 0.3 mm",
      "came another way: wire 44.3 mm outside the lumen of the path, over the limit of 10 mm"};
  ASSERT_EQ(ranking.excluded.size(), reasons.size());
  for (std::size_t k = 0; k < reasons.size(); ++k) {
    EXPECT_EQ(ranking.excluded[k].trial, static_cast<int>(k));
    EXPECT_EQ(ranking.excluded[k].reason, reasons[k]);
  }
}

TEST(Rank, RanksAWallBeyondLinearTheoryWithAWarning) {
  Bench bench(1);
  bench.add(0, 1.0, 0.2).wall_motion = {1.23, 4.5, Vec3(1.0, -2.0, 30.04)};
  bench.add(0, 1.0, 0.3).wall_motion = {0.85, 4.5, Vec3::Zero()};  // 0.19 of the radius
  const Ranking ranking = bench.ranked();
  ASSERT_EQ(ranking.plans.size(), 2u);
  EXPECT_EQ(ranking.plans[0].sentence,
            "reaches the target 1.0 mm from its centre with at most 0.20 N on the wall; warning: "
            "the wall moved 1.2 mm at (1.0, -2.0, 30.0) mm where the vessel's radius is 4.5 mm, "
            "beyond linear theory (0.20 of it)");
  EXPECT_EQ(ranking.plans[1].sentence.find("linear theory"), std::string::npos);
}

TEST(Rank, NamesBothLimitsWhereBothAreBroken) {
  Bench bench;
  Metrics& m = bench.add(0, 1.0, 0.2);
  m.peak_tip_force = 1.501;
  m.max_penetration = 0.42;
  ASSERT_EQ(bench.ranked().excluded.size(), 1u);
  EXPECT_EQ(bench.ranked().excluded.front().reason,
            "tip force 1.501 N over the limit of 1.5 N; left the lumen: wire 0.42 mm past the "
            "wall, over the limit of 0.3 mm");
}

TEST(Rank, RanksATipForceOverTheWarningLevelWithAWarning) {
  Bench bench(1);
  bench.add(0, 1.0, 0.2).peak_tip_force = 0.42;
  const Ranking ranking = bench.ranked();
  ASSERT_EQ(ranking.plans.size(), 1u);
  EXPECT_EQ(ranking.plans.front().sentence,
            "reaches the target 1.0 mm from its centre with at most 0.20 N on the wall; warning: "
            "tip force 0.42 N over the warning level of 0.3 N");
}

TEST(Rank, RanksATipThatItsErrorMayPutOutsideTheTargetWithAWarning) {
  // The target's radius is 4 mm. The third was not refined.
  Bench bench(1);
  for (const double force : {0.1, 0.2, 0.3}) bench.add(0, 1.0, force);
  bench.errors = {NumericalError{.tip = 2.9}, NumericalError{.tip = 3.1}, std::nullopt};
  const Ranking ranking = bench.ranked();
  ASSERT_EQ(ranking.plans.size(), 3u);
  for (const RankedPlan& plan : ranking.plans) {
    EXPECT_EQ(plan.sentence.find("; warning: the tip's numerical error of 3.1 mm may put it "
                                 "outside the target (radius 4.0 mm)") != std::string::npos,
              plan.trial == 1)
        << plan.sentence;
  }
}

TEST(Rank, SaysWhyThePlansStandWhereTheyDo) {
  Bench bench;
  bench.add(0, 1.2, 0.21);
  bench.add(0, 1.3, 0.21);
  bench.add(1, 1.2, 0.323);
  bench.add(1, 3.9, 0.7);
  bench.errors.assign(4, NumericalError{});  // exact: nothing is tied
  const Ranking ranking = bench.ranked();
  ASSERT_EQ(order_of(ranking), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(ranking.plans[0].sentence,
            "reaches the target 1.2 mm from its centre with at most 0.21 N on the wall, 35 % less "
            "than the next wire (wire-1)");
  EXPECT_EQ(ranking.plans[1].sentence,
            "reaches the target 1.3 mm from its centre with at most 0.21 N on the wall, as much as "
            "the first plan; behind it mostly by its distance from the centre");
  EXPECT_EQ(ranking.plans[2].sentence,
            "reaches the target 1.2 mm from its centre with at most 0.32 N on the wall, 54 % more "
            "than the first plan; behind it mostly by its peak contact force");
  EXPECT_EQ(ranking.plans[3].sentence,
            "reaches the target 3.9 mm from its centre with at most 0.70 N on the wall, 3.3 times "
            "as much as the first plan; behind it mostly by its distance from the centre");
}

TEST(Rank, PutsSensitivePlansBehindAllOthersWithTheReason) {
  Bench bench(1);
  for (const double force : {0.1, 0.2, 0.3, 0.4}) bench.add(0, 1.0, force);
  bench.errors.assign(4, NumericalError{.tip = 2.9});  // so large that all scores are tied
  Findings findings{.errors = bench.errors};
  const std::string why = "with pushes half as long its tip ends 4.6 mm away";
  findings.sensitive = {why, "", std::nullopt, why};
  const Ranking ranking =
      rank(bench.study, bench.candidates, bench.trials, bench.limits, bench.weights, findings);
  EXPECT_EQ(order_of(ranking), (std::vector<int>{1, 2, 0, 3}));
  // What stands apart for this reason is not tied.
  EXPECT_EQ(ranking.plans[0].tied_with, std::vector<int>{2});
  EXPECT_EQ(ranking.plans[2].tied_with, std::vector<int>{3});
  for (const RankedPlan& plan : ranking.plans) {
    const bool last = plan.trial == 0 || plan.trial == 3;
    EXPECT_EQ(is_sensitive(plan), last);
    EXPECT_EQ(plan.sentence.find("; behind it because it is sensitive") != std::string::npos, last);
    EXPECT_EQ(plan.sentence.find("; sensitive: " + why) != std::string::npos, last);
  }
  // Where all are, their order is as ever.
  findings.sensitive.assign(4, why);
  EXPECT_EQ(order_of(rank(bench.study, bench.candidates, bench.trials, bench.limits, bench.weights,
                          findings)),
            (std::vector<int>{0, 1, 2, 3}));
}

TEST(Rank, PutsPlansWhoseTipMayNotBeInTheTargetBehindAllOthers) {
  for (const bool at_section : {false, true}) {
    Bench bench(1);
    bench.study.goal.at_section = at_section;
    Metrics near;
    near.tip_to_target = 1.0;
    const double room = tip_room(bench.study.goal, near);
    EXPECT_EQ(room, at_section ? 0.5 * bench.study.goal.radius : bench.study.goal.radius - 1.0);
    for (const double force : {0.1, 0.2, 0.3}) bench.add(0, 1.0, force);
    bench.errors = {NumericalError{.tip = room}, NumericalError{.tip = 0.99 * room}, std::nullopt};
    const Ranking ranking = bench.ranked();
    EXPECT_EQ(order_of(ranking), (std::vector<int>{1, 2, 0}));
    EXPECT_TRUE(ranking.plans[2].tip_unsure && ends_unsure(ranking.plans[2]));
    EXPECT_TRUE(ranking.plans[2].tied_with.empty());
    const std::string& why = ranking.plans[2].sentence;
    EXPECT_NE(why.find("; behind it because its tip may not be in the target"), std::string::npos)
        << why;
    EXPECT_NE(why.find(" mm may put it outside the target ("), std::string::npos) << why;

    // Refined, and without an error all the same, as where finer elements end elsewhere.
    Findings findings{.errors = {std::nullopt, bench.errors[1], std::nullopt},
                      .refined = {true, true, false}};
    const Ranking open =
        rank(bench.study, bench.candidates, bench.trials, bench.limits, bench.weights, findings);
    EXPECT_EQ(order_of(open), (std::vector<int>{1, 2, 0}));
    EXPECT_TRUE(open.plans[2].tip_unsure);
    EXPECT_NE(open.plans[2].sentence.find("could not be told by other elements and pushes"),
              std::string::npos);
  }
}

TEST(Rank, ComparesPlansThatDoNotTouchTheWall) {
  Bench bench;
  bench.add(0, 1.0, 0.0);
  bench.add(1, 2.0, 0.0);
  const Ranking ranking = bench.ranked();
  EXPECT_EQ(ranking.plans.front().sentence,
            "reaches the target 1.0 mm from its centre with at most 0 N on the wall, as much "
            "as the next wire (wire-1)");
}

TEST(Rank, SaysThatNoOtherWireHasAPlan) {
  Bench bench;
  bench.add(0, 1.0, 0.2);
  bench.add(1, 9.0, 0.2, Outcome::kMissed);
  EXPECT_NE(bench.ranked().plans.front().sentence.find("; no plan was found with another wire"),
            std::string::npos);
}

TEST(Rank, TiesPlansThatTheErrorsCannotTellApart) {
  Bench bench;
  bench.add(0, 1.0, 0.2);
  bench.add(0, 1.1, 0.2);  // 0.1 mm further: the score differs by 0.1 / 4 / 3
  bench.add(1, 3.0, 0.2);
  bench.errors.assign(3, NumericalError{.tip = 0.04});
  Ranking ranking = bench.ranked();
  for (const RankedPlan& plan : ranking.plans) EXPECT_TRUE(plan.tied_with.empty());

  bench.errors.assign(3, NumericalError{.tip = 0.06});
  ranking = bench.ranked();
  EXPECT_EQ(ranking.plans[0].tied_with, std::vector<int>{1});
  EXPECT_EQ(ranking.plans[1].tied_with, std::vector<int>{0});
  EXPECT_TRUE(ranking.plans[2].tied_with.empty());
  EXPECT_NE(ranking.plans[1].sentence.find("error and unknowns do not tell the two apart"),
            std::string::npos);
}

TEST(Rank, TiesPlansOfEqualScoreEvenWithoutError) {
  Bench bench;
  bench.add(0, 1.0, 0.2);
  bench.add(1, 1.0, 0.2);
  bench.errors.assign(2, NumericalError{});
  EXPECT_EQ(bench.ranked().plans[0].tied_with, std::vector<int>{1});
}

TEST(Rank, AssumesAnErrorWhereNoneIsKnownAndDoesNotReportIt) {
  Bench bench;
  bench.add(0, 1.0, 0.2);
  bench.add(0, 2.0, 0.2);
  bench.errors = {std::nullopt, NumericalError{.position = 0.01}};
  const Ranking ranking = bench.ranked();
  EXPECT_FALSE(ranking.plans[0].position_error.has_value());
  EXPECT_GT(ranking.plans[0].score_error, ranking.plans[1].score_error);
  EXPECT_EQ(ranking.plans[1].position_error, std::optional<double>(0.01));
}

TEST(Rank, RanksNoTrialThatWasScoutedOnly) {
  Bench bench;
  bench.add(0, 1.0, 0.1);
  bench.add(0, 1.0, 0.2);
  bench.add(0, 9.0, 0.2, Outcome::kMissed);
  const Ranking ranking = rank(bench.study, bench.candidates, bench.trials, bench.limits,
                               bench.weights, {.scouted = {true, false, true}});
  EXPECT_EQ(order_of(ranking), std::vector<int>{1});
  ASSERT_EQ(ranking.excluded.size(), 2u);
  // The case's own limits and weights may leave no plan, or put others first.
  const std::string& reason = ranking.excluded[0].reason;
  EXPECT_TRUE(reason.starts_with("scouted only: reaches with a score of 0.1")) << reason;
  EXPECT_TRUE(
      reason.ends_with("; by the default limits and weights, which decide what is run in "
                       "full, behind the best plan by more than scouts were found to be "
                       "off"))
      << reason;
  EXPECT_NE(ranking.excluded[1].reason.find("scouted only: missed"), std::string::npos);
  // Nor does it count for its wire: its wall was rigid.
  int trials = 0, reached = 0;
  for (const WireSummary& wire : ranking.wires) {
    trials += wire.trials;
    reached += wire.reached;
  }
  EXPECT_EQ(trials, 1);
  EXPECT_EQ(reached, 1);
}

TEST(Rank, SummarisesEachWireOverTheTrialsThatReached) {
  Bench bench(3);
  bench.add(0, 1.0, 0.4);
  bench.add(0, 1.0, 0.2);
  bench.add(0, 9.0, 5.0, Outcome::kMissed);  // not counted
  bench.add(1, 1.0, 0.3);
  bench.add(1, 1.0, 0.5);
  bench.add(1, 1.0, 0.9).peak_tip_force = 2.0;  // reached, but is no plan
  bench.add(2, 9.0, 0.1, Outcome::kStuck);
  const std::vector<WireSummary> wires = bench.ranked().wires;
  ASSERT_EQ(wires.size(), 3u);
  EXPECT_EQ(wires[0].trials, 3);
  EXPECT_EQ(wires[0].reached, 2);
  EXPECT_EQ(wires[0].best_trial, std::optional<int>(1));
  EXPECT_DOUBLE_EQ(wires[0].median_peak_force, 0.3);
  EXPECT_DOUBLE_EQ(wires[0].worst_peak_force, 0.4);
  EXPECT_EQ(wires[1].reached, 3);
  EXPECT_EQ(wires[1].best_trial, std::optional<int>(3));
  EXPECT_DOUBLE_EQ(wires[1].median_peak_force, 0.5);
  EXPECT_DOUBLE_EQ(wires[1].worst_peak_force, 0.9);
  EXPECT_EQ(wires[2].reached, 0);
  EXPECT_FALSE(wires[2].best_trial.has_value());
  EXPECT_EQ(wires[2].worst_peak_force, 0.0);
}

TEST(Rank, ParetoFrontIsWhatNoOtherPlanBeats) {
  // Against the definition, on coarse random values so that there are equals.
  std::mt19937_64 generator(11);
  Bench bench(1);
  for (int k = 0; k < 60; ++k) {
    const double distance = 0.25 * double(generator() % 16), force = 0.1 * double(generator() % 12);
    bench.add(0, distance, force, k % 7 == 0 ? Outcome::kStuck : Outcome::kReached);
  }
  std::vector<int> expected;
  for (const RankedPlan& a : bench.ranked().plans) {
    bool beaten = false;
    for (const RankedPlan& b : bench.ranked().plans) {
      const Metrics &m = bench.trials[a.trial].metrics, &n = bench.trials[b.trial].metrics;
      const bool no_worse =
          n.peak_contact_force <= m.peak_contact_force && n.tip_to_target <= m.tip_to_target;
      const bool better =
          n.peak_contact_force < m.peak_contact_force || n.tip_to_target < m.tip_to_target;
      beaten = beaten || (no_worse && better);
    }
    if (!beaten) expected.push_back(a.trial);
  }
  std::vector<int> front = bench.ranked().pareto;
  ASSERT_GT(front.size(), 1u);
  for (std::size_t k = 1; k < front.size(); ++k) {
    EXPECT_LE(bench.trials[front[k - 1]].metrics.peak_contact_force,
              bench.trials[front[k]].metrics.peak_contact_force);
  }
  std::sort(front.begin(), front.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(front, expected);
}

TEST(Rank, ParetoFrontOfACrossSectionIsOfForceAndSafeShare) {
  Bench bench(1);
  bench.study.goal.at_section = true;
  // How far a wire passes from the axis counts for nothing: 3 has the least force and is safe in 8
  // of 16, 1 has more and is safe in 12, 2 is beaten by 1, 0 is safe in all.
  bench.add(0, 3.5, 0.4);
  bench.add(0, 3.0, 0.2);
  bench.add(0, 0.1, 0.3);
  bench.add(0, 2.0, 0.1);
  const int safe[] = {16, 12, 10, 8};
  Findings findings;
  for (int k = 0; k < 4; ++k) {
    RepeatedPlan& own = findings.repeated.emplace_back();
    own.trial = k;
    for (int i = 0; i < 16; ++i) {
      Repeat& repeat = own.repeats.emplace_back();
      repeat.safe = repeat.reached = i < safe[k];
    }
  }
  const Ranking ranking =
      rank(bench.study, bench.candidates, bench.trials, bench.limits, bench.weights, findings);
  EXPECT_EQ(ranking.pareto, (std::vector<int>{3, 1, 0}));
}

TEST(Rank, IsEmptyWhereNoTrialIsAPlan) {
  Bench bench;
  bench.add(0, 9.0, 0.2, Outcome::kMissed);
  const Ranking ranking = bench.ranked();
  EXPECT_TRUE(ranking.plans.empty());
  EXPECT_TRUE(ranking.pareto.empty());
  EXPECT_EQ(ranking.excluded.size(), 1u);
}

}  // namespace
}  // namespace wireplan::plan
