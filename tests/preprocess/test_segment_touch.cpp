// Limbs of one vessel that touch: with a dip in the values, without one, and loops that are real.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "preprocess/segment/segment.h"
#include "tests/preprocess/segment_answers.h"

namespace wireplan::preprocess {
namespace {

constexpr double kTissueHu = 40.0, kContrastHu = 300.0, kLimb = 3.0;

/// The axis of a vessel that goes up, turns at z = 70 and comes back; at z = 30 the axes of the
/// limbs are `apart` from each other, elsewhere 14 mm.
std::vector<Vec3> limbs_axis(double apart) {
  std::vector<Vec3> up;
  for (double z = 0.0; z < 63.0; z += 0.5) {
    const double bow = std::exp(-std::pow((z - 30.0) / 10.0, 2.0));
    up.emplace_back(-7.0 + (7.0 - 0.5 * apart) * bow, 0.0, z);
  }
  std::vector<Vec3> axis = up;
  for (double turn = 0.0; turn <= kPi; turn += 0.05) {
    axis.emplace_back(-7.0 * std::cos(turn), 0.0, 63.0 + 7.0 * std::sin(turn));
  }
  std::reverse(up.begin(), up.end());
  for (const Vec3& p : up) axis.emplace_back(-p.x(), 0.0, p.z());
  return axis;
}

/// A CT in voxels of 0.7 mm, blurred over 1.4 mm at each wall, so that a narrow gap is half filled.
template <typename Filled>
Image limbs_image(Filled filled) {
  const Grid grid{
      .size = {40, 18, 110}, .spacing = Vec3(0.7, 0.7, 0.7), .origin = Vec3(-13.7, -5.9, -2.0)};
  Image image{.grid = grid, .values = {}};
  for (std::size_t n = 0; n < grid.voxels(); ++n) {
    const double part = std::min(1.0, filled(center_of(grid, n)));
    image.values.push_back(static_cast<float>(kTissueHu + kContrastHu * part));
  }
  return image;
}

/// How much of a voxel a wall so far outward leaves inside.
double part_inside(double beyond_wall) { return std::clamp(0.5 - beyond_wall / 1.4, 0.0, 1.0); }

double limbs_at(const std::vector<Vec3>& axis, const Vec3& p) {
  double left = 100.0, right = 100.0;
  for (const Vec3& q : axis) {
    double& side = q.x() < 0.0 ? left : right;
    side = std::min(side, (p - q).norm());
  }
  return part_inside(left - kLimb) + part_inside(right - kLimb);
}

Image touching_limbs(double gap) {
  const std::vector<Vec3> axis = limbs_axis(2.0 * kLimb + gap);
  return limbs_image([&](const Vec3& p) { return limbs_at(axis, p); });
}

SegmentOptions between_limbs(bool band) {
  SegmentOptions options{.seeds = {Vec3(-7, 0, 3)}, .target = Vec3(7, 0, 3)};
  if (!band) return options;
  options.lower_hu = 150.0;
  options.upper_hu = 600.0;
  return options;
}

/// Of the way round: twice 60 mm up, a millimetre for each bow, and half a circle of 7 mm.
constexpr double kRound = 2.0 * 60.0 + 2.0 * 1.0 + kPi * 7.0;

TEST(SegmentTouch, WhereTheValuesDipIsCutAndTheWayLeadsRound) {
  for (const bool band : {false, true}) {
    SCOPED_TRACE(band);
    Image image = touching_limbs(0.4);
    std::mt19937_64 random(11);
    for (float& value : image.values) {  // of sigma 20 HU
      value += 20.0F * (static_cast<float>(random() >> 40U) * 0x1p-24F - 0.5F) * std::sqrt(12.0F);
    }
    const Segmentation found = segment(image, between_limbs(band));
    ASSERT_EQ(found.statistics.touches.size(), 1U);
    const Touch& touch = found.statistics.touches[0];
    EXPECT_TRUE(touch.cut);
    EXPECT_EQ(found.statistics.dipping, 1U);
    EXPECT_LT((touch.place - Vec3(0, 0, 30)).norm(), 1.5) << touch.place.transpose();
    EXPECT_LT(touch.level, touch.side - 60.0);
    EXPECT_LT(touch.through_mm, 70.0);
    EXPECT_NEAR(touch.round_mm, kRound, 0.05 * kRound);  // voxels cut corners
    EXPECT_NEAR(found.statistics.search.route.length_mm, kRound, 0.05 * kRound);
    // A slit is cut, no more: the sheet is 0.7 mm thick and as wide as the contact.
    const Segmentation apart = segment(touching_limbs(2.0), between_limbs(band));
    EXPECT_TRUE(apart.statistics.touches.empty());
    EXPECT_NEAR(found.statistics.volume_mm3, apart.statistics.volume_mm3,
                0.03 * apart.statistics.volume_mm3);
  }
}

TEST(SegmentTouch, ASeedInItSaysThatItIsOpen) {
  SegmentOptions options = between_limbs(true);
  options.seeds.emplace_back(0, 0, 30);
  const Segmentation found = segment(touching_limbs(0.4), options);
  EXPECT_TRUE(found.statistics.touches.empty());
  EXPECT_TRUE(contains(found.mask, Vec3(0, 0, 30)));
}

TEST(SegmentTouch, IsFoundBesideAnotherVesselWithASeed) {
  // Two pieces, one of them with a loop.
  const std::vector<Vec3> axis = limbs_axis(2.0 * kLimb + 0.4);
  const Vec3 other(0, 0, 50);
  const Image image = limbs_image([&](const Vec3& p) {
    return std::max(limbs_at(axis, p), part_inside((p - other).norm() - 2.0));
  });
  SegmentOptions options = between_limbs(true);
  options.seeds.push_back(other);
  const Segmentation found = segment(image, options);
  EXPECT_TRUE(contains(found.mask, other));
  ASSERT_EQ(found.statistics.touches.size(), 1U);
  EXPECT_TRUE(found.statistics.touches[0].cut);
}

TEST(SegmentTouch, WithoutADipIsToldAndStays) {
  for (const bool band : {false, true}) {
    SCOPED_TRACE(band);
    const Segmentation found = segment(touching_limbs(-1.0), between_limbs(band));
    ASSERT_EQ(found.statistics.touches.size(), 1U);
    const Touch& touch = found.statistics.touches[0];
    EXPECT_FALSE(touch.cut);
    EXPECT_EQ(found.statistics.dipping, 0U);
    EXPECT_LT((touch.place - Vec3(0, 0, 30)).norm(), 1.5) << touch.place.transpose();
    // Half a lens of two circles whose axes are 5 mm apart: sqrt(9 - 2.5^2) high; a voxel.
    EXPECT_NEAR(touch.level, 1.66, 0.7);
    EXPECT_NEAR(touch.side, kLimb, 0.7);
    EXPECT_LT(touch.through_mm, 70.0);
    EXPECT_TRUE(contains(found.mask, Vec3(0, 0, 30)));
  }
}

TEST(SegmentTouch, ABandAboveTheContactAndItsWidthPartTheLimbs) {
  // What a person is told to give. The contact has 300 HU and is 1.05 mm in radius.
  SegmentOptions options = between_limbs(true);
  options.lower_hu = 300.0;
  options.neck_opening_mm = 1.35;
  const Segmentation found = segment(touching_limbs(0.0), options);
  EXPECT_TRUE(found.statistics.touches.empty());
  EXPECT_NEAR(found.statistics.search.route.length_mm, kRound, 0.05 * kRound);
}

TEST(SegmentTouch, ARealLoopStaysAndIsNotTold) {
  // A vessel as wide as both limbs joins them half way up.
  const std::vector<Vec3> axis = limbs_axis(14.0);
  const Image image = limbs_image([&](const Vec3& p) {
    const double bridge = std::max(std::hypot(p.y(), p.z() - 30.0) - kLimb, std::abs(p.x()) - 7.0);
    return std::max(limbs_at(axis, p), part_inside(bridge));
  });
  const Segmentation found = segment(image, between_limbs(true));
  EXPECT_EQ(found.statistics.shape.handles, 1U);
  EXPECT_TRUE(found.statistics.touches.empty());
  EXPECT_TRUE(contains(found.mask, Vec3(0, 0, 30)));
}

TEST(SegmentTouch, ANarrowedVesselIsToldAndStays) {
  // The same, narrowed to 0.6 mm over 4 mm: darker there, but no touch.
  const std::vector<Vec3> axis = limbs_axis(14.0);
  const Image image = limbs_image([&](const Vec3& p) {
    const double radius = std::abs(p.x()) < 2.0 ? 0.6 : kLimb;
    const double bridge = std::max(std::hypot(p.y(), p.z() - 30.0) - radius, std::abs(p.x()) - 7.0);
    return std::max(limbs_at(axis, p), part_inside(bridge));
  });
  const Segmentation found = segment(image, between_limbs(true));
  EXPECT_TRUE(contains(found.mask, Vec3(0, 0, 30)));
  ASSERT_EQ(found.statistics.touches.size(), 1U);
  EXPECT_FALSE(found.statistics.touches[0].cut);
  EXPECT_LT((found.statistics.touches[0].place - Vec3(0, 0, 30)).norm(), 2.5);
}

TEST(SegmentTouch, AHoleInAVesselIsNone) {
  // Calcium in the middle of a tube of 6 mm: a loop, 12 mm round.
  const Grid grid{
      .size = {40, 40, 60}, .spacing = Vec3(0.7, 0.7, 0.7), .origin = Vec3(-13.7, -13.7, 0)};
  Image image{.grid = grid, .values = {}};
  for (std::size_t n = 0; n < grid.voxels(); ++n) {
    const Vec3 p = center_of(grid, n);
    const bool hole = std::hypot(p.x(), p.z() - 20.0) < 1.5;
    image.values.push_back(hole ? 0.0F : std::hypot(p.x(), p.y()) < 6.0 ? 300.0F : 40.0F);
  }
  const Segmentation found = segment(
      image,
      {.lower_hu = 170.0, .upper_hu = 500.0, .seeds = {Vec3(0, 0, 3)}, .target = Vec3(0, 0, 38)});
  EXPECT_EQ(found.statistics.shape.handles, 1U);
  EXPECT_TRUE(found.statistics.touches.empty());
}

}  // namespace
}  // namespace wireplan::preprocess
