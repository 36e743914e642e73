// The lumen's field through the openings of its surface.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "preprocess/surface/openings.h"
#include "simulate/wall/lumen.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

using preprocess::find_openings;
using preprocess::Opening;

/// Lumen of a tube along z from 0 to `length`, open at both ends.
Lumen open_tube(double radius, double length, double edge, double grid_spacing = 0.5) {
  const Surface surface = shapes::straight_tube(radius, length, edge);
  return Lumen(surface, {.grid_spacing = grid_spacing, .openings = find_openings(surface)});
}

TEST(OpenLumen, LeadsStraightOutWhereAClosedOnePushesBack) {
  const double radius = 1.5, length = 14.0;
  const Surface surface = shapes::straight_tube(radius, length, 0.4);
  const Lumen open(surface, {.grid_spacing = 0.25, .openings = find_openings(surface)}),
      closed(surface);
  ASSERT_EQ(open.openings().size(), 2u);
  int beyond = 0;
  for (double z = length - 10.0; z <= length + 2.0; z += 0.1) {
    SCOPED_TRACE(z);
    for (const double lateral : {0.5, 0.8, 1.1}) {
      // To the wall, or to the rim.
      const double depth = z - length;
      const double expected = depth < 0.0 ? radius - lateral : std::hypot(depth, radius - lateral);
      if (expected > 1.8) continue;  // cut at 2 mm
      const WallSample wall = open.sample(Vec3(lateral, 0.0, z));
      // Facets are 0.013 mm off the cylinder; beyond the cap the nearest vertex of the rim counts.
      EXPECT_NEAR(wall.distance, expected, 0.03);
      EXPECT_LT(std::abs(wall.gradient.y()), 0.05);
      if (depth < -0.5) {
        EXPECT_LT(std::abs(wall.gradient.z()), 0.06);  // radial but for the rows of facets
      } else {
        EXPECT_GT(wall.gradient.z(), -0.1);  // not back into the vessel, but for the rim's facets
      }
      if (depth > 0.0) ++beyond;
    }
    // On the axis a wire of 0.9 mm touches nothing.
    EXPECT_GT(open.distance(Vec3(0.0, 0.0, z)), 1.2);
  }
  EXPECT_GT(beyond, 20);
  for (double z = length + 2.0; z < length + 7.5; z += 0.5) {  // nor further out
    EXPECT_GT(open.distance(Vec3(0.0, 0.0, z)), 1.2);
  }

  const WallSample cap = closed.sample(Vec3(0.0, 0.0, length - 0.3));
  EXPECT_NEAR(cap.distance, 0.3, 0.03);
  EXPECT_LT(cap.gradient.z(), -0.95);
}

TEST(OpenLumen, IsContinuousRoundTheRim) {
  // A circle about the rim, from the lumen out and over to the outside of the wall: what is before
  // the cap's plane is free, and the distance changes by no more than the way along the circle.
  const double radius = 2.0, length = 8.0, around = 0.6;
  const Lumen open = open_tube(radius, length, 0.5, 0.25);
  double last = 0.0;
  const double step = 0.05;
  for (double angle = -0.5 * kPi; angle <= kPi; angle += step) {
    const double out = around * std::sin(angle - 0.5 * kPi),
                 up = around * std::cos(angle - 0.5 * kPi);
    // angle -pi/2: straight down the wall; 0: toward the axis; pi/2: up; pi: away from the axis.
    const Vec3 p(radius + out, 0.0, length + up);
    const double distance = open.distance(p);
    const double expected = angle < 0.0 ? radius - p.x() : angle < 0.5 * kPi ? around : up;
    EXPECT_NEAR(distance, expected, 0.08) << angle;  // the kink at the rim is rounded
    if (angle > -0.5 * kPi) {
      EXPECT_LT(std::abs(distance - last), 1.5 * around * step) << angle;
    }
    last = distance;
  }
}

TEST(OpenLumen, LeavesTheRestOfTheFieldAlone) {
  const double radius = 3.0, length = 50.3;
  const Surface surface = shapes::straight_tube(radius, length, 0.8);
  const Lumen open(surface, {.openings = find_openings(surface)}), closed(surface);
  ASSERT_EQ(open.openings().size(), 2u);
  int sampled = 0;
  for (double z = 16.0; z <= length - 16.0; z += 0.7) {
    for (double lateral = 0.0; lateral < 8.0; lateral += 0.3) {
      const Vec3 p(lateral * std::cos(z), lateral * std::sin(z), z);
      EXPECT_NEAR(open.distance(p), closed.distance(p), 1e-6);
      ++sampled;
    }
  }
  EXPECT_GT(sampled, 500);

  // Next to the mouth too, on either side of the wall; and far out it is outside.
  for (const double z : {length - 4.0, length - 2.5}) {
    EXPECT_NEAR(open.distance(Vec3(radius - 0.5, 0.0, z)), 0.5, 0.03);
    EXPECT_NEAR(open.distance(Vec3(0.0, radius + 0.8, z)), -0.8, 0.06);
  }
  for (const Vec3& p : {Vec3(30.0, 0.0, 30.0), Vec3(0.0, -7.0, 30.0), Vec3(0.0, 0.0, length + 15.0),
                        Vec3(12.0, 0.0, length + 3.0), Vec3(0.0, 9.0, length - 5.0)}) {
    EXPECT_DOUBLE_EQ(open.distance(p), -2.0) << p.transpose();
  }
}

TEST(OpenLumen, OfAWideVesselIsFreeAcrossTheCap) {
  const Lumen open = open_tube(9.0, 40.0, 2.0);
  for (double z = 20.0; z < 47.0; z += 0.25) {
    const WallSample wall = open.sample(Vec3(1.0, -2.0, z));
    EXPECT_DOUBLE_EQ(wall.distance, 2.0) << z;
    EXPECT_TRUE(wall.gradient.isZero(0.0)) << z;
  }
}

TEST(OpenLumen, DoesNotReachIntoAVesselThatPassesTheMouth) {
  // The second tube runs 2 mm beside the first and on past its end.
  const Surface first = shapes::straight_tube(3.0, 30.0, 0.8);
  Surface second = shapes::straight_tube(3.0, 50.0, 0.8);
  second.vertices.row(0).array() += 8.0;
  second.vertices.row(2).array() += 5.0;
  const std::vector<Opening> openings = find_openings(first);
  ASSERT_EQ(openings.size(), 2u);
  const Lumen alone(second), both(shapes::joined(first, second), {.openings = openings});
  for (double z = 20.0; z < 42.0; z += 0.5) {
    for (const double x : {5.3, 6.0, 8.0, 10.5}) {
      const Vec3 p(x, 0.3, z);
      // Splines reach through the wall to samples between the vessels, with a weight of hundredths.
      EXPECT_NEAR(both.distance(p), alone.distance(p), 0.03) << p.transpose();
    }
  }
}

TEST(OpenLumen, MeasuresItsDeviationOnTheWallAlone) {
  const Lumen open = open_tube(3.0, 20.0, 0.5);
  EXPECT_GT(open.max_deviation(), 0.0);
  EXPECT_LT(open.max_deviation(), 0.3);  // the middle of the caps is 2 mm off
  EXPECT_LT(open.mean_deviation(), 0.02);
}

}  // namespace
}  // namespace wireplan::simulate
