#include "pipeline/report/fetch_json.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/files/catalogue.h"
#include "pipeline/files/text.h"
#include "plan/candidates.h"
#include "plan/catheters.h"
#include "plan/manoeuvre.h"

namespace wireplan::pipeline {
namespace {

constexpr std::size_t kPlansTold = 3;  // as many as the sheet has
constexpr double kMillimetresPerInch = 25.4;

std::string join(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

Json fetch_row(const char* what, const std::vector<std::string>& items, const std::string& text,
               bool assumed = false) {
  return {{"what", what}, {"items", items}, {"text", text}, {"assumed", assumed}};
}

/// The first few; all are among the row's items.
std::string of_catalogue(std::vector<std::string> names) {
  constexpr std::size_t kMostTold = 5;
  if (names.empty()) return "none in the catalogue";
  const std::size_t left = names.size() - std::min(names.size(), kMostTold);
  names.resize(names.size() - left);
  return "in the catalogue: " + join(names) +
         (left > 0 ? " and " + std::to_string(left) + " more" : "");
}

Json wire_row(const char* what, const simulate::Wire& wire, double needed) {
  const double spare = wire.length() - needed;
  return fetch_row(what, {wire.name},
                   wire.name +
                       format(", %.3f in, %.0f mm long", 2.0 * wire.radius / kMillimetresPerInch,
                              wire.length()) +
                       (spare < 0.0 ? format(": %.0f mm too short", -spare) : ""));
}

Json sheath_row(const Json& sheath, double inside) {
  constexpr double kRounding = 0.005;  // 5 F are 1.667 mm, and written 1.67                [mm]
  const bool weighed = !sheath.at("assumed_longer_than_way").get<bool>();
  const double most =
      sheath.at("max_ratio").get<double>() * sheath.at("lumen_diameter_mm").get<double>();
  std::vector<std::string> names;
  for (const Sheath& known : catalogue().sheaths) {
    const bool takes_it = known.inner_diameter >= inside - kRounding;
    if ((known.outer_diameter < most || !weighed) && takes_it) names.push_back(known.name);
  }
  const std::string takes = format("takes a catheter of %.3g mm", inside);
  const std::string text =
      weighed
          ? format("outer diameter below %.3g mm, ", most) + takes + "; " + of_catalogue(names) +
                format("; checked here with one of %.3g mm",
                       sheath.at("device_diameter_mm").get<double>())
          : takes + "; " + of_catalogue(names) +
                format("; not held against the lumen, for one of %.0f mm is longer than the way",
                       sheath.at("length_mm").get<double>());
  return fetch_row("Sheath", names, text, sheath.at("assumed"));
}

/// For a plan of a wire alone: what passes the way over that wire.
Json catheter_row(const Json& device, const simulate::Wire& wire, double length) {
  const double most = device.at("lumen_diameter_mm");
  std::vector<std::string> names;
  for (const Catheter& known : catalogue().catheters) {
    const bool passes = 2.0 * known.tube.radius < most && known.inner_diameter > 2.0 * wire.radius;
    if (passes) names.push_back(known.tube.name);
  }
  const double taken = device.at("device_diameter_mm");
  return fetch_row("Catheter", names,
                   format("outer diameter below %.3g mm, goes over the wire; ", most) +
                       of_catalogue(names) +
                       format("; checked here with one of %.3g mm, %.0f mm long", taken, length),
                   device.at("assumed"));
}

/// A place that a view shows, and how far along the way it is.
struct Seen {
  double arc = 0.0;
  std::string name;
  Json view;
};

Json view_name(const Json& row) {
  const Json& best = row.at("best");
  const Json& second = row.at("second");
  if (best.is_null()) return nullptr;
  return best.at("reachable").get<bool>() || second.is_null() ? best.at("view") : second.at("view");
}

std::vector<Seen> places_to_see(const Json& arm) {
  std::vector<Seen> places;
  for (const Json& ostium : arm.at("ostia")) {
    places.push_back({ostium.at("at_mm").get<double>(),
                      "ostium of " + ostium.at("branch").get<std::string>(), view_name(ostium)});
  }
  const Json& bend = arm.at("bend");
  if (bend.at("best").is_null() && arm.at("no_views").is_null()) return places;  // it is straight
  const double at = bend.at("at_mm");
  places.push_back({at, format("bend at %.0f mm", at), view_name(bend)});
  return places;
}

/// Of a script of tools, the ostium that each step is about: the target's, or that of a side vessel
/// which it is seen at. `places` begin with the ostia of `arm`.
std::vector<const Seen*> ostia_of_steps(const plan::Study& study, const plan::Candidate& candidate,
                                        const Json& arm, const std::vector<Seen>& places) {
  const auto ostia_end = places.begin() + static_cast<std::ptrdiff_t>(arm.at("ostia").size());
  const Seen* target = nullptr;
  for (std::size_t k = 0; k < arm.at("ostia").size(); ++k) {
    if (arm.at("ostia")[k].at("leads_to_target").get<bool>()) target = &places[k];
  }
  const std::vector<simulate::SideVessel> sides = plan::tool_options(study, candidate).sides;
  std::vector<const Seen*> seen;
  for (const simulate::ToolStep& step : candidate.steps) {
    const auto side = std::find_if(sides.begin(), sides.end(),
                                   [&](const auto& one) { return one.branch == step.side; });
    if (step.side < 0 || side == sides.end()) {
      seen.push_back(target);
      continue;
    }
    const auto off = [&](const Seen& place) { return std::abs(place.arc - side->take_off.arc); };
    const auto nearest = std::min_element(
        places.begin(), ostia_end, [&](const Seen& a, const Seen& b) { return off(a) < off(b); });
    seen.push_back(nearest == ostia_end ? target : &*nearest);
  }
  return seen;
}

}  // namespace

Json fetch_json(const ReportInput& input, const Json& anatomy) {
  Json list = Json::array();
  const auto& plans = input.judgement.ranking.plans;
  if (plans.empty()) return list;
  const Json& access = anatomy.at("access");
  const Json& lengths = anatomy.at("lengths");
  const auto candidate = [&](std::size_t k) -> const plan::Candidate& {
    return input.plan.candidates[static_cast<std::size_t>(plans[k].trial)];
  };
  const double way = lengths.at("way_mm"), comes_off = lengths.at("catheter_mm"),
               working = lengths.at("working_mm"), needed = lengths.at("wire_needed_mm");
  const bool assumed =
      lengths.at("working_assumed").get<bool>() || lengths.at("catheter_assumed").get<bool>();
  std::vector<int> wires;
  for (std::size_t k = 0; k < std::min(kPlansTold, plans.size()); ++k) {
    const std::vector<int> own = plan::wires_of(candidate(k));
    for (auto wire = own.rbegin(); wire != own.rend(); ++wire) {
      if (std::find(wires.begin(), wires.end(), *wire) != wires.end()) continue;
      const char* what = k > 0 ? "In reserve" : wires.empty() ? "Wire" : "Wire to begin with";
      list.push_back(wire_row(what, input.study.wires[static_cast<std::size_t>(*wire)], needed));
      wires.push_back(*wire);
    }
  }
  const simulate::Wire& first = input.study.wires[static_cast<std::size_t>(wires.front())];
  double inside = access.at("device").at("device_diameter_mm");
  if (const int own = candidate(0).catheter; own >= 0) {
    const simulate::Wire& tube = input.study.catheters[static_cast<std::size_t>(own)].tool.wire;
    inside = 2.0 * tube.radius;
    list.push_back(fetch_row("Catheter", {tube.name},
                             tube.name + format(", %.3g mm outside, of plan 1", inside)));
  } else {
    list.push_back(catheter_row(access.at("device"), first, comes_off));
  }
  list.push_back(sheath_row(access.at("sheath"), inside));
  list.push_back(fetch_row(
      "Wire length", {},
      format("%.0f mm needed, counted from the access point: %.0f mm of way, %.0f mm of "
             "catheter that comes off it, %.0f mm to hold, with the stretch from skin to vessel",
             needed, way, comes_off, working),
      assumed));
  return list;
}

Json step_views_json(const plan::Study& study, const plan::Candidate& candidate,
                     const plan::Measured& trial, const Json& anatomy) {
  const Json& arm = anatomy.at("c_arm");
  const std::vector<Seen> places = places_to_see(arm);
  Json steps = Json::array();
  const auto add = [&](const std::string& text, const Seen* seen) {
    steps.push_back({{"text", text},
                     {"at", seen == nullptr ? Json(nullptr) : Json(seen->name)},
                     {"view", seen == nullptr ? Json(nullptr) : seen->view}});
  };
  if (candidate.catheter >= 0) {
    const std::vector<plan::ToldStep> told =
        plan::describe_steps(study, candidate, trial.metrics.insertion);
    const std::vector<const Seen*> seen = ostia_of_steps(study, candidate, arm, places);
    for (std::size_t k = 0; k < told.size(); ++k) add(told[k].text, seen[k]);
    return steps;
  }
  const std::vector<std::string> texts =
      plan::describe_each_move(candidate.moves, trial.metrics.insertion);
  double depth = 0.0;
  for (std::size_t k = 0; k < texts.size(); ++k) {
    depth = k < candidate.moves.size() ? depth + candidate.moves[k].push : trial.metrics.insertion;
    const auto nearest =
        std::min_element(places.begin(), places.end(), [&](const Seen& a, const Seen& b) {
          return std::abs(a.arc - depth) < std::abs(b.arc - depth);
        });
    add(texts[k], nearest == places.end() ? nullptr : &*nearest);
  }
  return steps;
}

}  // namespace wireplan::pipeline
