#include "pipeline/files/case_judging.h"

#include <string>

namespace wireplan::pipeline {

void read_limits(JsonReader& root, plan::Limits& limit) {
  const std::size_t problems_before = root.problems().count();
  JsonReader limits = root.object("limits", false);
  const Range force{.min = 0.0, .max = 100.0, .open_min = true};
  limit.tip_force_warn =
      limits.number("tip_force_warn_n", limit.tip_force_warn, force, "given in mN or gf?");
  limit.tip_force_fail =
      limits.number("tip_force_fail_n", limit.tip_force_fail, force, "given in mN or gf?");
  limit.penetration_fail = limits.number("penetration_fail_mm", limit.penetration_fail,
                                         {.min = 0.0, .max = 5.0, .open_min = true});
  limit.off_path_fail = limits.number("off_path_fail_mm", limit.off_path_fail,
                                      {.min = 0.0, .max = 1000.0, .open_min = true});
  limits.finish();
  if (root.problems().count() == problems_before && limit.tip_force_warn > limit.tip_force_fail) {
    root.problems().add("limits.tip_force_warn_n", Json(limit.tip_force_warn).dump(),
                        "at most limits.tip_force_fail_n, " + Json(limit.tip_force_fail).dump());
  }
}

void read_weights(JsonReader& root, bool with_catheters, plan::Weights& weight) {
  JsonReader ranking = root.object("ranking", false);
  const auto read = [&](const char* key, bool of_script) {
    JsonReader weights = ranking.object(key, false);
    for (const plan::ScorePart& part : plan::kScoreParts) {
      if (part.of_script != of_script) continue;
      weight.*part.weight =
          weights.number(part.name, weight.*part.weight, {.min = 0.0, .max = 1000.0});
    }
    weights.finish();
  };
  read("weights", false);
  if (with_catheters) {
    read("script_weights", true);
  } else if (ranking.has("script_weights")) {
    ranking.raw("script_weights");
    root.problems().add("ranking.script_weights", "given", "only beside \"catheters\"",
                        "delete the key, or list catheters");
  }
  ranking.finish();
  if (plan::sum_of(weight, with_catheters) <= 0.0) {
    root.problems().add("ranking", "weights of 0 in all", "at least one weight above 0");
  }
}

Json limits_json(const plan::Limits& limits) {
  return {{"tip_force_warn_n", limits.tip_force_warn},
          {"tip_force_fail_n", limits.tip_force_fail},
          {"penetration_fail_mm", limits.penetration_fail},
          {"off_path_fail_mm", limits.off_path_fail}};
}

Json ranking_json(const plan::Weights& weights, bool with_catheters) {
  Json json;
  for (const plan::ScorePart& part : plan::kScoreParts) {
    if (!plan::acts(part, with_catheters)) continue;
    json[part.of_script ? "script_weights" : "weights"][part.name] = weights.*part.weight;
  }
  return json;
}

}  // namespace wireplan::pipeline
