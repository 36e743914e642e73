#pragma once
/// The frames of an enhanced DICOM file (PS3.3 section C.7.6.16), which lie in any order and each
/// have a place and a scale of their own; for the .cpp files here.
#include <string>
#include <vector>

#include "gdcmDataSet.h"
#include "preprocess/base.h"

namespace wireplan::preprocess {

/// What tells where an image lies (PS3.3 section C.7.6.2), for messages.
inline constexpr const char* kPositionTag = "Image Position (Patient) (0020,0032)";
inline constexpr const char* kOrientationTag = "Image Orientation (Patient) (0020,0037)";
inline constexpr const char* kSpacingTag = "Pixel Spacing (0028,0030)";

struct DicomFrame {
  std::string lacks;  // what the file does not tell of where it lies; empty where it does
  Vec3 position = Vec3::Zero();  // centre of its first pixel, LPS                        [mm]
  Vec3 right = Vec3::UnitX(), down = Vec3::UnitY();  // unit vectors of a row and a column
  double along_row = 1.0, along_column = 1.0;        // spacing of pixels                  [mm]
  double slope = 1.0, intercept = 0.0;               // stored value -> value
  std::string unit;                                  // of the value, "HU"; empty where not told
};

/// A text without the blanks and zeros that fill it up (PS3.5 section 6.2).
std::string without_padding(std::string text);

/// The text of an element; empty where there is none.
std::string dicom_text(const gdcm::DataSet& data, const gdcm::Tag& tag);

/// In the order of the file, from its functional groups; empty where it has none. Whatever GDCM
/// throws passes through.
std::vector<DicomFrame> read_dicom_frames(const gdcm::DataSet& data);

}  // namespace wireplan::preprocess
