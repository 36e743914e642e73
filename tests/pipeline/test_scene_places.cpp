// Where a scene's supports lie against its vessel, and the forces on it.
#include <gtest/gtest.h>

#include <numeric>
#include <string>

#include "preprocess/files/vessel_io.h"
#include "tests/messages.h"
#include "tests/pipeline/program.h"

namespace wireplan::pipeline {
namespace {

/// A clamped wire of 20 mm that looks up, in a tube of 4 mm round the z axis from 0 to 36 mm with
/// flat ends.
Json clamped_in_tube(const Vec3& at) {
  Json scene = {{"schema", "wireplan.scene/1"}};
  scene["wire"] = {
      {"elements", 10},
      {"sections",
       Json::array({{{"length_mm", 20}, {"bending_stiffness_n_mm2", 10}, {"radius_mm", 0.4}}})}};
  scene["vessel"] = {{"surface", {{"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}}}};
  scene["supports"] = Json::array({{{"at", "proximal"},
                                    {"kind", "clamped"},
                                    {"point_mm", to_json(at)},
                                    {"direction", {0, 0, 1}}}});
  return scene;
}

TEST(ScenePlaces, ASupportOutsideOfTheVesselIsRefusedWhereNoOpeningIsBeforeIt) {
  const TemporaryFolder folder;
  write_stl(shapes::straight_tube(4.0, 36.0, 1.5), folder / "tube.stl");
  const auto answer = [&](const Json& scene, const std::string& command) {
    write_json(scene, folder / "scene.json");
    return run_program(folder.path(), command);
  };
  for (const Vec3& held : {Vec3(0, 0, 6), Vec3(0, 0, -5)}) {
    EXPECT_EQ(answer(clamped_in_tube(held), "check scene.json").code, 0) << held.transpose();
  }
  for (const char* command : {"check scene.json", "simulate scene.json -o out"}) {
    for (const Vec3& held : {Vec3(30, 0, 6), Vec3(12, 0, -5)}) {
      const Answer refused = answer(clamped_in_tube(held), command);
      EXPECT_EQ(refused.code, 2) << command;
      EXPECT_TRUE(holds(refused.log, "supports[0].point_mm is [")) << refused.log;
      EXPECT_TRUE(holds(refused.log, " mm outside")) << refused.log;
    }
  }
  // Of two the one that lies outside is named.
  Json both = clamped_in_tube(Vec3(0, 0, 6));
  both["supports"].push_back({{"at", "distal"}, {"kind", "pinned"}, {"point_mm", {9, 0, 24}}});
  const Answer refused = answer(both, "check scene.json");
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(holds(refused.log,
                    "supports[1].point_mm is [9.0,0.0,24.0], expected a point inside "
                    "the vessel, or in front of an opening of it; it lies 5.0 mm"))
      << refused.log;
}

TEST(ScenePlaces, ForcesAtTheEndAreNotCalledThePeakOfAllPushes) {
  const TemporaryFolder folder;
  write_stl(shapes::straight_tube(4.0, 36.0, 1.5), folder / "tube.stl");
  Json bench = clamped_in_tube(Vec3(0, 0, 6)), pushed = bench;
  bench["loads"] = {{"tip_force_n", {0.3, 0, 0}}};
  pushed.erase("supports");
  pushed["insertion"] = {{"point_mm", {0, 0, 6}}, {"direction", {0.6, 0, 1}}, {"length_mm", 16}};
  for (const bool peak : {false, true}) {
    write_json(peak ? pushed : bench, folder / "scene.json");
    ASSERT_EQ(run_program(folder.path(), "simulate scene.json -o out").code, 0);
    const Json result = read_json(folder / "out" / "result.json", "wireplan.result/1");
    double contacts = 0.0;
    for (const Json& contact : result.at("contacts")) {
      contacts += point_of(contact.at("normal_force_n")).norm();
    }
    EXPECT_GT(contacts, 0.01);
    const std::vector<double> forces = preprocess::read_wall_array(
        folder / "out" / "forces.vtu", peak ? "peak_force_n" : "force_n");
    const double sum = std::accumulate(forces.begin(), forces.end(), 0.0);
    if (peak) {
      EXPECT_GE(sum, contacts);
    } else {
      EXPECT_NEAR(sum, contacts, 1e-6 * contacts);  // kept in single precision
    }
    EXPECT_THROW(preprocess::read_wall_array(folder / "out" / "forces.vtu",
                                             peak ? "force_n" : "peak_force_n"),
                 Error);
  }
}

TEST(ScenePlaces, ResultsOfAnEarlierSceneDoNotStayBesideThoseOfThisOne) {
  const TemporaryFolder folder;
  write_stl(shapes::straight_tube(4.0, 36.0, 1.5), folder / "tube.stl");
  Json one = clamped_in_tube(Vec3(0, 0, 6));
  one.erase("supports");
  one["insertion"] = {{"point_mm", {0, 0, 6}}, {"direction", {0, 0, 1}}, {"length_mm", 10}};
  Json two = one;
  two["insertion"]["roll_deg"] = {0, 45};
  const auto names = [&](const Json& scene) {
    write_json(scene, folder / "scene.json");
    EXPECT_EQ(run_program(folder.path(), "simulate scene.json -o out").code, 0);
    std::string found;
    for (const char* name : {"result.json", "roll_0/result.json", "roll_45/result.json"}) {
      if (std::filesystem::exists(folder / "out" / name)) found += std::string(name) + " ";
    }
    return found;
  };
  std::filesystem::create_directories(folder / "out" / "mine");
  write_text("kept", folder / "out" / "mine" / "result.json");
  EXPECT_EQ(names(one), "result.json ");
  EXPECT_EQ(names(two), "roll_0/result.json roll_45/result.json ");
  EXPECT_EQ(names(one), "result.json ");
  EXPECT_EQ(read_text(folder / "out" / "mine" / "result.json"), "kept");
  two["insertion"]["roll_deg"] = {45, 45.0000000001};
  write_json(two, folder / "scene.json");
  EXPECT_TRUE(holds(run_program(folder.path(), "check scene.json").log, "each roll once"));
}

}  // namespace
}  // namespace wireplan::pipeline
