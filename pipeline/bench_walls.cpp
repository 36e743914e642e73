#include "pipeline/bench_walls.h"

#include <Eigen/Geometry>
#include <cmath>

namespace wireplan::pipeline {
namespace {

struct Station {
  Vec3 center;
  double radius;
};

/// Rings of triangles round the stations, square to the mean direction there, with a fan at either
/// end.
Surface skin_over(const std::vector<Station>& stations, int sides) {
  const int rings = static_cast<int>(stations.size());
  Surface surface;
  surface.vertices.resize(3, rings * sides + 2);
  surface.triangles.resize(3, 2 * rings * sides);
  Vec3 u = Vec3::UnitX();
  for (int r = 0; r < rings; ++r) {
    const Vec3 before = stations[std::max(0, r - 1)].center, here = stations[r].center;
    const Vec3 after = stations[std::min(rings - 1, r + 1)].center;
    const Vec3 tangent =
        ((here - before).stableNormalized() + (after - here).stableNormalized()).normalized();
    u = (u - u.dot(tangent) * tangent).normalized();
    const Vec3 v = tangent.cross(u);
    for (int k = 0; k < sides; ++k) {
      const double angle = 2.0 * kPi * k / sides;
      surface.vertices.col(r * sides + k) =
          here + stations[r].radius * (std::cos(angle) * u + std::sin(angle) * v);
    }
  }
  const int start = rings * sides, end = start + 1;
  surface.vertices.col(start) = stations.front().center;
  surface.vertices.col(end) = stations.back().center;
  int next = 0;
  for (int k = 0; k < sides; ++k) {
    const int j = (k + 1) % sides, last = (rings - 1) * sides;
    surface.triangles.col(next++) = Eigen::Vector3i(start, j, k);
    surface.triangles.col(next++) = Eigen::Vector3i(end, last + k, last + j);
    for (int r = 0; r + 1 < rings; ++r) {
      const int a = r * sides, b = a + sides;
      surface.triangles.col(next++) = Eigen::Vector3i(a + k, a + j, b + k);
      surface.triangles.col(next++) = Eigen::Vector3i(a + j, b + j, b + k);
    }
  }
  return surface;
}

std::vector<Station> straight_stations(double spacing) {
  std::vector<Station> stations;
  const int count = static_cast<int>(std::lround(60.0 / spacing));
  for (int k = 0; k <= count; ++k) stations.push_back({Vec3(0.0, 0.0, k * spacing), 4.0});
  return stations;
}

Surface narrow_tube() {
  std::vector<Station> stations = straight_stations(1.0);
  for (Station& station : stations) station.radius = 0.4;
  return skin_over(stations, 12);
}

Surface stenosis() {
  std::vector<Station> stations = straight_stations(1.0);
  for (Station& station : stations) {
    const double from_middle = (station.center.z() - 25.0) / 4.0;
    station.radius = 4.0 - 3.7 * std::exp(-from_middle * from_middle);
  }
  return skin_over(stations, 16);
}

Surface elbow() {
  std::vector<Station> stations;
  for (int k = 0; k <= 10; ++k) stations.push_back({Vec3(0.0, 0.0, 2.0 * k), 4.0});
  stations.push_back({Vec3(0.0, 0.0, 25.0), 4.0 * std::sqrt(2.0)});
  for (int k = 0; k <= 14; ++k) stations.push_back({Vec3(5.0 + 2.0 * k, 0.0, 25.0), 4.0});
  return skin_over(stations, 16);
}

Surface folds() {
  std::vector<Station> stations = straight_stations(0.7);
  for (std::size_t k = 12; k < stations.size(); ++k) stations[k].radius = k % 2 == 0 ? 4.0 : 2.2;
  return skin_over(stations, 16);
}

Surface slivers() {
  // 60 sides of 0.4 mm, in rows of 6 mm with rows of 0.01 mm between.
  std::vector<Station> stations;
  for (int k = 0; k <= 10; ++k) {
    stations.push_back({Vec3(0.0, 0.0, 6.0 * k), 4.0});
    stations.push_back({Vec3(0.0, 0.0, 6.0 * k + 0.01), 4.0});
  }
  return skin_over(stations, 60);
}

Surface cone() {
  std::vector<Station> stations = straight_stations(1.0);
  for (Station& station : stations) station.radius = 4.0 - 3.99 * station.center.z() / 60.0;
  return skin_over(stations, 16);
}

}  // namespace

std::vector<BenchWall> make_bench_walls() {
  return {{"narrow", "a tube of radius 0.4 mm, narrower than the wire", narrow_tube(), 0.4},
          {"stenosis", "a tube of radius 4 mm that narrows to 0.3 mm", stenosis()},
          {"elbow", "a tube with a sharp corner of 90 degrees", elbow()},
          {"folds", "a tube whose radius jumps between 4 and 2.2 mm every 0.7 mm", folds()},
          {"slivers", "a tube of triangles 0.4 mm wide, 6 mm and 0.01 mm long", slivers()},
          {"cone", "a cone from radius 4 mm to 0.01 mm", cone()}};
}

bool is_inside(const Surface& surface, const Vec3& point) {
  double sum = 0.0;  // of solid angles; 4 pi inside
  for (const auto& corner : surface.triangles.colwise()) {
    const Vec3 a = surface.vertices.col(corner[0]) - point;
    const Vec3 b = surface.vertices.col(corner[1]) - point;
    const Vec3 c = surface.vertices.col(corner[2]) - point;
    const double x = a.norm(), y = b.norm(), z = c.norm();
    sum +=
        2.0 * std::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
  }
  return sum > 2.0 * kPi;
}

}  // namespace wireplan::pipeline
