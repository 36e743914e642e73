#pragma once
/// `wireplan bench NAME`: error against run time, and stability (design section 8). Every bench
/// writes NAME.json, NAME.csv and NAME.png into its folder and prints what it found.
#include <filesystem>
#include <string>

namespace wireplan::pipeline {

struct BenchOptions {
  bool quick = false;  // a small size, under 20 s
};

/// Names: "accuracy", "stability". Returns the exit code, kDone. Throws Error for another name and
/// where a file cannot be written.
int run_bench(const std::string& name, const std::filesystem::path& folder,
              const BenchOptions& options);

}  // namespace wireplan::pipeline
