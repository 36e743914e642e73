// Who breaks where: stiff, soft, long, overloaded and cornered wires on a fixed grid, each method's
// answer checked by means that the method does not use.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/bench/bench_report.h"
#include "pipeline/bench/bench_walls.h"
#include "pipeline/bench/stability_results.h"
#include "pipeline/bench/stability_scenes.h"
#include "pipeline/files/text.h"
#include "simulate/equilibrium/dynamics.h"
#include "simulate/equilibrium/solver.h"
#include "simulate/insertion/trial.h"

namespace wireplan::pipeline {
namespace {

using simulate::EndSupport;
using simulate::MotionOptions;
using simulate::MotionOutcome;
using simulate::MotionResult;
using simulate::NewtonResult;
using simulate::Problem;
using simulate::Rod;
using simulate::RodState;
using simulate::Section;
using simulate::Statics;
using simulate::TrialResult;
using simulate::Wire;

constexpr double kMass = 0.1 * kTonnePerMmFromKgPerM;  // of the paper's wire [t/mm]
constexpr double kDamping = 100.0;                     // of the Euler schemes [1/s]
const std::vector<double> kTimeSteps = {1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1e0};  // [s]

// ---------------------------------------------------------------- scenes without a wall

Wire wire_of(const StaticScene& scene) {
  Wire wire{.name = scene.name, .radius = 0.4, .sections = {}};
  for (int part = 0; part < 3; ++part) {
    const double soft = part == scene.soft_part ? scene.ratio : 1.0;
    wire.sections.push_back({.length = scene.length() / 3.0,
                             .bending_stiffness = scene.EI() / soft,
                             .axial_stiffness = scene.EA() / soft,
                             .mass_per_length = kMass});
  }
  return wire;
}

/// Holds what its problem points to, so it stays where it is.
struct Model {
  Rod rod;
  Eigen::Matrix3Xd load;
  Problem problem;
  RodState start;

  explicit Model(const StaticScene& scene)
      : rod(build_rod(wire_of(scene), Eigen::VectorXd::Constant(
                                          scene.nodes - 1, scene.element_length * (1.0 - 1e-12)))),
        load(Vec3(0.0, -scene.gravity, 0.0) * rod.mass.transpose()),
        start(straight_state(rod, Vec3::Zero(), Vec3::UnitX(), 0.0)) {
    load.rightCols<1>() += scene.tip_force();
    problem.rod = &rod;
    problem.last = rod.nodes();
    problem.load = &load;
    const EndSupport clamp{.hold_along = true,
                           .hold_across = true,
                           .hold_roll = true,
                           .axis = Vec3::UnitX(),
                           .tangent = Vec3::UnitX()};
    problem.proximal = clamp;
    if (scene.squeeze > 0.0) {
      problem.distal = clamp;
      start.x *= 1.0 - scene.squeeze;
    }
  }
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

  bool squeezed() const { return problem.distal.hold_along; }
};

// ---------------------------------------------------------------- rows

struct Finding {
  std::string outcome, verdict = "ok", note;
  std::optional<double> worst_energy_rise, residual, energy, critical_time_step;
  long iterations = 0;
};

void fail(Finding& finding, const std::string& note) {
  finding.verdict = "failed";
  finding.note += (finding.note.empty() ? "" : "; ") + note;
}

Json finding_row(const std::string& scene, const std::string& method, const Finding& finding) {
  Json row;
  row["scene"] = scene;
  row["method"] = method;
  row["outcome"] = finding.outcome;
  row["verdict"] = finding.verdict;
  row["worst_energy_rise"] = number_or_null(finding.worst_energy_rise);
  row["iterations"] = finding.iterations;
  row["residual_n"] = number_or_null(finding.residual);
  row["energy_n_mm"] = number_or_null(finding.energy);
  return row;
}

Json row_of(const StaticScene& scene, const std::string& method, std::optional<double> time_step,
            const Finding& finding) {
  Json row = finding_row(scene.name, method, finding);
  row["time_step_s"] = number_or_null(time_step);
  row["critical_time_step_s"] = number_or_null(finding.critical_time_step);
  row["bend_coefficient_n_per_m"] = clean(scene.bend);
  row["stretch_coefficient_n_per_m3"] = clean(scene.stretch);
  row["stiffness_ratio"] = scene.ratio;
  row["element_length_mm"] = scene.element_length;
  row["nodes"] = scene.nodes;
  row["gravity_m_per_s2"] = scene.gravity / kMmPerM;
  row["tip_force_n"] = clean(scene.tip_force().norm());
  row["squeeze"] = scene.squeeze;
  row["bending_stiffness_n_mm2"] = clean(scene.EI());
  row["note"] = finding.note;
  return row;
}

// ---------------------------------------------------------------- checks

/// Allowed for rounding in an energy.
double energy_slack(double a, double b) { return 1e-11 * (1.0 + std::abs(a) + std::abs(b)); }

double energy_at(const Model& model, const RodState& state) {
  Eigen::Matrix3Xd gradient(3, model.rod.nodes());
  return Statics::evaluate(model.problem, state, gradient).total();
}

/// Moment of a clamp on its end of the wire: the couple of its half element.
Vec3 clamp_moment(const Model& model, const RodState& state, int edge, double stiffness) {
  const double l = model.rod.rest_length[edge];
  const Vec3 e = state.x.col(edge + 1) - state.x.col(edge);
  return e.cross((stiffness / l) * (Vec3::UnitX() - e / l));
}

/// Do supports and loads balance, in force and in moment about the proximal end? Told from the
/// positions alone, whatever the solver says. `residual`: the largest force out of balance that may
/// be at each node.
void check_balance(const Model& model, const RodState& state, double residual, Finding& finding) {
  const int n = model.rod.nodes();
  Eigen::Matrix3Xd gradient(3, n);
  const double energy = Statics::evaluate(model.problem, state, gradient).total();
  const double start = energy_at(model, model.start);
  if (energy > start + energy_slack(energy, start)) fail(finding, "more energy than at the start");

  const int held_from = model.squeezed() ? n - 1 : n;
  for (int i = 1; i < held_from; ++i) {
    if (gradient.col(i).norm() > 2.0 * residual) {
      fail(finding, "node " + std::to_string(i) + " is out of balance by " +
                        format("%.3g N", gradient.col(i).norm()));
      break;
    }
  }
  Vec3 force = gradient.col(0) + model.load.rowwise().sum();
  Vec3 moment = clamp_moment(model, state, 0, model.rod.proximal_bend);
  const Eigen::Matrix3Xd arm = state.x.colwise() - state.x.col(0).eval();
  for (int i = 0; i < n; ++i) moment += Vec3(arm.col(i)).cross(Vec3(model.load.col(i)));
  if (model.squeezed()) {
    force += gradient.col(n - 1);
    moment += Vec3(arm.col(n - 1)).cross(Vec3(gradient.col(n - 1))) +
              clamp_moment(model, state, n - 2, model.rod.distal_bend);
  }
  const double reach = arm.colwise().norm().maxCoeff();
  const double loads = model.load.colwise().norm().sum();
  const double allowed = n * residual + 1e-9 * loads;
  if (force.norm() > allowed) {
    fail(finding, "the supports miss the loads by " + format("%.3g N", force.norm()));
  }
  if (moment.norm() > allowed * reach) {
    fail(finding, "the moments miss balance by " + format("%.3g N mm", moment.norm()));
  }
}

/// Under next to no load the tip sinks as beam theory says; half an element at the clamp makes the
/// chain softer by 1/(2 n^2).
void check_beam_theory(const StaticScene& scene, const RodState& state, Finding& finding) {
  const double L = scene.length(), n = scene.nodes - 1;
  const double expected =
      scene.tip_force().norm() * L * L * L / (3.0 * scene.EI()) * (1.0 + 0.5 / (n * n));
  const double actual = -state.x(1, scene.nodes - 1);
  if (std::abs(actual - expected) > 1e-4 * expected) {
    fail(finding, "the tip sinks by " + format("%.6g mm, ", actual) +
                      format("beam theory says %.6g mm", expected));
  }
}

// ---------------------------------------------------------------- methods

/// Residual that is asked for: 1e-6 N, less where the loads themselves are that small.
double tolerance_of(const Model& model) {
  return std::min(1e-6, 1e-4 * model.load.colwise().norm().sum());
}

Finding run_newton(const StaticScene& scene) {
  const Model model(scene);
  RodState state = model.start;
  Statics statics;
  const double tolerance = tolerance_of(model);
  const NewtonResult result =
      statics.solve(model.problem, state, {.residual_tolerance = tolerance});
  Finding finding;
  finding.outcome = result.converged ? "converged" : "not_converged";
  finding.worst_energy_rise = result.worst_energy_rise;
  finding.residual = result.residual;
  finding.energy = result.energy;
  finding.iterations = result.iterations;
  if (!state.x.allFinite() || !std::isfinite(result.energy)) {
    fail(finding, "a number is not finite");
    return finding;
  }
  if (result.worst_energy_rise > energy_slack(result.energy, energy_at(model, model.start))) {
    fail(finding, "the energy rose");
  }
  if (!result.converged) {
    if (finding.verdict == "ok") finding.verdict = "limit";
    finding.note += (finding.note.empty() ? "" : "; ") +
                    format("%.3g N out of balance, ", result.residual) +
                    format("asked for %.3g N", tolerance);
    return finding;
  }
  check_balance(model, state, std::max(tolerance, result.rounding_floor), finding);
  if (scene.group == "tiny_load") check_beam_theory(scene, state, finding);
  return finding;
}

using Motion = MotionResult (*)(const Problem&, RodState&, const MotionOptions&);
struct MotionMethod {
  const char* name;
  Motion run;
  bool euler;
};
const std::vector<MotionMethod> kMotions = {
    {"conjugate_gradient", simulate::run_conjugate_gradient, false},
    {"explicit", simulate::run_explicit_euler, true},
    {"semi_implicit", simulate::run_semi_implicit_euler, true}};

Finding run_motion(const StaticScene& scene, const MotionMethod& method, double time_step,
                   long node_steps) {
  const Model model(scene);
  RodState state = model.start;
  const long steps = std::max(50L, node_steps / scene.nodes);
  const MotionResult result = method.run(model.problem, state,
                                         {.time_step = time_step,
                                          .duration = time_step * static_cast<double>(steps),
                                          .residual_tolerance = tolerance_of(model),
                                          .damping = method.euler ? kDamping : 0.0});
  Finding finding;
  finding.worst_energy_rise = result.worst_energy_rise;
  finding.residual = result.residual;
  finding.iterations = result.steps;
  if (method.euler) finding.critical_time_step = result.critical_time_step;
  if (!state.x.allFinite()) fail(finding, "a number is not finite");
  const bool beyond = method.euler && time_step > result.critical_time_step;
  if (result.outcome == MotionOutcome::kUnstable) {
    finding.outcome = "unstable";
    if (!method.euler) fail(finding, "the energy rose");
    if (finding.verdict == "ok") finding.verdict = "limit";
    if (method.euler && !beyond) finding.note = "within the critical step of the start";
    return finding;
  }
  finding.outcome = result.outcome == MotionOutcome::kConverged ? "converged" : "finished";
  // What starts at rest may swing, but never above the start.
  const double start = energy_at(model, model.start), energy = energy_at(model, state);
  finding.energy = energy;
  if (!(energy <= start + energy_slack(energy, start))) {
    const std::string more =
        "ends with " + format("%.3g N mm", energy - start) + " more than at the start";
    if (beyond) {
      finding.verdict = "limit";
      finding.note = more + ", beyond the critical step";
    } else {
      fail(finding, more);
    }
  }
  if (!method.euler && result.worst_energy_rise > energy_slack(energy, start)) {
    fail(finding, "the energy rose");
  }
  return finding;
}

// ---------------------------------------------------------------- scenes with a wall

struct ContactScene {
  const BenchWall* wall;
  const simulate::VesselModel* vessel;
  std::string entry;  // "axis", "along_wall", "into_wall"
  double EI;          // [N mm^2]
};

constexpr double kWireRadius = 0.4445;  // of 0.035 inch                                [mm]

Finding run_contact(const ContactScene& scene) {
  const Wire wire{.name = "wire",
                  .radius = kWireRadius,
                  .sections = {{.length = 100.0, .bending_stiffness = scene.EI}}};
  simulate::Introducer introducer{.point = Vec3(0.0, 0.0, 3.0), .direction = Vec3::UnitZ()};
  if (scene.entry == "along_wall") {
    introducer.point.x() = std::max(0.0, scene.wall->entry_radius - kWireRadius - 0.1);
  }
  if (scene.entry == "into_wall") {
    const double angle = 80.0 * kRadPerDeg;
    introducer.direction = Vec3(std::sin(angle), 0.0, std::cos(angle));
  }
  const simulate::InsertionOptions options{.length = 55.0};
  const TrialResult result = run_trial(
      wire, introducer, {.point = Vec3(0.0, 0.0, 53.0), .radius = 3.0}, *scene.vessel, options);

  Finding finding;
  finding.outcome = simulate::outcome_name(result.outcome);
  finding.note = result.reason;
  if (result.outcome == simulate::Outcome::kFailed) finding.verdict = "failed";
  const bool named = result.outcome == simulate::Outcome::kNotConverged ||
                     result.outcome == simulate::Outcome::kLeftLumen;
  if (named) finding.verdict = "limit";
  double residual = 0.0, penetration = 0.0;
  for (const simulate::Push& push : result.pushes) {
    finding.iterations += push.iterations;
    residual = std::max(residual, push.residual);
    penetration = std::max(penetration, push.max_penetration);
  }
  finding.residual = residual;
  if (!result.nodes.allFinite()) {
    fail(finding, "a number is not finite");
    return finding;
  }
  if (residual > options.residual_tolerance) fail(finding, "a push was kept out of balance");
  // A wire whose middle is outside has gone through the wall by its radius at least, as far as the
  // smooth wall follows the triangles.
  for (const Vec3& node : result.nodes.colwise()) {
    if (named || is_inside(scene.wall->surface, node)) continue;
    if (penetration + scene.vessel->lumen.max_deviation() < kWireRadius) {
      fail(finding, "a node is outside, which the penetration of " +
                        format("%.3g mm does not tell", penetration));
    }
    break;
  }
  return finding;
}

Json row_of(const ContactScene& scene, const std::string& name, const Finding& finding) {
  Json row = finding_row(name, "newton", finding);
  row["time_step_s"] = nullptr;
  row["critical_time_step_s"] = nullptr;
  row["bend_coefficient_n_per_m"] = clean(scene.EI / kNPerMmFromNPerM);  // at 1 mm elements
  row["stretch_coefficient_n_per_m3"] =
      clean(2.0 * scene.EI / (kWireRadius * kWireRadius) / kNPerMm3FromNPerM3);
  row["stiffness_ratio"] = 1.0;
  row["element_length_mm"] = 1.0;
  row["nodes"] = 58;
  row["gravity_m_per_s2"] = 0.0;
  row["tip_force_n"] = 0.0;
  row["squeeze"] = 0.0;
  row["bending_stiffness_n_mm2"] = scene.EI;
  row["note"] = finding.note;
  return row;
}

// ---------------------------------------------------------------- tools in one another

/// All moves of a scene, each held against the laws that it must keep.
Finding run_coaxial(const CoaxialScene& given, const simulate::VesselModel& tube) {
  simulate::ToolScene scene = tool_scene_of(given);
  if (given.in_tube) scene.vessel = &tube;
  simulate::ToolBench bench(scene);
  Finding finding;
  finding.outcome = "converged";
  finding.worst_energy_rise = finding.residual = 0.0;
  const auto check = [&](const std::string& when) {
    const simulate::ToolRecord& record = bench.record();
    finding.iterations += record.iterations;
    finding.residual = std::max(*finding.residual, record.residual);
    finding.worst_energy_rise = std::max(*finding.worst_energy_rise, record.worst_energy_rise);
    finding.energy = record.energy.total();
    if (!bench.state().x.allFinite() || !std::isfinite(*finding.energy)) {
      fail(finding, "a number is not finite " + when);
    }
    const double size = record.energy.bend + record.energy.stretch;
    if (record.worst_energy_rise > energy_slack(size, *finding.energy)) {
      fail(finding, "the energy rose " + when);
    }
    // What holds the tools balances, whatever the solver says.
    Vec3 sum = bench.introducer_force();
    for (const simulate::Touch& touch : bench.touches()) {
      sum += touch.normal_force * touch.normal + touch.friction;
    }
    const double allowed =
        static_cast<double>(bench.state().x.cols()) * scene.residual_tolerance + 1e-9 * size;
    if (sum.norm() > allowed) fail(finding, format("%.3g N are not held ", sum.norm()) + when);
  };
  bool good = bench.settled();
  std::string when = "at the start";
  if (good) check(when);
  for (std::size_t k = 0; k < scene.moves.size() && good; ++k) {
    when = "in move " + std::to_string(k);
    good = bench.move(scene.moves[k]);
    if (good) check(when);
  }
  if (good) return finding;
  finding.outcome = bench.through_wall() ? "left_lumen" : "not_converged";
  finding.residual = bench.record().residual;
  if (finding.verdict == "ok") finding.verdict = "limit";
  finding.note += (finding.note.empty() ? "" : "; ") + when;
  return finding;
}

Json row_of(const CoaxialScene& given, const Finding& finding) {
  const simulate::ToolScene scene = tool_scene_of(given);
  const double EI = scene.tools[0].wire.sections[0].bending_stiffness;
  Json row = finding_row(given.name, "newton", finding);
  row["time_step_s"] = nullptr;
  row["critical_time_step_s"] = nullptr;
  row["bend_coefficient_n_per_m"] = clean(EI / kNPerMmFromNPerM);  // at 1 mm elements
  row["stretch_coefficient_n_per_m3"] =
      clean(2.0 * EI / std::pow(scene.tools[0].wire.radius, 2) / kNPerMm3FromNPerM3);
  row["stiffness_ratio"] = given.ratio;
  row["element_length_mm"] = scene.element_length;
  row["nodes"] = given.nodes();
  row["gravity_m_per_s2"] = 0.0;
  row["tip_force_n"] = 0.0;
  row["squeeze"] = 0.0;
  row["bending_stiffness_n_mm2"] = clean(EI);
  row["note"] = finding.note;
  return row;
}

// ---------------------------------------------------------------- all of them

/// An exception is a finding too.
template <typename Run>
Finding guarded(const Run& run) {
  try {
    return run();
  } catch (const std::exception& error) {
    Finding finding;
    finding.outcome = "exception";
    fail(finding, error.what());
    return finding;
  }
}

/// Every `stride`-th scene of the grid without a wall, by all methods.
void run_static_scenes(int stride, std::vector<Json>& rows) {
  const long euler_work = stride == 1 ? 1'000'000 : 20'000;  // nodes times steps
  const std::vector<StaticScene> scenes = static_scenes();
  for (std::size_t k = 0; k < scenes.size(); k += static_cast<std::size_t>(stride)) {
    const StaticScene& scene = scenes[k];
    rows.push_back(row_of(scene, "newton", {}, guarded([&] { return run_newton(scene); })));
    if (scene.squeeze > 0.0) continue;
    const bool every_step = scene.group == "coefficients" && stride == 1;
    for (const MotionMethod& method : kMotions) {
      for (std::size_t step = 0; step < kTimeSteps.size(); ++step) {
        // A time step means nothing to the conjugate gradient: once, for longer.
        if (!method.euler && step != 3) continue;
        if (method.euler && !every_step && step % 2 == 1) continue;
        const long work = method.euler ? euler_work : 5 * euler_work;
        rows.push_back(row_of(scene, method.name, kTimeSteps[step], guarded([&] {
                                return run_motion(scene, method, kTimeSteps[step], work);
                              })));
      }
    }
  }
}

void run_contact_scenes(int stride, std::vector<Json>& rows) {
  const std::vector<BenchWall> walls = make_bench_walls();
  int count = 0;
  for (const BenchWall& wall : walls) {
    std::optional<simulate::VesselModel> vessel;
    for (const char* entry : {"axis", "along_wall", "into_wall"}) {
      for (const double EI : {1.0, 50.0, 1000.0, 1e5}) {
        if (count++ % stride != 0) continue;
        if (!vessel) vessel.emplace(wall.surface);
        const ContactScene scene{&wall, &*vessel, entry, EI};
        rows.push_back(row_of(scene, wall.name + "-" + entry + "-" + format("%g", EI),
                              guarded([&] { return run_contact(scene); })));
      }
    }
  }
}

void run_coaxial_scenes(int stride, std::vector<Json>& rows) {
  const simulate::VesselModel tube(make_s_tube().surface);
  const std::vector<CoaxialScene> scenes = coaxial_scenes();
  for (std::size_t k = 0; k < scenes.size(); k += static_cast<std::size_t>(stride)) {
    rows.push_back(row_of(scenes[k], guarded([&] { return run_coaxial(scenes[k], tube); })));
  }
}

}  // namespace

BenchReport bench_stability(const BenchOptions& options) {
  BenchReport report;
  const int stride = options.quick ? 7 : 1;
  run_static_scenes(stride, report.rows);
  run_contact_scenes(stride, report.rows);
  run_coaxial_scenes(stride, report.rows);
  report.description = describe_stability();
  const std::vector<Json> summary = summarize_stability(report.rows);
  const std::vector<std::string> lower = find_lower_energies(report.rows);
  std::vector<Json> failed, limits;
  for (const Json& row : report.rows) {
    if (row.at("verdict") == "failed") failed.push_back(row);
    if (row.at("verdict") == "limit" && row.at("method") == "newton") limits.push_back(row);
  }
  report.results = {{"scenes", count_scenes(report.rows)},
                    {"every_nth_scene_of_the_grid", stride},
                    {"summary", summary},
                    {"scenes_where_another_method_ends_lower_than_newton", lower}};
  report.text = std::to_string(count_scenes(report.rows)) + " scenes" +
                (options.quick ? ", every 7th of the grid" : "") + "\n" + table_text(summary) +
                "\nScenes where another method ends with less energy than newton: " +
                std::to_string(lower.size()) + "\n" +
                "\nFailed rows: " + std::to_string(failed.size()) + "\n" + table_text(failed) +
                "\nNewton's limits: " + std::to_string(limits.size()) + "\n" + table_text(limits);
  report.plot = plot_stability(report.rows);
  return report;
}

}  // namespace wireplan::pipeline
