#pragma once
/// A catheter with a hook and a straight wire, and lines to lead them along.
#include <cmath>

#include "simulate/insertion/tool_trial.h"

namespace wireplan::simulate {

inline Tool hooked_catheter() {
  Tool tool;
  tool.wire = {.name = "hook",
               .radius = 0.83,
               .sections = {{.length = 18.0, .bending_stiffness = 99.0, .rest_curvature = 0.08},
                            {.length = 900.0, .bending_stiffness = 332.0}},
               .friction = 0.1};
  tool.inner_radius = 0.5;
  return tool;
}

inline Tool straight_wire(double EI) {
  Tool tool;
  tool.wire = {.name = "wire",
               .radius = 0.44,
               .sections = {{.length = 1400.0, .bending_stiffness = EI}},
               .friction = 0.04};
  return tool;
}

inline ToolTrialOptions coarse() {
  ToolTrialOptions options;
  options.insertion.element_length = 3.0;
  options.insertion.friction = 0.04;
  options.insertion.length = 400.0;
  return options;
}

inline Centerline line_from(const Vec3& from, const Vec3& to, double radius) {
  const double length = (to - from).norm();
  const auto n = static_cast<Eigen::Index>(std::lround(length)) + 1;
  Centerline line{Eigen::Matrix3Xd(3, n), Eigen::VectorXd::Constant(n, radius),
                  Eigen::VectorXd::LinSpaced(n, 0.0, length)};
  for (Eigen::Index k = 0; k < n; ++k) {
    line.points.col(k) = from + line.arc_length[k] / length * (to - from);
  }
  return line;
}

}  // namespace wireplan::simulate
