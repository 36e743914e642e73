#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <optional>
#include <utility>

#include "preprocess/segment/segment_close.h"
#include "preprocess/segment/segment_lumen.h"
#include "preprocess/segment/segment_region.h"
#include "preprocess/vessel.h"

namespace wireplan::preprocess {
namespace {

constexpr double kNearMm = 2.5;              // how far a point may lie beside the lumen it means
constexpr double kStrongContrastHu = 300.0;  // over veins too, most often
constexpr double kCorePart = 0.65, kCorePartStrong = 0.75;  // of the contrast
constexpr double kCorePartElsewhere = 0.5;  // where no CT: values vary more in a vessel
constexpr double kTunnelVoxels = 1.8;       // radius of tunnels that noise makes
// Of the contrast at the brightest point: 45 % of this, 30 % of that, may still be lumen.
constexpr double kLeastOfBrightest = 2.0 / 3.0;
constexpr double kToldMm = 10.0;  // along the way, between the levels that are told

/// The part of the volume within reach of the points, smoothed.
LumenField make_field(const Image& image, const std::vector<Vec3>& points,
                      const SegmentStatistics& statistics, const SegmentOptions& options,
                      Box& box) {
  const Voxel first = *nearest_voxel(image.grid, points.front());
  box = {first, first};
  for (const Vec3& point : points) {
    const Voxel v = *nearest_voxel(image.grid, point);
    box = united(box, {v, v});
  }
  box = grown(box, options.reach_mm, image.grid);
  LumenField field;
  field.grid = cropped(image.grid, box);
  field.raw = crop_values(image.grid, box, image.values);
  field.values = field.raw;
  field.smoothing_mm = statistics.band.smoothing_mm;
  field.surroundings = statistics.band.surroundings_hu;
  field.upper = statistics.band.upper_hu;
  field.hounsfield = options.hounsfield;
  field.core_part = !options.hounsfield                               ? kCorePartElsewhere
                    : statistics.band.contrast_hu > kStrongContrastHu ? kCorePartStrong
                                                                      : kCorePart;
  field.noise = std::numeric_limits<double>::infinity();
  for (const LumenSample& sample : statistics.samples) {
    field.noise = std::min(field.noise, sample.noise_hu);
  }
  if (field.smoothing_mm > 0.0) smooth(field.grid, field.smoothing_mm, field.values);
  return field;
}

/// Takes of the field what may be lumen, and a voxel more on all sides.
void shrink(LumenField& field, Candidates& candidates, Box& box) {
  const Voxel none = {field.grid.size[0], field.grid.size[1], field.grid.size[2]};
  const Box held = bounding_box(field.grid, candidates.labels, {none, {-1, -1, -1}});
  const Box inner = grown(held, Voxel{1, 1, 1}, field.grid);
  field.raw = crop_values(field.grid, inner, field.raw);
  field.values = crop_values(field.grid, inner, field.values);
  candidates.labels = crop_values(field.grid, inner, candidates.labels);
  candidates.depth = crop_values(field.grid, inner, candidates.depth);
  field.grid = cropped(field.grid, inner);
  const Voxel offset = box.first;
  for (int axis = 0; axis < 3; ++axis) {
    box.first[axis] = offset[axis] + inner.first[axis];
    box.last[axis] = offset[axis] + inner.last[axis];
  }
}

/// The piece of what may be lumen that holds a voxel, where that is too small for a vessel, as the
/// rim of plaque is; nothing where it is a vessel.
std::vector<std::size_t> speck_of(const Grid& grid, const Candidates& candidates,
                                  std::size_t start) {
  constexpr double kSpeckMm3 = 15.0;
  const auto most = static_cast<std::size_t>(kSpeckMm3 / grid.spacing.prod()) + 1;
  std::vector<std::size_t> piece = {start};
  for (std::size_t next = 0; next < piece.size(); ++next) {
    for_each_face_neighbour(grid, piece[next], [&](std::size_t m) {
      const bool known = std::find(piece.begin(), piece.end(), m) != piece.end();
      if (candidates.labels[m] != 0 && !known && piece.size() <= most) piece.push_back(m);
    });
    if (piece.size() > most) return {};
  }
  return piece;
}

/// The voxel in the middle of the vessel at a point: of those that may be lumen the nearest within
/// reach, specks left out, and from there uphill in depth as long as it stays so near. Where some
/// within reach are as bright as the vessel that was measured there, all others are another's: a
/// point in the wall between an artery and a vein means the artery.
std::optional<std::size_t> middle_near(const LumenField& field, const Candidates& candidates,
                                       const Vec3& point, double level) {
  constexpr double kAsBright = 0.8;  // of the contrast
  const Grid& grid = field.grid;
  const auto least =
      static_cast<float>(field.surroundings + kAsBright * (level - field.surroundings));
  std::vector<std::size_t> near;
  for (const std::size_t n : voxels_in_ball(grid, point, kNearMm)) {
    if (candidates.depth[n] > 0.0F) near.push_back(n);
  }
  const auto away = [&](std::size_t n) { return (center_of(grid, n) - point).norm(); };
  std::stable_sort(near.begin(), near.end(),
                   [&](std::size_t a, std::size_t b) { return away(a) < away(b); });
  while (!near.empty()) {
    const std::vector<std::size_t> speck = speck_of(grid, candidates, near.front());
    if (speck.empty()) break;
    std::erase_if(near, [&](std::size_t n) {
      return std::find(speck.begin(), speck.end(), n) != speck.end();
    });
  }
  const auto is_bright = [&](std::size_t n) { return field.values[n] >= least; };
  if (field.hounsfield && std::any_of(near.begin(), near.end(), is_bright)) {
    std::erase_if(near, [&](std::size_t n) { return !is_bright(n); });
  }
  if (near.empty()) return {};
  std::size_t best = near.front();
  for (bool climbs = true; climbs;) {
    climbs = false;
    for_each_neighbour(grid, best, [&](std::size_t m, const Voxel&) {
      if (candidates.depth[m] <= candidates.depth[best] ||
          std::find(near.begin(), near.end(), m) == near.end()) {
        return;
      }
      best = m;
      climbs = true;
    });
  }
  return best;
}

/// Fills pits and tunnels (18 of 26 neighbours inside) and takes off spikes (at most one of six),
/// twice: what noise leaves on the boundary, and what a surface would fold on.
void smooth_boundary(const LumenField& field, Labels& labels) {
  constexpr int kRounds = 2, kMostRound = 18;
  const Grid& grid = field.grid;
  for (int round = 0; round < kRounds; ++round) {
    const Labels before = labels;
    Labels inside(labels.size(), 0);  // so many of the neighbours are
    for (std::size_t n = 0; n < before.size(); ++n) {
      if (before[n] == 0) continue;
      int beside = 0, all = 0;
      for_each_neighbour(grid, n, [&](std::size_t m, const Voxel& step) {
        ++inside[m];
        if (std::abs(step[0]) + std::abs(step[1]) + std::abs(step[2]) != 1) return;
        beside += before[m];
        ++all;
      });
      if (beside <= 1 && all == 6) labels[n] = 0;
    }
    for (std::size_t n = 0; n < before.size(); ++n) {
      if (before[n] == 0 && inside[n] >= kMostRound &&
          static_cast<double>(field.values[n]) <= field.upper) {
        labels[n] = 1;
      }
    }
  }
}

/// Takes off what lies on bone like a film, but for the ways' own vessel. In a CT alone: elsewhere
/// the vessel itself may be brighter than its points.
void drop_films(const LumenField& field, const std::vector<std::vector<WayLevel>>& ways,
                Labels& labels) {
  if (!field.hounsfield) return;
  const Grid& grid = field.grid;
  Labels kept(labels.size(), 0);
  const std::vector<float> depth = measure_depth(grid, labels);
  for (const auto& way : ways) {
    for (const WayLevel& place : way) {
      const double reach = static_cast<double>(depth[place.voxel]) + grid.spacing.maxCoeff();
      for (const std::size_t n : voxels_in_ball(grid, center_of(grid, place.voxel), reach)) {
        kept[n] = 1;
      }
    }
  }
  cut_films(grid, field.values, field.upper, kept, labels);
}

/// The levels along a way, every 10 mm and at its end.
void tell_levels(const Grid& grid, const std::vector<WayLevel>& way,
                 std::vector<LevelAlong>& along) {
  double arc = 0.0, told = -kToldMm;
  for (std::size_t k = 0; k < way.size(); ++k) {
    const Vec3 place = center_of(grid, way[k].voxel);
    if (k > 0) arc += (place - center_of(grid, way[k - 1].voxel)).norm();
    if (arc - told < kToldMm && k + 1 < way.size()) continue;
    told = arc;
    along.push_back({place, arc, static_cast<double>(way[k].level)});
  }
}

/// Points of a way with the inscribed radius there.
Centerline line_along(const Grid& grid, const std::vector<float>& depth,
                      const std::vector<WayLevel>& way) {
  std::vector<Vec3> points;
  for (const WayLevel& place : way) points.push_back(center_of(grid, place.voxel));
  points = smooth_line(std::move(points));
  const auto count = static_cast<Eigen::Index>(points.size());
  Centerline line{
      .points = Eigen::Matrix3Xd(3, count), .radius = Eigen::VectorXd(count), .arc_length = {}};
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto place = static_cast<std::size_t>(k);
    line.points.col(k) = points[place];
    line.radius(k) = static_cast<double>(depth[way[place].voxel]);
  }
  line.arc_length = arc_length_of(line.points);
  return line;
}

/// The last way as a route, with the narrowest place of all of them.
Route route_along(const Region& region, const std::vector<float>& depth,
                  const std::vector<std::vector<WayLevel>>& ways, const Centerline& last) {
  Route route;
  std::size_t narrowest = ways.front().front().voxel;
  for (const auto& way : ways) {
    for (const WayLevel& place : way) {
      if (depth[place.voxel] < depth[narrowest]) narrowest = place.voxel;
    }
  }
  for (const Vec3& p : last.points.colwise()) route.points.push_back(p);
  route.length_mm = last.arc_length.tail<1>().value();
  route.narrowest = center_of(region.grid, narrowest);
  route.narrowest_radius_mm = static_cast<double>(depth[narrowest]);
  return route;
}

/// In voxels of 2 mm or more no vessel is seen that is one voxel wide: what such a way leads
/// through is texture.
void require_width(const Grid& grid, const Route& route) {
  constexpr double kCoarseMm = 2.0;
  const double voxel = grid.spacing.minCoeff();
  if (voxel < kCoarseMm || route.narrowest_radius_mm > 0.51 * voxel) return;
  throw Error("the way from access to target is one voxel (" + to_text(voxel) + " mm) wide at " +
              to_text(route.narrowest) +
              " mm, expected two or more: the texture of bone, or voxels too coarse for such an "
              "artery; move the points into a contrast-filled artery, or take a finer volume");
}

/// The points' voxels with their levels; throws where there is no lumen at one.
std::vector<WayLevel> find_points(const LumenField& field, const Candidates& candidates,
                                  const std::vector<Vec3>& points,
                                  const SegmentStatistics& statistics, double least_contrast) {
  std::vector<WayLevel> found;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const std::optional<std::size_t> middle =
        middle_near(field, candidates, points[k], statistics.samples[k].level_hu);
    if (!middle) {
      throw Error("no lumen within 2.5 mm of " + to_text(points[k]) + " mm: expected values from " +
                  to_text(std::round(field.surroundings + least_contrast / 2.0)) + " to " +
                  to_text(std::round(field.upper)) +
                  " HU, as at the other points; move the point into the artery, or give "
                  "segmentation.lower_hu and upper_hu");
    }
    const double level =
        std::max(statistics.samples[k].level_hu, field.surroundings + least_contrast);
    found.push_back({*middle, static_cast<float>(level)});
  }
  return found;
}

}  // namespace

Region find_by_level(const Image& image, const SegmentOptions& options, bool bounded,
                     SegmentStatistics& statistics) {
  std::vector<Vec3> points = options.seeds;
  if (options.target) points.push_back(*options.target);
  Band& band = statistics.band;
  band = choose_band(image, statistics.samples, band.surroundings_hu, options.hounsfield,
                     options.smoothing_mm, options.neck_opening_mm);
  if (!bounded) {
    band.upper_hu =
        static_cast<double>(*std::max_element(image.values.begin(), image.values.end()));
  }
  statistics.along.clear();
  double least = band.contrast_hu;
  for (const LumenSample& sample : statistics.samples) {
    least = std::min(least, sample.level_hu - band.surroundings_hu);
  }
  least = std::max(least, kLeastOfBrightest * band.contrast_hu);

  Region region;
  LumenField field = make_field(image, points, statistics, options, region.box);
  std::vector<std::size_t> starts;
  for (const Vec3& point : points) {
    for (const std::size_t n : voxels_in_ball(field.grid, point, kNearMm)) {
      const auto value = static_cast<double>(field.values[n]);
      if (value >= field.surroundings + 0.5 * least && value <= field.upper) starts.push_back(n);
    }
  }
  Candidates candidates = find_candidates(field, std::move(starts), least);
  require_wall(candidates.labels, points.front(), band);
  find_points(field, candidates, points, statistics, least);  // throws where there is none
  shrink(field, candidates, region.box);
  const std::vector<WayLevel> ends = find_points(field, candidates, points, statistics, least);
  const std::vector<std::vector<WayLevel>> ways = find_level_ways(field, candidates, ends);
  for (std::size_t k = 0; k < ways.size(); ++k) {
    if (!ways[k].empty()) continue;
    const Labels reached = flood(field.grid, {ends.front().voxel},
                                 [&](std::size_t n) { return candidates.labels[n] != 0; });
    throw not_connected(image, options, points[k], field.grid,
                        nearest_label(field.grid, reached, points[k]).voxel, band_text(band));
  }

  for (const WayLevel& end : ends) region.seeds.push_back(end.voxel);
  LocalLumen lumen =
      find_local_lumen(field, candidates, ways, region.seeds, band.neck_mm, options.limits);
  region.grid = field.grid;
  region.labels = std::move(lumen.labels);
  smooth_boundary(field, region.labels);
  close_tunnels(field.grid, kTunnelVoxels * std::cbrt(field.grid.spacing.prod()), lumen.other,
                region.labels);
  drop_films(field, ways, region.labels);
  region.values = std::move(field.values);
  region.labels =
      flood(region.grid, region.seeds, [&](std::size_t n) { return region.labels[n] != 0; });

  double darkest = band.contrast_hu;
  for (const auto& way : ways) {
    tell_levels(region.grid, way, statistics.along);
    for (const WayLevel& place : way) {
      darkest = std::min(darkest, static_cast<double>(place.level) - band.surroundings_hu);
    }
  }
  region.edge = band.surroundings_hu + 0.5 * darkest;
  statistics.doubtful = std::move(lumen.doubtful);
  statistics.branches = std::move(lumen.branches);
  statistics.search.leaks = std::move(lumen.leaks);
  const std::vector<float> depth = measure_depth(region.grid, region.labels);
  statistics.way_doubts = find_way_doubts(field, depth, ways);
  statistics.ways.clear();
  for (const auto& way : ways) statistics.ways.push_back(line_along(region.grid, depth, way));
  statistics.search.route = route_along(region, depth, ways, statistics.ways.back());
  std::erase_if(statistics.ways, [](const Centerline& line) { return line.points.cols() < 2; });
  require_width(region.grid, statistics.search.route);
  return region;
}

}  // namespace wireplan::preprocess
