#pragma once
/// GMRES (Saad & Schultz 1986) for what a factored matrix lacks of the exact one.
#include <Eigen/Core>
#include <Eigen/Jacobi>
#include <array>
#include <cmath>

#include "simulate/equilibrium/newton.h"
#include "simulate/wire/lanes.h"

namespace wireplan::simulate {

inline constexpr int kMostDirections = NewtonTuning().most_directions;

/// Takes what lies along `count` unit columns, of n numbers each, out of v; `along` tells how much.
WIREPLAN_INLINE void take_out_columns(const double* columns, int count, std::size_t n, double* v,
                                      double* along) {
  for (int i = 0; i < count; ++i, columns += n) {
    along[i] = lanes::dot(columns, v, n);
    lanes::add_scaled(-along[i], columns, v, n);
  }
}
WIREPLAN_WIDE inline void take_out_columns_wide(const double* columns, int count, std::size_t n,
                                                double* v, double* along) {
  take_out_columns(columns, count, n, v, along);
}

/// Adds to the step the best combination of directions, the first of which is `memory.refined`, of
/// length `start`, until no more than `enough` of that is left. `apply` puts H^-1 R v into
/// `memory.refined`.
template <class Apply>
void add_krylov(SolveMemory& memory, double start, double enough, Eigen::VectorXd& step,
                const Apply& apply) {
  Eigen::VectorXd &refined = memory.refined, &direction = memory.direction;
  Eigen::MatrixXd& krylov = memory.krylov;
  Eigen::Matrix<double, kMostDirections + 1, kMostDirections> upper;  // on the directions so far
  Eigen::Matrix<double, kMostDirections + 1, 1> right;
  std::array<Eigen::JacobiRotation<double>, kMostDirections> rotations;
  upper.setZero();
  right.setZero();
  right[0] = -start;
  krylov.col(0) = refined / start;
  int count = 0;
  while (count < kMostDirections && std::abs(right[count]) > enough * start) {
    const int k = count++;
    direction = krylov.col(k);
    apply(direction);
    refined += direction;
    (has_wide_registers() ? take_out_columns_wide : take_out_columns)(
        krylov.data(), k + 1, static_cast<std::size_t>(krylov.rows()), refined.data(),
        &upper(0, k));
    upper(k + 1, k) = refined.norm();
    if (upper(k + 1, k) > 0.0) krylov.col(k + 1) = refined / upper(k + 1, k);
    for (int i = 0; i < k; ++i) {
      upper.col(k).applyOnTheLeft(i, i + 1, rotations[static_cast<std::size_t>(i)].adjoint());
    }
    Eigen::JacobiRotation<double>& rotation = rotations[static_cast<std::size_t>(k)];
    rotation.makeGivens(upper(k, k), upper(k + 1, k));
    upper.col(k).applyOnTheLeft(k, k + 1, rotation.adjoint());
    right.applyOnTheLeft(k, k + 1, rotation.adjoint());
  }
  for (int i = count - 1; i >= 0; --i) {
    for (int j = i + 1; j < count; ++j) right[i] -= upper(i, j) * right[j];
    right[i] /= upper(i, i);
    step += right[i] * krylov.col(i);
  }
}

}  // namespace wireplan::simulate
