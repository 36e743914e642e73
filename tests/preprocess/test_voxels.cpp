// Distances and cavities of masks, against what defines them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {
namespace {

/// Voxels of different sides, so many of a hundred labelled.
struct RandomMask {
  Grid grid{.size = {13, 9, 11}, .spacing = {0.7, 0.9, 1.6}};
  Labels labels;

  explicit RandomMask(unsigned percent) {
    std::mt19937_64 random(percent + 1);
    for (std::size_t n = 0; n < grid.voxels(); ++n) {
      labels.push_back(random() % 100 < percent ? 1 : 0);
    }
  }
};

TEST(DistanceTo, IsThatOfTheNearestVoxelOfTheLabel) {
  for (const unsigned percent : {0U, 1U, 10U, 50U, 90U, 99U, 100U}) {
    SCOPED_TRACE(percent);
    const RandomMask mask(percent);
    for (const std::uint8_t label : {std::uint8_t{0}, std::uint8_t{1}}) {
      const std::vector<float> distance = distance_to(label, mask.grid, mask.labels);
      for (std::size_t n = 0; n < distance.size(); ++n) {
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t m = 0; m < distance.size(); ++m) {
          if (mask.labels[m] != label) continue;
          nearest = std::min(nearest, (center_of(mask.grid, n) - center_of(mask.grid, m)).norm());
        }
        ASSERT_FLOAT_EQ(distance[n], static_cast<float>(nearest));
      }
    }
  }
}

TEST(Smooth, IsTheDiscreteGaussianHoweverFineTheVoxels) {
  for (const double sigma : {4.0, 24.0, 25.0, 60.0}) {  // of a voxel
    SCOPED_TRACE(sigma);
    const Grid grid{.size = {601, 1, 1}, .spacing = Vec3::Constant(0.1)};
    std::vector<float> values(grid.voxels(), 0.0F);
    values[300] = 1.0F;
    smooth(grid, 0.1 * sigma, values);
    double sum = 0.0, second = 0.0;
    for (std::size_t n = 0; n < values.size(); ++n) {
      sum += static_cast<double>(values[n]);
      second += std::pow(static_cast<double>(n) - 300.0, 2) * static_cast<double>(values[n]);
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
    EXPECT_NEAR(second, sigma * sigma, 2e-3 * sigma * sigma);  // cut off at four sigma
    // Abramowitz and Stegun 9.7.1, to the third term; what is cut off is 6e-5 of all.
    const double t = sigma * sigma;
    const double peak = (1.0 + 1.0 / (8.0 * t) + 9.0 / (128.0 * t * t)) / std::sqrt(2.0 * kPi * t);
    EXPECT_NEAR(static_cast<double>(values[300]), peak, 1e-4 * peak);
  }
}

TEST(FillCavities, FillsWhatDoesNotReachTheBorderAndIsSmallEnough) {
  int filled = 0, left = 0;
  for (const unsigned percent : {0U, 50U, 70U, 90U, 100U}) {
    const RandomMask mask(percent);
    for (const double largest : {1.0, 3.0, std::numeric_limits<double>::infinity()}) {
      SCOPED_TRACE(testing::Message() << percent << " %, " << largest);
      Labels labels = mask.labels;
      fill_cavities(mask.grid, labels, largest);
      for (std::size_t n = 0; n < labels.size(); ++n) {
        if (mask.labels[n] != 0) {
          ASSERT_EQ(labels[n], 1);
          continue;
        }
        const Labels part =
            flood(mask.grid, {n}, [&](std::size_t m) { return mask.labels[m] == 0; });
        bool open = false;
        for (std::size_t m = 0; m < part.size(); ++m) {
          open = open || (part[m] != 0 && on_border(mask.grid, voxel_at(mask.grid, m)));
        }
        const bool fills = !open && static_cast<double>(count(part)) <= largest;
        ASSERT_EQ(labels[n], fills ? 1 : 0);
        filled += fills ? 1 : 0;
        left += !open && !fills ? 1 : 0;
      }
    }
  }
  EXPECT_GT(filled, 100);
  EXPECT_GT(left, 10);  // too large
}

}  // namespace
}  // namespace wireplan::preprocess
