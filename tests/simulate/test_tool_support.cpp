// A catheter whose tip is pressed, and what a seated one bears: against theory and step by step.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "preprocess/centerline/path_place.h"
#include "simulate/insertion/tool_script.h"
#include "tests/shapes.h"
#include "tests/simulate/tool_bench.h"

namespace wireplan::simulate {
namespace {

TEST(ToolPress, BendsACantileverOfBothStiffnessesAsBeamTheoryHasIt) {
  // A catheter of 40 mm on a wire of 60: what is beyond the press goes straight on.
  const double outer = 300.0, inner = 100.0, L = 40.0, F = 1e-3;
  const std::vector<Tool> tools = {uniform_tool(100.0, outer), uniform_tool(100.0, inner)};
  ToolScene scene = tools_along_x(tools, {{L, 0.0}, {60.3, 0.0}});
  scene.element_length = 0.5;
  ToolBench bench(scene);
  ASSERT_TRUE(bench.settled());
  ASSERT_TRUE(bench.press(0, F * Vec3::UnitY()));
  const double EI = outer + inner, deflection = F * L * L * L / (3.0 * EI),
               slope = F * L * L / (2.0 * EI);
  EXPECT_NEAR(bench.nodes_of(0).rightCols<1>().y(), deflection, 2e-3 * deflection);
  EXPECT_NEAR(bench.state().x.rightCols<1>().y(), deflection + 20.3 * slope, 2e-3 * deflection);
  const double force = -bench.introducer_force().y();
  EXPECT_NEAR(std::abs(force), F, 1e-6);
  // Half of it, from there: as far as the load is; nothing: where it was.
  ASSERT_TRUE(bench.press(0, 0.5 * F * Vec3::UnitY()));
  EXPECT_NEAR(bench.nodes_of(0).rightCols<1>().y(), 0.5 * deflection, 1e-3 * deflection);
  ASSERT_TRUE(bench.press(0, Vec3::Zero()));
  EXPECT_NEAR(bench.state().x.rightCols<1>().y(), 0.0, 1e-6);
}

TEST(ToolPress, OfTheForemostTipIsTheScenesOwnLoad) {
  const std::vector<Tool> tools = {uniform_tool(100.0, 200.0, 0.02), uniform_tool(100.0, 50.0)};
  const Vec3 force(-0.05, 0.02, 0.1);
  ToolScene scene = tools_along_x(tools, {{30.0, 0.0}, {50.0, 0.0}});
  ToolBench pressed(scene);
  ASSERT_TRUE(pressed.press(1, force));
  scene.loads.tip_force = force;
  const ToolBench loaded(scene);
  ASSERT_TRUE(loaded.settled());
  EXPECT_LT((pressed.state().x - loaded.state().x).colwise().norm().maxCoeff(), 1e-5);
  EXPECT_NEAR(pressed.free_force(1), loaded.free_force(1), 1e-6);
  // A mark and a copy hold the press: they go on with it.
  ToolBench copy(pressed);
  const ToolMove on = push_of({0.0, 5.0});
  const ToolBench::Mark mark = pressed.save();
  ASSERT_TRUE(pressed.press(1, Vec3::Zero()));
  pressed.restore(mark);
  ASSERT_TRUE(pressed.move(on));
  ASSERT_TRUE(copy.move(on));
  EXPECT_EQ(copy.state().x, pressed.state().x) << "bit for bit";
}

// ---------------------------------------------------------------- seated

/// But for what has it bend to one side.
Tool straight_tool(double EI, double radius, double inner) {
  Tool tool;
  tool.wire = {.name = "straight",
               .radius = radius,
               .sections = {{.length = 900.0, .bending_stiffness = EI, .rest_curvature = 2e-4}},
               .friction = 0.0};
  tool.inner_radius = inner;
  return tool;
}

/// Straight up a wide tube, in which nothing touches; its "ostium" is `ostium` mm up.
TrialResult standing_column(double EI_catheter, double EI_wire, double length, double ostium) {
  static const VesselModel wide(shapes::straight_tube(45.0, 140.0, 6.0), {.grid_spacing = 3.0});
  Centerline path = shapes::line_through({Vec3(0, 0, 2), Vec3(0, 0, 138)}, 45.0);
  const auto way = std::make_shared<Way>(path);
  const Goal goal{.point = Vec3(0, 0, 130), .radius = 45.0, .at_section = true, .way = way};
  ToolTrialOptions options;
  options.insertion.element_length = 1.0;
  options.insertion.friction = 0.0;
  options.insertion.length = 400.0;
  options.take_off = TakeOff{.arc = ostium};
  return run_tool_trial({straight_tool(EI_catheter, 0.8, 0.5), straight_tool(EI_wire, 0.4, 0.0)},
                        {.point = Vec3(0.0, 0.0, 2.0), .direction = Vec3::UnitZ()}, goal, wide,
                        options, {{.tool = 1, .push = length + 6.0}, {.tool = 0, .push = length}});
}

TEST(ToolSupport, OfAFreeColumnIsTheElasticasLoad) {
  // A column that is held at one end, of length L, with its other end back by d under the load
  // P = EI (K(k) / L)^2, where 2 E(k) / K(k) - 1 = 1 - d / L (Love, Mathematical Theory of
  // Elasticity, 263).
  const double L = 60.0;
  for (const double back : {2.0, 9.0}) {
    for (const double EI : {60.0, 240.0}) {
      SCOPED_TRACE(EI);
      const TrialResult trial = standing_column(0.8 * EI, 0.2 * EI, L, L - back);
      ASSERT_TRUE(trial.support) << trial.reason;
      double low = 0.0, high = 0.99;
      for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        const double end = 2.0 * std::comp_ellint_2(middle) / std::comp_ellint_1(middle) - 1.0;
        (end > 1.0 - back / L ? low : high) = middle;
      }
      const double K = std::comp_ellint_1(low), P = EI * K * K / (L * L);
      EXPECT_NEAR(trial.support->push, P, 0.03 * P);
      EXPECT_FALSE(trial.support->more);
    }
  }
}

TEST(ToolSupport, IsThereOnlyWhereTheCathetersTipIsInTheBranch) {
  EXPECT_FALSE(standing_column(60.0, 10.0, 40.0, 50.0).support);
  EXPECT_TRUE(standing_column(60.0, 10.0, 40.0, 35.0).support);
}

TEST(ToolSupport, NoMoreIsTriedThanAHandPushes) {
  const TrialResult trial = standing_column(9000.0, 10.0, 60.0, 50.0);
  ASSERT_TRUE(trial.support);
  EXPECT_TRUE(trial.support->more);
  EXPECT_EQ(trial.support->push, kMostSupport);
}

}  // namespace
}  // namespace wireplan::simulate
