#pragma once
/// What the readers see in a file or folder, without a case: for people and programs.
#include <filesystem>
#include <string>

#include "pipeline/files/json_reader.h"

namespace wireplan::pipeline {

inline constexpr const char* kInspectSchema = "wireplan.inspect/1";

/// A DICOM folder or file, a volume, a folder of labels or a surface, as
/// pipeline/schemas/inspect.schema.json has it. What a case would refuse says so under "refused".
/// Throws `Error` where nothing can be told. Nothing tells who the patient is, nor when and where
/// the images were made.
Json inspect(const std::filesystem::path& path);

/// The same as lines of text.
std::string inspect_text(const Json& told);

}  // namespace wireplan::pipeline
