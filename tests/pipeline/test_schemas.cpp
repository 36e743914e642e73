// The schemas of the files that wireplan reads and writes: whose file it is and which version reads
// it is told, and what the program writes keeps to them.
#include <gtest/gtest.h>

#include "pipeline/report/report.h"
#include "tests/pipeline/finished_case.h"
#include "tests/pipeline/program.h"

namespace wireplan::pipeline {
namespace {

std::string refusal(const Json& file, const std::string& schema) {
  try {
    parse_json(file.dump(), "FILE", schema);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Schemas, TheVersionThatReadsAFileIsTold) {
  const std::string here = "wireplan " + build_info().at("version").get<std::string>();
  const std::string expected = ", expected \"wireplan.case/1\" (";
  EXPECT_EQ(refusal({{"schema", "wireplan.case/1"}}, "wireplan.case/1"), "");
  EXPECT_EQ(refusal({{"schema", "wireplan.case/2"}}, "wireplan.case/1"),
            "FILE: schema is \"wireplan.case/2\"" + expected + "a later wireplan reads it, " +
                here + " is too old)");
  EXPECT_EQ(refusal({{"schema", "wireplan.case/0"}}, "wireplan.case/1"),
            "FILE: schema is \"wireplan.case/0\"" + expected + "an earlier wireplan reads it, " +
                here + " does not; make the file anew)");
  EXPECT_EQ(refusal({{"name", "x"}}, "wireplan.case/1"),
            "FILE: schema is missing" + expected + "the version that " + here + " reads)");
  EXPECT_EQ(refusal({{"schema", 1}}, "wireplan.case/1"),
            "FILE: schema is 1" + expected + "the version that " + here + " reads)");
  EXPECT_EQ(refusal({{"schema", "case"}}, "wireplan.case/1"),
            "FILE: schema is \"case\"" + expected + "the version that " + here + " reads)");
}

TEST(Schemas, AReportTellsItselfWhichVersionWroteIt) {
  Json report = {{"schema", "wireplan.report/7"}};
  report["provenance"]["program"]["version"] = "9.1.0";
  EXPECT_EQ(refusal(report, kReportSchema),
            "FILE: schema is \"wireplan.report/7\", expected \"wireplan.report/2\" (wireplan 9.1.0 "
            "wrote it and reads it, wireplan " +
                build_info().at("version").get<std::string>() + " does not)");
  report["provenance"] = "none";
  EXPECT_NE(refusal(report, kReportSchema), "");
}

TEST(Schemas, AFileOfAnotherKindIsToldItsCommand) {
  const std::string here = "FILE: schema is \"wireplan.scene/1\", expected \"wireplan.case/1\" ";
  EXPECT_EQ(refusal({{"schema", "wireplan.scene/1"}}, "wireplan.case/1"),
            here + "(`wireplan simulate` reads this file)");
}

TEST(Schemas, AReportThatIsCutOutIsRefusedWithItsRemedy) {
  const TemporaryFolder folder;
  write_json({{"schema", "wireplan.report/1"}, {"ranking", Json::array({1})}, {"trials", 3}},
             folder / "report.json");
  try {
    read_report(folder / "report.json");
    FAIL() << "half a report was read";
  } catch (const Error& error) {
    EXPECT_EQ(
        std::string(error.what()),
        (folder / "report.json").string() +
            ": is no whole report, expected trials and ranking as `wireplan run` writes them; "
            "run the case again");
  }
}

TEST(Schemas, WhatTheProgramWritesKeepsToThem) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path(), "cache/wireplan");
  ASSERT_EQ(run_program(folder.path(), "run case.json -o results").code, 0);
  ASSERT_EQ(run_program(folder.path(), "run case.json -o short --set insertion.length_mm=12").code,
            1);
  ASSERT_EQ(run_program(folder.path(), "batch case.json -o batch").code, 0);
  Json wire = {{"sections", Json::array({{{"length_mm", 25},
                                          {"element_length_mm", 1},
                                          {"bending_stiffness_n_mm2", 50},
                                          {"radius_mm", 0.4}}})}};
  Json bench = {{"schema", "wireplan.scene/1"}, {"wire", wire}};
  bench["supports"] = Json::array({{{"at", "proximal"},
                                    {"kind", "clamped"},
                                    {"point_mm", {0, 0, 6}},
                                    {"direction", {0, 0, 1}}}});
  bench["loads"] = {{"tip_force_n", {0.2, 0, 0}}};
  write_json(bench, folder / "bench.json");
  ASSERT_EQ(run_program(folder.path(), "simulate bench.json -o bench").code, 0);
  Json pushed = {{"schema", "wireplan.scene/1"}, {"wire", wire}};
  pushed["vessel"] = {{"surface", {{"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}}},
                      {"wall", {{"model", "elastic"}}}};
  pushed["insertion"] = {{"point_mm", {0, 0, 6}}, {"direction", {0.3, 0, 1}}, {"length_mm", 20}};
  write_json(pushed, folder / "pushed.json");
  ASSERT_EQ(run_program(folder.path(), "simulate pushed.json -o pushed").code, 0);
  pushed["insertion"].erase("length_mm");
  pushed["insertion"]["roll_deg"] = {0, 45};
  pushed["insertion"]["moves"] = Json::array({{{"push_mm", 5}}, {{"pull_mm", 2}, {"turn_deg", 9}}});
  pushed["start"] = {{"nodes_mm", {{0, 0, 6}, {1, 0, 12}, {2, 0, 18}}}};
  write_json(pushed, folder / "moved.json");
  ASSERT_EQ(run_program(folder.path(), "simulate moved.json -o moved").code, 0);
  const Json tool = {{"insertion_mm", 40}, {"device", "cobra-c2"}, {"name", "catheter"}},
             inner = {{"insertion_mm", 20}, {"device", "rosen-cook"}, {"name", "wire"}};
  Json tools = {{"schema", "wireplan.scene/1"}, {"tools", Json::array({tool, inner})}};
  tools["introducer"] = {{"direction", {0, 0, 1}}};
  tools["supports"] =
      Json::array({{{"at", "distal"}, {"kind", "pinned"}, {"point_mm", {5, 0, 37}}}});
  tools["moves"] = Json::array(
      {{{"tool", "wire"}, {"push_mm", 5}},
       {{"together", Json::array({{{"tool", "wire"}, {"turn_deg", 20}},
                                  {{"tool", "catheter"}, {"push_mm", 1}, {"turn_deg", 5}}})}}});
  write_json(tools, folder / "tools.json");
  ASSERT_EQ(run_program(folder.path(), "simulate tools.json -o tools").code, 0);
  expect_follows_schemas(folder.path());
}

}  // namespace
}  // namespace wireplan::pipeline
