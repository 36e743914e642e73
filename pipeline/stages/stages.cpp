#include "pipeline/stages/stages.h"

#include <algorithm>
#include <chrono>
#include <initializer_list>
#include <utility>

#include "pipeline/files/access_limits_file.h"
#include "pipeline/files/clock.h"
#include "pipeline/report/report.h"
#include "pipeline/store/hash.h"
#include "plan/search.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNotMade = "to be made";  // in the place of contents not yet known

/// What is read of a table of label names beside its file: the names, whether they go before those
/// in the labels, and what is told of one that is broken, wherever it lies. Empty without a table.
std::string told_by_table(const LabelsInput& labels) {
  std::string problem =
      labels.table_given.empty() ? find_label_table(labels.path).problem : std::string();
  const fs::path folder = fs::absolute(labels.path).parent_path();
  for (const fs::path& place : {folder, folder.parent_path()}) {
    const std::string start = place.string() + "/";
    for (std::size_t at = 0; (at = problem.find(start, at)) != std::string::npos;) {
      problem.erase(at, start.size());
    }
  }
  if (labels.choice.table.empty() && problem.empty()) return {};
  Json names = Json::array();
  for (const auto& [value, name] : labels.choice.table) names.push_back({value, name});
  return Json({{"names", names}, {"first", labels.choice.table_wins}, {"problem", problem}})
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

// One line per value: objects and lists of objects are walked, lists of numbers stay whole.
void add_parameter(const std::string& name, const Json& value, std::vector<KeyLine>& lines) {
  const bool objects = value.is_array() && !value.empty() && value.front().is_object();
  if (value.is_object()) {
    for (const auto& [key, part] : value.items()) {
      add_parameter(name.empty() ? key : name + "." + key, part, lines);
    }
  } else if (objects) {
    for (std::size_t k = 0; k < value.size(); ++k) {
      add_parameter(name + "[" + std::to_string(k) + "]", value[k], lines);
    }
  } else {
    lines.push_back({"parameter " + name, value.dump()});
  }
}

// "/wall/thickness_mm" -> "wall.thickness_mm"
std::string dotted(const std::string& pointer) {
  std::string name = pointer.substr(pointer.empty() ? 0 : 1);
  std::replace(name.begin(), name.end(), '/', '.');
  return name;
}

/// What branches are called after beside the target, with where it lies; empty where nothing has a
/// name.
std::string named_places(const Case& given) {
  Json places = Json::array();
  const auto add = [&](const std::string& name, const Vec3& point) {
    if (!name.empty()) places.push_back({name, to_json(point)});
  };
  for (const AccessInput& access : given.accesses) add(access.name, access.point);
  for (const TargetInput& target : given.targets) add(target.name, target.point);
  return places.empty() ? "" : places.dump();
}

std::string stage_key_text(const Stage& stage, const Workspace& work) {
  std::vector<KeyLine> lines = {{"stage", stage.name}, {"version", std::to_string(stage.version)}};
  if (stage.reads_input) {
    lines.push_back({"input file", work.input_sha256});
    const std::optional<VolumeInput>& volume = work.given().volume;
    if (volume && !volume->series.empty()) {
      lines.push_back({"parameter volume.series", volume->series});
    }
  }
  if (stage.reads_labels && !work.labels_sha256.empty()) {
    lines.push_back({"labels", work.labels_sha256});
    if (!work.labels_table.empty()) lines.push_back({"table of labels", work.labels_table});
  }
  for (const std::string& earlier : stage.after) {
    lines.push_back(
        {"input " + earlier, work.has(earlier) ? work.artifact(earlier).contents() : kNotMade});
  }
  for (const std::string& pointer : stage.parameters) {
    add_parameter(dotted(pointer), work.parameters.at(Json::json_pointer(pointer)), lines);
  }
  if (stage.name == "plans") {  // keeps metrics: a result without one that was added since is old
    Json names;
    for (const plan::MetricField& field : plan::kMetricFields) names.push_back(field.name);
    lines.push_back({"metrics", names.dump()});
  }
  if (const std::string places = named_places(work.given());
      stage.names_branches && !places.empty()) {
    lines.push_back({"named places", places});
  }
  if (stage.names_program) lines.push_back({"program", build_info().dump()});
  return key_text(lines);
}

// Under which the store remembers what a section last used.
fs::path section_file(const Case& given) {
  const std::string section = section_name(given);
  return section.empty() ? given.file : fs::path(given.file.string() + "#" + section);
}

// What changed since the stage last ran for this case.
std::vector<std::string> why_it_runs(const Store& store, const Case& given, const Stage& stage,
                                     const std::string& key_text, bool forced) {
  if (forced) return {"it is forced"};
  const std::string before = store.last_key_text(section_file(given), stage.name);
  if (before.empty()) return {"it has no earlier result for this case"};
  std::vector<std::string> reasons = describe_difference(before, key_text);
  if (reasons.empty()) reasons = {"its result is gone from the cache or damaged"};
  return reasons;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void require_known(const std::vector<Stage>& stages, const std::string& name) {
  std::string list;
  for (const Stage& stage : stages) {
    if (stage.name == name) return;
    list += (list.empty() ? "" : ", ") + stage.name;
  }
  throw Error("stage \"" + name + "\": this case has none of that name, expected one of " + list);
}

// What a stage says of the world is told with the case and the stage, and where to look.
std::string in_context(const Workspace& work, const std::string& stage, const std::string& what) {
  const std::string section = section_name(work.given());
  std::string text = work.given().file.string() + (section.empty() ? "" : ": " + section) +
                     ": stage " + stage + ": " + what;
  if (work.has("surface")) {
    text += " (the surface: " + (work.artifact("surface").folder / "surface.vtp").string() + ")";
  }
  return text;
}

// Calls what acts for the stage.
template <typename Act>
auto act_for(const Stage& stage, Workspace& work, const Act& act) {
  try {
    return act();
  } catch (const DiskError& error) {
    throw DiskError(in_context(work, stage.name, error.what()));
  } catch (const Error& error) {
    throw StageError(stage.name, in_context(work, stage.name, error.what()));
  }
}

Artifact make_artifact(const Stage& stage, const Store& store, const std::string& key_text,
                       Workspace& work) {
  const auto make = [&](const fs::path& folder) {
    stage.make(work, folder);
    if (stage.reads_input && input_stamp(work.input) != work.input_stamp) {
      throw Error(work.input.string() + ": changed while it was read; run again");
    }
    if (stage.reads_labels && work.given().labels &&
        input_stamp(work.given().labels->path) != work.labels_stamp) {
      throw Error(work.given().labels->path.string() + ": changed while it was read; run again");
    }
  };
  return act_for(stage, work, [&] { return store.commit(stage.name, key_text, make); });
}

/// Adds parameters that the stage does not read yet.
void read_too(Stage& stage, std::initializer_list<const char*> pointers) {
  for (const char* pointer : pointers) {
    const auto& known = stage.parameters;
    if (std::find(known.begin(), known.end(), pointer) == known.end()) {
      stage.parameters.emplace_back(pointer);
    }
  }
}

/// Adds the points of all accesses and targets of the case; the parameters have a list of one in
/// the singular form.
void read_points(Stage& stage, const Case& given) {
  const auto read = [&](const std::string& one, const std::string& list, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
      const std::string key = count == 1 ? one : list + "/" + std::to_string(k);
      stage.parameters.push_back("/" + key + "/point_mm");
    }
  };
  read("access", "accesses", given.accesses.size());
  read("target", "targets", given.targets.size());
}

/// The stages from labels, with the volume that they were drawn in or without, to the surface.
std::vector<Stage> stages_from_labels(const Case& given) {
  const bool in_volume = given.volume.has_value();
  std::vector<Stage> stages;
  if (in_volume) {
    stages.push_back({.name = "volume", .version = 6, .reads_input = true, .make = make_volume});
  }
  stages.push_back({.name = "segment",
                    .version = 14,
                    .reads_input = in_volume,
                    .reads_labels = true,
                    .parameters = {"/mask"},
                    .make = make_labels});
  if (!given.labels->choice.values.empty()) read_too(stages.back(), {"/labels/values"});
  if (!given.labels->choice.names.empty()) read_too(stages.back(), {"/labels/names"});
  read_points(stages.back(), given);
  stages.push_back({.name = "surface",
                    .version = 14,
                    .reads_input = in_volume,
                    .after = {"segment"},
                    .parameters = {"/surface/edge_length_mm"},
                    .make = make_surface});
  return stages;
}

/// The stages from a volume or a surface file to the surface.
std::vector<Stage> stages_to_surface(const Case& given) {
  if (given.labels) return stages_from_labels(given);
  std::vector<Stage> stages;
  if (!given.volume) {
    stages.push_back({.name = "surface",
                      .version = 14,
                      .reads_input = true,
                      .parameters = {"/surface/unit", "/surface/frame", "/surface/edge_length_mm"},
                      .make = make_surface});
    return stages;
  }
  stages.push_back({.name = "volume", .version = 6, .reads_input = true, .make = make_volume});
  stages.push_back({.name = "segment",
                    .version = 22,
                    .reads_input = true,
                    .parameters = {"/segmentation", "/mask"},
                    .make = make_segment});
  read_points(stages.back(), given);
  stages.push_back({.name = "surface",
                    .version = 14,
                    .reads_input = true,
                    .after = {"segment"},
                    .parameters = {"/surface/edge_length_mm"},
                    .make = make_surface});
  return stages;
}

/// Whether what the stage warns of is told as it ends: of the volume's values and of given labels
/// always, of all else where no report will tell it.
bool warns_here(const Case& given, const RunOptions& options, const std::string& stage) {
  if (stage == "volume" || (stage == "segment" && given.labels)) return true;
  return !options.to.empty() && options.to != "report" && !options.instead;
}

}  // namespace

std::vector<Stage> stages_of(const Case& given) {
  const bool from_volume = given.volume.has_value(), from_labels = given.labels.has_value();
  std::vector<Stage> stages = stages_to_surface(given);
  stages.push_back({.name = "centerline",
                    .version = 12,
                    .after = {"surface"},
                    .parameters = {"/access/point_mm", "/target/point_mm"},
                    .make = make_centerline});
  if (given.study.goal.at_section) read_too(stages.back(), {"/target/beyond_mm"});
  // Names of branches, or the way that was found.
  if (from_labels || from_volume) stages.back().after.emplace_back("segment");
  Stage anatomy{.name = "anatomy",
                .version = 19,
                .reads_input = from_volume,
                .after = {"surface", "centerline"},
                .parameters = {"/access_limits", "/axes"},
                .names_branches = true,
                .make = make_anatomy};
  if (from_volume) anatomy.after.push_back("segment");
  // The voxels tell how well the lumen is known.
  const char* voxels = from_volume ? "volume" : from_labels ? "segment" : nullptr;
  stages.push_back(anatomy);
  stages.push_back(
      {.name = "wall",
       .version = 2,
       .after = {"surface"},
       .parameters = {"/wall/thickness_mm", "/wall/young_modulus_kpa", "/wall/poisson_ratio"},
       .make = make_wall});
  const bool sections_move = given.wall.support.has_value();
  Stage trials{.name = "trials",
               .version = sections_move ? 40 : 39,  // each counts its own changes
               .after = {"surface", "centerline"},
               .parameters = {"/access", "/target", "/wires", "/tip_roll_deg", "/friction",
                              "/friction_factor", "/wall/model", "/insertion"},
               .names_branches = true,
               .make = make_trials};
  // A rigid wall does not act but in how the vessel moves as a whole.
  if (given.wall.elastic || sections_move) trials.after.push_back("wall");
  if (sections_move) read_too(trials, {"/wall/support_kpa_per_mm", "/wall/held"});
  if (const std::vector<std::size_t> served = targets_served(given); served.size() > 1) {
    for (const std::size_t k : served) trials.after.push_back(centerline_toward(k));
  }
  if (plan::needs_search(given.study, given.exhaustive)) read_too(trials, {"/search"});
  stages.push_back(trials);
  Stage manoeuvres = trials;
  manoeuvres.name = "manoeuvres";
  manoeuvres.version = 46;
  manoeuvres.after.push_back("trials");
  read_too(manoeuvres, {"/manoeuvres"});
  const bool tools = !given.catheters.empty();
  if (tools) read_too(manoeuvres, {"/catheters", "/tool_rules"});
  const bool scripts_tried =
      tools && given.suggest_catheters && given.manoeuvres != Manoeuvring::kNever;
  if (scripts_tried) read_too(manoeuvres, {"/robustness/repeats"});
  if (given.manoeuvres == Manoeuvring::kWhenNeeded || scripts_tried) {
    // Plans, and scripts of suggested catheters, are tried under disturbances.
    if (voxels != nullptr) manoeuvres.after.emplace_back(voxels);
    read_too(manoeuvres, {"/robustness/seed", "/robustness/friction_factor",
                          "/robustness/stiffness_factor", "/robustness/wall_factor",
                          "/robustness/angle_deg", "/robustness/entry_mm", "/robustness/lumen_mm"});
    if (sections_move) read_too(manoeuvres, {"/robustness/support_factor"});
  }
  manoeuvres.make = make_manoeuvres;
  stages.push_back(manoeuvres);
  Stage plans = trials;
  plans.name = "plans";
  plans.version = 27;
  plans.after.insert(plans.after.end(), {"trials", "manoeuvres"});
  if (voxels != nullptr) plans.after.emplace_back(voxels);
  read_too(plans, {"/manoeuvres", "/robustness"});
  if (tools) read_too(plans, {"/catheters", "/tool_rules"});
  plans.make = make_plans;
  stages.push_back(plans);
  Stage report{.name = "report",
               .version = kReportVersion,
               .reads_input = true,
               .reads_labels = true,
               .after = {},
               .parameters = {""},
               .names_program = true,
               .make = make_report};
  for (const Stage& stage : stages) report.after.push_back(stage.name);
  stages.push_back(report);
  return stages;
}

Json used_parameters(const Case& given) {
  Json parameters = case_parameters(given);
  const auto name_only = [](const fs::path& path) { return path.filename().string(); };
  if (given.volume) parameters["volume"]["path"] = name_only(given.volume->path);
  if (given.surface_input) parameters["surface"]["path"] = name_only(given.surface_input->path);
  if (given.labels) {
    parameters["labels"]["path"] = name_only(given.labels->path);
    if (!given.labels->table_given.empty()) {
      parameters["labels"]["table"] = name_only(given.labels->table_given);
    }
  }
  // What is chosen from; a catalogue that has changed is another case.
  parameters["access_limits"]["assumed"] = assumed_sizes(given.access_limits);
  if (given.suggest_catheters) parameters["catheters"] = catheters_json_of(given.catheters);
  const AccessInput& access = given.accesses[given.access];
  const TargetInput& target = given.targets[given.target];
  if (section_name(given).empty() && access.name.empty() && target.name.empty()) return parameters;
  parameters["section"] = {{"access", access.name}, {"target", target.name}};
  parameters["access"] = access_json(access);
  parameters["target"] = target_json(target);
  for (const char* key : {"access", "target"}) parameters[key].erase("name");
  return parameters;
}

RunResult run_stages(const Case& given, const RunOptions& options) {
  return run_stages(given, options, stages_of(given));
}

RunResult run_stages(const Case& given, const RunOptions& options,
                     const std::vector<Stage>& stages) {
  if (!options.to.empty()) require_known(stages, options.to);
  for (const std::string& name : options.force) require_known(stages, name);

  const Store store(options.cache);
  RunResult result{.stages = {}, .artifacts = {}, .use = store.use()};
  Workspace work(given, options.work, store);
  work.parameters = used_parameters(given);
  work.input_stamp = input_stamp(work.input);
  work.input_sha256 = hash_input(work.input);
  if (given.labels) {
    work.labels_stamp = input_stamp(given.labels->path);
    work.labels_sha256 = hash_input(given.labels->path);
    work.labels_table = told_by_table(*given.labels);
  }
  for (const auto& [name, artifact] : options.beside) work.add(name, artifact);
  const auto place_of = [&](const std::string& name) {
    return std::find_if(stages.begin(), stages.end(),
                        [&](const Stage& stage) { return stage.name == name; });
  };
  const auto trials = place_of("trials");
  work.simulates = !options.instead && trials < stages.end() && trials <= place_of(options.to);
  for (const Stage& stage : stages) {
    if (options.work.cancelled && options.work.cancelled()) throw Interrupted();

    // Look it up.
    const auto start = std::chrono::steady_clock::now();
    const std::string text = stage_key_text(stage, work);
    work.key_texts[stage.name] = text;
    const bool forced = contains(options.force, stage.name);
    std::optional<Artifact> artifact;
    if (!forced) artifact = store.find(stage.name, text);
    StageOutcome outcome{.stage = stage.name};
    if (!artifact && options.instead && stage.name == options.to) {
      act_for(stage, work, [&] { options.instead(work); });
      break;
    }

    // Run it, unless another process just did; or in a dry run say so.
    if (!artifact && !options.dry_run) {
      require_folder(store.root(), kCachePurpose);
      const std::optional<FileLock> lock = store.lock(stage.name, text, options.work.cancelled);
      if (!lock) throw Interrupted();
      if (forced) store.forget(stage.name, text);
      artifact = store.find(stage.name, text);
      if (!artifact) {
        outcome = {stage.name, StageState::kMade, 0.0,
                   why_it_runs(store, given, stage, text, forced)};
        if (stage.name == "plans" && options.before_plans) options.before_plans(work);
        artifact = make_artifact(stage, store, text, work);
      }
    } else if (!artifact) {
      outcome = {stage.name, StageState::kWouldRun, 0.0,
                 why_it_runs(store, given, stage, text, forced)};
    }
    if (artifact) {
      if (!options.dry_run) store.remember(section_file(given), *artifact);
      work.add(*artifact);
      result.artifacts.push_back(*artifact);
    }
    outcome.seconds = seconds_since(start);
    if (artifact && warns_here(given, options, stage.name) &&
        fs::exists(artifact->folder / kFiguresFile)) {
      outcome.warnings = work.figures(stage.name).at("warnings").get<std::vector<std::string>>();
    }
    result.stages.push_back(outcome);
    if (options.on_stage) options.on_stage(outcome);
    if (stage.name == options.to) break;
  }
  return result;
}

}  // namespace wireplan::pipeline
