#pragma once
/// The verdict (plan/verdict.h) between the stages' figures, the report and the console.
#include <string>

#include "pipeline/files/json_reader.h"
#include "plan/verdict.h"

namespace wireplan::pipeline {

/// What the figures of stage anatomy say of the way.
plan::WayFindings way_findings(const Json& anatomy);

/// "verdict" of a report.
Json verdict_json(const plan::Verdict& verdict);

/// A report's answer and headline in a line, and the reason that decides in a second one where it
/// is not plainly feasible; empty for a report that has no verdict.
std::string describe_verdict(const Json& report);

/// "feasible with risk", of a report; "-" where it has no verdict.
std::string answer_of(const Json& report);

/// "bentson", or "bentson in cobra-c2": of a plan of a report.
std::string describe_tools(const Json& plan);

/// The best plan of a report in one line, or why there is none.
std::string describe_best(const Json& report);

}  // namespace wireplan::pipeline
