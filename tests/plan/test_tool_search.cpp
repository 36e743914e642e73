// Scripts of catheter and wire: which pairs are tried, what breaks the rules, and, in an aorta with
// a branch on either side, that mirrored targets have mirrored scripts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "plan/catheter_choice.h"
#include "plan/judge.h"
#include "plan/refine.h"
#include "plan/tool_neighbours.h"
#include "plan/tool_search.h"
#include "tests/goal.h"
#include "tests/plan/memory_log.h"
#include "tests/plan/two_renals.h"

namespace wireplan::plan {
namespace {

using simulate::kBothTools;
using simulate::ToolStep;
using simulate::Until;

const Ostium kOstium{{.arc = 300.0}, 20.0, 5.0, 340.0};

std::string unfit(const Catheter& catheter, const simulate::Wire& wire) {
  return list_pairs({catheter}, {wire}, kOstium, {}).at(0).unfit;
}

TEST(ToolPairs, WhatDoesNotFitIsToldWithTheReason) {
  const Catheter fits = catheter_of(650.0, 1.0);
  EXPECT_EQ(unfit(fits, wire_of(1500.0, 0.44)), "");
  EXPECT_EQ(unfit(fits, wire_of(1500.0, 0.5)), "wire too thick: 1 mm in a lumen of 1 mm");
  EXPECT_EQ(unfit(catheter_of(340.0, 1.0), wire_of(1500.0, 0.44)),
            "catheter too short: 340 mm, and the way to the ostium takes 300 mm with 50 mm to stay "
            "outside");
  EXPECT_EQ(unfit(catheter_of(350.0, 1.0), wire_of(1500.0, 0.44)), "");
  // 650 - 300 behind the ostium, 340 to the target and 100 to hold.
  EXPECT_EQ(unfit(fits, wire_of(790.0, 0.44)), "");
  EXPECT_EQ(unfit(fits, wire_of(789.0, 0.44)),
            "wire too short: 789 mm, and 790 mm are needed to hold it behind a catheter of 650 mm");
  EXPECT_EQ(unfit(catheter_of(650.0, 1.0, 21.0), wire_of(1500.0, 0.44)),
            "curve wider than the vessel: 21 mm at the tip, in a lumen of 20 mm before the ostium");
  Ostium narrow = kOstium;
  narrow.narrowest = 1.6;
  EXPECT_EQ(
      list_pairs({fits}, {wire_of(1500.0, 0.44)}, narrow, {}).at(0).unfit,
      "catheter too thick: 1.66 mm, and the way to the ostium is 1.6 mm wide at its narrowest");
}

TEST(ToolPairs, AreAllPairsWiresOutermost) {
  const std::vector<ToolPair> pairs =
      list_pairs({catheter_of(650.0, 1.0), catheter_of(650.0, 0.6)},
                 {wire_of(1500.0, 0.44), wire_of(1500.0, 0.2)}, kOstium, {});
  ASSERT_EQ(pairs.size(), 4U);
  EXPECT_EQ(pairs[1].catheter, 1);
  EXPECT_EQ(pairs[1].wire, 0);
  EXPECT_EQ(pairs[0].unfit + pairs[2].unfit + pairs[3].unfit, "");
  EXPECT_NE(pairs[1].unfit, "");
}

TEST(ToolRules, NameTheStepThatBreaksThem) {
  const Catheter soft = catheter_of(650.0, 1.0);
  Catheter stiff = soft;
  stiff.tool.wire.sections[0].bending_stiffness = 200.0;
  const simulate::Wire wire = wire_of(1200.0, 0.44);
  const auto broken = [&](const std::vector<ToolStep>& steps, const Catheter& catheter) {
    return find_broken_rule(steps, catheter, wire, {});
  };
  const std::vector<ToolStep> good = {
      {.tool = 1, .push = 200.0},          {.tool = 0, .push = 180.0},
      {.tool = 1, .push = -60.0},          {.tool = 0, .turn = 0.5 * kPi},
      {.tool = kBothTools, .push = -20.0}, {.tool = 1, .push = 100.0}};
  EXPECT_EQ(broken(good, soft), "");
  EXPECT_EQ(broken(good, stiff), "") << "it is only pulled without a wire in its tip";
  std::vector<ToolStep> leads = good;
  leads[4].push = 20.0;
  EXPECT_EQ(broken(leads, soft), "") << "a soft tip may lead";
  EXPECT_EQ(broken(leads, stiff),
            "step 5: the catheter's tip is pushed ahead of the wire, and is no soft one");
  EXPECT_EQ(find_broken_rule({{.tool = 1, .push = 700.0}, {.tool = 0, .push = 601.0}}, soft,
                             wire_of(2000.0, 0.44), {}),
            "step 2: less than 50 mm of catheter stay outside");
  EXPECT_EQ(broken({{.tool = 1, .push = 447.0}}, soft),
            "step 1: less than 100 mm of wire are left behind the catheter's hub");
  EXPECT_EQ(broken({{.tool = 1, .push = 446.0}}, soft), "");
  EXPECT_EQ(broken({{.tool = 0, .turn = kPi}, {.tool = 0, .turn = 0.1}}, soft),
            "step 2: the catheter is turned by more than 180 degrees in one place");
  EXPECT_EQ(
      broken({{.tool = 0, .turn = kPi}, {.tool = 0, .push = 3.0}, {.tool = 0, .turn = 0.1}}, soft),
      "");
}

TEST(ToolRules, BoundTheTurnByTheWayThatFollows) {
  const Catheter soft = catheter_of(650.0, 1.0);
  const simulate::Wire wire = wire_of(1200.0, 0.44);
  std::vector<ToolStep> steps = {{.tool = 1, .push = 200.0},         {.tool = 0, .push = 100.0},
                                 {.tool = 0, .turn = kPi},           {.tool = 1, .push = -50.0},
                                 {.tool = kBothTools, .push = -1.5}, {.tool = 1, .push = 100.0}};
  EXPECT_EQ(find_broken_rule(steps, soft, wire, {}),
            "step 5: the catheter was turned by 180 degrees, and is moved by 1.5 mm alone; 90 "
            "degrees per mm are the most");
  steps[4].push = -2.0;
  EXPECT_EQ(find_broken_rule(steps, soft, wire, {}), "");
  EXPECT_NE(find_broken_rule(steps, soft, wire, {.turn_per_length = 80.0 * kRadPerDeg}), "");
}

std::vector<std::string> texts_of(const std::vector<ToldStep>& told) {
  std::vector<std::string> texts;
  for (const ToldStep& step : told) texts.push_back(step.text);
  return texts;
}

TEST(ToolSteps, ReadAsTheHandMakesThem) {
  const std::vector<ToldStep> told = describe_steps({{.tool = 1, .push = 216.0},
                                                     {.tool = 0, .push = 212.0},
                                                     {.tool = 1, .push = -35.0},
                                                     {.tool = 0, .turn = kPi / 3.0},
                                                     {.tool = kBothTools, .push = -8.0},
                                                     {.tool = 1, .push = 90.0}},
                                                    247.4);
  const std::vector<std::string> expected = {
      "advance the wire to 220 mm",
      "advance the catheter over the wire to 212 mm",
      "withdraw the wire by 35 mm",
      "turn the catheter 60 degrees clockwise",
      "pull back catheter and wire together by 8 mm",
      "advance the wire until its tip is at the target, 247 mm in"};
  EXPECT_EQ(texts_of(told), expected);
  for (const ToldStep& step : told) EXPECT_EQ(step.otherwise, "");
}

TEST(ToolSteps, EndWithTheCatheterInTheBranchWhereThatIsLongEnough) {
  Ostium ostium;
  ostium.arc = 200.0;
  ostium.end = 240.0;
  const std::vector<ToolStep> steps = {{.tool = 1, .push = 216.0}, {.tool = 1, .push = 30.0}};
  const std::vector<ToolStep> seated = with_seat(steps, ostium, {});
  ASSERT_EQ(seated.size(), 3U);
  EXPECT_TRUE(seated.back().seats);
  EXPECT_EQ(seated.back().at, ToolRules{}.seat);
  const std::vector<std::string> expected = {
      "advance the wire to 220 mm", "advance the wire until its tip is at the target, 247 mm in",
      "advance the catheter over the wire until its tip is 10 mm past the ostium, by 60 mm at "
      "most"};
  EXPECT_EQ(texts_of(describe_steps(seated, 247.4)), expected);
  ostium.end = 212.0;
  EXPECT_EQ(with_seat(steps, ostium, {}).back().at, 7.0) << "5 mm behind the target";
  ostium.end = 204.0;
  EXPECT_EQ(with_seat(steps, ostium, {}), steps);
  ostium.end = 240.0;
  EXPECT_EQ(with_seat(steps, ostium, {.seat = 0.0}), steps);

  Measured trial{.outcome = simulate::Outcome::kReached};
  trial.metrics.reached = true;
  trial.metrics.script = ScriptMetrics{.hook_depth = 2.0};
  EXPECT_TRUE(stays_unseated({.steps = seated}, trial));
  EXPECT_FALSE(stays_unseated({.steps = steps}, trial));
  trial.metrics.script->hook_depth = 9.8;
  EXPECT_FALSE(stays_unseated({.steps = seated}, trial));
}

TEST(ToolSteps, SeatTheCatheterOfScriptsThatReachedAndNoRuleSpeaksAgainst) {
  Study study = toward(1.0);
  study.wires.push_back(study.wires.front());
  study.catheters.push_back(catheter_of(150.0, 1.0));
  const std::vector<ToolStep> steps = {{.tool = 1, .push = 80.0},
                                       {.tool = 0, .push = 70.0},
                                       {.tool = 1, .push = -20.0},
                                       {.tool = kBothTools, .push = -20.0},
                                       {.tool = 1, .push = 100.0}};
  ToolScripts all;
  const auto add = [&](int catheter, int wire, int first_wire, int found) {
    all.found.push_back(
        {.wire = wire, .catheter = catheter, .steps = steps, .first_wire = first_wire});
    all.spares.push_back({all.found.back()});
    all.pairs.emplace_back().pair = {.catheter = catheter, .wire = wire};
    all.pairs.back().found = found;
  };
  add(0, 0, -1, 3);
  add(0, 1, -1, 0);  // none of its scripts reached
  add(1, 0, -1, 2);  // too short to stay 50 mm outside
  add(0, 0, 1, 0);   // brought in through a catheter that is seated
  add_seats(study, all);
  EXPECT_TRUE(all.found[0].steps.back().seats);
  EXPECT_TRUE(all.spares[0][0].steps.back().seats);
  EXPECT_EQ(all.found[0].steps.size(), steps.size() + 1);
  for (const std::size_t k : {1U, 2U, 3U}) {
    EXPECT_EQ(all.found[k].steps, steps) << k;
    EXPECT_EQ(all.spares[k][0].steps, steps) << k;
  }
}

TEST(ToolSteps, SayWhatEndsThemAndWhatElseToDo) {
  const std::vector<ToolStep> steps = {
      {.tool = 1, .push = 216.0, .steers = 7},
      {.tool = 0, .push = 212.0},
      {.tool = 0, .turn = -kPi / 2.0, .until = Until::kFacing, .at = kPi / 6.0},
      {.tool = kBothTools, .push = -40.0, .until = Until::kLevel, .at = -6.0},
      {.tool = kBothTools, .push = -9.0, .until = Until::kInBranch, .at = 0.0},
      {.tool = 1,
       .push = 60.0,
       .until = Until::kInBranch,
       .at = 18.0,
       .tries = 8,
       .try_pull = 3.0,
       .try_turn = -15.0 * kRadPerDeg},
      {.tool = 0, .push = 12.0},
      {.tool = 1, .push = 90.0}};
  const std::vector<ToldStep> told = describe_steps(steps, 247.4);
  const std::vector<std::string> expected = {
      "advance the wire to 220 mm",
      "advance the catheter over the wire to 212 mm",
      "turn the catheter counterclockwise until its tip looks 30 degrees clockwise of the branch, "
      "by 90 degrees at most",
      "pull back catheter and wire together until the catheter's tip is 6 mm short of the level of "
      "the ostium, by 40 mm at most",
      "pull back catheter and wire together until the catheter's tip falls into the ostium, by 9 "
      "mm at most",
      "advance the wire until its tip is 18 mm past the ostium, by 60 mm at most",
      "advance the catheter over the wire by 12 mm",
      "advance the wire until its tip is at the target, 247 mm in"};
  EXPECT_EQ(texts_of(told), expected);
  EXPECT_EQ(
      told[0].otherwise,
      "If it goes into another vessel or stops more than 50 mm before the ostium, withdraw it "
      "to 30 mm before where that began. Bring the catheter up to 30 mm behind the wire's tip "
      "and advance the wire again. Do this 7 times at most, each new time 10 mm further back "
      "and with the catheter turned on by 45 degrees clockwise. Then bring the catheter back "
      "to where it was. Stop the wire 5 mm before where the image ends.");
  EXPECT_EQ(
      told[5].otherwise,
      "If it passes by the branch or comes no further, withdraw it and try again, 8 times at most. "
      "First try with "
      "both tools 3 mm back from where they were, then 3 mm on. Then hook anew, as also where the "
      "catheter's tip has come out of the ostium: with the wire ahead, advance both until the "
      "catheter's tip is 15 mm beyond the ostium, no further than it has been, turn it 15 degrees "
      "toward the branch (counterclockwise where it looks along that) and pull both back to its "
      "level; then turned to the other side. Then do the same again, each time by twice the length "
      "and 15 degrees more, but no further on than 6 mm beyond the "
      "ostium or where they were.");
  const std::string script = describe_script(steps, 247.4);
  EXPECT_EQ(
      script.find("advance the wire to 220 mm; advance the catheter over the wire to 212 mm; "),
      0u);
  EXPECT_EQ(script.find("If it"), std::string::npos) << "one sentence";
}

TEST(ToolRules, HoldWhereAStepEndsEarly) {
  // Pulled back by 100 mm the hub has room, but the tip may look right before that.
  const std::vector<ToolStep> steps = {
      {.tool = 1, .push = 500.0},
      {.tool = 0, .push = 400.0},
      {.tool = kBothTools, .push = -100.0, .until = Until::kLevel, .at = 0.0},
      {.tool = 0, .push = 250.0}};
  EXPECT_EQ(find_broken_rule(steps, catheter_of(650.0, 1.0), wire_of(2000.0, 0.44), {}),
            "step 4: less than 50 mm of catheter stay outside");
}

TEST(ToolNeighbours, DifferInOneStepByWhatAHandDoesNotFeel) {
  const ToolScript script = {{.tool = 1, .push = 200.0},
                             {.tool = 0, .push = 180.0},
                             {.tool = 0, .turn = -0.5 * kPi, .until = Until::kFacing, .at = 0.2},
                             {.tool = kBothTools, .push = -40.0, .until = Until::kLevel, .at = 5.0},
                             {.tool = 1, .push = 60.0, .until = Until::kInBranch, .at = 18.0},
                             {.tool = 0, .push = 12.0},
                             {.tool = 1, .push = 90.0}};
  const std::vector<ToolScript> all = list_neighbours(script);
  ASSERT_EQ(all.size(), 7U);
  EXPECT_EQ(all[0], script);
  EXPECT_EQ(all[1][3].at, 7.0) << "ended earlier, on the way down";
  EXPECT_EQ(all[2][3].at, 3.0);
  EXPECT_NEAR(all[3][2].at, 0.2 + kNeighbourTurn, 1e-12) << "turned less, counterclockwise";
  EXPECT_NEAR(all[4][2].at, 0.2 - kNeighbourTurn, 1e-12);
  EXPECT_EQ(all[5][5].push, 10.0);
  EXPECT_EQ(all[6][5].push, 14.0);
  EXPECT_EQ(all[6][1], script[1]) << "the catheter's way up the aorta is the same";
  EXPECT_EQ(list_neighbours({{.tool = 1, .push = 20.0}}).size(), 1U);

  // Of a hub that is turned on after a short pull the last turn and the last pull.
  ToolScript wound = script;
  wound.insert(wound.begin() + 2, {{.tool = 0, .turn = -kPi}, {.tool = kBothTools, .push = -2.0}});
  const std::vector<ToolScript> others = list_neighbours(wound);
  ASSERT_EQ(others.size(), 7U);
  for (const ToolScript& other : others) {
    EXPECT_EQ(other[2], wound[2]);
    EXPECT_EQ(other[3], wound[3]);
  }
  EXPECT_EQ(others[1][5].at, 7.0);
  EXPECT_NEAR(others[3][4].at, 0.2 + kNeighbourTurn, 1e-12);
}

TEST(ToolNeighbours, OfAPushFromBelowEndItEarlierAndLater) {
  const ToolScript script = {{.tool = 1, .push = 100.0},
                             {.tool = 0, .push = 80.0},
                             {.tool = 1, .push = -40.0},
                             {.tool = kBothTools, .push = 34.0, .until = Until::kLevel, .at = -3.0},
                             {.tool = 1, .push = 60.0}};
  std::vector<double> levels;
  for (const ToolScript& neighbour : list_neighbours(script)) levels.push_back(neighbour[3].at);
  ASSERT_EQ(levels.size(), 3U) << "no turn, and no second advance of the catheter";
  EXPECT_EQ(levels, (std::vector<double>{-3.0, -5.0, -1.0}));
  EXPECT_EQ(
      describe_steps(script, 170.0)[3].text,
      "advance catheter and wire together until the catheter's tip is 3 mm short of the level "
      "of the ostium, by 34 mm at most");
}

double turned(const Candidate& candidate) {
  double sum = 0.0;
  for (const ToolStep& step : candidate.steps) sum += step.turn;
  return sum / kRadPerDeg;
}

TEST(ToolNeighbours, ComeToTheSameAsWhenMadeOneByOne) {
  // Straight up the aorta, past where the branches leave it: 95 mm of wire reach.
  const Study study = tool_scout_study(toward(1.0));
  const auto way =
      std::make_shared<simulate::Way>(line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 100.0}}));
  const simulate::Goal goal = simulate::goal_at_end(way);
  const Candidate candidate = first_candidate(study, {});
  const auto trial = [&] {
    return simulate::ToolTrial(tools_of(study, candidate), make_introducer(study, candidate), goal,
                               aorta(), tool_options(study, candidate));
  };
  // Pulled by some 8, 10 and 16 mm, of which the last leaves the wire short.
  std::vector<ToolScript> scripts;
  for (const double turn : {0.5 * kPi, 0.4 * kPi, -0.5 * kPi}) {
    for (const double level : {-18.0, -20.0, -26.0}) {
      scripts.push_back({{.tool = 1, .push = 60.0},
                         {.tool = 0, .push = 45.0},
                         {.tool = 0, .turn = turn},
                         {.tool = kBothTools, .push = -30.0, .until = Until::kLevel, .at = level},
                         {.tool = 1, .push = 43.0}});
    }
  }
  simulate::ToolTrial shared = trial();
  const std::vector<bool> reached = try_scripts(shared, scripts, {});
  EXPECT_EQ(shared.pushes().size(), 0U) << "it is back where all begin";
  int count = 0;
  for (std::size_t k = 0; k < scripts.size(); ++k) {
    SCOPED_TRACE(k);
    simulate::ToolTrial own = trial();
    for (std::size_t i = 0; i < scripts[k].size() && !own.ended(); ++i) {
      own.make(scripts[k][i], i + 1 == scripts[k].size());
    }
    EXPECT_EQ(reached[k], own.reached()) << own.reason();
    count += own.reached() ? 1 : 0;
  }
  EXPECT_EQ(count, 6) << "two of each three";
}

TEST(ToolSearch, TargetsOnEitherSideHaveMirroredScripts) {
  std::vector<ToolScripts> found;
  for (const double side : {1.0, -1.0}) {
    const Study study = toward(side);
    const std::optional<Ostium> ostium = find_ostium(study.goal);
    ASSERT_TRUE(ostium.has_value());
    EXPECT_NEAR(ostium->arc, kLevel - 5.0 + kAorta, 2.5);
    EXPECT_NEAR(ostium->branch.x(), side, 0.02);
    EXPECT_NEAR(ostium->trunk_diameter, 2.0 * kAorta, 0.1);
    found.push_back(find_tool_scripts(study, aorta(), {.threads = 2}));
    ASSERT_EQ(found.back().pairs.size(), 1U);
    ASSERT_GT(found.back().pairs[0].found, 0) << found.back().pairs[0].stopped;
    for (const Candidate& candidate : found.back().found) {
      EXPECT_EQ(find_broken_rule(candidate.steps, study.catheters[0], study.wires[0], {}), "");
    }
    const simulate::TrialResult trial = run_candidate(study, found.back().found[0], aorta());
    ASSERT_EQ(trial.outcome, simulate::Outcome::kReached) << trial.reason;
    EXPECT_GT(side * trial.pushes.back().tip.x(), 34.0);
  }
  // Rolls count from the reference direction, y: x and -x are mirror images.
  const double there = turned(found[0].found[0]), back = turned(found[1].found[0]);
  EXPECT_GT(std::abs(there), 45.0);
  EXPECT_NEAR(there, -back, 31.0) << "turns are tried by 30 degrees";
}

TEST(ToolSearch, EveryHookHasWhatTheBestOnesHaveAndMore) {
  const Study study = toward(1.0);
  const ToolScripts best = find_tool_scripts(study, aorta(), {.threads = 2});
  const ToolScripts every =
      find_tool_scripts(study, aorta(), {.threads = 2}, nullptr, Hooks::kEvery);
  std::vector<Candidate> all = every.found;
  for (const auto& spares : every.spares) all.insert(all.end(), spares.begin(), spares.end());
  const auto count = [](const std::vector<Candidate>& scripts, const Candidate& script) {
    return std::count_if(scripts.begin(), scripts.end(),
                         [&](const Candidate& other) { return other.steps == script.steps; });
  };
  for (const Candidate& script : best.found) EXPECT_GE(count(all, script), 1);
  for (const Candidate& script : every.found) EXPECT_EQ(count(every.found, script), 1);
  EXPECT_GT(every.pairs.at(0).found, best.pairs.at(0).found);
  EXPECT_GT(every.branches, 2 * best.branches) << "though none is weighed";
}

TEST(ToolSearch, KeepsToStricterRulesFromTheFirstTurnOn) {
  Study study = toward(1.0);
  study.tool_rules.most_turn = 50.0 * kRadPerDeg;
  study.tool_rules.turn_per_length = 12.0 * kRadPerDeg;  // a pull of 5 mm after each such turn
  const ToolScripts found = find_tool_scripts(study, aorta(), {.threads = 2});
  ASSERT_GT(found.pairs.at(0).found, 0) << found.pairs.at(0).stopped;
  for (const Candidate& candidate : found.found) {
    EXPECT_EQ(
        find_broken_rule(candidate.steps, study.catheters[0], study.wires[0], study.tool_rules),
        "");
  }
  EXPECT_GT(std::abs(turned(found.found[0])), 50.0) << "in more than one place";
}

TEST(ToolSearch, LeavesAHubThatMayNotBeTurnedAsItIs) {
  Study study = toward(1.0);
  study.tool_rules.most_turn = 0.0;
  const ToolScripts found = find_tool_scripts(study, aorta(), {.threads = 2});
  if (found.pairs.at(0).found == 0) {
    EXPECT_FALSE(found.pairs[0].stopped.empty());
  }
  for (const Candidate& candidate : found.found) {
    EXPECT_EQ(turned(candidate), 0.0);
    for (const ToolStep& step : candidate.steps) EXPECT_EQ(step.tries, 0) << "they turn it";
  }
}

TEST(ToolSearch, TellsWhichRuleNoScriptKeeps) {
  Study study = toward(1.0);
  study.catheters[0].tool.wire.sections[0].bending_stiffness = 101.0;
  study.tool_rules.turn_per_length = 0.2 * kRadPerDeg;  // 30 degrees ask for 150 mm
  const ToolScripts found = find_tool_scripts(study, aorta(), {.threads = 2});
  EXPECT_EQ(found.pairs.at(0).found, 0);
  EXPECT_NE(found.pairs.at(0).stopped.find("its scripts break a rule of the case: step"),
            std::string::npos)
      << found.pairs.at(0).stopped;
}

TEST(ToolSearch, AWireThatPassesTheBranchByIsLedOutAnew) {
  const Study study = toward(1.0);
  const ToolScripts found = find_tool_scripts(study, aorta(), {.threads = 2});
  ASSERT_FALSE(found.found.empty());
  Candidate script = found.found[0];
  const auto out = std::find_if(script.steps.begin(), script.steps.end(),
                                [](const ToolStep& step) { return step.tries > 0; });
  ASSERT_NE(out, script.steps.end()) << "the first push of the wire after turn and pull";
  EXPECT_EQ(out->tool, 1);
  EXPECT_GT(out->push, 0.0);
  EXPECT_NEAR(std::abs(out->try_turn), 15.0 * kRadPerDeg, 1e-12);
  EXPECT_EQ(out->try_pull, 3.0);
  const auto turn = std::find_if(script.steps.begin(), script.steps.end(),
                                 [](const ToolStep& step) { return step.turn != 0.0; });
  ASSERT_NE(turn, script.steps.end());
  ASSERT_EQ(turn->until, Until::kFacing);
  const int tries = out->tries;
  // Turned on from where it was found to reach, until the wire goes past.
  simulate::TrialResult once = run_candidate(study, script, aorta());
  const auto turns = static_cast<int>(turn - script.steps.begin());
  double hub_there = 0.0;
  for (std::size_t k = 0; k < once.steps.size(); ++k) {
    if (once.steps[k] == turns) hub_there = once.tools[0].roll[k];
  }
  turn->until = Until::kMade;
  out->tries = 0;
  for (int k = 1; k <= 12 && once.outcome == simulate::Outcome::kReached; ++k) {
    turn->turn = hub_there + k * 15.0 * kRadPerDeg;
    once = run_candidate(study, script, aorta());
  }
  ASSERT_NE(once.outcome, simulate::Outcome::kReached);
  EXPECT_EQ(once.reason.find("tried again"), std::string::npos);
  out->tries = tries;
  const simulate::TrialResult again = run_candidate(study, script, aorta());
  EXPECT_EQ(again.outcome, simulate::Outcome::kReached) << again.reason;
  EXPECT_NE(again.reason.find("tried again"), std::string::npos) << again.reason;
  // The wire is withdrawn to where the push began, then both by 3 mm, before it comes out again.
  const auto step = static_cast<int>(out - script.steps.begin());
  const auto first = static_cast<std::size_t>(
      std::find(again.steps.begin(), again.steps.end(), step) - again.steps.begin());
  const double wire = again.tools[1].insertion[first - 1];
  const double catheter = again.tools[0].insertion[first - 1];
  bool both_back = false;
  for (std::size_t k = first; k < again.steps.size() && again.steps[k] == step; ++k) {
    both_back = both_back || (std::abs(again.tools[1].insertion[k] - (wire - 3.0)) < 1e-9 &&
                              std::abs(again.tools[0].insertion[k] - (catheter - 3.0)) < 1e-9);
  }
  EXPECT_TRUE(both_back);
  // Whether it holds is asked without tries: of scripts that only these save others come first.
  std::vector<FoundScript> weighed = {{.steps = script.steps}};
  simulate::ToolTrial trial(tools_of(study, script), make_introducer(study, script), study.goal,
                            aorta(), tool_options(study, script));
  weigh_scripts(
      trial, 0, [](const ToolScript&) { return true; }, nullptr, weighed);
  EXPECT_FALSE(weighed[0].holds);
  EXPECT_LT(weighed[0].share, 1.0);
  const ToolScript first_steps = found.found[0].steps;
  weighed = {{.steps = first_steps}};
  weigh_scripts(
      trial, 0, [](const ToolScript&) { return true; }, nullptr, weighed);
  EXPECT_TRUE(weighed[0].holds);
  ASSERT_FALSE(weighed[0].spares.empty());
  for (const ToolScript& spare : weighed[0].spares) {
    EXPECT_TRUE(std::any_of(spare.begin(), spare.end(), [&](const ToolStep& one) {
      return one.tries == tries;
    })) << "what stands in for it makes them";
  }
}

TEST(CatheterChoice, LeavesTheStudyWhatTheWayAsksFor) {
  Study study = toward(1.0);
  study.catheters.insert(study.catheters.begin(), catheter_of(650.0, 1.0, 30.0));
  study.catheters[0].tool.wire.name = "wide hook";
  keep_suggested(study);
  ASSERT_EQ(study.catheters.size(), 2U);
  EXPECT_EQ(study.catheters[0].tool.wire.name, "hook") << "the branch is square to its trunk";
  ASSERT_EQ(study.suggested.size(), 2U);
  study.goal.way.reset();
  keep_suggested(study);
  EXPECT_TRUE(study.catheters.empty() && study.suggested.empty());
}

TEST(ToolSearch, TriesSuggestedCathetersThreeAtATime) {
  const Catheter hook = catheter_of(650.0, 1.0, 8.0), wide = catheter_of(650.0, 1.0, 21.0);
  Study study = toward(1.0);
  study.suggested.assign(4, "suggested");
  study.catheters = {wide, wide, wide, hook};
  const ToolScripts last = find_tool_scripts(study, aorta(), {.threads = 2});
  ASSERT_EQ(last.pairs.size(), 4U);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_FALSE(last.pairs[k].tried());
  EXPECT_GT(last.pairs[3].found, 0) << last.pairs[3].stopped;
  ASSERT_FALSE(last.found.empty());
  EXPECT_EQ(last.found[0].catheter, 3);
  study.catheters = {wide, hook, wide, hook};
  const ToolScripts first = find_tool_scripts(study, aorta(), {.threads = 2});
  EXPECT_GT(first.pairs[1].found, 0);
  EXPECT_FALSE(first.pairs[3].tried()) << "one before it holds";
  ASSERT_TRUE(has_more_pairs(study, first));
  ToolScripts all = first;
  search_on(study, aorta(), {.threads = 2}, nullptr, all);
  EXPECT_TRUE(all.pairs[3].tried());
  EXPECT_GT(all.found.size(), first.found.size());
  EXPECT_FALSE(has_more_pairs(study, all));
  study.suggested.clear();
  EXPECT_TRUE(find_tool_scripts(study, aorta(), {.threads = 2}).pairs[3].tried());
}

TEST(ToolSearch, MakePlanRanksScriptsOfCatheterAndWire) {
  Study study = toward(1.0);
  MemoryLog log;
  const auto model = []() -> const simulate::VesselModel& { return aorta(); };
  PlanOptions options;
  options.robustness.repeats = 2;
  options.robustness.plans = 1;
  const PlanVessel vessel{
      .path = study.goal.way->path(), .yields = false, .model = model, .rigid_model = model};
  std::vector<Candidate> told;
  options.early.script = [&](const Candidate& script) { told.push_back(script); };
  const Plan plan = make_plan(study, vessel, options, log);
  ASSERT_EQ(told.size(), 1U) << "the first alone, at once";
  EXPECT_EQ(told[0].catheter, 0);
  EXPECT_GE(told[0].steps.size(), 4U);
  ASSERT_EQ(plan.scripts.pairs.size(), 1U);
  ASSERT_FALSE(plan.scripts.found.empty()) << plan.scripts.pairs[0].stopped;
  const Judgement judged = judge(study, plan, {}, {});
  ASSERT_FALSE(judged.ranking.plans.empty());
  const auto first = static_cast<std::size_t>(judged.ranking.plans.front().trial);
  EXPECT_EQ(plan.candidates[first].catheter, 0);
  EXPECT_EQ(plan.trials[first].tools.size(), 2U);
  EXPECT_TRUE(judged.ranking.plans.front().tip_error.has_value());
  // Its errors are of the same script, whose steps end by what is seen.
  const Candidate& script = plan.candidates[first];
  EXPECT_TRUE(std::any_of(script.steps.begin(), script.steps.end(),
                          [](const ToolStep& step) { return step.until != Until::kMade; }));
  const Study same = refined_study(study, script, 1.0, plan.trials[first].metrics.insertion);
  const auto tip_of = [&](const Study& by) -> Vec3 {
    return run_candidate(by, script, aorta()).nodes.rightCols<1>();
  };
  EXPECT_LT((tip_of(same) - tip_of(study)).norm(), 1e-3);
  ASSERT_FALSE(plan.refinements.empty());
  ASSERT_FALSE(plan.refinements.front().rows.empty());
  EXPECT_NEAR(plan.refinements.front().rows.front().element_length, 6.0, 1e-9)
      << "2 times 2 times the study's";
  // Known runs are not simulated again.
  const Plan again = make_plan(study, vessel, options, log);
  EXPECT_EQ(again.full.runs + again.repeats.runs + again.scouts.runs, 0);
  EXPECT_EQ(again.candidates.size(), plan.candidates.size());

  // In full they meet the wall that the study has.
  MemoryLog empty;
  Spent spent;
  const PlanVessel walled{.path = vessel.path, .yields = true, .model = model, .rigid_model = {}};
  const std::vector<Measured> in_full = find_or_run(
      study, walled, {{.candidate = plan.candidates[first]}}, empty, options.batch, spent);
  EXPECT_EQ(in_full.at(0).outcome, plan.trials[first].outcome);

  options.manoeuvres = Manoeuvring::kNever;
  MemoryLog other;
  const Plan none = make_plan(study, vessel, options, other);
  EXPECT_TRUE(none.scripts.found.empty());
  EXPECT_EQ(none.scripts.pairs.size(), 1U);
}

}  // namespace
}  // namespace wireplan::plan
