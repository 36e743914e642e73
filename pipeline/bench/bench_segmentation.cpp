// `wireplan bench segmentation N`: patients drawn at random, and real ones with labels, segmented
// from two points; how well, and what they were refused for.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>

#include "pipeline/bench/bench_report.h"
#include "pipeline/bench/segmented_patient.h"
#include "pipeline/files/text.h"
#include "pipeline/report/plot.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr int kPatients = 100, kQuickPatients = 2;
constexpr std::size_t kQuickVoxels = 1'000'000;  // of a patient of the quick size
constexpr double kEnoughContrast = 120.0;        // HU, for a refusal to be false

const char* name_of(PatientOutcome outcome) {
  switch (outcome) {
    case PatientOutcome::kDone:
      return "done";
    case PatientOutcome::kRefused:
      return "refused";
    case PatientOutcome::kNoSurface:
      return "no surface";
    case PatientOutcome::kNoCenterline:
      return "no centerline";
    case PatientOutcome::kFailed:
      return "failed";
  }
  return "";
}

template <typename Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json json_of(const PatientRow& row) {
  const auto percent = [](const std::optional<double>& share) {
    return share ? Json(100.0 * *share) : Json(nullptr);
  };
  return {{"patient", row.patient},
          {"features", row.features},
          {"slice_mm", row.slice_mm},
          {"spacing_mm", row.spacing_mm},
          {"access_contrast_hu", or_null(row.access_contrast_hu)},
          {"target_contrast_hu", or_null(row.target_contrast_hu)},
          {"noise_hu", or_null(row.noise_hu)},
          {"outcome", name_of(row.outcome)},
          {"dice_way", or_null(row.dice_way)},
          {"dice", or_null(row.dice)},
          {"surface_mean_mm", or_null(row.surface_mean_mm)},
          {"surface_p95_mm", or_null(row.surface_p95_mm)},
          {"axis_mean_mm", or_null(row.axis_mean_mm)},
          {"axis_p95_mm", or_null(row.axis_p95_mm)},
          {"radius_within_5_percent", percent(row.radius_within)},
          {"closed_within_5_percent", percent(row.closed_within)},
          {"ball_within_5_percent", percent(row.ball_within)},
          {"way_right", or_null(row.way_right)},
          {"outside_percent", percent(row.outside)},
          {"outside_silent_percent", percent(row.outside_silent)},
          {"handles", or_null(row.handles)},
          {"warnings", or_null(row.warnings)},
          {"segment_s", row.segment_s},
          {"all_s", row.all_s},
          {"message", row.message}};
}

/// A line as soon as a patient is done: a long bench that is stopped has told what it knew.
void tell(const PatientRow& row) {
  const auto text = [](const std::optional<double>& value, const char* pattern, double factor) {
    return value ? format(pattern, factor * *value) : std::string("-");
  };
  std::cerr << row.patient << "  " << name_of(row.outcome) << "  dice "
            << text(row.dice_way, "%.3f", 1.0) << " (all " << text(row.dice, "%.3f", 1.0)
            << ")  surface " << text(row.surface_mean_mm, "%.2f", 1.0) << "  axis "
            << text(row.axis_mean_mm, "%.2f", 1.0) << "  radius "
            << text(row.radius_within, "%.0f %%", 100.0) << "  way "
            << (row.way_right ? (*row.way_right ? "right" : "wrong") : "-") << "  outside "
            << text(row.outside, "%.1f %%", 100.0) << " (silent "
            << text(row.outside_silent, "%.1f %%", 100.0) << ")  handles "
            << (row.handles ? std::to_string(*row.handles) : "-")
            << format("  %.1f s  %.3g mm  ", row.segment_s, row.slice_mm)
            << (row.noise_hu ? format("%.0f to %.0f HU, noise %.0f  ", *row.access_contrast_hu,
                                      *row.target_contrast_hu, *row.noise_hu)
                             : std::string())
            << row.features << (row.message.empty() ? "" : ": ") << row.message << std::endl;
}

/// A bench goes on whatever becomes of a patient.
template <typename Make>
PatientRow guarded(const std::string& patient, Make make) {
  PatientRow row;
  try {
    row = make();
  } catch (const std::exception& error) {
    row.patient = patient;
    row.outcome = PatientOutcome::kFailed;
    row.message = error.what();
  }
  tell(row);
  return row;
}

std::vector<PatientRow> run_patients(const BenchOptions& options) {
  const int count = options.patients > 0 ? options.patients
                    : options.quick      ? kQuickPatients
                                         : kPatients;
  std::vector<PatientRow> rows;
  for (std::uint64_t seed = options.first_seed; static_cast<int>(rows.size()) < count; ++seed) {
    const preprocess::RandomPatient patient = preprocess::draw_patient(seed);
    if (options.quick && patient.spec.grid.voxels() > kQuickVoxels) continue;
    rows.push_back(guarded(std::to_string(seed), [&] { return segment_patient(patient); }));
  }
  return rows;
}

/// The real cases to run, none with quick. Throws Error where --data asks for what cannot be run.
std::vector<LabelledCase> labelled_of(const BenchOptions& options) {
  const bool asked = !options.data.empty();
  if (asked && !preprocess::reads_volumes()) {
    throw Error(
        "bench: --data needs images, and this wireplan is built without them; configure with "
        "-DWIREPLAN_IMAGING=ON");
  }
  if (asked && options.quick) {
    throw Error("bench: --data is given with --quick, which runs no real cases; leave one out");
  }
  if (options.quick || !preprocess::reads_volumes()) return {};
  const char* named = std::getenv("WIREPLAN_DATA");
  std::vector<LabelledCase> cases =
      find_labelled_cases(asked ? options.data : fs::path(named ? named : ""));
  if (asked && cases.empty()) {
    throw Error("bench: --data is '" + options.data.string() +
                "', expected a folder with ct-aorta-dissection-labelled");
  }
  return cases;
}

/// Of those rows that have the value, ascending.
std::vector<double> sorted_values(const std::vector<PatientRow>& rows,
                                  std::optional<double> PatientRow::*value) {
  std::vector<double> values;
  for (const PatientRow& row : rows) {
    if (row.*value) values.push_back(*(row.*value));
  }
  std::sort(values.begin(), values.end());
  return values;
}

/// Linear between the values; null of none.
Json quantile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return nullptr;
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<std::size_t>(at);
  const std::size_t high = std::min(low + 1, sorted.size() - 1);
  return sorted[low] + (at - static_cast<double>(low)) * (sorted[high] - sorted[low]);
}

Json spread(const std::vector<PatientRow>& rows, const char* what,
            std::optional<double> PatientRow::*value) {
  const std::vector<double> values = sorted_values(rows, value);
  return {{"what", what},
          {"patients", values.size()},
          {"q05", quantile(values, 0.05)},
          {"median", quantile(values, 0.5)},
          {"q95", quantile(values, 0.95)},
          {"least", quantile(values, 0.0)},
          {"most", quantile(values, 1.0)}};
}

template <typename Counts>
int count_rows(const std::vector<PatientRow>& rows, Counts counts) {
  return static_cast<int>(std::count_if(rows.begin(), rows.end(), counts));
}

/// Aim and what was found; of patients drawn at random alone.
Json criteria_of(const std::vector<PatientRow>& rows) {
  const auto share = [](int part, int whole) {
    return whole > 0 ? Json(static_cast<double>(part) / whole) : Json(nullptr);
  };
  const std::vector<double> dice = sorted_values(rows, &PatientRow::dice_way);
  const std::vector<double> silent = sorted_values(rows, &PatientRow::outside_silent);
  std::vector<double> radius = sorted_values(rows, &PatientRow::radius_within);
  double within = 0.0;
  for (const double one : radius) within += one / static_cast<double>(radius.size());
  const auto went_on = [](const PatientRow& row) {
    return row.outcome != PatientOutcome::kRefused && row.outcome != PatientOutcome::kFailed;
  };
  const auto enough = [](const PatientRow& row) {
    return row.target_contrast_hu &&
           std::min(*row.target_contrast_hu, *row.access_contrast_hu) > kEnoughContrast;
  };
  const int false_refusals = count_rows(rows, [&](const PatientRow& row) {
    return enough(row) && row.outcome != PatientOutcome::kDone;
  });
  return Json::array(
      {aim_entry("median of dice_way", 0.96, true, quantile(dice, 0.5)),
       aim_entry("least 5 % of dice_way", 0.90, true, quantile(dice, 0.05)),
       aim_entry(
           "share of ways that are right, of those not refused", 0.98, true,
           share(count_rows(rows, [](const PatientRow& row) { return row.way_right == true; }),
                 count_rows(rows, went_on))),
       aim_entry("share of places with the radius within 5 %, mean of patients", 0.95, true,
                 radius.empty() ? Json(nullptr) : Json(within)),
       aim_entry("largest outside_silent, share of the truth", 0.05, false, quantile(silent, 1.0)),
       aim_entry("share of false refusals with contrast over 120 HU", 0.01, false,
                 share(false_refusals, count_rows(rows, enough)))});
}

std::string text_of(const Json& results, const std::vector<PatientRow>& all) {
  std::string text;
  for (const Json& one : results.at("spread")) {
    const auto number = [&](const char* key) {
      return one.at(key).is_null() ? std::string("-") : format("%.3g", one.at(key).get<double>());
    };
    text += one.at("what").get<std::string>() + ": median " + number("median") + ", 5 % below " +
            number("q05") + ", 5 % above " + number("q95") + ", from " + number("least") + " to " +
            number("most") + "\n";
  }
  text += aims_text(results.at("criteria"));
  for (const PatientRow& row : all) {
    if (!row.message.empty()) {
      text += row.patient + " " + name_of(row.outcome) + ": " + row.message + "\n";
    }
  }
  return text;
}

/// What a mask lacks against how clear the contrast is.
Picture plot_of_patients(const std::vector<PatientRow>& rows) {
  FrontPlot plot{"Lumen near the way", "contrast at its least over noise", "1 - Dice", {}};
  const std::vector<LegendEntry> legend = {{"way right", {0.12F, 0.47F, 0.71F}},
                                           {"wrong, or no line", {0.84F, 0.15F, 0.16F}},
                                           {"refused (at 1)", kInk}};
  plot.lines = {{.entry = 0, .points = {}}, {.entry = 1, .points = {}}, {.entry = 2, .points = {}}};
  for (const PatientRow& row : rows) {
    if (!row.noise_hu) continue;
    const double clear = std::min(*row.access_contrast_hu, *row.target_contrast_hu) / *row.noise_hu;
    const std::size_t entry = !row.dice_way ? 2 : row.way_right == true ? 0 : 1;
    plot.lines[entry].points.emplace_back(clear, std::max(1e-3, 1.0 - row.dice_way.value_or(0.0)));
  }
  std::erase_if(plot.lines, [](const FrontLine& line) { return line.points.empty(); });
  if (plot.lines.empty()) plot.lines = {{.entry = 2, .points = {{1.0, 1.0}}}};
  return draw_fronts("wireplan bench segmentation", {plot}, 1, legend);
}

Json describe_columns() {
  return {
      {"patient", "seed of `wireplan phantom --random`, or the name of a real case"},
      {"access_contrast_hu", "over blood without contrast; it falls to target_contrast_hu"},
      {"outcome",
       "done; refused by the segmentation; no surface; no centerline; failed: our fault"},
      {"dice_way", "of the voxels within three true radii of the true way"},
      {"surface_mean_mm",
       "from the surface's vertices within three true radii of the true way to "
       "the true wall; also surface_p95_mm"},
      {"axis_mean_mm", "from the centerline to the true axis; also axis_p95_mm"},
      {"radius_within_5_percent",
       "half the diameter of the circle as large as the section, of the places along the "
       "centerline where the lumen is a single round tube without plaque, over two voxels in "
       "radius"},
      {"closed_within_5_percent", "the same of those whose wall lies at that radius all round"},
      {"ball_within_5_percent", "the inscribed ball's radius there"},
      {"way_right",
       "each point of the centerline lies within the true radius of the true axis (of the wider "
       "artery where their lumens are one), and none of its steps skips more of it than 2.5 radii "
       "and 5 mm; so at both ends"},
      {"outside_percent",
       "of the mask, neither in the truth nor next to it (corners included), "
       "over the truth"},
      {"outside_silent_percent",
       "of that, in pieces of which no warning names a place within 10 mm"},
      {"handles", "of the surface"},
      {"warnings", "leaks cut, touches, border, handles"},
      {"segment_s", "CPU time, of all threads; all_s with surface and centerline"}};
}

}  // namespace

BenchReport bench_segmentation(const BenchOptions& options) {
  const std::vector<LabelledCase> labelled = labelled_of(options);
  const std::vector<PatientRow> drawn = run_patients(options);
  std::vector<PatientRow> all = drawn;
  for (const LabelledCase& one : labelled) {
    all.push_back(guarded(one.name, [&] { return segment_labelled(one); }));
  }
  BenchReport report;
  for (const PatientRow& row : all) report.rows.push_back(json_of(row));
  report.results["outcomes"] = Json::object();
  for (const PatientRow& row : drawn) {
    Json& count = report.results["outcomes"][name_of(row.outcome)];
    count = count.is_null() ? 1 : count.get<int>() + 1;
  }
  report.results["spread"] = {spread(drawn, "dice_way", &PatientRow::dice_way),
                              spread(drawn, "dice", &PatientRow::dice),
                              spread(drawn, "surface_mean_mm", &PatientRow::surface_mean_mm),
                              spread(drawn, "axis_mean_mm", &PatientRow::axis_mean_mm),
                              spread(drawn, "radius_within_share", &PatientRow::radius_within),
                              spread(drawn, "closed_within_share", &PatientRow::closed_within),
                              spread(drawn, "ball_within_share", &PatientRow::ball_within),
                              spread(drawn, "outside_share", &PatientRow::outside),
                              spread(drawn, "outside_silent_share", &PatientRow::outside_silent)};
  report.results["criteria"] = criteria_of(drawn);
  report.description["patients"] = {{"first_seed", options.first_seed},
                                    {"count", drawn.size()},
                                    {"drawn_by", "preprocess/volume/random_patient.h"}};
  report.description["columns"] = describe_columns();
  std::vector<Json> table = report.rows;  // messages are told below it
  for (Json& row : table) row.erase("message");
  report.text = table_text(table) + "\n" + text_of(report.results, all);
  report.plot = plot_of_patients(all);
  return report;
}

}  // namespace wireplan::pipeline
