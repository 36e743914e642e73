#include "plan/tool_starts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace wireplan::plan {
namespace {

using simulate::kBothTools;
using simulate::ToolStep;
using simulate::ToolTrial;
using simulate::Until;

/// Serial.
class ToolSearch : private HookSearch {
 public:
  ToolSearch(const Study& study, const ToolPair& pair, const Ostium& ostium,
             const std::function<bool()>& cancelled, ToolTrial& trial, Hooks hooks)
      : HookSearch(study, pair, ostium, -1, cancelled, trial, hooks), ostium_(ostium) {}

  /// From the introducer, with the catheter at each of the depths.
  StartFindings go_up(std::vector<RaisedTools>& depths) {
    if (trial_.ended()) {
      findings_.stopped = trial_.reason();
      return std::move(findings_);
    }
    begin_ = here();
    if (wire_up()) depths = catheter_up();
    return end();
  }

  StartFindings search(const RaisedTools& up, double withdrawn, const StartFindings& way_up) {
    findings_.furthest = way_up.furthest;
    findings_.closest = way_up.closest;
    trial_.restore(up.mark);
    steps_ = up.steps;
    begin_ = here();
    const double back = insertion(kWire) - std::max(5.0, insertion(kCatheter) - withdrawn);
    if (back < 1e-9 || go({.tool = kWire, .push = -std::ceil(back)})) {
      begin_ = here();
      std::vector<HookState> hooks = turn_and_pull();
      std::stable_sort(hooks.begin(), hooks.end(),
                       [](const HookState& a, const HookState& b) { return a.off < b.off; });
      if (!every_hook_ && hooks.size() > kTemplate.tries) hooks.resize(kTemplate.tries);
      for (const HookState& hook : hooks) {
        if (stop()) break;
        wire_out(hook);
      }
    }
    return end();
  }

 private:
  double progress() const {
    return trial_.pushes().empty() ? 0.0 : study_.goal.way->find_progress(trial_.foremost_tip());
  }
  StartFindings end() {
    back_to(begin_);
    if (findings_.found.empty() && !broken_.empty()) {
      findings_.stopped = "its scripts break a rule of the case: " + broken_;
    }
    weigh_found();
    return std::move(findings_);
  }
  /// A script whose last push reached. For patients who differ, that may go on for longer.
  void keep(ToolScript steps) override {
    if (steps.back().push <= 0.0) return;
    steps.back().push += kTemplate.spare;
    if (hook_ != nullptr) let_try_again(steps);
    FoundScript found{.steps = std::move(steps)};
    if (hook_ != nullptr) {
      found.by_length = found.steps;
      for (std::size_t k = 0; k < hook_->steps.size(); ++k) found.by_length[k] = hook_->steps[k];
      if (found.by_length == found.steps || !find_broken(found.by_length).empty()) {
        found.by_length.clear();
      }
    }
    for (const ToolStep& step : found.steps) {
      if (step.turn != 0.0) found.turned += step.until == Until::kFacing ? step.at : step.turn;
      if (step.tool == kCatheter) found.depth += step.push;
      if (step.tool == kBothTools) found.depth += step.until == Until::kLevel ? step.at : 0.0;
    }
    for (const simulate::Push& push : trial_.pushes()) {
      found.peak_force = std::max(found.peak_force, push.peak_contact_force);
    }
    broken_ = find_broken(found.steps);
    if (broken_.empty()) findings_.found.push_back(std::move(found));
  }

  /// A wire that passes the ostium by is withdrawn and led out again: at each push out of the hook,
  /// since a catheter that holds at the first may be pushed out of the ostium by a later one.
  void let_try_again(std::vector<ToolStep>& steps) const {
    const ToolRules& rules = study_.tool_rules;  // the last round turns from one side to the other
    const double most = std::min(rules.most_turn, rules.turn_per_length * kTemplate.again_pull);
    const double allowed = std::floor(most / (2.0 * kTemplate.again_turn) + 1e-9);
    const int rounds = static_cast<int>(std::min<double>(kTemplate.rounds, allowed));
    if (rounds == 0) return;
    double side = 1.0;
    std::vector<ToolStep*> outs;
    for (std::size_t k = begin_.steps.size(); k < steps.size(); ++k) {
      ToolStep& step = steps[k];
      if (step.turn != 0.0) side = step.turn > 0.0 ? 1.0 : -1.0;
      if (step.tool == kBothTools || step.turn != 0.0) outs.clear();
      if (step.tool == kWire && step.push > 0.0) outs.push_back(&step);
    }
    for (ToolStep* out : outs) {
      out->tries = rounds * simulate::kTriesOfRound;
      out->try_pull = kTemplate.again_pull;
      out->try_turn = side * kTemplate.again_turn;
    }
  }

  /// Of the scripts that stand first without it, how often they and their neighbours reach.
  void weigh_found() {
    findings_.count = static_cast<int>(findings_.found.size());
    if (every_hook_) {
      std::for_each(findings_.found.begin(), findings_.found.end(), take_for_held);
      return;
    }
    findings_.found = choose_different(findings_.found, kTemplate.weighed);
    weigh(findings_.found);
    // Where a tip springs round, what ends a step may be seen sooner than it was found at.
    std::vector<FoundScript> others;
    std::vector<std::size_t> slots;
    for (std::size_t k = 0; k < findings_.found.size(); ++k) {
      const FoundScript& found = findings_.found[k];
      if (found.holds || found.by_length.empty()) continue;
      others.push_back(found);
      others.back().steps = found.by_length;
      others.back().spares.clear();
      slots.push_back(k);
    }
    weigh(others);
    for (std::size_t k = 0; k < others.size(); ++k) {
      FoundScript& found = findings_.found[slots[k]];
      if (others[k].holds && others[k].share >= found.share) found = std::move(others[k]);
    }
  }

  void weigh(std::vector<FoundScript>& chosen) {
    for (const FoundScript& found : chosen) {
      for (const ToolScript& script : list_neighbours(found.steps, begin_.steps.size())) {
        expects(std::equal(begin_.steps.begin(), begin_.steps.end(), script.begin()));
      }
    }
    findings_.branches += weigh_scripts(
        trial_, begin_.steps.size(),
        [&](const ToolScript& script) { return find_broken(script).empty(); }, cancelled_, chosen);
  }

  /// Beyond the ostium, or as far as the vessel is seen there. False where that is not far enough
  /// to lead the catheter.
  bool wire_up() {
    // Steered as far as it can be, then looked at after each push.
    const double far = ostium_.arc - simulate::kSteerNear - insertion(kWire);
    const double steered = kTemplate.out * std::floor(far / kTemplate.out);
    if (steered > 0.0 && !go({.tool = kWire, .push = steered, .steers = count_steers()})) {
      return false;
    }
    const double to = std::floor(ostium_.arc) + kTemplate.beyond;
    ups_ = {{here(), trial_.tip(kWire)}};
    bool ends = false;  // as where the image does
    while (!ends && to - insertion(kWire) > 1e-9 && !stop()) {
      ends = !go({.tool = kWire, .push = std::min(kTemplate.out, to - insertion(kWire))});
      if (!ends) ups_.push_back({here(), trial_.tip(kWire)});
    }
    if (ends) stay_short_of(ups_.back().tip);
    // A wire cuts bends short: it may lie beyond with less of it in than the way is long.
    const bool beyond = std::max(insertion(kWire) - ostium_.arc,
                                 trial_.measure(Until::kLevel, kWire)) > -kTemplate.short_of;
    if (beyond) findings_.stopped.clear();
    return beyond && findings_.found.empty();
  }

  /// To where the wire had been led before its tip came near to that end.
  void stay_short_of(const Vec3& end) {
    while (ups_.size() > 1 && (ups_.back().tip - end).norm() < kTemplate.before_end) {
      ups_.pop_back();
    }
    back_to(ups_.back().state);
  }

  /// As often as the rules let the catheter be turned; once without.
  int count_steers() const {
    const ToolRules& rules = study_.tool_rules;
    const double most = std::min(rules.most_turn, rules.turn_per_length * simulate::kSteerFurther);
    return most < simulate::kSteerTurn - 1e-9 ? 1 : kTemplate.steers;
  }

  /// Over the wire, to two depths, as far as it comes; the deeper one first. Where it straightens
  /// the wire out of the image, with the wire less far in.
  std::vector<RaisedTools> catheter_up() {
    std::vector<RaisedTools> depths = catheter_to_depths();
    for (int lower = 0; lower < kTemplate.lower && depths.empty() && !stop(); ++lower) {
      if (ups_.size() < 2) break;
      ups_.pop_back();
      back_to(ups_.back().state);
      depths = catheter_to_depths();
    }
    return depths;
  }

  std::vector<RaisedTools> catheter_to_depths() {
    const double deepest =
        std::min(std::floor(ostium_.arc + kTemplate.above[1]), insertion(kWire) - kTemplate.leads);
    const double first =
        std::min(std::floor(ostium_.arc + kTemplate.above[0]), deepest - kTemplate.depths_apart);
    std::vector<RaisedTools> depths;
    for (const double to : {first, deepest}) {
      if (to < 2.0 * kTemplate.pull || stop()) continue;
      if (!go({.tool = kCatheter, .push = to - insertion(kCatheter)})) break;
      depths.insert(depths.begin(), here());
    }
    return depths;
  }

  /// Out of the mouth into the branch; where it comes no further the catheter follows it.
  void wire_out(const HookState& hook) {
    back_to(hook);
    hook_ = &hook;
    end_by_sight(hook, begin_.steps.size());
    for (int follow = 0; follow <= kTemplate.follows && !stop(); ++follow) {
      HookState best = here();
      double furthest = 0.0, since = 0.0;
      const double most =
          insertion(kCatheter) - insertion(kWire) + ostium_.end - ostium_.arc + kTemplate.spare;
      const int pushes = static_cast<int>(std::ceil(most / kTemplate.out));
      for (int push = 0; push < pushes; ++push) {
        const std::size_t found = findings_.found.size();
        if (!go({.tool = kWire, .push = kTemplate.out})) {
          if (findings_.found.size() > found) return;
          break;
        }
        if (insertion(kWire) <= insertion(kCatheter)) continue;
        if (progress() > furthest) {
          furthest = progress();
          since = 0.0;
          best = here();
          continue;
        }
        since += kTemplate.out;
        if (since < kTemplate.astray) continue;
        findings_.stopped = "the wire comes no further than " + mm_text(furthest) +
                            " along the way out of the catheter";
        break;
      }
      if (furthest < ostium_.arc + kTemplate.in_branch) return;
      back_to(best);
      end_at(steps_.back(), Until::kInBranch, furthest - ostium_.arc);
      steps_.back().push += kTemplate.slack;
      const double by = std::min(kTemplate.follow, insertion(kWire) - insertion(kCatheter));
      const double further = is_reshaped(steps_) ? -std::floor(by) : std::floor(by);
      if (by < kTemplate.pull || !go({.tool = kCatheter, .push = further})) return;
    }
  }

  const Ostium& ostium_;
  HookState begin_;  // that the steps searched for begin at
  struct Up {
    HookState state;
    Vec3 tip;
  };
  std::vector<Up> ups_;              // of the wire on its way past the ostium
  const HookState* hook_ = nullptr;  // that the wire is brought out of
};

}  // namespace

double room_beyond() { return kTemplate.above[0] + kTemplate.leads + kTemplate.before_end; }

WayUp begin_way_up(const Study& study, const ToolPair& pair, const simulate::VesselModel& vessel) {
  WayUp up;
  const Candidate begun = first_candidate(study, pair);
  up.trial = std::make_unique<ToolTrial>(tools_of(study, begun), make_introducer(study, begun),
                                         study.goal, vessel, tool_options(study, begun));
  return up;
}

WayUp go_up(const Study& study, const ToolPair& pair, const Ostium& ostium,
            const simulate::VesselModel& vessel, Hooks hooks,
            const std::function<bool()>& cancelled) {
  WayUp up = begin_way_up(study, pair, vessel);
  up.findings = ToolSearch(study, pair, ostium, cancelled, *up.trial, hooks).go_up(up.depths);
  return up;
}

StartFindings search_start(const Study& study, const ToolPair& pair, const Ostium& ostium,
                           const WayUp& up, const RaisedTools& depth, double withdrawn, Hooks hooks,
                           const std::function<bool()>& cancelled) {
  ToolTrial trial(*up.trial);
  return ToolSearch(study, pair, ostium, cancelled, trial, hooks)
      .search(depth, withdrawn, up.findings);
}

}  // namespace wireplan::plan
