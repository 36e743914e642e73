#pragma once
/// The support of a scene's vessel that explains a wire as it was measured in the patient.
#include <string>
#include <vector>

#include "pipeline/files/scene_file.h"
#include "preprocess/vessel.h"

namespace wireplan::pipeline {

struct SceneSupport {
  double support = 0.0;  // the best one                                                [MPa/mm]
  Json json;             // "support_fit" of result.json
  std::string line;      // in a sentence
};

/// Runs the insertion with one support after another (plan/support_fit.h), which the vessel's
/// sections get in turn; `tree` is the vessel's and `young_modulus` its wall's [MPa]. The measured
/// line counts by a place every 10 mm, each by its distance to the computed wire. Expects a scene
/// with a measured wire. Throws Error where no support gives a wire.
SceneSupport find_scene_support(const InsertionScene& scene, const WallInput& wall,
                                const std::vector<preprocess::Branch>& tree, double young_modulus,
                                simulate::VesselModel& vessel);

}  // namespace wireplan::pipeline
