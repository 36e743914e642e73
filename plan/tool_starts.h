#pragma once
/// The parts of a search for scripts of one pair of catheter and wire (tool_search.h): its way up,
/// which is made once, and the starts from there, of which each withdraws the wire by as much as
/// lets the catheter's curve form in one way.
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "plan/candidates.h"
#include "plan/tool_neighbours.h"

namespace wireplan::plan {

/// Which states along the pulls of a start the wire is brought out of: those that lie best, or all,
/// to hold the search against, of which each script that reaches is kept and none is weighed.
enum class Hooks { kBest, kEvery };

/// A script on its way, and where the trial that makes it is.
struct RaisedTools {
  ToolScript steps;
  simulate::ToolTrial::Mark mark;
};

struct StartFindings {
  std::vector<FoundScript> found;
  int count = 0;  // found, of which those are kept
  ToolScript closest;
  double nearest_hook = -1.0, furthest = 0.0;
  std::string stopped;
  long branches = 0;
};

struct WayUp {
  std::unique_ptr<simulate::ToolTrial> trial;  // whose marks `depths` are
  std::vector<RaisedTools> depths;             // of the catheter, up to two, the deepest first
  StartFindings findings;                      // scripts that reached on it
};

/// So much of the trunk past the ostium it takes to lead a catheter up over a wire and pull it down
/// into the branch [mm].
double room_beyond();

/// How far along the way the tip came in the pushes from this one on [mm].
double furthest_since(std::size_t push, const simulate::ToolTrial& trial, const simulate::Way& way);

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
