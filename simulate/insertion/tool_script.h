#pragma once
/// Whole scripts of tools, one alone or several that begin alike.
#include <memory>
#include <optional>
#include <vector>

#include "simulate/insertion/tool_trial.h"

namespace wireplan::simulate {

/// So many first steps of a script are its way up, which several may have in common: the innermost
/// tool, and the one outside it over it.
inline constexpr std::size_t kStepsUp = 2;

/// Runs scripts of the same tools, one after the other. Steps of the way up that two have in common
/// are made once, and every script goes on from a mark after each of them: its result is the same,
/// bit for bit, whatever was run before. Serial.
class ToolScriptRunner {
 public:
  /// Keeps a reference to the vessel.
  ToolScriptRunner(const std::vector<Tool>& tools, const Introducer& introducer, const Goal& goal,
                   const VesselModel& vessel, const ToolTrialOptions& options);

  /// Makes all steps, the last one until the goal is reached or the tip comes no further, and finds
  /// what the catheter bears then. `length` bounds the foremost tip in the last step, in the place
  /// of the options'.
  TrialResult run(const std::vector<ToolStep>& steps, double length);

 private:
  struct Begun {
    std::vector<ToolStep> steps;
    std::unique_ptr<const ToolTrial> trial;
  };
  const ToolTrial& begin(const std::vector<ToolStep>& steps);

  std::vector<Begun> begun_;                // the first without steps
  std::optional<TrialResult> not_settled_;  // at the introducer: that of all scripts
};

/// One script alone.
TrialResult run_tool_trial(const std::vector<Tool>& tools, const Introducer& introducer,
                           const Goal& goal, const VesselModel& vessel,
                           const ToolTrialOptions& options, const std::vector<ToolStep>& steps);

}  // namespace wireplan::simulate
