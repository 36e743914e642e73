#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>
#include <vector>

#include "simulate/contact/yielding.h"
#include "simulate/wall/compliance.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

constexpr double kThickness = 1.0, kYoung = 0.056;  // mm, MPa
constexpr double kLawStiffness = 0.3;               // of each point                      [N/mm]

Surface tube() { return shapes::bend_tube(3.0, 15.0, 1.2, 6.0, 6.0, 1.0); }

SurfacePoint foot_in(const Surface& surface, int triangle, const Vec3& weight) {
  const Eigen::Vector3i corner = surface.triangles.col(triangle);
  return {triangle, {corner[0], corner[1], corner[2]}, weight};
}

std::vector<SurfacePoint> random_feet(const Surface& surface, int count, std::mt19937_64& random) {
  std::vector<SurfacePoint> feet;
  for (int k = 0; k < count; ++k) {
    const double a = static_cast<double>(1 + random() % 8), b = static_cast<double>(random() % 8);
    const auto triangle =
        static_cast<int>(random() % static_cast<std::uint64_t>(surface.triangles.cols()));
    feet.push_back(foot_in(surface, triangle, Vec3(a, b, 3.0) / (a + b + 3.0)));
  }
  return feet;
}

/// (C + 1/d)^-1 as `points` gives it for these feet.
Eigen::MatrixXd stiffness(Yielding& points, const WallCompliance& wall,
                          const std::vector<SurfacePoint>& feet) {
  points.set_feet(wall, feet);
  const int m = points.size();
  points.find_stiffness(Eigen::VectorXd::Constant(m, kLawStiffness));
  Eigen::MatrixXd all(m, m);
  for (int j = 0; j < m; ++j) {
    Eigen::VectorXd column = Eigen::VectorXd::Unit(m, j);
    points.multiply_by_stiffness(column);
    all.col(j) = column;
  }
  return all;
}

TEST(Yielding, InvertsTheCompliancesOfItsFeet) {
  const Surface surface = tube();
  const WallCompliance wall(surface, shapes::extruded_wall(surface, kThickness, kYoung));
  std::mt19937_64 random(3);
  const std::vector<SurfacePoint> feet = random_feet(surface, 40, random);
  const auto m = static_cast<Eigen::Index>(feet.size());
  Eigen::MatrixXd compliance = Eigen::MatrixXd::Identity(m, m) / kLawStiffness;
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      const SurfacePoint &one = feet[static_cast<std::size_t>(i)],
                         &other = feet[static_cast<std::size_t>(j)];
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) {
          compliance(i, j) += one.weight[static_cast<int>(a)] * other.weight[static_cast<int>(b)] *
                              WallCompliance::between(wall.half_response(one.vertex[a]),
                                                      wall.half_response(other.vertex[b]));
        }
      }
    }
  }
  Yielding points;
  const Eigen::MatrixXd found = stiffness(points, wall, feet);
  EXPECT_LT((found * compliance - Eigen::MatrixXd::Identity(m, m)).norm(), 1e-9);
}

TEST(Yielding, IsTheSameWhereverItsFeetStoodBefore) {
  const Surface surface = tube();
  const WallCompliance wall(surface, shapes::extruded_wall(surface, kThickness, kYoung));
  std::mt19937_64 random(4);
  Yielding travelled;
  // More vertices in turn than the table has rows for, and then all of them at once.
  for (int round = 0; round < 12; ++round) {
    const std::vector<SurfacePoint> feet = random_feet(surface, 30, random);
    Yielding fresh;
    EXPECT_EQ(stiffness(travelled, wall, feet), stiffness(fresh, wall, feet));  // every bit
  }
  std::vector<SurfacePoint> everywhere;
  for (int t = 0; t < surface.triangles.cols(); ++t) {
    everywhere.push_back(foot_in(surface, t, Vec3::Constant(1.0 / 3.0)));
  }
  travelled.set_feet(wall, everywhere);
  const std::vector<SurfacePoint> feet = random_feet(surface, 30, random);
  Yielding fresh;
  EXPECT_EQ(stiffness(travelled, wall, feet), stiffness(fresh, wall, feet));
}

TEST(Yielding, PointsWithoutAFootFeelNoWallMove) {
  const Surface surface = tube();
  const WallCompliance wall(surface, shapes::extruded_wall(surface, kThickness, kYoung));
  const Vec3 middle = Vec3::Constant(1.0 / 3.0);
  const int last = static_cast<int>(surface.triangles.cols()) - 1;
  Yielding points;
  points.set_feet(wall, {foot_in(surface, last, middle)});  // far from the next
  const std::vector<SurfacePoint> feet = {foot_in(surface, 0, middle), SurfacePoint{},
                                          foot_in(surface, 0, Vec3(0.5, 0.25, 0.25))};
  points.set_feet(wall, feet);
  ASSERT_EQ(points.first_coupled(2), 0);  // past the point without a foot
  points.find_slopes(feet, {Mat3::Identity(), Mat3::Identity(), Mat3::Identity()},
                     Eigen::VectorXd::Ones(3));
  const Eigen::Matrix3Xd motion = Eigen::Matrix3Xd::Constant(3, 3, 0.1);
  Eigen::VectorXd w = Eigen::VectorXd::Zero(3);
  points.add_change_of_compliance(motion, w);
  EXPECT_TRUE(w.allFinite());
  EXPECT_EQ(w[1], 0.0);
  EXPECT_NE(w[0], 0.0);
  EXPECT_NE(w[2], 0.0);
}

TEST(Yielding, WireThatComesBackFeelsNothingOfTheFarPointsBetween) {
  const Surface surface = shapes::bend_tube(3.0, 15.0, 1.2, 6.0, 40.0, 1.0);
  const WallCompliance wall(surface, shapes::extruded_wall(surface, 0.3, kYoung));
  const Vec3 middle = Vec3::Constant(1.0 / 3.0);
  const SurfacePoint here = foot_in(surface, 0, middle),
                     beside = foot_in(surface, 0, Vec3(0.5, 0.25, 0.25)),
                     far = foot_in(surface, static_cast<int>(surface.triangles.cols()) - 1, middle);
  ASSERT_GT((surface.vertices.col(here.vertex[0]) - surface.vertices.col(far.vertex[0])).norm(),
            wall.reach());
  // With the far point between them, two neighbours are to each other what they are without it.
  const auto change = [&](const std::vector<SurfacePoint>& feet) {
    Yielding points;
    points.set_feet(wall, feet);
    EXPECT_EQ(points.first_coupled(points.size() - 1), 0);
    const auto m = static_cast<Eigen::Index>(feet.size());
    points.find_slopes(feet, std::vector<Mat3>(feet.size(), Mat3::Identity()),
                       Eigen::VectorXd::Ones(m));
    Eigen::VectorXd w = Eigen::VectorXd::Zero(m);
    points.add_change_of_compliance(Eigen::Matrix3Xd::Constant(3, m, 0.1), w);
    return w;
  };
  const Eigen::VectorXd with = change({here, far, beside}), without = change({here, beside});
  EXPECT_EQ(with[0], without[0]);
  EXPECT_EQ(with[2], without[1]);
  EXPECT_NE(with[0], 0.0);
  EXPECT_EQ(with[1], change({far})[0]);
}

}  // namespace
}  // namespace wireplan::simulate
