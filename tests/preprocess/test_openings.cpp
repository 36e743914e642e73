#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "preprocess/surface/openings.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

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

TEST(Openings, AreNotLookedForWhereATriangleIsTurnedOrMissing) {
  const Surface tube = shapes::straight_tube(4.0, 30.0, 1.0);
  Surface turned = tube, open = tube;
  std::swap(turned.triangles(0, 7), turned.triangles(1, 7));
  EXPECT_THROW(find_openings(turned), LogicError);
  open.triangles.conservativeResize(3, tube.triangles.cols() - 1);
  EXPECT_THROW(find_openings(open), LogicError);
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

TEST(LeftThrough, IsRuledOutByTheTipAlone) {
  const std::vector<Opening> openings = find_openings(shapes::straight_tube(2.0, 20.0, 0.5));
  ASSERT_EQ(openings.size(), 2u);
  int came_out = 0, ruled_out = 0;
  for (double z = 25.0; z < 120.0; z += 1.0) {  // ever further out of the upper end
    const Vec3 tip(0.0, 0.0, z);
    const bool left = left_through(openings, wire_through({Vec3(0.0, 0.0, 10.0), tip})).has_value();
    const bool may = may_have_left(openings, tip);
    EXPECT_TRUE(may || !left) << z;
    came_out += left;
    ruled_out += !may;
  }
  EXPECT_GT(came_out, 20);
  EXPECT_GT(ruled_out, 50);  // from 63 mm on
  EXPECT_FALSE(may_have_left({}, Vec3::Zero()));
}

}  // namespace
}  // namespace wireplan::preprocess
