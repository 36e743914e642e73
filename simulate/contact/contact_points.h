#pragma once
/// The points at which a wire may touch the wall: where they are, which of them are near it, and
/// how far they may go.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "simulate/contact/contact_sample.h"
#include "simulate/wall/lumen.h"
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
/// node's; nodes from `first` to before `last`, the others are at rest.
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
  double longest() const;  // of a node                                                    [mm]
  /// Adds a force at a point to its nodes, in the same layout.
  void scatter(const ContactPoint& point, const Vec3& force, Eigen::VectorXd& target) const;
};

/// Points lie on the nodes and evenly between them, so that long elements feel a short ridge. They
/// follow the wire from state to state: one that is far from the wall sleeps until it may have come
/// near, and one that hardly moved knows the wall where it is.
class ContactPoints {
 public:
  /// At most `spacing` apart, half of it near the tip; contact reaches to `reach` from the wire's
  /// axis [mm]. Keeps a reference to the lumen.
  ContactPoints(const Rod& rod, const Lumen& lumen, double spacing, double reach);

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
  void find_active(const Eigen::Matrix3Xd& x, const Eigen::VectorXd& expected,
                   ContactSample& sample);

  /// The state in which they were looked for last.
  const Eigen::Matrix3Xd& nodes() const { return x_; }
  Vec3 position(int k) const { return (*this)[k].at(x_); }
  /// By how much the wire is thinner there than its radius: distances from the wall, as samples
  /// have them, are by so much larger [mm].
  double thinner(int k) const { return thinner_.size() > 0 ? thinner_[k] : 0.0; }

  /// Largest part of a motion from that state that takes no point across the wall, see WallContact.
  double largest_safe_part(const WireMotion& motion, int looks) const;

 private:
  WallSample look_at(int k, const Vec3& position, double near);
  double least_distance(int k, const Vec3& position) const;
  double way_inside(int k, const Vec3& from, const Vec3& toward, double length, double distance,
                    int looks) const;

  const Lumen& lumen_;
  double reach_;
  std::vector<ContactPoint> points_;  // proximal to distal
  Eigen::VectorXd thinner_;           // per point, see Rod; distances from the wall have it in them
  int first_free_ = 0;

  // How far any node went at most, from state to state. Until that comes to a point's
  // `asleep_until_`, the point is too far from the wall to matter.
  Eigen::Matrix3Xd x_;            // (3, n)                                                 [mm]
  double travelled_ = 0.0;        // [mm]
  Eigen::VectorXd asleep_until_;  // [mm]

  // Per point: where the wall was looked at last, and how far it was there.
  Eigen::Matrix3Xd known_position_;  // [mm]
  Eigen::VectorXd known_distance_;   // [mm]
  std::vector<WallSample> known_;    // there, of the points that touched
  std::vector<char> touched_;        // when the wall was last looked at
};

// ---------------------------------------------------------------- into a sink of elements.h

/// Calls visit(node, weight) for the nodes that a point lies between.
template <class Visit>
void for_each_node(const ContactPoint& point, const Visit& visit) {
  if (point.part < 1.0) visit(point.edge, 1.0 - point.part);
  if (point.part > 0.0) visit(point.edge + 1, point.part);
}

/// Adds the gradient over a point's position.
template <class Sink>
void add_gradient(Sink& sink, const ContactPoint& point, const Vec3& g) {
  for_each_node(point, [&](int i, double w) { sink.gradient(i, w * g); });
}

/// And the Hessian, of entries entry(r, c): as Eigen's outer products they are function calls.
template <class Sink, class Entry>
void add_hessian(Sink& sink, const ContactPoint& point, const Entry& entry) {
  Mat3 H;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) H(r, c) = entry(r, c);
  }
  for_each_node(point, [&](int i, double w_i) {
    for_each_node(point, [&](int j, double w_j) {
      if (j <= i) sink.hessian_scaled(i, j, w_i * w_j, H);
    });
  });
}

/// And the block between two points, n over p by m over q.
template <class Sink>
void add_hessian_between(Sink& sink, const ContactPoint& p, const Vec3& n, const ContactPoint& q,
                         const Vec3& m) {
  const Mat3 H = n * m.transpose(), H_transposed = m * n.transpose();
  for_each_node(p, [&](int i, double w_i) {
    for_each_node(q, [&](int j, double w_j) {
      if (i == j) {
        sink.hessian_scaled(i, j, w_i * w_j, H + H_transposed);
      } else {
        sink.hessian_scaled(std::max(i, j), std::min(i, j), w_i * w_j, i > j ? H : H_transposed);
      }
    });
  });
}

}  // namespace wireplan::simulate
