#pragma once
/// Volumes in one file: NIfTI, NRRD, MetaImage; for the .cpp files here.
#include <filesystem>
#include <string>

#include "preprocess/volume/itk_image.h"

namespace wireplan::preprocess {

struct FileFormat {
  std::string name;
  itk::ImageIOBase::Pointer io;  // none: no known extension
};

/// Opens a file by its extension and reads the header; checks that it is what it is called.
FileFormat open_file(const std::filesystem::path& path);

/// Reads header and voxels of a file that holds the whole volume.
Image read_volume(itk::ImageIOBase& io, const std::filesystem::path& path);

}  // namespace wireplan::preprocess
