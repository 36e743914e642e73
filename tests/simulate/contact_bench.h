#pragma once
/// Wires in vessels, as the verifications of contact need them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "simulate/insertion/scene.h"
#include "tests/shapes.h"
#include "tests/simulate/supports.h"

namespace wireplan::simulate {

// ---------------------------------------------------------------- wires in vessels

inline Wire round_wire(double length, double radius, double EI, double EA = 0.0) {
  return {.name = "uniform",
          .radius = radius,
          .sections = {{.length = length, .bending_stiffness = EI, .axial_stiffness = EA}}};
}

/// A straight rod, a vessel, and the rod's present state along given points.
struct Bench {
  Rod rod;
  RodState state;
  WallContact contact;
  Problem problem;
  Statics statics;

  Bench(const Wire& wire, int elements, const VesselModel& vessel, const ContactOptions& options,
        const std::function<Vec3(double)>& point_at)
      : rod(build_rod(wire, wire.length(), elements)),
        state(straight_state(rod, Vec3::Zero(), Vec3::UnitZ(), 0.0)),
        contact(rod, vessel, options) {
    for (int i = 0; i < rod.nodes(); ++i) {
      state.x.col(i) = point_at(rod.tip_distance[0] - rod.tip_distance[i]);
    }
    contact.start_at(state);
    problem.rod = &rod;
    problem.last = rod.nodes();
    problem.contact = &contact;
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  /// Equilibrium, with the friction of that very state and not of one before; and what slipped has
  /// slipped.
  NewtonResult solve(double tolerance = 1e-6) {
    const NewtonResult result =
        statics.solve(problem, state, {.residual_tolerance = tolerance, .max_iterations = 500});
    Eigen::Matrix3Xd gradient(3, rod.nodes());
    Statics::evaluate(problem, state, gradient);
    gradient.leftCols(problem.first).setZero();
    gradient.rightCols(rod.nodes() - problem.last).setZero();
    if (problem.first == 0) gradient.col(0) = free_directions(problem.proximal) * gradient.col(0);
    if (problem.last == rod.nodes()) {
      gradient.rightCols<1>() = (free_directions(problem.distal) * gradient.rightCols<1>()).eval();
    }
    if (result.converged) {
      EXPECT_NEAR(gradient.colwise().norm().maxCoeff(), result.residual, 1e-3 * tolerance);
      contact.settle();
    }
    return result;
  }
};

inline EndSupport held_along(const Vec3& axis) {
  EndSupport end;
  end.hold_along = true;
  end.axis = axis;
  return end;
}

inline EndSupport held_across(const Vec3& axis) {
  EndSupport end;
  end.hold_across = true;
  end.axis = axis;
  return end;
}

/// Tube along z whose circles have many corners, for a smooth cross section, but lie far apart.
inline Surface long_tube(double radius, double length, int sides) {
  const int rows = static_cast<int>(std::lround(length / 20.0));
  Eigen::Matrix3Xd axis = Eigen::Matrix3Xd::Zero(3, rows + 1);
  axis.row(2) = Eigen::RowVectorXd::LinSpaced(rows + 1, 0.0, length);
  return shapes::tube(axis, Eigen::VectorXd::Constant(rows + 1, radius), sides);
}

/// Sum of the normal forces of the touches that `counts`.                                   [N]
inline double normal_force(const std::vector<Touch>& touches,
                           const std::function<bool(const Touch&)>& counts) {
  double sum = 0.0;
  for (const Touch& touch : touches) {
    if (counts(touch)) sum += touch.normal_force;
  }
  return sum;
}

}  // namespace wireplan::simulate
