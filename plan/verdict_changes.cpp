#include "plan/verdict_changes.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include "plan/catheter_choice.h"
#include "plan/number_text.h"
#include "plan/tool_starts.h"

namespace wireplan::plan {
namespace {

/// What fewer than one in so many end by is left out of what would change the verdict.
constexpr int kOneIn = 10;
constexpr double kSameLength = 1e-6;  // of wire                                          [mm]

bool tried_angled(const Study& study) {
  return std::any_of(study.wires.begin(), study.wires.end(),
                     [](const simulate::Wire& wire) { return !wire.straight(); });
}

bool tried_moves(const Plan& plan) {
  return plan.scripts.starts_tried > 0 ||
         std::any_of(plan.candidates.begin(), plan.candidates.end(),
                     [](const Candidate& candidate) { return !candidate.moves.empty(); });
}

std::string catheter_name(const Known& known, const PairFindings& pair) {
  return known.study.catheters[static_cast<std::size_t>(pair.pair.catheter)].tool.wire.name;
}

/// "3 of 9 trials went past the branch or into another one"
std::string tell_astray(const Endings& endings, const std::string& noun) {
  const int count = endings.passed_by + endings.wrong_branch;
  return part_of(count, endings.trials, noun) + (endings.wrong_branch == 0 ? " went past the branch"
                                                 : endings.passed_by == 0
                                                     ? " went into another branch"
                                                     : " went past the branch or into another one");
}

/// The first five, and how many more there are.
std::vector<std::string> first_of(std::vector<std::string> names) {
  constexpr std::size_t kNamed = 5;
  if (names.size() <= kNamed + 1) return names;
  const std::size_t more = names.size() - kNamed;
  names.resize(kNamed);
  names.push_back(std::to_string(more) + " more");
  return names;
}

/// So near to the ostium a catheter's tip lies at it; chosen [mm].
constexpr double kAtOstium = 3.0;

/// "cobra-c1 (4.3 mm), rdc (5.0 mm)": catheters, each once, by how near their tips came.
std::vector<std::string> names_with_hooks(std::vector<PairFindings> pairs, const Known& known) {
  std::stable_sort(pairs.begin(), pairs.end(), [](const PairFindings& a, const PairFindings& b) {
    return a.nearest_hook < b.nearest_hook;
  });
  std::vector<std::string> texts;
  std::vector<std::string> names;
  for (const PairFindings& pair : pairs) {
    const std::string name = catheter_name(known, pair);
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    names.push_back(name);
    texts.push_back(name + " (" + one_decimal(pair.nearest_hook) + " mm)");
  }
  return first_of(texts);
}

/// What of the catheters that were tried stops their scripts, and which tool that asks for.
std::string tell_hooks(const Known& known) {
  const std::optional<Ostium> ostium = find_ostium(known.study.goal);
  std::vector<PairFindings> at, off;
  for (const PairFindings& pair : known.plan.scripts.pairs) {
    if (pair.found > 0) return {};  // in the patient as assumed nothing stops them
    if (!pair.tried() || pair.nearest_hook < 0.0) continue;
    (pair.nearest_hook <= kAtOstium ? at : off).push_back(pair);
  }
  if (!ostium || (at.empty() && off.empty())) return {};
  const double take_off = take_off_of(*ostium);
  if (at.empty()) {
    return " No catheter's tip came to the ostium: " + list_words(names_with_hooks(off, known)) +
           ". The branch turns by " + one_decimal(take_off / kRadPerDeg) +
           " degrees from a trunk that is " + one_decimal(ostium->trunk_diameter) +
           " mm wide, which asks for a catheter with a " + kind_name(asked_for(take_off)) +
           " about as wide across.";
  }
  const PairFindings& best =
      *std::min_element(at.begin(), at.end(), [](const PairFindings& a, const PairFindings& b) {
        return std::pair(-a.furthest, a.nearest_hook) < std::pair(-b.furthest, b.nearest_hook);
      });
  const simulate::Wire& wire = known.study.wires[static_cast<std::size_t>(best.pair.wire)];
  return " The catheter's tip came to the ostium (" + list_words(names_with_hooks(at, known)) +
         "), but the wire out of it no further than " + one_decimal(best.furthest) + " of " +
         one_decimal(ostium->end) +
         " mm along the way: that asks for a wire with a softer tip than " + wire.name + " (" +
         three_digits(wire.sections.front().bending_stiffness) +
         " N mm^2), or one with an angled tip.";
}

/// Of a case that names catheters: `went` is how many went past the branch.
std::string change_of_catheters(const std::string& went, const Known& known) {
  const std::vector<PairFindings>& pairs = known.plan.scripts.pairs;
  std::vector<std::string> names;
  std::vector<CurveKind> kinds;
  const PairFindings* unfit = nullptr;
  for (const PairFindings& pair : pairs) {
    if (!pair.pair.unfit.empty() && unfit == nullptr) unfit = &pair;
    if (!pair.tried()) continue;
    const auto& tube = known.study.catheters[static_cast<std::size_t>(pair.pair.catheter)].tool;
    kinds.push_back(find_shape(tube.wire).kind);
    const std::string name = catheter_name(known, pair);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  const bool none_fits = std::all_of(pairs.begin(), pairs.end(), [](const PairFindings& pair) {
    return !pair.pair.unfit.empty();
  });
  if (names.empty() && none_fits && unfit != nullptr) {
    return "A catheter and a wire that fit: " + went + ", and " + catheter_name(known, *unfit) +
           " could not be tried (" + unfit->pair.unfit + ").";
  }
  if (names.empty()) {
    return "The catheters of the case: " + went +
           ", and scripts of catheter and wire were not searched for.";
  }
  std::vector<std::string> others;
  for (const CurveKind kind : {CurveKind::kSimple, CurveKind::kHooked, CurveKind::kReversed}) {
    const bool tried = std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
    if (!tried) others.push_back(std::string("a ") + kind_name(kind));
  }
  const std::string was = names.size() == 1 ? " was tried" : " were tried";
  if (others.empty()) {
    return "Another access, or a catheter of another width: " + went + ", though " +
           list_words(names) + was + "." + tell_hooks(known);
  }
  return "A catheter of another shape: " + went + ", though " + list_words(names) + was + "; " +
         list_words(others) + (others.size() == 1 ? " was not." : " were not.") + tell_hooks(known);
}

/// How much more of the trunk would have to be seen for a catheter to be led up past the branch and
/// pulled down into it [mm]; 0 where there is room, or no catheter was tried.
double missing_room(const Known& known) {
  const std::vector<PairFindings>& pairs = known.plan.scripts.pairs;
  const std::optional<Ostium> ostium = find_ostium(known.study.goal);
  const bool tried = std::any_of(pairs.begin(), pairs.end(),
                                 [](const PairFindings& pair) { return pair.tried(); });
  return tried && ostium ? std::max(0.0, room_beyond() - ostium->trunk_beyond) : 0.0;
}

std::string change_of_image(const Endings& endings, const Known& known, const std::string& noun) {
  const double missing = missing_room(known);
  const std::string ended =
      part_of(endings.left_image, endings.trials, noun) + " came to an end of the imaged vessel";
  if (missing == 0.0) return "A scan that shows more of the vessel: " + ended + ".";
  return "A scan that shows " + std::to_string(std::lround(std::ceil(missing))) +
         " mm more of the vessel past the branch: " +
         (endings.left_image > 0 ? ended + ". I" : "i") + "t ends " +
         one_decimal(room_beyond() - missing) + " mm past the ostium, and " +
         one_decimal(room_beyond()) +
         " mm are what it takes to lead a catheter up over a wire and pull it down into the "
         "branch.";
}

std::string change_at_branch(const Endings& endings, const Known& known, const std::string& noun) {
  const std::string went = tell_astray(endings, noun);
  if (!known.study.catheters.empty()) return change_of_catheters(went, known);
  if (!tried_angled(known.study)) {
    std::string text = "A wire with an angled tip: " + went + ", and no such wire was tried";
    if (!known.angled_wires.empty()) {
      text += " (in the catalogue: " + list_words(first_of(known.angled_wires)) + ")";
    }
    return text + ".";
  }
  if (!tried_moves(known.plan)) {
    return "Turning the wire at the branch: " + went + "; the wire was not turned.";
  }
  return std::string(kShapedCatheter) + ": " + went +
         ", though wires with an angled tip and turns of the wire were tried.";
}

std::string change_of_wire_length(const Endings& endings, const Known& known,
                                  const std::string& noun) {
  return "More wire in the vessel: " + part_of(endings.all_wire_in, endings.trials, noun) +
         " ended before the target with all the wire in that may go in, at most " +
         one_decimal(known.study.insertion.length) + " mm.";
}

/// Whether the tip came as far as the target along the way, and so did not end before it.
bool went_by(const Measured& trial, const simulate::Goal& goal) {
  if (!goal.way) return false;
  const Eigen::VectorXd& arc = goal.way->path().arc_length;
  return trial.progress >= arc[arc.size() - 1] - (goal.at_section ? kSameLength : goal.radius);
}

/// Of those that went by, or missed with wire left to push.
std::string change_of_aim(const Endings& endings, const Known& known, const std::string& noun) {
  const std::string missed = part_of(endings.missed + endings.went_by, endings.trials, noun);
  const simulate::Goal& goal = known.study.goal;
  if (goal.at_section) {
    return "Another wire, entry angle or roll: " + missed +
           (endings.went_by == 0 ? " ended before the target or beside it, with wire left to push."
                                 : " ended beside the target or beyond it, or before it with wire "
                                   "left to push.");
  }
  return "A target that is the vessel's whole cross-section, or another wire, entry angle or "
         "roll: " +
         missed + " missed the sphere of " + one_decimal(goal.radius) +
         " mm radius, which a wire may pass beside.";
}

}  // namespace

std::string list_words(const std::vector<std::string>& parts, const std::string& last) {
  std::string text;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (k > 0) text += k + 1 == parts.size() ? " " + last + " " : ", ";
    text += parts[k];
  }
  return text;
}

std::string part_of(int count, int all, const std::string& noun) {
  if (count < all || all == 0) return std::to_string(count) + " of " + count_of(all, noun);
  return all == 1   ? "the one " + noun
         : all == 2 ? "both " + noun + "s"
                    : "all " + count_of(all, noun);
}

std::string capital(std::string text) {
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

void add_ending(Endings& endings, const Measured& trial, const simulate::Wire& wire,
                const simulate::Goal& goal, const simulate::InsertionOptions& insertion,
                const Limits& limits) {
  using simulate::Outcome;
  const Metrics& m = trial.metrics;
  ++endings.trials;
  switch (trial.outcome) {
    case Outcome::kReached:
      ++endings.reached;
      endings.broke_tip_force += m.peak_tip_force > limits.tip_force_fail;
      endings.broke_path += m.off_path > limits.off_path_fail;
      endings.broke_wall += m.max_penetration > limits.penetration_fail;
      return;
    case Outcome::kMissed: {
      if (went_by(trial, goal)) {
        ++endings.went_by;
        return;
      }
      const double most = simulate::longest_insertion(wire, insertion);
      ++(m.insertion < most - kSameLength     ? endings.missed
         : most > wire.length() - kSameLength ? endings.whole_wire_in
                                              : endings.all_wire_in);
      return;
    }
    case Outcome::kPassedBy:
      ++endings.passed_by;
      return;
    case Outcome::kWrongBranch:
      ++endings.wrong_branch;
      return;
    case Outcome::kLeftImage:
      ++endings.left_image;
      return;
    case Outcome::kStuck:
      ++endings.stuck;
      return;
    case Outcome::kProlapsed:
      ++endings.prolapsed;
      return;
    case Outcome::kAnotherWay:
      ++endings.another_way;
      return;
    case Outcome::kCrossesItself:
      ++endings.crossed;
      return;
    case Outcome::kLeftLumen:
      ++endings.left_lumen;
      return;
    case Outcome::kNotConverged:
      ++endings.no_equilibrium;
      return;
    case Outcome::kFailed:
      ++endings.our_fault;
      return;
  }
}

std::string describe_endings(const Endings& endings) {
  std::vector<std::pair<int, const char*>> groups = {
      {endings.passed_by, "passed by the branch"},
      {endings.wrong_branch, "took a wrong branch"},
      {endings.stuck, "got stuck"},
      {endings.prolapsed, "folded back on the way"},
      {endings.another_way, "came to the target another way"},
      {endings.crossed, "made a loop that crosses itself"},
      {endings.left_lumen, "went through the wall"},
      {endings.whole_wire_in + endings.all_wire_in, "ended with all wire in"},
      {endings.missed, "missed the target"},
      {endings.went_by, "went by the target"},
      {endings.left_image, "came to an end of the imaged vessel"},
      {endings.no_equilibrium, "found no balance of forces"},
      {endings.our_fault, "failed in the program"}};
  std::stable_sort(groups.begin(), groups.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> parts;
  for (const auto& [count, text] : groups) {
    if (count > 0) parts.push_back(std::to_string(count) + " " + text);
  }
  return list_words(parts);
}

std::string headline_of_failure(const Endings& all, const Endings& full) {
  const bool one = all.trials == 1;
  if (all.reached == 0) {
    return one ? "The one trial does not reach the target."
               : "None of " + count_of(all.trials, "trial") + " reaches the target.";
  }
  const int coarse = all.reached - full.reached;
  const std::string reach = capital(part_of(all.reached, all.trials, "trial")) +
                            (all.reached == 1 ? " reaches the target" : " reach the target");
  if (coarse == 0) {
    return reach + (all.reached == 1 ? ", but not within the limits."
                                     : ", none of them within the limits.");
  }
  if (full.reached == 0) {
    return reach + (coarse == 1 ? ", but was not run in full detail."
                                : ", none of which was run in full detail.");
  }
  return reach + ": " + std::to_string(full.reached) + (full.reached == 1 ? " breaks" : " break") +
         " a limit, and " + std::to_string(coarse) + (coarse == 1 ? " was" : " were") +
         " not run in full detail.";
}

std::string describe_broken_limits(const Endings& endings, const Limits& limits) {
  std::vector<std::string> parts;
  const auto add = [&](int count, const std::string& text) {
    if (count > 0) parts.push_back(text + " in " + std::to_string(count));
  };
  add(endings.broke_tip_force, "tip force above " + four_digits(limits.tip_force_fail) + " N");
  add(endings.broke_path,
      "wire more than " + four_digits(limits.off_path_fail) + " mm outside the way's lumen");
  add(endings.broke_wall,
      "wire more than " + four_digits(limits.penetration_fail) + " mm past the wall");
  expects(!parts.empty());
  return list_words(parts);
}

std::vector<std::string> describe_pairs(const Known& known, std::size_t most) {
  std::vector<std::string> texts, untried;
  for (const PairFindings& pair : known.plan.scripts.pairs) {
    const std::string name = catheter_name(known, pair) + " with " +
                             known.study.wires[static_cast<std::size_t>(pair.pair.wire)].name;
    if (!pair.pair.unfit.empty()) {
      untried.push_back("Not tried was " + name + ": " + pair.pair.unfit + ".");
    } else if (pair.exchange.tried() && pair.exchange.stopped.empty()) {
      continue;  // brought in so, it reaches
    } else if (pair.tried() && !pair.stopped.empty()) {
      std::string text = "No script of " + name + " reaches: " + pair.stopped;
      if (pair.nearest_hook >= 0.0) {
        text += "; the catheter's tip came no nearer to the ostium than " +
                one_decimal(pair.nearest_hook) + " mm";
      }
      if (pair.exchange.tried()) {
        text += "; nor does it in exchange for " +
                known.study.wires[static_cast<std::size_t>(pair.exchange.first_wire)].name +
                " through the placed catheter: " + pair.exchange.stopped;
      }
      texts.push_back(text + ".");
    }
  }
  texts.insert(texts.end(), untried.begin(), untried.end());
  if (texts.size() > most) {
    const int more = static_cast<int>(texts.size() - most);
    texts.resize(most);
    texts.push_back(count_of(more, "other pair") + " of catheter and wire " +
                    (more == 1 ? "was" : "were") +
                    " not tried or found no script either; the report lists each with its reason.");
  }
  return texts;
}

std::string describe_steadiness(const std::vector<Refinement>& refinements, int trial) {
  const auto own = std::find_if(refinements.begin(), refinements.end(),
                                [&](const Refinement& one) { return one.trial == trial; });
  expects(own != refinements.end());
  std::vector<std::string> ends;
  for (const OtherEnd& other : own->others) {
    ends.push_back(describe_setting(other.setting) + " its tip ends " +
                   two_digits(other.change.tip) + " mm away");
  }
  return list_words(ends) + ", where up to " + one_decimal(kTipsApart) + " mm may be";
}

std::vector<std::string> changes_by(const Endings& endings, const Known& known,
                                    const std::string& noun) {
  std::vector<std::pair<int, std::string>> changes;
  const auto add = [&](int count, std::string text) {
    if (count > 0 && kOneIn * count >= endings.trials) changes.emplace_back(count, std::move(text));
  };
  add(endings.passed_by + endings.wrong_branch, change_at_branch(endings, known, noun));
  add(endings.stuck + endings.prolapsed,
      "Another access, or a wire of another stiffness: " +
          part_of(endings.stuck + endings.prolapsed, endings.trials, noun) +
          " got stuck or folded back on the way.");
  const int hurt = endings.left_lumen + endings.broke_wall;
  add(hurt, "A softer wire: " + part_of(hurt, endings.trials, noun) + " went through the wall.");
  add(endings.broke_tip_force,
      "A wire with a softer tip: " + part_of(endings.broke_tip_force, endings.trials, noun) +
          " pressed the tip on the wall with more than " +
          four_digits(known.limits.tip_force_fail) + " N.");
  const int detours = endings.broke_path + endings.another_way;
  add(detours, "Another entry angle or another access: " + part_of(detours, endings.trials, noun) +
                   " came to the target another way.");
  add(endings.whole_wire_in,
      "A longer wire: " + part_of(endings.whole_wire_in, endings.trials, noun) +
          " ended before the target with all of the wire in.");
  add(endings.all_wire_in, change_of_wire_length(endings, known, noun));
  add(endings.missed + endings.went_by, change_of_aim(endings, known, noun));
  const int past = endings.passed_by + endings.wrong_branch + endings.left_image;
  add(missing_room(known) > 0.0 ? past : endings.left_image, change_of_image(endings, known, noun));
  add(endings.crossed,
      "A stiffer wire, or a catheter around it: " + part_of(endings.crossed, endings.trials, noun) +
          " looped until the wire crossed itself.");
  add(endings.no_equilibrium + endings.our_fault,
      "A finer computation: " +
          part_of(endings.no_equilibrium + endings.our_fault, endings.trials, noun) +
          " gave no result, as no balance of forces was found or the program failed.");
  std::stable_sort(changes.begin(), changes.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> texts;
  for (auto& [count, text] : changes) texts.push_back(std::move(text));
  return texts;
}

}  // namespace wireplan::plan
