#include "simulate/insertion/end_path.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "simulate/wire/bend_to.h"

namespace wireplan::simulate {
namespace {

// From here on a distal support is far from where the unloaded wire ends; chosen.
constexpr double kFarTurn = 10.0 * kRadPerDeg;
constexpr double kFarMove = 0.05;  // of the wire's length

// In one step, so that the wire follows and does not jump; chosen.
constexpr double kMostTurn = 20.0 * kRadPerDeg;
constexpr double kMostRoll = 60.0 * kRadPerDeg;
constexpr double kMostMove = 0.1;  // of the wire's length

constexpr double kOpposite = 1e-6;  // sine of a turn that has no axis of its own

Eigen::Matrix3Xd edges_of(const RodState& state) {
  const Eigen::Index n = state.x.cols();
  return state.x.rightCols(n - 1) - state.x.leftCols(n - 1);
}

Vec3 material_of(const RodState& state, int edge) {
  const Vec3 t = (state.x.col(edge + 1) - state.x.col(edge)).normalized();
  const Vec3 d = state.director.col(edge);
  return std::cos(state.theta[edge]) * d + std::sin(state.theta[edge]) * t.cross(d);
}

/// Theta of an edge whose material director is one at the end of the wire, carried from the
/// direction there to that of the edge; of all that differ by whole turns the one next to `near`.
double theta_of(const RodState& state, int edge, const Vec3& material, const Vec3& direction,
                double near) {
  const Vec3 t = (state.x.col(edge + 1) - state.x.col(edge)).normalized();
  const Vec3 d = state.director.col(edge);
  const Vec3 m = parallel_transport(material, direction, t);
  return near + std::remainder(std::atan2(m.dot(t.cross(d)), m.dot(d)) - near, 2.0 * kPi);
}

}  // namespace

// ---------------------------------------------------------------- the way of the end

EndPath::EndPath(const Rod& rod, const RodState& unloaded, const EndPathEnds& ends)
    : rod_(rod), ends_(ends), start_(unloaded.x.col(0)), edges_(edges_of(unloaded)) {
  // The unloaded wire turns by its last rest angle beyond the last edge, toward its director.
  const int last = rod.nodes() - 2;
  const Vec3 t = edges_.col(last).normalized(), m = material_of(unloaded, last);
  const double r = rod.distal_rest_angle;
  direction_ = std::cos(r) * t + std::sin(r) * m;
  material_ = std::cos(r) * m - std::sin(r) * t;
  start_material_ = parallel_transport(material_of(unloaded, 0), edges_.col(0).normalized(),
                                       ends_.start_direction);

  if (ends_.is_directed) {
    const Vec3 across = direction_.cross(ends_.direction);
    const double sine = across.norm(), cosine = direction_.dot(ends_.direction);
    turn_ = std::atan2(sine, cosine);
    if (sine > kOpposite) {
      axis_ = across / sine;
    } else if (cosine < 0.0) {
      const Vec3 way = direction_.cross(ends_.point - ends_.start_point);
      const bool has_way = way.norm() > kOpposite * rod.tip_distance[0];
      axis_ = has_way ? Vec3(way.normalized()) : direction_.cross(reference_normal(direction_));
      if (ends_.plane) axis_ = ends_.plane->dot(axis_) < 0.0 ? Vec3(-*ends_.plane) : *ends_.plane;
    }
  }

  const Vec3 left = ends_.point - rolled_end(turn_);
  left_along_ = left.dot(direction_) * direction_;
  left_across_ = left - left_along_;
  Vec3 move = ends_.point - unloaded.x.col(rod.nodes() - 1);
  if (ends_.slides) move -= move.dot(ends_.direction) * ends_.direction;
  is_far_ = turn_ > kFarTurn || move.norm() > kFarMove * rod.tip_distance[0];
}

double EndPath::arc_to_middle(int edge) const {
  return rod_.tip_distance[0] - 0.5 * (rod_.tip_distance[edge] + rod_.tip_distance[edge + 1]);
}

/// The end of the unloaded wire after its end was turned, each edge in proportion.
Vec3 EndPath::rolled_end(double turn) const {
  Vec3 end = start_;
  for (int i = 0; i + 1 < rod_.nodes(); ++i) {
    end += rotation_by(turn * arc_to_middle(i) / rod_.tip_distance[0] * axis_) * edges_.col(i);
  }
  return end;
}

Vec3 EndPath::point(double part) const {
  if (part == 1.0) return ends_.point;
  return rolled_end(part * turn_) + part * left_across_ + part * part * left_along_;
}

Vec3 EndPath::direction(double part) const {
  if (part == 1.0 && ends_.is_directed) return ends_.direction;
  return rotation_by(part * turn_ * axis_) * direction_;
}

double EndPath::longest_step() const {
  const double move = kMostMove * rod_.tip_distance[0];
  return 1.0 / std::max({1.0, turn_ / kMostTurn, std::abs(ends_.roll) / kMostRoll,
                         left_across_.norm() / move, std::sqrt(left_along_.norm() / move)});
}

Vec3 EndPath::material_at(double part) const {
  const Vec3 rolled = rotation_by(part * ends_.roll * direction_) * material_;
  return rotation_by(part * turn_ * axis_) * rolled;
}

double EndPath::correct_rolls(double part, RodState& state) const {
  const int last = rod_.nodes() - 2;
  double start = 0.0, end = 0.0;
  if (ends_.start_is_directed) {
    start = theta_of(state, 0, start_material_, ends_.start_direction, state.theta[0]);
    start -= state.theta[0];
  }
  if (ends_.is_directed) {
    end = theta_of(state, last, material_at(part), direction(part), state.theta[last]);
    end -= state.theta[last];
  }
  if (ends_.start_is_directed && ends_.is_directed) {
    state.theta.array() += start;
    spread_turn(rod_, end - start, state);
  } else {
    state.theta.array() += start + end;  // nothing twists it
  }
  return std::max(std::abs(start), std::abs(end));
}

RodState EndPath::guess(const Progress& progress, double part) const {
  const RodState& now = progress.now;
  const int n = rod_.nodes();
  const bool first = progress.part == 0.0;
  const double ahead =
      first ? 0.0 : (part - progress.part) / (progress.part - progress.part_before);
  BentWire wire{now.x.col(0), edges_of(now), direction(progress.part)};

  // 1. On as it went; at first as it is bent evenly.
  if (first) {
    for (int i = 0; i + 1 < n; ++i) {
      const double turn = part * turn_ * arc_to_middle(i) / rod_.tip_distance[0];
      wire.edges.col(i) = (rotation_by(turn * axis_) * wire.edges.col(i)).eval();
    }
    wire.end_direction = direction(part);
  } else {
    const Eigen::Matrix3Xd before = edges_of(progress.before);
    for (int i = 0; i + 1 < n; ++i) {
      const Vec3 edge = wire.edges.col(i), on = edge + ahead * (edge - before.col(i));
      wire.edges.col(i) = (edge.norm() / on.norm()) * on;
    }
    const Vec3 end = wire.end_direction;
    wire.end_direction = (end + ahead * (end - direction(progress.part_before))).normalized();
  }

  // 2. To where the end is held. What is left over then is spread over the wire.
  Vec3 goal = point(part);
  const Vec3 along = direction(part);
  if (ends_.slides) goal += (wire.end() - goal).dot(along) * along;
  buckle_column(rod_, goal, ends_.plane, wire);
  BentWire bent = wire;
  if (bend_to(rod_, {ends_.start_is_directed, ends_.is_directed}, goal, along, bent)) wire = bent;
  const Vec3 left = goal - wire.end();
  RodState state = now;
  for (int i = 0; i + 1 < n; ++i) {
    state.x.col(i + 1) =
        state.x.col(i) + wire.edges.col(i) + (rod_.rest_length[i] / rod_.tip_distance[0]) * left;
  }
  if (!rod_.twisted) return state;

  // 3. Twist goes on too, and what the held roll still lacks is spread as torsion spreads it.
  transport_frames(now, state, 0, n - 2);
  if (!first) state.theta += ahead * (now.theta - progress.before.theta);
  if (!ends_.is_directed) return state;
  const double end = state.theta[n - 2], near = end + (first ? part * ends_.roll : 0.0);
  spread_turn(rod_, theta_of(state, n - 2, material_at(part), direction(part), near) - end, state);
  return state;
}

void spread_turn(const Rod& rod, double turn, RodState& state) {
  const int n = rod.nodes();
  double compliance = 0.0, sum = 0.0;
  for (int i = 1; i + 1 < n; ++i) compliance += 1.0 / rod.twist[i];
  for (int i = 1; i + 1 < n; ++i) {
    sum += 1.0 / rod.twist[i];
    state.theta[i] += turn * sum / compliance;
  }
}

}  // namespace wireplan::simulate
