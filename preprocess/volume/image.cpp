#include "preprocess/volume/image.h"

#include <zlib.h>

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <Eigen/SVD>
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
#include <string>
#include <system_error>

#include "gdcmReader.h"
#include "gdcmTrace.h"
#include "itkGDCMImageIO.h"
#include "itkMetaDataObject.h"
#include "itkMetaImageIO.h"
#include "itkNiftiImageIO.h"
#include "itkNrrdImageIO.h"
#include "preprocess/volume/apart.h"
#include "preprocess/volume/dicom_check.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormats =
    "expected a folder with one DICOM series, or a file .nii, .nii.gz, .nrrd, .nhdr, .mha or .mhd";

/// Runs a call into ITK. Whatever it throws becomes an Error that starts with the path and says
/// `problem`; ITK's own text is left out, since it may quote a header and with it a patient.
template <typename Call>
auto call_itk(const fs::path& path, const std::string& problem, Call call) {
  try {
    return call();
  } catch (const Error&) {
    throw;
  } catch (const std::exception&) {
    throw Error(path.string() + ": " + problem);
  }
}

/// ITK and GDCM print warnings that may quote a header; what matters of them becomes an Error.
void silence_libraries() {
  itk::Object::GlobalWarningDisplayOff();
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string to_text(const Vec3& v) {
  std::ostringstream text;
  text << "(" << v.x() << ", " << v.y() << ", " << v.z() << ")";
  return text.str();
}

// ---- geometry -----------------------------------------------------------------------------------

/// The rotation (or reflection) nearest to what the header says, so that Grid may rely on
/// orthonormal columns. Headers round to a few digits; more than 1e-3 off is a sheared image.
Mat3 orthonormal_direction(const Mat3& direction, const fs::path& path) {
  const Eigen::JacobiSVD<Mat3> svd(direction, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3 nearest = svd.matrixU() * svd.matrixV().transpose();
  if (!((direction - nearest).cwiseAbs().maxCoeff() < 1e-3)) {
    throw Error(path.string() +
                ": the axes of the image are not at right angles (sheared), expected an orthogonal "
                "grid; resample it, e.g. in 3D Slicer");
  }
  return nearest;
}

/// Size and placement from a header that has been read; axes beyond the third are ignored.
Grid header_grid(const itk::ImageIOBase& io, const fs::path& path) {
  Grid grid;
  Mat3 direction;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const bool exists = axis < io.GetNumberOfDimensions();
    const auto size = exists ? io.GetDimensions(axis) : 1;
    if (size > static_cast<itk::SizeValueType>(std::numeric_limits<int>::max())) {
      throw Error(path.string() + ": the header gives an axis of " + std::to_string(size) +
                  " voxels; the file is damaged");
    }
    grid.size[axis] = static_cast<int>(size);
    grid.spacing[axis] = exists ? io.GetSpacing(axis) : 1.0;
    grid.origin[axis] = exists ? io.GetOrigin(axis) : 0.0;
    const std::vector<double> column =
        exists ? io.GetDirection(axis)
               : std::vector<double>();  // ITK's default writes past its end
    for (unsigned row = 0; row < 3; ++row) {
      direction(row, axis) = row < column.size() ? column[row] : (row == axis ? 1.0 : 0.0);
    }
  }
  if (!grid.spacing.allFinite() || grid.spacing.minCoeff() <= 0.0 || !grid.origin.allFinite() ||
      !direction.allFinite()) {
    throw Error(path.string() + ": voxel spacing " + to_text(grid.spacing) + " mm at origin " +
                to_text(grid.origin) + " mm, expected positive and finite values; mend the header");
  }
  grid.direction = orthonormal_direction(direction, path);
  return grid;
}

/// wireplan takes one value per voxel and one volume per file.
void require_scalar_volume(const itk::ImageIOBase& io, const Grid& grid, const fs::path& path) {
  if (io.GetNumberOfComponents() != 1) {
    throw Error(path.string() + ": " + std::to_string(io.GetNumberOfComponents()) +
                " values per voxel (a colour or vector image), expected one");
  }
  if (*std::min_element(grid.size.begin(), grid.size.end()) < 2) {
    throw Error(path.string() + ": " + std::to_string(grid.size[0]) + " x " +
                std::to_string(grid.size[1]) + " x " + std::to_string(grid.size[2]) +
                " voxels, expected a volume with at least 2 along each axis");
  }
  for (unsigned axis = 3; axis < io.GetNumberOfDimensions(); ++axis) {
    if (io.GetDimensions(axis) != 1) {
      throw Error(path.string() + ": a series of " + std::to_string(io.GetDimensions(axis)) +
                  " volumes (4D), expected one; export the phase to plan on as a 3D image");
    }
  }
}

// ---- values -------------------------------------------------------------------------------------

template <typename Stored, typename Value>
void append_as(const std::vector<char>& bytes, std::vector<Value>& values) {
  const Stored* first = reinterpret_cast<const Stored*>(bytes.data());
  std::transform(first, first + bytes.size() / sizeof(Stored), std::back_inserter(values),
                 [](Stored v) { return static_cast<Value>(v); });
}

std::string damaged(const std::string& format) {
  return "its header reads as " + format +
         ", but its voxels cannot be read; the file is damaged or cut short: copy or export it "
         "again";
}

/// Reads the voxels of the file whose header `io` has read and appends them.
template <typename Value>
void append_voxels(itk::ImageIOBase& io, const fs::path& path, std::vector<Value>& values) {
  // ImageIO objects want the region spelled out, here all of it
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis) {
    region.SetIndex(axis, 0);
    region.SetSize(axis, io.GetDimensions(axis));
  }
  io.SetIORegion(region);
  std::vector<char> bytes(static_cast<std::size_t>(io.GetImageSizeInBytes()));
  io.Read(bytes.data());

  values.reserve(values.size() + bytes.size() / io.GetComponentSize());
  switch (io.GetComponentType()) {
    case itk::IOComponentEnum::UCHAR:
      return append_as<unsigned char>(bytes, values);
    case itk::IOComponentEnum::CHAR:
      return append_as<signed char>(bytes, values);
    case itk::IOComponentEnum::USHORT:
      return append_as<unsigned short>(bytes, values);
    case itk::IOComponentEnum::SHORT:
      return append_as<short>(bytes, values);
    case itk::IOComponentEnum::UINT:
      return append_as<unsigned>(bytes, values);
    case itk::IOComponentEnum::INT:
      return append_as<int>(bytes, values);
    case itk::IOComponentEnum::ULONG:
      return append_as<unsigned long>(bytes, values);
    case itk::IOComponentEnum::LONG:
      return append_as<long>(bytes, values);
    case itk::IOComponentEnum::ULONGLONG:
      return append_as<unsigned long long>(bytes, values);
    case itk::IOComponentEnum::LONGLONG:
      return append_as<long long>(bytes, values);
    case itk::IOComponentEnum::FLOAT:
      return append_as<float>(bytes, values);
    case itk::IOComponentEnum::DOUBLE:
      return append_as<double>(bytes, values);
    default:
      throw Error(path.string() + ": voxels of an unknown type, expected integers or floats");
  }
}

void require_finite(const Image& image, const fs::path& path) {
  const auto bad = std::count_if(image.values.begin(), image.values.end(),
                                 [](float v) { return !std::isfinite(v); });
  if (bad > 0) {
    throw Error(path.string() + ": " + std::to_string(bad) +
                " voxels are not finite numbers; replace them, e.g. by -1024 HU");
  }
}

// ---- single files -------------------------------------------------------------------------------

struct FileFormat {
  std::string name;
  itk::ImageIOBase::Pointer io;  // none: no known extension
};

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

/// Reads header and voxels of a file that holds the whole volume.
Image read_volume(itk::ImageIOBase& io, const fs::path& path) {
  Image image;
  image.grid = header_grid(io, path);
  require_scalar_volume(io, image.grid, path);
  append_voxels(io, path, image.values);
  correct_scale(io, image);
  return image;
}

/// Opens a file by its extension and reads the header; checks that it is what it is called.
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

// ---- DICOM --------------------------------------------------------------------------------------

struct Slice {
  itk::GDCMImageIO::Pointer io;  // header read
  std::string series_uid;        // to compare with, never shown
  std::string series_number;
  Grid grid;
};

using Series = std::vector<Slice>;

std::string dicom_value(itk::GDCMImageIO& io, const std::string& tag) {
  std::string value;
  io.GetValueFromTag(tag, value);
  while (!value.empty() && (value.back() == ' ' || value.back() == '\0')) {
    value.pop_back();
  }
  return value;
}

/// True where two images can be slices of one volume.
bool same_series(const Slice& a, const Slice& b) {
  return a.series_uid == b.series_uid && a.grid.size == b.grid.size &&
         a.grid.spacing.head<2>().isApprox(b.grid.spacing.head<2>(), 1e-3) &&
         (a.grid.direction - b.grid.direction).cwiseAbs().maxCoeff() < 1e-3;
}

constexpr const char* kDamagedDicom =
    "a DICOM file that is damaged or cut short; copy or export the series again, or take the file "
    "out if it is no slice";

/// Headers of all DICOM images in the folder, by series, in the order of their file names.
std::vector<Series> find_series(const fs::path& folder, const At& at) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());

  std::vector<Series> all;
  for (const fs::path& file : files) {
    const DicomForm form = check_dicom(file);
    if (form == DicomForm::kNone) continue;  // folders also hold notes and pictures
    if (form == DicomForm::kDamaged) {
      throw Error(file.string() + ": " + kDamagedDicom);
    }
    at(file.string());
    Slice slice{.io = itk::GDCMImageIO::New(), .series_uid = {}, .series_number = {}, .grid = {}};
    if (!slice.io->CanReadFile(file.c_str())) {
      continue;  // such as DICOMDIR and reports
    }
    slice.io->SetFileName(file.string());
    slice.io->ReadImageInformation();
    slice.series_uid = dicom_value(*slice.io, "0020|000e");
    slice.series_number = dicom_value(*slice.io, "0020|0011");
    slice.grid = header_grid(*slice.io, folder);
    const auto home = std::find_if(all.begin(), all.end(), [&](const Series& series) {
      return same_series(series.front(), slice);
    });
    if (home == all.end()) {
      all.push_back({slice});
    } else {
      home->push_back(slice);
    }
  }
  return all;
}

Error several_series(const fs::path& folder, std::vector<Series> all) {
  std::stable_sort(all.begin(), all.end(),
                   [](const Series& a, const Series& b) { return a.size() > b.size(); });
  std::ostringstream text;
  text << folder.string() << ": " << all.size() << " DICOM series, expected one:";
  for (const Series& series : all) {
    const Slice& first = series.front();
    text << " number " << (first.series_number.empty() ? "unknown" : first.series_number) << " has "
         << series.size() << (series.size() == 1 ? " image of " : " images of ")
         << first.grid.size[0] << " x " << first.grid.size[1] << " pixels;";
  }
  text << " put the one to plan on into a folder of its own";
  return Error(text.str());
}

/// Checks that the sorted positions [mm] along the normal form a regular stack. Scanners round
/// positions, so a slice may lie a tenth of the step away from its place.
void require_even(const std::vector<double>& positions, const fs::path& folder) {
  const std::size_t gaps = positions.size() - 1;
  const double step = (positions.back() - positions.front()) / static_cast<double>(gaps);
  bool even = step > 0.0;
  for (std::size_t k = 0; k <= gaps; ++k) {
    const double place = positions.front() + static_cast<double>(k) * step;
    even = even && std::abs(positions[k] - place) <= 0.1 * step;
  }
  if (even) {
    return;
  }

  // name the gap that differs most from the usual one
  std::vector<double> sizes(gaps);
  for (std::size_t k = 0; k < gaps; ++k) {
    sizes[k] = positions[k + 1] - positions[k];
  }
  std::vector<double> sorted = sizes;
  std::nth_element(sorted.begin(), sorted.begin() + gaps / 2, sorted.end());
  const double usual = sorted[gaps / 2];
  const auto odd = std::max_element(sizes.begin(), sizes.end(), [&](double a, double b) {
    return std::abs(a - usual) < std::abs(b - usual);
  });
  const std::size_t k = static_cast<std::size_t>(odd - sizes.begin());
  std::ostringstream text;
  text << folder.string() << ": uneven slices: the ones at " << positions[k] << " and "
       << positions[k + 1] << " mm along the normal are " << *odd << " mm apart, the others "
       << usual << " mm; ";
  if (*odd < 0.5 * usual || usual <= 0.0) {
    text << "images lie at the same place: keep one phase or reconstruction in the folder";
  } else {
    text << "export the series again, with all its slices, or resample it";
  }
  throw Error(text.str());
}

/// Sorts the slices along their normal and gives the grid that they form.
Grid stack(Series& slices, const fs::path& folder) {
  if (slices.size() < 2) {
    throw Error(folder.string() + ": one DICOM slice, expected a series of at least 2");
  }
  const Vec3 normal = slices.front().grid.direction.col(2);
  const auto position = [&](const Slice& slice) { return normal.dot(slice.grid.origin); };
  std::stable_sort(slices.begin(), slices.end(),
                   [&](const Slice& a, const Slice& b) { return position(a) < position(b); });
  std::vector<double> positions(slices.size());
  std::transform(slices.begin(), slices.end(), positions.begin(), position);
  require_even(positions, folder);

  Grid grid = slices.front().grid;
  const Vec3 rise = slices.back().grid.origin - grid.origin;
  const double drift = (rise - normal * normal.dot(rise)).norm();
  if (drift > 0.5 * grid.spacing.head<2>().minCoeff()) {
    std::ostringstream text;
    text << folder.string() << ": the slices are shifted by " << drift
         << " mm in their plane from first to last (tilted gantry); resample the series to an "
            "upright grid";
    throw Error(text.str());
  }
  grid.size[2] = static_cast<int>(slices.size());
  grid.spacing[2] = normal.dot(rise) / static_cast<double>(slices.size() - 1);
  return grid;
}

/// True where the fragments of compressed pixels that start at `at` are all there (DICOM part 5,
/// A.4: items of tag FFFE,E000 and a length, closed by the tag FFFE,E0DD).
bool fragments_are_whole(std::ifstream& file, std::uintmax_t at, std::uintmax_t size) {
  while (at + 8 <= size) {
    std::array<unsigned char, 8> item{};  // little endian
    file.seekg(static_cast<std::streamoff>(at));
    file.read(reinterpret_cast<char*>(item.data()), item.size());
    if (item[2] == 0xDD) {
      return true;
    }
    at += 8 + item[4] + 256ULL * (item[5] + 256ULL * (item[6] + 256ULL * item[7]));
  }
  return false;
}

/// GDCM fills up pixels that are cut short with zeros, so their size is compared with the file's.
void require_whole_dicom(itk::GDCMImageIO& io) {
  const fs::path path = io.GetFileName();
  const gdcm::Tag pixels(0x7fe0, 0x0010);
  gdcm::Reader reader;
  reader.SetFileName(path.c_str());
  const bool found = reader.ReadUpToTag(pixels, {pixels});
  const gdcm::TransferSyntax syntax = reader.GetFile().GetHeader().GetDataSetTransferSyntax();
  if (syntax == gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian) {
    return;  // positions are those of the inflated file, and zlib notices
  }

  // what lies between where the pixels start and the end of the file
  const std::uintmax_t at = reader.GetStreamCurrentPosition(), size = fs::file_size(path);
  bool whole = found && at >= 4 && at <= size;
  if (whole && syntax.IsEncapsulated()) {
    std::ifstream file(path, std::ios::binary);
    whole = fragments_are_whole(file, at, size);
  } else if (whole) {
    const double bits = std::strtod(dicom_value(io, "0028|0100").c_str(), nullptr);
    whole = static_cast<double>(size - at) >=
            bits / 8.0 * static_cast<double>(io.GetImageSizeInPixels());
  }
  if (!whole) {
    throw Error(path.string() + ": " + damaged("DICOM"));
  }
}

void send_grid(const Send& send, const Grid& grid) {
  send(grid.size.data(), sizeof grid.size);
  send(grid.spacing.data(), sizeof(double) * 3);
  send(grid.origin.data(), sizeof(double) * 3);
  send(grid.direction.data(), sizeof(double) * 9);
}

Grid receive_grid(const Receive& receive) {
  Grid grid;
  receive(grid.size.data(), sizeof grid.size);
  receive(grid.spacing.data(), sizeof(double) * 3);
  receive(grid.origin.data(), sizeof(double) * 3);
  receive(grid.direction.data(), sizeof(double) * 9);
  return grid;
}

/// Sends the grid of the folder's series, then its values slice by slice.
void send_dicom_folder(const fs::path& folder, const Send& send, const At& at) {
  at(folder.string());
  std::vector<Series> all = find_series(folder, at);
  if (all.empty()) {
    throw Error(folder.string() +
                ": a folder without DICOM images (folders inside it are not searched); " +
                kFormats);
  }
  if (all.size() > 1) {
    throw several_series(folder, std::move(all));
  }
  Series& slices = all.front();
  at(slices.front().io->GetFileName());
  if (slices.size() == 1 && slices.front().grid.size[2] > 1) {  // all frames in one file
    require_whole_dicom(*slices.front().io);
    const Image image = read_volume(*slices.front().io, folder);
    send_grid(send, image.grid);
    return send(image.values.data(), image.values.size() * sizeof(float));
  }
  const Grid grid = stack(slices, folder);
  require_scalar_volume(*slices.front().io, grid, folder);
  send_grid(send, grid);
  std::vector<float> values;
  for (const Slice& slice : slices) {
    at(slice.io->GetFileName());
    require_whole_dicom(*slice.io);
    values.clear();
    append_voxels(*slice.io, folder, values);
    if (values.size() * slices.size() != grid.voxels()) {
      throw Error(folder.string() + ": files of several frames each, expected one slice per file");
    }
    send(values.data(), values.size() * sizeof(float));
  }
}

/// In a process of its own, since distributions build GDCM with assertions, and those end the
/// process on some values that a damaged header holds.
Image read_dicom_folder(const fs::path& folder) {
  Image image;
  run_apart(
      [&](const Send& send, const At& at) {
        call_itk(folder, damaged("DICOM"), [&] { send_dicom_folder(folder, send, at); });
      },
      [&](const Receive& receive) {
        image.grid = receive_grid(receive);
        image.values.reserve(image.grid.voxels());
        const std::size_t slice =
            image.grid.voxels() / static_cast<std::size_t>(image.grid.size[2]);
        while (image.values.size() < image.grid.voxels()) {
          const std::size_t before = image.values.size();
          image.values.resize(before + slice);
          receive(image.values.data() + before, slice * sizeof(float));
        }
      },
      kDamagedDicom);
  return image;
}

// ---- writing ------------------------------------------------------------------------------------

void write_nrrd(const Grid& grid, const void* voxels, itk::IOComponentEnum type,
                const fs::path& path) {
  const auto io = itk::NrrdImageIO::New();
  itk::ImageIORegion region(3);
  io->SetNumberOfDimensions(3);
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto size = static_cast<itk::SizeValueType>(grid.size[axis]);
    const Vec3 column = grid.direction.col(axis);
    io->SetDimensions(axis, size);
    io->SetSpacing(axis, grid.spacing[axis]);
    io->SetOrigin(axis, grid.origin[axis]);
    io->SetDirection(axis, std::vector<double>(column.begin(), column.end()));
    region.SetIndex(axis, 0);
    region.SetSize(axis, size);
  }
  io->SetIORegion(region);
  io->SetComponentType(type);
  io->SetPixelType(itk::IOPixelEnum::SCALAR);
  io->SetNumberOfComponents(1);
  io->SetFileType(itk::IOFileEnum::Binary);
  io->SetUseCompression(true);
  io->SetFileName(path.string());
  try {
    io->Write(voxels);
  } catch (const std::exception&) {
    throw DiskError(
        path.string() +
        ": cannot be written; check that the folder exists, may be written and has room");
  }
}

}  // namespace

bool reads_volumes() { return true; }

Image read_image(const fs::path& path) {
  std::error_code unknown;
  if (!fs::exists(path, unknown)) {
    throw Error(path.string() + ": no such file or folder; " + kFormats);
  }
  silence_libraries();
  Image image;
  if (fs::is_directory(path, unknown)) {
    image = call_itk(path, damaged("DICOM"), [&] { return read_dicom_folder(path); });
  } else {
    const FileFormat format = open_file(path);
    image = call_itk(path, damaged(format.name), [&] { return read_volume(*format.io, path); });
  }
  require_finite(image, path);
  return image;
}

void write_image(const Image& image, const fs::path& path) {
  expects(image.values.size() == image.grid.voxels());
  std::vector<std::int16_t> rounded(image.values.size());
  std::transform(image.values.begin(), image.values.end(), rounded.begin(), [](float value) {
    using Limits = std::numeric_limits<std::int16_t>;
    return static_cast<std::int16_t>(
        std::clamp(std::round(value), float{Limits::min()}, float{Limits::max()}));
  });
  write_nrrd(image.grid, rounded.data(), itk::IOComponentEnum::SHORT, path);
}

void write_mask(const Mask& mask, const fs::path& path) {
  expects(mask.labels.size() == mask.grid.voxels());
  write_nrrd(mask.grid, mask.labels.data(), itk::IOComponentEnum::UCHAR, path);
}

Mask read_mask(const fs::path& path) {
  if (!fs::is_regular_file(path)) {
    throw Error(path.string() + ": no such file, expected a mask (8 bit image of 0 and 1)");
  }
  silence_libraries();
  const FileFormat format = open_file(path);
  Mask mask;
  mask.grid = header_grid(*format.io, path);
  require_scalar_volume(*format.io, mask.grid, path);
  if (format.io->GetComponentType() == itk::IOComponentEnum::UCHAR) {
    call_itk(path, damaged(format.name), [&] { append_voxels(*format.io, path, mask.labels); });
  }
  if (mask.labels.empty() || *std::max_element(mask.labels.begin(), mask.labels.end()) > 1) {
    throw Error(path.string() + ": not a mask, expected an 8 bit image of 0 and 1");
  }
  return mask;
}

}  // namespace wireplan::preprocess
