#include "preprocess/volume/image.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <system_error>

#include "gdcmTrace.h"
#include "itkNrrdImageIO.h"
#include "preprocess/volume/dicom_series.h"
#include "preprocess/volume/volume_file.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

void require_finite(const Image& image, const fs::path& path) {
  const auto bad = std::count_if(image.values.begin(), image.values.end(),
                                 [](float v) { return !std::isfinite(v); });
  if (bad > 0) {
    throw Error(path.string() + ": " + std::to_string(bad) +
                " voxels are not finite numbers; replace them, in a CT by -1024, in labels by 0");
  }
}

void write_nrrd(const Grid& grid, const void* voxels, itk::IOComponentEnum type,
                const fs::path& path) {
  const auto io = itk::NrrdImageIO::New();
  itk::ImageIORegion region(3);
  io->SetNumberOfDimensions(3);
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto size = static_cast<itk::SizeValueType>(grid.size[axis]);
    const Vec3 column = grid.direction.col(axis);
    io->SetDimensions(axis, size);
    io->SetSpacing(axis, grid.spacing[axis]);
    io->SetOrigin(axis, grid.origin[axis]);
    io->SetDirection(axis, std::vector<double>(column.begin(), column.end()));
    region.SetIndex(axis, 0);
    region.SetSize(axis, size);
  }
  io->SetIORegion(region);
  io->SetComponentType(type);
  io->SetPixelType(itk::IOPixelEnum::SCALAR);
  io->SetNumberOfComponents(1);
  io->SetFileType(itk::IOFileEnum::Binary);
  io->SetUseCompression(true);
  io->SetFileName(path.string());
  try {
    io->Write(voxels);
  } catch (const std::exception&) {
    throw DiskError(
        path.string() +
        ": cannot be written; check that the folder exists, may be written and has room");
  }
}

}  // namespace

bool reads_volumes() { return true; }

void silence_libraries() {
  itk::Object::GlobalWarningDisplayOff();
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
}

Image read_told(const fs::path& path, const std::string& series, VolumeHeader& told) {
  std::error_code unknown;
  if (!fs::exists(path, unknown)) {
    throw Error(path.string() + ": no such file or folder; " + kFormats);
  }
  silence_libraries();
  Image image;
  if (fs::is_directory(path, unknown)) {
    told.format = "DICOM";
    image = call_itk(path, damaged("DICOM"), [&] { return read_dicom(path, series); });
  } else {
    image = read_file(path, series, told);
  }
  require_finite(image, path);
  return image;
}

Image read_image(const fs::path& path, const std::string& series) {
  VolumeHeader told;
  return read_told(path, series, told);
}

void write_image(const Image& image, const fs::path& path) {
  expects(image.values.size() == image.grid.voxels());
  std::vector<std::int16_t> rounded(image.values.size());
  std::transform(image.values.begin(), image.values.end(), rounded.begin(), [](float value) {
    using Limits = std::numeric_limits<std::int16_t>;
    return static_cast<std::int16_t>(
        std::clamp(std::round(value), float{Limits::min()}, float{Limits::max()}));
  });
  write_nrrd(image.grid, rounded.data(), itk::IOComponentEnum::SHORT, path);
}

void write_mask(const Mask& mask, const fs::path& path) {
  expects(mask.labels.size() == mask.grid.voxels());
  write_nrrd(mask.grid, mask.labels.data(), itk::IOComponentEnum::UCHAR, path);
}

Mask read_mask(const fs::path& path) {
  if (!fs::is_regular_file(path)) {
    throw Error(path.string() + ": no such file, expected a mask (8 bit image of 0 and 1)");
  }
  silence_libraries();
  VolumeHeader told;
  const Image image = read_file(path, "", told);
  const bool is_mask = std::all_of(image.values.begin(), image.values.end(),
                                   [](float value) { return value == 0.0F || value == 1.0F; });
  if (!is_mask) throw Error(path.string() + ": not a mask, expected an image of 0 and 1");
  return {image.grid, {image.values.begin(), image.values.end()}};
}

}  // namespace wireplan::preprocess
