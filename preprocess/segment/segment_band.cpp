#include "preprocess/segment/segment_band.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {
namespace {

constexpr double kSurroundingsHu = 50.0;
constexpr double kLeastLevelHu = 150.0;  // 100 HU of contrast; arterial phases have 200 and more
constexpr double kMostNoisePart = 0.35;  // of the contrast; more is marrow, or no image to plan on
constexpr double kCalciumHu = 800.0;     // references B5: arterial phase, calcium above
constexpr double kSnapMm = 2.5;          // how far a point may lie beside the lumen it means
constexpr double kNoiseMm = 10.0;        // ball in which noise is measured
constexpr double kApartMm = 1.2;
constexpr double kLumenMm = 4.0;  // ball in which the lumen's values are taken
constexpr std::size_t kLeastSample = 30;
constexpr double kSearchMm = 60.0;  // round the ends, for the way between them
constexpr double kConnectPart = 0.75, kLeastConnectPart = 0.3, kUpperPart = 0.4, kNoisePart = 0.05;
constexpr double kNeckMm = 0.5;

double median_of(std::vector<double> values) {
  expects(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Sigma of the noise from second differences along i, whose variance is 6 times that of
/// independent noise; 1.4826 makes a sigma of a median. Reconstruction correlates neighbours, so
/// the differences are of voxels more than a millimetre apart.
double measure_noise(const Image& image, const Vec3& point) {
  std::vector<double> differences;
  const int step = static_cast<int>(std::ceil(kApartMm / image.grid.spacing[0]));
  for (const std::size_t n : voxels_in_ball(image.grid, point, kNoiseMm)) {
    const int i = voxel_at(image.grid, n)[0];
    if (i >= step && i + step < image.grid.size[0]) {
      differences.push_back(
          std::abs(static_cast<double>(image.values[n - static_cast<std::size_t>(step)]) -
                   2.0 * image.values[n] +
                   static_cast<double>(image.values[n + static_cast<std::size_t>(step)])));
    }
  }
  return differences.empty() ? 0.0 : 1.4826 * median_of(std::move(differences)) / std::sqrt(6.0);
}

double median_near(const Image& image, const Vec3& center) {
  const double radius = std::max(1.0, 1.01 * image.grid.spacing.minCoeff());
  std::vector<double> values;
  for (const std::size_t n : voxels_in_ball(image.grid, center, radius)) {
    values.push_back(static_cast<double>(image.values[n]));
  }
  return median_of(std::move(values));
}

/// Offsets of the voxels round one that have to be lumen as well where it is deeper than the neck.
std::vector<Voxel> neck_ball(const Grid& grid, double neck) {
  const double radius = neck + 0.5 * grid.spacing.minCoeff();
  Voxel reach;
  for (int axis = 0; axis < 3; ++axis) {
    reach[axis] = static_cast<int>(radius / grid.spacing[axis]);
  }
  std::vector<Voxel> ball;
  for (int k = -reach[2]; k <= reach[2]; ++k) {
    for (int j = -reach[1]; j <= reach[1]; ++j) {
      for (int i = -reach[0]; i <= reach[0]; ++i) {
        if (grid.spacing.cwiseProduct(Vec3(i, j, k)).norm() < radius) {
          ball.push_back({i, j, k});
        }
      }
    }
  }
  return ball;
}

/// A part of the volume, smoothed, each voxel with the least value of the ball round it; what is
/// brighter than the band counts as dark.
struct Eroded {
  Box box;
  Grid grid;
  std::vector<float> values;
};

Eroded erode(const Image& image, const Box& box, const Band& band, double floor) {
  // smoothed with a margin, so that the answer does not depend on the box
  Box wide = box;
  for (int axis = 0; axis < 3; ++axis) {
    Voxel margin = {0, 0, 0};
    margin[axis] = smoothing_radius(band.smoothing_mm, image.grid.spacing[axis]) + 2;
    wide = grown(wide, margin, image.grid);
  }
  const Grid grid = cropped(image.grid, wide);
  std::vector<float> values = crop_values(image.grid, wide, image.values);
  if (band.smoothing_mm > 0.0) {
    smooth(grid, band.smoothing_mm, values);
  }
  constexpr float kDark = std::numeric_limits<float>::lowest();
  for (float& value : values) {
    value = value > static_cast<float>(band.upper_hu) ? kDark : value;
  }

  const std::vector<Voxel> ball = neck_ball(grid, band.neck_mm);
  Eroded eroded{.box = wide, .grid = grid, .values = std::vector<float>(values.size(), kDark)};
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (values[n] < static_cast<float>(floor)) {
      continue;
    }
    const Voxel v = voxel_at(grid, n);
    float least = values[n];
    for (const Voxel& offset : ball) {
      const Voxel w = {v[0] + offset[0], v[1] + offset[1], v[2] + offset[2]};
      if (std::min({w[0], w[1], w[2]}) >= 0 && w[0] < grid.size[0] && w[1] < grid.size[1] &&
          w[2] < grid.size[2]) {
        least = std::min(least, values[index_of(grid, w)]);
      }
    }
    eroded.values[n] = least;
  }
  return eroded;
}

/// The brightest voxel within reach of the point.
std::optional<std::size_t> brightest_near(const Eroded& eroded, const Vec3& point, double floor) {
  std::optional<std::size_t> best;
  for (const std::size_t n : voxels_in_ball(eroded.grid, point, kSnapMm)) {
    if (eroded.values[n] >= static_cast<float>(floor) &&
        (!best || eroded.values[n] > eroded.values[*best])) {
      best = n;
    }
  }
  return best;
}

/// Of all ways from `start` to `end` over values of `floor` or more, one whose least value is
/// largest, to a whole HU; empty where there is none. Floods level by level, from bright to dark.
std::vector<std::size_t> brightest_way(const Eroded& eroded, std::size_t start, std::size_t end,
                                       double floor) {
  const auto level_of = [&](std::size_t n) {
    return static_cast<std::size_t>(static_cast<double>(eroded.values[n]) - floor);
  };
  constexpr auto kUnseen = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> before(eroded.values.size(), kUnseen);
  std::vector<std::vector<std::size_t>> waiting(level_of(start) + 1);
  waiting.back().push_back(start);
  before[start] = static_cast<std::uint32_t>(start);
  for (std::size_t level = waiting.size(); level-- > 0 && before[end] == kUnseen;) {
    std::vector<std::size_t> queue = std::move(waiting[level]);
    for (std::size_t next = 0; next < queue.size(); ++next) {
      for_each_face_neighbour(eroded.grid, queue[next], [&](std::size_t m) {
        if (before[m] == kUnseen && eroded.values[m] >= static_cast<float>(floor)) {
          before[m] = static_cast<std::uint32_t>(queue[next]);
          (level_of(m) >= level ? queue : waiting[level_of(m)]).push_back(m);
        }
      });
    }
  }
  std::vector<std::size_t> way;
  if (before[end] != kUnseen) {
    for (std::size_t n = end; n != start; n = before[n]) {
      way.push_back(n);
    }
    way.push_back(start);
  }
  return way;
}

Box box_round(const Image& image, const std::vector<Vec3>& points, double margin) {
  std::optional<Box> box;
  for (const Vec3& point : points) {
    const std::optional<Voxel> v = nearest_voxel(image.grid, point);
    expects(v.has_value());
    box = box ? united(*box, {*v, *v}) : Box{*v, *v};
  }
  return grown(*box, margin, image.grid);
}

/// Level and noise from the voxels near the middle that have lumen all round them, if there are
/// enough of them.
void measure_lumen(const Image& image, const Eroded& eroded, const Vec3& middle, double floor,
                   LumenSample& sample) {
  std::vector<double> values;
  for (const std::size_t n : voxels_in_ball(eroded.grid, middle, kLumenMm)) {
    if (eroded.values[n] >= static_cast<float>(floor)) {
      const std::optional<Voxel> v = nearest_voxel(image.grid, center_of(eroded.grid, n));
      values.push_back(static_cast<double>(image.values[index_of(image.grid, *v)]));
    }
  }
  if (values.size() < kLeastSample) {
    sample.level_hu = median_near(image, middle);
    return;
  }
  sample.level_hu = median_of(values);
  for (double& value : values) {
    value = std::abs(value - sample.level_hu);
  }
  sample.noise_hu = std::min(sample.noise_hu, 1.4826 * median_of(std::move(values)));
}

/// Contacts thinner than twice this are no vessel: with less than one voxel it would ask nothing.
double neck_of(const Grid& grid) { return std::max(kNeckMm, 0.501 * grid.spacing.minCoeff()); }

}  // namespace

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

LumenSample sample_lumen(const Image& image, const Vec3& point) {
  LumenSample sample{.point = point,
                     .level_hu = median_near(image, point),
                     .noise_hu = measure_noise(image, point)};
  if (sample.level_hu < kLeastLevelHu) {
    return sample;
  }

  // the middle of the vessel nearby tells more than a point near the wall
  const double half = kSurroundingsHu + 0.5 * (sample.level_hu - kSurroundingsHu);
  const Band like_lumen{.lower_hu = half,
                        .connect_hu = half,
                        .upper_hu = kCalciumHu,
                        .smoothing_mm = 0.0,
                        .neck_mm = neck_of(image.grid),
                        .way_hu = half,
                        .way = {}};
  const Eroded eroded =
      erode(image, box_round(image, {point}, kSnapMm + kLumenMm), like_lumen, half);
  if (const std::optional<std::size_t> center = brightest_near(eroded, point, half)) {
    measure_lumen(image, eroded, center_of(eroded.grid, *center), half, sample);
  }
  return sample;
}

Band choose_band(const Image& image, const std::vector<LumenSample>& samples, bool to_target,
                 std::optional<double> smoothing_mm, std::optional<double> neck_mm) {
  expects(!samples.empty());
  double level = 0.0, noise = std::numeric_limits<double>::infinity();
  for (const LumenSample& sample : samples) {
    if (sample.level_hu < kLeastLevelHu) {
      throw Error("no contrast-filled artery at " + to_text(sample.point) + " mm: the volume has " +
                  to_text(std::round(sample.level_hu)) + " HU there (median), expected at least " +
                  to_text(kLeastLevelHu) +
                  " HU; take the arterial phase of a CT with contrast, or move the point into the "
                  "lumen, or, if this is no CT, give segmentation.lower_hu and upper_hu");
    }
    level = std::max(level, sample.level_hu);
    noise = std::min(noise, sample.noise_hu);
  }

  const double contrast = level - kSurroundingsHu;
  if (noise > kMostNoisePart * contrast) {
    throw Error("the values round " + to_text(samples.front().point) + " mm scatter by " +
                to_text(std::round(noise)) + " HU round " + to_text(std::round(level)) +
                " HU, expected at most " + to_text(100.0 * kMostNoisePart) +
                " % of the contrast: the texture of bone, or too much noise; move the point into "
                "a contrast-filled artery, or give segmentation.lower_hu and upper_hu");
  }
  Band band{.lower_hu = std::round(kSurroundingsHu + 0.5 * contrast),
            .connect_hu = std::round(kSurroundingsHu + kConnectPart * contrast),
            .upper_hu = std::round(level + kUpperPart * contrast + 3.0 * noise),
            .smoothing_mm = 0.0,
            .neck_mm = neck_mm.value_or(neck_of(image.grid)),
            .way_hu = 0.0,
            .way = {}};
  for (const double sigma : {0.4, 0.6, 0.8}) {
    if (noise * smoothed_noise(image.grid, band.smoothing_mm) > kNoisePart * contrast) {
      band.smoothing_mm = sigma;
    }
  }

  band.smoothing_mm = smoothing_mm.value_or(band.smoothing_mm);
  std::vector<Vec3> points;
  for (const LumenSample& sample : samples) {
    points.push_back(sample.point);
  }

  // no more is asked for than the ends and the best way between them have
  const double floor = std::round(kSurroundingsHu + kLeastConnectPart * contrast);
  const Eroded eroded =
      erode(image, box_round(image, points, to_target ? kSearchMm : kSnapMm), band, floor);
  const std::optional<std::size_t> start = brightest_near(eroded, samples.front().point, floor);
  const std::optional<std::size_t> end =
      to_target ? brightest_near(eroded, samples.back().point, floor) : start;
  if (start && end) {
    float least = eroded.values[*start];
    for (const std::size_t n : brightest_way(eroded, *start, *end, floor)) {
      least = std::min(least, eroded.values[n]);
      band.way.push_back(center_of(eroded.grid, n));
    }
    band.way_hu = std::min(band.connect_hu, static_cast<double>(least));
  }
  return band;
}

std::optional<Vec3> find_lumen_near(const Image& image, const Vec3& point, const Band& band) {
  const Eroded eroded = erode(image, box_round(image, {point}, kSnapMm), band, band.connect_hu);
  const std::optional<std::size_t> best = brightest_near(eroded, point, band.connect_hu);
  return best ? std::optional<Vec3>(center_of(eroded.grid, *best)) : std::nullopt;
}

}  // namespace wireplan::preprocess
