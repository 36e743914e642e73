#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "simulate/wall/vessel_model.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

using preprocess::find_openings;

constexpr double kRadius = 4.0;

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1.0p-53; }

/// A point at random in a straight tube along z, `depth` from its wall, away from the caps.
Vec3 point_in_tube(std::mt19937_64& random, double depth) {
  const double angle = 2.0 * kPi * uniform(random), z = 10.0 + 20.0 * uniform(random);
  return {(kRadius - depth) * std::cos(angle), (kRadius - depth) * std::sin(angle), z};
}

TEST(Lumen, MeasuresTheDistanceToATubesWall) {
  const Lumen lumen(shapes::straight_tube(kRadius, 40.0, 0.8), {.grid_spacing = 0.5});
  std::mt19937_64 random(1);
  for (int k = 0; k < 300; ++k) {
    const double depth = -1.0 + 2.5 * uniform(random);
    // Facets of 0.8 mm lie up to edge^2 / (8 R) = 0.02 mm inside the tube; the spline adds a few
    // microns.
    EXPECT_NEAR(lumen.distance(point_in_tube(random, depth)), depth, 0.03);
  }
  EXPECT_LT(lumen.mean_deviation(), 0.01);
}

TEST(Lumen, ComesCloserToTheTrianglesOnAFinerGrid) {
  const Surface tube = shapes::straight_tube(kRadius, 40.0, 0.8);
  const Lumen coarse(tube, {.grid_spacing = 1.0}), fine(tube, {.grid_spacing = 0.25});
  EXPECT_LT(fine.mean_deviation(), 0.5 * coarse.mean_deviation());
  EXPECT_GT(coarse.max_deviation(), 0.0);
}

TEST(Follow, TakesCellsOfTwoThirdsOfAnEdge) {
  // A thin tube's triangles are small, so that the field follows them too.
  for (const double edge : {0.3, 0.6, 1.2}) {
    const Surface tube = shapes::straight_tube(2.0, 20.0, edge);
    const LumenOptions options = follow(tube);
    EXPECT_NEAR(options.grid_spacing, std::min(0.5, 2.0 / 3.0 * edge), 0.08 * edge);
    EXPECT_EQ(options.openings.size(), 2u);
    EXPECT_EQ(VesselModel::yielding_band(options),
              std::max(options.band, 10.0 * options.grid_spacing));
  }
  const Surface tube = shapes::straight_tube(1.0, 10.0, 0.3);
  EXPECT_EQ(follow(tube, 4.0).band, 4.5) << "what is felt 4 mm from an axis lies in it";
  const Lumen fine(tube, follow(tube)), coarse(tube, {.openings = find_openings(tube)});
  EXPECT_LT(fine.max_deviation(), 0.5 * coarse.max_deviation());
}

TEST(Lumen, KnowsInsideFromOutsideBeyondTheBand) {
  const Lumen lumen(shapes::straight_tube(10.0, 80.0, 3.0), {.grid_spacing = 0.5, .band = 2.0});
  EXPECT_DOUBLE_EQ(lumen.distance(Vec3(0.0, 0.0, 40.0)), 2.0);
  EXPECT_DOUBLE_EQ(lumen.distance(Vec3(15.0, 0.0, 40.0)), -2.0);
  EXPECT_DOUBLE_EQ(lumen.distance(Vec3(1000.0, -1000.0, 0.0)), -2.0);
  EXPECT_TRUE(lumen.sample(Vec3(0.0, 0.0, 40.0)).gradient.isZero(0.0));
}

TEST(Lumen, DerivativesAgreeWithFiniteDifferences) {
  const Lumen lumen(shapes::bend_tube(kRadius, 30.0, 1.5, 20.0, 20.0, 1.5), {.grid_spacing = 0.7});
  std::mt19937_64 random(2);
  const double h = 1e-4;
  int sampled = 0;
  for (int k = 0; k < 2000 && sampled < 200; ++k) {
    const Vec3 p(-5.0 + 40.0 * uniform(random), -5.0 + 10.0 * uniform(random),
                 50.0 * uniform(random));
    const WallSample wall = lumen.sample(p);
    if (std::abs(wall.distance) > 1.9) continue;  // clamped at the band of 2 mm
    ++sampled;
    EXPECT_NEAR(wall.distance, lumen.distance(p), 1e-14);  // summed in another order
    for (int d = 0; d < 3; ++d) {
      const WallSample plus = lumen.sample(p + h * Vec3::Unit(d)),
                       minus = lumen.sample(p - h * Vec3::Unit(d));
      // Truncation h^2/6 times third derivatives of at most about 5 per mm^2.
      EXPECT_NEAR((plus.distance - minus.distance) / (2.0 * h), wall.gradient[d], 1e-7);
      const Vec3 column = (plus.gradient - minus.gradient) / (2.0 * h);
      EXPECT_LT((column - wall.hessian.col(d)).norm(), 2e-3);  // third derivative jumps at cells
    }
  }
  EXPECT_EQ(sampled, 200);
}

TEST(Lumen, GradientIsTheUnitNormalNearTheWall) {
  const Lumen lumen(shapes::straight_tube(kRadius, 40.0, 0.8), {.grid_spacing = 0.5});
  std::mt19937_64 random(3);
  for (int k = 0; k < 100; ++k) {
    const Vec3 p = point_in_tube(random, 0.4);
    const Vec3 inward = -Vec3(p[0], p[1], 0.0).normalized();
    const WallSample wall = lumen.sample(p);
    EXPECT_NEAR(wall.gradient.norm(), 1.0, 0.03);
    EXPECT_GT(wall.gradient.normalized().dot(inward),
              std::cos(4.0 * kRadPerDeg));  // facets of 11 degrees
  }
}

}  // namespace
}  // namespace wireplan::simulate
