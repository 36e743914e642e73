#pragma once
/// Static equilibrium of a rod: the minimum of stretch + bend + twist + loads + contact over its
/// free nodes, by Newton's method with a block-banded factorisation (DESIGN.md).
#include "simulate/equilibrium/newton.h"
#include "simulate/equilibrium/problem.h"
#include "simulate/equilibrium/solve_memory.h"

namespace wireplan::simulate {

/// Solver with the memory that its solves reuse. One per thread.
class Statics {
 public:
  /// Moves `state` to equilibrium, starting from where it is. On failure `state` is the last
  /// iterate.
  NewtonResult solve(const Problem& problem, RodState& state, const NewtonOptions& options);
  /// Energy at the state and, in `gradient` (3, n), its derivative with respect to all nodes, held
  /// ones included: minus the gradient is the force of the rod and its loads on a node [N].
  static Energy evaluate(const Problem& problem, const RodState& state,
                         Eigen::Ref<Eigen::Matrix3Xd> gradient);
  /// The energy alone, of what there is but contact with a vessel [N mm].
  static double energy(const Problem& problem, const RodState& state);
  /// What keeps the nodes before the first free one, and their edges, where they are.
  static HeldEnd held_end(const Problem& problem, const RodState& state);
  /// The energy that node i gains per length of bent wire that is added to its `length` as it is
  /// bent now, its turn and the wire's shape elsewhere given: -M^2/(2 EI) of a straight round wire
  /// under a moment M [N].
  static double bend_per_length(const Rod& rod, const RodState& state, int i, double length);
  /// For tests: gradient and dense Hessian over all x, then all theta (4n-1; with
  /// tools tool by tool), then the sections' displacements, supports ignored.
  static void derivatives(const Problem& problem, const RodState& state, Eigen::VectorXd& gradient,
                          Eigen::MatrixXd& hessian);

 private:
  SolveMemory memory_;
  BandMemory<3> bands3_;
  BandMemory<4> bands4_;
  BandMemory<5> bands5_;
  BandMemory<6> bands6_;
};

}  // namespace wireplan::simulate
