#include "preprocess/surface/wall_profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "preprocess/base.h"

namespace wireplan::preprocess {
namespace {

constexpr int kInProfile = WallProfiles::kSamples;

// Soft tissue, as walls are without contrast; 40 or 50 do nearly the same.                   [HU]
constexpr double kWall = 45.0;
// Fat and air alone are darker. No other unit than HU has such values.                      [HU]
constexpr double kDark = -20.0;
constexpr double kLeastOverWall = 80.0;  // of the lumen                                      [HU]
// Brighter than the wall by so much, what lies beyond is no part of the model.               [HU]
constexpr double kBeyond = 35.0;
// An averaged profile is known to this part of its contrast: noise, and what the model lacks.
constexpr double kKnown = 0.005;
// Walls of arteries: the logarithm of their thickness is normal, widely.
constexpr double kUsualWall = 0.8, kWallSpread = 1.0;  // [mm], [-]

// What is tried: the edge's place and the wall's thickness [sigma], and the blur [of what it was
// taken for].
constexpr int kPlaces = 7;
constexpr double kFirstPlace = -0.9, kPlaceStep = 0.3;
constexpr std::array kWalls = {0.05, 0.25, 0.5, 0.75, 1.0, 1.25, 1.6, 2.0, 2.5, 3.2};
constexpr int kThicknesses = static_cast<int>(kWalls.size());
constexpr std::array kBlurs = {0.8, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5};
// The blur is looked for in so many profiles about; fewer than the least that suit tell nothing.
constexpr Eigen::Index kAsked = 1500;
constexpr int kLeastAsked = 20;
constexpr double kLikeLeast = 1.1;  // of the least sigma, for the blur to be asked of
// Squared misfits [of what is known]: over the first a profile is not of the model, and over the
// second beyond its best a blur is no worse.
constexpr double kWorst = 60.0, kFarWorse = 40.0;

double normal_cdf(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

/// What suits a profile best for each thickness.
struct ByThickness {
  std::array<double, kWalls.size()> misfit, outer;  // [HU^2], [HU]
};

/// The model for one blur, places and thicknesses as rows. By L and F it is linear: least squares
/// come from sums of its terms with each other and with the profile.
class EdgeModel {
 public:
  explicit EdgeModel(double blur)
      : lumen_(kPlaces * kThicknesses, kInProfile), outer_(lumen_.rows(), kInProfile) {
    for (int row = 0; row < lumen_.rows(); ++row) {
      const double place = kFirstPlace + kPlaceStep * (row / kThicknesses);
      const double wall = kWalls[static_cast<std::size_t>(row % kThicknesses)];
      for (int k = 0; k < kInProfile; ++k) {
        const double x = WallProfiles::kFirst + k * WallProfiles::kStep - place;
        lumen_(row, k) = normal_cdf(-x / blur);
        outer_(row, k) = normal_cdf((x - wall) / blur);
      }
    }
    lumen_lumen_ = lumen_.rowwise().squaredNorm();
    lumen_outer_ = lumen_.cwiseProduct(outer_).rowwise().sum();
    outer_outer_ = outer_.rowwise().squaredNorm();
    determinant_ = lumen_lumen_.cwiseProduct(outer_outer_) - lumen_outer_.cwiseAbs2();
  }

  ByThickness fit(const Eigen::VectorXd& profile) const {
    // Over the wall's value, so that its own share, which the two others leave, adds nothing.
    const Eigen::VectorXd over = profile.array() - kWall;
    const Eigen::VectorXd with_lumen = lumen_ * over, with_outer = outer_ * over;
    const double all = over.squaredNorm();
    ByThickness best;
    for (int t = 0; t < kThicknesses; ++t) {
      std::array<double, kPlaces> misfit{}, outer{};
      for (int place = 0; place < kPlaces; ++place) {
        const int row = place * kThicknesses + t;
        const double lo = lumen_outer_(row);
        const double l =
            (with_lumen(row) * outer_outer_(row) - with_outer(row) * lo) / determinant_(row);
        outer[place] =
            (with_outer(row) * lumen_lumen_(row) - with_lumen(row) * lo) / determinant_(row);
        misfit[place] = all - l * with_lumen(row) - outer[place] * with_outer(row);
      }
      // Between the places, by a parabola.
      const auto k = std::min_element(misfit.begin(), misfit.end()) - misfit.begin();
      best.misfit[t] = misfit[k];
      best.outer[t] = kWall + outer[k];
      if (k == 0 || k + 1 == kPlaces) continue;
      const double slope = 0.5 * (misfit[k + 1] - misfit[k - 1]);
      const double bend = misfit[k + 1] - 2.0 * misfit[k] + misfit[k - 1];
      const double part = bend > 0.0 ? -slope / bend : 0.0;
      best.misfit[t] = std::max(0.0, misfit[k] + 0.5 * slope * part);
      best.outer[t] += part * 0.5 * (outer[k + 1] - outer[k - 1]);
    }
    return best;
  }

 private:
  Eigen::MatrixXd lumen_, outer_;  // shares of lumen and surroundings in each value
  Eigen::VectorXd lumen_lumen_, lumen_outer_, outer_outer_, determinant_;
};

/// Misfits in what a profile is known to, with how unusual the wall would be.
std::array<double, kWalls.size()> doubts(const ByThickness& fits, const Eigen::VectorXd& profile,
                                         double sigma) {
  const double known = kKnown * (profile(0) - profile.tail(4).minCoeff());
  std::array<double, kWalls.size()> result{};
  for (std::size_t t = 0; t < kWalls.size(); ++t) {
    const double unusual = std::log(kWalls[t] * sigma / kUsualWall) / kWallSpread;
    result[t] = fits.misfit[t] / (known * known) + unusual * unusual;
  }
  return result;
}

Eigen::VectorXd profile_at(const WallProfiles& profiles, Eigen::Index v) {
  return profiles.values.col(v).cast<double>();
}

/// Where the parabola through the least value and its neighbours is least.
double least_between(const std::array<double, kBlurs.size()>& sums) {
  const auto k =
      static_cast<std::size_t>(std::min_element(sums.begin(), sums.end()) - sums.begin());
  if (k == 0 || k + 1 == sums.size()) return kBlurs[k];
  const double before = kBlurs[k] - kBlurs[k - 1], after = kBlurs[k + 1] - kBlurs[k];
  const double falls = (sums[k] - sums[k - 1]) / before, rises = (sums[k + 1] - sums[k]) / after;
  return kBlurs[k] - 0.5 * before - 0.5 * falls * (before + after) / (rises - falls);
}

/// The blur that suits the profiles best on the whole [of what it was taken for]. Walls beside
/// tissue, which are plain steps, tell it best.
double find_blur(const WallProfiles& profiles) {
  const std::vector<EdgeModel> models(kBlurs.begin(), kBlurs.end());
  std::array<double, kBlurs.size()> sums{};
  int asked = 0;
  // Of those within the slices' plane: across thick slices it is another.
  const double least_sigma = profiles.sigma.minCoeff();
  const Eigen::Index able = (profiles.sigma.array() <= kLikeLeast * least_sigma).count();
  const Eigen::Index step = std::max<Eigen::Index>(1, able / kAsked);
  for (Eigen::Index v = 0; v < profiles.sigma.size(); v += step) {
    if (profiles.sigma(v) > kLikeLeast * least_sigma) continue;
    const Eigen::VectorXd profile = profile_at(profiles, v);
    if (profile(0) < kWall + kLeastOverWall) continue;
    if (profile.tail(4).maxCoeff() > kWall + kBeyond) continue;
    std::array<double, kBlurs.size()> least{};
    for (std::size_t k = 0; k < kBlurs.size(); ++k) {
      const auto of_walls = doubts(models[k].fit(profile), profile, profiles.sigma(v));
      least[k] = *std::min_element(of_walls.begin(), of_walls.end());
    }
    const double best = *std::min_element(least.begin(), least.end());
    if (best > kWorst) continue;
    for (std::size_t k = 0; k < kBlurs.size(); ++k) sums[k] += std::min(least[k], best + kFarWorse);
    ++asked;
  }
  return asked < kLeastAsked ? 1.0 : least_between(sums);
}

/// Mean over the thicknesses.
double outside_of(const ByThickness& fits, const std::array<double, kWalls.size()>& doubt,
                  double blur) {
  const double least = *std::min_element(doubt.begin(), doubt.end());
  double sum = 0.0, outside = 0.0, outer = 0.0;
  for (std::size_t t = 0; t < kWalls.size(); ++t) {
    // Each stands for the thicknesses, in logarithm, up to its neighbours.
    const double low = kWalls[t == 0 ? 0 : t - 1];
    const double high = kWalls[t + 1 == kWalls.size() ? t : t + 1];
    const double weight = std::exp(-0.5 * (doubt[t] - least)) * std::log(high / low);
    sum += weight;
    outer += weight * fits.outer[t];
    outside += weight * (kWall - 2.0 * (kWall - fits.outer[t]) * normal_cdf(-kWalls[t] / blur));
  }
  return outer < kDark * sum ? outside / sum : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

void average_profiles(const Neighbours& neighbours, int passes, WallProfiles& profiles) {
  auto next = profiles.values;
  const Eigen::Index n = profiles.values.cols();
  for (int pass = 0; pass < passes; ++pass) {
#pragma omp parallel for schedule(static) if (n > 20000)
    for (Eigen::Index v = 0; v < n; ++v) {
      const std::size_t begin = neighbours.first[static_cast<std::size_t>(v)];
      const std::size_t end = neighbours.first[static_cast<std::size_t>(v) + 1];
      Eigen::Matrix<float, kInProfile, 1> sum = Eigen::Matrix<float, kInProfile, 1>::Zero();
      for (std::size_t k = begin; k < end; ++k) sum += profiles.values.col(neighbours.list[k]);
      const float share = end > begin ? 0.5F / static_cast<float>(end - begin) : 0.0F;
      next.col(v) = 0.5F * profiles.values.col(v) + share * sum;
    }
    profiles.values.swap(next);
  }
}

WallsSeen see_walls(const WallProfiles& profiles) {
  const Eigen::Index n = profiles.sigma.size();
  expects(profiles.values.cols() == n && (profiles.sigma.array() > 0.0).all());
  const double blur = find_blur(profiles);
  const EdgeModel model(blur);
  WallsSeen seen{.blur = blur,
                 .outside = Eigen::VectorXd::Constant(n, std::numeric_limits<double>::quiet_NaN())};
#pragma omp parallel for schedule(static)
  for (Eigen::Index v = 0; v < n; ++v) {
    const Eigen::VectorXd profile = profile_at(profiles, v);
    if (profile(0) < kWall + kLeastOverWall || profile.tail(8).minCoeff() >= kDark) continue;
    const ByThickness fits = model.fit(profile);
    seen.outside(v) = outside_of(fits, doubts(fits, profile, profiles.sigma(v)), blur);
  }
  return seen;
}

}  // namespace wireplan::preprocess
