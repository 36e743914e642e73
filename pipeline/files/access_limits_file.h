#pragma once
/// The case's `access_limits`: what the way in is held against.
#include "pipeline/files/json_reader.h"
#include "plan/anatomy/access_limits.h"

namespace wireplan::pipeline {

/// Reads the object, every key of which may be left out. The device is the thinnest catheter of the
/// case then [mm], where it names any, else 0: thicker ones are weighed as pairs.
plan::AccessLimits read_access_limits(JsonReader& root, double thinnest_catheter);

/// All of it, under the keys of the case file.
Json access_limits_json(const plan::AccessLimits& limits);

/// The keys of the sizes that neither `access_limits` nor a catheter of the case gives.
Json assumed_sizes(const plan::AccessLimits& limits);

}  // namespace wireplan::pipeline
