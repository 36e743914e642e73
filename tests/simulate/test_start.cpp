// Insertions that start from a line: the line itself, the equilibrium nearest to it, and what the
// hand does from there on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "simulate/equilibrium/solver.h"
#include "simulate/insertion/scene.h"
#include "simulate/insertion/trial.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

Wire plain_wire() {
  return {
      .name = "plain", .radius = 0.445, .sections = {{.length = 400.0, .bending_stiffness = 50.0}}};
}

Wire hooked_wire() {
  return {.name = "hooked",
          .radius = 0.445,
          .sections = {{.length = 12.0, .bending_stiffness = 10.0, .rest_curvature = 1.0 / 6.0},
                       {.length = 400.0, .bending_stiffness = 50.0}}};
}

/// Lumen of 4 mm radius that bends by 90 degrees round 40 mm, from +z to +x.
const VesselModel& bent_tube() {
  static const VesselModel vessel(shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5),
                                  {.grid_spacing = 0.6});
  return vessel;
}

const Goal kNoGoal{.point = Vec3(0.0, 0.0, -1e3)};

Introducer up_z(double roll = 0.0) {
  return {.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ(), .roll = roll};
}

InsertionOptions start_options(double friction = 0.0, double length = 160.0) {
  return {.length = length, .step = 1.0, .element_length = 2.0, .friction = friction};
}

/// Pushed straight in.
TrialResult pushed(const Wire& wire, double length, double roll = 0.0, double friction = 0.0) {
  Trial trial(wire, up_z(roll), kNoGoal, bent_tube(), start_options(friction));
  trial.make({.push = length});
  return trial.finish();
}

/// Laid along the line, then moved.
TrialResult started(const Wire& wire, const StartLine& line, const std::vector<Move>& moves = {},
                    double roll = 0.0, double friction = 0.0) {
  Trial trial(wire, up_z(roll), kNoGoal, bent_tube(), start_options(friction));
  trial.start(line);
  for (const Move& move : moves) trial.make(move);
  return trial.finish();
}

double most_apart(const TrialResult& a, const TrialResult& b) {
  EXPECT_EQ(a.nodes.cols(), b.nodes.cols());
  if (a.nodes.cols() != b.nodes.cols()) return INFINITY;
  return (a.nodes - b.nodes).colwise().norm().maxCoeff();
}

Eigen::Matrix3Xd points(const std::vector<Vec3>& list) {
  Eigen::Matrix3Xd matrix(3, static_cast<Eigen::Index>(list.size()));
  for (std::size_t k = 0; k < list.size(); ++k) matrix.col(static_cast<Eigen::Index>(k)) = list[k];
  return matrix;
}

// ---------------------------------------------------------------- lines

TEST(StartLine, BeginsAtItsPlaceNearestToTheEntry) {
  const Eigen::Matrix3Xd line =
      points({Vec3(0, 0, 0), Vec3(10, 0, 0), Vec3(10, 10, 0), Vec3(10, 10, 5)});
  EXPECT_EQ(arc_length(line), 25.0);
  const Eigen::Matrix3Xd inside = line_from_entry(line, Vec3(4.0, 1.0, 0.0));
  EXPECT_EQ(inside, points({Vec3(4, 1, 0), Vec3(10, 0, 0), Vec3(10, 10, 0), Vec3(10, 10, 5)}));
  const Eigen::Matrix3Xd behind = line_from_entry(line, Vec3(-2.0, 0.0, 0.0));
  ASSERT_EQ(behind.cols(), 5);
  EXPECT_EQ(behind.rightCols(4), line);
  EXPECT_EQ(point_at_arc(line, 12.0), Vec3(10.0, 2.0, 0.0));
  EXPECT_EQ(point_at_arc(line, 27.0), Vec3(10.0, 10.0, 7.0)) << "straight on beyond its end";
}

TEST(StartLine, DistanceIsThatOfLinesByTheirLength) {
  // Parallel, 3 mm apart, one 10 mm longer: its end is as far from the other's as Pythagoras says.
  const Eigen::Matrix3Xd a = points({Vec3(0, 0, 0), Vec3(5, 0, 0), Vec3(20, 0, 0)});
  const Eigen::Matrix3Xd b = points({Vec3(0, 3, 0), Vec3(20, 3, 0)});
  const LineDistance same = find_distance(a, b);
  EXPECT_NEAR(same.mean, 3.0, 1e-12);
  EXPECT_NEAR(same.largest, 3.0, 1e-12);
  EXPECT_NEAR(same.tip, 3.0, 1e-12);
  const LineDistance longer = find_distance(a, points({Vec3(0, 3, 0), Vec3(30, 3, 0)}));
  EXPECT_NEAR(longer.largest, std::hypot(10.0, 3.0), 1e-12);
  EXPECT_NEAR(longer.tip, std::hypot(10.0, 3.0), 1e-12);
  EXPECT_EQ(nearest_on_line(b, Vec3(7.0, 9.0, 1.0)), Vec3(7.0, 3.0, 0.0));
}

TEST(StartLine, PointsThroughTheWallComeBackToIt) {
  Eigen::Matrix3Xd line = points(
      {Vec3(0.0, 0.0, 10.0), Vec3(3.9, 0.0, 15.0), Vec3(5.5, 0.0, 20.0), Vec3(0.0, -9.0, 25.0)});
  bring_into_lumen(bent_tube().lumen, 0.445, 0, line);
  EXPECT_EQ(line.col(0), Vec3(0.0, 0.0, 10.0)) << "the lumen's middle";
  // The tube is a prism, a little inside of its circle, and the field smooth.
  for (const int k : {1, 2, 3}) EXPECT_NEAR(line.col(k).head<2>().norm(), 3.55, 0.1) << k;
  EXPECT_LT(line(1, 3), 0.0) << "beyond the field it comes straight back";
}

// ---------------------------------------------------------------- equilibria

TEST(Springs, HoldABeamAsAnElasticFoundationDoes) {
  // Hetenyi: a long beam on a foundation k, pulled at its free end by P: there
  // y = 2 P b / k with b = (k / 4 EI)^(1/4).
  const double EI = 50.0, k = 0.01, P = 1e-4, length = 200.0;
  const Wire wire = {
      .name = "beam", .radius = 0.445, .sections = {{.length = length, .bending_stiffness = EI}}};
  const Rod rod = build_rod(wire, length, 400);
  RodState state = straight_state(rod, Vec3::Zero(), Vec3::UnitX(), 0.0);
  Springs springs{.place = state.x, .stiffness = k * rod.share};
  const int n = rod.nodes();
  springs.stiffness[0] = springs.stiffness[n - 1] = 0.5 * k * rod.rest_length[0];
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, n);
  load(1, n - 1) = P;
  Problem problem;
  problem.rod = &rod;
  problem.last = n;
  problem.springs = &springs;
  problem.load = &load;
  Statics statics;
  ASSERT_TRUE(statics.solve(problem, state, {.residual_tolerance = 1e-10}).converged);
  const double b = std::pow(k / (4.0 * EI), 0.25), y = 2.0 * P * b / k;
  EXPECT_NEAR(state.x(1, n - 1), y, 1e-3 * y);
  EXPECT_NEAR(state.x(1, 0), 0.0, 1e-3 * y) << "long enough";
}

TEST(Start, AnEquilibriumsOwnNodesGiveItBack) {
  for (const Wire& wire : {plain_wire(), hooked_wire()}) {
    SCOPED_TRACE(wire.name);
    const TrialResult there = pushed(wire, 70.0, 0.4);
    const TrialResult back = started(wire, {.nodes = there.nodes, .length = 70.0}, {}, 0.4);
    ASSERT_TRUE(back.start);
    ASSERT_EQ(back.pushes.size(), 1u);
    EXPECT_EQ(back.start->nodes, back.nodes);
    // A straight wire lies anywhere on the outer side of the bend, almost for free.
    EXPECT_LT(most_apart(there, back), wire.name == "hooked" ? 0.02 : 0.3);
    EXPECT_NEAR(back.pushes[0].stored_energy, there.pushes.back().stored_energy, 1e-3);
    EXPECT_EQ(back.pushes[0].insertion, 70.0);
    EXPECT_EQ(back.pushes[0].push_work, back.pushes[0].stored_energy);
    EXPECT_LE(back.pushes[0].residual, 1e-6);
    EXPECT_EQ(back.roll, 0.4);
  }
}

TEST(Start, FrictionKeepsAWireNearerToItsLine) {
  // Drawn along the inner side of the bend, where only friction could hold a wire.
  std::vector<Vec3> inner;
  for (double z = 5.0; z < 40.0; z += 2.5) inner.emplace_back(0.0, 0.0, z);
  for (int k = 0; k <= 18; ++k) {
    const double angle = 0.5 * kPi * k / 18.0;
    inner.emplace_back(40.0 - 38.0 * std::cos(angle), 0.0, 40.0 + 38.0 * std::sin(angle));
  }
  const StartLine line{.nodes = points(inner)};
  double before = INFINITY;
  for (const double friction : {0.0, 0.3, 1.0}) {
    const TrialResult found = started(plain_wire(), line, {}, 0.0, friction);
    ASSERT_TRUE(found.start) << found.reason;
    const double off = find_distance(found.start->nodes, line.nodes).mean;
    EXPECT_LT(off, before) << friction;
    EXPECT_LE(found.pushes[0].residual, 1e-6);
    before = off;
  }
}

TEST(Start, TheLineTellsTheRollOfACurvedTip) {
  for (const double roll : {-2.0, 0.3, 1.5}) {
    const TrialResult there = pushed(hooked_wire(), 30.0, roll);
    const TrialResult found =
        started(hooked_wire(), {.nodes = there.nodes, .length = 30.0, .find_roll = true}, {}, 0.1);
    ASSERT_TRUE(found.start);
    EXPECT_NEAR(std::remainder(found.roll - roll, 2.0 * kPi), 0.0, 0.02) << roll;
    EXPECT_LT(most_apart(there, found), 0.05) << roll;
  }
}

TEST(Start, ALineThroughTheWallIsBroughtIn) {
  const TrialResult there = pushed(hooked_wire(), 90.0);
  StartLine line{.nodes = there.nodes.colwise() + Vec3(-1.5, 0.8, 0.0), .length = 90.0};
  const TrialResult found = started(hooked_wire(), line);
  ASSERT_TRUE(found.start) << found.reason;
  EXPECT_EQ(found.outcome, Outcome::kMissed) << found.reason;
  EXPECT_LT(found.pushes[0].max_penetration, 0.1);
  EXPECT_LT(find_distance(found.start->nodes, line.nodes).mean, 2.0);
}

TEST(Start, SpacingOfTheLineDoesNotMatter) {
  const TrialResult there = pushed(hooked_wire(), 80.0);
  Eigen::Matrix3Xd fine(3, 2 * there.nodes.cols() - 1);
  for (Eigen::Index k = 0; k < there.nodes.cols(); ++k) {
    fine.col(2 * k) = there.nodes.col(k);
    if (k > 0) fine.col(2 * k - 1) = 0.5 * (there.nodes.col(k - 1) + there.nodes.col(k));
  }
  const TrialResult one = started(hooked_wire(), {.nodes = there.nodes, .length = 80.0});
  const TrialResult other = started(hooked_wire(), {.nodes = fine, .length = 80.0});
  EXPECT_LT(most_apart(one, other), 1e-4);
}

TEST(Start, MovesGoOnFromThereAsFromAPush) {
  const TrialResult there = pushed(hooked_wire(), 60.0);
  const StartLine line{.nodes = there.nodes, .length = 60.0};
  EXPECT_LT(most_apart(started(hooked_wire(), line, {{.push = 25.0}}), pushed(hooked_wire(), 85.0)),
            0.05);
  EXPECT_LT(
      most_apart(started(hooked_wire(), line, {{.push = -20.0}}), pushed(hooked_wire(), 40.0)),
      0.05);
  // There and back again, with a turn and its opposite between.
  const TrialResult back =
      started(hooked_wire(), line,
              {{.push = 15.0}, {.turn = 0.6}, {.push = 5.0}, {.turn = -0.6}, {.push = -20.0}});
  EXPECT_LT(most_apart(back, there), 0.05);
  EXPECT_NEAR(back.pushes.back().insertion, 60.0, 1e-9);
  // Work of the hand = stored + what jumps released, which is none here.
  const Push& last = back.pushes.back();
  EXPECT_NEAR(last.push_work - last.stored_energy - last.friction_work, 0.0,
              0.1 * last.stored_energy);
}

TEST(Start, AMoveTurnsTheHubAsItPushes) {
  const auto move = [](const std::vector<Move>& moves) {
    Trial trial(hooked_wire(), up_z(), kNoGoal, bent_tube(), start_options());
    for (const Move& one : moves) trial.make(one);
    return trial.finish();
  };
  std::vector<Move> apart = {{.push = 30.0}};
  for (int k = 0; k < 20; ++k) {
    apart.push_back({.push = 1.0});
    apart.push_back({.turn = 0.05});
  }
  const TrialResult both = move({{.push = 30.0}, {.push = 20.0, .turn = 1.0}});
  EXPECT_EQ(both.nodes, move(apart).nodes);
  EXPECT_NEAR(both.pushes.back().insertion, 50.0, 1e-9);
  EXPECT_NEAR(both.pushes.back().hub_angle, 1.0, 1e-12);
  // A great turn beside a short pull takes steps of 15 degrees.
  const TrialResult turned = move({{.push = 30.0}, {.push = -2.0, .turn = -kPi}});
  EXPECT_EQ(turned.pushes.size(), 30u + 2u * 12u);
  EXPECT_NEAR(turned.pushes.back().insertion, 28.0, 1e-9);
  EXPECT_NEAR(turned.pushes.back().hub_angle, -kPi, 1e-12);
}

TEST(Gravity, BendsAnInsertedWireAsAClampedOneOnTheBench) {
  // In a tube so wide that nothing touches. 5 g/m, 60 mm: some millimetres down.
  const VesselModel wide(shapes::straight_tube(15.0, 100.0, 4.0), {.grid_spacing = 1.0});
  const Wire wire = {
      .name = "heavy",
      .radius = 0.445,
      .sections = {{.length = 80.0, .bending_stiffness = 30.0, .mass_per_length = 5e-9}}};
  InsertionOptions with_weight = start_options(0.0, 60.0);
  with_weight.element_length = 1.0;
  with_weight.gravity = Vec3(9810.0, 0.0, 0.0);
  Trial trial(wire, up_z(), kNoGoal, wide, with_weight);
  trial.make({.push = 60.0});
  const TrialResult pushed_in = trial.finish();
  Scene bench;
  bench.wire = wire;
  bench.elements = 60;
  bench.wire.sections[0].length = 60.0;
  bench.supports = {{.point = up_z().point, .direction = up_z().direction}};
  bench.loads.gravity = with_weight.gravity;
  const SceneResult clamped = run_scene(bench);
  ASSERT_EQ(clamped.outcome, SceneOutcome::kConverged);
  const Vec3 tip = clamped.nodes.rightCols<1>();
  EXPECT_GT(tip.x(), 2.0);
  EXPECT_LT((pushed_in.nodes.rightCols<1>() - tip).norm(), 0.02 * tip.x());
  // Work of the hand = stored: nothing rubs and nothing jumps.
  const Push& last = pushed_in.pushes.back();
  EXPECT_LT(last.stored_energy, -1e-3) << "it fell";
  EXPECT_NEAR(last.push_work, last.stored_energy, 0.02 * std::abs(last.stored_energy));
  EXPECT_LE(std::abs(last.unbalanced), 0.01 * std::abs(last.stored_energy));
  EXPECT_EQ(pushed_in.terms, (std::vector<std::string>{"stretch", "bend", "gravity", "contact"}));
}

}  // namespace
}  // namespace wireplan::simulate
