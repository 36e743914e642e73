#include "plan/metrics.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "preprocess/centerline/path_place.h"
#include "simulate/insertion/start_line.h"

namespace wireplan::plan {
namespace {

using simulate::tip_at_rest;

/// Where targets and paths are: in the vessel at rest.
const Eigen::Matrix3Xd& nodes_at_rest(const simulate::TrialResult& trial) {
  return trial.nodes_at_rest.cols() > 0 ? trial.nodes_at_rest : trial.nodes;
}

/// Where the tip ended: of the final shape, else of the last push, else still at the access.
Vec3 final_tip(const simulate::TrialResult& trial, const Study& study) {
  if (nodes_at_rest(trial).cols() > 0) return nodes_at_rest(trial).rightCols<1>();
  return trial.pushes.empty() ? study.access : tip_at_rest(trial, trial.pushes.size() - 1);
}

WallMotion find_wall_motion(const std::vector<simulate::Push>& pushes, const Centerline& path) {
  WallMotion worst;
  for (const simulate::Push& push : pushes) {
    if (push.wall_displacement <= 0.0) continue;
    const double radius = preprocess::find_place(push.wall_displacement_point, path).radius;
    if (worst.displacement > 0.0 &&
        push.wall_displacement * worst.radius <= worst.displacement * radius) {
      continue;
    }
    worst = {push.wall_displacement, radius, push.wall_displacement_point};
  }
  return worst;
}

/// Which way a value went: -1, 0 or 1.
int side_of_change(double before, double after) {
  constexpr double kRounding = 1e-9;  // mm, rad
  return std::abs(after - before) <= kRounding ? 0 : after > before ? 1 : -1;
}

/// A new move begins where other tools go, or one goes another way, than in the record before.
int count_moves(const simulate::TrialResult& trial) {
  int count = 0;
  std::vector<int> last;
  for (std::size_t k = 0; k < trial.pushes.size(); ++k) {
    std::vector<int> now;
    const auto add = [&](const auto& value) {
      now.push_back(side_of_change(k > 0 ? value(k - 1) : 0.0, value(k)));
    };
    for (const simulate::ToolTrack& track : trial.tools) {
      add([&](std::size_t i) { return track.insertion[i]; });
      add([&](std::size_t i) { return track.roll[i]; });
    }
    if (trial.tools.empty()) {
      add([&](std::size_t i) { return trial.pushes[i].insertion; });
      add([&](std::size_t i) { return trial.pushes[i].hub_angle; });
    }
    if (now != last) ++count;
    last = std::move(now);
  }
  return count;
}

}  // namespace

Metrics compute_push_metrics(const std::vector<simulate::Push>& pushes) {
  Metrics metrics;
  double last_total = 0.0, way = 0.0;  // of the wire, in and out
  for (const simulate::Push& push : pushes) {
    const double moved = std::abs(push.insertion - metrics.insertion);
    metrics.force_impulse += 0.5 * (last_total + push.total_contact_force) * moved;
    way += moved;
    last_total = push.total_contact_force;
    metrics.insertion = push.insertion;

    metrics.peak_tip_force = std::max(metrics.peak_tip_force, push.tip_force);
    metrics.peak_contact_force = std::max(metrics.peak_contact_force, push.peak_contact_force);
    metrics.peak_push_force = std::max(metrics.peak_push_force, std::abs(push.push_force));
    metrics.peak_curvature = std::max(metrics.peak_curvature, push.peak_curvature);
    metrics.max_penetration = std::max(metrics.max_penetration, push.max_penetration);
    metrics.peak_wall_displacement =
        std::max(metrics.peak_wall_displacement, push.wall_displacement);
    metrics.residual = std::max(metrics.residual, push.residual);
    metrics.iterations += push.iterations;
  }
  if (!pushes.empty()) {
    const simulate::Push& last = pushes.back();
    metrics.push_work = last.push_work;
    metrics.friction_work = last.friction_work;
    metrics.energy_unbalanced = last.unbalanced;
    metrics.energy_released = last.push_work - last.stored_energy - last.friction_work;
  }
  if (way > 0.0) metrics.mean_contact_force = metrics.force_impulse / way;
  return metrics;
}

Metrics compute_metrics(const simulate::TrialResult& trial, const Study& study,
                        const Centerline& path) {
  expects(path.points.cols() > 0 && path.radius.size() == path.points.cols());
  Metrics metrics = compute_push_metrics(trial.pushes);
  metrics.reached = trial.outcome == simulate::Outcome::kReached;
  metrics.tip_to_target = (final_tip(trial, study) - study.goal.point).norm();
  metrics.nearest_to_target = metrics.tip_to_target;
  for (std::size_t k = 0; k < trial.pushes.size(); ++k) {
    metrics.nearest_to_target =
        std::min(metrics.nearest_to_target, (tip_at_rest(trial, k) - study.goal.point).norm());
  }
  metrics.wall_motion = find_wall_motion(trial.pushes, path);
  const Eigen::Matrix3Xd& nodes = nodes_at_rest(trial);
  for (Eigen::Index k = 0; k < nodes.cols(); ++k) {
    const preprocess::PathPlace place = preprocess::find_place(nodes.col(k), path);
    metrics.centerline_deviation += place.from_axis / static_cast<double>(nodes.cols());
    if (trial.reshaped && study.goal.way && study.goal.way->passes_by(nodes.col(k))) continue;
    metrics.off_path = std::max(metrics.off_path, place.from_lumen);
  }
  return metrics;
}

double find_progress(const Vec3& tip, const Study& study, const Centerline& path) {
  const std::shared_ptr<const simulate::Way>& way = study.goal.way;
  return way ? way->find_progress(tip) : preprocess::find_progress(tip, path);
}

double find_progress(const simulate::TrialResult& trial, const Study& study,
                     const Centerline& path) {
  double progress = 0.0;
  for (std::size_t k = 0; k < trial.pushes.size(); ++k) {
    progress = std::max(progress, find_progress(tip_at_rest(trial, k), study, path));
  }
  return progress;
}

std::vector<ToolMetrics> compute_tool_metrics(const simulate::TrialResult& trial,
                                              const Study& study, const Centerline& path) {
  std::vector<ToolMetrics> all;
  // Of a track from one change of its tool to the next.
  const auto add = [&](const simulate::ToolTrack& track, const std::string& name, std::size_t from,
                       std::size_t to) {
    ToolMetrics& tool = all.emplace_back();
    tool.name = name;
    if (from >= to) return;
    for (std::size_t k = from; k < to; ++k) {
      tool.peak_tip_force = std::max(tool.peak_tip_force, track.tip_force[k]);
      tool.mean_tip_force += track.tip_force[k] / static_cast<double>(to - from);
      tool.peak_wall_force = std::max(tool.peak_wall_force, track.wall_force[k]);
      tool.peak_push_force = std::max(tool.peak_push_force, std::abs(track.push_force[k]));
      tool.peak_hub_torque = std::max(tool.peak_hub_torque, std::abs(track.hub_torque[k]));
    }
    tool.insertion = track.insertion[to - 1];
    if (trial.nodes.cols() > 1 && to == track.insertion.size()) {
      const simulate::PlaceOnLine at = simulate::place_at_arc(trial.nodes, tool.insertion);
      tool.progress = find_progress(simulate::point_on(nodes_at_rest(trial), at), study, path);
    }
  };
  for (const simulate::ToolTrack& track : trial.tools) {
    std::vector<simulate::ToolTrack::Change> parts = {{.from = 0, .name = track.name}};
    parts.insert(parts.end(), track.changes.begin(), track.changes.end());
    for (std::size_t k = 0; k < parts.size(); ++k) {
      add(track, parts[k].name, parts[k].from,
          k + 1 < parts.size() ? parts[k + 1].from : track.insertion.size());
    }
  }
  return all;
}

ScriptMetrics compute_script_metrics(const simulate::TrialResult& trial, const Study& study,
                                     const Centerline& path) {
  ScriptMetrics script;
  script.moves = count_moves(trial);
  if (trial.tools.empty()) {
    for (const simulate::Push& push : trial.pushes) {
      script.hand_force = std::max(script.hand_force, std::abs(push.push_force));
      script.hub_torque = std::max(script.hub_torque, std::abs(push.hub_torque));
    }
    return script;
  }
  for (const simulate::ToolTrack& track : trial.tools) {
    script.exchanges += static_cast<int>(track.changes.size());
  }
  const std::vector<ToolMetrics> tools = compute_tool_metrics(trial, study, path);
  for (const ToolMetrics& tool : tools) {
    script.hand_force = std::max(script.hand_force, tool.peak_push_force);
    script.hub_torque = std::max(script.hub_torque, tool.peak_hub_torque);
  }
  if (const std::optional<Ostium> ostium = find_ostium(study.goal)) {
    script.hook_depth = std::max(0.0, tools.front().progress - ostium->arc);
  }
  script.wire_beyond = std::max(0.0, tools.back().insertion - tools.front().insertion);
  if (trial.support) {
    script.support = trial.support->push;
    script.bears_more = trial.support->more;
  }
  return script;
}

bool stays_unseated(const Candidate& script, const Measured& trial) {
  constexpr double kNear = 1.0;  // that a seat may be off, chosen                           [mm]
  if (script.steps.empty() || !script.steps.back().seats || !trial.metrics.reached) return false;
  return trial.metrics.script->hook_depth < script.steps.back().at - kNear;
}

Measured measure(const simulate::TrialResult& trial, const Study& study, const Centerline& path) {
  Metrics metrics = compute_metrics(trial, study, path);
  if (!study.catheters.empty()) metrics.script = compute_script_metrics(trial, study, path);
  return {
      .outcome = trial.outcome,
      .reason = trial.reason,
      .terms = trial.terms,
      .metrics = std::move(metrics),
      .progress = find_progress(trial, study, path),
      .last_tip = trial.pushes.empty() ? study.access : tip_at_rest(trial, trial.pushes.size() - 1),
      .nodes = trial.nodes,
      .sections = trial.sections,
      .tools = compute_tool_metrics(trial, study, path)};
}

}  // namespace wireplan::plan
