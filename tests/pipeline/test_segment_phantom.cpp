#include <gtest/gtest.h>

#include <algorithm>

#include "preprocess/segment/segment.h"
#include "tests/pipeline/upper_abdomen.h"

namespace wireplan::pipeline {
namespace {

using preprocess::Phantom;
using preprocess::Segmentation;

double dice(const preprocess::Mask& a, const preprocess::Mask& b) {
  double both = 0.0, sum = 0.0;
  for (std::size_t n = 0; n < a.labels.size(); ++n) {
    both += 2.0 * (a.labels[n] & b.labels[n]);
    sum += a.labels[n] + b.labels[n];
  }
  return both / sum;
}

class SegmentPhantom : public ::testing::TestWithParam<std::pair<double, double>> {};

TEST_P(SegmentPhantom, IsFoundFromTwoPointsWithAllItsBranchesAndNothingElse) {
  const auto [spacing, noise] = GetParam();
  const Phantom phantom = make_phantom(upper_abdomen(spacing, noise));
  // aorta below the renal arteries, and the left one's point of the case; the rest is chosen
  const Segmentation found =
      segment(phantom.image, {.seeds = {Vec3(12, 3, 64)}, .target = Vec3(30, 16, 84)});
  EXPECT_GT(dice(found.mask, phantom.lumen), 0.97);
  for (const preprocess::Leak& leak : found.statistics.search.leaks) {
    EXPECT_FALSE(preprocess::contains(phantom.lumen, leak.place)) << leak.place.transpose();
  }

  // every artery over 4 mm in diameter, a voxel off the border of the volume and outside plaque
  int on_axis = 0;
  for (std::size_t artery = 0; artery < phantom.names.size(); ++artery) {
    const Centerline& axis = phantom.centerlines[artery];
    for (Eigen::Index n = 0; n < axis.points.cols(); ++n) {
      if (axis.radius(n) > 2.0 && preprocess::contains(phantom.lumen, axis.points.col(n))) {
        EXPECT_TRUE(preprocess::contains(found.mask, axis.points.col(n)))
            << phantom.names[artery] << " at " << axis.points.col(n).transpose();
        ++on_axis;
      }
    }
  }
  EXPECT_GT(on_axis, 600);  // 300 mm of arteries, every half millimetre

  // no vein, no bone, no kidney: nothing lies more than two millimetres off the true lumen
  for (std::size_t n = 0; n < found.mask.labels.size(); ++n) {
    if (found.mask.labels[n] != 0 && phantom.lumen.labels[n] == 0) {
      const preprocess::Grid& grid = found.mask.grid;
      const auto nx = static_cast<std::size_t>(grid.size[0]);
      const auto ny = static_cast<std::size_t>(grid.size[1]);
      const Vec3 point =
          grid.lps_from_ijk(Vec3(static_cast<double>(n % nx), static_cast<double>(n / nx % ny),
                                 static_cast<double>(n / (nx * ny))));
      bool near = false;
      for (int m = 0; m < 27 && !near; ++m) {
        const Vec3 offset = Vec3(m % 3 - 1, m / 3 % 3 - 1, m / 9 - 1) * 2.0;
        near = preprocess::contains(phantom.lumen, point + offset) ||
               preprocess::contains(phantom.lumen, point + 0.5 * offset);
      }
      EXPECT_TRUE(near) << point.transpose();
    }
  }
}

// 22 HU is the bundled case's noise, 40 HU that of a fast low-dose scan
INSTANTIATE_TEST_SUITE_P(VoxelsAndNoise, SegmentPhantom,
                         ::testing::Values(std::pair(0.9, 22.0), std::pair(0.9, 40.0),
                                           std::pair(0.6, 22.0), std::pair(0.6, 40.0)));

}  // namespace
}  // namespace wireplan::pipeline
