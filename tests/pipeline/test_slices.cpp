// Slices of a volume with the outline of the lumen.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "pipeline/report/slices.h"
#include "tests/shapes.h"

namespace wireplan::pipeline {
namespace {

// A value that is linear in LPS, on an oblique grid: interpolation gives it back exactly.
const Vec3 kSlope(1.5, -2.0, 0.7);
preprocess::Image linear_image() {
  preprocess::Image image;
  image.grid.size = {20, 16, 12};
  image.grid.spacing = {0.8, 1.1, 2.0};
  image.grid.origin = {-5.0, 3.0, 40.0};
  image.grid.direction =
      Eigen::AngleAxisd(0.4, Vec3(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
  for (int k = 0; k < 12; ++k) {
    for (int j = 0; j < 16; ++j) {
      for (int i = 0; i < 20; ++i) {
        image.values.push_back(
            static_cast<float>(100.0 + kSlope.dot(image.grid.lps_from_ijk(Vec3(i, j, k)))));
      }
    }
  }
  return image;
}

TEST(Slices, SampleALinearFieldExactlyOnAnObliqueGrid) {
  const preprocess::Image image = linear_image();
  for (const Vec3& place :
       {Vec3(0, 0, 0), Vec3(19, 15, 11), Vec3(3.3, 7.7, 5.5), Vec3(18.99, 0.01, 4)}) {
    const Vec3 point = image.grid.lps_from_ijk(place);
    EXPECT_NEAR(sample(image, point), 100.0 + kSlope.dot(point), 1e-4) << "single precision";
  }
  EXPECT_TRUE(std::isnan(sample(image, image.grid.lps_from_ijk(Vec3(-0.1, 3, 3)))));
  EXPECT_TRUE(std::isnan(sample(image, image.grid.lps_from_ijk(Vec3(3, 3, 11.1)))));
}

TEST(Slices, SampleAVolumeOfOneSlice) {
  preprocess::Image image;
  image.grid.size = {2, 1, 1};
  image.values = {10.0F, 20.0F};
  EXPECT_NEAR(sample(image, Vec3(0.25, 0.0, 0.0)), 12.5, 1e-6);
}

TEST(Slices, RunAsRadiologistsLookAtThem) {
  // Patient's right at the left, front and head up: x of LPS is to the left, y to the back.
  EXPECT_EQ(right_of(Plane::kAxial), Vec3::UnitX());
  EXPECT_EQ(down_of(Plane::kAxial), Vec3::UnitY());
  EXPECT_EQ(right_of(Plane::kCoronal), Vec3::UnitX());
  EXPECT_EQ(down_of(Plane::kCoronal), -Vec3::UnitZ());
  EXPECT_EQ(right_of(Plane::kSagittal), Vec3::UnitY());
  EXPECT_EQ(down_of(Plane::kSagittal), -Vec3::UnitZ());
}

TEST(Slices, OutlineATubeAsACircleAcrossAndAsTwoLinesAlong) {
  const double radius = 4.0;
  const Surface tube = shapes::straight_tube(radius, 60.0, 0.5);
  const Vec3 middle(0.5, -0.25, 30.1);
  const Eigen::Matrix4Xf across = cut_outline(tube, Plane::kAxial, middle, 40.0);
  ASSERT_GT(across.cols(), 40);
  double length = 0.0;
  for (Eigen::Index k = 0; k < across.cols(); ++k) {
    for (const int end : {0, 2}) {
      const double x = across(end, k) + middle.x(), y = across(end + 1, k) + middle.y();
      EXPECT_NEAR(std::hypot(x, y), radius, 0.01) << "sagitta of an edge of 0.5 mm: 0.008 mm";
    }
    length += (across.col(k).head<2>() - across.col(k).tail<2>()).norm();
  }
  EXPECT_NEAR(length, 2.0 * kPi * radius, 0.05) << "once round";

  const Eigen::Matrix4Xf along = cut_outline(tube, Plane::kCoronal, middle, 40.0);
  double line = 0.0;
  for (Eigen::Index k = 0; k < along.cols(); ++k) {
    EXPECT_NEAR(std::abs(along(0, k) + middle.x()), std::sqrt(radius * radius - 0.0625), 0.01);
    line += (along.col(k).head<2>() - along.col(k).tail<2>()).norm();
  }
  EXPECT_NEAR(line, 2.0 * 40.0, 2.0) << "both sides of a field of 40 mm, and an edge at each end";
}

TEST(Slices, ShowTheVolumeWhereTheOutlineIs) {
  // Bright inside the tube of the surface, on an oblique grid.
  preprocess::Image image = linear_image();
  image.grid.size = {60, 60, 60};
  image.grid.spacing = Vec3::Constant(0.5);
  image.grid.origin = image.grid.direction * Vec3::Constant(-15.0) + Vec3(0.0, 0.0, 30.0);
  image.values.assign(image.grid.voxels(), 0.0F);
  for (int k = 0; k < 60; ++k) {
    for (int j = 0; j < 60; ++j) {
      for (int i = 0; i < 60; ++i) {
        const Vec3 p = image.grid.lps_from_ijk(Vec3(i, j, k));
        image.values[image.grid.index(i, j, k)] = p.head<2>().norm() < 4.0 ? 100.0F : 0.0F;
      }
    }
  }
  const Surface tube = shapes::straight_tube(4.0, 60.0, 0.5);
  const Slices slices =
      cut_slices(image, tube, {{"middle", Vec3(0.0, 0.0, 30.0), {}}},
                 {.size = 80, .field = 16.0, .window_low = 0.0, .window_high = 100.0});
  const Slice& axial = slices.places.at(0).slices[0];
  int checked = 0;
  for (int row = 0; row < 80; ++row) {
    for (int column = 0; column < 80; ++column) {
      const double distance = 0.2 * std::hypot(column - 39.5, row - 39.5);
      if (std::abs(distance - 4.0) < 0.9) continue;  // a voxel's diagonal: interpolated
      EXPECT_EQ(axial.gray[static_cast<std::size_t>(row) * 80 + column], distance < 4.0 ? 255 : 0);
      ++checked;
    }
  }
  EXPECT_GT(checked, 3000);
  EXPECT_GT(axial.outline.cols(), 40);
  const std::string jpeg = encode_jpeg(axial.gray, 80);
  EXPECT_EQ(jpeg.substr(0, 2), "\xff\xd8") << "as a JPEG starts";
  EXPECT_EQ(jpeg, encode_jpeg(axial.gray, 80));
}

}  // namespace
}  // namespace wireplan::pipeline
