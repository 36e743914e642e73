#pragma once
/// An aorta of 17 mm above two legs of 9 mm that part by 60 degrees, with a renal artery of 6 mm
/// that leaves it 40 degrees downward; and a Simmons, which does not open in it by itself.
#include <cmath>
#include <memory>
#include <vector>

#include "plan/candidates.h"
#include "simulate/insertion/way.h"
#include "tests/shapes.h"
#include "tests/simulate/tool_vessels.h"

namespace wireplan::plan::iliacs {

inline constexpr double kTrunk = 8.5, kLegRadius = 4.5, kRenalRadius = 3.0;
inline constexpr double kTop = 160.0, kRenalLevel = 90.0, kLegLength = 110.0;
inline constexpr double kForkLevel = -4.0;  // of the tree, between the legs' mouths

/// So far along the right leg (side -1) or the left one (1), downward from the fork.
inline Vec3 leg(double side, double s) { return {0.5 * side * s, 0.0, -std::sqrt(0.75) * s}; }
inline Vec3 renal(double s) {
  const double down = 40.0 * kRadPerDeg;
  return {std::cos(down) * s, 0.0, kRenalLevel - std::sin(down) * s};
}

inline const simulate::VesselModel& vessel() {
  static const simulate::VesselModel model(
      shapes::level_set(
          [](const Vec3& p) {
            const auto soft = [](double depth) { return std::exp(depth / 0.5); };
            const auto tube = [&](const Vec3& from, const Vec3& to, double radius) {
              return soft(shapes::depth_in_tube(p, from, to, radius));
            };
            return 0.5 * std::log(tube(Vec3(0, 0, kForkLevel), Vec3(0, 0, kTop), kTrunk) +
                                  tube(leg(1, 0), leg(1, kLegLength), kLegRadius) +
                                  tube(leg(-1, 0), leg(-1, kLegLength), kLegRadius) +
                                  tube(renal(0), renal(60), kRenalRadius));
          },
          Vec3(-62.0, -10.0, -100.0), Vec3(62.0, 10.0, kTop + 1.5), 1.2),
      simulate::LumenOptions{.grid_spacing = 0.7});
  return model;
}

inline Centerline line_through(const std::vector<Vec3>& corners) {
  Centerline line = shapes::line_through(corners, kTrunk);
  for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
    const Vec3 p = line.points.col(i);
    if (p.z() < -8.0) line.radius[i] = kLegRadius;
    if (p.z() > 0.0 && p.x() > kTrunk - 1.0) line.radius[i] = kRenalRadius;
  }
  return line;
}

/// Up the right leg and the aorta; the left leg; the renal artery.
inline std::vector<preprocess::Branch> tree() {
  const Vec3 access = leg(-1, 70), fork(0, 0, kForkLevel);
  const double up = (fork - access).norm();
  return {{line_through({access, fork, Vec3(0, 0, kTop - 2.0)}), -1, 0.0},
          {line_through({fork, leg(1, kLegLength - 1.0)}), 0, up},
          {line_through({Vec3(0, 0, kRenalLevel), renal(59)}), 0, up + kRenalLevel - kForkLevel}};
}

inline std::shared_ptr<simulate::Way> way(std::vector<preprocess::Branch> of = tree()) {
  return std::make_shared<simulate::Way>(
      line_through({leg(-1, 70), Vec3(0, 0, kForkLevel), Vec3(0, 0, kRenalLevel), renal(35)}),
      std::move(of));
}

inline Catheter simmons() {
  Catheter catheter;
  std::vector<simulate::Section> sections = simulate::simmons_tip();
  sections.push_back({.length = 700.0, .bending_stiffness = 332.0});
  catheter.tool.wire = {
      .name = "simmons", .radius = 0.8335, .sections = std::move(sections), .friction = 0.1};
  catheter.tool.inner_radius = 0.4955;
  return catheter;
}

/// From the right groin 35 mm into the renal artery.
inline Study study() {
  Study study;
  study.wires = {
      {.name = "wire",
       .radius = 0.4445,
       .sections = {{.length = 30.0, .bending_stiffness = 5.0},
                    {.length = 70.0, .bending_stiffness = 5.0, .proximal_bending_stiffness = 120.0},
                    {.length = 1400.0, .bending_stiffness = 120.0}},
       .friction = 0.04}};
  study.catheters = {simmons()};
  study.inclinations = study.azimuths = study.rolls = {0.0};
  study.access = leg(-1, 70);
  study.tangent = -study.access.normalized();
  study.goal.way = way();
  study.goal.point = study.goal.way->section().center;
  study.goal.radius = study.goal.way->section().radius;
  study.goal.at_section = true;
  study.insertion.length = 400.0;
  study.insertion.element_length = 1.5;
  study.insertion.friction = 0.04;
  study.insertion.step = 1.0;
  return study;
}

}  // namespace wireplan::plan::iliacs
