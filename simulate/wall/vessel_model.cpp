#include "simulate/wall/vessel_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <future>

namespace wireplan::simulate {

namespace {

VesselModel make_yielding(const Surface& surface, const Wall& wall, LumenOptions options) {
  options.band = VesselModel::yielding_band(options);
  std::future<std::unique_ptr<WallCompliance>> compliance = std::async(
      std::launch::async, [&] { return std::make_unique<WallCompliance>(surface, wall); });
  VesselModel model(surface, options);
  model.compliance = compliance.get();
  return model;
}

}  // namespace

LumenOptions follow(const Surface& surface, double felt) {
  constexpr double kCoarsest = 0.5, kFinest = 0.1;  // [mm]
  constexpr double kBeyond = 0.5;                   // what is felt                     [mm]
  double area = 0.0;
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    const Eigen::Vector3i corner = surface.triangles.col(t);
    const Vec3 a = surface.vertices.col(corner[0]);
    area += 0.5 *
            (surface.vertices.col(corner[1]) - a).cross(surface.vertices.col(corner[2]) - a).norm();
  }
  // Of equilateral triangles of that size.
  const double edge =
      std::sqrt(4.0 / std::sqrt(3.0) * area / static_cast<double>(surface.triangles.cols()));
  return {.grid_spacing = std::clamp(2.0 / 3.0 * edge, kFinest, kCoarsest),
          .band = std::max(LumenOptions().band, felt + kBeyond),
          .openings = preprocess::find_openings(surface)};
}

double VesselModel::yielding_band(const LumenOptions& options) {
  return std::max(options.band, 10.0 * options.grid_spacing);
}

VesselModel::VesselModel(const Surface& surface, const Wall& wall, const LumenOptions& options)
    : VesselModel(make_yielding(surface, wall, options)) {}

}  // namespace wireplan::simulate
