#pragma once
/// Manoeuvres of a catheter over a wire that `bench throughput` takes the time of. For use in this
/// folder.
#include <functional>
#include <vector>

#include "pipeline/files/json_reader.h"

namespace wireplan::pipeline {

/// A wire is pushed by `length` [mm] into a tube with two bends, then a curved catheter over it:
/// with long elements on a rigid wall, as scouts have it, and in full on one that yields. Each row
/// is told as soon as it is there.
std::vector<Json> time_coaxial_manoeuvres(double length,
                                          const std::function<void(const Json&)>& tell);

/// What is asked of these rows, beside what they say.
std::vector<Json> list_coaxial_aims(const std::vector<Json>& rows);

}  // namespace wireplan::pipeline
