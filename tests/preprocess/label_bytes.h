#pragma once
/// Files of labels made in code: NIfTI, NRRD with 3D Slicer's segments, MetaImage.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// NIfTI-1 of 8 bit labels, or of 32 bit floats, placed by its sform. Offsets are those of
/// nifti1.h; its frame is RAS, ours LPS.
template <typename Value>
std::string label_nifti(const Grid& grid, const std::vector<Value>& values) {
  static_assert(sizeof(Value) == 1 || sizeof(Value) == 4);
  std::string bytes(352, '\0');
  const auto put = [&](std::size_t at, auto value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
  };
  put(0, std::int32_t{348});
  put(40, std::array<std::int16_t, 8>{3, static_cast<std::int16_t>(grid.size[0]),
                                      static_cast<std::int16_t>(grid.size[1]),
                                      static_cast<std::int16_t>(grid.size[2]), 1, 1, 1, 1});
  put(70, std::int16_t{sizeof(Value) == 1 ? 2 : 16});
  put(72, std::int16_t{8 * sizeof(Value)});
  std::array<float, 8> sides = {1, 0, 0, 0, 1, 1, 1, 1};
  for (std::size_t a = 0; a < 3; ++a)
    sides[a + 1] = static_cast<float>(grid.spacing[static_cast<Eigen::Index>(a)]);
  put(76, sides);
  put(108, 352.0F);
  put(123, char{2});
  put(252, std::array<std::int16_t, 2>{0, 1});
  std::array<float, 12> rows{};
  for (Eigen::Index r = 0; r < 3; ++r) {
    const double sign = r < 2 ? -1.0 : 1.0;
    for (Eigen::Index c = 0; c < 3; ++c) {
      rows[static_cast<std::size_t>(4 * r + c)] =
          static_cast<float>(sign * grid.direction(r, c) * grid.spacing[c]);
    }
    rows[static_cast<std::size_t>(4 * r + 3)] = static_cast<float>(sign * grid.origin[r]);
  }
  put(280, rows);
  put(344, std::array<char, 4>{'n', '+', '1', '\0'});
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
  return bytes;
}

/// One segment of a .seg.nrrd.
struct SegmentText {
  std::string name;
  int value = 1, layer = 0;
};

/// NRRD of 8 bit labels as 3D Slicer writes segmentations; several layers stand first, as a list.
inline std::string label_nrrd(const Grid& grid,
                              const std::vector<std::vector<std::uint8_t>>& layers,
                              const std::vector<SegmentText>& segments) {
  std::ostringstream text;
  text.precision(17);
  const bool several = layers.size() > 1;
  text << "NRRD0004\ntype: unsigned char\ndimension: " << (several ? 4 : 3)
       << "\nspace: left-posterior-superior\nsizes:";
  if (several) text << " " << layers.size();
  for (const int side : grid.size) text << " " << side;
  text << "\nspace directions:" << (several ? " none" : "");
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Vec3 step = grid.spacing[axis] * grid.direction.col(axis);
    text << " (" << step.x() << "," << step.y() << "," << step.z() << ")";
  }
  text << "\nkinds:" << (several ? " list" : "") << " domain domain domain\nencoding: raw\n"
       << "space origin: (" << grid.origin.x() << "," << grid.origin.y() << "," << grid.origin.z()
       << ")\n";
  for (std::size_t k = 0; k < segments.size(); ++k) {
    const std::string start = "Segment" + std::to_string(k) + "_";
    text << start << "LabelValue:=" << segments[k].value << "\n"
         << start << "Layer:=" << segments[k].layer << "\n"
         << start << "Name:=" << segments[k].name << "\n";
  }
  text << "\n";
  std::string bytes = text.str();
  for (std::size_t n = 0; n < grid.voxels(); ++n) {
    for (const auto& layer : layers) bytes += static_cast<char>(layer[n]);
  }
  return bytes;
}

/// MetaImage of 8 bit labels.
inline std::string label_mha(const Grid& grid, const std::vector<std::uint8_t>& values) {
  std::ostringstream text;
  text.precision(17);
  text << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
       << "CompressedData = False\nTransformMatrix =";
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (Eigen::Index row = 0; row < 3; ++row) text << " " << grid.direction(row, axis);
  }
  text << "\nOffset = " << grid.origin.x() << " " << grid.origin.y() << " " << grid.origin.z()
       << "\nElementSpacing = " << grid.spacing.x() << " " << grid.spacing.y() << " "
       << grid.spacing.z() << "\nDimSize = " << grid.size[0] << " " << grid.size[1] << " "
       << grid.size[2] << "\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
  return text.str() + std::string(values.begin(), values.end());
}

/// A trunk along z round (12, 12), from it a branch along x at z = 30, 1 mm voxels from (0, 0, 0).
/// The trunk's wall is at x = 16.5, the branch goes to 39.5 and has a radius of 2.5 mm.
inline std::string branched_labels() {
  const Grid grid{.size = {42, 24, 60}, .spacing = Vec3::Ones()};
  std::vector<std::uint8_t> values;
  for (int k = 0; k < 60; ++k) {
    for (int j = 0; j < 24; ++j) {
      for (int i = 0; i < 42; ++i) {
        const bool trunk = std::hypot(i - 12.0, j - 12.0) < 4.6;
        const bool branch = i > 12 && i < 40 && std::hypot(j - 12.0, k - 30.0) < 2.6;
        values.push_back(trunk ? 1 : branch ? 2 : 0);
      }
    }
  }
  return label_nifti(grid, values);
}

}  // namespace wireplan::preprocess
