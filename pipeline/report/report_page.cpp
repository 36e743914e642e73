#include "pipeline/report/report_page.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace wireplan::pipeline {
namespace {

constexpr int kPlacesOnTheWay = 10;

// A place and how far along the path it is, to put places in order.
struct Stop {
  double arc_length;
  Place place;
};

Eigen::Index nearest_on_path(const Centerline& path, const Vec3& point) {
  Eigen::Index nearest = 0;
  (path.points.colwise() - point).colwise().squaredNorm().minCoeff(&nearest);
  return nearest;
}

std::vector<Place> list_places(Workspace& work, const std::vector<double>& peak_force) {
  const Centerline& path = work.path();
  const plan::Study& study = work.study();
  const double length = path.arc_length(path.arc_length.size() - 1);
  std::vector<Stop> stops = {{0.0, {"access", study.access, {}}},
                             {length, {"target", study.goal.point, {}}}};
  for (int k = 1; k <= kPlacesOnTheWay; ++k) {
    const double wanted = length * k / (kPlacesOnTheWay + 1);
    Eigen::Index at = 0;
    (path.arc_length.array() - wanted).abs().minCoeff(&at);
    const auto rounded = static_cast<long>(std::lround(path.arc_length(at)));
    stops.push_back({path.arc_length(at),
                     {"on the way, " + std::to_string(rounded) + " mm from the access",
                      path.points.col(at),
                      {}}});
  }
  const auto worst = std::max_element(peak_force.begin(), peak_force.end());
  if (worst != peak_force.end() && *worst > 0.0) {
    const Surface& surface = work.surface();
    Vec3 middle = Vec3::Zero();
    for (const int corner : surface.triangles.col(worst - peak_force.begin())) {
      middle += surface.vertices.col(corner) / 3.0;
    }
    stops.push_back({path.arc_length(nearest_on_path(path, middle)),
                     {"largest force on the wall", middle, {}}});
  }
  std::stable_sort(stops.begin(), stops.end(),
                   [](const Stop& a, const Stop& b) { return a.arc_length < b.arc_length; });
  std::vector<Place> places;
  for (Stop& stop : stops) places.push_back(std::move(stop.place));
  return places;
}

}  // namespace

std::vector<int> best_of_each_wire(const ReportInput& report) {
  std::vector<int> best;
  for (std::size_t w = 0; w < report.study.wires.size(); ++w) {
    std::optional<int> shown = report.ranking.wires[w].best_trial;
    const bool ranked = shown.has_value();
    for (std::size_t id = 0; !ranked && id < report.trials.size(); ++id) {
      const plan::Metrics& metrics = report.metrics[id];
      if (report.candidates[id].wire != static_cast<int>(w) || metrics.insertion <= 0.0) continue;
      if (!shown || metrics.tip_to_target < report.metrics[*shown].tip_to_target) {
        shown = static_cast<int>(id);
      }
    }
    if (shown) best.push_back(*shown);
  }
  return best;
}

std::vector<int> choose_played(const ReportInput& report) {
  std::vector<int> played;
  const std::size_t count = std::min(kPlansPlayed, report.ranking.plans.size());
  for (std::size_t k = 0; k < count; ++k) played.push_back(report.ranking.plans[k].trial);
  for (const int id : best_of_each_wire(report)) {
    const auto same_wire = [&](int other) {
      return report.candidates[other].wire == report.candidates[id].wire;
    };
    if (std::none_of(played.begin(), played.end(), same_wire)) played.push_back(id);
  }
  return played;
}

std::optional<Slices> cut_case_slices(Workspace& work, const std::vector<double>& peak_force) {
  const Case& given = work.given();
  if (!given.volume) return {};
  const preprocess::Image& image = work.image();

  // The lumen's mean bright, as far below the threshold as above it; never past the values there
  // are.
  const Json segment = work.figures("segment");
  const double threshold = segment.at("band").at("lower_hu");
  const double span = 2.0 * (segment.at("mean_hu").get<double>() - threshold);
  const auto [least, most] = std::minmax_element(image.values.begin(), image.values.end());
  SliceOptions options;
  options.window_low = std::max(threshold - span, static_cast<double>(*least));
  options.window_high = std::min(threshold + span, static_cast<double>(*most));
  if (options.window_high <= options.window_low) options.window_high = options.window_low + 1.0;
  Slices slices = cut_slices(image, work.surface(), list_places(work, peak_force), options);
  work.drop_image();
  return slices;
}

}  // namespace wireplan::pipeline
