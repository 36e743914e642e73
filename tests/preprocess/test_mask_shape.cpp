// Handles, pieces and cavities of masks; what is refused, and in which words.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "preprocess/segment/mask_shape.h"
#include "preprocess/surface/surface.h"
#include "tests/messages.h"

namespace wireplan::preprocess {
namespace {

/// A cube of voxels of 1 mm, those labelled for which inside(i, j, k) holds.
template <typename Inside>
Mask mask_of(int side, Inside inside) {
  Mask mask{.grid = {.size = {side, side, side}}, .labels = {}};
  for (int k = 0; k < side; ++k) {
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) mask.labels.push_back(inside(i, j, k) ? 1 : 0);
    }
  }
  return mask;
}

MaskShape shape_of(const Mask& mask) { return measure_shape(mask.grid, mask.labels); }

/// Bars of 2 x 2 voxels along all axes, 6 apart, `bars` of them in each direction.
Mask lattice(int bars) {
  return mask_of(6 * bars - 2, [](int i, int j, int k) {
    return (i % 6 < 2 ? 1 : 0) + (j % 6 < 2 ? 1 : 0) + (k % 6 < 2 ? 1 : 0) >= 2;
  });
}

Mask noise(int side) {
  std::mt19937_64 random(5);
  return mask_of(side, [&](int, int, int) { return random() % 2 == 0; });
}

void expect_holds(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) {
    EXPECT_TRUE(holds(text, part)) << "\"" << part << "\" is not in: " << text;
  }
}

std::string refusal(const Mask& mask, MaskBy by = MaskBy::kBand, const MaskLimits& limits = {}) {
  return message_of([&] { require_simple(shape_of(mask), limits, by); });
}

TEST(MaskShape, CountsBoxRingAndShell) {
  const auto in_box = [](int i, int j, int k, int from, int to) {
    return std::min({i, j, k}) >= from && std::max({i, j, k}) <= to;
  };
  const MaskShape box =
      shape_of(mask_of(9, [&](int i, int j, int k) { return in_box(i, j, k, 2, 6); }));
  EXPECT_EQ(box.pieces, 1U);
  EXPECT_EQ(box.voxels, 125U);
  EXPECT_EQ(box.faces, 150U);
  EXPECT_EQ(box.handles, 0U);
  EXPECT_EQ(box.cavities, 0U);
  const MaskShape ring = shape_of(
      mask_of(9, [&](int i, int j, int k) { return in_box(i, j, k, 2, 6) && (i != 4 || j != 4); }));
  EXPECT_EQ(ring.handles, 1U);
  EXPECT_EQ(ring.cavities, 0U);
  const MaskShape shell = shape_of(mask_of(
      9, [&](int i, int j, int k) { return in_box(i, j, k, 2, 6) && !in_box(i, j, k, 3, 5); }));
  EXPECT_EQ(shell.handles, 0U);
  EXPECT_EQ(shell.cavities, 1U);
  // Open at a corner alone, two cavities that touch at one, and one at the border, which is none.
  EXPECT_EQ(shape_of(mask_of(9,
                             [&](int i, int j, int k) {
                               return in_box(i, j, k, 2, 6) && !in_box(i, j, k, 3, 5) &&
                                      (i != 2 || j != 2 || k != 2);
                             }))
                .cavities,
            0U);
  EXPECT_EQ(
      shape_of(mask_of(9, [&](int i, int j,
                              int k) { return !in_box(i, j, k, 2, 3) && !in_box(i, j, k, 4, 5); }))
          .cavities,
      1U);
  EXPECT_EQ(shape_of(mask_of(9,
                             [&](int i, int j, int k) {
                               return !in_box(i, j, k, 0, 1) && !in_box(i, j, k, 4, 5) &&
                                      !in_box(i, j, k, 7, 7);
                             }))
                .cavities,
            2U);
}

TEST(MaskShape, IsThatOfTheLargestPiece) {
  // A bar of 8 voxels, and a ring of 8 round one beside it.
  Labels largest;
  const Mask mask = mask_of(12, [](int i, int j, int k) {
    const bool ring = k == 8 && i >= 2 && i <= 4 && j >= 2 && j <= 4 && (i != 3 || j != 3);
    return ring || (j == 8 && k == 2 && i >= 1 && i < 10);
  });
  const MaskShape shape = measure_shape(mask.grid, mask.labels, &largest);
  EXPECT_EQ(shape.pieces, 2U);
  EXPECT_EQ(shape.voxels, 9U);
  EXPECT_EQ(shape.handles, 0U);
  EXPECT_EQ(largest[mask.grid.index(5, 8, 2)], 1);
  EXPECT_EQ(largest[mask.grid.index(2, 2, 8)], 0);
}

TEST(MaskShape, HandlesOfALatticeFollowFromItsGraph) {
  for (const int bars : {2, 3, 4}) {
    // bars^3 crossings, and 3 bars^2 (bars - 1) ways between them: all but those of a tree.
    const int crossings = bars * bars * bars, ways = 3 * bars * bars * (bars - 1);
    EXPECT_EQ(shape_of(lattice(bars)).handles, static_cast<std::size_t>(ways - crossings + 1));
  }
}

TEST(MaskShape, HasTheHandlesOfItsSurface) {
  const Mask mask = lattice(2);
  const SurfaceCheck check = check_surface(surface_from_mask(mask, {.edge_length_mm = 1.0}));
  EXPECT_EQ(shape_of(mask).handles, static_cast<std::size_t>((2 - check.euler_number) / 2));
}

TEST(MaskShape, NoiseIsRefusedAsNoise) {
  const std::string text = refusal(noise(40));
  expect_holds(
      text, {" handles (loops or holes) in ", ": noise, expected a vessel, of at most 50 handles",
             "raise segmentation.smoothing_mm", "raise mask.most_handles"});
  expect_holds(refusal(noise(40), MaskBy::kLabels), {"choose the classes that are arteries"});
  const std::string by_levels = refusal(noise(40), MaskBy::kLevels);
  expect_holds(by_levels, {"give a larger segmentation.smoothing_mm or neck_opening_mm"});
  EXPECT_EQ(by_levels.find("lower_hu"), std::string::npos) << "there is none to raise";
}

TEST(MaskShape, HandlesFarApartMayBeVeins) {
  // Bars 40 voxels apart: 54 handles, each of thousands of voxels.
  const Mask mask = mask_of(122, [](int i, int j, int k) {
    return (i % 40 < 6 ? 1 : 0) + (j % 40 < 6 ? 1 : 0) + (k % 40 < 6 ? 1 : 0) >= 2;
  });
  const MaskShape shape = shape_of(mask);
  EXPECT_GT(shape.handles, 50U);
  expect_holds(refusal(mask), {std::to_string(shape.handles) + " handles (loops or holes) in ",
                               ": noise or veins, bone and organs that touch"});
  EXPECT_EQ(refusal(mask, MaskBy::kBand, {.handles = static_cast<int>(shape.handles)}), "no error");
}

TEST(MaskShape, ABodyIsRefusedByItsFaces) {
  const Mask body = mask_of(
      60, [](int i, int j, int k) { return std::hypot(i - 30.0, j - 30.0, k - 30.0) < 28.0; });
  EXPECT_EQ(refusal(body), "no error");
  expect_holds(refusal(body, MaskBy::kBand, {.faces = 10000}),
               {"0 handles (loops or holes) in 92 ml", ": an organ, bone or the whole body",
                "of at most 10 thousand outer faces", "raise mask.most_faces"});
}

TEST(MaskShape, AFloodIsRefusedBeforeWhatCutsIt) {
  const Mask mask = noise(80);
  const std::string text =
      message_of([&] { require_no_flood(mask.grid, mask.labels, MaskLimits{}, MaskBy::kBand); });
  expect_holds(text, {"what the band connects to the points has ", ": noise",
                      "of at most 20 thousand handles"});
  EXPECT_EQ(message_of([&] {
              require_no_flood(mask.grid, mask.labels, {.handles = 1000}, MaskBy::kBand);
            }),
            "no error");
}

}  // namespace
}  // namespace wireplan::preprocess
