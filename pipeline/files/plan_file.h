#pragma once
/// What planning kept of its runs <-> JSON, bit for bit but for times.
#include <optional>
#include <string>

#include "pipeline/files/json_reader.h"
#include "plan/make_plan.h"

namespace wireplan::pipeline {

/// A run that is no trial of a candidate by itself, as a piece in the store: a repeat, or one with
/// other elements, whose shape is kept too.
std::string measured_text(const plan::Measured& measured, bool with_shape);
/// Nothing where the text is cut or of another kind.
std::optional<plan::Measured> measured_from_text(const std::string& text);

/// What the artifact `plans` holds: the trials' levels and numbers, errors, repeats, attempts. The
/// candidates, and what scouting and the search for scripts came to, stand in the artifacts before.
Json plan_to_json(const plan::Plan& plan);
void plan_from_json(const Json& json, const plan::Study& study, plan::Plan& plan);

}  // namespace wireplan::pipeline
