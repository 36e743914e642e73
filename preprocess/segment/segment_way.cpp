#include "preprocess/segment/segment_way.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <tuple>
#include <utility>

#include "preprocess/segment/segment_leak.h"

namespace wireplan::preprocess {
namespace {

constexpr double kFatHu = -100.0;  // beyond an artery's wall, as dark as it gets
constexpr double kWallMm = 0.9;    // of arteries: aortas have more, their branches less; assumed
constexpr double kCandidatePart = 0.45;  // of the least contrast
constexpr double kBlurMm = 0.6;          // sigma of a scanner's point spread, assumed
constexpr double kVoxelBlur = 0.4;       // sigma that sampling adds, in voxels, about
constexpr double kMemoryMm = 10.0;       // over which a level is followed
constexpr double kLeastSeen = 0.8;       // below, a vessel is too thin to tell its level
constexpr double kMostChange = 0.12;     // of the contrast, that a single place may tell
constexpr double kPartSteps = 200.0;     // of the expected contrast: resolution of brightness
constexpr int kLeastBottleneck = 60;     // of these: 30 %, less joins nothing
constexpr int kSlack = 4;                // of these: ways a little darker than the brightest
constexpr double kSlackNoises = 1.5;     // by which noise alone makes a way's worst place darker
constexpr double kFarNoises = 2.5;       // the same of a way that is cheaper by a quarter
constexpr float kFarCheaper = 0.75F;     // of the cost: less is a detour through another vessel
constexpr double kNoiseLeft = 1.5;       // noise that smoothing leaves, against independent voxels
constexpr double kWideningMm = 40.0;     // that a way may be longer to widen by a factor e less
constexpr double kMeanMm = 1.5;          // sigma of the means that tell a vein from an artery
constexpr double kLeastLevel = 0.95;   // of the level that the points let expect: followed no lower
constexpr float kThinDepthMm = 1.2F;   // vessels of less depth are narrow anyway
constexpr float kWideningFrom = 0.9F;  // of the widest place so far: no more is widening again

/// 1 - exp(-r^2 / (2 sigma^2)): the middle of a blurred cylinder.
double seen_part(double radius, double sigma) {
  return 1.0 - std::exp(-0.5 * radius * radius / (sigma * sigma));
}

/// What the ways are looked for in, at each candidate.
struct WayMap {
  std::vector<float> expected;  // level that the points let expect                        [HU]
  std::vector<float> mean;      // of the voxels round it, those in the middle of vessels most [HU]
  std::vector<float> seen;      // part of the contrast that blur leaves in such a vessel
};

/// What a millimetre through a voxel costs to a way of this level, where `seen` of the contrast is
/// expected and the voxel and the mean round it have these values [HU, mm]. The mean has less noise
/// and so allows for less.
double cost_per_mm(const LumenField& field, double level, double value, double mean, double seen,
                   double radius) {
  constexpr double kFree = 0.12, kLow = 0.06, kHigh = 0.1, kMost = 300.0, kThinMm = 1.2;
  constexpr double kFreeMean = 0.06, kLowMean = 0.05;
  const double contrast = level - field.surroundings;
  const double part = (value - field.surroundings) / contrast;
  const double mean_part = (mean - field.surroundings) / contrast;
  const double low = std::max(0.0, seen - part - kFree) / kLow;
  const double low_mean =
      field.hounsfield ? std::max(0.0, seen - mean_part - kFreeMean) / kLowMean : 0.0;
  const double high = std::max(0.0, part - 1.0 - kFree) / kHigh;
  const double thin = (kThinMm / radius) * (kThinMm / radius);
  return 1.0 + std::min(kMost, low * low + low_mean * low_mean + high * high + thin * thin);
}

/// The level that the points let expect at each candidate: theirs, by 1 / distance^2.
std::vector<float> expected_levels(const LumenField& field, const Candidates& candidates,
                                   const std::vector<WayLevel>& points) {
  std::vector<Vec3> places;
  for (const WayLevel& point : points) places.push_back(center_of(field.grid, point.voxel));
  std::vector<float> expected(candidates.labels.size(), 0.0F);
  for (std::size_t n = 0; n < expected.size(); ++n) {
    if (candidates.labels[n] == 0) continue;
    const Vec3 here = center_of(field.grid, n);
    double sum = 0.0, weights = 0.0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double weight = 1.0 / (1.0 + (places[k] - here).squaredNorm());
      weights += weight;
      sum += weight * static_cast<double>(points[k].level);
    }
    expected[n] = static_cast<float>(sum / weights);
  }
  return expected;
}

/// Means of the candidates round each, by the square of their depth: of a vessel its middle counts.
std::vector<float> local_means(const LumenField& field, const Candidates& candidates) {
  const auto half_voxel = static_cast<float>(0.5 * field.grid.spacing.minCoeff());
  const auto surroundings = static_cast<float>(field.surroundings);
  std::vector<float> mean(field.raw.size(), 0.0F), weight(field.raw.size(), 0.0F);
  for (std::size_t n = 0; n < mean.size(); ++n) {
    if (candidates.labels[n] == 0) continue;
    const float depth = candidates.depth[n] + half_voxel;
    weight[n] = depth * depth;
    mean[n] = weight[n] * (field.raw[n] - surroundings);
  }
  smooth(field.grid, kMeanMm, mean);
  smooth(field.grid, kMeanMm, weight);
  for (std::size_t n = 0; n < mean.size(); ++n) {
    if (candidates.labels[n] != 0) mean[n] = surroundings + mean[n] / weight[n];
  }
  return mean;
}

/// What blur leaves of the contrast at each candidate, by the depth of its deepest neighbour: a
/// place beside a wide one that is narrow for a voxel is a touch, and dark for no blur.
std::vector<float> seen_parts(const LumenField& field, const Candidates& candidates) {
  const LevelRule rule(field);
  std::vector<float> seen(candidates.labels.size(), 0.0F);
  for (std::size_t n = 0; n < seen.size(); ++n) {
    if (candidates.labels[n] == 0) continue;
    float deepest = candidates.depth[n];
    if (field.hounsfield) {
      for_each_neighbour(field.grid, n, [&](std::size_t m, const Voxel&) {
        deepest = std::max(deepest, candidates.depth[m]);
      });
    }
    seen[n] = static_cast<float>(rule.seen(deepest > kThinDepthMm ? deepest : candidates.depth[n]));
  }
  return seen;
}

/// The least of the smoothed values within two voxels of each candidate, between what blur leaves
/// of fat beside a vessel and the surroundings: what its contrast counts from where it is thin.
std::vector<float> dark_beside(const LumenField& field, const Candidates& candidates) {
  const auto most = static_cast<float>(field.surroundings);
  const auto least = static_cast<float>(darkest_beside(field));
  const double reach = 2.01 * std::cbrt(field.grid.spacing.prod());
  std::vector<float> dark(candidates.labels.size(), most);
  for (std::size_t n = 0; n < dark.size(); ++n) {
    if (candidates.labels[n] == 0) continue;
    for (const std::size_t m : voxels_in_ball(field.grid, center_of(field.grid, n), reach)) {
      dark[n] = std::min(dark[n], field.values[m]);
    }
    dark[n] = std::max(dark[n], least);
  }
  return dark;
}

/// Step 1: 0 outside the candidates, else at least 1. The neighbours' contrast counts from `dark`
/// [HU], each voxel's own from the surroundings.
std::vector<std::uint8_t> bright_parts(const LumenField& field, const Candidates& candidates,
                                       const std::vector<float>& expected,
                                       const std::vector<float>& dark) {
  const Grid& grid = field.grid;
  const double reach = 1.01 * grid.spacing.minCoeff();
  const auto part_of = [](float value, float level, double from) {
    return (static_cast<double>(value) - from) / (static_cast<double>(level) - from);
  };
  std::vector<std::uint8_t> parts(candidates.labels.size(), 0);
  for (std::size_t n = 0; n < parts.size(); ++n) {
    if (candidates.labels[n] == 0) continue;
    float least = field.values[n];
    for_each_neighbour(grid, n, [&](std::size_t m, const Voxel& step) {
      const Vec3 away = grid.spacing.cwiseProduct(Vec3(step[0], step[1], step[2]));
      if (away.norm() <= reach) least = std::min(least, field.values[m]);
    });
    const double own = part_of(field.values[n], expected[n], field.surroundings);
    const double part = std::min(own, part_of(least, expected[n], static_cast<double>(dark[n])));
    parts[n] = static_cast<std::uint8_t>(std::clamp(kPartSteps * part, 1.0, 250.0));
  }
  return parts;
}

/// How much darker than the brightest connection a way may be in its worst place, by so many sigma
/// of the noise, in steps of the expected contrast at the darkest point. Of two ways of one level
/// noise decides which has the darker place, and a thin one has more such places: that alone is not
/// to shut it out.
int find_slack(const LumenField& field, const std::vector<WayLevel>& points, double noises) {
  double contrast = std::numeric_limits<double>::infinity();
  for (const WayLevel& point : points) {
    contrast = std::min(contrast, static_cast<double>(point.level) - field.surroundings);
  }
  const double left =
      field.smoothing_mm > 0.0 ? smoothed_noise(field.grid, field.smoothing_mm) : 1.0;
  const double noise = kNoiseLeft * left * field.noise;
  return std::max(kSlack, static_cast<int>(noises * noise / contrast * kPartSteps));
}

/// The largest part such that voxels of it or more join `start` and `end`; 0 where none do.
int find_bottleneck(const Grid& grid, const std::vector<std::uint8_t>& parts, std::size_t start,
                    std::size_t end) {
  std::vector<std::vector<std::size_t>> waiting(256);
  Labels seen(parts.size(), 0);
  seen[start] = 1;
  waiting[parts[start]].push_back(start);
  for (int level = 255; level > 0; --level) {
    std::vector<std::size_t> queue = std::move(waiting[static_cast<std::size_t>(level)]);
    for (std::size_t next = 0; next < queue.size(); ++next) {
      if (queue[next] == end) return level;
      for_each_face_neighbour(grid, queue[next], [&](std::size_t m) {
        if (seen[m] != 0 || parts[m] == 0) return;
        seen[m] = 1;
        (parts[m] >= level ? queue : waiting[parts[m]]).push_back(m);
      });
    }
  }
  return 0;
}

/// How wide a way has been up to a voxel: inscribed radii [mm].
struct WidthSoFar {
  float widest = 0.0F;
  float now = 0.0F;  // after the last narrow place
};

/// The width after a step to where the radius is `here` [mm]; `log_wider` becomes by how much it
/// has widened to what it had been before.
WidthSoFar widen(const WidthSoFar& before, float here, double& log_wider) {
  const float again = std::min(here, kWideningFrom * before.widest);
  WidthSoFar next = {std::max(before.widest, here), std::min(before.now, here)};
  log_wider = 0.0;
  if (again > before.now) {
    log_wider = std::log(static_cast<double>(again / before.now));
    next.now = again;
  }
  if (here >= before.widest) next.now = here;
  return next;
}

/// A way, the least part of its voxels that it was found over, and what it costs [mm].
struct PricedWay {
  std::vector<WayLevel> places;
  int least = 0;
  float cost = 0.0F;
};

/// Step 2 or 3: the cheapest way over voxels of `least` or more. `widening` is the cost of widening
/// again by a factor e [mm].
PricedWay find_way(const LumenField& field, const Candidates& candidates, const WayMap& map,
                   const std::vector<std::uint8_t>& parts, int least, double widening,
                   const WayLevel& start, std::size_t end) {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  const LevelRule rule(field);
  const double half_voxel = 0.5 * field.grid.spacing.minCoeff();
  using Entry = std::pair<float, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  std::vector<float> cost(parts.size(), kFar), levels(parts.size(), 0.0F);
  std::vector<std::uint32_t> before(parts.size());
  std::vector<WidthSoFar> widths(parts.size());
  cost[start.voxel] = 0.0F;
  levels[start.voxel] = start.level;
  const float first = candidates.depth[start.voxel] + static_cast<float>(half_voxel);
  widths[start.voxel] = {first, first};
  queue.push({0.0F, start.voxel});
  while (!queue.empty() && queue.top().second != end) {
    const Entry top = queue.top();
    const std::size_t n = top.second;
    queue.pop();
    if (top.first > cost[n]) continue;
    for_each_neighbour(field.grid, n, [&](std::size_t m, const Voxel& step) {
      if (parts[m] < least) return;
      const double length = field.grid.spacing.cwiseProduct(Vec3(step[0], step[1], step[2])).norm();
      const auto value = static_cast<double>(field.values[m]);
      const double mean = field.hounsfield ? static_cast<double>(map.mean[m]) : value;
      const auto seen = static_cast<double>(map.seen[m]);
      const float radius = candidates.depth[m] + static_cast<float>(half_voxel);
      double wider = 0.0;
      const WidthSoFar width = widen(widths[n], radius, wider);
      const double price = cost_per_mm(field, static_cast<double>(levels[n]), value, mean, seen,
                                       static_cast<double>(radius));
      const auto next =
          static_cast<float>(static_cast<double>(top.first) + length * price + widening * wider);
      if (next >= cost[m]) return;
      cost[m] = next;
      before[m] = static_cast<std::uint32_t>(n);
      levels[m] = rule.follow(levels[n], mean, seen, length);
      if (field.hounsfield) {
        const double contrast = static_cast<double>(map.expected[m]) - field.surroundings;
        const double least_level = field.surroundings + kLeastLevel * contrast;
        levels[m] = std::max(levels[m], static_cast<float>(least_level));
      }
      widths[m] = width;
      queue.push({next, m});
    });
  }
  PricedWay way{.places = {}, .least = least, .cost = cost[end]};
  if (cost[end] == kFar) return way;
  for (std::size_t n = end; n != start.voxel; n = before[n]) way.places.push_back({n, levels[n]});
  way.places.push_back(start);
  std::reverse(way.places.begin(), way.places.end());
  return way;
}

/// Takes all from `parts` but the vessels that the way leads through: from each of its voxels,
/// where the depth rises most is followed to its maximum; the balls that fit in round both are
/// kept.
void keep_vessels(const Grid& grid, const std::vector<float>& depth,
                  const std::vector<WayLevel>& way, std::vector<std::uint8_t>& parts) {
  Labels kept(parts.size(), 0), seen(parts.size(), 0);
  const double voxel = grid.spacing.maxCoeff();
  const auto keep_ball = [&](std::size_t n) {
    if (seen[n] != 0) return;
    seen[n] = 1;
    const double radius = static_cast<double>(depth[n]) + voxel;
    for (const std::size_t m : voxels_in_ball(grid, center_of(grid, n), radius)) kept[m] = 1;
  };
  for (const WayLevel& place : way) {
    keep_ball(place.voxel);
    std::size_t at = place.voxel, best = at;
    do {
      at = best;
      for_each_neighbour(grid, at, [&](std::size_t m, const Voxel&) {
        if (depth[m] > depth[best]) best = m;
      });
    } while (best != at);
    keep_ball(at);
  }
  for (std::size_t n = 0; n < parts.size(); ++n) {
    if (kept[n] == 0) parts[n] = 0;
  }
}

/// The lumen's level at a place of a way and how much it tells: the mean of the middle of the ball
/// that fits in there. Where that holds few voxels, the smoothed value of the place itself: a way
/// seeks bright ones, so it is up to half the noise too high.
std::pair<double, double> level_at(const LumenField& field, const LevelRule& rule, float depth,
                                   std::size_t n) {
  constexpr double kMiddle = 0.6;  // of the radius
  constexpr std::size_t kEnough = 30;
  const std::vector<std::size_t> ball =
      voxels_in_ball(field.grid, center_of(field.grid, n), kMiddle * static_cast<double>(depth));
  double value = static_cast<double>(field.values[n]), seen = rule.seen(depth);
  const double weight = std::pow(seen, 8.0) + 1e-6;
  if (ball.size() >= kEnough) {
    value = 0.0;
    for (const std::size_t m : ball) value += static_cast<double>(field.raw[m]);
    value /= static_cast<double>(ball.size());
    seen = rule.seen_raw(depth);
  }
  return {field.surroundings + (value - field.surroundings) / seen, weight};
}

/// Step 4: thin places, which tell little, count little. A straight line is fitted round each
/// place, not a mean: at the ends of a way, where all that counts lies on one side, the mean of a
/// level that falls is not the level there.
void average_levels(const LumenField& field, const Candidates& candidates,
                    std::vector<WayLevel>& way) {
  constexpr double kSigmaMm = 7.0, kAverageReachMm = 20.0;
  constexpr double kMostSlope = 0.01;  // of the contrast, per mm: more is noise
  constexpr double kWide = 0.8;        // weight beyond which places tell a slope
  const LevelRule rule(field);
  std::vector<double> arc(way.size(), 0.0), value(way.size()), weight(way.size());
  for (std::size_t k = 0; k < way.size(); ++k) {
    const std::size_t n = way[k].voxel;
    if (k > 0) {
      const Vec3 step = center_of(field.grid, n) - center_of(field.grid, way[k - 1].voxel);
      arc[k] = arc[k - 1] + step.norm();
    }
    std::tie(value[k], weight[k]) = level_at(field, rule, candidates.depth[n], n);
  }
  for (std::size_t k = 0, first = 0; k < way.size(); ++k) {
    while (arc[k] - arc[first] > kAverageReachMm) ++first;
    double gauss = 0.0, weights = 0.0, by_arc = 0.0, by_square = 0.0, sum = 0.0, arc_sum = 0.0;
    for (std::size_t m = first; m < way.size() && arc[m] - arc[k] <= kAverageReachMm; ++m) {
      const double beside = arc[m] - arc[k], away = beside / kSigmaMm;
      const double near = std::exp(-0.5 * away * away), w = weight[m] * near;
      gauss += near;
      weights += w;
      by_arc += w * beside;
      by_square += w * beside * beside;
      sum += w * value[m];
      arc_sum += w * beside * value[m];
    }
    const double mean = sum / weights, middle = by_arc / weights;
    const double spread = by_square / weights - middle * middle;
    const double most = kMostSlope * std::max(0.0, mean - field.surroundings);
    const bool is_told = spread > 1.0 && weights > kWide * gauss;
    const double slope =
        is_told ? std::clamp((arc_sum / weights - middle * mean) / spread, -most, most) : 0.0;
    way[k].level = static_cast<float>(mean - slope * middle);
  }
}

}  // namespace

double darkest_beside(const LumenField& field) {
  if (!field.hounsfield) return field.surroundings;
  const double fat = std::erfc(kWallMm / (std::numbers::sqrt2 * LevelRule(field).blur()));
  return field.surroundings + fat * (kFatHu - field.surroundings);
}

LevelRule::LevelRule(const LumenField& field)
    : surroundings_(field.surroundings),
      half_voxel_(0.5 * field.grid.spacing.minCoeff()),
      blur_raw_(std::hypot(kBlurMm, kVoxelBlur * std::cbrt(field.grid.spacing.prod()))),
      blur_(std::hypot(blur_raw_, field.smoothing_mm)) {}

double LevelRule::seen(float depth) const {
  return seen_part(static_cast<double>(depth) + half_voxel_, blur_);
}

double LevelRule::seen_raw(float depth) const {
  return seen_part(static_cast<double>(depth) + half_voxel_, blur_raw_);
}

float LevelRule::follow(float level, double value, double seen, double step) const {
  if (seen < kLeastSeen) return level;
  const double most = kMostChange * (static_cast<double>(level) - surroundings_);
  const double here = surroundings_ + (value - surroundings_) / seen;
  const double change = std::clamp(here - static_cast<double>(level), -most, most);
  return static_cast<float>(static_cast<double>(level) +
                            (1.0 - std::exp(-step / kMemoryMm)) * change);
}

Candidates find_candidates(const LumenField& field, std::vector<std::size_t> starts,
                           double least_contrast) {
  const auto floor = static_cast<float>(field.surroundings + kCandidatePart * least_contrast);
  const auto top = static_cast<float>(field.upper);
  Candidates found;
  found.labels = flood(field.grid, std::move(starts), [&](std::size_t n) {
    return field.values[n] >= floor && field.values[n] <= top;
  });
  found.depth = measure_depth(field.grid, found.labels);
  return found;
}

std::vector<std::vector<WayLevel>> find_level_ways(const LumenField& field,
                                                   const Candidates& candidates,
                                                   const std::vector<WayLevel>& points) {
  expects(!points.empty());
  const WayMap map = {.expected = expected_levels(field, candidates, points),
                      .mean = local_means(field, candidates),
                      .seen = seen_parts(field, candidates)};
  const std::vector<float> even(candidates.labels.size(), static_cast<float>(field.surroundings));
  const std::vector<std::uint8_t> usual = bright_parts(field, candidates, map.expected, even);
  std::vector<std::uint8_t> before_fat;
  const int slack = find_slack(field, points, kSlackNoises);
  const int far_slack = find_slack(field, points, kFarNoises);
  std::vector<std::vector<WayLevel>> ways;
  for (const WayLevel& end : points) {
    const std::vector<std::uint8_t>* parts = &usual;
    const auto bottleneck = [&] {
      return find_bottleneck(field.grid, *parts, points.front().voxel, end.voxel);
    };
    int most = bottleneck();
    if (most < kLeastBottleneck && field.hounsfield) {
      if (before_fat.empty()) {
        before_fat = bright_parts(field, candidates, map.expected, dark_beside(field, candidates));
      }
      parts = &before_fat;
      most = bottleneck();
    }
    ways.emplace_back();
    if (most < kLeastBottleneck) continue;
    const auto cheapest = [&](const std::vector<std::uint8_t>& over, int least, double widening) {
      return find_way(field, candidates, map, over, least, widening, points.front(), end.voxel);
    };
    PricedWay way = cheapest(*parts, std::max(kLeastBottleneck, most - slack), kWideningMm);
    if (far_slack > slack && way.least > kLeastBottleneck) {
      PricedWay darker =
          cheapest(*parts, std::max(kLeastBottleneck, most - far_slack), kWideningMm);
      if (darker.cost < kFarCheaper * way.cost) way = std::move(darker);
    }
    std::vector<std::uint8_t> vessels = *parts;
    keep_vessels(field.grid, candidates.depth, way.places, vessels);
    ways.back() = cheapest(vessels, way.least, 0.0).places;
    average_levels(field, candidates, ways.back());
  }
  return ways;
}

}  // namespace wireplan::preprocess
