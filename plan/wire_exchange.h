#pragma once
/// Exchange for another wire through the placed catheter: the template's last part where a wire,
/// as a stiff one, comes into no branch by itself (tool_search.h). Another wire's script hooks the
/// branch:
///   1. that wire leads out into the branch, past the target as far as the vessel goes on, at most
///      40 mm, so that a stiffer part of it lies in the ostium, and the catheter follows it; this
///      is left out where the hook alone holds;
///   2. the hand holds the catheter, withdraws the wire whole and brings in the other one up to
///      behind the catheter's tip, which has to be in the branch then;
///   3. the other wire goes on to the target.
#include "plan/tool_search.h"

namespace wireplan::plan {

/// Tries this for each pair that was tried and has no script that holds, after up to three scripts
/// of each wire that reached through the same catheter, four in all, with the hook alone and at a
/// few depths of the catheter in the branch, in parallel. Adds what is found to `all`, up to three
/// scripts of a pair as find_tool_scripts() chooses them. The same at any thread count.
void find_exchanges(const Study& study, const simulate::VesselModel& vessel,
                    const BatchOptions& options, ToolScripts& all);

}  // namespace wireplan::plan
