#pragma once
/// Tools in one another, on the laboratory bench or in a vessel: a wire in a catheter, in a sheath,
/// that a hand pushes, pulls and turns one by one or together, out of an introducer (tool_stack.h).
///
/// Nodes lie evenly along the centreline, from the introducer's point to the foremost tip, and
/// slide along the tools. Hands feel the derivatives of the energy: the force on a tool is what the
/// energy gains per length of push with all nodes held, the torque what it gains per turn of the
/// hub. That has in it the configurational forces at the mouths of outer tools and at the
/// introducer.
///
/// Friction between tools acts on the hands alone, not on the shape. Where the inner tool of a pair
/// slides, its normal force on the outer is summed from the mouth to the introducer, with the force
/// H of the hand on it growing as on a capstan: per node |H| theta + |M''| l, M the inner tool's
/// moment, theta the centreline's turn and l the node's share of length. M'' is a difference over
/// the length that the play between the tools lets the inner one bridge.
///
/// In a vessel the nodes touch the wall, as thick and as rough as the outermost tool there. What
/// friction holds is the tool: before each solve anchors go back along the node's tangent by as
/// much as the tool slides past the node, and on the hand acts the wall's friction along it. Since
/// nodes go with the foremost tip, that is less the nearer to it they are.
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "simulate/contact/moving_frame.h"
#include "simulate/equilibrium/solver.h"
#include "simulate/insertion/scene.h"
#include "simulate/wire/tool_stack.h"

namespace wireplan::simulate {

/// What the hand does to all tools at once, from the outside in.
struct ToolMove {
  std::vector<double> push;  // negative: pulled                                          [mm]
  std::vector<double> turn;  // of the hubs, right-handed about the introducer's direction [rad]
};

/// Where tools are after that part of a move. Pushes that add up to nothing, or to a whole tool, do
/// so but for rounding.
std::vector<ToolPlace> moved(const std::vector<Tool>& tools, std::vector<ToolPlace> places,
                             const ToolMove& by, double part = 1.0);

struct ToolScene {
  std::vector<Tool> tools;        // from the outside in
  std::vector<ToolPlace> places;  // where they start
  Vec3 point = Vec3::Zero();      // of the introducer, where the tools become free       [mm]
  Vec3 direction = Vec3::UnitX();
  std::optional<Support> distal;        // of the foremost tip, clamped or pinned; holds no roll
  Loads loads;                          // no tip torque
  std::optional<Vec3> plane;            // as in Scene
  const VesselModel* vessel = nullptr;  // round the tools; null: none
  ContactOptions contact;  // with it; points of contact are the nodes, tools may rub by their own
  double friction = 0.0;   // Coulomb's coefficient between tools
  double element_length = 1.0;  // where the tools are furthest in                      [mm]
  std::vector<ToolMove> moves;
  /// Moves are made in parts of so much push at most. In a vessel friction is held to where tools
  /// were before a part, so that after longer ones they may go on in another branch.
  double longest_part = 2.0;  //                                                          [mm]
  /// Whether a part is cut where the hands' forces at its ends are no measure of its work, as where
  /// tools jump in it. What is not cut is a jump by its forces alone. In a vessel cutting takes
  /// several times the iterations.
  bool cut_jumps = true;
  double residual_tolerance = 1e-6;  // largest nodal force out of balance                 [N]
  int max_iterations = 200;          // of a solve
};

/// What one tool does after a move. Forces and torques of the hand on it.
struct ToolReport {
  ToolPlace place;
  double push_force = 0.0;  // into the body, with friction                               [N]
  double hub_torque = 0.0;  // about the introducer's direction                        [N mm]
  Vec3 tip = Vec3::Zero();  //                                                           [mm]
  double twist = 0.0;       // of its tip against its hub; 0 of a straight tool         [rad]
  double wall_force = 0.0;  // sum of the wall's normal forces on it                      [N]
};

/// What tool i does to tool i + 1 inside it.
struct ToolContact {
  double normal_force = 0.0;     // sum of its amounts, friction's growth included         [N]
  double friction_force = 0.0;   // along the tools, of the inner on the outer; signed     [N]
  double friction_torque = 0.0;  //                                                   [N mm]
};

/// After a move, or at the start.
struct ToolRecord {
  std::vector<ToolReport> tools;
  std::vector<ToolContact> contacts;  // between each tool and the next one inside
  Energy energy;                      //                                              [N mm]
  double work = 0.0;      // of the hands since the start                             [N mm]
  double heat = 0.0;      // of friction, of that work                                [N mm]
  double released = 0.0;  // of it by jumps                                           [N mm]
  /// What forces at the ends of parts of moves do more than the energy gained, without jumps.
  double unbalanced = 0.0;  //                                                        [N mm]
  double residual = 0.0;    //                                                             [N]
  int iterations = 0;       // of this move
  /// Largest of the energy over the accepted steps of this move's solves, with the lag that they
  /// were made with; 0 unless rounding [N mm].
  double worst_energy_rise = 0.0;
};

/// So many elements divide a centreline of that length, none longer than asked for [mm].
int elements_over(double length, double element_length);

class ToolBench {
  /// The centreline, and the angles of the twisted tools, one column each.
  struct Shape {
    Eigen::Matrix3Xd x;
    Eigen::MatrixXd angles;
  };

  /// How the last move went, for one that goes on with it: friction does not turn round then.
  struct Going {
    ToolMove by;        // nothing: there was none, or it did not get to its end
    double size = 0.0;  // of the next part, as a part of the move; 0: there is none
    Shape drift;        // what the shape came off the way of before, per move
  };

 public:
  /// Expects what ToolScene says; the tools are then at their places in equilibrium if settled().
  /// Tools that would not lie free in the vessel as they are without loads, as long ones, are
  /// brought in together by the introducer from where they do. That is no move: work counts from
  /// then on.
  explicit ToolBench(const ToolScene& scene);
  /// Where the other is, as its mark would take it back there. Expects one that has settled.
  ToolBench(const ToolBench& other);
  bool settled() const { return settled_; }

  /// In parts that are short enough for the tools to follow. False where even the shortest part
  /// has no equilibrium: the tools are then where they were before that part. Expects tools that
  /// stay within 0 and their lengths, one of them beyond 0.
  bool move(const ToolMove& by);

  /// Divides the centreline anew, into edges no longer than the scene asks for once the foremost
  /// tip is `longest` in, and finds the equilibrium again. False, and all as before, where there is
  /// none. Tools whose moves are not in the scene need it before an edge is 1.5 times as long.
  bool divide(double longest);

  /// Presses a force on a tool's tip, in the place of one before, on top of the scene's loads, hubs
  /// held, and finds the equilibrium [N]. It goes with the tip from then on. The record stays that
  /// of the last move. False, and all as before, where there is no equilibrium.
  bool press(int tool, const Vec3& force);

  /// Puts another tool in the place of one that is out of the body, at insertion 0, with its hub
  /// turned by `roll`. Shape, forces and work stay; the energy changes by what their curves store
  /// outside. Expects one that fits, in a vessel with a friction of its own.
  void replace(int tool, const Tool& with, double roll);

  /// save() marks where the tools are, restore() takes them back there.
  struct Mark {
    int elements = 0;
    std::vector<Tool> tools;
    std::vector<ToolPlace> places;
    RodState state;
    ContactMemory memory;  // with the vessel
    Going going;
    ToolRecord record;
    Vec3 pressed = Vec3::Zero();  // see press()
    int pressed_tool = 0;
  };
  Mark save() const;
  void restore(const Mark& mark);

  const ToolRecord& record() const { return record_; }
  const RodState& state() const { return now_.state; }
  const Composite& composite() const { return now_.composite; }
  const std::vector<ToolPlace>& places() const { return now_.places; }
  const std::vector<Tool>& tools() const { return scene_.tools; }
  /// Angle of a tool's director along the edges, counted as its hub's roll and carried along the
  /// centreline without twist; empty of a straight tool [rad].
  Eigen::VectorXd angles(int tool) const;
  /// The centreline up to a tool's tip, (3, m) [mm].
  Eigen::Matrix3Xd nodes_of(int tool) const;
  /// The places in the vessel at rest of points (3, k), where its cross-sections move [mm].
  Eigen::Matrix3Xd at_rest(const Eigen::Matrix3Xd& points) const {
    return places_at_rest(chain(), now_.state.sections, points);
  }
  /// Force of the introducer, and of a distal support, on the tools [N].
  Vec3 introducer_force() const;
  Vec3 distal_force() const;
  /// The hand's force on a tool without friction [N].
  double free_force(int tool) const;

  /// Where the tools touch the wall.
  std::vector<Touch> touches() const;
  bool through_wall() const { return through_wall_; }  // why the last move ended

  /// The problem of the present places; refers to this bench.
  Problem problem() const;

 private:
  struct State {
    std::vector<ToolPlace> places;
    Composite composite;
    Eigen::Matrix3Xd load;
    RodState state;
    ContactMemory memory;  // with the vessel
    double energy = 0.0;   // once solved                                             [N mm]
    std::vector<Touch> touches;
    std::vector<WallContact::Slope> presses;
    std::vector<double> slope;   // of the energy, per push of each tool alone, once found    [N]
    std::vector<double> torque;  // of the hands ...
    std::vector<double> force;   // ... without friction between tools, once felt
  };

  const SectionChain* chain() const {
    return scene_.vessel != nullptr ? scene_.vessel->sections.get() : nullptr;
  }
  Problem problem_of(const State& at) const;
  void place(const std::vector<ToolPlace>& places, State& at) const;
  void set_load(const std::vector<ToolPlace>& places, const Rod& rod, Eigen::Matrix3Xd& load) const;
  void touch(const State& at);
  void take(const std::vector<Tool>& tools);
  void stand(State at);
  RodState unloaded(const State& at) const;
  bool lies_free(const State& at) const;
  void settle_at(const std::vector<ToolPlace>& places);
  void bring_in();
  Shape follow(const State& to) const;
  Shape shape() const;
  RodState guess(const State& to, const Shape& followed, const Shape& drift, double part) const;
  ContactMemory spread_contact(const State& from, const State& to) const;
  void bend_to_support(const State& to, Eigen::Matrix3Xd& x) const;
  void set_frames(const Eigen::MatrixXd& angles, RodState& state) const;
  double twist_of(int tool) const;
  Eigen::VectorXd slides(const State& from, const State& to) const;
  void carry_contact(const State& from, const Eigen::VectorXd& slides, State& to) const;
  static double outside_part(const State& at, std::size_t tool, const Touch& touch);
  bool solve(State& at);
  bool follow_jump(State& at, double& rubbed);
  bool settle_from(State& next);
  void feel_at_rest(State& at);
  Going going_on_with(const ToolMove& by);
  void rub_between(const ToolMove& by, double part);
  double rub(const Eigen::VectorXd& slides, State& at, double& by_hands);
  void take_forces(State& at);
  Energy find_energy(State& at);
  void find_slopes(State& at, const ToolMove& direction, bool all);
  double slope_of_move(const State& at, const ToolMove& by, double side);
  void feel(State& at, const ToolMove& direction) const;
  using Pushes = std::span<const double>;  // of all tools
  double energy_at(const State& at, Pushes push, double by);
  bool is_smooth(const State& at, Pushes push) const;
  double slope_along(const State& at, Pushes push, double side);
  double side_of(const State& at, std::size_t tool, const ToolMove& direction) const;
  double leads(const State& at, std::size_t tool, double side) const;
  static Vec3 edge_tangent(const RodState& state, Eigen::Index e);
  Eigen::Matrix3Xd moments(int tool) const;
  double bridged_length(std::size_t outer, const Eigen::Matrix3Xd& moment) const;
  ToolContact find_contact(std::size_t outer, const ToolMove& by) const;
  void report(const ToolMove& by);

  ToolScene scene_;  // its tools may be replaced
  int elements_ = 0;
  State now_, next_;  // next_: where a part of a move leads
  Going going_;
  Vec3 pressed_ = Vec3::Zero();  // on the tip of a tool
  int pressed_tool_ = 0;
  std::unique_ptr<WallContact> contact_;  // with the vessel, of the state that touched last
  ToolRecord record_;
  Statics statics_;
  std::vector<RubbedPoint> rubbed_;  // scratch, as is
  std::vector<ToolPlace> pushed_;
  Composite other_;
  Eigen::Matrix3Xd other_load_;
  bool settled_ = false, through_wall_ = false;
};

}  // namespace wireplan::simulate
