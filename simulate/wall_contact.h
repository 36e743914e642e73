#pragma once
/// The wire against the wall of the vessel: where it touches, with which normal and friction
/// forces, and how the wall gives way. Part of the energy that solver.h minimises.
#include <algorithm>
#include <vector>

#include "simulate/rod.h"
#include "simulate/vessel_model.h"
#include "simulate/yielding.h"

namespace wireplan::simulate {

struct ContactOptions {
  ContactLaw law;
  double spacing = 1.0;   // most between two contact points; half of it near the tip     [mm]
  double friction = 0.0;  // Coulomb's coefficient
  double slip = 0.02;     // displacement along the wall that develops friction fully     [mm]
};

/// A point of the wire that touches the wall.
struct Touch {
  int point = 0;                   // its place among all contact points of the wire
  int edge = 0;                    // between nodes edge and edge + 1 ...
  double part = 0.0;               // ... at this part of it, 0 to 1
  Vec3 position = Vec3::Zero();    // on the wire's axis                                    [mm]
  Vec3 normal = Vec3::Zero();      // of the wall, unit, into the lumen
  double normal_force = 0.0;       //                                                       [N]
  Vec3 friction = Vec3::Zero();    // of the wall on the wire                               [N]
  double penetration = 0.0;        // of the wire's surface past the yielded wall           [mm]
  double wall_displacement = 0.0;  // outward                                             [mm]
  double tip_distance = 0.0;       // along the wire                                      [mm]
};

/// Energies of the contact [N mm].
struct ContactEnergy {
  double contact = 0.0;   // of the contact law
  double wall = 0.0;      // of the yielded wall
  double friction = 0.0;  // potential whose slope is the lagged friction; not stored anywhere
  double total() const { return contact + wall + friction; }
};

/// Contact of one wire with one vessel. Holds what the points remember from the last equilibrium
/// (friction) and the memory of the solves: one per trial. Points lie on the nodes and evenly
/// between them, so that long elements feel a short ridge.
///
/// Friction and the place where a force acts on the wall depend on the state in a way that has no
/// potential. Both are lagged: taken from a state of before, they have one. The solver refreshes
/// the lag as it goes, and ends only in a state whose own lag it is.
class WallContact {
 public:
  struct Point {
    int edge;
    double part, share, tip_distance;  // share: length of wire that it stands for           [mm]
  };

  /// Keeps a reference to the vessel.
  WallContact(const Rod& rod, const VesselModel& vessel, const ContactOptions& options);

  // ---- the trial's part

  /// Only points nearer to the tip than this touch; those behind it are still in the introducer
  /// [mm]. At the start: all.
  void free_from(double tip_distance);
  /// Takes the state as one in which nothing has slipped yet.
  void start_at(const Eigen::Matrix3Xd& x);
  /// Before a push by `distance`: each point will feel what the wire ahead of it felt.
  void predict(double distance);
  /// After an equilibrium: where friction was overcome, points have slipped. Returns the work that
  /// turned into heat since the last call [N mm].
  double settle();
  /// Points that touch in the state sampled last, proximal to distal.
  const std::vector<Touch>& touches();

  /// Whether a point is so far outside that the field knows no wall there, in the state sampled
  /// last: it feels nothing.
  bool lost() const { return lost_; }

  /// What the points remember from one equilibrium to the next.
  struct Memory {
    Eigen::Matrix3Xd anchor;             // (3, m) where friction holds a point to              [mm]
    Eigen::VectorXd normal_force;        // (m)                                                 [N]
    std::vector<std::int32_t> triangle;  // (m) of its foot on a wall that yields; -1: none
  };
  const Memory& memory() const { return memory_; }
  void restore(const Memory& memory) { memory_ = memory; }

  // ---- the solver's part

  /// First sampling of a solve: finds which points touch at x, with the lag of the prediction.
  void begin(const Eigen::Matrix3Xd& x);
  /// Finds which points touch at x and their normal forces. Returns the energy with the lag as it
  /// is.
  ContactEnergy sample(const Eigen::Matrix3Xd& x);
  /// Takes the lag from the state sampled last; `fully`: and nothing of the one before. Returns the
  /// state's energy with that lag.
  ContactEnergy refresh(bool fully);
  /// From now to the next begin() a point's place on the yielding wall is refreshed only where the
  /// point has moved by more than a quarter of a millimetre since. The wall's stiffness has kinks
  /// along the edges of triangles, and the place jumps where these fold: a soft tip there may else
  /// find no equilibrium.
  void hold_feet() { feet_held_ = true; }
  /// The lag may be taken back to what it was when saved; the next sampling is with that.
  void save_lag() { saved_lag_ = lag_; }
  void restore_lag() {
    lag_ = saved_lag_;
    fresh_ = false;
    feet_changed_ = true;
  }
  /// Whether the lag is that of the state sampled last; always so where nothing is lagged.
  bool lag_is_fresh() const { return fresh_ || (!yielding_ && options_.friction == 0.0); }
  /// Energy with the lag as it is, of the state sampled last.
  ContactEnergy energy() const { return energy_; }

  /// A motion of the wire, node by node with `stride` numbers each, of which the first three are
  /// the node's; nodes from `first` to before `last`, the others are at rest.
  struct Motion {
    int first, last, stride;
    const Eigen::VectorXd& values;

    Vec3 of_node(int i) const;
    Vec3 of(const Point& point) const;
    /// Adds a force at a point to its nodes, in the same layout.
    void scatter(const Point& point, const Vec3& force, Eigen::VectorXd& target) const;
  };

  /// What Newton's method expects the normal forces to become. Where there is an expectation, the
  /// Hessian of add() has the contact law's mean stiffness between the force and the expected one,
  /// and the wall's curvature times the latter: Newton's method for positions and forces together.
  /// The law is quadratic where it starts; on its tangent a force that is to vanish would fall to
  /// only a quarter of itself per iteration, and a tip that was guessed too deep in the wall would
  /// make the Hessian indefinite.
  ///
  /// After a step along the motion, full or not: as the Hessian of the state sampled last says.
  void expect_after(const Motion& motion);
  /// Makes the Hessian that of the energy.
  void expect_nothing() { expected_.setConstant(kNoExpectation); }

  /// Adds gradient and Hessian of the state sampled last to a sink of elements.h. Pairs of points
  /// further apart than two nodes are left out of the Hessian, with their size added on its
  /// diagonal, so that it is positive definite where the exact one is; and so is how friction
  /// depends on the normal force: see add_remainder().
  template <class Sink>
  void add(Sink& sink);

  /// Adds to `product` what the Hessian of add() leaves out, times the motion: far pairs,
  /// friction's dependence on normal forces, and how the wall yields less or more where the wire
  /// slides to.
  void add_remainder(const Motion& motion, Eigen::VectorXd& product);
  bool has_remainder() const { return !active_.empty() && (yielding_ || options_.friction > 0.0); }

  /// Largest part of a motion of the state sampled last that takes no point across the wall: a
  /// point may go as far as it is from the wall and a quarter of a millimetre into it, where
  /// contact pushes it back; with more looks, so far again from where that leads if it is at most
  /// as much deeper there, and so on, so that it may slide along the wall. Infinite where there is
  /// no bound.
  double largest_safe_part(const Motion& motion, int looks) const;

 private:
  /// A point near enough to the wall to matter, in the state sampled last.
  struct Active {
    int point;
    Vec3 position;
    WallSample wall;
    double force = 0.0;      // normal, of the potential: times the gradient's norm in newtons
    double stiffness = 0.0;  // of the contact law, see expect_after()                   [N/mm]
    double yield = 0.0;      // displacement of the wall                                 [mm]
  };
  /// Where a point is, from where friction holds it, along the wall.
  struct Rubbing {
    double length;                    //                                                  [mm]
    Vec3 toward;                      // unit
    double limit;                     // friction's largest force                         [N]
    double energy, slope, curvature;  // of the potential per `limit`
  };
  Vec3 position_of(const Point& point, const Eigen::Matrix3Xd& x) const;
  double reach() const;  // of contact, from the wire's axis                              [mm]
  void find_active(const Eigen::Matrix3Xd& x);
  void find_forces();
  ContactEnergy lagged_energy() const;
  Rubbing rubbing_at(int k) const;
  void find_foot(const Active& active);
  void find_stiffness();
  bool in_band(const Active& a, const Active& b) const;
  double way_inside(const Vec3& from, const Vec3& toward, double length, double distance,
                    int looks) const;
  void find_change(const Motion& motion);

  const VesselModel& vessel_;
  ContactOptions options_;
  bool yielding_, feet_held_ = false;
  bool stiffness_known_ = false;  // of the state sampled last: see find_stiffness()
  double radius_;
  std::vector<Point> points_;                      // proximal to distal
  std::size_t first_free_ = 0, first_moving_ = 0;  // those before do not touch, do not move
  Memory memory_;
  std::vector<Active> active_;
  std::vector<Touch> touches_;
  ContactEnergy energy_;

  /// Per point: normal force and normal, for friction; the points that have one; and the place on
  /// the yielding wall, with where the point was when that was found.
  struct Lag {
    Eigen::VectorXd force;    // [N]
    Eigen::Matrix3Xd normal;  // unit
    std::vector<int> points;
    std::vector<SurfacePoint> feet;
    Eigen::Matrix3Xd foot_from;  // [mm]
  };
  Lag lag_, saved_lag_;
  std::vector<int> kept_points_;
  bool fresh_ = false;
  bool lost_ = false;

  // Per point: where it is, and the last known distance of the wall, with the place of that.
  Eigen::Matrix3Xd position_, known_position_;  // [mm]
  Eigen::VectorXd known_distance_;              // [mm]
  Eigen::VectorXd bound_;                       // at least so far from the wall now         [mm]
  std::vector<char> touched_;                   // when the wall was last looked at

  // The yielding wall: the coupling of the points that touch, and their feet.
  Yielding coupling_;
  std::vector<SurfacePoint> coupled_feet_;
  std::vector<int> coupled_points_;
  bool feet_changed_ = true;
  std::vector<Mat3> foot_slopes_;  // of the weights of each foot over its point's motion   [1/mm]
  Eigen::VectorXd forces_;         // per active point                                      [N]
  Eigen::VectorXd folded_;  // on the diagonal, per active point: see add()                [N/mm]
  Eigen::VectorXd press_;   // normal force on the yielding wall, per point, last found         [N]

  static constexpr double kNoExpectation = -1.0;
  Eigen::VectorXd expected_;  // normal force per point, or kNoExpectation                   [N]

  // Scratch. The last four are per active point: gap, length of wire, how a motion changes the
  // force, and what of that add() leaves out.
  Eigen::VectorXd predicted_, displacement_, gap_, share_, change_, left_out_;
  Eigen::Matrix3Xd motion_;
};

inline Vec3 WallContact::Motion::of_node(int i) const {
  if (i < first || i >= last) return Vec3::Zero();
  return values.segment<3>(stride * (i - first));
}

inline Vec3 WallContact::Motion::of(const Point& point) const {
  if (point.part == 0.0) return of_node(point.edge);
  return (1.0 - point.part) * of_node(point.edge) + point.part * of_node(point.edge + 1);
}

inline void WallContact::Motion::scatter(const Point& point, const Vec3& force,
                                         Eigen::VectorXd& target) const {
  const auto add_to = [&](int i, double weight) {
    if (weight == 0.0 || i < first || i >= last) return;
    target.segment<3>(stride * (i - first)) += weight * force;
  };
  add_to(point.edge, 1.0 - point.part);
  add_to(point.edge + 1, point.part);
}

template <class Sink>
void WallContact::add(Sink& sink) {
  // A point stands for up to two nodes, a pair of points for up to four pairs of nodes.
  const auto point_of = [&](const Active& active) -> const Point& {
    return points_[static_cast<std::size_t>(active.point)];
  };
  const auto for_each_node = [](const Point& point, const auto& visit) {
    if (point.part < 1.0) visit(point.edge, 1.0 - point.part);
    if (point.part > 0.0) visit(point.edge + 1, point.part);
  };
  const auto add_own = [&](const Point& point, const Vec3& g, const Mat3& H) {
    for_each_node(point, [&](int i, double w_i) {
      sink.gradient(i, w_i * g);
      if constexpr (Sink::kHessian) {
        for_each_node(point, [&](int j, double w_j) {
          if (j <= i) sink.hessian(i, j, (w_i * w_j) * H);
        });
      }
    });
  };

  // Normal forces: each by itself, and through the wall with its neighbours.
  const bool coupled = Sink::kHessian && yielding_;
  if constexpr (Sink::kHessian) find_stiffness();
  for (std::size_t k = 0; k < active_.size(); ++k) {
    const Active& active = active_[k];
    const Vec3& n = active.wall.gradient;
    const int row = static_cast<int>(k);
    const double stiffness =
        coupled ? coupling_.stiffness(row, row) + folded_[row] : active.stiffness;
    const double expected = expected_[active.point];
    add_own(point_of(active), -active.force * n,
            stiffness * n * n.transpose() -
                (expected >= 0.0 ? expected : active.force) * active.wall.hessian);
    if constexpr (Sink::kHessian) {
      for (int j = coupled ? coupling_.first_coupled(row) : row; j < row; ++j) {
        const Active& other = active_[static_cast<std::size_t>(j)];
        if (!in_band(active, other)) continue;
        const Vec3 m = coupling_.stiffness(row, j) * other.wall.gradient;
        const Mat3 H = n * m.transpose(), H_transposed = m * n.transpose();
        for_each_node(point_of(active), [&](int p, double w_p) {
          for_each_node(point_of(other), [&](int q, double w_q) {
            if (p == q) {
              sink.hessian(p, q, (w_p * w_q) * (H + H_transposed));
            } else {
              sink.hessian(std::max(p, q), std::min(p, q),
                           (w_p * w_q) * (p > q ? H : H_transposed));
            }
          });
        });
      }
    }
  }

  // Friction, with the normal force and normal of the lag.
  for (const int k : lag_.points) {
    const Rubbing rubbing = rubbing_at(k);
    if (rubbing.length == 0.0) {  // at its anchor: as stiff to all sides
      const Vec3 normal = lag_.normal.col(k);
      add_own(
          points_[static_cast<std::size_t>(k)], Vec3::Zero(),
          (rubbing.limit * rubbing.curvature) * (Mat3::Identity() - normal * normal.transpose()));
      continue;
    }
    const Vec3 normal = lag_.normal.col(k), &t = rubbing.toward;
    const double across = rubbing.slope / rubbing.length;
    const Mat3 along = t * t.transpose(), off = normal * normal.transpose();
    add_own(
        points_[static_cast<std::size_t>(k)], (rubbing.limit * rubbing.slope) * t,
        rubbing.limit * (rubbing.curvature * along + across * (Mat3::Identity() - along - off)));
  }
}

}  // namespace wireplan::simulate
