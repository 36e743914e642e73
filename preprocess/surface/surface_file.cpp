#include <vtkCellArray.h>
#include <vtkFieldData.h>
#include <vtkPointLocator.h>
#include <vtkStringArray.h>
#include <vtkTriangleFilter.h>
#include <vtkXMLPolyDataReader.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>
#include <vector>

#include "preprocess/surface/surface.h"
#include "preprocess/surface/vtk_mesh.h"
#include "preprocess/text.h"

namespace wireplan::preprocess {
namespace {

constexpr double kFarthest = 1e9;  // no vessel has such coordinates, in whatever unit

template <typename Reader>
vtkSmartPointer<vtkPolyData> read_with(const std::filesystem::path& path) {
  const VtkErrors errors;
  vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  if (errors.any()) {
    throw Error(path.string() + ": cannot be read as a surface (" + errors.text() +
                "); expected STL, PLY, OBJ or VTP as the file's ending says");
  }
  return reader->GetOutput();
}

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // as some editors begin a text

/// The next line, whether lines end in LF, CR or both.
bool next_line(std::istream& stream, std::string& line) {
  line.clear();
  std::streambuf* bytes = stream.rdbuf();
  for (int c = bytes->sbumpc(); c != EOF; c = bytes->sbumpc()) {
    if (c == '\r' && bytes->sgetc() == '\n') bytes->sbumpc();
    if (c == '\r' || c == '\n') return true;
    line.push_back(static_cast<char>(c));
  }
  if (line.empty()) stream.setstate(std::ios::eofbit);
  return !line.empty();
}

// ---- STL by hand: VTK tells text from binary by its first 256 bytes, which a name may spoil, and
// reads a binary file to its end, whatever the header says ----------------------------------------

enum class StlForm { kText, kBinary };

constexpr std::size_t kStlHead = 84, kStlTriangle = 50;  // bytes

/// A number of a binary file, which is little endian.
std::uint32_t stl_number(const char* bytes) {
  std::uint32_t number = 0;
  for (std::size_t k = 4; k-- > 0;) number = number << 8U | static_cast<unsigned char>(bytes[k]);
  return number;
}

/// Refuses what no file of these formats begins with: nothing, text of two bytes for each
/// character, as some editors on Windows save it, or what packs files.
void require_plain(std::string_view beginning, const std::filesystem::path& path) {
  const auto refuse = [&](const char* why) {
    throw Error(path.string() + ": " + why + "; expected a surface (STL, PLY, OBJ or VTP)");
  };
  if (beginning.empty()) refuse("is empty");
  if (beginning.starts_with("\xff\xfe") || beginning.starts_with("\xfe\xff")) {
    refuse("is UTF-16 text; save it as UTF-8");
  }
  if (beginning.starts_with("\x1f\x8b")) refuse("is packed by gzip; unpack it, e.g. by gunzip");
  if (beginning.starts_with("PK\x03\x04")) refuse("is packed by zip; unpack it");
}

/// By the number of triangles in the header of a binary file, which fit into it: read as a number,
/// four letters are more than 10^8. What does not and begins as text, or with a solid of facets, is
/// text.
StlForm stl_form(const std::filesystem::path& path) {
  constexpr std::size_t kBeginning = 4096;  // bytes, in which a solid has a facet
  std::ifstream stream(path, std::ios::binary);
  std::array<char, kBeginning> beginning{};
  stream.read(beginning.data(), beginning.size());
  const std::string_view all(beginning.data(), static_cast<std::size_t>(stream.gcount())),
      text = all.substr(0, kStlHead);
  const std::uint32_t triangles = stl_number(&beginning[kStlHead - 4]);
  const std::uintmax_t bytes = std::filesystem::file_size(path),
                       expected = kStlHead + kStlTriangle * std::uintmax_t{triangles};
  const std::size_t mark = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
  const std::size_t first = text.find_first_not_of(" \t\r\n", mark);
  const bool solid = first != std::string_view::npos && text.substr(first).starts_with("solid") &&
                     all.find("facet") != std::string_view::npos;
  const bool fits = text.size() == kStlHead && expected <= bytes;
  if (fits && (triangles > 0 || bytes < kStlHead + kStlTriangle)) return StlForm::kBinary;
  const bool is_text = std::all_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\r' || c == '\t';
  });
  require_plain(text, path);
  if (solid || is_text) return StlForm::kText;
  throw Error(path.string() + ": a binary STL of " + std::to_string(bytes) + " bytes, expected " +
              std::to_string(expected) + " for the " + std::to_string(triangles) +
              " triangles of its header; copy or export the surface again");
}

/// As many triangles as the header says, a normal, three corners and two bytes each; what lies
/// behind them is none of them.
vtkSmartPointer<vtkPolyData> read_binary_stl(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::array<char, kStlHead> head{};
  stream.read(head.data(), head.size());
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  vtkNew<vtkCellArray> triangles;
  std::array<char, kStlTriangle> bytes{};
  for (std::uint32_t left = stl_number(&head[kStlHead - 4]); left > 0; --left) {
    stream.read(bytes.data(), bytes.size());
    triangles->InsertNextCell(3);
    for (std::size_t corner = 1; corner <= 3; ++corner) {
      std::array<float, 3> p{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        p[axis] = std::bit_cast<float>(stl_number(&bytes[12 * corner + 4 * axis]));
      }
      triangles->InsertCellPoint(points->InsertNextPoint(p.data()));
    }
  }
  vtkNew<vtkPolyData> result;
  result->SetPoints(points);
  result->SetPolys(triangles);
  return result;
}

/// Three lines "vertex x y z" for each facet, in solids that begin with "solid" and any name; what
/// stands behind "endsolid" is none of them.
vtkSmartPointer<vtkPolyData> read_text_stl(const std::filesystem::path& path) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();  // as VTK has it
  vtkNew<vtkCellArray> triangles;
  std::ifstream stream(path, std::ios::binary);
  std::string line, word;
  int number = 0;
  const auto require = [&](bool sound, const char* what) {
    if (sound) return;
    throw Error(path.string() + ": cannot be read as a surface (line " + std::to_string(number) +
                ": " + what + "); expected STL, PLY, OBJ or VTP as the file's ending says");
  };
  vtkIdType corners = 0;               // of the facet so far
  bool begun = false, inside = false;  // a solid
  while (next_line(stream, line)) {
    if (++number == 1 && line.starts_with(kByteOrderMark)) line.erase(0, kByteOrderMark.size());
    std::istringstream words(line);
    if (!(words >> word)) continue;
    word = lower_case(word);
    require(begun || word == "solid", "no \"solid\" at its begin");
    if (word == "solid") begun = inside = true;
    if (word == "endsolid") inside = false;
    if (!inside) continue;
    if (word == "vertex") {
      Vec3 p;
      require(static_cast<bool>(words >> p.x() >> p.y() >> p.z()),
              "a vertex without three numbers");
      points->InsertNextPoint(p.data());
      ++corners;
    } else if (word == "endfacet") {
      require(corners == 3, "a facet that has not three vertices");
      const vtkIdType last = points->GetNumberOfPoints();
      const std::array<vtkIdType, 3> ids = {last - 3, last - 2, last - 1};
      triangles->InsertNextCell(3, ids.data());
      corners = 0;
    }
  }
  require(begun, "no \"solid\" at its begin");
  require(!inside && corners == 0, "the file breaks off");
  vtkNew<vtkPolyData> result;
  result->SetPoints(points);
  result->SetPolys(triangles);
  return result;
}

// ---- PLY by hand: VTK's reader ends the program where a file is cut short ---------------------

enum class PlyFormat { kAscii, kLittleEndian, kBigEndian };
enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;
  std::optional<PlyType> count_type;  // of a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

[[noreturn]] void refuse_ply(const std::filesystem::path& path, const std::string& why) {
  throw Error(path.string() + ": cannot be read as a surface (" + why +
              "); expected a PLY file with vertices x, y, z and faces");
}

PlyType ply_type(const std::string& name, const std::filesystem::path& path) {
  constexpr std::array<std::array<const char*, 2>, 8> kNames = {{{"char", "int8"},
                                                                 {"uchar", "uint8"},
                                                                 {"short", "int16"},
                                                                 {"ushort", "uint16"},
                                                                 {"int", "int32"},
                                                                 {"uint", "uint32"},
                                                                 {"float", "float32"},
                                                                 {"double", "float64"}}};
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    if (name == kNames[k][0] || name == kNames[k][1]) return static_cast<PlyType>(k);
  }
  refuse_ply(path, "unknown type \"" + name + "\" in its header");
}

/// The values of a PLY file one after another, as doubles, which hold all of its types exactly.
class PlyStream {
 public:
  explicit PlyStream(const std::filesystem::path& path) : path_(path), in_(path, std::ios::binary) {
    std::array<char, 4> mark{};
    in_.read(mark.data(), mark.size());
    const std::string_view beginning(mark.data(), static_cast<std::size_t>(in_.gcount()));
    require_plain(beginning, path);
    if (beginning.starts_with(kByteOrderMark)) begin_ = kByteOrderMark.size();
    in_.clear();
    in_.seekg(begin_);
  }

  std::vector<PlyElement> read_header() {
    std::vector<PlyElement> elements;
    std::string line, word, type;
    if (!header_line(line) || line.substr(0, 3) != "ply") refuse("no PLY header");
    while (header_line(line)) {
      std::istringstream words(line);
      words >> word;
      if (word == "end_header") return elements;
      if (word == "format") {
        words >> type;
        format_ = type == "ascii"               ? PlyFormat::kAscii
                  : type == "binary_big_endian" ? PlyFormat::kBigEndian
                                                : PlyFormat::kLittleEndian;
      } else if (word == "element") {
        PlyElement element;
        if (!(words >> element.name >> element.count)) refuse("an element without its count");
        elements.push_back(element);
      } else if (word == "property") {
        PlyProperty property;
        words >> type;
        if (type == "list") {
          words >> type;
          property.count_type = ply_type(type, path_);
          words >> type;
        }
        property.type = ply_type(type, path_);
        if (!(words >> property.name) || elements.empty()) refuse("a property of no element");
        elements.back().properties.push_back(property);
      }
    }
    refuse("its header has no end");
  }

  /// One value, or all of a list.
  std::vector<double> read(const PlyProperty& property) {
    const double count = property.count_type ? read_one(*property.count_type) : 1.0;
    std::vector<double> values;
    for (int k = 0; k < count; ++k) values.push_back(read_one(property.type));
    return values;
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const { refuse_ply(path_, why); }

  /// As the first line ends, so do the others: a byte of the data may be a line's end too.
  bool header_line(std::string& line) {
    if (line_end_ == 0) {
      std::getline(in_, line, '\r');
      line_end_ = line.find('\n') == std::string::npos && in_.peek() != '\n' ? '\r' : '\n';
      in_.clear();
      in_.seekg(begin_);
    }
    return static_cast<bool>(std::getline(in_, line, line_end_));
  }

  double read_one(PlyType type) {
    double value = 0.0;
    if (format_ == PlyFormat::kAscii) {
      if (!(in_ >> value)) refuse("it ends early or holds something else than numbers");
      return value;
    }
    switch (type) {
      case PlyType::kInt8:
        return read_bytes<std::int8_t>();
      case PlyType::kUint8:
        return read_bytes<std::uint8_t>();
      case PlyType::kInt16:
        return read_bytes<std::int16_t>();
      case PlyType::kUint16:
        return read_bytes<std::uint16_t>();
      case PlyType::kInt32:
        return read_bytes<std::int32_t>();
      case PlyType::kUint32:
        return read_bytes<std::uint32_t>();
      case PlyType::kFloat:
        return static_cast<double>(read_bytes<float>());
      case PlyType::kDouble:
        break;
    }
    return read_bytes<double>();
  }

  template <typename T>
  T read_bytes() {
    std::array<char, sizeof(T)> bytes;
    if (!in_.read(bytes.data(), sizeof(T))) refuse("it ends early");
    const bool native_little = std::endian::native == std::endian::little;
    if ((format_ == PlyFormat::kLittleEndian) != native_little) {
      std::reverse(bytes.begin(), bytes.end());
    }
    return std::bit_cast<T>(bytes);
  }

  std::filesystem::path path_;
  std::ifstream in_;
  std::streamoff begin_ = 0;  // of the header
  PlyFormat format_ = PlyFormat::kAscii;
  char line_end_ = 0;
};

vtkSmartPointer<vtkPolyData> read_ply(const std::filesystem::path& path) {
  PlyStream stream(path);
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> polygons;
  for (const PlyElement& element : stream.read_header()) {
    if (element.properties.empty()) continue;
    for (std::size_t k = 0; k < element.count; ++k) {
      Vec3 point = Vec3::Zero();
      for (const PlyProperty& property : element.properties) {
        const std::vector<double> values = stream.read(property);
        if (property.count_type && property.name.starts_with("vertex_ind")) {
          polygons->InsertNextCell(static_cast<int>(values.size()));
          for (const double value : values) polygons->InsertCellPoint(std::llround(value));
        } else if (!property.count_type && property.name.size() == 1) {
          const std::size_t axis = std::string("xyz").find(property.name);
          if (axis < 3) point(static_cast<Eigen::Index>(axis)) = values[0];
        }
      }
      if (element.name == "vertex") points->InsertNextPoint(point.data());
    }
  }
  vtkNew<vtkPolyData> result;
  result->SetPoints(points);
  result->SetPolys(polygons);
  return result;
}

// ---- OBJ by hand: VTK's reader ends the program where a face's numbers break off ---------------

/// "3", "3/1", "3//2" or "3/1/2", counted from 1, or from the last vertex so far at -1.
vtkIdType obj_vertex(const std::string& word, vtkIdType vertices) {
  char* end = nullptr;
  const long long number = std::strtoll(word.c_str(), &end, 10);
  if (end == word.c_str() || (*end != '\0' && *end != '/')) return -1;
  return number < 0 ? vertices + number : number - 1;
}

/// Vertices and faces; what else the file holds is for looks.
vtkSmartPointer<vtkPolyData> read_obj(const std::filesystem::path& path) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> polygons;
  std::ifstream stream(path);
  int number = 0;
  const auto require = [&](bool sound) {
    if (sound) return;
    throw Error(path.string() + ": cannot be read as a surface (line " + std::to_string(number) +
                "); expected an OBJ file with vertices \"v x y z\" and faces \"f 1 2 3\"");
  };
  for (std::string line, more; next_line(stream, line);) {
    if (++number == 1) {
      if (!line.empty()) require_plain(line, path);
      if (line.starts_with(kByteOrderMark)) line.erase(0, kByteOrderMark.size());
    }
    for (; !line.empty() && line.back() == '\\' && next_line(stream, more); ++number) {
      line.back() = ' ';
      line += more;
    }
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      Vec3 p;
      require(static_cast<bool>(words >> p.x() >> p.y() >> p.z()));
      points->InsertNextPoint(p.data());
    } else if (kind == "f") {
      std::vector<vtkIdType> face;
      for (std::string word; words >> word;) {
        face.push_back(obj_vertex(word, points->GetNumberOfPoints()));
        require(face.back() >= 0);
      }
      require(face.size() >= 3);
      polygons->InsertNextCell(static_cast<vtkIdType>(face.size()), face.data());
    }
  }
  vtkNew<vtkPolyData> result;
  result->SetPoints(points);
  result->SetPolys(polygons);
  return result;
}

// ---- Any format ------------------------------------------------------------------------------

/// Readers hand on vertex numbers as they stand in the file; VTK's filters rely on them.
void require_valid_indices(vtkPolyData* data, const std::filesystem::path& path) {
  vtkIdType count = 0;
  const vtkIdType* ids = nullptr;
  for (vtkCellArray* cells : {data->GetPolys(), data->GetStrips()}) {
    for (cells->InitTraversal(); cells->GetNextCell(count, ids);) {
      for (vtkIdType k = 0; k < count; ++k) {
        if (ids[k] >= 0 && ids[k] < data->GetNumberOfPoints()) continue;
        throw Error(path.string() + ": a face names vertex " + std::to_string(ids[k]) +
                    ", but there are " + std::to_string(data->GetNumberOfPoints()) +
                    " (counted from 0); expected faces of vertices in the file");
      }
    }
  }
}

vtkSmartPointer<vtkPolyData> read_any(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw Error(path.string() + ": no such file; expected a surface (STL, PLY, OBJ or VTP)");
  }
  const std::string ending = lower_case(path.extension().string());
  if (ending == ".stl") {
    return stl_form(path) == StlForm::kText ? read_text_stl(path) : read_binary_stl(path);
  }
  if (ending == ".ply") return read_ply(path);
  if (ending == ".obj") return read_obj(path);
  if (ending == ".vtp") return read_with<vtkXMLPolyDataReader>(path);
  throw Error(path.string() + ": the ending \"" + ending +
              "\" is not known; expected .stl, .ply, .obj or .vtp");
}

/// Polygons and strips cut into triangles; lines and lone points are left out.
vtkSmartPointer<vtkPolyData> triangles_of(vtkPolyData* input) {
  vtkNew<vtkTriangleFilter> triangles;
  triangles->SetInputData(input);
  triangles->PassVertsOff();
  triangles->PassLinesOff();
  triangles->Update();
  return triangles->GetOutput();
}

/// Points nearer to each other than the last digits of single precision made one.
Surface merged(const Surface& surface) {
  constexpr double kTolerance = 1e-7;  // of the size
  const Vec3 low = surface.vertices.rowwise().minCoeff(),
             high = surface.vertices.rowwise().maxCoeff();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkPointLocator> locator;
  locator->SetTolerance(kTolerance * (high - low).maxCoeff());
  const std::array<double, 6> bounds = {low.x(), high.x(), low.y(), high.y(), low.z(), high.z()};
  locator->InitPointInsertion(points, bounds.data(), surface.vertices.cols());
  std::vector<int> number;
  for (const auto& p : surface.vertices.colwise()) {
    vtkIdType id = 0;
    locator->InsertUniquePoint(p.data(), id);
    number.push_back(static_cast<int>(id));
  }
  Surface result{.vertices = Eigen::Matrix3Xd(3, points->GetNumberOfPoints()),
                 .triangles = surface.triangles};
  for (vtkIdType k = 0; k < points->GetNumberOfPoints(); ++k) {
    points->GetPoint(k, result.vertices.col(k).data());
  }
  for (int& v : result.triangles.reshaped()) v = number[static_cast<std::size_t>(v)];
  return result;
}

double mm_per(const std::string& unit, const std::string& place) {
  if (unit == "mm") return 1.0;
  if (unit == "cm") return 10.0;
  if (unit == "m") return kMmPerM;
  throw Error(place + ": unit \"" + unit + "\" is not known; expected mm, cm or m");
}

Vec3 lps_signs(const std::string& frame, const std::string& place) {
  if (frame == "LPS") return {1.0, 1.0, 1.0};
  if (frame == "RAS") return {-1.0, -1.0, 1.0};
  throw Error(place + ": frame \"" + frame + "\" is not known; expected LPS or RAS");
}

/// The text of the field SPACE, where the beginning of a VTP names one.
std::string space_of_vtp(const std::filesystem::path& path, const std::string& beginning) {
  if (beginning.find("Name=\"SPACE\"") == std::string::npos) return {};
  const vtkSmartPointer<vtkPolyData> data = read_with<vtkXMLPolyDataReader>(path);
  auto* space = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray("SPACE"));
  return space != nullptr && space->GetNumberOfValues() > 0 ? space->GetValue(0) : std::string();
}

/// What stands behind "SPACE=", 3D Slicer's mark in the header of an STL or a comment of a PLY or
/// OBJ, in any case of letters.
std::string space_of_comment(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  const auto is_word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
  };
  const std::string key = "SPACE=";
  std::size_t at = text.find(key);
  while (at != std::string::npos && at > 0 && is_word(text[at - 1])) at = text.find(key, at + 1);
  if (at == std::string::npos) return {};
  const auto first = text.begin() + static_cast<std::ptrdiff_t>(at + key.size());
  return {first, std::find_if_not(first, text.end(), is_word)};
}

/// "RAS" of "ras" and "right-anterior-superior"; of other directions what is told, in capitals;
/// empty of what tells none.
std::string frame_of_space(std::string space) {
  std::transform(space.begin(), space.end(), space.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  std::string letters = space;
  if (space.find('-') != std::string::npos) {  // the first ones of its words
    letters.clear();
    for (std::size_t k = 0; k < space.size(); ++k) {
      if (k == 0 || space[k - 1] == '-') letters.push_back(space[k]);
    }
  }
  if (letters == "LPS" || letters == "RAS") return letters;
  std::set<char> axes;
  for (const char c : letters) {
    const std::size_t axis = std::string_view("LRPASI").find(c);
    axes.insert(axis == std::string_view::npos ? '?' : "xxyyzz"[axis]);
  }
  const bool directions = letters.size() == 3 && axes.size() == 3 && axes.count('?') == 0;
  return directions || space.starts_with("SCANNER-") || space.starts_with("3D-") ? space : "";
}

}  // namespace

std::string told_frame(const std::filesystem::path& path) try {
  std::ifstream stream(path, std::ios::binary);
  std::string text(std::size_t{1} << 16U, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, stream.gcount())));
  const std::string space = space_of_vtp(path, text);
  return frame_of_space(space.empty() ? space_of_comment(text) : space);
} catch (const Error&) {
  return {};  // told where it is read
}

Surface read_triangles(const std::filesystem::path& path, const std::string& unit,
                       const std::string& frame) {
  const Vec3 scale = mm_per(unit, path.string()) * lps_signs(frame, path.string());
  const vtkSmartPointer<vtkPolyData> data = read_any(path);
  require_valid_indices(data, path);
  Surface surface = surface_from(triangles_of(data));
  if (surface.triangles.cols() == 0) {
    throw Error(path.string() + ": holds no triangles; expected a surface (STL, PLY, OBJ or VTP)");
  }
  if (!surface.vertices.allFinite()) {
    throw Error(path.string() + ": a coordinate is not a finite number; export the surface again");
  }
  if (surface.vertices.cwiseAbs().maxCoeff() > kFarthest) {
    throw Error(path.string() + ": a coordinate is beyond " + std::to_string(long(kFarthest)) +
                " " + unit + "; export the surface again");
  }
  surface.vertices = scale.asDiagonal() * surface.vertices;
  return merged(surface);
}

}  // namespace wireplan::preprocess
