#include "pipeline/bench/coaxial_manoeuvres.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/bench/bench_report.h"
#include "pipeline/bench/bench_walls.h"
#include "pipeline/files/text.h"
#include "preprocess/cores.h"
#include "preprocess/wall/wall.h"
#include "simulate/insertion/tool_bench.h"

namespace wireplan::pipeline {
namespace {

constexpr double kScoutElements = 4.0, kFullElements = 1.0;  // [mm]

/// A Cobra C2 over a shaft of 377 N mm^2 with a floppy tip, friction 0.1 and 0.05 in each other.
simulate::ToolScene coaxial_scene(const simulate::VesselModel& vessel, double length,
                                  double element_length) {
  simulate::ToolScene scene;
  scene.tools = {
      {.wire =
           {.name = "cobra",
            .radius = 0.8335,
            .sections = {{.length = 8.0, .bending_stiffness = 99.0},
                         {.length = 15.7, .bending_stiffness = 99.0, .rest_curvature = 0.1},
                         {.length = 15.0, .bending_stiffness = 332.0},
                         {.length = 31.4, .bending_stiffness = 332.0, .rest_curvature = -0.0333},
                         {.length = 930.0, .bending_stiffness = 332.0}}},
       .inner_radius = 0.4955},
      {.wire = {.name = "wire",
                .radius = 0.4445,
                .sections = {
                    {.length = 30.0, .bending_stiffness = 5.0},
                    {.length = 20.0, .bending_stiffness = 5.0, .proximal_bending_stiffness = 377.0},
                    {.length = 1400.0, .bending_stiffness = 377.0}}}}};
  scene.places = {{10.0, 0.0}, {30.0, 0.0}};
  scene.point = Vec3(0.0, 0.0, 5.0);
  scene.direction = Vec3::UnitZ();
  scene.vessel = &vessel;
  scene.friction = 0.05;
  scene.contact.friction = 0.1;
  scene.element_length = element_length;
  scene.residual_tolerance = 1e-6;
  scene.moves = {{.push = {0.0, length}, .turn = {0.0, 0.0}},
                 {.push = {length, 0.0}, .turn = {0.0, 0.0}}};
  return scene;
}

Json time_manoeuvre(const simulate::ToolScene& scene, const char* wall) {
  const double start = thread_cpu_seconds();
  simulate::ToolBench bench(scene);
  bool good = bench.settled();
  int iterations = 0;
  double residual = 0.0;
  for (const simulate::ToolMove& move : scene.moves) {
    good = good && bench.move(move);
    iterations += bench.record().iterations;
    residual = std::max(residual, bench.record().residual);
  }
  const double seconds = thread_cpu_seconds() - start;
  const simulate::ToolRecord& record = bench.record();
  Json row;
  row["wall"] = wall;
  row["element_length_mm"] = scene.element_length;
  row["pushed_mm"] = scene.moves[0].push[1];
  row["outcome"] = good ? "converged" : "not_converged";
  row["manoeuvres_per_second_per_core"] = clean(1.0 / std::max(seconds, 1e-9));
  row["iterations"] = iterations;
  row["residual_n"] = clean(residual);
  row["heat_n_mm"] = clean(record.heat);
  row["unbalanced_n_mm"] = clean(record.unbalanced);
  row["tip_x_mm"] = clean(record.tools[0].tip.x());
  row["tip_y_mm"] = clean(record.tools[0].tip.y());
  row["tip_z_mm"] = clean(record.tools[0].tip.z());
  return row;
}

}  // namespace

std::vector<Json> time_coaxial_manoeuvres(double length,
                                          const std::function<void(const Json&)>& tell) {
  Vessel tube = make_long_s_tube();
  tube.wall = preprocess::extrude_wall(tube.surface, {}).wall;
  std::vector<Json> rows;
  for (const char* wall : {"rigid", "elastic"}) {
    const bool rigid = std::string(wall) == "rigid";
    const simulate::LumenOptions options = simulate::follow(tube.surface);
    const simulate::VesselModel vessel =
        rigid ? simulate::VesselModel(tube.surface, options)
              : simulate::VesselModel(tube.surface, tube.wall, options);
    for (const double element_length : {kScoutElements, kFullElements}) {
      rows.push_back(time_manoeuvre(coaxial_scene(vessel, length, element_length), wall));
      tell(rows.back());
    }
  }
  return rows;
}

std::vector<Json> list_coaxial_aims(const std::vector<Json>& rows) {
  std::vector<Json> aims;
  const auto add = [&](const char* what, const char* aim, const char* wall, double elements) {
    const auto row = std::find_if(rows.begin(), rows.end(), [&](const Json& each) {
      return each.at("wall") == wall && each.at("element_length_mm") == elements;
    });
    aims.push_back(aim_row(
        what, aim, row == rows.end() ? Json(nullptr) : row->at("manoeuvres_per_second_per_core")));
  };
  add("catheter over wire, 600 + 600 mm, scouts' elements, 1/s/core", "at least 5", "rigid",
      kScoutElements);
  add("catheter over wire, 600 + 600 mm, in full on a yielding wall, 1/s/core", "at least 1",
      "elastic", kFullElements);
  return aims;
}

}  // namespace wireplan::pipeline
