#include "simulate/insertion/tool_script.h"

#include <algorithm>
#include <utility>

namespace wireplan::simulate {

ToolScriptRunner::ToolScriptRunner(const std::vector<Tool>& tools, const Introducer& introducer,
                                   const Goal& goal, const VesselModel& vessel,
                                   const ToolTrialOptions& options) {
  auto start = std::make_unique<ToolTrial>(tools, introducer, goal, vessel, options);
  if (start->bench().settled()) {
    begun_.push_back({{}, std::move(start)});
  } else {
    not_settled_ = start->finish();
  }
}

/// Where these steps lead.
const ToolTrial& ToolScriptRunner::begin(const std::vector<ToolStep>& steps) {
  const auto known = std::find_if(begun_.begin(), begun_.end(),
                                  [&](const Begun& begun) { return begun.steps == steps; });
  if (known != begun_.end()) return *known->trial;
  const ToolTrial& before = begin({steps.begin(), steps.end() - 1});
  if (before.ended()) return before;
  auto trial = std::make_unique<ToolTrial>(before);
  trial->make(steps.back());
  if (!trial->ended()) trial->restore(trial->save());
  begun_.push_back({steps, std::move(trial)});
  return *begun_.back().trial;
}

TrialResult ToolScriptRunner::run(const std::vector<ToolStep>& steps, double length) {
  if (not_settled_) return *not_settled_;
  const bool seats = !steps.empty() && steps.back().seats;
  const std::size_t count = steps.size() - (seats ? 1 : 0);
  const std::size_t up = count == 0 ? 0 : std::min(kStepsUp, count - 1);
  ToolTrial trial(begin({steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(up)}));
  trial.bound(length);
  for (std::size_t k = up; k < count && !trial.ended(); ++k) {
    trial.make(steps[k], k + 1 == count);
  }
  if (seats) trial.seat(steps.back());
  TrialResult result = trial.finish();
  result.support = trial.find_support();
  return result;
}

TrialResult run_tool_trial(const std::vector<Tool>& tools, const Introducer& introducer,
                           const Goal& goal, const VesselModel& vessel,
                           const ToolTrialOptions& options, const std::vector<ToolStep>& steps) {
  return ToolScriptRunner(tools, introducer, goal, vessel, options)
      .run(steps, options.insertion.length);
}

}  // namespace wireplan::simulate
