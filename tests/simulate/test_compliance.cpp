#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "simulate/wall/compliance.h"
#include "simulate/wall/locator.h"
#include "tests/shapes.h"
#include "tests/simulate/direct_solvers.h"

namespace wireplan::simulate {
namespace {

constexpr double kYoung = 0.056, kPoisson = 0.3, kThickness = 1.0;  // MPa, -, mm

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1.0p-53; }

Vec3 random_vector(std::mt19937_64& random) {
  return {2.0 * uniform(random) - 1.0, 2.0 * uniform(random) - 1.0, 2.0 * uniform(random) - 1.0};
}

Wall extruded(const Surface& surface, double thickness) {
  Wall wall = shapes::extruded_wall(surface, thickness, kYoung);
  wall.poisson_ratio = kPoisson;
  return wall;
}

/// Flat patch of 2 n^2 triangles in the plane z = 0, outward +z, inner vertices shaken.
Surface flat_patch(int n, double edge) {
  std::mt19937_64 random(5);
  Surface patch;
  patch.vertices.resize(3, (n + 1) * (n + 1));
  patch.triangles.resize(3, 2 * n * n);
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      const bool inner = i > 0 && j > 0 && i < n && j < n;
      Vec3 shake = inner ? Vec3(0.3 * random_vector(random)) : Vec3::Zero();
      shake.z() = 0.0;
      patch.vertices.col(i + (n + 1) * j) = edge * (Vec3(i, j, 0.0) + shake);
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int p = i + (n + 1) * j, q = p + n + 1, square = 2 * (i + n * j);
      patch.triangles.col(square) << p, p + 1, q + 1;
      patch.triangles.col(square + 1) << p, q + 1, q;
    }
  }
  return patch;
}

Surface small_tube() { return shapes::bend_tube(3.0, 15.0, 1.2, 6.0, 6.0, 1.8); }

/// K^-1 f by another factorisation than the one under test.
class DirectSolver {
 public:
  DirectSolver(const Surface& surface, const Wall& wall)
      : factors_(wall_stiffness(surface, wall)) {}
  Eigen::Matrix3Xd solve(const Eigen::Matrix3Xd& forces) const {
    const Eigen::VectorXd u = factors_.solve(forces.reshaped());
    return u.reshaped(3, forces.cols());
  }

 private:
  SparseFactors factors_;
};

// ---------------------------------------------------------------- stiffness

TEST(WallStiffness, OfAPatchIsThatOfItsThickness) {
  const int n = 7;
  const double edge = 0.8, area = n * n * edge * edge;
  const double G = 0.5 * kYoung / (1.0 + kPoisson), u = 0.01;
  const Surface patch = flat_patch(n, edge);
  for (const double t : {0.4, 1.0, 3.0}) {
    SCOPED_TRACE(t);
    const Eigen::SparseMatrix<double> K = wall_stiffness(patch, extruded(patch, t));
    // All vertices move alike, so every tetrahedron has the strain u / t and the patch has no rim:
    // exact up to rounding, whatever the triangles (references B2).
    const auto force_under = [&](const Vec3& displacement) -> Vec3 {
      const Eigen::VectorXd moved = displacement.replicate(patch.vertices.cols(), 1);
      return (K * moved).reshaped(3, patch.vertices.cols()).rowwise().sum() / area;
    };
    const double k_n = wall_normal_stiffness(kYoung, kPoisson, t), k_t = G / (3.0 * t);
    EXPECT_NEAR(force_under(Vec3(0.0, 0.0, u)).z(), k_n * u, 1e-10 * k_n * u);
    EXPECT_NEAR(force_under(Vec3(u, 0.0, 0.0)).x(), k_t * u, 1e-10 * k_t * u);
    EXPECT_NEAR(force_under(Vec3(0.0, u, 0.0)).y(), k_t * u, 1e-10 * k_t * u);
    EXPECT_NEAR(force_under(Vec3(0.0, 0.0, u)).head<2>().norm(), 0.0, 1e-10 * k_n * u);
  }
}

TEST(WallStiffness, OneTetrahedronStoresTheEnergyOfItsStrain) {
  std::mt19937_64 random(9);
  Surface triangle{.vertices = Eigen::Matrix3Xd(3, 3), .triangles = Eigen::Vector3i(0, 1, 2)};
  triangle.vertices << 0.0, 1.3, 0.2, 0.1, -0.2, 1.1, 0.3, 0.0, -0.1;
  Wall wall = extruded(triangle, 0.7);
  wall.apexes.col(0) += Vec3(0.2, 0.1, 0.0);
  const Vec3 apex = wall.apexes.col(0);
  const Mat3 edges = triangle.vertices.colwise() - apex;
  const double volume = -edges.determinant() / 6.0;
  const double lambda = kYoung * kPoisson / ((1.0 + kPoisson) * (1.0 - 2.0 * kPoisson)),
               mu = 0.5 * kYoung / (1.0 + kPoisson);
  const Eigen::SparseMatrix<double> K = wall_stiffness(triangle, wall);
  for (int k = 0; k < 20; ++k) {
    Mat3 gradient;  // of the displacement: strain and rotation, of which the latter costs nothing
    for (int c = 0; c < 3; ++c) gradient.col(c) = random_vector(random);
    const Mat3 strain = 0.5 * (gradient + gradient.transpose());
    const double expected =
        volume * (0.5 * lambda * strain.trace() * strain.trace() + mu * strain.squaredNorm());
    const Eigen::VectorXd u = (gradient * edges).reshaped();
    EXPECT_NEAR(0.5 * u.dot(K * u), expected, 1e-13 * expected);  // rounding
  }
}

TEST(WallStiffness, IsSymmetricAndResistsEveryMotion) {
  const Surface tube = small_tube();
  const Eigen::MatrixXd K = wall_stiffness(tube, extruded(tube, kThickness));
  const double largest = K.cwiseAbs().maxCoeff();
  EXPECT_LT((K - K.transpose()).cwiseAbs().maxCoeff(), 1e-15 * largest);
  // The softest motion is in the plane of the triangles, over more of the wall than one vertex; it
  // is still far from none.
  EXPECT_GT(smallest_eigenvalue(K), 1e-3 * largest);
}

TEST(WallStiffness, RefusesAWallThatIsNone) {
  const Surface patch = flat_patch(2, 1.0);
  const auto message = [&](const auto& spoil) -> std::string {
    Wall wall = extruded(patch, kThickness);
    spoil(wall);
    try {
      const WallCompliance compliance(patch, wall);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_NE(message([](Wall& w) { w.young_modulus = 0.0; }).find("Young modulus is 0 MPa"),
            std::string::npos);
  EXPECT_NE(message([](Wall& w) { w.poisson_ratio = 0.5; }).find("Poisson ratio is 0.5"),
            std::string::npos);
  EXPECT_NE(message([](Wall& w) { w.apexes(2, 3) = 0.0; }).find("tetrahedron 3 has a volume of"),
            std::string::npos);
  EXPECT_NE(message([](Wall& w) { w.apexes(2, 5) = -1.0; }).find("tetrahedron 5 has a volume of -"),
            std::string::npos);
}

// ---------------------------------------------------------------- compliance

TEST(WallCompliance, MovesAsADirectSolveSays) {
  const Surface tube = small_tube();
  const Wall wall = extruded(tube, kThickness);
  const WallCompliance compliance(tube, wall);
  const DirectSolver direct(tube, wall);
  std::mt19937_64 random(2);
  for (int k = 0; k < 10; ++k) {
    const int vertex =
        static_cast<int>(random() % static_cast<std::uint64_t>(tube.vertices.cols()));
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, tube.vertices.cols());
    force.col(vertex) = random_vector(random);
    const Eigen::Matrix3Xd expected = direct.solve(force);
    ASSERT_GT(expected.cwiseAbs().maxCoeff(), 1.0);  // mm: a newton or so on a soft wall
    EXPECT_LT((compliance.displacements(force) - expected).cwiseAbs().maxCoeff(),
              1e-8 * expected.cwiseAbs().maxCoeff());
  }
}

TEST(WallCompliance, CouplesAsADirectSolveSaysAndLeavesOutLittle) {
  // A tube so long and thin that a force is not felt everywhere; and a short one where it is felt
  // up to the rims of the caps, past which sideways motion turns into normal motion.
  const std::array<std::pair<Surface, double>, 2> shapes = {
      {{shapes::bend_tube(2.0, 30.0, 1.0, 20.0, 20.0, 1.2), 0.5}, {small_tube(), kThickness}}};
  std::mt19937_64 random(3);
  for (const auto& [tube, thickness] : shapes) {
    const Wall wall = extruded(tube, thickness);
    const WallCompliance compliance(tube, wall);
    const DirectSolver direct(tube, wall);
    const Eigen::Index vertices = tube.vertices.cols();
    int none = 0;
    for (int k = 0; k < 30; ++k) {
      const int a = static_cast<int>(random() % static_cast<std::uint64_t>(vertices));
      Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, vertices);
      for (const auto& [b, part] : compliance.spread(a)) {
        force.col(b) = part * compliance.normals().col(b);
      }
      const Eigen::VectorXd moved =
          (direct.solve(force).array() * compliance.normals().array()).colwise().sum();
      Eigen::VectorXd expected = Eigen::VectorXd::Zero(vertices);
      for (int b = 0; b < vertices; ++b) {
        for (const auto& [c, part] : compliance.spread(b)) expected[b] += part * moved[c];
      }
      // Those that count as none are below 1e-8 of c_a; rounding is far less.
      const WallCompliance::HalfResponse& here = compliance.half_response(a);
      EXPECT_NEAR(here.compliance, expected[a], 1e-12 * expected[a]);
      EXPECT_NEAR(WallCompliance::between(here, here), expected[a], 1e-12 * expected[a]);
      for (int b = 0; b < vertices; ++b) {
        const WallCompliance::HalfResponse& there = compliance.half_response(b);
        const double found = WallCompliance::between(here, there);
        if (found == 0.0) {
          EXPECT_LT(std::abs(expected[b]), 1.001e-8 * expected[a]);
          ++none;
        } else {
          ASSERT_NEAR(found, expected[b], 1e-12 * expected[a]);
        }
      }
    }
    EXPECT_GT(none, 0);
  }
}

TEST(WallCompliance, FeelsNothingBeyondItsReach) {
  struct Case {
    double thickness, poisson_ratio;
  };
  const Surface tube = shapes::bend_tube(2.0, 60.0, 1.0, 30.0, 30.0, 1.2);
  std::mt19937_64 random(5);
  for (const auto& [thickness, poisson_ratio] :
       {Case{0.3, 0.3}, Case{1.0, 0.3}, Case{0.5, 0.45}, Case{1.0, 0.0}}) {
    SCOPED_TRACE(thickness);
    Wall wall = extruded(tube, thickness);
    wall.poisson_ratio = poisson_ratio;
    const WallCompliance compliance(tube, wall);
    ASSERT_EQ(compliance.vertices(), tube.vertices);
    double farthest = 0.0;  // of what is felt
    int beyond = 0;
    for (int k = 0; k < 60; ++k) {
      const int a = static_cast<int>(random() % static_cast<std::uint64_t>(tube.vertices.cols()));
      for (int b = 0; b < tube.vertices.cols(); ++b) {
        const double distance = (tube.vertices.col(a) - tube.vertices.col(b)).norm();
        const bool felt = WallCompliance::between(compliance.half_response(a),
                                                  compliance.half_response(b)) != 0.0;
        if (felt) farthest = std::max(farthest, distance);
        beyond += distance > compliance.reach() ? 1 : 0;
      }
    }
    EXPECT_GT(beyond, 1000);
    EXPECT_LT(farthest, compliance.reach());
    EXPECT_GT(farthest, 0.5 * compliance.reach());  // or it would spare nothing
  }
}

TEST(WallCompliance, IsAsMuchFromHereToThereAsBack) {
  const Surface tube = small_tube();
  const WallCompliance compliance(tube, extruded(tube, kThickness));
  for (int a = 0; a < tube.vertices.cols(); ++a) {
    for (int b = 0; b < a; ++b) {
      const auto &one = compliance.half_response(a), &other = compliance.half_response(b);
      ASSERT_EQ(WallCompliance::between(one, other), WallCompliance::between(other, one));
    }
  }
}

TEST(WallCompliance, AnswersSeveralThreadsAsIfAlone) {
  const Surface tube = small_tube();
  const Wall wall = extruded(tube, kThickness);
  const WallCompliance alone(tube, wall), shared(tube, wall);
  const int vertices = static_cast<int>(tube.vertices.cols());
  // All start at the same vertices, so that they race for them.
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k) {
    threads.emplace_back([&shared, vertices] {
      for (int a = 0; a < vertices; ++a) shared.half_response(a);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (int a = 0; a < vertices; ++a) {
    EXPECT_EQ(shared.half_response(a).places, alone.half_response(a).places);
    EXPECT_EQ(shared.half_response(a).values, alone.half_response(a).values);  // every bit
  }
  EXPECT_EQ(shared.response_count(), static_cast<std::size_t>(vertices));
  EXPECT_EQ(shared.memory_bytes(), alone.memory_bytes());
}

TEST(WallCompliance, KeepsWhatItFound) {
  const Surface tube = small_tube();
  const WallCompliance compliance(tube, extruded(tube, kThickness));
  const std::size_t before = compliance.memory_bytes();
  EXPECT_EQ(compliance.response_count(), 0U);
  const WallCompliance::HalfResponse* const first = &compliance.half_response(7);
  const std::size_t after = compliance.memory_bytes();
  EXPECT_GT(after, before);
  EXPECT_EQ(compliance.response_count(), 1U);
  EXPECT_EQ(&compliance.half_response(7), first);
  EXPECT_EQ(compliance.memory_bytes(), after);
  EXPECT_EQ(compliance.response_count(), 1U);
}

TEST(WallCompliance, HoldsWhereWallsNearlyTouch) {
  // A few tetrahedra a thousand times flatter, and so stiffer, than their neighbours.
  const Surface tube = small_tube();
  Wall wall = extruded(tube, kThickness);
  const Wall flat = extruded(tube, 1e-3 * kThickness);
  for (Eigen::Index k = 50; k < 60; ++k) {
    wall.apexes.col(k) = flat.apexes.col(k);
    wall.height[k] = flat.height[k];
  }
  const WallCompliance compliance(tube, wall);
  const DirectSolver direct(tube, wall);
  const Eigen::Matrix3Xd force = compliance.normals();
  const Eigen::Matrix3Xd expected = direct.solve(force);
  EXPECT_LT((compliance.displacements(force) - expected).cwiseAbs().maxCoeff(),
            1e-8 * expected.cwiseAbs().maxCoeff());
  // Near a fixed apex so close, the triangle may still tilt about it but not move away.
  const auto middle = [&](Eigen::Index k) -> Vec3 {
    return (expected.col(tube.triangles(0, k)) + expected.col(tube.triangles(1, k)) +
            expected.col(tube.triangles(2, k))) /
           3.0;
  };
  EXPECT_LT(middle(55).norm(), 0.01 * middle(200).norm());
}

TEST(WallCompliance, LeavesVerticesWithoutTrianglesAlone) {
  const Surface tube = small_tube();
  Surface more = tube;
  more.vertices.conservativeResize(3, tube.vertices.cols() + 1);
  more.vertices.rightCols(tube.vertices.cols()) = tube.vertices;
  more.vertices.col(0) << 100.0, 0.0, 0.0;
  more.triangles.array() += 1;
  const Wall wall = extruded(tube, kThickness);
  const WallCompliance expected(tube, wall), compliance(more, wall);
  const Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Ones(3, more.vertices.cols());
  const Eigen::Matrix3Xd moved = compliance.displacements(force);
  EXPECT_TRUE(moved.col(0).isZero(0.0));
  EXPECT_TRUE(moved.rightCols(tube.vertices.cols())
                  .isApprox(expected.displacements(force.rightCols(tube.vertices.cols())), 1e-12));
  EXPECT_TRUE(compliance.normals().col(0).isZero(0.0));
  EXPECT_THROW(compliance.half_response(0), LogicError);
}

// ---------------------------------------------------------------- locator

/// Distance of a point from a triangle: to its plane where the foot lies within, or else to the
/// nearest of its edges. Another way than the one under test.
double distance_from_triangle(const Vec3& p, const std::array<Vec3, 3>& t) {
  const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  bool within = true;
  double least = std::numeric_limits<double>::infinity();
  for (int c = 0; c < 3; ++c) {
    const Vec3 &a = t[c], edge = t[(c + 1) % 3] - a;
    within = within && normal.dot(edge.cross(p - a)) >= 0.0;
    const double along = std::clamp(edge.dot(p - a) / edge.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (p - a - along * edge).norm());
  }
  return within ? std::abs(normal.dot(p - t[0])) : least;
}

std::array<Vec3, 3> corners(const Surface& surface, Eigen::Index f) {
  return {surface.vertices.col(surface.triangles(0, f)),
          surface.vertices.col(surface.triangles(1, f)),
          surface.vertices.col(surface.triangles(2, f))};
}

TEST(TriangleLocator, FindsWhatBruteForceFinds) {
  std::mt19937_64 random(11);
  const std::array<std::pair<Surface, double>, 3> shapes = {{
      {small_tube(), 1.0},
      {shapes::straight_tube(4.0, 20.0, 0.7), 3.0},          // reach over many cells
      {shapes::box(Vec3::Zero(), Vec3(9.0, 5.0, 7.0)), 1.0}  // triangles larger than the reach
  }};
  int found = 0, missed = 0, unique = 0;
  for (const auto& [surface, reach] : shapes) {
    const TriangleLocator locator(surface, reach);
    const Vec3 low = surface.vertices.rowwise().minCoeff().array() - 1.5 * reach,
               high = surface.vertices.rowwise().maxCoeff().array() + 1.5 * reach;
    for (int k = 0; k < 400; ++k) {
      const Vec3 part = 0.5 * (random_vector(random) + Vec3::Ones());
      const Vec3 p = low + part.cwiseProduct(high - low);
      double least = std::numeric_limits<double>::infinity(), second = least;
      std::int32_t nearest = -1;
      for (Eigen::Index f = 0; f < surface.triangles.cols(); ++f) {
        const double distance = distance_from_triangle(p, corners(surface, f));
        second = std::min(second, std::max(distance, least));
        if (distance >= least) continue;
        least = distance;
        nearest = static_cast<std::int32_t>(f);
      }

      const SurfacePoint point = locator.nearest(p);
      ASSERT_EQ(point.triangle >= 0, least <= reach);
      if (point.triangle < 0) {
        ++missed;
        continue;
      }
      ++found;
      Vec3 foot = Vec3::Zero();
      for (int c = 0; c < 3; ++c) {
        ASSERT_EQ(point.vertex[c], surface.triangles(c, point.triangle));
        foot += point.weight[c] * surface.vertices.col(point.vertex[c]);
      }
      EXPECT_NEAR((p - foot).norm(), least, 1e-12);  // rounding at coordinates of some 10 mm
      EXPECT_GE(point.weight.minCoeff(), 0.0);
      EXPECT_NEAR(point.weight.sum(), 1.0, 1e-15);
      if (second - least < 1e-9) continue;  // on a common edge or corner: either
      EXPECT_EQ(point.triangle, nearest);
      ++unique;
    }
  }
  EXPECT_GT(found, 150);
  EXPECT_GT(missed, 150);
  EXPECT_GT(unique, 80);
}

TEST(TriangleLocator, TakesTheFirstOfTrianglesThatAreEquallyNear) {
  const Surface box = shapes::box(Vec3::Zero(), Vec3(8.0, 8.0, 8.0));
  const TriangleLocator locator(box);
  for (int corner = 0; corner < 8; ++corner) {
    // Straight out of a corner all of its triangles are as near, exactly: by that corner.
    const Vec3 out = box.vertices.col(corner) - Vec3(4.0, 4.0, 4.0);
    const SurfacePoint point = locator.nearest(box.vertices.col(corner) + 0.0625 * out);
    Eigen::Index first = 0;
    while ((box.triangles.col(first).array() != corner).all()) ++first;
    EXPECT_EQ(point.triangle, first);
    EXPECT_EQ(point.weight.maxCoeff(), 1.0);
  }
}

TEST(TriangleLocator, PiercesTheSurfaceOnTheLine) {
  // Lines across a tube, turned by up to 40 degrees from its normal, from points up to 0.3 mm off,
  // off the middle of its triangles.
  const Surface surface = small_tube();
  const TriangleLocator locator(surface);
  std::mt19937_64 random(5);
  int moved = 0;
  for (Eigen::Index f = 0; f < surface.triangles.cols(); f += 3) {
    const auto [a, b, c] = corners(surface, f);
    const Vec3 normal = (b - a).cross(c - a).normalized();
    const Vec3 point = 0.8 * a + 0.1 * b + 0.1 * c + 0.3 * random_vector(random)[0] * normal;
    const Vec3 direction = normal + 0.5 * random_vector(random);
    const SurfacePoint at = locator.pierced(point, direction);
    ASSERT_GE(at.triangle, 0);
    EXPECT_GE(at.weight.minCoeff(), 0.0);
    EXPECT_NEAR(at.weight.sum(), 1.0, 1e-15);
    const Vec3 way = locator.position(at) - point;
    EXPECT_LT(way.cross(direction).norm(), 1e-12);  // rounding at coordinates of some 10 mm
    moved += at.triangle != locator.nearest(point).triangle ? 1 : 0;
  }
  EXPECT_GT(moved, 3);  // walks were needed
}

TEST(TriangleLocator, PiercesWithoutJumpsWhereTheSurfaceFoldsTowardThePoint) {
  // Along a path 0.3 mm before the inner edge of a box, across its bisector: the nearest point
  // jumps by 0.4 mm from one face to the other, the line along the bisector goes on without.
  const Surface box = shapes::box(Vec3::Zero(), Vec3(8.0, 8.0, 8.0));
  const TriangleLocator locator(box);
  const Vec3 inward(1.0, 1.0, 0.0), across(1.0, -1.0, 0.0);
  double largest = 0.0, largest_of_nearest = 0.0;
  constexpr double kStep = 0.01;  // [mm]
  for (int k = -20; k < 20; ++k) {
    const auto path = [&](int i) -> Vec3 {
      return Vec3(0.2, 0.2, 3.0) + (i + 0.3) * kStep * across;
    };
    const auto jump = [&](const auto& find) {
      return (locator.position(find(path(k + 1))) - locator.position(find(path(k)))).norm();
    };
    largest = std::max(largest, jump([&](const Vec3& p) { return locator.pierced(p, inward); }));
    largest_of_nearest =
        std::max(largest_of_nearest, jump([&](const Vec3& p) { return locator.nearest(p); }));
  }
  EXPECT_LT(largest, 2.0 * kStep * across.norm());  // the faces are at 45 degrees to the path
  EXPECT_GT(largest_of_nearest, 0.25);
}

TEST(TriangleLocator, PiercesAtTheNearestPointWhereTheLineRunsAlongTheSurface) {
  const Surface box = shapes::box(Vec3::Zero(), Vec3(8.0, 8.0, 8.0));
  const TriangleLocator locator(box);
  const Vec3 point(3.0, 4.0, 0.25);
  const SurfacePoint at = locator.pierced(point, Vec3::UnitX());
  EXPECT_EQ(at.triangle, locator.nearest(point).triangle);
  EXPECT_EQ(locator.position(at), Vec3(3.0, 4.0, 0.0));
  EXPECT_EQ(locator.weight_slopes(at, Vec3::UnitX()), Mat3::Zero());
  EXPECT_EQ(locator.pierced(Vec3(4.0, 4.0, 4.0), Vec3::UnitX()).triangle, -1);
  EXPECT_EQ(locator.weight_slopes(SurfacePoint{}, Vec3::UnitX()), Mat3::Zero());
}

TEST(TriangleLocator, PiercesTheSheetWhereItIsToldToStart) {
  // Between two sheets 0.4 mm apart the line along x goes through both.
  const TriangleLocator locator(shapes::box(Vec3::Zero(), Vec3(0.4, 8.0, 8.0)));
  const Vec3 point(0.15, 4.0, 3.0);
  const SurfacePoint near = locator.pierced(point, Vec3::UnitX());
  const SurfacePoint far = locator.nearest(Vec3(0.4, 5.0, 4.0));
  EXPECT_LT((locator.position(near) - Vec3(0.0, 4.0, 3.0)).norm(), 1e-12);
  const SurfacePoint kept = locator.pierced(point, Vec3::UnitX(), far.triangle);
  EXPECT_LT((locator.position(kept) - Vec3(0.4, 4.0, 3.0)).norm(), 1e-12);
  // Not if that is more than half a millimetre away.
  const SurfacePoint left =
      locator.pierced(point - 0.3 * Vec3::UnitX(), Vec3::UnitX(), far.triangle);
  EXPECT_LT((locator.position(left) - Vec3(0.0, 4.0, 3.0)).norm(), 1e-12);
}

TEST(TriangleLocator, WeightsChangeAsTheirSlopesSay) {
  const Surface surface = small_tube();
  const TriangleLocator locator(surface);
  constexpr double kStep = 1e-5;  // [mm]
  for (Eigen::Index f = 0; f < surface.triangles.cols(); f += 7) {
    const auto [a, b, c] = corners(surface, f);
    const Vec3 foot = 0.2 * a + 0.5 * b + 0.3 * c;
    const Vec3 direction = (b - a).cross(c - a).normalized() + 0.2 * (c - b).normalized();
    const SurfacePoint at = locator.pierced(foot, direction);
    ASSERT_EQ(at.triangle, f);
    const Mat3 slopes = locator.weight_slopes(at, direction);
    for (int d = 0; d < 3; ++d) {
      const Vec3 change = (locator.pierced(foot + kStep * Vec3::Unit(d), direction).weight -
                           locator.pierced(foot - kStep * Vec3::Unit(d), direction).weight) /
                          (2.0 * kStep);
      EXPECT_LT((slopes.col(d) - change).norm(), 1e-8);
    }
    EXPECT_LT((slopes * direction).norm(), 1e-12);
  }
}

TEST(TriangleLocator, FindsNothingOutOfReach) {
  const Surface box = shapes::box(Vec3::Zero(), Vec3(8.0, 8.0, 8.0));
  const TriangleLocator locator(box, 0.5);
  EXPECT_EQ(locator.nearest(Vec3(4.0, 4.0, 4.0)).triangle, -1);
  EXPECT_EQ(locator.nearest(Vec3(3.0, 4.0, 8.51)).triangle, -1);
  EXPECT_GE(locator.nearest(Vec3(3.0, 4.0, 8.49)).triangle, 0);
  EXPECT_EQ(locator.nearest(Vec3(1e9, -1e9, 0.0)).triangle, -1);
  EXPECT_EQ(locator.nearest(Vec3::Constant(std::nan(""))).triangle, -1);
}

}  // namespace
}  // namespace wireplan::simulate
