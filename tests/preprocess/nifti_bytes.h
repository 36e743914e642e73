#pragma once
/// NIfTI files made in code.
#include <array>
#include <cstdint>
#include <cstring>
#include <string>

namespace wireplan::preprocess {

struct NiftiHeader {
  std::array<std::int16_t, 8> dim = {3, 2, 3, 4, 1, 1, 1, 1};
  float slope = 0.0F, intercept = 0.0F;
  char units = 2;                              // millimetres
  std::array<std::int16_t, 2> codes = {0, 1};  // of qform and sform: scanner coordinates
  std::array<float, 6> quaternion = {};        // b, c, d and the offset of the qform
  // rows of the affine, voxel -> RAS: x decreases along i
  std::array<float, 12> rows = {-2, 0, 0, 70, 0, 3, 0, -40, 0, 0, 4, 500};
  std::array<float, 3> sides = {2, 3, 4};  // pixdim
  std::string extensions = {};             // between header and voxels
};

/// NIfTI-1 of 16 bit values 0, 1, 2, ... with the affine as sform. Offsets are those of nifti1.h.
inline std::string nifti(const NiftiHeader& header) {
  std::string bytes(352, '\0');
  const auto put = [&](std::size_t at, auto value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
  };
  put(0, std::int32_t{348});
  put(40, header.dim);
  put(70, std::int16_t{4});   // datatype: 16 bit signed
  put(72, std::int16_t{16});  // bits per voxel
  put(76, std::array<float, 8>{1, header.sides[0], header.sides[1], header.sides[2], 1, 1, 1, 1});
  put(108, 352.0F + static_cast<float>(header.extensions.size()));  // where the voxels start
  put(112, header.slope);
  put(116, header.intercept);
  put(123, header.units);
  put(252, header.codes);
  put(256, header.quaternion);
  put(280, header.rows);
  put(344, std::array<char, 4>{'n', '+', '1', '\0'});
  bytes += header.extensions;
  std::int16_t count = 1;
  for (int axis = 1; axis <= header.dim[0]; ++axis) {
    count = static_cast<std::int16_t>(count * header.dim[static_cast<std::size_t>(axis)]);
  }
  for (std::int16_t value = 0; value < count; ++value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return bytes;
}

}  // namespace wireplan::preprocess
