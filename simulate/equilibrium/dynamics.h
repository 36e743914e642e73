#pragma once
/// The paper's other ways to an equilibrium, on the same energy: its conjugate gradient, Eq.
/// (20)-(23), which takes one iteration per time step, and the explicit and semi-implicit Euler
/// schemes that it is compared with. Straight, untwisted rods with forces on their nodes, without a
/// wall, a table or a tip moment; for what these methods cannot do, use Statics.
#include "simulate/equilibrium/solver.h"

namespace wireplan::simulate {

struct MotionOptions {
  double time_step = 1e-3;          // tau: the viscosity of the conjugate gradient      [s]
  double duration = 1.0;            // stop here at the latest                          [s]
  double residual_tolerance = 0.0;  // stop here if it is met before; 0: run to the end  [N]
  double damping = 0.0;             // D = damping * M, Euler schemes only              [1/s]
};

enum class MotionOutcome {
  kConverged,  // the residual tolerance was met
  kFinished,   // the duration is over
  kUnstable,   // energy or positions grew without bound; state is the last finite one
};

struct MotionResult {
  MotionOutcome outcome = MotionOutcome::kFinished;
  long steps = 0;                   // time steps taken
  long restarts = 0;                // conjugate gradient: with the steepest descent
  double time = 0.0;                // simulated                                        [s]
  double residual = 0.0;            // largest nodal force out of balance               [N]
  double energy = 0.0;              // potential                                        [N mm]
  double worst_energy_rise = 0.0;   // of the potential over one step: 0 for the conjugate gradient
                                    // up to rounding                                   [N mm]
  double critical_time_step = 0.0;  // largest stable step, see the methods            [s]
};

/// Paper Eq. (20)-(23): Fletcher-Reeves direction, beta = |g|^2 / |g of before|^2, and the exact
/// minimum of the quartic along it. Restarts with the steepest descent when the direction does not
/// point downhill, which happens through rounding alone. Energy never rises, so it is stable at any
/// time step, which only tells how many iterations make a second: critical_time_step is infinite.
/// Needs no masses.
MotionResult run_conjugate_gradient(const Problem& problem, RodState& state,
                                    const MotionOptions& options);

/// The Euler schemes start at rest, expect masses above 0 at all free nodes, and call a wire
/// converged when the residual is within the tolerance and the kinetic energy below that of the
/// tolerance over a micrometre. They are kUnstable when a number is not finite, or kinetic and
/// elastic energy together exceed 10 times what the start and the loads can give: elastic energy of
/// the start + loads times twice the wire's length + energy that bends the wire into a ring.
///
/// critical_time_step is the limit of the linear theory, with w^2 the largest eigenvalue of M^-1 K
/// at the start (power iteration, up to 1 % low for long wires) and c the damping: edges that
/// stretch later are stiffer, so it is no promise.

/// x += dt v and v += dt (M^-1 f - c v), both from the old state. Every oscillation that is not
/// damped grows, whatever the step: critical_time_step = min(c / w^2, 2 / c), which is 0 without
/// damping.
MotionResult run_explicit_euler(const Problem& problem, RodState& state,
                                const MotionOptions& options);

/// v = (v + dt M^-1 f) / (1 + dt c), then x += dt v with the new velocity: the forces are explicit,
/// the damping is implicit. critical_time_step = (c + sqrt(c^2 + 4 w^2)) / w^2, which is 2 / w
/// without damping.
MotionResult run_semi_implicit_euler(const Problem& problem, RodState& state,
                                     const MotionOptions& options);

}  // namespace wireplan::simulate
