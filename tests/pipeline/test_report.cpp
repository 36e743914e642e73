// report.json: the schema it keeps to, the same bytes at any thread count, nothing of this machine.
#include <gtest/gtest.h>

#include <cstdlib>

#include "pipeline/case_file.h"
#include "pipeline/report.h"
#include "pipeline/stages.h"
#include "pipeline/trial_file.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

const fs::path kSchemas = fs::path(WIREPLAN_SOURCE_DIR) / "pipeline" / "schemas";

Json run_to_report(const fs::path& case_file, const fs::path& cache, int threads = 0,
                   const std::vector<std::string>& changes = {}) {
  RunOptions options;
  options.cache = cache;
  options.work.threads = threads;
  const RunResult result = run_stages(read_case(case_file, changes), options);
  return read_json(result.artifacts.back().folder / "report.json", kReportSchema);
}

// With the JSON Schema library of Python: -1 where there is none.
int validate(const fs::path& document, const fs::path& schema) {
  const std::string python = "/usr/bin/python3";
  const std::string probe =
      python + " -c 'from jsonschema import Draft202012Validator' 2> /dev/null";
  if (std::system(probe.c_str()) != 0) return -1;
  const std::string program =
      "import json, sys, jsonschema\n"
      "schema, document = (json.load(open(p)) for p in sys.argv[1:])\n"
      "jsonschema.Draft202012Validator.check_schema(schema)\n"
      "errors = list(jsonschema.Draft202012Validator(schema).iter_errors(document))\n"
      "for e in errors[:5]: print(list(e.absolute_path), e.message)\n"
      "sys.exit(1 if errors else 0)\n";
  const fs::path script = document.parent_path() / "validate.py";
  write_text(program, script);
  return std::system(
      (python + " '" + script.string() + "' '" + schema.string() + "' '" + document.string() + "'")
          .c_str());
}

void expect_valid(const Json& report, const fs::path& folder) {
  write_json(report, folder / "report.json");
  const int failures = validate(folder / "report.json", kSchemas / "report.schema.json");
  if (failures < 0) GTEST_SKIP() << "python3 has no jsonschema (package python3-jsonschema)";
  EXPECT_EQ(failures, 0);
}

TEST(Report, KeepsToItsSchemaWithPlans) {
  const TemporaryFolder folder;
  write_tube_case(folder.path());
  const Json report = run_to_report(folder / "case.json", folder / "cache");
  ASSERT_FALSE(report.at("ranking").empty());
  EXPECT_EQ(report.at("trials").size(), 2u);
  expect_valid(report, folder.path());
}

TEST(Report, KeepsToItsSchemaWithoutPlans) {
  // 12 mm of wire do not come to a target 22 mm away.
  const TemporaryFolder folder;
  write_tube_case(folder.path());
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0, {"insertion.length_mm=12"});
  EXPECT_TRUE(report.at("ranking").empty());
  EXPECT_EQ(report.at("excluded").size(), 2u);
  EXPECT_EQ(report.at("outcome"), "no plan reaches the target");
  EXPECT_NE(describe_best(report).find("no plan reaches the target"), std::string::npos);
  expect_valid(report, folder.path());
}

TEST(Report, IsTheSameOutsideTimingAtAnyThreadCount) {
  const TemporaryFolder folder;
  write_tube_case(folder.path());
  std::string first;
  for (const int threads : {1, 2, 8}) {
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
  Json file = write_tube_case(folder.path());
  file["surface"]["path"] = (folder / "tube.stl").string();  // absolute
  write_json(file, folder / "case.json");
  const Json report = run_to_report(folder / "case.json", folder / "cache");
  EXPECT_EQ(report.dump().find(folder.path().string()), std::string::npos);
  EXPECT_EQ(report.at("provenance").at("inputs")[0].at("name"), "tube.stl");
}

TEST(Report, PrintsTheValuesThatStagesChose) {
  const TemporaryFolder folder;
  write_tube_case(folder.path());
  const Json report =
      run_to_report(folder / "case.json", folder / "cache", 0, {"insertion.length_mm=0"});
  const Json& parameters = report.at("provenance").at("parameters");
  // 1.25 times the path and 20 mm more, rounded up.
  const double path = report.at("vessel").at("branches")[0].at("length_mm");
  EXPECT_EQ(parameters.at("insertion").at("length_mm"), std::ceil(1.25 * path + 20.0));
  EXPECT_GT(parameters.at("wall").at("young_modulus_kpa"), 0.0);
}

TEST(TrialFile, KeepsEveryBitAndMakesNullOfWhatIsNoNumber) {
  const TemporaryFolder folder;
  plan::Study study;
  study.wires = {{.name = "soft", .radius = 0.4, .sections = {{.length = 100.0}}}};
  simulate::TrialResult trial;
  trial.outcome = simulate::Outcome::kNotConverged;
  trial.reason = "push 2 has no equilibrium";
  trial.terms = {"stretch", "bend"};
  trial.pushes.resize(2);
  trial.pushes[0].push_force = 0.1;  // no finite sum of powers of 2
  trial.pushes[0].tip = Vec3(1.0 / 3.0, 1e-300, -2e17);
  trial.pushes[1].residual = std::nan("");
  trial.pushes[1].iterations = 200;
  trial.nodes = Eigen::Matrix3Xd::Random(3, 5);
  trial.contacts = {
      {.node = 3, .point = Vec3(1, 2, 3), .force = Vec3(0.1, 0.2, 0.3), .penetration = 0.7}};
  fs::create_directories(folder / "trials");
  const fs::path file = folder / trial_file_name(12);
  EXPECT_EQ(file.filename(), "0012.json");
  write_trial(12, study, {}, trial, file);

  const std::optional<simulate::TrialResult> read = find_trial(file);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->outcome, trial.outcome);
  EXPECT_EQ(read->reason, trial.reason);
  EXPECT_EQ(read->terms, trial.terms);
  ASSERT_EQ(read->pushes.size(), 2u);
  EXPECT_EQ(read->pushes[0].push_force, 0.1);
  EXPECT_EQ(read->pushes[0].tip, trial.pushes[0].tip);
  EXPECT_TRUE(std::isnan(read->pushes[1].residual));
  EXPECT_EQ(read->pushes[1].iterations, 200);
  EXPECT_EQ(read->nodes, trial.nodes);
  ASSERT_EQ(read->contacts.size(), 1u);
  EXPECT_EQ(read->contacts[0].force, trial.contacts[0].force);

  write_text(read_text(file).substr(0, 200), file);
  EXPECT_FALSE(find_trial(file));
  EXPECT_FALSE(find_trial(folder / "absent.json"));
}

}  // namespace
}  // namespace wireplan::pipeline
