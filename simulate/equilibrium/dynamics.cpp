#include "simulate/equilibrium/dynamics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulate/wire/quartic.h"

namespace wireplan::simulate {

namespace {

/// The wire as flat arrays, so that the loops over it vectorise; nothing is allocated after the
/// constructor. An array has a row of `row_` = n + 1 entries for each coordinate and one entry of 0
/// before the first and after the last row.
///   At nodes: entry i of a row is node i; entry n is always 0.
///   At edges: entry i is the edge from node i-1 to node i. Entries 0 and n are ghosts, the clamped
///   tangents, which make a clamp a bend element like every other.
/// With v = (x_i - x_i-1) / l, or the tangent of a ghost, the energy is the sum of EA l/8 (|v|^2 -
/// 1)^2 over edges and B/2 |v_i+1 - v_i|^2 over nodes, minus load . x.
class Chain {
 public:
  using Array = Eigen::VectorXd;

  Chain(const Problem& problem, const RodState& state);

  /// Energy, gradient and what of it the methods ask for, at the positions.
  void differentiate();
  /// direction <- beta * direction - gradient, paper Eq. (20); returns the energy along it, Eq.
  /// (22). Needs differentiate() at the positions before.
  Quartic turn_direction(double beta);
  /// Positions <- positions + step * direction.
  void move(double step);
  /// One step of an Euler scheme: velocity <- keep * velocity - push * gradient / mass, and the
  /// positions move with the velocity of before or after. Returns the kinetic energy after.
  double advance(double time_step, double keep, double push, bool with_old_velocity);
  /// Positions <- those before the last move.
  void go_back() { x_.swap(x_before_); }

  /// Largest eigenvalue of M^-1 K at the positions, w^2 [1/s^2]. Differentiates, and takes the
  /// masses that advance() needs.
  double largest_eigenvalue();
  /// Largest nodal force out of balance [N].
  double residual() const;
  void copy_positions(RodState& state) const;

  double energy = 0.0, elastic_energy = 0.0;  // with and without the loads           [N mm]
  double squared_gradient = 0.0;
  double slope_along_direction = 0.0;  // gradient . direction

 private:
  int at(int coordinate, int i) const { return 1 + coordinate * row_ + i; }
  /// Takes out of a force what the supports hold.
  void hold(Array& force) const;
  void set_masses();

  int nodes_, row_;
  const Problem& problem_;
  Mat3 free_first_, free_last_;  // projectors on what the supports leave free at the ends
  Array x_, x_before_, gradient_, load_, bend_, direction_, velocity_, inverse_mass_;  // at nodes
  Array inverse_length_, ghost_, v_, tension_, force_, turn_;                          // at edges
  Array moment_;                          // B (v_i+1 - v_i), at nodes
  Array stretch_, strain_, mass_, half_;  // one row: EA l/8, |v|^2 - 1, mass, EA/2
};

Chain::Chain(const Problem& problem, const RodState& state)
    : nodes_(problem.rod->nodes()),
      row_(nodes_ + 1),
      problem_(problem),
      free_first_(free_directions(problem.proximal)),
      free_last_(free_directions(problem.distal)) {
  const Rod& rod = *problem.rod;
  for (Array* array :
       {&x_, &x_before_, &gradient_, &load_, &bend_, &direction_, &velocity_, &inverse_mass_,
        &inverse_length_, &ghost_, &v_, &tension_, &force_, &turn_, &moment_}) {
    array->setZero(3 * row_ + 2);
  }
  for (Array* array : {&stretch_, &strain_, &mass_, &half_}) array->setZero(row_);
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < nodes_; ++i) {
      x_[at(c, i)] = state.x(c, i);
      if (problem.load != nullptr) load_[at(c, i)] = (*problem.load)(c, i);
      bend_[at(c, i)] = rod.bend[i];
      if (i > 0) inverse_length_[at(c, i)] = 1.0 / rod.rest_length[i - 1];
    }
    if (problem.proximal.tangent) {
      bend_[at(c, 0)] = rod.proximal_bend;
      ghost_[at(c, 0)] = (*problem.proximal.tangent)[c];
    }
    if (problem.distal.tangent) {
      bend_[at(c, nodes_ - 1)] = rod.distal_bend;
      ghost_[at(c, nodes_)] = (*problem.distal.tangent)[c];
    }
  }
  for (int i = 1; i < nodes_; ++i) {
    stretch_[i] = rod.stretch[i - 1] * rod.rest_length[i - 1] / 8.0;
    half_[i] = 0.5 * rod.stretch[i - 1];
  }
}

void Chain::hold(Array& force) const {
  const auto project = [&](int i, const Mat3& P) {
    const Vec3 f = P * Vec3(force[at(0, i)], force[at(1, i)], force[at(2, i)]);
    for (int c = 0; c < 3; ++c) force[at(c, i)] = f[c];
  };
  for (int i = 0; i < problem_.first; ++i) project(i, Mat3::Zero());
  for (int i = problem_.last; i < nodes_; ++i) project(i, Mat3::Zero());
  if (problem_.first == 0) project(0, free_first_);
  if (problem_.last == nodes_) project(nodes_ - 1, free_last_);
}

void Chain::differentiate() {
  const int row = row_, size = 3 * row_;
  const double* __restrict x = x_.data() + 1;
  const double* __restrict w = inverse_length_.data() + 1;
  const double* __restrict ghost = ghost_.data() + 1;
  const double* __restrict B = bend_.data() + 1;
  const double* __restrict load = load_.data() + 1;
  const double* __restrict p = direction_.data() + 1;
  const double* __restrict k = stretch_.data();
  const double* __restrict half = half_.data();
  double* __restrict s = strain_.data();
  double* __restrict v = v_.data() + 1;
  double* __restrict t = tension_.data() + 1;
  double* __restrict m = moment_.data() + 1;
  double* __restrict f = force_.data() + 1;
  double* __restrict g = gradient_.data() + 1;

  // 1. Edges: direction, strain, tension; nodes: moment.
  for (int j = 0; j < size; ++j) v[j] = (x[j] - x[j - 1]) * w[j] + ghost[j];
  for (int i = 0; i < row; ++i) {
    const int a = i, b = i + row, c = i + 2 * row;
    s[i] = v[a] * v[a] + v[b] * v[b] + v[c] * v[c] - 1.0;
    t[a] = t[b] = t[c] = half[i] * s[i];
  }
  for (int j = 0; j < size; ++j) m[j] = B[j] * (v[j + 1] - v[j]);

  // 2. What an edge pulls its distal node back with, and what is left at the nodes.
  for (int j = 0; j < size; ++j) f[j] = t[j] * v[j] + (m[j - 1] - m[j]) * w[j];
  for (int j = 0; j < size; ++j) g[j] = f[j] - f[j + 1] - load[j];
  hold(gradient_);

  // 3. Sums.
  double stretch = 0.0, bend = 0.0, work = 0.0, squared = 0.0, along = 0.0;
  for (int i = 0; i < row; ++i) {
    const int a = i, b = i + row, c = i + 2 * row;
    stretch += k[i] * s[i] * s[i];
    bend += m[a] * (v[a + 1] - v[a]) + m[b] * (v[b + 1] - v[b]) + m[c] * (v[c + 1] - v[c]);
    work += load[a] * x[a] + load[b] * x[b] + load[c] * x[c];
    squared += g[a] * g[a] + g[b] * g[b] + g[c] * g[c];
    along += g[a] * p[a] + g[b] * p[b] + g[c] * p[c];
  }
  elastic_energy = stretch + 0.5 * bend;
  energy = elastic_energy - work;
  squared_gradient = squared;
  slope_along_direction = along;
}

Quartic Chain::turn_direction(double beta) {
  const int row = row_, size = 3 * row_;
  const double* __restrict w = inverse_length_.data() + 1;
  const double* __restrict B = bend_.data() + 1;
  const double* __restrict g = gradient_.data() + 1;
  const double* __restrict v = v_.data() + 1;
  const double* __restrict k = stretch_.data();
  const double* __restrict s = strain_.data();
  double* __restrict p = direction_.data() + 1;
  double* __restrict u = turn_.data() + 1;

  for (int j = 0; j < size; ++j) p[j] = beta * p[j] - g[j];
  for (int j = 0; j < size; ++j) u[j] = (p[j] - p[j - 1]) * w[j];
  // |v + s u|^2 - 1 = strain + first s + second s^2.
  Quartic q{.a1 = beta * slope_along_direction - squared_gradient};
  for (int i = 0; i < row; ++i) {
    const int a = i, b = i + row, c = i + 2 * row;
    const double first = 2.0 * (v[a] * u[a] + v[b] * u[b] + v[c] * u[c]);
    const double second = u[a] * u[a] + u[b] * u[b] + u[c] * u[c];
    const double d_a = u[a + 1] - u[a], d_b = u[b + 1] - u[b], d_c = u[c + 1] - u[c];
    q.a2 += k[i] * (first * first + 2.0 * s[i] * second) +
            0.5 * B[i] * (d_a * d_a + d_b * d_b + d_c * d_c);
    q.a3 += 2.0 * k[i] * first * second;
    q.a4 += k[i] * second * second;
  }
  return q;
}

void Chain::move(double step) {
  const double* __restrict x = x_.data();
  const double* __restrict p = direction_.data();
  double* __restrict moved = x_before_.data();
  const Eigen::Index size = x_.size();
  for (Eigen::Index j = 0; j < size; ++j) moved[j] = x[j] + step * p[j];
  x_.swap(x_before_);
}

void Chain::set_masses() {
  mass_.setZero();
  mass_.head(nodes_) = problem_.rod->mass;
  for (int i = problem_.first; i < problem_.last; ++i) {
    const bool held = (i == 0 && free_first_.isZero()) || (i == nodes_ - 1 && free_last_.isZero());
    expects(held || mass_[i] > 0.0);
    for (int c = 0; c < 3; ++c) inverse_mass_[at(c, i)] = held ? 0.0 : 1.0 / mass_[i];
  }
}

double Chain::advance(double time_step, double keep, double push, bool with_old_velocity) {
  const double* __restrict x = x_.data();
  const double* __restrict g = gradient_.data();
  const double* __restrict inverse_mass = inverse_mass_.data();
  double* __restrict v = velocity_.data();
  double* __restrict moved = x_before_.data();
  const Eigen::Index size = x_.size();
  if (with_old_velocity) {
    for (Eigen::Index j = 0; j < size; ++j) moved[j] = x[j] + time_step * v[j];
    for (Eigen::Index j = 0; j < size; ++j) v[j] = keep * v[j] - push * (inverse_mass[j] * g[j]);
  } else {
    for (Eigen::Index j = 0; j < size; ++j) v[j] = keep * v[j] - push * (inverse_mass[j] * g[j]);
    for (Eigen::Index j = 0; j < size; ++j) moved[j] = x[j] + time_step * v[j];
  }
  x_.swap(x_before_);
  double kinetic = 0.0;
  const double* __restrict m = mass_.data();
  const int row = row_;
  for (int i = 0; i < row; ++i) {
    const int a = 1 + i, b = a + row, c = b + row;
    kinetic += m[i] * (v[a] * v[a] + v[b] * v[b] + v[c] * v[c]);
  }
  return 0.5 * kinetic;
}

double Chain::largest_eigenvalue() {
  set_masses();
  differentiate();
  const int size = 3 * row_;
  // The start has a part of every mode: waves of irrational length, sign changing from node to node
  // as in the fastest mode. z = M^1/2 x makes the matrix symmetric.
  const Array scale = inverse_mass_.cwiseSqrt();
  Array z(scale.size()), next(scale.size());
  for (int j = 0; j < z.size(); ++j) z[j] = (j % 2 == 0 ? 1.0 : -1.0) * (2.0 + std::sin(0.7 * j));
  Array displacement = Array::Zero(z.size());
  double eigenvalue = 0.0;
  for (int iteration = 0; iteration < 2000; ++iteration) {
    z.normalize();
    displacement = scale.cwiseProduct(z);
    hold(displacement);
    const double* u = displacement.data() + 1;
    for (int j = 0; j < size; ++j) turn_[1 + j] = (u[j] - u[j - 1]) * inverse_length_[1 + j];
    for (int j = 0; j < size; ++j) moment_[1 + j] = bend_[1 + j] * (turn_[2 + j] - turn_[1 + j]);
    for (int i = 0; i < row_; ++i) {
      double along = 0.0;
      for (int c = 0; c < 3; ++c) along += v_[at(c, i)] * turn_[at(c, i)];
      for (int c = 0; c < 3; ++c) {
        const int j = at(c, i);
        force_[j] = half_[i] * (strain_[i] * turn_[j] + 2.0 * along * v_[j]) +
                    (moment_[j - 1] - moment_[j]) * inverse_length_[j];
      }
    }
    for (int j = 1; j <= size; ++j) next[j] = force_[j] - force_[j + 1];
    next[0] = next[size + 1] = 0.0;
    hold(next);
    next = next.cwiseProduct(scale);
    const double before = eigenvalue;
    eigenvalue = z.dot(next);
    z.swap(next);
    if (std::abs(eigenvalue - before) <= 1e-7 * std::abs(eigenvalue)) break;
  }
  return eigenvalue;
}

double Chain::residual() const {
  double largest = 0.0;
  for (int i = 0; i < nodes_; ++i) {
    const double a = gradient_[at(0, i)], b = gradient_[at(1, i)], c = gradient_[at(2, i)];
    largest = std::max(largest, a * a + b * b + c * c);
  }
  return std::sqrt(largest);
}

void Chain::copy_positions(RodState& state) const {
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < nodes_; ++i) state.x(c, i) = x_[at(c, i)];
  }
}

/// Checks what these methods can do, and counts the time steps.
long count_steps(const Problem& problem, const RodState& state, const MotionOptions& options) {
  expects(problem.rod != nullptr && problem.first >= 0 && problem.first < problem.last &&
          problem.last <= problem.rod->nodes() && state.x.cols() == problem.rod->nodes());
  expects(!problem.rod->twisted && problem.contact == nullptr && !problem.tip_moment &&
          !problem.plane);
  expects(options.time_step > 0.0 && options.duration > 0.0 && options.damping >= 0.0 &&
          options.duration < 1e15 * options.time_step);
  return std::max(1L, std::lround(std::ceil(options.duration / options.time_step - 1e-6)));
}

bool is_met(const Chain& chain, int nodes, double tolerance) {
  // The largest of n forces is at least their root mean square: most steps end here.
  if (chain.squared_gradient > nodes * tolerance * tolerance) return false;
  return chain.residual() <= tolerance;
}

/// Takes the last finite positions, and tells about them.
void finish(Chain& chain, double time_step, RodState& state, MotionResult& result) {
  chain.differentiate();
  if (!std::isfinite(chain.elastic_energy)) {
    chain.go_back();
    chain.differentiate();
  }
  chain.copy_positions(state);
  result.residual = chain.residual();
  result.energy = chain.energy;
  result.time = static_cast<double>(result.steps) * time_step;
}

/// What kinetic and elastic energy can only exceed where a scheme is unstable, see the header.
double energy_bound(const Problem& problem, const Chain& chain) {
  const Rod& rod = *problem.rod;
  const double length = rod.rest_length.sum();
  const double work =
      problem.load == nullptr ? 0.0 : 2.0 * length * problem.load->colwise().norm().sum();
  const double EI = rod.bend.cwiseProduct(rod.share).maxCoeff();
  return 10.0 * (chain.elastic_energy + work + 2.0 * kPi * kPi * EI / length);
}

/// Velocity <- keep * velocity + push * force / mass in each step.
struct Euler {
  double keep, push;
  bool with_old_velocity;
};

MotionResult run_euler(const Euler& scheme, Chain& chain, const Problem& problem, RodState& state,
                       const MotionOptions& options, MotionResult result) {
  constexpr double kMicrometre = 1e-3;  // [mm]
  const long steps = count_steps(problem, state, options);
  const int nodes = problem.rod->nodes();
  const double bound = energy_bound(problem, chain);
  double kinetic = 0.0;
  for (;;) {
    if (is_met(chain, nodes, options.residual_tolerance) &&
        kinetic <= kMicrometre * options.residual_tolerance) {
      result.outcome = MotionOutcome::kConverged;
      break;
    }
    if (result.steps == steps) break;
    const double before = chain.energy;
    kinetic = chain.advance(options.time_step, scheme.keep, scheme.push, scheme.with_old_velocity);
    chain.differentiate();
    ++result.steps;
    if (!(chain.elastic_energy + kinetic <= bound)) {
      result.outcome = MotionOutcome::kUnstable;
      break;
    }
    result.worst_energy_rise = std::max(result.worst_energy_rise, chain.energy - before);
  }
  finish(chain, options.time_step, state, result);
  return result;
}

}  // namespace

MotionResult run_conjugate_gradient(const Problem& problem, RodState& state,
                                    const MotionOptions& options) {
  const long steps = count_steps(problem, state, options);
  const int nodes = problem.rod->nodes();
  MotionResult result;
  result.critical_time_step = std::numeric_limits<double>::infinity();
  Chain chain(problem, state);
  chain.differentiate();
  double squared_before = std::numeric_limits<double>::infinity();  // beta of the first step is 0
  for (;;) {
    if (is_met(chain, nodes, options.residual_tolerance)) {
      result.outcome = MotionOutcome::kConverged;
      break;
    }
    if (result.steps == steps) break;

    // 1. Direction, paper Eq. (20), unless it would lead uphill.
    double beta = chain.squared_gradient / squared_before;
    if (!(beta * chain.slope_along_direction < chain.squared_gradient)) {
      beta = 0.0;
      ++result.restarts;
    }
    squared_before = chain.squared_gradient;
    const double before = chain.energy;

    // 2. To the lowest point along it, Eq. (21)-(23).
    chain.move(lowest_point(chain.turn_direction(beta), std::numeric_limits<double>::infinity()));
    chain.differentiate();
    ++result.steps;
    if (!std::isfinite(chain.energy)) {
      result.outcome = MotionOutcome::kUnstable;
      break;
    }
    result.worst_energy_rise = std::max(result.worst_energy_rise, chain.energy - before);
  }
  finish(chain, options.time_step, state, result);
  return result;
}

MotionResult run_explicit_euler(const Problem& problem, RodState& state,
                                const MotionOptions& options) {
  count_steps(problem, state, options);
  Chain chain(problem, state);
  const double squared_frequency = chain.largest_eigenvalue(), damping = options.damping;
  MotionResult result;
  result.critical_time_step =
      damping > 0.0 ? std::min(damping / squared_frequency, 2.0 / damping) : 0.0;
  return run_euler({.keep = 1.0 - damping * options.time_step,
                    .push = options.time_step,
                    .with_old_velocity = true},
                   chain, problem, state, options, result);
}

MotionResult run_semi_implicit_euler(const Problem& problem, RodState& state,
                                     const MotionOptions& options) {
  count_steps(problem, state, options);
  Chain chain(problem, state);
  const double squared_frequency = chain.largest_eigenvalue(), damping = options.damping;
  MotionResult result;
  result.critical_time_step =
      (damping + std::sqrt(damping * damping + 4.0 * squared_frequency)) / squared_frequency;
  const double keep = 1.0 / (1.0 + damping * options.time_step);
  return run_euler({.keep = keep, .push = keep * options.time_step, .with_old_velocity = false},
                   chain, problem, state, options, result);
}

}  // namespace wireplan::simulate
