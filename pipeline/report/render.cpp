#include "pipeline/report/render.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "pipeline/files/catalogue.h"
#include "pipeline/files/text.h"
#include "pipeline/files/trial_file.h"
#include "pipeline/report/picture.h"
#include "pipeline/report/plot.h"
#include "pipeline/report/report.h"
#include "preprocess/files/vessel_io.h"
#include "simulate/insertion/start_line.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

const Color kFailed(0.88F, 0.89F, 0.91F);

Vec3 point_of(const Json& p) {
  return {p.at(0).get<double>(), p.at(1).get<double>(), p.at(2).get<double>()};
}

std::string degrees(const Json& value) { return format("%g", value.get<double>()); }

std::string plan_name(const Json& trial) {
  return trial.at("wire").get<std::string>() + ", " + degrees(trial.at("inclination_deg")) + " / " +
         degrees(trial.at("azimuth_deg")) + " / " + degrees(trial.at("roll_deg")) + " deg";
}

// Of the sphere, or of the vessel where its cross-section is the target.
double target_radius(const Json& report, const Json& target) {
  return (target.contains("radius_mm") ? target.at("radius_mm")
                                       : report.at("vessel").at("target_lumen_radius_mm"))
      .get<double>();
}

PictureMarks marks_of(const Json& report, const std::string& title) {
  const Json& asked = report.at("provenance").at("parameters");
  return {.title = report.at("name").get<std::string>() + ": " + title,
          .access = point_of(asked.at("access").at("point_mm")),
          .target = point_of(asked.at("target").at("point_mm")),
          .target_radius = target_radius(report, asked.at("target")),
          .patient_axes = asked.value("axes", "patient") == "patient"};
}

/// Of a device among the "wires" or "catheters" of the case, or of those that are suggested.
double radius_of(const Json& report, const char* kind, const std::string& device) {
  const Json& asked = report.at("provenance").at("parameters").at(kind);
  const Json& devices = asked.is_string() ? catalogue().file.at(kind) : asked;
  for (const Json& given : devices) {
    if (given.at("name") != device) continue;
    const Json& diameter = given.at("diameter_mm");
    return 0.5 * (diameter.is_object() ? diameter.at("value") : diameter).get<double>();
  }
  throw Error("report: \"" + device + "\" of a trial is not among the " + kind +
              " of the case; expected a report as wireplan wrote it");
}

// The best plans in their final shapes.
std::vector<PictureWire> best_wires(const Json& report, const fs::path& folder) {
  std::vector<PictureWire> wires;
  std::size_t shown = 0;
  for (const Json& plan : report.at("ranking")) {
    if (shown++ == kPlansShown) break;
    const fs::path file = folder / trial_file_name(plan.at("trial"));
    const std::optional<simulate::TrialResult> trial = find_trial(file);
    if (!trial) {
      throw Error(file.string() +
                  ": is missing or damaged, expected the trial beside its report; " +
                  "run the case again");
    }
    wires.push_back({.name = "plan " + plan.at("rank").dump() + ": " + plan_name(plan),
                     .nodes = trial->nodes,
                     .contact_force = {},
                     .radius = radius_of(report, "wires", plan.at("wire")),
                     .color = wire_color(static_cast<int>(wires.size()))});
    if (trial->tools.empty() || trial->tools.front().insertion.back() <= 0.0) continue;
    const std::string catheter = plan.at("catheter");
    wires.push_back(
        {.name = catheter + ", round it",
         .nodes = simulate::line_up_to(trial->nodes, trial->tools.front().insertion.back()),
         .contact_force = {},
         .radius = radius_of(report, "catheters", catheter),
         .color = wire_color(static_cast<int>(wires.size()))});
  }
  return wires;
}

// A key of the grid and the trials' order of it.
struct Axis {
  std::vector<std::string> names;
  std::size_t at(const std::string& name) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
    names.push_back(name);
    return names.size() - 1;
  }
};

struct Cell {
  std::string text;
  Color color = kFailed;
};

// Letters for how a trial ended, as on the page.
const std::vector<std::pair<std::string, std::string>> kLetters = {
    {"missed", "M"},         {"passed_by", "B"},     {"wrong_branch", "W"},
    {"left_image", "E"},     {"stuck", "S"},         {"prolapsed", "P"},
    {"left_lumen", "L"},     {"not_converged", "N"}, {"another_way", "A"},
    {"crosses_itself", "X"}, {"failed", "F"},        {"left_opening", "O"}};  // the last of reports
                                                                              // before version 2

std::string letter_of(const std::string& outcome) {
  for (const auto& [name, letter] : kLetters) {
    if (name == outcome) return letter;
  }
  return "?";
}

// Black or white, whichever reads better on the color.
Color ink_on(const Color& color) {
  return color.dot(Color(0.30F, 0.59F, 0.11F)) > 0.5F ? Color::Zero() : Color::Ones();
}

// Position error over CPU time of each refined plan; nothing where there is none.
std::optional<Picture> draw_numerics(const Json& report) {
  std::map<std::pair<int, double>, double> seconds;
  for (const Json& row : report.at("timing").at("numerics")) {
    seconds[{row.at("trial"), row.at("element_length_mm")}] = row.at("cpu_s");
  }
  FrontPlot plot{.title = "elements twice as long, as in the plan, and half as long",
                 .x_label = "CPU time of one insertion [s]",
                 .y_label = "position error [mm]",
                 .lines = {}};
  std::vector<LegendEntry> legend;
  std::map<int, std::size_t> lines;
  for (const Json& row : report.at("numerics").at("rows")) {
    const auto time = seconds.find({row.at("trial"), row.at("element_length_mm")});
    const Json& error = row.at("position_error_mm");
    if (time == seconds.end() || error.is_null() || error <= 0.0 || time->second <= 0.0) continue;
    const auto [line, added] = lines.try_emplace(row.at("trial"), plot.lines.size());
    if (added) {
      plot.lines.push_back({.entry = legend.size(), .points = {}});
      legend.push_back(
          {"trial " + row.at("trial").dump(), wire_color(static_cast<int>(legend.size()))});
    }
    plot.lines[line->second].points.emplace_back(time->second, error);
  }
  if (plot.lines.empty()) return {};
  return draw_fronts(report.at("name").get<std::string>() + ": error against run time", {plot}, 1,
                     legend);
}

// As the best plan moves it in the end, or at rest.
Surface best_vessel(const fs::path& beside) {
  fs::path last = beside / "surface.vtp";
  const fs::path states = beside / "trials" / "plan-1-vessel";
  for (int k = 0; fs::exists(states / (std::to_string(k) + ".vtp")); ++k) {
    last = states / (std::to_string(k) + ".vtp");
  }
  return preprocess::read_surface_artifact(last);
}

}  // namespace

Picture draw_angles(const Json& report) {
  // One row per entry direction, one column per wire and roll.
  Axis rows, columns;
  std::map<std::pair<std::size_t, std::size_t>, const Json*> trials;
  double scale = 0.0;
  for (const Json& trial : report.at("trials")) {
    const std::size_t row =
        rows.at(degrees(trial.at("inclination_deg")) + " / " + degrees(trial.at("azimuth_deg")));
    const std::size_t column =
        columns.at(trial.at("wire").get<std::string>() + "\n" + degrees(trial.at("roll_deg")));
    const Json& force = trial.at("peak_contact_force_n");
    const bool reached = trial.at("reached") && !force.is_null();
    if (reached) scale = std::max(scale, force.get<double>());
    // Of several ways to move one wire at one angle, the gentlest that reaches.
    const Json*& shown = trials[{row, column}];
    const bool gentler =
        shown == nullptr ||
        (reached && (!shown->at("reached") || force < shown->at("peak_contact_force_n")));
    if (gentler) shown = &trial;
  }

  constexpr int kLeft = 150, kWidth = 72, kHeight = 34, kTop = 170, kBottom = 60, kText = 15;
  const int row_count = static_cast<int>(rows.names.size());
  const int column_count = static_cast<int>(columns.names.size());
  Picture picture = blank_picture(std::max(900, kLeft + 20 + column_count * kWidth),
                                  kTop + kBottom + row_count * kHeight);
  const int top = picture.height - kTop;

  // Title, scale and letters.
  draw_text(picture, report.at("name").get<std::string>() + ": wires and angles", picture.width / 2,
            picture.height - 24, 22, Align::kCenter);
  draw_text(picture, "reached, largest contact force [N]: 0", 330, picture.height - 62, kText,
            Align::kRight);
  draw_force_bar(picture, 340, picture.height - 69, 140, 14);
  draw_text(picture, format("%.3g", scale), 490, picture.height - 62, kText, Align::kLeft);
  std::string letters;
  for (const auto& [name, letter] : kLetters) letters += letter + ": " + name + "   ";
  std::replace(letters.begin(), letters.end(), '_', ' ');
  draw_text(picture, letters, 20, picture.height - 90, kText, Align::kLeft, kGrey);

  // Headings: each wire over its first column, neighbours at two heights; every roll.
  std::string wire;
  bool raised = true;
  for (int c = 0; c < column_count; ++c) {
    const std::string& name = columns.names[static_cast<std::size_t>(c)];
    const std::size_t cut = name.rfind('\n');
    const int x = kLeft + c * kWidth;
    if (name.substr(0, cut) != wire) {
      wire = name.substr(0, cut);
      raised = !raised;
      draw_text(picture, wire, x + 4, top + (raised ? 56 : 38), kText, Align::kLeft);
    }
    draw_text(picture, "roll " + name.substr(cut + 1), x + kWidth / 2, top + 14, kText - 2,
              Align::kCenter);
  }
  draw_text(picture, "incl. / azim. [deg]", kLeft - 10, top + 14, kText - 2, Align::kRight);

  for (int r = 0; r < row_count; ++r) {
    const int y = top - (r + 1) * kHeight;
    draw_text(picture, rows.names[static_cast<std::size_t>(r)], kLeft - 10, y + kHeight / 2, kText,
              Align::kRight);
    for (int c = 0; c < column_count; ++c) {
      const auto found = trials.find({r, c});
      if (found == trials.end()) continue;
      const Json& trial = *found->second;
      Cell cell{letter_of(trial.at("outcome")), kFailed};
      if (trial.at("reached")) {
        const double force = trial.at("peak_contact_force_n");
        cell = {format("%.2g", force), force_color(scale > 0.0 ? force / scale : 0.0)};
      }
      fill_box(picture, kLeft + c * kWidth, y, kWidth - 2, kHeight - 2, cell.color);
      draw_text(picture, cell.text, kLeft + c * kWidth + kWidth / 2, y + kHeight / 2, kText,
                Align::kCenter, ink_on(cell.color));
    }
  }
  draw_text(picture, "Research use only.", picture.width - 20, 24, kText, Align::kRight, kGrey);
  return picture;
}

std::vector<std::string> render_report(const fs::path& file, const fs::path& folder) {
  const Json report = read_json(file, kReportSchema, kOlderReportSchema);
  const fs::path beside = file.parent_path();
  const Surface vessel = preprocess::read_surface_artifact(beside / "surface.vtp");
  fs::create_directories(folder);
  std::vector<std::string> lines;
  const auto add = [&](const char* name, const Picture& picture) {
    write_png(picture, folder / name);
    lines.push_back((folder / name).string());
  };

  const std::vector<PictureWire> wires = best_wires(report, beside);
  add("vessel.png",
      draw_picture(best_vessel(beside), wires,
                   marks_of(report, wires.empty() ? "no plan is ranked" : "best plans")));
  PictureMarks forces = marks_of(report, "largest force of any trial");
  forces.wall_force = preprocess::read_wall_array(beside / "forces.vtu", "peak_force_n");
  if (static_cast<Eigen::Index>(forces.wall_force.size()) != vessel.triangles.cols()) {
    throw Error((beside / "forces.vtu").string() + ": has " +
                std::to_string(forces.wall_force.size()) + " tetrahedra, expected " +
                std::to_string(vessel.triangles.cols()) +
                ", one per triangle of surface.vtp; the two are of different runs");
  }
  add("forces.png", draw_picture(vessel, {}, forces));
  add("angles.png", draw_angles(report));
  if (const std::optional<Picture> numerics = draw_numerics(report)) {
    add("numerics.png", *numerics);
  } else {
    lines.push_back("numerics.png is left out: no plan was run with finer and coarser elements");
  }
  return lines;
}

}  // namespace wireplan::pipeline
