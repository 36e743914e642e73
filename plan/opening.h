#pragma once
/// Where the way up and the pull down of a reversed curve begin that opens in the trunk beyond the
/// target's ostium, where that is wide enough (references-2 L: a Simmons is formed in the ascending
/// aorta, then pulled back into the ostium). As hands do it:
///   1. the wire goes up past the ostium, steered past other vessels, the catheter over it, until
///   its curve is beyond, and the wire is withdrawn behind the curve;
///   2. the hub is turned, and the catheter pushed until its tip looks back: a knee goes on ahead
///   of it along one wall, while the tip is held by the other;
///   3. the wire follows to behind the knee, and both are pulled until the tip is near the ostium.
/// From there on it is searched as from a catheter that went up over its wire (tool_starts.h).
#include <functional>

#include "plan/tool_starts.h"

namespace wireplan::plan {

/// From the introducer to above the ostium, with the catheter's tip so far past it on the way up
/// (find_opening_depth()). As go_up_reshaped().
WayUp go_up_opened(const Study& study, const ToolPair& pair, const Ostium& ostium, double depth,
                   const simulate::VesselModel& vessel, const std::function<bool()>& cancelled);

}  // namespace wireplan::plan
