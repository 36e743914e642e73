#include "plan/search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "plan/statistics.h"

namespace wireplan::plan {
namespace {

constexpr double kCoarser = 4.0;          // elements and pushes of a scout
constexpr double kLargestTurn = 1.0 / 3;  // of an element at rest                          [rad]
constexpr double kLongestPush = 2.0;      //                                                [mm]
constexpr double kScoutTolerance = 1e-4;  //                                                [N]
constexpr std::size_t kNoScouting = 8;
constexpr std::size_t kAlways = 5;        // the best so many are run in full
constexpr int kTriesPerWire = 4;          // to find it a plan
constexpr std::size_t kAtOnce = 8;        // while no plan is found ...
constexpr std::size_t kGiveUpAfter = 32;  // ... until so many were run in full, ...
constexpr std::size_t kGiveUpPart = 8;    // ... or one in so many, and none is left that reached
constexpr std::size_t kCheckedPart = 16;  // of those that failed, one in so many is looked at

/// Whether the scout itself may be why the candidate did not reach.
bool is_doubtful(const Sighting& scout, double goal_radius) {
  return !scout.reached && (scout.unclear || scout.nearest <= 2.0 * goal_radius);
}

/// Candidates, the most promising first: by score, and those that did not reach by how near they
/// came.
std::vector<int> order_by_promise(const std::vector<Sighting>& scouts) {
  std::vector<int> order(scouts.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int k) {
    const Sighting& s = scouts[static_cast<std::size_t>(k)];
    return std::tuple(!s.reached, s.reached ? s.score : s.nearest, k);
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  return order;
}

std::vector<double> score_differences(const std::vector<Sighting>& scouts,
                                      const std::vector<std::optional<Sighting>>& full) {
  std::vector<double> sizes;
  for (std::size_t k = 0; k < full.size(); ++k) {
    if (full[k] && full[k]->reached && scouts[k].reached) {
      sizes.push_back(std::abs(full[k]->score - scouts[k].score));
    }
  }
  return sizes;
}

}  // namespace

bool needs_search(const Study& study, bool exhaustive) {
  return !exhaustive && list_candidates(study).size() > kNoScouting;
}

Study scout_study(const Study& study) {
  Study scout = study;
  simulate::InsertionOptions& insertion = scout.insertion;
  double longest = kCoarser * insertion.element_length;
  for (const simulate::Wire& wire : study.wires) {
    for (const simulate::Section& section : wire.sections) {
      if (section.rest_curvature == 0.0) continue;
      longest = std::min(longest, kLargestTurn / std::abs(section.rest_curvature));
    }
  }
  insertion.element_length = std::max(insertion.element_length, longest);
  const double factor = insertion.element_length / study.insertion.element_length;
  for (double& length : insertion.section_element_length) length *= factor;
  insertion.contact_spacing *= std::min(factor, 2.0);
  insertion.step = std::max(
      insertion.step, std::min({kCoarser * insertion.step, kLongestPush, 0.5 * study.goal.radius}));
  insertion.residual_tolerance = std::max(insertion.residual_tolerance, kScoutTolerance);
  return scout;
}

Sighting look_at(const simulate::TrialResult& trial, const Metrics& metrics, const Study& study,
                 const Limits& limits, const Weights& weights) {
  using simulate::Outcome;
  Sighting sighting;
  sighting.reached = metrics.reached;
  sighting.plan = exclusion_reason(trial, metrics, study, limits).empty();
  sighting.unclear = trial.outcome == Outcome::kNotConverged || trial.outcome == Outcome::kFailed;
  if (metrics.reached) sighting.score = compute_score(metrics, study.goal, limits, weights).total;
  sighting.nearest = metrics.nearest_to_target;
  return sighting;
}

std::vector<int> choose_next(const Study& study, const std::vector<Candidate>& candidates,
                             const std::vector<Sighting>& scouts,
                             const std::vector<std::optional<Sighting>>& full) {
  expects(scouts.size() == candidates.size() && full.size() == candidates.size());
  const std::vector<int> order = order_by_promise(scouts);
  const auto scout = [&](int k) -> const Sighting& { return scouts[static_cast<std::size_t>(k)]; };
  const auto wire_of = [&](int k) { return candidates[static_cast<std::size_t>(k)].wire; };
  std::set<int> wanted;

  // The best of all, and failures that may be the scout's.
  std::size_t failed = 0, checked = 0;
  for (const int k : order) failed += scout(k).reached ? 0 : 1;
  for (std::size_t place = 0; place < order.size(); ++place) {
    const int k = order[place];
    if (place < kAlways && scout(k).reached) wanted.insert(k);
    if (is_doubtful(scout(k), study.goal.radius) && checked * kCheckedPart < failed) {
      wanted.insert(k);
      ++checked;
    }
  }

  // Those that may beat the best plan, as far as the scout was off.
  std::optional<double> best;
  for (const std::optional<Sighting>& run : full) {
    if (run && run->plan) best = std::min(best.value_or(run->score), run->score);
  }
  double margin = kScoutMargin;
  for (const double size : score_differences(scouts, full)) margin = std::max(margin, size);
  for (const int k : order) {
    if (best && scout(k).reached && scout(k).score - margin < *best) wanted.insert(k);
  }
  const auto is_known = [&](int k) { return full[static_cast<std::size_t>(k)].has_value(); };

  // Of a wire without a plan its best, whatever it is, then the next that reached.
  std::map<int, int> tries;
  std::set<int> settled;
  for (std::size_t k = 0; k < full.size(); ++k) {
    if (!full[k]) continue;
    const int wire = wire_of(static_cast<int>(k));
    if (full[k]->plan || ++tries[wire] >= kTriesPerWire) settled.insert(wire);
  }
  for (const int k : order) {
    if (is_known(k) || (!scout(k).reached && tries.contains(wire_of(k)))) continue;
    if (settled.insert(wire_of(k)).second) wanted.insert(k);
  }
  std::vector<int> next;
  std::copy_if(wanted.begin(), wanted.end(), std::back_inserter(next),
               [&](int k) { return !is_known(k); });
  if (!next.empty() || best) return next;

  // No plan yet.
  const auto known = static_cast<std::size_t>(
      std::count_if(full.begin(), full.end(), [](const auto& run) { return run.has_value(); }));
  const bool enough = known >= std::max(kGiveUpAfter, full.size() / kGiveUpPart);
  for (const int k : order) {
    const bool worth = !enough || scout(k).reached;
    if (worth && !is_known(k) && next.size() < kAtOnce) next.push_back(k);
  }
  std::sort(next.begin(), next.end());
  return next;
}

ScoutError find_scout_error(const std::vector<Sighting>& scouts,
                            const std::vector<std::optional<Sighting>>& full) {
  ScoutError error;
  for (std::size_t k = 0; k < full.size(); ++k) {
    if (!full[k]) continue;
    ++error.compared;
    error.missed += full[k]->plan && !scouts[k].reached ? 1 : 0;
    error.false_reached += scouts[k].reached && !full[k]->plan ? 1 : 0;
  }
  const std::vector<double> sizes = score_differences(scouts, full);
  error.both_reached = static_cast<int>(sizes.size());
  if (!sizes.empty()) {
    error.median_score = find_spread(sizes).median;
    error.largest_score = *std::max_element(sizes.begin(), sizes.end());
  }
  return error;
}

}  // namespace wireplan::plan
