#include "pipeline/stages/repeats.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "plan/metrics.h"
#include "plan/statistics.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSchema = "wireplan.repeat/1";
/// How well a boundary is known: drawn on voxels to half of one; of a surface, assumed [mm].
constexpr double kVoxelPart = 0.5, kSurfaceOffset = 0.25;

double choose_lumen_offset(const Workspace& work) {
  if (!work.has("volume")) return kSurfaceOffset;
  const Json spacing = work.figures("volume").at("spacing_mm");
  double product = 1.0;
  for (const Json& side : spacing) product *= side.get<double>();
  return kVoxelPart * std::cbrt(product);
}

// All that one repeat is made from: what the report reads, and which it is.
std::string repeat_key_text(const Workspace& work, int trial, std::size_t repeat) {
  return work.key_text +
         key_text({{"repeated trial", std::to_string(trial)}, {"repeat", std::to_string(repeat)}});
}

std::optional<plan::Repeat> find_repeat(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const Json json = Json::parse(stream, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || json.value("schema", "") != kSchema) return {};
  return plan::Repeat{.success = json.at("success"),
                      .score = json.at("score"),
                      .peak_contact_force = json.at("peak_contact_force_n"),
                      .mean_contact_force = json.at("mean_contact_force_n"),
                      .peak_tip_force = json.at("peak_tip_force_n"),
                      .reason = json.at("reason")};
}

std::string repeat_text(const plan::Repeat& repeat) {
  return Json({{"schema", kSchema},
               {"success", repeat.success},
               {"score", repeat.score},
               {"peak_contact_force_n", repeat.peak_contact_force},
               {"mean_contact_force_n", repeat.mean_contact_force},
               {"peak_tip_force_n", repeat.peak_tip_force},
               {"reason", repeat.reason}})
      .dump();
}

// Place of a trial's plan in the list, at whose end it is put if it is not there.
std::size_t plan_of(int trial, std::vector<plan::RepeatedPlan>& plans) {
  const plan::RepeatedPlan* found = plan::find_repeated(plans, trial);
  if (found != nullptr) return static_cast<std::size_t>(found - plans.data());
  plans.push_back({trial, {}});
  return plans.size() - 1;
}

Json spread_json(const plan::RepeatedPlan& plan, double plan::Repeat::*member) {
  std::vector<double> values;
  for (const plan::Repeat& repeat : plan.repeats) values.push_back(repeat.*member);
  const plan::Spread spread = plan::find_spread(values);
  return {{"low", spread.low}, {"median", spread.median}, {"high", spread.high}};
}

Json plan_json(const plan::RepeatedPlan& plan) {
  Json scores = Json::array(), failures = Json::array();
  double sum = 0.0;
  for (std::size_t k = 0; k < plan.repeats.size(); ++k) {
    const plan::Repeat& repeat = plan.repeats[k];
    sum += repeat.score;
    scores.push_back(repeat.score);
    if (!repeat.success) failures.push_back({{"repeat", k}, {"reason", repeat.reason}});
  }
  const int count = static_cast<int>(plan.repeats.size());
  const int successes = count - static_cast<int>(failures.size());
  Json json;
  json["trial"] = plan.trial;
  json["repeats"] = count;
  json["successes"] = successes;
  json["success_rate"] = static_cast<double>(successes) / count;
  json["success_rate_interval"] = plan::wilson_interval(successes, count);
  json["mean_score"] = sum / count;
  json["peak_contact_force_n"] = spread_json(plan, &plan::Repeat::peak_contact_force);
  json["mean_contact_force_n"] = spread_json(plan, &plan::Repeat::mean_contact_force);
  json["peak_tip_force_n"] = spread_json(plan, &plan::Repeat::peak_tip_force);
  json["scores"] = std::move(scores);
  json["failures"] = std::move(failures);
  return json;
}

Json disturbances_json(const std::vector<plan::Disturbance>& disturbances) {
  Json list = Json::array();
  for (const plan::Disturbance& d : disturbances) {
    list.push_back({{"friction_factor", d.friction_factor},
                    {"wall_factor", d.wall_factor},
                    {"tilt_deg", {d.tilt[0] / kRadPerDeg, d.tilt[1] / kRadPerDeg}},
                    {"shift_mm", {d.shift[0], d.shift[1]}},
                    {"lumen_inward_mm", d.inward}});
  }
  return list;
}

Json sensitivity_json(const Repeats& repeats) {
  const plan::Sensitivity found = plan::find_sensitivity(repeats.disturbances, repeats.plans);
  Json shares = Json::array(), json;
  for (const auto& share : found.shares) {
    shares.push_back({{"unknown", share.unknown}, {"share", share.of_all}});
  }
  json["explained"] = found.explained ? Json(*found.explained) : Json(nullptr);
  json["shares"] = std::move(shares);
  if (!found.reason.empty()) json["null_reasons"] = {{"explained", found.reason}};
  return json;
}

}  // namespace

Repeats prepare_repeats(Workspace& work, int count) {
  const plan::Study& study = work.study();
  Repeats repeats;
  repeats.options = work.given().robustness;
  repeats.options.repeats = count;
  plan::Unknowns& unknowns = repeats.options.unknowns;
  if (unknowns.lumen == 0.0) unknowns.lumen = choose_lumen_offset(work);
  unknowns.lumen = std::min(unknowns.lumen, plan::largest_lumen_offset(study));
  unknowns.entry = std::min(unknowns.entry, plan::largest_entry_shift(study, work.model()));
  if (study.insertion.friction == 0.0) unknowns.friction_low = unknowns.friction_high = 1.0;
  if (!work.given().wall.elastic) unknowns.wall_low = unknowns.wall_high = 1.0;
  repeats.disturbances = plan::draw_disturbances(repeats.options);
  return repeats;
}

plan::Repeat judge_trial(Workspace& work, const simulate::TrialResult& trial) {
  const plan::Study& study = work.study();
  const Case& given = work.given();
  return plan::judge_repeat(trial, plan::compute_metrics(trial, study, work.path()), study,
                            given.limits, given.weights);
}

plan::Repeat run_repeat(Workspace& work, const plan::Candidate& candidate,
                        const plan::Disturbance& disturbance) {
  return judge_trial(work, plan::run_disturbed(work.study(), candidate, work.model(), disturbance));
}

void add_repeats(Workspace& work, const std::vector<plan::Candidate>& candidates,
                 const std::vector<int>& trials, int count, Repeats& repeats) {
  // Repeat by repeat, so that plans under one disturbance run at about the same time.
  struct Job {
    std::size_t plan, repeat;
  };
  std::vector<Job> jobs;
  std::vector<std::size_t> plans, done;
  for (const int trial : trials) {
    plans.push_back(plan_of(trial, repeats.plans));
    std::vector<plan::Repeat>& own = repeats.plans[plans.back()].repeats;
    done.push_back(own.size());
    own.resize(std::max(own.size(), static_cast<std::size_t>(count)));
  }
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    for (std::size_t p = 0; p < plans.size(); ++p) {
      if (k >= done[p]) jobs.push_back({plans[p], k});
    }
  }

  std::vector<double> cpu_seconds(jobs.size());
  const std::vector<bool> finished = plan::for_each_slot(
      static_cast<int>(jobs.size()),
      [&](int slot) {
        const Job job = jobs[static_cast<std::size_t>(slot)];
        plan::RepeatedPlan& plan = repeats.plans[job.plan];
        const std::string key = repeat_key_text(work, plan.trial, job.repeat);
        const double start = plan::thread_cpu_seconds();
        const std::optional<fs::path> kept = work.store().find_piece(key);
        std::optional<plan::Repeat> repeat;
        if (kept) repeat = find_repeat(*kept);
        if (!repeat) {
          repeat = run_repeat(work, candidates[static_cast<std::size_t>(plan.trial)],
                              repeats.disturbances[job.repeat]);
          work.store().keep_piece(key, repeat_text(*repeat));
        }
        plan.repeats[job.repeat] = *repeat;
        cpu_seconds[static_cast<std::size_t>(slot)] = plan::thread_cpu_seconds() - start;
      },
      {.threads = work.options().threads,
       .progress = work.options().progress,
       .cancelled = work.options().cancelled});
  if (std::find(finished.begin(), finished.end(), false) != finished.end()) throw Interrupted();
  for (const double seconds : cpu_seconds) repeats.cpu_seconds += seconds;
}

Json robustness_json(const Repeats& repeats) {
  const plan::Unknowns& unknowns = repeats.options.unknowns;
  Json plans = Json::array();
  for (const plan::RepeatedPlan& plan : repeats.plans) plans.push_back(plan_json(plan));
  Json json;
  json["repeats"] = repeats.options.repeats;
  json["seed"] = repeats.options.seed;
  json["unknowns"] = {{"friction_factor", {unknowns.friction_low, unknowns.friction_high}},
                      {"wall_factor", {unknowns.wall_low, unknowns.wall_high}},
                      {"angle_deg", clean(unknowns.angle / kRadPerDeg)},
                      {"entry_mm", unknowns.entry},
                      {"lumen_mm", unknowns.lumen}};
  json["plans"] = std::move(plans);
  json["sensitivity"] = sensitivity_json(repeats);
  json["disturbances"] = disturbances_json(repeats.disturbances);
  return json;
}

}  // namespace wireplan::pipeline
