#include "preprocess/volume/nifti_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <utility>
#include <vector>

#include "preprocess/volume/byte_stream.h"
#include "preprocess/volume/volume_file.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

/// Where a version of the format keeps what a volume needs, and how wide it is (nifti1.h,
/// nifti2.h).
struct Layout {
  int header;  // bytes
  std::size_t magic, dimensions, type, spacing, offset, slope, units, qform_code, quaternion, sform;
  bool wide;  // dimensions and offset in 64 bits, other numbers in double or 32 bits
};
constexpr Layout kFirst{348, 344, 40, 70, 76, 108, 112, 123, 252, 256, 280, false};
constexpr Layout kSecond{540, 4, 16, 12, 104, 168, 176, 500, 344, 352, 400, true};

/// The numbers of a header, in the order of bytes that its first one tells.
class Header {
 public:
  Header(std::vector<unsigned char> bytes, const Layout& layout, bool swapped)
      : bytes_(std::move(bytes)), layout_(layout), swapped_(swapped) {}

  const Layout& layout() const { return layout_; }
  bool swapped() const { return swapped_; }
  unsigned char byte(std::size_t at) const { return bytes_.at(at); }

  template <typename Number>
  Number get(std::size_t at) const {
    std::array<unsigned char, sizeof(Number)> bytes{};
    for (std::size_t k = 0; k < bytes.size(); ++k) {
      bytes[k] = bytes_.at(at + (swapped_ ? bytes.size() - 1 - k : k));
    }
    return std::bit_cast<Number>(bytes);
  }
  double real(std::size_t at, std::size_t k = 0) const {
    return layout_.wide ? get<double>(at + 8 * k) : static_cast<double>(get<float>(at + 4 * k));
  }
  std::int64_t dimension(std::size_t k) const {
    return layout_.wide ? get<std::int64_t>(layout_.dimensions + 8 * k)
                        : get<std::int16_t>(layout_.dimensions + 2 * k);
  }
  int code(std::size_t at, std::size_t k = 0) const {
    return layout_.wide ? get<std::int32_t>(at + 4 * k) : get<std::int16_t>(at + 2 * k);
  }

 private:
  std::vector<unsigned char> bytes_;
  Layout layout_;
  bool swapped_;
};

Error not_nifti(const fs::path& path) {
  return Error(path.string() + ": not a NIfTI image, or damaged; " + kFormats);
}

Error damaged_nifti(const fs::path& path) { return Error(path.string() + ": " + damaged("NIfTI")); }

Header read_header(ByteStream& file, const fs::path& path) {
  std::vector<unsigned char> bytes(static_cast<std::size_t>(kFirst.header));
  if (!file.read(bytes.data(), bytes.size())) throw not_nifti(path);
  // The first number is the header's size, which tells the version and the order of bytes too.
  for (const Layout& layout : {kFirst, kSecond}) {
    for (const bool swapped : {false, true}) {
      Header header(bytes, layout, swapped);
      if (header.get<std::int32_t>(0) != layout.header) continue;
      const std::size_t more = static_cast<std::size_t>(layout.header) - bytes.size();
      bytes.resize(static_cast<std::size_t>(layout.header));
      if (!file.read(bytes.data() + kFirst.header, more)) throw not_nifti(path);
      header = Header(bytes, layout, swapped);
      const std::size_t m = layout.magic;
      const bool named = header.byte(m) == 'n' && header.byte(m + 2) == (layout.wide ? '2' : '1');
      if (named && header.byte(m + 1) == 'i') {
        throw Error(path.string() +
                    ": the header of a NIfTI pair (.hdr and .img), expected header and voxels in "
                    "one file; save it as .nii.gz");
      }
      if (named && header.byte(m + 1) == '+') return header;
    }
  }
  throw not_nifti(path);
}

double mm_per_unit(const Header& header, const fs::path& path) {
  const std::size_t at = header.layout().units;
  const int unit = (header.layout().wide ? header.code(at) : header.byte(at)) & 7;
  switch (unit) {
    case 0:  // not told: mm, as all readers take it
    case 2:
      return 1.0;
    case 1:
      return 1000.0;
    case 3:
      return 1e-3;
    default:
      throw Error(path.string() + ": its spatial unit has code " + std::to_string(unit) +
                  ", expected 1 (m), 2 (mm), 3 (micrometres) or 0; mend the header's xyzt_units");
  }
}

bool has_qform(const Header& header) { return header.code(header.layout().qform_code) > 0; }

/// One that is all zeros places nothing, whatever its code says.
bool has_sform(const Header& header) {
  if (header.code(header.layout().qform_code, 1) <= 0) return false;
  bool places = false;
  for (std::size_t k = 0; k < 12; ++k) {
    places = places || (k % 4 != 3 && header.real(header.layout().sform, k) != 0.0);
  }
  return places;
}

/// From voxel to place in RAS mm.
struct Form {
  Mat3 axes;  // columns: a step along i, j, k
  Vec3 origin;
};

Form sform_of(const Header& header, double unit) {
  Form form;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      form.axes(row, column) =
          unit * header.real(header.layout().sform, static_cast<std::size_t>(4 * row + column));
    }
    form.origin[row] =
        unit * header.real(header.layout().sform, static_cast<std::size_t>(4 * row + 3));
  }
  return form;
}

Form qform_of(const Header& header, const Vec3& spacing, double unit) {
  const auto number = [&](std::size_t k) { return header.real(header.layout().quaternion, k); };
  const Vec3 imaginary(number(0), number(1), number(2));
  const double real = std::sqrt(std::max(0.0, 1.0 - imaginary.squaredNorm()));
  Eigen::Quaterniond turn(real, imaginary.x(), imaginary.y(), imaginary.z());
  turn.normalize();
  const double handed = header.real(header.layout().spacing) < 0.0 ? -1.0 : 1.0;
  return {
      turn.toRotationMatrix() * Vec3(spacing.x(), spacing.y(), handed * spacing.z()).asDiagonal(),
      unit * Vec3(number(3), number(4), number(5))};
}

double largest_distance(const Form& a, const Form& b, const std::array<int, 3>& size) {
  double largest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 ijk((corner & 1) * (size[0] - 1), (corner >> 1 & 1) * (size[1] - 1),
                   (corner >> 2) * (size[2] - 1));
    largest = std::max(largest, ((a.axes - b.axes) * ijk + a.origin - b.origin).norm());
  }
  return largest;
}

/// The spacing along an axis as pixdim has it; 0 where it tells none.
double pixdim_of(const Header& header, std::size_t axis) {
  const double step = std::abs(header.real(header.layout().spacing, axis + 1));
  return std::isfinite(step) ? step : 0.0;
}

/// Where the sform alone places a volume, it must not contradict the spacing that pixdim tells. A
/// shear makes its axes longer, so a sheared one is left to who looks for that.
void require_told_spacing(const Header& header, const Form& sform, double unit,
                          const fs::path& path) {
  constexpr double kStraight = 1.0;  // degrees: longer by 0.02 % at most
  if (!sform.axes.allFinite() || shear_degrees(sform.axes) > kStraight) return;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double told = unit * pixdim_of(header, axis);
    const double step = sform.axes.col(static_cast<Eigen::Index>(axis)).norm();
    if (told == 0.0 || is_same_spacing(step, told)) continue;
    throw Error(path.string() + ": its sform has voxels of " + number_text(step) + " mm along " +
                "ijk"[axis] + ", its pixdim[" + std::to_string(axis + 1) + "] of " +
                number_text(told) +
                " mm, expected the same; save it again from the program that made it, or mend the "
                "one that is wrong");
  }
}

/// The transform to go by. Both forms of a file may differ by rounding, not by a place.
Form choose_form(const Header& header, const Grid& grid, double unit, const fs::path& path,
                 std::vector<std::string>& remarks) {
  constexpr double kTold = 0.1;  // mm
  const bool by_qform = has_qform(header), by_sform = has_sform(header);
  if (!by_qform && !by_sform) {
    if (header.code(header.layout().qform_code, 1) <= 0) {
      remarks.push_back(placed_nowhere("its qform_code and sform_code are 0", "RAS"));
      return {grid.spacing.asDiagonal(), Vec3::Zero()};
    }
    throw Error(path.string() +
                ": its sform holds zeros, and it has no qform, expected one of them "
                "to place the volume; save it again from the program that made it, or set both "
                "codes to 0 if it lies upright at the origin");
  }
  const Form qform = qform_of(header, grid.spacing, unit), sform = sform_of(header, unit);
  if (by_qform && by_sform) {
    const double apart = largest_distance(qform, sform, grid.size);
    if (!(apart <= 0.5 * grid.spacing.minCoeff())) {
      throw Error(path.string() + ": its two transforms place a corner of the volume " +
                  one_decimal(apart) + " mm apart (shear of qform " +
                  one_decimal(shear_degrees(qform.axes)) + ", of sform " +
                  one_decimal(shear_degrees(sform.axes)) +
                  " degrees), expected the same place by qform and sform; save it again from the "
                  "program in "
                  "which the points were picked, or set the code of the wrong one to 0");
    }
    if (apart >= kTold) {
      remarks.push_back("its two transforms place a corner " + one_decimal(apart) +
                        " mm apart, less than half a voxel; the sform counts");
    }
  }
  if (!by_qform) require_told_spacing(header, sform, unit, path);
  return by_sform ? sform : qform;
}

/// The name that nifti1.h gives a type of voxel.
std::string name_of_type(int code) {
  static const std::map<int, std::string> kNames = {
      {2, "uint8"},    {4, "int16"},     {8, "int32"},         {16, "float32"}, {32, "complex64"},
      {64, "float64"}, {128, "rgb24"},   {256, "int8"},        {512, "uint16"}, {768, "uint32"},
      {1024, "int64"}, {1280, "uint64"}, {1792, "complex128"}, {2304, "rgba32"}};
  const auto known = kNames.find(code);
  return known == kNames.end() ? "type " + std::to_string(code) : known->second;
}

/// Sizes, spacing and units as they stand there, sound or not.
void tell_nifti(const Header& header, VolumeHeader& told) {
  const Layout& layout = header.layout();
  told.format = layout.wide ? "NIfTI-2" : "NIfTI-1";
  told.stored_as = name_of_type(header.get<std::int16_t>(layout.type));
  const int unit = (layout.wide ? header.code(layout.units) : header.byte(layout.units)) & 7;
  static const std::map<int, std::pair<std::string, double>> kUnits = {
      {0, {"", 1.0}}, {1, {"m", 1000.0}}, {2, {"mm", 1.0}}, {3, {"um", 1e-3}}};
  const auto known = kUnits.find(unit);
  told.length_unit = known == kUnits.end() ? "code " + std::to_string(unit) : known->second.first;
  if (known != kUnits.end()) told.mm_per_unit = known->second.second;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool exists = static_cast<std::int64_t>(axis) < header.dimension(0);
    told.size[axis] = exists ? static_cast<int>(header.dimension(axis + 1)) : 1;
    told.spacing[static_cast<Eigen::Index>(axis)] =
        told.mm_per_unit * std::abs(header.real(layout.spacing, axis + 1));
  }
  told.placed_by = has_sform(header) ? "sform" : has_qform(header) ? "qform" : "";
}

Grid grid_of(const Header& header, const std::string& told_unit, const fs::path& path,
             std::vector<std::string>& remarks) {
  const double unit = mm_per_unit(header, path);
  Grid grid;
  const std::int64_t axes = header.dimension(0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t size =
        static_cast<std::int64_t>(axis) < axes ? header.dimension(axis + 1) : 1;
    if (size < 1 || size > 100000) throw damaged_nifti(path);
    grid.size[axis] = static_cast<int>(size);
    grid.spacing[static_cast<Eigen::Index>(axis)] = unit * pixdim_of(header, axis);
  }
  require_volume(grid, path);
  for (std::size_t axis = 4; axis <= static_cast<std::size_t>(std::min<std::int64_t>(axes, 7));
       ++axis) {
    if (header.dimension(axis) > 1) throw several_volumes(header.dimension(axis), path);
  }

  const bool by_sform = has_sform(header) && !has_qform(header);
  for (std::size_t axis = 0; axis < 3 && !by_sform; ++axis) {
    if (grid.spacing[static_cast<Eigen::Index>(axis)] > 0.0) continue;
    throw lacks_spacing("pixdim[" + std::to_string(axis + 1) + "], which is " +
                            number_text(header.real(header.layout().spacing, axis + 1)),
                        "write the voxels' size there", path);
  }
  const Form form = choose_form(header, grid, unit, path, remarks);
  const Vec3 spacing = form.axes.colwise().norm().transpose();
  if (spacing.allFinite()) {
    require_extent(grid.size, spacing, "xyzt_units (" + told_unit + "), pixdim and sform", path);
  }
  constexpr double kFar = 1e6;  // a kilometre
  if (!form.axes.allFinite() || !form.origin.allFinite() || !(grid.spacing.maxCoeff() < kFar) ||
      form.axes.cwiseAbs().maxCoeff() > kFar || form.origin.cwiseAbs().maxCoeff() > kFar ||
      form.axes.colwise().norm().minCoeff() < 1e-6) {
    throw damaged_nifti(path);
  }
  const Vec3 lps(-1.0, -1.0, 1.0);  // of RAS
  const Mat3 steps = lps.asDiagonal() * form.axes;
  grid.spacing = steps.colwise().norm().transpose();
  grid.direction = orthonormal_direction(steps * grid.spacing.cwiseInverse().asDiagonal(), path);
  grid.origin = lps.cwiseProduct(form.origin);
  return grid;
}

/// Reads all voxels of a type as floats; false where there are not as many.
template <typename Stored>
bool read_as(ByteStream& file, bool swapped, std::vector<float>& values) {
  constexpr std::size_t kAtOnce = std::size_t{1} << 16U;
  std::vector<unsigned char> bytes(kAtOnce * sizeof(Stored));
  for (std::size_t done = 0; done < values.size();) {
    const std::size_t count = std::min(kAtOnce, values.size() - done);
    if (!file.read(bytes.data(), count * sizeof(Stored))) return false;
    for (std::size_t k = 0; k < count; ++k) {
      std::array<unsigned char, sizeof(Stored)> one{};
      const unsigned char* from = bytes.data() + k * sizeof(Stored);
      if (swapped) {
        std::reverse_copy(from, from + sizeof(Stored), one.begin());
      } else {
        std::copy(from, from + sizeof(Stored), one.begin());
      }
      values[done + k] = static_cast<float>(std::bit_cast<Stored>(one));
    }
    done += count;
  }
  return true;
}

/// By the codes of nifti1.h.
bool read_values(const Header& header, ByteStream& file, const fs::path& path,
                 std::vector<float>& values) {
  switch (header.get<std::int16_t>(header.layout().type)) {
    case 2:
      return read_as<std::uint8_t>(file, header.swapped(), values);
    case 4:
      return read_as<std::int16_t>(file, header.swapped(), values);
    case 8:
      return read_as<std::int32_t>(file, header.swapped(), values);
    case 16:
      return read_as<float>(file, header.swapped(), values);
    case 64:
      return read_as<double>(file, header.swapped(), values);
    case 256:
      return read_as<std::int8_t>(file, header.swapped(), values);
    case 512:
      return read_as<std::uint16_t>(file, header.swapped(), values);
    case 768:
      return read_as<std::uint32_t>(file, header.swapped(), values);
    case 1024:
      return read_as<std::int64_t>(file, header.swapped(), values);
    case 1280:
      return read_as<std::uint64_t>(file, header.swapped(), values);
    case 32:
    case 1792:
      throw several_values(2, path);
    case 128:
      throw several_values(3, path);
    case 2304:
      throw several_values(4, path);
    default:
      throw unknown_values(path);
  }
}

/// The names of labels in the extensions between header and voxels, as TotalSegmentator writes
/// them: <Label Key="1" ...><![CDATA[aorta]]></Label>.
std::map<int, std::string> names_in(const std::string& extensions, const fs::path& path) {
  const std::string label = "<Label ", key = "Key=\"", open = "<![CDATA[", close = "]]>";
  std::map<int, std::string> names;
  for (std::size_t at = 0; (at = extensions.find(label, at)) != std::string::npos;) {
    at += label.size();
    const std::size_t end = std::min(extensions.find("</Label>", at), extensions.size());
    const std::string text = extensions.substr(at, std::min<std::size_t>(end - at, 1000));
    const std::size_t number = text.find(key), name = text.find(open), last = text.find(close);
    if (number == std::string::npos || name == std::string::npos || last == std::string::npos ||
        last < name + open.size()) {
      continue;
    }
    const int value = std::atoi(text.c_str() + number + key.size());
    names[value] = text.substr(name + open.size(), last - name - open.size());
    require_utf8(names[value], "the name of label " + std::to_string(value), path);
  }
  names.erase(0);  // what is around
  return names;
}

}  // namespace

Image read_nifti(const fs::path& path, VolumeHeader& told) {
  ByteStream file(path);
  const Header header = read_header(file, path);
  tell_nifti(header, told);
  Image image;
  image.grid = grid_of(header, told.length_unit.empty() ? "not told" : told.length_unit, path,
                       image.remarks);
  const double offset = header.layout().wide
                            ? static_cast<double>(header.get<std::int64_t>(header.layout().offset))
                            : static_cast<double>(header.get<float>(header.layout().offset));
  // What lies between the header and the voxels are extensions; the header may leave the place
  // open.
  const double start = std::max(offset, static_cast<double>(header.layout().header + 4));
  constexpr double kFarthest = 1e8, kLongestNames = 1e6;
  const auto between = start - static_cast<double>(header.layout().header);
  if (!(start < kFarthest)) throw damaged_nifti(path);
  std::string extensions(static_cast<std::size_t>(std::min(between, kLongestNames)), '\0');
  if (!file.read(extensions.data(), extensions.size()) ||
      !file.skip(static_cast<std::size_t>(between) - extensions.size())) {
    throw damaged_nifti(path);
  }
  told.label_names = names_in(extensions, path);
  require_room(static_cast<double>(image.grid.voxels()),  // of a byte at least
               static_cast<double>(fs::file_size(path)), file.packed() ? kMostDeflated : 1.0,
               "NIfTI", path);
  image.values.resize(image.grid.voxels());
  if (!read_values(header, file, path, image.values) || !file.ends_whole()) {
    throw damaged_nifti(path);
  }

  // A slope of 0 means none, and so does one that is no number, as nibabel writes it.
  const double slope = header.real(header.layout().slope),
               shift = header.real(header.layout().slope, 1);
  if (!std::isfinite(slope) || slope == 0.0) return image;
  if (!std::isfinite(shift)) {
    throw Error(path.string() +
                ": its scl_inter is no number, expected one beside a scl_slope of " +
                number_text(slope) + "; mend the header");
  }
  scale_values(slope, shift, image.values);
  return image;
}

}  // namespace wireplan::preprocess
