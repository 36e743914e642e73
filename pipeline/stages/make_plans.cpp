// The stages that simulate. Each asks for the whole plan as far as it is responsible for; what the
// stages before it simulated is found in the log.
#include <chrono>
#include <cmath>
#include <utility>

#include "pipeline/files/clock.h"
#include "pipeline/files/plan_file.h"
#include "pipeline/files/text.h"
#include "pipeline/files/trial_file.h"
#include "pipeline/stages/makers.h"
#include "pipeline/stages/plan_artifact.h"
#include "pipeline/stages/stored_trials.h"
#include "plan/catheters.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;
using plan::Level;
using Until = plan::PlanOptions::Until;

/// How well a boundary is known: drawn on voxels to half of one; of a surface, assumed [mm].
constexpr double kVoxelPart = 0.5, kSurfaceOffset = 0.25;

double choose_lumen_offset(const Workspace& work) {
  if (!work.has("volume") && work.given().labels) {
    return work.figures("segment").at("radius_error_mm").get<double>();
  }
  if (!work.has("volume")) return kSurfaceOffset;
  const Json spacing = work.figures("volume").at("spacing_mm");
  double product = 1.0;
  for (const Json& side : spacing) product *= side.get<double>();
  return kVoxelPart * std::cbrt(product);
}

/// What the scouts came to, in a line for who waits.
std::string first_answer_text(const plan::Study& study, const plan::FirstAnswer& answer,
                              const WallInput& wall) {
  std::string text = std::string("first answer, of coarse pushes against ") +
                     plan::wall_of_scouts(wall.support.has_value()) + ": " +
                     std::to_string(answer.reached) + " of " + std::to_string(answer.trials) +
                     " reach the target";
  if (!answer.best) return text + "; what may do so all the same is looked at next";
  const plan::Metrics& metrics = answer.trial.metrics;
  return text + ", first " + plan::describe(study, *answer.best) +
         format(" (%.2g N at the tip, %.2g N on the wall)", metrics.peak_tip_force,
                metrics.peak_contact_force) +
         "; not known yet: " + (wall.elastic ? "the wall as it yields, " : "") +
         "errors, disturbances";
}

std::string first_script_text(const plan::Study& study, const plan::Candidate& script,
                              double seconds) {
  return format("first script, after %.0f s of the search, of its coarse steps: ", seconds) +
         plan::describe(study, script) + ": " +
         plan::describe_script(study, script, study.insertion.length) +
         "; not known yet: whether it holds in full and under disturbances";
}

/// A stage tells what it finds first; the later ones find the same in the log.
plan::Early early_answers(Workspace& work, Until until) {
  const auto& told = work.options().told;
  if (!told) return {};
  const plan::Study& study = work.study();
  plan::Early early;
  if (until == Until::kTrials) {
    early.scouted = [&](const plan::FirstAnswer& answer) {
      told(first_answer_text(study, answer, work.given().wall));
    };
  }
  if (until == Until::kManoeuvres) {
    early.script = [&, start = std::chrono::steady_clock::now()](const plan::Candidate& script) {
      told(first_script_text(study, script, seconds_since(start)));
    };
  }
  return early;
}

plan::Plan plan_until(Workspace& work, Until until, StoredTrials& log) {
  return plan::make_plan(work.study(), plan_vessel(work), plan_options(work, until), log);
}

std::string small_sphere_warning(double radius, double lumen_radius) {
  return "target: radius_mm " + Json(clean(radius)).dump() +
         " is less than the lumen's radius there, " +
         Json(std::round(lumen_radius * 10.0) / 10.0).dump() +
         " mm: a wire that passes beside the sphere counts as missed; delete radius_mm to count "
         "every wire that passes the vessel's cross-section";
}

// What the report tells of the scouts; null where there are none.
Json scouting_json(const std::optional<plan::ScoutSummary>& scouting, bool moves) {
  if (!scouting) return nullptr;
  const plan::ScoutError& error = scouting->error;
  return {{"element_length_mm", scouting->element_length},
          {"step_mm", scouting->step},
          {"wall", "rigid"},
          {"moves_as_a_whole", moves},
          {"trials", scouting->trials},
          {"probed", scouting->probed},
          {"compared", error.compared},
          {"both_reached", error.both_reached},
          {"median_score_error", number_or_null(error.median_score)},
          {"largest_score_error", number_or_null(error.largest_score)},
          {"missed", error.missed},
          {"false_reached", error.false_reached}};
}

// The levels that the case has, lowest first.
std::vector<std::pair<Level, plan::Spent>> levels_of(const plan::Plan& plan, bool elastic) {
  std::vector<std::pair<Level, plan::Spent>> levels;
  if (plan.scouting) levels.push_back({Level::kScout, plan.scouts});
  if (plan.scouting && elastic) levels.push_back({Level::kProbe, plan.probes});
  levels.push_back({Level::kFull, plan.full});
  return levels;
}

}  // namespace

plan::PlanOptions plan_options(Workspace& work, Until until) {
  const Case& given = work.given();
  plan::PlanOptions options{.exhaustive = given.exhaustive,
                            .manoeuvres = given.manoeuvres,
                            .robustness = given.robustness,
                            .until = until,
                            .batch = {.threads = work.options().threads,
                                      .progress = work.options().progress,
                                      .cancelled = work.options().cancelled},
                            .early = early_answers(work, until)};
  double& lumen = options.robustness.unknowns.lumen;
  if (lumen == 0.0) lumen = choose_lumen_offset(work);
  return options;
}

plan::PlanVessel plan_vessel(Workspace& work) {
  return {.path = work.path(),
          .yields = work.given().wall.elastic,
          .model = [&]() -> const simulate::VesselModel& { return work.model(); },
          .rigid_model = [&]() -> const simulate::VesselModel& { return work.rigid_model(); },
          .moving_model = work.moving_model()};
}

void make_trials(Workspace& work, const fs::path& folder) {
  const plan::Study& study = work.study();
  StoredTrials log(work);
  work.begin_compliance();
  const plan::Plan plan = plan_until(work, Until::kTrials, log);
  Json levels = Json::array();
  plan::Spent all;
  for (const auto& [level, spent] : levels_of(plan, work.given().wall.elastic)) {
    log.place(level, 0, folder);
    levels.push_back({{"level", plan::level_name(level)},
                      {"trials_run", spent.runs},
                      {"cpu_s", spent.cpu_seconds}});
    all.runs += spent.runs;
    all.cpu_seconds += spent.cpu_seconds;
  }
  const simulate::VesselModel& vessel = work.model();

  Json figures = figures_of("trials");
  figures["trials"] = plan.candidates.size();
  figures["scout"] = scouting_json(plan.scouting, work.given().wall.support.has_value());
  figures["tangent"] = to_json(study.tangent);
  figures["insertion_length_mm"] = study.insertion.length;
  figures["lumen_grid_mm"] = vessel.lumen.grid_spacing();
  figures["lumen_max_deviation_mm"] = vessel.lumen.max_deviation();
  figures["lumen_mean_deviation_mm"] = vessel.lumen.mean_deviation();
  for (const std::string& told : warn_of_friction(work.given().devices, study.insertion)) {
    figures["warnings"].push_back("trials: " + told);
  }
  if (!work.given().wall.elastic) {
    figures["warnings"].push_back("trials: rigid wall: contact forces are upper bounds");
  }
  if (const std::optional<double>& support = work.given().wall.support) {
    figures["warnings"].push_back("trials: " + support_warning(*support));
  }
  const double lumen_radius = study.goal.way->section().radius;
  if (!study.goal.at_section && study.goal.radius < lumen_radius) {
    figures["warnings"].push_back(small_sphere_warning(study.goal.radius, lumen_radius));
  }
  write_figures(figures, folder);
  write_json({{"schema", kTimingSchema},
              {"trials_run", all.runs},
              {"cpu_s", all.cpu_seconds},
              {"levels", std::move(levels)}},
             folder / kTimingFile);
}

void make_manoeuvres(Workspace& work, const fs::path& folder) {
  StoredTrials log(work);
  const plan::Plan plan = plan_until(work, Until::kManoeuvres, log);
  const plan::Scripts& scripts = plan.scripts;
  const std::size_t straight = plan.candidates.size() - scripts.found.size();
  log.place(Level::kFull, static_cast<int>(straight), folder);

  Json figures = figures_of("manoeuvres");
  figures["starts"] = scripts.starts_tried;
  figures["branches"] = scripts.branches;
  figures["searches"] = searches_json(scripts);
  figures["scripts"] = scripts_json(scripts);
  if (work.given().suggest_catheters && work.study().catheters.empty()) {
    figures["warnings"].push_back(
        "manoeuvres: no catheter of the catalogue is suggested: the way takes no branch from a "
        "wider vessel, or one that none goes into; name catheters, or leave out the key");
  }
  if (!work.given().catheters.empty()) {
    figures["pairs"] = pairs_json(scripts);
  }
  write_figures(figures, folder);
}

void make_plans(Workspace& work, const fs::path& folder) {
  StoredTrials log(work);
  const plan::Plan plan = plan_until(work, Until::kEnd, log);
  for (const int id : plan.attempts) log.place_attempt(id, folder);
  Json figures = figures_of("plans");
  const double known = plan_options(work, Until::kEnd).robustness.unknowns.lumen,
               drawn = plan.robustness.unknowns.lumen;
  if (!plan.repeated.empty() && known > drawn) {
    figures["warnings"].push_back(
        "plans: the wall may be off by " + format("%.2g", known) +
        " mm, but the repeats move it by at most " + format("%.2g", drawn) +
        " mm (0.8 of the thinnest wire's radius), so fewer of them may fail than really would");
  }
  write_figures(figures, folder);
  write_plan(plan, folder);
}

plan::Plan known_before_plans(Workspace& work) {
  StoredTrials log(work);
  plan::Plan plan = plan_until(work, Until::kManoeuvres, log);
  plan.robustness.repeats = 0;
  return plan;
}

ShareOutcome run_share(Workspace& work, const Share& share) {
  expects(share.shard >= 1 && share.shard <= share.shards && share.round >= 1);
  StoredTrials log(work);
  plan::PlanVessel vessel = plan_vessel(work);
  if (share.shards > 1) {  // one of the processes makes the field, where there is a trial to run
    for (auto* model : {&vessel.model, &vessel.rigid_model, &vessel.moving_model}) {
      if (!*model) continue;
      *model = [&work, make = *model]() -> const simulate::VesselModel& {
        work.share_field();
        return make();
      };
    }
  }
  const std::vector<plan::Candidate> candidates = plan::list_candidates(work.study());
  plan::Rounds rounds(work.study(), vessel, candidates, work.given().exhaustive);
  std::vector<plan::Run> runs = rounds.next();
  for (int round = 1; round < share.round && !runs.empty(); ++round) {
    std::vector<plan::Measured> found;
    for (const plan::Run& run : runs) {
      if (std::optional<plan::Measured> known = log.find(run)) found.push_back(std::move(*known));
    }
    if (found.size() < runs.size()) {
      throw Error("round " + std::to_string(share.round) + " follows from all " +
                  std::to_string(runs.size()) + " trials of round " + std::to_string(round) +
                  ", of which " + std::to_string(runs.size() - found.size()) +
                  " are not in the store; run its other shards first, or \"wireplan report\", "
                  "which runs what is missing");
    }
    rounds.take(std::move(found));
    runs = rounds.next();
  }

  // Every N-th, so that the costly ones, which are neighbours, are shared out.
  std::vector<plan::Run> own;
  const auto shards = static_cast<std::size_t>(share.shards);
  for (auto k = static_cast<std::size_t>(share.shard - 1); k < runs.size(); k += shards) {
    own.push_back(runs[k]);
  }
  plan::Spent spent;
  plan::find_or_run(work.study(), vessel, own, log, plan_options(work, Until::kTrials).batch,
                    spent);
  return {.level = rounds.level(),
          .round_trials = static_cast<int>(runs.size()),
          .own_trials = static_cast<int>(own.size()),
          .run = spent.runs};
}

}  // namespace wireplan::pipeline
