#include "plan/ranking.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "plan/number_text.h"
#include "plan/statistics.h"

namespace wireplan::plan {
namespace {

/// `summary`, and behind a colon what the trial itself says of it.
std::string with_reason(const std::string& summary, const Measured& trial) {
  return trial.reason.empty() ? summary : summary + ": " + trial.reason;
}

/// Why a trial that reached the target is not a plan; empty if it is one.
std::string broken_limits(const Metrics& metrics, const Limits& limits) {
  std::string reason;
  if (metrics.peak_tip_force > limits.tip_force_fail) {
    reason = "tip force " + four_digits(metrics.peak_tip_force) + " N over the limit of " +
             four_digits(limits.tip_force_fail) + " N";
  }
  if (metrics.off_path > limits.off_path_fail) {
    if (!reason.empty()) reason += "; ";
    reason += "came another way: wire " + one_decimal(metrics.off_path) +
              " mm outside the lumen of the path, over the limit of " +
              four_digits(limits.off_path_fail) + " mm";
  }
  if (metrics.max_penetration > limits.penetration_fail) {
    if (!reason.empty()) reason += "; ";
    reason += "left the lumen: wire " + four_digits(metrics.max_penetration) +
              " mm past the wall, over the limit of " + four_digits(limits.penetration_fail) +
              " mm";
  }
  return reason;
}

/// Over the first `count` repeats.
double mean_score(const RepeatedPlan& plan, std::size_t count) {
  expects(count > 0 && count <= plan.repeats.size());
  double sum = 0.0;
  for (std::size_t k = 0; k < count; ++k) sum += plan.repeats[k].score;
  return sum / static_cast<double>(count);
}

double safe_part(const RepeatedPlan& plan) {
  const auto safe = std::count_if(plan.repeats.begin(), plan.repeats.end(),
                                  [](const Repeat& repeat) { return repeat.safe; });
  return static_cast<double>(safe) / static_cast<double>(plan.repeats.size());
}

/// Of a plan without repeats: the median of those that have them; 1 where none has.
double typical_safe_part(const std::vector<RankedPlan>& plans,
                         const std::vector<RepeatedPlan>& repeated) {
  std::vector<double> parts;
  for (const RankedPlan& plan : plans) {
    const RepeatedPlan* own = find_repeated(repeated, plan.trial);
    if (own != nullptr) parts.push_back(safe_part(*own));
  }
  return parts.empty() ? 1.0 : find_spread(parts).median;
}

void sort_plans(std::vector<RankedPlan>& plans) {
  const auto key = [](const RankedPlan& plan) {
    return std::tuple(ends_unsure(plan), -plan.expected_safe, plan.expected_score, plan.trial);
  };
  std::sort(plans.begin(), plans.end(),
            [&](const RankedPlan& a, const RankedPlan& b) { return key(a) < key(b); });
}

/// Whether the unknowns decide which of the two is better.
bool tied_over_repeats(const RepeatedPlan& a, const RepeatedPlan& b, double error) {
  std::vector<double> differences;
  for (std::size_t k = 0; k < std::min(a.repeats.size(), b.repeats.size()); ++k) {
    differences.push_back(a.repeats[k].score - b.repeats[k].score);
  }
  const Spread spread = find_spread(differences);
  return spread.low - error <= 0.0 && spread.high + error >= 0.0;
}

/// What the repeats beyond the first so many do to mean scores, as the plans with most of them show
/// it; of none beyond the first 0, what they do to scores.
struct Shifts {
  double typical = 0.0;  // added to a plan's, the median; 0 without any
  double between = 0.0;  // by which they move two against each other, the median over pairs
};

Shifts find_shifts(const std::vector<RankedPlan>& plans, const std::vector<RepeatedPlan>& repeated,
                   std::size_t count) {
  std::size_t most = 0;
  for (const RepeatedPlan& plan : repeated) most = std::max(most, plan.repeats.size());
  std::vector<double> shifts, sizes;  // of each plan, of each pair
  for (const RankedPlan& plan : plans) {
    const RepeatedPlan* repeats = find_repeated(repeated, plan.trial);
    if (repeats == nullptr || repeats->repeats.size() < most) continue;
    const double before = count > 0 ? mean_score(*repeats, count) : plan.score.total;
    const double shift = *plan.robust_score - before;
    for (const double other : shifts) sizes.push_back(std::abs(shift - other));
    shifts.push_back(shift);
  }
  const auto median = [](const std::vector<double>& values) {
    return values.empty() ? 0.0 : find_spread(values).median;
  };
  return {.typical = median(shifts), .between = median(sizes)};
}

void find_ties(std::vector<RankedPlan>& plans, const std::vector<RepeatedPlan>& repeated,
               double shift) {
  for (RankedPlan& a : plans) {
    const RepeatedPlan* repeats_a = find_repeated(repeated, a.trial);
    for (const RankedPlan& b : plans) {
      if (a.trial == b.trial || ends_unsure(a) != ends_unsure(b)) continue;
      const double error = a.score_error + b.score_error;
      const double difference = std::abs(a.score.total - b.score.total);
      const RepeatedPlan* repeats_b = find_repeated(repeated, b.trial);
      const bool by_repeats = repeats_a != nullptr && repeats_b != nullptr
                                  ? tied_over_repeats(*repeats_a, *repeats_b, error)
                                  : difference <= error + shift;
      if (difference <= error || by_repeats) a.tied_with.push_back(b.trial);
    }
  }
}

/// "35 % less than", "12 % more than", "3.2 times as much as", "as much as".
std::string compare_forces(double force, double other) {
  const double nothing = 1e-4;  // N: below what a sentence prints
  if (other < nothing) return force < nothing ? "as much as" : "more than";
  const double ratio = force / other;
  if (ratio >= 2.0) return two_digits(ratio) + " times as much as";
  const double percent = std::round(100.0 * std::abs(ratio - 1.0));
  if (percent == 0.0) return "as much as";
  return std::to_string(static_cast<int>(percent)) +
         (ratio < 1.0 ? " % less than" : " % more than");
}

/// The best plan against the best plan of the next wire; empty in a study of one wire.
std::string compare_with_next_wire(const std::vector<RankedPlan>& plans, const Study& study,
                                   const std::vector<Candidate>& candidates,
                                   const std::vector<Metrics>& metrics) {
  const int wire = candidates[plans.front().trial].wire;
  for (const RankedPlan& plan : plans) {
    const int next = candidates[plan.trial].wire;
    if (next == wire) continue;
    return ", " +
           compare_forces(metrics[plans.front().trial].peak_contact_force,
                          metrics[plan.trial].peak_contact_force) +
           " the next wire (" + study.wires[next].name + ")";
  }
  return study.wires.size() > 1 ? "; no plan was found with another wire" : "";
}

/// A later plan against the best one: its force, and the component that costs it most.
std::string compare_with_first(const RankedPlan& plan, const RankedPlan& first,
                               const std::vector<Metrics>& metrics, const Weights& weights) {
  const auto loss = [&](const ScorePart& part) {
    return acts(part, plan.score.of_script)
               ? weights.*part.weight * (plan.score.*part.cost - first.score.*part.cost)
               : -HUGE_VAL;
  };
  const auto largest =
      std::max_element(kScoreParts.begin(), kScoreParts.end(),
                       [&](const ScorePart& a, const ScorePart& b) { return loss(a) < loss(b); });

  std::string text = ", " +
                     compare_forces(metrics[plan.trial].peak_contact_force,
                                    metrics[first.trial].peak_contact_force) +
                     " the first plan";
  if (ends_unsure(plan) && !ends_unsure(first)) {
    text += is_sensitive(plan) ? "; behind it because it is sensitive"
                               : "; behind it because its tip may not be in the target";
  } else if (plan.robust_score && plan.expected_safe < first.expected_safe) {
    text += "; behind it because it is safe less often";
  } else if (plan.score.total > first.score.total) {
    text += std::string("; behind it mostly by ") + largest->said;
  } else if (first.robust_score) {
    text += "; behind it under the perturbations alone";
  }
  const auto& ties = plan.tied_with;
  if (std::find(ties.begin(), ties.end(), first.trial) != ties.end()) {
    text += "; error and unknowns do not tell the two apart";
  }
  return text;
}

/// What a reader must know of a plan that is ranked all the same.
std::string warnings_of(const RankedPlan& plan, const Metrics& m, const simulate::Goal& goal,
                        const Limits& limits) {
  std::string text;
  if (is_sensitive(plan)) text += "; sensitive: " + *plan.sensitive;
  if (plan.tip_unsure && !plan.tip_error) {
    text += "; warning: where its tip ends could not be told by other elements and pushes";
  } else if (plan.tip_unsure) {
    text += "; warning: the tip's numerical error of " + two_digits(*plan.tip_error) +
            " mm may put it outside the target (" +
            (goal.at_section ? "half the lumen's radius is " + two_digits(tip_room(goal, m))
                             : "radius " + two_digits(goal.radius)) +
            " mm)";
  }
  if (m.peak_tip_force > limits.tip_force_warn) {
    text += "; warning: tip force " + four_digits(m.peak_tip_force) +
            " N over the warning level of " + four_digits(limits.tip_force_warn) + " N";
  }
  if (m.wall_motion.beyond_linear_theory()) {
    const Vec3& p = m.wall_motion.point;
    text += "; warning: the wall moved " + two_digits(m.wall_motion.displacement) + " mm at (" +
            one_decimal(p.x()) + ", " + one_decimal(p.y()) + ", " + one_decimal(p.z()) +
            ") mm where the vessel's radius is " + two_digits(m.wall_motion.radius) +
            " mm, beyond linear theory (" + two_digits(kLinearWallPart) + " of it)";
  }
  return text;
}

/// Why a candidate that was scouted only is no plan; `failure` is empty where the scout reached.
std::string scouted_reason(const Score& score, const std::string& failure) {
  if (!failure.empty()) return "scouted only: " + failure;
  return "scouted only: reaches with a score of " + four_digits(score.total) +
         "; by the default limits and weights, which decide what is run in full, behind the best "
         "plan by more than scouts were found to be off";
}

std::string safety_of(const RepeatedPlan& plan) {
  const auto count = [&](bool Repeat::*what) {
    return std::count_if(plan.repeats.begin(), plan.repeats.end(),
                         [&](const Repeat& repeat) { return repeat.*what; });
  };
  const auto safe = count(&Repeat::safe), reached = count(&Repeat::reached);
  std::string text =
      "; safe in " + std::to_string(safe) + " of " + std::to_string(plan.repeats.size());
  if (reached > safe) {
    text += " perturbed repeats, though it reaches in " + std::to_string(reached);
  } else {
    text += " perturbed repeats";
  }
  return text;
}

/// How the catheter sits; empty without one.
std::string seat_of(const Candidate& candidate, const Metrics& metrics) {
  if (candidate.catheter < 0 || !metrics.script) return "";
  const ScriptMetrics& script = *metrics.script;
  if (script.hook_depth <= 0.0) return "; its catheter stays before the ostium and bears no push";
  return "; its catheter ends " + one_decimal(script.hook_depth) +
         " mm in the branch and bears a push of " + (script.bears_more ? "more than " : "") +
         two_digits(script.support) + " N before it backs out";
}

void write_sentences(Ranking& ranking, const Study& study, const std::vector<Candidate>& candidates,
                     const std::vector<Metrics>& metrics, const Limits& limits,
                     const Weights& weights, const std::vector<RepeatedPlan>& repeated) {
  for (RankedPlan& plan : ranking.plans) {
    const Metrics& m = metrics[plan.trial];
    const RankedPlan& first = ranking.plans.front();
    plan.sentence = (study.goal.at_section ? std::string("reaches the target with at most ")
                                           : "reaches the target " + one_decimal(m.tip_to_target) +
                                                 " mm from its centre with at most ") +
                    two_digits(m.peak_contact_force) + " N on the wall";
    plan.sentence += plan.trial == first.trial
                         ? compare_with_next_wire(ranking.plans, study, candidates, metrics)
                         : compare_with_first(plan, first, metrics, weights);
    plan.sentence += seat_of(candidates[static_cast<std::size_t>(plan.trial)], m);
    const RepeatedPlan* repeats = find_repeated(repeated, plan.trial);
    if (repeats != nullptr) plan.sentence += safety_of(*repeats);
    plan.sentence += warnings_of(plan, m, study.goal, limits);
  }
}

std::vector<WireSummary> summarise_wires(const Study& study,
                                         const std::vector<Candidate>& candidates,
                                         const std::vector<Metrics>& metrics,
                                         const std::vector<RankedPlan>& plans,
                                         const std::vector<bool>& scouted) {
  std::vector<WireSummary> wires(study.wires.size());
  std::vector<std::vector<double>> forces(study.wires.size());
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (!scouted.empty() && scouted[k]) continue;
    const int wire = candidates[k].wire;
    ++wires[wire].trials;
    if (metrics[k].reached) forces[wire].push_back(metrics[k].peak_contact_force);
  }

  for (int wire = 0; wire < std::ssize(wires); ++wire) {
    WireSummary& summary = wires[wire];
    summary.wire = wire;
    summary.reached = static_cast<int>(forces[wire].size());
    if (!forces[wire].empty()) {
      summary.median_peak_force = find_spread(forces[wire]).median;
      summary.worst_peak_force = *std::max_element(forces[wire].begin(), forces[wire].end());
    }
    const auto best = std::find_if(plans.begin(), plans.end(), [&](const RankedPlan& plan) {
      return candidates[plan.trial].wire == wire;
    });
    if (best != plans.end()) summary.best_trial = best->trial;
    summary.safe =
        static_cast<int>(std::count_if(plans.begin(), plans.end(), [&](const RankedPlan& plan) {
          return candidates[plan.trial].wire == wire;
        }));
  }
  return wires;
}

/// Walks the plans by rising force; one stays if it is better in the other quantity than all before
/// it, or equal in both to the last that stayed. Of a sphere that is how near the tip is to its
/// middle; of a cross-section, which is passed or not, the share that is unsafe.
std::vector<int> find_pareto_front(const std::vector<RankedPlan>& plans,
                                   const std::vector<Metrics>& metrics, bool at_section) {
  struct Place {
    double force, other;
    int trial;
    auto operator<=>(const Place&) const = default;
  };
  std::vector<Place> order;
  for (const RankedPlan& plan : plans) {
    const Metrics& own = metrics[plan.trial];
    order.push_back({own.peak_contact_force,
                     at_section ? 1.0 - plan.expected_safe : own.tip_to_target, plan.trial});
  }
  std::sort(order.begin(), order.end());

  std::vector<int> front;
  std::optional<Place> last;
  for (const Place& place : order) {
    const bool equal = last && place.force == last->force && place.other == last->other;
    if (last && place.other >= last->other && !equal) continue;
    front.push_back(place.trial);
    last = place;
  }
  return front;
}

}  // namespace

const RepeatedPlan* find_repeated(const std::vector<RepeatedPlan>& repeated, int trial) {
  const auto found = std::find_if(repeated.begin(), repeated.end(),
                                  [&](const RepeatedPlan& plan) { return plan.trial == trial; });
  return found == repeated.end() ? nullptr : &*found;
}

bool is_sensitive(const RankedPlan& plan) { return plan.sensitive && !plan.sensitive->empty(); }

bool ends_unsure(const RankedPlan& plan) { return is_sensitive(plan) || plan.tip_unsure; }

double tip_room(const simulate::Goal& goal, const Metrics& metrics) {
  constexpr double kPartOfRadius = 0.5;
  return goal.at_section ? kPartOfRadius * goal.radius
                         : std::max(0.0, goal.radius - metrics.tip_to_target);
}

std::string exclusion_reason(const Measured& trial, const Study& study, const Limits& limits) {
  using simulate::Outcome;
  const Metrics& metrics = trial.metrics;
  const std::string place = "at " + one_decimal(metrics.insertion) + " mm of wire, tip " +
                            one_decimal(metrics.tip_to_target) + " mm from the target";
  switch (trial.outcome) {
    case Outcome::kReached:
      return broken_limits(metrics, limits);
    case Outcome::kMissed:
      return "missed: tip ended " + one_decimal(metrics.tip_to_target) +
             " mm from the target and came no nearer than " +
             one_decimal(metrics.nearest_to_target) + " mm, expected " +
             (study.goal.at_section ? std::string("past the vessel's cross-section there")
                                    : "within " + four_digits(study.goal.radius) + " mm");
    case Outcome::kPassedBy:
      return with_reason("passed by the branch " + place, trial);
    case Outcome::kWrongBranch:
      return with_reason("took the wrong branch " + place, trial);
    case Outcome::kLeftImage:
      return with_reason("left the imaged vessel " + place, trial);
    case Outcome::kStuck:
      return with_reason("stuck " + place, trial);
    case Outcome::kProlapsed:
      return with_reason("folded back " + place, trial);
    case Outcome::kAnotherWay:
      return with_reason("came to the target another way " + place, trial);
    case Outcome::kCrossesItself:
      return with_reason("crosses itself " + place, trial);
    case Outcome::kLeftLumen:
      return with_reason("left the lumen " + place, trial);
    case Outcome::kNotConverged:
      return with_reason("did not converge " + place, trial);
    case Outcome::kFailed:
      return trial.reason.empty() ? "failed" : trial.reason;
  }
  throw LogicError("an outcome without a reason");
}

Ranking rank(const Study& study, const std::vector<Candidate>& candidates,
             const std::vector<Measured>& trials, const Limits& limits, const Weights& weights,
             const Findings& findings) {
  std::vector<Metrics> metrics;
  for (const Measured& trial : trials) metrics.push_back(trial.metrics);
  const std::vector<std::optional<NumericalError>>& errors = findings.errors;
  expects(trials.size() == candidates.size());
  expects(errors.empty() || errors.size() == candidates.size());
  expects(findings.sensitive.empty() || findings.sensitive.size() == candidates.size());
  expects(findings.refined.empty() || findings.refined.size() == candidates.size());
  expects(findings.scouted.empty() || findings.scouted.size() == candidates.size());

  // A trial is a plan or has a reason.
  Ranking ranking;
  for (int k = 0; k < std::ssize(candidates); ++k) {
    std::string reason = exclusion_reason(trials[k], study, limits);
    if (!findings.scouted.empty() && findings.scouted[k]) {
      reason = scouted_reason(compute_score(metrics[k], study.goal, limits, weights), reason);
    }
    if (!reason.empty()) {
      ranking.excluded.push_back({k, reason});
      continue;
    }
    RankedPlan plan;
    plan.trial = k;
    plan.score = compute_score(metrics[k], study.goal, limits, weights);
    const std::optional<NumericalError> known = errors.empty() ? std::nullopt : errors[k];
    if (known) {
      plan.position_error = known->position;
      plan.tip_error = known->tip;
      plan.tip_unsure = known->tip >= tip_room(study.goal, metrics[k]);
    } else {
      plan.tip_unsure = !findings.refined.empty() && findings.refined[k];
    }
    if (!findings.sensitive.empty()) plan.sensitive = findings.sensitive[k];
    plan.score_error = compute_score_error(metrics[k], known.value_or(assumed_error(metrics[k])),
                                           study.goal, limits, weights);
    const RepeatedPlan* repeated = find_repeated(findings.repeated, k);
    if (repeated != nullptr) plan.robust_score = mean_score(*repeated, repeated->repeats.size());
    ranking.plans.push_back(plan);
  }

  // The order, and then all that is said relative to the others.
  const Shifts all = find_shifts(ranking.plans, findings.repeated, 0);
  const double typical_safe = typical_safe_part(ranking.plans, findings.repeated);
  for (RankedPlan& plan : ranking.plans) {
    const RepeatedPlan* own = find_repeated(findings.repeated, plan.trial);
    plan.expected_safe = own == nullptr ? typical_safe : safe_part(*own);
    plan.expected_score =
        own == nullptr
            ? plan.score.total + all.typical
            : *plan.robust_score +
                  find_shifts(ranking.plans, findings.repeated, own->repeats.size()).typical;
  }
  sort_plans(ranking.plans);
  find_ties(ranking.plans, findings.repeated, all.between);
  write_sentences(ranking, study, candidates, metrics, limits, weights, findings.repeated);
  ranking.wires = summarise_wires(study, candidates, metrics, ranking.plans, findings.scouted);
  ranking.pareto = find_pareto_front(ranking.plans, metrics, study.goal.at_section);
  return ranking;
}

}  // namespace wireplan::plan
