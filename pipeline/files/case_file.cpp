#include "pipeline/files/case_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <limits>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "pipeline/files/access_limits_file.h"
#include "pipeline/files/case_judging.h"
#include "pipeline/files/case_robustness.h"
#include "pipeline/files/markups_file.h"
#include "preprocess/text.h"

namespace wireplan::pipeline {
namespace {

constexpr const char* kSchema = "wireplan.case/1";
constexpr std::string_view kDataVariable = "${WIREPLAN_DATA}";

std::filesystem::path find_case_file(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return path;
  const std::filesystem::path file = path / "case.json";
  if (!std::filesystem::exists(file)) {
    throw Error(path.string() +
                ": this folder has no case.json (give a case file or a folder that has one)");
  }
  return file;
}

/// Sets the value at a dotted path, making the objects on the way.
void apply_override(Json& root, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos) {
    throw Error("--set " + text + ": expected key=value, such as wall.thickness_mm=2");
  }

  // The value: JSON, and else text.
  const std::string value_text = text.substr(equals + 1);
  Json value = Json::parse(value_text, nullptr, false);
  if (value.is_discarded()) value = value_text;

  // Down the path.
  const std::string key = text.substr(0, equals);
  Json* place = &root;
  for (std::size_t begin = 0; begin <= key.size();) {
    const std::size_t end = std::min(key.find('.', begin), key.size());
    if (!place->is_object() && !place->is_null()) {
      throw Error("--set " + text + ": " + key.substr(0, begin - 1) +
                  " is no object in the case file, so nothing can be set in it (set it whole)");
    }
    place = &(*place)[key.substr(begin, end - begin)];
    begin = end + 1;
  }
  *place = std::move(value);
}

std::string default_name(const std::filesystem::path& file) {
  const std::filesystem::path absolute = std::filesystem::absolute(file).lexically_normal();
  return file.filename() == "case.json" ? absolute.parent_path().filename().string()
                                        : file.stem().string();
}

/// The case's name becomes that of folders, so it holds no path.
std::string read_name(JsonReader& root, const std::filesystem::path& file) {
  const std::string name = root.text("name", default_name(file));
  const bool plain = !name.empty() && name.size() <= kLongestName && name.front() != '.' &&
                     std::all_of(name.begin(), name.end(), [](char c) {
                       return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
                              std::string_view("-_. ").find(c) != std::string_view::npos;
                     });
  if (!plain) {
    root.problems().add("name", "\"" + name + "\"",
                        "at most " + std::to_string(kLongestName) +
                            " letters, digits, spaces, '-', '_' and '.', not starting with '.'",
                        "folders are named after the case");
  }
  return name;
}

VolumeInput read_volume(JsonReader reader, const std::filesystem::path& folder) {
  VolumeInput volume;
  volume.given = reader.text("path", std::nullopt);
  volume.path = resolve_path(volume.given, folder);
  expect_exists(reader, "path", volume.given, volume.path, "an image file or a DICOM folder");
  volume.series = reader.text("series", "");
  reader.finish();
  return volume;
}

/// The entry of the pipeline: a volume, labels or both, or a surface that has a path.
void read_inputs(JsonReader& root, Case& input) {
  const std::filesystem::path folder = input.file.parent_path();
  JsonReader surface = root.object("surface", false);
  input.surface.edge_length_mm = surface.number("edge_length_mm", input.surface.edge_length_mm,
                                                {.min = 0.1, .max = 10.0}, "given in m?");
  const bool has_volume = root.has("volume"), has_labels = root.has("labels");
  bool has_surface = false;
  for (const char* key : {"path", "unit", "frame"}) has_surface |= surface.has(key);
  if (has_volume && has_surface) {
    root.problems().add("surface.path", "given beside volume", "one of the two",
                        "a case enters either at a volume or at a surface");
  } else if (has_labels && has_surface) {
    root.problems().add("surface.path", "given beside labels", "one of the two",
                        "labels are made a surface; delete either");
  } else if (!has_volume && !has_surface && !has_labels) {
    root.problems().add("volume", "missing", "volume.path, labels.path or surface.path",
                        "a case enters at a volume, at labels or at a surface");
  }
  if (has_labels) input.labels = read_labels_input(root.object("labels", true), folder);
  if (has_volume) {
    input.volume = read_volume(root.object("volume", true), folder);
  } else if (has_surface) {
    input.surface_input = read_surface_input(surface, folder);
  }
  surface.finish();
  input.axes_known = root.choice("axes", "patient", {"patient", "unknown"}) == "patient";
}

void read_segmentation(JsonReader& root, Case& input) {
  if (input.labels && root.has("segmentation")) {
    root.problems().add("segmentation", "given beside labels", "none",
                        "labels are the lumen, and no band is looked for; delete either");
    root.raw("segmentation");
    return;
  }
  if (!input.volume) {
    if (root.has("segmentation") && input.surface_input) {
      root.problems().add("segmentation", "given with a surface as input", "none",
                          "only a volume is segmented; delete it");
    }
    return;
  }
  const std::size_t problems_before = root.problems().count();
  JsonReader reader = root.object("segmentation", false);
  const Range band{.min = -1100.0, .max = 65535.0}, length{.min = 0.0, .max = 5.0},
      reach{.min = 10.0, .max = 2000.0};
  const auto given = [&](const std::string& key, Range range) {
    return reader.has(key) ? std::optional<double>(reader.number(key, std::nullopt, range))
                           : std::nullopt;
  };
  preprocess::SegmentOptions& segmentation = input.segmentation;
  segmentation.lower_hu = given("lower_hu", band);
  segmentation.upper_hu = given("upper_hu", band);
  if (segmentation.lower_hu.has_value() != segmentation.upper_hu.has_value()) {
    root.problems().add(segmentation.lower_hu ? "segmentation.upper_hu" : "segmentation.lower_hu",
                        "missing",
                        "both ends of the band, or none: then it is chosen from the volume");
  } else if (segmentation.lower_hu && root.problems().count() == problems_before &&
             *segmentation.lower_hu >= *segmentation.upper_hu) {
    root.problems().add("segmentation.lower_hu", Json(*segmentation.lower_hu).dump(),
                        "less than segmentation.upper_hu, " + Json(*segmentation.upper_hu).dump());
  }
  segmentation.seeds = reader.points("seeds_mm", false);
  segmentation.smoothing_mm = given("smoothing_mm", length);
  segmentation.neck_opening_mm = given("neck_opening_mm", length);
  if (segmentation.lower_hu && reader.has("reach_mm")) {
    root.problems().add("segmentation.reach_mm", "given beside a band",
                        "one of them: a band is followed through the whole volume");
  }
  segmentation.reach_mm = reader.number("reach_mm", segmentation.reach_mm, reach);
  reader.finish();
}

constexpr std::array kManoeuvrings = {std::pair("never", Manoeuvring::kNever),
                                      std::pair("when_needed", Manoeuvring::kWhenNeeded),
                                      std::pair("always", Manoeuvring::kAlways)};

Manoeuvring read_manoeuvring(JsonReader& root) {
  const std::string name =
      root.choice("manoeuvres", "when_needed", {"never", "when_needed", "always"});
  for (const auto& [known, value] : kManoeuvrings) {
    if (name == known) return value;
  }
  return Manoeuvring::kWhenNeeded;  // a problem was noted
}

const char* manoeuvring_name(Manoeuvring value) {
  for (const auto& [name, known] : kManoeuvrings) {
    if (value == known) return name;
  }
  throw LogicError("a Manoeuvring without a name");
}

void read_insertion(JsonReader& root, plan::Study& study) {
  const std::size_t problems_before = root.problems().count();
  JsonReader reader = root.object("insertion", false);
  simulate::InsertionOptions& insertion = study.insertion;
  insertion.length = reader.number("length_mm", 0.0, {.min = 0.0, .max = 3000.0}, "given in m?");
  insertion.step = reader.number("step_mm", insertion.step, {.min = 0.01, .max = 20.0});
  insertion.element_length =
      reader.number("element_length_mm", insertion.element_length, {.min = 0.05, .max = 20.0});
  insertion.contact_spacing =
      reader.number("contact_spacing_mm", insertion.contact_spacing, {.min = 0.05, .max = 20.0});
  insertion.residual_tolerance = reader.number("residual_tolerance_n", insertion.residual_tolerance,
                                               {.min = 1e-12, .max = 1e-2});
  insertion.max_iterations = reader.integer("max_iterations", insertion.max_iterations, 1, 100000);
  insertion.record_every =
      reader.number("record_every_mm", insertion.record_every, {.min = 0.1, .max = 1000.0});
  reader.finish();

  if (insertion.length > 0.0 && insertion.length < 1.0) {
    root.problems().add("insertion.length_mm", Json(insertion.length).dump(), "0 or at least 1",
                        "given in m?");
  }
  if (root.problems().count() > problems_before) return;
  for (const simulate::Wire& wire : study.wires) {
    if (wire.sections.empty() || wire.length() >= insertion.length) continue;
    root.problems().add("insertion.length_mm", Json(insertion.length).dump(),
                        "at most the length of every wire; \"" + wire.name + "\" has " +
                            Json(clean(wire.length())).dump() + " mm",
                        "push in less, or lengthen the wire's last section");
  }
}

Json input_json(const Case& input) {
  Json json;
  if (input.volume) {
    json["volume"] = {{"path", input.volume->given}};
    if (!input.volume->series.empty()) json["volume"]["series"] = input.volume->series;
  }
  if (input.labels) {
    json["labels"] = labels_json(*input.labels);
  } else if (input.volume) {
    const preprocess::SegmentOptions& segmentation = input.segmentation;
    Json seeds = Json::array();
    for (const Vec3& seed : segmentation.seeds) seeds.push_back(to_json(seed));
    const auto value = [](const std::optional<double>& given) {
      return given ? Json(*given) : Json(nullptr);
    };
    json["segmentation"] = {{"lower_hu", value(segmentation.lower_hu)},
                            {"upper_hu", value(segmentation.upper_hu)},
                            {"seeds_mm", seeds},
                            {"smoothing_mm", value(segmentation.smoothing_mm)},
                            {"neck_opening_mm", value(segmentation.neck_opening_mm)}};
    if (!segmentation.lower_hu) json["segmentation"]["reach_mm"] = segmentation.reach_mm;
  }
  if (!input.surface_input) json["mask"] = mask_limits_json(input.mask_limits);
  if (input.surface_input) {
    json["surface"] = {{"path", input.surface_input->given},
                       {"unit", input.surface_input->unit},
                       {"frame", input.surface_input->frame}};
  }
  json["surface"]["edge_length_mm"] = input.surface.edge_length_mm;
  json["axes"] = input.axes_known ? "patient" : "unknown";
  return json;
}

}  // namespace

std::filesystem::path resolve_path(const std::string& given, const std::filesystem::path& folder) {
  std::string text = given;
  const std::size_t variable = text.find(kDataVariable);
  if (variable != std::string::npos) {
    const char* set = std::getenv("WIREPLAN_DATA");
    const std::filesystem::path data =
        set != nullptr
            ? std::filesystem::absolute(set)
            : std::filesystem::path(WIREPLAN_SOURCE_DIR).parent_path() / "shared" / "data";
    text.replace(variable, kDataVariable.size(), data.string());
  }
  const std::filesystem::path path = (folder / text).lexically_normal();
  return path.has_filename() ? path : path.parent_path();  // "folder/" is "folder"
}

std::filesystem::path cases_folder() {
  return std::filesystem::path(WIREPLAN_SOURCE_DIR) / "cases";
}

void expect_exists(JsonReader& reader, const std::string& key, const std::string& given,
                   const std::filesystem::path& path, const std::string& expected) {
  std::error_code unreachable;  // a folder on the way may not be searched: told as absent
  if (given.empty() || std::filesystem::exists(path, unreachable)) return;
  std::string remedy = "relative paths count from the file that gives them";
  if (given.find(kDataVariable) != std::string::npos) {
    const bool is_set = std::getenv("WIREPLAN_DATA") != nullptr;
    remedy = is_set ? "the environment variable WIREPLAN_DATA names the data folder"
                    : "the environment variable WIREPLAN_DATA is not set, so the data folder is "
                      "../shared/data beside the checkout";
  } else if (given.find("${") != std::string::npos) {
    remedy = "${WIREPLAN_DATA} is the only variable of a path";
  }
  reader.problems().add(reader.path_of(key), "\"" + given + "\"", expected + " at " + path.string(),
                        remedy);
}

const std::filesystem::path& input_path(const Case& given) {
  if (given.volume) return given.volume->path;
  return given.surface_input ? given.surface_input->path : given.labels->path;
}

SurfaceInput read_surface_input(JsonReader& reader, const std::filesystem::path& folder) {
  SurfaceInput surface;
  surface.given = reader.text("path", std::nullopt);
  surface.path = resolve_path(surface.given, folder);
  expect_exists(reader, "path", surface.given, surface.path, "a surface file");

  const std::string extension = lower_case(surface.path.extension().string());
  const std::set<std::string> endings = {".stl", ".ply", ".obj", ".vtp"};
  if (!surface.given.empty() && endings.count(extension) == 0) {
    reader.problems().add(reader.path_of("path"), "\"" + surface.given + "\"",
                          "a name that ends in .stl, .ply, .obj or .vtp");
  }

  // No file tells its unit, and few their frame.
  const bool is_vtp = extension == ".vtp";
  using Fallback = std::optional<std::string>;
  surface.unit = reader.choice("unit", is_vtp ? Fallback("mm") : std::nullopt, {"mm", "cm", "m"});
  const std::string told = preprocess::told_frame(surface.path);
  const Fallback fallback = told == "RAS" || told == "LPS" ? Fallback(told)
                            : is_vtp || !told.empty()      ? Fallback("LPS")
                                                           : std::nullopt;
  surface.frame = reader.choice("frame", fallback, {"LPS", "RAS"});
  const bool known = told.empty() || told == "LPS" || told == "RAS";
  if (!known) {
    reader.problems().add(reader.path_of("path"), "\"" + surface.given + "\"",
                          "a surface in LPS or RAS; the file itself says " + told,
                          "turn it in the program that made it, or mend what it says");
  } else if (!told.empty() && surface.frame != told) {
    reader.problems().add(reader.path_of("frame"), "\"" + surface.frame + "\"",
                          "\"" + told + "\", as the file itself says",
                          "delete the key, or mend the file");
  }
  return surface;
}

void refuse(JsonReader& reader, const std::string& key, const std::string& what) {
  if (!reader.has(key)) return;
  reader.problems().add(reader.path_of(key), "given", "no such key yet",
                        what + " not in this version; delete the key");
}

constexpr std::array kHeldNames = {"access", "ostia", "point"};  // of HeldPlace::At

HeldPlace read_held(JsonReader& reader) {
  HeldPlace held;
  const std::string at = reader.choice("at", std::nullopt, {kHeldNames.begin(), kHeldNames.end()});
  for (std::size_t k = 0; k < kHeldNames.size(); ++k) {
    if (at == kHeldNames[k]) held.at = static_cast<HeldPlace::At>(k);
  }
  if (held.at == HeldPlace::At::kPoint) {
    held.point = reader.point("point_mm", std::nullopt);
  } else if (reader.has("point_mm")) {
    reader.problems().add(reader.path_of("point_mm"), "given", "no point",
                          "\"at\": \"" + at +
                              "\" tells where it is; a place of your own is "
                              "\"at\": \"point\"");
  }
  held.radius = reader.number("radius_mm", held.radius, {.min = 0.1, .max = 100.0}, "given in m?");
  held.factor = reader.number("factor", held.factor, {.min = 1.0, .max = 1e6});
  reader.finish();
  return held;
}

Json held_json(const std::vector<HeldPlace>& places) {
  Json list = Json::array();
  for (const HeldPlace& held : places) {
    list.push_back({{"at", kHeldNames.at(static_cast<std::size_t>(held.at))},
                    {"radius_mm", held.radius},
                    {"factor", held.factor}});
    if (held.at == HeldPlace::At::kPoint) list.back()["point_mm"] = to_json(held.point);
  }
  return list;
}

WallInput read_wall(JsonReader& reader, const std::string& model) {
  WallInput wall;
  wall.elastic = reader.choice("model", model, {"elastic", "rigid"}) == "elastic";
  preprocess::WallOptions& extrusion = wall.extrusion;
  extrusion.thickness_mm = reader.number("thickness_mm", extrusion.thickness_mm,
                                         {.min = 0.1, .max = 10.0}, "given in m?");
  extrusion.young_modulus = reader.number("young_modulus_kpa", 0.0, {.min = 0.0, .max = 1e5},
                                          "given in Pa? 0 chooses it") *
                            kMpaPerKpa;
  extrusion.poisson_ratio =
      reader.number("poisson_ratio", extrusion.poisson_ratio, {.min = 0.0, .max = 0.49});
  if (!reader.raw("support_kpa_per_mm").is_null()) {
    wall.support = reader.number("support_kpa_per_mm", std::nullopt, {.min = 1e-3, .max = 1e6},
                                 "given in Pa/m? 1e6 Pa/m are 1 kPa/mm") *
                   kMpaPerKpa;
  }
  if (!reader.has("held")) return wall;
  if (!wall.support) {
    reader.problems().add(
        reader.path_of("held"), "given", "a support that it makes stiffer",
        "give " + reader.path_of("support_kpa_per_mm") + " too, or delete the key");
  }
  wall.held.clear();
  for (JsonReader& each : reader.objects("held", false)) wall.held.push_back(read_held(each));
  return wall;
}

std::string support_warning(double support, bool fitted) {
  return "the vessel moves as a whole on a support of " + number_text(support / kMpaPerKpa) +
         " kPa/mm, " +
         (fitted ? "which explains the measured wire best" : "not measured on the patient") +
         " (published: 0.01 to 10); no layers, no prestress. "
         "With the same idea others came within 2.3 mm after fitting one value, 4.6 mm without";
}

double read_friction(JsonReader& reader, double fallback) {
  return reader.number("friction", fallback, kFrictionRange, kFrictionHint);
}

Case read_case(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  Case input;
  input.file = find_case_file(path);
  Json file = read_json(input.file, kSchema);
  for (const std::string& override_text : overrides) apply_override(file, override_text);

  Problems problems(input.file.string());
  const PointKeys point_keys = find_point_keys(file);
  resolve_points(file, input.file.parent_path(), problems);
  resolve_branches(file, input.file.parent_path(), problems);
  JsonReader root(file, "", problems);
  root.text("schema", std::nullopt);
  input.name = read_name(root, input.file);
  const std::size_t problems_before = problems.count();
  AccessesAndTargets ends = read_accesses_and_targets(root, point_keys);
  input.accesses = std::move(ends.accesses);
  input.targets = std::move(ends.targets);
  input.accesses_listed = ends.accesses_listed;
  input.targets_listed = ends.targets_listed;
  if (problems.count() == problems_before) choose_section(input, 0, 0);
  input.study.rolls =
      read_angles(root, "tip_roll_deg", {0.0, 90.0, 180.0, 270.0}, {.min = -360.0, .max = 360.0});
  read_inputs(root, input);
  read_segmentation(root, input);
  input.mask_limits = read_mask_limits(root, input.surface_input.has_value());
  JsonReader wall = root.object("wall", false);
  input.wall = read_wall(wall, "elastic");
  wall.finish();
  CaseWires wires = read_wires(root);
  input.told = std::move(wires.told);
  input.devices = std::move(wires.devices);
  for (const DeviceWire& device : input.devices) input.study.wires.push_back(device.wire);
  input.suggest_catheters = root.has("catheters") && root.raw("catheters") == kSuggestCatheters;
  input.catheters = read_case_catheters(root, input.devices);
  if (input.catheters.empty()) {
    if (root.has("tool_rules")) {
      root.raw("tool_rules");
      problems.add("tool_rules", "given", "only beside \"catheters\"",
                   "delete the key, or list catheters");
    }
  } else {
    input.study.tool_rules = read_tool_rules(root);
  }
  read_insertion(root, input.study);
  input.access_limits =
      read_access_limits(root, input.suggest_catheters ? 0.0 : thinnest(input.catheters));
  read_limits(root, input.limits);
  read_weights(root, !input.catheters.empty(), input.weights);
  input.manoeuvres = read_manoeuvring(root);
  input.study.insertion.friction = read_friction(root, kDefaultFriction);
  input.study.insertion.friction_factor =
      root.number("friction_factor", 1.0, {.min = 0.0, .max = 100.0}, "0: frictionless");
  read_robustness(root, input);
  input.study.spreads = spreads_of(input.devices, input.friction_spread, input.stiffness_spread);
  input.study.catheters =
      catheters_of(input.catheters, input.friction_spread, input.stiffness_spread);
  JsonReader search = root.object("search", false);
  input.exhaustive = search.boolean("exhaustive", false);
  search.finish();
  root.finish();
  problems.throw_if_any();
  return input;
}

void choose_section(Case& given, std::size_t access, std::size_t target) {
  const AccessInput& from = given.accesses.at(access);
  const TargetInput& to = given.targets.at(target);
  given.access = access;
  given.target = target;
  given.study.access = from.point;
  given.study.inclinations = from.inclinations;
  given.study.azimuths = from.azimuths;
  given.study.goal = {.point = to.point, .at_section = to.at_section};
  if (!to.at_section) given.study.goal.radius = to.radius;
}

std::string access_key(const Case& given) {
  return !given.accesses_listed ? "access" : "accesses[" + std::to_string(given.access) + "]";
}

std::string target_key(const Case& given) {
  return !given.targets_listed ? "target" : "targets[" + std::to_string(given.target) + "]";
}

std::string access_point_key(const Case& given) {
  return access_key(given) + "." + given.accesses.at(given.access).told_by;
}

std::string target_point_key(const Case& given) {
  return target_key(given) + "." + given.targets.at(given.target).told_by;
}

std::vector<std::pair<std::string, Vec3>> end_points(Case given) {
  std::vector<std::pair<std::string, Vec3>> points;
  for (given.access = 0; given.access < given.accesses.size(); ++given.access) {
    points.emplace_back(access_point_key(given), given.accesses[given.access].point);
  }
  for (given.target = 0; given.target < given.targets.size(); ++given.target) {
    points.emplace_back(target_point_key(given), given.targets[given.target].point);
  }
  return points;
}

std::string section_name(const Case& given) {
  const std::string from = given.accesses.size() > 1 ? given.accesses[given.access].name : "",
                    to = given.targets.size() > 1 ? given.targets[given.target].name : "";
  return from + (from.empty() || to.empty() ? "" : " to ") + to;
}

Json case_parameters(const Case& input) {
  const plan::Study& study = input.study;
  Json json = {{"schema", kSchema}, {"name", input.name}};
  json.update(input_json(input));
  json["wall"] = {{"model", input.wall.elastic ? "elastic" : "rigid"},
                  {"thickness_mm", input.wall.extrusion.thickness_mm},
                  {"young_modulus_kpa", clean(input.wall.extrusion.young_modulus / kMpaPerKpa)},
                  {"poisson_ratio", input.wall.extrusion.poisson_ratio}};
  if (input.wall.support) {
    json["wall"]["support_kpa_per_mm"] = clean(*input.wall.support / kMpaPerKpa);
    json["wall"]["held"] = held_json(input.wall.held);
  }
  const auto put = [&](const char* one, const char* list, const auto& inputs, auto to_json_of) {
    if (inputs.size() == 1) {
      json[one] = to_json_of(inputs.front());
      return;
    }
    json[list] = Json::array();
    for (const auto& each : inputs) json[list].push_back(to_json_of(each));
  };
  put("access", "accesses", input.accesses, access_json);
  put("target", "targets", input.targets, target_json);
  json["wires"] = Json::array();
  for (const DeviceWire& device : input.devices) json["wires"].push_back(device.json);
  if (!input.catheters.empty()) {
    json["catheters"] =
        input.suggest_catheters ? Json(kSuggestCatheters) : catheters_json_of(input.catheters);
    json["tool_rules"] = tool_rules_json(study.tool_rules);
  }
  json["tip_roll_deg"] = degrees_json(study.rolls);
  json["manoeuvres"] = manoeuvring_name(input.manoeuvres);
  json["friction"] = study.insertion.friction;
  json["friction_factor"] = study.insertion.friction_factor;
  json["insertion"] = {{"length_mm", study.insertion.length},
                       {"step_mm", study.insertion.step},
                       {"element_length_mm", study.insertion.element_length},
                       {"contact_spacing_mm", study.insertion.contact_spacing},
                       {"residual_tolerance_n", study.insertion.residual_tolerance},
                       {"max_iterations", study.insertion.max_iterations},
                       {"record_every_mm", study.insertion.record_every}};
  json["access_limits"] = access_limits_json(input.access_limits);
  json["limits"] = limits_json(input.limits);
  json["search"] = {{"exhaustive", input.exhaustive}};
  json["robustness"] = robustness_json(input);
  json["ranking"] = ranking_json(input.weights, !input.catheters.empty());
  return json;
}

}  // namespace wireplan::pipeline
