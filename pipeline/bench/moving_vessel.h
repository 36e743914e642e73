#pragma once
/// What it costs that a vessel moves as a whole. For use in this folder.
#include <vector>

#include "pipeline/files/json_reader.h"
#include "preprocess/vessel.h"

namespace wireplan::pipeline {

/// Straight wires of these EI [N mm^2] pushed in by `length` [mm] along the path of a vessel that
/// yields, with cross-sections that move and without, in turns; times are compared per push.
std::vector<Json> time_moving_vessel(const Vessel& vessel, const std::vector<double>& EI,
                                     double length, int repeats);

/// What is asked of these rows, beside what they say.
Json moving_aim(const std::vector<Json>& rows);

}  // namespace wireplan::pipeline
