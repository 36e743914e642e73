// Where lines of the tree begin, on lines by hand and on a constructed vessel.
#include <gtest/gtest.h>

#include <algorithm>

#include "preprocess/centerline/branch_start.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

using shapes::depth_in_tube;
using shapes::line_through;

std::vector<Vec3> points_of(const Centerline& line) {
  return {line.points.colwise().begin(), line.points.colwise().end()};
}

/// A trunk of 9 mm radius, from whose top the tree's line turns to the left at z = 90.
std::vector<Branch> known_tree() {
  Centerline line = line_through({Vec3::Zero(), Vec3(0, 0, 90), Vec3(70, 0, 90)}, 9.0);
  for (Eigen::Index k = 0; k < line.points.cols(); ++k) {
    if (line.points(0, k) > 9.0) line.radius(k) = 3.0;
  }
  return {{.line = line}};
}

TEST(BranchStart, IsWhereALineLeavesTheOneThatItRunsAlong) {
  // 78 mm side by side along the trunk, a twentieth of the radius apart.
  const Centerline right = line_through({Vec3(0.4, 0, 8), Vec3(0.4, 0, 86), Vec3(-70, 0, 86)}, 3.0);
  const BranchStart start = find_branch_start(known_tree(), 0, points_of(right));
  EXPECT_EQ(start.parent, 0);
  EXPECT_NEAR(known_tree()[0].line.arc_length(start.at), 86.0, 1.0);
  EXPECT_NEAR(right.points(2, static_cast<Eigen::Index>(start.own_first)), 86.0, 0.5);
  EXPECT_LT(right.points.col(static_cast<Eigen::Index>(start.own_first)).head(2).norm(),
            0.25 * 9.0);
}

TEST(BranchStart, IsOnTheLineBeforeWhereThatGoesOnLonger) {
  // By the grid the trunk's continuation left the right branch, which has turned off below.
  std::vector<Branch> known = known_tree();
  known.push_back({.line = line_through({Vec3(0, 0, 86), Vec3(-70, 0, 86)}, 3.0),
                   .parent = 0,
                   .parent_arc = 86.0});
  known[1].line.radius.head(18).setConstant(9.0);
  const Centerline upper = line_through({Vec3(0, 0, 97), Vec3(0, 0, 160)}, 9.0);
  const BranchStart start = find_branch_start(known, 1, points_of(upper));
  EXPECT_EQ(start.parent, 0);
  EXPECT_NEAR(known[0].line.arc_length(start.at), 90.0, 0.6);
  EXPECT_EQ(start.own_first, 0U);
}

TEST(BranchStart, OfAllArteriesOfATrifurcationIsOnOneLine) {
  std::vector<Branch> known = known_tree();
  known.push_back({.line = line_through({Vec3(0, 0, 88), Vec3(0, -70, 88)}, 3.0),
                   .parent = 0,
                   .parent_arc = 88.0});
  known[1].line.radius.head(18).setConstant(9.0);
  const Centerline third = line_through({Vec3(0, -2, 88), Vec3(-70, -2, 88)}, 3.0);
  const BranchStart start = find_branch_start(known, 1, points_of(third));
  EXPECT_EQ(start.parent, 0);
  EXPECT_NEAR(known[0].line.arc_length(start.at), 88.0, 0.6);
}

TEST(BranchStart, OfRenalsAboveABifurcationIsAtTheirOstia) {
  // Seen from the left leg, the cheapest way to the right renal artery leaves that to the left one
  // at the bifurcation, though both run up the middle of the aorta.
  const auto depth = [](const Vec3& p) {
    const Vec3 fork(0, 0, 0);
    return std::max({depth_in_tube(p, fork, Vec3(0, 0, 110), 9.0),
                     depth_in_tube(p, Vec3(-50, 0, -90), Vec3(2, 0, 4), 5.0),
                     depth_in_tube(p, Vec3(50, 0, -90), Vec3(-2, 0, 4), 5.0),
                     depth_in_tube(p, Vec3(0, 0, 90), Vec3(70, 0, 90), 2.8),
                     depth_in_tube(p, Vec3(0, 0, 86), Vec3(-70, 0, 86), 2.8)});
  };
  const Surface vessel =
      shapes::level_set(depth, Vec3(-72.987, -10.983, -94.981), Vec3(73, 12, 112), 1.0);
  for (const double side : {1.0, -1.0}) {
    const std::vector<Branch> tree = find_tree(vessel, Vec3(47.5 * side, 0, -85.5));
    ASSERT_EQ(tree.size(), 4U);
    for (std::size_t k = 1; k < tree.size(); ++k) {
      const Centerline& parent = tree[static_cast<std::size_t>(tree[k].parent)].line;
      Eigen::Index at = 0;
      (parent.arc_length.array() - tree[k].parent_arc).abs().minCoeff(&at);
      const double z = parent.points(2, at), end = tree[k].line.points.rightCols<1>().z();
      EXPECT_EQ(tree[k].parent, 0) << k;
      // The other leg at the bifurcation, the rest within a radius of 2.8 of the ostia's levels.
      EXPECT_NEAR(z, end < 0.0 ? 0.0 : end < 88.0 ? 86.0 : 90.0, end < 0.0 ? 5.0 : 2.8) << k;
    }
  }
}

}  // namespace
}  // namespace wireplan::preprocess
