// The wall between lumen and surroundings, against profiles in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "preprocess/surface/wall_profile.h"

namespace wireplan::preprocess {
namespace {

double share_beyond(double x, double edge, double sigma) {
  return 0.5 * std::erfc((edge - x) / (sigma * std::sqrt(2.0)));
}

/// What lies along a normal, 0 at the lumen's edge.
struct Layers {
  double lumen = 300.0, wall = 45.0, outer = -100.0;  // [HU]
  double thickness = 0.8;                             // of the wall                [mm]

  double at(double x, double sigma) const {
    return lumen + (wall - lumen) * share_beyond(x, 0.0, sigma) +
           (outer - wall) * share_beyond(x, thickness, sigma);
  }
};

/// Profiles through these layers, every second with muscle outside, the edge from a third of sigma
/// inward of where they are sampled to a third outward, of that blur [mm], taken for `guess`.
WallProfiles profiles_of(const Layers& layers, double sigma, double guess) {
  constexpr Eigen::Index kCount = 100;
  WallProfiles profiles(kCount);
  profiles.sigma.setConstant(guess);
  for (Eigen::Index v = 0; v < kCount; ++v) {
    const double edge = sigma * (static_cast<double>(v) / (kCount - 1.0) - 0.5) / 1.5;
    for (int k = 0; k < WallProfiles::kSamples; ++k) {
      const double x = guess * (WallProfiles::kFirst + k * WallProfiles::kStep);
      Layers here = layers;
      if (v % 2 == 1) here.outer = 45.0;
      profiles.values(k, v) = static_cast<float>(here.at(x - edge, sigma));
    }
  }
  return profiles;
}

TEST(WallProfile, GivesTheValueAtTheEdgeOfTheLumen) {
  constexpr double kSigma = 0.7;
  for (const double thickness : {0.3, 0.6, 1.0, 1.6}) {
    for (const double lumen : {200.0, 400.0}) {
      SCOPED_TRACE(std::to_string(thickness) + " mm, " + std::to_string(lumen) + " HU");
      const Layers layers{.lumen = lumen, .thickness = thickness};
      const WallsSeen seen = see_walls(profiles_of(layers, kSigma, kSigma));
      const double slope = (layers.at(-0.01, kSigma) - layers.at(0.01, kSigma)) / 0.02;
      for (Eigen::Index v = 0; v < seen.outside.size(); v += 2) {
        const double off_mm = (0.5 * (lumen + seen.outside(v)) - layers.at(0.0, kSigma)) / slope;
        EXPECT_NEAR(off_mm, 0.0, 0.12);  // half way to a wall alone: up to 0.22
      }
    }
  }
}

TEST(WallProfile, FindsTheBlur) {
  for (const double sigma : {0.5, 0.6, 0.72, 0.87}) {
    SCOPED_TRACE(sigma);
    EXPECT_NEAR(see_walls(profiles_of({}, sigma, 0.6)).blur, sigma / 0.6, 0.06);
  }
}

TEST(WallProfile, LeavesAloneWhatIsNoWallInFat) {
  const auto sees = [](const Layers& layers) {
    return !std::isnan(see_walls(profiles_of(layers, 0.7, 0.7)).outside(50));
  };
  EXPECT_TRUE(sees({}));
  EXPECT_TRUE(sees({.outer = -850.0}));                // lung
  EXPECT_FALSE(sees({.outer = 50.0}));                 // muscle
  EXPECT_FALSE(sees({.outer = 250.0}));                // a vein
  EXPECT_FALSE(sees({.lumen = 100.0}));                // hardly any contrast
  EXPECT_FALSE(sees({.lumen = 600.0, .outer = 0.0}));  // as of MR: nothing is below zero
}

TEST(WallProfile, AveragesProfilesAsValues) {
  // A square of four vertices, each with two neighbours.
  const Neighbours ring{.first = {0, 2, 4, 6, 8}, .list = {1, 3, 0, 2, 1, 3, 2, 0}};
  WallProfiles profiles(4);
  for (Eigen::Index v = 0; v < 4; ++v) {
    for (int k = 0; k < WallProfiles::kSamples; ++k) {
      profiles.values(k, v) = static_cast<float>(static_cast<double>(v * v) + 10.0 * k);
    }
  }
  Eigen::VectorXd values = profiles.values.row(5).transpose().cast<double>();
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(4);
  average(ring, 3, values, weights);
  average_profiles(ring, 3, profiles);
  for (Eigen::Index v = 0; v < 4; ++v) EXPECT_NEAR(profiles.values(5, v), values(v), 1e-4);
}

}  // namespace
}  // namespace wireplan::preprocess
