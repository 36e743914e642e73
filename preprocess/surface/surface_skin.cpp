#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "preprocess/surface/cgal_calls.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_mend.h"
#include "preprocess/surface/wall_tree.h"

namespace wireplan::preprocess {
namespace {

// A wall with two skins: more than this part of its area, less than half, looks across a cavity at
// the wall opposite and has a wall behind it that is thinner than this part of the cavity. A vessel
// whose branches face each other has less.
constexpr double kInsidePart = 0.2, kThin = 0.5;
constexpr Eigen::Index kSamples = 4000;  // triangles at which that is asked
// Rays over the half space before a triangle: on the inner skin most of them meet the wall.
constexpr int kRays = 24;
// Cutting the skins apart costs the cut's length, times the wall's thickness and this, along smooth
// wall, and down to nothing where the wall turns by kRimDeg: the cut follows the rims.
constexpr double kCutCost = 0.5, kLeastCost = 0.02, kRimDeg = 60.0;

enum Label : std::size_t { kInner = 0, kOuter = 1 };

struct Facet {
  Vec3 middle, normal;
  double area = 0.0;
};

Facet facet_of(const Surface& s, Eigen::Index t) {
  const Vec3 a = s.vertices.col(s.triangles(0, t)), b = s.vertices.col(s.triangles(1, t)),
             c = s.vertices.col(s.triangles(2, t));
  const Vec3 twice_area = (b - a).cross(c - a);
  return {(a + b + c) / 3.0, twice_area.stableNormalized(), 0.5 * twice_area.norm()};
}

double size_of(const Surface& s) {
  return (s.vertices.rowwise().maxCoeff() - s.vertices.rowwise().minCoeff()).norm();
}

/// Thickness of the wall if the surface is one with two skins, else 0.                    [mm]
double wall_thickness(const Surface& s, const WallTree& wall) {
  const double reach = size_of(s);
  const Eigen::Index stride = std::max<Eigen::Index>(1, s.triangles.cols() / kSamples);
  double inside = 0.0, all = 0.0;
  std::vector<double> thickness;
  for (Eigen::Index t = 0; t < s.triangles.cols(); t += stride) {
    const Facet facet = facet_of(s, t);
    all += facet.area;
    const double across = wall.free_way(facet.middle, facet.normal, reach);
    if (across >= reach) continue;
    const double behind = wall.free_way(facet.middle, -facet.normal, reach);
    if (behind > kThin * across) continue;
    inside += facet.area;
    thickness.push_back(behind);
  }
  if (inside < kInsidePart * all) return 0.0;
  return median(std::move(thickness));
}

/// Part of the rays from a triangle outward that meet the surface again.
double enclosed_part(const WallTree& wall, const Facet& facet, double reach) {
  const Vec3 u = facet.normal.unitOrthogonal(), v = facet.normal.cross(u);
  int met = 0;
  for (int k = 0; k < kRays; ++k) {
    // Directions by the cosine, in a spiral of golden angles.
    const double square = (k + 0.5) / kRays, angle = k * kPi * (3.0 - std::sqrt(5.0));
    const Vec3 direction = std::sqrt(square) * (std::cos(angle) * u + std::sin(angle) * v) +
                           std::sqrt(1.0 - square) * facet.normal;
    met += wall.free_way(facet.middle, direction, reach) < reach ? 1 : 0;
  }
  return static_cast<double>(met) / kRays;
}

/// Inner or outer for each triangle: as each is enclosed, with the shortest cut along rims.
std::vector<std::size_t> label_skins(const Surface& s, const WallTree& wall, double thickness) {
  const double reach = size_of(s);
  std::vector<double> enclosed(static_cast<std::size_t>(s.triangles.cols()));
#pragma omp parallel for schedule(dynamic, 64)
  for (Eigen::Index t = 0; t < s.triangles.cols(); ++t) {
    enclosed[static_cast<std::size_t>(t)] = enclosed_part(wall, facet_of(s, t), reach);
  }

  std::vector<LabelCost> costs;
  for (Eigen::Index t = 0; t < s.triangles.cols(); ++t) {
    const double area = facet_of(s, t).area, part = enclosed[static_cast<std::size_t>(t)];
    costs.push_back({.zero = area * (1.0 - part), .one = area * part});
  }
  return cut_apart(s, costs, [&](int a, int b, double length) {
    const double cosine = facet_of(s, a).normal.dot(facet_of(s, b).normal);
    const double turn = std::acos(std::clamp(cosine, -1.0, 1.0)) / kRadPerDeg;
    return kCutCost * thickness * length * std::max(kLeastCost, 1.0 - turn / kRimDeg);
  });
}

}  // namespace

Surface inner_skin(const Surface& closed, std::vector<Mend>& mends) {
  const WallTree wall(closed);
  const double thickness = wall_thickness(closed, wall);
  if (thickness == 0.0) return closed;

  // The normals of the wall's inner skin point into the lumen.
  const std::vector<std::size_t> labels = label_skins(closed, wall, thickness);
  Surface skin{.vertices = closed.vertices, .triangles = closed.triangles};
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < closed.triangles.cols(); ++t) {
    if (labels[static_cast<std::size_t>(t)] != kInner) continue;
    skin.triangles.col(kept++) = closed.triangles.col(t);
  }
  mends.push_back({.kind = MendKind::kOuterSkin,
                   .count = static_cast<int>(closed.triangles.cols() - kept),
                   .place = closed.vertices.col(closed.triangles(0, 0)),
                   .size = thickness});
  skin.triangles.conservativeResize(3, kept);
  skin.triangles.row(1).swap(skin.triangles.row(2));
  return skin;
}

}  // namespace wireplan::preprocess
