#include "plan/opening.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "plan/catheter_choice.h"
#include "plan/side_vessels.h"

namespace wireplan::plan {
namespace {

using simulate::kBothTools;
using simulate::ToolTrial;
using simulate::Until;

/// All chosen.
struct Opening {
  double cover = 6.0;  // of the curve behind its end, without a wire                      [mm]
  int quarters = 4;    // turns of the hub to either side
  double lets = 4.0;   // of a push that lets the twist through                            [mm]
  double back = 100.0 * kRadPerDeg;  // the tip looks back then ...
  double least = 90.0 * kRadPerDeg;  // ... and does still above the ostium
  double push = 100.0;               // of a curve that opens, and twice its knee's length [mm]
  double over = 10.0;                // of the tip past the ostium, to be pulled down      [mm]
  std::size_t depths = 2;
};
constexpr Opening kOpening;

/// Serial.
class OpenedCurve : private HookSearch {
 public:
  OpenedCurve(const Study& study, const ToolPair& pair, const Ostium& ostium, double depth,
              const std::function<bool()>& cancelled, ToolTrial& trial)
      : HookSearch(study, pair, ostium, -1, cancelled, trial, Hooks::kBest),
        to_(std::floor(ostium.arc + depth)),
        knee_(knee_length(catheter_.tool.wire)),
        all_(curved_length(catheter_.tool.wire, false) + kOpening.cover) {}

  StartFindings go_up(std::vector<RaisedTools>& depths) {
    return raise_from_here(depths, [&] { return open(depths); });
  }

 private:
  void keep(ToolScript) override {}

  std::string open(std::vector<RaisedTools>& depths) {
    if (!go_past()) return "the catheter does not come up to there";
    std::string why = "its tip does not come to look back";
    const HookState past = here();
    std::vector<HookState> all;
    for (int quarter = -kOpening.quarters; quarter <= kOpening.quarters && !stop(); ++quarter) {
      back_to(past);
      if (quarter != 0 && !turn_below(0.5 * kPi * quarter, kOpening.lets)) continue;
      if (!push_open()) continue;
      why = "once it has opened, it does not come back to the ostium";
      if (pull_down()) all.push_back(here());
    }
    depths = keep_facing(std::move(all), kOpening.depths);
    return why;
  }

  bool go_past() {
    return go({.tool = kWire,
               .push = to_ + kWireLeadsOn - insertion(kWire),
               .steers = kTemplate.steers}) &&
           go({.tool = kCatheter, .push = to_ - insertion(kCatheter)}) && withdraw();
  }

  /// The wire, to behind the curve.
  bool withdraw() {
    const double by = std::ceil(insertion(kWire) - insertion(kCatheter) + all_);
    return go({.tool = kWire, .push = -by});
  }

  bool push_open() {
    return go({.tool = kCatheter,
               .push = std::ceil(kOpening.push + 2.0 * knee_),
               .until = Until::kBack,
               .at = kOpening.back}) &&
           looks_back(kOpening.back - 0.1);
  }

  bool looks_back(double least) const { return measure(Until::kBack, kCatheter) > least; }

  bool pull_down() {
    if (!follow_behind(all_)) return false;
    // The knee comes no nearer than to the ostium.
    const double most = std::floor(insertion(kCatheter) - place_.arc - knee_);
    return most > 0.0 &&
           go({.tool = kBothTools, .push = -most, .until = Until::kLevel, .at = kOpening.over}) &&
           std::abs(measure(Until::kLevel, kCatheter) - kOpening.over) < 1.0 &&
           looks_back(kOpening.least);
  }

  const double to_;          // insertion of the catheter past the ostium                      [mm]
  const double knee_, all_;  // lengths from the tip                                           [mm]
};

}  // namespace

WayUp go_up_opened(const Study& study, const ToolPair& pair, const Ostium& ostium, double depth,
                   const simulate::VesselModel& vessel, const std::function<bool()>& cancelled) {
  WayUp up = begin_way_up(study, pair, vessel);
  up.findings = OpenedCurve(study, pair, ostium, depth, cancelled, *up.trial).go_up(up.depths);
  return up;
}

}  // namespace wireplan::plan
