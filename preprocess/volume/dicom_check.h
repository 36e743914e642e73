#pragma once
/// Whether a DICOM file is well formed (PS3.10 section 7, PS3.5 section 7). Distributions build
/// GDCM with its assertions on, and those end the program on a file that is not; so it is looked
/// through first.
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace wireplan::preprocess {

enum class DicomForm {
  kNone,     // no DICOM file
  kDamaged,  // begins as one, but an element has no sound head or reaches beyond the end
  kSound,
  kPadded,  // sound, but behind the pixels there are bytes that are no element
  kBare,    // sound, but without what GDCM looks for first: preamble, "DICM", transfer syntax
};

/// Bytes that stand in the place of others, so that a library reads what is meant.
struct DicomPatch {
  std::size_t at = 0;
  std::string bytes;
};

/// What a walk through all elements, those of sequences too, finds.
struct DicomLook {
  DicomForm form = DicomForm::kNone;
  std::string syntax;  // UID of its transfer syntax; empty where the file does not tell
  bool explicit_vr = true;
  bool followed = true;             // false: of an unknown syntax, in which elements are not found
  bool pixels = false;              // whether it has some of its own; true where it may have
  std::string sop_class;            // UID of what it is; empty where the file does not tell
  bool image = false;               // whether it says that it is one, with pixels or without
  std::size_t begin = 0, end = 0;   // of the data set, up to its pixels' end
  std::vector<DicomPatch> patches;  // of an otherwise sound file
};

/// Walks down to the last byte or to that of the pixels. Of deflated data sets the head of the file
/// alone is looked at, and of those in a syntax that GDCM does not know as far as it can be.
/// Patches are for private elements of representations that the standard lacks ("??", blanks,
/// zeros), as old scanners write them, and for MONOCHROME1, at which ITK turns the values upside
/// down although it tells how they are shown alone (PS3.3 section C.7.6.3.1.2).
DicomLook look_at_dicom(const std::filesystem::path& path);

inline constexpr const char* kSegmentation = "a DICOM segmentation (SEG)";

/// Whether labels are of this class, of voxels or of surfaces.
bool is_segmentation(const std::string& sop_class);

/// What an object is called, and whether one draws organs by it.
struct DicomKind {
  std::string name;
  bool labels = false;
};
DicomKind kind_of(const DicomLook& look);

DicomForm check_dicom(const std::filesystem::path& path);

}  // namespace wireplan::preprocess
