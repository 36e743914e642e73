// The support of a vessel by a wire that was measured in it: a computed wire stands for that.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "pipeline/commands/scene_sensitivity.h"
#include "pipeline/commands/scene_support.h"
#include "pipeline/stages/held_places.h"
#include "tests/messages.h"
#include "tests/shapes.h"

namespace wireplan::pipeline {
namespace {

/// A stiff wire pushed into a vessel of 4 mm radius that bends by 60 degrees and moves with it.
struct HeldBend {
  std::vector<preprocess::Branch> tree;
  WallInput wall;
  simulate::VesselModel vessel;
  InsertionScene scene;

  HeldBend()
      : tree({{.line = line()}}),
        vessel(shapes::tube(tree[0].line.points, tree[0].line.radius, 16), {.grid_spacing = 0.8}) {
    wall.held.clear();
    wall.extrusion.thickness_mm = 1.0;
    scene.wire = {
        .name = "stiff", .radius = 0.45, .sections = {{.length = 130, .bending_stiffness = 800}}};
    scene.introducer = {.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ()};
    scene.goal = {.point = Vec3(0.0, 0.0, -1e6), .radius = 1.0};
    scene.options = {.length = 110.0, .step = 5.0, .element_length = 2.0, .contact_spacing = 2.0};
  }

  static Centerline line() {
    const Eigen::Matrix3Xd axis = shapes::bend_axis(40.0, kPi / 3.0, 40.0, 60.0, 2.0);
    return {axis, Eigen::VectorXd::Constant(axis.cols(), 4.0), arc_length_of(axis)};
  }

  /// Where the wire lies with a support [kPa/mm].
  Eigen::Matrix3Xd wire_with(double support) {
    wall.support = support * kMpaPerKpa;
    vessel.sections = make_section_chain(wall, tree, scene.introducer.point, kYoung);
    return run_hand(scene, vessel, scene.options).nodes;
  }
  SceneSupport find() { return find_scene_support(scene, wall, tree, kYoung, vessel); }

  static constexpr double kYoung = 0.3;  // [MPa]
};

TEST(SceneSupport, IsFoundFromAWireThatWasComputedWithIt) {
  HeldBend bend;
  const Eigen::Matrix3Xd soft = bend.wire_with(0.05), stiff = bend.wire_with(2.0);
  ASSERT_GT(largest_distance(soft, stiff), 2.0) << "a wire that tells";
  for (const auto& [wire, support] : {std::pair(soft, 0.05), std::pair(stiff, 2.0)}) {
    SCOPED_TRACE(support);
    bend.scene.measured = {.line = wire, .sigma = 0.2};
    const SceneSupport found = bend.find();
    EXPECT_NEAR(std::log10(found.support / kMpaPerKpa / support), 0.0, 0.05);
    EXPECT_LT(found.json.at("rms_mm").get<double>(), 0.05);
    EXPECT_EQ(found.json.at("places"), 10);
    if (!found.json.at("low_kpa_per_mm").is_null()) {
      EXPECT_LT(found.json.at("low_kpa_per_mm").get<double>(), support);
    }
    if (!found.json.at("high_kpa_per_mm").is_null()) {
      EXPECT_GT(found.json.at("high_kpa_per_mm").get<double>(), support);
    }
    EXPECT_NE(found.line.find("95 % interval from "), std::string::npos);
  }
}

TEST(SceneSupport, OfAMeasurementWithNoiseIsWithinItsInterval) {
  HeldBend bend;
  Eigen::Matrix3Xd wire = bend.wire_with(0.05);
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.3);
  for (Eigen::Index k = 1; k < wire.cols(); ++k) {
    for (int d = 0; d < 3; ++d) wire(d, k) += noise(random);
  }
  bend.scene.measured = {.line = wire, .sigma = 0.3};
  const SceneSupport found = bend.find();
  ASSERT_FALSE(found.json.at("high_kpa_per_mm").is_null());
  EXPECT_GT(found.json.at("high_kpa_per_mm").get<double>(), 0.05);
  const Json& low = found.json.at("low_kpa_per_mm");
  EXPECT_TRUE(low.is_null() ? found.json.contains("low_kpa_per_mm_reason") : low < 0.05);
  EXPECT_NEAR(found.json.at("rms_mm").get<double>(), 0.3, 0.2);
}

}  // namespace
}  // namespace wireplan::pipeline
