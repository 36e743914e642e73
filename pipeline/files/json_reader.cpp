#include "pipeline/files/json_reader.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "pipeline/files/disk.h"

namespace wireplan::pipeline {
namespace {

constexpr const char* kPointExpected = "three numbers [x, y, z]";

/// A value as it stands in the file, cut where it is long.
std::string shown(const Json& value) {
  constexpr std::size_t kLongest = 80;
  std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  return text;
}

std::string shown(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string quoted_list(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "\"" : ", \"") + name + "\"";
  return list;
}

bool lies_in(double value, const Range& range) {
  return (range.open_min ? value > range.min : value >= range.min) && value <= range.max;
}

std::string describe(const Range& range) {
  const bool has_min = std::isfinite(range.min), has_max = std::isfinite(range.max);
  if (has_min && has_max) {
    return range.open_min ? "above " + shown(range.min) + " and up to " + shown(range.max)
                          : "from " + shown(range.min) + " to " + shown(range.max);
  }
  if (has_min) return (range.open_min ? "above " : "of at least ") + shown(range.min);
  if (has_max) return "of at most " + shown(range.max);
  return "";
}

std::string joined(const std::string& head, const std::string& tail) {
  return tail.empty() ? head : head + " " + tail;
}

/// Some value of the range, for reading on after a problem.
double harmless(const Range& range) {
  const bool has_min = std::isfinite(range.min), has_max = std::isfinite(range.max);
  if (has_min && has_max) return 0.5 * (range.min + range.max);
  if (has_min) return range.min + 1.0;
  return has_max ? range.max : 1.0;
}

bool is_point(const Json& value) {
  return value.is_array() && value.size() == 3 &&
         std::all_of(value.begin(), value.end(), [](const Json& x) { return x.is_number(); });
}

Vec3 to_vec3(const Json& value) {
  return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

/// Levenshtein distance: fewest insertions, deletions and replacements of a character.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, replaced}));
    }
  }
  return row[b.size()];
}

/// Finds a key that stands twice in one object, which the parsed value would hide.
class DuplicateKeyFinder {
 public:
  void operator()(Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::object_start) levels_.emplace_back();
    if (event == Json::parse_event_t::object_end) levels_.pop_back();
    if (event != Json::parse_event_t::key) return;
    levels_.back().key = parsed.get<std::string>();
    if (!levels_.back().seen.insert(levels_.back().key).second) duplicates_.insert(path());
  }
  const std::set<std::string>& duplicates() const { return duplicates_; }

 private:
  struct Level {
    std::string key;
    std::set<std::string> seen;
  };
  std::string path() const {
    std::string text;
    for (const Level& level : levels_) text += (text.empty() ? "" : ".") + level.key;
    return text;
  }
  std::vector<Level> levels_;
  std::set<std::string> duplicates_;
};

std::string read_text(const std::filesystem::path& path) {
  std::error_code unreachable;
  if (!std::filesystem::exists(path, unreachable)) {
    throw Error(path.string() + ": no such file (check the path and the working directory)");
  }
  if (std::filesystem::is_directory(path, unreachable)) {
    throw Error(path.string() + ": is a folder, expected a JSON file");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(path.string() + ": cannot be opened (check its permissions)");
  std::ostringstream text;
  text << file.rdbuf();
  if (file.bad()) throw Error(path.string() + ": cannot be read to its end");
  return text.str();
}

/// "line 3, column 17" of the byte (counted from 1) that the parser stopped at.
std::string place_in(const std::string& text, std::size_t byte) {
  const std::size_t stop = std::min(byte > 0 ? byte - 1 : 0, text.size());
  const std::string_view head(text.data(), stop);
  const auto line = 1 + std::count(head.begin(), head.end(), '\n');
  const std::size_t newline = head.rfind('\n');
  const std::size_t column = newline == std::string_view::npos ? stop + 1 : stop - newline;
  return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

/// The parser's own words without its "[json.exception...] parse error at line ...: " head, and
/// without what it read last, which may be anybody's.
std::string parser_words(std::string what) {
  what.resize(std::min(what.find("; last read: "), what.size()));
  const std::size_t place = what.find(": ");
  if (place != std::string::npos) return what.substr(place + 2);
  const std::size_t bracket = what.find("] ");
  return bracket == std::string::npos ? what : what.substr(bracket + 2);
}

}  // namespace

Json parse_plain_json(const std::string& text, const std::string& file) {
  constexpr int kDeepest = 100;  // what walks the value recurses
  DuplicateKeyFinder finder;
  Json value;
  try {
    value = Json::parse(text, [&](int depth, Json::parse_event_t event, Json& parsed) {
      if (depth > kDeepest) throw Error(file + ": nested deeper than any file of wireplan");
      finder(event, parsed);
      return true;
    });
  } catch (const Json::parse_error& error) {
    throw Error(file + ": broken JSON at " + place_in(text, error.byte) + ": " +
                parser_words(error.what()) +
                " (look for a missing comma, quote or bracket, or a file cut short)");
  } catch (const Json::exception& error) {
    throw Error(file + ": broken JSON: " + parser_words(error.what()));
  }
  Problems problems(file);
  for (const std::string& key : finder.duplicates()) {
    problems.add(key, "given twice in one object", "once", "delete one of the two");
  }
  problems.throw_if_any();
  return value;
}

namespace {

void expect_finite(const Json& value) {
  if (value.is_number_float() && !std::isfinite(value.get<double>())) {
    throw LogicError("a number that is not finite was about to be written as JSON");
  }
  if (!value.is_structured()) return;  // a plain value iterates over itself
  for (const Json& element : value) expect_finite(element);
}

/// "wireplan.case/2" -> "wireplan.case" and 2; version 0 where there is none.
std::pair<std::string, int> kind_and_version(const std::string& schema) {
  const std::size_t slash = schema.find('/');
  if (slash == std::string::npos) return {schema, 0};
  return {schema.substr(0, slash), std::atoi(schema.c_str() + slash + 1)};
}

/// Which program reads the file, where not this one as a file of the schema `wanted`.
std::string who_reads(const Json& file, const std::string& wanted) {
  const std::string here = std::string("wireplan ") + WIREPLAN_VERSION;
  const auto found = file.find("schema");
  if (found == file.end() || !found->is_string()) return "the version that " + here + " reads";
  const auto [kind, version] = kind_and_version(found->get<std::string>());
  const auto [wanted_kind, wanted_version] = kind_and_version(wanted);
  if (kind == wanted_kind) {
    const Json writer = file.value("/provenance/program/version"_json_pointer, Json());
    if (writer.is_string()) {
      return "wireplan " + writer.get<std::string>() + " wrote it and reads it, " + here +
             " does not";
    }
    return version > wanted_version
               ? "a later wireplan reads it, " + here + " is too old"
               : "an earlier wireplan reads it, " + here + " does not; make the file anew";
  }
  constexpr std::array<std::pair<const char*, const char*>, 4> kCommands = {
      {{"wireplan.case", "run"},
       {"wireplan.scene", "simulate"},
       {"wireplan.phantom", "phantom"},
       {"wireplan.report", "compare"}}};
  for (const auto& [known, command] : kCommands) {
    if (kind == known) return "`wireplan " + std::string(command) + "` reads this file";
  }
  return "the version that " + here + " reads";
}

}  // namespace

std::string nearest_name(const std::string& name, const std::vector<std::string>& known) {
  // More than a third of the letters wrong is another word, not a slip.
  std::size_t best = std::max<std::size_t>(2, name.size() / 3) + 1;
  std::string nearest;
  for (const std::string& candidate : known) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance < best) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

Json parse_json(const std::string& text, const std::string& file, const std::string& schema,
                const std::string& older) {
  Json value = parse_plain_json(text, file);
  if (!value.is_object()) {
    throw Error(file + ": holds " + shown(value) + ", expected a JSON object {...}");
  }
  const auto found = value.find("schema");
  const bool read =
      found != value.end() && (*found == schema || (!older.empty() && *found == older));
  if (!read) {
    Problems problems(file);
    problems.add("schema", found == value.end() ? "missing" : shown(*found), "\"" + schema + "\"",
                 who_reads(value, schema));
    problems.throw_if_any();
  }
  return value;
}

Json read_json(const std::filesystem::path& path, const std::string& schema,
               const std::string& older) {
  return parse_json(read_text(path), path.string(), schema, older);
}

void write_json(const Json& value, const std::filesystem::path& path) {
  expect_finite(value);
  write_whole(value.dump(2, ' ', false, Json::error_handler_t::replace) + "\n", path);
}

Json to_json(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json to_json(const Eigen::Matrix3Xd& points) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < points.cols(); ++i) rows.push_back(to_json(Vec3(points.col(i))));
  return rows;
}

Json number_or_null(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value) : Json();
}

double number_of(const Json& value) { return value.is_null() ? std::nan("") : value.get<double>(); }

Vec3 point_of(const Json& row) {
  return {number_of(row.at(0)), number_of(row.at(1)), number_of(row.at(2))};
}

Eigen::Matrix3Xd points_of(const Json& rows) {
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(rows.size()));
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    points.col(k) = point_of(rows.at(static_cast<std::size_t>(k)));
  }
  return points;
}

void Problems::add(const std::string& key, const std::string& value, const std::string& expected,
                   const std::string& remedy) {
  messages_.push_back(file_ + ": " + key + " is " + value + ", expected " + expected +
                      (remedy.empty() ? "" : " (" + remedy + ")"));
}

void Problems::throw_if_any() const {
  if (messages_.empty()) return;
  std::string text;
  for (const std::string& message : messages_) text += (text.empty() ? "" : "\n") + message;
  throw Error(text);
}

JsonReader::JsonReader(const Json& object, std::string path, Problems& problems)
    : object_(&object), path_(std::move(path)), problems_(&problems) {
  if (object.is_object()) return;
  problems.add(path_.empty() ? "the file" : path_, shown(object), "an object {...}");
  object_ = nullptr;
}

void JsonReader::finish() {
  if (object_ == nullptr) return;
  for (const auto& [key, value] : object_->items()) {
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    const std::string nearest = nearest_name(key, known_);
    if (nearest.empty()) {
      problems_->add(path_of(key), "not a known key", "one of " + quoted_list(known_));
    } else {
      problems_->add(path_of(key), "not a known key", "\"" + nearest + "\"",
                     "the nearest known key; units stand in the keys");
    }
  }
}

const Json* JsonReader::find(const std::string& key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.push_back(key);
  if (object_ == nullptr) return nullptr;
  const auto found = object_->find(key);
  return found == object_->end() ? nullptr : &*found;
}

const Json* JsonReader::find_value(const std::string& key, bool required,
                                   const std::string& expected) {
  const Json* value = find(key);
  if (value == nullptr && required && object_ != nullptr) {
    problems_->add(path_of(key), "missing", expected);
  }
  return value;
}

bool JsonReader::has(const std::string& key) { return find(key) != nullptr; }

double JsonReader::number(const std::string& key, std::optional<double> fallback, Range range,
                          const std::string& hint) {
  const std::string expected = joined("a number", describe(range));
  const double otherwise = fallback.value_or(harmless(range));
  const Json* value = find_value(key, !fallback, expected);
  if (value == nullptr) return otherwise;
  if (!value->is_number()) {
    problems_->add(path_of(key), shown(*value), expected);
    return otherwise;
  }
  const double number = value->get<double>();
  if (lies_in(number, range)) return number;
  problems_->add(path_of(key), shown(*value), expected, hint);
  return otherwise;
}

int JsonReader::integer(const std::string& key, std::optional<int> fallback, int min, int max) {
  const Range range{.min = static_cast<double>(min), .max = static_cast<double>(max)};
  const std::string expected = joined("a whole number", describe(range));
  const Json* value = find_value(key, !fallback, expected);
  if (value == nullptr) return fallback.value_or(min);
  const double number = value->is_number() ? value->get<double>() : 0.5;
  if (number == std::floor(number) && lies_in(number, range)) return static_cast<int>(number);
  problems_->add(path_of(key), shown(*value), expected);
  return fallback.value_or(min);
}

bool JsonReader::boolean(const std::string& key, bool fallback) {
  const Json* value = find(key);
  if (value == nullptr) return fallback;
  if (value->is_boolean()) return value->get<bool>();
  problems_->add(path_of(key), shown(*value), "true or false");
  return fallback;
}

std::string JsonReader::text(const std::string& key, std::optional<std::string> fallback) {
  const std::string expected = "a text in quotes, not empty";
  const Json* value = find_value(key, !fallback, expected);
  if (value == nullptr) return fallback.value_or("");
  if (value->is_string() && !value->get_ref<const std::string&>().empty()) {
    return value->get<std::string>();
  }
  problems_->add(path_of(key), shown(*value), expected);
  return fallback.value_or("");
}

std::string JsonReader::file_name(const std::string& key, std::optional<std::string> fallback) {
  const std::string name = text(key, std::move(fallback));
  const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_';
  });
  if (!plain || name.size() > kLongestName) {
    problems_->add(path_of(key), Json(name).dump(),
                   "at most " + std::to_string(kLongestName) + " letters, digits, - and _",
                   "files are named after it");
  }
  return name;
}

std::string JsonReader::choice(const std::string& key, std::optional<std::string> fallback,
                               const std::vector<std::string>& allowed) {
  const std::string expected = "one of " + quoted_list(allowed);
  const std::string otherwise = fallback.value_or(allowed.front());
  const Json* value = find_value(key, !fallback, expected);
  if (value == nullptr) return otherwise;
  for (const std::string& name : allowed) {
    if (*value == name) return name;
  }
  problems_->add(path_of(key), shown(*value), expected);
  return otherwise;
}

Vec3 JsonReader::point(const std::string& key, std::optional<Vec3> fallback) {
  const Json* value = find_value(key, !fallback, kPointExpected);
  if (value == nullptr) return fallback.value_or(Vec3::Zero());
  if (is_point(*value)) return to_vec3(*value);
  problems_->add(path_of(key), shown(*value), kPointExpected);
  return fallback.value_or(Vec3::Zero());
}

Vec3 JsonReader::direction(const std::string& key, std::optional<Vec3> fallback) {
  const std::string expected = std::string(kPointExpected) + ", not all 0";
  const Json* value = find_value(key, !fallback, expected);
  if (value == nullptr) return fallback.value_or(Vec3::UnitX());
  const Vec3 direction = is_point(*value) ? to_vec3(*value) : Vec3::Zero();
  const double length = direction.stableNorm();
  if (length > 0.0 && std::isfinite(length)) return direction / length;
  problems_->add(path_of(key), shown(*value), expected);
  return fallback.value_or(Vec3::UnitX());
}

std::vector<Vec3> JsonReader::points(const std::string& key, bool required) {
  const std::string expected = "a list of points [[x, y, z], ...]";
  const Json* value = find_value(key, required, expected);
  std::vector<Vec3> points;
  if (value == nullptr) return points;
  if (!value->is_array() || value->empty()) {
    problems_->add(path_of(key), shown(*value), expected);
    return points;
  }
  for (std::size_t i = 0; i < value->size(); ++i) {
    const Json& element = (*value)[i];
    if (is_point(element)) {
      points.push_back(to_vec3(element));
    } else {
      problems_->add(path_of(key) + "[" + std::to_string(i) + "]", shown(element), kPointExpected);
    }
  }
  return points;
}

std::vector<double> JsonReader::numbers(const std::string& key,
                                        std::optional<std::vector<double>> fallback, Range range) {
  const std::string expected = "a list of numbers [a, b, ...]";
  const Json* value = find_value(key, !fallback, expected);
  const std::vector<double> otherwise = fallback.value_or(std::vector<double>{});
  if (value == nullptr) return otherwise;
  if (!value->is_array() || value->empty()) {
    problems_->add(path_of(key), shown(*value), expected);
    return otherwise;
  }
  std::vector<double> numbers;
  for (std::size_t i = 0; i < value->size(); ++i) {
    const Json& element = (*value)[i];
    if (element.is_number() && lies_in(element.get<double>(), range)) {
      numbers.push_back(element.get<double>());
    } else {
      problems_->add(path_of(key) + "[" + std::to_string(i) + "]", shown(element),
                     joined("a number", describe(range)));
    }
  }
  return numbers;
}

JsonReader JsonReader::object(const std::string& key, bool required) {
  static const Json kEmpty = Json::object();
  const Json* value = find_value(key, required, "an object {...}");
  if (value != nullptr) return JsonReader(*value, path_of(key), *problems_);
  JsonReader absent(kEmpty, path_of(key), *problems_);
  if (required || object_ == nullptr) absent.object_ = nullptr;  // told already
  return absent;
}

std::vector<JsonReader> JsonReader::objects(const std::string& key, bool required) {
  const std::string expected = "a list of objects [{...}, ...]";
  const Json* value = find_value(key, required, expected);
  std::vector<JsonReader> readers;
  if (value == nullptr) return readers;
  if (!value->is_array() || (required && value->empty())) {
    problems_->add(path_of(key), shown(*value), expected);
    return readers;
  }
  for (std::size_t i = 0; i < value->size(); ++i) {
    readers.emplace_back((*value)[i], path_of(key) + "[" + std::to_string(i) + "]", *problems_);
  }
  return readers;
}

const Json& JsonReader::raw(const std::string& key) {
  static const Json kNull;
  const Json* value = find(key);
  return value == nullptr ? kNull : *value;
}

std::string JsonReader::path_of(const std::string& key) const {
  return path_.empty() ? key : path_ + "." + key;
}

}  // namespace wireplan::pipeline
