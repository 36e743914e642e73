#include "pipeline/bench/timed_batch.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "pipeline/bench/bench_report.h"
#include "pipeline/files/clock.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/cores.h"

namespace wireplan::pipeline {
namespace {

using simulate::InsertionOptions;
using simulate::Push;
using simulate::TrialResult;
using simulate::VesselModel;
using simulate::Wire;

constexpr double kWireRadius = 0.4445;  // of 0.035 inch                                [mm]
constexpr double kTangentSpan = 10.0;   // of the path that the introducer follows      [mm]

/// Where the tip was when this much wire was in.
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

bool same_bits(const TrialResult& a, const TrialResult& b) {
  return a.outcome == b.outcome && a.pushes.size() == b.pushes.size() && a.nodes == b.nodes &&
         (a.pushes.empty() || (a.pushes.back().push_force == b.pushes.back().push_force &&
                               a.pushes.back().residual == b.pushes.back().residual));
}

}  // namespace

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

InsertionBatch make_batch(const std::string& surface, const Vessel& vessel, const std::string& wall,
                          const std::vector<Wire>& wires, const std::vector<double>& rolls,
                          const InsertionOptions& options) {
  InsertionBatch batch{
      .surface = surface, .wall = wall, .wire = wires.front().name, .vessel = &vessel};
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

SharedModel::SharedModel(const Vessel& vessel, const std::string& wall) {
  const double start = thread_cpu_seconds();
  const simulate::LumenOptions options = simulate::follow(vessel.surface);
  vessel_model = wall == "elastic"
                     ? std::make_unique<VesselModel>(vessel.surface, vessel.wall, options)
                     : std::make_unique<VesselModel>(vessel.surface, options);
  build_ms = 1e3 * (thread_cpu_seconds() - start);
}

BatchTiming time_batch(const InsertionBatch& batch, const SharedModel& model,
                       const TimedRuns& runs) {
  BatchTiming timing;
  timing.build_ms = model.build_ms;
  const VesselModel& vessel = *model.vessel_model;

  // The first time, a wall that yields finds its responses.
  plan::BatchResult first = run_batch(batch.study, batch.candidates, vessel, {.threads = 1});
  std::vector<plan::Candidate> candidates;
  for (int copy = 0; copy < runs.copies; ++copy) {
    candidates.insert(candidates.end(), batch.candidates.begin(), batch.candidates.end());
  }

  std::vector<std::vector<double>> cpu_ms(batch.candidates.size());
  for (int repeat = 0; repeat < runs.repeats; ++repeat) {
    for (int count = 1; count <= runs.threads; ++count) {
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

std::vector<TrialResult> run_finer(InsertionBatch batch, const SharedModel& model,
                                   double element_length) {
  batch.study.insertion.section_element_length.clear();
  batch.study.insertion.element_length = element_length;
  batch.study.insertion.step = 1.0;
  return run_batch(batch.study, batch.candidates, *model.vessel_model, {}).trials;
}

double tip_distance(const TrialResult& a, const TrialResult& b) {
  if (a.pushes.empty() || b.pushes.empty()) return std::nan("");
  const double insertion = std::min(a.pushes.back().insertion, b.pushes.back().insertion);
  return (tip_at(a, insertion) - tip_at(b, insertion)).norm();
}

}  // namespace wireplan::pipeline
