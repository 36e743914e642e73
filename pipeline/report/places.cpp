#include "pipeline/report/places.h"

#include <algorithm>
#include <cmath>
#include <tuple>
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

std::vector<Place> list_places(const SlicedVessel& vessel, const std::vector<double>& peak_force) {
  const Centerline& path = vessel.path;
  const double length = path.arc_length(path.arc_length.size() - 1);
  std::vector<Stop> stops = {{0.0, {"access", vessel.access, {}}},
                             {length, {"target", vessel.target, {}}}};
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
    const Surface& surface = vessel.surface;
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

std::pair<double, double> vessel_window(const preprocess::Image& image, const Json& segment) {
  const double threshold =
      segment.contains("band") ? segment.at("band").at("lower_hu") : segment.at("edge_hu");
  const double span = 2.0 * (segment.at("mean_hu").get<double>() - threshold);
  const auto [least, most] = std::minmax_element(image.values.begin(), image.values.end());
  const double low = std::max(threshold - span, static_cast<double>(*least));
  const double high = std::min(threshold + span, static_cast<double>(*most));
  return {low, high <= low ? low + 1.0 : high};
}

Slices cut_vessel_slices(const preprocess::Image& image, const SlicedVessel& vessel,
                         const Json& segment, const std::vector<double>& peak_force) {
  SliceOptions options;
  std::tie(options.window_low, options.window_high) = vessel_window(image, segment);
  return cut_slices(image, vessel.surface, list_places(vessel, peak_force), options);
}

}  // namespace wireplan::pipeline
