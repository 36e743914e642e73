#pragma once
/// The report of a case of several sections (stages/sections.h): for each target its accesses side
/// by side, best first, each with the folder that holds its own report.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"

namespace wireplan::pipeline {

inline constexpr const char* kOverviewSchema = "wireplan.overview/1";

struct SectionReport {
  std::string access, target;  // by name; the only one of a case may have none
  std::string folder;          // below that of the overview
  Json report;                 // report.json of the section
};

/// Accesses of one target are in this order: those with a safe plan first, by what share of its
/// best plan's repeats is safe, then by its score. Expects sections of one case.
Json build_overview(const std::string& name, const std::vector<SectionReport>& sections);

/// Tells the sections that have a better access of it: puts that before what else would change
/// their verdict, in the report.json, sheet.csv and report.html that lie below `output`. Expects
/// them as the stages made them.
void tell_sections(const Json& overview, const std::filesystem::path& output);

/// The same as a table: a row per section, for spreadsheets.
std::string overview_csv(const Json& overview);

/// The overview in a file; nothing where the file holds no overview.
std::optional<Json> find_overview(const std::filesystem::path& path);

/// The reports that a file stands for: of an overview its sections', else the file itself.
std::vector<std::filesystem::path> reports_in(const std::filesystem::path& file);

/// A line per target: the access to take, or that none has a safe plan.
std::string describe_overview(const Json& overview);

/// Whether every target has a safe plan, and is not told to be not feasible, from one access at
/// least.
bool serves_all_targets(const Json& overview);

}  // namespace wireplan::pipeline
