#pragma once
/// A wire on its way into a vessel: what one push, pull or turn of the hand does to it.
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "simulate/contact/wall_contact.h"
#include "simulate/equilibrium/solver.h"
#include "simulate/insertion/push.h"
#include "simulate/insertion/push_balance.h"
#include "simulate/insertion/start_line.h"
#include "simulate/wall/vessel_model.h"
#include "simulate/wire/rod.h"

namespace wireplan::simulate {

inline constexpr std::size_t kFewestElements = 4;  // of a wire that is pushed in

/// How finely and how far to push; the same for all trials of a study.
struct InsertionOptions {
  double length = 250.0;        // most wire to bring into the body                      [mm]
  double step = 1.0;            // of one push                                           [mm]
  double element_length = 1.0;  //                                                       [mm]
  /// If not empty: the element length of each section of the wire, tip first; 0 stands for
  /// element_length. It is shortened so that whole elements fill the section [mm].
  std::vector<double> section_element_length = {};
  double contact_spacing = 1.0;      // see ContactOptions::spacing                      [mm]
  double friction = 0.0;             // Coulomb's coefficient of wires that have none of their own
  double friction_factor = 1.0;      // on the friction of every wire
  double support_factor = 1.0;       // on what holds the vessel's cross-sections, where they move
  ContactLaw contact_law = {};       // the default; see contact_law.h
  double residual_tolerance = 1e-6;  // largest nodal force out of balance               [N]
  int max_iterations = 50;           // Newton iterations per solve; see Insertion::push()
  double record_every = 5.0;         // spacing of the stored shapes                     [mm]
  Vec3 gravity = Vec3::Zero();       // on the wire outside the introducer, less buoyancy  [mm/s^2]
  bool map_forces = true;            // whether the wall's triangles remember their peak forces
  bool record_terms = false;         // whether each push records its energy by term
  bool push_on = false;              // whether a wire whose tip is stuck, or that folds back, is
                                     // pushed on; see TrialResult::stuck
};

/// Coulomb's coefficient as it acts between the wire and the wall.
double friction_of(const Wire& wire, const InsertionOptions& options);

/// The wire's energy by term after a push, and how its tip is rolled.
struct PushTerms {
  Energy energy;
  /// Of the tip's material director, counted as the hub's roll is and carried along the wire
  /// without twist: the roll of the hub and all twist between. That of the hub where the wire has
  /// no twist [rad].
  double tip_roll = 0.0;
};

/// The introducer: wire slides along its axis and is free beyond its point.
struct Introducer {
  Vec3 point = Vec3::Zero();       // where the wire becomes free, inside the lumen      [mm]
  Vec3 direction = Vec3::UnitZ();  // unit, into the vessel
  double roll = 0.0;               // of the hub, right-handed about the direction     [rad]
};

/// Where the wire touches the wall in the final shape.
struct WireContact {
  int node = 0;                        // column of TrialResult::nodes, and how far ...
  double part = 0.0;                   // ... from there to the next node, 0 to below 1
  int triangle = -1;                   // of the surface; -1: none found there
  Vec3 point = Vec3::Zero();           // on the wire's surface toward the wall          [mm]
  Vec3 normal_force = Vec3::Zero();    // of the wall on the wire                        [N]
  Vec3 friction_force = Vec3::Zero();  // of the wall on the wire, along the wall        [N]
  double penetration = 0.0;            //                                                [mm]
  double wall_displacement = 0.0;      // outward                                        [mm]
};

/// The same, with the triangle that the point is on; nodes counted from the rod's proximal end.
WireContact contact_of(const Touch& touch, double wire_radius, const TriangleLocator& locator);

/// Largest normal force that a triangle of the surface took at any time.
struct TriangleForce {
  int triangle = 0;
  double force = 0.0;  //                                                                 [N]
};

/// Most of a wire that can be brought into the body: up to `options.length`, and no more than there
/// is [mm].
double longest_insertion(const Wire& wire, const InsertionOptions& options);

/// The wire between two moves, always in equilibrium. Nodes in the introducer lie on its axis and
/// turn with the hub; the others are free. Deterministic; shares the vessel read-only.
class Insertion {
 public:
  /// Keeps a reference to the vessel. Expects a unit direction and positive lengths.
  Insertion(const Wire& wire, const Introducer& introducer, const VesselModel& vessel,
            const InsertionOptions& options);

  /// Lays the wire along a line and finds the equilibrium nearest to it: springs hold the wire to
  /// the line, brought into the lumen, and fade away in steps. Friction acts from where the wire
  /// first touches, so that it stays where that holds it. Its shape, with what the hand did until
  /// then counted as the energy stored. Empty where there is no such equilibrium; nothing else may
  /// then be asked of the insertion. Expects that nothing was pushed in yet.
  std::optional<Push> start(const StartLine& start);

  /// Pushes the wire in by `distance`, or pulls it back by -`distance` [mm], in parts that are
  /// short enough for friction to follow. A part that runs out of iterations is taken for a jump:
  /// the solve goes on from where it got, up to six times. A part that has no equilibrium is cut
  /// smaller. Empty when even the smallest cut has none; the wire is then somewhere on the way, and
  /// take_back() undoes the move. Expects that so much wire is left to push, or in the body to
  /// pull.
  std::optional<Push> push(double distance);

  /// Turns the hub by `angle`, right-handed about the introducer's direction [rad], in the same
  /// way. A straight round wire does not feel it.
  std::optional<Push> turn(double angle);

  /// The opening that the wire has left through; and the one through which it was when a part of
  /// the last move found no equilibrium. A stiff wire may find none there, since it springs out
  /// further than the free space in front of an opening reaches.
  std::optional<int> left_through() const;
  std::optional<int> slipped_out() const { return slipped_out_; }

  double longest() const { return longest_; }       // that can be brought into the body      [mm]
  double depth() const { return depth_; }           // wire in the body                       [mm]
  double hub_angle() const { return hub_angle_; }   // since the start               [rad]
  double roll() const { return introducer_.roll; }  // of the hub at the start       [rad]
  /// Of the hand on the wire at this very place, with the ripple of the elements (PushBalance) [N].
  double hand_force() const { return totals_.push_force; }
  const Rod& rod() const { return rod_; }
  Vec3 tip() const { return state_.x.rightCols<1>(); }
  int first_free() const { return problem_.first; }  // node
  /// The nodes from there on, as long as no move is made.
  Eigen::Ref<const Eigen::Matrix3Xd> free_wire() const {
    return state_.x.rightCols(rod_.nodes() - problem_.first);
  }
  Eigen::Matrix3Xd free_nodes() const { return state_.x.rightCols(rod_.nodes() - problem_.first); }
  /// Where a place is in the vessel at rest: elsewhere where cross-sections have moved. And the
  /// free nodes there.
  Vec3 at_rest(const Vec3& place) const;
  Eigen::Matrix3Xd free_nodes_at_rest() const;
  /// (3, s) how far the vessel's cross-sections have moved; empty where they do not [mm].
  const Eigen::Matrix3Xd& sections() const { return state_.sections; }
  /// (3, n) of the wall on the nodes, after the last move [N].
  const Eigen::Matrix3Xd& forces() const { return forces_; }
  PushTerms terms() const;  // of the present shape
  /// Contacts of the present shape; nodes counted from the first free one.
  std::vector<WireContact> contacts();
  std::vector<TriangleForce> peak_forces() const;  // over all moves so far, if mapped

  /// Where the wire has folded: within a short length it turns back on itself, more than at rest,
  /// so that its bow leads and its tip is behind.
  std::optional<Vec3> find_fold() const;
  Vec3 most_bent() const;

  /// Takes the wire back to before the last move, or to an earlier state; peak_forces() keep what
  /// they were.
  void take_back() { restore(before_move_); }
  struct Snapshot {
    RodState state;
    double depth = 0.0, hub_angle = 0.0;
    int first = 0;
    Eigen::Matrix3Xd forces;
    WallContact::Memory memory;
    Push totals;
    PushBalance balance;
    double wall_energy = 0.0;
  };
  void save(Snapshot& snapshot) const;
  void restore(const Snapshot& snapshot);

 private:
  NewtonResult advance(double distance);
  NewtonResult spin(double angle);
  NewtonResult settle_guess(double distance);
  NewtonResult followed(NewtonResult solve, int& iterations);
  NewtonResult follow_jump();
  template <class Part>
  std::optional<Push> move(double amount, double longest_part, const Part& part);
  double roll_of_shape() const;
  void lay_along(const StartLine& start, Springs& springs);
  void turn_with_the_hub(RodState& state) const;
  void bend_at_the_exit();
  double length_outside(int i) const;
  double twist_length(int i) const;
  Vec3 ahead_of(int i, double distance);
  void bend_off_wall(int tip);
  void forget_drift() {
    drift_.setZero();
    moved_.setZero();
  }
  double push_force(const HeldEnd& held) const;
  Vec3 edge(int i) const { return state_.x.col(i + 1) - state_.x.col(i); }
  Vec3 turn_at(int i) const;
  double stored_energy(const NewtonResult& solve) const;
  void settle(double distance, double angle);
  void find_work(Push& record);
  void measure(Push& record);
  void add_triangle_forces();

  Introducer introducer_;
  InsertionOptions options_;
  const VesselModel& vessel_;
  Rod rod_;
  Rod whole_;  // as if all of it were outside; rod_ is cut at the exit
  WallContact contact_;
  RodState state_, guess_;
  Snapshot before_move_, before_part_;
  Problem problem_;
  NewtonOptions newton_;
  Statics statics_;
  int first_curved_ = 0;  // first node with a rest angle; the number of nodes where there is none
  int ahead_ = 0;         // see ahead_of()
  int exit_first_ = 1, exit_last_ = 0;  // nodes that bend_at_the_exit() changed
  double deepest_ = 0.0;  // the wire was past the resting wall                            [mm]
  double depth_ = 0.0, longest_ = 0.0;
  double hub_angle_ = 0.0;      // since the start                                           [rad]
  double last_distance_ = 0.0;  // of the last push; negative: pulled                         [mm]
  std::optional<int> slipped_out_;
  Push totals_;  // forces of the hand now, works and energy so far
  PushBalance balance_;
  double wall_energy_ = 0.0;  // of the stored energy, in the yielding wall              [N mm]
  Eigen::Matrix3Xd path_;     // where the wire ahead of each node was before the last push   [mm]
  Eigen::Matrix3Xd drift_;    // off that path, per length of push
  Eigen::Matrix3Xd moved_;    // each node in the last push, per length of it
  Eigen::Matrix3Xd weight_;   // (3, n) of each node; empty without gravity                    [N]
  Eigen::Matrix3Xd forces_, guess_ahead_;
  std::vector<Touch> touches_;
  std::vector<Vec3> force_sums_;                         // scratch
  std::vector<std::int32_t> mapped_;                     // triangle that each contact point was on
  std::vector<std::pair<int, double>> triangle_forces_;  // of this push
  std::map<int, double> peak_forces_;                    // of all pushes, by triangle
};

}  // namespace wireplan::simulate
