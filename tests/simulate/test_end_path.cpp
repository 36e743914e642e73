// Wires whose distal support is far from where they end unloaded: two grippers that move nearer,
// turn and roll, against the elastica and against what frames and balance ask for.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <random>
#include <string>

#include "simulate/insertion/scene.h"
#include "simulate/wire/bend_to.h"
#include "tests/simulate/analytic.h"
#include "tests/simulate/random_values.h"

namespace wireplan::simulate {
namespace {

constexpr double kLength = 100.0, kEI = 20.0, kGJ = kEI / 1.3;  // mm, N mm^2

/// A straight wire from the origin along x to a support far from its end.
Scene gripped(const Vec3& point, const Vec3& direction, double roll = 0.0, int elements = 200) {
  Scene scene;
  scene.wire = {
      .name = "gripped",
      .radius = 0.4445,
      .sections = {{.length = kLength, .bending_stiffness = kEI, .axial_stiffness = 2e4}}};
  scene.elements = elements;
  scene.supports = {{},
                    {.at = WireEnd::kDistal, .point = point, .direction = direction, .roll = roll}};
  return scene;
}

/// A planar inextensible wire between two clamps, by shooting.
struct Elastica {
  Vec3 force, middle;  // the support's on the start, and the wire's middle
  double start_moment = 0.0, end_moment = 0.0, energy = 0.0;
};

/// EI theta'' = F x t integrated by Runge-Kutta's method for the moment and force at the start that
/// meet the end, which is moved there from that of the wire bent evenly.
Elastica find_elastica(double x, double y, double turn) {
  using Shot = Eigen::Matrix<double, 5, 1>;  // x, y, theta, moment, energy
  constexpr int kSteps = 400;
  const auto rate = [](const Shot& s, const Vec3& start) {
    Shot r;
    r << std::cos(s[2]), std::sin(s[2]), s[3] / kEI,
        start[1] * std::sin(s[2]) - start[2] * std::cos(s[2]), 0.5 * s[3] * s[3] / kEI;
    return r;
  };
  const auto shoot = [&](const Vec3& start, Shot& middle) {
    const double h = kLength / kSteps;
    Shot s;
    s << 0.0, 0.0, 0.0, start[0], 0.0;
    for (int i = 0; i < kSteps; ++i) {
      if (2 * i == kSteps) middle = s;
      const Shot a = rate(s, start), b = rate(s + 0.5 * h * a, start),
                 c = rate(s + 0.5 * h * b, start), d = rate(s + h * c, start);
      s += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
    return s;
  };
  Vec3 start(kEI * turn / kLength, 0.0, 0.0);  // moment, force carried by the wire
  const double radius = kLength / turn;
  const Vec3 from(radius * std::sin(turn), radius * (1.0 - std::cos(turn)), turn), to(x, y, turn);
  Shot middle, end;
  for (int step = 1; step <= 20; ++step) {
    const Vec3 goal = from + step / 20.0 * (to - from);
    for (int round = 0; round < 8; ++round) {
      end = shoot(start, middle);
      Mat3 J;
      for (int k = 0; k < 3; ++k) {
        const Vec3 moved = start + 1e-6 * Vec3::Unit(k);
        Shot unused;
        J.col(k) = (shoot(moved, unused) - end).head<3>() / 1e-6;
      }
      start += J.fullPivLu().solve(goal - end.head<3>());
    }
  }
  end = shoot(start, middle);
  EXPECT_LT((end.head<3>() - to).norm(), 1e-6);
  return {.force = Vec3(-start[1], -start[2], 0.0),
          .middle = Vec3(middle[0], middle[1], 0.0),
          .start_moment = start[0],
          .end_moment = end[3],
          .energy = end[4]};
}

TEST(EndPath, GrippedWireIsAnElastica) {
  struct Case {
    double x, y, turn;
  };
  for (const Case& c : {Case{50.0, 40.0, 0.5 * kPi}, Case{45.0, 40.0, 0.5 * kPi},
                        Case{40.0, 40.0, 0.5 * kPi}, Case{0.0, 45.0, kPi}, Case{0.0, 35.0, kPi}}) {
    SCOPED_TRACE(c.x + c.y);
    const Elastica exact = find_elastica(c.x, c.y, c.turn);
    for (const int load_steps : {1, 20}) {
      Scene scene = gripped({c.x, c.y, 0.0}, {std::cos(c.turn), std::sin(c.turn), 0.0});
      scene.solver.load_steps = load_steps;
      const SceneResult result = run_scene(scene);
      ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
      EXPECT_LT(result.iterations, 50);
      EXPECT_GE(result.steps, load_steps);
      // The chain's error is of second order: 2e-4 of a moment and 1e-5 of the length here.
      EXPECT_LT((result.nodes.col(100) - exact.middle).norm(), 2e-3);
      EXPECT_NEAR(result.energy.bend, exact.energy, 5e-4 * exact.energy);
      const double most = kEI * c.turn / kLength;
      EXPECT_LT((result.reactions[0].force - exact.force).norm(), 5e-4 * exact.force.norm());
      EXPECT_LT((result.reactions[1].force + exact.force).norm(), 5e-4 * exact.force.norm());
      EXPECT_NEAR(-result.reactions[0].moment.z(), exact.start_moment, 1e-3 * most);
      EXPECT_NEAR(result.reactions[1].moment.z(), exact.end_moment, 1e-3 * most);
    }
  }
}

/// The wire's material frame at its end, by carrying its director from edge to edge without twist
/// and then turning it by all of the twist.
double roll_at_the_end(const SceneResult& result, const Vec3& start, const Vec3& material_there,
                       const Vec3& end, const Vec3& material) {
  Vec3 before = start, carried = material_there;
  for (Eigen::Index i = 0; i + 1 < result.nodes.cols(); ++i) {
    const Vec3 t = (result.nodes.col(i + 1) - result.nodes.col(i)).normalized();
    carried = parallel_transport(carried, before, t);
    before = t;
  }
  carried = parallel_transport(carried, before, end);
  const double angle = std::atan2(carried.cross(material).dot(end), carried.dot(material));
  return std::remainder(result.twist.sum() - angle, 2.0 * kPi);
}

TEST(EndPath, RollOfAFarEndTwistsTheWire) {
  const Vec3 start_material = reference_normal(Vec3::UnitX());
  for (const Vec3& direction : {Vec3(0.0, 1.0, 0.0), Vec3(0.0, 1.0, 1.0), Vec3(-1.0, 1.0, 2.0)}) {
    for (const double roll : {0.0, 1.0, -2.5, 2.0 * kPi}) {
      SCOPED_TRACE(std::to_string(direction.x() + direction.z()) + " " + std::to_string(roll));
      Scene scene = gripped({50.0, 40.0, 10.0}, direction.normalized(), roll);
      if (roll == 0.0) scene.twist = Twist::kCoupled;
      const SceneResult result = run_scene(scene);
      ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
      EXPECT_LT(result.iterations, 150);
      EXPECT_EQ(result.terms[2], "twist");

      // The end's frame came by the shortest turn of the wire's direction, and the roll.
      const Vec3 d = direction.normalized();
      const Mat3 turn = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), d).toRotationMatrix();
      const Vec3 material = Eigen::AngleAxisd(roll, d) * (turn * start_material);
      EXPECT_NEAR(roll_at_the_end(result, Vec3::UnitX(), start_material, d, material), 0.0, 1e-6);

      // A round wire carries one torque all along, which both supports hold.
      const double torque = kGJ * result.twist.sum() / kLength;
      const double h = kLength / 200;
      for (int i = 2; i < 199; ++i) EXPECT_NEAR(kGJ * result.twist[i] / h, torque, 1e-4);
      EXPECT_NEAR(result.energy.twist, 0.5 * torque * torque * kLength / kGJ, 1e-5);
      const Reaction &proximal = result.reactions[0], &distal = result.reactions[1];
      EXPECT_NEAR(-proximal.moment.x(), torque, 1e-3);  // along the clamp, half an edge before
      EXPECT_NEAR(distal.moment.dot(d), torque, 1e-3);
      EXPECT_LT((proximal.force + distal.force).norm(), 1e-5);
      const Vec3 arm = result.nodes.col(200) - result.nodes.col(0);
      EXPECT_LT((proximal.moment + distal.moment + arm.cross(distal.force)).norm(), 2e-4);
      if (roll == 2.0 * kPi) {
        EXPECT_GT(std::abs(result.twist.sum()), 4.0);
      }
    }
  }
}

// Dirac's belt: the frame at the end is that of no roll.
TEST(EndPath, BentWireLosesTwoWholeTurns) {
  const SceneResult plain = run_scene(gripped({0.0, 45.0, 0.0}, -Vec3::UnitX()));
  for (const double roll : {4.0 * kPi, -4.0 * kPi}) {
    const SceneResult turned = run_scene(gripped({0.0, 45.0, 0.0}, -Vec3::UnitX(), roll));
    ASSERT_EQ(turned.outcome, SceneOutcome::kConverged) << turned.reason;
    EXPECT_LT(turned.iterations, 150);
    EXPECT_NEAR(turned.twist.sum(), 0.0, 1e-3);
    EXPECT_NEAR(turned.energy.total(), plain.energy.total(), 1e-5);
    EXPECT_LT((turned.nodes - plain.nodes).colwise().norm().maxCoeff(), 2e-3);
  }
  // One turn stays, and its mirror image is that of the other sense.
  const SceneResult left = run_scene(gripped({0.0, 45.0, 0.0}, -Vec3::UnitX(), 2.0 * kPi));
  const SceneResult right = run_scene(gripped({0.0, 45.0, 0.0}, -Vec3::UnitX(), -2.0 * kPi));
  EXPECT_GT(left.twist.sum(), 5.0);
  EXPECT_NEAR(left.twist.sum(), -right.twist.sum(), 1e-4);
  EXPECT_NEAR(left.nodes(2, 50), -right.nodes(2, 50), 1e-3);
  EXPECT_GT(std::abs(left.nodes(2, 50)), 1.0);
}

TEST(EndPath, ColumnPushedTogetherBuckles) {
  for (const double end_angle : {0.5, 1.0, 2.0}) {
    SCOPED_TRACE(end_angle);
    const analytic::Column exact = analytic::buckle_column(end_angle);
    Scene scene = gripped({kLength * (1.0 - exact.shortening), 0.0, 0.0}, Vec3::UnitX());
    for (Support& support : scene.supports) support.kind = SupportKind::kPinned;
    const SceneResult result = run_scene(scene);
    ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
    EXPECT_LT(result.iterations, 150);
    const double euler = kPi * kPi * kEI / (kLength * kLength);
    EXPECT_NEAR(result.reactions[0].force.x(), exact.load * euler, 1e-3 * exact.load * euler);
    EXPECT_NEAR(result.nodes.col(100).tail<2>().norm(), exact.deflection * kLength, 0.02);
  }
  // Between clamps: four quarters of it, in the table's plane where there is one.
  const analytic::Column exact = analytic::buckle_column(1.0);
  Scene scene = gripped({kLength * (1.0 - exact.shortening), 0.0, 0.0}, Vec3::UnitX());
  scene.plane = Vec3::UnitY();
  const SceneResult result = run_scene(scene);
  ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
  const double euler = 4.0 * kPi * kPi * kEI / (kLength * kLength);
  EXPECT_NEAR(result.reactions[0].force.x(), exact.load * euler, 1e-3 * exact.load * euler);
  EXPECT_NEAR(std::abs(result.nodes(2, 100)), exact.deflection * kLength, 0.02);
}

TEST(EndPath, GuidedEndSlidesWithoutForce) {
  Scene scene = gripped({80.0, 40.0, 0.0}, Vec3(1.0, 1.0, 0.0).normalized());
  scene.supports[1].kind = SupportKind::kGuided;
  const SceneResult result = run_scene(scene);
  ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
  EXPECT_LT(result.iterations, 150);
  const Vec3 d = scene.supports[1].direction, off = result.nodes.col(200) - Vec3(80.0, 40.0, 0.0);
  EXPECT_LT(d.cross(off).norm(), 1e-9);
  EXPECT_NEAR(result.reactions[1].force.dot(d), 0.0, 1e-5);
  EXPECT_GT(result.reactions[1].force.norm(), 1e-3);
}

TEST(EndPath, CurvedWireStraightenedByGrippersCarriesItsMoment) {
  // An arc between clamps that hold it straight: EI times its curvature all along.
  Scene scene = gripped(Vec3(kLength, 0.0, 0.0), Vec3::UnitX());
  scene.wire.sections[0].rest_curvature = 0.02;
  const SceneResult result = run_scene(scene);
  ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
  EXPECT_LT(result.iterations, 150);
  EXPECT_LT(result.nodes.bottomRows(2).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_NEAR(result.reactions[1].moment.norm(), 0.02 * kEI, 1e-3 * 0.02 * kEI);
  EXPECT_NEAR(result.energy.bend, 0.5 * kEI * 0.02 * 0.02 * kLength, 1e-3);
}

TEST(EndPath, AnySupportWithinReachIsReached) {
  std::mt19937_64 random(5);
  const auto vector = [&] {
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    return Vec3(x, y, z);
  };
  for (int k = 0; k < 120; ++k) {
    SCOPED_TRACE(k);
    const Vec3 point = (50.0 + 40.0 * uniform(random)) * vector().normalized();
    Scene scene = gripped(point, vector().normalized(), 6.0 * uniform(random), 5 + k);
    Section& section = scene.wire.sections[0];
    if (k % 3 == 1) section.rest_curvature = 0.02 + 0.01 * uniform(random);
    if (k % 3 == 2) {
      section.bending_stiffness_2 = 40.0 + 30.0 * uniform(random);
      section.twist_stiffness = kGJ;
    }
    scene.supports[1].kind = k % 4 < 2    ? SupportKind::kClamped
                             : k % 4 == 2 ? SupportKind::kGuided
                                          : SupportKind::kPinned;
    const SceneResult result = run_scene(scene);
    ASSERT_EQ(result.outcome, SceneOutcome::kConverged) << result.reason;
    EXPECT_LE(result.residual, 1e-6);
    // Supports and wire are in balance, and no edge is crushed.
    const Reaction &a = result.reactions[0], &b = result.reactions[1];
    const Eigen::Index n = result.nodes.cols();
    const Vec3 arm = result.nodes.col(n - 1) - result.nodes.col(0);
    EXPECT_LT((a.force + b.force).norm(), 1e-4);
    EXPECT_LT((a.moment + b.moment + arm.cross(b.force)).norm(), 1e-3);
    const Eigen::Matrix3Xd edges = result.nodes.rightCols(n - 1) - result.nodes.leftCols(n - 1);
    EXPECT_NEAR(edges.colwise().norm().sum(), kLength, 0.01);
  }
}

TEST(BendTo, SidewaysMoveOfAClampedBeamIsACubic) {
  const Rod rod = build_rod(gripped(Vec3::Zero(), Vec3::UnitX()).wire, kLength, 200);
  Eigen::Matrix3Xd edges = Eigen::Matrix3Xd::Zero(3, 200);
  edges.row(0).setConstant(0.5);
  const double w = 0.01;
  const Eigen::Matrix3Xd turns =
      find_least_bending(rod, {}, edges, Vec3(0.0, w, 0.0), Vec3::Zero());
  // y = w (3 u^2 - 2 u^3), u = s / L.
  double y = 0.0;
  for (int i = 0; i < 200; ++i) {
    const double u = (i + 0.5) / 200;
    EXPECT_NEAR(turns(2, i), w / kLength * 6.0 * u * (1.0 - u), 1e-4 * w / kLength);
    y += 0.5 * turns(2, i);
  }
  EXPECT_NEAR(y, w, 1e-12);
  EXPECT_NEAR(turns.col(200).norm(), 0.0, 1e-12);
}

TEST(BendTo, EndsWhereItIsAskedToWithoutStretching) {
  const Rod rod = build_rod(gripped(Vec3::Zero(), Vec3::UnitX()).wire, kLength, 50);
  BentWire wire;
  wire.edges = Eigen::Matrix3Xd::Zero(3, 50);
  wire.edges.row(0).setConstant(2.0);
  const Vec3 point(70.0, 30.0, 20.0), direction = Vec3(0.0, 1.0, 1.0).normalized();
  ASSERT_TRUE(bend_to(rod, {}, point, direction, wire));
  EXPECT_LT((wire.end() - point).norm(), 1e-6);
  EXPECT_LT((wire.end_direction - direction).norm(), 1e-6);
  EXPECT_LT((wire.edges.colwise().norm().array() - 2.0).abs().maxCoeff(), 1e-12);
  EXPECT_FALSE(bend_to(rod, {}, Vec3(101.0, 0.0, 0.0), direction, wire));  // out of reach
}

}  // namespace
}  // namespace wireplan::simulate
