// A reversed curve that does not open in the trunk: the vessels that it can be reshaped in, what
// the hand is told, and that it comes into a branch that runs down from an aorta above two legs,
// and into one of an arch that leans back, over a vessel before it or out of the aorta beyond.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "plan/catheter_choice.h"
#include "plan/side_vessels.h"
#include "plan/tool_neighbours.h"
#include "plan/tool_search.h"
#include "tests/plan/arch.h"
#include "tests/plan/iliacs.h"

namespace wireplan::plan {
namespace {

using preprocess::Branch;
using simulate::kBothTools;
using simulate::SideVessel;
using simulate::ToolStep;
using simulate::Until;

double ostium_arc(const simulate::Way& way) {
  simulate::Goal goal;
  goal.way = std::make_shared<simulate::Way>(way);
  return find_ostium(goal).value().arc;
}

/// The branches of those that serve.
std::vector<int> served(const simulate::Way& way, const simulate::Wire& tube) {
  std::vector<int> branches;
  const std::vector<SideVessel> sides = find_side_vessels(way, ostium_arc(way));
  for (const SideVessel& side : list_reshaping_vessels(way, ostium_arc(way), sides, tube)) {
    branches.push_back(side.branch);
  }
  return branches;
}

TEST(SideVessels, TheOtherLegLeavesTheWayWhereItsWallDoes) {
  const simulate::Way way = *iliacs::way();
  const std::vector<SideVessel> sides = find_side_vessels(way, ostium_arc(way));
  ASSERT_EQ(sides.size(), 1U) << "the renal artery is the target's";
  const simulate::TakeOff& place = sides[0].take_off;
  EXPECT_EQ(sides[0].branch, 1);
  // Along the leg it runs 30 degrees off the way down, and the trunk straight up.
  EXPECT_NEAR(place.branch.dot(iliacs::leg(1, 1)), 1.0, 0.01);
  EXPECT_NEAR(place.trunk.z(), 1.0, 0.01);
  // The legs' axes part by 60 degrees: where they are a leg's radius apart, to the line's mouth.
  EXPECT_GT(place.point.x(), 0.0);
  EXPECT_NEAR((place.point - iliacs::leg(1, place.point.norm())).norm(), 0.0, 2.5);
  EXPECT_GT(2.0 * place.point.x(), iliacs::kLegRadius);
  EXPECT_LT(place.arc, 70.0);
}

TEST(SideVessels, WhichServeAndWhichDoNot) {
  const simulate::Wire simmons = iliacs::simmons().tool.wire;
  EXPECT_NEAR(knee_length(simmons), 8.0 + 8.4 + 25.0 + 0.5 * 35.6, 1e-9);
  EXPECT_EQ(served(*iliacs::way(), simmons), (std::vector<int>{1}));
  EXPECT_TRUE(find_side_vessels(*iliacs::way({}), 172.0).empty()) << "without a tree";

  simulate::Wire hooked = simmons;
  hooked.sections[3].rest_curvature = 0.0;
  ASSERT_NE(find_shape(hooked).kind, CurveKind::kReversed);
  EXPECT_TRUE(served(*iliacs::way(), hooked).empty()) << "it has no knee";

  const auto with_leg = [&](auto change) {
    std::vector<Branch> tree = iliacs::tree();
    change(tree[1].line);
    return served(*iliacs::way(std::move(tree)), simmons);
  };
  EXPECT_TRUE(with_leg([](Centerline& line) {
                line.radius.tail(40).setConstant(4.5);
                line.radius.segment(30, 20).setConstant(1.6);
              }).empty())
      << "less than twice as wide as the catheter where its tip goes";
  EXPECT_TRUE(with_leg([](Centerline& line) {
                line = iliacs::line_through({Vec3(0, 0, iliacs::kForkLevel), iliacs::leg(1, 90)});
              }).empty())
      << "79 mm for knee and wire do not fit into it";
  EXPECT_EQ(with_leg([](Centerline& line) {
              line = iliacs::line_through({Vec3(0, 0, iliacs::kForkLevel), iliacs::leg(1, 108)});
            }),
            (std::vector<int>{1}));

  // A vessel beyond the ostium, and one out of the leg, where no knee has room.
  std::vector<Branch> tree = iliacs::tree();
  const auto beside = [](const Vec3& from, const Vec3& to, double parent_arc) {
    Branch branch{shapes::line_through({from, to}, 4.0), 0, parent_arc};
    branch.line.radius.head(8).setConstant(8.0);
    return branch;
  };
  tree[1] = beside(Vec3(0, 0, 120), Vec3(-110, 0, 120), 190.0);
  EXPECT_TRUE(served(*iliacs::way(tree), simmons).empty());
  tree[1] = beside(iliacs::leg(-1, 40), iliacs::leg(-1, 40) + Vec3(-110, 0, 0), 30.0);
  tree[1].line.radius.head(8).setConstant(iliacs::kLegRadius);
  EXPECT_TRUE(served(*iliacs::way(tree), simmons).empty());
}

TEST(SideVessels, TheOtherLegIsFoundWhereTheTreeGoesOnInItToo) {
  // The root runs from leg to leg, and the aorta is its child.
  const Vec3 access = iliacs::leg(-1, 70), fork(0, 0, iliacs::kForkLevel);
  const double up = (fork - access).norm();
  const std::vector<Branch> tree = {
      {iliacs::line_through({access, fork, iliacs::leg(1, iliacs::kLegLength - 1.0)}), -1, 0.0},
      {iliacs::line_through({fork, Vec3(0, 0, iliacs::kTop - 2.0)}), 0, up},
      {iliacs::line_through({Vec3(0, 0, iliacs::kRenalLevel), iliacs::renal(59)}), 1,
       iliacs::kRenalLevel - iliacs::kForkLevel}};
  const simulate::Way way = *iliacs::way(tree);
  ASSERT_TRUE(way.bifurcation().has_value());
  const std::vector<SideVessel> sides = find_side_vessels(way, ostium_arc(way));
  ASSERT_EQ(sides.size(), 1U);
  EXPECT_EQ(sides[0].branch, 0);
  EXPECT_GT(sides[0].from, up) << "behind the fork";
  const std::vector<SideVessel> other =
      find_side_vessels(*iliacs::way(), ostium_arc(*iliacs::way()));
  EXPECT_LT((sides[0].take_off.point - other[0].take_off.point).norm(), 1.0);
  EXPECT_EQ(served(way, iliacs::simmons().tool.wire), (std::vector<int>{0}));
}

TEST(SideVessels, AnArchGoesOnPastTheOstiumOfTheTarget) {
  // The way turns up into the carotid artery, and back, before the knee of a curve has its room.
  const arch::Arch wide{.descending = 15.0, .ascending = 15.0};
  std::vector<Branch> tree = arch::tree(wide);
  const double beyond = 150.0 * kRadPerDeg;  // a vessel next to the target's, further on
  tree.push_back({arch::line_through(
                      wide, {arch::on_arch(beyond), arch::on_arch(beyond) + Vec3(0, 0, 120)}, 5.0),
                  0, arch::arc_to(beyond)});
  const simulate::Way way = *arch::way(wide, tree);
  const std::vector<SideVessel> sides = find_side_vessels(way, ostium_arc(way));
  ASSERT_EQ(sides.size(), 1U);
  EXPECT_EQ(sides[0].branch, 1);
  const simulate::TakeOff& place = sides[0].take_off;
  EXPECT_NEAR(place.branch.dot(Vec3(0.6, 0.0, 0.8)), 1.0, 0.01);
  // From half a width of the aorta behind the mouth to two: the chord of a circle.
  const double level = std::atan2(place.point.z(), place.point.x());
  EXPECT_NEAR(place.arc, arch::arc_to(level), 0.5);
  const double middle = level + 1.25 * 30.0 / arch::kBend;
  EXPECT_GT(place.arc + 60.0, arch::arc_to(arch::kCarotidAt)) << "the way leaves it before that";
  EXPECT_NEAR(place.trunk.dot(Vec3(-std::sin(middle), 0.0, std::cos(middle))), 1.0, 0.01);
  const arch::Arch narrow;
  EXPECT_EQ(served(*arch::way(narrow, arch::tree(narrow)), iliacs::simmons().tool.wire),
            (std::vector<int>{1}));
}

TEST(SideVessels, ACurveOpensInATrunkThatIsWideAndLongEnoughBeyondTheOstium) {
  const simulate::Wire simmons = iliacs::simmons().tool.wire;
  const auto with_straight = [&](double length) {
    simulate::Wire tube = simmons;
    tube.sections[2].length = length;
    return tube;
  };
  const auto depth_in = [](const arch::Arch& shape, const simulate::Wire& tube) {
    const simulate::Way way = *arch::way(shape, arch::tree(shape));
    const std::optional<double> depth = find_opening_depth(way, ostium_arc(way), tube);
    return depth ? ostium_arc(way) + *depth : 0.0;
  };
  const arch::Arch wide{.ascending = 17.0};
  const std::optional<Ostium> ostium = find_ostium(arch::study(wide).goal);
  ASSERT_TRUE(ostium);
  const double level = arch::arc_to(std::atan2(ostium->point.z(), ostium->point.x()));
  // Its length and a radius of the last curve past the level of the ostium; no further than the
  // image, of which a wire takes 12 mm ahead and 9 mm short of the end.
  EXPECT_NEAR(depth_in(wide, simmons), level + 77.0 + 12.0, 0.5);
  EXPECT_NEAR(depth_in(wide, with_straight(10.0)), level + 62.0 + 12.0, 0.5);
  const double end = arch::arc_to(kPi) + arch::kUp - 2.0;
  ASSERT_GT(level + 87.0 + 12.0, end - 21.0);
  EXPECT_NEAR(depth_in(wide, with_straight(35.0)), end - 21.0, 0.5);
  EXPECT_EQ(depth_in(wide, with_straight(70.0)), 0.0) << "104 mm before the knee, and 94 of aorta";
  EXPECT_EQ(depth_in({}, simmons), 0.0) << "21 mm for a curve of 24";
  simulate::Wire hooked = simmons;
  hooked.sections[3].rest_curvature = 0.0;
  EXPECT_EQ(depth_in(wide, hooked), 0.0);
}

const ToolScript kReshaped = {
    {.tool = 1, .push = 107.0},
    {.tool = 0, .push = 92.0},
    {.tool = 1, .push = -38.0},
    {.tool = 0, .turn = 120.0 * kRadPerDeg},
    {.tool = kBothTools, .push = -20.0, .until = Until::kLevel, .at = -3.0, .side = 1},
    {.tool = 1, .push = 142.0, .until = Until::kInBranch, .at = 79.0, .side = 1},
    {.tool = 0, .push = 65.0, .until = Until::kInBranch, .at = 50.0, .side = 1},
    {.tool = 1, .push = -107.0},
    {.tool = 0, .push = 159.0, .until = Until::kLevel, .at = 2.0, .side = 1},
    {.tool = kBothTools, .push = 140.0, .until = Until::kLevel, .at = 10.0},
    {.tool = kBothTools, .push = -42.0, .until = Until::kLevel, .at = 3.0},
    {.tool = 1, .push = 200.0}};

TEST(ReshapingSteps, CallTheVesselByItsName) {
  const auto told = describe_steps(kReshaped, 286.0, {.sides = {{1, "left iliac (branch 2)"}}});
  EXPECT_EQ(told[4].text,
            "pull back catheter and wire together until the catheter's tip is 3 mm short of the "
            "level of the ostium of left iliac (branch 2), by 20 mm at most");
  EXPECT_EQ(told[5].text,
            "advance the wire into left iliac (branch 2) until its tip is 79 mm past the ostium "
            "there, by 142 mm at most");
  EXPECT_EQ(told[6].text,
            "advance the catheter over the wire into left iliac (branch 2) until its tip is 50 mm "
            "past the ostium there, by 65 mm at most");
  EXPECT_EQ(told[8].text,
            "advance the catheter until its knee has opened in the trunk and its tip is 2 mm "
            "beyond the level of the ostium of left iliac (branch 2), by 159 mm at most");
  EXPECT_EQ(told[10].text,
            "pull back catheter and wire together until the catheter's tip is 3 mm beyond the "
            "level of the ostium, by 42 mm at most");
  EXPECT_NE(describe_steps(kReshaped, 286.0)[5].text.find("into branch 2 until"), std::string::npos)
      << "without a name";
  const Study study = iliacs::study();
  const Candidate candidate{.catheter = 0, .steps = kReshaped};
  EXPECT_NE(describe_script(study, candidate, 286.0).find("into branch 2 until"),
            std::string::npos);
  EXPECT_EQ(as_written(kReshaped), kReshaped);
  EXPECT_EQ(find_broken_rule(kReshaped, study.catheters[0], study.wires[0], {}), "");
}

TEST(ReshapingSteps, TellThatATipLooksBack) {
  const ToolScript steps = {
      {.tool = 0, .push = 219.0, .until = Until::kBack, .at = 100.0 * kRadPerDeg}};
  EXPECT_EQ(describe_steps(steps, 286.0)[0].text,
            "advance the catheter until its tip looks back, 100 degrees from where the vessel goes "
            "on, by 219 mm at most");
  EXPECT_TRUE(is_reshaped(steps));
  EXPECT_EQ(as_written(steps), steps);
  ToolStep rounded = steps[0];
  end_at(rounded, Until::kBack, 98.0 * kRadPerDeg);
  EXPECT_NEAR(rounded.at, 100.0 * kRadPerDeg, 1e-12) << "to five degrees";
}

TEST(ReshapingSteps, APushThatEndsByWhatIsSeenIsAStepOfItsOwn) {
  const ToolStep up{.tool = 1, .push = 60.0, .steers = 16}, on{.tool = 1, .push = 30.0};
  const ToolStep into{.tool = 1, .push = 90.0, .until = Until::kInBranch, .at = 79.0, .side = 1};
  EXPECT_EQ(with(with({}, up), into), (ToolScript{up, into}));
  ASSERT_EQ(with(with({}, up), on).size(), 1U);
  EXPECT_EQ(with(with({}, up), on)[0].push, 90.0);
}

TEST(ReshapingSteps, AKneeIsPulledDeeperAndItsNeighboursReshapeAlike) {
  const std::optional<Ostium> ostium = find_ostium(iliacs::study().goal);
  ASSERT_TRUE(ostium);
  EXPECT_EQ(with_seat(kReshaped, *ostium, {}).back().push, -60.0);
  ToolScript plain = kReshaped;
  for (ToolStep& step : plain) step.side = -1;
  EXPECT_FALSE(is_reshaped(plain));
  EXPECT_EQ(with_seat(plain, *ostium, {}).back().push, 60.0);
  // The last pull alone: turn and advance were made where the curve is reshaped.
  const std::vector<ToolScript> neighbours = list_neighbours(kReshaped, 10);
  ASSERT_EQ(neighbours.size(), 3U);
  for (const ToolScript& neighbour : neighbours) {
    EXPECT_TRUE(std::equal(kReshaped.begin(), kReshaped.begin() + 10, neighbour.begin()));
  }
  EXPECT_EQ(neighbours[1][10].at, 5.0);
  EXPECT_EQ(neighbours[2][10].at, 1.0);
}

TEST(Reshaping, BringsASimmonsOverTheBifurcationIntoABranchThatRunsDown) {
  Study study = iliacs::study();
  const std::optional<Ostium> ostium = find_ostium(study.goal);
  ASSERT_TRUE(ostium);
  EXPECT_EQ(asked_for(take_off_of(*ostium)), CurveKind::kReversed);
  const ToolScripts found = find_tool_scripts(study, iliacs::vessel(), {.threads = 2});
  ASSERT_GT(found.pairs.at(0).found, 0) << found.pairs[0].stopped;
  EXPECT_GE(found.pairs[0].held, kSteadyShare);
  for (const Candidate& script : found.found) {
    EXPECT_TRUE(is_reshaped(script.steps)) << describe_script(study, script, 300.0);
    EXPECT_EQ(find_broken_rule(script.steps, study.catheters[0], study.wires[0], {}), "");
  }
  // In full as in the search, from the introducer, and in both the tip comes out of the other leg.
  const simulate::TrialResult trial = run_candidate(study, found.found[0], iliacs::vessel());
  EXPECT_EQ(trial.outcome, simulate::Outcome::kReached) << trial.reason;
  EXPECT_GT(trial.nodes.row(2).maxCoeff(), iliacs::kRenalLevel + 20.0) << "the knee is above";

  // The same tree without the other leg: there is nowhere to reshape it, and nothing is found.
  std::vector<Branch> tree = iliacs::tree();
  tree.erase(tree.begin() + 1);
  study.goal.way = iliacs::way(std::move(tree));
  const ToolScripts plain = find_tool_scripts(study, iliacs::vessel(), {.threads = 2});
  EXPECT_EQ(plain.pairs.at(0).found, 0);
  EXPECT_NE(plain.pairs[0].stopped.find("; no vessel that leaves the way before the ostium serves "
                                        "to reshape its curve"),
            std::string::npos)
      << plain.pairs[0].stopped;
}

TEST(Reshaping, BringsASimmonsOverTheSubclavianArteryIntoACarotidThatLeansBack) {
  const arch::Arch shape;
  const simulate::VesselModel vessel = arch::vessel(shape);
  const Study study = arch::study(shape);
  const std::optional<Ostium> ostium = find_ostium(study.goal);
  ASSERT_TRUE(ostium);
  EXPECT_EQ(asked_for(take_off_of(*ostium)), CurveKind::kReversed);
  const ToolScripts found = find_tool_scripts(study, vessel, {.threads = 2});
  ASSERT_GT(found.pairs.at(0).found, 0) << found.pairs[0].stopped;
  EXPECT_GE(found.pairs[0].held, kSteadyShare);
  for (const Candidate& script : found.found) {
    // The wire goes into the subclavian artery, the catheter after it, and comes out as a knee.
    EXPECT_TRUE(is_reshaped(script.steps)) << describe_script(study, script, 300.0);
    EXPECT_EQ(find_broken_rule(script.steps, study.catheters[0], study.wires[0], {}), "");
  }
  const simulate::TrialResult trial = run_candidate(study, found.found[0], vessel);
  EXPECT_EQ(trial.outcome, simulate::Outcome::kReached) << trial.reason;
  EXPECT_LT(trial.nodes.row(0).minCoeff(), ostium->point.x() - 20.0) << "the knee is beyond";
  EXPECT_GT(trial.nodes.row(2).maxCoeff(), arch::carotid(50.0).z()) << "the tip in the carotid";
}

TEST(Reshaping, OpensASimmonsInAWideAscendingAortaAndPullsItBackIntoACarotid) {
  // No wire goes into the subclavian artery: that is told as narrow.
  const arch::Arch shape{.ascending = 17.0};
  const simulate::VesselModel vessel = arch::vessel(shape);
  Study study = arch::study(shape);
  std::vector<Branch> tree = arch::tree(shape);
  tree[1].line.radius.tail(150).setConstant(1.5);
  study.goal.way = arch::way(shape, tree);
  const ToolScripts found = find_tool_scripts(study, vessel, {.threads = 2});
  ASSERT_GT(found.pairs.at(0).found, 0) << found.pairs[0].stopped;
  EXPECT_GE(found.pairs[0].held, kSteadyShare);
  for (const Candidate& script : found.found) {
    EXPECT_TRUE(is_reshaped(script.steps)) << describe_script(study, script, 300.0);
    for (const ToolStep& step : script.steps) EXPECT_EQ(step.side, -1);
    EXPECT_EQ(find_broken_rule(script.steps, study.catheters[0], study.wires[0], {}), "");
  }
  const Candidate& first = found.found[0];
  const simulate::TrialResult trial = run_candidate(study, first, vessel);
  EXPECT_EQ(trial.outcome, simulate::Outcome::kReached) << trial.reason;
  EXPECT_GT(trial.nodes.row(2).maxCoeff(), arch::carotid(50.0).z()) << "the tip in the carotid";
  // It opens where the aorta runs straight down: a tip that looks back looks up.
  simulate::ToolTrial made(tools_of(study, first), make_introducer(study, first), study.goal,
                           vessel, tool_options(study, first));
  int opened = 0;
  for (const ToolStep& step : first.steps) {
    const double before = made.measure(Until::kBack, 0);
    made.make(step);
    if (step.until != Until::kBack) continue;
    ++opened;
    EXPECT_LT(before, step.at);
    ASSERT_LT(made.tip(0).z(), -shape.ascending);
    EXPECT_NEAR(made.measure(Until::kBack, 0), std::acos(-made.tip_direction(0).z()), 1e-9);
    EXPECT_GT(made.measure(Until::kBack, 0), step.at - 0.05);
  }
  EXPECT_EQ(opened, 1);
}

}  // namespace
}  // namespace wireplan::plan
