#include "preprocess/volume/volume_file.h"

#include <zlib.h>

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

#include "itkMetaDataObject.h"
#include "itkMetaImageIO.h"
#include "itkNiftiImageIO.h"
#include "itkNrrdImageIO.h"
#include "preprocess/volume/dicom_check.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

FileFormat format_of(const fs::path& path) {
  const std::string name = lower_case(path.filename().string());
  if (name.ends_with(".nii") || name.ends_with(".nii.gz")) {
    return {"NIfTI", itk::NiftiImageIO::New().GetPointer()};
  }
  if (name.ends_with(".nrrd") || name.ends_with(".nhdr")) {
    return {"NRRD", itk::NrrdImageIO::New().GetPointer()};
  }
  if (name.ends_with(".mha") || name.ends_with(".mhd")) {
    return {"MetaImage", itk::MetaImageIO::New().GetPointer()};
  }
  return {};
}

/// A number of a NIfTI header, which ITK hands on as text.
double nifti_value(const itk::ImageIOBase& io, const std::string& key) {
  std::string text;
  itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), key, text);
  return std::strtod(text.c_str(), nullptr);
}

/// Corrects what ITK makes of scales in headers: that of a MetaImage is not applied, and of a NIfTI
/// slope of 0, which means no scaling, the intercept is.
void correct_scale(itk::ImageIOBase& io, Image& image) {
  double slope = 1.0, offset = 0.0;
  if (auto* meta = dynamic_cast<itk::MetaImageIO*>(&io)) {
    slope = meta->GetMetaImagePointer()->ElementToIntensityFunctionSlope();
    offset = meta->GetMetaImagePointer()->ElementToIntensityFunctionOffset();
  } else if (dynamic_cast<itk::NiftiImageIO*>(&io) != nullptr &&
             nifti_value(io, "scl_slope") == 0.0) {
    offset = -nifti_value(io, "scl_inter");
  }
  if (slope != 1.0 || offset != 0.0) {
    for (float& value : image.values) {
      value = static_cast<float>(slope * value + offset);
    }
  }
}

/// niftilib fills up a file that is cut short with zeros, so its size [bytes] is compared with what
/// the header promises. A compressed file ends with its size before compression, modulo 2^32 (RFC
/// 1952); 0 there is the mark of a file in several blocks, which is let pass.
void require_whole_nifti(const itk::ImageIOBase& io, const fs::path& path) {
  const double needed = std::max(0.0, nifti_value(io, "vox_offset")) +
                        std::max(1.0, nifti_value(io, "bitpix") / 8.0) *
                            static_cast<double>(io.GetImageSizeInPixels());
  double stored = static_cast<double>(fs::file_size(path));
  double most = std::numeric_limits<double>::infinity();
  if (lower_case(path.extension().string()) == ".gz") {
    std::array<unsigned char, 4> size{};
    std::ifstream file(path, std::ios::binary);
    file.seekg(-4, std::ios::end);
    file.read(reinterpret_cast<char*>(size.data()), size.size());
    stored = size[0] + 256.0 * (size[1] + 256.0 * (size[2] + 256.0 * size[3]));
    if (stored == 0.0 || needed >= 4294967296.0) {
      return;
    }
    most = needed + 1e6;  // beyond a little padding it is no size but the middle of the data
  }
  if (!(stored >= needed && stored <= most)) {
    throw Error(path.string() + ": " + damaged("NIfTI"));
  }
}

/// ITK takes what lacks the mark of a NIfTI-1 file for Analyze, whose header promises nothing, and
/// its matrices end the program, or never, on what is not finite or far too small; so the mark, the
/// spacing and the two transforms are looked at first (offsets: nifti1.h).
void require_nifti_header(const fs::path& path, const std::string& no_image) {
  std::array<unsigned char, 348> header{};
  const gzFile file = gzopen(path.c_str(), "rb");  // reads what is not compressed too
  const int count = file == nullptr ? 0 : gzread(file, header.data(), header.size());
  if (file != nullptr) gzclose(file);
  const bool is_nifti = header[344] == 'n' && header[345] == '+' && header[346] == '1';
  if (count != static_cast<int>(header.size()) || !is_nifti) {
    throw Error(path.string() + ": " + no_image);
  }
  // In which order the bytes are, nifticlib tells by the number of dimensions, 1 to 7.
  const bool swapped = header[41] != 0 || header[40] < 1 || header[40] > 7;
  // Distances and places are below a kilometre, steps of time and the like below any unit's.
  struct Floats {
    std::size_t begin, end;
    float largest;
  };
  constexpr float kSmallest = 1e-30F;  // but 0: no rounding leaves less
  constexpr std::array<Floats, 3> kFloats = {{{76, 92, 1e6F}, {92, 108, 1e12F}, {256, 328, 1e6F}}};
  for (const auto& [begin, end, largest] : kFloats) {
    for (std::size_t at = begin; at < end; at += sizeof(float)) {
      std::array<unsigned char, sizeof(float)> bytes{};
      for (std::size_t k = 0; k < bytes.size(); ++k) {
        bytes[k] = header[at + (swapped ? bytes.size() - 1 - k : k)];
      }
      const float size = std::abs(std::bit_cast<float>(bytes));
      if (size == 0.0F || (size >= kSmallest && size <= largest)) continue;
      throw Error(path.string() + ": " + damaged("NIfTI"));
    }
  }
}

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

/// MetaIO writes past its arrays where a header is not what it expects, and frees what it read
/// twice where it breaks off, so the lines are looked through first: "Key = value" of plain text
/// that fits into its buffers, no key twice, to ElementDataFile; 2 to 4 dimensions, told before
/// what has as many numbers; as many numbers as there should be; no list of files.
void require_meta_header(const fs::path& path, const std::string& no_image) {
  constexpr std::size_t kLongest = 250;  // of a line: MetaIO keeps names in 255 characters
  const auto require = [&](bool sound) {
    if (!sound) throw Error(path.string() + ": " + no_image);
  };
  std::ifstream file(path, std::ios::binary);
  std::set<std::string> keys;
  int dimensions = 0;
  for (std::string line; keys.count("ElementDataFile") == 0 && std::getline(file, line);) {
    const std::size_t end = line.find_first_of(" ="), equals = line.find('=');
    const std::string key = line.substr(0, end);
    const bool plain = std::all_of(line.begin(), line.end(), [](char c) {
      return (c >= ' ' && c <= '~') || c == '\t' || c == '\r';
    });
    require(plain && line.size() <= kLongest && equals != std::string::npos &&
            equals <= line.find_first_not_of(' ', end) && keys.insert(key).second);
    const std::string value = line.substr(equals + 1);
    if (key == "NDims") dimensions = std::atoi(value.c_str());
    require(dimensions >= 0 && dimensions <= 4);
    const int numbers = count_meta_numbers(key, dimensions);
    require(numbers != 0 && (numbers < 0 || holds_numbers(value, numbers)));
    const std::size_t name = std::min(value.find_first_not_of(" \t"), value.size());
    if (key == "ElementDataFile" &&
        (value.compare(name, 4, "LIST") == 0 || value.find('%') != std::string::npos)) {
      throw Error(path.string() + ": its voxels lie in a list of files, expected them in one; " +
                  "save the volume as one .mha file");
    }
  }
  require(dimensions >= 2);
  for (const char* key : {"DimSize", "ElementType", "ElementDataFile"})
    require(keys.count(key) > 0);
}

/// The same for MetaImage, where MetaIO only prints a line when a file is cut short.
void require_whole_meta(const itk::ImageIOBase& io, const fs::path& path) {
  double needed = static_cast<double>(io.GetImageSizeInBytes());
  std::ifstream file(path, std::ios::binary);
  std::string line, data_file;
  while (data_file.empty() && std::getline(file, line)) {
    std::istringstream words(line);
    std::string key, equals;
    words >> key >> equals;
    if (key == "CompressedDataSize") {
      words >> needed;
    } else if (key == "ElementDataFile") {
      std::getline(words >> std::ws, data_file);
    }
  }
  while (!data_file.empty() && std::isspace(static_cast<unsigned char>(data_file.back())) != 0) {
    data_file.pop_back();
  }

  double stored = std::numeric_limits<double>::infinity();  // no such file: ITK says so
  if (data_file == "LOCAL") {
    stored = static_cast<double>(fs::file_size(path)) - static_cast<double>(file.tellg());
  } else if (fs::is_regular_file(path.parent_path() / data_file)) {
    stored = static_cast<double>(fs::file_size(path.parent_path() / data_file));
  }
  if (stored < needed && io.GetFileType() == itk::IOFileEnum::Binary) {
    throw Error(path.string() + ": " + damaged("MetaImage"));
  }
}

}  // namespace

Image read_volume(itk::ImageIOBase& io, const fs::path& path) {
  Image image;
  image.grid = header_grid(io, path);
  require_scalar_volume(io, image.grid, path);
  append_voxels(io, path, image.values);
  correct_scale(io, image);
  return image;
}

FileFormat open_file(const fs::path& path) {
  FileFormat format = format_of(path);
  if (!format.io) {
    if (check_dicom(path) != DicomForm::kNone) {
      throw Error(path.string() +
                  ": a single DICOM file; give the folder that holds the whole series");
    }
    throw Error(path.string() + ": not an image that wireplan reads; " + kFormats);
  }
  const std::string no_image = "not a " + format.name + " image, or damaged; " + kFormats;
  call_itk(path, no_image, [&] {
    if (format.name == "MetaImage") require_meta_header(path, no_image);
    if (format.name == "NIfTI") require_nifti_header(path, no_image);
    format.io->SetFileName(path.string());
    if (!format.io->CanReadFile(path.c_str())) {
      throw Error(path.string() + ": " + no_image);
    }
    format.io->ReadImageInformation();
    if (format.name == "NIfTI") {
      require_whole_nifti(*format.io, path);
    } else if (format.name == "MetaImage") {
      require_whole_meta(*format.io, path);
    }
  });
  return format;
}

}  // namespace wireplan::preprocess
