#include "plan/search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

#include "plan/batch.h"
#include "plan/statistics.h"
#include "preprocess/centerline/path_place.h"

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
constexpr std::size_t kGiveUpAfter = 8;   // ... until so many were run in full, ...
constexpr std::size_t kGiveUpPart = 12;   // ... or one in so many, and none is left that reached
constexpr std::size_t kCheckedPart = 16;  // of those that failed, one in so many is looked at

/// Whether the level itself may be why the candidate did not reach.
bool is_doubtful(const Sighting& seen, double goal_radius) {
  return !seen.reached && (seen.unclear || seen.pinched || seen.nearest <= 2.0 * goal_radius);
}

/// Candidates, the most promising first: by score, and those that did not reach by how near they
/// came.
std::vector<int> order_by_promise(const std::vector<Sighting>& seen) {
  std::vector<int> order(seen.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int k) {
    const Sighting& s = seen[static_cast<std::size_t>(k)];
    return std::tuple(!s.reached, s.reached ? s.score : s.nearest, k);
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  return order;
}

/// Of the failures that may be the scout's as many as are looked at, the nearest first. The best of
/// a wire counts before all others: it is run anyway.
std::vector<int> choose_doubtful(const std::vector<Candidate>& candidates,
                                 const std::vector<Sighting>& scouts, double goal_radius) {
  std::vector<int> doubtful;
  std::ptrdiff_t best = 0;  // of their wires, at the front
  std::set<int> wires;
  std::size_t failed = 0;
  for (const int k : order_by_promise(scouts)) {
    const Sighting& scout = scouts[static_cast<std::size_t>(k)];
    const bool first = wires.insert(candidates[static_cast<std::size_t>(k)].wire).second;
    failed += scout.reached ? 0 : 1;
    if (is_doubtful(scout, goal_radius)) {
      doubtful.insert(first ? doubtful.begin() + best++ : doubtful.end(), k);
    }
  }
  doubtful.resize(std::min(doubtful.size(), (failed + kCheckedPart - 1) / kCheckedPart));
  return doubtful;
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
  double radius = study.goal.radius;
  for (const simulate::Goal& other : study.others) radius = std::min(radius, other.radius);
  insertion.step =
      std::max(insertion.step, std::min({kCoarser * insertion.step, kLongestPush, 0.5 * radius}));
  insertion.residual_tolerance = std::max(insertion.residual_tolerance, kScoutTolerance);
  insertion.map_forces = false;
  return scout;
}

Sighting look_at(const Measured& trial, const Study& study, const Limits& limits,
                 const Weights& weights) {
  using simulate::Outcome;
  const Metrics& metrics = trial.metrics;
  Sighting sighting;
  sighting.reached = metrics.reached;
  sighting.plan = exclusion_reason(trial, study, limits).empty();
  sighting.unclear = trial.outcome == Outcome::kNotConverged || trial.outcome == Outcome::kFailed;
  if (metrics.reached) sighting.score = compute_score(metrics, study.goal, limits, weights).total;
  sighting.nearest = metrics.nearest_to_target;
  return sighting;
}

bool is_pinched(const Measured& trial, double wire_radius, const Centerline& path) {
  constexpr double kNear = 10.0;  // wire radii
  if (trial.outcome != simulate::Outcome::kStuck) return false;
  const preprocess::PathPlace tip = preprocess::find_place(trial.last_tip, path);
  for (Eigen::Index k = 0; k < path.radius.size(); ++k) {
    const bool near = std::abs(path.arc_length[k] - tip.arc) <= kNear * wire_radius;
    if (near && path.radius[k] < 2.0 * wire_radius) return true;
  }
  return false;
}

NextRuns choose_next(const Study& study, const std::vector<Candidate>& candidates,
                     const Sightings& seen, bool probing) {
  const std::size_t count = candidates.size();
  expects(seen.scouts.size() == count && seen.probes.size() == count && seen.full.size() == count);
  const auto is_probed = [&](int k) {
    return seen.probes[static_cast<std::size_t>(k)].has_value();
  };
  std::vector<Sighting> rigid = seen.scouts;  // the best that is known of the rigid wall
  for (std::size_t k = 0; k < count; ++k) rigid[k] = seen.probes[k].value_or(rigid[k]);
  const auto sighting = [&](int k) -> const Sighting& {
    return rigid[static_cast<std::size_t>(k)];
  };
  const auto full = [&](int k) -> const std::optional<Sighting>& {
    return seen.full[static_cast<std::size_t>(k)];
  };
  const auto clearly_failed = [&](int k) {
    return !sighting(k).reached && !is_doubtful(sighting(k), study.goal.radius);
  };
  const auto is_known = [&](int k) {  // so that no more is to be learnt of it
    return full(k) || (is_probed(k) && clearly_failed(k));
  };
  const auto wire_of = [&](int k) { return candidates[static_cast<std::size_t>(k)].wire; };
  const std::vector<int> order = order_by_promise(rigid);
  std::set<int> wanted;

  // The best of all, and failures that may be the scout's.
  for (std::size_t place = 0; place < std::min(kAlways, order.size()); ++place) {
    if (sighting(order[place]).reached) wanted.insert(order[place]);
  }
  const std::vector<int> checked = choose_doubtful(candidates, seen.scouts, study.goal.radius);
  wanted.insert(checked.begin(), checked.end());

  // What a rigid wall held in a stenosis.
  for (const int k : order) {
    if (sighting(k).pinched) wanted.insert(k);
  }

  // Those that may beat the best plan, as far as their level was off.
  std::optional<double> best;
  for (const std::optional<Sighting>& run : seen.full) {
    if (run && run->plan) best = std::min(best.value_or(run->score), run->score);
  }
  double margin = kScoutMargin;
  for (const double size : score_differences(rigid, seen.full)) margin = std::max(margin, size);
  for (const int k : order) {
    if (best && sighting(k).reached && sighting(k).score - margin < *best) wanted.insert(k);
  }

  // Of a wire without a plan its best, whatever it is, then the next that reached.
  std::map<int, int> tries;
  std::set<int> settled;
  for (int k = 0; k < static_cast<int>(count); ++k) {
    if (!is_known(k)) continue;
    const bool plan = full(k) && full(k)->plan;
    if (plan || ++tries[wire_of(k)] >= kTriesPerWire) settled.insert(wire_of(k));
  }
  for (const int k : order) {
    if (is_known(k) || (!sighting(k).reached && tries.contains(wire_of(k)))) continue;
    if (settled.insert(wire_of(k)).second) wanted.insert(k);
  }
  std::erase_if(wanted, is_known);

  // No plan yet: more of all.
  if (wanted.empty() && !best) {
    std::size_t known = 0;
    for (const int k : order) known += is_known(k) ? 1 : 0;
    const std::size_t enough = std::max(kGiveUpAfter, count / kGiveUpPart);
    for (const int k : order) {
      const bool worth = sighting(k).reached || known + wanted.size() < enough;
      if (worth && !is_known(k) && wanted.size() < kAtOnce) wanted.insert(k);
    }
  }
  NextRuns next;
  for (const int k : wanted) {
    const bool probes_first = probing && !is_probed(k) && clearly_failed(k);
    (probes_first ? next.probes : next.full).push_back(k);
  }
  if (!next.full.empty()) next.probes.clear();
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
