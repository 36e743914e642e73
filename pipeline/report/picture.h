#pragma once
/// A picture of wires in a vessel, as a PNG: the vessel translucent, the wires solid, two
/// orthographic views side by side. Up is the axis along which the scene is longest (z, toward the
/// head, for an upright patient); letters at the edges name the sides (R L A P S I)
/// where the axes are the patient's.
///
/// Drawn by a small depth-buffer rasteriser of our own, not through VTK's renderer: Debian's VTK
/// has X11 OpenGL windows alone (no EGL, no OSMesa), and without a display these end the process.
/// Here no display, driver or font is needed, and the same scene gives the same bytes at any
/// thread count. VTK still sets the text and writes the file.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/report/canvas.h"
#include "preprocess/vessel.h"

namespace wireplan::pipeline {

/// Color of the k-th wire of a picture; they repeat after six.
Color wire_color(int k);

struct PictureWire {
  std::string name;               // for the legend
  Eigen::Matrix3Xd nodes;         // (3, k), at least 2                                   [mm]
  Eigen::VectorXd contact_force;  // (k) norm per node, shown as red beads; may be empty   [N]
  double radius = 0.45;           // drawn at least two pixels wide                       [mm]
  Color color = wire_color(0);
};

struct PictureMarks {
  std::string title;
  std::optional<Vec3> access = {};  // blue ball                                         [mm]
  std::optional<Vec3> target = {};  // green ball in a ring of the target's radius       [mm]
  double target_radius = 4.0;       //                                                        [mm]
  bool patient_axes = true;         // else sides are named by the input's axes: +x, -y
  /// Painted on the vessel by force_color up to the largest, which the legend tells; one value per
  /// triangle, or empty.                                                                     [N]
  std::vector<double> wall_force = {};
};

struct PictureSize {
  int width = 1200, height = 1600;  // at least 200 each                                  [px]
};

/// Draws the scene. Surface or wires may be empty; all coordinates are expected to be finite.
Picture draw_picture(const Surface& vessel, const std::vector<PictureWire>& wires,
                     const PictureMarks& marks, const PictureSize& size = {});

/// Draws the scene and writes it to `png`. Throws `Error` where the file cannot be written.
void write_picture(const Surface& vessel, const std::vector<PictureWire>& wires,
                   const PictureMarks& marks, const std::filesystem::path& png);

}  // namespace wireplan::pipeline
