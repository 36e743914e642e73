#include "simulate/insertion/tool_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "simulate/insertion/push_balance.h"

namespace wireplan::simulate {
namespace {

/// Where work and energy of the moves differ, beyond what the tolerance and rounding leave open.
std::string tell_balance(const ToolScene& scene, const std::vector<ToolRecord>& history) {
  double work = 0.0, unknown = 1e-6;  // [N mm]
  for (std::size_t k = 0; k + 1 < history.size(); ++k) {
    work += std::abs(history[k + 1].work - history[k].work);
    for (const double push : scene.moves[k].push) {
      unknown += scene.residual_tolerance * std::abs(push);
    }
  }
  const double unbalanced = std::abs(history.back().unbalanced);
  return describe_balance(std::max(0.0, unbalanced - unknown), work);
}

void add_to(std::string& reason, const std::string& text) {
  if (!text.empty()) reason += (reason.empty() ? "" : "; ") + text;
}

}  // namespace

ToolSceneResult run_tool_scene(const ToolScene& scene) {
  ToolBench bench(scene);
  ToolSceneResult result;
  result.history.push_back(bench.record());
  bool good = bench.settled();
  std::string when = "at the start";
  for (std::size_t k = 0; k < scene.moves.size() && good; ++k) {
    good = bench.move(scene.moves[k]);
    when = "in moves[" + std::to_string(k) + "]";
    result.history.push_back(bench.record());
  }
  result.outcome = good ? SceneOutcome::kConverged : SceneOutcome::kNotConverged;
  if (!good) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "no equilibrium was found %s: residual %.3g N, asked for %.3g N", when.c_str(),
                  bench.record().residual, scene.residual_tolerance);
    result.reason = text;
    if (bench.through_wall()) result.reason = "a tool went through the wall " + when;
  }
  std::vector<std::string> own = {"tools"};
  if (!scene.loads.gravity.isZero(0.0)) own.push_back("gravity");
  if (!scene.loads.tip_force.isZero(0.0)) own.push_back("tip_force");
  if (!scene.loads.tip_moment.isZero(0.0)) own.push_back("tip_moment");
  if (scene.plane) own.push_back("plane");
  result.terms = name_terms(bench.composite().rod, own, scene.vessel, scene.contact.friction);
  result.nodes = bench.state().x;
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    result.tool_nodes.push_back(bench.nodes_of(static_cast<int>(i)));
    result.angles.push_back(bench.angles(static_cast<int>(i)));
  }
  result.introducer_force = bench.introducer_force();
  if (scene.distal) result.distal_force = bench.distal_force();
  result.contacts = bench.touches();
  for (std::size_t i = 0; i < scene.tools.size() && good && !result.crossing; ++i) {
    const double radius = scene.tools[i].wire.radius;
    result.crossing = CrossingFinder().find(result.tool_nodes[i], radius);
    if (!result.crossing) continue;
    add_to(result.reason,
           scene.tools[i].wire.name + ": " + describe_crossing(*result.crossing, radius));
  }
  add_to(result.reason, tell_balance(scene, result.history));
  return result;
}

}  // namespace wireplan::simulate
