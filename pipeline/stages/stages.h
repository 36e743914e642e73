#pragma once
/// The stages of `wireplan run` as one table, and the cascade over it: each stage is looked up in
/// the store by a key of what it reads, and run only where that finds nothing. What a stage reads
/// of earlier ones counts by its contents, so a stage that comes out the same stops the cascade.
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/stages/makers.h"

namespace wireplan::pipeline {

struct Stage {
  std::string name;
  int version = 1;                           // raised when its results change
  bool reads_input = false;                  // the volume, surface or labels that it starts from
  bool reads_labels = false;                 // the case's labels, beside a volume or alone
  std::vector<std::string> after = {};       // earlier stages whose artifacts it reads
  std::vector<std::string> parameters = {};  // it reads, as JSON pointers into used_parameters()
  bool names_branches = false;               // by the names of accesses and targets
  bool names_program = false;                // its artifact tells version and build
  void (*make)(Workspace&, const std::filesystem::path& folder) = nullptr;
};

/// In the order in which they run; a case that enters at a surface has no volume and no segment,
/// one that enters at labels alone no volume.
/// Those up to `surface`, and `wall`, are the same for all sections of a case.
std::vector<Stage> stages_of(const Case& given);

/// case_parameters() with file names in the place of paths, the section's access and target beside
/// the lists that they are of, and which sizes of access_limits are "assumed".
Json used_parameters(const Case& given);

enum class StageState {
  kCached,    // was in the store
  kMade,      // was run
  kWouldRun,  // of a dry run: is not in the store
};

struct StageOutcome {
  std::string stage;
  StageState state = StageState::kCached;
  double seconds = 0.0;                    // this time: of the look-up or the run
  std::vector<std::string> reasons = {};   // why it runs; empty where it does not
  std::vector<std::string> warnings = {};  // that are told as it ends
};

struct RunOptions {
  std::filesystem::path cache;
  std::string to;                  // last stage; empty: all
  std::vector<std::string> force;  // stages to run although they are in the store
  bool dry_run = false;            // look only
  WorkOptions work;
  std::function<void(const StageOutcome&)> on_stage;  // after each; may be empty
  /// Artifacts of other sections that this one reads, by the names of Workspace.
  std::vector<std::pair<std::string, Artifact>> beside = {};
  /// Called instead of running `to`, where that is not in the store; may be empty.
  std::function<void(Workspace&)> instead = {};
  /// Called before stage plans is made, which takes a third of a run and more; may be empty.
  std::function<void(Workspace&)> before_plans = {};
};

struct RunResult {
  std::vector<StageOutcome> stages;
  std::vector<Artifact> artifacts;  // of the stages that were cached or made
  std::optional<FileLock> use;      // they stay in the cache as long as this
};

/// What a stage says of the world; the text names case file and stage.
class StageError : public Error {
 public:
  StageError(std::string of, const std::string& text) : Error(text), stage(std::move(of)) {}
  const std::string stage;
};

/// Throws `StageError`; `Error` for a stage name that the case does not have; `Interrupted` where
/// the user stopped it. What was finished by then is in the store.
RunResult run_stages(const Case& given, const RunOptions& options);

/// The same for other stages than those of stages_of().
RunResult run_stages(const Case& given, const RunOptions& options,
                     const std::vector<Stage>& stages);

}  // namespace wireplan::pipeline
