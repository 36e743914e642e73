#include "simulate/rod.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace wireplan::simulate {

double Wire::length() const {
  double sum = 0.0;
  for (const Section& section : sections) sum += section.length;
  return sum;
}

bool Wire::straight() const {
  return std::all_of(sections.begin(), sections.end(),
                     [](const Section& section) { return section.rest_curvature == 0.0; });
}

namespace {

/// Values of the wire averaged over the arc from a to b, counted from the tip [mm].
struct Average {
  double EI = 0.0, EA = 0.0, GJ = 0.0;  // springs in series: harmonic means
  double rest_angle = 0.0, mass = 0.0;  // sums
};

Average average_over(const Wire& wire, double a, double b) {
  Average sum;
  double inverse_EI = 0.0, inverse_EA = 0.0, inverse_GJ = 0.0, start = 0.0;
  for (std::size_t k = 0; k < wire.sections.size(); ++k) {
    const Section& section = wire.sections[k];
    const bool last = k + 1 == wire.sections.size();
    const double end = last ? std::max(b, start + section.length) : start + section.length;
    const double part = std::max(0.0, std::min(b, end) - std::max(a, start));
    start = end;
    if (part == 0.0) continue;
    const double EI = section.bending_stiffness;
    const double EA = section.axial_stiffness > 0.0 ? section.axial_stiffness
                                                    : 4.0 * EI / (wire.radius * wire.radius);
    const double GJ = section.twist_stiffness > 0.0 ? section.twist_stiffness : EI / 1.3;
    inverse_EI += part / EI;
    inverse_EA += part / EA;
    inverse_GJ += part / GJ;
    sum.rest_angle += part * section.rest_curvature;
    sum.mass += part * section.mass_per_length;
  }
  sum.EI = (b - a) / inverse_EI;
  sum.EA = (b - a) / inverse_EA;
  sum.GJ = (b - a) / inverse_GJ;
  return sum;
}

}  // namespace

Rod build_rod(const Wire& wire, double length, int elements) {
  expects(elements >= 2 && length > 0.0 && length <= wire.length() * (1.0 + 1e-9));
  expects(wire.radius > 0.0);
  const int n = elements + 1;
  const double l = length / elements;
  Rod rod;
  rod.radius = wire.radius;
  rod.rest_length = Eigen::VectorXd::Constant(elements, l);
  rod.stretch.resize(elements);
  rod.bend = rod.twist = rod.rest_angle = rod.share = rod.mass = Eigen::VectorXd::Zero(n);
  rod.tip_distance.resize(n);

  // Edges, and half of each edge's length and mass to its nodes.
  for (int i = 0; i < elements; ++i) {
    const double a = l * (elements - 1 - i), b = l * (elements - i);
    const Average edge = average_over(wire, a, b);
    rod.stretch[i] = edge.EA;
    for (const int node : {i, i + 1}) {
      rod.share[node] += 0.5 * l;
      rod.mass[node] += 0.5 * edge.mass;
    }
    if (i == 0) rod.proximal_bend = edge.EI / (0.5 * l);
    if (i == elements - 1) rod.distal_bend = edge.EI / (0.5 * l);
  }
  // Interior nodes: from the middle of one edge to the middle of the next.
  for (int i = 0; i < n; ++i) rod.tip_distance[i] = l * (n - 1 - i);
  for (int i = 1; i + 1 < n; ++i) {
    const double c = rod.tip_distance[i];
    const Average node = average_over(wire, c - 0.5 * l, c + 0.5 * l);
    rod.bend[i] = node.EI / l;
    rod.twist[i] = node.GJ / l;
    rod.rest_angle[i] = node.rest_angle;
    rod.twisted = rod.twisted || node.rest_angle != 0.0;
  }
  return rod;
}

Vec3 reference_normal(const Vec3& axis) {
  const Vec3 t = axis.normalized();
  const Vec3 anterior(0.0, -1.0, 0.0), superior(0.0, 0.0, 1.0);
  const bool parallel = t.cross(anterior).norm() < std::sin(10.0 * kRadPerDeg);
  const Vec3 toward = parallel ? superior : anterior;
  return (toward - toward.dot(t) * t).normalized();
}

Vec3 parallel_transport(const Vec3& vector, const Vec3& from, const Vec3& to) {
  const double chi = 1.0 + from.dot(to);
  return vector - (vector.dot(to) / chi) * (from + to);  // vector is normal to `from`
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

void transport_frames(const RodState& base, RodState& moved, int first_edge, int last_edge) {
  const int edges = static_cast<int>(base.theta.size());
  const auto tangent = [](const RodState& state, int i) -> Vec3 {
    return (state.x.col(i + 1) - state.x.col(i)).normalized();
  };
  for (int i = first_edge; i <= last_edge; ++i) {
    const Vec3 to = tangent(moved, i);
    Vec3 d = parallel_transport(base.director.col(i), tangent(base, i), to);
    d -= d.dot(to) * to;  // rounding must not build up over thousands of steps
    moved.director.col(i) = d.normalized();
  }
  // Twist of the reference directors: follow the angle of before, so that it never jumps by a turn.
  for (int i = std::max(first_edge, 1); i <= std::min(last_edge + 1, edges - 1); ++i) {
    const Vec3 t_a = tangent(moved, i - 1), t_b = tangent(moved, i);
    const Vec3 carried = parallel_transport(moved.director.col(i - 1), t_a, t_b);
    const double before = base.reference_twist[i];
    const Vec3 expected = std::cos(before) * carried + std::sin(before) * t_b.cross(carried);
    const Vec3 actual = moved.director.col(i);
    moved.reference_twist[i] =
        before + std::atan2(expected.cross(actual).dot(t_b), expected.dot(actual));
  }
}

}  // namespace wireplan::simulate
