#pragma once
/// Catheters of a case: which wires go through them, and what a hand does not do with the two.
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "plan/wire_spread.h"
#include "simulate/insertion/tool_trial.h"
#include "simulate/insertion/way.h"

namespace wireplan::plan {

struct Catheter {
  simulate::Tool tool;
  WireSpread spread;  // how far its values may be off
};

/// What scripts of catheter and wire keep to. All assumed unless a source stands beside it.
struct ToolRules {
  /// A catheter is only pushed over a wire that leads ("catheters are advanced only over a wire",
  /// references-2 L) unless its tip is no stiffer than this; assumed: soft tips of 5 F catheters
  /// have 99 in the catalogue                                                          [N mm^2]
  double soft_tip = 100.0;
  double hold = 100.0;     // of wire that is left behind the catheter's hub, to hold it by    [mm]
  double outside = 50.0;   // of catheter that stays outside the body                          [mm]
  double most_turn = kPi;  // of the hub in one place: a push or pull follows, so that no twist
                           // is wound up                                                     [rad]
  double turn_per_length = 0.5 * kPi;  // of the hub, for the push or pull of the catheter that
                                       // follows: more winds up                         [rad/mm]
  /// So far past the ostium the catheter follows once the wire is at the target, where that is far
  /// enough; 0: it stays. Assumed: deep enough to bear a push, short of common branches     [mm]
  double seat = 10.0;
  double friction = 0.05;  // Coulomb's coefficient between wire and catheter
  /// Whether a wire that no script of its own brings there is brought in through the catheter in
  /// exchange for one that does (wire_exchange.h). No: the hand keeps to one wire, and the search
  /// is shorter.
  bool exchange = true;
};

/// Where scripts are to bring the tip: the last vessel that the way takes from a wider one.
struct Ostium : simulate::TakeOff {
  double trunk_diameter = 0.0;     // just before                                          [mm]
  double branch_diameter = 0.0;    // of the way, mean over 10 mm beyond it               [mm]
  double end = 0.0;                // of the way, the target's place                       [mm]
  double narrowest = HUGE_VAL;     // of the way up to the ostium, inscribed               [mm]
  double trunk_beyond = HUGE_VAL;  // of the trunk past the ostium, to where the image ends [mm]
};

/// None where the way takes none, as out of a branch into a wider vessel, or is not known.
std::optional<Ostium> find_ostium(const simulate::Goal& goal);

/// A wire in a catheter.
struct ToolPair {
  int catheter = 0, wire = 0;  // indices into the study's lists
  std::string unfit = {};      // why they are not tried; else empty
};

/// All pairs, wires outermost, each with what speaks against it: a wire as thick as the lumen,
/// strips, a catheter thicker than the way to the ostium or that ends before it, a wire that is too
/// short behind the catheter's hub, a curve at the tip that is wider than the vessel that it is to
/// open in.
std::vector<ToolPair> list_pairs(const std::vector<Catheter>& catheters,
                                 const std::vector<simulate::Wire>& wires, const Ostium& ostium,
                                 const ToolRules& rules);

/// What breaks the rules in a script, or is not possible with tools of these sizes; else empty.
/// Steps that end before they are made whole may break none either. `spare` is what an exchange
/// brings in; a script without one needs none.
std::string find_broken_rule(const std::vector<simulate::ToolStep>& steps, const Catheter& catheter,
                             const simulate::Wire& wire, const ToolRules& rules,
                             const simulate::Wire* spare = nullptr);

/// A script, and after it the step that seats the catheter, where the branch up to the target is
/// long enough for it: a push, or a pull of one that hangs from its reshaped knee.
std::vector<simulate::ToolStep> with_seat(std::vector<simulate::ToolStep> steps,
                                          const Ostium& ostium, const ToolRules& rules);

/// Steps rounded as files hold them, in degrees and mm.
std::vector<simulate::ToolStep> as_written(std::vector<simulate::ToolStep> steps);

/// A step in words.
struct ToldStep {
  std::string text;       // "advance the wire to 250 mm"
  std::string otherwise;  // sentences on what to do where the wire goes elsewhere; may be empty
};

/// What steps call by name.
struct StepNames {
  std::string spare = {};                 // the wire that an exchange brings in
  std::map<int, std::string> sides = {};  // vessels that a curve is reshaped in, by branch
};

/// "advance the wire to 250 mm", "advance the catheter over the wire to 230 mm", "withdraw the wire
/// by 60 mm", "turn the catheter 60 degrees clockwise", ...: as the hand makes them, turns as seen
/// from the hub toward the patient. "to" is said as long as no step before ended by what was seen.
/// The last step goes on to where the trial ended.
std::vector<ToldStep> describe_steps(const std::vector<simulate::ToolStep>& steps, double insertion,
                                     const StepNames& names = {});

/// The texts in one line, without what else to do: "advance the wire to 250 mm; advance ...".
std::string describe_script(const std::vector<simulate::ToolStep>& steps, double insertion,
                            const StepNames& names = {});

}  // namespace wireplan::plan
