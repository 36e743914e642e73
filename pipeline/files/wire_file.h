#pragma once
/// A wire as the catalogue and a case file write it -> what trials push, and how well it is known.
#include <string>
#include <utility>
#include <vector>

#include "pipeline/files/device_value.h"
#include "plan/wire_spread.h"
#include "simulate/wire/rod.h"

namespace wireplan::pipeline {

inline constexpr Range kFrictionRange{.min = 0.0, .max = 1.0};
inline constexpr const char* kFrictionHint =
    "Coulomb's coefficient: 0.04 hydrophilic, 0.12 PTFE, 0.25 bare";

/// What a surface has in common: "hydrophilic", "ptfe", "bare".
struct Coating {
  std::string name;
  DeviceValue friction;
  Json json;  // of the friction
};

struct DeviceWire {
  simulate::Wire wire;
  plan::WireSpread spread;  // its friction's is known where it has none of its own
  std::string title;
  std::string coating;  // empty: not told
  std::vector<NamedValue> values;
  Json json;  // as a case takes it, with every default written out except "title" and "source"
};

/// EI of the last 10 mm of a wire [N mm^2] from its tip load [gf]: the force that bends them
/// sideways by 2 mm (Lorenzoni et al., EuroIntervention 2015, 10.4244/EIJV11I7A164). An
/// inextensible cantilever whose tip is moved by 0.2 of its length bears 0.6259 EI / L^2.
inline constexpr double kTipLoadLength = 10.0;  // [mm]
double stiffness_of_tip_load(double grams);

/// EI [N mm^2] of a solid round rod of the diameter [mm] and the modulus [GPa], as bending benches
/// tell stiffness.
double stiffness_of_modulus(double gigapascals, double diameter);

/// Reads the object under `path`: "name", "diameter_mm" and "sections" from the tip backwards.
/// EI of a section is given as such, as a tip load, as a modulus, or as a taper between those
/// before and behind it.
DeviceWire read_wire(const Json& object, const std::string& path, Problems& problems,
                     const std::vector<Coating>& coatings);

/// The sections of any long device of this diameter [mm]; `signed_radii`: they may curve both ways.
/// Adds to `values` what they are made of.
void read_sections(JsonReader& device, double diameter, bool signed_radii, simulate::Wire& wire,
                   plan::WireSpread& spread, std::vector<NamedValue>& values);

/// Adds the value under the key; its source is `fallback` where it names none.
DeviceValue note_value(std::vector<NamedValue>& values, const std::string& key, DeviceValue value,
                       const std::string& fallback, double from = 0.0);

/// What trials read of a wire, under the keys of a case.
Json wire_json(const simulate::Wire& wire);

}  // namespace wireplan::pipeline
