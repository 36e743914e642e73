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
      find_manoeuvres(study, pushes.starts, path, side_branches(), /*most_turns=*/3, {});
  ASSERT_FALSE(search.found.empty());
  for (const Candidate& candidate : search.found) {
    SCOPED_TRACE(describe_moves(candidate.moves, 0.0));
    // From start to end in one go, not from where the search went on.
    const simulate::TrialResult trial = run_candidate(study, candidate, side_branches());
    EXPECT_EQ(trial.outcome, Outcome::kReached) << trial.reason;
    EXPECT_GE(candidate.moves.size(), 2u);
  }
  EXPECT_GT(search.branches, 100);

  // The same on any number of threads, and whatever else is searched.
  const Manoeuvres alone =
      find_manoeuvres(study, {pushes.starts[0]}, path, side_branches(), 3, {.threads = 1});
  ASSERT_LE(alone.found.size(), search.found.size());
  EXPECT_LT(alone.branches, search.branches);
  for (std::size_t k = 0; k < alone.found.size(); ++k) {
    EXPECT_EQ(describe_moves(alone.found[k].moves, 0.0),
              describe_moves(search.found[k].moves, 0.0));
  }
  EXPECT_TRUE(find_manoeuvres(study, pushes.starts, path, side_branches(), /*most_turns=*/0, {})
                  .found.empty());
}

TEST(Manoeuvres, StopWhenCancelled) {
  const Study study = into_the_branch();
  Candidate start;
  start.wire = 1;
  const Manoeuvres search = find_manoeuvres(study, {start}, path_into_the_branch(), side_branches(),
                                            3, {.cancelled = [] { return true; }});
  EXPECT_TRUE(search.found.empty());
  EXPECT_LT(search.branches, 10);
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
