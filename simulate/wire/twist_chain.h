#pragma once
/// The straight round shaft of a twisted wire, or of the one tool of several that twists, as one
/// torsion spring. Where a wire is straight at rest and round, nothing but its twist depends on the
/// thetas of its edges, and in equilibrium all of it carries one torque. So these thetas are no
/// unknowns: one spring stands for the free part of the wire up to its first node that is curved or
/// a strip. Used by Newton's method.
#include <Eigen/Core>
#include <Eigen/LU>
#include <limits>

#include "simulate/wire/block_band.h"
#include "simulate/wire/rod.h"
#include "simulate/wire/tool_stack.h"

namespace wireplan::simulate {

/// The spring's energy is W = k/2 psi^2. Its angle psi is theta of edge `last` minus that of where
/// it begins, plus the reference twist at the nodes `first` to `last`; 1/k is the sum of these
/// nodes' 1/T. A wire's begins with theta of edge first-1, which is held; a tool's with its hub's
/// roll: 1/k has its lead's too then, and theta of edge first-1 is no unknown either. During a
/// solve the directors of the edges first to last-1 are not kept, since they follow the edge behind
/// them without twist. The reference twist of all these nodes then stands at node `last`.
///
/// A tool's tip is free: past its last curve it carries no torque, and the centreline of the others
/// goes on beyond it. So from edge `loose` on thetas are no unknowns either, nor are directors kept
/// or nodes twisted: edges turn with the one behind them.
struct TwistChain {
  int first = 0, last = -1;  // none where last <= first
  double stiffness = 0.0;    // k                                                       [N mm]
  double start = 0.0;        // theta that it begins with                                [rad]
  double lead = 0.0;         // of a tool, from its hub to edge first-1; else 0         [N mm]
  int loose = std::numeric_limits<int>::max();  // of a tool; else none is

  bool exists() const { return last > first; }
  bool has(int node) const { return exists() && node >= first && node <= last; }
  /// Whether the node has no term of its own.
  bool skips(int node) const { return has(node) || node >= loose; }
  int edges() const { return exists() ? last - first : 0; }     // that keep no director
  int without_theta() const { return edges() + (lead > 0.0); }  // whose thetas are no unknowns
  double angle(const RodState& state) const {
    return state.theta[last] - start + state.reference_twist[last];
  }
  double energy(const RodState& state) const {
    const double psi = exists() ? angle(state) : 0.0;
    return 0.5 * stiffness * psi * psi;
  }
};

/// Of the nodes from chain.first on that are straight, as springs in series.
template <class IsStraight, class Twist>
TwistChain as_long_as(TwistChain chain, int nodes, const IsStraight& is_straight,
                      const Twist& twist) {
  chain.last = chain.first - 1;
  while (chain.last < nodes - 2 && is_straight(chain.last + 1)) ++chain.last;
  if (!chain.exists()) return {};
  double compliance = chain.lead > 0.0 ? 1.0 / chain.lead : 0.0;
  for (int i = chain.first; i <= chain.last; ++i) compliance += 1.0 / twist(i);
  chain.stiffness = 1.0 / compliance;
  return chain;
}

/// The chain of a wire whose nodes are free from `first`, which is past an introducer, to its tip.
inline TwistChain find_chain(const Rod& rod, int first, const RodState& state) {
  return as_long_as(
      {.first = first, .start = state.theta[first - 1]}, rod.nodes(),
      [&](int i) { return rod.rest_angle[i] == 0.0 && rod.strip[i] == 0.0; },
      [&](int i) { return rod.twist[i]; });
}

/// The chain of the one tool that twists, whose nodes are free from the introducer's on.
inline TwistChain find_chain(const ToolTerms& tools) {
  const int nodes = static_cast<int>(tools.rest.cols());
  TwistChain chain;
  if (tools.is_straight(0)) {
    chain = as_long_as(
        {.first = 1, .start = tools.roll[0], .lead = tools.lead[0]}, nodes,
        [&](int i) { return tools.is_straight(i); }, [&](int i) { return tools.twist(0, i); });
  }
  int curved = nodes - 1;  // the last node that is
  while (curved >= 0 && tools.is_straight(curved)) --curved;
  if (curved >= 0) chain.loose = curved + 1;
  return chain;
}

/// Moves the reference twist of all the chain's nodes to its last one.
inline void gather_chain(const TwistChain& chain, RodState& state) {
  for (int i = chain.first; i < chain.last; ++i) {
    state.reference_twist[chain.last] += state.reference_twist[i];
    state.reference_twist[i] = 0.0;
  }
}

/// Gives the chain's edges their directors and thetas back, so that all carry one torque, and the
/// loose ones, which carry none; `twist(i)` is T of node i.
template <class Twist>
void spread_chain(const TwistChain& chain, const Twist& twist, RodState& state) {
  const auto tangent = [&](int e) -> Vec3 {
    return (state.x.col(e + 1) - state.x.col(e)).normalized();
  };
  const auto carry_on = [&](int from, int to, double torque) {
    if (to <= from) return;
    Vec3 before = tangent(from - 1);
    for (int e = from; e < to; ++e) {
      const Vec3 t = tangent(e);
      Vec3 d = parallel_transport(state.director.col(e - 1), before, t);
      d -= d.dot(t) * t;
      state.director.col(e) = d.normalized();
      state.theta[e] = state.theta[e - 1] + torque / twist(e);
      before = t;
    }
  };
  if (chain.exists()) {
    const double torque = chain.stiffness * chain.angle(state);
    if (chain.lead > 0.0) state.theta[chain.first - 1] = chain.start + torque / chain.lead;
    carry_on(chain.first, chain.last, torque);
  }
  const int edges = static_cast<int>(state.director.cols());
  for (int e = chain.loose; e < edges; ++e) state.reference_twist[e] = 0.0;
  carry_on(chain.loose, edges, 0.0);
}

/// Solves with a banded matrix A = L D L' that has been factored and what add_chain() left out of
/// it: H = A + k ((p + e)(p + e)' - e e'), e the last theta's unit vector, p psi's derivatives with
/// the nodes (Sherman, Morrison and Woodbury). Between the halves of a solve with A, so that p + e
/// and e need the first half alone.
class CoupledChain {
 public:
  Eigen::VectorXd psi;  // p

  /// v <- H^-1 v, A having been factored anew. `theta`: block row of the last theta. Returns false
  /// where H is not positive definite.
  template <int D>
  bool solve_first(const TwistChain& chain, const BlockBand<D>& factored, int theta,
                   Eigen::VectorXd& v) {
    exists_ = chain.exists();
    if (!exists_) {
      factored.solve(v);
      return true;
    }
    const Eigen::Index place = D * theta + D - 1;
    together_ = psi;
    together_[place] += 1.0;
    theta_.setZero(psi.size());
    theta_[place] = 1.0;
    factored.template solve_lower<2>({v.data(), together_.data()});
    factored.template solve_lower<1>({theta_.data()}, theta);
    together_part_ = together_;
    theta_part_ = theta_;
    factored.divide_by_pivots(together_part_);
    factored.divide_by_pivots(theta_part_);
    const double mixed = together_.dot(theta_part_);
    Eigen::Matrix2d inner;
    inner << 1.0 / chain.stiffness + together_.dot(together_part_), mixed, mixed,
        theta_.dot(theta_part_) - 1.0 / chain.stiffness;
    inverse_ = inner.inverse();
    correct(v);
    factored.solve_upper(v);
    // A is positive definite; H is if the inner matrix has an eigenvalue of either sign
    // (Haynsworth).
    return inner.determinant() < 0.0;
  }
  /// v <- H^-1 v with the same matrix again.
  template <int D>
  void solve(const BlockBand<D>& factored, Eigen::VectorXd& v) const {
    factored.template solve_lower<1>({v.data()});
    if (exists_) correct(v);
    factored.solve_upper(v);
  }

 private:
  void correct(Eigen::VectorXd& v) const {
    const Eigen::Vector2d share =
        inverse_ * Eigen::Vector2d(together_part_.dot(v), theta_part_.dot(v));
    v -= share[0] * together_ + share[1] * theta_;
  }

  bool exists_ = false;
  Eigen::VectorXd together_, theta_;            // L^-1 (p + e), L^-1 e
  Eigen::VectorXd together_part_, theta_part_;  // D^-1 of those
  Eigen::Matrix2d inverse_;
};

}  // namespace wireplan::simulate
