// What a run makes of the devices' values: friction, spread, confidence.
#include <gtest/gtest.h>

#include "pipeline/report/report.h"
#include "pipeline/report/sheet_csv.h"
#include "pipeline/stages/stages.h"
#include "tests/messages.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {
namespace {

/// A tube of 2.5 mm round half a turn of 20 mm, with straight ends.
Json write_bend_case(const TemporaryFolder& folder, const Json& wires) {
  write_stl(shapes::bend_tube(2.5, 20.0, kPi, 20.0, 30.0, 1.3), folder / "bend.stl");
  Json file = {{"schema", "wireplan.case/1"}, {"name", "bend"}, {"wires", wires}};
  file["surface"] = {
      {"path", "bend.stl"}, {"unit", "mm"}, {"frame", "LPS"}, {"edge_length_mm", 1.5}};
  const Eigen::Matrix3Xd axis = shapes::bend_axis(20.0, kPi, 20.0, 30.0, 1.3);
  file["access"] = {
      {"point_mm", to_json(Vec3(axis.col(4)))}, {"inclination_deg", {0}}, {"azimuth_deg", {0}}};
  file["target"] = {{"point_mm", to_json(Vec3(axis.col(axis.cols() - 6)))}};
  file["insertion"] = {{"step_mm", 1}, {"element_length_mm", 1}};
  file["robustness"] = {{"repeats", 12}};
  file["manoeuvres"] = "never";
  write_json(file, folder / "case.json");
  return file;
}

Json bend_wire(const std::string& name) {
  return {{"name", name},
          {"diameter_mm", 0.889},
          {"sections", Json::array({{{"length_mm", 30}, {"bending_stiffness_n_mm2", 20}},
                                    {{"length_mm", 200}, {"bending_stiffness_n_mm2", 120}}})}};
}

Json report_of_bend(const TemporaryFolder& folder, const std::vector<std::string>& changes = {}) {
  RunOptions options;
  options.cache = folder / "cache";
  const RunResult result = run_stages(read_case(folder / "case.json", changes), options);
  return read_json(result.artifacts.back().folder / "report.json", kReportSchema);
}

TEST(Report, WiresOfEqualStiffnessAreRankedByTheirCoating) {
  const TemporaryFolder folder;
  Json bare = bend_wire("bare"), ptfe = bend_wire("ptfe"), hydrophilic = bend_wire("hydrophilic");
  for (Json* wire : {&bare, &ptfe, &hydrophilic}) (*wire)["coating"] = wire->at("name");
  write_bend_case(folder, {bare, ptfe, hydrophilic});
  const Json report = report_of_bend(folder);
  const Json& ranking = report.at("ranking");
  ASSERT_EQ(ranking.size(), 3u) << report.at("excluded").dump();
  std::map<std::string, Json> trials;
  for (const Json& plan : ranking) {
    trials[plan.at("wire")] = report.at("trials").at(plan.at("trial").get<std::size_t>());
  }
  EXPECT_EQ(ranking[0].at("wire"), "hydrophilic");
  EXPECT_EQ(ranking[1].at("wire"), "ptfe");
  EXPECT_EQ(ranking[2].at("wire"), "bare");
  for (std::size_t k = 1; k < 3; ++k) {
    EXPECT_GT(ranking[k].at("score"), ranking[k - 1].at("score").get<double>() + 0.005);
  }
  // On a capstan of half a turn the hand pushes exp(mu pi) times as hard: 1.13, 1.46, 2.19.
  for (const auto& [key, more] : {std::pair("peak_push_force_n", 1.1),
                                  {"mean_contact_force_n", 1.06},
                                  {"friction_work_n_mm", 2.0}}) {
    SCOPED_TRACE(key);
    const double slippery = trials.at("hydrophilic").at(key), middle = trials.at("ptfe").at(key),
                 rough = trials.at("bare").at(key);
    EXPECT_GT(middle, more * slippery);
    EXPECT_GT(rough, more * middle);
  }

  // Friction alone: without it they are the same.
  const Json smooth = report_of_bend(folder, {"friction_factor=0"});
  ASSERT_EQ(smooth.at("trials").size(), 3u);
  for (const char* key : {"peak_push_force_n", "peak_contact_force_n", "insertion_mm"}) {
    EXPECT_EQ(smooth.at("trials")[0].at(key), smooth.at("trials")[1].at(key)) << key;
    EXPECT_EQ(smooth.at("trials")[0].at(key), smooth.at("trials")[2].at(key)) << key;
  }
  EXPECT_NE(smooth.dump().find("frictionless"), std::string::npos);
}

TEST(Report, TellsTheWeakestValueBehindEachPlanAndHowFarEachWireMayBeOff) {
  const TemporaryFolder folder;
  Json stated = bend_wire("stated");
  const auto value = [](const Json& number, const Json& spread, const char* confidence) {
    return Json{
        {"value", number}, {"spread", spread}, {"source", "bench"}, {"confidence", confidence}};
  };
  stated["diameter_mm"] = value(0.889, nullptr, "measured");
  stated["friction"] = value(0.1, {{"low", 0.05}, {"high", 0.4}}, "reported");
  Json& sections = stated["sections"];
  sections[0]["length_mm"] = value(30, nullptr, "measured");
  sections[0]["bending_stiffness_n_mm2"] = value(20, 2, "estimated");
  sections[1]["length_mm"] = value(100, nullptr, "measured");
  sections[1]["bending_stiffness_n_mm2"] = value(120, 12, "measured");
  sections.push_back({{"length_mm", value(100, nullptr, "assumed")},
                      {"bending_stiffness_n_mm2", value(300, nullptr, "assumed")}});
  write_bend_case(folder, {stated, bend_wire("plain")});
  const Json report = report_of_bend(folder);
  ASSERT_EQ(report.at("ranking").size(), 2u) << report.at("excluded").dump();
  for (const Json& plan : report.at("ranking")) {
    if (plan.at("wire") == "stated") {
      // What is assumed begins 130 mm from the tip and does not come in.
      EXPECT_EQ(plan.at("weakest_confidence"), "estimated");
      EXPECT_EQ(plan.at("weakest_values"), Json::array({"sections[0].bending_stiffness_n_mm2"}));
    } else {
      EXPECT_EQ(plan.at("weakest_confidence"), "not stated");
      EXPECT_EQ(plan.at("weakest_values").size(), 6u) << "with the friction of the case";
    }
  }
  EXPECT_EQ(report.at("wires")[0].at("values").size(), 8u);
  EXPECT_EQ(report.at("wires")[0].at("values")[1].at("source"), "bench");
  EXPECT_NE(sheet_csv(report).find(R"("weakest value of the wire","estimated")"),
            std::string::npos);
  EXPECT_NE(sheet_csv(report).find(R"("weakest value of the wire","not stated")"),
            std::string::npos);
  write_json(report, folder / "report.json");
  expect_follows_schemas(folder.path());

  // How far each may be off: the stated one by its own spread.
  const Json& unknowns = report.at("robustness").at("unknowns");
  EXPECT_EQ(unknowns.at("wires")[0].at("friction_factor"), Json({0.5, 4.0}));
  EXPECT_EQ(unknowns.at("wires")[1].at("friction_factor"), Json({0.5, 2.0}));
  EXPECT_EQ(unknowns.at("wires")[1].at("shaft_stiffness_factor"), Json({1.0, 1.0}));
  EXPECT_GT(unknowns.at("stiffness_factor")[1], 1.15) << "of a deviation of 10 %, 5 in 100 above";
  EXPECT_LT(unknowns.at("stiffness_factor")[1], 1.20);
  std::set<std::string> named;
  for (const Json& share : report.at("robustness").at("sensitivity").at("shares")) {
    named.insert(share.at("unknown").get<std::string>());
  }
  EXPECT_EQ(named.count("stiffness"), 1u) << report.at("robustness").at("sensitivity").dump();

  // As the case says of all, in the place of the wires' own.
  const Json known = report_of_bend(
      folder, {"robustness.friction_factor=[1, 1]", "robustness.stiffness_factor=[0.9, 1.2]"});
  const Json& wires = known.at("robustness").at("unknowns").at("wires");
  for (const Json& wire : wires) {
    EXPECT_EQ(wire.at("friction_factor"), Json({1.0, 1.0}));
    EXPECT_EQ(wire.at("shaft_stiffness_factor"), Json({0.9, 1.2}));
  }
}

TEST(Report, WeightsOfScriptsAloneAreRefusedWhereNoCatheterIsSuggested) {
  const TemporaryFolder folder;
  Json file = write_bend_case(folder, Json::array({bend_wire("bare")}));
  file["catheters"] = "suggest";  // for a way that takes no branch
  for (const char* part : {"reach", "peak_force", "mean_force", "margin"}) {
    file["ranking"]["weights"][part] = 0;
  }
  write_json(file, folder / "case.json");
  const std::string text = message_of([&] { report_of_bend(folder); });
  EXPECT_NE(text.find("case.json: ranking.weights are 0 in all"), std::string::npos) << text;
  file["ranking"]["weights"]["margin"] = 0.1;
  write_json(file, folder / "case.json");
  EXPECT_EQ(report_of_bend(folder).at("ranking").size(), 1u);
}

}  // namespace
}  // namespace wireplan::pipeline
