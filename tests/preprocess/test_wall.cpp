#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "preprocess/surface/surface.h"
#include "preprocess/wall/wall.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

/// Volume of the tetrahedron on triangle k, positive where the apex is outward.        [mm^3]
double signed_tet_volume(const Surface& surface, const Wall& wall, Eigen::Index k) {
  const Vec3 a = surface.vertices.col(surface.triangles(0, k));
  const Vec3 b = surface.vertices.col(surface.triangles(1, k));
  const Vec3 c = surface.vertices.col(surface.triangles(2, k));
  return (b - a).cross(c - a).dot(wall.apexes.col(k) - a) / 6.0;
}

double area(const Surface& surface, Eigen::Index k) {
  const Vec3 a = surface.vertices.col(surface.triangles(0, k));
  const Vec3 b = surface.vertices.col(surface.triangles(1, k));
  const Vec3 c = surface.vertices.col(surface.triangles(2, k));
  return 0.5 * (b - a).cross(c - a).norm();
}

TEST(Wall, OfAConvexVesselHasTheAskedThicknessEverywhere) {
  const Surface tube = shapes::straight_tube(5.0, 40.0, 1.5);
  const ExtrudedWall extruded = extrude_wall(tube, {.thickness_mm = 1.2});
  const Wall& wall = extruded.wall;
  ASSERT_EQ(wall.height.size(), tube.triangles.cols());
  ASSERT_EQ(wall.apexes.cols(), tube.triangles.cols());
  EXPECT_EQ(wall.height.minCoeff(), 1.2);
  EXPECT_EQ(wall.height.maxCoeff(), 1.2);
  EXPECT_EQ(extruded.statistics.limited, 0);
  EXPECT_EQ(extruded.statistics.inverted, 0);
  EXPECT_EQ(extruded.statistics.min_height_mm, 1.2);
  for (Eigen::Index k = 0; k < tube.triangles.cols(); ++k) {
    const double volume = area(tube, k) * 1.2 / 3.0;
    ASSERT_NEAR(signed_tet_volume(tube, wall, k), volume, 1e-9 * volume);  // rounding
  }
}

TEST(Wall, DefaultModulusGivesTheTargetStiffness) {
  const Surface tube = shapes::straight_tube(3.0, 10.0, 2.0);
  for (const double ratio : {0.0, 0.3, 0.45}) {
    for (const double thickness : {0.5, 1.0, 2.0}) {
      SCOPED_TRACE(ratio);
      const Wall wall =
          extrude_wall(tube, {.thickness_mm = thickness, .poisson_ratio = ratio}).wall;
      EXPECT_EQ(wall.poisson_ratio, ratio);
      const double stiffness =
          wall_normal_stiffness(wall.young_modulus, wall.poisson_ratio, thickness);
      EXPECT_NEAR(stiffness, 25.0 * kMpaPerKpa, 1e-15);  // MPa/mm; rounding
    }
  }
  // References B2: 56 kPa at nu 0.30 and 20 kPa at nu 0.45, both rounded there.
  EXPECT_NEAR(extrude_wall(tube, {.poisson_ratio = 0.3}).wall.young_modulus, 0.056, 0.0005);
  EXPECT_NEAR(extrude_wall(tube, {.poisson_ratio = 0.45}).wall.young_modulus, 0.020, 0.0005);
}

TEST(Wall, GivenModulusIsKept) {
  const Surface tube = shapes::straight_tube(3.0, 10.0, 2.0);
  EXPECT_EQ(extrude_wall(tube, {.young_modulus = 0.5}).wall.young_modulus, 0.5);
}

TEST(Wall, BetweenTwoTubesReachesHalfWayAtMost) {
  const double radius = 3.0, gap = 1.0, thickness = 2.0;
  const Surface left = shapes::straight_tube(radius, 20.0, 1.0);
  Surface right = left;
  right.vertices.row(0).array() += 2.0 * radius + gap;
  const Surface both = shapes::joined(left, right);
  const ExtrudedWall extruded = extrude_wall(both, {.thickness_mm = thickness});
  const Wall& wall = extruded.wall;

  // Nearest where the tubes face each other: half of the gap, which the facets widen by at most
  // their sagitta on both sides (19 sides: 0.04 mm each).
  EXPECT_GE(extruded.statistics.min_height_mm, 0.5 * gap);
  EXPECT_LT(extruded.statistics.min_height_mm, 0.5 * gap + 0.05);
  EXPECT_GT(extruded.statistics.limited, 0);
  EXPECT_EQ(extruded.statistics.limited, (wall.height.array() < thickness).count());
  EXPECT_EQ(extruded.statistics.min_height_mm, wall.height.minCoeff());

  // No apex lies in either tube, no tetrahedron is inverted, and the far sides are not limited.
  int far_sides = 0;
  for (Eigen::Index k = 0; k < wall.apexes.cols(); ++k) {
    const Vec3 apex = wall.apexes.col(k);
    ASSERT_GT(signed_tet_volume(both, wall, k), 0.0);
    ASSERT_FALSE(locate_point(left, apex).inside);
    ASSERT_FALSE(locate_point(right, apex).inside);
    if (apex.x() < 0.0 || apex.x() > 2.0 * radius + gap) {
      ++far_sides;
      ASSERT_EQ(wall.height(k), thickness);
    }
  }
  EXPECT_GT(far_sides, 100);
}

TEST(Wall, InsideASharpBendKeepsItsApexesOffTheOtherWall) {
  // The inner side has 1 mm from the centre of the bend, less than the thickness: straight
  // extrusion would cross over.
  const Surface bend = shapes::bend_tube(3.0, 4.0, kPi, 6.0, 6.0, 1.2);
  const double thickness = 2.0;
  const ExtrudedWall extruded = extrude_wall(bend, {.thickness_mm = thickness});
  const Wall& wall = extruded.wall;
  EXPECT_GT(extruded.statistics.limited, 10);
  for (Eigen::Index k = 0; k < wall.apexes.cols(); ++k) {
    ASSERT_GT(signed_tet_volume(bend, wall, k), 0.0);
    const InsideAnswer apex = locate_point(bend, wall.apexes.col(k));
    ASSERT_FALSE(apex.inside);
    ASSERT_GE(apex.distance, 0.5 * wall.height(k) - 1e-9);
  }
}

TEST(Wall, AcrossACreaseIsNotMuchThinnerThanItsStiffnessAllows) {
  // Two roofs whose facing sides meet in a groove of 1 degree.
  const double slope = 0.5 * kPi / 180.0;
  Surface block;
  block.vertices.resize(3, 10);
  block.triangles.resize(3, 16);
  for (int end = 0; end < 2; ++end) {  // a W cut out of a block, at y = 0 and y = 4
    const double y = 4.0 * end, open = 4.0 * std::tan(slope);
    block.vertices.middleCols<5>(5 * end) << -3.0, 3.0, 3.0, 0.0, -3.0,  //
        y, y, y, y, y,                                                   //
        0.0, 0.0, 6.0, 2.0, 6.0;
    block.vertices(0, 5 * end + 2) = open;
    block.vertices(0, 5 * end + 4) = -open;
  }
  block.triangles << 0, 0, 1, 5, 5, 6, 0, 0, 1, 1, 2, 2, 3, 4, 4, 4,  //
      1, 3, 2, 8, 9, 8, 5, 6, 6, 7, 7, 8, 8, 8, 9, 5,                 //
      3, 4, 3, 6, 8, 7, 6, 1, 7, 2, 8, 3, 4, 9, 5, 0;
  ASSERT_TRUE(is_sound(check_surface(block)));
  const double thickness = 1.0;
  const ExtrudedWall extruded = extrude_wall(block, {.thickness_mm = thickness});
  EXPECT_EQ(extruded.statistics.limited, 4);  // the sides of the groove
  EXPECT_EQ(extruded.statistics.inverted, 0);
  EXPECT_NEAR(extruded.statistics.min_height_mm, 0.05 * thickness, 0.01);
}

TEST(Wall, InAVerySharpCreaseStillHasPositiveVolume) {
  // Two tubes 0.02 mm apart: less than the height under which none is halved.
  const Surface left = shapes::straight_tube(3.0, 10.0, 1.0);
  Surface right = left;
  right.vertices.row(0).array() += 6.02;
  const Surface both = shapes::joined(left, right);
  const Wall wall = extrude_wall(both, {.thickness_mm = 1.0}).wall;
  EXPECT_LT(wall.height.minCoeff(), 0.05);
  for (Eigen::Index k = 0; k < wall.apexes.cols(); ++k) {
    ASSERT_GT(signed_tet_volume(both, wall, k), 0.0);
    ASSERT_FALSE(locate_point(both, wall.apexes.col(k)).inside);
  }
}

}  // namespace
}  // namespace wireplan::preprocess
