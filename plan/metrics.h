#pragma once
/// One trial -> the numbers that plans are compared by (references C1; design section 6).
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "plan/candidates.h"
#include "preprocess/vessel.h"

namespace wireplan::plan {

/// Linear theory of the wall ends where it moves by more than this part of the vessel's radius.
inline constexpr double kLinearWallPart = 0.2;

/// Where the wall moved furthest for its vessel's size.
struct WallMotion {
  double displacement = 0.0;  //                                                           [mm]
  double radius = 0.0;        // of the path at its nearest point                          [mm]
  Vec3 point = Vec3::Zero();  //                                                           [mm]
  bool beyond_linear_theory() const { return displacement > kLinearWallPart * radius; }
};

/// What a hand does and gets, where a study has catheters: of a wire alone too, which has no
/// support, no hook and nothing to be out of.
struct ScriptMetrics {
  double support = 0.0;      // of the seated catheter, see simulate::CatheterSupport         [N]
  double hook_depth = 0.0;   // of the catheter's tip past the ostium at the end             [mm]
  double wire_beyond = 0.0;  // of the wire out of the catheter at the end, not behind it    [mm]
  double hand_force = 0.0;   // largest on a tool, pushed or held back                        [N]
  double hub_torque = 0.0;   // largest on a hub                                           [N mm]
  /// Of the hand: pushes, pulls and turns, each counted once until others begin; with what was
  /// tried again.
  int moves = 0;
  int exchanges = 0;        // of wires
  bool bears_more = false;  // the support is that at least
};

/// The numbers of ScriptMetrics that are measured, with their names in files.
struct ScriptMetricField {
  const char* name;
  double ScriptMetrics::*value;
};
inline constexpr std::array kScriptMetricFields = {
    ScriptMetricField{"support_n", &ScriptMetrics::support},
    ScriptMetricField{"hook_depth_mm", &ScriptMetrics::hook_depth},
    ScriptMetricField{"wire_beyond_catheter_mm", &ScriptMetrics::wire_beyond},
    ScriptMetricField{"peak_hand_force_n", &ScriptMetrics::hand_force},
    ScriptMetricField{"peak_hub_torque_n_mm", &ScriptMetrics::hub_torque},
};

struct Metrics {
  bool reached = false;
  double insertion = 0.0;               // wire in the body at the end of the trial          [mm]
  double tip_to_target = 0.0;           // distance at the end                               [mm]
  double nearest_to_target = 0.0;       // smallest distance after any push                  [mm]
  double peak_tip_force = 0.0;          // over the insertion                                [N]
  double peak_contact_force = 0.0;      // on any simulate::kContactLength of wire           [N]
  double mean_contact_force = 0.0;      // all contacts together, mean over the wire's way   [N]
  double force_impulse = 0.0;           // integral of all contacts' force over that way     [N mm]
  double peak_push_force = 0.0;         // largest mean over a push, pushed or held back     [N]
  double peak_curvature = 0.0;          //                                                   [1/mm]
  double centerline_deviation = 0.0;    // mean distance of the final wire from the path     [mm]
  double off_path = 0.0;                // furthest part of the final wire from the path's lumen, by
                                        // the path's inscribed radius                       [mm]
  double max_penetration = 0.0;         // wire surface past the wall, over the insertion    [mm]
  double peak_wall_displacement = 0.0;  // over the insertion                              [mm]
  WallMotion wall_motion;               // largest displacement / radius over the insertion
  double push_work = 0.0;               // of the hand                                     [N mm]
  double friction_work = 0.0;           // turned into heat                                [N mm]
  double energy_released = 0.0;    // work that is neither stored nor heat of friction at the end:
                                   // what the wire gave off in jumps                        [N mm]
  double energy_unbalanced = 0.0;  // see simulate::PushBalance                            [N mm]
  double residual = 0.0;           // largest over the pushes                           [N]
  long iterations = 0;             // of all pushes together
  std::optional<ScriptMetrics> script = {};  // in a study with catheters
};

/// The numbers of Metrics with their names in files, in the order of a report's trial.
struct MetricField {
  const char* name;
  double Metrics::*value;
  bool reported = true;
};
inline constexpr std::array kMetricFields = {
    MetricField{"insertion_mm", &Metrics::insertion},
    MetricField{"tip_to_target_mm", &Metrics::tip_to_target},
    MetricField{"nearest_to_target_mm", &Metrics::nearest_to_target, false},
    MetricField{"peak_tip_force_n", &Metrics::peak_tip_force},
    MetricField{"peak_contact_force_n", &Metrics::peak_contact_force},
    MetricField{"mean_contact_force_n", &Metrics::mean_contact_force},
    MetricField{"force_impulse_n_mm", &Metrics::force_impulse},
    MetricField{"peak_push_force_n", &Metrics::peak_push_force},
    MetricField{"push_work_n_mm", &Metrics::push_work},
    MetricField{"friction_work_n_mm", &Metrics::friction_work},
    MetricField{"energy_released_n_mm", &Metrics::energy_released},
    MetricField{"energy_unbalanced_n_mm", &Metrics::energy_unbalanced},
    MetricField{"peak_wall_displacement_mm", &Metrics::peak_wall_displacement},
    MetricField{"peak_curvature_per_mm", &Metrics::peak_curvature},
    MetricField{"centerline_deviation_mm", &Metrics::centerline_deviation},
    MetricField{"off_path_mm", &Metrics::off_path},
    MetricField{"max_penetration_mm", &Metrics::max_penetration},
    MetricField{"residual_n", &Metrics::residual},
};

/// All of the trial's numbers. Distances from target and path are those in the vessel at rest, of
/// which both are. Without a push the wire counts as lying at the access, free of
/// force. The deviation is the mean over the nodes of the exact distance to the path's segments.
/// Expects a path of at least one point.
Metrics compute_metrics(const simulate::TrialResult& trial, const Study& study,
                        const Centerline& path);

/// The metrics that follow from the pushes alone: insertion, forces, curvature, penetration,
/// displacement, work, residual and iterations. The impulse is the integral of the total contact
/// force over the wire's way, in and out, by the trapezoidal rule; it starts with no force at
/// insertion 0. The mean force is the impulse divided by that way.
Metrics compute_push_metrics(const std::vector<simulate::Push>& pushes);

/// What one tool of a script did and felt.
struct ToolMetrics {
  std::string name;
  double insertion = 0.0;        // at the end                                             [mm]
  double progress = 0.0;         // of its tip along the path at the end, 0 off it         [mm]
  double peak_tip_force = 0.0;   // of the wall on it                                      [N]
  double mean_tip_force = 0.0;   // over the trial's pushes                                [N]
  double peak_wall_force = 0.0;  // sum of the wall's normal forces on it                  [N]
  double peak_push_force = 0.0;  // of the hand, pushed or held back                       [N]
  double peak_hub_torque = 0.0;  //                                                     [N mm]
};

/// The numbers of ToolMetrics with their names in files.
struct ToolMetricField {
  const char* name;
  double ToolMetrics::*value;
};
inline constexpr std::array kToolMetricFields = {
    ToolMetricField{"insertion_mm", &ToolMetrics::insertion},
    ToolMetricField{"progress_mm", &ToolMetrics::progress},
    ToolMetricField{"peak_tip_force_n", &ToolMetrics::peak_tip_force},
    ToolMetricField{"mean_tip_force_n", &ToolMetrics::mean_tip_force},
    ToolMetricField{"peak_wall_force_n", &ToolMetrics::peak_wall_force},
    ToolMetricField{"peak_push_force_n", &ToolMetrics::peak_push_force},
    ToolMetricField{"peak_hub_torque_n_mm", &ToolMetrics::peak_hub_torque},
};

/// Of each tool of a trial that has several; else empty. From the outside in, those that were
/// exchanged in the order of their use.
std::vector<ToolMetrics> compute_tool_metrics(const simulate::TrialResult& trial,
                                              const Study& study, const Centerline& path);

/// Expects a study with catheters.
ScriptMetrics compute_script_metrics(const simulate::TrialResult& trial, const Study& study,
                                     const Centerline& path);

/// What planning and judging keep of a trial.
struct Measured {
  simulate::Outcome outcome = simulate::Outcome::kFailed;
  std::string reason = {};
  std::vector<std::string> terms = {};
  Metrics metrics = {};
  double progress = 0.0;           // furthest place of the tip along the path, in its lumen   [mm]
  Vec3 last_tip = Vec3::Zero();    // after the last push, in the vessel at rest; the access
                                   // without one                                          [mm]
  Eigen::Matrix3Xd nodes = {};     // (3, k) final shape                                       [mm]
  Eigen::Matrix3Xd sections = {};  // of it, as simulate::Shape has them                     [mm]
  double cpu_seconds = 0.0;        // that it took; timing, so never twice the same            [s]
  std::vector<ToolMetrics> tools = {};  // of catheter and wire; else empty
};

/// Whether the trial reached, and its catheter did not follow by the script's last step.
bool stays_unseated(const Candidate& script, const Measured& trial);

/// How far along the way a tip is (simulate::Way); of a study without one along the path [mm].
double find_progress(const Vec3& tip, const Study& study, const Centerline& path);

/// How far along it the tip came in any push [mm].
double find_progress(const simulate::TrialResult& trial, const Study& study,
                     const Centerline& path);

Measured measure(const simulate::TrialResult& trial, const Study& study, const Centerline& path);

}  // namespace wireplan::plan
