#pragma once
/// SHA-256 of contents, as 64 lower-case hexadecimal digits.
#include <filesystem>
#include <string>
#include <string_view>

namespace wireplan::pipeline {

std::string hash_text(std::string_view text);

/// Reads the file piece by piece. Throws `Error` where it is missing or cannot be read.
std::string hash_file(const std::filesystem::path& file);

/// A file, with the one beside it that holds the voxels of its header (MetaImage, NRRD); or a
/// folder with everything below it (a DICOM series): then the hash of the lines "relative name,
/// size, SHA-256" in order of the names, so that moving the folder changes nothing and renaming,
/// adding or changing a file does. Throws `Error` where one cannot be read.
std::string hash_input(const std::filesystem::path& path);

/// Name, size, inode and times of the file and its voxels, or of each below the folder: what
/// differs where one was changed or replaced meanwhile.
std::string input_stamp(const std::filesystem::path& path);

}  // namespace wireplan::pipeline
