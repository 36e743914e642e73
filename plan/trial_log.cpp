#include "plan/trial_log.h"

#include <algorithm>
#include <utility>

#include "plan/refine.h"
#include "plan/search.h"

namespace wireplan::plan {
namespace {

simulate::TrialResult simulate_run(const Study& study, const Run& run,
                                   const simulate::VesselModel& vessel) {
  if (run.disturbance) return run_disturbed(study, run.candidate, vessel, *run.disturbance);
  if (run.elements) {
    Candidate candidate = run.candidate;
    Study changed = refined_study(study, candidate, run.elements->factor, run.elements->insertion);
    if (run.elements->setting) change_setting(*run.elements->setting, changed, candidate);
    return run_candidate(changed, candidate, vessel);
  }
  simulate::TrialResult trial = run_candidate(study, run.candidate, vessel);
  const bool may_be_played = trial.outcome == simulate::Outcome::kReached || run.shapes;
  if (run.level != Level::kFull || !may_be_played) trial.shapes.clear();
  return trial;
}

/// A scout tells of the study's other targets too.
simulate::TrialResult simulate_run_and_others(const Study& study, const Run& run,
                                              const simulate::VesselModel& vessel, TrialLog& log) {
  const bool alone = study.others.empty() || run.level != Level::kScout || !run.is_plain() ||
                     !run.candidate.moves.empty();
  if (alone) return simulate_run(study, run, vessel);
  std::vector<simulate::TrialResult> trials = run_for_all_goals(study, run.candidate, vessel);
  for (simulate::TrialResult& trial : trials) trial.shapes.clear();
  for (std::size_t k = 1; k < trials.size(); ++k) log.keep_other(k - 1, run, trials[k]);
  return std::move(trials.front());
}

}  // namespace

const char* level_name(Level level) {
  switch (level) {
    case Level::kScout:
      return "scout";
    case Level::kProbe:
      return "probe";
    case Level::kFull:
      return "full";
  }
  throw LogicError("a level without a name");
}

Study study_at(const Study& study, Level level) {
  Study own = level == Level::kScout ? scout_study(study) : study;
  if (level != Level::kFull) own.insertion.record_every = own.insertion.length;  // no shapes
  return own;
}

std::vector<Measured> find_or_run(const Study& study, const PlanVessel& vessel,
                                  const std::vector<Run>& runs, TrialLog& log,
                                  const BatchOptions& batch, Spent& spent) {
  std::vector<Measured> all(runs.size());
  std::vector<std::size_t> missing;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    if (std::optional<Measured> known = log.find(runs[k])) {
      all[k] = std::move(*known);
    } else {
      missing.push_back(k);
    }
  }
  if (missing.empty()) return all;

  const Level level = runs[missing.front()].level;
  const simulate::VesselModel& model =
      level == Level::kFull ? vessel.model() : vessel.scout_model();
  const Study own = study_at(study, level);
  const int found = static_cast<int>(runs.size() - missing.size());
  BatchOptions options{.threads = batch.threads, .cancelled = batch.cancelled};
  if (batch.progress) {
    options.progress = [&](int done, int count) { batch.progress(found + done, found + count); };
  }
  const std::vector<bool> finished = for_each_slot(
      static_cast<int>(missing.size()),
      [&](int slot) {
        const std::size_t k = missing[static_cast<std::size_t>(slot)];
        expects(runs[k].level == level);
        const double start = thread_cpu_seconds();
        const simulate::TrialResult trial = simulate_run_and_others(own, runs[k], model, log);
        all[k] = measure(trial, own, vessel.path);
        all[k].cpu_seconds = thread_cpu_seconds() - start;
        log.keep(runs[k], trial, all[k]);
      },
      options);
  if (std::find(finished.begin(), finished.end(), false) != finished.end()) throw Interrupted();
  spent.runs += static_cast<int>(missing.size());
  for (const std::size_t k : missing) spent.cpu_seconds += all[k].cpu_seconds;
  return all;
}

}  // namespace wireplan::plan
