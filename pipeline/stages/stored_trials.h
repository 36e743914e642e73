#pragma once
/// The log of planning (plan/trial_log.h) as files: what earlier stages put into their artifacts,
/// and pieces in the store, where every run is kept as soon as it is finished, by a key of what it
/// alone reads. So a stage goes on where it was stopped, and a case that has a run in common with
/// another, or with itself before a change, takes it from there.
#include <array>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/stages/workspace.h"

namespace wireplan::pipeline {

class StoredTrials final : public plan::TrialLog {
 public:
  /// Keeps a reference. Expects the key text of the stage `trials` to be known.
  explicit StoredTrials(Workspace& work);

  std::optional<plan::Measured> find(const plan::Run& run) override;
  void keep(const plan::Run& run, const simulate::TrialResult& trial,
            const plan::Measured& measured) override;
  void keep_other(std::size_t other, const plan::Run& run,
                  const simulate::TrialResult& trial) override;
  std::optional<plan::Scripts> find_scripts() override;
  void keep_scripts(const plan::Scripts&) override {}  // make_manoeuvres() writes them

  /// Puts the trials of candidates from `first_id` on, that were found or kept at this level, into
  /// the folder, and their shapes on the way: the same bytes, not a second time on the disk.
  void place(plan::Level level, int first_id, const std::filesystem::path& folder) const;
  /// An attempt (plan::Plan) for find_played(), out of the way of the trials.
  void place_attempt(int id, const std::filesystem::path& folder) const;

 private:
  struct Files {
    std::filesystem::path trial, shapes;  // the latter empty where there are none
  };
  std::string key_of(const plan::Run& run) const { return key_of(run, shared_key_); }
  std::string key_of(const plan::Run& run, const std::string& shared_key) const;
  std::string shapes_key_of(const plan::Run& run) const;
  const plan::Study& study_of(plan::Level level) const;
  std::optional<Files> locate(const plan::Run& run) const;

  Workspace& work_;
  std::string shared_key_;               // what all runs of the case read
  std::vector<std::string> other_keys_;  // the same toward each of the study's others
  std::array<plan::Study, 3> studies_;
  std::mutex mutex_;  // guards places_ and, of the workspace, `measured` and trials_for_others()
  std::map<std::pair<plan::Level, int>, Files> places_;
};

/// The trial of a candidate at a level that ran it.
simulate::TrialResult read_trial(const Workspace& work, plan::Level level, int id);

/// The trial in full with its shapes on the way; nothing where those were not kept.
std::optional<simulate::TrialResult> find_played(const Workspace& work, int id);

}  // namespace wireplan::pipeline
