#pragma once
/// Where a wire is straight at rest and round, nothing but twist depends on the thetas of its
/// edges, and in equilibrium all of it carries one torque. Those thetas are then no unknowns: the
/// free part of the wire up to its first shaped node is one torsion spring. Part of solver.cpp.
#include <Eigen/Core>
#include <Eigen/LU>

#include "simulate/rod.h"

namespace wireplan::simulate {

/// W = k/2 psi^2, psi = theta of edge `last` - theta of edge first-1 + reference twist at the nodes
/// from `first` to `last`, 1/k the sum of their 1/T. During a solve the directors of the edges
/// first..last-1 follow those behind without twist and are not kept: the reference twist of all the
/// nodes is that of node `last`.
struct TwistChain {
  int first = 0, last = -1;  // none where last <= first
  double stiffness = 0.0;    // k                                                       [N mm]

  bool exists() const { return last > first; }
  bool has(int node) const { return exists() && node >= first && node <= last; }
  int edges() const { return exists() ? last - first : 0; }  // whose thetas are no unknowns
  double angle(const RodState& state) const {
    return state.theta[last] - state.theta[first - 1] + state.reference_twist[last];
  }
  double energy(const RodState& state) const {
    const double psi = exists() ? angle(state) : 0.0;
    return 0.5 * stiffness * psi * psi;
  }
};

/// The chain of a wire whose nodes are free from `first`, which is past an introducer, to its tip.
inline TwistChain find_chain(const Rod& rod, int first) {
  TwistChain chain;
  chain.first = first;
  chain.last = first - 1;
  while (chain.last < rod.nodes() - 2 && rod.rest_angle[chain.last + 1] == 0.0 &&
         rod.strip[chain.last + 1] == 0.0) {
    ++chain.last;
  }
  if (!chain.exists()) return {};
  double compliance = 0.0;
  for (int i = chain.first; i <= chain.last; ++i) compliance += 1.0 / rod.twist[i];
  chain.stiffness = 1.0 / compliance;
  return chain;
}

/// Takes the reference twist of the chain's nodes together at its last one.
inline void gather_chain(const TwistChain& chain, RodState& state) {
  for (int i = chain.first; i < chain.last; ++i) {
    state.reference_twist[chain.last] += state.reference_twist[i];
    state.reference_twist[i] = 0.0;
  }
}

/// Gives the chain's edges their directors and thetas: one torque all along.
inline void spread_chain(const TwistChain& chain, const Rod& rod, RodState& state) {
  if (!chain.exists()) return;
  const double torque = chain.stiffness * chain.angle(state);
  const auto tangent = [&](int e) -> Vec3 {
    return (state.x.col(e + 1) - state.x.col(e)).normalized();
  };
  Vec3 before = tangent(chain.first - 1);
  for (int e = chain.first; e < chain.last; ++e) {
    const Vec3 t = tangent(e);
    Vec3 d = parallel_transport(state.director.col(e - 1), before, t);
    d -= d.dot(t) * t;
    state.director.col(e) = d.normalized();
    state.theta[e] = state.theta[e - 1] + torque / rod.twist[e];
    before = t;
  }
}

/// Solves with a banded matrix A that has been factored and what add_chain() left out of it:
/// H = A + k ((p + e)(p + e)' - e e'), e the last theta's unit vector, p psi's derivatives with the
/// nodes (Sherman, Morrison and Woodbury).
class CoupledChain {
 public:
  Eigen::VectorXd psi;  // p

  /// v <- H^-1 v, A having been factored anew. `theta`: place of the last theta. Returns false
  /// where H is not positive definite.
  template <class Band>
  bool solve(const TwistChain& chain, const Band& factored, Eigen::Index theta,
             Eigen::VectorXd& v) {
    exists_ = chain.exists();
    if (!exists_) {
      factored.solve(v);
      return true;
    }
    theta_ = theta;
    together_ = psi;
    together_[theta] += 1.0;
    by_together_ = together_;
    by_theta_.setZero(psi.size());
    by_theta_[theta] = 1.0;
    factored.template solve<3>({v.data(), by_together_.data(), by_theta_.data()});
    Eigen::Matrix2d inner;
    inner << 1.0 / chain.stiffness + together_.dot(by_together_), together_.dot(by_theta_),
        by_together_[theta], by_theta_[theta] - 1.0 / chain.stiffness;
    inverse_ = inner.inverse();
    correct(v);
    // A is positive definite; H is if the inner matrix has an eigenvalue of either sign
    // (Haynsworth).
    return inner.determinant() < 0.0;
  }
  /// v <- H^-1 A v.
  void correct(Eigen::VectorXd& v) const {
    if (!exists_) return;
    const Eigen::Vector2d share = inverse_ * Eigen::Vector2d(together_.dot(v), v[theta_]);
    v -= share[0] * by_together_ + share[1] * by_theta_;
  }

 private:
  bool exists_ = false;
  Eigen::Index theta_ = 0;
  Eigen::VectorXd together_, by_together_, by_theta_;
  Eigen::Matrix2d inverse_;
};

}  // namespace wireplan::simulate
