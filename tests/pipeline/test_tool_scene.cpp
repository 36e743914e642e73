// Scenes of several tools: what is read, in which units, what is said about mistakes, and what
// comes out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "pipeline/commands/scene_run.h"
#include "pipeline/files/scene_file.h"
#include "preprocess/files/vessel_io.h"
#include "tests/pipeline/case_texts.h"

namespace wireplan::pipeline {
namespace {

Json curved_catheter() {
  const Json tip = {{"length_mm", 30},
                    {"bending_stiffness_n_mm2", 332},
                    {"rest_curvature_per_mm", 1.0 / 15.0}},
             shaft = {{"length_mm", 400}, {"bending_stiffness_n_mm2", 332}};
  return {{"name", "catheter"},
          {"outer_diameter_mm", 1.667},
          {"inner_diameter_mm", 0.991},
          {"insertion_mm", 60},
          {"sections", Json::array({tip, shaft})}};
}

Json straight_wire() {
  return {{"name", "wire"},
          {"outer_diameter_mm", 0.889},
          {"insertion_mm", 90},
          {"sections", Json::array({{{"length_mm", 1000}, {"bending_stiffness_n_mm2", 150}}})}};
}

Json wire_in_catheter() {
  return {{"schema", "wireplan.scene/1"},
          {"tools", Json::array({curved_catheter(), straight_wire()})},
          {"introducer", {{"point_mm", {0, 0, 5}}, {"direction", {0, 0, 2}}}},
          {"moves", Json::array({{{"tool", "wire"}, {"push_mm", -80}}})}};
}

TEST_F(CaseFile, ToolsAreReadInInternalUnits) {
  Json json = wire_in_catheter();
  json["tools"][0]["roll_deg"] = 90;
  json["friction_between_tools"] = 0.1;
  json["element_length_mm"] = 2;
  json["tools"][1]["sections"][0]["mass_kg_per_m"] = 0.003;
  json["loads"] = {{"gravity_m_per_s2", {0, -9.81, 0}}};
  json["moves"].push_back(
      {{"together", Json::array({{{"tool", "wire"}, {"turn_deg", 180}},
                                 {{"tool", "catheter"}, {"push_mm", 7}, {"turn_deg", -90}}})}});
  const SceneFile file = read_scene(write("scene.json", json.dump()));
  ASSERT_TRUE(file.tools);
  EXPECT_FALSE(file.bench || file.insertion || file.vessel);
  const simulate::ToolScene& scene = file.tools->scene;
  ASSERT_EQ(scene.tools.size(), 2u);
  EXPECT_EQ(scene.tools[0].wire.name, "catheter");
  EXPECT_DOUBLE_EQ(scene.tools[0].wire.radius, 0.8335);
  EXPECT_DOUBLE_EQ(scene.tools[0].inner_radius, 0.4955);
  EXPECT_DOUBLE_EQ(scene.tools[0].wire.sections[0].rest_curvature, 1.0 / 15.0);
  EXPECT_EQ(scene.tools[1].inner_radius, 0.0);
  EXPECT_EQ(scene.places[0].insertion, 60.0);
  EXPECT_NEAR(scene.places[0].roll - file.tools->roll_zero, 0.5 * kPi, 1e-12);
  EXPECT_EQ(scene.direction, Vec3(0.0, 0.0, 1.0));
  EXPECT_EQ(scene.friction, 0.1);
  EXPECT_EQ(scene.element_length, 2.0);
  EXPECT_EQ(scene.loads.gravity.y(), -9810.0);
  ASSERT_EQ(scene.moves.size(), 2u);
  EXPECT_EQ(scene.moves[0].push, std::vector<double>({0.0, -80.0}));
  EXPECT_EQ(scene.moves[1].push, std::vector<double>({7.0, 0.0}));
  EXPECT_NEAR(scene.moves[1].turn[0], -0.5 * kPi, 1e-12);
  EXPECT_NEAR(scene.moves[1].turn[1], kPi, 1e-12);
}

TEST_F(CaseFile, CathetersAndWiresOfTheCatalogueAreTools) {
  for (const Catheter& catheter : catalogue().catheters) {
    Json json = wire_in_catheter();
    json["tools"] =
        Json::array({{{"device", catheter.tube.name}, {"insertion_mm", 50}},
                     {{"device", "floppy-014"}, {"name", "wire"}, {"insertion_mm", 100}}});
    const simulate::ToolScene scene = read_scene(write("scene.json", json.dump())).tools->scene;
    EXPECT_EQ(scene.tools[0].wire.length(), catheter.tube.length());
    EXPECT_EQ(scene.tools[0].inner_radius, 0.5 * catheter.inner_diameter);
    EXPECT_EQ(scene.tools[0].wire.name, catheter.tube.name);
    EXPECT_EQ(scene.tools[1].wire.name, "wire");
  }
}

class ToolMistakes : public CaseFile {
 protected:
  struct Row {
    std::string said;
    std::function<void(Json&)> spoil;
  };
  void expect_told(const std::vector<Row>& rows) const {
    for (const Row& row : rows) {
      Json json = wire_in_catheter();
      EXPECT_EQ(scene_problem(json), "");
      row.spoil(json);
      const std::string said = scene_problem(json);
      EXPECT_NE(said.find(row.said), std::string::npos) << row.said << "\n  but:\n" << said;
    }
  }
};

TEST_F(ToolMistakes, AreToldByKey) {
  const std::vector<Row> rows = {
      {"tools[1] is 1.2 mm thick, expected less than the inner diameter of \"catheter\" round it, "
       "0.991 mm (tools are listed from the outside in)",
       [](Json& json) { json["tools"][1]["outer_diameter_mm"] = 1.2; }},
      {"tools[1] is 0.889 mm thick, expected an inner_diameter_mm of \"catheter\" round it",
       [](Json& json) { json["tools"][0].erase("inner_diameter_mm"); }},
      {"tools[0].inner_diameter_mm is 2.0, expected less than outer_diameter_mm, 1.667",
       [](Json& json) { json["tools"][0]["inner_diameter_mm"] = 2; }},
      {"tools[1].name is \"catheter\", expected a name that no other tool has",
       [](Json& json) { json["tools"][1]["name"] = "catheter"; }},
      {"tools[1].name is \"a/b\", expected at most 80 letters, digits, - and _",
       [](Json& json) { json["tools"][1]["name"] = "a/b"; }},
      {"moves[0].tool is \"wir\", expected the name of one of the tools (did you mean \"wire\"?)",
       [](Json& json) { json["moves"][0]["tool"] = "wir"; }},
      {"moves[0].push_mm is 0, and turn_deg too, expected one of them other than 0",
       [](Json& json) { json["moves"][0].erase("push_mm"); }},
      {"moves[0].together[1].tool is \"wire\", expected each tool once in a move",
       [](Json& json) {
         json["moves"][0] = {{"together", Json::array({{{"tool", "wire"}, {"push_mm", 1}},
                                                       {{"tool", "wire"}, {"turn_deg", 1}}})}};
       }},
      {"moves[0] is an insertion of -10.0 mm, expected 0 to the length of \"wire\", 1000.0 mm",
       [](Json& json) { json["moves"][0]["push_mm"] = -100; }},
      {"moves[0] is an insertion of 490.0 mm, expected 0 to the length of \"catheter\", 430.0 mm",
       [](Json& json) {
         json["moves"][0] = {{"tool", "catheter"}, {"push_mm", 430}};
       }},
      {"tools[0].insertion_mm is 0.5 mm of the foremost tool, expected at least 1.0 mm",
       [](Json& json) {
         json["tools"][0]["insertion_mm"] = 0.5;
         json["tools"][1]["insertion_mm"] = 0;
       }},
      {"tools[0].device is \"cobra-c22\", expected a wire or catheter of the catalogue (did you "
       "mean \"cobra-c2\"?)",
       [](Json& json) {
         json["tools"][0] = {{"device", "cobra-c22"}, {"insertion_mm", 60}};
       }},
      {"supports[0].kind is guided, or with a roll_deg, expected clamped or pinned",
       [](Json& json) {
         json["supports"] =
             Json::array({{{"at", "distal"}, {"kind", "guided"}, {"point_mm", {0, 0, 80}}}});
       }},
      {"supports[0].at is not the only distal one, expected one support, at the distal end",
       [](Json& json) {
         json["supports"] =
             Json::array({{{"at", "proximal"}, {"kind", "clamped"}, {"point_mm", {0, 0, 0}}}});
       }},
      {"insertion is given, expected no such key yet (insertions of several tools are not in this "
       "version; delete the key)",
       [](Json& json) { json["insertion"] = Json::object(); }},
      {"loads.tip_torque_n_mm is 1.0, expected 0 (turn a hub in a move)",
       [](Json& json) {
         json["loads"] = {{"tip_torque_n_mm", 1}};
       }},
      {"tools is of 4, expected 1 to 3, from the outside in",
       [](Json& json) {
         for (int k = 0; k < 2; ++k) json["tools"].push_back(straight_wire());
       }},
      {"introducer is missing", [](Json& json) { json.erase("introducer"); }},
      {"tools[0].friction is 0.1, expected no such key without a \"vessel\"",
       [](Json& json) { json["tools"][0]["friction"] = 0.1; }},
  };
  expect_told(rows);
  // All of them at once.
  Json json = wire_in_catheter();
  json["tools"][1]["outer_diameter_mm"] = 1.2;
  json["moves"][0]["tool"] = "wir";
  json["friction_between_tools"] = 2;
  const std::string said = scene_problem(json);
  for (const char* key : {"tools[1]", "moves[0].tool", "friction_between_tools"}) {
    EXPECT_NE(said.find(key), std::string::npos) << key;
  }
}

TEST_F(ToolMistakes, AreToldOnceAndWithWhatHelps) {
  const std::vector<Row> rows = {
      {"tools[0].device is \"sheath-7f\", expected a wire or catheter of the catalogue (of sheaths "
       "it knows no stiffness; give name,",
       [](Json& json) {
         json["tools"][0] = {{"device", "sheath-7f"}, {"name", "catheter"}, {"insertion_mm", 9}};
       }},
      {"moves[0].push_mm is 1000000, expected a number from -10000 to 10000",
       [](Json& json) { json["moves"][0]["push_mm"] = 1000000; }},
      {"moves[0].pull_mm is 5, expected no such key (a push_mm below 0 pulls)",
       [](Json& json) {
         json["moves"][0] = {{"tool", "wire"}, {"pull_mm", 5}};
       }},
      {"tools[1].sections[0].tip_load_gf is 2.0, expected a section of at least 10 mm",
       [](Json& json) {
         json["tools"][1]["sections"][0] = {{"length_mm", 9}, {"tip_load_gf", 2}};
       }},
      {"tools is [], expected a list of objects",
       [](Json& json) {
         json["tools"] = Json::array();
         json.erase("moves");
       }},
  };
  expect_told(rows);
  for (const Row& row : rows) {
    Json json = wire_in_catheter();
    row.spoil(json);
    const std::string said = scene_problem(json);
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 0) << said;
  }
}

TEST_F(ToolMistakes, OfWhatDoesNothingAreTold) {
  expect_told(
      {{"vessel.contact_spacing_mm is 0.5, expected no such key (tools touch the wall at "
        "their nodes; give element_length_mm)",
        [](Json& json) {
          json["vessel"] = {{"surface", {{"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}}},
                            {"contact_spacing_mm", 0.5}};
        }}});
}

TEST_F(ToolMistakes, InWhatLoadsAndHoldsThemAreTold) {
  expect_told({
      {"plane_normal is [0.0,0.0,1.0], expected a plane that the supports lie in",
       [](Json& json) {
         json["plane_normal"] = {0, 0, 1};  // square to nothing: the introducer is along z
       }},
      {"loads.tip_moment_n_mm is along the wire, expected an axis across it",
       [](Json& json) {
         for (Json& tool : json["tools"]) {
           for (Json& section : tool["sections"]) section.erase("rest_curvature_per_mm");
         }
         json["loads"] = {{"tip_moment_n_mm", {0, 0, 1}}};
       }},
      {"loads.gravity_m_per_s2 is not 0, expected a wire with a mass (give mass_kg_per_m in "
       "tools[].sections)",
       [](Json& json) {
         json["loads"] = {{"gravity_m_per_s2", {0, -9.81, 0}}};
       }},
      {"moves[0] is 60.0 mm of the foremost tool, expected as much as from the introducer to "
       "supports[0], 75.0 mm",
       [](Json& json) {
         json["supports"] =
             Json::array({{{"at", "distal"}, {"kind", "pinned"}, {"point_mm", {0, 0, 80}}}});
       }},
  });
}

TEST_F(CaseFile, CatheterTakesItsCurveAsTheWireIsWithdrawn) {
  const SceneFile file = read_scene(write("scene.json", wire_in_catheter().dump()));
  const SceneAnswer answer = run_scene_file(file, folder_ / "out");
  EXPECT_TRUE(answer.solved) << answer.line;
  for (const char* name : {"catheter.vtp", "wire.vtp", "wire.png"}) {
    EXPECT_TRUE(fs::exists(folder_ / "out" / name)) << name;
  }
  std::ifstream stream(folder_ / "out" / "result.json");
  const Json result = Json::parse(stream);
  EXPECT_EQ(result["outcome"], "converged");
  ASSERT_EQ(result["moves"].size(), 2u);

  // Over the wire it keeps 0.689 of its curvature, without it turns by 30 mm / 15 mm.
  const auto bend_of = [](const Json& tools) {
    const Json& tip = tools[0]["tip_mm"];
    return std::hypot(tip[0].get<double>(), tip[1].get<double>());
  };
  const double over = 332.0 / 482.0 / 15.0, free = 1.0 / 15.0;
  EXPECT_NEAR(bend_of(result["moves"][0]["tools"]), (1.0 - std::cos(30.0 * over)) / over, 0.05);
  EXPECT_NEAR(bend_of(result["tools"]), (1.0 - std::cos(30.0 * free)) * 15.0, 0.05);
  // It bends toward anterior.
  EXPECT_LT(result["tools"][0]["tip_mm"][1].get<double>(), -10.0);
  EXPECT_EQ(result["tools"][1]["insertion_mm"], 10.0);

  // At the foremost node the catheter is alone, at the first both are.
  EXPECT_EQ(result["tools_at_nodes"].size(), result["nodes_mm"].size());
  EXPECT_EQ(result["tools_at_nodes"].front(), Json({"catheter", "wire"}));
  EXPECT_EQ(result["tools_at_nodes"].back(), Json::array({"catheter"}));
  // The hands get back what bent the wire: k_c k_w / (2 (k_c + k_w)) kappa^2 over 30 mm.
  const double stored = 0.5 * 332.0 * 150.0 / 482.0 / 225.0 * 30.0;
  EXPECT_NEAR(result["hand_work_n_mm"].get<double>(), -stored, 0.01 * stored);
}

TEST_F(CaseFile, ToolsInAVesselTellWhatEachDoesToTheWall) {
  write_stl(shapes::bend_tube(4.0, 30.0, 0.5 * kPi, 20.0, 40.0, 1.5), folder_ / "bend.stl");
  Json json = wire_in_catheter();
  json["tools"][0]["insertion_mm"] = 8;
  json["tools"][1]["insertion_mm"] = 12;
  json["tools"][1]["friction"] = 0.05;
  json["vessel"] = {{"surface", {{"path", "bend.stl"}, {"unit", "mm"}, {"frame", "LPS"}}},
                    {"friction", 0.1}};
  json["moves"] = Json::array({{{"together", Json::array({{{"tool", "catheter"}, {"push_mm", 40}},
                                                          {{"tool", "wire"}, {"push_mm", 55}}})}}});
  const SceneFile file = read_scene(write("scene.json", json.dump()));
  ASSERT_TRUE(file.tools && file.vessel);
  EXPECT_EQ(file.tools->scene.contact.friction, 0.1);
  EXPECT_FALSE(file.tools->scene.tools[0].wire.friction);
  EXPECT_EQ(file.tools->scene.tools[1].wire.friction, 0.05);
  EXPECT_EQ(check_scene_vessel(file).size(), 0u);
  const SceneAnswer answer = run_scene_file(file, folder_ / "out");
  EXPECT_TRUE(answer.solved) << answer.line;
  std::ifstream stream(folder_ / "out" / "result.json");
  const Json result = Json::parse(stream);
  double on_tools = 0.0, at_contacts = 0.0;
  for (const Json& tool : result["tools"]) {
    on_tools += tool["wall_force_n"].get<double>();
  }
  for (const Json& contact : result["contacts"]) {
    const Vec3 force = point_of(contact["normal_force_n"]);
    at_contacts += force.norm();
    EXPECT_GE(contact["triangle"].get<int>(), 0);
  }
  EXPECT_GT(on_tools, 0.01);
  EXPECT_NEAR(on_tools, at_contacts, 1e-9 * on_tools);
  EXPECT_EQ(result["vessel"]["friction"], 0.1);
  EXPECT_TRUE(fs::exists(folder_ / "out" / "forces.vtu"));

  // Outside the vessel it is refused by the key.
  json["introducer"]["point_mm"] = {0, 50, 5};
  const SceneFile outside = read_scene(write("scene.json", json.dump()));
  try {
    check_scene_vessel(outside);
    FAIL() << "tools outside the vessel were taken";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("introducer.point_mm is "), std::string::npos)
        << error.what();
  }
}

/// A straight tube along x that moves as a whole on 1 kPa/mm, as stiff near its access as
/// elsewhere.
Json soft_tube() {
  return {{"surface", {{"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}}},
          {"wall",
           {{"model", "elastic"},
            {"support_kpa_per_mm", 1},
            {"held", Json::array({{{"at", "access"}, {"factor", 1}}})}}}};
}

TEST_F(CaseFile, AVesselThatMovesIsShownAsItMoves) {
  Surface tube = shapes::straight_tube(5.0, 120.0, 2.5);
  tube.vertices.row(0).swap(tube.vertices.row(2));
  tube = shapes::inside_out(tube);  // mirrored, it faces inward
  write_stl(tube, folder_ / "tube.stl");
  // So heavy and so soft a wire that its weight w rests on the support alone: the vessel moves by
  // w / (pi R k_s), 1.875 mm.
  const double k_s = 1e-3, weight = 1.875 * kPi * 5.0 * k_s, gravity = weight / 1e-8 / 1e3;
  const Json section = {
      {"length_mm", 118}, {"bending_stiffness_n_mm2", 1}, {"mass_kg_per_m", 0.01}};
  Json scene = {{"schema", "wireplan.scene/1"},
                {"vessel", soft_tube()},
                {"loads", {{"gravity_m_per_s2", {0, 0, -gravity}}}}};
  const Json place = {{"point_mm", {3, 0, 0}}, {"direction", {1, 0, 0}}};

  Json pushed = scene;
  pushed["wire"] = {{"elements", 59}, {"sections", Json::array({section})}};
  pushed["wire"]["sections"][0]["radius_mm"] = 0.4;
  pushed["insertion"] = place;
  pushed["insertion"]["length_mm"] = 112;
  pushed["insertion"]["step_mm"] = 2;
  pushed["check_sensitivity"] = false;
  Json tools = scene;
  tools["introducer"] = place;
  tools["element_length_mm"] = 2;
  tools["tools"] = Json::array({{{"name", "vessel"},
                                 {"outer_diameter_mm", 0.8},
                                 {"insertion_mm", 12},
                                 {"sections", Json::array({section})}}});
  tools["moves"] =
      Json::array({{{"tool", "vessel"}, {"push_mm", 50}}, {{"tool", "vessel"}, {"push_mm", 50}}});
  for (const Json& json : {pushed, tools}) {
    const fs::path out = folder_ / (json.contains("tools") ? "tools" : "pushed");
    const SceneAnswer answer = run_scene_file(read_scene(write("scene.json", json.dump())), out);
    ASSERT_TRUE(answer.solved) << answer.line;
    const Json vessel = read_json(out / "result.json", "wireplan.result/1").at("vessel");
    EXPECT_EQ(vessel.at("support_kpa_per_mm"), 1.0);
    const double most = vessel.at("largest_shift_mm");  // where the wire comes to lie on it
    EXPECT_GT(most, 1.875);
    EXPECT_LT(most, 1.3 * 1.875);
    // The last of the series is moved so far, about its middle.
    int last = 0;
    while (fs::exists(out / "vessel" / (std::to_string(last + 1) + ".vtp"))) ++last;
    EXPECT_GE(last, json.contains("tools") ? 2 : 10);
    const Surface moved =
        preprocess::read_surface_artifact(out / "vessel" / (std::to_string(last) + ".vtp"));
    double shift = 0.0, count = 0.0;
    for (Eigen::Index k = 0; k < tube.vertices.cols(); ++k) {
      if (std::abs(tube.vertices(0, k) - 70.0) > 15.0) continue;
      shift += tube.vertices(2, k) - moved.vertices(2, k);
      ++count;
    }
    EXPECT_NEAR(shift / count, 1.875, 0.05 * 1.875);
    EXPECT_TRUE(fs::exists(out / "vessel.pvd"));
  }
  EXPECT_TRUE(fs::exists(folder_ / "tools" / "vessel.vtp")) << "the tool of that name";
  EXPECT_TRUE(fs::exists(folder_ / "tools" / "shapes-vessel" / "2.vtp"));
  EXPECT_TRUE(fs::exists(folder_ / "tools" / "shapes-vessel.pvd"));
}

TEST_F(CaseFile, ToolsThatLeaveTheImagedVesselAreToldItsEnd) {
  write_stl(shapes::straight_tube(4.0, 60.0, 2.0), folder_ / "tube.stl");
  Json json = wire_in_catheter();
  json["tools"] = Json::array({straight_wire()});
  json["tools"][0]["insertion_mm"] = 12;
  json["moves"] = Json::array({{{"tool", "wire"}, {"push_mm", 90}}});
  json["vessel"] = {{"surface", {{"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}}}};
  const SceneAnswer answer =
      run_scene_file(read_scene(write("scene.json", json.dump())), folder_ / "out");
  EXPECT_FALSE(answer.solved);
  EXPECT_NE(answer.line.find("a tool left the imaged vessel through its end at ("),
            std::string::npos)
      << answer.line;
  EXPECT_NE(answer.line.find("60.0) mm in moves[0]"), std::string::npos) << answer.line;
}

TEST_F(CaseFile, WarnsOfNoFrictionWhereNothingRubs) {
  write_stl(shapes::straight_tube(4.0, 60.0, 3.0), folder_ / "tube.stl");
  Json json = wire_in_catheter();
  json["tools"][0]["insertion_mm"] = 8;
  json["tools"][1]["insertion_mm"] = 12;
  json["moves"] = Json::array({{{"tool", "wire"}, {"push_mm", 2}}});
  json["vessel"] = {{"surface", {{"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}}}};
  for (const double friction : {0.0, 0.05}) {
    json["tools"][1]["friction"] = friction;
    run_scene_file(read_scene(write("scene.json", json.dump())), folder_ / "out");
    const Json result = read_json(folder_ / "out" / "result.json", "wireplan.result/1");
    const std::string warnings = result.at("warnings").dump();
    EXPECT_EQ(warnings.find("frictionless") != std::string::npos, friction == 0.0) << warnings;
    EXPECT_EQ(warnings.find("vessel.friction acts on no tool"), std::string::npos) << warnings;
    const std::string terms = result.at("terms").dump();
    EXPECT_EQ(terms.find("friction") != std::string::npos, friction > 0.0) << terms;
  }
  json["tools"][0]["friction"] = 0.1;
  json["vessel"]["friction"] = 0.2;
  run_scene_file(read_scene(write("scene.json", json.dump())), folder_ / "out");
  const Json result = read_json(folder_ / "out" / "result.json", "wireplan.result/1");
  EXPECT_NE(result.at("warnings").dump().find("vessel.friction acts on no tool"),
            std::string::npos);
}

TEST_F(CaseFile, InsertionWithoutATargetTellsWhereItsForcesAreRough) {
  write_stl(shapes::bend_tube(4.0, 20.0, 0.5 * kPi, 30.0, 60.0, 1.5), folder_ / "bend.stl");
  int rough = 0;
  for (const double stiffness : {-50.0, 50.0, 1000.0}) {  // below 0: the same, slippery
    SCOPED_TRACE(stiffness);
    const double friction = stiffness < 0.0 ? 0.05 : 1.0;
    Json tip = {{"length_mm", 30},
                {"radius_mm", 0.4445},
                {"bending_stiffness_n_mm2", 5},
                {"element_length_mm", 1}};
    Json shaft = {{"length_mm", 220},
                  {"radius_mm", 0.4445},
                  {"bending_stiffness_n_mm2", std::abs(stiffness)},
                  {"element_length_mm", 2}};
    const Json json = {
        {"schema", "wireplan.scene/1"},
        {"wire", {{"sections", Json::array({tip, shaft})}}},
        {"vessel",
         {{"surface", {{"path", "bend.stl"}, {"unit", "mm"}, {"frame", "LPS"}}},
          {"friction", friction}}},
        {"insertion", {{"point_mm", {0, 0, 2}}, {"direction", {0, 0, 1}}, {"length_mm", 80}}},
        {"check_sensitivity", false}};
    const SceneFile file = read_scene(write("scene.json", json.dump()));
    run_scene_file(file, folder_ / "out");
    std::ifstream stream(folder_ / "out" / "result.json");
    const Json result = Json::parse(stream);
    const auto number = [&](const char* key) { return result.at(key).get<double>(); };
    const double work = std::max(std::abs(number("push_work_n_mm")),
                                 number("stored_energy_n_mm") + number("friction_work_n_mm"));
    const bool is_rough = std::abs(number("energy_unbalanced_n_mm")) > 0.01 * work;
    const std::string reason = result.at("reason");
    EXPECT_NE(reason.find("the scene has no target"), std::string::npos) << reason;
    EXPECT_EQ(reason.find("its forces are rough") != std::string::npos, is_rough) << reason;
    rough += is_rough;
  }
  EXPECT_GT(rough, 0);
  EXPECT_LT(rough, 3);
}

}  // namespace
}  // namespace wireplan::pipeline
