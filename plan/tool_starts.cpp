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

/// All chosen.
struct Template {
  double beyond = 60.0;     // of the wire past the ostium, at most                          [mm]
  double before_end = 9.0;  // of its tip, short of where the image ends                     [mm]
  int lower = 2;            // pushes less, where the catheter straightens it out of the image
  double short_of = 30.0;   // the ostium, of a wire that leads a catheter to below it          [mm]
  double leads = 12.0;      // of the wire ahead of the catheter, at least                   [mm]
  double above[2] = {12.0, 35.0};  // of the catheter's tip past the ostium                    [mm]
  double depths_apart = 10.0;      // of these two, where the vessel is not seen that far      [mm]
  double below = 15.0;             // ... and before it, in pulls                               [mm]
  double most_pull = 60.0;         // of a tip that lies in a branch beyond                     [mm]
  double turn = 30.0 * kRadPerDeg;
  int turns = 12;
  double least_turn = 5.0 * kRadPerDeg;  // a hub that may be turned by less is left as it is
  double pull = 2.0;       //                                                               [mm]
  double toward = 0.0;     // the branch, of the tip's direction: less looks away
  double far = 0.2;        // what a millimetre between tip and ostium counts as             [mm]
  double aside = 4.0;      // what a tip square to the branch counts as                     [mm]
  std::size_t depths = 4;  // hooks of a turn, of the states along a pull, ...
  double apart = 4.0;      // ... so far from each other                                       [mm]
  std::size_t tries = 14;  // hooks of a start that the wire is brought out of
  double out = 10.0;       // of the wire between two looks                                 [mm]
  double astray = 20.0;    // of the wire out of the mouth and not in the branch            [mm]
  double in_branch = 6.0;  // past the ostium: worth following                              [mm]
  double follow = 12.0;    // of the catheter over the wire                                 [mm]
  int follows = 3;
  double spare = 40.0;  // of the last push, for patients who differ ...                  [mm]
  double slack = 12.0;  // ... and of pushes and pulls that end by what is seen           [mm]
  double turn_slack = 30.0 * kRadPerDeg;  // ... and of turns
  int rounds = 4;  // of tries of a wire that passes the ostium by, at most, from so far beside
  double again_pull = 3.0, again_turn = 15.0 * kRadPerDeg;  //                          [mm, rad]
  int steers = 16;                                          // of a wire on its way up, at most
  std::size_t weighed = 5;  // scripts of a start whose neighbours are tried
};
constexpr Template kTemplate;

constexpr int kCatheter = 0, kWire = 1;

/// Steps one after the other, pushes of the same tool in one direction as one, turns too.
std::vector<ToolStep> with(std::vector<ToolStep> steps, const ToolStep& next) {
  if (!steps.empty() && steps.back().tool == next.tool && steps.back().until == Until::kMade) {
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

/// A script on its way, past where it started.
struct State : RaisedTools {
  double off = 0.0;     // how badly the catheter's tip lies for the ostium                   [mm]
  double level = 0.0;   // of the catheter's tip beyond the ostium                            [mm]
  double facing = 0.0;  // where it looked after the turn, NaN: nowhere                    [rad]
};

/// What the hand does until it sees that: rounded as it is told.
void end_at(ToolStep& step, Until until, double at) {
  step.until = until;
  const double unit = until == Until::kFacing ? 5.0 * kRadPerDeg : 0.5;  // [rad], [mm]
  step.at = unit * std::round(at / unit);
}

/// Serial.
class ToolSearch {
 public:
  ToolSearch(const Study& study, const ToolPair& pair, const Ostium& ostium,
             const std::function<bool()>& cancelled, ToolTrial& trial, Hooks hooks)
      : study_(study),
        ostium_(ostium),
        every_hook_(hooks == Hooks::kEvery),
        cancelled_(cancelled),
        catheter_(study.catheters[static_cast<std::size_t>(pair.catheter)]),
        wire_(study.wires[static_cast<std::size_t>(pair.wire)]),
        trial_(trial) {}

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
      std::vector<State> hooks = turn_and_pull();
      std::stable_sort(hooks.begin(), hooks.end(),
                       [](const State& a, const State& b) { return a.off < b.off; });
      if (!every_hook_ && hooks.size() > kTemplate.tries) hooks.resize(kTemplate.tries);
      for (const State& hook : hooks) {
        if (stop()) break;
        wire_out(hook);
      }
    }
    return end();
  }

 private:
  bool stop() const { return cancelled_ && cancelled_(); }

  double insertion(int tool) const { return trial_.insertion(tool); }
  double progress() const {
    return trial_.pushes().empty() ? 0.0 : study_.goal.way->find_progress(trial_.foremost_tip());
  }
  State here(double off = 0.0) const {
    return {{steps_, trial_.save()},
            off,
            trial_.measure(Until::kLevel, kCatheter),
            trial_.measure(Until::kFacing, kCatheter)};
  }

  StartFindings end() {
    back_to(begin_);
    if (findings_.found.empty() && !broken_.empty()) {
      findings_.stopped = "its scripts break a rule of the case: " + broken_;
    }
    weigh_found();
    return std::move(findings_);
  }
  void back_to(const State& state) {
    trial_.restore(state.mark);
    steps_ = state.steps;
  }

  /// Makes a step and adds it to the script; takes it back where it ends the trial. False there,
  /// and where it reaches the target, which keeps the script.
  bool go(const ToolStep& step) {
    const State before = here();
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

  /// A script whose last push reached. For patients who differ, that may go on for longer.
  void keep(std::vector<ToolStep> steps) {
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
      for (const ToolScript& script : list_neighbours(found.steps)) {
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

  /// How far the line on from the catheter's tip, which the wire will take, passes the ostium by;
  /// the further off that is, the less it counts.
  double off() {
    const Vec3 tip = trial_.tip(kCatheter), along = trial_.tip_direction(kCatheter);
    const Vec3 to = ostium_.point - tip;
    const double depth = std::max(0.0, -to.dot(ostium_.branch));  // of the tip in the branch
    const double distance = std::max(0.0, to.norm() - depth);
    if (findings_.nearest_hook < 0.0 || distance < findings_.nearest_hook) {
      findings_.nearest_hook = distance;
    }
    const double ahead = std::max(0.0, to.dot(along));
    return (to - ahead * along).norm() + kTemplate.far * ahead +
           kTemplate.aside * (1.0 - along.dot(ostium_.branch));
  }

  /// Whether the catheter's tip looks away from the branch, so that pulling it past is in vain.
  bool looks_away() {
    const double along = trial_.tip_direction(kCatheter).dot(ostium_.branch);
    least_aside_ = std::min(least_aside_, std::acos(std::clamp(along, -1.0, 1.0)));
    looked_there_ = looked_there_ || along >= kTemplate.toward;
    return along < kTemplate.toward;
  }

  /// Of each turn the states that lie best while both tools are pulled past the ostium. Where bends
  /// hold the twist and the tip looks away from the branch at all turns, the hub is turned on,
  /// after a short pull, which lets the twist through.
  std::vector<State> turn_and_pull() {
    std::vector<State> hooks;
    bool made = true;  // all that was to be tried
    const State start = here();
    for (const double side : {1.0, -1.0}) {
      back_to(start);
      const int turns = side > 0.0 ? kTemplate.turns / 2 : (kTemplate.turns - 1) / 2;
      if (side > 0.0) pull_past(hooks);
      made = turn_on(side, turns, hooks) && made;
    }
    const bool none = !looked_there_, turns = may_turn();
    for (const double side : {1.0, -1.0}) {
      if (!none || !turns || stop()) break;
      back_to(start);
      bool turned = true;
      for (double left = 0.5 * kTemplate.turns * kTemplate.turn;
           turned && left > 1e-9 && !stop();) {
        const double by = std::min(left, study_.tool_rules.most_turn);
        turned = turn_hub(side * by);
        left -= by;
      }
      made = turned && let_twist_through() && turn_on(side, kTemplate.turns / 2, hooks) && made;
    }
    if (!looked_there_ && made && !stop()) {
      findings_.stopped =
          std::string(turns ? "at all turns of its hub, by up to a whole one to either side"
                            : "with its hub as it is, since tool_rules let it not be turned") +
          ", the catheter's tip looks at least " +
          std::to_string(std::lround(least_aside_ / kRadPerDeg)) + " degrees away from the branch";
    }
    return hooks;
  }

  /// So many turns to one side from here, each with its pull; false where one cannot be made.
  bool turn_on(double side, int turns, std::vector<State>& hooks) {
    if (!may_turn()) return true;
    const double by = std::min(kTemplate.turn, study_.tool_rules.most_turn);
    for (double left = turns * kTemplate.turn; left > 1e-9 && !stop(); left -= by) {
      if (!turn_hub(side * std::min(by, left))) return false;
      pull_past(hooks);
    }
    return true;
  }

  bool may_turn() const { return study_.tool_rules.most_turn >= kTemplate.least_turn; }

  /// Of the hub since the catheter was pushed or pulled.
  double turned_in_place() const {
    double turned = 0.0;
    for (auto step = steps_.rbegin(); step != steps_.rend(); ++step) {
      if (step->tool == kWire) continue;
      if (step->push != 0.0) break;
      turned += step->turn;
    }
    return turned;
  }

  /// Turns the catheter's hub, where it has been turned as far as the rules let after a pull.
  bool turn_hub(double by) {
    const double most = study_.tool_rules.most_turn + 1e-9;
    return (std::abs(turned_in_place() + by) <= most || let_twist_through()) &&
           go({.tool = kCatheter, .turn = by});
  }

  /// A pull, as long as the rules ask for after the turn.
  bool let_twist_through() {
    const double least = std::abs(turned_in_place()) / study_.tool_rules.turn_per_length;
    return go({.tool = kBothTools, .push = -std::max(kTemplate.pull, std::ceil(least - 1e-9))});
  }

  std::string find_broken(const std::vector<ToolStep>& steps) const {
    return find_broken_rule(steps, catheter_, wire_, study_.tool_rules);
  }

  /// Adds the best states of a pull from here, and comes back here. From below the ostium, as where
  /// the image ends too near above it, of a push as well.
  void pull_past(std::vector<State>& hooks) {
    if (looks_away() && !every_hook_) return;
    const double level = trial_.measure(Until::kLevel, kCatheter);
    move_past(-kTemplate.pull, hooks);
    if (level < 0.0) move_past(kTemplate.pull, hooks);
  }

  /// The same by moves of so much.
  void move_past(double by, std::vector<State>& hooks) {
    const State turned = here();
    std::vector<State> own = {here(off())};
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

  /// Of the states along a pull those that lie best, and not next to each other.
  static void keep_best(std::vector<State> own, std::vector<State>& hooks) {
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
    for (const std::ptrdiff_t k : kept)
      hooks.push_back(std::move(own[static_cast<std::size_t>(k)]));
  }

  /// Out of the mouth into the branch; where it comes no further the catheter follows it.
  void wire_out(const State& hook) {
    back_to(hook);
    hook_ = &hook;
    end_by_sight(hook);
    for (int follow = 0; follow <= kTemplate.follows && !stop(); ++follow) {
      State best = here();
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
      if (by < kTemplate.pull || !go({.tool = kCatheter, .push = std::floor(by)})) return;
    }
  }

  /// The last turn of a hook and the pull after it end where they brought the tip to, not by their
  /// length.
  void end_by_sight(const State& hook) {
    const auto turn = std::find_if(steps_.rbegin(), steps_.rend(),
                                   [](const ToolStep& step) { return step.turn != 0.0; });
    if (turn != steps_.rend() && std::isfinite(hook.facing)) {
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

  static std::string mm_text(double value) { return std::to_string(std::lround(value)) + " mm"; }

  const Study& study_;
  const Ostium& ostium_;
  const bool every_hook_;
  const std::function<bool()>& cancelled_;
  const Catheter& catheter_;
  const simulate::Wire& wire_;
  ToolTrial& trial_;
  State begin_;  // that the steps searched for begin at
  struct Up {
    State state;
    Vec3 tip;
  };
  std::vector<Up> ups_;  // of the wire on its way past the ostium
  std::vector<ToolStep> steps_;
  const State* hook_ = nullptr;  // that the wire is brought out of
  StartFindings findings_;
  std::string broken_;         // rule, by the longest pull or the last that reached
  double least_aside_ = kPi;   // of the catheter's tip and the branch, turned              [rad]
  bool looked_there_ = false;  // by less than a right angle
};

}  // namespace

double room_beyond() { return kTemplate.above[0] + kTemplate.leads + kTemplate.before_end; }

double furthest_since(std::size_t push, const simulate::ToolTrial& trial,
                      const simulate::Way& way) {
  double furthest = 0.0;
  for (std::size_t k = push; k < trial.pushes().size(); ++k) {
    furthest = std::max(furthest, way.find_progress(trial.pushes()[k].tip));
  }
  return furthest;
}

WayUp go_up(const Study& study, const ToolPair& pair, const Ostium& ostium,
            const simulate::VesselModel& vessel, Hooks hooks,
            const std::function<bool()>& cancelled) {
  WayUp up;
  const Candidate begun = first_candidate(study, pair);
  up.trial = std::make_unique<ToolTrial>(tools_of(study, begun), make_introducer(study, begun),
                                         study.goal, vessel, tool_options(study, begun));
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
