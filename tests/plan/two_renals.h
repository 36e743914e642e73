#pragma once
/// A catheter with one curve, a wire, and an aorta with a branch on either side.
#include <cmath>
#include <memory>
#include <vector>

#include "plan/candidates.h"
#include "simulate/insertion/way.h"
#include "tests/goal.h"
#include "tests/shapes.h"

namespace wireplan::plan {

inline Catheter catheter_of(double length, double inner, double curve_radius = 10.0) {
  Catheter catheter;
  catheter.tool.wire = {
      .name = "hook",
      .radius = 0.83,
      .sections = {{.length = 8.0, .bending_stiffness = 99.0},
                   {.length = 0.5 * kPi * curve_radius,
                    .bending_stiffness = 99.0,
                    .rest_curvature = 1.0 / curve_radius},
                   {.length = length - 8.0 - 0.5 * kPi * curve_radius, .bending_stiffness = 332.0}},
      .friction = 0.1};
  catheter.tool.inner_radius = 0.5 * inner;
  return catheter;
}

inline simulate::Wire wire_of(double length, double radius) {
  return {.name = "wire",
          .radius = radius,
          .sections = {{.length = 30.0, .bending_stiffness = 2.0},
                       {.length = length - 30.0, .bending_stiffness = 20.0}},
          .friction = 0.04};
}

/// An aorta of 9 mm radius along z from 0 to 130 mm, with branches of 3 mm radius toward +x and -x
/// at 60 mm; all ends are flat and closed.
inline constexpr double kLevel = 60.0, kAorta = 9.0, kRenal = 3.0;

inline const simulate::VesselModel& aorta() {
  static const simulate::VesselModel vessel(
      shapes::level_set(
          [](const Vec3& p) {
            const auto renal = [&](double x) {
              return shapes::depth_in_tube(p, Vec3(0.0, 0.0, kLevel), Vec3(x, 0.0, kLevel), kRenal);
            };
            const double trunk =
                shapes::depth_in_tube(p, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 130.0), kAorta);
            const auto soft = [](double depth) { return std::exp(depth / 0.5); };
            return 0.5 * std::log(soft(trunk) + soft(renal(45.0)) + soft(renal(-45.0)));
          },
          Vec3(-46.0, -10.0, -1.5), Vec3(46.0, 10.0, 131.5), 1.1),
      simulate::LumenOptions{.grid_spacing = 0.6});
  return vessel;
}

inline Centerline line_through(const std::vector<Vec3>& corners) {
  Centerline line = shapes::line_through(corners, kAorta);
  for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
    if (std::abs(line.points(0, i)) > kAorta - 1.0) line.radius[i] = kRenal;
  }
  return line;
}

/// From below, 35 mm into the branch of that side.
inline Study toward(double side) {
  const auto branch = [](double x) {
    return preprocess::Branch{line_through({{0.0, 0.0, kLevel}, {x, 0.0, kLevel}}), 0,
                              kLevel - 5.0};
  };
  Study study;
  study.wires = {wire_of(1500.0, 0.44)};
  study.catheters = {catheter_of(650.0, 1.0, 8.0)};
  study.inclinations = study.azimuths = study.rolls = {0.0};
  study.access = Vec3(0.0, 0.0, 5.0);
  const auto way = std::make_shared<simulate::Way>(
      line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, kLevel}, {side * 35.0, 0.0, kLevel}}),
      std::vector<preprocess::Branch>{{line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 128.0}}), -1, 0.0},
                                      branch(44.0),
                                      branch(-44.0)});
  study.goal = simulate::goal_at_end(way);
  study.insertion.length = 200.0;
  study.insertion.element_length = 1.5;
  study.insertion.friction = 0.04;
  return study;
}

/// An aorta as `aorta()`, 190 mm long, whose one branch leaves at 100 mm: 15 degrees down a stiff
/// wire straightens the hook out of it.
inline constexpr double kHigh = 100.0, kOut = 50.0, kTop = 190.0;
inline const Vec3 kAside(std::cos(15.0 * kRadPerDeg), 0.0, -std::sin(15.0 * kRadPerDeg));
inline Surface oblique_surface(const Vec3& aside = kAside, double out = kOut) {
  return shapes::level_set(
      [&](const Vec3& p) {
        const Vec3 from(0.0, 0.0, kHigh);
        const double trunk = shapes::depth_in_tube(p, Vec3::Zero(), Vec3(0.0, 0.0, kTop), kAorta);
        const double branch = shapes::depth_in_tube(p, from, from + (out + 15.0) * aside, kRenal);
        return 0.5 * std::log(std::exp(2.0 * trunk) + std::exp(2.0 * branch));
      },
      Vec3(-10.0, -10.0, -1.5), Vec3(70.0, 10.0, kTop + 1.5), 1.1);
}

}  // namespace wireplan::plan
