#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "plan/metrics.h"

namespace wireplan::plan {
namespace {

using simulate::Outcome;
using simulate::Push;
using simulate::TrialResult;

/// A path along +z from 0 to 100 mm in one segment.
Centerline straight_path() {
  Centerline path;
  path.points.resize(3, 2);
  path.points.col(0) = Vec3::Zero();
  path.points.col(1) = Vec3(0.0, 0.0, 100.0);
  path.radius = Eigen::Vector2d(3.0, 5.0);
  path.arc_length = Eigen::Vector2d(0.0, 100.0);
  return path;
}

Study study_with_goal_at(const Vec3& point) {
  Study study;
  study.goal = {.point = point, .radius = 4.0};
  return study;
}

Push push_at(double insertion, double total_force) {
  Push push;
  push.insertion = insertion;
  push.total_contact_force = total_force;
  return push;
}

TEST(PushMetrics, ImpulseOfALinearForceIsExactOnUnevenPushes) {
  // f = 0.02 s N: the trapezoidal rule is exact for it, impulse 0.02 * 30^2 / 2.
  std::vector<Push> pushes;
  for (const double s : {1.0, 2.5, 7.0, 7.0, 18.0, 30.0}) pushes.push_back(push_at(s, 0.02 * s));
  const Metrics metrics = compute_push_metrics(pushes);
  EXPECT_NEAR(metrics.force_impulse, 9.0, 1e-14);       // rounding
  EXPECT_NEAR(metrics.mean_contact_force, 0.3, 1e-15);  // impulse over 30 mm
}

TEST(PushMetrics, ImpulseConvergesWithTheSquareOfThePush) {
  // f = sin(pi s / L): the impulse over L is 2 L / pi.
  const double length = 40.0, exact = 2.0 * length / kPi;
  double last_error = 0.0;
  for (const int count : {20, 40, 80}) {
    std::vector<Push> pushes;
    for (int k = 1; k <= count; ++k) {
      pushes.push_back(push_at(length * k / count, std::sin(kPi * k / count)));
    }
    const double error = std::abs(compute_push_metrics(pushes).force_impulse - exact);
    ASSERT_GT(error, 0.0);
    if (last_error > 0.0) {
      EXPECT_NEAR(last_error / error, 4.0, 0.02);  // the next term is (pi / 20)^2 / 60 of this one
    }
    last_error = error;
  }
}

TEST(PushMetrics, PeaksAreOverAllPushesAndIterationsAreSummed) {
  Push early = push_at(1.0, 0.4), late = push_at(2.0, 0.1);
  early.tip_force = 0.3;
  early.peak_contact_force = 0.2;
  early.push_force = -0.7;  // the introducer holds the wire back
  early.max_penetration = 0.01;
  early.residual = 2e-7;
  early.iterations = 5;
  late.tip_force = 0.1;
  late.peak_contact_force = 0.25;
  late.push_force = 0.5;
  late.peak_curvature = 0.05;
  late.residual = 1e-7;
  late.iterations = 3;
  const Metrics metrics = compute_push_metrics({early, late});
  EXPECT_EQ(metrics.insertion, 2.0);
  EXPECT_EQ(metrics.peak_tip_force, 0.3);
  EXPECT_EQ(metrics.peak_contact_force, 0.25);
  EXPECT_EQ(metrics.peak_push_force, 0.7);
  EXPECT_EQ(metrics.peak_curvature, 0.05);
  EXPECT_EQ(metrics.max_penetration, 0.01);
  EXPECT_EQ(metrics.residual, 2e-7);
  EXPECT_EQ(metrics.iterations, 8);
}

TEST(PushMetrics, WorkIsThatOfTheEndAndWhatIsMissingWasReleased) {
  Push early = push_at(1.0, 0.0), late = push_at(2.0, 0.0);
  early.push_work = 9.0;  // the wire jumped and pushed the hand back since
  early.stored_energy = 8.0;
  early.wall_displacement = 0.5;
  late.push_work = 6.0;
  late.stored_energy = 2.5;
  late.friction_work = 0.5;
  late.wall_displacement = 0.25;
  const Metrics metrics = compute_push_metrics({early, late});
  EXPECT_EQ(metrics.push_work, 6.0);
  EXPECT_EQ(metrics.friction_work, 0.5);
  EXPECT_EQ(metrics.energy_released, 3.0);
  EXPECT_EQ(metrics.peak_wall_displacement, 0.5);
}

TEST(PushMetrics, PullingBackCountsAsWayAndTurningDoesNot) {
  // In by 2 at 1 N in the mean, back by 1 at 2 N, turned to 4 N, in again by 1 at 3 N.
  const Metrics metrics = compute_push_metrics(
      {push_at(2.0, 2.0), push_at(1.0, 2.0), push_at(1.0, 4.0), push_at(2.0, 2.0)});
  EXPECT_EQ(metrics.force_impulse, 2.0 + 2.0 + 3.0);
  EXPECT_EQ(metrics.mean_contact_force, 7.0 / 4.0);
  EXPECT_EQ(metrics.insertion, 2.0);
}

TEST(Metrics, DeviationIsTheMeanDistanceToTheSegmentsAndTheirEnds) {
  // Beside the middle of the long segment 3 mm, past its end 5 mm, on it 0.
  TrialResult trial;
  trial.nodes.resize(3, 3);
  trial.nodes.col(0) = Vec3(3.0, 0.0, 50.0);
  trial.nodes.col(1) = Vec3(0.0, 0.0, 20.0);
  trial.nodes.col(2) = Vec3(0.0, 3.0, 104.0);
  const Metrics metrics = compute_metrics(trial, study_with_goal_at(Vec3::Zero()), straight_path());
  EXPECT_NEAR(metrics.centerline_deviation, 8.0 / 3.0, 1e-14);  // rounding
}

TEST(Metrics, DeviationAllowsForRepeatedPathPoints) {
  Centerline path = straight_path();
  path.points.conservativeResize(3, 3);
  path.points.col(2) = path.points.col(1);
  path.radius = Eigen::Vector3d(3.0, 5.0, 5.0);
  path.arc_length = Eigen::Vector3d(0.0, 100.0, 100.0);
  TrialResult trial;
  trial.nodes = Vec3(3.0, 0.0, 104.0);
  const Metrics metrics = compute_metrics(trial, study_with_goal_at(Vec3::Zero()), path);
  EXPECT_NEAR(metrics.centerline_deviation, 5.0, 1e-14);  // rounding
}

TEST(Metrics, OffPathIsTheFurthestPartOutsideTheBallsAlongThePath) {
  // The lumen's radius grows from 3 to 5 mm along the path.
  TrialResult trial;
  trial.nodes.resize(3, 3);
  trial.nodes.col(0) = Vec3(3.9, 0.0, 50.0);   // inside the 4 mm there
  trial.nodes.col(1) = Vec3(0.0, 10.0, 50.0);  // 6 mm outside
  trial.nodes.col(2) = Vec3(0.0, 0.0, 107.0);  // 2 mm past the last ball
  const Metrics metrics = compute_metrics(trial, study_with_goal_at(Vec3::Zero()), straight_path());
  EXPECT_NEAR(metrics.off_path, 6.0, 1e-14);  // rounding
}

TEST(Metrics, WallMotionIsThatWhichIsLargestForTheRadiusOfThePath) {
  // The path's radius grows from 3 to 5 mm along its 100 mm: 0.7 mm near its start are more of it
  // than 0.9 mm near its end.
  TrialResult trial;
  for (const auto& [z, displacement] : {std::pair(0.0, 0.3), {10.0, 0.7}, {90.0, 0.9}}) {
    Push push;
    push.insertion = z;
    push.wall_displacement = displacement;
    push.wall_displacement_point = Vec3(4.0, 0.0, z);
    trial.pushes.push_back(push);
  }
  const Metrics metrics = compute_metrics(trial, study_with_goal_at(Vec3::Zero()), straight_path());
  EXPECT_EQ(metrics.peak_wall_displacement, 0.9);
  EXPECT_EQ(metrics.wall_motion.displacement, 0.7);
  EXPECT_NEAR(metrics.wall_motion.radius, 3.2, 1e-14);  // rounding
  EXPECT_EQ(metrics.wall_motion.point, Vec3(4.0, 0.0, 10.0));
  EXPECT_TRUE(metrics.wall_motion.beyond_linear_theory());  // 0.7 / 3.2 = 0.22 is over 0.2

  trial.pushes[1].wall_displacement = 0.63;  // 0.197 of the radius
  EXPECT_FALSE(compute_metrics(trial, study_with_goal_at(Vec3::Zero()), straight_path())
                   .wall_motion.beyond_linear_theory());
  EXPECT_FALSE(WallMotion().beyond_linear_theory()) << "a rigid wall";
}

TEST(Metrics, NearestDistanceIsOverAllPushesAndTheEnd) {
  TrialResult trial;
  for (const double z : {20.0, 62.0, 75.0}) {
    Push push = push_at(z, 0.0);
    push.tip = Vec3(0.0, 0.0, z);
    trial.pushes.push_back(push);
  }
  const Study study = study_with_goal_at(Vec3(0.0, 0.0, 60.0));
  EXPECT_EQ(compute_metrics(trial, study, straight_path()).nearest_to_target, 2.0);
  EXPECT_EQ(compute_metrics(trial, study, straight_path()).tip_to_target, 15.0);
}

TEST(Metrics, OfAVesselThatMovesAreThoseOfTheVesselAtRest) {
  // The wire has carried the vessel 3 mm to the side and 1 mm on; at rest it lies on the path.
  const Vec3 carried(3.0, 0.0, 1.0);
  TrialResult moved, at_rest;
  for (const double z : {20.0, 58.0, 75.0}) {
    Push push = push_at(z, 0.0);
    push.tip = Vec3(0.0, 0.0, z);
    at_rest.pushes.push_back(push);
    moved.tips_at_rest.push_back(push.tip);
    push.tip += carried;
    moved.pushes.push_back(push);
  }
  at_rest.nodes.resize(3, 2);
  at_rest.nodes << 0.0, 0.0, 0.0, 0.0, 0.0, 75.0;
  moved.nodes_at_rest = at_rest.nodes;
  moved.nodes = at_rest.nodes.colwise() + carried;
  const Study study = study_with_goal_at(Vec3(0.0, 0.0, 60.0));
  const Metrics found = compute_metrics(moved, study, straight_path()),
                expected = compute_metrics(at_rest, study, straight_path());
  EXPECT_EQ(found.nearest_to_target, 2.0);
  EXPECT_EQ(found.tip_to_target, 15.0);
  EXPECT_EQ(found.centerline_deviation, expected.centerline_deviation);
  EXPECT_EQ(find_progress(moved, study, straight_path()),
            find_progress(at_rest, study, straight_path()));
  EXPECT_EQ(measure(moved, study, straight_path()).last_tip, at_rest.pushes.back().tip);
  simulate::ToolTrack track;
  track.name = "catheter";
  track.insertion = {20.0, 40.0, 50.0};
  track.tip_force = track.wall_force = track.push_force = track.hub_torque = {0.0, 0.0, 0.0};
  moved.tools = at_rest.tools = {track};
  EXPECT_NEAR(compute_tool_metrics(at_rest, study, straight_path())[0].progress, 50.0, 1e-9);
  EXPECT_NEAR(compute_tool_metrics(moved, study, straight_path())[0].progress, 50.0, 1e-9);
  moved.tools.clear();
  moved.tips_at_rest.clear();
  moved.nodes_at_rest.resize(3, 0);
  EXPECT_NE(compute_metrics(moved, study, straight_path()).tip_to_target, 15.0);
}

TEST(Metrics, TipDistanceIsThatOfTheLastNode) {
  TrialResult trial;
  trial.outcome = Outcome::kReached;
  trial.nodes.resize(3, 2);
  trial.nodes.col(0) = Vec3::Zero();
  trial.nodes.col(1) = Vec3(0.0, 0.0, 97.0);
  const Metrics metrics =
      compute_metrics(trial, study_with_goal_at(Vec3(0.0, 0.0, 100.0)), straight_path());
  EXPECT_TRUE(metrics.reached);
  EXPECT_NEAR(metrics.tip_to_target, 3.0, 1e-14);  // rounding
}

TEST(Metrics, ATrialWithoutAPushLiesAtTheAccessFreeOfForce) {
  Study study = study_with_goal_at(Vec3(0.0, 0.0, 100.0));
  study.access = Vec3(0.0, 0.0, 40.0);
  const Metrics metrics = compute_metrics(TrialResult{}, study, straight_path());
  EXPECT_FALSE(metrics.reached);
  EXPECT_NEAR(metrics.tip_to_target, 60.0, 1e-14);  // rounding
  EXPECT_EQ(metrics.insertion, 0.0);
  EXPECT_EQ(metrics.force_impulse, 0.0);
  EXPECT_EQ(metrics.mean_contact_force, 0.0);
  EXPECT_EQ(metrics.centerline_deviation, 0.0);
}

/// Insertions and rolls of catheter and wire, push by push.
TrialResult script_of(const std::vector<std::array<double, 4>>& records) {
  TrialResult trial;
  trial.tools.resize(2);
  for (const auto& [catheter, turned, wire, wire_turned] : records) {
    trial.pushes.push_back(push_at(std::max(catheter, wire), 0.0));
    for (simulate::ToolTrack& track : trial.tools) {
      track.push_force.push_back(-0.2 * static_cast<double>(trial.pushes.size()));
      track.hub_torque.push_back(0.5);
      track.tip_force.push_back(0.0);
      track.wall_force.push_back(0.0);
    }
    trial.tools[0].insertion.push_back(catheter);
    trial.tools[0].roll.push_back(turned);
    trial.tools[1].insertion.push_back(wire);
    trial.tools[1].roll.push_back(wire_turned);
  }
  return trial;
}

TEST(ScriptMetrics, CountMovesByWhatGoesWhere) {
  // Wire on, catheter on, wire back, turned, both back, turned the other way.
  TrialResult trial = script_of({{0, 0, 20, 0},
                                 {0, 0, 40, 0},
                                 {15, 0, 40, 0},
                                 {30, 0, 40, 0},
                                 {30, 0, 20, 0},
                                 {30, 0.3, 20, 0},
                                 {30, 0.6, 20, 0},
                                 {25, 0.6, 15, 0},
                                 {25, 0.2, 15, 0}});
  trial.support = {.push = 0.7, .more = true};
  Study study = study_with_goal_at(Vec3(0.0, 0.0, 90.0));
  study.catheters.resize(1);
  const ScriptMetrics script = compute_script_metrics(trial, study, straight_path());
  EXPECT_EQ(script.moves, 6);
  EXPECT_DOUBLE_EQ(script.hand_force, 1.8) << "of either tool, held back too";
  EXPECT_DOUBLE_EQ(script.hub_torque, 0.5);
  EXPECT_EQ(script.wire_beyond, 0.0) << "the wire is in the catheter";
  EXPECT_EQ(script.hook_depth, 0.0) << "no branch is taken";
  EXPECT_EQ(script.support, 0.7);
  EXPECT_TRUE(script.bears_more);
}

TEST(ScriptMetrics, OfAWireAloneHaveItsMovesAndItsHand) {
  TrialResult trial;
  const auto add = [&](double insertion, double turned, double force) {
    Push& push = trial.pushes.emplace_back(push_at(insertion, 0.0));
    push.hub_angle = turned;
    push.push_force = force;
    push.hub_torque = -0.25 * turned;
  };
  add(10.0, 0.0, 0.1);
  add(20.0, 0.0, 0.4);
  add(20.0, 2.0, 0.0);
  add(30.0, 2.0, -0.6);
  add(25.0, 2.0, 0.0);
  Study study = study_with_goal_at(Vec3(0.0, 0.0, 90.0));
  EXPECT_FALSE(measure(trial, study, straight_path()).metrics.script);
  study.catheters.resize(1);
  const Measured measured = measure(trial, study, straight_path());
  ASSERT_TRUE(measured.metrics.script);
  EXPECT_EQ(measured.metrics.script->moves, 4);
  EXPECT_EQ(measured.metrics.script->hand_force, 0.6);
  EXPECT_EQ(measured.metrics.script->hub_torque, 0.5);
  EXPECT_EQ(measured.metrics.script->support, 0.0);
}

}  // namespace
}  // namespace wireplan::plan
