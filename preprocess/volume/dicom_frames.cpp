#include "preprocess/volume/dicom_frames.h"

#include <cmath>

namespace wireplan::preprocess {
namespace {

/// What of a frame's place was told so far.
struct Told {
  bool position = false, orientation = false, spacing = false;
};

void read_position(const gdcm::DataSet& data, DicomFrame& frame, Told& told) {
  const std::vector<double> at = read_numbers(data, kPosition, frame.wrong);
  if (at.size() < 3) return;
  frame.position = Vec3(at[0], at[1], at[2]);
  told.position = true;
}

void read_orientation(const gdcm::DataSet& data, DicomFrame& frame, Told& told) {
  const std::vector<double> axes = read_numbers(data, kOrientation, frame.wrong);
  if (axes.size() < 6) return;
  const Vec3 right(axes[0], axes[1], axes[2]), down(axes[3], axes[4], axes[5]);
  constexpr double kRounding = 0.01;  // of decimals
  const auto is_one = [](double length) { return std::abs(length - 1.0) <= kRounding; };
  if (!is_one(right.norm()) || !is_one(down.norm())) {
    frame.wrong.tell(kOrientation.name, dicom_text(data, kOrientation.tag()),
                     "two directions of length 1, of a row and a column");
    return;
  }
  frame.right = right.normalized();
  frame.down = down.normalized();
  told.orientation = true;
}

void read_measures(const gdcm::DataSet& data, DicomFrame& frame, Told& told) {
  WrongValue passed_over;  // images are read without a thickness
  const std::vector<double> thickness = read_numbers(data, kThickness, passed_over);
  if (!thickness.empty()) frame.thickness = thickness[0];
  // Between rows, then between columns (PS3.3 section 10.7.1.3).
  const std::vector<double> spacing = read_numbers(data, kSpacing, frame.wrong);
  if (spacing.size() < 2) return;
  frame.along_column = spacing[0];
  frame.along_row = spacing[1];
  told.spacing = true;
}

/// The type of an image or a frame, and how it was computed from a volume.
void read_type(const gdcm::DataSet& data, const gdcm::Tag& tag, DicomFrame& frame) {
  for (const gdcm::Tag& one : {tag, gdcm::Tag(0x08, 0x9207)}) {
    const std::string type = dicom_text(data, one);
    if (!type.empty()) frame.type += (frame.type.empty() ? "" : "\\") + type;
  }
}

/// What one functional group, shared or of the frame, tells.
void read_groups(const gdcm::DataSet& groups, const std::vector<gdcm::Tag>& dimensions,
                 DicomFrame& frame, Told& told) {
  using gdcm::DataSet;
  in_first_item(groups, {0x20, 0x9113},
                [&](const DataSet& one) { read_position(one, frame, told); });
  in_first_item(groups, {0x20, 0x9116},
                [&](const DataSet& one) { read_orientation(one, frame, told); });
  in_first_item(groups, {0x28, 0x9110},
                [&](const DataSet& one) { read_measures(one, frame, told); });
  in_first_item(groups, {0x28, 0x9145},
                [&](const DataSet& one) { read_scale(one, frame.scale, frame.wrong); });
  for (const gdcm::Tag& modality : {gdcm::Tag(0x18, 0x9329), gdcm::Tag(0x18, 0x9226)}) {  // CT, MR
    in_first_item(groups, modality, [&](const DataSet& one) {
      read_type(one, {0x08, 0x9007}, frame);
    });
  }
  read_phase(groups, dimensions, frame.phase);
}

void tell_lacks(const Told& told, DicomFrame& frame) {
  const auto require = [&](bool is_told, const NamedTag& what) {
    if (!is_told) frame.lacks += (frame.lacks.empty() ? "" : ", ") + std::string(what.name);
  };
  require(told.position, kPosition);
  require(told.orientation, kOrientation);
  require(told.spacing, kSpacing);
}

}  // namespace

DicomFrame read_dicom_file(const gdcm::DataSet& data) {
  DicomFrame file;
  Told told;
  read_position(data, file, told);
  read_orientation(data, file, told);
  read_measures(data, file, told);
  tell_lacks(told, file);
  read_scale(data, file.scale, file.wrong);
  read_type(data, {0x08, 0x08}, file);
  read_phase(data, {}, file.phase);
  return file;
}

std::vector<DicomFrame> read_dicom_frames(const gdcm::DataSet& data, const DicomFrame& of_all) {
  const gdcm::Tag shared(0x5200, 0x9229), each(0x5200, 0x9230);
  std::vector<DicomFrame> frames;
  if (!data.FindDataElement(each)) return frames;

  DicomFrame common = of_all;
  common.lacks.clear();  // its groups tell where a frame lies
  Told told_of_all;
  const std::vector<gdcm::Tag> dimensions = read_dimensions(data);
  in_first_item(data, shared, [&](const gdcm::DataSet& groups) {
    read_groups(groups, dimensions, common, told_of_all);
  });
  const auto items = data.GetDataElement(each).GetValueAsSQ();
  for (std::size_t k = 1; items && k <= items->GetNumberOfItems(); ++k) {
    DicomFrame frame = common;
    Told told = told_of_all;
    read_groups(items->GetItem(k).GetNestedDataSet(), dimensions, frame, told);
    tell_lacks(told, frame);
    frame.number = frames.size();
    frames.push_back(frame);
  }
  return frames;
}

}  // namespace wireplan::preprocess
