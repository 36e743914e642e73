#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "preprocess/centerline/nearest_wall.h"
#include "preprocess/surface/surface.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

TEST(NearestWall, AgreesWithTheDistanceFromCgalsTreeInsideAndOutside) {
  const Surface bend = shapes::bend_tube(3.0, 12.0, kPi, 6.0, 6.0, 1.0);
  const NearestWall wall(bend);
  const Vec3 low = bend.vertices.rowwise().minCoeff(), high = bend.vertices.rowwise().maxCoeff();
  std::mt19937_64 random(7);
  const auto between = [&](double a, double b) {
    return a + (b - a) * static_cast<double>(random() >> 11) * 0x1.0p-53;
  };
  Nearest near;
  int inside = 0;
  for (int k = 0; k < 500; ++k) {
    Vec3 p;
    for (int d = 0; d < 3; ++d) p(d) = between(low(d) - 4.0, high(d) + 4.0);
    const InsideAnswer answer = locate_point(bend, p);
    const Nearest found = wall.find(p);
    ASSERT_NEAR(found.distance, answer.distance, 1e-9);  // rounding
    ASSERT_NEAR((found.foot - p).norm(), found.distance, 1e-9);
    near = wall.find(p, near);  // from anywhere, the same
    ASSERT_EQ(near.distance, found.distance);
    inside += answer.inside ? 1 : 0;
  }
  EXPECT_GT(inside, 20);
}

TEST(NearestWall, LeavesOutTrianglesWithoutArea) {
  Surface box = shapes::straight_tube(2.0, 6.0, 1.0);
  const double before = NearestWall(box).find(Vec3::Zero()).distance;
  box.triangles.conservativeResize(3, box.triangles.cols() + 1);
  box.triangles.rightCols<1>() = Eigen::Vector3i(0, 1, 1);
  EXPECT_EQ(NearestWall(box).find(Vec3::Zero()).distance, before);
}

}  // namespace
}  // namespace wireplan::preprocess
