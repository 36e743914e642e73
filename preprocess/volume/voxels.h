#pragma once
/// Voxels of a grid: boxes, floods, distances, smoothing. What the steps of the segmentation share;
/// for use in this folder.
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

using Voxel = std::array<int, 3>;
using Labels = std::vector<std::uint8_t>;

inline Voxel voxel_at(const Grid& grid, std::size_t index) {
  const std::size_t slice = grid.index(0, 0, 1), k = index / slice;
  // A slice has room in 32 bits, whose division takes a third of the time.
  const auto in_slice = static_cast<std::uint32_t>(index - k * slice);
  const auto nx = static_cast<std::uint32_t>(grid.size[0]);
  return {static_cast<int>(in_slice % nx), static_cast<int>(in_slice / nx), static_cast<int>(k)};
}

inline std::size_t index_of(const Grid& grid, const Voxel& v) {
  return grid.index(v[0], v[1], v[2]);
}

inline Vec3 center_of(const Grid& grid, std::size_t index) {
  const Voxel v = voxel_at(grid, index);
  return grid.lps_from_ijk(Vec3(v[0], v[1], v[2]));
}

/// The voxel nearest to a point [mm], if the point lies in the grid (half a voxel round the outer
/// centres included).
std::optional<Voxel> nearest_voxel(const Grid& grid, const Vec3& point);

bool on_border(const Grid& grid, const Voxel& v);

/// Voxels first to last, both included.
struct Box {
  Voxel first, last;
};

Box grown(Box box, const Voxel& margin, const Grid& grid);

/// The same with the margin in mm, rounded up to voxels.
Box grown(const Box& box, double margin_mm, const Grid& grid);

Box united(Box a, const Box& b);

/// Box of the labelled voxels; `box` where there are none.
Box bounding_box(const Grid& grid, const Labels& labels, Box box);

/// The grid of the box alone.
Grid cropped(const Grid& grid, const Box& box);

/// Calls row(index in the whole grid of the first voxel) for each row (along i) of the box, in the
/// order of the cropped grid.
template <typename Row>
void for_each_row(const Grid& grid, const Box& box, Row row) {
  for (int k = box.first[2]; k <= box.last[2]; ++k) {
    for (int j = box.first[1]; j <= box.last[1]; ++j) {
      row(grid.index(box.first[0], j, k));
    }
  }
}

/// The values of the box alone, on cropped(grid, box).
template <typename Value>
std::vector<Value> crop_values(const Grid& grid, const Box& box, const std::vector<Value>& values) {
  std::vector<Value> crop;
  crop.reserve(cropped(grid, box).voxels());
  for_each_row(grid, box, [&](std::size_t start) {
    const Value* first = values.data() + start;
    crop.insert(crop.end(), first, first + (box.last[0] - box.first[0] + 1));
  });
  return crop;
}

/// Voxels whose centre lies within `radius` [mm] of the point, in index order; where there is none,
/// as between thick slices, those that the ball touches. Empty where the point is in no voxel.
std::vector<std::size_t> voxels_in_ball(const Grid& grid, const Vec3& point, double radius);

/// Voxels within `reach` steps along each axis, the voxel itself included.
std::vector<std::size_t> neighbourhood(const Grid& grid, const Voxel& v, int reach);

/// Calls visit(neighbour) for the voxels that share a face with voxel n.
template <typename Visit>
void for_each_face_neighbour(const Grid& grid, std::size_t n, Visit visit) {
  const std::array<std::size_t, 3> stride = {1, grid.index(0, 1, 0), grid.index(0, 0, 1)};
  const Voxel v = voxel_at(grid, n);
  for (int axis = 0; axis < 3; ++axis) {
    if (v[axis] > 0) {
      visit(n - stride[axis]);
    }
    if (v[axis] + 1 < grid.size[axis]) {
      visit(n + stride[axis]);
    }
  }
}

/// Calls visit(neighbour, step) for the up to 26 voxels that share a face, edge or corner with
/// voxel n; step is where the neighbour lies from it, -1 to 1 along each axis.
template <typename Visit>
void for_each_neighbour(const Grid& grid, std::size_t n, Visit visit) {
  const Voxel v = voxel_at(grid, n);
  for (int k = std::max(0, v[2] - 1); k <= std::min(grid.size[2] - 1, v[2] + 1); ++k) {
    for (int j = std::max(0, v[1] - 1); j <= std::min(grid.size[1] - 1, v[1] + 1); ++j) {
      for (int i = std::max(0, v[0] - 1); i <= std::min(grid.size[0] - 1, v[0] + 1); ++i) {
        const Voxel step = {i - v[0], j - v[1], k - v[2]};
        if (step != Voxel{0, 0, 0}) visit(grid.index(i, j, k), step);
      }
    }
  }
}

/// Labels what is reached from the start voxels (whatever they hold) through voxel faces, over
/// voxels for which `inside(index)` holds. Nearer voxels, counted in steps, come first.
template <typename Inside>
Labels flood(const Grid& grid, std::vector<std::size_t> queue, Inside inside) {
  Labels reached(grid.voxels(), 0);
  for (const std::size_t n : queue) {
    reached[n] = 1;
  }
  for (std::size_t next = 0; next < queue.size(); ++next) {
    for_each_face_neighbour(grid, queue[next], [&](std::size_t m) {
      if (reached[m] == 0 && inside(m)) {
        reached[m] = 1;
        queue.push_back(m);
      }
    });
  }
  return reached;
}

std::size_t count(const Labels& labels);

/// Of the labelled voxels the one whose centre is nearest to the point, with its distance [mm]: 0
/// where the point lies in that voxel, infinite where none is labelled.
struct NearestLabel {
  std::size_t voxel = 0;
  double distance = std::numeric_limits<double>::infinity();
};
NearestLabel nearest_label(const Grid& grid, const Labels& labels, const Vec3& point);

/// Unlabelled voxels of a row that lie side by side: so many of them from the first on.
struct BackgroundRun {
  std::size_t first = 0, count = 0;
  std::size_t part = 0;  // the first run of what it is connected with; 0: with the grid's border
};

/// What connects voxels: a face they share, or an edge or corner too.
enum class Joined { kByFaces, kByCorners };

/// The background in the order of the voxels, behind a run 0 of no voxels that stands for all that
/// reaches the border of the grid. By runs, of which there are few: a vessel's box is mostly empty.
std::vector<BackgroundRun> find_background(const Grid& grid, const Labels& labels, Joined joined);

/// Labels each part of the background that does not reach the border of the grid through voxel
/// faces and has at most `largest` voxels.
void fill_cavities(const Grid& grid, Labels& labels, double largest);

/// Distance [mm] from each voxel's centre to the nearest centre of a voxel that holds `label`;
/// infinite where none does. Exact: lower envelopes of parabolas, axis by axis (Felzenszwalb and
/// Huttenlocher 2012).
std::vector<float> distance_to(std::uint8_t label, const Grid& grid, const Labels& labels);

/// Gaussian of sigma [mm], its discrete kind (Lindeberg 1990). Beyond the border the outermost
/// values go on.
void smooth(const Grid& grid, double sigma, std::vector<float>& values);

/// How far smooth() reaches along an axis [voxels].
int smoothing_radius(double sigma, double spacing);

/// What smooth() leaves of noise that is independent from voxel to voxel, as a factor.
double smoothed_noise(const Grid& grid, double sigma);

}  // namespace wireplan::preprocess
