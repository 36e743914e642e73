#include "simulate/trial.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

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
    case Outcome::kLeftLumen:
      return "left_lumen";
    case Outcome::kNotConverged:
      return "not_converged";
    case Outcome::kFailed:
      return "failed";
  }
  return "failed";
}

namespace {

constexpr double kTipRegion = 2.0;   // wire that counts as tip for its force            [mm]
constexpr double kStuckPush = 20.0;  // pushing so far ...                               [mm]
constexpr double kStuckMove = 2.0;   // ... while the tip moves less than this is stuck  [mm]
constexpr double kOutside = 1.0;     // penetration that contact does not explain        [mm]
constexpr double kGuessInto = 0.5;   // a guessed tip may lie this deep in the wall: contact bends
                                     // the wire back more smoothly than a guess could [mm]
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

/// The wire on its way in: its state, and what one push does to it.
class Insertion {
 public:
  Insertion(const Wire& wire, const Introducer& introducer, const Lumen& lumen,
            const InsertionOptions& options)
      : introducer_(introducer), options_(options) {
    // Two nodes more than go in, so that the innermost free node bends against a straight
    // introducer.
    const double h = options.element_length;
    const int wanted = static_cast<int>(std::ceil(options.length / h - 1e-9)) + 2;
    const int available = static_cast<int>(std::floor(wire.length() / h + 1e-9));
    expects(available >= 4);
    const int elements = std::min(wanted, available);
    rod_ = build_rod(wire, elements * h, elements);
    longest_ = std::min(options.length, (elements - 2) * h);
    const Vec3 start = introducer.point - elements * h * introducer.direction;
    state_ = straight_state(rod_, start, introducer.direction, introducer.roll);
    first_curved_ = rod_.nodes();
    for (int i = rod_.nodes() - 1; i >= 0; --i) {
      if (rod_.rest_angle[i] != 0.0) first_curved_ = i;
    }
    problem_.rod = &rod_;
    problem_.last = rod_.nodes();
    problem_.lumen = &lumen;
    newton_ = {.residual_tolerance = options.residual_tolerance,
               .max_iterations = options.max_iterations};
    forces_ = Eigen::Matrix3Xd::Zero(3, rod_.nodes());
    gradient_.resize(3, rod_.nodes());
    guess_ahead_.resize(3, rod_.nodes());
  }

  double longest() const { return longest_; }
  double depth() const { return depth_; }
  const Rod& rod() const { return rod_; }
  Vec3 tip() const { return state_.x.rightCols<1>(); }
  int first_free() const { return problem_.first; }
  Eigen::Matrix3Xd free_nodes() const { return state_.x.rightCols(rod_.nodes() - problem_.first); }
  const Eigen::Matrix3Xd& forces() const { return forces_; }

  /// One push by `distance`, cut smaller where it has no equilibrium. Empty when even the smallest
  /// cut has none.
  std::optional<Push> push(double distance) {
    Push record;
    const double target = depth_ + distance;
    double cut = distance;
    while (depth_ < target - 1e-9) {
      const RodState before = state_;
      const double from = depth_;
      const NewtonResult solve = advance(std::min(cut, target - depth_));
      record.iterations += solve.iterations;
      if (solve.converged) {
        record.residual = solve.residual;
        continue;
      }
      state_ = before;
      depth_ = from;
      cut *= 0.5;
      if (cut < kSmallestCut * distance) return std::nullopt;
    }
    measure(record);
    return record;
  }

  /// Contacts of the present shape; nodes counted from the first free one.
  std::vector<NodeContact> contacts() const {
    std::vector<NodeContact> list;
    for (int i = problem_.first; i < rod_.nodes(); ++i) {
      if (forces_.col(i).isZero(0.0)) continue;
      const WallSample wall = problem_.lumen->sample(state_.x.col(i));
      const Vec3 outward = -wall.gradient.normalized();
      list.push_back({.node = i - problem_.first,
                      .point = state_.x.col(i) + rod_.radius * outward,
                      .force = forces_.col(i),
                      .penetration = std::max(0.0, rod_.radius - wall.distance)});
    }
    return list;
  }

  /// Takes the wire back to an earlier state.
  struct Snapshot {
    RodState state;
    double depth;
    int first;
    Eigen::Matrix3Xd forces;
  };
  Snapshot snapshot() const { return {state_, depth_, problem_.first, forces_}; }
  void restore(const Snapshot& snapshot) {
    state_ = snapshot.state;
    depth_ = snapshot.depth;
    problem_.first = snapshot.first;
    forces_ = snapshot.forces;
  }

 private:
  /// Moves the introducer's part by `distance`, guesses the rest and finds its equilibrium.
  NewtonResult advance(double distance) {
    guess_ = state_;
    depth_ += distance;
    // Nodes in the introducer lie on its axis; the others go where the wire ahead of them was.
    const int n = rod_.nodes();
    problem_.first = n;
    for (int i = 0; i < n; ++i) {
      const double behind = rod_.tip_distance[i] - depth_;
      if (behind >= -1e-9) {
        guess_.x.col(i) = introducer_.point - behind * introducer_.direction;
        guess_ahead_.col(i) = guess_.x.col(i);
      } else {
        problem_.first = std::min(problem_.first, i);
        guess_ahead_.col(i) = ahead_of(i, distance);
      }
    }
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
    return statics_.solve(problem_, state_, newton_);
  }

  /// Point of the present shape `distance` further along the wire than node i; past the tip,
  /// straight on, but not into the wall.
  Vec3 ahead_of(int i, double distance) const {
    const int n = rod_.nodes();
    const double h = options_.element_length;
    const double steps = distance / h;
    const int whole = static_cast<int>(steps);
    if (i + whole + 1 < n) {
      const double part = steps - whole;
      return (1.0 - part) * state_.x.col(i + whole) + part * state_.x.col(i + whole + 1);
    }
    const Vec3 end = state_.x.col(n - 1);
    const Vec3 tangent = (end - state_.x.col(n - 2)).normalized();
    Vec3 p = end + (distance - rod_.tip_distance[i]) * tangent;
    for (int round = 0; round < 2; ++round) {
      const WallSample wall = problem_.lumen->sample(p);
      const double deep = rod_.radius - wall.distance - kGuessInto;
      if (deep > 0.0) p += deep * wall.gradient;
    }
    return p;
  }

  /// Forces and shape of the present equilibrium.
  void measure(Push& record) {
    const int n = rod_.nodes();
    record.insertion = depth_;
    record.tip = tip();
    Statics::evaluate(problem_, state_, gradient_);
    for (int i = std::max(0, problem_.first - 2); i < problem_.first; ++i) {
      record.push_force += gradient_.col(i).dot(introducer_.direction);
    }

    Vec3 group = Vec3::Zero(), at_tip = Vec3::Zero();
    forces_.setZero();
    const auto close_group = [&] {
      record.peak_contact_force = std::max(record.peak_contact_force, group.norm());
      group.setZero();
    };
    for (int i = problem_.first; i < n; ++i) {
      const WallSample wall = problem_.lumen->sample(state_.x.col(i));
      const double gap = wall.distance - rod_.radius;
      const ContactLaw::Value law = problem_.contact.at(gap);
      record.max_penetration = std::max(record.max_penetration, -gap);
      if (law.slope == 0.0) {
        close_group();
        continue;
      }
      const Vec3 force = -rod_.share[i] * law.slope * wall.gradient;
      forces_.col(i) = force;
      group += force;
      record.total_contact_force += force.norm();
      if (rod_.tip_distance[i] <= kTipRegion) at_tip += force;
    }
    close_group();
    record.tip_force = at_tip.norm();
    for (int i = std::max(1, problem_.first); i + 1 < n; ++i) {
      const Vec3 u = (state_.x.col(i + 1) - state_.x.col(i)) / rod_.rest_length[i] -
                     (state_.x.col(i) - state_.x.col(i - 1)) / rod_.rest_length[i - 1];
      record.peak_curvature = std::max(record.peak_curvature, u.norm() / rod_.share[i]);
    }
  }

  Introducer introducer_;
  InsertionOptions options_;
  Rod rod_;
  RodState state_, guess_;
  Problem problem_;
  NewtonOptions newton_;
  Statics statics_;
  int first_curved_ = 0;  // first node with a rest angle; the number of nodes where there is none
  double depth_ = 0.0, longest_ = 0.0;
  Eigen::Matrix3Xd forces_, gradient_, guess_ahead_;
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
                      const Lumen& lumen, const InsertionOptions& options) {
  expects(std::abs(introducer.direction.norm() - 1.0) < 1e-6);
  expects(options.length > 0.0 && options.step > 0.0 && options.element_length > 0.0);
  TrialResult result;
  Insertion insertion(wire, introducer, lumen, options);
  result.terms = {"stretch", "bend"};
  if (insertion.rod().twisted) result.terms.push_back("twist");
  result.terms.push_back("contact");

  double best_distance = (insertion.tip() - goal.point).norm();
  const auto finish = [&](Outcome outcome, const std::string& reason) {
    result.outcome = outcome;
    result.reason = reason;
    result.nodes = insertion.free_nodes();
    result.contacts = insertion.contacts();
    record_shape(insertion, options.record_every, true, result);
    return result;
  };

  while (insertion.depth() < insertion.longest() - 1e-9) {
    const Insertion::Snapshot before = insertion.snapshot();
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
    if (push->max_penetration > kOutside) {
      return finish(Outcome::kLeftLumen, millimetres(push->max_penetration) +
                                             " through the wall after " +
                                             millimetres(insertion.depth()) +
                                             " of insertion, tip at " + place(push->tip));
    }
    const std::size_t back = static_cast<std::size_t>(std::ceil(kStuckPush / options.step));
    if (result.pushes.size() > back) {
      const Vec3 then = result.pushes[result.pushes.size() - 1 - back].tip;
      if ((push->tip - then).norm() < kStuckMove) {
        return finish(Outcome::kStuck, "the tip stays at " + place(push->tip) + " while " +
                                           millimetres(kStuckPush) + " of wire went in");
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
