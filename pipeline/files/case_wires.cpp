#include "pipeline/files/case_wires.h"

#include <algorithm>
#include <set>

#include "pipeline/files/catalogue.h"
#include "pipeline/files/text.h"

namespace wireplan::pipeline {
namespace {

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
  const Catalogue known = catalogue();
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

std::vector<plan::WireSpread> spreads_of(const std::vector<DeviceWire>& devices,
                                         const std::optional<plan::FactorSpread>& friction,
                                         const std::optional<plan::FactorSpread>& stiffness) {
  constexpr plan::FactorSpread kAnyFriction{.low = 0.5, .high = 2.0};  // assumed
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
