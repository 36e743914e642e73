#pragma once
/// Whether an insertion's result hangs on how finely it was solved: the same scene again with other
/// steps and elements, held against the first.
#include <string>

#include "pipeline/files/json_reader.h"
#include "pipeline/files/scene_file.h"
#include "simulate/wall/vessel_model.h"

namespace wireplan::pipeline {

/// What came of the runs.
struct Sensitivity {
  Json json;            // "sensitivity" of result.json; null where nothing was run
  std::string reason;   // ... for this reason
  std::string warning;  // where one ends more than 1 mm, a branch or an outcome apart; else empty
};

/// What the hand does in the scene, once: from its start, if it has one, its moves or its push.
simulate::TrialResult run_hand(const InsertionScene& scene, const simulate::VesselModel& vessel,
                               const simulate::InsertionOptions& options);

/// Runs the scene five times more: with a quarter, half, twice and four times the push's step, and
/// with elements a tenth shorter. Where the scene does not say whether, it does so after a short
/// first run, of which `result` is what came.
Sensitivity check_sensitivity(const InsertionScene& scene, const simulate::VesselModel& vessel,
                              const simulate::TrialResult& result);

/// Largest distance of a node of one wire from the other [mm].
double largest_distance(const Eigen::Matrix3Xd& nodes_a, const Eigen::Matrix3Xd& nodes_b);

/// Whether two wires that came in at one place ended in one vessel: one passes the tip of the other
/// in it, no further away than it is wide there, with lumen all along the line between.
bool in_one_branch(const Eigen::Matrix3Xd& nodes_a, const Eigen::Matrix3Xd& nodes_b,
                   const simulate::Lumen& lumen);

}  // namespace wireplan::pipeline
