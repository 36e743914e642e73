#include "preprocess/volume/nrrd_file.h"

#include <Eigen/Eigenvalues>  // before ITK, which would bring in its own older copy
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "itkNrrdImageIO.h"
#include "preprocess/volume/identity.h"
#include "preprocess/volume/itk_image.h"
#include "preprocess/volume/nrrd_fields.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

using Fields = NrrdFields;

/// "cm" of "\"cm\" \"cm\" \"cm\"": the words of a field of units; none where one is not in quotes.
std::vector<std::string> quoted_words(const std::string& text) {
  std::vector<std::string> words;
  std::istringstream rest(text);
  for (char first = 0; rest >> first;) {
    if (first != '"') return {};
    rest.unget();
    std::string word;
    rest >> std::quoted(word);
    words.push_back(trimmed(word));
  }
  return words;
}

/// How many mm a unit of length has; 0 where it is none that is known.
double mm_of(std::string unit) {
  static const std::map<std::string, double> kUnits = {{"", 1.0},
                                                       {"mm", 1.0},
                                                       {"millimeter", 1.0},
                                                       {"cm", 10.0},
                                                       {"centimeter", 10.0},
                                                       {"m", 1e3},
                                                       {"meter", 1e3},
                                                       {"um", 1e-3},
                                                       {"micron", 1e-3},
                                                       {"micrometer", 1e-3},
                                                       {"\xc2\xb5m", 1e-3},
                                                       {"\xce\xbcm", 1e-3}};
  if (unit.size() > 3 && unit.back() == 's') unit.pop_back();
  if (unit.ends_with("metre")) unit.replace(unit.size() - 2, 2, "er");
  const auto known = kUnits.find(unit);
  return known == kUnits.end() ? 0.0 : known->second;
}

/// Of the unit that the axes of space have: by `space units`, else by `units` of those axes that
/// have a spacing; mm where none is told.
double nrrd_unit(const Fields& fields, const fs::path& path) {
  std::string key = "space units", text = value_of(fields, key);
  if (text.empty()) text = value_of(fields, key = "units");
  if (text.empty()) return 1.0;
  std::vector<std::string> units = quoted_words(text);
  std::istringstream spacings(value_of(fields, "spacings"));
  std::string spacing;
  for (std::size_t k = 0; key == "units" && spacings >> spacing;) {
    if (spacing != "nan") {
      ++k;
    } else if (k < units.size()) {
      units.erase(units.begin() + static_cast<std::ptrdiff_t>(k));
    }
  }
  if (units.size() == 4) units.pop_back();  // of time
  std::set<double> scales;
  for (const std::string& unit : units) scales.insert(mm_of(unit));
  if (units.size() != 3 || scales.size() != 1 || *scales.begin() == 0.0) {
    throw Error(path.string() + ": " + key + " is " + text +
                ", expected one of \"mm\", \"cm\", \"m\", \"um\", in quotes, and the same one for "
                "each of the three axes; mend the header");
  }
  return *scales.begin();
}

/// What turns a place of the header's space to LPS. NrrdIO takes what it does not turn as it is.
Vec3 lps_signs(const Fields& fields, const fs::path& path) {
  static const std::map<std::string, Vec3> kSpaces = {
      {"left-posterior-superior", {1, 1, 1}},   {"lps", {1, 1, 1}},
      {"right-anterior-superior", {-1, -1, 1}}, {"ras", {-1, -1, 1}},
      {"left-anterior-superior", {1, -1, 1}},   {"las", {1, -1, 1}}};
  std::string space = value_of(fields, "space");
  const std::string told = space;
  if (space.ends_with("-time")) space.resize(space.size() - 5);
  if (space.size() == 4 && space.back() == 't') space.pop_back();
  const auto known = kSpaces.find(space);
  if (known != kSpaces.end()) return known->second;
  const bool placed = fields.count("space directions") > 0 || fields.count("space origin") > 0;
  if (told.empty() && !placed) return Vec3::Ones();
  throw Error(path.string() + ": " +
              (told.empty() ? "it has space directions, but its space is not named"
                            : "its space is " + told) +
              ", which does not tell how the patient lies in it, expected left-posterior-superior, "
              "right-anterior-superior or left-anterior-superior (LPS, RAS, LAS); write the one "
              "that holds behind \"space:\"");
}

/// An axis of space without a direction, as the fields of all axes tell it: NaN where they do not
/// (https://teem.sourceforge.net/nrrd/format.html, "per-axis").
struct UprightAxis {
  double size = NAN, spacing = NAN, low = NAN, high = NAN;
  bool node = false;  // centered: its ends are its first and last voxel's centres, not their edges

  double length_of_voxel() const { return (high - low) / (node ? size - 1.0 : size); }
  double step() const { return std::isfinite(spacing) ? spacing : length_of_voxel(); }
  double first() const { return node ? low : low + 0.5 * step(); }
};

/// Of the axes that hold no lists of values, as `kinds` tells.
std::vector<UprightAxis> upright_axes(const Fields& fields) {
  static const std::set<std::string> kOfPlaces = {"domain", "space", "time", "???", "none"};
  const std::vector<std::string> kinds = axis_words(fields, "kinds"),
                                 centers = axis_words(fields, "centers");
  const auto number = [&](const char* key, std::size_t k) {
    const std::vector<std::string> words = axis_words(fields, key);
    return k < words.size() ? std::strtod(words[k].c_str(), nullptr) : NAN;
  };
  std::vector<UprightAxis> axes;
  for (std::size_t k = 0; k < axis_words(fields, "sizes").size(); ++k) {
    if (k < kinds.size() && kOfPlaces.count(kinds[k]) == 0) continue;
    axes.push_back({.size = number("sizes", k),
                    .spacing = number("spacings", k),
                    .low = number("axis mins", k),
                    .high = number("axis maxs", k),
                    .node = k < centers.size() && centers[k] == "node"});
  }
  return axes;
}

/// Refuses a header that does not tell how large its voxels are. NrrdIO takes 1 mm for it, and
/// calls spacings of a space damaged.
void require_spacing(const Fields& fields, const fs::path& path) {
  if (fields.count("space directions") > 0) return;
  const bool ends = fields.count("axis mins") > 0 || fields.count("axis maxs") > 0;
  const std::string told = fields.count("spacings") > 0 ? "spacings" : ends ? "axis mins" : "";
  for (const char* space : {"space", "space dimension"}) {
    if (fields.count(space) == 0) continue;
    throw Error(path.string() + ": its header has " + space + (told.empty() ? "" : " and " + told) +
                ", but no space directions, which tell how its axes run there and how large its "
                "voxels are; add \"space directions: (a,0,0) (0,b,0) (0,0,c)\", with the spacings "
                "a, b, c if they run along those of the space" +
                (told.empty() ? "" : ", and delete " + told));
  }
  const std::vector<UprightAxis> axes = upright_axes(fields);
  for (std::size_t k = 0; k < std::min<std::size_t>(3, axes.size()); ++k) {
    const UprightAxis& axis = axes[k];
    if (!std::isfinite(axis.step()) || axis.step() == 0.0) {
      throw lacks_spacing(std::string("space directions, and spacings (or axis mins and axis "
                                      "maxs) of axis ") +
                              "ijk"[k],
                          "add the line \"spacings: a b c\" with the voxels' sizes", path);
    }
    if (!std::isfinite(axis.length_of_voxel()) ||
        is_same_spacing(axis.length_of_voxel(), axis.step())) {
      continue;
    }
    throw Error(path.string() + ": its spacings tell voxels of " + number_text(axis.step()) +
                " along " + "ijk"[k] + ", its axis mins and axis maxs of " +
                number_text(axis.length_of_voxel()) +
                ", expected the same; delete those that do not hold");
  }
}

/// Places a grid whose axes have no directions: along those of LPS.
void place_upright(const Fields& fields, double mm, const fs::path& path, Grid& grid,
                   std::vector<std::string>& remarks) {
  const std::vector<UprightAxis> axes = upright_axes(fields);
  bool placed = true;
  for (std::size_t k = 0; k < std::min<std::size_t>(3, axes.size()); ++k) {
    const auto a = static_cast<Eigen::Index>(k);
    grid.spacing[a] = mm * std::abs(axes[k].step());
    grid.direction(a, a) = axes[k].step() < 0.0 ? -1.0 : 1.0;
    grid.origin[a] = std::isfinite(axes[k].low) ? mm * axes[k].first() : 0.0;
    placed = placed && std::isfinite(axes[k].low);
  }
  remarks.push_back(placed ? std::string("its header names no space: its axes are taken for those "
                                         "of LPS; are the points of this frame?")
                           : placed_nowhere("it has no space directions", "LPS"));
  require_place(grid.spacing, grid.origin, grid.direction, path);
}

/// Sizes as ITK has them, placed by the header's own fields: ITK takes LAS for something else, and
/// RAS with time for LPS.
Grid nrrd_grid(const itk::ImageIOBase& io, const Fields& fields, const fs::path& path, double mm,
               std::vector<std::string>& remarks) {
  const Vec3 signs = lps_signs(fields, path);
  Mat3 axes;
  Eigen::Index count = 0;
  bool over = false;  // an axis of time, behind which none of space may come
  for (const std::vector<double>& vector : vectors_of(value_of(fields, "space directions"))) {
    if (vector.size() < 3) continue;
    const Vec3 axis = mm * signs.cwiseProduct(Vec3(vector[0], vector[1], vector[2]));
    if (count < 3 && !over && axis.norm() > 0.0) {
      axes.col(count++) = axis;
    } else {
      over = true;
      if (axis.norm() > 0.0) count = 4;
    }
  }
  if (count != 0 && count != 3) {
    throw Error(path.string() + ": space directions is " + value_of(fields, "space directions") +
                ", expected the first three axes, and no others, to lie in space; save it as a "
                "3D image");
  }
  Grid grid = header_grid(io, path, mm);
  const std::string keys = fields.count("space units") > 0 ? "space units" : "units";
  if (count == 0) {
    place_upright(fields, mm, path, grid, remarks);
    require_extent(grid.size, grid.spacing, keys + " and spacings or axis mins and maxs", path);
    return grid;
  }
  Vec3 origin = Vec3::Zero();
  const std::vector<std::vector<double>> origins = vectors_of(value_of(fields, "space origin"));
  if (!origins.empty() && origins[0].size() >= 3) {
    origin = mm * signs.cwiseProduct(Vec3(origins[0][0], origins[0][1], origins[0][2]));
  } else {
    remarks.push_back(
        "its header has no space origin: its first voxel is taken to lie at (0, 0, "
        "0) mm; are the points of this frame?");
  }
  grid.spacing = axes.colwise().norm().transpose();
  grid.origin = origin;
  require_place(grid.spacing, grid.origin, axes, path);
  require_extent(grid.size, grid.spacing, keys + " and space directions", path);
  grid.direction = orthonormal_direction(axes * grid.spacing.cwiseInverse().asDiagonal(), path);
  return grid;
}

/// Refuses places beyond any patient's: where an axis is longer than a number can be, ITK says 1
/// mm.
void require_near(const Fields& fields, const fs::path& path) {
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
  std::vector<std::string> tags;  // of the patient
  for (std::size_t k = 0; k < kLongest && std::getline(file, line) && !trimmed(line).empty(); ++k) {
    if (std::string told = told_of_patient(line); !told.empty()) tags.push_back(std::move(told));
    int number = 0, read = 0;
    if (std::sscanf(line.c_str(), "Segment%6d_%n", &number, &read) != 1 || read == 0) continue;
    const std::string field = trimmed(line.substr(static_cast<std::size_t>(read)));
    const auto value_of = [&](const std::string& key) -> std::optional<std::string> {
      if (!field.starts_with(key + ":=")) return std::nullopt;
      return field.substr(key.size() + 2);
    };
    if (const auto name = value_of("Name")) {
      require_utf8(*name, "its Segment" + std::to_string(number) + "_Name", path);
      segments[number].name = *name;
    }
    if (const auto value = value_of("LabelValue"))
      segments[number].value = std::atoi(value->c_str());
    if (const auto layer = value_of("Layer")) segments[number].layer = std::atoi(layer->c_str());
  }
  std::vector<NamedSegment> result;
  for (auto& [number, segment] : segments) {
    segment.name = without_person(without_identity(segment.name, tags));
    result.push_back(segment);
  }
  return result;
}

/// What the fields of a header tell, sound or not, before ITK is asked.
void tell_nrrd(const Fields& fields, const fs::path& path, VolumeHeader& told) {
  told.format = "NRRD";
  told.stored_as = value_of(fields, "type");
  const std::string units = value_of(fields, "space units");
  std::istringstream words(units.empty() ? value_of(fields, "units") : units);
  words >> std::quoted(told.length_unit);
  std::istringstream sizes(value_of(fields, "sizes"));
  std::array<int, 3> size{};
  if (sizes >> size[0] >> size[1] >> size[2] && *std::min_element(size.begin(), size.end()) > 0) {
    told.size = size;
  }
  told.segments = nrrd_segments(path);
}

/// Volumes whose voxels have several values, one for each of these.
std::vector<Image> read_values(itk::ImageIOBase& io, const fs::path& path, const Grid& grid) {
  constexpr unsigned kMost = 250;
  const std::size_t count = io.GetNumberOfComponents();
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
std::string nrrd_data_file(const Fields& fields, const fs::path& path) {
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

}  // namespace

std::vector<Image> read_nrrd(const fs::path& path, VolumeHeader& told, bool layered) {
  const std::string no_image =
      "its header reads as NRRD, but NrrdIO does not understand it; save it again from the program "
      "that made it";
  const Fields fields = read_nrrd_fields(path);
  tell_nrrd(fields, path, told);
  static const std::set<std::string> kEncodings = {"raw",  "gzip", "gz", "ascii",
                                                   "text", "txt",  "hex"};
  const std::string told_encoding = value_of(fields, "encoding"),
                    encoding = told_encoding.empty() ? "raw" : told_encoding;
  if (kEncodings.count(encoding) == 0) {
    throw Error(path.string() + ": its voxels are packed with \"" + encoding +
                "\", expected raw or gzip; save it again with gzip, as 3D Slicer does");
  }
  require_near(fields, path);
  require_sound_fields(fields, path);
  lps_signs(fields, path);
  require_spacing(fields, path);
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
    std::vector<std::string> remarks;
    const Grid grid = nrrd_grid(*io, fields, path, mm, remarks);
    std::vector<Image> images(1);
    if (layered && io->GetNumberOfComponents() > 1) {
      images = read_values(*io, path, grid);
    } else {
      require_scalar_volume(*io, grid, path);
      images[0].grid = grid;
      append_voxels(*io, path, images[0].values);
    }
    images.front().remarks = std::move(remarks);
    return images;
  });
}

}  // namespace wireplan::preprocess
