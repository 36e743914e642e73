#include "preprocess/segment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <iomanip>
#include <limits>
#include <optional>
#include <sstream>
#include <string>

namespace wireplan::preprocess {
namespace {

using Voxel = std::array<int, 3>;
using Labels = std::vector<std::uint8_t>;

// ---- grids --------------------------------------------------------------------------------------

Voxel voxel_at(const Grid& grid, std::size_t index) {
  const auto nx = static_cast<std::size_t>(grid.size[0]);
  const auto ny = static_cast<std::size_t>(grid.size[1]);
  return {static_cast<int>(index % nx), static_cast<int>(index / nx % ny),
          static_cast<int>(index / (nx * ny))};
}

std::size_t index_of(const Grid& grid, const Voxel& v) { return grid.index(v[0], v[1], v[2]); }

/// The voxel nearest to a point [mm], if the point lies in the grid (half a voxel round the outer
/// centres included).
std::optional<Voxel> nearest_voxel(const Grid& grid, const Vec3& point) {
  const Vec3 rounded = grid.ijk_from_lps(point).array().round();
  Voxel voxel;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(rounded[axis] >= 0.0 && rounded[axis] < grid.size[axis])) {
      return std::nullopt;
    }
    voxel[axis] = static_cast<int>(rounded[axis]);
  }
  return voxel;
}

/// Voxels first to last, both included.
struct Box {
  Voxel first, last;
};

Box grown(Box box, const Voxel& margin, const Grid& grid) {
  for (int axis = 0; axis < 3; ++axis) {
    box.first[axis] = std::max(0, box.first[axis] - margin[axis]);
    box.last[axis] = std::min(grid.size[axis] - 1, box.last[axis] + margin[axis]);
  }
  return box;
}

Box united(Box a, const Box& b) {
  for (int axis = 0; axis < 3; ++axis) {
    a.first[axis] = std::min(a.first[axis], b.first[axis]);
    a.last[axis] = std::max(a.last[axis], b.last[axis]);
  }
  return a;
}

/// Box of the labelled voxels; `box` where there are none.
Box bounding_box(const Grid& grid, const Labels& labels, Box box) {
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (labels[n] != 0) {
      const Voxel v = voxel_at(grid, n);
      box = united(box, {v, v});
    }
  }
  return box;
}

/// The grid of the box alone.
Grid cropped(const Grid& grid, const Box& box) {
  Grid crop = grid;
  for (int axis = 0; axis < 3; ++axis) {
    crop.size[axis] = box.last[axis] - box.first[axis] + 1;
  }
  crop.origin = grid.lps_from_ijk(Vec3(box.first[0], box.first[1], box.first[2]));
  return crop;
}

/// Index in the whole grid of the first voxel of each row (along i) of the box, in crop order.
template <typename Row>
void for_each_row(const Grid& grid, const Box& box, Row row) {
  for (int k = box.first[2]; k <= box.last[2]; ++k) {
    for (int j = box.first[1]; j <= box.last[1]; ++j) {
      row(grid.index(box.first[0], j, k));
    }
  }
}

// ---- filters ------------------------------------------------------------------------------------

/// Weights of the discrete Gaussian of variance t [voxels^2] for 0, 1, ..., radius: e^-t I_n(t),
/// whose variance is t also where a sampled Gaussian would miss it (Lindeberg 1990).
std::vector<double> gaussian_weights(double t, int radius) {
  std::vector<double> weights;
  double sum = 0.0;
  for (int n = 0; n <= radius; ++n) {
    weights.push_back(std::exp(-t) * std::cyl_bessel_i(n, t));
    sum += (n == 0 ? 1.0 : 2.0) * weights.back();
  }
  for (double& weight : weights) {
    weight /= sum;
  }
  return weights;
}

/// How far the smoothing reaches along an axis [voxels].
int smoothing_radius(double sigma, double spacing) {
  return sigma > 0.0 ? 1 + static_cast<int>(std::ceil(4.0 * sigma / spacing)) : 0;
}

/// Runs a filter along one axis: each voxel of the result is what `add(sum, value, n)` makes of
/// `initial` and the voxels n = -radius to radius steps away. Beyond the border the outermost
/// values go on.
template <typename Add>
void filter_along(const Grid& grid, int axis, int radius, double initial, Add add,
                  std::vector<float>& values) {
  const int nx = grid.size[0], last = grid.size[axis] - 1;
  std::vector<float> result(values.size());
  std::vector<float> padded(static_cast<std::size_t>(nx + 2 * radius));
  std::vector<double> row(static_cast<std::size_t>(nx));
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      // a row of the result comes from whole rows: shifted ones along i, else neighbours
      if (axis == 0) {
        for (int i = -radius; i < nx + radius; ++i) {
          padded[static_cast<std::size_t>(i + radius)] =
              values[grid.index(std::clamp(i, 0, last), j, k)];
        }
      }
      const auto source = [&](int n) -> const float* {
        return axis == 0   ? padded.data() + radius + n
               : axis == 1 ? values.data() + grid.index(0, std::clamp(j + n, 0, last), k)
                           : values.data() + grid.index(0, j, std::clamp(k + n, 0, last));
      };
      std::fill(row.begin(), row.end(), initial);
      for (int n = -radius; n <= radius; ++n) {
        const float* from = source(n);
        for (std::size_t i = 0; i < row.size(); ++i) {
          add(row[i], static_cast<double>(from[i]), n);
        }
      }
      float* to = result.data() + grid.index(0, j, k);
      std::transform(row.begin(), row.end(), to, [](double v) { return static_cast<float>(v); });
    }
  }
  values.swap(result);
}

/// Gaussian of sigma [mm].
void smooth(const Grid& grid, double sigma, std::vector<float>& values) {
  for (int axis = 0; axis < 3; ++axis) {
    const int radius = smoothing_radius(sigma, grid.spacing[axis]);
    const std::vector<double> weights =
        gaussian_weights(std::pow(sigma / grid.spacing[axis], 2), radius);
    filter_along(
        grid, axis, radius, 0.0,
        [&](double& sum, double value, int n) {
          sum += weights[static_cast<std::size_t>(std::abs(n))] * value;
        },
        values);
  }
}

/// Distance [mm] from each voxel's centre to the nearest centre of a voxel that holds `label`;
/// exact up to `limit`, beyond it too large or infinite.
std::vector<float> distance_to(std::uint8_t label, const Grid& grid, const Labels& labels,
                               double limit) {
  // squared distance axis by axis: the smallest of what the neighbours have plus the way there
  std::vector<float> distance(labels.size());
  std::transform(labels.begin(), labels.end(), distance.begin(), [&](std::uint8_t l) {
    return l == label ? 0.0F : std::numeric_limits<float>::infinity();
  });
  for (int axis = 0; axis < 3; ++axis) {
    const double h = grid.spacing[axis];
    filter_along(
        grid, axis, static_cast<int>(std::ceil(limit / h)), std::numeric_limits<double>::infinity(),
        [&](double& nearest, double value, int n) {
          nearest = std::min(nearest, value + n * n * h * h);
        },
        distance);
  }
  std::transform(distance.begin(), distance.end(), distance.begin(),
                 [](float squared) { return std::sqrt(squared); });
  return distance;
}

/// Labels what is reached from the start voxels (whatever they hold) through voxel faces, over
/// voxels for which `inside(index)` holds. Nearer voxels, counted in steps, come first.
template <typename Inside>
Labels flood(const Grid& grid, std::vector<std::size_t> queue, Inside inside) {
  Labels reached(grid.voxels(), 0);
  for (const std::size_t n : queue) {
    reached[n] = 1;
  }
  const std::array<std::size_t, 3> stride = {1, grid.index(0, 1, 0), grid.index(0, 0, 1)};
  for (std::size_t next = 0; next < queue.size(); ++next) {
    const std::size_t n = queue[next];
    const Voxel v = voxel_at(grid, n);
    const auto visit = [&](std::size_t m) {
      if (reached[m] == 0 && inside(m)) {
        reached[m] = 1;
        queue.push_back(m);
      }
    };
    for (int axis = 0; axis < 3; ++axis) {
      if (v[axis] > 0) {
        visit(n - stride[axis]);
      }
      if (v[axis] + 1 < grid.size[axis]) {
        visit(n + stride[axis]);
      }
    }
  }
  return reached;
}

std::size_t count(const Labels& labels) {
  return static_cast<std::size_t>(std::count(labels.begin(), labels.end(), 1));
}

bool on_border(const Grid& grid, const Voxel& v) {
  for (int axis = 0; axis < 3; ++axis) {
    if (v[axis] == 0 || v[axis] == grid.size[axis] - 1) {
      return true;
    }
  }
  return false;
}

/// Labels each part of the background that does not reach the border of the grid through voxel
/// faces and has at most `largest` voxels.
void fill_cavities(const Grid& grid, Labels& labels, double largest) {
  // what the border reaches is no cavity
  std::vector<std::size_t> border;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      const bool all = k == 0 || k == grid.size[2] - 1 || j == 0 || j == grid.size[1] - 1;
      for (int i = 0; i < grid.size[0]; i += all ? 1 : std::max(1, grid.size[0] - 1)) {
        if (labels[grid.index(i, j, k)] == 0) {
          border.push_back(grid.index(i, j, k));
        }
      }
    }
  }
  Labels seen = flood(grid, std::move(border), [&](std::size_t n) { return labels[n] == 0; });

  // collect each cavity on its own
  std::vector<std::size_t> cavity;
  const std::array<std::size_t, 3> stride = {1, grid.index(0, 1, 0), grid.index(0, 0, 1)};
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (labels[n] != 0 || seen[n] != 0) {
      continue;
    }
    cavity.assign(1, n);
    seen[n] = 1;
    for (std::size_t next = 0; next < cavity.size(); ++next) {
      for (const std::size_t step : stride) {
        for (const std::size_t m : {cavity[next] - step, cavity[next] + step}) {  // never border
          if (labels[m] == 0 && seen[m] == 0) {
            seen[m] = 1;
            cavity.push_back(m);
          }
        }
      }
    }
    if (static_cast<double>(cavity.size()) <= largest) {
      for (const std::size_t m : cavity) {
        labels[m] = 1;
      }
    }
  }
}

// ---- seeds --------------------------------------------------------------------------------------

std::string to_text(const Vec3& v) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << "(" << v.x() << ", " << v.y() << ", " << v.z()
       << ")";
  return text.str();
}

std::string to_text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

/// The seeds' voxels. Points of another frame are the usual mistake, so the message looks for it.
std::vector<Voxel> seed_voxels(const Grid& grid, const std::vector<Vec3>& seeds) {
  std::vector<Voxel> voxels;
  for (const Vec3& seed : seeds) {
    const std::optional<Voxel> voxel = nearest_voxel(grid, seed);
    if (!voxel) {
      Vec3 low = grid.origin, high = grid.origin;
      for (int corner = 1; corner < 8; ++corner) {
        const Vec3 p = grid.lps_from_ijk(Vec3((corner & 1) * (grid.size[0] - 1),
                                              (corner >> 1 & 1) * (grid.size[1] - 1),
                                              (corner >> 2) * (grid.size[2] - 1)));
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
      const Vec3 ras(-seed.x(), -seed.y(), seed.z());
      throw Error("seed " + to_text(seed) + " mm lies outside the volume, which spans " +
                  to_text(low) + " to " + to_text(high) + " mm in LPS; " +
                  (nearest_voxel(grid, ras)
                       ? "with x and y negated it lies inside: the point seems to be RAS, as 3D "
                         "Slicer shows it; negate x and y"
                       : "give the point in LPS mm of this volume"));
    }
    voxels.push_back(*voxel);
  }
  return voxels;
}

/// Voxels within `reach` steps along each axis, the voxel itself included.
std::vector<std::size_t> neighbourhood(const Grid& grid, const Voxel& v, int reach) {
  const Box box = grown({v, v}, {reach, reach, reach}, grid);
  std::vector<std::size_t> all;
  for_each_row(grid, box, [&](std::size_t start) {
    for (int i = 0; i <= box.last[0] - box.first[0]; ++i) {
      all.push_back(start + static_cast<std::size_t>(i));
    }
  });
  return all;
}

/// What a value outside the band tells, in words one can act on.
std::string advice(double value, const SegmentOptions& options) {
  if (value > options.upper_hu) {
    return "brighter than the band: bone, calcium or metal, or very dense contrast; move the seed "
           "into the lumen or raise upper_hu";
  }
  if (value < -300.0) {
    return "in CT this is air or lung; move the seed into the lumen and check its frame (LPS mm)";
  }
  if (value < -20.0) {
    return "in CT this is fat; move the seed into the lumen and check its frame (LPS mm)";
  }
  if (value < 100.0 && options.lower_hu >= 100.0) {
    return "in CT this is soft tissue or blood without contrast; move the seed into the lumen, or "
           "take the phase with contrast-filled arteries";
  }
  return "darker than the band; move the seed into the lumen or lower lower_hu";
}

/// Throws unless the value that the band is applied to lies in it at the seed.
void require_in_band(const Image& image, const Vec3& seed, const Voxel& voxel,
                     double smoothed_value, const SegmentOptions& options) {
  if (smoothed_value >= options.lower_hu && smoothed_value <= options.upper_hu) {
    return;
  }
  const std::vector<std::size_t> around = neighbourhood(image.grid, voxel, 1);
  double sum = 0.0;
  for (const std::size_t n : around) {
    sum += image.values[n];
  }
  const double mean = std::round(sum / static_cast<double>(around.size()));
  std::string message = "seed " + to_text(seed) + " mm lies outside the band " +
                        to_text(options.lower_hu) + " to " + to_text(options.upper_hu) +
                        " HU: there the volume has " +
                        to_text(std::round(image.values[index_of(image.grid, voxel)])) +
                        " HU (mean of its neighbourhood " + to_text(mean);
  if (options.smoothing_mm > 0.0) {
    message += ", smoothed " + to_text(std::round(smoothed_value));
  }
  throw Error(message + "): " + advice(smoothed_value, options));
}

// ---- steps --------------------------------------------------------------------------------------

/// The part of the volume that is worked on, and the region found in it.
struct Region {
  Box box;
  Grid grid;
  Labels labels;
  std::vector<std::size_t> seeds;
};

/// Box of what the band alone, without smoothing, connects to the seeds: a first guess.
Box first_box(const Image& image, const std::vector<Voxel>& seeds, const SegmentOptions& options) {
  const auto in_band = [&](std::size_t n) {
    return image.values[n] >= options.lower_hu && image.values[n] <= options.upper_hu;
  };
  Box box = {seeds.front(), seeds.front()};
  std::vector<std::size_t> start;
  for (const Voxel& seed : seeds) {
    box = united(box, {seed, seed});
    for (const std::size_t n : neighbourhood(image.grid, seed, 1)) {
      if (in_band(n)) {
        start.push_back(n);
      }
    }
  }
  return bounding_box(image.grid, flood(image.grid, std::move(start), in_band), box);
}

Region find_in_box(const Image& image, const Box& box, const std::vector<Voxel>& seeds,
                   const SegmentOptions& options) {
  Region region{.box = box, .grid = cropped(image.grid, box), .labels = {}, .seeds = {}};
  std::vector<float> values;
  values.reserve(region.grid.voxels());
  for_each_row(image.grid, box, [&](std::size_t start) {
    const float* first = image.values.data() + start;
    values.insert(values.end(), first, first + region.grid.size[0]);
  });
  if (options.smoothing_mm > 0.0) {
    smooth(region.grid, options.smoothing_mm, values);
  }
  for (std::size_t s = 0; s < seeds.size(); ++s) {
    const Voxel v = {seeds[s][0] - box.first[0], seeds[s][1] - box.first[1],
                     seeds[s][2] - box.first[2]};
    region.seeds.push_back(index_of(region.grid, v));
    require_in_band(image, options.seeds[s], seeds[s], values[region.seeds.back()], options);
  }
  region.labels = flood(region.grid, region.seeds, [&](std::size_t n) {
    return values[n] >= options.lower_hu && values[n] <= options.upper_hu;
  });
  return region;
}

/// Smoothed band, connected to the seeds. The box grows until what was found keeps the reach of
/// the smoothing from its faces, so that the answer is that of the whole volume.
Region find_connected(const Image& image, const SegmentOptions& options) {
  const std::vector<Voxel> seeds = seed_voxels(image.grid, options.seeds);
  Voxel margin;
  for (int axis = 0; axis < 3; ++axis) {
    margin[axis] = 1 + smoothing_radius(options.smoothing_mm, image.grid.spacing[axis]);
  }
  Box box = grown(first_box(image, seeds, options), margin, image.grid);
  for (int doubling = 0;; ++doubling) {
    Region region = find_in_box(image, box, seeds, options);
    Box found = bounding_box(
        region.grid, region.labels,
        {voxel_at(region.grid, region.seeds[0]), voxel_at(region.grid, region.seeds[0])});
    for (int axis = 0; axis < 3; ++axis) {
      found.first[axis] += box.first[axis];
      found.last[axis] += box.first[axis];
    }
    const Box needed = grown(found, margin, image.grid);
    const Box both = united(box, needed);
    if (both.first == box.first && both.last == box.last) {
      return region;
    }
    const int factor = 1 << std::min(doubling, 10);
    box = grown(both, {margin[0] * factor, margin[1] * factor, margin[2] * factor}, image.grid);
  }
}

/// Keeps the part deeper than `neck` that the seeds reach, and what lies within `neck` and a voxel
/// of it inside the region.
void cut_necks(Region& region, double neck, const std::vector<Vec3>& seeds) {
  // specks of noise inside the lumen would count as wall; larger ones (the inside of a bone's
  // shell) stay open, so that the shell is thin and goes
  const double speck = 4.0 / 3.0 * kPi * neck * neck * neck / region.grid.spacing.prod();
  fill_cavities(region.grid, region.labels, std::max(1.0, speck));

  // depth counts from the face between two voxels, half a voxel before the background's centre
  const double core = neck + 0.5 * region.grid.spacing.minCoeff();
  const std::vector<float> depth = distance_to(0, region.grid, region.labels, core);
  const auto is_core = [&](std::size_t n) { return depth[n] >= core; };

  // the core nearest to each seed, and all that is connected to it
  std::vector<std::size_t> start;
  for (const std::size_t seed : region.seeds) {
    std::optional<std::size_t> nearest;
    if (is_core(seed)) {
      nearest = seed;
    } else {
      flood(region.grid, {seed}, [&](std::size_t n) {
        if (!nearest && is_core(n)) {
          nearest = n;
        }
        return !nearest && region.labels[n] != 0;
      });
    }
    if (nearest) {
      start.push_back(*nearest);
    }
  }
  const Labels kept = flood(region.grid, start, is_core);

  // grow back inside the region
  const double reach = neck + region.grid.spacing.maxCoeff();
  const std::vector<float> away = distance_to(1, region.grid, kept, reach);
  region.labels = flood(region.grid, start,
                        [&](std::size_t n) { return region.labels[n] != 0 && away[n] <= reach; });
  for (std::size_t s = 0; s < seeds.size(); ++s) {
    if (start.empty() || region.labels[region.seeds[s]] == 0) {
      throw Error("seed " + to_text(seeds[s]) +
                  " mm lies in a vessel thinner than twice neck_opening_mm (" + to_text(neck) +
                  "), which the opening removes; lower neck_opening_mm or move the seed");
    }
  }
}

}  // namespace

Segmentation segment(const Image& image, const SegmentOptions& options) {
  expects(options.lower_hu < options.upper_hu);
  expects(!options.seeds.empty());
  expects(options.smoothing_mm >= 0.0 && options.neck_opening_mm >= 0.0);
  expects(image.values.size() == image.grid.voxels() && !image.values.empty());

  Region region = find_connected(image, options);
  Segmentation result;
  SegmentStatistics& statistics = result.statistics;
  const double voxel_mm3 = image.grid.spacing.prod();
  if (options.neck_opening_mm > 0.0) {
    const std::size_t before = count(region.labels);
    cut_necks(region, options.neck_opening_mm, options.seeds);
    const std::size_t after = count(region.labels);
    statistics.removed_by_opening_mm3 =
        before > after ? static_cast<double>(before - after) * voxel_mm3 : 0.0;
  }
  fill_cavities(region.grid, region.labels, std::numeric_limits<double>::infinity());

  // back to the full grid
  result.mask.grid = image.grid;
  result.mask.labels.assign(image.grid.voxels(), 0);
  std::size_t n = 0, inside = 0;
  double sum = 0.0;
  for_each_row(image.grid, region.box, [&](std::size_t start) {
    for (int i = 0; i < region.grid.size[0]; ++i, ++n) {
      if (region.labels[n] != 0) {
        const std::size_t whole = start + static_cast<std::size_t>(i);
        result.mask.labels[whole] = 1;
        sum += image.values[whole];
        ++inside;
        statistics.touches_border =
            statistics.touches_border || on_border(image.grid, voxel_at(image.grid, whole));
      }
    }
  });
  statistics.volume_mm3 = static_cast<double>(inside) * voxel_mm3;
  statistics.mean_hu = sum / static_cast<double>(inside);
  return result;
}

bool contains(const Mask& mask, const Vec3& point) {
  const std::optional<Voxel> voxel = nearest_voxel(mask.grid, point);
  return voxel && mask.labels[index_of(mask.grid, *voxel)] != 0;
}

double compute_distance(const Mask& mask, const Vec3& point) {
  const Vec3 p_ijk = mask.grid.ijk_from_lps(point);
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t n = 0; n < mask.labels.size(); ++n) {
    if (mask.labels[n] != 0) {
      const Voxel v = voxel_at(mask.grid, n);
      const Vec3 offset = Vec3(v[0], v[1], v[2]) - p_ijk;
      nearest = std::min(nearest, offset.cwiseProduct(mask.grid.spacing).squaredNorm());
    }
  }
  return std::sqrt(nearest);
}

}  // namespace wireplan::preprocess
