#include "pipeline/files/catalogue.h"

#include "wires_json.h"  // made by CMake from wires.json

namespace wireplan::pipeline {
namespace {

constexpr Range kBendingStiffness{.min = 0.01, .max = 1e7};  // [N mm^2]

/// 1/radius [1/mm] of a tip that is curved at rest; 0 where the key is absent: straight.
double read_rest_curvature(JsonReader& reader) {
  if (!reader.has("rest_radius_mm")) return 0.0;
  const Range range{.min = 0.5, .max = 1e6};
  return 1.0 / reader.number("rest_radius_mm", std::nullopt, range, "leave out if straight");
}

simulate::Section read_section(JsonReader& reader) {
  simulate::Section section;
  section.length = reader.number("length_mm", std::nullopt, {.min = 0.1, .max = 5000.0});
  section.bending_stiffness = reader.number("bending_stiffness_n_mm2", std::nullopt,
                                            kBendingStiffness, "1 N m^2 is 1e6 N mm^2");
  section.axial_stiffness = reader.number("axial_stiffness_n", 0.0, {.min = 0.0, .max = 1e6});
  section.twist_stiffness = reader.number("twist_stiffness_n_mm2", 0.0, {.min = 0.0, .max = 1e5});
  section.mass_per_length =
      reader.number("mass_kg_per_m", 0.0, {.min = 0.0, .max = 1.0}) * kTonnePerMmFromKgPerM;
  section.rest_curvature = read_rest_curvature(reader);
  return section;
}

}  // namespace

CatalogueWire read_wire(JsonReader& reader) {
  CatalogueWire read;
  read.wire.name = reader.text("name", std::nullopt);
  read.title = reader.text("title", read.wire.name);
  read.source = reader.text("source", "the case file");
  read.wire.radius = 0.5 * reader.number("diameter_mm", std::nullopt, {.min = 0.1, .max = 3.0},
                                         "given in m or inch? 0.035 inch is 0.889 mm");
  for (JsonReader& section : reader.objects("sections", true)) {
    read.section_sources.push_back(section.text("source", read.source));
    read.wire.sections.push_back(read_section(section));
    section.finish();
  }
  reader.finish();
  return read;
}

Json wire_json(const simulate::Wire& wire) {
  Json sections = Json::array();
  for (const simulate::Section& section : wire.sections) {
    Json json = {{"length_mm", section.length},
                 {"bending_stiffness_n_mm2", section.bending_stiffness},
                 {"axial_stiffness_n", section.axial_stiffness},
                 {"twist_stiffness_n_mm2", section.twist_stiffness},
                 {"mass_kg_per_m", clean(section.mass_per_length / kTonnePerMmFromKgPerM)}};
    if (section.rest_curvature != 0.0) json["rest_radius_mm"] = clean(1.0 / section.rest_curvature);
    sections.push_back(json);
  }
  return {{"name", wire.name}, {"diameter_mm", 2.0 * wire.radius}, {"sections", sections}};
}

std::vector<CatalogueWire> catalogue() {
  const Json file = parse_json(kWiresJson, "wires.json", "wireplan.wires/1");
  Problems problems("wires.json");
  JsonReader root(file, "", problems);
  root.text("schema", std::nullopt);
  std::vector<CatalogueWire> wires;
  for (JsonReader& wire : root.objects("wires", true)) wires.push_back(read_wire(wire));
  root.finish();
  problems.throw_if_any();
  return wires;
}

}  // namespace wireplan::pipeline
