#include "plan/refine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "plan/number_text.h"

namespace wireplan::plan {
namespace {

/// Below this a change of position is rounding, and says nothing of the order [mm].
constexpr double kRoundingDistance = 1e-9;

/// The least order that is reckoned with; and that of what is stated, see estimate_error().
constexpr double kLeastOrder = 0.5;

/// A wire that has reached may be drawn back by so much as the catheter follows it; more than is
/// let happen [mm].
constexpr double kDrawnBack = 5.0;

std::string in_mm(double length) {
  char text[64];
  std::snprintf(text, sizeof text, "%.6g mm", length);
  return text;
}

/// Arc length of each node from the tip, nodes counted from the tip.
std::vector<double> arc_from_tip(const Eigen::Matrix3Xd& nodes) {
  std::vector<double> arc{0.0};
  for (Eigen::Index k = nodes.cols() - 1; k > 0; --k) {
    arc.push_back(arc.back() + (nodes.col(k) - nodes.col(k - 1)).norm());
  }
  return arc;
}

/// Why the run cannot be compared; empty if it came to the insertion, or to the target without one.
std::string why_incomplete(const Measured& trial, const std::string& with,
                           std::optional<double> insertion) {
  const std::string why = trial.reason.empty() ? outcome_name(trial.outcome) : trial.reason;
  if (!insertion) {
    const bool reached = trial.outcome == simulate::Outcome::kReached && trial.nodes.cols() > 0;
    return reached ? "" : with + " the target is not reached: " + why;
  }
  const double reached = trial.metrics.insertion;
  if (std::abs(reached - *insertion) <= 1e-6 * *insertion && trial.nodes.cols() > 0) return "";
  return with + " the wire came to " + in_mm(reached) + " of " + in_mm(*insertion) + ": " + why;
}

std::string why_incomplete(const RefinedRun& run, std::optional<double> insertion) {
  return why_incomplete(run.trial, "with elements of " + in_mm(run.element_length), insertion);
}

/// Of two runs alike but for a setting; the first came to the insertion.
OtherEnd compare_ends(const Measured& plan, const SettingRun& other,
                      std::optional<double> insertion) {
  OtherEnd end{
      .setting = other.setting,
      .change = {},
      .incomplete = why_incomplete(other.trial, describe_setting(other.setting), insertion)};
  const bool failed = other.trial.outcome == simulate::Outcome::kFailed;
  if (!failed && other.trial.nodes.cols() > 0) end.change = find_difference(plan, other.trial);
  return end;
}

constexpr std::array kErrorParts = {&NumericalError::position,   &NumericalError::tip,
                                    &NumericalError::peak_force, &NumericalError::mean_force,
                                    &NumericalError::tip_force,  &NumericalError::push_force,
                                    &NumericalError::support};

/// Whether the change is one of the value. The hand's force is a mean over a push: over shorter
/// ones it is another figure, as long as the wire goes the same way.
bool is_of_value(const OtherEnd& other, double NumericalError::*part) {
  return part != &NumericalError::push_force || other.setting != Setting::kStep ||
         other.change.tip > kTipsApart;
}

/// What half an order makes of the change to elements of half the length: the error of the longer
/// ones; one less of the shorter ones.
double factor_of_stated() {
  const double least = std::exp2(kLeastOrder);
  return least / (least - 1.0);
}

/// The error of the study's run: that of the change to the finer one, but no less than what second
/// order makes of the change from the coarser one, which three times the error is then.
double stated_error(double fine, double coarse) {
  return std::max(factor_of_stated() * fine, coarse / 3.0);
}

/// The same by two finer ones: by the changes to the first, to the second, and between them.
double stated_error_of_finer(double fine, double finest, double between) {
  return std::max(factor_of_stated() * fine, finest + (factor_of_stated() - 1.0) * between);
}

std::optional<double> find_order(const std::optional<NumericalError>& coarse,
                                 const std::optional<NumericalError>& fine) {
  if (!coarse || !fine) return std::nullopt;
  if (coarse->position < kRoundingDistance || fine->position < kRoundingDistance) {
    return std::nullopt;
  }
  return std::log2(coarse->position / fine->position);
}

}  // namespace

std::vector<int> choose_plans_to_refine(const Ranking& ranking,
                                        const std::vector<Refinement>& known,
                                        const RefineOptions& options) {
  expects(options.plans >= 0);
  std::vector<int> next;
  if (ranking.plans.empty()) return next;
  const auto add = [&](int trial) {
    const bool is_known = std::any_of(known.begin(), known.end(),
                                      [&](const Refinement& r) { return r.trial == trial; });
    const bool is_next = std::find(next.begin(), next.end(), trial) != next.end();
    if (!is_known && !is_next) next.push_back(trial);
  };
  for (std::size_t k = 0; k < ranking.plans.size(); ++k) {
    if (static_cast<int>(k) < options.plans) add(ranking.plans[k].trial);
  }
  for (const int trial : ranking.plans.front().tied_with) {
    if (static_cast<int>(known.size() + next.size()) < options.most) add(trial);
  }
  return next;
}

Study refined_study(const Study& study, const Candidate& candidate, double factor,
                    double insertion) {
  Study changed = study;
  changed.insertion.element_length *= factor;
  for (double& length : changed.insertion.section_element_length) length *= factor;
  changed.insertion.contact_spacing *= factor;
  changed.insertion.map_forces = false;
  if (candidate.catheter >= 0) {
    changed.insertion.record_every = kNoShapes;  // the same for all that share a way up
    return changed;
  }
  changed.insertion.length = insertion;
  changed.insertion.record_every = insertion;                  // no shapes on the way
  changed.goal = {.point = study.goal.point, .radius = 1e-9};  // no push ends that near
  return changed;
}

Eigen::Matrix3Xd cut_at_goal(const Eigen::Matrix3Xd& nodes, const simulate::Goal& goal) {
  expects(nodes.cols() >= 2 && (!goal.at_section || goal.way));
  const Eigen::Index last = nodes.cols() - 1;
  Eigen::Index before = last - 1;  // the node before the cut
  double part = 0.0;               // of the edge from there
  if (goal.at_section) {
    const simulate::CrossSection& section = goal.way->section();
    const auto height = [&](Eigen::Index i) {
      return section.normal.dot(nodes.col(i) - section.center);
    };
    while (before > 0 && !(height(before) < 0.0 && height(before + 1) >= 0.0)) --before;
    const bool passes = height(before) < 0.0 && height(before + 1) >= 0.0;
    if (!passes) before = last - 1;
    const double rise = height(before + 1) - height(before);
    const double edge = (nodes.col(before + 1) - nodes.col(before)).norm();
    // One that leads away from the section, or is far from it, is compared as it is.
    part = rise > 0.0 ? -height(before) / rise : 1.0;
    if (!passes && (part < 1.0 || (part - 1.0) * edge > kDrawnBack)) part = 1.0;
  } else {
    double nearest = HUGE_VAL;
    for (Eigen::Index i = 0; i < last; ++i) {
      const Vec3 edge = nodes.col(i + 1) - nodes.col(i);
      const double along =
          std::clamp(edge.dot(goal.point - nodes.col(i)) / edge.squaredNorm(), 0.0, 1.0);
      const double distance = (nodes.col(i) + along * edge - goal.point).norm();
      if (distance >= nearest) continue;
      nearest = distance;
      before = i;
      part = along;
    }
  }
  Eigen::Matrix3Xd cut = nodes.leftCols(before + 2);
  cut.rightCols<1>() = (1.0 - part) * nodes.col(before) + part * nodes.col(before + 1);
  return cut;
}

bool needs_finest(const std::vector<RefinedRun>& runs) {
  expects(runs.size() == kRefineFactors.size());
  return !why_incomplete(runs[0], {}).empty() && why_incomplete(runs[1], {}).empty() &&
         why_incomplete(runs[2], {}).empty();
}

namespace {

/// What is stated of the study's run, of three that all end alike but for the numbers. The second
/// is the study's, or the first, where the others are both finer.
std::optional<NumericalError> find_stated(const std::vector<RefinedRun>& runs,
                                          const std::vector<bool>& complete, std::size_t own,
                                          const std::vector<OtherEnd>& others) {
  const auto change = [&](std::size_t from, std::size_t to) -> std::optional<NumericalError> {
    if (!complete[from] || !complete[to]) return std::nullopt;
    return find_difference(runs[from].trial, runs[to].trial);
  };
  const std::optional<NumericalError> fine = change(own, own + 1);
  if (!fine) return std::nullopt;
  const NumericalError coarse =
      own == 1 ? change(0, 1).value_or(NumericalError{}) : NumericalError{};
  const std::optional<NumericalError> finest = own == 0 ? change(0, 2) : std::nullopt,
                                      between = own == 0 ? change(1, 2) : std::nullopt;
  NumericalError stated;
  for (const auto part : kErrorParts) {
    double& error = stated.*part;
    error = finest && between
                ? stated_error_of_finer((*fine).*part, (*finest).*part, (*between).*part)
                : stated_error((*fine).*part, coarse.*part);
    for (const OtherEnd& other : others) {
      if (is_of_value(other, part)) error = std::max(error, other.change.*part);
    }
  }
  return stated;
}

/// The table of the three runs: from both changes the order, and from it the share of a change that
/// is still missing.
void tabulate(const std::vector<RefinedRun>& runs, const std::vector<bool>& complete,
              Refinement& result) {
  std::optional<NumericalError> coarse, fine;
  if (complete[0] && complete[1]) coarse = find_difference(runs[0].trial, runs[1].trial);
  if (complete[1] && complete[2]) fine = find_difference(runs[1].trial, runs[2].trial);
  result.observed_order = find_order(coarse, fine);
  const double ratio = std::exp2(std::clamp(result.observed_order.value_or(2.0), kLeastOrder, 2.0));
  const double of_longer = ratio / (ratio - 1.0), of_shorter = 1.0 / (ratio - 1.0);
  std::vector<std::optional<double>> position_errors(3);
  if (coarse) position_errors[0] = of_longer * coarse->position;
  if (fine) position_errors[1] = of_longer * fine->position;
  if (fine) position_errors[2] = of_shorter * fine->position;
  for (std::size_t k = 0; k < 3; ++k) {
    if (!complete[k]) continue;
    const Metrics& metrics = runs[k].trial.metrics;
    result.rows.push_back({.element_length = runs[k].element_length,
                           .position_error = position_errors[k],
                           .peak_force = metrics.peak_contact_force,
                           .iterations = metrics.iterations});
    result.cpu_seconds.push_back(runs[k].trial.cpu_seconds);
  }
}

}  // namespace

Refinement estimate_error(int trial, std::optional<double> insertion, std::vector<RefinedRun> runs,
                          const std::vector<SettingRun>& others) {
  expects(runs.size() == 3 || runs.size() == 4);
  for (std::size_t k = 1; k < runs.size(); ++k) {
    expects(runs[k - 1].element_length > runs[k].element_length);
  }
  Refinement result;
  result.trial = trial;
  const std::size_t own = runs.size() == 3 ? 1 : 0;  // the study's
  if (own == 0) {
    result.left_out = why_incomplete(runs.front(), insertion);
    runs.erase(runs.begin());
  }
  const auto add = [](const std::string& why, std::string& to) {
    if (!why.empty()) to += (to.empty() ? "" : "; ") + why;
  };
  std::vector<bool> complete;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const std::string why = why_incomplete(runs[k], insertion);
    complete.push_back(why.empty());
    add(why, result.reason);
    if (!insertion && k > own) add(why, result.not_finer);
  }

  // Ends that the solver finds with a setting changed.
  for (const SettingRun& other : others) {
    if (complete[own]) result.others.push_back(compare_ends(runs[own].trial, other, insertion));
  }
  result.error = find_stated(runs, complete, own, result.others);
  tabulate(runs, complete, result);
  return result;
}

NumericalError find_difference(const Measured& one, const Measured& other) {
  const Metrics &a = one.metrics, &b = other.metrics;
  const bool scripts = a.script && b.script;
  return {.position = shape_distance(one.nodes, other.nodes),
          .tip = (one.nodes.rightCols<1>() - other.nodes.rightCols<1>()).norm(),
          .peak_force = std::abs(a.peak_contact_force - b.peak_contact_force),
          .mean_force = std::abs(a.mean_contact_force - b.mean_contact_force),
          .tip_force = std::abs(a.peak_tip_force - b.peak_tip_force),
          .push_force = std::abs(a.peak_push_force - b.peak_push_force),
          .support = scripts ? std::abs(a.script->support - b.script->support) : 0.0};
}

std::optional<std::string> find_sensitivity(const Refinement& refinement) {
  if (refinement.others.empty()) return std::nullopt;
  std::string text;
  for (const OtherEnd& other : refinement.others) {
    if (other.incomplete.empty() && other.change.tip <= kTipsApart) continue;
    if (!text.empty()) text += "; ";
    text += other.incomplete.empty() ? describe_setting(other.setting) + " its tip ends " +
                                           one_decimal(other.change.tip) + " mm away"
                                     : other.incomplete;
  }
  if (!refinement.not_finer.empty()) text += (text.empty() ? "" : "; ") + refinement.not_finer;
  return text;
}

double shape_distance(const Eigen::Matrix3Xd& coarse, const Eigen::Matrix3Xd& fine) {
  expects(coarse.cols() > 0 && fine.cols() > 0);
  const std::vector<double> arc = arc_from_tip(coarse), fine_arc = arc_from_tip(fine);
  const Eigen::Index last = coarse.cols() - 1, fine_last = fine.cols() - 1;

  double largest = (coarse.col(last) - fine.col(fine_last)).norm();
  std::size_t edge = 1;  // of the fine wire, its end nearer to the tip being node edge - 1
  for (std::size_t k = 1; k < arc.size(); ++k) {
    while (edge < fine_arc.size() && fine_arc[edge] < arc[k]) ++edge;
    if (edge == fine_arc.size()) break;
    const double t = (arc[k] - fine_arc[edge - 1]) / (fine_arc[edge] - fine_arc[edge - 1]);
    const Vec3 on_fine = (1.0 - t) * fine.col(fine_last - static_cast<Eigen::Index>(edge) + 1) +
                         t * fine.col(fine_last - static_cast<Eigen::Index>(edge));
    largest = std::max(largest, (coarse.col(last - static_cast<Eigen::Index>(k)) - on_fine).norm());
  }
  return largest;
}

std::vector<std::optional<NumericalError>> errors_by_trial(
    const std::vector<Refinement>& refinements, int trial_count) {
  std::vector<std::optional<NumericalError>> errors(trial_count);
  for (const Refinement& refinement : refinements) {
    expects(refinement.trial >= 0 && refinement.trial < trial_count);
    errors[refinement.trial] = refinement.error;
  }
  return errors;
}

std::vector<std::optional<std::string>> sensitivity_by_trial(
    const std::vector<Refinement>& refinements, int trial_count) {
  std::vector<std::optional<std::string>> sensitive(trial_count);
  for (const Refinement& refinement : refinements) {
    expects(refinement.trial >= 0 && refinement.trial < trial_count);
    sensitive[refinement.trial] = find_sensitivity(refinement);
  }
  return sensitive;
}

}  // namespace wireplan::plan
