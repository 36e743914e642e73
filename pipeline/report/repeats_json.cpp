#include "pipeline/report/repeats_json.h"

#include <algorithm>
#include <array>
#include <utility>

#include "plan/statistics.h"

namespace wireplan::pipeline {
namespace {

Json spread_json(const plan::RepeatedPlan& plan, double plan::Repeat::*member) {
  std::vector<double> values;
  for (const plan::Repeat& repeat : plan.repeats) values.push_back(repeat.*member);
  const plan::Spread spread = plan::find_spread(values);
  return {{"low", spread.low}, {"median", spread.median}, {"high", spread.high}};
}

Json plan_json(const plan::RepeatedPlan& plan, bool of_script) {
  Json scores = Json::array(), failures = Json::array();
  double sum = 0.0;
  for (std::size_t k = 0; k < plan.repeats.size(); ++k) {
    const plan::Repeat& repeat = plan.repeats[k];
    sum += repeat.score;
    scores.push_back(repeat.score);
    if (!repeat.safe) failures.push_back({{"repeat", k}, {"reason", repeat.reason}});
  }
  const int count = static_cast<int>(plan.repeats.size());
  const int successes = count - static_cast<int>(failures.size());
  Json json;
  json["trial"] = plan.trial;
  json["repeats"] = count;
  json["reached"] = std::count_if(plan.repeats.begin(), plan.repeats.end(),
                                  [](const plan::Repeat& repeat) { return repeat.reached; });
  json["successes"] = successes;
  json["success_rate"] = static_cast<double>(successes) / count;
  json["success_rate_interval"] = plan::wilson_interval(successes, count);
  json["mean_score"] = sum / count;
  json["peak_contact_force_n"] = spread_json(plan, &plan::Repeat::peak_contact_force);
  json["mean_contact_force_n"] = spread_json(plan, &plan::Repeat::mean_contact_force);
  json["peak_tip_force_n"] = spread_json(plan, &plan::Repeat::peak_tip_force);
  if (of_script) json["support_n"] = spread_json(plan, &plan::Repeat::support);
  json["scores"] = std::move(scores);
  json["failures"] = std::move(failures);
  return json;
}

Json disturbances_json(const std::vector<plan::Disturbance>& disturbances) {
  Json list = Json::array();
  for (const plan::Disturbance& d : disturbances) {
    list.push_back({{"friction_part", d.friction},
                    {"stiffness_parts", d.stiffness},
                    {"wall_factor", d.wall_factor},
                    {"tilt_deg", {d.tilt[0] / kRadPerDeg, d.tilt[1] / kRadPerDeg}},
                    {"shift_mm", {d.shift[0], d.shift[1]}},
                    {"lumen_inward_mm", d.inward}});
    if (d.support_factor != 1.0) list.back()["support_factor"] = d.support_factor;
  }
  return list;
}

/// The bounds of the factor, of a standard deviation those of the middle 90 %.
std::array<double, 2> bounds_of(const plan::FactorSpread& spread) {
  const double cut = spread.deviation > 0.0 ? 0.05 : 0.0;
  return {spread.at(cut), spread.at(1.0 - cut)};
}

// Of friction and of EI: those of each wire, and the widest of all, catheters too.
void put_wire_unknowns(const plan::Study& study, Json& unknowns) {
  std::array<double, 2> friction = {1.0, 1.0}, stiffness = {1.0, 1.0};
  const auto widen = [](std::array<double, 2>& all, const std::array<double, 2>& own) {
    all = {std::min(all[0], own[0]), std::max(all[1], own[1])};
  };
  const auto widen_by = [&](const plan::WireSpread& spread) {
    widen(friction, bounds_of(spread.friction));
    for (const auto& ends : spread.stiffness) {
      for (const plan::FactorSpread& end : ends) widen(stiffness, bounds_of(end));
    }
  };
  for (const plan::Catheter& catheter : study.catheters) widen_by(catheter.spread);
  Json wires = Json::array();
  for (std::size_t k = 0; k < study.spreads.size(); ++k) {
    const plan::WireSpread& spread = study.spreads[k];
    const std::array<double, 2> own = bounds_of(spread.friction);
    std::array<double, 2> shaft = {1.0, 1.0};
    if (!spread.stiffness.empty()) shaft = bounds_of(spread.stiffness.back()[1]);
    widen_by(spread);
    wires.push_back({{"wire", study.wires[k].name},
                     {"friction", simulate::friction_of(study.wires[k], study.insertion)},
                     {"friction_factor", own},
                     {"shaft_stiffness_factor", shaft}});
  }
  unknowns["friction_factor"] = friction;
  unknowns["stiffness_factor"] = stiffness;
  unknowns["wires"] = std::move(wires);
}

Json sensitivity_json(const plan::Study& study, const plan::Plan& plan,
                      const std::vector<plan::RepeatedPlan>& judged) {
  const plan::Sensitivity found =
      plan::find_sensitivity(plan.disturbances, judged, study, plan.candidates);
  Json shares = Json::array(), json;
  for (const auto& share : found.shares) {
    shares.push_back({{"unknown", share.unknown}, {"share", share.of_all}});
  }
  json["explained"] = found.explained ? Json(*found.explained) : Json(nullptr);
  json["shares"] = std::move(shares);
  if (!found.reason.empty()) json["null_reasons"] = {{"explained", found.reason}};
  return json;
}

}  // namespace

Json repeats_json(const plan::Study& study, const plan::Plan& plan,
                  const std::vector<plan::RepeatedPlan>& judged) {
  const plan::Unknowns& unknowns = plan.robustness.unknowns;
  Json plans = Json::array();
  for (const plan::RepeatedPlan& repeated : judged) {
    const auto trial = static_cast<std::size_t>(repeated.trial);
    plans.push_back(plan_json(repeated, plan.candidates[trial].catheter >= 0));
  }
  Json json;
  json["repeats"] = plan.robustness.repeats;
  json["seed"] = plan.robustness.seed;
  json["unknowns"] = Json::object();
  put_wire_unknowns(study, json["unknowns"]);
  json["unknowns"].update(Json{{"wall_factor", {unknowns.wall_low, unknowns.wall_high}},
                               {"angle_deg", clean(unknowns.angle / kRadPerDeg)},
                               {"entry_mm", unknowns.entry},
                               {"lumen_mm", unknowns.lumen}});
  if (unknowns.support_low < unknowns.support_high) {
    json["unknowns"]["support_factor"] = {unknowns.support_low, unknowns.support_high};
  }
  json["plans"] = std::move(plans);
  json["sensitivity"] = sensitivity_json(study, plan, judged);
  json["disturbances"] = disturbances_json(plan.disturbances);
  return json;
}

}  // namespace wireplan::pipeline
