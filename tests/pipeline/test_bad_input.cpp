// Bad input, each kind with the exact words that the user reads: where, what was found, what was
// expected, and where there is one the remedy.
#include <gtest/gtest.h>

#include "pipeline/files/case_file.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

struct BadInput {
  const char* set;   // as --set takes it
  const char* told;  // what follows "FILE: " on each line
};

const std::vector<BadInput> kOfAVolume = {
    {R"~(volume=3)~", R"~(volume is 3, expected an object {...})~"},
    {R"~(volume.path=)~", R"~(volume.path is "", expected a text in quotes, not empty)~"},
    {R"~(volume.path=7)~", R"~(volume.path is 7, expected a text in quotes, not empty)~"},
    {R"~(volume.pth=ct.nrrd)~",
     R"~(volume.pth is not a known key, expected "path" (the nearest known key; units stand in the keys))~"},
    {R"~(segmentation=[])~", R"~(segmentation is [], expected an object {...})~"},
    {R"~(segmentation.lower_hu=-2000)~",
     R"~(segmentation.lower_hu is -2000, expected a number from -1100 to 65535)~"},
    {R"~(segmentation.upper_hu=1e6)~",
     R"~(segmentation.upper_hu is 1000000.0, expected a number from -1100 to 65535)~"},
    {R"~(segmentation.upper_hu=null)~",
     R"~(segmentation.upper_hu is null, expected a number from -1100 to 65535)~"},
    {R"~(segmentation.seeds_mm=[])~",
     R"~(segmentation.seeds_mm is [], expected a list of points [[x, y, z], ...])~"},
    {R"~(segmentation.seeds_mm=4)~",
     R"~(segmentation.seeds_mm is 4, expected a list of points [[x, y, z], ...])~"},
    {R"~(segmentation.seeds_mm=[[1,2]])~",
     R"~(segmentation.seeds_mm[0] is [1,2], expected three numbers [x, y, z])~"},
    {R"~(segmentation.smoothing_mm=9)~",
     R"~(segmentation.smoothing_mm is 9, expected a number from 0 to 5)~"},
    {R"~(segmentation.reach_mm=5)~",
     "segmentation.reach_mm is given beside a band, expected one of them: a band is followed "
     "through the whole volume\nsegmentation.reach_mm is 5, expected a number from 10 to 2000"},
    {R"~(segmentation.neck_opening_mm=-1)~",
     R"~(segmentation.neck_opening_mm is -1, expected a number from 0 to 5)~"},
    {R"~(surface.edge_length_mm=0.01)~",
     R"~(surface.edge_length_mm is 0.01, expected a number from 0.1 to 10 (given in m?))~"},
    {R"~(surface.edge_length_mm=true)~",
     R"~(surface.edge_length_mm is true, expected a number from 0.1 to 10)~"},
    {R"~(surface.edge_lenght_mm=1)~",
     R"~(surface.edge_lenght_mm is not a known key, expected "edge_length_mm" (the nearest known key; units stand in the keys))~"},
    {R"~(surface=7)~", R"~(surface is 7, expected an object {...})~"},
    {R"~(wall.thickness_mm=20)~",
     R"~(wall.thickness_mm is 20, expected a number from 0.1 to 10 (given in m?))~"},
    {R"~(wall.young_modulus_kpa=-1)~",
     R"~(wall.young_modulus_kpa is -1, expected a number from 0 to 100000 (given in Pa? 0 chooses it))~"},
    {R"~(wall.young_modulus_kpa=1e9)~",
     R"~(wall.young_modulus_kpa is 1000000000.0, expected a number from 0 to 100000 (given in Pa? 0 chooses it))~"},
    {R"~(wall.poisson_ratio=0.5)~",
     R"~(wall.poisson_ratio is 0.5, expected a number from 0 to 0.49)~"},
    {R"~(wall.modl=rigid)~",
     R"~(wall.modl is not a known key, expected "model" (the nearest known key; units stand in the keys))~"},
    {R"~(wall=stiff)~", R"~(wall is "stiff", expected an object {...})~"},
    {R"~(access=[1,2,3])~", R"~(access is [1,2,3], expected an object {...})~"},
    {R"~(access.point_mm="x")~", R"~(access.point_mm is "x", expected three numbers [x, y, z])~"},
    {R"~(access.point_mm=[1,2,null])~",
     R"~(access.point_mm is [1,2,null], expected three numbers [x, y, z])~"},
    {R"~(access.inclination_deg=[])~",
     R"~(access.inclination_deg is [], expected a list of numbers [a, b, ...])~"},
    {R"~(access.inclination_deg=[-1])~",
     R"~(access.inclination_deg[0] is -1, expected a number from 0 to 80)~"},
    {R"~(access.azimuth_deg=[400])~",
     R"~(access.azimuth_deg[0] is 400, expected a number from -360 to 360)~"},
    {R"~(access.azimuth_deg=["north"])~",
     R"~(access.azimuth_deg[0] is "north", expected a number from -360 to 360)~"},
    {R"~(access.angle=3)~",
     R"~(access.angle is not a known key, expected one of "name", "branch", "beyond_ostium_mm", "end", "point_mm", "inclination_deg", "azimuth_deg")~"},
    {R"~(target.radius_mm=0)~",
     R"~(target.radius_mm is 0, expected a number from 0.1 to 50 (given in m?))~"},
    {R"~(target.radius_mm=100)~",
     R"~(target.radius_mm is 100, expected a number from 0.1 to 50 (given in m?))~"},
    {R"~(target.beyond_mm=-1)~",
     R"~(target.beyond_mm is -1, expected a number from 0 to 500 (given in m?))~"},
    {R"~(target={"point_mm":[1,2,3],"radius_mm":4,"beyond_mm":10})~",
     R"~(target.beyond_mm is given beside target.radius_mm, expected one of the two (beyond_mm moves the cross-section on along the vessel; a sphere has none))~"},
    {R"~(target.point_mm=[1,2])~",
     R"~(target.point_mm is [1,2], expected three numbers [x, y, z])~"},
    {R"~(wires="amplatz")~",
     R"~(wires is "amplatz", expected a list of catalogue names and wires, at least one (`wireplan wires` lists the catalogue))~"},
    {R"~(wires={})~",
     R"~(wires is {}, expected a list of catalogue names and wires, at least one (`wireplan wires` lists the catalogue))~"},
    {R"~(wires=[null])~", R"~(wires[0] is null, expected an object {...})~"},
    {R"~(wires=[{"name":"x"}])~",
     R"~(wires[0].diameter_mm is missing, expected a number from 0.1 to 3
wires[0].sections is missing, expected a list of objects [{...}, ...])~"},
    {R"~(wires=[{"name":"","diameter_mm":1,"sections":[{"length_mm":400,"bending_stiffness_n_mm2":5}]}])~",
     R"~(wires[0].name is "", expected a text in quotes, not empty)~"},
    {R"~(wires=[{"name":"x","diameter_mm":5,"sections":[{"length_mm":400,"bending_stiffness_n_mm2":5}]}])~",
     R"~(wires[0].diameter_mm is 5, expected a number from 0.1 to 3 (given in m or inch? 0.035 inch is 0.889 mm))~"},
    {R"~(wires=[{"name":"x","diameter_mm":1,"sections":[{"length_mm":-4,"bending_stiffness_n_mm2":5}]}])~",
     R"~(wires[0].sections[0].length_mm is -4, expected a number from 0.1 to 5000)~"},
    {R"~(wires=[{"name":"x","diameter_mm":1,"sections":[{"length_mm":400}]}])~",
     R"~(wires[0].sections[0].bending_stiffness_n_mm2 is missing, expected a number from 0.01 to 1e+07)~"},
    {R"~(wires=[{"name":"x","diameter_mm":1,"sections":[{"length_mm":400,"bending_stiffness_n_mm2":1e9}]}])~",
     R"~(wires[0].sections[0].bending_stiffness_n_mm2 is 1000000000.0, expected a number from 0.01 to 1e+07 (1 N m^2 is 1e6 N mm^2))~"},
    {R"~(wires=[{"name":"x","diameter_mm":1,"sections":[{"length_mm":400,"bending_stiffness_n_mm2":5,"rest_radius_mm":0}]}])~",
     R"~(wires[0].sections[0].rest_radius_mm is 0, expected a number from 0.5 to 1e+06 (leave out if straight))~"},
    {R"~(wires=[{"name":"x","diameter_mm":1,"sections":[{"length_mm":400,"bending_stiffness_n_mm2":5,"mass_kg_per_m":-1}]}])~",
     R"~(wires[0].sections[0].mass_kg_per_m is -1, expected a number from 0 to 1)~"},
    {R"~(wires=[{"name":"x","diameter_mm":1,"sections":3}])~",
     R"~(wires[0].sections is 3, expected a list of objects [{...}, ...])~"},
    {R"~(tip_roll_deg=[500])~", R"~(tip_roll_deg[0] is 500, expected a number from -360 to 360)~"},
    {R"~(tip_roll_deg=[])~", R"~(tip_roll_deg is [], expected a list of numbers [a, b, ...])~"},
    {R"~(friction=-0.1)~",
     R"~(friction is -0.1, expected a number from 0 to 1 (Coulomb's coefficient: 0.04 hydrophilic, 0.12 PTFE, 0.25 bare))~"},
    {R"~(friction="low")~", R"~(friction is "low", expected a number from 0 to 1)~"},
    {R"~(insertion.step_mm=0)~", R"~(insertion.step_mm is 0, expected a number from 0.01 to 20)~"},
    {R"~(insertion.step_mm=50)~",
     R"~(insertion.step_mm is 50, expected a number from 0.01 to 20)~"},
    {R"~(insertion.element_length_mm=0.001)~",
     R"~(insertion.element_length_mm is 0.001, expected a number from 0.05 to 20)~"},
    {R"~(insertion.contact_spacing_mm=0)~",
     R"~(insertion.contact_spacing_mm is 0, expected a number from 0.05 to 20)~"},
    {R"~(insertion.residual_tolerance_n=1)~",
     R"~(insertion.residual_tolerance_n is 1, expected a number from 1e-12 to 0.01)~"},
    {R"~(insertion.max_iterations=0)~",
     R"~(insertion.max_iterations is 0, expected a whole number from 1 to 100000)~"},
    {R"~(insertion.max_iterations=2.5)~",
     R"~(insertion.max_iterations is 2.5, expected a whole number from 1 to 100000)~"},
    {R"~(insertion.record_every_mm=0)~",
     R"~(insertion.record_every_mm is 0, expected a number from 0.1 to 1000)~"},
    {R"~(insertion.length_mm=-5)~",
     R"~(insertion.length_mm is -5, expected a number from 0 to 3000 (given in m?))~"},
    {R"~(insertion.length=5)~",
     R"~(insertion.length is not a known key, expected one of "length_mm", "step_mm", "element_length_mm", "contact_spacing_mm", "residual_tolerance_n", "max_iterations", "record_every_mm")~"},
    {R"~(limits.tip_force_warn_n=0)~",
     R"~(limits.tip_force_warn_n is 0, expected a number above 0 and up to 100 (given in mN or gf?))~"},
    {R"~(limits.tip_force_fail_n=1000)~",
     R"~(limits.tip_force_fail_n is 1000, expected a number above 0 and up to 100 (given in mN or gf?))~"},
    {R"~(limits.penetration_fail_mm=-1)~",
     R"~(limits.penetration_fail_mm is -1, expected a number above 0 and up to 5)~"},
    {R"~(limits.off_path_fail_mm=0)~",
     R"~(limits.off_path_fail_mm is 0, expected a number above 0 and up to 1000)~"},
    {R"~(limits.tip_force=1)~",
     R"~(limits.tip_force is not a known key, expected one of "tip_force_warn_n", "tip_force_fail_n", "penetration_fail_mm", "off_path_fail_mm")~"},
    {R"~(ranking.weights.reach=-1)~",
     R"~(ranking.weights.reach is -1, expected a number from 0 to 1000)~"},
    {R"~(ranking.weights.margin="much")~",
     R"~(ranking.weights.margin is "much", expected a number from 0 to 1000)~"},
    {R"~(ranking.script_weights.support=1)~",
     R"~(ranking.script_weights is given, expected only beside "catheters" (delete the key, or list catheters))~"},
    {R"~(ranking.weigths={})~",
     R"~(ranking.weigths is not a known key, expected "weights" (the nearest known key; units stand in the keys))~"},
    {R"~(name=)~", R"~(name is "", expected a text in quotes, not empty)~"},
    {R"~(name=.x)~",
     R"~(name is ".x", expected at most 80 letters, digits, spaces, '-', '_' and '.', not starting with '.' (folders are named after the case))~"},
    {R"~(name="a/b")~",
     R"~(name is "a/b", expected at most 80 letters, digits, spaces, '-', '_' and '.', not starting with '.' (folders are named after the case))~"},
};

const std::vector<BadInput> kOfASurface = {
    {R"~(surface.unit=inch)~", R"~(surface.unit is "inch", expected one of "mm", "cm", "m")~"},
    {R"~(surface.frame=LAS)~", R"~(surface.frame is "LAS", expected one of "LPS", "RAS")~"},
    {R"~(surface.unit=3)~", R"~(surface.unit is 3, expected one of "mm", "cm", "m")~"},
};

class BadInputs : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"ct.nrrd", "vessel.stl"}) write_text("", folder_ / name);
  }

  std::string refusal(const std::string& text, const std::vector<std::string>& sets = {}) const {
    const fs::path file = folder_ / "case.json";
    write_text(text, file);
    try {
      read_case(file, sets);
    } catch (const Error& error) {
      return without_file(error.what(), file.string() + ": ");
    }
    return "accepted";
  }

  // Without the file's name, which must begin each line.
  static std::string without_file(const std::string& told, const std::string& head) {
    std::istringstream stream(told);
    std::string text;
    for (std::string line; std::getline(stream, line);) {
      EXPECT_EQ(line.substr(0, head.size()), head);
      text += (text.empty() ? "" : "\n") + line.substr(std::min(head.size(), line.size()));
    }
    return text;
  }

  void expect_told(const Json& sound, const std::vector<BadInput>& table) const {
    ASSERT_EQ(refusal(sound.dump()), "accepted");
    for (const BadInput& bad : table) EXPECT_EQ(refusal(sound.dump(), {bad.set}), bad.told);
  }

  static Json sound_case() {
    return {{"schema", "wireplan.case/1"},
            {"access", {{"point_mm", {1, 2, 3}}}},
            {"target", {{"point_mm", {1, 2, 100}}}},
            {"wires", {"amplatz"}}};
  }

  TemporaryFolder folder_;
};

TEST_F(BadInputs, AreSixtyKindsAndMore) { EXPECT_GE(kOfAVolume.size() + kOfASurface.size(), 60u); }

TEST_F(BadInputs, OfACaseThatStartsFromAVolume) {
  Json sound = sound_case();
  sound["volume"] = {{"path", "ct.nrrd"}};
  sound["segmentation"] = {{"lower_hu", 150}, {"upper_hu", 600}};
  expect_told(sound, kOfAVolume);
}

TEST_F(BadInputs, OfACaseThatStartsFromASurface) {
  Json sound = sound_case();
  sound["surface"] = {{"path", "vessel.stl"}, {"unit", "mm"}, {"frame", "LPS"}};
  expect_told(sound, kOfASurface);
}

TEST_F(BadInputs, OfTextThatIsNoJson) {
  const std::string hint = " (look for a missing comma, quote or bracket, or a file cut short)";
  EXPECT_EQ(refusal(""),
            "broken JSON at line 1, column 1: syntax error while parsing value - unexpected end of "
            "input; expected '[', '{', or a literal" +
                hint);
  EXPECT_EQ(
      refusal("{\"a\": 1"),
      "broken JSON at line 1, column 8: syntax error while parsing object - unexpected end of "
      "input; expected '}'" +
          hint);
  EXPECT_EQ(refusal("[1]"), "holds [1], expected a JSON object {...}");
  EXPECT_EQ(refusal(R"({"a": 1, "a": 2})"),
            "a is given twice in one object, expected once (delete one of the two)");
  EXPECT_EQ(refusal(std::string(200, '[')), "nested deeper than any file of wireplan");
}

TEST_F(BadInputs, OfFilesThatAreNotThere) {
  const auto told = [](const fs::path& path) -> std::string {
    try {
      read_case(path);
    } catch (const Error& error) {
      return error.what();
    }
    return "accepted";
  };
  const std::string absent = (folder_ / "absent.json").string();
  EXPECT_EQ(told(absent), absent + ": no such file (check the path and the working directory)");
  EXPECT_EQ(told(folder_.path()), folder_.path().string() +
                                      ": this folder has no case.json (give a case file or a "
                                      "folder that has one)");
}

}  // namespace
}  // namespace wireplan::pipeline
