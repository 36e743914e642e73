// What goes wrong while the program runs: the disk refuses, files are damaged or vanish, the
// program is killed, two run at once. Nothing damaged is trusted, nothing finished is lost, and the
// report comes out the same. WIREPLAN_LONG_TESTS=1 takes every write, every damage, 100 kills of
// the bundled case and 20 pairs of processes.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <random>
#include <thread>

#include "pipeline/stages/stages.h"
#include "pipeline/store/cache.h"
#include "pipeline/store/hash.h"
#include "preprocess/volume/image.h"
#include "tests/pipeline/finished_case.h"
#include "tests/pipeline/program.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

bool long_tests() { return std::getenv("WIREPLAN_LONG_TESTS") != nullptr; }

void overwrite(const fs::path& file, const std::string& text) {
  fs::permissions(file, fs::perms::owner_write, fs::perm_options::add);
  std::ofstream(file, std::ios::binary) << text;
}

class Faults : public testing::Test {
 protected:
  void SetUp() override { write_tube_case(folder_.path()); }
  fs::path cache() const { return folder_ / "cache" / "wireplan"; }
  fs::path report() const { return folder_ / "cache" / "out" / "report.json"; }

  /// The program with a disk that fails below folder/cache, where its results go too.
  Answer run_with(const std::string& fault) const {
    return run_program(folder_.path(), "run case.json -o cache/out -j 1",
                       "LD_PRELOAD='" WIREPLAN_FAULT_LIBRARY "' WIREPLAN_FAULT_BELOW='" +
                           (folder_ / "cache").string() + "' " + fault);
  }
  Answer run() const { return run_program(folder_.path(), "run case.json -o cache/out -j 1"); }
  static bool can_preload() { return std::string(WIREPLAN_SANITIZED).empty(); }

  TemporaryFolder folder_;
};

TEST_F(Faults, AWriteThatFailsIsToldAndSpoilsNothing) {
  if (!can_preload()) GTEST_SKIP() << "a preloaded library comes before the sanitizer's";
  if (long_tests() && preprocess::reads_volumes()) {  // all stages
    write_two_tubes(folder_ / "ct.nrrd");
    const Json tube = read_json(folder_ / "case.json", "wireplan.case/1");
    write_json(volume_case(tube), folder_ / "case.json");
  }
  const Answer whole = run_with("WIREPLAN_FAULT_COUNT='" + (folder_ / "count.txt").string() + "'");
  ASSERT_EQ(whole.code, 0) << whole.log;
  const long writes = std::stol(read_text(folder_ / "count.txt"));
  ASSERT_GT(writes, 100);
  const std::string expected = report_without_timing(report());

  // A disk that is full stays so; one that fails to write, or takes a right away, may do so once.
  struct Fault {
    int error;
    bool stays;
  };
  const std::vector<Fault> faults = {{ENOSPC, true}, {EIO, false}, {EROFS, true}, {EACCES, false}};
  const long step = long_tests() ? 1 : writes / 9;
  long tried = 0, told = 0;
  for (long at = 1; at <= writes; at += step) {
    for (std::size_t kind = 0; kind < faults.size(); ++kind) {
      const bool always = long_tests() && kind < 2;
      if (!always && kind != static_cast<std::size_t>(tried) % faults.size()) continue;
      const Fault fault = faults[kind];
      SCOPED_TRACE("write " + std::to_string(at) + ": " + std::strerror(fault.error));
      fs::remove_all(folder_ / "cache");
      fs::create_directories(folder_ / "cache");
      const Answer failed = run_with("WIREPLAN_FAULT_AT=" + std::to_string(at) +
                                     " WIREPLAN_FAULT_ERROR=" + std::to_string(fault.error) +
                                     (fault.stays ? " WIREPLAN_FAULT_STAYS=1" : ""));
      // What need not be written may fail: then all is as it should be.
      if (failed.code == 3) {
        ++told;
        const bool in_cache = failed.log.find(cache().parent_path().string()) != std::string::npos;
        const bool in_output =
            failed.log.find("cache/out/") != std::string::npos;  // as it was given
        EXPECT_TRUE(in_cache || in_output) << failed.log;
      } else {
        ASSERT_EQ(failed.code, 0) << failed.log;
        EXPECT_EQ(report_without_timing(report()), expected);
      }
      const std::vector<CacheDamage> damages = verify_cache(Store(cache()));
      EXPECT_TRUE(damages.empty()) << damages.front().place << damages.front().what;
      const Answer next = run();
      ASSERT_EQ(next.code, 0) << next.log;
      EXPECT_EQ(report_without_timing(report()), expected);
    }
    ++tried;
  }
  EXPECT_GT(told, tried / 2);
  RecordProperty("writes", static_cast<int>(writes));
  RecordProperty("told", static_cast<int>(told));
}

TEST_F(Faults, ARunThatFindsEverythingWritesNothing) {
  if (!can_preload()) GTEST_SKIP() << "a preloaded library comes before the sanitizer's";
  write_finished_tube(folder_.path(), "cache/wireplan");
  ASSERT_EQ(run().code, 0);
  const Answer again = run_with("WIREPLAN_FAULT_AT=1 WIREPLAN_FAULT_STAYS=1 WIREPLAN_FAULT_ERROR=" +
                                std::to_string(EROFS));
  EXPECT_EQ(again.code, 0) << again.log;
}

TEST_F(Faults, AClockThatRunsBackwardsChangesNothing) {
  if (!can_preload()) GTEST_SKIP() << "a preloaded library comes before the sanitizer's";
  write_finished_tube(folder_.path(), "cache/wireplan");
  ASSERT_EQ(run().code, 0);
  const std::string expected = report_without_timing(report());
  fs::remove_all(folder_ / "cache");
  for (int k = 0; k < 2; ++k) {
    const Answer answer = run_with("WIREPLAN_CLOCK_BACK=1");
    ASSERT_EQ(answer.code, 0) << answer.log;
    EXPECT_EQ(answer.log.find("made") == std::string::npos, k == 1) << answer.log;
    EXPECT_EQ(report_without_timing(report()), expected);
  }
}

TEST_F(Faults, AnArtifactThatVanishesBetweenStagesIsNamedAndMadeAgain) {
  const Case given = read_case(folder_ / "case.json");
  RunOptions options;
  options.cache = cache();
  options.on_stage = [&](const StageOutcome& outcome) {
    if (outcome.stage == "centerline") fs::remove_all(cache() / "surface");
  };
  try {
    run_stages(given, options);
    FAIL() << "ran without its surface";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("surface.vtp: no such file"), std::string::npos)
        << error.what();
  }
  options.on_stage = {};
  EXPECT_EQ(run_stages(given, options).stages.size(), stages_of(given).size());
}

TEST_F(Faults, AnInputThatVanishesIsNamed) {
  ASSERT_EQ(run_program(folder_.path(), "run case.json --to surface").code, 0);
  fs::remove(folder_ / "tube.stl");
  const Answer gone = run_program(folder_.path(), "run case.json");
  EXPECT_EQ(gone.code, 2);
  EXPECT_NE(gone.log.find("tube.stl"), std::string::npos) << gone.log;
}

// ---- damage ----------------------------------------------------------------------------------

// Every way in which a file can be damaged, but those that leave it as it was.
std::vector<std::string> damaged_forms(const std::string& whole, const std::string& another) {
  std::vector<std::string> forms = {another};
  for (const std::size_t at : {std::size_t{0}, whole.size() / 2, whole.size() - 1}) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 4);
    forms.push_back(flipped);
  }
  for (std::size_t k = 0; k < 16; ++k) forms.push_back(whole.substr(0, whole.size() * k / 16));
  std::erase(forms, whole);
  return forms;
}

TEST_F(Faults, EveryDamageToAnyFileOfTheCacheIsFound) {
  write_finished_tube(folder_.path(), "cache/wireplan");
  const Case given = read_case(folder_ / "case.json");
  RunOptions options;
  options.cache = cache();
  const RunResult result = run_stages(given, options);
  const Store store(cache());
  int damages = 0;
  for (const Artifact& artifact : result.artifacts) {
    const std::string key = read_text(artifact.folder / "key.txt");
    std::vector<std::string> names = {"manifest.json"};
    for (const ArtifactFile& file : artifact.files) names.push_back(file.name);
    const std::string other = read_text(artifact.folder / names.back());
    for (const std::string& name : names) {
      SCOPED_TRACE(artifact.stage + "/" + name);
      const fs::path file = artifact.folder / name;
      const std::string whole = read_text(file);
      const std::string another =
          name == names.back() ? read_text(artifact.folder / names[0]) : other;
      for (const std::string& form : damaged_forms(whole, another)) {
        overwrite(file, form);
        ++damages;
        const std::optional<Artifact> found = store.find(artifact.stage, key);
        // A manifest may tell another time; what it tells of the files is checked against them.
        EXPECT_TRUE(!found ||
                    (name == "manifest.json" && found->contents() == artifact.contents()));
      }
      fs::remove(file);
      EXPECT_FALSE(store.find(artifact.stage, key));
      write_text(whole, file);
      EXPECT_TRUE(store.find(artifact.stage, key));
    }
  }
  EXPECT_GT(damages, 300);
}

TEST_F(Faults, WhateverIsDamagedIsMadeAgainAndTheReportStaysTheSame) {
  write_finished_tube(folder_.path(), "cache/wireplan");
  ASSERT_EQ(run().code, 0);
  const std::string expected = report_without_timing(report());
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(cache())) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  const std::size_t step = long_tests() ? 1 : std::max<std::size_t>(1, files.size() / 8);
  for (std::size_t k = 0; k < files.size(); k += step) {
    if (!fs::exists(files[k])) continue;  // of an artifact that was made again, with other names
    SCOPED_TRACE(files[k]);
    const std::string whole = read_text(files[k]);
    if (whole.empty()) continue;
    const std::vector<std::string> forms =
        damaged_forms(whole, read_text(files[(k + 1) % files.size()]));
    for (std::size_t form = 0; form < forms.size(); form += long_tests() ? 1 : forms.size()) {
      overwrite(files[k], forms[form]);
      const Answer again = run();
      ASSERT_EQ(again.code, 0) << again.log;
      EXPECT_EQ(report_without_timing(report()), expected);
    }
  }
}

// ---- processes that are killed, or run together ----------------------------------------------

// A program that was started and may be killed; killed at the end of its scope in any case.
class Process {
 public:
  Process(const fs::path& folder, const std::vector<std::string>& arguments, const fs::path& log) {
    std::vector<std::string> words = {WIREPLAN_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    const std::string cache = (folder / "cache").string();
    process_ = ::fork();
    if (process_ != 0) return;
    const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    ::dup2(file, STDOUT_FILENO);
    ::dup2(file, STDERR_FILENO);
    ::setenv("XDG_CACHE_HOME", cache.c_str(), 1);
    if (::chdir(folder.c_str()) == 0) ::execv(pointers[0], pointers.data());
    ::_exit(127);
  }
  ~Process() {
    if (process_ > 0) kill();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  bool is_running() {
    if (process_ > 0 && ::waitpid(process_, &status_, WNOHANG) == process_) process_ = 0;
    return process_ > 0;
  }
  void kill() {
    ::kill(process_, SIGKILL);
    wait();
  }
  int wait() {
    if (process_ > 0) ::waitpid(process_, &status_, 0);
    process_ = 0;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  }

 private:
  pid_t process_ = 0;
  int status_ = 0;
};

int count(const std::string& text, const std::string& part) {
  int number = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++number;
  }
  return number;
}

// Each kept trial with what tells whether it was written again.
std::map<fs::path, std::pair<ino_t, std::int64_t>> kept_trials(const fs::path& cache) {
  std::map<fs::path, std::pair<ino_t, std::int64_t>> trials;
  if (!fs::exists(cache / "pieces")) return trials;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(cache / "pieces")) {
    struct stat status {};
    const std::string name = entry.path().filename().string();
    if (!entry.is_regular_file() || name.starts_with(kTemporaryPrefix)) continue;
    if (::stat(entry.path().c_str(), &status) != 0) continue;
    trials[entry.path()] = {status.st_ino,
                            status.st_mtim.tv_sec * 1000000000LL + status.st_mtim.tv_nsec};
  }
  return trials;
}

std::vector<std::string> stage_names(const fs::path& folder) {
  std::vector<std::string> names;
  for (const Stage& stage : stages_of(read_case(folder / "case.json"))) {
    names.push_back(stage.name);
  }
  return names;
}

// A volume of a tube, where imaging is built, so that all stages run; many short trials. In long
// tests the bundled case.
std::vector<std::string> write_many_trials(const fs::path& folder) {
  Json file = read_json(folder / "case.json", "wireplan.case/1");
  file["access"]["azimuth_deg"] = {0, 45, 90, 135, 180, 225, 270, 315};
  if (preprocess::reads_volumes()) {
    if (long_tests()) {
      const std::string abdomen = std::string(WIREPLAN_SOURCE_DIR) + "/cases/abdomen/";
      EXPECT_EQ(run_program(folder, "phantom '" + abdomen + "phantom.json' -o phantom").code, 0);
      file = read_json(abdomen + "case.json", "wireplan.case/1");
    } else {
      write_two_tubes(folder / "ct.nrrd");
      file = volume_case(file);
    }
  }
  write_json(file, folder / "case.json");
  return stage_names(folder);
}

TEST_F(Faults, AKilledRunGoesOnAndComputesNoFinishedTrialTwice) {
  const std::vector<std::string> stages = write_many_trials(folder_.path());
  const std::vector<std::string> arguments = {"run", "case.json", "-o", "out", "-j", "2"};
  const fs::path log = folder_ / "killed.txt";
  const auto lines_so_far = [&] {
    const std::string text = read_text(log);
    return count(text, " made ") + count(text, " cached ");
  };

  // A whole run, for its report and for how long each stage takes.
  std::vector<double> seconds;
  {
    Process whole(folder_.path(), arguments, log);
    auto last = std::chrono::steady_clock::now();
    for (bool running = true; running;) {
      running = whole.is_running();
      while (lines_so_far() > static_cast<int>(seconds.size())) {
        const auto now = std::chrono::steady_clock::now();
        seconds.push_back(std::chrono::duration<double>(now - last).count());
        last = now;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    ASSERT_EQ(whole.wait(), 0) << read_text(log);
    ASSERT_EQ(seconds.size(), stages.size());
  }
  const std::string expected = report_without_timing(folder_ / "out" / "report.json");
  const std::size_t trials = kept_trials(cache()).size();
  EXPECT_GE(trials, 9u);  // one along the axis, eight askew; more where scouts go before them

  // Kills at random moments of each stage in turn, each followed by a run that goes on, until one
  // runs to the end; over and over.
  const int wanted = long_tests() ? 100 : 7, kills_per_stage = long_tests() ? 4 : 1;
  std::mt19937_64 random(7);
  std::map<std::string, int> hits;
  int kills = 0, attempts = 0;
  while (kills < wanted && attempts < 10 * wanted) {
    fs::remove_all(folder_ / "cache");
    fs::remove_all(folder_ / "out");
    std::map<fs::path, std::pair<ino_t, std::int64_t>> kept;
    const std::size_t tries = stages.size() * static_cast<std::size_t>(kills_per_stage);
    for (std::size_t k = 0; k < tries && kills < wanted; ++k) {
      const std::size_t stage = k / static_cast<std::size_t>(kills_per_stage);
      ++attempts;
      {
        Process program(folder_.path(), arguments, log);
        while (program.is_running() && lines_so_far() < static_cast<int>(stage)) {
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        const double share = static_cast<double>(random() >> 11U) * 0x1p-53;
        std::this_thread::sleep_for(std::chrono::duration<double>(share * seconds[stage]));
        if (program.is_running()) {
          program.kill();
          const auto reached = static_cast<std::size_t>(lines_so_far());
          if (reached < stages.size()) ++hits[stages[reached]];
          ++kills;
        }
      }
      // What was kept is still there, as it was written then.
      const auto now = kept_trials(cache());
      for (const auto& [trial, written] : kept) {
        ASSERT_TRUE(now.count(trial) == 1) << trial;
        EXPECT_EQ(now.at(trial), written) << "computed twice: " << trial;
      }
      kept = now;
    }
    const Answer rest = run_program(folder_.path(), "run case.json -o out -j 2");
    ASSERT_EQ(rest.code, 0) << rest.log;
    EXPECT_EQ(report_without_timing(folder_ / "out" / "report.json"), expected);
    const auto last = kept_trials(cache());
    for (const auto& [trial, written] : kept) EXPECT_EQ(last.at(trial), written) << trial;
    EXPECT_EQ(last.size(), trials);
    prune_cache(Store(cache()), {});
    EXPECT_TRUE(verify_cache(Store(cache())).empty());
    if (long_tests()) std::cout << kills << " kills, " << trials << " trials" << std::endl;
  }
  EXPECT_EQ(kills, wanted);
  if (long_tests()) {
    for (const std::string& stage : stages) EXPECT_GE(hits[stage], 5) << stage;
  }
  for (const auto& [stage, number] : hits) RecordProperty("kills_in_" + stage, number);
}

TEST_F(Faults, TwoProcessesOnOneCaseMakeEachStageOnce) {
  const int pairs = long_tests() ? 20 : 2;
  for (int pair = 0; pair < pairs; ++pair) {
    SCOPED_TRACE(pair);
    fs::remove_all(folder_ / "cache");
    {
      Process first(folder_.path(), {"run", "case.json", "-o", "a"}, folder_ / "a.txt");
      Process second(folder_.path(), {"run", "case.json", "-o", "b"}, folder_ / "b.txt");
      EXPECT_EQ(first.wait(), 0);
      EXPECT_EQ(second.wait(), 0);
    }
    const std::string logs = read_text(folder_ / "a.txt") + read_text(folder_ / "b.txt");
    for (std::string line : stage_names(folder_.path())) {
      line.resize(10, ' ');
      EXPECT_EQ(count(logs, line + "  made"), 1) << logs;
      EXPECT_EQ(count(logs, line + "  cached"), 1) << logs;
    }
    EXPECT_EQ(read_text(folder_ / "a" / "report.json"), read_text(folder_ / "b" / "report.json"));
  }
}

}  // namespace
}  // namespace wireplan::pipeline
