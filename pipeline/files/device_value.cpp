#include "pipeline/files/device_value.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace wireplan::pipeline {
namespace {

const char* kSpreadForms =
    "null where no source tells one, a standard deviation, or {\"low\", \"high\"}";

/// The factors that lie between the bounds, of which the value must be inside.
plan::FactorSpread read_bounds(JsonReader spread, double value) {
  const std::size_t problems_before = spread.problems().count();
  const double low = spread.number("low", std::nullopt, {}),
               high = spread.number("high", std::nullopt, {});
  spread.finish();
  if (spread.problems().count() > problems_before) return {};
  if (!(low > 0.0 && low <= value && value <= high)) {
    spread.problems().add(
        spread.path_of("low"), Json({low, high}).dump(),
        "bounds above 0 with the value, " + Json(value).dump() + ", between them");
    return {};
  }
  return {.low = low / value, .high = high / value};
}

plan::FactorSpread of_deviation(double deviation, double value) {
  return value > 0.0 ? plan::FactorSpread{.deviation = deviation / value} : plan::FactorSpread();
}

std::vector<plan::FactorSpread> read_spreads(JsonReader& object,
                                             const std::vector<double>& numbers) {
  constexpr Range kDeviation{.min = 0.0};
  std::vector<plan::FactorSpread> spreads(numbers.size());
  const bool given = object.has("spread");
  const Json& spread = object.raw("spread");
  if (numbers.size() == 2 && spread.is_array()) {
    const std::vector<double> deviations = object.numbers("spread", std::nullopt, kDeviation);
    if (deviations.size() != 2) {
      object.problems().add(object.path_of("spread"), spread.dump(), "two standard deviations");
      return spreads;
    }
    for (std::size_t k = 0; k < 2; ++k) spreads[k] = of_deviation(deviations[k], numbers[k]);
  } else if (numbers.size() == 1 && spread.is_object()) {
    spreads[0] = read_bounds(object.object("spread", true), numbers[0]);
  } else if (numbers.size() == 1 && spread.is_number()) {
    spreads[0] = of_deviation(object.number("spread", std::nullopt, kDeviation), numbers[0]);
  } else if (!spread.is_null() || !given) {
    object.problems().add(object.path_of("spread"), given ? spread.dump() : "missing",
                          numbers.size() == 2 ? "null, or two standard deviations" : kSpreadForms);
  }
  return spreads;
}

/// The object's source and confidence.
void read_origin(JsonReader& object, DeviceValue& value) {
  value.source = object.text("source", std::nullopt);
  const std::size_t problems_before = object.problems().count();
  const std::string name = object.choice("confidence", std::nullopt, confidence_names());
  if (object.problems().count() > problems_before) return;
  const auto& names = confidence_names();
  value.confidence =
      static_cast<Confidence>(std::find(names.begin(), names.end(), name) - names.begin());
}

std::vector<double> read_numbers(JsonReader& reader, const std::string& key, Range range,
                                 const std::string& hint, bool pair) {
  if (!pair || !reader.raw(key).is_array()) {
    return {reader.number(key, std::nullopt, range, hint)};
  }
  std::vector<double> numbers = reader.numbers(key, std::nullopt, range);
  if (numbers.size() != 2) {
    reader.problems().add(reader.path_of(key), reader.raw(key).dump(), "a number, or two",
                          "[at the end toward the tip, at the other]");
    numbers = {1.0, 1.0};
  }
  return numbers;
}

}  // namespace

const std::vector<std::string>& confidence_names() {
  static const std::vector<std::string> names = {"measured", "reported", "derived", "estimated",
                                                 "assumed"};
  return names;
}

const char* confidence_name(Confidence confidence) {
  return confidence_names().at(static_cast<std::size_t>(confidence)).c_str();
}

DeviceValue read_value(JsonReader& reader, const std::string& key, Range range,
                       const std::string& hint, bool pair) {
  DeviceValue value;
  if (!reader.raw(key).is_object()) {
    value.numbers = read_numbers(reader, key, range, hint, pair);
    value.spreads.resize(value.numbers.size());
    return value;
  }
  JsonReader object = reader.object(key, true);
  value.numbers = read_numbers(object, "value", range, hint, pair);
  value.spreads = read_spreads(object, value.numbers);
  read_origin(object, value);
  object.finish();
  return value;
}

DeviceValue read_word(JsonReader& reader, const std::string& key,
                      const std::vector<std::string>& allowed) {
  DeviceValue value;
  if (!reader.raw(key).is_object()) {
    value.word = reader.choice(key, std::nullopt, allowed);
    return value;
  }
  JsonReader object = reader.object(key, true);
  value.word = object.choice("value", std::nullopt, allowed);
  if (!object.has("spread") || !object.raw("spread").is_null()) {
    object.problems().add(object.path_of("spread"),
                          object.has("spread") ? object.raw("spread").dump() : "missing", "null",
                          "a word has none");
  }
  read_origin(object, value);
  object.finish();
  return value;
}

Weakest find_weakest(const std::vector<NamedValue>& values, double reach) {
  const auto rank = [](const std::optional<Confidence>& confidence) {
    return confidence ? static_cast<int>(*confidence) : static_cast<int>(Confidence::kAssumed) + 1;
  };
  Weakest weakest;
  int worst = -1;
  for (const NamedValue& each : values) {
    if (!each.acts || each.from >= reach) continue;
    const int own = rank(each.value.confidence);
    if (own > worst) {
      worst = own;
      weakest = {.confidence = each.value.confidence, .keys = {}};
    }
    if (own == worst) weakest.keys.push_back(each.key);
  }
  return weakest;
}

std::string weakest_name(const Weakest& weakest) {
  return weakest.confidence ? confidence_name(*weakest.confidence) : "not stated";
}

}  // namespace wireplan::pipeline
