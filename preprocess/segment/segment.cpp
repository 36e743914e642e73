#include "preprocess/segment/segment.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "preprocess/segment/mask_shape.h"
#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {
namespace {

constexpr double kTargetReachMm = 3.0;  // how far beside the mask a target may lie
constexpr double kWayMm = 3.0;          // round the way to the target, where way_hu is enough
constexpr double kMostBright = 0.3;     // of the boundary; more is the inside of a bone

// ---- seeds --------------------------------------------------------------------------------------

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

/// What a value outside the band tells, in words one can act on.
std::string advice(double value, const Band& band) {
  if (value > band.upper_hu) {
    return "brighter than the band: bone, calcium or metal, or very dense contrast; move the seed "
           "into the lumen or raise upper_hu";
  }
  if (value < -300.0) {
    return "in CT this is air or lung; move the seed into the lumen and check its frame (LPS mm)";
  }
  if (value < -20.0) {
    return "in CT this is fat; move the seed into the lumen and check its frame (LPS mm)";
  }
  if (value < 100.0 && band.connect_hu >= 100.0) {
    return "in CT this is soft tissue or blood without contrast; move the seed into the lumen, or "
           "take the phase with contrast-filled arteries";
  }
  return "darker than the band; move the seed into the lumen or lower lower_hu";
}

bool in_band(const Band& band, double value) {
  return value >= band.connect_hu && value <= band.upper_hu;
}

/// "160 to 300 HU"
std::string band_text(const Band& band) {
  return to_text(band.connect_hu) + " to " + to_text(band.upper_hu) + " HU";
}

/// Throws unless the value that the band is applied to lies in it at the seed.
void require_in_band(const Image& image, const Vec3& seed, const Voxel& voxel,
                     double smoothed_value, const Band& band) {
  const bool on_way = !band.way.empty() && seed == band.way.back();
  if (smoothed_value >= (on_way ? band.way_hu : band.connect_hu) &&
      smoothed_value <= band.upper_hu) {
    return;
  }
  const std::vector<std::size_t> around = neighbourhood(image.grid, voxel, 1);
  double sum = 0.0;
  for (const std::size_t n : around) {
    sum += static_cast<double>(image.values[n]);
  }
  const double mean = std::round(sum / static_cast<double>(around.size()));
  std::string message =
      "seed " + to_text(seed) + " mm lies outside the band " + band_text(band) +
      ": there the volume has " +
      to_text(std::round(static_cast<double>(image.values[index_of(image.grid, voxel)]))) +
      " HU (mean of its neighbourhood " + to_text(mean);
  if (band.smoothing_mm > 0.0) {
    message += ", smoothed " + to_text(std::round(smoothed_value));
  }
  throw Error(message + "): " + advice(smoothed_value, band));
}

// ---- steps --------------------------------------------------------------------------------------

/// What is looked for, with all choices made.
struct Task {
  Band band;
  std::vector<Vec3> seeds;
  std::optional<Vec3> target;
  std::vector<LumenSample> samples;
};

Task make_task(const Image& image, const SegmentOptions& options) {
  Task task{.band = {}, .seeds = options.seeds, .target = options.target, .samples = {}};
  std::vector<Vec3> points = options.seeds;
  if (options.target) {
    points.push_back(*options.target);
  }
  for (const Vec3& point : points) {
    task.samples.push_back(sample_lumen(image, point));
  }
  if (options.lower_hu) {
    task.band = {.lower_hu = *options.lower_hu,
                 .connect_hu = *options.lower_hu,
                 .upper_hu = *options.upper_hu,
                 .smoothing_mm = options.smoothing_mm.value_or(0.0),
                 .neck_mm = options.neck_opening_mm.value_or(0.0),
                 .way_hu = *options.lower_hu,
                 .way = {}};
  } else {
    task.band = choose_band(image, task.samples, options.target.has_value(), options.smoothing_mm,
                            options.neck_opening_mm);
  }
  for (Vec3& seed : task.seeds) {
    seed = find_lumen_near(image, seed, task.band).value_or(seed);
  }
  if (!task.band.way.empty()) {
    task.seeds.front() = task.band.way.back();
    task.target = task.band.way.front();
  }
  return task;
}

/// The part of the volume that is worked on, and the region found in it.
struct Region {
  Box box;
  Grid grid;
  Labels labels;
  std::vector<float> values;  // smoothed                                                  [HU]
  std::vector<std::size_t> seeds;
};

/// Box of what the band alone, without smoothing, connects to the seeds: a first guess.
Box first_box(const Image& image, const std::vector<Voxel>& seeds, const Band& band) {
  const auto bright = [&](std::size_t n) {
    return in_band(band, static_cast<double>(image.values[n]));
  };
  Box box = {seeds.front(), seeds.front()};
  for (const Vec3& point : band.way) {
    const Voxel v = *nearest_voxel(image.grid, point);
    box = united(box, grown({v, v}, kWayMm, image.grid));
  }
  std::vector<std::size_t> start;
  for (const Voxel& seed : seeds) {
    box = united(box, {seed, seed});
    for (const std::size_t n : neighbourhood(image.grid, seed, 1)) {
      if (bright(n)) {
        start.push_back(n);
      }
    }
  }
  return bounding_box(image.grid, flood(image.grid, std::move(start), bright), box);
}

/// Labels the voxels within `reach` [mm] of any of the points.
Labels mark_near(const Grid& grid, const std::vector<Vec3>& points, double reach) {
  Labels near(grid.voxels(), 0);
  for (const Vec3& point : points) {
    for (const std::size_t n : voxels_in_ball(grid, point, reach)) {
      near[n] = 1;
    }
  }
  return near;
}

Region find_in_box(const Image& image, const Box& box, const std::vector<Voxel>& seeds,
                   const Task& task) {
  Region region{.box = box,
                .grid = cropped(image.grid, box),
                .labels = {},
                .values = crop_values(image.grid, box, image.values),
                .seeds = {}};
  if (task.band.smoothing_mm > 0.0) {
    smooth(region.grid, task.band.smoothing_mm, region.values);
  }
  const auto value_at = [&](std::size_t n) { return static_cast<double>(region.values[n]); };
  for (std::size_t s = 0; s < seeds.size(); ++s) {
    const Voxel v = {seeds[s][0] - box.first[0], seeds[s][1] - box.first[1],
                     seeds[s][2] - box.first[2]};
    region.seeds.push_back(index_of(region.grid, v));
    require_in_band(image, task.seeds[s], seeds[s], value_at(region.seeds.back()), task.band);
  }
  const Labels near_way = mark_near(region.grid, task.band.way, kWayMm);
  region.labels = flood(region.grid, region.seeds, [&](std::size_t n) {
    return value_at(n) >= (near_way[n] != 0 ? task.band.way_hu : task.band.connect_hu) &&
           value_at(n) <= task.band.upper_hu;
  });
  return region;
}

/// Box in the whole grid of what the region holds.
Box found_box(const Region& region) {
  const Voxel seed = voxel_at(region.grid, region.seeds[0]);
  Box found = bounding_box(region.grid, region.labels, {seed, seed});
  for (int axis = 0; axis < 3; ++axis) {
    found.first[axis] += region.box.first[axis];
    found.last[axis] += region.box.first[axis];
  }
  return found;
}

/// Smoothed band, connected to the seeds. The box grows until what was found keeps the reach of
/// the smoothing from its faces, so that the answer is that of the whole volume.
Region find_connected(const Image& image, const Task& task) {
  const std::vector<Voxel> seeds = seed_voxels(image.grid, task.seeds);
  Voxel margin;
  for (int axis = 0; axis < 3; ++axis) {
    margin[axis] = 1 + smoothing_radius(task.band.smoothing_mm, image.grid.spacing[axis]);
  }
  Box box = grown(first_box(image, seeds, task.band), margin, image.grid);
  for (int doubling = 0;; ++doubling) {
    Region region = find_in_box(image, box, seeds, task);
    const Box both = united(box, grown(found_box(region), margin, image.grid));
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
  Labels deep(region.labels.size());
  {
    const std::vector<float> depth = distance_to(0, region.grid, region.labels);
    std::transform(depth.begin(), depth.end(), deep.begin(),
                   [&](float d) { return static_cast<double>(d) >= core ? 1 : 0; });
  }

  // the core nearest to each seed, and all that is connected to it
  std::vector<std::size_t> start;
  for (const std::size_t seed : region.seeds) {
    std::optional<std::size_t> nearest;
    if (deep[seed] != 0) {
      nearest = seed;
    } else {
      flood(region.grid, {seed}, [&](std::size_t n) {
        if (!nearest && deep[n] != 0) {
          nearest = n;
        }
        return !nearest && region.labels[n] != 0;
      });
    }
    if (nearest) {
      start.push_back(*nearest);
    }
  }
  const Labels kept = flood(region.grid, start, [&](std::size_t n) { return deep[n] != 0; });

  // grow back inside the region
  const double reach = neck + region.grid.spacing.maxCoeff();
  const std::vector<float> away = distance_to(1, region.grid, kept);
  region.labels = flood(region.grid, start, [&](std::size_t n) {
    return region.labels[n] != 0 && static_cast<double>(away[n]) <= reach;
  });
  for (std::size_t s = 0; s < seeds.size(); ++s) {
    if (start.empty() || region.labels[region.seeds[s]] == 0) {
      throw Error("seed " + to_text(seeds[s]) +
                  " mm lies in a vessel thinner than twice neck_opening_mm (" + to_text(neck) +
                  "), which the opening removes; lower neck_opening_mm or move the seed");
    }
  }
}

/// The region in a box no larger than its voxels need, and one more on all sides.
Region shrunk(const Region& region, const Grid& whole) {
  const Box box = grown(found_box(region), {1, 1, 1}, whole);
  Box inner = box;
  for (int axis = 0; axis < 3; ++axis) {
    inner.first[axis] = std::max(0, box.first[axis] - region.box.first[axis]);
    inner.last[axis] =
        std::min(region.grid.size[axis] - 1, box.last[axis] - region.box.first[axis]);
  }
  Region small{.box = {},
               .grid = cropped(region.grid, inner),
               .labels = crop_values(region.grid, inner, region.labels),
               .values = crop_values(region.grid, inner, region.values),
               .seeds = {}};
  for (int axis = 0; axis < 3; ++axis) {
    small.box.first[axis] = region.box.first[axis] + inner.first[axis];
    small.box.last[axis] = region.box.first[axis] + inner.last[axis];
  }
  for (const std::size_t seed : region.seeds) {
    const Voxel v = voxel_at(region.grid, seed);
    small.seeds.push_back(
        small.grid.index(v[0] - inner.first[0], v[1] - inner.first[1], v[2] - inner.first[2]));
  }
  return small;
}

/// The region's voxel at the target; throws where it is not connected with the first seed.
std::size_t require_connected(const Image& image, const Region& region, const Task& task,
                              const SegmentOptions& options) {
  const Labels reached = flood(region.grid, {region.seeds.front()},
                               [&](std::size_t n) { return region.labels[n] != 0; });
  std::size_t nearest = region.seeds.front();
  double distance = std::numeric_limits<double>::infinity();
  for (std::size_t n = 0; n < reached.size(); ++n) {
    const double here =
        reached[n] != 0 ? (center_of(region.grid, n) - *task.target).norm() : distance;
    if (here < distance) {
      distance = here;
      nearest = n;
    }
  }
  if (distance <= kTargetReachMm) {
    return nearest;
  }
  const std::optional<Voxel> at = nearest_voxel(image.grid, *options.target);
  throw Error("target " + to_text(*options.target) + " mm is not connected with the access " +
              to_text(options.seeds.front()) + " mm: the nearest point that the lumen reaches is " +
              to_text(center_of(region.grid, nearest)) + " mm, " +
              to_text(std::round(10.0 * distance) / 10.0) + " mm away (values there " +
              band_text(task.band) + ", at the target " +
              to_text(std::round(static_cast<double>(image.values[index_of(image.grid, *at)]))) +
              " HU); if the artery is open between them, lower segmentation.lower_hu or "
              "neck_opening_mm, else take another access or target");
}

/// Adds two layers of voxels next to the region that are at least half as bright as the lumen: what
/// connects is asked for more, so that veins stay out, but the lumen ends at half. Smoothing
/// darkens thin vessels, so the volume's own values count.
void add_rim(const Image& image, Region& region, const Band& band) {
  const std::vector<float> values = crop_values(image.grid, region.box, image.values);
  for (int layer = 0; layer < 2; ++layer) {
    std::vector<std::size_t> rim;
    for (std::size_t n = 0; n < region.labels.size(); ++n) {
      const auto value = static_cast<double>(values[n]);
      if (region.labels[n] != 0 || value < band.lower_hu || value > band.upper_hu) {
        continue;
      }
      bool below = false;
      for_each_face_neighbour(region.grid, n, [&](std::size_t m) {
        below = below || (region.labels[m] != 0 && region.values[m] >= region.values[n]);
      });
      if (below) {
        rim.push_back(n);
      }
    }
    for (const std::size_t n : rim) {
      region.labels[n] = 1;
    }
  }
}

/// Fills pits (five of six neighbours inside) and takes off spikes (at most one inside), twice:
/// what noise leaves on the boundary, and what a surface would fold on.
void smooth_boundary(Region& region) {
  for (int round = 0; round < 2; ++round) {
    const Labels before = region.labels;
    for (std::size_t n = 0; n < before.size(); ++n) {
      int inside = 0, all = 0;
      for_each_face_neighbour(region.grid, n, [&](std::size_t m) {
        inside += before[m];
        ++all;
      });
      if (before[n] == 0 && inside >= 5) {
        region.labels[n] = 1;
      } else if (before[n] != 0 && inside <= 1 && all == 6) {
        region.labels[n] = 0;
      }
    }
  }
}

/// The voxel itself where it is labelled, as almost always: the boundary was smoothed.
std::size_t nearest_labelled(const Region& region, std::size_t voxel) {
  if (region.labels[voxel] != 0) return voxel;
  std::optional<std::size_t> nearest;
  flood(region.grid, {voxel}, [&](std::size_t n) {
    if (!nearest && region.labels[n] != 0) nearest = n;
    return !nearest;
  });
  return nearest.value_or(voxel);
}

/// An artery with plaque or a stent has a few bright neighbours; the inside of a bone, many.
void require_no_bone(const SegmentStatistics& statistics, const Task& task) {
  if (statistics.bright_boundary <= kMostBright) {
    return;
  }
  throw Error("what is connected with " + to_text(task.samples.front().point) + " mm within " +
              band_text(task.band) + " looks like the inside of a bone: " +
              to_text(std::round(100.0 * statistics.bright_boundary)) +
              " % of its surface lies against brighter voxels; move the points into a "
              "contrast-filled artery (the volume may have none)");
}

/// Touches between the seeds and the target are cut, or told.
void part_touches(Region& region, std::vector<std::size_t> ends, const SegmentOptions& options,
                  const Band& band, SegmentStatistics& statistics) {
  for (std::size_t& end : ends) end = nearest_labelled(region, end);
  std::vector<Vec3> kept = options.seeds;
  if (options.target) kept.push_back(*options.target);
  statistics.touches =
      cut_touches(region.grid, region.values, band.lower_hu, ends, kept, region.labels);
  statistics.dipping = statistics.touches.size();
  if (statistics.dipping > 0) {
    statistics.search.route = find_route(region.grid, ends, region.labels);
  }
  constexpr double kSamePlace = 5.0;  // mm
  for (const Touch& touch : find_touches(region.grid, region.labels, ends, kept)) {
    const auto is_there = [&](const Touch& told) {
      return (told.place - touch.place).norm() < kSamePlace;
    };
    const auto& told = statistics.touches;
    if (std::none_of(told.begin(), told.end(), is_there)) statistics.touches.push_back(touch);
  }
}

/// The mask on the full grid, with its statistics.
Mask whole_mask(const Image& image, const Region& region, SegmentStatistics& statistics) {
  Mask mask{.grid = image.grid, .labels = Labels(image.grid.voxels(), 0)};
  std::size_t n = 0;
  for_each_row(image.grid, region.box, [&](std::size_t start) {
    for (int i = 0; i < region.grid.size[0]; ++i, ++n) {
      mask.labels[start + static_cast<std::size_t>(i)] = region.labels[n];
    }
  });
  measure_mask(image, mask, statistics);
  return mask;
}

}  // namespace

Segmentation segment(const Image& image, const SegmentOptions& options) {
  expects(options.lower_hu.has_value() == options.upper_hu.has_value());
  expects(!options.lower_hu || *options.lower_hu < *options.upper_hu);
  expects(!options.seeds.empty());
  expects(options.smoothing_mm.value_or(0.0) >= 0.0 &&
          options.neck_opening_mm.value_or(0.0) >= 0.0);
  expects(image.values.size() == image.grid.voxels() && !image.values.empty());
  seed_voxels(image.grid, options.seeds);
  if (options.target) {
    seed_voxels(image.grid, {*options.target});
  }

  const Task task = make_task(image, options);
  Region region = find_connected(image, task);
  require_no_flood(region.grid, region.labels, options.limits);
  Segmentation result;
  SegmentStatistics& statistics = result.statistics;
  statistics.samples = task.samples;
  statistics.band = task.band;
  if (task.band.neck_mm > 0.0) {
    const std::size_t before = count(region.labels);
    cut_necks(region, task.band.neck_mm, task.seeds);
    const std::size_t after = count(region.labels);
    statistics.removed_by_opening_mm3 =
        before > after ? static_cast<double>(before - after) * image.grid.spacing.prod() : 0.0;
  }

  region = shrunk(region, image.grid);
  fill_cavities(region.grid, region.labels, std::numeric_limits<double>::infinity());
  std::vector<std::size_t> trusted = region.seeds;
  if (task.target) {
    trusted.push_back(require_connected(image, region, task, options));
  }
  statistics.search =
      cut_leaks(region.grid, region.values, task.band.upper_hu, trusted, region.labels);
  if (!options.lower_hu) {
    add_rim(image, region, task.band);
  }
  if (!options.lower_hu) {
    smooth_boundary(region);
  }
  fill_cavities(region.grid, region.labels, std::numeric_limits<double>::infinity());
  statistics.bright_boundary =
      bright_boundary(region.grid, region.values, task.band.upper_hu, region.labels);
  require_no_bone(statistics, task);
  statistics.shape = measure_shape(region.grid, region.labels);
  require_simple(statistics.shape, options.limits, /*by_labels=*/false);
  part_touches(region, trusted, options, task.band, statistics);
  result.mask = whole_mask(image, region, statistics);
  return result;
}

void measure_mask(const Image& image, const Mask& mask, SegmentStatistics& statistics) {
  std::size_t inside = 0;
  double sum = 0.0;
  statistics.touches_border = false;
  for (std::size_t n = 0; n < mask.labels.size(); ++n) {
    if (mask.labels[n] == 0) continue;
    sum += static_cast<double>(image.values[n]);
    ++inside;
    statistics.touches_border =
        statistics.touches_border || on_border(image.grid, voxel_at(image.grid, n));
  }
  statistics.volume_mm3 = static_cast<double>(inside) * image.grid.spacing.prod();
  statistics.mean_hu = sum / static_cast<double>(inside);
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
