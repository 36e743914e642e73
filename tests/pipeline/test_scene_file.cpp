// Scene files: what is read, in which units, what is said about mistakes, and the result of a
// bench.
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
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
#include "pipeline/files/hand_file.h"
#include "pipeline/files/result_file.h"
#include "pipeline/files/scene_file.h"
#include "tests/pipeline/case_texts.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {
namespace {

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

TEST_F(CaseFile, ASceneMayNameAWireOfTheCatalogue) {
  Json bench = cantilever();
  bench["wire"] = {{"device", "amplatz-stiff"}, {"length_mm", 57.5}, {"element_length_mm", 0.5}};
  const SceneFile file = read_scene(write("scene.json", bench.dump()));
  const simulate::Scene& scene = *file.bench;
  EXPECT_EQ(scene.elements, 115);
  EXPECT_EQ(scene.wire.name, "amplatz-stiff");
  ASSERT_EQ(scene.wire.sections.size(), 2u);
  EXPECT_NEAR(scene.wire.length(), 57.5, 1e-12);
  // The cut lies in the middle of a cone of 45 mm from EI 3 to 521: half-way between the roots.
  const simulate::Section& cone = scene.wire.sections[1];
  EXPECT_EQ(cone.length, 22.5);
  EXPECT_NEAR(std::pow(cone.proximal_bending_stiffness, 0.25),
              0.5 * (std::pow(3.0, 0.25) + std::pow(521.2, 0.25)), 1e-3);

  // Its friction reaches the insertion and the bench in a vessel; another is said of the wire.
  Json pushed = pushed_wire();
  pushed["vessel"].erase("friction");
  pushed["wire"] = {{"device", "heavy-duty"}, {"length_mm", 200}};
  const SceneFile in_vessel = read_scene(write("scene.json", pushed.dump()));
  EXPECT_EQ(in_vessel.vessel->friction, 0.12);
  EXPECT_EQ(friction_of(in_vessel.insertion->wire, in_vessel.insertion->options), 0.12);
  bench["vessel"] = pushed["vessel"];
  EXPECT_EQ(read_scene(write("scene.json", bench.dump())).bench->contact.friction, 0.12);
  pushed["wire"]["friction"] = 0.3;
  const SceneFile rough = read_scene(write("scene.json", pushed.dump()));
  EXPECT_EQ(friction_of(rough.insertion->wire, rough.insertion->options), 0.3);

  pushed["vessel"]["friction"] = 0.2;
  expect_mentions(scene_problem(pushed), {"vessel.friction is 0.2", "give wire.friction"});
  // Where nothing rubs it would do nothing.
  bench.erase("vessel");
  bench["wire"]["friction"] = 0.2;
  expect_mentions(scene_problem(bench), {"wire.friction is 0.2", "without a \"vessel\""});
  bench["wire"] = {{"device", "amplatz-stif"}};
  expect_mentions(scene_problem(bench), {"wire.device is", "did you mean \"amplatz-stiff\"?"});
  bench["wire"] = {{"device", "amplatz-stiff"}, {"length_mm", 2000}};
  expect_mentions(scene_problem(bench), {"wire.length_mm is 2000", "no longer"});
  bench["wire"] = {{"device", "amplatz-stiff"}, {"sections", Json::array()}};
  expect_mentions(scene_problem(bench), {"wire.sections is not a known key"});
}

TEST_F(CaseFile, SectionsTaperOrAreGivenByTheirTipLoad) {
  // The tip bends by P (L - x)^2 / EI(x), EI linear; a tip load of 1 gf is 1.567 N mm^2.
  Json json = cantilever();
  json["loads"] = {{"tip_force_n", {0, -1e-5, 0}}};
  json["wire"]["sections"][0]["bending_stiffness_n_mm2"] = {1, 9};
  const simulate::Section taper =
      read_scene(write("scene.json", json.dump())).bench->wire.sections[0];
  EXPECT_EQ(taper.EI(0.0), 1.0);
  EXPECT_EQ(taper.EI(20.0), 5.0);
  const simulate::SceneResult bent =
      simulate::run_scene(*read_scene(write("scene.json", json.dump())).bench);
  double expected = 0.0;
  for (int k = 0; k < 4000; ++k) {
    const double from_tip = (k + 0.5) * 0.01;
    expected -= 1e-5 * from_tip * from_tip / (1.0 + 0.2 * from_tip) * 0.01;
  }
  EXPECT_NEAR(bent.nodes(1, bent.nodes.cols() - 1), expected, 0.01 * std::abs(expected));

  json["wire"]["sections"][0].erase("bending_stiffness_n_mm2");
  json["wire"]["sections"][0]["tip_load_gf"] = 2;
  EXPECT_NEAR(
      read_scene(write("scene.json", json.dump())).bench->wire.sections[0].bending_stiffness, 3.134,
      2e-3);
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

TEST_F(SceneMistakes, ThatTheMethodCannotDoAreTold) {
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
  };
  expect_each_told(mistakes);
}

TEST_F(SceneMistakes, AreToldAndWhatIsNotInThisVersion) {
  const std::vector<Mistake> mistakes = {
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
      {pushed_wire(), "/solver/load_steps", 5, {"solver.load_steps is 5, expected 1", "step_mm"}},
      {pushed_wire(), "/solver/method", "explicit", {"solver.method", "bench alone"}},
      {pushed_wire(), "/wire/twist", "decoupled", {"wire.twist", "\"auto\""}},
      {pushed_wire(), "/plane_normal", {0, 0, 1}, {"plane_normal is given", "version"}},
      {cantilever(), "/supports/0/roll_deg", 50000, {"supports[0].roll_deg is 50000", "to 36000"}},
      {cantilever(), "/supports/0/direction", {0, 0, 0}, {"supports[0].direction", "not all 0"}},
      {cantilever(), "/supports/0/kind", "pinned", {"not enough to hold the wire"}},
      {cantilever(),
       "/supports/1",
       {{"at", "distal"}, {"kind", "pinned"}, {"point_mm", {30, 0, 0}}, {"roll_deg", 90}},
       {"supports[1].roll_deg is 90, expected 0", "turns freely"}},
      {motion("conjugate_gradient"),
       "/supports/1",
       {{"at", "distal"}, {"kind", "clamped"}, {"point_mm", {30, 0, 0}}, {"roll_deg", 90}},
       {"supports is of different roll_deg", "choose newton", "decoupled"}},
      {cantilever(), "/supports/0/at", "distal", {"without one at the proximal end"}},
      {cantilever(),
       "/supports/1",
       {{"at", "distal"}, {"kind", "clamped"}, {"point_mm", {45, 0, 0}}},
       {"supports[1].point_mm is 45.0 mm from the other support's", "40.0 mm", "torn"}},
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
      {cantilever(),
       "/wire/sections/0/tip_load_gf",
       1,
       {"sections[0].bending_stiffness_n_mm2 is given beside tip_load_gf", "one of them"}},
      {cantilever(),
       "/wire/sections/0/bending_stiffness_n_mm2",
       {1, 2, 3},
       {"sections[0].bending_stiffness_n_mm2 is [1,2,3]", "of a taper two"}},
      {cantilever(),
       "/wire/sections/0/bending_stiffness_n_mm2",
       {1, 0},
       {"sections[0].bending_stiffness_n_mm2[1] is 0", "above 0"}},
      {cantilever(), "/target", {{"point_mm", {0, 0, 1}}}, {"target is not a known key"}},
      {cantilever(), "/output", {{"every_mm", 5}}, {"output is given", "histories of a bench"}},
      {pushed_wire(), "/vessel/friction", -0.1, {"vessel.friction is -0.1", "from 0"}},
      {pushed_wire(), "/vessel/wall/model", "soft", {"vessel.wall.model", "\"elastic\""}},
      {motion("conjugate_gradient"),
       "/vessel",
       pushed_wire().at("vessel"),
       {"solver.method is not \"newton\"", "no vessel"}},
      {pushed_wire(), "/vessel/surface/path", "none.stl", {"vessel.surface.path", "none.stl"}},
      {pushed_wire(), "/insertion/length_mm", 50, {"insertion.length_mm is 50", "40"}},
      {pushed_wire(), "/wire/elements", 3, {"wire is of 3 elements", "at least 4", "pushed in"}},
      {pushed_wire(), "/insertion/when_stuck", "push", {"insertion.when_stuck", "\"push_on\""}},
      {pushed_wire(), "/loads/tip_force_n", {0, 0, 1}, {"loads is", "version"}},
      {pushed_wire(), "/supports", Json::array({1}), {"supports is given", "version"}},
  };
  expect_each_told(mistakes);
}

/// Where a curved tip bends to by a scene's roll of 0.
Vec3 zero_of_roll(const Vec3& direction) {
  const Vec3 from = simulate::reference_normal(direction);
  return Eigen::AngleAxisd(roll_of_anterior(direction), direction) * from;
}

TEST(SceneRoll, ZeroIsAnteriorAndTurnsEvenlyWithTheDirection) {
  EXPECT_TRUE(zero_of_roll(Vec3::UnitZ()).isApprox(Vec3(0.0, -1.0, 0.0), 1e-12));
  EXPECT_TRUE(zero_of_roll(Vec3::UnitY()).isApprox(Vec3::UnitZ(), 1e-12));
  EXPECT_EQ(roll_of_anterior(Vec3(1.0, 2.0, 2.0).normalized()), 0.0);  // as before, away from y
  // Through the cone of 10 degrees round y, past y by one degree: -y made square each time, and
  // from step to step no more of a turn than the direction makes round y.
  int inside = 0;
  Vec3 before = Vec3::Zero();
  for (double angle = -20.0; angle <= 20.0; angle += 0.05) {
    const double a = angle * kRadPerDeg, off = 1.0 * kRadPerDeg;
    const Vec3 direction =
        Vec3(std::sin(a), std::cos(a) * std::cos(off), std::sin(off)).normalized();
    const Vec3 zero = zero_of_roll(direction);
    EXPECT_NEAR(zero.dot(direction), 0.0, 1e-12);
    EXPECT_NEAR(zero.dot(direction.cross(Vec3::UnitY())), 0.0, 1e-12);
    EXPECT_LT(zero.y(), 0.0);
    if (before.norm() > 0.0) {
      EXPECT_LT((zero - before).norm(), 0.06);
    }
    before = zero;
    inside += roll_of_anterior(direction) != 0.0;
  }
  EXPECT_GT(inside, 300);
}

TEST_F(CaseFile, RollsOfASceneCountFromAnterior) {
  Json json = cantilever();
  json["supports"][0]["direction"] = {0.1, 1, 0};
  json["supports"][0]["roll_deg"] = 30;
  json["supports"].push_back({{"at", "distal"},
                              {"kind", "clamped"},
                              {"point_mm", {4, 39, 0}},
                              {"direction", {0.1, 1, 0}},
                              {"roll_deg", 75}});
  const simulate::Scene scene = *read_scene(write("scene.json", json.dump())).bench;
  const double zero = roll_of_anterior(Vec3(0.1, 1.0, 0.0).normalized());
  EXPECT_NEAR(std::abs(zero), 0.5 * kPi, 1e-12);  // +z before
  EXPECT_NEAR(scene.supports[0].roll, zero + 30.0 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(scene.supports[1].roll, zero + 75.0 * kRadPerDeg, 1e-12);
  Json pushed = pushed_wire();
  pushed["insertion"]["direction"] = {0.1, 1, 0};
  const InsertionScene insertion = *read_scene(write("scene.json", pushed.dump())).insertion;
  EXPECT_EQ(insertion.roll_zero, zero);
  EXPECT_NEAR(insertion.introducer.roll, zero + 0.5 * kPi, 1e-12);
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
    push.hub_torque = 0.25 * i;
    result.pushes.push_back(push);
    result.push_terms.push_back(
        {.energy = {.bend = 0.25 * i, .twist = 0.125 * i, .contact = 0.125 * i},
         .tip_roll = 0.5 * kPi});
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
  EXPECT_EQ(json.at("energy_n_mm").at("bend"), 3.0);
  EXPECT_EQ(json.at("history")[1].at("energy_n_mm").at("twist"), 1.25);
  EXPECT_EQ(json.at("hub_torque_n_mm"), 3.0);
  EXPECT_EQ(json.at("history")[0].at("hub_torque_n_mm"), 1.25);
  EXPECT_EQ(json.at("tip_roll_deg"), 90.0);
  EXPECT_EQ(json.at("cpu_time_s"), 0.125);
  EXPECT_FALSE(json.contains("stuck_mm"));
  EXPECT_EQ(json.at("contacts")[0].at("triangle"), 7);
  EXPECT_EQ(json.at("contacts")[0].at("normal_force_n"), to_json(Vec3(3, 0, 4)));
  EXPECT_EQ(json.at("contacts")[0].at("friction_force_n"), to_json(Vec3(0, 0.5, 0)));
  EXPECT_TRUE(json.at("contacts")[1].at("triangle").is_null());
}

}  // namespace
}  // namespace wireplan::pipeline
