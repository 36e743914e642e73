#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <utility>

#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_fit.h"
#include "preprocess/volume/phantom.h"
#include "tests/messages.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

// ---- From a mask ------------------------------------------------------------------------------

/// Voxels whose centre is nearer than `radius` to the axis from `a` to `b`; flat ends.
Mask tube_mask(const Grid& grid, const Vec3& a, const Vec3& b, double radius) {
  Mask mask{.grid = grid, .labels = std::vector<std::uint8_t>(grid.voxels(), 0)};
  const double length = (b - a).norm();
  const Vec3 along = (b - a) / length;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const Vec3 p = grid.lps_from_ijk(Vec3(i, j, k)) - a;
        const double s = p.dot(along);
        if (s < 0.0 || s > length || (p - s * along).norm() > radius) continue;
        mask.labels[grid.index(i, j, k)] = 1;
      }
    }
  }
  return mask;
}

/// An oblique, left-handed grid.
Grid oblique_grid() {
  Grid grid;
  grid.size = {40, 40, 60};
  grid.spacing = {0.7, 0.7, 0.7};
  grid.origin = {-30, 55, 12};
  grid.direction = Eigen::AngleAxisd(0.6, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  grid.direction.col(2) *= -1.0;
  return grid;
}

TEST(SurfaceFromMask, LiesWithinATenthOfAMillimetreOfTheTubeOnAnObliqueLeftHandedGrid) {
  const Grid grid = oblique_grid();
  ASSERT_LT(grid.direction.determinant(), 0.0);
  const Vec3 a = grid.lps_from_ijk({17, 18, 6}), b = grid.lps_from_ijk({23, 22, 53});
  const Vec3 along = (b - a).normalized();
  for (const double radius : {2.0, 8.0}) {
    SCOPED_TRACE(radius);
    const Surface surface =
        surface_from_mask(tube_mask(grid, a, b, radius), {.edge_length_mm = 1.0});
    const SurfaceCheck check = check_surface(surface);
    EXPECT_TRUE(is_sound(check));
    EXPECT_EQ(check.euler_number, 2);
    double signed_sum = 0.0, sum = 0.0;
    int count = 0;
    for (const auto& vertex : surface.vertices.colwise()) {
      const Vec3 p = vertex - a;
      const double s = p.dot(along);
      if (s < 4.0 || s > (b - a).norm() - 4.0) continue;  // away from the rounded ends
      const double error = (p - s * along).norm() - radius;
      signed_sum += error;
      sum += std::abs(error);
      ++count;
    }
    ASSERT_GT(count, 300);
    EXPECT_LT(sum / count, 0.1);                    // a seventh of a voxel
    EXPECT_LT(std::abs(signed_sum / count), 0.05);  // smoothing does not shrink it
  }
}

TEST(SurfaceFromMask, CapsAVesselCutByTheBorderOfTheVolume) {
  Grid grid;
  grid.size = {20, 20, 30};
  const Mask mask = tube_mask(grid, {9.5, 9.5, -10}, {9.5, 9.5, 50}, 5.0);
  const Surface surface = surface_from_mask(mask, {.edge_length_mm = 1.0});
  EXPECT_TRUE(is_sound(check_surface(surface)));
  // Border voxels are taken as far as half their size beyond their centre; smoothing may round it.
  EXPECT_NEAR(surface.vertices.row(2).minCoeff(), -0.5, 0.3);
  EXPECT_NEAR(surface.vertices.row(2).maxCoeff(), 29.5, 0.3);
}

TEST(SurfaceFromMask, KeepsTheLargestPieceAndFillsCavities) {
  Grid grid;
  grid.size = {30, 20, 20};
  Mask mask = tube_mask(grid, {9, 9, 3}, {9, 9, 16}, 5.0);
  mask.labels[grid.index(9, 9, 9)] = 0;
  mask.labels[grid.index(25, 9, 9)] = 1;
  const Surface surface = surface_from_mask(mask, {.edge_length_mm = 1.0});
  const SurfaceCheck check = check_surface(surface);
  EXPECT_EQ(check.pieces, 1);
  EXPECT_EQ(check.euler_number, 2);
  EXPECT_TRUE(locate_point(surface, {9, 9, 9}).inside);
  EXPECT_FALSE(locate_point(surface, {25, 9, 9}).inside);
}

TEST(SurfaceFromMask, IsSoundWhereVoxelsTouchByEdgesAndCornersAlone) {
  // Random voxels at half filling hold every case of touching cubes.
  std::mt19937_64 random(5);
  Mask mask;
  mask.grid.size = {8, 8, 8};
  for (std::size_t k = 0; k < mask.grid.voxels(); ++k) {
    mask.labels.push_back(static_cast<std::uint8_t>(random() >> 63));
  }
  const SurfaceCheck check = check_surface(surface_from_mask(mask, {.edge_length_mm = 0.7}));
  EXPECT_TRUE(is_sound(check));
  EXPECT_LT(check.euler_number, 2);  // handles are counted, not refused
}

TEST(SurfaceFromMask, RefusesAnEmptyMask) {
  Mask mask;
  mask.grid.size = {3, 3, 3};
  mask.labels.assign(27, 0);
  EXPECT_NE(message_of([&] { surface_from_mask(mask, {}); }).find("the mask is empty"),
            std::string::npos);
}

// ---- From the image -----------------------------------------------------------------------------

/// Share of a disc that a point spread of width `blur` sees at distance r from its middle: its
/// chords, each with the blur along it, weighted with the blur across them.
double blurred_disc(double r, double radius, double blur) {
  constexpr int kChords = 64;
  const double reach = std::min(radius, 5.0 * blur), step = 2.0 * reach / kChords;
  const auto below = [&](double x) { return 0.5 * std::erfc(-x / (blur * std::sqrt(2.0))); };
  double sum = 0.0;
  for (int k = 0; k < kChords; ++k) {
    const double y = -reach + (k + 0.5) * step, half = std::sqrt(radius * radius - y * y);
    const double weight = std::exp(-0.5 * y * y / (blur * blur)) / (blur * std::sqrt(2.0 * M_PI));
    sum += step * weight * (below(half - r) - below(-half - r));
  }
  return sum;
}

/// Grey values of a straight tube along z of 350 HU, its wall of 45 HU 1.2 mm thick, fat (-100 HU)
/// on the side of negative x and 2.4 mm off bone (700 HU) on the other, blurred.
Image grey_tube(const Grid& grid, const Vec3& axis, double radius) {
  constexpr double kWall = 1.2, kBlur = 0.55;  // mm
  Image image{.grid = grid, .values = {}};
  for (int j = 0; j < grid.size[1]; ++j) {
    for (int i = 0; i < grid.size[0]; ++i) {
      const Vec3 p = grid.lps_from_ijk(Vec3(i, j, 0)) - axis;
      const auto within = [&](double r) { return blurred_disc(p.head<2>().norm(), r, kBlur); };
      const double outer = p.x() < 0.0 ? -145.0 * (1.0 - within(radius + kWall))
                                       : 655.0 * (1.0 - within(radius + 2.0 * kWall));
      image.values.push_back(static_cast<float>(45.0 + 305.0 * within(radius) + outer));
    }
  }
  const std::vector<float> slice = image.values;
  for (int k = 1; k < grid.size[2]; ++k) {
    image.values.insert(image.values.end(), slice.begin(), slice.end());
  }
  return image;
}

TEST(SurfaceFromImage, LiesOnTheEdgeOfTheLumenWhateverTheMasksThresholdWas) {
  Grid grid;
  grid.size = {36, 36, 40};
  grid.spacing = {0.7, 0.7, 0.7};
  const Vec3 axis = grid.lps_from_ijk({17.3, 17.6, 0.0});
  for (const double radius : {2.0, 5.0}) {
    const Image image = grey_tube(grid, axis, radius);
    for (const double off : {-0.35, 0.0, 0.35}) {  // of the mask from the edge: half a voxel
      SCOPED_TRACE("radius " + std::to_string(radius) + ", mask off by " + std::to_string(off));
      const Mask mask =
          tube_mask(grid, axis - 10.0 * Vec3::UnitZ(), axis + 50.0 * Vec3::UnitZ(), radius + off);
      FitStatistics fit;
      const Surface surface = surface_from_image(image, mask, {.edge_length_mm = 1.0}, &fit);
      const SurfaceCheck check = check_surface(surface);
      EXPECT_TRUE(is_sound(check));
      EXPECT_EQ(check.euler_number, 2);
      std::vector<double> errors;
      for (const auto& vertex : surface.vertices.colwise()) {
        if (vertex.z() < 3.0 || vertex.z() > 24.0) continue;  // the caps
        errors.push_back(std::abs((Vec3(vertex) - axis).head<2>().norm() - radius));
      }
      ASSERT_GT(errors.size(), 200U);
      std::sort(errors.begin(), errors.end());
      // Without taking the blur and the fat behind the wall into account 0.07 to 0.17 and 0.16 to
      // 0.25: blur draws the edge of a vessel of 2 mm in by 0.08.
      EXPECT_LT(std::accumulate(errors.begin(), errors.end(), 0.0) / double(errors.size()), 0.08);
      EXPECT_LT(errors[errors.size() * 95 / 100], 0.18);
      EXPECT_GT(fit.fitted_fraction, 0.7);
      EXPECT_NEAR(fit.lumen_value, 350.0, 15.0);
    }
  }
}

constexpr double kDrawnRadius = 5.0;

/// The surface of a tube of that radius by a mask that somebody drew wider or narrower: the radius
/// of its vertices, and by how much they differ [mm].
struct DrawnTube {
  FitStatistics fit;
  double mean = 0.0, deviation = 0.0;
};

DrawnTube fit_to_mask(double off) {
  Grid grid;
  grid.size = {36, 36, 40};
  grid.spacing = {0.7, 0.7, 0.7};
  const Vec3 axis = grid.lps_from_ijk({17.3, 17.6, 0.0});
  const Image image = grey_tube(grid, axis, kDrawnRadius);
  const Mask mask =
      tube_mask(grid, axis - 10.0 * Vec3::UnitZ(), axis + 50.0 * Vec3::UnitZ(), kDrawnRadius + off);
  DrawnTube tube;
  const Surface surface =
      surface_from_image(image, mask, {.edge_length_mm = 1.0}, &tube.fit, FitWidth::kOfMask);
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (const auto& vertex : surface.vertices.colwise()) {
    if (vertex.z() < 3.0 || vertex.z() > 24.0) continue;  // the caps
    const double radius = (Vec3(vertex) - axis).head<2>().norm();
    sum += radius;
    squares += radius * radius;
    count += 1.0;
  }
  tube.mean = sum / count;
  tube.deviation = std::sqrt(squares / count - tube.mean * tube.mean);
  return tube;
}

TEST(SurfaceFromImage, IsAsWideAsAMaskThatSomebodyDrew) {
  for (const double off : {-0.25, 0.0, 0.25}) {
    SCOPED_TRACE("mask off by " + std::to_string(off));
    const DrawnTube tube = fit_to_mask(off);
    EXPECT_NEAR(tube.mean, kDrawnRadius + off, 0.08);
    EXPECT_LT(tube.deviation, 0.12);  // the mask's own stairs: 0.2
    EXPECT_NEAR(tube.fit.beyond_half_mm, off, 0.08);
    EXPECT_FALSE(tube.fit.wide_as_image);
  }
}

TEST(SurfaceFromImage, IsAsWideAsTheImageWhereAMaskIsFarOff) {
  // More than half a voxel: nobody means that. Up to one and a half of them.
  for (const double off : {-1.0, -0.6, 0.6, 1.0}) {
    SCOPED_TRACE("mask off by " + std::to_string(off));
    const DrawnTube tube = fit_to_mask(off);
    EXPECT_NEAR(tube.mean, kDrawnRadius, 0.08);
    EXPECT_TRUE(tube.fit.wide_as_image);
    EXPECT_NEAR(tube.fit.beyond_half_mm, off, 0.12);
  }
}

TEST(SurfaceFromImage, MovesAndMirrorsWithItsGrid) {
  Grid grid;
  grid.size = {24, 24, 20};
  grid.spacing = {0.8, 0.8, 0.8};
  const Vec3 axis = grid.lps_from_ijk({11.3, 11.6, 0.0});
  Image image = grey_tube(grid, axis, 3.0);
  Mask mask = tube_mask(grid, axis - 10.0 * Vec3::UnitZ(), axis + 50.0 * Vec3::UnitZ(), 3.0);
  // Fine: how the remesh cuts corners depends on the order of their triangles, which a mirror
  // turns, and a little the walls that are seen, by averages over neighbours.
  const SurfaceOptions options{.edge_length_mm = 0.5};
  const Surface here = surface_from_image(image, mask, options);
  const Grid turned = oblique_grid();
  image.grid.origin = mask.grid.origin = turned.origin;
  image.grid.direction = mask.grid.direction = turned.direction;
  const Surface there = surface_from_image(image, mask, options);
  EXPECT_TRUE(is_sound(check_surface(there)));
  EXPECT_NEAR(signed_volume(there), signed_volume(here), 3e-3 * signed_volume(here));
}

TEST(SurfaceFromImage, HoldsATubesRadiusAtVoxelsFinerThanTheBlur) {
  // Samples a voxel or two away from the edge still lie in it: the tube was 0.18 mm thin.
  constexpr double kVoxel = 0.4, kRadius = 2.0, kLength = 24.0;
  PhantomSpec spec;
  spec.grid.size = {36, 36, 60};
  spec.grid.spacing = Vec3::Constant(kVoxel);
  spec.grid.origin = Vec3(-7.0, -7.0, -0.5 * kLength);
  spec.body_semi_axes = {150.0, 100.0, 1000.0};
  spec.blur_mm = 0.5;
  PhantomTube tube{.name = "tube", .hu = 350.0, .wall_mm = 0.8, .points = {}, .radius = {}};
  tube.points.resize(3, 2);
  tube.points << -1.0, 1.0, -0.5, 0.5, -kLength, kLength;
  tube.radius = Eigen::Vector2d::Constant(kRadius);
  spec.tubes = {tube};
  const Phantom phantom = make_phantom(spec);
  const Surface surface = surface_from_image(phantom.image, phantom.lumen, {.edge_length_mm = 1.0});

  const Vec3 start = tube.points.col(0), along = (Vec3(tube.points.col(1)) - start).normalized();
  double sum = 0.0;
  int count = 0;
  for (const auto& vertex : surface.vertices.colwise()) {
    if (std::abs(vertex.z()) > 0.5 * kLength - 3.0) continue;
    const Vec3 offset = Vec3(vertex) - start;
    sum += (offset - offset.dot(along) * along).norm() - kRadius;
    ++count;
  }
  ASSERT_GT(count, 100);
  EXPECT_NEAR(sum / count, 0.0, 0.08);
}

/// Along that unit vector through the origin.
PhantomTube straight_tube(const Vec3& along, double hu, double radius, double wall) {
  PhantomTube tube{.name = "tube", .hu = hu, .wall_mm = wall, .points = {}, .radius = {}};
  tube.points.resize(3, 2);
  tube.points << -100.0 * along, 100.0 * along;
  tube.radius = Eigen::Vector2d::Constant(radius);
  return tube;
}

/// Of a straight tube of 300 HU along that unit vector through the origin, with a wall of soft
/// tissue in fat, with 5 HU of noise.
Surface surface_of_tube(const Grid& grid, const Vec3& along, double radius, double wall = 1.0) {
  PhantomSpec spec;
  spec.grid = grid;
  spec.body_semi_axes = {90.0, 90.0, 1.0};
  spec.fat_mm = 85.0;
  spec.skin_mm = 1.0;
  spec.noise_hu = 5.0;
  spec.tubes = {straight_tube(along, 300.0, radius, wall)};
  const Phantom phantom = make_phantom(spec);
  return surface_from_image(phantom.image, phantom.lumen, {.edge_length_mm = 1.0});
}

/// By how much of its radius a tube is too wide, up to 12 mm from the origin along z.
double width_error(const Surface& surface, const Vec3& along, double radius) {
  double sum = 0.0, count = 0.0;
  for (const auto& vertex : surface.vertices.colwise()) {
    const Vec3 p = vertex;
    if (std::abs(p.z()) > 12.0) continue;
    sum += (p - p.dot(along) * along).norm() / radius - 1.0;
    count += 1.0;
  }
  EXPECT_GT(count, 50.0);
  return sum / count;
}

TEST(SurfaceFromImage, HoldsAThinTubesRadiusHoweverThickItsWallInFatIs) {
  // Half way to soft tissue, whatever fat was seen through the wall, it was 4.1 % too narrow with
  // the thinnest wall.
  constexpr double kRadius = 2.5;
  Grid grid;
  grid.size = {40, 40, 40};
  grid.spacing = Vec3(0.75, 0.75, 1.0);
  grid.origin = Vec3(-15.0, -15.0, -20.0);
  const Vec3 along = Vec3(0.2, 0.1, 1.0).normalized();
  for (const double wall : {0.3, 0.5, 1.0, 1.5}) {
    SCOPED_TRACE(wall);
    const Surface surface = surface_of_tube(grid, along, kRadius, wall);
    EXPECT_NEAR(width_error(surface, along, kRadius), 0.0, 0.025);
  }
}

TEST(SurfaceFromImage, SeesTheWallInFatOfATubeAcrossThickSlices) {
  // A carotid artery. In slices that blur more than all else its wall was not looked for: 7.9, 5.6
  // and 2.6 % too narrow.
  constexpr double kRadius = 3.3;
  const Vec3 along = Vec3(0.06, 0.03, 1.0).normalized();
  for (const double wall : {0.5, 0.7, 1.0}) {
    SCOPED_TRACE(wall);
    PhantomSpec spec;
    spec.grid.size = {44, 44, 20};
    spec.grid.spacing = Vec3(0.7, 0.7, 4.0);
    spec.grid.origin = Vec3(-15.0, -15.0, -38.0);
    spec.body_semi_axes = {90.0, 90.0, 1000.0};
    spec.organs = {{.name = "fat", .hu = -90.0, .center = {0, 0, 0}, .semi_axes = {40, 40, 400}}};
    spec.blur_mm = 0.75;
    spec.noise_hu = 5.0;
    spec.tubes = {straight_tube(along, 200.0, kRadius, wall)};
    const Phantom phantom = make_phantom(spec);
    const Surface surface =
        surface_from_image(phantom.image, phantom.lumen, {.edge_length_mm = 1.0});
    EXPECT_NEAR(width_error(surface, along, kRadius), 0.0, 0.045);
  }
}

TEST(SurfaceFromImage, HoldsAnObliqueTubesRadiusAcrossThickSlices) {
  // Blur is wider across the slices, so walls that run along them come out too far in: by 0.25 mm
  // at 4 mm, and 0.13 mm at 3 mm, where blur was taken to be the same in all directions.
  constexpr double kRadius = 4.0, kPixel = 0.75;
  for (const auto& [thickness, most] : {std::pair(3.0, 0.08), std::pair(4.0, 0.16)}) {
    SCOPED_TRACE(thickness);
    Grid grid;
    grid.size = {100, 60, static_cast<int>(60.0 / thickness)};
    grid.spacing = Vec3(kPixel, kPixel, thickness);
    grid.origin = Vec3(-50.0 * kPixel, -30.0 * kPixel, -30.0);
    const Vec3 along = Vec3(0.766, 0.1, 0.643).normalized();
    const Surface surface = surface_of_tube(grid, along, kRadius);
    double sum = 0.0, count = 0.0;
    for (const auto& vertex : surface.vertices.colwise()) {
      const Vec3 p = vertex, outward = p - p.dot(along) * along;
      if (std::abs(p.dot(along)) > 20.0 || std::abs(outward.z()) > 0.2 * outward.norm()) continue;
      sum += outward.norm() - kRadius;
      count += 1.0;
    }
    ASSERT_GT(count, 50.0);
    EXPECT_NEAR(sum / count, 0.0, most);
  }
}

TEST(SurfaceFromImage, FitsATubeUpToTheRoundedRimOfItsCapInThickSlices) {
  // Of slices of 5 mm a whole one stayed as the mask had it: 3.3 to 4.7 mm from the axis.
  constexpr double kRadius = 4.0, kThickness = 5.0, kLast = 10.0;
  Grid grid;
  grid.size = {48, 40, 9};
  grid.spacing = Vec3(1.0, 1.0, kThickness);
  grid.origin = Vec3(-24.0, -20.0, kLast - 8.0 * kThickness);
  const Vec3 along = Vec3(0.4, 0.1, 1.0).normalized();
  const Surface surface = surface_of_tube(grid, along, kRadius);
  for (double depth = kThickness; depth > 3.4; depth -= 0.5) {
    const Vec3 on_axis = (kLast - depth) / along.z() * along;
    const double nearest = (surface.vertices.colwise() - on_axis).colwise().norm().minCoeff();
    EXPECT_NEAR(nearest, kRadius, 0.25) << depth;
  }
}

TEST(SurfaceFit, LeavesAVertexWhereTheImageHasNoEdge) {
  Grid grid;
  grid.size = {20, 20, 20};
  const Image flat{.grid = grid, .values = std::vector<float>(grid.voxels(), 300.0F)};
  const Surface ball = shapes::sphere({9.5, 9.5, 9.5}, 5.0, 0.7);
  FitStatistics fit;
  EXPECT_EQ(fit_to_image(ball, flat, &fit).vertices, ball.vertices);
  EXPECT_EQ(fit.fitted_fraction, 0.0);
}

}  // namespace
}  // namespace wireplan::preprocess
