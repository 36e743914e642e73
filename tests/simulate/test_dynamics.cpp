// The paper's conjugate gradient and the Euler schemes against Newton's method and linear theory;
// the bench's methods, twist and unequal elements.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "simulate/equilibrium/dynamics.h"
#include "simulate/insertion/scene.h"
#include "simulate/wire/quartic.h"
#include "tests/simulate/paper_wire.h"

namespace wireplan::simulate {
namespace {

/// The paper's wire, clamped at one end, under its own weight.
struct HeavyCantilever {
  Rod rod;
  Eigen::Matrix3Xd load;
  Problem problem;
  RodState state;

  explicit HeavyCantilever(int elements) : rod(build_rod(paper_wire(), 40.0, elements)) {
    load = Vec3(0.0, -9810.0, 0.0) * rod.mass.transpose();
    problem.rod = &rod;
    problem.last = rod.nodes();
    problem.proximal = {.hold_along = true, .hold_across = true, .tangent = Vec3::UnitX()};
    problem.load = &load;
    state = straight_state(rod, Vec3::Zero(), Vec3::UnitX(), 0.0);
  }

  RodState equilibrium() const {
    RodState rest = state;
    Statics statics;
    EXPECT_TRUE(statics.solve(problem, rest, {.residual_tolerance = 1e-10}).converged);
    return rest;
  }

  /// Crooked from its rest by waves of different length, so that every term takes part.
  RodState crooked() const {
    RodState bent = state;
    for (int i = 1; i < rod.nodes(); ++i) {
      bent.x.col(i) += 0.3 * Vec3(std::sin(0.9 * i), std::sin(0.4 * i), std::cos(1.7 * i));
    }
    return bent;
  }
};

double energy_at(const Problem& problem, const RodState& state) {
  Eigen::Matrix3Xd gradient(3, state.x.cols());
  return Statics::evaluate(problem, state, gradient).total();
}

double largest_move(const RodState& a, const RodState& b) {
  return (a.x - b.x).colwise().norm().maxCoeff();
}

// ---------------------------------------------------------------- line search

TEST(LowestPoint, IsTheLowestOfManySamples) {
  const std::vector<Quartic> quartics = {
      {-1.0, 1.0, 0.0, 0.0},         // parabola
      {-1.0, 2.0, -0.5, 0.3},        // convex
      {-1.0, 0.0, 0.0, 1.0},         // no curvature at the start
      {-1.0, -2.0, 0.5, 1.0},        // falls faster at first
      {-1.0, 6.0, -9.0, 4.0},        // two valleys, the further one lower
      {-1e-12, 1e-6, 1e3, 1e12},     // slopes of a wire near its rest, all units apart
      {-1e-20, -1e-18, 0.0, 1e-30},  // lowest point far away
  };
  for (const Quartic& q : quartics) {
    SCOPED_TRACE(q.a1);
    SCOPED_TRACE(q.a2);
    const double s = lowest_point(q, std::numeric_limits<double>::infinity());
    ASSERT_GT(s, 0.0);
    EXPECT_LT(q.at(s), 0.0);
    for (int k = 1; k <= 3000; ++k) EXPECT_LE(q.at(s), q.at(s * k * 1e-3) * (1.0 - 1e-12));
    // It is a point of no slope, to rounding of the largest term.
    const double slope = q.a1 + s * (2.0 * q.a2 + s * (3.0 * q.a3 + s * 4.0 * q.a4));
    const double largest = std::abs(q.a1) + std::abs(2.0 * q.a2 * s) +
                           std::abs(3.0 * q.a3 * s * s) + std::abs(4.0 * q.a4 * s * s * s);
    EXPECT_LT(std::abs(slope), 1e-12 * largest);
    EXPECT_LE(lowest_point(q, 0.5 * s), 0.5 * s);
  }
}

// ---------------------------------------------------------------- conjugate gradient

TEST(ConjugateGradient, FirstStepGoesToTheLowestEnergyAlongTheForce) {
  const HeavyCantilever wire(20);
  const RodState start = wire.crooked();
  RodState moved = start;
  const MotionResult step =
      run_conjugate_gradient(wire.problem, moved, {.time_step = 1.0, .duration = 1.0});
  ASSERT_EQ(step.steps, 1);

  // Along minus the gradient, the held node apart.
  Eigen::Matrix3Xd direction(3, wire.rod.nodes());
  Statics::evaluate(wire.problem, start, direction);
  direction.col(0).setZero();
  direction *= -1.0;
  const double lambda = direction.cwiseProduct(moved.x - start.x).sum() / direction.squaredNorm();
  EXPECT_LT((moved.x - start.x - lambda * direction).norm(), 1e-12);
  const double lowest = energy_at(wire.problem, moved);
  EXPECT_NEAR(step.energy, lowest, 1e-12 * std::abs(lowest));
  EXPECT_GT(lambda * direction.norm(), 1e-3);
  for (int k = 0; k <= 300; ++k) {
    RodState other = start;
    other.x += 0.01 * k * lambda * direction;
    EXPECT_GE(energy_at(wire.problem, other), lowest - 1e-12 * std::abs(lowest)) << k;
  }
  // The quartic is exact: no slope is left at the lowest point.
  Eigen::Matrix3Xd after(3, wire.rod.nodes());
  Statics::evaluate(wire.problem, moved, after);
  EXPECT_LT(std::abs(after.cwiseProduct(direction).sum()), 1e-10 * after.norm() * direction.norm());
}

TEST(ConjugateGradient, ReachesTheRestThatNewtonFinds) {
  const HeavyCantilever wire(20);
  const RodState rest = wire.equilibrium();
  RodState state = wire.state;
  const MotionResult motion = run_conjugate_gradient(
      wire.problem, state, {.time_step = 1e-3, .duration = 100.0, .residual_tolerance = 1e-9});
  EXPECT_EQ(motion.outcome, MotionOutcome::kConverged);
  EXPECT_LE(motion.residual, 1e-9);
  EXPECT_LT(motion.steps, 40000);
  EXPECT_LT(largest_move(state, rest), 1e-3);  // 1e-9 N on 3 EI/L^3 = 4e-5 N/mm, per node
}

TEST(ConjugateGradient, NeverRaisesTheEnergyAndKnowsNoTimeStep) {
  // Also far past the point where only rounding is left, which must then restart it.
  for (const double time_step : {1e-6, 1e-3, 1.0}) {
    HeavyCantilever wire(20);
    RodState state = wire.crooked();
    const double start = energy_at(wire.problem, state);
    const MotionResult motion = run_conjugate_gradient(
        wire.problem, state, {.time_step = time_step, .duration = 50000 * time_step});
    EXPECT_EQ(motion.steps, 50000);
    EXPECT_EQ(motion.outcome, MotionOutcome::kFinished);
    EXPECT_LT(motion.energy, start);
    EXPECT_LT(motion.worst_energy_rise, 1e-12 * std::abs(motion.energy)) << "rounding of 60 sums";
    EXPECT_GE(motion.restarts, 1) << "rounding turns a direction uphill";
    EXPECT_LT(largest_move(state, wire.equilibrium()), 1e-6);
    EXPECT_TRUE(std::isinf(motion.critical_time_step));
  }
}

TEST(ConjugateGradient, KeepsWhatSupportsHold) {
  // Proximal end guided along x, distal end pinned: the wire hangs between them.
  HeavyCantilever wire(12);
  wire.problem.proximal.hold_along = false;
  wire.problem.distal.hold_along = wire.problem.distal.hold_across = true;
  RodState state = wire.state, rest = wire.state;
  Statics statics;
  ASSERT_TRUE(statics.solve(wire.problem, rest, {.residual_tolerance = 1e-10}).converged);
  const MotionResult motion = run_conjugate_gradient(
      wire.problem, state, {.time_step = 1.0, .duration = 1e5, .residual_tolerance = 1e-8});
  EXPECT_EQ(motion.outcome, MotionOutcome::kConverged);
  EXPECT_EQ(state.x.col(12), wire.state.x.col(12));
  EXPECT_EQ(state.x.col(0).tail<2>(), Eigen::Vector2d::Zero());
  EXPECT_GT(std::abs(state.x(0, 0)), 0.1) << "the guided end slides";
  EXPECT_LT(largest_move(state, rest), 1e-2);  // 1e-8 N on the softest mode, 1e-5 N/mm
}

// ---------------------------------------------------------------- Euler schemes

using Scheme = MotionResult (*)(const Problem&, RodState&, const MotionOptions&);

/// Runs the unloaded wire, its nodes shaken by 1 nm, at a part of the scheme's own limit: there the
/// linear theory that gives the limit is exact.
MotionResult run_at(Scheme scheme, double part_of_limit, double damping, long steps = 20000) {
  HeavyCantilever wire(20);
  wire.problem.load = nullptr;
  RodState state = wire.state;
  for (int i = 1; i < wire.rod.nodes(); ++i) {
    state.x.col(i) += 1e-6 * Vec3(std::sin(2.9 * i), std::sin(0.4 * i), std::cos(1.7 * i));
  }
  RodState probe = state;
  const double limit =
      scheme(wire.problem, probe, {.time_step = 1e-9, .duration = 1e-9, .damping = damping})
          .critical_time_step;
  const double time_step = part_of_limit * limit;
  const MotionResult motion = scheme(wire.problem, state,
                                     {.time_step = time_step,
                                      .duration = static_cast<double>(steps) * time_step,
                                      .damping = damping});
  EXPECT_TRUE(state.x.allFinite());
  EXPECT_TRUE(std::isfinite(motion.energy));
  if (part_of_limit < 1.0) {
    EXPECT_LT(motion.energy, 1e-6) << "shaking gave 2e-9 N mm; close to the limit it swings higher";
  }
  return motion;
}

TEST(ExplicitEuler, IsStableBelowItsLimitAndNotAbove) {
  // The limit is c / w^2 where damping is weak, and what grows beyond it does so slowly.
  EXPECT_EQ(run_at(run_explicit_euler, 0.99, 2000.0).outcome, MotionOutcome::kFinished);
  EXPECT_EQ(run_at(run_explicit_euler, 1.3, 2000.0, 60000).outcome, MotionOutcome::kUnstable);
  // It is 2 / c where damping rules.
  EXPECT_EQ(run_at(run_explicit_euler, 0.99, 2e5).outcome, MotionOutcome::kFinished);
  EXPECT_EQ(run_at(run_explicit_euler, 1.01, 2e5).outcome, MotionOutcome::kUnstable);
}

TEST(ExplicitEuler, IsUnstableAtEveryTimeStepWithoutDamping) {
  HeavyCantilever wire(20);
  for (const double time_step : {1e-6, 1e-5}) {
    RodState state = wire.state;
    const MotionResult motion =
        run_explicit_euler(wire.problem, state, {.time_step = time_step, .duration = 0.2});
    EXPECT_EQ(motion.critical_time_step, 0.0);
    EXPECT_EQ(motion.outcome, MotionOutcome::kUnstable);
    EXPECT_TRUE(state.x.allFinite());
  }
}

TEST(SemiImplicitEuler, IsStableBelowItsLimitAndNotAbove) {
  for (const double damping : {0.0, 2e4}) {
    SCOPED_TRACE(damping);
    EXPECT_EQ(run_at(run_semi_implicit_euler, 0.99, damping).outcome, MotionOutcome::kFinished);
    EXPECT_EQ(run_at(run_semi_implicit_euler, 1.01, damping).outcome, MotionOutcome::kUnstable);
  }
}

TEST(SemiImplicitEuler, LimitIsThatOfTheChain) {
  // A straight uniform chain's fastest mode is axial; with half a mass at its free end, w^2 = 4
  // EA/(h m) cos^2(pi/4n), as for every clamped-free chain.
  HeavyCantilever wire(20);
  RodState state = wire.state;
  const double h = 2.0, m = 2e-7, EA = 160.0, EI = 0.8;
  const double w = std::sqrt((4.0 * EA / h + 16.0 * EI / (h * h * h)) / m) * std::cos(kPi / 80.0);
  const double limit =
      run_semi_implicit_euler(wire.problem, state, {.time_step = 1e-9, .duration = 1e-9})
          .critical_time_step;
  EXPECT_NEAR(limit, 2.0 / w, 1e-3 * limit);  // what the power iteration leaves
}

TEST(EulerSchemes, ComeToRestWhereNewtonDoes) {
  // Damping near critical for the slowest mode, w = 6/s, brings the wire to rest within seconds.
  HeavyCantilever wire(10);
  const RodState rest = wire.equilibrium();
  RodState state = wire.state;
  const MotionResult motion = run_semi_implicit_euler(
      wire.problem, state,
      {.time_step = 1e-4, .duration = 20.0, .residual_tolerance = 1e-7, .damping = 20.0});
  EXPECT_EQ(motion.outcome, MotionOutcome::kConverged);
  EXPECT_LT(motion.time, 10.0);
  EXPECT_LT(largest_move(state, rest), 0.02);  // 1e-7 N on 4e-5 N/mm, several nodes
}

TEST(EulerSchemes, PapersTableIsRunAtStableTimeSteps) {
  // 1 ms for the conjugate gradient; 1 us for the explicit scheme, which needs damping for it.
  HeavyCantilever wire(20);
  RodState a = wire.state, b = wire.state;
  const MotionResult gradient =
      run_conjugate_gradient(wire.problem, a, {.time_step = 1e-3, .duration = 0.05});
  const MotionResult explicit_euler =
      run_explicit_euler(wire.problem, b, {.time_step = 1e-6, .duration = 0.05, .damping = 2000.0});
  EXPECT_EQ(gradient.outcome, MotionOutcome::kFinished);
  EXPECT_EQ(gradient.steps, 50);
  EXPECT_EQ(explicit_euler.outcome, MotionOutcome::kFinished);
  EXPECT_EQ(explicit_euler.steps, 50000);
  EXPECT_GT(explicit_euler.critical_time_step, 1e-6);
  EXPECT_NEAR(explicit_euler.time, 0.05, 1e-12);
}

// ---------------------------------------------------------------- the bench

Scene heavy_scene(Method method) {
  Scene scene;
  scene.wire = paper_wire();
  scene.supports = {{.at = WireEnd::kProximal, .kind = SupportKind::kClamped}};
  scene.loads.gravity = Vec3(0.0, -9810.0, 0.0);
  scene.solver.method = method;
  return scene;
}

TEST(Bench, MethodsAgreeOnTheRest) {
  const SceneResult newton = run_scene(heavy_scene(Method::kNewton));
  Scene scene = heavy_scene(Method::kConjugateGradient);
  scene.solver.duration = 60.0;
  const SceneResult gradient = run_scene(scene);
  ASSERT_EQ(newton.outcome, SceneOutcome::kConverged);
  ASSERT_EQ(gradient.outcome, SceneOutcome::kConverged);
  EXPECT_LT((newton.nodes - gradient.nodes).norm(), 0.1);  // 1e-6 N on 4e-5 N/mm
  EXPECT_NEAR(gradient.time, 1e-3 * gradient.iterations, 1e-9);
  EXPECT_NEAR(gradient.reactions[0].force.y(), 4e-6 * 9810.0, 1e-5) << "the wire's weight";
  scene.solver.duration = 0.1;
  const SceneResult short_run = run_scene(scene);
  EXPECT_EQ(short_run.outcome, SceneOutcome::kNotConverged);
  EXPECT_NE(short_run.reason.find("after 0.1 s"), std::string::npos) << short_run.reason;
}

TEST(Bench, UnstableRunsSayTheLimit) {
  Scene scene = heavy_scene(Method::kSemiImplicitEuler);
  scene.solver.time_step = 1e-3;
  const SceneResult semi = run_scene(scene);
  EXPECT_EQ(semi.outcome, SceneOutcome::kUnstable);
  EXPECT_NE(semi.reason.find("4.99e-05"), std::string::npos) << semi.reason;
  EXPECT_TRUE(semi.nodes.allFinite());
  scene.solver.method = Method::kExplicitEuler;
  const SceneResult explicit_euler = run_scene(scene);
  EXPECT_EQ(explicit_euler.outcome, SceneOutcome::kUnstable);
  EXPECT_NE(explicit_euler.reason.find("without damping"), std::string::npos)
      << explicit_euler.reason;
}

TEST(Bench, UnequalElementsFillTheirSectionsAndKeepTheTip) {
  // The same wire in two sections: 10 mm of tip in fine elements, the rest in coarse ones.
  const auto tip_of = [](double fine, double coarse) {
    Scene scene = heavy_scene(Method::kNewton);
    Section tip = scene.wire.sections[0], shaft = tip;
    tip.length = 10.0;
    shaft.length = 30.0;
    scene.wire.sections = {tip, shaft};
    scene.element_length = {fine, coarse};
    const SceneResult result = run_scene(scene);
    EXPECT_EQ(result.outcome, SceneOutcome::kConverged);
    const Eigen::VectorXd lengths = edge_lengths(scene);
    EXPECT_NEAR(lengths.sum(), 40.0, 1e-12);
    EXPECT_LE(lengths[0], coarse);
    EXPECT_LE(lengths[lengths.size() - 1], fine);
    return Vec3(result.nodes.rightCols<1>());
  };
  Scene equal = heavy_scene(Method::kNewton);
  equal.elements = 320;
  const Vec3 reference = run_scene(equal).nodes.rightCols<1>();
  const double e1 = (tip_of(0.7, 2.0) - reference).norm(),
               e2 = (tip_of(0.35, 1.0) - reference).norm();
  EXPECT_LT(e1, 0.25);                 // 20 equal elements: 0.21 mm
  EXPECT_GT(std::log2(e1 / e2), 1.8);  // second order
}

TEST(Bench, SectionsWithoutAnElementLengthFollowTheNumberOfElements) {
  Scene scene;
  scene.wire = {.name = "wire", .radius = 0.4, .sections = {{.length = 5.0}, {.length = 35.0}}};
  scene.elements = 40;
  scene.element_length = {0.3, 0.0};
  const Eigen::VectorXd lengths = edge_lengths(scene);
  ASSERT_EQ(lengths.size(), 35 + 17);
  EXPECT_NEAR(lengths[0], 1.0, 1e-12) << "the shaft is proximal";
  EXPECT_NEAR(lengths[51], 5.0 / 17.0, 1e-12);
}

TEST(DecoupledTwist, IsTheChainOfThePaper) {
  Scene scene = heavy_scene(Method::kNewton);
  scene.twist = Twist::kDecoupled;
  scene.supports[0].roll = 0.5;
  Section tip = scene.wire.sections[0], shaft = tip;
  tip.length = 10.0;
  tip.twist_stiffness = 0.1;
  shaft.length = 30.0;
  scene.wire.sections = {tip, shaft};
  scene.loads.tip_torque = 0.02;
  const SceneResult turned = run_scene(scene);
  const double shaft_turn = 0.02 * 30.0 / 0.62, tip_turn = 0.02 * 10.0 / 0.1;  // T L / GJ
  ASSERT_EQ(turned.roll.size(), 21);
  EXPECT_DOUBLE_EQ(turned.roll[0], 0.5);
  EXPECT_NEAR(turned.roll[15], 0.5 + shaft_turn, 1e-12);
  EXPECT_NEAR(turned.roll[20], 0.5 + shaft_turn + tip_turn, 1e-12);
  EXPECT_NEAR(turned.roll[4] - turned.roll[3], 0.02 * 2.0 / 0.62, 1e-12);  // k_i = GJ/l
  EXPECT_NEAR(turned.energy.twist, 0.5 * 0.02 * (shaft_turn + tip_turn), 1e-12);
  EXPECT_NEAR(turned.moment_energy, -0.02 * (shaft_turn + tip_turn), 1e-12);

  // The shape is that without twist, bit for bit.
  scene.twist = Twist::kAuto;
  scene.loads.tip_torque = 0.0;
  const SceneResult plain = run_scene(scene);
  EXPECT_EQ(plain.nodes, turned.nodes);
  EXPECT_EQ(plain.roll.size(), 0);
  EXPECT_EQ(plain.twist.size(), 0);
}

TEST(DecoupledTwist, AgreesWithTheCoupledOneOnAStraightWire) {
  Scene scene = heavy_scene(Method::kNewton);
  scene.loads.gravity.setZero();
  scene.supports.push_back({.at = WireEnd::kDistal,
                            .kind = SupportKind::kClamped,
                            .point = Vec3(40.0, 0.0, 0.0),
                            .roll = 1.2});
  scene.twist = Twist::kDecoupled;
  const SceneResult chain = run_scene(scene);
  scene.twist = Twist::kCoupled;
  const SceneResult rod = run_scene(scene);
  ASSERT_EQ(rod.outcome, SceneOutcome::kConverged);
  EXPECT_EQ(rod.terms, (std::vector<std::string>{"stretch", "bend", "twist"}));
  const double torque = 0.62 * 1.2 / 40.0;
  for (const SceneResult* result : {&chain, &rod}) {
    EXPECT_NEAR(result->reactions[1].moment.x(), torque, 1e-9);
    EXPECT_NEAR(result->reactions[0].moment.x(), -torque, 1e-9);
    EXPECT_NEAR(result->twist.sum(), 1.2, 1e-12);
    EXPECT_NEAR(result->energy.twist, 0.5 * torque * 1.2, 1e-12);
  }
  EXPECT_LT((rod.twist - chain.twist).norm(), 1e-12);
  EXPECT_LT((rod.nodes - chain.nodes).norm(), 1e-9);
}

TEST(Bench, ReactionsBalanceAForceOnACurvedWireOutOfItsPlane) {
  Scene scene;
  scene.wire = {.name = "wire",
                .radius = 0.4,
                .sections = {{.length = 50.0,
                              .bending_stiffness = 20.0,
                              .axial_stiffness = 1e4,
                              .rest_curvature = 0.02}}};
  scene.supports = {
      {.at = WireEnd::kProximal, .kind = SupportKind::kClamped, .point = Vec3(1.0, 2.0, 3.0)}};
  scene.loads.tip_force = Vec3(0.005, 0.01, 0.02);
  scene.solver.residual_tolerance = 1e-9;
  const SceneResult result = run_scene(scene);
  ASSERT_EQ(result.outcome, SceneOutcome::kConverged);
  EXPECT_EQ(result.terms, (std::vector<std::string>{"stretch", "bend", "twist", "tip_force"}));
  const Reaction& reaction = result.reactions[0];
  const Vec3 arm = result.nodes.rightCols<1>() - result.nodes.col(0);
  const Vec3 moment = arm.cross(scene.loads.tip_force);
  EXPECT_GT(std::abs(moment.x()), 0.05) << "part of it is torque";
  EXPECT_LT((reaction.force + scene.loads.tip_force).norm(), 1e-7);  // 20 residuals
  EXPECT_LT((reaction.moment + moment).norm(), 1e-6 * moment.norm());
}

TEST(Bench, CurvedWireWithoutLoadStaysAtRest) {
  Scene scene;
  scene.wire = {.name = "wire",
                .radius = 0.4,
                .sections = {{.length = 20.0, .bending_stiffness = 5.0, .rest_curvature = 0.08},
                             {.length = 30.0, .bending_stiffness = 50.0}}};
  scene.elements = 50;
  scene.supports = {{.at = WireEnd::kProximal, .kind = SupportKind::kClamped, .roll = 0.7}};
  const SceneResult result = run_scene(scene);
  EXPECT_EQ(result.outcome, SceneOutcome::kConverged);
  EXPECT_LE(result.iterations, 1);
  // Turned by r, a bend element of quadratic energy stretches its edges with B/h (1 - cos r)^2 / 2.
  EXPECT_LT(std::abs(result.energy.total()), 1e-8);
  const Vec3 tip = result.nodes.rightCols<1>(), start = result.nodes.col(0);
  const double R = 1.0 / 0.08, angle = 1.6;
  const Vec3 toward = Eigen::AngleAxisd(0.7, Vec3::UnitX()) * Vec3(-Vec3::UnitY());
  // Arc of the wire's tip; the chain's is as long to h^2/24 R^2 = 3e-4.
  EXPECT_LT((tip - start - (30.0 + R * std::sin(angle)) * Vec3::UnitX() -
             R * (1.0 - std::cos(angle)) * toward)
                .norm(),
            1e-3 * 20.0);
}

TEST(Bench, TipMomentBendsTheWireToAnArc) {
  // M = EI phi / L turns the tip by phi; the chain does so to second order.
  Scene scene = heavy_scene(Method::kNewton);
  scene.loads.gravity.setZero();
  scene.elements = 80;
  const double angle = 2.0;
  scene.loads.tip_moment = Vec3(0.0, 0.0, 0.8 * angle / 40.0);
  scene.solver.load_steps = 4;
  scene.solver.residual_tolerance = 1e-9;
  const SceneResult arc = run_scene(scene);
  ASSERT_EQ(arc.outcome, SceneOutcome::kConverged);
  EXPECT_EQ(arc.steps, 4);
  const double R = 40.0 / angle;
  const Vec3 tip = arc.nodes.rightCols<1>();
  // The moment acts on the middle of the last edge, so the arc is short of its last half edge.
  EXPECT_LT((tip - Vec3(R * std::sin(angle), R * (1.0 - std::cos(angle)), 0.0)).norm(), 0.02);
  EXPECT_NEAR(arc.reactions[0].moment.z(), -0.04, 1e-6);
  EXPECT_EQ(arc.terms, (std::vector<std::string>{"stretch", "bend", "tip_moment"}));
  EXPECT_NEAR(arc.moment_energy, -0.04 * angle, 0.02 * 0.04 * angle);
}

}  // namespace
}  // namespace wireplan::simulate
