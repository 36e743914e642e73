#pragma once
/// What the hand does in a scene: where the wire enters or lies at the start, its rolls and moves;
/// and how it was measured to lie in the end.
#include "pipeline/files/json_reader.h"
#include "pipeline/files/scene_file.h"

namespace wireplan::pipeline {

/// What a roll of a scene lacks to that of simulate, which counts from reference_normal() [rad].
/// Scenes count from anterior (-y) made square to the direction, however near to y that runs: so
/// the zero turns evenly with the direction, and it is superior (+z) only along y itself, where no
/// choice is without a jump.
double roll_of_anterior(const Vec3& direction);

/// Reads "insertion", "start" and "measured" of a scene whose wire is known already.
void read_hand(JsonReader& root, InsertionScene& scene);

}  // namespace wireplan::pipeline
