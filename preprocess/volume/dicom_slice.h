#pragma once
/// One file of a DICOM series; for the .cpp files here.
#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <filesystem>
#include <string>
#include <vector>

#include "itkGDCMImageIO.h"
#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/dicom_frames.h"
#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

struct Slice {
  std::filesystem::path file;
  DicomLook look;
  itk::GDCMImageIO::Pointer io;    // header read; null where GDCM does not read the image
  DicomFrame image;                // what the file tells of all, or of its one frame
  std::vector<DicomFrame> frames;  // of an enhanced file, which has groups of them; once a part is
                                   // chosen, those of it
  std::string refused;             // why it is no slice of a volume; empty where it can be one
  std::string series_uid, instance_uid;  // to compare with, never shown
  std::string series_number;             // to compare with
  std::string shown_number;              // nothing where it may be a date
  std::string description, modality;
  bool localizer = false;  // by its image type
  bool aside = false;      // a dose, a segmentation or a projection: passed over beside a scan
  Grid grid;
};

/// Reads the header of `slice.file`, which looks as `slice.look` says; false where it holds no
/// image, as a DICOMDIR or a report. An image that cannot be read, or does not tell where it lies,
/// is told in `refused`, since it may be of another series than the one that is wanted. Throws
/// `Error` for an image without pixels.
bool read_slice_header(Slice& slice);

/// Reads the pixels of a slice, or of all its frames, and appends their values, each frame's by its
/// own scale.
void append_slice(const Slice& slice, const std::filesystem::path& folder,
                  std::vector<float>& values);

/// How the pixels of a file are packed.
struct Packing {
  std::string name, uid;
  bool packed = false;
};
Packing packing_of(const Slice& slice);

}  // namespace wireplan::preprocess
