#include "plan/judge.h"

#include <algorithm>

namespace wireplan::plan {

Judgement judge(const Study& study, const Plan& plan, const Limits& limits,
                const Weights& weights) {
  Judgement judgement;
  for (const RepeatedTrials& repeated : plan.repeated) {
    RepeatedPlan& judged = judgement.repeated.emplace_back();
    judged.trial = repeated.trial;
    for (const Measured& trial : repeated.trials) {
      judged.repeats.push_back(judge_repeat(trial, study, limits, weights));
    }
  }
  Findings findings{.repeated = judgement.repeated};
  if (!plan.refinements.empty()) {
    const int count = static_cast<int>(plan.candidates.size());
    findings.errors = errors_by_trial(plan.refinements, count);
    findings.sensitive = sensitivity_by_trial(plan.refinements, count);
    findings.refined.assign(plan.candidates.size(), false);
    for (const Refinement& one : plan.refinements) {
      findings.refined[static_cast<std::size_t>(one.trial)] = true;
    }
  }
  for (const Level level : plan.levels) findings.scouted.push_back(level != Level::kFull);
  judgement.ranking = rank(study, plan.candidates, plan.trials, limits, weights, findings);
  return judgement;
}

std::vector<int> best_of_each_wire(const Study& study, const Plan& plan, const Ranking& ranking) {
  std::vector<int> best;
  for (std::size_t w = 0; w < study.wires.size(); ++w) {
    std::optional<int> shown = ranking.wires[w].best_trial;
    const bool ranked = shown.has_value();
    for (std::size_t id = 0; !ranked && id < plan.trials.size(); ++id) {
      const Metrics& metrics = plan.trials[id].metrics;
      if (plan.candidates[id].wire != static_cast<int>(w) || metrics.insertion <= 0.0) continue;
      if (!shown || metrics.tip_to_target <
                        plan.trials[static_cast<std::size_t>(*shown)].metrics.tip_to_target) {
        shown = static_cast<int>(id);
      }
    }
    if (shown) best.push_back(*shown);
  }
  return best;
}

std::vector<int> choose_played(const Study& study, const Plan& plan, const Ranking& ranking) {
  std::vector<int> played;
  const std::size_t count = std::min(kPlansPlayed, ranking.plans.size());
  for (std::size_t k = 0; k < count; ++k) played.push_back(ranking.plans[k].trial);
  const auto wire_of = [&](int id) { return plan.candidates[static_cast<std::size_t>(id)].wire; };
  for (const int id : best_of_each_wire(study, plan, ranking)) {
    const auto same_wire = [&](int other) { return wire_of(other) == wire_of(id); };
    if (std::none_of(played.begin(), played.end(), same_wire)) played.push_back(id);
  }
  return played;
}

}  // namespace wireplan::plan
