#include "pipeline/bench/moving_vessel.h"

#include <algorithm>
#include <memory>

#include "pipeline/bench/bench_report.h"
#include "pipeline/bench/timed_batch.h"
#include "simulate/wall/section_chain.h"

namespace wireplan::pipeline {
namespace {

using simulate::Push;
using simulate::TrialResult;

constexpr double kSupport = 1e-3;  // [N/mm^3]

double pushes_of(const TrialResult& trial) {
  return static_cast<double>(std::max<std::size_t>(1, trial.pushes.size()));
}

double iterations_per_push(const TrialResult& trial) {
  double sum = 0.0;
  for (const Push& push : trial.pushes) sum += push.iterations;
  return sum / pushes_of(trial);
}

}  // namespace

std::vector<Json> time_moving_vessel(const Vessel& vessel, const std::vector<double>& EI,
                                     double length, int repeats) {
  std::vector<simulate::Wire> wires;
  for (const double each : EI) wires.push_back(straight_wire(each, 2.0 * length));
  const InsertionBatch batch =
      make_batch("", vessel, "elastic", wires, {0.0}, {.length = length, .friction = 0.04});
  const SharedModel fixed(vessel, "elastic"), moving(vessel, "elastic");
  moving.vessel_model->sections = std::make_unique<simulate::SectionChain>(
      std::vector<preprocess::Branch>{{.line = vessel.path}},
      simulate::SectionChainOptions{.support = kSupport,
                                    .young_modulus = vessel.wall.young_modulus});
  std::vector<std::vector<double>> fixed_ms(EI.size()), moving_ms(EI.size()), ratio(EI.size());
  BatchTiming held, moved;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    held = time_batch(batch, fixed, {});
    moved = time_batch(batch, moving, {});
    for (std::size_t k = 0; k < EI.size(); ++k) {
      fixed_ms[k].push_back(held.cpu_ms[k]);
      moving_ms[k].push_back(moved.cpu_ms[k]);
      // A wire that leaves the lumen where the vessel stays may go on where it moves.
      ratio[k].push_back((moved.cpu_ms[k] / pushes_of(moved.trials[k])) /
                         (held.cpu_ms[k] / pushes_of(held.trials[k])));
    }
  }
  std::vector<Json> rows;
  for (std::size_t k = 0; k < EI.size(); ++k) {
    rows.push_back({{"bending_stiffness_n_mm2", EI[k]},
                    {"support_kpa_per_mm", kSupport / kMpaPerKpa},
                    {"sections", moving.vessel_model->sections->nodes()},
                    {"cpu_ms_fixed", median(fixed_ms[k])},
                    {"cpu_ms_moving", median(moving_ms[k])},
                    {"times_as_long", median(ratio[k])},
                    {"iterations_fixed", iterations_per_push(held.trials[k])},
                    {"iterations_moving", iterations_per_push(moved.trials[k])},
                    {"outcome_fixed", simulate::outcome_name(held.trials[k].outcome)},
                    {"outcome_moving", simulate::outcome_name(moved.trials[k].outcome)},
                    {"moved_mm", moved.trials[k].sections.colwise().norm().maxCoeff()}});
  }
  return rows;
}

Json moving_aim(const std::vector<Json>& rows) {
  double worst = 0.0;
  for (const Json& row : rows) worst = std::max(worst, row.at("times_as_long").get<double>());
  return aim_row("a trial in a vessel that moves as a whole against one that does not, worst row",
                 "at most 1.5", worst);
}

}  // namespace wireplan::pipeline
