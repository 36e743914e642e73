// The catalogue of devices: what is known of each value and how well, and the wires of a case.
#include <gtest/gtest.h>

#include "pipeline/files/case_wires.h"
#include "tests/pipeline/case_texts.h"
#include "tests/simulate/analytic.h"

namespace wireplan::pipeline {
namespace {

// ---- the catalogue ----------------------------------------------------------------------------

/// Every value of a file: {"value", "spread", "source", "confidence"}.
void list_values(const Json& json, const std::string& pointer, std::vector<std::string>& found) {
  if (json.is_object() && json.contains("value")) {
    found.push_back(pointer);
    return;
  }
  if (!json.is_structured()) return;
  for (const auto& [key, inner] : json.items()) list_values(inner, pointer + "/" + key, found);
}

std::string refusal_of(const Json& file) {
  try {
    read_catalogue(file);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Catalogue, AValueWithoutSpreadSourceOrConfidenceIsRefused) {
  const Json file = catalogue().file;
  std::vector<std::string> values;
  list_values(file, "", values);
  EXPECT_GT(values.size(), 500u);
  for (std::size_t k = 0; k < values.size(); k += 23) {  // some of every list
    SCOPED_TRACE(values[k]);
    const Json::json_pointer place(values[k]);
    for (const char* key : {"value", "spread", "source", "confidence"}) {
      Json changed = file;
      changed[place].erase(key);
      EXPECT_NE(refusal_of(changed), "") << "without its " << key;
    }
    Json plain = file;
    plain[place] = Json(file.at(place).at("value"));
    expect_mentions(refusal_of(plain), {"a plain value", "\"confidence\""});
  }
  EXPECT_EQ(refusal_of(file), "");
}

TEST(Catalogue, AConfidenceNeedsASourceThatBearsIt) {
  const Json file = catalogue().file;
  const auto told = [&](const char* confidence, const char* source) {
    Json changed = file;
    Json& value = changed["wires"][0]["diameter_mm"];
    value["confidence"] = confidence;
    value["source"] = source;
    return refusal_of(changed);
  };
  EXPECT_EQ(told("measured", "harrison: a number"), "");
  expect_mentions(told("measured", "harrison-brands"), {"a listed source that was opened"});
  EXPECT_EQ(told("reported", "harrison-brands"), "");
  expect_mentions(told("reported", "hearsay"), {"reported by \"hearsay\"", "a listed source"});
  expect_mentions(told("derived", "assumed"), {"\"definition\""});
  expect_mentions(told("estimated", "a guess"), {"\"estimated\""});
  expect_mentions(told("assumed", "harrison"), {"\"assumed\" and what"});
}

TEST(Catalogue, HoldsTheDevicesOfALaboratory) {
  const Catalogue known = catalogue();
  EXPECT_GE(known.wires.size(), 30u);
  EXPECT_GE(known.catheters.size(), 12u);
  EXPECT_GE(known.sheaths.size(), 6u);
  for (const char* name :
       {"glidewire", "glidewire-stiff", "bentson", "rosen-cook", "rosen-boston", "newton",
        "amplatz", "meier-backup", "lunderquist-extra-stiff", "steel-014", "cto-014", "v-18"}) {
    EXPECT_NE(find_wire(known, name), nullptr) << name;
  }
  std::set<std::string> catheters;
  for (const Catheter& entry : known.catheters) catheters.insert(entry.tube.name);
  for (const char* name :
       {"cobra-c1", "cobra-c2", "cobra-c3", "vertebral", "berenstein", "jb1", "simmons-1",
        "simmons-2", "rdc", "sos", "rim", "mpa", "pigtail", "progreat-27"}) {
    EXPECT_EQ(catheters.count(name), 1u) << name;
  }
}

TEST(Catalogue, NothingIsAssumedOfWhichASourceTells) {
  const Catalogue known = catalogue();
  std::map<Confidence, int> counts;
  for (const CatalogueWire& entry : known.wires) {
    for (const NamedValue& each : entry.values) ++counts[*each.value.confidence];
  }
  // Only a source that is found moves a value up.
  EXPECT_EQ(counts[Confidence::kMeasured], 61);
  EXPECT_EQ(counts[Confidence::kReported], 18);
  EXPECT_EQ(counts[Confidence::kDerived], 14);
  EXPECT_EQ(counts[Confidence::kEstimated], 132);
  EXPECT_EQ(counts[Confidence::kAssumed], 190);

  // What bench or maker tells of each.
  const std::vector<std::pair<std::string, std::vector<std::string>>> told = {
      {"amplatz", {"sections[2].flexural_modulus_gpa", "sections[0].bending_stiffness_n_mm2"}},
      {"amplatz-short-taper", {"sections[1].length_mm", "sections[2].flexural_modulus_gpa"}},
      {"fixed-core-heavy-duty", {"sections[2].flexural_modulus_gpa"}},
      {"rosen-cook", {"sections[3].flexural_modulus_gpa"}},
      {"rosen-boston", {"sections[3].flexural_modulus_gpa"}},
      {"newton", {"sections[2].flexural_modulus_gpa"}},
      {"amplatz-stiff", {"sections[2].flexural_modulus_gpa"}},
      {"amplatz-extra-stiff", {"sections[2].flexural_modulus_gpa"}},
      {"amplatz-super-stiff", {"sections[2].flexural_modulus_gpa"}},
      {"amplatz-ultra-stiff", {"sections[2].flexural_modulus_gpa"}},
      {"meier-backup", {"sections[2].flexural_modulus_gpa"}},
      {"lunderquist-extra-stiff", {"sections[2].flexural_modulus_gpa"}},
      {"glidewire", {"coating", "sections[0].length_mm", "sections[2].bending_stiffness_n_mm2"}},
      {"glidewire-angled", {"sections[0].rest_radius_mm", "sections[1].length_mm"}},
      {"glidewire-j", {"sections[0].rest_radius_mm"}},
      {"glidewire-stiff", {"sections[0].length_mm", "sections[2].bending_stiffness_n_mm2"}},
      {"radifocus-m-stiff", {"diameter_mm", "sections[1].length_mm", "sections[3].length_mm"}},
      {"nitrex", {"diameter_mm", "sections[1].length_mm"}},
      {"bentson", {"sections[1].length_mm"}},
      {"fathom-16", {"diameter_mm", "sections[0].length_mm", "sections[1].length_mm"}},
      {"transend-014", {"sections[0].length_mm", "sections[2].length_mm"}},
      {"v-18", {"sections[0].tip_load_gf"}},
      {"victory-14", {"sections[0].tip_load_gf"}},
      {"steel-014", {"sections[0].tip_load_gf"}},
      {"cto-014", {"sections[0].tip_load_gf"}}};
  for (const auto& [name, keys] : told) {
    const CatalogueWire* wire = find_wire(known, name);
    ASSERT_NE(wire, nullptr) << name;
    for (const std::string& key : keys) {
      const auto found = std::find_if(wire->values.begin(), wire->values.end(),
                                      [&](const NamedValue& value) { return value.key == key; });
      ASSERT_NE(found, wire->values.end()) << name << ": " << key;
      EXPECT_NE(found->value.confidence, Confidence::kAssumed) << name << ": " << key;
    }
  }
  for (const CatalogueWire& entry : known.wires) {  // what Schroeder tells of coatings
    for (const NamedValue& each : entry.values) {
      if (each.key != "friction") continue;
      EXPECT_NE(each.value.confidence, Confidence::kAssumed) << entry.wire.name;
    }
  }
}

TEST(Catalogue, EveryWireIsPhysical) {
  const Catalogue known = catalogue();
  double diameter = std::numeric_limits<double>::infinity();
  for (const CatalogueWire& entry : known.wires) {
    SCOPED_TRACE(entry.wire.name);
    EXPECT_GE(entry.wire.length(), 900.0) << "long enough for insertions of 600 mm";
    EXPECT_LE(2.0 * entry.wire.radius, diameter) << "listed by falling diameter";
    diameter = 2.0 * entry.wire.radius;
    EXPECT_TRUE(diameter == 0.889 || diameter == 0.457 || diameter == 0.406 || diameter == 0.356);
    EXPECT_TRUE(entry.wire.friction.has_value());
    EXPECT_FALSE(entry.spread.friction.known());
    double stiffness = 0.0;
    for (const simulate::Section& section : entry.wire.sections) {
      EXPECT_GE(section.bending_stiffness, stiffness) << "stiffer toward the shaft";
      EXPECT_GE(section.proximal_EI(), section.bending_stiffness);
      stiffness = section.proximal_EI();

      // Between the mass of nitinol and of steel filling the whole cross section, 4 % for rounding.
      const double area = kPi * entry.wire.radius * entry.wire.radius;
      EXPECT_GE(section.mass_per_length, 0.96 * 6.45e-9 * area);
      EXPECT_LE(section.mass_per_length, 1.04 * 7.9e-9 * area);
    }
    // No measured shaft of 0.035 inch is softer than 90 N mm^2.
    EXPECT_GE(stiffness, diameter == 0.889 ? 90.0 : 0.0);
  }
}

TEST(Catalogue, ShaftStiffnessIsThatOfTheMeasuredModulus) {
  // Flexural moduli of Harrison et al. 2011 [MPa] with their standard deviations, times
  // I = pi d^4 / 64.
  struct Bench {
    const char* name;
    double modulus, deviation, EI;
  };
  const std::vector<Bench> benches = {{"amplatz", 9500, 600, 291},
                                      {"fixed-core-heavy-duty", 11400, 300, 350},
                                      {"rosen-cook", 12300, 700, 377},
                                      {"newton", 12500, 700, 383},
                                      {"rosen-boston", 14500, 600, 445},
                                      {"amplatz-stiff", 17000, 800, 521},
                                      {"amplatz-extra-stiff", 29200, 900, 895},
                                      {"amplatz-super-stiff", 60300, 900, 1849},
                                      {"amplatz-ultra-stiff", 65400, 1200, 2005},
                                      {"meier-backup", 139600, 2500, 4280},
                                      {"lunderquist-extra-stiff", 158400, 1500, 4857}};
  const Catalogue known = catalogue();
  for (const Bench& bench : benches) {
    SCOPED_TRACE(bench.name);
    const CatalogueWire* entry = find_wire(known, bench.name);
    ASSERT_NE(entry, nullptr);
    EXPECT_NEAR(entry->wire.sections.back().bending_stiffness, bench.EI, 0.6);
    EXPECT_NEAR(entry->spread.stiffness.back()[1].deviation, bench.deviation / bench.modulus, 1e-9);
  }
}

TEST(Catalogue, CurvedTipsTurnByTheAngleThatTheyAreNamedFor) {
  const std::map<std::string, double> expected = {{"glidewire-angled", 45.0},
                                                  {"glidewire-stiff-angled", 45.0},
                                                  {"radifocus-m-stiff", 45.0},
                                                  {"glidewire-advantage", 45.0},
                                                  {"glidewire-j", 180.0},
                                                  {"rosen-cook", 180.0},
                                                  {"rosen-boston", 180.0},
                                                  {"amplatz-stiff-angled", 86.0},
                                                  {"amplatz-super-stiff-angled", 86.0},
                                                  {"amplatz-stiff-hook", 115.0},
                                                  {"amplatz-super-stiff-hook", 115.0},
                                                  {"amplatz-super-stiff-curved", 57.0},
                                                  {"lunderquist-double-curved", 86.0}};
  std::size_t curved = 0;
  for (const CatalogueWire& entry : catalogue().wires) {
    if (entry.wire.straight()) continue;
    ++curved;
    double angle = 0.0;
    for (const simulate::Section& section : entry.wire.sections) {
      angle += section.length * section.rest_curvature;
    }
    ASSERT_TRUE(expected.count(entry.wire.name)) << entry.wire.name;
    EXPECT_NEAR(angle / kRadPerDeg, expected.at(entry.wire.name), 0.6);  // radii of 2 digits
  }
  EXPECT_EQ(curved, expected.size());
}

TEST(Catalogue, SchemaNamesTheSameWires) {
  std::set<std::string> known, named;
  for (const CatalogueWire& entry : catalogue().wires) {
    known.insert(entry.wire.name);
    known.insert(entry.aliases.begin(), entry.aliases.end());
  }
  std::ifstream file(kSource / "pipeline" / "schemas" / "case.schema.json");
  const Json schema = Json::parse(file);
  for (const char* names :
       {"/properties/wires/items/oneOf/0/enum", "/properties/wires/items/oneOf/2/enum"}) {
    for (const Json& name : schema.at(Json::json_pointer(names))) {
      named.insert(name.get<std::string>());
    }
  }
  EXPECT_EQ(known, named);
}

TEST(TipLoad, BendsTheLastTenMillimetresByTwo) {
  EXPECT_NEAR(stiffness_of_tip_load(1.0), 1.567, 5e-4);
  for (const double grams : {0.7, 8.0, 30.0}) {
    const double EI = stiffness_of_tip_load(grams);
    const analytic::Cantilever bent = analytic::bend_cantilever(
        10.0, [&](double) { return EI; }, 9.80665e-3 * grams, 0.0, 1000);
    EXPECT_NEAR(bent.drop, 2.0, 1e-4);
  }
}

// ---- the wires of a case ----------------------------------------------------------------------

TEST_F(CaseFile, FrictionOfTheCaseIsThatOfWiresWithoutTheirOwn) {
  Json json = volume_case();
  Json own = own_wire();
  own.erase("friction");
  own.erase("coating");
  json["wires"] = {own, "amplatz", "glidewire"};
  json["friction"] = 0.3;
  const Case given = read(json);
  const simulate::InsertionOptions& insertion = given.study.insertion;
  const auto friction = [&](std::size_t k) { return friction_of(given.study.wires[k], insertion); };
  EXPECT_EQ(friction(0), 0.3);
  EXPECT_EQ(friction(1), 0.12);  // PTFE
  EXPECT_EQ(friction(2), 0.04);  // hydrophilic
  const std::vector<std::string> told = tell_friction(given.devices, insertion);
  ASSERT_EQ(told.size(), 3u);
  EXPECT_EQ(told[0], "friction of mine: 0.3, the case's, since the wire states none");
  EXPECT_EQ(told[1], "friction of amplatz: 0.12, its own (ptfe)");
  EXPECT_TRUE(warn_of_friction(given.devices, insertion).empty());

  // It acts on no wire: told, and how to change them all.
  json["wires"] = {"amplatz", "glidewire"};
  const Case without = read(json);
  const auto warnings = warn_of_friction(without.devices, without.study.insertion);
  ASSERT_EQ(warnings.size(), 1u);
  expect_mentions(warnings[0], {"friction 0.3 acts on no wire", "friction_factor"});
  const Case smooth = read(volume_case(), {"friction_factor=0"});
  EXPECT_EQ(friction_of(smooth.study.wires[0], smooth.study.insertion), 0.0);
  const auto frictionless = warn_of_friction(smooth.devices, smooth.study.insertion);
  ASSERT_EQ(frictionless.size(), 1u);
  expect_mentions(frictionless[0], {"frictionless", "lower bounds"});
  // A wire that states its own keeps it, whatever its coating.
  own["coating"] = "hydrophilic";
  own["friction"] = 0.07;
  json["wires"] = Json::array({own});
  EXPECT_EQ(read(json).study.wires[0].friction, 0.07);
  own.erase("friction");
  json["wires"] = Json::array({own});
  EXPECT_EQ(read(json).study.wires[0].friction, 0.04);
}

/// A case with a wire of these sections.
Json with_sections(const Json& sections) {
  Json json = surface_case(), wire = own_wire();
  wire["sections"] = sections;
  json["wires"] = Json::array({wire});
  return json;
}

TEST_F(CaseFile, EIOfASectionHasSeveralForms) {
  const Json shaft = {{"length_mm", 1400}, {"flexural_modulus_gpa", 17}};
  const double I = kPi * std::pow(0.889, 4) / 64.0;
  const Case given = read(with_sections(
      {{{"length_mm", 30}, {"tip_load_gf", 8}}, {{"length_mm", 70}, {"taper", "cone"}}, shaft}));
  const std::vector<simulate::Section>& sections = given.study.wires[0].sections;
  EXPECT_NEAR(sections[0].bending_stiffness, 8 * 1.567, 0.01);
  EXPECT_FALSE(sections[0].tapered());
  EXPECT_EQ(sections[1].bending_stiffness, sections[0].bending_stiffness);
  EXPECT_EQ(sections[1].proximal_bending_stiffness, sections[2].bending_stiffness);
  EXPECT_EQ(sections[1].taper, simulate::Taper::kCone);
  EXPECT_NEAR(sections[2].bending_stiffness, 17000.0 * I, 1e-9);

  const Case linear =
      read(with_sections({{{"length_mm", 60}, {"bending_stiffness_n_mm2", {3, 521}}}, shaft}));
  const simulate::Section& taper = linear.study.wires[0].sections[0];
  EXPECT_EQ(taper.bending_stiffness, 3.0);
  EXPECT_EQ(taper.proximal_bending_stiffness, 521.0);
  EXPECT_EQ(taper.taper, simulate::Taper::kLinear);
  // As the report writes its parameters, it is the same wire.
  const Case again = read(case_parameters(linear));
  EXPECT_EQ(wire_json(again.study.wires[0]), wire_json(linear.study.wires[0]));
}

TEST_F(CaseFile, WhatCannotBeEIOfASectionIsToldWithItsRemedy) {
  const Json shaft = {{"length_mm", 1400}, {"bending_stiffness_n_mm2", 521}};
  const auto told = [&](const Json& sections) { return problem(with_sections(sections)); };
  expect_mentions(told({{{"length_mm", 30}}, shaft}),
                  {"wires[0].sections[0].bending_stiffness_n_mm2 is missing"});
  expect_mentions(
      told({{{"length_mm", 30}, {"tip_load_gf", 1}, {"bending_stiffness_n_mm2", 2}}, shaft}),
      {"sections[0].tip_load_gf is given beside bending_stiffness_n_mm2", "one of them"});
  expect_mentions(told({{{"length_mm", 8}, {"tip_load_gf", 1}}, shaft}),
                  {"tip_load_gf is 1", "at least 10 mm"});
  expect_mentions(told({shaft, {{"length_mm", 30}, {"tip_load_gf", 1}}}),
                  {"sections[1].tip_load_gf is 1", "the first section's"});
  expect_mentions(told({{{"length_mm", 30}, {"taper", "cone"}}, shaft}),
                  {"sections[0].taper is given alone", "before it and one behind it"});
  expect_mentions(
      told({{{"length_mm", 30}, {"taper", "cone"}, {"bending_stiffness_n_mm2", 3}}, shaft}),
      {"sections[0].taper is given beside one EI"});
  expect_mentions(told({{{"length_mm", 30}, {"bending_stiffness_n_mm2", {3, 4, 5}}}, shaft}),
                  {"bending_stiffness_n_mm2 is [3,4,5]", "a number, or two"});
}

TEST_F(CaseFile, AValueMayTellItsSpreadSourceAndConfidence) {
  Json value = {
      {"value", 500}, {"spread", 25}, {"source", "own bench"}, {"confidence", "measured"}};
  const auto with_value = [&] {
    return with_sections(Json::array({{{"length_mm", 1500}, {"bending_stiffness_n_mm2", value}}}));
  };
  const Case given = read(with_value());
  EXPECT_EQ(given.study.wires[0].sections[0].bending_stiffness, 500.0);
  EXPECT_NEAR(given.devices[0].spread.stiffness[0][0].deviation, 0.05, 1e-12);
  EXPECT_EQ(given.devices[0].values.back().value.confidence, Confidence::kMeasured);
  value["spread"] = {{"low", 250}, {"high", 1000}};
  const plan::FactorSpread bounds = read(with_value()).devices[0].spread.stiffness[0][1];
  EXPECT_EQ(bounds.low, 0.5);
  EXPECT_EQ(bounds.high, 2.0);
  value["spread"] = nullptr;
  EXPECT_TRUE(read(with_value()).devices[0].spread.stiffness_known());

  const auto refused = [&](const char* key, const Json& wrong) {
    const Json good = value;
    if (wrong.is_discarded()) {
      value.erase(key);
    } else {
      value[key] = wrong;
    }
    const std::string told = problem(with_value());
    value = good;
    return told;
  };
  const Json none(Json::value_t::discarded);
  const std::string place = "wires[0].sections[0].bending_stiffness_n_mm2.";
  for (const char* key : {"value", "spread", "source", "confidence"}) {
    expect_mentions(refused(key, none), {place + key + " is missing"});
  }
  expect_mentions(refused("confidence", "sure"), {place + "confidence is \"sure\"", "measured"});
  expect_mentions(refused("spread", -1), {place + "spread is -1"});
  expect_mentions(refused("spread", "5 %"), {place + "spread is \"5 %\"", "null where no source"});
  expect_mentions(refused("spread", {{"low", 600}, {"high", 700}}),
                  {place + "spread.low is [600.0,700.0]", "between them"});
}

TEST_F(CaseFile, EarlierNamesOfTheCatalogueStillWork) {
  const Case given = read(volume_case(), {"wires=[\"heavy-duty\"]"});
  EXPECT_EQ(given.study.wires[0].name, "fixed-core-heavy-duty");
  ASSERT_EQ(given.told.size(), 1u);
  expect_mentions(given.told[0], {"wires[0]", "heavy-duty", "fixed-core-heavy-duty"});
}

}  // namespace
}  // namespace wireplan::pipeline
