#pragma once
/// What `bench truth` comes to: stated errors against true ones. For use in this folder.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/bench/bench_report.h"
#include "plan/make_plan.h"

namespace wireplan::pipeline {

/// A trial's error as it is stated, and what is true of it.
struct TruthTrial {
  std::string case_name = {};
  int id = 0;  // of the candidate
  std::string wire = {};
  plan::Candidate candidate = {};
  std::optional<int> rank = {};  // empty: not ranked
  plan::Measured trial = {};     // with the study's elements of length h
  plan::Refinement stated = {};  // from elements of 2h, h, h/2 and settings changed
  /// How far the run with elements of h/4 ends apart; empty where it did not come as far.
  std::optional<plan::NumericalError> truth = {};
  /// Of the tips, as each setting that acts is changed                                   [mm]
  std::vector<std::pair<plan::Setting, double>> apart = {};
  std::optional<double> fine_push_force = {};  // peak with elements of h/8               [N]
  std::string note = {};                       // why something is missing; else empty
};

/// A case that is not there.
struct SkippedCase {
  std::string name, reason;
};

std::vector<Json> truth_rows(const std::vector<TruthTrial>& trials);
Json truth_results(const std::vector<TruthTrial>& trials, const std::vector<SkippedCase>& skipped);
std::string truth_text(const std::vector<Json>& rows, const Json& results);
Picture plot_truth(const std::vector<TruthTrial>& trials);
Json describe_truth();

}  // namespace wireplan::pipeline
