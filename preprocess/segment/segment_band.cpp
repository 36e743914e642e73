#include "preprocess/segment/segment_band.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <utility>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {
namespace {

constexpr double kSurroundingsHu = 50.0;
constexpr double kLeastContrastHu = 100.0;  // over blood; arterial phases have 200 and more
constexpr double kUnsureContrastHu = 80.0;  // at any point, where none has 150
constexpr double kMostAllowance = 20.0;     // for what a level is not known to                [HU]
constexpr double kMostScatter = 0.45;       // of a point's contrast, without a core about it
constexpr double kLeastPart = 0.4;          // of the contrast of the brightest point, at any other
constexpr double kLeastToNoise = 5.0;       // contrast of what is no CT
constexpr double kMostNoisePart = 0.35;  // of the contrast; more is marrow, or no image to plan on
constexpr double kSeenPart = 0.4;        // of the least contrast: below, a point has none at all
constexpr double kCalciumHu = 800.0;     // references B5: arterial phase, calcium above
constexpr double kSnapMm = 2.5;          // how far a point may lie beside the lumen it means
constexpr double kWideMm = 2.0;          // ball of a point that is dark in the smallest one
constexpr double kNoiseMm = 10.0;        // ball in which noise is measured
constexpr double kApartMm = 1.2;
constexpr double kLumenMm = 6.0;        // ball in which the lumen's values are taken
constexpr double kSurroundMm = 15.0;    // ball in which the surroundings are taken
constexpr double kMedianError = 1.253;  // standard error of a median against that of a mean
constexpr double kCorrelation = 1.5;    // of an average of neighbours, against independent noise
constexpr std::size_t kLeastSample = 30;
constexpr double kNoisyPart = 0.15;  // of the contrast: values are smoothed to find a core
constexpr double kConnectPart = 0.65, kUpperPart = 0.4, kNoisePart = 0.05;
constexpr double kNeckMm = 0.5;

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
  return differences.empty() ? 0.0 : 1.4826 * median(std::move(differences)) / std::sqrt(6.0);
}

double median_near(const Image& image, const Vec3& center, double least_radius = 1.0) {
  const double radius = std::max(least_radius, 1.01 * image.grid.spacing.minCoeff());
  std::vector<double> values;
  for (const std::size_t n : voxels_in_ball(image.grid, center, radius)) {
    values.push_back(static_cast<double>(image.values[n]));
  }
  return median(std::move(values));
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

Box box_round(const Image& image, const std::vector<Vec3>& points, double margin) {
  std::optional<Box> box;
  for (const Vec3& point : points) {
    const std::optional<Voxel> v = nearest_voxel(image.grid, point);
    expects(v.has_value());
    box = box ? united(*box, {*v, *v}) : Box{*v, *v};
  }
  return grown(*box, margin, image.grid);
}

/// Contacts thinner than twice this are no vessel: with less than one voxel it would ask nothing.
double neck_of(const Grid& grid) { return std::max(kNeckMm, 0.501 * grid.spacing.minCoeff()); }

/// Level and scatter from the voxels near the middle that have lumen all round them, if there are
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
  sample.level_hu = median(values);
  sample.voxels = values.size();
  for (double& value : values) {
    value = std::abs(value - sample.level_hu);
  }
  sample.scatter_hu = 1.4826 * median(std::move(values));
}

/// The lumen round a point, of values from `least` to `most`; smoothed before where it is noisy.
void measure_near(const Image& image, double least, double most, bool noisy, LumenSample& sample) {
  const Band like_lumen{.lower_hu = least,
                        .connect_hu = least,
                        .upper_hu = most,
                        .smoothing_mm = noisy ? 0.6 : 0.0,
                        .neck_mm = neck_of(image.grid)};
  const Eroded eroded =
      erode(image, box_round(image, {sample.point}, kSnapMm + kLumenMm), like_lumen, least);
  if (const std::optional<std::size_t> center = brightest_near(eroded, sample.point, least)) {
    measure_lumen(image, eroded, center_of(eroded.grid, *center), least, sample);
  }
}

/// The noise is no more than the scatter of a core; and how well the level is known.
LumenSample with_error(LumenSample sample) {
  if (sample.voxels > 1) sample.noise_hu = std::min(sample.noise_hu, sample.scatter_hu);
  const auto voxels = static_cast<double>(std::max<std::size_t>(1, sample.voxels));
  sample.error_hu = kMedianError * kCorrelation * sample.noise_hu / std::sqrt(voxels);
  return sample;
}

/// Where the nearest ball of contrast begins, in words; nothing where there is none within 10 mm.
std::string nearest_contrast(const Image& image, const Vec3& point, double least, double most) {
  constexpr double kLookMm = 10.0;
  std::optional<Vec3> nearest;
  double away = std::numeric_limits<double>::infinity();
  for (const std::size_t n : voxels_in_ball(image.grid, point, kLookMm)) {
    const Vec3 here = center_of(image.grid, n);
    if ((here - point).norm() >= away) continue;
    const double value = median_near(image, here);
    if (value < least || value > most) continue;
    nearest = here;
    away = (here - point).norm();
  }
  if (!nearest) return "";
  return "; such contrast begins " + to_text(std::round(10.0 * away) / 10.0) + " mm away, at " +
         to_text(*nearest) + " mm";
}

/// Two standard errors, of a level that was measured in a core.
double allowance(const LumenSample& sample) {
  return sample.voxels > 1 ? std::min(kMostAllowance, 2.0 * sample.error_hu) : 0.0;
}

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

LumenSample sample_lumen(const Image& image, const Vec3& point, double surroundings) {
  LumenSample sample{.point = point,
                     .level_hu = median_near(image, point),
                     .noise_hu = measure_noise(image, point)};
  sample.voxels = 1;
  const double seen = surroundings + kSeenPart * kLeastContrastHu;
  if (sample.level_hu < seen) {
    // so few voxels may be dark by noise alone
    const double wide = median_near(image, point, kWideMm);
    if (wide < seen) return with_error(sample);
    sample.level_hu = wide;
  }
  // the middle of the vessel nearby tells more than a point near the wall
  const double contrast = sample.level_hu - surroundings;
  measure_near(image, surroundings + 0.5 * contrast,
               std::max(kCalciumHu, sample.level_hu + contrast),
               sample.noise_hu > kNoisyPart * contrast, sample);
  return with_error(sample);
}

void sample_beside_calcium(const Image& image, double surroundings,
                           std::vector<LumenSample>& samples) {
  constexpr double kScatterPart = 0.2, kScatterNoises = 2.5;
  // Than the others: an even core, one too small to tell, an uneven one; and lumen at most.
  constexpr double kBrighterEven = 2.0, kBrighter = 1.5, kBrighterUneven = 1.2, kLumen = 1.3;
  constexpr double kRimPart = 0.4;  // of what lumen may have: the rim is darker
  const auto contrast_of = [&](const LumenSample& sample) {
    return sample.level_hu - surroundings;
  };
  const auto is_even = [&](const LumenSample& sample) {
    return sample.voxels > 1 && (sample.scatter_hu <= kScatterPart * contrast_of(sample) ||
                                 sample.scatter_hu <= kScatterNoises * sample.noise_hu);
  };
  const std::vector<LumenSample> before = samples;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    LumenSample& sample = samples[k];
    double others = 0.0;  // the most contrast of those that are sure
    for (std::size_t m = 0; m < before.size(); ++m) {
      if (m != k && is_even(before[m])) others = std::max(others, contrast_of(before[m]));
    }
    const double brighter = is_even(sample)     ? kBrighterEven
                            : sample.voxels > 1 ? kBrighterUneven
                                                : kBrighter;
    if (others <= 0.0 || contrast_of(sample) < brighter * others) continue;
    const double most = kLumen * others;
    LumenSample beside{.point = sample.point, .noise_hu = measure_noise(image, sample.point)};
    measure_near(image, surroundings + kRimPart * most, surroundings + most,
                 beside.noise_hu > kNoisyPart * most, beside);
    if (beside.voxels >= std::max(kLeastSample, sample.voxels) && is_even(beside)) {
      sample = with_error(beside);
    }
  }
}

double find_surroundings(const Image& image, const std::vector<Vec3>& points, bool hounsfield) {
  if (hounsfield) return kSurroundingsHu;
  std::vector<double> dark;
  for (const Vec3& point : points) {
    const double level = median_near(image, point);
    for (const std::size_t n : voxels_in_ball(image.grid, point, kSurroundMm)) {
      if (static_cast<double>(image.values[n]) < 0.5 * level) {
        dark.push_back(static_cast<double>(image.values[n]));
      }
    }
  }
  return dark.empty() ? 0.0 : median(std::move(dark));
}

Band choose_band(const Image& image, const std::vector<LumenSample>& samples, double surroundings,
                 bool hounsfield, std::optional<double> smoothing_mm,
                 std::optional<double> neck_mm) {
  expects(!samples.empty());
  double noise = std::numeric_limits<double>::infinity();
  const LumenSample* brightest = &samples.front();
  for (const LumenSample& sample : samples) {
    if (hounsfield && sample.level_hu > kCalciumHu) {
      throw Error("the volume has " + to_text(std::round(sample.level_hu)) + " HU round " +
                  to_text(sample.point) + " mm, expected at most " + to_text(kCalciumHu) +
                  " HU: bone, calcium or metal; move the point into the lumen, or, if this is no "
                  "CT or so bright a lumen, give segmentation.lower_hu and upper_hu");
    }
    if (sample.level_hu > brightest->level_hu) brightest = &sample;
    noise = std::min(noise, sample.noise_hu);
  }
  const double level = brightest->level_hu, contrast = level - surroundings;
  const double base = hounsfield ? kBloodHu : surroundings;  // what a missing contrast leaves
  const double least_of_all = hounsfield ? kLeastContrastHu : kLeastToNoise * noise;
  for (const LumenSample& sample : samples) {
    const double here = sample.level_hu + allowance(sample) - base;
    const double most = brightest->level_hu + allowance(*brightest) - base;
    // Beside a point that is sure a thin artery may have less.
    const bool sure = !hounsfield || most >= kSureContrastHu;
    const bool none = most < least_of_all || contrast <= 0.0 || (!sure && here < kUnsureContrastHu);
    if (!none && here >= kLeastPart * most) continue;
    const std::string unit = hounsfield ? " HU" : "";
    const std::string beside =
        none ? ""
             : nearest_contrast(image, sample.point, base + kConnectPart * most, base + 1.4 * most);
    throw Error(
        "no contrast-filled artery at " + to_text(sample.point) + " mm: the volume has " +
        to_text(std::round(sample.level_hu)) + unit + " there (median of " +
        (sample.voxels < 2 ? "its nearest voxels" : std::to_string(sample.voxels) + " voxels") +
        "), expected at least " +
        to_text(std::round(base + (none ? least_of_all : kLeastPart * most))) + unit +
        (none ? hounsfield ? ", 100 HU over blood without contrast"
                           : ", five times the noise over what surrounds it"
              : ", 40 % of the contrast at " + to_text(brightest->point) + " mm") +
        beside +
        "; take the arterial phase of a CT with contrast, or move the point into the "
        "lumen, or, if this is no CT, give segmentation.lower_hu and upper_hu");
  }

  const LumenSample* scattered = noise > kMostNoisePart * contrast ? &samples.front() : nullptr;
  double most_part = kMostNoisePart;
  for (const LumenSample& sample : samples) {
    const bool in_core = sample.voxels > 1;
    if (!in_core && sample.noise_hu > kMostScatter * (sample.level_hu - surroundings)) {
      scattered = &sample;
      most_part = kMostScatter;
    }
  }
  if (scattered != nullptr) {
    throw Error("the values round " + to_text(scattered->point) + " mm scatter by " +
                to_text(std::round(scattered->noise_hu)) + " HU round " +
                to_text(std::round(scattered->level_hu)) + " HU, expected at most " +
                to_text(100.0 * most_part) +
                " % of the contrast: the texture of bone, or too much noise; move the point into "
                "a contrast-filled artery, or give segmentation.lower_hu and upper_hu");
  }
  Band band{.lower_hu = std::round(surroundings + 0.5 * contrast),
            .connect_hu = std::round(surroundings + kConnectPart * contrast),
            .upper_hu = std::round(level + kUpperPart * contrast + 3.0 * noise),
            .smoothing_mm = 0.0,
            .neck_mm = neck_mm.value_or(neck_of(image.grid)),
            .surroundings_hu = surroundings,
            .contrast_hu = contrast};
  for (const double sigma : {0.4, 0.6, 0.8}) {
    if (noise * smoothed_noise(image.grid, band.smoothing_mm) > kNoisePart * contrast) {
      band.smoothing_mm = sigma;
    }
  }
  band.smoothing_mm = smoothing_mm.value_or(band.smoothing_mm);
  return band;
}

std::optional<Vec3> find_lumen_near(const Image& image, const Vec3& point, const Band& band) {
  const Eroded eroded = erode(image, box_round(image, {point}, kSnapMm), band, band.connect_hu);
  const std::optional<std::size_t> best = brightest_near(eroded, point, band.connect_hu);
  return best ? std::optional<Vec3>(center_of(eroded.grid, *best)) : std::nullopt;
}

}  // namespace wireplan::preprocess
