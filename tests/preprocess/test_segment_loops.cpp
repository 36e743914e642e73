// Loops of masks: cut where they are thin, kept where they are wide; the Euler number counts what
// is left in another way.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include "preprocess/segment/mask_shape.h"
#include "preprocess/segment/segment_loops.h"

namespace wireplan::preprocess {
namespace {

constexpr double kAllLoops = std::numeric_limits<double>::infinity();

Grid cube_of(int size) { return {.size = {size, size, size}}; }

template <typename Inside>
Labels mask_of(const Grid& grid, Inside inside) {
  Labels labels(grid.voxels(), 0);
  for (std::size_t n = 0; n < labels.size(); ++n)
    labels[n] = inside(preprocess::center_of(grid, n)) ? 1 : 0;
  return labels;
}

std::size_t count_of(const Labels& labels) {
  std::size_t count = 0;
  for (const std::uint8_t label : labels) count += label;
  return count;
}

/// A ring of two bars, left and right of x = 15, and two that join them, at the ends of y; z = 15.
bool in_frame(const Vec3& p, double left, double right, double ends) {
  const auto bar = [](double a, double b, double r) {
    return std::max(std::abs(a), std::abs(b)) <= r;
  };
  const bool along = p.y() >= 5.0 && p.y() <= 25.0, across = p.x() >= 7.0 && p.x() <= 23.0;
  return (along &&
          (bar(p.x() - 7.0, p.z() - 15.0, left) || bar(p.x() - 23.0, p.z() - 15.0, right))) ||
         (across &&
          (bar(p.y() - 5.0, p.z() - 15.0, ends) || bar(p.y() - 25.0, p.z() - 15.0, ends)));
}

TEST(SegmentLoops, AThinBridgeIsCutInItsThinnestPlace) {
  const Grid grid = cube_of(31);
  const auto bridge = [](const Vec3& p) {
    return p.y() == 15.0 && p.z() == 15.0 && p.x() >= 7.0 && p.x() <= 23.0;
  };
  Labels labels = mask_of(grid, [&](const Vec3& p) { return in_frame(p, 3, 3, 3) || bridge(p); });
  const Labels before = labels;
  ASSERT_EQ(measure_shape(grid, labels).handles, 2U);
  const LoopSearch found = cut_loops(grid, grid.index(7, 5, 15), {}, 1.6, labels);
  EXPECT_EQ(found.cut, 1U);
  ASSERT_EQ(found.left.size(), 1U);  // the frame
  EXPECT_GT(found.left.front().radius_mm, 1.6);
  EXPECT_EQ(measure_shape(grid, labels).handles, 1U);
  EXPECT_EQ(measure_shape(grid, labels).pieces, 1U);
  EXPECT_EQ(count_of(before) - count_of(labels), 1U);
}

TEST(SegmentLoops, ATunnelOfOneVoxelCostsAWallToTheNearerSide) {
  const Grid grid = cube_of(31);
  Labels labels = mask_of(grid, [](const Vec3& p) {
    const bool tunnel = p.x() == 15.0 && p.z() == 13.0;
    return std::hypot(p.x() - 15.0, p.z() - 15.0) <= 5.0 && !tunnel;
  });
  const std::size_t before = count_of(labels);
  ASSERT_EQ(measure_shape(grid, labels).handles, 1U);
  const LoopSearch found = cut_loops(grid, grid.index(15, 2, 17), {}, 1.6, labels);
  EXPECT_EQ(found.cut, 1U);
  EXPECT_EQ(measure_shape(grid, labels).handles, 0U);
  EXPECT_EQ(measure_shape(grid, labels).pieces, 1U);
  EXPECT_LE(before - count_of(labels), 3U * 31U);  // three voxels lie below the tunnel
}

TEST(SegmentLoops, TheWayIsNotCutThoughItIsTheThinnerSide) {
  const Grid grid = cube_of(31);
  std::vector<Vec3> way;  // up the left bar, of one voxel
  for (int y = 5; y <= 25; ++y) way.emplace_back(7, y, 15);
  const auto frame = [](const Vec3& p) { return in_frame(p, 0, 3, 3); };
  Labels along = mask_of(grid, frame), free = along;
  EXPECT_EQ(cut_loops(grid, grid.index(7, 5, 15), way, kAllLoops, along).cut, 1U);
  EXPECT_EQ(cut_loops(grid, grid.index(7, 5, 15), {}, kAllLoops, free).cut, 1U);
  std::size_t kept = 0, kept_free = 0;
  for (const Vec3& place : way) {
    const std::size_t n = index_of(grid, *nearest_voxel(grid, place));
    kept += along[n];
    kept_free += free[n];
  }
  EXPECT_EQ(kept, way.size());
  EXPECT_LT(kept_free, way.size());
}

TEST(SegmentLoops, NothingIsLeftOfTheLoopsOfRandomMasks) {
  std::mt19937_64 random(5);
  for (const double share : {0.4, 0.6, 0.8}) {
    const Grid grid = cube_of(24);
    Labels labels = mask_of(
        grid, [&](const Vec3&) { return static_cast<double>(random() >> 11) * 0x1.0p-53 < share; });
    Labels largest;
    ASSERT_GT(measure_shape(grid, labels, &largest).handles, 100U);
    std::size_t seed = 0;
    while (largest[seed] == 0) ++seed;
    fill_cavities(grid, largest, kAllLoops);
    const LoopSearch found = cut_loops(grid, seed, {}, kAllLoops, largest);
    EXPECT_GT(found.cut, 0U);
    EXPECT_TRUE(found.left.empty());
    const MaskShape shape = measure_shape(grid, largest);
    EXPECT_EQ(shape.handles, 0U) << share;
    EXPECT_EQ(shape.pieces, 1U) << share;
    EXPECT_EQ(shape.cavities, 0U) << share;
  }
}

TEST(SegmentLoops, AVesselWithoutLoopsStaysAsItIs) {
  const Grid grid = cube_of(31);
  Labels labels = mask_of(grid, [](const Vec3& p) {
    return std::hypot(p.x() - 15.0, p.y() - 15.0) <= 6.0 ||
           (std::hypot(p.y() - 15.0, p.z() - 12.0) <= 2.5 && p.x() >= 15.0);
  });
  const Labels before = labels;
  const LoopSearch found = cut_loops(grid, grid.index(15, 15, 1), {}, kAllLoops, labels);
  EXPECT_EQ(found.cut, 0U);
  EXPECT_TRUE(found.left.empty());
  EXPECT_EQ(labels, before);
}

}  // namespace
}  // namespace wireplan::preprocess
