// Shapes of the tools that solves of ToolBench start from, and their angles.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "simulate/insertion/tool_bench.h"
#include "simulate/wire/bend_to.h"

namespace wireplan::simulate {
namespace {

/// Of the tip of each tool but the first curved one, in a guess; chosen [rad].
constexpr double kNudge = 1e-3;

/// A list of values at the middles of edges of length h, at s; beyond the ends that of the ends.
template <class At>
auto between_middles(double s, double h, Eigen::Index edges, const At& at) {
  const double place = std::clamp(s / h - 0.5, 0.0, static_cast<double>(edges - 1));
  const Eigen::Index e = std::min(static_cast<Eigen::Index>(place), edges - 2);
  const double part = place - static_cast<double>(e);
  using Value = std::decay_t<decltype(at(e))>;
  return Value((1.0 - part) * at(e) + part * at(e + 1));
}

/// A column of values between whole ones; beyond the ends that of the ends.
template <class Values>
auto between_columns(const Values& values, double place) {
  const Eigen::Index last = values.cols() - 1;
  const double at = std::clamp(place, 0.0, static_cast<double>(last));
  const Eigen::Index i =
      std::min(static_cast<Eigen::Index>(at), std::max<Eigen::Index>(last - 1, 0));
  const double part = at - static_cast<double>(i);
  return ((1.0 - part) * values.col(i) + part * values.col(std::min(i + 1, last))).eval();
}

/// Where on the centreline of before the place was that has the same tips about it, in nodes: what
/// tools do where they end or are curved goes along with their tips.
class AlongTips {
 public:
  AlongTips(std::span<const ToolPlace> before, double h_before, std::span<const ToolPlace> after,
            double h_after)
      : count_(before.size()) {
    before_.fill(std::numeric_limits<double>::infinity());
    after_ = before_;
    for (std::size_t i = 0; i < count_; ++i) {
      before_.at(i) = before[i].insertion / h_before;
      after_.at(i) = after[i].insertion / h_after;
    }
    std::sort(before_.begin(), before_.end());
    std::sort(after_.begin(), after_.end());
  }

  double before(double node) const {
    std::size_t k = 0;  // the first tip at it or ahead of it
    while (k + 1 < count_ && node > after_[k]) ++k;
    const bool level = k > 0 && node >= after_[k];  // past all tips, by rounding
    if (k == 0 || level) return node - (after_[k] - before_[k]);
    const double part = (node - after_[k - 1]) / (after_[k] - after_[k - 1]);
    return before_[k - 1] + part * (before_[k] - before_[k - 1]);
  }

 private:
  std::size_t count_;
  std::array<double, kMostTools> before_, after_;  // of the tips, from the hindmost on
};

/// Straight tools whose end comes nearer to its start get the shape of a column that buckles;
/// unlike buckle_column() they bend the more, the softer they are.
void lean_aside(const Rod& rod, const Vec3& point, const std::optional<Vec3>& plane,
                BentWire& wire) {
  constexpr double kStraight = 1e-6;  // of the length
  const double length = rod.rest_length.sum();
  const Vec3 along = wire.edges.col(0).normalized();
  const double less = (wire.end() - point).dot(along);
  if (length - (wire.end() - wire.start).norm() > kStraight * length ||
      less <= kStraight * length) {
    return;
  }
  const Vec3 axis = plane ? *plane : along.cross(reference_normal(along));
  const auto compliance = [&](int i) { return rod.bend[i] > 0.0 ? 1.0 / rod.bend[i] : 0.0; };
  double total = 0.0, so_far = 0.0;
  for (int i = 0; i < rod.nodes(); ++i) total += compliance(i);
  const double most = 2.0 * std::sqrt(less / length);
  for (int i = 0; i + 1 < rod.nodes(); ++i) {
    so_far += compliance(i);
    wire.edges.col(i) =
        (rotation_by(most * std::sin(2.0 * kPi * so_far / total) * axis) * wire.edges.col(i))
            .eval();
  }
}

}  // namespace

/// As the tools lie together without loads, each in one plane with its hub.
RodState ToolBench::unloaded(const State& at) const {
  const Rod& rod = at.composite.rod;
  const ToolTerms& terms = at.composite.terms;
  RodState state = straight_state(rod, scene_.point, scene_.direction, 0.0);
  if (chain() != nullptr) state.sections.setZero(3, chain()->nodes());
  Vec3 t = scene_.direction, d = reference_normal(t);
  for (int i = 0; i + 1 < rod.nodes(); ++i) {
    Vec3 turn = Vec3::Zero();
    for (int k = 0; k < terms.twists(); ++k) {
      const Vec3 toward = std::cos(terms.roll[k]) * d + std::sin(terms.roll[k]) * t.cross(d);
      turn += terms.rest(k, i) * t.cross(toward);
    }
    const Mat3 rotation = rotation_by(turn);  // about an axis square to t: no twist
    t = rotation * t;
    d = rotation * d;
    state.x.col(i + 1) = state.x.col(i) + rod.rest_length[i] * t;
  }
  bend_to_support(at, state.x);
  Eigen::MatrixXd angles(rod.nodes() - 1, terms.twists());
  for (int k = 0; k < terms.twists(); ++k) angles.col(k).setConstant(terms.roll[k]);
  set_frames(angles, state);
  return state;
}

ToolBench::Shape ToolBench::shape() const {
  const std::vector<int>& twisted = now_.composite.terms.tool;
  Shape shape{now_.state.x, Eigen::MatrixXd(now_.state.x.cols() - 1, twisted.size())};
  for (std::size_t k = 0; k < twisted.size(); ++k) {
    shape.angles.col(static_cast<Eigen::Index>(k)) = angles(twisted[k]);
  }
  return shape;
}

/// The centreline of now, as much longer or shorter as it is to be, and the tools' angles on it.
ToolBench::Shape ToolBench::follow(const State& to) const {
  const double h = now_.composite.edge_length(), h_new = to.composite.edge_length();
  const Eigen::Index before = now_.state.x.cols() - 1, edges = to.composite.rod.nodes() - 1;
  const bool divided_anew = h != h_new || before != edges;
  const Shape from = shape();
  Shape next{from.x, Eigen::MatrixXd(edges, from.angles.cols())};
  if (divided_anew) next.x.resize(3, edges + 1);
  next.x.col(0) = from.x.col(0);
  for (Eigen::Index e = 0; e < edges; ++e) {
    const double middle = (static_cast<double>(e) + 0.5) * h_new;
    if (divided_anew) {
      const Vec3 t = between_middles(middle, h, before,
                                     [&](Eigen::Index k) { return edge_tangent(now_.state, k); });
      next.x.col(e + 1) = next.x.col(e) + h_new * t.normalized();
    }
    for (Eigen::Index k = 0; k < from.angles.cols(); ++k) {
      // Tools that lie in one plane, curved to opposite sides, would stay so when that is a saddle.
      next.angles(e, k) =
          between_middles(middle, h, before, [&](Eigen::Index i) { return from.angles(i, k); }) +
          kNudge * static_cast<double>(k * e) / static_cast<double>(edges);
    }
  }
  if (divided_anew) bend_to_support(to, next.x);
  return next;
}

/// The shape that was followed, and what the tools came off such shapes before, `drift` per part,
/// about the same tips; its end where it is held.
RodState ToolBench::guess(const State& to, const Shape& followed, const Shape& drift,
                          double part) const {
  RodState state;
  state.x = followed.x;
  state.sections = now_.state.sections;
  Eigen::MatrixXd turned = followed.angles;
  if (drift.x.cols() > 0) {
    const AlongTips tips(now_.places, now_.composite.edge_length(), to.places,
                         to.composite.edge_length());
    Eigen::Matrix3Xd x = followed.x;
    for (Eigen::Index i = 1; i < x.cols(); ++i) {
      x.col(i) += part * between_columns(drift.x, tips.before(static_cast<double>(i)));
    }
    for (Eigen::Index e = 0; e + 1 < x.cols(); ++e) {  // no edge gets longer by that
      const Vec3 edge = x.col(e + 1) - x.col(e);
      const double length = (followed.x.col(e + 1) - followed.x.col(e)).norm();
      state.x.col(e + 1) = state.x.col(e) + (length / edge.norm()) * edge;
    }
    bend_to_support(to, state.x);
    for (Eigen::Index e = 0; e < turned.rows(); ++e) {
      const double middle = tips.before(static_cast<double>(e) + 0.5) - 0.5;
      turned.row(e) += part * between_columns(drift.angles.transpose(), middle).transpose();
    }
  }
  set_frames(turned, state);
  return state;
}

void ToolBench::bend_to_support(const State& to, Eigen::Matrix3Xd& x) const {
  if (!scene_.distal) return;
  const Rod& rod = to.composite.rod;
  const Eigen::Index edges = x.cols() - 1;
  const bool clamped = scene_.distal->kind == SupportKind::kClamped;
  BentWire wire{.start = x.col(0), .edges = x.rightCols(edges) - x.leftCols(edges)};
  wire.end_direction = wire.edges.col(edges - 1).normalized();
  lean_aside(rod, scene_.distal->point, scene_.plane, wire);
  bend_to(rod, {.start = true, .end = clamped}, scene_.distal->point, scene_.distal->direction,
          wire);
  for (Eigen::Index e = 0; e < edges; ++e) x.col(e + 1) = x.col(e) + wire.edges.col(e);
  // What that left is spread evenly.
  const Vec3 gap = scene_.distal->point - x.col(edges);
  for (Eigen::Index i = 1; i <= edges; ++i) {
    x.col(i) += (static_cast<double>(i) / static_cast<double>(edges)) * gap;
  }
}

/// Reference directors carried along from the introducer without twist, and the tools' angles.
void ToolBench::set_frames(const Eigen::MatrixXd& angles, RodState& state) const {
  const Eigen::Index edges = state.x.cols() - 1;
  state.director.resize(3, edges);
  state.reference_twist = Eigen::VectorXd::Zero(edges + 1);
  Vec3 t = scene_.direction, d = reference_normal(t);
  for (Eigen::Index e = 0; e < edges; ++e) {
    const Vec3 next = edge_tangent(state, e);
    d = parallel_transport(d, t, next);
    d = (d - d.dot(next) * next).normalized();
    state.director.col(e) = d;
    t = next;
  }
  state.theta = angles.reshaped();
}

Vec3 ToolBench::edge_tangent(const RodState& state, Eigen::Index e) {
  return (state.x.col(e + 1) - state.x.col(e)).normalized();
}

Eigen::VectorXd ToolBench::angles(int tool) const {
  const std::vector<int>& twisted = now_.composite.terms.tool;
  const auto found = std::find(twisted.begin(), twisted.end(), tool);
  if (found == twisted.end()) return {};
  const RodState& state = now_.state;
  const Eigen::Index edges = state.x.cols() - 1;
  const Vec3 t = edge_tangent(state, 0);
  const Vec3 zero = parallel_transport(reference_normal(scene_.direction), scene_.direction, t);
  const Vec3 d = state.director.col(0);
  double turned = std::atan2(zero.cross(d).dot(t), zero.dot(d));
  Eigen::VectorXd result = state.theta.segment((found - twisted.begin()) * edges, edges);
  for (Eigen::Index e = 0; e < edges; ++e) {
    if (e > 0) turned += state.reference_twist[e];
    result[e] += turned;
  }
  return result;
}

/// Of its tip against its hub; 0 of a straight tool [rad].
double ToolBench::twist_of(int tool) const {
  const Eigen::VectorXd angle = angles(tool);
  if (angle.size() == 0) return 0.0;
  const ToolPlace& place = now_.places[static_cast<std::size_t>(tool)];
  return between_middles(place.insertion, now_.composite.edge_length(), angle.size(),
                         [&](Eigen::Index k) { return angle[k]; }) -
         place.roll;
}

}  // namespace wireplan::simulate
