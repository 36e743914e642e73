#include "pipeline/bench/truth_results.h"

#include <algorithm>
#include <cmath>

#include "pipeline/files/text.h"
#include "pipeline/report/picture.h"
#include "pipeline/report/plot.h"
#include "plan/statistics.h"

namespace wireplan::pipeline {
namespace {

using plan::NumericalError;
using plan::Setting;

/// A number whose error is stated.
struct Quantity {
  const char* name;
  const char* unit;
  double NumericalError::*part;
  double nothing;  // differences below are rounding: ten times the residual, and what it moves
};

constexpr double kNoDistance = 1e-4, kNoForce = 1e-5;  // [mm], [N]
constexpr std::array kQuantities = {
    Quantity{"position", "mm", &NumericalError::position, kNoDistance},
    Quantity{"tip", "mm", &NumericalError::tip, kNoDistance},
    Quantity{"peak_contact_force", "n", &NumericalError::peak_force, kNoForce},
    Quantity{"mean_contact_force", "n", &NumericalError::mean_force, kNoForce},
    Quantity{"peak_tip_force", "n", &NumericalError::tip_force, kNoForce},
    Quantity{"peak_push_force", "n", &NumericalError::push_force, kNoForce}};

constexpr std::array kSettings = {Setting::kStep, Setting::kTolerance, Setting::kRoll,
                                  Setting::kFriction};

bool is_compared(const TruthTrial& trial) { return trial.stated.error && trial.truth; }

double stated_of(const TruthTrial& trial, const Quantity& quantity) {
  return (*trial.stated.error).*quantity.part;
}
double true_of(const TruthTrial& trial, const Quantity& quantity) {
  return (*trial.truth).*quantity.part;
}
bool is_covered(const TruthTrial& trial, const Quantity& quantity) {
  return true_of(trial, quantity) <= stated_of(trial, quantity) + quantity.nothing;
}

std::optional<double> apart_by(const TruthTrial& trial, Setting setting) {
  for (const auto& [changed, distance] : trial.apart) {
    if (changed == setting) return distance;
  }
  return {};
}

/// {"compared", "median_mm", ...} of distances or parts; null where there is none.
Json spread_json(const std::vector<double>& values, const std::string& suffix) {
  Json json = {{"compared", values.size()}};
  const plan::Spread spread = values.empty() ? plan::Spread{} : plan::find_spread(values);
  const auto put = [&](const std::string& name, double value) {
    json[name + suffix] = values.empty() ? Json(nullptr) : Json(value);
  };
  put("median", spread.median);
  put("percent_95", spread.high);
  put("worst", values.empty() ? 0.0 : *std::max_element(values.begin(), values.end()));
  return json;
}

Json coverage_of(const std::vector<TruthTrial>& trials, const Quantity& quantity) {
  int compared = 0, covered = 0;
  std::vector<double> ratios;
  Json missed = Json::array();
  for (const TruthTrial& trial : trials) {
    if (!is_compared(trial)) continue;
    const double stated = stated_of(trial, quantity), truth = true_of(trial, quantity);
    ++compared;
    ratios.push_back(std::max(stated, quantity.nothing) / std::max(truth, quantity.nothing));
    if (is_covered(trial, quantity)) {
      ++covered;
    } else {
      missed.push_back(
          {{"case", trial.case_name}, {"trial", trial.id}, {"stated", stated}, {"true", truth}});
    }
  }
  const auto or_null = [&](double value) { return compared > 0 ? Json(value) : Json(nullptr); };
  Json json;
  json["quantity"] = quantity.name;
  json["unit"] = quantity.unit;
  json["compared"] = compared;
  json["covered"] = covered;
  json["share"] = or_null(static_cast<double>(covered) / std::max(1, compared));
  json["median_stated_over_true"] = or_null(compared > 0 ? plan::find_spread(ratios).median : 0.0);
  json["not_covered"] = std::move(missed);
  return json;
}

Json path_dependence_of(const std::vector<TruthTrial>& trials) {
  std::vector<double> largest;
  int sensitive = 0, not_flagged = 0;
  for (const TruthTrial& trial : trials) {
    double most = 0.0;
    for (const auto& [setting, distance] : trial.apart) most = std::max(most, distance);
    if (!trial.apart.empty()) largest.push_back(most);
    const bool flagged = !plan::find_sensitivity(trial.stated).value_or("").empty();
    sensitive += flagged;
    not_flagged += !flagged && most > plan::kTipsApart;
  }
  Json json = spread_json(largest, "_mm");
  json["sensitive"] = sensitive;
  json["apart_but_not_flagged"] = not_flagged;
  json["by_setting"] = Json::array();
  for (const Setting setting : kSettings) {
    std::vector<double> distances;
    for (const TruthTrial& trial : trials) {
      if (const std::optional<double> apart = apart_by(trial, setting)) distances.push_back(*apart);
    }
    Json row = {{"setting", plan::setting_name(setting)}};
    row.update(spread_json(distances, "_mm"));
    json["by_setting"].push_back(std::move(row));
  }
  return json;
}

/// Of the push force at h against that at h/8.
Json push_force_of(const std::vector<TruthTrial>& trials) {
  std::vector<double> parts;
  for (const TruthTrial& trial : trials) {
    if (!trial.fine_push_force || *trial.fine_push_force <= 0.0) continue;
    const double force = trial.trial.metrics.peak_push_force;
    parts.push_back(std::abs(force - *trial.fine_push_force) / *trial.fine_push_force);
  }
  return spread_json(parts, "_part");
}

}  // namespace

std::vector<Json> truth_rows(const std::vector<TruthTrial>& trials) {
  std::vector<Json> rows;
  for (const TruthTrial& trial : trials) {
    const std::optional<std::string> sensitive = plan::find_sensitivity(trial.stated);
    Json row;
    row["case"] = trial.case_name;
    row["trial"] = trial.id;
    row["wire"] = trial.wire;
    row["inclination_deg"] = clean(trial.candidate.inclination / kRadPerDeg);
    row["azimuth_deg"] = clean(trial.candidate.azimuth / kRadPerDeg);
    row["roll_deg"] = clean(trial.candidate.roll / kRadPerDeg);
    row["rank"] = trial.rank ? Json(*trial.rank) : Json(nullptr);
    row["outcome"] = simulate::outcome_name(trial.trial.outcome);
    row["insertion_mm"] = trial.trial.metrics.insertion;
    for (const Quantity& quantity : kQuantities) {
      const std::string name = quantity.name, unit = std::string("_") + quantity.unit;
      row[name + "_stated" + unit] =
          trial.stated.error ? Json(stated_of(trial, quantity)) : Json(nullptr);
      row[name + "_true" + unit] = trial.truth ? Json(true_of(trial, quantity)) : Json(nullptr);
    }
    row["sensitive"] = sensitive ? Json(!sensitive->empty()) : Json(nullptr);
    for (const Setting setting : kSettings) {
      row[std::string(plan::setting_name(setting)) + "_apart_mm"] =
          number_or_null(apart_by(trial, setting));
    }
    row["peak_push_force_n"] = number_or_null(trial.trial.metrics.peak_push_force);
    row["peak_push_force_h8_n"] = number_or_null(trial.fine_push_force);
    row["note"] = trial.note;
    rows.push_back(std::move(row));
  }
  return rows;
}

Json truth_results(const std::vector<TruthTrial>& trials, const std::vector<SkippedCase>& skipped) {
  Json results;
  Json coverage = Json::array(), left_out = Json::array(), absent = Json::array();
  for (const Quantity& quantity : kQuantities) coverage.push_back(coverage_of(trials, quantity));
  std::vector<std::string> cases;
  for (const TruthTrial& trial : trials) {
    if (std::find(cases.begin(), cases.end(), trial.case_name) == cases.end()) {
      cases.push_back(trial.case_name);
    }
    if (is_compared(trial)) continue;
    left_out.push_back({{"case", trial.case_name}, {"trial", trial.id}, {"reason", trial.note}});
  }
  for (const SkippedCase& each : skipped) {
    absent.push_back({{"case", each.name}, {"reason", each.reason}});
  }
  results["trials"] = trials.size();
  results["cases"] = cases;
  results["coverage"] = std::move(coverage);
  results["path_dependence"] = path_dependence_of(trials);
  results["push_force_against_h8"] = push_force_of(trials);
  results["left_out"] = std::move(left_out);
  results["skipped"] = std::move(absent);
  return results;
}

std::string truth_text(const std::vector<Json>& rows, const Json& results) {
  std::vector<Json> shown;
  for (const Json& row : rows) {
    Json line;
    for (const auto& [key, value] : row.items()) {
      const bool is_long = key == "note" || key == "inclination_deg" || key == "azimuth_deg" ||
                           key == "roll_deg" || key.starts_with("peak_push_force_n") ||
                           key.starts_with("peak_push_force_h8") || key.starts_with("position_");
      if (!is_long) line[key] = value;
    }
    shown.push_back(std::move(line));
  }
  std::vector<Json> coverage;
  std::string missed, left_out;
  for (const Json& own : results.at("coverage")) {
    Json line = own;
    line.erase("not_covered");
    coverage.push_back(std::move(line));
    for (const Json& row : own.at("not_covered")) {
      missed += format("  %s of %s, trial %d: stated %.3g, true %.3g %s\n",
                       own.at("quantity").get<std::string>().c_str(),
                       row.at("case").get<std::string>().c_str(), row.at("trial").get<int>(),
                       row.at("stated").get<double>(), row.at("true").get<double>(),
                       own.at("unit").get<std::string>().c_str());
    }
  }
  for (const Json& row : results.at("left_out")) {
    left_out += format("  %s, trial %d: ", row.at("case").get<std::string>().c_str(),
                       row.at("trial").get<int>()) +
                row.at("reason").get<std::string>() + "\n";
  }
  std::vector<Json> paths;
  Json all = results.at("path_dependence");
  for (const Json& row : all.at("by_setting")) paths.push_back(row);
  all.erase("by_setting");
  const Json sensitive = all.at("sensitive"), missed_flags = all.at("apart_but_not_flagged");
  all.erase("sensitive");
  all.erase("apart_but_not_flagged");
  Json line = {{"setting", "the largest"}};
  line.update(all);
  paths.push_back(std::move(line));
  std::string text = table_text(shown) + "\n" + table_text(coverage) + "\nNot covered:\n" +
                     (missed.empty() ? "  none\n" : missed) + "\nHow far apart tips end:\n" +
                     table_text(paths) + "sensitive: " + sensitive.dump() + " of " +
                     results.at("trials").dump() +
                     ", not flagged though further apart: " + missed_flags.dump() +
                     "\n\nPush force at h against h/8, as a part:\n" +
                     table_text({results.at("push_force_against_h8")});
  if (!left_out.empty()) text += "\nLeft out, nothing to compare:\n" + left_out;
  for (const Json& row : results.at("skipped")) {
    text += "skipped " + row.at("case").get<std::string>() + ": " +
            row.at("reason").get<std::string>() + "\n";
  }
  return text;
}

Picture plot_truth(const std::vector<TruthTrial>& trials) {
  std::vector<FrontPlot> plots;
  for (const Quantity& quantity : kQuantities) {
    FrontLine covered{.entry = 0, .points = {}}, missed{.entry = 1, .points = {}};
    for (const TruthTrial& trial : trials) {
      if (!is_compared(trial)) continue;
      (is_covered(trial, quantity) ? covered : missed)
          .points.emplace_back(std::max(quantity.nothing, true_of(trial, quantity)),
                               std::max(quantity.nothing, stated_of(trial, quantity)));
    }
    FrontPlot plot{.title = quantity.name,
                   .x_label = std::string("true, ") + quantity.unit,
                   .y_label = std::string("stated, ") + quantity.unit,
                   .lines = {}};
    for (FrontLine* line : {&covered, &missed}) {
      if (!line->points.empty()) plot.lines.push_back(std::move(*line));
    }
    if (!plot.lines.empty()) plots.push_back(std::move(plot));
  }
  if (plots.empty()) {  // nothing could be compared: an empty sheet of one point
    plots.push_back({.title = "nothing compared",
                     .x_label = "true",
                     .y_label = "stated",
                     .lines = {{.entry = 0, .points = {{1.0, 1.0}}}}});
  }
  return draw_fronts("stated against true errors", plots, 3,
                     {{.name = "covered", .color = wire_color(0)},
                      {.name = "not covered", .color = wire_color(1)}});
}

Json describe_truth() {
  return {{"stated",
           "the error that a report states: from elements of 2h, h and h/2, and from "
           "settings changed that should not matter"},
          {"true", "how far the run with elements of h/4 ends apart, at the same insertion"},
          {"settings",
           {{"step", plan::describe_setting(Setting::kStep)},
            {"tolerance", plan::describe_setting(Setting::kTolerance)},
            {"roll", plan::describe_setting(Setting::kRoll)},
            {"friction", plan::describe_setting(Setting::kFriction)}}},
          {"columns",
           {{"rank", "after the search, before repeats; null where it is not ranked"},
            {"..._apart", "between the tips with the setting as it is and changed"},
            {"peak_push_force_h8_n", "with elements of h/8, of every third trial"}}}};
}

}  // namespace wireplan::pipeline
