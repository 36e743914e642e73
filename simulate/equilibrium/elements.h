#pragma once
/// The energy of the wire, element by element, with first and second derivatives.
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "simulate/equilibrium/problem.h"
#include "simulate/wire/twist_chain.h"

namespace wireplan::simulate {

inline Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0;
  return m;
}

// Entry by entry: as Eigen's outer products they are function calls.

inline Mat3 outer_product(const Vec3& a, const Vec3& b) {
  Mat3 m;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) m(r, c) = a[r] * b[c];
  }
  return m;
}

inline Mat3 symmetric_product(const Vec3& a, const Vec3& b) {
  Mat3 m;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) m(r, c) = a[r] * b[c] + b[r] * a[c];
  }
  return m;
}

// ---------------------------------------------------------------- elements
//
// Each element adds its derivatives to a sink: gradient(node, g), gradient_theta(edge, g),
// hessian(i, j, H) for x_i x_j, hessian_scaled(i, j, s, H) for s H, hessian_of_edge(i, H) for edge
// i's twice, hessian_theta(edge, i, h) for theta x_i, hessian_theta_theta(e, f, h). Both halves of
// the symmetric matrix are implied: a pair i != j is given once.

/// What the elements of this rod are called in results.
inline std::vector<std::string> name_elements(const Rod& rod) {
  std::vector<std::string> names = {"stretch", "bend"};
  if (rod.twisted) names.push_back("twist");
  if (!rod.strip.isZero(0.0)) names.push_back("strip");
  return names;
}

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
    Mat3 H = outer_product((2.0 * k) * e, e);
    H.diagonal().array() += k * excess;
    sink.hessian_of_edge(i, H);
  }
  return 0.25 * k * excess * excess;
}

/// Bend at node i between its edges a and b, for unequal lengths too. With u = e_b/l_b - e_a/l_a it
/// is W = B (cos(r) |u|^2 / 2 + 1 - cos(r)) + add_rest_bend, which for rest angle r = 0 and equal
/// lengths is paper Eq. (10) with k_b = EI/h^3, and for an inextensible chain turning by phi is B
/// (1 - cos(phi - r)). Strips: see add_strip.
template <class Sink>
double add_bend(const Problem& problem, const RodState& state, int i, Sink& sink) {
  const Rod& rod = *problem.rod;
  const double a = rod.per_length[i - 1], c = rod.per_length[i], b = -(a + c);
  const bool curved = rod.twisted && rod.rest_angle[i] != 0.0;
  const double cosine = curved ? std::cos(rod.rest_angle[i]) : 1.0;
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

/// Length and unit tangent of an edge.
struct Tangent {
  double length;
  Vec3 t;
};

inline Tangent tangent_at(const RodState& state, int i) {
  const Vec3 e = state.x.col(i + 1) - state.x.col(i);
  const double length = e.norm();
  return {length, (1.0 / length) * e};
}

/// An edge with its directors: t tangent, m material director, n = t x m.
struct Edge {
  double length;
  Vec3 t, m, n;
};

/// `tool`: of several, whose thetas stand one after the other (tool_stack.h).
inline Edge edge_at(const RodState& state, int i, int tool = 0) {
  const Vec3 e = state.x.col(i + 1) - state.x.col(i);
  Edge edge;
  edge.length = e.norm();
  edge.t = e / edge.length;
  const Vec3 d = state.director.col(i);
  const double theta = state.theta[i + tool * state.director.cols()];
  const double c = std::cos(theta), s = std::sin(theta);
  edge.m = c * d + s * edge.t.cross(d);
  edge.n = edge.t.cross(edge.m);
  return edge;
}

/// Adds a Hessian given for the edges a = (i-1, i) and b = (i, i+1) to the nodes.
template <class Sink>
inline void add_edge_hessian(int i, const Mat3& H_aa, const Mat3& H_ab, const Mat3& H_bb,
                             Sink& sink) {
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
inline void add_edge_gradient(int i, const Vec3& g_a, const Vec3& g_b, Sink& sink) {
  sink.gradient(i - 1, -g_a);
  sink.gradient(i, g_a - g_b);
  sink.gradient(i + 1, g_b);
}

/// A material direction across an edge, and its derivative with theta.
struct Across {
  Vec3 d, by_theta;
};

inline Across toward_m(const Edge& edge) { return {edge.m, edge.n}; }
inline Across toward_n(const Edge& edge) { return {edge.n, -edge.m}; }

/// The direction toward which a strip is the stiffer, see Rod::strip.
inline Across toward_stiff(const Edge& edge, double strip) {
  return strip > 0.0 ? toward_n(edge) : toward_m(edge);
}

/// Second derivative of u . d with the edge, for a fixed u. The directions across an edge follow it
/// by parallel transport, which is to first order dd = -t (d . de)/|e|.
inline Mat3 carried_hessian(const Edge& edge, const Vec3& d, const Vec3& u) {
  const double along = u.dot(edge.t);
  const Vec3 across = u - along * edge.t;
  return (along * symmetric_product(edge.t, d) - 0.5 * symmetric_product(d, across)) /
         (edge.length * edge.length);
}

/// How far the wire leans at node i toward a material direction: s = u . (d_a + d_b)/2 with u of
/// add_bend, for an inextensible chain the sine of the turning angle toward it.
struct Lean {
  int i;
  double l_a, l_b;  // rest lengths
  Edge a, b;
  Vec3 u;
  Across d_a, d_b;
  double s;

  template <class Direction>
  Lean(const Rod& rod, const RodState& state, int node, const Direction& direction, int tool = 0)
      : i(node),
        l_a(rod.rest_length[node - 1]),
        l_b(rod.rest_length[node]),
        a(edge_at(state, node - 1, tool)),
        b(edge_at(state, node, tool)),
        u((b.length / l_b) * b.t - (a.length / l_a) * a.t),
        d_a(direction(a)),
        d_b(direction(b)),
        s(0.5 * u.dot(d_a.d + d_b.d)) {}
};

/// First derivatives of a lean with its edges and their thetas.
struct LeanSlopes {
  double ua, ub;  // of u along the edges, over their lengths
  Vec3 s_a, s_b;
  double s_theta_a, s_theta_b;

  explicit LeanSlopes(const Lean& lean)
      : ua(lean.u.dot(lean.a.t) / lean.a.length), ub(lean.u.dot(lean.b.t) / lean.b.length) {
    const Vec3 sum = lean.d_a.d + lean.d_b.d;
    s_a = -0.5 * (sum / lean.l_a + ua * lean.d_a.d);
    s_b = 0.5 * (sum / lean.l_b - ub * lean.d_b.d);
    s_theta_a = 0.5 * lean.u.dot(lean.d_a.by_theta);
    s_theta_b = 0.5 * lean.u.dot(lean.d_b.by_theta);
  }
};

/// Derivatives of W(s), given W' and W''.
template <class Sink>
void add_lean(const Lean& lean, double first, double second, Sink& sink) {
  const Edge &a = lean.a, &b = lean.b;
  const Across &d_a = lean.d_a, &d_b = lean.d_b;
  const LeanSlopes slopes(lean);
  const double ua = slopes.ua, ub = slopes.ub;
  const Vec3 &s_a = slopes.s_a, &s_b = slopes.s_b;
  const double s_theta_a = slopes.s_theta_a, s_theta_b = slopes.s_theta_b;
  const int i = lean.i;
  add_edge_gradient(i, first * s_a, first * s_b, sink);
  sink.gradient_theta(i - 1, first * s_theta_a);
  sink.gradient_theta(i, first * s_theta_b);
  if constexpr (Sink::kHessian) {
    // W' times the second derivatives of s.
    const double c = 0.5 * first;
    sink.hessian_theta_theta(i - 1, i - 1, -c * lean.u.dot(d_a.d));
    sink.hessian_theta_theta(i, i, -c * lean.u.dot(d_b.d));
    add_theta_hessian(i, i - 1, -c * (1.0 / lean.l_a + ua) * d_a.by_theta,
                      (c / lean.l_b) * d_a.by_theta, sink);
    add_theta_hessian(i, i, -(c / lean.l_a) * d_b.by_theta,
                      c * (1.0 / lean.l_b - ub) * d_b.by_theta, sink);
    const Mat3 H_aa = c * (symmetric_product(a.t, d_a.d) / (lean.l_a * a.length) +
                           carried_hessian(a, d_a.d, lean.u));
    const Mat3 H_bb = c * (-symmetric_product(b.t, d_b.d) / (lean.l_b * b.length) +
                           carried_hessian(b, d_b.d, lean.u));
    const Mat3 H_ab = outer_product((-c / (lean.l_b * a.length)) * d_a.d, a.t) +
                      outer_product((c / (lean.l_a * b.length)) * b.t, d_b.d);
    add_edge_hessian(i, H_aa, H_ab, H_bb, sink);
    if (second == 0.0) return;

    // W'' times the products of the first ones.
    const Vec3 w_a = second * s_a, w_b = second * s_b;
    add_edge_hessian(i, outer_product(w_a, s_a), outer_product(w_a, s_b), outer_product(w_b, s_b),
                     sink);
    add_theta_hessian(i, i - 1, s_theta_a * w_a, s_theta_a * w_b, sink);
    add_theta_hessian(i, i, s_theta_b * w_a, s_theta_b * w_b, sink);
    sink.hessian_theta_theta(i - 1, i - 1, second * s_theta_a * s_theta_a);
    sink.hessian_theta_theta(i, i, second * s_theta_b * s_theta_b);
    sink.hessian_theta_theta(i, i - 1, second * s_theta_a * s_theta_b);
  }
}

/// Part of the bend energy that knows which way a curved wire is curved: W = -B sin(r) s, with s
/// the lean toward m.
template <class Sink>
double add_rest_bend(const Problem& problem, const RodState& state, int i, Sink& sink) {
  const Rod& rod = *problem.rod;
  const Lean lean(rod, state, i, toward_m);
  const double slope = -rod.bend[i] * std::sin(rod.rest_angle[i]);
  add_lean(lean, slope, 0.0, sink);
  return slope * lean.s;
}

/// What a strip's bend has beyond that of a round wire with its smaller EI: W = S/2 (s - s_0)^2, S
/// the difference over the node's share of length, s the lean toward the stiffer direction and s_0
/// the lean at rest, sin(r) toward m and 0 toward n. Bending the soft way leaves s at 0.
template <class Sink>
double add_strip(const Problem& problem, const RodState& state, int i, Sink& sink) {
  const Rod& rod = *problem.rod;
  const double strip = rod.strip[i], S = std::abs(strip);
  const Lean lean(rod, state, i, [strip](const Edge& e) { return toward_stiff(e, strip); });
  const double excess = lean.s - (strip > 0.0 ? 0.0 : std::sin(rod.rest_angle[i]));
  add_lean(lean, S * excess, S, sink);
  return 0.5 * S * excess * excess;
}

/// Derivatives of W(s) of a clamp's lean s = w . d toward a direction d across its edge, given W'
/// and W''. For a distal tangent w is the tangent, for a proximal one minus the tangent.
template <class Sink>
void add_clamp_lean(int edge, const Edge& e, const Vec3& w, const Across& across, double first,
                    double second, Sink& sink) {
  const Vec3 s_e = -(w.dot(e.t) / e.length) * across.d;
  const double s_theta = w.dot(across.by_theta);
  sink.gradient(edge, -first * s_e);
  sink.gradient(edge + 1, first * s_e);
  sink.gradient_theta(edge, first * s_theta);
  if constexpr (Sink::kHessian) {
    const Mat3 H = first * carried_hessian(e, across.d, w) + outer_product(second * s_e, s_e);
    sink.hessian(edge, edge, H);
    sink.hessian(edge + 1, edge + 1, H);
    sink.hessian(edge + 1, edge, -H);
    const Vec3 h = second * s_theta * s_e - (first * w.dot(e.t) / e.length) * across.by_theta;
    sink.hessian_theta(edge, edge, -h);
    sink.hessian_theta(edge, edge + 1, h);
    sink.hessian_theta_theta(edge, edge, second * s_theta * s_theta - first * w.dot(across.d));
  }
}

/// What rest angle and strip add to add_clamp: the same as at an interior node, between the edge
/// and the tangent, to which the edge's directors are carried. The lean toward a direction d of the
/// edge is then t . d for a distal tangent t and -t . d for a proximal one.
template <class Sink>
double add_clamp_shape(const Problem& problem, const RodState& state, int edge, const Vec3& tangent,
                       Sink& sink) {
  const Rod& rod = *problem.rod;
  const bool proximal = edge == 0;
  const double B = proximal ? rod.proximal_bend : rod.distal_bend;
  const double strip = proximal ? rod.proximal_strip : rod.distal_strip;
  const double r = proximal ? rod.proximal_rest_angle : rod.distal_rest_angle;
  const Vec3 w = proximal ? Vec3(-tangent) : tangent;
  const Edge e = edge_at(state, edge);
  const auto add = [&](const Across& across, double first, double second) {
    add_clamp_lean(edge, e, w, across, first, second, sink);
  };
  double energy = 0.0;
  if (r != 0.0) {
    const double rounder = B * (std::cos(r) - 1.0), slope = -B * std::sin(r);
    energy += add_clamp(state, edge, rod.rest_length[edge], rounder, tangent, sink) - rounder;
    add(toward_m(e), slope, 0.0);
    energy += slope * w.dot(e.m);
  }
  if (strip != 0.0) {
    const Across stiff = toward_stiff(e, strip);
    const double excess = w.dot(stiff.d) - (strip > 0.0 ? 0.0 : std::sin(r)), S = std::abs(strip);
    add(stiff, S * excess, S);
    energy += 0.5 * S * excess * excess;
  }
  return energy;
}

/// How the reference directors' twist at node i follows its edges: first and second derivatives,
/// "Discrete Viscous Threads", Eq. (16) and appendix.
struct ReferenceTwist {
  double a, b;  // lengths of the edges
  Vec3 t_a, t_b;
  double chi;
  Vec3 kb, by_a, by_b;  // curvature binormal; derivatives with the edges

  ReferenceTwist(const Tangent& at_a, const Tangent& at_b)
      : a(at_a.length), b(at_b.length), t_a(at_a.t), t_b(at_b.t) {
    chi = 1.0 + t_a.dot(t_b);
    kb = (2.0 / chi) * t_a.cross(t_b);
    by_a = (0.5 / a) * kb;
    by_b = (0.5 / b) * kb;
  }

  /// Adds `moment` times the second derivatives.
  void add_curvature(double moment, Mat3& H_aa, Mat3& H_ab, Mat3& H_bb) const {
    const Vec3 mean = (t_a + t_b) / chi;
    H_aa -= (0.25 * moment / (a * a)) * symmetric_product(kb, t_a + mean);
    H_bb -= (0.25 * moment / (b * b)) * symmetric_product(kb, t_b + mean);
    H_ab += (0.5 * moment / (a * b)) * ((2.0 / chi) * cross_matrix(t_a) - outer_product(kb, mean));
  }
};

/// Twist at node i, W = T/2 (theta_b - theta_a + reference twist)^2.
template <class Sink>
double add_twist(double T, const RodState& state, int i, Sink& sink, int tool = 0) {
  const Eigen::Index b = i + tool * state.director.cols();  // of theta_b
  const ReferenceTwist twist(tangent_at(state, i - 1), tangent_at(state, i));
  const double angle = state.theta[b] - state.theta[b - 1] + state.reference_twist[i];
  const Vec3 &m_a = twist.by_a, &m_b = twist.by_b;
  add_edge_gradient(i, T * angle * m_a, T * angle * m_b, sink);
  sink.gradient_theta(i - 1, -T * angle);
  sink.gradient_theta(i, T * angle);
  if constexpr (Sink::kHessian) {
    Mat3 H_aa = outer_product(T * m_a, m_a), H_bb = outer_product(T * m_b, m_b),
         H_ab = outer_product(T * m_a, m_b);
    twist.add_curvature(T * angle, H_aa, H_ab, H_bb);
    add_edge_hessian(i, H_aa, H_ab, H_bb, sink);
    add_theta_hessian(i, i - 1, -T * m_a, -T * m_b, sink);
    add_theta_hessian(i, i, T * m_a, T * m_b, sink);
    sink.hessian_theta_theta(i - 1, i - 1, T);
    sink.hessian_theta_theta(i, i, T);
    sink.hessian_theta_theta(i, i - 1, -T);
  }
  return 0.5 * T * angle * angle;
}

/// Twist of a chain: derivatives of its energy but for k times the product of psi's first ones,
/// which couples all of its nodes: that is CoupledChain's. Of it, the sink has k on the diagonal of
/// the last theta; psi's derivatives with the nodes are added to `psi`, in the sink's layout, as is
/// the gradient to `gradient`. The torque's part of the Hessian is left out where it is far below
/// that of bending: kSmallTorque of it costs no iterations, and its time is a sixth of a trial's.
template <class Sink>
double add_chain(const TwistChain& chain, const Rod& rod, const RodState& state, Sink& sink,
                 Eigen::VectorXd& psi, Eigen::VectorXd& gradient) {
  constexpr double kSmallTorque = 1e-3;
  const double torque = chain.stiffness * chain.angle(state);
  sink.gradient_theta(chain.last, torque);
  if constexpr (Sink::kHessian) sink.hessian_theta_theta(chain.last, chain.last, chain.stiffness);
  Tangent behind = tangent_at(state, chain.first - 1);
  for (int i = chain.first; i <= chain.last; ++i) {
    const Tangent ahead = tangent_at(state, i);
    const ReferenceTwist twist(behind, ahead);
    behind = ahead;
    sink.add_to(psi, i - 1, -twist.by_a);
    sink.add_to(psi, i, twist.by_a - twist.by_b);
    sink.add_to(psi, i + 1, twist.by_b);
    if constexpr (Sink::kHessian) {
      if (std::abs(torque) <= kSmallTorque * rod.bend[i]) continue;
      Mat3 H_aa = Mat3::Zero(), H_ab = Mat3::Zero(), H_bb = Mat3::Zero();
      twist.add_curvature(torque, H_aa, H_ab, H_bb);
      add_edge_hessian(i, H_aa, H_ab, H_bb, sink);
    }
  }
  gradient += torque * psi;
  return chain.energy(state);
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
  if constexpr (Sink::kHessian) sink.hessian(i, i, outer_product(k * normal, normal));
  return 0.5 * k * height * height;
}

/// Spring that holds node i near its place.
template <class Sink>
double add_spring(const Springs& springs, const RodState& state, int i, Sink& sink) {
  const double k = springs.stiffness[i];
  const Vec3 off = state.x.col(i) - springs.place.col(i);
  sink.gradient(i, k * off);
  if constexpr (Sink::kHessian) sink.hessian(i, i, k * Mat3::Identity());
  return 0.5 * k * off.squaredNorm();
}

}  // namespace wireplan::simulate
