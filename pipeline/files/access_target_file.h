#pragma once
/// Where the wires of a case go in and where to: its `access` and `target`, or the lists `accesses`
/// and `targets`, of which each pair is a section of the report.
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"

namespace wireplan::pipeline {

struct AccessInput {
  std::string name;                  // the only one of a case may have none
  std::string told_by = "point_mm";  // the key that its point has in the file
  Vec3 point = Vec3::Zero();  //                                                          [mm]
  std::vector<double> inclinations, azimuths;  //                                        [rad]
};

struct TargetInput {
  std::string name;                  // the only one of a case may have none
  std::string told_by = "point_mm";  // the key that its point has in the file
  Vec3 point = Vec3::Zero();  //                                                          [mm]
  bool at_section = true;     // else a sphere of this radius
  double radius = 0.0;        //                                                          [mm]
  double beyond_mm = 0.0;     // the cross-section is so much further along the vessel
};

/// Under which key the file tells each point: "point_mm", "point" or "branch".
struct PointKeys {
  std::vector<std::string> accesses, targets;
};

/// Of a case file as it was written, before points and branches are looked up.
PointKeys find_point_keys(const Json& file);

struct AccessesAndTargets {
  std::vector<AccessInput> accesses;  // one at least of each, where there were no problems
  std::vector<TargetInput> targets;
  bool accesses_listed = false, targets_listed = false;  // by the file: "accesses", "targets"
};

/// Reads the four keys. A list of one counts as the singular form, which may have a name too.
AccessesAndTargets read_accesses_and_targets(JsonReader& root, const PointKeys& keys);

/// The angles under a key, in degrees in the file [rad].
std::vector<double> read_angles(JsonReader& reader, const std::string& key,
                                const std::vector<double>& fallback_deg, Range range_deg);
/// Angles [rad] in degrees.
Json degrees_json(const std::vector<double>& angles);

/// As the file has them, after defaults; with a name where they have one.
Json access_json(const AccessInput& access);
Json target_json(const TargetInput& target);

/// Between access and target in the name of a section's folder; in no name of either.
inline constexpr const char* kBetweenNames = "--";

/// The name of an access or target as that of a folder: spaces become '-'.
std::string folder_name(const std::string& name);

}  // namespace wireplan::pipeline
