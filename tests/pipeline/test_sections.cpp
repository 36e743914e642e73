// Several accesses and targets in one case: what is made once, what is pushed once, and what the
// overview says.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/report/compare.h"
#include "pipeline/report/overview.h"
#include "pipeline/report/page.h"
#include "pipeline/report/report.h"
#include "pipeline/stages/sections.h"
#include "tests/messages.h"
#include "tests/pipeline/program.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

/// The tube case from either of its ends to two cross-sections, with enough candidates to be
/// scouted.
class Sections : public testing::Test {
 protected:
  void SetUp() override {
    file_ = write_tube_case(folder_.path());
    file_.erase("access");
    file_.erase("target");
    file_["accesses"] = Json::array({access("from below", 6.0), access("from above", 30.0)});
    file_["targets"] = Json::array({{{"name", "near"}, {"point_mm", {0.0, 0.0, 16.0}}},
                                    {{"name", "far"}, {"point_mm", {0.0, 0.0, 20.0}}}});
    file_["robustness"] = {{"repeats", 2}};
    write_json(file_, folder_ / "case.json");
  }
  static Json access(const std::string& name, double z) {
    return {{"name", name},
            {"point_mm", {0.0, 0.0, z}},
            {"inclination_deg", {0, 10, 20}},
            {"azimuth_deg", {0, 60, 120, 180}}};
  }

  struct Made {
    std::vector<std::string> told;                   // stages that were run, in order
    std::map<std::string, fs::path> trials, report;  // folders of artifacts, by section
  };
  /// All sections, or those of one target alone.
  Made make(bool dry = false, const std::string& only = "") {
    Made made;
    RunOptions options;
    options.cache = folder_ / "cache";
    options.dry_run = dry;
    options.on_stage = [&](const StageOutcome& outcome) {
      if (outcome.state != StageState::kCached) made.told.push_back(outcome.stage);
    };
    for_each_section(read_case(folder_ / "case.json"), options,
                     [&](const Case& section, const RunOptions& own) {
                       if (!only.empty() && section.targets[section.target].name != only) return;
                       for (const Artifact& artifact : run_stages(section, own).artifacts) {
                         const std::string name = section_name(section);
                         if (artifact.stage == "trials") made.trials[name] = artifact.folder;
                         if (artifact.stage == "report") made.report[name] = artifact.folder;
                       }
                     });
    return made;
  }
  static std::ptrdiff_t times(const std::vector<std::string>& told, const std::string& stage) {
    return std::count(told.begin(), told.end(), stage);
  }
  static int scouts_run(const fs::path& trials) {
    const Json timing = read_json(trials / kTimingFile, "wireplan.timing/1");
    return timing.at("levels").front().at("trials_run");
  }

  TemporaryFolder folder_;
  Json file_;
};

TEST_F(Sections, MakeTheVesselOnceAndPushOnceWhatServesBothTargets) {
  const Made made = make();
  EXPECT_EQ(times(made.told, "surface"), 1);
  EXPECT_EQ(times(made.told, "wall"), 1);
  EXPECT_EQ(times(made.told, "centerline"), 4);
  EXPECT_EQ(times(made.told, "trials"), 4);
  EXPECT_EQ(times(made.told, "report"), 4);
  ASSERT_EQ(made.trials.size(), 4u);
  for (const char* access : {"from below", "from above"}) {
    const std::string from = access;
    EXPECT_EQ(scouts_run(made.trials.at(from + " to near")), 9) << "0 deg once, 2 x 4 others";
    EXPECT_EQ(scouts_run(made.trials.at(from + " to far")), 0);
  }
  EXPECT_TRUE(make().told.empty()) << "all of it is kept";

  // Another place of one target: what serves the access has changed, and no more.
  file_["targets"][1]["point_mm"][2] = 21.0;
  write_json(file_, folder_ / "case.json");
  const Made moved = make(/*dry=*/true);
  EXPECT_EQ(times(moved.told, "surface"), 0);
  EXPECT_EQ(times(moved.told, "centerline"), 2);
}

TEST_F(Sections, GiveTheScoutsThatEachWouldRunAlone) {
  const Made together = make();
  fs::rename(folder_ / "cache", folder_ / "cache-before");
  const Made apart = make(/*dry=*/false, "far");
  const std::string far = "from below to far";
  EXPECT_EQ(scouts_run(apart.trials.at(far)), 9);
  const fs::path inside = fs::relative(together.trials.at(far), folder_ / "cache");
  int compared = 0;
  for (const auto& entry : fs::directory_iterator(apart.trials.at(far) / "scout" / "trials")) {
    const fs::path other =
        folder_ / "cache-before" / inside / "scout" / "trials" / entry.path().filename();
    EXPECT_EQ(read_text(entry.path()), read_text(other)) << entry.path();
    ++compared;
  }
  EXPECT_EQ(compared, 9);
}

TEST_F(Sections, ARunGivesOneOverviewWithAllAccessesOfEachTarget) {
  const fs::path out = folder_ / "out";
  const Answer result = run_program(folder_.path(), "run case.json -o out");
  ASSERT_EQ(result.code, 0) << result.log;
  const std::optional<Json> overview = find_overview(out / "report.json");
  ASSERT_TRUE(overview);
  ASSERT_EQ(overview->at("targets").size(), 2u);
  EXPECT_EQ(overview->at("targets")[0].at("target"), "near");
  EXPECT_NE(result.out.find(describe_overview(*overview)), std::string::npos) << result.out;
  std::vector<fs::path> files;
  for (const Json& target : overview->at("targets")) {
    ASSERT_EQ(target.at("sections").size(), 2u);
    for (const Json& row : target.at("sections")) {
      const fs::path file = out / row.at("folder").get<std::string>() / "report.json";
      const Json report = read_report(file);
      const Json& section = report.at("provenance").at("parameters").at("section");
      EXPECT_EQ(section.at("target"), target.at("target"));
      EXPECT_EQ(section.at("access"), row.at("access"));
      EXPECT_EQ(row.at("safe_plans"), report.at("ranking").size());
      EXPECT_EQ(row.at("best_plan").at("trial"), report.at("ranking")[0].at("trial"));
      files.push_back(file);
    }
  }
  EXPECT_TRUE(serves_all_targets(*overview));
  const std::string csv = read_text(out / "sections.csv");
  EXPECT_EQ(csv, overview_csv(*overview));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 5) << "heads and four sections";
  EXPECT_NE(csv.find("\n\"far\",\"from above\",\"from-above--far\","), std::string::npos) << csv;
  EXPECT_EQ(compare_reports({out / "report.json"}), compare_reports(files));

  // A better access is told in all that its own section has, too.
  const std::string better = "From <above> it is feasible.";
  Json told = *overview;
  Json& row = told["targets"][0]["sections"][1];
  row["other_access"] = better;
  row["verdict"]["changes"] = Json::array({better});
  const std::string other = read_text(files[0]);
  tell_sections(told, out);
  const fs::path folder = files[1].parent_path();
  EXPECT_EQ(read_report(files[1]).at("verdict").at("changes"), Json::array({better}));
  EXPECT_NE(read_text(folder / "sheet.csv").find(better), std::string::npos);
  if (page_missing().empty()) {
    EXPECT_NE(read_text(folder / "report.html").find("From \\u003cabove\\u003e it is feasible."),
              std::string::npos);
  }
  EXPECT_EQ(read_text(files[0]), other);
  expect_follows_schemas(out);
}

TEST_F(Sections, TellWhatIsWrongWithAllOfThemBeforeAnyIsPushed) {
  file_["targets"][1]["point_mm"] = {20.0, 0.0, 20.0};
  file_["accesses"][1]["point_mm"] = {0.0, 30.0, 20.0};
  write_json(file_, folder_ / "case.json");
  try {
    make();
    FAIL() << "points outside the vessel";
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("targets[1].point_mm"), std::string::npos) << text;
    EXPECT_NE(text.find("accesses[1].point_mm"), std::string::npos) << text;
  }
}

TEST_F(Sections, OfOneTellBothItsEndsOutsideTheVesselAtOnce) {
  file_["targets"] = Json::array({file_["targets"][0]});
  file_["accesses"] = Json::array({file_["accesses"][0]});
  file_["targets"][0]["point_mm"] = {20.0, 0.0, 20.0};
  file_["accesses"][0]["point_mm"] = {0.0, 30.0, 20.0};
  write_json(file_, folder_ / "case.json");
  const Answer answer = run_program(folder_.path(), "run case.json -o out");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(holds(answer.log, "accesses[0].point_mm is [0.0,30.0,20.0], ")) << answer.log;
  EXPECT_TRUE(holds(answer.log, "targets[0].point_mm is [20.0,0.0,20.0], ")) << answer.log;
}

TEST_F(Sections, KeepTheNameOfTheOnlyTarget) {
  file_["targets"].erase(1);
  file_["accesses"][0]["inclination_deg"] = file_["accesses"][1]["inclination_deg"] = {0};
  write_json(file_, folder_ / "case.json");
  const Answer result = run_program(folder_.path(), "run case.json -o out");
  ASSERT_EQ(result.code, 0) << result.log;
  EXPECT_EQ(result.out.find("near: from "), 0u) << result.out;
  const fs::path out = folder_ / "out";
  const std::optional<Json> overview = find_overview(out / "report.json");
  ASSERT_TRUE(overview);
  EXPECT_EQ(overview->at("targets")[0].at("target"), "near");
  const Json report = read_report(out / "from-below" / "report.json");
  EXPECT_EQ(report.at("provenance").at("parameters").at("section"),
            (Json{{"access", "from below"}, {"target", "near"}}));
  EXPECT_NE(compare_reports({out / "report.json"}).find("tube, from below, near"),
            std::string::npos);
  expect_follows_schemas(out);

  // A case of one section has the two names, and its files where they were.
  file_.erase("accesses");
  file_["access"] = access("groin", 6.0);
  file_["access"]["inclination_deg"] = {0};
  write_json(file_, folder_ / "case.json");
  ASSERT_EQ(run_program(folder_.path(), "run case.json -o one").code, 0);
  const Json one = read_report(folder_ / "one" / "report.json");
  EXPECT_EQ(one.at("provenance").at("parameters").at("section"),
            (Json{{"access", "groin"}, {"target", "near"}}));
  expect_follows_schemas(folder_ / "one");
}

TEST_F(Sections, ATargetAtAnAccessIsRefused) {
  // In a lumen of 4 mm radius, 3 mm on and 2 mm off its axis.
  file_["targets"][0]["point_mm"] = {2.0, 0.0, 9.0};
  write_json(file_, folder_ / "case.json");
  for (const char* command : {"check case.json", "run case.json -o out"}) {
    const Answer answer = run_program(folder_.path(), command);
    EXPECT_EQ(answer.code, 2) << command;
    EXPECT_NE(answer.log.find("targets[0].point_mm is "), std::string::npos) << answer.log;
    EXPECT_NE(answer.log.find("accesses[0].point_mm"), std::string::npos) << answer.log;
    EXPECT_NE(answer.log.find("a wire would be there before it is pushed"), std::string::npos)
        << answer.log;
    EXPECT_EQ(answer.log.find("accesses[1].point_mm"), std::string::npos) << answer.log;
  }
  file_["targets"][0]["point_mm"] = {2.0, 0.0, 11.0};  // 5 mm on
  write_json(file_, folder_ / "case.json");
  EXPECT_EQ(run_program(folder_.path(), "check case.json").code, 0);
  EXPECT_EQ(run_program(folder_.path(), "run case.json -o out --to anatomy").code, 0);
}

TEST(Overview, PutsTheBetterAnswerAndThenMoreSafeRepeatsFirst) {
  const auto report = [](int safe, double score, bool plan = true, const char* answer = "feasible",
                         bool sensitive = false, bool tip_unsure = false) {
    Json trial = {{"reached", true}, {"safe", plan}};
    for (const char* key : {"insertion_mm", "peak_tip_force_n", "peak_contact_force_n"}) {
      trial[key] = 0.1;
    }
    Json best = {{"trial", 0}, {"wire", "soft"}, {"script", ""}, {"score", score}};
    for (const char* key :
         {"inclination_deg", "azimuth_deg", "roll_deg", "score_error", "mean_score", "sentence"}) {
      best[key] = 0.0;
    }
    Json json = {{"statement", "Research use only."}, {"trials", Json::array({trial})}};
    best["sensitive"] = sensitive;
    best["tip_unsure"] = tip_unsure;
    json["verdict"] = {{"answer", answer}, {"changes", Json::array()}};
    json["ranking"] = plan ? Json::array({best}) : Json::array();
    json["robustness"]["plans"] =
        Json::array({{{"trial", 0}, {"successes", safe}, {"repeats", 16}}});
    json["provenance"] = {{"inputs", Json::array()}, {"program", {}}};
    json["anatomy"] = {
        {"lengths", {{"way_mm", 100.0}}},
        {"access",
         {{"device", {{"lumen_diameter_mm", 5.0}, {"fits", true}}},
          {"sheath", {{"lumen_diameter_mm", 5.0}, {"fits", true}}},
          {"tortuosity", {{"index", 1.1}, {"grade", "below mild"}}},
          {"sharpest_bend",
           {{"angle_deg", 170.0}, {"grade", "below mild"}, {"at_ostium_of", nullptr}}},
          {"calcium", {{"volume_mm3", nullptr}}}}}};
    return json;
  };
  const auto order = [&](const std::vector<SectionReport>& sections) {
    std::string names;
    const Json overview = build_overview("case", sections);
    for (const Json& row : overview.at("targets")[0].at("sections")) {
      names += row.at("access").get<std::string>();
    }
    return names;
  };
  EXPECT_EQ(order({{"a", "t", "a", report(15, 0.1)}, {"b", "t", "b", report(16, 0.4)}}), "ba");
  EXPECT_EQ(order({{"a", "t", "a", report(16, 0.3)}, {"b", "t", "b", report(16, 0.2)}}), "ba");
  EXPECT_EQ(order({{"a", "t", "a", report(16, 0.1, false)}, {"b", "t", "b", report(2, 0.9)}}),
            "ba");
  // The answer counts before the share, and so does an end that hangs on how it is computed.
  EXPECT_EQ(order({{"a", "t", "a", report(16, 0.1, true, "unsure")},
                   {"b", "t", "b", report(12, 0.4, true, "feasible_with_risk")}}),
            "ba");
  EXPECT_EQ(order({{"a", "t", "a", report(16, 0.1, true, "unsure", true)},
                   {"b", "t", "b", report(12, 0.4, true, "unsure")}}),
            "ba");
  EXPECT_EQ(order({{"a", "t", "a", report(16, 0.1, true, "unsure", false, true)},
                   {"b", "t", "b", report(12, 0.4, true, "unsure")}}),
            "ba");
  const Json both = build_overview(
      "case", {{"left", "t", "left", report(0, 0.1, false, "not_feasible")},
               {"right", "t", "right", report(12, 0.1, true, "feasible_with_risk")}});
  const Json& rows = both.at("targets")[0].at("sections");
  const char* told = "From right it is feasible with risk: safe in 12 of 16 disturbed repeats.";
  EXPECT_TRUE(rows[0].at("other_access").is_null());
  EXPECT_EQ(rows[1].at("other_access"), told);
  EXPECT_EQ(rows[1].at("verdict").at("changes"), Json::array({told}));
  EXPECT_NE(overview_csv(both).find(told), std::string::npos);
  const Json none = build_overview(
      "case", {{"a", "t", "a", report(0, 0.1, false)}, {"b", "t", "b", report(0, 0.1, false)}});
  EXPECT_FALSE(serves_all_targets(none));
  EXPECT_EQ(describe_overview(none), "t: no safe plan from any access");

  const Json device =
      build_overview("case", {{"", "t", "a", report(16, 0.1, true, "not_feasible")}});
  EXPECT_FALSE(serves_all_targets(device)) << "the wire reaches, a device does not pass";
  EXPECT_EQ(describe_overview(device).find("t: not feasible; the wire alone would reach it: soft,"),
            0u)
      << describe_overview(device);

  SectionReport tools = {"", "", "a", report(12, 0.1)};
  tools.report["ranking"][0]["catheter"] = "cobra-c2";
  tools.report["anatomy"]["access"]["sheath"]["assumed_longer_than_way"] = true;
  const Json one = build_overview("case", {tools});
  EXPECT_EQ(describe_overview(one).find("the target: soft in cobra-c2, inclination 0 deg"), 0u)
      << describe_overview(one);
  EXPECT_NE(overview_csv(one).find("wire,catheter,inclination_deg"), std::string::npos);
  EXPECT_EQ(overview_csv(both).find("catheter"), std::string::npos);
  tools.report["ranking"][0]["first_wire"] = "bentson";
  EXPECT_NE(overview_csv(build_overview("case", {tools}))
                .find("wire,catheter,first_wire,inclination_deg"),
            std::string::npos);
  EXPECT_TRUE(one.at("targets")[0].at("sections")[0].at("access_table").at("sheath_fits").is_null())
      << "not weighed";
}

}  // namespace
}  // namespace wireplan::pipeline
