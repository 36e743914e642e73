#include "pipeline/files/wire_file.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace wireplan::pipeline {
namespace {

constexpr Range kBendingStiffness{.min = 0.01, .max = 1e7};  // [N mm^2]
constexpr const char* kEI = "bending_stiffness_n_mm2";
constexpr const char* kTipLoad = "tip_load_gf";
constexpr const char* kModulus = "flexural_modulus_gpa";
constexpr const char* kTaperKey = "taper";

/// EI at both ends of a section as it is given, and how far it may be off; 0 where neighbours give
/// it.
struct Bending {
  std::array<double, 2> EI = {0.0, 0.0};  // [N mm^2]
  std::array<plan::FactorSpread, 2> spread = {};
  bool between = false;  // a taper from the section before to that behind
};

Bending bending_of(const DeviceValue& value, double factor) {
  Bending bending;
  for (std::size_t end = 0; end < 2; ++end) {
    const std::size_t k = std::min(end, value.numbers.size() - 1);
    bending.EI[end] = factor * value.numbers[k];
    bending.spread[end] = value.spreads[k];
  }
  return bending;
}

class SectionReader {
 public:
  SectionReader(JsonReader& device, double diameter, bool signed_radii,
                std::vector<NamedValue>& values)
      : device_(device), diameter_(diameter), signed_radii_(signed_radii), values_(values) {
    source_ = device.text("source", "the case file");
  }

  void read(JsonReader& reader, bool is_tip) {
    const std::string source = reader.text("source", source_);
    simulate::Section section;
    const std::string place = "sections[" + std::to_string(sections.size()) + "].";
    const auto note = [&](const std::string& key, DeviceValue value) {
      return note_value(values_, place + key, std::move(value), source, start_);
    };
    section.length =
        note("length_mm", read_value(reader, "length_mm", {.min = 0.1, .max = 5000.0})).number();
    bendings_.push_back(read_bending(reader, is_tip, section, note));
    const auto optional = [&](const char* key, double most) {
      return reader.has(key)
                 ? note(key, read_value(reader, key, {.min = 0.0, .max = most})).number()
                 : 0.0;
    };
    section.axial_stiffness = optional("axial_stiffness_n", 1e6);
    section.twist_stiffness = optional("twist_stiffness_n_mm2", 1e5);
    section.mass_per_length = optional("mass_kg_per_m", 1.0) * kTonnePerMmFromKgPerM;
    if (reader.has("mass_kg_per_m")) values_.back().acts = false;
    if (reader.has("rest_radius_mm")) section.rest_curvature = 1.0 / read_radius(reader, note);
    reader.finish();
    start_ += section.length;
    sections.push_back(section);
  }

  /// Tapers between neighbours take EI from them.
  plan::WireSpread finish() {
    plan::WireSpread spread;
    const std::vector<Bending> given = bendings_;
    for (std::size_t k = 0; k < sections.size(); ++k) {
      Bending& own = bendings_[k];
      if (own.between) {
        const bool has_both =
            k > 0 && k + 1 < given.size() && !given[k - 1].between && !given[k + 1].between;
        if (!has_both) {
          device_.problems().add(
              device_.path_of("sections[" + std::to_string(k) + "]." + kTaperKey), "given alone",
              std::string("a section with ") + kEI + " before it and one behind it",
              std::string("or give [at the tip's end, at the other] as ") + kEI);
          own = bending_of({.numbers = {1.0}, .spreads = {{}}}, 1.0);
        } else {
          own.EI = {given[k - 1].EI[1], given[k + 1].EI[0]};
          own.spread = {given[k - 1].spread[1], given[k + 1].spread[0]};
        }
      }
      sections[k].bending_stiffness = own.EI[0];
      if (own.EI[1] != own.EI[0]) sections[k].proximal_bending_stiffness = own.EI[1];
      spread.stiffness.push_back(own.spread);
    }
    return spread;
  }

  std::vector<simulate::Section> sections;

 private:
  template <class Note>
  Bending read_bending(JsonReader& reader, bool is_tip, simulate::Section& section,
                       const Note& note) {
    const bool has_taper = reader.has(kTaperKey);
    if (has_taper) {
      const DeviceValue taper = note(kTaperKey, read_word(reader, kTaperKey, {"linear", "cone"}));
      section.taper = taper.word == "cone" ? simulate::Taper::kCone : simulate::Taper::kLinear;
    }
    std::vector<std::string> forms;
    for (const char* key : {kEI, kTipLoad, kModulus}) {
      if (reader.has(key)) forms.emplace_back(key);
    }
    if (forms.empty() && has_taper) return {.between = true};
    if (forms.size() > 1) {
      reader.problems().add(reader.path_of(forms[1]), "given beside " + forms[0], "one of them",
                            "each gives the section's EI");
      for (const std::string& key : forms) reader.raw(key);
      return bending_of({.numbers = {1.0}, .spreads = {{}}}, 1.0);
    }
    const std::string form = forms.empty() ? kEI : forms.front();
    if (has_taper && !(form == kEI && is_pair(reader))) {
      reader.problems().add(
          reader.path_of(kTaperKey), "given beside one EI", "no such key",
          std::string("a taper has two in ") + kEI + ", or none: those of its neighbours");
    }
    if (form == kTipLoad) return read_tip_load(reader, is_tip, section.length, note);
    if (form == kModulus) {
      const Range range{.min = 0.001, .max = 500.0};
      return bending_of(note(kModulus, read_value(reader, kModulus, range, "given in MPa?")),
                        stiffness_of_modulus(1.0, diameter_));
    }
    return bending_of(note(kEI, read_value(reader, kEI, kBendingStiffness, "1 N m^2 is 1e6 N mm^2",
                                           /*pair=*/true)),
                      1.0);
  }

  static bool is_pair(JsonReader& reader) {
    const Json& given = reader.raw(kEI);
    if (!given.is_object()) return given.is_array();
    return given.contains("value") && given.at("value").is_array();
  }

  template <class Note>
  Bending read_tip_load(JsonReader& reader, bool is_tip, double length, const Note& note) {
    const DeviceValue value = note(
        kTipLoad, read_value(reader, kTipLoad, {.min = 0.01, .max = 1000.0}, "given in mN or N?"));
    if (!is_tip || length < kTipLoadLength) {
      reader.problems().add(
          reader.path_of(kTipLoad), Json(value.number()).dump(),
          is_tip ? "a section of at least 10 mm" : "the first section's",
          "a tip load bends the last 10 mm of the wire; give " + std::string(kEI));
    }
    return bending_of(value, stiffness_of_tip_load(1.0));
  }

  template <class Note>
  double read_radius(JsonReader& reader, const Note& note) {
    const Range range{.min = signed_radii_ ? -1e6 : 0.5, .max = 1e6};
    const DeviceValue value = note(
        "rest_radius_mm", read_value(reader, "rest_radius_mm", range, "leave out if straight"));
    if (std::abs(value.number()) >= 0.5) return value.number();
    reader.problems().add(reader.path_of("rest_radius_mm"), Json(value.number()).dump(),
                          "at least 0.5 either way", "leave out if straight");
    return 1.0;
  }

  JsonReader& device_;
  double diameter_;
  bool signed_radii_;
  std::vector<NamedValue>& values_;
  std::string source_;
  double start_ = 0.0;  // of the section that is read next, from the tip                  [mm]
  std::vector<Bending> bendings_;
};

/// Friction of its own, or that of its coating.
void read_surface_of_wire(JsonReader& reader, const std::vector<Coating>& coatings,
                          DeviceWire& read) {
  const std::string source = reader.text("source", "the case file");
  if (reader.has("coating")) {
    std::vector<std::string> names;
    for (const Coating& coating : coatings) names.push_back(coating.name);
    read.coating =
        note_value(read.values, "coating", read_word(reader, "coating", names), source).word;
  }
  std::optional<DeviceValue> friction;
  if (reader.has("friction"))
    friction = read_value(reader, "friction", kFrictionRange, kFrictionHint);
  for (const Coating& coating : coatings) {
    if (friction || coating.name != read.coating) continue;
    friction = coating.friction;
    read.json["friction"] = coating.json;
  }
  if (!friction) return;
  note_value(read.values, "friction", *friction, source);
  read.wire.friction = friction->number();
  read.spread.friction = friction->spreads.front();
}

/// The defaults that the object leaves out.
void write_defaults(Json& json) {
  for (const char* key : {"title", "aliases"}) json.erase(key);
  const bool has_mass = json.contains("mass_kg_per_m");
  for (Json& section : json.at("sections")) {
    for (const char* key : {"axial_stiffness_n", "twist_stiffness_n_mm2", "mass_kg_per_m"}) {
      if (std::string(key) == "mass_kg_per_m" && has_mass) continue;
      if (!section.contains(key)) section[key] = 0.0;
    }
  }
}

}  // namespace

double stiffness_of_tip_load(double grams) {
  constexpr double kLoad = 0.625923;  // F L^2 / EI of the elastica at a deflection of 0.2 L
  constexpr double kNewtonPerGram = 9.80665e-3;
  return grams * kNewtonPerGram * kTipLoadLength * kTipLoadLength / kLoad;
}

double stiffness_of_modulus(double gigapascals, double diameter) {
  constexpr double kMpaPerGpa = 1e3;
  return gigapascals * kMpaPerGpa * kPi * std::pow(diameter, 4) / 64.0;
}

DeviceValue note_value(std::vector<NamedValue>& values, const std::string& key, DeviceValue value,
                       const std::string& fallback, double from) {
  if (value.source.empty()) value.source = fallback;
  values.push_back({.key = key, .from = from, .acts = true, .value = std::move(value)});
  return values.back().value;
}

void read_sections(JsonReader& device, double diameter, bool signed_radii, simulate::Wire& wire,
                   plan::WireSpread& spread, std::vector<NamedValue>& values) {
  SectionReader sections(device, diameter, signed_radii, values);
  bool is_tip = true;
  for (JsonReader& section : device.objects("sections", true)) {
    sections.read(section, is_tip);
    is_tip = false;
  }
  spread.stiffness = sections.finish().stiffness;
  wire.sections = std::move(sections.sections);
}

DeviceWire read_wire(const Json& object, const std::string& path, Problems& problems,
                     const std::vector<Coating>& coatings) {
  const std::size_t problems_before = problems.count();
  JsonReader reader(object, path, problems);
  DeviceWire read;
  read.json = object;
  read.wire.name = reader.text("name", std::nullopt);
  read.title = reader.text("title", read.wire.name);
  const std::string source = reader.text("source", "the case file");
  const double diameter = note_value(read.values, "diameter_mm",
                                     read_value(reader, "diameter_mm", {.min = 0.1, .max = 3.0},
                                                "given in m or inch? 0.035 inch is 0.889 mm"),
                                     source)
                              .number();
  read.wire.radius = 0.5 * diameter;
  read_surface_of_wire(reader, coatings, read);
  double mass = 0.0;
  if (reader.has("mass_kg_per_m")) {
    mass = note_value(read.values, "mass_kg_per_m",
                      read_value(reader, "mass_kg_per_m", {.min = 0.0, .max = 1.0}), source)
               .number();
    read.values.back().acts = false;
  }
  read_sections(reader, diameter, /*signed_radii=*/false, read.wire, read.spread, read.values);
  for (simulate::Section& section : read.wire.sections) {
    if (section.mass_per_length == 0.0) section.mass_per_length = mass * kTonnePerMmFromKgPerM;
  }
  reader.finish();
  if (problems.count() == problems_before) write_defaults(read.json);
  return read;
}

Json wire_json(const simulate::Wire& wire) {
  Json sections = Json::array();
  for (const simulate::Section& section : wire.sections) {
    Json EI = section.bending_stiffness;
    if (section.tapered()) EI = {section.bending_stiffness, section.proximal_bending_stiffness};
    Json json = {{"length_mm", section.length},
                 {kEI, std::move(EI)},
                 {"axial_stiffness_n", section.axial_stiffness},
                 {"twist_stiffness_n_mm2", section.twist_stiffness},
                 {"mass_kg_per_m", clean(section.mass_per_length / kTonnePerMmFromKgPerM)}};
    if (section.tapered()) {
      json[kTaperKey] = section.taper == simulate::Taper::kCone ? "cone" : "linear";
    }
    if (section.rest_curvature != 0.0) json["rest_radius_mm"] = clean(1.0 / section.rest_curvature);
    sections.push_back(json);
  }
  Json json = {{"name", wire.name}, {"diameter_mm", 2.0 * wire.radius}};
  if (wire.friction) json["friction"] = *wire.friction;
  json["sections"] = std::move(sections);
  return json;
}

}  // namespace wireplan::pipeline
