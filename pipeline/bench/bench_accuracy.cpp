// Error against run time on scenes whose answer is known, and the paper's Table 1.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "pipeline/bench/bench_report.h"
#include "pipeline/files/text.h"
#include "pipeline/report/plot.h"
#include "preprocess/cores.h"
#include "simulate/equilibrium/dynamics.h"
#include "simulate/equilibrium/solver.h"

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
using simulate::Wire;

// ---------------------------------------------------------------- scenes

/// A wire clamped at the origin along +x, and the place where its tip comes to rest.
struct AccuracyScene {
  std::string name, text;
  Wire wire;
  Vec3 gravity = Vec3::Zero();    //                                                   [mm/s^2]
  Vec3 tip_force = Vec3::Zero();  //                                                   [N]
  double tip_moment = 0.0;        // about +z, on a table normal to z                  [N mm]
  Vec3 tip = Vec3::Zero();        // the answer                                        [mm]
  std::string source;             // of the answer
  double cross_check = 0.0;       // between the answer and a second source; 0: there is none  [mm]
  bool forces_alone() const { return wire.straight() && tip_moment == 0.0; }
};

/// A scene cut into elements. Holds what its problem points to, so it stays where it is.
struct Model {
  Rod rod;
  Eigen::Matrix3Xd load;
  Problem problem;
  RodState start;

  Model(const AccuracyScene& scene, int elements)
      : rod(build_rod(scene.wire, scene.wire.length(), elements)),
        load(scene.gravity * rod.mass.transpose()) {
    const Vec3 along = Vec3::UnitX();
    start = rest_state(rod, Vec3::Zero(), along, kPi);  // a curved wire bends toward +y
    load.rightCols<1>() += scene.tip_force;
    problem.rod = &rod;
    problem.last = rod.nodes();
    problem.proximal = EndSupport{.hold_along = true,
                                  .hold_across = true,
                                  .hold_roll = true,
                                  .axis = along,
                                  .tangent = along};
    if (!load.isZero(0.0)) problem.load = &load;
    if (scene.tip_moment != 0.0) {
      problem.tip_moment = {.axis = Vec3::UnitZ(), .size = scene.tip_moment};
      problem.plane = Vec3::UnitZ();
    }
  }
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;
};

/// The force that tolerances are a part of: all loads together, or the moment over the length.
double load_of(const AccuracyScene& scene) {
  const Section& section = scene.wire.sections.front();
  return (scene.gravity * section.mass_per_length * section.length + scene.tip_force).norm() +
         scene.tip_moment / section.length;
}

/// Tip of a heavy cantilever with a dead tip load, both along -y, from the differential equations
/// of the wire that the elements tend to: r' = lambda t, energy EA/8 (lambda^2 - 1)^2 + EI/2
/// lambda^2 theta'^2 per length. Integrated from the tip by Runge and Kutta's method, the tip's
/// angle found by bisection. Left out is a boundary layer of width sqrt(EI/EA) at the clamp, in
/// which lambda comes to its value. Elements shorter than it show it: it moves the tip of the heavy
/// cantilever by 3e-4 % of the length, so errors below that are not the method's.
Vec3 shoot_cantilever(const Section& wire, double weight_per_length, double tip_load) {
  const double EI = wire.bending_stiffness, EA = wire.axial_stiffness, L = wire.length;
  using State = Eigen::Vector4d;  // theta, moment, and the way to the tip along x and y
  const auto derivative = [&](double s, const State& state) -> State {
    const double V = tip_load + weight_per_length * (L - s);
    const double c = std::cos(state[0]), m = state[1];
    double lambda = 1.0;
    for (int k = 0; k < 4; ++k) {
      const double cube = lambda * lambda * lambda;
      const double f = 0.5 * EA * (cube - lambda) + m * m / (EI * cube) + V * std::sin(state[0]);
      lambda -= f / (0.5 * EA * (3.0 * lambda * lambda - 1.0) - 3.0 * m * m / (EI * cube * lambda));
    }
    return {m / (EI * lambda * lambda), lambda * V * c, -lambda * c, -lambda * std::sin(state[0])};
  };
  const auto from_tip = [&](double tip_angle) {
    constexpr int kSteps = 4000;
    const double h = -L / kSteps;
    State state(tip_angle, 0.0, 0.0, 0.0);
    for (int k = 0; k < kSteps; ++k) {
      const double s = L + k * h;
      const State k_1 = derivative(s, state);
      const State k_2 = derivative(s + 0.5 * h, state + 0.5 * h * k_1);
      const State k_3 = derivative(s + 0.5 * h, state + 0.5 * h * k_2);
      const State k_4 = derivative(s + h, state + h * k_3);
      state += (h / 6.0) * (k_1 + 2.0 * k_2 + 2.0 * k_3 + k_4);
    }
    return state;
  };
  // The tip hangs between straight down and straight out; at the right angle the clamp is level.
  double low = -0.5 * kPi, high = 0.0;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (from_tip(middle)[0] < 0.0 ? low : high) = middle;
  }
  const State clamp = from_tip(0.5 * (low + high));
  return {clamp[2], clamp[3], 0.0};
}

/// Tip of a wire rolled up by an end moment: a circle, of radius lambda / theta' (see above).
Vec3 rolled_up_tip(const Section& wire, double moment) {
  const double EI = wire.bending_stiffness, EA = wire.axial_stiffness;
  double lambda = 1.0;
  for (int k = 0; k < 20; ++k) {  // EA/2 (lambda^2 - 1) + M^2 / (EI lambda^4) = 0
    lambda = std::sqrt(1.0 - 2.0 * moment * moment / (EI * EA * std::pow(lambda, 4)));
  }
  const double curvature = moment / (EI * lambda * lambda), angle = curvature * wire.length;
  return lambda / curvature * Vec3(std::sin(angle), 1.0 - std::cos(angle), 0.0);
}

Vec3 newton_tip(const AccuracyScene& scene, int elements) {
  const Model model(scene, elements);
  RodState state = model.start;
  Statics statics;
  const NewtonResult result =
      statics.solve(model.problem, state, {.residual_tolerance = 1e-6 * load_of(scene)});
  expects(result.converged);
  return state.x.rightCols<1>();
}

/// The error of second-order elements taken out, from twice as many.
Vec3 extrapolate(const Vec3& coarse, const Vec3& fine) { return (4.0 * fine - coarse) / 3.0; }

/// The wire of the paper's Fig. 4, k_b = 100 N/m, k_s = 1e10 N/m^3 and 0.2 g at 2 mm elements.
Wire paper_wire() {
  return {.name = "paper",
          .radius = 0.4,
          .sections = {{.length = 40.0,
                        .bending_stiffness = 0.8,
                        .axial_stiffness = 160.0,
                        .mass_per_length = 0.1 * kTonnePerMmFromKgPerM}}};
}

constexpr double kGravity = 9810.0;  // [mm/s^2]

AccuracyScene heavy_cantilever() {
  AccuracyScene scene;
  scene.name = "heavy_cantilever";
  scene.text = "the paper's wire (40 mm, EI 0.8 N mm^2, EA 160 N, 0.1 kg/m) under its own weight";
  scene.wire = paper_wire();
  scene.gravity = Vec3(0.0, -kGravity, 0.0);
  const Section& wire = scene.wire.sections.front();
  scene.tip = shoot_cantilever(wire, wire.mass_per_length * kGravity, 0.0);
  scene.source = "shooting on the differential equations, good to 3e-4 % of the length";
  scene.cross_check = (scene.tip - Vec3(7.3710, -37.1520, 0.0)).norm();
  return scene;
}

AccuracyScene tip_load() {
  AccuracyScene scene;
  scene.name = "tip_load";
  scene.text = "the same wire without weight, a dead tip load P L^2/EI = 10";
  scene.wire = paper_wire();
  const Section& wire = scene.wire.sections.front();
  const double load = 10.0 * wire.bending_stiffness / (wire.length * wire.length);
  scene.tip_force = Vec3(0.0, -load, 0.0);
  scene.tip = shoot_cantilever(wire, 0.0, load);
  scene.source = "shooting on the differential equations, good to 4e-5 % of the length";
  // Bisshopp and Drucker's elastica, which does not stretch: u/L = 0.55500, w/L = 0.81061.
  scene.cross_check = (scene.tip / wire.length - Vec3(0.44500, -0.81061, 0.0)).norm() * wire.length;
  return scene;
}

AccuracyScene roll_up() {
  AccuracyScene scene;
  scene.name = "roll_up";
  scene.text = "the same wire on a table, rolled up to a half circle by a tip moment";
  scene.wire = paper_wire();
  const Section& wire = scene.wire.sections.front();
  scene.tip_moment = kPi * wire.bending_stiffness / wire.length;
  scene.tip = rolled_up_tip(wire, scene.tip_moment);
  scene.source = "closed form, good to 1e-5 % of the length";
  return scene;
}

AccuracyScene bend_45() {
  AccuracyScene scene;
  scene.name = "bend_45";
  scene.text =
      "Bathe and Bolourchi's 45 degree bend (radius 100 mm, EI = GJ = 8.333e5 N mm^2, EA 1e7 N), "
      "600 N out of its plane at the tip: bending and twist";
  scene.wire = {.name = "bend",
                .radius = 0.5,
                .sections = {{.length = 25.0 * kPi,
                              .bending_stiffness = 1e7 / 12.0,
                              .axial_stiffness = 1e7,
                              .twist_stiffness = 1e7 / 12.0,
                              .rest_curvature = 0.01}}};
  scene.tip_force = Vec3(0.0, 0.0, 600.0);
  scene.tip = extrapolate(newton_tip(scene, 640), newton_tip(scene, 1280));
  scene.source = "Newton at 640 and 1280 elements, extrapolated";
  // Kirchhoff's rod without stretch: -23.559 along the start, -13.604 toward the centre, 53.469 up.
  const double c = 100.0 * std::sqrt(0.5);
  const Vec3 kirchhoff(c - 23.559, 100.0 - c - 13.604, 53.469);
  scene.cross_check = (scene.tip - kirchhoff).norm();
  return scene;
}

// ---------------------------------------------------------------- measuring

/// What one solve gives.
struct Solve {
  Vec3 tip = Vec3::Zero();
  double milliseconds = 0.0;  // of the solver alone
  long iterations = 0;
  double residual = 0.0;  // [N]
  std::string outcome;    // "converged" to the tolerance, "not_converged" or "unstable"
};

/// One row: a method at one size and tolerance, the iterations or steps that it may take, and the
/// times of its solves.
struct Contender {
  const AccuracyScene* scene;
  std::string method;
  int elements;
  double tolerance;
  long step_limit;
  std::function<Solve()> solve;
  Solve last{};
  int solves = 0;
  std::vector<double> times{};

  /// The first solve warms up and counts for slow ones alone.
  void solve_once(double enough_ms) {
    last = solve();
    if (++solves > 1 || last.milliseconds > 5.0 * enough_ms) times.push_back(last.milliseconds);
  }
  /// Until `enough_ms` and 5 solves, or ten times as long.
  bool wants_more(double enough_ms) const {
    double sum = 0.0;
    for (const double time : times) sum += time;
    return times.empty() || sum < enough_ms || (times.size() < 5 && sum < 10.0 * enough_ms);
  }
};

/// Times all contenders in turn, round by round, until each has enough.
void measure(std::vector<Contender>& contenders, double enough_ms) {
  bool more = true;
  while (more) {
    more = false;
    for (Contender& contender : contenders) {
      if (contender.wants_more(enough_ms)) contender.solve_once(enough_ms);
      more = more || contender.wants_more(enough_ms);
    }
  }
}

double enough_ms(bool quick) { return quick ? 2.0 : 20.0; }

double error_percent(const AccuracyScene& scene, const Vec3& tip) {
  return 100.0 * (tip - scene.tip).norm() / scene.wire.length();
}

Json row_of(const Contender& contender) {
  Json row;
  row["scene"] = contender.scene->name;
  row["method"] = contender.method;
  row["elements"] = contender.elements;
  row["residual_tolerance_n"] = clean(contender.tolerance);
  row["step_limit"] = contender.step_limit;
  row["outcome"] = contender.last.outcome;
  row["error_percent_of_length"] = error_percent(*contender.scene, contender.last.tip);
  row["solve_ms"] = median(contender.times);
  row["iterations"] = contender.last.iterations;
  row["residual_n"] = contender.last.residual;
  return row;
}

// ---------------------------------------------------------------- methods

constexpr int kNewtonIterations = 200;

Solve solve_newton(const Model& model, Statics& statics, RodState& state, double tolerance) {
  state = model.start;
  const double begin = thread_cpu_seconds();
  const NewtonResult result = statics.solve(
      model.problem, state, {.residual_tolerance = tolerance, .max_iterations = kNewtonIterations});
  return {state.x.rightCols<1>(), 1e3 * (thread_cpu_seconds() - begin), result.iterations,
          result.residual, result.converged ? "converged" : "not_converged"};
}

Contender newton(const AccuracyScene& scene, int elements, double tolerance) {
  const auto model = std::make_shared<Model>(scene, elements);
  const auto statics = std::make_shared<Statics>();
  const auto state = std::make_shared<RodState>();
  return {&scene,
          "newton",
          elements,
          tolerance,
          kNewtonIterations,
          [=] { return solve_newton(*model, *statics, *state, tolerance); }};
}

/// Newton with half of the elements too, for the tip without its second-order error.
Contender newton_richardson(const AccuracyScene& scene, int elements, double tolerance) {
  const auto fine = std::make_shared<Model>(scene, elements);
  const auto coarse = std::make_shared<Model>(scene, elements / 2);
  const auto statics = std::make_shared<Statics>();
  const auto state = std::make_shared<RodState>();
  return {&scene, "newton_richardson", elements, tolerance, 2 * kNewtonIterations, [=] {
            const Solve a = solve_newton(*coarse, *statics, *state, tolerance);
            const Solve b = solve_newton(*fine, *statics, *state, tolerance);
            return Solve{extrapolate(a.tip, b.tip), a.milliseconds + b.milliseconds,
                         a.iterations + b.iterations, std::max(a.residual, b.residual),
                         a.outcome == "converged" ? b.outcome : a.outcome};
          }};
}

using Motion = MotionResult (*)(const Problem&, RodState&, const MotionOptions&);

Solve solve_motion(Motion run, const Model& model, const MotionOptions& options) {
  RodState state = model.start;
  const double begin = thread_cpu_seconds();
  const MotionResult result = run(model.problem, state, options);
  const double milliseconds = 1e3 * (thread_cpu_seconds() - begin);
  return {state.x.rightCols<1>(), milliseconds, result.steps, result.residual,
          result.outcome == MotionOutcome::kConverged  ? "converged"
          : result.outcome == MotionOutcome::kFinished ? "not_converged"
                                                       : "unstable"};
}

/// A method that steps through time, to ever tighter tolerances (parts of the load). The steps of a
/// run are limited, and where they are not enough for a tolerance, no tighter one is tried. What
/// the first run reaches within a hundredth and a tenth of them is shown too.
void add_motion(const AccuracyScene& scene, const std::string& name, Motion run, int elements,
                bool quick, MotionOptions options, std::vector<Contender>& list) {
  const std::vector<double> parts =
      quick ? std::vector<double>{1e-3} : std::vector<double>{1e-3, 1e-4, 1e-5, 1e-6};
  // Steps in inverse proportion to what one costs, about 10 ns per element: 1.5 s, quick 0.03 s.
  const long step_limit = (quick ? 3'000'000 : 150'000'000) / elements;
  const auto model = std::make_shared<Model>(scene, elements);
  const auto converges = [&](double part, long steps) {
    options.residual_tolerance = part * load_of(scene);
    options.duration = static_cast<double>(steps) * options.time_step;
    Contender row{&scene,   name,
                  elements, options.residual_tolerance,
                  steps,    [=] { return solve_motion(run, *model, options); }};
    row.solve_once(enough_ms(quick));
    list.push_back(row);
    return row.last.outcome == "converged";
  };
  const double first = parts.front();
  if (!converges(first, step_limit / 100) && !converges(first, step_limit / 10) &&
      !converges(first, step_limit)) {
    return;
  }
  for (std::size_t k = 1; k < parts.size(); ++k) {
    if (!converges(parts[k], step_limit)) return;
  }
}

/// Damping of the Euler schemes, twice the lowest frequency of the hanging wire, about 25/s.
constexpr double kDamping = 50.0;  // [1/s]

/// Half of the critical step of an Euler scheme.
double half_critical_step(const AccuracyScene& scene, Motion run, int elements) {
  const Model model(scene, elements);
  RodState state = model.start;
  return 0.5 *
         run(model.problem, state, {.time_step = 1e-12, .duration = 1e-12, .damping = kDamping})
             .critical_time_step;
}

std::vector<Contender> contenders_of(const AccuracyScene& scene, bool quick) {
  const std::vector<int> sizes = quick ? std::vector<int>{10, 20, 40, 80}
                                       : std::vector<int>{10, 20, 40, 60, 80, 160, 320, 400, 640};
  const double load = load_of(scene);
  std::vector<Contender> list;
  for (const int elements : sizes) {
    for (const double tolerance : {1e-3 * load, 1e-5 * load, 1e-6, 1e-9}) {
      list.push_back(newton(scene, elements, tolerance));
      if (elements >= 20) list.push_back(newton_richardson(scene, elements, tolerance));
    }
  }
  if (!scene.forces_alone()) return list;
  for (const int elements : sizes) {
    add_motion(scene, "conjugate_gradient", simulate::run_conjugate_gradient, elements, quick,
               {.time_step = 1e-3}, list);
    const auto add_euler = [&](const char* name, Motion run) {
      const double step = half_critical_step(scene, run, elements);
      add_motion(scene, name, run, elements, quick, {.time_step = step, .damping = kDamping}, list);
    };
    add_euler("explicit", simulate::run_explicit_euler);
    add_euler("semi_implicit", simulate::run_semi_implicit_euler);
  }
  return list;
}

// ---------------------------------------------------------------- Table 1

/// The paper's Table 1: its wire falling for a second, the conjugate gradient at 1 ms against
/// explicit Euler at 1 us, in turn.
Json table_1(const AccuracyScene& scene, bool quick) {
  const Model model(scene, 20);
  const double duration = quick ? 0.02 : 1.0;
  // Damped so that the paper's step is half of the critical one: c = 2 dt w^2.
  RodState state = model.start;
  const MotionResult probe = run_explicit_euler(
      model.problem, state, {.time_step = 1e-12, .duration = 1e-12, .damping = 1.0});
  const double damping = 2.0 * 1e-6 / probe.critical_time_step;
  const MotionOptions gradient_options{.time_step = 1e-3, .duration = duration};
  const MotionOptions explicit_options{.time_step = 1e-6, .duration = duration, .damping = damping};

  Json table;
  table["simulated_s"] = duration;
  table["damping_of_explicit_per_s"] = clean(damping);
  std::vector<double> gradient_times, explicit_times, ratios;
  Solve gradient, euler;
  for (int run = 0; run < (quick ? 1 : 3); ++run) {
    // The short one is timed until 20 ms are full, its first solve left out.
    std::vector<double> times;
    solve_motion(simulate::run_conjugate_gradient, model, gradient_options);
    for (double sum = 0.0; sum < 20.0; sum += times.back()) {
      gradient = solve_motion(simulate::run_conjugate_gradient, model, gradient_options);
      times.push_back(gradient.milliseconds);
    }
    euler = solve_motion(simulate::run_explicit_euler, model, explicit_options);
    gradient_times.push_back(median(times));
    explicit_times.push_back(euler.milliseconds);
    ratios.push_back(euler.milliseconds / gradient_times.back());
  }
  table["conjugate_gradient_ms"] = gradient_times;
  table["conjugate_gradient_us_per_iteration"] =
      1e3 * median(gradient_times) / static_cast<double>(gradient.iterations);
  table["explicit_ms"] = explicit_times;
  table["explicit_us_per_step"] =
      1e3 * median(explicit_times) / static_cast<double>(euler.iterations);
  table["ratio"] = median(ratios);
  table["ratio_min"] = *std::min_element(ratios.begin(), ratios.end());
  table["ratio_max"] = *std::max_element(ratios.begin(), ratios.end());
  table["conjugate_gradient_error_percent_of_length"] = error_percent(scene, gradient.tip);
  table["explicit_error_percent_of_length"] = error_percent(scene, euler.tip);
  table["paper"] = {{"conjugate_gradient_ms", 65}, {"explicit_ms", 14741}, {"ratio", 227}};
  return table;
}

std::string table_1_text(const Json& table) {
  const auto number = [&](const char* key, const char* pattern) {
    return format(pattern, table.at(key).get<double>());
  };
  const double gradient = median(table.at("conjugate_gradient_ms").get<std::vector<double>>());
  const double euler = median(table.at("explicit_ms").get<std::vector<double>>());
  return "The paper's Table 1: " + number("simulated_s", "%g") +
         " simulated s of its wire, CPU time\n  conjugate gradient at 1 ms  " +
         format("%10.4g ms", gradient) + ", " +
         number("conjugate_gradient_us_per_iteration", "%.3f us per iteration, tip still ") +
         number("conjugate_gradient_error_percent_of_length", "%.3g %% of L from its place") +
         "\n  explicit Euler at 1 us      " + format("%10.4g ms", euler) + ", " +
         number("explicit_us_per_step", "%.3f us per step, tip still ") +
         number("explicit_error_percent_of_length", "%.3g %% of L from its place") + "\n  ratio " +
         number("ratio", "%.0f") + number("ratio_min", " (%.0f to ") +
         number("ratio_max", "%.0f); the paper: 227\n");
}

// ---------------------------------------------------------------- what came out

/// Per scene and method, the fastest converged row within each of some errors.
std::vector<Json> fastest_rows(const std::vector<Json>& rows) {
  std::vector<Json> best;
  for (const double bound : {1.0, 0.1, 0.01}) {
    std::vector<Json> found;
    for (const Json& row : rows) {
      if (row.at("outcome") != "converged" || row.at("error_percent_of_length") > bound) continue;
      const auto same = std::find_if(found.begin(), found.end(), [&](const Json& other) {
        return other.at("scene") == row.at("scene") && other.at("method") == row.at("method");
      });
      Json entry;
      entry["within_percent_of_length"] = bound;
      entry.update(row);
      if (same == found.end()) {
        found.push_back(entry);
      } else if (row.at("solve_ms") < same->at("solve_ms")) {
        *same = entry;
      }
    }
    best.insert(best.end(), found.begin(), found.end());
  }
  return best;
}

const std::vector<std::string> kMethods = {"newton", "newton_richardson", "conjugate_gradient",
                                           "explicit", "semi_implicit"};

/// A line per method through what converged, and a dot for each run that was stopped before.
Picture plot_of(const std::vector<AccuracyScene>& scenes, const std::vector<Json>& rows) {
  const std::vector<LegendEntry> legend = {
      {kMethods[0], Color(0.05F, 0.10F, 0.65F)}, {kMethods[1], Color(0.00F, 0.60F, 0.55F)},
      {kMethods[2], Color(0.75F, 0.10F, 0.55F)}, {kMethods[3], Color(0.85F, 0.45F, 0.00F)},
      {kMethods[4], Color(0.45F, 0.45F, 0.45F)}, {"stopped before", Color(0.80F, 0.75F, 0.60F)}};
  const std::size_t stopped = kMethods.size();
  constexpr double kLeastError = 1e-7;  // [%] shown
  std::vector<FrontPlot> plots;
  for (const AccuracyScene& scene : scenes) {
    FrontPlot plot{scene.name, "time of one solve [ms]", "error of the tip [% of the length]", {}};
    for (std::size_t k = 0; k < kMethods.size(); ++k) plot.lines.push_back({k, {}});
    for (const Json& row : rows) {
      if (row.at("scene") != scene.name) continue;
      const Eigen::Vector2d point(
          row.at("solve_ms").get<double>(),
          std::max(kLeastError, row.at("error_percent_of_length").get<double>()));
      if (row.at("outcome") == "converged") {
        const auto method = std::find(kMethods.begin(), kMethods.end(), row.at("method"));
        plot.lines[static_cast<std::size_t>(method - kMethods.begin())].points.push_back(point);
      } else {
        plot.lines.push_back({stopped, {point}});  // by itself, so that no line joins it
      }
    }
    plots.push_back(plot);
  }
  return draw_fronts("Error against run time", plots, 2, legend);
}

Json describe(const std::vector<AccuracyScene>& scenes) {
  Json list = Json::array();
  for (const AccuracyScene& scene : scenes) {
    Json entry;
    entry["name"] = scene.name;
    entry["scene"] = scene.text;
    entry["tip_mm"] = to_json(scene.tip);
    entry["source"] = scene.source;
    if (scene.cross_check > 0.0) entry["distance_from_second_source_mm"] = scene.cross_check;
    list.push_back(entry);
  }
  return {
      {"scenes", list},
      {"methods",
       {{"newton", "static equilibrium from the unloaded shape, one load step"},
        {"newton_richardson", "newton at n and n/2 elements, tip = (4 a - b)/3; both timed"},
        {"conjugate_gradient", "paper Eq. (20)-(23), to the residual tolerance"},
        {"explicit", "Euler at half of the critical step, damping 50/s, to the tolerance"},
        {"semi_implicit", "Euler at half of the critical step, damping 50/s, to the tolerance"}}},
      {"time",
       "solver only, one thread's CPU time, median of at least 20 ms and 5 solves (quick: 2 ms; "
       "slow ones: ten times as long) after a warm-up, all rows of a scene in turn; of the Euler "
       "schemes it includes finding the critical step"},
      {"outcome",
       "converged: to residual_tolerance_n, or newton to what rounding leaves. not_converged: "
       "step_limit iterations or time steps "
       "were not enough; the error is what they reach, and no tighter tolerance was tried. "
       "step_limit is 1.5e8 (quick: 3e6) over the elements for the methods that step, and at the "
       "first tolerance a hundredth and a tenth of it too"}};
}

}  // namespace

BenchReport bench_accuracy(const BenchOptions& options) {
  const std::vector<AccuracyScene> scenes = {heavy_cantilever(), tip_load(), roll_up(), bend_45()};
  BenchReport report;
  report.description = describe(scenes);
  for (const AccuracyScene& scene : scenes) {
    std::vector<Contender> contenders = contenders_of(scene, options.quick);
    measure(contenders, enough_ms(options.quick));
    std::stable_sort(contenders.begin(), contenders.end(), [](const auto& a, const auto& b) {
      const auto place = [](const Contender& c) {
        return std::find(kMethods.begin(), kMethods.end(), c.method);
      };
      return place(a) < place(b);
    });
    for (const Contender& contender : contenders) report.rows.push_back(row_of(contender));
  }
  const std::vector<Json> fastest = fastest_rows(report.rows);
  const Json table = table_1(scenes.front(), options.quick);
  report.results = {{"fastest_within", fastest}, {"table_1", table}};
  report.text = table_text(report.rows) + "\nFastest within an error:\n" + table_text(fastest) +
                "\n" + table_1_text(table);
  report.plot = plot_of(scenes, report.rows);
  return report;
}

}  // namespace wireplan::pipeline
