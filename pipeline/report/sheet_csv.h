#pragma once
/// The figures of the page's first sheet as a table.
#include <string>

#include "pipeline/files/json_reader.h"

namespace wireplan::pipeline {

/// A row per figure: section, quantity, value, unit, what it is held against, note (RFC 4180). What
/// a report does not have is left out.
std::string sheet_csv(const Json& report);

}  // namespace wireplan::pipeline
