#include "pipeline/commands/scene_run.h"

#include <algorithm>
#include <map>
#include <memory>

#include "pipeline/commands/scene_sensitivity.h"
#include "pipeline/commands/scene_support.h"
#include "pipeline/files/disk.h"
#include "pipeline/files/result_file.h"
#include "pipeline/files/text.h"
#include "pipeline/files/trial_file.h"
#include "pipeline/report/picture.h"
#include "pipeline/report/report.h"
#include "pipeline/stages/held_places.h"
#include "plan/batch.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/cores.h"
#include "preprocess/files/vessel_io.h"
#include "preprocess/surface/openings.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_repair.h"
#include "preprocess/wall/wall.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

/// A scene's vessel, read, checked and ready for a wire.
struct LoadedVessel {
  Surface surface;
  Wall wall;                             // of a rigid vessel too: forces are shown on it
  std::vector<std::string> told;         // of the file and the entry, in sentences
  std::vector<preprocess::Branch> tree;  // of one that moves as a whole
  std::unique_ptr<simulate::VesselModel> model;
};

/// Where tools or a wire that are pushed in become free.
const Vec3& entry_of(const SceneFile& scene) {
  return scene.tools ? scene.tools->scene.point : scene.insertion->introducer.point;
}

/// Refuses an entry outside the vessel. Returns a sentence where the wire touches the wall already
/// as it enters, else nothing.
std::vector<std::string> look_at_entry(const SceneFile& scene, const Surface& surface) {
  if (!scene.insertion && !scene.tools) return {};
  const std::string key = scene.tools ? "introducer.point_mm" : "insertion.point_mm";
  const Vec3& entry = entry_of(scene);
  const preprocess::InsideAnswer answer = preprocess::locate_point(surface, entry);
  const double radius =
      scene.tools ? scene.tools->scene.tools.front().wire.radius : scene.insertion->wire.radius;
  if (answer.inside && answer.distance >= radius) return {};
  if (answer.inside) {
    return {
        format("%s lies %.2f mm from the wall, nearer than the wire's radius of "
               "%.2f mm: the introducer presses the wire into the wall",
               key.c_str(), answer.distance, radius)};
  }
  Problems problems(scene.file.string());
  problems.add(key, to_json(entry).dump(),
               format("a point inside the vessel; it lies %.1f mm outside", answer.distance),
               "move it, or correct the surface's unit or frame");
  problems.throw_if_any();
  return {};
}

constexpr const char* kRollFolder = "roll_";

/// "roll_45", as the scene counts it.
std::string roll_name(const InsertionScene& scene, double roll) {
  return kRollFolder + format("%.10g", (roll - scene.roll_zero) / kRadPerDeg);
}

constexpr double kFarOutside = 10.0;  // of a line to start from, and of a target          [mm]

/// Refuses a line to start from that leaves the vessel by more than a measurement may.
void look_at_start(const SceneFile& scene, const Surface& surface) {
  if (!scene.insertion || !scene.insertion->start) return;
  const Eigen::Matrix3Xd line =
      simulate::line_from_entry(scene.insertion->start->nodes, scene.insertion->introducer.point);
  double most = 0.0;
  Vec3 where = line.col(0);
  for (Eigen::Index k = 1; k < line.cols(); ++k) {
    const preprocess::InsideAnswer answer = preprocess::locate_point(surface, line.col(k));
    if (answer.inside || answer.distance <= most) continue;
    most = answer.distance;
    where = line.col(k);
  }
  if (most <= kFarOutside) return;
  Problems problems(scene.file.string());
  problems.add("start.nodes_mm",
               format("%.1f mm outside the vessel at ", most) + to_json(where).dump(),
               format("a line in the vessel, or at most %.0f mm through its wall", kFarOutside),
               "correct the points, or the surface's unit or frame");
  problems.throw_if_any();
}

/// Refuses a target that no wire in the vessel comes to: a wall that yields, or a vessel that
/// moves, brings the wire no further than so far outside.
void look_at_target(const SceneFile& scene, const Surface& surface) {
  if (!scene.insertion || !scene.insertion->has_target) return;
  const simulate::Goal& goal = scene.insertion->goal;
  const WallInput& wall = scene.vessel->wall;
  const double beyond = wall.elastic || wall.support ? kFarOutside : 0.0;
  const preprocess::InsideAnswer answer = preprocess::locate_point(surface, goal.point);
  if (answer.inside || answer.distance <= goal.radius + beyond) return;
  Problems problems(scene.file.string());
  problems.add(
      "target.point_mm", to_json(goal.point).dump(),
      format("a point inside the vessel, or within target.radius_mm of it; it lies %.1f mm "
             "outside",
             answer.distance),
      "move it, or correct the surface's unit or frame");
  problems.throw_if_any();
}

/// Refuses supports that hold an end of the wire where it would not feel the vessel: outside, and
/// not in front of an opening.
void look_at_supports(const SceneFile& scene, const Surface& surface) {
  constexpr double kBeside = 1.5;  // radii of an opening, from its axis
  std::vector<Vec3> points;
  if (scene.bench) {
    for (const simulate::Support& support : scene.bench->supports) points.push_back(support.point);
  }
  if (scene.tools && scene.tools->scene.distal) points.push_back(scene.tools->scene.distal->point);
  if (points.empty()) return;
  const std::vector<preprocess::Opening> openings = preprocess::find_openings(surface);
  Problems problems(scene.file.string());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const preprocess::InsideAnswer answer = preprocess::locate_point(surface, points[k]);
    const auto is_before = [&](const preprocess::Opening& opening) {
      const Vec3 off = points[k] - opening.center;
      const double depth = opening.normal.dot(off);
      return depth >= 0.0 && (off - depth * opening.normal).norm() <= kBeside * opening.radius;
    };
    if (answer.inside || std::any_of(openings.begin(), openings.end(), is_before)) continue;
    problems.add("supports[" + std::to_string(k) + "].point_mm", to_json(points[k]).dump(),
                 format("a point inside the vessel, or in front of an opening of it; it lies %.1f "
                        "mm outside",
                        answer.distance),
                 "move it, or correct the surface's unit or frame");
  }
  problems.throw_if_any();
}

/// The surface of a scene's vessel, sound and with the wire's entry in it.
struct SceneSurface {
  Surface surface;
  std::vector<std::string> mended, entry;  // in sentences
};

SceneSurface read_scene_surface(const SceneFile& scene) {
  const SurfaceInput& file = scene.vessel->surface;
  preprocess::RepairedSurface repaired =
      preprocess::read_sound_surface(file.path, file.unit, file.frame);
  std::vector<std::string> entry = look_at_entry(scene, repaired.surface);
  look_at_start(scene, repaired.surface);
  look_at_target(scene, repaired.surface);
  look_at_supports(scene, repaired.surface);
  return {std::move(repaired.surface), preprocess::tell_mends(repaired.mends), std::move(entry)};
}

// Radius of the thickest wire or tool [mm].
double thickest(const SceneFile& scene) {
  if (scene.bench) return scene.bench->wire.radius;
  if (scene.insertion) return scene.insertion->wire.radius;
  double radius = 0.0;
  for (const simulate::Tool& tool : scene.tools->scene.tools) {
    radius = std::max(radius, tool.wire.radius);
  }
  return radius;
}

LoadedVessel load_vessel(const SceneFile& scene) {
  const SceneVessel& given = *scene.vessel;
  LoadedVessel vessel;
  SceneSurface read = read_scene_surface(scene);
  vessel.surface = std::move(read.surface);
  for (const std::string& line : read.mended) vessel.told.push_back("surface: " + line);
  vessel.told.insert(vessel.told.end(), read.entry.begin(), read.entry.end());
  vessel.wall = preprocess::extrude_wall(vessel.surface, given.wall.extrusion).wall;
  const simulate::LumenOptions options =
      simulate::follow(vessel.surface, thickest(scene) + given.contact_law.reach());
  auto model = given.wall.elastic
                   ? std::make_unique<simulate::VesselModel>(vessel.surface, vessel.wall, options)
                   : std::make_unique<simulate::VesselModel>(vessel.surface, options);
  if (given.wall.support) {
    const Vec3& entry = entry_of(scene);
    vessel.tree = preprocess::find_tree(vessel.surface, entry);
    model->sections = make_section_chain(given.wall, vessel.tree, entry, vessel.wall.young_modulus);
  }
  vessel.model = std::move(model);
  return vessel;
}

/// How the cross-sections of a vessel have moved, (3, n) [mm]; nothing where they do not.
using Shifts = Eigen::Matrix3Xd;

/// The surface as the sections carry it; at rest where they do not move.
Surface carried_surface(const LoadedVessel& vessel, const Shifts& shifts) {
  Surface surface = vessel.surface;
  if (shifts.cols() > 0 && shifts.allFinite()) {
    surface.vertices = vessel.model->sections->carried(surface.vertices, shifts);
  }
  return surface;
}

/// The vessel on the way, by insertion or number of moves, as vessel.pvd and vessel/K.vtp.
void write_vessel(const LoadedVessel& vessel, const std::vector<simulate::Shape>& shapes,
                  const fs::path& folder) {
  if (!vessel.model->sections || shapes.empty()) return;
  write_moved_vessel(shapes, vessel.surface, *vessel.model->sections, "vessel", folder);
}

/// The section that moved furthest, and where it is at rest.
void put_largest_shift(Json& json, const simulate::SectionChain& chain, const Shifts& shifts) {
  if (shifts.cols() == 0 || !shifts.allFinite()) return;
  Eigen::Index most = 0;
  json["largest_shift_mm"] = shifts.colwise().norm().maxCoeff(&most);
  json["largest_shift_at_mm"] = to_json(Vec3(chain.places().col(most)));
}

/// What the result tells of the vessel.
Json vessel_json(const SceneVessel& given, const LoadedVessel& vessel, const Shifts& shifts) {
  const simulate::Lumen& lumen = vessel.model->lumen;
  Json json = {{"triangles", vessel.surface.triangles.cols()},
               {"wall_model", given.wall.elastic ? "elastic" : "rigid"}};
  if (given.wall.elastic) {
    json["wall_young_modulus_kpa"] = clean(vessel.wall.young_modulus / kMpaPerKpa);
    json["wall_stiffness_kpa_per_mm"] =
        clean(wall_normal_stiffness(vessel.wall.young_modulus, vessel.wall.poisson_ratio,
                                    given.wall.extrusion.thickness_mm) /
              kMpaPerKpa);
  } else {
    json["wall_stiffness_kpa_per_mm"] = nullptr;
    json["wall_stiffness_kpa_per_mm_reason"] = "the wall is rigid";
  }
  json["friction"] = given.friction;
  json["lumen_grid_mm"] = lumen.grid_spacing();
  json["lumen_max_deviation_mm"] = lumen.max_deviation();
  json["lumen_mean_deviation_mm"] = lumen.mean_deviation();
  json["openings"] = openings_json(lumen.openings());
  if (given.wall.support) {
    json["support_kpa_per_mm"] = clean(*given.wall.support / kMpaPerKpa);
    put_largest_shift(json, *vessel.model->sections, shifts);
  }
  return json;
}

/// Whether nothing rubs on the wall; tools may by their own coefficients.
bool is_frictionless(const SceneFile& scene) {
  const double friction = scene.vessel->friction;
  if (!scene.tools) return friction == 0.0;
  const std::vector<simulate::Tool>& tools = scene.tools->scene.tools;
  return std::all_of(tools.begin(), tools.end(), [&](const simulate::Tool& tool) {
    return tool.wire.friction.value_or(friction) == 0.0;
  });
}

bool has_own_friction(const std::vector<simulate::Tool>& tools) {
  return std::all_of(tools.begin(), tools.end(),
                     [](const simulate::Tool& tool) { return tool.wire.friction.has_value(); });
}

Json warnings_json(const SceneFile& scene, const LoadedVessel& vessel) {
  const SceneVessel& given = *scene.vessel;
  const bool fitted = scene.insertion && scene.insertion->measured;  // the support
  Json warnings = Json::array();
  for (const std::string& line : vessel.told) warnings.push_back(line);
  if (is_frictionless(scene)) {
    warnings.push_back("frictionless (friction is 0): push forces are lower bounds");
  }
  if (given.friction > 0.0 && scene.tools && has_own_friction(scene.tools->scene.tools)) {
    warnings.push_back("vessel.friction acts on no tool: each has its own");
  }
  if (!given.wall.elastic) warnings.push_back("rigid wall: contact forces are upper bounds");
  if (given.wall.support) warnings.push_back(support_warning(*given.wall.support, fitted));
  return warnings;
}

/// The result with what the vessel adds to it.
void write_result(Json result, const SceneFile& scene, const LoadedVessel* vessel,
                  const Shifts& shifts, const fs::path& folder) {
  if (vessel) {
    result["vessel"] = vessel_json(*scene.vessel, *vessel, shifts);
    result["warnings"] = warnings_json(scene, *vessel);
  }
  write_json(result, folder / "result.json");
}

constexpr const char* kPeakForce = "peak_force_n";  // of all pushes
constexpr const char* kForce = "force_n";           // at the end

/// Each triangle of the wall with the force that it took.
void write_forces(const LoadedVessel& vessel, const char* name,
                  const std::vector<simulate::TriangleForce>& forces, const fs::path& folder) {
  std::vector<double> force(static_cast<std::size_t>(vessel.surface.triangles.cols()), 0.0);
  for (const simulate::TriangleForce& one : forces) {
    force.at(static_cast<std::size_t>(one.triangle)) = one.force;
  }
  preprocess::write_wall(vessel.surface, vessel.wall, folder / "forces.vtu", {{name, force}});
}

/// In the vessel as they leave it. Nothing is drawn of a wire that has no place.
void write_wire_picture(const LoadedVessel* vessel, const Shifts& shifts,
                        std::vector<PictureWire> wires, const PictureMarks& marks,
                        const fs::path& folder) {
  std::erase_if(wires, [](const PictureWire& wire) {
    return wire.nodes.cols() < 2 || !wire.nodes.allFinite();
  });
  if (wires.empty() && !vessel) return;
  write_picture(vessel ? carried_surface(*vessel, shifts) : Surface(), wires, marks,
                folder / "wire.png");
}

/// Sum of the contacts on each triangle that has one, ascending.
std::vector<simulate::TriangleForce> sum_by_triangle(
    const std::vector<simulate::WireContact>& contacts) {
  std::map<int, double> force;
  for (const simulate::WireContact& contact : contacts) {
    if (contact.triangle >= 0) force[contact.triangle] += contact.normal_force.norm();
  }
  std::vector<simulate::TriangleForce> sums;
  for (const auto& [triangle, sum] : force) sums.push_back({triangle, sum});
  return sums;
}

SceneAnswer run_bench_scene(const SceneFile& file, const LoadedVessel* vessel,
                            const fs::path& folder) {
  simulate::Scene scene = *file.bench;
  if (vessel) scene.vessel = vessel->model.get();
  const simulate::SceneResult result = simulate::run_scene(scene);

  std::vector<simulate::WireContact> contacts;
  if (vessel) {
    for (const simulate::Touch& touch : result.contacts) {
      contacts.push_back(simulate::contact_of(touch, scene.wire.radius, vessel->model->locator));
    }
    write_forces(*vessel, kForce, sum_by_triangle(contacts), folder);
  }
  write_result(result_json(result, contacts), file, vessel, {}, folder);
  preprocess::write_polyline(result.nodes, {}, folder / "wire.vtp");
  write_wire_picture(vessel, {},
                     {{.name = scene.wire.name + ": " + outcome_name(result.outcome),
                       .nodes = result.nodes,
                       .contact_force = {},
                       .radius = scene.wire.radius}},
                     {.title = file.name}, folder);

  const Vec3 tip = result.nodes.col(result.nodes.cols() - 1);
  return {
      result.outcome == simulate::SceneOutcome::kConverged,
      std::string(outcome_name(result.outcome)) +
          format(": tip (%.4f, %.4f, %.4f) mm, residual %.2g N, %d iterations", tip.x(), tip.y(),
                 tip.z(), result.residual, result.iterations) +
          (result.crossing ? "; " + simulate::describe_crossing(*result.crossing, scene.wire.radius)
                           : "") +
          (result.reason.empty() ? "" : "; " + result.reason)};
}

/// How the equilibrium lies to the line that the wire started from.
std::string tell_start(const Json& start) {
  const Json& distance = start.at("distance_mm");
  if (distance.is_null()) return "";
  return format(
             "\nstart: the nearest equilibrium lies %.2f mm from the line on average, %.2f mm at "
             "most, its tip %.2f mm",
             distance.at("mean").get<double>(), distance.at("largest").get<double>(),
             distance.at("tip").get<double>()) +
         (start.at("roll_found").get<bool>() ? format("; the hub's roll is %.1f deg by the line",
                                                      start.at("roll_deg").get<double>())
                                             : std::string());
}

SceneAnswer run_tools(const SceneFile& file, const LoadedVessel* vessel, const fs::path& folder) {
  simulate::ToolScene scene = file.tools->scene;
  if (vessel) scene.vessel = vessel->model.get();
  const double start = thread_cpu_seconds();
  const simulate::ToolSceneResult result = simulate::run_tool_scene(scene);
  const double seconds = thread_cpu_seconds() - start;
  std::vector<simulate::WireContact> contacts;
  if (vessel) {
    double radius = 0.0;  // of the thickest tool, which contacts count from
    for (const simulate::Tool& tool : scene.tools) radius = std::max(radius, tool.wire.radius);
    for (const simulate::Touch& touch : result.contacts) {
      contacts.push_back(
          simulate::contact_of(touch, radius - touch.thinner, vessel->model->locator));
    }
    write_forces(*vessel, kForce, sum_by_triangle(contacts), folder);
  }
  const Shifts& shifts = result.shapes.back().sections;
  write_result(result_json(result, scene, contacts, file.tools->roll_zero, seconds), file, vessel,
               shifts, folder);
  if (vessel) write_vessel(*vessel, result.shapes, folder);
  std::vector<PictureWire> drawn;
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const simulate::Wire& tool = scene.tools[i].wire;
    write_tool_shapes(result.shapes, i, "shapes-" + tool.name, folder);
    const Eigen::Matrix3Xd& nodes = result.tool_nodes[i];
    if (nodes.cols() < 2 || !nodes.allFinite()) continue;  // it is not out of the introducer
    preprocess::write_polyline(nodes, {}, folder / (tool.name + ".vtp"));
    drawn.push_back({.name = tool.name,
                     .nodes = nodes,
                     .contact_force = {},
                     .radius = tool.radius,
                     .color = wire_color(static_cast<int>(i))});
  }
  std::string line = outcome_name(result.outcome);
  write_wire_picture(vessel, shifts, drawn,
                     {.title = file.name + ": " + line, .access = scene.point}, folder);
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    const simulate::ToolReport& tool = result.history.back().tools[i];
    line += format("%s %s %.1f mm in, tip (%.4f, %.4f, %.4f) mm, pushed by %.4g N",
                   i == 0 ? ":" : ";", scene.tools[i].wire.name.c_str(), tool.place.insertion,
                   tool.tip.x(), tool.tip.y(), tool.tip.z(), tool.push_force);
  }
  if (!result.reason.empty()) line += "\n" + result.reason;
  return {result.outcome == simulate::SceneOutcome::kConverged, line};
}

/// `support_fit` is what a measured wire told of the vessel's support, or null.
SceneAnswer run_insertion_scene(const SceneFile& file, const InsertionScene& scene,
                                const LoadedVessel& vessel, const Json& support_fit,
                                const fs::path& folder) {
  fs::create_directories(folder);
  const double start = thread_cpu_seconds();
  simulate::TrialResult result = run_hand(scene, *vessel.model, scene.options);
  const double seconds = thread_cpu_seconds() - start;
  for (simulate::PushTerms& terms : result.push_terms) terms.tip_roll -= scene.roll_zero;
  if (!scene.has_target && result.outcome == simulate::Outcome::kMissed) {
    result.reason = (!scene.moves.empty() ? "all moves were made"
                     : scene.start        ? "the wire went from its start to where it was to go"
                                   : format("all %.1f mm of wire went in", scene.options.length)) +
                    "; the scene has no target" + simulate::describe_balance(result.pushes);
  }
  for (const auto& [from, to] : result.stuck) {
    result.reason +=
        format("; the tip did not advance from %.1f mm of insertion to %.1f mm", from, to);
  }

  if (result.crossing && result.outcome != simulate::Outcome::kCrossesItself) {
    result.reason += "; " + simulate::describe_crossing(*result.crossing, scene.wire.radius);
  }
  const Sensitivity sensitivity = check_sensitivity(scene, *vessel.model, result);
  Json json = result_json(result, scene.options.record_every, seconds);
  if (scene.start) {
    json["start"] = start_json(result, *scene.start, scene.introducer.point, scene.roll_zero);
  }
  json["sensitivity"] = sensitivity.json;
  if (!sensitivity.reason.empty()) json["sensitivity_reason"] = sensitivity.reason;
  if (!support_fit.is_null()) json["support_fit"] = support_fit;
  const std::string told = scene.start ? tell_start(json.at("start")) : "";
  write_result(std::move(json), file, &vessel, result.sections, folder);
  write_forces(vessel, kPeakForce, result.peak_forces, folder);
  preprocess::write_polyline(result.nodes, {}, folder / "wire.vtp");
  write_shapes(result, "shapes", folder);
  write_vessel(vessel, result.shapes, folder);
  PictureWire wire{.name = scene.wire.name + ": " + outcome_name(result.outcome),
                   .nodes = result.nodes,
                   .contact_force = {},
                   .radius = scene.wire.radius};
  if (!result.shapes.empty() && result.shapes.back().nodes.cols() == result.nodes.cols()) {
    wire.contact_force = result.shapes.back().contact_force;
  }
  PictureMarks marks{.title = file.name, .access = scene.introducer.point};
  if (scene.has_target) {
    marks.target = scene.goal.point;
    marks.target_radius = scene.goal.radius;
  }
  write_wire_picture(&vessel, result.sections, {wire}, marks, folder);

  std::string line = outcome_name(result.outcome);
  if (!result.pushes.empty()) {
    const simulate::Push& last = result.pushes.back();
    line += format(": %.1f mm in, tip (%.4f, %.4f, %.4f) mm, residual %.2g N", last.insertion,
                   last.tip.x(), last.tip.y(), last.tip.z(), last.residual);
  }
  if (!result.reason.empty()) line += "; " + result.reason;
  line += told;
  if (!sensitivity.warning.empty()) line += "\n" + sensitivity.warning;
  return {result.outcome != simulate::Outcome::kNotConverged &&
              result.outcome != simulate::Outcome::kFailed,
          line};
}

/// One result per roll, in folders named by it; the vessel is the same.
SceneAnswer run_rolls(const SceneFile& file, const LoadedVessel& vessel, const fs::path& folder) {
  SceneAnswer all{.solved = true, .line = {}};
  for (const double roll : file.insertion->rolls) {
    InsertionScene scene = *file.insertion;
    scene.introducer.roll = roll;
    const std::string name = roll_name(*file.insertion, roll);
    const SceneAnswer one = run_insertion_scene(file, scene, vessel, nullptr, folder / name);
    all.solved = all.solved && one.solved;
    all.line += (all.line.empty() ? "" : "\n") + name + ": " + one.line;
  }
  return all;
}

/// With the support that explains the measured wire best.
SceneAnswer run_measured(const SceneFile& file, LoadedVessel& vessel, const fs::path& folder) {
  const InsertionScene& scene = *file.insertion;
  const SceneSupport found = find_scene_support(scene, file.vessel->wall, vessel.tree,
                                                vessel.wall.young_modulus, *vessel.model);
  SceneFile fitted = file;
  WallInput& wall = fitted.vessel->wall;
  wall.support = found.support;
  vessel.model->sections =
      make_section_chain(wall, vessel.tree, entry_of(file), vessel.wall.young_modulus);
  SceneAnswer answer = run_insertion_scene(fitted, scene, vessel, found.json, folder);
  answer.line += "\n" + found.line;
  return answer;
}

/// Takes the results of an earlier scene out of the folder, which would be taken for those of this
/// one where it writes them elsewhere, or is stopped.
void remove_results(const fs::path& folder) {
  constexpr const char* kResult = "result.json";
  std::vector<fs::path> old = {folder / kResult};
  std::error_code unknown;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, unknown)) {
    const bool of_roll = entry.path().filename().string().starts_with(kRollFolder);
    if (of_roll && entry.is_directory()) old.push_back(entry.path() / kResult);
  }
  for (const fs::path& file : old) {
    if (read_if_there(file).find("\"wireplan.result/") == std::string::npos) continue;  // no result
    fs::remove(file, unknown);
    if (unknown)
      throw DiskError(file.string() + ": an earlier result cannot be removed (" +
                      unknown.message() + "); check its permissions");
  }
}

}  // namespace

std::vector<std::string> check_scene_vessel(const SceneFile& scene) {
  if (!scene.vessel) return {};
  const SceneSurface read = read_scene_surface(scene);
  std::vector<std::string> lines = read.entry;
  for (const std::string& line : read.mended) lines.push_back("mended: " + line);
  return lines;
}

SceneAnswer run_scene_file(const SceneFile& scene, const fs::path& folder) {
  std::optional<LoadedVessel> vessel;
  if (scene.vessel) vessel = load_vessel(scene);
  fs::create_directories(folder);
  remove_results(folder);
  if (scene.tools) return run_tools(scene, vessel ? &*vessel : nullptr, folder);
  if (scene.bench) return run_bench_scene(scene, vessel ? &*vessel : nullptr, folder);
  if (!scene.insertion->rolls.empty()) return run_rolls(scene, *vessel, folder);
  if (scene.insertion->measured) return run_measured(scene, *vessel, folder);
  return run_insertion_scene(scene, *scene.insertion, *vessel, nullptr, folder);
}

}  // namespace wireplan::pipeline
