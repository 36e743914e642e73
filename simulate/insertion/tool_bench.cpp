#include "simulate/insertion/tool_bench.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "simulate/wire/bend_to.h"

namespace wireplan::simulate {
namespace {

/// All chosen.
struct BenchTuning {
  double longest_push = 2.0;                // of a part of a move                             [mm]
  double largest_turn = 5.0 * kPi / 180.0;  //                                            [rad]
  double of_element = 0.9;       // at most so much in a vessel: parts as long as elements meet the
                                 // same place of the forces' ripple each time
  double first_push = 0.1;       // of a move where walls rub: friction turns round within it  [mm]
  double shortest = 1.0 / 16.0;  // of such a part, where it is cut
  double unbalanced = 0.02;      // of the work of a part: more, and it is cut
  double unbalanced_in_vessel = 0.2;  // there friction and ridges of the wall are in the forces
  double jump = 0.5;  // of a node off its guess, in the shortest part in a vessel              [mm]
  double deepest = 1.0;      // past the wall                                  [mm]
  double least_work = 1e-7;  // that counts so                                [N mm]
  double nudge = 1e-3;  // of the tip of each tool but the first curved one, in a guess       [rad]
  int most_solves = 4;  // of a part that runs out of iterations, from where it got
  double snap = 1.0;    // off the way of before in a part: a jump, not to go on [mm]
  double least_start = 1.0;  // of tools that are brought in [mm]
  int most_followed = 6;     // more solves of a jump in a vessel
  int load_steps = 10;       // where the full loads have no equilibrium at once
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
  return elements_over(longest, scene.element_length);
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

/// How a move is cut: the lengths of its parts, as parts of it, and its longest push.
struct Parts {
  double first, longest, shortest;  // to cut a part to
  double farthest;                  //                                                   [mm]
};

Parts parts_of(const ToolScene& scene, const ToolMove& by) {
  const bool in_vessel = scene.vessel != nullptr;
  const double longest_push =
      in_vessel ? std::min(kBench.longest_push, kBench.of_element * scene.element_length)
                : kBench.longest_push;
  double count = 1.0, farthest = 0.0;
  for (std::size_t i = 0; i < by.push.size(); ++i) {
    farthest = std::max(farthest, std::abs(by.push[i]));
    count = std::max({count, std::ceil(std::abs(by.push[i]) / longest_push - 1e-9),
                      std::ceil(std::abs(by.turn[i]) / kBench.largest_turn - 1e-9)});
  }
  double first = 1.0 / count;
  if (in_vessel && scene.contact.friction > 0.0 && farthest > 0.0) {
    first = std::min(first, kBench.first_push / farthest);
  }
  return {first, 1.0 / count, kBench.shortest / count, farthest};
}

}  // namespace

int elements_over(double length, double element_length) {
  return std::max(4, static_cast<int>(std::ceil(length / element_length - 1e-9)));
}

double friction_with_wall(const ToolScene& scene, std::size_t tool) {
  return scene.tools[tool].wire.friction.value_or(scene.contact.friction);
}

/// Points of contact are the nodes, so that they stay as many: no edge is as long as half of their
/// spacing. Friction is that of the roughest tool, of which the others have a part.
ToolScene for_contact(ToolScene scene) {
  scene.contact.spacing = 3.0 * scene.element_length;
  double most = 0.0;
  for (std::size_t i = 0; i < scene.tools.size(); ++i) {
    scene.tools[i].wire.friction = friction_with_wall(scene, i);
    most = std::max(most, *scene.tools[i].wire.friction);
  }
  scene.contact.friction = most;
  return scene;
}

ToolBench::ToolBench(const ToolScene& scene)
    : scene_(for_contact(scene)), elements_(count_elements(scene)) {
  expects(scene.places.size() == scene.tools.size() && scene.loads.tip_torque == 0.0);
  place(scene.places, now_);
  now_.state = unloaded(now_);
  lies_free(now_) ? settle_at(scene.places) : bring_in();
  const std::vector<double> none(scene.tools.size(), 0.0);
  report({none, none});
}

bool ToolBench::lies_free(const State& at) const {
  if (scene_.vessel == nullptr) return true;
  double least = kBench.deepest;
  for (const auto& x : at.state.x.colwise()) {
    least = std::min(least, scene_.vessel->lumen.distance(x) - at.composite.rod.radius);
  }
  return least > -kBench.deepest;
}

/// Finds the equilibrium that is nearest to how the tools lie without loads.
void ToolBench::settle_at(const std::vector<ToolPlace>& places) {
  place(places, now_);
  now_.state = unloaded(now_);
  if (now_.contact != nullptr) now_.contact->start_at(now_.state);
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
  if (now_.contact != nullptr) now_.contact->settle();
  find_energy(now_);
}

/// From places so far back that the tools lie free, all at once.
void ToolBench::bring_in() {
  const double longest = largest_insertion(scene_.places);
  std::vector<ToolPlace> places;
  double out = longest;
  while (out > 2.0 * kBench.least_start) {
    out *= 0.5;
    places = scene_.places;
    for (ToolPlace& one : places) one.insertion = std::max(0.0, one.insertion - (longest - out));
    place(places, now_);
    now_.state = unloaded(now_);
    if (lies_free(now_)) break;
  }
  settle_at(places);
  if (!settled_) return;
  ToolMove all;
  for (std::size_t i = 0; i < places.size(); ++i) {
    all.push.push_back(scene_.places[i].insertion - places[i].insertion);
    all.turn.push_back(0.0);
  }
  settled_ = move(all);
  record_.work = record_.heat = record_.released = record_.unbalanced = 0.0;
}

bool ToolBench::move(const ToolMove& by) {
  expects(settled_ && by.push.size() == scene_.tools.size() && by.turn.size() == by.push.size());
  record_.iterations = 0;
  record_.worst_energy_rise = 0.0;
  const Parts parts = parts_of(scene_, by);
  const std::vector<ToolPlace> start = now_.places;
  double done = 0.0, size = parts.first;
  Shape drift;  // of the last part
  double slope = slope_along(now_, by.push, 1.0);
  while (done < 1.0 - 1e-12) {
    const double part = 1.0 - done < 1.01 * size ? 1.0 - done : size;
    const bool may_cut = part > 1.01 * parts.shortest;
    State next;
    place(moved(start, by, done + part), next);
    const Shape followed = follow(next);
    next.state = guess(followed, drift, part);
    const Eigen::VectorXd slid = slides(now_, next);
    carry_contact(now_, slid, next);
    const Eigen::Matrix3Xd guessed = next.state.x;
    bool solved = solve(next);
    if (!solved && drift.x.cols() > 0) {  // then from where it was
      drift = {};
      continue;
    }
    double rubbed = 0.0;
    if (!solved && !may_cut && !through_wall_) {
      solved = follow_jump(next, rubbed);
    }
    if (!solved) {
      if (!may_cut) {
        report(by);
        return false;
      }
      size = 0.5 * part;
      continue;
    }
    double against_wall = 0.0;
    rubbed += rub(slid, next, against_wall);
    find_energy(next);

    // The work of the hands against what the energy gained.
    const double next_slope = slope_along(next, by.push, -1.0);
    double work = 0.5 * part * (slope + next_slope) + against_wall;
    double scale = part * std::max(std::abs(slope), std::abs(next_slope)) + std::abs(rubbed);
    for (std::size_t i = 0; i < by.turn.size(); ++i) {
      const double turn = 0.5 * part * by.turn[i] * (now_.torque[i] + next.torque[i]);
      work += turn;
      scale += std::abs(turn);
    }
    const double gained = next.energy.total() - now_.energy.total();
    const double excess = work - gained - rubbed;
    const double allowed =
        next.contact != nullptr ? kBench.unbalanced_in_vessel : kBench.unbalanced;
    const double unknown = scene_.residual_tolerance * part * parts.farthest;
    const bool jumped = std::abs(excess) > allowed * scale + kBench.least_work + unknown;
    if (jumped && may_cut) {
      size = 0.5 * part;
      continue;
    }
    const double off = std::sqrt((next.state.x - guessed).colwise().squaredNorm().maxCoeff());
    const bool ripples = next.contact != nullptr && off < kBench.jump;
    const double released = jumped && !ripples ? std::max(0.0, excess) : 0.0;
    now_ = std::move(next);
    drift = shape();
    drift.x = (drift.x - followed.x) / part;
    drift.angles = (drift.angles - followed.angles) / part;
    if (part * std::sqrt(drift.x.colwise().squaredNorm().maxCoeff()) > kBench.snap) drift = {};
    slope = is_smooth(now_, by.push) ? next_slope : slope_along(now_, by.push, 1.0);
    record_.released += released;
    record_.unbalanced += excess - released;
    record_.heat += rubbed;
    record_.work += gained + rubbed + released;
    if (scene_.friction > 0.0) feel(now_, by);
    for (std::size_t i = 0; i + 1 < by.push.size() && scene_.friction > 0.0; ++i) {
      const ToolContact contact = find_contact(i, by);
      const double heat = part * (contact.friction_force * (by.push[i + 1] - by.push[i]) +
                                  contact.friction_torque * (by.turn[i + 1] - by.turn[i]));
      record_.heat += heat;
      record_.work += heat;
    }
    done += part;
    size = std::min(parts.longest, 2.0 * part);
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
  problem.contact = at.contact.get();
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
  if (scene_.vessel == nullptr) return;
  if (scene_.contact.friction > 0.0) {
    at.composite.rod.rubs.setZero(at.load.cols());
    for (std::size_t i = 0; i < places.size(); ++i) {
      at.composite.rod.rubs += friction_with_wall(scene_, i) / scene_.contact.friction *
                               at.composite.outside.row(static_cast<Eigen::Index>(i)).transpose();
    }
  }
  at.contact = std::make_unique<WallContact>(at.composite.rod, *scene_.vessel, scene_.contact);
}

/// How far the outermost tool slides past each node, forward; where a tip covers a part of the
/// node's share, a mean.
Eigen::VectorXd ToolBench::slides(const State& from, const State& to) const {
  const Eigen::Index n = from.state.x.cols();
  const double longer = to.composite.edge_length() - from.composite.edge_length();
  Eigen::VectorXd slide = Eigen::VectorXd::LinSpaced(n, 0.0, -longer * static_cast<double>(n - 1));
  for (std::size_t i = 0; i < from.places.size(); ++i) {
    slide += (to.places[i].insertion - from.places[i].insertion) *
             from.composite.outside.row(static_cast<Eigen::Index>(i)).transpose();
  }
  return slide;
}

/// What holds the nodes at the wall is held against the tool there, not against the node, which
/// slides along it.
void ToolBench::carry_contact(const State& from, const Eigen::VectorXd& slides, State& to) const {
  if (to.contact == nullptr) return;
  ContactMemory memory = from.contact->memory();
  const Eigen::Index n = from.state.x.cols();
  expects(memory.anchor.cols() == n && to.contact->memory().anchor.cols() == n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3 along = slides[i] * edge_tangent(from.state, std::min(i, n - 2));
    memory.x.col(i) -= along;
    memory.anchor.col(i) -= along;
  }
  to.contact->restore(memory);
  to.contact->predict(0.0);
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
  Eigen::MatrixXd angles(rod.nodes() - 1, terms.twists());
  for (int k = 0; k < terms.twists(); ++k) angles.col(k).setConstant(terms.roll[k]);
  set_frames(angles, state);
  return state;
}

ToolBench::Shape ToolBench::shape() const {
  const std::vector<int>& twisted = now_.composite.terms.tool;
  Shape shape{now_.state.x, Eigen::MatrixXd(now_.state.x.cols() - 1, twisted.size())};
  for (std::size_t k = 0; k < twisted.size(); ++k) {
    shape.angles.col(static_cast<Eigen::Index>(k)) = angles(twisted[k]);
  }
  return shape;
}

/// The centreline of now, as much longer or shorter as it is to be, and the tools' angles on it.
ToolBench::Shape ToolBench::follow(const State& to) const {
  const double h = now_.composite.edge_length(), h_new = to.composite.edge_length();
  const Eigen::Index before = now_.state.x.cols() - 1, edges = to.composite.rod.nodes() - 1;
  const bool divided_anew = h != h_new || before != edges;
  const Shape from = shape();
  Shape next{from.x, Eigen::MatrixXd(edges, from.angles.cols())};
  if (divided_anew) next.x.resize(3, edges + 1);
  next.x.col(0) = from.x.col(0);
  for (Eigen::Index e = 0; e < edges; ++e) {
    const double middle = (static_cast<double>(e) + 0.5) * h_new;
    if (divided_anew) {
      const Vec3 t = between_middles(middle, h, before,
                                     [&](Eigen::Index k) { return edge_tangent(now_.state, k); });
      next.x.col(e + 1) = next.x.col(e) + h_new * t.normalized();
    }
    for (Eigen::Index k = 0; k < from.angles.cols(); ++k) {
      // Tools that lie in one plane, curved to opposite sides, would stay so when that is a saddle.
      next.angles(e, k) =
          between_middles(middle, h, before, [&](Eigen::Index i) { return from.angles(i, k); }) +
          kBench.nudge * static_cast<double>(k * e) / static_cast<double>(edges);
    }
  }
  if (divided_anew) bend_to_support(to, next.x);
  return next;
}

/// The shape that was followed, and what the tools came off such shapes before, `drift` per part.
RodState ToolBench::guess(const Shape& followed, const Shape& drift, double part) const {
  RodState state;
  state.x = followed.x;
  Eigen::MatrixXd turned = followed.angles;
  if (drift.x.cols() > 0) {
    const Eigen::Matrix3Xd x = followed.x + part * drift.x;
    for (Eigen::Index e = 0; e + 1 < x.cols(); ++e) {  // no edge gets longer by that
      const Vec3 edge = x.col(e + 1) - x.col(e);
      const double length = (followed.x.col(e + 1) - followed.x.col(e)).norm();
      state.x.col(e + 1) = state.x.col(e) + (length / edge.norm()) * edge;
    }
    turned += part * drift.angles;
  }
  set_frames(turned, state);
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
void ToolBench::set_frames(const Eigen::MatrixXd& angles, RodState& state) const {
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
  state.theta = angles.reshaped();
}

Vec3 ToolBench::edge_tangent(const RodState& state, Eigen::Index e) {
  return (state.x.col(e + 1) - state.x.col(e)).normalized();
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
    record_.worst_energy_rise = std::max(record_.worst_energy_rise, found.worst_energy_rise);
    if (found.iterations < scene_.max_iterations) break;
  }
  record_.residual = found.residual;
  if (!found.converged || at.contact == nullptr) return found.converged;
  through_wall_ = at.contact->latest().lost;
  for (const Touch& touch : at.contact->touches()) {
    through_wall_ = through_wall_ || touch.penetration > kBench.deepest;
  }
  return !through_wall_;
}

/// On from where a solve got, taken for a jump: friction that is held to where the tools were may
/// have no equilibrium there. So anchors follow, and friction opposes the rest. Adds its heat.
bool ToolBench::follow_jump(State& at, double& rubbed) {
  for (int k = 0; k < kBench.most_followed && at.contact != nullptr; ++k) {
    rubbed += at.contact->settle();
    at.contact->predict(0.0);
    if (solve(at)) return true;
  }
  return false;
}

// ---------------------------------------------------------------- what is told

std::vector<Touch> ToolBench::touches() const { return now_.touches; }

double ToolBench::free_force(int tool) const {
  return now_.force.at(static_cast<std::size_t>(tool));
}

void ToolBench::report(const ToolMove& by) {
  feel(now_, by);
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
  for (const Touch& touch : now_.touches) {
    for (std::size_t i = 0; i < count; ++i) {
      record_.tools[i].wall_force += outside_part(now_, i, touch) * touch.normal_force;
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

}  // namespace wireplan::simulate
