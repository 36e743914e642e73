#include "pipeline/bench/stability_results.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/bench/bench_walls.h"
#include "pipeline/bench/stability_scenes.h"
#include "pipeline/files/text.h"
#include "pipeline/report/plot.h"

namespace wireplan::pipeline {
namespace {

const std::vector<std::string> kVerdicts = {"ok", "limit", "failed"};
const std::vector<std::string> kMethods = {"newton", "conjugate_gradient", "explicit",
                                           "semi_implicit"};

/// Verdicts over the grid of coefficients, for one method at one time step.
MatrixPlot matrix_of(const std::vector<Json>& rows, const std::string& method,
                     std::optional<double> time_step) {
  MatrixPlot plot;
  plot.title = method + (time_step ? format(", %g s", *time_step) : std::string());
  plot.x_label = "log10 of k_b [N/m]";
  plot.y_label = "log10 of k_s [N/m^3]";
  for (const double bend : kBend) plot.x_ticks.push_back(format("%.0f", std::log10(bend)));
  for (const double stretch : kStretch) plot.y_ticks.push_back(format("%.0f", std::log10(stretch)));
  plot.cells.assign(kBend.size() * kStretch.size(), -1);
  for (const Json& row : rows) {
    const bool shown = row.at("method") == method &&
                       row.at("scene").get<std::string>().starts_with("coefficients") &&
                       (!time_step || row.at("time_step_s") == *time_step);
    if (!shown) continue;
    const auto index = [](const std::vector<double>& values, double value) {
      return std::find(values.begin(), values.end(), value) - values.begin();
    };
    const auto c = index(kBend, row.at("bend_coefficient_n_per_m"));
    const auto r = index(kStretch, row.at("stretch_coefficient_n_per_m3"));
    const auto verdict = std::find(kVerdicts.begin(), kVerdicts.end(), row.at("verdict"));
    plot.cells[static_cast<std::size_t>(r) * kBend.size() + static_cast<std::size_t>(c)] =
        static_cast<int>(verdict - kVerdicts.begin());
  }
  return plot;
}

}  // namespace

std::vector<Json> summarize_stability(const std::vector<Json>& rows) {
  std::vector<Json> summary;
  for (const std::string& method : kMethods) {
    Json entry;
    entry["method"] = method;
    const auto count = [&](const char* key, const std::string& value) {
      return std::count_if(rows.begin(), rows.end(), [&](const Json& row) {
        return row.at("method") == method && row.at(key) == value;
      });
    };
    entry["rows"] = count("method", method);
    for (const std::string& verdict : kVerdicts) entry[verdict] = count("verdict", verdict);
    for (const char* outcome :
         {"converged", "finished", "not_converged", "unstable", "reached", "missed", "stuck",
          "prolapsed", "crosses_itself", "left_image", "left_lumen"}) {
      entry[outcome] = count("outcome", outcome);
    }
    summary.push_back(entry);
  }
  return summary;
}

std::size_t count_scenes(const std::vector<Json>& rows) {
  return static_cast<std::size_t>(std::count_if(
      rows.begin(), rows.end(), [](const Json& row) { return row.at("method") == "newton"; }));
}

std::vector<std::string> find_lower_energies(const std::vector<Json>& rows) {
  std::vector<std::string> scenes;
  const Json* newton = nullptr;
  for (const Json& row : rows) {
    if (row.at("method") == "newton") newton = &row;
    if (newton->at("outcome") != "converged" || row.at("energy_n_mm").is_null()) continue;
    const double energy = row.at("energy_n_mm"), least = newton->at("energy_n_mm");
    const bool known = !scenes.empty() && scenes.back() == row.at("scene");
    if (energy < least - 1e-9 * (1.0 + std::abs(least)) && !known) {
      scenes.push_back(row.at("scene"));
    }
  }
  return scenes;
}

Picture plot_stability(const std::vector<Json>& rows) {
  std::vector<MatrixPlot> plots = {matrix_of(rows, "newton", {}),
                                   matrix_of(rows, "conjugate_gradient", {})};
  for (const char* method : {"explicit", "semi_implicit"}) {
    for (const double step : {1e-6, 1e-4, 1e-2}) plots.push_back(matrix_of(rows, method, step));
  }
  return draw_matrices("Stability over the coefficients, 20 elements of 2 mm under gravity", plots,
                       4,
                       {{"ok", Color(0.35F, 0.70F, 0.45F)},
                        {"limit: named as unstable or not converged", Color(0.95F, 0.75F, 0.25F)},
                        {"failed", Color(0.80F, 0.10F, 0.10F)}});
}

Json describe_stability() {
  Json walls;
  for (const BenchWall& wall : make_bench_walls()) walls[wall.name] = wall.text;
  return {
      {"scenes",
       {{"coefficients",
         "k_b 1e-2 to 1e7 N/m and k_s 1e6 to 1e14 N/m^3, 20 elements of 2 mm, "
         "clamped level at one end, 0.1 kg/m, gravity"},
        {"tiny_load", "tip load of 1e-6 EI/L^2 across, no gravity"},
        {"huge_load", "tip load of 1e4 EI/L^2 across"},
        {"huge_push", "tip load of 1e3 EI/L^2 along and 1 EI/L^2 across"},
        {"size", "elements of 0.05 to 10 mm, 3 to 5000 nodes, k_b 100 N/m, k_s 1e10 N/m^3"},
        {"device_size", "the same with EI 620 N mm^2 and EA 49600 N"},
        {"ratio", "stiffness that falls by 1 to 1e4 in one third of the wire"},
        {"squeezed", "clamped at both ends, these nearer by 2 or 30 % of the length"},
        {"coaxial",
         "a curved catheter over a curved wire, EI 1e-3 to 1e3 of each other's, overlapping by 0.1 "
         "to "
         "40 mm at the start, pushed by turns in steps of 0.2 to 10 mm and each turned all round; "
         "every second one in the S-tube of the throughput with friction 0.2"},
        {"all_at_once", "ratio 1e4, k_b 1e7, k_s 1e14, 5000 nodes, elements of 0.05 mm"}}},
      {"walls", walls},
      {"wall_entries", "along the axis, 0.1 mm beside the wall, 80 degrees into it; EI 1 to 1e5"},
      {"verdicts",
       {{"ok", "ended finite, balanced or with no more energy than it began with"},
        {"limit",
         "the method says that it did not get there: unstable, not_converged, left_lumen, or an "
         "energy that grows at a time step beyond the critical one that it tells"},
        {"failed",
         "not finite, an exception, energy that rose, or an answer that the checks refute"}}},
      {"columns",
       {{"worst_energy_rise",
         "of the potential energy in one accepted step [N mm]; Euler's swing freely; null for "
         "trials, whose result does not hold it"},
        {"time_step_s", "null for newton, which is static"},
        {"critical_time_step_s", "null where there is none"},
        {"iterations", "of newton, or time steps"}}}};
}

}  // namespace wireplan::pipeline
