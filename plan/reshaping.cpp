#include "plan/reshaping.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "plan/catheter_choice.h"
#include "plan/side_vessels.h"

namespace wireplan::plan {
namespace {

using simulate::kBothTools;
using simulate::SideVessel;
using simulate::ToolTrial;
using simulate::Until;

/// All chosen.
struct Reshape {
  double beyond = 45.0, above = 30.0;  // of wire and catheter past the mouth               [mm]
  double left_in = 5.0;                // of the wire, at least                             [mm]
  double in = 15.0;                    // of a wire that goes into the vessel ...           [mm]
  double astray = 40.0;                // ... before so much of it is out of the catheter   [mm]
  double shares[2] = {0.85, 0.6};      // of the knee's length, that the tip goes in
  double slack = 12.0;                 // of pushes that end by what is seen                    [mm]
  double cover = 6.0;                  // of the curve behind its end, without a wire           [mm]
  double turns[3] = {0.0, 90.0 * kRadPerDeg, -90.0 * kRadPerDeg};  // as the knee rises
  double out = 2.0;   // of the tip, beyond the mouth's level, once it is out              [mm]
  double back = 0.3;  // cosine: it looks back down the trunk then
  double over[2] = {10.0, 2.0};  // of the tip past the ostium, to be pulled down [mm]
  double lets = 4.0;  // of a push that lets the twist through                              [mm]
  int quarters = 3;   // turns of the hub to either side, below
  std::size_t depths = 2;  // of those
};
constexpr Reshape kReshape;

/// Serial.
class Reshaping : private HookSearch {
 public:
  Reshaping(const Study& study, const ToolPair& pair, const SideVessel& side,
            const std::function<bool()>& cancelled, ToolTrial& trial)
      : HookSearch(study, pair, side.take_off, side.branch, cancelled, trial, Hooks::kBest),
        knee_(knee_length(catheter_.tool.wire)),
        all_(curved_length(catheter_.tool.wire, false) + kReshape.cover),
        first_(curved_length(catheter_.tool.wire, true) + kReshape.cover) {}

  StartFindings go_up(std::vector<RaisedTools>& depths) {
    return raise_from_here(depths, [&] { return reshape(depths); });
  }

 private:
  void keep(ToolScript) override {}

  std::string reshape(std::vector<RaisedTools>& depths) {
    const HookState start = here();
    if (lead_up()) depths = form_from(here());
    back_to(start);
    if (depths.empty() && !stop() && go_past()) {
      const HookState past = here();
      for (const double withdrawn : {first_, all_}) {
        back_to(past);
        if (depths.empty() && !stop()) depths = form(withdrawn);
      }
    }
    return why_;
  }

  /// With the wire withdrawn by so much behind the catheter's tip, into the vessel and on.
  std::vector<RaisedTools> form(double withdrawn) {
    const double back = std::ceil(insertion(kWire) - insertion(kCatheter) + withdrawn);
    if (!go({.tool = kWire, .push = -std::min(back, insertion(kWire) - kReshape.left_in)})) {
      return {};
    }
    const HookState past = here();
    std::vector<HookState> hooks = turn_and_pull();
    std::stable_sort(hooks.begin(), hooks.end(),
                     [](const HookState& a, const HookState& b) { return a.off < b.off; });
    if (hooks.size() > kTemplate.tries) hooks.resize(kTemplate.tries);
    tell(1, "its wire does not go into it");
    for (const HookState& hook : hooks) {
      if (stop()) break;
      if (!lead_into(hook, past)) continue;
      std::vector<RaisedTools> depths = form_from(here());
      if (!depths.empty()) return depths;
    }
    return {};
  }

  /// With the wire in the vessel.
  std::vector<RaisedTools> form_from(const HookState& led) {
    tell(2, "its knee does not rise from there");
    if (!open_from(led)) return {};
    std::vector<RaisedTools> depths = raise(here());
    if (depths.empty()) tell(3, "once it has opened, " + stopped_below_);
    return depths;
  }

  /// Of what stopped it that which came furthest.
  void tell(int came, const std::string& why) {
    if (came < came_) return;
    came_ = came;
    why_ = why;
  }

  /// The wire, out of the introducer: one that lies along the wall goes into what leaves there.
  bool lead_up() {
    const double steered = std::floor(place_.arc - simulate::kSteerNear - insertion(kWire));
    return (steered <= 0.0 || go({.tool = kWire, .push = steered, .steers = kTemplate.steers})) &&
           wire_into();
  }

  /// Wire and catheter past the mouth.
  bool go_past() {
    const double to = std::floor(place_.arc);
    return go({.tool = kWire,
               .push = to + kReshape.beyond - insertion(kWire),
               .steers = kTemplate.steers}) &&
           go({.tool = kCatheter, .push = to + kReshape.above});
  }

  /// The wire, out of a hook: the pull ends where the tip was seen to spring over, or, where that
  /// does not do, by its length.
  bool lead_into(const HookState& hook, const HookState& past) {
    back_to(hook);
    if (!comes_into()) return false;
    ToolScript seen(hook.steps.begin() + static_cast<std::ptrdiff_t>(past.steps.size()),
                    hook.steps.end());
    if (!seen.empty() && seen.back().tool == kBothTools) {
      end_at(seen.back(), Until::kLevel, hook.level);
      seen.back().side = side_;
      seen.back().push -= kReshape.slack;
      back_to(past);
      const bool made = std::all_of(seen.begin(), seen.end(),
                                    [&](const simulate::ToolStep& step) { return go(step); });
      if (made && wire_into()) return true;
    }
    back_to(hook);
    return wire_into();
  }

  /// Whether the wire does go into the vessel: not one that is far out elsewhere.
  bool comes_into() {
    for (double out = 0.0; out < kReshape.astray && !stop();) {
      if (!go({.tool = kWire, .push = kTemplate.out})) return false;
      if (measure(Until::kInBranch, kWire) >= kReshape.in) return true;
      if (insertion(kWire) > insertion(kCatheter)) out += kTemplate.out;
    }
    return false;
  }

  bool wire_into() {
    const double to = std::round(knee_ + kWireLeads);
    const double from = std::max(insertion(kCatheter), std::floor(place_.arc));
    return go({.tool = kWire,
               .push = std::ceil(from - insertion(kWire) + to + kReshape.astray),
               .until = Until::kInBranch,
               .at = to,
               .side = side_}) &&
           measure(Until::kInBranch, kWire) > to - 1.0;
  }

  /// The catheter, after the wire, which is then withdrawn; then pushed until its tip is out.
  bool open_from(const HookState& led) {
    for (const double share : kReshape.shares) {
      back_to(led);
      const double to = std::round(share * knee_);
      const double outside =
          std::max({0.0, -measure(Until::kInBranch, kCatheter), place_.arc - insertion(kCatheter)});
      const double push = to + kReshape.slack + outside;
      if (!go({.tool = kCatheter,
               .push = std::ceil(push),
               .until = Until::kInBranch,
               .at = to,
               .side = side_})) {
        continue;
      }
      if (measure(Until::kInBranch, kCatheter) < to - 1.0) continue;
      const double back = insertion(kWire) - insertion(kCatheter) + all_;
      if (!go({.tool = kWire, .push = -std::ceil(back)})) continue;
      const HookState in = here();
      for (const double turn : kReshape.turns) {
        if (stop()) return false;
        back_to(in);
        if (turn != 0.0 && !(may_turn() && turn_hub(turn))) continue;
        if (push_out()) return true;
      }
    }
    return false;
  }

  bool push_out() {
    if (!go({.tool = kCatheter,
             .push = std::ceil(2.0 * knee_ + 40.0),
             .until = Until::kLevel,
             .at = kReshape.out,
             .side = side_})) {
      return false;
    }
    return measure(Until::kLevel, kCatheter) > kReshape.out - 1.0 &&
           trial_.tip_direction(kCatheter).dot(place_.trunk) < -kReshape.back;
  }

  /// The wire behind the knee, and both up past the target's ostium, the hub turned below.
  std::vector<RaisedTools> raise(const HookState& formed) {
    back_to(formed);
    if (!follow_behind(all_)) return {};
    const HookState below = here();
    std::vector<HookState> all;
    for (int quarter = -kReshape.quarters; quarter <= kReshape.quarters && !stop(); ++quarter) {
      back_to(below);
      if (quarter != 0 && !turn_below(0.5 * kPi * quarter, kReshape.lets)) continue;
      if (!rise()) continue;
      all.push_back(here());
      all.back().facing = trial_.measure(Until::kFacing, kCatheter);
    }
    return keep_facing(std::move(all), kReshape.depths);
  }

  /// Both tools, until the catheter's tip is past the target's ostium: less where the image ends
  /// too near above for the knee.
  bool rise() {
    const HookState below = here();
    for (const double over : kReshape.over) {
      back_to(below);
      const double level = trial_.measure(Until::kLevel, kCatheter);
      const bool made = go({.tool = kBothTools,
                            .push = std::ceil(over - level + 3.0 * kReshape.slack),
                            .until = Until::kLevel,
                            .at = over});
      const double left = over - trial_.measure(Until::kLevel, kCatheter);
      if (made && left < 1.0) return true;
      stopped_below_ = made ? "its tip is left " + mm_text(left) + " below the ostium's level"
                            : findings_.stopped;
    }
    return false;
  }

  const double knee_, all_, first_;  // lengths from the tip                                  [mm]
  std::string stopped_below_ = "its hub is not turned";      // what kept it from coming up
  std::string why_ = "the catheter does not come up to it";  // no depth was come to
  int came_ = 0;                                             // of the steps of form(), until that
};

}  // namespace

WayUp go_up_reshaped(const Study& study, const ToolPair& pair, const SideVessel& side,
                     const simulate::VesselModel& vessel, const std::function<bool()>& cancelled) {
  WayUp up = begin_way_up(study, pair, vessel);
  up.findings = Reshaping(study, pair, side, cancelled, *up.trial).go_up(up.depths);
  return up;
}

}  // namespace wireplan::plan
