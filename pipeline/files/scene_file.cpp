#include "pipeline/files/scene_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "pipeline/files/catalogue.h"
#include "pipeline/files/hand_file.h"
#include "pipeline/files/json_reader.h"
#include "pipeline/files/markups_file.h"
#include "pipeline/files/tool_scene_file.h"

namespace wireplan::pipeline {
namespace {

constexpr const char* kSceneSchema = "wireplan.scene/1";
constexpr Range kAboveZero{.min = 0.0, .open_min = true};
constexpr Range kFromZero{.min = 0.0};

/// A stiffness given as such or as the paper's coefficient, whose value depends on the edge length.
struct StiffnessKeys {
  const char* value;
  const char* coefficient;
};
constexpr StiffnessKeys kBend{"bending_stiffness_n_mm2", "bend_coefficient_n_per_m"};
constexpr StiffnessKeys kStretch{"axial_stiffness_n", "stretch_coefficient_n_per_m3"};

/// Tells where both forms are given, or a required one in neither; true if there is one to read.
bool check_one_form(JsonReader& reader, const StiffnessKeys& keys, bool required) {
  const bool has_value = reader.has(keys.value), has_coefficient = reader.has(keys.coefficient);
  if (has_value && has_coefficient) {
    reader.problems().add(reader.path_of(keys.coefficient), "given twice",
                          std::string("one of it and ") + keys.value);
  } else if (required && !has_value && !has_coefficient) {
    reader.problems().add(reader.path_of(keys.value), "missing",
                          std::string("a number above 0, or ") + keys.coefficient);
  }
  return has_value != has_coefficient;
}

/// The section, with the paper's coefficients left to convert once the wire's length is known.
struct SectionInput {
  simulate::Section section;
  double radius = 0.0;               // [mm]
  double bend_coefficient = 0.0;     // k_b; 0 where EI is given                          [N/m]
  double stretch_coefficient = 0.0;  // k_s; 0 where EA is given                          [N/m^3]
  double element_length = 0.0;       // 0: as the wire's number of elements gives         [mm]
};

/// A strip has no stiffnesses of a round rod to fall back on.
void check_strip(JsonReader& reader, const SectionInput& input) {
  const auto refuse_default = [&](const char* key, double value) {
    if (value > 0.0) return;
    reader.problems().add(reader.path_of(key), reader.has(key) ? "0" : "missing",
                          "a number above 0",
                          "with bending_stiffness_2_n_mm2 the wire is a strip, and there is no "
                          "solid round rod to take it from");
  };
  if (input.section.tapered()) {
    reader.problems().add(reader.path_of(kBend.value), reader.raw(kBend.value).dump(), "a number",
                          "with bending_stiffness_2_n_mm2 the wire is a strip, which cannot taper");
  }
  refuse_default(kStretch.value, input.section.axial_stiffness + input.stretch_coefficient);
  refuse_default("twist_stiffness_n_mm2", input.section.twist_stiffness);
}

SectionInput read_section(JsonReader& reader, bool is_tip) {
  SectionInput input;
  simulate::Section& section = input.section;
  section.length = reader.number("length_mm", std::nullopt, kAboveZero);
  if (reader.has("tip_load_gf")) {
    read_bending(reader, is_tip, section);
  } else if (check_one_form(reader, kBend, true)) {
    if (reader.has(kBend.coefficient)) {
      input.bend_coefficient = reader.number(kBend.coefficient, std::nullopt, kAboveZero);
    } else {
      read_bending(reader, is_tip, section);
    }
  }
  if (check_one_form(reader, kStretch, false)) {
    const bool raw = reader.has(kStretch.coefficient);
    (raw ? input.stretch_coefficient : section.axial_stiffness) =
        reader.number(raw ? kStretch.coefficient : kStretch.value, std::nullopt, kFromZero);
  }
  section.twist_stiffness = reader.number("twist_stiffness_n_mm2", 0.0, kFromZero);
  if (reader.has("bending_stiffness_2_n_mm2")) {
    section.bending_stiffness_2 =
        reader.number("bending_stiffness_2_n_mm2", std::nullopt, kAboveZero);
    check_strip(reader, input);
  }
  section.mass_per_length = reader.number("mass_kg_per_m", 0.0, kFromZero) * kTonnePerMmFromKgPerM;
  section.rest_curvature =
      reader.number("rest_curvature_per_mm", 0.0, {.min = 0.0, .max = 2.0}, "given in 1/m?");
  if (reader.has("element_length_mm")) {
    input.element_length = reader.number("element_length_mm", std::nullopt, kAboveZero);
  }
  input.radius =
      reader.number("radius_mm", std::nullopt, {.min = 0.001, .max = 10.0}, "given in m?");
  reader.finish();
  return input;
}

/// Of the file, or of the folder where the file is scene.json.
std::string scene_name(const std::filesystem::path& file) {
  const std::filesystem::path absolute = std::filesystem::absolute(file).lexically_normal();
  return file.filename() == "scene.json" ? absolute.parent_path().filename().string()
                                         : file.stem().string();
}

constexpr int kMaxElements = 20000;

/// How finely each section is cut. What has no length of its own is as long as `elements` say.
void read_elements(JsonReader& reader, const std::vector<SectionInput>& sections,
                   simulate::Scene& scene) {
  const auto has_length = [](const SectionInput& input) { return input.element_length > 0.0; };
  const bool all = !sections.empty() && std::all_of(sections.begin(), sections.end(), has_length);
  if (!all) {
    scene.elements = reader.integer("elements", std::nullopt, 2, kMaxElements);
  } else if (reader.has("elements")) {
    reader.problems().add(reader.path_of("elements"), "given", "no such key",
                          "every section has an element_length_mm");
  }
  if (std::none_of(sections.begin(), sections.end(), has_length)) return;
  double count = 0.0;
  for (std::size_t k = 0; k < sections.size(); ++k) {
    scene.element_length.push_back(sections[k].element_length);
    count += sections[k].section.length / simulate::edge_length(scene, k);
  }
  if (!(count > 1.5 && count < kMaxElements + 0.5)) {
    reader.problems().add(reader.path_of("sections"), "of " + Json(count).dump() + " elements",
                          "2 to " + std::to_string(kMaxElements), "change element_length_mm");
  }
}

/// The part of the wire next to its tip.
void cut_to(simulate::Wire& wire, double length) {
  double start = 0.0;
  for (std::size_t k = 0; k < wire.sections.size(); ++k) {
    simulate::Section& section = wire.sections[k];
    const double part = std::min(section.length, length - start);
    start += section.length;
    if (part >= section.length) continue;
    if (section.tapered()) {  // EI at the cut
      const double share = part / section.length,
                   power = section.taper == simulate::Taper::kCone ? 0.25 : 1.0;
      const double tip = std::pow(section.bending_stiffness, power),
                   shaft = std::pow(section.proximal_bending_stiffness, power);
      section.proximal_bending_stiffness = std::pow(tip + share * (shaft - tip), 1.0 / power);
    }
    section.length = part;
    wire.sections.resize(part > 1e-9 ? k + 1 : k);
    return;
  }
}

/// A wire of the catalogue, or its end, in edges of one length. Its friction is its own.
void read_device(JsonReader& reader, simulate::Scene& scene) {
  const Catalogue& known = catalogue();
  const std::string name = reader.text("device", std::nullopt);
  const CatalogueWire* found = find_wire(known, name);
  if (found == nullptr) {
    std::vector<std::string> names;
    for (const CatalogueWire& entry : known.wires) names.push_back(entry.wire.name);
    const std::string nearest = nearest_name(name, names);
    reader.problems().add(
        "wire.device", "\"" + name + "\"", "a wire of the catalogue",
        nearest.empty() ? "`wireplan devices` lists them" : "did you mean \"" + nearest + "\"?");
    found = &known.wires.front();
  }
  scene.wire = found->wire;
  const double whole = found->wire.length();
  const double length = reader.number("length_mm", whole, {.min = 1.0, .max = whole},
                                      "the catalogue's wire is no longer");
  cut_to(scene.wire, length);
  if (reader.has("friction")) {
    scene.wire.friction = read_friction(reader, 0.0);
  }
  const double edge = reader.number("element_length_mm", 1.0, {.min = 0.05, .max = 20.0});
  scene.elements = static_cast<int>(std::lround(length / edge));
  if (scene.elements >= 2 && scene.elements <= kMaxElements) return;
  reader.problems().add("wire.element_length_mm", Json(edge).dump(),
                        "2 to " + std::to_string(kMaxElements) + " edges along the wire");
  scene.elements = 2;
}

/// The wire and how it is cut and twisted, in an otherwise empty scene.
simulate::Scene read_wire_of_scene(JsonReader& root) {
  JsonReader reader = root.object("wire", true);
  simulate::Scene scene;
  const bool is_device = reader.has("device");
  if (is_device) {
    read_device(reader, scene);
  } else {
    scene.wire.name = reader.text("name", "wire");
  }
  const std::string twist = reader.choice("twist", "auto", {"auto", "coupled", "decoupled"});
  scene.twist = twist == "coupled"     ? simulate::Twist::kCoupled
                : twist == "decoupled" ? simulate::Twist::kDecoupled
                                       : simulate::Twist::kAuto;
  if (is_device) {
    reader.finish();
    return scene;
  }
  std::vector<SectionInput> sections;
  for (JsonReader& section : reader.objects("sections", true)) {
    sections.push_back(read_section(section, sections.empty()));
    scene.wire.sections.push_back(sections.back().section);
  }
  read_elements(reader, sections, scene);
  reader.finish();

  // One wire has one radius here.
  for (const SectionInput& section : sections) {
    if (section.radius == sections.front().radius) continue;
    reader.problems().add("wire.sections", "of several radius_mm", "the same in each",
                          "a changing radius is not in this version");
    break;
  }
  if (!sections.empty()) scene.wire.radius = sections.front().radius;

  // The paper's coefficients are those of edges of one length.
  for (std::size_t k = 0; k < sections.size(); ++k) {
    simulate::Section& section = scene.wire.sections[k];
    const double l = simulate::edge_length(scene, k);
    if (sections[k].bend_coefficient > 0.0) {
      section.bending_stiffness = bending_stiffness_from_paper(sections[k].bend_coefficient, l);
    }
    if (sections[k].stretch_coefficient > 0.0) {
      section.axial_stiffness = axial_stiffness_from_paper(sections[k].stretch_coefficient, l);
    }
  }
  if (scene.twist == simulate::Twist::kDecoupled &&
      !(scene.wire.straight() && scene.wire.round())) {
    root.problems().add("wire.twist", "\"decoupled\"", "\"coupled\" or \"auto\"",
                        "a wire with rest_curvature_per_mm or bending_stiffness_2_n_mm2 bends and "
                        "twists together");
  }
  return scene;
}

/// The supports must hold the wire against rigid motion, or it has no equilibrium.
void check_supports(const std::vector<simulate::Support>& supports, Problems& problems) {
  using simulate::SupportKind;
  int proximal = 0, clamped = 0, pinned = 0;
  for (const simulate::Support& support : supports) {
    proximal += support.at == simulate::WireEnd::kProximal;
    clamped += support.kind == SupportKind::kClamped;
    pinned += support.kind == SupportKind::kPinned;
  }
  const int count = static_cast<int>(supports.size());
  if (count > 2 || (count == 2 && proximal != 1)) {
    problems.add("supports", "several at one end", "one at an end");
  } else if (proximal != 1) {
    problems.add("supports", "without one at the proximal end", "one there",
                 "the wire starts straight from it");
  } else if (clamped == 0 && !(count == 2 && pinned > 0)) {
    problems.add("supports", "not enough to hold the wire",
                 "one clamped end, or a pinned end and a support at the other");
  }
}

/// Counts all rolls from where simulate does: that of the distal support is against the proximal's.
void count_from_anterior(std::vector<simulate::Support>& supports) {
  double zero = 0.0;
  for (const simulate::Support& support : supports) {
    if (support.at == simulate::WireEnd::kProximal) zero = roll_of_anterior(support.direction);
  }
  for (simulate::Support& support : supports) support.roll += zero;
}

simulate::SolverOptions read_solver(JsonReader& root) {
  using simulate::Method;
  JsonReader reader = root.object("solver", false);
  simulate::SolverOptions options;
  const std::string method = reader.choice(
      "method", "newton", {"newton", "conjugate_gradient", "explicit", "semi_implicit"});
  options.method = method == "conjugate_gradient" ? Method::kConjugateGradient
                   : method == "explicit"         ? Method::kExplicitEuler
                   : method == "semi_implicit"    ? Method::kSemiImplicitEuler
                                                  : Method::kNewton;
  options.residual_tolerance =
      reader.number("residual_tolerance_n", options.residual_tolerance, {.min = 1e-14, .max = 1.0});
  options.max_iterations = reader.integer("max_iterations", options.max_iterations, 1, 10000000);
  options.load_steps = reader.integer("load_steps", options.load_steps, 1, 100000);
  options.time_step = reader.number("time_step_s", options.time_step, kAboveZero);
  options.duration = reader.number("duration_s", options.duration, kAboveZero);
  options.damping = reader.number("damping_per_s", options.damping, kFromZero);

  // Keys of other methods.
  const auto refuse_key = [&](const char* key, const std::string& why) {
    if (!reader.has(key)) return;
    reader.problems().add(reader.path_of(key), "given", "no such key with this method", why);
  };
  if (options.method == Method::kNewton) {
    const std::string why = "newton takes no time steps; choose another solver.method";
    refuse_key("time_step_s", why);
    refuse_key("duration_s", why);
    refuse_key("damping_per_s", why);
  } else if (options.load_steps != 1) {
    refuse_key("load_steps", "loads act in full from the first time step");
  }
  if (options.method == Method::kConjugateGradient) {
    refuse_key("damping_per_s", "its viscosity is the time step");
  }
  if (options.method != Method::kNewton && options.duration > 1e9 * options.time_step) {
    reader.problems().add(reader.path_of("duration_s"), Json(options.duration).dump(),
                          "at most 1e9 time steps, " + Json(1e9 * options.time_step).dump() + " s");
  }
  reader.finish();
  return options;
}

constexpr const char* kGiveMass = "give mass_kg_per_m in wire.sections";

/// A distal support that the wire can come to.
void check_reach(const simulate::Scene& scene, Problems& problems) {
  const std::vector<simulate::Support>& supports = scene.supports;
  const double length = scene.wire.length();
  if (supports.size() < 2 || !is_out_of_reach(length, supports[0], supports[1])) return;
  const std::size_t distal = supports[1].at == simulate::WireEnd::kDistal ? 1 : 0;
  problems.add(
      "supports[" + std::to_string(distal) + "].point_mm",
      Json((supports[1].point - supports[0].point).norm()).dump() + " mm from the other support's",
      "no further than the wire is long, " + Json(length).dump() + " mm",
      "it would be torn; move the support, or make the wire longer");
}

/// Loads that the wire, its supports and its twist can carry.
void check_loads(const simulate::Scene& scene, Problems& problems) {
  check_gravity(scene.loads, is_massless(scene.wire), kGiveMass, problems);
  const simulate::Support *proximal = nullptr, *distal = nullptr;
  for (const simulate::Support& support : scene.supports) {
    (support.at == simulate::WireEnd::kProximal ? proximal : distal) = &support;
  }
  const auto directed = [](const simulate::Support* support) {
    return support != nullptr && support->kind != simulate::SupportKind::kPinned;
  };
  if (scene.wire.straight()) {
    check_tip_moment(scene.loads, proximal->direction,
                     "for torsion turn the roll_deg of a support, or give tip_torque_n_mm and "
                     "\"twist\": \"decoupled\"",
                     problems);
  }
  const bool decoupled = scene.twist == simulate::Twist::kDecoupled;
  if (scene.loads.tip_torque != 0.0 && !decoupled) {
    problems.add("loads.tip_torque_n_mm", Json(scene.loads.tip_torque).dump(), "0",
                 "it needs \"decoupled\" in wire.twist; or turn the roll_deg of a support");
  } else if (scene.loads.tip_torque != 0.0 && directed(distal)) {
    problems.add("loads.tip_torque_n_mm", Json(scene.loads.tip_torque).dump(), "0",
                 "the distal support holds the roll already");
  }
  if (decoupled && !directed(proximal)) {
    problems.add("wire.twist", "\"decoupled\"", "a clamped or guided proximal end",
                 "a pinned one does not hold the roll that the chain starts from");
  }
  check_table(scene.plane, scene.supports, problems);
}

/// What methods other than Newton's cannot do.
void check_method(const simulate::Scene& scene, Problems& problems) {
  using simulate::Method;
  const Method method = scene.solver.method;
  if (method == Method::kNewton) return;
  const std::string remedy = "with this solver.method; choose newton";
  if (scene.twist == simulate::Twist::kCoupled) {
    problems.add("wire.twist", "\"coupled\"", "\"auto\" or \"decoupled\"", remedy);
  }
  if (scene.twist == simulate::Twist::kAuto && simulate::twists_the_wire(scene.supports)) {
    problems.add("supports", "of different roll_deg", "the same at both held ends",
                 "with this solver.method; choose newton, or \"twist\": \"decoupled\"");
  }
  if (!scene.wire.straight()) {
    problems.add("wire.sections", "with rest_curvature_per_mm", "a wire straight at rest", remedy);
  }
  if (!scene.wire.round()) {
    problems.add("wire.sections", "with bending_stiffness_2_n_mm2", "a wire as stiff all ways",
                 remedy);
  }
  if (!scene.loads.tip_moment.isZero(0.0)) {
    problems.add("loads.tip_moment_n_mm", to_json(scene.loads.tip_moment).dump(), "[0, 0, 0]",
                 remedy);
  }
  if (scene.plane) problems.add("plane_normal", "given", "no such key", remedy);
  if (method == Method::kConjugateGradient) return;
  for (std::size_t k = 0; k < scene.wire.sections.size(); ++k) {
    if (scene.wire.sections[k].mass_per_length > 0.0) continue;
    problems.add("wire.sections[" + std::to_string(k) + "].mass_kg_per_m", "0", "a number above 0",
                 "the Euler schemes move masses");
  }
}

/// Where the wire lies in a vessel.
void add_vessel(const SceneVessel& vessel, simulate::Scene& scene, Problems& problems) {
  scene.contact.friction = vessel.friction;
  scene.contact.spacing = vessel.contact_spacing;
  scene.contact.law = vessel.contact_law;
  if (scene.solver.method != simulate::Method::kNewton) {
    problems.add("solver.method", "not \"newton\"", "\"newton\"",
                 "the paper's own methods know no vessel in this version");
  }
  if (scene.twist == simulate::Twist::kDecoupled) {
    problems.add("wire.twist", "\"decoupled\"", "\"coupled\" or \"auto\"",
                 "beside a vessel the paper's chain is not in this version");
  }
}

simulate::Scene read_bench(JsonReader& root, simulate::Scene scene,
                           const std::optional<SceneVessel>& vessel) {
  for (JsonReader& support : root.objects("supports", true)) {
    scene.supports.push_back(read_support(support));
  }
  if (root.problems().empty()) check_supports(scene.supports, root.problems());
  // The decoupled chain has no directions, and tells its rolls as they were given.
  if (scene.twist != simulate::Twist::kDecoupled) count_from_anterior(scene.supports);
  scene.loads = read_loads(root);
  if (root.has("plane_normal")) scene.plane = root.direction("plane_normal", std::nullopt);
  scene.solver = read_solver(root);
  if (vessel) add_vessel(*vessel, scene, root.problems());
  if (root.problems().empty()) {
    check_reach(scene, root.problems());
    check_loads(scene, root.problems());
    check_method(scene, root.problems());
  }
  return scene;
}

SceneVessel read_vessel(JsonReader& root, const std::filesystem::path& folder) {
  SceneVessel vessel;
  JsonReader reader = root.object("vessel", true);
  JsonReader surface = reader.object("surface", true);
  vessel.surface = read_surface_input(surface, folder);
  surface.finish();
  JsonReader wall = reader.object("wall", false);
  vessel.wall = read_wall(wall, "rigid");
  wall.finish();
  vessel.friction = read_friction(reader, vessel.friction);
  vessel.contact_spacing =
      reader.number("contact_spacing_mm", vessel.contact_spacing, {.min = 0.01, .max = 20.0});
  reader.finish();
  return vessel;
}

/// The target of a scene, which need not have one.
simulate::Goal read_goal(JsonReader& root, const simulate::Introducer& introducer) {
  constexpr double kFarAway = 1e6;  // [mm]
  simulate::Goal goal{.point = introducer.point - kFarAway * introducer.direction, .radius = 1.0};
  if (!root.has("target")) return goal;
  JsonReader target = root.object("target", true);
  goal.point = target.point("point_mm", std::nullopt);
  goal.radius = target.number("radius_mm", simulate::Goal().radius, kAboveZero);
  target.finish();
  return goal;
}

/// A support is sought only of a vessel that has one, for a wire that goes in as it was measured.
void check_fit(JsonReader& root, const SceneVessel& vessel) {
  if (!vessel.wall.support) {
    root.problems().add("vessel.wall.support_kpa_per_mm", "null",
                        "a number, since the scene has \"measured\"",
                        "it is sought from 0.01 to 100; give 1");
  }
  if (root.has("target")) {
    root.problems().add("target", "given beside measured", "no such key", "a trial ends there");
  }
}

InsertionScene read_insertion_scene(JsonReader& root, const simulate::Scene& wire,
                                    const SceneVessel& vessel) {
  InsertionScene scene;
  scene.wire = wire.wire;
  if (wire.twist != simulate::Twist::kAuto) {
    root.problems().add("wire.twist", "given", "\"auto\"",
                        "in a vessel the twist of curved wires is coupled, and that of straight "
                        "ones has no effect");
  }
  refuse(root, "supports", "supports beside the introducer are");
  refuse(root, "plane_normal", "tables in a vessel are");
  const simulate::Loads loads = read_loads(root);
  if (!loads.tip_force.isZero(0.0) || !loads.tip_moment.isZero(0.0) || loads.tip_torque != 0.0) {
    root.problems().add("loads", root.raw("loads").dump(), "none but 0, and gravity",
                        "forces and moments on a wire in a vessel are not in this version");
  }
  check_gravity(loads, is_massless(scene.wire), kGiveMass, root.problems());
  scene.options.gravity = loads.gravity;
  read_hand(root, scene);

  // How finely.
  const auto elements = static_cast<std::size_t>(simulate::edge_lengths(wire).size());
  if (root.problems().empty() && elements < simulate::kFewestElements) {
    root.problems().add(
        "wire", "of " + std::to_string(elements) + " elements",
        "at least " + std::to_string(simulate::kFewestElements) + " of a wire that is pushed in",
        "give more elements, or a smaller element_length_mm");
  }
  const simulate::SolverOptions solver = read_solver(root);
  if (solver.method != simulate::Method::kNewton) {
    root.problems().add("solver.method", "not \"newton\"", "\"newton\"",
                        "the paper's own methods work on the bench alone in this version");
  } else if (solver.load_steps != 1) {
    root.problems().add("solver.load_steps", std::to_string(solver.load_steps), "1",
                        "of a wire that is pushed in; insertion.step_mm says in which steps");
  }
  scene.options.element_length = wire.wire.length() / wire.elements;
  scene.options.section_element_length = wire.element_length;
  scene.options.contact_spacing = vessel.contact_spacing;
  scene.options.contact_law = vessel.contact_law;
  scene.options.friction = vessel.friction;
  scene.options.residual_tolerance = solver.residual_tolerance;
  scene.options.max_iterations = solver.max_iterations;
  scene.options.record_terms = true;
  if (root.has("check_sensitivity")) {
    scene.check_sensitivity = root.boolean("check_sensitivity", true);
  }
  scene.has_target = root.has("target");
  if (scene.measured) check_fit(root, vessel);
  scene.goal = read_goal(root, scene.introducer);
  return scene;
}

/// Of a bench with one wire.
void refuse_support(const SceneVessel& vessel, Problems& problems) {
  if (!vessel.wall.support) return;
  problems.add(
      "vessel.wall.support_kpa_per_mm", number_text(*vessel.wall.support / kMpaPerKpa),
      "null, where no wire is pushed in",
      "cross-sections move under a wire with \"insertion\", or under \"tools\"; delete the key, or "
      "give one of them");
}

}  // namespace

double axial_stiffness_from_paper(double stretch_coefficient, double edge_length) {
  const double h = edge_length / kMmPerM;  // [m]
  return 2.0 * stretch_coefficient * h * h * h;
}

double bending_stiffness_from_paper(double bend_coefficient, double edge_length) {
  const double h = edge_length / kMmPerM;                   // [m]
  return bend_coefficient * h * h * h * kMmPerM * kMmPerM;  // N m^2 -> N mm^2
}

SceneFile read_scene(const std::filesystem::path& path) {
  SceneFile scene;
  scene.file = path;
  scene.name = scene_name(path);
  Json file = read_json(path, kSceneSchema);
  Problems problems(path.string());
  resolve_scene_points(file, path.parent_path(), problems);
  JsonReader root(file, "", problems);
  root.text("schema", std::nullopt);
  if (root.has("tools")) {
    scene.tools = read_tool_bench(root);
    if (root.has("vessel")) {
      scene.vessel = read_vessel(root, path.parent_path());
      simulate::ContactOptions& contact = scene.tools->scene.contact;
      contact.friction = scene.vessel->friction;
      contact.law = scene.vessel->contact_law;
      refuse_contact_spacing(file["vessel"], problems);
    } else {
      refuse_frictions(file["tools"], problems);
    }
    root.finish();
    problems.throw_if_any();
    return scene;
  }
  const simulate::Scene wire = read_wire_of_scene(root);

  // An insertion has a vessel; a bench may have one.
  const bool inserted = root.has("insertion");
  if (inserted || root.has("vessel")) scene.vessel = read_vessel(root, path.parent_path());
  if (scene.vessel && wire.wire.friction) {
    if (file["vessel"].contains("friction")) {
      problems.add("vessel.friction", Json(scene.vessel->friction).dump(), "no such key",
                   "the wire has its own; give wire.friction for another");
    }
    scene.vessel->friction = *wire.wire.friction;
  }
  if (inserted) {
    scene.insertion = read_insertion_scene(root, wire, *scene.vessel);
    JsonReader output = root.object("output", false);
    double& every = scene.insertion->options.record_every;
    every = output.number("every_mm", every, {.min = 0.001, .max = 1e4});
    output.finish();
  } else {
    refuse(root, "output", "histories of a bench are");
    if (scene.vessel) {
      refuse_support(*scene.vessel, problems);
    } else {
      refuse_friction(file["wire"], "wire", problems);
    }
    scene.bench = read_bench(root, wire, scene.vessel);
  }
  root.finish();
  problems.throw_if_any();
  return scene;
}

}  // namespace wireplan::pipeline
