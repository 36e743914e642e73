// Tools in one another: derivatives of their energy, what is to be continuous, limits and
// symmetries.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "simulate/insertion/tool_bench.h"
#include "simulate/insertion/tool_scene.h"
#include "tests/simulate/random_values.h"
#include "tests/simulate/tool_bench.h"

namespace wireplan::simulate {
namespace {

/// A tool whose soft, curved tip is followed by a shaft.
Tool curved_tool(double tip_EI, double shaft_EI, double curvature) {
  return {.wire = {.name = "tool",
                   .radius = 0.8,
                   .sections = {{.length = 4.3,
                                 .bending_stiffness = tip_EI,
                                 .axial_stiffness = 900.0,
                                 .rest_curvature = curvature},
                                {.length = 40.0,
                                 .bending_stiffness = shaft_EI,
                                 .axial_stiffness = 900.0,
                                 .rest_curvature = -0.3 * curvature}}},
          .inner_radius = 0.6};
}

/// Crooked tools of which the centreline of the longest has ten edges; ends anywhere in them.
struct CrookedTools {
  std::vector<Tool> tools;
  std::vector<ToolPlace> places;
  Composite composite;
  RodState state;
  Problem problem;

  CrookedTools(std::vector<Tool> several, std::uint64_t seed) : tools(std::move(several)) {
    std::mt19937_64 random(seed);
    for (std::size_t i = 0; i < tools.size(); ++i) {
      places.push_back({.insertion = 7.0 + 4.0 * uniform(random), .roll = uniform(random)});
    }
    build();
    const int n = composite.rod.nodes();
    const RodState straight =
        straight_state(composite.rod, Vec3(1.0, 2.0, 3.0), Vec3::UnitX(), 0.0);
    state = straight;
    state.theta.resize(composite.terms.twists() * (n - 1));
    for (int i = 0; i < n; ++i) {
      for (int d = 0; d < 3; ++d) state.x(d, i) += 0.15 * uniform(random);
    }
    for (double& theta : state.theta) theta = uniform(random);
    transport_frames(straight, state, 0, n - 2);
    problem.last = n;
    problem.proximal.tangent = Vec3(0.8, 0.0, 0.6);
    problem.distal.tangent = Vec3(0.8, 0.6, 0.0);
  }
  CrookedTools(const CrookedTools&) = delete;
  CrookedTools& operator=(const CrookedTools&) = delete;

  void build() {
    composite = build_composite(tools, places, 10);
    problem.rod = &composite.rod;
    problem.tools = composite.terms.twists() > 0 ? &composite.terms : nullptr;
  }
  double energy() const {
    Eigen::Matrix3Xd gradient(3, state.x.cols());
    return Statics::evaluate(problem, state, gradient).total();
  }
  double energy_after(const Eigen::VectorXd& move) const {
    RodState moved = state;
    const int n = composite.rod.nodes();
    for (int i = 0; i < n; ++i) moved.x.col(i) += move.segment<3>(3 * i);
    moved.theta += move.tail(moved.theta.size());
    transport_frames(state, moved, 0, n - 2);
    Eigen::Matrix3Xd gradient(3, n);
    return Statics::evaluate(problem, moved, gradient).total();
  }
  /// With a tool's tip at a place, all nodes as they are.
  double energy_at(std::size_t tool, double insertion) {
    places[tool].insertion = insertion;
    build();
    return energy();
  }
};

std::vector<Tool> three_curved() {
  return {curved_tool(60.0, 90.0, 0.10), curved_tool(30.0, 50.0, 0.07),
          curved_tool(8.0, 20.0, 0.2)};
}

TEST(ToolStack, GradientAndHessianAgreeWithFiniteDifferences) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{3}}) {
      for (const bool clamped : {true, false}) {
        SCOPED_TRACE(seed * 100 + count * 10 + clamped);
        std::vector<Tool> tools = three_curved();
        tools.resize(count);
        CrookedTools c(tools, seed);
        c.composite.rod.stretch *= 1e-2;  // so that it does not hide the others
        c.composite.terms.lead.setConstant(3.0);
        if (!clamped) c.problem.proximal.tangent = c.problem.distal.tangent = {};
        Eigen::VectorXd gradient;
        Eigen::MatrixXd hessian;
        Statics::derivatives(c.problem, c.state, gradient, hessian);
        EXPECT_GT(gradient.tail(c.state.theta.size()).norm(), 0.1);
        EXPECT_LT((hessian - hessian.transpose()).norm(), 1e-12 * hessian.norm());
        std::mt19937_64 random(7);
        for (int k = 0; k < 12; ++k) {
          Eigen::VectorXd d(gradient.size());
          for (double& value : d) value = uniform(random);
          d.normalize();
          const double h = 2e-3;  // truncation h^4 against rounding 1e-13 E / h^2
          const double f0 = c.energy_after(0.0 * d), f1 = c.energy_after(h * d),
                       m1 = c.energy_after(-h * d), f2 = c.energy_after(2 * h * d),
                       m2 = c.energy_after(-2 * h * d);
          const double slope = (8.0 * (f1 - m1) - (f2 - m2)) / (12.0 * h);
          const double curvature = (16.0 * (f1 + m1) - (f2 + m2) - 30.0 * f0) / (12.0 * h * h);
          EXPECT_NEAR(gradient.dot(d), slope, 1e-8 * (1.0 + gradient.norm()));
          EXPECT_NEAR(d.dot(hessian * d), curvature, 1e-6 * (1.0 + std::abs(curvature)));
        }
      }
    }
  }
}

TEST(ToolStack, OneCurvedToolIsTheWireThatItIs) {
  const Tool tool = curved_tool(8.0, 20.0, 0.2);
  CrookedTools c({tool}, 3);
  c.places[0].insertion = 12.9;  // edges of 1.29 mm: sections of the wire end at nodes alone
  c.tools[0].wire.sections[0].length = 3.0 * 1.29;
  c.build();
  const Rod rod = build_rod(c.tools[0].wire, 12.9, 10);
  Problem wire = c.problem;
  wire.rod = &rod;
  wire.tools = nullptr;
  Eigen::VectorXd g_tool, g_wire;
  Eigen::MatrixXd H_tool, H_wire;
  c.composite.rod.stretch = rod.stretch;  // smoothed over neighbours where several tools end
  // What the introducer's spring has of the first node's twist it has less.
  c.composite.terms.lead.setZero();
  EXPECT_NEAR(c.composite.terms.twist(0, 1), rod.twist[1], 2e-5 * rod.twist[1]);
  c.composite.terms.twist(0, 1) = rod.twist[1];
  Statics::derivatives(c.problem, c.state, g_tool, H_tool);
  Statics::derivatives(wire, c.state, g_wire, H_wire);
  EXPECT_LT((g_tool - g_wire).norm(), 1e-12 * g_wire.norm());
  EXPECT_LT((H_tool - H_wire).norm(), 1e-12 * H_wire.norm());
}

TEST(ToolStack, EnergyAndHubForcesHaveNoKinkWhereATipPassesANode) {
  int checked = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    CrookedTools c(three_curved(), seed);
    std::size_t longest = 0;
    for (std::size_t i = 1; i < 3; ++i) {
      if (c.places[i].insertion > c.places[longest].insertion) longest = i;
    }
    const double h = c.composite.rod.rest_length[0];
    for (std::size_t i = 0; i < 3; ++i) {
      if (i == longest) continue;
      const double start = c.places[i].insertion;
      for (int node = 1; node < 9; ++node) {
        const double at = node * h, d = 1e-4;
        EXPECT_NEAR(c.energy_at(i, at - 1e-13), c.energy_at(i, at + 1e-13), 1e-9);
        // One-sided slopes of second order, whose error is of the energy's third derivative.
        const double e0 = c.energy_at(i, at);
        const double after =
            (4.0 * c.energy_at(i, at + d) - c.energy_at(i, at + 2 * d) - 3.0 * e0) / (2 * d);
        const double before =
            (3.0 * e0 - 4.0 * c.energy_at(i, at - d) + c.energy_at(i, at - 2 * d)) / (2 * d);
        EXPECT_NEAR(before, after, 1e-6 * (1.0 + std::abs(after)));
        checked += std::abs(after) > 1e-2;
      }
      c.energy_at(i, start);
    }
  }
  EXPECT_GT(checked, 60);  // of 80 have a force that is not small
}

// ---------------------------------------------------------------- limits and symmetries

TEST(ToolBench, WireInACatheterOfNoStiffnessIsTheWireAlone) {
  Scene one;
  one.wire = uniform_wire(60.0, 20.0, 1e5, 0.0, 0.02);
  one.elements = 60;
  one.supports = {{.at = WireEnd::kProximal, .kind = SupportKind::kClamped, .roll = 0.7}};
  one.loads.tip_force = Vec3(-0.002, 0.004, 0.006);
  one.solver.residual_tolerance = 1e-9;
  const SceneResult alone = run_scene(one);
  ASSERT_EQ(alone.outcome, SceneOutcome::kConverged);

  Tool none = uniform_tool(80.0, 1e-9, 0.05);
  none.wire.sections[0].axial_stiffness = 1e-6;
  ToolScene scene = tools_along_x({none, {.wire = one.wire}}, {{33.3, 0.2}, {60.0, 0.7}});
  scene.loads = one.loads;
  scene.residual_tolerance = 1e-9;
  const ToolBench bench(scene);
  ASSERT_TRUE(bench.settled());
  EXPECT_GT((alone.nodes.col(60) - Vec3(60.0, 0.0, 0.0)).norm(), 10.0);
  EXPECT_LT((bench.state().x - alone.nodes).colwise().norm().maxCoeff(), 1e-6);
}

TEST(ToolBench, TwoStraightToolsAreOneOfTwiceTheStiffness) {
  const auto shape = [](const std::vector<double>& EI) {
    std::vector<Tool> tools;
    for (const double one : EI) {
      tools.push_back(uniform_tool(60.0, one));
      tools.back().wire.sections[0].axial_stiffness = 1e3 * one;
    }
    ToolScene scene = tools_along_x(tools, std::vector<ToolPlace>(EI.size(), {60.0, 0.0}));
    scene.loads.tip_force = Vec3(0.0, 0.02, 0.01);
    const ToolBench bench(scene);
    EXPECT_TRUE(bench.settled());
    return bench.state().x;
  };
  const Eigen::Matrix3Xd two = shape({20.0, 20.0});
  EXPECT_GT(two(1, 60), 10.0);
  EXPECT_LT((two - shape({40.0})).norm(), 1e-6);
  EXPECT_LT((two - shape({10.0, 10.0, 20.0})).norm(), 1e-6);
}

TEST(ToolBench, RoundingBesideAStiffToolIsNoRoughForce) {
  // The wire that slides in it feels nothing; the stiff one, held straight, stores 2e4 N mm.
  std::vector<Tool> tools = {uniform_tool(500.0, 1e5, 0.03), uniform_tool(500.0, 100.0)};
  for (Tool& tool : tools) tool.wire.sections[0].axial_stiffness = 0.0;  // of a solid round rod
  ToolScene scene = tools_along_x(tools, {{60.0, 0.0}, {60.0, 0.0}});
  scene.residual_tolerance = 1e-6;
  scene.moves = {push_of({0.0, 40.0})};
  const ToolSceneResult result = run_tool_scene(scene);
  EXPECT_EQ(result.outcome, SceneOutcome::kConverged);
  EXPECT_EQ(result.reason, "");
  EXPECT_LT(std::abs(result.history.back().work), 0.01);
}

TEST(ToolBench, OrderOfEqualToolsDoesNotMatter) {
  const auto shape = [](bool turned_round) {
    std::vector<Tool> tools = {uniform_tool(60.0, 20.0, 0.03), uniform_tool(60.0, 20.0, 0.05)};
    std::vector<ToolPlace> places = {{31.7, 0.3}, {50.0, 1.4}};
    if (turned_round) {
      std::swap(tools[0], tools[1]);
      std::swap(places[0], places[1]);
    }
    const ToolBench bench(tools_along_x(tools, places));
    EXPECT_TRUE(bench.settled());
    const double force = bench.free_force(turned_round ? 1 : 0);
    EXPECT_GT(std::abs(force), 1e-3);
    return std::pair{bench.state().x, force};
  };
  const auto there = shape(false), back = shape(true);
  EXPECT_LT((there.first - back.first).norm(), 1e-6);
  EXPECT_NEAR(there.second, back.second, 1e-8);
}

TEST(ToolBench, DoesNotChangeUnderRigidMotion) {
  const std::vector<Tool> tools = {uniform_tool(60.0, 50.0, 0.03), uniform_tool(90.0, 20.0, 0.05)};
  ToolScene scene = tools_along_x(tools, {{31.7, 0.3}, {50.0, 1.4}});
  scene.loads.tip_force = Vec3(0.001, -0.004, 0.005);
  const Mat3 R = Eigen::AngleAxisd(1.1, Vec3(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  ToolScene moved = scene;
  moved.point = Vec3(5.0, -3.0, 2.0);
  moved.direction = R * scene.direction;
  moved.loads.tip_force = R * scene.loads.tip_force;
  const Vec3 from = reference_normal(moved.direction), to = R * reference_normal(scene.direction);
  const double zero = std::atan2(from.cross(to).dot(moved.direction), from.dot(to));
  for (ToolPlace& place : moved.places) place.roll += zero;
  const ToolBench here(scene), there(moved);
  ASSERT_TRUE(here.settled() && there.settled());
  const Eigen::Matrix3Xd expected = (R * here.state().x).colwise() + moved.point;
  EXPECT_LT((there.state().x - expected).colwise().norm().maxCoeff(), 1e-6);
  for (std::size_t i = 0; i < 2; ++i) {
    const ToolReport &a = here.record().tools[i], &b = there.record().tools[i];
    EXPECT_NEAR(a.push_force, b.push_force, 1e-7);
    EXPECT_NEAR(a.hub_torque, b.hub_torque, 1e-6);
    EXPECT_NEAR(a.twist, b.twist, 1e-6);
    EXPECT_GT(std::abs(a.hub_torque), 1e-3);
  }
}

}  // namespace
}  // namespace wireplan::simulate
