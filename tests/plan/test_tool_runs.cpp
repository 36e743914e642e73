// Runs of catheter and wire that begin alike share their way up, which changes none of them.
#include <gtest/gtest.h>

#include <vector>

#include "plan/judge.h"
#include "plan/make_plan.h"
#include "plan/trial_log.h"
#include "tests/plan/memory_log.h"
#include "tests/plan/two_renals.h"

namespace wireplan::plan {
namespace {

using simulate::kBothTools;

/// The aorta with its renal arteries, whose wall does not yield.
PlanVessel rigid_aorta(const Study& study) {
  const auto model = []() -> const simulate::VesselModel& { return aorta(); };
  return {.path = study.goal.way->path(), .yields = false, .model = model, .rigid_model = model};
}

PlanOptions all_repeats_for_the_first() {
  PlanOptions options;
  options.robustness.plans = 1;
  options.robustness.repeats = 16;
  return options;
}

TEST(ToolRuns, ThatBeginAlikeComeToTheSameTogetherAndAlone) {
  const Study study = toward(1.0);
  const PlanVessel vessel = rigid_aorta(study);
  RobustnessOptions robustness;
  robustness.repeats = 2;
  const std::vector<Disturbance> disturbances = draw_disturbances(robustness, study.wires);
  std::vector<plan::Run> runs;
  for (const double turn : {0.5 * kPi, 0.4 * kPi, -0.5 * kPi}) {
    Candidate script = first_candidate(study, {});
    script.steps = {{.tool = 1, .push = 90.0},           {.tool = 0, .push = 75.0},
                    {.tool = 1, .push = -40.0},          {.tool = 0, .turn = turn},
                    {.tool = kBothTools, .push = -12.0}, {.tool = 1, .push = 60.0}};
    runs.push_back({.candidate = script});
    for (const Disturbance& disturbance : disturbances) {
      runs.push_back({.candidate = script, .disturbance = disturbance});
    }
    for (const double insertion : {80.0 + turn, 85.0 - turn}) {
      runs.push_back({.candidate = script, .elements = OtherElements{1.5, insertion, {}}});
    }
  }
  std::vector<std::vector<Measured>> found;
  std::vector<int> told;
  for (const int threads : {1, 2}) {
    MemoryLog log;
    Spent spent;
    BatchOptions batch{.threads = threads};
    batch.progress = [&](int done, int count) {
      told.push_back(done);
      EXPECT_EQ(count, std::ssize(runs));
    };
    found.push_back(find_or_run(study, vessel, runs, log, batch, spent));
    EXPECT_EQ(spent.runs, std::ssize(runs));
    EXPECT_EQ(log.kept, std::ssize(runs));
  }
  ASSERT_EQ(told.size(), 2 * runs.size()) << "run by run";
  EXPECT_EQ(told[runs.size() - 1], std::ssize(runs));
  for (std::size_t k = 0; k < runs.size(); ++k) {
    SCOPED_TRACE(k);
    MemoryLog log;
    Spent spent;
    const Measured alone = find_or_run(study, vessel, {runs[k]}, log, {.threads = 1}, spent).at(0);
    for (const std::vector<Measured>& together : found) {
      EXPECT_EQ(together[k].reason, alone.reason);
      EXPECT_EQ(together[k].metrics.insertion, alone.metrics.insertion);
      EXPECT_EQ(together[k].metrics.peak_contact_force, alone.metrics.peak_contact_force);
      ASSERT_EQ(together[k].nodes.cols(), alone.nodes.cols());
      EXPECT_EQ(together[k].nodes, alone.nodes) << "bit for bit";
    }
  }
}

/// In which other elements and pushes bring all to the same end, and so many of four repeats pass
/// the branch by.
class LogOfRepeats : public MemoryLog {
 public:
  explicit LogOfRepeats(int failures) : failures_(failures) {}
  std::optional<Measured> find(const Run& run) override {
    Run plain = run;
    plain.elements.reset();
    plain.disturbance.reset();
    std::optional<Measured> end = MemoryLog::find(plain);
    if (!end || !run.disturbance) return end;
    if (repeats++ % 4 < failures_) {
      end->outcome = simulate::Outcome::kPassedBy;
      end->metrics.reached = false;
    }
    return end;
  }
  int repeats = 0;

 private:
  int failures_;
};

/// In which every other repeat of the script that is repeated first passes the branch by.
class LogOfAWeakFirst : public LogOfRepeats {
 public:
  LogOfAWeakFirst() : LogOfRepeats(0) {}
  std::optional<Measured> find(const Run& run) override {
    std::optional<Measured> end = LogOfRepeats::find(run);
    if (!end || !run.disturbance) return end;
    if (first.empty()) first = run.candidate.steps;
    if (run.candidate.steps == first && ++tried % 2 == 0) {
      end->outcome = simulate::Outcome::kPassedBy;
      end->metrics.reached = false;
    }
    return end;
  }
  std::vector<simulate::ToolStep> first;
  int tried = 0;
};

TEST(ToolRuns, MakePlanRepeatsOtherScriptsThanTheFirstByScore) {
  const Study study = toward(1.0);
  const PlanVessel vessel = rigid_aorta(study);
  const PlanOptions options = all_repeats_for_the_first();
  LogOfAWeakFirst log;
  const Plan plan = make_plan(study, vessel, options, log);
  const Ranking ranking = judge(study, plan, {}, {}).ranking;
  ASSERT_FALSE(ranking.plans.empty());
  const int best = ranking.plans.front().trial;
  EXPECT_NE(plan.candidates.at(static_cast<std::size_t>(best)).steps, log.first);
  ASSERT_GE(plan.repeated.size(), 3U);
  EXPECT_EQ(log.tried, 8) << "not as often as the one that is first in the end";
  for (const RepeatedTrials& repeated : plan.repeated) {
    const bool is_best = repeated.trial == best;
    EXPECT_LE(repeated.trials.size(), is_best ? 16U : 8U) << repeated.trial;
    EXPECT_GE(repeated.trials.size(), is_best ? 16U : 4U) << repeated.trial;
  }
}

TEST(ToolRuns, MakePlanRepeatsOthersNoFurtherThanTellsThemFromASteadyFirst) {
  const Study study = toward(1.0);
  const PlanVessel vessel = rigid_aorta(study);
  const PlanOptions options = all_repeats_for_the_first();
  LogOfRepeats log(0);
  const Plan plan = make_plan(study, vessel, options, log);
  const Judgement judgement = judge(study, plan, {}, {});
  const auto& plans = judgement.ranking.plans;
  ASSERT_GE(plans.size(), 2U);
  for (std::size_t k = 0; k < plans.size(); ++k) {
    const RepeatedPlan* repeated = find_repeated(judgement.repeated, plans[k].trial);
    if (k == 0) {
      ASSERT_NE(repeated, nullptr);
      EXPECT_EQ(repeated->repeats.size(), 16U);
    } else if (repeated != nullptr && plans[k].score.total > plans[0].score.total) {
      EXPECT_EQ(repeated->repeats.size(), 4U) << "each of them scores worse by as much";
    }
  }
}

TEST(ToolRuns, MakePlanTriesTheNextCathetersWhereNoScriptHoldsInMostRepeats) {
  Study study = toward(1.0);
  const Catheter hook = study.catheters.front(), wide = catheter_of(650.0, 1.0, 21.0);
  study.catheters = {hook, wide, wide, hook};
  study.suggested.assign(4, "suggested");
  const PlanVessel vessel = rigid_aorta(study);
  PlanOptions options{.until = PlanOptions::Until::kManoeuvres};
  options.robustness.repeats = 4;
  for (const int failures : {0, 1}) {
    SCOPED_TRACE(failures);
    LogOfRepeats log(failures);
    const Plan plan = make_plan(study, vessel, options, log);
    ASSERT_GT(plan.scripts.pairs.at(0).found, 0);
    EXPECT_EQ(plan.scripts.pairs.at(3).tried(), failures > 0);
    EXPECT_EQ(log.repeats, failures > 0 ? 8 : 4) << "of one script, or of two";
  }
}

}  // namespace
}  // namespace wireplan::plan
