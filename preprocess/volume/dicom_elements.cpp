#include "preprocess/volume/dicom_elements.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <string_view>
#include <utility>

namespace wireplan::preprocess {
namespace {

/// "HU", "hu" and "Hounsfield units", which people write.
bool is_hounsfield(const std::string& unit) {
  std::string letters;
  for (const char c : unit) {
    const auto byte = static_cast<unsigned char>(c);
    if (c != ' ' && c != '_') letters += static_cast<char>(std::tolower(byte));
  }
  return letters == "hu" || letters == "hounsfield" || letters == "hounsfieldunit" ||
         letters == "hounsfieldunits";
}

}  // namespace

std::string without_padding(std::string text) {
  const std::string_view padding(" \t\r\n\0", 5);
  text.erase(text.find_last_not_of(padding) + 1);
  return text;
}

std::string dicom_bytes(const gdcm::DataSet& data, const gdcm::Tag& tag) {
  if (!data.FindDataElement(tag)) return {};
  const gdcm::ByteValue* bytes = data.GetDataElement(tag).GetByteValue();
  if (bytes == nullptr) return {};
  return {bytes->GetPointer(), bytes->GetLength()};
}

std::string dicom_text(const gdcm::DataSet& data, const gdcm::Tag& tag) {
  return without_padding(dicom_bytes(data, tag));
}

std::vector<double> read_numbers(const gdcm::DataSet& data, const NamedTag& named,
                                 WrongValue& wrong) {
  const std::string text = dicom_text(data, named.tag());
  std::vector<double> numbers;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, '\\');) {
    part = without_padding(part.substr(std::min(part.find_first_not_of(' '), part.size())));
    char* end = nullptr;
    const double number = std::strtod(part.c_str(), &end);
    const bool is_decimal =
        !part.empty() && part.find_first_not_of("0123456789+-.eE") == std::string::npos;
    if (!is_decimal || end != part.c_str() + part.size() || !std::isfinite(number)) {
      wrong.tell(named.name, text, "numbers with decimal points, parted by backslashes");
      return {};
    }
    numbers.push_back(number);
  }
  return numbers;
}

void read_scale(const gdcm::DataSet& data, DicomScale& scale, WrongValue& wrong) {
  const auto read = [&](const NamedTag& named, double& to, bool& has) {
    const std::vector<double> numbers = read_numbers(data, named, wrong);
    if (numbers.empty()) return;
    to = numbers.front();
    has = true;
  };
  read(kSlope, scale.slope, scale.has_slope);
  read(kIntercept, scale.intercept, scale.has_intercept);
  if (scale.slope == 0.0) {
    wrong.tell(kSlope.name, dicom_text(data, kSlope.tag()),
               "another number than 0, at which all values are one");
  }
  if (std::string unit = dicom_text(data, {0x28, 0x1054}); !unit.empty()) {
    scale.unit = is_hounsfield(unit) ? "HU" : std::move(unit);
  }
}

}  // namespace wireplan::preprocess
