#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "preprocess/segment/segment.h"
#include "tests/preprocess/segment_answers.h"

namespace wireplan::preprocess {
namespace {

constexpr float kTissue = 40.0F, kLumen = 300.0F;

/// A volume with the HU that the function gives for each voxel's centre [mm].
template <typename Hu>
Image volume(const Grid& grid, Hu hu) {
  Image image{.grid = grid, .values = std::vector<float>(grid.voxels())};
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        image.values[grid.index(i, j, k)] = hu(grid.lps_from_ijk(Vec3(i, j, k)));
      }
    }
  }
  return image;
}

/// Noise of the given sigma [HU]: the sum of 12 uniforms, near enough to a Gaussian.
void add_noise(Image& image, double sigma) {
  std::mt19937_64 random(7);
  for (float& value : image.values) {
    double sum = -6.0;
    for (int n = 0; n < 12; ++n) {
      sum += static_cast<double>(random() >> 11) * 0x1.0p-53;
    }
    value += static_cast<float>(sigma * sum);
  }
}

/// Distance from the z axis [mm].
double from_axis(const Vec3& p) { return std::hypot(p.x(), p.y()); }

float tube(const Vec3& p, double radius) { return from_axis(p) < radius ? kLumen : kTissue; }

/// 30 x 30 x 40 mm round the z axis, from z = 0.
Grid ct_grid() {
  return {.size = {43, 43, 51}, .spacing = Vec3(0.7, 0.7, 0.8), .origin = Vec3(-14.7, -14.7, 0)};
}

SegmentOptions options(double smoothing = 0.0, double neck = 0.0) {
  return {.lower_hu = 170.0,
          .upper_hu = 480.0,
          .seeds = {Vec3(0, 0, 20)},
          .smoothing_mm = smoothing,
          .neck_opening_mm = neck};
}

// ---- what is found ------------------------------------------------------------------------------

TEST(Segment, TubeIsFoundVoxelByVoxel) {
  const Image image = volume(ct_grid(), [](const Vec3& p) { return tube(p, 5.0); });
  const Segmentation found = segment(image, options());
  EXPECT_EQ(dice(found.mask, [](const Vec3& p) { return from_axis(p) < 5.0; }), 1.0);
  EXPECT_EQ(found.mask.grid.size, image.grid.size);
  // 51 slices of 0.8 mm; 160 voxels per slice count the circle's area to about 1 %
  EXPECT_NEAR(found.statistics.volume_mm3, kPi * 25.0 * 51 * 0.8, 0.02 * kPi * 25.0 * 51 * 0.8);
  EXPECT_EQ(found.statistics.mean_hu, kLumen);
  EXPECT_TRUE(found.statistics.touches_border);
}

TEST(Segment, NoisyTubeIsFoundAfterSmoothing) {
  Image image = volume(ct_grid(), [](const Vec3& p) { return tube(p, 5.0); });
  add_noise(image, 50.0);
  const Segmentation found = segment(image, options(0.8));
  // of the voxels, 18 % lie within half a voxel of the edge; noise turns few of them
  EXPECT_GT(dice(found.mask, [](const Vec3& p) { return from_axis(p) < 5.0; }), 0.97);
  EXPECT_NEAR(found.statistics.mean_hu, kLumen, 10.0);  // tissue at the edge
}

TEST(Segment, SmoothingMovesAStepAsTheGaussianPredicts) {
  // Half the volume is bright. A band that starts where a Gaussian edge has 84.13 % of the step
  // begins one sigma inside, whatever the voxel's size along the axis.
  const double sigma = 2.4;
  SegmentOptions settings = options(sigma);
  settings.lower_hu = kTissue + 0.8413 * (kLumen - kTissue);
  for (int axis = 0; axis < 3; ++axis) {
    SCOPED_TRACE(axis);
    Grid grid{.size = {40, 40, 40}, .spacing = Vec3(0.5, 0.6, 0.8)};
    grid.origin = -19.5 * grid.spacing;  // the step lies between two voxels
    const Image image =
        volume(grid, [&](const Vec3& p) { return p[axis] > 0.0 ? kLumen : kTissue; });
    settings.seeds = {7.0 * Vec3::Unit(axis)};
    const Segmentation found = segment(image, settings);
    const Vec3 extent = 40.0 * grid.spacing;
    const double depth =
        found.statistics.volume_mm3 / (extent.prod() / extent[axis]);  // of the bright part [mm]
    // whole voxels are counted
    EXPECT_NEAR(0.5 * extent[axis] - depth, sigma, 0.51 * grid.spacing[axis]);
  }
}

TEST(Segment, AnswerMovesWithTheGrid) {
  const Image image = volume(ct_grid(), [](const Vec3& p) { return tube(p, 5.0); });
  const Mask straight = segment(image, options(0.8, 1.5)).mask;
  // left-handed and oblique: the same values on a grid placed elsewhere
  Image turned = image;
  turned.grid.direction = Eigen::AngleAxisd(0.4, Vec3(3, 1, 2).normalized()).toRotationMatrix() *
                          Vec3(1, 1, -1).asDiagonal();
  turned.grid.origin = Vec3(100, -200, 50);
  SegmentOptions settings = options(0.8, 1.5);
  settings.seeds = {turned.grid.lps_from_ijk(image.grid.ijk_from_lps(settings.seeds[0]))};
  EXPECT_EQ(segment(turned, settings).mask.labels, straight.labels);
}

TEST(Segment, SeedsInSeparateVesselsFindBoth) {
  const auto inside = [](const Vec3& p) { return std::abs(std::abs(p.x()) - 8.0) < 3.0; };
  const Image image =
      volume(ct_grid(), [&](const Vec3& p) { return inside(p) ? kLumen : kTissue; });
  SegmentOptions settings = options();
  settings.seeds = {Vec3(-8, 0, 20), Vec3(8, 0, 20)};
  EXPECT_EQ(dice(segment(image, settings).mask, inside), 1.0);
  settings.seeds.pop_back();
  EXPECT_EQ(
      dice(segment(image, settings).mask, [&](const Vec3& p) { return inside(p) && p.x() < 0.0; }),
      1.0);
}

TEST(Segment, VesselBeyondAGapThatSmoothingBridgesIsFound) {
  // Half way up, one slice lies below the band. The band alone stops there, so the part of the
  // volume that is worked on has to grow.
  const Image image = volume(ct_grid(), [](const Vec3& p) {
    return std::abs(p.z() - 8.0) < 0.3 && from_axis(p) < 4.0 ? 150.0F : tube(p, 4.0);
  });
  const Mask mask = segment(image, options(0.8)).mask;
  EXPECT_TRUE(contains(mask, Vec3(0, 0, 8)));
  EXPECT_TRUE(contains(mask, Vec3(0, 0, 0)));
  EXPECT_TRUE(contains(mask, Vec3(0, 0, 40)));
  EXPECT_FALSE(contains(segment(image, options()).mask, Vec3(0, 0, 4)));
}

TEST(Segment, EnclosedCalciumIsFilledAndCalciumOnTheWallIsNot) {
  const Vec3 enclosed(0, 0, 10), on_wall(6, 0, 25);
  const Image image = volume(ct_grid(), [&](const Vec3& p) {
    const bool calcium = (p - enclosed).norm() < 2.0 || (p - on_wall).norm() < 2.0;
    return calcium ? 900.0F : tube(p, 6.0);
  });
  for (const double neck : {0.0, 1.5}) {
    const Segmentation found = segment(image, options(0.0, neck));
    EXPECT_TRUE(contains(found.mask, enclosed));
    EXPECT_FALSE(contains(found.mask, on_wall));
  }
}

// ---- leaks --------------------------------------------------------------------------------------

/// A tube of radius 5 mm, a bone as bright beside it, and a bridge of radius 1.4 mm between them.
Image tube_with_bone() {
  Grid grid = ct_grid();
  grid.size[0] = 72;  // to x = 35
  return volume(grid, [](const Vec3& p) {
    const bool bone = p.x() > 8.0 && p.x() < 28.0 && std::abs(p.z() - 20.0) < 15.0;
    const bool bridge = p.x() > 0.0 && p.x() < 9.0 && std::hypot(p.y(), p.z() - 20.0) < 1.4;
    return bone || bridge ? kLumen : tube(p, 5.0);
  });
}

TEST(Segment, LeakThroughANeckIsCutByTheOpening) {
  Image image = tube_with_bone();
  add_noise(image, 30.0);
  const Segmentation cut = segment(image, options(0.6, 2.0));
  EXPECT_FALSE(contains(cut.mask, Vec3(15, 0, 20)));
  EXPECT_GT(cut.statistics.removed_by_opening_mm3, 10000.0);  // the bone has 18 000 mm3
  EXPECT_TRUE(cut.statistics.search.leaks.empty());
  // the stub of the bridge and voxels at the edge
  EXPECT_GT(dice(cut.mask, [](const Vec3& p) { return from_axis(p) < 5.0; }), 0.96);
}

TEST(SegmentLeak, WhatWidensBehindANeckIsCutThereAndTold) {
  Image image = tube_with_bone();
  add_noise(image, 30.0);
  const Segmentation found = segment(image, options(0.6));
  EXPECT_FALSE(contains(found.mask, Vec3(15, 0, 20)));
  EXPECT_GT(dice(found.mask, [](const Vec3& p) { return from_axis(p) < 5.0; }), 0.96);
  ASSERT_EQ(found.statistics.search.leaks.size(), 1U);
  const Leak& leak = found.statistics.search.leaks[0];
  // the bridge runs along x from 5 to 8 mm; a voxel on either side
  EXPECT_LT((leak.place - Vec3(6.5, 0, 20)).norm(), 2.5) << leak.place.transpose();
  EXPECT_NEAR(leak.neck_radius_mm, 1.4, 0.7);    // a voxel
  EXPECT_NEAR(leak.radius_mm, 10.0, 0.8);        // half of the block's 20 mm
  EXPECT_NEAR(leak.volume_mm3, 18000.0, 900.0);  // 20 x 30 x 30 mm, its faces blurred
  EXPECT_NEAR(leak.mean_hu, kLumen, 15.0);
}

TEST(SegmentLeak, ASeedBehindTheNeckKeepsWhatLiesThere) {
  SegmentOptions settings = options();
  settings.seeds.push_back(Vec3(18, 0, 20));
  const Segmentation found = segment(tube_with_bone(), settings);
  EXPECT_TRUE(contains(found.mask, Vec3(15, 0, 20)));
  EXPECT_TRUE(found.statistics.search.leaks.empty());
  // the only way from the tube leads over the bridge of radius 1.4 mm
  EXPECT_NEAR(found.statistics.search.route.narrowest_radius_mm, 1.4, 0.7);
  EXPECT_NEAR(found.statistics.search.route.narrowest.x(), 6.5, 2.5);
}

TEST(SegmentLeak, ATouchingVeinIsCutAndABranchThatTapersIsNot) {
  // trunk of radius 5 mm with a branch of 3 to 1.5 mm on the left; on the right a vein as bright,
  // of 7 mm radius, that touches the trunk over 3 mm
  Grid grid = ct_grid();
  grid.size[0] = 86;
  grid.origin.x() = -29.7;
  const auto artery = [](const Vec3& p) {
    const double along = -p.x() / 30.0;  // of the branch
    return from_axis(p) < 5.0 ||
           (p.x() < 0.0 && std::hypot(p.y(), p.z() - 20.0) < 3.0 - 1.5 * along);
  };
  const auto vein = [](const Vec3& p) { return std::hypot(p.x() - 14.0, p.y()) < 7.0; };
  Image image = volume(grid, [&](const Vec3& p) {
    const bool contact =
        p.x() > 0.0 && p.x() < 9.0 && std::abs(p.z() - 12.0) < 1.5 && std::abs(p.y()) < 1.5;
    return artery(p) || vein(p) || contact ? kLumen : kTissue;
  });
  add_noise(image, 20.0);
  SegmentOptions settings{.seeds = {Vec3(0, 0, 35)}, .target = Vec3(0, 0, 4)};
  const Segmentation found = segment(image, settings);
  EXPECT_FALSE(contains(found.mask, Vec3(14, 0, 20)));
  EXPECT_TRUE(contains(found.mask, Vec3(-25, 0, 20)));
  EXPECT_GT(dice(found.mask, artery), 0.97);
  ASSERT_EQ(found.statistics.search.leaks.size(), 1U);
  EXPECT_LT((found.statistics.search.leaks[0].place - Vec3(6, 0, 12)).norm(), 2.5);
}

TEST(Segment, OpeningLeavesASmoothTubeAlmostAsItIs) {
  const Image image = volume(ct_grid(), [](const Vec3& p) { return tube(p, 5.0); });
  for (const double neck : {1.0, 2.0, 3.0}) {
    SCOPED_TRACE(neck);
    const Segmentation opened = segment(image, options(0.0, neck));
    EXPECT_LT(opened.statistics.removed_by_opening_mm3, 0.01 * opened.statistics.volume_mm3);
  }
}

TEST(Segment, OpeningCutsVesselsThinnerThanTwiceItself) {
  // a trunk of radius 5 mm with a branch of radius 1.5 mm along x
  const Image image = volume(ct_grid(), [](const Vec3& p) {
    return p.x() > 0.0 && std::hypot(p.y(), p.z() - 20.0) < 1.5 ? kLumen : tube(p, 5.0);
  });
  const Vec3 branch(12, 0, 20);
  EXPECT_TRUE(contains(segment(image, options(0.0, 1.0)).mask, branch));
  EXPECT_FALSE(contains(segment(image, options(0.0, 2.2)).mask, branch));

  SegmentOptions settings = options(0.0, 2.2);
  settings.seeds = {branch};
  const std::string error = error_of(image, settings);
  EXPECT_TRUE(has(error, "seed (12.0, 0.0, 20.0) mm") && has(error, "lower neck_opening_mm"))
      << error;
  // nothing in the volume is that wide
  settings.neck_opening_mm = 8.0;
  EXPECT_TRUE(has(error_of(image, settings), "lower neck_opening_mm"));
}

// ---- seeds --------------------------------------------------------------------------------------

TEST(SegmentSeed, OutsideTheVolumeIsAnErrorWithItsBounds) {
  const Image image = volume(ct_grid(), [](const Vec3& p) { return tube(p, 5.0); });
  SegmentOptions settings = options();
  settings.seeds = {Vec3(0, 0, 90)};
  const std::string error = error_of(image, settings);
  EXPECT_TRUE(has(error, "seed (0.0, 0.0, 90.0) mm lies outside the volume")) << error;
  EXPECT_TRUE(has(error, "(-14.7, -14.7, 0.0) to (14.7, 14.7, 40.0) mm in LPS")) << error;
}

TEST(SegmentSeed, GivenInRasIsRecognised) {
  Grid grid = ct_grid();
  grid.origin.x() += 100.0;
  const Image image = volume(grid, [](const Vec3&) { return kLumen; });
  SegmentOptions settings = options();
  settings.seeds = {Vec3(-100, 0, 20)};
  EXPECT_TRUE(has(error_of(image, settings), "negate x and y")) << error_of(image, settings);
}

TEST(SegmentSeed, OutsideTheBandTellsTheValueAndWhatItMayBe) {
  struct Place {
    float hu;
    std::string words;
  };
  for (const Place& place :
       {Place{-1000.0F, "air"}, Place{-80.0F, "fat"}, Place{45.0F, "without contrast"},
        Place{150.0F, "lower lower_hu"}, Place{900.0F, "bone, calcium or metal"}}) {
    SCOPED_TRACE(place.hu);
    const Image image = volume(ct_grid(), [&](const Vec3&) { return place.hu; });
    for (const double smoothing : {0.0, 0.8}) {
      const std::string error = error_of(image, options(smoothing));
      EXPECT_TRUE(has(error, "seed (0.0, 0.0, 20.0) mm")) << error;
      EXPECT_TRUE(has(error, "170 to 480 HU")) << error;
      EXPECT_TRUE(has(error, std::to_string(static_cast<int>(place.hu)) + " HU")) << error;
      EXPECT_TRUE(has(error, place.words)) << error;
    }
  }
}

TEST(SegmentSeed, OnANoisyVoxelMeansTheLumenRoundIt) {
  Image image = volume(ct_grid(), [](const Vec3& p) { return tube(p, 5.0); });
  image.values[image.grid.index(21, 21, 25)] = 60.0F;
  for (const double smoothing : {0.0, 0.8}) {
    const Segmentation found = segment(image, options(smoothing));
    EXPECT_TRUE(contains(found.mask, options().seeds[0]));
    EXPECT_GT(dice(found.mask, [](const Vec3& p) { return from_axis(p) < 5.0; }), 0.97);
  }
}

TEST(Segment, HalfABandIsThePipelinesMistake) {
  const Image image = volume(ct_grid(), [](const Vec3& p) { return tube(p, 5.0); });
  EXPECT_THROW(segment(image, {.lower_hu = 170.0, .seeds = {Vec3(0, 0, 20)}}), LogicError);
  EXPECT_THROW(segment(image, {.lower_hu = 170.0, .upper_hu = 480.0, .seeds = {}}), LogicError);
}

// ---- the band from the volume -------------------------------------------------------------------

TEST(SegmentBand, FollowsFromTheLumenRoundTheSeed) {
  Image image = volume(ct_grid(), [](const Vec3& p) { return tube(p, 5.0); });
  add_noise(image, 30.0);
  // in the lumen, and 1 mm beside it
  for (const Vec3& seed : {Vec3(0, 0, 20), Vec3(6, 0, 20)}) {
    SCOPED_TRACE(seed.x());
    if (seed.x() > 5.0) {
      EXPECT_TRUE(has(error_of(image, {.seeds = {seed}}), "no contrast-filled artery at"));
      continue;
    }
    const Segmentation found = segment(image, {.seeds = {seed}});
    const LumenSample& sample = found.statistics.samples.at(0);
    EXPECT_GT(sample.voxels, 200U);
    EXPECT_NEAR(sample.level_hu, kLumen, 6.0);  // median of some 300 voxels
    EXPECT_NEAR(sample.noise_hu, 30.0, 5.0);
    EXPECT_NEAR(found.statistics.band.lower_hu, 50.0 + 0.5 * (kLumen - 50.0), 6.0);
    EXPECT_GT(dice(found.mask, [](const Vec3& p) { return from_axis(p) < 5.0; }), 0.97);
  }
}

TEST(SegmentBand, WithoutContrastIsRefusedWithTheHuMeasured) {
  Image image =
      volume(ct_grid(), [](const Vec3& p) { return from_axis(p) < 5.0 ? 43.0F : -90.0F; });
  add_noise(image, 10.0);
  const std::string error = error_of(image, {.seeds = {Vec3(0, 0, 20)}, .target = Vec3(0, 0, 35)});
  EXPECT_TRUE(has(error, "no contrast-filled artery at (0.0, 0.0, 20.0) mm")) << error;
  EXPECT_TRUE(has(error, "expected at least 140 HU, 100 HU over blood without contrast")) << error;
  // the median of 9 voxels: 43 HU within 10 / sqrt(9) * 1.25, twice that
  const double measured = std::stod(error.substr(error.find("has ") + 4));
  EXPECT_NEAR(measured, 43.0, 8.0) << error;
}

TEST(SegmentBand, SpongyBoneIsRefused) {
  // marrow of 230 HU in a shell of 1.5 mm and 900 HU, both points inside
  Image image = volume(ct_grid(), [](const Vec3& p) {
    const double depth = 10.0 - from_axis(p);
    return depth < 0.0 ? kTissue : depth < 1.5 ? 900.0F : 230.0F;
  });
  add_noise(image, 15.0);
  const std::string error = error_of(image, {.seeds = {Vec3(0, 0, 8)}, .target = Vec3(0, 0, 32)});
  EXPECT_TRUE(has(error, "looks like the inside of a bone")) << error;
}

TEST(SegmentBand, CalciumAndMetalBoundTheLumenAndLeaveNoHole) {
  // plaque of 900 HU on the wall and a speck in the middle, a stent's ring of 3000 HU further up
  const auto plaque = [](const Vec3& p) {
    return (p - Vec3(7, 0, 15)).norm() < 3.0 || (p - Vec3(0, 0, 15)).norm() < 0.9;
  };
  const auto stent = [](const Vec3& p) {
    return std::abs(from_axis(p) - 6.5) < 0.5 && p.z() > 28.0 && p.z() < 36.0;
  };
  Image image = volume(ct_grid(), [&](const Vec3& p) {
    return plaque(p) ? 900.0F : stent(p) ? 3000.0F : tube(p, 6.0);
  });
  add_noise(image, 20.0);
  const Segmentation found = segment(image, {.seeds = {Vec3(0, 0, 5)}, .target = Vec3(0, 0, 38)});
  EXPECT_TRUE(contains(found.mask, Vec3(0, 0, 15)));
  EXPECT_FALSE(contains(found.mask, Vec3(6.5, 0, 15)));
  EXPECT_FALSE(contains(found.mask, Vec3(6.6, 0, 32)));
  EXPECT_TRUE(found.statistics.search.leaks.empty());
  EXPECT_GT(dice(found.mask,
                 [&](const Vec3& p) {
                   return from_axis(p) < 6.0 && (p.x() < 3.0 || !plaque(p)) && !stent(p);
                 }),
            0.97);
}

TEST(SegmentTarget, BehindAnOcclusionIsToldWithTheNearestPointReached) {
  // 6 mm of the tube, from z = 22 to 28, are closed
  Image image = volume(ct_grid(), [](const Vec3& p) {
    return std::abs(p.z() - 25.0) < 3.0 ? kTissue : tube(p, 5.0);
  });
  add_noise(image, 20.0);
  for (const bool band_given : {false, true}) {
    SegmentOptions settings{.seeds = {Vec3(0, 0, 5)}, .target = Vec3(0, 0, 35)};
    if (band_given) {
      settings.lower_hu = 170.0;
      settings.upper_hu = 480.0;
    }
    const std::string error = error_of(image, settings);
    EXPECT_TRUE(has(error,
                    "target (0.0, 0.0, 35.0) mm is not connected with the access "
                    "(0.0, 0.0, 5.0) mm"))
        << error;
    // the last slice of the open part
    EXPECT_TRUE(has(error, ", 21.6) mm, 13.4 mm away")) << error;
    EXPECT_TRUE(has(error, band_given ? "open between them, lower segmentation.lower_hu"
                                      : "open between them, give segmentation.lower_hu"))
        << error;
  }
}

TEST(SegmentTarget, AnywhereInAThickSliceOfTheLumenIsInIt) {
  const Grid thick{
      .size = {43, 43, 8}, .spacing = Vec3(0.7, 0.7, 8), .origin = Vec3(-14.7, -14.7, 0)};
  const Image image = volume(thick, [](const Vec3& p) { return tube(p, 5.0); });
  SegmentOptions asked = options();
  asked.seeds = {Vec3(0.3, 0.3, 11.9)};
  asked.target = Vec3(-0.3, 0.3, 52.1);  // either 3.9 mm from the middle of its slice
  EXPECT_TRUE(contains(segment(image, asked).mask, *asked.target));
}

TEST(Segment, WhatFillsTheVolumeIsNoVessel) {
  const Image image = volume(ct_grid(), [](const Vec3&) { return kLumen; });
  for (const bool band : {true, false}) {
    SegmentOptions asked = options();
    if (!band) asked = {.seeds = {Vec3(0, 0, 20)}, .target = Vec3(0, 0, 35)};
    const std::string error = error_of(image, asked);
    EXPECT_TRUE(has(error, "fills all of the volume that is looked at")) << error;
  }
}

// ---- questions to a mask ------------------------------------------------------------------------

TEST(MaskPoint, ContainsAndDistanceTakeTheNearestVoxel) {
  Mask mask{.grid = {.size = {5, 5, 5}, .spacing = Vec3(1, 1, 2), .origin = Vec3(10, 20, 30)},
            .labels = std::vector<std::uint8_t>(125)};
  EXPECT_EQ(compute_distance(mask, Vec3::Zero()), std::numeric_limits<double>::infinity());
  mask.labels[mask.grid.index(1, 2, 3)] = 1;
  const Vec3 center(11, 22, 36);
  EXPECT_TRUE(contains(mask, center + Vec3(0.49, -0.49, 0.99)));
  EXPECT_FALSE(contains(mask, center + Vec3(0.51, 0, 0)));
  EXPECT_FALSE(contains(mask, center + Vec3(0, 0, -1.01)));
  EXPECT_FALSE(contains(mask, Vec3(1e9, 22, 36)));
  EXPECT_FALSE(contains(mask, Vec3::Constant(std::nan(""))));
  EXPECT_NEAR(compute_distance(mask, center + Vec3(3, -4, 12)), 13.0, 1e-12);
  for (const double along : {0.99, 1.01}) {
    const Vec3 point = center + Vec3(0.49, -0.49, along);
    const double expected = along < 1.0 ? 0.0 : (point - center).norm();
    EXPECT_DOUBLE_EQ(compute_distance(mask, point), expected);
    EXPECT_DOUBLE_EQ(nearest_label(mask.grid, mask.labels, point).distance, expected);
  }
}

}  // namespace
}  // namespace wireplan::preprocess
