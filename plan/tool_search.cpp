#include "plan/tool_search.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "plan/catheter_choice.h"
#include "plan/opening.h"
#include "plan/reshaping.h"
#include "plan/side_vessels.h"
#include "plan/tool_starts.h"

namespace wireplan::plan {
namespace {

/// All chosen.
constexpr double kCover = 6.0;  // of a curve behind its end, where the wire is withdrawn to  [mm]
constexpr std::size_t kScriptsKept = 6;      // scripts of a pair
constexpr std::size_t kSuggestedAtOnce = 3;  // catheters

// Of the search; ten times as much brought half of the wires elsewhere than runs in full   [N]
constexpr double kScoutResidual = 1e-5;

/// The steps of a script that reached, with the step that seats the catheter where no rule speaks
/// against it.
ToolScript seated_steps(const Study& study, const Ostium& ostium, const Candidate& script) {
  ToolScript seated = as_written(with_seat(script.steps, ostium, study.tool_rules));
  const Catheter& catheter = study.catheters[static_cast<std::size_t>(script.catheter)];
  const simulate::Wire& wire = study.wires[static_cast<std::size_t>(script.wire)];
  const bool allowed = find_broken_rule(seated, catheter, wire, study.tool_rules).empty();
  return allowed ? seated : script.steps;
}

/// One depth of the catheter and one withdrawal of the wire.
struct ToolStart {
  std::size_t pair = 0;       // among those that are tried together
  const WayUp* up = nullptr;  // of that pair
  const RaisedTools* depth = nullptr;
  double withdrawn = 0.0;  //                                                                 [mm]
  StartFindings findings;
};

void add_starts(const Study& study, const ToolPair& pair, std::size_t slot, const WayUp& way,
                std::vector<ToolStart>& starts) {
  const simulate::Wire& tube = study.catheters[static_cast<std::size_t>(pair.catheter)].tool.wire;
  const double all = curved_length(tube, false), first = curved_length(tube, true);
  for (const RaisedTools& depth : way.depths) {
    starts.push_back({slot, &way, &depth, all + kCover, {}});
    if (first != all) starts.push_back({slot, &way, &depth, first + kCover, {}});
  }
}

/// A way up on which the curve of a pair's catheter is reshaped: in a side vessel, or, where that
/// is none, in the trunk beyond the ostium.
struct ReshapedWay {
  std::size_t pair = 0;  // as above
  simulate::SideVessel side;
  double depth = 0.0;  // of the catheter in the trunk, past the ostium                       [mm]
  WayUp up;

  bool in_trunk() const { return side.branch < 0; }
};

/// Of each pair without a script that holds those on which its catheter's curve can be reshaped.
std::vector<ReshapedWay> list_reshaped_ways(const Study& study, const Ostium& ostium,
                                            const std::vector<ToolPair>& pairs,
                                            const std::vector<ToolStart>& starts) {
  const std::vector<simulate::SideVessel> sides = find_side_vessels(*study.goal.way, ostium.arc);
  std::vector<ReshapedWay> ways;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const bool holds = std::any_of(starts.begin(), starts.end(), [&](const ToolStart& start) {
      const auto& found = start.findings.found;
      return start.pair == k && std::any_of(found.begin(), found.end(), [](const auto& script) {
               return script.share >= kSteadyShare;
             });
    });
    if (holds || !pairs[k].unfit.empty()) continue;
    const Catheter& catheter = study.catheters[static_cast<std::size_t>(pairs[k].catheter)];
    for (const simulate::SideVessel& side :
         list_reshaping_vessels(*study.goal.way, ostium.arc, sides, catheter.tool.wire)) {
      ways.emplace_back().pair = k;
      ways.back().side = side;
    }
    const std::optional<double> depth =
        find_opening_depth(*study.goal.way, ostium.arc, catheter.tool.wire);
    if (!depth) continue;
    ways.emplace_back().pair = k;
    ways.back().depth = *depth;
  }
  return ways;
}

/// Indices of pairs, in the order in which they are tried, while none before has a script that
/// holds: of catheters that the anatomy suggests three, then the next, else all at once.
std::vector<std::vector<std::size_t>> tried_together(const Study& study,
                                                     const std::vector<PairFindings>& pairs) {
  std::vector<std::vector<std::size_t>> groups(1);
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const std::size_t group =
        study.suggested.empty()
            ? 0
            : static_cast<std::size_t>(pairs[p].pair.catheter) / kSuggestedAtOnce;
    groups.resize(std::max(groups.size(), group + 1));
    groups[group].push_back(p);
  }
  return groups;
}

/// Scripts that are told alike stand once.
std::vector<FoundScript> without_twins(std::vector<FoundScript> from) {
  std::vector<FoundScript> kept;
  for (FoundScript& script : from) {
    const ToolScript told = as_written(script.steps);
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const FoundScript& other) {
      return as_written(other.steps) == told;
    });
    if (!known) kept.push_back(std::move(script));
  }
  return kept;
}

/// What a pair's way up and its starts found: the different scripts of it that hold best.
void gather(const Study& study, const std::vector<ToolStart>& starts, std::size_t slot,
            const StartFindings& way_up, const std::vector<ReshapedWay>& reshaped, Hooks hooks,
            PairFindings& pair, ToolScripts& all) {
  std::vector<const StartFindings*> parts;
  for (const ToolStart& start : starts) {
    if (start.pair == slot) parts.push_back(&start.findings);
  }
  parts.push_back(&way_up);
  std::vector<FoundScript> found;
  ToolScript closest;
  for (const StartFindings* part : parts) {
    const StartFindings& own = *part;
    all.branches += own.branches;
    pair.found += own.count;
    if (own.nearest_hook >= 0.0 &&
        (pair.nearest_hook < 0.0 || own.nearest_hook < pair.nearest_hook)) {
      pair.nearest_hook = own.nearest_hook;
    }
    if (closest.empty() || own.furthest > pair.furthest) {
      pair.furthest = own.furthest;
      pair.stopped = own.stopped;
      closest = own.closest;
    }
    found.insert(found.end(), own.found.begin(), own.found.end());
  }
  std::vector<FoundScript> kept = hooks == Hooks::kEvery ? without_twins(std::move(found))
                                                         : choose_different(found, kScriptsKept);
  if (pair.stopped.empty()) pair.stopped = way_up.stopped;
  bool none_serves = true;
  for (const ReshapedWay& way : reshaped) {
    if (way.pair != slot) continue;
    none_serves = none_serves && way.in_trunk();
    all.branches += way.up.findings.branches;
    if (!way.up.depths.empty()) continue;
    pair.stopped +=
        (way.in_trunk()
             ? std::string("; its curve does not open in the trunk beyond the ostium: ")
             : "; its curve is not reshaped in " +
                   branch_name(study.goal.way->tree(), way.side.branch, way.side.from) + ": ") +
        way.up.findings.stopped;
  }
  const Catheter& catheter = study.catheters[static_cast<std::size_t>(pair.pair.catheter)];
  if (!pair.stopped.empty() && none_serves &&
      find_shape(catheter.tool.wire).kind == CurveKind::kReversed) {
    pair.stopped += "; no vessel that leaves the way before the ostium serves to reshape its curve";
  }
  if (pair.found > 0) pair.stopped.clear();
  if (!kept.empty()) pair.held = kept.front().share;
  if (kept.empty() && !closest.empty()) kept.push_back({.steps = closest});
  add_scripts(first_candidate(study, pair.pair), std::move(kept), all);
}

}  // namespace

void add_scripts(Candidate begun, std::vector<FoundScript> scripts, ToolScripts& all) {
  for (FoundScript& script : scripts) {
    begun.steps = as_written(std::move(script.steps));
    all.found.push_back(begun);
    all.spares.emplace_back();
    if (script.share < kSteadyShare) continue;
    for (ToolScript& spare : script.spares) {
      begun.steps = as_written(std::move(spare));
      all.spares.back().push_back(begun);
    }
  }
}

void add_seats(const Study& study, ToolScripts& all) {
  const std::optional<Ostium> ostium = find_ostium(study.goal);
  if (!ostium) return;
  const auto reached = [&](const Candidate& script) {
    return std::any_of(all.pairs.begin(), all.pairs.end(), [&](const PairFindings& pair) {
      return pair.pair.catheter == script.catheter && pair.pair.wire == script.wire &&
             pair.found > 0;
    });
  };
  const auto add = [&](Candidate& script) {
    if (script.first_wire >= 0 || !reached(script)) return;
    script.steps = seated_steps(study, *ostium, script);
  };
  for (Candidate& script : all.found) add(script);
  for (std::vector<Candidate>& spares : all.spares)
    std::for_each(spares.begin(), spares.end(), add);
}

std::vector<ToolPair> pairs_of(const Study& study) {
  const std::optional<Ostium> ostium = find_ostium(study.goal);
  if (!ostium) {
    std::vector<ToolPair> pairs = list_pairs(study.catheters, study.wires, {}, study.tool_rules);
    for (ToolPair& pair : pairs) pair.unfit = "the way takes no branch that a catheter could hook";
    return pairs;
  }
  return list_pairs(study.catheters, study.wires, *ostium, study.tool_rules);
}

Study tool_scout_study(const Study& study) {
  Study own = study;
  own.insertion.residual_tolerance = std::max(kScoutResidual, own.insertion.residual_tolerance);
  own.insertion.record_every = kNoShapes;
  own.insertion.map_forces = false;
  return own;
}

bool has_more_pairs(const Study& study, const ToolScripts& all) {
  return all.groups < tried_together(study, all.pairs).size();
}

void search_on(const Study& study, const simulate::VesselModel& vessel, const BatchOptions& options,
               const std::function<void(const Candidate&)>& on_first, ToolScripts& all,
               Hooks hooks) {
  const std::optional<Ostium> ostium = find_ostium(study.goal);
  if (all.groups == 0) {
    for (const ToolPair& pair : pairs_of(study)) all.pairs.emplace_back().pair = pair;
  }
  const Study scout = tool_scout_study(study);
  std::atomic<bool> told = std::any_of(all.pairs.begin(), all.pairs.end(),
                                       [](const PairFindings& pair) { return pair.found > 0; });
  const auto tell = [&](const ToolPair& pair, const StartFindings& findings) {
    if (!on_first || findings.found.empty() || told.exchange(true)) return;
    Candidate candidate = first_candidate(study, pair);
    candidate.steps = as_written(findings.found.front().steps);
    candidate.steps = seated_steps(study, *ostium, candidate);
    on_first(candidate);
  };
  const std::vector<std::vector<std::size_t>> groups = tried_together(study, all.pairs);
  for (bool holds = false; !holds && all.groups < groups.size(); ++all.groups) {
    const std::vector<std::size_t>& slots = groups[all.groups];
    std::vector<ToolPair> pairs;
    for (const std::size_t slot : slots) pairs.push_back(all.pairs[slot].pair);
    std::vector<WayUp> ways(slots.size());
    for_each_slot(
        static_cast<int>(slots.size()),
        [&](int slot) {
          const auto k = static_cast<std::size_t>(slot);
          if (!pairs[k].unfit.empty()) return;
          ways[k] = go_up(scout, pairs[k], *ostium, vessel, hooks, options.cancelled);
          tell(pairs[k], ways[k].findings);
        },
        options);
    std::vector<ToolStart> starts;
    for (std::size_t k = 0; k < slots.size(); ++k) {
      add_starts(study, pairs[k], k, ways[k], starts);
    }
    const auto search_from = [&](std::size_t first) {
      for_each_slot(
          static_cast<int>(starts.size() - first),
          [&](int slot) {
            ToolStart& start = starts[first + static_cast<std::size_t>(slot)];
            start.findings = search_start(scout, pairs[start.pair], *ostium, *start.up,
                                          *start.depth, start.withdrawn, hooks, options.cancelled);
            tell(pairs[start.pair], start.findings);
          },
          options);
    };
    search_from(0);
    std::vector<ReshapedWay> reshaped;
    if (ostium) reshaped = list_reshaped_ways(study, *ostium, pairs, starts);
    for_each_slot(
        static_cast<int>(reshaped.size()),
        [&](int slot) {
          ReshapedWay& way = reshaped[static_cast<std::size_t>(slot)];
          const ToolPair& pair = pairs[way.pair];
          way.up = way.in_trunk()
                       ? go_up_opened(scout, pair, *ostium, way.depth, vessel, options.cancelled)
                       : go_up_reshaped(scout, pair, way.side, vessel, options.cancelled);
        },
        options);
    const std::size_t plain = starts.size();
    for (const ReshapedWay& way : reshaped) {
      for (const RaisedTools& depth : way.up.depths) {
        starts.push_back({way.pair, &way.up, &depth, 0.0, {}});
      }
    }
    search_from(plain);
    for (std::size_t k = 0; k < slots.size(); ++k) {
      PairFindings& pair = all.pairs[slots[k]];
      gather(study, starts, k, ways[k].findings, reshaped, hooks, pair, all);
      holds = holds || pair.held >= kSteadyShare;
    }
  }
}

ToolScripts find_tool_scripts(const Study& study, const simulate::VesselModel& vessel,
                              const BatchOptions& options,
                              const std::function<void(const Candidate&)>& on_first, Hooks hooks) {
  ToolScripts all;
  search_on(study, vessel, options, on_first, all, hooks);
  return all;
}

}  // namespace wireplan::plan
