#include "preprocess/segment/segment_close.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "preprocess/segment/mask_shape.h"
#include "preprocess/segment/segment_loops.h"

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

/// What is labelled with all that it shares a face or an edge with, along axes of fine voxels.
Labels middle_of(const Grid& grid, const Labels& labels) {
  const auto counts = [&](const Voxel& step) {
    if (step[0] != 0 && step[1] != 0 && step[2] != 0) return false;
    for (int axis = 0; axis < 3; ++axis) {
      if (step[axis] != 0 && grid.spacing[axis] > kFineMm) return false;
    }
    return true;
  };
  Labels middle = labels;
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (labels[n] == 0) continue;
    for_each_neighbour(grid, n, [&](std::size_t m, const Voxel& step) {
      if (labels[m] == 0 && counts(step)) middle[n] = 0;
    });
  }
  return middle;
}

/// With all neighbours and theirs, corners included.
Labels grown_twice(const Grid& grid, Labels labels) {
  for (int round = 0; round < 2; ++round) {
    const Labels before = labels;
    for (std::size_t n = 0; n < before.size(); ++n) {
      if (before[n] == 0) continue;
      for_each_neighbour(grid, n, [&](std::size_t m, const Voxel&) { labels[m] = 1; });
    }
  }
  return labels;
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

void cut_films(const Grid& grid, const std::vector<float>& values, double upper, const Labels& kept,
               Labels& labels) {
  expects(values.size() == labels.size() && kept.size() == labels.size());
  const Labels thick = grown_twice(grid, middle_of(grid, labels));
  const auto is_beside = [&](std::size_t n) {
    constexpr int kBeside = 2;
    const std::vector<std::size_t> round = neighbourhood(grid, voxel_at(grid, n), kBeside);
    return std::any_of(round.begin(), round.end(),
                       [&](std::size_t m) { return static_cast<double>(values[m]) > upper; });
  };
  Labels thin(labels.size(), 0), seen(labels.size(), 0);
  for (std::size_t n = 0; n < labels.size(); ++n) {
    thin[n] = labels[n] != 0 && kept[n] == 0 && thick[n] == 0 ? 1 : 0;
  }
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (thin[n] == 0 || seen[n] != 0) continue;
    const std::vector<std::size_t> part = collect_part(grid, n, thin, seen);
    const auto near = static_cast<std::size_t>(std::count_if(part.begin(), part.end(), is_beside));
    if (2 * near < part.size()) continue;
    for (const std::size_t m : part) labels[m] = 0;
  }
}

}  // namespace wireplan::preprocess
