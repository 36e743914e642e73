#pragma once
/// What the rows of `bench throughput` come to. For use in this folder.
#include <string>
#include <vector>

#include "pipeline/bench/bench_report.h"

namespace wireplan::pipeline {

inline constexpr const char* kSTube = "s-tube";
inline constexpr const char* kPaperTube = "paper-tube";
inline constexpr const char* kPaperArtery = "paper-artery";

/// How well the S-tube is solved: as cases are by default, and as well as the forces there need, in
/// a tube that has no ridge for points further apart to miss.
struct Care {
  double residual_tolerance;  // [N]
  double contact_spacing;     // [mm]
};
inline const std::vector<Care> kCares = {{1e-6, 1.0}, {1e-3, 6.0}};

/// All that ran; whether copies agreed; and how far apart pushes of different lengths end.
struct ThroughputResults {
  std::vector<Json> rows{};
  bool same = true;
  std::vector<Json> s_tube{};
};

/// What is asked of wireplan, beside what these rows say.
std::vector<Json> list_throughput_aims(const ThroughputResults& results);

/// Against run time: error of the tip, in this vessel, in the S-tube and in the paper's scenes; of
/// a vessel that moves its largest shift, and of coaxial manoeuvres their energy out of balance.
/// What there are rows of.
Picture plot_throughput(const std::vector<Json>& rows, const std::vector<Json>& moving,
                        const std::vector<Json>& coaxial, const std::string& surface);

/// Scenes and columns; `length` of an insertion, `finest` elements that errors count from [mm].
Json describe_throughput(const std::string& surface, double length, double finest);

/// A row of insertions or of a coaxial manoeuvre on one line, for who waits.
std::string line_of(const Json& row);

/// The columns that fit a terminal.
std::vector<Json> shorten_throughput(const std::vector<Json>& rows);

}  // namespace wireplan::pipeline
