#pragma once
/// Spending time where it decides: every candidate is scouted on a rigid wall with long elements,
/// and what may be among the best is run in full; clear failures that matter are probed first, on
/// the rigid wall with the study's own elements.
#include <optional>
#include <vector>

#include "plan/ranking.h"
#include "preprocess/vessel.h"

namespace wireplan::plan {

/// Whether candidates are scouted at all: not where all are asked for, or they are eight or fewer.
bool needs_search(const Study& study, bool exhaustive);

/// The study at the scout's level: elements four times as long, but not so long that one of a
/// curved section turns by more than 1/3 rad at rest; pushes four times as long, up to 2 mm, where
/// the trial cuts them anyway, and to half the goal's radius, which they would step over; contact
/// points twice as far apart; residuals up to 1e-4 N; no forces per triangle.
///
/// The vessel's wall is to be rigid: one that yields costs several times as much (MEASUREMENTS.md),
/// and its compliance where no good plan goes is then never needed.
Study scout_study(const Study& study);

/// A candidate at the scout's or the probe's level. One whose tip has not come further along the
/// path for 40 mm of push, or 10 mm once it was beside the target, is given up as `missed`: in the
/// trials of five cases none of those reached (MEASUREMENTS.md).
simulate::TrialResult run_scout(const Study& scout, const Candidate& candidate,
                                const simulate::VesselModel& vessel, const Centerline& path);

/// What a level says of a candidate.
struct Sighting {
  bool reached = false, plan = false;
  bool unclear = false;  // it failed by no equilibrium or by our fault
  bool pinched = false;  // see is_pinched()
  double score = 1.0;    // of one that reached, whatever limits it broke
  double nearest = 0.0;  // to the target                                                   [mm]
};
/// `pinched` is left to is_pinched().
Sighting look_at(const Measured& trial, const Study& study, const Limits& limits,
                 const Weights& weights);

/// Whether a trial on a rigid wall was stuck in a stenosis that the wall, did it yield, might let
/// it through: with the tip where the path, within ten wire radii, leaves less room on each side
/// than the wire's radius.
bool is_pinched(const Measured& trial, double wire_radius, const Centerline& path);

/// What is known of the candidates, one entry each: of all from their scouts; of some from probes,
/// which are the study's own trials on a rigid wall, given up as scouts are, a fraction of the cost
/// of those on one that yields; and of some in full.
struct Sightings {
  std::vector<Sighting> scouts;
  std::vector<std::optional<Sighting>> probes, full;
};

/// Candidates to run next, ascending. No more than one list has any: what is run in full at once
/// comes before probes. Both are empty when no more are needed.
struct NextRuns {
  std::vector<int> probes = {}, full = {};
};

/// What may matter is run in full. Where its scout clearly failed (it was not pinched, stayed more
/// than two radii off the goal and found its equilibria) it is probed first (if `probing`; not
/// where the study's own wall is rigid), and run in full unless the probe clearly failed too. Asked
/// again until it names none, it wants, by the best that is known of each:
///   1. the five that score best;
///   2. of each wire its best, or the nearest where none reached; and while those are no plans the
///      next that reached, four in all;
///   3. of those whose scouts did not reach one in 16, rounded up, nearest first, for which the
///      scout may be at fault: without equilibrium, or within two radii of the goal;
///   4. all that reached with a score that may beat the best full plan: by no more than the rigid
///      wall was ever found to be off, and at least by kScoutMargin;
///   5. while no full run is a plan, eight more, the best and then the nearest first: all whose
///      scout reached, and of the others until 32 or an eighth of all are known;
///   6. all that were pinched: a rigid wall cannot tell which of them is the best.
NextRuns choose_next(const Study& study, const std::vector<Candidate>& candidates,
                     const Sightings& seen, bool probing);

/// Scouts of 221 trials were off by 0.012 up and 0.052 down where they and the full trials were
/// plans (MEASUREMENTS.md): what is not known of a case yet is taken to be half of that.
inline constexpr double kScoutMargin = 0.03;

/// How far the scout was off, over the candidates that were run in full too.
struct ScoutError {
  int compared = 0;                                   // run at both levels
  int both_reached = 0;                               // of these, whose scores can be compared
  int missed = 0;                                     // plans in full that the scout saw fail
  int false_reached = 0;                              // no plans in full that the scout saw reach
  std::optional<double> median_score, largest_score;  // size of the difference of both_reached
};
ScoutError find_scout_error(const std::vector<Sighting>& scouts,
                            const std::vector<std::optional<Sighting>>& full);

}  // namespace wireplan::plan
