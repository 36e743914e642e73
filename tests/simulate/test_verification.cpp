// The wire against theory: elastica, roll-up, buckling, curved and twisted rods. Numbers and
// tolerances: references D and D11; inextensible theory is met by a large EA.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <vector>

#include "simulate/equilibrium/solver.h"
#include "tests/simulate/analytic.h"

// Calls of malloc, which operator new and Eigen go through, are counted while a test asks for it.
// glibc lets a program bring its own malloc; the sanitizers bring theirs, so there the count is
// left out.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define WIREPLAN_SANITIZED
#endif
#endif
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    !defined(WIREPLAN_SANITIZED)
#define WIREPLAN_COUNTS_ALLOCATIONS
namespace {
std::atomic<bool> counting{false};
std::atomic<int> allocations{0};
}  // namespace
extern "C" {
void* __libc_malloc(std::size_t size) noexcept;
void* malloc(std::size_t size) noexcept {
  if (counting) ++allocations;
  return __libc_malloc(size);
}
}
#endif

namespace wireplan::simulate {
namespace {

// ---------------------------------------------------------------- wires, supports, solves

Wire uniform_wire(double length, double EI, double EA, double GJ = 0.0, double curvature = 0.0) {
  return {.name = "beam",
          .radius = 0.5,
          .sections = {{.length = length,
                        .bending_stiffness = EI,
                        .axial_stiffness = EA,
                        .twist_stiffness = GJ,
                        .rest_curvature = curvature}}};
}

Rod uniform_rod(double length, double EI, double EA, int elements) {
  return build_rod(uniform_wire(length, EI, EA), length, elements);
}

EndSupport pinned() {
  EndSupport end;
  end.hold_along = end.hold_across = true;
  return end;
}

/// Free along x alone.
EndSupport guided() {
  EndSupport end;
  end.hold_across = true;
  return end;
}

EndSupport clamped(const Vec3& tangent = Vec3::UnitX()) {
  EndSupport end = pinned();
  end.hold_roll = true;
  end.tangent = tangent;
  return end;
}

EndSupport guided_clamp() {
  EndSupport end = clamped();
  end.hold_along = false;
  return end;
}

/// All nodes free, apart from what the supports hold.
Problem problem_of(const Rod& rod, const EndSupport& proximal, const EndSupport& distal = {}) {
  Problem problem;
  problem.rod = &rod;
  problem.last = rod.nodes();
  problem.proximal = proximal;
  problem.distal = distal;
  return problem;
}

Eigen::Matrix3Xd tip_load(const Rod& rod, const Vec3& force) {
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, rod.nodes());
  load.rightCols<1>() = force;
  return load;
}

RodState straight_along_x(const Rod& rod) {
  return straight_state(rod, Vec3::Zero(), Vec3::UnitX(), 0.0);
}

/// Solves, and holds every solve of this file to the same: it converges, and energy falls at every
/// accepted step up to the rounding that the solver allows itself. Returns the iterations.
int solve(const Problem& problem, RodState& state, double tolerance, int max_iterations = 200) {
  Statics statics;
  Eigen::Matrix3Xd gradient(3, problem.rod->nodes());
  const double before = Statics::evaluate(problem, state, gradient).total();
  const NewtonResult result = statics.solve(
      problem, state, {.residual_tolerance = tolerance, .max_iterations = max_iterations});
  EXPECT_TRUE(result.converged) << "residual " << result.residual << " N after "
                                << result.iterations << " iterations";
  const double largest = std::max(std::abs(before), std::abs(result.energy));
  EXPECT_LE(result.worst_energy_rise, 1e-13 * (1.0 + largest));
  return result.iterations;
}

double order_of(double coarse, double fine) { return std::log2(std::abs(coarse / fine)); }

// ---------------------------------------------------------------- V1, V2: cantilevers

/// Tip of a wire clamped along x, under a dead tip force and a weight per length along -y.
analytic::Cantilever bend(const Rod& rod, double force, double weight, int& iterations) {
  Problem problem = problem_of(rod, clamped());
  const Eigen::Matrix3Xd load =
      tip_load(rod, Vec3(0.0, -force, 0.0)) + Vec3(0.0, -weight, 0.0) * rod.share.transpose();
  problem.load = &load;
  RodState state = straight_along_x(rod);
  iterations = solve(problem, state, 1e-8);  // a thousandth of the smallest force here, 1e-5 N
  const Vec3 tip = state.x.rightCols<1>();
  return {0.0, tip.x(), -tip.y()};
}

TEST(Verification, TipLoadedCantileverFollowsTheElastica) {  // V1
  struct Row {
    double alpha, axial, transverse;  // P L^2/EI; displacements over L (references D2)
  };
  const double L = 100.0, EI = 500.0;
  const Rod rod = uniform_rod(L, EI, 1e5, 100);
  for (const Row& row : {Row{0.2, 0.00265, 0.06636},
                         {0.5, 0.01592, 0.16214},
                         {1.0, 0.05643, 0.30172},
                         {2.0, 0.16064, 0.49346},
                         {3.0, 0.25442, 0.60325},
                         {5.0, 0.38763, 0.71379},
                         {7.5, 0.48957, 0.77670},
                         {10.0, 0.55500, 0.81061},
                         {15.0, 0.63529, 0.84772}}) {
    SCOPED_TRACE(row.alpha);
    int iterations = 0;
    const analytic::Cantilever tip = bend(rod, row.alpha * EI / (L * L), 0.0, iterations);
    EXPECT_NEAR(1.0 - tip.reach / L, row.axial, 0.005);  // D11
    EXPECT_NEAR(tip.drop / L, row.transverse, 0.005);
    EXPECT_LT(iterations, 30);
  }
}

TEST(Verification, HeavyCantileverHangsAsTheMasterCurveSays) {  // V2
  const double L = 100.0, EI = 500.0;
  const Rod rod = uniform_rod(L, EI, 1e5, 100);
  struct Row {
    double gamma, ratio;  // weight L^3/EI; drop over reach (references D1; 0: not listed)
  };
  for (const Row& row : {Row{1.0, 0.1246}, {10.0, 1.0668}, {78.48, 0.0}, {100.0, 5.8881}}) {
    SCOPED_TRACE(row.gamma);
    const analytic::Cantilever reference = analytic::bend_cantilever(
        1.0, [](double) { return 1.0; }, 0.0, row.gamma, 500);
    const double expected = reference.drop / reference.reach;
    if (row.ratio > 0.0) {
      EXPECT_NEAR(expected, row.ratio, 1e-4);  // digits of the table
    }
    int iterations = 0;
    const analytic::Cantilever tip = bend(rod, 0.0, row.gamma * EI / (L * L * L), iterations);
    EXPECT_NEAR(tip.drop / tip.reach, expected, 0.01 * expected);  // D11
    EXPECT_LT(iterations, 30);
  }
}

TEST(Verification, PapersWireConvergesWithTheSquareOfTheElementLength) {
  // EI = 0.8 N mm^2, EA = 160 N, 40 mm, 0.1 g/mm: Gamma 78.48.
  std::vector<Vec3> tips;
  for (const int elements : {20, 160, 640, 1280}) {
    const Rod rod = uniform_rod(40.0, 0.8, 160.0, elements);
    int iterations = 0;
    const analytic::Cantilever tip = bend(rod, 0.0, 1e-7 * 9810.0, iterations);
    tips.emplace_back(tip.reach, tip.drop, 0.0);
    EXPECT_LT(iterations, 30);
  }
  const Vec3 limit = (4.0 * tips[3] - tips[2]) / 3.0;  // Richardson
  const double e20 = (tips[0] - limit).norm(), e160 = (tips[1] - limit).norm();
  EXPECT_LT(e20, 0.0055 * 40.0);
  EXPECT_NEAR(order_of(e20, e160) / 3.0, 2.0, 0.1);  // three halvings; 1.87, 1.92 and 1.96
}

TEST(Verification, UnequalElementsGiveTheSameTip) {
  // Fine tip, coarse shaft: edge lengths fall geometrically to a twentieth.
  const double L = 100.0, EI = 500.0, force = 5.0 * EI / (L * L);
  const analytic::Cantilever reference = analytic::bend_cantilever(
      L, [EI](double) { return EI; }, force, 0.0, 500);
  std::vector<double> errors;
  for (const int elements : {40, 80, 160}) {
    Eigen::VectorXd lengths(elements);
    for (int i = 0; i < elements; ++i) lengths[i] = std::pow(0.05, (i + 0.5) / elements);
    lengths *= L / lengths.sum();
    const Rod rod = build_rod(uniform_wire(L, EI, 1e6), lengths);
    int iterations = 0;
    const analytic::Cantilever tip = bend(rod, force, 0.0, iterations);
    errors.push_back(std::hypot(tip.reach - reference.reach, tip.drop - reference.drop));
    EXPECT_LT(iterations, 30);
  }
  EXPECT_LT(errors[0], 0.005 * L);  // the longest of 40 elements is 7.3 mm
  EXPECT_NEAR(order_of(errors[0], errors[1]), 2.0, 0.1);
  EXPECT_NEAR(order_of(errors[1], errors[2]), 2.0, 0.1);
}

TEST(Verification, StiffnessRatioOfTenThousandConverges) {
  // A stiff shaft of 50 mm with a tip ten thousand times softer, bent to a hair at the higher
  // loads.
  const double L = 100.0;
  const Wire wire{
      .name = "soft tip",
      .radius = 0.5,
      .sections = {{.length = 50.0, .bending_stiffness = 0.1, .axial_stiffness = 1e5},
                   {.length = 50.0, .bending_stiffness = 1000.0, .axial_stiffness = 1e5}}};
  const Rod rod = build_rod(wire, L, 200);
  for (const double force : {1e-5, 1e-4, 1e-3, 1e-2, 0.1}) {
    SCOPED_TRACE(force);
    const analytic::Cantilever reference = analytic::bend_cantilever(
        L, [](double s) { return s < 50.0 ? 0.1 : 1000.0; }, force, 0.0, 1000);
    int iterations = 0;
    const analytic::Cantilever tip = bend(rod, force, 0.0, iterations);
    // The soft part bends within sqrt(EI/P) = 1 mm at the highest load, two elements.
    EXPECT_NEAR(tip.reach, reference.reach, 0.001 * L);
    EXPECT_NEAR(tip.drop, reference.drop, 0.001 * L);
    EXPECT_LT(iterations, 60);
  }
}

// ---------------------------------------------------------------- V3: roll-up by an end moment

TEST(Verification, EndMomentRollsTheWireUp) {   // V3
  const double L = 100.0, EI = 10.0, EA = 1e7;  // the roll-up stretches edges by EI/(R^2 EA) = 4e-9
  for (const double lambda : {0.5, 1.0, 2.0}) {
    SCOPED_TRACE(lambda);
    const double turn = lambda * kPi;
    const Vec3 continuum(L * std::sin(turn) / turn, L * (1.0 - std::cos(turn)) / turn, 0.0);
    std::vector<double> tip_errors, angle_errors;
    for (const int elements : {20, 40, 80, 100}) {
      SCOPED_TRACE(elements);
      const Rod rod = uniform_rod(L, EI, EA, elements);
      const double l = L / elements, M = turn * EI / L;
      Problem problem = problem_of(rod, clamped());
      problem.tip_moment = TipMoment{.axis = Vec3::UnitZ(), .size = M};
      problem.plane = Vec3::UnitZ();
      RodState state = straight_along_x(rod);
      const int iterations = solve(problem, state, 1e-9);
      EXPECT_LT(iterations, 30);

      // Chain of hinges: M l/EI = sin(phi) at every node, and half of it at the clamp.
      double angle = 0.0, worst = 0.0;
      for (int i = 0; i < elements; ++i) {
        const Vec3 e = state.x.col(i + 1) - state.x.col(i);
        const double next = angle + std::remainder(std::atan2(e.y(), e.x()) - angle, 2.0 * kPi);
        const double expected = std::asin(M * l / EI * (i == 0 ? 0.5 : 1.0));
        worst = std::max(worst, std::abs(next - angle - expected));
        angle = next;
      }
      EXPECT_LT(worst, 1e-8);                                 // D11
      EXPECT_NEAR(state.tip_angle, 0.5 * kPi + angle, 1e-8);  // from -y, all turns counted
      tip_errors.push_back((Vec3(state.x.rightCols<1>()) - continuum).norm());
      // The last edge stands for the wire at its middle.
      angle_errors.push_back(angle - turn * (1.0 - 0.5 / elements));
    }
    for (int k = 0; k < 2; ++k) {
      EXPECT_NEAR(order_of(tip_errors[k], tip_errors[k + 1]), 2.0, 0.1);
      EXPECT_NEAR(order_of(angle_errors[k], angle_errors[k + 1]), 2.0, 0.1);
    }
  }
}

// ---------------------------------------------------------------- V4: buckling

/// Whether the Hessian of the state is positive definite on what the supports, whose axis is x,
/// leave free: whether the equilibrium is stable. `flat_node`, if any, keeps its z.
bool stable(const Problem& problem, const RodState& state, int flat_node = -1) {
  const int n = problem.rod->nodes();
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  Statics::derivatives(problem, state, gradient, hessian);
  std::vector<int> unknowns;
  for (int i = 0; i < n; ++i) {
    const EndSupport none, &end = i == 0 ? problem.proximal : i == n - 1 ? problem.distal : none;
    if (!end.hold_along) unknowns.push_back(3 * i);
    if (!end.hold_across) unknowns.push_back(3 * i + 1);
    if (!end.hold_across && i != flat_node) unknowns.push_back(3 * i + 2);
  }
  for (int e = 0; e < n - 1 && problem.rod->twisted; ++e) {
    const bool held =
        (e == 0 && problem.proximal.hold_roll) || (e == n - 2 && problem.distal.hold_roll);
    if (!held) unknowns.push_back(3 * n + e);
  }
  const Eigen::MatrixXd kept = hessian(unknowns, unknowns);
  return kept.llt().info() == Eigen::Success;
}

/// Where `is_stable` of a load turns from true to false, by bisection between `low`
/// and `high` to a relative `tolerance`.
template <class Stable>
double find_critical(double low, double high, double tolerance, const Stable& is_stable) {
  EXPECT_TRUE(is_stable(low));
  EXPECT_FALSE(is_stable(high));
  while (high - low > tolerance * high) {
    const double middle = 0.5 * (low + high);
    (is_stable(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// The straight wire under an axial tension (compression below zero): EA is so large here that the
/// strain, below 1e-5, is of first order.
RodState stretched_along_x(const Rod& rod, double tension) {
  RodState state = straight_along_x(rod);
  state.x *= 1.0 + tension / rod.stretch[0];
  return state;
}

TEST(Verification, ColumnsBuckleAtEulersLoads) {  // V4
  struct Row {
    const char* name;
    EndSupport proximal, distal;
    double load;  // over EI/L^2 (references D4; 20.1907 is tan(x) = x squared)
  };
  const double L = 100.0, EI = 500.0, EA = 1e7;
  for (const Row& row : {Row{"pinned-pinned", pinned(), guided(), kPi * kPi},
                         {"clamped-free", clamped(), {}, kPi * kPi / 4.0},
                         {"clamped-clamped", clamped(), guided_clamp(), 4.0 * kPi * kPi},
                         {"clamped-pinned", clamped(), guided(), 20.1907}}) {
    SCOPED_TRACE(row.name);
    const auto critical_load = [&](int elements) {
      const Rod rod = uniform_rod(L, EI, EA, elements);
      const Problem problem = problem_of(rod, row.proximal, row.distal);
      return find_critical(0.9 * row.load, 1.1 * row.load, 1e-6, [&](double load) {
        return stable(problem, stretched_along_x(rod, -load * EI / (L * L)));
      });
    };
    const double e20 = critical_load(20) - row.load, e40 = critical_load(40) - row.load,
                 e100 = critical_load(100) - row.load;
    EXPECT_LT(std::abs(e100), 0.01 * row.load);  // D11
    // The strain at buckling, 2e-4 of the error at 40 elements, is what theory leaves out.
    EXPECT_NEAR(order_of(e20, e40), 2.0, 0.1);
  }
}

TEST(Verification, BuckledColumnFollowsTheElastica) {  // V4
  struct Row {
    double end_angle, load, shortening, deflection;  // references D4
  };
  const double L = 100.0, EI = 500.0, euler = kPi * kPi * EI / (L * L);
  const Rod rod = uniform_rod(L, EI, 1e5, 100);
  for (const Row& row : {Row{40.0, 1.0637, 0.1188, 0.2111}, {80.0, 1.2939, 0.4406, 0.3597}}) {
    SCOPED_TRACE(row.end_angle);
    const analytic::Column column = analytic::buckle_column(row.end_angle * kRadPerDeg);
    EXPECT_NEAR(column.load, row.load, 1e-4);  // digits of the table
    EXPECT_NEAR(column.shortening, row.shortening, 1e-4);
    EXPECT_NEAR(column.deflection, row.deflection, 1e-4);

    // Lying on the table between pins that the theory's shortening sets apart, bent at first as
    // angles that fall along a cosine bend it.
    Problem problem = problem_of(rod, pinned(), pinned());
    problem.plane = Vec3::UnitZ();
    RodState state = straight_along_x(rod);
    for (int i = 0; i < 100; ++i) {
      const double angle = row.end_angle * kRadPerDeg * std::cos(kPi * (i + 0.5) / 100.0);
      state.x.col(i + 1) = state.x.col(i) + Vec3(std::cos(angle), std::sin(angle), 0.0);
    }
    state.x.row(0) *= (1.0 - column.shortening) * L / state.x(0, 100);
    state.x(1, 100) = 0.0;
    EXPECT_LT(solve(problem, state, 1e-8), 30);
    Eigen::Matrix3Xd gradient(3, rod.nodes());
    Statics::evaluate(problem, state, gradient);
    const Vec3 end = state.x.col(1) - state.x.col(0);
    EXPECT_NEAR(gradient(0, 0) / euler, column.load, 0.01 * column.load);  // D11
    EXPECT_NEAR(state.x(1, 50) / L, column.deflection, 0.01 * column.deflection);
    // The first edge lies half an element from the end: its angle is second order too.
    EXPECT_NEAR(std::atan2(end.y(), end.x()) / kRadPerDeg, row.end_angle, 0.01 * row.end_angle);
  }
}

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

/// Twists the wire evenly, by `rate` per length, between ends whose roll is held.
void twist_evenly(const Rod& rod, double rate, RodState& state) {
  const int edges = static_cast<int>(state.theta.size());
  double arc = 0.0;
  for (int i = 0; i < edges; ++i) {
    const double l = rod.rest_length[i];
    // An end's edge carries the roll of the end, the others that of their middles.
    state.theta[i] = rate * (i == 0 ? 0.0 : i == edges - 1 ? arc + l : arc + 0.5 * l);
    arc += l;
  }
}

Rod twisted_rod(const Wire& wire, int elements) {
  return build_rod(wire, Eigen::VectorXd::Constant(elements, wire.length() / elements), true);
}

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

// ---------------------------------------------------------------- V10: the 45 degree bend

/// Bathe and Bolourchi's bend: 45 degrees of a circle of 100 mm, clamped, loaded out of its plane.
struct Bend45 {
  Rod rod;
  RodState state;
  Problem problem;
  Eigen::Matrix3Xd load;

  Bend45(int elements, double force, const Mat3& R) {
    const double radius = 100.0, angle = 45.0 * kRadPerDeg, EI = 8.333e5, GJ = EI;
    rod = build_rod(uniform_wire(radius * angle, EI, 1e8, GJ, 1.0 / radius), radius * angle,
                    elements);
    state = rest_state(rod, Vec3::Zero(), Vec3::UnitX(), kPi);  // bends toward +y
    state.x = R * state.x;
    state.director = R * state.director;
    problem = problem_of(rod, clamped(R * Vec3::UnitX()));
    load = tip_load(rod, R * Vec3(0.0, 0.0, force));
  }
};

TEST(Verification, BendOf45DegreesTurnsOutOfItsPlane) {  // V10
  struct Row {
    double force;
    Vec3 displacement;  // references D5, inextensible, GJ = EI
  };
  for (const Row& row : {Row{300.0, Vec3(-11.931, -7.044, 40.188)},
                         {450.0, Vec3(-18.471, -10.781, 48.498)},
                         {600.0, Vec3(-23.559, -13.604, 53.469)}}) {
    SCOPED_TRACE(row.force);
    std::vector<Vec3> moved;
    for (const int elements : {25, 50, 100}) {
      Bend45 bend(elements, row.force, Mat3::Identity());
      bend.problem.load = &bend.load;
      const Vec3 before = bend.state.x.rightCols<1>();
      const double half = 0.5 * std::sqrt(2.0);
      EXPECT_TRUE(before.isApprox(100.0 * Vec3(half, 1.0 - half, 0.0), 1e-3));
      EXPECT_LT(solve(bend.problem, bend.state, 1e-4), 30);
      moved.push_back(bend.state.x.rightCols<1>() - before);
    }
    // 1 % (D11) is what published values scatter by; 0.01 % is measured.
    EXPECT_LT((moved[2] - row.displacement).norm(), 0.001 * row.displacement.norm());
    // The reference has too few digits for an order, but differences of neighbours shrink by four.
    EXPECT_NEAR(order_of((moved[1] - moved[0]).norm(), (moved[2] - moved[1]).norm()), 2.0, 0.1);
  }
}

TEST(Verification, EquilibriumTurnsWithTheWorld) {
  // Wire, clamp, roll and load turned together: so are nodes and directors, and twist stays.
  const Mat3 R = Eigen::AngleAxisd(1.1, Vec3(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  Bend45 here(40, 600.0, Mat3::Identity()), there(40, 600.0, R);
  for (Bend45* bend : {&here, &there}) {
    bend->problem.load = &bend->load;
    solve(bend->problem, bend->state, 1e-4);
  }
  // Residuals of 1e-4 N against a stiffness of 600 N per 60 mm.
  EXPECT_LT((there.state.x - R * here.state.x).norm(), 1e-4);
  EXPECT_LT((there.state.director - R * here.state.director).norm(), 1e-6);
  EXPECT_LT((there.state.theta - here.state.theta).norm(), 1e-6);
  EXPECT_LT((there.state.reference_twist - here.state.reference_twist).norm(), 1e-6);
  EXPECT_GT(here.state.theta.norm() + here.state.reference_twist.norm(), 0.1);  // it is twisted
}

// ---------------------------------------------------------------- V11: the localised helix

TEST(Verification, TwistedRodLocalisesIntoAHelix) {  // V11
  // 27 turns on 100 mm, then the ends come 3 mm together (references D6).
  const double L = 100.0, B = 1.345, C = 0.789, turns = 27.0, slack = 3.0;
  const double M = 98.5415 * B / L, T = 2900.993 * B / (L * L);
  const int elements = 200;
  const Rod rod = twisted_rod(uniform_wire(L, B, 1e4, C), elements);
  RodState state = straight_along_x(rod);
  twist_evenly(rod, turns * 2.0 * kPi / L, state);
  // A helix of 0.5 mm in the middle, wound as the torque winds it, seeds the buckling.
  const RodState straight = state;
  for (int i = 1; i < elements; ++i) {
    const double s = (static_cast<double>(i) / elements - 0.5) * L;
    const double size = 0.5 / std::cosh(s / 5.0), phase = 0.5 * M / B * s;
    state.x(1, i) = size * std::cos(phase);
    state.x(2, i) = size * std::sin(phase);
  }
  transport_frames(straight, state, 0, elements - 1);
  const Problem problem = problem_of(rod, clamped(), clamped());
  const int steps = 30;
  for (int k = 1; k <= steps; ++k) {
    state.x.row(0) *= (L - slack * k / steps) / state.x(0, elements);
    solve(problem, state, 1e-7);  // 99 iterations for the first step, 20 after
  }

  // Envelope (cos phi - cos phi0)/(1 - cos phi0) of the angle between wire and axis.
  const double deepest = analytic::localised_helix_cosine(0.0, B, T, M);
  double squares = 0.0, lowest = 1.0;
  for (int i = 0; i < elements; ++i) {
    const Vec3 e = state.x.col(i + 1) - state.x.col(i);
    const double cosine = e.x() / e.norm(), s = ((i + 0.5) / elements - 0.5) * L;
    const double off = (cosine - analytic::localised_helix_cosine(s, B, T, M)) / (1.0 - deepest);
    squares += off * off;
    lowest = std::min(lowest, cosine);
  }
  EXPECT_LT(std::sqrt(squares / elements), 0.02);           // D11
  EXPECT_NEAR(std::acos(lowest) / kRadPerDeg, 47.65, 0.5);  // an edge may miss the middle

  // Tension from the reaction, torque from the twist at a node. An edge spans a phase of 0.25 rad
  // of the helix, which makes bending 0.5 % soft and the tension that holds it lower by twice that.
  Eigen::Matrix3Xd gradient(3, rod.nodes());
  Statics::evaluate(problem, state, gradient);
  const int quarter = elements / 4;
  const double torque = rod.twist[quarter] * (state.theta[quarter] - state.theta[quarter - 1] +
                                              state.reference_twist[quarter]);
  EXPECT_NEAR(-gradient(0, 0), T, 0.02 * T);
  EXPECT_NEAR(torque, M, 0.01 * M);
}

// ---------------------------------------------------------------- the hot loop

TEST(HotLoop, AllocatesNothingWhenItSolvesAgain) {
#ifdef WIREPLAN_COUNTS_ALLOCATIONS
  Eigen::VectorXd lengths = Eigen::VectorXd::Constant(50, 1.0);
  for (const bool twisted : {false, true}) {
    SCOPED_TRACE(twisted);
    const Rod rod =
        build_rod(uniform_wire(50.0, 20.0, 1e4, 0.0, twisted ? 0.02 : 0.0), lengths, twisted);
    Problem problem = problem_of(rod, clamped());
    Eigen::Matrix3Xd load = tip_load(rod, Vec3(0.0, 0.01, 0.02));
    problem.load = &load;
    RodState state = straight_along_x(rod);
    Statics statics;
    const NewtonOptions options{.residual_tolerance = 1e-8};
    allocations = 0;
    counting = true;
    const NewtonResult first = statics.solve(problem, state, options);
    counting = false;
    EXPECT_GT(allocations, 0);  // the count works: the first solve builds its memory
    load *= 3.0;
    allocations = 0;
    counting = true;
    const NewtonResult second = statics.solve(problem, state, options);
    counting = false;
    EXPECT_EQ(allocations, 0);
    EXPECT_TRUE(first.converged && second.converged);
    EXPECT_GT(second.iterations, 2);
  }
#else
  GTEST_SKIP() << "allocations are counted with glibc and without sanitizers";
#endif
}

}  // namespace
}  // namespace wireplan::simulate
