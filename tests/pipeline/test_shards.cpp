// `wireplan trials` and `wireplan report`: parts of a case's trials by processes that meet in the
// store alone give what one run gives.
#include <fcntl.h>
#include <gtest/gtest.h>

#include "pipeline/files/case_file.h"
#include "pipeline/stages/shards.h"
#include "tests/pipeline/program.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// The tube with ten candidates, so that they are scouted.
class Shards : public testing::Test {
 protected:
  void SetUp() override {
    Json file = write_tube_case(folder_.path());
    file["access"]["inclination_deg"] = {0, 8, 16, 24};
    file["access"]["azimuth_deg"] = {0, 120, 240};
    file["robustness"]["repeats"] = 2;
    write_json(file, folder_ / "case.json");
  }
  Answer call(const std::string& arguments) const { return run_program(folder_.path(), arguments); }
  std::string trials(const std::string& arguments) const {
    const Answer answer = call("trials case.json " + arguments);
    EXPECT_EQ(answer.code, 0) << answer.log;
    return answer.out;
  }
  // The report and every file of the trials, of a run and a cache of their own.
  std::map<std::string, std::string> results(const fs::path& out) const {
    std::map<std::string, std::string> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(out)) {
      const std::string name = entry.path().lexically_relative(out).string();
      if (!entry.is_regular_file() || name == "report.html") continue;
      files[name] =
          name == "report.json" ? report_without_timing(entry.path()) : read_text(entry.path());
    }
    return files;
  }
  std::map<std::string, std::string> results_of_one_run() const {
    const Answer answer = call("run case.json -o one --cache other");
    EXPECT_EQ(answer.code, 0) << answer.log;
    return results(folder_ / "one");
  }
  // How many trials of each level the process that made `trials` ran itself.
  std::vector<int> run_at_the_end() const {
    std::vector<int> counts;
    const Json report = read_json(folder_ / "out" / "report.json", "wireplan.report/2");
    for (const Json& level : report.at("timing").at("trials").at("levels")) {
      counts.push_back(level.at("trials_run"));
    }
    return counts;
  }

  TemporaryFolder folder_;
};

TEST(Share, IsReadAsKOfNAndElseRefused) {
  const Share share = parse_share("3/8", 2);
  EXPECT_EQ(share.shard, 3);
  EXPECT_EQ(share.shards, 8);
  EXPECT_EQ(share.round, 2);
  for (const char* text : {"0/2", "3/2", "-1/2", "a/b", "1", "1/", "/2", "1/2/3", "1.5/2", " 1/2",
                           "1/100001", "1/99999999999", ""}) {
    try {
      parse_share(text, 1);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.what(), "--shard is \"" + std::string(text) +
                                  "\", expected K/N with whole numbers 1 <= K <= N <= 100000: 3/8 "
                                  "is the third of eight parts");
    }
  }
}

TEST_F(Shards, ABadOneExitsWithTwoAndRunsNothing) {
  for (const char* arguments : {"--shard 3/2", "--shard 1/2 --round 0", ""}) {
    const Answer answer = call(std::string("trials case.json ") + arguments);
    EXPECT_EQ(answer.code, 2) << arguments;
    EXPECT_NE(answer.log.find("--"), std::string::npos) << answer.log;
    EXPECT_FALSE(fs::exists(folder_ / "cache")) << arguments;
  }
}

TEST_F(Shards, InAnyOrderGiveTheBytesOfOneRun) {
  const auto expected = results_of_one_run();
  EXPECT_GT(expected.size(), 20u);
  EXPECT_EQ(trials("--shard 3/3"), "round 1 (scout), shard 3/3: 3 of 10 trials, 3 run now\n");
  EXPECT_EQ(trials("--shard 1/3"), "round 1 (scout), shard 1/3: 4 of 10 trials, 4 run now\n");
  EXPECT_EQ(trials("--shard 2/3"), "round 1 (scout), shard 2/3: 3 of 10 trials, 3 run now\n");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  const Answer report = call("report case.json -o out");
  EXPECT_EQ(report.code, 0) << report.log;
  EXPECT_EQ(report.log.find("no shard"), std::string::npos) << report.log;
  EXPECT_EQ(run_at_the_end().at(0), 0);
  EXPECT_GT(run_at_the_end().back(), 0);  // those in full
  EXPECT_EQ(results(folder_ / "out"), expected);
  EXPECT_EQ(trials("--shard 1/3"), "the trials of this case are all in the store, nothing to do\n");
}

TEST_F(Shards, DoneTwiceComputeNothing) {
  trials("--shard 2/3");
  std::map<fs::path, fs::file_time_type> written;
  const auto look = [&] {
    std::map<fs::path, fs::file_time_type> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / "cache/wireplan/pieces")) {
      if (entry.is_regular_file()) files[entry.path()] = entry.last_write_time();
    }
    return files;
  };
  const auto before = look();
  EXPECT_EQ(before.size(), 4u);  // three trials and the field of the vessel
  EXPECT_EQ(trials("--shard 2/3"), "round 1 (scout), shard 2/3: 3 of 10 trials, 0 run now\n");
  EXPECT_EQ(look(), before);
  // Other parts, of which one is there.
  EXPECT_EQ(trials("--shard 2/5"), "round 1 (scout), shard 2/5: 2 of 10 trials, 1 run now\n");
  EXPECT_EQ(look().size(), 5u);
}

TEST_F(Shards, ThatAreMissingAreRunByTheReportWhichSaysSo) {
  const auto expected = results_of_one_run();
  trials("--shard 1/3");
  const Answer report = call("report case.json -o out");
  EXPECT_EQ(report.code, 0);
  EXPECT_NE(report.log.find(
                "6 of the 10 trials of round 1 were in the store from no shard and were run here"),
            std::string::npos)
      << report.log;
  EXPECT_EQ(results(folder_ / "out"), expected);
}

TEST_F(Shards, OfALaterRoundFollowFromAllOfTheRoundBefore) {
  const auto expected = results_of_one_run();
  trials("--shard 1/2");
  const Answer early = call("trials case.json --shard 1/2 --round 2");
  EXPECT_EQ(early.code, 2);
  EXPECT_NE(early.log.find("round 2 follows from all 10 trials of round 1, of which 5 are not in "
                           "the store; run its other shards first"),
            std::string::npos)
      << early.log;
  trials("--shard 2/2");

  // All rounds in shards leave the report no trial to run.
  int rounds = 1;
  for (std::string out; out.find("there is none") == std::string::npos;) {
    ++rounds;
    ASSERT_LT(rounds, 20);
    const std::string round = " --round " + std::to_string(rounds);
    trials("--shard 2/2" + round);
    out = trials("--shard 1/2" + round);
    EXPECT_NE(out.find("round " + std::to_string(rounds)), std::string::npos) << out;
  }
  EXPECT_GE(rounds, 3);
  EXPECT_EQ(call("report case.json -o out").code, 0);
  EXPECT_EQ(run_at_the_end(), (std::vector<int>{0, 0, 0}));
  EXPECT_EQ(results(folder_ / "out"), expected);
}

TEST_F(Shards, OfACaseThatIsNotScoutedRunInFull) {
  EXPECT_EQ(trials("--shard 1/2 --exhaustive"),
            "round 1 (full), shard 1/2: 5 of 10 trials, 5 run now\n");
  EXPECT_EQ(trials("--shard 2/2 --exhaustive"),
            "round 1 (full), shard 2/2: 5 of 10 trials, 5 run now\n");
  EXPECT_EQ(trials("--shard 1/2 --exhaustive --round 2"),
            "round 2: there is none, the round before was the last\n");
  EXPECT_EQ(call("report case.json -o out --exhaustive").code, 0);
  EXPECT_EQ(run_at_the_end(), (std::vector<int>{0}));
}

TEST_F(Shards, MoreThanTrialsLeaveSomeWithNone) {
  EXPECT_EQ(trials("--shard 12/12"), "round 1 (scout), shard 12/12: 0 of 10 trials, 0 run now\n");
}

TEST_F(Shards, ATrialThatIsDamagedInTheStoreIsRunAgain) {
  const auto expected = results_of_one_run();
  trials("--shard 1/1");
  fs::path piece;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "cache/wireplan/pieces")) {
    if (entry.is_regular_file()) piece = entry.path();
  }
  write_text("spoiled", piece);
  const Answer report = call("report case.json -o out");
  EXPECT_NE(report.log.find("1 of the 10 trials of round 1"), std::string::npos) << report.log;
  EXPECT_EQ(results(folder_ / "out"), expected);
}

// NFS gives no exclusive lock on a file that is open for reading alone.
TEST(SharedFolder, LocksAreOnFilesOpenForWriting) {
  const TemporaryFolder folder;
  const std::optional<FileLock> held = Store(folder / "cache").lock("wall", "key: 1\n");
  ASSERT_TRUE(held);
  int checked = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    if (fs::read_symlink(entry.path(), gone).extension() != ".lock") continue;
    const int file = std::stoi(entry.path().filename().string());
    EXPECT_EQ(::fcntl(file, F_GETFL) & O_ACCMODE, O_RDWR);
    ++checked;
  }
  EXPECT_EQ(checked, 1);
}

}  // namespace
}  // namespace wireplan::pipeline
