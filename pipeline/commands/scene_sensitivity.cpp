#include "pipeline/commands/scene_sensitivity.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "pipeline/files/text.h"

namespace wireplan::pipeline {
namespace {

constexpr double kApart = 1.0;        // final shapes that differ by more are told of       [mm]
constexpr double kElementPart = 0.9;  // of the elements' length; chosen
constexpr double kSightStep = 0.1;    // between looks along a line through the lumen; chosen [mm]
constexpr double kFarthest = 60.0;    // that such a line is followed: no vessel is wider    [mm]
constexpr double kTipLength = 10.0;   // wire that tells where a vessel leads; chosen        [mm]
constexpr int kPairs = 4;             // of lines across a vessel; chosen
constexpr double kShortRun = 2e6;     // iterations times nodes: a few seconds

/// Iterations of a run times the nodes that were free in them: what another one will cost.
double count_work(const simulate::TrialResult& result) {
  double work = 0.0;
  for (const simulate::Push& push : result.pushes) work += push.iterations * push.insertion;
  return work * static_cast<double>(result.nodes.cols()) / result.pushes.back().insertion;
}

double farthest_from(const Eigen::Matrix3Xd& nodes, const Eigen::Matrix3Xd& other) {
  double most = 0.0;
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    most = std::max(most, (simulate::nearest_on_line(other, nodes.col(i)) - nodes.col(i)).norm());
  }
  return most;
}

/// How far the lumen goes straight on from a point.
double reach(const Vec3& from, const Vec3& direction, const simulate::Lumen& lumen) {
  double far = 0.0;
  while (far < kFarthest && lumen.distance(from + far * direction) >= 0.0) far += kSightStep;
  return far;
}

/// Width of the vessel at the tip of a wire, by lines through the tip square to the wire's last
/// 10 mm. Near the wall of a round vessel only one is as long as it is wide, and one that runs
/// along the vessel, as where the tip points at the wall, is far longer: of two lines square to
/// each other the longer one counts, and of all such pairs the shortest, times the root of 2.
double width_at_tip(const Eigen::Matrix3Xd& nodes, const simulate::Lumen& lumen) {
  const Vec3 tip = nodes.rightCols<1>();
  Eigen::Index back = nodes.cols() - 1;
  while (back > 0 && (nodes.col(back) - tip).norm() < kTipLength) --back;
  const Vec3 along = (tip - nodes.col(back)).normalized();
  const Vec3 u = along.unitOrthogonal(), v = along.cross(u);
  const auto line_at = [&](double angle) {
    const Vec3 across = std::cos(angle) * u + std::sin(angle) * v;
    return reach(tip, across, lumen) + reach(tip, -across, lumen);
  };
  double width = 2.0 * kFarthest;
  for (int k = 0; k < kPairs; ++k) {
    const double angle = 0.5 * kPi * k / kPairs;
    width = std::min(width, std::max(line_at(angle), line_at(angle + 0.5 * kPi)));
  }
  return std::sqrt(2.0) * width;
}

/// Whether the other wire passes the tip of a wire in the same vessel: no further away than that is
/// wide, with lumen all along the line between.
bool passes_tip(const Eigen::Matrix3Xd& other, const Eigen::Matrix3Xd& nodes,
                const simulate::Lumen& lumen) {
  const Vec3 tip = nodes.rightCols<1>(), way = simulate::nearest_on_line(other, tip) - tip;
  const double distance = way.norm();
  if (distance == 0.0) return true;
  return distance <= width_at_tip(nodes, lumen) + kSightStep &&
         reach(tip, way / distance, lumen) >= distance - kSightStep;
}

/// The scene with one setting changed that should not matter.
struct OtherRun {
  const char* changed;
  double value = 0.0;  // [mm]
  simulate::InsertionOptions options;
};

std::vector<OtherRun> other_runs(const simulate::InsertionOptions& options) {
  std::vector<OtherRun> runs;
  for (const double factor : {0.25, 0.5, 2.0, 4.0}) {
    simulate::InsertionOptions changed = options;
    changed.step = factor * options.step;
    runs.push_back({"insertion.step_mm", changed.step, changed});
  }
  simulate::InsertionOptions finer = options;
  finer.element_length *= kElementPart;
  for (double& length : finer.section_element_length) length *= kElementPart;
  // 0 stands for that of the scene.
  const bool of_tip =
      !finer.section_element_length.empty() && finer.section_element_length[0] > 0.0;
  runs.push_back({"element_length_mm",
                  of_tip ? finer.section_element_length[0] : finer.element_length, finer});
  return runs;
}

/// Two ends of one insertion.
struct Comparison {
  bool same_outcome = false, same_branch = false;
  double distance = 0.0;      // the largest of the shapes                                  [mm]
  double tip_distance = 0.0;  //                                                            [mm]
  Vec3 tip = Vec3::Zero();    // of the other                                               [mm]

  bool is_near() const { return same_outcome && same_branch && distance <= kApart; }
};

/// Nodes of the wire in the vessel; the entry alone where the first push came to nothing.
Eigen::Matrix3Xd nodes_in_vessel(const simulate::TrialResult& trial, const Vec3& entry) {
  return trial.nodes.cols() > 0 ? trial.nodes : Eigen::Matrix3Xd(entry);
}

/// The first run has nodes, the other perhaps none.
Comparison compare_ends(const simulate::TrialResult& first, const simulate::TrialResult& other,
                        const Vec3& entry, const simulate::Lumen& lumen) {
  const Eigen::Matrix3Xd nodes = nodes_in_vessel(other, entry);
  return {.same_outcome = first.outcome == other.outcome,
          .same_branch = other.nodes.cols() == 0 || in_one_branch(first.nodes, nodes, lumen),
          .distance = largest_distance(first.nodes, nodes),
          .tip_distance = (first.nodes.rightCols<1>() - nodes.rightCols<1>()).norm(),
          .tip = nodes.rightCols<1>()};
}

Json row_of_run(const OtherRun& run, const simulate::TrialResult& other,
                const Comparison& compared) {
  return {{"changed", run.changed},
          {"value_mm", run.value},
          {"outcome", simulate::outcome_name(other.outcome)},
          {"same_outcome", compared.same_outcome},
          {"same_branch", compared.same_branch},
          {"largest_distance_mm", compared.distance},
          {"tip_distance_mm", compared.tip_distance},
          {"tip_mm", to_json(compared.tip)}};
}

std::string tell_apart(const OtherRun& run, const simulate::TrialResult& other,
                       const Comparison& compared) {
  std::string text =
      format("with %s %.3g it ends up to %.1f mm away", run.changed, run.value, compared.distance);
  if (!compared.same_branch) text += ", in another branch";
  if (!compared.same_outcome) text += std::string(", ") + simulate::outcome_name(other.outcome);
  return text;
}

}  // namespace

simulate::TrialResult run_hand(const InsertionScene& scene, const simulate::VesselModel& vessel,
                               const simulate::InsertionOptions& options) {
  if (!scene.start && scene.moves.empty()) {
    return simulate::run_trial(scene.wire, scene.introducer, scene.goal, vessel, options);
  }
  simulate::Trial trial(scene.wire, scene.introducer, scene.goal, vessel, options);
  if (!scene.start || trial.start(*scene.start)) {
    for (const simulate::Move& move : scene.moves) trial.make(move);
    if (scene.depth) trial.make({.push = *scene.depth - trial.depth()});
  }
  return trial.finish();
}

double largest_distance(const Eigen::Matrix3Xd& nodes_a, const Eigen::Matrix3Xd& nodes_b) {
  return std::max(farthest_from(nodes_a, nodes_b), farthest_from(nodes_b, nodes_a));
}

bool in_one_branch(const Eigen::Matrix3Xd& nodes_a, const Eigen::Matrix3Xd& nodes_b,
                   const simulate::Lumen& lumen) {
  return passes_tip(nodes_a, nodes_b, lumen) || passes_tip(nodes_b, nodes_a, lumen);
}

Sensitivity check_sensitivity(const InsertionScene& scene, const simulate::VesselModel& vessel,
                              const simulate::TrialResult& result) {
  Sensitivity found;
  const auto leave_out = [&](const char* reason) {
    found.json = nullptr;
    found.reason = reason;
    return found;
  };
  if (!scene.check_sensitivity.value_or(true)) return leave_out("check_sensitivity is false");
  if (result.pushes.empty()) return leave_out("the wire did not get in");
  if (!scene.check_sensitivity.has_value() && count_work(result) > kShortRun) {
    return leave_out("the scene is a long one; give check_sensitivity: true");
  }

  double largest = 0.0;
  std::string apart;
  Json rows = Json::array();
  for (const OtherRun& run : other_runs(scene.options)) {
    const simulate::TrialResult other = run_hand(scene, vessel, run.options);
    const Comparison compared = compare_ends(result, other, scene.introducer.point, vessel.lumen);
    rows.push_back(row_of_run(run, other, compared));
    largest = std::max(largest, compared.distance);
    if (compared.is_near()) continue;
    apart += (apart.empty() ? "" : "; ") + tell_apart(run, other, compared);
  }
  found.json = {{"sensitive", !apart.empty()}, {"largest_distance_mm", largest}, {"runs", rows}};
  if (!apart.empty()) {
    found.warning = "the end of this insertion hangs on how it is solved: " + apart;
  }
  return found;
}

}  // namespace wireplan::pipeline
