#pragma once
/// The artifact of the stage `plans`, and all that was simulated as the report reads it.
#include <filesystem>

#include "pipeline/stages/workspace.h"
#include "plan/make_plan.h"

namespace wireplan::pipeline {

inline constexpr const char* kTimingSchema = "wireplan.timing/1";

void write_plan(const plan::Plan& plan, const std::filesystem::path& folder);

/// The vessel and the options with which a case is planned up to there. Expects the stages up to
/// `wall` to be done; the vessel refers to the workspace.
plan::PlanVessel plan_vessel(Workspace& work);
plan::PlanOptions plan_options(Workspace& work, plan::PlanOptions::Until until);

/// Expects the stages up to `plans` to be done. Without shapes, and what was spent.
plan::Plan read_plan(Workspace& work);

/// The same before stage plans is made: without errors and repeats.
plan::Plan known_before_plans(Workspace& work);

/// Scripts, searches for those of wires alone, and pairs of catheter and wire, as the artifact
/// `manoeuvres` tells them; and back.
Json scripts_json(const plan::Scripts& scripts);
Json searches_json(const plan::Scripts& scripts);
Json pairs_json(const plan::Scripts& scripts);
plan::Scripts read_scripts(const Json& figures, const plan::Study& study);

}  // namespace wireplan::pipeline
