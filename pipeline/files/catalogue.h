#pragma once
/// The wires that wireplan knows by name: wires.json beside this file, which is built into the
/// program, so that it needs no data folder. Each section says where its values come from, or
/// "assumed".
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "simulate/wire/rod.h"

namespace wireplan::pipeline {

struct CatalogueWire {
  simulate::Wire wire;
  std::string title;
  std::string source;                        // of what all sections share: diameter, mass, EA, GJ
  std::vector<std::string> section_sources;  // of length and EI, one per section, from the tip
};

/// The catalogue, by falling diameter and, within one, rising shaft stiffness.
std::vector<CatalogueWire> catalogue();

/// Reads a wire as the catalogue and a case file write it: "name", "diameter_mm" and "sections"
/// from the tip backwards, and optionally "title" and "source".
CatalogueWire read_wire(JsonReader& reader);

/// The same back, with every default written out except "title" and "source".
Json wire_json(const simulate::Wire& wire);

}  // namespace wireplan::pipeline
