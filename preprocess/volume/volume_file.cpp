#include "preprocess/volume/volume_file.h"

#include <unistd.h>

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "itkMetaImageIO.h"
#include "itkNrrdImageIO.h"
#include "preprocess/volume/byte_stream.h"
#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/nifti_file.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

/// How many numbers stand behind a key of a MetaImage's header (metaImage.cxx, metaObject.cxx); -1
/// where it is text, or a key of somebody's own.
int count_meta_numbers(const std::string& key, int dimensions) {
  static const std::set<std::string> kOne = {"ID",
                                             "ParentID",
                                             "CompressedDataSize",
                                             "HeaderSize",
                                             "ElementMin",
                                             "ElementNumberOfChannels",
                                             "ElementNBits",
                                             "ElementMax",
                                             "ElementToIntensityFunctionSlope",
                                             "NDims",
                                             "ElementToIntensityFunctionOffset"};
  static const std::set<std::string> kVector = {"DimSize",     "Offset",           "Position",
                                                "Origin",      "CenterOfRotation", "ElementSpacing",
                                                "ElementSize", "SequenceID"};
  static const std::set<std::string> kMatrix = {"TransformMatrix", "Rotation", "Orientation"};
  if (kOne.count(key) > 0) return 1;
  if (kVector.count(key) > 0) return dimensions;
  return kMatrix.count(key) > 0 ? dimensions * dimensions : -1;
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
  bool has_more = false;   // lines that it is not to see
  std::string data_file;   // "LOCAL", or where the voxels are
  std::streamoff end = 0;  // where voxels of this file begin
  double packed = 0.0;     // bytes, where the voxels are compressed
  std::string unit;        // of length, as it is told
  double mm = 1.0;         // of a unit of length
};

Error voxels_in_list(const fs::path& path, const std::string& ending) {
  return Error(path.string() + ": its voxels lie in a list of files, expected them in one; " +
               "save the volume as one " + ending + " file");
}

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\r"), last = text.find_last_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

double meta_unit(const std::string& unit, const fs::path& path) {
  const std::string name = lower_case(unit);
  if (name == "mm" || name == "?" || name.empty()) return 1.0;
  if (name == "um") return 1e-3;
  if (name == "cm") return 10.0;
  throw Error(path.string() + ": DistanceUnits is " + unit +
              ", expected um, mm or cm; mend the header");
}

/// MetaIO writes past its arrays where a header is not what it expects, and frees what it read
/// twice where it breaks off, so the lines are looked through first: "Key = value", no key twice,
/// to ElementDataFile; 2 to 4 dimensions, told before what has as many numbers; as many numbers as
/// there should be; no list of files. Lines of other keys may hold any text; MetaIO, which keeps
/// names in 255 characters, sees those of them that are short and plain.
MetaHeader read_meta_header(const fs::path& path, const std::string& no_image) {
  static const std::set<std::string> kNeeded = {
      "ObjectType",          "BinaryData",     "BinaryDataByteOrderMSB",
      "ElementByteOrderMSB", "CompressedData", "ElementType",
      "ElementDataFile",     "DistanceUnits",  "AnatomicalOrientation"};
  constexpr std::size_t kLongest = 250;
  const auto require = [&](bool sound) {
    if (!sound) throw Error(path.string() + ": " + no_image);
  };
  std::ifstream file(path, std::ios::binary);
  MetaHeader header;
  std::set<std::string> keys;
  int dimensions = 0;
  for (std::string line; keys.count("ElementDataFile") == 0 && std::getline(file, line);) {
    const std::size_t end = line.find_first_of(" ="), equals = line.find('=');
    const std::string key = line.substr(0, end);
    const bool plain = std::all_of(line.begin(), line.end(), [](char c) {
      return (c >= ' ' && c <= '~') || c == '\t' || c == '\r';
    });
    require(equals != std::string::npos && equals <= line.find_first_not_of(' ', end));
    const std::string value = trimmed(line.substr(equals + 1));
    if (key == "NDims") dimensions = std::atoi(value.c_str());
    require(dimensions >= 0 && dimensions <= 4);
    const int numbers = count_meta_numbers(key, dimensions);
    const bool needed = numbers >= 0 || kNeeded.count(key) > 0;
    const bool first = keys.insert(key).second;
    if (!needed && !(plain && first && line.size() <= kLongest)) {
      header.has_more = true;
      continue;
    }
    require(plain && first && line.size() <= kLongest && numbers != 0 &&
            (numbers < 0 || holds_numbers(value, numbers)));
    if (key == "ElementDataFile") {
      header.data_file = value;
      if (value.starts_with("LIST") || value.find('%') != std::string::npos) {
        throw voxels_in_list(path, ".mha");
      }
      const fs::path elsewhere = fs::absolute(path).parent_path() / value;
      line = key + " = " + (value == "LOCAL" ? value : elsewhere.string());
    }
    if (key == "CompressedDataSize") header.packed = std::strtod(value.c_str(), nullptr);
    if (key == "DistanceUnits") {
      header.mm = meta_unit(value, path);
      if (value != "?") header.unit = value;
    }
    header.lines += line + "\n";
  }
  require(dimensions >= 2);
  for (const char* key : {"DimSize", "ElementType", "ElementDataFile"})
    require(keys.count(key) > 0);
  header.end = static_cast<std::streamoff>(file.tellg());
  return header;
}

/// The size of the file beside a header that holds its voxels [bytes].
double size_beside(const fs::path& header, const std::string& name) {
  const fs::path file = header.parent_path() / name;
  std::error_code unknown;
  if (fs::is_regular_file(file, unknown)) {
    const auto size = fs::file_size(file, unknown);
    if (!unknown) return static_cast<double>(size);
  }
  throw Error(header.string() + ": its voxels lie in " + name +
              ", which is no file that can be read; put it where the header names it, or save the "
              "volume as one file");
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

/// Reads the voxels of a header that was read. MetaIO prints a line where they are cut short or
/// damaged, or where it is not told the size of what is compressed, and returns zeros.
Image read_meta_voxels(const itk::MetaImageIO& io, const MetaHeader& header, const MetaImage& meta,
                       const fs::path& path) {
  Image image;
  image.grid = header_grid(io, path, header.mm);
  require_scalar_volume(io, image.grid, path);
  const bool local = header.data_file == "LOCAL";
  const fs::path file = local ? path : path.parent_path() / header.data_file;
  std::vector<char> bytes(static_cast<std::size_t>(io.GetImageSizeInBytes()));
  std::streamoff start = local ? header.end : 0;
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
  const std::string no_image = std::string("not a MetaImage image, or damaged; ") + kFormats;
  const MetaHeader header =
      call_itk(path, no_image, [&] { return read_meta_header(path, no_image); });
  std::optional<TemporaryFile> copy;  // of the lines that MetaIO is to see, where there are others
  if (header.has_more) {
    copy.emplace(path.extension().string());
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
  });
  const MetaImage& meta = *io->GetMetaImagePointer();
  require_whole_meta(*io, header, meta, path);
  Image image = call_itk(path, damaged("MetaImage"),
                         [&] { return read_meta_voxels(*io, header, meta, path); });
  scale_values(meta.ElementToIntensityFunctionSlope(), meta.ElementToIntensityFunctionOffset(),
               image.values);
  return image;
}

/// The fields of an NRRD's header, "name: value", in small letters but for the name of a file; none
/// where it is no NRRD. NrrdIO writes a line that it does not understand into 1024 characters of
/// its stack, so long ones are refused: all but comments, what somebody adds as "key:=value", and
/// "content", which is taken as it is.
std::map<std::string, std::string> nrrd_fields(const fs::path& path, const std::string& no_image) {
  constexpr std::size_t kMost = 10000, kLongest = 500;  // lines, characters
  std::map<std::string, std::string> fields;
  std::ifstream file(path, std::ios::binary);
  std::string line;
  const auto require = [&](bool sound) {
    if (!sound) throw Error(path.string() + ": " + no_image);
  };
  if (!std::getline(file, line) || !line.starts_with("NRRD")) return fields;
  require(line.size() <= kLongest);
  while (std::getline(file, line) && !trimmed(line).empty()) {
    const std::size_t colon = line.find(": ");
    const bool added = line.find(":=") < colon;
    if (line.front() == '#') continue;
    std::string name = lower_case(trimmed(line.substr(0, colon)));
    require(fields.size() < kMost && (line.size() <= kLongest || added || name == "content"));
    if (colon == std::string::npos) continue;
    if (name == "datafile") name = "data file";
    const std::string value = trimmed(line.substr(colon + 2));
    fields[name] = name == "data file" ? value : lower_case(value);
  }
  return fields;
}

/// Of the unit that all axes of space have; mm where none is told.
double nrrd_unit(const std::map<std::string, std::string>& fields, const fs::path& path) {
  const auto found = fields.find("space units");
  if (found == fields.end()) return 1.0;
  static const std::map<std::string, double> kUnits = {
      {"", 1.0},    {"mm", 1.0},          {"millimeter", 1.0},  {"millimeters", 1.0},
      {"cm", 10.0}, {"centimeter", 10.0}, {"m", 1000.0},        {"meter", 1000.0},
      {"um", 1e-3}, {"micron", 1e-3},     {"micrometer", 1e-3}, {"\xc2\xb5m", 1e-3}};
  std::set<double> scales;
  std::istringstream text(found->second);
  for (std::string unit; text >> std::quoted(unit);) {
    const auto known = kUnits.find(trimmed(unit));
    scales.insert(known == kUnits.end() ? 0.0 : known->second);
  }
  if (scales.size() != 1 || *scales.begin() == 0.0) {
    throw Error(path.string() + ": space units " + found->second +
                ", expected one of mm, cm, m, um for all axes; mend the header");
  }
  return *scales.begin();
}

/// Refuses places beyond any patient's: where an axis is longer than a number can be, ITK says 1
/// mm.
void require_near(const std::map<std::string, std::string>& fields, const fs::path& path) {
  constexpr double kFar = 1e6;  // a kilometre in mm; in m beyond all bounds
  for (const char* key : {"space directions", "space origin"}) {
    const auto found = fields.find(key);
    if (found == fields.end()) continue;
    std::string text = found->second;
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
    std::istringstream words(text);
    for (std::string word; words >> word;) {
      if (word == "none" || std::abs(std::strtod(word.c_str(), nullptr)) <= kFar) continue;
      throw Error(path.string() + ": " + key + " has " + word.substr(0, 40) +
                  ", expected numbers within a kilometre; mend the header");
    }
  }
}

/// The segments that 3D Slicer names in a header ("Segment0_Name:=aorta").
std::vector<NamedSegment> nrrd_segments(const fs::path& path) {
  std::map<int, NamedSegment> segments;
  std::ifstream file(path, std::ios::binary);
  constexpr std::size_t kLongest = 100000;  // lines
  std::string line;
  for (std::size_t k = 0; k < kLongest && std::getline(file, line) && !trimmed(line).empty(); ++k) {
    int number = 0, read = 0;
    if (std::sscanf(line.c_str(), "Segment%6d_%n", &number, &read) != 1 || read == 0) continue;
    const std::string field = trimmed(line.substr(static_cast<std::size_t>(read)));
    const auto value_of = [&](const std::string& key) -> std::optional<std::string> {
      if (!field.starts_with(key + ":=")) return std::nullopt;
      return field.substr(key.size() + 2);
    };
    if (const auto name = value_of("Name")) segments[number].name = *name;
    if (const auto value = value_of("LabelValue"))
      segments[number].value = std::atoi(value->c_str());
    if (const auto layer = value_of("Layer")) segments[number].layer = std::atoi(layer->c_str());
  }
  std::vector<NamedSegment> result;
  for (const auto& [number, segment] : segments) result.push_back(segment);
  return result;
}

/// What the fields of a header tell, sound or not, before ITK is asked.
void tell_nrrd(const std::map<std::string, std::string>& fields, const fs::path& path,
               VolumeHeader& told) {
  if (fields.empty()) return;
  told.format = "NRRD";
  told.segments = nrrd_segments(path);
  const auto value = [&](const char* key) {
    const auto found = fields.find(key);
    return found == fields.end() ? std::string() : found->second;
  };
  told.stored_as = value("type");
  std::istringstream units(value("space units"));
  units >> std::quoted(told.length_unit);
  std::istringstream sizes(value("sizes"));
  std::array<int, 3> size{};
  if (sizes >> size[0] >> size[1] >> size[2]) told.size = size;
}

/// Volumes whose voxels have several values, one for each of these.
std::vector<Image> read_values(itk::ImageIOBase& io, const fs::path& path, double mm_per_unit) {
  constexpr unsigned kMost = 250;
  const std::size_t count = io.GetNumberOfComponents();
  const Grid grid = header_grid(io, path, mm_per_unit);
  require_volume(grid, path);
  if (count > kMost) throw several_values(io.GetNumberOfComponents(), path);
  std::vector<float> values;
  append_voxels(io, path, values);
  if (values.size() != count * grid.voxels()) throw Error(path.string() + ": " + damaged("NRRD"));
  std::vector<Image> layers(count, {.grid = grid, .values = std::vector<float>(grid.voxels())});
  for (std::size_t n = 0; n < values.size(); ++n) layers[n % count].values[n / count] = values[n];
  return layers;
}

/// The file beside the header that holds the voxels; empty where they lie behind the header. Lists
/// are refused: NrrdIO prints numbers into names as the header tells it to.
std::string nrrd_data_file(const std::map<std::string, std::string>& fields, const fs::path& path) {
  const auto found = fields.find("data file");
  if (found == fields.end()) return {};
  if (lower_case(found->second).starts_with("list") ||
      found->second.find('%') != std::string::npos) {
    throw voxels_in_list(path, ".nrrd");
  }
  return found->second;
}

/// NrrdIO takes the room that a header asks for, however few bytes are stored.
void require_whole_nrrd(const itk::ImageIOBase& io, const std::string& encoding, double stored,
                        const fs::path& path) {
  const double values = count_values(io), bytes = values * io.GetComponentSize();
  if (encoding.starts_with("gz")) return require_room(bytes, stored, kMostDeflated, "NRRD", path);
  const bool text = encoding == "ascii" || encoding == "text" || encoding == "txt";
  require_room(text ? 2.0 * values - 1.0 : bytes, stored, 1.0, "NRRD", path);  // digit, space
}

/// All values of a voxel where `layered`, and else one.
std::vector<Image> read_nrrd(const fs::path& path, VolumeHeader& told, bool layered) {
  const std::string no_image = std::string("not a NRRD image, or damaged; ") + kFormats;
  const std::map<std::string, std::string> fields = nrrd_fields(path, no_image);
  tell_nrrd(fields, path, told);
  static const std::set<std::string> kEncodings = {"raw",  "gzip", "gz", "ascii",
                                                   "text", "txt",  "hex"};
  const auto found = fields.find("encoding");
  const std::string encoding = found == fields.end() ? "raw" : found->second;
  if (kEncodings.count(encoding) == 0) {
    throw Error(path.string() + ": its voxels are packed with \"" + encoding +
                "\", expected raw or gzip; save it again with gzip, as 3D Slicer does");
  }
  require_near(fields, path);
  const std::string beside = nrrd_data_file(fields, path);
  const double stored =  // bytes; NrrdIO would wait for a pipe
      beside.empty() ? static_cast<double>(fs::file_size(path)) : size_beside(path, beside);
  const double mm = nrrd_unit(fields, path);
  const itk::NrrdImageIO::Pointer io = itk::NrrdImageIO::New();
  call_itk(path, no_image, [&] {
    io->SetFileName(path.string());
    if (!io->CanReadFile(path.c_str())) throw Error(path.string() + ": " + no_image);
    io->ReadImageInformation();
    told.mm_per_unit = mm;
    tell_header(*io, told);
  });
  return call_itk(path, damaged("NRRD"), [&] {
    require_whole_nrrd(*io, encoding, stored, path);
    return layered && io->GetNumberOfComponents() > 1 ? read_values(*io, path, mm)
                                                      : std::vector{read_volume(*io, path, mm)};
  });
}

bool ends_with(const fs::path& path, const char* one, const char* other) {
  const std::string name = lower_case(path.filename().string());
  return name.ends_with(one) || name.ends_with(other);
}

}  // namespace

Image read_volume(itk::ImageIOBase& io, const fs::path& path, double mm_per_unit) {
  Image image;
  image.grid = header_grid(io, path, mm_per_unit);
  require_scalar_volume(io, image.grid, path);
  append_voxels(io, path, image.values);
  return image;
}

Image read_file(const fs::path& path, VolumeHeader& told) {
  if (ends_with(path, ".nii", ".nii.gz")) return read_nifti(path, told);
  if (ends_with(path, ".nrrd", ".nhdr")) return std::move(read_nrrd(path, told, false).front());
  if (ends_with(path, ".mha", ".mhd")) return read_meta(path, told);
  if (check_dicom(path) != DicomForm::kNone) {
    throw Error(path.string() +
                ": a single DICOM file; give the folder that holds the whole series");
  }
  throw Error(path.string() + ": not an image that wireplan reads; " + kFormats);
}

std::vector<Image> read_layers(const fs::path& path, VolumeHeader& told) {
  if (ends_with(path, ".nrrd", ".nhdr") && fs::is_regular_file(path)) {
    silence_libraries();
    return read_nrrd(path, told, true);
  }
  return {read_told(path, "", told)};
}

}  // namespace wireplan::preprocess
