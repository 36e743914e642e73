#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "preprocess/segment/segment_region.h"

namespace wireplan::preprocess {
namespace {

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

/// Throws unless the value that the band is applied to lies in it at the seed.
void require_in_band(const Image& image, const Vec3& seed, const Voxel& voxel,
                     double smoothed_value, const Band& band) {
  if (in_band(band, smoothed_value)) return;
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

/// Box of what the band alone, without smoothing, connects to the seeds: a first guess.
Box first_box(const Image& image, const std::vector<Voxel>& seeds, const Band& band) {
  const auto bright = [&](std::size_t n) {
    return in_band(band, static_cast<double>(image.values[n]));
  };
  Box box = {seeds.front(), seeds.front()};
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

Region find_in_box(const Image& image, const Box& box, const std::vector<Voxel>& voxels,
                   const std::vector<Vec3>& seeds, const Band& band) {
  Region region{.box = box,
                .grid = cropped(image.grid, box),
                .labels = {},
                .values = crop_values(image.grid, box, image.values),
                .seeds = {}};
  if (band.smoothing_mm > 0.0) {
    smooth(region.grid, band.smoothing_mm, region.values);
  }
  const auto value_at = [&](std::size_t n) { return static_cast<double>(region.values[n]); };
  for (std::size_t s = 0; s < voxels.size(); ++s) {
    const Voxel v = {voxels[s][0] - box.first[0], voxels[s][1] - box.first[1],
                     voxels[s][2] - box.first[2]};
    region.seeds.push_back(index_of(region.grid, v));
    require_in_band(image, seeds[s], voxels[s], value_at(region.seeds.back()), band);
  }
  region.labels =
      flood(region.grid, region.seeds, [&](std::size_t n) { return in_band(band, value_at(n)); });
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
Region find_connected(const Image& image, const std::vector<Vec3>& seeds, const Band& band) {
  const std::vector<Voxel> voxels = seed_voxels(image.grid, seeds);
  Voxel margin;
  for (int axis = 0; axis < 3; ++axis) {
    margin[axis] = 1 + smoothing_radius(band.smoothing_mm, image.grid.spacing[axis]);
  }
  Box box = grown(first_box(image, voxels, band), margin, image.grid);
  for (int doubling = 0;; ++doubling) {
    Region region = find_in_box(image, box, voxels, seeds, band);
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
std::size_t require_connected(const Image& image, const Region& region, const Band& band,
                              const SegmentOptions& options) {
  const Labels reached = flood(region.grid, {region.seeds.front()},
                               [&](std::size_t n) { return region.labels[n] != 0; });
  const NearestLabel nearest = nearest_label(region.grid, reached, *options.target);
  if (nearest.distance <= kTargetReachMm) return nearest.voxel;
  throw not_connected(image, options, *options.target, region.grid, nearest.voxel, band_text(band));
}

}  // namespace

Region find_by_band(const Image& image, const SegmentOptions& options,
                    SegmentStatistics& statistics) {
  Band& band = statistics.band;
  band = {.lower_hu = *options.lower_hu,
          .connect_hu = *options.lower_hu,
          .upper_hu = *options.upper_hu,
          .smoothing_mm = options.smoothing_mm.value_or(0.0),
          .neck_mm = options.neck_opening_mm.value_or(0.0)};
  std::vector<Vec3> seeds = options.seeds;
  for (Vec3& seed : seeds) seed = find_lumen_near(image, seed, band).value_or(seed);
  Region region = find_connected(image, seeds, band);
  require_no_flood(region.grid, region.labels, options.limits, MaskBy::kBand);
  require_wall(region.labels, options.seeds.front(), band);
  if (band.neck_mm > 0.0) {
    const std::size_t before = count(region.labels);
    cut_necks(region, band.neck_mm, seeds);
    const std::size_t after = count(region.labels);
    statistics.removed_by_opening_mm3 =
        before > after ? static_cast<double>(before - after) * image.grid.spacing.prod() : 0.0;
  }
  region = shrunk(region, image.grid);
  fill_cavities(region.grid, region.labels, std::numeric_limits<double>::infinity());
  if (options.target) {
    region.seeds.push_back(require_connected(image, region, band, options));
  }
  statistics.search =
      cut_leaks(region.grid, region.values, band.upper_hu, region.seeds, region.labels);
  region.edge = band.lower_hu;
  return region;
}

}  // namespace wireplan::preprocess
