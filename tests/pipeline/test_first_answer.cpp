// What a run tells before it has its answer.
#include <gtest/gtest.h>

#include "pipeline/report/page.h"
#include "pipeline/stages/stages.h"
#include "tests/pipeline/finished_case.h"
#include "tests/pipeline/program.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

TEST(FirstAnswer, IsToldWhileARunGoesOn) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path(), "cache/wireplan");
  const std::string many =
      "run case.json --set access.azimuth_deg=[0,30,60,90,120,150,180,210,240,270,300,330] --set "
      "robustness.repeats=0";
  const Answer answer = run_program(folder.path(), many);
  ASSERT_EQ(answer.code, 0) << answer.log;
  const std::size_t first =
      answer.log.find("first answer, of coarse pushes against a rigid wall: ");
  ASSERT_NE(first, std::string::npos) << answer.log;
  EXPECT_LT(first, answer.log.find("trials      made"));
  EXPECT_NE(answer.log.find("of 13 reach the target, first ", first), std::string::npos);
  EXPECT_NE(answer.log.find("not known yet: the wall as it yields", first), std::string::npos);
  EXPECT_EQ(answer.out.find("first answer"), std::string::npos);
  EXPECT_EQ(run_program(folder.path(), many).log.find("first answer"), std::string::npos)
      << "all is known then";

  // The wall of its coarse pushes is told as it is.
  const auto first_of = [&](const std::string& wall) {
    const std::string log = run_program(folder.path(), many + " --to trials --set " + wall).log;
    const std::size_t begin = log.find("first answer"), end = log.find('\n', begin);
    return begin == std::string::npos ? log : log.substr(begin, end - begin);
  };
  const std::string moves = first_of("wall.support_kpa_per_mm=1");
  EXPECT_TRUE(
      moves.starts_with("first answer, of coarse pushes against a wall that moves as a "
                        "whole but takes no dents: "))
      << moves;
  EXPECT_TRUE(moves.ends_with("not known yet: the wall as it yields, errors, disturbances"))
      << moves;
  const std::string rigid = first_of("wall.model=rigid");
  EXPECT_TRUE(rigid.ends_with("not known yet: errors, disturbances")) << rigid;
}

TEST(FirstAnswer, HasAPageBeforeErrorsAndRepeatsAreKnown) {
  if (!page_missing().empty()) GTEST_SKIP() << page_missing();
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const Case given = read_case(folder / "case.json", {"robustness.seed=9"});  // plans are made anew
  RunOptions options;
  options.cache = folder / "cache";
  std::string page;
  options.before_plans = [&](Workspace& work) {
    EXPECT_FALSE(work.has("plans"));
    page = make_first_page(work);
  };
  const RunResult result = run_stages(given, options);
  ASSERT_FALSE(page.empty());
  const auto report_of = [](const std::string& text) {
    return Json::parse(page_block(text, "report"));
  };
  Json early = report_of(page);
  const fs::path made = result.artifacts.back().folder;
  const Json last = report_of(read_text(made / "report.html"));
  EXPECT_EQ(early.at("name"), last.at("name").get<std::string>() + " (preliminary)");
  EXPECT_NE(early.at("provenance").at("warnings")[0].get<std::string>().find("preliminary"),
            std::string::npos);
  ASSERT_EQ(early.at("trials").size(), last.at("trials").size());
  EXPECT_EQ(early.at("trials")[0].at("outcome"), last.at("trials")[0].at("outcome"));
  EXPECT_FALSE(early.at("ranking").empty());
  EXPECT_TRUE(early.at("numerics").at("plans").empty());
  EXPECT_FALSE(last.at("numerics").at("plans").empty());

  // It has all that a page reads.
  early["timing"] = Json::parse(page_block(page, "timing"));
  fs::create_directories(folder / "early");
  write_json(early, folder / "early" / "report.json");
  expect_follows_schemas(folder / "early");

  page.clear();  // all is cached now
  run_stages(given, options);
  EXPECT_TRUE(page.empty());
}

}  // namespace
}  // namespace wireplan::pipeline
