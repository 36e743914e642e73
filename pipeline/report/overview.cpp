#include "pipeline/report/overview.h"

#include <algorithm>
#include <array>
#include <optional>
#include <tuple>
#include <utility>

#include "pipeline/files/disk.h"
#include "pipeline/files/text.h"
#include "pipeline/files/viewer_files.h"
#include "pipeline/report/page.h"
#include "pipeline/report/report.h"
#include "pipeline/report/sheet_csv.h"
#include "pipeline/report/verdict_json.h"
#include "plan/number_text.h"

namespace wireplan::pipeline {
namespace {

constexpr const char* kCatheter = "catheter";  // in the keys of plans with one alone

/// Of the first ranked plan; null where none is ranked.
Json best_plan_json(const Json& report) {
  const Json& ranking = report.at("ranking");
  if (ranking.empty()) return nullptr;
  const Json& plan = ranking.front();
  const auto id = plan.at("trial").get<std::size_t>();
  const Json& trial = report.at("trials").at(id);
  Json best;
  for (const char* key : {"trial", "wire", "inclination_deg", "azimuth_deg", "roll_deg", "script",
                          "score", "score_error", "mean_score"}) {
    best[key] = plan.at(key);
  }
  for (const char* key : {kCatheter, "first_wire"}) {
    if (plan.contains(key)) best[key] = plan.at(key);
  }
  for (const char* key : {"sensitive", "tip_unsure"}) best[key] = plan.at(key);
  best["repeats_safe"] = nullptr;
  best["repeats"] = nullptr;
  for (const Json& repeated : report.at("robustness").at("plans")) {
    if (repeated.at("trial") != id) continue;
    best["repeats_safe"] = repeated.at("successes");
    best["repeats"] = repeated.at("repeats");
  }
  for (const char* key : {"insertion_mm", "peak_tip_force_n", "peak_contact_force_n"}) {
    best[key] = trial.at(key);
  }
  best["sentence"] = plan.at("sentence");
  return best;
}

/// What the access table of the section's report says, in numbers.
Json access_figures(const Json& report) {
  const Json& access = report.at("anatomy").at("access");
  Json figures;
  figures["way_mm"] = report.at("anatomy").at("lengths").at("way_mm");
  figures["least_diameter_mm"] = access.at("device").at("lumen_diameter_mm");
  figures["device_fits"] = access.at("device").at("fits");
  figures["least_diameter_at_sheath_mm"] = access.at("sheath").at("lumen_diameter_mm");
  const bool weighed = !access.at("sheath").value("assumed_longer_than_way", false);
  figures["sheath_fits"] = weighed ? access.at("sheath").at("fits") : Json(nullptr);
  figures["tortuosity"] = access.at("tortuosity").at("index");
  figures["tortuosity_grade"] = access.at("tortuosity").at("grade");
  figures["sharpest_bend_deg"] = access.at("sharpest_bend").at("angle_deg");
  figures["sharpest_bend_grade"] = access.at("sharpest_bend").at("grade");
  figures["sharpest_bend_at_ostium_of"] = access.at("sharpest_bend").at("at_ostium_of");
  figures["calcium_mm3"] = access.at("calcium").at("volume_mm3");
  return figures;
}

Json row_json(const SectionReport& section) {
  const Json& report = section.report;
  const auto count = [&](const char* key) {
    return std::count_if(
        report.at("trials").begin(), report.at("trials").end(),
        [&](const Json& trial) { return trial.at(key).is_boolean() && trial.at(key).get<bool>(); });
  };
  Json row = {{"access", section.access.empty() ? Json(nullptr) : Json(section.access)},
              {"folder", section.folder},
              {"trials", report.at("trials").size()},
              {"reached", count("reached")},
              {"safe_plans", report.at("ranking").size()}};
  if (report.contains("verdict")) row["verdict"] = report.at("verdict");
  row["best_plan"] = best_plan_json(report);
  row["access_table"] = access_figures(report);
  return row;
}

/// Of a row's verdict, the best first; of reports from before there were verdicts the last.
int answer_rank(const Json& row) {
  constexpr std::array kAnswers = {"feasible", "feasible_with_risk", "unsure", "not_feasible"};
  const std::string answer = row.value("verdict", Json::object()).value("answer", "");
  return static_cast<int>(std::find(kAnswers.begin(), kAnswers.end(), answer) - kAnswers.begin());
}

/// Smaller is better: no safe plan last, then by the verdict, plans whose end hangs on how they are
/// computed, or may not be in the target, after the others, then by the share that is not safe,
/// then by score.
std::tuple<bool, int, bool, double, double> order_key(const Json& row) {
  const Json& best = row.at("best_plan");
  if (best.is_null()) return {true, answer_rank(row), false, 1.0, 1.0};
  const auto holds = [&](const char* key) { return best.value(key, Json()) == true; };
  const bool unsure = holds("sensitive") || holds("tip_unsure");
  const bool repeated = !best.at("repeats").is_null() && best.at("repeats") != 0;
  const double unsafe =
      repeated ? 1.0 - best.at("repeats_safe").get<double>() / best.at("repeats").get<double>()
               : 0.0;
  return {false, answer_rank(row), unsure, unsafe, best.at("score").get<double>()};
}

/// What the best access comes to, for a row of the same target with a worse answer; null for
/// others.
Json other_access(const Json& row, const Json& first) {
  const Json& best = first.at("best_plan");
  if (row == first || best.is_null() || first.at("access").is_null()) return nullptr;
  if (answer_rank(row) <= answer_rank(first)) return nullptr;
  std::string answer = first.value("verdict", Json::object()).value("answer", "");
  std::replace(answer.begin(), answer.end(), '_', ' ');
  std::string text = "From " + first.at("access").get<std::string>() + " it is " + answer;
  if (!best.at("repeats").is_null()) {
    text += ": safe in " + best.at("repeats_safe").dump() + " of " + best.at("repeats").dump() +
            " disturbed repeats";
  }
  return text + ".";
}

std::string from(const Json& row) {
  return row.at("access").is_null() ? "" : " from " + row.at("access").get<std::string>();
}

std::string describe_plan(const Json& best) {
  const std::string script = best.at("script").get<std::string>();
  std::string text =
      describe_tools(best) + format(", inclination %g deg, azimuth %g deg, roll %g deg",
                                    best.at("inclination_deg").get<double>(),
                                    best.at("azimuth_deg").get<double>(),
                                    best.at("roll_deg").get<double>());
  if (!best.at("repeats").is_null()) {
    text += ", safe in " + best.at("repeats_safe").dump() + " of " + best.at("repeats").dump() +
            " repeats";
  }
  text += ", at most " + plan::two_digits(best.at("peak_contact_force_n").get<double>()) +
          " N on the wall";
  return script.empty() ? text : text + "; script: " + script;
}

/// Whether there is a plan from there, and the answer is not that it is not feasible, as where a
/// device does not pass though the wire does.
bool serves_target(const Json& row) {
  return !row.at("best_plan").is_null() && answer_of(row) != "not feasible";
}

std::string describe_target(const Json& target) {
  const Json& rows = target.at("sections");
  const std::string name = target.at("target").is_null() ? std::string("the target")
                                                         : target.at("target").get<std::string>();
  const Json& first = rows.front();
  if (first.at("best_plan").is_null()) {
    return name + ": no safe plan" + (rows.size() > 1 ? " from any access" : from(first));
  }
  const std::string where =
      from(first) + (rows.size() > 1 ? ", the best of " + std::to_string(rows.size()) : "");
  const bool serves = serves_target(first);
  return name + ":" + (serves ? "" : " not feasible") + where +
         (serves ? where.empty() ? "" : ":" : "; the wire alone would reach it:") + " " +
         describe_plan(first.at("best_plan"));
}

}  // namespace

Json build_overview(const std::string& name, const std::vector<SectionReport>& sections) {
  expects(!sections.empty());
  Json targets = Json::array();
  for (const SectionReport& section : sections) {
    const Json target = section.target.empty() ? Json(nullptr) : Json(section.target);
    auto own = std::find_if(targets.begin(), targets.end(),
                            [&](const Json& other) { return other.at("target") == target; });
    if (own == targets.end()) {
      targets.push_back({{"target", target}, {"sections", Json::array()}});
      own = targets.end() - 1;
    }
    own->at("sections").push_back(row_json(section));
  }
  for (Json& target : targets) {
    Json& rows = target.at("sections");
    std::vector<Json> sorted(rows.begin(), rows.end());
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const Json& a, const Json& b) { return order_key(a) < order_key(b); });
    for (Json& row : sorted) {
      row["other_access"] = other_access(row, sorted.front());
      if (!row["other_access"].is_null() && row.contains("verdict")) {
        row["verdict"]["changes"].insert(row["verdict"]["changes"].begin(), row["other_access"]);
      }
    }
    rows = sorted;
    target["sentence"] = describe_target(target);
  }
  const Json& first = sections.front().report;
  return {{"schema", kOverviewSchema},
          {"name", name},
          {"statement", first.at("statement")},
          {"inputs", first.at("provenance").at("inputs")},
          {"program", first.at("provenance").at("program")},
          {"targets", std::move(targets)}};
}

void tell_sections(const Json& overview, const std::filesystem::path& output) {
  for (const Json& target : overview.at("targets")) {
    for (const Json& row : target.at("sections")) {
      if (row.at("other_access").is_null() || !row.contains("verdict")) continue;
      const std::filesystem::path folder = output / row.at("folder").get<std::string>();
      const Json before = read_report(folder / "report.json");
      Json report = before;
      report["verdict"]["changes"] = row.at("verdict").at("changes");
      if (const std::string page = read_if_there(folder / "report.html"); !page.empty()) {
        write_whole(with_report(page, before, report), folder / "report.html");
      }
      write_whole(sheet_csv(report), folder / "sheet.csv");
      write_json(report, folder / "report.json");
    }
  }
}

std::string overview_csv(const Json& overview) {
  constexpr std::array kRow = {"access", "folder", "trials", "reached", "safe_plans"};
  std::vector<const char*> columns = {"wire",
                                      "inclination_deg",
                                      "azimuth_deg",
                                      "roll_deg",
                                      "script",
                                      "score",
                                      "repeats_safe",
                                      "repeats",
                                      "insertion_mm",
                                      "peak_tip_force_n",
                                      "peak_contact_force_n"};
  for (const char* own : {"first_wire", kCatheter}) {
    const auto has = [&](const Json& row) {
      return !row.at("best_plan").is_null() && row.at("best_plan").contains(own);
    };
    const auto any_has = [&](const Json& target) {
      return std::any_of(target.at("sections").begin(), target.at("sections").end(), has);
    };
    const Json& targets = overview.at("targets");
    if (std::any_of(targets.begin(), targets.end(), any_has)) {
      columns.insert(columns.begin() + 1, own);
    }
  }
  std::string table = "target";
  for (const char* key : kRow) table.append(",").append(key);
  table += ",verdict,other_access";
  for (const char* key : columns) table.append(",").append(key);
  const Json& any = overview.at("targets").front().at("sections").front().at("access_table");
  for (const auto& [key, value] : any.items()) table.append(",").append(key);
  table += "\r\n";
  for (const Json& target : overview.at("targets")) {
    for (const Json& row : target.at("sections")) {
      const Json verdict = row.value("verdict", Json::object()), plan = row.at("best_plan");
      table += csv_field(target.at("target"));
      for (const char* key : kRow) table.append(",").append(csv_field(row.at(key)));
      table.append(",").append(csv_field(verdict.value("answer", Json())));
      table.append(",").append(csv_field(row.value("other_access", Json())));
      for (const char* key : columns) {
        table.append(",").append(csv_field(plan.is_null() ? Json() : plan.value(key, Json())));
      }
      for (const Json& value : row.at("access_table")) table.append(",").append(csv_field(value));
      table += "\r\n";
    }
  }
  return table;
}

std::optional<Json> find_overview(const std::filesystem::path& path) {
  const Json any = Json::parse(read_if_there(path), nullptr, /*allow_exceptions=*/false);
  if (!any.is_object() || any.value("schema", "") != kOverviewSchema) return {};
  try {
    describe_overview(any);
    for (const Json& target : any.at("targets")) {
      for (const Json& row : target.at("sections")) row.at("folder").get<std::string>();
    }
  } catch (const Json::exception&) {
    throw Error(path.string() + ": is no whole overview, expected targets and sections as " +
                "`wireplan run` writes them; run the case again");
  }
  return any;
}

std::vector<std::filesystem::path> reports_in(const std::filesystem::path& file) {
  const std::optional<Json> overview = find_overview(file);
  if (!overview) return {file};
  std::vector<std::filesystem::path> files;
  for (const Json& target : overview->at("targets")) {
    for (const Json& row : target.at("sections")) {
      files.push_back(file.parent_path() / row.at("folder").get<std::string>() / "report.json");
    }
  }
  return files;
}

std::string describe_overview(const Json& overview) {
  std::string text;
  for (const Json& target : overview.at("targets")) {
    if (!text.empty()) text += "\n";
    text += target.at("sentence").get<std::string>();
  }
  return text;
}

bool serves_all_targets(const Json& overview) {
  const Json& targets = overview.at("targets");
  return std::all_of(targets.begin(), targets.end(), [](const Json& target) {
    return serves_target(target.at("sections").front());
  });
}

}  // namespace wireplan::pipeline
