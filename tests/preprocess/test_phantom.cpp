#include <gtest/gtest.h>
#ifdef _OPENMP
#include <omp.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "preprocess/volume/phantom.h"
#include "preprocess/volume/phantom_lumen.h"

namespace wireplan::preprocess {
namespace {

constexpr double kLumenHu = 350.0, kFatHu = -100.0;

/// Fat that fills the grid, which lies between skin and muscle of a huge body.
PhantomSpec make_fat(const std::array<int, 3>& size, double spacing) {
  PhantomSpec spec;
  spec.grid.size = size;
  spec.grid.spacing = Vec3::Constant(spacing);
  spec.grid.origin = -0.5 * spacing * Vec3(size[0] - 1, size[1] - 1, size[2] - 1);
  spec.body_center = Vec3(-300.0, 0.0, 0.0);
  spec.body_semi_axes = Vec3::Constant(500.0);
  spec.fat_mm = 400.0;
  spec.blur_mm = 0.0;
  spec.noise_hu = 0.0;
  return spec;
}

PhantomTube make_tube(const std::string& name, const std::vector<Vec3>& points,
                      const std::vector<double>& radius) {
  PhantomTube tube;
  tube.name = name;
  tube.hu = kLumenHu;
  tube.points.resize(3, points.size());
  for (std::size_t i = 0; i < points.size(); ++i) tube.points.col(i) = points[i];
  tube.radius = Eigen::VectorXd::Map(radius.data(), radius.size());
  return tube;
}

/// A capsule of length 20 and radius 5 that slants through a box of 40 mm.
PhantomSpec make_capsule(double spacing) {
  const int voxels = static_cast<int>(40.0 / spacing);
  PhantomSpec spec = make_fat({voxels, voxels, voxels}, spacing);
  const Vec3 half = 10.0 * Vec3(0.48, 0.6, 0.64);
  spec.tubes = {make_tube("capsule", {-half, half}, {5.0, 5.0})};
  return spec;
}

double voxel_volume(const Grid& grid) { return grid.spacing.prod(); }

/// Volume [mm^3] that the lumen's HU stand for, partial voxels included.
double volume_by_mass(const Image& image) {
  double mass = 0.0;
  for (const float hu : image.values) mass += (hu - kFatHu) / (kLumenHu - kFatHu);
  return mass * voxel_volume(image.grid);
}

double volume_by_count(const Mask& mask) {
  return voxel_volume(mask.grid) * std::accumulate(mask.labels.begin(), mask.labels.end(), 0.0);
}

Vec3 center_of(const Grid& grid, std::size_t voxel) {
  const int v = static_cast<int>(voxel), row = grid.size[0], slice = row * grid.size[1];
  return grid.lps_from_ijk(Vec3(v % row, v / row % grid.size[1], v / slice));
}

TEST(Phantom, VolumeOfATubeIsThatOfACapsule) {
  const double exact = kPi * 25.0 * 20.0 + 4.0 / 3.0 * kPi * 125.0;  // 2094 mm^3
  const Phantom phantom = make_phantom(make_capsule(1.0));
  // About 940 voxels are crossed; sampled 27 times each, the sum errs by a few of 1/27 voxel each.
  EXPECT_NEAR(volume_by_mass(phantom.image), exact, 0.003 * exact);
  // Voxels counted whole: an error of a good half voxel for each, half of them cancelling at
  // random.
  EXPECT_NEAR(volume_by_count(phantom.lumen), exact, 0.01 * exact);
}

TEST(Phantom, PartialVolumeConvergesWithFinerSampling) {
  const double exact = kPi * 25.0 * 20.0 + 4.0 / 3.0 * kPi * 125.0;
  PhantomSpec spec = make_capsule(2.0);
  spec.supersampling = 8;
  // 512 samples in each of the 240 voxels that are crossed.
  EXPECT_NEAR(volume_by_mass(make_phantom(spec).image), exact, 0.001 * exact);
}

TEST(Phantom, ABallInAVoxelCornerIsSeenAtOneEighth) {
  PhantomSpec spec = make_fat({4, 4, 4}, 2.0);  // voxel corner at the origin
  spec.organs = {{.name = "octants",
                  .hu = kLumenHu,
                  .center = Vec3::Zero(),
                  .semi_axes = Vec3::Constant(1.0)}};
  spec.supersampling = 16;
  const Phantom phantom = make_phantom(spec);
  const double filled = kPi / 6.0 / 8.0;  // an octant of the unit ball in a voxel of 8 mm^3
  const double hu = phantom.image.values[phantom.image.grid.index(1, 2, 1)];
  EXPECT_NEAR((hu - kFatHu) / (kLumenHu - kFatHu), filled, 0.02 * filled);  // 4096 samples
  EXPECT_FLOAT_EQ(phantom.image.values[phantom.image.grid.index(0, 2, 1)], kFatHu);
}

TEST(Phantom, BlurKeepsTheMassAndTheOrderAcrossAnEdge) {
  PhantomSpec spec = make_capsule(1.0);
  const double sharp = volume_by_mass(make_phantom(spec).image);
  spec.blur_mm = 0.8;
  const Image blurred = make_phantom(spec).image;
  EXPECT_NEAR(volume_by_mass(blurred), sharp, 1e-4 * sharp);  // single precision

  // Along a ray from the middle outward the value never rises, and falls from lumen to fat.
  spec.tubes = {make_tube("along z", {{0, 0, -40}, {0, 0, 40}}, {6.0, 6.0})};
  const Image tube = make_phantom(spec).image;
  const int middle = tube.grid.size[0] / 2;
  for (int i = middle; i + 1 < tube.grid.size[0]; ++i) {
    EXPECT_GE(tube.values[tube.grid.index(i, middle, middle)] + 1e-3F,
              tube.values[tube.grid.index(i + 1, middle, middle)]);
  }
  EXPECT_NEAR(tube.values[tube.grid.index(middle, middle, middle)], kLumenHu, 0.01);
  EXPECT_NEAR(tube.values[tube.grid.index(tube.grid.size[0] - 1, middle, middle)], kFatHu, 0.01);
}

TEST(Phantom, NoiseHasTheSigmaThatWasAskedForWithAndWithoutBlur) {
  for (const double blur_mm : {0.0, 0.7}) {
    SCOPED_TRACE(blur_mm);
    PhantomSpec spec = make_fat({48, 48, 48}, 0.9);
    spec.noise_hu = 22.0;
    spec.blur_mm = blur_mm;
    const Phantom phantom = make_phantom(spec);
    double sum = 0.0, squares = 0.0, neighbours = 0.0, count = 0.0;
    for (int k = 4; k < 44; ++k) {  // away from the border, where the blur sees less
      for (int j = 4; j < 44; ++j) {
        for (int i = 4; i < 44; ++i) {
          const auto noise = [&](int di) {
            return phantom.image.values[phantom.image.grid.index(i + di, j, k)] - kFatHu;
          };
          sum += noise(0);
          squares += noise(0) * noise(0);
          neighbours += noise(0) * noise(1);
          count += 1.0;
        }
      }
    }
    // 64 000 samples, of which blur leaves about a tenth independent: sigma to 1 % (one deviation).
    EXPECT_NEAR(sum / count, 0.0, 1.0);
    EXPECT_NEAR(std::sqrt(squares / count), 22.0, 0.03 * 22.0);
    // Neighbours: exp(-(spacing / 2 sigma)^2) for a Gaussian point spread, 0.66; none without.
    const double correlation = blur_mm > 0.0 ? std::exp(-0.25 * std::pow(0.9 / blur_mm, 2)) : 0.0;
    EXPECT_NEAR(neighbours / squares, correlation, 0.03);
  }
}

#ifdef _OPENMP
TEST(Phantom, SameBytesForAnyThreads) {
  PhantomSpec spec = make_capsule(1.0);
  spec.blur_mm = 0.6;
  spec.noise_hu = 20.0;
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const Phantom one = make_phantom(spec);
  omp_set_num_threads(2);
  const Phantom two = make_phantom(spec);
  omp_set_num_threads(3);
  const Phantom three = make_phantom(spec);
  omp_set_num_threads(threads);
  EXPECT_EQ(one.image.values, two.image.values);
  EXPECT_EQ(one.image.values, three.image.values);
  EXPECT_EQ(one.lumen.labels, two.lumen.labels);
}
#endif

TEST(Phantom, OtherBytesForAnotherSeed) {
  PhantomSpec spec = make_capsule(1.0);
  spec.blur_mm = 0.6;
  spec.noise_hu = 20.0;
  const Phantom one = make_phantom(spec);
  spec.seed = 2;
  EXPECT_NE(one.image.values, make_phantom(spec).image.values);
}

TEST(Phantom, AxisPassesItsControlPointsEvenlySpaced) {
  const PhantomTube tube =
      make_tube("bend", {{0, 0, 0}, {10, 0, 0}, {17, 7, 0}, {17, 17, 3}}, {3.0, 5.0, 4.0, 2.0});
  const Centerline axis = phantom_axis(tube);
  for (Eigen::Index c = 0; c < tube.points.cols(); ++c) {
    Eigen::Index nearest = 0;
    const double gap =
        (axis.points.colwise() - tube.points.col(c)).colwise().norm().minCoeff(&nearest);
    EXPECT_LE(gap, 0.26);                                     // half of the spacing
    EXPECT_NEAR(axis.radius(nearest), tube.radius(c), 0.06);  // largest slope 0.2 per mm
  }
  for (Eigen::Index i = 0; i + 1 < axis.points.cols(); ++i) {
    const double step = (axis.points.col(i + 1) - axis.points.col(i)).norm();
    EXPECT_LE(step, 0.5 + 1e-9);
    EXPECT_NEAR(step, axis.arc_length(i + 1) - axis.arc_length(i), 1e-3);  // chord against arc
  }
}

TEST(Phantom, MaskIsTheBallsAlongTheTrueAxis) {
  PhantomSpec spec = make_fat({50, 50, 60}, 0.8);
  PhantomTube vein = make_tube("vein", {{-15, 0, -20}, {-15, 0, 20}}, {3.0, 3.0});
  vein.kind = PhantomTubeKind::kVein;
  spec.tubes = {
      make_tube("artery", {{6, 0, -60}, {6, 4, -5}, {2, -4, 8}, {4, 0, 19}}, {5.0, 5.0, 3.0, 4.0}),
      vein};
  spec.tubes[0].wall_mm = 1.0;
  const Phantom phantom = make_phantom(spec);
  ASSERT_EQ(phantom.names, std::vector<std::string>{"artery"});
  const Centerline& axis = phantom.centerlines[0];
  ASSERT_GT(axis.points.cols(), 80);
  EXPECT_GT(axis.points.row(2).minCoeff(), -24.1);  // clipped to the volume, half of 60 x 0.8
  EXPECT_EQ(axis.arc_length(0), 0.0);
  int inside = 0;
  for (std::size_t voxel = 0; voxel < phantom.lumen.labels.size(); ++voxel) {
    const Vec3 p = center_of(phantom.lumen.grid, voxel);
    if (p.z() < -18.0) continue;  // where balls from below the volume count too
    const double depth =
        (axis.radius.transpose() - (axis.points.colwise() - p).colwise().norm()).maxCoeff();
    if (std::abs(depth) < 0.02) continue;  // the axis is sampled
    EXPECT_EQ(phantom.lumen.labels[voxel] == 1, depth > 0.0) << p.transpose();
    inside += phantom.lumen.labels[voxel];
  }
  EXPECT_GT(inside, 3000);
}

TEST(Phantom, CalciumLiesInTheLumenOnTheWallWhereItWasAskedFor) {
  PhantomSpec spec = make_fat({40, 40, 60}, 0.6);
  spec.tubes = {make_tube("aorta", {{0, 0, -30}, {0, 0, 30}}, {8.0, 8.0})};
  spec.tubes[0].wall_mm = 1.0;
  // The tube runs up: 90 degrees right-handed from anterior (-y) is to the left (+x).
  spec.calcium = {{.tube = "aorta",
                   .at = 0.6,
                   .angle_deg = 90.0,
                   .length_mm = 10.0,
                   .width_deg = 60.0,
                   .thickness_mm = 2.0,
                   .hu = 900.0}};
  const Phantom phantom = make_phantom(spec);
  int count = 0;
  for (std::size_t voxel = 0; voxel < phantom.image.values.size(); ++voxel) {
    if (phantom.image.values[voxel] < 899.0) continue;  // voxels of calcium alone
    ++count;
    const Vec3 p = center_of(phantom.image.grid, voxel);
    EXPECT_LT(p.head<2>().norm(), 8.0);
    EXPECT_GT(p.head<2>().norm(), 6.0);
    EXPECT_LT(std::abs(std::atan2(p.y(), p.x())), 30.0 * kRadPerDeg);
    EXPECT_LT(std::abs(p.z() - 6.0), 5.0);
    EXPECT_EQ(phantom.lumen.labels[voxel], 0);
  }
  EXPECT_GT(count, 50);
  // Volume of the lens t (1 - u^2 - v^2) over its ellipse: pi/2 t a b, with a 5 mm and b 30 degrees
  // of the radius at mean depth.
  PhantomSpec clean = spec;
  clean.calcium.clear();
  const double missing =
      volume_by_count(make_phantom(clean).lumen) - volume_by_count(phantom.lumen);
  const double lens = 0.5 * kPi * 2.0 * 5.0 * (kPi / 6.0 * (8.0 - 2.0 / 3.0));
  EXPECT_NEAR(missing, lens, 0.05 * lens);  // 280 voxels, counted whole
}

TEST(Phantom, LaterPaintHidesEarlierAndWallsNeverCloseABranch) {
  PhantomSpec spec = make_fat({60, 60, 40}, 0.7);
  spec.vertebrae = {{.center = {0, 12, 0}, .semi_axes = {10, 7, 9}}};
  spec.tubes = {make_tube("trunk", {{0, 0, -30}, {0, 0, 30}}, {5.0, 5.0}),
                make_tube("branch", {{0, 0, 0}, {18, 0, 0}}, {2.5, 2.5})};
  for (PhantomTube& tube : spec.tubes) tube.wall_mm = 1.0;
  const Phantom phantom = make_phantom(spec);
  const auto hu = [&](const Vec3& p) {
    const Vec3 ijk = phantom.image.grid.ijk_from_lps(p).array().round();
    return phantom.image.values[phantom.image.grid.index(
        static_cast<int>(ijk.x()), static_cast<int>(ijk.y()), static_cast<int>(ijk.z()))];
  };
  for (double x = 0.0; x < 18.0; x += 0.5) EXPECT_EQ(hu({x, 0, 0}), kLumenHu) << x;
  EXPECT_EQ(hu({0, 12, 0}), 230.0F);          // spongy core
  EXPECT_NEAR(hu({0, 18.4, 0}), 700.0, 1.0);  // its shell behind
  // The wall touches the bone: between lumen (5 mm) and shell (6 mm) lies nothing else.
  EXPECT_GT(hu({0, 5.6, 0}), spec.tissue_hu - 1.0);
}

TEST(Phantom, HuOfATubeAreLinearBetweenItsPoints) {
  PhantomSpec spec = make_fat({30, 30, 40}, 1.0);
  spec.tubes = {make_tube("artery", {{0, 0, -30}, {0, 0, 0}, {0, 0, 30}}, {6.0, 6.0, 6.0})};
  spec.tubes[0].hu_along = Eigen::Vector3d(200.0, 260.0, 140.0);
  const Phantom phantom = make_phantom(spec);
  const Grid& grid = phantom.image.grid;
  for (int k = 0; k < grid.size[2]; ++k) {
    const double z = grid.lps_from_ijk(Vec3(0, 0, k)).z();
    const double expected = z < 0.0 ? 260.0 + 2.0 * z : 260.0 - 4.0 * z;
    EXPECT_NEAR(phantom.image.values[grid.index(15, 15, k)], expected, 0.01) << z;
    EXPECT_EQ(phantom.lumen.labels[grid.index(15, 15, k)], 1);
  }
}

TEST(Phantom, ThrombusLinesTheSacOverVeinsAndUnderTheLumen) {
  PhantomSpec spec = make_fat({60, 60, 12}, 0.8);
  PhantomTube sac = make_tube("sac", {{0, 0, -20}, {0, 0, 20}}, {12.0, 12.0});
  sac.kind = PhantomTubeKind::kThrombus;
  sac.hu = 50.0;
  PhantomTube vein = make_tube("vein", {{-14, 0, -20}, {-14, 0, 20}}, {5.0, 5.0});
  vein.kind = PhantomTubeKind::kVein;
  vein.hu = 200.0;
  spec.tubes = {make_tube("artery", {{3, 0, -20}, {3, 0, 20}}, {6.0, 6.0}), sac, vein};
  const Phantom phantom = make_phantom(spec);
  for (std::size_t voxel = 0; voxel < phantom.image.values.size(); ++voxel) {
    const Vec3 p = center_of(phantom.image.grid, voxel);
    const double lumen = (p - Vec3(3, 0, p.z())).norm(), middle = p.head<2>().norm();
    EXPECT_EQ(phantom.lumen.labels[voxel], lumen < 6.0 ? 1 : 0);
    if (lumen > 7.0 && middle < 11.0) {
      EXPECT_EQ(phantom.image.values[voxel], 50.0F);
    }
    if (middle > 13.0 && (p - Vec3(-14, 0, p.z())).norm() < 4.0) {
      EXPECT_EQ(phantom.image.values[voxel], 200.0F);
    }
  }
}

TEST(Phantom, AStentIsWireOnTheWallOutsideTheLumen) {
  PhantomSpec spec = make_fat({80, 80, 120}, 0.25);
  spec.tubes = {make_tube("artery", {{0, 0, -30}, {0, 0, 30}}, {5.0, 5.0})};
  spec.stents = {{.tube = "artery",
                  .from = 0.35,
                  .to = 0.65,
                  .strut_mm = 0.5,
                  .pitch_mm = 5.0,
                  .amplitude_mm = 0.0,
                  .crowns = 6,
                  .hu = 2500.0}};
  const Phantom phantom = make_phantom(spec);
  double metal = 0.0;  // mm^3, by what a voxel has over fat
  for (std::size_t voxel = 0; voxel < phantom.image.values.size(); ++voxel) {
    const Vec3 p = center_of(phantom.image.grid, voxel);
    const double off = p.head<2>().norm();
    EXPECT_EQ(phantom.lumen.labels[voxel], off < 5.0 ? 1 : 0);
    if (phantom.image.values[voxel] < 2499.0) continue;
    EXPECT_GT(off, 5.0 - 1e-9);
    EXPECT_LT(off, 5.5);
    EXPECT_LT(std::abs(p.z()), 9.3);
    metal += voxel_volume(phantom.image.grid);
  }
  // Rings at -9, -4, 1 and 6 mm, of 0.5 x 0.5 mm: the stretch has 18 mm, so four.
  const double exact = 4.0 * 0.5 * kPi * (5.5 * 5.5 - 5.0 * 5.0);
  EXPECT_GT(metal, 0.2 * exact);  // voxels that are all metal, of rings two voxels thick
  EXPECT_LT(metal, exact);
  // With a zigzag there is more wire: a sine on the wall is longer than the circle.
  spec.stents[0].amplitude_mm = 1.5;
  double mass = 0.0, straight = 0.0;
  const Image zigzag = make_phantom(spec).image;
  for (std::size_t voxel = 0; voxel < zigzag.values.size(); ++voxel) {
    mass += std::max(zigzag.values[voxel] - kLumenHu, 0.0);
    straight += std::max(phantom.image.values[voxel] - kLumenHu, 0.0);
  }
  EXPECT_GT(mass, 1.1 * straight * 3.0 / 4.0);  // three or four rings
}

TEST(Phantom, ABreathShiftsAllAboveItAndTheTruthToo) {
  PhantomSpec spec = make_fat({40, 40, 40}, 1.0);
  spec.tubes = {make_tube("artery", {{0, 0, -40}, {0, 0, 40}}, {5.0, 5.0})};
  const Phantom still = make_phantom(spec);
  spec.breath = PhantomBreath{.above_z_mm = 3.2, .shift_mm = {3.0, -2.0, 0.0}};
  const Phantom moved = make_phantom(spec);
  const Grid& grid = spec.grid;
  int checked = 0;
  for (int k = 0; k < 40; ++k) {
    const bool above = grid.lps_from_ijk(Vec3(0, 0, k)).z() > 3.2;
    for (int j = 5; j < 35; ++j) {
      for (int i = 5; i < 35; ++i) {
        const std::size_t here = grid.index(i, j, k);
        const std::size_t there = above ? grid.index(i - 3, j + 2, k) : here;
        EXPECT_EQ(moved.image.values[here], still.image.values[there]);
        EXPECT_EQ(moved.lumen.labels[here], still.lumen.labels[there]);
        checked += still.lumen.labels[there];
      }
    }
  }
  EXPECT_GT(checked, 2000);
  const Centerline& line = moved.centerlines[0];
  for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
    const bool above = line.points(2, i) > 3.2;
    EXPECT_NEAR(line.points(0, i), above ? 3.0 : 0.0, 1e-9);
    EXPECT_NEAR(line.points(1, i), above ? -2.0 : 0.0, 1e-9);
  }
}

TEST(Phantom, TheTruthOfABreathAlongTheVesselIsWhatTheVolumeShows) {
  for (const double up : {-8.0, 8.0}) {
    SCOPED_TRACE(up);
    PhantomSpec spec = make_fat({60, 40, 60}, 1.0);
    spec.tubes = {make_tube("artery", {{-12, 0, -24}, {12, 0, 24}}, {5.0, 5.0})};
    spec.breath = PhantomBreath{.above_z_mm = 3.2, .shift_mm = {3.0, -2.0, up}};
    const Phantom moved = make_phantom(spec);
    const Centerline& line = moved.centerlines[0];
    ASSERT_GT(line.points.cols(), 40);
    int above = 0;
    for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
      // The tube's axis is x = z / 2, as it is or shifted.
      const bool shifted = line.points(2, i) > 3.2;
      const Vec3 p = line.points.col(i) - (shifted ? spec.breath->shift_mm : Vec3(0, 0, 0));
      EXPECT_NEAR(p.x(), 0.5 * p.z(), 1e-9);
      EXPECT_NEAR(p.y(), 0.0, 1e-9);
      const Vec3 ijk = spec.grid.ijk_from_lps(line.points.col(i)).array().round();
      const std::size_t voxel = spec.grid.index(
          static_cast<int>(ijk.x()), static_cast<int>(ijk.y()), static_cast<int>(ijk.z()));
      const bool slice_shifted = spec.grid.lps_from_ijk(ijk).z() > 3.2;
      if (slice_shifted == shifted) {
        EXPECT_EQ(moved.lumen.labels[voxel], 1) << line.points.col(i).transpose();
      }
      const double before = i > 0 ? line.points(2, i - 1) : -100.0;
      EXPECT_GT(line.points(2, i), before) << "the way never turns back";
      above += shifted ? 1 : 0;
    }
    EXPECT_GT(above, 15);
    EXPECT_LT(above, line.points.cols() - 15);
  }
}

TEST(PhantomLumen, DistanceIsThatToTheWallAndToPlaqueWhereABreathHasPutThem) {
  PhantomSpec spec = make_fat({40, 40, 40}, 1.0);
  spec.tubes = {make_tube("artery", {{0, 0, -40}, {0, 0, 40}}, {5.0, 5.0}),
                make_tube("vein", {{9, 0, -40}, {9, 0, 40}}, {3.0, 3.0})};
  spec.tubes[1].kind = PhantomTubeKind::kVein;
  spec.calcium = {{.tube = "artery",
                   .at = 0.5,
                   .angle_deg = 90.0,  // to the left, +x, as the tube runs up
                   .length_mm = 10.0,
                   .width_deg = 60.0,
                   .thickness_mm = 2.0}};
  spec.breath = PhantomBreath{.above_z_mm = 12.0, .shift_mm = {3.0, -2.0, 0.0}};
  const PhantomLumen lumen(spec);
  for (const double x : {-7.0, -5.0, -4.0, -0.5, 4.0, 9.0}) {
    EXPECT_NEAR(lumen.distance({x, 0, -20}), std::abs(x) - 5.0, 1e-9);
    EXPECT_NEAR(lumen.distance({x + 3.0, -2, 20}), std::abs(x) - 5.0, 1e-9);
  }
  // In the middle of the plaque, 2 mm thick, and half way to its rim along the tube, 1.5 mm.
  EXPECT_NEAR(lumen.distance({4, 0, 0}), 1.0, 1e-6);
  EXPECT_NEAR(lumen.distance({2.5, 0, 0}), -0.5, 1e-6);
  EXPECT_NEAR(lumen.distance({4, 0, 2.5}), 0.5, 1e-6);
  EXPECT_NEAR(lumen.distance({-4, 0, 0}), -1.0, 1e-6);  // none there
}

TEST(Phantom, TexturedNoiseIsCorrelatedAsADifferenceOfGaussians) {
  PhantomSpec spec = make_fat({96, 96, 24}, 0.7);
  spec.noise_hu = 22.0;
  spec.blur_mm = 0.6;
  spec.noise_texture_mm = 0.8;
  const Phantom phantom = make_phantom(spec);
  const Grid& grid = phantom.image.grid;
  const auto noise = [&](int i, int j, int k) {
    return phantom.image.values[grid.index(i, j, k)] - kFatHu;
  };
  std::array<double, 7> products{};  // of voxels 0 to 6 apart along the row
  double up = 0.0, count = 0.0;
  for (int k = 0; k < 23; ++k) {
    for (int j = 8; j < 88; ++j) {
      for (int i = 8; i < 82; ++i) {
        for (int d = 0; d < 7; ++d) products[d] += noise(i, j, k) * noise(i + d, j, k);
        up += noise(i, j, k) * noise(i, j, k + 1);
        count += 1.0;
      }
    }
  }
  // 136 000 samples of which one in about ten counts by itself: sigma good to 1 %.
  EXPECT_NEAR(std::sqrt(products[0] / count), 22.0, 0.02 * 22.0);
  EXPECT_NEAR(up / products[0], 0.0, 0.02);
  // In the continuum: Gaussians of variance 2, 5 and 8 sigma^2, the middle one twice and negative.
  for (int d = 1; d < 7; ++d) {
    const double q = std::pow(0.7 * d / 0.8, 2);
    const double expected =
        (std::exp(-q / 4.0) / 2.0 - 2.0 * std::exp(-q / 10.0) / 5.0 + std::exp(-q / 16.0) / 8.0) /
        (1.0 / 2.0 - 2.0 / 5.0 + 1.0 / 8.0);
    EXPECT_NEAR(products[d] / products[0], expected, 0.03) << d;
  }
}

TEST(Phantom, RefusesImpossibleSpecs) {
  PhantomSpec spec = make_capsule(2.0);
  spec.calcium = {{.tube = "no such tube"}};
  EXPECT_THROW(make_phantom(spec), LogicError);
  spec = make_capsule(2.0);
  spec.tubes[0].radius(0) = 0.0;
  EXPECT_THROW(make_phantom(spec), LogicError);
  spec = make_capsule(2.0);
  spec.tubes[0].points.col(1) = spec.tubes[0].points.col(0);
  EXPECT_THROW(make_phantom(spec), LogicError);
}

}  // namespace
}  // namespace wireplan::preprocess
