// What the hands feel, of ToolBench.
#include <algorithm>
#include <array>
#include <cmath>

#include "simulate/insertion/tool_bench.h"

namespace wireplan::simulate {
namespace {

/// Of differences by insertion: with 1e-3 the stretch of an edge, whose energy is no parabola,
/// makes an error of 1e-4 N [mm].
constexpr double kInsertionStep = 1e-5;

/// A push of one tool.
std::array<double, kMostTools> alone_of(std::size_t tool) {
  std::array<double, kMostTools> push{};
  push[tool] = 1.0;
  return push;
}

bool level(const ToolPlace& a, const ToolPlace& b) {
  return std::abs(a.insertion - b.insertion) < 2.0 * kInsertionStep;
}

}  // namespace

/// Energy of the nodes where they are, with the tools pushed on by so much of `push`, and no
/// further than to their ends. That of
/// contact to first order: the nodes' lengths of tools and how thick these are are all that changes
/// there, since a wall that yields lies where its energy and that of contact are least.
double ToolBench::energy_at(const State& at, Pushes push, double by) {
  pushed_ = at.places;
  for (std::size_t i = 0; i < pushed_.size(); ++i) {
    pushed_[i].insertion =
        std::clamp(pushed_[i].insertion + by * push[i], 0.0, scene_.tools[i].wire.length());
  }
  build_composite(scene_.tools, pushed_, elements_, other_);
  const Rod& rod = other_.rod;
  Problem problem = problem_of(at);
  problem.rod = &rod;
  if (problem.tools != nullptr) problem.tools = &other_.terms;
  problem.contact = nullptr;
  set_load(pushed_, rod, other_load_);
  problem.load = &other_load_;
  double energy = Statics::energy(problem, at.state);
  for (const WallContact::Slope& press : at.presses) {  // a point each node
    energy += press.by_share * rod.share[press.point] + press.by_thinner * rod.thinner[press.point];
  }
  return energy;
}

/// Whether the energy has one slope along a push: no tip passes one that is level with it, and no
/// tool is at an end.
bool ToolBench::is_smooth(const State& at, Pushes push) const {
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
double ToolBench::slope_along(const State& at, Pushes push, double side) {
  double most = 0.0;
  for (const double one : push) most = std::max(most, std::abs(one));
  if (most == 0.0) return 0.0;
  const double h = kInsertionStep / most;
  const auto energy = [&](double by) { return energy_at(at, push, by); };
  if (is_smooth(at, push)) return (energy(h) - energy(-h)) / (2.0 * h);
  return side * (4.0 * energy(side * h) - energy(2.0 * side * h) - 3.0 * energy(0.0)) / (2.0 * h);
}

/// The slopes along pushes of each tool alone: of those that move and of those that rub in another,
/// or of all.
void ToolBench::find_slopes(State& at, const ToolMove& direction, bool all) {
  const std::size_t count = scene_.tools.size();
  at.slope.assign(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    if (!all && direction.push[i] == 0.0 && (i == 0 || scene_.friction == 0.0)) continue;
    const std::array<double, kMostTools> alone = alone_of(i);
    const Pushes push(alone.data(), count);
    const double side = side_of(at, i, direction);
    // Of two slopes that differ the mean: the sum of all tools' is then the slope along all.
    at.slope[i] = side != 0.0 || is_smooth(at, push)
                      ? slope_along(at, push, side)
                      : 0.5 * (slope_along(at, push, 1.0) + slope_along(at, push, -1.0));
  }
}

/// The slope along the pushes of a move, once those of its tools are found.
double ToolBench::slope_of_move(const State& at, const ToolMove& by, double side) {
  double sum = 0.0;
  for (std::size_t i = 0; i < by.push.size(); ++i) {
    if (by.push[i] == 0.0) continue;
    const std::array<double, kMostTools> alone = alone_of(i);
    if (!is_smooth(at, Pushes(alone.data(), by.push.size()))) return slope_along(at, by.push, side);
    sum += by.push[i] * at.slope[i];
  }
  return sum;
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
  take_forces(at);
  if (contact_ == nullptr) return 0.0;
  contact_->find_rubbed(rubbed_);
  contact_->settle();
  at.memory = contact_->memory();
  double rubbed = 0.0;
  for (const RubbedPoint& one : rubbed_) {
    const ContactPoint& point = contact_->point(one.point);
    const Eigen::Index i = point.edge + (point.part > 0.5);
    rubbed += one.work;
    const Eigen::Index edge = std::min(i, at.state.x.cols() - 2);
    by_hands -= slides[i] * one.force.dot(edge_tangent(now_.state, edge));
  }
  return rubbed;
}

/// Of the latest sample: what wall and hands do to the tools.
void ToolBench::take_forces(State& at) {
  if (contact_ != nullptr) {
    at.touches = contact_->touches();
    contact_->find_slopes(at.presses);
  }
  at.torque.assign(scene_.tools.size(), 0.0);
  const ToolTerms& terms = at.composite.terms;
  const Eigen::Index edges = at.state.x.cols() - 1;
  for (int t = 0; t < terms.twists(); ++t) {
    at.torque[static_cast<std::size_t>(terms.tool[static_cast<std::size_t>(t)])] =
        terms.lead[t] * (terms.roll[t] - at.state.theta[t * edges]);
  }
}

/// By term, anew, and with it the forces: of a state that touched last.
Energy ToolBench::find_energy(State& at) {
  Eigen::Matrix3Xd unused(3, at.state.x.cols());
  const Energy energy = Statics::evaluate(problem_of(at), at.state, unused);
  at.energy = energy.total();
  take_forces(at);
  return energy;
}

/// Of a node that touches, the part where a tool is the outermost.
double ToolBench::outside_part(const State& at, std::size_t tool, const Touch& touch) {
  return at.composite.outside(static_cast<Eigen::Index>(tool), touch.edge + (touch.part > 0.5));
}

/// The forces on the tools one by one, once the slopes are found. The wall's friction is against
/// what slides past nodes: the tool there, less what nodes go with the foremost tip.
void ToolBench::feel(State& at, const ToolMove& direction) const {
  const std::size_t count = scene_.tools.size();
  at.force.assign(count, 0.0);
  const Eigen::Index edges = at.state.x.cols() - 1;
  for (std::size_t i = 0; i < count; ++i) {
    at.force[i] = at.slope[i];
    const double lead = leads(at, i, side_of(at, i, direction));
    for (const Touch& touch : at.touches) {
      const Eigen::Index edge = std::min<Eigen::Index>(touch.edge, edges - 1);
      const double slides = outside_part(at, i, touch) -
                            lead * (touch.edge + touch.part) / static_cast<double>(edges);
      at.force[i] -= slides * touch.friction.dot(edge_tangent(at.state, edge));
    }
  }
}

}  // namespace wireplan::simulate
