// Equilibria that are none: columns straight under more than Euler's load, rods straight beyond
// Greenhill's twist, and what a wire that leaves its plane is twisted by.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "simulate/insertion/scene.h"
#include "simulate/insertion/tool_bench.h"
#include "simulate/wire/writhe.h"
#include "tests/simulate/analytic.h"
#include "tests/simulate/tool_bench.h"

namespace wireplan::simulate {
namespace {

constexpr double kL = 100.0, kStiffness = 20.0;  // mm, N mm^2

/// A straight wire that is clamped at the origin, along x.
Scene cantilever_along_x() {
  Scene scene;
  scene.wire = {
      .name = "column",
      .radius = 0.4445,
      .sections = {{.length = kL, .bending_stiffness = kStiffness, .axial_stiffness = 2e4}}};
  scene.elements = 200;
  scene.supports = {{}};
  return scene;
}

Support clamp_at(double x, double roll = 0.0) {
  return {.at = WireEnd::kDistal, .point = Vec3(x, 0.0, 0.0), .roll = roll};
}

TEST(Saddles, ColumnUnderMoreThanEulersLoadBendsAsTheElastica) {
  for (const double end_angle : {0.5, 1.0, 2.0}) {
    SCOPED_TRACE(end_angle);
    // A cantilever is half of a column between pins.
    const analytic::Column exact = analytic::buckle_column(end_angle);
    const double euler = kPi * kPi * kStiffness / (4.0 * kL * kL);
    Scene scene = cantilever_along_x();
    scene.loads.tip_force = Vec3(-exact.load * euler, 0.0, 0.0);
    scene.solver.residual_tolerance = 1e-9;
    const SceneResult bent = run_scene(scene);
    ASSERT_EQ(bent.outcome, SceneOutcome::kConverged) << bent.reason;
    const Vec3 tip = bent.nodes.rightCols<1>();
    EXPECT_NEAR(tip.x(), (1.0 - exact.shortening) * kL, 2e-3 * kL);
    EXPECT_NEAR(tip.tail<2>().norm(), 2.0 * exact.deflection * kL, 2e-3 * kL);
  }
  // Under less it stays straight, and takes no longer.
  Scene scene = cantilever_along_x();
  scene.loads.tip_force = Vec3(-0.9 * kPi * kPi * kStiffness / (4.0 * kL * kL), 0.0, 0.0);
  const SceneResult straight = run_scene(scene);
  ASSERT_EQ(straight.outcome, SceneOutcome::kConverged);
  EXPECT_LE(straight.iterations, 2);
  EXPECT_EQ(straight.nodes.bottomRows(2).cwiseAbs().maxCoeff(), 0.0);
}

TEST(Saddles, LoadsBelowTheToleranceBendASoftWire) {
  // Not straight as at the start, where the load alone is less out of balance than is asked for.
  const double EI = 1e-3, force = 3e-8, expected = force * kL * kL * kL / (3.0 * EI);
  Scene scene = cantilever_along_x();
  scene.wire.sections[0].bending_stiffness = EI;
  scene.wire.sections[0].axial_stiffness = 0.0;
  scene.loads.tip_force = Vec3(0.0, force, 0.0);
  const SceneResult result = run_scene(scene);
  EXPECT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
  EXPECT_NEAR(result.nodes(1, result.nodes.cols() - 1), expected, 0.03 * expected);

  ToolScene tools = tools_along_x({uniform_tool(kL, EI)}, {{kL, 0.0}});
  tools.tools[0].wire.sections[0].axial_stiffness = 0.0;
  tools.loads = scene.loads;
  tools.residual_tolerance = 1e-6;
  const ToolBench bench(tools);
  EXPECT_TRUE(bench.settled());
  EXPECT_NEAR(bench.state().x(1, bench.state().x.cols() - 1), expected, 0.03 * expected);
}

TEST(Saddles, ClampsThatComeALittleNearerDoNotPressTheWireTogether) {
  for (const bool on_table : {false, true}) {
    for (const double shortening : {0.002, 0.01, 0.03, 0.045}) {
      SCOPED_TRACE(shortening + on_table);
      Scene scene = cantilever_along_x();
      scene.supports.push_back(clamp_at((1.0 - shortening) * kL));
      if (on_table) scene.plane = Vec3::UnitZ();
      const SceneResult result = run_scene(scene);
      ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
      EXPECT_LT(std::abs(result.twist.sum()), 1e-6);  // nor do they roll its ends
      // Four quarters of a column between pins; P = P_Euler (1 + shortening / 2) to second order.
      const double expected = 4.0 * kPi * kPi * kStiffness / (kL * kL) * (1.0 + 0.5 * shortening);
      EXPECT_NEAR(result.reactions[0].force.x(), expected, 2e-3 * expected);
    }
  }
}

TEST(Saddles, RodTwistedBeyondGreenhillsTorqueBowsOut) {
  // Clamped, it stays straight up to M = 8.9868 EI/L, a roll of 8.9868 EI/GJ.
  const double GJ = kStiffness / 1.3, critical = 8.9868 * kStiffness / GJ;
  for (const bool slides : {false, true}) {
    for (const double part : {0.95, 1.05, 1.3}) {
      SCOPED_TRACE(part + 10.0 * slides);
      Scene scene = cantilever_along_x();
      scene.wire.sections[0].twist_stiffness = GJ;
      scene.supports.push_back(clamp_at(kL, part * critical));
      if (slides) scene.supports[1].kind = SupportKind::kGuided;
      const SceneResult result = run_scene(scene);
      ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
      const double aside = result.nodes.bottomRows(2).colwise().norm().maxCoeff();
      const double straight = 0.5 * GJ * std::pow(part * critical, 2) / kL;
      if (part < 1.0) {
        EXPECT_LT(aside, 1e-9);
        EXPECT_NEAR(result.energy.total(), straight, 1e-9 * straight);
      } else {
        // An end that slides lets the wire loop, which passes round that end: two turns come off.
        const double left = part * critical - 4.0 * kPi;
        if (slides) {
          EXPECT_NEAR(result.twist.sum(), left, 1e-3);
        } else {
          EXPECT_GT(aside, 0.01);
        }
        EXPECT_LT(result.energy.total(), straight);
      }
    }
  }
}

TEST(Saddles, FlatWayToAPinLeavesThePlaneWhereItIsNoMinimum) {
  // Both came to saddles of the plane ever more slowly, and ran out of iterations.
  struct Row {
    double length, stiffness, radius, x, y;
    int elements;
  };
  for (const Row& row : {Row{34.357, 50.23, 0.34357, -7.2125, 7.9345, 50},
                         Row{38.635, 0.43407, 0.38635, -24.9406, 16.4607, 30}}) {
    SCOPED_TRACE(row.length);
    Scene scene = cantilever_along_x();
    scene.wire.radius = row.radius;
    scene.wire.sections = {{.length = row.length, .bending_stiffness = row.stiffness}};
    scene.elements = row.elements;
    scene.supports.push_back(
        {.at = WireEnd::kDistal, .kind = SupportKind::kPinned, .point = Vec3(row.x, row.y, 0.0)});
    const SceneResult result = run_scene(scene);
    EXPECT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
    EXPECT_LT(result.iterations, 300);
    EXPECT_LT((result.nodes.rightCols<1>() - scene.supports[1].point).norm(), 1e-9);
  }
}

TEST(Saddles, ClampsInSpaceHoldTheirRolls) {
  // A straight wire that leaves the plane of its ends is twisted by what holds their rolls.
  Scene scene = cantilever_along_x();
  scene.elements = 80;
  scene.supports.push_back({.at = WireEnd::kDistal,
                            .point = Vec3(40.0, 30.0, 20.0),
                            .direction = Vec3(-0.3, 0.2, 0.9).normalized()});
  const SceneResult held = run_scene(scene);
  scene.twist = Twist::kCoupled;
  const SceneResult coupled = run_scene(scene);
  ASSERT_EQ(held.outcome, SceneOutcome::kConverged) << held.reason;
  ASSERT_EQ(coupled.outcome, SceneOutcome::kConverged) << coupled.reason;
  ASSERT_GT(held.twist.size(), 0);
  EXPECT_GT(std::abs(held.twist.sum()), 0.05);
  EXPECT_LT((held.nodes - coupled.nodes).cwiseAbs().maxCoeff(), 1e-6);

  // A pin holds no roll, and a table none that matters.
  scene.twist = Twist::kAuto;
  scene.supports[1].kind = SupportKind::kPinned;
  EXPECT_EQ(run_scene(scene).twist.size(), 0);
  scene.supports[1] = clamp_at(0.9 * kL);
  scene.plane = Vec3::UnitZ();
  EXPECT_EQ(run_scene(scene).twist.size(), 0);
}

TEST(Saddles, TurnsThatComeOffAreTold) {
  // Of 2 and 4 turns between clamps that face each other all come off, of one none; the shape is
  // the flat one again.
  Scene scene = cantilever_along_x();
  scene.supports.push_back(
      {.at = WireEnd::kDistal, .point = Vec3(0.0, 45.0, 0.0), .direction = -Vec3::UnitX()});
  const SceneResult flat = run_scene(scene);
  EXPECT_EQ(flat.reason, "");
  for (const double turns : {1.0, 2.0, -4.0}) {
    SCOPED_TRACE(turns);
    scene.supports[1].roll = 2.0 * kPi * turns;
    const SceneResult rolled = run_scene(scene);
    ASSERT_EQ(rolled.outcome, SceneOutcome::kConverged) << rolled.reason;
    const double left = (rolled.twist.sum() + find_writhe(rolled.nodes)) / (2.0 * kPi);
    if (turns == 1.0) {
      EXPECT_EQ(rolled.reason, "");
      EXPECT_NEAR(left, 1.0, 0.1);
    } else {
      EXPECT_NEAR(left, 0.0, 0.1);
      EXPECT_LT((rolled.nodes - flat.nodes).cwiseAbs().maxCoeff(), 1e-3);
      const std::string told = turns == 2.0 ? "about 2 turns" : "about 4 turns";
      EXPECT_EQ(rolled.reason.substr(0, told.size()), told) << rolled.reason;
    }
  }
}

/// A helix of 60 edges a turn, right-handed for a side of 1.
Eigen::Matrix3Xd helix(int turns, double pitch, double side) {
  const double radius = 2.0;
  Eigen::Matrix3Xd nodes(3, 60 * turns + 1);
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    const double angle = 2.0 * kPi * static_cast<double>(i) / 60.0;
    nodes.col(i) = Vec3(radius * std::cos(angle), side * radius * std::sin(angle),
                        radius * angle * std::tan(pitch));
  }
  return nodes;
}

TEST(Saddles, WritheOfAHelixIsWhatItsTangentsEncloseOnTheSphere) {
  // 2 pi (1 - sin(pitch)) for each turn; what the ends lack does not hang on how many there are.
  for (const double pitch : {0.3, 0.8}) {
    for (const double side : {1.0, -1.0}) {
      const double writhe =
          find_writhe(helix(16, pitch, side)) - find_writhe(helix(8, pitch, side));
      const double expected = side * 2.0 * kPi * 8.0 * (1.0 - std::sin(pitch));
      EXPECT_NEAR(writhe, expected, 0.01 * std::abs(expected));
    }
  }
}

TEST(Saddles, StraightToolsUnderMoreThanEulersLoadBendTogether) {
  const analytic::Column exact = analytic::buckle_column(1.0);
  const double euler = kPi * kPi * 2.0 * kStiffness / (4.0 * kL * kL);
  ToolScene scene = tools_along_x(
      {uniform_tool(150.0, kStiffness), uniform_tool(150.0, kStiffness)}, {{kL, 0.0}, {kL, 0.0}});
  scene.loads.tip_force = Vec3(-exact.load * euler, 0.0, 0.0);
  const ToolBench bench(scene);
  ASSERT_TRUE(bench.settled());
  const Vec3 tip = bench.state().x.rightCols<1>();
  EXPECT_NEAR(tip.x(), (1.0 - exact.shortening) * kL, 5e-3 * kL);
  EXPECT_NEAR(tip.tail<2>().norm(), 2.0 * exact.deflection * kL, 5e-3 * kL);
}

}  // namespace
}  // namespace wireplan::simulate
