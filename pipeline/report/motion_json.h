#pragma once
/// How a wire moves the vessel as a whole, for the report: what shifts by how much, and what that
/// does to lengths and angles.
#include <Eigen/Core>

#include "pipeline/files/json_reader.h"
#include "simulate/insertion/way.h"
#include "simulate/wall/section_chain.h"

namespace wireplan::pipeline {

/// Of the shape in which a trial ended: `u` (3, nodes of the chain) [mm].
Json motion_json(const simulate::Way& way, const simulate::SectionChain& chain,
                 const Eigen::Matrix3Xd& u);

}  // namespace wireplan::pipeline
