#include "preprocess/segment/mask_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace wireplan::preprocess {
namespace {

/// Labels the largest piece, counts all.
Labels find_largest(const Grid& grid, const Labels& labels, std::size_t& pieces) {
  Labels seen(labels.size(), 0);
  std::size_t largest = 0, start_of_largest = 0;
  std::vector<std::size_t> queue;
  for (std::size_t start = 0; start < labels.size(); ++start) {
    if (labels[start] == 0 || seen[start] != 0) continue;
    ++pieces;
    queue.assign(1, start);
    seen[start] = 1;
    for (std::size_t next = 0; next < queue.size(); ++next) {
      for_each_face_neighbour(grid, queue[next], [&](std::size_t m) {
        if (labels[m] == 0 || seen[m] != 0) return;
        seen[m] = 1;
        queue.push_back(m);
      });
    }
    if (queue.size() <= largest) continue;
    largest = queue.size();
    start_of_largest = start;
  }
  if (pieces < 2) return labels;
  return flood(grid, {start_of_largest}, [&](std::size_t n) { return labels[n] != 0; });
}

/// Parts of the background, connected through corners too, that do not reach the grid's border.
std::size_t count_cavities(const Grid& grid, const Labels& labels) {
  const std::vector<BackgroundRun> runs = find_background(grid, labels, Joined::kByCorners);
  std::size_t cavities = 0;
  for (std::size_t n = 1; n < runs.size(); ++n) cavities += runs[n].part == n ? 1 : 0;
  return cavities;
}

/// Voxel centres - pairs that share a face + squares of four - cubes of eight; and the outer faces.
std::ptrdiff_t count_cells(const Grid& grid, const Labels& labels, MaskShape& shape) {
  std::ptrdiff_t euler = 0;
  std::size_t pairs_of_all = 0;
  const std::size_t to_j = grid.index(0, 1, 0), to_k = grid.index(0, 0, 1);
  std::size_t n = 0;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i, ++n) {
        if (labels[n] == 0) continue;
        ++shape.voxels;
        const bool at_i = i + 1 < grid.size[0], at_j = j + 1 < grid.size[1],
                   at_k = k + 1 < grid.size[2];
        const int x = at_i ? labels[n + 1] : 0, y = at_j ? labels[n + to_j] : 0,
                  z = at_k ? labels[n + to_k] : 0;
        const int xy = x != 0 && y != 0 ? labels[n + 1 + to_j] : 0,
                  xz = x != 0 && z != 0 ? labels[n + 1 + to_k] : 0,
                  yz = y != 0 && z != 0 ? labels[n + to_j + to_k] : 0;
        const int cube = xy != 0 && xz != 0 && yz != 0 ? labels[n + 1 + to_j + to_k] : 0;
        euler += 1 - (x + y + z) + (xy + xz + yz) - cube;
        pairs_of_all += static_cast<std::size_t>(x + y + z);
      }
    }
  }
  shape.faces = 6 * shape.voxels - 2 * pairs_of_all;
  return euler;
}

std::string rounded(double value) {
  const double step = std::pow(10.0, std::floor(std::log10(std::max(value, 1e-9))) - 1.0);
  return number_text(std::round(value / step) * step);
}

/// "12", "51 thousand", "5.1 million".
std::string count_text(double count) {
  if (count < 1000.0) return std::to_string(static_cast<int>(count));
  return count < 1e6 ? rounded(count / 1000.0) + " thousand" : rounded(count / 1e6) + " million";
}

/// Whether the handles are as close together as those of noise: a lumen of 3 mm with voxels of
/// 0.7 mm has some 80 voxels in each mm of its length.
bool is_noise(const MaskShape& shape) {
  constexpr double kVoxelsPerHandle = 200.0;
  return static_cast<double>(shape.handles) * kVoxelsPerHandle > static_cast<double>(shape.voxels);
}

struct Most {
  double handles = 0.0, faces = 0.0, voxels = 0.0;
};

/// `noise`: the mask looks like noise, else like more than arteries.
std::string remedy_for(MaskBy by, bool noise) {
  switch (by) {
    case MaskBy::kLabels:
      return "choose the classes that are arteries, and smooth what noise left of them";
    case MaskBy::kBand:
      return noise ? "raise segmentation.smoothing_mm, neck_opening_mm or lower_hu"
                   : "take a narrower band (segmentation.lower_hu, upper_hu) or raise "
                     "neck_opening_mm, so that arteries alone are left";
    case MaskBy::kLevels:
      return noise ? "give a larger segmentation.smoothing_mm or neck_opening_mm than were chosen"
                   : "give a narrow band (segmentation.lower_hu, upper_hu) and neck_opening_mm, so "
                     "that arteries alone are left";
  }
  return "";
}

void refuse_beyond(const MaskShape& shape, const Most& most, const std::string& what, MaskBy by) {
  const bool handles = static_cast<double>(shape.handles) > most.handles,
             faces = static_cast<double>(shape.faces) > most.faces,
             voxels = static_cast<double>(shape.voxels) > most.voxels;
  if (!handles && !faces && !voxels) return;
  const bool noise = is_noise(shape);
  const std::string looks = noise     ? "noise"
                            : handles ? "noise or veins, bone and organs that touch"
                                      : "an organ, bone or the whole body";
  const double limit = handles ? most.handles : faces ? most.faces : most.voxels;
  throw Error(what + " has " + describe_shape(shape) + ": " + looks +
              ", expected a vessel, of at most " + count_text(limit) +
              (handles ? " handles"
               : faces ? " outer faces"
                       : " voxels") +
              "; " + remedy_for(by, noise) + "; if it is a vessel all the same, raise mask." +
              (handles ? "most_handles" : "most_faces"));
}

}  // namespace

MaskShape measure_shape(const Grid& grid, const Labels& labels, Labels* largest) {
  expects(labels.size() == grid.voxels());
  MaskShape shape;
  Labels piece = find_largest(grid, labels, shape.pieces);
  if (shape.pieces > 0) {
    const std::ptrdiff_t euler = count_cells(grid, piece, shape);
    shape.cavities = count_cavities(grid, piece);
    shape.handles =
        static_cast<std::size_t>(1 + static_cast<std::ptrdiff_t>(shape.cavities) - euler);
    shape.volume_mm3 = static_cast<double>(shape.voxels) * grid.spacing.prod();
  }
  if (largest != nullptr) *largest = std::move(piece);
  return shape;
}

std::ptrdiff_t euler_number(const Grid& grid, const Labels& labels) {
  MaskShape shape;
  return count_cells(grid, labels, shape);
}

std::string describe_shape(const MaskShape& shape) {
  constexpr double kMm3PerMl = 1000.0;
  const double ml = shape.volume_mm3 / kMm3PerMl;
  return count_text(static_cast<double>(shape.handles)) +
         (shape.handles == 1 ? " handle (a loop or hole)" : " handles (loops or holes)") + " in " +
         (ml < 1000.0 ? rounded(ml) : count_text(ml)) + " ml (" +
         count_text(static_cast<double>(shape.voxels)) + " voxels with " +
         count_text(static_cast<double>(shape.faces)) + " outer faces)";
}

void require_simple(const MaskShape& shape, const MaskLimits& limits, MaskBy by) {
  refuse_beyond(shape,
                {1.0 * limits.handles, 1.0 * limits.faces, std::numeric_limits<double>::infinity()},
                "the mask", by);
}

void require_no_flood(const Grid& grid, const Labels& labels, const MaskLimits& limits, MaskBy by) {
  constexpr double kHandles = 400.0, kFaces = 20.0, kVoxels = 25.0;
  MaskShape shape;
  const std::ptrdiff_t euler = count_cells(grid, labels, shape);
  shape.handles = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, 1 - euler));
  shape.volume_mm3 = static_cast<double>(shape.voxels) * grid.spacing.prod();
  refuse_beyond(
      shape,
      {kHandles * std::max(1, limits.handles), kFaces * limits.faces, kVoxels * limits.faces},
      by == MaskBy::kBand ? "what the band connects to the points"
                          : "what is connected to the points",
      by);
}

}  // namespace wireplan::preprocess
