#include "pipeline/files/markups_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "pipeline/files/case_file.h"
#include "pipeline/files/labels_file.h"
#include "preprocess/text.h"
#include "preprocess/volume/identity.h"
#include "preprocess/volume/image.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExpected =
    "expected markups of 3D Slicer (.mrk.json, .fcsv, or their table as .csv or .tsv)";
constexpr double kFarthestMm = 1e6;

/// What turns a point of the frame into LPS. Old files number them.
Vec3 signs_of_frame(const std::string& frame, const std::string& place) {
  if (frame == "LPS" || frame == "1") return {1.0, 1.0, 1.0};
  if (frame == "RAS" || frame == "0") return {-1.0, -1.0, 1.0};
  throw Error(place + ": its coordinate system is " + frame +
              ", expected LPS or RAS; save it again from 3D Slicer");
}

void require_place(const Vec3& point, const std::string& label, const std::string& place) {
  if (point.allFinite() && point.cwiseAbs().maxCoeff() <= kFarthestMm) return;
  throw Error(place + ": the point \"" + preprocess::without_person(label) +
              "\" has no three numbers of a place in mm; save it again from 3D Slicer");
}

/// Of an element that may be missing or of another type.
std::string text_under(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return {};
  if (found->is_string()) return found->get<std::string>();
  return found->is_number_integer() ? found->dump() : std::string();
}

/// The one text of an element that may be a list of equal ones, one for each axis; empty where it
/// is missing.
std::string one_text_under(const Json& object, const char* key, const std::string& place) {
  const Json given = object.value(key, Json());
  const Json list = given.is_array() ? given : Json::array({given});
  const bool equal =
      std::all_of(list.begin(), list.end(), [&](const Json& one) { return one == list.front(); });
  if (given.is_null()) return {};
  const std::string text =
      list.empty() ? std::string() : text_under(Json{{key, list.front()}}, key);
  const bool coded = list.size() == 3 && list[1] == "UCUM";
  if (text.empty() || !(equal || coded)) {
    throw Error(place + ": its " + key + " is " + given.dump() +
                ", expected one text, or a list of equal ones; save it again from 3D Slicer");
  }
  return text;
}

void append_markup(const Json& markup, const std::string& place, Markups& read) {
  const std::string frame = one_text_under(markup, "coordinateSystem", place);
  const Vec3 signs = signs_of_frame(frame.empty() ? "LPS" : frame, place);  // as the schema has it
  const std::string unit = one_text_under(markup, "coordinateUnits", place);
  if (!unit.empty() && unit != "mm") {
    throw Error(place + ": its coordinates are in " + unit +
                ", expected mm; save it again from 3D Slicer");
  }
  const auto controls = markup.find("controlPoints");
  if (controls == markup.end() || !controls->is_array()) return;
  for (const Json& control : *controls) {
    if (!control.is_object()) throw Error(place + ": a control point is no object; " + kExpected);
    const std::string status = text_under(control, "positionStatus");
    if (!status.empty() && status != "defined") {
      read.unplaced.push_back(text_under(control, "label"));
      continue;
    }
    MarkupPoint point{.label = text_under(control, "label"), .point = Vec3::Constant(NAN)};
    const auto position = control.find("position");
    if (position != control.end() && position->is_array() && position->size() == 3) {
      for (std::size_t k = 0; k < 3; ++k) {
        if ((*position)[k].is_number()) {
          point.point[static_cast<Eigen::Index>(k)] = (*position)[k].get<double>();
        }
      }
    }
    require_place(point.point, point.label, place);
    point.point = signs.cwiseProduct(point.point);
    read.points.push_back(std::move(point));
  }
}

Markups read_markups_json(const std::string& text, const std::string& place) {
  const Json file = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  const auto markups = file.is_object() ? file.find("markups") : file.end();
  if (file.is_discarded()) {
    throw Error(place + ": no JSON, or broken or cut short; " + kExpected);
  }
  if (!file.is_object() || markups == file.end() || !markups->is_array()) {
    throw Error(place + ": has no list \"markups\"; " + kExpected);
  }
  Markups read;
  for (const Json& markup : *markups) {
    if (!markup.is_object()) throw Error(place + ": a markup is no object; " + kExpected);
    append_markup(markup, place, read);
  }
  return read;
}

/// A line of a table that holds nothing, but for the marks that Excel leaves.
bool is_blank_row(const std::string& line) {
  return line.find_first_not_of(",;\t\r ") == std::string::npos;
}

/// The cells of a line of a table, with quotes taken off; two of them in a quoted cell are one.
std::vector<std::string> cells_of(const std::string& line, char separator) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t k = 0; k < line.size(); ++k) {
    const char c = line[k];
    if (c == '"' && quoted && k + 1 < line.size() && line[k + 1] == '"') {
      cells.back() += line[++k];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == separator && !quoted) {
      cells.emplace_back();
    } else if (c != '\r') {
      cells.back() += c;
    }
  }
  return cells;
}

/// In small letters, without blanks around it.
std::string small_word(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string::npos ? "" : lower_case(text.substr(first, last - first + 1));
}

/// Where a table of points has what, by the words that head its columns.
struct PointColumns {
  std::map<std::string, std::size_t> of;  // by their names in small letters
  std::array<std::size_t, 3> place = {};
  std::string frame;  // "LPS" or "RAS" where the names of x, y, z tell it
  bool sound = false;

  /// The cell under the first of the names that there is; empty where there is none.
  std::string cell(const std::vector<std::string>& row,
                   const std::vector<const char*>& names) const {
    for (const char* name : names) {
      const auto found = of.find(name);
      if (found != of.end()) return found->second < row.size() ? row[found->second] : "";
    }
    return {};
  }
};

PointColumns point_columns(const std::vector<std::string>& heads) {
  PointColumns columns;
  for (std::size_t k = 0; k < heads.size(); ++k) columns.of.emplace(small_word(heads[k]), k);
  const std::vector<std::pair<std::array<const char*, 3>, const char*>> places = {
      {{"x", "y", "z"}, ""}, {{"r", "a", "s"}, "RAS"}, {{"l", "p", "s"}, "LPS"}};
  for (const auto& [names, frame] : places) {
    const auto is_there = [&](const char* name) { return columns.of.count(name) > 0; };
    if (columns.sound || !std::all_of(names.begin(), names.end(), is_there)) continue;
    for (std::size_t k = 0; k < 3; ++k) columns.place[k] = columns.of.at(names[k]);
    columns.frame = frame;
    columns.sound = true;
  }
  return columns;
}

/// Whether a row says that its point was never placed: by a column of its own, as 3D Slicer numbers
/// it or has 0 and 1, by a word among the flags, or with no number in any of x, y, z.
bool is_unplaced(const std::vector<std::string>& row, const PointColumns& columns) {
  static const std::set<std::string> kWords = {"undefined", "unplaced", "missing", "preview",
                                               "not placed"};
  for (const char* name : {"positionstatus", "status", "defined", "sel", "selected", "vis"}) {
    if (kWords.count(small_word(columns.cell(row, {name}))) > 0) return true;
  }
  const std::string status = small_word(columns.cell(row, {"positionstatus"}));
  if (status == "0" || status == "1" || status == "3") return true;  // vtkMRMLMarkupsNode.h
  for (const char* name : {"defined", "placed", "status"}) {
    const std::string defined = small_word(columns.cell(row, {name}));
    if (defined == "0" || defined == "false" || defined == "no") return true;
  }
  return std::all_of(columns.place.begin(), columns.place.end(), [&](std::size_t k) {
    const std::string cell = k < row.size() ? small_word(row[k]) : "";
    return cell.empty() || cell == "nan";
  });
}

/// A number that fills the cell; NaN where it holds something else.
double cell_value(const std::string& text) {
  const std::string cell = small_word(text);
  char* end = nullptr;
  const double number = std::strtod(cell.c_str(), &end);
  return cell.empty() || *end != '\0' ? NAN : number;
}

/// A table of points, line by line: .fcsv, whose comments tell frame and columns, or 3D Slicer's
/// table of control points, whose first row does. Without a line of columns an .fcsv has those of
/// 3D Slicer 4, or of 3 where its first comment is that of 3; without a frame it is in RAS. Excel
/// fills every line up with marks, and may put one of UTF-8 before the first.
class PointTable {
 public:
  PointTable(const std::string& text, std::string place, bool fiducials)
      : place_(std::move(place)), fiducials_(fiducials), frame_(fiducials ? "RAS" : "not told") {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);
      if (is_blank_row(line)) continue;
      if (line.front() == '#') {
        take_comment(line);
      } else {
        take_row(line);
      }
    }
  }

  Markups finish() {
    const std::string& told = columns_.frame.empty() ? frame_ : columns_.frame;
    const Vec3 signs = signs_of_frame(told, place_);
    for (MarkupPoint& point : read_.points) point.point = signs.cwiseProduct(point.point).eval();
    return std::move(read_);
  }

 private:
  void take_comment(const std::string& line) {
    const bool old = line.find("Fiducial List file") != std::string::npos;
    known_ = known_ || old || line.find("Markups fiducial file") != std::string::npos;
    if (known_ && !columns_.sound) {
      columns_ = point_columns(cells_of(old ? "label,x,y,z,sel,vis"
                                            : "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,"
                                              "associatedNodeID,positionStatus",
                                        ','));
    }
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos) return;
    const std::string key = small_word(line.substr(1, equals - 1)), value = line.substr(equals + 1);
    if (key == "coordinatesystem") {
      frame_.clear();
      std::istringstream(value.substr(0, value.find(','))) >> frame_;
    }
    if (key != "columns") return;
    PointColumns told = point_columns(cells_of(value, ','));
    if (!told.sound) {
      throw Error(place_ + ": its columns lack x, y or z, expected these three beside label; " +
                  kExpected);
    }
    // 3D Slicer 5 writes it behind the last of them without a name.
    const auto last = told.of.find("associatednodeid");
    if (last != told.of.end() && last->second + 1 == told.of.size()) {
      told.of.emplace("positionstatus", told.of.size());
    }
    columns_ = std::move(told);
    known_ = true;
  }

  void take_row(const std::string& line) {
    if (!begun_) {
      begun_ = true;
      for (const char mark : {';', '\t'}) {
        if (!fiducials_ && line.find(mark) != std::string::npos) separator_ = mark;
      }
      const PointColumns told = point_columns(cells_of(line, separator_));
      if (told.sound) {
        columns_ = told;
        known_ = true;
        return;
      }
    }
    if (!known_ || !columns_.sound) {
      throw Error(place_ +
                  ": no table of fiducials: no comment of 3D Slicer, and no first line that heads "
                  "label and x, y, z (or r, a, s, or l, p, s); " +
                  kExpected);
    }
    const std::vector<std::string> cells = cells_of(line, separator_);
    const std::string label = columns_.cell(cells, {"label", "name", "id"});
    if (is_unplaced(cells, columns_)) {
      read_.unplaced.push_back(label);
      return;
    }
    MarkupPoint point{.label = label, .point = Vec3::Constant(NAN)};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t at = columns_.place[k];
      if (at < cells.size()) point.point[static_cast<Eigen::Index>(k)] = cell_value(cells[at]);
    }
    require_place(point.point, point.label, place_);
    read_.points.push_back(std::move(point));
  }

  std::string place_;
  bool fiducials_;
  bool known_ = false, begun_ = false;
  char separator_ = ',';
  std::string frame_;
  PointColumns columns_;
  Markups read_;
};

/// The labels of a file, for a message.
std::string list_labels(const std::vector<MarkupPoint>& points) {
  constexpr std::size_t kMost = 12;
  std::string text;
  for (std::size_t k = 0; k < std::min(points.size(), kMost); ++k) {
    text += (k == 0 ? "\"" : ", \"") + points[k].label + "\"";
  }
  if (points.size() > kMost) text += " and " + std::to_string(points.size() - kMost) + " more";
  return text;
}

/// Points of a case in the place of objects that say where they are.
class PointFinder {
 public:
  PointFinder(const Json& file, const fs::path& folder, Problems& problems)
      : file_(file), folder_(folder), problems_(problems), has_labels_(file.contains("labels")) {
    const bool has_volume = file.contains("volume") && file["volume"].is_object();
    if (has_volume && file["volume"].value("path", Json()).is_string()) {
      volume_ = resolve_path(file["volume"]["path"], folder);
      const Json series = file["volume"].value("series", Json(""));
      if (series.is_string()) series_ = series;
    }
  }

  /// Of one access or target.
  void resolve_end(Json& end, const std::string& key) {
    if (!end.is_object() || !end.contains("point") || !end["point"].is_object()) return;
    if (end.contains("point_mm")) {
      problems_.add(key + ".point", "given beside " + key + ".point_mm", "one of the two");
    } else {
      end["point_mm"] = find(end["point"], key + ".point");
    }
    end.erase("point");
  }

  Json find(const Json& given, const std::string& key) {
    const std::size_t before = problems_.count();
    JsonReader reader(given, key, problems_);
    const bool is_voxel = reader.has("ijk");
    if (is_voxel && reader.has("markups")) {
      problems_.add(key + ".ijk", "given beside " + key + ".markups", "one of the two");
    }
    const std::optional<Vec3> point =
        is_voxel ? find_voxel(reader, before) : find_markup(reader, before);
    if (point) return to_json(*point);
    // Apart from every other point.
    return to_json(Vec3(1000.0 * static_cast<double>(problems_.count()), 0.0, 0.0));
  }

  /// All points of the file {"markups": FILE} in their order, along a curve or as they were placed.
  Json find_line(const Json& given, const std::string& key) {
    const std::size_t before = problems_.count();
    JsonReader reader(given, key, problems_);
    const std::string name = reader.text("markups", std::nullopt);
    reader.finish();
    const std::optional<Markups> read = read_file(reader, name, before);
    Json line = Json::array();
    if (read && (read->points.size() < 2 || !read->unplaced.empty())) {
      problems_.add(reader.path_of("markups"),
                    name + ", with " + std::to_string(read->points.size()) + " points and " +
                        std::to_string(read->unplaced.size()) + " that have no position",
                    "a line of two points at least, proximal to distal, all of them placed");
    } else if (read) {
      for (const MarkupPoint& point : read->points) line.push_back(to_json(point.point));
    }
    // After a problem some line, so that all else can be told too.
    return line.empty() ? Json{{0, 0, 0}, {0, 0, 1}} : line;
  }

 private:
  std::optional<Markups> read_file(JsonReader& reader, const std::string& name,
                                   std::size_t problems_before) {
    if (problems_.count() > problems_before) return {};
    try {
      return read_markups(resolve_path(name, folder_));
    } catch (const Error& error) {
      problems_.add(reader.path_of("markups"), name, "a file of markups", error.what());
      return {};
    }
  }

  std::optional<Vec3> find_markup(JsonReader& reader, std::size_t problems_before) {
    const std::string name = reader.text("markups", std::nullopt);
    const std::string label = preprocess::without_person(reader.text("label", ""));
    reader.finish();
    const std::optional<Markups> file = read_file(reader, name, problems_before);
    if (!file) return {};
    const Markups& read = *file;
    const std::vector<MarkupPoint>& points = read.points;
    std::vector<MarkupPoint> named = points;
    std::erase_if(named, [&](const MarkupPoint& point) {
      return reader.has("label") && point.label != label;
    });
    if (named.size() == 1) return named.front().point;
    const bool unplaced = std::count(read.unplaced.begin(), read.unplaced.end(), label) > 0;
    if (unplaced && named.empty() && reader.has("label")) {
      problems_.add(reader.path_of("label"),
                    "\"" + label + "\", which is in " + name + " but has no position",
                    "a point that is placed", "place it in 3D Slicer and save the file again");
    } else if (points.empty()) {
      problems_.add(reader.path_of("markups"), name, "a file with points that are placed");
    } else if (!reader.has("label")) {
      problems_.add(reader.path_of("label"), "missing", "one of the labels of " + name,
                    list_labels(points));
    } else {
      std::vector<std::string> labels;
      for (const MarkupPoint& point : points) labels.push_back(point.label);
      const std::string near = nearest_name(label, labels);
      problems_.add(
          reader.path_of("label"),
          "\"" + label + "\"" +
              (named.empty() ? "" : ", which " + std::to_string(named.size()) + " points have"),
          named.empty() ? "one of the labels of " + name : "the label of one point of " + name,
          list_labels(points) +
              (named.empty() && !near.empty() ? "; did you mean \"" + near + "\"?" : ""));
    }
    return {};
  }

  std::optional<Vec3> find_voxel(JsonReader& reader, std::size_t problems_before) {
    const Vec3 ijk = reader.point("ijk", std::nullopt);
    reader.finish();
    if (problems_.count() > problems_before) return {};
    const std::string key = reader.path_of("ijk"), given = to_json(ijk).dump();
    if (volume_.empty() && !has_labels_) {
      problems_.add(key, given, "a case with volume.path or labels",
                    "a surface has no voxels; give point_mm");
      return {};
    }
    try {
      if (!grid_) grid_ = read_grid();
    } catch (const DiskError&) {
      throw;
    } catch (const Error& error) {
      problems_.add(key, given, "voxels that can be read", error.what());
      return {};
    }
    Vec3 last = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      last[static_cast<Eigen::Index>(k)] = grid_->size[k] - 1.0;
    }
    if (((ijk.array() < -0.5) || (ijk.array() > last.array() + 0.5)).any()) {
      problems_.add(key, given, "voxels from [0, 0, 0] to " + Json(to_json(last)).dump(),
                    "so many there are; they count from 0");
      return {};
    }
    return grid_->lps_from_ijk(ijk);
  }

  /// The volume's, or that of the labels where they are all there is.
  preprocess::Grid read_grid() {
    if (!volume_.empty()) return preprocess::read_image(volume_, series_).grid;
    Problems of_labels("labels");
    JsonReader root(file_, "", of_labels);
    const LabelsInput labels = read_labels_input(root.object("labels", true), folder_);
    of_labels.throw_if_any();
    return read_labels(labels).grid;
  }

  const Json& file_;
  const fs::path& folder_;
  Problems& problems_;
  bool has_labels_ = false;
  fs::path volume_;  // empty without one
  std::string series_;
  std::optional<preprocess::Grid> grid_;
};

/// Calls `resolve` with each entry of a list, where there is one, and its key behind `prefix`.
template <typename Resolve>
void for_each_in(Json& owner, const std::string& list, const std::string& prefix,
                 const Resolve& resolve) {
  if (!owner.is_object() || !owner.contains(list) || !owner[list].is_array()) return;
  for (std::size_t k = 0; k < owner[list].size(); ++k) {
    resolve(owner[list][k], prefix + list + "[" + std::to_string(k) + "]");
  }
}

}  // namespace

Markups read_markups(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!fs::is_regular_file(path) || !stream) {
    throw Error(path.string() + ": no such file; " + kExpected);
  }
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  const std::string ending = lower_case(path.extension().string());
  const bool table = ending == ".fcsv" || ending == ".csv" || ending == ".tsv";
  Markups read = table ? PointTable(text, path.string(), ending == ".fcsv").finish()
                       : read_markups_json(text, path.string());
  for (MarkupPoint& point : read.points) point.label = preprocess::without_person(point.label);
  for (std::string& label : read.unplaced) label = preprocess::without_person(label);
  return read;
}

void resolve_scene_points(Json& file, const fs::path& folder, Problems& problems) {
  if (!file.is_object()) return;
  PointFinder finder(file, folder, problems);
  const auto resolve = [&](Json& owner, const std::string& key) {
    finder.resolve_end(owner, key);
    if (owner.is_object() && owner.contains("point_mm") && owner["point_mm"].is_object()) {
      owner["point_mm"] = finder.find(owner["point_mm"], key + ".point_mm");
    }
  };
  for (const char* one : {"insertion", "introducer", "target"}) {
    if (file.contains(one)) resolve(file[one], one);
  }
  for_each_in(file, "supports", "", resolve);
  for (const char* one : {"start", "measured"}) {
    if (!file.contains(one) || !file[one].is_object()) continue;
    Json& owner = file[one];
    if (!owner.contains("nodes_mm") || !owner["nodes_mm"].is_object()) continue;
    owner["nodes_mm"] = finder.find_line(owner["nodes_mm"], std::string(one) + ".nodes_mm");
  }
  if (!file.contains("vessel") || !file["vessel"].is_object()) return;
  if (file["vessel"].contains("wall")) {
    for_each_in(file["vessel"]["wall"], "held", "vessel.wall.", resolve);
  }
}

void resolve_points(Json& file, const fs::path& folder, Problems& problems) {
  if (!file.is_object()) return;
  PointFinder finder(file, folder, problems);
  const auto resolve = [&](Json& end, const std::string& key) { finder.resolve_end(end, key); };
  for (const char* one : {"access", "target"}) {
    if (file.contains(one)) resolve(file[one], one);
  }
  if (file.contains("wall")) for_each_in(file["wall"], "held", "wall.", resolve);
  for_each_in(file, "accesses", "", resolve);
  for_each_in(file, "targets", "", resolve);
  if (!file.contains("segmentation")) return;
  for_each_in(file["segmentation"], "seeds_mm", "segmentation.",
              [&](Json& seed, const std::string& key) {
                if (seed.is_object()) seed = finder.find(seed, key);
              });
}

}  // namespace wireplan::pipeline
