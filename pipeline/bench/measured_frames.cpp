#include "pipeline/bench/measured_frames.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <tuple>

#include "pipeline/files/text.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_repair.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr double kSameTip = 5.0;       // ends so near are in one branch                     [mm]
constexpr double kLeastLength = 40.0;  // of wire beyond the entry, to be of use             [mm]

/// Frames have no "schema": they are others' data.
Json read_frames(const fs::path& file) {
  std::ifstream stream(file);
  if (!stream) throw Error(file.string() + ": cannot be read, expected the measured frames");
  Json json = Json::parse(stream, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("frames") || !json["frames"].is_array() ||
      json["frames"].empty()) {
    throw Error(file.string() + ": frames is missing, expected a list of measured frames");
  }
  return json;
}

MeasuredFrame read_frame(const Json& json, const std::string& path, Problems& problems) {
  JsonReader reader(json, path, problems);
  MeasuredFrame frame;
  frame.recording = reader.text("recording", std::nullopt);
  frame.frame = reader.integer("frame", std::nullopt, 0, 1'000'000);
  frame.angled = reader.choice("wire", std::nullopt, {"angled", "straight"}) == "angled";
  const std::vector<Vec3> points = reader.points("polyline_mm", true);
  const std::vector<double> sigma =
      reader.numbers("sigma_mm", std::nullopt, {.min = 0.0, .max = 1000.0});
  if (points.size() != sigma.size() && problems.empty()) {
    problems.add(path + ".sigma_mm", std::to_string(sigma.size()) + " numbers",
                 "one for each of the " + std::to_string(points.size()) + " points");
  }
  frame.line.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) {
    frame.line.col(static_cast<Eigen::Index>(k)) = points[k];
  }
  frame.sigma = Eigen::VectorXd::Map(sigma.data(), static_cast<Eigen::Index>(sigma.size()));
  return frame;
}

/// Takes the wire to come in at a place of its line, and leaves out what is before.
void find_entry(const MeasuredParameters& parameters, MeasuredFrame& frame) {
  const Eigen::Matrix3Xd whole = frame.line;
  const double at = parameters.entry_at, span = parameters.entry_span;
  frame.entry.point = simulate::point_at_arc(whole, at);
  frame.entry.direction = (simulate::point_at_arc(whole, at + span) -
                           simulate::point_at_arc(whole, std::max(0.0, at - span)))
                              .normalized();
  frame.line = simulate::line_from_entry(whole, frame.entry.point);
  const Eigen::Index kept = frame.line.cols() - 1;
  const Eigen::VectorXd sigma = frame.sigma.tail(kept);
  frame.sigma.resize(kept + 1);
  frame.sigma << sigma[0], sigma;
  frame.length = simulate::arc_length(frame.line);
}

/// The branch of the tree that a point is nearest to, in its radii.
int nearest_branch(const Vec3& point, const std::vector<preprocess::Branch>& tree) {
  constexpr double kLeastRadius = 0.5;  // [mm]
  int nearest = -1;
  double least = INFINITY;
  for (std::size_t k = 0; k < tree.size(); ++k) {
    const Centerline& line = tree[k].line;
    for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
      const double off =
          (line.points.col(i) - point).norm() / std::max(kLeastRadius, line.radius[i]);
      if (off >= least) continue;
      least = off;
      nearest = static_cast<int>(k);
    }
  }
  return nearest;
}

}  // namespace

std::string MeasuredFrame::name() const { return recording + format("_%03d", frame); }

/// As thick as the wall's inner skin keeps it from the outer one, and as stiff as it is: EA and GJ
/// are those of a solid rod of the wire's own radius.
simulate::Wire make_wire(const MeasuredParameters& parameters, bool angled) {
  simulate::Wire wire{.name = angled ? "angled" : "straight",
                      .radius = parameters.radius + parameters.skin,
                      .sections = {}};
  const double diameter = 2.0 * parameters.radius;
  const auto add = [&](double length, double EI, double curvature) {
    wire.sections.push_back({.length = length,
                             .bending_stiffness = EI,
                             .axial_stiffness = 16.0 * EI / (diameter * diameter),
                             .rest_curvature = curvature});
  };
  const double bent = angled ? parameters.bent : 0.0;
  if (angled) add(bent, parameters.tip_EI, parameters.bend / bent);
  add(parameters.soft - bent, parameters.tip_EI, 0.0);
  const int steps = parameters.taper_steps;
  for (int k = 0; k < steps; ++k) {
    const double part = (k + 0.5) / steps;
    add(parameters.taper / steps,
        parameters.tip_EI * std::pow(parameters.shaft_EI / parameters.tip_EI, part), 0.0);
  }
  constexpr double kShaft = 600.0;  // more than any phantom is long [mm]
  add(kShaft, parameters.shaft_EI, 0.0);
  return wire;
}

Json to_json(const MeasuredParameters& parameters) {
  return {{"radius_mm", parameters.radius},
          {"wall_skin_mm", parameters.skin},
          {"tip_bending_stiffness_n_mm2", parameters.tip_EI},
          {"shaft_bending_stiffness_n_mm2", parameters.shaft_EI},
          {"soft_tip_mm", parameters.soft},
          {"taper_mm", parameters.taper},
          {"bent_tip_mm", parameters.bent},
          {"bend_deg", parameters.bend / kRadPerDeg},
          {"friction", parameters.friction},
          {"wall", "rigid"},
          {"entry_at_mm", parameters.entry_at},
          {"entry_chord_mm", parameters.entry_span},
          {"turn_deg", parameters.turn / kRadPerDeg},
          {"turn_after_mm", parameters.turn_after}};
}

MeasuredWires read_measured_wires(const fs::path& folder, const MeasuredParameters& parameters) {
  const fs::path file = folder / "frames.json";
  const Json json = read_frames(file);
  MeasuredWires wires;
  Problems problems(file.string());
  const Json& frames = json["frames"];
  for (std::size_t k = 0; k < frames.size(); ++k) {
    wires.frames.push_back(read_frame(frames[k], "frames[" + std::to_string(k) + "]", problems));
  }
  problems.throw_if_any();
  wires.phantom = preprocess::read_sound_surface(folder / "phantom.stl", "mm", "LPS").surface;
  for (std::size_t k = 0; k < wires.frames.size(); ++k) {
    MeasuredFrame& frame = wires.frames[k];
    const std::string key = "frames[" + std::to_string(k) + "].polyline_mm";
    const double whole = frame.line.cols() > 1 ? simulate::arc_length(frame.line) : 0.0;
    if (whole < parameters.entry_at + kLeastLength) {
      problems.add(key, format("%.1f mm long", whole),
                   format("%.0f mm at least", parameters.entry_at + kLeastLength));
      continue;
    }
    find_entry(parameters, frame);
    if (preprocess::locate_point(wires.phantom, frame.entry.point).inside) continue;
    problems.add(key, format("outside of phantom.stl %.0f mm along it", parameters.entry_at),
                 "a wire in the phantom", "are both in the phantom's frame and in mm?");
  }
  problems.throw_if_any();
  std::stable_sort(wires.frames.begin(), wires.frames.end(),
                   [](const MeasuredFrame& a, const MeasuredFrame& b) {
                     return std::tie(a.recording, a.frame) < std::tie(b.recording, b.frame);
                   });
  return wires;
}

MeasuredError find_error(const Eigen::Matrix3Xd& computed, const Eigen::Matrix3Xd& measured,
                         const std::vector<preprocess::Branch>& tree) {
  const simulate::LineDistance both = simulate::find_distance(computed, measured);
  MeasuredError error{.largest = both.largest, .tip = both.tip};
  for (Eigen::Index i = 0; i < measured.cols(); ++i) {
    const Vec3 point = measured.col(i);
    error.mean += (simulate::nearest_on_line(computed, point) - point).norm();
  }
  error.mean /= static_cast<double>(measured.cols());
  const Vec3 tip = computed.rightCols<1>(), measured_tip = measured.rightCols<1>();
  error.branch_right =
      error.tip <= kSameTip || nearest_branch(tip, tree) == nearest_branch(measured_tip, tree);
  return error;
}

}  // namespace wireplan::pipeline
