#pragma once
/// Where the way up and the pull down of a reversed curve begin that does not open in the trunk by
/// itself (references-2 L: a Simmons is formed in the left subclavian artery or over the
/// bifurcation, then pulled down into the ostium). As hands do it:
///   1. the wire is led up into a vessel that leaves the trunk. Where it does not go there by
///   itself, as from one leg into the other, it goes past, the catheter over it; the wire is
///   withdrawn behind the first curve, the catheter turned, both are pulled until its tip looks
///   into that vessel, and the wire goes out into it;
///   2. the catheter follows until its knee is at the mouth, and the wire is withdrawn behind the
///   knee;
///   3. the catheter is pushed: its knee rises in the trunk and draws the tip out;
///   4. the hub is turned, and both are pushed until the tip is beyond the target's ostium.
/// From there on it is searched as from a catheter that went up over its wire (tool_starts.h).
#include <functional>
#include <vector>

#include "plan/tool_starts.h"

namespace wireplan::plan {

/// From the introducer to above the ostium, with the curve reshaped in that vessel. The depths are
/// those with the tip turned nearest to the branch; empty where it does not come so far, which
/// `findings.stopped` tells. The same whatever else runs.
WayUp go_up_reshaped(const Study& study, const ToolPair& pair, const simulate::SideVessel& side,
                     const simulate::VesselModel& vessel, const std::function<bool()>& cancelled);

}  // namespace wireplan::plan
