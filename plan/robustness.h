#pragma once
/// What plans are worth when patient and hand are not quite as assumed. The best are run again
/// under disturbances, the same ones for all plans, so that none is better by luck.
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "plan/batch.h"
#include "plan/ranking.h"

namespace wireplan::plan {

/// How far the values may be from the assumed ones; those of the wires are in Study::spreads. The
/// wall is a factor, spread evenly in its logarithm between the bounds. Angle and entry are radii
/// of a disc over which the introducer's tilt and shift are spread evenly; the lumen's offset is
/// spread evenly over +-lumen.
struct Unknowns {
  /// The femoral artery stiffens 2.4 times from under 35 to over 60 years (references B1).
  double wall_low = 0.5, wall_high = 2.0;
  /// A factor too, of what holds a vessel whose cross-sections move: not measured on the patient.
  /// Published values reach from 0.01 to 10 kPa/mm (references-2 M).
  double support_low = 1.0, support_high = 1.0;
  double angle = 5.0 * kRadPerDeg;  // of the introducer, in any direction; assumed        [rad]
  double entry = 1.0;               // of the introducer's point; assumed                  [mm]
  double lumen = 0.25;              // of the wall, in or out; assumed                     [mm]
};

struct RobustnessOptions {
  int repeats = 16;        // of each of the best plans; 0: none
  int plans = 5;           // this many of the best are repeated, the best of each wire and
                           // of each catheter
  std::uint64_t seed = 1;  // of the disturbances
  Unknowns unknowns = {};
};

/// One patient and hand as they may be. `tilt` and `shift` have two components, for the directions
/// across the vessel's tangent at the access that azimuth 0 and 90 deg name: the introducer is
/// turned toward them by `tilt`, and its point is moved along them by `shift`. A positive `inward`
/// brings the wall nearer to the middle of the lumen.
///
/// One part of all wires' friction: what makes it more than assumed, the wall and what wets it,
/// does so for each. A part of its own for the EI of each wire: how far one is off tells nothing of
/// another.
struct Disturbance {
  double friction = 0.5;               // where every wire's lies in its spread, 0 to 1
  std::vector<double> stiffness = {};  // the same of each wire's EI; empty: as it is given
  double wall_factor = 1.0;
  double support_factor = 1.0;
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();   //                                     [rad]
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();  //                                     [mm]
  double inward = 0.0;                              //                                     [mm]
  double tube = 0.5;                                // where every catheter's EI lies in its spread
  bool operator==(const Disturbance&) const = default;
};

/// A Latin hypercube: every unknown takes each of `repeats` equal parts of its range once, in an
/// order of its own drawn from the seed. So few repeats cover each range evenly (McKay, Beckman and
/// Conover, Technometrics 1979). The same on every machine.
///
/// A wire's own draws follow from the seed and its name, so that it meets the same whatever the
/// others are.
std::vector<Disturbance> draw_disturbances(const RobustnessOptions& options,
                                           const std::vector<simulate::Wire>& wires);

/// Repeats are solved to this many times the study's residual. What that changes is far below what
/// the disturbances do (MEASUREMENTS.md).
inline constexpr double kRepeatTolerance = 10.0;

/// The study's wire with EI and friction as the disturbance has them.
simulate::Wire disturbed_wire(const Study& study, int wire, const Disturbance& disturbance);
simulate::Wire disturbed_tube(const Study& study, int catheter, const Disturbance& disturbance);

/// A catheter and its wires under a disturbance, and how they are brought in.
struct DisturbedTools {
  std::vector<simulate::Tool> tools;  // from the outside in
  simulate::Introducer introducer;
  simulate::ToolTrialOptions options;
};
DisturbedTools disturb_tools(const Study& study, const Candidate& candidate,
                             const simulate::VesselModel& vessel, const Disturbance& disturbance);

/// The trial of a candidate under a disturbance; no shapes on the way, no forces per triangle.
/// Never throws, as run_candidate does not.
///
/// The vessel model serves all disturbances as it is. A wall that is f times as stiff: equilibrium
/// depends on the ratio of wire and wall alone, so EI, EA, GJ and the tolerance are divided by f
/// instead, and so is the support of sections that move, and all forces and works are multiplied by
/// f afterwards. This is exact but for the contact law, which is then f times as stiff too. A lumen
/// that is narrower by d: the wire's contact radius is larger by d instead.
simulate::TrialResult run_disturbed(const Study& study, const Candidate& candidate,
                                    const simulate::VesselModel& vessel,
                                    const Disturbance& disturbance, SharedTools& shared);
simulate::TrialResult run_disturbed(const Study& study, const Candidate& candidate,
                                    const simulate::VesselModel& vessel,
                                    const Disturbance& disturbance);

/// The largest offsets that trials can be run with [mm]. Of the wall, in or out: 0.8 of the
/// thinnest wire's radius. Of the entry: half the distance from the access to the wall, which the
/// field gives up to its band.
double largest_lumen_offset(const Study& study);
double largest_entry_shift(const Study& study, const simulate::VesselModel& vessel);

/// What is kept of a repeat: whether it reached and is a plan by the rules of the ranking, its
/// score, its forces.
Repeat judge_repeat(const Measured& trial, const Study& study, const Limits& limits,
                    const Weights& weights);

/// The plans to repeat next, as trials, best first: the first `plans` of the ranking and the best
/// of each wire and of each catheter, without those that have `count` repeats already.
std::vector<int> choose_plans_to_repeat(const Ranking& ranking,
                                        const std::vector<Candidate>& candidates,
                                        const std::vector<RepeatedPlan>& repeated, int plans,
                                        int count);

/// Which unknown moves the ranking most.
struct Sensitivity {
  struct Share {
    std::string unknown;  // "friction", "stiffness", "wall", "angle", "entry", "lumen",
                          // "support"
    double of_all = 0.0;  // of what all unknowns together explain; sum 1
  };
  std::vector<Share> shares;        // largest first; an unknown that does not act is not listed
  std::optional<double> explained;  // part of the ranking's movement that the regression explains,
                                    // corrected for the number of its coefficients
  std::string reason;               // why there are no shares; else empty
};

/// Finds the shares by a standardised rank regression (Helton and Davis, Reliab. Eng. Syst. Saf.
/// 2003):
///   1. What moves the order is how far each plan's score is from the mean of all plans in the same
///      repeat.
///   2. For each plan the ranks of these differences over the repeats are regressed on the
///      unknowns' ranks. Of friction and EI it is that of its own wires and catheter, where they
///      have a spread.
///   3. An unknown's share is the sum of its squared coefficients (of both directions, or of each
///      tool's EI, where it has several) over all plans, each weighted by how much its differences
///      vary.
/// Plans with fewer repeats than there are disturbances are left out.
Sensitivity find_sensitivity(const std::vector<Disturbance>& disturbances,
                             const std::vector<RepeatedPlan>& plans, const Study& study,
                             const std::vector<Candidate>& candidates);

}  // namespace wireplan::plan
