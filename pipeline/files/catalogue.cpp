#include "pipeline/files/catalogue.h"

#include <algorithm>
#include <set>

#include "devices_json.h"  // made by CMake from devices.json

namespace wireplan::pipeline {
namespace {

constexpr const char* kDevicesSchema = "wireplan.devices/1";

std::string source_id(const std::string& source) { return source.substr(0, source.find(':')); }

std::vector<Source> read_sources(JsonReader& root) {
  std::vector<Source> sources;
  for (JsonReader& reader : root.objects("sources", true)) {
    Source& source = sources.emplace_back();
    source.id = reader.text("id", std::nullopt);
    source.citation = reader.text("citation", std::nullopt);
    source.opened = reader.boolean("opened", false);
    reader.finish();
  }
  return sources;
}

std::vector<Coating> read_coatings(JsonReader& root) {
  std::vector<Coating> coatings;
  for (JsonReader& reader : root.objects("coatings", true)) {
    Coating& coating = coatings.emplace_back();
    coating.name = reader.text("name", std::nullopt);
    coating.friction = read_value(reader, "friction", kFrictionRange, kFrictionHint);
    coating.json = reader.raw("friction");
    reader.finish();
  }
  return coatings;
}

std::vector<CatalogueWire> read_wires(JsonReader& root, const std::vector<Coating>& coatings) {
  std::vector<CatalogueWire> wires;
  const Json& list = root.raw("wires");
  for (std::size_t k = 0; k < list.size(); ++k) {
    Json object = list[k];
    std::vector<std::string> aliases;
    if (object.contains("aliases")) {
      aliases = object.at("aliases").get<std::vector<std::string>>();
      object.erase("aliases");
    }
    const std::string path = "wires[" + std::to_string(k) + "]";
    wires.push_back({read_wire(object, path, root.problems(), coatings), std::move(aliases)});
  }
  return wires;
}

/// A value of the device that is noted, as a number.
double noted(std::vector<NamedValue>& values, JsonReader& reader, const char* key, Range range) {
  return note_value(values, key, read_value(reader, key, range), "").number();
}

constexpr Range kTubeDiameter{.min = 0.1, .max = 20.0};
constexpr Range kTubeLength{.min = 1.0, .max = 5000.0};

void check_tube(JsonReader& reader, double inner, double outer) {
  if (inner < outer) return;
  reader.problems().add(reader.path_of("inner_diameter_mm"), Json(inner).dump(),
                        "less than outside, " + Json(outer).dump());
}

std::vector<Catheter> read_catheters(JsonReader& root, const std::vector<Coating>& coatings) {
  std::vector<Catheter> catheters;
  for (JsonReader& reader : root.objects("catheters", true)) {
    catheters.push_back(read_catheter(reader, coatings, /*own=*/false));
  }
  return catheters;
}

std::vector<Sheath> read_sheaths(JsonReader& root) {
  std::vector<Sheath> sheaths;
  for (JsonReader& reader : root.objects("sheaths", true)) {
    Sheath& sheath = sheaths.emplace_back();
    sheath.name = reader.text("name", std::nullopt);
    sheath.title = reader.text("title", std::nullopt);
    sheath.outer_diameter = noted(sheath.values, reader, "diameter_mm", kTubeDiameter);
    sheath.inner_diameter = noted(sheath.values, reader, "inner_diameter_mm", kTubeDiameter);
    sheath.length = noted(sheath.values, reader, "length_mm", kTubeLength);
    check_tube(reader, sheath.inner_diameter, sheath.outer_diameter);
    reader.finish();
  }
  return sheaths;
}

/// What a confidence may rest on.
class OriginCheck {
 public:
  OriginCheck(const std::vector<Source>& sources, Problems& problems)
      : sources_(sources), problems_(problems) {}

  void device(const std::string& name, const std::vector<NamedValue>& values) {
    if (!names_.insert(name).second) {
      problems_.add(name, "given twice", "a name of its own in the catalogue");
    }
    for (const NamedValue& each : values) value(name + ": " + each.key, each.value);
  }

  void value(const std::string& key, const DeviceValue& value) {
    if (!value.confidence) {
      problems_.add(key, "a plain value", "{\"value\", \"spread\", \"source\", \"confidence\"}");
      return;
    }
    const std::string id = source_id(value.source), level = confidence_name(*value.confidence);
    const auto found = std::find_if(sources_.begin(), sources_.end(),
                                    [&](const Source& source) { return source.id == id; });
    const bool listed = found != sources_.end();
    std::string expected;
    switch (*value.confidence) {
      case Confidence::kMeasured:
        if (!listed || !found->opened) expected = "a listed source that was opened";
        break;
      case Confidence::kReported:
        if (!listed) expected = "a listed source";
        break;
      case Confidence::kDerived:
        if (!listed && id != "definition") expected = "a listed source, or \"definition\"";
        break;
      case Confidence::kEstimated:
        if (!listed && id != "estimated") expected = "a listed source, or \"estimated\"";
        break;
      case Confidence::kAssumed:
        if (id != "assumed") expected = "\"assumed\" and what";
        break;
    }
    if (!expected.empty()) {
      problems_.add(key, level + " by \"" + value.source + "\"", expected,
                    "weaken the confidence or name the source");
    }
  }

 private:
  const std::vector<Source>& sources_;
  Problems& problems_;
  std::set<std::string> names_;
};

}  // namespace

Catalogue read_catalogue(const Json& file) {
  Problems problems("devices.json");
  JsonReader root(file, "", problems);
  root.text("schema", std::nullopt);
  Catalogue read;
  read.file = file;
  read.sources = read_sources(root);
  read.coatings = read_coatings(root);
  read.wires = read_wires(root, read.coatings);
  read.catheters = read_catheters(root, read.coatings);
  read.sheaths = read_sheaths(root);
  root.finish();
  OriginCheck check(read.sources, problems);
  for (const Coating& coating : read.coatings) check.value(coating.name, coating.friction);
  for (const CatalogueWire& wire : read.wires) check.device(wire.wire.name, wire.values);
  for (const Catheter& tube : read.catheters) check.device(tube.tube.name, tube.values);
  for (const Sheath& sheath : read.sheaths) check.device(sheath.name, sheath.values);
  problems.throw_if_any();
  return read;
}

Catheter read_catheter(JsonReader& reader, const std::vector<Coating>& coatings, bool own) {
  using Fallback = std::optional<std::string>;
  Catheter catheter;
  std::vector<std::string> coats;
  for (const Coating& coating : coatings) coats.push_back(coating.name);
  catheter.tube.name = reader.text("name", std::nullopt);
  catheter.title = reader.text("title", own ? Fallback(catheter.tube.name) : std::nullopt);
  catheter.shape = reader.text("shape", own ? Fallback("") : std::nullopt);
  const std::size_t before = reader.problems().count();
  const double outer = noted(catheter.values, reader, "diameter_mm", kTubeDiameter);
  catheter.tube.radius = 0.5 * outer;
  catheter.inner_diameter = noted(catheter.values, reader, "inner_diameter_mm", kTubeDiameter);
  if (reader.problems().count() == before) check_tube(reader, catheter.inner_diameter, outer);
  if (!own || reader.has("coating")) {
    const DeviceValue coating =
        note_value(catheter.values, "coating", read_word(reader, "coating", coats), "");
    for (const Coating& known : coatings) {
      if (known.name == coating.word) catheter.tube.friction = known.friction.number();
    }
  }
  if (own && reader.has("friction")) {
    catheter.tube.friction = reader.number("friction", std::nullopt, kFrictionRange, kFrictionHint);
  }
  read_sections(reader, outer, /*signed_radii=*/true, catheter.tube, catheter.spread,
                catheter.values);
  reader.finish();
  return catheter;
}

const Catalogue& catalogue() {
  static const Catalogue known = [] {
    std::string text;
    for (const char* part : kDevicesJson) text += part;
    return read_catalogue(parse_json(text, "devices.json", kDevicesSchema));
  }();
  return known;
}

const CatalogueWire* find_wire(const Catalogue& known, const std::string& name) {
  for (const CatalogueWire& entry : known.wires) {
    const auto& aliases = entry.aliases;
    if (entry.wire.name == name ||
        std::find(aliases.begin(), aliases.end(), name) != aliases.end()) {
      return &entry;
    }
  }
  return nullptr;
}

std::string cite(const Catalogue& known, const std::string& source) {
  const std::string id = source_id(source);
  for (const Source& each : known.sources) {
    if (each.id == id) return each.citation + source.substr(id.size());
  }
  return source;
}

}  // namespace wireplan::pipeline
