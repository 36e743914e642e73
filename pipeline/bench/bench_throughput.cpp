// How many insertions a core does in a second, and how good they are: residual, penetration and
// error of the tip beside every speed.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "pipeline/bench/bench_report.h"
#include "pipeline/bench/bench_walls.h"
#include "pipeline/files/text.h"
#include "pipeline/report/plot.h"
#include "pipeline/stages/stages.h"
#include "plan/batch.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/wall/wall.h"

namespace wireplan::pipeline {
namespace {

using simulate::InsertionOptions;
using simulate::Push;
using simulate::TrialResult;
using simulate::VesselModel;
using simulate::Wire;

constexpr double kWireRadius = 0.4445;  // of 0.035 inch                                [mm]
constexpr double kTangentSpan = 10.0;   // of the path that the introducer follows      [mm]

/// How much of it all is run.
struct Size {
  double tree_edge;              // of the vessel made in code                          [mm]
  double length;                 // of an insertion                                     [mm]
  std::vector<double> EI;        // of the straight wires                               [N mm^2]
  std::vector<double> rolls;     // of the curved wire                                  [rad]
  std::vector<double> elements;  // their lengths                                       [mm]
  double finest;                 // elements that the error of the tip counts from      [mm]
  std::vector<double> s_pushes;  // in the S-tube                                       [mm]
  std::vector<double> s_EI;
  int copies;   // of each insertion in a batch, for the threads to share
  int repeats;  // of each batch
};

const double kQuarter = 0.5 * kPi;
const Size kFull = {.tree_edge = 1.6,
                    .length = 290.0,
                    .EI = {5.0, 50.0, 521.0, 1849.0, 4857.0},
                    .rolls = {0.0, kQuarter, 2.0 * kQuarter, 3.0 * kQuarter},
                    .elements = {2.0, 1.0, 0.5},
                    .finest = 0.25,
                    .s_pushes = {0.2, 1.0, 5.0},
                    .s_EI = {50.0, 521.0},
                    .copies = 4,
                    .repeats = 7};
const Size kQuick = {.tree_edge = 4.0,
                     .length = 60.0,
                     .EI = {50.0, 521.0},
                     .rolls = {0.0},
                     .elements = {2.0, 1.0},
                     .finest = 0.5,
                     .s_pushes = {1.0, 5.0},
                     .s_EI = {521.0},
                     .copies = 1,
                     .repeats = 1};

// ---------------------------------------------------------------- what is run

/// Insertions into one vessel that differ in the wire or its roll.
struct Batch {
  std::string surface, wall, wire;  // as the rows name them
  const Vessel* vessel = nullptr;
  plan::Study study{};
  std::vector<plan::Candidate> candidates{};
};

Wire straight_wire(double EI, double length) {
  return {.name = "straight",
          .radius = kWireRadius,
          .sections = {{.length = length, .bending_stiffness = EI}}};
}

Wire curved_wire(double length) {
  return {.name = "curved",
          .radius = kWireRadius,
          .sections = {{.length = 15.0, .bending_stiffness = 5.0, .rest_curvature = 1.0 / 12.0},
                       {.length = 30.0, .bending_stiffness = 50.0},
                       {.length = length - 45.0, .bending_stiffness = 521.0}}};
}

/// Along the start of the vessel's path, with no goal to stop at.
Batch make_batch(const std::string& surface, const Vessel& vessel, const std::string& wall,
                 const std::vector<Wire>& wires, const std::vector<double>& rolls,
                 const InsertionOptions& options) {
  Batch batch{.surface = surface, .wall = wall, .wire = wires.front().name, .vessel = &vessel};
  plan::Study& study = batch.study;
  study.wires = wires;
  study.inclinations = study.azimuths = {0.0};
  study.rolls = rolls;
  study.access = vessel.path.points.col(0);
  study.tangent = preprocess::start_tangent(vessel.path, kTangentSpan);
  constexpr double kFarAway = 1e6;  // [mm]
  study.goal = {.point = study.access - kFarAway * study.tangent, .radius = 1.0};
  study.insertion = options;
  study.insertion.record_every = options.length;  // no shapes on the way
  batch.candidates = plan::list_candidates(study);
  return batch;
}

/// A vessel model that every batch against the same wall shares, and the CPU time that it took.
struct Model {
  Model(const Vessel& vessel, const std::string& wall) {
    const double start = thread_milliseconds();
    const simulate::LumenOptions options = simulate::follow(vessel.surface);
    vessel_model = wall == "elastic"
                       ? std::make_unique<VesselModel>(vessel.surface, vessel.wall, options)
                       : std::make_unique<VesselModel>(vessel.surface, options);
    build_ms = thread_milliseconds() - start;
  }
  std::unique_ptr<VesselModel> vessel_model{};
  double build_ms = 0.0;
};

/// The vessel of a case, made by its own stages and kept in the store.
Vessel vessel_of_case(const Case& given, const std::filesystem::path& cache) {
  RunOptions options;
  options.cache = cache.empty() ? Store::default_root() : cache;
  options.to = "wall";
  Workspace work(given, options.work, Store(options.cache));
  const RunResult result = run_stages(given, options);
  for (const Artifact& artifact : result.artifacts) work.add(artifact);
  return {work.surface(), work.path(), work.wall()};
}

// ---------------------------------------------------------------- what it takes

/// The error of the tip is its distance from that of a finer insertion, when as much wire is in as
/// the shorter of the two brought in. Not finite where nothing went in.
Vec3 tip_at(const TrialResult& trial, double insertion) {
  const auto next = std::find_if(trial.pushes.begin(), trial.pushes.end(), [&](const Push& push) {
    return push.insertion >= insertion * (1.0 - 1e-12);
  });
  expects(next != trial.pushes.end());
  if (next == trial.pushes.begin()) return next->tip;
  const Push& before = *(next - 1);
  const double part = (insertion - before.insertion) / (next->insertion - before.insertion);
  return before.tip + std::min(1.0, part) * (next->tip - before.tip);
}

double tip_distance(const TrialResult& a, const TrialResult& b) {
  if (a.pushes.empty() || b.pushes.empty()) return std::nan("");
  const double insertion = std::min(a.pushes.back().insertion, b.pushes.back().insertion);
  return (tip_at(a, insertion) - tip_at(b, insertion)).norm();
}

double peak_contact_force(const TrialResult& trial) {
  double peak = 0.0;
  for (const Push& push : trial.pushes) peak = std::max(peak, push.peak_contact_force);
  return peak;
}

/// Times of a batch that ran several times.
struct Timing {
  std::vector<double> cpu_ms{};  // median per candidate, on one thread
  std::vector<double> one_s{};   // of the whole batch by the clock on the wall, on one thread ...
  std::vector<double> two_s{};   // ... and on two
  double build_ms = 0.0;         // of the vessel model, CPU time
  double warm_up_ms = 0.0;       // that the first insertions took longer than later ones
  bool same = true;              // every copy gave the same bits, on one thread and on two
  std::vector<TrialResult> trials{};  // one per candidate
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

bool same_bits(const TrialResult& a, const TrialResult& b) {
  return a.outcome == b.outcome && a.pushes.size() == b.pushes.size() && a.nodes == b.nodes &&
         (a.pushes.empty() || (a.pushes.back().push_force == b.pushes.back().push_force &&
                               a.pushes.back().residual == b.pushes.back().residual));
}

/// Runs the batch on one thread and, with `threads` 2, on two in turns.
Timing time_batch(const Batch& batch, const Model& model, const Size& size, int threads) {
  Timing timing;
  timing.build_ms = model.build_ms;
  const VesselModel& vessel = *model.vessel_model;

  // The first time, a wall that yields finds its responses.
  plan::BatchResult first = run_batch(batch.study, batch.candidates, vessel, {.threads = 1});
  std::vector<plan::Candidate> candidates;
  const int copies = threads > 1 ? size.copies : 1;
  for (int copy = 0; copy < copies; ++copy) {
    candidates.insert(candidates.end(), batch.candidates.begin(), batch.candidates.end());
  }

  std::vector<std::vector<double>> cpu_ms(batch.candidates.size());
  for (int repeat = 0; repeat < size.repeats; ++repeat) {
    for (int count = 1; count <= threads; ++count) {
      const auto begin = std::chrono::steady_clock::now();
      const plan::BatchResult result =
          run_batch(batch.study, candidates, vessel, {.threads = count});
      (count == 1 ? timing.one_s : timing.two_s).push_back(seconds_since(begin));
      for (std::size_t k = 0; k < candidates.size(); ++k) {
        const std::size_t candidate = k % batch.candidates.size();
        timing.same = timing.same && same_bits(result.trials[k], first.trials[candidate]);
        if (count == 1) cpu_ms[candidate].push_back(1e3 * result.cpu_seconds[k]);
      }
    }
  }
  for (std::size_t k = 0; k < cpu_ms.size(); ++k) {
    timing.cpu_ms.push_back(median(cpu_ms[k]));
    timing.warm_up_ms += 1e3 * first.cpu_seconds[k] - timing.cpu_ms[k];
  }
  timing.trials = std::move(first.trials);
  return timing;
}

// ---------------------------------------------------------------- rows

/// What insertions came to: sums over all, and the largest.
struct Figures {
  long pushes = 0, iterations = 0;
  int max_iterations = 0, cut_pushes = 0, not_converged = 0;
  double inserted = 0.0;  // [mm]
  double residual = 0.0, penetration = 0.0, contact_force = 0.0, push_force = 0.0;
  double wall_displacement = 0.0, error = 0.0, force_error = 0.0;
  std::map<std::string, int> outcomes{};
  std::string reason{};  // of the first that did not converge, or failed

  void add(const TrialResult& trial, const TrialResult& finer, double step) {
    double before = 0.0;
    for (const Push& push : trial.pushes) {
      ++pushes;
      iterations += push.iterations;
      max_iterations = std::max(max_iterations, push.iterations);
      if (push.insertion - before < 0.99 * step) ++cut_pushes;
      before = push.insertion;
      residual = std::max(residual, push.residual);
      penetration = std::max(penetration, push.max_penetration);
      push_force = std::max(push_force, std::abs(push.push_force));
      wall_displacement = std::max(wall_displacement, push.wall_displacement);
    }
    inserted += before;
    ++outcomes[simulate::outcome_name(trial.outcome)];
    const bool unsolved = trial.outcome == simulate::Outcome::kNotConverged ||
                          trial.outcome == simulate::Outcome::kFailed;
    if (unsolved && not_converged++ == 0) reason = trial.reason;
    error = std::max(error, tip_distance(trial, finer));
    const double peak = peak_contact_force(trial);
    contact_force = std::max(contact_force, peak);
    force_error = std::max(force_error, std::abs(peak - peak_contact_force(finer)));
  }
};

/// A number, or null where it is not one.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

/// Which of a batch's candidates a row is about, and on how many threads.
struct Part {
  std::size_t first = 0, count = 0;
  int threads = 1;
};

Json row_of(const Batch& batch, const Timing& timing, const std::vector<TrialResult>& finer,
            const Part& part) {
  const InsertionOptions& options = batch.study.insertion;
  const bool whole = part.count == batch.candidates.size();
  Figures figures;
  double cpu_ms = 0.0;
  for (std::size_t k = part.first; k < part.first + part.count; ++k) {
    figures.add(timing.trials[k], finer[k], options.step);
    cpu_ms += timing.cpu_ms[k];
  }
  const double count = static_cast<double>(part.count);
  std::vector<double> speedup;
  for (std::size_t k = 0; k < timing.two_s.size(); ++k) {
    speedup.push_back(timing.one_s[k] / timing.two_s[k]);
  }
  const auto [least, most] = std::minmax_element(speedup.begin(), speedup.end());
  const bool two = part.threads == 2;
  const double per_core = count / (1e-3 * cpu_ms) * (two ? 0.5 * median(speedup) : 1.0);
  const Wire& wire = batch.study.wires[batch.candidates[part.first].wire];
  std::string outcomes;
  for (const auto& [name, times] : figures.outcomes) {
    outcomes += (outcomes.empty() ? "" : " ") + name + " " + std::to_string(times);
  }

  Json row;
  row["surface"] = batch.surface;
  row["triangles"] = batch.vessel->surface.triangles.cols();
  row["wall"] = batch.wall;
  row["wire"] = batch.wire;
  row["bending_stiffness_n_mm2"] =
      part.count == 1 ? Json(wire.sections.back().bending_stiffness) : Json();
  row["element_length_mm"] = options.section_element_length.empty()
                                 ? options.element_length
                                 : options.section_element_length.back();
  row["tip_element_length_mm"] = options.section_element_length.empty()
                                     ? options.element_length
                                     : options.section_element_length.front();
  row["contact_spacing_mm"] = options.contact_spacing;
  row["residual_tolerance_n"] = options.residual_tolerance;
  row["push_mm"] = options.step;
  row["friction"] = options.friction;
  row["threads"] = part.threads;
  row["insertions"] = part.count;
  row["inserted_mm"] = figures.inserted / count;
  row["outcomes"] = outcomes;
  row["insertions_per_second_per_core"] = per_core;
  row["cpu_ms_per_insertion"] = two ? Json() : Json(cpu_ms / count);
  row["cpu_us_per_push"] =
      two ? Json() : number(1e3 * cpu_ms / static_cast<double>(figures.pushes));
  row["speedup"] = two ? Json(median(speedup)) : Json();
  row["speedup_min"] = two ? Json(*least) : Json();
  row["speedup_max"] = two ? Json(*most) : Json();
  row["residual_n"] = figures.residual;
  row["max_penetration_mm"] = figures.penetration;
  row["position_error_mm"] = number(figures.error);
  row["iterations_per_push"] =
      number(static_cast<double>(figures.iterations) / static_cast<double>(figures.pushes));
  row["max_iterations_per_push"] = figures.max_iterations;
  row["cut_pushes"] = figures.cut_pushes;
  row["not_converged"] = figures.not_converged;
  row["peak_contact_force_n"] = figures.contact_force;
  row["peak_contact_force_error_n"] = figures.force_error;
  row["peak_push_force_n"] = figures.push_force;
  row["wall_displacement_mm"] = figures.wall_displacement;
  row["model_build_ms"] = whole ? Json(timing.build_ms) : Json();
  row["warm_up_ms"] = whole ? Json(timing.warm_up_ms) : Json();
  row["reason"] = figures.reason;
  return row;
}

/// The columns that fit a terminal.
std::vector<Json> shorten(const std::vector<Json>& rows) {
  const std::vector<std::pair<const char*, const char*>> columns = {
      {"surface", "surface"},
      {"wall", "wall"},
      {"wire", "wire"},
      {"bending_stiffness_n_mm2", "EI"},
      {"element_length_mm", "h mm"},
      {"contact_spacing_mm", "points mm"},
      {"push_mm", "push mm"},
      {"threads", "threads"},
      {"insertions_per_second_per_core", "1/s/core"},
      {"speedup", "speedup"},
      {"inserted_mm", "in mm"},
      {"residual_n", "residual N"},
      {"max_penetration_mm", "penetration mm"},
      {"position_error_mm", "error mm"},
      {"peak_contact_force_error_n", "force error N"},
      {"iterations_per_push", "it./push"},
      {"max_iterations_per_push", "worst"},
      {"outcomes", "outcomes"}};
  std::vector<Json> table;
  for (const Json& row : rows) {
    Json& line = table.emplace_back();
    for (const auto& [key, title] : columns) line[title] = row.at(key);
  }
  return table;
}

/// The batch again, of finer elements and pushes of 1 mm.
std::vector<TrialResult> run_finer(Batch batch, const Model& model, double element_length) {
  batch.study.insertion.section_element_length.clear();
  batch.study.insertion.element_length = element_length;
  batch.study.insertion.step = 1.0;
  return run_batch(batch.study, batch.candidates, *model.vessel_model, {}).trials;
}

/// All that ran; whether copies agreed; and how far apart pushes of different lengths end.
struct Results {
  std::vector<Json> rows{};
  bool same = true;
  std::vector<Json> s_tube{};
};

/// Straight and curved wires against either wall, over the element lengths.
void run_vessel(const std::string& name, const Vessel& vessel, const Size& size, Results& results) {
  std::vector<Wire> straight;
  for (const double EI : size.EI) straight.push_back(straight_wire(EI, 2.0 * size.length));
  for (const char* wall : {"rigid", "elastic"}) {
    const Model model(vessel, wall);
    for (const bool curved : {false, true}) {
      const std::vector<Wire> wires =
          curved ? std::vector<Wire>{curved_wire(2.0 * size.length)} : straight;
      Batch batch = make_batch(name, vessel, wall, wires, size.rolls,
                               {.length = size.length, .friction = 0.04});
      std::vector<Timing> timings;
      for (const double element_length : size.elements) {
        batch.study.insertion.element_length = element_length;
        timings.push_back(time_batch(batch, model, size, 2));
      }
      // Last, for it would find responses of the wall that the batches are to show the cost of.
      const std::vector<TrialResult> finer = run_finer(batch, model, size.finest);
      for (std::size_t e = 0; e < size.elements.size(); ++e) {
        batch.study.insertion.element_length = size.elements[e];
        const Timing& timing = timings[e];
        const std::size_t count = batch.candidates.size();
        for (const int threads : {1, 2}) {
          results.rows.push_back(
              row_of(batch, timing, finer, {.count = count, .threads = threads}));
        }
        for (std::size_t k = 0; !curved && k < count; ++k) {
          results.rows.push_back(row_of(batch, timing, finer, {.first = k, .count = 1}));
        }
        results.same = results.same && timing.same;
      }
    }
  }
}

constexpr const char* kSTube = "s-tube";
constexpr const char* kPaperTube = "paper-tube";
constexpr const char* kPaperArtery = "paper-artery";
constexpr int kPaperTriangles = 5472;

/// How well the S-tube is solved: as cases are by default, and as well as the forces there need, in
/// a tube that has no ridge for points further apart to miss.
struct Care {
  double residual_tolerance;  // [N]
  double contact_spacing;     // [mm]
  std::string text() const {
    return format("%g N, points %g mm apart", residual_tolerance, contact_spacing);
  }
};
const std::vector<Care> kCares = {{1e-6, 1.0}, {1e-3, 6.0}};

/// The largest distance between two of the tips.
Json compare_pushes(double EI, bool fine_tip, const std::vector<TrialResult>& ends) {
  double apart = 0.0;
  for (const TrialResult& a : ends) {
    for (const TrialResult& b : ends) apart = std::max(apart, tip_distance(a, b));
  }
  Json entry;
  entry["elements"] = fine_tip ? "10.9 mm, 0.7 mm in the last 15 mm" : "240 over 450 mm";
  entry["bending_stiffness_n_mm2"] = EI;
  entry["tips_apart_mm"] = number(apart);
  return entry;
}

/// Beside BeamAdapter: 240 elements over 450 mm, or long ones behind a fine tip.
void run_s_tube(const Size& size, Results& results) {
  const Vessel vessel = make_s_tube();
  const Model model(vessel, "rigid");
  for (const double EI : size.s_EI) {
    Wire wire = straight_wire(EI, 450.0);
    InsertionOptions options{.length = 300.0, .friction = 0.1};
    const std::vector<TrialResult> finer =
        run_finer(make_batch(kSTube, vessel, "rigid", {wire}, {0.0}, options), model, size.finest);
    for (const bool fine_tip : {false, true}) {
      options.element_length = 450.0 / 240.0;
      if (fine_tip) {
        wire.sections = {{.length = 15.0, .bending_stiffness = EI},
                         {.length = 435.0, .bending_stiffness = EI}};
        options.section_element_length = {0.7, 10.9};
      }
      std::vector<TrialResult> ends;
      for (const Care& care : kCares) {
        options.residual_tolerance = care.residual_tolerance;
        options.contact_spacing = care.contact_spacing;
        for (const double push : size.s_pushes) {
          options.step = push;
          const Batch batch = make_batch(kSTube, vessel, "rigid", {wire}, {0.0}, options);
          const Timing timing = time_batch(batch, model, size, 1);
          results.rows.push_back(row_of(batch, timing, finer, {.count = 1}));
          results.same = results.same && timing.same;
          ends.push_back(timing.trials.front());
        }
      }
      results.s_tube.push_back(compare_pushes(EI, fine_tip, ends));
    }
  }
}

/// One wire against either wall, in elements of 2 mm.
void run_paper_scene(const std::string& name, const Vessel& vessel, const Wire& wire, double length,
                     const Size& size, Results& results) {
  for (const char* wall : {"rigid", "elastic"}) {
    const Batch batch =
        make_batch(name, vessel, wall, {wire}, {0.0}, {.length = length, .element_length = 2.0});
    const Model model(vessel, wall);
    const Timing timing = time_batch(batch, model, size, 1);
    const std::vector<TrialResult> finer = run_finer(batch, model, size.finest);
    results.rows.push_back(row_of(batch, timing, finer, {.count = 1}));
    results.same = results.same && timing.same;
  }
}

/// The wire of the paper's Fig. 5: k_b = 1e5 N/m and k_s = 1e12 N/m^3 of 20 elements, which are
/// taken to be 2 mm long as those of its Fig. 4.
Wire paper_wire() {
  return {.name = "straight",
          .radius = 0.4,
          .sections = {{.length = 40.0, .bending_stiffness = 800.0, .axial_stiffness = 16000.0}}};
}

// ---------------------------------------------------------------- what came out

/// Rows that the condition holds for.
template <typename Condition>
std::vector<Json> select(const std::vector<Json>& rows, const Condition& condition) {
  std::vector<Json> selected;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(selected), condition);
  return selected;
}

/// Of the rows that have it; null where none has.
Json largest(const std::vector<Json>& rows, const char* key) {
  Json found;
  for (const Json& row : rows) {
    if (row.at(key).is_null()) continue;
    if (found.is_null() || row.at(key) > found) found = row.at(key);
  }
  return found;
}

Json smallest(const std::vector<Json>& rows, const char* key) {
  Json found;
  for (const Json& row : rows) {
    if (row.at(key).is_null()) continue;
    if (found.is_null() || row.at(key) < found) found = row.at(key);
  }
  return found;
}

bool is_paper_scene(const Json& row) {
  return row.at("surface") == kPaperTube || row.at("surface") == kPaperArtery;
}

/// What is asked of wireplan, beside what these rows say.
std::vector<Json> list_aims(const Results& results) {
  const std::vector<Json>& rows = results.rows;
  std::vector<Json> aims;
  const auto add = [&](const std::string& what, const std::string& aim, const Json& found) {
    Json entry;
    entry["what"] = what;
    entry["aim"] = aim;
    entry["found"] = found;
    aims.push_back(entry);
  };
  const auto in_vessel = [](const Json& row) {
    return row.at("surface") != kSTube && !is_paper_scene(row);
  };
  const std::vector<Json> vessel_rows = select(rows, in_vessel);
  for (const std::string wall : {"rigid", "elastic"}) {
    for (const std::string wire : {"straight", "curved"}) {
      const std::vector<Json> batch = select(vessel_rows, [&](const Json& row) {
        return row.at("wall") == wall && row.at("wire") == wire && row.at("threads") == 1 &&
               row.at("element_length_mm") == 1.0 && !row.at("model_build_ms").is_null();
      });
      const double aim = (wall == "rigid" ? 25.0 : 12.0) * (wire == "curved" ? 2.0 / 3.0 : 1.0);
      add("insertions per second and core, h = 1 mm, " + wall + ", " + wire,
          format("at least %.3g", aim), smallest(batch, "insertions_per_second_per_core"));
    }
  }
  add("two threads against one, least of all rows", "at least 1.9",
      smallest(vessel_rows, "speedup"));
  add("Newton iterations per push, worst row", "at most 5",
      largest(vessel_rows, "iterations_per_push"));
  add("Newton iterations of the worst push", "at most 50",
      largest(vessel_rows, "max_iterations_per_push"));
  add("insertions that did not converge or failed, most of a row", "0",
      largest(rows, "not_converged"));
  for (const Care& care : kCares) {
    for (const bool fine_tip : {false, true}) {
      const std::vector<Json> tube = select(rows, [&](const Json& row) {
        return row.at("surface") == kSTube &&
               row.at("residual_tolerance_n") == care.residual_tolerance &&
               (row.at("element_length_mm") != row.at("tip_element_length_mm")) == fine_tip;
      });
      add((fine_tip ? "S-tube (b), " : "S-tube (a), ") + care.text() + ", worst row, CPU ms",
          fine_tip ? "below 20" : "below 60", largest(tube, "cpu_ms_per_insertion"));
    }
  }
  add("S-tube, tips of pushes of different lengths apart, mm", "at most 0.5",
      largest(results.s_tube, "tips_apart_mm"));
  add("the paper's Fig. 5 and 6, CPU us per push, worst row", "below 1000",
      largest(select(rows, is_paper_scene), "cpu_us_per_push"));
  return aims;
}

Picture plot_of(const std::vector<Json>& rows, const std::string& surface) {
  const std::vector<LegendEntry> legend = {
      {"rigid, straight", Color(0.05F, 0.10F, 0.65F)},
      {"rigid, curved", Color(0.00F, 0.60F, 0.55F)},
      {"elastic, straight", Color(0.75F, 0.10F, 0.55F)},
      {"elastic, curved", Color(0.85F, 0.45F, 0.00F)},
      {"10.9 mm, 0.7 mm at the tip", Color(0.45F, 0.45F, 0.45F)}};
  constexpr double kLeastError = 1e-6;  // [mm] shown
  const char* kTime = "time of one insertion on one core [ms]";
  const char* kError = "tip's distance from that of the finest elements [mm]";
  FrontPlot vessel{surface + ", over the element length", kTime, kError, {}};
  FrontPlot tube{"S-tube, over the length of a push and how well it is solved", kTime, kError, {}};
  for (std::size_t k = 0; k < legend.size(); ++k) {
    vessel.lines.push_back({k, {}});
    tube.lines.push_back({k, {}});
  }
  for (const Json& row : rows) {
    if (row.at("threads") != 1 || row.at("position_error_mm").is_null()) continue;
    const bool curved = row.at("wire") == "curved", elastic = row.at("wall") == "elastic";
    const bool fine_tip = row.at("tip_element_length_mm") != row.at("element_length_mm");
    const std::size_t line = fine_tip ? 4U : (elastic ? 2U : 0U) + (curved ? 1U : 0U);
    const Eigen::Vector2d point(row.at("cpu_ms_per_insertion").get<double>(),
                                std::max(kLeastError, row.at("position_error_mm").get<double>()));
    if (row.at("surface") == surface) vessel.lines[line].points.push_back(point);
    if (row.at("surface") == kSTube) tube.lines[line].points.push_back(point);
  }
  return draw_fronts("Error of the tip against run time", {vessel, tube}, 2, legend);
}

Json describe(const std::string& surface, const Size& size) {
  const std::string finest = format("%g mm", size.finest);
  return {
      {"surfaces",
       {{surface,
         format("%g mm of wire pushed in along the start of the path; no goal", size.length)},
        {kSTube,
         "lumen radius 5 mm, two bends of 90 degrees and radius 60 mm out of one plane, 300 mm of "
         "a wire of 0.889 mm; 240 elements over 450 mm, or 10.9 mm and 0.7 mm in the last 15 mm; "
         "solved as cases are by default and as well as forces in a smooth tube need"},
        {kPaperTube,
         "as the paper's Fig. 5: 1160 triangles, 20 elements with k_b 1e5 N/m and k_s 1e12 N/m^3; "
         "the paper does not tell its measures: radius 3 mm, 65 mm long, a bend of 90 degrees "
         "and radius 30 mm; elements of 2 mm as in its Fig. 4, a wall of 1 MPa and 1 mm, no "
         "friction"},
        {kPaperArtery,
         "as the paper's Fig. 6, with --case only: the vessel of the case, decimated to 5472 "
         "triangles or as near as can be; 200 mm of wire, no friction"}}},
      {"real_time",
       "a time step of the paper is 1 ms and one iteration toward equilibrium; here a push of 1 mm "
       "is taken to equilibrium, and is faster than real time if that takes below 1 ms, in which "
       "the hand would have to move at 1 m/s"},
      {"wires",
       {{"straight", "0.889 mm, EI as the row says, null for all of them together"},
        {"curved",
         "0.889 mm, tip of 15 mm with rest radius 12 mm and EI 5, 30 mm with EI 50, then 521, at "
         "every roll of the hub"}}},
      {"walls",
       {{"rigid", "does not yield"}, {"elastic", "k_n 25 kPa/mm where no case says else"}}},
      {"time",
       "one thread: CPU time of the thread, median over repeats, wall responses already found; two "
       "threads: that, times the ratio of the times of a whole batch by the clock"},
      {"columns",
       {{"position_error_mm",
         "distance of the tip from that of the same insertion with elements of " + finest +
             ", contact points no further apart than 1 mm, and pushes of 1 mm, where as much wire "
             "is "
             "in; the worst of the insertions"},
        {"peak_contact_force_error_n",
         "how far the largest force at a contact is from that of the finer insertion"},
        {"contact_spacing_mm",
         "most between two points of the wire that feel the wall; half of it in the last 20 mm"},
        {"inserted_mm", "mean of the insertions; below what was asked where they ended early"},
        {"residual_n", "largest of all pushes"},
        {"max_penetration_mm", "largest of all pushes"},
        {"not_converged", "insertions that ended so, or failed; reason: of the first of them"},
        {"cut_pushes", "shorter than push_mm, the last of an insertion included"},
        {"model_build_ms", "distance field, and factors of a wall that yields"},
        {"warm_up_ms",
         "that the first insertions of the row took longer, for responses of the wall "
         "that no row above had found"}}}};
}

}  // namespace

BenchReport bench_throughput(const BenchOptions& options) {
  const Size& size = options.quick ? kQuick : kFull;

  // The vessel: of a case, or made here.
  std::string surface = "arterial-tree";
  Vessel vessel;
  if (options.case_path.empty()) {
    vessel = make_arterial_tree(size.tree_edge);
  } else {
    const Case given = read_case(options.case_path, options.overrides);
    surface = given.name;
    vessel = vessel_of_case(given, options.cache);
  }

  Results results;
  run_vessel(surface, vessel, size, results);
  BenchReport report;
  report.surfaces.push_back({surface, vessel.surface});
  run_s_tube(size, results);
  const Vessel tube = make_paper_tube();
  run_paper_scene(kPaperTube, tube, paper_wire(), 36.0, size, results);
  report.surfaces.push_back({kPaperTube, tube.surface});

  // The paper's Fig. 6 asks for a real artery.
  if (!options.case_path.empty()) {
    Vessel artery{
        .surface = decimate(vessel.surface, kPaperTriangles), .path = vessel.path, .wall = {}};
    artery.wall = preprocess::extrude_wall(artery.surface, {}).wall;
    run_paper_scene(kPaperArtery, artery, straight_wire(521.0, 400.0), 200.0, size, results);
    report.surfaces.push_back({kPaperArtery, artery.surface});
  }

  report.description = describe(surface, size);
  // The quick size is too short to hold against them.
  const std::vector<Json> aims = options.quick ? std::vector<Json>{} : list_aims(results);
  report.results = {
      {"aims", Json::array()}, {"s_tube", results.s_tube}, {"same_on_two_threads", results.same}};
  for (const Json& aim : aims) report.results["aims"].push_back(aim);
  report.rows = std::move(results.rows);
  report.text = table_text(shorten(report.rows)) + "\n" + table_text(results.s_tube) + "\n" +
                table_text(aims) + "On one thread and on two " +
                (results.same ? "the same to the last bit\n" : "NOT THE SAME\n");
  report.plot = plot_of(report.rows, surface);
  return report;
}

}  // namespace wireplan::pipeline
