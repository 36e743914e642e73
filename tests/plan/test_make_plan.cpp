// What is simulated, and in which order one thing decides the next.
#include <gtest/gtest.h>

#include <algorithm>

#include "plan/judge.h"
#include "plan/make_plan.h"
#include "tests/plan/memory_log.h"
#include "tests/plan/tube_case.h"

namespace wireplan::plan {
namespace {

using simulate::Outcome;

/// A tube with as many candidates as are asked for, of two wires.
struct Tube : TubeCase {
  explicit Tube(int rolls) {
    for (const char* name : {"soft", "stiff"}) {
      study.wires.push_back({.name = name,
                             .radius = 0.4,
                             .sections = {{.length = 60.0,
                                           .bending_stiffness = study.wires.empty() ? 20.0 : 80.0,
                                           .rest_curvature = 0.02}}});
    }
    study.inclinations = {5.0 * kRadPerDeg};
    study.azimuths = {0.0};
    for (int k = 0; k < rolls; ++k) study.rolls.push_back(0.1 * k);
  }
  Judgement judged(const Plan& plan) const { return judge(study, plan, {}, {}); }
};

/// A trial that reached, with this force at its worst contact.
Measured reached(double force) {
  Measured trial{.outcome = Outcome::kReached};
  trial.metrics.reached = true;
  trial.metrics.insertion = 30.0;
  trial.metrics.tip_to_target = trial.metrics.nearest_to_target = 1.0;
  trial.metrics.peak_contact_force = force;
  trial.nodes = Eigen::Matrix3Xd::Zero(3, 2);
  return trial;
}

Measured missed(double nearest) {
  Measured trial{.outcome = Outcome::kMissed};
  trial.metrics.insertion = 35.0;
  trial.metrics.tip_to_target = trial.metrics.nearest_to_target = nearest;
  return trial;
}

double roll_of(const plan::Run& run) { return run.candidate.roll; }

int count(const std::vector<Run>& runs, const std::function<bool(const plan::Run&)>& is_one) {
  return static_cast<int>(std::count_if(runs.begin(), runs.end(), is_one));
}

PlanOptions without_repeats() {
  PlanOptions options{.manoeuvres = Manoeuvring::kNever};
  options.robustness.repeats = 0;
  return options;
}

TEST(MakePlan, ScoutsAllAndRunsInFullWhatMayBeBest) {
  const Tube tube(20);  // 40 candidates
  KnowingLog log([](const plan::Run& run) { return reached(0.05 + 0.4 * roll_of(run)); });
  const Plan plan = tube.plan(log, without_repeats());
  ASSERT_EQ(plan.candidates.size(), 40u);
  EXPECT_EQ(count(log.asked, [](const plan::Run& run) { return run.level == Level::kScout; }), 40);
  const auto in_full = std::count(plan.levels.begin(), plan.levels.end(), Level::kFull);
  EXPECT_GE(in_full, 5);
  EXPECT_LT(in_full, 20);
  EXPECT_EQ(plan.levels[0], Level::kFull);
  EXPECT_EQ(plan.levels[19], Level::kScout);
  EXPECT_EQ(tube.judged(plan).ranking.plans.front().trial, 0);
  ASSERT_TRUE(plan.scouting);
  EXPECT_EQ(plan.scouting->trials, 40);
}

TEST(MakePlan, TellsWhatTheScoutsSayBeforeAnythingRunsInFull) {
  const Tube tube(20);
  // The gentlest breaks a limit, so it is not named; a third of them reach.
  KnowingLog log([](const plan::Run& run) {
    if (roll_of(run) > 0.65) return missed(9.0);
    Measured trial = reached(0.05 + 0.4 * roll_of(run));
    if (roll_of(run) < 0.05) trial.metrics.max_penetration = 5.0;
    return trial;
  });
  std::vector<FirstAnswer> told;
  std::size_t asked = 0;
  PlanOptions options = without_repeats();
  options.early.scouted = [&](const FirstAnswer& answer) {
    told.push_back(answer);
    asked = log.asked.size();
  };
  tube.plan(log, options);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(asked, 40u) << "before the first full run";
  EXPECT_EQ(told[0].trials, 40);
  EXPECT_EQ(told[0].reached, 14);
  ASSERT_TRUE(told[0].best);
  EXPECT_NEAR(told[0].best->roll, 0.1, 1e-12);
  EXPECT_NEAR(told[0].trial.metrics.peak_contact_force, 0.09, 1e-12);

  KnowingLog none([](const plan::Run&) { return missed(9.0); });
  tube.plan(none, options);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[1].reached, 0);
  EXPECT_FALSE(told[1].best);
  options.exhaustive = true;  // no scouts, no first answer
  tube.plan(none, options);
  EXPECT_EQ(told.size(), 2u);
}

TEST(MakePlan, ExhaustiveOrFewCandidatesHaveNoScouts) {
  for (const bool few : {false, true}) {
    const Tube tube(few ? 4 : 20);
    KnowingLog log([](const plan::Run&) { return reached(0.1); });
    PlanOptions options = without_repeats();
    options.exhaustive = !few;
    const Plan plan = tube.plan(log, options);
    EXPECT_FALSE(plan.scouting);
    EXPECT_EQ(count(log.asked, [](const plan::Run& run) { return run.level != Level::kFull; }), 0);
  }
}

TEST(MakePlan, StopsWhereItIsToldTo) {
  const Tube tube(4);
  KnowingLog log([](const plan::Run&) { return reached(0.1); });
  PlanOptions options = without_repeats();
  options.until = PlanOptions::Until::kTrials;
  EXPECT_EQ(tube.plan(log, options).trials.size(), 8u);
  EXPECT_EQ(log.asked.size(), 8u);
  EXPECT_FALSE(log.scripts);
  options.until = PlanOptions::Until::kManoeuvres;
  EXPECT_TRUE(tube.plan(log, options).refinements.empty());
  EXPECT_TRUE(log.scripts);
}

TEST(MakePlan, TriesStraightPlansBeforeItSearchesForScripts) {
  // A plan that works under disturbances: no search. None that does: one, of the failures.
  const Tube tube(4);
  const auto disturbed = [](const plan::Run& run) { return run.disturbance.has_value(); };
  PlanOptions options;
  options.until = PlanOptions::Until::kManoeuvres;
  KnowingLog steady(
      [](const plan::Run& run) { return roll_of(run) > 0.25 ? missed(9.0) : reached(0.1); });
  EXPECT_EQ(tube.plan(steady, options).scripts.starts_tried, 0);
  EXPECT_EQ(count(steady.asked, disturbed), 8) << "the first is steady";

  // The log knows the scripts, so that no search is made here; it asks for their trials.
  KnowingLog known([](const plan::Run& run) {
    return run.candidate.moves.empty() ? missed(9.0) : reached(0.1);
  });
  known.scripts = Scripts{.found = {{.wire = 1, .moves = {{.push = 10.0}, {.turn = 1.0}}}},
                          .starts = {4},
                          .starts_tried = 2};
  const Plan plan = tube.plan(known, options);
  ASSERT_EQ(plan.candidates.size(), 9u);
  EXPECT_EQ(plan.levels.back(), Level::kFull);
  EXPECT_TRUE(plan.trials.back().metrics.reached);
}

TEST(MakePlan, RepeatsTheBestAndWhatComesUpWhereTheBestFallBehind) {
  // The best as assumed fails under every disturbance.
  const Tube tube(4);
  KnowingLog log([](const plan::Run& run) {
    const bool best = run.candidate.wire == 0 && roll_of(run) == 0.0;
    return best && run.disturbance ? missed(9.0) : reached(0.05 + 0.5 * roll_of(run));
  });
  PlanOptions options = without_repeats();
  options.robustness.repeats = 4;
  options.robustness.plans = 1;
  const Plan plan = tube.plan(log, options);
  const Judgement judged = tube.judged(plan);
  EXPECT_NE(judged.ranking.plans.front().trial, 0);
  EXPECT_NE(find_repeated(judged.repeated, judged.ranking.plans.front().trial), nullptr);
  for (const RepeatedTrials& repeated : plan.repeated) EXPECT_EQ(repeated.trials.size(), 4u);
  EXPECT_EQ(plan.disturbances.size(), 4u);
}

TEST(MakePlan, RefinesTheFirstThreeAndWhatIsTiedWithTheFirst) {
  const Tube tube(4);
  KnowingLog log([](const plan::Run& run) { return reached(0.05 + 2.0 * roll_of(run)); });
  const Plan plan = tube.plan(log, without_repeats());
  std::vector<int> refined;
  for (const Refinement& refinement : plan.refinements) refined.push_back(refinement.trial);
  EXPECT_GE(refined.size(), 3u);
  EXPECT_EQ(refined.front(), tube.judged(plan).ranking.plans.front().trial);
}

/// Of a run with a setting changed the tip ends this far aside, where it is the push's length.
Measured with_end(Measured trial, const plan::Run& run, double aside) {
  const bool of_step = run.elements && run.elements->setting == Setting::kStep;
  trial.metrics.insertion = 30.0;
  trial.nodes.resize(3, 2);
  trial.nodes << 0.0, of_step ? aside : 0.0, 0.0, 0.0, 0.0, 30.0;
  return trial;
}

TEST(MakePlan, RunsPlansWithOtherSettingsAndRefinesWhatComesUpBehindSensitiveOnes) {
  // The first four by score are sensitive, the other four not.
  const Tube tube(4);  // all run in full
  KnowingLog log([](const plan::Run& run) {
    return with_end(reached(0.05 + 2.0 * roll_of(run)), run, roll_of(run) < 0.15 ? 2.0 : 0.5);
  });
  const Plan plan = tube.plan(log, without_repeats());
  const Ranking ranking = tube.judged(plan).ranking;
  ASSERT_GE(ranking.plans.size(), 4u);
  int sensitive = 0;
  for (std::size_t k = 0; k < ranking.plans.size(); ++k) {
    sensitive += is_sensitive(ranking.plans[k]);
    if (k > 0) {
      EXPECT_GE(is_sensitive(ranking.plans[k]), is_sensitive(ranking.plans[k - 1]));
    }
    if (k < 3) {
      EXPECT_EQ(ranking.plans[k].sensitive, "") << "what is first is known";
    }
  }
  EXPECT_GT(sensitive, 0);
}

TEST(MakePlan, ShowsTheClosestAttemptOfAWireWithoutAPlan) {
  const Tube tube(20);
  KnowingLog log([](const plan::Run& run) {
    return run.candidate.wire == 1 ? missed(9.0 + roll_of(run)) : reached(0.1);
  });
  const Plan plan = tube.plan(log, without_repeats());
  EXPECT_EQ(plan.attempts, std::vector<int>{20});
  EXPECT_TRUE(log.asked.back().shapes);
}

TEST(MakePlan, ALimitOrAWeightChangesTheJudgementAndNothingThatIsAskedFor) {
  const Tube tube(4);
  KnowingLog log([](const plan::Run& run) {
    Measured trial = reached(0.05 + 0.5 * roll_of(run));
    trial.metrics.peak_tip_force = 1.0;
    trial.metrics.tip_to_target = 4.0 - 10.0 * roll_of(run);  // near the goal where it presses
    return trial;
  });
  const Plan plan = tube.plan(log, without_repeats());
  const std::size_t asked = log.asked.size();
  const Weights of_force{.reach = 0.0},
      of_reach{.peak_force = 0.0, .mean_force = 0.0, .margin = 0.0};
  EXPECT_NE(judge(tube.study, plan, {}, of_force).ranking.plans.front().trial,
            judge(tube.study, plan, {}, of_reach).ranking.plans.front().trial);
  EXPECT_TRUE(judge(tube.study, plan, {.tip_force_fail = 0.5}, {}).ranking.plans.empty());
  EXPECT_EQ(log.asked.size(), asked);
}

TEST(MakePlan, GoesOnFromItsLogToTheSamePlan) {
  const Tube tube(2);
  PlanOptions options = without_repeats();
  options.robustness.repeats = 2;
  options.batch.threads = 2;
  MemoryLog log;
  const Plan first = tube.plan(log, options);
  const int runs = log.kept;
  EXPECT_GT(runs, 4 + 2 * 4);  // trials, elements, repeats
  const Plan second = tube.plan(log, options);
  EXPECT_EQ(log.kept, runs) << "all of it was known";
  EXPECT_EQ(second.full.runs + second.repeats.runs, 0);
  ASSERT_EQ(first.refinements.size(), second.refinements.size());
  ASSERT_FALSE(first.refinements.empty());
  EXPECT_EQ(first.refinements[0].error->position, second.refinements[0].error->position);

  // Stopped after every run in turn, it goes on and ends with the same.
  for (int stop = 1; stop < runs; stop += 3) {
    MemoryLog cut;
    options.batch.cancelled = [&] { return cut.kept >= stop; };
    options.batch.threads = 1;
    EXPECT_THROW(tube.plan(cut, options), Interrupted) << stop;
    options.batch.cancelled = nullptr;
    const Plan resumed = tube.plan(cut, options);
    EXPECT_EQ(cut.kept, runs);
    EXPECT_EQ(tube.judged(resumed).ranking.plans.front().score.total,
              tube.judged(first).ranking.plans.front().score.total);
  }
}

}  // namespace
}  // namespace wireplan::plan
