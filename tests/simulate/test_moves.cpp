#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "simulate/insertion/trial.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

Wire straight_wire() {
  return {.name = "straight",
          .radius = 0.445,
          .sections = {{.length = 400.0, .bending_stiffness = 50.0}}};
}

Wire curved_wire() {
  return {.name = "curved",
          .radius = 0.445,
          .sections = {{.length = 12.0, .bending_stiffness = 10.0, .rest_curvature = 1.0 / 6.0},
                       {.length = 400.0, .bending_stiffness = 50.0}}};
}

/// Lumen of 4 mm radius that bends by 90 degrees round 40 mm, from +z to +x.
const VesselModel& bend() {
  static const VesselModel vessel(shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5),
                                  {.grid_spacing = 0.6});
  return vessel;
}
const VesselModel& straight() {
  static const VesselModel vessel(shapes::straight_tube(4.0, 100.0, 1.5), {.grid_spacing = 0.6});
  return vessel;
}

Introducer along_z(double roll = 0.0) {
  return {.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ(), .roll = roll};
}
const Goal kNowhere{.point = Vec3(0.0, 0.0, -1e3)};
InsertionOptions options(double friction = 0.0) {
  return {.length = 160.0, .step = 1.0, .element_length = 2.0, .friction = friction};
}

TrialResult make_moves(const Wire& wire, const VesselModel& vessel, const std::vector<Move>& moves,
                       const InsertionOptions& with = options(), double roll = 0.0) {
  Trial trial(wire, along_z(roll), kNowhere, vessel, with);
  for (const Move& move : moves) trial.make(move);
  return trial.finish();
}

double largest_difference(const TrialResult& a, const TrialResult& b) {
  EXPECT_EQ(a.nodes.cols(), b.nodes.cols());
  if (a.nodes.cols() != b.nodes.cols()) return INFINITY;
  return (a.nodes - b.nodes).colwise().norm().maxCoeff();
}

TEST(Moves, MayBeShorterThanAnElement) {
  for (const double length : {1e-3, 2.0}) {
    SCOPED_TRACE(length);
    InsertionOptions some = options();
    some.length = some.step = length;
    const TrialResult in = make_moves(curved_wire(), straight(), {{.push = length}}, some);
    EXPECT_EQ(in.outcome, Outcome::kMissed) << in.reason;
    const Vec3 tip = in.nodes.rightCols<1>();
    EXPECT_NEAR(tip.z(), 5.0 + length, 0.05 * length);
    EXPECT_LT(tip.head<2>().norm(), 0.01 + 0.2 * length);
  }
}

TEST(Moves, BringInTheWholeWire) {
  // As of a longer wire: what is in the introducer is straight.
  Wire whole = curved_wire();
  whole.sections.back() = {
      .length = 58.0, .bending_stiffness = 20.0, .proximal_bending_stiffness = 50.0};
  Wire longer = whole;
  longer.sections.push_back({.length = 100.0, .bending_stiffness = 50.0});
  InsertionOptions some = options(0.1);
  some.length = 70.0;
  for (const double element : {0.0, 2.0, 3.0, 15.0}) {  // 0: of each section its own
    SCOPED_TRACE(element);
    InsertionOptions some_whole = some, some_longer = some;
    if (element > 0.0) some_whole.element_length = some_longer.element_length = element;
    if (element == 0.0) some_whole.section_element_length = {1.0, 2.0};
    if (element == 0.0) some_longer.section_element_length = {1.0, 2.0, 2.0};
    EXPECT_EQ(longest_insertion(whole, some_whole), 70.0);
    const std::vector<Move> moves = {{.push = 70.0}, {.push = -10.0}};
    const TrialResult in = make_moves(whole, bend(), moves, some_whole);
    EXPECT_NEAR(in.pushes[69].insertion, 70.0, 1e-9);
    EXPECT_NEAR(in.pushes.back().insertion, 60.0, 1e-9);
    EXPECT_LT(largest_difference(in, make_moves(longer, bend(), moves, some_longer)), 1e-6);
  }
  some.length = 200.0;
  EXPECT_EQ(longest_insertion(whole, some), 70.0);
}

TEST(Moves, ComeBeforeTheLastPushOfATrial) {
  InsertionOptions some = options(0.1);
  some.length = 70.0;
  const auto trial_with = [&](const std::vector<Move>& moves) {
    return run_trial(curved_wire(), along_z(), kNowhere, bend(), some, moves);
  };
  EXPECT_EQ(trial_with({}).nodes, make_moves(curved_wire(), bend(), {{.push = 70.0}}, some).nodes);
  // They may go deeper than the trial ends.
  const TrialResult back = trial_with({{.push = 80.0}, {.turn = 0.5}, {.push = -30.0}});
  EXPECT_NEAR(back.pushes.back().insertion, 70.0, 1e-9);
  EXPECT_NEAR(back.pushes[79].insertion, 80.0, 1e-9);
  EXPECT_NEAR(back.pushes.back().hub_angle, 0.5, 1e-12);
  EXPECT_EQ(back.outcome, Outcome::kMissed);
}

TEST(Moves, PullingBackUndoesAPushWithoutFriction) {
  for (const Wire& wire : {straight_wire(), curved_wire()}) {
    SCOPED_TRACE(wire.name);
    const TrialResult there = make_moves(wire, bend(), {{.push = 70.0}});
    const TrialResult back = make_moves(wire, bend(), {{.push = 90.0}, {.push = -20.0}});
    ASSERT_EQ(back.pushes.size(), 110u);
    EXPECT_NEAR(back.pushes.back().insertion, 70.0, 1e-9);
    // A straight wire lies anywhere on the outer side of the bend, almost for free.
    EXPECT_LT(largest_difference(there, back), wire.name == "curved" ? 0.02 : 1.0);
    EXPECT_NEAR(there.pushes.back().push_force, back.pushes.back().push_force, 1e-3);
    EXPECT_NEAR(there.pushes.back().stored_energy, back.pushes.back().stored_energy, 1e-3);
  }
}

TEST(Moves, FrictionHoldsAgainstPushAndPull) {
  // The capstan: the same bend resists either way, so the hand's force lies about as far above the
  // frictionless one in pushing as below it in pulling.
  const double free =
      make_moves(straight_wire(), bend(), {{.push = 110.0}}).pushes.back().push_force;
  const TrialResult rubbed =
      make_moves(straight_wire(), bend(), {{.push = 112.0}, {.push = -2.0}}, options(0.2));
  const double pushed = rubbed.pushes[109].push_force, pulled = rubbed.pushes.back().push_force;
  EXPECT_NEAR(rubbed.pushes[109].insertion, rubbed.pushes.back().insertion, 1e-9);
  EXPECT_GT(pushed - free, 0.005);
  EXPECT_LT(pulled - free, -0.005);
  EXPECT_NEAR((pushed - free) / (free - pulled), 1.0, 0.3);  // by exp(mu theta) not quite the same
}

TEST(Moves, EveryMoveBalancesItsEnergy) {
  // Work of the hand = stored + heat + what jumps release, which is never negative.
  const std::vector<Move> moves = {
      {.push = 60.0}, {.turn = 0.5 * kPi}, {.push = -15.0}, {.turn = -0.25 * kPi}, {.push = 30.0}};
  for (const double friction : {0.0, 0.1}) {
    SCOPED_TRACE(friction);
    InsertionOptions fine = options(friction);
    fine.step = 0.25;
    const TrialResult trial = make_moves(curved_wire(), bend(), moves, fine);
    double most = 0.0;
    for (const Push& push : trial.pushes) {
      const double released = push.push_work - push.stored_energy - push.friction_work;
      most = std::max(most, push.stored_energy);
      EXPECT_GE(released, -0.03 * most) << push.insertion;
    }
    const Push& last = trial.pushes.back();
    const double released = last.push_work - last.stored_energy - last.friction_work;
    EXPECT_LT(released, 0.1 * most);  // no jump here
    EXPECT_GT(most, 0.1);
    EXPECT_NEAR(last.insertion, 75.0, 1e-9);
    EXPECT_NEAR(last.hub_angle, 0.25 * kPi, 1e-12);
  }
}

TEST(Moves, TurningTheHubTurnsACurvedTipAsEnteringItTurnedDoes) {
  const double angle = 70.0 * kRadPerDeg;
  const TrialResult entered =
                        make_moves(curved_wire(), straight(), {{.push = 30.0}}, options(), angle),
                    turned =
                        make_moves(curved_wire(), straight(), {{.push = 30.0}, {.turn = angle}});
  EXPECT_LT(largest_difference(entered, turned), 0.02);  // the tube has corners of its own
  EXPECT_NEAR(turned.pushes.back().hub_angle, angle, 1e-12);
  // In a round tube there is nothing to turn against.
  EXPECT_LT(std::abs(turned.pushes.back().hub_torque), 0.05);
}

TEST(Moves, TurnedWireComesBackIntoTheIntroducerAndOutAgainAsTurned) {
  const double angle = 0.5 * kPi;
  const TrialResult once =
      make_moves(curved_wire(), bend(), {{.push = 50.0}, {.turn = angle}, {.push = 30.0}});
  const TrialResult again = make_moves(
      curved_wire(), bend(), {{.push = 80.0}, {.turn = angle}, {.push = -70.0}, {.push = 70.0}});
  EXPECT_LT(largest_difference(once, again), 0.05);
  EXPECT_GT(once.pushes.back().stored_energy, 0.01);
  EXPECT_NEAR(once.pushes.back().stored_energy, again.pushes.back().stored_energy,
              0.01 * once.pushes.back().stored_energy);
}

TEST(Moves, ATipHeldInABendNeedsTorqueToTurn) {
  // Turned against the bend, the curved tip stores energy; the torque is its slope.
  const TrialResult trial =
      make_moves(curved_wire(), bend(), {{.push = 60.0}, {.turn = 0.5 * kPi}, {.turn = kPi}});
  double largest = 0.0;
  for (const Push& push : trial.pushes) largest = std::max(largest, std::abs(push.hub_torque));
  EXPECT_GT(largest, 0.05);
  EXPECT_EQ(trial.outcome, Outcome::kMissed) << trial.reason;
}

/// A wire with the rest curvature k in its last `tip`, led along an arc of curvature K: its roll
/// phi against the arc's plane obeys GJ phi'' = EI k K sin(phi) there, GJ phi'' = 0 before, from
/// the hub's roll to no torque at the tip. By Runge-Kutta's method, shooting from the tip.
struct Led {
  double GJ_shaft = 0.0, GJ_tip = 0.0, EI_tip = 0.0, k = 0.0, tip = 0.0;
  double arc = 0.0, K = 0.0;  // of the bend, which ends at the tip                [mm], [1/mm]

  /// Roll at the hub, of a shaft of the given length, and the torque there.
  std::pair<double, double> shoot(double tip_roll, double shaft) const {
    constexpr int kSteps = 400;
    const double h = tip / kSteps;
    double phi = tip_roll, torque = 0.0;  // toward the hub
    for (int i = 0; i < kSteps; ++i) {
      const auto slope = [&](double s, double at) {
        return s < arc ? EI_tip * k * K * std::sin(at) : 0.0;
      };
      const double s = i * h, middle = phi + 0.5 * h * torque / GJ_tip;
      const double torque_middle = torque + 0.5 * h * slope(s, phi);
      torque += h * slope(s + 0.5 * h, middle);
      phi += h * torque_middle / GJ_tip;
    }
    return {phi + torque * shaft / GJ_shaft, torque};
  }
  std::pair<double, double> at_hub(double hub_roll, double shaft) const {  // tip roll, torque
    double low = 0.0, high = hub_roll;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (shoot(middle, shaft).first < hub_roll ? low : high) = middle;
    }
    return {low, shoot(low, shaft).second};
  }
};

TEST(Moves, HubTorqueAndTipRollInABendAreThoseOfAPendulum) {
  // A lumen hardly wider than the wire leads it round 40 mm.
  const double radius = 40.0, lead_in = 20.0;
  const VesselModel vessel(shapes::bend_tube(0.53, radius, kPi, lead_in, 20.0, 0.4),
                           {.grid_spacing = 0.2});
  const Wire wire = {
      .name = "led",
      .radius = 0.5,
      .sections = {{.length = 60.0,
                    .bending_stiffness = 20.0,
                    .twist_stiffness = 15.0,
                    .rest_curvature = 1.0 / 60.0},
                   {.length = 200.0, .bending_stiffness = 50.0, .twist_stiffness = 40.0}}};
  const double depth = 125.0;
  const Led led{.GJ_shaft = 40.0,
                .GJ_tip = 15.0,
                .EI_tip = 20.0,
                .k = 1.0 / 60.0,
                .tip = 60.0,
                .arc = depth + 5.0 - lead_in,
                .K = 1.0 / radius};
  InsertionOptions with = options();
  with.length = depth;
  with.element_length = 1.0;
  with.record_terms = true;
  // The wire's zero roll is anterior, -y; the bend goes to +x, a quarter turn on.
  for (const double roll : {0.25 * kPi, 0.5 * kPi}) {
    SCOPED_TRACE(roll);
    const TrialResult result = run_trial(wire, along_z(0.5 * kPi + roll), kNowhere, vessel, with);
    ASSERT_EQ(result.outcome, Outcome::kMissed) << result.reason;
    ASSERT_EQ(result.push_terms.size(), result.pushes.size());
    const auto [tip_roll, torque] = led.at_hub(roll, depth - led.tip);
    EXPECT_GT(torque, 0.1);
    // What the wire's play in the lumen leaves: where it leaves the bend's plane its frames turn.
    EXPECT_NEAR(result.pushes.back().hub_torque, torque, 0.03 * torque);
    EXPECT_NEAR(result.push_terms.back().tip_roll - 0.5 * kPi, tip_roll, 0.03 * roll);
    // Each term by itself, and all that is stored together.
    const Energy& energy = result.push_terms.back().energy;
    EXPECT_NEAR(energy.total(), result.pushes.back().stored_energy, 1e-9);
    EXPECT_GT(energy.twist, 0.5 * torque * torque * (depth - led.tip) / led.GJ_shaft);
    EXPECT_LT(energy.twist,
              0.5 * torque * torque * ((depth - led.tip) / led.GJ_shaft + led.tip / led.GJ_tip));
    EXPECT_GT(energy.bend, 0.5);
    EXPECT_GE(energy.contact, 0.0);
    EXPECT_EQ(energy.wall, 0.0);
  }
}

TEST(Moves, AStraightRoundWireDoesNotFeelTheHub) {
  const TrialResult pushed = make_moves(straight_wire(), bend(), {{.push = 60.0}}),
                    turned = make_moves(straight_wire(), bend(), {{.push = 60.0}, {.turn = 1.0}});
  EXPECT_LT(largest_difference(pushed, turned), 1e-9);
  EXPECT_EQ(turned.pushes.back().hub_torque, 0.0);
}

TEST(Moves, PullingEndsBeforeTheWireIsOut) {
  const TrialResult trial =
      make_moves(straight_wire(), straight(), {{.push = 20.0}, {.push = -1000.0}, {.push = 5.0}});
  const auto least =
      std::min_element(trial.pushes.begin() + 20, trial.pushes.end(),
                       [](const Push& a, const Push& b) { return a.insertion < b.insertion; });
  EXPECT_NEAR(least->insertion, 1.0, 1e-9);  // a step stays in
  EXPECT_NEAR(trial.pushes.back().insertion, 6.0, 1e-9);
  EXPECT_EQ(trial.outcome, Outcome::kMissed);
}

TEST(Moves, PullingAndTurningAreNotStuck) {
  const TrialResult trial = make_moves(
      curved_wire(), straight(),
      {{.push = 40.0}, {.push = -15.0}, {.push = 15.0}, {.turn = 8.0 * kPi}, {.push = -15.0}});
  EXPECT_EQ(trial.outcome, Outcome::kMissed) << trial.reason;
  EXPECT_NEAR(trial.pushes.back().insertion, 25.0, 1e-9);
}

TEST(Moves, AMarkTakesATrialBack) {
  const Wire wire = curved_wire();
  const InsertionOptions with = options(0.1);
  Trial trial(wire, along_z(), kNowhere, bend(), with);
  trial.make({.push = 50.0});
  Trial::Mark mark;
  trial.save(mark);
  trial.make({.push = 30.0});
  trial.restore(mark);
  EXPECT_NEAR(trial.depth(), 50.0, 1e-9);
  EXPECT_EQ(trial.pushes().size(), 50u);
  trial.make({.turn = 0.5});
  trial.make({.push = 20.0});
  const TrialResult detour = trial.finish();
  const TrialResult direct =
      make_moves(wire, bend(), {{.push = 50.0}, {.turn = 0.5}, {.push = 20.0}}, with);
  ASSERT_EQ(detour.pushes.size(), direct.pushes.size());
  EXPECT_LT(largest_difference(detour, direct), 1e-3);  // both in equilibrium to 1e-6 N
  EXPECT_NEAR(detour.pushes.back().push_work, direct.pushes.back().push_work, 1e-4);
}

TEST(Moves, AMarkIsGoneOnToFromOneThatLiesBeforeIt) {
  // From the first mark the wire goes elsewhere, then it is taken to the second: all that was
  // recorded up to there is that of the way there, and none of the other.
  const Wire wire = curved_wire();
  InsertionOptions with = options(0.1);
  with.record_terms = true;
  Trial trial(wire, along_z(), kNowhere, bend(), with);
  Trial::Mark first, second;
  trial.make({.push = 40.0});
  trial.save(first);
  trial.make({.push = 20.0});
  trial.save(second);
  const std::vector<Push> way = trial.pushes();
  for (const double elsewhere : {30.0, 5.0}) {  // further than the second mark, and less far
    SCOPED_TRACE(elsewhere);
    trial.restore(first);
    trial.make({.turn = kPi});
    trial.make({.push = elsewhere});
    trial.restore(second);
    ASSERT_EQ(trial.pushes().size(), way.size());
    for (std::size_t k = 0; k < way.size(); ++k) {
      EXPECT_EQ(trial.pushes()[k].tip, way[k].tip) << k;
      EXPECT_EQ(trial.pushes()[k].peak_contact_force, way[k].peak_contact_force) << k;
    }
  }
  const TrialResult ended = trial.finish();
  EXPECT_EQ(ended.push_terms.size(), way.size());
  ASSERT_EQ(ended.shapes.size(), 12u);  // every 5 mm
  for (std::size_t k = 0; k < ended.shapes.size(); ++k) {
    EXPECT_NEAR(ended.shapes[k].insertion, 5.0 * static_cast<double>(k + 1), 1e-9);
    EXPECT_EQ(ended.shapes[k].hub_angle, 0.0);
  }
}

TEST(Moves, ShapesAreKeptOnTheWayBackToo) {
  const TrialResult trial =
      make_moves(curved_wire(), straight(), {{.push = 20.0}, {.push = -10.0}, {.turn = kPi}});
  // Every 5 mm of the hand's way, every 30 degrees of the hub.
  ASSERT_EQ(trial.shapes.size(), 4u + 2u + 6u);
  EXPECT_NEAR(trial.shapes[5].insertion, 10.0, 1e-9);
  EXPECT_NEAR(trial.shapes.back().hub_angle, kPi, 1e-12);
}

}  // namespace
}  // namespace wireplan::simulate
