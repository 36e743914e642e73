// Scenes of one wire in a vessel: what floor, clamp and friction carry.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "simulate/insertion/insertion.h"
#include "simulate/insertion/scene.h"
#include "tests/shapes.h"
#include "tests/simulate/contact_bench.h"

namespace wireplan::simulate {
namespace {

// ---------------------------------------------------------------- scenes

Scene wire_on_the_floor(const VesselModel& vessel, double friction) {
  Scene scene;
  scene.wire = round_wire(40.0, 0.5, 100.0);
  scene.wire.sections[0].mass_per_length = 1e-7;
  scene.elements = 20;
  scene.supports = {{.at = WireEnd::kProximal,
                     .kind = SupportKind::kClamped,
                     .point = Vec3(-20.0, 0.0, 0.547)}};  // as high as it will lie
  scene.loads.gravity = Vec3(0.0, 0.0, -9810.0);
  scene.vessel = &vessel;
  scene.contact.friction = friction;
  scene.solver.load_steps = 2;
  return scene;
}

const VesselModel& floor_box() {
  static const VesselModel vessel(shapes::box(Vec3(-40.0, -40.0, 0.0), Vec3(40.0, 40.0, 30.0)),
                                  {.grid_spacing = 2.0, .band = 4.0});
  return vessel;
}

TEST(SceneWithAVessel, FloorAndClampCarryTheWeight) {
  const SceneResult result = run_scene(wire_on_the_floor(floor_box(), 0.0));
  ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
  EXPECT_EQ(result.terms, (std::vector<std::string>{"stretch", "bend", "gravity", "contact"}));
  const double weight = 40.0 * 1e-7 * 9810.0;
  double carried = result.reactions.at(0).force.z();
  EXPECT_LT(std::abs(carried), 0.05 * weight);
  for (const Touch& touch : result.contacts) {
    EXPECT_TRUE(touch.normal.isApprox(Vec3::UnitZ(), 1e-4));
    carried += touch.normal_force;
  }
  // Every millimetre, and every half of one in the last 20 mm; nodes among them.
  ASSERT_EQ(result.contacts.size(), 61u);
  for (std::size_t k = 0; k < 61; ++k) {
    const double expected =
        k <= 20 ? 40.0 - static_cast<double>(k) : 0.5 * static_cast<double>(60 - k);
    EXPECT_NEAR(result.contacts[k].tip_distance, expected, 1e-9);
  }
  EXPECT_NEAR(carried, weight, 21 * 1e-6);  // residual of each node
  EXPECT_GT(result.energy.contact, 0.0);
  EXPECT_EQ(result.friction_work, 0.0);
}

TEST(SceneWithAVessel, FrictionAloneHoldsAWireAgainstAPull) {
  const double friction = 0.2, weight = 40.0 * 1e-7 * 9810.0, pull = 0.7 * friction * weight;
  Scene scene = wire_on_the_floor(floor_box(), friction);
  scene.supports[0].kind = SupportKind::kGuided;
  scene.loads.tip_force = Vec3(pull, 0.0, 0.0);
  const SceneResult result = run_scene(scene);
  ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
  EXPECT_EQ(result.terms, (std::vector<std::string>{"stretch", "bend", "gravity", "tip_force",
                                                    "contact", "friction"}));
  Vec3 held = Vec3::Zero();
  for (const Touch& touch : result.contacts) held += touch.friction;
  EXPECT_NEAR(held.x(), -pull, 21 * 1e-6);  // residual of each node
  EXPECT_LT(result.nodes(0, 0) + 20.0, scene.contact.slip);
  EXPECT_EQ(result.friction_work, 0.0);
}

TEST(SceneWithAVessel, AStretchedWireRubsAlongTheFloor) {
  // Clamped, and pulled by more than friction can hold: it slips but next to the clamp, where it
  // moves by less than the slip.
  const double friction = 0.2, weight = 40.0 * 1e-7 * 9810.0, pull = 2.0 * friction * weight;
  Scene scene = wire_on_the_floor(floor_box(), friction);
  scene.wire.sections[0].axial_stiffness = 1.0;
  scene.loads.tip_force = Vec3(pull, 0.0, 0.0);
  const SceneResult result = run_scene(scene);
  ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
  Vec3 held = Vec3::Zero();
  for (const Touch& touch : result.contacts) held += touch.friction;
  EXPECT_NEAR(held.x() + result.reactions.at(0).force.x() + pull, 0.0, 21 * 1e-6);
  EXPECT_LT(held.x(), -0.85 * friction * weight);
  EXPECT_GE(held.x(), -friction * weight - 21 * 1e-6);
  EXPECT_GT(result.friction_work, 0.0);
  EXPECT_LT(result.friction_work, pull * (result.nodes(0, 20) - 20.0));
}

// ---------------------------------------------------------------- a wire end-on at a wall

TEST(EndOn, AStraightWireIsNotPushedAside) {
  // Head first against a flat wall that lies askew to the grid of its distances, up to three
  // quarters of the load at which it would buckle: its tip held by friction, or free to slide.
  const double EI = 50.0, radius = 0.4, free_length = 25.0;
  for (const Vec3& axis : {Vec3(0.0, 0.0, 1.0), Vec3(1.0, 2.0, -1.0), Vec3(-3.0, 1.0, 0.5)}) {
    for (const double friction : {0.0, 0.3}) {
      SCOPED_TRACE(std::to_string(axis.x()) + ", friction " + std::to_string(friction));
      const double buckling =
          (friction > 0.0 ? 20.19 : 0.25 * kPi * kPi) * EI / (free_length * free_length);
      const Mat3 R = Eigen::AngleAxisd(1.1, axis.normalized()).toRotationMatrix();
      Surface walls = shapes::divided_box(Vec3(-20.0, -20.0, 0.0), Vec3(20.0, 20.0, 30.0), 6);
      walls.vertices = R * walls.vertices;
      const VesselModel vessel(walls, {.grid_spacing = 0.7});
      const Vec3 along = R * Vec3::UnitZ();
      Insertion insertion(
          round_wire(60.0, radius, EI),
          {.point = R * Vec3(0.7, -0.4, 30.0 - radius - free_length), .direction = along}, vessel,
          {.length = 40.0, .friction = friction});
      ASSERT_TRUE(insertion.push(free_length - 0.05));
      double pressed = 0.0;
      while (pressed < 0.75 * buckling && insertion.depth() < free_length + 2.0) {
        ASSERT_TRUE(insertion.push(0.005));
        const Vec3 force = insertion.forces().rowwise().sum();
        pressed = -force.dot(along);
        // The distances' error tilts their gradient by 1e-6 at most; the solve leaves 1e-6 N.
        EXPECT_LT((force + pressed * along).norm(), 2e-6 + 1e-5 * pressed);
        const Vec3 aside = insertion.tip() - R * Vec3(0.7, -0.4, 0.0);
        EXPECT_LT((aside - aside.dot(along) * along).norm(), 1e-3);
      }
      EXPECT_GE(pressed, 0.75 * buckling);  // it did press
    }
  }
}

// ---------------------------------------------------------------- V15: a rod that buckles in a
// tube

TEST(BuckledInATube, TouchesInOnePlaceThenAlongALineAsTheoryHasIt) {
  // A pinned rod of length 2 l under a thrust P in a tube with clearance r, in a plane through the
  // axis (the first contact of Dayan, Durban and Givli 2022, references-2 V15). Where it touches in
  // one place, y = A sin kx - A k x cos kl with k^2 = P/EI has y(l) = r and y'(l) = 0: the wall
  // pushes with F = -2 P r k cos kl/(sin kl - k l cos kl), from none at Euler's load, kl = pi/2,
  // until the rod lies straight there, kl = pi, at four times that. Beyond, it lies along the wall
  // but for pi/k at either end, and the wall pushes with 2 P r k/pi.
  const double EI = 1000.0, length = 200.0, half = 0.5 * length, r = 1.0, radius = 0.25;
  const double euler = EI * std::pow(kPi / length, 2);
  const VesselModel vessel(long_tube(r + radius, length + 20.0, 64), {.grid_spacing = 0.4});
  for (const double times : {1.2, 2.0, 3.0, 3.9, 6.0, 9.0}) {
    SCOPED_TRACE(times);
    const double thrust = times * euler, k = std::sqrt(thrust / EI);
    const double c = std::cos(k * half), s = std::sin(k * half);
    const double expected =
        times < 4.0 ? -2.0 * thrust * r * k * c / (s - k * half * c) : 2.0 * thrust * r * k / kPi;
    Bench bench(
        round_wire(length, radius, EI), 100, vessel,
        {.law = {LinearLaw{.stiffness = 20.0, .smoothing = 1e-4}}, .spacing = 2.0},
        [&](double arc) { return Vec3(r * std::sin(kPi * arc / length), 0.0, 10.0 + arc); });
    bench.problem.proximal = pinned();
    bench.problem.distal = held_across(Vec3::UnitZ());
    bench.problem.plane = Vec3::UnitY();
    Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, bench.rod.nodes());
    load(2, bench.rod.nodes() - 1) = -thrust;
    bench.problem.load = &load;
    const NewtonResult solve = bench.solve(1e-8);
    ASSERT_TRUE(solve.converged) << solve.residual;
    const std::vector<Touch> touches = bench.contact.touches();
    const auto all = [](const Touch&) { return true; };
    EXPECT_NEAR(normal_force(touches, all), expected, 0.02 * expected);
    // Where it lies along the wall, that pushes at both ends of the line.
    const double free = times < 4.0 ? half : kPi / k;
    for (const Touch& touch : touches) {
      if (touch.normal_force < 0.05 * expected) continue;
      const double from_end = std::min(touch.tip_distance, length - touch.tip_distance);
      EXPECT_NEAR(from_end, free, 6.0);
    }
  }
}

}  // namespace
}  // namespace wireplan::simulate
