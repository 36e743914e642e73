#include "pipeline/report/sheet_csv.h"

#include <algorithm>
#include <utility>

#include "pipeline/files/text.h"
#include "pipeline/files/viewer_files.h"
#include "pipeline/report/anatomy_json.h"

namespace wireplan::pipeline {
namespace {

constexpr std::size_t kPlans = 3;  // as on the sheet

class Table {
 public:
  void begin(std::string section) { section_ = std::move(section); }
  void row(const std::string& quantity, const Json& value, const char* unit = "",
           const Json& limit = nullptr, const Json& note = nullptr) {
    text_ += csv_field(section_) + "," + csv_field(quantity) + "," + csv_field(value) + "," +
             (*unit == 0 ? "" : csv_field(unit)) + "," + csv_field(limit) + "," + csv_field(note) +
             "\r\n";
  }
  std::string finish() { return std::move(text_); }

 private:
  std::string section_, text_ = "section,quantity,value,unit,limit,note\r\n";
};

void add_verdict(Table& table, const Json& verdict) {
  table.begin("verdict");
  table.row("answer", verdict.at("answer"), "", nullptr, verdict.at("headline"));
  for (const Json& text : verdict.at("reasons")) table.row("reason", nullptr, "", nullptr, text);
  for (const Json& text : verdict.at("changes")) table.row("change", nullptr, "", nullptr, text);
}

const Json* find_by_trial(const Json& rows, const Json& trial) {
  const auto found = std::find_if(rows.begin(), rows.end(),
                                  [&](const Json& row) { return row.at("trial") == trial; });
  return found == rows.end() ? nullptr : &*found;
}

/// "LAO 30, CRA 0: ostium of left renal"; null where the step has no view.
Json view_note(const Json& plan, std::size_t step) {
  if (!plan.contains("step_views")) return nullptr;
  const Json& seen = plan.at("step_views")[step];
  if (seen.at("view").is_null()) return nullptr;
  return seen.at("view").get<std::string>() + ": " + seen.at("at").get<std::string>();
}

void add_plans(Table& table, const Json& report) {
  const Json& ranking = report.at("ranking");
  const Json& limits = report.at("provenance").at("parameters").at("limits");
  for (std::size_t k = 0; k < std::min(kPlans, ranking.size()); ++k) {
    const Json& plan = ranking.at(k);
    const Json& trial = report.at("trials").at(plan.at("trial").get<std::size_t>());
    table.begin("plan " + std::to_string(k + 1));
    table.row("wire", plan.at("wire"));
    if (plan.contains("weakest_confidence")) {
      std::string keys;
      for (const Json& key : plan.at("weakest_values")) {
        keys += (keys.empty() ? "" : " ") + key.get<std::string>();
      }
      table.row("weakest value of the wire", plan.at("weakest_confidence"), "", nullptr, keys);
    }
    table.row("inclination", plan.at("inclination_deg"), "deg");
    table.row("azimuth", plan.at("azimuth_deg"), "deg");
    table.row("roll of the tip", plan.at("roll_deg"), "deg");
    if (plan.contains("catheter")) {
      table.row("catheter", plan.at("catheter"));
      if (plan.contains("first_wire")) table.row("wire to begin with", plan.at("first_wire"));
      table.row("exchanges of the wire", plan.at("exchanges"));
      for (std::size_t n = 0; n < plan.at("steps").size(); ++n) {
        const Json& step = plan.at("steps")[n];
        const std::string name = "step " + std::to_string(n + 1);
        table.row(name, step.at("text"), "", nullptr, view_note(plan, n));
        if (step.contains("otherwise")) table.row(name + ", otherwise", step.at("otherwise"));
      }
      for (const Json& tool : trial.at("tools").at("each")) {
        const std::string name = tool.at("name");
        table.row(name + ": tip force", tool.at("peak_tip_force_n"), "N");
        table.row(name + ": hand", tool.at("peak_push_force_n"), "N");
        table.row(name + ": torque of the hub", tool.at("peak_hub_torque_n_mm"), "N mm");
      }
      const Json& tools = trial.at("tools");
      table.row("catheter past the ostium", tools.at("hook_depth_mm"), "mm");
      table.row("push that the seated catheter bears", tools.at("support_n"), "N", nullptr,
                tools.at("support_is_least") ? "at least" : "");
      table.row("moves of the hand", tools.at("moves"));
    } else if (plan.contains("step_views")) {
      for (std::size_t n = 0; n < plan.at("step_views").size(); ++n) {
        table.row("step " + std::to_string(n + 1), plan.at("step_views")[n].at("text"), "", nullptr,
                  view_note(plan, n));
      }
    } else if (!plan.at("script").get<std::string>().empty()) {
      table.row("moves", plan.at("script"));
    }
    table.row("wire in the vessel", trial.at("insertion_mm"), "mm");
    table.row("tip force", trial.at("peak_tip_force_n"), "N", limits.at("tip_force_warn_n"));
    table.row("largest force on 5 mm of wire", trial.at("peak_contact_force_n"), "N");
    table.row("score", plan.at("score"));
    const Json* repeats = find_by_trial(report.at("robustness").at("plans"), plan.at("trial"));
    if (repeats != nullptr) {
      table.row("safe repeats", repeats->at("successes"), "", repeats->at("repeats"));
      const Json& interval = repeats->at("success_rate_interval");
      table.row("share safe, low end of 95 % interval", interval.at(0));
      table.row("share safe, high end of 95 % interval", interval.at(1));
    }
    const Json* errors = find_by_trial(report.at("numerics").at("plans"), plan.at("trial"));
    if (errors != nullptr) table.row("stated error of the tip", errors->at("tip_error_mm"), "mm");
    if (plan.contains("sensitive")) {
      table.row("end hangs on how it is computed", plan.at("sensitive"), "", nullptr,
                plan.at("sensitive_reason"));
    }
    if (plan.contains("tip_unsure")) {
      table.row("tip may be outside the target", plan.at("tip_unsure"));
    }
  }
}

void add_anatomy(Table& table, const Json& anatomy) {
  const Json& access = anatomy.at("access");
  const Json& bend = access.at("sharpest_bend");
  table.begin("access");
  for (const char* key : {"device", "sheath"}) {
    const Json& row = access.at(key);
    const std::string name = key;
    table.row(name + ": narrowest lumen", row.at("lumen_diameter_mm"), "mm",
              row.at("device_diameter_mm"), describe_fit(row));
    table.row(name + ": over lumen", row.at("ratio"), "", row.at("max_ratio"), row.at("source"));
    table.row(name + ": place from the access", row.at("at_mm"), "mm");
  }
  const Json& tortuosity = access.at("tortuosity");
  table.row("tortuosity", tortuosity.at("index"), "", tortuosity.at("thresholds").dump(),
            tortuosity.at("grade"));
  table.row("tortuosity: source", nullptr, "", nullptr, tortuosity.at("source"));
  table.row("sharpest bend", bend.at("angle_deg"), "deg", bend.at("thresholds_deg").dump(),
            bend.at("grade"));
  table.row("sharpest bend: source", nullptr, "", nullptr, bend.at("source"));
  table.row("sharpest bend: place from the access", bend.at("at_mm"), "mm", nullptr,
            bend.at("at_ostium_of"));
  const Json& calcium = access.at("calcium");
  table.row("calcium in and beside the lumen", calcium.at("volume_mm3"), "mm3",
            calcium.at("above_hu"),
            calcium.at("volume_mm3").is_null()
                ? calcium.at("null_reasons").at("volume_mm3")
                : Json("limit in HU; blur hides most of thin plaque, and metal or bone above it "
                       "counts too"));

  table.begin("c-arm");
  const Json& arm = anatomy.at("c_arm");
  table.row("reach: rotation", arm.at("max_rotation_deg"), "deg", nullptr, arm.at("source"));
  table.row("reach: tilt", arm.at("max_tilt_deg"), "deg", nullptr, arm.at("source"));
  if (!arm.at("no_views").is_null())
    table.row("no views", nullptr, "", nullptr, arm.at("no_views"));
  const auto add_views = [&](const Json& row, const std::string& place) {
    for (const auto& [key, title] : {std::pair("best", "best view"), {"second", "second view"}}) {
      const Json& view = row.at(key);
      if (view.is_null()) continue;
      const std::string which = title + (", " + place);
      table.row(which + ": LAO", view.at("lao_deg"), "deg", nullptr, view.at("view"));
      table.row(which + ": cranial", view.at("cranial_deg"), "deg", nullptr,
                view.at("reachable").get<bool>() ? "within reach" : "out of reach");
      table.row(which + ": trunk foreshortened by", view.at("trunk_foreshortening"));
      table.row(which + ": branch foreshortened by", view.at("branch_foreshortening"));
    }
  };
  for (const Json& ostium : arm.at("ostia")) {
    add_views(ostium, "ostium of " + ostium.at("branch").get<std::string>());
  }
  add_views(arm.at("bend"), "sharpest bend");

  table.begin("lengths");
  const Json& lengths = anatomy.at("lengths");
  for (const Json& place : lengths.at("places")) {
    const Json& branch = place.at("branch");
    std::string what = place.at("what");
    if (!branch.is_null()) what.append(" ").append(branch.get_ref<const std::string&>());
    table.row(what, place.at("at_mm"), "mm");
  }
  table.row("wire needed", lengths.at("wire_needed_mm"), "mm", nullptr, lengths.at("assumption"));
  for (const Json& wire : lengths.at("wires")) {
    table.row("wire " + wire.at("wire").get<std::string>(), wire.at("length_mm"), "mm",
              lengths.at("wire_needed_mm"));
  }
}

/// What the best trial of each wire moves in the vessel, in the notes over its repeats.
void add_motion(Table& table, const Json& motion) {
  for (const Json& trial : motion.at("trials")) {
    table.begin("vessel moved by " + trial.at("wire").get<std::string>());
    const Json over = trial.value("under_disturbances", Json());
    const auto spread = [&](const Json& rows, const char* key, const char* unit) {
      if (over.is_null()) return Json();
      const Json& value = rows.at(key);
      return Json(
          format("%.3g to %.3g", value.at("low").get<double>(), value.at("high").get<double>()) +
          unit + " in 90 % of the repeats that reached");
    };
    table.row("largest shift", trial.at("most_mm"), "mm", nullptr, spread(over, "most_mm", " mm"));
    table.row("way at rest", trial.at("way_length_mm"), "mm");
    table.row("way moved", trial.at("moved_way_length_mm"), "mm", nullptr,
              spread(over, "moved_way_length_mm", " mm"));
    for (std::size_t k = 0; k < trial.at("ostia").size(); ++k) {
      const Json& ostium = trial.at("ostia")[k];
      table.row("ostium of " + ostium.at("branch").get<std::string>() + ": shift",
                ostium.at("shift_mm"), "mm", nullptr,
                spread(over.is_null() ? over : over.at("ostia")[k], "shift_mm", " mm"));
    }
    for (const Json& turn : trial.at("turns")) {
      const std::string into = "turn into " + turn.at("branch").get<std::string>();
      table.row(into + ", at rest", turn.at("at_rest_deg"), "deg");
      table.row(into + ", moved", turn.at("moved_deg"), "deg");
      table.row(into + ": from the access, at rest", turn.at("from_access_mm"), "mm");
      table.row(into + ": from the access, moved", turn.at("moved_from_access_mm"), "mm");
      table.row(into + ": its view changes by", turn.at("view_change_deg"), "deg");
    }
  }
}

}  // namespace

std::string sheet_csv(const Json& report) {
  Table table;
  if (report.contains("verdict")) add_verdict(table, report.at("verdict"));
  add_plans(table, report);
  if (report.contains("anatomy")) add_anatomy(table, report.at("anatomy"));
  if (report.contains("vessel_motion")) add_motion(table, report.at("vessel_motion"));
  table.begin("fetch");
  for (const Json& item : report.value("fetch", Json::array())) {
    table.row(item.at("what"), item.at("text"), "", nullptr,
              item.at("assumed").get<bool>() ? "size assumed" : "");
  }
  table.begin("uncertain");
  for (const Json& share : report.at("robustness").at("sensitivity").at("shares")) {
    table.row("share of " + share.at("unknown").get<std::string>() + " in what moves the plans",
              share.at("share"));
  }
  for (const Json& text : report.at("provenance").at("warnings")) {
    table.row("warning", nullptr, "", nullptr, text);
  }
  table.begin("statement");
  table.row("statement", nullptr, "", nullptr, report.at("statement"));
  return table.finish();
}

}  // namespace wireplan::pipeline
