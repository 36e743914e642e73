#include "preprocess/surface/wall_tree.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

namespace wireplan::preprocess {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;

Kernel::Point_3 to_cgal(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

}  // namespace

struct WallTree::Boxes {
  Triangles triangles;
  std::vector<Eigen::Index> number;                            // of each in the surface
  CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree;  // points into triangles

  std::vector<Triangles::const_iterator> hits(const Kernel::Segment_3& segment) const {
    std::vector<Triangles::const_iterator> found;
    tree.all_intersected_primitives(segment, std::back_inserter(found));
    return found;
  }
};

WallTree::WallTree(const Surface& surface, bool degenerate) : boxes_(std::make_unique<Boxes>()) {
  boxes_->triangles.reserve(static_cast<std::size_t>(surface.triangles.cols()));
  for (Eigen::Index k = 0; k < surface.triangles.cols(); ++k) {
    const auto corner = [&](int i) {
      return to_cgal(surface.vertices.col(surface.triangles(i, k)));
    };
    const Kernel::Triangle_3 triangle(corner(0), corner(1), corner(2));
    if (!degenerate && triangle.is_degenerate()) continue;
    boxes_->triangles.push_back(triangle);
    boxes_->number.push_back(k);
  }
  expects(!boxes_->triangles.empty());
  boxes_->tree.rebuild(boxes_->triangles.cbegin(), boxes_->triangles.cend());
  boxes_->tree.build();
}

WallTree::~WallTree() = default;

void WallTree::for_each_hit(const Vec3& from, const Vec3& to,
                            const std::function<void(Eigen::Index triangle)>& hit) const {
  for (const Triangles::const_iterator found : boxes_->hits({to_cgal(from), to_cgal(to)})) {
    hit(boxes_->number[static_cast<std::size_t>(found - boxes_->triangles.cbegin())]);
  }
}

double WallTree::distance(const Vec3& point, Eigen::Index near) const {
  const auto place = std::lower_bound(boxes_->number.begin(), boxes_->number.end(), near);
  expects(place != boxes_->number.end());
  const auto hint = boxes_->triangles.cbegin() + (place - boxes_->number.begin());
  const Kernel::Point_3 query = to_cgal(point);
  const auto answer = boxes_->tree.closest_point_and_primitive(query, {hint->vertex(0), hint});
  return std::sqrt(CGAL::squared_distance(query, answer.first));
}

double WallTree::free_way(const Vec3& from, const Vec3& direction, double reach) const {
  constexpr double kStart = 1e-4;  // of the reach: off the wall that the point is on
  const auto point = [&](double way) { return to_cgal(from + way * direction); };
  const Kernel::Segment_3 segment(point(kStart * reach), point(reach));
  double least = reach;
  for (const Triangles::const_iterator hit : boxes_->hits(segment)) {
    const Kernel::Vector_3 normal = hit->supporting_plane().orthogonal_vector();
    const double slope = normal * segment.to_vector();
    if (slope == 0.0) continue;
    const double part = (normal * (hit->vertex(0) - segment.source())) / slope;
    least = std::min(least, reach * (kStart + (1.0 - kStart) * part));
  }
  return least;
}

}  // namespace wireplan::preprocess
