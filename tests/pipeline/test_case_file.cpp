// Case files, scene files and the wire catalogue: what is read, in which units, and what is said
// about every mistake.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "pipeline/files/case_file.h"
#include "pipeline/files/catalogue.h"
#include "pipeline/files/scene_file.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = WIREPLAN_SOURCE_DIR;

/// A folder of its own for each test, with an empty image and surface that files can name.
class CaseFile : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ =
        fs::temp_directory_path() / ("wireplan-case-" + name + "-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    write("ct.nrrd", "");
    write("vessel.stl", "");
    write("vessel.vtp", "");
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }

  Case read(const Json& json, const std::vector<std::string>& overrides = {}) const {
    return read_case(write("case.json", json.dump()), overrides);
  }

  /// What read_case says; empty where it accepts.
  std::string problem(const Json& json, const std::vector<std::string>& overrides = {}) const {
    try {
      read(json, overrides);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  std::string scene_problem(const Json& json) const {
    try {
      read_scene(write("scene.json", json.dump()));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
};

Json volume_case() {
  return {{"schema", "wireplan.case/1"},
          {"volume", {{"path", "ct.nrrd"}}},
          {"segmentation", {{"lower_hu", 150}, {"upper_hu", 600}}},
          {"access", {{"point_mm", {1, 2, 3}}}},
          {"target", {{"point_mm", {1, 2, 100}}}},
          {"wires", {"amplatz"}}};
}

Json surface_case() {
  Json json = volume_case();
  json.erase("volume");
  json.erase("segmentation");
  json["surface"] = {{"path", "vessel.stl"}, {"unit", "mm"}, {"frame", "LPS"}};
  return json;
}

/// A wire of the user's own, with every key.
Json own_wire() {
  return {{"name", "mine"},
          {"title", "My wire"},
          {"source", "measured"},
          {"diameter_mm", 0.889},
          {"sections",
           {{{"length_mm", 3000},
             {"bending_stiffness_n_mm2", 5},
             {"axial_stiffness_n", 100},
             {"twist_stiffness_n_mm2", 4},
             {"mass_kg_per_m", 0.005},
             {"rest_radius_mm", 12},
             {"source", "measured"}}}}};
}

/// The case with every key that goes with its input.
Json full_case(Json json) {
  json["name"] = "full";
  if (json.contains("segmentation")) {
    json["segmentation"].update(Json{
        {"seeds_mm", Json::array({{1, 2, 3}})}, {"smoothing_mm", 0.8}, {"neck_opening_mm", 1.5}});
  }
  json["surface"]["edge_length_mm"] = 1.5;
  json["wall"] = {
      {"model", "rigid"}, {"thickness_mm", 2}, {"young_modulus_kpa", 56}, {"poisson_ratio", 0.4}};
  json["access"].update(Json{{"inclination_deg", {0, 15}}, {"azimuth_deg", {0, 90}}});
  json["target"]["radius_mm"] = 5;
  json["wires"] = {own_wire(), "amplatz"};
  json["tip_roll_deg"] = {0, 180};
  json["friction"] = 0.12;
  json["insertion"] = {{"length_mm", 250},
                       {"step_mm", 2},
                       {"element_length_mm", 0.5},
                       {"contact_spacing_mm", 2},
                       {"residual_tolerance_n", 1e-5},
                       {"max_iterations", 50},
                       {"record_every_mm", 10}};
  json["limits"] = {{"tip_force_warn_n", 0.2},
                    {"tip_force_fail_n", 1},
                    {"penetration_fail_mm", 0.5},
                    {"off_path_fail_mm", 20}};
  json["search"] = {{"exhaustive", true}};
  json["manoeuvres"] = "always";
  json["robustness"] = {
      {"repeats", 32},         {"plans", 3},     {"seed", 7},       {"friction_factor", {0.25, 4}},
      {"wall_factor", {1, 1}}, {"angle_deg", 3}, {"entry_mm", 0.5}, {"lumen_mm", 0.1}};
  json["ranking"]["weights"] = {{"reach", 2}, {"peak_force", 3}, {"mean_force", 0}, {"margin", 1}};
  return json;
}

void expect_mentions(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) {
    EXPECT_NE(text.find(part), std::string::npos) << "\"" << part << "\" is not in: " << text;
  }
}

TEST_F(CaseFile, GivesEveryMissingKeyItsDefault) {
  const Case input = read(volume_case());
  EXPECT_EQ(input.name, folder_.filename().string());
  EXPECT_EQ(input.volume->path, folder_ / "ct.nrrd");
  EXPECT_FALSE(input.surface_input);
  EXPECT_TRUE(input.segmentation.seeds.empty()) << "access and target are enough";
  EXPECT_FALSE(input.segmentation.smoothing_mm || input.segmentation.neck_opening_mm);
  EXPECT_EQ(input.study.inclinations.size(), 3u);
  EXPECT_EQ(input.study.azimuths.size(), 4u);
  EXPECT_EQ(input.study.insertion.length, 0.0) << "0: chosen from the path's length";
  EXPECT_TRUE(input.wall.elastic);
  EXPECT_EQ(input.wall.extrusion.young_modulus, 0.0) << "0: chosen by the wall stage";
  EXPECT_EQ(input.study.insertion.friction, 0.04) << "hydrophilic, references A3";
  ASSERT_EQ(input.study.wires.size(), 1u);
  EXPECT_EQ(input.study.wires[0].name, "amplatz");
}

TEST_F(CaseFile, ConvertsToInternalUnits) {
  const Case input = read(full_case(volume_case()));
  EXPECT_DOUBLE_EQ(input.wall.extrusion.young_modulus, 0.056);  // MPa
  EXPECT_DOUBLE_EQ(input.study.inclinations[1], kPi / 12.0);    // rad
  EXPECT_DOUBLE_EQ(input.study.azimuths[1], kPi / 2.0);
  EXPECT_DOUBLE_EQ(input.study.rolls[1], kPi);
  const simulate::Wire& wire = input.study.wires[0];
  EXPECT_DOUBLE_EQ(wire.radius, 0.4445);                     // mm
  EXPECT_DOUBLE_EQ(wire.sections[0].mass_per_length, 5e-9);  // t/mm
  EXPECT_DOUBLE_EQ(wire.sections[0].rest_curvature, 1.0 / 12.0);
}

TEST_F(CaseFile, ReadsAFolderThroughItsCaseJson) {
  read(volume_case());
  EXPECT_EQ(read_case(folder_).file, folder_ / "case.json");
  fs::remove(folder_ / "case.json");
  EXPECT_THROW(read_case(folder_), Error);
}

TEST_F(CaseFile, ParametersReadBackAsTheSameCase) {
  for (const Json& json : {full_case(volume_case()), full_case(surface_case())}) {
    const Json parameters = case_parameters(read(json));
    EXPECT_EQ(parameters, case_parameters(read(parameters)));
  }
}

TEST_F(CaseFile, NamesEachMistakeWithItsRemedy) {
  struct Mistake {
    std::string set;
    std::vector<std::string> told;
  };
  const Json wire = own_wire();
  const auto wires_with = [&](const std::string& pointer, const Json& value) {
    Json changed = wire;
    changed[Json::json_pointer(pointer)] = value;
    return "wires=" + Json::array({changed}).dump();
  };
  const std::vector<Mistake> mistakes = {
      {"volume.path=none.nrrd", {"volume.path is \"none.nrrd\"", (folder_ / "none.nrrd").string()}},
      {"volume.path=${HOME}/ct.nrrd", {"WIREPLAN_DATA} is the only variable"}},
      {"segmentation.lowr_hu=1", {"segmentation.lowr_hu is not a known key", "\"lower_hu\""}},
      {"wal.thickness_mm=2", {"wal is not a known key", "\"wall\""}},
      {wires_with("/diameter_m", 0.000889),
       {"wires[0].diameter_m is not a known key", "\"diameter_mm\""}},
      {wires_with("/diameter_mm", 0.000889),
       {"wires[0].diameter_mm is 0.000889", "from 0.1 to 3", "given in m"}},
      {wires_with("/sections/0/bending_stiffness_n_mm2", -5),
       {"wires[0].sections[0].bending_stiffness_n_mm2 is -5", "from 0.01 to 1e+07"}},
      {wires_with("/sections", Json::array()), {"wires[0].sections is []"}},
      {"wires=[]", {"wires is []", "at least one"}},
      {"wires=[\"amplatz-stif\"]",
       {"wires[0] is \"amplatz-stif\"", "did you mean \"amplatz-stiff\""}},
      {"wires=[\"hose\"]", {"lunderquist-extra-stiff", "a wire of your own"}},
      {"wires=[\"amplatz\", \"amplatz\"]", {"wires[1] is \"amplatz\" again"}},
      {"wires=[3]", {"wires[0] is 3, expected an object"}},
      {"access.point_mm=[1, 2]", {"access.point_mm is [1,2]", "three numbers [x, y, z]"}},
      {"access.inclination_deg=[0, 95]", {"access.inclination_deg[1] is 95", "from 0 to 80"}},
      {"access.inclination_deg=15", {"access.inclination_deg is 15", "a list"}},
      {"target.point_mm=[1, 2, 4]", {"target.point_mm is [1.0,2.0,4.0]", "further than"}},
      {"target=3", {"target is 3, expected an object"}},
      {"segmentation.lower_hu=700", {"segmentation.lower_hu is 700", "less than", "600"}},
      {"segmentation.lower_hu=high", {"segmentation.lower_hu is \"high\", expected a number"}},
      {"segmentation.seeds_mm=[[1, 2, 3], 7]", {"segmentation.seeds_mm[1] is 7"}},
      {"surface.path=vessel.stl", {"surface.path is given beside volume"}},
      {"wall.thickness_mm=0.001", {"wall.thickness_mm is 0.001", "given in m?"}},
      {"wall.model=stiff", {"wall.model is \"stiff\"", "\"elastic\"", "\"rigid\""}},
      {"friction=4", {"friction is 4", "from 0", "0.04 hydrophilic"}},
      {"robustness.repeats=1.5", {"robustness.repeats is 1.5", "a whole number"}},
      {"robustness.wall_factor=[2, 0.5]",
       {"robustness.wall_factor is [2.0,0.5]", "two factors, the smaller one first"}},
      {"robustness.wall_factor=[1]", {"robustness.wall_factor is [1.0]", "two factors"}},
      {"robustness.friction_factor=[0, 2]", {"robustness.friction_factor[0] is 0"}},
      {"robustness.angle_deg=90", {"robustness.angle_deg is 90", "from 0 to 45"}},
      {"insertion.length_mm=2000", {"insertion.length_mm is 2000", "\"amplatz\" has 1500"}},
      {"insertion.length_mm=0.25", {"insertion.length_mm is 0.25", "0 or at least 1", "in m?"}},
      {"limits.tip_force_warn_n=2", {"limits.tip_force_warn_n is 2", "at most"}},
      {"ranking.weights={\"reach\": 0, \"peak_force\": 0, \"mean_force\": 0, \"margin\": 0}",
       {"ranking.weights is 0 in all"}},
      {"name=../x", {"name is \"../x\"", "letters"}},
  };
  for (const Mistake& mistake : mistakes) {
    SCOPED_TRACE(mistake.set);
    const std::string told = problem(volume_case(), {mistake.set});
    expect_mentions(told, mistake.told);
    expect_mentions(told, {(folder_ / "case.json").string() + ": "});
    EXPECT_EQ(told.find('\n'), std::string::npos) << "one mistake, one message: " << told;
  }
}

TEST_F(CaseFile, TellsAllMistakesAtOnce) {
  const std::string told =
      problem(volume_case(), {"wires=[]", "access.point_mm=[1, 2]", "surfce.edge_length_mm=1"});
  expect_mentions(told, {"wires is []", "access.point_mm is [1,2]", "surfce is not a known key"});
}

TEST_F(CaseFile, NeedsExactlyOneInput) {
  Json json = volume_case();
  json.erase("volume");
  json.erase("segmentation");
  expect_mentions(problem(json), {"volume is missing", "surface.path"});
  json = surface_case();
  json["segmentation"] = {{"lower_hu", 100}, {"upper_hu", 200}};
  expect_mentions(problem(json), {"segmentation is given with a surface as input"});
}

TEST_F(CaseFile, TakesNoBandOrBothEndsOfOne) {
  Json json = volume_case();
  json.erase("segmentation");
  const Case input = read(json);
  EXPECT_FALSE(input.segmentation.lower_hu || input.segmentation.upper_hu);
  EXPECT_TRUE(case_parameters(input).at("segmentation").at("lower_hu").is_null());
  json["segmentation"] = {{"lower_hu", 100}};
  expect_mentions(problem(json), {"segmentation.upper_hu is missing", "both ends", "or none"});
}

TEST_F(CaseFile, AsksForUnitAndFrameWhereTheFileHasNone) {
  Json json = surface_case();
  json["surface"].erase("unit");
  json["surface"].erase("frame");
  expect_mentions(problem(json), {"surface.unit is missing", "\"mm\", \"cm\", \"m\"",
                                  "surface.frame is missing", "\"LPS\", \"RAS\""});
  json["surface"]["path"] = "vessel.vtp";
  const Case input = read(json);
  EXPECT_EQ(input.surface_input->unit, "mm");
  EXPECT_EQ(input.surface_input->frame, "LPS");
  expect_mentions(problem(json, {"surface.path=ct.nrrd"}), {"ends in .stl, .ply, .obj or .vtp"});
}

TEST_F(CaseFile, TellsWhereBrokenJsonBreaks) {
  const auto told = [&](const std::string& text) -> std::string {
    try {
      read_case(write("case.json", text));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  expect_mentions(told("{\n  \"schema\": \"wireplan.case/1\",\n  \"name\": "),
                  {"case.json: broken JSON at line 3, column 11", "cut short"});
  expect_mentions(told("{\"schema\": \"wireplan.case/1\",}"), {"line 1, column 30"});
  expect_mentions(told(""), {"broken JSON at line 1, column 1"});
  expect_mentions(told("[1]"), {"expected a JSON object"});
  expect_mentions(told(std::string(100000, '[')), {"nested deeper"});
  expect_mentions(told("{\"schema\": \"wireplan.case/1\", \"target\": {\"a\": 1, \"a\": 2}}"),
                  {"target.a is given twice"});
  expect_mentions(told("{\"name\": \"x\"}"), {"schema is missing", "\"wireplan.case/1\""});
  expect_mentions(told("{\"schema\": \"wireplan.case/9\"}"),
                  {"schema is \"wireplan.case/9\"", "\"wireplan.case/1\""});
  fs::remove(folder_ / "case.json");
  EXPECT_THROW(read_case(folder_ / "case.json"), Error);
}

TEST_F(CaseFile, EveryCutOfACaseIsAnErrorAndNothingElse) {
  const std::string text = full_case(volume_case()).dump();
  for (std::size_t length = 0; length < text.size(); length += 23) {
    EXPECT_THROW(read_case(write("case.json", text.substr(0, length))), Error) << length;
  }
}

TEST_F(CaseFile, OverridesTakeJsonAndElseText) {
  const Case input =
      read(volume_case(), {"wall.thickness_mm=2.5", "name=over ride", "wires=[\"amplatz-stiff\"]",
                           "limits.tip_force_fail_n=1"});
  EXPECT_EQ(input.wall.extrusion.thickness_mm, 2.5);
  EXPECT_EQ(input.name, "over ride");
  EXPECT_EQ(input.study.wires[0].name, "amplatz-stiff");
  EXPECT_EQ(input.limits.tip_force_fail, 1.0);
  expect_mentions(problem(volume_case(), {"wall.thicknes_mm=2"}),
                  {"wall.thicknes_mm is not a known key", "\"thickness_mm\""});
  expect_mentions(problem(volume_case(), {"thickness"}), {"--set thickness: expected key=value"});
  expect_mentions(problem(volume_case(), {"schema.x=1"}), {"schema is no object"});
}

TEST_F(CaseFile, DataFolderComesFromTheEnvironmentElseBesideTheCheckout) {
  const char* before = std::getenv("WIREPLAN_DATA");
  const std::string kept = before == nullptr ? "" : before;
  ::setenv("WIREPLAN_DATA", folder_.c_str(), 1);
  EXPECT_EQ(read(volume_case(), {"volume.path=${WIREPLAN_DATA}/ct.nrrd"}).volume->path,
            folder_ / "ct.nrrd");
  EXPECT_EQ(case_parameters(read(volume_case(), {"volume.path=${WIREPLAN_DATA}/ct.nrrd"}))
                .at("volume")
                .at("path"),
            "${WIREPLAN_DATA}/ct.nrrd")
      << "a report names no folder of this machine";
  ::unsetenv("WIREPLAN_DATA");
  EXPECT_EQ(resolve_path("${WIREPLAN_DATA}/x", folder_),
            kSource.parent_path() / "shared" / "data" / "x");
  expect_mentions(problem(volume_case(), {"volume.path=${WIREPLAN_DATA}/none.nrrd"}),
                  {"WIREPLAN_DATA is not set", "../shared/data beside the checkout"});
  if (before != nullptr) ::setenv("WIREPLAN_DATA", kept.c_str(), 1);
}

// ---- the schema against the code --------------------------------------------------------------

/// Walks a JSON Schema along with a case that has its keys, and holds both against read_case.
class SchemaWalk {
 public:
  using Problem = std::function<std::string(const Json&)>;
  SchemaWalk(const Json& schema, Json instance, Problem problem)
      : schema_(schema), instance_(std::move(instance)), problem_(std::move(problem)) {}

  void visit(const Json& given, const std::string& pointer, const std::string& key) {
    const Json& schema = resolved(given);
    if (schema.contains("properties")) visit_object(schema, pointer, key);
    if (schema.contains("items")) {
      const Json& items = schema.at("items");
      visit(items.contains("oneOf") ? items.at("oneOf").at(1) : items, pointer + "/0", key + "[0]");
    }
    const bool integer = schema.value("type", "") == "integer";
    const double slip = integer ? 1.0 : 1e-9;
    if (schema.contains("minimum")) check_limit(pointer, key, schema.at("minimum"), -slip, true);
    if (schema.contains("maximum")) check_limit(pointer, key, schema.at("maximum"), slip, true);
    if (schema.contains("exclusiveMinimum")) {
      check_limit(pointer, key, schema.at("exclusiveMinimum"), 0.0, false);
    }
  }
  std::set<std::string> visited;
  int limits = 0;

 private:
  const Json& resolved(const Json& schema) const {
    if (!schema.contains("$ref")) return schema;
    return schema_.at(Json::json_pointer(schema.at("$ref").get<std::string>().substr(1)));
  }

  void visit_object(const Json& schema, const std::string& pointer, const std::string& key) {
    for (const auto& [name, property] : schema.at("properties").items()) {
      const std::string inner = pointer + "/" + name;
      if (!instance_.contains(Json::json_pointer(inner))) continue;
      visited.insert(inner);
      visit(property, inner, key.empty() ? name : key + "." + name);
    }
    for (const Json& name : schema.value("required", Json::array())) {
      Json changed = instance_;
      changed.at(Json::json_pointer(pointer)).erase(name.get<std::string>());
      const std::string lost =
          key.empty() ? name.get<std::string>() : key + "." + name.get<std::string>();
      expect_mentions(problem_(changed), {lost + " is missing"});
    }
    Json changed = instance_;
    changed[Json::json_pointer(pointer + "/extra_key")] = 1;
    expect_mentions(problem_(changed), {"extra_key is not a known key"});
  }

  /// At the limit the value itself is accepted, beyond it refused. (Other keys may still disagree
  /// with it.)
  void check_limit(const std::string& pointer, const std::string& key, double limit, double slip,
                   bool inclusive) {
    SCOPED_TRACE(key + " at " + std::to_string(limit));
    Json changed = instance_;
    const double scale = std::max(1.0, std::abs(limit));
    changed[Json::json_pointer(pointer)] = limit + slip * scale;
    expect_mentions(problem_(changed), {key + " is ", "expected a "});
    ++limits;
    if (!inclusive) return;
    changed[Json::json_pointer(pointer)] = limit;
    EXPECT_EQ(problem_(changed).find("number"), std::string::npos) << problem_(changed);
  }

  const Json& schema_;
  Json instance_;
  Problem problem_;
};

Json read_schema(const std::string& name) {
  std::ifstream file(kSource / "pipeline" / "schemas" / name);
  return Json::parse(file);
}

/// Pointers of all properties that a schema knows.
void list_properties(const Json& schema, const Json& node, const std::string& pointer,
                     std::set<std::string>& found) {
  if (node.contains("$ref")) {
    const std::string target = node.at("$ref").get<std::string>().substr(1);
    list_properties(schema, schema.at(Json::json_pointer(target)), pointer, found);
  }
  if (node.contains("properties")) {
    for (const auto& [name, property] : node.at("properties").items()) {
      found.insert(pointer + "/" + name);
      list_properties(schema, property, pointer + "/" + name, found);
    }
  }
  if (!node.contains("items")) return;
  const Json& items = node.at("items");
  list_properties(schema, items.contains("oneOf") ? items.at("oneOf").at(1) : items, pointer + "/0",
                  found);
}

TEST_F(CaseFile, CodeAndSchemaAgreeOnKeysLimitsAndRequirements) {
  const Json schema = read_schema("case.schema.json");
  const auto told = [this](const Json& json) { return problem(json); };
  SchemaWalk of_volume(schema, full_case(volume_case()), told);
  SchemaWalk of_surface(schema, full_case(surface_case()), told);
  of_volume.visit(schema, "", "");
  of_surface.visit(schema, "", "");
  EXPECT_GE(of_volume.limits, 50) << "limits held against the code";

  // Nothing of the schema was passed over.
  std::set<std::string> known, visited = of_volume.visited;
  list_properties(schema, schema, "", known);
  visited.insert(of_surface.visited.begin(), of_surface.visited.end());
  EXPECT_EQ(known, visited);
}

/// Defaults of the schema's properties against the parameters of a case that gives none.
void expect_defaults(const Json& schema, const Json& used, const std::string& key, int& count) {
  for (const auto& [name, property] : schema.at("properties").items()) {
    SCOPED_TRACE(key + name);
    if (property.contains("default")) {
      ASSERT_TRUE(used.contains(name));
      EXPECT_EQ(property.at("default"), used.at(name));
      ++count;
    }
    if (property.contains("properties") && used.contains(name)) {
      expect_defaults(property, used.at(name), key + name + ".", count);
    }
  }
}

TEST_F(CaseFile, CodeAndSchemaAgreeOnDefaults) {
  int count = 0;
  expect_defaults(read_schema("case.schema.json"), case_parameters(read(volume_case())), "", count);
  EXPECT_GE(count, 25);
}

TEST(CaseFiles, OfTheRepositoryFollowTheirSchemas) { expect_follows_schemas(kSource / "cases"); }

TEST(CaseFiles, OfTheRepositoryAreAccepted) {
  int read = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(kSource / "cases")) {
    if (!fs::exists(entry.path() / "case.json")) continue;
    SCOPED_TRACE(entry.path().filename().string());
    try {
      read_case(entry.path());
    } catch (const Error& error) {
      // Inputs that are made or fetched may be absent; nothing else may be wrong.
      const std::string told = error.what();
      EXPECT_EQ(told.find('\n'), std::string::npos) << told;
      EXPECT_NE(told.find("path is"), std::string::npos) << told;
    }
    ++read;
  }
  EXPECT_GE(read, 3);
}

// ---- the catalogue ----------------------------------------------------------------------------

TEST(Catalogue, EveryWireIsPhysicalAndHasItsSource) {
  const std::vector<CatalogueWire> wires = catalogue();
  ASSERT_GE(wires.size(), 10u);
  std::set<std::string> names;
  double diameter = std::numeric_limits<double>::infinity();
  for (const CatalogueWire& entry : wires) {
    SCOPED_TRACE(entry.wire.name);
    EXPECT_TRUE(names.insert(entry.wire.name).second);
    EXPECT_GE(entry.wire.length(), 900.0) << "long enough for insertions of 600 mm";
    EXPECT_LE(2.0 * entry.wire.radius, diameter) << "listed by falling diameter";
    diameter = 2.0 * entry.wire.radius;
    EXPECT_TRUE(diameter == 0.889 || diameter == 0.457 || diameter == 0.356);
    EXPECT_NE(entry.source, "the case file");
    ASSERT_EQ(entry.section_sources.size(), entry.wire.sections.size());
    double stiffness = 0.0;
    for (std::size_t i = 0; i < entry.wire.sections.size(); ++i) {
      EXPECT_NE(entry.section_sources[i], entry.source) << "a source of its own";
      EXPECT_GE(entry.wire.sections[i].bending_stiffness, stiffness) << "stiffer toward the shaft";
      stiffness = entry.wire.sections[i].bending_stiffness;

      // Between the mass of nitinol and of steel filling the whole cross section, 2 % for rounding.
      const double area = kPi * entry.wire.radius * entry.wire.radius;
      EXPECT_GE(entry.wire.sections[i].mass_per_length, 0.98 * 6.45e-9 * area);
      EXPECT_LE(entry.wire.sections[i].mass_per_length, 1.02 * 7.9e-9 * area);
    }
  }
}

TEST(Catalogue, ShaftStiffnessIsThatOfTheMeasuredModulus) {
  // Flexural moduli of Harrison et al. 2011 [MPa], times I = pi d^4 / 64; rounded to 1 N mm^2.
  const std::vector<std::pair<std::string, double>> moduli = {{"amplatz", 9500},
                                                              {"amplatz-stiff", 17000},
                                                              {"amplatz-extra-stiff", 29200},
                                                              {"amplatz-super-stiff", 60300},
                                                              {"amplatz-ultra-stiff", 65400},
                                                              {"meier-backup", 139600},
                                                              {"lunderquist-extra-stiff", 158400}};
  const double I = kPi * std::pow(0.889, 4) / 64.0;
  int found = 0;
  for (const CatalogueWire& entry : catalogue()) {
    for (const auto& [name, modulus] : moduli) {
      if (entry.wire.name != name) continue;
      EXPECT_NEAR(entry.wire.sections.back().bending_stiffness, modulus * I, 1.0) << name;
      ++found;
    }
  }
  EXPECT_EQ(found, 7);
}

TEST(Catalogue, CurvedTipsTurnByTheAngleThatTheyAreNamedFor) {
  const std::map<std::string, double> expected = {
      {"glidewire-angled", 45.0},           {"amplatz-stiff-angled", 86.0},
      {"amplatz-super-stiff-angled", 86.0}, {"amplatz-stiff-hook", 115.0},
      {"amplatz-super-stiff-hook", 115.0},  {"amplatz-super-stiff-curved", 57.0}};
  std::size_t curved = 0;
  for (const CatalogueWire& entry : catalogue()) {
    if (entry.wire.straight()) continue;
    ++curved;
    double angle = 0.0;
    for (const simulate::Section& section : entry.wire.sections) {
      angle += section.length * section.rest_curvature;
    }
    ASSERT_TRUE(expected.count(entry.wire.name)) << entry.wire.name;
    EXPECT_NEAR(angle / kRadPerDeg, expected.at(entry.wire.name), 0.5);  // radii of 2 digits
  }
  EXPECT_EQ(curved, expected.size());
}

TEST(Catalogue, SchemaNamesTheSameWires) {
  std::set<std::string> known, named;
  for (const CatalogueWire& entry : catalogue()) known.insert(entry.wire.name);
  const Json schema = read_schema("case.schema.json");
  for (const Json& name : schema.at("/properties/wires/items/oneOf/0/enum"_json_pointer)) {
    named.insert(name.get<std::string>());
  }
  EXPECT_EQ(known, named);
}

// ---- scenes -----------------------------------------------------------------------------------

Json cantilever() {
  std::ifstream file(kSource / "cases" / "cantilever" / "scene.json");
  return Json::parse(file);
}

Json motion(const std::string& method) {
  Json json = cantilever();
  json["solver"] = {{"method", method}, {"residual_tolerance_n", 1e-6}};
  return json;
}

Json decoupled() {
  Json json = cantilever();
  json["wire"]["twist"] = "decoupled";
  json["loads"]["tip_torque_n_mm"] = 0.01;
  return json;
}

Json strip() {
  Json json = cantilever();
  Json& section = json["wire"]["sections"][0];
  section["bending_stiffness_n_mm2"] = 2.0;
  section["bending_stiffness_2_n_mm2"] = 50.0;
  section["twist_stiffness_n_mm2"] = 1.0;
  json["loads"] = {{"tip_force_n", {0, 1e-4, 0}}};
  return json;
}

Json pushed_wire() {
  Json json = cantilever();
  json.erase("supports");
  json.erase("loads");
  json["vessel"] = {{"surface", {{"path", "vessel.stl"}, {"unit", "mm"}, {"frame", "LPS"}}},
                    {"wall", {{"model", "rigid"}}},
                    {"friction", 0}};
  json["insertion"] = {{"point_mm", {0, 0, 0}},
                       {"direction", {0, 0, 2}},
                       {"length_mm", 30},
                       {"step_mm", 0.5},
                       {"roll_deg", 90}};
  return json;
}

TEST_F(CaseFile, CantileverOfThePaperIsReadInInternalUnits) {
  const SceneFile file = read_scene(kSource / "cases" / "cantilever" / "scene.json");
  ASSERT_TRUE(file.bench);
  EXPECT_FALSE(file.insertion);
  const simulate::Scene& scene = *file.bench;
  EXPECT_EQ(scene.elements, 20);
  EXPECT_EQ(scene.wire.radius, 0.4);
  ASSERT_EQ(scene.wire.sections.size(), 1u);
  EXPECT_EQ(scene.wire.sections[0].bending_stiffness, 0.8);
  EXPECT_EQ(scene.wire.sections[0].axial_stiffness, 160.0);
  EXPECT_DOUBLE_EQ(scene.wire.sections[0].mass_per_length, 1e-7);  // 0.1 kg/m in t/mm
  EXPECT_EQ(scene.loads.gravity, Vec3(0, -9810, 0));               // mm/s^2
  ASSERT_EQ(scene.supports.size(), 1u);
  EXPECT_EQ(scene.supports[0].kind, simulate::SupportKind::kClamped);
  EXPECT_EQ(scene.supports[0].direction, Vec3(1, 0, 0));
}

TEST_F(CaseFile, PaperCoefficientsGiveTheSameWire) {
  // k_s = EA / (2 h^3) and k_b = EI / h^3 for h = 2 mm: EA = 160 N, EI = 0.8 N mm^2.
  EXPECT_NEAR(axial_stiffness_from_paper(1e10, 2.0), 160.0, 1e-12 * 160.0);
  EXPECT_NEAR(bending_stiffness_from_paper(100.0, 2.0), 0.8, 1e-12);
  Json json = cantilever();
  Json& section = json["wire"]["sections"][0];
  section.erase("axial_stiffness_n");
  section.erase("bending_stiffness_n_mm2");
  section["stretch_coefficient_n_per_m3"] = 1e10;
  section["bend_coefficient_n_per_m"] = 100;
  const SceneFile file = read_scene(write("scene.json", json.dump()));
  EXPECT_NEAR(file.bench->wire.sections[0].axial_stiffness, 160.0, 1e-12 * 160.0);
  EXPECT_NEAR(file.bench->wire.sections[0].bending_stiffness, 0.8, 1e-12);
}

TEST_F(CaseFile, PaperCoefficientsOfASectionAreThoseOfItsOwnElements) {
  // 10 mm of tip in 5 edges of 2 mm, asked for as 2.4; 30 mm of shaft in 30 edges of 1 mm.
  Json json = cantilever();
  json["wire"]["elements"] = 40;
  Json tip = json["wire"]["sections"][0], shaft = tip;
  tip["length_mm"] = 10;
  tip["element_length_mm"] = 2.4;
  tip.erase("bending_stiffness_n_mm2");
  tip["bend_coefficient_n_per_m"] = 100;
  shaft["length_mm"] = 30;
  shaft.erase("axial_stiffness_n");
  shaft["stretch_coefficient_n_per_m3"] = 8e10;
  json["wire"]["sections"] = {tip, shaft};
  const simulate::Scene scene = *read_scene(write("scene.json", json.dump())).bench;
  EXPECT_NEAR(scene.wire.sections[0].bending_stiffness, 0.8, 1e-12);
  EXPECT_NEAR(scene.wire.sections[1].axial_stiffness, 160.0, 1e-10);
  const Eigen::VectorXd lengths = simulate::edge_lengths(scene);
  ASSERT_EQ(lengths.size(), 35);
  EXPECT_DOUBLE_EQ(lengths[0], 1.0);
  EXPECT_DOUBLE_EQ(lengths[34], 2.0);

  // With a length in every section the number of elements is not asked for.
  json["wire"].erase("elements");
  expect_mentions(scene_problem(json), {"wire.elements is missing"});
  json["wire"]["sections"][1]["element_length_mm"] = 1;
  EXPECT_EQ(scene_problem(json), "");
  json["wire"]["sections"][1]["element_length_mm"] = 0.001;
  expect_mentions(scene_problem(json), {"wire.sections is of", "2 to 20000"});
}

TEST_F(CaseFile, MethodsTwistAndTableOfABenchAreRead) {
  Json json = motion("semi_implicit");
  json["solver"].update(
      {{"time_step_s", 2e-5}, {"duration_s", 0.5}, {"damping_per_s", 20}, {"max_iterations", 7}});
  json["supports"][0]["roll_deg"] = 9720;  // 27 turns
  simulate::Scene scene = *read_scene(write("scene.json", json.dump())).bench;
  EXPECT_EQ(scene.solver.method, simulate::Method::kSemiImplicitEuler);
  EXPECT_EQ(scene.solver.time_step, 2e-5);
  EXPECT_EQ(scene.solver.duration, 0.5);
  EXPECT_EQ(scene.solver.damping, 20.0);
  EXPECT_NEAR(scene.supports[0].roll, 54.0 * kPi, 1e-10);
  EXPECT_EQ(scene.twist, simulate::Twist::kAuto);
  EXPECT_FALSE(scene.plane);
  const std::map<std::string, simulate::Method> methods = {
      {"newton", simulate::Method::kNewton},
      {"conjugate_gradient", simulate::Method::kConjugateGradient},
      {"explicit", simulate::Method::kExplicitEuler}};
  for (const auto& [name, method] : methods) {
    EXPECT_EQ(read_scene(write("scene.json", motion(name).dump())).bench->solver.method, method);
  }

  scene = *read_scene(write("scene.json", decoupled().dump())).bench;
  EXPECT_EQ(scene.twist, simulate::Twist::kDecoupled);
  EXPECT_EQ(scene.loads.tip_torque, 0.01);
  json = cantilever();
  json["wire"]["twist"] = "coupled";
  json["loads"]["tip_moment_n_mm"] = {0, 0, 2};
  json["plane_normal"] = {0, 0, 3};
  scene = *read_scene(write("scene.json", json.dump())).bench;
  EXPECT_EQ(scene.twist, simulate::Twist::kCoupled);
  EXPECT_EQ(scene.loads.tip_moment, Vec3(0, 0, 2));
  ASSERT_TRUE(scene.plane);
  EXPECT_EQ(*scene.plane, Vec3(0, 0, 1));
}

TEST_F(CaseFile, StripsBendAsTheyLie) {
  const simulate::Scene scene = *read_scene(write("scene.json", strip().dump())).bench;
  EXPECT_EQ(scene.wire.sections[0].bending_stiffness_2, 50.0);
  EXPECT_EQ(scene.twist, simulate::Twist::kAuto);
  // F L^3 / 3 EI of the stiffness across the force, which a quarter turn of the support swaps.
  std::vector<double> deflections;
  for (const double roll : {0.0, 90.0}) {
    Json json = strip();
    json["supports"][0]["roll_deg"] = roll;
    const simulate::SceneResult result =
        run_scene(*read_scene(write("scene.json", json.dump())).bench);
    EXPECT_EQ(result.terms,
              (std::vector<std::string>{"stretch", "bend", "twist", "strip", "tip_force"}));
    deflections.push_back(result.nodes(1, result.nodes.cols() - 1));
  }
  const double of_one = 1e-4 * 40.0 * 40.0 * 40.0 / 3.0;  // EI 1 N mm^2                    [mm]
  std::sort(deflections.begin(), deflections.end());
  EXPECT_NEAR(deflections[0], of_one / 50.0, 0.01 * of_one / 50.0);
  EXPECT_NEAR(deflections[1], of_one / 2.0, 0.01 * of_one / 2.0);
}

TEST_F(CaseFile, ResultsOfBenchesFromFileToFile) {
  // Newton: no time steps. Explicit Euler: unstable, with its limit. Decoupled: rolls.
  const auto result_of = [this](const Json& json) {
    const SceneFile file = read_scene(write("scene.json", json.dump()));
    write_json(result_json(simulate::run_scene(*file.bench), {}), folder_ / "result.json");
    return read_json(folder_ / "result.json", "wireplan.result/1");
  };
  const Json newton = result_of(cantilever());
  EXPECT_EQ(newton.at("outcome"), "converged");
  EXPECT_TRUE(newton.at("critical_time_step_s").is_null());
  EXPECT_TRUE(newton.at("critical_time_step_s_reason").is_string());
  EXPECT_EQ(newton.at("simulated_time_s"), 0.0);
  Json json = motion("explicit");
  json["solver"]["damping_per_s"] = 2000;
  const Json unstable = result_of(json);
  EXPECT_EQ(unstable.at("outcome"), "unstable");
  EXPECT_NEAR(unstable.at("critical_time_step_s").get<double>(), 1.25e-6, 0.01e-6);
  EXPECT_TRUE(unstable.at("reason").is_string());
  EXPECT_EQ(unstable.at("nodes_mm").size(), 21u);
  const Json twisted = result_of(decoupled());
  EXPECT_EQ(twisted.at("terms"),
            Json({"stretch", "bend", "decoupled_twist", "gravity", "tip_torque"}));
  EXPECT_NEAR(twisted.at("roll_rad")[20].get<double>(), 0.01 * 40.0 / 0.62, 1e-12);
  EXPECT_EQ(twisted.at("nodes_mm"), newton.at("nodes_mm"));
  json = cantilever();
  json["loads"] = {{"tip_moment_n_mm", {0, 0, 0.02}}};
  const Json bent = result_of(json);
  EXPECT_EQ(bent.at("terms"), Json({"stretch", "bend", "tip_moment"}));
  EXPECT_NEAR(bent.at("energy_n_mm").at("tip_moment").get<double>(), -0.02, 0.05 * 0.02);
  EXPECT_NEAR(bent.at("energy_n_mm").at("tip_force").get<double>(), 0.0, 1e-15);
}

TEST_F(CaseFile, InsertionSceneBecomesATrial) {
  const SceneFile file = read_scene(write("scene.json", pushed_wire().dump()));
  EXPECT_FALSE(file.bench);
  ASSERT_TRUE(file.insertion);
  ASSERT_TRUE(file.vessel);
  EXPECT_EQ(file.vessel->surface.path, folder_ / "vessel.stl");
  EXPECT_FALSE(file.vessel->wall.elastic);
  EXPECT_FALSE(file.insertion->has_target);
  EXPECT_EQ(file.insertion->introducer.direction, Vec3(0, 0, 1)) << "made a unit vector";
  EXPECT_DOUBLE_EQ(file.insertion->introducer.roll, kPi / 2.0);
  EXPECT_EQ(file.insertion->options.length, 30.0);
  EXPECT_EQ(file.insertion->options.step, 0.5);
  EXPECT_EQ(file.insertion->options.element_length, 2.0) << "40 mm in 20 elements";
  EXPECT_GT(file.insertion->goal.point.norm(), 1e5) << "no target: out of reach";
  Json json = pushed_wire();
  json["target"] = {{"point_mm", {0, 0, 20}}, {"radius_mm", 1}};
  json["vessel"]["friction"] = 0.1;
  json["vessel"]["contact_spacing_mm"] = 0.5;
  json["vessel"]["wall"] = {{"model", "elastic"}, {"young_modulus_kpa", 56}};
  json["wire"]["sections"][0]["element_length_mm"] = 0.5;
  json["wire"].erase("elements");
  const SceneFile full = read_scene(write("scene.json", json.dump()));
  EXPECT_EQ(full.insertion->goal.point, Vec3(0, 0, 20));
  EXPECT_TRUE(full.insertion->has_target);
  EXPECT_TRUE(full.vessel->wall.elastic);
  EXPECT_DOUBLE_EQ(full.vessel->wall.extrusion.young_modulus, 0.056);
  EXPECT_EQ(full.insertion->options.friction, 0.1);
  EXPECT_EQ(full.insertion->options.contact_spacing, 0.5);
  EXPECT_EQ(full.insertion->options.section_element_length, std::vector<double>{0.5});
}

TEST_F(CaseFile, BenchTakesFrictionAndSpacingFromItsVessel) {
  Json json = cantilever();
  json["vessel"] = pushed_wire().at("vessel");
  json["vessel"]["friction"] = 0.2;
  json["vessel"]["contact_spacing_mm"] = 0.5;
  const SceneFile file = read_scene(write("scene.json", json.dump()));
  ASSERT_TRUE(file.bench && file.vessel);
  EXPECT_FALSE(file.insertion);
  EXPECT_EQ(file.bench->contact.friction, 0.2);
  EXPECT_EQ(file.bench->contact.spacing, 0.5);
}

TEST_F(CaseFile, ScenesSayWhatIsWrongOrNotInThisVersion) {
  struct Mistake {
    Json scene;
    std::string pointer;
    Json value;
    std::vector<std::string> told;
  };
  const std::vector<Mistake> mistakes = {
      {cantilever(), "/solver/method", "newtn", {"solver.method is \"newtn\"", "\"newton\""}},
      {cantilever(), "/solver/damping_per_s", 1, {"solver.damping_per_s is given", "newton"}},
      {cantilever(), "/solver/time_step_s", 1, {"solver.time_step_s is given", "newton"}},
      {motion("explicit"), "/solver/time_step_s", 0, {"solver.time_step_s is 0", "above 0"}},
      {motion("explicit"), "/solver/duration_s", 1e7, {"solver.duration_s", "1e9 time steps"}},
      {motion("explicit"), "/solver/load_steps", 2, {"solver.load_steps is given", "in full"}},
      {motion("explicit"),
       "/wire/sections/0/mass_kg_per_m",
       0,
       {"loads.gravity_m_per_s2", "mass_kg_per_m is 0", "above 0"}},
      {motion("semi_implicit"), "/wire/twist", "coupled", {"wire.twist is \"coupled\"", "newton"}},
      {motion("semi_implicit"),
       "/wire/sections/0/bending_stiffness_2_n_mm2",
       2,
       {"bending_stiffness_2_n_mm2", "newton"}},
      {strip(),
       "/wire/sections/0/bending_stiffness_2_n_mm2",
       0,
       {"bending_stiffness_2_n_mm2 is 0", "above 0"}},
      {strip(),
       "/wire/sections/0/twist_stiffness_n_mm2",
       0,
       {"twist_stiffness_n_mm2 is 0", "above 0", "strip"}},
      {motion("conjugate_gradient"),
       "/solver/damping_per_s",
       1,
       {"solver.damping_per_s is given", "time step"}},
      {motion("conjugate_gradient"),
       "/loads/tip_moment_n_mm",
       {0, 0, 1},
       {"loads.tip_moment_n_mm is [0.0,0.0,1.0]", "newton"}},
      {motion("conjugate_gradient"),
       "/wire/sections/0/rest_curvature_per_mm",
       0.01,
       {"wire.sections is with rest_curvature_per_mm", "newton"}},
      {motion("conjugate_gradient"),
       "/plane_normal",
       {0, 0, 1},
       {"plane_normal is given", "newton"}},
      {cantilever(), "/plane_normal", {1, 0, 1}, {"plane_normal", "supports lie in"}},
      {cantilever(), "/loads/tip_moment_n_mm", {1, 0, 0}, {"along the wire", "roll_deg"}},
      {cantilever(), "/loads/tip_torque_n_mm", 1, {"loads.tip_torque_n_mm is 1", "decoupled"}},
      {cantilever(), "/wire/twist", "both", {"wire.twist is \"both\"", "\"decoupled\""}},
      {decoupled(),
       "/wire/sections/0/rest_curvature_per_mm",
       0.01,
       {"wire.twist is \"decoupled\"", "bends and twists together"}},
      {decoupled(),
       "/supports/1",
       {{"at", "distal"}, {"kind", "clamped"}, {"point_mm", {30, 0, 0}}},
       {"loads.tip_torque_n_mm", "holds the roll already"}},
      {cantilever(),
       "/wire/sections/0/element_length_mm",
       1,
       {"wire.elements is given", "element_length_mm"}},
      {pushed_wire(), "/solver/method", "explicit", {"solver.method", "bench alone"}},
      {pushed_wire(), "/wire/twist", "decoupled", {"wire.twist", "\"auto\""}},
      {pushed_wire(), "/plane_normal", {0, 0, 1}, {"plane_normal is given", "version"}},
      {cantilever(), "/supports/0/roll_deg", 50000, {"supports[0].roll_deg is 50000", "to 36000"}},
      {cantilever(), "/supports/0/direction", {0, 0, 0}, {"supports[0].direction", "not all 0"}},
      {cantilever(), "/supports/0/kind", "pinned", {"not enough to hold the wire"}},
      {cantilever(), "/supports/0/at", "distal", {"without one at the proximal end"}},
      {cantilever(), "/wire/elements", 1, {"wire.elements is 1", "from 2"}},
      {cantilever(), "/wire/sections/0/length_mm", -1, {"wire.sections[0].length_mm is -1"}},
      {cantilever(),
       "/wire/sections/0/bend_coefficient_n_per_m",
       100,
       {"bend_coefficient_n_per_m is given twice"}},
      {cantilever(),
       "/wire/sections/0/stiffness",
       1,
       {"wire.sections[0].stiffness is not a known"}},
      {cantilever(), "/target", {{"point_mm", {0, 0, 1}}}, {"target is not a known key"}},
      {pushed_wire(), "/vessel/friction", -0.1, {"vessel.friction is -0.1", "from 0"}},
      {pushed_wire(), "/vessel/wall/model", "soft", {"vessel.wall.model", "\"elastic\""}},
      {motion("conjugate_gradient"),
       "/vessel",
       pushed_wire().at("vessel"),
       {"solver.method is not \"newton\"", "no vessel"}},
      {pushed_wire(), "/vessel/surface/path", "none.stl", {"vessel.surface.path", "none.stl"}},
      {pushed_wire(), "/insertion/length_mm", 50, {"insertion.length_mm is 50", "40"}},
      {pushed_wire(), "/loads/gravity_m_per_s2", {0, 0, -9.81}, {"loads is", "version"}},
      {pushed_wire(), "/supports", Json::array({1}), {"supports is given", "version"}},
  };
  for (const Mistake& mistake : mistakes) {
    SCOPED_TRACE(mistake.pointer);
    Json scene = mistake.scene;
    EXPECT_EQ(scene_problem(scene), "");
    scene[Json::json_pointer(mistake.pointer)] = mistake.value;
    expect_mentions(scene_problem(scene), mistake.told);
  }
}

TEST_F(CaseFile, ResultOfABenchIsWrittenInFileUnitsWithoutNan) {
  simulate::SceneResult result;
  result.outcome = simulate::SceneOutcome::kNotConverged;
  result.reason = "out of iterations";
  result.terms = {"stretch", "bend"};
  result.nodes = Eigen::Matrix3Xd::Random(3, 4);
  result.energy.bend = 2.0;
  result.energy.load = -1.5;
  result.gravity_energy = -1.0;
  result.residual = std::numeric_limits<double>::quiet_NaN();
  result.reactions = {{simulate::WireEnd::kProximal, Vec3(1, 2, 3), Vec3(4, 5, 6)}};
  const fs::path file = folder_ / "result.json";
  write_json(result_json(result, {}), file);
  const Json read = read_json(file, "wireplan.result/1");
  EXPECT_EQ(read.at("outcome"), "not_converged");
  EXPECT_EQ(read.at("energy_n_mm").at("total"), 0.5);
  EXPECT_EQ(read.at("energy_n_mm").at("gravity"), -1.0);
  EXPECT_EQ(read.at("energy_n_mm").at("tip_force"), -0.5);
  EXPECT_TRUE(read.at("twist_rad").is_null());
  EXPECT_TRUE(read.at("residual_n").is_null());
  EXPECT_TRUE(read.at("residual_n_reason").is_string());
  EXPECT_EQ(read.at("reactions")[0].at("moment_n_mm"), to_json(Vec3(4, 5, 6)));
  ASSERT_EQ(read.at("nodes_mm").size(), 4u);
  EXPECT_EQ(read.at("nodes_mm")[3], to_json(Vec3(result.nodes.col(3)))) << "to the last bit";
}

TEST_F(CaseFile, HistoryOfAnInsertionKeepsThePeaksBetweenItsRows) {
  simulate::TrialResult result;
  result.outcome = simulate::Outcome::kMissed;
  for (int i = 1; i <= 12; ++i) {
    simulate::Push push;
    push.insertion = i;
    push.peak_contact_force = i == 3 ? 7.0 : 1.0;
    push.residual = i == 4 ? 2e-7 : 1e-7;
    push.wall_displacement = i == 7 ? 0.5 : 0.25;
    push.push_work = i;
    push.stored_energy = 0.5 * i;
    push.friction_work = 0.25 * i;
    push.iterations = 2;
    result.pushes.push_back(push);
  }
  result.contacts = {{.node = 3,
                      .part = 0.5,
                      .triangle = 7,
                      .point = Vec3(1, 2, 3),
                      .normal_force = Vec3(3, 0, 4),
                      .friction_force = Vec3(0, 0.5, 0),
                      .penetration = 0.1},
                     {.node = 4}};
  const Json json = result_json(result, 5.0, 0.125);
  ASSERT_EQ(json.at("history").size(), 3u);
  EXPECT_EQ(json.at("history")[0].at("insertion_mm"), 5.0);
  EXPECT_EQ(json.at("history")[0].at("peak_contact_force_n"), 7.0);
  EXPECT_EQ(json.at("history")[1].at("peak_contact_force_n"), 1.0);
  EXPECT_EQ(json.at("history")[2].at("insertion_mm"), 12.0) << "the last push has a row";
  EXPECT_EQ(json.at("iterations"), 24);
  EXPECT_EQ(json.at("residual_n"), 2e-7);
  EXPECT_EQ(json.at("history")[1].at("wall_displacement_mm"), 0.5);
  EXPECT_EQ(json.at("history")[0].at("energy_released_n_mm"), 1.25);
  EXPECT_EQ(json.at("energy_n_mm").at("total"), 6.0);
  EXPECT_TRUE(json.at("energy_n_mm").at("bend").is_null());
  EXPECT_TRUE(json.at("energy_n_mm").at("bend_reason").is_string());
  EXPECT_EQ(json.at("cpu_time_s"), 0.125);
  EXPECT_EQ(json.at("contacts")[0].at("triangle"), 7);
  EXPECT_EQ(json.at("contacts")[0].at("normal_force_n"), to_json(Vec3(3, 0, 4)));
  EXPECT_EQ(json.at("contacts")[0].at("friction_force_n"), to_json(Vec3(0, 0.5, 0)));
  EXPECT_TRUE(json.at("contacts")[1].at("triangle").is_null());
}

// ---- writing ----------------------------------------------------------------------------------

TEST_F(CaseFile, WrittenJsonReadsBackToTheLastBit) {
  const fs::path file = folder_ / "out.json";
  const Json json = {{"schema", "x/1"}, {"values", {0.1, 1.0 / 3.0, 1e-300, 5e-324, 1.0e22}}};
  write_json(json, file);
  EXPECT_EQ(read_json(file, "x/1"), json);
}

TEST_F(CaseFile, RefusedWriteLeavesThePlaceAsItWas) {
  const fs::path file = write("out.json", "before");
  const Json bad = {{"value", std::numeric_limits<double>::infinity()}};
  EXPECT_THROW(write_json(bad, file), LogicError);
  EXPECT_EQ(fs::file_size(file), 6u);
  EXPECT_THROW(write_json(Json::object(), folder_ / "none" / "out.json"), Error);
  int files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder_)) ++files;
  EXPECT_EQ(files, 4) << "nothing temporary stays";
}

}  // namespace
}  // namespace wireplan::pipeline
