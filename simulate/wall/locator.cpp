#include "simulate/wall/locator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "preprocess/surface/triangle.h"
#include "preprocess/surface/triangle_sides.h"

namespace wireplan::simulate {

namespace {

// Points nearer to the surface than this find their triangle in their own cell [mm].
constexpr double kMargin = 0.4;
// Cells along the longest side of the surface at most: bounds the table of bricks to 8 MB.
constexpr double kMaxCells = 512.0;

/// Mean length of the triangles' edges.
double mean_edge(const Surface& surface) {
  double sum = 0.0;
  for (Eigen::Index f = 0; f < surface.triangles.cols(); ++f) {
    for (int c = 0; c < 3; ++c) {
      sum += (surface.vertices.col(surface.triangles(c, f)) -
              surface.vertices.col(surface.triangles((c + 1) % 3, f)))
                 .norm();
    }
  }
  return sum / (3.0 * static_cast<double>(surface.triangles.cols()));
}

/// How the barycentric weights of the point at which a line meets a triangle's plane change as the
/// line moves, per weight (row) and coordinate [1/mm]. Not finite where it runs along the plane.
Mat3 line_slopes(const std::array<Vec3, 3>& corner, const Vec3& direction) {
  const Vec3 u = corner[1] - corner[0], v = corner[2] - corner[0];
  const double volume = u.cross(v).dot(direction);
  Mat3 slopes;
  slopes.row(1) = v.cross(direction) / volume;
  slopes.row(2) = direction.cross(u) / volume;
  slopes.row(0) = -slopes.row(1) - slopes.row(2);
  return slopes;
}

}  // namespace

/// The nearest triangle of those looked at so far.
struct TriangleLocator::Best {
  double squared_distance;  // not found yet: of the reach
  std::int32_t triangle = -1;
  Vec3 weight = Vec3::Zero();
};

TriangleLocator::TriangleLocator(const Surface& surface, double reach)
    : surface_(surface), reach_(reach), margin_(std::min(reach, kMargin)) {
  expects(surface.triangles.cols() > 0 && reach > 0.0);

  // A grid of cells about as large as the triangles, with room for the reach.
  const Vec3 low = surface.vertices.rowwise().minCoeff().array() - reach,
             high = surface.vertices.rowwise().maxCoeff().array() + reach;
  cell_ = std::max(mean_edge(surface), (high - low).maxCoeff() / kMaxCells);
  origin_ = low;
  for (int d = 0; d < 3; ++d) {
    bricks_[d] = static_cast<int>(std::floor((high[d] - low[d]) / (kSide * cell_))) + 1;
  }
  brick_.assign(static_cast<std::size_t>(bricks_[0]) * static_cast<std::size_t>(bricks_[1]) *
                    static_cast<std::size_t>(bricks_[2]),
                -1);
  register_triangles();
  neighbour_ = preprocess::triangle_neighbours(surface_);
}

std::array<Vec3, 3> TriangleLocator::corners(std::int32_t triangle) const {
  const Eigen::Vector3i t = surface_.triangles.col(triangle);
  return {surface_.vertices.col(t[0]), surface_.vertices.col(t[1]), surface_.vertices.col(t[2])};
}

/// Cells that a box overlaps; low > high beyond the grid.
TriangleLocator::CellBox TriangleLocator::cells_within(const Vec3& low, const Vec3& high) const {
  CellBox box{};
  for (int d = 0; d < 3; ++d) {
    const double cells = static_cast<double>(kSide) * bricks_[d];
    box.low[d] = static_cast<int>(std::clamp((low[d] - origin_[d]) / cell_, 0.0, cells));
    box.high[d] =
        static_cast<int>(std::floor(std::clamp((high[d] - origin_[d]) / cell_, -1.0, cells - 1.0)));
  }
  return box;
}

/// Calls visit(brick, cell within it, i, j, k) for each cell of the box.
template <typename Visit>
void TriangleLocator::for_each_cell(const CellBox& box, const Visit& visit) const {
  for (int k = box.low[2]; k <= box.high[2]; ++k) {
    for (int j = box.low[1]; j <= box.high[1]; ++j) {
      for (int i = box.low[0]; i <= box.high[0]; ++i) {
        const std::size_t brick =
            static_cast<std::size_t>(i / kSide) +
            static_cast<std::size_t>(bricks_[0]) *
                (static_cast<std::size_t>(j / kSide) +
                 static_cast<std::size_t>(bricks_[1]) * static_cast<std::size_t>(k / kSide));
        visit(brick, i % kSide + kSide * (j % kSide + kSide * (k % kSide)), i, j, k);
      }
    }
  }
}

/// Notes each triangle in the cells that have a point within the margin of it, or nearly so.
void TriangleLocator::register_triangles() {
  constexpr int kVolume = kSide * kSide * kSide;
  struct Entry {
    std::int32_t cell, triangle;
  };
  std::vector<Entry> entries;
  std::int32_t slots = 0;
  const double near = margin_ + 0.5 * std::sqrt(3.0) * cell_ * (1.0 + 1e-9);  // of its centre
  for (std::int32_t f = 0; f < surface_.triangles.cols(); ++f) {
    const std::array<Vec3, 3> p = corners(f);
    const Vec3 low = p[0].cwiseMin(p[1]).cwiseMin(p[2]).array() - margin_,
               high = p[0].cwiseMax(p[1]).cwiseMax(p[2]).array() + margin_;
    for_each_cell(cells_within(low, high), [&](std::size_t brick, int cell, int i, int j, int k) {
      const Vec3 centre = origin_ + cell_ * (Vec3(i, j, k).array() + 0.5).matrix();
      if (nearest_on_triangle(centre, p[0], p[1], p[2]).offset.squaredNorm() > near * near) return;
      if (brick_[brick] < 0) brick_[brick] = slots++;
      entries.push_back({brick_[brick] * kVolume + cell, f});
    });
  }

  // Sorted by cell; triangles stay in ascending order.
  start_.assign(static_cast<std::size_t>(slots) * kVolume + 1, 0);
  for (const Entry& entry : entries) ++start_[entry.cell + 1];
  for (std::size_t k = 1; k < start_.size(); ++k) start_[k] += start_[k - 1];
  entry_.resize(entries.size());
  std::vector<std::int32_t> next(start_.begin(), start_.end() - 1);
  for (const Entry& entry : entries) entry_[next[entry.cell]++] = entry.triangle;
}

void TriangleLocator::search(const CellBox& box, const Vec3& point, Best& best) const {
  constexpr int kVolume = kSide * kSide * kSide;
  for_each_cell(box, [&](std::size_t brick, int cell, int, int, int) {
    if (brick_[brick] < 0) return;
    const int slot = brick_[brick] * kVolume + cell;
    for (std::int32_t e = start_[slot]; e < start_[slot + 1]; ++e) {
      const auto [a, b, c] = corners(entry_[e]);
      const NearestOnTriangle found = nearest_on_triangle(point, a, b, c);
      const double squared = found.offset.squaredNorm();
      const bool nearer =
          squared < best.squared_distance ||
          (squared == best.squared_distance && (best.triangle < 0 || entry_[e] < best.triangle));
      if (nearer) best = {squared, entry_[e], found.weight};
    }
  });
}

SurfacePoint TriangleLocator::nearest(const Vec3& point) const {
  if (!point.allFinite()) return {};
  // All triangles within the margin are noted in the point's own cell; one that is further away, in
  // a cell that comes within the margin of it.
  Best best{.squared_distance = reach_ * reach_};
  search(cells_within(point, point), point, best);
  const double distance = std::sqrt(best.squared_distance);
  if (distance > margin_) {
    const Vec3 around = Vec3::Constant(distance - margin_ + 1e-9 * cell_);
    search(cells_within(point - around, point + around), point, best);
  }
  if (best.triangle < 0) return {};
  const Eigen::Vector3i t = surface_.triangles.col(best.triangle);
  const Vec3 weight = best.weight.cwiseMax(0.0);
  return {best.triangle, {t[0], t[1], t[2]}, weight / weight.sum()};
}

SurfacePoint TriangleLocator::pierced(const Vec3& point, const Vec3& direction,
                                      std::int32_t from) const {
  constexpr double kFar = 0.5;  // [mm]
  if (from >= 0) {
    SurfacePoint found = walk(point, direction, from);
    if (found.triangle >= 0 && (position(found) - point).norm() <= kFar) return found;
  }
  SurfacePoint start = nearest(point);
  SurfacePoint found = walk(point, direction, start.triangle);
  return found.triangle >= 0 ? found : start;
}

/// Where the line goes through the surface, from triangle to neighbour; none where that ends
/// nowhere.
SurfacePoint TriangleLocator::walk(const Vec3& point, const Vec3& direction,
                                   std::int32_t triangle) const {
  constexpr int kMostSteps = 10;
  for (int step = 0; step < kMostSteps && triangle >= 0; ++step) {
    const std::array<Vec3, 3> corner = corners(triangle);
    const Mat3 slopes = line_slopes(corner, direction);
    const Vec3 weight = Vec3::UnitX() + slopes * (point - corner[0]);
    if (!weight.allFinite()) break;
    int lowest;
    if (weight.minCoeff(&lowest) >= 0.0) {
      const Eigen::Vector3i t = surface_.triangles.col(triangle);
      return {triangle, {t[0], t[1], t[2]}, weight / weight.sum()};
    }
    triangle = neighbour_((lowest + 1) % 3, triangle);
  }
  return {};
}

Vec3 TriangleLocator::position(const SurfacePoint& at) const {
  const std::array<Vec3, 3> corner = corners(at.triangle);
  return at.weight[0] * corner[0] + at.weight[1] * corner[1] + at.weight[2] * corner[2];
}

Mat3 TriangleLocator::weight_slopes(const SurfacePoint& at, const Vec3& direction) const {
  if (at.triangle < 0) return Mat3::Zero();
  const Mat3 slopes = line_slopes(corners(at.triangle), direction);
  return slopes.allFinite() ? slopes : Mat3(Mat3::Zero());
}

std::size_t TriangleLocator::memory_bytes() const {
  return sizeof(double) * static_cast<std::size_t>(surface_.vertices.size()) +
         2 * sizeof(int) * static_cast<std::size_t>(surface_.triangles.size()) +
         sizeof(std::int32_t) * (brick_.size() + start_.size() + entry_.size());
}

}  // namespace wireplan::simulate
