#pragma once
/// A number of a device with how far it may be off, where it comes from and how well it is known,
/// as the catalogue and a case write it: {"value", "spread", "source", "confidence"}.
#include <optional>
#include <string>
#include <vector>

#include "pipeline/files/json_reader.h"
#include "plan/wire_spread.h"

namespace wireplan::pipeline {

/// Strongest first.
enum class Confidence {
  kMeasured,   // measured or made so, and the source was opened
  kReported,   // read in a second source that quotes the first
  kDerived,    // follows from such values by a formula
  kEstimated,  // within what sources tell of its like
  kAssumed,    // no source
};

/// "measured", "reported", "derived", "estimated", "assumed".
const char* confidence_name(Confidence confidence);
const std::vector<std::string>& confidence_names();

/// A plain number of a case has neither spread nor confidence, and the source of its section.
struct DeviceValue {
  std::vector<double> numbers = {};  // one; two: at the end toward the tip and at the other
  std::string word = {};             // in the place of numbers
  std::vector<plan::FactorSpread> spreads = {};  // as many as numbers
  std::string source = {};
  std::optional<Confidence> confidence = {};

  double number() const { return numbers.front(); }
};

/// A value under its key: "sections[0].bending_stiffness_n_mm2".
struct NamedValue {
  std::string key;
  double from = 0.0;  // of a wire: how far from its tip the value begins to act          [mm]
  bool acts = true;   // in a trial
  DeviceValue value;
};

/// Reads a number within the range, or such an object: its "spread" is null where no source tells
/// one, a standard deviation in the value's unit, or {"low", "high"} around it. A `pair` may also
/// be [a, b], with a spread of two standard deviations. A value of harmless size after a problem.
DeviceValue read_value(JsonReader& reader, const std::string& key, Range range,
                       const std::string& hint = "", bool pair = false);

/// The same of one of several words, whose spread is null.
DeviceValue read_word(JsonReader& reader, const std::string& key,
                      const std::vector<std::string>& allowed);

/// The weakest confidence of what acts within `reach` from the tip [mm], and which values have it.
/// A value whose confidence is not stated is weaker than all that state one.
struct Weakest {
  std::optional<Confidence> confidence;  // empty: not stated
  std::vector<std::string> keys;
};
Weakest find_weakest(const std::vector<NamedValue>& values, double reach);

/// "assumed", or "not stated".
std::string weakest_name(const Weakest& weakest);

}  // namespace wireplan::pipeline
