// The report: what the stages before it found, judged and printed. Nothing is simulated here.
#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>

#include "pipeline/files/catalogue.h"
#include "pipeline/files/clock.h"
#include "pipeline/files/text.h"
#include "pipeline/files/trial_file.h"
#include "pipeline/files/viewer_files.h"
#include "pipeline/report/anatomy_json.h"
#include "pipeline/report/motion_json.h"
#include "pipeline/report/page.h"
#include "pipeline/report/picture.h"
#include "pipeline/report/places.h"
#include "pipeline/report/repeats_json.h"
#include "pipeline/report/report.h"
#include "pipeline/report/sheet_csv.h"
#include "pipeline/report/verdict_json.h"
#include "pipeline/stages/makers.h"
#include "pipeline/stages/plan_artifact.h"
#include "pipeline/stages/stored_trials.h"
#include "pipeline/store/hash.h"
#include "preprocess/cores.h"
#include "preprocess/files/vessel_io.h"
#include "simulate/insertion/start_line.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// Stages that the report tells of; `plans` makes nothing that a user opens.
constexpr std::array kToldStages = {"volume",  "segment", "surface", "centerline",
                                    "anatomy", "wall",    "trials",  "manoeuvres"};

// The numbers of a matrix or list, as they lie in memory.
template <typename Numbers>
std::string_view bytes_of(const Numbers& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()),
          static_cast<std::size_t>(numbers.size()) * sizeof(*numbers.data())};
}

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

/// Wires of the catalogue with an angled tip that the case did not ask for.
std::vector<std::string> other_angled_wires(const plan::Study& study) {
  std::vector<std::string> names;
  for (const CatalogueWire& entry : catalogue().wires) {
    const bool asked = std::any_of(study.wires.begin(), study.wires.end(),
                                   [&](const auto& wire) { return wire.name == entry.wire.name; });
    if (!asked && !entry.wire.straight()) names.push_back(entry.wire.name);
  }
  return names;
}

plan::Verdict decide(Workspace& work, const ReportInput& report) {
  plan::Known known{
      .study = report.study,
      .plan = report.plan,
      .judgement = report.judgement,
      .limits = work.given().limits,
      .angled_wires = other_angled_wires(report.study),
      .yields = work.given().wall.elastic,
      .moves = work.given().wall.support.has_value(),
      .wall_offset = plan_options(work, plan::PlanOptions::Until::kEnd).robustness.unknowns.lumen};
  if (work.has("anatomy")) known.way = way_findings(anatomy_json(report));
  return plan::find_verdict(known);
}

/// How far a trial has moved the vessel's cross-sections in the end.
Eigen::Matrix3Xd moved_by(const Workspace& work, const ReportInput& report, int trial) {
  // Attempts ran in full for their shapes; what they are judged by may be a probe without sections.
  if (const std::optional<simulate::TrialResult> played = find_played(work, trial)) {
    return played->sections;
  }
  return read_trial(work, report.plan.levels[static_cast<std::size_t>(trial)], trial).sections;
}

Json motion_of(const Workspace& work, const ReportInput& report,
               const simulate::SectionChain& chain, const Eigen::Matrix3Xd& moved) {
  const Case& given = work.given();
  return motion_json(*report.study.goal.way, chain, moved, given.access_limits.arm,
                     given.axes_known);
}

/// What a plan's repeats under disturbances do to the vessel, those that reached; null without any.
Json find_motion_of_repeats(const Workspace& work, const ReportInput& report,
                            const simulate::SectionChain& chain, int trial) {
  std::vector<Json> motions;
  for (const plan::RepeatedTrials& plan : report.plan.repeated) {
    if (plan.trial != trial) continue;
    for (const plan::Measured& repeat : plan.trials) {
      if (!repeat.metrics.reached || repeat.sections.cols() != chain.nodes()) continue;
      motions.push_back(motion_of(work, report, chain, repeat.sections));
    }
  }
  return motions.empty() ? Json(nullptr) : motion_spread_json(motions);
}

/// What the best plan of each wire, or its closest attempt where it has none, does to the vessel;
/// null where its cross-sections do not move.
Json find_motion(const Workspace& work, const ReportInput& report,
                 const simulate::SectionChain* chain) {
  if (chain == nullptr) return nullptr;
  Json trials = Json::array();
  for (const int id :
       plan::best_of_each_wire(report.study, report.plan, report.judgement.ranking)) {
    const auto k = static_cast<std::size_t>(id);
    const Eigen::Matrix3Xd u = moved_by(work, report, id);
    if (u.cols() != chain->nodes()) continue;  // of a coarse trial without them
    const auto wire = static_cast<std::size_t>(report.plan.candidates[k].wire);
    trials.push_back({{"trial", id},
                      {"wire", report.study.wires[wire].name},
                      {"outcome", outcome_name(report.plan.trials[k].outcome)}});
    trials.back().update(motion_of(work, report, *chain, u));
    const Json over = find_motion_of_repeats(work, report, *chain, id);
    if (!over.is_null()) trials.back()["under_disturbances"] = over;
  }
  return {{"support_kpa_per_mm", clean(*work.given().wall.support / kMpaPerKpa)},
          {"support_source", "given, not measured on the patient; published: 0.01 to 10"},
          {"trials", std::move(trials)}};
}

// All of the report that the stages before it tell, of what was simulated.
ReportInput describe_run(Workspace& work, plan::Plan plan, const simulate::SectionChain* chain) {
  const Case& given = work.given();
  ReportInput report;
  report.name = given.name;
  report.input_name = work.input.filename().string();
  report.input_sha256 = work.input_sha256;
  report.study = work.study();
  report.devices = given.devices;
  const Catalogue& known = catalogue();
  for (DeviceWire& device : report.devices) {
    for (NamedValue& each : device.values) each.value.source = cite(known, each.value.source);
  }
  report.plan = std::move(plan);
  report.judgement = plan::judge(report.study, report.plan, given.limits, given.weights);
  report.robustness = repeats_json(report.study, report.plan, report.judgement.repeated);
  for (const char* stage : kToldStages) {
    if (!work.has(stage)) continue;
    report.stages.push_back(stage);
    report.figures[stage] = work.figures(stage);
  }
  if (work.has("plans")) {
    const Json of_plans = work.figures("plans");
    for (const Json& told : of_plans.at("warnings")) report.warnings.push_back(told);
  }
  report.motion = find_motion(work, report, chain);
  report.verdict = decide(work, report);

  // The values that stages chose where the case left them open.
  report.parameters = work.parameters;
  report.parameters["insertion"]["length_mm"] = report.study.insertion.length;
  if (work.given().labels && work.given().volume) {
    report.labels_name = work.given().labels->path.filename().string();
    report.labels_sha256 = work.labels_sha256;
  }
  if (work.has("segment") && !work.given().labels) {
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
  const Json plans = work.has("plans")
                         ? read_json(work.artifact("plans").folder / kTimingFile, kTimingSchema)
                         : Json{{"numerics", Json::array()}, {"repeats", {{"cpu_s", 0.0}}}};
  Json timing;
  timing["threads"] = threads > 0 ? threads : core_count();
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

/// What the overview's title adds where the vessel moves, since wires that move it otherwise than
/// it is drawn seem to lie outside it; and what the legend adds of each.
std::string title_of_motion(const ReportInput& report) {
  if (report.motion.is_null()) return {};
  return report.judgement.ranking.plans.empty()
             ? ": the vessel at rest; in mm, how far each wire moves it"
             : ": the vessel as the best plan moves it; in mm, how far each wire does";
}
std::string legend_of_motion(const ReportInput& report, int trial) {
  if (report.motion.is_null()) return {};
  for (const Json& row : report.motion.at("trials")) {
    if (row.at("trial") == trial) return format(", %.1f mm", row.at("most_mm").get<double>());
  }
  return {};
}

/// The best plan of each wire in the vessel, or its closest attempt where it has none: PNG bytes.
std::string draw_overview(Workspace& work, const ReportInput& report, const PageInput& page) {
  std::vector<PictureWire> wires;
  const PictureMarks marks{.title = report.name + title_of_motion(report),
                           .access = report.study.access,
                           .target = report.study.goal.point,
                           .target_radius = report.study.goal.radius,
                           .patient_axes = work.given().axes_known};
  std::vector<KeyLine> key = {
      {"piece", "overview " + std::to_string(kReportVersion)},
      {"surface", work.artifact("surface").contents()},
      {"marks", Json({marks.title, marks.patient_axes, to_json(*marks.access),
                      to_json(*marks.target), marks.target_radius})
                    .dump()}};
  for (const int id :
       plan::best_of_each_wire(report.study, report.plan, report.judgement.ranking)) {
    const auto w =
        static_cast<std::size_t>(report.plan.candidates[static_cast<std::size_t>(id)].wire);
    const bool best = report.judgement.ranking.wires[w].best_trial == id;
    const PageTrial& trial = page.trials[static_cast<std::size_t>(id)];
    if (trial.nodes.cols() < 2) continue;
    const simulate::Outcome outcome = report.plan.trials[static_cast<std::size_t>(id)].outcome;
    std::string ended = outcome_name(outcome);
    std::replace(ended.begin(), ended.end(), '_', ' ');
    wires.push_back({.name = report.study.wires[w].name + ": " +
                             (best ? "best plan" : "no plan, " + ended) +
                             legend_of_motion(report, id),
                     .nodes = trial.nodes.cast<double>(),
                     .contact_force = {},
                     .radius = report.study.wires[w].radius,
                     .color = wire_color(static_cast<int>(wires.size()))});
    const int catheter = report.plan.candidates[static_cast<std::size_t>(id)].catheter;
    if (catheter < 0) continue;
    const simulate::Wire& tube =
        report.study.catheters[static_cast<std::size_t>(catheter)].tool.wire;
    const double in = report.plan.trials[static_cast<std::size_t>(id)].tools.front().insertion;
    if (in <= 0.0) continue;
    wires.push_back({.name = tube.name + ", round it",
                     .nodes = simulate::line_up_to(wires.back().nodes, in),
                     .contact_force = {},
                     .radius = tube.radius,
                     .color = wire_color(static_cast<int>(wires.size()))});
  }
  for (const PictureWire& wire : wires) {
    key.push_back({"wire", Json({wire.name, wire.radius, hash_text(bytes_of(wire.nodes))}).dump()});
  }
  // As the best plan moves it.
  Surface vessel = work.surface();
  if (page.chain && !report.judgement.ranking.plans.empty()) {
    const int best = report.judgement.ranking.plans.front().trial;
    const Eigen::Matrix3Xd u = moved_by(work, report, best);
    if (u.cols() == page.chain->nodes()) {  // as find_motion()
      vessel.vertices = page.chain->carried(vessel.vertices, u);
      key.push_back({"moved", hash_text(bytes_of(u))});
    }
  }
  return work.piece(key, [&] { return encode_png(draw_picture(vessel, wires, marks)); });
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
  page.panels["anatomy"] = anatomy_panel(*study.goal.way);
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

/// What the report shows of every trial.
struct ShownTrials {
  std::vector<PageTrial> trials;                            // without their directions
  std::vector<std::vector<simulate::TriangleForce>> peaks;  // of those in full
};

ShownTrials read_trials(const Workspace& work, const plan::Plan& plan) {
  const std::size_t count = plan.candidates.size();
  ShownTrials shown{std::vector<PageTrial>(count),
                    std::vector<std::vector<simulate::TriangleForce>>(count)};
  std::vector<std::function<void()>> jobs;
  for (std::size_t k = 0; k < count; ++k) {
    jobs.push_back([&, k] {
      simulate::TrialResult trial = read_trial(work, plan.levels[k], static_cast<int>(k));
      shown.trials[k] = page_trial(trial);
      if (plan.levels[k] == plan::Level::kFull) shown.peaks[k] = std::move(trial.peak_forces);
    });
  }
  do_at_once(work, jobs);
  return shown;
}

/// As CBOR: a tenth of the trials' files, and quick to read.
std::string to_bytes(const ShownTrials& shown) {
  const auto binary = [](const auto& numbers) {
    const std::string_view bytes = bytes_of(numbers);
    return Json::binary({bytes.begin(), bytes.end()});
  };
  Json rows = Json::array();
  for (std::size_t k = 0; k < shown.trials.size(); ++k) {
    std::vector<int> triangles;
    std::vector<double> forces;
    for (const auto& [triangle, force] : shown.peaks[k]) {
      triangles.push_back(triangle);
      forces.push_back(force);
    }
    rows.push_back({binary(shown.trials[k].nodes), binary(shown.trials[k].push), binary(triangles),
                    binary(forces), binary(shown.trials[k].tools), binary(shown.trials[k].sections),
                    shown.trials[k].exchanges});
  }
  const std::vector<std::uint8_t> bytes = Json::to_cbor(rows);
  return {bytes.begin(), bytes.end()};
}

ShownTrials from_bytes(const std::string& bytes) {
  const auto fill = [](const Json& row, auto& numbers) {
    const Json::binary_t& stored = row.get_binary();
    expects(stored.size() == bytes_of(numbers).size());
    std::copy(stored.begin(), stored.end(), reinterpret_cast<std::uint8_t*>(numbers.data()));
  };
  ShownTrials shown;
  const Json rows = Json::from_cbor(bytes);
  for (const Json& row : rows) {
    const auto columns = [&](std::size_t k, std::size_t bytes_each) {
      return static_cast<Eigen::Index>(row.at(k).get_binary().size() / bytes_each);
    };
    PageTrial& trial = shown.trials.emplace_back();
    trial.nodes.resize(3, columns(0, 3 * sizeof(float)));
    trial.push.resize(5, columns(1, 5 * sizeof(float)));
    std::vector<int> triangles(static_cast<std::size_t>(columns(2, sizeof(int))));
    std::vector<double> forces(triangles.size());
    fill(row.at(0), trial.nodes);
    fill(row.at(1), trial.push);
    fill(row.at(2), triangles);
    fill(row.at(3), forces);
    trial.tools.resize(7, columns(4, 7 * sizeof(float)));
    fill(row.at(4), trial.tools);
    trial.sections.resize(3, columns(5, 3 * sizeof(float)));
    fill(row.at(5), trial.sections);
    trial.exchanges = row.at(6).get<std::vector<std::size_t>>();
    std::vector<simulate::TriangleForce>& peaks = shown.peaks.emplace_back();
    for (std::size_t k = 0; k < forces.size(); ++k) peaks.push_back({triangles[k], forces[k]});
  }
  return shown;
}

/// Reads it from the trials' files once: it does not depend on how they are judged.
ShownTrials find_trials(const Workspace& work, const plan::Plan& plan) {
  std::vector<KeyLine> key = {{"piece", "shown trials " + std::to_string(kReportVersion)}};
  for (const char* stage : {"trials", "manoeuvres"}) {
    key.push_back({stage, work.artifact(stage).contents()});
  }
  return from_bytes(work.piece(key, [&] { return to_bytes(read_trials(work, plan)); }));
}

/// The panel of slices; `forces` tell where the volume is cut.
Json cut_slices_panel(Workspace& work, const PageInput& page, const std::vector<double>& forces) {
  const std::vector<KeyLine> key = {
      {"piece", "slices " + std::to_string(kReportVersion)},
      {"volume", work.input_sha256},
      {"segment", work.artifact("segment").contents()},
      {"surface", work.artifact("surface").contents()},
      {"centerline", work.artifact("centerline").contents()},
      {"points", Json({to_json(page.access), to_json(page.target)}).dump()},
      {"forces", hash_text(bytes_of(forces))}};
  return Json::parse(work.piece(key, [&] {
    const Slices slices =
        cut_vessel_slices(work.image(), {page.surface, page.path, page.access, page.target},
                          work.figures("segment"), forces);
    work.drop_image();
    return slices_json(slices).dump();
  }));
}

/// The insertion of a trial that can be played, where it was kept; for viewers too, in a folder of
/// that name.
std::optional<PageInsertion> read_insertion(const Workspace& work, const ReportInput& report,
                                            const PageInput& page, int id, const std::string& name,
                                            const fs::path& folder) {
  std::optional<simulate::TrialResult> trial = find_played(work, id);
  if (!trial) return {};
  if (!name.empty()) write_shapes(*trial, name, folder);
  if (!name.empty() && page.chain) {
    write_moved_vessel(trial->shapes, page.surface, *page.chain, name + "-vessel", folder);
  }
  const auto k = static_cast<std::size_t>(id);
  const plan::Candidate& candidate = report.plan.candidates[k];
  if (!name.empty() && candidate.catheter >= 0) {
    write_step_markups(
        *trial,
        plan::describe_steps(report.study, candidate, report.plan.trials[k].metrics.insertion),
        name, {"catheter", "wire"}, folder);
  }
  return PageInsertion{id, std::move(trial->shapes), std::move(trial->peak_forces)};
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

/// Puts all trials on the page, and gives the largest forces on the wall: of all of them, and of
/// the best plan.
std::pair<ForceMap, ForceMap> show_trials(const Workspace& work, const ReportInput& report,
                                          PageInput& page) {
  ShownTrials shown = find_trials(work, report.plan);
  page.trials = std::move(shown.trials);
  for (std::size_t k = 0; k < page.trials.size(); ++k) {
    page.trials[k].direction =
        plan::make_introducer(report.study, report.plan.candidates[k]).direction;
  }
  ForceMap all_forces(page.surface.triangles.cols()), best_forces = all_forces;
  for (const auto& trial : shown.peaks) all_forces.add(trial);
  const std::vector<plan::RankedPlan>& plans = report.judgement.ranking.plans;
  if (!plans.empty()) best_forces.add(shown.peaks[static_cast<std::size_t>(plans.front().trial)]);
  page.peak_force = all_forces.values();
  return {std::move(all_forces), std::move(best_forces)};
}

}  // namespace

std::string make_first_page(Workspace& work) {
  PageInput page = start_page(work);
  page.chain = work.section_chain();
  ReportInput report = describe_run(work, known_before_plans(work), page.chain.get());
  report.name += " (preliminary)";
  report.warnings.insert(report.warnings.begin(),
                         "preliminary: errors and what disturbances do are not known yet, and "
                         "other plans may come first; the run goes on, and report.html takes this "
                         "page's place");
  show_trials(work, report, page);
  page.picture_png = draw_overview(work, report, page);
  for (const int id : plan::choose_played(report.study, report.plan, report.judgement.ranking)) {
    std::optional<PageInsertion> insertion = read_insertion(work, report, page, id, "", {});
    if (insertion) page.insertions.push_back(std::move(*insertion));
  }
  report.timing = timing_json(work);
  report.timing["report_s"] = 0.0;
  return build_page(build_report(report), page);
}

void make_report(Workspace& work, const fs::path& folder) {
  const auto start = std::chrono::steady_clock::now();
  PageInput page = start_page(work);
  page.chain = work.section_chain();
  ReportInput report = describe_run(work, read_plan(work), page.chain.get());
  warn_of_other_first(work.given(), report);
  const std::pair<ForceMap, ForceMap> of_wall = show_trials(work, report, page);
  const ForceMap &all_forces = of_wall.first, &best_forces = of_wall.second;
  const std::vector<plan::RankedPlan>& plans = report.judgement.ranking.plans;
  const ForceMap& forces = plans.empty() ? all_forces : best_forces;  // where the volume is cut

  // Alone: a volume of DICOM is read in a copy of this process, in which what others hold at that
  // moment stays held (apart.h).
  if (has_slices(work)) page.panels["slices"] = cut_slices_panel(work, page, forces.values());

  // The longest first, so that none is left alone at the end.
  std::vector<std::function<void()>> jobs = {
      [&] { write_forces(work, report, all_forces, best_forces, folder); },
      [&] {
        page.picture_png = draw_overview(work, report, page);
        write_whole(page.picture_png, folder / "plans.png");
      }};
  const std::vector<int> played =
      plan::choose_played(report.study, report.plan, report.judgement.ranking);
  std::vector<std::optional<PageInsertion>> insertions(played.size());
  for (std::size_t k = 0; k < played.size(); ++k) {
    jobs.push_back([&, k] {
      const bool for_viewers = k < std::min(kPlansShown, plans.size());
      insertions[k] =
          read_insertion(work, report, page, played[k],
                         for_viewers ? "plan-" + std::to_string(k + 1) : "", folder / "trials");
    });
  }
  jobs.push_back([&] { write_ranked_markups(report, page, folder / "trials"); });
  do_at_once(work, jobs);
  for (std::optional<PageInsertion>& insertion : insertions) {
    if (insertion) page.insertions.push_back(std::move(*insertion));
  }

  report.timing = timing_json(work);
  report.timing["report_s"] = seconds_since(start);
  const Json result = build_report(report);
  if (page_missing().empty()) write_whole(build_page(result, page), folder / "report.html");
  write_whole(sheet_csv(result), folder / "sheet.csv");
  write_whole(trials_csv(result), folder / "trials.csv");
  write_json(result, folder / "report.json");
}

}  // namespace wireplan::pipeline
