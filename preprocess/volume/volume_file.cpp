#include "preprocess/volume/volume_file.h"

#include <unistd.h>

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <array>
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
        throw Error(path.string() + ": its voxels lie in a list of files, expected them in one; " +
                    "save the volume as one .mha file");
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

/// MetaIO only prints a line when a file is cut short.
void require_whole_meta(const itk::ImageIOBase& io, const MetaHeader& header,
                        const fs::path& path) {
  const double needed =
      header.packed > 0.0 ? header.packed : static_cast<double>(io.GetImageSizeInBytes());
  const fs::path elsewhere = path.parent_path() / header.data_file;
  double stored = std::numeric_limits<double>::infinity();  // no such file: ITK says so
  if (header.data_file == "LOCAL") {
    stored = static_cast<double>(fs::file_size(path)) - static_cast<double>(header.end);
  } else if (fs::is_regular_file(elsewhere)) {
    stored = static_cast<double>(fs::file_size(elsewhere));
  }
  if (stored < needed && io.GetFileType() == itk::IOFileEnum::Binary) {
    throw Error(path.string() + ": " + damaged("MetaImage"));
  }
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
  std::optional<TemporaryFile> copy;  // without the lines that MetaIO is not to see
  if (header.has_more) {
    copy.emplace(path.extension().string());
    std::ifstream from(path, std::ios::binary);
    from.seekg(header.end);
    std::ofstream to(copy->path(), std::ios::binary);
    to << header.lines;
    if (header.data_file == "LOCAL") to << from.rdbuf();
    if (!to.flush()) {
      throw DiskError(copy->path().string() + ": cannot be written; make room there or set TMPDIR");
    }
  }
  const itk::MetaImageIO::Pointer io = itk::MetaImageIO::New();
  const fs::path& file = copy ? copy->path() : path;
  call_itk(path, no_image, [&] {
    io->SetFileName(file.string());
    if (!io->CanReadFile(file.c_str())) throw Error(path.string() + ": " + no_image);
    io->ReadImageInformation();
    told.format = "MetaImage";
    told.length_unit = header.unit;
    told.mm_per_unit = header.mm;
    tell_header(*io, told);
    require_whole_meta(*io, header, path);
  });
  Image image = call_itk(path, damaged("MetaImage"), [&] { return read_volume(*io, path); });
  image.grid.spacing *= header.mm;
  image.grid.origin *= header.mm;

  // ITK does not apply the scale.
  const auto* header_of_io = io->GetMetaImagePointer();
  scale_values(header_of_io->ElementToIntensityFunctionSlope(),
               header_of_io->ElementToIntensityFunctionOffset(), image.values);
  return image;
}

/// The fields of an NRRD's header, "name: value", in small letters; none where it is no NRRD.
std::map<std::string, std::string> nrrd_fields(const fs::path& path) {
  std::map<std::string, std::string> fields;
  std::ifstream file(path, std::ios::binary);
  std::string line;
  if (!std::getline(file, line) || !line.starts_with("NRRD")) return fields;
  constexpr std::size_t kMost = 10000;  // lines
  while (fields.size() < kMost && std::getline(file, line) && !trimmed(line).empty()) {
    const std::size_t colon = line.find(": ");
    if (line.front() == '#' || colon == std::string::npos) continue;
    fields[lower_case(trimmed(line.substr(0, colon)))] =
        lower_case(trimmed(line.substr(colon + 2)));
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
std::vector<Image> read_values(itk::ImageIOBase& io, const fs::path& path) {
  constexpr unsigned kMost = 250;
  const std::size_t count = io.GetNumberOfComponents();
  const Grid grid = header_grid(io, path);
  require_volume(grid, path);
  if (count > kMost) throw several_values(io.GetNumberOfComponents(), path);
  std::vector<float> values;
  append_voxels(io, path, values);
  if (values.size() != count * grid.voxels()) throw Error(path.string() + ": " + damaged("NRRD"));
  std::vector<Image> layers(count, {.grid = grid, .values = std::vector<float>(grid.voxels())});
  for (std::size_t n = 0; n < values.size(); ++n) layers[n % count].values[n / count] = values[n];
  return layers;
}

/// All values of a voxel where `layered`, and else one.
std::vector<Image> read_nrrd(const fs::path& path, VolumeHeader& told, bool layered) {
  const std::string no_image = std::string("not a NRRD image, or damaged; ") + kFormats;
  const std::map<std::string, std::string> fields = nrrd_fields(path);
  tell_nrrd(fields, path, told);
  static const std::set<std::string> kEncodings = {"raw",  "gzip", "gz", "ascii",
                                                   "text", "txt",  "hex"};
  const auto encoding = fields.find("encoding");
  if (encoding != fields.end() && kEncodings.count(encoding->second) == 0) {
    throw Error(path.string() + ": its voxels are packed with \"" + encoding->second +
                "\", expected raw or gzip; save it again with gzip, as 3D Slicer does");
  }
  const double mm = nrrd_unit(fields, path);
  const itk::NrrdImageIO::Pointer io = itk::NrrdImageIO::New();
  call_itk(path, no_image, [&] {
    io->SetFileName(path.string());
    if (!io->CanReadFile(path.c_str())) throw Error(path.string() + ": " + no_image);
    io->ReadImageInformation();
    told.mm_per_unit = mm;
    tell_header(*io, told);
  });
  std::vector<Image> layers = call_itk(path, damaged("NRRD"), [&] {
    return layered && io->GetNumberOfComponents() > 1 ? read_values(*io, path)
                                                      : std::vector{read_volume(*io, path)};
  });
  for (Image& layer : layers) {
    layer.grid.spacing *= mm;
    layer.grid.origin *= mm;
  }
  return layers;
}

bool ends_with(const fs::path& path, const char* one, const char* other) {
  const std::string name = lower_case(path.filename().string());
  return name.ends_with(one) || name.ends_with(other);
}

}  // namespace

Image read_volume(itk::ImageIOBase& io, const fs::path& path) {
  Image image;
  image.grid = header_grid(io, path);
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
