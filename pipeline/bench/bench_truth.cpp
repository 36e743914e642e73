// Stated errors against true ones: trials of cases with elements of h and h/4, and with settings
// changed that should not matter.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <set>

#include "pipeline/bench/bench_walls.h"
#include "pipeline/bench/opened_case.h"
#include "pipeline/bench/timed_batch.h"
#include "pipeline/bench/truth_results.h"
#include "pipeline/files/text.h"
#include "pipeline/stages/plan_artifact.h"
#include "plan/judge.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;
using plan::Measured;
using plan::Run;

constexpr int kTrialsPerCase = 12;  // where none is asked for
constexpr double kShortest = 20.0;  // wire in the body that tells something               [mm]
constexpr double kTruthFactor = 0.25, kPushFactor = 0.125;  // of h
constexpr std::size_t kEachFine = 3;  // one in so many is run with the latter, which costs most
constexpr double kQuickLength = 60.0, kQuickEdge = 4.0;  // of the quick size             [mm]

/// Keeps nothing: every run is simulated.
class NoLog final : public plan::TrialLog {
 public:
  std::optional<Measured> find(const Run&) override { return {}; }
  void keep(const Run&, const simulate::TrialResult&, const Measured&) override {}
  std::optional<plan::Scripts> find_scripts() override { return plan::Scripts{}; }
  void keep_scripts(const plan::Scripts&) override {}
};

/// A trial of a case, to be held against the truth.
struct Chosen {
  int id = 0;
  plan::Candidate candidate{};
  std::optional<int> rank{};
};

bool came_as_far(const Measured& trial, double insertion) {
  return trial.nodes.cols() > 0 &&
         std::abs(trial.metrics.insertion - insertion) <= 1e-6 * insertion;
}

std::string why_short(const Measured& trial, const char* elements, double insertion) {
  return format("with elements of %s the wire came to %.1f of %.1f mm: ", elements,
                trial.metrics.insertion, insertion) +
         trial.reason;
}

class TruthRuns {
 public:
  TruthRuns(const std::string& case_name, const plan::Study& study, const plan::PlanVessel& vessel,
            bool with_fine_push)
      : case_name_(case_name), study_(study), vessel_(vessel), with_fine_push_(with_fine_push) {}

  std::vector<TruthTrial> measure(const std::vector<Chosen>& chosen) {
    std::vector<Run> plain;
    for (const Chosen& each : chosen) plain.push_back({.id = each.id, .candidate = each.candidate});
    const std::vector<Measured> trials = run_all(plain);
    std::vector<TruthTrial> rows;
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      if (trials[k].metrics.insertion < kShortest) continue;
      rows.push_back(measure_one(chosen[k], trials[k], with_fine_push_ && k % kEachFine == 0));
      std::cerr << format("truth: %s, trial %d (%zu of %zu)\n", case_name_.c_str(), chosen[k].id,
                          k + 1, chosen.size());
    }
    return rows;
  }

 private:
  std::vector<Measured> run_all(const std::vector<Run>& runs) {
    return plan::find_or_run(study_, vessel_, runs, log_, {}, spent_);
  }

  TruthTrial measure_one(const Chosen& chosen, const Measured& trial, bool with_fine_push) {
    TruthTrial row{.case_name = case_name_,
                   .id = chosen.id,
                   .wire = study_.wires[static_cast<std::size_t>(chosen.candidate.wire)].name,
                   .candidate = chosen.candidate,
                   .rank = chosen.rank,
                   .trial = trial};
    const double insertion = trial.metrics.insertion;
    std::vector<Run> runs = plan::refinement_runs(chosen.id, chosen.candidate, insertion);
    const auto stated_count = static_cast<std::ptrdiff_t>(runs.size());
    const auto add = [&](const plan::OtherElements& elements) {
      runs.push_back({.id = chosen.id, .candidate = chosen.candidate, .elements = elements});
    };
    add({.factor = kTruthFactor, .insertion = insertion});
    const std::vector<plan::Setting> settings = plan::settings_that_act(study_, chosen.candidate);
    for (const plan::Setting setting : settings) {
      add({.insertion = insertion, .setting = setting});
    }
    if (with_fine_push) add({.factor = kPushFactor, .insertion = insertion});
    const std::vector<Measured> ends = run_all(runs);

    row.stated = estimate({runs.begin(), runs.begin() + stated_count},
                          {ends.begin(), ends.begin() + stated_count});
    row.note = row.stated.reason;
    const Measured& base = ends[1];  // with the study's own elements, to that insertion
    if (!came_as_far(base, insertion)) return row;
    const auto first = static_cast<std::size_t>(stated_count);
    const Measured& finer = ends[first];
    for (std::size_t k = 0; k < settings.size(); ++k) {
      const Measured& other = ends[first + 1 + k];
      if (other.nodes.cols() == 0) continue;
      row.apart.emplace_back(settings[k], plan::find_difference(base, other).tip);
    }
    if (came_as_far(finer, insertion)) {
      row.truth = plan::find_difference(base, finer);
    } else {
      row.note += (row.note.empty() ? "" : "; ") + why_short(finer, "h/4", insertion);
    }
    if (with_fine_push && came_as_far(ends.back(), insertion)) {
      row.fine_push_force = ends.back().metrics.peak_push_force;
    }
    return row;
  }

  /// The error as a plan's is stated, by these runs of one trial.
  plan::Refinement estimate(std::vector<Run> runs, std::vector<Measured> ends) {
    for (const Run& finest : plan::finest_runs(study_, runs, ends)) {
      runs.push_back(finest);
      ends.push_back(run_all({finest}).front());
    }
    return plan::estimate_error_of(study_, runs.front().id, runs, ends);
  }

  std::string case_name_;
  const plan::Study& study_;
  const plan::PlanVessel& vessel_;
  bool with_fine_push_;
  NoLog log_;
  plan::Spent spent_;
};

/// The best plans after the search, up to half of `count`, and evenly spread those that are none.
std::vector<Chosen> choose_trials(const plan::Study& study, const plan::Plan& plan, int count) {
  const plan::Yardstick by;
  const plan::Judgement judgement = plan::judge(study, plan, by.limits, by.weights);
  std::vector<Chosen> chosen;
  std::set<int> ranked;
  const auto& plans = judgement.ranking.plans;
  for (std::size_t k = 0; k < plans.size(); ++k) {
    ranked.insert(plans[k].trial);
    if (2 * std::ssize(chosen) >= count) continue;
    chosen.push_back({.id = plans[k].trial,
                      .candidate = plan.candidates[static_cast<std::size_t>(plans[k].trial)],
                      .rank = static_cast<int>(k) + 1});
  }
  std::vector<int> others;
  for (int id = 0; id < std::ssize(plan.candidates); ++id) {
    if (ranked.count(id) == 0) others.push_back(id);
  }
  const std::size_t wanted =
      std::min(others.size(), static_cast<std::size_t>(count) - chosen.size());
  for (std::size_t k = 0; k < wanted; ++k) {
    const int id = others[(2 * k + 1) * others.size() / (2 * wanted)];
    chosen.push_back({.id = id, .candidate = plan.candidates[static_cast<std::size_t>(id)]});
  }
  return chosen;
}

std::vector<TruthTrial> measure_case(const Case& given, const BenchOptions& options) {
  const OpenedCase opened = open_case(given, options.cache);
  const plan::Study& study = opened.work->study();
  const plan::PlanVessel vessel = plan_vessel(*opened.work);
  NoLog log;
  plan::PlanOptions search{.exhaustive = given.exhaustive,
                           .manoeuvres = plan::Manoeuvring::kNever,
                           .until = plan::PlanOptions::Until::kTrials};
  const plan::Plan plan = plan::make_plan(study, vessel, search, log);
  const int count = options.trials > 0 ? options.trials : kTrialsPerCase;
  return TruthRuns(given.name, study, vessel, /*with_fine_push=*/true)
      .measure(choose_trials(study, plan, count));
}

/// A vessel made in code, for the quick size.
std::vector<TruthTrial> measure_tree() {
  const Vessel vessel = make_arterial_tree(kQuickEdge);
  const InsertionBatch batch =
      make_batch("arterial-tree", vessel, "rigid",
                 {straight_wire(50.0, 2.0 * kQuickLength), curved_wire(2.0 * kQuickLength)}, {0.0},
                 {.length = kQuickLength, .friction = 0.04});
  const SharedModel shared(vessel, "rigid");
  const auto model = [&]() -> const simulate::VesselModel& { return *shared.vessel_model; };
  const plan::PlanVessel where{
      .path = vessel.path, .yields = false, .model = model, .rigid_model = model};
  std::vector<Chosen> chosen;
  for (int id = 0; id < std::ssize(batch.candidates); ++id) {
    chosen.push_back({.id = id, .candidate = batch.candidates[static_cast<std::size_t>(id)]});
  }
  return TruthRuns("arterial-tree", batch.study, where, /*with_fine_push=*/false).measure(chosen);
}

/// Folders of the cases that come with the program, in order.
std::vector<std::string> known_cases() {
  const fs::path folder = cases_folder();
  std::vector<std::string> found;
  std::error_code absent;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, absent)) {
    if (fs::exists(entry.path() / "case.json")) found.push_back(entry.path().string());
  }
  if (found.empty()) {
    throw Error(
        "bench: no case was found in " + folder.string() +
        ", expected folders with a case.json; name the cases: wireplan bench truth CASE...");
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

BenchReport bench_truth(const BenchOptions& options) {
  std::vector<TruthTrial> trials;
  std::vector<SkippedCase> skipped;
  const bool all = options.cases.empty();
  if (all && options.quick) trials = measure_tree();
  const std::vector<std::string> cases = !all            ? options.cases
                                         : options.quick ? std::vector<std::string>{}
                                                         : known_cases();
  for (const std::string& path : cases) {
    std::optional<Case> given;
    try {
      given = read_one_section(path);
    } catch (const Error& error) {  // its data is not here
      if (!all) throw;
      skipped.push_back({fs::path(path).filename().string(), error.what()});
      continue;
    }
    std::vector<TruthTrial> own = measure_case(*given, options);
    if (own.empty()) {
      skipped.push_back({given->name, format("no trial brings %g mm of wire in", kShortest)});
    }
    trials.insert(trials.end(), std::make_move_iterator(own.begin()),
                  std::make_move_iterator(own.end()));
  }
  if (trials.empty()) {
    std::string text = "bench: nothing to compare:";
    for (const SkippedCase& each : skipped) text += "\n" + each.name + ": " + each.reason;
    throw Error(text);
  }
  BenchReport report;
  report.description = describe_truth();
  report.rows = truth_rows(trials);
  report.results = truth_results(trials, skipped);
  report.text = truth_text(report.rows, report.results);
  report.plot = plot_truth(trials);
  return report;
}

}  // namespace wireplan::pipeline
