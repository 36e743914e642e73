#pragma once
/// What the twists and natural curves of several tools add to the energy of the rod that they make
/// (tool_stack.h), with first and second derivatives.
///
/// At a node with V = |u|^2/2 and, for each tool, the lean s_i = u . m_i (elements.h) and the mean
/// angle psi_i of its edges, the bend is that of one wire with the rest angle sqrt(Q) toward the
/// sum of the tools' r_i m_i, where Q = sum r_i r_k cos(psi_i - psi_k):
///   W = B (1 - f)(1 - V) - B g sum r_i s_i + sum P_ik cos(psi_i - psi_k),
///   f = cos sqrt(Q), g = sin sqrt(Q) / sqrt(Q),
/// to which the rod's own term B V is to be added. With one tool it is add_rest_bend().
#include <array>
#include <cmath>

#include "simulate/equilibrium/elements.h"
#include "simulate/wire/twist_chain.h"

namespace wireplan::simulate {

/// Takes what an element adds for the thetas of one tool to those of that tool.
template <class Sink>
struct OneTool {
  static constexpr bool kHessian = Sink::kHessian;
  Sink& sink;
  int tool;

  void gradient(int i, const Vec3& v) { sink.gradient(i, v); }
  void gradient_theta(int e, double v) { sink.gradient_theta(e, v, tool); }
  void hessian(int i, int j, const Mat3& H) { sink.hessian(i, j, H); }
  void hessian_theta(int e, int i, const Vec3& v) { sink.hessian_theta(e, i, v, tool); }
  void hessian_theta_theta(int e, int f, double v) {
    sink.hessian_theta_theta(e, f, v, tool, tool);
  }
};

/// f and g of Q, with two derivatives.
struct RestTurn {
  double f, f_1, f_2, g, g_1, g_2;
  explicit RestTurn(double Q) {
    if (Q < 1e-3) {  // to 1e-17
      f = 1.0 - Q / 2.0 * (1.0 - Q / 12.0 * (1.0 - Q / 30.0 * (1.0 - Q / 56.0)));
      g = 1.0 - Q / 6.0 * (1.0 - Q / 20.0 * (1.0 - Q / 42.0 * (1.0 - Q / 72.0)));
      g_1 = -1.0 / 6.0 + Q / 60.0 - Q * Q / 1680.0 + Q * Q * Q / 90720.0;
      g_2 = 1.0 / 60.0 - Q / 840.0 + Q * Q / 30240.0;
    } else {
      const double r = std::sqrt(Q);
      f = std::cos(r);
      g = std::sin(r) / r;
      g_1 = (f - g) / (2.0 * Q);
      g_2 = (-0.5 * g - 3.0 * g_1) / (2.0 * Q);
    }
    f_1 = -0.5 * g;
    f_2 = -0.5 * g_1;
  }
};

/// W of a node as a function of V, s_i and psi_i of T tools, with derivatives in that order.
template <int T>
struct NodeBend {
  static constexpr int kCount = 1 + 2 * T;
  using Vector = Eigen::Matrix<double, kCount, 1>;
  using Matrix = Eigen::Matrix<double, kCount, kCount>;
  double energy = 0.0;
  Vector first = Vector::Zero();
  Matrix second = Matrix::Zero();

  /// With B = 0 it is the mutual part alone, as at a free tip.
  NodeBend(const ToolTerms& tools, int node, double B, double V, const std::array<double, T>& s,
           const std::array<double, T>& psi) {
    const auto r = [&](int i) { return tools.rest(i, node); };
    double Q = 0.0, S = 0.0;
    Eigen::Matrix<double, T, 1> Q_1 = decltype(Q_1)::Zero();
    Eigen::Matrix<double, T, T> Q_2 = decltype(Q_2)::Zero();
    const auto psi_at = [](int i) { return 1 + T + i; };
    for (int i = 0; i < T; ++i) {
      Q += r(i) * r(i);
      S += r(i) * s[static_cast<std::size_t>(i)];
      for (int k = i + 1; k < T; ++k) {
        const double turn = psi[static_cast<std::size_t>(i)] - psi[static_cast<std::size_t>(k)];
        const double c = std::cos(turn), sine = std::sin(turn), rr = 2.0 * r(i) * r(k);
        Q += rr * c;
        add_cosine(i, k, rr * c, rr * sine, 0, Q_1, Q_2);
        const double P = tools.mutual(ToolTerms::pair(i, k), node);
        energy += P * c;
        add_cosine(i, k, P * c, P * sine, psi_at(0), first, second);
      }
    }
    if (B == 0.0) return;
    const RestTurn turn(Q);
    energy += B * ((1.0 - turn.f) * (1.0 - V) - turn.g * S);
    first[0] = -B * (1.0 - turn.f);
    const double by_Q = -B * (turn.f_1 * (1.0 - V) + turn.g_1 * S);
    const double by_QQ = -B * (turn.f_2 * (1.0 - V) + turn.g_2 * S);
    for (int i = 0; i < T; ++i) {
      first[1 + i] = -B * turn.g * r(i);
      first[psi_at(i)] += by_Q * Q_1[i];
      const double mixed = B * turn.f_1 * Q_1[i];  // of V and psi_i
      second(0, psi_at(i)) += mixed;
      second(psi_at(i), 0) += mixed;
      for (int k = 0; k < T; ++k) {
        const double lean = -B * turn.g_1 * r(i) * Q_1[k];  // of s_i and psi_k
        second(1 + i, psi_at(k)) += lean;
        second(psi_at(k), 1 + i) += lean;
        second(psi_at(i), psi_at(k)) += by_Q * Q_2(i, k) + by_QQ * Q_1[i] * Q_1[k];
      }
    }
  }

 private:
  /// Derivatives of p cos(psi_i - psi_k), given p cos and p sin.
  template <class First, class Second>
  static void add_cosine(int i, int k, double cosine, double sine, int at, First& first,
                         Second& second) {
    first[at + i] -= sine;
    first[at + k] += sine;
    second(at + i, at + i) -= cosine;
    second(at + k, at + k) -= cosine;
    second(at + i, at + k) += cosine;
    second(at + k, at + i) += cosine;
  }
};

/// Derivatives of V, s_i and psi_i with what they depend on: e_a, e_b, and the thetas of edge a and
/// of edge b.
template <int T>
struct NodeJacobian {
  static constexpr int kThetas = 6, kCount = kThetas + 2 * T;
  Eigen::Matrix<double, NodeBend<T>::kCount, kCount> rows = decltype(rows)::Zero();
  static int theta_a(int i) { return kThetas + i; }
  static int theta_b(int i) { return kThetas + T + i; }

  /// Adds J' H J at node i; a clamp's edge is b of a node before it, or a of one behind.
  template <class Sink>
  void add(int i, bool has_a, bool has_b, const typename NodeBend<T>::Matrix& H, Sink& sink) const {
    const Eigen::Matrix<double, kCount, NodeBend<T>::kCount> left = rows.transpose().lazyProduct(H);
    const Eigen::Matrix<double, kCount, kCount> all = left.lazyProduct(rows);
    const auto block = [&](int p, int q) -> Mat3 { return all.template block<3, 3>(p, q); };
    const auto vector = [&](int p, int theta) -> Vec3 {
      return all.template block<3, 1>(p, theta);
    };
    const auto add_one = [&](int edge, int at) {
      sink.hessian(edge, edge, block(at, at));
      sink.hessian(edge + 1, edge + 1, block(at, at));
      sink.hessian(edge + 1, edge, -block(at, at));
    };
    if (has_a && has_b) add_edge_hessian(i, block(0, 0), block(0, 3), block(3, 3), sink);
    if (has_a && !has_b) add_one(i - 1, 0);
    if (has_b && !has_a) add_one(i, 3);
    for (int t = 0; t < T; ++t) {
      OneTool<Sink> own{sink, t};
      if (has_a && has_b) {
        add_theta_hessian(i, i - 1, vector(0, theta_a(t)), vector(3, theta_a(t)), own);
        add_theta_hessian(i, i, vector(0, theta_b(t)), vector(3, theta_b(t)), own);
      } else {
        const int edge = has_a ? i - 1 : i, at = has_a ? 0 : 3;
        const Vec3 h = vector(at, has_a ? theta_a(t) : theta_b(t));
        own.hessian_theta(edge, edge, -h);
        own.hessian_theta(edge, edge + 1, h);
      }
      for (int k = 0; k < T; ++k) {
        if (k <= t && has_a) {
          sink.hessian_theta_theta(i - 1, i - 1, all(theta_a(t), theta_a(k)), t, k);
        }
        if (k <= t && has_b) sink.hessian_theta_theta(i, i, all(theta_b(t), theta_b(k)), t, k);
        if (has_a && has_b) {
          sink.hessian_theta_theta(i, i - 1, all(theta_b(t), theta_a(k)), t, k);
        }
      }
    }
  }
};

/// The curves of the T tools at a node between two edges.
template <int T, class Sink>
double add_tool_bend(const Problem& problem, const RodState& state, int i, Sink& sink) {
  const Rod& rod = *problem.rod;
  const ToolTerms& tools = *problem.tools;
  if (tools.is_straight(i)) return 0.0;
  const Eigen::Index edges = state.director.cols();
  std::array<std::optional<Lean>, T> leans;
  std::array<double, T> s{}, psi{};
  for (int t = 0; t < T; ++t) {
    const auto k = static_cast<std::size_t>(t);
    leans[k].emplace(rod, state, i, toward_m, t);
    s[k] = leans[k]->s;
    psi[k] = 0.5 * (state.theta[t * edges + i - 1] + state.theta[t * edges + i]);
  }
  const Vec3 u = leans[0]->u;
  const NodeBend<T> bend(tools, i, rod.bend[i], 0.5 * u.squaredNorm(), s, psi);
  const double a = rod.per_length[i - 1], c = rod.per_length[i];
  add_edge_gradient(i, (-bend.first[0] * a) * u, (bend.first[0] * c) * u, sink);
  for (int t = 0; t < T; ++t) {
    OneTool<Sink> own{sink, t};
    add_lean(*leans[static_cast<std::size_t>(t)], bend.first[1 + t], 0.0, own);
    const double by_psi = 0.5 * bend.first[1 + T + t];
    own.gradient_theta(i - 1, by_psi);
    own.gradient_theta(i, by_psi);
  }
  if constexpr (Sink::kHessian) {
    const Mat3 I = bend.first[0] * Mat3::Identity();
    add_edge_hessian(i, a * a * I, -a * c * I, c * c * I, sink);
    NodeJacobian<T> J;
    J.rows.template block<1, 3>(0, 0) = -a * u.transpose();
    J.rows.template block<1, 3>(0, 3) = c * u.transpose();
    for (int t = 0; t < T; ++t) {
      const LeanSlopes slopes(*leans[static_cast<std::size_t>(t)]);
      J.rows.template block<1, 3>(1 + t, 0) = slopes.s_a.transpose();
      J.rows.template block<1, 3>(1 + t, 3) = slopes.s_b.transpose();
      J.rows(1 + t, NodeJacobian<T>::theta_a(t)) = slopes.s_theta_a;
      J.rows(1 + t, NodeJacobian<T>::theta_b(t)) = slopes.s_theta_b;
      J.rows(1 + T + t, NodeJacobian<T>::theta_a(t)) = 0.5;
      J.rows(1 + T + t, NodeJacobian<T>::theta_b(t)) = 0.5;
    }
    J.add(i, true, true, bend.second, sink);
  }
  return bend.energy;
}

/// The same between an end's edge and the tangent that is held there, or at a free tip, which has
/// no bend but the tools' mutual energy.
template <int T, class Sink>
double add_tool_end(const Problem& problem, const RodState& state, bool proximal, Sink& sink) {
  const Rod& rod = *problem.rod;
  const ToolTerms& tools = *problem.tools;
  const int node = proximal ? 0 : rod.nodes() - 1, edge = proximal ? 0 : node - 1;
  const std::optional<Vec3>& tangent = (proximal ? problem.proximal : problem.distal).tangent;
  if (tools.is_straight(node)) return 0.0;
  const Eigen::Index edges = state.director.cols();
  const Vec3 w = tangent ? (proximal ? Vec3(-*tangent) : *tangent) : Vec3(Vec3::Zero());
  std::array<Edge, T> at;
  std::array<double, T> s{}, psi{};
  for (int t = 0; t < T; ++t) {
    const auto k = static_cast<std::size_t>(t);
    at[k] = edge_at(state, edge, t);
    s[k] = w.dot(at[k].m);
    psi[k] = state.theta[t * edges + edge];
  }
  const double per = rod.per_length[edge];
  const Vec3 e = state.x.col(edge + 1) - state.x.col(edge);
  const Vec3 u = tangent ? Vec3(per * e - *tangent) : Vec3(Vec3::Zero());
  const double B = !tangent ? 0.0 : proximal ? rod.proximal_bend : rod.distal_bend;
  const NodeBend<T> bend(tools, node, B, 0.5 * u.squaredNorm(), s, psi);
  const Vec3 g = (bend.first[0] * per) * u;
  sink.gradient(edge, -g);
  sink.gradient(edge + 1, g);
  for (int t = 0; t < T; ++t) {
    const auto k = static_cast<std::size_t>(t);
    OneTool<Sink> own{sink, t};
    add_clamp_lean(edge, at[k], w, toward_m(at[k]), bend.first[1 + t], 0.0, own);
    own.gradient_theta(edge, bend.first[1 + T + t]);
  }
  if constexpr (Sink::kHessian) {
    const Mat3 I = (bend.first[0] * per * per) * Mat3::Identity();
    sink.hessian(edge, edge, I);
    sink.hessian(edge + 1, edge + 1, I);
    sink.hessian(edge + 1, edge, -I);
    NodeJacobian<T> J;
    const int x = proximal ? 3 : 0;
    J.rows.template block<1, 3>(0, x) = per * u.transpose();
    for (int t = 0; t < T; ++t) {
      const Edge& own = at[static_cast<std::size_t>(t)];
      const int theta = proximal ? NodeJacobian<T>::theta_b(t) : NodeJacobian<T>::theta_a(t);
      J.rows.template block<1, 3>(1 + t, x) = -(w.dot(own.t) / own.length) * own.m.transpose();
      J.rows(1 + t, theta) = w.dot(own.n);
      J.rows(1 + T + t, theta) = 1.0;
    }
    J.add(node, !proximal, proximal, bend.second, sink);
  }
  return bend.energy;
}

/// See add_tools(); of T twisted ones.
template <int T, class Sink>
void add_twisted_tools(const Problem& problem, const RodState& state, const TwistChain& chain,
                       Sink& sink, Energy& energy) {
  const ToolTerms& tools = *problem.tools;
  const int n = problem.rod->nodes();
  const Eigen::Index edges = state.director.cols();
  for (int i = std::max(1, problem.first - 1); i <= std::min(n - 2, problem.last); ++i) {
    if (chain.skips(i)) continue;  // it is straight too
    for (int t = 0; t < T; ++t) {
      OneTool<Sink> own{sink, t};
      energy.twist += add_twist(tools.twist(t, i), state, i, own, t);
    }
    energy.bend += add_tool_bend<T>(problem, state, i, sink);
  }
  if (problem.last == n) energy.bend += add_tool_end<T>(problem, state, false, sink);
  if (problem.first > 0) return;
  energy.bend += add_tool_end<T>(problem, state, true, sink);
  if (chain.exists()) return;
  for (int t = 0; t < T; ++t) {  // the straight part behind the introducer
    const double angle = state.theta[t * edges] - tools.roll[t];
    sink.gradient_theta(0, tools.lead[t] * angle, t);
    if constexpr (Sink::kHessian) sink.hessian_theta_theta(0, 0, tools.lead[t], t, t);
    energy.twist += 0.5 * tools.lead[t] * angle * angle;
  }
}

/// All that the tools add to the rod but the twist of a chain, and the energy that no shape
/// changes.
template <class Sink>
void add_tools(const Problem& problem, const RodState& state, const TwistChain& chain, Sink& sink,
               Energy& energy) {
  static_assert(kMostTools == 3);
  energy.bend += problem.tools->stored;
  switch (problem.tools->twists()) {
    case 1:
      return add_twisted_tools<1>(problem, state, chain, sink, energy);
    case 2:
      return add_twisted_tools<2>(problem, state, chain, sink, energy);
    case 3:
      return add_twisted_tools<3>(problem, state, chain, sink, energy);
    default:
      return;
  }
}

}  // namespace wireplan::simulate
