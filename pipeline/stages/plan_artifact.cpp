#include "pipeline/stages/plan_artifact.h"

#include <utility>

#include "pipeline/files/plan_file.h"
#include "pipeline/files/trial_file.h"

namespace wireplan::pipeline {
namespace {

constexpr const char* kSchema = "wireplan.plan/1";

std::filesystem::path plan_file(const std::filesystem::path& folder) {
  return folder / kKeptFolder / "plan.json";
}

}  // namespace

void write_plan(const plan::Plan& plan, const std::filesystem::path& folder) {
  Json file = {{"schema", kSchema}};
  file.update(plan_to_json(plan));
  std::filesystem::create_directories(folder / kKeptFolder);
  write_json(file, plan_file(folder));

  Json numerics = Json::array();
  for (const plan::Refinement& refinement : plan.refinements) {
    for (std::size_t k = 0; k < refinement.rows.size(); ++k) {
      numerics.push_back({{"trial", refinement.trial},
                          {"element_length_mm", refinement.rows[k].element_length},
                          {"cpu_s", refinement.cpu_seconds[k]}});
    }
  }
  write_json({{"schema", kTimingSchema},
              {"numerics", std::move(numerics)},
              {"repeats", {{"cpu_s", plan.repeats.cpu_seconds}}}},
             folder / kTimingFile);
}

Json scripts_json(const plan::Scripts& scripts) {
  Json list = Json::array();
  for (std::size_t k = 0; k < scripts.found.size(); ++k) {
    const plan::Candidate& found = scripts.found[k];
    if (found.catheter < 0) {
      list.push_back({{"start", scripts.starts[k]}, {"moves", moves_json(found.moves)}});
    } else {
      list.push_back(
          {{"wire", found.wire}, {"catheter", found.catheter}, {"steps", steps_json(found.steps)}});
      if (found.first_wire >= 0) list.back()["first_wire"] = found.first_wire;
    }
  }
  return list;
}

Json searches_json(const plan::Scripts& scripts) {
  Json list = Json::array();
  for (const plan::MoveSearch& search : scripts.searches) {
    list.push_back({{"level", plan::level_name(search.level)},
                    {"branches", search.effort.branches},
                    {"iterations", search.effort.iterations},
                    {"most_iterations", search.effort.most_iterations},
                    {"no_further", search.effort.no_further},
                    {"cut_off", search.effort.cut_off}});
  }
  return list;
}

Json pairs_json(const plan::Scripts& scripts) {
  Json list = Json::array();
  for (const plan::PairFindings& pair : scripts.pairs) {
    list.push_back({{"wire", pair.pair.wire},
                    {"catheter", pair.pair.catheter},
                    {"unfit", pair.pair.unfit},
                    {"found", pair.found},
                    {"held", pair.held},
                    {"nearest_hook_mm", clean(pair.nearest_hook)},
                    {"furthest_mm", clean(pair.furthest)},
                    {"stopped", pair.stopped},
                    {"exchange",
                     {{"first_wire", pair.exchange.first_wire},
                      {"found", pair.exchange.found},
                      {"held", pair.exchange.held},
                      {"stopped", pair.exchange.stopped}}}});
  }
  return list;
}

plan::Scripts read_scripts(const Json& figures, const plan::Study& study) {
  const std::vector<plan::Candidate> straight = plan::list_candidates(study);
  plan::Scripts scripts{.starts_tried = figures.at("starts"), .branches = figures.at("branches")};
  for (const Json& search : figures.at("searches")) {
    const bool full = search.at("level") == plan::level_name(plan::Level::kFull);
    scripts.searches.push_back({.level = full ? plan::Level::kFull : plan::Level::kScout,
                                .effort = {.branches = search.at("branches"),
                                           .iterations = search.at("iterations"),
                                           .most_iterations = search.at("most_iterations"),
                                           .no_further = search.at("no_further"),
                                           .cut_off = search.at("cut_off")}});
  }
  for (const Json& script : figures.at("scripts")) {
    scripts.starts.push_back(script.value("start", -1));
    if (scripts.starts.back() >= 0) {
      scripts.found.push_back(straight.at(static_cast<std::size_t>(scripts.starts.back())));
      scripts.found.back().moves = moves_of(script.at("moves"));
      continue;
    }
    scripts.found.push_back(plan::first_candidate(
        study, {.catheter = script.at("catheter"), .wire = script.at("wire"), .unfit = {}}));
    scripts.found.back().steps = steps_of(script.at("steps"));
    scripts.found.back().first_wire = script.value("first_wire", -1);
  }
  if (!figures.contains("pairs")) return scripts;
  for (const Json& pair : figures.at("pairs")) {
    const Json& exchange = pair.at("exchange");
    scripts.pairs.push_back({.pair = {.catheter = pair.at("catheter"),
                                      .wire = pair.at("wire"),
                                      .unfit = pair.at("unfit")},
                             .found = pair.at("found"),
                             .held = pair.at("held"),
                             .nearest_hook = pair.at("nearest_hook_mm"),
                             .furthest = pair.at("furthest_mm"),
                             .stopped = pair.at("stopped"),
                             .exchange = {.first_wire = exchange.at("first_wire"),
                                          .found = exchange.at("found"),
                                          .held = exchange.at("held"),
                                          .stopped = exchange.at("stopped")}});
  }
  return scripts;
}

plan::Plan read_plan(Workspace& work) {
  plan::Plan plan;
  plan.candidates = plan::list_candidates(work.study());
  plan.scripts = read_scripts(work.figures("manoeuvres"), work.study());
  plan.candidates.insert(plan.candidates.end(), plan.scripts.found.begin(),
                         plan.scripts.found.end());
  plan_from_json(read_json(plan_file(work.artifact("plans").folder), kSchema), work.study(), plan);
  expects(plan.trials.size() == plan.candidates.size());
  return plan;
}

}  // namespace wireplan::pipeline
