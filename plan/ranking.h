#pragma once
/// Metrics -> ordered plans, with the reasons.
#include <optional>
#include <string>
#include <vector>

#include "plan/metrics.h"

namespace wireplan::plan {

/// A trial beyond one of the `_fail` limits is excluded. A plan's sentence warns where its tip
/// force is beyond `tip_force_warn`, where the wall moved beyond linear theory (metrics.h), and
/// where the tip is so close to the target's border that its numerical error may put it outside.
struct Limits {
  double tip_force_warn = 0.3;    // references B3                                          [N]
  double tip_force_fail = 1.5;    // references B3                                          [N]
  double off_path_fail = 10.0;    // a wire further from the path's lumen came another way   [mm]
  double penetration_fail = 0.3;  // a wire further past the wall has left the lumen        [mm]
};

/// Weights of the score's components; none negative, not all 0.
struct Weights {
  double reach = 1.0, peak_force = 1.0, mean_force = 0.5, margin = 0.5;
};

/// What a plan costs: each component in [0, 1], 0 the best, and their weighted mean. The scales are
/// absolute, so that a score does not depend on which other plans were tried. With the scale of
/// force s = Limits::tip_force_warn (references B3), so that forces on the wall weigh as soon as
/// they are felt:
///   reach       tip_to_target / goal radius; of a cross-section 0    metric: references C1,
///   success peak_force  f / (f + s), f = peak_contact_force                 C1, contact force, max
///   mean_force  f / (f + s), f = mean_contact_force                 C1, contact force, mean
///   margin      peak_tip_force / Limits::tip_force_fail: what is used up of it   C1, tip force
/// f / (f + s) is 1/2 at f = s and never reaches 1, since no limit of side-wall forces is agreed
/// on.
struct Score {
  double total = 0.0;  // smaller is better
  double reach = 0.0, peak_force = 0.0, mean_force = 0.0, margin = 0.0;
};

/// How far a trial's numbers may be from those of infinitely short elements, on whichever path the
/// solver takes (refine.h): the true value lies within this of the trial's in 95 % of cases.
struct NumericalError {
  double position = 0.0;    // of the final shape, where it is largest                      [mm]
  double tip = 0.0;         // of the final tip                                             [mm]
  double peak_force = 0.0;  // of Metrics::peak_contact_force                               [N]
  double mean_force = 0.0;  // of Metrics::mean_contact_force                               [N]
  double tip_force = 0.0;   // of Metrics::peak_tip_force                                   [N]
  double push_force = 0.0;  // of Metrics::peak_push_force                                  [N]
};

/// What is assumed of a trial that was not refined. Refining 15 plans in a bent tube at elements of
/// 1 mm found 0.02 to 0.62 mm, median 0.09, and forces within 4 %. It only decides ties, and is
/// never reported as an error.
inline constexpr double kAssumedPositionError = 0.2;        //                              [mm]
inline constexpr double kAssumedRelativeForceError = 0.05;  // of each force                [-]
NumericalError assumed_error(const Metrics& metrics);

Score compute_score(const Metrics& metrics, const simulate::Goal& goal, const Limits& limits,
                    const Weights& weights);

/// Largest change of the total score that the error allows, to first order. The components' changes
/// are added without regard to sign, since one cause may move all forces alike.
double compute_score_error(const Metrics& metrics, const NumericalError& error,
                           const simulate::Goal& goal, const Limits& limits,
                           const Weights& weights);

/// A trial of a plan under a disturbance (robustness.h).
struct Repeat {
  bool reached = false;
  bool safe = false;   // it reached and broke no limit: it is a plan under the disturbance too
  double score = 1.0;  // its total; 1, the worst there is, where it is no plan
  double peak_contact_force = 0.0, mean_contact_force = 0.0, peak_tip_force = 0.0;  //       [N]
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
