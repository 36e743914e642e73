#pragma once
/// Where no straight push reaches the target and holds: scripts of pushes, pulls and turns.
#include <string>
#include <vector>

#include "plan/batch.h"
#include "plan/metrics.h"
#include "preprocess/vessel.h"

namespace wireplan::plan {

/// The straight pushes from which a search starts: of each wire that feels turns of the hub, the
/// `per_wire` whose tips came furthest along the path, in order of candidates. Candidates that
/// reached the target or have moves of their own are left out. `progress` is find_progress() of
/// each.
std::vector<int> choose_starts(const Study& study, const std::vector<Candidate>& candidates,
                               const std::vector<double>& progress,
                               const std::vector<simulate::Outcome>& outcomes, int per_wire);

/// How far a search goes.
struct SearchLimits {
  int most_turns = 3;  // of the hub in one script
  /// Branches in a row, spread over all that a round would try, that bring the tip no further: the
  /// round ends. Where scripts were found, the first came after 17 such, once after 76
  /// (MEASUREMENTS.md).
  int patience = 100;
  /// Of all starts together, which share it evenly: so much work as takes so long on one core of
  /// 2 GHz, counted in Newton iterations, so that it is the same on any machine            [s]
  double most_seconds = 60.0;
};

/// What a search took, and why it ended where it did not find anything.
struct SearchEffort {
  long branches = 0;         // that were tried
  long iterations = 0;       // Newton's, of these
  long most_iterations = 0;  // that they might have taken
  int no_further = 0;        // starts from which a round of turns brought the tip no further
  int cut_off = 0;           // starts that used up their share of the iterations
};

struct Manoeuvres {
  std::vector<Candidate> found;  // with the moves that let a push reach the target; may be empty
  std::vector<int> starts;       // of each, the start that it went on from
  SearchEffort effort;
};

/// Searches from each start, in parallel, for the moves that bring the tip into the target:
///   1. Round the place where the wire left the path, it is turned, or pulled back and turned, and
///      pushed on. Each such try is a branch.
///   2. From the branches that came furthest the search goes on in the same way, round by round,
///      one more turn of the hub in each.
/// A round ends early where nothing has reached and either its branches bring the tip no further
/// (SearchLimits::patience), or enough of them have left behind all places where it turns the wire.
/// A search ends with the round that finds scripts, or that brings the tip no further.
/// Finds up to three scripts per start: those of few turns first, then those that press the wall
/// least. The same at any thread count.
Manoeuvres find_manoeuvres(const Study& study, const std::vector<Candidate>& starts,
                           const Centerline& path, const simulate::VesselModel& vessel,
                           const SearchLimits& limits, const BatchOptions& options);

/// Moves rounded as files hold them, in degrees and mm, so that a script that is run is the very
/// script that is read again.
std::vector<simulate::Move> as_written(std::vector<simulate::Move> moves);

/// "push 112.0 mm, turn 90 deg clockwise, pull back 10.0 mm, then push on to 140.0 mm": the moves
/// as the hand makes them, turns as seen from the hub toward the patient. The last push goes to
/// `insertion`, where the trial ended [mm]. Empty for a straight push.
std::string describe_moves(const std::vector<simulate::Move>& moves, double insertion);
/// The same, each by itself.
std::vector<std::string> describe_each_move(const std::vector<simulate::Move>& moves,
                                            double insertion);

}  // namespace wireplan::plan
