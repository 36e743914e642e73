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

plan::Scripts read_scripts(const Json& figures, const std::vector<plan::Candidate>& straight) {
  plan::Scripts scripts{.starts_tried = figures.at("starts"), .branches = figures.at("branches")};
  for (const Json& script : figures.at("scripts")) {
    scripts.starts.push_back(script.at("start"));
    scripts.found.push_back(straight.at(static_cast<std::size_t>(scripts.starts.back())));
    scripts.found.back().moves = moves_of(script.at("moves"));
  }
  return scripts;
}

plan::Plan read_plan(Workspace& work) {
  plan::Plan plan;
  plan.candidates = plan::list_candidates(work.study());
  plan.scripts = read_scripts(work.figures("manoeuvres"), plan.candidates);
  plan.candidates.insert(plan.candidates.end(), plan.scripts.found.begin(),
                         plan.scripts.found.end());
  plan_from_json(read_json(plan_file(work.artifact("plans").folder), kSchema), work.study(), plan);
  expects(plan.trials.size() == plan.candidates.size());
  return plan;
}

}  // namespace wireplan::pipeline
