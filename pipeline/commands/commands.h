#pragma once
/// The command line: run, trials, report, batch, check, status, cache, wires, simulate, phantom,
/// bench (design section 3). Answers go to standard output, the log to standard error.
#include <filesystem>
#include <string>

namespace wireplan::pipeline {

/// Exit codes of the program.
inline constexpr int kDone = 0, kNoPlan = 1, kBadInput = 2, kOurFault = 3, kInterrupted = 130;

/// Does what the arguments ask. Returns kDone or kNoPlan, or kBadInput where the arguments make no
/// sense. Throws `Error` for a bad world and `Interrupted` where the user stopped it.
int run_command(int argc, const char* const* argv);

/// `wireplan run CASE` without its other options: kDone or kNoPlan.
int run_one_case(const std::filesystem::path& case_path, const std::filesystem::path& output,
                 const std::filesystem::path& cache, int threads);

struct Failure {
  int code = kOurFault;
  std::string message;
};

/// The exit code and the words for the exception being handled.
Failure describe_failure();

}  // namespace wireplan::pipeline
