#pragma once
/// How far the best plans may be from the truth: each is run again with elements twice and half as
/// long, and contact points as far apart, which also gives the error against run time of the case
/// at hand (design section 8).
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "plan/ranking.h"

namespace wireplan::plan {

struct RefineOptions {
  int plans = 3;  // the best so many are refined, ...
  int most = 8;   // ... and then what cannot be told from the first, up to so many in all
};

/// One run of a plan: one row of the report's error-against-time table.
struct NumericsRow {
  double element_length = 0.0;           //                                                 [mm]
  std::optional<double> position_error;  // estimate; empty if there is nothing to compare  [mm]
  double peak_force = 0.0;               // Metrics::peak_contact_force                     [N]
  long iterations = 0;
};

struct Refinement {
  int trial = 0;                         // index of the candidate
  std::vector<NumericsRow> rows;         // longest elements first; only runs that came to the end
  std::optional<NumericalError> error;   // of the study's element length
  std::optional<double> observed_order;  // 2 where halving quarters the error
  std::string reason;                    // why something is missing above; else empty
  std::vector<double> cpu_seconds;       // per row; timing, so never twice the same        [s]
};

/// A plan run with one element length.
struct RefinedRun {
  double element_length = 0.0;  //                                                          [mm]
  Measured trial;
};

/// Each plan is run with elements of so many times the study's.
inline constexpr std::array kRefineFactors = {2.0, 1.0, 0.5};

/// The study of one such run: elements and contact points `factor` times as far apart, and pushed
/// to the insertion that the plan ended at, past the goal if need be, so that shapes of equal
/// insertion are compared.
Study refined_study(const Study& study, double factor, double insertion);

/// The plans to refine next: of the first `options.plans` those that are not in `known` yet, and,
/// where `options.most` allows, those tied with the first plan, whose error may change which is
/// first. Trials, best first. With their errors known the plans are ranked and this is asked again,
/// until it is empty: then no error that is still assumed touches the first plan.
std::vector<int> choose_plans_to_refine(const Ranking& ranking,
                                        const std::vector<Refinement>& known,
                                        const RefineOptions& options);

/// Richardson's estimate from three runs to the same `insertion`, with elements of 2h, h and h/2.
/// With d the change from one run to the next finer one, the longer elements' error is
/// d 2^p / (2^p - 1), for p = 2: 4/3 d, and the shorter elements' is 1 / (2^p - 1). The observed
/// order log2(d_coarse / d_fine) is that of the positions; p is the observed order kept within
/// [0.5, 2], since the rod is of second order at best (design section 7), and 2 where there is
/// none. Positions are compared by shape_distance, forces by their size.
Refinement estimate_error(int trial, double insertion, const std::vector<RefinedRun>& runs);

/// Largest distance between two wires at equal arc length from their tips, taken at the nodes of
/// the first as far as the second reaches [mm]. Nodes are (3, k), proximal to distal. At the nodes
/// of the longer elements, those of half the length have a node too, so that the comparison adds no
/// chord error.
double shape_distance(const Eigen::Matrix3Xd& coarse, const Eigen::Matrix3Xd& fine);

/// What rank() takes: the errors found, in the slots of their trials.
std::vector<std::optional<NumericalError>> errors_by_trial(
    const std::vector<Refinement>& refinements, int trial_count);

}  // namespace wireplan::plan
