#pragma once
/// The report's "anatomy": access, C-arm angles and lengths along the way, as JSON in mm and deg.
#include "pipeline/files/json_reader.h"
#include "pipeline/report/report.h"
#include "plan/anatomy/access_limits.h"
#include "simulate/insertion/way.h"

namespace wireplan::pipeline {

/// What follows from way, limits and how wide the vessel is at each point of the way [mm]: "access"
/// without calcium, "c_arm" and "lengths" without wires. Without axes that are the patient's no
/// view of a C-arm is told, but why.
Json anatomy_figures(const simulate::Way& way, const Eigen::VectorXd& diameters,
                     const plan::AccessLimits& limits, bool axes_known = true);

/// Why the views may be wrong though the case does not say that its axes are unknown; empty where
/// the aorta runs as it does in a patient, or none is there.
std::string doubt_of_axes(const simulate::Way& way);

/// What a report says of a sheath or device, by its row of "access": "fits", "does not fit", or
/// that it is not weighed.
std::string describe_fit(const Json& passage);

/// The row of calcium in and beside the lumen: a volume [mm^3], or null with the reason where
/// `unknown` tells one.
Json calcium_json(double volume, const std::string& unknown, const plan::AccessLimits& limits);

/// The grade that a name in those figures stands for, 0 to 3; see plan::grade_of.
int grade_from(const std::string& name);

/// The same in lines of text, each with its end.
std::string describe_anatomy(const Json& figures);

/// What the page draws: {"tree": [...], "way"}, each line with "points" and "radius" every 2 mm.
Json anatomy_panel(const simulate::Way& way);

/// The figures of stage anatomy as the report has them, with which wires are long enough: for the
/// catheter of the first plan, where it has one, and else for the one that the limits assume.
Json anatomy_json(const ReportInput& input);

}  // namespace wireplan::pipeline
