#include "plan/rounds.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace wireplan::plan {

Rounds::Rounds(const Study& study, const PlanVessel& vessel,
               const std::vector<Candidate>& candidates, bool exhaustive)
    : study_(study),
      vessel_(vessel),
      candidates_(candidates),
      scouted_(needs_search(study, exhaustive)),
      trials_(candidates.size()),
      levels_(candidates.size(), Level::kFull) {
  if (!scouted_) return;
  seen_.scouts.resize(candidates.size());
  seen_.probes.resize(candidates.size());
  seen_.full.resize(candidates.size());
}

std::vector<Run> Rounds::next() {
  ++round_;
  ids_.clear();
  if (round_ == 1) {
    level_ = scouted_ ? Level::kScout : Level::kFull;
    ids_.resize(candidates_.size());
    std::iota(ids_.begin(), ids_.end(), 0);
  } else if (scouted_) {
    NextRuns runs = choose_next(study_, candidates_, seen_, vessel_.yields);
    level_ = runs.probes.empty() ? Level::kFull : Level::kProbe;
    ids_ = std::move(runs.probes.empty() ? runs.full : runs.probes);
  }
  std::vector<Run> runs;
  for (const int id : ids_) {
    runs.push_back(
        {.level = level_, .id = id, .candidate = candidates_[static_cast<std::size_t>(id)]});
  }
  return runs;
}

void Rounds::take(std::vector<Measured> found) {
  expects(found.size() == ids_.size());
  for (std::size_t n = 0; n < ids_.size(); ++n) {
    const auto k = static_cast<std::size_t>(ids_[n]);
    if (scouted_) {
      const Sighting sighting = look(ids_[n], found[n]);
      if (level_ == Level::kScout) {
        seen_.scouts[k] = sighting;
      } else {
        (level_ == Level::kProbe ? seen_.probes : seen_.full)[k] = sighting;
      }
    }
    trials_[k] = std::move(found[n]);
    levels_[k] = level_;
  }
}

Sighting Rounds::look(int id, const Measured& trial) const {
  const Yardstick yardstick;
  Sighting sighting = look_at(trial, study_, yardstick.limits, yardstick.weights);
  const int wire = candidates_[static_cast<std::size_t>(id)].wire;
  sighting.pinched =
      vessel_.yields && level_ != Level::kFull &&
      is_pinched(trial, study_.wires[static_cast<std::size_t>(wire)].radius, vessel_.path);
  return sighting;
}

FirstAnswer Rounds::first_answer() const {
  expects(round_ == 1 && level_ == Level::kScout);
  FirstAnswer answer;
  answer.trials = static_cast<int>(candidates_.size());
  const auto key = [&](std::size_t k) {
    return std::make_pair(!seen_.scouts[k].plan, seen_.scouts[k].score);
  };
  std::optional<std::size_t> best;
  for (std::size_t k = 0; k < candidates_.size(); ++k) {
    if (!seen_.scouts[k].reached) continue;
    ++answer.reached;
    if (!best || key(k) < key(*best)) best = k;
  }
  if (!best) return answer;
  answer.best = candidates_[*best];
  answer.trial = trials_[*best];
  return answer;
}

std::optional<ScoutSummary> Rounds::scouting() const {
  if (!scouted_) return {};
  const Study scout = study_at(study_, Level::kScout);
  const auto is_known = [](const std::optional<Sighting>& seen) { return seen.has_value(); };
  return ScoutSummary{
      .element_length = scout.insertion.element_length,
      .step = scout.insertion.step,
      .trials = static_cast<int>(candidates_.size()),
      .probed = static_cast<int>(std::count_if(seen_.probes.begin(), seen_.probes.end(), is_known)),
      .error = find_scout_error(seen_.scouts, seen_.full)};
}

}  // namespace wireplan::plan
