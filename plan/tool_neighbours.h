#pragma once
/// How a script of catheter and wire does where the hand does it a little otherwise. Scripts that
/// begin alike are made once as far as they do. Of many that reach, which are kept.
#include <cstddef>
#include <functional>
#include <vector>

#include "simulate/insertion/tool_trial.h"

namespace wireplan::plan {

using ToolScript = std::vector<simulate::ToolStep>;

/// So much otherwise, chosen: what a hand does not feel.
inline constexpr double kNeighbourDepth = 2.0;               // of the pull, of the advance    [mm]
inline constexpr double kNeighbourTurn = 15.0 * kRadPerDeg;  // of the hub, or where it looks [rad]

/// Whether a catheter's curve was reshaped, in a side vessel or the trunk: it hangs from its knee
/// then, and goes deeper into a branch by a pull.
bool is_reshaped(const ToolScript& script);

/// The script itself, then with the last move of both tools ended earlier and later, the last
/// turn less and more, and the catheter advanced less and further where it follows the wire into
/// the branch: five to seven in all, fewer where the script has no such steps. Of a script whose
/// curve is reshaped the first `begun` steps are made alike.
std::vector<ToolScript> list_neighbours(const ToolScript& script, std::size_t begun = 0);

/// Of each script whether it reaches. The trial is where all begin, and is brought back there.
std::vector<bool> try_scripts(simulate::ToolTrial& trial, const std::vector<ToolScript>& scripts,
                              const std::function<bool()>& cancelled);

struct FoundScript {
  ToolScript steps;
  /// The same, its last turn and pull by so much, whatever is seen; empty where that breaks a rule,
  /// or is no other script.
  ToolScript by_length = {};
  double peak_force = 0.0;              // in the scout, past the way up                         [N]
  double turned = 0.0, depth = 0.0;     // of the hub, of the catheter                     [rad, mm]
  bool holds = false;                   // made again from where its start begins, it reaches
  double share = 0.0;                   // of it and its neighbours that reach
  std::vector<ToolScript> spares = {};  // neighbours that do
};

/// Of each script how many of it and its neighbours reach at once, without ToolStep::tries, and
/// which of these are allowed to stand in for it. All begin with the same `begun` steps, which the
/// trial has made. Returns how many were tried.
long weigh_scripts(simulate::ToolTrial& trial, std::size_t begun,
                   const std::function<bool(const ToolScript&)>& allowed,
                   const std::function<bool()>& cancelled, std::vector<FoundScript>& scripts);

/// As one that holds, untried; made by its lengths where it does not reach in full.
void take_for_held(FoundScript& script);

/// At most so many that differ in turn or depth. First those whose neighbours reach, as far as that
/// was tried, and with most others round them: a hand and a patient that are not quite as assumed
/// end there. Then the fewest steps and the least force first.
std::vector<FoundScript> choose_different(const std::vector<FoundScript>& from, std::size_t most);

}  // namespace wireplan::plan
