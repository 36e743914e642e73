#pragma once
/// Newton's method with a block-banded factorisation (DESIGN.md), and all numbers that tune it.
#include "simulate/equilibrium/problem.h"
#include "simulate/equilibrium/solve_memory.h"

namespace wireplan::simulate {

struct NewtonOptions {
  double residual_tolerance = 1e-6;  // largest nodal force out of balance           [N]
  int max_iterations = 200;
  /// A saddle, as a column that is straight under more than Euler's load, is left for an
  /// equilibrium that is stable. Without a vessel.
  bool leave_saddles = false;
};

struct NewtonResult {
  bool converged = false;    // to the tolerance, or to what rounding allows (see rounding_floor)
  double residual = 0.0;     //                                              [N]
  double energy = 0.0;       // all terms                                    [N mm]
  double wall_energy = 0.0;  // of them, that of the yielding wall          [N mm]
  double worst_energy_rise = 0.0;  // over accepted steps, with the lag (WallContact) that they
                                   // were made with; 0 unless rounding [N mm]
  /// Residual that 64 bit numbers leave in the stiffest element, 8 eps |x| (EA/l + 4 EI/l^3): a
  /// tolerance below it is met once steps fall below rounding [N].
  double rounding_floor = 0.0;
  int iterations = 0;
  bool at_saddle = false;  // not converged: in equilibrium, but not in a stable one
};

/// What tunes the method. Reasons with figures stand in MEASUREMENTS.md; "chosen" means not
/// measured.
struct NewtonTuning {
  // The Hessian's diagonal is shifted until it factors, and further until a vessel lets the whole
  // step be taken: a floppy wire's soft modes ask for centimetres.
  double smallest_shift = 1e-7;    // chosen, small: at 1e-4 tips that slid crept       [N/mm]
  double largest_shift = 1e30;     // beyond it a number in the Hessian is not finite   [N/mm]
  double shift_growth = 4.0;       // 8 left more slow pushes, 2.5 did no better
  double kept_shift = 0.1;         // of the last iteration's, to start from; chosen
  double first_long_shift = 1e-4;  // of a step that is too long; chosen                [N/mm]
  double kept_long_shift = 0.25;   // of the last iteration's, to start from; chosen
  int most_long_shifts = 6;        // chosen: from 1e-4 to 0.1 N/mm

  // Friction and feet are lagged. Refreshed at first after every step, then only where the residual
  // is met: iterations else go round between two lags.
  int eager_refreshes = 25;  // from then on feet are held too
  int eager_again = 8;       // after one that met the residual with an old lag

  // Looks along the wall for how far a step is safe: more after steps that were too long and well.
  // 32 at once made floppy wires take 1.3 times the iterations.
  int most_looks = 32, more_looks = 4;

  // A vessel that lets no more than a part be taken of so many steps in a row: the energy jumps
  // there, as where the field of the wall begins, and no equilibrium is near.
  double stalled_part = 0.01;  // chosen
  int most_stalled = 5;        // chosen

  // After a full step in a vessel from a residual of no more than this the Hessian is not built
  // anew. Mostly the wire is then in equilibrium; and where it is not, but the residual fell to a
  // small part of itself, the factor of before does for one more step.
  double nearly_there = 0.01;  // fixed: at 1e4 tolerances loose ones took more steps   [N]
  double fell_banded = 0.03;   // where the factor has everything
  double fell_folded = 0.003;  // a wall that yields has kinks

  // Saddles. They are left where the residual is met, or where so many steps in a row were shifted:
  // the last of them came to a saddle ever more slowly.
  int most_shifted = 10;        // chosen
  int saddle_solves = 30;       // inverse iterations for the way down; chosen
  double first_nudge = 0.01;    // of the wire's radius, the largest motion of a node; chosen
  double largest_nudge = 10.0;  // beyond it, where the energy does not fall, the saddle is rounding
  double nudge_growth = 4.0;    // chosen

  // Line search.
  double armijo = 1e-4;        // part of the slope; the usual value
  double rounding = 1e-13;     // of an energy; chosen
  double roundings = 10.0;     // by which it must fall for a step to be doubled; chosen
  double doubled_from = 0.75;  // fall of the energy, of what the slope says, from which on
                               // the step was too short: it is a half where the Hessian is
                               // exact
  double halved = 0.5;         // residual of a full step that counts though the lagged
                               // energy did not fall
  int most_cuts = 40;          // chosen: to 1e-12 of the step by halves
  double least_cut = 0.1, most_cut = 0.5;  // safe bracket of the parabola; the usual values

  // GMRES for what the band leaves out. To 0.1, and not at all below 0.02 of the gradient, took as
  // much time and more iterations.
  int most_directions = 10;  // chosen
  double enough = 0.01;      // of the first residual
  double not_worth = 5e-4;   // of the gradient: not worth a solve
  double kept_slope = 0.1;   // of the banded step's, else the refined step is dropped; chosen

  // A solve that has met its rounding floor ends once no number of a step is above this many last
  // places of the largest coordinate.
  double last_places = 64.0;  // chosen
};

/// Moves `state` to equilibrium, starting from where it is; on failure it is the last iterate. D is
/// 3 and one for each twist: that of the rod or those of the tools. The memory is reused: nothing
/// is allocated once it has grown.
template <int D>
NewtonResult solve_newton(const Problem& problem, RodState& state, const NewtonOptions& options,
                          SolveMemory& memory, BandMemory<D>& bands);
extern template NewtonResult solve_newton<3>(const Problem&, RodState&, const NewtonOptions&,
                                             SolveMemory&, BandMemory<3>&);
extern template NewtonResult solve_newton<4>(const Problem&, RodState&, const NewtonOptions&,
                                             SolveMemory&, BandMemory<4>&);
extern template NewtonResult solve_newton<5>(const Problem&, RodState&, const NewtonOptions&,
                                             SolveMemory&, BandMemory<5>&);
extern template NewtonResult solve_newton<6>(const Problem&, RodState&, const NewtonOptions&,
                                             SolveMemory&, BandMemory<6>&);

}  // namespace wireplan::simulate
