#pragma once
/// Tools in one another, as tests need them.
#include "simulate/insertion/tool_bench.h"
#include "tests/simulate/verification_rods.h"

namespace wireplan::simulate {

constexpr double kTubeNu = 0.3;  // Poisson's ratio of round tubes

/// Of one stiffness and curvature; as stiff to torque as a round tube unless told otherwise.
inline Tool uniform_tool(double length, double EI, double curvature = 0.0, double GJ = 0.0) {
  Wire wire = uniform_wire(length, EI, 1e5, GJ > 0.0 ? GJ : EI / (1.0 + kTubeNu), curvature);
  return {.wire = std::move(wire), .inner_radius = 0.6};
}

/// Out of an introducer along x, with tools at so much insertion and roll.
inline ToolScene tools_along_x(std::vector<Tool> tools, std::vector<ToolPlace> places) {
  ToolScene scene;
  scene.tools = std::move(tools);
  scene.places = std::move(places);
  scene.residual_tolerance = 1e-8;
  return scene;
}

inline ToolMove push_of(std::vector<double> push) {
  std::vector<double> turn(push.size(), 0.0);
  return {std::move(push), std::move(turn)};
}

inline ToolMove turn_of(std::vector<double> turn) {
  std::vector<double> push(turn.size(), 0.0);
  return {std::move(push), std::move(turn)};
}

/// Curvature of the centreline at the node next to the arc length s.
inline double curvature_at(const ToolBench& bench, double s) {
  const Eigen::Matrix3Xd& x = bench.state().x;
  const double h = bench.composite().rod.rest_length[0];
  const auto i = static_cast<Eigen::Index>(std::lround(s / h));
  const Vec3 a = x.col(i) - x.col(i - 1), b = x.col(i + 1) - x.col(i);
  return std::atan2(a.cross(b).norm(), a.dot(b)) / h;
}

}  // namespace wireplan::simulate
