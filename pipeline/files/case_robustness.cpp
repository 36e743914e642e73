#include "pipeline/files/case_robustness.h"

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace wireplan::pipeline {
namespace {

/// Two factors, the lower first.
void read_factors(JsonReader& reader, const std::string& key, double& low, double& high) {
  const std::size_t problems_before = reader.problems().count();
  const std::vector<double> factors =
      reader.numbers(key, std::vector<double>{low, high}, {.min = 0.01, .max = 100.0});
  if (reader.problems().count() > problems_before) return;
  if (factors.size() != 2 || factors[0] > factors[1]) {
    reader.problems().add(reader.path_of(key), Json(factors).dump(),
                          "two factors, the smaller one first", "[1, 1] leaves the value alone");
    return;
  }
  low = factors[0];
  high = factors[1];
}

/// The factors under a key that may be left out, or null as the parameters of a report have it.
std::optional<plan::FactorSpread> read_spread(JsonReader& reader, const std::string& key) {
  if (reader.raw(key).is_null()) return {};
  plan::FactorSpread spread;
  read_factors(reader, key, spread.low, spread.high);
  return spread;
}

Json spread_json(const std::optional<plan::FactorSpread>& spread) {
  return spread ? Json({spread->low, spread->high}) : Json(nullptr);
}

}  // namespace

void read_robustness(JsonReader& root, Case& input) {
  JsonReader reader = root.object("robustness", false);
  plan::RobustnessOptions& options = input.robustness;
  options.repeats = reader.integer("repeats", options.repeats, 0, 100000);
  options.plans = reader.integer("plans", options.plans, 1, 1000);
  options.seed = static_cast<std::uint64_t>(
      reader.integer("seed", static_cast<int>(options.seed), 0, std::numeric_limits<int>::max()));
  plan::Unknowns& unknowns = options.unknowns;
  input.friction_spread = read_spread(reader, "friction_factor");
  input.stiffness_spread = read_spread(reader, "stiffness_factor");
  read_factors(reader, "wall_factor", unknowns.wall_low, unknowns.wall_high);
  double support_low = 0.1, support_high = 10.0;
  read_factors(reader, "support_factor", support_low, support_high);
  if (input.wall.support) {
    unknowns.support_low = support_low;
    unknowns.support_high = support_high;
  } else if (!reader.raw("support_factor").is_null()) {
    input.told.push_back(
        "robustness.support_factor is without effect: wall.support_kpa_per_mm gives no support, so "
        "the vessel does not move as a whole");
  }
  unknowns.angle =
      reader.number("angle_deg", clean(unknowns.angle / kRadPerDeg), {.min = 0.0, .max = 45.0}) *
      kRadPerDeg;
  unknowns.entry =
      reader.number("entry_mm", unknowns.entry, {.min = 0.0, .max = 50.0}, "given in m?");
  unknowns.lumen = reader.number("lumen_mm", 0.0, {.min = 0.0, .max = 10.0}, "0 chooses it");
  reader.finish();
}

Json robustness_json(const Case& input) {
  const plan::RobustnessOptions& options = input.robustness;
  const plan::Unknowns& unknowns = options.unknowns;
  Json json = {{"repeats", options.repeats},
               {"plans", options.plans},
               {"seed", options.seed},
               {"friction_factor", spread_json(input.friction_spread)},
               {"stiffness_factor", spread_json(input.stiffness_spread)},
               {"wall_factor", {unknowns.wall_low, unknowns.wall_high}},
               {"angle_deg", clean(unknowns.angle / kRadPerDeg)},
               {"entry_mm", unknowns.entry},
               {"lumen_mm", unknowns.lumen}};
  if (input.wall.support) {
    json["support_factor"] = {unknowns.support_low, unknowns.support_high};
  }
  return json;
}

}  // namespace wireplan::pipeline
