#pragma once
/// The numerical error of the best plans: each is run again with elements and contact spacing twice
/// and half as long, and with settings changed that should not matter. Of a script of catheter and
/// wire that does not reach with the longer elements, a run with elements of a quarter stands in
/// that one's place. This also gives the error against run time of the case at hand (design
/// section 8).
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "plan/ranking.h"
#include "plan/settings.h"

namespace wireplan::plan {

struct RefineOptions {
  int plans = 3;  // this many of the best are refined, ...
  int most = 8;   // ... and then plans that are tied with the first, up to this many in all
};

/// One run of a plan: one row of the report's error-against-time table.
struct NumericsRow {
  double element_length = 0.0;           //                                                 [mm]
  std::optional<double> position_error;  // estimate; empty if there is nothing to compare  [mm]
  double peak_force = 0.0;               // Metrics::peak_contact_force                     [N]
  long iterations = 0;
};

/// Where the tips of two runs end further apart, the plan is sensitive; chosen: what is read off a
/// picture [mm].
inline constexpr double kTipsApart = 1.0;

/// What came of a plan with a setting changed that should not matter, against the plan.
struct OtherEnd {
  Setting setting = Setting::kStep;
  NumericalError change;   // how far apart the two end
  std::string incomplete;  // why it did not come as far as the plan; else empty
};

struct Refinement {
  int trial = 0;                         // index of the candidate
  std::vector<NumericsRow> rows;         // longest elements first; only runs that came to the end
  std::optional<NumericalError> error;   // of the study's element length
  std::optional<double> observed_order;  // 2 where halving quarters the error
  std::string reason;                    // why something is missing above; else empty
  std::vector<double> cpu_seconds;       // per row; timing, so never twice the same        [s]
  std::vector<OtherEnd> others = {};     // per setting; empty where the plan itself has no end
  std::string left_out = {};             // why the run with longer elements does not count, if so
  std::string not_finer = {};  // of a script: how runs with shorter elements end that do not reach
};

/// Why the plan's end hangs on how it is solved, "with pushes half as long its tip ends 4.6 mm
/// away"; "" where it does not, empty where that is not known.
std::optional<std::string> find_sensitivity(const Refinement& refinement);

/// A plan run with one element length.
struct RefinedRun {
  double element_length = 0.0;  //                                                          [mm]
  Measured trial;
};

/// A plan run with a setting changed.
struct SettingRun {
  Setting setting = Setting::kStep;
  Measured trial;
};

/// Each plan is run with elements of these multiples of the study's length, ...
inline constexpr std::array kRefineFactors = {2.0, 1.0, 0.5};
/// ... and of this one where the first does not count.
inline constexpr double kFinestFactor = 0.25;

/// The study of one such run: elements and contact points `factor` times as far apart, and pushed
/// to the insertion that the plan ended at, past the goal if need be, so that shapes of equal
/// insertion are compared. Scripts of tools end where the tip is seen at the target instead, as
/// their steps end by what is seen: where more or less of the wire lies in bends, or a try more was
/// made, the hand goes on as far as it needs to.
Study refined_study(const Study& study, const Candidate& candidate, double factor,
                    double insertion);

/// A wire up to where it is at the goal, so that two that were stopped by sight can be compared: to
/// where it passes the cross-section, in a straight line on from its tip if that was drawn back, or
/// of a sphere to where it is nearest to the point. Nodes are (3, k), proximal to distal.
Eigen::Matrix3Xd cut_at_goal(const Eigen::Matrix3Xd& nodes, const simulate::Goal& goal);

/// Whether of a script's runs with three element lengths that with the longest alone does not
/// reach.
bool needs_finest(const std::vector<RefinedRun>& runs);

/// The plans to refine next, as trials, best first: those of the first `options.plans` that are not
/// in `known` yet, and those tied with the first plan, since their error may change which is first,
/// up to `options.most` in all. Once their errors are known the plans are ranked again and this is
/// asked again, until it is empty. Then, unless `options.most` was reached, no plan with an assumed
/// error is tied with the first.
std::vector<int> choose_plans_to_refine(const Ranking& ranking,
                                        const std::vector<Refinement>& known,
                                        const RefineOptions& options);

/// Richardson's estimate from three runs to the same `insertion`, without one to where the tip is
/// seen at the target (cut_at_goal), with elements of 2h, h and h/2.
/// With d the change from one run to the next finer one, the error of the longer elements is
/// d 2^p / (2^p - 1), which is 4/3 d for p = 2, and that of the shorter ones d / (2^p - 1). The
/// observed order is log2(d_coarse / d_fine) of the positions. p is the observed order kept within
/// [0.5, 2], since the rod is of second order at best (design section 7), and 2 where there is no
/// observed order. Positions are compared by shape_distance, forces by their size.
///
/// That is the table's. What is stated of the study's run is to hold the true value in 95 % of
/// cases. Forces are peaks and means over what a wire meets, a tip leans on a wall here or there,
/// and their changes follow no order: p is 0.5 for all of it (MEASUREMENTS.md). No error is less
/// than a third of the change from 2h to h, which it is where p is 2.
///
/// Neither is it less than what any of `others` ends apart from the run with elements of h, which
/// they follow but for a setting that should not matter.
///
/// With a fourth run, of h/4, that of 2h is left out, as it does not reach: it tells of another end
/// and not of an error of this one. A change from h to h/2 that is small by chance is seen by the
/// run of h/4 then: the error is no less than the change from h to h/4 and that run's own error, by
/// half an order of the last change, too. (Where changes do follow half an order, both are equal.)
/// A script that does not reach with h/2 or h/4 is a sensitive one.
Refinement estimate_error(int trial, std::optional<double> insertion, std::vector<RefinedRun> runs,
                          const std::vector<SettingRun>& others = {});

/// Largest distance between two wires at equal arc length from their tips, taken at the nodes of
/// `coarse` as far as `fine` reaches [mm]. Nodes are (3, k), proximal to distal. Elements of half
/// the length have a node at each of these places too, so the comparison adds no chord error.
double shape_distance(const Eigen::Matrix3Xd& coarse, const Eigen::Matrix3Xd& fine);

/// How far apart two runs end; shapes are compared at the nodes of `one`. Both have nodes.
NumericalError find_difference(const Measured& one, const Measured& other);

/// What rank() takes: the errors found, in the slots of their trials.
std::vector<std::optional<NumericalError>> errors_by_trial(
    const std::vector<Refinement>& refinements, int trial_count);
std::vector<std::optional<std::string>> sensitivity_by_trial(
    const std::vector<Refinement>& refinements, int trial_count);

}  // namespace wireplan::plan
