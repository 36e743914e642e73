#include "plan/robustness.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <variant>

#include "plan/batch.h"
#include "plan/statistics.h"

namespace wireplan::plan {
namespace {

/// In [0, 1), of the top 53 bits.
double draw(std::mt19937_64& generator) {
  return static_cast<double>(generator() >> 11) * 0x1.0p-53;
}

/// One value in each of `count` equal parts of [0, 1), in random order.
std::vector<double> draw_stratified(int count, std::mt19937_64& generator) {
  std::vector<double> values;
  for (int k = 0; k < count; ++k) values.push_back((k + draw(generator)) / count);
  for (std::size_t k = values.size(); k > 1; --k) {
    std::swap(values[k - 1],
              values[static_cast<std::size_t>(draw(generator) * static_cast<double>(k))]);
  }
  return values;
}

double between_logarithms(double low, double high, double part) {
  return low * std::pow(high / low, part);
}

/// Evenly over a disc.
Eigen::Vector2d on_disc(double radius, double part, double turn) {
  const double r = radius * std::sqrt(part), phi = 2.0 * kPi * turn;
  return {r * std::cos(phi), r * std::sin(phi)};
}

/// A wire that bends against a wall of stiffness 1 as the given one does against one of `factor`.
simulate::Wire softened(const simulate::Wire& wire, double factor) {
  simulate::Wire soft = wire;
  for (simulate::Section& section : soft.sections) {
    // Written out, since the default follows the radius, which a disturbance changes.
    section.axial_stiffness = section.ea(wire.radius);
    section.bending_stiffness /= factor;
    section.bending_stiffness_2 /= factor;
    section.axial_stiffness /= factor;
    section.twist_stiffness /= factor;
  }
  return soft;
}

void multiply_forces(simulate::TrialResult& trial, double factor) {
  for (simulate::Push& push : trial.pushes) {
    for (const simulate::PushField& field : simulate::kPushFields) {
      if (field.is_load) push.*std::get<double simulate::Push::*>(field.member) *= factor;
    }
  }
  for (simulate::WireContact& contact : trial.contacts) {
    contact.normal_force *= factor;
    contact.friction_force *= factor;
  }
  for (simulate::Shape& shape : trial.shapes) shape.contact_force *= factor;
}

/// An unknown as the regression sees it: one column per direction; none where it never changes.
struct Predictor {
  const char* name;
  std::vector<std::vector<double>> columns;
};

std::vector<Predictor> list_predictors(const std::vector<Disturbance>& disturbances) {
  std::vector<Predictor> predictors = {
      {"friction", {}}, {"wall", {}}, {"angle", {}}, {"entry", {}}, {"lumen", {}}};
  const auto add = [&](std::size_t k, auto value) {
    std::vector<double> column;
    for (const Disturbance& d : disturbances) column.push_back(value(d));
    const auto [low, high] = std::minmax_element(column.begin(), column.end());
    if (low != column.end() && *low < *high) predictors[k].columns.push_back(find_ranks(column));
  };
  add(0, [](const Disturbance& d) { return d.friction_factor; });
  add(1, [](const Disturbance& d) { return d.wall_factor; });
  for (const int axis : {0, 1}) {
    add(2, [axis](const Disturbance& d) { return d.tilt[axis]; });
    add(3, [axis](const Disturbance& d) { return d.shift[axis]; });
  }
  add(4, [](const Disturbance& d) { return d.inward; });
  const auto still = [](const Predictor& p) { return p.columns.empty(); };
  predictors.erase(std::remove_if(predictors.begin(), predictors.end(), still), predictors.end());
  return predictors;
}

/// Ranks with mean 0 and length 1; 0 if they are all the same.
Eigen::VectorXd standardised(const std::vector<double>& ranks) {
  Eigen::VectorXd v =
      Eigen::Map<const Eigen::VectorXd>(ranks.data(), static_cast<Eigen::Index>(ranks.size()));
  v.array() -= v.mean();
  const double length = v.norm();
  if (length > 0.0) v /= length;
  return v;
}

}  // namespace

std::vector<Disturbance> draw_disturbances(const RobustnessOptions& options) {
  expects(options.repeats >= 0);
  const Unknowns& unknowns = options.unknowns;
  expects(unknowns.friction_low > 0.0 && unknowns.friction_low <= unknowns.friction_high);
  expects(unknowns.wall_low > 0.0 && unknowns.wall_low <= unknowns.wall_high);
  expects(unknowns.angle >= 0.0 && unknowns.entry >= 0.0 && unknowns.lumen >= 0.0);

  // One column per unknown, each with an order of its own.
  std::mt19937_64 generator(options.seed);
  std::array<std::vector<double>, 7> u;
  for (std::vector<double>& column : u) column = draw_stratified(options.repeats, generator);

  std::vector<Disturbance> disturbances;
  for (std::size_t k = 0; k < u[0].size(); ++k) {
    disturbances.push_back(
        {.friction_factor =
             between_logarithms(unknowns.friction_low, unknowns.friction_high, u[0][k]),
         .wall_factor = between_logarithms(unknowns.wall_low, unknowns.wall_high, u[1][k]),
         .tilt = on_disc(unknowns.angle, u[2][k], u[3][k]),
         .shift = on_disc(unknowns.entry, u[4][k], u[5][k]),
         .inward = unknowns.lumen * (2.0 * u[6][k] - 1.0)});
  }
  return disturbances;
}

simulate::TrialResult run_disturbed(const Study& study, const Candidate& candidate,
                                    const simulate::VesselModel& vessel,
                                    const Disturbance& disturbance) {
  // The wire, its friction and its contact radius.
  const double factor = vessel.compliance ? disturbance.wall_factor : 1.0;
  expects(candidate.wire >= 0 && candidate.wire < std::ssize(study.wires));
  simulate::Wire wire = softened(study.wires[candidate.wire], factor);
  wire.radius += disturbance.inward;
  simulate::InsertionOptions insertion = study.insertion;
  insertion.friction *= disturbance.friction_factor;
  insertion.residual_tolerance *= kRepeatTolerance / factor;
  insertion.record_every = insertion.length;
  insertion.map_forces = false;

  // The introducer, moved and turned across the vessel.
  const Vec3 t = study.tangent.normalized();
  const Vec3 u = simulate::reference_normal(t), v = t.cross(u);
  simulate::Introducer introducer = make_introducer(study, candidate);
  introducer.point += disturbance.shift[0] * u + disturbance.shift[1] * v;
  // Turning about t x w moves t toward w.
  const Vec3 axis = t.cross(disturbance.tilt[0] * u + disturbance.tilt[1] * v);
  if (axis.norm() > 0.0) {
    introducer.direction =
        (Eigen::AngleAxisd(axis.norm(), axis.normalized()) * introducer.direction).normalized();
  }

  simulate::TrialResult trial = run_guarded([&] {
    return simulate::run_trial(wire, introducer, study.goal, vessel, insertion, candidate.moves);
  });
  multiply_forces(trial, factor);
  return trial;
}

double largest_lumen_offset(const Study& study) {
  const auto thinner = [](const simulate::Wire& a, const simulate::Wire& b) {
    return a.radius < b.radius;
  };
  expects(!study.wires.empty());
  return 0.8 * std::min_element(study.wires.begin(), study.wires.end(), thinner)->radius;
}

double largest_entry_shift(const Study& study, const simulate::VesselModel& vessel) {
  return 0.5 * std::max(0.0, vessel.lumen.distance(study.access));
}

Repeat judge_repeat(const Measured& trial, const Study& study, const Limits& limits,
                    const Weights& weights) {
  const Metrics& metrics = trial.metrics;
  Repeat repeat;
  repeat.reason = exclusion_reason(trial, study, limits);
  repeat.reached = metrics.reached;
  repeat.safe = repeat.reason.empty();
  if (repeat.safe) repeat.score = compute_score(metrics, study.goal, limits, weights).total;
  repeat.peak_contact_force = metrics.peak_contact_force;
  repeat.mean_contact_force = metrics.mean_contact_force;
  repeat.peak_tip_force = metrics.peak_tip_force;
  return repeat;
}

std::vector<int> choose_plans_to_repeat(const Ranking& ranking,
                                        const std::vector<RepeatedPlan>& repeated, int plans,
                                        int count) {
  std::vector<int> chosen;
  for (std::size_t k = 0; k < ranking.plans.size(); ++k) {
    const int trial = ranking.plans[k].trial;
    const bool among_first = static_cast<int>(k) < plans;
    const bool best_of_wire =
        std::any_of(ranking.wires.begin(), ranking.wires.end(),
                    [&](const WireSummary& wire) { return wire.best_trial == trial; });
    const RepeatedPlan* own = find_repeated(repeated, trial);
    const bool done = own != nullptr && std::ssize(own->repeats) >= count;
    if ((among_first || best_of_wire) && !done) chosen.push_back(trial);
  }
  return chosen;
}

Sensitivity find_sensitivity(const std::vector<Disturbance>& disturbances,
                             const std::vector<RepeatedPlan>& plans) {
  std::vector<RepeatedPlan> repeated;
  for (const RepeatedPlan& plan : plans) {
    if (plan.repeats.size() == disturbances.size()) repeated.push_back(plan);
  }
  Sensitivity result;
  const std::vector<Predictor> predictors = list_predictors(disturbances);
  const auto count = static_cast<Eigen::Index>(disturbances.size());
  Eigen::Index columns = 0;
  for (const Predictor& predictor : predictors) columns += std::ssize(predictor.columns);
  const Eigen::Index freedom = count - columns - 1;
  if (repeated.size() < 2) {
    result.reason = "fewer than two plans are repeated";
  } else if (columns == 0) {
    result.reason = "no unknown changes";
  } else if (freedom < 2) {
    result.reason = "at least " + std::to_string(columns + 3) + " repeats are needed";
  }
  if (!result.reason.empty()) return result;

  // The unknowns.
  Eigen::MatrixXd X(count, columns);
  Eigen::Index column = 0;
  for (const Predictor& predictor : predictors) {
    for (const std::vector<double>& ranks : predictor.columns) {
      X.col(column++) = standardised(ranks);
    }
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(X);

  // Each plan's score over the mean of all in the same repeat, on the unknowns.
  std::vector<double> mean(disturbances.size(), 0.0);
  for (const RepeatedPlan& plan : repeated) {
    for (std::size_t k = 0; k < mean.size(); ++k) {
      mean[k] += plan.repeats[k].score / static_cast<double>(repeated.size());
    }
  }
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(columns);
  double moved = 0.0, unexplained = 0.0;
  for (const RepeatedPlan& plan : repeated) {
    std::vector<double> differences(mean.size());
    for (std::size_t k = 0; k < mean.size(); ++k) differences[k] = plan.repeats[k].score - mean[k];
    const Eigen::VectorXd values =
        Eigen::Map<const Eigen::VectorXd>(differences.data(), count).array();
    const double variance = (values.array() - values.mean()).square().sum();
    const Eigen::VectorXd y = standardised(find_ranks(differences));
    if (y.norm() == 0.0 || variance == 0.0) continue;
    const Eigen::VectorXd beta = solver.solve(y);
    squares += variance * beta.cwiseAbs2();
    moved += variance;
    unexplained += variance * (y - X * beta).squaredNorm();
  }
  if (moved == 0.0 || squares.sum() == 0.0) {
    result.reason = "the unknowns do not move the plans against each other";
    return result;
  }

  // Adjusted as R squared is: chance alone explains columns / (count - 1).
  const double adjusted =
      1.0 - unexplained / moved * static_cast<double>(count - 1) / static_cast<double>(freedom);
  result.explained = std::max(0.0, adjusted);
  column = 0;
  for (const Predictor& predictor : predictors) {
    const Eigen::Index width = std::ssize(predictor.columns);
    result.shares.push_back({predictor.name, squares.segment(column, width).sum() / squares.sum()});
    column += width;
  }
  std::stable_sort(result.shares.begin(), result.shares.end(),
                   [](const auto& a, const auto& b) { return a.of_all > b.of_all; });
  return result;
}

}  // namespace wireplan::plan
