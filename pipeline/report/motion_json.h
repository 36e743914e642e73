#pragma once
/// How a wire moves the vessel as a whole, for the report: what shifts by how much, and what that
/// does to lengths and angles.
#include <Eigen/Core>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "plan/anatomy/projection.h"
#include "simulate/insertion/way.h"
#include "simulate/wall/section_chain.h"

namespace wireplan::pipeline {

/// Of the shape in which a trial ended: `u` (3, nodes of the chain) [mm]. Views are those that the
/// arm shows best, null where the axes from which they count are not known: then only by how much
/// they change is told.
Json motion_json(const simulate::Way& way, const simulate::SectionChain& chain,
                 const Eigen::Matrix3Xd& u, const plan::ArmLimits& arm, bool axes_known);

/// Of a plan's repeats under disturbances, each as motion_json() tells it, at least one: medians
/// and the bounds of the central 90 %. Of a turn that some repeats undo it is that of the others;
/// rows are those of any, so they are found by their branch and not by their place.
Json motion_spread_json(const std::vector<Json>& repeats);

}  // namespace wireplan::pipeline
