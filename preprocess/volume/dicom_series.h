#pragma once
/// Folders of DICOM files, and enhanced files; for the .cpp files here.
#include <filesystem>
#include <vector>

#include "preprocess/volume/describe.h"

namespace wireplan::preprocess {

/// The one series of the folder, or that of this number, description or key, its slices sorted by
/// position; or the frames of the one file that has several. Throws `Error` as read_image tells.
Image read_dicom(const std::filesystem::path& path, const std::string& series);

/// All series of the folder, or of the one DICOM file, up to a file that is damaged.
std::vector<SeriesDescription> describe_dicom(const std::filesystem::path& path);

}  // namespace wireplan::preprocess
