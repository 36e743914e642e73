#pragma once
/// What the rows of `bench stability` come to. For use in this folder.
#include <string>
#include <vector>

#include "pipeline/bench/bench_report.h"

namespace wireplan::pipeline {

/// For each method, how many rows had which verdict and outcome.
std::vector<Json> summarize_stability(const std::vector<Json>& rows);

std::size_t count_scenes(const std::vector<Json>& rows);

/// Scenes where another method, on its way or at its end, has less energy than Newton's
/// equilibrium: there it found a higher minimum, or none.
std::vector<std::string> find_lower_energies(const std::vector<Json>& rows);

/// Verdicts over the grid of coefficients, for every method.
Picture plot_stability(const std::vector<Json>& rows);

/// Scenes, verdicts and columns.
Json describe_stability();

}  // namespace wireplan::pipeline
