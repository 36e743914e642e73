// Tools in one another against theory: references K (V14) and L (V17).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "simulate/insertion/tool_bench.h"
#include "tests/simulate/tool_bench.h"

namespace wireplan::simulate {
namespace {

constexpr double kDeg = kPi / 180.0;

// ---------------------------------------------------------------- aligned and turned tools

TEST(ToolVerification, CatheterKeepsItsShareOfCurvatureAndPushesTheWireOut) {
  // V17a and b: a 5F body of radius 15 mm over a floppy wire, one of 150 N mm^2, a Rosen and a
  // Super Stiff; and its soft tip.
  struct Row {
    double catheter, wire, kept, force;
  };
  const double kappa = 1.0 / 15.0;
  for (const Row& row :
       {Row{332, 5, 0.985, 0.011}, Row{332, 150, 0.69, 0.229}, Row{332, 377, 0.47, 0.392},
        Row{332, 1849, 0.15, 0.625}, Row{99, 5, 0.95, 0.0}, Row{99, 150, 0.40, 0.0},
        Row{99, 377, 0.21, 0.0}, Row{99, 1849, 0.05, 0.0}}) {
    SCOPED_TRACE(row.catheter + row.wire);
    const std::vector<Tool> tools = {uniform_tool(30.0, row.catheter, kappa),
                                     uniform_tool(60.0, row.wire)};
    const ToolBench bench(tools_along_x(tools, {{30.0, 0.0}, {18.5, 0.0}}));
    ASSERT_TRUE(bench.settled());
    const double both = row.catheter + row.wire, expected = row.catheter / both;
    EXPECT_NEAR(curvature_at(bench, 10.0) / kappa, expected, 0.005 * expected);
    EXPECT_NEAR(expected, row.kept, 0.006);  // the table is rounded
    EXPECT_NEAR(curvature_at(bench, 25.0) / kappa, 1.0, 0.005);
    const double force = 0.5 * row.catheter * row.wire / both * kappa * kappa;
    EXPECT_NEAR(bench.free_force(1), force, 0.01 * force);
    if (row.force > 0.0) {
      EXPECT_NEAR(force, row.force, 6e-4);
    }
  }
}

TEST(ToolVerification, ToolsTurnedAgainstEachOtherBendByTheVectorSum) {
  // V17c: so stiff to torque that they do not twist.
  const double k1 = 300.0, k2 = 120.0, kappa1 = 0.03, kappa2 = 0.05;
  for (const double turn : {0.0, 40.0, 90.0, 140.0, 180.0}) {
    SCOPED_TRACE(turn);
    const std::vector<Tool> tools = {uniform_tool(50.0, k1, kappa1, 1e6),
                                     uniform_tool(50.0, k2, kappa2, 1e6)};
    const ToolBench bench(tools_along_x(tools, {{50.0, 0.0}, {50.0, turn * kDeg}}));
    ASSERT_TRUE(bench.settled());
    const Eigen::Vector2d sum(k1 * kappa1 + k2 * kappa2 * std::cos(turn * kDeg),
                              k2 * kappa2 * std::sin(turn * kDeg));
    const double expected = sum.norm() / (k1 + k2);
    EXPECT_NEAR(curvature_at(bench, 25.0), expected, 0.005 * expected);
  }
}

// ---------------------------------------------------------------- torsion

/// Two curved tubes of which q is 0.05 per mm, one of them turned by `turn`, over `length`, with
/// straight leads behind.
ToolScene turned_tubes(double length, double lead, double turn) {
  const double kappa = 0.05 / std::sqrt(1.0 + kTubeNu);
  std::vector<Tool> tools = {uniform_tool(length, 40.0, kappa), uniform_tool(length, 40.0, kappa)};
  if (lead > 0.0) {
    for (Tool& tool : tools) {
      Section straight = tool.wire.sections[0];
      straight.length = lead;
      straight.rest_curvature = 0.0;
      tool.wire.sections.push_back(straight);
    }
  }
  ToolScene scene = tools_along_x(tools, {{length, 0.0}, {length, turn}});
  scene.element_length = length / 60.0;
  return scene;
}

TEST(ToolVerification, TubesTwistEachOtherBackAsTheTableSays) {
  // V17d: relative angle at the tip, in degrees.
  struct Row {
    double qL, base, tip;
  };
  // At 1.8 from 175 degrees there are three equilibria; the tubes come to the first.
  for (const Row& row : {Row{0.5, 60, 54.127},   Row{0.5, 90, 82.879},   Row{0.5, 120, 113.489},
                         Row{0.5, 150, 146.072}, Row{0.5, 175, 174.304}, Row{1.0, 60, 40.327},
                         Row{1.0, 90, 63.566},   Row{1.0, 120, 91.668},  Row{1.0, 150, 128.968},
                         Row{1.0, 175, 170.773}, Row{1.4, 60, 28.971},   Row{1.4, 90, 45.794},
                         Row{1.4, 120, 66.591},  Row{1.4, 150, 96.965},  Row{1.4, 175, 153.559},
                         Row{1.8, 60, 19.971},   Row{1.8, 90, 31.362},   Row{1.8, 120, 44.997},
                         Row{1.8, 150, 63.361},  Row{1.8, 175, 89.04}}) {
    SCOPED_TRACE(row.qL * 1000.0 + row.base);
    ToolBench bench(turned_tubes(row.qL / 0.05, 0.0, 0.0));
    ASSERT_TRUE(bench.settled());
    ASSERT_TRUE(bench.move(turn_of({0.0, row.base * kDeg})));
    const ToolRecord& record = bench.record();
    const double tip = row.base + (record.tools[1].twist - record.tools[0].twist) / kDeg;
    EXPECT_NEAR(tip, row.tip, 0.01 * row.tip);
    EXPECT_NEAR(record.tools[0].hub_torque, -record.tools[1].hub_torque, 1e-5);
    EXPECT_EQ(record.released, 0.0);
    EXPECT_NEAR(record.unbalanced, 0.0, 0.01 * record.work);
  }
}

/// Whether tubes that are turned half round against each other stay so: straight, an equilibrium by
/// symmetry, is left where it is a saddle.
bool half_turn_is_stable(double length, double lead) {
  ToolScene scene = turned_tubes(length, lead, kPi);
  scene.residual_tolerance = 1e-6;  // elements are short: 1e-8 may lie below rounding
  const ToolBench bench(scene);
  EXPECT_TRUE(bench.settled());
  return bench.state().x.bottomRows<2>().norm() < 1e-6;
}

TEST(ToolVerification, TubesSnapWhereTheoryHasIt) {
  const double q = 0.05, none = 0.5 * kPi / q;
  EXPECT_NEAR(find_critical(0.8 * none, 1.2 * none, 1e-4,
                            [](double L) { return half_turn_is_stable(L, 0.0); }),
              none, 0.02 * none);
  for (const double lead : {10.0, 100.0}) {
    SCOPED_TRACE(lead);
    const double expected = std::atan(1.0 / (q * lead)) / q;
    EXPECT_NEAR(find_critical(0.8 * expected, 1.2 * expected, 1e-4,
                              [&](double L) { return half_turn_is_stable(L, lead); }),
                expected, 0.02 * expected);
  }
}

TEST(ToolVerification, ATurnedTubeJumpsOverAndReleasesTheEnergy) {
  // Beyond the snap the inner tube jumps as it is turned all round, and its tip is then where it
  // was; the hand has done the work that the jump released.
  ToolBench bench(turned_tubes(2.2 / 0.05, 0.0, 0.0));
  ASSERT_TRUE(bench.settled());
  const double start = bench.record().energy.total();
  ASSERT_TRUE(bench.move(turn_of({0.0, 360.0 * kDeg})));
  const ToolRecord& record = bench.record();
  EXPECT_NEAR(record.tools[1].twist - record.tools[0].twist, 0.0, 1e-5);
  EXPECT_NEAR(record.energy.total(), start, 1e-8);
  EXPECT_GT(record.released, 0.05);
  EXPECT_NEAR(record.work, record.released, 1e-6);
  EXPECT_NEAR(record.unbalanced, 0.0, 0.01 * record.released);

  // Short of it nothing jumps, and the work comes back.
  ToolBench smooth(turned_tubes(1.2 / 0.05, 0.0, 0.0));
  ASSERT_TRUE(smooth.settled() && smooth.move(turn_of({0.0, 360.0 * kDeg})));
  EXPECT_EQ(smooth.record().released, 0.0);
  EXPECT_NEAR(smooth.record().work, 0.0, 1e-6);
}

// ---------------------------------------------------------------- forces of the hands

TEST(ToolVerification, WirePushedThroughACathetersMouthFeelsTheConfigurationalForce) {
  // V14 with a stiff straight catheter for the sleeve: P l^2 / EI.
  struct Row {
    double d, clamped, pinned;
  };
  const double l = 60.0, sleeve = 20.0, EI = 10.0;
  for (const Row& row : {Row{0.05, 33.2115, 16.8761}, Row{0.10, 28.0459, 14.1507},
                         Row{0.20, 20.1754, 10.0141}, Row{0.40, 10.6227, 5.0344}}) {
    for (const bool clamped : {true, false}) {
      SCOPED_TRACE(row.d + 10.0 * clamped);
      ToolScene scene = tools_along_x({uniform_tool(sleeve, 1e6), uniform_tool(200.0, EI)},
                                      {{sleeve, 0.0}, {sleeve + l * (1.0 + row.d), 0.0}});
      scene.distal = Support{.at = WireEnd::kDistal,
                             .kind = clamped ? SupportKind::kClamped : SupportKind::kPinned,
                             .point = Vec3(sleeve + l, 0.0, 0.0)};
      scene.plane = Vec3::UnitZ();  // beyond it a pinned wire would lie sideways
      scene.residual_tolerance = 1e-7;
      const ToolBench bench(scene);
      ASSERT_TRUE(bench.settled());
      const double expected = (clamped ? row.clamped : row.pinned) * EI / (l * l);
      EXPECT_NEAR(bench.free_force(1), expected, 0.01 * expected);
      // All forces on the tools balance.
      EXPECT_LT((bench.introducer_force() + bench.distal_force()).norm(), 1e-5);
    }
  }
}

TEST(ToolVerification, HandsTogetherFeelWhatTheIntroducerHolds) {
  // All tools pushed at once are one rod at the introducer: P = N - M^2 / (2 EI) there.
  const double length = 60.0;
  for (const double inner : {25.0, 59.0}) {
    SCOPED_TRACE(inner);
    ToolScene scene = tools_along_x({uniform_tool(80.0, 30.0), uniform_tool(80.0, 20.0)},
                                    {{length, 0.0}, {inner, 0.0}});
    scene.loads.tip_force = Vec3(-0.006, 0.006, 0.0);
    ToolBench bench(scene);
    ASSERT_TRUE(bench.settled());
    const Vec3 tip = bench.state().x.rightCols<1>();
    const double M = tip.cross(scene.loads.tip_force).norm();
    const double expected = -scene.loads.tip_force.x() - M * M / (2.0 * 50.0);
    EXPECT_NEAR(bench.free_force(0) + bench.free_force(1), expected, 0.01 * M * M / (2.0 * 50.0));
    EXPECT_LT((bench.introducer_force() + scene.loads.tip_force).norm(), 1e-6);
  }
}

TEST(ToolVerification, PulledWireGrowsItsForceOverTheCatheterAsOnACapstan) {
  // V17e: a limp wire through a stiff bent catheter, held back at its tip.
  const double kappa = 1.0 / 20.0, held = 0.2;
  for (const double mu : {0.1, 0.3}) {
    for (const double angle : {60.0, 150.0}) {
      SCOPED_TRACE(mu * 1000.0 + angle);
      const double length = angle * kDeg / kappa;
      Tool wire = uniform_tool(200.0, 0.01);
      wire.wire.radius = 0.3;
      ToolScene scene = tools_along_x({uniform_tool(length, 1e4, kappa), wire},
                                      {{length, 0.0}, {length + 5.0, 0.0}});
      scene.friction = mu;
      scene.element_length = 0.5;
      const double end = angle * kDeg;
      scene.loads.tip_force = held * Vec3(std::cos(end), 0.0, 0.0) +
                              held * std::sin(end) * reference_normal(Vec3::UnitX());
      ToolBench bench(scene);
      ASSERT_TRUE(bench.settled());
      ASSERT_TRUE(bench.move(push_of({0.0, -0.5})));
      const double expected = held * std::exp(mu * angle * kDeg);
      const ToolRecord& record = bench.record();
      EXPECT_NEAR(record.tools[1].push_force, -expected, 0.03 * expected);
      // The catheter is dragged along by as much as the wire is held back.
      EXPECT_NEAR(record.tools[0].push_force - bench.free_force(0), expected - held,
                  0.03 * expected);
      EXPECT_NEAR(record.heat, 0.5 * (expected - held), 0.03 * expected);
    }
  }
}

TEST(ToolVerification, FrictionOfABentWireDoesNotHangOnTheElements) {
  // A wire that leaves a curved catheter is pressed on its mouth by a couple.
  const auto friction = [](double element_length) {
    Tool wire = uniform_tool(120.0, 100.0);
    wire.wire.radius = 0.45;
    ToolScene scene =
        tools_along_x({uniform_tool(40.0, 300.0, 1.0 / 20.0), wire}, {{40.0, 0.0}, {60.0, 0.0}});
    scene.friction = 0.2;
    scene.element_length = element_length;
    ToolBench bench(scene);
    EXPECT_TRUE(bench.settled() && bench.move(push_of({0.0, 1.0})));
    return bench.record().contacts[0].friction_force;
  };
  const double coarse = friction(1.0), fine = friction(0.25);
  EXPECT_GT(fine, 0.05);
  EXPECT_NEAR(coarse, fine, 0.15 * fine);  // the play is bridged by whole elements
}

TEST(ToolVerification, TipThatIsHeldStaysWhereItIsHeldAsToolsMove) {
  for (const bool clamped : {true, false}) {
    SCOPED_TRACE(clamped);
    ToolScene scene = tools_along_x({uniform_tool(200.0, 100.0), uniform_tool(300.0, 100.0)},
                                    {{30.0, 0.0}, {50.0, 0.0}});
    scene.distal = Support{.at = WireEnd::kDistal,
                           .kind = clamped ? SupportKind::kClamped : SupportKind::kPinned,
                           .point = Vec3(45.0, 5.0, 0.0)};
    scene.moves = {push_of({0.0, 20.0}), push_of({10.0, -10.0}), turn_of({1.0, 0.0})};
    ToolBench bench(scene);
    ASSERT_TRUE(bench.settled());
    double work = 0.0;
    for (const ToolMove& move : scene.moves) {
      const ToolRecord before = bench.record();
      ASSERT_TRUE(bench.move(move));
      EXPECT_LT((bench.record().tools[1].tip - scene.distal->point).norm(), 1e-9);
      EXPECT_LT((bench.introducer_force() + bench.distal_force()).norm(), 1e-5);
      work += std::abs(bench.record().work - before.work);
    }
    EXPECT_GT(work, 1.0);
    EXPECT_LT(std::abs(bench.record().unbalanced), 0.01 * work);
  }
}

TEST(ToolVerification, ToolsComeOutAndGoInWhole) {
  // By pushes that add up but for rounding; without the wire the catheter is as it lies unloaded.
  ToolScene scene = tools_along_x({uniform_tool(60.0, 100.0, 0.05), uniform_tool(80.3, 100.0)},
                                  {{30.0, 0.0}, {20.3, 0.0}});
  scene.friction = 0.1;
  scene.moves = {push_of({0.0, -0.1}), push_of({0.0, -20.1}), push_of({0.0, -0.1}),
                 turn_of({1.0, 0.0}),  push_of({0.0, 80.3}),  push_of({30.0, 0.0}),
                 push_of({-60.0, 0.0})};
  ToolBench bench(scene);
  ASSERT_TRUE(bench.settled());
  const double straight = 0.5 * 100.0 * 0.05 * 0.05;  // what the introducer stores per length [N]
  for (std::size_t k = 0; k < scene.moves.size(); ++k) {
    SCOPED_TRACE(k);
    ASSERT_TRUE(bench.move(scene.moves[k]));
    EXPECT_TRUE(std::isfinite(bench.record().tools[1].push_force));
    if (k == 2) {
      EXPECT_EQ(bench.places()[1].insertion, 0.0);
      EXPECT_NEAR(bench.record().energy.total(), 30.0 * straight, 1e-6);
    }
  }
  EXPECT_EQ(bench.places()[0].insertion, 0.0);
  EXPECT_EQ(bench.places()[1].insertion, 80.3);
  EXPECT_NEAR(bench.record().energy.total(), 60.0 * straight, 1e-6);
}

TEST(ToolVerification, WorkOfTheHandsIsTheEnergyThatTheToolsGain) {
  // A sheath, a curved catheter and a J wire, pushed, pulled and turned one by one and together.
  Tool wire = uniform_tool(300.0, 60.0, 0.0);
  wire.wire.sections = {{.length = 15.0, .bending_stiffness = 8.0, .rest_curvature = 0.2},
                        {.length = 285.0, .bending_stiffness = 60.0}};
  wire.wire.radius = 0.45;
  Tool catheter = uniform_tool(250.0, 99.0);
  catheter.wire.sections = {{.length = 30.0, .bending_stiffness = 99.0, .rest_curvature = 0.05},
                            {.length = 220.0, .bending_stiffness = 332.0}};
  ToolScene scene = tools_along_x({uniform_tool(200.0, 700.0), catheter, wire},
                                  {{20.0, 0.0}, {50.0, 0.0}, {70.0, 0.5}});
  scene.loads.tip_force = Vec3(0.0, 0.01, -0.02);
  scene.element_length = 1.5;
  scene.moves = {push_of({0.0, 0.0, -45.0}), turn_of({0.0, 1.5, 0.0}), push_of({10.0, -12.0, 0.0}),
                 push_of({5.0, 15.0, 45.0})};
  ToolBench bench(scene);
  ASSERT_TRUE(bench.settled());
  for (const ToolMove& move : scene.moves) {
    const ToolRecord before = bench.record();
    ASSERT_TRUE(bench.move(move));
    const ToolRecord& after = bench.record();
    const double gained = after.energy.total() - before.energy.total();
    EXPECT_NEAR(after.work - before.work, gained + after.released - before.released, 1e-9);
    EXPECT_LT(std::abs(after.unbalanced - before.unbalanced),
              0.01 * (std::abs(gained) + after.released - before.released));
    EXPECT_GT(std::abs(gained), 1e-3);
  }
}

}  // namespace
}  // namespace wireplan::simulate
