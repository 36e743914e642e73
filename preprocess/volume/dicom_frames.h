#pragma once
/// The frames of an enhanced DICOM file (PS3.3 section C.7.6.16), which lie in any order and each
/// have a place and a scale of their own; for the .cpp files here.
#include <string>
#include <vector>

#include "preprocess/base.h"
#include "preprocess/volume/dicom_elements.h"
#include "preprocess/volume/dicom_phases.h"

namespace wireplan::preprocess {

struct DicomFrame {
  std::size_t number = 0;  // in its file, from 0
  std::string lacks;       // what the file does not tell of where it lies; empty where it does
  WrongValue wrong;
  Vec3 position = Vec3::Zero();  // centre of its first pixel, LPS                        [mm]
  Vec3 right = Vec3::UnitX(), down = Vec3::UnitY();  // unit vectors of a row and a column
  double along_row = 1.0, along_column = 1.0;        // spacing of pixels                  [mm]
  double thickness = 0.0;                            // 0 where not told                   [mm]
  DicomScale scale;
  DicomPhase phase;
  std::string type;  // of the image, and how it was computed, parted by backslashes
};

/// What the data set of a file tells of its image, or of all its frames.
DicomFrame read_dicom_file(const gdcm::DataSet& data);

/// In the order of the file, from its functional groups and what it tells of all; empty where it
/// has none. Whatever GDCM throws passes through.
std::vector<DicomFrame> read_dicom_frames(const gdcm::DataSet& data, const DicomFrame& of_all);

}  // namespace wireplan::preprocess
