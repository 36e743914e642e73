#include "preprocess/volume/dicom_check.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace wireplan::preprocess {
namespace {

constexpr std::uint32_t kUndefinedLength = 0xFFFFFFFF;
constexpr std::uint32_t kItem = 0xFFFEE000, kItemEnd = 0xFFFEE00D, kSequenceEnd = 0xFFFEE0DD;
constexpr std::uint32_t kTransferSyntax = 0x00020010, kPixelData = 0x7FE00010;
constexpr std::size_t kPreamble = 128;
constexpr int kDeepest = 16;

// Little endian, tag as group * 65536 + element.
class Walker {
 public:
  explicit Walker(std::string_view bytes) : bytes_(bytes) {}

  DicomForm check() {
    at_ = kPreamble + 4;
    std::string syntax;
    while (at_ + 4 <= bytes_.size() && number(at_, 2) == 2) {
      Element element;
      if (!read_head(/*explicit_vr=*/true, element) || element.length > left()) {
        return DicomForm::kDamaged;
      }
      if (element.tag == kTransferSyntax) syntax = bytes_.substr(at_, element.length);
      at_ += element.length;
    }
    syntax = syntax.substr(0, syntax.find_last_not_of(std::string_view("\0 ", 2)) + 1);
    if (syntax.empty()) return DicomForm::kDamaged;
    if (syntax == "1.2.840.10008.1.2.2" || syntax == "1.2.840.10008.1.2.1.99") {
      return DicomForm::kSound;
    }
    if (walk(syntax != "1.2.840.10008.1.2", bytes_.size(), 0, 0)) return DicomForm::kSound;
    return pixels_end_ > 0 ? DicomForm::kPadded : DicomForm::kDamaged;
  }

  // Whether it is a data set with pixels without the head of a file, as old archives write them:
  // group 8 first, little endian, with or without value representations.
  bool is_bare() {
    if (bytes_.size() < 8 || number(0, 2) != 8) return false;
    const auto is_capital = [&](std::size_t at) { return bytes_[at] >= 'A' && bytes_[at] <= 'Z'; };
    at_ = 0;
    walk(is_capital(4) && is_capital(5), bytes_.size(), 0, 0);
    return pixels_end_ > 0;
  }

  std::size_t pixels_end() const { return pixels_end_; }

 private:
  struct Element {
    std::uint32_t tag = 0, length = 0;
    std::string_view vr;
  };

  std::size_t left() const { return bytes_.size() - at_; }

  std::uint32_t number(std::size_t at, std::size_t count) const {
    std::uint32_t value = 0;
    for (std::size_t k = count; k-- > 0;) {
      value = value << 8U | static_cast<unsigned char>(bytes_[at + k]);
    }
    return value;
  }

  bool read_head(bool explicit_vr, Element& element) {
    if (left() < 8) return false;
    element.tag = number(at_, 2) << 16U | number(at_ + 2, 2);
    at_ += 4;
    if (!explicit_vr || element.tag >> 16U == kItem >> 16U) {
      element.length = number(at_, 4);
      at_ += 4;
      return true;
    }
    constexpr std::array<std::string_view, 34> kKnown = {
        "AE", "AS", "AT", "CS", "DA", "DS", "DT", "FD", "FL", "IS", "LO", "LT",
        "PN", "SH", "SL", "SS", "ST", "TM", "UI", "UL", "US", "OB", "OD", "OF",
        "OL", "OV", "OW", "SQ", "SV", "UC", "UN", "UR", "UT", "UV"};
    constexpr std::size_t kShort = 21;  // so many have two bytes of length, the rest four
    element.vr = bytes_.substr(at_, 2);
    const auto known = std::find(kKnown.begin(), kKnown.end(), element.vr);
    if (known == kKnown.end()) return false;
    if (known - kKnown.begin() < static_cast<std::ptrdiff_t>(kShort)) {
      element.length = number(at_ + 2, 2);
      at_ += 4;
      return true;
    }
    if (left() < 8) return false;
    element.length = number(at_ + 4, 4);
    at_ += 8;
    return true;
  }

  // The values that GDCM takes for granted: how a pixel is stored (PS3.3 section C.7.6.3).
  bool is_sound_value(const Element& element) const {
    struct Allowed {
      std::uint32_t tag;
      std::vector<std::uint32_t> values;
    };
    static const std::array<Allowed, 3> kAllowed = {
        {{0x00280002, {1, 3, 4}}, {0x00280100, {1, 8, 12, 16, 32, 64}}, {0x00280103, {0, 1}}}};
    for (const Allowed& allowed : kAllowed) {
      if (element.tag != allowed.tag) continue;
      if (element.length != 2) return false;
      const std::uint32_t value = number(at_, 2);
      return std::find(allowed.values.begin(), allowed.values.end(), value) != allowed.values.end();
    }
    return true;
  }

  // The elements from here to `end`, or to the element `last` where that is not 0.
  bool walk(bool explicit_vr, std::size_t end, std::uint32_t last, int depth) {
    if (depth > kDeepest) return false;
    while (at_ < end) {
      Element element;
      if (!read_head(explicit_vr, element) || at_ > end) return false;
      if (last != 0 && element.tag == last) return element.length == 0;
      if (element.tag >> 16U == kItem >> 16U) return false;
      const bool items = element.vr == "SQ" || element.length == kUndefinedLength;
      if (items) {
        // Of unknown representation and undefined length: implicit (PS3.5 section 6.2.2).
        const bool inner = explicit_vr && element.vr != "UN";
        if (!walk_items(inner, element, end, depth)) return false;
      } else {
        if (element.length > end - at_ || !is_sound_value(element)) return false;
        at_ += element.length;
      }
      if (depth == 0 && element.tag == kPixelData) pixels_end_ = at_;
    }
    return last == 0 && at_ == end;
  }

  bool walk_items(bool explicit_vr, const Element& sequence, std::size_t outer, int depth) {
    const bool open = sequence.length == kUndefinedLength;
    if (!open && sequence.length > outer - at_) return false;
    const std::size_t end = open ? outer : at_ + sequence.length;
    const bool fragments = sequence.tag == kPixelData;
    while (at_ < end) {
      Element item;
      if (!read_head(explicit_vr, item) || at_ > end) return false;
      if (open && item.tag == kSequenceEnd) return item.length == 0;
      if (item.tag != kItem) return false;
      if (item.length == kUndefinedLength) {
        if (fragments || !walk(explicit_vr, end, kItemEnd, depth + 1)) return false;
        continue;
      }
      if (item.length > end - at_) return false;
      if (fragments) {
        at_ += item.length;
      } else if (!walk(explicit_vr, at_ + item.length, 0, depth + 1)) {
        return false;
      }
    }
    return !open && at_ == end;
  }

  std::string_view bytes_;
  std::size_t at_ = 0, pixels_end_ = 0;  // of the data set's own pixels
};

}  // namespace

DicomForm check_dicom(const std::filesystem::path& path, std::size_t* end) {
  std::ifstream stream(path, std::ios::binary);
  std::string head(kPreamble + 4, '\0');
  if (!stream.read(head.data(), static_cast<std::streamsize>(head.size())) ||
      (head.substr(kPreamble) != "DICM" && (head[0] != 8 || head[1] != 0))) {
    return DicomForm::kNone;
  }
  const std::string bytes = head + std::string(std::istreambuf_iterator<char>(stream), {});
  Walker walker(bytes);
  const DicomForm form = head.substr(kPreamble) == "DICM" ? walker.check()
                         : walker.is_bare()               ? DicomForm::kBare
                                                          : DicomForm::kNone;
  if (end != nullptr) *end = walker.pixels_end();
  return form;
}

}  // namespace wireplan::preprocess
