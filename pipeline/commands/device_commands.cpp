#include <iostream>
#include <map>
#include <memory>

#include "pipeline/commands/commands.h"
#include "pipeline/commands/subcommands.h"
#include "pipeline/files/catalogue.h"
#include "pipeline/files/text.h"

namespace wireplan::pipeline {
namespace {

/// The part of the file that a case can take wires from.
int print_wires_json() {
  const Json file = catalogue().file;
  Json wires = {{"schema", "wireplan.wires/1"}};
  for (const char* key : {"sources", "coatings", "wires"}) wires[key] = file.at(key);
  for (Json& wire : wires.at("wires")) wire.erase("aliases");
  std::cout << wires.dump(2) << "\n";
  return kDone;
}

std::string curve_of(const simulate::Wire& wire) {
  std::string curves;
  for (const simulate::Section& section : wire.sections) {
    if (section.rest_curvature == 0.0) continue;
    curves += (curves.empty() ? "radius " : ", ") +
              format("%.3g mm over %.3g mm", 1.0 / section.rest_curvature, section.length);
  }
  return curves.empty() ? "straight" : curves;
}

const NamedValue* last_value(const std::vector<NamedValue>& values, const std::string& ending) {
  const NamedValue* last = nullptr;
  for (const NamedValue& each : values) {
    const bool ends = each.key.size() >= ending.size() &&
                      each.key.compare(each.key.size() - ending.size(), ending.size(), ending) == 0;
    if (ends) last = &each;
  }
  return last;
}

/// Where EI of the shaft comes from: the sections run from the tip backwards. Sources by their ids,
/// which stand below the table.
std::string shaft_origin(const std::vector<NamedValue>& values) {
  const NamedValue* shaft = nullptr;
  for (const char* form : {"bending_stiffness_n_mm2", "flexural_modulus_gpa"}) {
    const NamedValue* own = last_value(values, form);
    if (own != nullptr && (shaft == nullptr || own->from > shaft->from)) shaft = own;
  }
  if (shaft == nullptr) return "";
  const std::string level = confidence_name(*shaft->value.confidence), told = level + ": ";
  const std::string& source = shaft->value.source;
  const bool repeats = source.rfind(told, 0) == 0;
  return "EI of the shaft " + told + (repeats ? source.substr(told.size()) : source);
}

void print_wire_table(const Catalogue& known) {
  std::cout
      << "wires                         diameter  EI tip  EI shaft  friction  weakest    tip\n"
         "                                    mm  N mm^2    N mm^2\n";
  for (const CatalogueWire& entry : known.wires) {
    const simulate::Wire& wire = entry.wire;
    const Weakest weakest = find_weakest(entry.values, wire.length());
    std::cout << format("%-28s  %8.3f  %6.4g  %8.4g  %8.3g  %-9s  ", wire.name.c_str(),
                        2.0 * wire.radius, wire.sections.front().bending_stiffness,
                        wire.sections.back().proximal_EI(), wire.friction.value_or(0.0),
                        weakest_name(weakest).c_str())
              << curve_of(wire) << "\n    " << entry.title << ", " << entry.coating << ". "
              << shaft_origin(entry.values) << "\n";
    for (const std::string& alias : entry.aliases) {
      std::cout << "    earlier: " << alias << "\n";
    }
  }
}

void print_sources(const Catalogue& known) {
  std::cout << "\nsources\n";
  for (const Source& source : known.sources) {
    std::cout << format("%-16s  ", source.id.c_str()) << source.citation
              << (source.opened ? "" : " (not opened)") << "\n";
  }
}

int print_wires() {
  const Catalogue& known = catalogue();
  print_wire_table(known);
  print_sources(known);
  return kDone;
}

void print_tube_tables(const Catalogue& known) {
  std::cout << "\ncatheters       outside  inside  length  EI tip  EI shaft  curves, from the tip\n"
               "                     mm      mm      mm  N mm^2    N mm^2\n";
  for (const Catheter& entry : known.catheters) {
    const simulate::Wire& tube = entry.tube;
    std::cout << format("%-14s  %7.3f  %6.3f  %6.0f  %6.4g  %8.4g  ", tube.name.c_str(),
                        2.0 * tube.radius, entry.inner_diameter, tube.length(),
                        tube.sections.front().bending_stiffness, tube.sections.back().proximal_EI())
              << curve_of(tube) << "\n    " << entry.title << ". " << shaft_origin(entry.values)
              << "\n";
  }
  std::cout << "\nsheaths         outside  inside  length\n"
               "                     mm      mm      mm\n";
  for (const Sheath& entry : known.sheaths) {
    std::cout << format("%-14s  %7.3f  %6.3f  %6.0f  ", entry.name.c_str(), entry.outer_diameter,
                        entry.inner_diameter, entry.length)
              << entry.title << "\n";
  }
}

int print_devices(bool as_json) {
  const Catalogue& known = catalogue();
  if (as_json) {
    std::cout << known.file.dump(2) << "\n";
    return kDone;
  }
  print_wire_table(known);
  print_tube_tables(known);
  print_sources(known);
  std::map<Confidence, int> counts;
  const auto count = [&](const std::vector<NamedValue>& values) {
    for (const NamedValue& each : values) ++counts[*each.value.confidence];
  };
  for (const CatalogueWire& entry : known.wires) count(entry.values);
  for (const Catheter& entry : known.catheters) count(entry.values);
  for (const Sheath& entry : known.sheaths) count(entry.values);
  std::cout << "\nvalues:";
  for (const auto& [confidence, number] : counts) {
    std::cout << " " << number << " " << confidence_name(confidence)
              << (confidence == Confidence::kAssumed ? "\n" : ",");
  }
  return kDone;
}

}  // namespace

void add_wires(CLI::App& app, int& code) {
  const auto as_json = std::make_shared<bool>(false);
  CLI::App* wires = app.add_subcommand("wires", "The wires of the catalogue with their sources");
  wires->add_flag("--json", *as_json, "As JSON, each wire as a case file takes it");
  wires->footer("Example: wireplan wires --json");
  wires->group("");  // a part of `devices`, whose help names it
  wires->callback([&code, as_json] { code = *as_json ? print_wires_json() : print_wires(); });
}

void add_devices(CLI::App& app, int& code) {
  const auto as_json = std::make_shared<bool>(false);
  CLI::App* devices =
      app.add_subcommand("devices", "The catalogue: wires, catheters, sheaths and their sources");
  devices->add_flag("--json", *as_json,
                    "As JSON, each value with its spread, source and confidence");
  devices->footer(
      "Confidence, strongest first: measured (source opened), reported (second-hand), derived,\n"
      "estimated, assumed. `weakest` is that of all values which a trial reads.\n"
      "`wireplan wires` lists the wires alone, with --json as a case takes them.\n"
      "Example: wireplan devices --json");
  devices->callback([&code, as_json] { code = print_devices(*as_json); });
}

}  // namespace wireplan::pipeline
