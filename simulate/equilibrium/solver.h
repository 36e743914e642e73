#pragma once
/// Static equilibrium of a rod: the minimum of stretch + bend + twist + loads + contact over its
/// free nodes, by Newton's method with a block-banded factorisation (DESIGN.md).
#include <optional>
#include <string>
#include <vector>

#include "simulate/contact/wall_contact.h"
#include "simulate/wire/block_band.h"
#include "simulate/wire/rod.h"
#include "simulate/wire/twist_chain.h"
#include "simulate/wire/wire_pass.h"

namespace wireplan::simulate {

/// How an end of the rod is held. `tangent` (unit, proximal to distal) is imposed by half a bend
/// element, which is second order where freezing the first edge is first order (design 7).
struct EndSupport {
  bool hold_along = false;    // the node's motion along `axis`
  bool hold_across = false;   // its motion normal to `axis`
  bool hold_roll = false;     // theta of the end's edge
  Vec3 axis = Vec3::UnitX();  // unit
  std::optional<Vec3> tangent;
};

/// Projector on the motions that an end support leaves to its node.
Mat3 free_directions(const EndSupport& support);

/// A moment on the distal edge about a fixed axis: it does work on the angle of the edge, seen
/// along the axis. In a plane normal to the axis this is the dead moment of textbooks. Has no value
/// where the edge lies along the axis.
struct TipMoment {
  Vec3 axis = Vec3::UnitZ();  // unit
  double size = 0.0;          //                                                         [N mm]
};

/// What is in equilibrium. Nodes first..last-1 are free, apart from what the end supports hold;
/// nodes before and after are where they are, and their edges' theta too. Terms that are absent
/// cost nothing.
struct Problem {
  const Rod* rod = nullptr;
  int first = 0, last = 0;
  EndSupport proximal, distal;             // of nodes 0 and n-1, where those are free
  const Eigen::Matrix3Xd* load = nullptr;  // (3, n) dead forces on the nodes                [N]
  std::optional<TipMoment> tip_moment;
  std::optional<Vec3>
      plane;  // unit normal of a table on which the wire lies: every node is held to the
              // plane through node 0, by springs as stiff as the wire's stretch
  WallContact* contact = nullptr;  // of this rod; the solver samples it at its own states
};

struct NewtonOptions {
  double residual_tolerance = 1e-6;  // largest nodal force out of balance           [N]
  int max_iterations = 200;
};

struct NewtonResult {
  bool converged = false;  // to the tolerance, or to what rounding allows (see rounding_floor)
  double residual = 0.0;   //                                              [N]
  double energy = 0.0;     // all terms                                    [N mm]
  double worst_energy_rise = 0.0;  // over accepted steps, with the lag (WallContact) that they
                                   // were made with; 0 unless rounding [N mm]
  /// Residual that 64 bit numbers leave in the stiffest element, 8 eps |x| (EA/l + 4 EI/l^3): a
  /// tolerance below it is met once steps fall below rounding [N].
  double rounding_floor = 0.0;
  int iterations = 0;
};

/// Energy by term [N mm].
struct Energy {
  double stretch = 0.0, bend = 0.0, twist = 0.0, load = 0.0, contact = 0.0, wall = 0.0;
  double total() const { return stretch + bend + twist + load + contact + wall; }
};

/// What holds the part of a rod that is not free, against the rod alone.
struct HeldEnd {
  Vec3 force = Vec3::Zero();  //                                                           [N]
  double torque = 0.0;        // about its edges, which turn as one                     [N mm]
};

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
  /// What keeps the nodes before the first free one, and their edges, where they are.
  static HeldEnd held_end(const Problem& problem, const RodState& state);
  /// For tests: gradient and dense Hessian over all x, then all theta (4n-1), supports ignored.
  static void derivatives(const Problem& problem, const RodState& state, Eigen::VectorXd& gradient,
                          Eigen::MatrixXd& hessian);

 private:
  template <int D>
  NewtonResult solve_with(BlockBand<D>& hessian, BlockBand<D>& factored, const Problem& problem,
                          RodState& state, const NewtonOptions& options);

  static constexpr int kKrylov = 10;
  template <int D>
  double refine_step(const Problem& problem, const BlockBand<D>& factored, double slope);

  WirePass pass_;
  BlockBand<3> hessian3_, factored3_;
  BlockBand<4> hessian4_, factored4_;
  UnsymmetricBand unsymmetric_;
  RodState trial_;
  Eigen::VectorXd gradient_, step_, first_step_, refined_, direction_;
  Eigen::MatrixXd krylov_;
  CoupledChain coupled_;
};

}  // namespace wireplan::simulate
