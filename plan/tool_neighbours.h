#pragma once
/// How a script of catheter and wire does where the hand does it a little otherwise. Scripts that
/// begin alike are made once as far as they do.
#include <functional>
#include <vector>

#include "simulate/insertion/tool_trial.h"

namespace wireplan::plan {

using ToolScript = std::vector<simulate::ToolStep>;

/// So much otherwise, chosen: what a hand does not feel.
inline constexpr double kNeighbourDepth = 2.0;               // of the pull, of the advance    [mm]
inline constexpr double kNeighbourTurn = 15.0 * kRadPerDeg;  // of the hub, or where it looks [rad]

/// The script itself, then with the last pull of both tools ended earlier and later, the last
/// turn less and more, and the catheter advanced less and further where it follows the wire into
/// the branch: five to seven in all, fewer where the script has no such steps.
std::vector<ToolScript> list_neighbours(const ToolScript& script);

/// Of each script whether it reaches. The trial is where all begin, and is brought back there.
std::vector<bool> try_scripts(simulate::ToolTrial& trial, const std::vector<ToolScript>& scripts,
                              const std::function<bool()>& cancelled);

}  // namespace wireplan::plan
