#pragma once
/// Everything that a case simulates, in the order in which one thing decides the next: straight
/// pushes in rounds, manoeuvres where those do not do, the errors of what may be the best, repeats
/// of the best under disturbances. What it is worth by the case's limits and weights is judge.h.
#include <optional>
#include <vector>

#include "plan/refine.h"
#include "plan/rounds.h"

namespace wireplan::plan {

/// Whether scripts of moves are searched for (manoeuvre.h).
enum class Manoeuvring {
  kNever,
  kWhenNeeded,  // where no straight plan works in half of a few tries under disturbances
  kAlways,
};

/// The best so many plans can be played, and the closest attempt of each wire without a plan.
inline constexpr std::size_t kPlansPlayed = 20;

struct PlanOptions {
  enum class Until { kTrials, kManoeuvres, kEnd };

  bool exhaustive = false;  // no scouts: all in full
  Manoeuvring manoeuvres = Manoeuvring::kWhenNeeded;
  RobustnessOptions robustness = {};  // unknowns that no trial can take are cut to what one can
  Until until = Until::kEnd;          // what comes after is left out
  BatchOptions batch = {};
};

/// The trials of a plan under the disturbances, in their order.
struct RepeatedTrials {
  int trial = 0;  // index of the candidate
  std::vector<Measured> trials = {};
};

/// What was simulated.
struct Plan {
  std::vector<Candidate> candidates;  // straight pushes, then scripts
  std::vector<Level> levels;          // per candidate, of its trial
  std::vector<Measured> trials;       // per candidate
  std::optional<ScoutSummary> scouting;
  Scripts scripts;
  std::vector<Refinement> refinements;
  RobustnessOptions robustness;  // as used
  std::vector<Disturbance> disturbances;
  std::vector<RepeatedTrials> repeated;
  std::vector<int> attempts;  // trials of wires without a plan, in full for their shapes on the way

  /// What this call did not find in the log; timing.
  Spent scouts, probes, full, repeats;
};

/// Finds in the log what is known and simulates the rest. All decisions follow from the trials, the
/// study and Yardstick, so the same comes out whatever was known. Throws Interrupted.
Plan make_plan(const Study& study, const PlanVessel& vessel, const PlanOptions& options,
               TrialLog& log);

}  // namespace wireplan::plan
