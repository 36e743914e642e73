// Segmentation from two points alone: levels that follow the vessel, and what touches it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "preprocess/segment/mask_shape.h"
#include "preprocess/segment/segment.h"
#include "preprocess/segment/segment_band.h"
#include "preprocess/segment/segment_way.h"
#include "tests/preprocess/segment_answers.h"

namespace wireplan::preprocess {
namespace {

constexpr double kAround = 40.0;  // soft tissue                                            [HU]

/// Round the z axis, 0 to 90 mm, voxels of 0.8 x 0.8 x 1 mm.
Grid upright_grid() {
  return {.size = {60, 60, 91}, .spacing = Vec3(0.8, 0.8, 1.0), .origin = Vec3(-23.6, -23.6, 0)};
}

/// HU(point), blurred by 0.6 mm, with independent noise of this sigma, from a fixed seed.
template <typename Hu>
Image scanned(double sigma, Hu hu) {
  Image image{.grid = upright_grid(), .values = {}};
  for (std::size_t n = 0; n < image.grid.voxels(); ++n) {
    image.values.push_back(static_cast<float>(hu(preprocess::center_of(image.grid, n))));
  }
  smooth(image.grid, 0.6, image.values);
  std::mt19937_64 random(11);
  for (float& value : image.values) {
    double sum = -6.0;
    for (int n = 0; n < 12; ++n) sum += static_cast<double>(random() >> 11) * 0x1.0p-53;
    value += static_cast<float>(sigma * sum);
  }
  return image;
}

double off_axis(const Vec3& p, double x) { return std::hypot(p.x() - x, p.y()); }

/// From 250 HU at the bottom to 150 at 90 mm.
double falling(const Vec3& p) { return 250.0 - 100.0 * p.z() / 90.0; }

const Vec3 kBottom(0, 0, 5), kTop(0, 0, 85);

// ---- levels -------------------------------------------------------------------------------------

TEST(SegmentLevel, ContrastThatFallsAlongTheVesselIsFollowed) {
  const Image image =
      scanned(15.0, [](const Vec3& p) { return off_axis(p, 0) < 5.0 ? falling(p) : kAround; });
  const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
  EXPECT_GT(dice(found.mask, [](const Vec3& p) { return off_axis(p, 0) < 5.0; }), 0.96);
  EXPECT_TRUE(found.statistics.search.leaks.empty());
  EXPECT_TRUE(found.statistics.way_doubts.empty());
  EXPECT_EQ(found.statistics.shape.handles, 0U);
  // As many handles as a case may allow.
  const SegmentOptions any = {
      .seeds = {kBottom}, .target = kTop, .limits = {.handles = 1'000'000'000}};
  EXPECT_EQ(segment(image, any).mask.labels, found.mask.labels);
  // Every 10 mm of 80, and the ends, which a mean of what lies on one side of them misses by 8 HU.
  ASSERT_GE(found.statistics.along.size(), 9U);
  for (const LevelAlong& place : found.statistics.along) {
    EXPECT_NEAR(place.level_hu, falling(place.place), 5.0) << place.place.transpose();
  }
}

TEST(SegmentLevel, AnArteryOfLittleContrastInFatIsAsWideAsInSoftTissue) {
  // Noise asks for smoothing, which draws the fat behind a wall of 1 mm into the lumen's edge.
  for (const double around : {kAround, -100.0}) {
    SCOPED_TRACE(around);
    const Image image = scanned(20.0, [&](const Vec3& p) {
      return off_axis(p, 0) < 5.0 ? 150.0 : off_axis(p, 0) < 6.0 ? kAround : around;
    });
    const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
    EXPECT_EQ(found.statistics.band.smoothing_mm, 0.8);
    const double height = image.grid.spacing.z() * image.grid.size[2];
    const double radius = std::sqrt(found.statistics.volume_mm3 / height / std::numbers::pi);
    EXPECT_NEAR(radius, 5.0, 0.15);
  }
}

/// A tube upright or aslant round the z axis, with a narrow place of this radius in its middle, or
/// closed there: inside, in its wall of 1 mm, or beyond.
struct NarrowTube {
  double narrow = 0.0, lean = 0.0;  // [mm], and mm along x and y per mm along z
  bool closed = false;
  double off(const Vec3& p) const {
    const double shift = lean * (p.z() - 45.0);
    const Vec3 along = Vec3(lean, lean, 1.0).normalized(), q(p.x() - shift, p.y() - shift, 0.0);
    return (q - q.dot(along) * along).norm();
  }
  double radius(double z) const {
    const double u = std::min(1.0, std::abs(z - 45.0) / 8.0);
    const double part = std::pow(std::cos(0.5 * std::numbers::pi * u), 2);
    return 2.6 - (2.6 - narrow) * part;
  }
  double hu(const Vec3& p, double level, double around) const {
    const double radius_here = radius(p.z());
    if (off(p) < radius_here) return closed && std::abs(p.z() - 45.0) < 3.0 ? kAround : level;
    return off(p) < radius_here + 1.0 ? kAround : around;
  }
};

TEST(SegmentLevel, ANarrowPlaceInFatOfLittleContrastIsPassedAndAClosedOneIsNot) {
  // The fat, which smoothing draws into what is thin, makes its outer voxels darker than soft
  // tissue is.
  for (const double lean : {0.0, 0.2}) {
    for (const double around : {kAround, -100.0}) {
      SCOPED_TRACE(around);
      NarrowTube tube{.narrow = 1.4, .lean = lean};
      const SegmentOptions asked = {.seeds = {Vec3(-40.0 * lean, -40.0 * lean, 5)},
                                    .target = Vec3(40.0 * lean, 40.0 * lean, 85)};
      const auto hu = [&](const Vec3& p) { return tube.hu(p, 160.0, around); };
      const Segmentation found = segment(scanned(20.0, hu), asked);
      EXPECT_EQ(measure_shape(found.mask.grid, found.mask.labels).pieces, 1U);
      for (const Vec3& place : found.statistics.search.route.points) {
        EXPECT_LT(tube.off(place), tube.radius(place.z())) << place.transpose();
      }
      tube.closed = true;
      EXPECT_TRUE(has(error_of(scanned(20.0, hu), asked), "is not connected with the access"));
    }
  }
}

TEST(SegmentLevel, AnArteryThatAWideVeinLiesOnIsKeptRoundTheWay) {
  // The vein, as bright and over three times as wide, touches as widely as the artery is wide: cut
  // off, it took with it what lies round the way.
  const auto artery = [](const Vec3& p) { return off_axis(p, 0) < 2.8; };
  for (const double overlap : {1.0, 1.5}) {
    SCOPED_TRACE(overlap);
    const auto vein = [&](const Vec3& p) {
      return std::hypot(p.y() - 11.8 + overlap, p.z() - 45.0) < 9.0;
    };
    const Image image =
        scanned(10.0, [&](const Vec3& p) { return artery(p) || vein(p) ? 300.0 : kAround; });
    const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
    EXPECT_EQ(measure_shape(found.mask.grid, found.mask.labels).pieces, 1U);
    EXPECT_GT(dice(found.mask, artery), 0.99);
  }
}

TEST(SegmentLevel, WhereContrastFallsTheArteryGoesOnBehindTheTarget) {
  // Up to a quarter of the contrast is noise: a way seeks bright voxels, and what it found
  // of the level at its end was so high that the artery behind it counted as another vessel.
  const auto level = [](const Vec3& p) { return 190.0 - 60.0 * p.z() / 90.0; };
  for (const double noise : {15.0, 30.0}) {
    SCOPED_TRACE(noise);
    const Image image =
        scanned(noise, [&](const Vec3& p) { return off_axis(p, 0) < 5.6 ? level(p) : kAround; });
    const Vec3 target(0, 0, 45);
    const Segmentation found = segment(image, {.seeds = {kBottom}, .target = target});
    EXPECT_NEAR(found.statistics.along.back().level_hu, level(target), 5.0);
    EXPECT_TRUE(contains(found.mask, kTop));
    EXPECT_GT(dice(found.mask, [](const Vec3& p) { return off_axis(p, 0) < 5.6; }), 0.94);
  }
}

TEST(SegmentLevel, AFalseLumenOfThreeFifthsOfTheContrastEndsAtTheMembrane) {
  const auto is_true = [](const Vec3& p) { return off_axis(p, 0) < 8.0 && p.x() < 2.0; };
  const Image image = scanned(12.0, [&](const Vec3& p) {
    return is_true(p) ? 400.0 : off_axis(p, 0) < 8.0 ? 260.0 : kAround;
  });
  const Segmentation found = segment(image, {.seeds = {Vec3(-3, 0, 5)}, .target = Vec3(-3, 0, 85)});
  EXPECT_GT(dice(found.mask, is_true), 0.95);
}

TEST(SegmentLevel, TheWayKeepsToItsVesselThoughAWiderOneOfItsLevelTouchesAndIsShorter) {
  // The artery bows out by 14 mm; a vein of 1.4 times its radius touches it before and behind.
  const auto bow = [](double z) {
    const double s = std::sin(std::numbers::pi * (z - 5.0) / 80.0);
    return -14.0 * s * s;
  };
  const auto artery = [&](const Vec3& p) { return off_axis(p, bow(p.z())) < 3.5; };
  const auto vein = [](const Vec3& p) {
    return p.z() > 12.0 && p.z() < 78.0 && off_axis(p, 5.6) < 5.0;
  };
  const Image image =
      scanned(10.0, [&](const Vec3& p) { return artery(p) || vein(p) ? 300.0 : kAround; });
  const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
  for (const Vec3& place : found.statistics.search.route.points) {
    EXPECT_LT(off_axis(place, bow(place.z())), 3.5) << place.transpose();
  }
}

TEST(SegmentLevel, TheWayTakesNoShortcutThroughADarkerVein) {
  // The vein, of 80 % of the contrast, leads straight on where the artery bows out by 36 mm, and
  // both of its ends lie in the artery: nowhere is it narrow.
  const auto bow = [](double z) {
    const double s = std::sin(std::numbers::pi * (z - 5.0) / 80.0);
    return 18.0 - 36.0 * s * s;
  };
  const auto artery = [&](const Vec3& p) {
    const double slope = bow(p.z() + 0.5) - bow(p.z() - 0.5);
    return std::hypot((p.x() - bow(p.z())) / std::hypot(1.0, slope), p.y()) < 3.5;
  };
  const auto vein = [](const Vec3& p) {
    return p.z() > 12.0 && p.z() < 78.0 && off_axis(p, 18.0) < 3.5;
  };
  const Image image = scanned(10.0, [&](const Vec3& p) {
    return artery(p) ? 250.0 : vein(p) ? 208.0 : kAround;
  });
  const Segmentation found = segment(image, {.seeds = {Vec3(18, 0, 5)}, .target = Vec3(18, 0, 85)});
  for (const Vec3& place : found.statistics.search.route.points) {
    EXPECT_TRUE(std::abs(place.z() - 45.0) > 20.0 || place.x() < 12.0) << place.transpose();
  }
  EXPECT_GT(found.statistics.search.route.length_mm, 105.0);
}

TEST(SegmentLevel, MarrowOfTheArterysLevelIsLeftOutThoughItsCortexIsOpen) {
  const auto box = [](const Vec3& p, double low_x, double high_x, double y, double z) {
    return p.x() > low_x && p.x() < high_x && std::abs(p.y()) < y && std::abs(p.z() - 45.0) < z;
  };
  const auto marrow = [&](const Vec3& p) {
    return box(p, 6.0, 11.0, 8.0, 12.0) || box(p, 4.0, 7.0, 1.8, 5.0);
  };
  const Image image = scanned(10.0, [&](const Vec3& p) {
    return off_axis(p, 0) < 5.0 || marrow(p) ? 190.0
           : box(p, 4.5, 18.0, 11.0, 15.0)   ? 1000.0
                                             : kAround;
  });
  const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
  EXPECT_FALSE(contains(found.mask, Vec3(8.5, 5, 45)));
  EXPECT_GT(dice(found.mask, [](const Vec3& p) { return off_axis(p, 0) < 5.0; }), 0.9);
  ASSERT_FALSE(found.statistics.search.leaks.empty());
  EXPECT_LT((found.statistics.search.leaks.front().place - Vec3(6, 0, 45)).norm(), 7.0);
}

/// An artery of 5 mm and 300 HU, and beside it what has 57 % of its contrast.
template <typename Beside>
Segmentation beside_artery(Beside beside) {
  const Image image = scanned(8.0, [&](const Vec3& p) {
    return off_axis(p, 0) < 5.0 ? 300.0 : beside(p) ? 188.0 : kAround;
  });
  return segment(image, {.seeds = {kBottom}, .target = kTop});
}

TEST(SegmentLevel, ABranchThatFillsLessIsKeptAndTold) {
  const auto branch = [](const Vec3& p) {
    return p.x() > 0.0 && std::hypot(p.y(), p.z() - 45.0 - 0.3 * p.x()) < 2.0;
  };
  const Segmentation found = beside_artery(branch);
  EXPECT_GT(dice(found.mask, [&](const Vec3& p) { return off_axis(p, 0) < 5.0 || branch(p); }),
            0.96);
  EXPECT_TRUE(contains(found.mask, Vec3(18, 0, 50.4)));
  ASSERT_EQ(found.statistics.branches.size(), 1U);
  const Leak& told = found.statistics.branches.front();
  EXPECT_LT((told.place - Vec3(5.5, 0, 46.6)).norm(), 2.0) << told.place.transpose();
  EXPECT_NEAR(told.radius_mm, 2.0, 0.4);
  EXPECT_NEAR(told.mean_hu, 180.0, 15.0);
}

TEST(SegmentLevel, ABranchWhoseMouthTouchesAnOrganIsKept) {
  // At 45 % of the artery's contrast branch and organ are one, at 55 % they are not.
  const auto branch = [](const Vec3& p) {
    return p.x() > 0.0 && std::hypot(p.y(), p.z() - 45.0 - 0.3 * p.x()) < 2.5;
  };
  const auto organ = [](const Vec3& p) { return p.x() > 3.0 && p.y() < -2.0; };
  const Image image = scanned(6.0, [&](const Vec3& p) {
    return off_axis(p, 0) < 5.0 ? 300.0 : branch(p) ? 208.0 : organ(p) ? 172.0 : kAround;
  });
  const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
  EXPECT_TRUE(contains(found.mask, Vec3(18, 0, 50.4)));
  EXPECT_FALSE(contains(found.mask, Vec3(12, -8, 45)));
  EXPECT_GT(dice(found.mask, [&](const Vec3& p) { return off_axis(p, 0) < 5.0 || branch(p); }),
            0.95);
}

TEST(SegmentLevel, ABranchThatLeavesBesideANodeIsKept) {
  // What plaque leaves of the branch's mouth and the node touch the artery in one place.
  const auto branch = [](const Vec3& p) {
    return p.x() > 0.0 && std::hypot(p.y(), p.z() - 45) < 2;
  };
  const auto node = [](const Vec3& p) { return (p - Vec3(7.0, 4.4, 45.0)).norm() < 2.8; };
  const Image image = scanned(8.0, [&](const Vec3& p) {
    return off_axis(p, 0) < 5.0       ? 300.0
           : branch(p) && p.x() > 7.0 ? 300.0
           : branch(p) || node(p)     ? 205.0
                                      : kAround;
  });
  const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
  EXPECT_TRUE(contains(found.mask, Vec3(18, 0, 45)));
  EXPECT_FALSE(contains(found.mask, Vec3(7.5, 5.5, 45)));
  EXPECT_EQ(found.statistics.branches.size(), 1U);
}

TEST(SegmentLevel, AVeinThatPassesByOrAnOrganIsNoBranch) {
  const auto vein = [](const Vec3& p) { return std::hypot(p.x() - 6.5, p.z() - 45.0) < 2.0; };
  const auto organ = [](const Vec3& p) { return (p - Vec3(14, 0, 45)).norm() < 10.0; };
  const auto returning = [](const Vec3& p) {  // from the artery, and to it 24 mm further on
    return p.x() > 0.0 && std::abs(p.y()) < 2.0 &&
           std::abs(std::hypot(p.x() - 2.0, p.z() - 45.0) - 12.0) < 2.0;
  };
  for (const Segmentation& found :
       {beside_artery(vein), beside_artery(organ), beside_artery(returning)}) {
    EXPECT_TRUE(found.statistics.branches.empty());
    EXPECT_GT(dice(found.mask, [](const Vec3& p) { return off_axis(p, 0) < 5.0; }), 0.95);
  }
}

TEST(SegmentLevel, AVeinOfItsOwnLevelThatTouchesAllAlongIsLeftOut) {
  // The vein has 150 HU: as much as the artery at the top, and 60 % of it at the bottom. Their
  // walls touch from 20 to 60 mm; elsewhere 4 mm lie between.
  const auto vein = [](const Vec3& p) {
    const double gap = p.z() > 20.0 && p.z() < 60.0 ? 0.0 : 4.0;
    return off_axis(p, 11.0 + gap) < 6.0;
  };
  const Image image = scanned(12.0, [&](const Vec3& p) {
    return off_axis(p, 0) < 5.0 ? falling(p) : vein(p) ? 150.0 : kAround;
  });
  const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
  EXPECT_GT(dice(found.mask, [](const Vec3& p) { return off_axis(p, 0) < 5.0; }), 0.93);
  std::size_t of_vein = 0, inside = 0;
  for (std::size_t n = 0; n < found.mask.labels.size(); ++n) {
    if (!vein(preprocess::center_of(found.mask.grid, n))) continue;
    ++of_vein;
    inside += found.mask.labels[n];
  }
  EXPECT_LT(static_cast<double>(inside), 0.05 * static_cast<double>(of_vein));
}

TEST(SegmentLevel, AnOrganWhoseNoiseReachesTheArterysLevelIsLeftOut) {
  // A block of 60 % of the artery's contrast beside it: of its noise, specks reach the artery's.
  const Image image = scanned(35.0, [](const Vec3& p) {
    return off_axis(p, 0) < 5.0 ? 200.0 : p.x() > 5.0 && p.x() < 20.0 ? 136.0 : kAround;
  });
  const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
  EXPECT_GT(dice(found.mask, [](const Vec3& p) { return off_axis(p, 0) < 5.0; }), 0.9);
}

TEST(SegmentLevel, InOtherUnitsTheNoiseTellsWhetherThereIsContrast) {
  const auto tube = [](const Vec3& p) { return off_axis(p, 0) < 5.0 ? 1800.0 : 500.0; };
  const SegmentOptions options{.hounsfield = false, .seeds = {kBottom}, .target = kTop};
  const Segmentation found = segment(scanned(60.0, tube), options);
  EXPECT_NEAR(found.statistics.band.surroundings_hu, 500.0, 20.0);
  EXPECT_GT(dice(found.mask, [](const Vec3& p) { return off_axis(p, 0) < 5.0; }), 0.96);
  const std::string error = error_of(
      scanned(60.0, [](const Vec3& p) { return off_axis(p, 0) < 5.0 ? 600.0 : 500.0; }), options);
  EXPECT_TRUE(has(error, "five times the noise over what surrounds it")) << error;
}

TEST(SegmentLevel, InOtherUnitsAVesselBrighterThanItsPointsIsNoBone) {
  // An MR's coil: 1000 at both ends, 2000 over 36 mm in the middle, beyond what the ends let expect
  // of lumen (1400).
  const Image image = scanned(40.0, [](const Vec3& p) {
    const double away = std::max(0.0, std::abs(p.z() - 45.0) / 45.0 - 0.4) / 0.6;
    return off_axis(p, 0) < 5.0 ? 2000.0 - 1000.0 * away : 100.0;
  });
  const Segmentation found =
      segment(image, {.hounsfield = false, .seeds = {kBottom}, .target = kTop});
  EXPECT_GT(dice(found.mask, [](const Vec3& p) { return off_axis(p, 0) < 5.0; }), 0.95);
  ASSERT_FALSE(found.statistics.along.empty());
  EXPECT_EQ(found.statistics.along.front().arc_mm, 0.0);
}

TEST(SegmentLevel, TheRimOfABoneIsNoBranch) {
  // Blur gives the bone's rim each level between its own and that of what lies round it.
  for (const double level : {180.0, 220.0}) {
    const Image image = scanned(20.0, [&](const Vec3& p) {
      if (off_axis(p, 0) < 5.0) return level;
      return p.x() > 5.3 && std::abs(p.y()) < 15.0 && std::abs(p.z() - 45.0) < 12.0 ? 700.0
                                                                                    : kAround;
    });
    const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
    EXPECT_GT(dice(found.mask, [](const Vec3& p) { return off_axis(p, 0) < 5.0; }), 0.95) << level;
    EXPECT_TRUE(found.statistics.branches.empty()) << level;
    double farthest = 0.0;
    for (std::size_t n = 0; n < found.mask.labels.size(); ++n) {
      if (found.mask.labels[n] == 0) continue;
      farthest = std::max(farthest, off_axis(preprocess::center_of(image.grid, n), 0));
    }
    EXPECT_LT(farthest, 8.5) << level;
  }
}

TEST(SegmentLevel, LittleContrastIsRefusedByWhatItHasOverBlood) {
  const auto with_level = [](double level) {
    return scanned(10.0, [&](const Vec3& p) { return off_axis(p, 0) < 5.0 ? level : kAround; });
  };
  EXPECT_TRUE(has(error_of(with_level(125.0), {.seeds = {kBottom}, .target = kTop}),
                  "expected at least 140 HU, 100 HU over blood without contrast"));
  EXPECT_NO_THROW(segment(with_level(150.0), {.seeds = {kBottom}, .target = kTop}));
}

TEST(SegmentLevel, AScatterIsToldWithThePointsOwnLevel) {
  const Image image = scanned(0.0, [](const Vec3&) { return kAround; });
  const std::vector<LumenSample> samples = {
      {.point = kBottom, .level_hu = 500.0, .noise_hu = 10.0, .voxels = 100},
      {.point = kTop, .level_hu = 250.0, .noise_hu = 120.0, .voxels = 1}};
  std::string error;
  try {
    choose_band(image, samples, 50.0, /*hounsfield=*/true, {}, {});
  } catch (const Error& refused) {
    error = refused.what();
  }
  EXPECT_TRUE(has(error,
                  "the values round (0.0, 0.0, 85.0) mm scatter by 120 HU round 250 HU, "
                  "expected at most 45 % of the contrast"))
      << error;
}

TEST(SegmentLevel, APointInMetalIsToldAsOne) {
  const Image image = scanned(10.0, [](const Vec3& p) {
    return (p - kTop).norm() < 4.0 ? 2500.0 : off_axis(p, 0) < 5.0 ? 300.0 : kAround;
  });
  const std::string error = error_of(image, {.seeds = {kBottom}, .target = kTop});
  EXPECT_TRUE(has(error, "HU round (0.0, 0.0, 85.0) mm, expected at most 800 HU")) << error;
}

TEST(SegmentLevel, APointInPlaqueTakesTheLumenBesideIt) {
  // A lens of calcium on the wall: its own values, of 600 HU and less, would be taken for lumen.
  const auto plaque = [](const Vec3& p) {
    return off_axis(p, 0) < 5.0 && (p - Vec3(5, 0, 80)).norm() < 2.0;
  };
  const auto lumen = [&](const Vec3& p) { return off_axis(p, 0) < 5.0 && !plaque(p); };
  const Image image = scanned(10.0, [&](const Vec3& p) {
    return plaque(p) ? 800.0 : off_axis(p, 0) < 5.0 ? 250.0 : kAround;
  });
  for (const bool last : {true, false}) {
    const Vec3 calcium(4.2, 0, 80);
    const Segmentation found =
        segment(image, {.seeds = {last ? kBottom : calcium}, .target = last ? calcium : kBottom});
    const auto& samples = found.statistics.samples;
    EXPECT_NEAR((last ? samples.back() : samples.front()).level_hu, 250.0, 15.0);
    EXPECT_GT(dice(found.mask, lumen), 0.96);
  }
}

TEST(SegmentLevel, APointInTheWallBetweenArteryAndVeinMeansTheArtery) {
  // The point lies 0.1 mm from a vein of 70 % of the contrast and 0.5 mm from the artery.
  const Image image = scanned(10.0, [](const Vec3& p) {
    return off_axis(p, 0) < 5.0 ? 250.0 : off_axis(p, 10.6) < 5.0 ? 190.0 : kAround;
  });
  const Segmentation found = segment(image, {.seeds = {Vec3(5.5, 0, 5)}, .target = kTop});
  EXPECT_LT(off_axis(found.statistics.ways.back().points.col(0), 0.0), 5.0);
  EXPECT_GT(dice(found.mask, [](const Vec3& p) { return off_axis(p, 0) < 5.0; }), 0.95);
}

TEST(SegmentLevel, APointWhoseNearestVoxelsAreDarkByNoiseIsInTheArtery) {
  Image image = scanned(22.0, [](const Vec3& p) { return off_axis(p, 0) < 6.0 ? 150.0 : kAround; });
  for (const std::size_t n : voxels_in_ball(image.grid, kTop, 1.01)) image.values[n] = 85.0F;
  const Segmentation found = segment(image, {.seeds = {kBottom}, .target = kTop});
  EXPECT_NEAR(found.statistics.samples.back().level_hu, 150.0, 10.0);
  EXPECT_TRUE(contains(found.mask, Vec3(2, 0, 85)));
}

TEST(SegmentLevel, APointBesideTheArteryIsToldWhereItsContrastBegins) {
  const Image image =
      scanned(10.0, [](const Vec3& p) { return off_axis(p, 0) < 5.0 ? 250.0 : kAround; });
  const std::string error = error_of(image, {.seeds = {kBottom}, .target = Vec3(8, 0, 85)});
  const std::string told = "such contrast begins ";
  ASSERT_TRUE(has(error, told)) << error;
  // The half level lies at 5 mm, and 65 % of the contrast half a voxel further in.
  EXPECT_NEAR(std::stod(error.substr(error.find(told) + told.size())), 3.4, 0.8) << error;
}

TEST(SegmentLevel, ATargetInAVeinThatTouchesIsToldByItsLevel) {
  // The vein, of 75 % of the contrast, has its wall in common with the artery from 50 to 60 mm.
  const auto vein = [](const Vec3& p) {
    const double away = std::max(0.0, std::abs(p.z() - 55.0) - 5.0);
    return p.z() > 40.0 && off_axis(p, 8.5 + 0.2 * away) < 4.0;
  };
  const Image image = scanned(10.0, [&](const Vec3& p) {
    return off_axis(p, 0) < 5.0 ? 250.0 : vein(p) ? 200.0 : kAround;
  });
  const Segmentation found = segment(image, {.seeds = {kBottom}, .target = Vec3(13, 0, 84)});
  const auto& doubts = found.statistics.way_doubts;
  const auto by_level = std::find_if(doubts.begin(), doubts.end(),
                                     [](const WayDoubt& doubt) { return doubt.by_level; });
  ASSERT_NE(by_level, doubts.end());
  EXPECT_NEAR(by_level->place.z(), 55.0, 10.0);
  EXPECT_GT(by_level->before_hu - by_level->after_hu, 0.16 * 175.0);  // of the mean contrast
}

TEST(SegmentLevel, ANeckOfTheWayIsToldWithItsWidth) {
  // From 5 mm to 2 or 3.5 mm over 10 mm, and back.
  const auto tube = [](double least) {
    return scanned(10.0, [least](const Vec3& p) {
      const double away = std::min(1.0, std::abs(p.z() - 45.0) / 10.0);
      return off_axis(p, 0) < least + (5.0 - least) * away ? 300.0 : kAround;
    });
  };
  const Segmentation found = segment(tube(2.0), {.seeds = {kBottom}, .target = kTop});
  ASSERT_EQ(found.statistics.way_doubts.size(), 1U);
  const WayDoubt& doubt = found.statistics.way_doubts.front();
  EXPECT_TRUE(doubt.by_width && !doubt.by_level);
  EXPECT_NEAR(doubt.place.z(), 45.0, 3.0);
  // Radii are inscribed in voxels of 0.8 mm and so up to a voxel's diagonal in the plane short.
  EXPECT_LE(doubt.neck_mm, 2.0);
  EXPECT_GE(doubt.neck_mm, 2.0 - 1.14);
  EXPECT_LE(doubt.beside_mm, 5.0);
  EXPECT_GE(doubt.beside_mm, 5.0 - 1.14);
  EXPECT_TRUE(
      segment(tube(3.5), {.seeds = {kBottom}, .target = kTop}).statistics.way_doubts.empty());
}

/// A straight vessel of 3 mm with a darker place of this value, and one of 90 % of the contrast and
/// this radius that leads round it by x = `far`; the way that is found between the ends.
struct Detour {
  double dark = 170.0, half_length = 1.5, far = 15.0, radius = 3.0;
};
std::vector<Vec3> way_past(const Detour& detour) {
  LumenField field;
  field.grid = upright_grid();
  field.surroundings = 50.0;
  field.upper = 800.0;
  field.noise = 10.0;
  for (std::size_t n = 0; n < field.grid.voxels(); ++n) {
    const Vec3 p = preprocess::center_of(field.grid, n);
    const auto across = [&](double z) {
      return p.x() > 0.0 && p.x() < detour.far && std::hypot(p.y(), p.z() - z) < detour.radius;
    };
    const bool along = off_axis(p, detour.far) < detour.radius && p.z() > 25.0 && p.z() < 65.0;
    const bool is_dark = std::abs(p.z() - 45.0) < detour.half_length;
    const double straight = is_dark ? detour.dark : 200.0;
    const bool round = along || across(25) || across(65);
    field.values.push_back(static_cast<float>(off_axis(p, 0.0) < 3.0 ? straight
                                              : round                ? 185.0
                                                                     : kAround));
  }
  field.raw = field.values;
  const std::size_t start = field.grid.index(29, 29, 5), end = field.grid.index(29, 29, 85);
  const auto ways = find_level_ways(field, find_candidates(field, {start}, 150.0),
                                    {{start, 200.0F}, {end, 200.0F}});
  std::vector<Vec3> places;
  for (const WayLevel& place : ways.at(1)) {
    places.push_back(preprocess::center_of(field.grid, place.voxel));
  }
  return places;
}

TEST(SegmentLevel, AWayIsNotGivenUpForAPlaceThatNoiseMakesDark) {
  // The straight vessel has 80 % of the contrast at one place, a longer one round it 90 % all
  // along.
  const std::vector<Vec3> way = way_past({});
  ASSERT_FALSE(way.empty());
  for (const Vec3& place : way) EXPECT_LT(off_axis(place, 0.0), 3.0);
}

TEST(SegmentLevel, AFarDetourIsLeftForAPlaceThatNoiseSeldomMakesSoDark) {
  // 73 % of the contrast, 17 % less than elsewhere, are 1.7 sigma of what noise leaves: that counts
  // against a way beside one a quarter longer, and not beside a narrower one half as long again.
  for (const bool is_far : {true, false}) {
    SCOPED_TRACE(is_far);
    const std::vector<Vec3> way = way_past({.dark = 160.0,
                                            .half_length = 0.6,
                                            .far = is_far ? 20.0 : 8.0,
                                            .radius = is_far ? 2.0 : 3.0});
    ASSERT_FALSE(way.empty());
    double away = 0.0;
    for (const Vec3& place : way) away = std::max(away, off_axis(place, 0.0));
    EXPECT_EQ(away < 3.0, is_far) << away;
  }
}

TEST(LevelRule, BlurTakesWhatItTakesOfACylinder) {
  // The middle of a disc under a Gaussian, by summing it over the disc.
  const LumenField field{.grid = upright_grid(), .raw = {}, .values = {}, .smoothing_mm = 0.8};
  const LevelRule rule(field);
  const double voxel = std::cbrt(0.8 * 0.8 * 1.0),
               sigma = std::sqrt(0.36 + 0.16 * voxel * voxel + 0.64);
  for (const double radius : {0.8, 1.5, 3.0}) {
    double sum = 0.0, all = 0.0;
    for (double x = -8.0; x <= 8.0; x += 0.02) {
      for (double y = -8.0; y <= 8.0; y += 0.02) {
        const double weight = std::exp(-0.5 * (x * x + y * y) / (sigma * sigma));
        all += weight;
        sum += std::hypot(x, y) < radius ? weight : 0.0;
      }
    }
    EXPECT_NEAR(rule.seen(static_cast<float>(radius - 0.4)), sum / all, 0.005) << radius;
  }
}

}  // namespace
}  // namespace wireplan::preprocess
