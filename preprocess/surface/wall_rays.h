#pragma once
/// Free ways to a surface; for the .cpp files here that call CGAL, not for other folders.
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

using WallKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using WallTriangles = std::vector<WallKernel::Triangle_3>;

/// The triangles, for rays that meet them.
class WallRays {
 public:
  explicit WallRays(const Surface& surface) {
    triangles_.reserve(static_cast<std::size_t>(surface.triangles.cols()));
    for (Eigen::Index k = 0; k < surface.triangles.cols(); ++k) {
      const auto corner = [&](int i) {
        const Vec3 p = surface.vertices.col(surface.triangles(i, k));
        return WallKernel::Point_3(p.x(), p.y(), p.z());
      };
      const WallKernel::Triangle_3 triangle(corner(0), corner(1), corner(2));
      if (!triangle.is_degenerate()) triangles_.push_back(triangle);
    }
    expects(!triangles_.empty());
    tree_.rebuild(triangles_.cbegin(), triangles_.cend());
    tree_.build();
  }
  WallRays(const WallRays&) = delete;  // the tree points into triangles_
  WallRays& operator=(const WallRays&) = delete;

  /// Way from a point on the wall along a unit direction to the next wall, at most `reach`.
  double free_way(const Vec3& from, const Vec3& direction, double reach) const {
    constexpr double kStart = 1e-4;  // of the reach: off the wall that the point is on
    const auto point = [&](double way) {
      const Vec3 p = from + way * direction;
      return WallKernel::Point_3(p.x(), p.y(), p.z());
    };
    const WallKernel::Segment_3 segment(point(kStart * reach), point(reach));
    std::vector<WallTriangles::const_iterator> hits;
    tree_.all_intersected_primitives(segment, std::back_inserter(hits));
    double least = reach;
    for (const WallTriangles::const_iterator hit : hits) {
      const WallKernel::Vector_3 normal = hit->supporting_plane().orthogonal_vector();
      const double slope = normal * segment.to_vector();
      if (slope == 0.0) continue;
      const double part = (normal * (hit->vertex(0) - segment.source())) / slope;
      least = std::min(least, reach * (kStart + (1.0 - kStart) * part));
    }
    return least;
  }

 private:
  using Primitive = CGAL::AABB_triangle_primitive<WallKernel, WallTriangles::const_iterator>;

  WallTriangles triangles_;
  CGAL::AABB_tree<CGAL::AABB_traits<WallKernel, Primitive>> tree_;
};

}  // namespace wireplan::preprocess
