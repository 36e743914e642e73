// `wireplan batch`: one patient that fails stops no other, what is finished is kept, memory is
// held.
#include <gtest/gtest.h>

#include "pipeline/commands/batch_run.h"
#include "tests/pipeline/program.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// A folder with a study: two sound patients, one whose case file is cut short, one whose surface is
// none; and a scene, which is no patient.
class Batch : public testing::Test {
 protected:
  void SetUp() override {
    const fs::path study = folder_ / "study";
    for (const char* name : {"anna", "bert", "carl", "dora"}) {
      fs::create_directories(study / name);
      write_tube_case(study / name);
    }
    write_text(R"({"schema": "wireplan.case/1", "name": )", study / "carl" / "case.json");
    write_text("not a surface", study / "dora" / "tube.stl");
    write_json({{"schema", "wireplan.scene/1"}}, study / "scene.json");
  }
  Answer batch(const std::string& arguments) const {
    return run_program(folder_.path(), "batch " + arguments + " -o out -j 2");
  }
  Json summary() const { return read_json(folder_ / "out" / "batch.json", kBatchSchema); }

  TemporaryFolder folder_;
};

TEST_F(Batch, TellsWhoFailedAndWhyAndPlansTheOthers) {
  const Answer first = batch("study");
  EXPECT_EQ(first.code, 2) << first.log << first.out;  // the worst: bad input
  const Json batch_file = summary();
  EXPECT_EQ(batch_file.at("counts").dump(),
            R"({"planned":2,"no_plan":0,"failed":2,"interrupted":0,"not_run":0})");
  const Json& patients = batch_file.at("patients");
  ASSERT_EQ(patients.size(), 4u);
  for (const std::size_t k : {0u, 1u}) {
    EXPECT_EQ(patients[k].at("outcome"), "planned");
    EXPECT_EQ(patients[k].at("best_plan").at("wire"), "soft");
    EXPECT_EQ(patients[k].at("verdict"), "unsure") << "of 4 repeats";
    const fs::path report = folder_ / "out" / patients[k].at("report").get<std::string>();
    EXPECT_EQ(read_json(report, "wireplan.report/2").at("ranking").size(), 2u);
  }
  EXPECT_EQ(patients[2].at("name"), "carl");
  EXPECT_NE(patients[2].at("reason").get<std::string>().find("broken JSON at line 1"),
            std::string::npos);
  EXPECT_NE(patients[3].at("reason").get<std::string>().find("tube.stl"), std::string::npos);
  EXPECT_EQ(patients[3].at("exit_code"), 2);
  EXPECT_TRUE(patients[3].at("report").is_null());
  expect_follows_schemas(folder_ / "out");

  // A line per patient, as they end; then how many of each.
  EXPECT_EQ(std::count(first.out.begin(), first.out.end(), '\n'), 5) << first.out;
  EXPECT_NE(first.out.find("anna: unsure; best of 2 safe plans"), std::string::npos) << first.out;
  EXPECT_NE(first.out.find("carl: failed: "), std::string::npos) << first.out;
  EXPECT_NE(first.out.find("2 planned, 2 failed; batch: out/batch.json"), std::string::npos);

  // Again, with the third mended: the others take nothing but their look-up.
  fs::copy_file(folder_ / "study/anna/case.json", folder_ / "study/carl/case.json",
                fs::copy_options::overwrite_existing);
  const std::string report = read_text(folder_ / "out/anna/report.json");
  EXPECT_EQ(batch("study").code, 2);
  EXPECT_EQ(summary().at("counts").at("planned"), 3);
  EXPECT_EQ(read_text(folder_ / "out/anna/report.json"), report);
  EXPECT_EQ(read_text(folder_ / "out/anna.log").find("made"), std::string::npos);
  // The third is the same tube: all but what tells the input's name comes from the cache.
  EXPECT_EQ(report_without_timing(folder_ / "out/carl/report.json"),
            report_without_timing(folder_ / "out/anna/report.json"));
}

TEST_F(Batch, ListsItsCasesAndRunsNone) {
  const Answer answer = run_program(folder_.path(), "batch --list study nowhere.json");
  EXPECT_EQ(answer.code, 2) << "there is no such file";
  const Answer list = run_program(folder_.path(), "batch --list study");
  EXPECT_EQ(list.code, 0) << list.log;
  EXPECT_EQ(list.out, "anna\tstudy/anna\nbert\tstudy/bert\ncarl\tstudy/carl\ndora\tstudy/dora\n");
  EXPECT_FALSE(fs::exists(folder_ / "cache"));
  const Answer nowhere = run_program(folder_.path(), "batch study");
  EXPECT_EQ(nowhere.code, 2);
  EXPECT_NE(nowhere.log.find("expected --output DIR"), std::string::npos) << nowhere.log;
}

TEST_F(Batch, FailFastStartsNoOtherAfterTheFirstThatFails) {
  const Answer answer =
      run_program(folder_.path(), "batch study/carl study/anna study/bert -o out -j 1 --fail-fast");
  EXPECT_EQ(answer.code, 2);
  const Json counts = summary().at("counts");
  EXPECT_EQ(counts.at("failed"), 1);
  EXPECT_GE(counts.at("not_run").get<int>() + counts.at("planned").get<int>() +
                counts.at("interrupted").get<int>(),
            2);
}

TEST_F(Batch, APatientThatNeedsMoreThanTheLimitFailsAloneWithTheRemedy) {
  // A run of the tube takes more than 0.02 GB, whatever it does.
  const Json result = run_batch_cases(
      list_batch_cases({(folder_ / "study/anna").string()}),
      {.output = folder_ / "out", .cache = folder_ / "cache", .threads = 1, .memory_gb = 0.02});
  EXPECT_EQ(result.at("patients")[0].at("outcome"), "failed");
  EXPECT_EQ(
      result.at("patients")[0].at("reason"),
      "it needs more than the 0.02 GB that --memory-gb allows; allow more, or crop the volume");
  EXPECT_EQ(exit_code_of(result), 2);
}

TEST_F(Batch, IsStoppedWithWhatWasFinishedKept) {
  const Json result = run_batch_cases(
      list_batch_cases({(folder_ / "study").string()}),
      {.output = folder_ / "out", .cache = folder_ / "cache", .threads = 1, .cancelled = [] {
         return true;
       }});
  EXPECT_EQ(result.at("counts").at("not_run"), 4);
  EXPECT_EQ(exit_code_of(result), 130);
}

TEST_F(Batch, ListsCasesAndRefusesWhatItCannotTellApart) {
  const auto names = [](const std::vector<std::string>& arguments) {
    std::string list;
    for (const BatchCase& entry : list_batch_cases(arguments)) list += entry.name + " ";
    return list;
  };
  const std::string study = (folder_ / "study").string();
  EXPECT_EQ(names({study}), "anna bert carl dora ");
  EXPECT_EQ(names({study + "/anna/", study + "/bert/case.json"}), "anna bert ");
  fs::copy_file(folder_ / "study/anna/case.json", folder_ / "study/eve.json");
  EXPECT_EQ(names({study}), "anna bert carl dora eve ");
  fs::create_directories(folder_ / "empty");
  const auto refusal = [&](const std::vector<std::string>& arguments) -> std::string {
    try {
      list_batch_cases(arguments);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal({(folder_ / "empty").string()}),
            (folder_ / "empty").string() +
                ": holds no case, expected case files or folders that have a case.json");
  EXPECT_EQ(refusal({study + "/anna", study + "/anna/case.json"}),
            "batch: " + study + "/anna and " + study +
                "/anna/case.json are both named \"anna\", expected a name of its own for each; "
                "rename a folder or file");
}

}  // namespace
}  // namespace wireplan::pipeline
