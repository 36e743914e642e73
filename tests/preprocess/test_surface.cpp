#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "preprocess/files/vessel_io.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_repair.h"
#include "tests/messages.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

// ---- Checks -----------------------------------------------------------------------------------

TEST(SurfaceCheck, MeasuresAUnitCubeExactly) {
  const SurfaceCheck check = check_surface(shapes::box({1, 2, 3}, {2, 3, 4}));
  EXPECT_TRUE(is_sound(check));
  EXPECT_EQ(check.vertices, 8);
  EXPECT_EQ(check.triangles, 12);
  EXPECT_EQ(check.pieces, 1);
  EXPECT_EQ(check.euler_number, 2);
  EXPECT_NEAR(check.volume_mm3, 1.0, 1e-14);
  EXPECT_NEAR(check.area_mm2, 6.0, 1e-14);
  EXPECT_NEAR(check.min_angle_deg, 45.0, 1e-12);
  EXPECT_NEAR(check.max_edge_mm, std::sqrt(2.0), 1e-14);
}

TEST(SurfaceCheck, SphereApproachesItsVolumeAndAreaQuadratically) {
  const double radius = 5.0, volume = 4.0 / 3.0 * kPi * 125.0, area = 4.0 * kPi * 25.0;
  double last_volume_error = 0.0, last_area_error = 0.0;
  for (const double edge : {1.0, 0.5, 0.25}) {
    SCOPED_TRACE(edge);
    const SurfaceCheck check = check_surface(shapes::sphere({10, -20, 30}, radius, edge));
    EXPECT_TRUE(is_sound(check));
    const double volume_error = volume - check.volume_mm3, area_error = area - check.area_mm2;
    EXPECT_GT(volume_error, 0.0);  // an inscribed polyhedron
    if (last_volume_error > 0.0) {
      // A quarter per halving; the rounding of counts per circle moves it by some per cent.
      EXPECT_NEAR(last_volume_error / volume_error, 4.0, 0.4);
      EXPECT_NEAR(last_area_error / area_error, 4.0, 0.4);
    }
    last_volume_error = volume_error;
    last_area_error = area_error;
  }
}

TEST(SurfaceCheck, TubesOfTheTestsAreSoundAndHaveTheirPrismVolume) {
  const int sides = static_cast<int>(std::ceil(2.0 * kPi * 3.0 / 0.8));
  const double polygon = 0.5 * sides * 9.0 * std::sin(2.0 * kPi / sides);
  const SurfaceCheck straight = check_surface(shapes::straight_tube(3.0, 20.0, 0.8));
  EXPECT_TRUE(is_sound(straight));
  EXPECT_EQ(straight.euler_number, 2);
  // Rings turned by half a step against each other make an antiprism, a little less than the prism.
  EXPECT_NEAR(straight.volume_mm3, 20.0 * polygon, 0.005 * 20.0 * polygon);
  EXPECT_TRUE(is_sound(check_surface(shapes::bend_tube(3.0, 12.0, kPi, 10.0, 5.0, 0.8))));
  EXPECT_TRUE(is_sound(check_surface(shapes::bend_tube(0.4, 12.0, kPi / 3, 10.0, 0.0, 0.5))));
}

TEST(SurfaceCheck, FindsAHole) {
  Surface open = shapes::sphere({0, 0, 0}, 3.0, 1.0);
  open.triangles.conservativeResize(3, open.triangles.cols() - 1);
  const SurfaceCheck check = check_surface(open);
  EXPECT_EQ(check.open_edges, 3);
  EXPECT_EQ(check.self_intersections, 0);
  EXPECT_FALSE(is_sound(check));
  const std::string message = message_of([&] { require_sound(check, "aorta.stl"); });
  EXPECT_NE(message.find("aorta.stl: the surface is not sound: 3 open edges (close the holes"),
            std::string::npos)
      << message;
}

TEST(SurfaceCheck, FindsATriangleTurnedRound) {
  Surface surface = shapes::sphere({0, 0, 0}, 3.0, 1.0);
  std::swap(surface.triangles(0, 40), surface.triangles(1, 40));
  EXPECT_EQ(check_surface(surface).misoriented_edges, 3);
  EXPECT_FALSE(is_sound(check_surface(surface)));
}

TEST(SurfaceCheck, FindsNormalsThatPointInward) {
  const SurfaceCheck check = check_surface(shapes::inside_out(shapes::sphere({0, 0, 0}, 3.0, 1.0)));
  EXPECT_FALSE(check.outward);
  EXPECT_LT(check.volume_mm3, 0.0);
  EXPECT_NE(message_of([&] { require_sound(check, "x"); }).find("normals point inward"),
            std::string::npos);
}

TEST(SurfaceCheck, FindsAnEdgeOfThreeTriangles) {
  Surface surface = shapes::box({0, 0, 0}, {1, 1, 1});
  surface.triangles.conservativeResize(3, 13);
  surface.triangles.col(12) << 1, 2, 5;  // a wall inside, on the diagonal of the bottom
  EXPECT_GE(check_surface(surface).non_manifold_edges, 1);
  EXPECT_FALSE(is_sound(check_surface(surface)));
}

TEST(SurfaceCheck, FindsTwoPiecesAndTwoThatTouchInAVertex) {
  const Surface a = shapes::box({0, 0, 0}, {1, 1, 1}), b = shapes::box({1, 1, 1}, {2, 2, 2});
  Surface both = shapes::joined(a, b);
  EXPECT_EQ(check_surface(both).pieces, 2);
  for (int& vertex : both.triangles.reshaped()) {
    if (vertex == 8) vertex = 7;  // the first of b is the last of a
  }
  const SurfaceCheck check = check_surface(both);
  EXPECT_EQ(check.vertices, 15);
  EXPECT_EQ(check.non_manifold_vertices, 1);
  EXPECT_FALSE(is_sound(check));
}

TEST(SurfaceCheck, FindsWallsThatCutEachOther) {
  // Two walls cross where a tube bends by a full turn and more in one plane.
  const Surface looped = shapes::bend_tube(1.0, 6.0, 2.0 * kPi, 4.0, 4.0, 0.6);
  std::vector<int> cutting;
  const SurfaceCheck check = check_surface(looped, cutting);
  EXPECT_EQ(check.open_edges, 0);
  EXPECT_GT(check.self_intersections, 0);
  EXPECT_GT(cutting.size(), 1U);
  EXPECT_EQ(cutting, find_self_intersections(looped));
  EXPECT_FALSE(is_sound(check));
  EXPECT_NE(message_of([&] { require_sound(check, "x"); }).find("cut each other"),
            std::string::npos);
  check_surface(shapes::box({0, 0, 0}, {1, 1, 1}), cutting);
  EXPECT_TRUE(cutting.empty());
}

TEST(SurfaceCheck, FindsATriangleWithoutArea) {
  // Split an edge of the box by a point on it on one side alone, and fill the gap by a flat one.
  Surface surface = shapes::box({0, 0, 0}, {1, 1, 1});
  surface.vertices.conservativeResize(3, 9);
  surface.vertices.col(8) << 0.5, 0.0, 0.0;
  const Eigen::Vector3i split = surface.triangles.col(4);  // 0, 1, 4
  ASSERT_EQ(split, Eigen::Vector3i(0, 1, 4));
  surface.triangles.conservativeResize(3, 14);
  surface.triangles.col(4) << 0, 8, 4;
  surface.triangles.col(12) << 8, 1, 4;
  surface.triangles.col(13) << 0, 1, 8;
  const SurfaceCheck check = check_surface(surface);
  EXPECT_EQ(check.open_edges, 0);
  EXPECT_EQ(check.degenerate_triangles, 1);
  EXPECT_FALSE(is_sound(check));
}

TEST(SurfaceCheck, CountsAHandleWithoutRefusingIt) {
  // A ring: the tube's caps removed, first and last circle joined.
  Surface ring = shapes::bend_tube(1.0, 6.0, 1.9 * kPi, 0.0, 0.0, 0.6);
  ASSERT_TRUE(is_sound(check_surface(ring)));
  const int sides = static_cast<int>(std::ceil(2.0 * kPi / 0.6));
  // Circles other than caps' are the middle of the vertices: 1 + cap + rows * sides + cap + 1.
  const int rows =
      static_cast<int>(shapes::bend_axis(6.0, 1.9 * kPi, 0.0, 0.0, 0.6 * std::sqrt(0.75)).cols());
  const int first = static_cast<int>(ring.vertices.cols() - rows * sides) / 2;
  const int last = first + (rows - 1) * sides;
  const auto kept = [&](const auto& t) {
    return t.minCoeff() >= first && t.maxCoeff() < last + sides && t.minCoeff() < last;
  };
  std::vector<Eigen::Vector3i> wall;
  for (const auto& t : ring.triangles.colwise()) {
    if (kept(t) && (t.maxCoeff() >= first + sides)) wall.push_back(t);
  }
  for (int k = 0; k < sides; ++k) {
    const int next = (k + 1) % sides;
    wall.emplace_back(last + k, last + next, first + k);
    wall.emplace_back(last + next, first + next, first + k);
  }
  ring.triangles.resize(3, static_cast<Eigen::Index>(wall.size()));
  for (std::size_t k = 0; k < wall.size(); ++k) ring.triangles.col(Eigen::Index(k)) = wall[k];
  const SurfaceCheck check = check_surface(ring);
  EXPECT_EQ(check.open_edges, 0);
  EXPECT_EQ(check.euler_number, 0);
  EXPECT_TRUE(is_sound(check));
}

TEST(LargestPiece, IsTheOneOfTheLargestVolumeTurnedOutward) {
  const Surface small = shapes::sphere({20, 0, 0}, 2.0, 0.3);  // more triangles, less volume
  const Surface large = shapes::inside_out(shapes::box({0, 0, 0}, {5, 5, 5}));
  const Surface kept = largest_piece(shapes::joined(small, large));
  EXPECT_EQ(kept.vertices.cols(), 8);
  EXPECT_NEAR(signed_volume(kept), 125.0, 1e-12);
}

TEST(LocatePoint, AgreesWithTheAnalyticBox) {
  const Vec3 low(-1, -2, -3), high(2, 3, 4);
  const Surface box = shapes::box(low, high);
  std::mt19937_64 random(7);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  int inside = 0;
  for (int k = 0; k < 500; ++k) {
    const Vec3 p(-4 + 9 * uniform(), -5 + 11 * uniform(), -6 + 13 * uniform());
    const Vec3 beyond = (low - p).cwiseMax(p - high);
    const bool is_inside = beyond.maxCoeff() < 0.0;
    const double distance = is_inside ? -beyond.maxCoeff() : beyond.cwiseMax(0.0).norm();
    const InsideAnswer answer = locate_point(box, p);
    EXPECT_EQ(answer.inside, is_inside);
    EXPECT_NEAR(answer.distance, distance, 1e-12);
    inside += is_inside ? 1 : 0;
  }
  EXPECT_GT(inside, 20);  // both kinds were met
  EXPECT_LT(inside, 480);
}

// ---- Remeshing --------------------------------------------------------------------------------

TEST(Remesh, GivesTheEdgeLengthAndKeepsTheShape) {
  const Surface tube = shapes::straight_tube(3.0, 20.0, 0.8);
  const double volume = signed_volume(tube);
  for (const double edge : {0.5, 1.2}) {
    SCOPED_TRACE(edge);
    const SurfaceCheck check = check_surface(remesh(tube, edge));
    EXPECT_TRUE(is_sound(check));
    EXPECT_EQ(check.euler_number, 2);
    EXPECT_NEAR(check.mean_edge_mm, edge, 0.25 * edge);  // 4/5 to 4/3 of it are left as they are
    EXPECT_LT(check.max_edge_mm, 2.0 * edge);
    EXPECT_GT(check.min_angle_deg, 10.0);
    // Chords of 1.2 mm cut off edge^2 / (6 r^2) = 2.7 % of the circle.
    EXPECT_NEAR(check.volume_mm3, volume, 0.03 * volume);
  }
}

TEST(Remesh, CutsUpACoarseSurface) {
  const SurfaceCheck check = check_surface(remesh(shapes::box({0, 0, 0}, {10, 10, 30}), 2.0));
  EXPECT_TRUE(is_sound(check));
  EXPECT_LT(check.max_edge_mm, 4.0);
  EXPECT_NEAR(check.volume_mm3, 3000.0, 1e-6);  // creases are kept, so the box stays one
}

TEST(Remesh, LeavesASurfaceThatHasTheEdgeLengthAsItIs) {
  const Surface tube = shapes::straight_tube(3.0, 20.0, 0.8);
  const Surface same = remesh(tube, 0.8);
  EXPECT_EQ(same.vertices, tube.vertices);
  EXPECT_EQ(same.triangles, tube.triangles);
}

TEST(Remesh, GivesTheSameBitsAgain) {
  const Surface tube = shapes::bend_tube(2.0, 10.0, kPi / 2, 5.0, 5.0, 1.0);
  const Surface a = remesh(tube, 0.7), b = remesh(tube, 0.7);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(Remesh, RefusesAnUnsoundSurfaceAndAnAbsurdEdgeLength) {
  Surface open = shapes::sphere({0, 0, 0}, 3.0, 1.0);
  open.triangles.conservativeResize(3, open.triangles.cols() - 1);
  EXPECT_NE(message_of([&] { remesh(open, 0.5); }).find("3 open edges"), std::string::npos);
  const Surface sphere = shapes::sphere({0, 0, 0}, 50.0, 10.0);
  EXPECT_NE(message_of([&] { remesh(sphere, 0.01); }).find("more than 3e+06 triangles"),
            std::string::npos);
}

TEST(Remesh, TriesAgainWithShorterEdgesWhereSheetsCutEachOther) {
  // A slab of 0.02 mm in waves. Its sheets are remeshed apart: where waves are high, chords as long
  // as a quarter of its edges cut through the other sheet.
  const auto waves = [](double height) {
    Surface slab = shapes::divided_box({0, 0, 0}, {4, 4, 0.02}, 7);
    for (auto v : slab.vertices.colwise()) v.z() += height * std::sin(2.0 * kPi * v.x() / 3.0);
    return check_surface(remesh(slab, 1.5));
  };
  const SurfaceCheck low = waves(0.1), high = waves(0.4);
  for (const SurfaceCheck* check : {&low, &high}) {
    EXPECT_TRUE(is_sound(*check));
    EXPECT_EQ(check->euler_number, 2);
    EXPECT_NEAR(check->volume_mm3, 0.32, 0.01);
  }
  EXPECT_LT(high.mean_edge_mm, 0.7 * low.mean_edge_mm) << "half as long at the second try";
}

TEST(Remesh, IsFinerWhereTheVesselIsThinAndKeepsItsCaps) {
  Eigen::Matrix3Xd axis = Eigen::Matrix3Xd::Zero(3, 241);
  axis.row(2) = Eigen::RowVectorXd::LinSpaced(241, 0.0, 60.0);
  Eigen::VectorXd radius(241);
  for (int k = 0; k < 241; ++k) radius(k) = k < 120 ? 6.0 : std::max(0.8, 6.0 - 0.13 * (k - 120));
  const Surface cone = shapes::tube(axis, radius, 40);
  int before = 1 << 30;
  for (const double edge : {1.0, 1.5, 2.0, 3.0, 4.0, 6.0}) {
    SCOPED_TRACE(edge);
    const Surface fine = remesh(cone, edge);
    const SurfaceCheck check = check_surface(fine);
    EXPECT_TRUE(is_sound(check));
    EXPECT_LE(check.triangles, 1.02 * before);  // longer edges: not more triangles, but for chance
    before = check.triangles;
    // The thin end keeps its size: 0.8 mm wide, and its flat cap where it was.
    EXPECT_NEAR(fine.vertices.row(2).maxCoeff(), 60.0, 0.05);
    double widest = 0.0, longest = 0.0;
    for (const auto& t : fine.triangles.colwise()) {
      for (int k = 0; k < 3; ++k) {
        const Vec3 a = fine.vertices.col(t(k)), b = fine.vertices.col(t((k + 1) % 3));
        if (a.z() < 50.0 || b.z() < 50.0) continue;
        widest = std::max(widest, a.head<2>().norm());
        longest = std::max(longest, (a - b).norm());
      }
    }
    EXPECT_NEAR(widest, 0.8, 0.08);
    EXPECT_LT(longest, 1.0);
  }
}

// ---- Real surfaces ----------------------------------------------------------------------------

/// Path of a real surface, or an empty one where the data is not there.
fs::path real_data(const std::string& name) {
  const char* variable = std::getenv("WIREPLAN_DATA");
  const fs::path folder =
      variable ? fs::path(variable) : fs::path(WIREPLAN_SOURCE_DIR) / "../shared/data";
  return fs::exists(folder / name) ? folder / name : fs::path();
}

TEST(RealSurface, ArchIsTurnedOutwardAndStaysSoundWhenRemeshed) {
  const fs::path path = real_data("surface-arch-to-cerebral/vessel_architecture_collision.obj");
  if (path.empty()) GTEST_SKIP() << "real data is absent; set WIREPLAN_DATA";
  const Surface arch = read_surface(path, "mm", "LPS").surface;
  const SurfaceCheck before = check_surface(arch);
  EXPECT_TRUE(is_sound(before));
  EXPECT_EQ(before.triangles, 3584);  // as its README counts, and the volume too
  EXPECT_NEAR(before.volume_mm3, 317000.0, 500.0);
  const SurfaceCheck after = check_surface(remesh(arch, 3.0));
  EXPECT_TRUE(is_sound(after));
  EXPECT_NEAR(after.volume_mm3, before.volume_mm3, 0.01 * before.volume_mm3);
}

TEST(RealSurface, CoronaryStaysSoundWhenRemeshed) {
  const fs::path path = real_data("surface-coronary-left/m1_fluid.stl");
  if (path.empty()) GTEST_SKIP() << "real data is absent; set WIREPLAN_DATA";
  const Surface coronary = read_surface(path, "mm", "LPS").surface;
  const SurfaceCheck before = check_surface(coronary);
  EXPECT_TRUE(is_sound(before));
  EXPECT_EQ(before.vertices, 7170);
  EXPECT_NEAR(before.volume_mm3, 1530.0, 1.0);
  const SurfaceCheck after = check_surface(remesh(coronary, 0.5));
  EXPECT_TRUE(is_sound(after));
  EXPECT_NEAR(after.volume_mm3, before.volume_mm3, 0.02 * before.volume_mm3);
}

}  // namespace
}  // namespace wireplan::preprocess
