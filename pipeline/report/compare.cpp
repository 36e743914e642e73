#include "pipeline/report/compare.h"

#include <algorithm>
#include <optional>
#include <tuple>

#include "pipeline/files/json_reader.h"
#include "pipeline/files/text.h"
#include "pipeline/report/overview.h"
#include "pipeline/report/report.h"
#include "pipeline/report/verdict_json.h"

namespace wireplan::pipeline {
namespace {

constexpr std::size_t kPlansListed = 10;

std::string number(const Json& value, const char* pattern) {
  return value.is_null() ? "-" : format(pattern, value.get<double>());
}

/// Null where the case does not have it.
Json parameter(const Json& report, const char* pointer) {
  const Json& parameters = report.at("provenance").at("parameters");
  const Json::json_pointer place(pointer);
  return parameters.contains(place) ? parameters.at(place) : Json(nullptr);
}

/// Whether a value of the case is the same in all reports.
bool agree(const std::vector<Json>& reports, const char* pointer) {
  return std::all_of(reports.begin(), reports.end(), [&](const Json& report) {
    return parameter(report, pointer) == parameter(reports.front(), pointer);
  });
}

bool same_patient(const std::vector<Json>& reports) {
  const bool one_input = std::all_of(reports.begin(), reports.end(), [&](const Json& report) {
    return report.at("provenance").at("inputs") == reports.front().at("provenance").at("inputs");
  });
  return one_input && agree(reports, "/access/point_mm") && agree(reports, "/target/point_mm");
}

/// Of the case, and of the section where it has several.
std::string name_of(const Json& report) {
  const Json section = parameter(report, "/section");
  std::string name = report.at("name").get<std::string>();
  if (section.is_null()) return name;
  for (const char* key : {"access", "target"}) {
    const std::string part = section.at(key).get<std::string>();
    if (!part.empty()) name += ", " + part;
  }
  return name;
}

/// Whether its end hangs on how it is computed, or may not be in the target: such plans stand
/// behind all others of a report. Reports from before did not tell it.
bool is_unsure(const Json& plan) {
  return plan.value("sensitive", Json()) == true || plan.value("tip_unsure", Json()) == true;
}

std::string describe_way(const Json& plan) {
  return describe_tools(plan) +
         format(", %g/%g/%g deg", plan.at("inclination_deg").get<double>(),
                plan.at("azimuth_deg").get<double>(), plan.at("roll_deg").get<double>()) +
         (plan.value("script", "").empty() ? "" : ", with moves") +
         (is_unsure(plan) ? ", end unsure" : "");
}

std::vector<std::string> plan_cells(const Json& report, const Json& plan) {
  const Json& trial = report.at("trials").at(plan.at("trial").get<std::size_t>());
  return {describe_way(plan),
          number(plan.at("score"), "%.3f"),
          number(plan.at("score_error"), "%.3f"),
          number(plan.at("mean_score"), "%.3f"),
          number(plan.at("success_rate"), "%.2f"),
          number(trial.at("peak_contact_force_n"), "%.3f")};
}

const std::vector<std::string> kPlanHeads = {
    "inclination/azimuth/roll", "score", "+-", "mean score", "success", "force N"};

std::string list_reports(const std::vector<Json>& reports) {
  std::vector<std::vector<std::string>> rows = {{"", "case", "verdict", "plans/trials"}};
  rows.front().insert(rows.front().end(), kPlanHeads.begin(), kPlanHeads.end());
  rows.front()[4] = "best plan, " + rows.front()[4];
  for (std::size_t k = 0; k < reports.size(); ++k) {
    const Json& ranking = reports[k].at("ranking");
    std::vector<std::string> row = {
        format("%zu", k + 1), name_of(reports[k]), answer_of(reports[k]),
        format("%zu/%zu", ranking.size(), reports[k].at("trials").size())};
    if (ranking.empty()) {
      const Json& trials = reports[k].at("trials");
      const bool reached = std::any_of(trials.begin(), trials.end(), [](const Json& trial) {
        return trial.value("reached", false);
      });
      row.insert(row.end(),
                 {reached ? "none within limits" : "none reaches", "-", "-", "-", "-", "-"});
    } else {
      const std::vector<std::string> cells = plan_cells(reports[k], ranking.front());
      row.insert(row.end(), cells.begin(), cells.end());
    }
    rows.push_back(std::move(row));
  }
  return format_table(rows);
}

/// Wires in the order in which reports name them first.
std::vector<std::string> list_wires(const std::vector<Json>& reports) {
  std::vector<std::string> names;
  for (const Json& report : reports) {
    for (const Json& wire : report.at("wires")) {
      const std::string name = wire.at("wire");
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

/// "6/36  4  0.271  0.12": reached of those run in full, safe plans, score of the best, median
/// force.
std::string wire_cell(const Json& report, const std::string& name) {
  for (const Json& wire : report.at("wires")) {
    if (wire.at("wire") != name) continue;
    std::string score = "-";
    for (const Json& plan : report.at("ranking")) {
      if (plan.at("trial") == wire.at("best_trial")) score = number(plan.at("score"), "%.3f");
    }
    return format("%d/%d  ", wire.at("reached").get<int>(), wire.at("trials").get<int>()) +
           (wire.contains("safe") ? wire.at("safe").dump() : "-") + "  " + score + "  " +
           number(wire.at("median_peak_contact_force_n"), "%.3f");
  }
  return "not tried";
}

std::string list_wire_table(const std::vector<Json>& reports) {
  std::vector<std::vector<std::string>> rows = {{"wire"}};
  for (std::size_t k = 0; k < reports.size(); ++k) rows.front().push_back(format("%zu", k + 1));
  for (const std::string& name : list_wires(reports)) {
    std::vector<std::string> row = {name};
    for (const Json& report : reports) row.push_back(wire_cell(report, name));
    rows.push_back(std::move(row));
  }
  return format_table(rows);
}

/// As it orders plans within a report; reports from before it did have that of the repeats alone.
double expected_success_rate(const Json& plan) {
  const Json& own = plan.at("success_rate");
  return plan.value("expected_success_rate", own.is_number() ? own.get<double>() : 1.0);
}

std::string list_best_plans(const std::vector<Json>& reports) {
  struct Place {
    bool unsure;  // these three order plans within a report
    double failed, score;
    std::size_t report, rank;
  };
  std::vector<Place> places;
  for (std::size_t k = 0; k < reports.size(); ++k) {
    const Json& ranking = reports[k].at("ranking");
    for (std::size_t r = 0; r < ranking.size(); ++r)
      places.push_back({is_unsure(ranking[r]), 1.0 - expected_success_rate(ranking[r]),
                        ranking[r].at("expected_score"), k, r});
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return std::tie(a.unsure, a.failed, a.score, a.report, a.rank) <
           std::tie(b.unsure, b.failed, b.score, b.report, b.rank);
  });
  if (places.size() > kPlansListed) places.resize(kPlansListed);

  std::vector<std::vector<std::string>> rows = {{"", "report"}};
  rows.front().insert(rows.front().end(), kPlanHeads.begin(), kPlanHeads.end());
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Json& report = reports[places[k].report];
    std::vector<std::string> row = {format("%zu", k + 1), format("%zu", places[k].report + 1)};
    const std::vector<std::string> cells = plan_cells(report, report.at("ranking")[places[k].rank]);
    row.insert(row.end(), cells.begin(), cells.end());
    rows.push_back(std::move(row));
  }
  return format_table(rows);
}

}  // namespace

std::string compare_reports(const std::vector<std::filesystem::path>& files) {
  std::vector<Json> reports;
  for (const std::filesystem::path& given : files) {
    for (const std::filesystem::path& file : reports_in(given)) {
      reports.push_back(read_json(file, kReportSchema, kOlderReportSchema));
    }
  }
  if (reports.size() < 2) {
    throw Error("compare: " + files.front().string() +
                " alone, expected two reports or more, or the overview of a case of several");
  }

  const bool one_patient = same_patient(reports);
  std::string text =
      list_reports(reports) +
      "\nWires: reached/run in full (coarse trials do not count), safe plans, score of the "
      "best plan, median peak force in N\n" +
      list_wire_table(reports);
  if (one_patient) {
    text += "\nAll reports are of one patient, access and target. Their best plans:\n" +
            list_best_plans(reports);
  } else {
    text += "\nThe reports are of different vessels, accesses or targets.\n";
  }
  for (const char* pointer :
       {"/limits", "/ranking/weights", "/ranking/script_weights", "/target/radius_mm"}) {
    if (agree(reports, pointer)) continue;
    text += std::string("Scores are not comparable: ") + (pointer + 1) + " differs.\n";
  }
  const auto has_catheters = [](const Json& report) { return report.contains("catheters"); };
  const auto with = std::count_if(reports.begin(), reports.end(), has_catheters);
  if (with > 0 && with < std::ssize(reports)) {
    text += "Scores are not comparable: of cases with catheters they have more components.\n";
  }
  for (const char* pointer : {"/robustness", "/friction", "/friction_factor", "/wall"}) {
    if (agree(reports, pointer)) continue;
    text += std::string("Mind that ") + (pointer + 1) + " differs.\n";
  }
  return text;
}

}  // namespace wireplan::pipeline
