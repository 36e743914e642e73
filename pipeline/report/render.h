#pragma once
/// `wireplan render`: a report's pictures, without a browser or a display (see picture.h).
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "pipeline/report/canvas.h"

namespace wireplan::pipeline {

/// Draws what REPORT.json tells into `folder`:
///   vessel.png     the vessel with the best plans, or with none where no plan is ranked
///   forces.png     the largest force of any trial on each part of the wall
///   angles.png     wires and rolls x entry angles: largest contact force, or how the trial ended
///   numerics.png   position error against run time; not drawn where no plan was refined
/// Reads surface.vtp, forces.vtu and the trials' files beside the report. Throws `Error` where one
/// of them is not there. Returns a line per picture.
std::vector<std::string> render_report(const std::filesystem::path& report,
                                       const std::filesystem::path& folder);

/// The grid of angles.png, from a report's trials.
Picture draw_angles(const Json& report);

}  // namespace wireplan::pipeline
