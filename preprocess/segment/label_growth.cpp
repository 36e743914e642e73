#include "preprocess/segment/label_growth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "preprocess/segment/segment.h"
#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {
namespace {

/// The labelled voxel with most labels round it, near the one that is nearest to the point.
Vec3 middle_near(const Mask& mask, const Vec3& point) {
  constexpr double kReach = 6.0, kRound = 3.0;
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t n = 0; n < mask.labels.size(); ++n) {
    if (mask.labels[n] == 0) continue;
    const double here = (center_of(mask.grid, n) - point).squaredNorm();
    if (here >= least) continue;
    least = here;
    nearest = n;
  }
  Vec3 middle = center_of(mask.grid, nearest);
  std::size_t most = 0;
  for (const std::size_t n : voxels_in_ball(mask.grid, center_of(mask.grid, nearest), kReach)) {
    if (mask.labels[n] == 0) continue;
    std::size_t round = 0;
    for (const std::size_t m : voxels_in_ball(mask.grid, center_of(mask.grid, n), kRound)) {
      round += mask.labels[m];
    }
    if (round <= most) continue;
    most = round;
    middle = center_of(mask.grid, n);
  }
  return middle;
}

}  // namespace

Growth grow_to(const Image& image, const Vec3& point, LabelMask& labels, const MaskLimits& limits) {
  expects(image.values.size() == labels.mask.labels.size());
  constexpr double kWidest = 15.0, kRound = 1.5;
  const Segmentation found = segment(image, {.hounsfield = in_hounsfield(image),
                                             .seeds = {middle_near(labels.mask, point)},
                                             .target = point,
                                             .limits = limits});
  const Grid& grid = labels.mask.grid;
  const std::vector<Vec3>& way = found.statistics.search.route.points;
  const auto voxel_of = [&](const Vec3& p) { return index_of(grid, *nearest_voxel(grid, p)); };

  // What of the way lies beyond the labels.
  std::size_t first = 0;
  bool touched = false;
  Growth growth;
  for (std::size_t k = 0; k < way.size(); ++k) {
    if (!nearest_voxel(grid, way[k]) || labels.mask.labels[voxel_of(way[k])] == 0) continue;
    first = k;
    touched = true;
    growth.from = labels.class_of[voxel_of(way[k])] - 1U;
  }
  if (!touched) {
    throw Error("the way to " + place_text(point) +
                " mm runs beside the labels, expected one that leaves them; draw the artery "
                "between, or choose its class too");
  }
  growth.start = way[first];
  growth.radius_mm = kWidest;

  Labels near(grid.voxels(), 0);
  std::vector<std::size_t> start;
  for (std::size_t k = first; k < way.size(); ++k) {
    if (k > first) growth.length_mm += (way[k] - way[k - 1]).norm();
    const double radius = inscribed_radius(found.mask, way[k], kWidest);
    growth.radius_mm = std::min(growth.radius_mm, radius);
    for (const std::size_t n :
         voxels_in_ball(grid, way[k], kRound * radius + grid.spacing.maxCoeff())) {
      near[n] = found.mask.labels[n];
    }
    if (found.mask.labels[voxel_of(way[k])] != 0) start.push_back(voxel_of(way[k]));
  }
  growth.length_mm += (point - way.back()).norm();  // smoothing takes off the way's end
  const Labels grown = flood(grid, std::move(start), [&](std::size_t n) { return near[n] != 0; });
  std::size_t count = 0;
  for (std::size_t n = 0; n < grown.size(); ++n) {
    if (grown[n] == 0 || labels.mask.labels[n] != 0) continue;
    labels.mask.labels[n] = 1;
    labels.class_of[n] = static_cast<std::uint8_t>(growth.from + 1);
    labels.touches_border = labels.touches_border || on_border(grid, voxel_at(grid, n));
    ++count;
  }
  growth.volume_mm3 = static_cast<double>(count) * grid.spacing.prod();
  labels.volume_mm3 += growth.volume_mm3;
  return growth;
}

}  // namespace wireplan::preprocess
