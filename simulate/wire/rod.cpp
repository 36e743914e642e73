#include "simulate/wire/rod.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace wireplan::simulate {

double Section::EI(double from) const {
  if (!tapered()) return bending_stiffness;
  const double part = from / length;
  if (taper == Taper::kLinear) {
    return bending_stiffness + part * (proximal_bending_stiffness - bending_stiffness);
  }
  const double q_0 = std::sqrt(std::sqrt(bending_stiffness));
  const double q_1 = std::sqrt(std::sqrt(proximal_bending_stiffness));
  const double q = q_0 + part * (q_1 - q_0);
  return (q * q) * (q * q);
}

// A cone: with q, the fourth root of EI, linear from a to b, the integral of q^-4 over a length l
// is l (a^2 + a b + b^2) / (3 a^3 b^3).
double Section::bend_compliance(double from, double part) const {
  if (!tapered()) return part / bending_stiffness;
  const double a = from / length, b = (from + part) / length;
  const double EI_0 = bending_stiffness, EI_1 = proximal_bending_stiffness;
  if (taper == Taper::kCone) {
    const double root_0 = std::sqrt(std::sqrt(EI_0)), root_1 = std::sqrt(std::sqrt(EI_1));
    const double q_a = root_0 + a * (root_1 - root_0), q_b = root_0 + b * (root_1 - root_0);
    return part * (q_a * q_a + q_a * q_b + q_b * q_b) / (3.0 * std::pow(q_a * q_b, 3));
  }
  const double EI_a = EI_0 + a * (EI_1 - EI_0), EI_b = EI_0 + b * (EI_1 - EI_0);
  const double rise = (EI_b - EI_a) / EI_a;
  return part / EI_a * (rise == 0.0 ? 1.0 : std::log1p(rise) / rise);
}

double Section::axial_compliance(double from, double part, double radius) const {
  if (axial_stiffness > 0.0) return part / axial_stiffness;
  if (tapered()) return 0.25 * radius * radius * bend_compliance(from, part);
  return part / (4.0 * bending_stiffness / (radius * radius));
}

double Section::twist_compliance(double from, double part) const {
  if (twist_stiffness > 0.0) return part / twist_stiffness;
  if (tapered()) return 1.3 * bend_compliance(from, part);
  return part / (bending_stiffness / 1.3);
}

double Wire::length() const {
  double sum = 0.0;
  for (const Section& section : sections) sum += section.length;
  return sum;
}

bool Wire::straight() const {
  return std::all_of(sections.begin(), sections.end(),
                     [](const Section& section) { return section.rest_curvature == 0.0; });
}

bool Wire::round() const {
  return std::all_of(sections.begin(), sections.end(),
                     [](const Section& section) { return section.round(); });
}

namespace {

/// Values of the wire averaged over the arc from a to b, counted from the tip [mm].
struct Average {
  double EI = 0.0, EI_2 = 0.0, EA = 0.0, GJ = 0.0;  // springs in series: harmonic means
  double rest_angle = 0.0, mass = 0.0;              // sums
  double weak() const { return std::min(EI, EI_2); }
  double strip() const { return EI_2 - EI; }
  bool has_directions() const { return rest_angle != 0.0 || strip() != 0.0; }
};

Average average_over(const Wire& wire, double a, double b) {
  Average sum;
  double inverse_EI = 0.0, inverse_EI_2 = 0.0, inverse_EA = 0.0, inverse_GJ = 0.0, start = 0.0;
  for (std::size_t k = 0; k < wire.sections.size(); ++k) {
    const Section& section = wire.sections[k];
    const bool last = k + 1 == wire.sections.size();
    const double end = last ? std::max(b, start + section.length) : start + section.length;
    const double part = std::max(0.0, std::min(b, end) - std::max(a, start));
    const double from = std::max(a, start) - start;
    start = end;
    if (part == 0.0) continue;
    const double bend = section.bend_compliance(from, part);
    inverse_EI += bend;
    inverse_EI_2 += section.round() ? bend : part / section.bending_stiffness_2;
    inverse_EA += section.axial_compliance(from, part, wire.radius);
    inverse_GJ += section.twist_compliance(from, part);
    sum.rest_angle += part * section.rest_curvature;
    sum.mass += part * section.mass_per_length;
  }
  sum.EI = (b - a) / inverse_EI;
  sum.EI_2 = (b - a) / inverse_EI_2;
  sum.EA = (b - a) / inverse_EA;
  sum.GJ = (b - a) / inverse_GJ;
  return sum;
}

}  // namespace

double Rod::largest_bend() const {
  return twisted ? (bend + strip.cwiseAbs()).maxCoeff() : bend.maxCoeff();
}

Rod build_rod(const Wire& wire, const Eigen::VectorXd& edge_lengths, bool twisted) {
  const int elements = static_cast<int>(edge_lengths.size());
  expects(elements >= 2 && edge_lengths.minCoeff() > 0.0 && wire.radius > 0.0);
  expects(edge_lengths.sum() <= wire.length() * (1.0 + 1e-9));
  const int n = elements + 1;
  Rod rod;
  rod.radius = wire.radius;
  rod.twisted = twisted;
  rod.rest_length = edge_lengths;
  rod.per_length = edge_lengths.cwiseInverse();
  rod.stretch.resize(elements);
  rod.bend = rod.strip = rod.twist = rod.rest_angle = Eigen::VectorXd::Zero(n);
  rod.share = rod.mass = Eigen::VectorXd::Zero(n);
  rod.tip_distance = Eigen::VectorXd::Zero(n);
  for (int i = elements - 1; i >= 0; --i) {
    rod.tip_distance[i] = rod.tip_distance[i + 1] + edge_lengths[i];
  }

  // Edges, and half of each edge's length and mass to its nodes.
  for (int i = 0; i < elements; ++i) {
    const double l = edge_lengths[i];
    const Average edge = average_over(wire, rod.tip_distance[i + 1], rod.tip_distance[i]);
    rod.stretch[i] = edge.EA;
    for (const int node : {i, i + 1}) {
      rod.share[node] += 0.5 * l;
      rod.mass[node] += 0.5 * edge.mass;
    }
  }
  // Half an edge at either end, for a clamp there.
  const double l_0 = 0.5 * edge_lengths[0], l_n = 0.5 * edge_lengths[elements - 1];
  const Average proximal = average_over(wire, rod.tip_distance[0] - l_0, rod.tip_distance[0]);
  const Average distal = average_over(wire, 0.0, l_n);
  rod.proximal_bend = proximal.weak() / l_0;
  rod.distal_bend = distal.weak() / l_n;
  rod.proximal_strip = proximal.strip() / l_0;
  rod.distal_strip = distal.strip() / l_n;
  rod.proximal_rest_angle = proximal.rest_angle;
  rod.distal_rest_angle = distal.rest_angle;
  rod.twisted = rod.twisted || proximal.has_directions() || distal.has_directions();
  // Interior nodes: from the middle of one edge to the middle of the next.
  for (int i = 1; i + 1 < n; ++i) {
    const double c = rod.tip_distance[i];
    const Average node =
        average_over(wire, c - 0.5 * edge_lengths[i], c + 0.5 * edge_lengths[i - 1]);
    rod.bend[i] = node.weak() / rod.share[i];
    rod.strip[i] = node.strip() / rod.share[i];
    // Twist reaches to the ends: their edges carry the roll that is held there, not that of their
    // middles. Without the two half edges a held roll would be first order.
    const double a = i == n - 2 ? 0.0 : c - 0.5 * edge_lengths[i];
    const double b = i == 1 ? rod.tip_distance[0] : c + 0.5 * edge_lengths[i - 1];
    rod.twist[i] = average_over(wire, a, b).GJ / (b - a);
    rod.rest_angle[i] = node.rest_angle;
    rod.twisted = rod.twisted || node.has_directions();
  }
  return rod;
}

Rod build_rod(const Wire& wire, double length, int elements) {
  expects(elements >= 2 && length > 0.0);
  return build_rod(wire, Eigen::VectorXd::Constant(elements, length / elements));
}

Vec3 reference_normal(const Vec3& axis) {
  const Vec3 t = axis.normalized();
  const Vec3 anterior(0.0, -1.0, 0.0), superior(0.0, 0.0, 1.0);
  const bool parallel = t.cross(anterior).norm() < std::sin(10.0 * kRadPerDeg);
  const Vec3 toward = parallel ? superior : anterior;
  return (toward - toward.dot(t) * t).normalized();
}

RodState straight_state(const Rod& rod, const Vec3& point, const Vec3& direction, double roll) {
  const int n = rod.nodes();
  RodState state;
  state.x.resize(3, n);
  double arc = 0.0;
  for (int i = 0; i < n; ++i) {
    state.x.col(i) = point + arc * direction;
    if (i + 1 < n) arc += rod.rest_length[i];
  }
  state.theta = Eigen::VectorXd::Constant(n - 1, roll);
  state.director = reference_normal(direction).replicate(1, n - 1);
  state.reference_twist = Eigen::VectorXd::Zero(n);
  return state;
}

RodState rest_state(const Rod& rod, const Vec3& point, const Vec3& direction, double roll) {
  RodState state = straight_state(rod, point, direction, roll);
  const Vec3 d = state.director.col(0);
  const Vec3 toward = std::cos(roll) * d + std::sin(roll) * direction.cross(d);
  const Vec3 axis = direction.cross(toward);
  double angle = rod.proximal_rest_angle;
  for (int i = 0; i + 1 < rod.nodes(); ++i) {
    angle += rod.rest_angle[i];
    // In the plane of the curve the directors turn with the edges: there is no twist.
    const Eigen::AngleAxisd turn(angle, axis);
    state.x.col(i + 1) = state.x.col(i) + rod.rest_length[i] * (turn * direction);
    state.director.col(i) = turn * d;
  }
  return state;
}

void transport_frames(const RodState& base, RodState& moved, int first_edge, int last_edge,
                      int first_plain, int plain_edges) {
  const int edges = static_cast<int>(base.director.cols());
  const auto tangent = [](const RodState& state, int i) -> Vec3 {
    const Vec3 e = state.x.col(i + 1) - state.x.col(i);
    return (1.0 / e.norm()) * e;
  };
  Vec3 t_a = Vec3::Zero(), behind = Vec3::Zero();  // tangent and director of the edge behind
  if (first_edge > 0) {
    t_a = tangent(moved, first_edge - 1);
    behind = moved.director.col(first_edge - 1);
  }
  for (int i = first_edge; i <= std::min(last_edge + 1, edges - 1); ++i) {
    const Vec3 t_b = tangent(moved, i);
    const Vec3 carried = parallel_transport(behind, t_a, t_b);
    t_a = t_b;
    if (i >= first_plain && i < first_plain + plain_edges) {
      behind = carried;
      continue;
    }
    if (i <= last_edge) {
      Vec3 d = parallel_transport(base.director.col(i), tangent(base, i), t_b);
      d -= d.dot(t_b) * t_b;  // rounding must not build up over thousands of steps
      moved.director.col(i) = d.normalized();
    }
    behind = moved.director.col(i);
    if (i > 0) {
      // Twist of the reference directors: the angle next to that of before, so that it never jumps
      // by a turn.
      const double angle = std::atan2(carried.cross(behind).dot(t_b), carried.dot(behind));
      const double before = base.reference_twist[i];
      const bool far = std::abs(angle - before) > kPi;
      moved.reference_twist[i] = far ? before + std::remainder(angle - before, 2.0 * kPi) : angle;
    }
  }
}

}  // namespace wireplan::simulate
