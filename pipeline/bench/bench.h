#pragma once
/// `wireplan bench NAME`: error against run time, stability, throughput, the cost of the
/// preprocessing, how well patients are segmented (design section 8), wires that were measured,
/// whether stated errors cover, and whether the search for scripts finds what an exhaustive one
/// does. Every bench writes NAME.json, NAME.csv and NAME.png into its folder and prints what it
/// found.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace wireplan::pipeline {

struct BenchOptions {
  bool quick = false;  // a small size, under 20 s
  /// Truth and scripts: cases (truth, empty: all that come with the program, but for those whose
  /// data is not here; of the quick size none), and of truth how many trials of each (0: 12).
  std::vector<std::string> cases = {};
  int trials = 0;
  /// Throughput: a case whose vessel takes the place of the one made in code, with values of it to
  /// change ("surface.edge_length_mm=2"), and the store of its stages; empty: the default.
  std::string case_path = {};
  std::vector<std::string> overrides = {};  // of scripts' cases too
  std::filesystem::path cache = {};         // of truth and scripts too
  /// Of throughput, which rows: some of "vessel", "s-tube", "paper", "moving", "coaxial"; empty:
  /// all.
  std::vector<std::string> rows = {};
  /// Segmentation alone: how many patients are drawn (0: 100, or 2 of the quick size), from which
  /// seed on, and the folder of real cases with labels (empty: what WIREPLAN_DATA names, if that).
  int patients = 0;
  std::uint64_t first_seed = 1;
  std::filesystem::path data = {};
  /// Measured alone: the folder with frames.json and phantom.stl; empty: guide3d beside the data
  /// that WIREPLAN_DATA names, and nothing is run where that is not there.
  std::filesystem::path measured = {};
};

/// Names: "accuracy", "stability", "throughput", "preprocess", "segmentation", "measured", "truth",
/// "scripts".
/// Throws Error for another name and where a file cannot be written.
void run_bench(const std::string& name, const std::filesystem::path& folder,
               const BenchOptions& options);

}  // namespace wireplan::pipeline
