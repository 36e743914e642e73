#pragma once
/// CT in: every file convention (DICOM folder, NIfTI, NRRD, MetaImage) becomes values in HU on a
/// grid placed in patient LPS mm. The only place where ITK's image readers are used.
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "preprocess/base.h"

namespace wireplan::preprocess {

/// Where the voxels of a grid lie: p_lps = origin + direction * diag(spacing) * p_ijk.
struct Grid {
  std::array<int, 3> size = {0, 0, 0};  // voxels along i, j, k; i runs fastest
  Vec3 spacing = Vec3::Ones();          // [mm]
  Vec3 origin = Vec3::Zero();           // centre of voxel (0, 0, 0)                     [mm]
  Mat3 direction = Mat3::Identity();  // columns: unit vectors of i, j, k in LPS; may be left-handed

  std::size_t voxels() const {
    return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
           static_cast<std::size_t>(size[2]);
  }
  std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(size[0]) *
               (static_cast<std::size_t>(j) +
                static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(k));
  }
  Vec3 lps_from_ijk(const Vec3& p_ijk) const {
    return origin + direction * spacing.cwiseProduct(p_ijk);
  }
  Vec3 ijk_from_lps(const Vec3& p_lps) const {  // direction is orthonormal
    return (direction.transpose() * (p_lps - origin)).cwiseQuotient(spacing);
  }
};

struct Image {
  Grid grid;
  std::vector<float> values;  // HU (or plain intensity where the file has no HU), grid.index order
  std::string modality = {};  // "CT", "MR", ...: what made it; empty where the file does not tell
  std::string unit = {};      // of the values, by a DICOM file's rescale type; empty the same
  std::vector<std::string> remarks = {};  // what a person should know of how it was read
};

struct Mask {
  Grid grid;
  std::vector<std::uint8_t> labels;  // 1 inside the lumen, 0 elsewhere
};

/// Whether this build has the readers; without ITK the functions below throw `Error`
/// (no_imaging.cpp).
bool reads_volumes();

/// Reads a folder of DICOM files (one series, sorted by position), an enhanced DICOM file, .nii,
/// .nii.gz, .nrrd, .nhdr, .mha or .mhd, with the header's direction, spacing, slope and intercept
/// honoured. One value per voxel, one volume (4D with a single volume is fine). Of several DICOM
/// series that of this number, description or key is read; without either the one that alone has a
/// volume's shape. Throws `Error` for a missing file, one that is no image or cut short, values
/// that are not finite, a sheared grid, and a folder with several volumes (listed with number,
/// description, slices and spacing), missing or uneven slices (with the place), slices of one
/// place, or a tilted gantry (with the angle). Messages never quote a patient's data.
Image read_image(const std::filesystem::path& path, const std::string& series = "");

/// Writes NRRD (space LPS, gzip) of 16 bit integers, values rounded and kept in -32768..32767. The
/// bytes depend on grid and values alone, and the name's extension does not matter.
void write_image(const Image& image, const std::filesystem::path& path);

/// The same for a mask, 8 bit, and back.
void write_mask(const Mask& mask, const std::filesystem::path& path);
Mask read_mask(const std::filesystem::path& path);

}  // namespace wireplan::preprocess
