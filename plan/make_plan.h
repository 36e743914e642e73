#pragma once
/// Everything that a case simulates, each step deciding what the next one runs:
///   1. straight pushes, in rounds;
///   2. manoeuvres, where no straight push reaches the target and holds;
///   3. refinement, which finds the numerical error of what may be best;
///   4. repeats of the best under disturbances, and refinement again if that puts others first;
///   5. attempts: for wires without a plan, the closest trial in full, to be looked at.
/// What the runs are worth by the case's limits and weights is found in judge.h.
#include <functional>
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

/// A report plays the insertions of this many best plans, and of the closest attempt of each wire
/// without a plan.
inline constexpr std::size_t kPlansPlayed = 20;

/// For somebody who waits, each may be empty. Nothing of the plan follows from what they are told.
struct Early {
  std::function<void(const FirstAnswer&)> scouted;  // once the scouts are known
  std::function<void(const Candidate&)> script;     // once the search finds one of catheter and
                                                    // wire; which, hangs on the threads
};

struct PlanOptions {
  enum class Until { kTrials, kManoeuvres, kEnd };

  bool exhaustive = false;  // no scouts: all in full
  Hooks hooks = Hooks::kBest;
  Manoeuvring manoeuvres = Manoeuvring::kWhenNeeded;
  RobustnessOptions robustness = {};  // ranges are cut to what trials can be run with
  Until until = Until::kEnd;          // the last step that is done
  BatchOptions batch = {};
  Early early = {};
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
  std::vector<int> attempts;  // trials of wires without a plan, run in full to have their shapes

  /// What this call did not find in the log; timing.
  Spent scouts, probes, full, repeats;
};

/// The runs that tell a plan's error: with other elements, then with a setting changed. Those that
/// they ask for once they have been made (needs_finest). And the error that those of `runs` with
/// its id come to, with the latter behind the others.
std::vector<Run> refinement_runs(int id, const Candidate& candidate, double insertion);
std::vector<Run> finest_runs(const Study& study, const std::vector<Run>& runs,
                             const std::vector<Measured>& trials);
Refinement estimate_error_of(const Study& study, int id, const std::vector<Run>& runs,
                             const std::vector<Measured>& trials);

/// Finds in the log what is known and simulates the rest. All decisions follow from the trials, the
/// study and Yardstick, so the same comes out whatever was known. Throws Interrupted.
Plan make_plan(const Study& study, const PlanVessel& vessel, const PlanOptions& options,
               TrialLog& log);

}  // namespace wireplan::plan
