#include "pipeline/stages/manoeuvres.h"

#include <algorithm>
#include <array>
#include <utility>

#include "pipeline/files/disk.h"
#include "pipeline/files/trial_file.h"
#include "pipeline/stages/repeats.h"
#include "plan/manoeuvre.h"
#include "plan/search.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// Straight pushes of each wire that a search goes on from.
constexpr int kStartsPerWire = 2;
// Straight plans that are tried under so many disturbances before a search is made.
constexpr std::size_t kPlansTried = 3;
constexpr int kTries = 8;
// Turns of the hub in one script: that scouts find, and that are searched for in full.
constexpr int kTurnsOfScouts = 3, kTurns = 1;

// Of a straight push: that of the highest level that ran it.
struct StraightFile {
  std::string level;
  fs::path path;
};

StraightFile straight_file(const Workspace& work, int id) {
  const fs::path& folder = work.artifact("trials").folder;
  for (const char* level : {kProbeLevel, kScoutLevel}) {
    const fs::path coarse = folder / level / trial_file_name(id);
    if (!fs::exists(folder / trial_file_name(id)) && fs::exists(coarse)) return {level, coarse};
  }
  return {kFullLevel, folder / trial_file_name(id)};
}

// Whether one of the best straight plans works in at least half of a few tries under disturbances.
bool has_steady_plan(Workspace& work, const std::vector<plan::Candidate>& straight,
                     const std::vector<simulate::Outcome>& outcomes) {
  std::vector<std::pair<double, int>> plans;  // score and trial
  for (int id = 0; id < std::ssize(straight); ++id) {
    const StraightFile file = straight_file(work, id);
    const bool reached = outcomes[static_cast<std::size_t>(id)] == simulate::Outcome::kReached;
    if (!reached || file.level != kFullLevel) continue;
    const plan::Repeat as_assumed = judge_trial(work, read_trial_file(file.path));
    if (as_assumed.success) plans.emplace_back(as_assumed.score, id);
  }
  if (plans.empty()) return false;
  std::sort(plans.begin(), plans.end());
  plans.resize(std::min(kPlansTried, plans.size()));

  const Repeats tries = prepare_repeats(work, kTries);
  for (const auto& [score, id] : plans) {
    const plan::Candidate& plan = straight[static_cast<std::size_t>(id)];
    std::array<bool, kTries> works{};
    plan::for_each_slot(
        kTries,
        [&](int slot) {
          const auto s = static_cast<std::size_t>(slot);
          works[s] = run_repeat(work, plan, tries.disturbances[s]).success;
        },
        {.threads = work.options().threads, .progress = {}, .cancelled = work.options().cancelled});
    if (work.options().cancelled && work.options().cancelled()) throw Interrupted();
    if (2 * std::count(works.begin(), works.end(), true) >= kTries) return true;
  }
  return false;
}

// The straight pushes that a search goes on from; none where no search is wanted or needed.
std::vector<plan::Candidate> find_starts(Workspace& work,
                                         const std::vector<plan::Candidate>& straight) {
  const Manoeuvring wanted = work.given().manoeuvres;
  if (wanted == Manoeuvring::kNever) return {};
  std::vector<double> progress;
  std::vector<simulate::Outcome> outcomes;
  for (int id = 0; id < std::ssize(straight); ++id) {
    const simulate::TrialResult trial = read_trial_file(straight_file(work, id).path);
    progress.push_back(plan::find_progress(trial, work.path()));
    outcomes.push_back(trial.outcome);
  }
  std::vector<plan::Candidate> starts;
  for (const int id :
       plan::choose_starts(work.study(), straight, progress, outcomes, kStartsPerWire)) {
    starts.push_back(straight[static_cast<std::size_t>(id)]);
  }
  if (starts.empty() || wanted == Manoeuvring::kAlways) return starts;
  if (has_steady_plan(work, straight, outcomes)) return {};
  return starts;
}

// Scripts of moves that reach the target, and their trials in full.
struct Scripts {
  std::vector<plan::Candidate> found;
  std::vector<simulate::TrialResult> trials;
  long branches = 0;  // that were tried for them
};

// Thousands of pushes are tried, so the search is a scout's. What it finds is run in full, from
// start to end, as it is written down. Where nothing of that reaches, turns are tried in full.
// Throws Interrupted.
Scripts find_scripts(Workspace& work, const plan::Study& study,
                     const std::vector<plan::Candidate>& starts) {
  const plan::BatchOptions batch{.threads = work.options().threads,
                                 .progress = work.options().progress,
                                 .cancelled = work.options().cancelled};
  Scripts scripts;
  const auto run_in_full = [&](plan::Manoeuvres search) {
    scripts.branches += search.branches;
    for (plan::Candidate& candidate : search.found) {
      candidate.moves = moves_of(moves_json(candidate.moves));
    }
    plan::BatchResult run = plan::run_batch(study, search.found, work.model(), batch);
    if (batch.cancelled && batch.cancelled()) throw Interrupted();
    for (std::size_t k = 0; k < run.trials.size(); ++k) {
      if (run.trials[k].outcome != simulate::Outcome::kReached) continue;
      scripts.found.push_back(std::move(search.found[k]));
      scripts.trials.push_back(std::move(run.trials[k]));
    }
  };
  if (starts.empty()) return scripts;
  run_in_full(plan::find_manoeuvres(plan::scout_study(study), starts, work.path(),
                                    work.rigid_model(), kTurnsOfScouts, batch));
  if (!scripts.found.empty()) return scripts;
  run_in_full(plan::find_manoeuvres(study, starts, work.path(), work.model(), kTurns, batch));
  return scripts;
}

}  // namespace

std::vector<plan::Candidate> list_tried(Workspace& work) {
  std::vector<plan::Candidate> tried = plan::list_candidates(work.study());
  const std::size_t straight = tried.size();
  const Json figures = work.figures("manoeuvres");
  for (const Json& script : figures.at("scripts")) {
    plan::Candidate candidate = tried.at(script.at("start"));
    expects(script.at("start") < straight);
    candidate.moves = moves_of(script.at("moves"));
    tried.push_back(std::move(candidate));
  }
  return tried;
}

simulate::TrialResult read_trial(const Workspace& work, std::size_t id) {
  const fs::path straight = straight_file(work, static_cast<int>(id)).path;
  return read_trial_file(fs::exists(straight) ? straight
                                              : work.artifact("manoeuvres").folder /
                                                    trial_file_name(static_cast<int>(id)));
}

std::string level_of(const Workspace& work, std::size_t id) {
  return straight_file(work, static_cast<int>(id)).level;
}

void make_manoeuvres(Workspace& work, const fs::path& folder) {
  plan::Study study = work.study();
  study.insertion.record_every = study.insertion.length;  // shapes on the way are not kept
  const std::vector<plan::Candidate> straight = plan::list_candidates(study);
  const std::vector<plan::Candidate> starts = find_starts(work, straight);
  const Scripts scripts = find_scripts(work, study, starts);

  Json figures = figures_of("manoeuvres");
  figures["starts"] = starts.size();
  figures["branches"] = scripts.branches;
  figures["scripts"] = Json::array();
  if (!scripts.found.empty()) fs::create_directories(folder / "trials");
  for (std::size_t k = 0; k < scripts.found.size(); ++k) {
    const plan::Candidate& script = scripts.found[k];
    const auto start = std::find_if(straight.begin(), straight.end(), [&](const auto& other) {
      return other.wire == script.wire && other.inclination == script.inclination &&
             other.azimuth == script.azimuth && other.roll == script.roll;
    });
    figures["scripts"].push_back(
        {{"start", start - straight.begin()}, {"moves", moves_json(script.moves)}});
    write_whole(trial_text(study, script, scripts.trials[k]),
                folder / trial_file_name(static_cast<int>(straight.size() + k)));
  }
  write_figures(figures, folder);
}

}  // namespace wireplan::pipeline
