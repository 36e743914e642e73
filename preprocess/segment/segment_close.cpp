#include "preprocess/segment/segment_close.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "preprocess/segment/mask_shape.h"

namespace wireplan::preprocess {
namespace {

/// What closing adds to the mask.
Labels closing_of(const Grid& grid, double radius, const Labels& labels) {
  const auto reach = static_cast<float>(radius);
  const std::vector<float> away = distance_to(1, grid, labels);
  Labels dilated(labels.size(), 0);
  for (std::size_t n = 0; n < labels.size(); ++n) dilated[n] = away[n] <= reach ? 1 : 0;
  const std::vector<float> depth = distance_to(0, grid, dilated);
  Labels added(labels.size(), 0);
  for (std::size_t n = 0; n < labels.size(); ++n) {
    added[n] = labels[n] == 0 && depth[n] > reach ? 1 : 0;
  }
  return added;
}

/// The Euler number of the mask's part in a box, with and without what is added.
int euler_change(const Grid& grid, const Box& box, const Labels& labels,
                 const std::vector<std::size_t>& added) {
  const Grid small = cropped(grid, box);
  Labels part = crop_values(grid, box, labels);
  const std::ptrdiff_t before = euler_number(small, part);
  for (const std::size_t n : added) {
    const Voxel v = voxel_at(grid, n);
    part[small.index(v[0] - box.first[0], v[1] - box.first[1], v[2] - box.first[2])] = 1;
  }
  return static_cast<int>(euler_number(small, part) - before);
}

}  // namespace

void close_tunnels(const Grid& grid, double radius, const Labels& blocked, Labels& labels) {
  expects(blocked.size() == labels.size());
  Labels added = closing_of(grid, radius, labels);
  for (std::size_t n = 0; n < added.size(); ++n) {
    if (blocked[n] != 0) added[n] = 0;
  }
  for (std::size_t n = 0; n < added.size(); ++n) {
    if (added[n] == 0) continue;
    std::vector<std::size_t> part = {n};
    added[n] = 0;
    Box box = {voxel_at(grid, n), voxel_at(grid, n)};
    for (std::size_t next = 0; next < part.size(); ++next) {
      const Voxel v = voxel_at(grid, part[next]);
      box = united(box, {v, v});
      for_each_face_neighbour(grid, part[next], [&](std::size_t m) {
        if (added[m] == 0) return;
        added[m] = 0;
        part.push_back(m);
      });
    }
    if (euler_change(grid, grown(box, Voxel{1, 1, 1}, grid), labels, part) <= 0) continue;
    for (const std::size_t m : part) labels[m] = 1;
  }
}

}  // namespace wireplan::preprocess
