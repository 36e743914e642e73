#pragma once
/// The devices that wireplan knows by name: devices.json beside this file, which is built into the
/// program, so that it needs no data folder. Every value says how far it may be off, where it comes
/// from and how well it is known.
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "pipeline/files/wire_file.h"

namespace wireplan::pipeline {

/// What sources of values begin with: "harrison", or "harrison: 17 GPa". Besides, "definition",
/// "estimated" and "assumed" need no citation.
struct Source {
  std::string id;
  std::string citation;
  bool opened = false;  // by who wrote the value; else quoted by what was
};

struct CatalogueWire : DeviceWire {
  std::vector<std::string> aliases;  // earlier names, which cases may still use
};

/// A tube: its sections are those of a wire; a tool of scenes, and of scripts that plans may have.
struct Catheter {
  simulate::Wire tube;      // of the outer radius
  plan::WireSpread spread;  // of the tube
  std::string title, shape;
  double inner_diameter = 0.0;  //                                                        [mm]
  std::vector<NamedValue> values;
  Json json;  // as a case takes it
};

struct Sheath {
  std::string name, title;
  double outer_diameter = 0.0, inner_diameter = 0.0, length = 0.0;  //                    [mm]
  std::vector<NamedValue> values;
};

struct Catalogue {
  std::vector<Source> sources;
  std::vector<Coating> coatings;
  std::vector<CatalogueWire> wires;  // by falling diameter and, within one, rising stiffness
  std::vector<Catheter> catheters;
  std::vector<Sheath> sheaths;
  Json file;
};

/// The built-in catalogue, read when it is first asked for.
const Catalogue& catalogue();

/// Reads a catheter: of the catalogue, or a case's `own`, which needs neither title, shape nor
/// coating and may have a "friction".
Catheter read_catheter(JsonReader& reader, const std::vector<Coating>& coatings, bool own);

/// Reads such a file. Throws Error with all problems at once: a value without spread, source or
/// confidence, a source that is not listed, a confidence that it does not bear.
Catalogue read_catalogue(const Json& file);

/// The wire of the name, or whose alias it is; null where there is none.
const CatalogueWire* find_wire(const Catalogue& known, const std::string& name);

/// The source with its citation in the place of its id.
std::string cite(const Catalogue& known, const std::string& source);

}  // namespace wireplan::pipeline
