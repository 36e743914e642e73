#pragma once
/// Volumes in one file: NIfTI, NRRD, MetaImage; for the .cpp files here.
#include <filesystem>
#include <string>
#include <vector>

#include "preprocess/volume/itk_image.h"

namespace wireplan::preprocess {

/// ITK and GDCM print warnings that may quote a header; what matters of them becomes an Error.
void silence_libraries();

/// Reads a volume by the extension of its file, after looking whether it is what it is called.
/// A `series` may be named of a DICOM file alone. What is read of its header stands in `told` then
/// too, where it is refused after that.
Image read_file(const std::filesystem::path& path, const std::string& series, VolumeHeader& told);

/// As read_image, which is this without what is told.
Image read_told(const std::filesystem::path& path, const std::string& series, VolumeHeader& told);

/// The same for labels: of an NRRD with several values per voxel, as 3D Slicer writes segments that
/// overlap, a volume for each of them.
std::vector<Image> read_layers(const std::filesystem::path& path, VolumeHeader& told);

}  // namespace wireplan::preprocess
