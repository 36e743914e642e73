// report.json: the schema it keeps to, the same bytes at any thread count, nothing of this machine.
#include <gtest/gtest.h>

#include <cstdlib>

#include "pipeline/files/case_file.h"
#include "pipeline/files/trial_file.h"
#include "pipeline/report/anatomy_json.h"
#include "pipeline/report/fetch_json.h"
#include "pipeline/report/report.h"
#include "pipeline/report/verdict_json.h"
#include "pipeline/stages/stages.h"
#include "preprocess/files/vessel_io.h"
#include "tests/pipeline/finished_case.h"
#include "tests/plan/iliacs.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

Json run_to_report(const fs::path& case_file, const fs::path& cache, int threads = 0,
                   const std::vector<std::string>& changes = {}) {
  RunOptions options;
  options.cache = cache;
  options.work.threads = threads;
  const RunResult result = run_stages(read_case(case_file, changes), options);
  return read_json(result.artifacts.back().folder / "report.json", kReportSchema);
}

void expect_valid(const Json& report, const fs::path& folder) {
  write_json(report, folder / "report.json");
  expect_follows_schemas(folder);
}

TEST(Report, KeepsToItsSchemaWithPlans) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report = run_to_report(folder / "case.json", folder / "cache");
  ASSERT_FALSE(report.at("ranking").empty());
  EXPECT_EQ(report.at("trials").size(), 2u);
  expect_valid(report, folder.path());
}

TEST(Report, AnswersWithAVerdictAndItsReasons) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  // Of fewer repeats than nine that are all safe none is sure.
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0, {"robustness.repeats=9"});
  EXPECT_EQ(std::next(report.begin(), 5).key(), "verdict") << "right after the outcome";
  const Json& verdict = report.at("verdict");
  EXPECT_GE(verdict.at("reasons").size(), 6u) << "share, forces, error, and of the way";
  const std::string told = describe_verdict(report);
  EXPECT_EQ(told.find("verdict: " + answer_of(report) + ". The wire "), 0u) << told;
  EXPECT_NE(told.find("reaches the target within all limits, safe in "), std::string::npos) << told;

  // A device that is wider than the tube of 8 mm.
  const Json wide = run_to_report(folder / "case.json", folder / "cache", 0,
                                  {"access_limits.device_diameter_mm=9.5"});
  EXPECT_EQ(wide.at("verdict").at("answer"), "not_feasible");
  EXPECT_EQ(describe_best(wide).find("the wire alone would reach the target: best of "), 0u);
  EXPECT_NE(describe_verdict(wide).find("a device of 9.5 mm does not pass"), std::string::npos);
  EXPECT_FALSE(wide.at("ranking").empty());
  // Given, it is not assumed, though it is as wide as the default.
  const Json& anatomy = report.at("anatomy");
  EXPECT_TRUE(way_findings(anatomy).device.assumed);
  EXPECT_FALSE(way_findings(wide.at("anatomy")).device.assumed);
  const Json equal = run_to_report(folder / "case.json", folder / "cache", 0,
                                   {"access_limits.device_diameter_mm=1.667"});
  EXPECT_EQ(equal.at("anatomy").at("access").at("device").at("device_diameter_mm"),
            anatomy.at("access").at("device").at("device_diameter_mm"));
  EXPECT_FALSE(way_findings(equal.at("anatomy")).device.assumed);

  Json older = report;
  older.erase("verdict");
  EXPECT_EQ(describe_verdict(older), "");
  EXPECT_EQ(answer_of(older), "-");
}

TEST(Report, TellsAccessViewsAndLengthsOfTheTube) {
  // 4 mm in radius, straight, from z = 6 to 28 mm, with edges of 1.5 mm; its wire has 200 mm.
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0,
                    {"access_limits.device_diameter_mm=9", "access_limits.catheter_length_mm=100",
                     "access_limits.working_length_mm=70"});
  const Json& access = report.at("anatomy").at("access");
  EXPECT_NEAR(access.at("sheath").at("lumen_diameter_mm"), 8.0, 0.4);
  EXPECT_TRUE(access.at("sheath").at("fits"));
  EXPECT_FALSE(access.at("device").at("fits"));
  EXPECT_FALSE(access.at("sheath").at("oval")) << "a round tube";
  EXPECT_NEAR(access.at("tortuosity").at("index"), 1.0, 0.01);
  EXPECT_EQ(access.at("tortuosity").at("grade"), "below mild");
  EXPECT_NEAR(access.at("sharpest_bend").at("angle_deg"), 180.0, 2.0);
  EXPECT_TRUE(access.at("calcium").at("volume_mm3").is_null());
  EXPECT_TRUE(report.at("anatomy").at("c_arm").at("ostia").empty());
  const Json& lengths = report.at("anatomy").at("lengths");
  EXPECT_EQ(lengths.at("places").back().at("what"), "target");
  EXPECT_NEAR(lengths.at("way_mm"), 22.0, 0.22);
  EXPECT_NEAR(lengths.at("wires").at(0).at("spare_mm"), 200.0 - 192.0, 0.22);
  EXPECT_TRUE(lengths.at("wires").at(0).at("long_enough"));
  const Json& arm = report.at("anatomy").at("c_arm");
  EXPECT_TRUE(arm.at("no_views").is_null());
  EXPECT_TRUE(arm.at("bend").at("best").is_null()) << "a straight tube";
  expect_valid(report, folder.path());
  const std::string told = describe_anatomy(report.at("anatomy"));
  for (const char* part : {"way: 22 mm, tortuosity 1.0", "device of 9.00 mm: does not fit",
                           "sheath of 2.70 mm: not weighed",
                           "calcium in and beside the lumen: not known", "22 mm in: target\n"}) {
    EXPECT_NE(told.find(part), std::string::npos) << part << " in\n" << told;
  }

  // Axes that are not the patient's have no front, and no C-arm.
  const Json unknown = run_to_report(folder / "case.json", folder / "cache", 0, {"axes=unknown"});
  const Json& none = unknown.at("anatomy").at("c_arm");
  EXPECT_NE(none.at("no_views").get<std::string>().find("axes are not known"), std::string::npos);
  EXPECT_TRUE(none.at("bend").at("best").is_null());
  expect_valid(unknown, folder.path());
}

TEST(Report, ADeviceThatPassesAnOvalLumenByItsAreaAloneIsTold) {
  Json row = {{"fits", true}, {"oval", true}};
  EXPECT_EQ(describe_fit(row), "fits where the lumen, oval there, gives way");
  row["oval"] = false;
  EXPECT_EQ(describe_fit(row), "fits");
  row["fits"] = false;
  EXPECT_EQ(describe_fit(row), "does not fit");
}

TEST(Report, CountsTheWireForTheCatheterOfTheFirstPlan) {
  ReportInput input;
  input.figures["anatomy"] = {
      {"access", Json::object()},
      {"c_arm", Json::object()},
      {"lengths", {{"way_mm", 300}, {"catheter_mm", 1000}, {"working_mm", 100}}}};
  input.study.wires = {{.name = "soft", .sections = {{.length = 1200.0}}}};
  Json lengths = anatomy_json(input).at("lengths");
  EXPECT_TRUE(lengths.at("catheter").is_null());
  EXPECT_EQ(lengths.at("wire_needed_mm"), 1400);
  EXPECT_FALSE(lengths.at("wires")[0].at("long_enough"));

  input.study.catheters.emplace_back().tool.wire = {.name = "cobra",
                                                    .sections = {{.length = 650.0}}};
  input.plan.candidates = {{.wire = 0}, {.wire = 0, .catheter = 0}};
  input.judgement.ranking.plans.emplace_back().trial = 1;
  lengths = anatomy_json(input).at("lengths");
  EXPECT_EQ(lengths.at("catheter"), "cobra");
  EXPECT_EQ(lengths.at("catheter_mm"), 650);
  EXPECT_EQ(lengths.at("wire_needed_mm"), 1050);
  EXPECT_EQ(lengths.at("wires")[0].at("spare_mm"), 150);

  input.judgement.ranking.plans[0].trial = 0;  // the wire alone is first
  EXPECT_EQ(anatomy_json(input).at("lengths").at("wire_needed_mm"), 1400);
}

TEST(Report, ListsWhatToFetchWithTheCatalogues) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report = run_to_report(folder / "case.json", folder / "cache");
  const Json& list = report.at("fetch");
  const auto row = [&](const std::string& what) {
    const auto found = std::find_if(list.begin(), list.end(),
                                    [&](const Json& each) { return each.at("what") == what; });
    EXPECT_NE(found, list.end()) << what;
    return *found;
  };
  EXPECT_EQ(row("Wire").at("items").at(0), report.at("ranking").at(0).at("wire"));
  // In a tube of 8 mm all sheaths that take the assumed 5 F, which a 4 F does not.
  const Json sheath = row("Sheath");
  EXPECT_TRUE(sheath.at("assumed"));
  const auto has = [](const Json& items, const char* name) {
    return std::find(items.begin(), items.end(), name) != items.end();
  };
  EXPECT_FALSE(has(sheath.at("items"), "sheath-4f"));
  EXPECT_TRUE(has(sheath.at("items"), "sheath-6f"));
  // The assumed one is longer than the way and so is not weighed.
  const std::string text = sheath.at("text");
  EXPECT_NE(text.find("one of 110 mm is longer than the way"), std::string::npos) << text;
  EXPECT_EQ(text.find("checked here"), std::string::npos) << text;
  EXPECT_NE(row("Wire length").at("text").get<std::string>().find("from the access point"),
            std::string::npos);
  expect_valid(report, folder.path());

  // What is asked for is not assumed, though it is what would be.
  const Json own = run_to_report(
      folder / "case.json", folder / "cache", 0,
      {"access_limits.sheath_diameter_mm=2.7", "access_limits.device_diameter_mm=1.67",
       "access_limits.catheter_length_mm=1000", "access_limits.working_length_mm=100"});
  for (const Json& each : list) {
    const std::string what = each.at("what");
    EXPECT_EQ(each.at("assumed"), what != "Wire" && what != "In reserve") << what;
  }
  for (const Json& each : own.at("fetch")) EXPECT_FALSE(each.at("assumed")) << each;
}

TEST(Report, WeighsASheathThatTheCaseGivesThoughTheWayIsShorter) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  for (const bool given : {false, true}) {
    SCOPED_TRACE(given);
    const Json report =
        run_to_report(folder / "case.json", folder / "cache", 0,
                      given ? std::vector<std::string>{"access_limits.sheath_length_mm=110",
                                                       "access_limits.sheath_diameter_mm=2.7"}
                            : std::vector<std::string>{});
    const Json& sheath = report.at("anatomy").at("access").at("sheath");
    EXPECT_EQ(sheath.at("length_mm"), 110);
    EXPECT_EQ(sheath.at("assumed"), !given);
    EXPECT_EQ(sheath.at("assumed_longer_than_way"), !given);
    const std::string reasons = report.at("verdict").at("reasons").dump();
    EXPECT_EQ(reasons.find("No sheath is weighed") == std::string::npos, given);
    EXPECT_EQ(reasons.find("The sheath of 2.7 mm is") != std::string::npos, given);
    expect_valid(report, folder.path());
  }
}

TEST(Report, StepsOfAScriptHaveTheViewOfThePlaceNextToTheTip) {
  const auto view = [](const char* name) { return Json{{"view", name}, {"reachable", true}}; };
  const Json anatomy = {
      {"c_arm",
       {{"ostia", Json::array({Json{{"branch", "left renal"},
                                    {"leads_to_target", true},
                                    {"at_mm", 230.0},
                                    {"best", view("LAO 30, CRA 0")},
                                    {"second", nullptr}}})},
        {"bend", {{"at_mm", 40.0}, {"best", view("RAO 10, CRA 5")}, {"second", nullptr}}}}}};
  const plan::Candidate candidate{.moves = {{.push = 60.0}, {.turn = kPi / 2}, {.push = 140.0}}};
  const plan::Study study;
  plan::Measured trial;
  trial.metrics.insertion = 250.0;
  const Json steps = step_views_json(study, candidate, trial, anatomy);
  ASSERT_EQ(steps.size(), 4u);
  EXPECT_EQ(steps[0].at("text"), "push 60.0 mm");
  EXPECT_EQ(steps[0].at("at"), "bend at 40 mm");
  EXPECT_EQ(steps[1].at("text"), "turn 90 deg clockwise");
  EXPECT_EQ(steps[1].at("view"), "RAO 10, CRA 5");
  EXPECT_EQ(steps[2].at("at"), "ostium of left renal") << "200 mm in";
  EXPECT_EQ(steps[3].at("view"), "LAO 30, CRA 0");

  Json straight = anatomy;
  straight["c_arm"] = {{"ostia", Json::array()},
                       {"bend", {{"at_mm", 40.0}, {"best", nullptr}, {"second", nullptr}}},
                       {"no_views", nullptr}};
  EXPECT_TRUE(step_views_json(study, candidate, trial, straight).at(0).at("at").is_null());
}

TEST(Report, StepsAtASideVesselHaveTheViewOfItsOstium) {
  const auto ostium = [](const char* branch, double at, bool target) {
    return Json{{"branch", branch},
                {"leads_to_target", target},
                {"at_mm", at},
                {"best", {{"view", branch}, {"reachable", true}}},
                {"second", nullptr}};
  };
  const Json anatomy = {
      {"c_arm",
       {{"ostia", {ostium("left iliac", 66.0, false), ostium("renal", 160.0, true)}},
        {"bend", {{"at_mm", 170.0}, {"best", nullptr}, {"second", nullptr}}},
        {"no_views", nullptr}}}};
  plan::Candidate candidate{.catheter = 0};
  candidate.steps = {
      {.tool = 1, .push = 250.0},
      {.tool = 1, .push = 80.0, .until = simulate::Until::kInBranch, .at = 60.0, .side = 1},
      {.tool = simulate::kBothTools, .push = -40.0},
      {.tool = 1, .push = 60.0}};
  plan::Measured trial;
  trial.metrics.insertion = 286.0;
  const Json steps = step_views_json(plan::iliacs::study(), candidate, trial, anatomy);
  ASSERT_EQ(steps.size(), 4U);
  for (const std::size_t k : {0U, 2U, 3U}) EXPECT_EQ(steps[k].at("at"), "ostium of renal") << k;
  EXPECT_EQ(steps[1].at("at"), "ostium of left iliac");
  EXPECT_EQ(steps[1].at("view"), "left iliac");
}

TEST(Report, ATargetWithoutARadiusIsTheVesselsCrossSection) {
  // Both wires run along the wall, 3.5 mm off a target that is 4 mm further on than its point.
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const std::string target = R"(target={"point_mm": [0, 0, 24], "beyond_mm": 4})";
  const Json report = run_to_report(folder / "case.json", folder / "cache", 0, {target});
  EXPECT_EQ(report.at("ranking").size(), 2u);
  EXPECT_NEAR(report.at("vessel").at("target_lumen_radius_mm"), 4.0, 0.2);
  for (const Json& trial : report.at("trials")) {
    EXPECT_TRUE(trial.at("reached")) << trial.at("reason");
    EXPECT_TRUE(trial.at("safe"));
    EXPECT_NEAR(trial.at("insertion_mm"), 22.0, 3.0);
    EXPECT_GT(trial.at("tip_to_target_mm"), 4.0) << "of the point";
  }
  for (const Json& plan : report.at("ranking")) {
    EXPECT_EQ(plan.at("score_components").at("reach"), 0.0);
    EXPECT_NE(plan.at("sentence").get<std::string>().find("safe in "), std::string::npos);
  }
  expect_valid(report, folder.path());

  const Json sphere = run_to_report(folder / "case.json", folder / "cache", 0,
                                    {R"(target={"point_mm": [0, 0, 28], "radius_mm": 1})"});
  EXPECT_NE(sphere.dump().find("less than the lumen's radius"), std::string::npos);
}

TEST(Report, KeepsToItsSchemaInARigidVesselWithoutFrictionAndSaysSo) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0, {"wall.model=rigid", "friction=0"});
  const Json warnings = report.at("provenance").at("warnings");
  const auto warned = [&](const std::string& text) {
    return std::any_of(warnings.begin(), warnings.end(), [&](const Json& warning) {
      return warning.get<std::string>().find(text) != std::string::npos;
    });
  };
  EXPECT_TRUE(warned("frictionless (friction is 0): push forces are lower bounds")) << warnings;
  EXPECT_TRUE(warned("rigid wall: contact forces are upper bounds")) << warnings;
  for (const Json& trial : report.at("trials")) {
    EXPECT_TRUE(trial.at("peak_wall_displacement_mm").is_null());
    EXPECT_TRUE(trial.at("beyond_linear_theory").is_null());
    EXPECT_EQ(trial.at("null_reasons").at("beyond_linear_theory"), "the wall is rigid");
    EXPECT_EQ(trial.at("friction_work_n_mm"), 0.0);
  }
  expect_valid(report, folder.path());
}

TEST(Report, TellsHowTheWallMovedAndWhereTheWorkWent) {
  // A wire askew onto a wall so soft that linear theory ends.
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0,
                    {"wall.young_modulus_kpa=20", "access.inclination_deg=[30]", "friction=0.2"});
  ASSERT_EQ(report.at("trials").size(), 1u);
  const Json& trial = report.at("trials")[0];
  ASSERT_TRUE(trial.at("wall_motion").is_object()) << trial;
  EXPECT_TRUE(trial.at("beyond_linear_theory")) << trial.at("wall_motion");
  EXPECT_NEAR(trial.at("wall_motion").at("radius_mm").get<double>(), 4.0, 0.3) << "of the tube";
  EXPECT_GT(trial.at("friction_work_n_mm"), 0.0);
  EXPECT_GT(trial.at("push_work_n_mm"), trial.at("friction_work_n_mm"));
  EXPECT_NE(report.at("provenance").at("warnings").dump().find("1 of 1 moved the wall beyond"),
            std::string::npos);
  EXPECT_EQ(report.at("vessel").at("wall_model"), "elastic");
  expect_valid(report, folder.path());
}

TEST(Report, TellsHowTheVesselMovesAsAWholeAlsoUnderDisturbances) {
  // 16 ways in, so that most are scouted; they all lean and shove the tube aside.
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0,
                    {"wall.support_kpa_per_mm=1", "access.inclination_deg=[15, 20, 25, 30]",
                     "access.azimuth_deg=[0, 90, 180, 270]", "robustness.repeats=4"});
  EXPECT_TRUE(report.at("numerics").at("scout").at("moves_as_a_whole"));
  ASSERT_FALSE(report.at("ranking").empty());
  for (const Json& trial : report.at("trials")) EXPECT_NE(trial.at("outcome"), "left_lumen");
  const Json& motion = report.at("vessel_motion").at("trials").at(0);
  EXPECT_EQ(motion.at("trial"), report.at("ranking")[0].at("trial"));
  EXPECT_GT(motion.at("most_mm"), 1e-3);
  EXPECT_LT(motion.at("most_mm"), 3.0);
  const Json& most = motion.at("under_disturbances").at("most_mm");
  EXPECT_EQ(motion.at("under_disturbances").at("repeats"), 4);
  EXPECT_LE(most.at("low"), most.at("median"));
  EXPECT_GT(most.at("high").get<double>(), 1.5 * most.at("low").get<double>())
      << "the support is spread over a hundredfold";
  const std::string warnings = report.at("provenance").at("warnings").dump();
  for (const char* told : {"not measured on the patient", "no layers, no prestress",
                           "2.3 mm after fitting one value, 4.6 mm without"}) {
    EXPECT_NE(warnings.find(told), std::string::npos) << warnings;
  }
  expect_valid(report, folder.path());
}

TEST(Report, MapsTheForcesOnTheWall) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  RunOptions options;
  options.cache = folder / "cache";
  const RunResult result =
      run_stages(read_case(folder / "case.json", {"wall.model=rigid"}), options);
  const fs::path results = result.artifacts.back().folder;
  const Json report = read_json(results / "report.json", kReportSchema);
  EXPECT_EQ(report.at("artifacts")[3].at("file"), "forces.vtu");
  EXPECT_GT(preprocess::read_wall(results / "forces.vtu").apexes.cols(), 100);
  const std::string bytes = read_text(results / "forces.vtu");
  EXPECT_NE(bytes.find("Name=\"peak_force_n\""), std::string::npos);
  EXPECT_NE(bytes.find("Name=\"peak_force_best_plan_n\""), std::string::npos);
}

TEST(Report, ScoutedCandidatesLeaveTheBestPlansAsTheyAre) {
  // 13 ways in; behind a narrow lean all is alike, so that the scout saves some.
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const std::vector<std::string> ways = {"access.inclination_deg=[0, 10, 20, 30]",
                                         "access.azimuth_deg=[0, 90, 180, 270]",
                                         "robustness.repeats=0"};
  std::vector<std::string> all = ways;
  all.push_back("search.exhaustive=true");
  const Json some = run_to_report(folder / "case.json", folder / "cache", 0, ways);
  const Json every = run_to_report(folder / "case.json", folder / "cache", 0, all);
  EXPECT_TRUE(every.at("numerics").at("scout").is_null());
  const Json& scout = some.at("numerics").at("scout");
  EXPECT_EQ(scout.at("trials"), 13);
  const int compared = scout.at("compared");
  EXPECT_GE(compared, 5);
  EXPECT_LT(compared, 13);
  EXPECT_EQ(scout.at("probed"), 0);  // all that may matter were seen to reach
  EXPECT_EQ(some.at("timing").at("trials").at("levels").size(), 3u);  // scouts, probes, in full

  ASSERT_FALSE(every.at("ranking").empty());
  EXPECT_EQ(some.at("ranking")[0].at("trial"), every.at("ranking")[0].at("trial"));
  EXPECT_EQ(some.at("ranking")[0].at("score"), every.at("ranking")[0].at("score"));
  int scouted = 0;
  for (const Json& trial : some.at("trials")) {
    scouted += trial.at("level") != "full" ? 1 : 0;
    if (trial.at("level") == "full") {
      EXPECT_EQ(trial.at("peak_contact_force_n"),
                every.at("trials")[trial.at("id").get<std::size_t>()].at("peak_contact_force_n"));
    }
  }
  EXPECT_EQ(scouted, 13 - compared);
  expect_valid(some, folder.path());
}

TEST(Report, TellsHowThePlansFareUnderDisturbances) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0, {"robustness.repeats=12"});
  const Json& robustness = report.at("robustness");
  EXPECT_EQ(report.at("provenance").at("seed"), robustness.at("seed"));
  EXPECT_EQ(robustness.at("unknowns").at("lumen_mm"), 0.25) << "chosen for a surface";
  ASSERT_EQ(robustness.at("disturbances").size(), 12u);
  ASSERT_EQ(robustness.at("plans").size(), report.at("ranking").size()) << "fewer than five";
  for (const Json& plan : report.at("ranking")) {
    EXPECT_FALSE(plan.at("mean_score").is_null());
    const double rate = plan.at("success_rate");
    EXPECT_LT(plan.at("success_rate_interval")[0], rate);
    EXPECT_GE(plan.at("success_rate_interval")[1], rate);
  }
  for (const Json& plan : robustness.at("plans")) {
    const Json& force = plan.at("peak_contact_force_n");
    EXPECT_LE(force.at("low"), force.at("median"));
    EXPECT_LE(force.at("median"), force.at("high"));
    // Straight in, it does not touch at all.
    const Json& trial = report.at("trials")[plan.at("trial").get<std::size_t>()];
    if (trial.at("inclination_deg") > 0.0) {
      EXPECT_LT(force.at("low"), force.at("high"));
    }
    EXPECT_EQ(plan.at("scores").size(), 12u);
    EXPECT_EQ(plan.at("successes").get<std::size_t>() + plan.at("failures").size(), 12u);
  }
  double sum = 0.0;
  for (const Json& share : robustness.at("sensitivity").at("shares")) {
    sum += share.at("share").get<double>();
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
  expect_valid(report, folder.path());
}

TEST(Report, RepeatsMoreThan32TimesWhatIsTheBestOf32) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report = run_to_report(
      folder / "case.json", folder / "cache", 0,
      {"robustness.repeats=36", "robustness.plans=1", "access.azimuth_deg=[0, 90, 180, 270]"});
  const Json& robustness = report.at("robustness");
  ASSERT_EQ(robustness.at("disturbances").size(), 36u);
  ASSERT_GT(report.at("ranking").size(), 1u);
  int in_full = 0;
  for (const Json& plan : robustness.at("plans")) {
    const int repeats = plan.at("repeats");
    EXPECT_TRUE(repeats == 32 || repeats == 36) << repeats;
    EXPECT_EQ(plan.at("scores").size(), static_cast<std::size_t>(repeats));
    const bool first = plan.at("trial") == report.at("ranking")[0].at("trial");
    EXPECT_TRUE(!first || repeats == 36);
    in_full += repeats == 36 ? 1 : 0;
  }
  EXPECT_LT(in_full, static_cast<int>(report.at("ranking").size()));
  EXPECT_NE(report.at("ranking")[0].at("sentence").dump().find(" of 36 perturbed"),
            std::string::npos);
  expect_valid(report, folder.path());
}

TEST(Report, LooksForManoeuvresWhereNoStraightPlanHolds) {
  // A bent tip and a target beside the axis: some rolls reach.
  const TemporaryFolder folder;
  Json file = write_finished_tube(folder.path());
  file["wires"][0]["sections"] =
      Json::array({{{"length_mm", 8}, {"bending_stiffness_n_mm2", 5}, {"rest_radius_mm", 10}},
                   {{"length_mm", 200}, {"bending_stiffness_n_mm2", 50}}});
  file["access"]["inclination_deg"] = {0};
  file["tip_roll_deg"] = {0, 90, 180, 270};
  file["target"] = {{"point_mm", {0, 2, 28}}, {"radius_mm", 1.5}};
  write_json(file, folder / "case.json");
  const auto starts = [&](const std::vector<std::string>& changes) {
    RunOptions options;
    options.cache = folder / "cache";
    options.to = "manoeuvres";
    const RunResult result = run_stages(read_case(folder / "case.json", changes), options);
    const Json found =
        read_json(result.artifacts.back().folder / kFiguresFile, "wireplan.manoeuvres/1");
    const int tried = found.at("starts");
    EXPECT_EQ(found.at("searches").empty(), tried == 0);
    for (const Json& search : found.at("searches")) EXPECT_GE(search.at("branches"), tried);
    return tried;
  };
  EXPECT_EQ(starts({"robustness.angle_deg=0", "robustness.entry_mm=0", "robustness.lumen_mm=0.01"}),
            0);
  EXPECT_GT(starts({"robustness.angle_deg=45", "robustness.entry_mm=2"}), 0);
}

TEST(Report, RanksWithoutRepeatsWhereTheCaseAsksForNone) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0, {"robustness.repeats=0"});
  ASSERT_FALSE(report.at("ranking").empty());
  EXPECT_TRUE(report.at("ranking")[0].at("success_rate").is_null());
  EXPECT_EQ(report.at("ranking")[0].at("null_reasons").at("success_rate"), "no plan is repeated");
  EXPECT_TRUE(report.at("robustness").at("plans").empty());
  expect_valid(report, folder.path());
}

TEST(Report, KeepsToItsSchemaWithoutPlans) {
  // 12 mm of wire do not come to a target 22 mm away.
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0, {"insertion.length_mm=12"});
  EXPECT_TRUE(report.at("ranking").empty());
  EXPECT_EQ(report.at("excluded").size(), 2u);
  EXPECT_EQ(report.at("outcome"), "no plan reaches the target");
  EXPECT_NE(describe_best(report).find("no plan reaches the target"), std::string::npos);
  EXPECT_EQ(report.at("verdict").at("answer"), "not_feasible");
  EXPECT_EQ(report.at("verdict").at("headline"), "None of 2 trials reaches the target.");
  EXPECT_NE(report.at("verdict").at("changes").at(0).get<std::string>().find("More wire"),
            std::string::npos);
  expect_valid(report, folder.path());
}

TEST(Report, IsTheSameOutsideTimingAtAnyThreadCount) {
  const TemporaryFolder folder;
  write_tube_case(folder.path());
  std::string first;
  for (const int threads : {1, 2, 3, 8}) {
    SCOPED_TRACE(threads);
    Json report =
        run_to_report(folder / "case.json", folder / ("cache" + std::to_string(threads)), threads);
    EXPECT_EQ(report.at("timing").at("threads"), threads);
    report.erase("timing");
    if (first.empty()) first = report.dump();
    EXPECT_EQ(report.dump(), first);
  }
}

TEST(Report, NamesNoFolderOfThisMachine) {
  const TemporaryFolder folder;
  Json file = write_finished_tube(folder.path());
  file["surface"]["path"] = (folder / "tube.stl").string();  // absolute
  write_json(file, folder / "case.json");
  const Json report = run_to_report(folder / "case.json", folder / "cache");
  EXPECT_EQ(report.dump().find(folder.path().string()), std::string::npos);
  EXPECT_EQ(report.at("provenance").at("inputs")[0].at("name"), "tube.stl");
}

TEST(Report, PrintsTheValuesThatStagesChose) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0, {"insertion.length_mm=0"});
  const Json& parameters = report.at("provenance").at("parameters");
  // 1.25 times the path and 20 mm more, rounded up.
  const double path = report.at("vessel").at("branches")[0].at("length_mm");
  EXPECT_EQ(parameters.at("insertion").at("length_mm"), std::ceil(1.25 * path + 20.0));
  EXPECT_GT(parameters.at("wall").at("young_modulus_kpa"), 0.0);
}

}  // namespace
}  // namespace wireplan::pipeline
