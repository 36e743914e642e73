#include "preprocess/volume/nifti_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "preprocess/volume/byte_stream.h"
#include "preprocess/volume/identity.h"
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

constexpr double kFarthestMm = 1e6, kShortestMm = 1e-6;  // a kilometre, a nanometre [mm]
constexpr std::int64_t kMostValues = 1000000;            // of a voxel, as told

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

Error damaged_nifti(const fs::path& path) { return Error(path.string() + ": " + damaged("NIfTI")); }

/// Of a file that ends within its header.
Error no_whole_header(const ByteStream& file, const fs::path& path) {
  if (file.packed()) {
    return Error(path.string() +
                 ": its packed bytes end, or are damaged, within the header of a NIfTI image; copy "
                 "or export it again");
  }
  return not_of_format("NIfTI", beginning_of(path),
                       "its " + std::to_string(fs::file_size(path)) +
                           " bytes are fewer than its header has, " +
                           std::to_string(kFirst.header) + " or more",
                       path);
}

/// Of a header whose size is known, but not the letters that name the format.
Error no_magic(const Header& header, const fs::path& path) {
  std::string letters;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto c = static_cast<char>(header.byte(header.layout().magic + k));
    letters += c > ' ' && c <= '~' ? std::string(1, c) : c == 0 ? "" : "?";
  }
  return wrong_field("magic", letters.empty() ? "" : "\"" + letters + "\"",
                     std::string(header.layout().wide ? "\"n+2\"" : "\"n+1\"") +
                         " (a header without it is of Analyze 7.5, which does not tell "
                         "left from right)",
                     path);
}

/// With what lies behind its `first` bytes in a longer version of the format.
Header read_whole_header(ByteStream& file, const std::vector<unsigned char>& first,
                         const Layout& layout, bool swapped, const fs::path& path) {
  std::vector<unsigned char> bytes(static_cast<std::size_t>(layout.header));
  std::copy(first.begin(), first.end(), bytes.begin());
  if (!file.read(bytes.data() + first.size(), bytes.size() - first.size())) {
    throw no_whole_header(file, path);
  }
  Header header(std::move(bytes), layout, swapped);
  const std::size_t m = layout.magic;
  const bool named = header.byte(m) == 'n' && header.byte(m + 2) == (layout.wide ? '2' : '1');
  if (named && header.byte(m + 1) == 'i') {
    throw Error(path.string() +
                ": the header of a NIfTI pair (.hdr and .img), expected header and voxels in "
                "one file; save it as .nii.gz");
  }
  if (!named || header.byte(m + 1) != '+') throw no_magic(header, path);
  return header;
}

Header read_header(ByteStream& file, const fs::path& path) {
  std::vector<unsigned char> first(static_cast<std::size_t>(kFirst.header));
  if (!file.read(first.data(), first.size())) throw no_whole_header(file, path);
  // The first number is the header's size, which tells the version and the order of bytes too.
  for (const Layout& layout : {kFirst, kSecond}) {
    for (const bool swapped : {false, true}) {
      if (Header(first, layout, swapped).get<std::int32_t>(0) != layout.header) continue;
      return read_whole_header(file, first, layout, swapped, path);
    }
  }
  throw not_of_format("NIfTI", std::string(first.begin(), first.end()),
                      "its sizeof_hdr is " +
                          std::to_string(Header(first, kFirst, false).get<std::int32_t>(0)) +
                          ", expected 348 or 540",
                      path);
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

/// Refuses numbers of a transform that place no volume, by the names of their fields.
void require_sound_sform(const Header& header, double unit, const fs::path& path) {
  const auto number = [&](std::size_t row, std::size_t column) {
    return header.real(header.layout().sform, 4 * row + column);
  };
  for (std::size_t k = 0; k < 12; ++k) {
    const double value = number(k / 4, k % 4);
    if (std::abs(unit * value) <= kFarthestMm) continue;
    throw wrong_field(std::string("srow_") + "xyz"[k / 4] + "[" + std::to_string(k % 4) + "]",
                      number_text(value), "a number within a kilometre", path);
  }
  for (std::size_t column = 0; column < 3; ++column) {
    const Vec3 step(number(0, column), number(1, column), number(2, column));
    if (unit * step.norm() >= kShortestMm) continue;
    const std::string of = "[" + std::to_string(column) + "]";
    throw wrong_field("srow_x" + of + ", srow_y" + of + " and srow_z" + of,
                      "a step of " + number_text(step.norm()) + " along " + "ijk"[column],
                      "one from voxel to voxel", path);
  }
}

void require_sound_qform(const Header& header, double unit, const fs::path& path) {
  constexpr double kLongest = 1.01;  // of a quaternion; more than rounding makes
  Vec3 imaginary;
  for (std::size_t k = 0; k < 6; ++k) {
    const double value = header.real(header.layout().quaternion, k);
    if (k < 3) imaginary[static_cast<Eigen::Index>(k)] = value;
    if (k < 3 ? std::isfinite(value) : std::abs(unit * value) <= kFarthestMm) continue;
    throw wrong_field(
        k < 3 ? std::string("quatern_") + "bcd"[k] : std::string("qoffset_") + "xyz"[k - 3],
        number_text(value), k < 3 ? "a number" : "a number within a kilometre", path);
  }
  if (imaginary.norm() <= kLongest) return;
  throw wrong_field("quatern_b, quatern_c and quatern_d",
                    "of the length " + number_text(imaginary.norm()), "at most 1, as of a rotation",
                    path);
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
  if (by_qform) require_sound_qform(header, unit, path);
  if (by_sform) require_sound_sform(header, unit, path);
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
      {0, "unknown"},       {1, "bits"},     {1536, "float128"}, {2048, "complex256"},
      {2, "uint8"},         {4, "int16"},    {8, "int32"},       {16, "float32"},
      {32, "complex64"},    {64, "float64"}, {128, "rgb24"},     {256, "int8"},
      {512, "uint16"},      {768, "uint32"}, {1024, "int64"},    {1280, "uint64"},
      {1792, "complex128"}, {2304, "rgba32"}};
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
  bool sound = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool exists = static_cast<std::int64_t>(axis) < header.dimension(0);
    const std::int64_t size = exists ? header.dimension(axis + 1) : 1;
    sound = sound && size >= 0 && size <= std::numeric_limits<int>::max();
    told.size[axis] = sound ? static_cast<int>(size) : 0;
    told.spacing[static_cast<Eigen::Index>(axis)] =
        told.mm_per_unit * std::abs(header.real(layout.spacing, axis + 1));
  }
  if (!sound) told.size = {0, 0, 0};
  told.placed_by = has_sform(header) ? "sform" : has_qform(header) ? "qform" : "";
}

/// Sizes of one volume of one value per voxel.
std::array<int, 3> sizes_of(const Header& header, const fs::path& path) {
  const std::int64_t axes = header.dimension(0);
  if (axes < 1 || axes > 7) {
    throw wrong_field("dim[0]", std::to_string(axes), "a number of axes from 1 to 7", path);
  }
  std::array<int, 3> sizes = {1, 1, 1};
  for (std::size_t axis = 1; axis <= static_cast<std::size_t>(axes); ++axis) {
    const std::int64_t size = header.dimension(axis);
    if (axis <= 3) {
      require_size(size, "dim[" + std::to_string(axis) + "]", path);
      sizes[axis - 1] = static_cast<int>(size);
    } else if (size > 1 && axis == 4 && sizes[2] == 1) {
      throw slices_as_times(size, path);
    } else if (size > 1 && axis == 5) {  // nifti1.h: of vectors
      throw several_values(static_cast<unsigned>(std::min<std::int64_t>(size, kMostValues)), path);
    } else if (size > 1) {
      throw several_volumes(size, path);
    }
  }
  return sizes;
}

Grid grid_of(const Header& header, const std::string& told_unit, const fs::path& path,
             std::vector<std::string>& remarks) {
  const double unit = mm_per_unit(header, path);
  Grid grid;
  grid.size = sizes_of(header, path);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.spacing[static_cast<Eigen::Index>(axis)] = unit * pixdim_of(header, axis);
  }
  require_volume(grid, path);

  const bool by_sform = has_sform(header) && !has_qform(header);
  for (std::size_t axis = 0; axis < 3 && !by_sform; ++axis) {
    if (grid.spacing[static_cast<Eigen::Index>(axis)] > 0.0) continue;
    throw lacks_spacing("pixdim[" + std::to_string(axis + 1) + "], which is " +
                            number_text(header.real(header.layout().spacing, axis + 1)),
                        "write the voxels' size there", path);
  }
  const Form form = choose_form(header, grid, unit, path, remarks);
  require_extent(grid.size, form.axes.colwise().norm().transpose(),
                 "xyzt_units (" + told_unit + "), pixdim and sform", path);
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

Error wrong_type(const Header& header, const fs::path& path) {
  const int code = header.get<std::int16_t>(header.layout().type);
  const std::string name = name_of_type(code);
  return wrong_field("datatype",
                     std::to_string(code) + (name.starts_with("type") ? "" : " (" + name + ")"),
                     "integers of 8 to 64 bits, float32 or float64", path);
}

/// How many bytes a voxel has.
double bytes_of_type(const Header& header, const fs::path& path) {
  static const std::map<int, double> kBytes = {{2, 1},    {4, 2},    {8, 4},     {16, 4},  {32, 8},
                                               {64, 8},   {128, 3},  {256, 1},   {512, 2}, {768, 4},
                                               {1024, 8}, {1280, 8}, {1792, 16}, {2304, 4}};
  const auto known = kBytes.find(header.get<std::int16_t>(header.layout().type));
  if (known == kBytes.end()) throw wrong_type(header, path);
  return known->second;
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
      throw wrong_type(header, path);
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
  for (auto& [value, name] : names) name = without_person(name);
  std::erase_if(names, [](const auto& one) { return one.second.empty(); });
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
  const auto stored = static_cast<double>(fs::file_size(path));
  if (!(start < kFarthest) || (!file.packed() && start > stored)) {
    const std::string size = std::to_string(fs::file_size(path));
    throw wrong_field(
        "vox_offset", one_decimal(offset),
        "a place in the file" + (file.packed() ? "" : ", which has " + size + " bytes"), path);
  }
  std::string extensions(static_cast<std::size_t>(std::min(between, kLongestNames)), '\0');
  if (!file.read(extensions.data(), extensions.size()) ||
      !file.skip(static_cast<std::size_t>(between) - extensions.size())) {
    throw damaged_nifti(path);
  }
  told.label_names = names_in(extensions, path);
  require_room(static_cast<double>(image.grid.voxels()) * bytes_of_type(header, path),
               file.packed() ? stored : stored - start, file.packed() ? kMostDeflated : 1.0,
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
