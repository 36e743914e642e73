#include "plan/score.h"

#include <algorithm>

namespace wireplan::plan {
namespace {

double saturating(double value, double scale) { return value / (value + scale); }

/// Of saturating(), and but for its sign of 1 - saturating().
double saturating_slope(double value, double scale) {
  return scale / ((value + scale) * (value + scale));
}

double weighted_mean(const Score& score, const Weights& weights) {
  double sum = 0.0;
  for (const ScorePart& part : kScoreParts) {
    if (acts(part, score.of_script)) sum += weights.*part.weight * score.*part.cost;
  }
  return sum / sum_of(weights, score.of_script);
}

void expects_valid(const Metrics& metrics, const simulate::Goal& goal, const Limits& limits,
                   const Weights& weights) {
  expects(goal.radius > 0.0);
  expects(limits.tip_force_warn > 0.0 && limits.tip_force_fail > 0.0 &&
          limits.penetration_fail > 0.0);
  for (const ScorePart& part : kScoreParts) expects(weights.*part.weight >= 0.0);
  expects(sum_of(weights, metrics.script.has_value()) > 0.0);
}

}  // namespace

double sum_of(const Weights& weights, bool of_script) {
  double sum = 0.0;
  for (const ScorePart& part : kScoreParts) {
    if (acts(part, of_script)) sum += weights.*part.weight;
  }
  return sum;
}

NumericalError assumed_error(const Metrics& metrics) {
  return {.position = kAssumedPositionError,
          .tip = kAssumedPositionError,
          .peak_force = kAssumedRelativeForceError * metrics.peak_contact_force,
          .mean_force = kAssumedRelativeForceError * metrics.mean_contact_force,
          .tip_force = kAssumedRelativeForceError * metrics.peak_tip_force,
          .push_force = kAssumedRelativeForceError * metrics.peak_push_force,
          .support = metrics.script ? kAssumedRelativeForceError * metrics.script->support : 0.0};
}

Score compute_score(const Metrics& metrics, const simulate::Goal& goal, const Limits& limits,
                    const Weights& weights) {
  expects_valid(metrics, goal, limits, weights);
  const double scale = limits.tip_force_warn;
  Score score;
  score.reach = goal.at_section ? (metrics.reached ? 0.0 : 1.0)
                                : std::min(metrics.tip_to_target / goal.radius, 1.0);
  score.peak_force = saturating(metrics.peak_contact_force, scale);
  score.mean_force = saturating(metrics.mean_contact_force, scale);
  score.margin = std::min(metrics.peak_tip_force / limits.tip_force_fail, 1.0);
  if (metrics.script) {
    const ScriptMetrics& script = *metrics.script;
    const ScriptScales& scales = kScriptScales;
    score.of_script = true;
    score.support = 1.0 - saturating(script.support, scales.support);
    score.hook = 1.0 - saturating(script.hook_depth, scales.hook);
    score.wire_beyond = 1.0 - saturating(script.wire_beyond, scales.wire_beyond);
    score.hand_force = saturating(script.hand_force, scales.hand_force);
    score.hub_torque = saturating(script.hub_torque, scales.hub_torque);
    score.moves = saturating(script.moves, scales.moves);
    score.exchanges = saturating(script.exchanges, scales.exchanges);
  }
  score.total = weighted_mean(score, weights);
  return score;
}

double compute_score_error(const Metrics& metrics, const NumericalError& error,
                           const simulate::Goal& goal, const Limits& limits,
                           const Weights& weights) {
  expects_valid(metrics, goal, limits, weights);
  const double scale = limits.tip_force_warn;
  Score change;
  change.reach = goal.at_section ? 0.0 : std::min(error.tip / goal.radius, 1.0);
  change.peak_force = saturating_slope(metrics.peak_contact_force, scale) * error.peak_force;
  change.mean_force = saturating_slope(metrics.mean_contact_force, scale) * error.mean_force;
  change.margin = std::min(error.tip_force / limits.tip_force_fail, 1.0);
  if (metrics.script) {
    const ScriptMetrics& script = *metrics.script;
    change.of_script = true;
    change.support = saturating_slope(script.support, kScriptScales.support) * error.support;
    change.hook = saturating_slope(script.hook_depth, kScriptScales.hook) * error.position;
    change.hand_force =
        saturating_slope(script.hand_force, kScriptScales.hand_force) * error.push_force;
  }
  return weighted_mean(change, weights);
}

}  // namespace wireplan::plan
