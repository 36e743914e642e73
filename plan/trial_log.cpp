#include "plan/trial_log.h"

#include <algorithm>
#include <mutex>
#include <tuple>
#include <utility>

#include "plan/refine.h"
#include "plan/search.h"
#include "preprocess/cores.h"

namespace wireplan::plan {
namespace {

simulate::TrialResult simulate_run(const Study& study, const Run& run,
                                   const simulate::VesselModel& vessel, SharedTools& shared) {
  if (run.disturbance) {
    return run_disturbed(study, run.candidate, vessel, *run.disturbance, shared);
  }
  if (run.elements) {
    Candidate candidate = run.candidate;
    Study changed = refined_study(study, candidate, run.elements->factor, run.elements->insertion);
    if (run.elements->setting) change_setting(*run.elements->setting, changed, candidate);
    return run_candidate(changed, candidate, vessel, shared);
  }
  simulate::TrialResult trial = run_candidate(study, run.candidate, vessel, shared);
  const bool may_be_played = trial.outcome == simulate::Outcome::kReached || run.shapes;
  if (run.level != Level::kFull || !may_be_played) trial.shapes.clear();
  return trial;
}

/// A scout tells of the study's other targets too.
simulate::TrialResult simulate_run_and_others(const Study& study, const Run& run,
                                              const simulate::VesselModel& vessel,
                                              SharedTools& shared, TrialLog& log) {
  const bool alone = study.others.empty() || run.level != Level::kScout || !run.is_plain() ||
                     !run.candidate.moves.empty();
  if (alone) return simulate_run(study, run, vessel, shared);
  std::vector<simulate::TrialResult> trials = run_for_all_goals(study, run.candidate, vessel);
  for (simulate::TrialResult& trial : trials) trial.shapes.clear();
  for (std::size_t k = 1; k < trials.size(); ++k) log.keep_other(k - 1, run, trials[k]);
  return std::move(trials.front());
}

bool same_elements(const Run& a, const Run& b) {
  if (!a.elements || !b.elements) return !a.elements && !b.elements;
  return a.elements->factor == b.elements->factor && a.elements->setting == b.elements->setting;
}

/// Whether the way up of the one is the other's, or a part of it.
bool begin_alike(const Run& a, const Run& b) {
  const Candidate &one = a.candidate, &other = b.candidate;
  const auto start = [](const Candidate& c) {
    return std::tuple(c.catheter, c.wire, c.first_wire, c.inclination, c.azimuth, c.roll);
  };
  return one.catheter >= 0 && start(one) == start(other) && !one.steps.empty() &&
         !other.steps.empty() && one.steps.front() == other.steps.front() &&
         a.disturbance == b.disturbance && same_elements(a, b);
}

/// Runs that are made one after the other, since they begin alike; no more than each thread has to
/// make.
std::vector<std::vector<std::size_t>> group_runs(const std::vector<Run>& runs,
                                                 const std::vector<std::size_t>& missing,
                                                 int threads) {
  const auto at_once = static_cast<std::size_t>(threads > 0 ? threads : core_count());
  const std::size_t most = std::max<std::size_t>(1, missing.size() / at_once);
  std::vector<std::vector<std::size_t>> groups;
  for (const std::size_t k : missing) {
    const bool alone = runs[k].candidate.catheter < 0;  // such runs are many, and share no way up
    const auto group =
        alone ? groups.end() : std::find_if(groups.begin(), groups.end(), [&](const auto& own) {
          return own.size() < most && begin_alike(runs[own.front()], runs[k]);
        });
    if (group == groups.end()) {
      groups.push_back({k});
    } else {
      group->push_back(k);
    }
  }
  return groups;
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

const char* wall_of_scouts(bool moves) {
  return moves ? "a wall that moves as a whole but takes no dents" : "a rigid wall";
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
  const std::vector<std::vector<std::size_t>> groups = group_runs(runs, missing, batch.threads);
  std::mutex mutex;  // of the count, and of who is told of it
  std::size_t done = 0;
  const auto count_one = [&] {
    const std::scoped_lock lock(mutex);
    ++done;
    const std::size_t known = runs.size() - missing.size();
    if (batch.progress) {
      batch.progress(static_cast<int>(known + done), static_cast<int>(runs.size()));
    }
  };
  for_each_slot(static_cast<int>(groups.size()),
                [&](int slot) {
                  SharedTools shared;
                  for (const std::size_t k : groups[static_cast<std::size_t>(slot)]) {
                    if (batch.cancelled && batch.cancelled()) return;
                    expects(runs[k].level == level);
                    const double start = thread_cpu_seconds();
                    const simulate::TrialResult trial =
                        simulate_run_and_others(own, runs[k], model, shared, log);
                    all[k] = measure(trial, own, vessel.path);
                    all[k].cpu_seconds = thread_cpu_seconds() - start;
                    log.keep(runs[k], trial, all[k]);
                    count_one();
                  }
                },
                {.threads = batch.threads, .cancelled = batch.cancelled});
  if (done < missing.size()) throw Interrupted();
  spent.runs += static_cast<int>(missing.size());
  for (const std::size_t k : missing) spent.cpu_seconds += all[k].cpu_seconds;
  return all;
}

}  // namespace wireplan::plan
