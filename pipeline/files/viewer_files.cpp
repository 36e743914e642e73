#include "pipeline/files/viewer_files.h"

#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "simulate/insertion/start_line.h"

namespace wireplan::pipeline {
namespace {

// Spacing of the control points that Slicer draws a curve through.
constexpr double kMarkupSpacing = 2.0;
// Length of the introducer's line.
constexpr double kEntryLength = 40.0;

// Points every `spacing` or more along a line, and its last.
std::vector<Vec3> thin_out(const Eigen::Matrix3Xd& points, double spacing) {
  std::vector<Vec3> kept;
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const bool last = k + 1 == points.cols();
    if (kept.empty() || last || (points.col(k) - kept.back()).norm() >= spacing) {
      kept.emplace_back(points.col(k));
    }
  }
  return kept;
}

struct ControlPoint {
  std::string label;
  Vec3 point;
};

Json markup(const char* type, const std::string& name, const std::vector<ControlPoint>& points,
            bool labels) {
  Json controls = Json::array();
  for (const ControlPoint& control : points) {
    controls.push_back({{"id", std::to_string(controls.size() + 1)},
                        {"label", control.label},
                        {"position", to_json(control.point)}});
  }
  return {{"type", type},
          {"name", name},
          {"coordinateSystem", "LPS"},
          {"coordinateUnits", "mm"},
          {"controlPoints", std::move(controls)},
          {"display", {{"pointLabelsVisibility", labels}}}};
}

Json curve_markup(const Eigen::Matrix3Xd& points, const std::string& name) {
  std::vector<ControlPoint> controls;
  for (const Vec3& point : thin_out(points, kMarkupSpacing)) {
    controls.push_back({name + "-" + std::to_string(controls.size() + 1), point});
  }
  return markup("Curve", name, controls, /*labels=*/false);
}

void write_markups(Json markups, const std::filesystem::path& path) {
  write_json({{"@schema",
               "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/"
               "Resources/Schema/markups-schema-v1.0.0.json#"},
              {"markups", std::move(markups)}},
             path);
}

}  // namespace

void write_curve_markups(const std::vector<NamedCurve>& curves, const std::filesystem::path& path) {
  Json markups = Json::array();
  for (const NamedCurve& curve : curves) markups.push_back(curve_markup(curve.points, curve.name));
  write_markups(std::move(markups), path);
}

void write_curve_markups(const Eigen::Matrix3Xd& points, const std::string& name,
                         const std::filesystem::path& path) {
  write_curve_markups({{name, points}}, path);
}

namespace {

/// Of each step of a script the last shape in it: -1 where it has none.
std::vector<int> shapes_at_ends(const simulate::TrialResult& trial, std::size_t steps) {
  constexpr double kSame = 1e-3;  // of shapes that were kept with fewer digits  [mm, rad]
  std::vector<int> at_end(steps, -1);
  std::size_t push = 0;
  for (std::size_t k = 0; k < trial.shapes.size(); ++k) {
    const simulate::Shape& shape = trial.shapes[k];
    const auto is_of = [&](std::size_t p) {
      for (std::size_t i = 0; i < trial.tools.size(); ++i) {
        if (std::abs(trial.tools[i].insertion[p] - shape.tools[i]) > kSame) return false;
      }
      return std::abs(trial.tools.front().roll[p] - shape.hub_angle) <= kSame;
    };
    std::size_t own = push;
    while (own < trial.steps.size() && !is_of(own)) ++own;
    if (own == trial.steps.size()) continue;
    push = own;
    const auto step = static_cast<std::size_t>(trial.steps[own]);
    if (step < steps) at_end[step] = static_cast<int>(k);
  }
  return at_end;
}

}  // namespace

void write_step_markups(const simulate::TrialResult& trial, const std::vector<plan::ToldStep>& told,
                        const std::string& name, const std::vector<std::string>& tools,
                        const std::filesystem::path& folder) {
  const std::vector<int> at_end = shapes_at_ends(trial, told.size());
  for (std::size_t i = 0; i < tools.size(); ++i) {
    std::vector<NamedCurve> curves;
    for (std::size_t step = 0; step < told.size(); ++step) {
      if (at_end[step] < 0) continue;
      const simulate::Shape& shape = trial.shapes[static_cast<std::size_t>(at_end[step])];
      const Eigen::Matrix3Xd line = simulate::line_up_to(shape.nodes, shape.tools[i]);
      if (line.cols() < 2) continue;  // it is still outside
      curves.push_back({"step " + std::to_string(step + 1) + ": " + told[step].text, line});
    }
    write_curve_markups(curves, folder / (name + "-" + tools[i] + "-steps.mrk.json"));
  }
}

void write_plan_markups(const PlanMarkups& plan, const std::filesystem::path& path) {
  const Vec3 outside = plan.access - kEntryLength * plan.direction.normalized();
  Json markups = Json::array();
  markups.push_back(curve_markup(plan.nodes, plan.name + " wire"));
  markups.push_back(markup("Line", plan.name + " entry",
                           {{"introducer", outside}, {"access", plan.access}}, /*labels=*/false));
  markups.push_back(markup("Fiducial", plan.name + " points",
                           {{"access", plan.access}, {"target", plan.target}}, /*labels=*/true));
  write_markups(std::move(markups), path);
}

std::string csv_field(const Json& value) {
  if (value.is_null()) return "";
  if (!value.is_string()) return value.dump();
  std::string field = "\"";
  for (const char c : value.get_ref<const std::string&>()) {
    if (c == '"') field += '"';
    field += c;
  }
  return field + "\"";
}

std::string trials_csv(const Json& report) {
  std::map<int, int> ranks;
  for (const Json& plan : report.at("ranking")) ranks[plan.at("trial")] = plan.at("rank");

  // The columns are the plain values of the first trial, and those of scripts with a catheter where
  // any has them; points and lists stay in the JSON.
  std::vector<std::string> columns;
  const Json& trials = report.at("trials");
  for (const auto& [key, value] : trials.front().items()) {
    if (key != "wall_motion" && key != "null_reasons" && !value.is_structured()) {
      columns.push_back(key);
    }
  }
  for (const char* own : {"catheter", "first_wire", "exchanges"}) {
    const auto has = [&](const Json& trial) { return trial.contains(own); };
    const bool known = std::find(columns.begin(), columns.end(), own) != columns.end();
    if (!known && std::any_of(trials.begin(), trials.end(), has)) columns.emplace_back(own);
  }
  std::string table = "rank";
  for (const std::string& column : columns) table.append(",").append(column);
  table += "\r\n";
  for (const Json& trial : trials) {
    const auto rank = ranks.find(trial.at("id"));
    table += rank == ranks.end() ? "" : std::to_string(rank->second);
    for (const std::string& column : columns) {
      table.append(",").append(csv_field(trial.value(column, Json())));
    }
    table += "\r\n";
  }
  return table;
}

}  // namespace wireplan::pipeline
