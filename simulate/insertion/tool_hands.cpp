// What the hands feel, of ToolBench.
#include <algorithm>
#include <cmath>

#include "simulate/insertion/tool_bench.h"

namespace wireplan::simulate {
namespace {

/// Of differences by insertion: with 1e-3 the stretch of an edge, whose energy is no parabola,
/// makes an error of 1e-4 N [mm].
constexpr double kInsertionStep = 1e-5;

bool level(const ToolPlace& a, const ToolPlace& b) {
  return std::abs(a.insertion - b.insertion) < 2.0 * kInsertionStep;
}

}  // namespace

/// Energy of the nodes where they are, with the tools at other places.
double ToolBench::energy_at(const State& at, const std::vector<ToolPlace>& places) const {
  State other;
  place(places, other);
  if (other.contact != nullptr) other.contact->restore(at.contact->memory());
  Eigen::Matrix3Xd unused(3, at.state.x.cols());
  return Statics::evaluate(problem_of(other), at.state, unused).total();
}

/// Whether the energy has one slope along a push: no tip passes one that is level with it, and no
/// tool is at an end.
bool ToolBench::is_smooth(const State& at, const std::vector<double>& push) const {
  for (std::size_t i = 0; i < push.size(); ++i) {
    if (push[i] == 0.0) continue;
    const double here = at.places[i].insertion, length = scene_.tools[i].wire.length();
    if (here < 2.0 * kInsertionStep || here > length - 2.0 * kInsertionStep) return false;
    for (std::size_t k = 0; k < push.size(); ++k) {
      if (push[k] != push[i] && level(at.places[i], at.places[k])) return false;
    }
  }
  return true;
}

/// What the energy gains, all nodes held, per part of a push of all tools: by differences in both
/// directions, or, where it is not smooth, in that of `side`.
double ToolBench::slope_along(const State& at, const std::vector<double>& push, double side) const {
  double most = 0.0;
  for (const double one : push) most = std::max(most, std::abs(one));
  if (most == 0.0) return 0.0;
  const double h = kInsertionStep / most;
  const auto energy = [&](double by) {
    std::vector<ToolPlace> places = at.places;
    for (std::size_t i = 0; i < places.size(); ++i) places[i].insertion += by * push[i];
    return energy_at(at, places);
  };
  if (is_smooth(at, push)) return (energy(h) - energy(-h)) / (2.0 * h);
  return side * (4.0 * energy(side * h) - energy(2.0 * side * h) - 3.0 * energy(0.0)) / (2.0 * h);
}

/// The way, forward or back, in which a push of one tool alone is to be felt: that in which it
/// moves past tips that are level with its own, or can move at all; 0: either.
double ToolBench::side_of(const State& at, std::size_t tool, const ToolMove& direction) const {
  const double here = at.places[tool].insertion;
  if (here < 2.0 * kInsertionStep) return 1.0;
  if (here > scene_.tools[tool].wire.length() - 2.0 * kInsertionStep) return -1.0;
  for (std::size_t k = 0; k < at.places.size(); ++k) {
    const double past = direction.push[tool] - direction.push[k];
    if (past != 0.0 && level(at.places[tool], at.places[k])) return std::copysign(1.0, past);
  }
  return 0.0;
}

/// How far the foremost tip goes per length of push of a tool.
double ToolBench::leads(const State& at, std::size_t tool, double side) const {
  double as_far = 1.0;
  for (std::size_t k = 0; k < at.places.size(); ++k) {
    if (k == tool) continue;
    if (level(at.places[tool], at.places[k])) {
      if (side < 0.0) return 0.0;
      as_far += side == 0.0 ? 1.0 : 0.0;
    } else if (at.places[k].insertion > at.places[tool].insertion) {
      return 0.0;
    }
  }
  return 1.0 / as_far;
}

/// After an equilibrium: what went into friction with the wall since the last one, and what of it
/// the hands did as they slid tools past nodes [N mm].
double ToolBench::rub(const Eigen::VectorXd& slides, State& at, double& by_hands) {
  if (at.contact == nullptr) return 0.0;
  at.contact->find_rubbed(rubbed_);
  at.contact->settle();
  double rubbed = 0.0;
  for (const RubbedPoint& one : rubbed_) {
    const ContactPoint& point = at.contact->point(one.point);
    const Eigen::Index i = point.edge + (point.part > 0.5);
    rubbed += one.work;
    const Eigen::Index edge = std::min(i, at.state.x.cols() - 2);
    by_hands -= slides[i] * one.force.dot(edge_tangent(now_.state, edge));
  }
  return rubbed;
}

void ToolBench::find_energy(State& at) const {
  Eigen::Matrix3Xd unused(3, at.state.x.cols());
  at.energy = Statics::evaluate(problem_of(at), at.state, unused);
  if (at.contact != nullptr) at.touches = at.contact->touches();
  at.torque.assign(scene_.tools.size(), 0.0);
  const ToolTerms& terms = at.composite.terms;
  const Eigen::Index edges = at.state.x.cols() - 1;
  for (int t = 0; t < terms.twists(); ++t) {
    at.torque[static_cast<std::size_t>(terms.tool[static_cast<std::size_t>(t)])] =
        terms.lead[t] * (terms.roll[t] - at.state.theta[t * edges]);
  }
}

/// Of a node that touches, the part where a tool is the outermost.
double ToolBench::outside_part(const State& at, std::size_t tool, const Touch& touch) {
  return at.composite.outside(static_cast<Eigen::Index>(tool), touch.edge + (touch.part > 0.5));
}

/// The forces on the tools one by one. The wall's friction is against what slides past nodes: the
/// tool there, less what nodes go with the foremost tip.
void ToolBench::feel(State& at, const ToolMove& direction) const {
  const std::size_t count = scene_.tools.size();
  at.force.assign(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    const double side = side_of(at, i, direction);
    std::vector<double> alone(count, 0.0);
    alone[i] = 1.0;
    // Of two slopes that differ the mean: the sum of all tools' is then the slope along all.
    at.force[i] = side != 0.0 ? slope_along(at, alone, side)
                              : 0.5 * (slope_along(at, alone, 1.0) + slope_along(at, alone, -1.0));
    const double lead = leads(at, i, side);
    const Eigen::Index edges = at.state.x.cols() - 1;
    for (const Touch& touch : at.touches) {
      const Eigen::Index edge = std::min<Eigen::Index>(touch.edge, edges - 1);
      const double slides = outside_part(at, i, touch) -
                            lead * (touch.edge + touch.part) / static_cast<double>(edges);
      at.force[i] -= slides * touch.friction.dot(edge_tangent(at.state, edge));
    }
  }
}

}  // namespace wireplan::simulate
