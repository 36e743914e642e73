#pragma once
/// The energy of the wire, element by element, with first and second derivatives. Part of
/// solver.cpp, apart from it for its length; needs the Problem and the states of solver.h.
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "simulate/solver.h"

namespace wireplan::simulate {

inline Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0;
  return m;
}

inline Mat3 symmetric_product(const Vec3& a, const Vec3& b) {
  return a * b.transpose() + b * a.transpose();
}

// ---------------------------------------------------------------- elements
//
// Each element adds its derivatives to a sink: gradient(node, g), gradient_theta(edge, g),
// hessian(i, j, H) for x_i x_j, hessian_theta(edge, i, h) for theta x_i, hessian_theta_theta(e, f,
// h). Both halves of the symmetric matrix are implied: a pair i != j is given once.

/// Stretch of edge i, paper Eq. (5): W = k_s/4 (|e|^2 - l^2)^2 with k_s = EA/(2 l^3).
template <class Sink>
double add_stretch(const Problem& problem, const RodState& state, int i, Sink& sink) {
  const Rod& rod = *problem.rod;
  const double l = rod.rest_length[i], k = rod.stretch[i] / (2.0 * l * l * l);
  const Vec3 e = state.x.col(i + 1) - state.x.col(i);
  const double excess = e.squaredNorm() - l * l;
  const Vec3 f = k * excess * e;
  sink.gradient(i, -f);
  sink.gradient(i + 1, f);
  if constexpr (Sink::kHessian) {
    Mat3 H = (2.0 * k) * e * e.transpose();
    H.diagonal().array() += k * excess;
    sink.hessian(i, i, H);
    sink.hessian(i + 1, i + 1, H);
    sink.hessian(i + 1, i, -H);
  }
  return 0.25 * k * excess * excess;
}

/// Bend at node i between its edges a and b, for unequal lengths too. With u = e_b/l_b - e_a/l_a it
/// is W = B (cos(r) |u|^2 / 2 + 1 - cos(r)) + add_rest_bend, which for rest angle r = 0 and equal
/// lengths is paper Eq. (10) with k_b = EI/h^3, and for an inextensible chain turning by phi is B
/// (1 - cos(phi - r)).
template <class Sink>
double add_bend(const Problem& problem, const RodState& state, int i, Sink& sink) {
  const Rod& rod = *problem.rod;
  const double a = 1.0 / rod.rest_length[i - 1], c = 1.0 / rod.rest_length[i], b = -(a + c);
  const double cosine = rod.rest_angle[i] == 0.0 ? 1.0 : std::cos(rod.rest_angle[i]);
  const double B = rod.bend[i] * cosine;
  const Vec3 u = a * state.x.col(i - 1) + b * state.x.col(i) + c * state.x.col(i + 1);
  sink.gradient(i - 1, B * a * u);
  sink.gradient(i, B * b * u);
  sink.gradient(i + 1, B * c * u);
  if constexpr (Sink::kHessian) {
    const std::array<double, 3> w = {a, b, c};
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q <= p; ++q)
        sink.hessian_scaled_identity(i - 1 + p, i - 1 + q, B * w[p] * w[q]);
    }
  }
  return 0.5 * B * u.squaredNorm() + rod.bend[i] * (1.0 - cosine);
}

/// A clamp as half a bend element, B/2 |e/l - t|^2 with B = 2 EI/l (design 7): the first edge leans
/// toward the tangent without being frozen to it.
template <class Sink>
double add_clamp(const RodState& state, int edge, double l, double B, const Vec3& tangent,
                 Sink& sink) {
  const Vec3 u = (state.x.col(edge + 1) - state.x.col(edge)) / l - tangent;
  sink.gradient(edge, -(B / l) * u);
  sink.gradient(edge + 1, (B / l) * u);
  if constexpr (Sink::kHessian) {
    sink.hessian_scaled_identity(edge, edge, B / (l * l));
    sink.hessian_scaled_identity(edge + 1, edge + 1, B / (l * l));
    sink.hessian_scaled_identity(edge + 1, edge, -B / (l * l));
  }
  return 0.5 * B * u.squaredNorm();
}

/// An edge with its directors: t tangent, m material director, n = t x m.
struct Edge {
  double length;
  Vec3 t, m, n;
};

inline Edge edge_at(const RodState& state, int i) {
  const Vec3 e = state.x.col(i + 1) - state.x.col(i);
  Edge edge;
  edge.length = e.norm();
  edge.t = e / edge.length;
  const Vec3 d = state.director.col(i);
  const double c = std::cos(state.theta[i]), s = std::sin(state.theta[i]);
  edge.m = c * d + s * edge.t.cross(d);
  edge.n = edge.t.cross(edge.m);
  return edge;
}

/// Adds a Hessian given for the edges a = (i-1, i) and b = (i, i+1) to the nodes.
template <class Sink>
void add_edge_hessian(int i, const Mat3& H_aa, const Mat3& H_ab, const Mat3& H_bb, Sink& sink) {
  sink.hessian(i - 1, i - 1, H_aa);
  sink.hessian(i, i, H_aa - H_ab - H_ab.transpose() + H_bb);
  sink.hessian(i + 1, i + 1, H_bb);
  sink.hessian(i, i - 1, -H_aa + H_ab.transpose());
  sink.hessian(i + 1, i, -H_bb + H_ab.transpose());
  sink.hessian(i + 1, i - 1, -H_ab.transpose());
}

/// The same for the derivative of theta of `edge` with e_a and e_b.
template <class Sink>
void add_theta_hessian(int i, int edge, const Vec3& h_a, const Vec3& h_b, Sink& sink) {
  sink.hessian_theta(edge, i - 1, -h_a);
  sink.hessian_theta(edge, i, h_a - h_b);
  sink.hessian_theta(edge, i + 1, h_b);
}

template <class Sink>
void add_edge_gradient(int i, const Vec3& g_a, const Vec3& g_b, Sink& sink) {
  sink.gradient(i - 1, -g_a);
  sink.gradient(i, g_a - g_b);
  sink.gradient(i + 1, g_b);
}

/// Part of the bend energy that knows which way a curved wire is curved: W = -B sin(r) u . (m_a +
/// m_b)/2. The directors follow the edges by parallel transport: dm = -t (m . de)/|e|.
template <class Sink>
double add_rest_bend(const Problem& problem, const RodState& state, int i, Sink& sink) {
  const Rod& rod = *problem.rod;
  const double c = 0.5 * rod.bend[i] * std::sin(rod.rest_angle[i]);
  const double l_a = rod.rest_length[i - 1], l_b = rod.rest_length[i];
  const Edge a = edge_at(state, i - 1), b = edge_at(state, i);
  const Vec3 u = (b.length / l_b) * b.t - (a.length / l_a) * a.t;
  const Vec3 sum = a.m + b.m;
  const double ua = u.dot(a.t) / a.length, ub = u.dot(b.t) / b.length;
  add_edge_gradient(i, c * (sum / l_a + ua * a.m), c * (-sum / l_b + ub * b.m), sink);
  sink.gradient_theta(i - 1, -c * u.dot(a.n));
  sink.gradient_theta(i, -c * u.dot(b.n));
  if constexpr (Sink::kHessian) {
    sink.hessian_theta_theta(i - 1, i - 1, c * u.dot(a.m));
    sink.hessian_theta_theta(i, i, c * u.dot(b.m));
    add_theta_hessian(i, i - 1, c * (1.0 / l_a + ua) * a.n, -(c / l_b) * a.n, sink);
    add_theta_hessian(i, i, (c / l_a) * b.n, c * (-1.0 / l_b + ub) * b.n, sink);
    // Second variation of u . m under parallel transport of m along one edge.
    const auto second = [&u](const Edge& e) -> Mat3 {
      const Vec3 across = u - u.dot(e.t) * e.t;
      return (u.dot(e.t) * symmetric_product(e.t, e.m) - 0.5 * symmetric_product(e.m, across)) /
             (e.length * e.length);
    };
    const Mat3 H_aa = -c * (symmetric_product(a.t, a.m) / (l_a * a.length) + second(a));
    const Mat3 H_bb = c * (symmetric_product(b.t, b.m) / (l_b * b.length) - second(b));
    const Mat3 H_ab = (c / (l_b * a.length)) * a.m * a.t.transpose() -
                      (c / (l_a * b.length)) * b.t * b.m.transpose();
    add_edge_hessian(i, H_aa, H_ab, H_bb, sink);
  }
  return -c * u.dot(sum);
}

/// Twist at node i, W = T/2 (theta_b - theta_a + reference twist)^2; derivatives of the reference
/// twist: "Discrete Viscous Threads", Eq. (16) and appendix.
template <class Sink>
double add_twist(const Problem& problem, const RodState& state, int i, Sink& sink) {
  const double T = problem.rod->twist[i];
  const Vec3 e_a = state.x.col(i) - state.x.col(i - 1), e_b = state.x.col(i + 1) - state.x.col(i);
  const double a = e_a.norm(), b = e_b.norm();
  const Vec3 t_a = e_a / a, t_b = e_b / b;
  const double chi = 1.0 + t_a.dot(t_b);
  const Vec3 kb = (2.0 / chi) * t_a.cross(t_b);
  const double angle = state.theta[i] - state.theta[i - 1] + state.reference_twist[i];
  const Vec3 m_a = kb / (2.0 * a), m_b = kb / (2.0 * b);  // d angle / d e
  add_edge_gradient(i, T * angle * m_a, T * angle * m_b, sink);
  sink.gradient_theta(i - 1, -T * angle);
  sink.gradient_theta(i, T * angle);
  if constexpr (Sink::kHessian) {
    Mat3 H_aa = T * m_a * m_a.transpose(), H_bb = T * m_b * m_b.transpose(),
         H_ab = T * m_a * m_b.transpose();
    {
      const Vec3 mean = (t_a + t_b) / chi;
      H_aa -= (0.25 * T * angle / (a * a)) * symmetric_product(kb, t_a + mean);
      H_bb -= (0.25 * T * angle / (b * b)) * symmetric_product(kb, t_b + mean);
      H_ab +=
          (0.5 * T * angle / (a * b)) * ((2.0 / chi) * cross_matrix(t_a) - kb * mean.transpose());
    }
    add_edge_hessian(i, H_aa, H_ab, H_bb, sink);
    add_theta_hessian(i, i - 1, -T * m_a, -T * m_b, sink);
    add_theta_hessian(i, i, T * m_a, T * m_b, sink);
    sink.hessian_theta_theta(i - 1, i - 1, T);
    sink.hessian_theta_theta(i, i, T);
    sink.hessian_theta_theta(i, i - 1, -T);
  }
  return 0.5 * T * angle * angle;
}

/// Angle of the last edge about the moment's axis, counted on from that of the last accepted state.
inline double tip_angle(const TipMoment& moment, const RodState& state, const Vec3& edge) {
  const Vec3 zero = reference_normal(moment.axis);
  const double angle = std::atan2(edge.dot(moment.axis.cross(zero)), edge.dot(zero));
  return state.tip_angle + std::remainder(angle - state.tip_angle, 2.0 * kPi);
}

inline Vec3 last_edge(const RodState& state) {
  return state.x.rightCols<1>() - state.x.col(state.x.cols() - 2);
}

/// The moment on the last edge: W = -size * angle about the axis.
template <class Sink>
double add_tip_moment(const Problem& problem, const RodState& state, Sink& sink) {
  const TipMoment& moment = *problem.tip_moment;
  const int n = problem.rod->nodes();
  const Vec3 e = last_edge(state);
  const Vec3 flat = e - e.dot(moment.axis) * moment.axis;
  const Vec3 around = moment.axis.cross(flat);  // d angle / d e = around / |flat|^2
  const double squared = flat.squaredNorm();
  const Vec3 g = (moment.size / squared) * around;
  sink.gradient(n - 2, g);
  sink.gradient(n - 1, -g);
  if constexpr (Sink::kHessian) {
    const Mat3 H = (moment.size / (squared * squared)) * symmetric_product(flat, around);
    sink.hessian(n - 2, n - 2, H);
    sink.hessian(n - 1, n - 1, H);
    sink.hessian(n - 1, n - 2, -H);
  }
  return -moment.size * tip_angle(moment, state, e);
}

/// Spring that holds node i to the plane through node 0.
template <class Sink>
double add_plane(const Problem& problem, const RodState& state, int i, Sink& sink) {
  const Vec3& normal = *problem.plane;
  const double k = problem.rod->stretch[0] / problem.rod->rest_length[0];
  const double height = normal.dot(state.x.col(i) - state.x.col(0));
  sink.gradient(i, k * height * normal);
  if constexpr (Sink::kHessian) sink.hessian(i, i, k * normal * normal.transpose());
  return 0.5 * k * height * height;
}

}  // namespace wireplan::simulate
