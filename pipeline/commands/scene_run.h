#pragma once
/// `wireplan simulate`: runs a scene and writes what a user reads and looks at.
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/files/scene_file.h"

namespace wireplan::pipeline {

struct SceneAnswer {
  bool solved = false;  // an equilibrium was found, whatever became of the wire
  std::string line;     // what came out, in one line, and in another what it hangs on
};

/// Throws Error where the scene's vessel is not sound or its wire would enter outside of it;
/// returns in sentences what was mended, and that it touches the wall where it enters.
std::vector<std::string> check_scene_vessel(const SceneFile& scene);

/// Of a scene with a list of rolls all this is written for each, into a folder named by it
/// (roll_45), with the vessel built once.
///
/// Writes into `folder`: result.json, wire.vtp, of several tools NAME.vtp of
/// each that is out of the introducer, and wire.png; of
/// an insertion also the shapes on the way, shapes.pvd, of several tools shapes-NAME.pvd of each,
/// at the start and after each move; in a vessel also forces.vtu, the wall with
/// the force that each triangle takes at the end (`force_n`), of an insertion the largest of all
/// pushes (`peak_force_n`), and of a vessel that moves as a whole vessel.pvd, as it was on the way.
/// Throws Error where check_scene_vessel() does or a file cannot
/// be written.
SceneAnswer run_scene_file(const SceneFile& scene, const std::filesystem::path& folder);

}  // namespace wireplan::pipeline
