#include "preprocess/wall/wall.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <vector>

#include "preprocess/surface/wall_tree.h"

namespace wireplan::preprocess {
namespace {

// Default of the wall's normal stiffness per area, references B2: 25 kPa/mm           [MPa/mm]
constexpr double kTargetStiffness = 25.0 * kMpaPerKpa;
// Below this part of the thickness a height is not halved further: the element would be so stiff
// that it decides the condition of the whole wall.
constexpr double kLeastPart = 0.05;

/// Centroid and outward unit normal of a triangle.
struct Facet {
  Vec3 centroid, normal;
};

Facet facet_of(const Surface& surface, Eigen::Index k) {
  const Vec3 a = surface.vertices.col(surface.triangles(0, k));
  const Vec3 b = surface.vertices.col(surface.triangles(1, k));
  const Vec3 c = surface.vertices.col(surface.triangles(2, k));
  return {.centroid = (a + b + c) / 3.0, .normal = (b - a).cross(c - a).normalized()};
}

/// The surface and what is near a place of it.
class Surroundings {
 public:
  explicit Surroundings(const Surface& surface) : surface_(surface), tree_(surface, true) {}

  /// Way from triangle k outward along its normal to the next wall, at most `reach`; to a triangle
  /// that shares a vertex, across a crease, not below `least_in_crease`.
  double free_distance(Eigen::Index k, const Facet& facet, double reach,
                       double least_in_crease) const {
    const Vec3 end = facet.centroid + reach * facet.normal;
    double least = reach;
    tree_.for_each_hit(facet.centroid, end, [&](Eigen::Index other) {
      if (other == k) return;
      const bool neighbour = share_vertex(k, other);
      const double way = crossing(facet, other, neighbour);
      least = std::min(least, neighbour ? std::max(way, least_in_crease) : way);
    });
    return least;
  }

  /// Distance of a point from the whole wall, found from triangle k.
  double distance(const Vec3& point, Eigen::Index k) const { return tree_.distance(point, k); }

 private:
  bool share_vertex(Eigen::Index a, Eigen::Index b) const {
    for (int i = 0; i < 3; ++i) {
      if ((surface_.triangles.col(b).array() == surface_.triangles(i, a)).any()) return true;
    }
    return false;
  }

  /// Where the normal ray of the facet meets a triangle that it is known to meet. A neighbour met
  /// at once is the facet's own rim, rounded.
  double crossing(const Facet& facet, Eigen::Index other, bool neighbour) const {
    constexpr double kAtOnce = 1e-6;  // mm
    const Facet wall = facet_of(surface_, other);
    const double slope = wall.normal.dot(facet.normal);
    double at = slope == 0.0 ? 0.0 : wall.normal.dot(wall.centroid - facet.centroid) / slope;
    at = std::max(at, 0.0);
    return neighbour && at < kAtOnce ? std::numeric_limits<double>::infinity() : at;
  }

  const Surface& surface_;
  WallTree tree_;
};

/// Height of tetrahedron k: up to half way to the next wall ahead, then halved until the apex keeps
/// half of the height as its distance from all other wall.
double find_height(const Surroundings& surroundings, const Facet& facet, Eigen::Index k,
                   double thickness) {
  const double ahead =
      surroundings.free_distance(k, facet, 2.0 * thickness, 2.0 * kLeastPart * thickness);
  double height = std::min(thickness, 0.5 * ahead);
  while (height > kLeastPart * thickness &&
         surroundings.distance(facet.centroid + height * facet.normal, k) < 0.5 * height) {
    height *= 0.5;
  }
  return height;
}

}  // namespace

ExtrudedWall extrude_wall(const Surface& surface, const WallOptions& options) {
  const double thickness = options.thickness_mm;
  expects(thickness > 0.0 && options.young_modulus >= 0.0);
  expects(options.poisson_ratio > -1.0 && options.poisson_ratio < 0.5);
  expects(surface.triangles.cols() > 0);

  // Material: the modulus that gives the wanted stiffness, which is linear in it.
  ExtrudedWall result;
  Wall& wall = result.wall;
  wall.poisson_ratio = options.poisson_ratio;
  wall.young_modulus =
      options.young_modulus > 0.0
          ? options.young_modulus
          : kTargetStiffness / wall_normal_stiffness(1.0, options.poisson_ratio, thickness);

  // Apexes, each from the surface alone, so that the threads cannot change them.
  const Eigen::Index m = surface.triangles.cols();
  wall.apexes.resize(3, m);
  wall.height.resize(m);
  const Surroundings surroundings(surface);
  int inverted = 0;
#pragma omp parallel for schedule(dynamic, 256) reduction(+ : inverted)
  for (Eigen::Index k = 0; k < m; ++k) {
    const Facet facet = facet_of(surface, k);
    wall.height(k) = find_height(surroundings, facet, k, thickness);
    wall.apexes.col(k) = facet.centroid + wall.height(k) * facet.normal;
    const bool outward = (wall.apexes.col(k) - facet.centroid).dot(facet.normal) > 0.0;
    inverted += outward ? 0 : 1;
  }

  result.statistics.inverted = inverted;
  result.statistics.min_height_mm = wall.height.minCoeff();
  result.statistics.limited = static_cast<int>((wall.height.array() < thickness).count());
  return result;
}

}  // namespace wireplan::preprocess
