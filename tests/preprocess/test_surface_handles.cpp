// Places of handles: of shapes whose handles are known by construction, and in numbers that the
// Euler number gives in another way.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <tuple>
#include <vector>

#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_handles.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

/// A closed grid of `around` times `across` vertices on a torus.
Surface torus(int around, int across, double ring, const std::function<double(double)>& radius) {
  std::vector<Vec3> vertices;
  std::vector<Eigen::Vector3i> triangles;
  const auto at = [&](int i, int j) { return (i % around) * across + j % across; };
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double a = 2.0 * kPi * i / around, b = 2.0 * kPi * j / across, r = radius(a);
      const double out = ring + r * std::cos(b);
      vertices.emplace_back(out * std::cos(a), out * std::sin(a), r * std::sin(b));
      triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return shapes::as_surface(vertices, triangles);
}

/// Of balls along lines in a grid of half a millimetre.
struct Tube {
  Vec3 from, to;
  double radius;
};
Surface tubes(const std::vector<Tube>& all, const std::vector<Tube>& holes = {}) {
  Mask mask{.grid = {.size = {90, 40, 120}, .spacing = Vec3::Constant(0.5)}, .labels = {}};
  mask.labels.assign(mask.grid.voxels(), 0);
  const auto in = [](const Vec3& p, const Tube& tube) {
    const Vec3 along = tube.to - tube.from;
    const double s = std::clamp((p - tube.from).dot(along) / along.squaredNorm(), 0.0, 1.0);
    return (p - tube.from - s * along).norm() <= tube.radius;
  };
  for (std::size_t n = 0; n < mask.labels.size(); ++n) {
    const auto i = static_cast<int>(n % 90), j = static_cast<int>(n / 90 % 40),
               k = static_cast<int>(n / 3600);
    const Vec3 p = mask.grid.lps_from_ijk(Vec3(i, j, k));
    const auto holds = [&](const Tube& tube) { return in(p, tube); };
    mask.labels[n] = std::any_of(all.begin(), all.end(), holds) &&
                     std::none_of(holes.begin(), holes.end(), holds);
  }
  return surface_from_mask(mask, {.edge_length_mm = 1.0});
}

TEST(SurfaceHandles, OfATorusIsWhereItsTubeIsThinnest) {
  const Surface ring = torus(180, 48, 20.0, [](double a) { return 4.0 + std::cos(a); });
  ASSERT_EQ(check_surface(ring).euler_number, 0);
  const std::vector<Handle> handles = find_handles(ring);
  ASSERT_EQ(handles.size(), 1U);
  EXPECT_NEAR(handles.front().radius_mm, 3.0, 0.01);
  EXPECT_LT((handles.front().place - Vec3(-20.0, 0.0, 0.0)).norm(), 0.3);
}

TEST(SurfaceHandles, OfAFatTorusIsItsHole) {
  const Surface ring = torus(90, 180, 20.0, [](double) { return 15.0; });
  const std::vector<Handle> handles = find_handles(ring);
  ASSERT_EQ(handles.size(), 1U);
  EXPECT_NEAR(handles.front().radius_mm, 5.0, 0.01);
  EXPECT_LT(handles.front().place.norm(), 0.05);
}

TEST(SurfaceHandles, ASphereHasNone) {
  EXPECT_TRUE(find_handles(tubes({{{20, 10, 20}, {20, 10, 40}, 6.0}})).empty());
}

TEST(SurfaceHandles, OfTwoLimbsAreTheirBridgesTheThinnestFirst) {
  const Surface fork = tubes({{{8, 10, 8}, {8, 10, 50}, 4.0},
                              {{36, 10, 8}, {36, 10, 50}, 4.0},
                              {{8, 10, 8}, {36, 10, 8}, 4.0},
                              {{8, 10, 28}, {36, 10, 28}, 2.5},
                              {{8, 10, 44}, {36, 10, 44}, 1.6}});
  ASSERT_EQ(check_surface(fork).euler_number, 2 - 2 * 2);
  const std::vector<Handle> handles = find_handles(fork);
  ASSERT_EQ(handles.size(), 2U);
  for (const auto& [handle, level, radius] :
       {std::tuple(handles[0], 44.0, 1.6), std::tuple(handles[1], 28.0, 2.5)}) {
    EXPECT_NEAR(handle.radius_mm, radius, 0.2);
    EXPECT_NEAR(handle.place.z(), level, 0.4);
    EXPECT_NEAR(handle.place.y(), 10.0, 0.4);
    EXPECT_GT(handle.place.x(), 11.0);
    EXPECT_LT(handle.place.x(), 33.0);
  }
}

TEST(SurfaceHandles, AHoleThroughAVesselIsOne) {
  const Surface vessel =
      tubes({{{20, 10, 10}, {20, 10, 50}, 7.0}}, {{{20, 0, 30}, {20, 20, 30}, 1.5}});
  ASSERT_EQ(check_surface(vessel).euler_number, 0);
  const std::vector<Handle> handles = find_handles(vessel);
  ASSERT_EQ(handles.size(), 1U);
  EXPECT_NEAR(handles.front().radius_mm, 1.5, 0.25);
  EXPECT_LT((handles.front().place - Vec3(20, 10, 30)).cwiseProduct(Vec3(1, 0, 1)).norm(), 0.3);
}

TEST(SurfaceHandles, AreAsManyAsTheEulerNumberSays) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(5.0, 40.0), y(5.0, 15.0), z(5.0, 54.0);
  for (int draw = 0; draw < 4; ++draw) {
    SCOPED_TRACE(draw);
    std::vector<Tube> all = {{{4, 10, 4}, {4, 10, 55}, 2.0}};
    for (int k = 0; k < 3 + draw; ++k) {  // each begins where the one before ends
      const Vec3 next(x(random), y(random), z(random));
      all.push_back({all.back().to, next, 2.0});
    }
    const Surface tangle = tubes(all);
    const std::vector<Handle> handles = find_handles(tangle);
    EXPECT_EQ(2 - 2 * static_cast<int>(handles.size()), check_surface(tangle).euler_number);
    for (std::size_t k = 1; k < handles.size(); ++k) {
      EXPECT_LE(handles[k - 1].radius_mm, handles[k].radius_mm);
    }
  }
}

}  // namespace
}  // namespace wireplan::preprocess
