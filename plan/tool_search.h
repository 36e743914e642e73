#pragma once
/// Scripts of catheter and wire for targets that a wire alone does not reach, from a template that
/// hands follow (references-2 L):
///   1. the wire goes up beyond the ostium, steered past other vessels, the catheter over it;
///   2. the wire is withdrawn, so that the catheter's curve forms;
///   3. the catheter is turned, by more than half a turn only with a short pull between, and both
///   are pulled back, until its tip is in the ostium;
///   4. the wire goes out into the branch, and where it comes no further, the catheter follows it;
///   5. once the wire is at the target, the catheter follows into the branch (ToolRules::seat).
/// A reversed curve, as a Simmons, whose scripts do not hold is formed in a vessel off the way
/// first and goes up with its knee ahead (reshaping.h), or in the trunk beyond (opening.h); from
/// step 3 on all is as above, but that it is pulled deeper.
#include <functional>
#include <string>
#include <vector>

#include "plan/batch.h"
#include "plan/tool_starts.h"

namespace wireplan::plan {

/// Whether there is anything to search: pairs that fit, and an ostium.
std::vector<ToolPair> pairs_of(const Study& study);

/// Of a script and its neighbours that reach: it holds, and one of them may stand in for it;
/// chosen.
inline constexpr double kSteadyShare = 0.5;

/// What came of bringing the wire of a pair in through its catheter in exchange for another
/// (wire_exchange.h).
struct ExchangeFindings {
  int first_wire = -1;  // of the script that holds best or comes furthest; -1: not tried
  int found = 0;        // scripts that reached in the search
  double held = 0.0;    // as below
  std::string stopped;  // what stopped it, or why it was not tried; else empty

  bool tried() const { return first_wire >= 0; }
};

/// What came of a pair.
struct PairFindings {
  ToolPair pair;
  int found = 0;               // scripts that reached in the search
  double held = 0.0;           // of the best one and its neighbours, the part that reached
  double nearest_hook = -1.0;  // of the catheter's tip to the ostium at best; -1: not tried    [mm]
  double furthest = 0.0;       // of a tip along the way                                      [mm]
  std::string stopped;         // what stopped the best script, where none reached; else empty
  ExchangeFindings exchange = {};  // where its own scripts do not hold

  bool tried() const { return nearest_hook >= 0.0 || furthest > 0.0 || !stopped.empty(); }
};

struct ToolScripts {
  std::vector<Candidate> found;  // best first within a pair; of a pair without one the script
                                 // that came furthest
  std::vector<std::vector<Candidate>> spares;  // of each what differs a little and reached too, to
                                               // stand in for it; only where most of it did
  std::vector<PairFindings> pairs;             // of all pairs, in the order of list_pairs()
  long branches = 0;                           // states that were gone on from
  std::size_t groups = 0;                      // of pairs that are tried together: searched so far
};

/// Adds scripts of a pair, which begin as that candidate, with their spares where they hold.
void add_scripts(Candidate begun, std::vector<FoundScript> scripts, ToolScripts& all);

/// Has scripts that reached end with the catheter in the branch, but where it is seated already, as
/// for an exchange, or a rule speaks against it, as of a catheter that is short.
void add_seats(const Study& study, ToolScripts& all);

/// The study as scripts are tried in it: on a rigid wall, with long elements and loose residuals.
Study tool_scout_study(const Study& study);

/// Tries the template for each pair that fits, in parallel, at a few depths of the catheter and
/// withdrawals of the wire; at all turns by 30 degrees; pulled or pushed by 2 mm. States whose tip
/// lies best at the ostium are gone on from. A found script turns and pulls until the tip looks and
/// lies as it did then, and leads the wire out as far into the branch: what a hand sees, which
/// holds where friction and stiffness are others. Where it does not reach so when made again, and
/// does by the same lengths, it turns and pulls by these. The way up is made once for a pair, and
/// not again for neighbours; of a reversed curve without a script that holds one more, for each of
/// at most two side vessels and where the trunk beyond is wide enough. Keeps up to six scripts of a
/// pair, which differ in turn, or in depth, first those of whose neighbours (tool_neighbours.h)
/// most reach too; of every hook all that are not told alike. The same at any thread count. The
/// first script that is found is told to `on_first`, where given, at once and from any thread.
ToolScripts find_tool_scripts(const Study& study, const simulate::VesselModel& vessel,
                              const BatchOptions& options,
                              const std::function<void(const Candidate&)>& on_first = nullptr,
                              Hooks hooks = Hooks::kBest);

/// Whether there are pairs that `all` does not tell of yet: of catheters that the anatomy suggests
/// three are tried together, then the next, else all at once.
bool has_more_pairs(const Study& study, const ToolScripts& all);

/// Goes on with these until one of them has a script that holds, and adds what it finds.
void search_on(const Study& study, const simulate::VesselModel& vessel, const BatchOptions& options,
               const std::function<void(const Candidate&)>& on_first, ToolScripts& all,
               Hooks hooks = Hooks::kBest);

}  // namespace wireplan::plan
