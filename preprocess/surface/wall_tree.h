#pragma once
/// CGAL's tree of boxes over the triangles of a surface, compiled once.
#include <functional>
#include <memory>

#include "preprocess/vessel.h"

namespace wireplan::preprocess {

/// Triangles have the surface's numbers. Queries may run at once.
class WallTree {
 public:
  /// Triangles without area are left out where `degenerate` is false; one with an area must remain.
  explicit WallTree(const Surface& surface, bool degenerate = false);
  ~WallTree();

  /// Calls for each triangle that meets the segment.
  void for_each_hit(const Vec3& from, const Vec3& to,
                    const std::function<void(Eigen::Index triangle)>& hit) const;

  /// Distance of a point from the surface, found soonest if triangle `near` is near.       [mm]
  double distance(const Vec3& point, Eigen::Index near) const;

  /// Way from a point on the wall along a unit direction to the next wall, at most `reach`. [mm]
  double free_way(const Vec3& from, const Vec3& direction, double reach) const;

 private:
  struct Boxes;
  std::unique_ptr<Boxes> boxes_;
};

}  // namespace wireplan::preprocess
