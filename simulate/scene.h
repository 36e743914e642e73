#pragma once
/// The laboratory bench: one wire, its supports and loads, and its equilibrium (design section 5).
/// A scene with an insertion into a vessel is a trial (trial.h).
#include <string>
#include <vector>

#include "simulate/solver.h"

namespace wireplan::simulate {

enum class WireEnd { kProximal, kDistal };

enum class SupportKind {
  kClamped,  // position and direction held
  kPinned,   // position held
  kGuided,   // direction held and sideways position, free along the direction
};

struct Support {
  WireEnd at = WireEnd::kProximal;
  SupportKind kind = SupportKind::kClamped;
  Vec3 point = Vec3::Zero();       //                                                   [mm]
  Vec3 direction = Vec3::UnitX();  // unit tangent, proximal to distal
  double roll = 0.0;               // of a clamped or guided end, from reference_normal   [rad]
};

struct Loads {
  Vec3 gravity = Vec3::Zero();    //                                                   [mm/s^2]
  Vec3 tip_force = Vec3::Zero();  // dead load on the distal node                      [N]
};

struct SolverOptions {
  double residual_tolerance = 1e-6;  // largest nodal force out of balance                [N]
  int max_iterations = 200;          // per load step
  int load_steps = 1;                // loads grow in equal steps from 0
};

/// The wire starts straight from the proximal support along its direction; a distal support then
/// moves its end to where it is held, in the same steps in which the loads grow.
struct Scene {
  Wire wire;
  int elements = 20;  // of equal length along the wire
  std::vector<Support> supports;
  Loads loads;
  SolverOptions solver;
};

enum class SceneOutcome { kConverged, kNotConverged };
const char* outcome_name(SceneOutcome outcome);  // "converged", "not_converged"

struct Reaction {
  WireEnd at = WireEnd::kProximal;
  Vec3 force = Vec3::Zero();   // of the support on the wire                        [N]
  Vec3 moment = Vec3::Zero();  // about the support's point                         [N mm]
};

struct SceneResult {
  SceneOutcome outcome = SceneOutcome::kNotConverged;
  std::string reason;              // why it did not converge; else empty
  std::vector<std::string> terms;  // energy terms that were built
  Eigen::Matrix3Xd nodes;          // (3, n) proximal to distal                         [mm]
  Energy energy;
  double gravity_energy = 0.0;  // the part of energy.load that is gravity           [N mm]
  Eigen::VectorXd twist;        // (n) angle at each node; empty unless built         [rad]
  double residual = 0.0;        //                                                   [N]
  int iterations = 0, steps = 0;
  double cpu_time_s = 0.0;  // of the solver alone
  std::vector<Reaction> reactions;
};

/// Static equilibrium by Newton's method on the paper's energy. Expects at least one support that
/// holds the wire against rigid motion.
SceneResult run_scene(const Scene& scene);

}  // namespace wireplan::simulate
