#include "plan/tool_hooks.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace wireplan::plan {

using simulate::kBothTools;
using simulate::ToolStep;
using simulate::Until;

ToolScript with(ToolScript steps, const ToolStep& next) {
  if (!steps.empty() && steps.back().tool == next.tool && steps.back().until == Until::kMade &&
      next.until == Until::kMade) {
    ToolStep& last = steps.back();
    if (last.push * next.push > 0.0) {
      last.push += next.push;
      return steps;
    }
    if (last.push == 0.0 && next.push == 0.0) {
      last.turn += next.turn;
      if (std::abs(last.turn) < 1e-9) steps.pop_back();
      return steps;
    }
  }
  steps.push_back(next);
  return steps;
}

void end_at(ToolStep& step, Until until, double at) {
  step.until = until;
  const double unit = simulate::ends_by_angle(until) ? 5.0 * kRadPerDeg : 0.5;  // [rad], [mm]
  step.at = unit * std::round(at / unit);
}

std::string mm_text(double value) { return std::to_string(std::lround(value)) + " mm"; }

double furthest_since(std::size_t push, const simulate::ToolTrial& trial,
                      const simulate::Way& way) {
  double furthest = 0.0;
  for (std::size_t k = push; k < trial.pushes().size(); ++k) {
    furthest = std::max(furthest, way.find_progress(trial.tip_after(k)));
  }
  return furthest;
}

HookSearch::HookSearch(const Study& study, const ToolPair& pair, const simulate::TakeOff& place,
                       int side, const std::function<bool()>& cancelled, simulate::ToolTrial& trial,
                       Hooks hooks)
    : study_(study),
      place_(place),
      side_(side),
      every_hook_(hooks == Hooks::kEvery),
      cancelled_(cancelled),
      catheter_(study.catheters[static_cast<std::size_t>(pair.catheter)]),
      wire_(study.wires[static_cast<std::size_t>(pair.wire)]),
      trial_(trial) {}

HookState HookSearch::here(double off) const {
  return {{steps_, trial_.save()},
          off,
          measure(Until::kLevel, kCatheter),
          measure(Until::kFacing, kCatheter)};
}

void HookSearch::back_to(const HookState& state) {
  trial_.restore(state.mark);
  steps_ = state.steps;
}

bool HookSearch::go(const ToolStep& step) {
  const HookState before = here();
  ++findings_.branches;
  const std::size_t pushes = trial_.pushes().size();
  trial_.make(step);
  const double furthest = furthest_since(pushes, trial_, *study_.goal.way);
  if (furthest > findings_.furthest) {
    findings_.furthest = furthest;
    findings_.closest = with(steps_, step);
  }
  if (!trial_.ended()) {
    steps_ = with(steps_, step);
    return true;
  }
  if (trial_.reached()) {
    keep(with(steps_, step));
  } else {
    findings_.stopped = trial_.reason();
  }
  back_to(before);
  return false;
}

double HookSearch::off() {
  const Vec3 tip = trial_.tip(kCatheter), along = trial_.tip_direction(kCatheter);
  const Vec3 to = place_.point - tip;
  const double depth = std::max(0.0, -to.dot(place_.branch));  // of the tip in the branch
  const double distance = std::max(0.0, to.norm() - depth);
  if (findings_.nearest_hook < 0.0 || distance < findings_.nearest_hook) {
    findings_.nearest_hook = distance;
  }
  const double ahead = std::max(0.0, to.dot(along));
  return (to - ahead * along).norm() + kTemplate.far * ahead +
         kTemplate.aside * (1.0 - along.dot(place_.branch));
}

bool HookSearch::looks_away() {
  const double along = trial_.tip_direction(kCatheter).dot(place_.branch);
  least_aside_ = std::min(least_aside_, std::acos(std::clamp(along, -1.0, 1.0)));
  looked_there_ = looked_there_ || along >= kTemplate.toward;
  return along < kTemplate.toward;
}

std::vector<HookState> HookSearch::turn_and_pull() {
  std::vector<HookState> hooks;
  bool made = true;  // all that was to be tried
  const HookState start = here();
  for (const double side : {1.0, -1.0}) {
    back_to(start);
    const int turns = side > 0.0 ? kTemplate.turns / 2 : (kTemplate.turns - 1) / 2;
    if (side > 0.0) pull_past(hooks);
    made = turn_on(side, turns, hooks) && made;
  }
  const bool none = !looked_there_ && side_ < 0, turns = may_turn();
  for (const double side : {1.0, -1.0}) {
    if (!none || !turns || stop()) break;
    back_to(start);
    bool turned = true;
    for (double left = 0.5 * kTemplate.turns * kTemplate.turn; turned && left > 1e-9 && !stop();) {
      const double by = std::min(left, study_.tool_rules.most_turn);
      turned = turn_hub(side * by);
      left -= by;
    }
    made = turned && let_twist_through() && turn_on(side, kTemplate.turns / 2, hooks) && made;
  }
  if (none && !looked_there_ && made && !stop()) {
    findings_.stopped =
        std::string(turns ? "at all turns of its hub, by up to a whole one to either side"
                          : "with its hub as it is, since tool_rules let it not be turned") +
        ", the catheter's tip looks at least " +
        std::to_string(std::lround(least_aside_ / kRadPerDeg)) + " degrees away from the branch";
  }
  return hooks;
}

bool HookSearch::turn_on(double side, int turns, std::vector<HookState>& hooks) {
  if (!may_turn()) return true;
  const double by = std::min(kTemplate.turn, study_.tool_rules.most_turn);
  for (double left = turns * kTemplate.turn; left > 1e-9 && !stop(); left -= by) {
    if (!turn_hub(side * std::min(by, left))) return false;
    pull_past(hooks);
  }
  return true;
}

bool HookSearch::may_turn() const { return study_.tool_rules.most_turn >= kTemplate.least_turn; }

double HookSearch::turned_in_place() const {
  double turned = 0.0;
  for (auto step = steps_.rbegin(); step != steps_.rend(); ++step) {
    if (step->tool == kWire) continue;
    if (step->push != 0.0) break;
    turned += step->turn;
  }
  return turned;
}

bool HookSearch::turn_hub(double by) {
  const double most = study_.tool_rules.most_turn + 1e-9;
  return (std::abs(turned_in_place() + by) <= most || let_twist_through()) &&
         go({.tool = kCatheter, .turn = by});
}

bool HookSearch::let_twist_through() {
  const double least = std::abs(turned_in_place()) / study_.tool_rules.turn_per_length;
  return go({.tool = kBothTools, .push = -std::max(kTemplate.pull, std::ceil(least - 1e-9))});
}

StartFindings HookSearch::raise_from_here(std::vector<RaisedTools>& depths,
                                          const std::function<std::string()>& raise) {
  if (trial_.ended()) {
    findings_.stopped = trial_.reason();
    return std::move(findings_);
  }
  const HookState start = here();
  const std::string why = raise();
  findings_.stopped = depths.empty() ? why : "";
  findings_.nearest_hook = -1.0;  // of the target's ostium none was looked for
  back_to(start);
  return std::move(findings_);
}

bool HookSearch::follow_behind(double by) {
  const double ahead = insertion(kCatheter) - by - insertion(kWire);
  return ahead < 1.0 || go({.tool = kWire, .push = std::floor(ahead)});
}

bool HookSearch::turn_below(double by, double push) {
  if (!may_turn()) return false;
  const double most = study_.tool_rules.most_turn;
  const double least = most / study_.tool_rules.turn_per_length;
  while (std::abs(by) > 1e-9) {
    const double part = std::clamp(by, -most, most);
    if (!go({.tool = kCatheter, .turn = part})) return false;
    by -= part;
    if (std::abs(by) > 1e-9 &&
        !go({.tool = kBothTools, .push = std::max(push, std::ceil(least))})) {
      return false;
    }
  }
  return true;
}

std::string HookSearch::find_broken(const std::vector<ToolStep>& steps) const {
  return find_broken_rule(steps, catheter_, wire_, study_.tool_rules);
}

void HookSearch::pull_past(std::vector<HookState>& hooks) {
  // Up the trunk a tip looks away from a vessel that leaves it downward, until it springs over.
  if (looks_away() && !every_hook_ && side_ < 0) return;
  const double level = measure(Until::kLevel, kCatheter);
  move_past(-kTemplate.pull, hooks);
  if (level < 0.0) move_past(kTemplate.pull, hooks);
}

void HookSearch::move_past(double by, std::vector<HookState>& hooks) {
  const HookState turned = here();
  std::vector<HookState> own = {here(off())};
  const int moves = static_cast<int>(std::ceil(kTemplate.most_pull / kTemplate.pull));
  for (int move = 0; move < moves && !stop(); ++move) {
    const double past = by > 0.0 ? own.back().level : -own.back().level;
    if (past > kTemplate.below) break;
    if (!go({.tool = kBothTools, .push = by})) break;
    broken_ = find_broken(steps_);  // a longer pull may not
    own.push_back(here(broken_.empty() ? off() : HUGE_VAL));
    own.back().facing = turned.facing;
  }
  if (every_hook_) {
    std::move(own.begin(), own.end(), std::back_inserter(hooks));
  } else {
    keep_best(std::move(own), hooks);
  }
  back_to(turned);
}

void HookSearch::keep_best(std::vector<HookState> own, std::vector<HookState>& hooks) {
  const auto apart = static_cast<std::ptrdiff_t>(kTemplate.apart / kTemplate.pull);
  std::vector<std::ptrdiff_t> kept;
  for (std::size_t n = 0; n < kTemplate.depths; ++n) {
    std::ptrdiff_t best = -1;
    for (std::ptrdiff_t k = 0; k < std::ssize(own); ++k) {
      const bool near = std::any_of(kept.begin(), kept.end(), [&](std::ptrdiff_t other) {
        return std::abs(other - k) < apart;
      });
      const auto slot = static_cast<std::size_t>(k);
      if (near || !std::isfinite(own[slot].off)) continue;
      if (best < 0 || own[slot].off < own[static_cast<std::size_t>(best)].off) best = k;
    }
    if (best < 0) break;
    kept.push_back(best);
  }
  for (const std::ptrdiff_t k : kept) hooks.push_back(std::move(own[static_cast<std::size_t>(k)]));
}

std::vector<RaisedTools> HookSearch::keep_facing(std::vector<HookState> all, std::size_t most) {
  const auto aside = [](const HookState& state) {
    return std::isfinite(state.facing) ? std::abs(state.facing) : kPi;
  };
  std::stable_sort(all.begin(), all.end(),
                   [&](const HookState& a, const HookState& b) { return aside(a) < aside(b); });
  if (all.size() > most) all.resize(most);
  return {all.begin(), all.end()};
}

void HookSearch::end_by_sight(const HookState& hook, std::size_t begun) {
  const auto first = steps_.rend() - static_cast<std::ptrdiff_t>(begun);
  const auto turn =
      std::find_if(steps_.rbegin(), first, [](const ToolStep& step) { return step.turn != 0.0; });
  if (turn != first && std::isfinite(hook.facing)) {
    const double side = turn->turn > 0.0 ? 1.0 : -1.0;
    const double most = std::min(std::abs(turn->turn) + kTemplate.turn_slack,
                                 std::max(std::abs(turn->turn), study_.tool_rules.most_turn));
    turn->turn = side * most;
    end_at(*turn, Until::kFacing, hook.facing);
  }
  const auto pull = std::find_if(steps_.rbegin(), turn,
                                 [](const ToolStep& step) { return step.tool == kBothTools; });
  if (pull != turn && std::isfinite(hook.level)) {
    pull->push += pull->push > 0.0 ? kTemplate.slack : -kTemplate.slack;
    end_at(*pull, Until::kLevel, hook.level);
  }
}

}  // namespace wireplan::plan
