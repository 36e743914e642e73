#pragma once
/// What to fetch for the plans of a report, and the C-arm's views for their steps.
#include "pipeline/report/report.h"

namespace wireplan::pipeline {

/// The list of what to fetch: the wires of the first three plans, sheath and catheter by what the
/// lumen lets pass with those of the catalogue that do, and how much wire that asks for. Rows with
/// "what", "items" (names of the case or the catalogue), "text", and whether a size in it is
/// "assumed". Empty without a plan. `anatomy` is the report's.
Json fetch_json(const ReportInput& input, const Json& anatomy);

/// Each step of a plan's script with the view of the ostium or bend that the tip is next to at its
/// end: "text", "at" and "view", which are null without known axes or places to look at. A wire's
/// tip is taken to be as far along the way as wire is in; steps of a catheter are all made for the
/// ostium of the target's branch.
Json step_views_json(const plan::Study& study, const plan::Candidate& candidate,
                     const plan::Measured& trial, const Json& anatomy);

}  // namespace wireplan::pipeline
