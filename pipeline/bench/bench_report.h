#pragma once
/// What a bench hands to run_bench, which prints and writes it. For use in this folder.
#include <optional>
#include <string>
#include <vector>

#include "pipeline/bench/bench.h"
#include "pipeline/files/json_reader.h"
#include "pipeline/report/canvas.h"
#include "preprocess/vessel.h"

namespace wireplan::pipeline {

inline constexpr const char* kBenchSchema = "wireplan.bench/1";

/// A vessel that was benched, written to NAME.vtp.
struct BenchSurface {
  std::string name;
  Surface surface;
};

/// A picture of its own, written to NAME.png.
struct BenchPicture {
  std::string name;
  Picture picture;
};

struct BenchReport {
  Json description;        // scenes, methods, what the columns mean: the same on every machine
  std::vector<Json> rows;  // plain objects with the same keys in the same order; none: nothing was
                           // run, the text says why, and nothing is written
  Json results;            // what the rows come to
  std::string text;        // for standard output
  Picture plot;
  std::vector<BenchSurface> surfaces = {};
  std::vector<BenchPicture> pictures = {};
};

BenchReport bench_accuracy(const BenchOptions& options);
BenchReport bench_stability(const BenchOptions& options);
BenchReport bench_throughput(const BenchOptions& options);
BenchReport bench_preprocess(const BenchOptions& options);
BenchReport bench_segmentation(const BenchOptions& options);
BenchReport bench_measured(const BenchOptions& options);
BenchReport bench_truth(const BenchOptions& options);
BenchReport bench_scripts(const BenchOptions& options);

/// Rows as a table for people: columns aligned, numbers with 4 digits.
std::string table_text(const std::vector<Json>& rows);

/// A row of a table of aims in words, beside what was found (null: unknown).
Json aim_row(const std::string& what, const std::string& aim, const Json& found);

/// An aim beside what was found (null: unknown), "met" or not; and a list of these as lines.
Json aim_entry(const char* what, double aim, bool at_least, const Json& found);
std::string aims_text(const Json& aims);

}  // namespace wireplan::pipeline
