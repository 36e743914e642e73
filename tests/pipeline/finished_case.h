#pragma once
/// The tube case of small_case.h as a run leaves it, for tests of what comes after a run or of what
/// a change reruns. The run is made once for all tests of a build, each of which is a process.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "pipeline/files/case_file.h"
#include "pipeline/stages/stages.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {

/// The store of that run, beside the test program and named after its time: what another build left
/// is removed.
inline std::filesystem::path finished_tube_store() {
  namespace fs = std::filesystem;
  const fs::path program = fs::read_symlink("/proc/self/exe");
  const fs::path stores = program.string() + "-finished";
  const fs::path store =
      stores / std::to_string(fs::last_write_time(program).time_since_epoch().count());
  if (fs::exists(store)) return store;

  std::error_code ignored;
  fs::create_directories(stores);
  for (const fs::directory_entry& entry : fs::directory_iterator(stores)) {
    if (entry.path().stem() != store.stem()) fs::remove_all(entry.path(), ignored);
  }
  const TemporaryFolder folder;
  write_tube_case(folder.path());
  const fs::path own = store.string() + "." + std::to_string(::getpid());
  RunOptions options;
  options.cache = own;
  run_stages(read_case(folder / "case.json"), options);
  fs::rename(own, store, ignored);  // whoever comes second
  fs::remove_all(own, ignored);
  return store;
}

/// Writes the tube case into the folder and a copy of that store, with its hard links, to `cache`
/// in it: "cache/wireplan" for the program. Returns the case file's contents.
inline Json write_finished_tube(const std::filesystem::path& folder,
                                const std::string& cache = "cache") {
  const Json file = write_tube_case(folder);
  std::filesystem::create_directories((folder / cache).parent_path());
  const std::string command =
      "cp -a '" + finished_tube_store().string() + "' '" + (folder / cache).string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  return file;
}

}  // namespace wireplan::pipeline
