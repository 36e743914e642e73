#pragma once
/// What the fuzz targets of volumes expect of one that is read.
#include <algorithm>
#include <cmath>

#include "preprocess/volume/image.h"
#include "tests/fuzz/fuzz.h"

namespace wireplan::fuzz {

/// As all that follows relies on it.
inline void expect_sound(const preprocess::Grid& grid) {
  constexpr double kFarthestMm = 1e6;
  expects(*std::min_element(grid.size.begin(), grid.size.end()) >= 2);
  expects(grid.spacing.minCoeff() > 0.0 && grid.spacing.maxCoeff() <= kFarthestMm);
  expects(grid.origin.cwiseAbs().maxCoeff() <= kFarthestMm && grid.direction.allFinite());
  const Mat3 turned_back = grid.direction.transpose() * grid.direction;
  expects((turned_back - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-9);
}

inline void expect_sound(const preprocess::Image& image) {
  expect_sound(image.grid);
  expects(image.values.size() == image.grid.voxels());
  expects(std::all_of(image.values.begin(), image.values.end(),
                      [](float value) { return std::isfinite(value); }));
}

/// Voxels for headers that keep theirs in a file beside: 2 x 2 x 2 of 16 bits.
inline void write_voxels_beside() {
  static const std::filesystem::path kVoxels =
      folder().write("voxels.raw", std::string_view("\0\0d\0\310\0,\1\220\1\364\1X\2\274\2", 16));
}

/// Reads a file of that name as a volume.
inline void read_volume(const std::string& name, const std::uint8_t* data, std::size_t size) {
  write_voxels_beside();
  try {
    expect_sound(preprocess::read_image(folder().write(name, view(data, size))));
  } catch (const Error&) {
  }
}

}  // namespace wireplan::fuzz
