#include "preprocess/volume/volume_file.h"

#include <unistd.h>

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <vector>

#include "itkMetaImageIO.h"
#include "preprocess/volume/byte_stream.h"
#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/dicom_series.h"
#include "preprocess/volume/nifti_file.h"
#include "preprocess/volume/nrrd_file.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

/// What stands behind a key that MetaIO knows (metaImage.cxx, metaObject.cxx).
enum class MetaValue { kText, kTruth, kOne, kVector, kMatrix };

const std::map<std::string, MetaValue>& meta_keys() {
  using enum MetaValue;
  static const std::map<std::string, MetaValue> kKeys = {{"ObjectType", kText},
                                                         {"BinaryData", kTruth},
                                                         {"BinaryDataByteOrderMSB", kTruth},
                                                         {"ElementByteOrderMSB", kTruth},
                                                         {"CompressedData", kTruth},
                                                         {"ElementType", kText},
                                                         {"ElementDataFile", kText},
                                                         {"DistanceUnits", kText},
                                                         {"AnatomicalOrientation", kText},
                                                         {"ID", kOne},
                                                         {"ParentID", kOne},
                                                         {"CompressedDataSize", kOne},
                                                         {"HeaderSize", kOne},
                                                         {"ElementMin", kOne},
                                                         {"ElementNumberOfChannels", kOne},
                                                         {"ElementNBits", kOne},
                                                         {"ElementMax", kOne},
                                                         {"ElementToIntensityFunctionSlope", kOne},
                                                         {"ElementToIntensityFunctionOffset", kOne},
                                                         {"NDims", kOne},
                                                         {"DimSize", kVector},
                                                         {"Offset", kVector},
                                                         {"Position", kVector},
                                                         {"Origin", kVector},
                                                         {"CenterOfRotation", kVector},
                                                         {"ElementSpacing", kVector},
                                                         {"ElementSize", kVector},
                                                         {"SequenceID", kVector},
                                                         {"TransformMatrix", kMatrix},
                                                         {"Rotation", kMatrix},
                                                         {"Orientation", kMatrix}};
  return kKeys;
}

/// The key as MetaIO writes it, where only its letters are in another case; MetaIO would pass it
/// over. "id" may be anybody's.
std::string as_meta_key(const std::string& key) {
  static const std::map<std::string, std::string> kWritten = [] {
    std::map<std::string, std::string> written = {{"modality", "Modality"}};
    for (const auto& [name, value] : meta_keys()) {
      if (!name.ends_with("ID")) written[lower_case(name)] = name;
    }
    return written;
  }();
  const auto known = kWritten.find(lower_case(key));
  return known == kWritten.end() ? key : known->second;
}

/// How many numbers stand behind a key; -1 where it is text, or a key of somebody's own.
int count_meta_numbers(const std::string& key, int dimensions) {
  const auto known = meta_keys().find(key);
  if (known == meta_keys().end() || known->second == MetaValue::kText ||
      known->second == MetaValue::kTruth) {
    return -1;
  }
  if (known->second == MetaValue::kOne) return 1;
  return known->second == MetaValue::kVector ? dimensions : dimensions * dimensions;
}

/// Whether the text holds so many numbers that a volume in mm may have, and nothing else.
bool holds_numbers(const std::string& text, int count) {
  constexpr double kLargest = 1e12;
  std::istringstream words(text);
  int found = 0;
  for (std::string word; words >> word; ++found) {
    char* end = nullptr;
    const double number = std::strtod(word.c_str(), &end);
    if (*end != '\0' || !(std::abs(number) <= kLargest)) return false;
  }
  return found == count;
}

/// The header of a MetaImage, line by line.
struct MetaHeader {
  std::string lines;       // all that MetaIO is to see
  bool has_more = false;   // whether the file holds them otherwise, or more
  std::string data_file;   // "LOCAL", or where the voxels are
  std::streamoff end = 0;  // where voxels of this file begin
  double packed = 0.0;     // bytes, where the voxels are compressed
  std::string modality;    // as DICOM has it; empty where the header does not tell
  std::string unit;        // of length, as it is told
  double mm = 1.0;         // of a unit of length
  bool has_spacing = false, has_place = false;
};

double meta_unit(const std::string& unit, const fs::path& path) {
  const std::string name = lower_case(unit);
  if (name == "mm" || name == "?" || name.empty()) return 1.0;
  if (name == "um") return 1e-3;
  if (name == "cm") return 10.0;
  throw Error(path.string() + ": DistanceUnits is " + unit +
              ", expected um, mm or cm; mend the header");
}

/// "MR" of MET_MOD_MR (metaTypes.h); nothing of MET_MOD_OTHER and MET_MOD_UNKNOWN.
std::string meta_modality(const std::string& name) {
  static const std::set<std::string> kTold = {"CT", "MR", "NM", "US"};
  const std::string start = "MET_MOD_";
  const std::string modality = name.starts_with(start) ? name.substr(start.size()) : name;
  return kTold.count(modality) > 0 ? modality : "";
}

bool is_plain(const std::string& line) {
  constexpr std::size_t kLongest = 250;
  return line.size() <= kLongest && std::all_of(line.begin(), line.end(), [](char c) {
           return (c >= ' ' && c <= '~') || c == '\t';
         });
}

/// A line of a MetaImage's header; without a key where it is no "Key = value".
struct MetaLine {
  std::string text, key, value;
};

MetaLine meta_line(std::string text) {
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);  // as some editors begin a text
  MetaLine line{.text = trimmed(text), .key = {}, .value = {}};
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) return line;
  line.key = as_meta_key(trimmed(text.substr(0, equals)));
  line.value = trimmed(text.substr(equals + 1));
  return line;
}

/// Whether the text means true; MetaIO takes what is none of these for false.
std::optional<bool> truth_of(const std::string& text) {
  static const std::set<std::string> kTrue = {"true", "t", "1"}, kFalse = {"false", "f", "0"};
  if (kTrue.count(lower_case(text)) > 0) return true;
  if (kFalse.count(lower_case(text)) > 0) return false;
  return {};
}

/// Refuses values that MetaIO would take for something else in silence, or knows nothing to do
/// with.
void require_sound_meta(MetaLine& line, const fs::path& path) {
  const auto known = meta_keys().find(line.key);
  if (known != meta_keys().end() && known->second == MetaValue::kTruth && !truth_of(line.value)) {
    throw wrong_field(line.key, line.value, "True or False", path);
  }
  if (line.key == "ElementDataFile" && line.value.empty()) {
    throw wrong_field(line.key, "", "LOCAL, or the name of the file that holds the voxels", path);
  }
  if (line.key == "ElementType") {
    static const std::set<std::string> kTypes = {
        "MET_CHAR", "MET_UCHAR", "MET_SHORT",     "MET_USHORT",     "MET_INT",   "MET_UINT",
        "MET_LONG", "MET_ULONG", "MET_LONG_LONG", "MET_ULONG_LONG", "MET_FLOAT", "MET_DOUBLE"};
    std::transform(line.value.begin(), line.value.end(), line.value.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    std::string type = line.value;
    const std::string array = "_ARRAY";
    if (type.ends_with(array)) type.resize(type.size() - array.size());
    if (kTypes.count(type) > 0) return;
    throw wrong_field(line.key, line.value,
                      "MET_SHORT, MET_UCHAR, MET_FLOAT or another type of integers or floats",
                      path);
  }
  const bool sizes = line.key == "DimSize";
  if (!sizes && line.key != "ElementSpacing" && line.key != "ElementSize") return;
  std::istringstream numbers(line.value);
  for (double number = 0.0; numbers >> number;) {
    if (sizes && number == std::floor(number)) {
      require_size(static_cast<std::int64_t>(number), line.key, path);
    } else if (sizes || !(number > 0.0)) {
      throw wrong_field(line.key, line.value, sizes ? "whole numbers" : "lengths of more than 0",
                        path);
    }
  }
}

/// Refuses keys that mean the same and tell different values, of which MetaIO takes one.
void require_one_meaning(const std::vector<MetaLine>& lines, const fs::path& path) {
  static const std::vector<std::set<std::string>> kSame = {
      {"Offset", "Position", "Origin"},
      {"TransformMatrix", "Rotation", "Orientation"},
      {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}};
  constexpr double kRounding = 1e-3;  // mm, or a cosine
  for (const std::set<std::string>& same : kSame) {
    const MetaLine* first = nullptr;
    for (const MetaLine& line : lines) {
      if (same.count(line.key) == 0) continue;
      if (first == nullptr) first = &line;
      bool differ = truth_of(line.value) != truth_of(first->value);
      std::istringstream numbers(line.value), others(first->value);
      for (double a = 0.0, b = 0.0; numbers >> a && others >> b;) {
        differ = differ || std::abs(a - b) > kRounding;
      }
      if (differ) {
        throw Error(path.string() + ": its " + first->key + " is " + first->value + ", its " +
                    line.key + " is " + line.value +
                    ", expected the same by both; delete the one that does not hold");
      }
    }
  }
}

/// The lines of keys that MetaIO knows, in their order, to ElementDataFile, each key once; other
/// lines may hold any text. MetaIO, which keeps names in 255 characters and stumbles over what is
/// no "Key = value", sees those of them that are plain.
std::vector<MetaLine> read_meta_lines(std::istream& file, const fs::path& path,
                                      MetaHeader& header) {
  constexpr std::size_t kMost = 100000;  // lines
  std::vector<MetaLine> known;
  std::set<std::string> keys;
  std::string text;
  for (std::size_t k = 0; k < kMost && std::getline(file, text); ++k) {
    const MetaLine line = meta_line(text);
    const bool first = keys.insert(line.key).second;
    header.has_more = header.has_more || line.text != text;
    if (first && line.key == "Modality") header.modality = meta_modality(line.value);
    if (meta_keys().count(line.key) == 0) {
      const bool word = line.key.find_first_of(" \t") == std::string::npos;
      if (first && word && !line.key.empty() && is_plain(line.text)) {
        header.lines += line.text + "\n";
      } else {
        header.has_more = true;
      }
      continue;
    }
    if (!first) {
      throw Error(path.string() + ": its header has two lines of " + line.key +
                  ", expected one; delete the one that does not hold");
    }
    known.push_back(line);
    if (line.key == "ElementDataFile") break;
  }
  return known;
}

/// Refuses a file without the keys that tell what the voxels are.
void require_meta_keys(const std::vector<MetaLine>& lines, const fs::path& path) {
  const auto is_there = [&](const std::string& key) {
    return std::any_of(lines.begin(), lines.end(),
                       [&](const MetaLine& line) { return line.key == key; });
  };
  std::string lacks;
  int found = 0;
  for (const char* key : {"NDims", "DimSize", "ElementType", "ElementDataFile"}) {
    if (is_there(key)) {
      ++found;
    } else {
      lacks += (lacks.empty() ? "" : ", ") + std::string(key);
    }
  }
  if (lacks.empty()) return;
  if (found == 0)
    throw not_of_format("MetaImage", beginning_of(path), "it has none of its keys", path);
  throw Error(path.string() + ": its header lacks " + lacks +
              ", expected NDims, DimSize, ElementType and last ElementDataFile; add what lacks, or "
              "save it again from the program that made it");
}

/// MetaIO writes past its arrays where a header is not what it expects, and frees what it read
/// twice where it breaks off, so the lines are looked through first: 2 to 4 dimensions, which it is
/// told before what has as many numbers; as many numbers as there should be; no list of files. It
/// is not told the file of the voxels, which it does not read.
MetaHeader read_meta_header(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  MetaHeader header;
  std::vector<MetaLine> lines = read_meta_lines(file, path, header);
  require_meta_keys(lines, path);
  const auto told = std::find_if(lines.begin(), lines.end(),
                                 [](const MetaLine& line) { return line.key == "NDims"; });
  const int dimensions = std::atoi(told->value.c_str());
  if (dimensions < 2 || dimensions > 4) {
    throw wrong_field("NDims", is_plain(told->value) ? told->value : "no number",
                      "3 (or 2 or 4 of which the last has a size of 1)", path);
  }
  const auto vector = std::find_if(lines.begin(), told, [&](const MetaLine& line) {
    return count_meta_numbers(line.key, dimensions) > 1;
  });
  if (vector != told) {
    std::rotate(vector, told, told + 1);
    header.has_more = true;
  }
  std::set<std::string> keys;
  for (MetaLine& line : lines) {
    keys.insert(line.key);
    const int numbers = count_meta_numbers(line.key, dimensions);
    if (numbers >= 0 && !holds_numbers(line.value, numbers)) {
      throw Error(path.string() + ": its " + line.key + " is no text of " +
                  std::to_string(numbers) + (numbers == 1 ? " number" : " numbers") +
                  " up to 1e12 (with a decimal point, not a comma), expected so many; mend the "
                  "header, or save it again from the program that made it");
    }
    if (!is_plain(line.key + " = " + line.value) && line.key != "ElementDataFile") {
      throw wrong_field(line.key, "over 250 characters long, or holds letters that are not ASCII",
                        "what MetaImage knows", path);
    }
    require_sound_meta(line, path);
    if (line.key == "ElementDataFile") {
      header.data_file = line.value;
      if (line.value.starts_with("LIST") || line.value.find('%') != std::string::npos) {
        throw voxels_in_list(path, ".mha");
      }
      if (!is_plain(line.text) || line.value.find(' ') != std::string::npos) header.has_more = true;
      std::error_code unknown;
      if (!fs::exists(path.parent_path() / header.data_file, unknown)) {  // as Windows has it
        std::replace(header.data_file.begin(), header.data_file.end(), '\\', '/');
      }
      line.value = "LOCAL";
    }
    if (line.key == "CompressedDataSize") {
      header.packed = std::strtod(line.value.c_str(), nullptr);
    }
    if (line.key == "DistanceUnits") {
      header.mm = meta_unit(line.value, path);
      if (line.value != "?") header.unit = line.value;
    }
    const std::string text = line.key + " = " + line.value;
    header.has_more =
        header.has_more ||
        (line.key == "ElementDataFile" ? !line.text.starts_with(line.key) : text != line.text);
    header.lines += text + "\n";
  }
  require_one_meaning(lines, path);
  header.has_spacing = keys.count("ElementSpacing") + keys.count("ElementSize") > 0;
  header.has_place = keys.count("Offset") + keys.count("Position") + keys.count("Origin") > 0;
  header.end = static_cast<std::streamoff>(file.tellg());
  return header;
}

/// Refuses a header that promises more than there is.
void require_whole_meta(const itk::MetaImageIO& io, const MetaHeader& header, const MetaImage& meta,
                        const fs::path& path) {
  const double stored = header.data_file == "LOCAL" ? static_cast<double>(fs::file_size(path)) -
                                                          static_cast<double>(header.end)
                                                    : size_beside(path, header.data_file);
  const double values = count_values(io), bytes = values * io.GetComponentSize();
  if (!meta.BinaryData()) {
    return require_room(2.0 * values - 1.0, stored, 1.0, "MetaImage", path);  // digit, space
  }
  if (!meta.CompressedData()) return require_room(bytes, stored, 1.0, "MetaImage", path);
  require_room(header.packed, stored, 1.0, "MetaImage", path);
  require_room(bytes, stored, kMostDeflated, "MetaImage", path);
}

/// Whether bytes begin as zlib (RFC 1950) or gzip has them.
bool begins_packed(const fs::path& file, std::streamoff start) {
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(start);
  const int first = stream.get(), second = stream.get();
  constexpr int kDeflate = 8;
  return (first == 0x1f && second == 0x8b) ||
         ((first & 0x0f) == kDeflate && second >= 0 && (256 * first + second) % 31 == 0);
}

/// Reads the voxels of a header that was read. MetaIO prints a line where they are cut short or
/// damaged, or where it is not told the size of what is compressed, and returns zeros.
Image read_meta_voxels(const itk::MetaImageIO& io, const MetaHeader& header, const MetaImage& meta,
                       const fs::path& path) {
  Image image;
  image.grid = header_grid(io, path, header.mm);
  require_scalar_volume(io, image.grid, path);
  require_extent(image.grid.size, image.grid.spacing, "DistanceUnits and ElementSpacing", path);
  if (!header.has_place) image.remarks.push_back(placed_nowhere("it has no Offset", "LPS"));
  const bool local = header.data_file == "LOCAL";
  const fs::path file = local ? path : path.parent_path() / header.data_file;
  std::vector<char> bytes(static_cast<std::size_t>(io.GetImageSizeInBytes()));
  std::streamoff start = local ? header.end : 0;
  if (meta.HeaderSize() < -1 || meta.HeaderSize() > static_cast<double>(fs::file_size(file))) {
    throw wrong_field("HeaderSize", std::to_string(meta.HeaderSize()),
                      "-1, or a number of bytes before the voxels in their file", path);
  }
  if (meta.HeaderSize() > 0) start = meta.HeaderSize();
  if (meta.HeaderSize() == -1) {  // the voxels end the file
    start = static_cast<std::streamoff>(fs::file_size(file)) -
            (meta.CompressedData() ? static_cast<std::streamoff>(header.packed)
                                   : static_cast<std::streamoff>(bytes.size()));
  }
  const auto require = [&](bool sound) {
    if (!sound) throw Error(path.string() + ": " + damaged("MetaImage"));
  };
  if (!meta.BinaryData()) {
    std::ifstream text(file);
    text.seekg(start);
    for (std::size_t n = 0; n < image.grid.voxels(); ++n) {
      double value = 0.0;
      require(static_cast<bool>(text >> value));
      image.values.push_back(static_cast<float>(value));
    }
    return image;
  }
  ByteStream stream(file, start, meta.CompressedData());
  if (meta.CompressedData() && !begins_packed(file, start)) {
    throw wrong_field("CompressedData", "True",
                      "False, as its voxels do not begin as zlib or gzip packs them", path);
  }
  require(stream.read(bytes.data(), bytes.size()) && stream.ends_whole());
  if (meta.BinaryDataByteOrderMSB() != (std::endian::native == std::endian::big)) {
    const auto size = static_cast<std::ptrdiff_t>(io.GetComponentSize());
    for (auto at = bytes.begin(); at != bytes.end(); at += size) std::reverse(at, at + size);
  }
  append_numbers(io, bytes, path, image.values);
  require(image.values.size() == image.grid.voxels());
  return image;
}

/// A file of a name that nobody else has, gone at the end.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& ending) {
    std::string name = (fs::temp_directory_path() / "wireplan-XXXXXX").string() + ending;
    const int file = ::mkstemps(name.data(), static_cast<int>(ending.size()));
    if (file < 0) throw DiskError(name + ": cannot be written; make room there or set TMPDIR");
    ::close(file);
    path_ = name;
  }
  ~TemporaryFile() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

Image read_meta(const fs::path& path, VolumeHeader& told) {
  const std::string no_image =
      "its header reads as MetaImage, but MetaIO does not understand it; save it again from the "
      "program that made it";
  const MetaHeader header = call_itk(path, no_image, [&] { return read_meta_header(path); });
  std::optional<TemporaryFile> copy;  // of the lines that MetaIO is to see, where it must be
  const std::string ending = path.extension().string();
  if (header.has_more || ending != lower_case(ending)) {
    copy.emplace(lower_case(ending));
    std::ofstream to(copy->path(), std::ios::binary);
    to << header.lines;
    if (!to.flush()) {
      throw DiskError(copy->path().string() + ": cannot be written; make room there or set TMPDIR");
    }
  }
  const itk::MetaImageIO::Pointer io = itk::MetaImageIO::New();
  call_itk(path, no_image, [&] {
    const fs::path& file = copy ? copy->path() : path;
    io->SetFileName(file.string());
    if (!io->CanReadFile(file.c_str())) throw Error(path.string() + ": " + no_image);
    io->ReadImageInformation();
    told.format = "MetaImage";
    told.length_unit = header.unit;
    told.mm_per_unit = header.mm;
    tell_header(*io, told);
    if (header.has_spacing) return;
    told.spacing.setZero();  // where MetaIO says 1
    throw lacks_spacing("ElementSpacing",
                        "add the line \"ElementSpacing = a b c\" with the voxels' sizes", path);
  });
  const MetaImage& meta = *io->GetMetaImagePointer();
  if (io->GetNumberOfComponents() != 1) throw several_values(io->GetNumberOfComponents(), path);
  require_whole_meta(*io, header, meta, path);
  Image image = call_itk(path, damaged("MetaImage"),
                         [&] { return read_meta_voxels(*io, header, meta, path); });
  image.modality = header.modality;
  scale_values(meta.ElementToIntensityFunctionSlope(), meta.ElementToIntensityFunctionOffset(),
               image.values);
  return image;
}

bool ends_with(const fs::path& path, const char* one, const char* other) {
  const std::string name = lower_case(path.filename().string());
  return name.ends_with(one) || name.ends_with(other);
}

/// Why a file of another ending is none that is read.
std::string no_volume(const fs::path& path) {
  if (ends_with(path, ".hdr", ".img") || ends_with(path, ".hdr.gz", ".img.gz")) {
    return "one of a pair of files (.hdr and .img, of NIfTI or Analyze), expected header and "
           "voxels in one file; save it as .nii.gz";
  }
  if (ends_with(path, ".nrrd.gz", ".nhdr.gz") || ends_with(path, ".mha.gz", ".mhd.gz")) {
    return "packed by gzip as a whole, expected its voxels alone to be packed; unpack it, e.g. by "
           "gunzip";
  }
  return std::string("not an image that wireplan reads; ") + kFormats;
}

}  // namespace

Image read_file(const fs::path& path, const std::string& series, VolumeHeader& told) {
  const bool nifti = ends_with(path, ".nii", ".nii.gz");
  const bool nrrd = ends_with(path, ".nrrd", ".nhdr"), meta = ends_with(path, ".mha", ".mhd");
  if (!nifti && !nrrd && !meta && check_dicom(path) != DicomForm::kNone) {
    told.format = "DICOM";
    return call_itk(path, damaged("DICOM"), [&] { return read_dicom(path, series); });
  }
  if (!series.empty()) {
    throw Error(path.string() + ": series \"" + series +
                "\" of a file, expected a folder of DICOM files; a file holds one volume");
  }
  if (nifti) return read_nifti(path, told);
  if (nrrd) return std::move(read_nrrd(path, told, false).front());
  if (meta) return read_meta(path, told);
  throw Error(path.string() + ": " + no_volume(path));
}

std::vector<Image> read_layers(const fs::path& path, VolumeHeader& told) {
  if (ends_with(path, ".nrrd", ".nhdr") && fs::is_regular_file(path)) {
    silence_libraries();
    return read_nrrd(path, told, true);
  }
  return {read_told(path, "", told)};
}

}  // namespace wireplan::preprocess
