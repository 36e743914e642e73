#pragma once
/// Elements of a DICOM data set by their tags; for the .cpp files here.
#include <cstdint>
#include <string>
#include <vector>

#include "gdcmDataSet.h"
#include "gdcmSequenceOfItems.h"

namespace wireplan::preprocess {

/// An element, and how messages call it.
struct NamedTag {
  std::uint16_t group = 0, element = 0;
  const char* name = "";
  gdcm::Tag tag() const { return {group, element}; }
};

/// What tells where an image lies (PS3.3 section C.7.6.2) and how its values are scaled (C.11.1).
inline constexpr NamedTag kPosition{0x20, 0x32, "Image Position (Patient) (0020,0032)"};
inline constexpr NamedTag kOrientation{0x20, 0x37, "Image Orientation (Patient) (0020,0037)"};
inline constexpr NamedTag kSpacing{0x28, 0x30, "Pixel Spacing (0028,0030)"};
inline constexpr NamedTag kThickness{0x18, 0x50, "Slice Thickness (0018,0050)"};
inline constexpr NamedTag kIntercept{0x28, 0x1052, "Rescale Intercept (0028,1052)"};
inline constexpr NamedTag kSlope{0x28, 0x1053, "Rescale Slope (0028,1053)"};

/// A decimal string that holds something else than is expected; no name where there is none.
struct WrongValue {
  std::string name, value, expected;
  /// Unless another is told.
  void tell(const std::string& of, const std::string& is, const std::string& wanted) {
    if (name.empty()) *this = {of, is, wanted};
  }
};

/// A text without the blanks and zeros that fill it up (PS3.5 section 6.2).
std::string without_padding(std::string text);

/// The bytes of an element; empty where there is none.
std::string dicom_bytes(const gdcm::DataSet& data, const gdcm::Tag& tag);

/// The text of an element; empty where there is none.
std::string dicom_text(const gdcm::DataSet& data, const gdcm::Tag& tag);

/// All numbers of a decimal string (PS3.5 section 6.2). None where it is absent, or where something
/// else stands between them, as a decimal comma: told in `wrong`, unless that tells of another.
std::vector<double> read_numbers(const gdcm::DataSet& data, const NamedTag& named,
                                 WrongValue& wrong);

/// Calls `use` with the first item of a sequence, where there is one.
template <typename Use>
void in_first_item(const gdcm::DataSet& data, const gdcm::Tag& sequence, Use use) {
  if (!data.FindDataElement(sequence)) return;
  const auto items = data.GetDataElement(sequence).GetValueAsSQ();
  if (items && items->GetNumberOfItems() > 0) use(items->GetItem(1).GetNestedDataSet());
}

/// Stored value -> value (PS3.3 section C.11.1), as far as it is told.
struct DicomScale {
  double slope = 1.0, intercept = 0.0;
  bool has_slope = false, has_intercept = false;
  std::string unit;  // of the value, "HU" in whatever spelling; empty where not told
};

/// Changes what the elements tell.
void read_scale(const gdcm::DataSet& data, DicomScale& scale, WrongValue& wrong);

}  // namespace wireplan::preprocess
