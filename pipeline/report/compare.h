#pragma once
/// Reports side by side: other wires for the same patient, or the same wires for many.
#include <filesystem>
#include <string>
#include <vector>

namespace wireplan::pipeline {

/// The text that `wireplan compare` prints: a line per report; reach, score and force of every wire
/// in every report; and, where all are of one patient (the same input, access and target), the best
/// plans of all reports in one order. Says where scores are not comparable, since limits, weights
/// or target radius differ, and where success rates are of other disturbances. Of an overview its
/// sections' reports are taken. Throws Error for a file that is no report, and for a single one.
std::string compare_reports(const std::vector<std::filesystem::path>& files);

}  // namespace wireplan::pipeline
