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
#include "pipeline/stages/stages.h"
#include "preprocess/volume/image.h"
#include "tests/pipeline/case_texts.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {
namespace {

TEST_F(CaseFile, GivesEveryMissingKeyItsDefault) {
  const Case input = read(volume_case());
  EXPECT_EQ(input.name, folder_.filename().string());
  EXPECT_EQ(input.volume->path, folder_ / "ct.nrrd");
  EXPECT_FALSE(input.surface_input);
  EXPECT_TRUE(input.study.goal.at_section) << "a radius alone makes the target a sphere";
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
  EXPECT_DOUBLE_EQ(input.wall.support.value(), 2e-3);           // N/mm^3
  EXPECT_DOUBLE_EQ(input.study.inclinations[1], kPi / 12.0);    // rad
  EXPECT_DOUBLE_EQ(input.study.azimuths[1], kPi / 2.0);
  EXPECT_DOUBLE_EQ(input.study.rolls[1], kPi);
  const simulate::Wire& wire = input.study.wires[0];
  EXPECT_DOUBLE_EQ(wire.radius, 0.4445);                     // mm
  EXPECT_DOUBLE_EQ(wire.sections[0].mass_per_length, 5e-9);  // t/mm
  EXPECT_DOUBLE_EQ(wire.sections[0].rest_curvature, 1.0 / 12.0);
}

TEST_F(CaseFile, CrossSectionsMoveWhereASupportIsGivenAlone) {
  Json json = volume_case();
  EXPECT_FALSE(read(json).wall.support);
  EXPECT_FALSE(case_parameters(read(json))["wall"].contains("support_kpa_per_mm"));
  json["robustness"]["support_factor"] = {0.5, 2};
  EXPECT_EQ(read(json).robustness.unknowns.support_high, 1.0) << "there is none to be disturbed";
  ASSERT_EQ(read(json).told.size(), 1u);
  EXPECT_EQ(read(json).told[0].find("robustness.support_factor is without effect"), 0u);
  json["wall"]["support_kpa_per_mm"] = nullptr;
  EXPECT_FALSE(read(json).wall.support);
  json["wall"]["support_kpa_per_mm"] = 1;
  EXPECT_DOUBLE_EQ(read(json).wall.support.value(), 1e-3);
  EXPECT_EQ(read(json).robustness.unknowns.support_high, 2.0);
  json["robustness"].erase("support_factor");
  EXPECT_EQ(read(json).robustness.unknowns.support_low, 0.1);
  EXPECT_EQ(read(json).robustness.unknowns.support_high, 10.0);
  json["wall"]["support_kpa_per_mm"] = 0;
  expect_mentions(problem(json), {"wall.support_kpa_per_mm is 0, expected a number from 0.001",
                                  "1e6 Pa/m are 1 kPa/mm"});
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

TEST_F(CaseFile, TakesTheLeastNumbersThatItsRangesHold) {
  Json json = full_case(volume_case());
  json["wall"]["young_modulus_kpa"] = 1e-310;
  json["access"]["inclination_deg"] = {1e-312};
  const Json parameters = case_parameters(read(json));
  EXPECT_NEAR(parameters.at("wall").at("young_modulus_kpa").get<double>() / 1e-310, 1.0, 1e-6);
  EXPECT_NEAR(parameters.at("access").at("inclination_deg").at(0).get<double>() / 1e-312, 1.0,
              1e-6);
}

TEST_F(CaseFile, LeavesTheChoiceOfCathetersToTheAnatomy) {
  Json json = full_case(volume_case());
  json["catheters"] = "suggest";
  const Case given = read(json);
  EXPECT_TRUE(given.suggest_catheters);
  EXPECT_EQ(given.study.catheters.size(), catalogue().catheters.size());
  EXPECT_EQ(case_parameters(given).at("catheters"), "suggest");
  EXPECT_EQ(case_parameters(read(case_parameters(given))), case_parameters(given));
  EXPECT_TRUE(used_parameters(given).at("catheters").is_array()) << "keys have what is chosen from";
  EXPECT_FALSE(read(full_case(volume_case())).suggest_catheters);
}

TEST_F(CaseFile, WeighsTheThinnestCatheterThatItNames) {
  Json json = full_case(volume_case());
  json.erase("access_limits");
  for (const char* first : {"cobra-c2", "guide-6f"}) {
    json["catheters"] = {first};
    if (first != std::string("guide-6f")) json["catheters"].push_back("guide-6f");
    const Case given = read(json);
    EXPECT_EQ(given.access_limits.device_diameter.value,
              2.0 * given.study.catheters[0].tool.wire.radius)
        << first;
    EXPECT_FALSE(given.access_limits.device_diameter.assumed) << first;
  }
  json["access_limits"] = {{"device_diameter_mm", 1.5}};
  EXPECT_EQ(read(json).access_limits.device_diameter.value, 1.5) << "as given";
  json.erase("access_limits");
  json["catheters"] = "suggest";
  EXPECT_TRUE(read(json).access_limits.device_diameter.assumed);
}

TEST_F(CaseFile, OfACatheterWithoutAnInnerDiameterThatAloneIsTold) {
  Json json = full_case(volume_case());
  json["catheters"][0].erase("inner_diameter_mm");
  const std::string told = problem(json);
  expect_mentions(told, {"catheters[0].inner_diameter_mm is missing"});
  EXPECT_EQ(told.find("less than outside"), std::string::npos) << told;
}

TEST_F(CaseFile, KnowsWhichSizesItGivesThoughTheyAreThoseOfTheDefault) {
  const Case none = read(volume_case());
  const std::vector<std::string> sizes = {"device_diameter_mm", "sheath_diameter_mm",
                                          "sheath_length_mm", "catheter_length_mm",
                                          "working_length_mm"};
  EXPECT_EQ(used_parameters(none)["access_limits"]["assumed"], Json(sizes));
  for (const std::string& size : sizes) {
    Json json = volume_case();
    json["access_limits"][size] = case_parameters(none)["access_limits"][size];
    const Case given = read(json);
    EXPECT_EQ(case_parameters(given), case_parameters(none));
    std::vector<std::string> others = sizes;
    std::erase(others, size);
    EXPECT_EQ(used_parameters(given)["access_limits"]["assumed"], Json(others)) << size;
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
      {"catheters=[\"cobra-c4\"]", {"catheters[0] is \"cobra-c4\"", "did you mean \"cobra-c"}},
      {"catheters=[]", {"catheters is []", "at least one", "wireplan devices"}},
      {"catheters=\"sugest\"", {"catheters is \"sugest\"", "or \"suggest\""}},
      {"catheters=[\"sos\", \"sos\"]", {"catheters[1] is \"sos\" again"}},
      {"tool_rules={\"hold_mm\": 5}", {"tool_rules is given", "only beside \"catheters\""}},
      {"access.point_mm=[1, 2]", {"access.point_mm is [1,2]", "three numbers [x, y, z]"}},
      {"access.inclination_deg=[0, 95]", {"access.inclination_deg[1] is 95", "from 0 to 80"}},
      {"access.inclination_deg=15", {"access.inclination_deg is 15", "a list"}},
      {"target={\"point_mm\": [1, 2, 4], \"radius_mm\": 4}",
       {"target.point_mm is [1.0,2.0,4.0]", "further than"}},
      {"target.point_mm=[1, 2, 3]", {"target.point_mm is [1.0,2.0,3.0]", "another point"}},
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
       {"ranking is weights of 0 in all"}},
      {"access_limits.tortuosity=[1.5, 1.25, 1.6]",
       {"access_limits.tortuosity is [1.5,1.25,1.6]", "rising"}},
      {"access_limits.angle_deg=[160, 120]",
       {"access_limits.angle_deg is [160.0,120.0]", "three thresholds", "falling"}},
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

TEST_F(CaseFile, TakesTheFrameThatTheSurfaceTellsAndNamesAContradiction) {
  Json json = surface_case();
  write("ras.stl", "solid 3D Slicer output. SPACE=RAS\nendsolid\n");
  json["surface"] = {{"path", "ras.stl"}, {"unit", "mm"}};
  EXPECT_EQ(read(json).surface_input->frame, "RAS");
  json["surface"]["frame"] = "LPS";
  expect_mentions(problem(json), {"surface.frame is \"LPS\"", "\"RAS\", as the file itself says"});
  // One that is neither is named, whatever the case says.
  write("lpi.stl", "solid x SPACE=LPI\nendsolid\n");
  json["surface"]["path"] = "lpi.stl";
  expect_mentions(problem(json), {"surface.path is \"lpi.stl\"", "the file itself says LPI"});
  json["surface"].erase("frame");
  expect_mentions(problem(json), {"surface.path is \"lpi.stl\"", "the file itself says LPI"});
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
  Json without_band = volume_case();
  without_band["segmentation"] = Json::object();
  SchemaWalk of_found(schema, full_case(without_band), told);
  of_found.visit(schema, "", "");
  without_band["segmentation"] = {{"lower_hu", 150}, {"upper_hu", 600}, {"reach_mm", 120}};
  expect_mentions(problem(without_band), {"segmentation.reach_mm is given beside a band"});
  Json section = full_case(surface_case());
  section["target"].erase("radius_mm");
  section["target"]["beyond_mm"] = 10;
  section["target"]["name"] = "renal";
  section["access"]["name"] = "groin";
  SchemaWalk of_surface(schema, section, told);
  SchemaWalk of_lists(schema, listed_case(), told);
  Json other_order = listed_case();
  std::swap(other_order["targets"][0], other_order["targets"][1]);
  SchemaWalk of_sections(schema, other_order, told);
  Json marked = full_case(surface_case()), marked_lists = listed_case();
  SchemaWalk of_marked(
      schema, marked_points(std::move(marked), {"/access", "/target", "/wall/held/0"}), told);
  of_marked.visit(schema, "", "");
  SchemaWalk of_marked_lists(
      schema, marked_points(std::move(marked_lists), {"/accesses/0", "/targets/0"}), told);
  of_marked_lists.visit(schema, "", "");

  preprocess::write_image(
      {.grid = {.size = {4, 4, 101}}, .values = std::vector<float>(4 * 4 * 101)},
      folder_ / "ct.nrrd");
  SchemaWalk of_voxels(schema, voxel_case(false), told);
  SchemaWalk of_voxel_lists(schema, voxel_case(true), told);
  of_voxels.visit(schema, "", "");
  of_voxel_lists.visit(schema, "", "");
  of_volume.visit(schema, "", "");
  std::set<std::string> of_labels;
  const bool imaging = preprocess::reads_volumes();  // labels are read to find a branch
  for (const Json& labels : imaging ? cases_at_branches() : std::vector<Json>{}) {
    SchemaWalk walk(schema, labels, told);
    walk.visit(schema, "", "");
    of_labels.insert(walk.visited.begin(), walk.visited.end());
  }
  of_surface.visit(schema, "", "");
  of_lists.visit(schema, "", "");
  of_sections.visit(schema, "", "");
  EXPECT_GE(of_volume.limits, 50) << "limits held against the code";
  std::set<std::string> of_forms;
  for (const Json& form : {Json{{"tip_load_gf", 8}}, Json{{"flexural_modulus_gpa", 17}},
                           Json{{"bending_stiffness_n_mm2", {3, 521}}, {"taper", "cone"}}}) {
    Json json = full_case(surface_case());
    Json& wire_section = json["wires"][0]["sections"][0];
    wire_section.erase("bending_stiffness_n_mm2");
    wire_section.update(form);
    SchemaWalk walk(schema, json, told);
    walk.visit(schema, "", "");
    of_forms.insert(walk.visited.begin(), walk.visited.end());
  }

  for (const char* end : {"access", "target"}) {  // one of two keys is required
    Json without = section;
    without[end].erase("point_mm");
    expect_mentions(problem(without), {std::string(end) + ".point_mm is missing"});
  }

  // Nothing of the schema was passed over.
  std::set<std::string> known, visited = of_volume.visited;
  visited.merge(of_labels);
  visited.merge(of_forms);
  list_properties(schema, schema, "", known);
  for (const SchemaWalk* walk : {&of_found, &of_surface, &of_lists, &of_sections, &of_marked,
                                 &of_marked_lists, &of_voxels, &of_voxel_lists}) {
    visited.insert(walk->visited.begin(), walk->visited.end());
  }
  if (!imaging) return;
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
