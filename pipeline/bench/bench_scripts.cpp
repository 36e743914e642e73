// The search for scripts of catheter and wire against one that brings the wire out of every hook of
// the template's grid, and runs in full and repeats whatever reaches: what each puts first, and for
// how much.
#include <algorithm>
#include <iostream>
#include <limits>
#include <memory>
#include <mutex>

#include "pipeline/bench/bench_report.h"
#include "pipeline/bench/bench_walls.h"
#include "pipeline/bench/opened_case.h"
#include "pipeline/bench/timed_batch.h"
#include "pipeline/files/text.h"
#include "pipeline/report/picture.h"
#include "pipeline/report/plot.h"
#include "pipeline/stages/plan_artifact.h"
#include "plan/judge.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/cores.h"
#include "simulate/insertion/way.h"

namespace wireplan::pipeline {
namespace {

using plan::Candidate;
using plan::Hooks;
using plan::Measured;
using plan::Plan;
using plan::RankedPlan;
using plan::Run;

constexpr double kMostOfTime = 0.25;  // of the other search's, that the search may take

bool same_run(const Run& a, const Run& b) {
  return a.level == b.level && a.disturbance == b.disturbance && a.elements == b.elements &&
         a.candidate == b.candidate;
}

/// What a search made is known to it, as with the store; empty at its start.
class OwnLog final : public plan::TrialLog {
 public:
  std::optional<Measured> find(const Run& run) override {
    const auto known = std::find_if(runs_.begin(), runs_.end(),
                                    [&](const auto& own) { return same_run(own.first, run); });
    if (known == runs_.end()) return {};
    return known->second;
  }
  void keep(const Run& run, const simulate::TrialResult&, const Measured& measured) override {
    const std::scoped_lock lock(mutex_);
    runs_.emplace_back(run, measured);
  }
  std::optional<plan::Scripts> find_scripts() override { return {}; }
  void keep_scripts(const plan::Scripts&) override {}

 private:
  std::mutex mutex_;
  std::vector<std::pair<Run, Measured>> runs_;
};

/// A case as both searches see it.
struct Searched {
  std::string name;
  const plan::Study& study;
  const plan::PlanVessel& vessel;
  plan::PlanOptions options = {};
  plan::Limits limits = {};
  plan::Weights weights = {};
};

struct Search {
  Plan plan;
  double cpu = 0.0;  //                                                                       [s]
  plan::Ranking ranking;
};

Search search(const Searched& given, Hooks hooks) {
  plan::PlanOptions options = given.options;
  options.hooks = hooks;
  if (hooks == Hooks::kEvery) {  // which is steadiest is known of those alone that are repeated
    options.robustness.plans = std::numeric_limits<int>::max();
  }
  OwnLog log;
  const double start = process_cpu_seconds();
  Search made;
  made.plan = plan::make_plan(given.study, given.vessel, options, log);
  made.cpu = process_cpu_seconds() - start;
  made.ranking = plan::judge(given.study, made.plan, given.limits, given.weights).ranking;
  return made;
}

long count_scripts(const Plan& plan) {
  return std::count_if(plan.candidates.begin(), plan.candidates.end(),
                       [](const Candidate& candidate) { return candidate.catheter >= 0; });
}

/// The trial with all that is known of it, as the last of another plan.
void add_trial(const Plan& from, int trial, Plan& to) {
  const auto k = static_cast<std::size_t>(trial);
  const int id = static_cast<int>(to.candidates.size());
  to.candidates.push_back(from.candidates[k]);
  to.levels.push_back(from.levels[k]);
  to.trials.push_back(from.trials[k]);
  for (plan::Refinement own : from.refinements) {
    if (own.trial != trial) continue;
    own.trial = id;
    to.refinements.push_back(std::move(own));
  }
  for (plan::RepeatedTrials own : from.repeated) {
    if (own.trial != trial) continue;
    own.trial = id;
    to.repeated.push_back(std::move(own));
  }
}

/// What a search puts first.
void put_first(Json& row, const std::string& name, const Searched& given, const Search& made) {
  const auto& plans = made.ranking.plans;
  const RankedPlan* first = plans.empty() ? nullptr : &plans.front();
  std::size_t repeats = 0;
  for (const plan::RepeatedTrials& own : made.plan.repeated) {
    if (first != nullptr && own.trial == first->trial) repeats = own.trials.size();
  }
  const auto value = [&](auto part) {
    return first != nullptr ? Json(part(*first)) : Json(nullptr);
  };
  row[name + "_scripts"] = count_scripts(made.plan);
  row[name + "_tried"] = made.plan.scripts.branches;
  row[name + "_first"] = value([&](const RankedPlan& plan) {
    const Candidate& candidate = made.plan.candidates[static_cast<std::size_t>(plan.trial)];
    return plan::describe(given.study, candidate) + ": " +
           plan::describe_script(given.study, candidate, given.study.insertion.length);
  });
  row[name + "_safe"] = value([](const RankedPlan& plan) { return clean(plan.expected_safe); });
  row[name + "_repeats"] = value([&](const RankedPlan&) { return repeats; });
  row[name + "_score"] = value([](const RankedPlan& plan) { return clean(plan.expected_score); });
  row[name + "_tip_error_mm"] = first != nullptr ? number_or_null(first->tip_error) : Json(nullptr);
  row[name + "_cpu_s"] = clean(made.cpu);
}

/// Where the search's first plan stands among the other's, and whether that is with its first.
void put_place(Json& row, const Searched& given, const Search& coarse, const Search& every) {
  row["cpu_ratio"] = clean(coarse.cpu / std::max(every.cpu, 1e-9));
  row["rank"] = nullptr;
  row["tied"] = every.ranking.plans.empty() ? Json(nullptr) : Json(false);
  if (coarse.ranking.plans.empty()) return;
  Plan both = every.plan;
  add_trial(coarse.plan, coarse.ranking.plans.front().trial, both);
  const int own = static_cast<int>(both.candidates.size()) - 1;
  const auto plans = plan::judge(given.study, both, given.limits, given.weights).ranking.plans;
  const auto place = std::find_if(plans.begin(), plans.end(),
                                  [&](const RankedPlan& plan) { return plan.trial == own; });
  const std::vector<int>& tied = plans.front().tied_with;
  row["rank"] = place - plans.begin() + 1;
  row["tied"] = place == plans.begin() || std::find(tied.begin(), tied.end(), own) != tied.end();
}

/// Expects that both searches are of scripts, not of wires alone.
void expect_scripts(const Searched& given, bool searched) {
  if (searched) return;
  throw Error(given.name +
              ": no script of catheter and wire is searched for, expected a case with "
              "\"catheters\" that fit, and a target that wires alone do not reach; or give "
              "--set manoeuvres=always");
}

Json compare_searches(const Searched& given) {
  expect_scripts(given, !given.study.catheters.empty());
  given.vessel.scout_model();  // neither search makes them
  given.vessel.model();
  const Search coarse = search(given, Hooks::kBest);
  const auto& pairs = coarse.plan.scripts.pairs;
  expect_scripts(given, std::any_of(pairs.begin(), pairs.end(),
                                    [](const plan::PairFindings& pair) { return pair.tried(); }));
  std::cerr << format("scripts: %s, the search: %.0f s of CPU\n", given.name.c_str(), coarse.cpu);
  const Search every = search(given, Hooks::kEvery);
  std::cerr << format("scripts: %s, every hook: %.0f s of CPU\n", given.name.c_str(), every.cpu);
  Json row;
  row["case"] = given.name;
  put_first(row, "search", given, coarse);
  put_first(row, "every_hook", given, every);
  put_place(row, given, coarse, every);
  return row;
}

Json compare_in_case(const std::string& path, const BenchOptions& options) {
  const Case given = read_one_section(path, options.overrides);
  const OpenedCase opened = open_case(given, options.cache);
  Workspace& work = *opened.work;
  const plan::PlanVessel vessel = plan_vessel(work);
  return compare_searches({.name = given.name,
                           .study = work.study(),
                           .vessel = vessel,
                           .options = plan_options(work, plan::PlanOptions::Until::kEnd),
                           .limits = given.limits,
                           .weights = given.weights});
}

/// Toward the branch, with a soft wire and a catheter of one hook.
plan::Study study_of(const Vessel& vessel) {
  plan::Study study;
  study.wires = {{.name = "soft",
                  .radius = 0.44,
                  .sections = {{.length = 30.0, .bending_stiffness = 2.0},
                               {.length = 1470.0, .bending_stiffness = 20.0}},
                  .friction = 0.04}};
  const double hook = 4.0 * kPi;
  plan::Catheter& catheter = study.catheters.emplace_back();
  catheter.tool.wire = {
      .name = "hook",
      .radius = 0.83,
      .sections = {{.length = 8.0, .bending_stiffness = 99.0},
                   {.length = hook, .bending_stiffness = 99.0, .rest_curvature = 0.125},
                   {.length = 642.0 - hook, .bending_stiffness = 332.0}},
      .friction = 0.1};
  catheter.tool.inner_radius = 0.5;
  study.inclinations = study.azimuths = study.rolls = {0.0};
  study.access = vessel.path.points.col(0);
  const auto way = std::make_shared<simulate::Way>(
      vessel.path, preprocess::find_tree(vessel.surface, study.access));
  study.goal = {.point = way->section().center,
                .radius = way->section().radius,
                .at_section = true,
                .way = way};
  study.insertion.length = 200.0;
  study.insertion.element_length = 1.5;
  study.insertion.friction = 0.04;
  return study;
}

/// A vessel made in code, for the quick size.
Json compare_in_branched_aorta() {
  const Vessel vessel = make_branched_aorta();
  const SharedModel shared(vessel, "rigid");
  const auto model = [&]() -> const simulate::VesselModel& { return *shared.vessel_model; };
  const plan::PlanVessel where{
      .path = vessel.path, .yields = false, .model = model, .rigid_model = model};
  const plan::Study study = study_of(vessel);
  return compare_searches({.name = "branched-aorta",
                           .study = study,
                           .vessel = where,
                           .options = {.robustness = {.repeats = 2, .plans = 1}}});
}

Json scripts_results(const std::vector<Json>& rows) {
  Json worst = nullptr;
  int tied = 0, compared = 0;
  for (const Json& row : rows) {
    if (row.at("tied").is_null()) continue;
    ++compared;
    tied += row.at("tied").get<bool>() ? 1 : 0;
    const double ratio = row.at("cpu_ratio");
    if (worst.is_null() || ratio > worst.get<double>()) worst = ratio;
  }
  const Json share = compared > 0 ? Json(static_cast<double>(tied) / compared) : Json(nullptr);
  Json results;
  results["cases"] = rows.size();
  results["compared"] = compared;
  results["tied"] = tied;
  results["aims"] = {
      aim_entry("part of the cases whose first plan is tied with the first of every hook", 1.0,
                true, share),
      aim_entry("CPU time of the search over that of every hook, worst case", kMostOfTime, false,
                worst)};
  return results;
}

std::string scripts_text(const std::vector<Json>& rows, const Json& results) {
  std::vector<Json> shown;
  std::string scripts;
  for (const Json& row : rows) {
    Json line;
    for (const auto& [key, value] : row.items()) {
      if (!key.ends_with("_first")) line[key] = value;
    }
    shown.push_back(std::move(line));
    for (const char* name : {"search", "every_hook"}) {
      const Json& first = row.at(std::string(name) + "_first");
      scripts += row.at("case").get<std::string>() + ", " + name + ": " +
                 (first.is_null() ? "no plan" : first.get<std::string>()) + "\n";
    }
  }
  return table_text(shown) + "\nFirst plans:\n" + scripts + "\n" + aims_text(results.at("aims"));
}

Picture plot_scripts(const std::vector<Json>& rows) {
  std::vector<FrontPlot> plots;
  for (const Json& row : rows) {
    FrontPlot plot{.title = row.at("case"),
                   .x_label = "CPU time, s",
                   .y_label = "score of the first plan (1: none)",
                   .lines = {}};
    for (std::size_t k = 0; k < 2; ++k) {
      const std::string name = k == 0 ? "search" : "every_hook";
      const Json& score = row.at(name + "_score");
      plot.lines.push_back({.entry = k,
                            .points = {{row.at(name + "_cpu_s").get<double>(),
                                        score.is_null() ? 1.0 : score.get<double>()}}});
    }
    plots.push_back(std::move(plot));
  }
  return draw_fronts(
      "the search for scripts against every hook", plots, 2,
      {{.name = "search", .color = wire_color(0)}, {.name = "every hook", .color = wire_color(1)}});
}

}  // namespace

BenchReport bench_scripts(const BenchOptions& options) {
  if (options.cases.empty() && !options.quick) {
    throw Error(
        "bench: scripts is given no case, expected cases with catheters: wireplan bench scripts "
        "cases/abdomen/renal-catheter.json; or --quick");
  }
  BenchReport report;
  if (options.cases.empty()) report.rows.push_back(compare_in_branched_aorta());
  for (const std::string& path : options.cases) {
    report.rows.push_back(compare_in_case(path, options));
  }
  report.description = {
      {"search", "as a case is planned: of each start the wire is brought out of the best hooks"},
      {"every_hook",
       "out of every state of the template's grid of depths, withdrawals, turns and pulls; all "
       "scripts that reach are run in full and repeated, none is weighed before"},
      {"columns",
       {{"..._tried", "steps that the search made"},
        {"..._scripts", "run in full"},
        {"..._safe", "part of its repeats in which the first plan is safe"},
        {"rank", "of the search's first plan among all plans of every hook"},
        {"tied", "whether it is their first or tied with it; null: they have no plan"}}}};
  report.results = scripts_results(report.rows);
  report.text = scripts_text(report.rows, report.results);
  report.plot = plot_scripts(report.rows);
  return report;
}

}  // namespace wireplan::pipeline
