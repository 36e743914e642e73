#include "pipeline/report/report.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/files/trial_file.h"
#include "pipeline/report/anatomy_json.h"
#include "pipeline/report/fetch_json.h"
#include "pipeline/report/page.h"
#include "pipeline/report/tools_json.h"
#include "pipeline/report/verdict_json.h"
#include "pipeline/store/hash.h"
#include "plan/manoeuvre.h"
#include "plan/number_text.h"

namespace wireplan::pipeline {
namespace {

constexpr const char* kStatement =
    "Research use only. Not a medical device. Not for diagnosis or treatment decisions.";

constexpr const char* kRigidWall = "the wall is rigid";
constexpr const char* kRigidScout = "the wall of a scout or a probe is rigid";
constexpr const char* kNoDents = "the wall of a scout or a probe takes no dents";
constexpr const char* kNotRefined = "only the first plans and those tied with the best are refined";
std::string no_repeats(const ReportInput& input) {
  if (input.plan.robustness.repeats == 0) return "no plan is repeated";
  const std::string text = "only the best plans are repeated, and the best of each wire";
  return input.study.catheters.empty() ? text : text + " and of each catheter";
}

bool is_rigid(const ReportInput& input) {
  return input.parameters.at("wall").at("model") == "rigid";
}

bool moves(const ReportInput& input) {
  return input.parameters.at("wall").contains("support_kpa_per_mm");
}

Json limits_of_validity(const ReportInput& input) {
  const auto& wires = input.study.wires;
  const bool smooth = std::all_of(wires.begin(), wires.end(), [&](const simulate::Wire& wire) {
    return simulate::friction_of(wire, input.study.insertion) == 0.0;
  });
  const char* friction =
      smooth ? "Frictionless: push forces are lower bounds."
             : "One coefficient of friction stands for all of the wall; it is that of the wire's "
               "coating or of the case, not measured on either.";
  const char* wall =
      is_rigid(input) && moves(input)
          ? "The vessel's cross-sections move as wholes, and its wall takes no dents: contact "
            "forces are upper bounds."
      : is_rigid(input)
          ? "The wall is rigid: contact forces are those of a vessel that does not give way, upper "
            "bounds, and the wall's stiffness is reported but does not act."
      : moves(input)
          ? "The wall yields by linear theory on cross-sections that move as wholes, without any "
            "layers or prestress; dents beyond 0.2 of the radius are flagged beyond_linear_theory."
          : "The wall yields by linear theory, as a layer on a fixed outside; where it moves by "
            "more than 0.2 of the vessel's radius, the trial is flagged beyond_linear_theory.";
  return {
      friction,
      wall,
      "Quasi-static: every push ends in equilibrium; no inertia, no blood flow, no breathing or "
      "heart motion.",
      "Wire stiffness is that of the catalogue or the case, not measured on the wire at hand; "
      "wall parameters are not measured on the patient.",
      "The vessel is as the segmentation found it; plaque, thrombus and branches that it left "
      "out are not there.",
      "Score scales are proposals from the literature, not clinical limits."};
}

// Writes numbers under keys; what has none becomes null, with the reason under "null_reasons".
class Row {
 public:
  void put(const char* key, Json value) { row_[key] = std::move(value); }
  void put_number(const char* key, double value, const std::string& reason) {
    put_optional(key, std::isfinite(value) ? std::optional(value) : std::nullopt, reason);
  }
  void put_optional(const char* key, std::optional<double> value, const std::string& reason) {
    row_[key] = value ? Json(*value) : Json(nullptr);
    if (!value) reasons_[key] = reason;
  }
  Json finish() {
    if (!reasons_.empty()) row_["null_reasons"] = std::move(reasons_);
    return std::move(row_);
  }

 private:
  Json row_, reasons_;
};

void put_candidate(Row& row, const ReportInput& input, std::size_t trial) {
  const plan::Candidate& candidate = input.plan.candidates[trial];
  row.put("wire", input.study.wires[static_cast<std::size_t>(candidate.wire)].name);
  row.put("inclination_deg", clean(candidate.inclination / kRadPerDeg));
  row.put("azimuth_deg", clean(candidate.azimuth / kRadPerDeg));
  row.put("roll_deg", clean(candidate.roll / kRadPerDeg));
  row.put("moves", moves_json(candidate.moves));
  if (candidate.catheter < 0) {
    row.put("script",
            plan::describe_moves(candidate.moves, input.plan.trials[trial].metrics.insertion));
    return;
  }
  row.put("script", plan::describe_script(input.study, candidate,
                                          input.plan.trials[trial].metrics.insertion));
  row.put("catheter",
          input.study.catheters[static_cast<std::size_t>(candidate.catheter)].tool.wire.name);
  if (candidate.first_wire >= 0) {
    row.put("first_wire", input.study.wires[static_cast<std::size_t>(candidate.first_wire)].name);
  }
  row.put("exchanges", plan::count_exchanges(candidate));
  row.put("steps", told_steps_json(input.study, candidate, input.plan.trials[trial]));
}

const plan::Refinement* find_refinement(const ReportInput& input, int trial) {
  const auto found = std::find_if(input.plan.refinements.begin(), input.plan.refinements.end(),
                                  [&](const plan::Refinement& r) { return r.trial == trial; });
  return found == input.plan.refinements.end() ? nullptr : &*found;
}

Json provenance_json(const ReportInput& input) {
  Json warnings = Json::array();
  for (const Json& figures : input.figures) {
    for (const Json& warning : figures.at("warnings")) warnings.push_back(warning);
  }
  if (!page_missing().empty()) {
    warnings.push_back("report: the page report.html was left out: " + page_missing());
  }
  const auto flagged = std::count_if(
      input.plan.trials.begin(), input.plan.trials.end(),
      [](const auto& trial) { return trial.metrics.wall_motion.beyond_linear_theory(); });
  for (const std::string& warning : input.warnings) warnings.push_back(warning);
  if (flagged > 0) {
    warnings.push_back("trials: " + std::to_string(flagged) + " of " +
                       std::to_string(input.plan.trials.size()) +
                       " moved the wall beyond linear theory: see wall_motion of each");
  }
  std::vector<std::string> terms;
  for (const plan::Measured& trial : input.plan.trials) {
    for (const std::string& term : trial.terms) {
      if (std::find(terms.begin(), terms.end(), term) == terms.end()) terms.push_back(term);
    }
  }
  Row row;
  Json inputs = Json::array({{{"name", input.input_name}, {"sha256", input.input_sha256}}});
  if (!input.labels_name.empty()) {
    inputs.push_back({{"name", input.labels_name}, {"sha256", input.labels_sha256}});
  }
  row.put("inputs", std::move(inputs));
  row.put("parameters_sha256", hash_text(input.parameters.dump()));
  row.put("program", build_info());
  row.put("seed", input.robustness.at("seed"));
  row.put("stages", input.stages);
  row.put("terms", terms);
  row.put("parameters", input.parameters);
  row.put("warnings", std::move(warnings));
  return row.finish();
}

void put_figures(Row& row, const char* key, const Json& figures, const char* stage) {
  if (!figures.contains(stage)) {
    row.put_optional(key, {},
                     figures.contains("segment") ? "the case enters at labels without a volume"
                                                 : "the case enters at a surface");
    return;
  }
  Json values = figures.at(stage);
  values.erase("schema");
  values.erase("warnings");
  row.put(key, std::move(values));
}

Json branch_json(const std::string& name, const Json& line) {
  Row branch;
  branch.put("name", name);
  for (const char* key : {"length_mm", "mean_diameter_mm", "min_diameter_mm", "max_diameter_mm"}) {
    branch.put(key, line.at(key));
  }
  const Json& tortuosity = line.at("tortuosity");
  branch.put_optional("tortuosity",
                      tortuosity.is_null() ? std::nullopt : std::optional<double>(tortuosity),
                      "the line ends where it starts");
  return branch.finish();
}

Json vessel_json(const ReportInput& input) {
  const Json& surface = input.figures.at("surface");
  const Json& line = input.figures.at("centerline");
  const Json& wall = input.figures.at("wall");
  Json branches = Json::array({branch_json("access to target", line)});
  // Named after targets and accesses as everywhere else; a study without a way has the tree's own.
  const std::shared_ptr<const simulate::Way>& way = input.study.goal.way;
  for (std::size_t k = 0; k < line.at("branches").size(); ++k) {
    const Json& own = line.at("branches")[k];
    branches.push_back(branch_json(
        way ? branch_name(way->tree(), static_cast<int>(k)) : own.at("name").get<std::string>(),
        own));
  }

  Row row;
  for (const char* key : {"volume_mm3", "area_mm2", "triangles", "euler_number", "handles"}) {
    row.put(key, surface.at(key));
  }
  row.put("openings", surface.at("openings"));
  row.put("tetrahedra", wall.at("tetrahedra"));
  row.put("inverted_tetrahedra", wall.at("inverted_tetrahedra"));
  row.put("limited_tetrahedra", wall.at("limited_tetrahedra"));
  row.put("min_tetrahedron_height_mm", wall.at("min_height_mm"));
  row.put("wall_model", input.parameters.at("wall").at("model"));
  row.put("wall_thickness_mm", wall.at("thickness_mm"));
  row.put("wall_young_modulus_kpa", wall.at("young_modulus_kpa"));
  row.put("wall_stiffness_kpa_per_mm", wall.at("normal_stiffness_kpa_per_mm"));
  put_figures(row, "image", input.figures, "volume");
  put_figures(row, "segmentation", input.figures, "segment");
  row.put("target_lumen_radius_mm", line.at("target_lumen_radius_mm"));
  row.put("branches", std::move(branches));
  return row.finish();
}

void put_wall_motion(Row& row, const ReportInput& input, const plan::Metrics& m, bool scouted,
                     const std::string& ended) {
  if (is_rigid(input) || scouted) {
    for (const char* key : {"peak_wall_displacement_mm", "beyond_linear_theory", "wall_motion"}) {
      row.put_optional(key, {}, !scouted ? kRigidWall : moves(input) ? kNoDents : kRigidScout);
    }
    return;
  }
  row.put_number("peak_wall_displacement_mm", m.peak_wall_displacement, ended);
  row.put("beyond_linear_theory", m.wall_motion.beyond_linear_theory());
  if (m.wall_motion.displacement > 0.0) {
    row.put("wall_motion", {{"displacement_mm", m.wall_motion.displacement},
                            {"radius_mm", m.wall_motion.radius},
                            {"point_mm", to_json(m.wall_motion.point)}});
  } else {
    row.put_optional("wall_motion", {}, "the wire did not move the wall");
  }
}

/// Whether it reached and broke no limit; of scouts that reached it is not known.
void put_safe(Row& row, const ReportInput& input, std::size_t k) {
  const auto& plans = input.judgement.ranking.plans;
  const bool known =
      input.plan.levels[k] == plan::Level::kFull || !input.plan.trials[k].metrics.reached;
  const bool safe = std::any_of(plans.begin(), plans.end(), [&](const plan::RankedPlan& plan) {
    return plan.trial == static_cast<int>(k);
  });
  if (known) {
    row.put("safe", safe);
  } else {
    row.put_optional(
        "safe", {},
        std::string("reached against ") + plan::wall_of_scouts(moves(input)) + ", not run in full");
  }
}

Json trial_json(const ReportInput& input, std::size_t k) {
  const plan::Measured& trial = input.plan.trials[k];
  const plan::Metrics& m = trial.metrics;
  const std::string ended = "the trial ended " + std::string(outcome_name(trial.outcome)) +
                            (trial.reason.empty() ? "" : ": " + trial.reason);
  Row row;
  row.put("id", k);
  put_candidate(row, input, k);
  row.put("level", plan::level_name(input.plan.levels[k]));
  row.put("outcome", outcome_name(trial.outcome));
  row.put("reason", trial.reason);
  row.put("reached", m.reached);
  put_safe(row, input, k);
  for (const plan::MetricField& field : plan::kMetricFields) {
    if (field.value == &plan::Metrics::peak_wall_displacement) {
      put_wall_motion(row, input, m, input.plan.levels[k] != plan::Level::kFull, ended);
    } else if (field.reported) {
      row.put_number(field.name, m.*field.value, ended);
    }
  }
  const plan::Refinement* refined = find_refinement(input, static_cast<int>(k));
  if (refined == nullptr) {
    row.put_optional("position_error_mm", {}, kNotRefined);
  } else {
    row.put_optional("position_error_mm",
                     refined->error ? std::optional(refined->error->position) : std::nullopt,
                     refined->reason);
  }
  row.put("iterations", m.iterations);
  if (!trial.tools.empty()) row.put("tools", tools_json(trial));
  return row.finish();
}

void put_repeats(Row& row, const ReportInput& input, int trial) {
  const auto& plans = input.robustness.at("plans");
  const auto found = std::find_if(plans.begin(), plans.end(),
                                  [&](const Json& plan) { return plan.at("trial") == trial; });
  for (const char* key : {"mean_score", "success_rate", "success_rate_interval"}) {
    if (found == plans.end()) {
      row.put_optional(key, {}, no_repeats(input));
    } else {
      row.put(key, found->at(key));
    }
  }
}

/// The weakest of the values of the wire that has come in: friction of the case has no source.
Weakest weakest_behind(const ReportInput& input, int wire, double reach) {
  const DeviceWire& device = input.devices.at(static_cast<std::size_t>(wire));
  std::vector<NamedValue> values = device.values;
  if (!device.wire.friction)
    values.push_back({.key = "friction", .from = 0.0, .acts = true, .value = {}});
  return find_weakest(values, reach);
}

void put_weakest(Row& row, const ReportInput& input, int trial) {
  const auto k = static_cast<std::size_t>(trial);
  const Weakest weakest =
      weakest_behind(input, input.plan.candidates[k].wire, input.plan.trials[k].metrics.insertion);
  row.put("weakest_confidence", weakest_name(weakest));
  row.put("weakest_values", weakest.keys);
}

Json ranked_json(const ReportInput& input, std::size_t k) {
  const plan::RankedPlan& plan = input.judgement.ranking.plans[k];
  Row row;
  row.put("rank", k + 1);
  row.put("trial", plan.trial);
  put_candidate(row, input, static_cast<std::size_t>(plan.trial));
  row.put("score", plan.score.total);
  Json components;
  for (const plan::ScorePart& part : plan::kScoreParts) {
    if (plan::acts(part, plan.score.of_script)) components[part.name] = plan.score.*part.cost;
  }
  row.put("score_components", std::move(components));
  row.put("score_error", plan.score_error);
  put_repeats(row, input, plan.trial);
  row.put("expected_success_rate", plan.expected_safe);
  row.put("expected_score", plan.expected_score);
  row.put("tied_with", plan.tied_with);
  put_weakest(row, input, plan.trial);
  if (plan.sensitive) {
    row.put("sensitive", plan::is_sensitive(plan));
  } else {
    const plan::Refinement* refined = find_refinement(input, plan.trial);
    row.put_optional("sensitive", {}, refined == nullptr ? kNotRefined : refined->reason);
  }
  row.put("sensitive_reason", plan.sensitive.value_or(""));
  row.put("tip_unsure", plan.tip_unsure);
  row.put("sentence", plan.sentence);
  const auto id = static_cast<std::size_t>(plan.trial);
  const plan::Candidate& candidate = input.plan.candidates[id];
  if (input.figures.contains("anatomy") && !(candidate.moves.empty() && candidate.steps.empty())) {
    row.put("step_views", step_views_json(input.study, candidate, input.plan.trials[id],
                                          input.figures.at("anatomy")));
  }
  return row.finish();
}

Json wire_summary_json(const ReportInput& input, const plan::WireSummary& summary) {
  const bool reached = summary.reached > 0;
  const auto force = [&](double value) { return reached ? std::optional(value) : std::nullopt; };
  Row row;
  row.put("wire", input.study.wires[static_cast<std::size_t>(summary.wire)].name);
  row.put("trials", summary.trials);
  row.put("reached", summary.reached);
  row.put("safe", summary.safe);
  if (summary.best_trial) {
    row.put("best_trial", *summary.best_trial);
  } else {
    row.put_optional("best_trial", {}, "no trial of this wire is ranked");
  }
  const char* none = "no trial of this wire reached the target";
  row.put_optional("median_peak_contact_force_n", force(summary.median_peak_force), none);
  row.put_optional("worst_peak_contact_force_n", force(summary.worst_peak_force), none);
  Json values = Json::array();
  for (const NamedValue& each : input.devices.at(static_cast<std::size_t>(summary.wire)).values) {
    const std::optional<Confidence>& confidence = each.value.confidence;
    values.push_back({{"key", each.key},
                      {"confidence", confidence ? confidence_name(*confidence) : "not stated"},
                      {"source", each.value.source}});
  }
  row.put("values", std::move(values));
  return row.finish();
}

Json numerics_json(const ReportInput& input) {
  Json rows = Json::array(), plans = Json::array();
  for (const plan::Refinement& refinement : input.plan.refinements) {
    for (const plan::NumericsRow& run : refinement.rows) {
      Row row;
      row.put("trial", refinement.trial);
      row.put("element_length_mm", run.element_length);
      row.put_optional("position_error_mm", run.position_error, refinement.reason);
      row.put("peak_contact_force_n", run.peak_force);
      row.put("iterations", run.iterations);
      rows.push_back(row.finish());
    }
    const std::optional<plan::NumericalError>& error = refinement.error;
    const auto part = [&](double plan::NumericalError::*member) {
      return error ? std::optional((*error).*member) : std::nullopt;
    };
    Row row;
    row.put("trial", refinement.trial);
    row.put_optional("position_error_mm", part(&plan::NumericalError::position), refinement.reason);
    row.put_optional("tip_error_mm", part(&plan::NumericalError::tip), refinement.reason);
    row.put_optional("peak_contact_force_error_n", part(&plan::NumericalError::peak_force),
                     refinement.reason);
    row.put_optional("mean_contact_force_error_n", part(&plan::NumericalError::mean_force),
                     refinement.reason);
    row.put_optional("peak_tip_force_error_n", part(&plan::NumericalError::tip_force),
                     refinement.reason);
    row.put_optional("peak_push_force_error_n", part(&plan::NumericalError::push_force),
                     refinement.reason);
    if (input.plan.candidates[static_cast<std::size_t>(refinement.trial)].catheter >= 0) {
      row.put_optional("support_error_n", part(&plan::NumericalError::support), refinement.reason);
    }
    Json others = Json::array();
    for (const plan::OtherEnd& other : refinement.others) {
      others.push_back({{"setting", plan::setting_name(other.setting)},
                        {"tip_apart_mm", other.change.tip},
                        {"incomplete", other.incomplete}});
    }
    row.put("settings", std::move(others));
    row.put_optional("observed_order", refinement.observed_order,
                     refinement.reason.empty() ? "the runs do not differ" : refinement.reason);
    if (!refinement.left_out.empty()) row.put("left_out", refinement.left_out);
    plans.push_back(row.finish());
  }
  const Json& trials = input.figures.at("trials");
  Json numerics = {{"lumen_grid_mm", trials.at("lumen_grid_mm")},
                   {"lumen_max_deviation_mm", trials.at("lumen_max_deviation_mm")},
                   {"lumen_mean_deviation_mm", trials.at("lumen_mean_deviation_mm")},
                   {"scout", trials.at("scout")},
                   {"plans", std::move(plans)},
                   {"rows", std::move(rows)},
                   {"rows_time", "cpu_s of each row stands in timing.numerics"}};
  const Json& searches = input.figures.at("manoeuvres").at("searches");
  if (!searches.empty()) numerics["script_searches"] = searches;
  return numerics;
}

// The files beside report.json that people look at.
Json artifacts_json(const ReportInput& input) {
  Json files = Json::array();
  const auto add = [&](const std::string& file, const char* content) {
    files.push_back({{"file", file}, {"content", content}});
  };
  if (input.figures.contains("segment")) add("mask.nrrd", "segmented lumen");
  if (input.parameters.contains("labels")) {
    add("classes.nrrd", "which of the labels each voxel of the lumen has, by their order");
  }
  add("surface.vtp", "inner surface of the vessel");
  add("centerline.vtp", "path from access to target, with its radius");
  add("wall.vtu", "tetrahedra of the wall");
  add("forces.vtu",
      "the wall with the largest normal force that each triangle took in any trial (peak_force_n) "
      "and in the best plan (peak_force_best_plan_n)");
  add("plans.png", "best plan of each wire, or its closest attempt");
  if (page_missing().empty()) add("report.html", "this report as a page for any browser");
  add("sheet.csv", "the figures of the page's first sheet as a table");
  add("trials.csv", "every trial as a row of a table");
  for (std::size_t k = 1; k <= std::min(kPlansShown, input.judgement.ranking.plans.size()); ++k) {
    add("trials/plan-" + std::to_string(k) + ".pvd",
        "insertion of a plan, by rank, as a time series");
    if (!input.motion.is_null()) {
      add("trials/plan-" + std::to_string(k) + "-vessel.pvd",
          "the vessel as that plan moves it, as a time series");
    }
    const auto id = static_cast<std::size_t>(input.judgement.ranking.plans[k - 1].trial);
    if (input.plan.candidates[id].catheter < 0) continue;
    add("trials/plan-" + std::to_string(k) + "-catheter.pvd", "its catheter, as a time series");
    add("trials/plan-" + std::to_string(k) + "-catheter-steps.mrk.json",
        "its catheter at the end of each step, for 3D Slicer");
    add("trials/plan-" + std::to_string(k) + "-wire-steps.mrk.json",
        "its wire at the end of each step, for 3D Slicer");
  }
  for (std::size_t k = 1; k <= input.judgement.ranking.plans.size(); ++k) {
    add("trials/plan-" + std::to_string(k) + ".mrk.json",
        "wire, entry and target of a plan, by rank, for 3D Slicer");
  }
  return files;
}

}  // namespace

Json openings_json(const std::vector<preprocess::Opening>& openings) {
  Json list = Json::array();
  for (const preprocess::Opening& opening : openings) {
    list.push_back({{"center_mm", to_json(opening.center)},
                    {"radius_mm", opening.radius},
                    {"normal", to_json(opening.normal)}});
  }
  return list;
}

Json build_report(const ReportInput& input) {
  expects(input.plan.trials.size() == input.plan.candidates.size());
  Json trials = Json::array(), ranking = Json::array(), excluded = Json::array();
  for (std::size_t k = 0; k < input.plan.trials.size(); ++k) trials.push_back(trial_json(input, k));
  for (std::size_t k = 0; k < input.judgement.ranking.plans.size(); ++k) {
    ranking.push_back(ranked_json(input, k));
  }
  for (const plan::ExcludedTrial& trial : input.judgement.ranking.excluded) {
    excluded.push_back({{"trial", trial.trial}, {"reason", trial.reason}});
  }
  Json wires = Json::array();
  for (const plan::WireSummary& summary : input.judgement.ranking.wires) {
    wires.push_back(wire_summary_json(input, summary));
  }

  Json report;
  report["schema"] = kReportSchema;
  report["name"] = input.name;
  report["statement"] = kStatement;
  report["limits"] = limits_of_validity(input);
  report["outcome"] = ranking.empty() ? "no plan reaches the target" : "ranked";
  report["verdict"] = verdict_json(input.verdict);
  report["provenance"] = provenance_json(input);
  report["artifacts"] = artifacts_json(input);
  report["vessel"] = vessel_json(input);
  if (input.figures.contains("anatomy")) {
    report["anatomy"] = anatomy_json(input);
    report["fetch"] = fetch_json(input, report["anatomy"]);
  }
  if (!input.motion.is_null()) report["vessel_motion"] = input.motion;
  report["ranking"] = std::move(ranking);
  report["excluded"] = std::move(excluded);
  report["wires"] = std::move(wires);
  if (!input.study.catheters.empty())
    report["catheters"] = catheters_json(input.study, input.plan,
                                         input.parameters.value("axes", "patient") == "patient",
                                         input.parameters.at("manoeuvres") != "never");
  report["pareto"] = input.judgement.ranking.pareto;
  report["robustness"] = input.robustness;
  report["numerics"] = numerics_json(input);
  report["trials"] = std::move(trials);
  report["timing"] = input.timing;
  return report;
}

Json build_info() {
  const std::string eigen = std::to_string(EIGEN_WORLD_VERSION) + "." +
                            std::to_string(EIGEN_MAJOR_VERSION) + "." +
                            std::to_string(EIGEN_MINOR_VERSION);
  const std::string json = std::to_string(NLOHMANN_JSON_VERSION_MAJOR) + "." +
                           std::to_string(NLOHMANN_JSON_VERSION_MINOR) + "." +
                           std::to_string(NLOHMANN_JSON_VERSION_PATCH);
  return {{"name", "wireplan"},
          {"version", WIREPLAN_VERSION},
          {"revision", WIREPLAN_REVISION},
          {"compiler", WIREPLAN_COMPILER},
          {"build_type", WIREPLAN_BUILD_TYPE},
          {"page_template_sha256", page_template_sha256()},
          {"libraries",
           {{"Eigen", eigen},
            {"TBB", WIREPLAN_TBB_VERSION},
            {"VTK", WIREPLAN_VTK_VERSION},
            {"CGAL", WIREPLAN_CGAL_VERSION},
            {"ITK", WIREPLAN_ITK_VERSION},
            {"nlohmann_json", json}}}};
}

Json read_report(const std::filesystem::path& path) {
  Json report = read_json(path, kReportSchema, kOlderReportSchema);
  try {
    describe_best(report);
  } catch (const Json::exception&) {
    throw Error(path.string() +
                ": is no whole report, expected trials and ranking as `wireplan run` writes them; "
                "run the case again");
  }
  return report;
}

}  // namespace wireplan::pipeline
