#include "simulate/trial.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <utility>

#include "simulate/solver.h"

namespace wireplan::simulate {

const char* outcome_name(Outcome outcome) {
  switch (outcome) {
    case Outcome::kReached:
      return "reached";
    case Outcome::kMissed:
      return "missed";
    case Outcome::kStuck:
      return "stuck";
    case Outcome::kProlapsed:
      return "prolapsed";
    case Outcome::kLeftOpening:
      return "left_opening";
    case Outcome::kLeftLumen:
      return "left_lumen";
    case Outcome::kNotConverged:
      return "not_converged";
    case Outcome::kFailed:
      return "failed";
  }
  return "failed";
}

WireContact contact_of(const Touch& touch, double wire_radius, const TriangleLocator& locator) {
  const bool at_next = touch.part == 1.0;
  const Vec3 point = touch.position - wire_radius * touch.normal;
  return {.node = touch.edge + (at_next ? 1 : 0),
          .part = at_next ? 0.0 : touch.part,
          .triangle = locator.nearest(point).triangle,
          .point = point,
          .normal_force = touch.normal_force * touch.normal,
          .friction_force = touch.friction,
          .penetration = touch.penetration,
          .wall_displacement = touch.wall_displacement};
}

namespace {

constexpr double kTipRegion = 2.0;     // wire that counts as tip for its force            [mm]
constexpr double kStuckPush = 20.0;    // pushing so far ...                               [mm]
constexpr double kStuckMove = 2.0;     // ... while the tip moves less than this is stuck  [mm]
constexpr double kProlapseMove = 0.5;  // ... or by less than this part of it, with a fold
constexpr double kFoldTurn = 150.0 * kRadPerDeg;  // turning beyond the rest shape's that is one
constexpr double kFoldLead = 10.0;    // ... with the bow so far ahead of the tip            [mm]
constexpr double kFoldLength = 60.0;  // ... within so much wire                [mm]
constexpr double kOutside = 1.0;      // penetration that contact does not explain        [mm]
constexpr double kGuessInto = 0.5;    // a guess may lie this much deeper in the wall than the wire
                                      // did: contact bends it back more smoothly than a guess
                                      // could [mm]
constexpr double kSnap = 2.0;         // way off the path per push that is a jump, not to go on
constexpr double kKeptDrift = 0.8;    // of the last push's way off the path, in the next
constexpr double kSmallestPart = 0.05;  // of a node's share of wire that bends at the exit
constexpr double kLongestPart = 2.0;  // of a push: friction turns with the path               [mm]
constexpr double kSmallestCut = 1.0 / 16.0;  // of a push, when one does not converge

std::string place(const Vec3& p) {
  char text[80];
  std::snprintf(text, sizeof text, "(%.1f, %.1f, %.1f) mm", p[0], p[1], p[2]);
  return text;
}

std::string millimetres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", value);
  return text;
}

/// Edges of the part of the wire that goes in, proximal to distal, and two more, so that the
/// innermost free node bends against a straight introducer.
Eigen::VectorXd layout(const Wire& wire, const InsertionOptions& options) {
  std::vector<double> from_tip;
  double sum = 0.0;
  int beyond = 0;
  const auto add = [&](double l) {
    if (sum >= options.length - 1e-9) ++beyond;
    sum += l;
    from_tip.push_back(l);
  };
  const std::vector<double>& asked = options.section_element_length;
  if (asked.empty()) {
    const double h = options.element_length;
    const int available = static_cast<int>(std::floor(wire.length() / h + 1e-9));
    for (int i = 0; i < available && beyond < 2; ++i) add(h);
  } else {
    expects(asked.size() == wire.sections.size());
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const double length = wire.sections[k].length;
      const double most = asked[k] > 0.0 ? asked[k] : options.element_length;
      const int count = std::max(1, static_cast<int>(std::ceil(length / most - 1e-9)));
      for (int i = 0; i < count && beyond < 2; ++i) add(length / count);
    }
  }
  expects(from_tip.size() >= 4);
  std::reverse(from_tip.begin(), from_tip.end());
  return Eigen::Map<const Eigen::VectorXd>(from_tip.data(),
                                           static_cast<Eigen::Index>(from_tip.size()));
}

ContactOptions contact_options(const InsertionOptions& options) {
  ContactOptions contact;
  contact.spacing = options.contact_spacing;
  contact.friction = options.friction;
  return contact;
}

/// The wire on its way in: its state, and what one push does to it.
class Insertion {
 public:
  Insertion(const Wire& wire, const Introducer& introducer, const VesselModel& vessel,
            const InsertionOptions& options)
      : introducer_(introducer),
        options_(options),
        vessel_(vessel),
        rod_(build_rod(wire, layout(wire, options))),
        contact_(rod_, vessel, contact_options(options)) {
    const int n = rod_.nodes();
    longest_ = std::min(options.length, rod_.tip_distance[2]);
    full_bend_ = rod_.bend;
    full_rest_angle_ = rod_.rest_angle;
    const Vec3 start = introducer.point - rod_.tip_distance[0] * introducer.direction;
    state_ = straight_state(rod_, start, introducer.direction, introducer.roll);
    first_curved_ = n;
    for (int i = n - 1; i >= 0; --i) {
      if (rod_.rest_angle[i] != 0.0) first_curved_ = i;
    }
    problem_.rod = &rod_;
    problem_.first = n;
    problem_.last = n;
    problem_.contact = &contact_;
    newton_ = {.residual_tolerance = options.residual_tolerance,
               .max_iterations = options.max_iterations};
    contact_.start_at(state_.x);
    forces_ = Eigen::Matrix3Xd::Zero(3, n);
    guess_ahead_.resize(3, n);
    path_.resize(3, n);
    drift_ = Eigen::Matrix3Xd::Zero(3, n);
  }

  double longest() const { return longest_; }
  double depth() const { return depth_; }
  const Rod& rod() const { return rod_; }
  Vec3 tip() const { return state_.x.rightCols<1>(); }
  int first_free() const { return problem_.first; }
  Eigen::Matrix3Xd free_nodes() const { return state_.x.rightCols(rod_.nodes() - problem_.first); }
  const Eigen::Matrix3Xd& forces() const { return forces_; }

  /// One push by `distance`, in parts that friction can follow, cut smaller where one has no
  /// equilibrium. Empty when even the smallest cut has none.
  std::optional<Push> push(double distance) {
    Push record;
    const double target = depth_ + distance;
    double cut = std::min(distance, kLongestPart);
    while (depth_ < target - 1e-9) {
      before_cut_ = state_;
      const double from = depth_;
      const NewtonResult solve = advance(std::min(cut, target - depth_));
      record.iterations += solve.iterations;
      if (solve.converged) {
        record.residual = solve.residual;
        totals_.stored_energy = solve.energy;
        settle(depth_ - from);
        continue;
      }
      std::swap(state_, before_cut_);
      depth_ = from;
      cut *= 0.5;
      if (cut < kSmallestCut * distance) return std::nullopt;
    }
    measure(record);
    return record;
  }

  /// Contacts of the present shape; nodes counted from the first free one.
  std::vector<WireContact> contacts() {
    Eigen::Matrix3Xd unused(3, rod_.nodes());
    Statics::evaluate(problem_, state_, unused);  // a restored state was not sampled last
    std::vector<WireContact> list;
    for (const Touch& touch : contact_.touches()) {
      list.push_back(contact_of(touch, rod_.radius, vessel_.locator));
      list.back().node -= problem_.first;
    }
    return list;
  }

  std::vector<TriangleForce> peak_forces() const {
    std::vector<TriangleForce> list;
    for (const auto& [triangle, force] : peak_forces_) list.push_back({triangle, force});
    return list;
  }

  /// Where the wire has turned back on itself, within a short length and more than at rest, so that
  /// its bow leads and its tip is behind.
  std::optional<Vec3> find_fold() const {
    const int n = rod_.nodes();
    for (int i = problem_.first; i + 1 < n; ++i) {
      const Vec3 from = edge(i).normalized();
      double rest = 0.0, length = 0.0;
      Vec3 bow = state_.x.col(i);
      for (int j = i + 1; j + 1 < n && length < kFoldLength; ++j) {
        length += rod_.rest_length[j];
        rest += std::abs(rod_.rest_angle[j]);
        if (from.dot(state_.x.col(j) - bow) > 0.0) bow = state_.x.col(j);
        const double turn = std::acos(std::clamp(from.dot(edge(j).normalized()), -1.0, 1.0));
        const bool leads = from.dot(bow - tip()) > kFoldLead &&
                           (bow - introducer_.point).norm() > (tip() - introducer_.point).norm();
        if (turn - rest > kFoldTurn && leads) return bow;
      }
    }
    return {};
  }
  Vec3 most_bent() const {
    int most = std::min(problem_.first, rod_.nodes() - 2);
    for (int i = most; i + 1 < rod_.nodes(); ++i) {
      if (turn_at(i).norm() / rod_.share[i] > turn_at(most).norm() / rod_.share[most]) most = i;
    }
    return state_.x.col(most);
  }

  /// Takes the wire back to an earlier state.
  struct Snapshot {
    RodState state;
    double depth = 0.0;
    int first = 0;
    Eigen::Matrix3Xd forces;
    WallContact::Memory memory;
  };
  void save(Snapshot& snapshot) const {
    snapshot = {state_, depth_, problem_.first, forces_, contact_.memory()};
  }
  void restore(const Snapshot& snapshot) {
    state_ = snapshot.state;
    depth_ = snapshot.depth;
    problem_.first = snapshot.first;
    forces_ = snapshot.forces;
    contact_.restore(snapshot.memory);
    contact_.free_from(depth_);
    drift_.setZero();
    bend_at_the_exit();
  }

 private:
  /// Moves the introducer's part by `distance`, guesses the rest and finds its equilibrium.
  NewtonResult advance(double distance) {
    guess_ = state_;
    depth_ += distance;
    // Nodes in the introducer lie on its axis; the others go where the wire ahead of them was, and
    // most of what they came off that path in the last push, per length of it, unless that leads
    // through the wall.
    const int n = rod_.nodes();
    problem_.first = n;
    ahead_ = 0;
    bool through = false;
    for (int i = 0; i < n; ++i) {
      const double behind = rod_.tip_distance[i] - depth_;
      if (behind >= -1e-9) {
        guess_.x.col(i) = introducer_.point - behind * introducer_.direction;
        guess_ahead_.col(i) = path_.col(i) = guess_.x.col(i);
      } else {
        problem_.first = std::min(problem_.first, i);
        path_.col(i) = ahead_of(i, distance);
        const Vec3 way = (kKeptDrift * distance) * drift_.col(i);
        guess_ahead_.col(i) = path_.col(i) + way;
        through = through || (way.norm() > kGuessInto &&
                              vessel_.lumen.distance(guess_ahead_.col(i)) < -kGuessInto - deepest_);
      }
    }
    if (through) guess_ahead_ = path_;
    // Keep the edges' lengths of before, and a curved tip's shape, which turns with the edge that
    // carries it: a guess that strains or unbends a stiff wire costs more than one that lies a
    // little in the wall.
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    for (int i = problem_.first; i < n; ++i) {
      const Vec3 before = state_.x.col(i) - state_.x.col(i - 1);
      Vec3 edge = guess_ahead_.col(i) - guess_ahead_.col(i - 1);
      if (i > first_curved_) edge = turn * before;
      if (i == first_curved_) turn.setFromTwoVectors(before, edge);
      guess_.x.col(i) = guess_.x.col(i - 1) + (before.norm() / edge.norm()) * edge;
    }
    if (rod_.twisted) transport_frames(state_, guess_, 0, n - 2);
    std::swap(state_, guess_);
    bend_at_the_exit();
    contact_.free_from(depth_);
    contact_.predict(distance);
    const NewtonResult result = statics_.solve(problem_, state_, newton_);
    if (result.converged) {
      drift_ = (state_.x - path_) / distance;
      if (drift_.colwise().norm().maxCoeff() > kSnap) drift_.setZero();
    }
    return result;
  }

  /// The introducer is straight: a node bends with that part alone of its share of the wire that is
  /// out of it. A node at the exit is then half a bend element, the second-order clamp of design 7.
  void bend_at_the_exit() {
    for (int i = exit_first_; i <= exit_last_; ++i) {
      rod_.bend[i] = full_bend_[i];
      rod_.rest_angle[i] = full_rest_angle_[i];
    }
    exit_first_ = std::max(1, problem_.first - 3);
    exit_last_ = std::min(problem_.first + 1, rod_.nodes() - 2);
    for (int i = exit_first_; i <= exit_last_; ++i) {
      const double part = part_outside(i);
      rod_.bend[i] = full_bend_[i] / std::max(kSmallestPart, part);
      rod_.rest_angle[i] = full_rest_angle_[i] * part;
    }
  }
  double part_outside(int i) const {
    const double out = depth_ - rod_.tip_distance[i] + 0.5 * rod_.rest_length[i];
    return std::clamp(out / rod_.share[i], 0.0, 1.0);
  }

  /// Point of the present shape `distance` further along the wire than node i; past the tip,
  /// straight on, but not into the wall. Called for rising i.
  Vec3 ahead_of(int i, double distance) {
    const int n = rod_.nodes();
    const double wanted = rod_.tip_distance[i] - distance;
    if (wanted >= 0.0) {
      while (ahead_ + 2 < n && rod_.tip_distance[ahead_ + 1] > wanted) ++ahead_;
      const double part = (rod_.tip_distance[ahead_] - wanted) / rod_.rest_length[ahead_];
      return (1.0 - part) * state_.x.col(ahead_) + part * state_.x.col(ahead_ + 1);
    }
    const Vec3 end = state_.x.col(n - 1);
    const Vec3 tangent = (end - state_.x.col(n - 2)).normalized();
    Vec3 p = end - wanted * tangent;
    for (int round = 0; round < 2; ++round) {
      const WallSample wall = vessel_.lumen.sample(p);
      const double deep = rod_.radius - wall.distance - kGuessInto - deepest_;
      if (deep > 0.0) p += deep * wall.gradient;
    }
    return p;
  }

  /// The hand's force on the wire along the introducer. What it holds against is the wire, and the
  /// wall where it pushes on the edge at the exit; and as it lets out bent wire at the exit, this
  /// pushes outward by M^2/(2 EI), the configurational force of a sliding sleeve (Bigoni et al.,
  /// "Eshelby-like forces acting on elastic structures", Mech. Mater. 2015).
  double push_force() const {
    double force = Statics::held_force(problem_, state_).dot(introducer_.direction);
    for (const Touch& touch : touches_) {
      if (touch.edge >= problem_.first) break;
      force -= (1.0 - touch.part) * force_on_wire(touch).dot(introducer_.direction);
    }
    for (int i = std::max(1, problem_.first - 3); i + 1 < rod_.nodes(); ++i) {
      if (part_outside(i) <= kSmallestPart) continue;
      const double moment = rod_.bend[i] * (turn_at(i).norm() - rod_.rest_angle[i]);
      const double EI = full_bend_[i] * rod_.share[i];
      force -= moment * moment / (2.0 * EI) + moment * full_rest_angle_[i] / rod_.share[i];
      break;
    }
    return force;
  }

  static Vec3 force_on_wire(const Touch& touch) {
    return touch.normal_force * touch.normal + touch.friction;
  }
  Vec3 edge(int i) const { return state_.x.col(i + 1) - state_.x.col(i); }
  Vec3 turn_at(int i) const {
    return edge(i) / rod_.rest_length[i] - edge(i - 1) / rod_.rest_length[i - 1];
  }

  /// After an equilibrium: what slipped, and the work of the push by `distance`.
  void settle(double distance) {
    touches_ = contact_.touches();
    deepest_ = 0.0;
    for (const Touch& touch : touches_) {
      deepest_ = std::max(deepest_, touch.penetration + touch.wall_displacement);
    }
    const double force = push_force();
    totals_.push_work += 0.5 * (force + totals_.push_force) * distance;
    totals_.push_force = force;
    totals_.friction_work += contact_.settle();
  }

  /// Forces and shape of the present equilibrium.
  void measure(Push& record) {
    const int n = rod_.nodes();
    record.insertion = depth_;
    record.tip = tip();
    record.push_force = totals_.push_force;
    record.push_work = totals_.push_work;
    record.stored_energy = totals_.stored_energy;
    record.friction_work = totals_.friction_work;

    Vec3 group = Vec3::Zero(), at_tip = Vec3::Zero();
    forces_.setZero();
    triangle_forces_.clear();
    int previous = -2;
    for (const Touch& touch : touches_) {
      const Vec3 force = force_on_wire(touch);
      if (touch.point != previous + 1) group.setZero();
      previous = touch.point;
      group += force;
      record.peak_contact_force = std::max(record.peak_contact_force, group.norm());
      record.total_contact_force += touch.normal_force;
      record.friction_force += touch.friction.norm();
      record.max_penetration = std::max(record.max_penetration, touch.penetration);
      if (touch.wall_displacement > record.wall_displacement) {
        record.wall_displacement = touch.wall_displacement;
        record.wall_displacement_point = touch.position - rod_.radius * touch.normal;
      }
      if (touch.tip_distance <= kTipRegion) at_tip += force;
      forces_.col(touch.edge) += (1.0 - touch.part) * force;
      forces_.col(touch.edge + 1) += touch.part * force;
      const int triangle =
          vessel_.locator.nearest(touch.position - rod_.radius * touch.normal).triangle;
      if (triangle >= 0) triangle_forces_.emplace_back(triangle, touch.normal_force);
    }
    if (contact_.lost()) {
      record.max_penetration = std::max(record.max_penetration, vessel_.lumen.band());
    }
    record.tip_force = at_tip.norm();
    for (int i = std::max(1, problem_.first); i + 1 < n; ++i) {
      record.peak_curvature = std::max(record.peak_curvature, turn_at(i).norm() / rod_.share[i]);
    }
    add_triangle_forces();
  }

  void add_triangle_forces() {
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

  Introducer introducer_;
  InsertionOptions options_;
  const VesselModel& vessel_;
  Rod rod_;
  Eigen::VectorXd full_bend_, full_rest_angle_;  // of the rod, all of it outside
  WallContact contact_;
  RodState state_, guess_, before_cut_;
  Problem problem_;
  NewtonOptions newton_;
  Statics statics_;
  int first_curved_ = 0;  // first node with a rest angle; the number of nodes where there is none
  int ahead_ = 0;         // see ahead_of()
  int exit_first_ = 1, exit_last_ = 0;  // nodes that bend_at_the_exit() changed
  double deepest_ = 0.0;  // the wire was past the resting wall                            [mm]
  double depth_ = 0.0, longest_ = 0.0;
  Push totals_;             // push force, works and energy so far
  Eigen::Matrix3Xd path_;   // where the wire ahead of each node was before the last push   [mm]
  Eigen::Matrix3Xd drift_;  // off that path, per length of push
  Eigen::Matrix3Xd forces_, guess_ahead_;
  std::vector<Touch> touches_;
  std::vector<std::pair<int, double>> triangle_forces_;  // of this push
  std::map<int, double> peak_forces_;                    // of all pushes, by triangle
};

/// Keeps shapes at the asked spacing of insertion.
void record_shape(const Insertion& insertion, double every, bool always, TrialResult& result) {
  const double last = result.shapes.empty() ? 0.0 : result.shapes.back().insertion;
  if (!always && insertion.depth() - last < every - 1e-9) return;
  if (always && !result.shapes.empty() && last >= insertion.depth() - 1e-9) return;
  const int first = insertion.first_free();
  result.shapes.push_back({.insertion = insertion.depth(),
                           .nodes = insertion.free_nodes(),
                           .contact_force = insertion.forces()
                                                .rightCols(insertion.rod().nodes() - first)
                                                .colwise()
                                                .norm()
                                                .transpose()});
}

}  // namespace

TrialResult run_trial(const Wire& wire, const Introducer& introducer, const Goal& goal,
                      const VesselModel& vessel, const InsertionOptions& options) {
  expects(std::abs(introducer.direction.norm() - 1.0) < 1e-6);
  expects(options.length > 0.0 && options.step > 0.0 && options.element_length > 0.0);
  TrialResult result;
  Insertion insertion(wire, introducer, vessel, options);
  result.terms = {"stretch", "bend"};
  if (insertion.rod().twisted) result.terms.push_back("twist");
  result.terms.push_back("contact");
  if (options.friction > 0.0) result.terms.push_back("friction");
  if (vessel.compliance) result.terms.push_back("yielding_wall");

  double best_distance = (insertion.tip() - goal.point).norm();
  const auto finish = [&](Outcome outcome, const std::string& reason) {
    result.outcome = outcome;
    result.reason = reason;
    result.nodes = insertion.free_nodes();
    result.contacts = insertion.contacts();
    result.peak_forces = insertion.peak_forces();
    record_shape(insertion, options.record_every, true, result);
    return result;
  };

  Insertion::Snapshot before;
  while (insertion.depth() < insertion.longest() - 1e-9) {
    insertion.save(before);
    const double distance = std::min(options.step, insertion.longest() - insertion.depth());
    const std::optional<Push> push = insertion.push(distance);
    if (!push) {
      insertion.restore(before);
      return finish(Outcome::kNotConverged, "no equilibrium after " + millimetres(before.depth) +
                                                " of insertion, tip at " + place(insertion.tip()));
    }
    // Inside the goal the wire goes on until the tip is nearest to its centre.
    const double to_goal = (push->tip - goal.point).norm();
    if (best_distance <= goal.radius && to_goal >= best_distance) {
      insertion.restore(before);
      return finish(Outcome::kReached, "tip " + millimetres(best_distance) +
                                           " from the target after " + millimetres(before.depth) +
                                           " of insertion");
    }
    best_distance = to_goal;
    result.pushes.push_back(*push);
    if (const std::optional<int> opening = vessel.lumen.passed_opening(push->tip)) {
      return finish(Outcome::kLeftOpening,
                    "the tip left the vessel through the opening at " +
                        place(vessel.lumen.openings()[static_cast<std::size_t>(*opening)].center) +
                        " after " + millimetres(insertion.depth()) + " of insertion");
    }
    if (push->max_penetration > kOutside) {
      return finish(Outcome::kLeftLumen, millimetres(push->max_penetration) +
                                             " through the wall after " +
                                             millimetres(insertion.depth()) +
                                             " of insertion, tip at " + place(push->tip));
    }
    const std::size_t back = static_cast<std::size_t>(std::ceil(kStuckPush / options.step));
    if (result.pushes.size() > back) {
      const double went =
          insertion.depth() - result.pushes[result.pushes.size() - 1 - back].insertion;
      const Vec3 then = result.pushes[result.pushes.size() - 1 - back].tip;
      const double moved = (push->tip - then).norm();
      const std::optional<Vec3> fold =
          moved < kProlapseMove * went ? insertion.find_fold() : std::nullopt;
      if (fold) {
        return finish(Outcome::kProlapsed, "the wire folds back at " + place(*fold) + " after " +
                                               millimetres(insertion.depth()) +
                                               " of insertion; its tip is behind at " +
                                               place(push->tip));
      }
      if (moved < kStuckMove) {
        return finish(Outcome::kStuck, "the tip stays at " + place(push->tip) + " while " +
                                           millimetres(went) +
                                           " of wire went in; the wire bends most at " +
                                           place(insertion.most_bent()));
      }
    }
    record_shape(insertion, options.record_every, false, result);
  }
  if (best_distance <= goal.radius) {
    return finish(Outcome::kReached, "tip " + millimetres(best_distance) +
                                         " from the target after " +
                                         millimetres(insertion.depth()) + " of insertion");
  }
  return finish(Outcome::kMissed, "all " + millimetres(insertion.depth()) +
                                      " of wire went in, tip ended " + millimetres(best_distance) +
                                      " from the target at " + place(insertion.tip()));
}

}  // namespace wireplan::simulate
