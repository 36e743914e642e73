#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "preprocess/segment/segment.h"
#include "tests/preprocess/segment_answers.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

/// Folder of the real inputs: WIREPLAN_DATA, else beside the checkout.
fs::path data_folder() {
  const char* folder = std::getenv("WIREPLAN_DATA");
  return folder != nullptr ? fs::path(folder) : fs::path(WIREPLAN_SOURCE_DIR) / "../shared/data";
}

TEST(RealSegment, MraAortaIsOnePieceFromIliacsToRenals) {
  const fs::path path = data_folder() / "mra-aorta-iliac-vmtk/aorta.mha";
  if (!fs::exists(path)) {
    GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  }
  const Segmentation found = segment(read_image(path), {.lower_hu = 700.0,
                                                        .upper_hu = 3000.0,
                                                        .seeds = {Vec3(-189.8, -28.1, 46.5)},
                                                        .target = Vec3(-254.0, -228.5, 28.5)});
  for (const Vec3& point : {Vec3(-189.8, -28.1, 46.5), Vec3(-274.2, -29.0, 42.0),
                            Vec3(-181.9, -227.6, 19.5), Vec3(-254.0, -228.5, 28.5)}) {
    EXPECT_TRUE(contains(found.mask, point)) << point.transpose();
  }
  EXPECT_NEAR(found.statistics.volume_mm3, 78000.0, 500.0);  // the README's figure, rounded
}

TEST(RealSegment, CtAbdomenAortaIsFreeOfVeinAndBone) {
  const fs::path path = data_folder() / "ct-abdomen-dicom/PATIENT_DICOM";
  if (!fs::exists(path)) {
    GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  }
  const Image image = read_image(path);
  SegmentOptions settings{.lower_hu = 160.0,
                          .upper_hu = 300.0,
                          .seeds = {Vec3(146.5, 130.5, 32.0)},
                          .smoothing_mm = 0.8,
                          .neck_opening_mm = 2.0};
  const Segmentation found = segment(image, settings);
  const Vec3 iliac(139.7, 130.5, 19.2), other_iliac(149.9, 136.8, 19.2), renal(157.9, 140.8, 115.2);
  EXPECT_TRUE(contains(found.mask, iliac));
  EXPECT_TRUE(contains(found.mask, other_iliac));
  EXPECT_TRUE(contains(found.mask, renal));
  EXPECT_GT(found.statistics.removed_by_opening_mm3, 100000.0);  // veins, kidneys
  // slice by slice no more than an aorta of 8 mm radius, no less than two iliacs of 3 mm
  const Grid& grid = found.mask.grid;
  for (int k = 0; k < grid.size[2]; ++k) {
    double area = 0.0;
    for (std::size_t n = grid.index(0, 0, k); n < grid.index(0, 0, k + 1); ++n) {
      area += found.mask.labels[n] * grid.spacing[0] * grid.spacing[1];
    }
    EXPECT_GT(area, 2 * kPi * 3.0 * 3.0) << "slice " << k;
    EXPECT_LT(area, kPi * 8.5 * 8.5) << "slice " << k;
  }
}

/// Everything that the tests of the four CTs give: two points. The parameters are the defaults.
SegmentOptions from_to(const Vec3& access, const Vec3& target) {
  return {.seeds = {access}, .target = target};
}

TEST(RealSegment, CtAbdomenRightIliacToSmaGoesThroughTheAorta) {
  const fs::path path = data_folder() / "ct-abdomen-dicom/PATIENT_DICOM";
  if (!fs::exists(path)) {
    GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  }
  const Image image = read_image(path);
  const Segmentation found =
      segment(image, from_to(Vec3(139.7, 130.5, 19.2), Vec3(167.0, 126.0, 102.4)));
  const Route& route = found.statistics.search.route;
  // its README: 173 mm up to the ostium near z = 140 and down again; 130 mm is the renal vein
  EXPECT_NEAR(route.length_mm, 173.0, 17.3);
  double top = 0.0;
  for (const Vec3& point : route.points) {
    top = std::max(top, point.z());
  }
  EXPECT_NEAR(top, 140.0, 5.0);
  // the vena cava, 157 HU, right of the aorta at n = 25 and 40
  EXPECT_FALSE(contains(found.mask, Vec3(128.3, 138.0, 40.0)));
  EXPECT_FALSE(contains(found.mask, Vec3(131.0, 137.0, 64.0)));
}

TEST(RealSegment, CtDissectionTrueLumenIsFoundFromEntryAndTarget) {
  const fs::path folder = data_folder() / "ct-aorta-dissection-labelled";
  if (!fs::exists(folder)) {
    GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  }
  const Image image = read_image(folder / "ct_cropped.nii.gz");
  const Mask lumen = read_mask(folder / "aorta_true_lumen.nii.gz");
  const Mask other = read_mask(folder / "aorta_false_lumen.nii.gz");
  const Vec3 entry(-5.7, -149.2, 552.2), carotid(16.8, -170.2, 780.2);
  const Segmentation found = segment(image, from_to(entry, carotid));
  EXPECT_GT(dice(found.mask, [&](const Vec3& p) { return contains(lumen, p); }), 0.85);
  // the heart was cut off, and the way keeps out of the false lumen
  ASSERT_FALSE(found.statistics.search.leaks.empty());
  EXPECT_GT(found.statistics.search.leaks[0].volume_mm3, 200000.0);
  ASSERT_GT(found.statistics.search.route.points.size(), 100U);
  for (const Vec3& point : found.statistics.search.route.points) {
    EXPECT_FALSE(contains(other, point)) << point.transpose();
  }

  // the left subclavian artery is cut off by the stent-graft
  const std::string error = error_of(image, from_to(entry, Vec3(63.3, -165.7, 780.2)));
  EXPECT_TRUE(has(error, "target (63.3, -165.7, 780.2) mm is not connected")) << error;
  EXPECT_TRUE(has(error, "the nearest point that the lumen reaches is (")) << error;
}

TEST(RealSegment, CtHeadVertebralToBasilarKeepsOutOfTheVeins) {
  const fs::path path = data_folder() / "ct-head-avm/CT_AVM.nii.gz";
  if (!fs::exists(path)) {
    GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  }
  const Image image = read_image(path);
  const Segmentation found =
      segment(image, from_to(Vec3(-18.8, 17.1, -55.1), Vec3(-8.7, -26.2, -14.1)));
  EXPECT_NEAR(found.statistics.search.route.length_mm, 83.0, 8.3);  // its README
  // veins and sinuses have 400 HU and more, arteries 330 at most
  std::size_t inside = 0, bright = 0;
  for (std::size_t n = 0; n < image.values.size(); ++n) {
    inside += found.mask.labels[n];
    bright += found.mask.labels[n] != 0 && image.values[n] > 400.0F ? 1 : 0;
  }
  EXPECT_LT(static_cast<double>(bright), 0.01 * static_cast<double>(inside));
}

TEST(RealSegment, CtPelvisWithoutContrastIsRefusedWithItsHu) {
  const fs::path path = data_folder() / "ct-pelvis-no-contrast/example_ct_sm.nii.gz";
  if (!fs::exists(path)) {
    GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  }
  const Image image = read_image(path);
  // wherever the points are put, one above the other: soft tissue is refused for its HU; marrow for
  // its scatter, for the bone round it, or because it holds together no further
  const Grid& grid = image.grid;
  const auto nx = static_cast<std::size_t>(grid.size[0]);
  const auto ny = static_cast<std::size_t>(grid.size[1]);
  int soft = 0, bone = 0;
  for (std::size_t n = 0; n + 8 * nx * ny < image.values.size(); n += 101) {
    const Vec3 ijk(static_cast<double>(n % nx), static_cast<double>(n / nx % ny),
                   static_cast<double>(n / nx / ny));
    const std::string error = error_of(
        image, from_to(grid.lps_from_ijk(ijk), grid.lps_from_ijk(ijk + 8.0 * Vec3::UnitZ())));
    const bool told = has(error, "no contrast-filled artery at") && has(error, "the volume has ");
    (told ? soft : bone) += 1;
  }
  EXPECT_GT(soft, 2000);
  EXPECT_GT(bone, 0);  // guards against a loop that meets no bone
}

}  // namespace
}  // namespace wireplan::preprocess
