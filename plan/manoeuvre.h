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

struct Manoeuvres {
  std::vector<Candidate> found;  // with the moves that let a push reach the target; may be empty
  std::vector<int> starts;       // of each, the start that it went on from
  long branches = 0;             // that were tried
};

/// Searches from each start, in parallel, for the moves that bring the tip into the target:
///   1. Round the place where the wire left the path, it is turned, or pulled back and turned, and
///      pushed on. Each such try is a branch.
///   2. From the branches that came furthest the search goes on in the same way, up to `most_turns`
///      turns of the hub.
/// Finds up to three scripts per start: those of few turns first, then those that press the wall
/// least. The same at any thread count.
Manoeuvres find_manoeuvres(const Study& study, const std::vector<Candidate>& starts,
                           const Centerline& path, const simulate::VesselModel& vessel,
                           int most_turns, const BatchOptions& options);

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
