#include "pipeline/report/tools_json.h"

#include <algorithm>

#include "pipeline/files/case_wires.h"
#include "pipeline/files/trial_file.h"
#include "plan/anatomy/passage.h"
#include "plan/anatomy/projection.h"

namespace wireplan::pipeline {

Json told_steps_json(const plan::Study& study, const plan::Candidate& candidate,
                     const plan::Measured& trial) {
  Json steps = steps_json(candidate.steps);
  const std::vector<plan::ToldStep> told =
      plan::describe_steps(study, candidate, trial.metrics.insertion);
  for (std::size_t k = 0; k < told.size(); ++k) {
    steps[k]["text"] = told[k].text;
    if (!told[k].otherwise.empty()) steps[k]["otherwise"] = told[k].otherwise;
  }
  return steps;
}

Json tools_json(const plan::Measured& trial) {
  Json list = Json::array();
  for (const plan::ToolMetrics& tool : trial.tools) {
    Json own = {{"name", tool.name}};
    for (const plan::ToolMetricField& field : plan::kToolMetricFields) {
      own[field.name] = tool.*field.value;
    }
    list.push_back(std::move(own));
  }
  Json json = {{"each", std::move(list)}};
  const plan::ScriptMetrics& script = *trial.metrics.script;
  for (const plan::ScriptMetricField& field : plan::kScriptMetricFields) {
    json[field.name] = clean(script.*field.value);
  }
  json["support_is_least"] = script.bears_more;
  json["moves"] = script.moves;
  return json;
}

Json exchange_json(const plan::Study& study, const plan::ExchangeFindings& exchange) {
  if (!exchange.tried() && exchange.stopped.empty()) return nullptr;
  Json json = {
      {"tried", exchange.tried()}, {"reason", exchange.stopped}, {"scripts_found", exchange.found}};
  if (!exchange.tried()) return json;
  json["first_wire"] = study.wires[static_cast<std::size_t>(exchange.first_wire)].name;
  if (exchange.found > 0) json["neighbours_reach"] = exchange.held;
  return json;
}

Json catheters_json(const plan::Study& study, const plan::Plan& plan, bool axes_known,
                    bool scripts_wanted) {
  Json json = {{"rules", tool_rules_json(study.tool_rules)}};
  for (const plan::Junction& junction : plan::find_junctions(*study.goal.way)) {
    const std::optional<plan::Ostium> ostium = plan::find_ostium(study.goal);
    if (!ostium || !junction.taken || junction.arc != ostium->arc) continue;
    const plan::View view =
        plan::find_projections(junction.trunk_direction, junction.branch_direction).best.view;
    json["ostium"] = {{"at_mm", clean(ostium->arc)},
                      {"point_mm", to_json(ostium->point)},
                      {"trunk_diameter_mm", clean(ostium->trunk_diameter)}};
    if (axes_known) {
      json["ostium"]["view"] = {{"lao_deg", clean(view.rotation / kRadPerDeg)},
                                {"cranial_deg", clean(view.tilt / kRadPerDeg)}};
    }
  }
  for (std::size_t k = 0; k < study.suggested.size(); ++k) {
    json["suggested"].push_back(
        {{"catheter", study.catheters[k].tool.wire.name}, {"reason", study.suggested[k]}});
  }
  json["pairs"] = Json::array();
  const auto& pairs = plan.scripts.pairs;
  const bool searched = std::any_of(pairs.begin(), pairs.end(),
                                    [](const plan::PairFindings& pair) { return pair.tried(); });
  for (const plan::PairFindings& pair : plan.scripts.pairs) {
    const auto& [catheter, wire, unfit] = pair.pair;
    const bool tried = pair.tried();
    Json row = {
        {"catheter", study.catheters[static_cast<std::size_t>(catheter)].tool.wire.name},
        {"wire", study.wires[static_cast<std::size_t>(wire)].name},
        {"tried", tried},
        {"reason", !unfit.empty() ? unfit
                   : tried        ? pair.stopped
                   : searched ? "a catheter that was suggested before it has a script that holds"
                   : scripts_wanted ? "a wire alone works"
                                    : "the case asks for no scripts (manoeuvres: never)"},
        {"scripts_found", pair.found}};
    if (pair.found > 0) row["neighbours_reach"] = pair.held;
    if (tried) {
      if (pair.nearest_hook >= 0.0) row["nearest_hook_mm"] = clean(pair.nearest_hook);
      row["furthest_mm"] = clean(pair.furthest);
    }
    if (const Json exchange = exchange_json(study, pair.exchange); !exchange.is_null()) {
      row["exchange"] = exchange;
    }
    json["pairs"].push_back(std::move(row));
  }
  return json;
}

}  // namespace wireplan::pipeline
