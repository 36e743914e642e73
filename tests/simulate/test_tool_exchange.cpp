// One wire in the place of another, through a catheter that stays: against benches that had the
// other wire from the start, and as a step of a trial that is gone back to.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "simulate/insertion/tool_trial.h"
#include "tests/shapes.h"
#include "tests/simulate/tool_bench.h"
#include "tests/simulate/tool_vessels.h"

namespace wireplan::simulate {
namespace {

double farthest_apart(const ToolBench& a, const ToolBench& b) {
  return std::sqrt((a.state().x - b.state().x).colwise().squaredNorm().maxCoeff());
}

/// Work of the hands that is neither stored, nor heat, nor released by jumps.
double missing_work(const ToolRecord& from, const ToolRecord& to) {
  return (to.work - from.work) - (to.energy.total() - from.energy.total()) - (to.heat - from.heat) -
         (to.released - from.released);
}

TEST(ToolExchange, LeavesTheToolsAsIfTheOtherWireHadBeenThereFromTheStart) {
  const Tool catheter = uniform_tool(300.0, 100.0, 1.0 / 40.0);
  const Tool soft = uniform_tool(400.0, 30.0, -1.0 / 60.0),
             stiff = uniform_tool(420.0, 300.0, 0.01);
  for (const Tool& other : {stiff, uniform_tool(420.0, 300.0)}) {  // curved and straight
    SCOPED_TRACE(other.wire.straight());
    ToolScene scene = tools_along_x({catheter, soft}, {{60.0, 0.5}, {70.0, 0.2}});
    scene.element_length = 2.0;
    ToolBench bench(scene);
    ASSERT_TRUE(bench.settled());
    ASSERT_TRUE(bench.move(push_of({0.0, -70.0})));
    const ToolRecord out = bench.record();
    const Eigen::Matrix3Xd shape = bench.state().x;
    bench.replace(1, other, -0.7);
    const ToolRecord in = bench.record();
    EXPECT_EQ(bench.state().x, shape) << "what is out of the body bends nothing";
    EXPECT_NEAR(in.tools[0].push_force, out.tools[0].push_force, 1e-9);
    EXPECT_NEAR(in.tools[0].hub_torque, out.tools[0].hub_torque, 1e-5) << "frames are laid anew";
    EXPECT_EQ(in.work, out.work);
    ASSERT_TRUE(bench.move(push_of({0.0, 50.0})));
    ASSERT_TRUE(bench.divide(60.0));

    scene.tools[1] = other;
    scene.places[1] = {50.0, -0.7};
    const ToolBench same(scene);
    ASSERT_TRUE(same.settled());
    EXPECT_LT(farthest_apart(bench, same), 1e-3) << "of 60 mm: what the residual leaves open";
    EXPECT_GT((bench.state().x.rightCols<1>() - shape.rightCols<1>()).norm(), 5.0);
    const double energy = same.record().energy.total();
    EXPECT_NEAR(bench.record().energy.total(), energy, 1e-6 * energy);
    // Parts are cut where forces at their ends are no measure of the work.
    const double gained = bench.record().energy.total() - in.energy.total();
    EXPECT_GT(std::abs(gained), 0.1);
    EXPECT_NEAR(missing_work(in, bench.record()), 0.0, 0.02 * std::abs(gained));
  }
}

TEST(ToolExchange, LeavesToolsInAVesselSoToo) {
  // Without friction, which would remember how they came there.
  const VesselModel bend(shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5),
                         {.grid_spacing = 0.6});
  const auto scene_with = [&](double EI, double insertion) {
    ToolScene scene = tools_along_x({uniform_tool(300.0, 100.0, 0.02), uniform_tool(400.0, EI)},
                                    {{90.0, 0.0}, {insertion, 0.0}});
    for (Tool& tool : scene.tools) tool.wire.radius = &tool == &scene.tools[0] ? 0.8 : 0.4;
    scene.point = Vec3(0.0, 0.0, 10.0);
    scene.direction = Vec3::UnitZ();
    scene.vessel = &bend;
    scene.contact.friction = 0.0;
    scene.element_length = 2.0;
    scene.residual_tolerance = 1e-7;
    return scene;
  };
  ToolBench bench(scene_with(20.0, 100.0));
  ASSERT_TRUE(bench.settled());
  ASSERT_TRUE(bench.move(push_of({0.0, -100.0})));
  ASSERT_TRUE(bench.divide(90.0));
  const Eigen::Matrix3Xd shape = bench.state().x;
  Tool stiff = scene_with(400.0, 0.0).tools[1];
  stiff.wire.friction = 0.0;
  bench.replace(1, stiff, 0.0);
  EXPECT_EQ(bench.state().x, shape);
  const ToolRecord in = bench.record();
  ASSERT_TRUE(bench.move(push_of({0.0, 80.0})));
  const ToolBench same(scene_with(400.0, 80.0));
  ASSERT_TRUE(same.settled());
  EXPECT_LT(farthest_apart(bench, same), 0.02) << "touches of a wall in triangles";
  EXPECT_GT((bench.state().x - shape).cwiseAbs().maxCoeff(), 0.3) << "the stiff one bends less";
  const double gained = bench.record().energy.total() - in.energy.total();
  EXPECT_GT(gained, 1.0);
  EXPECT_NEAR(missing_work(in, bench.record()), 0.0, 0.02 * gained);
}

Wire wire_called(const char* name, double EI, double friction) {
  return {.name = name,
          .radius = 0.4445,
          .sections = {{.length = 30.0, .bending_stiffness = std::min(5.0, EI)},
                       {.length = 1400.0, .bending_stiffness = EI}},
          .friction = friction};
}

const VesselModel& branched_aorta() {
  static const VesselModel vessel(aorta_with_a_branch(), LumenOptions{.grid_spacing = 0.6});
  return vessel;
}

const Goal kFarAway{.point = Vec3(0.0, 0.0, 500.0), .radius = 1.0};

ToolTrial cobra_trial(const Goal& goal = kFarAway) {
  Tool cobra;
  cobra.wire = {.name = "cobra", .radius = 0.8335, .sections = cobra_tip(), .friction = 0.1};
  cobra.wire.sections.push_back({.length = 580.0, .bending_stiffness = 332.0});
  cobra.inner_radius = 0.4955;
  ToolTrialOptions options;
  options.insertion.element_length = 3.0;
  options.insertion.friction = 0.04;
  options.insertion.length = 400.0;
  options.insertion.map_forces = false;
  // Rougher than all that is in before, so that the wall is felt by another scale.
  options.spares = {wire_called("stiff", 300.0, 0.25)};
  options.spares[0].sections[0].rest_curvature = 0.02;
  return {{cobra, {.wire = wire_called("soft", 20.0, 0.04)}},
          {.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ()},
          goal,
          branched_aorta(),
          options};
}

constexpr ToolStep kExchange{.tool = 1, .at = 10.0, .spare = 0};

TEST(ToolExchange, IsAStepThatTellsWhichWireIsInFromWhenOn) {
  ToolTrial trial = cobra_trial();
  ASSERT_TRUE(trial.make({.tool = 1, .push = 116.0}));
  ASSERT_TRUE(trial.make({.tool = 0, .push = 100.0}));
  const std::size_t before = trial.pushes().size();
  ASSERT_TRUE(trial.make(kExchange)) << trial.reason();
  EXPECT_EQ(trial.insertion(0), 100.0) << "it is held";
  EXPECT_NEAR(trial.insertion(1), 90.0, 1e-9);
  EXPECT_EQ(trial.bench().tools()[1].wire.name, "stiff");
  ASSERT_TRUE(trial.make({.tool = 1, .push = 20.0}));
  const TrialResult result = trial.finish();
  const ToolTrack& wire = result.tools.at(1);
  EXPECT_EQ(wire.name, "soft");
  ASSERT_EQ(wire.changes.size(), 1U);
  EXPECT_EQ(wire.changes[0].name, "stiff");
  EXPECT_TRUE(result.tools[0].changes.empty());
  // The one comes out in the step's parts, then the other goes in.
  const std::size_t from = wire.changes[0].from;
  ASSERT_GT(from, before + 50) << "120 mm by 2 mm";
  EXPECT_EQ(wire.insertion[from - 1], 0.0);
  for (std::size_t k = before; k < wire.insertion.size(); ++k) {
    const double by = wire.insertion[k] - wire.insertion[k - 1];
    EXPECT_TRUE(k < from ? by < 0.0 : by > 0.0) << k;
    EXPECT_LT(std::abs(by), 2.0 + 1e-9);
    EXPECT_EQ(result.steps[k], wire.insertion[k] > 90.0 + 1e-6 && k >= from ? 3 : 2) << k;
  }
  // What the hands do is stored, rubbed away or released by jumps, over the exchange too: what the
  // wires store outside does not count.
  double released = 0.0, work = 0.0;
  for (std::size_t k = 1; k < result.pushes.size(); ++k) {
    const Push &a = result.pushes[k - 1], &b = result.pushes[k];
    const double left = (b.push_work - a.push_work) - (b.stored_energy - a.stored_energy) -
                        (b.friction_work - a.friction_work);
    EXPECT_GT(left, -1e-3) << k;
    released += left;
    work += std::abs(b.push_work - a.push_work);
  }
  EXPECT_LT(released, 0.2 * work);
  EXPECT_NE(result.nodes.rightCols<1>().x(), 0.0);
}

TEST(ToolExchange, IsGoneBackFromAndOnFromAndCopied) {
  ToolTrial trial = cobra_trial();
  ASSERT_TRUE(trial.make({.tool = 1, .push = 116.0}));
  ASSERT_TRUE(trial.make({.tool = 0, .push = 100.0}));
  const ToolTrial::Mark before = trial.save();
  ASSERT_TRUE(trial.make(kExchange));
  const ToolTrial::Mark after = trial.save();
  ToolTrial copy(trial);
  ASSERT_TRUE(trial.make({.tool = 1, .push = 20.0}));
  const Eigen::Matrix3Xd end = trial.bench().state().x;
  ASSERT_TRUE(copy.make({.tool = 1, .push = 20.0}));
  EXPECT_EQ(copy.bench().state().x, end);

  trial.restore(before);
  EXPECT_EQ(trial.bench().tools()[1].wire.name, "soft");
  EXPECT_EQ(trial.insertion(1), 120.0);
  ASSERT_TRUE(trial.make({.tool = 1, .push = -20.0}));
  ToolTrial never = cobra_trial();
  ASSERT_TRUE(never.make({.tool = 1, .push = 116.0}));
  ASSERT_TRUE(never.make({.tool = 0, .push = 100.0}));
  ToolTrial gone_back(never);  // as restore() leaves it
  ASSERT_TRUE(gone_back.make({.tool = 1, .push = -20.0}));
  EXPECT_EQ(trial.bench().state().x, gone_back.bench().state().x);
  EXPECT_TRUE(trial.finish().tools[1].changes.empty());

  trial.restore(after);
  ASSERT_TRUE(trial.make({.tool = 1, .push = 20.0}));
  EXPECT_EQ(trial.bench().state().x, end);
  const TrialResult result = trial.finish();
  ASSERT_EQ(result.tools[1].changes.size(), 1U);
  EXPECT_EQ(result.pushes.back().stored_energy, copy.pushes().back().stored_energy);
}

TEST(ToolExchange, TheGoalIsThatOfTheWireThatIsBroughtIn) {
  // 100 mm up the aorta, within its lumen of 7 mm: the first wire passes it.
  ToolTrial trial = cobra_trial({.point = Vec3(0.0, 0.0, 105.0), .radius = 9.0});
  ASSERT_TRUE(trial.make({.tool = 1, .push = 126.0}));
  ASSERT_TRUE(trial.make({.tool = 0, .push = 80.0}));
  ToolTrial without(trial);
  EXPECT_NE(without.finish().outcome, Outcome::kReached);
  ASSERT_TRUE(trial.make(kExchange)) << trial.reason();
  EXPECT_FALSE(trial.make({.tool = 1, .push = 60.0}));
  EXPECT_TRUE(trial.reached()) << trial.reason();
}

TEST(ToolExchange, NeedsACatheterInTheBody) {
  ToolTrial trial = cobra_trial();
  ASSERT_TRUE(trial.make({.tool = 1, .push = 50.0}));
  EXPECT_FALSE(trial.make(kExchange));
  EXPECT_NE(trial.reason().find("the tool outside the wire is 0.0 mm in"), std::string::npos)
      << trial.reason();
}

}  // namespace
}  // namespace wireplan::simulate
