#pragma once
/// A wire in a catheter, brought into a vessel step by step, as Trial does with a wire alone, to an
/// outcome by the same rules: the target is reached where the foremost tip passes its cross-section
/// (or comes into its sphere), the tools having come along the way.
///
/// What a push records is of all tools together: `insertion` is that of the foremost tip, hub angle
/// and torque are the catheter's, the hand's force is that on what it moves, work and energy
/// are those of both. What each tool feels is in ToolTrack. Tips and goals are looked for in the
/// vessel at rest.
#include <optional>
#include <string>
#include <vector>

#include "simulate/insertion/tool_bench.h"
#include "simulate/insertion/trial.h"

namespace wireplan::simulate {

inline constexpr int kBothTools = -1;

/// Moves are made in parts of half a step that are at most so long: longer ones lead astray.
inline constexpr double kLongestToolPart = 0.5;  //                                         [mm]

/// Of a tool that is led past another vessel: see ToolStep. Chosen.
inline constexpr double kSteerBack = 30.0, kSteerFurther = 10.0, kSteerBehind = 30.0;  //  [mm]
inline constexpr double kSteerTurn = 45.0 * kRadPerDeg;
inline constexpr double kSteerBeforeEnd = 5.0;  //                                          [mm]
/// Of a tool that passes a branch by: see ToolStep. Chosen.
inline constexpr int kTriesOfRound = 4;
inline constexpr double kTryBeyond = 6.0, kTryAbove = 15.0;  //                             [mm]
/// No catheter is pressed harder for its support: more than a hand pushes on a wire; chosen.
inline constexpr double kMostSupport = 5.0;  //                                             [N]

/// So far before the take-off it is steered: what is astray nearer may lead the other tool on.
inline constexpr double kSteerNear = 50.0;  //                                             [mm]

/// Where the way takes a branch: what the hand watches on the screen.
struct TakeOff {
  double arc = 0.0;             // of the ostium, along the way                            [mm]
  Vec3 point = Vec3::Zero();    // there                                                   [mm]
  Vec3 trunk = Vec3::UnitZ();   // unit, where the trunk goes on
  Vec3 branch = Vec3::UnitX();  // unit, where the branch goes
};

/// A vessel off the way that tools are led into on purpose, as one in which a reversed curve is
/// reshaped: a branch of the way's tree, from its own ostium on.
struct SideVessel {
  int branch = -1;
  TakeOff take_off;   // `arc` along the way
  double from = 0.0;  // of its ostium, along the branch's line                            [mm]
};

/// What ends a step before the whole of it is made, of the tip of its tool, of several together of
/// the outermost.
enum class Until {
  kMade,      // nothing
  kLevel,     // the tip comes to be `at` mm beyond the ostium along the trunk, from either side
  kInBranch,  // the tip is `at` mm past the ostium along the way, in the branch
  kFacing,    // the tip, seen against the trunk, comes to look `at` rad from the branch, turned
              // right-handed about the trunk
  kBack,      // the tip comes to look `at` rad away from where the vessel goes on that it is in
};

/// Whether `at` is an angle there.
inline bool ends_by_angle(Until until) { return until == Until::kFacing || until == Until::kBack; }

/// One step of the hand on one tool, or on all together, which is pushed (pulled where negative) or
/// turned.
struct ToolStep {
  int tool = 0;       // from the outside in: 0 the catheter, 1 the wire; or kBothTools
  double push = 0.0;  //                                                                  [mm]
  double turn = 0.0;  // of its hub, right-handed about the introducer's direction       [rad]
  Until until = Until::kMade;
  double at = 0.0;  // see Until                                                     [mm, rad]
  /// Of a push of a tool that leads, at most so often: where its tip, on its way up to the
  /// take-off, goes into another vessel or comes no further, it is steered. It is withdrawn to
  /// kSteerBack before where that began, the tool outside it is brought up to kSteerBehind its tip,
  /// and it is led on. The next times the outer one is turned on by kSteerTurn, and both are
  /// kSteerFurther back, three times as much at most, then again as at first; after a whole turn
  /// each turn has another of these places. Near the access all
  /// lengths are shorter. Once the tool is up, the outer one is taken back as it was. Where all is
  /// in vain and the tip in another vessel, the trial ends. Past the take-off it is stopped
  /// kSteerBeforeEnd short of where the image ends.
  int steers = 0;
  /// Of a push of a tool that leads: where it is 20 mm out of the one outside it, or comes near to
  /// where the image ends, and is not in the branch, or comes no further along the way, it is
  /// withdrawn to where the step began, and the push begins anew with both pulled back by
  /// `try_pull` from where they were, then pushed on by it, then the outer one turned by
  /// `try_turn`, then to the other side; then all that with the pull doubled and `try_turn` more,
  /// ...; so often. The outer one's tip goes no further on than kTryBeyond past the ostium, or past
  /// where it was if that is beyond. To be turned, and where its tip has come out of the ostium, it
  /// hooks anew, since bends hold the twist of a hub that is turned in place: both are advanced to
  /// kTryAbove past there, no further than they have been, the tool that leads ahead as long as it
  /// is on the way, and pulled back to its level. A tip that looks aside is turned to the branch
  /// first.
  int tries = 0;
  double try_pull = 0.0, try_turn = 0.0;  //                                        [mm, rad]
  /// Of the innermost, in the place of a push or turn: it is withdrawn whole out of the body, the
  /// others being held, and the options' spare of this number is brought in instead, up to `at` mm
  /// behind the tip of the tool outside it. -1: no exchange.
  int spare = -1;
  /// The last of a script, of the outermost tool: made once the others have brought the goal, or
  /// all have been made; it brings none.
  bool seats = false;
  /// A branch of the way's tree that the options have as a side vessel: what ends the step is seen
  /// of that one's take-off, in the place of the target's. -1: none.
  int side = -1;
  bool operator==(const ToolStep&) const = default;
};

/// What is fixed of a trial of tools.
struct ToolTrialOptions {
  double friction_between = 0.05;  // Coulomb's coefficient of one tool in the other
  /// Elements, steps, tolerance, friction of the wall. `length` bounds the foremost tip in the last
  /// step of a script alone, since a wire may be further in before; past a reshaped catheter's knee
  /// by twice as much more as that lies beyond the take-off.
  InsertionOptions insertion;
  std::optional<TakeOff> take_off;  // that steps may end at; without one they are made whole
  /// That take the innermost's place: ToolStep. The goal is theirs: before the first exchange a tip
  /// may pass it.
  std::vector<Wire> spares = {};
  /// That steps may be seen at. Once the outermost tool has been in one, or its tip was to look
  /// back, its knee may lie in the trunk beyond the take-off when the target is reached, with its
  /// tip below.
  std::vector<SideVessel> sides = {};
};

/// Copies go on by themselves from where they were copied.
class ToolTrial {
 public:
  /// Keeps a reference to the vessel. Expects tools from the outside in that fit in one another,
  /// and a goal as Trial does. The innermost starts with its tip just beyond the introducer.
  ToolTrial(const std::vector<Tool>& tools, const Introducer& introducer, const Goal& goal,
            const VesselModel& vessel, const ToolTrialOptions& options);

  /// Makes a step, in parts of two of the options' steps or 15 degrees (less near what ends it), as
  /// far as the tool has length and the trial has not ended. The `last` one ends too where the tip
  /// of a tool that leads comes no further. False where the trial has ended.
  bool make(const ToolStep& step, bool last = false);

  bool ended() const { return outcome_.has_value(); }
  bool reached() const { return outcome_ == Outcome::kReached; }
  const std::string& reason() const { return record_.reason; }  // why it has ended
  const ToolBench& bench() const { return bench_; }
  double insertion(int tool) const;
  Vec3 tip(int tool) const;  // in the vessel at rest                                      [mm]
  Vec3 foremost_tip() const;
  Vec3 tip_direction(int tool) const;  // unit, onward
  /// What `until` measures of the tip: less in magnitude than `at` comes first. NaN where it cannot
  /// be told, as without a take-off. Of a side vessel where one is given; of a tip that is not in
  /// it kInBranch is the distance from its ostium, negative.
  double measure(Until until, int tool, int side = -1) const;
  const std::vector<Push>& pushes() const { return record_.pushes; }
  const Vec3& tip_after(std::size_t push) const { return tip_at_rest(record_, push); }  // [mm]

  /// So far the last step may bring the foremost tip, in the place of what the options say [mm].
  void bound(double length) { options_.insertion.length = length; }

  /// Makes the step that seats the outermost tool, unless the trial has ended otherwise than by
  /// reaching. Where the tool does not come so far, or anything else goes wrong, as where it draws
  /// the innermost back, all is as before.
  void seat(const ToolStep& step);

  /// Ends the trial, unless it has ended: as reached if the tip is in the goal, else as missed.
  /// Does not find the support.
  TrialResult finish();
  /// What the catheter bears where the trial has ended; empty unless it has come so far as to be
  /// reached, missed or stuck, and the catheter's tip is in the branch.
  std::optional<CatheterSupport> find_support() const;

  /// save() marks where an unfinished trial is, restore() takes it back there; peak forces stay. To
  /// a mark further on, of a copy, it brings no records of how it came there.
  struct Mark {
    ToolBench::Mark bench;
    std::size_t pushes = 0, shapes = 0;
    int step = -1, tries = 0;
    bool reshaped = false;
    double since_shape = 0.0, best_distance = 0.0, start_energy = 0.0;
    std::vector<ToolTrack::Change> changes;  // of the innermost
  };
  Mark save() const;
  void restore(const Mark& mark);

 private:
  bool advance(const ToolStep& step, bool last, bool looks);
  bool passes_by(const ToolStep& step) const;
  bool is_near_end(int tool, double within) const;
  /// Where the first try of a push begins.
  struct TryPlace {
    double outer = 0.0, ahead = 0.0;  // of the outer tool, and of the tool ahead of it      [mm]
    double level = 0.0;               // of the outer one's tip                              [mm]
  };
  TryPlace place_of_try(int tool) const;
  void try_again(const ToolStep& step, const TryPlace& from, int tried);
  void hook_anew(const ToolStep& step, double turn, const TryPlace& from);
  void move_by(const ToolStep& step);
  void make_steered(const ToolStep& step, bool last);
  void exchange(const ToolStep& step);
  void keep_end_of_step();
  bool awaits_spare() const;
  double longest() const;
  bool may_lose_way() const;
  bool loses_way(double pushed);
  bool comes_further(double pushed);
  bool part(const ToolStep& step);
  std::optional<double> missing(const ToolStep& step) const;
  double depth_in(const SideVessel& side, const Vec3& tip) const;
  bool divide_for(const ToolMove& move);
  bool move_or_divide(const ToolMove& move);
  void note(const ToolStep& step);
  void check_place();
  bool check_advance(double pushed);
  void end(Outcome outcome, const std::string& reason);
  void end_where_it_is(Outcome outcome, const std::string& reason);
  Shape shape_here() const;
  double foremost() const;
  double foremost_of(int tool) const;

  const Goal goal_;
  const VesselModel& vessel_;
  ToolTrialOptions options_;
  ToolBench bench_;
  double start_energy_ = 0.0;  // of the tools that are in use: what it is counted from   [N mm]
  double start_roll_ = 0.0;    //                                                          [rad]
  TrialResult record_;
  std::optional<Outcome> outcome_;
  int step_ = -1;         // of the script, under way
  int tries_ = 0;         // that were made again
  bool seating_ = false;  // then no goal is looked for
  std::string arrived_;   // how it reached
  double since_shape_ = 0.0, best_distance_ = 0.0;
  double furthest_ = 0.0, since_furthest_ = 0.0;  // along the way, pushed since: of this step [mm]
  std::vector<double> peak_;                      // per triangle of the wall, largest force  [N]
};

}  // namespace wireplan::simulate
