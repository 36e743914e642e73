#pragma once
/// Many trials, any thread count, the same answer.
#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "plan/candidates.h"
#include "simulate/insertion/tool_script.h"

namespace wireplan::plan {

/// The callbacks come from any thread, one at a time, and must not call back into the batch.
struct BatchOptions {
  int threads = 0;                                              // 0: all cores
  std::function<void(int done, int total)> progress = nullptr;  // `done` rises by one
  std::function<bool()> cancelled = nullptr;                    // asked before each trial
};

/// Work was stopped by the user; what was finished is kept.
class Interrupted : public std::exception {
 public:
  const char* what() const noexcept override { return "interrupted; what was finished is kept"; }
};

struct BatchResult {
  std::vector<simulate::TrialResult> trials;  // slot k belongs to candidate k
  std::vector<bool> finished;                 // false for those that a cancel left out
  std::vector<double> cpu_seconds;            // per trial; timing, so never twice the same   [s]
};

/// Runs every candidate. A trial that throws is our fault and becomes Outcome::kFailed with the
/// message as its reason; it never ends the batch. After a cancel the trials under way are
/// finished, and those left out are Outcome::kFailed with the reason "not run: cancelled".
BatchResult run_batch(const Study& study, const std::vector<Candidate>& candidates,
                      const simulate::VesselModel& vessel, const BatchOptions& options);

/// One trial: what it throws, or a number that is not finite, becomes Outcome::kFailed.
simulate::TrialResult run_guarded(const std::function<simulate::TrialResult()>& run);

/// What runs of scripts with the same tools share, which differ in their steps alone; empty before
/// the first of them.
using SharedTools = std::optional<simulate::ToolScriptRunner>;

/// One trial of the batch, guarded; a script of catheter and wire where the candidate has one.
simulate::TrialResult run_candidate(const Study& study, const Candidate& candidate,
                                    const simulate::VesselModel& vessel, SharedTools& shared);
simulate::TrialResult run_candidate(const Study& study, const Candidate& candidate,
                                    const simulate::VesselModel& vessel);

/// One straight push toward the study's goal and its others: what run_candidate() gives for the
/// goal, then for each of the others. Only the first where it failed by our fault.
std::vector<simulate::TrialResult> run_for_all_goals(const Study& study, const Candidate& candidate,
                                                     const simulate::VesselModel& vessel);

/// The parallel driver below run_batch: calls work(slot) once for each slot in [0, count), in no
/// promised order; slots must write to places of their own. Returns which slots were finished: all,
/// unless cancelled. What `work` throws ends the loop and reaches the caller.
std::vector<bool> for_each_slot(int count, const std::function<void(int slot)>& work,
                                const BatchOptions& options);

}  // namespace wireplan::plan
