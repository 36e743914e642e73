#pragma once
/// What a run knows while its stages are made: the case, the artifacts so far and what was read
/// from them.
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/files/case_file.h"
#include "pipeline/files/json_reader.h"
#include "pipeline/store/store.h"
#include "plan/trial_log.h"
#include "preprocess/surface/openings.h"
#include "preprocess/volume/image.h"
#include "simulate/wall/vessel_model.h"

namespace wireplan::pipeline {

using plan::Interrupted;

/// What the sections of a case share: the vessel as trials feel it, made once, and trials.
struct ModelStock {
  std::string made_from;  // key of surface and wall
  std::unique_ptr<simulate::VesselModel> model = nullptr;
  std::unique_ptr<const simulate::WallCompliance> compliance_aside = nullptr;  // while it is rigid
  std::string sections_made_from = {};  // how its cross-sections move
  std::unique_ptr<const simulate::SectionChain> sections_aside = nullptr;  // while it is rigid
  /// That a section ran for others too, by the pieces that hold them, until those ask for them.
  std::map<std::filesystem::path, simulate::TrialResult> trials = {};
};

/// How a stage speaks to whom started it; each may be empty.
struct WorkOptions {
  int threads = 0;                                    // of the trials; 0: all cores
  std::function<void(int done, int total)> progress;  // trials; from any thread, one at a time
  std::function<bool()> cancelled;                    // from any thread
  std::function<void(const std::string&)> told;       // first answers, a line each; from any thread
  std::shared_ptr<ModelStock> models = nullptr;       // null: made anew, and kept for itself
};

/// Targets that one push from an access can serve: the cross-sections among the case's targets. The
/// section's own alone where that is a sphere.
std::vector<std::size_t> targets_served(const Case& given);

/// Under which a section's workspace has the artifact of stage centerline toward another target.
std::string centerline_toward(std::size_t target);

/// The artifacts made so far and what was read from them, each once and only when a stage asks.
class Workspace {
 public:
  Workspace(Case given, WorkOptions options, Store store);

  const Case& given() const { return given_; }
  const WorkOptions& options() const { return options_; }
  const Store& store() const { return store_; }

  void add(const Artifact& artifact) { add(artifact.stage, artifact); }
  void add(const std::string& name, const Artifact& artifact) { artifacts_[name] = artifact; }
  bool has(const std::string& stage) const { return artifacts_.count(stage) != 0; }
  /// Expects the stage to be done.
  const Artifact& artifact(const std::string& stage) const;
  Json figures(const std::string& stage) const;  // its figures.json

  const preprocess::Image& image();
  /// Frees what takes much memory; a small one is kept, since later stages read it too.
  void drop_image() {
    constexpr std::size_t kSmall = 32'000'000;  // voxels: 128 MB
    if (image_ && image_->values.size() > kSmall) image_.reset();
  }
  const Surface& surface();
  const Centerline& path();  // access to target
  const Wall& wall();
  /// The vessel as the trials feel it: with the wall only where it yields.
  const simulate::VesselModel& model();
  /// How its cross-sections move; null where they do not.
  std::unique_ptr<const simulate::SectionChain> section_chain();
  /// The same with a wall that does not yield or move. Both are one object: the use of either ends
  /// before the other is asked for.
  const simulate::VesselModel& rigid_model();
  /// Makes the rigid one whose cross-sections move all the same, for scouts; empty where they do
  /// not.
  std::function<const simulate::VesselModel&()> moving_model();
  /// Begins to make the field of the vessel, and the wall's stiffness, beside what this thread does
  /// next, where the run goes on to stages that simulate, may use a second thread, and has none
  /// yet; the models take them from there. Who drops the workspace before that waits for them.
  void begin_field();
  void begin_compliance();
  /// Makes the field of the vessel a piece in the store, unless another process did: for shards, so
  /// that one of them computes it. rigid_model() takes it from there.
  void share_field();
  /// Bytes that follow from `key` and from this program: a piece of the store, made where it has
  /// none.
  std::string piece(std::vector<KeyLine> key, const std::function<std::string()>& make) const;
  /// The case's study with what the centerlines tell: the tangent at the access, the ways of the
  /// goal and of the others, and the insertion length where the case leaves it open. Sections that
  /// one push can serve have tangent and length in common.
  const plan::Study& study();
  /// Trials that a section ran for others: nobody need read their pieces (ModelStock).
  std::map<std::filesystem::path, simulate::TrialResult>& trials_for_others() {
    return models().trials;
  }

  std::filesystem::path input;  // the volume, surface or labels that the case starts from
  std::string input_sha256;
  std::string input_stamp;                       // before it was hashed
  std::string labels_sha256, labels_stamp;       // of the labels; empty where the case has none
  std::string labels_table;                      // what a table tells of their names, for keys
  Json parameters;                               // of the case after defaults, without folder names
  std::map<std::string, std::string> key_texts;  // of the stages so far and the one under way
  bool simulates = false;                        // this run goes on to stages that simulate
  /// Trials that this process ran or read, by level and candidate.
  std::map<std::pair<plan::Level, int>, plan::Measured> measured;

 private:
  Case given_;
  WorkOptions options_;
  Store store_;
  std::map<std::string, Artifact> artifacts_;
  std::optional<preprocess::Image> image_;
  std::optional<Surface> surface_;
  std::optional<Centerline> path_;
  std::optional<Wall> wall_;
  std::optional<plan::Study> study_;
  std::shared_ptr<ModelStock> models_;
  std::future<std::unique_ptr<simulate::VesselModel>> field_begun_;
  std::future<std::unique_ptr<const simulate::WallCompliance>> compliance_begun_;

  bool may_begin() const;
  simulate::LumenOptions field_options();
  std::string field_key_text() const;
  ModelStock& models();  // of this surface and wall
  void let_sections_move(ModelStock& stock);
  bool find_field();  // whether the store has it; the stock's model then
};

/// The start of a stage's figures.json, and its end.
Json figures_of(const std::string& stage);
void write_figures(const Json& figures, const std::filesystem::path& folder);

}  // namespace wireplan::pipeline
