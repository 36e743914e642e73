#include "preprocess/volume/dicom_frames.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "gdcmAttribute.h"
#include "gdcmSequenceOfItems.h"

namespace wireplan::preprocess {
namespace {

/// Calls `use` with the first item of a sequence, where there is one.
template <typename Use>
void in_first_item(const gdcm::DataSet& data, const gdcm::Tag& sequence, Use use) {
  if (!data.FindDataElement(sequence)) return;
  const auto items = data.GetDataElement(sequence).GetValueAsSQ();
  if (items && items->GetNumberOfItems() > 0) use(items->GetItem(1).GetNestedDataSet());
}

/// Reads numbers of an element into `to`; false where it is absent or has fewer.
template <std::uint16_t kGroup, std::uint16_t kElement, std::size_t kCount>
bool read_numbers(const gdcm::DataSet& data, std::array<double, kCount>& to) {
  gdcm::Attribute<kGroup, kElement> attribute;
  if (!data.FindDataElement(attribute.GetTag()) ||
      data.GetDataElement(attribute.GetTag()).IsEmpty()) {
    return false;
  }
  attribute.SetFromDataElement(data.GetDataElement(attribute.GetTag()));
  if (attribute.GetNumberOfValues() < kCount) return false;
  const double* values = attribute.GetValues();
  std::copy(values, values + kCount, to.begin());
  return true;
}

/// What one functional group, shared or of the frame, tells.
struct Told {
  bool position = false, orientation = false, spacing = false;
};
void read_groups(const gdcm::DataSet& groups, DicomFrame& frame, Told& told) {
  in_first_item(groups, {0x0020, 0x9113}, [&](const gdcm::DataSet& plane) {
    std::array<double, 3> at{};
    if (!read_numbers<0x0020, 0x0032>(plane, at)) return;
    frame.position = Vec3(at[0], at[1], at[2]);
    told.position = true;
  });
  in_first_item(groups, {0x0020, 0x9116}, [&](const gdcm::DataSet& plane) {
    std::array<double, 6> axes{};
    if (!read_numbers<0x0020, 0x0037>(plane, axes)) return;
    frame.right = Vec3(axes[0], axes[1], axes[2]);
    frame.down = Vec3(axes[3], axes[4], axes[5]);
    told.orientation = true;
  });
  in_first_item(groups, {0x0028, 0x9110}, [&](const gdcm::DataSet& measures) {
    std::array<double, 2> spacing{};  // between rows, between columns (PS3.3 section 10.7.1.3)
    if (!read_numbers<0x0028, 0x0030>(measures, spacing)) return;
    frame.along_column = spacing[0];
    frame.along_row = spacing[1];
    told.spacing = true;
  });
  in_first_item(groups, {0x0028, 0x9145}, [&](const gdcm::DataSet& scale) {
    std::array<double, 1> number{};
    if (read_numbers<0x0028, 0x1053>(scale, number)) frame.slope = number[0];
    if (read_numbers<0x0028, 0x1052>(scale, number)) frame.intercept = number[0];
    frame.unit = dicom_text(scale, {0x0028, 0x1054});
  });
}

}  // namespace

std::string without_padding(std::string text) {
  while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.pop_back();
  return text;
}

std::string dicom_text(const gdcm::DataSet& data, const gdcm::Tag& tag) {
  if (!data.FindDataElement(tag)) return {};
  const gdcm::ByteValue* bytes = data.GetDataElement(tag).GetByteValue();
  if (bytes == nullptr) return {};
  return without_padding({bytes->GetPointer(), bytes->GetLength()});
}

std::vector<DicomFrame> read_dicom_frames(const gdcm::DataSet& data) {
  const gdcm::Tag shared(0x5200, 0x9229), each(0x5200, 0x9230);
  std::vector<DicomFrame> frames;
  if (!data.FindDataElement(each)) return frames;

  DicomFrame common;
  Told told_of_all;
  in_first_item(data, shared,
                [&](const gdcm::DataSet& groups) { read_groups(groups, common, told_of_all); });
  const auto items = data.GetDataElement(each).GetValueAsSQ();
  for (std::size_t k = 1; items && k <= items->GetNumberOfItems(); ++k) {
    DicomFrame frame = common;
    Told told = told_of_all;
    read_groups(items->GetItem(k).GetNestedDataSet(), frame, told);
    const auto require = [&](bool is_told, const char* what) {
      if (!is_told) frame.lacks += (frame.lacks.empty() ? "" : ", ") + std::string(what);
    };
    require(told.position, kPositionTag);
    require(told.orientation, kOrientationTag);
    require(told.spacing, kSpacingTag);
    frames.push_back(frame);
  }
  return frames;
}

}  // namespace wireplan::preprocess
