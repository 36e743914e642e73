#pragma once
/// Which triangle of the vessel's surface a point is at.
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "preprocess/vessel.h"

namespace wireplan::simulate {

/// A point on the surface: in triangle `triangle`, at the weights of its three vertices.
struct SurfacePoint {
  std::int32_t triangle = -1;  // -1: none within reach
  std::array<int, 3> vertex = {0, 0, 0};
  Vec3 weight = Vec3::Zero();  // barycentric, not negative, sum 1
};

/// Finds the nearest triangle to points near the surface. Shared read-only by all trials.
class TriangleLocator {
 public:
  /// Points further than `reach` from the surface are not found [mm].
  explicit TriangleLocator(const Surface& surface, double reach = 1.0);

  /// The point of the surface nearest to `point`; of triangles that are equally near, in the one
  /// of lowest index. Fastest within 0.4 mm of the surface. Allocates nothing.
  SurfacePoint nearest(const Vec3& point) const;

  /// Where the line through `point` along `direction` goes through the surface. Unlike the nearest
  /// point, this does not jump where the surface folds toward `point`. It is found by walking from
  /// triangle to triangle:
  ///   1. from `from`, if one is given;
  ///   2. from the triangle nearest to `point`, if walk 1 leads nowhere or to a place further than
  ///      half a millimetre from `point`.
  /// Where neither leads anywhere, the nearest point is returned.
  SurfacePoint pierced(const Vec3& point, const Vec3& direction, std::int32_t from = -1) const;

  Vec3 position(const SurfacePoint& at) const;  // expects one that was found                [mm]

  /// How the weights of a point that pierced() found change as the line's point moves: a row per
  /// weight, a column per coordinate [1/mm].
  Mat3 weight_slopes(const SurfacePoint& at, const Vec3& direction) const;

  std::size_t memory_bytes() const;

 private:
  static constexpr int kSide = 4;  // cells of a brick along each axis

  struct CellBox {
    std::array<int, 3> low, high;
  };
  struct Best;
  CellBox cells_within(const Vec3& low, const Vec3& high) const;
  template <typename Visit>
  void for_each_cell(const CellBox& box, const Visit& visit) const;
  std::array<Vec3, 3> corners(std::int32_t triangle) const;
  void register_triangles();
  void search(const CellBox& box, const Vec3& point, Best& best) const;
  SurfacePoint walk(const Vec3& point, const Vec3& direction, std::int32_t triangle) const;

  Surface surface_;
  Eigen::Matrix3Xi neighbour_;             // of each triangle, across edges 01, 12, 20
  double reach_, margin_;                  //                                             [mm]
  double cell_ = 0.0;                      // edge of the cells                           [mm]
  Vec3 origin_ = Vec3::Zero();             // of brick (0, 0, 0)                          [mm]
  std::array<int, 3> bricks_ = {0, 0, 0};  // along each axis
  std::vector<std::int32_t> brick_;        // slot of each brick, or -1: no triangle near
  std::vector<std::int32_t> start_;        // of each cell's entries, kSide^3 per slot; and the end
  std::vector<std::int32_t> entry_;        // triangles within the margin of the cell, ascending
};

}  // namespace wireplan::simulate
