#include "preprocess/volume/dicom_check.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace wireplan::preprocess {
namespace {

constexpr std::uint32_t kUndefinedLength = 0xFFFFFFFF;
constexpr std::uint32_t kItem = 0xFFFEE000, kItemEnd = 0xFFFEE00D, kSequenceEnd = 0xFFFEE0DD;
constexpr std::uint32_t kTransferSyntax = 0x00020010, kRows = 0x00280010;
constexpr std::uint32_t kClassOfFile = 0x00020002, kClass = 0x00080016;
constexpr std::uint32_t kPhotometric = 0x00280004, kPixelData = 0x7FE00010;
constexpr std::uint32_t kFloatPixels = 0x7FE00008, kDoublePixels = 0x7FE00009;
constexpr std::uint32_t kFirstOfData = 8;  // group
constexpr std::size_t kPreamble = 128, kMagic = 4;
constexpr int kDeepest = 16;

constexpr std::string_view kOfImages = "1.2.840.10008.5.1.4.1.1.";  // how their classes begin

// Images of CT and MR, each slice for itself or all in one file (PS3.4 section B.5).
bool is_image_class(std::string_view uid) {
  if (!uid.starts_with(kOfImages)) return false;
  uid.remove_prefix(kOfImages.size());
  return uid == "2" || uid == "2.1" || uid == "4" || uid == "4.1";
}

// Tag as group * 65536 + element.
class Walker {
 public:
  explicit Walker(std::string_view bytes) : bytes_(bytes) {}

  DicomLook look() {
    const bool headed = bytes_.substr(kPreamble, kMagic) == "DICM";
    if (!headed && !find_begin()) return {};
    if (headed) at_ = kPreamble + kMagic;
    if (!read_meta()) return found(DicomForm::kDamaged);
    look_.begin = at_;
    const DicomForm sound = headed && !look_.syntax.empty() ? DicomForm::kSound : DicomForm::kBare;
    if (look_.syntax == "1.2.840.10008.1.2.1.99") {  // deflated
      look_.pixels = true;
      look_.end = bytes_.size();
      return found(sound);
    }
    big_endian_ = look_.syntax == "1.2.840.10008.1.2.2";
    look_.explicit_vr = look_.syntax.empty()
                            ? is_explicit(at_)
                            : look_.syntax != "1.2.840.10008.1.2" && look_.syntax != kImplicitOfGe;
    look_.patches.clear();
    const bool whole = walk(look_.explicit_vr, bytes_.size(), 0, 0);
    // Those of the standard are known here; others may be written in any manner.
    const bool standard = look_.syntax.empty() || look_.syntax == kImplicitOfGe ||
                          look_.syntax.starts_with("1.2.840.10008.1.2");
    if (!whole && look_.end == 0 && !standard) {
      look_.pixels = true;
      look_.followed = false;
      look_.end = bytes_.size();
      return found(sound);
    }
    if (!whole && look_.end == 0) return found(DicomForm::kDamaged);
    if (whole && look_.end == 0) look_.end = bytes_.size();
    if (whole || sound == DicomForm::kBare) return found(sound);
    return found(DicomForm::kPadded);
  }

 private:
  static constexpr const char* kImplicitOfGe = "1.2.840.113619.5.2";  // but its pixels

  struct Element {
    std::uint32_t tag = 0, length = 0;
    std::string_view vr;
  };

  DicomLook found(DicomForm form) {
    look_.form = form;
    return std::move(look_);
  }

  // Where a file without "DICM" begins: at once, or behind a preamble, with or without the room of
  // those letters.
  bool find_begin() {
    for (const std::size_t at : {std::size_t{0}, kPreamble, kPreamble + kMagic}) {
      if (!looks_like_elements(at)) continue;
      at_ = at;
      return true;
    }
    return false;
  }

  // Three elements in the order of their tags, of the groups that come first.
  bool looks_like_elements(std::size_t at) {
    constexpr std::uint32_t kMostElement = 0x1000;
    if (bytes_.size() < at + 8) return false;
    const std::uint32_t group = number(at, 2);
    if (group != 2 && group != kFirstOfData) return false;
    at_ = at;
    std::uint32_t before = 0;
    for (int k = 0; k < 3; ++k) {
      Element element;
      if (!read_head(is_explicit(at), element) || element.tag <= before) return false;
      if (k == 0 && (element.tag & 0xFFFFU) > kMostElement) return false;
      if (element.length > left() && element.length != kUndefinedLength) return false;
      before = element.tag;
      if (element.length == kUndefinedLength) break;
      at_ += element.length;
    }
    return true;
  }

  // The group of the file's own head, where it has one.
  bool read_meta() {
    while (left() >= 4 && number(at_, 2) == 2) {
      Element element;
      if (!read_head(is_explicit(at_), element) || element.length > left()) return false;
      const std::string_view value = bytes_.substr(at_, element.length);
      if (element.tag == kTransferSyntax) look_.syntax = value;
      if (element.tag == kClassOfFile) note_class(value);
      at_ += element.length;
    }
    look_.syntax = unpadded(look_.syntax);
    return true;
  }

  static std::string unpadded(std::string_view uid) {
    return std::string(uid.substr(0, uid.find_last_not_of(std::string_view("\0 ", 2)) + 1));
  }

  void note_class(std::string_view value) {
    look_.sop_class = unpadded(value);
    look_.image = look_.image || is_image_class(look_.sop_class);
  }

  bool is_capital(std::size_t at) const { return bytes_[at] >= 'A' && bytes_[at] <= 'Z'; }

  // An element with a value representation has the two letters of it behind its tag.
  bool is_explicit(std::size_t at) const {
    return at + 8 <= bytes_.size() && is_capital(at + 4) && is_capital(at + 5);
  }

  std::size_t left() const { return bytes_.size() - at_; }

  std::uint32_t number(std::size_t at, std::size_t count) const {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t next = big_endian_ ? at + k : at + count - 1 - k;
      value = value << 8U | static_cast<unsigned char>(bytes_[next]);
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
    bool is_short = known - kKnown.begin() < static_cast<std::ptrdiff_t>(kShort);
    if (known == kKnown.end()) {
      const bool is_private = (element.tag >> 16U) % 2 == 1;
      if (!is_private) return false;
      is_short = !has_long_length();
      element.vr = is_short ? "ST" : "UN";
      look_.patches.push_back({at_, std::string(element.vr)});
    }
    if (is_short) {
      element.length = number(at_ + 2, 2);
      at_ += 4;
      return true;
    }
    if (left() < 8) return false;
    element.length = number(at_ + 4, 4);
    at_ += 8;
    return true;
  }

  // Of a representation that the standard lacks: letters are of a later one, which has four bytes
  // of length (PS3.5 section 6.2); others have two, but for those that leave them empty.
  bool has_long_length() const {
    if (is_capital(at_) && is_capital(at_ + 1)) return true;
    if (number(at_ + 2, 2) != 0 || left() < 8) return false;
    const bool next_is_head = is_explicit(at_ + 4) || number(at_ + 4, 2) == kItem >> 16U;
    return !next_is_head && number(at_ + 4, 4) <= left() - 8;
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
      const std::size_t start = at_;
      const bool items = element.vr == "SQ" || element.length == kUndefinedLength;
      if (items) {
        // Of unknown representation and undefined length: implicit (PS3.5 section 6.2.2).
        const bool inner = explicit_vr && element.vr != "UN";
        if (!walk_items(inner, element, end, depth)) return false;
      } else {
        if (element.length > end - at_ || !is_sound_value(element)) return false;
        at_ += element.length;
      }
      if (depth == 0) note(element, start);
    }
    return last == 0 && at_ == end;
  }

  // What matters of an element of the data set itself, whose value lies from `start` to here.
  void note(const Element& element, std::size_t start) {
    const std::string_view value = bytes_.substr(start, at_ - start);
    if (element.tag == kClass) note_class(value);
    if (element.tag == kRows) look_.image = true;
    if (element.tag == kPixelData || element.tag == kFloatPixels || element.tag == kDoublePixels) {
      look_.pixels = true;
      look_.end = at_;
    }
    constexpr std::string_view kInverse = "MONOCHROME1";
    if (element.tag == kPhotometric && value.substr(0, kInverse.size()) == kInverse) {
      look_.patches.push_back({start + kInverse.size() - 1, "2"});
    }
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
  std::size_t at_ = 0;
  bool big_endian_ = false;
  DicomLook look_;
};

}  // namespace

DicomLook look_at_dicom(const std::filesystem::path& path) {
  constexpr std::size_t kLeast = kPreamble + kMagic;
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(kLeast, '\0');
  if (!stream.read(bytes.data(), static_cast<std::streamsize>(kLeast))) return {};
  const bool headed = bytes.substr(kPreamble) == "DICM";
  const auto begins = [&](std::size_t at) {
    return (bytes[at] == 2 || bytes[at] == 8) && bytes[at + 1] == 0;
  };
  // Long files that are something else are not read.
  if (!headed && !begins(0) && !begins(kPreamble)) {
    std::string next(2, '\0');
    if (!stream.read(next.data(), 2) || next[1] != 0 || (next[0] != 2 && next[0] != 8)) return {};
    bytes += next;
  }
  bytes.append(std::istreambuf_iterator<char>(stream), {});
  return Walker(bytes).look();
}

bool is_segmentation(const std::string& sop_class) {
  const std::string_view uid = sop_class;
  return uid.starts_with(kOfImages) && uid.substr(kOfImages.size()).starts_with("66.");
}

DicomKind kind_of(const DicomLook& look) {
  if (is_segmentation(look.sop_class)) return {kSegmentation, true};
  if (look.sop_class == std::string(kOfImages) + "481.3") {
    return {"a DICOM structure set (RTSTRUCT)", true};
  }
  return {is_image_class(look.sop_class) ? "a DICOM image (CT or MR)" : "a DICOM file", false};
}

DicomForm check_dicom(const std::filesystem::path& path) { return look_at_dicom(path).form; }

}  // namespace wireplan::preprocess
