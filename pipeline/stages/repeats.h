#pragma once
/// The perturbed repeats of a case's best plans, and what the report says of them.
#include <vector>

#include "pipeline/stages/stage_work.h"
#include "plan/batch.h"
#include "plan/robustness.h"

namespace wireplan::pipeline {

struct Repeats {
  plan::RobustnessOptions options;  // as used: no unknown beyond what a trial can take
  std::vector<plan::Disturbance> disturbances;
  std::vector<plan::RepeatedPlan> plans;
  double cpu_seconds = 0.0;  // of those run this time; timing                             [s]
};

/// The case's unknowns with what it leaves open, and so many disturbances. No plan is repeated yet.
Repeats prepare_repeats(Workspace& work, int count);

/// How a trial of the case ended and what it cost, by the case's limits and weights.
plan::Repeat judge_trial(Workspace& work, const simulate::TrialResult& trial);

/// What comes of a candidate under a disturbance, judged. May be called by several threads, after
/// prepare_repeats().
plan::Repeat run_repeat(Workspace& work, const plan::Candidate& candidate,
                        const plan::Disturbance& disturbance);

/// Repeats the plans of these trials until each has `count` repeats. Each repeat is a piece in the
/// store as soon as it is done, and is taken from there if an interrupted run left it. Throws
/// Interrupted.
void add_repeats(Workspace& work, const std::vector<plan::Candidate>& candidates,
                 const std::vector<int>& trials, int count, Repeats& repeats);

/// The report's "robustness".
Json robustness_json(const Repeats& repeats);

}  // namespace wireplan::pipeline
