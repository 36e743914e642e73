#include "simulate/insertion/tool_bench.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "simulate/wire/bend_to.h"

namespace wireplan::simulate {
namespace {

/// All chosen, but for the step of differences.
struct BenchTuning {
  double longest_push = 2.0;                // of a part of a move                             [mm]
  double largest_turn = 5.0 * kPi / 180.0;  //                                            [rad]
  double shortest = 1.0 / 16.0;             // of such a part, where it is cut
  double unbalanced = 0.02;                 // of the work of a part: more, and it is cut
  double least_work = 1e-7;                 // that counts so                                [N mm]
  double step = 1e-5;   // of differences by insertion: with 1e-3 the stretch of an edge, whose
                        // energy is no parabola, makes an error of 1e-4 N                  [mm]
  double nudge = 1e-3;  // of the tip of each tool but the first curved one, in a guess       [rad]
  int most_solves = 4;  // of a part that runs out of iterations, from where it got
  int load_steps = 10;  // where the full loads have no equilibrium at once
};
constexpr BenchTuning kBench;

double largest_insertion(const std::vector<ToolPlace>& places) {
  double longest = 0.0;
  for (const ToolPlace& place : places) longest = std::max(longest, place.insertion);
  return longest;
}

std::vector<ToolPlace> moved(std::vector<ToolPlace> places, const ToolMove& by, double part) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    places[i].insertion += part * by.push[i];
    places[i].roll += part * by.turn[i];
  }
  return places;
}

/// Elements as short as asked for even where the tools are furthest in.
int count_elements(const ToolScene& scene) {
  std::vector<ToolPlace> places = scene.places;
  double longest = largest_insertion(places);
  for (const ToolMove& move : scene.moves) {
    places = moved(places, move, 1.0);
    longest = std::max(longest, largest_insertion(places));
  }
  return std::max(4, static_cast<int>(std::ceil(longest / scene.element_length - 1e-9)));
}

Vec3 edge_tangent(const RodState& state, Eigen::Index e) {
  return (state.x.col(e + 1) - state.x.col(e)).normalized();
}

/// A list of values at the middles of edges of length h, at s; beyond the ends that of the ends.
template <class At>
auto between_middles(double s, double h, Eigen::Index edges, const At& at) {
  const double place = std::clamp(s / h - 0.5, 0.0, static_cast<double>(edges - 1));
  const Eigen::Index e = std::min(static_cast<Eigen::Index>(place), edges - 2);
  const double part = place - static_cast<double>(e);
  using Value = std::decay_t<decltype(at(e))>;
  return Value((1.0 - part) * at(e) + part * at(e + 1));
}

/// Straight tools whose end comes nearer to its start get the shape of a column that buckles;
/// unlike buckle_column() they bend the more, the softer they are.
void lean_aside(const Rod& rod, const Vec3& point, const std::optional<Vec3>& plane,
                BentWire& wire) {
  constexpr double kStraight = 1e-6;  // of the length
  const double length = rod.rest_length.sum();
  const Vec3 along = wire.edges.col(0).normalized();
  const double less = (wire.end() - point).dot(along);
  if (length - (wire.end() - wire.start).norm() > kStraight * length ||
      less <= kStraight * length) {
    return;
  }
  const Vec3 axis = plane ? *plane : along.cross(reference_normal(along));
  const auto compliance = [&](int i) { return rod.bend[i] > 0.0 ? 1.0 / rod.bend[i] : 0.0; };
  double total = 0.0, so_far = 0.0;
  for (int i = 0; i < rod.nodes(); ++i) total += compliance(i);
  const double most = 2.0 * std::sqrt(less / length);
  for (int i = 0; i + 1 < rod.nodes(); ++i) {
    so_far += compliance(i);
    wire.edges.col(i) =
        (rotation_by(most * std::sin(2.0 * kPi * so_far / total) * axis) * wire.edges.col(i))
            .eval();
  }
}

double edge_length_of(const Composite& composite) { return composite.rod.rest_length[0]; }

}  // namespace

ToolBench::ToolBench(const ToolScene& scene) : scene_(scene), elements_(count_elements(scene)) {
  expects(scene.places.size() == scene.tools.size() && scene.loads.tip_torque == 0.0);
  place(scene.places, now_);
  now_.state = unloaded(now_);
  const RodState start = now_.state;
  settled_ = solve(now_);
  if (!settled_) {
    now_.state = start;
    const Eigen::Matrix3Xd load = now_.load;
    for (int step = 1; step <= kBench.load_steps; ++step) {
      now_.load = (static_cast<double>(step) / kBench.load_steps) * load;
      settled_ = solve(now_);
      if (!settled_) break;
    }
  }
  const std::vector<double> none(scene.tools.size(), 0.0);
  feel(now_, {none, none});
  report({none, none});
}

bool ToolBench::move(const ToolMove& by) {
  expects(settled_ && by.push.size() == scene_.tools.size() && by.turn.size() == by.push.size());
  record_.iterations = 0;
  double parts = 1.0;
  for (std::size_t i = 0; i < by.push.size(); ++i) {
    parts = std::max({parts, std::ceil(std::abs(by.push[i]) / kBench.longest_push - 1e-9),
                      std::ceil(std::abs(by.turn[i]) / kBench.largest_turn - 1e-9)});
  }
  const double longest = 1.0 / parts, shortest = kBench.shortest * longest;
  feel(now_, by);  // where tips meet, the force hangs on which way they go
  const std::vector<ToolPlace> start = now_.places;
  double done = 0.0, size = longest;
  while (done < 1.0 - 1e-12) {
    const double part = 1.0 - done < 1.01 * size ? 1.0 - done : size;
    const bool may_cut = part > 1.01 * shortest;
    State next;
    place(moved(start, by, done + part), next);
    next.state = follow(now_, next);
    if (!solve(next)) {
      if (!may_cut) {
        report(by);
        return false;
      }
      size = 0.5 * part;
      continue;
    }
    feel(next, by);

    // The work of the hands against what the energy gained.
    double work = 0.0, scale = 0.0;
    for (std::size_t i = 0; i < by.push.size(); ++i) {
      const double push = 0.5 * part * by.push[i] * (now_.force[i] + next.force[i]);
      const double turn = 0.5 * part * by.turn[i] * (now_.torque[i] + next.torque[i]);
      work += push + turn;
      scale += std::abs(push) + std::abs(turn);
    }
    const double gained = next.energy.total() - now_.energy.total(), excess = work - gained;
    const bool jumped = std::abs(excess) > kBench.unbalanced * scale + kBench.least_work;
    if (jumped && may_cut) {
      size = 0.5 * part;
      continue;
    }
    now_ = std::move(next);
    const double released = jumped ? std::max(0.0, excess) : 0.0;
    record_.released += released;
    record_.unbalanced += excess - released;
    record_.work += gained + released;
    for (std::size_t i = 0; i + 1 < by.push.size(); ++i) {
      const ToolContact contact = find_contact(i, by);
      const double heat = part * (contact.friction_force * (by.push[i + 1] - by.push[i]) +
                                  contact.friction_torque * (by.turn[i + 1] - by.turn[i]));
      record_.heat += heat;
      record_.work += heat;
    }
    done += part;
    size = std::min(longest, 2.0 * part);
  }
  report(by);
  return true;
}

// ---------------------------------------------------------------- a state

Problem ToolBench::problem_of(const State& at) const {
  Problem problem;
  problem.rod = &at.composite.rod;
  problem.last = at.composite.rod.nodes();
  if (at.composite.terms.twists() > 0) problem.tools = &at.composite.terms;
  problem.proximal.hold_along = problem.proximal.hold_across = true;
  problem.proximal.tangent = scene_.direction;
  if (scene_.distal) {
    problem.distal.hold_along = problem.distal.hold_across = true;
    if (scene_.distal->kind == SupportKind::kClamped) {
      problem.distal.tangent = scene_.distal->direction;
    }
  }
  problem.load = &at.load;
  problem.plane = scene_.plane;
  const Vec3& moment = scene_.loads.tip_moment;
  if (!moment.isZero(0.0)) {
    problem.tip_moment = TipMoment{.axis = moment.normalized(), .size = moment.norm()};
  }
  return problem;
}

Problem ToolBench::problem() const { return problem_of(now_); }

void ToolBench::place(const std::vector<ToolPlace>& places, State& at) const {
  at.places = places;
  at.composite = build_composite(scene_.tools, places, elements_);
  at.load = scene_.loads.gravity * at.composite.rod.mass.transpose();
  at.load.rightCols<1>() += scene_.loads.tip_force;
}

/// As the tools lie together without loads, each in one plane with its hub.
RodState ToolBench::unloaded(const State& at) const {
  const Rod& rod = at.composite.rod;
  const ToolTerms& terms = at.composite.terms;
  RodState state = straight_state(rod, scene_.point, scene_.direction, 0.0);
  Vec3 t = scene_.direction, d = reference_normal(t);
  for (int i = 0; i + 1 < rod.nodes(); ++i) {
    Vec3 turn = Vec3::Zero();
    for (int k = 0; k < terms.twists(); ++k) {
      const Vec3 toward = std::cos(terms.roll[k]) * d + std::sin(terms.roll[k]) * t.cross(d);
      turn += terms.rest(k, i) * t.cross(toward);
    }
    const Mat3 rotation = rotation_by(turn);  // about an axis square to t: no twist
    t = rotation * t;
    d = rotation * d;
    state.x.col(i + 1) = state.x.col(i) + rod.rest_length[i] * t;
  }
  bend_to_support(at, state.x);
  std::vector<Eigen::VectorXd> angles;
  for (int k = 0; k < terms.twists(); ++k) {
    angles.push_back(Eigen::VectorXd::Constant(rod.nodes() - 1, terms.roll[k]));
  }
  set_frames(angles, state);
  return state;
}

/// The centreline of before, as much longer or shorter as it now is, and the tools' angles on it.
RodState ToolBench::follow(const State& from, const State& to) const {
  const double h = edge_length_of(from.composite), h_new = edge_length_of(to.composite);
  const Eigen::Index edges = from.state.x.cols() - 1;
  RodState state = from.state;
  if (h != h_new) {
    for (Eigen::Index e = 0; e < edges; ++e) {
      const Vec3 t = between_middles((static_cast<double>(e) + 0.5) * h_new, h, edges,
                                     [&](Eigen::Index k) { return edge_tangent(from.state, k); });
      state.x.col(e + 1) = state.x.col(e) + h_new * t.normalized();
    }
    bend_to_support(to, state.x);
  }
  std::vector<Eigen::VectorXd> angles_now;
  for (const int tool : from.composite.terms.tool) {
    const Eigen::VectorXd old = angles(tool);
    Eigen::VectorXd moved_angles(edges);
    for (Eigen::Index e = 0; e < edges; ++e) {
      moved_angles[e] = between_middles((static_cast<double>(e) + 0.5) * h_new, h, edges,
                                        [&](Eigen::Index k) { return old[k]; });
      // Tools that lie in one plane, curved to opposite sides, would stay so when that is a saddle.
      moved_angles[e] += kBench.nudge * static_cast<double>(angles_now.size()) *
                         static_cast<double>(e) / static_cast<double>(edges);
    }
    angles_now.push_back(moved_angles);
  }
  set_frames(angles_now, state);
  return state;
}

void ToolBench::bend_to_support(const State& to, Eigen::Matrix3Xd& x) const {
  if (!scene_.distal) return;
  const Rod& rod = to.composite.rod;
  const Eigen::Index edges = x.cols() - 1;
  const bool clamped = scene_.distal->kind == SupportKind::kClamped;
  BentWire wire{.start = x.col(0), .edges = x.rightCols(edges) - x.leftCols(edges)};
  wire.end_direction = wire.edges.col(edges - 1).normalized();
  lean_aside(rod, scene_.distal->point, scene_.plane, wire);
  bend_to(rod, {.start = true, .end = clamped}, scene_.distal->point, scene_.distal->direction,
          wire);
  for (Eigen::Index e = 0; e < edges; ++e) x.col(e + 1) = x.col(e) + wire.edges.col(e);
  // What that left is spread evenly.
  const Vec3 gap = scene_.distal->point - x.col(edges);
  for (Eigen::Index i = 1; i <= edges; ++i) {
    x.col(i) += (static_cast<double>(i) / static_cast<double>(edges)) * gap;
  }
}

/// Reference directors carried along from the introducer without twist, and the tools' angles.
void ToolBench::set_frames(const std::vector<Eigen::VectorXd>& angles, RodState& state) const {
  const Eigen::Index edges = state.x.cols() - 1;
  state.director.resize(3, edges);
  state.reference_twist = Eigen::VectorXd::Zero(edges + 1);
  Vec3 t = scene_.direction, d = reference_normal(t);
  for (Eigen::Index e = 0; e < edges; ++e) {
    const Vec3 next = edge_tangent(state, e);
    d = parallel_transport(d, t, next);
    d = (d - d.dot(next) * next).normalized();
    state.director.col(e) = d;
    t = next;
  }
  state.theta.resize(edges * static_cast<Eigen::Index>(angles.size()));
  for (std::size_t k = 0; k < angles.size(); ++k) {
    state.theta.segment(static_cast<Eigen::Index>(k) * edges, edges) = angles[k];
  }
}

Eigen::VectorXd ToolBench::angles(int tool) const {
  const std::vector<int>& twisted = now_.composite.terms.tool;
  const auto found = std::find(twisted.begin(), twisted.end(), tool);
  if (found == twisted.end()) return {};
  const RodState& state = now_.state;
  const Eigen::Index edges = state.x.cols() - 1;
  const Vec3 t = edge_tangent(state, 0);
  const Vec3 zero = parallel_transport(reference_normal(scene_.direction), scene_.direction, t);
  const Vec3 d = state.director.col(0);
  double turned = std::atan2(zero.cross(d).dot(t), zero.dot(d));
  Eigen::VectorXd result = state.theta.segment((found - twisted.begin()) * edges, edges);
  for (Eigen::Index e = 0; e < edges; ++e) {
    if (e > 0) turned += state.reference_twist[e];
    result[e] += turned;
  }
  return result;
}

bool ToolBench::solve(State& at) {
  NewtonResult found;
  for (int k = 0; k < kBench.most_solves && !found.converged; ++k) {
    found = statics_.solve(
        problem_of(at), at.state,
        {.residual_tolerance = scene_.residual_tolerance, .max_iterations = scene_.max_iterations});
    record_.iterations += found.iterations;
    if (found.iterations < scene_.max_iterations) break;
  }
  record_.residual = found.residual;
  return found.converged;
}

// ---------------------------------------------------------------- what the hands feel

double ToolBench::energy_at(const State& at, const std::vector<ToolPlace>& places) const {
  State other;
  place(places, other);
  Eigen::Matrix3Xd unused(3, at.state.x.cols());
  return Statics::evaluate(problem_of(other), at.state, unused).total();
}

/// By differences in both directions, or, where the energy has a kink or the tool an end, in one.
double ToolBench::force_on(const State& at, std::size_t tool, double direction) const {
  const double h = kBench.step, here = at.places[tool].insertion;
  const auto energy = [&](double by) {
    std::vector<ToolPlace> places = at.places;
    places[tool].insertion += by;
    return energy_at(at, places);
  };
  bool kink = false;
  for (std::size_t k = 0; k < at.places.size(); ++k) {
    kink = kink || (k != tool && std::abs(at.places[k].insertion - here) < 2.0 * h);
  }
  double side = kink ? std::copysign(1.0, direction) : 0.0;
  if (here < 2.0 * h) side = 1.0;
  if (here > scene_.tools[tool].wire.length() - 2.0 * h) side = -1.0;
  if (side == 0.0) return (energy(h) - energy(-h)) / (2.0 * h);
  return side * (4.0 * energy(side * h) - energy(2.0 * side * h) - 3.0 * energy(0.0)) / (2.0 * h);
}

void ToolBench::feel(State& at, const ToolMove& direction) const {
  Eigen::Matrix3Xd unused(3, at.state.x.cols());
  at.energy = Statics::evaluate(problem_of(at), at.state, unused);
  const std::size_t count = scene_.tools.size();
  at.force.assign(count, 0.0);
  at.torque.assign(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    double relative = direction.push[i];  // against what its tip may meet
    for (std::size_t k = 0; k < count && relative == 0.0; ++k) relative -= direction.push[k];
    at.force[i] = force_on(at, i, relative);
  }
  const ToolTerms& terms = at.composite.terms;
  const Eigen::Index edges = at.state.x.cols() - 1;
  for (int t = 0; t < terms.twists(); ++t) {
    at.torque[static_cast<std::size_t>(terms.tool[static_cast<std::size_t>(t)])] =
        terms.lead[t] * (terms.roll[t] - at.state.theta[t * edges]);
  }
}

double ToolBench::free_force(int tool) const {
  return now_.force.at(static_cast<std::size_t>(tool));
}

/// Of a tool at the nodes, (3, n): EI times how much it is bent away from its natural curve [N mm].
Eigen::Matrix3Xd ToolBench::moments(int tool) const {
  const RodState& state = now_.state;
  const Rod& rod = now_.composite.rod;
  const Eigen::Index n = state.x.cols();
  const Wire& wire = scene_.tools[static_cast<std::size_t>(tool)].wire;
  const double insertion = now_.places[static_cast<std::size_t>(tool)].insertion;
  const Eigen::VectorXd angle = angles(tool);
  Eigen::Matrix3Xd moment = Eigen::Matrix3Xd::Zero(3, n);
  Vec3 t_a = scene_.direction, d = reference_normal(t_a);
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    const Vec3 t_b = edge_tangent(state, i);
    const ToolSpot spot = look_at(wire, insertion - static_cast<double>(i) * rod.rest_length[0]);
    d = parallel_transport(d, t_a, t_b);
    if (spot.there) {
      const Vec3 turn = (2.0 / (1.0 + t_a.dot(t_b))) * t_a.cross(t_b);
      moment.col(i) = (spot.EI / rod.share[i]) * turn;
      if (angle.size() > 0) {
        const double a = i > 0 ? 0.5 * (angle[i - 1] + angle[i]) : angle[0];
        const Vec3 toward = std::cos(a) * d + std::sin(a) * t_b.cross(d);
        moment.col(i) -= spot.EI * spot.curvature * t_b.cross(toward);
      }
    }
    t_a = t_b;
  }
  return moment;
}

/// Where the inner tool is to bend at once by a curvature k, as at a mouth, the play c lets it do
/// so over the length sqrt(2 c / k), and no force acts over less.
double ToolBench::bridged_length(std::size_t outer, const Eigen::Matrix3Xd& moment) const {
  const Tool& inner = scene_.tools[outer + 1];
  const double play = scene_.tools[outer].inner_radius - inner.wire.radius;
  double most = 0.0;
  for (Eigen::Index i = 0; i < moment.cols(); ++i) {
    const double s = static_cast<double>(i) * now_.composite.rod.rest_length[0];
    const double EI = look_at(inner.wire, now_.places[outer + 1].insertion - s).EI;
    most = std::max(most, moment.col(i).norm() / EI);
  }
  return most > 0.0 && play > 0.0 ? std::sqrt(2.0 * play / most) : 0.0;
}

ToolContact ToolBench::find_contact(std::size_t outer, const ToolMove& by) const {
  const std::size_t inner = outer + 1;
  const double h = now_.composite.rod.rest_length[0];
  const double overlap = std::min(now_.places[outer].insertion, now_.places[inner].insertion);
  const Eigen::Matrix3Xd moment = moments(static_cast<int>(inner));
  const Eigen::Index n = moment.cols();
  // Moments go on beyond the ends as they end: straight in the introducer, free at the tip.
  const auto at = [&](double place) -> Vec3 {
    const double inside = std::max(0.0, place);
    const auto i = static_cast<Eigen::Index>(inside);
    if (i + 1 >= n) return Vec3::Zero();
    const double part = inside - static_cast<double>(i);
    return (1.0 - part) * moment.col(i) + part * moment.col(i + 1);
  };
  const double reach = std::max(h, bridged_length(outer, moment)), stride = reach / h;
  const double along = std::abs(now_.force[inner]);
  double hand = along;  // grows from the mouth to the introducer
  ToolContact contact;
  Vec3 t_b = Vec3::Zero();
  for (Eigen::Index i = n - 2; i >= 0; --i) {
    const Vec3 t_a = i > 0 ? edge_tangent(now_.state, i - 1) : scene_.direction;
    t_b = edge_tangent(now_.state, i);
    const auto node = static_cast<double>(i);
    if (node * h > overlap + reach) continue;
    const double bent =
        (at(node + stride) - 2.0 * at(node) + at(node - stride)).norm() * h / (reach * reach);
    // Of a node of which the outer tool covers a part.
    const double part = std::clamp((overlap - (node - 0.5) * h) / h, 0.0, 1.0);
    const double turn = part * std::atan2(t_a.cross(t_b).norm(), t_a.dot(t_b));
    const double grown = std::exp(scene_.friction * turn);
    const double normal =
        bent + (scene_.friction > 0.0 ? hand * (grown - 1.0) / scene_.friction : hand * turn);
    contact.normal_force += normal;
    hand += scene_.friction * normal;
  }
  const double slide = by.push[inner] - by.push[outer];
  const double spin = scene_.tools[inner].wire.radius * (by.turn[inner] - by.turn[outer]);
  const double slip = std::hypot(slide, spin);
  if (slip == 0.0) return contact;
  contact.friction_force = (hand - along) * slide / slip;
  contact.friction_torque = (hand - along) * scene_.tools[inner].wire.radius * spin / slip;
  return contact;
}

void ToolBench::report(const ToolMove& by) {
  const std::size_t count = scene_.tools.size();
  record_.energy = now_.energy;
  record_.tools.assign(count, {});
  record_.contacts.clear();
  for (std::size_t i = 0; i < count; ++i) {
    ToolReport& tool = record_.tools[i];
    tool.place = now_.places[i];
    tool.push_force = now_.force[i];
    tool.hub_torque = now_.torque[i];
    tool.tip = nodes_of(static_cast<int>(i)).rightCols<1>();
    const Eigen::VectorXd angle = angles(static_cast<int>(i));
    if (angle.size() > 0) {
      const double h = now_.composite.rod.rest_length[0];
      tool.twist = between_middles(tool.place.insertion, h, angle.size(),
                                   [&](Eigen::Index k) { return angle[k]; }) -
                   tool.place.roll;
    }
  }
  for (std::size_t i = 0; i + 1 < count; ++i) {
    const ToolContact contact = find_contact(i, by);
    record_.tools[i].push_force -= contact.friction_force;
    record_.tools[i + 1].push_force += contact.friction_force;
    record_.tools[i].hub_torque -= contact.friction_torque;
    record_.tools[i + 1].hub_torque += contact.friction_torque;
    record_.contacts.push_back(contact);
  }
}

Eigen::Matrix3Xd ToolBench::nodes_of(int tool) const {
  const double place =
      now_.places[static_cast<std::size_t>(tool)].insertion / now_.composite.rod.rest_length[0];
  const Eigen::Matrix3Xd& x = now_.state.x;
  const Eigen::Index last = x.cols() - 1;
  const Eigen::Index whole = std::min(last, static_cast<Eigen::Index>(std::floor(place + 1e-9)));
  const double part = place - static_cast<double>(whole);
  if (whole == last || part <= 1e-9) return x.leftCols(whole + 1);
  Eigen::Matrix3Xd nodes(3, whole + 2);
  nodes.leftCols(whole + 1) = x.leftCols(whole + 1);
  nodes.col(whole + 1) = (1.0 - part) * x.col(whole) + part * x.col(whole + 1);
  return nodes;
}

Vec3 ToolBench::introducer_force() const {
  Eigen::Matrix3Xd gradient(3, now_.state.x.cols());
  Statics::evaluate(problem_of(now_), now_.state, gradient);
  return gradient.col(0);
}

Vec3 ToolBench::distal_force() const {
  Eigen::Matrix3Xd gradient(3, now_.state.x.cols());
  Statics::evaluate(problem_of(now_), now_.state, gradient);
  return gradient.rightCols<1>();
}

// ---------------------------------------------------------------- a scene

ToolSceneResult run_tool_scene(const ToolScene& scene) {
  ToolBench bench(scene);
  ToolSceneResult result;
  result.history.push_back(bench.record());
  bool good = bench.settled();
  std::string when = "at the start";
  for (std::size_t k = 0; k < scene.moves.size() && good; ++k) {
    good = bench.move(scene.moves[k]);
    when = "in moves[" + std::to_string(k) + "]";
    result.history.push_back(bench.record());
  }
  result.outcome = good ? SceneOutcome::kConverged : SceneOutcome::kNotConverged;
  if (!good) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "no equilibrium was found %s: residual %.3g N, asked for %.3g N", when.c_str(),
                  bench.record().residual, scene.residual_tolerance);
    result.reason = text;
  }
  std::vector<std::string> own = {"tools"};
  if (!scene.loads.gravity.isZero(0.0)) own.push_back("gravity");
  if (!scene.loads.tip_force.isZero(0.0)) own.push_back("tip_force");
  if (!scene.loads.tip_moment.isZero(0.0)) own.push_back("tip_moment");
  if (scene.plane) own.push_back("plane");
  result.terms = name_terms(bench.composite().rod, own, nullptr, 0.0);
  result.nodes = bench.state().x;
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    result.tool_nodes.push_back(bench.nodes_of(static_cast<int>(i)));
    result.angles.push_back(bench.angles(static_cast<int>(i)));
  }
  result.introducer_force = bench.introducer_force();
  if (scene.distal) result.distal_force = bench.distal_force();
  return result;
}

}  // namespace wireplan::simulate
