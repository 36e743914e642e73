#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <vector>

#include "preprocess/surface/cgal_calls.h"
#include "preprocess/surface/surface.h"
#include "preprocess/surface/surface_repair.h"
#include "tests/messages.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

int count_of(const RepairedSurface& repaired, MendKind kind) {
  return static_cast<int>(std::count_if(repaired.mends.begin(), repaired.mends.end(),
                                        [&](const Mend& mend) { return mend.kind == kind; }));
}

const Mend& mend_of(const RepairedSurface& repaired, MendKind kind) {
  for (const Mend& mend : repaired.mends) {
    if (mend.kind == kind) return mend;
  }
  throw Error("no such mend");
}

/// Without the triangles whose middle is so.
Surface without(const Surface& s, const std::function<bool(const Vec3&)>& drop) {
  Surface kept = s;
  Eigen::Index column = 0;
  for (const auto& t : s.triangles.colwise()) {
    const Vec3 middle = (s.vertices.col(t(0)) + s.vertices.col(t(1)) + s.vertices.col(t(2))) / 3.0;
    if (!drop(middle)) kept.triangles.col(column++) = t;
  }
  kept.triangles.conservativeResize(3, column);
  return kept;
}

/// Tube along z from 0 to `length`, without its caps.
Surface open_tube(double radius, double length, double edge) {
  return without(shapes::straight_tube(radius, length, edge), [&](const Vec3& middle) {
    return middle.z() < 1e-9 || middle.z() > length - 1e-9;
  });
}

void add_triangle(Surface& s, const Eigen::Vector3i& triangle) {
  s.triangles.conservativeResize(3, s.triangles.cols() + 1);
  s.triangles.col(s.triangles.cols() - 1) = triangle;
}

int add_vertex(Surface& s, const Vec3& p) {
  s.vertices.conservativeResize(3, s.vertices.cols() + 1);
  s.vertices.col(s.vertices.cols() - 1) = p;
  return static_cast<int>(s.vertices.cols()) - 1;
}

/// Band of triangles between two rings of vertices, ring k of `a` opposite to ring k of `b`.
void join_rings(Surface& s, const std::vector<int>& a, const std::vector<int>& b) {
  for (std::size_t k = 0; k < a.size(); ++k) {
    const std::size_t next = (k + 1) % a.size();
    add_triangle(s, {a[k], a[next], b[k]});
    add_triangle(s, {a[next], b[next], b[k]});
  }
}

std::vector<int> add_ring(Surface& s, double radius, double z, int sides) {
  std::vector<int> ring;
  for (int k = 0; k < sides; ++k) {
    const double angle = 2.0 * kPi * k / sides;
    ring.push_back(add_vertex(s, {radius * std::cos(angle), radius * std::sin(angle), z}));
  }
  return ring;
}

constexpr int kSides = 24;

/// Open tube of rings 1 mm apart; its first and last rings.
struct RingTube {
  Surface surface;
  std::vector<int> first, last;
};

RingTube ring_tube(double radius, int length) {
  RingTube tube;
  tube.surface.vertices.resize(3, 0);
  tube.surface.triangles.resize(3, 0);
  for (int z = 0; z <= length; ++z) {
    const std::vector<int> ring = add_ring(tube.surface, radius, z, kSides);
    if (z > 0) join_rings(tube.surface, tube.last, ring);
    if (z == 0) tube.first = ring;
    tube.last = ring;
  }
  return tube;
}

double ring_volume(double radius, double length) {  // of a prism of kSides
  return 0.5 * kSides * radius * radius * std::sin(2.0 * kPi / kSides) * length;
}

TEST(SurfaceRepair, LeavesASoundSurfaceAsItIs) {
  const Surface tube = shapes::bend_tube(3.0, 12.0, kPi, 10.0, 5.0, 0.8);
  const RepairedSurface repaired = repair_surface(tube, "x");
  EXPECT_TRUE(repaired.mends.empty());
  EXPECT_EQ(repaired.surface.triangles.cols(), tube.triangles.cols());
  EXPECT_NEAR(signed_volume(repaired.surface), signed_volume(tube), 1e-9);
}

TEST(SurfaceRepair, CapsOpenEnds) {
  const Surface closed = shapes::straight_tube(3.0, 20.0, 0.8);
  const RepairedSurface repaired = repair_surface(open_tube(3.0, 20.0, 0.8), "x");
  EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
  EXPECT_EQ(count_of(repaired, MendKind::kOpenEnd), 2);
  EXPECT_NEAR(mend_of(repaired, MendKind::kOpenEnd).size, 6.0, 0.1);
  // The ends are flat: the cap lies where it was cut.
  EXPECT_NEAR(signed_volume(repaired.surface), signed_volume(closed), 1e-6);
}

TEST(SurfaceRepair, ClosesAnUnevenEndByAFlatCapBeyondIt) {
  // Cut obliquely and raggedly, triangle by triangle.
  const Surface closed = shapes::straight_tube(3.0, 20.0, 0.8);
  const Surface ragged =
      without(closed, [](const Vec3& p) { return p.z() > 15.0 + 0.3 * p.x() || p.z() < 1e-9; });
  const RepairedSurface repaired = repair_surface(ragged, "x");
  EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
  EXPECT_EQ(count_of(repaired, MendKind::kOpenEnd), 2);
  // The wall stays: all of it lies on the tube, and below the caps nothing is added.
  const double area = 0.5 * kPi * 9.0;
  EXPECT_GT(signed_volume(repaired.surface), 2.0 * area * 14.5);
  EXPECT_LT(signed_volume(repaired.surface), 2.0 * area * 16.5);
}

TEST(SurfaceRepair, ClosesASmallHoleAndTellsWhere) {
  const Surface closed = shapes::straight_tube(3.0, 20.0, 0.6);
  const Vec3 place(3.0, 0.0, 10.0);
  const Surface holed = without(closed, [&](const Vec3& p) { return (p - place).norm() < 0.8; });
  ASSERT_GT(check_surface(holed).open_edges, 6);
  const RepairedSurface repaired = repair_surface(holed, "x");
  EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
  ASSERT_EQ(count_of(repaired, MendKind::kHole), 1);
  const Mend& hole = mend_of(repaired, MendKind::kHole);
  EXPECT_LT((hole.place - place).norm(), 0.5);
  EXPECT_NEAR(hole.size, 2.0, 1.0);
  // As round as the tube: a flat patch over a hole 2 mm wide would take some 0.3 mm^3.
  EXPECT_NEAR(signed_volume(repaired.surface), signed_volume(closed), 0.2);
}

TEST(SurfaceRepair, RefusesAWideHoleWithPlaceAndWidth) {
  const Vec3 place(3.0, 0.0, 10.0);
  const Surface holed = without(shapes::straight_tube(3.0, 20.0, 0.6),
                                [&](const Vec3& p) { return (p - place).norm() < 2.5; });
  const std::string message = message_of([&] { repair_surface(holed, "aorta.stl"); });
  EXPECT_NE(message.find("aorta.stl: a hole in the wall at (2."), std::string::npos) << message;
  EXPECT_NE(message.find("10.0) mm is"), std::string::npos) << message;
  EXPECT_NE(message.find("mesh editor"), std::string::npos) << message;
}

TEST(SurfaceRepair, TurnsAPartThatIsFlipped) {
  Surface mixed = shapes::straight_tube(3.0, 20.0, 0.8);
  const double volume = signed_volume(mixed);
  int flipped = 0;
  for (Eigen::Index t = 0; t < mixed.triangles.cols(); t += 4, ++flipped) {
    std::swap(mixed.triangles(0, t), mixed.triangles(1, t));
  }
  const RepairedSurface repaired = repair_surface(mixed, "x");
  EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
  EXPECT_EQ(mend_of(repaired, MendKind::kTurned).count, flipped);
  EXPECT_NEAR(signed_volume(repaired.surface), volume, 1e-9);
}

TEST(SurfaceRepair, TurnsTheFewerOfAPieceThoughTheyComeFirst) {
  const Surface sound = shapes::straight_tube(3.0, 20.0, 1.0);
  for (Surface tube : {sound, shapes::inside_out(sound)}) {
    tube.triangles.col(0).tail<2>().reverseInPlace();
    const RepairedSurface repaired = repair_surface(tube, "x");
    EXPECT_EQ(mend_of(repaired, MendKind::kTurned).count, 1);
    EXPECT_EQ(count_of(repaired, MendKind::kInward), signed_volume(tube) < 0.0 ? 1 : 0);
  }
}

TEST(SurfaceRepair, TellsThatAllNormalsPointedInward) {
  const Surface tube = shapes::straight_tube(3.0, 20.0, 0.8);
  const RepairedSurface repaired = repair_surface(shapes::inside_out(tube), "x");
  EXPECT_EQ(mend_of(repaired, MendKind::kInward).count, tube.triangles.cols());
  EXPECT_NEAR(signed_volume(repaired.surface), signed_volume(tube), 1e-9);
}

TEST(SurfaceRepair, DropsDuplicateAndDegenerateTriangles) {
  Surface tube = shapes::straight_tube(3.0, 20.0, 0.8);
  const double volume = signed_volume(tube);
  for (int t = 0; t < 5; ++t) {
    const Eigen::Vector3i copy = tube.triangles.col(10 * t);
    add_triangle(tube, {copy(1), copy(2), copy(0)});
    add_triangle(tube, {copy(1), copy(0), copy(2)});  // and turned round
    add_triangle(tube, {copy(0), copy(1), copy(1)});
  }
  const RepairedSurface repaired = repair_surface(tube, "x");
  EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
  EXPECT_EQ(mend_of(repaired, MendKind::kDuplicate).count, 10);
  EXPECT_EQ(mend_of(repaired, MendKind::kDegenerate).count, 5);
  EXPECT_NEAR(signed_volume(repaired.surface), volume, 1e-9);
}

TEST(SurfaceRepair, DropsAFinAndASheetAcrossTheLumen) {
  // A fin that stands out from one edge, and a disc that closes the lumen half way.
  RingTube tube = ring_tube(4.0, 20);
  Surface& s = tube.surface;
  const int out = add_vertex(s, {6.0, 0.5, 0.5});
  add_triangle(s, {0, kSides, out});
  const int middle = add_vertex(s, {0.0, 0.0, 10.0});
  for (int k = 0; k < kSides; ++k) {
    add_triangle(s, {10 * kSides + k, 10 * kSides + (k + 1) % kSides, middle});
  }
  ASSERT_EQ(check_surface(s).non_manifold_edges, kSides + 1);
  const RepairedSurface repaired = repair_surface(s, "x");
  EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
  EXPECT_EQ(count_of(repaired, MendKind::kFin), 2);
  EXPECT_EQ(count_of(repaired, MendKind::kOpenEnd), 2);
  EXPECT_NEAR(signed_volume(repaired.surface), ring_volume(4.0, 20.0), 1e-6);
}

TEST(SurfaceRepair, PartsWhatTouchesInAnEdgeOrAPoint) {
  const Surface large = shapes::box({0, 0, 0}, {4, 4, 4});
  for (const double up : {0.0, 4.0}) {  // an edge in common, or a corner alone
    SCOPED_TRACE(up);
    Surface both = shapes::joined(large, shapes::box({4, 4, up}, {6, 6, up + 4}));
    for (int& v : both.triangles.reshaped()) {
      if (v < 8) continue;
      for (int k = 0; k < 8; ++k) {
        if (both.vertices.col(k) == both.vertices.col(v)) v = k;
      }
    }
    const SurfaceCheck before = check_surface(both);
    ASSERT_EQ(before.non_manifold_edges, up == 0.0 ? 1 : 0);
    const RepairedSurface repaired = repair_surface(both, "x");
    EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
    EXPECT_EQ(count_of(repaired, MendKind::kContact), 1);
    EXPECT_EQ(count_of(repaired, MendKind::kPiece), 1);
    EXPECT_NEAR(signed_volume(repaired.surface), 64.0, 3.0);  // less what parting takes
  }
}

TEST(SurfaceRepair, UnitesClosedPiecesThatOverlap) {
  // A branch whose root stands in the trunk, one tenth of its area; and a crumb beside them.
  const Surface trunk = shapes::straight_tube(5.0, 60.0, 1.5);
  Surface branch = shapes::straight_tube(1.5, 20.0, 0.8);
  for (auto p : branch.vertices.colwise()) p = Vec3(p.z(), p.x(), p.y() + 30.0);
  const Surface crumb = shapes::box({20, 20, 20}, {21, 21, 21});
  const RepairedSurface repaired =
      repair_surface(shapes::joined(shapes::joined(branch, crumb), trunk), "x");
  EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
  EXPECT_EQ(count_of(repaired, MendKind::kUnited), 1);
  EXPECT_EQ(count_of(repaired, MendKind::kPiece), 1);
  // What of the branch lies outside: its axis leaves the trunk at 5 mm.
  const double trunk_volume = signed_volume(trunk), branch_volume = signed_volume(branch);
  EXPECT_NEAR(signed_volume(repaired.surface), trunk_volume + 0.75 * branch_volume,
              0.02 * branch_volume);
  EXPECT_TRUE(locate_point(repaired.surface, Vec3(18, 0, 30)).inside);
}

/// The same with its triangles and vertices in another order.
Surface reordered(const Surface& s, const std::vector<int>& vertices,
                  const std::vector<int>& triangles) {
  std::vector<int> number(vertices.size());
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    number[static_cast<std::size_t>(vertices[k])] = static_cast<int>(k);
  }
  Surface result{.vertices = s.vertices(Eigen::all, vertices),
                 .triangles = s.triangles(Eigen::all, triangles)};
  for (int& v : result.triangles.reshaped()) v = number[static_cast<std::size_t>(v)];
  return result;
}

/// 0 to n-1 so that every (n / 20)th is one of the first of `sorted`.
std::vector<int> first_at_each_step(const std::vector<int>& sorted) {
  const std::size_t step = sorted.size() / 20;
  std::vector<int> order(sorted.size());
  std::size_t first = 0, other = (sorted.size() + step - 1) / step;
  for (std::size_t k = 0; k < order.size(); ++k) {
    order[k] = sorted[k % step == 0 ? first++ : other++];
  }
  return order;
}

/// Whatever order a program writes its triangles in: as they are, backward, and so that who looks
/// at every n / 20th sees the lowest alone (as in tubes of 20 lines of vertices), or the highest.
std::vector<Surface> in_several_orders(const Surface& s) {
  std::vector<int> vertices(static_cast<std::size_t>(s.vertices.cols())),
      triangles(static_cast<std::size_t>(s.triangles.cols()));
  std::iota(vertices.begin(), vertices.end(), 0);
  std::iota(triangles.begin(), triangles.end(), 0);
  std::vector<Surface> orders = {s};
  const auto height = [&](int t) { return s.vertices(2, s.triangles.col(t)).sum(); };
  std::stable_sort(vertices.begin(), vertices.end(),
                   [&](int a, int b) { return s.vertices(2, a) < s.vertices(2, b); });
  std::stable_sort(triangles.begin(), triangles.end(),
                   [&](int a, int b) { return height(a) < height(b); });
  for (int turn = 0; turn < 2; ++turn) {
    orders.push_back(reordered(s, vertices, triangles));
    orders.push_back(reordered(s, first_at_each_step(vertices), first_at_each_step(triangles)));
    std::reverse(vertices.begin(), vertices.end());
    std::reverse(triangles.begin(), triangles.end());
  }
  return orders;
}

TEST(SurfaceRepair, UnitesAJunctionInWhateverOrderItsTrianglesCome) {
  // A branch whose root lies on the trunk's axis, as thick as the trunk or thinner, larger than it
  // or not: never a crumb, nor one of them the outer skin of the other.
  for (const double radius : {2.0, 5.0}) {
    for (const double length : {20.0, 40.0}) {
      const Surface trunk = shapes::straight_tube(5.0, 30.0, 1.5);
      const Surface straight = shapes::straight_tube(radius, length, 1.2);
      double expected = 0.0;
      for (const Surface& order : in_several_orders(straight)) {
        SCOPED_TRACE(testing::Message() << radius << ' ' << length);
        Surface branch = order;
        for (auto p : branch.vertices.colwise()) p = Vec3(p.z() + 0.1, p.x() + 0.07, p.y() + 15.3);
        const RepairedSurface repaired = repair_surface(shapes::joined(branch, trunk), "x");
        EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
        EXPECT_EQ(count_of(repaired, MendKind::kUnited), 1);
        EXPECT_EQ(repaired.mends.size(), 1U);
        EXPECT_TRUE(locate_point(repaired.surface, Vec3(length - 1.0, 0, 15)).inside);
        EXPECT_TRUE(locate_point(repaired.surface, Vec3(0, 0, 1)).inside);
        const double volume = signed_volume(repaired.surface);
        EXPECT_LT(volume, signed_volume(trunk) + (length - 3.0) / length * signed_volume(straight));
        EXPECT_GT(volume, signed_volume(trunk) + (length - 6.0) / length * signed_volume(straight));
        if (expected == 0.0) expected = volume;
        EXPECT_NEAR(volume, expected, 1e-3 * expected);
      }
    }
  }
}

TEST(SurfaceRepair, UnitesAPieceThatOverlapsASmallerOneAlone) {
  // Trunk, a thin stem, and a branch, larger than the stem, at its end: the branch is looked at
  // before the stem is part of the vessel.
  const Surface trunk = shapes::straight_tube(5.0, 40.0, 1.5);
  Surface stem = shapes::straight_tube(1.5, 20.0, 0.8),
          branch = shapes::straight_tube(2.5, 20.0, 0.8);
  for (auto p : stem.vertices.colwise()) p = Vec3(p.z(), p.x(), p.y() + 20.0);
  for (auto p : branch.vertices.colwise()) p = Vec3(p.y() + 18.0, p.z() - 1.0, p.x() + 20.1);
  ASSERT_GT(signed_volume(branch), signed_volume(stem));
  const RepairedSurface repaired =
      repair_surface(shapes::joined(shapes::joined(trunk, stem), branch), "x");
  EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
  EXPECT_EQ(count_of(repaired, MendKind::kUnited), 2);
  EXPECT_TRUE(repaired.dropped.empty());
  EXPECT_TRUE(locate_point(repaired.surface, Vec3(18, 17, 20)).inside);
}

TEST(SurfaceRepair, AUnionDoesNotDependOnMemory) {
  // A tube through another: of the patches that it cuts, CGAL keeps three, in an order of its own.
  const Surface trunk = shapes::straight_tube(5.0, 60.0, 1.5);
  Surface through = shapes::straight_tube(1.5, 40.0, 0.8);
  for (auto p : through.vertices.colwise()) p = Vec3(p.z() - 20.03, p.x(), p.y() + 30.01);
  const std::optional<Surface> expected = union_of(trunk, through);
  ASSERT_TRUE(expected);
  ASSERT_GT(expected->triangles.cols(), 2000);
  // The numbers follow from places alone.
  for (Eigen::Index k = 1; k < expected->vertices.cols(); ++k) {
    const auto a = expected->vertices.col(k - 1), b = expected->vertices.col(k);
    ASSERT_TRUE(std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end())) << k;
  }
  std::mt19937_64 random(7);
  for (int run = 0; run < 12; ++run) {
    SCOPED_TRACE(run);
    // Another heap: blocks of many sizes, every other one free again.
    std::vector<std::vector<char>> blocks(20000);
    for (std::vector<char>& block : blocks) block.resize(16 + random() % 3000);
    for (std::size_t k = run % 2; k < blocks.size(); k += 2) std::vector<char>().swap(blocks[k]);
    const std::optional<Surface> united = union_of(trunk, through);
    ASSERT_TRUE(united);
    EXPECT_TRUE(united->vertices == expected->vertices);
    EXPECT_TRUE(united->triangles == expected->triangles);
  }
}

TEST(SurfaceRepair, APointInADroppedPieceIsToldWithWhereItComesNear) {
  // A branch that ends 2 mm beside the trunk: it overlaps nothing, and is dropped.
  const Surface trunk = shapes::straight_tube(5.0, 60.0, 1.5);
  Surface branch = shapes::straight_tube(1.5, 20.0, 0.8);
  for (auto p : branch.vertices.colwise()) p = Vec3(p.z() + 7.0, p.x(), p.y() + 30.0);
  const RepairedSurface repaired = repair_surface(shapes::joined(branch, trunk), "x");
  EXPECT_EQ(count_of(repaired, MendKind::kPiece), 1);
  ASSERT_EQ(repaired.dropped.size(), 1U);
  const std::string told = tell_dropped(repaired.dropped, repaired.surface, Vec3(20, 0, 30));
  EXPECT_NE(told.find("lies in a piece of the surface, 20 mm long, that is not joined with the "
                      "vessel and was dropped: it comes within 2"),
            std::string::npos)
      << told;
  EXPECT_NE(told.find("join the two there"), std::string::npos) << told;
  EXPECT_EQ(tell_dropped(repaired.dropped, repaired.surface, Vec3(20, 20, 30)), "");
}

TEST(SurfaceRepair, TakesTheInnerSkinOfAWallWhoseSkinsHangTogether) {
  RingTube inner = ring_tube(3.0, 30), outer = ring_tube(4.0, 30);
  Surface wall = shapes::joined(shapes::inside_out(inner.surface), outer.surface);
  const auto shift = static_cast<int>(inner.surface.vertices.cols());
  for (int& v : outer.first) v += shift;
  for (int& v : outer.last) v += shift;
  join_rings(wall, inner.last, outer.last);
  join_rings(wall, outer.first, inner.first);
  ASSERT_EQ(check_surface(wall).open_edges, 0);
  const RepairedSurface repaired = repair_surface(wall, "x");
  EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
  EXPECT_NEAR(mend_of(repaired, MendKind::kOuterSkin).size, 1.0, 0.05);
  EXPECT_EQ(count_of(repaired, MendKind::kOpenEnd), 2);
  EXPECT_NEAR(signed_volume(repaired.surface), ring_volume(3.0, 30.0), 1e-6);
}

TEST(SurfaceRepair, TakesTheInnerOfTwoSkinsThatAreApart) {
  // Open, closed within each other, and closed with their caps in one plane.
  for (const double beyond : {-1.0, 1.0, 0.0}) {
    SCOPED_TRACE(beyond);
    const bool open = beyond < 0.0;
    const Surface inner = open ? open_tube(3.0, 30.0, 0.9) : shapes::straight_tube(3.0, 30.0, 0.9);
    Surface outer =
        open ? open_tube(4.0, 30.0, 1.0) : shapes::straight_tube(4.0, 30.0 + 2.0 * beyond, 1.0);
    if (!open) outer.vertices.row(2).array() -= beyond;
    const RepairedSurface repaired = repair_surface(shapes::joined(outer, inner), "x");
    EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
    EXPECT_NEAR(mend_of(repaired, MendKind::kOuterSkin).size, 1.0, 0.1);
    EXPECT_NEAR(signed_volume(repaired.surface),
                signed_volume(shapes::straight_tube(3.0, 30.0, 0.9)), 1e-6);
  }
}

TEST(SurfaceRepair, AVesselThatRunsBackBesideItselfHasOneSkin) {
  // Two parallel legs 2 mm apart: they face each other, as the inside of a wall does.
  const Surface hairpin = shapes::bend_tube(2.0, 3.0, kPi, 40.0, 40.0, 0.8);
  const RepairedSurface repaired = repair_surface(hairpin, "x");
  EXPECT_TRUE(repaired.mends.empty());
  EXPECT_EQ(repaired.surface.triangles.cols(), hairpin.triangles.cols());
}

TEST(SurfaceRepair, RefusesASurfaceOfOneSide) {
  // A Moebius strip of quadrilaterals, each of two triangles.
  Surface strip;
  strip.vertices.resize(3, 0);
  strip.triangles.resize(3, 0);
  constexpr int kParts = 30;
  for (int k = 0; k < kParts; ++k) {
    const double angle = 2.0 * kPi * k / kParts;
    const Vec3 out(std::cos(angle), std::sin(angle), 0.0);
    const Vec3 across = std::cos(angle / 2) * out + std::sin(angle / 2) * Vec3::UnitZ();
    add_vertex(strip, 10.0 * out + 2.0 * across);
    add_vertex(strip, 10.0 * out - 2.0 * across);
  }
  for (int k = 0; k < kParts; ++k) {
    const bool last = k + 1 == kParts;  // there the strip is turned over
    const int a = 2 * k, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    add_triangle(strip, {a, b, c});
    add_triangle(strip, {b, d, c});
  }
  const std::string message = message_of([&] { repair_surface(strip, "strip.stl"); });
  EXPECT_NE(message.find("strip.stl: the surface has one side only"), std::string::npos) << message;
  EXPECT_NE(message.find("mm its normals"), std::string::npos) << message;
}

TEST(SurfaceRepair, MakesAFoldedPlaceAnew) {
  // Two vertices of the wall, 1.4 mm apart, in each other's place: their triangles cross.
  Surface tube = shapes::straight_tube(3.0, 20.0, 0.8);
  const double volume = signed_volume(tube);
  const auto nearest = [&](const Vec3& p) {
    Eigen::Index at = 0;
    (tube.vertices.colwise() - p).colwise().norm().minCoeff(&at);
    return at;
  };
  tube.vertices.col(nearest({3.0, 0.0, 10.0})).swap(tube.vertices.col(nearest({3.0, 0.0, 11.4})));
  ASSERT_GT(check_surface(tube).self_intersections, 0);
  const RepairedSurface repaired = repair_surface(tube, "x");
  EXPECT_TRUE(is_sound(check_surface(repaired.surface)));
  EXPECT_EQ(count_of(repaired, MendKind::kIntersection), 1);
  EXPECT_NEAR(signed_volume(repaired.surface), volume, 0.01 * volume);
}

TEST(SurfaceRepair, AUnitThatCannotBeIsRefused) {
  Surface tube = shapes::straight_tube(3.0, 20.0, 0.8);
  tube.vertices *= 1e-3;
  EXPECT_NE(message_of([&] {
              repair_surface(tube, "x");
            }).find("x: the surface is 0.02 mm long in the unit stated, expected 1 to 5"),
            std::string::npos);
}

TEST(SurfaceRepair, WhatIsNothingButFinsIsRefused) {
  Surface flake = shapes::box({0, 0, 0}, {2, 2, 2});
  flake.triangles = Eigen::Vector3i(0, 1, 1).replicate(1, 4).eval();
  EXPECT_NE(message_of([&] { repair_surface(flake, "x"); }).find("x: nothing is left"),
            std::string::npos);
}

TEST(SurfaceRepair, WhatIsFlatInEveryTriangleIsRefused) {
  Surface needle;
  needle.vertices.resize(3, 4);
  needle.vertices.transpose() << 0, 0, 0, 10, 0, 0, 20, 0, 0, 30, 0, 1e-30;
  needle.triangles.resize(3, 4);
  needle.triangles.transpose() << 0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3;
  EXPECT_EQ(message_of([&] { repair_surface(needle, "x"); }),
            "x: the triangles near (15.0, 0.0, 0.0) mm enclose nothing, expected the wall of a "
            "vessel; export the surface again");
}

TEST(SurfaceRepair, TellsWhatWasMendedInSentences) {
  const std::vector<Mend> mends = {
      {.kind = MendKind::kOpenEnd, .count = 12, .place = {1, 2, 3}, .size = 6.0},
      {.kind = MendKind::kOpenEnd, .count = 14, .place = {-1, 2, 30}, .size = 4.25},
      {.kind = MendKind::kTurned, .count = 7, .place = {0, 0, 5}}};
  EXPECT_EQ(tell_mends(mends),
            (std::vector<std::string>{
                "7 triangles turned whose normals disagreed with their neighbours': at (0.0, 0.0, "
                "5.0) mm",
                "2 open ends capped: 6 mm wide at (1.0, 2.0, 3.0); 4.25 mm wide at (-1.0, 2.0, "
                "30.0) mm"}));
  EXPECT_EQ(name_of(MendKind::kIntersection), "cutting triangles");
}

// ---- Every real surface -----------------------------------------------------------------------

/// A real surface and what must come of it.
struct RealFile {
  const char *path, *unit;
  double volume_mm3;         // of the lumen, within 1 %
  int holes, ends;           // closed, capped
  std::set<MendKind> mends;  // that it needs besides
  std::vector<Vec3> inside;  // points known to lie in the vessel
};

TEST(RealSurfaceRepair, EverySurfaceGivesAValidVessel) {
  const char* variable = std::getenv("WIREPLAN_DATA");
  const fs::path folder =
      variable ? fs::path(variable) : fs::path(WIREPLAN_SOURCE_DIR) / "../shared/data";
  // Volumes of closed files as their descriptions state them, of open ones by the frusta between
  // the stated ends where there are some, else as measured. Points as the descriptions state them.
  const std::vector<RealFile> files = {
      {"surface-arch-to-cerebral/vessel_architecture_collision.obj",
       "mm",
       317000.0,
       0,
       0,
       {MendKind::kInward},
       {{-33.6, 66.5, 9.5}, {-37.7, 10.2, 14.1}, {-601.3, -3.9, 4.7}}},
      {"surface-arch-to-cerebral/mechanical_thrombectomy_collision_FIX_REMESH.obj",
       "mm",
       354900.0,
       1,
       4,
       {MendKind::kInward, MendKind::kDegenerate, MendKind::kFin, MendKind::kContact},
       {}},
      {"surface-coronary-left/m1_fluid.stl", "mm", 1530.0, 0, 0, {}, {}},
      {"mra-aorta-iliac-vmtk/aorta-surface.vtp", "mm", 13184.0, 0, 0, {MendKind::kInward}, {}},
      {"mra-aorta-iliac-vmtk/aorta-surface-open-ends.stl",
       "mm",
       12452.0,
       0,
       3,
       {MendKind::kInward},
       {{221.0, 176.8, 21.0}}},
      {"phantom-abdominal-aorta-sofa/AbdominalAorta.stl",
       "m",
       96800.0,
       1,
       6,
       {MendKind::kOuterSkin, MendKind::kFin, MendKind::kPiece, MendKind::kIntersection},
       {{-51.0, 134.0, 4.0}, {1.0, -84.0, 1.0}}}};
  int found = 0;
  for (const RealFile& file : files) {
    SCOPED_TRACE(file.path);
    if (!fs::exists(folder / file.path)) continue;
    ++found;
    const RepairedSurface repaired = read_surface(folder / file.path, file.unit, "LPS");
    const SurfaceCheck check = check_surface(repaired.surface);
    EXPECT_TRUE(is_sound(check));
    EXPECT_NEAR(check.volume_mm3, file.volume_mm3, 0.01 * file.volume_mm3);
    EXPECT_EQ(count_of(repaired, MendKind::kHole), file.holes);
    EXPECT_EQ(count_of(repaired, MendKind::kOpenEnd), file.ends);
    std::set<MendKind> others;
    for (const Mend& mend : repaired.mends) others.insert(mend.kind);
    others.erase(MendKind::kHole);
    others.erase(MendKind::kOpenEnd);
    EXPECT_EQ(others, file.mends);
    for (const Vec3& point : file.inside) {
      EXPECT_TRUE(locate_point(repaired.surface, point).inside) << point.transpose();
    }
  }
  if (found == 0) GTEST_SKIP() << "real data is absent; set WIREPLAN_DATA";
}

}  // namespace
}  // namespace wireplan::preprocess
