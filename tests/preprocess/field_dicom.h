#pragma once
/// DICOM files as scanners and archives write them, changed element by element.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/image.h"
#include "tests/dicom.h"
#include "tests/preprocess/image_file.h"

namespace wireplan::preprocess {

using dicom_files::dicom;
using dicom_files::DicomSlice;
using dicom_files::element;

class FieldDicom : public ImageFile {
 protected:
  using Change = std::function<std::string(const std::string& bytes, int k)>;

  /// Eight slices 1.5 mm apart, each changed, of values 10 k, 10 k + 1, ... in slice k.
  void write_slices(const Change& change, DicomSlice slice = {}, int count = 8) const {
    for (int k = 0; k < count; ++k) {
      slice.position.z() = 1.5 * k;
      slice.first_value = static_cast<std::int16_t>(10 * k);
      write(slice.number + "_" + std::to_string(k), change(dicom(slice), k));
    }
  }

  void expect_whole(const std::string& series = "") const {
    const Image image = read_image(folder_, series);
    ASSERT_EQ(image.grid.size, (std::array<int, 3>{3, 2, 8}));
    for (std::size_t k = 0; k < 8; ++k) {
      for (std::size_t n = 0; n < 6; ++n) {
        EXPECT_EQ(image.values[6 * k + n], static_cast<float>(10 * k + n));
      }
    }
  }
};

/// A sequence of items, each of whose elements are given as bytes.
inline std::string sequence(std::uint16_t group, std::uint16_t number,
                            const std::vector<std::string>& items) {
  std::string inside;
  for (const std::string& item : items) {
    dicom_files::append(inside, std::uint16_t{0xfffe});
    dicom_files::append(inside, std::uint16_t{0xe000});
    dicom_files::append(inside, static_cast<std::uint32_t>(item.size()));
    inside += item;
  }
  std::string bytes;
  dicom_files::append(bytes, group);
  dicom_files::append(bytes, number);
  bytes += "SQ";
  dicom_files::append(bytes, std::uint16_t{0});
  dicom_files::append(bytes, static_cast<std::uint32_t>(inside.size()));
  return bytes + inside;
}

inline std::string of(std::uint16_t group, std::uint16_t number, const std::string& vr,
                      const std::string& value) {
  std::string bytes;
  element(bytes, group, number, vr, value);
  return bytes;
}

struct Frame {
  double place = 0.0;  // along z                                                          [mm]
  std::string slope = "1", intercept = "0";  // none where empty
  std::string unit = "HU";
  std::string more = {};  // functional groups
};

/// An enhanced CT of frames of 3 x 2 pixels, of values 10 k, 10 k + 1, ... in frame k.
inline std::string enhanced(const std::vector<Frame>& frames, bool placed = true,
                            const std::string& spacing = "0.8\\0.6") {
  const std::string ct = "1.2.840.10008.5.1.4.1.1.2.1";
  std::string meta = of(2, 0x01, "OB", std::string("\0\1", 2)) + of(2, 0x02, "UI", ct) +
                     of(2, 0x03, "UI", "1.2.3.9") + of(2, 0x10, "UI", "1.2.840.10008.1.2.1");
  std::string length;
  dicom_files::append(length, static_cast<std::uint32_t>(meta.size()));
  std::string voxels;
  std::vector<std::string> groups;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const Frame& frame = frames[k];
    std::string group;
    if (placed) {
      group +=
          sequence(0x20, 0x9113,
                   {of(0x20, 0x32, "DS", "5\\6\\" + std::to_string(frame.place).substr(0, 6))});
    }
    if (!frame.slope.empty()) {
      group += sequence(0x28, 0x9145,
                        {of(0x28, 0x1052, "DS", frame.intercept) +
                         of(0x28, 0x1053, "DS", frame.slope) + of(0x28, 0x1054, "LO", frame.unit)});
    }
    groups.push_back(frame.more + group);
    for (int n = 0; n < 6; ++n) {
      dicom_files::append(voxels, static_cast<std::int16_t>(10 * static_cast<int>(k) + n));
    }
  }
  const std::string shared =
      sequence(0x20, 0x9116, {of(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0")}) +
      sequence(0x28, 0x9110, {of(0x18, 0x50, "DS", "4") + of(0x28, 0x30, "DS", spacing)});
  using dicom_files::short_value;
  return std::string(128, '\0') + "DICM" + of(2, 0, "UL", length) + meta +
         of(0x08, 0x16, "UI", ct) + of(0x08, 0x18, "UI", "1.2.3.9") + of(0x08, 0x60, "CS", "CT") +
         of(0x20, 0x0d, "UI", "1.2.3") + of(0x20, 0x0e, "UI", "1.2.4") + of(0x20, 0x11, "IS", "7") +
         of(0x28, 0x02, "US", short_value(1)) + of(0x28, 0x04, "CS", "MONOCHROME2") +
         of(0x28, 0x08, "IS", std::to_string(frames.size())) +
         of(0x28, 0x10, "US", short_value(2)) + of(0x28, 0x11, "US", short_value(3)) +
         of(0x28, 0x100, "US", short_value(16)) + of(0x28, 0x101, "US", short_value(16)) +
         of(0x28, 0x102, "US", short_value(15)) + of(0x28, 0x103, "US", short_value(1)) +
         sequence(0x5200, 0x9229, {shared}) + sequence(0x5200, 0x9230, groups) +
         of(0x7fe0, 0x10, "OW", voxels);
}

/// Where the data set begins: dicom() writes its SOP class first.
inline std::size_t data_set_of(const std::string& bytes) {
  const std::size_t at = bytes.find(std::string("\x08\0\x16\0UI", 6));
  EXPECT_NE(at, std::string::npos);
  return at;
}

struct Element {
  std::uint16_t group = 0, number = 0;
  std::string vr = {}, value = {};
  std::size_t at = 0, end = 0;  // of the file
};

/// The elements of a data set without sequences, in their order.
inline std::vector<Element> elements_of(const std::string& bytes) {
  std::vector<Element> elements;
  const auto read = [&](std::size_t at, auto number) {
    std::memcpy(&number, bytes.data() + at, sizeof number);
    return number;
  };
  for (std::size_t at = data_set_of(bytes); at < bytes.size();) {
    Element one{.group = read(at, std::uint16_t{}),
                .number = read(at + 2, std::uint16_t{}),
                .vr = bytes.substr(at + 4, 2),
                .at = at};
    const bool is_long = one.vr == "OB" || one.vr == "OW";
    const std::size_t size =
        is_long ? read(at + 8, std::uint32_t{}) : read(at + 6, std::uint16_t{});
    const std::size_t start = at + (is_long ? 12 : 8);
    one.value = bytes.substr(start, size);
    at = one.end = start + size;
    elements.push_back(one);
  }
  return elements;
}

/// The same file with an element in the place of its own, or without it where there is no value.
inline std::string with_element(const std::string& bytes, std::uint16_t group, std::uint16_t number,
                                const std::string& vr, const std::optional<std::string>& value) {
  for (const Element& one : elements_of(bytes)) {
    if (std::pair(one.group, one.number) < std::pair(group, number)) continue;
    const bool same = one.group == group && one.number == number;
    return bytes.substr(0, one.at) + (value ? of(group, number, vr, *value) : "") +
           bytes.substr(same ? one.end : one.at);
  }
  ADD_FAILURE() << "no place";
  return bytes;
}

}  // namespace wireplan::preprocess
