#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "plan/batch.h"
#include "plan/search.h"
#include "tests/shapes.h"

namespace wireplan::plan {
namespace {

using simulate::Outcome;

/// Candidates of two wires as the levels see them. Probes see what the full runs do, unless told.
struct Bench {
  Study study;
  std::vector<Candidate> candidates;
  Sightings seen;
  std::vector<std::optional<Sighting>> truth, probed;
  bool probing = false;

  void add(int wire, const Sighting& scout, const Sighting& full) {
    candidates.push_back({.wire = wire});
    seen.scouts.push_back(scout);
    seen.probes.emplace_back();
    seen.full.emplace_back();
    truth.push_back(full);
    probed.push_back(full);
  }
  void reach(int wire, double scout_score, double full_score) {
    add(wire, {.reached = true, .plan = true, .score = scout_score},
        {.reached = true, .plan = true, .score = full_score});
  }
  void fail(int wire, double nearest, bool unclear = false) {
    add(wire, {.unclear = unclear, .nearest = nearest}, {.nearest = nearest});
  }
  NextRuns next() const { return choose_next(study, candidates, seen, probing); }
  void run(const NextRuns& runs) {
    EXPECT_TRUE(runs.probes.empty() || runs.full.empty());
    for (const int id : runs.probes) seen.probes[id] = probed[id];
    for (const int id : runs.full) seen.full[id] = truth[id];
  }
  /// Runs what is asked for until nothing is; returns how many in full.
  int search() {
    int count = 0;
    for (NextRuns runs = next(); !runs.probes.empty() || !runs.full.empty(); runs = next()) {
      run(runs);
      count += static_cast<int>(runs.full.size());
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

/// A straight push in the way of a path.
simulate::TrialResult scouted(Study study, const Centerline& path,
                              const simulate::VesselModel& vessel) {
  study.goal.way = std::make_shared<simulate::Way>(path);
  return run_candidate(study, {}, vessel);
}

TEST(Way, ATrialEndsWhereTheTipComesNoFurtherAlongIt) {
  // Straight on in a tube whose path leaves it after 30 mm.
  const simulate::VesselModel tube(shapes::straight_tube(4.0, 120.0, 2.0));
  Study study;
  study.wires = {{.name = "straight",
                  .radius = 0.4,
                  .sections = {{.length = 150.0, .bending_stiffness = 60.0}}}};
  study.access = Vec3(0.0, 0.0, 5.0);
  study.goal = {.point = Vec3(30.0, 0.0, 35.0), .radius = 4.0};
  study.insertion.length = 110.0;
  study.insertion.step = 2.0;
  Centerline path;
  path.points.resize(3, 3);
  path.points << 0.0, 0.0, 30.0, 0.0, 0.0, 0.0, 5.0, 35.0, 35.0;
  path.arc_length = Eigen::Vector3d(0.0, 30.0, 60.0);
  path.radius.setConstant(3, 2.0);
  const simulate::TrialResult scout = scouted(study, path, tube);
  EXPECT_EQ(scout.outcome, Outcome::kMissed);
  // In the lumen of 2 mm and 1 mm beside until 33 mm on, then 40 mm more.
  EXPECT_NEAR(scout.pushes.back().insertion, 72.0, 3.0);
  EXPECT_NE(scout.reason.find("came no further than 30.0 mm along the way"), std::string::npos)
      << scout.reason;

  // A path that ends in the tube, with the goal at its end but too small for a tip that the lean
  // keeps off the axis: 10 mm on from there.
  Study passing = study;
  passing.goal = {.point = Vec3(3.5, 0.0, 50.0), .radius = 1.0};
  Centerline straight;
  straight.points.resize(3, 2);
  straight.points << 0.0, 0.0, 0.0, 0.0, 5.0, 50.0;
  straight.arc_length = Eigen::Vector2d(0.0, 45.0);
  straight.radius.setConstant(2, 4.0);
  const simulate::TrialResult passed = scouted(passing, straight, tube);
  EXPECT_EQ(passed.outcome, Outcome::kMissed);
  EXPECT_NEAR(passed.pushes.back().insertion, 57.0, 2.0);

  // Where the path goes on with the tube the goal is reached, and until then nothing is given up.
  study.goal.point = Vec3(0.0, 0.0, 100.0);
  path.points.col(2) = Vec3(0.0, 0.0, 110.0);
  EXPECT_EQ(scouted(study, path, tube).outcome, Outcome::kReached);
}

TEST(ChooseNext, FindsTheBestPlanThoughTheScoutHasItSixth) {
  Bench bench;
  // The scout errs by 0.1, and puts the best plan behind five.
  for (int k = 0; k < 5; ++k) bench.reach(0, 0.30 + 0.001 * k, 0.40 + 0.001 * k);
  bench.reach(0, 0.31, 0.25);
  for (int k = 0; k < 100; ++k) bench.reach(0, 0.6 + 0.001 * k, 0.6 + 0.001 * k);
  EXPECT_EQ(bench.next().full, (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(bench.search(), 6);
  EXPECT_TRUE(bench.seen.full[5]);
}

TEST(ChooseNext, RunsAllThatMayBeatTheBestByTheErrorFound) {
  Bench bench;
  // Off by 0.19, and the best is 0.49: what the scout has below 0.68 may still beat it.
  for (int k = 0; k < 10; ++k) bench.reach(0, 0.30 + 0.05 * k, 0.49 + 0.05 * k);
  bench.search();
  for (int k = 0; k < 10; ++k)
    EXPECT_EQ(bench.seen.full[k].has_value(), 0.30 + 0.05 * k < 0.68) << k;
}

TEST(ChooseNext, LooksAtTheBestOfEachWire) {
  Bench bench;
  for (int k = 0; k < 10; ++k) bench.reach(0, 0.2, 0.2);
  bench.reach(1, 0.9, 0.9);
  bench.fail(2, 80.0);
  bench.fail(2, 40.0);
  const std::vector<int> next = bench.next().full;
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
  for (int k = 10; k < 22; ++k)
    EXPECT_EQ(bench.seen.full[k].has_value(), k < 13 || (k > 15 && k < 20));
}

TEST(ChooseNext, ChecksFailuresThatMayBeTheScouts) {
  Bench bench;
  for (int k = 0; k < 6; ++k) bench.reach(0, 0.2, 0.2);
  for (int k = 0; k < 30; ++k) bench.fail(0, 50.0 + k);
  bench.fail(0, 90.0, /*unclear=*/true);  // 36
  bench.fail(0, 6.0);                     // 37: within two radii of 4 mm
  const std::vector<int> next = bench.next().full;
  EXPECT_TRUE(std::count(next.begin(), next.end(), 36));
  EXPECT_TRUE(std::count(next.begin(), next.end(), 37));
  EXPECT_EQ(next.size(), 7u);
}

TEST(ChooseNext, CountsTheBestOfAWireAmongTheFailuresThatItChecks) {
  Bench bench;
  for (int k = 0; k < 5; ++k) bench.reach(0, 0.2, 0.2);
  for (int k = 0; k < 30; ++k) bench.fail(0, 50.0 + k);
  for (int k = 0; k < 5; ++k) bench.fail(0, 4.5 + 0.1 * k);  // 35 to 39
  bench.fail(1, 6.0);                                        // 40
  bench.fail(2, 7.0);                                        // 41: 37 failures, three are checked
  EXPECT_EQ(bench.next().full, (std::vector<int>{0, 1, 2, 3, 4, 35, 40, 41}));
}

TEST(ChooseNext, RunsTheNearestAndAllThatReachedBeforeItSaysThatNoPlanReaches) {
  Bench bench;
  for (int k = 0; k < 30; ++k) bench.fail(k % 2, 50.0 + k);
  EXPECT_EQ(bench.search(), 8);
  for (int k = 0; k < 30; ++k) EXPECT_EQ(bench.seen.full[k].has_value(), k < 8) << k;
  // And finds the one that the scout saw fail furthest from the target of those.
  for (auto& run : bench.seen.full) run.reset();
  bench.truth[7] = Sighting{.reached = true, .plan = true, .score = 0.5};
  bench.search();
  EXPECT_TRUE(bench.seen.full[7]->plan);

  // Of many, one in twelve.
  Bench large;
  for (int k = 0; k < 200; ++k) large.fail(0, 250.0 - k);
  EXPECT_EQ(large.search(), 16);
  for (int k = 0; k < 200; ++k) EXPECT_EQ(large.seen.full[k].has_value(), k >= 184) << k;

  // But not while there is one that the scout saw reach: the last of 50 is a plan.
  for (int k = 0; k < 50; ++k) {
    large.reach(0, 0.3 + 0.01 * k, 0.5);
    large.truth.back() = Sighting{.nearest = 30.0};
  }
  large.truth.back() = Sighting{.reached = true, .plan = true, .score = 0.8};
  large.search();
  EXPECT_TRUE(large.seen.full.back() && large.seen.full.back()->plan);
}

TEST(ChooseNext, RunsInFullWhatScoutOrProbeSawReach) {
  Bench bench;
  bench.probing = true;
  for (int k = 0; k < 10; ++k) bench.reach(0, 0.3 + 0.001 * k, 0.3 + 0.001 * k);
  bench.fail(1, 60.0);  // 10: the best of its wire, and its probe reaches
  bench.probed[10] = Sighting{.reached = true, .plan = true, .score = 0.2};
  bench.truth[10] = bench.probed[10];
  bench.fail(2, 60.0);  // 11: its probe fails too
  // What a scout saw reach is no probe's business.
  EXPECT_EQ(bench.next().full, (std::vector<int>{0, 1, 2, 3, 4}));
  bench.run(bench.next());
  bench.run(bench.next());
  EXPECT_EQ(bench.next().probes, (std::vector<int>{10, 11}));
  bench.search();
  EXPECT_TRUE(bench.seen.full[10]->plan);
  EXPECT_FALSE(bench.seen.full[11]);

  // One that came near has no need of a probe.
  bench.fail(1, 6.0);  // 12
  EXPECT_EQ(bench.next().full, std::vector<int>{12});
  bench.search();
  EXPECT_FALSE(bench.seen.probes[12]);

  // Near misses of probes are run, and those without equilibrium.
  Bench lone;
  lone.probing = true;
  for (int k = 0; k < 6; ++k) lone.fail(0, 60.0 + k);
  lone.probed[3] = Sighting{.nearest = 6.0};
  lone.probed[4] = Sighting{.unclear = true, .nearest = 60.0};
  EXPECT_EQ(lone.search(), 2);
  EXPECT_TRUE(lone.seen.full[3] && lone.seen.full[4]);
  for (int k = 0; k < 6; ++k) EXPECT_TRUE(lone.seen.probes[k]) << k;
}

TEST(ChooseNext, RunsAllThatScoutsSawReachBeforeItProbesFailures) {
  Bench bench;
  bench.probing = true;
  for (int k = 0; k < 40; ++k) bench.fail(0, 60.0 + k);
  for (int k = 0; k < 7; ++k) {  // 40 to 46: the last is a plan
    bench.reach(0, 0.4 + 0.05 * k, 0.5);
    if (k < 6) bench.truth.back() = Sighting{.nearest = 30.0};
  }
  EXPECT_EQ(bench.search(), 7);
  EXPECT_TRUE(bench.seen.full[46] && bench.seen.full[46]->plan);
  for (const auto& probe : bench.seen.probes) EXPECT_FALSE(probe);
}

TEST(ChooseNext, RunsAllInFullThatARigidWallHeldInAStenosis) {
  Bench bench;
  bench.probing = true;
  for (int k = 0; k < 6; ++k) bench.reach(0, 0.3, 0.3);
  for (int k = 0; k < 20; ++k) {
    bench.fail(0, 50.0);
    bench.seen.scouts.back().pinched = true;
  }
  bench.search();
  for (int k = 6; k < 26; ++k) {
    EXPECT_TRUE(bench.seen.full[k]) << k;
    EXPECT_FALSE(bench.seen.probes[k]) << k;
  }
}

TEST(IsPinched, WhereAStuckTipHasLessRoomThanItIsThick) {
  Centerline path;  // along x, of radius 2 mm, with a stenosis of 0.3 mm at 20 mm
  path.points.setZero(3, 41);
  path.points.row(0).setLinSpaced(0.0, 40.0);
  path.arc_length = path.points.row(0);
  path.radius.setConstant(41, 2.0);
  path.radius[20] = 0.3;
  Measured trial{.outcome = Outcome::kStuck, .last_tip = {18.8, 0.2, 0.0}};
  EXPECT_TRUE(is_pinched(trial, 0.18, path));
  EXPECT_FALSE(is_pinched(trial, 0.14, path)) << "it has room";
  trial.outcome = Outcome::kMissed;
  EXPECT_FALSE(is_pinched(trial, 0.18, path));
  trial.outcome = Outcome::kStuck;
  trial.last_tip = {10.0, 1.8, 0.0};
  EXPECT_FALSE(is_pinched(trial, 0.18, path)) << "it is stuck elsewhere";
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
  bench.run({.full = {0, 1, 3, 4}});
  const ScoutError error = find_scout_error(bench.seen.scouts, bench.seen.full);
  EXPECT_EQ(error.compared, 4);
  EXPECT_EQ(error.both_reached, 2);
  EXPECT_EQ(error.missed, 1);
  EXPECT_EQ(error.false_reached, 1);
  EXPECT_NEAR(error.largest_score.value(), 0.1, 1e-12);
  EXPECT_NEAR(error.median_score.value(), 0.06, 1e-12);
  EXPECT_FALSE(find_scout_error(bench.seen.scouts, {{}, {}, {}, {}, {}}).median_score);
}

TEST(LookAt, ScoresWhatReachedWhateverLimitItBroke) {
  Measured trial{.outcome = Outcome::kReached};
  Metrics& metrics = trial.metrics;
  metrics.reached = true;
  metrics.tip_to_target = 1.0;
  metrics.peak_tip_force = 3.0;
  const Sighting hard = look_at(trial, {}, {}, {});
  EXPECT_TRUE(hard.reached);
  EXPECT_FALSE(hard.plan);
  EXPECT_LT(hard.score, 1.0);
  trial.outcome = Outcome::kNotConverged;
  metrics.reached = false;
  EXPECT_TRUE(look_at(trial, {}, {}, {}).unclear);
  EXPECT_EQ(look_at(trial, {}, {}, {}).score, 1.0);
}

}  // namespace
}  // namespace wireplan::plan
