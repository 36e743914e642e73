// An insertion that starts from a given shape of the wire.
#include <algorithm>
#include <cmath>

#include "simulate/insertion/insertion.h"
#include "simulate/insertion/start_line.h"

namespace wireplan::simulate {

namespace {

// Springs to the line, per length of wire. The first are as stiff as EI over the fourth power of
// some 5 mm, so that the wire lies where the line does; the last hold it less than its own weight
// would. Between them every solve starts near its answer, and friction takes over what they let go.
constexpr double kFirstSpring = 1.0;    //                                              [N/mm^2]
constexpr double kLastSpring = 1e-7;    //                                              [N/mm^2]
constexpr double kFade = 1.0 / 3.0;     // from one solve to the next; chosen
constexpr double kLeastFade = 1.0 / 8;  // ... of that, in powers, where one does not converge

}  // namespace

/// The roll at which the rest shape bends as the wire does, were it not twisted: the least energy
/// of rest bends, -B sin(r) u . m with m the mean material director of the two edges [rad].
double Insertion::roll_of_shape() const {
  double along = 0.0, across = 0.0;
  for (int i = std::max(1, problem_.first); i + 1 < rod_.nodes(); ++i) {
    if (rod_.rest_angle[i] == 0.0) continue;
    const double pull = rod_.bend[i] * std::sin(rod_.rest_angle[i]);
    const Vec3 turned = edge(i).normalized() - edge(i - 1).normalized();
    for (const int k : {i - 1, i}) {
      const Vec3 director = state_.director.col(k);
      along += pull * turned.dot(director);
      across += pull * turned.dot(edge(k).normalized().cross(director));
    }
  }
  return along == 0.0 && across == 0.0 ? introducer_.roll : std::atan2(across, along);
}

/// Lays the wire along the line, unstretched and without twist.
void Insertion::lay_along(const StartLine& start, Springs& springs) {
  const int n = rod_.nodes();
  const Eigen::Matrix3Xd line = line_from_entry(start.nodes, introducer_.point);
  const double of_line = arc_length(line);
  depth_ = std::min(start.length > 0.0 ? start.length : of_line, longest_);
  problem_.first = n;
  springs.place.resize(3, n);
  springs.stiffness = rod_.share;
  springs.stiffness[n - 1] = 0.5 * rod_.rest_length[n - 2];
  for (int i = n - 1; i >= 0; --i) {
    const double behind = rod_.tip_distance[i] - depth_;
    if (behind >= -1e-9) {
      springs.place.col(i) = introducer_.point - behind * introducer_.direction;
    } else {
      problem_.first = i;
      springs.place.col(i) = point_at_arc(line, -behind * of_line / depth_);
    }
  }
  bring_into_lumen(vessel_.lumen, rod_.radius, problem_.first, springs.place);
  state_.x.leftCols(problem_.first) = springs.place.leftCols(problem_.first);
  for (int i = problem_.first; i < n; ++i) {
    const Vec3 way = springs.place.col(i) - state_.x.col(i - 1);
    state_.x.col(i) = state_.x.col(i - 1) + rod_.rest_length[i - 1] * way.normalized();
  }
  if (!rod_.twisted) return;
  for (int i = 1; i + 1 < n; ++i) {
    const Vec3 before = edge(i - 1).normalized(), here = edge(i).normalized();
    Vec3 director = parallel_transport(state_.director.col(i - 1), before, here);
    director -= director.dot(here) * here;
    state_.director.col(i) = director.normalized();
  }
  state_.reference_twist.setZero();
}

std::optional<Push> Insertion::start(const StartLine& start) {
  expects(depth_ == 0.0 && start.nodes.cols() >= 2);
  Springs springs;
  lay_along(start, springs);
  if (start.find_roll && rod_.twisted) introducer_.roll = roll_of_shape();
  if (rod_.twisted) state_.theta.setConstant(introducer_.roll);
  bend_at_the_exit();
  contact_.free_from(depth_);
  contact_.start_at(state_);

  Push record;
  const Eigen::VectorXd share = springs.stiffness;
  const auto solve_with = [&](double stiffness) {
    springs.stiffness = stiffness * share;
    problem_.springs = stiffness > 0.0 ? &springs : nullptr;
    contact_.predict(0.0);
    const NewtonResult found =
        followed(statics_.solve(problem_, state_, newton_), record.iterations);
    if (found.converged) contact_.settle();
    return found;
  };
  save(before_part_);
  NewtonResult solve;
  double held = 0.0;  // by springs so stiff in the last equilibrium; 0: there was none yet
  for (double power = 1.0;;) {
    const double next = held == 0.0 ? kFirstSpring : held * std::pow(kFade, power);
    const bool last = held != 0.0 && next < kLastSpring;
    solve = solve_with(last ? 0.0 : next);
    if (solve.converged) {
      if (last) break;
      held = next;
      power = 1.0;
      save(before_part_);
      continue;
    }
    restore(before_part_);
    power *= 0.5;
    if (held == 0.0 || power < kLeastFade) break;
  }
  problem_.springs = nullptr;
  if (!solve.converged) return std::nullopt;

  // What the hand did before is not known: its work counts as what is stored now.
  record.residual = solve.residual;
  wall_energy_ = solve.wall_energy;
  totals_ = {};
  totals_.stored_energy = totals_.push_work = stored_energy(solve);
  settle(0.0, 0.0);
  totals_.friction_work = 0.0;
  measure(record);
  record.push_force = totals_.push_force;
  record.push_work = totals_.push_work;
  return record;
}

}  // namespace wireplan::simulate
