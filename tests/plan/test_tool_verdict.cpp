// What is told of scripts: what stops those of catheter and wire, and which tool or length that
// asks for; and why searches for those of a wire alone ended.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "plan/tool_starts.h"
#include "tests/goal.h"
#include "tests/plan/known_plans.h"
#include "tests/plan/two_renals.h"

namespace wireplan::plan {
namespace {

/// As toward(1.0), with the aorta seen up to that height.
simulate::Goal goal_below(double top) {
  const auto way = std::make_shared<simulate::Way>(
      line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, kLevel}, {35.0, 0.0, kLevel}}),
      std::vector<preprocess::Branch>{
          {line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, top}}), -1, 0.0},
          {line_through({{0.0, 0.0, kLevel}, {44.0, 0.0, kLevel}}), 0, kLevel - 5.0}});
  return simulate::goal_at_end(way);
}

/// Ten trials that end so, and a pair whose catheter's tip came so near to the ostium.
WhatIsKnown tried(double top, Outcome outcome, double nearest_hook) {
  WhatIsKnown known;
  known.study.goal = goal_below(top);
  known.study.catheters = {catheter_of(650.0, 1.0, 8.0)};
  known.add_many(10, outcome);
  PairFindings& pair = known.plan.scripts.pairs.emplace_back();
  pair.pair = {.catheter = 0, .wire = 0};
  pair.nearest_hook = nearest_hook;
  pair.furthest = 61.0;
  pair.stopped = "the wire comes no further";
  return known;
}

bool changes_by_words(const WhatIsKnown& known, const std::string& words) {
  for (const std::string& text : known.verdict().changes) {
    if (text.find(words) != std::string::npos) return true;
  }
  return false;
}

TEST(ToolVerdict, OfAPlanWithFewerRepeatsThanTheFirstItIsToldOverHowMany) {
  for (const int count : {4, 16}) {
    WhatIsKnown known = WhatIsKnown::good();
    known.plan.trials[0].metrics.peak_tip_force = 0.4;  // above the warning level
    known.add(Outcome::kReached).peak_contact_force = 0.9;
    known.repeat(2, count);
    known.refine(2, 0.1);
    EXPECT_EQ(changes_by_words(known, "): tip force at most 0.10 N, over 4 disturbed repeats."),
              count == 4);
    EXPECT_EQ(changes_by_words(known, "): tip force at most 0.10 N."), count == 16);
  }
}

TEST(ToolVerdict, TheTrunkBeyondTheOstiumIsWhatIsSeenOfIt) {
  EXPECT_NEAR(find_ostium(goal_below(128.0)).value().trunk_beyond, 128.0 - kLevel, 1.0);
  EXPECT_NEAR(find_ostium(goal_below(75.0)).value().trunk_beyond, 75.0 - kLevel, 1.0);
}

TEST(ToolVerdict, AsksForSoMuchMoreOfTheVesselAsALedCatheterTakes) {
  ASSERT_NEAR(room_beyond(), 33.0, 1e-9);
  // 15 mm are seen past the ostium; the line's points are 1 mm apart.
  const WhatIsKnown left = tried(75.0, Outcome::kLeftImage, 2.0);
  EXPECT_TRUE(changes_by_words(
      left,
      "18 mm more of the vessel past the branch: all 10 trials came to an end of the imaged "
      "vessel. It ends 15.0 mm past the ostium, and 33.0 mm are what it takes"));
  EXPECT_TRUE(changes_by_words(tried(75.0, Outcome::kPassedBy, 2.0),
                               "18 mm more of the vessel past the branch: it ends 15.0 mm past"));
  // With room, and without a catheter, that is not what is missing.
  EXPECT_FALSE(changes_by_words(tried(128.0, Outcome::kPassedBy, 2.0), "more of the vessel"));
  WhatIsKnown wires = left;
  wires.study.catheters.clear();
  wires.plan.scripts.pairs.clear();
  EXPECT_TRUE(changes_by_words(wires, "A scan that shows more of the vessel: all 10 trials"));
}

TEST(ToolVerdict, TellsACatheterThatDoesNotComeToTheOstiumFromAWireThatDoesNotTurnIn) {
  EXPECT_TRUE(changes_by_words(
      tried(128.0, Outcome::kPassedBy, 9.66),
      "No catheter's tip came to the ostium: hook (9.7 mm). The branch turns by 90.0 degrees from "
      "a trunk that is 18.0 mm wide, which asks for a catheter with a hooked curve about as wide"));
  EXPECT_TRUE(changes_by_words(
      tried(128.0, Outcome::kPassedBy, 0.4),
      "The catheter's tip came to the ostium (hook (0.4 mm)), but the wire out of it no further "
      "than 61.0 of 90.0 mm along the way: that asks for a wire with a softer tip than straight "
      "(50 N mm^2), or one with an angled tip."));
  WhatIsKnown found = tried(128.0, Outcome::kPassedBy, 0.4);
  found.plan.scripts.pairs[0].found = 2;
  EXPECT_FALSE(changes_by_words(found, "came to the ostium"));
}

TEST(Verdict, TellsTheScriptsThatWereSearched) {
  WhatIsKnown bench;
  bench.add_many(10, Outcome::kPassedBy);
  EXPECT_FALSE(tells(bench.verdict().reasons, "were searched"));
  bench.plan.scripts.starts_tried = 2;
  bench.plan.scripts.branches = 345;
  EXPECT_TRUE(tells(bench.verdict().reasons,
                    "searched too: 345 pushes from 2 starts, none of them reached."));
  bench.plan.scripts.searches = {
      {.level = Level::kScout,
       .effort = {.branches = 300, .iterations = 800, .most_iterations = 900, .no_further = 2}},
      {.level = Level::kFull,
       .effort = {.branches = 45,
                  .iterations = 95,
                  .most_iterations = 90,
                  .no_further = 1,
                  .cut_off = 1}}};
  EXPECT_TRUE(tells(bench.verdict().reasons,
                    "none of them reached. In coarse trials more turns brought the tip no further "
                    "from 2 starts. In full detail more turns brought the tip no further from 1 "
                    "start and the search was cut off at its limit of work from 1 start. Where it "
                    "was cut off, scripts may have been missed: with fewer wires in the case it "
                    "goes further for each."));
  bench.plan.scripts.searches.pop_back();
  EXPECT_FALSE(tells(bench.verdict().reasons, "may have been missed"));
  bench.add_many(5, Outcome::kLeftImage);  // leaves it open, and so it stays
  EXPECT_EQ(bench.verdict().answer, Answer::kUnsure);
}

TEST(Verdict, WhatWentByTheTargetDidNotEndBeforeItForWantOfWire) {
  for (const bool at_section : {true, false}) {
    WhatIsKnown bench;
    bench.study.goal = goal_below(128.0);
    bench.study.goal.at_section = at_section;
    bench.study.goal.radius = 0.5;
    const Eigen::VectorXd& arc = bench.study.goal.way->path().arc_length;
    const double whole = arc[arc.size() - 1];
    bench.add(Outcome::kMissed).insertion = 400.0;  // all that may go in
    bench.plan.trials[0].progress = whole - 1.0;
    EXPECT_TRUE(tells(bench.verdict().changes, "More wire in the vessel: the one trial ended bef"));
    bench.plan.trials[0].progress = whole;
    const Verdict verdict = bench.verdict();
    EXPECT_TRUE(tells(verdict.reasons, "The one trial went by the target."));
    EXPECT_EQ(verdict.changes.size(), 1U);
    EXPECT_TRUE(tells(verdict.changes, at_section
                                           ? "the one trial ended beside the target or beyond it"
                                           : "the one trial missed the sphere of 0.5 mm radius"));
  }
}

Catheter curved(const std::string& name, double angle) {
  Catheter catheter;
  catheter.tool.wire = {
      .name = name,
      .radius = 0.83,
      .sections = {{.length = 10.0 * angle, .bending_stiffness = 99.0, .rest_curvature = 0.1},
                   {.length = 600.0, .bending_stiffness = 332.0}}};
  return catheter;
}

TEST(Verdict, OfCathetersThatDoNotReachSaysWhatStopsThemAndWhichAreLeft) {
  WhatIsKnown bench;
  bench.add_many(9, Outcome::kPassedBy);
  bench.study.catheters = {curved("cobra", 1.5), curved("short", 1.5)};
  std::vector<PairFindings>& pairs = bench.plan.scripts.pairs;
  pairs.resize(2);
  pairs[0].pair = {.catheter = 0, .wire = 0};
  pairs[0].nearest_hook = 9.66;
  pairs[0].stopped = "it turns aside";
  pairs[1].pair = {.catheter = 1, .wire = 0, .unfit = "catheter too short"};
  const Verdict verdict = bench.verdict();
  EXPECT_TRUE(tells(verdict.reasons,
                    "No script of cobra with straight reaches: it turns aside; the catheter's tip "
                    "came no nearer to the ostium than 9.7 mm."));
  bench.study.wires.emplace_back().name = "soft";
  pairs[0].exchange = {.first_wire = 1, .found = 0, .held = 0.0, .stopped = "it falls out"};
  EXPECT_TRUE(tells(bench.verdict().reasons,
                    "came no nearer to the ostium than 9.7 mm; nor does it in exchange for soft "
                    "through the placed catheter: it falls out."));
  pairs[0].exchange.stopped.clear();
  EXPECT_FALSE(tells(bench.verdict().reasons, "No script of cobra")) << "brought in so, it reaches";
  EXPECT_TRUE(tells(verdict.reasons, "Not tried was short with straight: catheter too short."));
  EXPECT_TRUE(
      tells(verdict.changes,
            "A catheter of another shape: all 9 trials went past the branch, though cobra was "
            "tried; a simple curve and a reversed curve were not."));
  pairs.erase(pairs.begin());
  EXPECT_TRUE(tells(bench.verdict().changes, "short could not be tried (catheter too short)."));
  bench.study.catheters = {curved("cobra", 1.5), curved("vertebral", 0.8), curved("sos", 4.0)};
  pairs.clear();
  for (int k = 0; k < 3; ++k) {
    pairs.emplace_back().pair = {.catheter = k, .wire = 0};
    pairs.back().furthest = 9.0;
  }
  EXPECT_TRUE(tells(bench.verdict().changes,
                    "Another access, or a catheter of another width: all 9 trials went past the "
                    "branch, though cobra, vertebral and sos were tried."));
}

TEST(Verdict, CountsThePairsThatItDoesNotName) {
  WhatIsKnown bench;
  bench.add_many(2, Outcome::kPassedBy);
  bench.study.catheters.assign(6, curved("short", 1.5));
  for (int k = 0; k < 6; ++k) {
    PairFindings& pair = bench.plan.scripts.pairs.emplace_back();
    pair.pair = {.catheter = k, .wire = 0, .unfit = "catheter too short"};
    const Verdict verdict = bench.verdict();
    EXPECT_EQ(tells(verdict.reasons, "1 other pair of catheter and wire was not tried"), k == 4);
    EXPECT_EQ(tells(verdict.reasons, "2 other pairs of catheter and wire were not tried"), k == 5);
  }
  EXPECT_TRUE(tells(bench.verdict().reasons, "Both trials passed by the branch."));
}

}  // namespace
}  // namespace wireplan::plan
