#pragma once
/// SCENE.json -> one wire on the laboratory bench, with or without a vessel round it, several tools
/// in one another there, or one insertion into a vessel (design section 5). What the design has and
/// this version not is refused by name.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/files/case_file.h"
#include "pipeline/files/tool_scene_file.h"
#include "simulate/insertion/scene.h"
#include "simulate/insertion/trial.h"

namespace wireplan::pipeline {

/// The vessel of a scene; what the scene does not give of it is not there: rigid, without friction.
struct SceneVessel {
  SurfaceInput surface;
  WallInput wall;
  double friction = 0.0;
  double contact_spacing = 1.0;  // [mm]
  simulate::ContactLaw contact_law = {};
};

/// The wire as it was seen in the patient, which tells how the vessel is held.
struct MeasuredWire {
  Eigen::Matrix3Xd line;  // (3, k) proximal to distal, from the introducer's point on       [mm]
  double sigma = 1.0;     // one standard deviation of its places                            [mm]
};

/// A wire pushed into a vessel: what run_trial asks for.
struct InsertionScene {
  simulate::Wire wire;
  simulate::Introducer introducer;
  std::vector<double> rolls = {};  // where the scene lists several: of the introducer, one per
                                   // result, as its own roll [rad]
  std::vector<simulate::Move> moves = {};         // empty: pushed in by options.length, or, from a
                                                  // start, on to `depth`
  std::optional<double> depth = {};               // in the end, from a start              [mm]
  std::optional<simulate::StartLine> start = {};  // the line that the wire starts from
  double roll_zero = 0.0;  // of the scene, in the introducer's roll: see roll_of_anterior()  [rad]
  simulate::Goal goal;     // where the scene gives none: one so far away that no tip reaches it
  bool has_target = false;
  simulate::InsertionOptions options;         // edges as long as the wire's elements
  std::optional<MeasuredWire> measured = {};  // the vessel's support is the one that explains it
  std::optional<bool> check_sensitivity;      // see scene_sensitivity.h; empty: if it costs little
};

/// Exactly one of bench, tools and insertion is there, the last with a vessel.
struct SceneFile {
  std::filesystem::path file;
  std::string name;  // of the file without its ending, of the folder if it is scene.json
  std::optional<SceneVessel> vessel;
  std::optional<simulate::Scene> bench;  // its vessel is not set
  std::optional<ToolBenchScene> tools;   // its vessel is not set
  std::optional<InsertionScene> insertion;
};

/// Reads, checks and converts to internal units. Throws Error with all problems at once.
SceneFile read_scene(const std::filesystem::path& path);

/// EA [N] from the paper's k_s [N/m^3] and EI [N mm^2] from its k_b [N/m], for edges of
/// `edge_length` h [mm]: k_s = EA / (2 h^3) and k_b = EI / h^3 with h in m.
double axial_stiffness_from_paper(double stretch_coefficient, double edge_length);
double bending_stiffness_from_paper(double bend_coefficient, double edge_length);

}  // namespace wireplan::pipeline
