#include "simulate/scene.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <ctime>

namespace wireplan::simulate {

const char* outcome_name(SceneOutcome outcome) {
  return outcome == SceneOutcome::kConverged ? "converged" : "not_converged";
}

namespace {

/// CPU time of this thread [s].
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

EndSupport end_support(const Support& support) {
  const bool directed = support.kind != SupportKind::kPinned;
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

/// Force and moment of a support on its end of the wire. The derivative of the energy at the end
/// node is the force; the moment is the couple of the clamp's half element.
Reaction reaction_at(const Support& support, const Problem& problem, const RodState& state,
                     const Eigen::Matrix3Xd& gradient) {
  const Rod& rod = *problem.rod;
  const bool proximal = support.at == WireEnd::kProximal;
  Reaction reaction;
  reaction.at = support.at;
  reaction.force = gradient.col(proximal ? 0 : rod.nodes() - 1);
  if (support.kind == SupportKind::kPinned) return reaction;
  const int edge = proximal ? 0 : rod.nodes() - 2;
  const double l = rod.rest_length[edge];
  const double B = proximal ? rod.proximal_bend : rod.distal_bend;
  const Vec3 e = state.x.col(edge + 1) - state.x.col(edge);
  reaction.moment = e.cross((B / l) * (support.direction - e / l));
  return reaction;
}

}  // namespace

SceneResult run_scene(const Scene& scene) {
  const Support* proximal = find_support(scene, WireEnd::kProximal);
  const Support* distal = find_support(scene, WireEnd::kDistal);
  expects(proximal != nullptr && scene.solver.load_steps >= 1);

  // 1. The wire, straight, and what acts on it.
  const double length = scene.wire.length();
  const Rod rod = build_rod(scene.wire, length, scene.elements);
  const int n = rod.nodes();
  RodState state = straight_state(rod, proximal->point, proximal->direction, proximal->roll);
  Eigen::Matrix3Xd full_load = scene.loads.gravity * rod.mass.transpose();
  full_load.col(n - 1) += scene.loads.tip_force;
  Eigen::Matrix3Xd load = full_load;
  Problem problem;
  problem.rod = &rod;
  problem.last = n;
  problem.proximal = end_support(*proximal);
  if (distal != nullptr) problem.distal = end_support(*distal);
  if (!full_load.isZero(0.0)) problem.load = &load;

  SceneResult result;
  result.terms = {"stretch", "bend"};
  if (rod.twisted) result.terms.push_back("twist");
  if (!scene.loads.gravity.isZero(0.0)) result.terms.push_back("gravity");
  if (!scene.loads.tip_force.isZero(0.0)) result.terms.push_back("tip_force");

  // 2. Equilibrium, step by step.
  const Vec3 start = state.x.col(n - 1);
  const double roll = state.theta[n - 2];
  Statics statics;
  NewtonResult solve;
  const double begin = thread_seconds();
  for (int step = 1; step <= scene.solver.load_steps; ++step) {
    const double part = static_cast<double>(step) / scene.solver.load_steps;
    load = part * full_load;
    if (distal != nullptr) {
      // Every node follows the end in proportion, so that no edge is torn.
      const Vec3 move = start + part * (distal->point - start) - state.x.col(n - 1);
      const RodState before = state;
      for (int i = 1; i < n; ++i) state.x.col(i) += (1.0 - rod.tip_distance[i] / length) * move;
      if (rod.twisted) {
        transport_frames(before, state, 0, n - 2);
        if (problem.distal.hold_roll) state.theta[n - 2] = roll + part * (distal->roll - roll);
      }
    }
    solve = statics.solve(problem, state,
                          {.residual_tolerance = scene.solver.residual_tolerance,
                           .max_iterations = scene.solver.max_iterations});
    result.iterations += solve.iterations;
    result.steps = step;
    if (!solve.converged) break;
  }
  result.cpu_time_s = thread_seconds() - begin;

  // 3. What came out.
  result.outcome = solve.converged ? SceneOutcome::kConverged : SceneOutcome::kNotConverged;
  if (!solve.converged) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "residual %.3g N after %d iterations of load step %d of %d, asked for %.3g N",
                  solve.residual, solve.iterations, result.steps, scene.solver.load_steps,
                  scene.solver.residual_tolerance);
    result.reason = text;
  }
  result.residual = solve.residual;
  result.nodes = state.x;
  Eigen::Matrix3Xd gradient(3, n);
  result.energy = Statics::evaluate(problem, state, gradient);
  result.gravity_energy = -(scene.loads.gravity.transpose() * state.x).dot(rod.mass);
  for (const Support& support : scene.supports) {
    result.reactions.push_back(reaction_at(support, problem, state, gradient));
  }
  if (rod.twisted) {
    result.twist = Eigen::VectorXd::Zero(n);
    for (int i = 1; i + 1 < n; ++i) {
      result.twist[i] = state.theta[i] - state.theta[i - 1] + state.reference_twist[i];
    }
  }
  return result;
}

}  // namespace wireplan::simulate
