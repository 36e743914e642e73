#pragma once
/// What the parts of a search for scripts of one pair have in common (tool_starts.h, reshaping.h,
/// opening.h): steps that are made in a trial and taken back, and the turns and pulls that bring
/// the catheter's tip into an ostium.
#include <functional>
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

/// All chosen.
struct ScriptTemplate {
  double beyond = 60.0;     // of the wire past the ostium, at most                          [mm]
  double before_end = 9.0;  // of its tip, short of where the image ends                     [mm]
  int lower = 2;            // pushes less, where the catheter straightens it out of the image
  double short_of = 30.0;   // the ostium, of a wire that leads a catheter to below it          [mm]
  double leads = 12.0;      // of the wire ahead of the catheter, at least                   [mm]
  double above[2] = {12.0, 35.0};  // of the catheter's tip past the ostium                    [mm]
  double depths_apart = 10.0;      // of these two, where the vessel is not seen that far      [mm]
  double below = 15.0;             // ... and before it, in pulls                               [mm]
  double most_pull = 60.0;         // of a tip that lies in a branch beyond                     [mm]
  double turn = 30.0 * kRadPerDeg;
  int turns = 12;
  double least_turn = 5.0 * kRadPerDeg;  // a hub that may be turned by less is left as it is
  double pull = 2.0;       //                                                               [mm]
  double toward = 0.0;     // the branch, of the tip's direction: less looks away
  double far = 0.2;        // what a millimetre between tip and ostium counts as             [mm]
  double aside = 4.0;      // what a tip square to the branch counts as                     [mm]
  std::size_t depths = 4;  // hooks of a turn, of the states along a pull, ...
  double apart = 4.0;      // ... so far from each other                                       [mm]
  std::size_t tries = 14;  // hooks of a start that the wire is brought out of
  double out = 10.0;       // of the wire between two looks                                 [mm]
  double astray = 20.0;    // of the wire out of the mouth and not in the branch            [mm]
  double in_branch = 6.0;  // past the ostium: worth following                              [mm]
  double follow = 12.0;    // of the catheter over the wire                                 [mm]
  int follows = 3;
  double spare = 40.0;  // of the last push, for patients who differ ...                  [mm]
  double slack = 12.0;  // ... and of pushes and pulls that end by what is seen           [mm]
  double turn_slack = 30.0 * kRadPerDeg;  // ... and of turns
  int rounds = 4;  // of tries of a wire that passes the ostium by, at most, from so far beside
  double again_pull = 3.0, again_turn = 15.0 * kRadPerDeg;  //                          [mm, rad]
  int steers = 16;                                          // of a wire on its way up, at most
  std::size_t weighed = 5;  // scripts of a start whose neighbours are tried
};
inline constexpr ScriptTemplate kTemplate;

/// A script on its way, past where it started.
struct HookState : RaisedTools {
  double off = 0.0;     // how badly the catheter's tip lies for the ostium                   [mm]
  double level = 0.0;   // of the catheter's tip beyond the ostium                            [mm]
  double facing = 0.0;  // where it looked after the turn, NaN: nowhere                    [rad]
};

inline constexpr int kCatheter = 0, kWire = 1;

/// Steps one after the other, pushes of the same tool in one direction as one, turns too.
ToolScript with(ToolScript steps, const simulate::ToolStep& next);

/// What the hand does until it sees that: rounded as it is told.
void end_at(simulate::ToolStep& step, simulate::Until until, double at);

std::string mm_text(double value);  // "12 mm"

/// How far along the way the tip came in the pushes from this one on [mm].
double furthest_since(std::size_t push, const simulate::ToolTrial& trial, const simulate::Way& way);

/// Serial.
class HookSearch {
 protected:
  /// Hooks are looked for at `place`: the target's ostium, or where the side vessel of that number
  /// leaves the trunk.
  HookSearch(const Study& study, const ToolPair& pair, const simulate::TakeOff& place, int side,
             const std::function<bool()>& cancelled, simulate::ToolTrial& trial, Hooks hooks);
  ~HookSearch() = default;
  HookSearch(const HookSearch&) = delete;
  HookSearch& operator=(const HookSearch&) = delete;

  bool stop() const { return cancelled_ && cancelled_(); }
  double insertion(int tool) const { return trial_.insertion(tool); }
  double measure(simulate::Until until, int tool) const {
    return trial_.measure(until, tool, side_);
  }
  HookState here(double off = 0.0) const;
  void back_to(const HookState& state);
  /// Makes a step and adds it to the script; takes it back where it ends the trial. False there,
  /// and where it reaches the target, which keeps the script.
  bool go(const simulate::ToolStep& step);
  /// How far the line on from the catheter's tip, which the wire will take, passes the ostium by;
  /// the further off that is, the less it counts.
  double off();
  /// Whether the catheter's tip looks away from the branch, so that pulling it past is in vain.
  bool looks_away();
  /// Of each turn the states that lie best while both tools are pulled past the ostium. Where bends
  /// hold the twist and the tip looks away from the branch at all turns, the hub is turned on,
  /// after a short pull, which lets the twist through.
  std::vector<HookState> turn_and_pull();
  /// So many turns to one side from here, each with its pull; false where one cannot be made.
  bool turn_on(double side, int turns, std::vector<HookState>& hooks);
  bool may_turn() const;
  /// Of the hub since the catheter was pushed or pulled.
  double turned_in_place() const;
  /// Turns the catheter's hub, where it has been turned as far as the rules let after a pull.
  bool turn_hub(double by);
  /// A pull, as long as the rules ask for after the turn.
  bool let_twist_through();
  /// A way up from here by `raise`, which says what stopped it where it comes to no depth; then
  /// back to here.
  StartFindings raise_from_here(std::vector<RaisedTools>& depths,
                                const std::function<std::string()>& raise);
  /// The wire, on to so far behind the catheter's tip, by whole millimetres.
  bool follow_behind(double by);
  /// Turns it by parts that the rules let in one place, with pushes of both tools between, so long
  /// at least. False where it may not be turned.
  bool turn_below(double by, double push);
  std::string find_broken(const ToolScript& steps) const;
  /// Adds the best states of a pull from here, and comes back here. From below the ostium, as where
  /// the image ends too near above it, of a push as well.
  void pull_past(std::vector<HookState>& hooks);
  /// The same by moves of so much.
  void move_past(double by, std::vector<HookState>& hooks);
  /// Of the states along a pull those that lie best, and not next to each other.
  static void keep_best(std::vector<HookState> own, std::vector<HookState>& hooks);
  /// At most so many, first those whose tips look toward the branch.
  static std::vector<RaisedTools> keep_facing(std::vector<HookState> all, std::size_t most);
  /// The last turn of a hook, past the steps begun with, and the pull after it end where they
  /// brought the tip to, not by their length.
  void end_by_sight(const HookState& hook, std::size_t begun);

  const Study& study_;
  const simulate::TakeOff& place_;
  const int side_;
  const bool every_hook_;
  const std::function<bool()>& cancelled_;
  const Catheter& catheter_;
  const simulate::Wire& wire_;
  simulate::ToolTrial& trial_;
  ToolScript steps_;
  StartFindings findings_;
  std::string broken_;  // rule, by the longest pull or the last that reached

 private:
  /// What is done with a script that reached.
  virtual void keep(ToolScript steps) = 0;

  double least_aside_ = kPi;   // of the catheter's tip and the branch, turned              [rad]
  bool looked_there_ = false;  // by less than a right angle
};

}  // namespace wireplan::plan
