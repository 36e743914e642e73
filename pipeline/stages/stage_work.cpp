#include "pipeline/stages/stage_work.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>
#include <thread>
#include <utility>

#include "pipeline/files/catalogue.h"
#include "pipeline/files/trial_file.h"
#include "pipeline/files/viewer_files.h"
#include "pipeline/report/picture.h"
#include "pipeline/report/report.h"
#include "pipeline/report/report_page.h"
#include "pipeline/stages/manoeuvres.h"
#include "pipeline/stages/repeats.h"
#include "plan/batch.h"
#include "plan/metrics.h"
#include "plan/search.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/files/vessel_io.h"
#include "preprocess/segment/segment.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_repair.h"
#include "preprocess/wall/wall.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// The direction of the vessel at the access is that of its first centimetre.
constexpr double kTangentSpan = 10.0;
// Wire that is brought along where the case leaves it open: a wire does not keep to the middle.
constexpr double kInsertionFactor = 1.25, kInsertionExtra = 20.0;

// Which plans are the best is found from so many repeats of each that may be. Plans that fall
// behind let others up, which are repeated next.
constexpr int kFirstRepeats = 32;
constexpr int kRepeatRounds = 3;

constexpr std::array kStagesBeforeReport = {"volume", "segment", "surface",   "centerline",
                                            "wall",   "trials",  "manoeuvres"};
constexpr const char* kTimingSchema = "wireplan.timing/1";

#ifndef WIREPLAN_IMAGING
[[noreturn]] void throw_no_imaging() {
  throw Error("this wireplan is built without imaging and reads no volumes; enter the case at a " +
              std::string("surface, or configure with -DWIREPLAN_IMAGING=ON"));
}
#endif

#ifdef WIREPLAN_IMAGING
// What was cut, in words; the largest leaks only.
std::string leak_warning(const preprocess::Leak& leak) {
  const auto rounded = [](double value) { return Json(std::round(value * 10.0) / 10.0).dump(); };
  const Vec3& at = leak.place;
  return "segment: cut a leak at (" + rounded(at.x()) + ", " + rounded(at.y()) + ", " +
         rounded(at.z()) + ") mm: behind a neck of " + rounded(leak.neck_radius_mm) +
         " mm radius lay " + rounded(leak.volume_mm3 / 1000.0) + " cm3, up to " +
         rounded(leak.radius_mm) + " mm in radius, of " + rounded(leak.mean_hu) +
         " HU in the mean" + (leak.bright_fraction > 0.2 ? ", much of it against bone" : "") +
         "; if that is artery, add a point in it to segmentation.seeds_mm";
}

// Figures of the segment stage. What was chosen for the case is told as the report prints it.
void add_segmentation(const preprocess::SegmentStatistics& statistics, bool chosen, Json& figures) {
  constexpr std::size_t kLeaksTold = 5;
  const preprocess::Band& band = statistics.band;
  figures["band"] = {{"chosen", chosen},
                     {"lower_hu", band.lower_hu},
                     {"connect_hu", band.connect_hu},
                     {"upper_hu", band.upper_hu},
                     {"way_hu", band.way_hu},
                     {"smoothing_mm", band.smoothing_mm},
                     {"neck_opening_mm", band.neck_mm}};
  figures["samples"] = Json::array();
  for (const preprocess::LumenSample& sample : statistics.samples) {
    figures["samples"].push_back({{"point_mm", to_json(sample.point)},
                                  {"level_hu", sample.level_hu},
                                  {"noise_hu", sample.noise_hu}});
  }
  figures["volume_mm3"] = statistics.volume_mm3;
  figures["mean_hu"] = statistics.mean_hu;
  figures["removed_by_opening_mm3"] = statistics.removed_by_opening_mm3;
  figures["bright_boundary_fraction"] = statistics.bright_boundary;
  figures["touches_border"] = statistics.touches_border;
  figures["way_length_mm"] = statistics.search.route.length_mm;
  figures["narrowest_radius_mm"] = statistics.search.route.narrowest_radius_mm;
  figures["narrowest_mm"] = to_json(statistics.search.route.narrowest);
  figures["leaks"] = Json::array();
  for (const preprocess::Leak& leak : statistics.search.leaks) {
    figures["leaks"].push_back({{"place_mm", to_json(leak.place)},
                                {"neck_radius_mm", leak.neck_radius_mm},
                                {"radius_mm", leak.radius_mm},
                                {"volume_mm3", leak.volume_mm3},
                                {"mean_hu", leak.mean_hu},
                                {"bright_fraction", leak.bright_fraction}});
    if (figures["leaks"].size() <= kLeaksTold) {
      figures["warnings"].push_back(leak_warning(leak));
    }
  }
}
#endif

// What was mended of a given surface: each place, and in words.
void add_mends(const std::vector<preprocess::Mend>& mends, Json& figures) {
  figures["mended"] = Json::array();
  for (const preprocess::Mend& mend : mends) {
    figures["mended"].push_back({{"what", preprocess::name_of(mend.kind)},
                                 {"count", mend.count},
                                 {"place_mm", to_json(mend.place)},
                                 {"size_mm", mend.size}});
  }
  for (const std::string& line : preprocess::tell_mends(mends)) {
    figures["warnings"].push_back("surface: " + line);
  }
}

// Length and width of a line, as the report has them of a branch.
Json line_figures(const Centerline& line) {
  const Eigen::Index last = line.points.cols() - 1;
  const double length = line.arc_length(last);
  const double distance = (line.points.col(last) - line.points.col(0)).norm();
  return {{"length_mm", length},
          {"mean_diameter_mm", 2.0 * line.radius.mean()},
          {"min_diameter_mm", 2.0 * line.radius.minCoeff()},
          {"max_diameter_mm", 2.0 * line.radius.maxCoeff()},
          {"tortuosity", distance > 0.0 ? Json(length / distance) : Json(nullptr)}};
}

// The whole tree: files for viewers, and a list of its branches.
Json write_tree(const std::vector<preprocess::Branch>& tree, const fs::path& folder) {
  std::vector<Centerline> lines;
  std::vector<NamedCurve> curves;
  Json branches = Json::array();
  for (std::size_t k = 0; k < tree.size(); ++k) {
    const Centerline& line = tree[k].line;
    const std::string name = "branch " + std::to_string(k + 1);
    lines.push_back(line);
    curves.push_back({name, line.points});
    Json branch = {
        {"name", name},
        {"parent",
         tree[k].parent < 0 ? Json(nullptr) : Json("branch " + std::to_string(tree[k].parent + 1))},
        {"parent_arc_mm", tree[k].parent_arc},
        {"start_mm", to_json(Vec3(line.points.col(0)))},
        {"end_mm", to_json(Vec3(line.points.col(line.points.cols() - 1)))}};
    branch.update(line_figures(line));
    branches.push_back(std::move(branch));
  }
  preprocess::write_centerlines(lines, folder / "tree.vtp");
  write_curve_markups(curves, folder / "tree.mrk.json");
  return branches;
}

void require_inside(const Surface& surface, const std::string& key, const Vec3& point) {
  const preprocess::InsideAnswer answer = preprocess::locate_point(surface, point);
  if (answer.inside) return;
  throw Error(key + " is " + to_json(point).dump() + ", " +
              Json(std::round(answer.distance * 10.0) / 10.0).dump() +
              " mm outside the vessel, expected a point inside it; look at surface.vtp and move " +
              "the point, or mend the segmentation that left its place out");
}

// Enough wire for a way round the middle, as far as the shortest wire goes.
double choose_insertion(const Centerline& path, const plan::Study& study) {
  const double path_length = path.arc_length(path.arc_length.size() - 1);
  double length = std::ceil(kInsertionFactor * path_length + kInsertionExtra);
  for (const simulate::Wire& wire : study.wires) length = std::min(length, wire.length());
  return length;
}

// All that one trial reads: what its stage reads, but of the lists only its own entry.
std::string trial_key_text(const Workspace& work, const plan::Study& study,
                           const plan::Candidate& candidate) {
  const auto& [wire, inclination, azimuth, roll, moves] = candidate;
  Json script = Json::array();
  for (const auto& [push, turn] : moves) script.push_back({push, turn});
  const std::string shared = without_parameters(
      work.key_text, {"wires", "access.inclination_deg", "access.azimuth_deg", "tip_roll_deg",
                      "insertion.length_mm", "search", "limits", "ranking"});
  return shared + key_text({{"wire", wire_json(study.wires[static_cast<std::size_t>(wire)]).dump()},
                            {"inclination", Json(inclination).dump()},
                            {"azimuth", Json(azimuth).dump()},
                            {"roll", Json(roll).dump()},
                            {"moves", script.dump()},
                            {"length", Json(study.insertion.length).dump()}});
}

// Trials of one level: "scout" and "probe" on a rigid wall, "full" on the case's. Each is kept as
// soon as it is finished: a run goes on where it was stopped, and a case that has a trial in common
// with another takes it from there.
class TrialLevel {
 public:
  TrialLevel(Workspace& work, const char* level, plan::Study study)
      : work_(work), level_(level), study_(std::move(study)) {
    study_.insertion.record_every = study_.insertion.length;  // shapes on the way are not kept
  }

  // Those of these candidates whose trials the store has not; of the others read() is good then.
  std::vector<int> find_missing(const std::vector<plan::Candidate>& candidates,
                                const std::vector<int>& wanted) {
    std::vector<int> ids;
    for (const int id : wanted) {
      std::optional<fs::path> kept =
          work_.store().find_piece(key_of(candidates[static_cast<std::size_t>(id)]));
      if (kept) {
        pieces_[id] = std::move(*kept);
      } else {
        ids.push_back(id);
      }
    }
    return ids;
  }

  // Takes the trials of these candidates from the store or runs them. The vessel is asked for only
  // where there is one to run. Throws Interrupted.
  void run(const std::vector<plan::Candidate>& candidates, const std::vector<int>& wanted) {
    const std::vector<int> ids = find_missing(candidates, wanted);
    if (ids.empty()) return;
    const bool full = level_ == kFullLevel;
    const simulate::VesselModel& vessel = full ? work_.model() : work_.rigid_model();
    const Centerline path = work_.path();
    const int kept = static_cast<int>(wanted.size() - ids.size());
    const WorkOptions& options = work_.options();
    plan::BatchOptions batch{
        .threads = options.threads, .progress = {}, .cancelled = options.cancelled};
    if (options.progress) {
      batch.progress = [&](int done, int count) { options.progress(kept + done, kept + count); };
    }
    std::vector<double> cpu_seconds(ids.size());
    std::vector<fs::path> made(ids.size());
    const std::vector<bool> finished = plan::for_each_slot(
        static_cast<int>(ids.size()),
        [&](int slot) {
          const double start = plan::thread_cpu_seconds();
          const int id = ids[static_cast<std::size_t>(slot)];
          const plan::Candidate& candidate = candidates[static_cast<std::size_t>(id)];
          const simulate::TrialResult trial =
              full ? plan::run_candidate(study_, candidate, vessel)
                   : plan::run_scout(study_, candidate, vessel, path);
          made[static_cast<std::size_t>(slot)] =
              work_.store().keep_piece(key_of(candidate), trial_text(study_, candidate, trial));
          cpu_seconds[static_cast<std::size_t>(slot)] = plan::thread_cpu_seconds() - start;
        },
        batch);
    if (std::find(finished.begin(), finished.end(), false) != finished.end()) throw Interrupted();
    for (std::size_t slot = 0; slot < ids.size(); ++slot) {
      cpu_seconds_ += cpu_seconds[slot];
      pieces_[ids[slot]] = std::move(made[slot]);
    }
    trials_run_ += static_cast<int>(ids.size());
  }

  // Puts all that was found or run into the folder: the same bytes, not a second time on the disk.
  void place(const fs::path& folder) const {
    fs::create_directories(folder / "trials");
    for (const auto& [id, piece] : pieces_) {
      std::error_code cannot_link;
      fs::create_hard_link(piece, folder / trial_file_name(id), cannot_link);
      if (cannot_link) fs::copy_file(piece, folder / trial_file_name(id));
    }
  }

  const std::string& name() const { return level_; }
  int trials_run() const { return trials_run_; }
  const plan::Study& study() const { return study_; }
  simulate::TrialResult read(int id) const { return read_trial_file(pieces_.at(id)); }
  Json timing() const {
    return {{"level", level_}, {"trials_run", trials_run_}, {"cpu_s", cpu_seconds_}};
  }

 private:
  // The elements of a scout follow from all wires of the study.
  std::string key_of(const plan::Candidate& candidate) const {
    return trial_key_text(work_, study_, candidate) +
           key_text({{"level", level_}, {"element", Json(study_.insertion.element_length).dump()}});
  }

  Workspace& work_;
  std::string level_;
  plan::Study study_;
  std::map<int, fs::path> pieces_;  // in the store, by candidate
  int trials_run_ = 0;              // this time
  double cpu_seconds_ = 0.0;        // of these                                            [s]
};

// A case's trials, round by round: first the scouts of all candidates, then probes and full runs of
// those that may be among the best, by what is known of the rounds before; or all in full at once.
class TrialRounds {
 public:
  explicit TrialRounds(Workspace& work)
      : work_(work),
        candidates_(plan::list_candidates(work.study())),
        full_(work, kFullLevel, work.study()) {
    if (!plan::needs_search(work.study(), work.given().exhaustive)) return;
    scout_.emplace(work, kScoutLevel, plan::scout_study(work.study()));
    if (work.given().wall.elastic) probe_.emplace(work, kProbeLevel, work.study());
    seen_.scouts.resize(candidates_.size());
    seen_.probes.resize(candidates_.size());
    seen_.full.resize(candidates_.size());
  }

  // The candidates of the next round, ascending; empty where all is known. Expects every trial of
  // the round before to be found or run.
  std::vector<int> next() {
    ++round_;
    if (round_ == 1) {
      level_ = scout_ ? &*scout_ : &full_;
      last_.resize(candidates_.size());
      std::iota(last_.begin(), last_.end(), 0);
      return last_;
    }
    if (!scout_) return {};
    for (const int id : last_) {
      const auto k = static_cast<std::size_t>(id);
      const plan::Sighting sighting = look(id);
      if (level_ == &full_) {
        seen_.full[k] = sighting;
      } else if (level_ == &*scout_) {
        seen_.scouts[k] = sighting;
      } else {
        seen_.probes[k] = sighting;
      }
    }
    plan::NextRuns runs = plan::choose_next(work_.study(), candidates_, seen_, probe_.has_value());
    const bool probes = !runs.probes.empty();
    level_ = probes ? &*probe_ : &full_;
    last_ = probes ? std::move(runs.probes) : std::move(runs.full);
    return last_;
  }

  TrialLevel& level() { return *level_; }
  std::vector<int> find_missing(const std::vector<int>& ids) {
    return level().find_missing(candidates_, ids);
  }
  void run(const std::vector<int>& ids) { level().run(candidates_, ids); }

  // Puts the trials of all levels into the folder; returns what each took.
  Json place(const fs::path& folder) const {
    Json timing = Json::array();
    for (const std::optional<TrialLevel>* level : {&scout_, &probe_}) {
      if (!*level) continue;
      (*level)->place(folder / (*level)->name());
      timing.push_back((*level)->timing());
    }
    full_.place(folder);
    timing.push_back(full_.timing());
    return timing;
  }

  std::size_t candidate_count() const { return candidates_.size(); }

  // What the report tells of the scouts; null where there are none.
  Json describe_scouts() const {
    if (!scout_) return nullptr;
    const plan::ScoutError error = plan::find_scout_error(seen_.scouts, seen_.full);
    const auto number = [](const std::optional<double>& value) {
      return value ? Json(*value) : Json(nullptr);
    };
    return {{"element_length_mm", scout_->study().insertion.element_length},
            {"step_mm", scout_->study().insertion.step},
            {"wall", "rigid"},
            {"trials", candidates_.size()},
            {"probed", std::count_if(seen_.probes.begin(), seen_.probes.end(),
                                     [](const auto& probe) { return probe.has_value(); })},
            {"compared", error.compared},
            {"both_reached", error.both_reached},
            {"median_score_error", number(error.median_score)},
            {"largest_score_error", number(error.largest_score)},
            {"missed", error.missed},
            {"false_reached", error.false_reached}};
  }

 private:
  plan::Sighting look(int id) const {
    const simulate::TrialResult trial = level_->read(id);
    plan::Sighting sighting =
        plan::look_at(trial, plan::compute_metrics(trial, level_->study(), work_.path()),
                      level_->study(), work_.given().limits, work_.given().weights);
    const int wire = candidates_[static_cast<std::size_t>(id)].wire;
    sighting.pinched =
        probe_ && level_ != &full_ &&
        plan::is_pinched(trial, work_.study().wires[static_cast<std::size_t>(wire)].radius,
                         work_.path());
    return sighting;
  }

  Workspace& work_;
  std::vector<plan::Candidate> candidates_;
  TrialLevel full_;
  std::optional<TrialLevel> scout_, probe_;
  plan::Sightings seen_;  // none where all are run in full
  TrialLevel* level_ = nullptr;
  std::vector<int> last_;  // candidates of the round before
  int round_ = 0;
};

// Largest force on each triangle, over trials.
class ForceMap {
 public:
  explicit ForceMap(Eigen::Index triangles) : force_(static_cast<std::size_t>(triangles), 0.0) {}
  void add(const simulate::TrialResult& trial) {
    for (const simulate::TriangleForce& peak : trial.peak_forces) {
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
  report.candidates = list_tried(work);
  for (const char* stage : kStagesBeforeReport) {
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

Json timing_json(const Workspace& work, const std::vector<plan::Refinement>& refinements) {
  const int threads = work.options().threads;
  Json timing;
  timing["threads"] = threads > 0 ? threads : static_cast<int>(std::thread::hardware_concurrency());
  timing["stages"] = Json::array();
  for (const char* stage : kStagesBeforeReport) {
    if (!work.has(stage)) continue;
    timing["stages"].push_back({{"stage", stage}, {"seconds", work.artifact(stage).seconds}});
  }
  timing["trials"] = read_json(work.artifact("trials").folder / kTimingFile, kTimingSchema);
  timing["numerics"] = Json::array();
  for (const plan::Refinement& refinement : refinements) {
    for (std::size_t k = 0; k < refinement.rows.size(); ++k) {
      timing["numerics"].push_back({{"trial", refinement.trial},
                                    {"element_length_mm", refinement.rows[k].element_length},
                                    {"cpu_s", refinement.cpu_seconds[k]}});
    }
  }
  return timing;
}

}  // namespace

Json figures_of(const std::string& stage) {
  return {{"schema", "wireplan." + stage + "/1"}, {"warnings", Json::array()}};
}

void write_figures(const Json& figures, const fs::path& folder) {
  write_json(figures, folder / kFiguresFile);
}

Workspace::Workspace(Case given, WorkOptions options, Store store)
    : given_(std::move(given)), options_(std::move(options)), store_(std::move(store)) {
  input = given_.volume ? given_.volume->path : given_.surface_input->path;
}

const Artifact& Workspace::artifact(const std::string& stage) const {
  const auto found = artifacts_.find(stage);
  expects(found != artifacts_.end());
  return found->second;
}

Json Workspace::figures(const std::string& stage) const {
  return read_json(artifact(stage).folder / kFiguresFile, "wireplan." + stage + "/1");
}

const preprocess::Image& Workspace::image() {
#ifdef WIREPLAN_IMAGING
  if (!image_) image_ = preprocess::read_image(input);
  return *image_;
#else
  throw_no_imaging();
#endif
}

const Surface& Workspace::surface() {
  if (!surface_) {
    surface_ = preprocess::read_surface_artifact(artifact("surface").folder / "surface.vtp");
  }
  return *surface_;
}

const Centerline& Workspace::path() {
  if (!path_) {
    path_ = preprocess::read_centerline(artifact("centerline").folder / "centerline.vtp");
  }
  return *path_;
}

const Wall& Workspace::wall() {
  if (!wall_) {
    wall_ = preprocess::read_wall(artifact("wall").folder / "wall.vtu");
    expects(wall_->apexes.cols() == surface().triangles.cols());
  }
  return *wall_;
}

std::string Workspace::field_key_text() const {
  // The program stands for how it is made.
  return pipeline::key_text({{"piece", "field"},
                             {"input surface", artifact("surface").contents()},
                             {"yields", given_.wall.elastic ? "true" : "false"},
                             {"program", build_info().dump()}});
}

bool Workspace::find_field() {
  const std::optional<fs::path> kept = store_.find_piece(field_key_text());
  if (!kept) return false;
  std::optional<simulate::Lumen> field = simulate::Lumen::from_bytes(read_if_there(*kept));
  if (!field) return false;
  model_ = std::make_unique<simulate::VesselModel>(surface(), std::move(*field));
  return true;
}

void Workspace::share_field() {
  if (model_) return;
  const std::optional<FileLock> lock = store_.lock("field", field_key_text(), options_.cancelled);
  if (!lock) throw Interrupted();
  if (!find_field()) store_.keep_piece(field_key_text(), rigid_model().lumen.to_bytes());
}

const simulate::VesselModel& Workspace::rigid_model() {
  if (!model_ && !find_field()) {
    // The field as a yielding wall needs it, since the wall may come later.
    simulate::LumenOptions options = simulate::follow(surface());
    if (given_.wall.elastic) options.band = simulate::VesselModel::yielding_band(options);
    model_ = std::make_unique<simulate::VesselModel>(surface(), options);
  }
  if (model_->compliance) compliance_aside_ = std::move(model_->compliance);
  return *model_;
}

const simulate::VesselModel& Workspace::model() {
  if (model_ && model_->compliance) return *model_;
  rigid_model();
  if (given_.wall.elastic) {
    if (!compliance_aside_) {
      compliance_aside_ = std::make_unique<simulate::WallCompliance>(surface(), wall());
    }
    model_->compliance = std::move(compliance_aside_);
  }
  return *model_;
}

const plan::Study& Workspace::study() {
  if (!study_) {
    study_ = given_.study;
    study_->tangent = preprocess::start_tangent(path(), kTangentSpan);
    if (study_->insertion.length == 0.0) {
      study_->insertion.length = choose_insertion(path(), *study_);
    }
  }
  return *study_;
}

void make_volume(Workspace& work, const fs::path& folder) {
  const preprocess::Image& image = work.image();
  const preprocess::Grid& grid = image.grid;

  // Statistics of the values, summed in order.
  double sum = 0.0;
  for (const float value : image.values) sum += static_cast<double>(value);
  const auto [low, high] = std::minmax_element(image.values.begin(), image.values.end());
  expects(!image.values.empty());

  Json figures = figures_of("volume");
  figures["size"] = grid.size;
  figures["spacing_mm"] = to_json(grid.spacing);
  figures["origin_mm"] = to_json(grid.origin);
  figures["direction_ijk_to_lps"] = to_json(Eigen::Matrix3Xd(grid.direction.transpose()));
  figures["min_hu"] = *low;
  figures["mean_hu"] = sum / static_cast<double>(image.values.size());
  figures["max_hu"] = *high;
  write_figures(figures, folder);
}

void make_segment([[maybe_unused]] Workspace& work, [[maybe_unused]] const fs::path& folder) {
#ifdef WIREPLAN_IMAGING
  const SegmentationInput& asked = work.given().segmentation;
  std::vector<Vec3> seeds = {work.given().study.access};
  seeds.insert(seeds.end(), asked.seeds.begin(), asked.seeds.end());
  const preprocess::Segmentation segmentation =
      preprocess::segment(work.image(), {.lower_hu = asked.lower_hu,
                                         .upper_hu = asked.upper_hu,
                                         .seeds = std::move(seeds),
                                         .target = work.given().study.goal.point,
                                         .smoothing_mm = asked.smoothing_mm,
                                         .neck_opening_mm = asked.neck_opening_mm});
  preprocess::write_mask(segmentation.mask, folder / "mask.nrrd");

  const preprocess::SegmentStatistics& statistics = segmentation.statistics;
  Json figures = figures_of("segment");
  add_segmentation(statistics, !asked.lower_hu.has_value(), figures);
  if (statistics.touches_border) {
    figures["warnings"].push_back(
        "segment: the vessel touches the border of the volume and is closed there by a flat cap");
  }
  write_figures(figures, folder);
#else
  throw_no_imaging();
#endif
}

void make_surface(Workspace& work, const fs::path& folder) {
  // From the mask, or from the case's file, mended where that is safe.
  const Case& given = work.given();
  Surface surface;
  std::vector<preprocess::Mend> mends;
  [[maybe_unused]] preprocess::FitStatistics fit;
  if (given.surface_input) {
    preprocess::RepairedSurface repaired =
        preprocess::read_surface(work.input, given.surface_input->unit, given.surface_input->frame);
    surface = std::move(repaired.surface);
    mends = std::move(repaired.mends);
    preprocess::require_sound(preprocess::check_surface(surface), work.input.string());
    surface = preprocess::remesh(surface, given.surface.edge_length_mm);
  } else {
#ifdef WIREPLAN_IMAGING
    surface = preprocess::surface_from_image(
        work.image(), preprocess::read_mask(work.artifact("segment").folder / "mask.nrrd"),
        given.surface, &fit);
    work.drop_image();
#else
    throw_no_imaging();
#endif
  }
  const preprocess::SurfaceCheck check = preprocess::check_surface(surface);
  preprocess::require_sound(check, "stage surface");
  preprocess::write_surface(surface, folder / "surface.vtp");

  Json figures = figures_of("surface");
  figures["vertices"] = check.vertices;
  figures["triangles"] = check.triangles;
  figures["volume_mm3"] = check.volume_mm3;
  figures["area_mm2"] = check.area_mm2;
  figures["euler_number"] = check.euler_number;
  figures["mean_edge_mm"] = check.mean_edge_mm;
  figures["min_angle_deg"] = check.min_angle_deg;
  figures["self_intersections"] = check.self_intersections;
  if (given.volume) {
    figures["fit"] = {{"lumen_value", fit.lumen_value},
                      {"outside_value", fit.outside_value},
                      {"mean_shift_mm", fit.mean_shift_mm},
                      {"fitted_fraction", fit.fitted_fraction}};
  }
  if (given.surface_input) add_mends(mends, figures);
  figures["openings"] = openings_json(preprocess::find_openings(surface));
  if (check.euler_number != 2) {
    figures["warnings"].push_back("surface: it has " +
                                  std::to_string((2 - check.euler_number) / 2) +
                                  " handles (Euler number " + std::to_string(check.euler_number) +
                                  "): arteries that touch or loop; look whether the loop is real");
  }
  write_figures(figures, folder);
}

void make_centerline(Workspace& work, const fs::path& folder) {
  // Both ends must lie inside, told by their keys.
  const Surface surface =
      preprocess::read_surface_artifact(work.artifact("surface").folder / "surface.vtp");
  const plan::Study& study = work.given().study;
  require_inside(surface, "access.point_mm", study.access);
  require_inside(surface, "target.point_mm", study.goal.point);

  const Centerline line = preprocess::find_centerline(surface, study.access, study.goal.point);
  preprocess::write_centerline(line, folder / "centerline.vtp");
  write_curve_markups(line.points, "centerline", folder / "centerline.mrk.json");

  Json figures = figures_of("centerline");
  figures.update(line_figures(line));
  figures["branches"] = write_tree(preprocess::find_tree(surface, study.access), folder);
  write_figures(figures, folder);
}

void make_wall(Workspace& work, const fs::path& folder) {
  const Surface surface =
      preprocess::read_surface_artifact(work.artifact("surface").folder / "surface.vtp");
  const preprocess::WallOptions& options = work.given().wall.extrusion;
  const preprocess::ExtrudedWall extruded = preprocess::extrude_wall(surface, options);
  preprocess::write_wall(surface, extruded.wall, folder / "wall.vtu");

  Json figures = figures_of("wall");
  figures["tetrahedra"] = extruded.wall.apexes.cols();
  figures["thickness_mm"] = options.thickness_mm;
  figures["young_modulus_kpa"] = clean(extruded.wall.young_modulus / kMpaPerKpa);
  figures["poisson_ratio"] = extruded.wall.poisson_ratio;
  figures["normal_stiffness_kpa_per_mm"] =
      clean(wall_normal_stiffness(extruded.wall.young_modulus, extruded.wall.poisson_ratio,
                                  options.thickness_mm) /
            kMpaPerKpa);
  figures["inverted_tetrahedra"] = extruded.statistics.inverted;
  figures["limited_tetrahedra"] = extruded.statistics.limited;
  figures["min_height_mm"] = extruded.statistics.min_height_mm;
  write_figures(figures, folder);
}

void make_trials(Workspace& work, const fs::path& folder) {
  const plan::Study& study = work.study();
  TrialRounds rounds(work);
  for (std::vector<int> ids = rounds.next(); !ids.empty(); ids = rounds.next()) rounds.run(ids);
  Json timing = rounds.place(folder);
  const simulate::VesselModel& vessel = work.model();

  Json figures = figures_of("trials");
  figures["trials"] = rounds.candidate_count();
  figures["scout"] = rounds.describe_scouts();
  figures["tangent"] = to_json(study.tangent);
  figures["insertion_length_mm"] = study.insertion.length;
  figures["lumen_grid_mm"] = vessel.lumen.grid_spacing();
  figures["lumen_max_deviation_mm"] = vessel.lumen.max_deviation();
  figures["lumen_mean_deviation_mm"] = vessel.lumen.mean_deviation();
  if (study.insertion.friction == 0.0) {
    figures["warnings"].push_back("trials: frictionless (friction is 0): " +
                                  std::string("push forces are lower bounds"));
  }
  if (!work.given().wall.elastic) {
    figures["warnings"].push_back("trials: rigid wall: contact forces are upper bounds");
  }
  write_figures(figures, folder);
  int trials_run = 0;
  double cpu_sum = 0.0;
  for (const Json& level : timing) {
    trials_run += level.at("trials_run").get<int>();
    cpu_sum += level.at("cpu_s").get<double>();
  }
  write_json({{"schema", kTimingSchema},
              {"trials_run", trials_run},
              {"cpu_s", cpu_sum},
              {"levels", std::move(timing)}},
             folder / kTimingFile);
}

ShareOutcome run_share(Workspace& work, const Share& share) {
  expects(share.shard >= 1 && share.shard <= share.shards && share.round >= 1);
  TrialRounds rounds(work);
  std::vector<int> ids = rounds.next();
  for (int round = 1; round < share.round && !ids.empty(); ++round) {
    const std::size_t missing = rounds.find_missing(ids).size();
    if (missing > 0) {
      throw Error("round " + std::to_string(share.round) + " follows from all " +
                  std::to_string(ids.size()) + " trials of round " + std::to_string(round) +
                  ", of which " + std::to_string(missing) +
                  " are not in the store; run its other shards first, or \"wireplan report\", "
                  "which runs what is missing");
    }
    ids = rounds.next();
  }

  // Every N-th, so that the costly ones, which are neighbours, are shared out.
  std::vector<int> own;
  const auto shards = static_cast<std::size_t>(share.shards);
  for (auto k = static_cast<std::size_t>(share.shard - 1); k < ids.size(); k += shards) {
    own.push_back(ids[k]);
  }
  if (share.shards > 1 && !rounds.find_missing(own).empty()) work.share_field();
  rounds.run(own);
  return {.level = rounds.level().name(),
          .round_trials = static_cast<int>(ids.size()),
          .own_trials = static_cast<int>(own.size()),
          .run = rounds.level().trials_run()};
}

namespace {

/// The best plan of each wire in the vessel, or its closest attempt where it has none.
Picture draw_overview(Workspace& work, const ReportInput& report, const PageInput& page) {
  std::vector<PictureWire> wires;
  for (const int id : best_of_each_wire(report)) {
    const auto w = static_cast<std::size_t>(report.candidates[static_cast<std::size_t>(id)].wire);
    const bool best = report.ranking.wires[w].best_trial == id;
    const PageTrial& trial = page.trials[static_cast<std::size_t>(id)];
    if (trial.nodes.cols() < 2) continue;
    const simulate::Outcome outcome = report.trials[static_cast<std::size_t>(id)].outcome;
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

/// Every ranked plan for 3D Slicer.
void write_ranked_markups(const ReportInput& report, const PageInput& page,
                          const fs::path& folder) {
  fs::create_directories(folder);
  for (std::size_t k = 0; k < report.ranking.plans.size(); ++k) {
    const auto id = static_cast<std::size_t>(report.ranking.plans[k].trial);
    const std::string name = "plan-" + std::to_string(k + 1);
    write_plan_markups({.name = name,
                        .nodes = page.trials[id].nodes.cast<double>(),
                        .access = page.access,
                        .direction = page.trials[id].direction,
                        .target = page.target},
                       folder / (name + ".mrk.json"));
  }
}

}  // namespace

void make_report(Workspace& work, const fs::path& folder) {
  const auto start = std::chrono::steady_clock::now();
  const plan::Study& study = work.study();

  // Measure the trials one by one; of each only how it ended is kept.
  ReportInput report = describe_run(work);
  const std::vector<plan::Candidate>& candidates = report.candidates;
  PageInput page = start_page(work);
  ForceMap all_forces(work.surface().triangles.cols());
  for (std::size_t id = 0; id < candidates.size(); ++id) {
    const simulate::TrialResult trial = read_trial(work, id);
    report.levels.push_back(level_of(work, id));
    const bool scouted = report.is_scouted(id);
    report.metrics.push_back(plan::compute_metrics(trial, study, work.path()));
    if (!scouted) all_forces.add(trial);
    page.trials.push_back(
        page_trial(trial, plan::make_introducer(study, candidates[id]).direction));
    simulate::TrialResult& end = report.trials.emplace_back();
    end.outcome = trial.outcome;
    end.reason = trial.reason;
    end.terms = trial.terms;
  }

  // Rank; find errors by refining, and rank with these, until no other error matters.
  const Case& given = work.given();
  plan::Findings findings;
  for (std::size_t id = 0; id < candidates.size(); ++id) {
    findings.scouted.push_back(report.is_scouted(id));
  }
  const auto rank = [&] {
    report.ranking = plan::rank(study, candidates, report.trials, report.metrics, given.limits,
                                given.weights, findings);
  };
  rank();
  const plan::BatchOptions batch{
      .threads = work.options().threads, .progress = {}, .cancelled = work.options().cancelled};
  const auto refine = [&] {
    for (;;) {
      const std::vector<int> chosen =
          plan::choose_plans_to_refine(report.ranking, report.refinements, {});
      if (chosen.empty()) return;
      const auto found =
          plan::refine_plans(study, candidates, report.metrics, chosen, work.model(), batch);
      report.refinements.insert(report.refinements.end(), found.begin(), found.end());
      findings.errors =
          plan::errors_by_trial(report.refinements, static_cast<int>(candidates.size()));
      rank();
    }
  };
  refine();

  // Repeat the best under disturbances until the best are repeated ones, the very best at least;
  // then what is best, as often as the case asks for, and what has come up by that.
  Repeats repeats = prepare_repeats(work, work.given().robustness.repeats);
  const auto repeat_best = [&](int count, int rounds) {
    for (int round = 0; count > 0; ++round) {
      // In the end the first, and the best of each wire, alone.
      const std::vector<int> chosen = plan::choose_plans_to_repeat(
          report.ranking, repeats.plans, round < rounds ? repeats.options.plans : 1, count);
      if (chosen.empty()) break;
      add_repeats(work, candidates, chosen, count, repeats);
      findings.repeated = repeats.plans;
      rank();
    }
  };
  const int asked = repeats.options.repeats, few = std::min(kFirstRepeats, asked);
  repeat_best(few, kRepeatRounds);
  if (asked > few) {
    repeat_best(asked, 1);
    repeat_best(few, kRepeatRounds);
    repeat_best(asked, 0);
  }
  refine();  // the repeats may have put others first
  report.robustness = robustness_json(repeats);

  // The largest forces on the wall.
  std::vector<preprocess::NamedArray> forces = {{"peak_force_n", all_forces.values()}};
  if (!report.ranking.plans.empty()) {
    ForceMap best(work.surface().triangles.cols());
    best.add(read_trial(work, static_cast<std::size_t>(report.ranking.plans.front().trial)));
    forces.push_back({"peak_force_best_plan_n", best.values()});
  }
  preprocess::write_wall(work.surface(), work.wall(), folder / "forces.vtu", forces);

  // Repeat the best for their shapes on the way.
  const simulate::VesselModel& vessel = work.model();
  const std::vector<int> played = choose_played(report);
  page.insertions.resize(played.size());
  plan::for_each_slot(
      static_cast<int>(played.size()),
      [&](int slot) {
        const int id = played[static_cast<std::size_t>(slot)];
        const plan::Candidate& candidate = candidates[static_cast<std::size_t>(id)];
        simulate::TrialResult trial = plan::run_candidate(study, candidate, vessel);
        if (static_cast<std::size_t>(slot) < std::min(kPlansShown, report.ranking.plans.size())) {
          write_shapes(trial, "plan-" + std::to_string(slot + 1), folder / "trials");
        }
        page.insertions[static_cast<std::size_t>(slot)] = {id, std::move(trial.shapes),
                                                           std::move(trial.peak_forces)};
      },
      batch);
  if (work.options().cancelled && work.options().cancelled()) throw Interrupted();
  write_ranked_markups(report, page, folder / "trials");

  // What people look at.
  const Picture overview = draw_overview(work, report, page);
  write_png(overview, folder / "plans.png");
  if (page_missing().empty()) {
    page.peak_force = all_forces.values();
    page.slices = cut_case_slices(work, forces.back().values);
    page.picture_png = encode_png(overview);
  }
  report.timing = timing_json(work, report.refinements);
  report.timing["repeats"] = {{"cpu_s", repeats.cpu_seconds}};
  report.timing["report_s"] =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Json result = build_report(report);
  if (page_missing().empty()) write_whole(build_page(result, page), folder / "report.html");
  write_whole(trials_csv(result), folder / "trials.csv");
  write_json(result, folder / "report.json");
}

}  // namespace wireplan::pipeline
