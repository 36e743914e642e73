#include "preprocess/volume/itk_image.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iomanip>
#include <limits>
#include <sstream>
#include <utility>

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kLargestSize = 100000;  // voxels along an axis

std::string to_text(const Vec3& v) {
  std::ostringstream text;
  text << "(" << v.x() << ", " << v.y() << ", " << v.z() << ")";
  return text.str();
}

template <typename Stored>
void append_as(const std::vector<char>& bytes, std::vector<float>& values) {
  const Stored* first = reinterpret_cast<const Stored*>(bytes.data());
  const std::size_t count = bytes.size() / sizeof(Stored), before = values.size();
  values.resize(before + count);
  std::transform(first, first + count, values.begin() + static_cast<std::ptrdiff_t>(before),
                 [](Stored v) { return static_cast<float>(v); });
}

/// "int16" of 16 bit integers, and so on.
std::string name_of_stored(const itk::ImageIOBase& io) {
  using Type = itk::IOComponentEnum;
  const std::string bits = std::to_string(8 * io.GetComponentSize());
  switch (io.GetComponentType()) {
    case Type::FLOAT:
    case Type::DOUBLE:
      return "float" + bits;
    case Type::UCHAR:
    case Type::USHORT:
    case Type::UINT:
    case Type::ULONG:
    case Type::ULONGLONG:
      return "uint" + bits;
    case Type::UNKNOWNCOMPONENTTYPE:
      return "";
    default:
      return "int" + bits;
  }
}

}  // namespace

std::string damaged(const std::string& format) {
  return "its header reads as " + format +
         ", but its voxels cannot be read; the file is damaged or cut short: copy or export it "
         "again";
}

Error wrong_field(const std::string& field, const std::string& value, const std::string& expected,
                  const fs::path& path) {
  return Error(path.string() + ": its " + field + " is " + (value.empty() ? "empty" : value) +
               ", expected " + expected +
               "; mend the header, or save it again from the program that made it");
}

Error not_of_format(const std::string& format, const std::string& beginning,
                    const std::string& seen, const fs::path& path) {
  static const std::vector<std::pair<std::string, std::string>> kKinds = {
      {"\x1f\x8b", "is packed by gzip as a whole"},
      {"BZh", "is packed by bzip2"},
      {"PK\x03\x04", "is packed by zip"},
      {std::string("\xfd") + "7zXZ", "is packed by xz"},
      {"\x28\xb5\x2f\xfd", "is packed by zstd"},
      {"NRRD", "begins as an NRRD image"},
      {"ObjectType", "begins as a MetaImage"},
      {"NDims", "begins as a MetaImage"},
      {"\x89HDF", "begins as an HDF5 file"},
      {"version https://git-lfs", "is a pointer of Git LFS; fetch the file itself (git lfs pull)"},
      {"<", "is a page of HTML or XML, as a download that failed leaves it"},
      {"\xff\xfe", "is UTF-16 text; save it as UTF-8"}};
  std::string what = seen;
  for (const auto& [start, kind] : kKinds) {
    if (beginning.starts_with(start)) what = "it " + kind;
  }
  if (beginning.substr(std::min<std::size_t>(128, beginning.size()), 4) == "DICM") {
    what = "it is a DICOM file";
  }
  const bool text = std::all_of(beginning.begin(), beginning.end(), [](char c) {
    return static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\r' || c == '\t';
  });
  if (what == seen && text) what = beginning.empty() ? "it is empty" : "it is text of another kind";
  return Error(path.string() + ": not a " + format + " image: " + what + "; " + kFormats);
}

std::string beginning_of(const fs::path& path) {
  std::string bytes(256, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, stream.gcount())));
  return bytes;
}

void require_size(std::int64_t size, const std::string& field, const fs::path& path) {
  if (size >= 1 && size <= kLargestSize) return;
  throw wrong_field(field, std::to_string(size),
                    "a number of voxels from 1 to " + std::to_string(kLargestSize), path);
}

std::string without_path(const std::string& message, const fs::path& path) {
  const std::string start = path.string() + ": ";
  return message.starts_with(start) ? message.substr(start.size()) : message;
}

void require_utf8(const std::string& text, const std::string& what, const fs::path& path) {
  std::size_t more = 0;  // bytes of a character that are to come
  bool sound = true;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool continues = (byte & 0xc0U) == 0x80U;
    sound = sound && continues == (more > 0) && (continues || byte < 0x80 || byte > 0xc1);
    if (continues) {
      more -= more > 0 ? 1 : 0;
    } else {
      more = byte < 0xc0 ? 0 : byte < 0xe0 ? 1 : byte < 0xf0 ? 2 : 3;
      sound = sound && byte < 0xf5;
    }
  }
  if (sound && more == 0) return;
  throw Error(path.string() + ": " + what + " is no UTF-8; save it as UTF-8");
}

std::string one_decimal(double value) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << value;
  return text.str();
}

double shear_degrees(const Mat3& axes) {
  double largest = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double cosine = axes.col(k).normalized().dot(axes.col((k + 1) % 3).normalized());
    largest = std::max(largest, std::asin(std::min(1.0, std::abs(cosine))) / kRadPerDeg);
  }
  return largest;
}

Mat3 orthonormal_direction(const Mat3& direction, const fs::path& path) {
  const Eigen::JacobiSVD<Mat3> svd(direction, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3 nearest = svd.matrixU() * svd.matrixV().transpose();
  constexpr double kRounding = 1e-3, kUpright = 0.1;  // degrees
  const Vec3 lengths = direction.colwise().norm().transpose();
  const bool upright = shear_degrees(direction) < kUpright || lengths.minCoeff() == 0.0;
  if (upright && !((lengths.array() - 1.0).abs().maxCoeff() < kRounding)) {
    throw wrong_field("TransformMatrix", "of directions with the lengths " + to_text(lengths),
                      "lengths of 1", path);
  }
  if (!((direction - nearest).cwiseAbs().maxCoeff() < kRounding)) {
    throw Error(path.string() + ": the axes of the image are not at right angles (sheared by " +
                one_decimal(shear_degrees(direction)) +
                " degrees), expected an orthogonal grid; resample it, e.g. in 3D Slicer");
  }
  return nearest;
}

Grid header_grid(const itk::ImageIOBase& io, const fs::path& path, double mm_per_unit) {
  Grid grid;
  Mat3 direction;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const bool exists = axis < io.GetNumberOfDimensions();
    const auto size = exists ? io.GetDimensions(axis) : 1;
    require_size(static_cast<std::int64_t>(size), std::string("size along ") + "ijk"[axis], path);
    grid.size[axis] = static_cast<int>(size);
    grid.spacing[axis] = mm_per_unit * (exists ? io.GetSpacing(axis) : 1.0);
    grid.origin[axis] = mm_per_unit * (exists ? io.GetOrigin(axis) : 0.0);
    const std::vector<double> column =
        exists ? io.GetDirection(axis)
               : std::vector<double>();  // ITK's default writes past its end
    for (unsigned row = 0; row < 3; ++row) {
      direction(row, axis) = row < column.size() ? column[row] : (row == axis ? 1.0 : 0.0);
    }
  }
  require_place(grid.spacing, grid.origin, direction, path);
  grid.direction = orthonormal_direction(direction, path);
  return grid;
}

void require_place(const Vec3& spacing, const Vec3& origin, const Mat3& direction,
                   const fs::path& path) {
  constexpr double kFar = 1e6, kLeast = 1e-6;  // a kilometre, a nanometre
  const auto lies_in = [](const auto& values, double least, double most) {
    return std::all_of(values.begin(), values.end(), [&](double v) {
      return std::abs(v) >= least && std::abs(v) <= most;  // neither for what is no number
    });
  };
  if (lies_in(spacing, kLeast, kFar) && spacing.minCoeff() > 0.0 && lies_in(origin, 0.0, kFar) &&
      direction.allFinite()) {
    return;
  }
  throw Error(path.string() + ": voxel spacing " + to_text(spacing) + " mm at origin " +
              to_text(origin) +
              " mm, expected positive spacing and a place within a kilometre; mend the header");
}

Error lacks_spacing(const std::string& keys, const std::string& remedy, const fs::path& path) {
  return Error(path.string() + ": its header lacks " + keys +
               ", without which the size of its voxels is not known; " + remedy +
               ", or save it again from the program that made it");
}

bool is_same_spacing(double a, double b) {
  constexpr double kRounding = 0.01;
  return std::abs(a - b) <= kRounding * std::abs(b);
}

void require_extent(const std::array<int, 3>& size, const Vec3& spacing, const std::string& keys,
                    const fs::path& path) {
  constexpr double kLargest = 3000.0, kLeast = 1.0;  // mm; of any scanner, of any vessel
  const Vec3 extent = spacing.cwiseProduct(Vec3(size[0], size[1], size[2]));
  const double across = extent.maxCoeff();
  if (across >= kLeast && across <= kLargest) return;
  std::ostringstream text;
  text << std::setprecision(3) << extent[0] << " x " << extent[1] << " x " << extent[2] << " mm";
  if (across > kLargest) {
    text.str("");
    text << std::fixed << std::setprecision(1) << 1e-3 * extent[0] << " x " << 1e-3 * extent[1]
         << " x " << 1e-3 * extent[2] << " m";
  }
  throw Error(path.string() + ": it is " + text.str() + " across by its " + keys +
              ", expected between 1 mm and 3 m; mend the one that is wrong, most often the unit");
}

std::string placed_nowhere(const std::string& lacks, const std::string& frame) {
  return "its header does not tell where it lies (" + lacks +
         "): it is taken to lie upright, along the axes of " + frame +
         ", with its first voxel at the origin; is that the patient's right and left, and are the "
         "points of this frame?";
}

double count_values(const itk::ImageIOBase& io) {
  double count = io.GetNumberOfComponents();
  for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis) {
    count *= static_cast<double>(io.GetDimensions(axis));
  }
  return count;
}

void require_room(double needed, double stored, double most_packed, const std::string& format,
                  const fs::path& path) {
  if (needed <= most_packed * stored) return;
  const auto bytes = [](double count) {
    std::ostringstream text;
    text << std::fixed << std::setprecision(0) << std::max(0.0, count);
    return text.str();
  };
  throw Error(path.string() + ": its header reads as " + format + " and promises " + bytes(needed) +
              " bytes of voxels by its sizes and their type, but " + bytes(stored) +
              (most_packed > 1.0 ? " packed" : "") +
              " bytes are there; the file is damaged or cut short, or its sizes are wrong: copy or "
              "export it again");
}

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

Error voxels_in_list(const fs::path& path, const std::string& ending) {
  return Error(path.string() + ": its voxels lie in a list of files, expected them in one; " +
               "save the volume as one " + ending + " file");
}

void tell_header(const itk::ImageIOBase& io, VolumeHeader& told) {
  told.stored_as = name_of_stored(io);
  bool sound = true;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const bool exists = axis < io.GetNumberOfDimensions();
    const auto size = exists ? io.GetDimensions(axis) : 1;
    sound = sound && size <= static_cast<itk::SizeValueType>(kLargestSize);
    told.size[axis] = sound ? static_cast<int>(size) : 0;
    told.spacing[axis] = told.mm_per_unit * (exists ? io.GetSpacing(axis) : 1.0);
  }
  if (!sound) told.size = {0, 0, 0};
}

void require_volume(const Grid& grid, const fs::path& path) {
  if (*std::min_element(grid.size.begin(), grid.size.end()) < 2) {
    throw Error(path.string() + ": " + std::to_string(grid.size[0]) + " x " +
                std::to_string(grid.size[1]) + " x " + std::to_string(grid.size[2]) +
                " voxels, expected a volume with at least 2 along each axis");
  }
}

Error several_values(unsigned count, const fs::path& path) {
  return Error(path.string() + ": " + std::to_string(count) +
               " values per voxel (a colour or vector image), expected one");
}

Error several_volumes(std::int64_t count, const fs::path& path) {
  return Error(path.string() + ": a series of " + std::to_string(count) +
               " volumes (4D), expected one; export the phase to plan on as a 3D image");
}

Error slices_as_times(std::int64_t count, const fs::path& path) {
  return Error(path.string() + ": " + std::to_string(count) +
               " volumes of one slice each (4D), as where slices are stored as times, expected one "
               "volume; save it as a 3D image");
}

Error unknown_values(const fs::path& path) {
  return Error(path.string() + ": voxels of an unknown type, expected integers or floats");
}

void require_scalar_volume(const itk::ImageIOBase& io, const Grid& grid, const fs::path& path) {
  if (io.GetNumberOfComponents() != 1) throw several_values(io.GetNumberOfComponents(), path);
  require_volume(grid, path);
  for (unsigned axis = 3; axis < io.GetNumberOfDimensions(); ++axis) {
    const auto count = static_cast<std::int64_t>(io.GetDimensions(axis));
    if (count != 1) throw several_volumes(count, path);
  }
}

void append_voxels(itk::ImageIOBase& io, const fs::path& path, std::vector<float>& values) {
  // ImageIO objects want the region spelled out, here all of it
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis) {
    region.SetIndex(axis, 0);
    region.SetSize(axis, io.GetDimensions(axis));
  }
  io.SetIORegion(region);
  std::vector<char> bytes(static_cast<std::size_t>(io.GetImageSizeInBytes()));
  io.Read(bytes.data());
  append_numbers(io, bytes, path, values);
}

void append_numbers(const itk::ImageIOBase& io, const std::vector<char>& bytes,
                    const fs::path& path, std::vector<float>& values) {
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
      throw unknown_values(path);
  }
}

void scale_values(double slope, double intercept, std::vector<float>& values) {
  if (slope == 1.0 && intercept == 0.0) return;
  for (float& value : values) value = static_cast<float>(slope * value + intercept);
}

}  // namespace wireplan::preprocess
