#pragma once
/// The disturbances of a case: what its repeats vary, and how many there are.
#include "pipeline/files/case_file.h"
#include "pipeline/files/json_reader.h"

namespace wireplan::pipeline {

/// Reads "robustness". Expects the case's wall, whose support is disturbed too where it has one.
void read_robustness(JsonReader& root, Case& input);

/// The same with every value, as it may be read again.
Json robustness_json(const Case& input);

}  // namespace wireplan::pipeline
