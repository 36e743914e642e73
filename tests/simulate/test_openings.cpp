#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "preprocess/surface/openings.h"
#include "simulate/wall/lumen.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

using preprocess::find_openings;
using preprocess::left_through;
using preprocess::Opening;

/// Straight tube along z whose radius at each row is `radius_at(z)`.
template <class RadiusAt>
Surface shaped_tube(double length, int rows, int sides, const RadiusAt& radius_at) {
  Eigen::Matrix3Xd axis = Eigen::Matrix3Xd::Zero(3, rows + 1);
  axis.row(2) = Eigen::RowVectorXd::LinSpaced(rows + 1, 0.0, length);
  Eigen::VectorXd radius(rows + 1);
  for (int k = 0; k <= rows; ++k) radius[k] = radius_at(axis(2, k));
  return shapes::tube(axis, radius, sides);
}

// ---------------------------------------------------------------- finding them

TEST(Openings, AreTheTwoCapsOfATube) {
  const double radius = 4.0, length = 30.0;
  const int sides = std::max(6, static_cast<int>(std::ceil(2.0 * kPi * radius)));  // edge 1 mm
  const std::vector<Opening> openings = find_openings(shapes::straight_tube(radius, length, 1.0));
  ASSERT_EQ(openings.size(), 2u);
  // A cap is a regular polygon: of area n/2 R^2 sin(2 pi/n).
  const double polygon = radius * std::sqrt(0.5 * sides * std::sin(2.0 * kPi / sides) / kPi);
  for (const Opening& opening : openings) {
    const bool far = opening.center.z() > 1.0;
    EXPECT_LT((opening.center - Vec3(0.0, 0.0, far ? length : 0.0)).norm(), 1e-9);
    EXPECT_LT((opening.normal - (far ? 1.0 : -1.0) * Vec3::UnitZ()).norm(), 1e-9);
    EXPECT_NEAR(opening.radius, polygon, 1e-9);
    EXPECT_TRUE(std::is_sorted(opening.triangles.begin(), opening.triangles.end()));
  }
  EXPECT_LT(openings[0].center.z(), openings[1].center.z());  // in order of triangles
}

TEST(Openings, LieSquareToTheEndsOfABentTube) {
  const double angle = 1.2, bend = 25.0;
  const std::vector<Opening> openings =
      find_openings(shapes::bend_tube(3.0, bend, angle, 10.0, 10.0, 0.8));
  ASSERT_EQ(openings.size(), 2u);
  const Vec3 out(std::sin(angle), 0.0, std::cos(angle));
  const Vec3 end =
      Vec3(bend * (1.0 - std::cos(angle)), 0.0, 10.0 + bend * std::sin(angle)) + 10.0 * out;
  EXPECT_LT((openings[0].normal + Vec3::UnitZ()).norm(), 1e-9);
  EXPECT_LT((openings[1].normal - out).norm(), 1e-9);
  EXPECT_LT((openings[1].center - end).norm(), 1e-9);
}

TEST(Openings, AreFoundWhereSmoothingRoundedTheRim) {
  // A quarter circle of 1.2 mm at the end: about what a segmented artery of 4 mm keeps.
  const double radius = 4.0, length = 30.0, round = 1.2;
  const std::vector<Opening> openings = find_openings(shaped_tube(length, 150, 36, [&](double z) {
    const double into = std::min(round, std::min(z, length - z));
    return radius - round + std::sqrt(round * round - (round - into) * (round - into));
  }));
  ASSERT_EQ(openings.size(), 2u);
  for (const Opening& opening : openings) {
    EXPECT_GT(opening.radius, 0.95 * (radius - round));  // the polygon of the flat part
    EXPECT_LT(opening.radius, radius);
  }
}

TEST(Openings, MayBeCutObliquely) {
  // Sheared by z += 0.7 x: both ends are cut at 35 degrees, ellipses of 1.22 : 1.
  Surface surface = shapes::straight_tube(3.0, 30.0, 0.7);
  surface.vertices.row(2) += 0.7 * surface.vertices.row(0);
  const std::vector<Opening> openings = find_openings(surface);
  ASSERT_EQ(openings.size(), 2u);
  EXPECT_LT((openings[1].normal - Vec3(-0.7, 0.0, 1.0).normalized()).norm(), 1e-9);
}

TEST(Openings, AreNeitherDomesNorSpheres) {
  EXPECT_TRUE(find_openings(shapes::sphere(Vec3(1.0, 2.0, 3.0), 5.0, 0.7)).empty());
  const double radius = 3.0, length = 30.0;
  const std::vector<Opening> capsule = find_openings(shaped_tube(length, 200, 36, [&](double z) {
    const double into = std::min(radius, std::min(z, length - z) + 0.01);
    return std::sqrt(radius * radius - (radius - into) * (radius - into));
  }));
  EXPECT_TRUE(capsule.empty());
}

TEST(Openings, AreNotTheFlatTopOfABulge) {
  // A ball of 6 mm with its top cut off, 3 mm wide, at the end of a tube of 2 mm.
  const double length = 31.2;
  const std::vector<Opening> openings = find_openings(shaped_tube(length, 156, 36, [](double z) {
    const double from_center = z - 26.0;
    return std::max(2.0, std::sqrt(std::max(0.0, 36.0 - from_center * from_center)));
  }));
  ASSERT_EQ(openings.size(), 1u);  // the tube's other end
  EXPECT_LT(openings[0].center.z(), 1e-9);
}

TEST(Openings, AreNotFlatPlacesOnAVesselsSide) {
  for (const double half_length : {100.0, 4.0}) {  // all along, or a disc-like place in the middle
    SCOPED_TRACE(half_length);
    Surface surface = shapes::straight_tube(4.0, 40.0, 0.6);
    int moved = 0;
    for (Eigen::Index v = 0; v < surface.vertices.cols(); ++v) {
      if (surface.vertices(0, v) < 2.4 || std::abs(surface.vertices(2, v) - 20.0) > half_length) {
        continue;
      }
      surface.vertices(0, v) = 2.4;
      ++moved;
    }
    ASSERT_GT(moved, 100);
    const std::vector<Opening> openings = find_openings(surface);
    ASSERT_EQ(openings.size(), 2u);
    for (const Opening& opening : openings) EXPECT_GT(std::abs(opening.normal.z()), 0.999);
  }
}

TEST(Openings, OfABoxAreTheEndsOfALongOneOnly) {
  const auto box = [](double length) {
    return shapes::divided_box(Vec3::Zero(), Vec3(4.0, 4.0, length), 6);
  };
  EXPECT_TRUE(find_openings(box(4.0)).empty());  // a cube: which of its faces would be the ends?
  const std::vector<Opening> openings = find_openings(box(16.0));
  ASSERT_EQ(openings.size(), 2u);
  for (const Opening& opening : openings) {
    EXPECT_NEAR(std::abs(opening.normal.z()), 1.0, 1e-12);
    EXPECT_NEAR(opening.radius, 4.0 / std::sqrt(kPi), 1e-12);
  }
}

// ---------------------------------------------------------------- the field through them

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

// ---------------------------------------------------------------- leaving through them

/// Nodes (3, n) of a wire that goes through the points, 0.5 mm apart.
Eigen::Matrix3Xd wire_through(const std::vector<Vec3>& points) {
  std::vector<Vec3> nodes = {points.front()};
  for (std::size_t k = 1; k < points.size(); ++k) {
    const Vec3 way = points[k] - points[k - 1];
    const int parts = std::max(1, static_cast<int>(std::ceil(way.norm() / 0.5)));
    for (int p = 1; p <= parts; ++p) nodes.push_back(points[k - 1] + way * p / parts);
  }
  Eigen::Matrix3Xd wire(3, nodes.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) wire.col(k) = nodes[k];
  return wire;
}

TEST(LeftThrough, NamesTheCapThatTheWireComesOutOf) {
  const std::vector<Opening> openings = find_openings(shapes::straight_tube(2.0, 20.0, 0.5));
  ASSERT_EQ(openings.size(), 2u);
  const Vec3 inside(0.0, 0.0, 10.0);
  const auto left = [&](const std::vector<Vec3>& points) {
    return left_through(openings, wire_through(points));
  };
  EXPECT_EQ(left({inside, Vec3(0.0, 0.0, 21.1)}), 1);
  EXPECT_EQ(left({inside, Vec3(0.0, 0.0, 20.9)}), std::nullopt);  // not 1 mm yet
  EXPECT_EQ(left({inside, Vec3(0.0, 0.0, 19.0)}), std::nullopt);
  EXPECT_EQ(left({inside, Vec3(0.5, 0.0, -2.0)}), 0);
  EXPECT_EQ(left({inside, Vec3(0.0, 0.0, 45.0)}), 1);                        // sprang out
  EXPECT_EQ(left({inside, Vec3(1.5, 0.0, 20.0), Vec3(8.0, 0.0, 20.6)}), 1);  // flat over the rim
  EXPECT_EQ(left({inside, Vec3(1.5, 0.0, 20.2), Vec3(8.0, 0.0, 19.0)}), 1);  // and back beside it
  EXPECT_EQ(left({Vec3(9.0, 0.0, 10.0), Vec3(9.0, 0.0, 25.0)}), std::nullopt);  // another vessel
  EXPECT_EQ(left({Vec3(0.0, 0.0, 25.0), inside}), std::nullopt);                // came in by it
  EXPECT_EQ(left_through(openings, wire_through({inside})), std::nullopt);
  EXPECT_EQ(left_through({}, wire_through({inside, Vec3(0.0, 0.0, 25.0)})), std::nullopt);
}

}  // namespace
}  // namespace wireplan::simulate
