#pragma once
/// What plans are worth when patient and hand are not quite as assumed: each is run again under
/// disturbances that are the same for all plans, so that plans are compared and not luck.
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "plan/ranking.h"

namespace wireplan::plan {

/// How far the values may be from the assumed ones. Factors are spread evenly in their logarithm
/// between the bounds, directions and shifts evenly over a disc, the lumen evenly over both signs.
struct Unknowns {
  double friction_low = 0.5, friction_high = 2.0;  // assumed: of one coating, references A3
  /// The femoral artery stiffens 2.4 times from under 35 to over 60 years (references B1).
  double wall_low = 0.5, wall_high = 2.0;
  double angle = 5.0 * kRadPerDeg;  // of the introducer, in any direction; assumed        [rad]
  double entry = 1.0;               // of the introducer's point; assumed                  [mm]
  double lumen = 0.25;              // of the wall, in or out; assumed                     [mm]
};

struct RobustnessOptions {
  int repeats = 16;        // of each of the best plans; 0: none
  int plans = 5;           // the best so many are repeated, and the best of each wire
  std::uint64_t seed = 1;  // of the disturbances
  Unknowns unknowns = {};
};

/// One patient and hand as they may be. `tilt` turns the introducer about, and `shift` moves its
/// point along, the two directions across the vessel's tangent at the access that azimuth 0 and 90
/// deg name. A positive `inward` brings the wall nearer to the middle of the lumen.
struct Disturbance {
  double friction_factor = 1.0, wall_factor = 1.0;
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();   //                                     [rad]
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();  //                                     [mm]
  double inward = 0.0;                              //                                     [mm]
};

/// A Latin hypercube: every unknown takes each of `repeats` equal parts of its range once, in an
/// order of its own drawn from the seed. So few repeats cover each range evenly (McKay, Beckman and
/// Conover, Technometrics 1979). The same on every machine.
std::vector<Disturbance> draw_disturbances(const RobustnessOptions& options);

/// Repeats are found to so many times the study's residual: what that moves is far below what the
/// disturbances do (MEASUREMENTS.md).
inline constexpr double kRepeatTolerance = 10.0;

/// The trial of a candidate under a disturbance; no shapes on the way, no forces per triangle.
/// Never throws, as run_candidate does not.
///
/// A wall that is f times as stiff is had from the wall as it is: equilibrium depends on the ratio
/// of wire and wall, so EI, EA, GJ and the tolerance are divided by f, and all forces and works
/// multiplied by it. Exact but for the contact law, whose stiffness goes with the wall's. A lumen
/// that is narrower by d is the lumen as it is with a contact radius larger by d.
simulate::TrialResult run_disturbed(const Study& study, const Candidate& candidate,
                                    const simulate::VesselModel& vessel,
                                    const Disturbance& disturbance);

/// The largest inward and outward offset of the wall, and the largest shift of the entry, that the
/// trials can take: 0.8 of the thinnest wire's radius, and half the way from access to wall as far
/// as the field follows the wall [mm].
double largest_lumen_offset(const Study& study);
double largest_entry_shift(const Study& study, const simulate::VesselModel& vessel);

/// What is kept of a repeat: how it ended and what it cost, by the rules of the ranking.
Repeat judge_repeat(const Measured& trial, const Study& study, const Limits& limits,
                    const Weights& weights);

/// The plans to repeat next: of the first `plans` and of the first of each wire, those that have
/// fewer than `count` repeats. Trials, best first.
std::vector<int> choose_plans_to_repeat(const Ranking& ranking,
                                        const std::vector<RepeatedPlan>& repeated, int plans,
                                        int count);

/// Which unknown moves the ranking most.
struct Sensitivity {
  struct Share {
    std::string unknown;  // "friction", "wall", "angle", "entry", "lumen"
    double of_all = 0.0;  // of what all unknowns together explain; sum 1
  };
  std::vector<Share> shares;        // largest first; an unknown that does not act is not listed
  std::optional<double> explained;  // part of the ranking's movement that the regression explains,
                                    // corrected for the number of its coefficients
  std::string reason;               // why there are no shares; else empty
};

/// What moves the order is how far each plan's score is from the mean of all in the same repeat.
/// Its ranks over the repeats are regressed on those of the unknowns (standardised rank regression:
/// Helton and Davis, Reliab. Eng. Syst. Saf. 2003); an unknown's share is its squared coefficients,
/// of both directions where it has two, summed over plans by how much each moves. Plans with fewer
/// repeats than there are disturbances are left out.
Sensitivity find_sensitivity(const std::vector<Disturbance>& disturbances,
                             const std::vector<RepeatedPlan>& plans);

}  // namespace wireplan::plan
