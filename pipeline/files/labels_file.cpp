#include "pipeline/files/labels_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include "pipeline/files/case_file.h"
#include "preprocess/segment/label_places.h"
#include "preprocess/text.h"
#include "preprocess/volume/identity.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr int kLargestValue = 1000000;
constexpr const char* kTables =
    "expected names of label values: a dataset.json, {\"aorta\": 1, ...}, or lines of a value and "
    "a "
    "name";

/// A whole number from 0; empty where the text is something else.
std::optional<int> whole_number(const std::string& text) {
  const bool digits =
      !text.empty() && text.size() <= 7 &&
      std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  if (!digits || std::atoi(text.c_str()) > kLargestValue) return {};
  return std::atoi(text.c_str());
}

bool is_number(const std::string& text) {
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  return !text.empty() && *end == '\0';
}

void add_name(std::map<int, std::string>& table, int value, const std::string& given,
              const fs::path& path) {
  try {
    static_cast<void>(Json(given).dump());
  } catch (const Json::exception&) {
    throw Error(path.string() + ": the name of value " + std::to_string(value) +
                " is no UTF-8; save the table as UTF-8");
  }
  const std::string name = preprocess::without_person(given);
  if (name.empty()) return;
  const auto [place, is_new] = table.emplace(value, name);
  if (is_new || place->second == name) return;
  throw Error(path.string() + ": value " + std::to_string(value) + " is named \"" + place->second +
              "\" and \"" + name + "\", expected one name; mend the table");
}

/// Of a file that is no table of names at all, unlike one that is broken.
class NoTable : public Error {
 public:
  using Error::Error;
};

/// Takes names out that hold what else of the file is told of the patient, or nothing.
void hide_patient(std::map<int, std::string>& table, std::vector<std::string> tags) {
  std::erase(tags, "");
  for (auto& [value, name] : table) name = preprocess::without_identity(name, tags);
  std::erase_if(table, [](const auto& one) { return one.second.empty(); });
}

std::map<int, std::string> table_of_json(const std::string& text, const fs::path& path) {
  const Json file = parse_plain_json(text, path.string());
  if (!file.is_object()) throw NoTable(path.string() + ": no JSON object; " + kTables);
  const bool labels = file.contains("labels") && file.at("labels").is_object();
  std::map<int, std::string> table;
  int entry = 0;
  for (const auto& [key, given] : (labels ? file.at("labels") : file).items()) {
    ++entry;
    // A region of nnU-Net is a union of classes, and one only where it has one.
    if (given.is_array() && given.size() != 1) continue;
    const Json& value = given.is_array() ? given.front() : given;
    const std::optional<int> number = whole_number(key);
    if (number && value.is_string()) {
      add_name(table, *number, value.get<std::string>(), path);
    } else if (value.is_number_integer() && value.get<std::int64_t>() >= 0 &&
               value.get<std::int64_t>() <= kLargestValue) {
      add_name(table, value.get<int>(), key, path);
    } else {
      // What is inside may be long, or tell who somebody is; so may a key of something else.
      const std::string told = value.is_number() ? value.dump() : std::string(value.type_name());
      const std::string shown = labels ? preprocess::without_person(key) : "";
      const std::string what =
          path.string() + ": its " +
          (!shown.empty() ? "\"labels." + shown + "\""
                          : (labels ? "labels, entry " : "entry ") + std::to_string(entry)) +
          " is " + told + ", no whole number from 0; " + kTables;
      if (labels) throw Error(what);
      throw NoTable(what);
    }
  }
  std::vector<std::string> tags;
  for (const auto& [key, value] : file.items()) {
    if (value.is_string())
      tags.push_back(preprocess::told_of_patient(key + ":" + value.get<std::string>()));
  }
  hide_patient(table, tags);
  return table;
}

/// What parts the cells of most of the lines: a tab, semicolon or comma outside of quotes, or else
/// spaces.
char separator_of(const std::vector<std::string>& lines) {
  for (const char mark : {'\t', ';', ','}) {
    const auto count = std::count_if(lines.begin(), lines.end(), [&](const std::string& line) {
      bool quoted = false;
      return std::any_of(line.begin(), line.end(), [&](char c) {
        quoted = quoted != (c == '"');
        return c == mark && !quoted;
      });
    });
    if (2 * count > static_cast<std::ptrdiff_t>(lines.size())) return mark;
  }
  return ' ';
}

/// What is quoted is one cell. Between spaces none is empty.
std::vector<std::string> cells_of_line(const std::string& line, char separator) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && (c == separator || (separator == ' ' && c == '\t'))) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  for (std::string& cell : cells) {
    const std::size_t first = cell.find_first_not_of(" \r"), last = cell.find_last_not_of(" \r");
    cell = first == std::string::npos ? "" : cell.substr(first, last - first + 1);
  }
  if (separator == ' ') std::erase(cells, "");
  return cells;
}

/// Which columns of a table are meant, by its first line.
struct TableColumns {
  std::size_t value = 0, name = 0, count = 0;
};

/// The first of the words that heads a column; empty where none does.
std::optional<std::size_t> column_of(const std::vector<std::string>& heads,
                                     const std::vector<const char*>& words) {
  for (const char* word : words) {
    const auto found = std::find(heads.begin(), heads.end(), word);
    if (found != heads.end()) return static_cast<std::size_t>(found - heads.begin());
  }
  return {};
}

/// The first column whose head ends so, and is no figure of what the voxels hold.
std::optional<std::size_t> column_that_ends(const std::vector<std::string>& heads,
                                            const std::vector<const char*>& endings) {
  constexpr std::array kFigures = {"mean", "max", "min", "std", "median", "volume", "hu", "count"};
  for (std::size_t k = 0; k < heads.size(); ++k) {
    const auto starts = [&](const char* word) { return heads[k].starts_with(word); };
    if (std::any_of(kFigures.begin(), kFigures.end(), starts)) continue;
    for (const char* ending : endings) {
      if (heads[k].ends_with(ending)) return k;
    }
  }
  return {};
}

/// Empty where the line heads no names, or not so that it is known.
std::optional<TableColumns> columns_of(const std::vector<std::string>& cells,
                                       const fs::path& path) {
  std::vector<std::string> heads;
  for (const std::string& cell : cells) {
    std::string& head = heads.emplace_back();
    for (const char c : cell) {
      const auto letter = static_cast<unsigned char>(c);
      if (std::isalnum(letter) != 0) head += static_cast<char>(std::tolower(letter));
    }
  }
  const auto label = column_of(heads, {"label", "labels"});  // either
  auto name = column_of(
      heads, {"name",      "labelname",   "segmentname", "structurename", "classname", "roiname",
              "structure", "segment",     "class",       "region",        "roi",       "organ",
              "anatomy",   "bezeichnung", "description", "beschreibung",  "vessel",    "artery",
              "tissue",    "title",       "text"});
  if (!name) name = column_that_ends(heads, {"name"});
  auto value = column_of(heads, {"value", "labelvalue", "labelid", "labelindex", "labelnumber",
                                 "index", "idx", "integerlabel", "voxelvalue", "pixelvalue"});
  if (!value && name) value = label;
  if (!value)
    value = column_of(heads, {"id", "key", "code", "number", "no", "nr", "wert", "nummer"});
  if (!value) value = column_that_ends(heads, {"id", "value", "index", "number", "nr"});
  if (!name) name = label;
  if (value && name) return TableColumns{*value, *name, cells.size()};
  if (!name) return {};
  throw NoTable(path.string() +
                ": its first line heads no column of values, expected one called value, label, "
                "index or id beside the names; " +
                kTables);
}

/// A value, and its name; empty where the row has none.
struct TableRow {
  std::optional<int> value;
  std::string name;
};

/// A whole number as tables have it: "1.0" too.
std::optional<int> cell_number(std::string cell) {
  if (cell.ends_with(".0")) cell.resize(cell.size() - 2);
  return whole_number(cell);
}

/// By columns. Without marks a name may have several words.
TableRow row_by_columns(const std::vector<std::string>& cells, const TableColumns& columns,
                        bool marked) {
  const std::size_t more =
      marked || cells.size() < columns.count ? 0 : cells.size() - columns.count;
  const std::size_t value = columns.value + (columns.name < columns.value ? more : 0);
  if (std::max(value, columns.name + more) >= cells.size()) return {};
  TableRow row{.value = cell_number(cells[value]), .name = cells[columns.name]};
  for (std::size_t k = 1; k <= more; ++k) row.name += " " + cells[columns.name + k];
  return row;
}

/// Value and name begin the line, in either order. Without marks a name goes on to the next number.
TableRow row_by_order(std::vector<std::string> cells, bool marked) {
  std::erase(cells, "");
  TableRow row;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    if (!row.value && (!marked || k < 2)) row.value = cell_number(cells[k]);
    if (is_number(cells[k])) {
      if (!row.name.empty()) break;
    } else if (row.name.empty() || !marked) {
      row.name += (row.name.empty() ? "" : " ") + cells[k];
    }
  }
  return row;
}

std::map<int, std::string> table_of_lines(std::string text, const fs::path& path) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    throw Error(path.string() + ": is UTF-16; save the table as UTF-8");
  }
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
  std::istringstream stream(text);
  std::vector<std::string> lines;  // with their numbers
  std::vector<int> numbers;
  std::vector<std::string> tags;
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    const std::size_t first = line.find_first_not_of(" \t\r,;");
    if (first != std::string::npos && line[first] == '#') {
      tags.push_back(preprocess::told_of_patient(line));
    }
    if (first == std::string::npos || line[first] == '#') continue;
    lines.push_back(line);
    numbers.push_back(number);
  }
  const char separator = separator_of(lines);
  std::map<int, std::string> table;
  std::optional<TableColumns> columns;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const std::vector<std::string> cells = cells_of_line(lines[k], separator);
    const TableRow row = columns ? row_by_columns(cells, *columns, separator != ' ')
                                 : row_by_order(cells, separator != ' ');
    if (k == 0 && !row.value) {  // what the columns are
      columns = columns_of(cells, path);
      continue;
    }
    if (columns && row.value && row.name.empty()) continue;  // a value that has no name
    if (!row.value || row.name.empty()) {
      const std::string what = path.string() + ": line " + std::to_string(numbers[k]) +
                               " has no value and name; " + kTables;
      if (columns) throw Error(what);
      throw NoTable(what);
    }
    add_name(table, *row.value, row.name, path);
  }
  hide_patient(table, tags);
  return table;
}

/// Without the ending of a volume.
std::string stem_of(const fs::path& path) {
  std::string name = path.filename().string();
  const std::string small = lower_case(path.filename().string());
  for (const char* ending : {".nii.gz", ".nii", ".seg.nrrd", ".nrrd", ".nhdr", ".mha", ".mhd"}) {
    if (small.ends_with(ending)) return name.substr(0, name.size() - std::string(ending).size());
  }
  return name;
}

std::vector<int> read_values(JsonReader& reader) {
  const std::size_t problems_before = reader.problems().count();
  const std::vector<double> numbers = reader.numbers(
      "values", std::vector<double>{}, {.min = 1.0, .max = static_cast<double>(kLargestValue)});
  if (reader.problems().count() > problems_before) return {};
  std::vector<int> values;
  std::set<int> taken;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const std::string key = reader.path_of("values") + "[" + std::to_string(k) + "]";
    const int value = static_cast<int>(numbers[k]);
    if (numbers[k] != std::floor(numbers[k])) {
      reader.problems().add(key, Json(numbers[k]).dump(), "a whole number");
    } else if (!taken.insert(value).second) {
      reader.problems().add(key, std::to_string(value) + " again", "each value once");
    }
    values.push_back(value);
  }
  return values;
}

std::vector<std::string> read_names(JsonReader& reader, bool of_files) {
  std::vector<std::string> names;
  if (!reader.has("names")) return names;
  const Json& list = reader.raw("names");
  if (!list.is_array() || list.empty()) {
    reader.problems().add(reader.path_of("names"), list.dump(),
                          "a list of names of classes, at least one");
    return names;
  }
  std::set<std::string> taken;
  for (std::size_t k = 0; k < list.size(); ++k) {
    const std::string key = reader.path_of("names") + "[" + std::to_string(k) + "]";
    std::string name = list[k].is_string() ? list[k].get<std::string>() : "";
    if (const auto shown = preprocess::without_person(name); !of_files && !shown.empty())
      name = shown;
    if (name.empty() || name.find_first_of("/\\") != std::string::npos) {
      reader.problems().add(key, list[k].dump(), "the name of a class, a text without '/'");
    } else if (!taken.insert(name).second) {
      reader.problems().add(key, list[k].dump() + " again", "each name once");
    }
    names.push_back(name);
  }
  return names;
}

/// Accesses and targets that name a branch, by their keys.
std::vector<std::pair<std::string, Json*>> ends_with_branches(Json& file) {
  std::vector<std::pair<std::string, Json*>> ends;
  const auto add = [&](Json& end, const std::string& key) {
    if (end.is_object() && end.contains("branch")) ends.emplace_back(key, &end);
  };
  if (!file.is_object()) return ends;
  for (const char* one : {"access", "target"}) {
    if (file.contains(one)) add(file[one], one);
  }
  for (const char* list : {"accesses", "targets"}) {
    if (!file.contains(list) || !file[list].is_array()) continue;
    for (std::size_t k = 0; k < file[list].size(); ++k) {
      add(file[list][k], list + ("[" + std::to_string(k) + "]"));
    }
  }
  return ends;
}

/// The labels as one piece, by whose names places are told.
struct NamedLumen {
  preprocess::LabelMask mask;
  std::vector<preprocess::LabelClass> classes;
};

/// The point of {"branch", "beyond_ostium_mm" or "end"}, to a hundredth of a millimetre; null after
/// a problem.
Json find_named_point(JsonReader& reader, const NamedLumen& lumen) {
  Problems& problems = reader.problems();
  const std::size_t before = problems.count();
  const std::string name = preprocess::without_person(reader.text("branch", std::nullopt));
  std::vector<std::string> names;
  for (const preprocess::LabelClass& one : lumen.classes) names.push_back(one.name);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end() && problems.count() == before) {
    std::string list;
    for (const std::string& one : names) list += (list.empty() ? "" : ", ") + one;
    const std::string nearest = nearest_name(name, names);
    problems.add(reader.path_of("branch"), "\"" + name + "\"", "a chosen class of labels: " + list,
                 nearest.empty() ? "" : "did you mean \"" + nearest + "\"?");
  }
  if (reader.has("point_mm")) {  // of "point" too by now
    problems.add(reader.path_of("branch"), "given beside a point", "one of the two");
    reader.raw("point_mm");
  }
  const bool beyond = reader.has("beyond_ostium_mm"), at_end = reader.has("end");
  if (beyond == at_end) {
    problems.add(reader.path_of("branch"), "\"" + name + "\"",
                 beyond ? "beyond_ostium_mm or end, not both"
                        : "a place in it: beyond_ostium_mm, or end (distal; of the trunk superior "
                          "or inferior)");
  }
  double distance = 0.0;
  std::string end = "distal";
  if (beyond) {
    distance =
        reader.number("beyond_ostium_mm", std::nullopt, {.min = 0.0, .max = 1000.0}, "given in m?");
  }
  if (at_end) end = reader.choice("end", std::nullopt, {"distal", "superior", "inferior"});
  if (problems.count() > before) return nullptr;
  using preprocess::BranchEnd;
  const BranchEnd which = end == "distal"     ? BranchEnd::kDistal
                          : end == "superior" ? BranchEnd::kSuperior
                                              : BranchEnd::kInferior;
  try {
    const preprocess::LabelledWay way = preprocess::find_labelled_way(
        lumen.mask, lumen.classes, static_cast<std::size_t>(found - names.begin()));
    const Vec3 point = beyond ? preprocess::find_beyond_ostium(way, distance, name)
                              : preprocess::find_end(lumen.mask, way, which, name);
    return to_json(Vec3((100.0 * point).array().round() / 100.0));
  } catch (const Error& error) {
    problems.add(reader.path_of(beyond ? "beyond_ostium_mm" : "end"),
                 beyond ? Json(distance).dump() : "\"" + end + "\"", "a place in the branch",
                 error.what());
    return nullptr;
  }
}

/// Of the case's labels, for places that are told by `end`, a key and what it holds. Without one
/// where they cannot be read, which is told here or by the case's own reader.
std::optional<NamedLumen> read_named_lumen(const Json& file, const fs::path& folder,
                                           const std::pair<std::string, Json*>& end,
                                           Problems& problems) {
  Problems told_later(problems);
  JsonReader root(file, "", told_later);
  if (!root.has("labels")) {
    problems.add(end.first + ".branch", end.second->at("branch").dump(),
                 "labels in the case, whose classes have names", "give a point_mm without them");
    return {};
  }
  const std::size_t problems_before = told_later.count();
  const LabelsInput labels = read_labels_input(root.object("labels", true), folder);
  if (told_later.count() > problems_before) return {};
  const std::size_t most_pieces = read_mask_limits(root, false).pieces();
  try {
    preprocess::LabelVolume read = read_labels(labels);
    return NamedLumen{preprocess::merge_labels(read, preprocess::kMostGap, most_pieces),
                      std::move(read.classes)};
  } catch (const DiskError&) {
    throw;
  } catch (const Error& error) {
    problems.add("labels", "\"" + labels.given + "\"", "labels that can be read", error.what());
    return {};
  }
}

}  // namespace

std::map<int, std::string> read_label_table(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!fs::is_regular_file(path) || !stream) {
    throw Error(path.string() + ": no such file; " + kTables);
  }
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  const std::map<int, std::string> table = lower_case(path.filename().string()).ends_with(".json")
                                               ? table_of_json(text, path)
                                               : table_of_lines(text, path);
  if (table.empty()) throw NoTable(path.string() + ": holds no names; " + kTables);
  return table;
}

FoundTable find_label_table(const fs::path& labels) {
  if (fs::is_directory(labels)) return {};
  const fs::path folder = fs::absolute(labels).parent_path();
  std::vector<fs::path> places;
  for (const char* ending : {".json", ".csv", ".tsv", ".txt", ".ctbl"}) {
    places.push_back(folder / (stem_of(labels) + ending));
  }
  places.push_back(folder / "dataset.json");
  places.push_back(folder.parent_path() / "dataset.json");
  std::string problem;
  for (const fs::path& place : places) {
    std::error_code unknown;
    if (!fs::is_regular_file(place, unknown)) continue;
    try {
      return {.names = read_label_table(place), .problem = {}};
    } catch (const NoTable& error) {  // of that name, but something else
      problem += (problem.empty() ? "" : "\n") + std::string(error.what());
    } catch (const Error& error) {
      return {.names = {}, .problem = error.what()};
    }
  }
  return {.names = {}, .problem = problem};
}

preprocess::LabelVolume read_labels(const LabelsInput& labels, const preprocess::Grid* onto) {
  const std::string problem =
      labels.table_given.empty() ? find_label_table(labels.path).problem : std::string();
  preprocess::LabelVolume read;
  try {
    read = preprocess::read_labels(labels.path, labels.choice, onto);
  } catch (const DiskError&) {
    throw;
  } catch (const Error& error) {
    if (problem.empty()) throw;
    throw Error(error.what() + ("\n" + problem));
  }
  const bool unnamed =
      std::any_of(read.classes.begin(), read.classes.end(),
                  [](const preprocess::LabelClass& one) { return one.name.starts_with("label "); });
  if (unnamed && !problem.empty()) read.remarks.push_back("the labels have no names: " + problem);
  return read;
}

LabelsInput read_labels_input(JsonReader reader, const fs::path& folder) {
  const std::size_t problems_before = reader.problems().count();
  LabelsInput labels;
  labels.given = reader.text("path", std::nullopt);
  labels.path = resolve_path(labels.given, folder);
  expect_exists(reader, "path", labels.given, labels.path,
                "a volume of labels or a folder with one file per class");
  labels.choice.values = read_values(reader);
  labels.choice.names = read_names(reader, fs::is_directory(labels.path));
  const std::size_t values = labels.choice.values.size(), names = labels.choice.names.size();
  if (values > 0 && names > 0 && values != names) {
    reader.problems().add(reader.path_of("names"), std::to_string(names) + " names",
                          "as many as labels.values, which has " + std::to_string(values),
                          "beside values the names are theirs, one each; to choose by name, leave "
                          "the values out");
  }
  labels.table_given = reader.text("table", "");
  const bool table_beside_folder = !labels.table_given.empty() && fs::is_directory(labels.path);
  if (table_beside_folder) {
    reader.problems().add(reader.path_of("table"), "\"" + labels.table_given + "\"",
                          "none with a folder", "the classes of a folder are named by its files");
  }
  reader.finish();
  if (reader.problems().count() > problems_before) return labels;
  if (labels.table_given.empty()) {
    labels.choice.table = find_label_table(labels.path).names;
    return labels;
  }
  try {
    labels.choice.table = read_label_table(resolve_path(labels.table_given, folder));
    labels.choice.table_wins = true;
  } catch (const Error& error) {
    reader.problems().add(reader.path_of("table"), "\"" + labels.table_given + "\"",
                          "a table of names", error.what());
  }
  return labels;
}

void resolve_branches(Json& file, const fs::path& folder, Problems& problems) {
  const std::vector<std::pair<std::string, Json*>> ends = ends_with_branches(file);
  if (ends.empty()) return;
  const std::optional<NamedLumen> lumen = read_named_lumen(file, folder, ends.front(), problems);
  double apart = 0.0;
  for (const auto& [key, end] : ends) {
    JsonReader reader(*end, key, problems);
    Json point = lumen ? find_named_point(reader, *lumen) : nullptr;
    for (const char* used : {"branch", "beyond_ostium_mm", "end"}) end->erase(used);
    // One that is not known lies apart from every other, so that the rest of the case can be read.
    if (point.is_null()) point = to_json(Vec3(0.0, apart += 1000.0, 0.0));
    (*end)["point_mm"] = std::move(point);
  }
}

Json labels_json(const LabelsInput& labels) {
  Json json = {{"path", labels.given}};
  if (!labels.choice.values.empty()) json["values"] = labels.choice.values;
  if (!labels.choice.names.empty()) json["names"] = labels.choice.names;
  if (!labels.table_given.empty()) json["table"] = labels.table_given;
  return json;
}

preprocess::MaskLimits read_mask_limits(JsonReader& root, bool from_surface) {
  preprocess::MaskLimits limits;
  if (from_surface && root.has("mask")) {
    root.problems().add("mask", "given with a surface as input", "none",
                        "only a volume or labels become a mask; delete it");
    root.raw("mask");
    return limits;
  }
  JsonReader reader = root.object("mask", false);
  limits.handles = reader.integer("most_handles", limits.handles, 0, 1'000'000'000);
  limits.faces = reader.integer("most_faces", limits.faces, 1, 2'000'000'000);
  reader.finish();
  return limits;
}

Json mask_limits_json(const preprocess::MaskLimits& limits) {
  return {{"most_handles", limits.handles}, {"most_faces", limits.faces}};
}

}  // namespace wireplan::pipeline
