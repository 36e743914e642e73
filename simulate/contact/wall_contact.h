#pragma once
/// The wire against the wall of the vessel: where it touches, with which normal and friction
/// forces, and how the wall gives way. Part of the energy that solver.h minimises.
#include <algorithm>
#include <cmath>
#include <vector>

#include "simulate/contact/contact_law.h"
#include "simulate/contact/yielding.h"
#include "simulate/wall/vessel_model.h"
#include "simulate/wire/block_band.h"
#include "simulate/wire/rod.h"

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
    Eigen::Matrix3Xd x;                  // (3, n) the wire's nodes in that equilibrium         [mm]
    Eigen::VectorXd normal_force;        // (m); 0: nothing holds the point                     [N]
    Eigen::Matrix3Xd anchor;             // (3, m) where friction holds those that have one     [mm]
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
    find_rubbing();
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
    double longest() const;  // of a node                                                  [mm]
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
  /// On a wall that does not yield that is friction's dependence on normal forces alone, and lies
  /// within the band: adds it to an unsymmetric one, of the nodes from `first` on.
  void add_remainder(int first, UnsymmetricBand& band);
  bool remainder_is_banded() const { return !yielding_ && options_.friction > 0.0; }
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
  static Vec3 position_of(const Point& point, const Eigen::Matrix3Xd& x);
  Vec3 position_of(Eigen::Index k) const {
    return position_of(points_[static_cast<std::size_t>(k)], x_);
  }
  Vec3 anchor_of(Eigen::Index k) const;
  double reach() const;  // of contact, from the wire's axis                              [mm]
  void find_active(const Eigen::Matrix3Xd& x);
  WallSample look_at(std::size_t k, const Vec3& position, double near);
  double least_distance(Eigen::Index k, const Vec3& position) const;
  void find_forces();
  void find_rubbing();
  ContactEnergy lagged_energy();
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
  std::vector<Point> points_;   // proximal to distal
  std::size_t first_free_ = 0;  // those before do not touch
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

  // The nodes in the state sampled last, and how far any of them went at most, from sampling to
  // sampling. Until that comes to a point's `asleep_until_`, the point is too far from the wall to
  // matter. Per point also: where the wall was looked at last, and how far it was there.
  Eigen::Matrix3Xd x_;               // (3, n)                                              [mm]
  double travelled_ = 0.0;           // [mm]
  Eigen::VectorXd asleep_until_;     // [mm]
  Eigen::Matrix3Xd known_position_;  // [mm]
  Eigen::VectorXd known_distance_;   // [mm]
  std::vector<WallSample> known_;    // there, of the points that touched
  std::vector<char> touched_;        // when the wall was last looked at
  std::vector<Rubbing> rubbing_;     // of the points in lag_.points, in the state sampled last

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

inline double WallContact::Motion::longest() const {
  double longest = 0.0;
  for (int i = first; i < last; ++i) longest = std::max(longest, of_node(i).squaredNorm());
  return std::sqrt(longest);
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
  // A point stands for up to two nodes, a pair of points for up to four pairs of nodes. Matrices
  // are written entry by entry: as Eigen's outer products they are function calls.
  const auto point_of = [&](int k) -> const Point& { return points_[static_cast<std::size_t>(k)]; };
  const auto for_each_node = [](const Point& point, const auto& visit) {
    if (point.part < 1.0) visit(point.edge, 1.0 - point.part);
    if (point.part > 0.0) visit(point.edge + 1, point.part);
  };
  const auto add_gradient = [&](const Point& point, const Vec3& g) {
    for_each_node(point, [&](int i, double w) { sink.gradient(i, w * g); });
  };
  const auto add_hessian = [&](const Point& point, const auto& entry) {
    Mat3 H;
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) H(r, c) = entry(r, c);
    }
    for_each_node(point, [&](int i, double w_i) {
      for_each_node(point, [&](int j, double w_j) {
        if constexpr (Sink::kHessian) {
          if (j <= i) sink.hessian_scaled(i, j, w_i * w_j, H);
        }
      });
    });
  };

  // Normal forces: each by itself, and through the wall with its neighbours.
  if constexpr (Sink::kHessian) find_stiffness();
  for (int k = 0; k < static_cast<int>(active_.size()); ++k) {
    const Active& active = active_[static_cast<std::size_t>(k)];
    const Point& point = point_of(active.point);
    const Vec3& n = active.wall.gradient;
    add_gradient(point, -active.force * n);
    if constexpr (Sink::kHessian) {
      const double stiffness =
          yielding_ ? coupling_.stiffness(k, k) + folded_[k] : active.stiffness;
      const double expected = expected_[active.point];
      const double force = expected >= 0.0 ? expected : active.force;
      add_hessian(point, [&](int r, int c) {
        return stiffness * n[r] * n[c] - force * active.wall.hessian(r, c);
      });
      for (int j = yielding_ ? coupling_.first_coupled(k) : k; j < k; ++j) {
        const Active& other = active_[static_cast<std::size_t>(j)];
        if (!in_band(active, other)) continue;
        const Vec3 m = coupling_.stiffness(k, j) * other.wall.gradient;
        const Mat3 H = n * m.transpose(), H_transposed = m * n.transpose();
        for_each_node(point, [&](int p, double w_p) {
          for_each_node(point_of(other.point), [&](int q, double w_q) {
            if (p == q) {
              sink.hessian_scaled(p, q, w_p * w_q, H + H_transposed);
            } else {
              sink.hessian_scaled(std::max(p, q), std::min(p, q), w_p * w_q,
                                  p > q ? H : H_transposed);
            }
          });
        });
      }
    }
  }

  // Friction, with the normal force and normal of the lag.
  for (const int k : lag_.points) {
    const Rubbing& rubbing = rubbing_[static_cast<std::size_t>(k)];
    const Vec3& t = rubbing.toward;  // 0 at the anchor, where friction is as stiff to all sides
    add_gradient(point_of(k), (rubbing.limit * rubbing.slope) * t);
    if constexpr (Sink::kHessian) {
      const Vec3 normal = lag_.normal.col(k);
      const double across =
          rubbing.length > 0.0 ? rubbing.slope / rubbing.length : rubbing.curvature;
      add_hessian(point_of(k), [&](int r, int c) {
        const double along = t[r] * t[c], off = normal[r] * normal[c], own = r == c ? 1.0 : 0.0;
        return rubbing.limit * (rubbing.curvature * along + across * (own - along - off));
      });
    }
  }
}

}  // namespace wireplan::simulate
