// `wireplan cache`: what it lists, finds damaged and takes out, and what it leaves alone.
#include <gtest/gtest.h>

#include "pipeline/store/cache.h"
#include "pipeline/store/hash.h"
#include "tests/pipeline/program.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

void overwrite(const fs::path& file, const std::string& text) {
  fs::permissions(file, fs::perms::owner_write, fs::perm_options::add);
  std::ofstream(file, std::ios::binary) << text;
}

class CacheTest : public testing::Test {
 protected:
  Artifact commit(const std::string& stage, const std::string& key, const std::string& bytes) {
    return store_.commit(stage, key,
                         [&](const fs::path& folder) { write_text(bytes, folder / "made.txt"); });
  }
  void set_days_unused(const Artifact& artifact, int days) {
    fs::last_write_time(artifact.folder,
                        fs::file_time_type::clock::now() - std::chrono::hours(24 * days));
  }

  TemporaryFolder folder_;
  const Store store_{folder_ / "cache"};
};

TEST_F(CacheTest, ListsWhatThereIsWithSizeAndLastUse) {
  EXPECT_TRUE(list_cache(store_).empty());
  commit("wall", "key: 1\n", std::string(1000, 'w'));
  set_days_unused(commit("surface", "key: 1\n", "s"), 3);
  const std::vector<CacheEntry> entries = list_cache(store_);
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].artifact.stage, "surface");
  EXPECT_NEAR(entries[0].days_unused, 3.0, 0.01);  // minutes of a slow test at most
  EXPECT_EQ(entries[1].artifact.stage, "wall");
  EXPECT_EQ(entries[1].bytes, 1000u);
  EXPECT_LT(entries[1].days_unused, 0.01);
  // Looking one up counts as its use.
  ASSERT_TRUE(store_.find("surface", "key: 1\n"));
  EXPECT_LT(list_cache(store_)[0].days_unused, 0.01);
}

TEST_F(CacheTest, AClockThatWentBackMakesNothingOld) {
  set_days_unused(commit("wall", "key: 1\n", "w"), -30);  // made in what is now the future
  EXPECT_EQ(list_cache(store_)[0].days_unused, 0.0);
  EXPECT_EQ(prune_cache(store_, {.unused_days = 1.0, .max_bytes = {}}).artifacts, 0);
}

TEST_F(CacheTest, VerifyFindsEachKindOfDamageAndNothingElse) {
  const Artifact intact = commit("wall", "key: 0\n", "w");
  EXPECT_TRUE(verify_cache(store_).empty());
  const Artifact changed = commit("wall", "key: 1\n", "w");
  overwrite(changed.folder / "made.txt", "W");
  const Artifact gone = commit("wall", "key: 2\n", "w");
  fs::remove(gone.folder / "made.txt");
  const Artifact cut = commit("wall", "key: 3\n", "w");
  overwrite(cut.folder / "manifest.json", "{");
  const Artifact foreign = commit("wall", "key: 4\n", "w");
  overwrite(foreign.folder / "manifest.json", read_text(intact.folder / "manifest.json"));
  const fs::path piece = store_.keep_piece("trial: 1\n", "forces");
  store_.keep_piece("trial: 2\n", "forces");
  overwrite(piece, "Forces");

  std::vector<fs::path> expected = {changed.folder, gone.folder, cut.folder, foreign.folder, piece};
  std::sort(expected.begin(), expected.end());
  std::vector<fs::path> found;
  for (const CacheDamage& damage : verify_cache(store_)) found.push_back(damage.place);
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, expected);

  const PruneResult pruned = prune_cache(store_, {});
  EXPECT_EQ(pruned.artifacts, 4);
  EXPECT_EQ(pruned.pieces, 1);
  EXPECT_TRUE(verify_cache(store_).empty());
  EXPECT_TRUE(store_.find("wall", "key: 0\n"));
  EXPECT_TRUE(store_.find_piece("trial: 2\n")) << "of a run that may go on";
}

TEST_F(CacheTest, PruneTakesOutWhatKilledRunsLeftAndKeepsTheRest) {
  const Artifact kept = commit("wall", "key: 1\n", "w");
  store_.remember(folder_ / "case.json", kept);
  const std::string key = hash_text("key: 2\n");
  write_text("half", store_.root() / "wall" / (".part-1234-0-" + key.substr(0, 16)) / "wall.vtu");
  write_text("", store_.root() / "wall" / (key + ".lock"));
  write_text("half", store_.root() / "wall" / (key + ".unfinished") / "0000.json");
  write_text("half", store_.pieces() / key / ".part-1234-1-abc");
  const PruneResult pruned = prune_cache(store_, {});
  EXPECT_EQ(pruned.leftovers, 4);
  EXPECT_EQ(pruned.artifacts, 0);
  EXPECT_TRUE(store_.find("wall", "key: 1\n"));
  EXPECT_EQ(store_.last_key_text(folder_ / "case.json", "wall"), "key: 1\n");
  EXPECT_EQ(prune_cache(store_, {}).leftovers, 0);
}

TEST_F(CacheTest, PruneTakesOutWhatWasNotUsedForLong) {
  set_days_unused(commit("wall", "key: 1\n", "w"), 40);
  set_days_unused(commit("wall", "key: 2\n", "w"), 20);
  EXPECT_EQ(prune_cache(store_, {.unused_days = 30.0, .max_bytes = {}}).artifacts, 1);
  EXPECT_FALSE(store_.find("wall", "key: 1\n"));
  EXPECT_TRUE(store_.find("wall", "key: 2\n"));
}

TEST_F(CacheTest, PruneGoesDownToASizeByLastUse) {
  const std::string kilobyte(1000, 'w');
  set_days_unused(commit("wall", "key: 1\n", kilobyte), 1);
  set_days_unused(commit("wall", "key: 2\n", kilobyte), 3);
  set_days_unused(commit("wall", "key: 3\n", kilobyte), 2);
  EXPECT_EQ(prune_cache(store_, {.unused_days = {}, .max_bytes = 1500}).artifacts, 2);
  EXPECT_TRUE(store_.find("wall", "key: 1\n"));
}

TEST_F(CacheTest, PruneWaitsForNoOneAndTakesNothingFromARunUnderWay) {
  commit("wall", "key: 1\n", "w");
  {
    const std::optional<FileLock> run = store_.use();
    ASSERT_TRUE(run);
    EXPECT_TRUE(store_.use()) << "runs do not keep each other out";
    EXPECT_THROW(prune_cache(store_, {.unused_days = 0.0, .max_bytes = {}}), Error);
    EXPECT_TRUE(store_.find("wall", "key: 1\n"));
  }
  EXPECT_EQ(prune_cache(store_, {.unused_days = 0.0, .max_bytes = {}}).artifacts, 1);
}

TEST_F(CacheTest, MakingAnArtifactTidiesUpAfterItsKilledMakerAlone) {
  const std::string key = hash_text("key: 1\n"), other = hash_text("key: 2\n");
  const fs::path mine = store_.root() / "wall" / (".part-1234-0-" + key.substr(0, 16));
  const fs::path others = store_.root() / "wall" / (".part-1234-0-" + other.substr(0, 16));
  write_text("half", mine / "wall.vtu");
  write_text("half", others / "wall.vtu");
  commit("wall", "key: 1\n", "w");
  EXPECT_FALSE(fs::exists(mine));
  EXPECT_TRUE(fs::exists(others)) << "it may be under way";
}

TEST_F(CacheTest, ALockLeavesNoFileAndOneLeftByAKilledRunLocksNothing) {
  const fs::path file = store_.root() / "wall" / (hash_text("key: 1\n") + ".lock");
  write_text("", file);  // as a killed run leaves it
  const auto give_up = [] { return true; };
  {
    const std::optional<FileLock> held = store_.lock("wall", "key: 1\n", give_up);
    ASSERT_TRUE(held);
    EXPECT_FALSE(store_.lock("wall", "key: 1\n", give_up));
  }
  EXPECT_FALSE(fs::exists(file));
  EXPECT_TRUE(store_.lock("wall", "key: 1\n", give_up));
}

TEST_F(CacheTest, APieceIsFoundByItsKeyAndOnlyWhole) {
  EXPECT_FALSE(store_.find_piece("trial: 1\n"));
  const fs::path piece = store_.keep_piece("trial: 1\n", "forces");
  EXPECT_EQ(store_.find_piece("trial: 1\n"), piece);
  EXPECT_FALSE(store_.find_piece("trial: 2\n"));
  overwrite(piece, "force");
  EXPECT_FALSE(store_.find_piece("trial: 1\n"));
  EXPECT_EQ(store_.keep_piece("trial: 1\n", "forces"), piece);
  EXPECT_EQ(read_text(*store_.find_piece("trial: 1\n")), "forces");
}

TEST_F(CacheTest, CommandsTellWhatTheyFindAndDo) {
  EXPECT_EQ(run_program(folder_.path(), "cache list").code, 0) << "a cache that is not there yet";
  EXPECT_EQ(run_program(folder_.path(), "cache prune").code, 0);
  const Store store(folder_ / "cache" / "wireplan");
  const Artifact artifact = store.commit("surface", "key: 1\n", [](const fs::path& place) {
    write_text("triangles", place / "surface.vtp");
  });
  const Answer list = run_program(folder_.path(), "cache list");
  EXPECT_NE(list.out.find("surface     " + artifact.key.substr(0, 8)), std::string::npos)
      << list.out;
  EXPECT_EQ(run_program(folder_.path(), "cache verify").out, "every artifact is intact\n");
  overwrite(artifact.folder / "surface.vtp", "triangleS");
  const Answer verify = run_program(folder_.path(), "cache verify");
  EXPECT_EQ(verify.code, 2);
  EXPECT_EQ(verify.out, artifact.folder.string() +
                            ": files differ from the manifest\n1 damaged; they will be made again "
                            "when they are needed\n");
  const Answer prune = run_program(folder_.path(), "cache prune --max-gb 1 --unused-days 30");
  EXPECT_EQ(prune.code, 0);
  EXPECT_EQ(prune.out.substr(0, 55), "removed 1 artifacts, 0 trials and 0 leftovers of stoppe");
  EXPECT_EQ(run_program(folder_.path(), "cache").code, 2);
}

TEST(OutputFolders, InWhoseWayAFileStandsAreRefusedBeforeAnyWork) {
  const TemporaryFolder folder;
  write_tube_case(folder.path());
  write_text("mine", folder / "taken");
  fs::create_symlink("nowhere", folder / "dangling");
  const std::string scene = std::string(WIREPLAN_SOURCE_DIR) + "/cases/cantilever/scene.json";
  for (const std::string& command :
       {std::string("run case.json -o "), std::string("report case.json -o "),
        std::string("batch case.json -o "), "simulate " + scene + " -o ",
        std::string("phantom --random 1 -o "), std::string("render report.json -o "),
        std::string("bench accuracy --quick -o "), std::string("new --volume ct.nrrd "),
        std::string("run case.json --cache "), std::string("trials case.json --shard 1/2 --cache "),
        std::string("status case.json --cache "), std::string("cache list --cache ")}) {
    for (const auto& [place, why] :
         {std::pair("taken", "taken: is a file, expected a folder for "),
          std::pair("taken/deep/er", "taken, which is a file, expected a folder for "),
          std::pair("dangling", "is a link that leads nowhere, expected a folder for ")}) {
      const Answer answer = run_program(folder.path(), command + place);
      EXPECT_EQ(answer.code, 2) << command << place << "\n" << answer.log;
      EXPECT_NE(answer.log.find(why), std::string::npos) << command << place << "\n" << answer.log;
      EXPECT_EQ(answer.out, "") << command << place;
    }
  }
  EXPECT_EQ(read_text(folder / "taken"), "mine");
  EXPECT_FALSE(fs::exists(folder / "cache"));
  EXPECT_FALSE(fs::exists(folder / "nowhere"));
}

TEST(OutputFolders, WhereNothingCanBeMadeAreRefusedEvenOfRoot) {
  if (!fs::is_directory("/proc/self")) GTEST_SKIP() << "this system has no /proc";
  const TemporaryFolder folder;
  write_tube_case(folder.path());
  for (const char* command :
       {"run case.json -o ", "phantom --random 1 -o ", "run case.json --cache "}) {
    const Answer answer = run_program(folder.path(), std::string(command) + "/proc/none/deep");
    EXPECT_EQ(answer.code, 2) << command << "\n" << answer.log;
    EXPECT_NE(answer.log.find("nothing may be written in /proc"), std::string::npos)
        << command << "\n"
        << answer.log;
  }
}

}  // namespace
}  // namespace wireplan::pipeline
