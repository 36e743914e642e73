// Segmentations that somebody else made: which classes are read, where they come to lie, how they
// become one piece.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "preprocess/segment/label_growth.h"
#include "preprocess/segment/label_mask.h"
#include "preprocess/volume/label_frame.h"
#include "preprocess/volume/labels.h"
#include "tests/preprocess/image_file.h"
#include "tests/preprocess/label_bytes.h"

namespace wireplan::preprocess {
namespace {

using Values = std::vector<std::uint8_t>;

/// 24 x 20 x 30 voxels of 1 x 1 x 1.5 mm, away from the origin.
Grid grid_of(const Vec3& spacing = Vec3(1, 1, 1.5)) {
  return {.size = {24, 20, 30}, .spacing = spacing, .origin = Vec3(-40, 15, 300)};
}

/// The value that `of` gives for each voxel's centre, counted from the grid's first [mm].
template <typename Of>
Values values_on(const Grid& grid, Of of) {
  Values values;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        values.push_back(of(Vec3(grid.lps_from_ijk(Vec3(i, j, k)) - Vec3(-40, 15, 300))));
      }
    }
  }
  return values;
}

/// A trunk (2) along z round (11, 10), and a branch (5) from it along x.
std::uint8_t tree(const Vec3& p) {
  if (std::hypot(p.x() - 11.0, p.y() - 10.0) < 4.0) return 2;
  return std::hypot(p.y() - 10.0, p.z() - 22.0) < 2.5 && p.x() > 11.0 ? 5 : 0;
}

std::uint8_t only(const Vec3& p, std::uint8_t value) { return tree(p) == value ? 1 : 0; }

using Labels = ImageFile;

// ---- which classes
// -------------------------------------------------------------------------------

TEST_F(Labels, OfOneFileOfSegmentsAndOfAFolderAreTheSame) {
  const Grid grid = grid_of();
  const Values all = values_on(grid, tree);
  const fs::path nifti = write("tree.nii", label_nifti(grid, all)),
                 mha = write("tree.mha", label_mha(grid, all)),
                 segments = write("tree.seg.nrrd",
                                  label_nrrd(grid, {all}, {{"branch", 5, 0}, {"trunk", 2, 0}}));
  fs::create_directories(folder_ / "classes");
  for (const auto& [name, value] : {std::pair("trunk", 2), std::pair("branch", 5)}) {
    write("classes/" + std::string(name) + ".nii",
          label_nifti(grid, values_on(grid, [v = value](const Vec3& p) {
                        return only(p, static_cast<std::uint8_t>(v));
                      })));
  }
  const LabelVolume by_value = read_labels(nifti, {.values = {2, 5}});
  ASSERT_EQ(by_value.classes.size(), 2u);
  EXPECT_EQ(by_value.classes[0].name, "label 2");
  for (std::size_t n = 0; n < all.size(); ++n) {
    ASSERT_EQ(by_value.class_of[n], all[n] == 2 ? 1 : all[n] == 5 ? 2 : 0);
  }
  const std::vector<std::string> names = {"trunk", "branch"};
  for (const LabelVolume& other :
       {read_labels(mha, {.values = {2, 5}, .names = names}),
        read_labels(segments, {.names = names}),
        read_labels(nifti, {.names = names, .table = {{2, "trunk"}, {5, "branch"}}}),
        read_labels(folder_ / "classes", {.names = names})}) {
    EXPECT_EQ(other.class_of, by_value.class_of);
    ASSERT_EQ(other.classes.size(), 2u);
    EXPECT_EQ(other.classes[1].name, "branch");
    EXPECT_EQ(other.classes[1].voxels, by_value.classes[1].voxels);
    EXPECT_TRUE(other.overlaps.empty() && other.resampled.empty());
  }
}

TEST_F(Labels, ThatOverlapInLayersCountAsTheFirst) {
  const Grid grid = grid_of();
  const auto wide = [](const Vec3& p) { return std::uint8_t{p.x() > 8.0}; };
  const Values trunk = values_on(grid, [](const Vec3&p) { return only(p, 2); }),
               box = values_on(grid, wide);
  const fs::path file =
      write("layers.seg.nrrd", label_nrrd(grid, {trunk, box}, {{"trunk", 1, 0}, {"box", 1, 1}}));
  std::size_t both = 0, one = 0;
  for (std::size_t n = 0; n < trunk.size(); ++n) {
    both += trunk[n] & box[n];
    one += trunk[n];
  }
  const LabelVolume read = read_labels(file, {.names = {"trunk", "box"}});
  EXPECT_EQ(read.classes[0].voxels, one);
  ASSERT_EQ(read.overlaps.size(), 1u);
  EXPECT_EQ(read.overlaps[0].voxels, both);
  EXPECT_EQ(read_labels(file, {.names = {"box", "trunk"}}).classes[1].voxels, one - both);
  // Wholly under another, a class says so.
  const LabelVolume under = read_labels(
      write("under.seg.nrrd", label_nrrd(grid, {trunk, trunk}, {{"trunk", 1, 0}, {"part", 1, 1}})),
      {.names = {"trunk", "part"}});
  EXPECT_TRUE(under.classes[0].lost.empty());
  EXPECT_TRUE(has(under.classes[1].lost, "nothing of \"part\" is left: \"trunk\" covers all of it"))
      << under.classes[1].lost;
  // A value says nothing where layers use it for different things.
  const std::string error = error_of([&] { read_labels(file, {.values = {1}}); });
  EXPECT_TRUE(has(error, "labels.values[0] is 1") && has(error, "trunk, box")) << error;
}

TEST_F(Labels, ThatAreNotThereAreToldTogetherWithThoseThatAre) {
  const Grid grid = grid_of();
  const fs::path file = write("tree.seg.nrrd", label_nrrd(grid, {values_on(grid, tree)},
                                                          {{"trunk", 2, 0}, {"renal", 7, 0}}));
  std::string error = error_of([&] { read_labels(file, {.names = {"aorta", "x", "trunk"}}); });
  EXPECT_TRUE(has(error, "labels.names[0] is \"aorta\"") && has(error, "labels.names[1]") &&
              has(error, "trunk, renal"))
      << error;
  error = error_of([&] { read_labels(file, {.names = {"aorta", "renal"}}); });
  EXPECT_TRUE(has(error, "labels.names[0] is \"aorta\"") &&
              has(error, "labels.names[1] is \"renal\", a class without any voxel"))
      << error;
  error = error_of([&] { read_labels(file, {.names = {"trunk", "renal"}}); });
  EXPECT_TRUE(has(error, "\"renal\", a class without any voxel") && has(error, "2, 5")) << error;
  error = error_of([&] { read_labels(file, {}); });
  EXPECT_TRUE(has(error, "labels.names is missing") && has(error, "trunk, renal")) << error;
  const fs::path bare = write("bare.nii", label_nifti(grid, values_on(grid, tree)));
  error = error_of([&] { read_labels(bare, {.names = {"trunk"}}); });
  EXPECT_TRUE(has(error, "it tells none") && has(error, "2, 5")) << error;
  error = error_of([&] { read_labels(bare, {.values = {9}}); });
  EXPECT_TRUE(has(error, "labels.values[0] is 9") && has(error, "2, 5")) << error;
  error = error_of([&] { read_labels(bare, {}); });
  EXPECT_TRUE(has(error, "labels.values: some of 2, 5")) << error;
  // One class alone need not be named.
  const fs::path one = write(
      "one.nii", label_nifti(grid, values_on(grid, [](const Vec3& p) { return only(p, 2); })));
  EXPECT_EQ(read_labels(one, {}).classes.size(), 1u);
}

TEST_F(Labels, OfAFolderAreItsFiles) {
  const Grid grid = grid_of();
  const auto all = label_nifti(grid, values_on(grid, tree));
  const Values none(grid.voxels(), 0);
  write("both.nii", all);
  write("empty.nii.nii", label_nifti(grid, none));
  write("twice.nii", all);
  write("twice.mha", label_mha(grid, none));
  const std::string missing = error_of([&] {
    read_labels(folder_, {.names = {"aorta", "twice", "both"}});
  });
  EXPECT_TRUE(has(missing, "labels.names[0] is \"aorta\"") && has(missing, "several files") &&
              has(missing, "\"both\", whose file holds the values 2, 5"))
      << missing;
  const std::string bad = error_of([&] { read_labels(folder_, {.names = {"both", "empty.nii"}}); });
  EXPECT_TRUE(has(bad, "holds the values 2, 5, expected one class per file") &&
              has(bad, "\"empty.nii\", a class without any voxel"))
      << bad;
  const std::string by_value = error_of([&] { read_labels(folder_, {.values = {2}}); });
  EXPECT_TRUE(has(by_value, "labels.values is given for a folder")) << by_value;
}

TEST_F(Labels, MayBeFloatsButAreWholeNumbers) {
  const Grid grid = grid_of();
  const Values all = values_on(grid, tree);
  std::vector<float> floats(all.begin(), all.end());
  EXPECT_EQ(read_labels(write("whole.nii", label_nifti(grid, floats)), {.values = {2, 5}}).class_of,
            read_labels(write("tree.nii", label_nifti(grid, all)), {.values = {2, 5}}).class_of);
  floats[grid.index(3, 4, 5)] = 0.25F;
  const std::string error =
      error_of([&] { read_labels(write("soft.nii", label_nifti(grid, floats)), {.values = {2}}); });
  EXPECT_TRUE(has(error, "value at (-37.0, 19.0, 307.5) mm is 0.25") && has(error, "threshold"))
      << error;
  floats[grid.index(3, 4, 5)] = -1000.0F;
  EXPECT_TRUE(has(
      error_of([&] { read_labels(write("ct.nii", label_nifti(grid, floats)), {.values = {2}}); }),
      "if this is the CT"));
}

// ---- where they lie
// ------------------------------------------------------------------------------

TEST_F(Labels, StoredFromTheOtherEndLieAtTheSamePlaces) {
  const Grid grid = grid_of();
  Grid turned = grid;  // k runs down, i and j are exchanged
  turned.size = {grid.size[1], grid.size[0], grid.size[2]};
  turned.direction << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  turned.origin = grid.lps_from_ijk(Vec3(0, 0, grid.size[2] - 1));
  const LabelVolume straight =
      read_labels(write("a.nii", label_nifti(grid, values_on(grid, tree))), {.values = {2, 5}});
  const LabelVolume other = read_labels(
      write("b.nii", label_nifti(turned, values_on(turned, tree))), {.values = {2, 5}}, &grid);
  EXPECT_EQ(other.class_of, straight.class_of);
  EXPECT_TRUE(other.resampled.empty());
}

TEST_F(Labels, OfAnotherSpacingAreResampledAndTold) {
  Grid fine = grid_of(Vec3(0.5, 0.5, 0.5));
  fine.size = {47, 39, 88};
  const Grid grid = grid_of();
  const LabelVolume read = read_labels(write("fine.nii", label_nifti(fine, values_on(fine, tree))),
                                       {.values = {2, 5}}, &grid);
  ASSERT_EQ(read.resampled.size(), 1u);
  EXPECT_TRUE(has(read.resampled[0], "resampled") && has(read.resampled[0], "0.5 x 0.5 x 0.5"))
      << read.resampled[0];
  // The centres of both grids' voxels meet at every second or third: there nothing changes but on
  // edges, of which at most a voxel's own neighbours differ.
  const Values drawn = values_on(grid, tree);
  std::size_t same = 0, either = 0;
  for (std::size_t n = 0; n < drawn.size(); ++n) {
    const std::uint8_t expected = drawn[n] == 2 ? 1 : drawn[n] == 5 ? 2 : 0;
    same += expected != 0 && read.class_of[n] == expected ? 1 : 0;
    either += expected != 0 || read.class_of[n] != 0 ? 1 : 0;
  }
  EXPECT_EQ(same, either);
}

TEST_F(Labels, OfTheSameSizeAndFirstVoxelAreTheVolumesOnlyIfAllAre) {
  Grid grid = grid_of(), fine = grid_of(Vec3(0.8, 0.8, 1.5));
  const LabelVolume other = read_labels(write("fine.nii", label_nifti(fine, values_on(fine, tree))),
                                        {.values = {2}}, &grid);
  EXPECT_EQ(other.resampled.size(), 1u);
  // Square, with i and j exchanged round the same first voxel.
  grid.size[0] = fine.size[0] = 20;
  fine.spacing = grid.spacing;
  fine.direction << 0, 1, 0, 1, 0, 0, 0, 0, 1;
  const LabelVolume turned = read_labels(
      write("turned.nii", label_nifti(fine, values_on(fine, tree))), {.values = {2}}, &grid);
  const LabelVolume straight = read_labels(
      write("grid.nii", label_nifti(grid, values_on(grid, tree))), {.values = {2}}, &grid);
  EXPECT_EQ(turned.class_of, straight.class_of);
}

TEST_F(Labels, OfMultiplesOfTheSpacingKeepTheirVolume) {
  // Every second centre of the grid lies half way between two of the coarse one.
  Grid coarse = grid_of(Vec3(2, 2, 3)), grid = grid_of();
  coarse.size = {12, 10, 15};
  const auto box = [](const Vec3& p) {
    return std::uint8_t{p.x() > 5.0 && p.x() < 17.0 && p.y() > 5.0 && p.y() < 15.0 && p.z() > 8.0 &&
                        p.z() < 32.0};
  };
  const Values drawn = values_on(coarse, box);
  const LabelVolume read =
      read_labels(write("coarse.nii", label_nifti(coarse, drawn)), {.values = {1}}, &grid);
  // Without care for ties each side would gain half a voxel: a quarter more in all. What is left
  // are the rounded edges of the box.
  const auto voxels = 8.0 * static_cast<double>(std::count(drawn.begin(), drawn.end(), 1));
  EXPECT_NEAR(static_cast<double>(read.classes[0].voxels), voxels, 0.03 * voxels);
}

TEST_F(Labels, ThatAreHardlyNoWholeNumbersAreToldWithAllDigits) {
  const Grid grid = grid_of();
  std::vector<float> values(grid.voxels(), 3.0F);
  values[7] = 3.000003F;
  const std::string error = error_of(
      [&] { read_labels(write("float.nii", label_nifti(grid, values)), {.values = {3}}); });
  EXPECT_TRUE(has(error, "is 3.000003") || has(error, "is 3.00000310")) << error;
}

TEST_F(Labels, OfTheVolumesSizeAtOtherPlacesAreRefusedWithWhatWouldFit) {
  const Grid grid = grid_of();
  const auto refused = [&](const Grid& placed) {
    return error_of([&] {
      read_labels(write("moved.nii", label_nifti(placed, values_on(grid, tree))), {.values = {2}},
                  &grid);
    });
  };
  Grid shifted = grid;
  shifted.origin.y() -= 10.0;
  EXPECT_TRUE(has(refused(shifted), "would fit shifted by (0, 10, 0) mm")) << refused(shifted);
  // y runs the other way from the same first voxel: y_volume - 15 = -(y_labels - 15).
  Grid mirror = grid;
  mirror.direction(1, 1) = -1.0;
  EXPECT_TRUE(has(refused(mirror), "mirrored in y: y' = 30 - y in LPS mm")) << refused(mirror);
  Grid far = grid_of(Vec3(1, 1, 1));
  far.origin.z() += 500.0;
  EXPECT_TRUE(has(refused(far), "no labelled voxel lies on the volume's grid")) << refused(far);
}

// ---- one piece
// -----------------------------------------------------------------------------------

/// A trunk along z, and a branch along x that starts `gap` behind the trunk's wall.
LabelVolume trunk_and_branch(double gap) {
  LabelVolume labels;
  labels.grid = {.size = {50, 24, 40}, .spacing = Vec3(0.5, 1, 1), .origin = Vec3(0, 0, 0)};
  labels.classes = {{"trunk", 1}, {"branch", 2}};
  for (int k = 0; k < 40; ++k) {
    for (int j = 0; j < 24; ++j) {
      for (int i = 0; i < 50; ++i) {
        const Vec3 p = labels.grid.lps_from_ijk(Vec3(i, j, k));
        std::uint8_t one = 0;
        if (p.x() < 6.2 && std::abs(p.y() - 11.0) < 5.2) one = 1;
        if (p.x() > 6.2 + gap && std::hypot(p.y() - 11.0, p.z() - 20.0) < 2.6) one = 2;
        labels.class_of.push_back(one);
      }
    }
  }
  return labels;
}

TEST(MergeLabels, BridgesAGapWithPlaceAndLength) {
  const LabelMask made = merge_labels(trunk_and_branch(3.0));
  ASSERT_EQ(made.bridges.size(), 1u);
  const Bridge& bridge = made.bridges.front();
  // Voxels of 0.5 mm from 6.0 (face at 6.25) to 9.5 (face at 9.25).
  EXPECT_NEAR(bridge.length_mm, 3.0, 1e-9);
  EXPECT_LT((bridge.place - Vec3(7.75, 11.0, 20.0)).norm(), 0.01);
  EXPECT_NEAR(bridge.radius_mm, 2.6, 0.6);  // the branch's, on voxels of 1 mm
  EXPECT_EQ(bridge.from, 0u);
  EXPECT_EQ(bridge.to, 1u);
  EXPECT_TRUE(made.lost.empty());
  // What was filled belongs to the branch, and joins both through the middle.
  for (int i = 12; i < 20; ++i) {
    const std::size_t n = made.mask.grid.index(i, 11, 20);
    EXPECT_EQ(made.mask.labels[n], 1) << i;
    EXPECT_EQ(made.class_of[n], i <= 12 ? 1 : 2) << i;
  }
}

TEST(MergeLabels, JoinsAChainWhoseLinksAreNearOneAnotherAlone) {
  // Cubes in a row and round a corner, the largest first; one at the end too far from any.
  struct Cube {
    Voxel first;
    int side;
  };
  const std::vector<Cube> cubes = {{{2, 2, 2}, 6},   {{11, 3, 3}, 4},   {{17, 4, 3}, 3},
                                   {{17, 10, 4}, 3}, {{18, 10, 10}, 3}, {{18, 20, 12}, 3},
                                   {{11, 30, 30}, 3}};
  LabelVolume labels;
  labels.grid = {.size = {24, 36, 36}, .spacing = Vec3(0.8, 0.8, 0.8), .origin = Vec3(5, 6, 7)};
  labels.classes = {{"one", 1}};
  labels.class_of.assign(labels.grid.voxels(), 0);
  const auto voxels_of = [&](const Cube& cube) {
    std::vector<std::size_t> voxels;
    for (int n = 0; n < cube.side * cube.side * cube.side; ++n) {
      voxels.push_back(labels.grid.index(cube.first[0] + n % cube.side,
                                         cube.first[1] + n / cube.side % cube.side,
                                         cube.first[2] + n / cube.side / cube.side));
    }
    return voxels;
  };
  for (const Cube& cube : cubes) {
    for (const std::size_t n : voxels_of(cube)) labels.class_of[n] = 1;
  }
  const LabelMask made = merge_labels(labels);
  // Each link's gap lies between faces that look at one another.
  ASSERT_EQ(made.bridges.size(), 4u);
  const double expected[] = {3 * 0.8, 2 * 0.8, 3 * 0.8, 3 * 0.8};
  for (const double length : expected) {
    EXPECT_TRUE(std::any_of(made.bridges.begin(), made.bridges.end(), [&](const Bridge& bridge) {
      return std::abs(bridge.length_mm - length) < 0.35;  // the middles may be a voxel beside
    })) << length;
  }
  ASSERT_EQ(made.lost.size(), 2u);
  for (const LostPiece& lost : made.lost) {
    // To the nearest of all voxels that are joined, by looking at each.
    double nearest = 1e9;
    for (std::size_t n = 0; n < made.mask.labels.size(); ++n) {
      if (made.mask.labels[n] == 0) continue;
      nearest = std::min(nearest, (center_of(labels.grid, n) - lost.place).norm());
    }
    EXPECT_GT(nearest, kMostGap);
    EXPECT_LE(lost.gap_mm, nearest);
    EXPECT_GE(lost.gap_mm, nearest - labels.grid.spacing.norm());
  }
}

TEST(MergeLabels, BridgesAGapAsWideAsTheEndsOfATube) {
  // A ball in a flat end is no larger than how far its middle lies from it.
  for (const double radius : {2.5, 4.0, 7.0}) {
    LabelVolume labels;
    labels.grid = {.size = {24, 24, 60}, .spacing = Vec3(1, 1, 1), .origin = Vec3(0, 0, 0)};
    labels.classes = {{"lower", 1}, {"upper", 2}};
    std::size_t section = 0;
    for (int k = 0; k < 60; ++k) {
      for (int j = 0; j < 24; ++j) {
        for (int i = 0; i < 24; ++i) {
          const bool tube = std::hypot(i - 12.0, j - 12.0) < radius;
          section += tube && k == 0 ? 1 : 0;
          labels.class_of.push_back(!tube ? 0 : k < 28 ? 1 : k > 31 ? 2 : 0);
        }
      }
    }
    const LabelMask made = merge_labels(labels);
    ASSERT_EQ(made.bridges.size(), 1u) << radius;
    EXPECT_NEAR(made.bridges[0].radius_mm, radius, 0.5) << radius;
    const auto first = made.mask.labels.begin() + 29 * 576;  // the middle of the gap
    EXPECT_NEAR(static_cast<double>(std::count(first, first + 576, 1)),
                static_cast<double>(section), 0.25 * static_cast<double>(section))
        << radius;
  }
}

TEST(MergeLabels, LeavesOutWhatIsFurtherAndSpecks) {
  LabelVolume labels = trunk_and_branch(6.0);
  labels.class_of[labels.grid.index(48, 1, 1)] = 2;  // a single voxel
  const LabelMask made = merge_labels(labels);
  EXPECT_TRUE(made.bridges.empty());
  ASSERT_EQ(made.lost.size(), 1u);
  EXPECT_NEAR(made.lost[0].gap_mm, 6.0, 1e-9);
  EXPECT_EQ(made.lost[0].of, 1u);
  EXPECT_DOUBLE_EQ(made.lost_specks_mm3, 0.5);
  for (std::size_t n = 0; n < labels.class_of.size(); ++n) {
    ASSERT_EQ(made.mask.labels[n], labels.class_of[n] == 1 ? 1 : 0);
  }
  EXPECT_TRUE(made.touches_border);
}

TEST(MergeLabels, JoinsWhatIsLeastApartInLongVoxels) {
  // Beside the trunk 7 mm are free, above it 4: by the centres the first is nearer.
  LabelVolume labels;
  labels.grid = {.size = {60, 20, 12}, .spacing = Vec3(0.5, 0.5, 4), .origin = Vec3(0, 0, 0)};
  labels.classes = {{"trunk", 1}, {"beside", 2}, {"above", 3}};
  labels.class_of.assign(labels.grid.voxels(), 0);
  const auto fill = [&](int i0, int i1, int k0, int k1, std::uint8_t one) {
    for (int k = k0; k <= k1; ++k) {
      for (int j = 5; j < 15; ++j) {
        for (int i = i0; i <= i1; ++i) labels.class_of[labels.grid.index(i, j, k)] = one;
      }
    }
  };
  fill(0, 20, 0, 4, 1);
  fill(35, 45, 0, 4, 2);  // 14 voxels of 0.5 mm between
  fill(5, 15, 6, 9, 3);   // one of 4 mm
  const LabelMask made = merge_labels(labels);
  ASSERT_EQ(made.bridges.size(), 1u);
  EXPECT_EQ(made.bridges[0].to, 2u);
  EXPECT_NEAR(made.bridges[0].length_mm, 4.0, 1e-9);
  ASSERT_EQ(made.lost.size(), 1u);
  EXPECT_EQ(made.lost[0].of, 1u);
  EXPECT_GE(made.lost[0].gap_mm, 7.0);  // from the middle of its end
  EXPECT_LE(made.lost[0].gap_mm, 9.0);
}

TEST(MergeLabels, JoinsThroughFacesWhatTouchesAtACorner) {
  LabelVolume labels;
  labels.grid = {.size = {24, 24, 24}};
  labels.classes = {{"one", 1}, {"other", 2}};
  labels.class_of.assign(labels.grid.voxels(), 0);
  for (int n = 0; n < 10; ++n) {  // two thin rods whose ends touch at a corner alone
    labels.class_of[labels.grid.index(11, 11, 2 + n)] = 1;
    labels.class_of[labels.grid.index(12, 12, 12 + n)] = 2;
  }
  const LabelMask made = merge_labels(labels);
  std::vector<std::size_t> queue = {made.mask.grid.index(11, 11, 2)};
  std::vector<bool> seen(made.mask.labels.size());
  seen[queue[0]] = true;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    for (const std::size_t step : {std::size_t{1}, std::size_t{24}, std::size_t{24 * 24}}) {
      for (const std::size_t m : {queue[next] + step, queue[next] - step}) {
        if (seen[m] || made.mask.labels[m] == 0) continue;
        seen[m] = true;
        queue.push_back(m);
      }
    }
  }
  EXPECT_TRUE(seen[made.mask.grid.index(12, 12, 21)]);
}

TEST(MergeLabels, LeavesOnePieceAsItIs) {
  const LabelVolume labels = trunk_and_branch(0.0);
  const LabelMask made = merge_labels(labels);
  EXPECT_TRUE(made.bridges.empty() && made.lost.empty());
  EXPECT_EQ(made.class_of, labels.class_of);
}

// ---- grown from the volume
// -----------------------------------------------------------------------

TEST(GrowLabels, FollowsTheArteryToThePointAndNoFurther) {
  // A tube along z of 5 mm radius, labelled up to z = 30; beside it one that nothing joins.
  const Grid grid{.size = {60, 40, 70}, .spacing = Vec3::Ones()};
  Image image{.grid = grid, .values = {}, .modality = "CT"};
  LabelMask labels;
  labels.mask.grid = grid;
  for (int k = 0; k < 70; ++k) {
    for (int j = 0; j < 40; ++j) {
      for (int i = 0; i < 60; ++i) {
        const bool tube = std::hypot(i - 20.0, j - 20.0) < 5.0;
        const bool other = std::hypot(i - 45.0, j - 20.0) < 5.0;
        image.values.push_back(tube || other ? 340.0F : 40.0F);
        labels.mask.labels.push_back(tube && k <= 30 ? 1 : 0);
        labels.class_of.push_back(tube && k <= 30 ? 3 : 0);
      }
    }
  }
  const LabelMask before = labels;
  const Growth growth = grow_to(image, Vec3(20, 20, 50), labels);
  EXPECT_EQ(growth.from, 2u);
  EXPECT_NEAR(growth.length_mm, 20.0, 1.5);  // to a voxel at either end
  EXPECT_NEAR(growth.radius_mm, 5.0, 1.0);
  EXPECT_LT((growth.start - Vec3(20, 20, 30)).norm(), 1.5);
  for (std::size_t n = 0; n < image.values.size(); ++n) {
    const auto i = static_cast<int>(n % 60), j = static_cast<int>(n / 60 % 40),
               k = static_cast<int>(n / 2400);
    const bool tube = std::hypot(i - 20.0, j - 20.0) < 5.0;
    if (k <= 50) {
      ASSERT_EQ(labels.mask.labels[n], tube ? 1 : 0) << i << " " << j << " " << k;
      ASSERT_EQ(labels.class_of[n], tube ? 3 : 0);
    } else if (k > 50 + 9) {  // 1.5 radii and a voxel beyond the point
      ASSERT_EQ(labels.mask.labels[n], 0) << i << " " << j << " " << k;
    }
  }
  LabelMask other = before;
  EXPECT_THROW(grow_to(image, Vec3(45, 20, 50), other), Error);
  EXPECT_EQ(other.mask.labels, before.mask.labels);

  // In other units, where 100 HU of contrast mean nothing.
  for (float& value : image.values) value = value > 100.0F ? 40.0F : 4.0F;
  LabelMask as_ct = before, as_mr = before;
  EXPECT_THROW(grow_to(image, Vec3(20, 20, 50), as_ct), Error);
  image.modality = "MR";
  grow_to(image, Vec3(20, 20, 50), as_mr);
  EXPECT_EQ(as_mr.mask.labels, labels.mask.labels);
}

}  // namespace
}  // namespace wireplan::preprocess
