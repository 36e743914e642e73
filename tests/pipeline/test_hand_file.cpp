// What the hand does in a scene: moves, rolls and the line that a wire starts from, as they are
// read, and what is said about mistakes in them.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/pipeline/case_texts.h"

namespace wireplan::pipeline {
namespace {

/// A wire of 40 mm, pushed in by 30 mm in steps of 0.5 mm.
Json slid_wire() {
  Json json = {{"schema", "wireplan.scene/1"}};
  json["wire"] = {
      {"elements", 20},
      {"sections",
       Json::array({{{"length_mm", 40}, {"bending_stiffness_n_mm2", 10}, {"radius_mm", 0.4}}})}};
  json["vessel"] = {{"surface", {{"path", "vessel.stl"}, {"unit", "mm"}, {"frame", "LPS"}}}};
  json["insertion"] = {{"point_mm", {0, 0, 0}},
                       {"direction", {0, 0, 1}},
                       {"length_mm", 30},
                       {"step_mm", 0.5},
                       {"roll_deg", 90}};
  return json;
}

TEST_F(CaseFile, MovesRollsAndStartOfAnInsertionAreRead) {
  Json json = slid_wire();
  json["insertion"].erase("length_mm");
  json["insertion"]["moves"] = Json::array({{{"push_mm", 30}},
                                            {{"pull_mm", 5}},
                                            {{"turn_deg", -90}},
                                            {{"push_mm", 2}, {"turn_deg", 45}}});
  json["insertion"]["roll_deg"] = {0, 45, -90};
  const InsertionScene moved = *read_scene(write("scene.json", json.dump())).insertion;
  ASSERT_EQ(moved.moves.size(), 4u);
  EXPECT_EQ(moved.moves[1].push, -5.0);
  EXPECT_DOUBLE_EQ(moved.moves[2].turn, -0.5 * kPi);
  EXPECT_EQ(moved.moves[3].push, 2.0);
  EXPECT_DOUBLE_EQ(moved.moves[3].turn, 0.25 * kPi);
  EXPECT_EQ(moved.options.length, 30.0) << "the deepest that the wire goes";
  ASSERT_EQ(moved.rolls.size(), 3u);
  EXPECT_DOUBLE_EQ(moved.rolls[2] - moved.roll_zero, -0.5 * kPi);
  EXPECT_FALSE(moved.start);

  // From behind the point, 2 mm beside it, 20 mm on.
  json = slid_wire();
  json["insertion"].erase("length_mm");
  json["insertion"].erase("roll_deg");
  json["start"] = {{"nodes_mm", {{2, 0, -4}, {2, 0, 0}, {2, 0, 10}, {0, 0, 18}}}};
  const InsertionScene lying = *read_scene(write("scene.json", json.dump())).insertion;
  ASSERT_TRUE(lying.start);
  EXPECT_NEAR(lying.start->length, std::hypot(2.0, 10.0) + std::hypot(2.0, 8.0), 1e-12);
  EXPECT_TRUE(lying.start->find_roll);
  EXPECT_EQ(lying.start->nodes.cols(), 4);
  EXPECT_EQ(lying.depth, lying.start->length) << "no move";
  json["insertion"]["length_mm"] = 12;
  json["insertion"]["roll_deg"] = 30;
  json["start"]["length_mm"] = 18;
  const InsertionScene pulled = *read_scene(write("scene.json", json.dump())).insertion;
  EXPECT_EQ(pulled.depth, 12.0);
  EXPECT_EQ(pulled.start->length, 18.0);
  EXPECT_EQ(pulled.options.length, 18.0);
  EXPECT_FALSE(pulled.start->find_roll);
}

Json moved_wire() {
  Json json = slid_wire();
  json["insertion"].erase("length_mm");
  json["insertion"]["moves"] = Json::array({{{"push_mm", 30}}, {{"pull_mm", 10}}});
  return json;
}

Json lying_wire() {
  Json json = slid_wire();
  json["insertion"].erase("length_mm");
  json["start"] = {{"nodes_mm", {{0, 0, 0}, {0, 0, 10}, {1, 0, 20}}}};
  return json;
}

TEST_F(SceneMistakes, OfMovesRollsAndStartsAreTold) {
  const std::vector<Mistake> mistakes = {
      {slid_wire(), "/loads/gravity_m_per_s2", {0, 0, -9.81}, {"gravity", "mass_kg_per_m"}},
      {moved_wire(), "/insertion/step_mm", 1e-9, {"step_mm is 1e-09", "at least 4e-05"}},
      {slid_wire(), "/insertion/step_mm", 1e-9, {"step_mm is 1e-09", "at least 3e-05"}},
      {moved_wire(), "/insertion/moves", Json::array(), {"insertion.moves is", "one move"}},
      {moved_wire(), "/insertion/moves", 30, {"insertion.moves is 30"}},
      {moved_wire(), "/insertion/length_mm", 30, {"length_mm is given beside moves", "delete"}},
      {moved_wire(), "/insertion/moves/0/push_mm", -3, {"moves[0].push_mm is -3", "above 0"}},
      {moved_wire(), "/insertion/moves/0/push_mm", 50, {"moves[0].push_mm is 50", "at most 40"}},
      {moved_wire(), "/insertion/moves/1/pull_mm", 30, {"moves[1].pull_mm is 30", "at most 29.5"}},
      {moved_wire(), "/insertion/moves/1/push_mm", 3, {"pull_mm is given beside push_mm"}},
      {moved_wire(), "/insertion/moves/1", Json::object(), {"moves[1].push_mm is missing"}},
      {moved_wire(), "/insertion/moves/1/turn_deg", 0, {"moves[1].turn_deg is 0"}},
      {moved_wire(), "/insertion/moves/1/turn", 5, {"moves[1].turn is not a known key"}},
      {moved_wire(),
       "/insertion/moves/0",
       {{"turn_deg", 20}},
       {"moves[0].turn_deg is given before a push", "roll_deg"}},
      {slid_wire(), "/insertion/roll_deg", {0, 90, 0}, {"roll_deg[2] is 0", "each roll once"}},
      {slid_wire(), "/insertion/roll_deg", {0, 400}, {"roll_deg[1] is 400", "to 360"}},
      {slid_wire(), "/insertion/roll_deg", Json::array(), {"insertion.roll_deg is []"}},
      {lying_wire(), "/start/nodes_mm", {{0, 0, 0}}, {"start.nodes_mm is one point", "two"}},
      {lying_wire(), "/start/nodes_mm/1", {0, 0}, {"start.nodes_mm[1] is [0,0]"}},
      {lying_wire(), "/start/nodes", 1, {"start.nodes is not a known key"}},
      {lying_wire(), "/start/length_mm", 30, {"start.length_mm is 30", "within 5 %"}},
      {lying_wire(), "/start/length_mm", 60, {"start.length_mm is 60", "at most the wire's"}},
      {lying_wire(),
       "/start/nodes_mm",
       {{0, 30, 0}, {0, 30, 20}},
       {"start.nodes_mm is 30.0 mm from insertion.point_mm", "move the point"}},
      {lying_wire(),
       "/start/nodes_mm",
       {{0, 0, 20}, {0, 0, 0}},
       {"start.nodes_mm is 0 mm long", "the other order"}},
      {lying_wire(),
       "/start/nodes_mm",
       {{0, 0, 0}, {0, 0, 70}},
       {"start.nodes_mm is 70 mm long", "make the wire longer"}},
      {lying_wire(), "/insertion/length_mm", 50, {"insertion.length_mm is 50", "40"}},
  };
  expect_each_told(mistakes);
}

/// In a vessel that moves as a whole, with the line along which the wire was seen.
Json measured_wire() {
  Json json = slid_wire();
  json["vessel"]["wall"]["support_kpa_per_mm"] = 1;
  json["measured"] = {{"nodes_mm", {{0, 0, -5}, {0, 0, 10}, {0, 0, 30}}}, {"sigma_mm", 0.5}};
  return json;
}

TEST_F(SceneMistakes, OfAMeasuredWireAreTold) {
  const InsertionScene scene = *read_scene(write("scene.json", measured_wire().dump())).insertion;
  ASSERT_TRUE(scene.measured);
  EXPECT_EQ(scene.measured->sigma, 0.5);
  EXPECT_TRUE(scene.measured->line.col(0).isZero(1e-12));
  EXPECT_EQ(scene.measured->line.cols(), 3);

  const std::vector<Mistake> mistakes = {
      {measured_wire(), "/measured/sigma_mm", 0, {"measured.sigma_mm is 0", "0.01"}},
      {measured_wire(), "/measured/nodes_mm", {{0, 0, 0}}, {"measured.nodes_mm is one point"}},
      {measured_wire(),
       "/measured/nodes_mm",
       {{0, 0, 0}, {0, 0, 35}},
       {"measured.nodes_mm is 35 mm long", "30 mm, within 5 %"}},
      {measured_wire(),
       "/measured/nodes_mm",
       {{0, 0, 30}, {0, 0, 0}},
       {"measured.nodes_mm is 0 mm long", "the other order"}},
      {measured_wire(), "/measured/nodes", 1, {"measured.nodes is not a known key"}},
      {measured_wire(),
       "/vessel/wall/support_kpa_per_mm",
       nullptr,
       {"vessel.wall.support_kpa_per_mm is null", "measured"}},
      {measured_wire(), "/insertion/roll_deg", {0, 90}, {"insertion.roll_deg is 2 rolls"}},
      {measured_wire(), "/target", {{"point_mm", {0, 0, 9}}}, {"target is given beside measured"}},
  };
  expect_each_told(mistakes);
}

}  // namespace
}  // namespace wireplan::pipeline
