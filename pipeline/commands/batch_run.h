#pragma once
/// `wireplan batch`: many patients, each in a process of its own, so that one that fails, crashes
/// or takes too much memory never stops the others. One is preprocessed while another's trials run.
/// What is finished lies in the cache: a batch that was stopped goes on from there.
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"

namespace wireplan::pipeline {

inline constexpr const char* kBatchSchema = "wireplan.batch/1";

struct BatchCase {
  std::string name;  // of its folder below the output, from the name of its folder or file
  std::filesystem::path path;
};

/// The cases that the arguments mean: a case file, a folder with a case.json, or a folder of such
/// files and folders. Throws `Error` where there is none, or where two would have one name.
std::vector<BatchCase> list_batch_cases(const std::vector<std::string>& arguments);

struct BatchRunOptions {
  std::filesystem::path output, cache;
  int threads = 0;         // patients at a time, and threads of each one's trials; 0: all cores
  double memory_gb = 0.0;  // of all patients together; 0: three quarters of the machine's
  bool fail_fast = false;  // after one that failed start no other and stop those under way
  std::function<bool()> cancelled = {};                  // asked often; may be empty
  std::function<void(const std::string&)> on_line = {};  // told a line per patient; may be empty
};

/// Runs them and writes OUTPUT/batch.json anew after each. OUTPUT/NAME/ gets what `wireplan run`
/// puts there, OUTPUT/NAME.log its log. A patient starts when there is room for the memory that it
/// is expected to need. Where all together take more than the limit, the youngest is stopped and
/// begun again later; a patient that takes more than the limit on its own has failed. Returns the
/// contents of batch.json. Call it before the process has other threads, since it forks.
Json run_batch_cases(const std::vector<BatchCase>& cases, const BatchRunOptions& options);

/// The exit code of a batch: that of the patient that ended worst.
int exit_code_of(const Json& batch);

}  // namespace wireplan::pipeline
