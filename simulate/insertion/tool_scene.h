#pragma once
/// All moves of several tools, one after the other, and what came of them.
#include <optional>
#include <string>
#include <vector>

#include "simulate/insertion/tool_bench.h"
#include "simulate/insertion/trial.h"

namespace wireplan::simulate {

struct ToolSceneResult {
  SceneOutcome outcome = SceneOutcome::kNotConverged;
  std::string reason;               // why it did not converge, or what is doubtful; else empty
  std::vector<std::string> terms;   // energy terms that were built
  std::vector<ToolRecord> history;  // at the start and after each move
  std::vector<Shape> shapes;        // of the centreline then, without forces
  Eigen::Matrix3Xd nodes;           // of the centreline                                 [mm]
  std::vector<Eigen::Matrix3Xd> tool_nodes;  // up to each tool's tip                     [mm]
  std::vector<Eigen::VectorXd> angles;       // see ToolBench::angles()                  [rad]
  Vec3 introducer_force = Vec3::Zero();      // on the tools                               [N]
  std::optional<Vec3> distal_force;          // of the support                             [N]
  std::vector<Touch> contacts;               // with the vessel
  /// Of the final shape: where a tool runs through itself, which it does not feel.
  std::optional<SelfCrossing> crossing;
};

/// All moves of the scene, as far as they have an equilibrium.
ToolSceneResult run_tool_scene(const ToolScene& scene);

}  // namespace wireplan::simulate
