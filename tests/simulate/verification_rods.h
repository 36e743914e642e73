#pragma once
/// Wires, supports and solves, as the verifications need them.
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
#include "tests/simulate/direct_solvers.h"
#include "tests/simulate/supports.h"

namespace wireplan::simulate {

// ---------------------------------------------------------------- wires, supports, solves

inline Wire uniform_wire(double length, double EI, double EA, double GJ = 0.0,
                         double curvature = 0.0) {
  return {.name = "beam",
          .radius = 0.5,
          .sections = {{.length = length,
                        .bending_stiffness = EI,
                        .axial_stiffness = EA,
                        .twist_stiffness = GJ,
                        .rest_curvature = curvature}}};
}

inline Rod uniform_rod(double length, double EI, double EA, int elements) {
  return build_rod(uniform_wire(length, EI, EA), length, elements);
}

/// Free along x alone.
inline EndSupport guided() {
  EndSupport end;
  end.hold_across = true;
  return end;
}

inline EndSupport clamped(const Vec3& tangent = Vec3::UnitX()) {
  EndSupport end = pinned();
  end.hold_roll = true;
  end.tangent = tangent;
  return end;
}

inline EndSupport guided_clamp() {
  EndSupport end = clamped();
  end.hold_along = false;
  return end;
}

/// All nodes free, apart from what the supports hold.
inline Problem problem_of(const Rod& rod, const EndSupport& proximal,
                          const EndSupport& distal = {}) {
  Problem problem;
  problem.rod = &rod;
  problem.last = rod.nodes();
  problem.proximal = proximal;
  problem.distal = distal;
  return problem;
}

inline Eigen::Matrix3Xd tip_load(const Rod& rod, const Vec3& force) {
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, rod.nodes());
  load.rightCols<1>() = force;
  return load;
}

inline RodState straight_along_x(const Rod& rod) {
  return straight_state(rod, Vec3::Zero(), Vec3::UnitX(), 0.0);
}

/// Solves, and holds every solve of this file to the same: it converges, and energy falls at every
/// accepted step up to the rounding that the solver allows itself. Returns the iterations.
inline int solve(const Problem& problem, RodState& state, double tolerance,
                 int max_iterations = 200) {
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

inline double order_of(double coarse, double fine) { return std::log2(std::abs(coarse / fine)); }

/// Whether the Hessian of the state is positive definite on what the supports, whose axis is x,
/// leave free: whether the equilibrium is stable. `flat_node`, if any, keeps its z.
inline bool stable(const Problem& problem, const RodState& state, int flat_node = -1) {
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
  return is_positive_definite(kept);
}

/// Where `is_stable` of a load turns from true to false, by bisection between `low`
/// and `high` to a relative `tolerance`.
template <class Stable>
inline double find_critical(double low, double high, double tolerance, const Stable& is_stable) {
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
inline RodState stretched_along_x(const Rod& rod, double tension) {
  RodState state = straight_along_x(rod);
  state.x *= 1.0 + tension / rod.stretch[0];
  return state;
}

/// Twists the wire evenly, by `rate` per length, between ends whose roll is held.
inline void twist_evenly(const Rod& rod, double rate, RodState& state) {
  const int edges = static_cast<int>(state.theta.size());
  double arc = 0.0;
  for (int i = 0; i < edges; ++i) {
    const double l = rod.rest_length[i];
    // An end's edge carries the roll of the end, the others that of their middles.
    state.theta[i] = rate * (i == 0 ? 0.0 : i == edges - 1 ? arc + l : arc + 0.5 * l);
    arc += l;
  }
}

inline Rod twisted_rod(const Wire& wire, int elements) {
  return build_rod(wire, Eigen::VectorXd::Constant(elements, wire.length() / elements), true);
}

}  // namespace wireplan::simulate
