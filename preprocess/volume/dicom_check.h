#pragma once
/// Whether a DICOM file is well formed (PS3.10 section 7, PS3.5 section 7). Distributions build
/// GDCM with its assertions on, and those end the program on a file that is not; so it is looked
/// through first.
#include <filesystem>

namespace wireplan::preprocess {

enum class DicomForm {
  kNone,     // no DICOM file: no "DICM" after the preamble
  kDamaged,  // begins as one, but an element has no sound head or reaches beyond the end
  kSound,
};

/// Walks all elements down to the last byte, those of sequences too. Of big endian and deflated
/// data sets the head of the file alone is looked at.
DicomForm check_dicom(const std::filesystem::path& path);

}  // namespace wireplan::preprocess
