#include "pipeline/files/access_target_file.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <string_view>
#include <utility>

namespace wireplan::pipeline {
namespace {

constexpr Range kTurn{.min = -360.0, .max = 360.0};

/// Sections are named by it, and so are folders: ACCESS--TARGET. The only one may do without.
std::string read_section_name(JsonReader& reader, bool required, std::set<std::string>& taken) {
  if (!required && !reader.has("name")) return {};
  const std::string name = reader.text("name", std::nullopt);
  const bool plain = name.size() <= kLongestName && !name.empty() &&
                     std::isalnum(static_cast<unsigned char>(name.front())) != 0 &&
                     std::all_of(name.begin(), name.end(), [](char c) {
                       return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
                              std::string_view("-_. ").find(c) != std::string_view::npos;
                     });
  if (name.empty()) return name;  // it is told already
  if (!plain) {
    reader.problems().add(reader.path_of("name"), "\"" + name + "\"",
                          "at most " + std::to_string(kLongestName) +
                              " letters, digits, spaces, '-', '_' and '.', starting with a letter "
                              "or digit",
                          "folders are named after it");
  } else if (folder_name(name).find(kBetweenNames) != std::string::npos) {
    reader.problems().add(reader.path_of("name"), "\"" + name + "\"",
                          "no two dashes or spaces in a row",
                          "they part the access from the target in the names of folders");
  } else if (name.ends_with(".json") || name.ends_with(".html") || name.ends_with(".csv")) {
    reader.problems().add(reader.path_of("name"), "\"" + name + "\"",
                          "a name that does not end in .json, .html or .csv",
                          "files of the answer beside its folder are called so");
  } else if (!taken.insert(folder_name(name)).second) {
    reader.problems().add(reader.path_of("name"), "\"" + name + "\" again", "a name of its own",
                          "the report tells them apart by name");
  }
  return name;
}

/// Tells of a place in a branch where the branch itself is not named; with one it is a point by
/// now.
void refuse_place_of_branch(JsonReader& reader) {
  if (reader.has("branch")) return;  // told already
  for (const char* key : {"beyond_ostium_mm", "end"}) {
    if (!reader.has(key)) continue;
    reader.problems().add(
        reader.path_of(key), "given without branch", "\"branch\" beside it",
        "it tells a place in a class of the labels; delete it, or name the class");
  }
}

AccessInput read_access(JsonReader& reader) {
  AccessInput access;
  refuse_place_of_branch(reader);
  access.point = reader.point("point_mm", std::nullopt);
  access.inclinations =
      read_angles(reader, "inclination_deg", {0.0, 15.0, 30.0}, {.min = 0.0, .max = 80.0});
  access.azimuths = read_angles(reader, "azimuth_deg", {0.0, 90.0, 180.0, 270.0}, kTurn);
  reader.finish();
  return access;
}

TargetInput read_target(JsonReader& reader) {
  TargetInput target;
  refuse_place_of_branch(reader);
  target.point = reader.point("point_mm", std::nullopt);
  target.at_section = !reader.has("radius_mm");
  if (!target.at_section) {
    target.radius =
        reader.number("radius_mm", std::nullopt, {.min = 0.1, .max = 50.0}, "given in m?");
  }
  target.beyond_mm = reader.number("beyond_mm", 0.0, {.min = 0.0, .max = 500.0}, "given in m?");
  if (target.beyond_mm > 0.0 && !target.at_section) {
    const std::string beyond = reader.path_of("beyond_mm"), radius = reader.path_of("radius_mm");
    reader.problems().add(beyond, "given beside " + radius, "one of the two",
                          "beyond_mm moves the cross-section on along the vessel; a sphere has "
                          "none");
  }
  reader.finish();
  return target;
}

/// The only one, or each of the list, with its name.
template <typename Input>
std::vector<Input> read_one_or_list(JsonReader& root, const std::string& one,
                                    const std::string& list, Input (*read)(JsonReader&),
                                    const std::vector<std::string>& keys) {
  std::vector<Input> all;
  std::set<std::string> taken;
  const auto add = [&](JsonReader& reader, bool listed) {
    const std::string name = read_section_name(reader, listed, taken);
    const std::size_t k = all.size();
    all.push_back(read(reader));
    all.back().name = name;
    all.back().told_by = k < keys.size() ? keys[k] : "point_mm";
  };
  if (!root.has(list)) {
    JsonReader reader = root.object(one, true);
    add(reader, false);
    return all;
  }
  if (root.has(one)) {
    root.problems().add(list, "given beside " + one, "one of the two",
                        one + " is for a case with only one");
    root.raw(one);
  }
  for (JsonReader& reader : root.objects(list, true)) add(reader, true);
  return all;
}

/// "target.point_mm", "targets[1].branch"
std::string point_key(const char* one, const char* list, std::size_t index, bool listed,
                      const std::string& told_by) {
  return (listed ? list + ("[" + std::to_string(index) + "]") : std::string(one)) + "." + told_by;
}

std::string point_key_of(const Json& end) {
  for (const char* key : {"point_mm", "point", "branch"}) {
    if (end.is_object() && end.contains(key)) return key;
  }
  return "point_mm";
}

}  // namespace

PointKeys find_point_keys(const Json& file) {
  const auto find = [&](const char* one, const char* list) {
    std::vector<std::string> keys;
    if (file.contains(list) && file[list].is_array()) {
      for (const Json& end : file[list]) keys.push_back(point_key_of(end));
    } else if (file.contains(one)) {
      keys.push_back(point_key_of(file[one]));
    }
    return keys;
  };
  return {.accesses = find("access", "accesses"), .targets = find("target", "targets")};
}

AccessesAndTargets read_accesses_and_targets(JsonReader& root, const PointKeys& keys) {
  const std::size_t problems_before = root.problems().count();
  AccessesAndTargets all;
  all.accesses_listed = root.has("accesses");
  all.targets_listed = root.has("targets");
  all.accesses =
      read_one_or_list<AccessInput>(root, "access", "accesses", read_access, keys.accesses);
  all.targets = read_one_or_list<TargetInput>(root, "target", "targets", read_target, keys.targets);
  if (root.problems().count() > problems_before) return all;
  for (std::size_t a = 0; a < all.accesses.size(); ++a) {
    const std::string access =
        point_key("access", "accesses", a, all.accesses_listed, all.accesses[a].told_by);
    for (std::size_t t = 0; t < all.targets.size(); ++t) {
      const TargetInput& target = all.targets[t];
      const std::string key = point_key("target", "targets", t, all.targets_listed, target.told_by);
      if ((target.point - all.accesses[a].point).norm() > target.radius) continue;
      root.problems().add(key, to_json(target.point).dump(),
                          target.at_section
                              ? "another point than " + access
                              : "a point further than " + key.substr(0, key.rfind('.')) +
                                    ".radius_mm from " + access,
                          "a wire would be there before it is pushed");
    }
  }
  return all;
}

std::vector<double> read_angles(JsonReader& reader, const std::string& key,
                                const std::vector<double>& fallback_deg, Range range_deg) {
  std::vector<double> angles = reader.numbers(key, fallback_deg, range_deg);
  for (double& angle : angles) angle *= kRadPerDeg;
  return angles;
}

Json degrees_json(const std::vector<double>& angles) {
  Json list = Json::array();
  for (const double angle : angles) list.push_back(clean(angle / kRadPerDeg));
  return list;
}

Json access_json(const AccessInput& access) {
  Json json = Json::object();
  if (!access.name.empty()) json["name"] = access.name;
  json["point_mm"] = to_json(access.point);
  json["inclination_deg"] = degrees_json(access.inclinations);
  json["azimuth_deg"] = degrees_json(access.azimuths);
  return json;
}

Json target_json(const TargetInput& target) {
  Json json = Json::object();
  if (!target.name.empty()) json["name"] = target.name;
  json["point_mm"] = to_json(target.point);
  if (target.at_section) {
    json["beyond_mm"] = target.beyond_mm;
  } else {
    json["radius_mm"] = target.radius;
  }
  return json;
}

std::string folder_name(const std::string& name) {
  std::string folder = name;
  std::replace(folder.begin(), folder.end(), ' ', '-');
  return folder;
}

}  // namespace wireplan::pipeline
