#pragma once
/// The wires of a case: of the catalogue by name, or its own.
#include <optional>
#include <string>
#include <vector>

#include "pipeline/files/catalogue.h"
#include "pipeline/files/json_reader.h"
#include "pipeline/files/wire_file.h"
#include "plan/catheters.h"
#include "simulate/insertion/insertion.h"

namespace wireplan::pipeline {

/// Of wires that state none: a hydrophilic one's.
inline constexpr double kDefaultFriction = 0.04;

struct CaseWires {
  std::vector<DeviceWire> devices;
  std::vector<std::string> told;  // names that the catalogue has changed since
};

/// Reads "wires". A wire without sections where a name is not known.
CaseWires read_wires(JsonReader& root);

/// In the place of the list: catheters of the catalogue are chosen by the anatomy.
inline constexpr const char* kSuggestCatheters = "suggest";

/// Reads "catheters", beside the wires, which the names must differ from; none where the case has
/// no such key, all of the catalogue where it asks for suggestions.
std::vector<Catheter> read_case_catheters(JsonReader& root, const std::vector<DeviceWire>& wires);

Json catheters_json_of(const std::vector<Catheter>& catheters);
/// Diameter of the thinnest, 0 where there is none [mm].
double thinnest(const std::vector<Catheter>& catheters);

/// As trials take them, their values as far off as the case says of all wires, or as their own
/// tell.
std::vector<plan::Catheter> catheters_of(const std::vector<Catheter>& catheters,
                                         const std::optional<plan::FactorSpread>& friction,
                                         const std::optional<plan::FactorSpread>& stiffness);

/// Reads "tool_rules", what scripts of catheter and wire keep to.
plan::ToolRules read_tool_rules(JsonReader& root);
Json tool_rules_json(const plan::ToolRules& rules);

/// How far the values of each wire may be off: as the case says of all, else as the wire's own
/// values tell; of a friction that no source tells the spread of, half to twice.
std::vector<plan::WireSpread> spreads_of(const std::vector<DeviceWire>& devices,
                                         const std::optional<plan::FactorSpread>& friction,
                                         const std::optional<plan::FactorSpread>& stiffness);

/// Which friction acts on which wire, in sentences.
std::vector<std::string> tell_friction(const std::vector<DeviceWire>& devices,
                                       const simulate::InsertionOptions& insertion);

/// What the friction of the case leaves to be warned of: that it acts on no wire, or that nothing
/// rubs.
std::vector<std::string> warn_of_friction(const std::vector<DeviceWire>& devices,
                                          const simulate::InsertionOptions& insertion);

}  // namespace wireplan::pipeline
