#include "pipeline/report/anatomy_json.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/files/text.h"
#include "plan/anatomy/branch_names.h"
#include "plan/anatomy/passage.h"

namespace wireplan::pipeline {
namespace {

constexpr std::array kGrades = {"below mild", "mild", "moderate", "severe"};
constexpr const char* kUngraded = "a branch's own turn";
constexpr const char* kReportingStandards =
    "limits of the case; by default the reporting standards for iliac arteries (Chaikof et al. "
    "2002), here applied to the whole way";

using Tree = std::vector<preprocess::Branch>;

double degrees(double angle) { return angle / kRadPerDeg; }

const char* grade_name(int grade) { return kGrades.at(static_cast<std::size_t>(grade)); }

/// A device against the first `length` mm of the lumen, which it must pass; and the smallest
/// inscribed sphere there, since a narrow place may be wide one way alone.
Json passage_json(const Centerline& way, const Eigen::VectorXd& diameters, double length,
                  const plan::Size& device, double max_ratio, const char* source) {
  Centerline sections = way;
  sections.radius = 0.5 * diameters;
  const plan::Narrowest lumen = plan::find_narrowest(sections, length);
  const double inscribed = plan::find_narrowest(way, length).diameter;
  const double ratio = device.value / lumen.diameter;
  constexpr double kRound = 0.95;  // sphere over section: in a round lumen a few per cent less
  const bool oval = inscribed < std::min(kRound * lumen.diameter, device.value);
  return {{"lumen_diameter_mm", lumen.diameter},
          {"inscribed_diameter_mm", inscribed},
          {"at_mm", lumen.arc},
          {"place_mm", to_json(lumen.point)},
          {"device_diameter_mm", device.value},
          {"assumed", device.assumed},
          {"ratio", ratio},
          {"max_ratio", max_ratio},
          {"fits", ratio < max_ratio},
          {"oval", oval},
          {"source", source}};
}

/// The branch that the way turns into within an arm of the bend, if any: its turn makes the angle.
Json ostium_at(const plan::Corner& bend, const std::vector<plan::Junction>& junctions,
               const Tree& tree) {
  for (const plan::Junction& junction : junctions) {
    const bool near = std::abs(junction.level - bend.arc) < bend.arm;
    if (junction.taken && near) return plan::leaving_name(tree, junction);
  }
  return nullptr;
}

Json access_json(const Centerline& way, const Eigen::VectorXd& diameters,
                 const std::vector<plan::Junction>& junctions, const plan::Corner& bend,
                 const Tree& tree, const plan::AccessLimits& limits) {
  const double length = way.arc_length(way.arc_length.size() - 1);
  Json access;
  access["device"] = passage_json(way, diameters, length, limits.device_diameter, 1.0,
                                  "limits of the case; a device must be thinner than the lumen");
  access["sheath"] = passage_json(
      way, diameters, limits.sheath_length.value, limits.sheath_diameter, limits.max_sheath_ratio,
      "limits of the case; the ratio by default that of sheath to femoral artery");
  access["sheath"]["length_mm"] = limits.sheath_length.value;
  // Nobody would take such a sheath: it is not weighed, see way_findings().
  access["sheath"]["assumed_longer_than_way"] =
      limits.sheath_length.assumed && limits.sheath_length.value > length;

  const double index = plan::tortuosity(way);
  const bool open = std::isfinite(index);
  access["tortuosity"] = {{"index", open ? Json(index) : Json(nullptr)},
                          {"grade", grade_name(plan::grade_of(index, limits.tortuosity))},
                          {"thresholds", limits.tortuosity},
                          {"source", kReportingStandards}};
  if (!open) access["tortuosity"]["null_reasons"]["index"] = "the way ends where it starts";

  // By what is told: at a right angle, which is common, noise would choose the grade.
  const double told = std::round(degrees(bend.angle)) * kRadPerDeg;
  Json thresholds = Json::array();
  for (const double angle : limits.angle) thresholds.push_back(clean(degrees(angle)));
  const Json ostium = ostium_at(bend, junctions, tree);
  const char* grade = grade_name(plan::grade_of(told, limits.angle));
  access["sharpest_bend"] = {
      {"angle_deg", degrees(bend.angle)}, {"at_mm", bend.arc},
      {"place_mm", to_json(bend.point)},  {"arm_mm", bend.arm},
      {"at_ostium_of", ostium},           {"grade", ostium.is_null() ? grade : kUngraded},
      {"thresholds_deg", thresholds},     {"source", kReportingStandards}};
  return access;
}

Json projection_json(const plan::Projection& projection) {
  // As one says it: LAO 30, CRA 10, whole degrees.
  const auto named = [](double angle, const char* positive, const char* negative) {
    const auto whole = std::lround(degrees(angle));
    return std::string(whole < 0 ? negative : positive) + " " + std::to_string(std::abs(whole));
  };
  return {{"view", named(projection.view.rotation, "LAO", "RAO") + ", " +
                       named(projection.view.tilt, "CRA", "CAU")},
          {"lao_deg", degrees(projection.view.rotation)},
          {"cranial_deg", degrees(projection.view.tilt)},
          {"reachable", projection.reachable},
          {"trunk_foreshortening", projection.trunk_foreshortening},
          {"branch_foreshortening", projection.branch_foreshortening}};
}

/// The two views of trunk and branch under "best" and "second"; null where none are to be told.
void put_views(Json& row, const Vec3& trunk, const Vec3& branch, const plan::ArmLimits& arm,
               bool told) {
  const plan::Projections found = plan::find_projections(trunk, branch, arm);
  row["best"] = told ? projection_json(found.best) : Json(nullptr);
  row["second"] = told && found.second ? projection_json(*found.second) : Json(nullptr);
}

Json c_arm_json(const simulate::Way& way, const std::vector<plan::Junction>& junctions,
                const plan::Corner& bend, const plan::ArmLimits& arm, bool axes_known) {
  const Tree& tree = way.tree();
  Json rows = Json::array();
  for (const plan::Junction& junction : junctions) {
    if (!junction.taken) continue;
    Json row = {{"trunk", plan::trunk_name(tree, junction)},
                {"branch", plan::leaving_name(tree, junction)},
                {"leads_to_target", false},
                {"at_mm", junction.level},
                {"place_mm", to_json(junction.point)},
                {"turn_deg", degrees(plan::turn_of(junction))}};
    put_views(row, junction.trunk_direction, junction.branch_direction, arm, axes_known);
    rows.push_back(std::move(row));
  }
  if (!rows.empty()) rows.back()["leads_to_target"] = true;  // no other vessel is turned into
  Json of_bend = {{"at_mm", bend.arc}, {"place_mm", to_json(bend.point)}};
  put_views(of_bend, bend.before, bend.behind, arm, axes_known && bend.angle < plan::kNoBend);
  return {
      {"ostia", rows},
      {"bend", of_bend},
      {"no_views", axes_known ? Json(nullptr)
                              : Json("the case says that the input's axes are not known to be the "
                                     "patient's, from which LAO, RAO, cranial and caudal count")},
      {"max_rotation_deg", clean(degrees(arm.rotation))},
      {"max_tilt_deg", clean(degrees(arm.tilt))},
      {"source", "limits of the case; by default assumed, as fixed arms reach in general"}};
}

Json lengths_json(const Centerline& way, const std::vector<plan::Junction>& junctions,
                  const Tree& tree, const plan::AccessLimits& limits) {
  Json places = Json::array();
  const double length = way.arc_length(way.arc_length.size() - 1);
  for (const plan::Junction& junction : junctions) {
    const char* what = junction.bifurcation
                           ? (junction.taken ? "the bifurcation, into" : "the bifurcation, past")
                       : junction.taken ? "the way turns into"
                                        : "passes";
    places.push_back({{"what", what},
                      {"branch", plan::leaving_name(tree, junction)},
                      {"at_mm", junction.level},
                      {"place_mm", to_json(plan::point_at(way, junction.level))}});
  }
  const Vec3 end = way.points.col(way.points.cols() - 1);
  places.push_back(
      {{"what", "target"}, {"branch", nullptr}, {"at_mm", length}, {"place_mm", to_json(end)}});
  return {{"places", places},
          {"way_mm", length},
          {"catheter_mm", limits.catheter_length.value},
          {"catheter_assumed", limits.catheter_length.assumed},
          {"working_mm", limits.working_length.value},
          {"working_assumed", limits.working_length.assumed}};
}

/// The line every 2 mm and at its end, to a tenth of a millimetre.
Json drawn_line(const Centerline& line) {
  constexpr double kStep = 2.0;
  const auto tenth = [](double value) { return std::round(value * 10.0) / 10.0; };
  Json points = Json::array(), radii = Json::array();
  double next = line.arc_length(0);
  for (Eigen::Index k = 0; k < line.points.cols(); ++k) {
    if (line.arc_length(k) < next && k + 1 < line.points.cols()) continue;
    next = line.arc_length(k) + kStep;
    const Vec3 p = line.points.col(k);
    points.push_back({tenth(p.x()), tenth(p.y()), tenth(p.z())});
    radii.push_back(tenth(line.radius(k)));
  }
  return {{"points", points}, {"radius", radii}};
}

}  // namespace

Json anatomy_figures(const simulate::Way& way, const Eigen::VectorXd& diameters,
                     const plan::AccessLimits& limits, bool axes_known) {
  const std::vector<plan::Junction> junctions = plan::find_junctions(way);
  const plan::Corner bend = plan::find_sharpest_bend(way.path(), junctions);
  return {{"access", access_json(way.path(), diameters, junctions, bend, way.tree(), limits)},
          {"c_arm", c_arm_json(way, junctions, bend, limits.arm, axes_known)},
          {"lengths", lengths_json(way.path(), junctions, way.tree(), limits)}};
}

std::string doubt_of_axes(const simulate::Way& way) {
  constexpr double kMostLean = 45.0;  // of an aorta from head to feet                    [deg]
  const std::optional<Vec3> axis = plan::find_trunk_axis(way.tree());
  if (!axis) return "";
  const double lean = degrees(std::acos(std::min(1.0, std::abs(axis->z()))));
  if (lean <= kMostLean) return "";
  return format("the widest vessels run %.0f deg off the axis from head to feet", lean) +
         ": are the input's axes the patient's? If not, C-arm angles and the sides of azimuth and "
         "roll are not either; say so with \"axes\": \"unknown\"";
}

int grade_from(const std::string& name) {
  const auto found = std::find(kGrades.begin(), kGrades.end(), name);
  expects(found != kGrades.end());
  return static_cast<int>(found - kGrades.begin());
}

Json calcium_json(double volume, const std::string& unknown, const plan::AccessLimits& limits) {
  const bool known = unknown.empty();
  Json row = {{"volume_mm3", known ? Json(volume) : Json(nullptr)},
              {"above_hu", limits.calcium_hu},
              {"within_mm", limits.calcium_within},
              {"source", "limits of the case; by default assumed, no grade is agreed on"}};
  if (!known) row["null_reasons"]["volume_mm3"] = unknown;
  return row;
}

std::string describe_fit(const Json& passage) {
  if (passage.value("assumed_longer_than_way", false)) {
    return "not weighed: assumed, and longer than the way";
  }
  if (!passage.at("fits").get<bool>()) return "does not fit";
  return passage.at("oval").get<bool>() ? "fits where the lumen, oval there, gives way" : "fits";
}

std::string describe_anatomy(const Json& figures) {
  const Json& access = figures.at("access");
  const auto number = [](const Json& value, const char* form) {
    return value.is_null() ? std::string("not known") : format(form, value.get<double>());
  };
  const Json& bend = access.at("sharpest_bend");
  const Json& tortuosity = access.at("tortuosity");
  std::string text = "way: " + number(figures.at("lengths").at("way_mm"), "%.0f mm") +
                     ", tortuosity " + number(tortuosity.at("index"), "%.2f") + " (" +
                     tortuosity.at("grade").get<std::string>() + "), sharpest bend " +
                     number(bend.at("angle_deg"), "%.0f deg") +
                     (bend.at("angle_deg").get<double>() >= degrees(plan::kNoBend)
                          ? ""
                          : number(bend.at("at_mm"), ", %.0f mm in")) +
                     (bend.at("at_ostium_of").is_null()
                          ? " (" + bend.at("grade").get<std::string>() + ")"
                          : ", the turn into " + bend.at("at_ostium_of").get<std::string>()) +
                     "\n";
  for (const char* key : {"device", "sheath"}) {
    const Json& row = access.at(key);
    text += key + number(row.at("device_diameter_mm"), " of %.2f mm: ") + describe_fit(row) +
            number(row.at("lumen_diameter_mm"), "; narrowest lumen %.2f mm") +
            number(row.at("at_mm"), ", %.0f mm in\n");
  }
  const Json& calcium = access.at("calcium");
  text += "calcium in and beside the lumen: " +
          (calcium.at("volume_mm3").is_null()
               ? "not known, " + calcium.at("null_reasons").at("volume_mm3").get<std::string>()
               : number(calcium.at("volume_mm3"), "%.0f mm3")) +
          "\n";
  for (const Json& place : figures.at("lengths").at("places")) {
    text += number(place.at("at_mm"), "%.0f mm in: ") + place.at("what").get<std::string>() +
            (place.at("branch").is_null() ? "" : " " + place.at("branch").get<std::string>()) +
            "\n";
  }
  const Json& arm = figures.at("c_arm");
  if (!arm.at("no_views").is_null()) {
    return text + "no views of the C-arm: " + arm.at("no_views").get<std::string>() + "\n";
  }
  for (const Json& ostium : arm.at("ostia")) {
    text += "view of the turn into " + ostium.at("branch").get<std::string>() + ":";
    for (const char* key : {"best", "second"}) {
      if (ostium.at(key).is_null()) continue;
      const Json& view = ostium.at(key);
      text += std::string(key == std::string("best") ? " " : "; else ") +
              view.at("view").get<std::string>() +
              (view.at("reachable") ? "" : ", out of the C-arm's reach");
    }
    text += "\n";
  }
  return text;
}

Json anatomy_panel(const simulate::Way& way) {
  Json lines = Json::array();
  for (const preprocess::Branch& branch : way.tree()) lines.push_back(drawn_line(branch.line));
  return {{"tree", lines}, {"way", drawn_line(way.path())}};
}

Json anatomy_json(const ReportInput& input) {
  Json anatomy;
  for (const char* key : {"access", "c_arm", "lengths"}) {
    anatomy[key] = input.figures.at("anatomy").at(key);
  }
  Json& lengths = anatomy["lengths"];
  const auto& plans = input.judgement.ranking.plans;
  const int catheter =
      plans.empty() ? -1
                    : input.plan.candidates[static_cast<std::size_t>(plans.front().trial)].catheter;
  const bool own = catheter >= 0;
  lengths["catheter"] = nullptr;
  if (own) {
    const simulate::Wire& tube =
        input.study.catheters[static_cast<std::size_t>(catheter)].tool.wire;
    lengths["catheter"] = tube.name;
    lengths["catheter_mm"] = clean(tube.length());
    lengths["catheter_assumed"] = false;
  }
  double needed = 0.0;
  for (const char* part : {"way_mm", "catheter_mm", "working_mm"}) {
    needed += lengths.at(part).get<double>();
  }
  lengths["wire_needed_mm"] = needed;
  lengths["assumption"] =
      std::string("the wire's tip stays at the target while ") +
      (own ? "the catheter of plan 1" : "a catheter of that length") +
      " comes off the wire, and the working length is left to hold; counted from the access point, "
      "so what lies between it and the skin is part of the working length";
  lengths["wires"] = Json::array();
  for (const simulate::Wire& wire : input.study.wires) {
    lengths["wires"].push_back({{"wire", wire.name},
                                {"length_mm", clean(wire.length())},
                                {"spare_mm", wire.length() - needed},
                                {"long_enough", wire.length() >= needed}});
  }
  return anatomy;
}

}  // namespace wireplan::pipeline
