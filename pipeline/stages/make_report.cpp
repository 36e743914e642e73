// The report: what the stages before it found, judged and printed. Nothing is simulated here.
#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <thread>
#include <utility>

#include "pipeline/files/trial_file.h"
#include "pipeline/files/viewer_files.h"
#include "pipeline/report/page.h"
#include "pipeline/report/picture.h"
#include "pipeline/report/places.h"
#include "pipeline/report/repeats_json.h"
#include "pipeline/report/report.h"
#include "pipeline/stages/makers.h"
#include "pipeline/stages/plan_artifact.h"
#include "pipeline/stages/stored_trials.h"
#include "preprocess/files/vessel_io.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// Stages that the report tells of; `plans` makes nothing that a user opens.
constexpr std::array kToldStages = {"volume", "segment", "surface",   "centerline",
                                    "wall",   "trials",  "manoeuvres"};

// Largest force on each triangle, over trials.
class ForceMap {
 public:
  explicit ForceMap(Eigen::Index triangles) : force_(static_cast<std::size_t>(triangles), 0.0) {}
  void add(const std::vector<simulate::TriangleForce>& peaks) {
    for (const simulate::TriangleForce& peak : peaks) {
      double& force = force_.at(static_cast<std::size_t>(peak.triangle));
      force = std::max(force, peak.force);
    }
  }
  const std::vector<double>& values() const { return force_; }

 private:
  std::vector<double> force_;  // [N]
};

// All of the report that the stages before it tell.
ReportInput describe_run(Workspace& work) {
  const Case& given = work.given();
  ReportInput report;
  report.name = given.name;
  report.input_name = work.input.filename().string();
  report.input_sha256 = work.input_sha256;
  report.study = work.study();
  report.plan = read_plan(work);
  report.judgement = plan::judge(report.study, report.plan, given.limits, given.weights);
  report.robustness = repeats_json(report.plan, report.judgement.repeated);
  for (const char* stage : kToldStages) {
    if (!work.has(stage)) continue;
    report.stages.push_back(stage);
    report.figures[stage] = work.figures(stage);
  }

  // The values that stages chose where the case left them open.
  report.parameters = work.parameters;
  report.parameters["insertion"]["length_mm"] = report.study.insertion.length;
  if (work.has("segment")) {
    const Json& band = report.figures.at("segment").at("band");
    for (const char* key : {"lower_hu", "upper_hu", "smoothing_mm", "neck_opening_mm"}) {
      report.parameters["segmentation"][key] = band.at(key);
    }
  }
  report.parameters["wall"]["young_modulus_kpa"] =
      report.figures.at("wall").at("young_modulus_kpa");
  return report;
}

// Runs are chosen by the default limits and weights (plan/rounds.h): where the case's put another
// plan first, less may be known of it.
void warn_of_other_first(const Case& given, ReportInput& report) {
  const plan::Ranking& ranking = report.judgement.ranking;
  if (ranking.plans.empty()) return;
  const int first = ranking.plans.front().trial;
  const bool refined = std::any_of(report.plan.refinements.begin(), report.plan.refinements.end(),
                                   [&](const auto& other) { return other.trial == first; });
  const bool repeated = given.robustness.repeats == 0 ||
                        plan::find_repeated(report.judgement.repeated, first) != nullptr;
  if (refined && repeated) return;
  report.warnings.push_back(
      "ranking: limits and weights of the case put trial " + std::to_string(first) +
      " first, of which the " + (refined ? "" : "numerical error") +
      (refined || repeated ? "" : " and the ") + (repeated ? "" : "behaviour under disturbances") +
      " was not simulated: what is simulated follows from the default limits and weights");
}

Json timing_json(const Workspace& work) {
  const int threads = work.options().threads;
  const Json plans = read_json(work.artifact("plans").folder / kTimingFile, kTimingSchema);
  Json timing;
  timing["threads"] = threads > 0 ? threads : static_cast<int>(std::thread::hardware_concurrency());
  timing["stages"] = Json::array();
  const auto add_stage = [&](const char* stage) {
    if (!work.has(stage)) return;
    timing["stages"].push_back({{"stage", stage}, {"seconds", work.artifact(stage).seconds}});
  };
  for (const char* stage : kToldStages) add_stage(stage);
  add_stage("plans");
  timing["trials"] = read_json(work.artifact("trials").folder / kTimingFile, kTimingSchema);
  timing["numerics"] = plans.at("numerics");
  timing["repeats"] = plans.at("repeats");
  return timing;
}

/// The best plan of each wire in the vessel, or its closest attempt where it has none.
Picture draw_overview(Workspace& work, const ReportInput& report, const PageInput& page) {
  std::vector<PictureWire> wires;
  for (const int id :
       plan::best_of_each_wire(report.study, report.plan, report.judgement.ranking)) {
    const auto w =
        static_cast<std::size_t>(report.plan.candidates[static_cast<std::size_t>(id)].wire);
    const bool best = report.judgement.ranking.wires[w].best_trial == id;
    const PageTrial& trial = page.trials[static_cast<std::size_t>(id)];
    if (trial.nodes.cols() < 2) continue;
    const simulate::Outcome outcome = report.plan.trials[static_cast<std::size_t>(id)].outcome;
    wires.push_back(
        {.name = report.study.wires[w].name + ": " +
                 (best ? "best plan" : "no plan, " + std::string(outcome_name(outcome))),
         .nodes = trial.nodes.cast<double>(),
         .contact_force = {},
         .radius = report.study.wires[w].radius,
         .color = wire_color(static_cast<int>(wires.size()))});
  }
  return draw_picture(work.surface(), wires,
                      {.title = report.name,
                       .access = report.study.access,
                       .target = report.study.goal.point,
                       .target_radius = report.study.goal.radius});
}

/// What the page shows of the vessel and of where to; trials and insertions are added by the
/// caller.
PageInput start_page(Workspace& work) {
  const plan::Study& study = work.study();
  PageInput page;
  page.surface = work.surface();
  page.path = work.path();
  page.access = study.access;
  page.target = study.goal.point;
  page.target_radius = study.goal.radius;
  for (const simulate::Wire& wire : study.wires) page.wire_radius.push_back(wire.radius);
  return page;
}

/// Only the page has slices, and only a volume can be cut.
bool has_slices(const Workspace& work) { return work.given().volume && page_missing().empty(); }

/// Calls all, as many at once as there are threads.
void do_at_once(const Workspace& work, const std::vector<std::function<void()>>& jobs) {
  plan::for_each_slot(static_cast<int>(jobs.size()),
                      [&](int k) { jobs[static_cast<std::size_t>(k)](); },
                      {.threads = work.options().threads, .cancelled = work.options().cancelled});
  if (work.options().cancelled && work.options().cancelled()) throw Interrupted();
}

/// Reads what the page shows of every trial, and the volume. Returns the largest forces of those in
/// full.
std::vector<std::vector<simulate::TriangleForce>> read_inputs(Workspace& work,
                                                              const ReportInput& report,
                                                              PageInput& page) {
  const std::size_t count = report.plan.candidates.size();
  page.trials.resize(count);
  std::vector<std::vector<simulate::TriangleForce>> peaks(count);
  std::vector<std::function<void()>> jobs;
  if (has_slices(work)) jobs.push_back([&] { work.image(); });
  for (std::size_t k = 0; k < count; ++k) {
    jobs.push_back([&, k] {
      const plan::Level level = report.plan.levels[k];
      simulate::TrialResult trial = read_trial(work, level, static_cast<int>(k));
      page.trials[k] = page_trial(
          trial, plan::make_introducer(report.study, report.plan.candidates[k]).direction);
      if (level == plan::Level::kFull) peaks[k] = std::move(trial.peak_forces);
    });
  }
  do_at_once(work, jobs);
  return peaks;
}

/// The insertions that can be played, those of the first plans for viewers too.
void add_insertions(const Workspace& work, const ReportInput& report, PageInput& page,
                    const fs::path& folder) {
  const plan::Ranking& ranking = report.judgement.ranking;
  const std::size_t shown = std::min(kPlansShown, ranking.plans.size());
  const std::vector<int> played = plan::choose_played(report.study, report.plan, ranking);
  for (std::size_t k = 0; k < played.size(); ++k) {
    std::optional<simulate::TrialResult> trial = find_played(work, played[k]);
    if (!trial) continue;
    if (k < shown) write_shapes(*trial, "plan-" + std::to_string(k + 1), folder / "trials");
    page.insertions.push_back({played[k], std::move(trial->shapes), std::move(trial->peak_forces)});
  }
}

/// Every ranked plan for 3D Slicer.
void write_ranked_markups(const ReportInput& report, const PageInput& page,
                          const fs::path& folder) {
  fs::create_directories(folder);
  for (std::size_t k = 0; k < report.judgement.ranking.plans.size(); ++k) {
    const auto id = static_cast<std::size_t>(report.judgement.ranking.plans[k].trial);
    const std::string name = "plan-" + std::to_string(k + 1);
    write_plan_markups({.name = name,
                        .nodes = page.trials[id].nodes.cast<double>(),
                        .access = page.access,
                        .direction = page.trials[id].direction,
                        .target = page.target},
                       folder / (name + ".mrk.json"));
  }
}

void write_forces(Workspace& work, const ReportInput& report, const ForceMap& all,
                  const ForceMap& best, const fs::path& folder) {
  std::vector<preprocess::NamedArray> forces = {{"peak_force_n", all.values()}};
  if (!report.judgement.ranking.plans.empty()) {
    forces.push_back({"peak_force_best_plan_n", best.values()});
  }
  preprocess::write_wall(work.surface(), work.wall(), folder / "forces.vtu", forces);
}

}  // namespace

void make_report(Workspace& work, const fs::path& folder) {
  const auto start = std::chrono::steady_clock::now();
  ReportInput report = describe_run(work);
  warn_of_other_first(work.given(), report);
  PageInput page = start_page(work);
  const auto peaks = read_inputs(work, report, page);
  ForceMap all_forces(page.surface.triangles.cols()), best_forces = all_forces;
  for (const auto& trial : peaks) all_forces.add(trial);
  const std::vector<plan::RankedPlan>& plans = report.judgement.ranking.plans;
  if (!plans.empty()) best_forces.add(peaks[static_cast<std::size_t>(plans.front().trial)]);
  const ForceMap& forces = plans.empty() ? all_forces : best_forces;  // where the volume is cut
  page.peak_force = all_forces.values();

  std::vector<std::function<void()>> jobs = {
      [&] {
        page.picture_png = encode_png(draw_overview(work, report, page));
        write_whole(page.picture_png, folder / "plans.png");
      },
      [&] { add_insertions(work, report, page, folder); },
      [&] { write_forces(work, report, all_forces, best_forces, folder); },
      [&] { write_ranked_markups(report, page, folder / "trials"); }};
  if (has_slices(work)) {
    jobs.insert(jobs.begin(), [&, segment = work.figures("segment")] {
      page.panels["slices"] = slices_json(
          cut_vessel_slices(work.image(), {page.surface, page.path, page.access, page.target},
                            segment, forces.values()));
    });
  }
  do_at_once(work, jobs);
  work.drop_image();

  report.timing = timing_json(work);
  report.timing["report_s"] =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Json result = build_report(report);
  if (page_missing().empty()) write_whole(build_page(result, page), folder / "report.html");
  write_whole(trials_csv(result), folder / "trials.csv");
  write_json(result, folder / "report.json");
}

}  // namespace wireplan::pipeline
