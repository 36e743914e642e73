// Whether labels lie where the volume shows them, and the change under which they would.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

#include "preprocess/volume/label_frame.h"

namespace wireplan::preprocess {
namespace {

/// A bent tube of 5 mm radius, unlike its mirror images.
bool in_bent_tube(const Vec3& p) {
  return std::hypot(p.x() - 22.0 - 6.0 * std::sin(p.z() / 9.0), p.y() - 14.0 - 0.15 * p.z()) < 5.0;
}

TEST(LabelFrame, IsFoundInTheVolumeWhereTheHeaderLies) {
  const Grid grid{.size = {50, 40, 60}, .spacing = Vec3(1, 1, 1), .origin = Vec3(-20, 5, 100)};
  Image image{.grid = grid, .values = std::vector<float>(grid.voxels(), 40.0F), .modality = "CT"};
  const auto draw = [&](const Mat3& linear, const Vec3& shift) {
    std::vector<std::uint8_t> labels(grid.voxels(), 0);
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i) {
          labels[grid.index(i, j, k)] = in_bent_tube(linear * Vec3(i, j, k) + shift) ? 1 : 0;
        }
      }
    }
    return labels;
  };
  const std::vector<std::uint8_t> right = draw(Mat3::Identity(), Vec3::Zero());
  for (std::size_t n = 0; n < right.size(); ++n) image.values[n] = right[n] != 0 ? 340.0F : 40.0F;
  double contrast = 0.0;
  EXPECT_FALSE(find_better_frame(image, right, contrast));
  EXPECT_GT(contrast, 190.0);  // the step of 300 HU, held to 200

  // Drawn mirrored in j with the same header: y of the middle is 5 + 19.5.
  Mat3 flip = Mat3::Identity();
  flip(1, 1) = -1.0;
  const auto mirrored = find_better_frame(image, draw(flip, Vec3(0, 39, 0)), contrast);
  ASSERT_TRUE(mirrored);
  EXPECT_EQ(describe_change(*mirrored), "mirrored in y: y' = 49 - y in LPS mm");
  const auto shifted = find_better_frame(image, draw(Mat3::Identity(), Vec3(10, 0, 0)), contrast);
  ASSERT_TRUE(shifted);
  EXPECT_LE((shifted->shift - Vec3(10, 0, 0)).norm(), 1.0);  // a voxel
  const auto little = find_better_frame(image, draw(Mat3::Identity(), Vec3(3, 0, 0)), contrast);
  ASSERT_TRUE(little);
  EXPECT_LE((little->shift - Vec3(3, 0, 0)).norm(), 1.0);
  EXPECT_LT(contrast, 0.35 * 200.0);
  Mat3 swap = Mat3::Zero();  // written by a program that counts z, y, x
  swap(0, 2) = swap(1, 1) = swap(2, 0) = 1.0;
  const auto reordered = find_better_frame(image, draw(swap, Vec3::Zero()), contrast);
  ASSERT_TRUE(reordered);
  EXPECT_EQ(describe_change(*reordered),
            "stored in another order of axes: its voxel [i, j, k] is the volume's [k, j, i]");

  // Where the volume shows nothing, nothing is better.
  std::fill(image.values.begin(), image.values.end(), 40.0F);
  EXPECT_FALSE(find_better_frame(image, right, contrast));
  EXPECT_EQ(contrast, 0.0);
}

TEST(LabelFrame, OfOneClassIsSeenBesideALargeOneThatLiesRight) {
  // A straight trunk, and the bent tube as a small class: mirrored, it weighs little in the whole.
  const Grid grid{.size = {90, 40, 60}, .spacing = Vec3(1, 1, 1), .origin = Vec3(-20, 5, 1300)};
  const auto draw = [&](bool mirrored) {
    std::vector<std::uint8_t> classes;
    for (int k = 0; k < 60; ++k) {
      for (int j = 0; j < 40; ++j) {
        for (int i = 0; i < 90; ++i) {
          const bool trunk = std::hypot(i - 68.0, j - 19.5) < 14.0;
          const bool bent = in_bent_tube(Vec3(i, mirrored ? 39 - j : j, k));
          classes.push_back(trunk ? 1 : bent ? 2 : 0);
        }
      }
    }
    return classes;
  };
  const std::vector<std::uint8_t> right = draw(false), wrong = draw(true);
  Image image{.grid = grid, .values = {}, .modality = "CT"};
  for (const std::uint8_t one : right) image.values.push_back(one != 0 ? 340.0F : 40.0F);
  double contrast = 0.0;
  EXPECT_FALSE(find_better_frame(image, wrong, contrast));  // all together
  EXPECT_FALSE(find_better_frame(image, wrong, contrast, 1));
  EXPECT_GT(contrast, 190.0);
  const auto mirrored = find_better_frame(image, wrong, contrast, 2);
  ASSERT_TRUE(mirrored);
  EXPECT_EQ(describe_change(*mirrored), "mirrored in y: y' = 49 - y in LPS mm");
  EXPECT_FALSE(find_better_frame(image, right, contrast, 2));
  EXPECT_GT(contrast, 190.0);
  std::vector<std::uint8_t> few(right.size(), 0);
  few[grid.index(30, 20, 30)] = 3;
  EXPECT_FALSE(find_better_frame(image, few, contrast, 3));
  EXPECT_TRUE(std::isnan(contrast));
}

TEST(LabelFrame, IsToldToATenthOfAMillimetreHoweverFar) {
  FrameChange change;
  change.linear(2, 2) = -1.0;
  change.shift = Vec3(0, 0, 1324.94);
  EXPECT_EQ(describe_change(change), "mirrored in z: z' = 1324.9 - z in LPS mm");
  change = {.linear = Mat3::Identity(), .shift = Vec3(-1234.56, 0.04, -0.04)};
  EXPECT_EQ(describe_change(change), "shifted by (-1234.6, 0, 0) mm");
}

/// Labels and a CT by what is at each voxel's place.
struct Drawn {
  Grid grid{.size = {50, 44, 60}, .spacing = Vec3(1, 1, 1), .origin = Vec3(-20, 5, 100)};

  std::vector<std::uint8_t> labels(const std::function<int(const Vec3&)>& at) const {
    std::vector<std::uint8_t> classes;
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i) {
          classes.push_back(static_cast<std::uint8_t>(at(Vec3(i, j, k))));
        }
      }
    }
    return classes;
  }
  /// The mean of eight places in each voxel, as a CT blurs what is thin.
  Image ct(const std::function<double(const Vec3&)>& hu) const {
    Image image{.grid = grid, .values = {}, .modality = "CT"};
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i) {
          double sum = 0.0;
          for (int corner = 0; corner < 8; ++corner) {
            const Vec3 part((corner & 1) - 0.5, (corner >> 1 & 1) - 0.5, (corner >> 2) - 0.5);
            sum += hu(Vec3(i, j, k) + 0.5 * part);
          }
          image.values.push_back(static_cast<float>(sum / 8.0));
        }
      }
    }
    return image;
  }
};

/// From the axis of the bent tube [mm].
double from_bent_axis(const Vec3& p) {
  return std::hypot(p.x() - 22.0 - 6.0 * std::sin(p.z() / 9.0), p.y() - 14.0 - 0.15 * p.z());
}

TEST(LabelFrame, MirroredWithinTheirOwnCropAndMovedAsWellIsFound) {
  const Drawn drawn;
  const Image image = drawn.ct([](const Vec3& p) { return in_bent_tube(p) ? 340.0 : 40.0; });
  double contrast = 0.0;
  // y of a voxel j is 5 + j; in a crop of its own from 4 to 38, and in one beside it.
  for (const double sum : {42.0, 48.0}) {
    const auto mirrored = find_better_frame(image, drawn.labels([&](const Vec3& p) {
      return in_bent_tube(Vec3(p.x(), sum - p.y(), p.z())) ? 1 : 0;
    }),
                                            contrast);
    ASSERT_TRUE(mirrored) << sum;
    EXPECT_LT(mirrored->linear(1, 1), 0.0);
    EXPECT_NEAR(mirrored->shift.y(), sum + 10.0, 1.0);  // a voxel
    EXPECT_LT(std::hypot(mirrored->shift.x(), mirrored->shift.z()), 1.5);
  }
  const auto both = find_better_frame(image, drawn.labels([](const Vec3& p) {
    return in_bent_tube(Vec3(49.0 - p.x(), p.y() - 6.0, p.z())) ? 1 : 0;
  }),
                                      contrast);
  ASSERT_TRUE(both);
  EXPECT_NEAR(both->shift.x(), 9.0, 1.0);  // x of a voxel i is -20 + i
  EXPECT_NEAR(both->shift.y(), -6.0, 1.0);
}

TEST(LabelFrame, AShiftOfLittleMoreThanAVoxelIsTold) {
  const Drawn drawn;
  for (const double radius : {2.5, 6.0}) {
    const Image image =
        drawn.ct([&](const Vec3& p) { return from_bent_axis(p) < radius ? 340.0 : 40.0; });
    const auto moved = [&](const Vec3& by) {
      return drawn.labels([&](const Vec3& p) { return from_bent_axis(p - by) < radius ? 1 : 0; });
    };
    for (const Vec3& by : {Vec3(0, 0, 0), Vec3(0.5, 0, 0), Vec3(0, 0.4, 0.4)}) {
      EXPECT_FALSE(find_near_shift(image, moved(by))) << by.transpose();
    }
    for (const double drawn_as : {0.6, 1.4}) {  // of the radius
      EXPECT_FALSE(find_near_shift(image, drawn.labels([&](const Vec3& p) {
        return from_bent_axis(p) < drawn_as * radius ? 1 : 0;
      })));
    }
    for (const Vec3& by : {Vec3(1.5, 0, 0), Vec3(0, -1.5, 0), Vec3(1, 1, 1)}) {
      const auto near = find_near_shift(image, moved(by));
      ASSERT_TRUE(near) << by.transpose();
      EXPECT_LE((near->shift + by).head<2>().norm(), 0.75) << near->shift.transpose();
    }
  }
}

TEST(LabelFrame, OfAThinTubeOrAWallRoundItsLumenIsThatOfTheVolume) {
  const Drawn drawn;
  double contrast = 0.0;
  for (const double radius : {1.2, 1.6}) {  // two voxels and three across
    const Image image =
        drawn.ct([&](const Vec3& p) { return from_bent_axis(p) < radius ? 340.0 : 40.0; });
    EXPECT_FALSE(find_better_frame(
        image, drawn.labels([&](const Vec3& p) { return from_bent_axis(p) < radius ? 1 : 0; }),
        contrast));
    EXPECT_GT(contrast, 140.0) << radius;
  }
  for (const double wall : {1.0, 2.0, 3.0}) {
    const auto in = [&](const Vec3& p) {
      const double d = from_bent_axis(p);
      return d < 5.0 ? 1 : d < 5.0 + wall ? 2 : 0;
    };
    const Image image = drawn.ct([&](const Vec3& p) {
      return std::array{-90.0, 300.0, 50.0}[static_cast<std::size_t>(in(p))];
    });
    for (const std::uint8_t only : std::initializer_list<std::uint8_t>{0, 1, 2}) {
      EXPECT_FALSE(find_better_frame(image, drawn.labels(in), contrast, only)) << wall << only;
    }
    EXPECT_GT(contrast, 80.0) << wall;  // of the wall, by its inner edge
    EXPECT_FALSE(find_better_frame(
        image, drawn.labels([&](const Vec3& p) { return in(p) == 2 ? 1 : 0; }), contrast));
  }
}

}  // namespace
}  // namespace wireplan::preprocess
