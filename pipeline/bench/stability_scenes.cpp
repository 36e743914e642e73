#include "pipeline/bench/stability_scenes.h"

#include <algorithm>

#include "pipeline/files/text.h"

namespace wireplan::pipeline {

std::vector<StaticScene> static_scenes() {
  std::vector<StaticScene> scenes;
  const auto add = [&scenes](StaticScene scene, const std::string& group) {
    scene.group = group;
    scene.name = group + "-" + std::to_string(scenes.size());
    scenes.push_back(scene);
  };
  // The whole range of coefficients under gravity.
  for (const double bend : kBend) {
    for (const double stretch : kStretch) add({.bend = bend, .stretch = stretch}, "coefficients");
  }
  // Tip loads from next to nothing to absurd, across and along the wire.
  for (const double bend : {1e-2, 1e0, 1e2, 1e4, 1e7}) {
    for (const double stretch : {1e6, 1e8, 1e10, 1e12, 1e14}) {
      const StaticScene scene{.bend = bend, .stretch = stretch, .gravity = 0.0};
      StaticScene small = scene, across = scene, along = scene;
      small.load_across = 1e-6;
      across.load_across = 1e4;
      along.load_along = 1e3;
      along.load_across = 1.0;
      add(small, "tiny_load");
      add(across, "huge_load");
      add(along, "huge_push");
    }
  }
  // Element lengths and node numbers, with the paper's coefficients and with the stiffness of a
  // 0.035 inch wire (EI 620 N mm^2, EA 49600 N), whose coefficients leave the range at short
  // elements.
  for (const double h : {0.05, 0.2, 1.0, 5.0, 10.0}) {
    for (const int nodes : {3, 10, 100, 1000, 5000}) {
      add({.element_length = h, .nodes = nodes}, "size");
      add({.bend = 620.0 / (h * h * h) / kNPerMmFromNPerM,
           .stretch = 49600.0 / (2.0 * h * h * h) / kNPerMm3FromNPerM3,
           .element_length = h,
           .nodes = nodes},
          "device_size");
    }
  }
  // Stiffness that jumps along the wire.
  for (const double ratio : {1e0, 1e1, 1e2, 1e3, 1e4}) {
    for (const int soft : {0, 1, 2}) {
      for (const int nodes : {21, 201}) {
        add({.bend = 1e4, .stretch = 1e12, .ratio = ratio, .soft_part = soft, .nodes = nodes},
            "ratio");
      }
    }
  }
  // Squeezed between two clamps, past buckling.
  for (const double bend : {1e-2, 1e2, 1e7}) {
    for (const double stretch : {1e6, 1e10, 1e14}) {
      for (const double squeeze : {0.02, 0.3}) {
        add({.bend = bend, .stretch = stretch, .squeeze = squeeze}, "squeezed");
      }
    }
  }
  // All extremes at once.
  for (const int soft : {0, 1, 2}) {
    add({.bend = 1e7,
         .stretch = 1e14,
         .ratio = 1e4,
         .soft_part = soft,
         .element_length = 0.05,
         .nodes = 5000},
        "all_at_once");
  }
  return scenes;
}

std::vector<CoaxialScene> coaxial_scenes() {
  std::vector<CoaxialScene> scenes;
  for (const double ratio : {1e-3, 1e-1, 1.0, 1e1, 1e3}) {
    for (const double overlap : {0.1, 1.0, 10.0, 40.0}) {
      for (const double step : {0.2, 2.0, 10.0}) {
        scenes.push_back({.name = format("coaxial-%g-%g-%g", ratio, overlap, step),
                          .ratio = ratio,
                          .overlap = overlap,
                          .step = step,
                          .in_tube = scenes.size() % 2 == 1});
      }
    }
  }
  return scenes;
}

constexpr int kCoaxialPushes = 4;      // of each tool
constexpr double kCoaxialWire = 45.0;  // in at the start                                [mm]

int CoaxialScene::nodes() const {
  const double longest = std::max(kCoaxialWire + step, overlap + kCoaxialPushes * step);
  return 1 + simulate::elements_over(longest, 1.0);
}

simulate::ToolScene tool_scene_of(const CoaxialScene& given) {
  constexpr double kProduct = 100.0 * 100.0;  // of both EI                        [N^2 mm^4]
  const auto tool = [](const char* name, double radius, double inner, double EI, double curvature) {
    return simulate::Tool{.wire = {.name = name,
                                   .radius = radius,
                                   .sections = {{.length = 20.0,
                                                 .bending_stiffness = EI,
                                                 .rest_curvature = curvature},
                                                {.length = 280.0, .bending_stiffness = EI}}},
                          .inner_radius = inner};
  };
  const double wire_EI = std::sqrt(kProduct / given.ratio);
  simulate::ToolScene scene;
  scene.tools = {tool("catheter", 0.8335, 0.4955, given.ratio * wire_EI, 1.0 / 20.0),
                 tool("wire", 0.4445, 0.0, wire_EI, 1.0 / 12.0)};
  scene.places = {{given.overlap, 0.0}, {kCoaxialWire, 0.5 * kPi}};
  scene.point = Vec3(0.0, 0.0, 5.0);
  scene.direction = Vec3::UnitZ();
  scene.friction = 0.1;
  scene.contact.friction = 0.2;
  scene.residual_tolerance = 1e-6;
  for (int k = 0; k < kCoaxialPushes; ++k) {
    scene.moves.push_back(
        {.push = {0.0, k % 2 == 0 ? given.step : -given.step}, .turn = {0.0, 0.0}});
    scene.moves.push_back({.push = {given.step, 0.0}, .turn = {0.0, 0.0}});
  }
  scene.moves.push_back({.push = {0.0, 0.0}, .turn = {0.0, 2.0 * kPi}});
  scene.moves.push_back({.push = {0.0, 0.0}, .turn = {-2.0 * kPi, 0.0}});
  return scene;
}

}  // namespace wireplan::pipeline
