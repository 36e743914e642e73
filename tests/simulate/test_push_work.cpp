#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "simulate/insertion/trial.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

/// Lumen of 4 mm radius that bends by 90 degrees round 40 mm, from +z to +x.
const VesselModel& bend() {
  static const VesselModel vessel(shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5),
                                  {.grid_spacing = 0.6});
  return vessel;
}

/// 20 mm before the bend, so that the wire is bent where it leaves the introducer.
Introducer near_the_bend() {
  return {.point = Vec3(0.0, 0.0, 30.0), .direction = Vec3::UnitZ(), .roll = 0.4};
}

Wire round_wire() {
  return {.name = "round",
          .radius = 0.445,
          .sections = {{.length = 300.0, .bending_stiffness = 500.0}}};
}

/// Curved all along, so that what leaves the introducer always is.
Wire curved_wire() {
  Wire wire = round_wire();
  wire.name = "curved";
  wire.sections[0].rest_curvature = 1.0 / 150.0;
  return wire;
}

Wire strip_wire() {
  Wire wire = curved_wire();
  wire.name = "strip";
  wire.sections[0].bending_stiffness_2 = 900.0;
  return wire;
}

TEST(PushWork, WithoutFrictionTheHandsForceIsTheSlopeOfTheEnergyWhereverTheNodesAre) {
  for (const Wire& wire : {round_wire(), curved_wire(), strip_wire()}) {
    SCOPED_TRACE(wire.name);
    Insertion insertion(wire, near_the_bend(), bend(),
                        {.length = 120.0, .element_length = 1.5, .residual_tolerance = 1e-9});
    for (int k = 0; k < 60; ++k) ASSERT_TRUE(insertion.push(1.0));
    double largest = 0.0;
    for (int k = 0; k < 15; ++k) {
      SCOPED_TRACE(insertion.depth());
      constexpr double kStep = 1e-3;
      const std::optional<Push> before = insertion.push(0.1 - kStep);
      ASSERT_TRUE(before && insertion.push(kStep));
      const double force = insertion.hand_force();
      const std::optional<Push> after = insertion.push(kStep);
      ASSERT_TRUE(after);
      const double slope = (after->stored_energy - before->stored_energy) / (2.0 * kStep);
      largest = std::max(largest, std::abs(force));
      // The energy has a kink where a contact point or a node comes out.
      EXPECT_NEAR(force, slope, 2e-3 * std::abs(force) + 2e-4);
    }
    EXPECT_GT(largest, 0.05);
  }
}

/// Friction in a bend, pushed by a millimetre at a time.
TrialResult rub(double element_length, double step) {
  return run_trial(round_wire(), {.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ()},
                   {.point = Vec3(0.0, 0.0, 1e3)}, bend(),
                   {.length = 120.0,
                    .step = step,
                    .element_length = element_length,
                    .contact_spacing = element_length,
                    .friction = 0.1});
}

TEST(PushWork, DoesNotHangOnElementsAsLongAsPushesOrNot) {
  const TrialResult fine = rub(0.25, 1.0);
  const double work = fine.pushes.back().push_work;
  double peak = 0.0;
  for (const Push& push : fine.pushes) peak = std::max(peak, push.push_force);
  ASSERT_GT(work, 1.0);
  for (const double h : {2.0, 1.0, 0.9, 0.5}) {
    SCOPED_TRACE(h);
    const TrialResult trial = rub(h, 1.0);
    const Push& last = trial.pushes.back();
    EXPECT_NEAR(last.push_work, work, 0.01 * work);
    EXPECT_NEAR(last.stored_energy + last.friction_work, work, 0.01 * work);
    EXPECT_LT(std::abs(last.unbalanced), 0.01 * work);
    double here = 0.0;
    for (const Push& push : trial.pushes) here = std::max(here, push.push_force);
    EXPECT_NEAR(here, peak, 0.03 * peak);
  }
}

TEST(PushWork, ForcesAddUpToTheWork) {
  const TrialResult trial = rub(1.0, 0.7);
  double sum = 0.0, depth = 0.0;
  for (const Push& push : trial.pushes) {
    sum += push.push_force * (push.insertion - depth);
    depth = push.insertion;
    EXPECT_NEAR(sum, push.push_work, 1e-9);
  }
}

TEST(PushWork, ThatIsNoneIsNotOutOfBalance) {
  const auto told = [](double unbalanced, double work) {
    return describe_balance(
        {{.insertion = 200.0, .push_work = work, .stored_energy = work, .unbalanced = unbalanced}});
  };
  EXPECT_EQ(told(1e-3, 3e-3), "");  // a straight wire in a straight tube
  EXPECT_NE(told(1e-2, 2e-2), "");
  EXPECT_NE(told(0.3, 10.0), "");
  EXPECT_EQ(told(0.09, 10.0), "");
}

TEST(PushBalance, ASteadyRippleReleasesNothing) {
  PushBalance balance;
  for (int k = 0; k < 40; ++k) {
    EXPECT_EQ(balance.find_release(1.0, 0.2 + 0.05 + 1e-4 * std::sin(k), 0.2), 0.0);
  }
  EXPECT_NEAR(balance.ripple(), 0.05, 1e-4);
  EXPECT_NEAR(balance.unbalanced(), 0.0, 1e-3);
}

TEST(PushBalance, AJumpReleasesWhatForcesDoBeyondTheRipple) {
  for (const double distance : {2.0, -2.0}) {
    SCOPED_TRACE(distance);
    PushBalance balance;
    for (int k = 0; k < 20; ++k) balance.find_release(distance, 0.26, 0.2);
    EXPECT_NEAR(balance.find_release(distance, 0.3 + 0.06, -0.7), 1.0, 1e-12);
    EXPECT_NEAR(balance.ripple(), 0.03, 1e-12);  // of the pushes before alone
    EXPECT_EQ(balance.unbalanced(), 0.0);
    // Energy that comes from nowhere is no release, and not balanced.
    balance.find_release(distance, 0.26, 1.2);
    for (int k = 0; k < 9; ++k) balance.find_release(distance, 0.26, 0.2);
    EXPECT_NEAR(balance.unbalanced(), -1.0, 1e-12);
  }
}

TEST(PushBalance, APullLearnsItsOwnRipple) {
  PushBalance balance;
  for (int k = 0; k < 9; ++k) balance.find_release(1.0, 0.1, 0.2);
  EXPECT_NEAR(balance.ripple(), -0.1, 1e-12);
  EXPECT_EQ(balance.find_release(-1.0, 0.3, 0.2), 0.0);
  EXPECT_EQ(balance.ripple(), 0.0);
}

}  // namespace
}  // namespace wireplan::simulate
