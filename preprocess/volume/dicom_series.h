#pragma once
/// Folders of DICOM files; for the .cpp files here.
#include <filesystem>

#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// The one series of the folder, its slices sorted by position. Throws `Error` as read_image tells.
Image read_dicom_folder(const std::filesystem::path& folder);

}  // namespace wireplan::preprocess
