#pragma once
/// How a vessel moves as a whole: its cross-sections on the case's or scene's support, stiffer
/// where anatomy holds it.
#include <memory>
#include <vector>

#include "pipeline/files/case_file.h"
#include "simulate/wall/section_chain.h"

namespace wireplan::pipeline {

/// Expects a wall with a support and the vessel's tree. `young_modulus` is the wall's [MPa]. Throws
/// Error where a point that is to hold the vessel is too far from it to hold anything.
std::unique_ptr<const simulate::SectionChain> make_section_chain(
    const WallInput& wall, const std::vector<preprocess::Branch>& tree, const Vec3& access,
    double young_modulus);

}  // namespace wireplan::pipeline
