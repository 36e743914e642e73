// A wire that is led past a vessel which it goes into on its way up.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/goal.h"
#include "tests/shapes.h"
#include "tests/simulate/hooked_tools.h"

namespace wireplan::simulate {
namespace {

// A trunk of 6 mm radius along z from 0 to 200 mm with a branch of 4 mm that leaves it at 70 mm, by
// 30 degrees toward +x, so that what comes along that side goes into it; all ends are closed.
Vec3 along_branch(double s) { return {0.5 * s, 0.0, 70.0 + std::sqrt(0.75) * s}; }

const VesselModel& side_branch() {
  static const VesselModel vessel(
      shapes::level_set(
          [](const Vec3& p) {
            const double trunk =
                shapes::depth_in_tube(p, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 200.0), 6.0);
            const double branch =
                shapes::depth_in_tube(p, along_branch(0.0), along_branch(80.0), 4.0);
            return 0.5 * std::log(std::exp(trunk / 0.5) + std::exp(branch / 0.5));
          },
          Vec3(-7.0, -7.0, -1.5), Vec3(46.0, 7.0, 201.5), 1.0),
      LumenOptions{.grid_spacing = 0.6});
  return vessel;
}

/// Up that trunk to 190 mm, past a take-off at that arc length of the way.
ToolTrial branched_trial(double EI = 20.0, double arc = 155.0,
                         const std::vector<SideVessel>& sides = {}) {
  const Centerline path = line_from(Vec3(0.0, 0.0, 5.0), Vec3(0.0, 0.0, 190.0), 6.0);
  const std::vector<preprocess::Branch> tree = {
      {path, -1, 0.0}, {line_from(along_branch(0.0), along_branch(79.0), 4.0), 0, 65.0}};
  const auto way = std::make_shared<Way>(path, tree);
  const Goal goal = goal_at_end(way);
  ToolTrialOptions options = coarse();
  options.insertion.length = 600.0;
  options.sides = sides;
  options.take_off = TakeOff{.arc = arc, .point = Vec3(0.0, 6.0, 5.0 + arc)};
  const Introducer introducer{.point = Vec3(-4.0, 0.0, 5.0),
                              .direction = Vec3(std::sin(0.15), 0.0, std::cos(0.15))};
  return {{hooked_catheter(), straight_wire(EI)}, introducer, goal, side_branch(), options};
}

TEST(ToolTrial, AWireIsLedPastAVesselThatItGoesInto) {
  ToolTrial astray = branched_trial();
  ASSERT_TRUE(astray.make({.tool = 1, .push = 100.0}));
  EXPECT_GT(astray.tip(1).x(), 8.0) << "it goes into the branch by itself";

  ToolTrial led = branched_trial();
  ASSERT_TRUE(led.make({.tool = 1, .push = 140.0, .steers = 8})) << led.reason();
  EXPECT_LT(std::abs(led.tip(1).x()), 6.0);
  EXPECT_GT(led.tip(1).z(), 130.0);
  EXPECT_NEAR(led.insertion(1), 144.0, 1e-9) << "as far in as was asked for";
  EXPECT_NEAR(led.insertion(0), 0.0, 1e-9) << "the catheter is taken back ...";
  EXPECT_NEAR(led.bench().places()[0].roll, 0.0, 1e-9) << "... as it was";
  const TrialResult record = led.finish();
  EXPECT_NE(record.reason.find("tried again"), std::string::npos) << record.reason;
}

/// Insertions of the wire and the catheter, and the hub's angle, as the wire is led on each time.
struct Led {
  double wire, catheter, roll;
};
std::vector<Led> led_on(const TrialResult& record) {
  std::vector<Led> all;
  const ToolTrack &catheter = record.tools[0], &wire = record.tools[1];
  for (std::size_t k = 1; k + 1 < record.pushes.size(); ++k) {
    const bool waits = wire.insertion[k] <= wire.insertion[k - 1] + 1e-9;
    if (waits && wire.insertion[k + 1] > wire.insertion[k] + 1e-9) {
      all.push_back({wire.insertion[k], catheter.insertion[k], catheter.roll[k]});
    }
  }
  return all;
}

TEST(ToolTrial, AStepEndsInAVesselOffTheWayThatItIsLedInto) {
  // The branch's own ostium, some way out of the trunk's middle.
  const double out = 12.0;
  ToolTrial trial = branched_trial(
      20.0, 155.0,
      {{.branch = 1,
        .take_off = {.arc = 75.0, .point = along_branch(out), .trunk = Vec3::UnitZ()},
        .from = out}});
  ASSERT_TRUE(trial.make({.tool = 1, .push = 30.0}));
  EXPECT_NEAR(trial.measure(Until::kInBranch, 1, 1), -(trial.tip(1) - along_branch(out)).norm(),
              1e-9)
      << "before it";
  ASSERT_TRUE(
      trial.make({.tool = 1, .push = 120.0, .until = Until::kInBranch, .at = 30.0, .side = 1}));
  EXPECT_LT(trial.insertion(1), 140.0) << "the whole of it is not made";
  const Vec3 along = (along_branch(1.0) - along_branch(0.0)).normalized();
  EXPECT_NEAR(along.dot(trial.tip(1) - along_branch(out)), 30.0, 1.0);
  EXPECT_NEAR(trial.measure(Until::kInBranch, 1, 1), 30.0, 0.6);
  EXPECT_NEAR(trial.measure(Until::kLevel, 1, 1), (trial.tip(1) - along_branch(out)).z(), 1e-9);
  EXPECT_LT(trial.measure(Until::kInBranch, 1), 0.0) << "at the target's take-off it is not";
  EXPECT_TRUE(std::isnan(trial.measure(Until::kInBranch, 1, 0))) << "of no vessel that is known";
  EXPECT_FALSE(trial.ended()) << "it is there on purpose";
}

TEST(ToolTrial, AWireThatCannotBeLedOnIsNotPushedForEver) {
  // 40 mm of catheter do not matter to a wire as stiff as this.
  ToolTrial trial = branched_trial(5000.0);
  EXPECT_FALSE(trial.make({.tool = 1, .push = 140.0, .steers = 10}));
  EXPECT_FALSE(trial.reached());
  const TrialResult record = trial.finish();
  EXPECT_NE(record.reason.find("the tip is not on the way: it is in branch 2"), std::string::npos)
      << record.reason;
  EXPECT_NE(record.reason.find("tried again 10 times"), std::string::npos) << record.reason;
  const std::vector<Led> tries = led_on(record);
  ASSERT_EQ(tries.size(), 10U);
  for (std::size_t k = 0; k < 10; ++k) {
    SCOPED_TRACE(k);
    const double further =
        kSteerFurther * static_cast<double>((k < 8 ? k : k + 2) % 4);  // another, turned round
    EXPECT_NEAR(tries[k].wire, tries[0].wire - further, 1e-9);
    EXPECT_NEAR(tries[k].wire - tries[k].catheter, std::min(kSteerBehind, 0.5 * tries[k].wire),
                1e-9);
    EXPECT_NEAR(tries[k].roll, kSteerTurn * static_cast<double>(k), 1e-9);
  }
}

TEST(ToolTrial, AWireNearTheTakeOffIsNotSteered) {
  ToolTrial trial = branched_trial(20.0, 75.0 + kSteerNear - 20.0);
  ASSERT_TRUE(trial.make({.tool = 1, .push = 100.0, .steers = 8}));
  EXPECT_GT(trial.tip(1).x(), 8.0);
  EXPECT_EQ(trial.finish().reason.find("tried again"), std::string::npos);
}

}  // namespace
}  // namespace wireplan::simulate
