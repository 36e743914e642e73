#pragma once
/// What the readers see of a file or a folder of volumes, as far as they come, for people who ask
/// what it is. Nothing that tells who the patient is, when and where the images were made.
#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

/// A segment as the header of 3D Slicer's .seg.nrrd names it.
struct NamedSegment {
  int value = 0, layer = 0;
  std::string name;
};

/// The header of NIfTI, NRRD or MetaImage. A reader fills it in as it goes, and may refuse the file
/// after that.
struct VolumeHeader {
  std::string format;                   // "NIfTI-1"; empty where it is none of them
  std::string stored_as;                // "int16", as the format calls it
  std::string length_unit;              // as the file tells it; empty where it does not
  double mm_per_unit = 1.0;             // what is made of that
  std::string placed_by;                // "sform", "qform": which of its transforms counts
  std::array<int, 3> size = {0, 0, 0};  // 0 where the header was not read so far
  Vec3 spacing = Vec3::Zero();          //                                                 [mm]
  std::vector<NamedSegment> segments;
  std::map<int, std::string> label_names;  // of values, of a NIfTI
};

/// Images of a DICOM folder that can be slices of one volume.
struct SeriesDescription {
  std::string number;  // empty where it may be a date, or holds what the description may not
  std::string key;     // "#1f3a90c2", by which a case can name it too
  std::string modality;
  std::string description;  // empty where it holds a name, number or date of the patient's tags
  std::string unit;         // of the values, by the rescale type; empty where not told
  std::string syntax, syntax_uid;  // how the first file's pixels are packed
  int files = 0, images = 0;       // as many images, but in files of several frames
  bool placed = false;             // whether the places of its images are known
  bool spaced = false;             // whether the size of their pixels is
  Grid grid;                       // of them all, where they are; else of the first
  std::string problem;             // why they form no volume; empty where they do
  bool read = false;               // whether it is the one that read_image reads
};

struct LabelDescription {
  int value = 0;
  std::string name;  // empty where the file tells none
  std::size_t voxels = 0;
};

/// Behind their number, where a folder is refused as long as none of its series is named.
inline constexpr const char* kSeveralSeries = " DICOM series, expected one";

struct VolumeDescription {
  VolumeHeader header;                    // of a file; format "DICOM" alone of a folder
  std::vector<SeriesDescription> series;  // of a DICOM folder or file
  std::string modality;                   // where the file tells it
  std::optional<Grid> grid;               // where the volume was read
  double least = 0.0, largest = 0.0;      // of its values
  bool holds_labels = false;              // few whole numbers in patches, and not an image's values
  std::vector<LabelDescription> labels;   // by value; 0 too
  std::vector<std::string> remarks;       // what a person should know of how it was read
  std::string refused;  // why read_image refuses it, without the path; empty where it reads it
};

/// Throws `Error`, as read_image does, where not even a header can be told.
VolumeDescription describe_volume(const std::filesystem::path& path);

}  // namespace wireplan::preprocess
