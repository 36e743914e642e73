// Scripts of catheter and wire: which pairs are tried, what breaks the rules, and, in an aorta with
// a branch on either side, that mirrored targets have mirrored scripts.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "plan/judge.h"
#include "plan/tool_search.h"
#include "tests/plan/memory_log.h"
#include "tests/shapes.h"

namespace wireplan::plan {
namespace {

using simulate::kBothTools;
using simulate::ToolStep;

Catheter catheter_of(double length, double inner, double curve_radius = 10.0) {
  Catheter catheter;
  catheter.tool.wire = {
      .name = "hook",
      .radius = 0.83,
      .sections = {{.length = 8.0, .bending_stiffness = 99.0},
                   {.length = 0.5 * kPi * curve_radius,
                    .bending_stiffness = 99.0,
                    .rest_curvature = 1.0 / curve_radius},
                   {.length = length - 8.0 - 0.5 * kPi * curve_radius, .bending_stiffness = 332.0}},
      .friction = 0.1};
  catheter.tool.inner_radius = 0.5 * inner;
  return catheter;
}

simulate::Wire wire_of(double length, double radius) {
  return {.name = "wire",
          .radius = radius,
          .sections = {{.length = 30.0, .bending_stiffness = 2.0},
                       {.length = length - 30.0, .bending_stiffness = 20.0}},
          .friction = 0.04};
}

const Ostium kOstium{.arc = 300.0, .trunk_diameter = 20.0, .end = 340.0};

std::string unfit(const Catheter& catheter, const simulate::Wire& wire) {
  return list_pairs({catheter}, {wire}, kOstium, {}).at(0).unfit;
}

TEST(ToolPairs, WhatDoesNotFitIsToldWithTheReason) {
  const Catheter fits = catheter_of(650.0, 1.0);
  EXPECT_EQ(unfit(fits, wire_of(1500.0, 0.44)), "");
  EXPECT_EQ(unfit(fits, wire_of(1500.0, 0.5)), "wire too thick: 1 mm in a lumen of 1 mm");
  EXPECT_EQ(
      unfit(catheter_of(340.0, 1.0), wire_of(1500.0, 0.44)),
      "catheter too short: 340 mm, and the ostium is 300 mm from the access with 50 mm to stay "
      "outside");
  EXPECT_EQ(unfit(catheter_of(350.0, 1.0), wire_of(1500.0, 0.44)), "");
  // 650 - 300 behind the ostium, 340 to the target and 100 to hold.
  EXPECT_EQ(unfit(fits, wire_of(790.0, 0.44)), "");
  EXPECT_EQ(unfit(fits, wire_of(789.0, 0.44)),
            "wire too short: 789 mm, and 790 mm are needed to hold it behind a catheter of 650 mm");
  EXPECT_EQ(unfit(catheter_of(650.0, 1.0, 21.0), wire_of(1500.0, 0.44)),
            "curve wider than the vessel: 21 mm at the tip, in a lumen of 20 mm before the ostium");
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

TEST(ToolSteps, ReadAsTheHandMakesThem) {
  const std::vector<std::string> told = describe_steps({{.tool = 1, .push = 216.0},
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
  EXPECT_EQ(told, expected);
}

// An aorta of 9 mm radius along z from 0 to 130 mm, with branches of 3 mm radius toward +x and -x
// at 60 mm; all ends are flat and closed.
constexpr double kLevel = 60.0, kAorta = 9.0, kRenal = 3.0;

const simulate::VesselModel& aorta() {
  static const simulate::VesselModel vessel(
      shapes::level_set(
          [](const Vec3& p) {
            const auto renal = [&](double x) {
              return shapes::depth_in_tube(p, Vec3(0.0, 0.0, kLevel), Vec3(x, 0.0, kLevel), kRenal);
            };
            const double trunk =
                shapes::depth_in_tube(p, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 130.0), kAorta);
            const auto soft = [](double depth) { return std::exp(depth / 0.5); };
            return 0.5 * std::log(soft(trunk) + soft(renal(45.0)) + soft(renal(-45.0)));
          },
          Vec3(-46.0, -10.0, -1.5), Vec3(46.0, 10.0, 131.5), 1.1),
      simulate::LumenOptions{.grid_spacing = 0.6});
  return vessel;
}

Centerline line_through(const std::vector<Vec3>& corners) {
  std::vector<Vec3> points;
  for (std::size_t k = 0; k + 1 < corners.size(); ++k) {
    const Vec3 whole = corners[k + 1] - corners[k];
    const int count = static_cast<int>(whole.norm());
    for (int i = 0; i < count; ++i) points.push_back(corners[k] + whole * i / count);
  }
  points.push_back(corners.back());
  Centerline line;
  const Eigen::Index n = std::ssize(points);
  line.points.resize(3, n);
  line.radius.resize(n);
  line.arc_length = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    line.points.col(i) = points[static_cast<std::size_t>(i)];
    line.radius[i] = std::abs(line.points(0, i)) > kAorta - 1.0 ? kRenal : kAorta;
    if (i > 0) {
      line.arc_length[i] =
          line.arc_length[i - 1] + (line.points.col(i) - line.points.col(i - 1)).norm();
    }
  }
  return line;
}

Study toward(double side) {
  const auto branch = [](double x) {
    return preprocess::Branch{line_through({{0.0, 0.0, kLevel}, {x, 0.0, kLevel}}), 0,
                              kLevel - 5.0};
  };
  Study study;
  study.wires = {wire_of(1500.0, 0.44)};
  study.catheters = {catheter_of(650.0, 1.0, 8.0)};
  study.inclinations = study.azimuths = study.rolls = {0.0};
  study.access = Vec3(0.0, 0.0, 5.0);
  const auto way = std::make_shared<simulate::Way>(
      line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, kLevel}, {side * 35.0, 0.0, kLevel}}),
      std::vector<preprocess::Branch>{{line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, 128.0}}), -1, 0.0},
                                      branch(44.0),
                                      branch(-44.0)});
  study.goal = {.point = way->section().center,
                .radius = way->section().radius,
                .at_section = true,
                .way = way};
  study.insertion.length = 200.0;
  study.insertion.element_length = 1.5;
  study.insertion.friction = 0.04;
  return study;
}

double turned(const Candidate& candidate) {
  double sum = 0.0;
  for (const ToolStep& step : candidate.steps) sum += step.turn;
  return sum / kRadPerDeg;
}

TEST(ToolSearch, TargetsOnEitherSideHaveMirroredScripts) {
  std::vector<ToolScripts> found;
  for (const double side : {1.0, -1.0}) {
    const Study study = toward(side);
    const std::optional<Ostium> ostium = find_ostium(study);
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

TEST(ToolSearch, MakePlanRanksScriptsOfCatheterAndWire) {
  Study study = toward(1.0);
  MemoryLog log;
  const auto model = []() -> const simulate::VesselModel& { return aorta(); };
  PlanOptions options;
  options.robustness.repeats = 2;
  options.robustness.plans = 1;
  const PlanVessel vessel{
      .path = study.goal.way->path(), .yields = false, .model = model, .rigid_model = model};
  const Plan plan = make_plan(study, vessel, options, log);
  ASSERT_EQ(plan.scripts.pairs.size(), 1U);
  ASSERT_FALSE(plan.scripts.found.empty()) << plan.scripts.pairs[0].stopped;
  const Judgement judged = judge(study, plan, {}, {});
  ASSERT_FALSE(judged.ranking.plans.empty());
  const auto first = static_cast<std::size_t>(judged.ranking.plans.front().trial);
  EXPECT_EQ(plan.candidates[first].catheter, 0);
  EXPECT_EQ(plan.trials[first].tools.size(), 2U);
  EXPECT_TRUE(judged.ranking.plans.front().tip_error.has_value());
  ASSERT_FALSE(plan.refinements.empty());
  ASSERT_FALSE(plan.refinements.front().rows.empty());
  EXPECT_NEAR(plan.refinements.front().rows.front().element_length, 6.0, 1e-9)
      << "2 times 2 times the study's";
  // Known runs are not simulated again.
  const Plan again = make_plan(study, vessel, options, log);
  EXPECT_EQ(again.full.runs + again.repeats.runs + again.scouts.runs, 0);
  EXPECT_EQ(again.candidates.size(), plan.candidates.size());

  options.manoeuvres = Manoeuvring::kNever;
  MemoryLog other;
  const Plan none = make_plan(study, vessel, options, other);
  EXPECT_TRUE(none.scripts.found.empty());
  EXPECT_EQ(none.scripts.pairs.size(), 1U);
}

}  // namespace
}  // namespace wireplan::plan
