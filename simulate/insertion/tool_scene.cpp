#include "simulate/insertion/tool_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "simulate/insertion/push_balance.h"

namespace wireplan::simulate {
namespace {

/// Where work and energy of the moves differ, beyond what the tolerance and rounding leave open.
std::string tell_balance(const ToolScene& scene, const std::vector<ToolRecord>& history) {
  constexpr double kRounding = 1e-9;  // of forces, which are differences, per energy     [1/mm]
  double work = 0.0, unknown = 1e-6;  // [N mm]
  for (std::size_t k = 0; k + 1 < history.size(); ++k) {
    work += std::abs(history[k + 1].work - history[k].work);
    const double energy = std::abs(history[k + 1].energy.total());
    for (const double push : scene.moves[k].push) {
      unknown += (scene.residual_tolerance + kRounding * energy) * std::abs(push);
    }
  }
  const double unbalanced = std::abs(history.back().unbalanced);
  return describe_balance(std::max(0.0, unbalanced - unknown), work);
}

void add_to(std::string& reason, const std::string& text) {
  if (!text.empty()) reason += (reason.empty() ? "" : "; ") + text;
}

/// What the bench is like now, as one more of the result's records.
void add_record(const ToolBench& bench, ToolSceneResult& result) {
  result.history.push_back(bench.record());
  Shape& shape = result.shapes.emplace_back();
  shape.nodes = bench.state().x;
  shape.sections = bench.state().sections;
  for (const ToolPlace& place : bench.places()) shape.tools.push_back(place.insertion);
  shape.insertion = *std::max_element(shape.tools.begin(), shape.tools.end());
}

/// Why the tools did not come to where they were to go.
std::string why_not(const ToolBench& bench, const ToolScene& scene, const std::string& when) {
  char text[160];
  if (!bench.through_wall()) {
    std::snprintf(text, sizeof text,
                  "no equilibrium was found %s: residual %.3g N, asked for %.3g N", when.c_str(),
                  bench.record().residual, scene.residual_tolerance);
    return text;
  }
  const std::vector<preprocess::Opening>& openings = scene.vessel->lumen.openings();
  const auto opening = preprocess::left_through(openings, bench.at_rest(bench.state().x));
  if (!opening) return "a tool went through the wall " + when;
  return "a tool left the imaged vessel through its end at " +
         place_text(openings[static_cast<std::size_t>(*opening)].center) + " mm " + when;
}

}  // namespace

ToolSceneResult run_tool_scene(const ToolScene& scene) {
  ToolBench bench(scene);
  ToolSceneResult result;
  add_record(bench, result);
  bool good = bench.settled();
  std::string when = "at the start";
  for (std::size_t k = 0; k < scene.moves.size() && good; ++k) {
    good = bench.move(scene.moves[k]);
    when = "in moves[" + std::to_string(k) + "]";
    add_record(bench, result);
  }
  result.outcome = good ? SceneOutcome::kConverged : SceneOutcome::kNotConverged;
  if (!good) result.reason = why_not(bench, scene, when);
  std::vector<std::string> own = {"tools"};
  if (!scene.loads.gravity.isZero(0.0)) own.push_back("gravity");
  if (!scene.loads.tip_force.isZero(0.0)) own.push_back("tip_force");
  if (!scene.loads.tip_moment.isZero(0.0)) own.push_back("tip_moment");
  if (scene.plane) own.push_back("plane");
  double friction = 0.0;  // of the roughest tool
  for (const Tool& tool : scene.tools) {
    friction = std::max(friction, tool.wire.friction.value_or(scene.contact.friction));
  }
  result.terms = name_terms(bench.composite().rod, own, scene.vessel, friction);
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
