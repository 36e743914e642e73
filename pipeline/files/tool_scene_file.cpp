#include "pipeline/files/tool_scene_file.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "pipeline/files/case_file.h"
#include "pipeline/files/catalogue.h"
#include "pipeline/files/hand_file.h"
#include "pipeline/files/wire_file.h"

namespace wireplan::pipeline {
namespace {

constexpr Range kMoreThanZero{.min = 0.0, .open_min = true};
constexpr Range kZeroOrMore{.min = 0.0};
constexpr double kLeastInsertion = 1.0;  // of the foremost tool                          [mm]

std::string in_quotes(const std::string& text) { return "\"" + text + "\""; }

std::string mm(double value) { return Json(value).dump(); }

simulate::Section read_tool_section(JsonReader& reader, bool is_tip) {
  simulate::Section section;
  section.length = reader.number("length_mm", std::nullopt, kMoreThanZero);
  read_bending(reader, is_tip, section);
  section.axial_stiffness = reader.number("axial_stiffness_n", 0.0, kZeroOrMore);
  section.twist_stiffness = reader.number("twist_stiffness_n_mm2", 0.0, kZeroOrMore);
  section.mass_per_length =
      reader.number("mass_kg_per_m", 0.0, kZeroOrMore) * kTonnePerMmFromKgPerM;
  section.rest_curvature =
      reader.number("rest_curvature_per_mm", 0.0, {.min = -2.0, .max = 2.0}, "given in 1/m?");
  reader.finish();
  return section;
}

/// A wire or a catheter of the catalogue.
void read_known_tool(JsonReader& reader, simulate::Tool& tool) {
  const Catalogue& known = catalogue();
  const std::string name = reader.text("device", std::nullopt);
  if (const CatalogueWire* wire = find_wire(known, name); wire != nullptr) {
    tool.wire = wire->wire;
    return;
  }
  for (const Catheter& catheter : known.catheters) {
    if (catheter.tube.name != name) continue;
    tool.wire = catheter.tube;
    tool.inner_radius = 0.5 * catheter.inner_diameter;
    return;
  }
  std::vector<std::string> names;
  for (const CatalogueWire& wire : known.wires) names.push_back(wire.wire.name);
  for (const Catheter& catheter : known.catheters) names.push_back(catheter.tube.name);
  const std::string nearest = nearest_name(name, names);
  const bool sheath = std::any_of(known.sheaths.begin(), known.sheaths.end(),
                                  [&](const Sheath& one) { return one.name == name; });
  reader.problems().add(
      reader.path_of("device"), in_quotes(name), "a wire or catheter of the catalogue",
      sheath ? "of sheaths it knows no stiffness; give name, outer_diameter_mm, inner_diameter_mm "
               "and sections"
      : nearest.empty() ? "`wireplan devices` lists them"
                        : "did you mean " + in_quotes(nearest) + "?");
  tool.wire = known.wires.front().wire;
}

void read_own_tool(JsonReader& reader, simulate::Tool& tool) {
  const Range diameter{.min = 0.002, .max = 20.0};
  tool.wire.radius =
      0.5 * reader.number("outer_diameter_mm", std::nullopt, diameter, "given in m?");
  const double inner = reader.number("inner_diameter_mm", 0.0, kZeroOrMore);
  if (inner >= 2.0 * tool.wire.radius && inner > 0.0) {
    reader.problems().add(reader.path_of("inner_diameter_mm"), mm(inner),
                          "less than outer_diameter_mm, " + mm(2.0 * tool.wire.radius));
  }
  tool.inner_radius = 0.5 * inner;
  for (JsonReader& section : reader.objects("sections", true)) {
    tool.wire.sections.push_back(read_tool_section(section, tool.wire.sections.empty()));
  }
}

void read_tool(JsonReader& reader, ToolBenchScene& into) {
  simulate::Tool tool;
  const bool known = reader.has("device");
  known ? read_known_tool(reader, tool) : read_own_tool(reader, tool);
  tool.wire.name = reader.file_name(
      "name", known ? std::optional<std::string>(tool.wire.name) : std::optional<std::string>());
  simulate::ToolPlace place;
  place.insertion = reader.number("insertion_mm", std::nullopt, kZeroOrMore);
  place.roll = into.roll_zero +
               reader.number("roll_deg", 0.0, {.min = -36000.0, .max = 36000.0}) * kRadPerDeg;
  if (!tool.wire.round()) {
    reader.problems().add(reader.path_of("device"), "a strip somewhere", "round all along",
                          "strips in other tools are not in this version");
  }
  if (reader.has("friction")) tool.wire.friction = read_friction(reader, 0.0);
  reader.finish();
  into.scene.tools.push_back(std::move(tool));
  into.scene.places.push_back(place);
}

/// Each tool in the one before it.
void check_stack(const ToolBenchScene& bench, Problems& problems) {
  const std::vector<simulate::Tool>& tools = bench.scene.tools;
  if (tools.empty()) return;  // told already
  if (tools.size() > simulate::kMostTools) {
    problems.add("tools", "of " + std::to_string(tools.size()),
                 "1 to " + std::to_string(simulate::kMostTools) + ", from the outside in");
    return;
  }
  std::set<std::string> names;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const std::string key = "tools[" + std::to_string(i) + "]";
    if (!names.insert(tools[i].wire.name).second) {
      problems.add(key + ".name", in_quotes(tools[i].wire.name), "a name that no other tool has");
    }
    if (i == 0 || tools[i].wire.radius < tools[i - 1].inner_radius) continue;
    const double lumen = 2.0 * tools[i - 1].inner_radius;
    problems.add(key, mm(2.0 * tools[i].wire.radius) + " mm thick",
                 lumen > 0.0
                     ? "less than the inner diameter of " + in_quotes(tools[i - 1].wire.name) +
                           " round it, " + mm(lumen) + " mm"
                     : "an inner_diameter_mm of " + in_quotes(tools[i - 1].wire.name) + " round it",
                 "tools are listed from the outside in");
  }
}

/// One line of a move into it.
void read_one_move(JsonReader& reader, const ToolBenchScene& bench, simulate::ToolMove& move) {
  const std::vector<simulate::Tool>& tools = bench.scene.tools;
  const std::string name = reader.text("tool", std::nullopt);
  const std::size_t before = reader.problems().count();
  const double push = reader.number("push_mm", 0.0, {.min = -1e4, .max = 1e4}, "given in m?");
  const double turn = reader.number("turn_deg", 0.0, {.min = -36000.0, .max = 36000.0});
  if (reader.has("pull_mm")) {
    reader.problems().add(reader.path_of("pull_mm"), reader.raw("pull_mm").dump(), "no such key",
                          "a push_mm below 0 pulls");
  }
  const auto found = std::find_if(tools.begin(), tools.end(), [&](const simulate::Tool& tool) {
    return tool.wire.name == name;
  });
  if (found == tools.end()) {
    std::vector<std::string> names;
    for (const simulate::Tool& tool : tools) names.push_back(tool.wire.name);
    const std::string nearest = nearest_name(name, names);
    reader.problems().add(reader.path_of("tool"), in_quotes(name), "the name of one of the tools",
                          nearest.empty() ? "" : "did you mean " + in_quotes(nearest) + "?");
  } else {
    const auto i = static_cast<std::size_t>(found - tools.begin());
    if (move.push[i] != 0.0 || move.turn[i] != 0.0) {
      reader.problems().add(reader.path_of("tool"), in_quotes(name), "each tool once in a move");
    }
    if (push == 0.0 && turn == 0.0 && reader.problems().count() == before) {
      reader.problems().add(reader.path_of("push_mm"), "0, and turn_deg too",
                            "one of them other than 0");
    }
    move.push[i] = push;
    move.turn[i] = turn * kRadPerDeg;
  }
  reader.finish();
}

void read_moves(JsonReader& root, ToolBenchScene& bench) {
  const std::size_t count = bench.scene.tools.size();
  for (JsonReader& reader : root.objects("moves", false)) {
    simulate::ToolMove move{std::vector<double>(count, 0.0), std::vector<double>(count, 0.0)};
    if (reader.has("together")) {
      for (JsonReader& one : reader.objects("together", true)) read_one_move(one, bench, move);
      reader.finish();
    } else {
      read_one_move(reader, bench, move);
    }
    bench.scene.moves.push_back(std::move(move));
  }
}

/// No tool leaves the introducer or goes in with its hub, and one of them is always in.
void check_insertions(const ToolBenchScene& bench, Problems& problems) {
  std::vector<simulate::ToolPlace> places = bench.scene.places;
  const auto check = [&](const auto& key_of) {
    double foremost = 0.0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double length = bench.scene.tools[i].wire.length();
      foremost = std::max(foremost, places[i].insertion);
      if (places[i].insertion >= 0.0 && places[i].insertion <= length) continue;
      problems.add(key_of(i), "an insertion of " + mm(places[i].insertion) + " mm",
                   "0 to the length of " + in_quotes(bench.scene.tools[i].wire.name) + ", " +
                       mm(length) + " mm");
      return false;
    }
    const simulate::Support introducer{.point = bench.scene.point};
    if (bench.scene.distal && is_out_of_reach(foremost, introducer, *bench.scene.distal)) {
      const double far = (bench.scene.distal->point - introducer.point).norm();
      problems.add(key_of(0), mm(foremost) + " mm of the foremost tool",
                   "as much as from the introducer to supports[0], " + mm(far) + " mm",
                   "the tools would be torn; push one further in, or move the support");
      return false;
    }
    if (foremost >= kLeastInsertion) return true;
    problems.add(key_of(0), mm(foremost) + " mm of the foremost tool",
                 "at least " + mm(kLeastInsertion) + " mm of it out of the introducer");
    return false;
  };
  const auto at_start = [](std::size_t i) {
    return "tools[" + std::to_string(i) + "].insertion_mm";
  };
  if (!check(at_start)) return;
  for (std::size_t k = 0; k < bench.scene.moves.size(); ++k) {
    places = simulate::moved(bench.scene.tools, std::move(places), bench.scene.moves[k]);
    if (!check([&](std::size_t) { return "moves[" + std::to_string(k) + "]"; })) return;
  }
}

/// What holds the foremost tip; the introducer is the proximal support.
void read_distal(JsonReader& root, simulate::ToolScene& scene) {
  for (JsonReader& reader : root.objects("supports", false)) {
    const simulate::Support support = read_support(reader);
    const std::string at = reader.path_of("at");
    if (support.at != simulate::WireEnd::kDistal || scene.distal) {
      root.problems().add(at, "not the only distal one", "one support, at the distal end",
                          "the introducer holds the tools' proximal ends");
    } else if (support.kind == simulate::SupportKind::kGuided || support.roll != 0.0) {
      root.problems().add(reader.path_of("kind"), "guided, or with a roll_deg",
                          "clamped or pinned, without roll_deg",
                          "of several tools the tip's roll is not held in this version");
    }
    scene.distal = support;
  }
}

/// The tools against what loads and holds them.
void check_held(const ToolBenchScene& bench, Problems& problems) {
  const simulate::ToolScene& scene = bench.scene;
  const auto all = [&](const auto& is) {
    return std::all_of(scene.tools.begin(), scene.tools.end(),
                       [&](const simulate::Tool& tool) { return is(tool.wire); });
  };
  check_gravity(scene.loads, all(is_massless), "give mass_kg_per_m in tools[].sections", problems);
  if (all([](const simulate::Wire& wire) { return wire.straight(); })) {
    check_tip_moment(scene.loads, scene.direction, "for torsion turn a hub in a move", problems);
  }
  std::vector<simulate::Support> supports = {{.at = simulate::WireEnd::kProximal,
                                              .kind = simulate::SupportKind::kClamped,
                                              .point = scene.point,
                                              .direction = scene.direction}};
  if (scene.distal) supports.push_back(*scene.distal);
  check_table(scene.plane, supports, problems);
}

}  // namespace

bool is_massless(const simulate::Wire& wire) {
  return std::all_of(wire.sections.begin(), wire.sections.end(),
                     [](const simulate::Section& s) { return s.mass_per_length == 0.0; });
}

void check_gravity(const simulate::Loads& loads, bool massless, const std::string& remedy,
                   Problems& problems) {
  if (loads.gravity.isZero(0.0) || !massless) return;
  problems.add("loads.gravity_m_per_s2", "not 0", "a wire with a mass", remedy);
}

void check_tip_moment(const simulate::Loads& loads, const Vec3& direction,
                      const std::string& remedy, Problems& problems) {
  const Vec3& moment = loads.tip_moment;
  if (moment.isZero(0.0) || moment.cross(direction).norm() > 1e-9 * moment.norm()) return;
  problems.add("loads.tip_moment_n_mm", "along the wire", "an axis across it", remedy);
}

void check_table(const std::optional<Vec3>& normal, const std::vector<simulate::Support>& supports,
                 Problems& problems) {
  if (!normal) return;
  const auto proximal = std::find_if(
      supports.begin(), supports.end(),
      [](const simulate::Support& one) { return one.at == simulate::WireEnd::kProximal; });
  const bool out = std::any_of(supports.begin(), supports.end(), [&](const simulate::Support& one) {
    return std::abs(normal->dot(one.point - proximal->point)) > 1e-6 ||
           (one.kind != simulate::SupportKind::kPinned &&
            std::abs(normal->dot(one.direction)) > 1e-6);
  });
  if (!out) return;
  problems.add("plane_normal", to_json(*normal).dump(), "a plane that the supports lie in",
               "give a normal square to their directions and to the line between their points");
}

bool is_out_of_reach(double length, const simulate::Support& from, const simulate::Support& to) {
  constexpr double kMostStretch = 0.1;
  Vec3 way = to.point - from.point;
  for (const simulate::Support* one : {&from, &to}) {
    if (one->kind != simulate::SupportKind::kGuided) continue;
    way -= way.dot(one->direction) * one->direction;
  }
  return way.norm() > (1.0 + kMostStretch) * length;
}

ToolBenchScene read_tool_bench(JsonReader& root) {
  ToolBenchScene bench;
  simulate::ToolScene& scene = bench.scene;
  Problems& problems = root.problems();
  JsonReader introducer = root.object("introducer", true);
  scene.point = introducer.point("point_mm", Vec3(Vec3::Zero()));
  scene.direction = introducer.direction("direction", Vec3(Vec3::UnitX()));
  introducer.finish();
  bench.roll_zero = roll_of_anterior(scene.direction);
  for (JsonReader& reader : root.objects("tools", true)) read_tool(reader, bench);
  const bool sound = problems.empty();
  if (sound) check_stack(bench, problems);
  read_moves(root, bench);
  read_distal(root, scene);
  scene.loads = read_loads(root);
  if (scene.loads.tip_torque != 0.0) {
    problems.add("loads.tip_torque_n_mm", mm(scene.loads.tip_torque), "0", "turn a hub in a move");
  }
  if (root.has("plane_normal")) scene.plane = root.direction("plane_normal", std::nullopt);
  scene.friction = root.number("friction_between_tools", 0.0, {.min = 0.0, .max = 1.0});
  scene.element_length =
      root.number("element_length_mm", scene.element_length, {.min = 0.05, .max = 20.0});
  JsonReader solver = root.object("solver", false);
  scene.residual_tolerance =
      solver.number("residual_tolerance_n", scene.residual_tolerance, {.min = 1e-14, .max = 1.0});
  scene.max_iterations = solver.integer("max_iterations", scene.max_iterations, 1, 10000000);
  solver.finish();
  refuse(root, "wire", "a wire beside \"tools\", of which the last one is the wire, is");
  refuse(root, "insertion", "insertions of several tools are");
  refuse(root, "target", "targets of several tools are");
  if (sound && problems.empty()) {
    check_insertions(bench, problems);
    check_held(bench, problems);
  }
  return bench;
}

void read_bending(JsonReader& reader, bool is_tip, simulate::Section& section) {
  constexpr const char *kEI = "bending_stiffness_n_mm2", *kTipLoad = "tip_load_gf";
  section.bending_stiffness = 1.0;  // where what is given cannot be taken
  if (reader.has(kTipLoad)) {
    const double load =
        reader.number(kTipLoad, std::nullopt, {.min = 0.01, .max = 1000.0}, "given in mN or N?");
    section.bending_stiffness = stiffness_of_tip_load(load);
    for (const char* other : {kEI, "bend_coefficient_n_per_m"}) {
      if (!reader.has(other)) continue;
      reader.problems().add(reader.path_of(other), std::string("given beside ") + kTipLoad,
                            "one of them", "each gives the section's EI");
    }
    if (!is_tip || section.length < kTipLoadLength) {
      reader.problems().add(reader.path_of(kTipLoad), mm(load),
                            is_tip ? "a section of at least 10 mm" : "the first section's",
                            "a tip load bends the last 10 mm; give " + std::string(kEI));
    }
    return;
  }
  if (!reader.raw(kEI).is_array()) {
    section.bending_stiffness = reader.number(kEI, std::nullopt, kMoreThanZero);
    return;
  }
  const std::size_t before = reader.problems().count(), given = reader.raw(kEI).size();
  const std::vector<double> ends = reader.numbers(kEI, std::nullopt, kMoreThanZero);
  if (reader.problems().count() > before) return;
  if (given != 2) {
    reader.problems().add(reader.path_of(kEI), reader.raw(kEI).dump(),
                          "a number, or of a taper two: at the tip's end and at the other");
    return;
  }
  section.bending_stiffness = ends[0];
  section.proximal_bending_stiffness = ends[1];
}

simulate::Support read_support(JsonReader& reader) {
  using simulate::SupportKind;
  simulate::Support support;
  support.at = reader.choice("at", std::nullopt, {"proximal", "distal"}) == "proximal"
                   ? simulate::WireEnd::kProximal
                   : simulate::WireEnd::kDistal;
  const std::string kind = reader.choice("kind", std::nullopt, {"clamped", "pinned", "guided"});
  support.kind = kind == "clamped"  ? SupportKind::kClamped
                 : kind == "pinned" ? SupportKind::kPinned
                                    : SupportKind::kGuided;
  support.point = reader.point("point_mm", std::nullopt);
  support.direction = reader.direction("direction", Vec3(Vec3::UnitX()));
  support.roll = reader.number("roll_deg", 0.0, {.min = -36000.0, .max = 36000.0}) * kRadPerDeg;
  if (support.kind == SupportKind::kPinned && support.roll != 0.0) {
    reader.problems().add(reader.path_of("roll_deg"), reader.raw("roll_deg").dump(), "0",
                          "a pinned end turns freely; give \"clamped\" or \"guided\"");
  }
  reader.finish();
  return support;
}

simulate::Loads read_loads(JsonReader& root) {
  JsonReader reader = root.object("loads", false);
  simulate::Loads loads;
  loads.gravity = reader.point("gravity_m_per_s2", Vec3(Vec3::Zero())) * kMmPerM;
  loads.tip_force = reader.point("tip_force_n", Vec3(Vec3::Zero()));
  loads.tip_moment = reader.point("tip_moment_n_mm", Vec3(Vec3::Zero()));
  loads.tip_torque = reader.number("tip_torque_n_mm", 0.0, {});
  reader.finish();
  return loads;
}

void refuse_contact_spacing(const Json& vessel, Problems& problems) {
  if (!vessel.is_object() || !vessel.contains("contact_spacing_mm")) return;
  problems.add("vessel.contact_spacing_mm", vessel["contact_spacing_mm"].dump(), "no such key",
               "tools touch the wall at their nodes; give element_length_mm");
}

void refuse_friction(const Json& tool, const std::string& key, Problems& problems) {
  if (!tool.is_object() || !tool.contains("friction")) return;
  problems.add(key + ".friction", tool["friction"].dump(), "no such key without a \"vessel\"",
               "it is the friction with the wall; delete it, or give a vessel");
}

void refuse_frictions(const Json& tools, Problems& problems) {
  for (std::size_t k = 0; tools.is_array() && k < tools.size(); ++k) {
    refuse_friction(tools[k], "tools[" + std::to_string(k) + "]", problems);
  }
}

}  // namespace wireplan::pipeline
