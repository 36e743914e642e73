#include "pipeline/files/access_limits_file.h"

#include <algorithm>
#include <array>
#include <functional>

namespace wireplan::pipeline {
namespace {

/// The sizes that are assumed unless they are given.
struct SizeKey {
  const char* key;
  plan::Size plan::AccessLimits::*size;
  double min, max;  // [mm]
};
constexpr std::array kSizes = {
    SizeKey{"device_diameter_mm", &plan::AccessLimits::device_diameter, 0.1, 20.0},
    SizeKey{"sheath_diameter_mm", &plan::AccessLimits::sheath_diameter, 0.1, 20.0},
    SizeKey{"sheath_length_mm", &plan::AccessLimits::sheath_length, 1.0, 5000.0},
    SizeKey{"catheter_length_mm", &plan::AccessLimits::catheter_length, 0.0, 5000.0},
    SizeKey{"working_length_mm", &plan::AccessLimits::working_length, 0.0, 5000.0},
};

/// Three thresholds in an order; `unit` is that of the file.
template <typename InOrder>
void read_grades(JsonReader& reader, const std::string& key, double unit, const Range& range,
                 const std::string& order, const InOrder& in_order, std::array<double, 3>& values) {
  std::vector<double> fallback;
  for (const double value : values) fallback.push_back(clean(value / unit));
  const std::size_t problems_before = reader.problems().count();
  const std::vector<double> given = reader.numbers(key, fallback, range);
  if (reader.problems().count() > problems_before) return;
  if (given.size() != values.size() || !std::is_sorted(given.begin(), given.end(), in_order)) {
    reader.problems().add(reader.path_of(key), Json(given).dump(),
                          "three thresholds, where mild, moderate and severe begin, " + order);
    return;
  }
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = given[k] * unit;
}

}  // namespace

plan::AccessLimits read_access_limits(JsonReader& root, double thinnest_catheter) {
  plan::AccessLimits limits;
  if (thinnest_catheter > 0.0) limits.device_diameter = {thinnest_catheter, false};
  JsonReader reader = root.object("access_limits", false);
  for (const SizeKey& row : kSizes) {
    plan::Size& size = limits.*row.size;
    if (reader.has(row.key)) size.assumed = false;
    size.value = reader.number(row.key, size.value, {.min = row.min, .max = row.max});
  }
  const auto read = [&](const char* key, double& value, const Range& range, double unit = 1.0) {
    value = reader.number(key, clean(value / unit), range) * unit;
  };
  read("max_sheath_ratio", limits.max_sheath_ratio, {.min = 0.1, .max = 5.0});
  read_grades(reader, "tortuosity", 1.0, {.min = 1.0, .max = 100.0}, "rising", std::less<>(),
              limits.tortuosity);
  read_grades(reader, "angle_deg", kRadPerDeg, {.min = 0.0, .max = 180.0}, "falling",
              std::greater<>(), limits.angle);
  read("calcium_hu", limits.calcium_hu, {.min = 100.0, .max = 65535.0});
  read("calcium_within_mm", limits.calcium_within, {.min = 0.0, .max = 20.0});
  read("arm_rotation_deg", limits.arm.rotation, {.min = 1.0, .max = 180.0}, kRadPerDeg);
  read("arm_tilt_deg", limits.arm.tilt, {.min = 1.0, .max = 90.0}, kRadPerDeg);
  reader.finish();
  return limits;
}

Json access_limits_json(const plan::AccessLimits& limits) {
  Json angles = Json::array();
  for (const double angle : limits.angle) angles.push_back(clean(angle / kRadPerDeg));
  return {{"device_diameter_mm", limits.device_diameter.value},
          {"sheath_diameter_mm", limits.sheath_diameter.value},
          {"sheath_length_mm", limits.sheath_length.value},
          {"max_sheath_ratio", limits.max_sheath_ratio},
          {"tortuosity", limits.tortuosity},
          {"angle_deg", angles},
          {"calcium_hu", limits.calcium_hu},
          {"calcium_within_mm", limits.calcium_within},
          {"catheter_length_mm", limits.catheter_length.value},
          {"working_length_mm", limits.working_length.value},
          {"arm_rotation_deg", clean(limits.arm.rotation / kRadPerDeg)},
          {"arm_tilt_deg", clean(limits.arm.tilt / kRadPerDeg)}};
}

Json assumed_sizes(const plan::AccessLimits& limits) {
  Json keys = Json::array();
  for (const SizeKey& row : kSizes) {
    if ((limits.*row.size).assumed) keys.emplace_back(row.key);
  }
  return keys;
}

}  // namespace wireplan::pipeline
