// Calcium beside a straight lumen, against volumes by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "preprocess/volume/calcium.h"

namespace wireplan::preprocess {
namespace {

/// A lumen of 5 mm radius and 350 HU along z through 40 x 40 x 60 voxels of 0.5 mm, in 40 HU.
struct BrightTube {
  Image image{.grid = {.size = {40, 40, 60}, .spacing = Vec3(0.5, 0.5, 0.5)}, .values = {}};
  Mask lumen{.grid = image.grid, .labels = {}};
  Centerline way{.points = Eigen::Matrix3Xd(3, 60),
                 .radius = Eigen::VectorXd::Constant(60, 5.0),
                 .arc_length = Eigen::VectorXd::LinSpaced(60, 0.0, 29.5)};
  BrightTube() {
    for (std::size_t n = 0; n < image.grid.voxels(); ++n) {
      const int i = static_cast<int>(n) % 40, j = static_cast<int>(n) / 40 % 40;
      const bool inside = std::hypot(0.5 * i - 10.0, 0.5 * j - 10.0) < 5.0;
      lumen.labels.push_back(inside ? 1 : 0);
      image.values.push_back(inside ? 350.0F : 40.0F);
    }
    for (int k = 0; k < 60; ++k) way.points.col(k) = Vec3(10.0, 10.0, 0.5 * k);
  }
  /// A block of 4 x 4 x 4 voxels (8 mm^3) of that brightness, from voxel i on along x.
  void add_block(int first, float hu) {
    for (int k = 20; k < 24; ++k) {
      for (int j = 18; j < 22; ++j) {
        for (int i = first; i < first + 4; ++i) image.values[image.grid.index(i, j, k)] = hu;
      }
    }
  }
};

TEST(Calcium, IsTheBrightVolumeAgainstTheLumen) {
  BrightTube tube;
  EXPECT_EQ(measure_calcium(tube.image, tube.lumen, tube.way).beside, 0.0);
  tube.add_block(30, 1100.0F);  // its centres 0 to 1.5 mm outside the lumen's radius
  EXPECT_DOUBLE_EQ(measure_calcium(tube.image, tube.lumen, tube.way).beside, 8.0);
  EXPECT_DOUBLE_EQ(
      measure_calcium(tube.image, tube.lumen, tube.way, {.threshold_hu = 1200.0}).beside, 0.0);
}

TEST(Calcium, ThatASegmentationTookForLumenCountsApart) {
  BrightTube tube;
  tube.add_block(25, 1100.0F);  // 12.5 to 14 mm along x, in a lumen from 5 to 15
  const Calcium calcium = measure_calcium(tube.image, tube.lumen, tube.way);
  EXPECT_EQ(calcium.beside, 0.0);
  EXPECT_DOUBLE_EQ(calcium.inside, 8.0);
  ASSERT_TRUE(calcium.inside_at);
  EXPECT_LT((*calcium.inside_at - Vec3(13.25, 9.75, 10.75)).norm(), 1e-9);

  // Of several pieces the largest is told, no place between them.
  tube.image.values[tube.image.grid.index(14, 20, 50)] = 1100.0F;
  tube.image.values[tube.image.grid.index(14, 20, 51)] = 1100.0F;
  const Calcium both = measure_calcium(tube.image, tube.lumen, tube.way);
  EXPECT_DOUBLE_EQ(both.inside, 8.25);
  EXPECT_LT((*both.inside_at - Vec3(13.25, 9.75, 10.75)).norm(), 1e-9);

  // A voxel alone is noise of the contrast, two are none.
  BrightTube noisy;
  noisy.image.values[noisy.image.grid.index(20, 20, 30)] = 900.0F;
  EXPECT_EQ(measure_calcium(noisy.image, noisy.lumen, noisy.way).inside, 0.0);
  noisy.image.values[noisy.image.grid.index(20, 20, 31)] = 900.0F;
  EXPECT_DOUBLE_EQ(measure_calcium(noisy.image, noisy.lumen, noisy.way).inside, 0.25);
}

TEST(Calcium, FarFromTheLumenOrAwayFromTheWayDoesNotCount) {
  BrightTube tube;
  tube.add_block(35, 1100.0F);  // 2.5 mm and more away
  EXPECT_EQ(measure_calcium(tube.image, tube.lumen, tube.way).beside, 0.0);
  EXPECT_DOUBLE_EQ(measure_calcium(tube.image, tube.lumen, tube.way, {.within_mm = 5.0}).beside,
                   8.0);

  tube.add_block(30, 1100.0F);
  Centerline above{.points = tube.way.points.rightCols(10),  // from 25 mm on; the block ends at 12
                   .radius = tube.way.radius.tail(10),
                   .arc_length = tube.way.arc_length.head(10)};
  EXPECT_EQ(measure_calcium(tube.image, tube.lumen, above).beside, 0.0);
}

}  // namespace
}  // namespace wireplan::preprocess
