#include "plan/make_plan.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "plan/judge.h"
#include "plan/manoeuvre.h"
#include "plan/repeat_choice.h"
#include "plan/wire_exchange.h"

namespace wireplan::plan {
namespace {

// Straight pushes of each wire that a search for scripts goes on from.
constexpr int kStartsPerWire = 2;
// Straight plans that are tried under so many disturbances before a search is made.
constexpr std::size_t kPlansTried = 3;
constexpr int kTries = 8;
// Turns of the hub in one script: that scouts find, and that are searched for in full.
constexpr int kTurnsOfScouts = 3, kTurns = 1;
// Of scripts of tools the best so many are refined, and of those that end surely this many are
// tried so often; one that is safe in that part of them is enough, and no more catheters are tried.
// Of 8 that are 7: one with 6 was safe in 11 of 16.
constexpr std::size_t kScriptsRefined = 4, kScriptsTried = 2;
constexpr double kMostOfTries = 0.85;
// Of scripts of tools at least so many of the best are looked at for whether they may lead, in so
// many rounds; chosen.
constexpr int kScriptsRepeated = 3, kOtherRounds = 6;
// Neighbours of a script of tools that are run in full in its place.
constexpr std::size_t kSparesTried = 2;
// Which plans are the best is found from so many repeats of each that may be. Plans that fall
// behind let others up, which are repeated next.
constexpr int kFirstRepeats = 32;
constexpr int kRepeatRounds = 3;

bool same_script(const Candidate& a, const Candidate& b) {
  return a.wire == b.wire && a.first_wire == b.first_wire && a.catheter == b.catheter &&
         a.steps == b.steps;
}

}  // namespace

std::vector<Run> refinement_runs(int id, const Candidate& candidate, double insertion) {
  std::vector<Run> runs;
  const auto add = [&](const OtherElements& elements) {
    runs.push_back({.id = id, .candidate = candidate, .elements = elements});
  };
  for (const double factor : kRefineFactors) add({.factor = factor, .insertion = insertion});
  add({.insertion = insertion, .setting = kSettingTried});
  return runs;
}

namespace {

/// What was run to tell a plan's error.
struct ErrorRuns {
  std::vector<RefinedRun> rows;
  std::vector<SettingRun> others;
  std::optional<double> insertion;  // to which all were pushed; none: to the target          [mm]
};

ErrorRuns error_runs_of(const Study& study, int id, const std::vector<Run>& runs,
                        const std::vector<Measured>& trials) {
  expects(runs.size() == trials.size());
  ErrorRuns own;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    if (runs[k].id != id || !runs[k].elements) continue;
    const auto& [factor, to, setting] = *runs[k].elements;
    Measured trial = trials[k];
    if (runs[k].candidate.catheter < 0) {
      own.insertion = to;
    } else if (trial.outcome == simulate::Outcome::kReached) {
      trial.nodes = cut_at_goal(trial.nodes, study.goal);
    }
    if (setting) {
      own.others.push_back({*setting, std::move(trial)});
    } else {
      own.rows.push_back({factor * element_length_of(study, runs[k].candidate), std::move(trial)});
    }
  }
  return own;
}

}  // namespace

std::vector<Run> finest_runs(const Study& study, const std::vector<Run>& runs,
                             const std::vector<Measured>& trials) {
  std::vector<Run> finest;
  for (const Run& run : runs) {
    const bool first =
        run.elements && !run.elements->setting && run.elements->factor == kRefineFactors.front();
    if (!first || run.candidate.catheter < 0) continue;
    const ErrorRuns own = error_runs_of(study, run.id, runs, trials);
    if (!needs_finest(own.rows)) continue;
    finest.push_back(run);
    finest.back().elements->factor = kFinestFactor;
  }
  return finest;
}

Refinement estimate_error_of(const Study& study, int id, const std::vector<Run>& runs,
                             const std::vector<Measured>& trials) {
  ErrorRuns own = error_runs_of(study, id, runs, trials);
  return estimate_error(id, own.insertion, std::move(own.rows), own.others);
}

namespace {

class Planner {
 public:
  Planner(const Study& study, const PlanVessel& vessel, const PlanOptions& options, TrialLog& log)
      : study_(study), vessel_(vessel), options_(options), log_(log), silent_(options.batch) {
    silent_.progress = nullptr;
  }

  Plan make() {
    push_straight();
    if (options_.until == PlanOptions::Until::kTrials) return std::move(plan_);
    find_scripts();
    if (options_.until == PlanOptions::Until::kManoeuvres) return std::move(plan_);
    refine();
    // The repeats may put others first, and their errors others again.
    std::size_t refined = 0;
    do {
      refined = plan_.refinements.size();
      repeat();
      refine();
    } while (plan_.refinements.size() != refined);
    run_attempts();
    return std::move(plan_);
  }

 private:
  void push_straight() {
    plan_.candidates = list_candidates(study_);
    Rounds rounds(study_, vessel_, plan_.candidates, options_.exhaustive);
    for (std::vector<Run> runs = rounds.next(); !runs.empty(); runs = rounds.next()) {
      Spent& spent = rounds.level() == Level::kScout   ? plan_.scouts
                     : rounds.level() == Level::kProbe ? plan_.probes
                                                       : plan_.full;
      rounds.take(find_or_run(study_, vessel_, runs, log_, options_.batch, spent));
      if (rounds.level() == Level::kScout && options_.early.scouted) {
        options_.early.scouted(rounds.first_answer());
      }
    }
    plan_.trials = rounds.trials();
    plan_.levels = rounds.levels();
    plan_.scouting = rounds.scouting();
  }

  // Where they are wanted, and their trials behind the straight ones.
  void find_scripts() {
    if (std::optional<Scripts> known = log_.find_scripts()) {
      plan_.scripts = std::move(*known);
    } else {
      search_scripts(find_starts());
      search_tools();
      log_.keep_scripts(plan_.scripts);
    }
    std::vector<Run> runs;
    for (const Candidate& script : plan_.scripts.found) {
      runs.push_back({.id = static_cast<int>(plan_.candidates.size()), .candidate = script});
      plan_.candidates.push_back(script);
      plan_.levels.push_back(Level::kFull);
    }
    for (Measured& trial : find_or_run(study_, vessel_, runs, log_, silent_, plan_.full)) {
      plan_.trials.push_back(std::move(trial));
    }
  }

  // The straight pushes that a search goes on from; none where no search is wanted or needed.
  std::vector<int> find_starts() {
    if (options_.manoeuvres == Manoeuvring::kNever) return {};
    std::vector<double> progress;
    std::vector<simulate::Outcome> outcomes;
    for (const Measured& trial : plan_.trials) {
      progress.push_back(trial.progress);
      outcomes.push_back(trial.outcome);
    }
    std::vector<int> starts =
        choose_starts(study_, plan_.candidates, progress, outcomes, kStartsPerWire);
    const bool when_needed = options_.manoeuvres == Manoeuvring::kWhenNeeded;
    if (!starts.empty() && when_needed && has_steady_plan()) starts.clear();
    return starts;
  }

  // Scripts of catheter and wire, searched for by scouts and run in full. What does not reach in
  // full is shown where nothing of its pair does.
  void search_tools() {
    const bool when_needed = options_.manoeuvres == Manoeuvring::kWhenNeeded;
    if (study_.catheters.empty()) return;
    if (options_.manoeuvres == Manoeuvring::kNever || (when_needed && has_steady_plan())) {
      for (const ToolPair& pair : pairs_of(study_)) {
        plan_.scripts.pairs.emplace_back().pair = pair;
      }
      return;
    }
    ToolScripts search = find_tool_scripts(study_, vessel_.scout_model(), options_.batch,
                                           options_.early.script, options_.hooks);
    while (has_more_pairs(study_, search) && !has_steady_script(search)) {
      search_on(study_, vessel_.scout_model(), options_.batch, options_.early.script, search,
                options_.hooks);
    }
    find_exchanges(study_, vessel_.scout_model(), options_.batch, search);
    if (options_.batch.cancelled && options_.batch.cancelled()) throw Interrupted();
    plan_.scripts.branches += search.branches;
    const auto [runs, trials] = run_in_full(search, options_.batch);
    for (PairFindings& pair : search.pairs) {
      const bool exchanged = keep_scripts_of(pair, true, runs, trials);
      keep_scripts_of(pair, false, runs, trials, exchanged);
    }
    plan_.scripts.pairs = std::move(search.pairs);
  }

  // What was found, with the catheter seated where it follows, or what stands in for it.
  std::pair<std::vector<Run>, std::vector<Measured>> run_in_full(ToolScripts& search,
                                                                 const BatchOptions& batch) {
    add_seats(study_, search);
    std::vector<Run> runs;
    for (const Candidate& found : search.found) runs.push_back({.candidate = found});
    std::vector<Measured> trials = find_or_run(study_, vessel_, runs, log_, batch, plan_.full);
    try_spares(search, runs, trials);
    leave_out_seats(runs, trials);
    return {std::move(runs), std::move(trials)};
  }

  // Whether one of the best scripts is a plan that a person may lean on: its end is known, and it
  // is safe in most of the first repeats. All that is run for it is what its error and its repeats
  // take later. Else the next catheters that the anatomy suggests are tried too.
  bool has_steady_script(ToolScripts search) {
    const auto [runs, trials] = run_in_full(search, silent_);
    const Yardstick by;
    std::vector<std::pair<double, std::size_t>> plans;  // score and place
    for (std::size_t k = 0; k < runs.size(); ++k) {
      const Repeat as_assumed = judge_repeat(trials[k], study_, by.limits, by.weights);
      if (as_assumed.safe) plans.emplace_back(as_assumed.score, k);
    }
    std::sort(plans.begin(), plans.end());
    plans.resize(std::min(kScriptsRefined, plans.size()));
    std::size_t tried = 0;
    for (const auto& [score, place] : plans) {
      const Candidate& script = runs[place].candidate;
      if (tried == kScriptsTried || !ends_surely(script, trials[place])) continue;
      ++tried;
      if (is_safe_in_most(script)) return true;
    }
    return false;
  }

  bool ends_surely(const Candidate& script, const Measured& trial) {
    const int id = -1;  // not known yet
    const Refinement refined =
        find_errors(refinement_runs(id, script, trial.metrics.insertion), {id}).front();
    return refined.error && find_sensitivity(refined) == "" &&
           refined.error->tip < tip_room(study_.goal, trial.metrics);
  }

  bool is_safe_in_most(const Candidate& script) {
    const int repeats = options_.robustness.repeats, tries = std::min(kTries, repeats);
    std::vector<Disturbance> first = draw_disturbances(unknowns(repeats), study_.wires);
    first.resize(static_cast<std::size_t>(tries));
    const Yardstick by;
    const std::vector<Measured> ends = find_or_run(
        study_, vessel_, disturbed_runs(-1, script, first), log_, silent_, plan_.repeats);
    const auto safe = std::count_if(ends.begin(), ends.end(), [&](const Measured& trial) {
      return judge_repeat(trial, study_, by.limits, by.weights).safe;
    });
    return static_cast<double>(safe) >= kMostOfTries * tries;
  }

  // Of a pair's scripts, those with an exchange or the others, what reaches in full; true where
  // there is any. Else of the others the one that comes furthest, unless what is `shown` is enough.
  bool keep_scripts_of(PairFindings& pair, bool exchanged, const std::vector<Run>& runs,
                       const std::vector<Measured>& trials, bool shown = false) {
    std::vector<std::size_t> own, reached;
    for (std::size_t k = 0; k < runs.size(); ++k) {
      const Candidate& script = runs[k].candidate;
      if (script.catheter != pair.pair.catheter || script.wire != pair.pair.wire) continue;
      if ((script.first_wire >= 0) != exchanged) continue;
      own.push_back(k);
      if (trials[k].outcome == simulate::Outcome::kReached) reached.push_back(k);
    }
    const bool any = !reached.empty();
    std::string& stopped = exchanged ? pair.exchange.stopped : pair.stopped;
    if (any) stopped.clear();
    if (!any && !own.empty()) {
      const std::size_t furthest = *std::max_element(
          own.begin(), own.end(),
          [&](std::size_t a, std::size_t b) { return trials[a].progress < trials[b].progress; });
      if (stopped.empty()) stopped = trials[furthest].reason;
      if (!exchanged && !shown) reached = {furthest};
    }
    for (const std::size_t k : reached) {
      plan_.scripts.found.push_back(runs[k].candidate);
      plan_.scripts.starts.push_back(-1);
    }
    return any;
  }

  // Where a script does not reach in full that holds in the search, the first of its neighbours
  // that does stands in for it.
  void try_spares(const ToolScripts& search, std::vector<Run>& runs,
                  std::vector<Measured>& trials) {
    for (std::size_t tried = 0; tried < kSparesTried; ++tried) {
      std::vector<Run> next;
      std::vector<std::size_t> owners;
      for (std::size_t k = 0; k < runs.size(); ++k) {
        if (trials[k].outcome == simulate::Outcome::kReached) continue;
        if (tried >= search.spares[k].size()) continue;
        const bool known = std::any_of(runs.begin(), runs.end(), [&](const Run& run) {
          return same_script(run.candidate, search.spares[k][tried]);
        });
        if (known) continue;
        next.push_back({.candidate = search.spares[k][tried]});
        owners.push_back(k);
      }
      const std::vector<Measured> found =
          find_or_run(study_, vessel_, next, log_, silent_, plan_.full);
      for (std::size_t n = 0; n < next.size(); ++n) {
        if (found[n].outcome != simulate::Outcome::kReached) continue;
        runs[owners[n]] = next[n];
        trials[owners[n]] = found[n];
      }
    }
  }

  // Where the catheter does not follow a wire that has arrived, its script does not ask for that.
  void leave_out_seats(std::vector<Run>& runs, std::vector<Measured>& trials) {
    std::vector<Run> next;
    std::vector<std::size_t> owners;
    for (std::size_t k = 0; k < runs.size(); ++k) {
      if (!stays_unseated(runs[k].candidate, trials[k])) continue;
      next.push_back(runs[k]);
      next.back().candidate.steps.pop_back();
      owners.push_back(k);
    }
    const std::vector<Measured> found =
        find_or_run(study_, vessel_, next, log_, silent_, plan_.full);
    for (std::size_t n = 0; n < next.size(); ++n) {
      runs[owners[n]] = next[n];
      trials[owners[n]] = found[n];
    }
  }

  // Whether one of the best straight plans works in at least half of a few tries under
  // disturbances.
  bool has_steady_plan() {
    if (!steady_) steady_ = find_steady_plan();
    return *steady_;
  }

  bool find_steady_plan() {
    const Yardstick by;
    std::vector<std::pair<double, int>> plans;  // score and trial
    for (int id = 0; id < std::ssize(plan_.trials); ++id) {
      const auto k = static_cast<std::size_t>(id);
      const Repeat as_assumed = judge_repeat(plan_.trials[k], study_, by.limits, by.weights);
      if (plan_.levels[k] == Level::kFull && as_assumed.safe) {
        plans.emplace_back(as_assumed.score, id);
      }
    }
    if (plans.empty()) return false;
    std::sort(plans.begin(), plans.end());
    plans.resize(std::min(kPlansTried, plans.size()));

    const std::vector<Disturbance> tries = draw_disturbances(unknowns(kTries), study_.wires);
    const auto works = [&](const Measured& trial) {
      return judge_repeat(trial, study_, by.limits, by.weights).safe;
    };
    return std::any_of(plans.begin(), plans.end(), [&](const auto& plan) {
      const std::vector<Measured> trials =
          find_or_run(study_, vessel_, disturbed_runs(plan.second, candidate(plan.second), tries),
                      log_, silent_, plan_.repeats);
      return 2 * std::count_if(trials.begin(), trials.end(), works) >= kTries;
    });
  }

  // Thousands of pushes are tried, so the search is a scout's. What it finds is run in full, from
  // start to end, as it is written down. Where nothing of that reaches, turns are tried in full.
  void search_scripts(const std::vector<int>& start_ids) {
    plan_.scripts.starts_tried = static_cast<int>(start_ids.size());
    if (start_ids.empty()) return;
    search_at(Level::kScout, start_ids);
    if (plan_.scripts.found.empty()) search_at(Level::kFull, start_ids);
  }

  // Keeps what reaches in full.
  void search_at(Level level, const std::vector<int>& start_ids) {
    std::vector<Candidate> starts;
    for (const int id : start_ids) starts.push_back(candidate(id));
    const bool full = level == Level::kFull;
    const Manoeuvres search =
        find_manoeuvres(study_at(study_, level), starts, vessel_.path,
                        full ? vessel_.model() : vessel_.scout_model(),
                        {.most_turns = full ? kTurns : kTurnsOfScouts}, options_.batch);
    if (options_.batch.cancelled && options_.batch.cancelled()) throw Interrupted();
    plan_.scripts.branches += search.effort.branches;
    plan_.scripts.searches.push_back({level, search.effort});
    std::vector<Run> runs;
    for (const Candidate& found : search.found) {
      runs.push_back({.candidate = found});
      runs.back().candidate.moves = as_written(found.moves);
    }
    const std::vector<Measured> trials =
        find_or_run(study_, vessel_, runs, log_, options_.batch, plan_.full);
    for (std::size_t k = 0; k < runs.size(); ++k) {
      if (trials[k].outcome != simulate::Outcome::kReached) continue;
      plan_.scripts.found.push_back(runs[k].candidate);
      plan_.scripts.starts.push_back(start_ids[static_cast<std::size_t>(search.starts[k])]);
    }
  }

  Judgement judged() const {
    const Yardstick by;
    return judge(study_, plan_, by.limits, by.weights);
  }

  // Finds errors by other elements, and ranks with these, until no other error matters.
  void refine() {
    for (;;) {
      const std::vector<int> chosen =
          choose_plans_to_refine(judged().ranking, plan_.refinements, {});
      if (chosen.empty()) return;
      std::vector<Run> runs;
      for (const int id : chosen) {
        const std::vector<Run> own =
            refinement_runs(id, candidate(id), trial(id).metrics.insertion);
        runs.insert(runs.end(), own.begin(), own.end());
      }
      for (Refinement& refined : find_errors(std::move(runs), chosen)) {
        plan_.refinements.push_back(std::move(refined));
      }
    }
  }

  // What these runs, and those that they ask for, come to, for each id.
  std::vector<Refinement> find_errors(std::vector<Run> runs, const std::vector<int>& ids) {
    std::vector<Measured> found = find_or_run(study_, vessel_, runs, log_, silent_, plan_.full);
    const std::vector<Run> finest = finest_runs(study_, runs, found);
    std::vector<Measured> more = find_or_run(study_, vessel_, finest, log_, silent_, plan_.full);
    runs.insert(runs.end(), finest.begin(), finest.end());
    found.insert(found.end(), std::make_move_iterator(more.begin()),
                 std::make_move_iterator(more.end()));
    std::vector<Refinement> errors;
    for (const int id : ids) errors.push_back(estimate_error_of(study_, id, runs, found));
    return errors;
  }

  // Repeats the best under disturbances until the best are repeated ones, the very best at least;
  // then what is best, as often as the case asks for, and what has come up by that.
  void repeat() {
    plan_.robustness = unknowns(options_.robustness.repeats);
    plan_.disturbances = draw_disturbances(plan_.robustness, study_.wires);
    const int asked = plan_.robustness.repeats;
    const int few = std::min(has_tool_plans() ? kFewRepeats : kFirstRepeats, asked);
    repeat_best(few, kRepeatRounds);
    repeat_others();
    if (asked > few) {
      repeat_best(asked, 1);
      repeat_best(few, kRepeatRounds);
      repeat_others();
      repeat_best(asked, 0);
    }
  }

  void repeat_best(int count, int rounds) {
    for (int round = 0; count > 0; ++round) {
      // In the end the first, and the best of each wire and catheter, alone.
      const std::vector<int> chosen =
          choose_to_repeat(round < rounds ? plan_.robustness.plans : 1, count);
      if (chosen.empty()) return;
      add_repeats(chosen, static_cast<std::size_t>(count));
    }
  }

  // Scripts of a catheter are left to repeat_others() but for the first.
  std::vector<int> choose_to_repeat(int plans, int count) const {
    const Judgement now = judged();
    const Ranking& ranking = now.ranking;
    std::vector<int> chosen =
        choose_plans_to_repeat(ranking, plan_.candidates, now.repeated, plans, count);
    if (!has_tool_plans()) return chosen;
    std::erase_if(chosen, [&](int id) { return !gets_all_repeats(id, ranking, plans); });
    return chosen;
  }

  // By their scores alone the steadiest of scripts is not known.
  void repeat_others() {
    for (int round = 0; has_tool_plans() && round < kOtherRounds; ++round) {
      const Judgement now = judged();
      const int plans = plan_.robustness.plans;
      const NextRepeats next =
          choose_others_to_repeat(now.ranking, plan_.candidates, now.repeated, plans,
                                  std::max(plans, kScriptsRepeated), plan_.robustness.repeats);
      if (next.plans.empty()) return;
      add_repeats(next.plans, static_cast<std::size_t>(next.count));
      repeat_best(std::min(kFewRepeats, plan_.robustness.repeats), 0);
    }
  }

  bool has_tool_plans() const {
    for (std::size_t k = 0; k < plan_.trials.size(); ++k) {
      const bool reached = plan_.trials[k].outcome == simulate::Outcome::kReached;
      if (reached && plan_.candidates[k].catheter >= 0) return true;
    }
    return false;
  }

  // Until each has `count`. Repeat by repeat, so that plans under one disturbance run at about the
  // same time.
  void add_repeats(const std::vector<int>& chosen, std::size_t count) {
    std::vector<std::size_t> places;  // in plan_.repeated
    for (const int id : chosen) {
      const auto found =
          std::find_if(plan_.repeated.begin(), plan_.repeated.end(),
                       [&](const RepeatedTrials& repeated) { return repeated.trial == id; });
      places.push_back(static_cast<std::size_t>(found - plan_.repeated.begin()));
      if (found == plan_.repeated.end()) plan_.repeated.push_back({.trial = id});
    }
    std::vector<Run> runs;
    std::vector<std::size_t> owners;
    for (std::size_t k = 0; k < count; ++k) {
      for (const std::size_t place : places) {
        const RepeatedTrials& own = plan_.repeated[place];
        if (k < own.trials.size()) continue;
        runs.push_back({.id = own.trial,
                        .candidate = candidate(own.trial),
                        .disturbance = plan_.disturbances[k]});
        owners.push_back(place);
      }
    }
    std::vector<Measured> trials =
        find_or_run(study_, vessel_, runs, log_, options_.batch, plan_.repeats);
    for (std::size_t n = 0; n < runs.size(); ++n) {
      plan_.repeated[owners[n]].trials.push_back(std::move(trials[n]));
    }
  }

  // What is to be looked at needs its shapes on the way: plans have them from their trials.
  void run_attempts() {
    std::vector<Run> runs;
    for (const int id : choose_played(study_, plan_, judged().ranking)) {
      runs.push_back({.id = id, .candidate = candidate(id), .shapes = true});
      const bool is_plan = plan_.levels[static_cast<std::size_t>(id)] == Level::kFull &&
                           trial(id).outcome == simulate::Outcome::kReached;
      if (!is_plan) plan_.attempts.push_back(id);
    }
    find_or_run(study_, vessel_, runs, log_, silent_, plan_.full);
  }

  // The case's, cut to what a trial can take, for so many repeats.
  RobustnessOptions unknowns(int repeats) const {
    RobustnessOptions options = options_.robustness;
    options.repeats = repeats;
    Unknowns& known = options.unknowns;
    known.lumen = std::min(known.lumen, largest_lumen_offset(study_));
    known.entry = std::min(known.entry, largest_entry_shift(study_, vessel_.model()));
    if (!vessel_.yields) known.wall_low = known.wall_high = 1.0;
    return options;
  }

  static std::vector<Run> disturbed_runs(int id, const Candidate& candidate,
                                         const std::vector<Disturbance>& disturbances) {
    std::vector<Run> runs;
    for (const Disturbance& disturbance : disturbances) {
      runs.push_back({.id = id, .candidate = candidate, .disturbance = disturbance});
    }
    return runs;
  }

  const Candidate& candidate(int id) const {
    return plan_.candidates[static_cast<std::size_t>(id)];
  }
  const Measured& trial(int id) const { return plan_.trials[static_cast<std::size_t>(id)]; }

  const Study& study_;
  const PlanVessel& vessel_;
  const PlanOptions& options_;
  TrialLog& log_;
  BatchOptions silent_;         // for what is too short to show
  std::optional<bool> steady_;  // see has_steady_plan()
  Plan plan_;
};

}  // namespace

Plan make_plan(const Study& study, const PlanVessel& vessel, const PlanOptions& options,
               TrialLog& log) {
  return Planner(study, vessel, options, log).make();
}

}  // namespace wireplan::plan
