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

/// The study at the scout's level:
///   - elements four times as long, but in curved sections none turns by over 1/3 rad at rest;
///   - pushes four times as long, but at most 2 mm, where the trial cuts them anyway, and at most
///     half the radius of the goal and of the others, so that none steps over a sphere, and thin
///     vessels are followed;
///   - contact points up to twice as far apart, residuals up to 1e-4 N, no forces per triangle.
/// Scouts are run on a rigid wall: one that yields costs several times as much (MEASUREMENTS.md),
/// and its compliance is then never computed where no good plan goes. A vessel that moves as a
/// whole does so under scouts too: a stiff wire may pass it that way alone.
Study scout_study(const Study& study);

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

/// Whether a trial on a rigid wall was stuck in a stenosis that a yielding wall might let it pass:
/// within ten wire radii of the tip along the path, there is less room on each side of the wire
/// than the wire's radius.
bool is_pinched(const Measured& trial, double wire_radius, const Centerline& path);

/// What is known of the candidates, one entry each: of all from scouts, of some from probes, of
/// some from full runs. A probe is the study's own trial, but on a rigid wall; it takes a fraction
/// of the time of a full run on a wall that yields.
struct Sightings {
  std::vector<Sighting> scouts;
  std::vector<std::optional<Sighting>> probes, full;
};

/// Candidates to run next, ascending. At most one of the lists has any: full runs are done before
/// probes. Both are empty when no more are needed.
struct NextRuns {
  std::vector<int> probes = {}, full = {};
};

/// Which candidates to run next; asked again after each round until it names none. It goes by the
/// best that is known of each candidate on the rigid wall, its probe or else its scout, and wants:
///   1. the five that score best;
///   2. of each wire its best, or the nearest where none reached; while that is no plan, the next
///      that reached, up to four tries in all;
///   3. failures for which the scout may be at fault, because it found no equilibrium, was pinched
///      or came within two radii of the goal: one in 16 of all failed scouts, rounded up. The best
///      of each wire counts first, then the nearest;
///   4. all that reached and may beat the best full plan, if their score is off by as much as the
///      rigid wall was found to be anywhere in this case, or by kScoutMargin if that is more;
///   5. all that were pinched: a rigid wall cannot tell which of them is the best;
///   6. where the above names none and no full run is a plan: up to eight more, the most promising
///      first. All that reached count for this, and others until eight, or a twelfth of all if that
///      is more, are known.
/// What is wanted is run in full. Only if it clearly failed (none of the doubts of 3) and `probing`
/// (false where the study's own wall is rigid), it is probed first, and settled if the probe
/// clearly fails too.
NextRuns choose_next(const Study& study, const std::vector<Candidate>& candidates,
                     const Sightings& seen, bool probing);

/// How far a score on the rigid wall is taken to be off at least, before a case shows more: about
/// half of the range -0.012 to 0.052 by which scouts and full runs of 221 trials differed where
/// both were plans (MEASUREMENTS.md).
inline constexpr double kScoutMargin = 0.03;

/// How far the scout was off, over the candidates that were run in full too.
struct ScoutError {
  int compared = 0;                                   // run at both levels
  int both_reached = 0;                               // of these, whose scores can be compared
  int missed = 0;                                     // plans in full whose scout did not reach
  int false_reached = 0;                              // no plans in full, though the scout reached
  std::optional<double> median_score, largest_score;  // size of the difference of both_reached
};
ScoutError find_scout_error(const std::vector<Sighting>& scouts,
                            const std::vector<std::optional<Sighting>>& full);

}  // namespace wireplan::plan
