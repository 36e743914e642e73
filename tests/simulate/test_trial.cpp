#include <gtest/gtest.h>

#include <cmath>

#include "simulate/trial.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

Wire straight_wire(double EI) {
  return {.name = "straight",
          .radius = 0.445,
          .sections = {{.length = 400.0, .bending_stiffness = EI}}};
}

Wire curved_wire(double EI) {
  return {.name = "curved",
          .radius = 0.445,
          .sections = {{.length = 15.0, .bending_stiffness = 5.0, .rest_curvature = 1.0 / 12.0},
                       {.length = 30.0, .bending_stiffness = 0.2 * EI},
                       {.length = 400.0, .bending_stiffness = EI}}};
}

/// Lumen of 4 mm radius that bends by 90 degrees round 40 mm, from +z to +x.
const Lumen& bend() {
  static const Lumen lumen(shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5),
                           {.grid_spacing = 0.6});
  return lumen;
}

Introducer along_z() { return {.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ()}; }
Goal end_of_bend() { return {.point = Vec3(80.0, 0.0, 80.0), .radius = 5.0}; }
InsertionOptions options() { return {.length = 160.0, .step = 2.0, .element_length = 2.0}; }

TEST(Trial, ReachesTheEndOfABendInsideTheLumen) {
  for (const double EI : {50.0, 520.0, 4857.0}) {
    SCOPED_TRACE(EI);
    const TrialResult trial =
        run_trial(straight_wire(EI), along_z(), end_of_bend(), bend(), options());
    EXPECT_EQ(trial.outcome, Outcome::kReached) << trial.reason;
    for (const Push& push : trial.pushes) {
      EXPECT_LE(push.residual, 1e-6);
      EXPECT_LT(push.max_penetration, 0.3);
    }
    EXPECT_LT((trial.pushes.back().tip - end_of_bend().point).norm(), 5.0);
    EXPECT_EQ(trial.terms, (std::vector<std::string>{"stretch", "bend", "contact"}));
  }
}

TEST(Trial, EndsWhereTheTipIsNearestToTheGoal) {
  const TrialResult trial =
      run_trial(straight_wire(520.0), along_z(), end_of_bend(), bend(), options());
  const std::vector<Push>& pushes = trial.pushes;
  const auto distance = [](const Push& push) { return (push.tip - end_of_bend().point).norm(); };
  for (const Push& push : pushes) EXPECT_GE(distance(push), distance(pushes.back()));
  EXPECT_TRUE(Vec3(trial.nodes.rightCols<1>()).isApprox(pushes.back().tip, 1e-12));
}

TEST(Trial, StifferWiresPressHarder) {
  const auto peak = [](double EI) {
    double force = 0.0;
    for (const Push& push :
         run_trial(straight_wire(EI), along_z(), end_of_bend(), bend(), options()).pushes) {
      force = std::max(force, push.peak_contact_force);
    }
    return force;
  };
  const double soft = peak(50.0), stiff = peak(500.0);
  EXPECT_GT(soft, 0.0);
  // Same shape within the clearance: forces grow nearly in proportion to EI.
  EXPECT_GT(stiff, 5.0 * soft);
}

TEST(Trial, IntroducerAndWallCarryTheWireTogether) {
  const TrialResult trial =
      run_trial(straight_wire(520.0), along_z(), end_of_bend(), bend(), options());
  Vec3 wall = Vec3::Zero();
  for (const NodeContact& contact : trial.contacts) wall += contact.force;
  EXPECT_GT(wall.norm(), 0.01);
  // Along the introducer: push and wall balance (frictionless, so the push is what bends the wire).
  EXPECT_NEAR(wall.z() + trial.pushes.back().push_force, 0.0, 1e-4);  // residual 1e-6 on 80 nodes
}

TEST(Trial, CurvedTipTurnsWithTheHub) {
  // In a wide straight lumen the tip points to where its roll says.
  const Lumen wide(shapes::straight_tube(15.0, 100.0, 4.0), {.grid_spacing = 1.0});
  for (const double roll : {0.0, 0.5 * kPi, kPi}) {
    SCOPED_TRACE(roll);
    Introducer introducer = along_z();
    introducer.roll = roll;
    InsertionOptions some = options();
    some.length = 40.0;
    const TrialResult trial =
        run_trial(curved_wire(500.0), introducer, {.point = Vec3(0.0, 0.0, 1e3)}, wide, some);
    EXPECT_EQ(trial.outcome, Outcome::kMissed);
    const Vec3 tip = trial.nodes.rightCols<1>();
    const Vec3 toward =
        std::cos(roll) * Vec3(0.0, -1.0, 0.0) + std::sin(roll) * Vec3(1.0, 0.0, 0.0);
    EXPECT_GT(tip.dot(toward), 4.0);
    EXPECT_EQ(trial.terms, (std::vector<std::string>{"stretch", "bend", "twist", "contact"}));
  }
}

TEST(Trial, WireAgainstAnEndIsNamedStuck) {
  const Lumen closed(shapes::straight_tube(4.0, 60.0, 1.5), {.grid_spacing = 0.6});
  InsertionOptions far = options();
  far.length = 150.0;
  const TrialResult trial =
      run_trial(straight_wire(50.0), along_z(), {.point = Vec3(0.0, 0.0, 1e3)}, closed, far);
  EXPECT_NE(trial.outcome, Outcome::kReached);
  EXPECT_NE(trial.outcome, Outcome::kMissed) << trial.reason;
  EXPECT_LT(trial.pushes.back().insertion, 149.0);
  EXPECT_FALSE(trial.reason.empty());
}

TEST(Trial, ShapesAreKeptAtTheAskedSpacing) {
  InsertionOptions some = options();
  some.record_every = 10.0;
  const TrialResult trial = run_trial(straight_wire(520.0), along_z(), end_of_bend(), bend(), some);
  ASSERT_GE(trial.shapes.size(), 5u);
  for (std::size_t k = 1; k + 1 < trial.shapes.size(); ++k) {
    EXPECT_NEAR(trial.shapes[k].insertion - trial.shapes[k - 1].insertion, 10.0, 1e-9);
  }
  EXPECT_DOUBLE_EQ(trial.shapes.back().insertion, trial.pushes.back().insertion);
}

TEST(Trial, PushLengthHardlyChangesTheAnswer) {
  // Frictionless statics do not depend on the path, up to which of several equilibria is met.
  std::vector<Vec3> tips;
  for (const double step : {1.0, 2.0, 5.0}) {
    InsertionOptions some = options();
    some.step = step;
    some.length = 100.0;
    const TrialResult trial =
        run_trial(straight_wire(520.0), along_z(), {.point = Vec3(0.0, 0.0, 1e3)}, bend(), some);
    ASSERT_EQ(trial.outcome, Outcome::kMissed) << trial.reason;
    tips.push_back(trial.nodes.rightCols<1>());
  }
  EXPECT_LT((tips[1] - tips[0]).norm(), 1e-3);
  EXPECT_LT((tips[2] - tips[0]).norm(), 1e-3);
}

TEST(Trial, SameInputsGiveTheSameBits) {
  const TrialResult a = run_trial(curved_wire(500.0), along_z(), end_of_bend(), bend(), options());
  const TrialResult b = run_trial(curved_wire(500.0), along_z(), end_of_bend(), bend(), options());
  EXPECT_TRUE(a.nodes == b.nodes);
  EXPECT_EQ(a.pushes.size(), b.pushes.size());
}

}  // namespace
}  // namespace wireplan::simulate
