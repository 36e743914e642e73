// The way's narrowness, bends and junctions, and the C-arm's angles, against answers by hand.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "plan/anatomy/access_limits.h"
#include "plan/anatomy/branch_names.h"
#include "plan/anatomy/passage.h"
#include "plan/anatomy/projection.h"
#include "tests/plan/vessel_trees.h"
#include "tests/shapes.h"

namespace wireplan::plan {
namespace {

using preprocess::Branch;
using shapes::line_through;
using trees::into_branch;
using trees::right_renal_way;
using trees::side_branch;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A quarter of a circle of radius 40 mm.
Centerline quarter_torus() {
  std::vector<Vec3> corners;
  for (int k = 0; k <= 180; ++k) {
    const double angle = k * 0.5 * kRadPerDeg;
    corners.emplace_back(40.0 * std::cos(angle), 0.0, 40.0 * std::sin(angle));
  }
  return line_through(corners, 4.0);
}

TEST(Way, QuarterTorusHasTheTortuosityAndTheAngleOfItsCircle) {
  const Centerline way = quarter_torus();
  const double expected = kPi / (2.0 * std::sqrt(2.0));
  EXPECT_NEAR(tortuosity(way), expected, 1e-4);  // chords of half a degree are short by 3e-6
  const Corner bend = find_sharpest_bend(way, {}, 20.0);
  EXPECT_NEAR(bend.angle, kPi - 20.0 / 40.0, 0.01);
  EXPECT_DOUBLE_EQ(bend.arm, 20.0);
}

TEST(Way, SharpestBendIsTheCornerAndItsPlace) {
  for (const double turn : {20.0, 60.0, 100.0}) {
    SCOPED_TRACE(turn);
    const double a = turn * kRadPerDeg;
    const Centerline way = line_through(
        {Vec3::Zero(), Vec3(0, 0, 60), Vec3(50 * std::sin(a), 0, 60 + 50 * std::cos(a))}, 4.0);
    const Corner bend = find_sharpest_bend(way);
    EXPECT_NEAR(bend.angle / kRadPerDeg, 180.0 - turn, 1e-6);
    EXPECT_NEAR(bend.arc, 60.0, 1e-9);
  }
  EXPECT_NEAR(find_sharpest_bend(line_through({Vec3::Zero(), Vec3(0, 0, 60)}, 4.0)).angle, kPi,
              1e-6);
}

TEST(Way, ARoundedCornerHasTheAngleOfItsArms) {
  // Two straight arms that an arc of radius 4 mm joins, as a middle line takes a corner.
  for (const double turn : {40.0, 70.0, 103.0}) {
    SCOPED_TRACE(turn);
    const double a = turn * kRadPerDeg, cut = 4.0 * std::tan(0.5 * a);
    std::vector<Vec3> corners = {Vec3(0, 0, -60), Vec3(0, 0, -cut)};
    for (int k = 1; k <= 40; ++k) {
      const double t = a * k / 40.0;
      corners.emplace_back(4.0 * (1.0 - std::cos(t)), 0, -cut + 4.0 * std::sin(t));
    }
    corners.emplace_back(50.0 * std::sin(a), 0, 50.0 * std::cos(a));
    const Corner bend = find_sharpest_bend(line_through(corners, 4.0));
    EXPECT_NEAR(bend.angle / kRadPerDeg, 180.0 - turn, 2.0);
    EXPECT_NEAR(bend.arc, 60.0 - cut + 2.0 * a, 1.0);
  }
}

TEST(Way, NarrowestIsFoundAwayFromTheEnds) {
  Centerline way = line_through({Vec3::Zero(), Vec3(0, 0, 100)}, 4.0);
  way.radius(1) = way.radius(way.radius.size() - 2) = 0.6;  // spheres against the caps
  way.radius(140) = 1.5;
  EXPECT_DOUBLE_EQ(find_narrowest(way, 1e9).diameter, 3.0);
  EXPECT_NEAR(find_narrowest(way, 1e9).arc, 70.0, 1e-9);
  EXPECT_NEAR(find_narrowest(way, 1e9).point.z(), 70.0, 1e-9);
  EXPECT_DOUBLE_EQ(find_narrowest(way, 60.0).diameter, 8.0);
}

/// A vertical trunk of 10 mm radius, 200 mm long, and a branch of 3 mm that leaves it at 100 mm.
struct TrunkAndBranch {
  Centerline trunk = line_through({Vec3::Zero(), Vec3(0, 0, 200)}, 10.0);
  Centerline branch, way;
  std::vector<Branch> tree;

  explicit TrunkAndBranch(const Vec3& direction, double radius = 3.0)
      : branch(line_through({Vec3(0, 0, 100), Vec3(0, 0, 100) + 60.0 * direction}, radius)),
        way(line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(0, 0, 100) + 50.0 * direction},
                         radius)),
        tree{{.line = trunk}, {.line = branch, .parent = 0, .parent_arc = 100.0}} {
    for (Eigen::Index k = 0; way.arc_length(k) < 100.0; ++k) way.radius(k) = 10.0;
  }
};

TEST(Junctions, WayLeavesTheTrunkForItsBranch) {
  const TrunkAndBranch left(Vec3::UnitX());
  const auto found = find_junctions(simulate::Way(left.way, left.tree));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].taken);
  EXPECT_EQ(found[0].trunk, 0);
  EXPECT_EQ(found[0].branch, 1);
  EXPECT_NEAR(found[0].arc, 110.0, 0.51);  // the first point beyond the trunk's radius
  EXPECT_NEAR(found[0].trunk_direction.dot(Vec3::UnitZ()), 1.0, 1e-9);
  EXPECT_NEAR(found[0].branch_direction.dot(Vec3::UnitX()), 1.0, 1e-9);
}

TEST(Junctions, WayThatStaysInTheTrunkPassesTheBranch) {
  const TrunkAndBranch left(Vec3::UnitX());
  const auto found = find_junctions(simulate::Way(left.trunk, left.tree));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_FALSE(found[0].taken);
  EXPECT_EQ(found[0].branch, 1);
  EXPECT_NEAR(found[0].arc, 100.0, 1e-9);
  // One that ends before the branch does not pass it.
  const Centerline before = line_through({Vec3::Zero(), Vec3(0, 0, 80)}, 10.0);
  EXPECT_TRUE(find_junctions(simulate::Way(before, left.tree)).empty());
}

TEST(Junctions, TreeWhoseFirstBranchEndsInTheSmallArteryTellsTheSame) {
  const TrunkAndBranch left(Vec3::UnitX());
  Branch first{.line = line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(60, 0, 100)}, 3.0)};
  first.line.radius.head(200).setConstant(10.0);
  const Branch upper{.line = line_through({Vec3(0, 0, 100), Vec3(0, 0, 200)}, 10.0),
                     .parent = 0,
                     .parent_arc = 100.0};
  const auto found = find_junctions(simulate::Way(left.way, {first, upper}));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].taken);
  EXPECT_EQ(found[0].trunk, 1);
  EXPECT_EQ(found[0].branch, 0);
  EXPECT_NEAR(found[0].arc, 110.0, 0.51);
  EXPECT_NEAR(found[0].trunk_direction.dot(Vec3::UnitZ()), 1.0, 1e-6);
  EXPECT_NEAR(found[0].branch_direction.dot(Vec3::UnitX()), 1.0, 1e-9);
}

TEST(Junctions, AStemWithoutLengthIsOneTurnOutOfTheTrunk) {
  // As where carotid and brachiocephalic artery leave the arch by one mouth.
  Branch first{.line = line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(60, 0, 100)}, 3.5)};
  first.line.radius.head(200).setConstant(10.0);
  const Branch upper{.line = line_through({Vec3(0, 0, 100), Vec3(0, 0, 200)}, 10.0),
                     .parent = 0,
                     .parent_arc = 100.0};
  const Branch own{.line = line_through({Vec3(3, 0, 100), Vec3(60, 50, 100)}, 3.0),
                   .parent = 0,
                   .parent_arc = 103.0};
  Centerline way =
      line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(3, 0, 100), Vec3(50, 41, 100)}, 3.0);
  for (Eigen::Index k = 0; way.arc_length(k) < 100.0; ++k) way.radius(k) = 10.0;
  const auto found = find_junctions(simulate::Way(way, {first, upper, own}));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].taken);
  EXPECT_EQ(found[0].trunk, 1);
  EXPECT_EQ(found[0].branch, 2);
  EXPECT_NEAR(found[0].trunk_direction.dot(Vec3::UnitZ()), 1.0, 1e-6);
}

TEST(Junctions, WhereAVesselPartsTheWaysPartIsToldByTheOther) {
  Centerline leg = line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(-60, 0, 180)}, 5.0);
  leg.radius.head(200).setConstant(8.0);
  const std::vector<Branch> tree = {{.line = leg},
                                    {.line = line_through({Vec3(0, 0, 100), Vec3(60, 0, 180)}, 5.0),
                                     .parent = 0,
                                     .parent_arc = 100.0}};
  Centerline way = line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(-50, 0, 167)}, 5.0);
  way.radius.head(200).setConstant(8.0);
  const auto found = find_junctions(simulate::Way(way, tree));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].taken);
  EXPECT_EQ(leaving_name(tree, found[0]), "branch 1, past branch 2");
}

TEST(Junctions, OppositeRenalsFourMillimetresApartAreOneOstiumOnTheWay) {
  // The left one is the wider, and lower: the way into the right one passes it.
  const Branch left = side_branch(96.0, 60.0, 3.0, 96.0);
  const Branch right = side_branch(100.0, -60.0, 2.5, 100.0);
  const Branch aorta{.line = line_through({Vec3::Zero(), Vec3(0, 0, 200)}, 10.0)};
  const auto found = find_junctions(simulate::Way(right_renal_way(2.5), {aorta, left, right}));
  ASSERT_EQ(found.size(), 2u);
  EXPECT_FALSE(found[0].taken);
  EXPECT_EQ(found[0].branch, 1);
  EXPECT_TRUE(found[1].taken);
  EXPECT_EQ(found[1].trunk, 0);
  EXPECT_EQ(found[1].branch, 2);

  // The same where the tree's first line turns into the right one, and the aorta is its branch.
  const Branch first{.line = right_renal_way(2.5)};
  const Branch upper{.line = line_through({Vec3(0, 0, 100), Vec3(0, 0, 200)}, 10.0),
                     .parent = 0,
                     .parent_arc = 100.0};
  const auto same = find_junctions(simulate::Way(right_renal_way(2.5), {first, left, upper}));
  ASSERT_EQ(same.size(), 2u);
  EXPECT_FALSE(same[0].taken);
  EXPECT_EQ(same[0].branch, 1);
  EXPECT_TRUE(same[1].taken);
  EXPECT_EQ(same[1].trunk, 2);
  EXPECT_EQ(same[1].branch, 0);
}

TEST(Junctions, OstiaThatFaceEachOtherAreAtOneLevel) {
  for (const double elevation : {0.0, 40.0, -40.0}) {
    const double a = elevation * kRadPerDeg, level = 100.0 + 10.0 * std::tan(a);
    for (const double shift : {-0.4, 0.4}) {  // where the branch that is passed begins
      SCOPED_TRACE(testing::Message() << elevation << ", " << shift);
      std::vector<Branch> tree = {{.line = line_through({Vec3::Zero(), Vec3(0, 0, 200)}, 10.0)}};
      for (const double side : {1.0, -1.0}) {
        const double begins = level + (side > 0.0 ? 0.0 : shift);
        std::vector<Vec3> corners = into_branch(side, a);
        corners.front().z() = begins;
        tree.push_back({.line = line_through(corners, 3.0), .parent = 0, .parent_arc = begins});
      }
      std::vector<Vec3> corners = into_branch(1.0, a);
      corners.insert(corners.begin(), Vec3::Zero());
      const auto found = find_junctions(simulate::Way(line_through(corners, 3.0), tree));
      ASSERT_EQ(found.size(), 2u);
      EXPECT_FALSE(found[0].taken);
      EXPECT_EQ(found[0].branch, 2);
      EXPECT_TRUE(found[1].taken);
      EXPECT_EQ(found[1].branch, 1);
      EXPECT_NEAR(found[0].level, level, 0.5);  // a point of the line
      EXPECT_NEAR(found[1].level, level, 0.5);
      EXPECT_NEAR(found[1].arc, level + 10.0, 0.51);
      EXPECT_NEAR(turn_of(found[1]) / kRadPerDeg, 90.0 - elevation, 0.1);
      EXPECT_NEAR(turn_of(found[0]) / kRadPerDeg, 90.0 - elevation, 0.1);
    }
  }
}

TEST(Junctions, TheBendOfAWayThatTurnsIntoABranchIsThatOfTheAxes) {
  for (const double elevation : {30.0, 0.0, -40.0}) {
    SCOPED_TRACE(elevation);
    std::vector<Vec3> corners = into_branch(1.0, elevation * kRadPerDeg);
    const Branch side{
        .line = line_through(corners, 3.0), .parent = 0, .parent_arc = corners.front().z()};
    corners.insert(corners.begin(), Vec3::Zero());
    const Centerline way = line_through(corners, 3.0);
    const auto found = find_junctions(
        simulate::Way(way, {{.line = line_through({Vec3::Zero(), Vec3(0, 0, 200)}, 10.0)}, side}));
    ASSERT_EQ(found.size(), 1u);
    const Corner bend = find_sharpest_bend(way, found);
    EXPECT_NEAR(bend.angle / kRadPerDeg, 90.0 + elevation, 0.1);
    EXPECT_NEAR((bend.angle + turn_of(found[0])) / kRadPerDeg, 180.0, 0.1);
    EXPECT_EQ(bend.arc, found[0].level);
    EXPECT_NEAR(bend.before.z(), 1.0, 1e-6);
    EXPECT_NEAR(bend.behind.z(), std::sin(elevation * kRadPerDeg), 1e-3);
  }
}

TEST(Junctions, StumpsAreNone) {
  // A bulge as wide as the trunk that ends 4 mm beyond its wall.
  const Branch stump{.line = line_through({Vec3(0, 0, 96), Vec3(14, 0, 96)}, 10.0),
                     .parent = 0,
                     .parent_arc = 96.0};
  const Branch aorta{.line = line_through({Vec3::Zero(), Vec3(0, 0, 200)}, 10.0)};
  const auto found = find_junctions(
      simulate::Way(right_renal_way(2.5), {aorta, stump, side_branch(100.0, -60.0, 2.5, 100.0)}));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].branch, 2);

  // The tree's first line ends in the stump, and the trunk is its branch.
  Branch first{.line = line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(14, 0, 100)}, 10.0)};
  first.line.radius.tail(8).setConstant(4.0);
  const Branch upper{.line = line_through({Vec3(0, 0, 100), Vec3(0, 0, 200)}, 10.0),
                     .parent = 0,
                     .parent_arc = 100.0};
  const Centerline up = line_through({Vec3::Zero(), Vec3(0, 0, 180)}, 10.0);
  EXPECT_TRUE(find_junctions(simulate::Way(up, {first, upper})).empty());
}

TEST(Junctions, ATrunkThatTheImageCutsOffIsNoStump) {
  // As the ascending aorta on a CT of the neck: the tree's line turns into the right vessel, and
  // the trunk is seen for so much more, with this radius at its end.
  const auto count = [](double length, double end_radius, double beyond) {
    const Branch first{.line = right_renal_way(beyond)};
    Branch upper{.line = line_through({Vec3(0, 0, 100), Vec3(0, 0, 100 + length)}, 10.0),
                 .parent = 0,
                 .parent_arc = 100.0};
    upper.line.radius.tail(8).setConstant(end_radius);
    const auto found = find_junctions(simulate::Way(right_renal_way(beyond), {first, upper}));
    if (!found.empty()) {
      EXPECT_TRUE(found[0].taken);
      EXPECT_EQ(found[0].trunk, 1);
    }
    return found.size();
  };
  EXPECT_EQ(count(28.0, 9.0, 5.0), 1u);
  EXPECT_EQ(count(18.0, 9.0, 5.0), 0u) << "ends 8 mm beyond the fork's ball";
  EXPECT_EQ(count(28.0, 6.0, 5.0), 0u) << "narrows to its end, as a sac does";
  EXPECT_EQ(count(28.0, 9.0, 9.0), 0u) << "the way goes on as wide: a bulge beside it";
}

TEST(Junctions, WayThatStaysInTheTrunkPassesTheArteryThatTheTreesLineEndsIn) {
  const Branch first{.line = right_renal_way(3.0)};
  const Branch upper{.line = line_through({Vec3(0, 0, 100), Vec3(0, 0, 200)}, 10.0),
                     .parent = 0,
                     .parent_arc = 100.0};
  const Centerline up = line_through({Vec3::Zero(), Vec3(0, 0, 180)}, 10.0);
  const auto found = find_junctions(simulate::Way(up, {first, upper}));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_FALSE(found[0].taken);
  EXPECT_EQ(found[0].branch, 0);
  EXPECT_NEAR(found[0].arc, 100.0, 0.51);
  EXPECT_NEAR(found[0].branch_direction.dot(-Vec3::UnitX()), 1.0, 1e-6);
}

TEST(BranchNames, AreThoseOfTheTargetsAndAccessesInThem) {
  const auto tree = [] {
    return std::vector<Branch>{{.line = line_through({Vec3::Zero(), Vec3(0, 0, 200)}, 10.0)},
                               side_branch(96.0, 60.0, 3.0, 96.0),
                               side_branch(100.0, -60.0, 2.5, 100.0),
                               side_branch(150.0, 60.0, 3.0, 150.0)};
  };
  const Vec3 left(40, 0, 96), right(-40, 0, 100), upper(40, 0, 150), root(0, 0, 2);
  std::vector<Branch> named = tree();
  name_branches(named, {"left renal", left}, {{"right renal", right}, {"again", left}},
                {{"right femoral", root}, {"left arm", upper}});
  EXPECT_EQ(branch_name(named, 0), "branch 1") << "it goes on far beyond the access";
  EXPECT_EQ(branch_name(named, 1), "left renal (branch 2)");
  EXPECT_EQ(branch_name(named, 2), "right renal (branch 3)");
  EXPECT_EQ(branch_name(named, 3), "left arm (branch 4)");

  named = tree();
  name_branches(named, {"", left}, {}, {});
  EXPECT_EQ(branch_name(named, 1), "the target's branch (branch 2)");
  EXPECT_EQ(branch_name(named, 2), "branch 3");
}

TEST(BranchNames, OfAVesselThatSharesAStemBeginBehindIt) {
  // A trunk that leaves the aorta: its line ends in a carotid, but a wider artery goes on from it.
  std::vector<Branch> tree = {{.line = line_through({Vec3::Zero(), Vec3(0, 0, 200)}, 12.0)},
                              {.line = line_through({Vec3(0, 0, 100), Vec3(80, 0, 100)}, 5.0),
                               .parent = 0,
                               .parent_arc = 100.0},
                              {.line = line_through({Vec3(40, 0, 100), Vec3(40, 60, 100)}, 7.0),
                               .parent = 1,
                               .parent_arc = 40.0}};
  name_branches(tree, {"subclavian", Vec3(40, 50, 100)}, {{"carotid", Vec3(75, 0, 100)}}, {});
  EXPECT_EQ(branch_name(tree, 1), "the stem of carotid, then carotid (branch 2)");
  EXPECT_EQ(branch_name(tree, 1, 30.0), "the stem of carotid (branch 2)");
  const simulate::Way way(
      line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(40, 0, 100), Vec3(40, 50, 100)}, 5.0),
      tree);
  const auto found = find_junctions(way);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_TRUE(found[0].taken && !found[1].taken);
  EXPECT_EQ(leaving_name(tree, found[0]), "the stem of carotid (branch 2)");
  EXPECT_EQ(leaving_name(tree, found[1]), "carotid (branch 2)");
}

TEST(BranchNames, OfLabelsStandWhereNoPlaceHasAnother) {
  const auto tree = [] {
    Branch first{.line = line_through({Vec3::Zero(), Vec3(0, 0, 200)}, 5.0)};
    first.parts = {{0.0, "iliac artery"}, {60.0, "aorta"}, {150.0, "subclavian artery"}};
    return std::vector<Branch>{first};
  };
  std::vector<Branch> named = tree();
  EXPECT_EQ(branch_name(named, 0), "iliac artery, then aorta, then subclavian artery (branch 1)");
  EXPECT_EQ(branch_name(named, 0, 59.0), "iliac artery (branch 1)");
  name_branches(named, {"", Vec3(0, 0, 100)}, {}, {});
  EXPECT_EQ(branch_name(named, 0, 100.0), "aorta (branch 1)");
  named = tree();
  name_branches(named, {"renal level", Vec3(0, 0, 100)}, {}, {});
  EXPECT_EQ(branch_name(named, 0, 59.0), "iliac artery (branch 1)");
  EXPECT_EQ(branch_name(named, 0, 61.0), "renal level (branch 1)");
  EXPECT_EQ(branch_name(named, 0, 180.0), "subclavian artery (branch 1)");
}

/// A trunk with a stem of 3.5 mm radius, out of it at 100 mm, that parts 40 mm on: the tree's line
/// goes on in an artery of 2.5 mm, and the wider vessel is a branch of that.
std::vector<Branch> tree_with_stem() {
  Branch stem{.line = line_through({Vec3(0, 0, 100), Vec3(40, 0, 100), Vec3(40, 0, 160)}, 2.5),
              .parent = 0,
              .parent_arc = 100.0};
  for (Eigen::Index k = 0; stem.line.arc_length(k) < 44.0; ++k) {
    stem.line.radius(k) = stem.line.arc_length(k) < 10.0 ? 10.0 : 3.5;
  }
  return {{.line = line_through({Vec3::Zero(), Vec3(0, 0, 200)}, 10.0)},
          stem,
          {.line = line_through({Vec3(40, 0, 100), Vec3(100, 0, 100)}, 3.5),
           .parent = 1,
           .parent_arc = 40.0}};
}

TEST(BranchNames, ABranchHasItsNameFromWhereItLeaves) {
  // The line of a branch begins in the middle of its trunk, with the trunk's radius.
  for (const double lean : {0.0, 60.0}) {
    SCOPED_TRACE(lean);
    const double a = lean * kRadPerDeg;
    TrunkAndBranch side(Vec3(std::cos(a), 0.0, std::sin(a)));
    Centerline& line = side.tree[1].line;
    for (Eigen::Index k = 0; k < line.radius.size(); ++k) {
      const double off_axis = line.points(0, k);
      if (off_axis < 10.0) line.radius(k) = std::max(3.0, 10.0 - off_axis);
    }
    name_branches(side.tree, {"left renal", line.points.rightCols<1>()}, {}, {});
    const auto found = find_junctions(simulate::Way(side.way, side.tree));
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(leaving_name(side.tree, found[0]), "left renal (branch 2)");
  }
}

TEST(BranchNames, AStemThatTwoVesselsShareIsTheStemOfTheOneThatItsLineEndsIn) {
  std::vector<Branch> tree = tree_with_stem();
  const Vec3 arm(80, 0, 100), carotid(40, 0, 150);
  name_branches(tree, {"left carotid", carotid}, {{"right arm", arm}}, {});
  Centerline path = line_through({Vec3::Zero(), Vec3(0, 0, 100), arm}, 3.5);
  const auto to_arm = find_junctions(simulate::Way(path, tree));
  ASSERT_EQ(to_arm.size(), 2u);
  EXPECT_TRUE(to_arm[0].taken);
  EXPECT_EQ(leaving_name(tree, to_arm[0]), "the stem of left carotid (branch 2)");
  EXPECT_FALSE(to_arm[1].taken) << "it stays in the wider vessel";
  EXPECT_EQ(leaving_name(tree, to_arm[1]), "left carotid (branch 2)");

  path = line_through({Vec3::Zero(), Vec3(0, 0, 100), Vec3(40, 0, 100), carotid}, 2.5);
  const simulate::Way way(path, tree);
  const auto to_carotid = find_junctions(way);
  ASSERT_EQ(to_carotid.size(), 2u);
  EXPECT_EQ(leaving_name(tree, to_carotid[0]), "the stem of left carotid (branch 2)");
  EXPECT_EQ(leaving_name(tree, to_carotid[1]), "left carotid (branch 2)");
  const auto astray = way.find_astray(Vec3(0, 0, 180));
  ASSERT_TRUE(astray);
  EXPECT_NE(astray->text.find("turns into the stem of left carotid (branch 2)"), std::string::npos)
      << astray->text;
  // Whatever is named first; a place in the stem names it.
  for (const bool first : {true, false}) {
    const NamedPlace trunk{"trunk", Vec3(25, 0, 100)}, beyond{"left carotid", carotid};
    std::vector<Branch> named = tree_with_stem();
    name_branches(named, first ? trunk : beyond, {first ? beyond : trunk}, {});
    EXPECT_EQ(branch_name(named, 1), "trunk, then left carotid (branch 2)") << first;
    EXPECT_EQ(branch_name(named, 1, 85.0), "left carotid (branch 2)") << first;
  }

  // Labels part the two 8 mm behind the place where the lines do.
  std::vector<Branch> labelled = tree_with_stem();
  labelled[1].parts = {{0.0, "stem"}, {48.0, "carotid artery"}};
  EXPECT_EQ(leaving_name(labelled, to_carotid[0]), "stem (branch 2)");
  EXPECT_EQ(leaving_name(labelled, to_carotid[1]), "carotid artery (branch 2)");
  const auto past = simulate::Way(path, labelled).find_astray(arm);
  ASSERT_TRUE(past);
  EXPECT_NE(past->text.find("the way turns into carotid artery (branch 2)"), std::string::npos)
      << past->text;
}

TEST(BranchNames, OfALineThatRunsThroughTheAortaAreOfItsEndAlone) {
  std::vector<Branch> tree = {{.line = right_renal_way(3.0)},
                              {.line = line_through({Vec3(0, 0, 100), Vec3(0, 0, 200)}, 10.0),
                               .parent = 0,
                               .parent_arc = 100.0}};
  const Centerline& line = tree[0].line;
  name_branches(tree, {"", Vec3(0, 0, 180)}, {{"right renal", line.points.rightCols<1>()}}, {});
  EXPECT_EQ(branch_name(tree, 0), "right renal (branch 1)");
  EXPECT_EQ(branch_name(tree, 0, 60.0), "branch 1") << "the aorta";
  EXPECT_NEAR(tree[0].parts[0].from, 110.0, 1.0) << "at its wall";
  const simulate::Way up(line_through({Vec3::Zero(), Vec3(0, 0, 180)}, 10.0), tree);
  EXPECT_EQ(up.name_at(Vec3(1, 0, 50)), "branch 1");
  EXPECT_EQ(up.name_at(line.points.rightCols<1>()), "right renal (branch 1)");
}

TEST(BranchNames, ATaperAndAStenosisBeginNoOtherVessel) {
  // Out of an aorta of 10 mm at 110 mm, from 5.2 to 2.2 mm at its end, narrowed over 6 mm.
  Branch first{.line = right_renal_way(3.0)};
  Centerline& line = first.line;
  for (Eigen::Index k = 0; k < line.radius.size(); ++k) {
    const double beyond = line.arc_length(k) - 110.0;
    if (beyond >= 0.0) line.radius(k) = 5.2 - 3.0 * beyond / 40.0;
    if (std::abs(beyond - 25.0) < 3.0) line.radius(k) = 0.9;
  }
  for (const double at : {120.0, 135.0, 149.0}) {  // the second in the stenosis
    std::vector<Branch> tree = {first};
    name_branches(tree, {"renal", point_at(line, at)}, {}, {});
    EXPECT_NEAR(tree[0].parts[0].from, 110.0, 1.0) << at;
  }
  std::vector<Branch> tree = {first};
  name_branches(tree, {"aorta", point_at(line, 60.0)}, {}, {});
  EXPECT_EQ(tree[0].parts[0].from, 0.0);
  EXPECT_EQ(branch_name(tree, 0, 100.0), "aorta (branch 1)") << "up to the renal artery's ostium";
  EXPECT_EQ(branch_name(tree, 0, 120.0), "branch 1");
}

TEST(TrunkAxis, IsThatOfTheWideVessels) {
  const auto aorta = [](const Vec3& end) {
    return std::vector<Branch>{{.line = line_through({Vec3::Zero(), end}, 10.0)},
                               {.line = line_through({end, end + Vec3(300, 0, 0)}, 3.0),
                                .parent = 0,
                                .parent_arc = end.norm()}};
  };
  const auto upright = find_trunk_axis(aorta(Vec3(0, 60, 200)));
  ASSERT_TRUE(upright);
  EXPECT_NEAR(std::abs(upright->dot(Vec3(0, 60, 200).normalized())), 1.0, 1e-9);
  const auto lying = find_trunk_axis(aorta(Vec3(0, 200, 0)));
  ASSERT_TRUE(lying);
  EXPECT_NEAR(std::abs(lying->y()), 1.0, 1e-9);
  EXPECT_FALSE(find_trunk_axis(aorta(Vec3(0, 50, 50)))) << "too short to tell";
  EXPECT_FALSE(find_trunk_axis({}));
}

TEST(AccessLimits, GradesBeginAtTheirThresholds) {
  const AccessLimits limits;
  EXPECT_EQ(grade_of(1.11, limits.tortuosity), 0);
  EXPECT_EQ(grade_of(1.25, limits.tortuosity), 1);
  EXPECT_EQ(grade_of(1.55, limits.tortuosity), 2);
  EXPECT_EQ(grade_of(2.0, limits.tortuosity), 3);
  EXPECT_EQ(grade_of(170 * kRadPerDeg, limits.angle), 0);  // smaller angles are worse
  EXPECT_EQ(grade_of(130 * kRadPerDeg, limits.angle), 1);
  EXPECT_EQ(grade_of(100 * kRadPerDeg, limits.angle), 2);
  EXPECT_EQ(grade_of(60 * kRadPerDeg, limits.angle), 3);
}

TEST(Projection, OfAJunctionOfTheWayIsWithinTwoDegrees) {
  const double a = 30.0 * kRadPerDeg;
  const TrunkAndBranch renal(Vec3(std::cos(a), std::sin(a), 0.0));
  const auto found = find_junctions(simulate::Way(renal.way, renal.tree));
  ASSERT_EQ(found.size(), 1u);
  const Projections seen = find_projections(found[0].trunk_direction, found[0].branch_direction);
  EXPECT_NEAR(seen.best.view.rotation / kRadPerDeg, 30.0, 2.0);
  EXPECT_NEAR(seen.best.view.tilt / kRadPerDeg, 0.0, 2.0);
}

}  // namespace
}  // namespace wireplan::plan
