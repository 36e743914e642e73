#pragma once
/// A case of several accesses or targets: each pair is a section with a run and a report of its
/// own. The vessel is made once, and what one push can serve is pushed once.
#include <filesystem>
#include <functional>
#include <string>

#include "pipeline/stages/stages.h"

namespace wireplan::pipeline {

/// Of its results below those of the case; empty for a case of one section.
std::filesystem::path section_folder(const Case& section);

/// Makes what the sections have in common and their centerlines, then calls `act` for each section:
/// with the case for its study, and with options to run its stages by. A stage that was run and
/// told already is not told again, and one that is forced is run once. Of a case of one section
/// that is all that happens. Throws one `Error` with everything that is wrong with any section
/// before `act` is called for the first.
void for_each_section(const Case& given, const RunOptions& options,
                      const std::function<void(const Case&, const RunOptions&)>& act);

}  // namespace wireplan::pipeline
