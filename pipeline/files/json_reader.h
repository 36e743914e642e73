#pragma once
/// Reading our JSON files: every value with its type, range and unit checked, unknown keys found,
/// all problems told at once. A reader walks one object; its keys count as known once they are
/// asked for.
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "preprocess/base.h"

namespace wireplan::pipeline {

using Json = nlohmann::ordered_json;

/// Parses a file. Throws Error for a missing file (naming it), for broken JSON (with line and
/// column), for a key given twice in one object, and unless `schema`, or an `older` one that is
/// still read, stands under "schema" (naming the version that this program reads).
Json read_json(const std::filesystem::path& path, const std::string& schema,
               const std::string& older = {});

/// The same for a text; `file` names it in messages.
Json parse_json(const std::string& text, const std::string& file, const std::string& schema,
                const std::string& older = {});

/// Any JSON without a schema. Throws `Error` where it is broken (with the place) or a key stands
/// twice in one object.
Json parse_plain_json(const std::string& text, const std::string& file);

/// Writes UTF-8, two spaces of indent, numbers with as few digits as read back the same, whole or
/// not at all (disk.h). Throws LogicError where a number is not finite, DiskError where the disk
/// refuses.
void write_json(const Json& value, const std::filesystem::path& path);

/// Vec3 as [x, y, z] and matrices (3, n) as n such rows.
Json to_json(const Vec3& v);
Json to_json(const Eigen::Matrix3Xd& points);

/// Null where there is no number or it is not finite.
Json number_or_null(const std::optional<double>& value);
/// Back from a file: not a number where it holds null. Points are rows of three, `points_of` (3,
/// n).
double number_of(const Json& value);
Vec3 point_of(const Json& row);
Eigen::Matrix3Xd points_of(const Json& rows);

/// The known name nearest by edit distance; empty where none is near enough to be meant.
std::string nearest_name(const std::string& name, const std::vector<std::string>& known);

/// Collects what is wrong with one file: "FILE: KEY is VALUE, expected EXPECTATION (REMEDY)".
class Problems {
 public:
  explicit Problems(std::string file) : file_(std::move(file)) {}
  void add(const std::string& key, const std::string& value, const std::string& expected,
           const std::string& remedy = "");
  bool empty() const { return messages_.empty(); }
  /// How many so far. A caller compares values that belong together only if reading them added
  /// none.
  std::size_t count() const { return messages_.size(); }
  /// Throws one Error with every message on a line of its own, unless there is none.
  void throw_if_any() const;

 private:
  std::string file_;
  std::vector<std::string> messages_;
};

/// Of a name that files or folders are called after, two of which may stand in one file's name.
inline constexpr std::size_t kLongestName = 80;

struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool open_min = false;  // min itself is not allowed
};

class JsonReader {
 public:
  /// `path` is the key of this object in the file ("" for the root), used in messages:
  /// "wall.thickness_mm".
  JsonReader(const Json& object, std::string path, Problems& problems);

  /// Reports the unknown keys, each with the nearest known one. Call it when all is read.
  void finish();

  bool has(const std::string& key);
  /// Value or default; without a default the key is required. `hint` is the remedy told when out of
  /// range ("given in m?"). After a problem a harmless value is returned and reading goes on.
  double number(const std::string& key, std::optional<double> fallback, Range range,
                const std::string& hint = "");
  int integer(const std::string& key, std::optional<int> fallback, int min, int max);
  bool boolean(const std::string& key, bool fallback);
  std::string text(const std::string& key, std::optional<std::string> fallback);
  /// A text that files are called after: letters, digits, - and _, at most kLongestName.
  std::string file_name(const std::string& key, std::optional<std::string> fallback);
  std::string choice(const std::string& key, std::optional<std::string> fallback,
                     const std::vector<std::string>& allowed);
  Vec3 point(const std::string& key, std::optional<Vec3> fallback);
  /// Three numbers, not all 0, normalised to length 1.
  Vec3 direction(const std::string& key, std::optional<Vec3> fallback);
  std::vector<Vec3> points(const std::string& key, bool required);
  std::vector<double> numbers(const std::string& key, std::optional<std::vector<double>> fallback,
                              Range range);
  /// The object under the key; an empty one where it is absent and not required. If the object is
  /// missing or of the wrong type, that is reported once, and not again for each key it should
  /// hold.
  JsonReader object(const std::string& key, bool required);
  /// The elements of an array of objects.
  std::vector<JsonReader> objects(const std::string& key, bool required);
  /// The raw value, for what has several forms; null where absent.
  const Json& raw(const std::string& key);
  std::string path_of(const std::string& key) const;
  Problems& problems() { return *problems_; }

 private:
  const Json* find(const std::string& key);  // null where absent; the key is known from now on
  const Json* find_value(const std::string& key, bool required, const std::string& expected);

  const Json* object_ = nullptr;  // null: what should be here is told already
  std::string path_;
  Problems* problems_ = nullptr;
  std::vector<std::string> known_;
};

}  // namespace wireplan::pipeline
