#include "plan/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wireplan::plan {
namespace {

double squared_distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length_squared = ab.squaredNorm();
  if (length_squared == 0.0) return (p - a).squaredNorm();
  const double t = std::clamp((p - a).dot(ab) / length_squared, 0.0, 1.0);
  return (p - a - t * ab).squaredNorm();
}

double distance_to_path(const Vec3& p, const Centerline& path) {
  double squared = (p - path.points.col(0)).squaredNorm();
  for (Eigen::Index k = 1; k < path.points.cols(); ++k) {
    squared = std::min(squared,
                       squared_distance_to_segment(p, path.points.col(k - 1), path.points.col(k)));
  }
  return std::sqrt(squared);
}

double mean_distance_to_path(const Eigen::Matrix3Xd& nodes, const Centerline& path) {
  if (nodes.cols() == 0) return 0.0;
  double sum = 0.0;
  for (Eigen::Index k = 0; k < nodes.cols(); ++k) sum += distance_to_path(nodes.col(k), path);
  return sum / static_cast<double>(nodes.cols());
}

/// Where the tip ended: of the final shape, else of the last push, else still at the access.
Vec3 final_tip(const simulate::TrialResult& trial, const Study& study) {
  if (trial.nodes.cols() > 0) return trial.nodes.rightCols<1>();
  return trial.pushes.empty() ? study.access : trial.pushes.back().tip;
}

}  // namespace

Metrics compute_push_metrics(const std::vector<simulate::Push>& pushes) {
  Metrics metrics;
  double last_total = 0.0;
  for (const simulate::Push& push : pushes) {
    expects(push.insertion >= metrics.insertion);
    metrics.force_impulse +=
        0.5 * (last_total + push.total_contact_force) * (push.insertion - metrics.insertion);
    last_total = push.total_contact_force;
    metrics.insertion = push.insertion;

    metrics.peak_tip_force = std::max(metrics.peak_tip_force, push.tip_force);
    metrics.peak_contact_force = std::max(metrics.peak_contact_force, push.peak_contact_force);
    metrics.peak_push_force = std::max(metrics.peak_push_force, std::abs(push.push_force));
    metrics.peak_curvature = std::max(metrics.peak_curvature, push.peak_curvature);
    metrics.max_penetration = std::max(metrics.max_penetration, push.max_penetration);
    metrics.residual = std::max(metrics.residual, push.residual);
    metrics.iterations += push.iterations;
  }
  if (metrics.insertion > 0.0) {
    metrics.mean_contact_force = metrics.force_impulse / metrics.insertion;
  }
  return metrics;
}

Metrics compute_metrics(const simulate::TrialResult& trial, const Study& study,
                        const Centerline& path) {
  expects(path.points.cols() > 0);
  Metrics metrics = compute_push_metrics(trial.pushes);
  metrics.reached = trial.outcome == simulate::Outcome::kReached;
  metrics.tip_to_target = (final_tip(trial, study) - study.goal.point).norm();
  metrics.centerline_deviation = mean_distance_to_path(trial.nodes, path);
  return metrics;
}

}  // namespace wireplan::plan
