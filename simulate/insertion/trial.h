#pragma once
/// One insertion of one wire into one vessel and its outcome: run_trial(wire, introducer, goal,
/// vessel, options, moves) -> TrialResult. Serial and deterministic; shares the vessel read-only
/// with other trials.
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "simulate/insertion/insertion.h"
#include "simulate/insertion/self_crossing.h"
#include "simulate/insertion/way.h"

namespace wireplan::simulate {

/// Where to. Of a place in a vessel the way is known, and the tip reaches it when it passes the
/// vessel's cross-section at the way's end, and the rest of the wire came along the way. Of a point
/// or a sac, or without a way, it reaches it within a radius.
struct Goal {
  Vec3 point = Vec3::Zero();                 //                                           [mm]
  double radius = 4.0;                       // of the sphere; of a cross-section the lumen's [mm]
  bool at_section = false;                   // whether it is a place in a vessel; needs a way
  std::shared_ptr<const Way> way = nullptr;  // shared by all trials of a study
};

enum class Outcome {
  kReached,        // the tip passed the goal's cross-section, or came within its radius
  kMissed,         // all wire was pushed in, or the tip went by the goal; it is not reached
  kPassedBy,       // the tip went on in a vessel that the way leaves: it overshot the branch
  kWrongBranch,    // the tip took a branch that is not on the way
  kLeftImage,      // the tip came to an end of the imaged vessel, which goes on in the patient
  kStuck,          // pushing no longer advances the tip
  kProlapsed,      // the wire folded back on itself instead of advancing its tip
  kAnotherWay,     // the tip passed the goal's cross-section, but the wire came another way
  kCrossesItself,  // the wire ran through itself, which it does not feel
  kLeftLumen,      // the wire went further through the wall than contact explains
  kNotConverged,   // a push had no equilibrium to the tolerance, also when cut smaller
  kFailed,         // our fault; the reason holds the message
};
const char* outcome_name(Outcome outcome);  // "reached", "missed", "stuck", ...

/// How a trial ends whose tip is not on the way, and the start of its reason.
Outcome outcome_of(const Astray& astray);
std::string describe(const Astray& astray);

/// A shape on the way, for pictures and time series.
struct Shape {
  double insertion = 0.0;          //                                                  [mm]
  double hub_angle = 0.0;          //                                                 [rad]
  Eigen::Matrix3Xd nodes;          // (3, k) beyond the introducer, proximal to distal [mm]
  Eigen::Matrix3Xd sections = {};  // (3, s) how far the vessel's cross-sections have moved; empty
                                   // where they do not                                [mm]
  Eigen::VectorXd contact_force;   // (k) norm per node                                [N]
  /// Of several tools: how far each is in along these nodes, from the outside in; empty of one
  /// wire.
  std::vector<double> tools = {};  //                                                 [mm]
};

/// What one of several tools did and felt, an entry per push of the trial.
struct ToolTrack {
  std::string name;
  std::vector<double> insertion;   //                                                 [mm]
  std::vector<double> roll;        // of its hub since the start                     [rad]
  std::vector<double> push_force;  // of the hand on it, into the body                 [N]
  std::vector<double> hub_torque;  // of the hand on it                             [N mm]
  std::vector<double> tip_force;   // of the wall on its last 2 mm; 0 inside another   [N]
  std::vector<double> wall_force;  // sum of the wall's normal forces on it            [N]
  /// Another tool that takes its place, with what it does from an entry on.
  struct Change {
    std::size_t from = 0;
    std::string name;
  };
  std::vector<Change> changes;  // in their order
};

/// What a catheter whose tip is in a branch bears: the push of what is led out of it, against
/// anything that stops that further on, before its tip comes back out of the ostium. Hubs are held;
/// the push acts on its mouth as a force back along its axis, in the direction that it has at
/// first.
struct CatheterSupport {
  double push = 0.0;  //                                                                    [N]
  bool more = false;  // it bears that and more: no more was tried
};

struct TrialResult {
  Outcome outcome = Outcome::kFailed;
  std::string reason;                 // one sentence; with the place in mm where it failed, and
                                      // how rough its forces are, where work and energy differ
                                      // by more than 1 % of the work
  std::vector<Push> pushes;           // in the order in which they were made
  std::vector<PushTerms> push_terms;  // one per push, if recorded
  /// Where the tip did not advance, if pushed on: wire in the body from and to [mm].
  std::vector<std::pair<double, double>> stuck;
  /// Where the wire ran through itself first. The trial ends by that, unless it is pushed on.
  std::optional<SelfCrossing> crossing;
  Eigen::Matrix3Xd nodes;          // (3, k) final shape beyond the introducer, proximal to distal
  Eigen::Matrix3Xd sections = {};  // of the final shape, as Shape has them
  /// In the vessel at rest, in which ways and targets are: the tip after each push, and the final
  /// shape. Empty where cross-sections do not move                                          [mm]
  std::vector<Vec3> tips_at_rest = {};
  Eigen::Matrix3Xd nodes_at_rest = {};
  std::vector<WireContact> contacts;       // of the final shape
  std::vector<TriangleForce> peak_forces;  // over all pushes, ascending triangles; if mapped
  std::vector<ToolTrack> tools;            // of several tools, from the outside in; else empty
  std::vector<int> steps;  // of several tools: the step of the script that each push belongs to
  std::optional<CatheterSupport> support;  // of two, where the catheter ends in the branch
  /// Of several tools: the outermost has been in a side vessel, or was to look back, and may lie in
  /// the trunk beyond the target's branch with its knee.
  bool reshaped = false;
  std::vector<Shape> shapes;       // every `record_every` of the hand's way, and the final one
  std::vector<std::string> terms;  // energy terms that the scene built: "stretch", "bend", ...
  std::optional<Shape> start;      // the equilibrium that it started from, if from a line
  double roll = 0.0;               // of the hub before the first move                    [rad]
};

/// The tip after a push, in the vessel at rest [mm].
inline const Vec3& tip_at_rest(const TrialResult& trial, std::size_t push) {
  return trial.tips_at_rest.empty() ? trial.pushes[push].tip : trial.tips_at_rest[push];
}

/// "; its forces are rough: ..." where work and energy of an insertion differ by more than 1 % of
/// the work, else empty.
std::string describe_balance(const std::vector<Push>& pushes);

/// What the hand does: pushes the wire in, pulls it back, or turns the hub, or turns it as it
/// pushes.
struct Move {
  double push = 0.0;  // negative: pulls back                                            [mm]
  double turn = 0.0;  // of the hub, right-handed about the introducer's direction      [rad]
  bool operator==(const Move&) const = default;
};

/// An insertion step by step, to its outcome. Never throws for what the physics does.
///
/// Where the goal has a way, a trial ends too when pushing does not bring the tip further along it:
/// for 40 mm, or for 10 mm where it is as far as the sphere of a goal.
///
/// One insertion can serve several goals: what the wire does depends on none of them, so each gets
/// the result of a trial toward it alone, and the insertion goes on until it has ended for all.
class Trial {
 public:
  /// Keeps a reference to the vessel. Expects a unit direction and positive lengths, and
  /// cross-sections where there are several goals: a wire may be taken back in a sphere.
  Trial(const Wire& wire, const Introducer& introducer, const std::vector<Goal>& goals,
        const VesselModel& vessel, const InsertionOptions& options);
  Trial(const Wire& wire, const Introducer& introducer, const Goal& goal, const VesselModel& vessel,
        const InsertionOptions& options)
      : Trial(wire, introducer, std::vector<Goal>{goal}, vessel, options) {}

  /// Lays the wire along the line before the first move, see Insertion::start(). Its equilibrium is
  /// the first record. False where there is none, which ends the trial.
  bool start(const StartLine& line);
  /// Makes a move, in steps of the options' length or 15 degrees, as far as there is wire to push
  /// or to pull and the trial has not ended. A move that does both turns by its share after each
  /// step of its push.
  void make(const Move& move);
  /// One such step, of a push or a turn. False where the trial has ended, or no wire is left for
  /// it.
  bool step(const Move& move);
  /// Whether it has ended for all goals, and whether it reached the first.
  bool ended() const;
  bool reached() const { return pursuits_.front().outcome == Outcome::kReached; }

  double depth() const { return insertion_.depth(); }
  const std::vector<Push>& pushes() const { return record_.pushes; }
  /// Where the tip is in the vessel at rest, in which ways and goals are                     [mm]
  Vec3 tip_at_rest() const { return insertion_.at_rest(insertion_.tip()); }
  /// Ends the trial, unless it has ended: as reached if the tip is in the goal, else as missed.
  /// Hands out the results, in the order of the goals.
  std::vector<TrialResult> finish_all();
  TrialResult finish() { return std::move(finish_all().front()); }

  /// How far the tip has come toward one goal, and how that ended.
  struct Pursuit {
    double best_distance = 0.0;   // of the tip from the goal, in the last step            [mm]
    double furthest = 0.0;        // of the tip along the way, since the last other move   [mm]
    double since_furthest = 0.0;  // pushed since then                                     [mm]
    std::optional<Outcome> outcome = {};  // empty as long as the trial goes on for the goal
    std::vector<std::pair<double, double>> stuck = {};  // see TrialResult
    // Of one that has ended: so much of the record, and the end itself.
    std::size_t pushes = 0, shapes = 0;
    TrialResult end = {};
  };

  /// save() marks where an unfinished trial is, restore() takes it there from wherever it is, also
  /// after another mark; peak forces stay.
  struct Mark {
    Insertion::Snapshot insertion;
    std::vector<Push> pushes;
    std::vector<PushTerms> push_terms;
    std::vector<Vec3> tips_at_rest;
    std::vector<Shape> shapes;
    std::size_t pushing_since = 0;
    double since_shape = 0.0;
    std::optional<SelfCrossing> crossing;
    std::vector<Pursuit> pursuits;
  };
  void save(Mark& mark) const;
  void restore(const Mark& mark);

 private:
  void end(std::size_t goal, Outcome outcome, const std::string& reason);
  void end_where_it_is(std::size_t goal, Outcome outcome, const std::string& reason);
  bool end_all(Outcome outcome, const std::string& reason);
  bool end_in_sphere();
  void record(const Push& push);
  void check_place(std::size_t goal);
  void check_advance(std::size_t goal, double distance);
  void check_motion(std::size_t goal);
  bool pushed_on(std::size_t goal, double from, double to);
  bool ends_by_crossing();
  std::string reached_reason(std::size_t goal) const;
  std::string place_of(int opening) const;
  std::string named_end(std::size_t goal, int opening) const;
  Shape shape_here() const;

  std::vector<Goal> goals_;
  const VesselModel& vessel_;
  InsertionOptions options_;
  Insertion insertion_;
  CrossingFinder crossings_;
  TrialResult record_;  // of all goals: start, pushes, shapes on the way, terms and crossing
  std::vector<Pursuit> pursuits_;  // one per goal
  double since_shape_ = 0.0;       // way of the hand since a shape was recorded          [mm]
  std::size_t pushing_since_ = 0;  // all records from here on are pushes
};

/// Makes the moves, none for a straight push, then pushes the wire in until the tip reaches the
/// goal, all wire is in, or a named failure.
TrialResult run_trial(const Wire& wire, const Introducer& introducer, const Goal& goal,
                      const VesselModel& vessel, const InsertionOptions& options,
                      const std::vector<Move>& moves = {});

/// One straight push toward several cross-sections: for each what run_trial() gives.
std::vector<TrialResult> run_trials(const Wire& wire, const Introducer& introducer,
                                    const std::vector<Goal>& goals, const VesselModel& vessel,
                                    const InsertionOptions& options);

}  // namespace wireplan::simulate
