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

/// Whether a case refuses it whatever it says: not where it has to name one of several series, of
/// which one is a volume.
bool is_refused(const Json& told);

/// What was told as lines of text, a refusal first.
std::string inspect_text(const Json& told);

}  // namespace wireplan::pipeline
