#include "preprocess/segment/segment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "preprocess/segment/segment_region.h"

namespace wireplan::preprocess {
namespace {

constexpr double kMostBright = 0.3;  // of the boundary; more is the inside of a bone
constexpr int kThinLoops = 4;        // times the handles that may be left, may be cut
constexpr double kThinVoxels = 1.6;  // inscribed radius of a loop that is cut

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
void require_no_bone(const SegmentStatistics& statistics) {
  if (statistics.bright_boundary <= kMostBright) {
    return;
  }
  throw Error("what is connected with " + to_text(statistics.samples.front().point) +
              " mm within " + band_text(statistics.band) + " looks like the inside of a bone: " +
              to_text(std::round(100.0 * statistics.bright_boundary)) +
              " % of its surface lies against brighter voxels; move the points into a "
              "contrast-filled artery (the volume may have none)");
}

/// Touches between the seeds and the target are cut, or told.
void part_touches(Region& region, std::vector<std::size_t> ends, const SegmentOptions& options,
                  SegmentStatistics& statistics) {
  for (std::size_t& end : ends) end = nearest_labelled(region, end);
  std::vector<Vec3> kept = options.seeds;
  if (options.target) kept.push_back(*options.target);
  statistics.touches =
      cut_touches(region.grid, region.values, region.edge, ends, kept, region.labels);
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

std::string band_text(const Band& band) {
  return to_text(band.connect_hu) + " to " + to_text(band.upper_hu) + " HU";
}

void require_wall(const Labels& labels, const Vec3& point, const Band& band) {
  if (std::find(labels.begin(), labels.end(), 0) != labels.end()) return;
  throw Error("what is connected with " + to_text(point) + " mm within " + band_text(band) +
              " fills all of the volume that is looked at, expected a vessel with something darker "
              "or brighter round it; give a narrower band (segmentation.lower_hu, upper_hu), or a "
              "volume that shows what lies round the vessel");
}

Error not_connected(const Image& image, const SegmentOptions& options, const Vec3& point,
                    const Grid& grid, std::size_t nearest, const std::string& values) {
  const Voxel at = *nearest_voxel(image.grid, point);
  const Vec3 reached = center_of(grid, nearest);
  const std::string remedy = options.lower_hu
                                 ? "lower segmentation.lower_hu or neck_opening_mm"
                                 : "give segmentation.lower_hu and upper_hu, which were chosen";
  return Error("target " + to_text(point) + " mm is not connected with the access " +
               to_text(options.seeds.front()) +
               " mm: the nearest point that the lumen reaches is " + to_text(reached) + " mm, " +
               to_text(std::round(10.0 * (reached - point).norm()) / 10.0) +
               " mm away (values there " + values + ", at the target " +
               to_text(std::round(static_cast<double>(image.values[index_of(image.grid, at)]))) +
               " HU); if the artery is open between them, " + remedy +
               ", else take another access or target");
}

Segmentation segment(const Image& image, const SegmentOptions& options) {
  expects(options.lower_hu.has_value() == options.upper_hu.has_value());
  expects(!options.lower_hu || *options.lower_hu < *options.upper_hu);
  expects(!options.seeds.empty());
  expects(options.smoothing_mm.value_or(0.0) >= 0.0 &&
          options.neck_opening_mm.value_or(0.0) >= 0.0 && options.reach_mm > 0.0);
  expects(image.values.size() == image.grid.voxels() && !image.values.empty());
  std::vector<Vec3> points = options.seeds;
  if (options.target) points.push_back(*options.target);
  seed_voxels(image.grid, points);

  Segmentation result;
  SegmentStatistics& statistics = result.statistics;
  const double surroundings = find_surroundings(image, points, options.hounsfield);
  for (const Vec3& point : points) {
    statistics.samples.push_back(sample_lumen(image, point, surroundings));
  }
  if (options.hounsfield && !options.lower_hu) {
    sample_beside_calcium(image, surroundings, statistics.samples);
  }
  statistics.band.surroundings_hu = surroundings;
  const auto find_region = [&](bool bounded) {
    Region found = options.lower_hu ? find_by_band(image, options, statistics)
                                    : find_by_level(image, options, bounded, statistics);
    fill_cavities(found.grid, found.labels, std::numeric_limits<double>::infinity());
    statistics.bright_boundary =
        bright_boundary(found.grid, found.values, statistics.band.upper_hu, found.labels);
    return found;
  };
  Region region = find_region(/*bounded=*/true);
  // What is brighter than the points is no bone where no CT: the vessel itself is.
  if (!options.hounsfield && !options.lower_hu && statistics.bright_boundary > kMostBright) {
    region = find_region(/*bounded=*/false);
  }
  require_no_bone(statistics);
  statistics.shape = measure_shape(region.grid, region.labels);
  MaskLimits limits = options.limits;
  if (!options.lower_hu) {
    constexpr int kMost = std::numeric_limits<int>::max() / kThinLoops;
    limits.handles = kThinLoops * std::min(limits.handles, kMost);
  }
  const MaskBy by = options.lower_hu ? MaskBy::kBand : MaskBy::kLevels;
  require_simple(statistics.shape, limits, by);
  part_touches(region, region.seeds, options, statistics);
  if (!options.lower_hu) {
    const double thin = kThinVoxels * std::cbrt(region.grid.spacing.prod());
    statistics.loops = cut_loops(region.grid, nearest_labelled(region, region.seeds.front()),
                                 statistics.search.route.points, thin, region.labels);
    statistics.shape = measure_shape(region.grid, region.labels);
    require_simple(statistics.shape, options.limits, by);
  }
  result.mask = whole_mask(image, region, statistics);
  return result;
}

bool looks_hounsfield(double least, double largest) {
  constexpr double kAir = -50.0, kMostHu = 700.0;
  return least < kAir || largest < kMostHu;
}

bool in_hounsfield(const Image& image) {
  if (!image.modality.empty()) return image.modality == "CT";
  const auto [least, largest] = std::minmax_element(image.values.begin(), image.values.end());
  return looks_hounsfield(static_cast<double>(*least), static_cast<double>(*largest));
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
  return nearest_label(mask.grid, mask.labels, point).distance;
}

}  // namespace wireplan::preprocess
