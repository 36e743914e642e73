#include "pipeline/files/case_wires.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "pipeline/files/catalogue.h"
#include "pipeline/files/text.h"

namespace wireplan::pipeline {
namespace {

constexpr plan::FactorSpread kAnyFriction{.low = 0.5, .high = 2.0};  // assumed

/// The wire under a name of the catalogue; a wire without sections where there is none.
DeviceWire named_wire(const std::string& name, const std::string& key, const Catalogue& known,
                      Problems& problems, std::vector<std::string>& told) {
  if (const CatalogueWire* found = find_wire(known, name)) {
    if (found->wire.name != name) {
      told.push_back(key + ": \"" + name + "\" is an earlier name of \"" + found->wire.name +
                     "\", under which the report tells it");
    }
    return *found;
  }
  std::vector<std::string> names;
  std::string list;
  for (const CatalogueWire& entry : known.wires) {
    names.push_back(entry.wire.name);
    list += (list.empty() ? "" : ", ") + entry.wire.name;
  }
  const std::string nearest = nearest_name(name, names);
  problems.add(key, "\"" + name + "\"", "a wire of the catalogue: " + list,
               nearest.empty() ? "a wire of your own is an object {\"name\", \"diameter_mm\", "
                                 "\"sections\"}"
                               : "did you mean \"" + nearest + "\"?");
  DeviceWire none;
  none.wire.name = name;
  return none;
}

/// Of the catalogue, as a case takes it.
Catheter case_catheter(const Catalogue& known, std::size_t place) {
  Catheter catheter = known.catheters[place];
  catheter.json = known.file.at("catheters").at(place);
  for (const char* told : {"title", "shape"}) catheter.json.erase(told);
  return catheter;
}

}  // namespace

CaseWires read_wires(JsonReader& root) {
  const std::string expected = "a list of catalogue names and wires, at least one";
  Problems& problems = root.problems();
  CaseWires read;
  const bool given = root.has("wires");
  const Json& list = root.raw("wires");
  if (!list.is_array() || list.empty()) {
    problems.add("wires", given ? list.dump() : "missing", expected,
                 "`wireplan wires` lists the catalogue");
    return read;
  }
  const Catalogue& known = catalogue();
  std::set<std::string> names;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string key = "wires[" + std::to_string(i) + "]";
    read.devices.push_back(list[i].is_string() ? named_wire(list[i].get<std::string>(), key, known,
                                                            problems, read.told)
                                               : read_wire(list[i], key, problems, known.coatings));
    const std::string& name = read.devices.back().wire.name;
    if (!name.empty() && !names.insert(name).second) {
      problems.add(key, "\"" + name + "\" again", "a name of its own",
                   "the report tells wires by name");
    }
  }
  return read;
}

std::vector<Catheter> read_case_catheters(JsonReader& root, const std::vector<DeviceWire>& wires) {
  Problems& problems = root.problems();
  std::vector<Catheter> read;
  if (!root.has("catheters")) return read;
  const Json& list = root.raw("catheters");
  const Catalogue& known = catalogue();
  std::vector<std::string> names;
  for (const Catheter& entry : known.catheters) names.push_back(entry.tube.name);
  if (list == kSuggestCatheters) {
    for (std::size_t k = 0; k < names.size(); ++k) read.push_back(case_catheter(known, k));
    return read;
  }
  if (!list.is_array() || list.empty()) {
    problems.add("catheters", list.dump(),
                 "a list of catalogue names and catheters, at least one, or \"suggest\"",
                 "`wireplan devices` lists the catalogue; without the key wires go in alone");
    return read;
  }
  std::set<std::string> used;
  for (const DeviceWire& wire : wires) used.insert(wire.wire.name);
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string key = "catheters[" + std::to_string(i) + "]";
    if (list[i].is_string()) {
      const std::string name = list[i].get<std::string>();
      const auto found = std::find(names.begin(), names.end(), name);
      if (found == names.end()) {
        const std::string nearest = nearest_name(name, names);
        problems.add(key, "\"" + name + "\"", "a catheter of the catalogue",
                     nearest.empty()
                         ? "`wireplan devices` lists them; one of your own is an object "
                           "{\"name\", \"diameter_mm\", \"inner_diameter_mm\", "
                           "\"sections\"}"
                         : "did you mean \"" + nearest + "\"?");
        continue;
      }
      read.push_back(case_catheter(known, static_cast<std::size_t>(found - names.begin())));
    } else {
      JsonReader reader(list[i], key, problems);
      read.push_back(read_catheter(reader, known.coatings, /*own=*/true));
      read.back().json = list[i];
    }
    const std::string& name = read.back().tube.name;
    if (!name.empty() && !used.insert(name).second) {
      problems.add(key, "\"" + name + "\" again", "a name of its own",
                   "the report tells wires and catheters by name");
    }
  }
  return read;
}

double thinnest(const std::vector<Catheter>& catheters) {
  double diameter = catheters.empty() ? 0.0 : HUGE_VAL;
  for (const Catheter& catheter : catheters) {
    diameter = std::min(diameter, 2.0 * catheter.tube.radius);
  }
  return diameter;
}

Json catheters_json_of(const std::vector<Catheter>& catheters) {
  Json json = Json::array();
  for (const Catheter& catheter : catheters) json.push_back(catheter.json);
  return json;
}

std::vector<plan::Catheter> catheters_of(const std::vector<Catheter>& catheters,
                                         const std::optional<plan::FactorSpread>& friction,
                                         const std::optional<plan::FactorSpread>& stiffness) {
  std::vector<plan::Catheter> all;
  for (const Catheter& catheter : catheters) {
    plan::Catheter& own = all.emplace_back();
    own.tool = {.wire = catheter.tube, .inner_radius = 0.5 * catheter.inner_diameter};
    own.spread = catheter.spread;
    if (own.spread.friction.known()) own.spread.friction = kAnyFriction;
    if (friction) own.spread.friction = *friction;
    if (stiffness) {
      own.spread.stiffness.assign(catheter.tube.sections.size(), {*stiffness, *stiffness});
    }
  }
  return all;
}

plan::ToolRules read_tool_rules(JsonReader& root) {
  plan::ToolRules rules;
  JsonReader reader = root.object("tool_rules", false);
  constexpr Range kLength{.min = 0.0, .max = 5000.0};
  rules.soft_tip = reader.number("soft_tip_n_mm2", rules.soft_tip, {.min = 0.0, .max = 1e5});
  rules.hold = reader.number("hold_mm", rules.hold, kLength, "given in m?");
  rules.outside = reader.number("outside_mm", rules.outside, kLength, "given in m?");
  rules.most_turn =
      reader.number("most_turn_deg", rules.most_turn / kRadPerDeg, {.min = 0.0, .max = 360.0}) *
      kRadPerDeg;
  rules.turn_per_length = reader.number("turn_deg_per_mm", rules.turn_per_length / kRadPerDeg,
                                        {.min = 0.0, .max = 3600.0, .open_min = true}) *
                          kRadPerDeg;
  rules.seat = reader.number("seat_mm", rules.seat, kLength, "given in m?");
  rules.friction = reader.number("friction_between_tools", rules.friction, kFrictionRange);
  rules.exchange = reader.boolean("exchange", rules.exchange);
  reader.finish();
  return rules;
}

Json tool_rules_json(const plan::ToolRules& rules) {
  return {{"soft_tip_n_mm2", rules.soft_tip},
          {"hold_mm", rules.hold},
          {"outside_mm", rules.outside},
          {"most_turn_deg", clean(rules.most_turn / kRadPerDeg)},
          {"turn_deg_per_mm", clean(rules.turn_per_length / kRadPerDeg)},
          {"seat_mm", rules.seat},
          {"friction_between_tools", rules.friction},
          {"exchange", rules.exchange}};
}

std::vector<plan::WireSpread> spreads_of(const std::vector<DeviceWire>& devices,
                                         const std::optional<plan::FactorSpread>& friction,
                                         const std::optional<plan::FactorSpread>& stiffness) {
  std::vector<plan::WireSpread> spreads;
  for (const DeviceWire& device : devices) {
    plan::WireSpread& spread = spreads.emplace_back(device.spread);
    if (spread.friction.known()) spread.friction = kAnyFriction;
    if (friction) spread.friction = *friction;
    if (stiffness) spread.stiffness.assign(device.wire.sections.size(), {*stiffness, *stiffness});
  }
  return spreads;
}

std::vector<std::string> tell_friction(const std::vector<DeviceWire>& devices,
                                       const simulate::InsertionOptions& insertion) {
  std::vector<std::string> told;
  for (const DeviceWire& device : devices) {
    std::string whose = "the case's, since the wire states none";
    if (device.wire.friction) whose = "its own";
    if (device.wire.friction && !device.coating.empty()) whose += " (" + device.coating + ")";
    if (insertion.friction_factor != 1.0) {
      whose += format(", times friction_factor %.3g", insertion.friction_factor);
    }
    told.push_back("friction of " + device.wire.name + ": " +
                   format("%.3g", friction_of(device.wire, insertion)) + ", " + whose);
  }
  return told;
}

std::vector<std::string> warn_of_friction(const std::vector<DeviceWire>& devices,
                                          const simulate::InsertionOptions& insertion) {
  std::vector<std::string> warnings;
  const bool none_takes_it =
      std::all_of(devices.begin(), devices.end(),
                  [](const DeviceWire& device) { return device.wire.friction.has_value(); });
  if (none_takes_it && insertion.friction != kDefaultFriction) {
    warnings.push_back(
        format("friction %.3g acts on no wire, since each has its own; ", insertion.friction) +
        "friction_factor multiplies these (0: frictionless)");
  }
  const bool smooth = std::all_of(devices.begin(), devices.end(), [&](const DeviceWire& device) {
    return friction_of(device.wire, insertion) == 0.0;
  });
  if (smooth) {
    warnings.push_back("frictionless (friction is 0): push forces are lower bounds");
  }
  return warnings;
}

}  // namespace wireplan::pipeline
