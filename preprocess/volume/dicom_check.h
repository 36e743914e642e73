#pragma once
/// Whether a DICOM file is well formed (PS3.10 section 7, PS3.5 section 7). Distributions build
/// GDCM with its assertions on, and those end the program on a file that is not; so it is looked
/// through first.
#include <cstddef>
#include <filesystem>

namespace wireplan::preprocess {

enum class DicomForm {
  kNone,     // no DICOM file
  kDamaged,  // begins as one, but an element has no sound head or reaches beyond the end
  kSound,
  kPadded,  // sound, but behind the pixels there are bytes that are no element
  kBare,    // a sound data set with pixels that lacks the head of a file, as old archives write it
};

/// Walks all elements, those of sequences too, down to the last byte or to that of the pixels. Of
/// big endian and deflated data sets the head of the file alone is looked at. `end` becomes where
/// the pixels of a padded or bare one end.
DicomForm check_dicom(const std::filesystem::path& path, std::size_t* end = nullptr);

}  // namespace wireplan::preprocess
