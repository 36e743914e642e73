#include <gtest/gtest.h>

#include <cmath>

#include "plan/manoeuvre.h"
#include "preprocess/centerline/path_place.h"
#include "tests/shapes.h"

namespace wireplan::plan {
namespace {

using simulate::Outcome;

constexpr double kDecoy = 25.0, kOstium = 50.0;  // where side branches leave, along z         [mm]

/// A trunk of 5 mm radius along z with two side branches at right angles, toward +x.
const simulate::VesselModel& side_branches() {
  static const simulate::VesselModel vessel(
      shapes::level_set(
          [](const Vec3& p) {
            const auto branch_at = [&](double z, double radius) {
              return shapes::depth_in_tube(p, Vec3(0.0, 0.0, z), Vec3(40.0, 0.0, z), radius);
            };
            const double trunk =
                shapes::depth_in_tube(p, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 90.0), 5.0);
            // Rounded ostia: the smooth maximum of all.
            const auto soft = [](double depth) { return std::exp(depth / 0.5); };
            return 0.5 * std::log(soft(trunk) + soft(branch_at(kDecoy, 3.5)) +
                                  soft(branch_at(kOstium, 2.5)));
          },
          Vec3(-6.6, -6.6, -1.6), Vec3(41.6, 6.6, 91.6), 1.1),
      simulate::LumenOptions{.grid_spacing = 0.6});
  return vessel;
}

Centerline path_into_the_branch() {
  Centerline path;
  path.points.resize(3, 76);
  path.radius.resize(76);
  for (int k = 0; k <= 75; ++k) {
    path.points.col(k) = k <= 45 ? Vec3(0.0, 0.0, 5.0 + k) : Vec3(k - 45.0, 0.0, kOstium);
    path.radius[k] = k <= 50 ? 5.0 : 2.5;
  }
  path.arc_length = arc_length_of(path.points);
  return path;
}

simulate::Wire angled_wire() {
  return {.name = "angled",
          .radius = 0.445,
          .sections = {{.length = 6.0, .bending_stiffness = 2.0},
                       {.length = 6.0, .bending_stiffness = 2.0, .rest_curvature = 1.0 / 6.0},
                       {.length = 40.0, .bending_stiffness = 10.0},
                       {.length = 200.0, .bending_stiffness = 100.0}}};
}
simulate::Wire straight_wire() {
  return {.name = "straight",
          .radius = 0.445,
          .sections = {{.length = 250.0, .bending_stiffness = 50.0}}};
}

Study into_the_branch() {
  Study study;
  study.wires = {straight_wire(), angled_wire()};
  study.inclinations = study.azimuths = {0.0};
  for (int k = 0; k < 8; ++k) study.rolls.push_back(0.25 * k * kPi);
  study.access = Vec3(0.0, 0.0, 5.0);
  study.goal = {.point = Vec3(25.0, 0.0, kOstium), .radius = 3.0};
  study.insertion = {.length = 110.0, .step = 1.0, .element_length = 1.5, .friction = 0.05};
  return study;
}

/// What straight pushes come to, and which of them are worth going on from.
struct StraightPushes {
  std::vector<Outcome> outcomes;
  std::vector<double> progress;
  std::vector<Candidate> starts;
};
StraightPushes push_straight(const Study& study) {
  StraightPushes pushes;
  const std::vector<Candidate> candidates = list_candidates(study);
  for (const Candidate& candidate : candidates) {
    const simulate::TrialResult trial = run_candidate(study, candidate, side_branches());
    pushes.outcomes.push_back(trial.outcome);
    pushes.progress.push_back(find_progress(trial, study, path_into_the_branch()));
  }
  for (const int k : choose_starts(study, candidates, pushes.progress, pushes.outcomes, 2)) {
    pushes.starts.push_back(candidates[static_cast<std::size_t>(k)]);
  }
  return pushes;
}

TEST(Manoeuvres, FindTheWayPastADecoyIntoABranchAtARightAngle) {
  // A tip that points to the side of the branch goes into the wider one before it; one that points
  // elsewhere goes past both.
  const Study study = into_the_branch();
  const StraightPushes pushes = push_straight(study);
  ASSERT_EQ(pushes.outcomes.size(), 9u);
  for (const Outcome outcome : pushes.outcomes) ASSERT_NE(outcome, Outcome::kReached);
  ASSERT_EQ(pushes.starts.size(), 2u);
  for (const Candidate& start : pushes.starts) EXPECT_EQ(start.wire, 1);

  const Centerline path = path_into_the_branch();
  const Manoeuvres search =
      find_manoeuvres(study, pushes.starts, path, side_branches(), /*limits=*/{}, {});
  ASSERT_FALSE(search.found.empty());
  for (const Candidate& candidate : search.found) {
    SCOPED_TRACE(describe_moves(candidate.moves, 0.0));
    // From start to end in one go, not from where the search went on.
    const simulate::TrialResult trial = run_candidate(study, candidate, side_branches());
    EXPECT_EQ(trial.outcome, Outcome::kReached) << trial.reason;
    EXPECT_GE(candidate.moves.size(), 2u);
  }
  EXPECT_GT(search.effort.branches, 100);
  EXPECT_EQ(search.effort.cut_off, 0);

  // The same on any number of threads, and whatever else is searched.
  const Manoeuvres alone =
      find_manoeuvres(study, {pushes.starts[0]}, path, side_branches(), {}, {.threads = 1});
  ASSERT_LE(alone.found.size(), search.found.size());
  EXPECT_LT(alone.effort.branches, search.effort.branches);
  for (std::size_t k = 0; k < alone.found.size(); ++k) {
    EXPECT_EQ(describe_moves(alone.found[k].moves, 0.0),
              describe_moves(search.found[k].moves, 0.0));
  }
  EXPECT_TRUE(find_manoeuvres(study, pushes.starts, path, side_branches(), {.most_turns = 0}, {})
                  .found.empty());
}

TEST(Manoeuvres, StopWhenCancelled) {
  const Study study = into_the_branch();
  Candidate start;
  start.wire = 1;
  const Manoeuvres search = find_manoeuvres(study, {start}, path_into_the_branch(), side_branches(),
                                            {}, {.cancelled = [] { return true; }});
  EXPECT_TRUE(search.found.empty());
  EXPECT_LT(search.effort.branches, 10);
}

/// Up the trunk to a height, and from there into a branch toward -x, which the vessel has not got.
Centerline path_into_no_branch(int height) {
  Centerline path;
  path.points.resize(3, height + 26);
  path.radius.setConstant(height + 26, 5.0);
  for (int k = 0; k < height + 26; ++k) {
    path.points.col(k) =
        k <= height ? Vec3(0.0, 0.0, 5.0 + k) : Vec3(height - k, 0.0, 5.0 + height);
  }
  path.arc_length = arc_length_of(path.points);
  return path;
}

Study into_no_branch(int height) {
  Study study = into_the_branch();
  study.goal = {.point = Vec3(-25.0, 0.0, 5.0 + height), .radius = 3.0};
  return study;
}
std::vector<Candidate> angled_starts() {
  std::vector<Candidate> starts(2);
  for (std::size_t k = 0; k < starts.size(); ++k) {
    starts[k].wire = 1;
    starts[k].roll = static_cast<double>(k) * kPi;
  }
  return starts;
}

TEST(Manoeuvres, EndWhereTurnsBringTheTipNoFurther) {
  const Study study = into_no_branch(45);
  const Centerline path = path_into_no_branch(45);
  const auto search = [&](const SearchLimits& limits, int threads) {
    return find_manoeuvres(study, angled_starts(), path, side_branches(), limits,
                           {.threads = threads});
  };
  // A round that gives nobody up tries seven turns at each of the depths, every 3 mm.
  const Manoeuvres all = search({.patience = 1000000, .most_seconds = 1e6}, 1);
  const Manoeuvres some = search({.patience = 20}, 1);
  for (const Manoeuvres* each : {&all, &some}) {
    EXPECT_TRUE(each->found.empty());
    EXPECT_EQ(each->effort.no_further, 2);
    EXPECT_EQ(each->effort.cut_off, 0);
  }
  // Per start a push, and in two rounds at most: up to three pushes again, and until 20 in a row
  // are in vain, of which a try after pulls makes four at once. A gain or two come before.
  EXPECT_GT(all.effort.branches, 2 * 80);
  EXPECT_GE(some.effort.branches, 2 * 21);
  EXPECT_LE(some.effort.branches, 2 * 80);
  EXPECT_LT(3 * some.effort.iterations, 2 * all.effort.iterations);

  const Manoeuvres again = search({.patience = 20}, 2);
  EXPECT_EQ(again.effort.branches, some.effort.branches);
  EXPECT_EQ(again.effort.iterations, some.effort.iterations);
}

TEST(Manoeuvres, CountTheIterationsOfTheirPushes) {
  // Without a turn a search is one straight push, until that has brought the tip no further for 15
  // mm: a part of the candidate's own trial.
  const Study study = into_no_branch(45);
  const Centerline path = path_into_no_branch(45);
  const Candidate start = angled_starts().front();
  const SearchEffort effort =
      find_manoeuvres(study, {start}, path, side_branches(), {.most_turns = 0}, {}).effort;
  EXPECT_EQ(effort.branches, 1);
  double furthest = 0.0, depth = 0.0;
  long iterations = 0;
  for (const simulate::Push& push : run_candidate(study, start, side_branches()).pushes) {
    iterations += push.iterations;
    const double progress = find_progress(push.tip, study, path);
    if (progress > furthest) {
      furthest = progress;
      depth = push.insertion;
    }
    if (push.insertion - depth >= 15.0) break;
  }
  EXPECT_GT(iterations, 100);
  EXPECT_EQ(effort.iterations, iterations);
}

TEST(Manoeuvres, EndAtTheirShareOfTheWork) {
  const Study study = into_no_branch(45);
  const auto search = [&](double seconds) {
    return find_manoeuvres(study, angled_starts(), path_into_no_branch(45), side_branches(),
                           {.patience = 1000000, .most_seconds = seconds}, {})
        .effort;
  };
  const SearchEffort whole = search(1e6);
  EXPECT_EQ(whole.cut_off, 0);
  // A third of what it takes, by its own count. What is under way at the limit is finished.
  const double seconds = 1e6 * static_cast<double>(whole.iterations) /
                         static_cast<double>(whole.most_iterations) / 3.0;
  const SearchEffort part = search(seconds);
  EXPECT_EQ(part.cut_off, 2);
  EXPECT_EQ(part.no_further, 0);
  EXPECT_NEAR(static_cast<double>(part.most_iterations),
              static_cast<double>(whole.iterations) / 3.0, 2.0);
  EXPECT_GE(part.iterations, part.most_iterations);
  EXPECT_LT(part.iterations, 1.2 * static_cast<double>(part.most_iterations));
}

TEST(Manoeuvres, GoOnFromWhereTheWireHasPassedWhatHeldIt) {
  // Straight, the tip goes into the side branch at 25 mm. Turned it goes up the trunk, 55 mm on, as
  // most turns bring it: the round of turns ends with the third such try.
  const Study study = into_no_branch(80);
  Candidate start = angled_starts().front();
  const auto branches = [&](int turns) {
    return find_manoeuvres(study, {start}, path_into_no_branch(80), side_branches(),
                           {.most_turns = turns, .patience = 1000000}, {})
        .effort.branches;
  };
  long fewest = 1000;
  for (const double roll : {0.0, 0.5 * kPi, kPi, 1.5 * kPi}) {
    start.roll = roll;
    const double progress =
        find_progress(run_candidate(study, start, side_branches()), study, path_into_no_branch(80));
    if (progress > 30.0) continue;  // it went up the trunk
    fewest = std::min(fewest, branches(1));
  }
  EXPECT_GE(fewest, 1 + 1 + 3);
  EXPECT_LE(fewest, 40);
}

TEST(Manoeuvres, GoOnFromThePushesThatCameFurthest) {
  Study study = into_the_branch();
  study.wires.push_back(angled_wire());
  std::vector<Candidate> candidates(7);
  for (std::size_t k = 1; k < 5; ++k) candidates[k].wire = 1;  // 0: straight
  candidates[5].wire = candidates[6].wire = 2;
  candidates[6].moves = {{.push = 10.0}};
  const std::vector<double> progress = {90.0, 10.0, 30.0, 40.0, 20.0, 5.0, 80.0};
  const std::vector<Outcome> outcomes = {Outcome::kMissed, Outcome::kMissed, Outcome::kStuck,
                                         Outcome::kFailed, Outcome::kMissed, Outcome::kMissed,
                                         Outcome::kMissed};
  EXPECT_EQ(choose_starts(study, candidates, progress, outcomes, 2), (std::vector<int>{2, 4, 5}));
}

TEST(Manoeuvres, AreToldAsTheHandDoesThem) {
  EXPECT_EQ(
      describe_moves(
          {{.push = 112.04}, {.turn = 0.5 * kPi}, {.push = -10.0}, {.turn = -0.25 * kPi}}, 105.5),
      "push 112.0 mm, turn 90 deg clockwise, pull back 10.0 mm, turn 45 deg counterclockwise, "
      "then push on to 105.5 mm");
  EXPECT_EQ(describe_moves({}, 60.0), "");
}

TEST(PathPlace, TellsArcRadiusAndDistances) {
  const Centerline path = path_into_the_branch();
  const preprocess::PathPlace beside = preprocess::find_place(Vec3(12.0, 4.0, kOstium), path);
  EXPECT_DOUBLE_EQ(beside.arc, 57.0);
  EXPECT_DOUBLE_EQ(beside.radius, 2.5);
  EXPECT_DOUBLE_EQ(beside.from_axis, 4.0);
  EXPECT_DOUBLE_EQ(beside.from_lumen, 1.5);
  const preprocess::PathPlace before = preprocess::find_place(Vec3(0.0, 3.0, 1.0), path);
  EXPECT_DOUBLE_EQ(before.arc, 0.0);
  EXPECT_DOUBLE_EQ(before.from_axis, 5.0);
  EXPECT_DOUBLE_EQ(before.from_lumen, 0.0);
}

}  // namespace
}  // namespace wireplan::plan
