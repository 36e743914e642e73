#include "plan/repeat_choice.h"

#include <algorithm>
#include <set>

#include "plan/statistics.h"

namespace wireplan::plan {
namespace {

std::ptrdiff_t count_unsafe(const RepeatedPlan& plan) {
  return std::count_if(plan.repeats.begin(), plan.repeats.end(),
                       [](const Repeat& repeat) { return !repeat.safe; });
}

int count_repeats(const std::vector<RepeatedPlan>& repeated, int trial) {
  const RepeatedPlan* own = find_repeated(repeated, trial);
  return own == nullptr ? 0 : static_cast<int>(own->repeats.size());
}

bool may_score_better(const RepeatedPlan& plan, const RepeatedPlan& first) {
  std::vector<double> differences;
  for (std::size_t k = 0; k < std::min(plan.repeats.size(), first.repeats.size()); ++k) {
    differences.push_back(plan.repeats[k].score - first.repeats[k].score);
  }
  return differences.size() < 2 || mean_interval(differences)[0] <= 0.0;
}

}  // namespace

bool may_lead(const RankedPlan& plan, const RankedPlan& first,
              const std::vector<RepeatedPlan>& repeated) {
  if (ends_unsure(plan) && !ends_unsure(first)) return false;
  const RepeatedPlan* best = find_repeated(repeated, first.trial);
  expects(best != nullptr);
  const std::ptrdiff_t unsafe = count_unsafe(*best);
  const RepeatedPlan* own = find_repeated(repeated, plan.trial);
  if (own == nullptr) {
    const auto& tied = first.tied_with;
    return unsafe > 0 || std::find(tied.begin(), tied.end(), plan.trial) != tied.end();
  }
  const std::ptrdiff_t own_unsafe = count_unsafe(*own);
  return own_unsafe < unsafe || (own_unsafe == unsafe && may_score_better(*own, *best));
}

bool gets_all_repeats(int trial, const Ranking& ranking, int first) {
  const auto end =
      ranking.plans.begin() + std::min<std::ptrdiff_t>(first, std::ssize(ranking.plans));
  return std::any_of(ranking.plans.begin(), end,
                     [&](const RankedPlan& plan) { return plan.trial == trial; }) ||
         std::any_of(ranking.wires.begin(), ranking.wires.end(),
                     [&](const WireSummary& wire) { return wire.best_trial == trial; });
}

NextRepeats choose_others_to_repeat(const Ranking& ranking,
                                    const std::vector<Candidate>& candidates,
                                    const std::vector<RepeatedPlan>& repeated, int first, int among,
                                    int most) {
  const int few = std::min(kFewRepeats, most), fewest = std::min(kFewestRepeats, most);
  if (ranking.plans.empty() || count_repeats(repeated, ranking.plans.front().trial) < few) {
    return {};
  }
  const auto catheter_of = [&](int trial) {
    return candidates[static_cast<std::size_t>(trial)].catheter;
  };
  std::set<int> known, seen;  // catheters with repeats, and those whose best has been passed
  for (const RepeatedPlan& plan : repeated) known.insert(catheter_of(plan.trial));
  NextRepeats next;
  std::vector<int> begun;
  for (std::size_t k = 0; k < ranking.plans.size(); ++k) {
    const RankedPlan& plan = ranking.plans[k];
    const int catheter = catheter_of(plan.trial), has = count_repeats(repeated, plan.trial);
    const bool best_of_catheter = catheter >= 0 && seen.insert(catheter).second;
    if (gets_all_repeats(plan.trial, ranking, first) || has >= few) continue;
    const bool unknown = best_of_catheter && known.count(catheter) == 0;
    const bool considered = static_cast<int>(k) < among || best_of_catheter;
    if (!unknown && !(considered && may_lead(plan, ranking.plans.front(), repeated))) continue;
    (has < fewest ? next.plans : begun).push_back(plan.trial);
  }
  next.count = next.plans.empty() ? few : fewest;
  if (next.plans.empty()) next.plans = std::move(begun);
  return next;
}

}  // namespace wireplan::plan
