#include <gtest/gtest.h>
#ifdef _OPENMP
#include <omp.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "preprocess/volume/random_patient.h"
#include "preprocess/volume/voxels.h"

namespace wireplan::preprocess {
namespace {

constexpr int kSeeds = 100;
constexpr double kBlood = 40.0;  // HU without contrast

bool drawn_with(const RandomPatient& patient, const std::string& feature) {
  return std::find(patient.features.begin(), patient.features.end(), feature) !=
         patient.features.end();
}

/// The patient's volume cut down to a box of voxels round the one next to a point; without what
/// blurs it.
PhantomSpec cut_to(const RandomPatient& patient, const Vec3& point, int reach) {
  PhantomSpec spec = patient.spec;
  const Vec3 ijk = spec.grid.ijk_from_lps(point).array().round();
  spec.grid.origin = spec.grid.lps_from_ijk(ijk - Vec3::Constant(reach));
  spec.grid.size = {2 * reach + 1, 2 * reach + 1, 2 * reach + 1};
  spec.blur_mm = spec.noise_hu = 0.0;
  spec.supersampling = 1;
  return spec;
}

TEST(RandomPatient, TheSameSeedGivesTheSamePatientAndAnotherSeedAnother) {
  const RandomPatient one = draw_patient(11), again = draw_patient(11), other = draw_patient(12);
  EXPECT_EQ(one.features, again.features);
  EXPECT_EQ(one.access.point, again.access.point);
  EXPECT_EQ(one.target.point, again.target.point);
  ASSERT_EQ(one.spec.tubes.size(), again.spec.tubes.size());
  for (std::size_t t = 0; t < one.spec.tubes.size(); ++t) {
    EXPECT_EQ(one.spec.tubes[t].points, again.spec.tubes[t].points);
    EXPECT_EQ(one.spec.tubes[t].radius, again.spec.tubes[t].radius);
    EXPECT_EQ(one.spec.tubes[t].hu_along, again.spec.tubes[t].hu_along);
  }
  EXPECT_NE(one.access.point, other.access.point);
}

#ifdef _OPENMP
TEST(RandomPatient, SameBytesForAnyThreads) {
  RandomPatient patient = draw_patient(1);
  for (std::uint64_t seed = 2; !drawn_with(patient, "stent") || !drawn_with(patient, "breath");) {
    patient = draw_patient(seed++);
  }
  const double noise = patient.spec.noise_hu;
  patient.spec = cut_to(patient, patient.target.point, 24);
  patient.spec.noise_hu = noise;
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const Phantom one = make_phantom(patient.spec);
  omp_set_num_threads(3);
  const Phantom three = make_phantom(patient.spec);
  omp_set_num_threads(threads);
  EXPECT_EQ(one.image.values, three.image.values);
  EXPECT_EQ(one.lumen.labels, three.lumen.labels);
}
#endif

TEST(RandomPatient, EachFeatureOccursInItsShare) {
  std::map<std::string, int> counts;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const RandomPatient patient = draw_patient(static_cast<std::uint64_t>(seed));
    for (const std::string& feature : patient.features) ++counts[feature];
  }
  EXPECT_EQ(counts.size(), std::size(kPatientFeatures));
  for (const PatientFeature& feature : kPatientFeatures) {
    // Three deviations of a binomial; the seeds are fixed, so this can fail by a change alone.
    const double mean = kSeeds * feature.share, deviation = std::sqrt(mean * (1.0 - feature.share));
    EXPECT_NEAR(counts[feature.name], mean, 3.0 * deviation) << feature.name;
  }
}

TEST(RandomPatient, WhatIsClickedLiesInTheTrueLumenBesideItsAxis) {
  constexpr int kPatients = 40;
  double off_axis = 0.0;
  for (int seed = 1; seed <= kPatients; ++seed) {
    SCOPED_TRACE(seed);
    const RandomPatient patient = draw_patient(static_cast<std::uint64_t>(seed));
    const Centerline way = true_way(patient);
    for (const Vec3& point : {patient.access.point, patient.target.point}) {
      EXPECT_EQ(make_phantom(cut_to(patient, point, 1)).lumen.labels[13], 1) << point.transpose();
      const double off = (way.points.colwise() - point).colwise().norm().minCoeff();
      EXPECT_LT(off, 4.3);  // 4 mm in the slice, and half of a slice where the vessel slants
      off_axis += off / (2.0 * kPatients);
    }
  }
  EXPECT_GT(off_axis, 0.5);  // nobody clicks the axis
}

TEST(RandomPatient, TheTruthJoinsAccessAndTarget) {
  // All kinds of slices and both anatomies; those with the narrowest places among them.
  for (const std::uint64_t seed : {8, 25, 35, 51, 70}) {
    SCOPED_TRACE(seed);
    RandomPatient patient = draw_patient(seed);
    patient.spec.organs.clear();
    patient.spec.vertebrae.clear();
    std::erase_if(patient.spec.tubes,
                  [](const PhantomTube& one) { return one.kind != PhantomTubeKind::kArtery; });
    patient.spec.blur_mm = patient.spec.noise_hu = 0.0;
    patient.spec.supersampling = 1;
    const Mask lumen = make_phantom(patient.spec).lumen;
    const auto voxel = [&](const Vec3& p) { return nearest_voxel(lumen.grid, p); };
    ASSERT_TRUE(voxel(patient.access.point) && voxel(patient.target.point));
    const Labels reached = flood(lumen.grid, {index_of(lumen.grid, *voxel(patient.access.point))},
                                 [&](std::size_t n) { return lumen.labels[n] != 0; });
    EXPECT_EQ(reached[index_of(lumen.grid, *voxel(patient.target.point))], 1);
  }
}

TEST(RandomPatient, ContrastFallsAlongTheWayAsDrawn) {
  int checked = 0;
  for (const std::uint64_t seed : {1, 9, 22, 60}) {
    SCOPED_TRACE(seed);
    RandomPatient patient = draw_patient(seed);
    patient.spec.calcium.clear();
    patient.spec.stents.clear();
    EXPECT_LE(patient.target_contrast_hu, patient.access_contrast_hu);
    const Centerline way = true_way(patient);
    const Eigen::Index last = way.points.cols() - 1;
    const double begin = way.points(2, 0), end = way.points(2, last);
    for (Eigen::Index i = 10; i < last; i += 40) {
      if (way.radius(i) < 3.0) continue;  // partial volume
      const double u = std::clamp((way.points(2, i) - begin) / (end - begin), 0.0, 1.0);
      const double expected = kBlood + patient.access_contrast_hu +
                              u * (patient.target_contrast_hu - patient.access_contrast_hu);
      const Phantom small = make_phantom(cut_to(patient, way.points.col(i), 0));
      // Linear in height between control points 2.5 mm apart, the voxel's middle half a voxel off;
      // the ends are those of the drawn places, 2 mm from those that were clicked at most.
      EXPECT_NEAR(small.image.values[0], expected, 4.0) << i;
      ++checked;
    }
  }
  EXPECT_GT(checked, 30);
}

TEST(RandomPatient, TheWayHasNoShortcutThroughLumensThatOverlap) {
  // Of the lumens on the way nothing is joined but along it: the shortest way through their voxels
  // (1 mm) is as long as the drawn one, but for the corners that it cuts.
  for (const std::uint64_t seed : {9, 28, 705, 1012}) {  // 705: an aneurysm beside the artery
    SCOPED_TRACE(seed);
    const RandomPatient patient = draw_patient(seed);
    const Centerline way = true_way(patient);
    Grid grid;
    grid.origin = (way.points.rowwise().minCoeff().array() - 30.0).matrix();
    const Vec3 size = way.points.rowwise().maxCoeff() - grid.origin;
    for (int axis = 0; axis < 3; ++axis) grid.size[axis] = static_cast<int>(size(axis)) + 31;
    Labels lumen(grid.voxels(), 0);
    for (Eigen::Index i = 0; i < way.points.cols(); ++i) {
      for (const std::size_t n : voxels_in_ball(grid, way.points.col(i), way.radius(i)))
        lumen[n] = 1;
    }
    const auto at = [&](Eigen::Index i) {
      return index_of(grid, *nearest_voxel(grid, way.points.col(i)));
    };
    // Steps to the 26 neighbours, by a queue of rounded lengths.
    const std::size_t start = at(0), end = at(way.points.cols() - 1);
    std::vector<double> length(lumen.size(), std::numeric_limits<double>::infinity());
    std::multimap<double, std::size_t> queue = {{0.0, start}};
    length[start] = 0.0;
    while (!queue.empty()) {
      const auto [reached, n] = *queue.begin();
      queue.erase(queue.begin());
      if (reached > length[n]) continue;
      const double here = reached;
      for_each_neighbour(grid, n, [&](std::size_t m, const Voxel& step) {
        const double next = here + Vec3(step[0], step[1], step[2]).norm();
        if (lumen[m] == 0 || next >= length[m]) return;
        length[m] = next;
        queue.emplace(next, m);
      });
    }
    const double whole = way.arc_length(way.arc_length.size() - 1);
    EXPECT_GT(length[end], whole - 3.0 * way.radius.maxCoeff());
  }
}

TEST(RandomPatient, LimbsKissWithinAMillimetre) {
  int loops = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const RandomPatient patient = draw_patient(static_cast<std::uint64_t>(seed));
    if (!drawn_with(patient, "kissing limbs")) continue;
    SCOPED_TRACE(seed);
    // A limb of its own tube, far on along it, or the other iliac below the bifurcation.
    double least = std::numeric_limits<double>::infinity();
    const auto meet = [&](const Centerline& a, Eigen::Index i, const Centerline& b,
                          Eigen::Index j) {
      const double gap = (a.points.col(i) - b.points.col(j)).norm() - a.radius(i) - b.radius(j);
      least = std::min(least, gap);
    };
    for (const std::string& name : patient.way) {
      if (name == "aorta") continue;
      const Centerline axis = phantom_axis(tube_named(patient.spec, name));
      for (Eigen::Index i = 0; i < axis.points.cols(); ++i) {
        for (Eigen::Index j = i + 1; j < axis.points.cols(); ++j) {
          if (axis.arc_length(j) - axis.arc_length(i) > 7.0 * axis.radius(i)) {
            meet(axis, i, axis, j);
          }
        }
      }
    }
    loops += least < 2.0;
    if (least >= 2.0) {
      const Centerline right = phantom_axis(tube_named(patient.spec, "right-common-iliac"));
      const Centerline left = phantom_axis(tube_named(patient.spec, "left-common-iliac"));
      for (Eigen::Index i = 0; i < right.points.cols(); ++i) {
        for (Eigen::Index j = 0; j < left.points.cols(); ++j) {
          if (right.points(2, i) < -10.0) meet(right, i, left, j);
        }
      }
    }
    EXPECT_GT(least, 0.1);   // 0.3 as drawn, before it is resampled and bent
    EXPECT_LT(least, 1.15);  // and 1
  }
  EXPECT_GT(loops, 3);
}

TEST(RandomPatient, VeinsHaveTheirShareOfTheArteriesHuBesideTheirWalls) {
  int with = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    const RandomPatient patient = draw_patient(static_cast<std::uint64_t>(seed));
    double nearest = std::numeric_limits<double>::infinity();
    for (const PhantomTube& tube : patient.spec.tubes) {
      if (tube.kind != PhantomTubeKind::kVein) continue;
      EXPECT_EQ(tube.hu_along.size() > 0, drawn_with(patient, "veins"));
      if (tube.hu_along.size() == 0) continue;
      ++with;
      // Between the least and the most that arteries have, times the range of shares.
      EXPECT_GE(tube.hu_along.minCoeff(), 0.5 * (kBlood + patient.target_contrast_hu) - 1e-9);
      EXPECT_LE(tube.hu_along.maxCoeff(), 0.95 * (kBlood + patient.access_contrast_hu) + 1e-9);
      const Centerline vein = phantom_axis(tube);
      for (const PhantomTube& artery : patient.spec.tubes) {
        if (artery.kind != PhantomTubeKind::kArtery) continue;
        const Centerline axis = phantom_axis(artery);
        for (Eigen::Index i = 0; i < vein.points.cols(); i += 4) {
          nearest = std::min(
              nearest, ((axis.points.colwise() - vein.points.col(i)).colwise().norm().transpose() -
                        axis.radius)
                               .minCoeff() -
                           vein.radius(i));
        }
      }
    }
    if (drawn_with(patient, "veins")) {
      EXPECT_LT(nearest, 2.0);  // a wall of 1 mm and a gap of 1 at most
    }
  }
  EXPECT_GT(with, 100);
}

TEST(RandomPatient, ArteriesDentVeinsAndNeverRunInsideOfThem) {
  // The last two had 25 mm of a carotid and of a renal artery whole inside of a vein.
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 9104, 9123}) {
    SCOPED_TRACE(seed);
    const RandomPatient patient = draw_patient(seed);
    for (const PhantomTube& tube : patient.spec.tubes) {
      if (tube.kind != PhantomTubeKind::kVein) continue;
      const Centerline vein = phantom_axis(tube);
      for (const PhantomTube& other : patient.spec.tubes) {
        if (other.kind != PhantomTubeKind::kArtery) continue;
        const Centerline artery = phantom_axis(other);
        double deepest = 0.0;  // that the artery's axis lies in the vein
        for (Eigen::Index i = 0; i < vein.points.cols(); ++i) {
          const double away =
              (artery.points.colwise() - vein.points.col(i)).colwise().norm().minCoeff();
          deepest = std::max(deepest, vein.radius(i) - away);
        }
        EXPECT_EQ(deepest, 0.0) << tube.name << " in " << other.name;
      }
    }
  }
}

TEST(RandomPatient, NoArteryRunsInsideOfTheThyroid) {
  int lobes = 0;
  // In 10040, 10042 and 10092 a carotid's axis lay up to a third of the way to a lobe's middle.
  for (std::uint64_t seed = 10030; seed < 10100; ++seed) {
    SCOPED_TRACE(seed);
    const RandomPatient patient = draw_patient(seed);
    for (const PhantomEllipsoid& lobe : patient.spec.organs) {
      if (lobe.name != "thyroid") continue;
      ++lobes;
      for (const PhantomTube& tube : patient.spec.tubes) {
        if (tube.kind != PhantomTubeKind::kArtery) continue;
        const Centerline artery = phantom_axis(tube);
        double deepest = 1.0;
        for (Eigen::Index i = 0; i < artery.points.cols(); ++i) {
          const Vec3 axes = lobe.semi_axes.array() + tube.wall_mm + 0.5 * artery.radius(i);
          const Vec3 off = artery.points.col(i) - lobe.center;
          deepest = std::min(deepest, off.cwiseQuotient(axes).norm());
        }
        EXPECT_EQ(deepest, 1.0) << tube.name;
      }
    }
  }
  EXPECT_GT(lobes, 30);
}

}  // namespace
}  // namespace wireplan::preprocess
