// The artifact store, the digests below it and the keys of the stages above it.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>

#include "pipeline/files/case_file.h"
#include "pipeline/files/plan_file.h"
#include "pipeline/stages/stages.h"
#include "pipeline/store/hash.h"
#include "pipeline/store/store.h"
#include "tests/pipeline/finished_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// Artifacts are read-only; a test that damages one must first be allowed to.
void overwrite(const fs::path& file, const std::string& text) {
  fs::permissions(file, fs::perms::owner_write, fs::perm_options::add);
  write_text(text, file);
}

Artifact commit_two_files(const Store& store, const std::string& key) {
  return store.commit("surface", key, [](const fs::path& folder) {
    write_text("triangles", folder / "surface.vtp");
    write_text("figures", folder / "more" / "surface.json");
  });
}

TEST(Key, ValuesCannotPassForOtherLines) {
  // A name of a wire that holds a line break and a key stays within its line.
  const std::string sly = Json("x\nparameter b: 2").dump();
  const std::string text = key_text({{"parameter a", sly}, {"parameter b", "1"}});
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
  EXPECT_NE(text, key_text({{"parameter a", "\"x\""}, {"parameter b", "2"}, {"parameter b", "1"}}));
  EXPECT_NE(key_text({{"a", "12"}, {"b", "3"}}), key_text({{"a", "1"}, {"b", "23"}}));
  EXPECT_THROW(key_text({{"a", "1\n2"}}), LogicError);
  EXPECT_THROW(key_text({{"a: 1", "2"}}), LogicError);
}

TEST(Key, DifferencesAreToldLineByLine) {
  const std::string before = key_text({{"version", "1"}, {"a", "1"}, {"b", "2"}});
  const std::string now = key_text({{"version", "1"}, {"a", "5"}, {"c", "3"}});
  EXPECT_EQ(describe_difference(before, now),
            (std::vector<std::string>{"a: 1 -> 5", "c: new, 3", "b: no longer there, was 2"}));
  EXPECT_TRUE(describe_difference(now, now).empty());
}

TEST(Store, FindsWhatWasCommittedUnderItsKeyAlone) {
  const TemporaryFolder folder;
  const Store store(folder.path());
  EXPECT_FALSE(store.find("surface", "key: 1\n"));
  const Artifact made = commit_two_files(store, "key: 1\n");

  const std::optional<Artifact> found = store.find("surface", "key: 1\n");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->contents(), made.contents());
  ASSERT_EQ(found->files.size(), 2u);
  EXPECT_EQ(found->files[0].name, "more/surface.json");
  EXPECT_EQ(read_text(found->folder / "surface.vtp"), "triangles");
  EXPECT_EQ(read_text(found->folder / "key.txt"), "key: 1\n");
  EXPECT_FALSE(store.find("surface", "key: 2\n"));
  EXPECT_FALSE(store.find("wall", "key: 1\n"));
}

TEST(Store, TakesADamagedArtifactForAbsentAndMakesItAgain) {
  const auto damage = std::vector<std::function<void(const fs::path&)>>{
      [](const fs::path& file) { overwrite(file, "triangle"); },   // truncated
      [](const fs::path& file) { overwrite(file, "triangleS"); },  // same size, other bytes
      [](const fs::path& file) { fs::remove(file); },
      [](const fs::path& file) { fs::remove(file.parent_path() / "manifest.json"); },
  };
  for (std::size_t k = 0; k < damage.size(); ++k) {
    SCOPED_TRACE(k);
    const TemporaryFolder folder;
    const Store store(folder.path());
    damage[k](commit_two_files(store, "key: 1\n").folder / "surface.vtp");
    EXPECT_FALSE(store.find("surface", "key: 1\n"));
    commit_two_files(store, "key: 1\n");
    ASSERT_TRUE(store.find("surface", "key: 1\n"));
    EXPECT_EQ(read_text(store.find("surface", "key: 1\n")->folder / "surface.vtp"), "triangles");
  }
}

TEST(Store, TakesAManifestCutAtAnyByteForAbsent) {
  const TemporaryFolder folder;
  const Store store(folder.path());
  const fs::path manifest = commit_two_files(store, "key: 1\n").folder / "manifest.json";
  const std::string whole = read_text(manifest);
  ASSERT_GT(whole.size(), 100u);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    overwrite(manifest, whole.substr(0, length));
    ASSERT_FALSE(store.find("surface", "key: 1\n")) << "cut to " << length << " bytes";
  }
  overwrite(manifest, whole);
  EXPECT_TRUE(store.find("surface", "key: 1\n"));
}

TEST(Store, LeavesNothingBehindWhenMakingFails) {
  const TemporaryFolder folder;
  const Store store(folder.path());
  EXPECT_THROW(store.commit("surface", "key: 1\n",
                            [](const fs::path& place) {
                              write_text("half", place / "surface.vtp");
                              throw Error("no");
                            }),
               Error);
  EXPECT_FALSE(store.find("surface", "key: 1\n"));
  EXPECT_TRUE(fs::is_empty(folder / "surface"));
}

TEST(Store, LetsOneAtATimeMakeAnArtifact) {
  const TemporaryFolder folder;
  const Store store(folder.path());
  const auto give_up = [] { return true; };
  {
    const std::optional<FileLock> held = store.lock("surface", "key: 1\n");
    ASSERT_TRUE(held);
    EXPECT_FALSE(store.lock("surface", "key: 1\n", give_up));
    EXPECT_TRUE(store.lock("surface", "key: 2\n", give_up));
  }
  EXPECT_TRUE(store.lock("surface", "key: 1\n", give_up));
}

TEST(Store, ContentsIgnoreTimes) {
  const TemporaryFolder folder;
  const Store store(folder.path());
  const auto commit = [&](const std::string& key, const std::string& time) {
    return store.commit("trials", key, [&](const fs::path& place) {
      write_text("forces", place / "trials" / "0000.json");
      write_text(time, place / kTimingFile);
    });
  };
  EXPECT_EQ(commit("key: 1\n", "1 s").contents(), commit("key: 2\n", "2 s").contents());
}

TEST(KeptRun, ThatLacksAMetricOfThisProgramCountsAsAbsent) {
  plan::Measured measured{.outcome = simulate::Outcome::kReached};
  measured.metrics.peak_tip_force = 0.25;
  const std::string text = measured_text(measured, /*with_shape=*/false);
  const std::optional<plan::Measured> back = measured_from_text(text);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->metrics.peak_tip_force, 0.25);
  for (const plan::MetricField& field : plan::kMetricFields) {
    Json older = Json::parse(text);
    ASSERT_EQ(older["metrics"].erase(field.name), 1u) << field.name;
    EXPECT_FALSE(measured_from_text(older.dump())) << field.name;
  }
  EXPECT_FALSE(measured_from_text(text.substr(0, text.size() / 2)));
}

TEST(KeptRun, KeepsWhatAScriptComesTo) {
  plan::Measured measured;
  EXPECT_FALSE(measured_from_text(measured_text(measured, false))->metrics.script);
  measured.metrics.script = plan::ScriptMetrics{.support = 1.0 / 3.0,
                                                .hook_depth = 0.1,
                                                .wire_beyond = 0.2,
                                                .hand_force = 0.3,
                                                .hub_torque = 0.7,
                                                .moves = 17,
                                                .exchanges = 2,
                                                .bears_more = true};
  const std::optional<plan::Measured> back = measured_from_text(measured_text(measured, false));
  ASSERT_TRUE(back && back->metrics.script);
  for (const plan::ScriptMetricField& field : plan::kScriptMetricFields) {
    EXPECT_EQ((*back->metrics.script).*field.value, (*measured.metrics.script).*field.value);
  }
  EXPECT_EQ(back->metrics.script->moves, 17);
  EXPECT_EQ(back->metrics.script->exchanges, 2);
  EXPECT_TRUE(back->metrics.script->bears_more);
}

TEST(Publish, ReplacesItsOwnFilesAndTouchesNoOthers) {
  const TemporaryFolder folder;
  const Store store(folder / "cache");
  const auto commit = [&](const std::string& key, const std::vector<std::string>& names) {
    return store.commit("trials", key, [&](const fs::path& place) {
      for (const std::string& name : names) write_text(key, place / name);
    });
  };
  const fs::path out = folder / "out";
  write_text("mine", out / "notes.txt");
  publish({commit("key: 1\n", {"0.json", "1.json"})}, out);
  EXPECT_EQ(read_text(out / "1.json"), "key: 1\n");

  publish({commit("key: 2\n", {"0.json"})}, out);
  EXPECT_EQ(read_text(out / "0.json"), "key: 2\n");
  EXPECT_FALSE(fs::exists(out / "1.json"));
  EXPECT_EQ(read_text(out / "notes.txt"), "mine");
}

// Runs the tube case with one value changed and returns the stages that were not cached.
class StageKeys : public testing::Test {
 protected:
  void SetUp() override { write_tube_case(folder_.path()); }
  void start_finished() { write_finished_tube(folder_.path()); }

  RunResult run(const std::vector<std::string>& changes, bool dry = false) {
    const Case given = read_case(folder_ / "case.json", changes);
    RunOptions options;
    options.cache = folder_ / "cache";
    options.dry_run = dry;
    return run_stages(given, options);
  }
  static std::vector<std::string> not_cached(const RunResult& result) {
    std::vector<std::string> names;
    for (const StageOutcome& outcome : result.stages) {
      if (outcome.state != StageState::kCached) names.push_back(outcome.stage);
    }
    return names;
  }

  std::size_t number_of(const std::string& stage) const {
    return static_cast<std::size_t>(std::find(all_.begin(), all_.end(), stage) - all_.begin());
  }

  TemporaryFolder folder_;
  const std::vector<std::string> all_ = {"surface", "centerline", "anatomy", "wall",
                                         "trials",  "manoeuvres", "plans",   "report"};
};

TEST_F(StageKeys, ASecondRunRunsNoStage) {
  EXPECT_EQ(not_cached(run({})), all_);
  EXPECT_TRUE(not_cached(run({})).empty());
}

TEST_F(StageKeys, AChangeRerunsAlsoWhatReadsWhatItChanges) {
  start_finished();
  run({});
  EXPECT_EQ(not_cached(run({"wall.thickness_mm=2"})),
            (std::vector<std::string>{"wall", "trials", "manoeuvres", "plans", "report"}));
}

TEST_F(StageKeys, TrialsInARigidVesselDoNotReadItsWall) {
  start_finished();
  run({"wall.model=rigid"});
  EXPECT_EQ(not_cached(run({"wall.model=rigid", "wall.thickness_mm=2"})),
            (std::vector<std::string>{"wall", "report"}));
}

TEST_F(StageKeys, AStageThatComesOutTheSameStopsTheCascade) {
  start_finished();
  run({});
  // The same surface in another file: read anew, and nothing after it but the report, which names
  // its digest.
  const std::string stl = read_text(folder_ / "tube.stl");
  write_text("solid renamed" + stl.substr(stl.find('\n')), folder_ / "tube.stl");
  EXPECT_EQ(not_cached(run({})), (std::vector<std::string>{"surface", "report"}));
}

TEST_F(StageKeys, ADryRunSaysWhatWouldRunAndWhyAndRunsNothing) {
  start_finished();
  run({});
  const RunResult dry = run({"wall.thickness_mm=2"}, /*dry=*/true);
  EXPECT_EQ(not_cached(dry),
            (std::vector<std::string>{"wall", "trials", "manoeuvres", "plans", "report"}));
  EXPECT_EQ(dry.stages[number_of("wall")].reasons,
            std::vector<std::string>{"parameter wall.thickness_mm: 1.0 -> 2.0"});
  ASSERT_EQ(dry.stages[number_of("trials")].reasons.size(), 1u);
  EXPECT_EQ(dry.stages[number_of("trials")].reasons[0].substr(0, 12), "input wall: ");
  EXPECT_EQ(not_cached(run({"wall.thickness_mm=2"}, /*dry=*/true)), not_cached(dry));
}

TEST_F(StageKeys, ADamagedArtifactIsMadeAgainWithTheSameContents) {
  start_finished();
  const RunResult first = run({});
  overwrite(first.artifacts[number_of("wall")].folder / "wall.vtu", "");
  const RunResult second = run({});
  EXPECT_EQ(not_cached(second), std::vector<std::string>{"wall"});
  EXPECT_EQ(second.artifacts[number_of("wall")].contents(),
            first.artifacts[number_of("wall")].contents());
}

TEST_F(StageKeys, AnInterruptedRunGoesOnFromItsFinishedTrials) {
  const Case given = read_case(folder_ / "case.json", {"robustness.repeats=0"});
  RunOptions options;
  options.cache = folder_ / "cache";
  options.work.threads = 1;
  int finished = 0;
  options.work.progress = [&](int, int) { ++finished; };
  options.work.cancelled = [&] { return finished == 1; };
  EXPECT_THROW(run_stages(given, options), Interrupted);
  ASSERT_EQ(finished, 1);

  options.work.cancelled = {};
  std::vector<int> counts;
  options.work.progress = [&](int done, int total) {
    counts.push_back(done);
    EXPECT_EQ(total, 2);
  };
  EXPECT_EQ(not_cached(run_stages(given, options)),
            (std::vector<std::string>{"trials", "manoeuvres", "plans", "report"}));
  EXPECT_EQ(counts, std::vector<int>{2});
}

TEST_F(StageKeys, ANewWireAddsItsTrialsOnly) {
  start_finished();
  const auto trials_run = [this](const RunResult& result) {
    return read_json(result.artifacts[number_of("trials")].folder / kTimingFile,
                     "wireplan.timing/1")
        .at("trials_run")
        .get<int>();
  };
  const Json soft = read_json(folder_ / "case.json", "wireplan.case/1")["wires"][0];
  Json stiff = soft;
  stiff["name"] = "stiff";
  stiff["sections"][0]["bending_stiffness_n_mm2"] = 500;
  const RunResult alone = run({});
  EXPECT_EQ(trials_run(alone), 2);
  // Before the other, so that the old trials get new numbers.
  const RunResult both = run({"wires=" + Json::array({stiff, soft}).dump()});
  EXPECT_EQ(trials_run(both), 2);
  EXPECT_EQ(read_text(both.artifacts[number_of("trials")].folder / "trials/0002.json"),
            read_text(alone.artifacts[number_of("trials")].folder / "trials/0000.json"));
  // Each angle is a trial of its own too; another stiffness makes all trials of its wire anew.
  EXPECT_EQ(trials_run(run({"access.inclination_deg=[0, 10, 20]"})), 1);
  EXPECT_EQ(trials_run(run({"friction=0.1"})), 2);
}

TEST_F(StageKeys, AKeptTrialThatIsDamagedIsComputedAgain) {
  start_finished();
  const RunResult first = run({});
  // The trial of the cache and the one kept are the same bytes on the disk.
  const fs::path trial = first.artifacts[number_of("trials")].folder / "trials/0000.json";
  const std::string whole = read_text(trial);
  std::string flipped = whole;
  flipped[whole.find("insertion_mm") + 20] ^= 1;
  overwrite(trial, flipped);
  const RunResult second = run({});
  EXPECT_EQ(not_cached(second), std::vector<std::string>{"trials"});
  EXPECT_EQ(read_text(trial), whole);
}

TEST_F(StageKeys, AnInputThatChangesWhileItIsReadIsNotTrusted) {
  const Case given = read_case(folder_ / "case.json");
  std::vector<Stage> stages = stages_of(given);
  stages.front().make = [](Workspace& work, const fs::path& folder) {
    write_text("half old, half new", folder / "surface.vtp");
    std::ofstream(work.input, std::ios::app) << "\n";
  };
  RunOptions options;
  options.cache = folder_ / "cache";
  try {
    run_stages(given, options, stages);
    FAIL() << "a surface that changed was accepted";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("changed while it was read; run again"),
              std::string::npos)
        << error.what();
  }
  EXPECT_TRUE(Store(options.cache).artifacts().empty());
}

TEST_F(StageKeys, AnInterruptedRunKeepsItsRepeats) {
  const Case given = read_case(folder_ / "case.json");
  RunOptions options;
  options.cache = folder_ / "cache";
  options.work.threads = 1;
  bool stop = false;
  options.work.progress = [&](int done, int total) { stop = total == 8 && done == 3; };
  options.work.cancelled = [&] { return stop; };
  EXPECT_THROW(run_stages(given, options), Interrupted);
  int kept = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "cache" / "pieces")) {
    if (!entry.is_regular_file()) continue;
    const std::string text = read_text(entry.path());
    const bool is_repeat = text.find("wireplan.measured/") != std::string::npos &&
                           text.find("nodes_mm") == std::string::npos;  // else other elements
    kept += is_repeat ? 1 : 0;
  }
  EXPECT_EQ(kept, 3);

  // It goes on to the same report as in one go.
  const auto report_of = [&](const std::string& cache) {
    options.cache = folder_ / cache;
    const fs::path folder = run_stages(given, options).artifacts.back().folder;
    Json report = read_json(folder / "report.json", "wireplan.report/2");
    report.erase("timing");
    return report.dump();
  };
  options.work.progress = {};
  options.work.cancelled = {};
  EXPECT_EQ(report_of("cache"), report_of("other-cache"));
}

}  // namespace
}  // namespace wireplan::pipeline
