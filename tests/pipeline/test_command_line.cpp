// The program itself: its exit codes, what it says of bad input, and that it then writes nothing.
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <functional>
#include <set>

#include "pipeline/files/catalogue.h"
#include "pipeline/files/text.h"
#include "preprocess/volume/image.h"
#include "tests/dicom.h"
#include "tests/messages.h"
#include "tests/pipeline/finished_case.h"
#include "tests/pipeline/program.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// A folder with the tube case, and the program run within it.
class CommandLine : public testing::Test {
 protected:
  void SetUp() override { case_ = write_tube_case(folder_.path()); }

  Answer call(const std::string& arguments) const { return run_program(folder_.path(), arguments); }

  // Runs a case that is wrong: exit 2, told in words that name `expected`, nothing written over.
  void expect_refused(const Json& file, const std::string& expected) const {
    write_json(file, folder_ / "bad.json");
    expect_file_refused(expected);
  }
  void expect_file_refused(const std::string& expected) const {
    write_text("earlier", folder_ / "results" / "report.json");
    const Answer answer = call("run bad.json -o results");
    EXPECT_EQ(answer.code, 2) << answer.log;
    EXPECT_EQ(answer.out, "");
    EXPECT_NE(answer.log.find(expected), std::string::npos) << answer.log;
    EXPECT_EQ(read_text(folder_ / "results" / "report.json"), "earlier");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "results"), {}), 1);
  }

  TemporaryFolder folder_;
  Json case_;
};

// A soft wire pushed askew into the tube, whose wall yields and rubs.
Json tube_scene() {
  Json scene;
  scene["schema"] = "wireplan.scene/1";
  scene["wire"] = {{"sections", Json::array({{{"length_mm", 60},
                                              {"element_length_mm", 1},
                                              {"bending_stiffness_n_mm2", 50},
                                              {"radius_mm", 0.4}}})}};
  scene["vessel"] = {{"surface", {{"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}}},
                     {"wall", {{"model", "elastic"}}},
                     {"friction", 0.1}};
  scene["insertion"] = {{"point_mm", {0, 0, 6}}, {"direction", {0.3, 0, 1}}, {"length_mm", 20}};
  return scene;
}

TEST_F(CommandLine, RunsACaseAndTheSecondTimeDoesNothing) {
  const Answer first = call("run case.json");
  ASSERT_EQ(first.code, 0) << first.log;
  EXPECT_NE(first.out.find("best of 2 safe plans (reach, no limit broken); 2 of 2 tried reach"),
            std::string::npos);
  EXPECT_NE(first.out.find("report: wireplan-out/tube/report.json"), std::string::npos);
  const fs::path results = folder_ / "wireplan-out" / "tube";
  for (const char* name :
       {"surface.vtp", "centerline.vtp", "centerline.mrk.json", "wall.vtu", "report.json",
        "forces.vtu", "plans.png", "trials/0000.json", "trials/0001.json", "trials/plan-1.pvd",
        "trials/plan-1.mrk.json", "trials/plan-1/0.vtp"}) {
    EXPECT_TRUE(fs::exists(results / name)) << name;
  }

  const std::string report = read_text(results / "report.json");
  const Answer second = call("run case.json");
  EXPECT_EQ(second.code, 0);
  EXPECT_EQ(second.out, first.out);
  EXPECT_EQ(second.log.find("made"), std::string::npos) << second.log;
  EXPECT_EQ(read_text(results / "report.json"), report);
}

TEST_F(CommandLine, ExitsWithOneWhereNoPlanReaches) {
  write_finished_tube(folder_.path(), "cache/wireplan");
  const Answer answer = call("run case.json --set insertion.length_mm=12");
  EXPECT_EQ(answer.code, 1) << answer.log;
  EXPECT_NE(answer.out.find("no plan reaches the target"), std::string::npos);
  // Nor is a plan of the wire alone one where a device that is asked for does not pass.
  const Answer device = call("run case.json --set access_limits.device_diameter_mm=9.5");
  EXPECT_EQ(device.code, 1) << device.out;
  EXPECT_NE(device.out.find("the wire alone would reach the target: best of"), std::string::npos)
      << device.out;
}

TEST_F(CommandLine, StatusTellsWhyStagesWouldRun) {
  write_finished_tube(folder_.path(), "cache/wireplan");
  ASSERT_EQ(call("run case.json").code, 0);
  const Answer status = call("status case.json --set wall.thickness_mm=2");
  EXPECT_EQ(status.code, 0);
  EXPECT_NE(status.out.find("parameter wall.thickness_mm: 1.0 -> 2.0"), std::string::npos)
      << status.out;
  EXPECT_EQ(call("run case.json --dry-run").out.find("would run"), std::string::npos);
}

TEST_F(CommandLine, StopsAtAStageAndForcesOne) {
  EXPECT_EQ(call("run case.json --to centerline -o results").code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "results" / "centerline.vtp"));
  EXPECT_FALSE(fs::exists(folder_ / "results" / "wall.vtu"));
  const Answer forced = call("run case.json --to centerline --force centerline --explain");
  EXPECT_NE(forced.log.find("it is forced"), std::string::npos) << forced.log;
  EXPECT_EQ(call("run case.json --to nowhere").code, 2);
}

TEST_F(CommandLine, HelpAndVersionAreAnswersAndUnknownArgumentsAreBadInput) {
  for (const char* command : {"", "run", "batch", "check", "status", "cache", "cache prune",
                              "wires", "devices", "simulate", "phantom"}) {
    SCOPED_TRACE(command);
    const Answer help = call(std::string(command) + " --help");
    EXPECT_EQ(help.code, 0);
    EXPECT_GT(help.out.size(), 100u);
    EXPECT_LE(std::count(help.out.begin(), help.out.end(), '\n'), 25);  // a screen
  }
  EXPECT_EQ(call("--version").code, 0);
  EXPECT_EQ(call("").code, 2);
  EXPECT_EQ(call("run").code, 2);
  EXPECT_EQ(call("run case.json --no-such-option").code, 2);
  EXPECT_EQ(call("run case.json -j 0").code, 2);
}

TEST_F(CommandLine, ListsEveryDeviceOfTheCatalogue) {
  const Answer wires = call("wires"), devices = call("devices");
  EXPECT_EQ(wires.code, 0);
  EXPECT_EQ(devices.code, 0);
  const Catalogue known = catalogue();
  ASSERT_FALSE(known.wires.empty());
  for (const CatalogueWire& entry : known.wires) {
    EXPECT_NE(wires.out.find(entry.wire.name), std::string::npos) << entry.wire.name;
    EXPECT_NE(devices.out.find(entry.wire.name), std::string::npos) << entry.wire.name;
  }
  for (const Catheter& entry : known.catheters) {
    EXPECT_NE(devices.out.find(entry.tube.name), std::string::npos) << entry.tube.name;
  }
  for (const Sheath& entry : known.sheaths) {
    EXPECT_NE(devices.out.find(entry.name), std::string::npos) << entry.name;
  }
}

TEST_F(CommandLine, ListsTheCatalogueAsACaseTakesIt) {
  const Answer answer = call("wires --json");
  ASSERT_EQ(answer.code, 0);
  const Json file = parse_json(answer.out, "wires", "wireplan.wires/1");
  const Catalogue known = catalogue();
  ASSERT_EQ(file.at("wires").size(), known.wires.size());
  for (std::size_t k = 0; k < known.wires.size(); ++k) {
    Problems problems("wires");
    const DeviceWire read = read_wire(file.at("wires")[k], "", problems, known.coatings);
    EXPECT_TRUE(problems.empty());
    EXPECT_EQ(wire_json(read.wire), wire_json(known.wires[k].wire));
    EXPECT_EQ(read.title, known.wires[k].title);
    EXPECT_EQ(read.values.size(), known.wires[k].values.size());
  }
}

TEST_F(CommandLine, ListsTheDevicesAsTheirSchemaHasThem) {
  const Answer answer = call("devices --json");
  ASSERT_EQ(answer.code, 0);
  EXPECT_EQ(parse_json(answer.out, "devices", "wireplan.devices/1"), catalogue().file);
  fs::create_directories(folder_ / "listed");
  write_text(answer.out, folder_ / "listed" / "devices.json");
  expect_follows_schemas(folder_ / "listed");
}

TEST_F(CommandLine, ChecksACaseWithoutRunningIt) {
  EXPECT_EQ(call("check .").code, 0);
  const Answer good = call("check case.json");
  EXPECT_EQ(good.code, 0) << good.log;
  EXPECT_NE(good.out.find("2 trials"), std::string::npos) << good.out;
  EXPECT_FALSE(fs::exists(folder_ / "cache"));

  // Both ends outside: told at once.
  const Answer bad =
      call("check case.json --set access.point_mm=[0,0,-9] --set target.point_mm=[0,30,28]");
  EXPECT_EQ(bad.code, 2);
  EXPECT_NE(bad.log.find("access.point_mm"), std::string::npos) << bad.log;
  EXPECT_NE(bad.log.find("target.point_mm"), std::string::npos) << bad.log;
}

TEST_F(CommandLine, SimulatesTheBench) {
  // Clamped along x, bent by a small force at the tip: F L^3 / (3 EI) = 0.0213 mm.
  write_json({{"schema", "wireplan.scene/1"},
              {"wire",
               {{"elements", 40},
                {"sections",
                 Json::array(
                     {{{"length_mm", 40}, {"bending_stiffness_n_mm2", 10}, {"radius_mm", 0.4}}})}}},
              {"supports", Json::array({{{"at", "proximal"},
                                         {"kind", "clamped"},
                                         {"point_mm", {0, 0, 0}},
                                         {"direction", {1, 0, 0}}}})},
              {"loads", {{"tip_force_n", {0, -1e-5, 0}}}}},
             folder_ / "scene.json");
  const Answer answer = call("simulate scene.json -o bench");
  ASSERT_EQ(answer.code, 0) << answer.log;
  EXPECT_NE(answer.out.find("converged: tip (40.0000, -0.0213, 0.0000) mm"), std::string::npos)
      << answer.out;
  EXPECT_TRUE(fs::exists(folder_ / "bench" / "result.json"));
  EXPECT_TRUE(fs::exists(folder_ / "bench" / "wire.vtp"));
}

TEST_F(CommandLine, SimulatesAnInsertionIntoAYieldingVessel) {
  write_json(tube_scene(), folder_ / "scene.json");
  const Answer answer = call("simulate scene.json -o pushed");
  ASSERT_EQ(answer.code, 0) << answer.log;
  for (const char* name :
       {"result.json", "wire.vtp", "wire.png", "shapes.pvd", "shapes/0.vtp", "forces.vtu"}) {
    EXPECT_TRUE(fs::exists(folder_ / "pushed" / name)) << name;
  }
  const Json result = read_json(folder_ / "pushed" / "result.json", "wireplan.result/1");
  EXPECT_EQ(result.at("vessel").at("wall_model"), "elastic");
  EXPECT_NEAR(result.at("vessel").at("wall_stiffness_kpa_per_mm").get<double>(), 25.0, 1e-9);
  ASSERT_FALSE(result.at("contacts").empty());
  EXPECT_GT(result.at("max_wall_displacement_mm"), 0.0);
  EXPECT_GT(result.at("friction_work_n_mm"), 0.0);
  const Json& last = result.at("history").back();
  EXPECT_NEAR(last.at("insertion_mm").get<double>(), 20.0, 1e-9);
  EXPECT_EQ(last.at("push_work_n_mm"), result.at("push_work_n_mm"));
}

TEST_F(CommandLine, RefusesASceneWhoseEntryOrTargetLiesOutsideOfTheVessel) {
  for (const std::string key : {"insertion", "target"}) {
    Json scene = tube_scene();
    scene[key]["point_mm"] = {30, 0, 6};
    write_json(scene, folder_ / "scene.json");
    for (const char* command : {"check scene.json", "simulate scene.json -o pushed"}) {
      const Answer answer = call(command);
      EXPECT_EQ(answer.code, 2) << command;
      EXPECT_NE(answer.log.find(key + ".point_mm is [30.0,0.0,6.0]"), std::string::npos);
      EXPECT_NE(answer.log.find("26.0 mm outside"), std::string::npos) << answer.log;
    }
  }
  // A sphere that reaches into the vessel may be reached.
  Json scene = tube_scene();
  scene["target"] = {{"point_mm", {30, 0, 6}}, {"radius_mm", 26.5}};
  write_json(scene, folder_ / "scene.json");
  EXPECT_EQ(call("check scene.json").code, 0);
}

TEST_F(CommandLine, TellsThatASceneEntersWithinAWiresRadiusOfTheWall) {
  Json scene = tube_scene();
  scene["insertion"]["point_mm"] = {3.8, 0, 6};  // of 4 mm, a wire of 0.4 mm
  scene["insertion"]["direction"] = {0, 0, 1};
  write_json(scene, folder_ / "scene.json");
  const Answer check = call("check scene.json");
  EXPECT_EQ(check.code, 0) << check.log;
  EXPECT_NE(check.out.find("insertion.point_mm lies 0."), std::string::npos) << check.out;
  EXPECT_NE(check.out.find("the wire's radius of 0.40 mm"), std::string::npos) << check.out;
  const Answer answer = call("simulate scene.json -o pushed");
  EXPECT_EQ(answer.code, 0) << answer.log;
  const Json result = read_json(folder_ / "pushed" / "result.json", "wireplan.result/1");
  EXPECT_NE(result.at("warnings").dump().find("insertion.point_mm lies 0."), std::string::npos);
}

TEST_F(CommandLine, PushesAStuckWireOnWhereASceneSaysSo) {
  // A sac of 4 mm radius whose end is round, and so no opening: the tip leans on it.
  write_stl(shapes::level_set(
                [](const Vec3& p) {
                  const Vec3 axis(0.0, 0.0, std::clamp(p.z(), 0.0, 56.0));
                  return 4.0 - (p - axis).norm();
                },
                Vec3(-6.0, -6.0, -6.0), Vec3(6.0, 6.0, 62.0), 1.0),
            folder_ / "sac.stl");
  Json scene = tube_scene();
  scene["wire"]["sections"][0]["length_mm"] = 120;
  scene["vessel"] = {{"surface", {{"path", "sac.stl"}, {"unit", "mm"}, {"frame", "LPS"}}},
                     {"friction", 0.3}};
  scene["insertion"]["direction"] = {0.05, 0, 1};
  scene["insertion"]["length_mm"] = 110;
  write_json(scene, folder_ / "scene.json");
  const Answer stopped = call("simulate scene.json -o stopped");
  EXPECT_NE(stopped.out.find("stuck: "), std::string::npos) << stopped.out;
  scene["insertion"]["when_stuck"] = "push_on";
  write_json(scene, folder_ / "scene.json");
  const Answer answer = call("simulate scene.json -o on");
  EXPECT_NE(answer.out.find("the tip did not advance from "), std::string::npos) << answer.out;
  const Json before = read_json(folder_ / "stopped" / "result.json", "wireplan.result/1");
  const Json after = read_json(folder_ / "on" / "result.json", "wireplan.result/1");
  EXPECT_FALSE(before.contains("stuck_mm"));
  const double end = before.at("history").back().at("insertion_mm");
  EXPECT_NEAR(after.at("stuck_mm")[0][0].get<double>(), end - 20.0, 1e-9);
  EXPECT_GT(after.at("history").back().at("insertion_mm").get<double>(), end);
}

/// The text of a result but for what it took.
std::string text_without_time(const fs::path& result) {
  Json json = read_json(result, "wireplan.result/1");
  json.erase("cpu_time_s");
  return json.dump();
}

TEST_F(CommandLine, AListOfRollsGivesWhatEachGivesAlone) {
  Json scene = tube_scene();
  Json tip = scene["wire"]["sections"][0];
  tip["length_mm"] = 8;
  tip["rest_curvature_per_mm"] = 0.1;
  scene["wire"]["sections"].insert(scene["wire"]["sections"].begin(), tip);
  scene["vessel"]["wall"]["model"] = "rigid";
  scene["insertion"]["roll_deg"] = {0, 137.5, -20};
  write_json(scene, folder_ / "scene.json");
  const Answer answer = call("simulate scene.json -o listed");
  ASSERT_EQ(answer.code, 0) << answer.log;
  std::set<std::string> texts;
  for (const double roll : {0.0, 137.5, -20.0}) {
    const std::string name = "roll_" + format("%g", roll);
    EXPECT_NE(answer.out.find(name + ": "), std::string::npos) << answer.out;
    scene["insertion"]["roll_deg"] = roll;
    write_json(scene, folder_ / "scene.json");
    ASSERT_EQ(call("simulate scene.json -o alone").code, 0);
    const std::string text = text_without_time(folder_ / "listed" / name / "result.json");
    EXPECT_EQ(text, text_without_time(folder_ / "alone" / "result.json"));
    texts.insert(text);
  }
  EXPECT_EQ(texts.size(), 3u) << "a roll changes something";
}

TEST_F(CommandLine, MovesOfASceneAreThoseOfThePushAndComeBack) {
  Json scene = tube_scene();
  scene["vessel"].erase("friction");
  write_json(scene, folder_ / "scene.json");
  ASSERT_EQ(call("simulate scene.json -o pushed").code, 0);
  const auto nodes_after = [&](const Json& moves, const std::string& folder) {
    scene["insertion"].erase("length_mm");
    scene["insertion"]["moves"] = moves;
    write_json(scene, folder_ / "scene.json");
    const Answer answer = call("simulate scene.json -o " + folder);
    EXPECT_EQ(answer.code, 0) << answer.log;
    EXPECT_NE(answer.out.find("all moves were made"), std::string::npos) << answer.out;
    return read_json(folder_ / folder / "result.json", "wireplan.result/1").at("nodes_mm");
  };
  const Json once =
      read_json(folder_ / "pushed" / "result.json", "wireplan.result/1").at("nodes_mm");
  EXPECT_EQ(nodes_after(Json::array({{{"push_mm", 12}}, {{"push_mm", 8}}}), "twice"), once);
  const Json back = nodes_after(
      Json::array({{{"push_mm", 30}}, {{"turn_deg", 90}}, {{"pull_mm", 10}, {"turn_deg", 30}}}),
      "back");
  ASSERT_EQ(back.size(), once.size());
  EXPECT_LT((points_of(back) - points_of(once)).colwise().norm().maxCoeff(), 0.05);
  const Json history =
      read_json(folder_ / "back" / "result.json", "wireplan.result/1").at("history");
  EXPECT_NEAR(history.back().at("insertion_mm").get<double>(), 20.0, 1e-9);
  EXPECT_NEAR(history.back().at("hub_turn_deg").get<double>(), 120.0, 1e-9);
}

TEST_F(CommandLine, ASceneStartsFromTheShapeOfAnother) {
  Json scene = tube_scene();
  write_json(scene, folder_ / "scene.json");
  ASSERT_EQ(call("simulate scene.json -o pushed").code, 0);
  const Json pushed = read_json(folder_ / "pushed" / "result.json", "wireplan.result/1");
  scene["insertion"].erase("length_mm");
  scene["start"] = {{"nodes_mm", pushed.at("nodes_mm")}, {"length_mm", 20}};
  write_json(scene, folder_ / "scene.json");
  const Answer answer = call("simulate scene.json -o lying");
  ASSERT_EQ(answer.code, 0) << answer.log;
  EXPECT_NE(answer.out.find("start: the nearest equilibrium lies 0."), std::string::npos)
      << answer.out;
  const Json lying = read_json(folder_ / "lying" / "result.json", "wireplan.result/1");
  const Json& start = lying.at("start");
  EXPECT_EQ(start.at("nodes_mm"), lying.at("nodes_mm"));
  EXPECT_EQ(start.at("length_mm"), 20.0);
  // Friction pushed as it came in, and holds as it lies: that much it gives way.
  EXPECT_LT(start.at("distance_mm").at("largest").get<double>(), 0.1);
  EXPECT_LT((points_of(lying.at("nodes_mm")) - points_of(pushed.at("nodes_mm")))
                .colwise()
                .norm()
                .maxCoeff(),
            0.1);

  // On to another depth, as pushing there would.
  scene["insertion"]["length_mm"] = 26;
  write_json(scene, folder_ / "scene.json");
  ASSERT_EQ(call("simulate scene.json -o on").code, 0);
  EXPECT_NEAR(read_json(folder_ / "on" / "result.json", "wireplan.result/1")
                  .at("history")
                  .back()
                  .at("insertion_mm")
                  .get<double>(),
              26.0, 1e-9);

  scene["start"] = {{"nodes_mm", {{0, 0, 6}, {0, 0, 14}, {19, 0, 14}}}};
  write_json(scene, folder_ / "scene.json");
  for (const char* command : {"check scene.json", "simulate scene.json -o far"}) {
    const Answer far = call(command);
    EXPECT_EQ(far.code, 2) << command;
    EXPECT_NE(far.log.find("start.nodes_mm is 15.0 mm outside the vessel"), std::string::npos)
        << far.log;
  }
}

TEST_F(CommandLine, SimulatesABenchWithinAVessel) {
  // Clamped on the tube's axis and pressed sideways against its wall, 4 mm away.
  Json scene = tube_scene();
  scene.erase("insertion");
  scene["wire"]["sections"][0]["length_mm"] = 25;
  scene["supports"] = Json::array({{{"at", "proximal"},
                                    {"kind", "clamped"},
                                    {"point_mm", {0, 0, 6}},
                                    {"direction", {0, 0, 1}}}});
  scene["loads"] = {{"tip_force_n", {0.2, 0, 0}}};
  scene["vessel"]["friction"] = 0;
  write_json(scene, folder_ / "scene.json");
  const Answer answer = call("simulate scene.json -o bench");
  ASSERT_EQ(answer.code, 0) << answer.log;
  EXPECT_TRUE(fs::exists(folder_ / "bench" / "forces.vtu"));
  const Json result = read_json(folder_ / "bench" / "result.json", "wireplan.result/1");
  ASSERT_FALSE(result.at("contacts").empty());
  double wall = 0.0;
  for (const Json& contact : result.at("contacts")) {
    wall += contact.at("normal_force_n")[0].get<double>();
    EXPECT_GE(contact.at("triangle"), 0);
  }
  // Load, wall and clamp balance across the axis, to the residuals of some 25 nodes.
  const double clamp = result.at("reactions")[0].at("force_n")[0];
  EXPECT_LT(wall, -0.05);
  EXPECT_NEAR(0.2 + wall + clamp, 0.0, 1e-4);
}

TEST_F(CommandLine, RefusesAFileThatIsMissingOrBroken) {
  const Answer missing = call("run absent.json -o results");
  EXPECT_EQ(missing.code, 2);
  EXPECT_NE(missing.log.find("absent.json"), std::string::npos) << missing.log;
  EXPECT_FALSE(fs::exists(folder_ / "results"));

  const std::string text = case_.dump(2);
  write_text(text.substr(0, text.size() / 2), folder_ / "bad.json");
  expect_file_refused("bad.json");
}

TEST_F(CommandLine, RefusesWhatTheCaseSaysWrong) {
  struct Mistake {
    std::function<void(Json&)> make;
    std::string expected;
  };
  const std::vector<Mistake> mistakes = {
      {[](Json& f) { f["surface"]["path"] = "absent.stl"; }, "absent.stl"},
      {[](Json& f) { f["acess"] = f["access"]; }, "acess"},
      {[](Json& f) { f["wires"][0]["diameter_mm"] = 0.000889; }, "wires[0].diameter_mm"},
      {[](Json& f) { f["wires"][0]["diameter_mm"] = 889; }, "wires[0].diameter_mm"},
      {[](Json& f) { f["wires"] = Json::array(); }, "wires"},
      {[](Json& f) { f["wires"][0]["sections"][0]["bending_stiffness_n_mm2"] = -50; },
       "wires[0].sections[0].bending_stiffness_n_mm2"},
      {[](Json& f) {
         f["access"]["point_mm"] = {0, 0};
       },
       "access.point_mm"},
      {[](Json& f) {
         f["target"]["point_mm"] = {0, 30, 28};
       },
       "target.point_mm"},
      {[](Json& f) {
         f["access"]["point_mm"] = {0, 0, -7};
       },
       "access.point_mm"},
  };
  for (const Mistake& mistake : mistakes) {
    SCOPED_TRACE(mistake.expected);
    Json file = case_;
    mistake.make(file);
    expect_refused(file, mistake.expected);
  }
}

TEST_F(CommandLine, RefusesASurfaceThatIsNoneOrHalfOfOneAndMendsASmallHole) {
  write_text("not a surface", folder_ / "tube.stl");
  expect_refused(case_, "tube.stl");

  const Surface whole = shapes::straight_tube(4.0, 36.0, 1.5);
  Surface part = whole;
  const auto keep = [&](const auto& wanted) {
    Eigen::Index kept = 0;
    for (Eigen::Index k = 0; k < whole.triangles.cols(); ++k) {
      if (wanted(k)) part.triangles.col(kept++) = whole.triangles.col(k);
    }
    part.triangles.conservativeResize(3, kept);
    write_stl(part, folder_ / "tube.stl");
  };
  keep([&](Eigen::Index k) { return whole.vertices(0, whole.triangles(0, k)) > 0.0; });
  expect_refused(case_, "tube.stl");

  part = whole;
  keep([](Eigen::Index k) { return k != 100; });
  const Answer mended = call("run case.json -o mended");
  EXPECT_EQ(mended.code, 0) << mended.log;
  EXPECT_NE(read_text(folder_ / "mended" / "report.json").find("hole"), std::string::npos);
}

TEST_F(CommandLine, SegmentsAVolumeAndPlansInIt) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  write_two_tubes(folder_ / "ct.nrrd");
  write_json(volume_case(case_), folder_ / "case.json");
  const Answer answer = call("run case.json -o results");
  ASSERT_EQ(answer.code, 0) << answer.log;
  EXPECT_TRUE(fs::exists(folder_ / "results" / "mask.nrrd"));
  EXPECT_EQ(read_text(folder_ / "results" / "slices.png").substr(1, 3), "PNG");
  EXPECT_NE(answer.log.find("slices.png"), std::string::npos) << answer.log;
  const Json report = read_json(folder_ / "results" / "report.json", "wireplan.report/2");
  // One tube of radius 6 and length 36: 4072 mm^3, of which voxels keep all but some per cent.
  EXPECT_NEAR(report.at("vessel").at("volume_mm3").get<double>(), 4072.0, 300.0);
}

/// A tube of 12 mm in a DICOM series of 40 x 40 x 36 mm.
void write_tube(const fs::path& folder, const std::string& modality) {
  fs::create_directories(folder);
  for (int k = 0; k < 36; ++k) {
    dicom_files::DicomSlice slice{
        .position = Vec3(0, 0, k), .modality = modality, .columns = 40, .rows = 40};
    for (int n = 0; n < 1600; ++n) {
      const bool lumen = std::hypot(n % 40 - 10.0, n / 40 - 20.0) < 6.0;
      slice.values.push_back(lumen ? 300 : 40);
    }
    slice.first_value = static_cast<std::int16_t>(k);
    write_text(dicom_files::dicom(slice), folder / ("IM" + std::to_string(k)));
  }
}

TEST_F(CommandLine, AModalityOtherThanCtIsToldWhereverTheVolumeIsRead) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  write_tube(folder_ / "series", "MR");
  Json file = volume_case(case_);
  file["volume"]["path"] = "series";
  write_json(file, folder_ / "case.json");
  const std::string told = "its modality is MR, not CT";
  EXPECT_TRUE(holds(call("check case.json").out, told));
  for (int k = 0; k < 2; ++k) {  // from the store too
    const Answer answer = call("run case.json --to volume");
    EXPECT_TRUE(holds(answer.out + answer.log, told)) << answer.log;
  }
  EXPECT_TRUE(holds(call("inspect series").out, "no Hounsfield units: its modality is MR"));
}

TEST_F(CommandLine, NoNameIdentityOrDateOfAPatientEntersAnyFile) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  write_tube(folder_ / "series", "CT");
  Json file = volume_case(case_);
  file["volume"]["path"] = "series";
  file.erase("segmentation");
  write_json(file, folder_ / "case.json");
  const Answer answer = call("run case.json -o results");
  ASSERT_EQ(answer.code, 0) << answer.log;

  int files = 0;
  for (const char* place : {"results", "cache"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / place)) {
      if (!entry.is_regular_file()) continue;
      ++files;
      const std::string bytes = read_text(entry.path());
      for (const std::string& word : dicom_files::kPatient) {
        EXPECT_EQ(bytes.find(word), std::string::npos) << word << " in " << entry.path();
      }
    }
  }
  EXPECT_GT(files, 20);
  for (const std::string& word : dicom_files::kPatient) {
    EXPECT_EQ((answer.out + answer.log).find(word), std::string::npos) << word;
  }
}

TEST_F(CommandLine, RefusesAVolumeThatIsNoneAndPointsThatAreNotInTheVessel) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  const Json good = volume_case(case_);
  write_text("not an image", folder_ / "ct.nrrd");
  expect_refused(good, "ct.nrrd");

  write_two_tubes(folder_ / "ct.nrrd");
  const auto with_seed = [&](double x, double y, double z) {
    Json file = good;
    file["segmentation"]["seeds_mm"] = Json::array({{x, y, z}});
    return file;
  };
  expect_refused(with_seed(10, 20, 400), "outside the volume");
  expect_refused(with_seed(10, 2, 18), "-1000");  // in air: the value found there is told

  // The other tube is no part of what the seed lies in.
  Json other = good;
  other["target"]["point_mm"] = {30, 20, 30};
  expect_refused(other, "target (30.0, 20.0, 30.0) mm is not connected");
  // Nor does a seed in both join them.
  other["segmentation"]["seeds_mm"] = Json::array({{10, 20, 18}, {30, 20, 18}});
  expect_refused(other, "target (30.0, 20.0, 30.0) mm is not connected");
}

TEST_F(CommandLine, RefusesAVolumeWhereImagingIsNotBuiltIn) {
  if (preprocess::reads_volumes()) GTEST_SKIP() << "built with imaging";
  write_two_tubes(folder_ / "ct.nrrd");
  expect_refused(volume_case(case_), "-DWIREPLAN_IMAGING=ON");
}

}  // namespace
}  // namespace wireplan::pipeline
