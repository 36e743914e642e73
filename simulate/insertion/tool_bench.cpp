#include "simulate/insertion/tool_bench.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace wireplan::simulate {
namespace {

/// All chosen.
struct BenchTuning {
  double largest_turn = 5.0 * kPi / 180.0;  //                                            [rad]
  double of_element = 0.9;       // at most so much in a vessel: parts as long as elements meet the
                                 // same place of the forces' ripple each time
  double first_push = 0.1;       // where walls rub and a move does not go on with the last one:
                                 // friction turns round within it                [mm]
  double shortest = 1.0 / 16.0;  // of such a part, where it is cut
  double unbalanced = 0.02;      // of the work of a part: more, and it is cut
  double unbalanced_in_vessel = 0.2;  // there friction and ridges of the wall are in the forces
  double jump = 0.5;  // of a node off its guess, in the shortest part in a vessel              [mm]
  double deepest = 1.0;      // past the wall                                  [mm]
  double least_work = 1e-7;  // that counts so                                [N mm]
  int most_solves = 4;       // of a part that runs out of iterations, from where it got
  double snap = 1.0;         // off the way of before in a part: a jump, not to go on [mm]
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

/// Elements as short as asked for even where the tools are furthest in.
int count_elements(const ToolScene& scene) {
  std::vector<ToolPlace> places = scene.places;
  double longest = largest_insertion(places);
  for (const ToolMove& move : scene.moves) {
    places = moved(scene.tools, std::move(places), move);
    longest = std::max(longest, largest_insertion(places));
  }
  return elements_over(longest, scene.element_length);
}

/// A tool's tip among nodes: at one of them, or by a part of the edge beyond it.
struct TipNodes {
  Eigen::Index node = 0;
  double part = 0.0;
};

TipNodes tip_nodes(const ToolPlace& tool, const Rod& rod) {
  constexpr double kAtNode = 1e-9;  // of an edge
  const double place = tool.insertion / rod.rest_length[0];
  const Eigen::Index last = rod.nodes() - 1,
                     node = std::min(last, static_cast<Eigen::Index>(std::floor(place + kAtNode)));
  const double part = place - static_cast<double>(node);
  return {node, node == last || part <= kAtNode ? 0.0 : part};
}

/// How many times the move before this one is; 0 where it goes another way.
double times_before(const ToolMove& before, const ToolMove& by) {
  constexpr double kSameWay = 1e-9;  // of the move
  if (before.push.size() != by.push.size()) return 0.0;
  double product = 0.0, squared = 0.0, off = 0.0, whole = 0.0;
  const auto for_each = [&](const auto& act) {
    for (std::size_t i = 0; i < by.push.size(); ++i) {
      act(before.push[i], by.push[i]);
      act(before.turn[i], by.turn[i]);
    }
  };
  for_each([&](double a, double b) {
    product += a * b;
    squared += a * a;
  });
  if (product <= 0.0) return 0.0;
  const double times = product / squared;
  for_each([&](double a, double b) {
    off = std::max(off, std::abs(b - times * a));
    whole = std::max(whole, std::abs(b));
  });
  return off <= kSameWay * whole ? times : 0.0;
}

/// How a move is cut: the lengths of its parts, as parts of it, and its longest push.
struct Parts {
  double first, longest, shortest;  // to cut a part to
  double farthest;                  //                                                   [mm]
};

/// `going`: the next part of the move before, where this one goes on with it; else 0.
Parts parts_of(const ToolScene& scene, const ToolMove& by, double going) {
  const bool in_vessel = scene.vessel != nullptr;
  const double longest_push =
      in_vessel ? std::min(scene.longest_part, kBench.of_element * scene.element_length)
                : scene.longest_part;
  double count = 1.0, farthest = 0.0;
  for (std::size_t i = 0; i < by.push.size(); ++i) {
    farthest = std::max(farthest, std::abs(by.push[i]));
    count = std::max({count, std::ceil(std::abs(by.push[i]) / longest_push - 1e-9),
                      std::ceil(std::abs(by.turn[i]) / kBench.largest_turn - 1e-9)});
  }
  double first = 1.0 / count;
  if (in_vessel && scene.contact.friction > 0.0 && farthest > 0.0) {
    first = std::min(first, std::max(kBench.first_push / farthest, going));
  }
  return {first, 1.0 / count, kBench.shortest / count, farthest};
}

/// Whether a node would come off the way of before by a jump in such a part.
bool snaps(const Eigen::Matrix3Xd& drift, double part) {
  return drift.cols() > 0 &&
         part * std::sqrt(drift.colwise().squaredNorm().maxCoeff()) > kBench.snap;
}

}  // namespace

std::vector<ToolPlace> moved(const std::vector<Tool>& tools, std::vector<ToolPlace> places,
                             const ToolMove& by, double part) {
  constexpr double kSamePlace = 1e-9;  // [mm]
  for (std::size_t i = 0; i < places.size(); ++i) {
    double& insertion = places[i].insertion;
    const double length = tools[i].wire.length();
    insertion += part * by.push[i];
    if (std::abs(insertion) < kSamePlace) insertion = 0.0;
    if (std::abs(insertion - length) < kSamePlace) insertion = length;
    places[i].roll += part * by.turn[i];
  }
  return places;
}

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
  // Further back the tools would not come to a support.
  lies_free(now_) || scene.distal ? settle_at(scene.places) : bring_in();
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
  now_.memory = {};
  touch(now_);
  if (contact_ != nullptr) contact_->start_at(now_.state);
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
  take_forces(now_);
  if (contact_ == nullptr) return;
  contact_->settle();
  now_.memory = contact_->memory();
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

/// What a move begins with: of the one before, in parts of this, where it goes on with that; else
/// nothing. That one is forgotten.
ToolBench::Going ToolBench::going_on_with(const ToolMove& by) {
  const Going before = std::exchange(going_, {});
  const double times = times_before(before.by, by);
  Going going{by, times > 0.0 ? before.size / times : 0.0, {}};
  if (times > 0.0 && before.drift.x.cols() > 0) {
    going.drift = {times * before.drift.x, times * before.drift.angles};
  }
  return going;
}

/// Friction between the tools in a part of a move.
void ToolBench::rub_between(const ToolMove& by, double part) {
  feel(now_, by);
  for (std::size_t i = 0; i + 1 < by.push.size(); ++i) {
    const ToolContact contact = find_contact(i, by);
    const double heat = part * (contact.friction_force * (by.push[i + 1] - by.push[i]) +
                                contact.friction_torque * (by.turn[i + 1] - by.turn[i]));
    record_.heat += heat;
    record_.work += heat;
  }
}

bool ToolBench::move(const ToolMove& by) {
  expects(settled_ && by.push.size() == scene_.tools.size() && by.turn.size() == by.push.size());
  record_.iterations = 0;
  record_.worst_energy_rise = 0.0;
  Going going = going_on_with(by);
  const Parts parts = parts_of(scene_, by, going.size);
  const std::vector<ToolPlace> start = now_.places;
  double done = 0.0, size = parts.first;
  Shape& drift = going.drift;  // of the last part
  if (snaps(drift.x, size)) drift = {};
  if (contact_ != nullptr) contact_->forget();  // so that a mark goes on as it did before
  find_slopes(now_, by, false);
  double slope = slope_of_move(now_, by, 1.0);
  while (done < 1.0 - 1e-12) {
    const double part = 1.0 - done < 1.01 * size ? 1.0 - done : size;
    const bool may_cut = part > 1.01 * parts.shortest;
    State& next = next_;
    place(moved(scene_.tools, start, by, done + part), next);
    const Shape followed = follow(next);
    next.state = guess(next, followed, drift, part);
    const Eigen::VectorXd slid = slides(now_, next);
    carry_contact(now_, slid, next);
    touch(next);
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
        touch(now_);
        report(by);
        return false;
      }
      size = 0.5 * part;
      continue;
    }
    double against_wall = 0.0;
    rubbed += rub(slid, next, against_wall);

    // The work of the hands against what the energy gained.
    find_slopes(next, by, false);
    const double next_slope = slope_of_move(next, by, -1.0);
    double work = 0.5 * part * (slope + next_slope) + against_wall;
    double scale = part * std::max(std::abs(slope), std::abs(next_slope)) + std::abs(rubbed);
    for (std::size_t i = 0; i < by.turn.size(); ++i) {
      const double turn = 0.5 * part * by.turn[i] * (now_.torque[i] + next.torque[i]);
      work += turn;
      scale += std::abs(turn);
    }
    const double gained = next.energy - now_.energy;
    const double excess = work - gained - rubbed;
    const double allowed = contact_ != nullptr ? kBench.unbalanced_in_vessel : kBench.unbalanced;
    const double unknown = scene_.residual_tolerance * part * parts.farthest;
    const bool jumped = std::abs(excess) > allowed * scale + kBench.least_work + unknown;
    if (jumped && may_cut && scene_.cut_jumps) {
      size = 0.5 * part;
      continue;
    }
    const double off = std::sqrt((next.state.x - guessed).colwise().squaredNorm().maxCoeff());
    const bool ripples = contact_ != nullptr && off < kBench.jump;
    const double released = jumped && !ripples ? std::max(0.0, excess) : 0.0;
    std::swap(now_, next_);
    drift = shape();
    drift.x = (drift.x - followed.x) / part;
    drift.angles = (drift.angles - followed.angles) / part;
    if (snaps(drift.x, part)) drift = {};
    done += part;
    const bool at_end = done >= 1.0 - 1e-12;
    slope = at_end || is_smooth(now_, by.push) ? next_slope : slope_of_move(now_, by, 1.0);
    record_.released += released;
    record_.unbalanced += excess - released;
    record_.heat += rubbed;
    record_.work += gained + rubbed + released;
    if (scene_.friction > 0.0) rub_between(by, part);
    size = std::min(parts.longest, std::max(size, 2.0 * part));
  }
  going.size = size;
  going_ = std::move(going);
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
  problem.contact = contact_.get();
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
  build_composite(scene_.tools, places, elements_, at.composite);
  set_load(places, at.composite.rod, at.load);
  if (scene_.vessel == nullptr) return;
  if (scene_.contact.friction > 0.0) {
    at.composite.rod.rubs.setZero(at.load.cols());
    for (std::size_t i = 0; i < places.size(); ++i) {
      at.composite.rod.rubs += friction_with_wall(scene_, i) / scene_.contact.friction *
                               at.composite.outside.row(static_cast<Eigen::Index>(i)).transpose();
    }
  }
}

void ToolBench::set_load(const std::vector<ToolPlace>& places, const Rod& rod,
                         Eigen::Matrix3Xd& load) const {
  load = scene_.loads.gravity * rod.mass.transpose();
  load.rightCols<1>() += scene_.loads.tip_force;
  if (pressed_.isZero(0.0)) return;
  const TipNodes at = tip_nodes(places[static_cast<std::size_t>(pressed_tool_)], rod);
  load.col(at.node) += (1.0 - at.part) * pressed_;
  if (at.part > 0.0) load.col(at.node + 1) += at.part * pressed_;
}

/// Has contact be that of the state's tools, with what they remember.
void ToolBench::touch(const State& at) {
  if (scene_.vessel == nullptr) return;
  const Rod& rod = at.composite.rod;
  if (contact_ == nullptr || contact_->memory().x.cols() != rod.nodes()) {
    contact_ = std::make_unique<WallContact>(rod, *scene_.vessel, scene_.contact);
  } else {
    contact_->take(rod);
  }
  if (at.memory.x.cols() == 0) return;
  contact_->restore(at.memory);
  contact_->predict(0.0);
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
  if (scene_.vessel == nullptr) return;
  to.memory = from.memory;
  const Eigen::Index n = from.state.x.cols();
  expects(to.memory.anchor.cols() == n);
  for (Eigen::Index i = 0; i < n; ++i) {
    Vec3 along = slides[i] * edge_tangent(from.state, std::min(i, n - 2));
    to.memory.x.col(i) -= along;
    if (chain() != nullptr && from.memory.normal_force[i] > 0.0) {  // anchors are places at rest
      MovingFrame frame;
      frame.find(*chain(), from.state.sections, from.state.x.col(i));
      along = frame.inverse() * along;
    }
    to.memory.anchor.col(i) -= along;
  }
}

bool ToolBench::solve(State& at) {
  const double tolerance = contact_ == nullptr ? residual_under(at.load, scene_.residual_tolerance)
                                               : scene_.residual_tolerance;
  NewtonResult found;
  for (int k = 0; k < kBench.most_solves && !found.converged; ++k) {
    found = statics_.solve(problem_of(at), at.state,
                           {.residual_tolerance = tolerance,
                            .max_iterations = scene_.max_iterations,
                            .leave_saddles = may_leave_saddles(scene_.loads, scene_.plane)});
    record_.iterations += found.iterations;
    record_.worst_energy_rise = std::max(record_.worst_energy_rise, found.worst_energy_rise);
    if (found.iterations < scene_.max_iterations) break;
  }
  record_.residual = found.residual;
  at.energy = found.energy;
  if (!found.converged || contact_ == nullptr) return found.converged;
  through_wall_ = contact_->latest().lost;
  for (const Touch& touch : contact_->touches()) {
    through_wall_ = through_wall_ || touch.penetration > kBench.deepest;
  }
  return !through_wall_;
}

/// On from where a solve got, taken for a jump: friction that is held to where the tools were may
/// have no equilibrium there. So anchors follow, and friction opposes the rest. Adds its heat.
bool ToolBench::follow_jump(State& at, double& rubbed) {
  for (int k = 0; k < kBench.most_followed && contact_ != nullptr; ++k) {
    rubbed += contact_->settle();
    contact_->predict(0.0);
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
  record_.energy = find_energy(now_);
  find_slopes(now_, by, true);
  feel(now_, by);
  const std::size_t count = scene_.tools.size();
  record_.tools.assign(count, {});
  record_.contacts.clear();
  for (std::size_t i = 0; i < count; ++i) {
    ToolReport& tool = record_.tools[i];
    tool.place = now_.places[i];
    tool.push_force = now_.force[i];
    tool.hub_torque = now_.torque[i];
    tool.tip = nodes_of(static_cast<int>(i)).rightCols<1>();
    tool.twist = twist_of(static_cast<int>(i));
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
  const auto [node, part] =
      tip_nodes(now_.places[static_cast<std::size_t>(tool)], now_.composite.rod);
  const Eigen::Matrix3Xd& x = now_.state.x;
  if (part == 0.0) return x.leftCols(node + 1);
  Eigen::Matrix3Xd nodes(3, node + 2);
  nodes.leftCols(node + 1) = x.leftCols(node + 1);
  nodes.col(node + 1) = (1.0 - part) * x.col(node) + part * x.col(node + 1);
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
