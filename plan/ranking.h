#pragma once
/// Metrics -> ordered plans, with the reasons.
#include <optional>
#include <string>
#include <vector>

#include "plan/score.h"

namespace wireplan::plan {

/// A trial of a plan under a disturbance (robustness.h).
struct Repeat {
  bool reached = false;
  bool safe = false;   // it reached and broke no limit: it is a plan under the disturbance too
  double score = 1.0;  // its total; 1, the worst there is, where it is no plan
  double peak_contact_force = 0.0, mean_contact_force = 0.0, peak_tip_force = 0.0;  //       [N]
  double support = 0.0;     // ScriptMetrics::support                                            [N]
  std::string reason = {};  // why it is no plan; else empty
};

struct RepeatedPlan {
  int trial = 0;                // index of the candidate
  std::vector<Repeat> repeats;  // the k-th of every plan under the same disturbance; at least one
};

/// The repeats of a trial's plan; null where it is not among them.
const RepeatedPlan* find_repeated(const std::vector<RepeatedPlan>& repeated, int trial);

struct RankedPlan {
  int trial = 0;  // index of the candidate
  Score score;
  double score_error = 0.0;              // from the known error, else from the assumed one
  std::optional<double> position_error;  // from halving the elements; empty if not known   [mm]
  std::optional<double> tip_error;       // as that, of the tip alone                       [mm]
  /// Empty if not known; else why its end hangs on how it is solved, "" where it does not.
  std::optional<std::string> sensitive;
  bool tip_unsure = false;             // its tip may not be in the target: the error is as large as
                                       // tip_room(), or could not be told though it was refined
  std::optional<double> robust_score;  // mean over its repeats; empty without them
  double expected_safe = 1.0;          // part of its repeats in which it is safe, see rank()
  double expected_score = 0.0;         // mean over as many repeats as any plan has, see rank()
  std::vector<int> tied_with;          // trials that cannot be told from it, best first
  std::string sentence;                // why it stands here
};

struct ExcludedTrial {
  int trial = 0;
  std::string reason;
};

/// Of trials in full alone: a scout's wall is rigid. Forces are medians and maxima of
/// peak_contact_force over the trials that reached the target, also those that broke a limit; 0 if
/// none did.
struct WireSummary {
  int wire = 0, trials = 0, reached = 0, safe = 0;         // safe: ranked plans
  std::optional<int> best_trial;                           // of the ranked plans
  double median_peak_force = 0.0, worst_peak_force = 0.0;  //                               [N]
};

struct Ranking {
  std::vector<RankedPlan> plans;        // best first: safe ones, which reached and broke no limit
  std::vector<ExcludedTrial> excluded;  // the rest, each with its reason, in order of trial
  std::vector<WireSummary> wires;       // in order of the study's wires
  /// Ranked plans that no other beats in both peak contact force and, of a sphere, tip_to_target
  /// or, of a cross-section, expected_safe; by rising force.
  std::vector<int> pareto;
};

/// What was found out about single plans besides their trials.
struct Findings {
  std::vector<std::optional<NumericalError>> errors = {};  // per trial; empty: nothing was refined
  std::vector<bool> refined = {};  // per trial, with or without an error; empty: nothing was
  /// Per trial, as RankedPlan::sensitive; empty: nothing was refined.
  std::vector<std::optional<std::string>> sensitive = {};
  std::vector<RepeatedPlan> repeated = {};
  std::vector<bool> scouted = {};  // per trial: its numbers are a scout's (search.h); empty: none
};

/// Orders the plans, and says which of them are tied.
///
/// Order: plans whose end is known to be unsure come behind all others. Then by the part of its
/// repeats in which a plan is safe; then by the mean score over all
/// repeats, in which one that is not safe costs 1; equals by index of the candidate. A plan without
/// repeats stands as if it were safe as often as those with them, in the median. Fewer repeats than
/// others, or none, count in the score as it is expected to be: the mean over the repeats it has
/// (its own score without any) plus what the repeats that it lacks typically add, which is the
/// median over the plans that have them.
///
/// Ties: two plans, both or none of an unsure end, are tied
///   - if their scores differ by no more than the sum of their errors; or
///   - if both have repeats, and the central 90 % of their paired differences over the repeats that
///     both have, widened by both errors, holds 0: then the unknowns decide which is better; or
///   - if one has no repeats, and their scores differ by no more than both errors and what the
///     unknowns typically shift two repeated plans against each other (the median over pairs).
///
/// A trial that was only scouted is no plan. Expects one trial per candidate, and positive limits.
Ranking rank(const Study& study, const std::vector<Candidate>& candidates,
             const std::vector<Measured>& trials, const Limits& limits, const Weights& weights,
             const Findings& findings = {});

/// Whether it is known that the plan's end hangs on how it is solved.
bool is_sensitive(const RankedPlan& plan);

/// Whether it is known that the plan is sensitive or may not end in the target.
bool ends_unsure(const RankedPlan& plan);

/// How large the stated error of a tip may be that reached: half the radius of a cross-section's
/// lumen, chosen, and of a sphere what is left to its border [mm]. With a larger one it is open
/// whether the tip is in that vessel or before its mouth.
double tip_room(const simulate::Goal& goal, const Metrics& metrics);

/// Why a trial is no plan, in a sentence; empty if it is one.
std::string exclusion_reason(const Measured& trial, const Study& study, const Limits& limits);

}  // namespace wireplan::plan
