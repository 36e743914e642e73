// Strips and twisted rods against theory. Numbers and tolerances: references D and D11.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <vector>

#include "simulate/equilibrium/solver.h"
#include "tests/simulate/analytic.h"
#include "tests/simulate/verification_rods.h"

namespace wireplan::simulate {
namespace {

// ---------------------------------------------------------------- strips

/// The load, over sqrt(EI_weak GJ) and a power of the length, at which a strip that stands on edge
/// tips over: clamped along x, loaded along -y, which is the way it is stiff, `ratio` times stiffer
/// than along z. `shape` spreads a unit load over its nodes.
double lateral_buckling_load(int elements, double ratio, double expected,
                             const std::function<Eigen::VectorXd(const Rod&)>& shape) {
  const double L = 100.0, EI = 5.0, GJ = 8.0;
  // Its roll: the material director, toward which the first of its stiffnesses acts, lies along -y.
  const Wire wire{.name = "strip",
                  .radius = 0.5,
                  .sections = {{.length = L,
                                .bending_stiffness = ratio * EI,
                                .bending_stiffness_2 = EI,
                                .axial_stiffness = 1e7,
                                .twist_stiffness = GJ}}};
  const Rod rod = build_rod(wire, L, elements);
  const Eigen::VectorXd part = shape(rod);
  return find_critical(0.8 * expected, 1.2 * expected, 1e-6, [&](double load) {
    const Eigen::Matrix3Xd forces =
        Vec3(0.0, -load * std::sqrt(EI * GJ) / (L * L), 0.0) * part.transpose();
    Problem problem = problem_of(rod, clamped());
    problem.load = &forces;
    problem.plane = Vec3::UnitZ();  // down to where it would tip over from
    RodState state = straight_along_x(rod);
    solve(problem, state, 1e-8);
    problem.plane.reset();
    return stable(problem, state);
  });
}

TEST(Verification, StripsBuckleSidewaysAtPrandtlsLoads) {
  // References D4, for strips that do not bend at all before they tip over: what they do bend by
  // counts in proportion to the ratio of their stiffnesses, here 1e-6.
  struct Row {
    const char* name;
    double load;
    std::function<Eigen::VectorXd(const Rod&)> shape;
  };
  const auto at_tip = [](const Rod& rod) -> Eigen::VectorXd {
    return Eigen::VectorXd::Unit(rod.nodes(), rod.nodes() - 1);
  };
  const auto weight = [](const Rod& rod) -> Eigen::VectorXd { return rod.share / rod.share.sum(); };
  for (const Row& row : {Row{"tip load", 4.01260, at_tip}, Row{"weight", 12.8538, weight}}) {
    SCOPED_TRACE(row.name);
    const double e40 = lateral_buckling_load(40, 1e6, row.load, row.shape) / row.load - 1.0,
                 e80 = lateral_buckling_load(80, 1e6, row.load, row.shape) / row.load - 1.0;
    EXPECT_LT(std::abs(e80), 1e-3);      // 1 % is asked for, 0.01 % and 0.03 % are measured
    EXPECT_GT(order_of(e40, e80), 1.9);  // 2.3 and 2.4: the next orders still help
  }
}

// ---------------------------------------------------------------- twisted rods

TEST(Verification, TwistedRodBucklesAtGreenhillsTorque) {
  const double L = 100.0, EI = 500.0, GJ = 400.0;
  const auto error = [&](int elements, double tension, const EndSupport& proximal,
                         const EndSupport& distal, double expected) {
    const Rod rod = twisted_rod(uniform_wire(L, EI, 1e7, GJ), elements);
    const Problem problem = problem_of(rod, proximal, distal);
    const double critical = find_critical(0.9 * expected, 1.1 * expected, 1e-5, [&](double torque) {
      RodState state = stretched_along_x(rod, tension * EI / (L * L));
      twist_evenly(rod, torque * EI / (L * GJ), state);
      return stable(problem, state);
    });
    return critical / expected - 1.0;
  };
  for (const analytic::TwistBuckling& row : analytic::kClampedTwistBuckling) {
    SCOPED_TRACE(row.tension);
    const double e30 = error(30, row.tension, clamped(), guided_clamp(), row.moment),
                 e60 = error(60, row.tension, clamped(), guided_clamp(), row.moment);
    EXPECT_LT(std::abs(e60), 0.01);  // as D11 asks of Euler's loads
    EXPECT_NEAR(order_of(e30, e60), 2.0, 0.1);
  }
  // The chain has no bend in its outermost half edges. In a ball joint the torque bends them, so
  // that this end alone is first order.
  EndSupport ball = pinned(), guided_ball = guided();
  ball.hold_roll = guided_ball.hold_roll = true;
  const double e50 = error(50, 0.0, ball, guided_ball, analytic::kBallJointTwistBuckling),
               e100 = error(100, 0.0, ball, guided_ball, analytic::kBallJointTwistBuckling);
  EXPECT_LT(std::abs(e100), 0.01);
  EXPECT_NEAR(order_of(e50, e100), 1.0, 0.15);
}

/// A ring of radius 20 mm, EI = 500 and GJ = 400 N mm^2, in the plane z = 0: from the origin along
/// x and back, both ends clamped to one point and tangent, evenly twisted between them.
struct Ring {
  Rod rod;
  RodState state;
  Problem problem;

  Ring(int elements, double total_twist) {
    const double length = 2.0 * kPi * 20.0, turn = 2.0 * kPi / elements;
    rod = twisted_rod(uniform_wire(length, 500.0, 1e6, 400.0), elements);
    problem = problem_of(rod, clamped(), clamped());
    state = straight_along_x(rod);
    const Vec3 normal = state.director.col(0);
    for (int i = 0; i < elements; ++i) {
      const Eigen::AngleAxisd turned((i + 0.5) * turn, Vec3::UnitZ());
      state.x.col(i + 1) = state.x.col(i) + rod.rest_length[i] * (turned * Vec3::UnitX());
      state.director.col(i) = turned * normal;
    }
    state.x.rightCols<1>().setZero();  // closed to the last bit
    twist_evenly(rod, total_twist / length, state);
  }
};

// Michell 1889, Zajac 1962: a ring of a wire that is straight at rest leaves its plane when its
// total twist passes 2 pi sqrt(3) EI/GJ.
const double kMichellsTwist = 2.0 * kPi * std::sqrt(3.0) * 500.0 / 400.0;

TEST(Verification, TwistedRingIsUnstableAboveMichellsTwist) {
  const auto error = [](int elements) {
    const double critical = find_critical(0.9, 1.1, 1e-5, [elements](double ratio) {
      Ring ring(elements, ratio * kMichellsTwist);
      ring.problem.plane = Vec3::UnitZ();
      solve(ring.problem, ring.state, 1e-6);
      ring.problem.plane.reset();
      // The ring turns freely about the clamps' tangent: the node opposite stays in the plane.
      return stable(ring.problem, ring.state, elements / 2);
    });
    return critical - 1.0;
  };
  const double e30 = error(30), e60 = error(60);
  EXPECT_LT(std::abs(e60), 0.02);  // the figure asked for; 0.2 % is measured
  EXPECT_NEAR(order_of(e30, e60), 2.0, 0.1);
}

TEST(Verification, TwistedRingWrithesAboveMichellsTwistAlone) {
  for (const double ratio : {0.9, 1.1}) {
    SCOPED_TRACE(ratio);
    Ring ring(60, ratio * kMichellsTwist);
    const RodState flat = ring.state;
    for (int i = 1; i < 60; ++i) ring.state.x(2, i) += 0.1 * std::sin(4.0 * kPi * i / 60.0);
    transport_frames(flat, ring.state, 0, 59);
    solve(ring.problem, ring.state, 1e-6, 1000);  // 10 below; 330 above, on a way through folds
    const double twist =
        ring.state.theta[59] - ring.state.theta[0] + ring.state.reference_twist.sum();
    // Nothing keeps the wire from itself: a ring that writhes passes through itself once, which
    // takes two turns of twist out of it, and is a ring again.
    const double lost = ratio < 1.0 ? 0.0 : 4.0 * kPi;
    EXPECT_NEAR(twist, ratio * kMichellsTwist - lost,
                0.03);  // edges at the clamps tilt
  }
}

// ---------------------------------------------------------------- V16: bend and twist

/// A rod of length 1 and EI 1 with natural curvature and GJ, clamped level along +x so that it
/// curls up toward +y at rest, under its own weight per length `weight` along -y: Kirchhoff's
/// equations, integrated from the free tip, where no moment acts, by Runge and Kutta's method.
struct HeavyCurl {
  double curvature = 0.0, GJ = 1.0, weight = 0.0;

  struct Section {
    Mat3 frame;   // material directors and the tangent
    Vec3 moment;  // of the part toward the tip on the other
  };
  /// At the clamp, for a frame at the tip.
  Section integrate(const Mat3& tip) const {
    constexpr int kSteps = 300;
    const double h = -1.0 / kSteps;
    const auto rate = [&](double s, const Section& y) -> Section {
      const Vec3 force(0.0, -weight * (1.0 - s), 0.0), moment = y.frame.transpose() * y.moment;
      const Vec3 turn = y.frame * Vec3(moment[0], moment[1] + curvature, moment[2] / GJ);
      Section slope;
      for (int k = 0; k < 3; ++k) slope.frame.col(k) = turn.cross(y.frame.col(k));
      slope.moment = force.cross(y.frame.col(2));
      return slope;
    };
    const auto along = [](const Section& y, double part, const Section& slope) -> Section {
      return {y.frame + part * slope.frame, y.moment + part * slope.moment};
    };
    Section y{tip, Vec3::Zero()};
    for (int k = 0; k < kSteps; ++k) {
      const double s = 1.0 + k * h;
      const Section a = rate(s, y), b = rate(s + 0.5 * h, along(y, 0.5 * h, a)),
                    c = rate(s + 0.5 * h, along(y, 0.5 * h, b)), d = rate(s + h, along(y, h, c));
      y = along(along(along(along(y, h / 6.0, a), h / 3.0, b), h / 3.0, c), h / 6.0, d);
    }
    return y;
  }

  /// Of a tip that points at `angle` to +x in the plane, turned further by `out` about its tangent
  /// and about its normal.
  static Mat3 tip_frame(double angle, const Eigen::Vector2d& out = Eigen::Vector2d::Zero()) {
    const Vec3 tangent(std::cos(angle), std::sin(angle), 0.0), up = Vec3::UnitZ();
    const Vec3 normal = up.cross(tangent), turn = out[0] * tangent + out[1] * normal;
    Mat3 frame;
    frame << normal, up, tangent;  // bends about the second, from +x to +y
    if (turn.norm() == 0.0) return frame;
    return Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * frame;
  }

  /// The tip's angle of the planar shape next to `angle`, whose clamp is level.
  double planar_tip(double angle) const {
    const auto miss = [&](double tip) {
      const Mat3 frame = integrate(tip_frame(tip)).frame;
      return std::atan2(frame(1, 2), frame(0, 2));
    };
    for (int k = 0; k < 30; ++k) {
      angle -= miss(angle) * 2e-5 / (miss(angle + 1e-5) - miss(angle - 1e-5));
    }
    return angle;
  }

  /// How the clamp's roll and tangent leave the plane as the tip's do: where its determinant is 0
  /// there is a shape beside the planar one; 1 without weight.
  double determinant(double angle) const {
    Eigen::Matrix2d out;
    for (int k = 0; k < 2; ++k) {
      const Mat3 frame = integrate(tip_frame(angle, 1e-5 * Eigen::Vector2d::Unit(k))).frame;
      out.col(k) = Eigen::Vector2d(frame(1, 1), frame(2, 2)) / 1e-5;
    }
    return out.determinant();
  }
};

/// The least weight, over EI/L^3, at which the curl leaves its plane.
double find_bend_twist_weight(double curvature, double GJ) {
  HeavyCurl curl{.curvature = curvature, .GJ = GJ};
  double angle = curvature, low = 0.0, low_angle = angle;
  const auto holds = [&](double weight) {
    curl.weight = weight;
    angle = curl.planar_tip(low_angle);
    return curl.determinant(angle) > 0.0;
  };
  EXPECT_TRUE(holds(0.0));
  double high = 0.0;
  while (high < 60.0 && holds(high += 0.5)) {
    low = high;
    low_angle = angle;
  }
  EXPECT_LT(high, 60.0);
  for (int k = 0; k < 30; ++k) {
    const double middle = 0.5 * (low + high);
    if (holds(middle)) {
      low = middle;
      low_angle = angle;
    } else {
      high = middle;
    }
  }
  return low;
}

/// The same of a wire of elements.
double bend_twist_weight(int elements, double curvature, double GJ, double expected) {
  const double L = 100.0, EI = 500.0;
  const Rod rod = twisted_rod(uniform_wire(L, EI, 1e7, GJ * EI, curvature / L), elements);
  return find_critical(0.9 * expected, 1.1 * expected, 1e-5, [&](double weight) {
    Problem problem = problem_of(rod, clamped());
    problem.plane = Vec3::UnitZ();
    RodState state = rest_state(rod, Vec3::Zero(), Vec3::UnitX(), kPi);  // bends toward +y
    for (const double part : {0.25, 0.5, 0.75, 1.0}) {
      const Eigen::Matrix3Xd load =
          Vec3(0.0, -part * weight * EI / (L * L), 0.0) * (rod.share / rod.share.sum()).transpose();
      problem.load = &load;
      solve(problem, state, 1e-7);
    }
    problem.plane.reset();
    const Eigen::Matrix3Xd load =
        Vec3(0.0, -weight * EI / (L * L), 0.0) * (rod.share / rod.share.sum()).transpose();
    problem.load = &load;
    return stable(problem, state);
  });
}

TEST(Verification, ACurlLeavesItsPlaneAtTheWeightOfTheShootingSolution) {  // V16
  for (const auto& [curvature, GJ] :
       {std::pair(4.0, 0.8), std::pair(4.5, 0.8), std::pair(5.0, 0.8), std::pair(4.5, 0.5)}) {
    SCOPED_TRACE(std::to_string(curvature) + " " + std::to_string(GJ));
    const double expected = find_bend_twist_weight(curvature, GJ);
    const double e50 = bend_twist_weight(50, curvature, GJ, expected) / expected - 1.0,
                 e100 = bend_twist_weight(100, curvature, GJ, expected) / expected - 1.0;
    EXPECT_LT(std::abs(e100), 0.02);  // the figure asked for
    EXPECT_NEAR(order_of(e50, e100), 2.0, 0.3);
    RecordProperty("error", std::to_string(e100));
  }
}

}  // namespace
}  // namespace wireplan::simulate
