// Forks at which the way comes out of a branch, or at which no vessel goes on: turns, levels and
// names by hand.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "plan/anatomy/branch_names.h"
#include "plan/anatomy/passage.h"
#include "plan/anatomy/projection.h"
#include "tests/plan/vessel_trees.h"

namespace wireplan::plan {
namespace {

using preprocess::Branch;
using shapes::line_through;
using trees::into_branch;
using trees::right_renal_way;
using trees::side_branch;

/// Out of an arm of 4.1 mm radius, at an elevation to the left of a trunk of 10 mm, whose axis it
/// meets at z = 150; the tree's line goes on down, and up is a branch.
struct ArmAndTrunk {
  double ostium;           // along the line
  std::vector<Vec3> down;  // corners
  std::vector<Branch> tree;

  explicit ArmAndTrunk(double elevation) {
    const double c = std::cos(elevation), s = std::sin(elevation), level = 150.0 + 10.0 * s / c;
    down = {Vec3(10.0 + 60.0 * c, 0, level + 60.0 * s), Vec3(10, 0, level), Vec3(0, 0, level)};
    tree.push_back({.line = wide(Vec3::Zero())});
    tree.push_back({.line = line_through({down.back(), Vec3(0, 0, 250)}, 10.0),
                    .parent = 0,
                    .parent_arc = 70.0});
    tree.push_back({.line = side_branch(60.0, -60.0, 3.0, 0.0).line,
                    .parent = 0,
                    .parent_arc = 70.0 + level - 60.0});
  }
  /// Down or up the trunk to there; the spheres grow in the trunk.
  Centerline wide(const Vec3& end) const {
    std::vector<Vec3> corners = down;
    corners.push_back(end);
    Centerline line = line_through(corners, 10.0);
    for (Eigen::Index k = 0; line.arc_length(k) < 70.0; ++k) {
      line.radius(k) = std::max(4.1, line.arc_length(k) - 60.0);
    }
    return line;
  }
};

TEST(Junctions, AWayOutOfABranchTurnsIntoTheVesselThatItEnters) {
  for (const double elevation : {0.0, 40.0, -30.0}) {
    for (const bool up : {false, true}) {
      SCOPED_TRACE(testing::Message() << elevation << (up ? " up" : " down"));
      const ArmAndTrunk arm(elevation * kRadPerDeg);
      const Vec3 end(0, 0, up ? 240 : 30);
      const Centerline way = arm.wide(end);
      const auto found = find_junctions(simulate::Way(way, arm.tree));
      ASSERT_EQ(found.size(), up ? 1u : 2u);
      const Junction& entry = found[0];
      EXPECT_TRUE(entry.taken && entry.entered);
      EXPECT_EQ(entry.branch, up ? 1 : 0);
      EXPECT_NEAR(entry.level, 70.0, 0.6);  // a point of the line
      EXPECT_NEAR(entry.arc, 60.0, 0.6);
      EXPECT_NEAR(turn_of(entry) / kRadPerDeg, up ? 90.0 + elevation : 90.0 - elevation, 0.5);
      EXPECT_EQ(leaving_name(arm.tree, entry),
                up ? "the wider vessel (branch 2)" : "the wider vessel (branch 1)");
      EXPECT_EQ(trunk_name(arm.tree, entry), "branch 1");
      const View view = find_projections(entry.trunk_direction, entry.branch_direction).best.view;
      EXPECT_NEAR(view.rotation, 0.0, 0.01);
      EXPECT_NEAR(view.tilt, 0.0, 0.01);
      const Corner bend = find_sharpest_bend(way, found);
      EXPECT_NEAR(bend.angle + turn_of(entry), kPi, 0.02);
      EXPECT_EQ(bend.arc, entry.level);
      EXPECT_TRUE(up || (!found[1].taken && found[1].branch == 2));
    }
  }
}

TEST(BranchNames, ALineThatEntersTheAortaHasANameForEach) {
  std::vector<Branch> tree = ArmAndTrunk(0.0).tree;
  name_branches(tree, {"aorta", Vec3(0, 0, 80)}, {{"arm", Vec3(60, 0, 150)}}, {});
  EXPECT_EQ(branch_name(tree, 0, 30.0), "arm (branch 1)");
  EXPECT_EQ(branch_name(tree, 0, 90.0), "aorta (branch 1)");
  EXPECT_EQ(branch_name(tree, 0), "arm, then aorta (branch 1)");
  // In the other order of places, and of a line that goes from the aorta into a renal artery.
  for (const bool first : {true, false}) {
    std::vector<Branch> other = {{.line = right_renal_way(3.0)},
                                 {.line = line_through({Vec3(0, 0, 100), Vec3(0, 0, 200)}, 10.0),
                                  .parent = 0,
                                  .parent_arc = 100.0}};
    const NamedPlace aorta{"aorta", Vec3(0, 0, 50)}, renal{"renal", Vec3(-40, 0, 100)};
    name_branches(other, first ? aorta : renal, {first ? renal : aorta}, {});
    EXPECT_EQ(branch_name(other, 0), "aorta, then renal (branch 1)");
    EXPECT_EQ(branch_name(other, 0, 100.0), "aorta (branch 1)");
    EXPECT_EQ(branch_name(other, 0, 120.0), "renal (branch 1)");
  }
}

/// From z = 0 up a trunk to z = 100, and on in a direction.
Centerline forked_way(const Vec3& onward, double before, double beyond) {
  Centerline line =
      line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(0, 0, 100) + 80.0 * onward}, beyond);
  for (Eigen::Index k = 0; line.arc_length(k) < 100.0; ++k) line.radius(k) = before;
  return line;
}

TEST(Junctions, AWayTurnsIntoEachOfThreeArteriesInWhichATrunkEnds) {
  const double s = std::sin(40.0 * kRadPerDeg), c = std::cos(40.0 * kRadPerDeg);
  const std::vector<Vec3> onward = {Vec3(s, 0, c), Vec3(-s, 0, c), Vec3(0, -s, c)};
  std::vector<Branch> tree = {{.line = forked_way(onward[0], 10.0, 6.0)}};
  for (const std::size_t k : {1u, 2u}) {
    Branch branch{.line = line_through({Vec3(0, 0, 100), Vec3(0, 0, 100) + 80.0 * onward[k]}, 6.0),
                  .parent = 0,
                  .parent_arc = 100.0};
    branch.line.radius.head(15).setConstant(7.0);
    tree.push_back(branch);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    SCOPED_TRACE(k);
    const auto found = find_junctions(simulate::Way(forked_way(0.7 * onward[k], 10.0, 6.0), tree));
    const auto taken = [](const Junction& junction) { return junction.taken; };
    ASSERT_EQ(std::count_if(found.begin(), found.end(), taken), 1);
    const Junction& turn = *std::find_if(found.begin(), found.end(), taken);
    EXPECT_EQ(turn.branch, static_cast<int>(k));
    EXPECT_NEAR(turn_of(turn) / kRadPerDeg, 40.0, 0.5);
    EXPECT_NEAR(turn.level, 100.0, 5.0);  // where it leaves the spheres of the first
    std::vector<Branch> named = tree;
    name_branches(named, {"aim", 60.0 * onward[k] + Vec3(0, 0, 100)}, {}, {});
    EXPECT_EQ(leaving_name(named, turn), "aim (branch " + std::to_string(k + 1) + ")");
    EXPECT_EQ(trunk_name(named, turn), "branch 1") << "the trunk is none of the three";
    const View view = find_projections(turn.trunk_direction, turn.branch_direction).best.view;
    EXPECT_NEAR(view.rotation / kRadPerDeg, k == 2 ? 90.0 : 0.0, 0.5);
  }
}

TEST(Junctions, AShortStemComesBeforeTheBranchThatLeavesIt) {
  const double s = std::sin(40.0 * kRadPerDeg), c = std::cos(40.0 * kRadPerDeg);
  const Vec3 top(0, 0, 100), stem(s, 0, c);
  for (const double stem_length : {10.0, 11.0, 30.0}) {
    SCOPED_TRACE(stem_length);
    std::vector<Branch> tree = {{.line = forked_way(stem, 10.0, 9.0)}};
    const Branch other{.line = line_through({top, top + 80.0 * Vec3(-s, 0, c)}, 9.0),
                       .parent = 0,
                       .parent_arc = 100.0};
    tree.push_back(other);
    const Vec3 fork = top + stem_length * stem, onward = Vec3(0, 1, -1.6).normalized();
    tree.push_back({.line = line_through({fork, fork + 60.0 * onward}, 4.0),
                    .parent = 0,
                    .parent_arc = 100.0 + stem_length});
    Centerline way = line_through({Vec3::Zero(), top, fork, fork + 50.0 * onward}, 4.0);
    for (Eigen::Index k = 0; way.arc_length(k) < 100.0 + stem_length; ++k) {
      way.radius(k) = way.arc_length(k) < 100.0 ? 10.0 : 9.0;
    }
    std::vector<Junction> taken = find_junctions(simulate::Way(way, tree));
    std::erase_if(taken, [](const Junction& junction) { return !junction.taken; });
    ASSERT_EQ(taken.size(), 2u);
    EXPECT_EQ(taken[0].branch, 0);  // into the stem, on the tree's line
    EXPECT_EQ(taken[1].branch, 2);
    EXPECT_NEAR(taken[0].level, 100.0, 0.6);  // a point of the line
    EXPECT_LE(taken[0].level, taken[1].level);
  }
}

TEST(Junctions, WhatGoesStraightOnIsTheTrunkThoughTheTreesLineTurnsOff) {
  const Vec3 aside(std::sin(40.0 * kRadPerDeg), 0.0, std::cos(40.0 * kRadPerDeg));
  Branch on{.line = line_through({Vec3(0, 0, 100), Vec3(0, 0, 180)}, 3.0),
            .parent = 0,
            .parent_arc = 100.0};
  on.line.radius.head(9).setConstant(4.0);
  const std::vector<Branch> tree = {{.line = forked_way(aside, 4.0, 2.6)}, on};
  const auto off = find_junctions(simulate::Way(forked_way(0.6 * aside, 4.0, 2.6), tree));
  ASSERT_EQ(off.size(), 1u);
  EXPECT_TRUE(off[0].taken);
  EXPECT_EQ(off[0].branch, 0);
  EXPECT_NEAR(turn_of(off[0]) / kRadPerDeg, 40.0, 0.5);
  const auto past = find_junctions(simulate::Way(forked_way(0.6 * Vec3::UnitZ(), 4.0, 3.0), tree));
  ASSERT_EQ(past.size(), 1u);
  EXPECT_FALSE(past[0].taken);
  EXPECT_EQ(past[0].branch, 0);
}

TEST(Junctions, AnAccessInTheMiddleOfATrunkTurnsIntoNoneOfItsWays) {
  // 3 mm above the level of a branch; the tree's line goes down, and up is a branch of it.
  const Branch down{.line = line_through({Vec3(0, 0, 103), Vec3::Zero()}, 10.0)};
  const Branch up{.line = line_through({Vec3(0, 0, 103), Vec3(0, 0, 200)}, 10.0), .parent = 0};
  Branch side{.line = side_branch(100.0, 60.0, 3.0, 3.0).line, .parent = 0, .parent_arc = 3.0};
  const std::vector<Branch> tree = {down, up, side};
  const Centerline to_top = line_through({Vec3(0, 0, 103), Vec3(0, 0, 180)}, 10.0);
  EXPECT_TRUE(find_junctions(simulate::Way(to_top, tree)).empty());
  const Centerline aside = line_through({Vec3(0, 0, 103), Vec3(0, 0, 100), Vec3(40, 0, 100)}, 3.0);
  const auto found = find_junctions(simulate::Way(aside, tree));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].taken);
  EXPECT_EQ(found[0].branch, 2);
  EXPECT_NEAR(found[0].level, 3.0, 0.5);
  EXPECT_NEAR(turn_of(found[0]) / kRadPerDeg, 90.0, 0.5);
}

TEST(Junctions, AcrossABifurcationTheTurnIsThatFromLegToLeg) {
  // Legs of 5 mm radius, 30 deg off the axis of an aorta of 9 mm; one comes in from above.
  const Vec3 left(std::sin(30 * kRadPerDeg), 0, -std::cos(30 * kRadPerDeg));
  // Where that is hardly wider than a leg it does not part into one and the other.
  for (const auto& [rise, wide] : {std::pair(-60.0, 9.0), {20.0, 9.0}, {-60.0, 6.2}}) {
    SCOPED_TRACE(testing::Message() << "right leg " << rise << " deg up, aorta " << wide);
    const Vec3 right(-std::cos(rise * kRadPerDeg), 0, std::sin(rise * kRadPerDeg));
    const auto through = [&](const Vec3& end, double beyond) {
      Centerline line = line_through({80.0 * right, Vec3::Zero(), end}, 5.0);
      for (Eigen::Index k = 0; k < line.radius.size(); ++k) {
        if (line.arc_length(k) > 72.0) line.radius(k) = 7.0;
        if (line.arc_length(k) > 88.0) line.radius(k) = beyond;
      }
      return line;
    };
    Branch leg{
        .line = line_through({Vec3::Zero(), 80.0 * left}, 5.0), .parent = 0, .parent_arc = 80.0};
    leg.line.radius.head(15).setConstant(7.0);
    const std::vector<Branch> tree = {{.line = through(Vec3(0, 0, 120), wide)}, leg};
    const auto across = find_junctions(simulate::Way(through(60.0 * left, 5.0), tree));
    ASSERT_EQ(across.size(), 1u);
    EXPECT_TRUE(across[0].taken && across[0].bifurcation);
    const double turn = std::acos(-right.dot(left)) / kRadPerDeg;
    EXPECT_NEAR(turn_of(across[0]) / kRadPerDeg, turn, 0.5);
    const auto up = find_junctions(simulate::Way(through(Vec3(0, 0, 90), wide), tree));
    ASSERT_EQ(up.size(), 1u);
    EXPECT_TRUE(up[0].bifurcation && !up[0].taken);
  }
}

TEST(BranchNames, TheOtherLegIsCalledAfterItsGroinAlsoWhereTheTreesLineRunsIntoIt) {
  // From the right leg over into the left one; the aorta of 9 mm is a branch of that line.
  const Vec3 left(40, 0, -70), right(-40, 0, -70);
  Branch over{.line = line_through({right, Vec3::Zero(), left}, 5.0)};
  const double fork = right.norm();
  for (Eigen::Index k = 0; k < over.line.radius.size(); ++k) {
    if (std::abs(over.line.arc_length(k) - fork) < 8.0) over.line.radius(k) = 7.0;
  }
  Branch aorta{
      .line = line_through({Vec3::Zero(), Vec3(0, 0, 120)}, 9.0), .parent = 0, .parent_arc = fork};
  std::vector<Branch> tree = {over, aorta};
  name_branches(tree, {"sac", Vec3(0, 0, 80)}, {}, {{"left femoral", 0.9 * left}});
  EXPECT_EQ(branch_name(tree, 0, 2.0 * fork - 10.0), "left femoral (branch 1)");
  EXPECT_EQ(branch_name(tree, 0, 20.0), "branch 1") << "the leg that the tree starts in";
  EXPECT_EQ(branch_name(tree, 1), "sac (branch 2)");
  const auto up =
      find_junctions(simulate::Way(line_through({right, Vec3::Zero(), Vec3(0, 0, 80)}, 5.0), tree));
  ASSERT_EQ(up.size(), 1u);
  EXPECT_EQ(leaving_name(tree, up[0]), "left femoral (branch 1)");
  // Also where the leg that the tree starts in has a name already.
  std::vector<Branch> both = {over, aorta};
  name_branches(both, {"sac", Vec3(0, 0, 80)}, {{"right iliac", 0.5 * right}},
                {{"left femoral", 0.9 * left}});
  EXPECT_EQ(branch_name(both, 0, 20.0), "right iliac (branch 1)");
  EXPECT_EQ(branch_name(both, 0, 2.0 * fork - 10.0), "left femoral (branch 1)");
  // An access farther up the leg that the tree starts in gives it no name.
  name_branches(tree, {"sac", Vec3(0, 0, 80)}, {}, {{"right groin", 0.9 * right}});
  EXPECT_EQ(branch_name(tree, 0, 20.0), "branch 1");
}

TEST(Junctions, OfLevelsBeforeTheAccessAreNone) {
  // It leaves backwards, 60 deg down: its axis meets the trunk's at 10 mm, its ostium is at -7.
  const std::vector<Vec3> corners = into_branch(1.0, -60.0 * kRadPerDeg);
  std::vector<Vec3> lower;
  for (const Vec3& p : corners) lower.push_back(p - Vec3(0, 0, 90));
  Branch back{.line = line_through(lower, 3.0), .parent = 0, .parent_arc = 0.0};
  const Branch trunk{.line = line_through({Vec3::Zero(), Vec3(0, 0, 200)}, 10.0)};
  EXPECT_TRUE(find_junctions(simulate::Way(trunk.line, {trunk, back})).empty());
}

}  // namespace
}  // namespace wireplan::plan
