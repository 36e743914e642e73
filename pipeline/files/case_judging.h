#pragma once
/// "limits" and "ranking" of a case: what a trial must keep, and what costs how much.
#include "pipeline/files/json_reader.h"
#include "plan/score.h"

namespace wireplan::pipeline {

void read_limits(JsonReader& root, plan::Limits& limits);
/// Weights of scripts act, and may be given, in cases with catheters alone.
void read_weights(JsonReader& root, bool with_catheters, plan::Weights& weights);

Json limits_json(const plan::Limits& limits);
Json ranking_json(const plan::Weights& weights, bool with_catheters);

}  // namespace wireplan::pipeline
