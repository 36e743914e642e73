#include "preprocess/volume/nrrd_fields.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include "preprocess/volume/itk_image.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

/// https://teem.sourceforge.net/nrrd/format.html, with the spellings that it allows.
bool is_nrrd_field(const std::string& name) {
  const std::string kFields =
      "|dimension|type|block size|blocksize|encoding|endian|content|min|max|old min|"
      "oldmin|old max|oldmax|data file|datafile|line skip|lineskip|byte skip|byteskip|"
      "number|sample units|sampleunits|sizes|spacings|thicknesses|axis mins|axismins|"
      "axis maxs|axismaxs|centers|centerings|labels|units|kinds|space|space dimension|"
      "space units|space origin|space directions|measurement frame|";
  return kFields.find("|" + name + "|") != std::string::npos;
}

/// Refuses a field that does not hold so many vectors of numbers, or "none" in the place of some.
void require_vectors(const NrrdFields& fields, const std::string& key, std::size_t count,
                     const fs::path& path) {
  if (fields.count(key) == 0) return;
  const std::string text = value_of(fields, key);
  const std::vector<std::vector<double>> vectors = vectors_of(text);
  const auto commas = static_cast<std::size_t>(std::count(text.begin(), text.end(), ','));
  std::size_t length = 0, told = 0;
  bool equal = true;
  for (const std::vector<double>& vector : vectors) {
    if (vector.empty()) continue;
    equal = equal && vector.size() >= 3 && (length == 0 || vector.size() == length);
    length = vector.size();
    told += vector.size() - 1;  // commas between its numbers
  }
  const auto open = static_cast<std::size_t>(std::count(text.begin(), text.end(), '('));
  const auto none = static_cast<std::size_t>(
      std::count_if(vectors.begin(), vectors.end(), [](const auto& one) { return one.empty(); }));
  if (equal && vectors.size() == count && told == commas && open + none == count) return;
  throw wrong_field(key, text,
                    count == 1 ? std::string("one place, as (a,b,c)")
                               : "a vector of numbers, as (a,b,c), or none for each of its " +
                                     std::to_string(count) + " axes",
                    path);
}

/// NrrdIO asks for the order of bytes where values have several, and says no more than that the
/// header is wrong.
void require_endian(const NrrdFields& fields, const fs::path& path) {
  static const std::set<std::string> kOneByte = {"char",  "signed char",   "int8",  "int8_t",
                                                 "uchar", "unsigned char", "uint8", "uint8_t"};
  static const std::set<std::string> kText = {"ascii", "text", "txt"};
  const std::string type = value_of(fields, "type"), encoding = value_of(fields, "encoding");
  if (fields.count("endian") > 0 || kOneByte.count(type) > 0 || kText.count(encoding) > 0) return;
  throw Error(path.string() + ": endian is missing, expected little or big for values of type " +
              type + "; add the line \"endian: little\" (what nearly all programs write)");
}

/// A whole number that fills the text; 0 where it is none.
std::int64_t whole_number(const std::string& text) {
  char* end = nullptr;
  const long long number = std::strtoll(text.c_str(), &end, 10);
  return text.empty() || *end != '\0' ? 0 : number;
}

}  // namespace

std::string value_of(const NrrdFields& fields, const std::string& key) {
  const auto found = fields.find(key);
  return found == fields.end() ? std::string() : found->second;
}

NrrdFields read_nrrd_fields(const fs::path& path) {
  constexpr std::size_t kMost = 10000, kLongest = 500;  // lines, characters
  NrrdFields fields;
  std::ifstream file(path, std::ios::binary);
  std::string line;
  std::size_t number = 1;
  const auto refuse = [&](const std::string& why) {
    throw Error(path.string() + ": line " + std::to_string(number) + " of its header " + why +
                "; mend the header, or save it again from the program that made it");
  };
  if (!std::getline(file, line) || !line.starts_with("NRRD")) {
    throw not_of_format("NRRD", beginning_of(path), "it does not begin with NRRD", path);
  }
  if (const std::string magic = trimmed(line); magic < "NRRD0001" || magic > "NRRD0006") {
    throw wrong_field("first line", magic.substr(0, 12), "NRRD0001 to NRRD0005", path);
  }
  while (std::getline(file, line) && !trimmed(line).empty()) {
    ++number;
    const std::size_t colon = line.find(": ");
    const bool added = line.find(":=") < colon;
    if (line.front() == '#') continue;
    std::string name = lower_case(trimmed(line.substr(0, colon)));
    if (fields.size() >= kMost) refuse("is one of too many, expected 10000 at most");
    if (line.size() > kLongest && !added && name != "content") {
      refuse("has over 500 characters, expected fewer");
    }
    if (added) continue;
    if (colon == std::string::npos || !is_nrrd_field(name)) {
      // What it holds may tell who the patient is.
      refuse(
          "is none that NRRD knows, expected \"field: value\" of its fields, \"key:=value\" or a "
          "comment behind #");
    }
    static const std::map<std::string, std::string> kOther = {{"datafile", "data file"},
                                                              {"axismins", "axis mins"},
                                                              {"axismaxs", "axis maxs"},
                                                              {"centerings", "centers"}};
    if (const auto other = kOther.find(name); other != kOther.end()) name = other->second;
    const std::string value = trimmed(line.substr(colon + 2));
    if (fields.count(name) > 0) refuse("tells " + name + " again, expected it once");
    fields[name] = name == "data file" ? value : lower_case(value);
    if (name == "data file" && lower_case(value).starts_with("list")) break;  // names follow
  }
  return fields;
}

std::vector<std::vector<double>> vectors_of(std::string text) {
  std::replace(text.begin(), text.end(), ',', ' ');
  std::vector<std::vector<double>> vectors;
  std::size_t at = 0;
  while ((at = text.find_first_of("(n", at)) != std::string::npos) {
    const std::size_t end = text.find(')', at);
    std::vector<double>& vector = vectors.emplace_back();
    if (text[at] == 'n' || end == std::string::npos) {
      at += 4;  // "none"
      continue;
    }
    std::istringstream numbers(text.substr(at + 1, end - at - 1));
    for (double number = 0.0; numbers >> number;) vector.push_back(number);
    at = end;
  }
  return vectors;
}

std::vector<std::string> axis_words(const NrrdFields& fields, const std::string& key) {
  std::istringstream text(value_of(fields, key));
  return {std::istream_iterator<std::string>(text), {}};
}

void require_sound_fields(const NrrdFields& fields, const fs::path& path) {
  for (const char* key : {"type", "dimension", "sizes"}) {
    if (fields.count(key) > 0) continue;
    throw Error(path.string() + ": its header lacks " + key +
                ", expected type, dimension, sizes and encoding; add what lacks, or save it again "
                "from the program that made it");
  }
  const std::string kTypes =
      "|char|signed char|int8|int8_t|uchar|unsigned char|uint8|uint8_t|short|short int|"
      "signed short|signed short int|int16|int16_t|ushort|unsigned short|"
      "unsigned short int|uint16|uint16_t|int|signed int|int32|int32_t|uint|"
      "unsigned int|uint32|uint32_t|longlong|long long|long long int|signed long long|"
      "signed long long int|int64|int64_t|ulonglong|unsigned long long|"
      "unsigned long long int|uint64|uint64_t|float|double|";
  const std::string type = value_of(fields, "type");
  if (kTypes.find("|" + type + "|") == std::string::npos) {
    throw wrong_field("type", type, "one of integers or floats, as short or float", path);
  }
  const std::int64_t axes = whole_number(value_of(fields, "dimension"));
  if (axes < 1 || axes > 16) {
    throw wrong_field("dimension", value_of(fields, "dimension"), "a number of axes from 1 to 16",
                      path);
  }
  for (const std::string& size : axis_words(fields, "sizes")) {
    require_size(whole_number(size), "sizes (" + value_of(fields, "sizes") + ")", path);
  }
  for (const char* key : {"sizes", "spacings", "axis mins", "axis maxs", "centers", "kinds"}) {
    const auto count = static_cast<std::int64_t>(axis_words(fields, key).size());
    if (fields.count(key) == 0 || count == axes) continue;
    throw wrong_field(key, value_of(fields, key),
                      "one for each of its " + std::to_string(axes) + " axes (dimension)", path);
  }
  if (const std::string endian = value_of(fields, "endian");
      fields.count("endian") > 0 && endian != "little" && endian != "big") {
    throw wrong_field("endian", endian, "little or big", path);
  }
  require_endian(fields, path);
  require_vectors(fields, "space directions", static_cast<std::size_t>(axes), path);
  require_vectors(fields, "space origin", 1, path);
}

}  // namespace wireplan::preprocess
