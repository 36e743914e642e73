#pragma once
/// Vessels in which catheters take their curves, and what is done in them. The surfaces of the
/// cases cobra-renal and simmons-ostium are these.
#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "tests/shapes.h"
#include "tests/simulate/tool_bench.h"

namespace wireplan::simulate {

/// Tubes joined with rounded edges [mm].
inline double joined_depth(std::initializer_list<double> depths) {
  constexpr double kRound = 0.8;
  double sum = 0.0;
  for (const double depth : depths) sum += std::exp(depth / kRound);
  return kRound * std::log(sum);
}

/// Aorta of 14 mm along z, with a branch of 6 mm toward anterior at 100 mm.
inline Surface aorta_with_a_branch() {
  return shapes::level_set(
      [](const Vec3& p) {
        const Vec3 start(0.0, 0.0, 100.0), end(0.0, -50.0, 100.0);
        return joined_depth({shapes::depth_in_tube(p, Vec3::Zero(), Vec3(0.0, 0.0, 170.0), 7.0),
                             shapes::depth_in_tube(p, start, end, 3.0)});
      },
      Vec3(-10.0, -51.0, -2.0), Vec3(10.0, 10.0, 172.0), 2.6);
}

/// Aortic arch of 22 mm and of 32 mm radius in the plane y = 0, its top at z = 43 mm; the
/// descending part lies at x = 32 mm. From there a branch of 10 mm leaves at z = -50 mm, down and
/// to the middle.
inline Surface arch_with_a_branch() {
  const double R = 32.0, radius = 11.0, low = -150.0;
  return shapes::level_set(
      [&](const Vec3& p) {
        const double arch =
            p.z() < 0.0 ? -100.0 : radius - std::hypot(std::hypot(p.x(), p.z()) - R, p.y());
        const double down = 40.0 * kPi / 180.0;
        const Vec3 start(R, 0.0, -50.0), out(-std::cos(down), 0.0, -std::sin(down));
        return joined_depth(
            {arch, shapes::depth_in_tube(p, Vec3(R, 0.0, low), Vec3(R, 0.0, 1.0), radius),
             shapes::depth_in_tube(p, Vec3(-R, 0.0, -50.0), Vec3(-R, 0.0, 1.0), radius),
             shapes::depth_in_tube(p, start, start + 70.0 * out, 5.0)});
      },
      Vec3(-46.0, -14.0, -153.1), Vec3(46.0, 14.0, 46.0), 4.5);
}

/// A 5 F catheter with the given tip, and in it a wire of 0.889 mm with a floppy, straight one.
inline ToolScene catheter_over_wire(std::vector<Section> tip, const VesselModel& vessel) {
  tip.push_back({.length = 580.0, .bending_stiffness = 332.0});
  const Wire catheter{.name = "catheter", .radius = 0.8335, .sections = std::move(tip)};
  const Wire wire{
      .name = "wire",
      .radius = 0.4445,
      .sections = {{.length = 30.0, .bending_stiffness = 5.0},
                   {.length = 20.0, .bending_stiffness = 5.0, .proximal_bending_stiffness = 377.0},
                   {.length = 1400.0, .bending_stiffness = 377.0}}};
  ToolScene scene = tools_along_x({{catheter, 0.4955}, {wire, 0.0}}, {{10.0, 0.0}, {30.0, 0.0}});
  scene.direction = Vec3::UnitZ();
  scene.vessel = &vessel;
  scene.contact.friction = 0.1;
  scene.residual_tolerance = 1e-6;
  return scene;
}

/// A Cobra C2 of the catalogue.
inline std::vector<Section> cobra_tip() {
  return {{.length = 8.0, .bending_stiffness = 99.0},
          {.length = 15.7, .bending_stiffness = 99.0, .rest_curvature = 0.1},
          {.length = 15.0, .bending_stiffness = 332.0},
          {.length = 31.4, .bending_stiffness = 332.0, .rest_curvature = -1.0 / 30.0}};
}

/// A Simmons 1 of the catalogue.
inline std::vector<Section> simmons_tip() {
  return {{.length = 8.0, .bending_stiffness = 99.0},
          {.length = 8.4, .bending_stiffness = 99.0, .rest_curvature = 1.0 / 8.0},
          {.length = 25.0, .bending_stiffness = 332.0},
          {.length = 35.6, .bending_stiffness = 332.0, .rest_curvature = 1.0 / 12.0}};
}

}  // namespace wireplan::simulate
