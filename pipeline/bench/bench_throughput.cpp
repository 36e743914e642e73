// How many insertions a core does in a second, and how good they are: residual, penetration and
// error of the tip beside every speed.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <set>

#include "pipeline/bench/bench_report.h"
#include "pipeline/bench/bench_walls.h"
#include "pipeline/bench/coaxial_manoeuvres.h"
#include "pipeline/bench/moving_vessel.h"
#include "pipeline/bench/opened_case.h"
#include "pipeline/bench/throughput_results.h"
#include "pipeline/bench/timed_batch.h"
#include "preprocess/wall/wall.h"

namespace wireplan::pipeline {
namespace {

using simulate::InsertionOptions;
using simulate::Push;
using simulate::TrialResult;
using simulate::Wire;

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
  int copies;      // of each insertion in a batch, for the threads to share
  int repeats;     // of each batch
  double coaxial;  // push of a catheter and of a wire                                  [mm]
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
                    .repeats = 7,
                    .coaxial = 600.0};
const Size kQuick = {.tree_edge = 4.0,
                     .length = 60.0,
                     .EI = {50.0, 521.0},
                     .rolls = {0.0},
                     .elements = {2.0, 1.0},
                     .finest = 0.5,
                     .s_pushes = {1.0, 5.0},
                     .s_EI = {521.0},
                     .copies = 1,
                     .repeats = 1,
                     .coaxial = 40.0};

/// The vessel of a case, made by its own stages and kept in the store.
Vessel vessel_of_case(const Case& given, const std::filesystem::path& cache) {
  const OpenedCase opened = open_case(given, cache);
  return {opened.work->surface(), opened.work->path(), opened.work->wall()};
}

// ---------------------------------------------------------------- rows

double peak_contact_force(const TrialResult& trial) {
  double peak = 0.0;
  for (const Push& push : trial.pushes) peak = std::max(peak, push.peak_contact_force);
  return peak;
}

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

/// Which of a batch's candidates a row is about, and on how many threads.
struct Part {
  std::size_t first = 0, count = 0;
  int threads = 1;
};

Json row_of(const InsertionBatch& batch, const BatchTiming& timing,
            const std::vector<TrialResult>& finer, const Part& part) {
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
      two ? Json() : number_or_null(1e3 * cpu_ms / static_cast<double>(figures.pushes));
  row["speedup"] = two ? Json(median(speedup)) : Json();
  row["speedup_min"] = two ? Json(*least) : Json();
  row["speedup_max"] = two ? Json(*most) : Json();
  row["residual_n"] = figures.residual;
  row["max_penetration_mm"] = figures.penetration;
  row["position_error_mm"] = number_or_null(figures.error);
  row["iterations_per_push"] =
      number_or_null(static_cast<double>(figures.iterations) / static_cast<double>(figures.pushes));
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

void tell(const Json& row) { std::cout << line_of(row) << std::flush; }

void add_row(Json row, ThroughputResults& results) {
  tell(row);
  results.rows.push_back(std::move(row));
}

// ---------------------------------------------------------------- what is run

/// Straight and curved wires against either wall, over the element lengths.
void run_vessel(const std::string& name, const Vessel& vessel, const Size& size,
                ThroughputResults& results) {
  std::vector<Wire> straight;
  for (const double EI : size.EI) straight.push_back(straight_wire(EI, 2.0 * size.length));
  for (const char* wall : {"rigid", "elastic"}) {
    const SharedModel model(vessel, wall);
    for (const bool curved : {false, true}) {
      const std::vector<Wire> wires =
          curved ? std::vector<Wire>{curved_wire(2.0 * size.length)} : straight;
      InsertionBatch batch = make_batch(name, vessel, wall, wires, size.rolls,
                                        {.length = size.length, .friction = 0.04});
      std::vector<BatchTiming> timings;
      for (const double element_length : size.elements) {
        batch.study.insertion.element_length = element_length;
        timings.push_back(time_batch(
            batch, model, {.repeats = size.repeats, .threads = 2, .copies = size.copies}));
      }
      // Last, for it would find responses of the wall that the batches are to show the cost of.
      const std::vector<TrialResult> finer = run_finer(batch, model, size.finest);
      for (std::size_t e = 0; e < size.elements.size(); ++e) {
        batch.study.insertion.element_length = size.elements[e];
        const BatchTiming& timing = timings[e];
        const std::size_t count = batch.candidates.size();
        for (const int threads : {1, 2}) {
          add_row(row_of(batch, timing, finer, {.count = count, .threads = threads}), results);
        }
        for (std::size_t k = 0; !curved && k < count; ++k) {
          add_row(row_of(batch, timing, finer, {.first = k, .count = 1}), results);
        }
        results.same = results.same && timing.same;
      }
    }
  }
}

constexpr int kPaperTriangles = 5472;

/// The largest distance between two of the tips.
Json compare_pushes(double EI, bool fine_tip, const std::vector<TrialResult>& ends) {
  double apart = 0.0;
  for (const TrialResult& a : ends) {
    for (const TrialResult& b : ends) apart = std::max(apart, tip_distance(a, b));
  }
  Json entry;
  entry["elements"] = fine_tip ? "10.9 mm, 0.7 mm in the last 15 mm" : "240 over 450 mm";
  entry["bending_stiffness_n_mm2"] = EI;
  entry["tips_apart_mm"] = number_or_null(apart);
  return entry;
}

/// Beside BeamAdapter: 240 elements over 450 mm, or long ones behind a fine tip.
void run_s_tube(const Size& size, ThroughputResults& results) {
  const Vessel vessel = make_s_tube();
  const SharedModel model(vessel, "rigid");
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
          const InsertionBatch batch = make_batch(kSTube, vessel, "rigid", {wire}, {0.0}, options);
          const BatchTiming timing = time_batch(batch, model, {.repeats = size.repeats});
          add_row(row_of(batch, timing, finer, {.count = 1}), results);
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
                     const Size& size, ThroughputResults& results) {
  for (const char* wall : {"rigid", "elastic"}) {
    const InsertionBatch batch =
        make_batch(name, vessel, wall, {wire}, {0.0}, {.length = length, .element_length = 2.0});
    const SharedModel model(vessel, wall);
    const BatchTiming timing = time_batch(batch, model, {.repeats = size.repeats});
    const std::vector<TrialResult> finer = run_finer(batch, model, size.finest);
    add_row(row_of(batch, timing, finer, {.count = 1}), results);
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

/// The names of rows that are asked for, checked.
std::set<std::string> rows_asked_for(const BenchOptions& options) {
  const std::set<std::string> known = {"vessel", "s-tube", "paper", "moving", "coaxial"};
  for (const std::string& name : options.rows) {
    if (known.count(name) > 0) continue;
    throw Error("bench: throughput is asked for the rows '" + name +
                "', expected some of vessel, s-tube, paper, moving and coaxial, or none for all of "
                "them");
  }
  if (options.rows.empty()) return known;
  std::set<std::string> rows(options.rows.begin(), options.rows.end());
  if (!options.case_path.empty() &&
      rows.count("vessel") + rows.count("paper") + rows.count("moving") == 0) {
    throw Error("bench: --case is '" + options.case_path +
                "', expected none: it is the vessel of the rows vessel, paper and moving alone");
  }
  return rows;
}

/// Of a case, whose name it takes, or made here.
Vessel vessel_of(const BenchOptions& options, const Size& size, std::string& name) {
  if (options.case_path.empty()) return make_arterial_tree(size.tree_edge);
  const Case given = read_case(options.case_path, options.overrides);
  name = given.name;
  return vessel_of_case(given, options.cache);
}

/// The paper's tube, and where there is a case what its Fig. 6 asks for: a real artery.
void run_paper(const Vessel* artery, const Size& size, ThroughputResults& results,
               std::vector<BenchSurface>& surfaces) {
  const Vessel tube = make_paper_tube();
  run_paper_scene(kPaperTube, tube, paper_wire(), 36.0, size, results);
  surfaces.push_back({kPaperTube, tube.surface});
  if (artery == nullptr) return;
  Vessel coarse{
      .surface = decimate(artery->surface, kPaperTriangles), .path = artery->path, .wall = {}};
  coarse.wall = preprocess::extrude_wall(coarse.surface, {}).wall;
  run_paper_scene(kPaperArtery, coarse, straight_wire(521.0, 400.0), 200.0, size, results);
  surfaces.push_back({kPaperArtery, coarse.surface});
}

}  // namespace

BenchReport bench_throughput(const BenchOptions& options) {
  const Size& size = options.quick ? kQuick : kFull;
  const std::set<std::string> asked = rows_asked_for(options);
  const auto wanted = [&](const char* rows) { return asked.count(rows) > 0; };
  const bool of_case = !options.case_path.empty();
  ThroughputResults results;
  BenchReport report;
  std::string surface = "arterial-tree";
  Vessel vessel;
  if (wanted("vessel") || wanted("moving") || of_case) vessel = vessel_of(options, size, surface);
  if (wanted("vessel")) {
    run_vessel(surface, vessel, size, results);
    report.surfaces.push_back({surface, vessel.surface});
  }
  if (wanted("s-tube")) run_s_tube(size, results);
  if (wanted("paper")) run_paper(of_case ? &vessel : nullptr, size, results, report.surfaces);
  std::vector<Json> moving, coaxial;
  if (wanted("moving")) moving = time_moving_vessel(vessel, size.EI, size.length, size.repeats);
  if (wanted("coaxial")) coaxial = time_coaxial_manoeuvres(size.coaxial, tell);

  report.description = describe_throughput(surface, size.length, size.finest);
  const bool inserted = !results.rows.empty();
  std::vector<Json> aims;
  if (!options.quick) {  // which is too short to hold against them
    if (inserted) aims = list_throughput_aims(results);
    if (!moving.empty()) aims.push_back(moving_aim(moving));
    for (const Json& aim : list_coaxial_aims(coaxial)) aims.push_back(aim);
  }
  report.results = {{"aims", Json::array()},
                    {"s_tube", results.s_tube},
                    {"coaxial", coaxial},
                    {"moving_vessel", moving},
                    {"same_on_two_threads", results.same}};
  std::vector<Json> found;  // aims of rows that are not asked for are not
  for (const Json& aim : aims) {
    if (options.rows.empty() || !aim.at("found").is_null()) found.push_back(aim);
  }
  for (const Json& aim : found) report.results["aims"].push_back(aim);
  report.plot = plot_throughput(results.rows, moving, coaxial, surface);
  report.text = "\n";
  for (const std::vector<Json>& table :
       {shorten_throughput(results.rows), results.s_tube, moving, coaxial, found}) {
    if (!table.empty()) report.text += table_text(table) + "\n";
  }
  if (inserted) {
    report.text += std::string("On one thread and on two ") +
                   (results.same ? "the same to the last bit\n" : "NOT THE SAME\n");
  } else {
    report.results["same_on_two_threads"] = nullptr;
  }
  report.rows = inserted           ? std::move(results.rows)
                : !coaxial.empty() ? std::move(coaxial)
                                   : std::move(moving);
  return report;
}

}  // namespace wireplan::pipeline
