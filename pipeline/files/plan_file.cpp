#include "pipeline/files/plan_file.h"

#include <algorithm>
#include <utility>

#include "pipeline/files/trial_file.h"

namespace wireplan::pipeline {
namespace {

constexpr const char* kMeasuredSchema = "wireplan.measured/2";

Json point(const Vec3& p) {
  return Json::array({number_or_null(p.x()), number_or_null(p.y()), number_or_null(p.z())});
}
std::optional<double> optional_of(const Json& value) {
  return value.is_null() ? std::nullopt : std::optional<double>(value);
}

plan::Level level_of(const std::string& name) {
  for (const plan::Level level : {plan::Level::kScout, plan::Level::kProbe, plan::Level::kFull}) {
    if (name == plan::level_name(level)) return level;
  }
  throw Error("level is " + name + ", expected scout, probe or full");
}

Json metrics_to_json(const plan::Metrics& metrics) {
  Json json;
  for (const plan::MetricField& field : plan::kMetricFields) {
    json[field.name] = number_or_null(metrics.*field.value);
  }
  json["reached"] = metrics.reached;
  json["iterations"] = metrics.iterations;
  const plan::WallMotion& motion = metrics.wall_motion;
  json["wall_motion"] = {{"displacement_mm", number_or_null(motion.displacement)},
                         {"radius_mm", number_or_null(motion.radius)},
                         {"point_mm", point(motion.point)}};
  if (metrics.script) {
    Json& script = json["script"];
    for (const plan::ScriptMetricField& field : plan::kScriptMetricFields) {
      script[field.name] = number_or_null((*metrics.script).*field.value);
    }
    script["moves"] = metrics.script->moves;
    script["exchanges"] = metrics.script->exchanges;
    script["bears_more"] = metrics.script->bears_more;
  }
  return json;
}

// Another program may have kept it, to which a metric was added since.
bool has_all_metrics(const Json& json) {
  return std::all_of(plan::kMetricFields.begin(), plan::kMetricFields.end(),
                     [&](const plan::MetricField& field) { return json.contains(field.name); });
}

plan::Metrics metrics_of(const Json& json) {
  plan::Metrics metrics;
  for (const plan::MetricField& field : plan::kMetricFields) {
    metrics.*field.value = number_of(json.at(field.name));
  }
  metrics.reached = json.at("reached");
  metrics.iterations = json.at("iterations");
  const Json& motion = json.at("wall_motion");
  metrics.wall_motion = {.displacement = number_of(motion.at("displacement_mm")),
                         .radius = number_of(motion.at("radius_mm")),
                         .point = point_of(motion.at("point_mm"))};
  if (json.contains("script")) {
    const Json& script = json.at("script");
    metrics.script = plan::ScriptMetrics{};
    for (const plan::ScriptMetricField& field : plan::kScriptMetricFields) {
      (*metrics.script).*field.value = number_of(script.at(field.name));
    }
    metrics.script->moves = script.at("moves");
    metrics.script->exchanges = script.at("exchanges");
    metrics.script->bears_more = script.at("bears_more");
  }
  return metrics;
}

Json tools_to_json(const std::vector<plan::ToolMetrics>& tools) {
  Json list = Json::array();
  for (const plan::ToolMetrics& tool : tools) {
    Json own = {{"name", tool.name}};
    for (const plan::ToolMetricField& field : plan::kToolMetricFields) {
      own[field.name] = number_or_null(tool.*field.value);
    }
    list.push_back(std::move(own));
  }
  return list;
}

std::vector<plan::ToolMetrics> tools_of_json(const Json& list) {
  std::vector<plan::ToolMetrics> tools;
  for (const Json& own : list) {
    plan::ToolMetrics& tool = tools.emplace_back();
    tool.name = own.at("name");
    for (const plan::ToolMetricField& field : plan::kToolMetricFields) {
      tool.*field.value = number_of(own.at(field.name));
    }
  }
  return tools;
}

Json measured_to_json(const plan::Measured& measured) {
  Json json = {{"outcome", simulate::outcome_name(measured.outcome)},
               {"reason", measured.reason},
               {"terms", measured.terms},
               {"metrics", metrics_to_json(measured.metrics)},
               {"progress_mm", number_or_null(measured.progress)},
               {"last_tip_mm", point(measured.last_tip)}};
  if (!measured.tools.empty()) json["tools"] = tools_to_json(measured.tools);
  return json;
}

/// Of a repeat: with how it moved the vessel.
Json repeat_to_json(const plan::Measured& measured) {
  Json json = measured_to_json(measured);
  if (measured.sections.size() > 0) json["sections_mm"] = to_json(measured.sections);
  return json;
}

plan::Measured measured_of(const Json& json) {
  plan::Measured measured = {.outcome = outcome_of(json.at("outcome")),
                             .reason = json.at("reason"),
                             .terms = json.at("terms").get<std::vector<std::string>>(),
                             .metrics = metrics_of(json.at("metrics")),
                             .progress = number_of(json.at("progress_mm")),
                             .last_tip = point_of(json.at("last_tip_mm"))};
  if (json.contains("tools")) measured.tools = tools_of_json(json.at("tools"));
  if (json.contains("sections_mm")) measured.sections = points_of(json.at("sections_mm"));
  return measured;
}

plan::Setting setting_of(const std::string& name) {
  using plan::Setting;
  for (const Setting setting :
       {Setting::kStep, Setting::kRoll, Setting::kFriction, Setting::kTolerance}) {
    if (name == plan::setting_name(setting)) return setting;
  }
  throw Error("setting is " + name + ", expected step, roll, friction or tolerance");
}

Json error_to_json(const plan::NumericalError& error) {
  return {{"position_mm", error.position},    {"tip_mm", error.tip},
          {"peak_force_n", error.peak_force}, {"mean_force_n", error.mean_force},
          {"tip_force_n", error.tip_force},   {"push_force_n", error.push_force},
          {"support_n", error.support}};
}

plan::NumericalError error_of(const Json& json) {
  return {.position = json.at("position_mm"),
          .tip = json.at("tip_mm"),
          .peak_force = json.at("peak_force_n"),
          .mean_force = json.at("mean_force_n"),
          .tip_force = json.at("tip_force_n"),
          .push_force = json.at("push_force_n"),
          .support = json.at("support_n")};
}

Json refinement_to_json(const plan::Refinement& refinement) {
  Json rows = Json::array(), error = nullptr, others = Json::array();
  for (const plan::NumericsRow& row : refinement.rows) {
    rows.push_back({{"element_length_mm", row.element_length},
                    {"position_error_mm", number_or_null(row.position_error)},
                    {"peak_force_n", row.peak_force},
                    {"iterations", row.iterations}});
  }
  if (refinement.error) error = error_to_json(*refinement.error);
  for (const plan::OtherEnd& other : refinement.others) {
    others.push_back({{"setting", plan::setting_name(other.setting)},
                      {"change", error_to_json(other.change)},
                      {"incomplete", other.incomplete}});
  }
  return {{"trial", refinement.trial},
          {"rows", std::move(rows)},
          {"error", std::move(error)},
          {"observed_order", number_or_null(refinement.observed_order)},
          {"reason", refinement.reason},
          {"others", std::move(others)},
          {"left_out", refinement.left_out},
          {"not_finer", refinement.not_finer}};
}

plan::Refinement refinement_of(const Json& json) {
  plan::Refinement refinement;
  refinement.trial = json.at("trial");
  refinement.observed_order = optional_of(json.at("observed_order"));
  refinement.reason = json.at("reason");
  refinement.left_out = json.at("left_out");
  refinement.not_finer = json.at("not_finer");
  for (const Json& row : json.at("rows")) {
    refinement.rows.push_back({.element_length = row.at("element_length_mm"),
                               .position_error = optional_of(row.at("position_error_mm")),
                               .peak_force = row.at("peak_force_n"),
                               .iterations = row.at("iterations")});
  }
  const Json& error = json.at("error");
  if (!error.is_null()) refinement.error = error_of(error);
  for (const Json& other : json.at("others")) {
    refinement.others.push_back({.setting = setting_of(other.at("setting")),
                                 .change = error_of(other.at("change")),
                                 .incomplete = other.at("incomplete")});
  }
  return refinement;
}

// In internal units: these are not for reading, and come back bit for bit.
Json robustness_to_json(const plan::RobustnessOptions& options) {
  const plan::Unknowns& unknowns = options.unknowns;
  Json json = {
      {"repeats", options.repeats},  {"plans", options.plans},
      {"seed", options.seed},        {"wall_factor", {unknowns.wall_low, unknowns.wall_high}},
      {"angle_rad", unknowns.angle}, {"entry_mm", unknowns.entry},
      {"lumen_mm", unknowns.lumen}};
  if (unknowns.support_low != 1.0 || unknowns.support_high != 1.0) {
    json["support_factor"] = {unknowns.support_low, unknowns.support_high};
  }
  return json;
}

plan::RobustnessOptions robustness_of(const Json& json) {
  const Json support = json.value("support_factor", Json({1.0, 1.0}));
  return {.repeats = json.at("repeats"),
          .plans = json.at("plans"),
          .seed = json.at("seed"),
          .unknowns = {.wall_low = json.at("wall_factor").at(0),
                       .wall_high = json.at("wall_factor").at(1),
                       .support_low = support.at(0),
                       .support_high = support.at(1),
                       .angle = json.at("angle_rad"),
                       .entry = json.at("entry_mm"),
                       .lumen = json.at("lumen_mm")}};
}

}  // namespace

std::string measured_text(const plan::Measured& measured, bool with_shape) {
  Json json = repeat_to_json(measured);
  json["schema"] = kMeasuredSchema;
  json["cpu_s"] = measured.cpu_seconds;
  if (with_shape) json["nodes_mm"] = to_json(measured.nodes);
  return json.dump();
}

std::optional<plan::Measured> measured_from_text(const std::string& text) {
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || json.value("schema", "") != kMeasuredSchema) return {};
  if (!has_all_metrics(json.at("metrics"))) return {};
  plan::Measured measured = measured_of(json);
  measured.cpu_seconds = json.at("cpu_s");
  if (!json.contains("nodes_mm")) return measured;
  measured.nodes = points_of(json.at("nodes_mm"));
  return measured;
}

Json plan_to_json(const plan::Plan& plan) {
  Json levels = Json::array(), trials = Json::array(), refinements = Json::array(),
       repeated = Json::array();
  for (const plan::Level level : plan.levels) levels.push_back(plan::level_name(level));
  for (const plan::Measured& trial : plan.trials) trials.push_back(measured_to_json(trial));
  for (const plan::Refinement& refinement : plan.refinements) {
    refinements.push_back(refinement_to_json(refinement));
  }
  for (const plan::RepeatedTrials& repeats : plan.repeated) {
    Json own = Json::array();
    for (const plan::Measured& trial : repeats.trials) own.push_back(repeat_to_json(trial));
    repeated.push_back({{"trial", repeats.trial}, {"trials", std::move(own)}});
  }
  return {
      {"levels", std::move(levels)},           {"trials", std::move(trials)},
      {"refinements", std::move(refinements)}, {"robustness", robustness_to_json(plan.robustness)},
      {"repeated", std::move(repeated)},       {"attempts", plan.attempts}};
}

void plan_from_json(const Json& json, const plan::Study& study, plan::Plan& plan) {
  for (const Json& level : json.at("levels")) plan.levels.push_back(level_of(level));
  for (const Json& trial : json.at("trials")) plan.trials.push_back(measured_of(trial));
  for (const Json& row : json.at("refinements")) plan.refinements.push_back(refinement_of(row));
  plan.robustness = robustness_of(json.at("robustness"));
  plan.disturbances = plan::draw_disturbances(plan.robustness, study.wires);
  for (const Json& row : json.at("repeated")) {
    plan::RepeatedTrials& repeats = plan.repeated.emplace_back();
    repeats.trial = row.at("trial");
    for (const Json& trial : row.at("trials")) repeats.trials.push_back(measured_of(trial));
  }
  plan.attempts = json.at("attempts").get<std::vector<int>>();
}

}  // namespace wireplan::pipeline
