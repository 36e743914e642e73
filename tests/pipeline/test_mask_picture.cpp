// The first look at a segmentation: the outline lies where the mask ends, in slices and along the
// way.
#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/report/mask_picture.h"

namespace wireplan::pipeline {
namespace {

constexpr double kVesselRadius = 6.0;  // mm

/// A vessel of 300 HU in tissue of 40: a quarter of a circle of 60 mm radius in the plane y = 0,
/// from (0, 0, 0), where it rises, to (60, 0, 60).
struct BentVessel {
  preprocess::Image image;
  preprocess::Mask mask;
  std::vector<Vec3> way;

  BentVessel() {
    image.grid.size = {120, 60, 120};
    image.grid.spacing = Vec3::Constant(0.8);
    image.grid.origin = Vec3(-20, -24, -15);
    image.values.assign(image.grid.voxels(), 40.0F);
    mask = {image.grid, std::vector<std::uint8_t>(image.grid.voxels(), 0)};
    const Vec3 middle(60, 0, 0);
    for (int k = 0; k < 120; ++k) {
      for (int j = 0; j < 60; ++j) {
        for (int i = 0; i < 120; ++i) {
          const Vec3 p = image.grid.lps_from_ijk(Vec3(i, j, k));
          const double off =
              std::hypot(std::hypot(p.x() - middle.x(), p.z() - middle.z()) - 60.0, p.y());
          if (off >= kVesselRadius || p.x() > 65.0) continue;
          image.values[image.grid.index(i, j, k)] = 300.0F;
          mask.labels[image.grid.index(i, j, k)] = 1;
        }
      }
    }
    for (int k = 0; k <= 90; ++k) {
      const double angle = k * kRadPerDeg;
      way.emplace_back(middle + 60.0 * Vec3(-std::cos(angle), 0.0, std::sin(angle)));
    }
  }
};

bool is_outline(const Picture& picture, int x, int top) {
  const std::size_t pixel =
      3 * (static_cast<std::size_t>(picture.height - 1 - top) * picture.width + x);
  return picture.rgb[pixel] > 240 && picture.rgb[pixel + 1] > 170 && picture.rgb[pixel + 1] < 215 &&
         picture.rgb[pixel + 2] < 60;
}

/// As mask_picture.h has them: margin, line of text, slice, gap.
constexpr int kLookMargin = 16, kLookTitle = 26, kLookSlice = 240, kLookGap = 8;

TEST(MaskPicture, OutlineLiesWhereTheMaskEndsInASlice) {
  const BentVessel vessel;
  const Picture picture = draw_mask_picture({.image = vessel.image,
                                             .mask = vessel.mask,
                                             .places = {{"access", {0, 0, 0}}},
                                             .window_low = 0.0,
                                             .window_high = 400.0});
  // Axial through the beginning: a circle of 6 mm, at 0.4 mm per pixel.
  const double spacing = 96.0 / kLookSlice;
  int count = 0;
  for (int row = 0; row < kLookSlice; ++row) {
    for (int column = 0; column < kLookSlice; ++column) {
      if (!is_outline(picture, kLookMargin + column, kLookMargin + 2 * kLookTitle + row)) continue;
      const double off =
          spacing * std::hypot(column - 0.5 * (kLookSlice - 1), row - 0.5 * (kLookSlice - 1));
      EXPECT_NEAR(off, kVesselRadius,
                  1.2);  // a voxel's corner is 0.57 mm from its middle, and a pixel
      ++count;
    }
  }
  EXPECT_GT(count, 60);  // its length is 94 pixels
}

TEST(MaskPicture, TheWayIsStraightened) {
  const BentVessel vessel;
  const Picture picture = draw_mask_picture({.image = vessel.image,
                                             .mask = vessel.mask,
                                             .way = vessel.way,
                                             .window_low = 0.0,
                                             .window_high = 400.0});
  // Strips of the whole width: 94 mm of way on it, and 48 mm across at that scale or 240 pixels.
  const int width = picture.width - 2 * kLookMargin, height = 240;
  const double spacing = 0.5 * kPi * 60.0 / width;
  int count = 0;
  for (const int first :
       {kLookMargin + 2 * kLookTitle, kLookMargin + 2 * kLookTitle + height + kLookGap}) {
    for (int row = 0; row < height; ++row) {
      for (int column = 100; column < width - 100; ++column) {
        if (!is_outline(picture, kLookMargin + column, first + row)) continue;
        EXPECT_NEAR(spacing * std::abs(row - 0.5 * (height - 1)), kVesselRadius, 1.0);
        ++count;
      }
    }
  }
  EXPECT_GT(count, 4 * (width - 200));  // two edges in each of two strips
}

TEST(MaskPicture, GrowsWithItsPlacesTwoInARow) {
  const BentVessel vessel;
  const auto height = [&](int count) {
    return draw_mask_picture({.image = vessel.image,
                              .mask = vessel.mask,
                              .places = std::vector<MarkedPlace>(count, {"here", {0, 0, 0}}),
                              .window_low = 0.0,
                              .window_high = 400.0})
        .height;
  };
  EXPECT_EQ(height(1), height(2));
  EXPECT_EQ(height(3) - height(2), kLookTitle + kLookSlice + kLookGap);
}

}  // namespace
}  // namespace wireplan::pipeline
