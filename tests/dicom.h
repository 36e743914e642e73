#pragma once
/// DICOM files made in code: explicit VR little endian, of a patient whose name, identity and dates
/// must turn up nowhere else.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include "preprocess/base.h"

namespace wireplan::dicom_files {

/// What identifies the patient of every file made here.
inline const std::vector<std::string> kPatient = {
    "LOVELACE", "AUGUSTA", "PATIENT-4711", "19540321", "20260115", "ACC-0815", "ANALYTICAL"};

struct DicomSlice {
  std::string series = "1.2.3.4", number = "3";
  Vec3 position = Vec3::Zero();
  Mat3 direction = Mat3::Identity();
  double slope = 1.0, intercept = 0.0;
  std::int16_t first_value = 0;  // of 3 columns x 2 rows, each voxel one more than the last
  bool compressed = false;       // run lengths
  std::string description = {};  // of the series
  std::string modality = "CT";
  /// Instead of these: columns x rows values of a slice with square pixels of 1 mm.
  int columns = 0, rows = 0;
  std::vector<std::int16_t> values = {};
};

template <typename T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// One data element, explicit VR little endian (DICOM part 5, 7.1.2).
inline void element(std::string& bytes, std::uint16_t group, std::uint16_t number,
                    const std::string& vr, std::string value) {
  if (value.size() % 2 == 1) {
    value += vr == "UI" ? '\0' : ' ';
  }
  append(bytes, group);
  append(bytes, number);
  bytes += vr;
  if (vr == "OB" || vr == "OW") {
    append(bytes, std::uint16_t{0});
    append(bytes, static_cast<std::uint32_t>(value.size()));
  } else {
    append(bytes, static_cast<std::uint16_t>(value.size()));
  }
  bytes += value;
}

inline std::string short_value(std::uint16_t value) {
  std::string bytes;
  append(bytes, value);
  return bytes;
}

inline std::string decimals(const Eigen::VectorXd& values) {
  std::ostringstream text;
  text.precision(10);  // a decimal string has at most 16 characters
  for (Eigen::Index n = 0; n < values.size(); ++n) {
    text << (n == 0 ? "" : "\\") << values[n];
  }
  return text.str();
}

/// 16 bit voxels as run lengths: high bytes, then low ones, each as one literal run (DICOM part 5,
/// annex G), in the only fragment after an empty offset table (A.4).
inline std::string compressed_pixels(const std::string& voxels) {
  const std::size_t count = voxels.size() / 2, segment = (count + 2) / 2 * 2;
  std::string fragment;
  for (const std::size_t word : {std::size_t{2}, std::size_t{64}, 64 + segment}) {
    append(fragment, static_cast<std::uint32_t>(word));
  }
  fragment.resize(64);
  for (const std::size_t byte : {1, 0}) {
    fragment += static_cast<char>(count - 1);
    for (std::size_t n = 0; n < count; ++n) {
      fragment += voxels[2 * n + byte];
    }
    fragment.resize(64 + segment * (2 - byte));
  }

  std::string bytes;
  const auto item = [&](std::uint16_t number, const std::string& value) {
    append(bytes, std::uint16_t{0xfffe});
    append(bytes, number);
    append(bytes, static_cast<std::uint32_t>(value.size()));
    bytes += value;
  };
  item(0xe000, "");
  item(0xe000, fragment);
  item(0xe0dd, "");
  return bytes;
}

inline std::string dicom(const DicomSlice& slice) {
  const bool plain = slice.values.empty();
  const std::string ct = "1.2.840.10008.5.1.4.1.1.2";
  const std::string instance = slice.series + "." + std::to_string(slice.first_value);
  std::string meta;
  element(meta, 2, 0x01, "OB", std::string("\0\1", 2));
  element(meta, 2, 0x02, "UI", ct);
  element(meta, 2, 0x03, "UI", instance);
  element(meta, 2, 0x10, "UI", slice.compressed ? "1.2.840.10008.1.2.5" : "1.2.840.10008.1.2.1");
  std::string length;
  append(length, static_cast<std::uint32_t>(meta.size()));
  std::string bytes = std::string(128, '\0') + "DICM";
  element(bytes, 2, 0x00, "UL", length);
  bytes += meta;

  Eigen::VectorXd axes(6);
  axes << slice.direction.col(0), slice.direction.col(1);
  element(bytes, 0x08, 0x16, "UI", ct);
  element(bytes, 0x08, 0x18, "UI", instance);
  element(bytes, 0x08, 0x60, "CS", slice.modality);
  element(bytes, 0x08, 0x20, "DA", "20260115");
  element(bytes, 0x08, 0x50, "SH", "ACC-0815");
  element(bytes, 0x08, 0x80, "LO", "ANALYTICAL HOSPITAL");
  if (!slice.description.empty()) element(bytes, 0x08, 0x103e, "LO", slice.description);
  element(bytes, 0x10, 0x10, "PN", "LOVELACE^AUGUSTA");
  element(bytes, 0x10, 0x20, "LO", "PATIENT-4711");
  element(bytes, 0x10, 0x30, "DA", "19540321");
  element(bytes, 0x20, 0x0d, "UI", "1.2.3");
  element(bytes, 0x20, 0x0e, "UI", slice.series);
  element(bytes, 0x20, 0x11, "IS", slice.number);
  element(bytes, 0x20, 0x32, "DS", decimals(slice.position));
  element(bytes, 0x20, 0x37, "DS", decimals(axes));
  element(bytes, 0x28, 0x02, "US", short_value(1));
  element(bytes, 0x28, 0x04, "CS", "MONOCHROME2");
  element(bytes, 0x28, 0x10, "US", short_value(plain ? 2 : static_cast<std::uint16_t>(slice.rows)));
  element(bytes, 0x28, 0x11, "US",
          short_value(plain ? 3 : static_cast<std::uint16_t>(slice.columns)));
  element(bytes, 0x28, 0x30, "DS",
          plain ? "0.8\\0.6" : "1\\1");  // between rows, then between columns
  element(bytes, 0x28, 0x100, "US", short_value(16));
  element(bytes, 0x28, 0x101, "US", short_value(16));
  element(bytes, 0x28, 0x102, "US", short_value(15));
  element(bytes, 0x28, 0x103, "US", short_value(1));
  element(bytes, 0x28, 0x1052, "DS", decimals(Eigen::VectorXd::Constant(1, slice.intercept)));
  element(bytes, 0x28, 0x1053, "DS", decimals(Eigen::VectorXd::Constant(1, slice.slope)));
  std::string voxels;
  for (std::int16_t n = 0; plain && n < 6; ++n) {
    append(voxels, static_cast<std::int16_t>(slice.first_value + n));
  }
  for (const std::int16_t value : slice.values) {
    append(voxels, value);
  }
  if (slice.compressed) {
    element(bytes, 0x7fe0, 0x10, "OB", "");
    bytes.replace(bytes.size() - 4, 4, "\xff\xff\xff\xff");  // length: up to the end mark
    return bytes + compressed_pixels(voxels);
  }
  element(bytes, 0x7fe0, 0x10, "OW", voxels);
  return bytes;
}

}  // namespace wireplan::dicom_files
