#pragma once
/// The points at which a wire may touch the wall: where they are, which of them are near it, and
/// how far they may go.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "simulate/contact/contact_sample.h"
#include "simulate/contact/moving_frame.h"
#include "simulate/wall/lumen.h"
#include "simulate/wall/vessel_model.h"
#include "simulate/wire/rod.h"

namespace wireplan::simulate {

struct ContactPoint {
  int edge;                    // between nodes edge and edge + 1 ...
  double part;                 // ... at this part of it, 0 to 1
  double share, tip_distance;  // share: length of wire that it stands for                 [mm]

  Vec3 at(const Eigen::Matrix3Xd& x) const {
    if (part == 0.0) return x.col(edge);
    return (1.0 - part) * x.col(edge) + part * x.col(edge + 1);
  }
};

/// Whether a block-banded Hessian has a place for what couples the two: their nodes are no more
/// than two apart.
bool in_band(const ContactPoint& p, const ContactPoint& q);

/// Values at nodes, at a point.
inline double at_point(const Eigen::VectorXd& nodes, const ContactPoint& point) {
  const double here = nodes[point.edge];
  return point.part > 0.0 ? here + point.part * (nodes[point.edge + 1] - here) : here;
}

/// A motion of the wire, node by node with `stride` numbers each, of which the first three are the
/// node's; nodes from `first` to before `last`, the others are at rest. Where cross-sections move,
/// theirs follow, three numbers each.
struct WireMotion {
  int first, last, stride;
  const Eigen::VectorXd& values;

  Vec3 of_node(int i) const {
    if (i < first || i >= last) return Vec3::Zero();
    return values.segment<3>(stride * (i - first));
  }
  Vec3 of(const ContactPoint& point) const {
    if (point.part == 0.0) return of_node(point.edge);
    return (1.0 - point.part) * of_node(point.edge) + point.part * of_node(point.edge + 1);
  }
  bool has_sections() const { return values.size() > sections_from(); }
  Eigen::Index sections_from() const { return stride * (last - first); }
  Vec3 of_section(int j) const { return values.segment<3>(sections_from() + 3 * j); }
  double longest() const;  // of a node, and a section's with it                           [mm]
  /// Adds a force at a point to its nodes, in the same layout.
  void scatter(const ContactPoint& point, const Vec3& force, Eigen::VectorXd& target) const;
};

/// Points lie on the nodes and evenly between them, so that long elements feel a short ridge. They
/// follow the wire from state to state: one that is far from the wall sleeps until it may have come
/// near, and one that hardly moved knows the wall where it is.
///
/// Where the vessel's cross-sections move, a point's `position` is its place in the vessel at rest
/// (moving_frame.h), of which all else is a function; what is added to a sink or a vector goes to
/// the sections too.
class ContactPoints {
 public:
  /// At most `spacing` apart, half of it near the tip; contact reaches to `reach` from the wire's
  /// axis [mm]. Keeps a reference to the vessel.
  ContactPoints(const Rod& rod, const VesselModel& vessel, double spacing, double reach);

  /// The wire is this rod from now on, with as many nodes and points at the same places of edges.
  void take(const Rod& rod);
  /// What was looked up; samples are then as of new points.
  void forget();

  int size() const { return static_cast<int>(points_.size()); }
  const ContactPoint& operator[](int k) const { return points_[static_cast<std::size_t>(k)]; }
  /// The first that may touch; see free_from().
  int first_free() const { return first_free_; }

  /// Only points nearer to the tip than this touch [mm]. At the start: all.
  void free_from(double tip_distance);
  /// Carries what each point has, `from`, to where the wire will be after a push by `distance`:
  /// shared by the two points around each place, so that the sum stays; the tip's stays with the
  /// tip. Those that get something are awake.
  void carry_back(const Eigen::VectorXd& from, double distance, Eigen::VectorXd& to);

  /// Finds the points near the wall in the state x, and whether one is lost. Where a point is
  /// `expected` to have a force, it stays in sight further off. Forces are left to be found.
  void find_active(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& sections,
                   const Eigen::VectorXd& expected, ContactSample& sample);

  /// The state in which they were looked for last.
  const Eigen::Matrix3Xd& nodes() const { return x_; }
  const Eigen::Matrix3Xd& sections() const { return u_; }
  Vec3 position(int k) const { return chain_ == nullptr ? (*this)[k].at(x_) : frame(k).rest(); }
  /// The same in the equilibrium before, which is kept until that is another one.
  Vec3 position_before(int k, const ContactMemory& memory) const;
  void forget_before() { ++before_; }
  /// On the wire.
  Vec3 place(int k) const { return (*this)[k].at(x_); }
  /// A force over a point's position, on the wire.
  Vec3 on_wire(int k, const Vec3& force) const {
    return chain_ == nullptr ? force : Vec3(frame(k).inverse().transpose() * force);
  }
  const SectionChain* chain() const { return chain_; }
  /// Of a point's position, in a motion of wire and sections.
  Vec3 motion_of(int k, const WireMotion& motion) const;
  /// Adds a force over a point's position to its nodes and sections, in the motion's layout.
  void scatter(int k, const WireMotion& motion, const Vec3& force, Eigen::VectorXd& target) const;

  // ---- into a sink of elements.h; all of the state in which they were looked for last. Where
  // sections move, what is added is gathered by points, until finish() takes it to them.

  /// Adds the gradient over a point's position.
  template <class Sink>
  void add_gradient(Sink& sink, int k, const Vec3& g) const;
  /// And the Hessian, of entries entry(r, c), for a function whose gradient is `g`.
  template <class Sink, class Entry>
  void add_hessian(Sink& sink, int k, const Vec3& g, const Entry& entry) const;
  /// And the block between two points, n over k by m over j times a stiffness. A point's own is the
  /// same in all.
  template <class Sink>
  void add_hessian_between(Sink& sink, int k, const Vec3& n, int j, const Vec3& m,
                           double stiffness) const;
  template <class Sink>
  void finish(Sink& sink) const;
  /// By how much the wire is thinner there than its radius: distances from the wall, as samples
  /// have them, are by so much larger [mm].
  double thinner(int k) const { return thinner_.size() > 0 ? thinner_[k] : 0.0; }

  /// Largest part of a motion from that state that takes no point across the wall, see WallContact.
  double largest_safe_part(const WireMotion& motion, int looks) const;

 private:
  /// A section that moves a point's neighbours: how the force along the point's normal changes.
  struct Coupled {
    int section;
    Vec3 change;
  };
  /// What was added at a point, over its position, but `normal` and `coupled` on the wire.
  struct Gathered {
    bool any = false, has_hessian = false;
    Vec3 force;    // gradient                                                              [N]
    Vec3 bending;  // and that of the function that H is of                                 [N]
    Mat3 H;        //                                                                    [N/mm]
    Vec3 normal;
    std::vector<Coupled> coupled = {};
  };
  Gathered& gathered(int k) const;
  void gather_hessian(int k, const Vec3& g, const Mat3& H) const;
  void gather_between(int k, const Vec3& n, int j, const Vec3& m, double stiffness) const;
  template <class Sink>
  void finish_hessian(Sink& sink, int k, Gathered& point) const;

  const MovingFrame& frame(int k) const;
  void carry_knowledge(double distance);
  bool is_away(int k, double near);
  WallSample look_at(int k, const Vec3& position, double near);
  double least_distance(int k, const Vec3& position) const;
  double way_inside(int k, const Vec3& from, const Vec3& toward, double length, double distance,
                    int looks) const;

  const Lumen& lumen_;
  const SectionChain* const chain_;
  double spacing_, reach_;
  std::vector<ContactPoint> points_;  // proximal to distal
  Eigen::VectorXd thinner_;           // per point, see Rod; distances from the wall have it in them
  int first_free_ = 0;

  // How far any node went at most, from state to state. Until that comes to a point's
  // `asleep_until_`, the point is too far from the wall to matter.
  Eigen::Matrix3Xd x_;            // (3, n)                                                 [mm]
  Eigen::Matrix3Xd u_;            // of the sections                                        [mm]
  double travelled_ = 0.0;        // [mm]
  Eigen::VectorXd asleep_until_;  // [mm]

  // Per point: where the wall was looked at last, and how far it was there.
  Eigen::Matrix3Xd known_position_;  // [mm]
  Eigen::VectorXd known_distance_;   // [mm]
  std::vector<WallSample> known_;    // there, of the points that touched
  std::vector<char> touched_;        // when the wall was last looked at

  // Where cross-sections move: per point, and of which state; found when asked for.
  mutable std::vector<MovingFrame> frames_;
  mutable std::vector<long long> framed_in_;
  long long state_ = 0;
  mutable Eigen::Matrix3Xd position_before_;  // and of which equilibrium
  mutable std::vector<long long> before_in_;
  long long before_ = 0;
  mutable std::vector<Gathered> gathered_;
  mutable std::vector<int> gathered_points_;
  mutable std::vector<Vec3> turned_slopes_;  // scratch
};

// ---------------------------------------------------------------- into a sink of elements.h

/// Calls visit(node, weight) for the nodes that a point lies between.
template <class Visit>
void for_each_node(const ContactPoint& point, const Visit& visit) {
  if (point.part < 1.0) visit(point.edge, 1.0 - point.part);
  if (point.part > 0.0) visit(point.edge + 1, point.part);
}

template <class Sink>
void ContactPoints::add_gradient(Sink& sink, int k, const Vec3& g) const {
  if (chain_ != nullptr) {
    gathered(k).force += g;
    return;
  }
  for_each_node((*this)[k], [&](int i, double w) { sink.gradient(i, w * g); });
}

// Entry by entry: as Eigen's outer products they are function calls.
template <class Sink, class Entry>
void ContactPoints::add_hessian(Sink& sink, int k, const Vec3& g, const Entry& entry) const {
  Mat3 H;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) H(r, c) = entry(r, c);
  }
  if (chain_ != nullptr) return gather_hessian(k, g, H);
  const ContactPoint& point = (*this)[k];
  for_each_node(point, [&](int i, double w_i) {
    for_each_node(point, [&](int j, double w_j) {
      if (j <= i) sink.hessian_scaled(i, j, w_i * w_j, H);
    });
  });
}

template <class Sink>
void ContactPoints::add_hessian_between(Sink& sink, int k, const Vec3& n_rest, int j,
                                        const Vec3& m_rest, double stiffness) const {
  const ContactPoint &p = (*this)[k], &q = (*this)[j];
  const Vec3 n = on_wire(k, n_rest), m = on_wire(j, m_rest), pressed = stiffness * m;
  const Mat3 H = n * pressed.transpose(), H_transposed = pressed * n.transpose();
  for_each_node(p, [&](int i, double w_i) {
    for_each_node(q, [&](int l, double w_l) {
      if (i == l) {
        sink.hessian_scaled(i, l, w_i * w_l, H + H_transposed);
      } else {
        sink.hessian_scaled(std::max(i, l), std::min(i, l), w_i * w_l, i > l ? H : H_transposed);
      }
    });
  });
  if (chain_ != nullptr) gather_between(k, n, j, m, stiffness);
}

template <class Sink>
void ContactPoints::finish(Sink& sink) const {
  for (const int k : gathered_points_) {
    Gathered& point = gathered_[static_cast<std::size_t>(k)];
    point.any = false;
    const Vec3 force = on_wire(k, point.force);
    for_each_node((*this)[k], [&](int i, double w) { sink.gradient(i, w * force); });
    for (const SectionChain::Weight& weight : frame(k).weights()) {
      sink.section_gradient(weight.node, -weight.value * force);
    }
    if constexpr (Sink::kHessian) finish_hessian(sink, k, point);
  }
  gathered_points_.clear();
}

/// With N of the sections that move the point and r of their slopes turned (MovingFrame), f the
/// force on the wire: wire by section H N + r f', section by section N H N + N f r' + r f' N; and
/// the normal times what each section changes through the wall.
template <class Sink>
void ContactPoints::finish_hessian(Sink& sink, int k, Gathered& point) const {
  const MovingFrame& moved = frame(k);
  const std::vector<SectionChain::Weight>& weights = moved.weights();
  const Vec3 f = moved.inverse().transpose() * point.bending;
  Mat3 B;
  moved.find_bend(u_, f, B, turned_slopes_);
  const Mat3 H = moved.inverse().transpose() * (point.H - B) * moved.inverse();
  for_each_node((*this)[k], [&](int i, double w_i) {
    for_each_node((*this)[k], [&](int j, double w_j) {
      if (j <= i) sink.hessian_scaled(i, j, w_i * w_j, H);
    });
  });
  const auto add = [&](int section, const Mat3& change) {
    for_each_node((*this)[k], [&](int i, double w) { sink.section_cross(i, section, -w, change); });
    for (const SectionChain::Weight& weight : weights) {
      if (weight.node >= section) {
        sink.section_hessian(weight.node, section, weight.value, change);
      }
    }
  };
  for (std::size_t b = 0; b < weights.size(); ++b) {
    Mat3 change = weights[b].value * H;
    for (int c = 0; c < 3; ++c) change.col(c) += f[c] * turned_slopes_[b];
    for (Coupled& coupled : point.coupled) {
      if (coupled.section != weights[b].node) continue;
      for (int c = 0; c < 3; ++c) change.col(c) += coupled.change[c] * point.normal;
      coupled.section = -1;
    }
    add(weights[b].node, change);
    for (std::size_t a = 0; a < weights.size(); ++a) {
      if (weights[b].node < weights[a].node) continue;
      Mat3 back;
      for (int c = 0; c < 3; ++c) back.col(c) = turned_slopes_[b][c] * f;
      sink.section_hessian(weights[b].node, weights[a].node, weights[a].value, back);
    }
  }
  for (const Coupled& coupled : point.coupled) {
    if (coupled.section < 0) continue;
    Mat3 change;
    for (int c = 0; c < 3; ++c) change.col(c) = coupled.change[c] * point.normal;
    add(coupled.section, change);
  }
}

}  // namespace wireplan::simulate
