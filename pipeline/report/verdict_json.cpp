#include "pipeline/report/verdict_json.h"

#include <algorithm>
#include <iterator>

#include "pipeline/report/anatomy_json.h"
#include "plan/number_text.h"
#include "plan/trial_log.h"

namespace wireplan::pipeline {
namespace {

plan::Passage passage(const Json& row) {
  return {.lumen = row.at("lumen_diameter_mm"),
          .at = row.at("at_mm"),
          .device = row.at("device_diameter_mm"),
          .max_ratio = row.at("max_ratio"),
          .assumed = row.at("assumed"),
          .oval = row.at("oval")};
}

}  // namespace

plan::WayFindings way_findings(const Json& anatomy) {
  const Json& access = anatomy.at("access");
  const Json& tortuosity = access.at("tortuosity");
  const Json& bend = access.at("sharpest_bend");
  plan::WayFindings way;
  way.device = passage(access.at("device"));
  way.sheath = passage(access.at("sheath"));
  way.sheath_length = access.at("sheath").at("length_mm");
  way.weighs_sheath = !access.at("sheath").at("assumed_longer_than_way").get<bool>();
  way.length = anatomy.at("lengths").at("way_mm");
  if (!tortuosity.at("index").is_null()) way.tortuosity = tortuosity.at("index").get<double>();
  way.tortuosity_grade = grade_from(tortuosity.at("grade"));
  way.bend = bend.at("angle_deg").get<double>() * kRadPerDeg;
  way.bend_at = bend.at("at_mm");
  if (bend.at("at_ostium_of").is_null()) {
    way.bend_grade = grade_from(bend.at("grade"));
  } else {
    way.bend_ostium = bend.at("at_ostium_of");
  }
  way.wire_needed = anatomy.at("lengths").at("wire_needed_mm").get<double>();
  return way;
}

Json verdict_json(const plan::Verdict& verdict) {
  Json json;
  json["answer"] = answer_name(verdict.answer);
  json["headline"] = verdict.headline;
  json["reasons"] = verdict.reasons;
  json["changes"] = verdict.changes;
  return json;
}

std::string answer_of(const Json& report) {
  if (!report.contains("verdict")) return "-";
  std::string words = report.at("verdict").at("answer");
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

std::string describe_verdict(const Json& report) {
  if (!report.contains("verdict")) return "";
  const Json& verdict = report.at("verdict");
  std::string text =
      "verdict: " + answer_of(report) + ". " + verdict.at("headline").get<std::string>() + "\n";
  const Json& reasons = verdict.at("reasons");
  if (verdict.at("answer") != "feasible" && !reasons.empty()) {
    text += "reason: " + reasons.front().get<std::string>() + "\n";
  }
  return text;
}

std::string describe_tools(const Json& plan) {
  return plan.at("wire").get<std::string>() +
         (plan.contains("catheter") ? " in " + plan.at("catheter").get<std::string>() : "") +
         (plan.contains("first_wire")
              ? " in exchange for " + plan.at("first_wire").get<std::string>()
              : "");
}

std::string describe_best(const Json& report) {
  const Json& ranking = report.at("ranking");
  const Json& trials = report.at("trials");
  if (ranking.empty()) {
    const auto scouted = std::count_if(trials.begin(), trials.end(), [](const Json& trial) {
      return trial.value("level", "full") != "full";
    });
    return "no plan reaches the target within the limits: " +
           plan::count_of(static_cast<int>(trials.size()), "trial") +
           (scouted > 0 ? ", " + std::to_string(scouted) + " of them only on " +
                              plan::wall_of_scouts(report.contains("vessel_motion")) +
                              " (--exhaustive runs all in full)"
                        : "") +
           "; the report says why for each";
  }
  const Json& best = ranking.front();
  const std::string script = best.value("script", "");
  const auto reached = std::count_if(trials.begin(), trials.end(), [](const Json& trial) {
    return trial.at("reached").get<bool>();
  });
  const bool alone = answer_of(report) == "not feasible";  // a device does not pass
  return std::string(alone ? "the wire alone would reach the target: " : "") + "best of " +
         std::to_string(ranking.size()) + (ranking.size() == 1 ? " safe plan" : " safe plans") +
         " (reach, no limit broken); " + std::to_string(reached) + " of " +
         std::to_string(trials.size()) + " tried reach: " + describe_tools(best) +
         ", inclination " + best.at("inclination_deg").dump() + " deg, azimuth " +
         best.at("azimuth_deg").dump() + " deg, roll " + best.at("roll_deg").dump() + " deg, " +
         best.at("sentence").get<std::string>() + (script.empty() ? "" : "; script: " + script);
}

}  // namespace wireplan::pipeline
