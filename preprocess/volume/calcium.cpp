#include "preprocess/volume/calcium.h"

#include <algorithm>
#include <cmath>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {
namespace {

/// How far from the line calcium is looked for, at one of its points [mm].
double reach_at(const Centerline& way, Eigen::Index k, double within) {
  return 1.5 * way.radius(k) + within;
}

/// The voxels that all calcium of the way is in.
Box box_of(const Grid& grid, const Centerline& way, double within) {
  Voxel first = {grid.size[0], grid.size[1], grid.size[2]}, last = {-1, -1, -1};
  double reach = 0.0;
  for (Eigen::Index k = 0; k < way.points.cols(); ++k) {
    const Vec3 ijk = grid.ijk_from_lps(way.points.col(k));
    for (int axis = 0; axis < 3; ++axis) {
      const int at = std::clamp(static_cast<int>(std::lround(ijk(axis))), 0, grid.size[axis] - 1);
      first[axis] = std::min(first[axis], at);
      last[axis] = std::max(last[axis], at);
    }
    reach = std::max(reach, reach_at(way, k, within));
  }
  return grown({first, last}, reach + grid.spacing.maxCoeff(), grid);
}

bool is_beside(const Vec3& point, const Centerline& way, double within) {
  for (Eigen::Index k = 0; k < way.points.cols(); ++k) {
    if ((way.points.col(k) - point).norm() <= reach_at(way, k, within)) return true;
  }
  return false;
}

/// Of the pieces that voxels make by their faces.
Vec3 middle_of_largest(const Grid& grid, Labels& left) {
  std::size_t largest = 0;
  Vec3 middle = Vec3::Zero();
  for (std::size_t start = 0; start < left.size(); ++start) {
    if (left[start] == 0) continue;
    std::vector<std::size_t> piece = {start};
    left[start] = 0;
    for (std::size_t next = 0; next < piece.size(); ++next) {
      for_each_face_neighbour(grid, piece[next], [&](std::size_t m) {
        if (left[m] != 0) piece.push_back(m);
        left[m] = 0;
      });
    }
    if (piece.size() <= largest) continue;
    largest = piece.size();
    Vec3 sum = Vec3::Zero();
    for (const std::size_t n : piece) sum += center_of(grid, n);
    middle = sum / static_cast<double>(piece.size());
  }
  return middle;
}

}  // namespace

Calcium measure_calcium(const Image& image, const Mask& lumen, const Centerline& way,
                        const CalciumOptions& options) {
  expects(image.values.size() == lumen.labels.size() && way.points.cols() > 0);
  const Box box = box_of(image.grid, way, options.within_mm);
  const Grid grid = cropped(image.grid, box);
  const std::vector<float> values = crop_values(image.grid, box, image.values);
  const Labels labels = crop_values(image.grid, box, lumen.labels);
  const std::vector<float> distance = distance_to(1, grid, labels);
  const double farthest = options.within_mm + 0.5 * grid.spacing.mean();
  const auto is_bright = [&](std::size_t n) {
    return static_cast<double>(values[n]) > options.threshold_hu;
  };
  std::size_t beside = 0, inside = 0;
  Labels plaque(values.size(), 0);
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!is_bright(n) || static_cast<double>(distance[n]) > farthest) continue;
    const bool in_lumen = labels[n] != 0;
    bool alone = true;
    for_each_face_neighbour(grid, n, [&](std::size_t m) { alone = alone && !is_bright(m); });
    if (in_lumen && alone) continue;
    const Vec3 at = center_of(grid, n);
    if (!is_beside(at, way, options.within_mm)) continue;
    ++(in_lumen ? inside : beside);
    plaque[n] = in_lumen ? 1 : 0;
  }
  const double voxel = grid.spacing.prod();
  Calcium calcium{.beside = static_cast<double>(beside) * voxel,
                  .inside = static_cast<double>(inside) * voxel};
  if (inside > 0) calcium.inside_at = middle_of_largest(grid, plaque);
  return calcium;
}

}  // namespace wireplan::preprocess
