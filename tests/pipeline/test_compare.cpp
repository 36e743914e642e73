// `wireplan compare` on reports made by hand: only what it reads.
#include <gtest/gtest.h>

#include "pipeline/report/compare.h"
#include "pipeline/report/report.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {
namespace {

/// A report of one wire with one plan.
Json report_of(const std::string& wire, double score, const std::string& sha = "a") {
  Json report;
  report["schema"] = kReportSchema;
  report["name"] = "case-" + wire;
  report["provenance"] = {{"inputs", {{{"name", "ct"}, {"sha256", sha}}}},
                          {"parameters",
                           {{"access", {{"point_mm", {0, 0, 0}}}},
                            {"target", {{"point_mm", {1, 1, 1}}, {"radius_mm", 4}}},
                            {"limits", {{"tip_force_fail_n", 1.5}}},
                            {"ranking", {{"weights", {{"reach", 1}}}}},
                            {"robustness", {{"repeats", 16}}},
                            {"friction", 0.04},
                            {"wall", {{"model", "rigid"}}}}}};
  report["trials"] = Json::array({{{"peak_contact_force_n", 0.25}}, {{"peak_contact_force_n", 1}}});
  report["ranking"] = Json::array({{{"trial", 0},
                                    {"wire", wire},
                                    {"inclination_deg", 10},
                                    {"azimuth_deg", 90},
                                    {"roll_deg", 0},
                                    {"score", score},
                                    {"score_error", 0.01},
                                    {"mean_score", score + 0.1},
                                    {"expected_score", score + 0.1},
                                    {"success_rate", 0.75}}});
  report["wires"] = Json::array({{{"wire", wire},
                                  {"reached", 1},
                                  {"trials", 2},
                                  {"safe", 1},
                                  {"best_trial", 0},
                                  {"median_peak_contact_force_n", 0.25}}});
  return report;
}

class Compare : public ::testing::Test {
 protected:
  std::string compared(const std::vector<Json>& reports) {
    std::vector<std::filesystem::path> files;
    for (const Json& report : reports) {
      files.push_back(folder_ / (std::to_string(files.size()) + ".json"));
      write_json(report, files.back());
    }
    return compare_reports(files);
  }
  TemporaryFolder folder_;
};

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST_F(Compare, ReadsReportsOfTheVersionBefore) {
  Json older = report_of("amplatz", 0.2);
  const Json newer = report_of("glidewire", 0.3);
  const std::string same = compared({older, newer});
  older["schema"] = "wireplan.report/1";
  EXPECT_EQ(compared({older, newer}), same);
}

TEST_F(Compare, TellsEachVerdictWhereThereIsOne) {
  Json risky = report_of("amplatz", 0.2);
  risky["verdict"] = {{"answer", "feasible_with_risk"}};
  const std::string text = compared({risky, report_of("glidewire", 0.3)});
  EXPECT_TRUE(has(text, "verdict")) << text;
  EXPECT_TRUE(has(text, "case-amplatz    feasible with risk  ")) << text;
  EXPECT_TRUE(has(text, "case-glidewire  -  ")) << text;
}

TEST_F(Compare, PutsThePlansOfOnePatientInOneOrder) {
  const std::string text = compared({report_of("soft", 0.4), report_of("stiff", 0.3)});
  EXPECT_TRUE(has(text, "All reports are of one patient")) << text;
  const std::size_t list = text.find("Their best plans");
  ASSERT_NE(list, std::string::npos);
  EXPECT_LT(text.find("stiff, 10/90/0 deg", list), text.find("soft, 10/90/0 deg", list)) << text;
  EXPECT_TRUE(has(text, "0.300  0.010  0.400       0.75     0.250")) << text;
  EXPECT_FALSE(has(text, "not comparable"));
  EXPECT_TRUE(has(text, "not tried")) << "each wire in one report alone";
}

TEST_F(Compare, PutsPlansFirstThatAreSafeMoreOften) {
  Json often = report_of("soft", 0.4);
  often["ranking"][0]["success_rate"] = 1.0;  // as of a report that tells no expected rate
  Json better = report_of("stiff", 0.3);
  better["ranking"][0]["expected_success_rate"] = 0.75;
  const std::string text = compared({better, often});
  const std::size_t list = text.find("Their best plans");
  ASSERT_NE(list, std::string::npos);
  EXPECT_LT(text.find("soft, 10/90/0 deg", list), text.find("stiff, 10/90/0 deg", list)) << text;
}

TEST_F(Compare, PutsPlansLastWhoseEndIsUnsureAsAReportDoes) {
  for (const char* key : {"sensitive", "tip_unsure"}) {
    Json unsure = report_of("soft", 0.2);
    unsure["ranking"][0][key] = true;
    Json sure = report_of("stiff", 0.3);
    for (const char* each : {"sensitive", "tip_unsure"}) sure["ranking"][0][each] = false;
    const std::string text = compared({unsure, sure});
    const std::size_t list = text.find("Their best plans");
    ASSERT_NE(list, std::string::npos);
    EXPECT_LT(text.find("stiff, 10/90/0 deg", list), text.find("soft, 10/90/0 deg", list)) << text;
    EXPECT_TRUE(has(text, "soft, 10/90/0 deg, end unsure  ")) << text;
    EXPECT_TRUE(has(text, "stiff, 10/90/0 deg  ")) << text;
  }
}

TEST_F(Compare, PutsAWireOfManyPatientsInOneRow) {
  const std::string text =
      compared({report_of("soft", 0.4), report_of("soft", 0.6, "b"), report_of("soft", 0.5, "c")});
  EXPECT_TRUE(has(text, "different vessels")) << text;
  EXPECT_TRUE(has(text, "soft  1/2  1  0.400  0.250  1/2  1  0.600  0.250  1/2  1  0.500  0.250"))
      << text;
}

TEST_F(Compare, SaysWhereScoresCannotBeCompared) {
  Json other = report_of("stiff", 0.3);
  other["provenance"]["parameters"]["ranking"]["weights"]["reach"] = 2;
  other["provenance"]["parameters"]["friction"] = 0.1;
  const std::string text = compared({report_of("soft", 0.4), other});
  EXPECT_TRUE(has(text, "Scores are not comparable: ranking/weights differs.")) << text;
  EXPECT_TRUE(has(text, "Mind that friction differs.")) << text;

  Json with_catheters = report_of("stiff", 0.3);
  with_catheters["catheters"] = Json::object();
  const std::string of_scripts = "Scores are not comparable: of cases with catheters";
  EXPECT_TRUE(has(compared({report_of("soft", 0.4), with_catheters}), of_scripts));
  EXPECT_FALSE(has(compared({with_catheters, with_catheters}), of_scripts));
}

TEST_F(Compare, TellsOfAReportWithoutPlansAndRefusesWhatIsNone) {
  Json none = report_of("stiff", 0.3);
  none["ranking"] = Json::array();
  none["wires"][0]["best_trial"] = nullptr;
  none["wires"][0]["median_peak_contact_force_n"] = nullptr;
  EXPECT_TRUE(has(compared({report_of("soft", 0.4), none}), "none reaches"));
  none["trials"][1]["reached"] = true;
  EXPECT_TRUE(has(compared({report_of("soft", 0.4), none}), "none within limits"));
  write_text("{\"schema\": \"wireplan.case/1\"}", folder_ / "case.json");
  EXPECT_THROW(compare_reports({folder_ / "0.json", folder_ / "case.json"}), Error);
}

}  // namespace
}  // namespace wireplan::pipeline
