#pragma once
/// report.json (design section 6): what a run found, as plain JSON with a fixed order of keys.
/// Outside "timing" it is the same, byte for byte, for the same inputs and build.
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "pipeline/files/wire_file.h"
#include "plan/judge.h"
#include "plan/verdict.h"
#include "preprocess/surface/openings.h"

namespace wireplan::pipeline {

inline constexpr const char* kReportSchema = "wireplan.report/2";
/// The version before, which `compare`, `render` and `batch` read too.
inline constexpr const char* kOlderReportSchema = "wireplan.report/1";

/// The best so many plans are written as files for viewers too.
inline constexpr std::size_t kPlansShown = 5;

struct ReportInput {
  std::string name;                        // of the case
  std::string input_name, input_sha256;    // of the volume, surface or labels: no folder names
  std::string labels_name, labels_sha256;  // of labels beside a volume; empty where there are none
  Json parameters;                         // of the case, after defaults
  std::vector<std::string> stages;         // that were run or found, in order
  Json figures;                            // per stage name, what its figures.json holds
  plan::Study study;                       // as the trials used it
  std::vector<DeviceWire> devices;         // of its wires: how well their values are known
  plan::Plan plan;                         // what was simulated, and ...
  plan::Judgement judgement;          // ... what that is worth by the case's limits and weights
  plan::Verdict verdict;              // for who decides
  std::vector<std::string> warnings;  // besides those in the figures
  Json robustness;                    // of repeats_json.h
  Json motion;  // of motion_json.h, of the best trial of each wire; null where
                // the vessel's cross-sections do not move
  Json timing;  // all that differs between equal runs
};

Json build_report(const ReportInput& input);

/// The vessel's openings as reports and results tell them.
Json openings_json(const std::vector<preprocess::Opening>& openings);

/// Version, revision, compiler, build type and library versions of this program.
Json build_info();

/// Reads a report and sees that it has what describe_best tells. Throws Error where it has not.
Json read_report(const std::filesystem::path& path);

}  // namespace wireplan::pipeline
