#include "plan/robustness.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <utility>
#include <variant>

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
/// `fix_axial`: EA is written out, since the default follows the radius, which is to be changed.
simulate::Wire softened(const simulate::Wire& wire, double factor, bool fix_axial) {
  simulate::Wire soft = wire;
  for (simulate::Section& section : soft.sections) {
    if (fix_axial) section.axial_stiffness = section.ea(wire.radius);
    section.bending_stiffness /= factor;
    section.bending_stiffness_2 /= factor;
    section.proximal_bending_stiffness /= factor;
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
  for (simulate::ToolTrack& track : trial.tools) {
    for (auto* loads :
         {&track.push_force, &track.hub_torque, &track.tip_force, &track.wall_force}) {
      for (double& load : *loads) load *= factor;
    }
  }
  if (trial.support) trial.support->push *= factor;
}

/// An unknown as the regression sees it: one column per direction; none where it never changes.
struct Predictor {
  const char* name;
  std::vector<std::vector<double>> columns;
};

/// A plan's tools: those of two plans with the same are the same unknowns.
std::array<int, 3> tools_in(const Candidate& candidate) {
  return {candidate.wire, candidate.catheter, candidate.first_wire};
}

/// Those that act on the plan of a candidate.
std::vector<Predictor> list_predictors(const std::vector<Disturbance>& disturbances,
                                       const Study& study, const Candidate& candidate) {
  std::vector<Predictor> predictors = {{"friction", {}}, {"stiffness", {}}, {"wall", {}},
                                       {"angle", {}},    {"entry", {}},     {"lumen", {}},
                                       {"support", {}}};
  const auto add = [&](std::size_t k, auto value) {
    std::vector<double> column;
    for (const Disturbance& d : disturbances) column.push_back(value(d));
    const auto [low, high] = std::minmax_element(column.begin(), column.end());
    if (low != column.end() && *low < *high) predictors[k].columns.push_back(find_ranks(column));
  };
  bool rubs = false;
  const auto add_tool = [&](const simulate::Wire& tool, const WireSpread& spread, auto part) {
    rubs = rubs || (simulate::friction_of(tool, study.insertion) > 0.0 && !spread.friction.known());
    if (!spread.stiffness_known()) add(1, part);
  };
  for (const int wire : wires_of(candidate)) {
    const auto k = static_cast<std::size_t>(wire);
    if (study.spreads.empty()) break;
    add_tool(study.wires[k], study.spreads[k],
             [k](const Disturbance& d) { return d.stiffness.empty() ? 0.5 : d.stiffness[k]; });
  }
  if (candidate.catheter >= 0) {
    const Catheter& round = study.catheters[static_cast<std::size_t>(candidate.catheter)];
    add_tool(round.tool.wire, round.spread, [](const Disturbance& d) { return d.tube; });
  }
  if (rubs) add(0, [](const Disturbance& d) { return d.friction; });
  add(2, [](const Disturbance& d) { return d.wall_factor; });
  for (const int axis : {0, 1}) {
    add(3, [axis](const Disturbance& d) { return d.tilt[axis]; });
    add(4, [axis](const Disturbance& d) { return d.shift[axis]; });
  }
  add(5, [](const Disturbance& d) { return d.inward; });
  add(6, [](const Disturbance& d) { return d.support_factor; });
  const auto still = [](const Predictor& p) { return p.columns.empty(); };
  predictors.erase(std::remove_if(predictors.begin(), predictors.end(), still), predictors.end());
  return predictors;
}

Eigen::Index count_columns(const std::vector<Predictor>& predictors) {
  Eigen::Index columns = 0;
  for (const Predictor& predictor : predictors) columns += std::ssize(predictor.columns);
  return columns;
}

/// Seed of a wire's own draws (FNV-1a of its name, from the seed of the run).
std::uint64_t seed_of(std::uint64_t seed, const std::string& name) {
  std::uint64_t hash = 14695981039346656037ULL ^ seed;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return hash;
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

std::vector<Disturbance> draw_disturbances(const RobustnessOptions& options,
                                           const std::vector<simulate::Wire>& wires) {
  expects(options.repeats >= 0);
  const Unknowns& unknowns = options.unknowns;
  expects(unknowns.wall_low > 0.0 && unknowns.wall_low <= unknowns.wall_high);
  expects(unknowns.support_low > 0.0 && unknowns.support_low <= unknowns.support_high);
  expects(unknowns.angle >= 0.0 && unknowns.entry >= 0.0 && unknowns.lumen >= 0.0);

  // One column per unknown, each with an order of its own.
  std::mt19937_64 generator(options.seed);
  std::array<std::vector<double>, 7> u;
  for (std::vector<double>& column : u) column = draw_stratified(options.repeats, generator);

  std::vector<std::vector<double>> of_wires;
  for (const simulate::Wire& wire : wires) {
    std::mt19937_64 own(seed_of(options.seed, wire.name));
    of_wires.push_back(draw_stratified(options.repeats, own));
  }

  // The support's own draws, so that the others are the same with it and without.
  std::vector<double> support;
  if (unknowns.support_low < unknowns.support_high) {
    std::mt19937_64 own(seed_of(options.seed, "support"));
    support = draw_stratified(options.repeats, own);
  }

  // The catheters' own, where the wall's factor acts.
  std::vector<double> tubes = u[1];
  if (unknowns.wall_low < unknowns.wall_high) {
    std::mt19937_64 own(seed_of(options.seed, "catheters"));
    tubes = draw_stratified(options.repeats, own);
  }

  std::vector<Disturbance> disturbances;
  for (std::size_t k = 0; k < static_cast<std::size_t>(options.repeats); ++k) {
    Disturbance& drawn = disturbances.emplace_back();
    drawn.friction = u[0][k];
    for (const std::vector<double>& own : of_wires) drawn.stiffness.push_back(own[k]);
    drawn.wall_factor = between_logarithms(unknowns.wall_low, unknowns.wall_high, u[1][k]);
    drawn.support_factor = support.empty() ? unknowns.support_low
                                           : between_logarithms(unknowns.support_low,
                                                                unknowns.support_high, support[k]);
    drawn.tilt = on_disc(unknowns.angle, u[2][k], u[3][k]);
    drawn.shift = on_disc(unknowns.entry, u[4][k], u[5][k]);
    drawn.inward = unknowns.lumen * (2.0 * u[6][k] - 1.0);
    drawn.tube = tubes[k];
  }
  return disturbances;
}

namespace {

WireSpread friction_alone(const WireSpread& spread) { return {.friction = spread.friction}; }

/// A wire or tube of that spread, whose EI lies at `part` of it.
simulate::Wire disturbed(const simulate::Wire& given, const WireSpread& spread, double part,
                         const Study& study, const Disturbance& disturbance) {
  simulate::Wire other = at_part(given, spread, part);
  if (!spread.friction.known()) {
    other.friction = spread.friction.at(disturbance.friction) *
                     given.friction.value_or(study.insertion.friction);
  }
  return other;
}

}  // namespace

simulate::Wire disturbed_wire(const Study& study, int wire, const Disturbance& disturbance) {
  const auto k = static_cast<std::size_t>(wire);
  expects(wire >= 0 && k < study.wires.size());
  const simulate::Wire& given = study.wires[k];
  if (study.spreads.empty()) return given;
  expects(study.spreads.size() == study.wires.size());
  const double part = disturbance.stiffness.empty() ? 0.5 : disturbance.stiffness.at(k);
  return disturbed(
      given, disturbance.stiffness.empty() ? friction_alone(study.spreads[k]) : study.spreads[k],
      part, study, disturbance);
}

simulate::Wire disturbed_tube(const Study& study, int catheter, const Disturbance& disturbance) {
  const Catheter& given = study.catheters.at(static_cast<std::size_t>(catheter));
  return disturbed(given.tool.wire, given.spread, disturbance.tube, study, disturbance);
}

namespace {

double wall_factor_of(const simulate::VesselModel& vessel, const Disturbance& disturbance) {
  return vessel.compliance ? disturbance.wall_factor : 1.0;
}

/// As it acts in that vessel: against a wall of stiffness 1, in a lumen as it is.
simulate::Wire in_vessel(const simulate::Wire& disturbed, const simulate::VesselModel& vessel,
                         const Disturbance& disturbance) {
  simulate::Wire own = softened(disturbed, wall_factor_of(vessel, disturbance),
                                /*fix_axial=*/disturbance.inward != 0.0);
  own.radius += disturbance.inward;
  return own;
}

simulate::InsertionOptions disturbed_insertion(const Study& study,
                                               const simulate::VesselModel& vessel,
                                               const Disturbance& disturbance) {
  const double factor = wall_factor_of(vessel, disturbance);
  simulate::InsertionOptions insertion = study.insertion;
  insertion.residual_tolerance *= kRepeatTolerance / factor;
  insertion.support_factor *= disturbance.support_factor / factor;
  insertion.record_every = insertion.length;
  insertion.map_forces = false;
  return insertion;
}

/// The introducer, moved and turned across the vessel.
simulate::Introducer disturbed_introducer(const Study& study, const Candidate& candidate,
                                          const Disturbance& disturbance) {
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
  return introducer;
}

/// The candidate's wires, their friction and their contact radius.
std::vector<simulate::Wire> disturbed_wires(const Study& study, const Candidate& candidate,
                                            const simulate::VesselModel& vessel,
                                            const Disturbance& disturbance) {
  std::vector<simulate::Wire> wires;
  for (const int wire : wires_of(candidate)) {
    wires.push_back(in_vessel(disturbed_wire(study, wire, disturbance), vessel, disturbance));
  }
  return wires;
}

}  // namespace

DisturbedTools disturb_tools(const Study& study, const Candidate& candidate,
                             const simulate::VesselModel& vessel, const Disturbance& disturbance) {
  Study own = study;
  own.insertion = disturbed_insertion(study, vessel, disturbance);
  const std::vector<simulate::Wire> wires = disturbed_wires(study, candidate, vessel, disturbance);
  DisturbedTools with{.tools = tools_of(study, candidate),
                      .introducer = disturbed_introducer(study, candidate, disturbance),
                      .options = tool_options(own, candidate)};
  with.tools[0].wire =
      in_vessel(disturbed_tube(study, candidate.catheter, disturbance), vessel, disturbance);
  with.tools[1].wire = wires.front();
  with.options.spares.assign(wires.begin() + 1, wires.end());
  return with;
}

simulate::TrialResult run_disturbed(const Study& study, const Candidate& candidate,
                                    const simulate::VesselModel& vessel,
                                    const Disturbance& disturbance) {
  SharedTools none;
  return run_disturbed(study, candidate, vessel, disturbance, none);
}

simulate::TrialResult run_disturbed(const Study& study, const Candidate& candidate,
                                    const simulate::VesselModel& vessel,
                                    const Disturbance& disturbance, SharedTools& shared) {
  simulate::TrialResult trial = run_guarded([&] {
    if (candidate.catheter >= 0) {
      if (!shared) {
        const DisturbedTools with = disturb_tools(study, candidate, vessel, disturbance);
        shared.emplace(with.tools, with.introducer, study.goal, vessel, with.options);
      }
      return shared->run(candidate.steps, study.insertion.length);
    }
    return simulate::run_trial(disturbed_wires(study, candidate, vessel, disturbance).front(),
                               disturbed_introducer(study, candidate, disturbance), study.goal,
                               vessel, disturbed_insertion(study, vessel, disturbance),
                               candidate.moves);
  });
  multiply_forces(trial, wall_factor_of(vessel, disturbance));
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
  if (metrics.script) repeat.support = metrics.script->support;
  return repeat;
}

std::vector<int> choose_plans_to_repeat(const Ranking& ranking,
                                        const std::vector<Candidate>& candidates,
                                        const std::vector<RepeatedPlan>& repeated, int plans,
                                        int count) {
  std::vector<int> chosen;
  std::set<int> catheters;
  for (std::size_t k = 0; k < ranking.plans.size(); ++k) {
    const int trial = ranking.plans[k].trial;
    const bool among_first = static_cast<int>(k) < plans;
    const int catheter = candidates[static_cast<std::size_t>(trial)].catheter;
    const bool best_of_catheter = catheter >= 0 && catheters.insert(catheter).second;
    const bool best_of_wire =
        std::any_of(ranking.wires.begin(), ranking.wires.end(),
                    [&](const WireSummary& wire) { return wire.best_trial == trial; });
    const RepeatedPlan* own = find_repeated(repeated, trial);
    const bool done = own != nullptr && std::ssize(own->repeats) >= count;
    if ((among_first || best_of_wire || best_of_catheter) && !done) chosen.push_back(trial);
  }
  return chosen;
}

namespace {

/// What each of a plan's unknowns explains of its differences, by its name.
class Regression {
 public:
  explicit Regression(std::vector<Predictor> predictors)
      : predictors_(std::move(predictors)), columns_(count_columns(predictors_)) {
    const auto& first = predictors_.front().columns.front();
    X_.resize(std::ssize(first), columns_);
    Eigen::Index column = 0;
    for (const Predictor& predictor : predictors_) {
      for (const std::vector<double>& ranks : predictor.columns) {
        X_.col(column++) = standardised(ranks);
      }
    }
    solver_.compute(X_);
  }

  /// Adds the squared coefficients, each `weight` times; returns what is left unexplained of 1.
  double add(const Eigen::VectorXd& y, double weight,
             std::map<std::string, double>& squares) const {
    const Eigen::VectorXd beta = solver_.solve(y);
    Eigen::Index column = 0;
    for (const Predictor& predictor : predictors_) {
      const Eigen::Index width = std::ssize(predictor.columns);
      squares[predictor.name] += weight * beta.segment(column, width).squaredNorm();
      column += width;
    }
    return (y - X_ * beta).squaredNorm();
  }

 private:
  std::vector<Predictor> predictors_;
  Eigen::Index columns_;
  Eigen::MatrixXd X_;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver_;
};

}  // namespace

Sensitivity find_sensitivity(const std::vector<Disturbance>& disturbances,
                             const std::vector<RepeatedPlan>& plans, const Study& study,
                             const std::vector<Candidate>& candidates) {
  std::vector<RepeatedPlan> repeated;
  std::map<std::array<int, 3>, std::vector<Predictor>> predictors;  // by tools
  Eigen::Index columns = 0;
  for (const RepeatedPlan& plan : plans) {
    if (plan.repeats.size() != disturbances.size()) continue;
    repeated.push_back(plan);
    const Candidate& candidate = candidates.at(static_cast<std::size_t>(plan.trial));
    std::vector<Predictor>& own = predictors[tools_in(candidate)];
    if (own.empty()) own = list_predictors(disturbances, study, candidate);
    columns = std::max(columns, count_columns(own));
  }
  Sensitivity result;
  const auto count = static_cast<Eigen::Index>(disturbances.size());
  const Eigen::Index freedom = count - columns - 1;
  if (repeated.size() < 2) {
    result.reason = "fewer than two plans are repeated";
  } else if (columns == 0) {
    result.reason = "no unknown changes";
  } else if (freedom < 2) {
    result.reason = "at least " + std::to_string(columns + 3) + " repeats are needed";
  }
  if (!result.reason.empty()) return result;
  std::map<std::array<int, 3>, Regression> regressions;
  for (auto& [tools, own] : predictors) {
    if (count_columns(own) > 0) regressions.emplace(tools, Regression(std::move(own)));
  }

  // Each plan's score over the mean of all in the same repeat, on the unknowns.
  std::vector<double> mean(disturbances.size(), 0.0);
  for (const RepeatedPlan& plan : repeated) {
    for (std::size_t k = 0; k < mean.size(); ++k) {
      mean[k] += plan.repeats[k].score / static_cast<double>(repeated.size());
    }
  }
  std::map<std::string, double> squares;
  double moved = 0.0, unexplained = 0.0, sum = 0.0;
  for (const RepeatedPlan& plan : repeated) {
    std::vector<double> differences(mean.size());
    for (std::size_t k = 0; k < mean.size(); ++k) differences[k] = plan.repeats[k].score - mean[k];
    const Eigen::VectorXd values =
        Eigen::Map<const Eigen::VectorXd>(differences.data(), count).array();
    const double variance = (values.array() - values.mean()).square().sum();
    const Eigen::VectorXd y = standardised(find_ranks(differences));
    if (y.norm() == 0.0 || variance == 0.0) continue;
    const auto own =
        regressions.find(tools_in(candidates.at(static_cast<std::size_t>(plan.trial))));
    moved += variance;
    unexplained += variance * (own == regressions.end() ? y.squaredNorm()
                                                        : own->second.add(y, variance, squares));
  }
  for (const auto& [name, square] : squares) sum += square;
  if (moved == 0.0 || sum == 0.0) {
    result.reason = "the unknowns do not move the plans against each other";
    return result;
  }

  // Adjusted as R squared is: chance alone explains columns / (count - 1).
  const double adjusted =
      1.0 - unexplained / moved * static_cast<double>(count - 1) / static_cast<double>(freedom);
  result.explained = std::max(0.0, adjusted);
  for (const auto& [name, square] : squares) result.shares.push_back({name, square / sum});
  std::stable_sort(result.shares.begin(), result.shares.end(),
                   [](const auto& a, const auto& b) { return a.of_all > b.of_all; });
  return result;
}

}  // namespace wireplan::plan
