#include "simulate/insertion/insertion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "simulate/contact/contact_force.h"

namespace wireplan::simulate {

WireContact contact_of(const Touch& touch, double wire_radius, const TriangleLocator& locator) {
  const bool at_next = touch.part == 1.0;
  const Vec3 point = touch.position - wire_radius * touch.normal;
  return {.node = touch.edge + (at_next ? 1 : 0),
          .part = at_next ? 0.0 : touch.part,
          .triangle = locator.nearest(touch.rest - wire_radius * touch.rest_normal).triangle,
          .point = point,
          .normal_force = touch.normal_force * touch.normal,
          .friction_force = touch.friction,
          .penetration = touch.penetration,
          .wall_displacement = touch.wall_displacement};
}

namespace {

constexpr double kTipRegion = 2.0;   // wire that counts as tip for its force            [mm]
constexpr double kDriftInto = 0.5;   // a wire's drift may lead this much deeper into the wall
                                     // than the wire did [mm]
constexpr double kSnap = 2.0;        // way off the path per push that is a jump, not to go on
constexpr double kDriftLasts = 5.0;  // push that a wire's drift falls to 1/e in               [mm]
constexpr double kBent = 16.0;       // wire that a guess bends to keep its tip off the wall [mm]
constexpr double kSmallestPart = 0.01;  // of a node's share of wire that bends at the exit
constexpr double kLongestPart = 2.0;  // of a push: friction turns with the path               [mm]
constexpr double kLongestTurn = 15.0 * kRadPerDeg;  // of the hub in one go
constexpr double kSmallestCut = 1.0 / 16.0;         // of a push, when one does not converge
constexpr int kFollowed = 6;                        // solves more of a wire that jumps

/// Edges of the part of the wire that goes in, proximal to distal, and two more, so that the
/// innermost free node bends against a straight introducer; four at least. Of a wire that goes in
/// whole they are longer than it.
Eigen::VectorXd layout(const Wire& wire, const InsertionOptions& options) {
  const double longest = std::min(options.length, wire.length());
  std::vector<double> from_tip;
  double sum = 0.0;
  int beyond = 0;
  const auto lacks = [&] { return beyond < 2 || from_tip.size() < kFewestElements; };
  const auto add = [&](double l) {
    if (sum >= longest - 1e-9) ++beyond;
    sum += l;
    from_tip.push_back(l);
  };
  const std::vector<double>& asked = options.section_element_length;
  expects(asked.empty() || asked.size() == wire.sections.size());
  for (std::size_t k = 0; k < asked.size(); ++k) {
    const double length = wire.sections[k].length;
    const double most = asked[k] > 0.0 ? asked[k] : options.element_length;
    const int count = std::max(1, static_cast<int>(std::ceil(length / most - 1e-9)));
    for (int i = 0; i < count && lacks(); ++i) add(length / count);
  }
  while (lacks()) add(asked.empty() ? options.element_length : from_tip.back());
  std::reverse(from_tip.begin(), from_tip.end());
  return Eigen::Map<const Eigen::VectorXd>(from_tip.data(),
                                           static_cast<Eigen::Index>(from_tip.size()));
}

/// With so much more of what the wire is at its hub that the edges fit into it. That stays in the
/// introducer, which holds it straight.
Rod rod_of(Wire wire, const InsertionOptions& options) {
  const Eigen::VectorXd edges = layout(wire, options);
  const double more = edges.sum() - wire.length();
  if (more > 1e-9 * wire.length()) {  // not of rounding
    Section hub = wire.sections.back();
    hub.bending_stiffness = hub.proximal_EI();
    hub.proximal_bending_stiffness = 0.0;
    hub.length = more;
    wire.sections.push_back(hub);
  }
  return build_rod(wire, edges);
}

ContactOptions contact_options(const Wire& wire, const InsertionOptions& options) {
  ContactOptions contact;
  contact.law = options.contact_law;
  contact.spacing = options.contact_spacing;
  contact.friction = friction_of(wire, options);
  contact.support_factor = options.support_factor;
  return contact;
}

}  // namespace

double friction_of(const Wire& wire, const InsertionOptions& options) {
  return options.friction_factor * wire.friction.value_or(options.friction);
}

double longest_insertion(const Wire& wire, const InsertionOptions& options) {
  return std::min(options.length, wire.length());
}

Insertion::Insertion(const Wire& wire, const Introducer& introducer, const VesselModel& vessel,
                     const InsertionOptions& options)
    : introducer_(introducer),
      options_(options),
      vessel_(vessel),
      rod_(rod_of(wire, options)),
      contact_(rod_, vessel, contact_options(wire, options)) {
  const int n = rod_.nodes();
  longest_ = longest_insertion(wire, options);
  whole_ = rod_;
  const Vec3 start = introducer.point - rod_.tip_distance[0] * introducer.direction;
  state_ = straight_state(rod_, start, introducer.direction, introducer.roll);
  if (!rod_.twisted) {  // nothing that turns about the wire, so nothing to copy in every push
    state_.theta.resize(0);
    state_.director.resize(3, 0);
    state_.reference_twist.resize(0);
  }
  first_curved_ = n;
  for (int i = n - 1; i >= 0; --i) {
    if (rod_.rest_angle[i] != 0.0) first_curved_ = i;
  }
  problem_.rod = &rod_;
  problem_.first = n;
  problem_.last = n;
  problem_.contact = &contact_;
  if (!options.gravity.isZero(0.0)) {
    weight_ = options.gravity * rod_.mass.transpose();
    problem_.load = &weight_;
  }
  newton_ = {.residual_tolerance = options.residual_tolerance,
             .max_iterations = options.max_iterations};
  if (vessel.sections) state_.sections.setZero(3, vessel.sections->nodes());
  contact_.start_at(state_);
  forces_ = Eigen::Matrix3Xd::Zero(3, n);
  guess_ahead_.resize(3, n);
  path_.resize(3, n);
  drift_ = moved_ = Eigen::Matrix3Xd::Zero(3, n);
  force_sums_.reserve(static_cast<std::size_t>(contact_.memory().normal_force.size()) + 1);
  mapped_.assign(static_cast<std::size_t>(contact_.memory().normal_force.size()), -1);
}

template <class Part>
std::optional<Push> Insertion::move(double amount, double longest_part, const Part& part) {
  Push record;
  slipped_out_.reset();
  save(before_move_);
  const Snapshot* before = &before_move_;  // the part that is next
  double done = 0.0, cut = std::min(std::abs(amount), longest_part);
  for (;;) {
    const double now = std::copysign(std::min(cut, std::abs(amount - done)), amount);
    const NewtonResult solve = followed(part(now), record.iterations);
    if (solve.converged) {
      record.residual = solve.residual;
      totals_.stored_energy = stored_energy(solve);
      wall_energy_ = solve.wall_energy;
      settle(depth_ - before->depth, hub_angle_ - before->hub_angle);
      done += now;
      if (std::abs(amount - done) <= 1e-9) break;
      save(before_part_);
      before = &before_part_;
      continue;
    }
    if (!slipped_out_) slipped_out_ = left_through();
    restore(*before);
    cut *= 0.5;
    if (cut < kSmallestCut * std::abs(amount)) return std::nullopt;
  }
  measure(record);
  find_work(record);
  return record;
}

std::optional<Push> Insertion::push(double distance) {
  expects(distance != 0.0 && depth_ + distance > 0.0 && depth_ + distance <= longest_ + 1e-9);
  return move(distance, kLongestPart, [&](double part) { return advance(part); });
}

std::optional<Push> Insertion::turn(double angle) {
  expects(depth_ > 0.0);
  return move(angle, kLongestTurn, [&](double part) { return spin(part); });
}

void Insertion::save(Snapshot& snapshot) const {
  snapshot.state = state_;
  snapshot.depth = depth_;
  snapshot.hub_angle = hub_angle_;
  snapshot.first = problem_.first;
  snapshot.forces = forces_;
  snapshot.memory = contact_.memory();
  snapshot.totals = totals_;
  snapshot.balance = balance_;
  snapshot.wall_energy = wall_energy_;
}

void Insertion::restore(const Snapshot& snapshot) {
  state_ = snapshot.state;
  depth_ = snapshot.depth;
  hub_angle_ = snapshot.hub_angle;
  problem_.first = snapshot.first;
  forces_ = snapshot.forces;
  contact_.restore(snapshot.memory);
  contact_.free_from(depth_);
  totals_ = snapshot.totals;
  balance_ = snapshot.balance;
  wall_energy_ = snapshot.wall_energy;
  forget_drift();
  bend_at_the_exit();
}

/// Moves the introducer's part by `distance`, guesses the rest and finds its equilibrium.
NewtonResult Insertion::advance(double distance) {
  guess_ = state_;
  depth_ += distance;
  if (distance * last_distance_ < 0.0) forget_drift();
  last_distance_ = distance;
  // Nodes in the introducer lie on its axis; the others go where the wire ahead of them was, and
  // most of what they came off that path in the last push, per length of it, unless that leads
  // through the wall. The tip has no wire ahead, or another shape: see below.
  const int n = rod_.nodes();
  const double drift = distance * std::exp(-std::abs(distance) / kDriftLasts);
  problem_.first = n;
  ahead_ = 0;
  int tip = std::min(n, first_curved_ + 1);
  while (tip > 1 && rod_.tip_distance[tip - 1] < distance) --tip;
  bool through = false;
  for (int i = 0; i < n; ++i) {
    const double behind = rod_.tip_distance[i] - depth_;
    if (behind >= -1e-9) {
      guess_.x.col(i) = introducer_.point - behind * introducer_.direction;
      guess_ahead_.col(i) = path_.col(i) = guess_.x.col(i);
    } else {
      problem_.first = std::min(problem_.first, i);
      if (i >= tip) break;
      path_.col(i) = ahead_of(i, distance);
      const Vec3 way = drift * drift_.col(i);
      guess_ahead_.col(i) = path_.col(i) + way;
      through = through ||
                (way.norm() > kDriftInto &&
                 vessel_.lumen.distance(at_rest(guess_ahead_.col(i))) < -kDriftInto - deepest_);
    }
  }
  if (through) guess_ahead_ = path_;
  // Keep the edges' lengths of before: a guess that strains a stiff wire costs more than one that
  // lies a little in the wall. The tip keeps its shape, and most of how it turned and changed in
  // the last push.
  for (int i = problem_.first; i < n; ++i) {
    const Vec3 before = state_.x.col(i) - state_.x.col(i - 1);
    Vec3 edge = guess_ahead_.col(i) - guess_ahead_.col(i - 1);
    if (i >= tip) edge = before + drift * (moved_.col(i) - moved_.col(i - 1));
    guess_.x.col(i) =
        guess_.x.col(i - 1) + std::sqrt(before.squaredNorm() / edge.squaredNorm()) * edge;
  }
  bend_off_wall(tip);
  const NewtonResult result = settle_guess(distance);  // swaps the state of before into guess_
  if (result.converged) {
    const double per_length = 1.0 / distance;
    moved_ = per_length * (state_.x - guess_.x);
    drift_.leftCols(tip) = per_length * (state_.x - path_).leftCols(tip);
    drift_.rightCols(n - tip).colwise() = drift_.col(tip - 1).eval();
    double off = std::sqrt(drift_.colwise().squaredNorm().maxCoeff());
    for (int i = tip; i < n; ++i) {
      off = std::max(off, (moved_.col(i) - moved_.col(tip - 1)).norm());
    }
    if (off > kSnap) forget_drift();
  }
  return result;
}

/// Bends the guess's last wire so that no node from `tip` on lies deeper in the wall than the wire
/// did, or nearly so: a tip that was pushed out of the wall alone would leave a kink.
void Insertion::bend_off_wall(int tip) {
  constexpr int kRounds = 2;
  const int n = rod_.nodes();
  for (int round = 0; round < kRounds; ++round) {
    double deep = 0.0, reach = 0.0;  // past the wall, of the deepest node; its tip distance
    Vec3 inward = Vec3::Zero();
    for (int i = std::max(tip, problem_.first); i < n; ++i) {
      const WallSample wall = vessel_.lumen.sample(at_rest(guess_.x.col(i)));
      const double here = rod_.radius - wall.distance - deepest_;
      if (here <= deep) continue;
      deep = here;
      reach = rod_.tip_distance[i];
      inward = wall.gradient;
    }
    if (deep == 0.0) return;
    // By a parabola from so far behind that node on, past it by all; edges keep their lengths.
    const double length = std::min(kBent, depth_ - reach);
    const auto part = [&](int i) {
      const double rest = std::clamp(1.0 - (rod_.tip_distance[i] - reach) / length, 0.0, 1.0);
      return rest * rest;
    };
    int start = problem_.first;
    while (part(start) == 0.0) ++start;
    Vec3 before = guess_.x.col(start - 1);
    for (int i = start; i < n; ++i) {
      const Vec3 here = guess_.x.col(i), edge = here - before;
      const Vec3 bent = edge + ((part(i) - part(i - 1)) * deep) * inward;
      guess_.x.col(i) = guess_.x.col(i - 1) + (edge.norm() / bent.norm()) * bent;
      before = here;
    }
  }
}

/// Turns the hub by `angle`, guesses that the whole wire spins with it, its curved tip about the
/// edge that carries it, and finds its equilibrium.
NewtonResult Insertion::spin(double angle) {
  guess_ = state_;
  hub_angle_ += angle;
  const int n = rod_.nodes(), root = std::max(problem_.first, first_curved_);
  if (rod_.twisted) guess_.theta.tail(n - 1 - problem_.first).array() += angle;
  if (root < n) {
    const Eigen::AngleAxisd turn(angle, edge(root - 1).normalized());
    for (int i = root + 1; i < n; ++i) {
      guess_.x.col(i) = state_.x.col(root) + turn * (state_.x.col(i) - state_.x.col(root));
    }
  }
  forget_drift();
  return settle_guess(0.0);
}

/// In the introducer the wire turns with the hub, without twist.
void Insertion::turn_with_the_hub(RodState& state) const {
  state.theta[0] = introducer_.roll + hub_angle_;  // this edge never leaves the introducer
  for (int i = 1; i < std::min(problem_.first, rod_.nodes() - 1); ++i) {
    state.theta[i] = state.theta[i - 1] - state.reference_twist[i];
  }
}

/// Takes the guess, which is `distance` further in than the present state, and finds its
/// equilibrium.
NewtonResult Insertion::settle_guess(double distance) {
  if (rod_.twisted) {
    // Edges that stay in the introducer keep their directions, and with them their frames.
    const int kept = distance >= 0.0 ? std::max(0, problem_.first - 1) : 0;
    guess_.director.leftCols(kept) = state_.director.leftCols(kept);
    guess_.reference_twist.head(kept) = state_.reference_twist.head(kept);
    transport_frames(state_, guess_, kept, rod_.nodes() - 2);
    turn_with_the_hub(guess_);
  }
  std::swap(state_, guess_);
  bend_at_the_exit();
  contact_.free_from(depth_);
  contact_.predict(distance);
  return statics_.solve(problem_, state_, newton_);
}

/// The solve, gone on from as long as it runs out of iterations; counts them.
NewtonResult Insertion::followed(NewtonResult solve, int& iterations) {
  iterations += solve.iterations;
  for (int k = 0; k < kFollowed; ++k) {
    if (solve.converged || solve.iterations != newton_.max_iterations) break;
    solve = follow_jump();
    iterations += solve.iterations;
  }
  return solve;
}

/// Goes on from where a solve ran out of iterations. That wire jumps, and its points slide by
/// millimetres: friction that is held to where they were, and lagged with points that others took
/// over from at the wall, may have no equilibrium. So anchors follow, and friction opposes the
/// rest of the jump.
NewtonResult Insertion::follow_jump() {
  forget_drift();
  totals_.friction_work += contact_.settle();
  contact_.predict(0.0);
  return statics_.solve(problem_, state_, newton_);
}

/// The introducer is straight: a node bends, and a free edge twists against the hub's, with that
/// part alone of its length of wire that is out of it.
void Insertion::bend_at_the_exit() {
  for (int i = exit_first_; i <= exit_last_; ++i) {
    rod_.bend[i] = whole_.bend[i];
    rod_.strip[i] = whole_.strip[i];
    rod_.rest_angle[i] = whole_.rest_angle[i];
    rod_.twist[i] = whole_.twist[i];
  }
  const int first = problem_.first, last = rod_.nodes() - 2;
  exit_first_ = first - 1;
  exit_last_ = std::min(first, last);
  for (int i = exit_first_; i <= exit_last_; ++i) {
    const double part = length_outside(i) / rod_.share[i];
    rod_.bend[i] = whole_.bend[i] / part;
    rod_.strip[i] = whole_.strip[i] / part;
    rod_.rest_angle[i] = whole_.rest_angle[i] * part;
  }
  if (first > last) return;
  // The edge at the exit turns with the hub: twist begins at the exit, not at that edge's middle.
  const double whole = twist_length(first), edge = rod_.rest_length[first - 1];
  rod_.twist[first] *= whole / (whole - 0.5 * edge + depth_ - rod_.tip_distance[first]);
}

/// Length of wire that twists at node i: to the middles of its edges, the tip's to its end [mm].
double Insertion::twist_length(int i) const {
  const double tip = i == rod_.nodes() - 2 ? 0.5 * rod_.rest_length[i] : 0.0;
  return rod_.share[i] + tip;
}

namespace {

/// Of a function that falls evenly from 1 to 0 over `length`, the integral from `start` on.
double rest_of_hat(double length, double start) {
  const double rest = std::max(0.0, length - start);
  return 0.5 * rest * rest / length;
}

}  // namespace

/// Length of wire outside that node i bends for: a node's share of a place falls evenly from 1 at
/// the node to 0 at the next. Wire that is bent evenly then comes out of the introducer as it lies,
/// wherever its nodes are, so that neither its shape nor its energy ripples as they come out; no
/// such share of all or nothing does that. At least a hundredth of its whole length [mm].
double Insertion::length_outside(int i) const {
  const double inside = rod_.tip_distance[i] - depth_;
  const double out = inside >= 0.0 ? rest_of_hat(rod_.rest_length[i], inside)
                                   : rod_.share[i] - rest_of_hat(rod_.rest_length[i - 1], -inside);
  return std::max(kSmallestPart * rod_.share[i], out);
}

Vec3 Insertion::at_rest(const Vec3& place) const {
  return places_at_rest(vessel_.sections.get(), state_.sections, place);
}

Eigen::Matrix3Xd Insertion::free_nodes_at_rest() const {
  return places_at_rest(vessel_.sections.get(), state_.sections, free_nodes());
}

/// Point of the present shape `distance` further along the wire than node i, which is that far from
/// the tip at least. Called for rising i.
Vec3 Insertion::ahead_of(int i, double distance) {
  const double wanted = rod_.tip_distance[i] - distance;
  while (ahead_ + 2 < rod_.nodes() && rod_.tip_distance[ahead_ + 1] > wanted) ++ahead_;
  const double part = (rod_.tip_distance[ahead_] - wanted) / rod_.rest_length[ahead_];
  return (1.0 - part) * state_.x.col(ahead_) + part * state_.x.col(ahead_ + 1);
}

/// The hand's force on the wire along the introducer. What it holds against is the wire, and the
/// wall where it pushes on the edge at the exit; and as it lets out bent wire at the exit, this
/// pushes outward by M^2/(2 EI), the configurational force of a sliding sleeve (Bigoni et al.,
/// "Eshelby-like forces acting on elastic structures", Mech. Mater. 2015); so does twisted wire, by
/// T^2/(2 GJ). Without friction it is the slope of the energy in equilibrium over the insertion.
double Insertion::push_force(const HeldEnd& held) const {
  double force = held.force.dot(introducer_.direction);
  for (const Touch& touch : touches_) {
    if (touch.edge >= problem_.first) break;
    force -= (1.0 - touch.part) * force_on_wire(touch).dot(introducer_.direction);
  }
  for (int i = exit_first_; i <= exit_last_; ++i) {
    const double out = length_outside(i);
    if (out == kSmallestPart * rod_.share[i]) continue;
    const double inside = rod_.tip_distance[i] - depth_;
    const double hat = 1.0 - std::abs(inside) / rod_.rest_length[inside >= 0.0 ? i : i - 1];
    force += std::max(0.0, hat) * Statics::bend_per_length(rod_, state_, i, out);
  }
  const int first = problem_.first;
  if (rod_.twisted && first < rod_.nodes() - 1) {
    const double torque = rod_.twist[first] * (state_.theta[first] - state_.theta[first - 1] +
                                               state_.reference_twist[first]);
    force -= 0.5 * torque * torque / (whole_.twist[first] * twist_length(first));
  }
  return force;
}

Vec3 Insertion::turn_at(int i) const {
  return edge(i) / rod_.rest_length[i] - edge(i - 1) / rod_.rest_length[i - 1];
}

/// Weight counts from where the wire comes out of the introducer, so that a node adds nothing as it
/// does.
double Insertion::stored_energy(const NewtonResult& solve) const {
  if (problem_.load == nullptr) return solve.energy;
  const Vec3 free = weight_.rightCols(rod_.nodes() - problem_.first).rowwise().sum();
  return solve.energy + free.dot(introducer_.point);
}

/// After an equilibrium: what slipped, and the work of the hand's forces before and after.
void Insertion::settle(double distance, double angle) {
  touches_ = contact_.touches();
  deepest_ = 0.0;
  for (const Touch& touch : touches_) {
    deepest_ = std::max(deepest_, touch.penetration + touch.wall_displacement);
  }
  const HeldEnd held = Statics::held_end(problem_, state_);
  const double force = push_force(held);
  totals_.push_work +=
      0.5 * ((force + totals_.push_force) * distance + (held.torque + totals_.hub_torque) * angle);
  totals_.push_force = force;
  totals_.hub_torque = held.torque;
  totals_.friction_work += contact_.settle();
}

/// Work and mean force of the hand in the move that has just been made.
void Insertion::find_work(Push& record) {
  const Push& before = before_move_.totals;
  const double distance = depth_ - before_move_.depth;
  record.push_force = totals_.push_force - balance_.ripple();
  if (distance != 0.0) {
    const double by_forces = totals_.push_work - before.push_work;
    const double by_energy =
        totals_.stored_energy - before.stored_energy + totals_.friction_work - before.friction_work;
    const double work = by_energy + balance_.find_release(distance, by_forces, by_energy);
    totals_.push_work = before.push_work + work;
    record.push_force = work / distance;
  }
  record.push_work = totals_.push_work;
  record.unbalanced = balance_.unbalanced();
}

/// Forces and shape of the present equilibrium.
void Insertion::measure(Push& record) {
  const int n = rod_.nodes();
  record.insertion = depth_;
  record.tip = tip();
  record.hub_angle = hub_angle_;
  record.hub_torque = totals_.hub_torque;
  record.stored_energy = totals_.stored_energy;
  record.friction_work = totals_.friction_work;

  Vec3 at_tip = Vec3::Zero();
  forces_.setZero();
  triangle_forces_.clear();
  record.peak_contact_force = peak_force_on_length(touches_, kContactLength, force_sums_);
  for (const Touch& touch : touches_) {
    const Vec3 force = force_on_wire(touch);
    record.total_contact_force += touch.normal_force;
    record.friction_force += touch.friction.norm();
    record.max_penetration = std::max(record.max_penetration, touch.penetration);
    if (touch.wall_displacement > record.wall_displacement) {
      record.wall_displacement = touch.wall_displacement;
      record.wall_displacement_point = touch.position - rod_.radius * touch.normal;
    }
    at_tip += part_within(touch, kTipRegion) * force;
    forces_.col(touch.edge) += (1.0 - touch.part) * force;
    forces_.col(touch.edge + 1) += touch.part * force;
    if (!options_.map_forces) continue;
    std::int32_t& triangle = mapped_[static_cast<std::size_t>(touch.point)];
    triangle =
        vessel_.locator
            .pierced(touch.rest - rod_.radius * touch.rest_normal, touch.rest_normal, triangle)
            .triangle;
    if (triangle >= 0) triangle_forces_.emplace_back(triangle, touch.normal_force);
  }
  if (contact_.latest().lost) {
    record.max_penetration = std::max(record.max_penetration, vessel_.lumen.band());
  }
  record.tip_force = at_tip.norm();
  for (int i = std::max(1, problem_.first); i + 1 < n; ++i) {
    record.peak_curvature = std::max(record.peak_curvature, turn_at(i).norm() / rod_.share[i]);
  }
  add_triangle_forces();
}

void Insertion::add_triangle_forces() {
  std::sort(triangle_forces_.begin(), triangle_forces_.end());
  for (std::size_t k = 0; k < triangle_forces_.size();) {
    const int triangle = triangle_forces_[k].first;
    double force = 0.0;
    for (; k < triangle_forces_.size() && triangle_forces_[k].first == triangle; ++k) {
      force += triangle_forces_[k].second;
    }
    double& peak = peak_forces_[triangle];
    peak = std::max(peak, force);
  }
}

PushTerms Insertion::terms() const {
  PushTerms terms;
  Problem wire = problem_;
  wire.contact = nullptr;  // its energy is known: to sample it anew would change its lag
  Eigen::Matrix3Xd unused(3, rod_.nodes());
  terms.energy = Statics::evaluate(wire, state_, unused);
  terms.energy.wall = wall_energy_;
  terms.energy.load += stored_energy({});
  terms.energy.contact = totals_.stored_energy - terms.energy.total();
  terms.tip_roll = introducer_.roll + hub_angle_;
  if (!rod_.twisted) return terms;
  const int last = rod_.nodes() - 2;
  terms.tip_roll += state_.theta[last] - state_.theta[problem_.first - 1];
  for (int i = problem_.first; i <= last; ++i) terms.tip_roll += state_.reference_twist[i];
  return terms;
}

std::vector<WireContact> Insertion::contacts() {
  Eigen::Matrix3Xd unused(3, rod_.nodes());
  Statics::evaluate(problem_, state_, unused);  // a restored state was not sampled last
  std::vector<WireContact> list;
  for (const Touch& touch : contact_.touches()) {
    list.push_back(contact_of(touch, rod_.radius, vessel_.locator));
    list.back().node -= problem_.first;
  }
  return list;
}

std::vector<TriangleForce> Insertion::peak_forces() const {
  std::vector<TriangleForce> list;
  for (const auto& [triangle, force] : peak_forces_) list.push_back({triangle, force});
  return list;
}

}  // namespace wireplan::simulate
