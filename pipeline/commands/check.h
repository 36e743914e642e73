#pragma once
/// What can be found wrong with a case before any stage runs.
#include <string>
#include <vector>

#include "pipeline/files/case_file.h"

namespace wireplan::pipeline {

/// Reads the volume or surface and holds the case's points against it: is it an image or a sound
/// surface, do seeds and ends lie inside. Throws one `Error` with all that is wrong. Returns what
/// had to be mended, what labels give and what to mind, a sentence each.
std::vector<std::string> check_input(const Case& given);

}  // namespace wireplan::pipeline
