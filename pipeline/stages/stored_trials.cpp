#include "pipeline/stages/stored_trials.h"

#include <algorithm>

#include "pipeline/files/disk.h"
#include "pipeline/files/plan_file.h"
#include "pipeline/files/text.h"
#include "pipeline/files/trial_file.h"
#include "pipeline/files/wire_file.h"
#include "pipeline/stages/plan_artifact.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;
using plan::Level;

// Stages whose artifacts hold trials in full, and their shapes on the way.
constexpr std::array kTrialStages = {"trials", "manoeuvres"};

// Of what trials of catheter and wire do; counts up where the same script comes to something else.
constexpr int kToolTrialVersion = 18;

std::string level_folder(Level level) {
  return level == Level::kFull ? "" : plan::level_name(level);
}

fs::path shapes_file(int id) { return fs::path(kKeptFolder) / "shapes" / format("%04d.bin", id); }
fs::path attempt_file(int id) { return fs::path(kKeptFolder) / trial_file_name(id); }

void link_or_copy(const fs::path& from, const fs::path& to) {
  fs::create_directories(to.parent_path());
  std::error_code cannot_link;
  fs::create_hard_link(from, to, cannot_link);
  if (cannot_link) fs::copy_file(from, to);
}

// A file of an artifact that holds trials; empty where none has it.
fs::path in_artifacts(const Workspace& work, const fs::path& name) {
  for (const char* stage : kTrialStages) {
    if (!work.has(stage)) continue;
    const fs::path file = work.artifact(stage).folder / name;
    if (fs::exists(file)) return file;
  }
  return {};
}

}  // namespace

StoredTrials::StoredTrials(Workspace& work)
    : work_(work),
      shared_key_(without_parameters(work.key_texts.at("trials"),
                                     {"wires", "access.inclination_deg", "access.azimuth_deg",
                                      "tip_roll_deg", "insertion.length_mm", "search"})) {
  for (const Level level : {Level::kScout, Level::kProbe, Level::kFull}) {
    studies_[static_cast<std::size_t>(level)] = plan::study_at(work.study(), level);
  }
  const Case& given = work.given();
  for (const std::size_t k : targets_served(given)) {
    if (k == given.target) continue;
    // What the section of that target has in the place of this one's.
    other_keys_.push_back(with_values(
        shared_key_, {{"input centerline", work.artifact(centerline_toward(k)).contents()},
                      {"parameter target.point_mm", to_json(given.targets[k].point).dump()},
                      {"parameter target.beyond_mm", Json(given.targets[k].beyond_mm).dump()}}));
  }
}

const plan::Study& StoredTrials::study_of(Level level) const {
  return studies_[static_cast<std::size_t>(level)];
}

// All that one run reads: what the stage of the trials reads, but of the lists only its own entry.
// The elements of a scout follow from all wires of the study.
std::string StoredTrials::key_of(const plan::Run& run, const std::string& shared_key) const {
  const auto& [wire, inclination, azimuth, roll, moves, catheter, steps, first_wire] =
      run.candidate;
  const plan::Study& study = study_of(run.level);
  Json script = Json::array();
  for (const auto& [push, turn] : moves) script.push_back({push, turn});
  const auto as_run = [&](int k) {
    return run.disturbance ? plan::disturbed_wire(study, k, *run.disturbance)
                           : study.wires[static_cast<std::size_t>(k)];
  };
  std::vector<KeyLine> lines = {{"wire", wire_json(as_run(wire)).dump()},
                                {"inclination", Json(inclination).dump()},
                                {"azimuth", Json(azimuth).dump()},
                                {"roll", Json(roll).dump()},
                                {"moves", script.dump()},
                                {"length", Json(study.insertion.length).dump()},
                                {"level", plan::level_name(run.level)},
                                {"element", Json(study.insertion.element_length).dump()}};
  if (catheter >= 0) {
    const plan::Catheter& known = study.catheters[static_cast<std::size_t>(catheter)];
    const simulate::Wire tube =
        run.disturbance ? plan::disturbed_tube(study, catheter, *run.disturbance) : known.tool.wire;
    lines.push_back({"tools", std::to_string(kToolTrialVersion)});
    lines.push_back({"catheter", wire_json(tube).dump()});
    lines.push_back(
        {"lumen",
         Json({known.tool.inner_radius, study.tool_rules.friction, plan::kToolElements}).dump()});
    lines.push_back({"steps", steps_json(steps).dump()});
    if (first_wire >= 0) lines.push_back({"first_wire", wire_json(as_run(first_wire)).dump()});
  }
  if (run.elements) {
    const auto& [factor, insertion, setting] = *run.elements;
    lines.push_back({"elements", Json({factor, insertion}).dump()});
    if (setting) lines.push_back({"setting", plan::setting_name(*setting)});
  }
  if (run.disturbance) {
    const plan::Disturbance& d = *run.disturbance;
    lines.push_back(
        {"disturbance",
         Json({d.wall_factor, d.tilt.x(), d.tilt.y(), d.shift.x(), d.shift.y(), d.inward}).dump()});
    if (d.support_factor != 1.0) lines.push_back({"support", Json(d.support_factor).dump()});
  }
  return shared_key + key_text(lines);
}

std::string StoredTrials::shapes_key_of(const plan::Run& run) const {
  return key_of(run) + key_text({{"piece", "shapes"}});
}

std::optional<StoredTrials::Files> StoredTrials::locate(const plan::Run& run) const {
  Files files;
  if (run.id >= 0) {
    files.trial = in_artifacts(work_, level_folder(run.level) / fs::path(trial_file_name(run.id)));
    if (run.level == Level::kFull) files.shapes = in_artifacts(work_, shapes_file(run.id));
  }
  const bool is_piece = files.trial.empty();
  if (is_piece) {
    const std::optional<fs::path> piece = work_.store().find_piece(key_of(run));
    if (!piece) return {};
    files.trial = *piece;
  }
  if (files.shapes.empty() && run.level == Level::kFull && (is_piece || run.shapes)) {
    files.shapes = work_.store().find_piece(shapes_key_of(run)).value_or(fs::path());
  }
  if (run.shapes && files.shapes.empty()) return {};
  return files;
}

std::optional<plan::Measured> StoredTrials::find(const plan::Run& run) {
  if (!run.is_plain()) {
    const std::optional<fs::path> piece = work_.store().find_piece(key_of(run));
    return piece ? measured_from_text(read_if_there(*piece)) : std::nullopt;
  }
  std::optional<Files> files = locate(run);
  if (!files) return {};
  const std::pair place(run.level, run.id);
  std::optional<plan::Measured> measured;
  const auto known = work_.measured.find(place);
  if (run.id >= 0 && known != work_.measured.end()) {
    measured = known->second;
  } else if (const auto kept = work_.trials_for_others().extract(files->trial)) {
    measured = plan::measure(kept.mapped(), study_of(run.level), work_.path());
  } else if (const std::optional<simulate::TrialResult> trial = find_trial(files->trial)) {
    measured = plan::measure(*trial, study_of(run.level), work_.path());
  }
  if (measured && run.id >= 0) {
    work_.measured[place] = *measured;
    places_[place] = std::move(*files);
  }
  return measured;
}

void StoredTrials::keep(const plan::Run& run, const simulate::TrialResult& trial,
                        const plan::Measured& measured) {
  const Store& store = work_.store();
  if (!run.is_plain()) {
    store.keep_piece(key_of(run), measured_text(measured, /*with_shape=*/run.elements.has_value()));
    return;
  }
  Files files;
  files.trial =
      store.keep_piece(key_of(run), trial_text(study_of(run.level), run.candidate, trial));
  if (!trial.shapes.empty()) {
    files.shapes = store.keep_piece(shapes_key_of(run), shapes_to_bytes(trial.shapes));
  }
  if (run.id < 0) return;
  const std::scoped_lock lock(mutex_);
  work_.measured[{run.level, run.id}] = measured;
  places_[{run.level, run.id}] = std::move(files);
}

void StoredTrials::keep_other(std::size_t other, const plan::Run& run,
                              const simulate::TrialResult& trial) {
  fs::path piece = work_.store().keep_piece(key_of(run, other_keys_.at(other)),
                                            trial_text(study_of(run.level), run.candidate, trial));
  const std::scoped_lock lock(mutex_);
  work_.trials_for_others().insert_or_assign(std::move(piece), trial);
}

std::optional<plan::Scripts> StoredTrials::find_scripts() {
  if (!work_.has("manoeuvres")) return {};
  return read_scripts(work_.figures("manoeuvres"), work_.study());
}

void StoredTrials::place(Level level, int first_id, const fs::path& folder) const {
  for (const auto& [place, files] : places_) {
    if (place.first != level || place.second < first_id) continue;
    link_or_copy(files.trial, folder / level_folder(level) / trial_file_name(place.second));
    if (!files.shapes.empty()) link_or_copy(files.shapes, folder / shapes_file(place.second));
  }
}

void StoredTrials::place_attempt(int id, const fs::path& folder) const {
  const Files& files = places_.at({Level::kFull, id});
  link_or_copy(files.trial, folder / attempt_file(id));
  link_or_copy(files.shapes, folder / shapes_file(id));
}

simulate::TrialResult read_trial(const Workspace& work, Level level, int id) {
  const fs::path file = in_artifacts(work, level_folder(level) / fs::path(trial_file_name(id)));
  expects(!file.empty());
  return read_trial_file(file);
}

std::optional<simulate::TrialResult> find_played(const Workspace& work, int id) {
  fs::path trial = in_artifacts(work, trial_file_name(id)),
           shapes = in_artifacts(work, shapes_file(id));
  if (trial.empty() || shapes.empty()) {
    if (!work.has("plans")) return {};
    const fs::path& folder = work.artifact("plans").folder;
    trial = folder / attempt_file(id);
    shapes = folder / shapes_file(id);
    if (!fs::exists(trial)) return {};
  }
  simulate::TrialResult result = read_trial_file(trial);
  std::optional<std::vector<simulate::Shape>> known = shapes_from_bytes(read_if_there(shapes));
  expects(known.has_value());
  result.shapes = std::move(*known);
  return result;
}

}  // namespace wireplan::pipeline
