#pragma once
/// How far a step goes: the energy along it, and steps that turn edges.
#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/equilibrium/problem.h"
#include "simulate/wire/bend_to.h"
#include "simulate/wire/quartic.h"

namespace wireplan::simulate {

/// Energy along a step as far as it is a polynomial: all but contact, twist and moments.
template <int D>
Quartic elastic_along(const Problem& problem, const RodState& state, const Eigen::VectorXd& step) {
  const Rod& rod = *problem.rod;
  const int n = rod.nodes();
  const auto move = [&](int i) -> Vec3 {
    if (i < problem.first || i >= problem.last) return Vec3::Zero();
    return step.segment<3>(D * (i - problem.first));
  };
  Quartic q;
  for (int i = std::max(0, problem.first - 1); i <= std::min(n - 2, problem.last - 1); ++i) {
    const double l = rod.rest_length[i], k = rod.stretch[i] / (8.0 * l * l * l);
    const Vec3 e = state.x.col(i + 1) - state.x.col(i), p = move(i + 1) - move(i);
    const double A = e.squaredNorm() - l * l, B = 2.0 * e.dot(p), C = p.squaredNorm();
    q.a1 += k * 2.0 * A * B;
    q.a2 += k * (B * B + 2.0 * A * C);
    q.a3 += k * 2.0 * B * C;
    q.a4 += k * C * C;
  }
  const auto add_quadratic = [&q](double B, const Vec3& u, const Vec3& p) {
    q.a1 += B * u.dot(p);
    q.a2 += 0.5 * B * p.squaredNorm();
  };
  for (int i = std::max(1, problem.first - 1); i <= std::min(n - 2, problem.last); ++i) {
    const double a = 1.0 / rod.rest_length[i - 1], c = 1.0 / rod.rest_length[i], b = -(a + c);
    add_quadratic(rod.twisted ? rod.bend[i] * std::cos(rod.rest_angle[i]) : rod.bend[i],
                  a * state.x.col(i - 1) + b * state.x.col(i) + c * state.x.col(i + 1),
                  a * move(i - 1) + b * move(i) + c * move(i + 1));
  }
  const auto add_end = [&](int edge, double B, const Vec3& tangent) {
    const double l = rod.rest_length[edge];
    add_quadratic(B, (state.x.col(edge + 1) - state.x.col(edge)) / l - tangent,
                  (move(edge + 1) - move(edge)) / l);
  };
  if (problem.first == 0 && problem.proximal.tangent) {
    add_end(0, rod.proximal_bend, *problem.proximal.tangent);
  }
  if (problem.last == n && problem.distal.tangent) {
    add_end(n - 2, rod.distal_bend, *problem.distal.tangent);
  }
  if (problem.load != nullptr) {
    for (int i = problem.first; i < problem.last; ++i) q.a1 -= problem.load->col(i).dot(move(i));
  }
  return q;
}

/// A twisted rod's directors are carried along by parallel transport, which is lost where an edge
/// turns back: no edge changes by more than half of its length in one step.
template <int D>
double largest_turning_step(const Problem& problem, const Eigen::VectorXd& step) {
  double cap = std::numeric_limits<double>::infinity();
  for (int i = problem.first; i + 1 < problem.last; ++i) {
    const int k = D * (i - problem.first);
    const double change = (step.segment<3>(k + D) - step.segment<3>(k)).norm();
    const double allowed = 0.5 * problem.rod->rest_length[i];
    if (change > allowed) cap = std::min(cap, allowed / change);
  }
  return cap;
}

/// The step with second-order lengthening taken out: each edge gets the direction that the step
/// gives it, and the length whose tension is the one that the step predicts to first order. Nodes
/// are laid out anew from the proximal end; what that moves a held distal end by is taken back by
/// the least bending where that is a small part of the step, and else, or in a vessel, spread over
/// the wire. A step that turns stiff edges by an angle a would else stretch them by a^2/2, and
/// Newton would spend its iterations on undoing that.
template <int D>
void turn_edges(const Problem& problem, const RodState& state, const Eigen::VectorXd& step,
                double s, RodState& trial) {
  constexpr double kTangent = 1e-7;  // up to here the root is its tangent, to 1e-15
  const Rod& rod = *problem.rod;
  const int n = rod.nodes();
  const auto move = [&](int i) -> Vec3 {
    if (i < problem.first || i >= problem.last) return Vec3::Zero();
    return s * step.segment<3>(D * (i - problem.first));
  };
  const int start = std::max(0, problem.first - 1), end = std::min(n - 1, problem.last);
  trial.x.col(start) = state.x.col(start) + move(start);
  for (int i = start; i < end; ++i) {
    const Vec3 e = state.x.col(i + 1) - state.x.col(i), p = move(i + 1) - move(i);
    const Vec3 turned = e + p;
    // The length that it gets is sqrt(|turned|^2 - |p|^2).
    const double change = p.squaredNorm() * rod.per_length[i] * rod.per_length[i];
    double part = 1.0 - 0.5 * change;
    if (change > kTangent) {
      const double smallest = 0.25 * rod.rest_length[i] * rod.rest_length[i];
      part = std::sqrt(std::max(smallest, e.squaredNorm() + 2.0 * e.dot(p)) / turned.squaredNorm());
    }
    trial.x.col(i + 1) = trial.x.col(i) + part * turned;
  }
  const bool held = problem.last < n || problem.distal.hold_along || problem.distal.hold_across;
  if (held) {
    if (start == 0 && end == n - 1 && problem.contact == nullptr) {
      double most_turned = 0.0;  // of an edge, to first order                           [rad]
      for (int i = 0; i < end; ++i) {
        most_turned = std::max(most_turned, (move(i + 1) - move(i)).norm() * rod.per_length[i]);
      }
      const DirectedEnds ends{problem.proximal.tangent.has_value(),
                              problem.distal.tangent.has_value()};
      bend_end_to(rod, ends, state.x.col(end) + move(end), most_turned, trial.x);
    }
    const Vec3 gap = state.x.col(end) + move(end) - trial.x.col(end);
    for (int i = start; i <= end; ++i) trial.x.col(i) += (double(i - start) / (end - start)) * gap;
  }
}

}  // namespace wireplan::simulate
