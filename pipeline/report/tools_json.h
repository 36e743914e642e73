#pragma once
/// What a report tells of catheters: which were tried with which wires, and of a script its steps
/// and what each tool felt.
#include "pipeline/files/json_reader.h"
#include "plan/make_plan.h"

namespace wireplan::pipeline {

/// The steps as a case's files hold them, each with its "text" for the hand, and where the wire may
/// go elsewhere with "otherwise".
Json told_steps_json(const plan::Study& study, const plan::Candidate& candidate,
                     const plan::Measured& trial);

/// Per tool its metrics; beside them what the script comes to (plan::ScriptMetrics). Expects a
/// trial of a study with catheters.
Json tools_json(const plan::Measured& trial);

/// How bringing a pair's wire in by exchange ended; null where its own scripts hold.
Json exchange_json(const plan::Study& study, const plan::ExchangeFindings& exchange);

/// Rules, ostium with the C-arm's view of it where axes are known, and all pairs: what came of
/// them, or why they were not tried.
Json catheters_json(const plan::Study& study, const plan::Plan& plan, bool axes_known,
                    bool scripts_wanted);

}  // namespace wireplan::pipeline
