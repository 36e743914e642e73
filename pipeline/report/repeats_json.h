#pragma once
/// What the report says of the best plans under disturbances.
#include <vector>

#include "pipeline/files/json_reader.h"
#include "plan/judge.h"

namespace wireplan::pipeline {

/// The report's "robustness": the plan's repeats as they were judged.
Json repeats_json(const plan::Study& study, const plan::Plan& plan,
                  const std::vector<plan::RepeatedPlan>& judged);

}  // namespace wireplan::pipeline
