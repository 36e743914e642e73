#include "simulate/insertion/scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "preprocess/cores.h"
#include "simulate/equilibrium/dynamics.h"
#include "simulate/insertion/end_path.h"
#include "simulate/wire/writhe.h"

namespace wireplan::simulate {

const char* outcome_name(SceneOutcome outcome) {
  switch (outcome) {
    case SceneOutcome::kConverged:
      return "converged";
    case SceneOutcome::kNotConverged:
      return "not_converged";
    case SceneOutcome::kUnstable:
      return "unstable";
  }
  return "";
}

double edge_length(const Scene& scene, std::size_t section) {
  const double equal = scene.wire.length() / scene.elements;
  if (scene.element_length.empty()) return equal;
  const double length = scene.wire.sections.at(section).length;
  const double asked = scene.element_length.at(section);
  // A whole number is not exceeded by its rounding.
  return length / std::max(1.0, std::ceil(length / (asked > 0.0 ? asked : equal) - 1e-9));
}

Eigen::VectorXd edge_lengths(const Scene& scene) {
  if (scene.element_length.empty()) {
    return Eigen::VectorXd::Constant(scene.elements, edge_length(scene, 0));
  }
  std::vector<double> lengths;
  for (std::size_t k = scene.wire.sections.size(); k-- > 0;) {
    const double l = edge_length(scene, k);
    lengths.insert(lengths.end(),
                   static_cast<std::size_t>(std::lround(scene.wire.sections[k].length / l)), l);
  }
  return Eigen::Map<const Eigen::VectorXd>(lengths.data(),
                                           static_cast<Eigen::Index>(lengths.size()));
}

double residual_under(const Eigen::Matrix3Xd& load, double asked) {
  constexpr double kPart = 1e-3;
  const double largest = load.colwise().norm().maxCoeff();
  return largest > 0.0 ? std::min(asked, kPart * largest) : asked;
}

bool hold_both_rolls(const std::vector<Support>& supports) {
  return supports.size() == 2 &&
         std::all_of(supports.begin(), supports.end(),
                     [](const Support& support) { return support.kind != SupportKind::kPinned; });
}

bool may_leave_saddles(const Loads& loads, const std::optional<Vec3>& plane) {
  return loads.tip_moment.isZero(0.0) || plane.has_value();
}

bool twists_the_wire(const std::vector<Support>& supports) {
  return hold_both_rolls(supports) && supports[0].roll != supports[1].roll;
}

namespace {

template <typename... Values>
std::string format(const char* text, Values... values) {
  char line[240];
  std::snprintf(line, sizeof line, text, values...);
  return line;
}

constexpr const char* kAtSaddle = " and a stable equilibrium";

bool holds_direction(const Support* support) {
  return support != nullptr && support->kind != SupportKind::kPinned;
}

EndSupport end_support(const Support& support) {
  const bool directed = holds_direction(&support);
  EndSupport end;
  end.hold_along = support.kind != SupportKind::kGuided;
  end.hold_across = true;
  end.hold_roll = directed;
  end.axis = support.direction;
  if (directed) end.tangent = support.direction;
  return end;
}

const Support* find_support(const Scene& scene, WireEnd end) {
  for (const Support& support : scene.supports) {
    if (support.at == end) return &support;
  }
  return nullptr;
}

// ---------------------------------------------------------------- the problem

/// What is solved, and the memory that it refers to.
struct Setup {
  Rod rod;
  RodState state;
  Eigen::Matrix3Xd full_load, load;  // (3, n) at the end, and now                     [N]
  Problem problem;
  const Support* distal = nullptr;
  Vec3 start_point = Vec3::Zero();     // of the distal node                              [mm]
  double start_roll = 0.0;             // of the distal edge                              [rad]
  double turned = 0.0;                 // so far, of the distal support's roll            [rad]
  double part = 0.0;                   // of the loads, now
  double moment_zero = 0.0;            // energy of the full tip moment at the start    [N mm]
  std::optional<WallContact> contact;  // where there is a vessel
};

/// Energy of the tip moment: of the loads, what is not that of the nodal forces.
double moment_energy(const Setup& s) {
  Eigen::Matrix3Xd unused(3, s.state.x.cols());
  const double loads = Statics::evaluate(s.problem, s.state, unused).load;
  return s.problem.load == nullptr ? loads : loads + s.load.cwiseProduct(s.state.x).sum();
}

void set_up(const Scene& scene, Setup& s) {
  const Support* proximal = find_support(scene, WireEnd::kProximal);
  expects(proximal != nullptr);
  s.distal = find_support(scene, WireEnd::kDistal);
  const bool may_leave_plane = scene.solver.method == Method::kNewton && !scene.plane;
  const bool twisted =
      scene.twist == Twist::kCoupled ||
      (scene.twist == Twist::kAuto &&
       (twists_the_wire(scene.supports) || (may_leave_plane && hold_both_rolls(scene.supports))));
  s.rod = build_rod(scene.wire, edge_lengths(scene), twisted);
  expects(!(s.rod.twisted && scene.twist == Twist::kDecoupled));
  expects(scene.loads.tip_torque == 0.0 || scene.twist == Twist::kDecoupled);
  const int n = s.rod.nodes();
  s.state = rest_state(s.rod, proximal->point, proximal->direction, proximal->roll);
  s.start_point = s.state.x.col(n - 1);
  s.start_roll = s.state.theta[n - 2];
  s.full_load = scene.loads.gravity * s.rod.mass.transpose();
  s.full_load.col(n - 1) += scene.loads.tip_force;
  s.load = s.full_load;
  s.problem.rod = &s.rod;
  s.problem.last = n;
  s.problem.proximal = end_support(*proximal);
  if (s.distal != nullptr) s.problem.distal = end_support(*s.distal);
  if (!s.full_load.isZero(0.0)) s.problem.load = &s.load;
  s.problem.plane = scene.plane;
  if (scene.loads.tip_moment.isZero(0.0)) return;
  s.problem.tip_moment =
      TipMoment{.axis = scene.loads.tip_moment.normalized(), .size = scene.loads.tip_moment.norm()};
  s.moment_zero = moment_energy(s);
}

std::vector<std::string> terms_of(const Scene& scene, const Rod& rod) {
  std::vector<std::string> own;
  if (scene.twist == Twist::kDecoupled) own.push_back("decoupled_twist");
  if (!scene.loads.gravity.isZero(0.0) && !rod.mass.isZero(0.0)) own.push_back("gravity");
  if (!scene.loads.tip_force.isZero(0.0)) own.push_back("tip_force");
  if (!scene.loads.tip_moment.isZero(0.0)) own.push_back("tip_moment");
  if (scene.loads.tip_torque != 0.0) own.push_back("tip_torque");
  if (scene.plane) own.push_back("plane");
  return name_terms(rod, own, scene.vessel, scene.contact.friction);
}

/// Contact with the vessel, from the state in which the wire is.
void add_vessel(const Scene& scene, Setup& s) {
  s.contact.emplace(s.rod, *scene.vessel, scene.contact);
  s.contact->start_at(s.state);
  s.problem.contact = &*s.contact;
}

void apply_loads(const Scene& scene, double part, Setup& s) {
  s.part = part;
  s.load = part * s.full_load;
  if (s.problem.tip_moment) s.problem.tip_moment->size = part * scene.loads.tip_moment.norm();
}

/// Loads and supports at a part of what they will be.
void apply_part(const Scene& scene, double part, Setup& s) {
  const int n = s.rod.nodes();
  apply_loads(scene, part, s);
  if (s.distal == nullptr) return;

  // Every node follows the end in proportion, so that no edge is torn.
  const RodState before = s.state;
  Vec3 move = s.start_point + part * (s.distal->point - s.start_point) - s.state.x.col(n - 1);
  if (s.distal->kind == SupportKind::kGuided && part > 1.0 / scene.solver.load_steps) {
    move -= move.dot(s.distal->direction) * s.distal->direction;  // it is where it slid to
  }
  for (int i = 1; i < n; ++i) {
    s.state.x.col(i) += (1.0 - s.rod.tip_distance[i] / s.rod.tip_distance[0]) * move;
  }
  if (!s.rod.twisted) return;
  transport_frames(before, s.state, 0, n - 2);
  if (!s.problem.distal.hold_roll) return;

  const double target = part * (s.distal->roll - s.start_roll);
  spread_turn(s.rod, target - s.turned, s.state);
  s.turned = target;
}

// ---------------------------------------------------------------- to a support far away

/// How steps along an EndPath follow from the iterations that they take; all chosen.
struct PathTuning {
  int many_iterations = 8;       // of a step: the next one is shorter; with half of them, longer
  double growth = 1.5;           // from step to step
  int most_iterations = 30;      // of a step that may still be halved
  double shortest = 1.0 / 1024;  // part of the way
  int most_steps = 10;           // of as many iterations as one may take: no halving beyond
  double same_roll = 1e-9;       // of a held end                                         [rad]
  int most_corrections = 8;      // of it: each is of second order in the one before
};
constexpr PathTuning kPathTuning;

EndPath end_path(const Scene& scene, const Setup& s) {
  const Support& proximal = *find_support(scene, WireEnd::kProximal);
  return {s.rod,
          s.state,
          {.start_point = proximal.point,
           .start_is_directed = holds_direction(&proximal),
           .start_direction = proximal.direction,
           .point = s.distal->point,
           .is_directed = holds_direction(s.distal),
           .slides = s.distal->kind == SupportKind::kGuided,
           .direction = s.distal->direction,
           .roll = s.rod.twisted && holds_direction(s.distal) ? s.distal->roll - s.start_roll : 0.0,
           .plane = scene.plane}};
}

/// Of a converged wire at the path's end: what held rolls lost as frames went along with edges that
/// turned to and fro.
template <class Solve>
NewtonResult correct_rolls(const EndPath& path, Setup& s, NewtonResult found, const Solve& solve) {
  for (int k = 0; k < kPathTuning.most_corrections && s.rod.twisted && found.converged; ++k) {
    if (path.correct_rolls(1.0, s.state) <= kPathTuning.same_roll) break;
    found = solve();
  }
  return found;
}

double tolerance_of(const Scene& scene, const Setup& s) {
  return residual_under(s.full_load, scene.solver.residual_tolerance);
}

/// One solve, counted in the result.
NewtonResult solve_counted(const Scene& scene, Statics& statics, Setup& s, int most_iterations,
                           SceneResult& result) {
  const NewtonResult found =
      statics.solve(s.problem, s.state,
                    {.residual_tolerance = tolerance_of(scene, s),
                     .max_iterations = most_iterations,
                     .leave_saddles = may_leave_saddles(scene.loads, scene.plane)});
  result.iterations += found.iterations;
  result.worst_energy_rise = std::max(result.worst_energy_rise, found.worst_energy_rise);
  return found;
}

/// Takes the wire all along the path, in steps that get shorter where they take many iterations.
NewtonResult follow_path(const Scene& scene, const EndPath& path, Setup& s, SceneResult& result) {
  const SolverOptions& options = scene.solver;
  Statics statics;
  const auto solve = [&](int most_iterations) {
    return solve_counted(scene, statics, s, std::min(most_iterations, options.max_iterations),
                         result);
  };
  const auto given_up = [&](const NewtonResult& found, double part) {
    result.reason = format(
        "residual %.3g N after %d iterations at %.3g of the way to the distal support, asked for "
        "%.3g N%s",
        found.residual, found.iterations, part, tolerance_of(scene, s),
        found.at_saddle ? kAtSaddle : "");
    return found;
  };
  const int most_iterations = kPathTuning.most_steps * options.max_iterations;
  const bool slides = !s.problem.distal.hold_along;
  EndPath::Progress progress{.now = s.state, .before = s.state};
  const double longest = std::min(path.longest_step(), 1.0 / options.load_steps);
  const double shortest = std::min(longest, kPathTuning.shortest);
  for (double size = longest;;) {
    const double left = 1.0 - progress.part;
    const double part = left < 1.01 * size ? 1.0 : progress.part + size;
    apply_loads(scene, part, s);
    if (slides) s.problem.distal.axis = path.direction(part);
    if (s.problem.distal.tangent) s.problem.distal.tangent = path.direction(part);
    s.state = path.guess(progress, part);
    NewtonResult found =
        solve(size <= shortest ? options.max_iterations : kPathTuning.most_iterations);
    if (!found.converged) {
      if (size <= shortest || result.iterations > most_iterations) return given_up(found, part);
      size = std::max(shortest, 0.5 * size);
      continue;
    }
    ++result.steps;
    if (part == 1.0) {
      found = correct_rolls(path, s, found, [&] { return solve(options.max_iterations); });
    }
    if (!found.converged) return given_up(found, part);
    if (part == 1.0) return found;
    progress.before = std::exchange(progress.now, s.state);
    progress.part_before = std::exchange(progress.part, part);
    if (found.iterations > kPathTuning.many_iterations) size /= kPathTuning.growth;
    if (2 * found.iterations < kPathTuning.many_iterations) size *= kPathTuning.growth;
    size = std::clamp(size, shortest, longest);
  }
}

// ---------------------------------------------------------------- the methods

void run_newton(const Scene& scene, Setup& s, SceneResult& result) {
  const SolverOptions& options = scene.solver;
  expects(options.load_steps >= 1);
  Statics statics;
  NewtonResult solve;
  std::optional<EndPath> path;
  if (s.distal != nullptr && scene.vessel == nullptr) path.emplace(end_path(scene, s));
  const bool far = path && path->is_far();
  if (far) solve = follow_path(scene, *path, s, result);
  const auto solve_now = [&] {
    return solve_counted(scene, statics, s, options.max_iterations, result);
  };
  for (int step = 1; step <= options.load_steps && !far; ++step) {
    apply_part(scene, static_cast<double>(step) / options.load_steps, s);
    solve = solve_now();
    result.steps = step;
    if (path && step == options.load_steps) solve = correct_rolls(*path, s, solve, solve_now);
    if (!solve.converged) break;
    if (s.contact) result.friction_work += s.contact->settle();
  }
  result.residual = solve.residual;
  result.outcome = solve.converged ? SceneOutcome::kConverged : SceneOutcome::kNotConverged;
  if (!solve.converged && !far) {
    result.reason =
        format("residual %.3g N after %d iterations of load step %d of %d, asked for %.3g N%s",
               solve.residual, solve.iterations, result.steps, options.load_steps,
               tolerance_of(scene, s), solve.at_saddle ? kAtSaddle : "");
  }
}

std::string why_unstable(const MotionResult& motion, Method method, double time_step) {
  if (method == Method::kConjugateGradient) {
    return format("a number was not finite after %ld iterations", motion.steps);
  }
  const std::string grew = format(
      "the energy grew beyond 10 times what the loads can give within %ld time steps of %.3g s",
      motion.steps, time_step);
  if (motion.critical_time_step == 0.0) return grew + "; without damping no time step is stable";
  return grew + format(" (largest stable one at the start: %.3g s)", motion.critical_time_step);
}

void run_motion(const Scene& scene, Setup& s, SceneResult& result) {
  const SolverOptions& options = scene.solver;
  expects(options.load_steps == 1 && options.duration < 2e9 * options.time_step);
  apply_part(scene, 1.0, s);
  const auto run = options.method == Method::kConjugateGradient ? run_conjugate_gradient
                   : options.method == Method::kExplicitEuler   ? run_explicit_euler
                                                                : run_semi_implicit_euler;
  const MotionResult motion = run(s.problem, s.state,
                                  {.time_step = options.time_step,
                                   .duration = options.duration,
                                   .residual_tolerance = options.residual_tolerance,
                                   .damping = options.damping});
  result.iterations = result.steps = static_cast<int>(motion.steps);
  result.time = motion.time;
  result.residual = motion.residual;
  result.worst_energy_rise = motion.worst_energy_rise;
  result.critical_time_step = motion.critical_time_step;
  switch (motion.outcome) {
    case MotionOutcome::kConverged:
      result.outcome = SceneOutcome::kConverged;
      break;
    case MotionOutcome::kFinished:
      result.outcome = SceneOutcome::kNotConverged;
      result.reason = format("residual %.3g N after %.6g s, asked for %.3g N%s", motion.residual,
                             motion.time, options.residual_tolerance,
                             motion.residual <= options.residual_tolerance ? " at rest" : "");
      break;
    case MotionOutcome::kUnstable:
      result.outcome = SceneOutcome::kUnstable;
      result.reason = why_unstable(motion, options.method, options.time_step);
      break;
  }
}

// ---------------------------------------------------------------- what came out

/// Torque of a support that holds the roll of an edge: the derivative of the energy by its theta.
/// By fourth-order differences, exact for the twist and to 1e-9 for the rest bend.
double roll_torque(const Problem& problem, const RodState& state, int edge) {
  constexpr double kTurn = 0.01;  // [rad]
  Eigen::Matrix3Xd unused(3, state.x.cols());
  RodState turned = state;
  const auto energy_after = [&](double turn) {
    turned.theta[edge] = state.theta[edge] + turn;
    return Statics::evaluate(problem, turned, unused).total();
  };
  return (8.0 * (energy_after(kTurn) - energy_after(-kTurn)) -
          (energy_after(2.0 * kTurn) - energy_after(-2.0 * kTurn))) /
         (12.0 * kTurn);
}

/// Force and moment of a support on its end of the wire. The derivative of the energy at the end
/// node is the force. The moment is the couple that the clamp's half element, told by leaving it
/// out, turns its edge with and, with directors, the torque of the rest about the edge.
Reaction reaction_at(const Support& support, const Problem& problem, const RodState& state,
                     const Eigen::Matrix3Xd& gradient) {
  const Rod& rod = *problem.rod;
  const bool proximal = support.at == WireEnd::kProximal;
  Reaction reaction;
  reaction.at = support.at;
  reaction.force = gradient.col(proximal ? 0 : rod.nodes() - 1);
  if (support.kind == SupportKind::kPinned) return reaction;
  const int edge = proximal ? 0 : rod.nodes() - 2;
  const Vec3 e = state.x.col(edge + 1) - state.x.col(edge);
  Problem rest = problem;
  (proximal ? rest.proximal : rest.distal).tangent.reset();
  Eigen::Matrix3Xd rest_gradient(3, rod.nodes());
  Statics::evaluate(rest, state, rest_gradient);
  reaction.moment = e.cross(rest_gradient.col(edge + 1) - gradient.col(edge + 1));
  if (rod.twisted) reaction.moment += roll_torque(rest, state, edge) * e.normalized();
  return reaction;
}

/// Angle by which a unit torque twists the wire between a and b, counted from the tip: the integral
/// of 1/GJ [1/(N mm)].
double twist_compliance(const Wire& wire, double a, double b) {
  double sum = 0.0, start = 0.0;
  for (const Section& section : wire.sections) {
    const double end = start + section.length;
    const double part = std::max(0.0, std::min(b, end) - std::max(a, start));
    if (part > 0.0) sum += section.twist_compliance(std::max(a, start) - start, part);
    start = end;
  }
  return sum;
}

/// Paper Eq. (14)-(15): the torque is the same all along the wire, and the rolls of its nodes
/// follow one by one from the hub's. The torque is that on the tip, or what turns a held distal
/// end.
void add_decoupled_twist(const Scene& scene, const Setup& s, SceneResult& result) {
  const Support* proximal = find_support(scene, WireEnd::kProximal);
  const bool held = holds_direction(s.distal);
  expects(holds_direction(proximal) && !(held && scene.loads.tip_torque != 0.0));
  const double length = scene.wire.length();
  const double compliance = twist_compliance(scene.wire, 0.0, length);
  const double torque =
      held ? (s.distal->roll - proximal->roll) / compliance : scene.loads.tip_torque;
  const int n = s.rod.nodes();
  result.twist = result.roll = Eigen::VectorXd::Zero(n);
  for (int i = 0; i < n; ++i) {
    const double to_tip = s.rod.tip_distance[i];
    result.roll[i] = proximal->roll + torque * twist_compliance(scene.wire, to_tip, length);
    if (i > 0 && i + 1 < n) result.twist[i] = torque / s.rod.twist[i];
  }
  result.energy.twist = 0.5 * torque * torque * compliance;
  const double work = scene.loads.tip_torque * (result.roll[n - 1] - result.roll[0]);
  result.energy.load -= work;
  result.moment_energy -= work;
  for (Reaction& reaction : result.reactions) {
    const bool at_hub = reaction.at == WireEnd::kProximal;
    if (!at_hub && !held) continue;
    const int edge = at_hub ? 0 : n - 2;
    reaction.moment +=
        (at_hub ? -torque : torque) * (s.state.x.col(edge + 1) - s.state.x.col(edge)).normalized();
  }
}

void describe(const Scene& scene, Setup& s, SceneResult& result) {
  const int n = s.rod.nodes();
  result.nodes = s.state.x;
  Eigen::Matrix3Xd gradient(3, n);
  result.energy = Statics::evaluate(s.problem, s.state, gradient);
  if (s.problem.load != nullptr) {
    result.gravity_energy = -s.part * (scene.loads.gravity.transpose() * s.state.x).dot(s.rod.mass);
  }
  if (s.problem.tip_moment) {
    // Angles count from where the wire started.
    result.energy.load -= s.part * s.moment_zero;
    result.moment_energy = moment_energy(s) - s.part * s.moment_zero;
  }
  for (const Support& support : scene.supports) {
    result.reactions.push_back(reaction_at(support, s.problem, s.state, gradient));
  }
  if (s.rod.twisted) {
    result.twist = Eigen::VectorXd::Zero(n);
    for (int i = 1; i + 1 < n; ++i) {
      result.twist[i] = s.state.theta[i] - s.state.theta[i - 1] + s.state.reference_twist[i];
    }
  }
  if (scene.twist == Twist::kDecoupled) add_decoupled_twist(scene, s, result);
  if (s.contact) result.contacts = s.contact->touches();
}

/// Of a wire whose ends' rolls are held: turns of them that are neither in its twist nor in how it
/// winds round itself have come off it. It passed round its end, or through itself.
std::string tell_lost_turns(const Scene& scene, const SceneResult& result) {
  constexpr double kLost = 1.5;  // turns; they come off in pairs
  if (result.twist.size() == 0 || !hold_both_rolls(scene.supports)) return "";
  double roll = 0.0;
  for (const Support& support : scene.supports) {
    roll += support.at == WireEnd::kDistal ? support.roll : -support.roll;
  }
  const double left = result.twist.sum() + find_writhe(result.nodes);
  const double turns = (roll - left) / (2.0 * kPi);
  if (std::abs(turns) < kLost) return "";
  return format(
      "about %.0f turns of the ends' rolls against each other have come off: the wire passed round "
      "its end, or through itself",
      2.0 * std::round(0.5 * std::abs(turns)));
}

}  // namespace

SceneResult run_scene(const Scene& scene) {
  expects(scene.vessel == nullptr || scene.solver.method == Method::kNewton);
  Setup setup;
  set_up(scene, setup);
  if (scene.vessel != nullptr) add_vessel(scene, setup);
  SceneResult result;
  result.terms = terms_of(scene, setup.rod);
  const double begin = thread_cpu_seconds();
  if (scene.solver.method == Method::kNewton) {
    run_newton(scene, setup, result);
  } else {
    run_motion(scene, setup, result);
  }
  result.cpu_time_s = thread_cpu_seconds() - begin;
  describe(scene, setup, result);
  if (result.outcome == SceneOutcome::kConverged) {
    result.crossing = CrossingFinder().find(result.nodes, scene.wire.radius);
    result.reason = tell_lost_turns(scene, result);
  }
  return result;
}

}  // namespace wireplan::simulate
