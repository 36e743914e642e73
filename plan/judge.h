#pragma once
/// What was simulated -> what it is worth, by limits and weights. Simulates nothing.
#include "plan/make_plan.h"

namespace wireplan::plan {

struct Judgement {
  Ranking ranking;
  std::vector<RepeatedPlan> repeated;  // in the order of Plan::repeated
};

Judgement judge(const Study& study, const Plan& plan, const Limits& limits, const Weights& weights);

/// Of each wire its best plan, or the attempt that ended nearest to the target where it has none;
/// wires that never entered are left out.
std::vector<int> best_of_each_wire(const Study& study, const Plan& plan, const Ranking& ranking);

/// Trials whose insertion is worth looking at: the best kPlansPlayed plans by rank, then, for each
/// wire that has none among them, its best plan or the attempt that ended nearest to the target.
std::vector<int> choose_played(const Study& study, const Plan& plan, const Ranking& ranking);

}  // namespace wireplan::plan
