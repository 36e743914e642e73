#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "plan/search.h"

namespace wireplan::plan {
namespace {

using simulate::Outcome;

/// Candidates of two wires as the scout and the full trials see them.
struct Bench {
  Study study;
  std::vector<Candidate> candidates;
  std::vector<Sighting> scouts;
  std::vector<std::optional<Sighting>> full, truth;

  void reach(int wire, double scout_score, double full_score) {
    candidates.push_back({.wire = wire});
    scouts.push_back({.reached = true, .plan = true, .score = scout_score});
    truth.push_back(Sighting{.reached = true, .plan = true, .score = full_score});
    full.emplace_back();
  }
  void fail(int wire, double nearest, bool unclear = false) {
    candidates.push_back({.wire = wire});
    scouts.push_back({.unclear = unclear, .nearest = nearest});
    truth.push_back(Sighting{.nearest = nearest});
    full.emplace_back();
  }
  std::vector<int> next() const { return choose_next(study, candidates, scouts, full); }
  void run(const std::vector<int>& ids) {
    for (const int id : ids) full[id] = truth[id];
  }
  /// Runs what is asked for until nothing is; returns how many.
  int search() {
    int count = 0;
    for (std::vector<int> ids = next(); !ids.empty(); ids = next()) {
      run(ids);
      count += static_cast<int>(ids.size());
    }
    return count;
  }
};

TEST(ScoutStudy, IsCoarserButResolvesTheTip) {
  Study study;
  study.goal.radius = 5.0;
  study.wires.resize(1);
  study.wires[0].sections = {{.length = 20.0, .rest_curvature = 1.0 / 6.0}, {.length = 100.0}};
  const Study scout = scout_study(study);
  EXPECT_NEAR(scout.insertion.element_length, 2.0, 1e-12);  // 1/3 rad of a radius of 6 mm
  EXPECT_EQ(scout.insertion.step, 2.0);
  study.wires[0].sections[0].rest_curvature = 0.0;
  EXPECT_EQ(scout_study(study).insertion.element_length, 4.0);
  EXPECT_EQ(scout_study(study).insertion.contact_spacing, 2.0);
  study.goal.radius = 1.0;
  study.insertion.step = 0.25;
  EXPECT_EQ(scout_study(study).insertion.step, 0.5) << "a longer push steps over the goal";
  study.insertion.step = 3.0;
  EXPECT_EQ(scout_study(study).insertion.step, 3.0) << "never finer than the study";
}

TEST(ChooseNext, FindsTheBestPlanThoughTheScoutHasItSixth) {
  Bench bench;
  // The scout errs by 0.1, and puts the best plan behind five.
  for (int k = 0; k < 5; ++k) bench.reach(0, 0.30 + 0.001 * k, 0.40 + 0.001 * k);
  bench.reach(0, 0.31, 0.25);
  for (int k = 0; k < 100; ++k) bench.reach(0, 0.6 + 0.001 * k, 0.6 + 0.001 * k);
  EXPECT_EQ(bench.next(), (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(bench.search(), 6);
  EXPECT_TRUE(bench.full[5]);
}

TEST(ChooseNext, RunsAllThatMayBeatTheBestByTheErrorFound) {
  Bench bench;
  // Off by 0.19, and the best is 0.49: what the scout has below 0.68 may still beat it.
  for (int k = 0; k < 10; ++k) bench.reach(0, 0.30 + 0.05 * k, 0.49 + 0.05 * k);
  bench.search();
  for (int k = 0; k < 10; ++k) EXPECT_EQ(bench.full[k].has_value(), 0.30 + 0.05 * k < 0.68) << k;
}

TEST(ChooseNext, LooksAtTheBestOfEachWire) {
  Bench bench;
  for (int k = 0; k < 10; ++k) bench.reach(0, 0.2, 0.2);
  bench.reach(1, 0.9, 0.9);
  bench.fail(2, 80.0);
  bench.fail(2, 40.0);
  const std::vector<int> next = bench.next();
  EXPECT_TRUE(std::count(next.begin(), next.end(), 10));
  EXPECT_TRUE(std::count(next.begin(), next.end(), 12)) << "the nearest of a wire that fails";
  EXPECT_FALSE(std::count(next.begin(), next.end(), 11));
}

TEST(ChooseNext, TriesToFindEachWireAPlan) {
  Bench bench;
  for (int k = 0; k < 10; ++k) bench.reach(0, 0.2, 0.2);
  for (int k = 0; k < 6; ++k) {  // 10 to 15: the third is a plan
    bench.reach(1, 0.7 + 0.01 * k, 0.7);
    if (k < 2) bench.truth.back() = Sighting{.nearest = 30.0};
  }
  for (int k = 0; k < 6; ++k) {  // 16 to 21: none is
    bench.reach(2, 0.8 + 0.01 * k, 0.8);
    bench.truth.back() = Sighting{.nearest = 30.0};
  }
  bench.search();
  for (int k = 10; k < 22; ++k) EXPECT_EQ(bench.full[k].has_value(), k < 13 || (k > 15 && k < 20));
}

TEST(ChooseNext, ChecksFailuresThatMayBeTheScouts) {
  Bench bench;
  for (int k = 0; k < 6; ++k) bench.reach(0, 0.2, 0.2);
  for (int k = 0; k < 30; ++k) bench.fail(0, 50.0 + k);
  bench.fail(0, 90.0, /*unclear=*/true);  // 36
  bench.fail(0, 6.0);                     // 37: within two radii of 4 mm
  const std::vector<int> next = bench.next();
  EXPECT_TRUE(std::count(next.begin(), next.end(), 36));
  EXPECT_TRUE(std::count(next.begin(), next.end(), 37));
  EXPECT_EQ(next.size(), 7u);
}

TEST(ChooseNext, RunsTheNearestAndAllThatReachedBeforeItSaysThatNoPlanReaches) {
  Bench bench;
  for (int k = 0; k < 30; ++k) bench.fail(k % 2, 50.0 + k);
  EXPECT_EQ(bench.search(), 30);
  // And finds the one that the scout saw fail furthest from the target.
  for (auto& run : bench.full) run.reset();
  bench.truth[29] = Sighting{.reached = true, .plan = true, .score = 0.5};
  bench.search();
  EXPECT_TRUE(bench.full[29]->plan);

  // Of many it gives up after some: the nearest.
  Bench large;
  for (int k = 0; k < 200; ++k) large.fail(0, 250.0 - k);
  EXPECT_EQ(large.search(), 33);  // the best of its wire, then eight at a time
  for (int k = 0; k < 200; ++k) EXPECT_EQ(large.full[k].has_value(), k >= 167) << k;

  // But not while there is one that the scout saw reach: the last of 50 is a plan.
  for (int k = 0; k < 50; ++k) {
    large.reach(0, 0.3 + 0.01 * k, 0.5);
    large.truth.back() = Sighting{.nearest = 30.0};
  }
  large.truth.back() = Sighting{.reached = true, .plan = true, .score = 0.8};
  large.search();
  EXPECT_TRUE(large.full.back() && large.full.back()->plan);
}

TEST(ScoutErrorOf, CountsWhatTheScoutSawWrong) {
  Bench bench;
  bench.reach(0, 0.3, 0.4);
  bench.reach(0, 0.3, 0.32);
  bench.reach(0, 0.3, 0.9);   // not run
  bench.fail(0, 50.0);        // a plan in full
  bench.reach(0, 0.35, 0.0);  // none in full
  bench.truth[3] = Sighting{.reached = true, .plan = true, .score = 0.5};
  bench.truth[4] = Sighting{.nearest = 30.0};
  bench.run({0, 1, 3, 4});
  const ScoutError error = find_scout_error(bench.scouts, bench.full);
  EXPECT_EQ(error.compared, 4);
  EXPECT_EQ(error.both_reached, 2);
  EXPECT_EQ(error.missed, 1);
  EXPECT_EQ(error.false_reached, 1);
  EXPECT_NEAR(error.largest_score.value(), 0.1, 1e-12);
  EXPECT_NEAR(error.median_score.value(), 0.06, 1e-12);
  EXPECT_FALSE(find_scout_error(bench.scouts, {{}, {}, {}, {}, {}}).median_score);
}

TEST(LookAt, ScoresWhatReachedWhateverLimitItBroke) {
  simulate::TrialResult trial;
  trial.outcome = Outcome::kReached;
  Metrics metrics;
  metrics.reached = true;
  metrics.tip_to_target = 1.0;
  metrics.peak_tip_force = 3.0;
  const Sighting hard = look_at(trial, metrics, {}, {}, {});
  EXPECT_TRUE(hard.reached);
  EXPECT_FALSE(hard.plan);
  EXPECT_LT(hard.score, 1.0);
  trial.outcome = Outcome::kNotConverged;
  metrics.reached = false;
  EXPECT_TRUE(look_at(trial, metrics, {}, {}, {}).unclear);
  EXPECT_EQ(look_at(trial, metrics, {}, {}, {}).score, 1.0);
}

}  // namespace
}  // namespace wireplan::plan
