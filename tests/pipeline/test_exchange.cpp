// A wire brought in through the placed catheter in exchange for another: in the files, the report
// and its page, from a case on.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>

#include "pipeline/files/case_file.h"
#include "pipeline/files/trial_file.h"
#include "pipeline/report/fetch_json.h"
#include "pipeline/report/report.h"
#include "pipeline/report/tools_json.h"
#include "pipeline/report/verdict_json.h"
#include "pipeline/stages/stages.h"
#include "tests/pipeline/small_case.h"
#include "tests/plan/two_renals.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

TEST(Exchange, NamesBothWires) {
  ReportInput input;
  input.study.wires = {{.name = "soft", .sections = {{.length = 1500.0}}},
                       {.name = "stiff", .sections = {{.length = 1500.0}}}};
  input.study.catheters.emplace_back().tool.wire = {.name = "cobra",
                                                    .sections = {{.length = 650.0}}};
  plan::Candidate script{.wire = 1, .moves = {}, .catheter = 0, .steps = {}, .first_wire = 0};
  script.steps = {{.tool = 1, .push = 296.0},
                  {.tool = 0, .push = 280.0},
                  {.tool = 1, .at = 10.0, .spare = 0},
                  {.tool = 1, .push = 60.0}};
  plan::Measured trial;
  trial.metrics.insertion = 320.0;
  const Json steps = told_steps_json(input.study, script, trial);
  EXPECT_EQ(steps[2].at("tool"), "wire");
  EXPECT_EQ(steps[2].at("exchange").at("behind_mm"), 10);
  EXPECT_FALSE(steps[2].contains("push_mm"));
  EXPECT_EQ(steps[2].at("text"),
            "hold the catheter, withdraw the wire whole and bring in stiff through it, to 270 mm");

  // Two wires and a catheter are fetched for the first plan, none again for the second.
  input.plan.candidates = {script, {.wire = 0, .moves = {}, .catheter = 0, .steps = {}}};
  input.judgement.ranking.plans.resize(2);
  input.judgement.ranking.plans[1].trial = 1;
  const Json sheath = {{"max_ratio", 1.05},
                       {"lumen_diameter_mm", 8},
                       {"device_diameter_mm", 2.7},
                       {"assumed_longer_than_way", false},
                       {"assumed", true}};
  const Json anatomy = {
      {"access", {{"device", {{"device_diameter_mm", 1.67}}}, {"sheath", sheath}}},
      {"lengths",
       {{"way_mm", 300},
        {"catheter_mm", 650},
        {"working_mm", 100},
        {"wire_needed_mm", 1050},
        {"working_assumed", true},
        {"catheter_assumed", false}}}};
  const Json list = fetch_json(input, anatomy);
  std::vector<std::string> items;
  for (const Json& row : list) {
    if (row.at("what") == "Sheath" || row.at("what") == "Wire length") continue;
    items.push_back(row.at("what").get<std::string>() + ": " +
                    row.at("items").at(0).get<std::string>());
  }
  EXPECT_EQ(items, (std::vector<std::string>{"Wire: stiff", "Wire to begin with: soft",
                                             "Catheter: cobra"}));

  // How it ended is told of pairs whose own scripts do not hold.
  plan::ExchangeFindings ended{.first_wire = 0, .found = 2, .held = 0.5, .stopped = {}};
  const Json one = exchange_json(input.study, ended);
  EXPECT_EQ(one.at("first_wire"), "soft");
  EXPECT_EQ(one.at("neighbours_reach"), 0.5);
  EXPECT_TRUE(exchange_json(input.study, {}).is_null());
  ended = {.first_wire = -1, .found = 0, .held = 0.0, .stopped = "no other wire comes through"};
  EXPECT_FALSE(exchange_json(input.study, ended).at("tried"));
  EXPECT_EQ(describe_tools({{"wire", "stiff"}, {"catheter", "cobra"}, {"first_wire", "soft"}}),
            "stiff in cobra in exchange for soft");
}

/// One line tells the script, and after how much of this time it was found.
void expect_first_script(const std::vector<std::string>& lines, std::chrono::duration<double> all) {
  const std::string begin = "first script, after ",
                    then = " s of the search, of its coarse steps: ";
  int count = 0;
  for (const std::string& line : lines) {
    if (line.find(begin) != 0) continue;
    ++count;
    std::size_t digits = 0;
    const int seconds = std::stoi(line.substr(begin.size()), &digits);
    EXPECT_GE(seconds, 0);
    EXPECT_LE(seconds, std::lround(all.count())) << line;
    EXPECT_EQ(line.find(then + "soft in hook, ", begin.size()), begin.size() + digits) << line;
    EXPECT_NE(line.find(": advance the wire to "), std::string::npos) << line;
    EXPECT_NE(line.find("; not known yet: whether it holds in full"), std::string::npos) << line;
  }
  EXPECT_EQ(count, 1);
}

TEST(Exchange, IsToldFromTheSearchToThePage) {
  const TemporaryFolder folder;
  write_stl(plan::oblique_surface(), folder / "aorta.stl");
  const Vec3 target = Vec3(0.0, 0.0, plan::kHigh) + plan::kOut * plan::kAside;
  const auto device = [](const char* name, double diameter, double friction, Json sections) {
    return Json{{"name", name},
                {"diameter_mm", diameter},
                {"friction", friction},
                {"sections", std::move(sections)}};
  };
  const auto wire = [&](const char* name, double tip, double shaft) {
    return device(name, 0.88, 0.04,
                  {{{"length_mm", 30}, {"bending_stiffness_n_mm2", tip}},
                   {{"length_mm", 1470}, {"bending_stiffness_n_mm2", shaft}}});
  };
  Json hook =
      device("hook", 1.66, 0.1,
             {{{"length_mm", 8}, {"bending_stiffness_n_mm2", 99}},
              {{"length_mm", 4 * kPi}, {"bending_stiffness_n_mm2", 99}, {"rest_radius_mm", 8}},
              {{"length_mm", 650 - 8 - 4 * kPi}, {"bending_stiffness_n_mm2", 332}}});
  hook["inner_diameter_mm"] = 1.0;
  Json file = {{"schema", "wireplan.case/1"}, {"name", "oblique"}};
  file["surface"] = {{"path", "aorta.stl"}, {"unit", "mm"}, {"frame", "LPS"}};
  file["access"] = {{"point_mm", {0, 0, 5}}, {"inclination_deg", {0}}, {"azimuth_deg", {0}}};
  file["target"]["point_mm"] = to_json(target);
  file["wires"] = {wire("soft", 2, 60), wire("stiff", 5, 3000)};
  file["catheters"] = {hook};
  file["tip_roll_deg"] = {0};
  file["wall"]["model"] = "rigid";
  file["insertion"]["element_length_mm"] = 1.5;
  file["robustness"]["repeats"] = 0;
  write_json(file, folder / "case.json");
  RunOptions options;
  options.cache = folder / "cache";
  options.work.threads = 2;
  std::mutex mutex;
  std::vector<std::string> lines;
  options.work.told = [&](const std::string& line) {
    const std::scoped_lock lock(mutex);
    lines.push_back(line);
  };
  const auto start = std::chrono::steady_clock::now();
  const fs::path made =
      run_stages(read_case(folder / "case.json"), options).artifacts.back().folder;
  const Json report = read_json(made / "report.json", kReportSchema);
  expect_first_script(lines, std::chrono::steady_clock::now() - start);
  fs::create_directories(folder / "report");
  write_json(report, folder / "report/report.json");
  expect_follows_schemas(folder / "report");

  const Json& pairs = report.at("catheters").at("pairs");
  ASSERT_EQ(pairs.size(), 2U);
  EXPECT_FALSE(pairs[0].contains("exchange")) << "the soft one needs none";
  EXPECT_EQ(pairs[1].at("exchange").at("first_wire"), "soft") << pairs[1];
  EXPECT_EQ(pairs[1].at("exchange").at("reason"), "") << "it reaches in full";
  const Json& trials = report.at("trials");
  const auto exchanged = std::find_if(trials.begin(), trials.end(), [](const Json& trial) {
    return trial.value("exchanges", 0) == 1 && trial.at("reached");
  });
  ASSERT_NE(exchanged, trials.end());
  EXPECT_EQ(exchanged->at("wire"), "stiff");
  EXPECT_EQ(exchanged->at("first_wire"), "soft");
  EXPECT_NE(exchanged->at("script").get<std::string>().find("bring in stiff through it"),
            std::string::npos);
  const Json& each = exchanged->at("tools").at("each");
  ASSERT_EQ(each.size(), 3U);
  EXPECT_EQ(each[1].at("name"), "soft");
  EXPECT_EQ(each[1].at("insertion_mm"), 0);
  EXPECT_EQ(each[2].at("name"), "stiff");
  EXPECT_GT(exchanged->at("tools").at("hook_depth_mm"), 0);

  // The page knows from which push on it is the other wire.
  if (!fs::exists(made / "report.html")) return;  // built without it
  const std::string page = read_text(made / "report.html"), key = "\"exchanges\":[";
  const std::size_t told = page.find(key);
  ASSERT_NE(told, std::string::npos);
  EXPECT_GT(std::stoi(page.substr(told + key.size(), 6)), 100) << "pushes of 2 mm before that";
}

}  // namespace
}  // namespace wireplan::pipeline
