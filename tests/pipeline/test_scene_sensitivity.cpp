// Whether an insertion's end hangs on how it is solved: when it is looked for, and when it is told.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "pipeline/commands/scene_sensitivity.h"
#include "tests/shapes.h"

namespace wireplan::pipeline {
namespace {

Eigen::Matrix3Xd even_nodes(const Vec3& a, const Vec3& b, int nodes) {
  Eigen::Matrix3Xd points(3, nodes);
  for (int i = 0; i < nodes; ++i) points.col(i) = a + double(i) / (nodes - 1) * (b - a);
  return points;
}

const Vec3 kFork(0.0, 0.0, 20.0), kLeft(-25.0, 0.0, 60.0), kRight(25.0, 0.0, 60.0);

/// A trunk up from the origin that forks into two branches of 3 mm radius.
const simulate::VesselModel& forked_vessel() {
  static const simulate::VesselModel vessel(
      shapes::level_set(
          [](const Vec3& p) {
            return std::max({shapes::depth_in_tube(p, Vec3(0.0, 0.0, -2.0), kFork, 4.0),
                             shapes::depth_in_tube(p, kFork - 2.0 * Vec3::UnitZ(), kLeft, 3.0),
                             shapes::depth_in_tube(p, kFork - 2.0 * Vec3::UnitZ(), kRight, 3.0)});
          },
          Vec3(-32.0, -6.0, -6.0), Vec3(32.0, 6.0, 66.0), 1.0),
      {.grid_spacing = 0.8});
  return vessel;
}

/// Into the trunk, aslant toward the left branch or the right one.
InsertionScene aslant_to(double side) {
  InsertionScene scene;
  scene.wire = {
      .name = "wire", .radius = 0.4, .sections = {{.length = 60.0, .bending_stiffness = 30.0}}};
  scene.introducer = {.point = Vec3(0.0, 0.0, 4.0),
                      .direction = Vec3(0.25 * side, 0.0, 1.0).normalized()};
  scene.goal = {.point = Vec3(0.0, 0.0, -1e6), .radius = 1.0};
  scene.options = {.length = 45.0, .element_length = 0.75};
  return scene;
}

simulate::TrialResult run_insertion(const InsertionScene& scene) {
  return simulate::run_trial(scene.wire, scene.introducer, scene.goal, forked_vessel(),
                             scene.options);
}

TEST(SceneSensitivity, DistanceOfShapesIsThatOfLinesNotOfTheirNodes) {
  const Vec3 end(0.0, 0.0, 30.0), aside(2.0, 0.0, 0.0);
  EXPECT_NEAR(largest_distance(even_nodes(Vec3::Zero(), end, 4), even_nodes(Vec3::Zero(), end, 31)),
              0.0, 1e-12);
  EXPECT_NEAR(
      largest_distance(even_nodes(Vec3::Zero(), end, 7), even_nodes(aside, aside + end, 11)), 2.0,
      1e-12);
  // One that came less far, either way round.
  const Eigen::Matrix3Xd whole = even_nodes(Vec3::Zero(), end, 7),
                         part = even_nodes(Vec3::Zero(), 0.5 * end, 5);
  EXPECT_NEAR(largest_distance(whole, part), 15.0, 1e-12);
  EXPECT_NEAR(largest_distance(part, whole), 15.0, 1e-12);
}

TEST(SceneSensitivity, OneBranchIsWhereAWirePassesTheTipOfTheOther) {
  const simulate::Lumen& lumen = forked_vessel().lumen;
  const auto into = [](const Vec3& branch, double part) -> Eigen::Matrix3Xd {
    Eigen::Matrix3Xd wire(3, 40);
    wire << even_nodes(Vec3(0.0, 0.0, 4.0), kFork, 20),
        even_nodes(kFork, kFork + part * (branch - kFork), 20);
    return wire;
  };
  EXPECT_FALSE(in_one_branch(into(kLeft, 0.9), into(kRight, 0.9), lumen));
  EXPECT_FALSE(in_one_branch(into(kLeft, 0.5), into(kRight, 0.9), lumen));
  EXPECT_TRUE(in_one_branch(into(kLeft, 0.9), into(kLeft, 0.4), lumen));
  EXPECT_TRUE(in_one_branch(into(kLeft, 0.4), into(kLeft, 0.9), lumen));
  EXPECT_TRUE(in_one_branch(into(kLeft, 0.9), into(kRight, 0.01), lumen));  // still in the fork
  // Straight on past a branch that the other took: it is seen from afar, but not in one place.
  const simulate::VesselModel side(
      shapes::level_set(
          [](const Vec3& p) {
            return std::max(
                shapes::depth_in_tube(p, Vec3(0.0, 0.0, -2.0), Vec3(0.0, 0.0, 60.0), 4.0),
                shapes::depth_in_tube(p, kFork, Vec3(30.0, 0.0, 20.0), 3.0));
          },
          Vec3(-6.0, -6.0, -6.0), Vec3(34.0, 6.0, 66.0), 1.0),
      {.grid_spacing = 0.8});
  const auto turned = [](double out) -> Eigen::Matrix3Xd {
    Eigen::Matrix3Xd wire(3, 40);
    wire << even_nodes(Vec3(0.0, 0.0, 4.0), kFork, 20),
        even_nodes(kFork, kFork + out * Vec3::UnitX(), 20);
    return wire;
  };
  const Eigen::Matrix3Xd on = even_nodes(Vec3(1.0, 0.0, 4.0), Vec3(1.0, 0.0, 50.0), 40);
  EXPECT_FALSE(in_one_branch(on, turned(25.0), side.lumen));
  EXPECT_TRUE(in_one_branch(on, turned(2.0), side.lumen));
}

TEST(SceneSensitivity, AnInsertionThatDoesNotHangOnItsStepsIsSaidToBeSo) {
  InsertionScene scene = aslant_to(1.0);
  const simulate::TrialResult result = run_insertion(scene);
  ASSERT_GT(result.nodes(0, result.nodes.cols() - 1), 8.0) << "in the right branch";
  const Sensitivity found = check_sensitivity(scene, forked_vessel(), result);
  EXPECT_EQ(found.warning, "");
  EXPECT_FALSE(found.json.at("sensitive"));
  const Json& runs = found.json.at("runs");
  ASSERT_EQ(runs.size(), 5u);
  EXPECT_EQ(runs[0].at("changed"), "insertion.step_mm");
  EXPECT_EQ(runs[0].at("value_mm"), 0.25);
  EXPECT_EQ(runs[3].at("value_mm"), 4.0);
  EXPECT_EQ(runs[4].at("changed"), "element_length_mm");
  EXPECT_NEAR(runs[4].at("value_mm").get<double>(), 0.675, 1e-12);
  double largest = 0.0;
  for (const Json& row : runs) {
    EXPECT_TRUE(row.at("same_branch"));
    EXPECT_TRUE(row.at("same_outcome"));
    largest = std::max(largest, row.at("largest_distance_mm").get<double>());
  }
  EXPECT_EQ(found.json.at("largest_distance_mm"), largest);
  EXPECT_GT(largest, 0.0) << "other runs they are";
  EXPECT_LE(largest, 1.0);

  scene.check_sensitivity = false;
  const Sensitivity none = check_sensitivity(scene, forked_vessel(), result);
  EXPECT_TRUE(none.json.is_null());
  EXPECT_EQ(none.reason, "check_sensitivity is false");
}

TEST(SceneSensitivity, ALongSceneIsCheckedWhereItSaysSo) {
  InsertionScene scene = aslant_to(1.0);
  simulate::TrialResult result = run_insertion(scene);
  for (simulate::Push& push : result.pushes) push.iterations = 100000;  // as of one that took long
  const Sensitivity none = check_sensitivity(scene, forked_vessel(), result);
  EXPECT_TRUE(none.json.is_null());
  EXPECT_NE(none.reason.find("check_sensitivity: true"), std::string::npos);
  scene.check_sensitivity = true;
  EXPECT_EQ(check_sensitivity(scene, forked_vessel(), result).json.at("runs").size(), 5u);
}

TEST(SceneSensitivity, ARunThatDoesNotGetInIsTold) {
  InsertionScene scene = aslant_to(1.0);
  const simulate::TrialResult result = run_insertion(scene);
  // Against the wall at once, where no other run comes to an equilibrium.
  scene.introducer.point = Vec3(2.55, 0.0, 8.0);
  scene.introducer.direction = Vec3::UnitX();
  scene.options.max_iterations = 0;
  const Sensitivity found = check_sensitivity(scene, forked_vessel(), result);
  EXPECT_TRUE(found.json.at("sensitive"));
  const Json& row = found.json.at("runs").at(3);  // 4 mm at once: its first push is taken back
  EXPECT_EQ(row.at("outcome"), "not_converged");
  EXPECT_EQ(row.at("tip_mm"), to_json(scene.introducer.point));
  EXPECT_GT(row.at("tip_distance_mm").get<double>(), 20.0);
}

TEST(SceneSensitivity, ElementsAreToldByTheSceneWhereTheTipHasNoneOfItsOwn) {
  InsertionScene scene = aslant_to(1.0);
  scene.wire.sections = {{.length = 20.0, .bending_stiffness = 30.0},
                         {.length = 40.0, .bending_stiffness = 30.0}};
  scene.options.section_element_length = {0.0, 1.0};
  const Json rows = check_sensitivity(scene, forked_vessel(), run_insertion(scene)).json.at("runs");
  EXPECT_NEAR(rows[4].at("value_mm").get<double>(), 0.9 * scene.options.element_length, 1e-12);
}

TEST(SceneSensitivity, AnotherBranchIsTold) {
  // As if the first run had gone left.
  const InsertionScene scene = aslant_to(1.0);
  const Sensitivity found =
      check_sensitivity(scene, forked_vessel(), run_insertion(aslant_to(-1.0)));
  EXPECT_TRUE(found.json.at("sensitive"));
  EXPECT_GT(found.json.at("largest_distance_mm"), 15.0);
  for (const Json& row : found.json.at("runs")) EXPECT_FALSE(row.at("same_branch"));
  EXPECT_NE(
      found.warning.find("hangs on how it is solved: with insertion.step_mm 0.25 it ends up to "),
      std::string::npos)
      << found.warning;
  EXPECT_NE(found.warning.find("in another branch; with insertion.step_mm 2 "), std::string::npos)
      << found.warning;
}

}  // namespace
}  // namespace wireplan::pipeline
