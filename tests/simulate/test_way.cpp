// A target is a place in a vessel: what counts as having reached it, and how trials end that do
// not.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "simulate/insertion/trial.h"
#include "tests/goal.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

using preprocess::Branch;
using shapes::line_through;

Goal goal_of(Centerline path, std::vector<Branch> tree = {}) {
  return goal_at_end(std::make_shared<Way>(std::move(path), std::move(tree)));
}

Wire wire_of(double EI) {
  return {.name = "wire", .radius = 0.4, .sections = {{.length = 300.0, .bending_stiffness = EI}}};
}

// A trunk along z of 5 mm radius from 0 to 90 mm, with branches of 3 mm toward +x at 25 and 50 mm;
// all ends are flat and closed.
constexpr double kFirst = 25.0, kSecond = 50.0, kTrunk = 5.0, kSide = 3.0;

const VesselModel& fork() {
  static const VesselModel vessel(
      shapes::level_set(
          [](const Vec3& p) {
            const auto side = [&](double z) {
              return shapes::depth_in_tube(p, Vec3(0.0, 0.0, z), Vec3(40.0, 0.0, z), kSide);
            };
            const double trunk =
                shapes::depth_in_tube(p, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 90.0), kTrunk);
            const auto soft = [](double depth) { return std::exp(depth / 0.5); };
            return 0.5 * std::log(soft(trunk) + soft(side(kFirst)) + soft(side(kSecond)));
          },
          Vec3(-6.6, -6.6, -1.6), Vec3(41.6, 6.6, 91.6), 1.1),
      LumenOptions{.grid_spacing = 0.6});
  return vessel;
}

Centerline into_branch(double z, double x) {
  Centerline path = line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, z}, {x, 0.0, z}}, kTrunk);
  for (Eigen::Index i = 0; i < path.points.cols(); ++i) {
    if (path.points(0, i) > kTrunk) path.radius(i) = kSide;
  }
  return path;
}

std::vector<Branch> tree_of_fork() {
  const auto side = [](double z) {
    Branch branch{line_through({{0.0, 0.0, z}, {39.4, 0.0, z}}, kSide), 0, z - 5.0};
    for (Eigen::Index i = 0; branch.line.points(0, i) <= kTrunk; ++i)
      branch.line.radius(i) = kTrunk;
    return branch;
  };
  return {{line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 89.0}}, kTrunk), -1, 0.0},
          side(kFirst),
          side(kSecond)};
}

InsertionOptions options(double step = 1.0) {
  return {.length = 140.0, .step = step, .element_length = step, .friction = 0.05};
}

TEST(Way, EveryWireThatPassesTheSectionOfATubeReachesWhereverItRuns) {
  const VesselModel tube(shapes::straight_tube(6.0, 80.0, 2.0));
  const Goal goal = goal_of(line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 60.0}}, 6.0));
  for (const double slant : {0.0, 10.0, 25.0}) {
    for (const double shift : {-4.0, 0.0, 4.0}) {
      for (const double step : {1.0, 2.0}) {
        const double a = slant * kRadPerDeg;
        const Introducer introducer{.point = Vec3(shift, 0.0, 5.0),
                                    .direction = Vec3(std::sin(a), 0.0, std::cos(a))};
        const TrialResult trial = run_trial(wire_of(60.0), introducer, goal, tube, options(step));
        EXPECT_EQ(trial.outcome, Outcome::kReached)
            << slant << " " << shift << ": " << outcome_name(trial.outcome) << trial.reason;
        EXPECT_GE(trial.pushes.back().tip.z(), 60.0) << "it goes on to the section ...";
        EXPECT_LT(trial.pushes.back().tip.z(), 60.0 + step + 0.1) << "... and ends there";
      }
    }
  }
}

/// As the true lumen of a dissection: 3 mm from its middle to the near wall, 12 mm to its edges.
TEST(Way, InAFlatLumenAWireAlongItsEdgeAdvancesAndReaches) {
  Surface flat = shapes::straight_tube(3.0, 150.0, 1.5);
  flat.vertices.row(0) *= 4.0;
  const VesselModel tube(flat, LumenOptions{.grid_spacing = 0.6});
  const Centerline line = line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 145.0}}, 3.0);
  const Goal goal =
      goal_of(line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 130.0}}, 3.0), {{line, -1, 0.0}});
  for (const double shift : {0.0, 5.0, 8.0, -9.0}) {
    EXPECT_EQ(goal.way->find_progress(Vec3(shift, 1.0, 100.0)), 95.0) << shift;
    const Introducer introducer{.point = Vec3(shift, 0.0, 5.0), .direction = Vec3::UnitZ()};
    const TrialResult trial = run_trial(wire_of(60.0), introducer, goal, tube, options(2.0));
    EXPECT_EQ(trial.outcome, Outcome::kReached)
        << shift << ": " << outcome_name(trial.outcome) << " " << trial.reason;
  }
  const Way fork_way(into_branch(kSecond, 25.0), tree_of_fork());
  EXPECT_EQ(fork_way.find_progress(Vec3(15.0, 0.0, kFirst)), 0.0) << "in another branch";
}

TEST(Way, APushFarPastTheSectionReaches) {
  const VesselModel tube(shapes::straight_tube(6.0, 80.0, 2.0));
  const Goal goal = goal_of(line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 60.0}}, 6.0));
  const Introducer along{.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ()};
  InsertionOptions far = options(2.0);
  far.step = 18.0;
  const TrialResult trial = run_trial(wire_of(60.0), along, goal, tube, far);
  EXPECT_EQ(trial.outcome, Outcome::kReached) << outcome_name(trial.outcome) << trial.reason;
  EXPECT_NEAR(trial.pushes.back().tip.z(), 77.0, 0.1);
}

TEST(Way, AWireThatStaysInTheTrunkPassedByTheBranch) {
  const Goal goal = goal_of(into_branch(kSecond, 25.0), tree_of_fork());
  const Introducer along{.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ()};
  for (const double step : {1.0, 2.0}) {  // scouts and full runs name it alike
    const TrialResult trial = run_trial(wire_of(60.0), along, goal, fork(), options(step));
    EXPECT_EQ(trial.outcome, Outcome::kPassedBy) << outcome_name(trial.outcome) << trial.reason;
    EXPECT_NE(trial.reason.find("in branch 1"), std::string::npos) << trial.reason;
  }
}

TEST(Way, AWireThatTakesAnEarlierBranchIsInTheWrongOneByName) {
  const Goal goal = goal_of(into_branch(kSecond, 25.0), tree_of_fork());
  const Introducer aslant{.point = Vec3(-1.0, 0.0, kFirst - 4.0),
                          .direction = Vec3(0.95, 0.0, 0.3122).normalized()};
  const TrialResult trial = run_trial(wire_of(20.0), aslant, goal, fork(), options());
  EXPECT_EQ(trial.outcome, Outcome::kWrongBranch) << outcome_name(trial.outcome) << trial.reason;
  EXPECT_NE(trial.reason.find("in branch 2"), std::string::npos) << trial.reason;
  EXPECT_GT(trial.pushes.back().tip.x(), 10.0);

  // The same push, asked for the first branch, reaches it.
  const TrialResult right = run_trial(
      wire_of(20.0), aslant, goal_of(into_branch(kFirst, 25.0), tree_of_fork()), fork(), options());
  EXPECT_EQ(right.outcome, Outcome::kReached) << outcome_name(right.outcome) << right.reason;
}

TEST(Way, OnePushTowardSeveralTargetsGivesEachTheTrialTowardItAlone) {
  const std::vector<Branch> tree = tree_of_fork();
  const std::vector<Goal> goals = {
      goal_of(into_branch(kSecond, 25.0), tree), goal_of(into_branch(kFirst, 25.0), tree),
      goal_of(line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 40.0}}, kTrunk), tree)};
  const Introducer along{.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ()};
  const Introducer aslant{.point = Vec3(-1.0, 0.0, kFirst - 4.0),
                          .direction = Vec3(0.95, 0.0, 0.3122).normalized()};
  int reached = 0;
  for (const Introducer& introducer : {along, aslant}) {
    const std::vector<TrialResult> together =
        run_trials(wire_of(20.0), introducer, goals, fork(), options());
    ASSERT_EQ(together.size(), goals.size());
    for (std::size_t k = 0; k < goals.size(); ++k) {
      const TrialResult alone = run_trial(wire_of(20.0), introducer, goals[k], fork(), options());
      reached += alone.outcome == Outcome::kReached ? 1 : 0;
      EXPECT_EQ(together[k].outcome, alone.outcome);
      EXPECT_EQ(together[k].reason, alone.reason);
      EXPECT_EQ(together[k].terms, alone.terms);
      EXPECT_EQ(together[k].nodes, alone.nodes);
      EXPECT_EQ(together[k].contacts.size(), alone.contacts.size());
      ASSERT_EQ(together[k].pushes.size(), alone.pushes.size());
      EXPECT_EQ(together[k].pushes.back().push_work, alone.pushes.back().push_work);
      ASSERT_EQ(together[k].shapes.size(), alone.shapes.size());
      EXPECT_EQ(together[k].shapes.back().nodes, alone.shapes.back().nodes);
      ASSERT_EQ(together[k].peak_forces.size(), alone.peak_forces.size());
      for (std::size_t i = 0; i < alone.peak_forces.size(); ++i) {
        EXPECT_EQ(together[k].peak_forces[i].force, alone.peak_forces[i].force);
      }
    }
  }
  EXPECT_EQ(reached, 2) << "the trunk by the one, the first branch by the other";
}

TEST(Way, WhatIsPassedByDoesNotDependOnWhichVesselTheTreeFollowsFirst) {
  // As if the second branch's end were the farthest: the tree's first line turns into it, and the
  // trunk beyond is a branch of that.
  std::vector<Branch> tree = tree_of_fork();
  Centerline first = into_branch(kSecond, 39.5);
  Branch beyond{line_through({{0.0, 0.0, kSecond}, {0.0, 0.0, 89.0}}, kTrunk), 0, kSecond - 5.0};
  tree = {{first, -1, 0.0}, tree[1], beyond};
  const Way way(into_branch(kSecond, 25.0), tree);
  const auto on = way.find_astray(Vec3(0.0, 0.0, 75.0));
  ASSERT_TRUE(on);
  EXPECT_TRUE(on->passed_by) << on->text;
  EXPECT_NE(on->text.find("branch 3"), std::string::npos) << on->text;
  const auto aside = way.find_astray(Vec3(20.0, 0.0, kFirst));
  ASSERT_TRUE(aside);
  EXPECT_FALSE(aside->passed_by) << aside->text;
  EXPECT_FALSE(way.find_astray(Vec3(15.0, 1.0, kSecond)));
}

TEST(Way, WhereAVesselGoesOnIsToldOnItsAxisAndBesideIt) {
  // Along a circle, by a chord of the vessel's width; and in a branch that the way does not take.
  constexpr double kBend = 30.0;
  std::vector<Vec3> corners;
  for (int k = 0; k <= 180; ++k) {
    const double angle = k * kRadPerDeg;
    corners.push_back(kBend * Vec3(-std::cos(angle), 0.0, std::sin(angle)));
  }
  const Centerline bend = line_through(corners, kTrunk);
  const Vec3 top(0.0, 0.0, kBend);
  const Way alone(bend),
      way(bend, {{bend, -1, 0.0},
                 {line_through({top, top + Vec3(0, 0, 40)}, kSide), 0, kBend * 0.5 * kPi}});
  for (const double angle : {0.5, 1.0, 2.0, 2.5}) {
    for (const double beside : {-0.8 * kTrunk, 0.0, 0.8 * kTrunk}) {
      const Vec3 out(-std::cos(angle), 0.0, std::sin(angle));
      const Vec3 onward(std::sin(angle), 0.0, std::cos(angle));
      // Points of the line are half a millimetre apart: 0.5 / 30 rad.
      EXPECT_GT(alone.direction_at((kBend + beside) * out).dot(onward), std::cos(0.5 / kBend));
      EXPECT_GT(way.direction_at((kBend + beside) * out).dot(onward), std::cos(0.5 / kBend));
    }
  }
  EXPECT_NEAR(way.direction_at(top + Vec3(1.0, 0.0, 20.0)).z(), 1.0, 1e-12);
  EXPECT_NEAR(way.direction_at(top + Vec3(1.0, 0.0, 39.9)).z(), 1.0, 1e-12) << "at its end";
}

TEST(Way, ATipInTheMouthOfAnotherBranchIsInThatBranch) {
  // 1.2 mm beside the trunk's balls, which alone may be an oval lumen.
  const Way way(into_branch(kSecond, 25.0), tree_of_fork());
  const auto mouth = way.find_astray(Vec3(6.2, 0.0, kFirst));
  ASSERT_TRUE(mouth);
  EXPECT_FALSE(mouth->passed_by);
  EXPECT_NE(mouth->text.find("in branch 2"), std::string::npos) << mouth->text;
  EXPECT_FALSE(way.find_astray(Vec3(-6.2, 0.0, kFirst))) << "no vessel is there";
  EXPECT_FALSE(way.find_astray(Vec3(6.2, 0.0, kSecond))) << "the way's own branch";
}

TEST(Way, TheOtherLegIsAcrossTheBifurcationWhicheverVesselTheTreeFollows) {
  // Two legs of 5 mm radius that meet in a vessel of 9 mm; the ball at the fork has 7 mm.
  const Vec3 foot(-40.0, 0.0, -80.0), other(40.0, 0.0, -80.0), head(0.0, 0.0, 100.0);
  const auto leg_and_on = [](const Vec3& from, const Vec3& to, double radius) {
    Centerline line = line_through({from, Vec3::Zero(), to}, radius);
    for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
      const double off = line.points.col(i).norm();
      line.radius(i) = off < 7.0 ? 7.0 : line.points(2, i) < 0.0 ? 5.0 : 9.0;
    }
    return line;
  };
  const auto out = [](const Vec3& to, double radius) {
    Centerline line = line_through({Vec3::Zero(), to}, radius);
    for (Eigen::Index i = 0; line.arc_length(i) < 7.0; ++i) line.radius(i) = 7.0;
    return line;
  };
  const Centerline path = leg_and_on(foot, Vec3(0.0, 0.0, 80.0), 9.0);
  const double at = foot.norm();
  const std::vector<std::vector<Branch>> trees = {
      {{leg_and_on(foot, head, 9.0), -1, 0.0}, {out(other, 5.0), 0, at}},
      {{leg_and_on(foot, other, 5.0), -1, 0.0}, {out(head, 9.0), 0, at}}};
  for (std::size_t k = 0; k < trees.size(); ++k) {
    SCOPED_TRACE(k);
    const Way way(path, trees[k]);
    ASSERT_TRUE(way.bifurcation());
    EXPECT_EQ(way.bifurcation()->child, 1);
    EXPECT_EQ(way.bifurcation()->takes_child, k == 1);
    for (const double deep : {0.13, 0.5}) {  // in the mouth, and half way down
      const auto astray = way.find_astray(deep * other);
      ASSERT_TRUE(astray) << deep;
      EXPECT_FALSE(astray->passed_by) << astray->text;
      EXPECT_EQ(astray->text, k == 0 ? "it is in branch 2, across the bifurcation"
                                     : "it is in branch 1, across the bifurcation");
    }
    EXPECT_FALSE(way.find_astray(0.5 * foot));
    EXPECT_FALSE(way.find_astray(0.5 * head));
  }
  // Nor is a branch that leaves the vessel sideways one, nor a fork of small arteries.
  const auto small = [](Centerline line) {
    line.radius *= 0.5;
    return line;
  };
  EXPECT_FALSE(Way(small(path),
                   {{small(leg_and_on(foot, head, 9.0)), -1, 0.0}, {small(out(other, 5.0)), 0, at}})
                   .bifurcation());
  EXPECT_FALSE(Way(into_branch(kSecond, 25.0), tree_of_fork()).bifurcation());
}

TEST(Way, OfTwoArteriesThatPartTheOtherIsAWrongBranchWhicheverIsWiderOrTheTreeFollows) {
  // From above, out of a vessel of 9 mm radius into two that turn from it by 37 deg.
  const Vec3 head(0.0, 0.0, 100.0), left(48.0, 0.0, -64.0), right(-48.0, 0.0, -64.0);
  const auto into = [&](const Vec3& from, const Vec3& leg, double radius) {
    Centerline line = from.isZero() ? line_through({from, leg}, radius)
                                    : line_through({from, Vec3::Zero(), leg}, radius);
    for (Eigen::Index i = 0; i < line.points.cols(); ++i) {
      if (line.points.col(i).norm() < 7.0) line.radius(i) = 7.0;
      if (line.points(2, i) > 5.0) line.radius(i) = 9.0;
    }
    return line;
  };
  for (const double wide : {4.8, 5.0, 5.2}) {
    for (const bool by_the_line : {true, false}) {
      SCOPED_TRACE(testing::Message() << wide << " mm beside 5 mm, " << by_the_line);
      const Vec3 end = by_the_line ? left : right, other = by_the_line ? right : left;
      const Way way(
          into(head, 0.75 * end, by_the_line ? 5.0 : wide),
          {{into(head, left, 5.0), -1, 0.0}, {into(Vec3::Zero(), right, wide), 0, head.norm()}});
      const auto astray = way.find_astray(0.5 * other);
      ASSERT_TRUE(astray);
      EXPECT_FALSE(astray->passed_by) << astray->text;
      EXPECT_EQ(astray->text,
                by_the_line ? "it is in branch 2, which leaves the way 60 mm before the target"
                            : "it is in branch 1, 40 mm beyond the fork where the way goes on "
                              "in branch 2");
      EXPECT_FALSE(way.find_astray(0.5 * end));
    }
  }
}

TEST(Way, TheOtherWayOfAVesselThatIsEnteredIsAnotherBranch) {
  // Out of an arm of 4 mm radius into a trunk of 10 mm, down it, and by the tree's first line up.
  const Vec3 hand(90.0, 0.0, 0.0), foot(0.0, 0.0, -120.0), head(0.0, 0.0, 120.0);
  const auto from_hand = [&](const Vec3& end) {
    Centerline line = line_through({hand, Vec3::Zero(), end}, 10.0);
    for (Eigen::Index i = 0; line.arc_length(i) < 90.0; ++i) {
      line.radius(i) = std::max(4.0, line.arc_length(i) - 80.0);
    }
    return line;
  };
  for (const bool first_up : {true, false}) {
    SCOPED_TRACE(first_up);
    const std::vector<Branch> tree = {
        {from_hand(first_up ? head : foot), -1, 0.0},
        {line_through({Vec3::Zero(), first_up ? foot : head}, 10.0), 0, 90.0}};
    ASSERT_TRUE(is_entered(tree, 1));
    EXPECT_FALSE(goes_on(tree, 1));
    const Way way(from_hand(0.7 * foot), tree);
    EXPECT_FALSE(way.find_astray(0.5 * foot));
    EXPECT_FALSE(way.find_astray(0.5 * hand));
    const auto astray = way.find_astray(0.5 * head);
    ASSERT_TRUE(astray);
    EXPECT_FALSE(astray->passed_by) << astray->text;
    EXPECT_NE(astray->text.find("where the way turns the other way"), std::string::npos)
        << astray->text;
  }
}

TEST(Way, TheEndOfTheImageIsOpenThoughItsModelIsClosed) {
  // A target in a branch; the wire runs to the closed end of the trunk, and is not pressed there.
  const Goal goal = goal_of(into_branch(kFirst, 25.0), tree_of_fork());
  const Introducer along{.point = Vec3(0.0, 0.0, 60.0), .direction = Vec3::UnitZ()};
  InsertionOptions still = options();
  still.friction = 0.0;
  const TrialResult trial = run_trial(wire_of(60.0), along, goal, fork(), still);
  EXPECT_EQ(trial.outcome, Outcome::kPassedBy) << outcome_name(trial.outcome) << trial.reason;
  EXPECT_NE(trial.reason.find("end of the imaged vessel"), std::string::npos) << trial.reason;
  EXPECT_EQ(trial.pushes.back().tip_force, 0.0);

  // A tube whose end is a dome: only the target's own branch, past the target.
  const Way way(line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 40.0}}, 5.0),
                {{line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 78.0}}, 5.0), -1, 0.0}});
  const Lumen dome(shapes::straight_tube(5.0, 80.0, 2.0));
  EXPECT_EQ(way.find_image_end(Vec3(0.0, 1.0, 76.0), dome), 0);
  EXPECT_FALSE(way.find_image_end(Vec3(0.0, 1.0, 60.0), dome));
  const Lumen goes_on(shapes::straight_tube(5.0, 120.0, 2.0));
  EXPECT_FALSE(way.find_image_end(Vec3(0.0, 1.0, 76.0), goes_on)) << "a loop was cut there";
}

TEST(Way, AWireBeyondASphereInTheTargetsOwnVesselMissedItAndPassedByNoBranch) {
  // A sphere beside the axis, 7 mm before the place where the wire comes to the end of the image.
  Goal goal = goal_of(line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 80.0}}, kTrunk), tree_of_fork());
  goal.at_section = false;
  goal.point = Vec3(3.0, 0.0, 80.0);
  goal.radius = 0.5;
  const Introducer along{.point = Vec3(0.0, 0.0, 60.0), .direction = Vec3::UnitZ()};
  const TrialResult trial = run_trial(wire_of(60.0), along, goal, fork(), options());
  EXPECT_EQ(trial.outcome, Outcome::kMissed) << outcome_name(trial.outcome) << trial.reason;
  EXPECT_EQ(trial.reason.find("the tip went by the target: it is in "), 0u) << trial.reason;
  EXPECT_NE(trial.reason.find("end of the imaged vessel"), std::string::npos) << trial.reason;
}

TEST(Way, ThePlaneOfTheSectionCountsInItsOwnLumenAlone) {
  // Two tubes side by side, their walls 2 mm apart: the section of one does not reach the other.
  const Lumen both(shapes::joined(shapes::straight_tube(4.0, 60.0, 1.5), [] {
    Surface other = shapes::straight_tube(4.0, 60.0, 1.5);
    other.vertices.row(0).array() += 10.0;
    return other;
  }()));
  const Way way(line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 40.0}}, 4.0));
  const auto wire_at = [](double x) {
    Eigen::Matrix3Xd wire(3, 12);
    for (int i = 0; i < 12; ++i) wire.col(i) = Vec3(x, 0.0, 20.0 + 2.0 * i);
    return wire;
  };
  for (const double x : {-3.5, 0.0, 3.5}) EXPECT_TRUE(way.find_arrival(wire_at(x), both)) << x;
  for (const double x : {6.5, 9.0}) EXPECT_FALSE(way.find_arrival(wire_at(x), both)) << x;
  Eigen::Matrix3Xd backward = wire_at(0.0).rowwise().reverse();
  EXPECT_FALSE(way.find_arrival(backward, both)) << "it comes from beyond";
  EXPECT_FALSE(way.find_arrival(wire_at(0.0).leftCols(10), both)) << "not there yet";
  EXPECT_EQ(way.find_arrival(wire_at(0.0), both), 9) << "the last node below 40 mm";
}

TEST(Way, AWireThatCameAnotherWayIsTold) {
  const Way way(into_branch(kSecond, 25.0), tree_of_fork());
  const auto nodes_along = [](const std::vector<Vec3>& corners) {
    return line_through(corners, 1.0).points;
  };
  EXPECT_FALSE(way.find_detour(
      nodes_along({{0.0, 3.0, 5.0}, {0.0, 3.0, 50.0}, {0.0, 0.0, 51.0}, {25.0, 0.0, 50.0}})));
  const auto bow = way.find_detour(
      nodes_along({{0.0, 0.0, 5.0}, {0.0, 0.0, 85.0}, {2.0, 0.0, 50.0}, {25.0, 0.0, 50.0}}));
  ASSERT_TRUE(bow);
  EXPECT_NE(bow->find("30 mm outside of the way"), std::string::npos) << *bow;
  EXPECT_NE(bow->find("in branch 1"), std::string::npos) << *bow;
  // A catheter's knee may lie in the trunk beyond the ostium, but in no vessel before that.
  EXPECT_FALSE(way.find_detour(
      nodes_along({{0.0, 0.0, 5.0}, {0.0, 0.0, 85.0}, {2.0, 0.0, 50.0}, {25.0, 0.0, 50.0}}), true));
  const auto first = way.find_detour(nodes_along({{0.0, 0.0, 5.0},
                                                  {0.0, 0.0, kFirst},
                                                  {30.0, 0.0, kFirst},
                                                  {2.0, 0.0, kFirst + 1.0},
                                                  {25.0, 0.0, 50.0}}),
                                     true);
  ASSERT_TRUE(first);
  EXPECT_NE(first->find("outside of the way"), std::string::npos) << *first;
  const auto fold = way.find_detour(nodes_along(
      {{0.0, 0.0, 5.0}, {0.0, 0.0, 48.0}, {3.0, 0.0, 20.0}, {2.0, 0.0, 48.0}, {25.0, 0.0, 50.0}}));
  ASSERT_TRUE(fold);
  EXPECT_NE(fold->find("runs back along the way"), std::string::npos) << *fold;
}

}  // namespace
}  // namespace wireplan::simulate
