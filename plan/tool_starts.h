#pragma once
/// The parts of a search for scripts of one pair of catheter and wire (tool_search.h): its way up,
/// which is made once, and the starts from there, of which each withdraws the wire by as much as
/// lets the catheter's curve form in one way.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "plan/tool_hooks.h"

namespace wireplan::plan {

struct WayUp {
  std::unique_ptr<simulate::ToolTrial> trial;  // whose marks `depths` are
  std::vector<RaisedTools> depths;             // of the catheter, up to two, the deepest first
  StartFindings findings;                      // scripts that reached on it
};

/// So much of the trunk past the ostium it takes to lead a catheter up over a wire and pull it down
/// into the branch [mm].
double room_beyond();

/// Both tools at the introducer, with nothing found yet.
WayUp begin_way_up(const Study& study, const ToolPair& pair, const simulate::VesselModel& vessel);

/// The wire beyond the ostium, and the catheter over it.
WayUp go_up(const Study& study, const ToolPair& pair, const Ostium& ostium,
            const simulate::VesselModel& vessel, Hooks hooks,
            const std::function<bool()>& cancelled);

/// From one depth on, with the wire withdrawn to so far behind the catheter's tip [mm]. The way up
/// is left as it is: starts of it may be searched at the same time.
StartFindings search_start(const Study& study, const ToolPair& pair, const Ostium& ostium,
                           const WayUp& up, const RaisedTools& depth, double withdrawn, Hooks hooks,
                           const std::function<bool()>& cancelled);

}  // namespace wireplan::plan
