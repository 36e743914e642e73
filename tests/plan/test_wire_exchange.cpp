// Exchange for another wire through the placed catheter: its rules, how it is told, what is kept of
// both wires, and that it is found where the other wire comes into no branch by itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "plan/metrics.h"
#include "plan/robustness.h"
#include "plan/settings.h"
#include "plan/wire_exchange.h"
#include "tests/goal.h"
#include "tests/plan/two_renals.h"

namespace wireplan::plan {
namespace {

using simulate::kBothTools;
using simulate::ToolStep;
using simulate::Until;

/// The second wire of a script, 50 mm of catheter being pushed once it is in.
std::vector<ToolStep> script_with(const ToolStep& exchange, double further = 0.0) {
  std::vector<ToolStep> steps = {{.tool = 1, .push = 296.0}, {.tool = 0, .push = 280.0}, exchange};
  if (further > 0.0) steps.push_back({.tool = 0, .push = further});
  steps.push_back({.tool = 1, .push = 60.0});
  return steps;
}
constexpr ToolStep kSwap{.tool = 1, .at = 10.0, .spare = 0};

TEST(WireExchange, HasToKeepTheRulesWithBothWires) {
  Catheter catheter = catheter_of(650.0, 1.0);
  const simulate::Wire first = wire_of(1200.0, 0.44);
  const auto broken = [&](const std::vector<ToolStep>& steps, const simulate::Wire& spare) {
    return find_broken_rule(steps, catheter, first, {}, &spare);
  };
  // In to 270 mm and 60 mm on: 650 - 280 behind the catheter's tip, 330 in, 100 to hold.
  EXPECT_EQ(broken(script_with(kSwap), wire_of(800.0, 0.44)), "");
  EXPECT_EQ(broken(script_with(kSwap), wire_of(799.0, 0.44)),
            "step 4: less than 100 mm of wire are left behind the catheter's hub");
  EXPECT_EQ(broken(script_with(kSwap), wire_of(739.0, 0.44)),
            "step 3: less than 100 mm of wire are left behind the catheter's hub");
  EXPECT_EQ(broken(script_with(kSwap), wire_of(1200.0, 0.5)),
            "step 3: wire too thick: 1 mm in a lumen of 1 mm");
  EXPECT_EQ(broken(script_with({.tool = 1, .at = -5.0, .spare = 0}), first),
            "step 3: the wire is brought in past the catheter's tip");
  EXPECT_EQ(broken({{.tool = 1, .push = 60.0}, kSwap}, first),
            "step 2: the catheter is only 0 mm in, too little to exchange the wire through it");
  // The catheter goes on before the new wire is out of it.
  EXPECT_EQ(broken(script_with(kSwap, 20.0), first), "") << "a soft tip may lead";
  catheter.tool.wire.sections[0].bending_stiffness = 200.0;
  EXPECT_EQ(broken(script_with(kSwap, 20.0), first),
            "step 4: the catheter's tip is pushed ahead of the wire, and is no soft one");
}

TEST(WireExchange, ReadsAsTheHandMakesIt) {
  const auto told = describe_steps(script_with(kSwap), 331.0, {.spare = "super-stiff"});
  ASSERT_EQ(told.size(), 4U);
  EXPECT_EQ(told[2].text,
            "hold the catheter, withdraw the wire whole and bring in super-stiff through it, to "
            "270 mm");
  EXPECT_EQ(told[2].otherwise, "");
  EXPECT_EQ(told[3].text, "advance the wire until its tip is at the target, 331 mm in");
  std::vector<ToolStep> seen = script_with(kSwap);
  seen[1].until = Until::kInBranch;
  seen[1].at = 12.0;
  EXPECT_EQ(describe_steps(seen, 331.0, {.spare = "super-stiff"})[2].text,
            "hold the catheter, withdraw the wire whole and bring in super-stiff through it, to "
            "10 mm behind the catheter's tip")
      << "how far the catheter is in is not known";
  EXPECT_EQ(as_written(seen), seen);
}

TEST(WireExchange, FiguresAreOfEachWireByItself) {
  simulate::TrialResult trial;
  trial.tools.resize(2);
  trial.tools[0].name = "hook";
  trial.tools[1].name = "soft";
  for (simulate::ToolTrack& track : trial.tools) {
    track.insertion = {5.0, 0.0, 7.0, 9.0};
    track.tip_force = {3.0, 1.0, 0.0, 2.0};
    track.push_force = {-1.0, -4.0, 2.0, 3.0};
    track.wall_force = track.hub_torque = track.roll = {0.0, 0.0, 0.0, 0.0};
  }
  trial.tools[1].changes = {{.from = 2, .name = "stiff"}};
  trial.nodes = Eigen::Matrix3Xd::Zero(3, 2);
  trial.nodes.col(1) = Vec3(0.0, 0.0, 9.0);
  const Centerline path = line_through({{0.0, 0.0, 0.0}, {0.0, 0.0, 50.0}});
  const std::vector<ToolMetrics> all = compute_tool_metrics(trial, {}, path);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].name + " " + all[1].name + " " + all[2].name, "hook soft stiff");
  EXPECT_EQ(all[1].peak_tip_force, 3.0);
  EXPECT_EQ(all[2].peak_tip_force, 2.0);
  EXPECT_EQ(all[0].mean_tip_force, 1.5);
  EXPECT_EQ(all[1].mean_tip_force, 2.0);
  EXPECT_EQ(all[2].mean_tip_force, 1.0);
  EXPECT_EQ(all[1].peak_push_force, 4.0);
  EXPECT_EQ(all[1].insertion, 0.0) << "it is out";
  EXPECT_EQ(all[1].progress, 0.0);
  EXPECT_EQ(all[2].insertion, 9.0);
  EXPECT_NEAR(all[2].progress, 9.0, 1e-9);
}

/// The study of `toward` with a soft wire and a stiff one.
Study with_a_stiff_wire() {
  Study study = toward(1.0);
  study.wires[0].name = "soft";
  study.wires[0].sections[1].bending_stiffness = 60.0;
  study.wires.push_back({.name = "stiff",
                         .radius = 0.44,
                         .sections = {{.length = 30.0, .bending_stiffness = 5.0},
                                      {.length = 1500.0, .bending_stiffness = 3000.0}},
                         .friction = 0.04});
  return study;
}

const simulate::VesselModel& oblique() {
  static const simulate::VesselModel vessel(oblique_surface(),
                                            simulate::LumenOptions{.grid_spacing = 0.6});
  return vessel;
}

Study into_the_oblique_branch() {
  Study study = with_a_stiff_wire();
  const Vec3 low(0.0, 0.0, 5.0), from(0.0, 0.0, kHigh);
  const auto way = std::make_shared<simulate::Way>(
      line_through({low, from, from + kOut * kAside}),
      std::vector<preprocess::Branch>{
          {line_through({low, {0.0, 0.0, kTop - 2.0}}), -1, 0.0},
          {line_through({from, from + (kOut + 14.0) * kAside}), 0, kHigh - 5.0}});
  study.goal = simulate::goal_at_end(way);
  study.insertion.length = 300.0;
  return study;
}

bool same_wire(const simulate::Wire& a, const simulate::Wire& b) {
  return a.name == b.name && a.radius == b.radius && a.friction == b.friction &&
         a.sections.front().bending_stiffness == b.sections.front().bending_stiffness;
}

TEST(WireExchange, ACandidateBeginsWithTheOneAndBringsTheOther) {
  Study study = with_a_stiff_wire();
  study.wires[0].friction = 0.0;  // straight and without friction; the other rubs
  Candidate candidate = first_candidate(study, {.catheter = 0, .wire = 1});
  EXPECT_TRUE(tool_options(study, candidate).spares.empty());
  EXPECT_TRUE(same_wire(tools_of(study, candidate)[1].wire, study.wires[1]));
  candidate.first_wire = 0;
  candidate.steps = script_with(kSwap);
  EXPECT_TRUE(same_wire(tools_of(study, candidate)[1].wire, study.wires[0]));
  ASSERT_EQ(tool_options(study, candidate).spares.size(), 1U);
  EXPECT_TRUE(same_wire(tool_options(study, candidate).spares[0], study.wires[1]));
  EXPECT_EQ(wires_of(candidate), (std::vector<int>{0, 1}));
  EXPECT_EQ(count_exchanges(candidate), 1);
  EXPECT_EQ(describe(study, candidate),
            "stiff in hook in exchange for soft, inclination 0 deg, azimuth 0 deg, roll 0 deg");
  EXPECT_NE(describe_script(study, candidate, 331.0).find("bring in stiff through it"),
            std::string::npos);
  const std::vector<Setting> settings = settings_that_act(study, candidate);
  EXPECT_NE(std::find(settings.begin(), settings.end(), Setting::kFriction), settings.end());
}

TEST(WireExchange, BringsAWireWhereItsOwnScriptsDoNot) {
  const Study study = into_the_oblique_branch();
  ToolScripts all = find_tool_scripts(study, oblique(), {.threads = 2});
  ASSERT_EQ(all.pairs.size(), 2U);
  ASSERT_GE(all.pairs[0].held, kSteadyShare) << "the soft one goes by itself";
  ASSERT_LT(all.pairs[1].held, kSteadyShare) << "the stiff one does not";
  const std::size_t own = all.found.size();
  ToolScripts again = all;
  Study without = study;
  without.tool_rules.exchange = false;
  find_exchanges(without, oblique(), {.threads = 2}, again);
  EXPECT_EQ(again.found.size(), own);
  EXPECT_FALSE(again.pairs[1].exchange.tried());

  find_exchanges(study, oblique(), {.threads = 2}, all);
  find_exchanges(study, oblique(), {.threads = 1}, again);
  EXPECT_FALSE(all.pairs[0].exchange.tried()) << "it needs none";
  const ExchangeFindings& exchange = all.pairs[1].exchange;
  EXPECT_EQ(exchange.first_wire, 0);
  ASSERT_GT(exchange.found, 0) << exchange.stopped;
  EXPECT_EQ(exchange.stopped, "");
  ASSERT_GT(all.found.size(), own);
  ASSERT_EQ(all.spares.size(), all.found.size());
  ASSERT_EQ(again.found.size(), all.found.size());
  for (std::size_t k = own; k < all.found.size(); ++k) {
    const Candidate& script = all.found[k];
    EXPECT_EQ(script.steps, again.found[k].steps) << "at any thread count";
    EXPECT_EQ(script.wire, 1);
    EXPECT_EQ(script.first_wire, 0);
    EXPECT_EQ(count_exchanges(script), 1);
    EXPECT_EQ(find_broken_rule(script.steps, study.catheters[0], study.wires[0], study.tool_rules,
                               &study.wires[1]),
              "");
  }

  // In full, and under a disturbance, the wire at the target is the stiff one, the first is out.
  const Candidate& script = all.found[own];
  const simulate::TrialResult trial = run_candidate(study, script, oblique());
  ASSERT_EQ(trial.outcome, simulate::Outcome::kReached) << trial.reason;
  EXPECT_GT(trial.pushes.back().tip.x(), 40.0);
  const simulate::ToolTrack& wires = trial.tools.at(1);
  EXPECT_EQ(wires.name, "soft");
  ASSERT_EQ(wires.changes.size(), 1U);
  EXPECT_EQ(wires.changes[0].name, "stiff");
  EXPECT_EQ(wires.insertion.at(wires.changes[0].from - 1), 0.0);
}

TEST(WireExchange, EachWireIsDisturbedByItsOwnSpread) {
  // A disturbance that leaves one wire as it is and not the other changes the script's trial from
  // where that other one is in; and as a study that has such wires from the start.
  Study study = with_a_stiff_wire();
  study.insertion.length = 120.0;
  const std::array<FactorSpread, 2> spread = {FactorSpread{0.5, 2.0}, FactorSpread{0.5, 2.0}};
  study.spreads = {{.friction = {}, .stiffness = {spread, spread}},
                   {.friction = {}, .stiffness = {spread, spread}}};
  Candidate candidate = first_candidate(study, {.catheter = 0, .wire = 1});
  candidate.first_wire = 0;
  candidate.steps = {
      {.tool = 1, .push = 50.0}, {.tool = 0, .push = 45.0}, kSwap, {.tool = 1, .push = 30.0}};
  Disturbance disturbance;
  disturbance.stiffness = {0.25, 0.75};
  const simulate::TrialResult disturbed = run_disturbed(study, candidate, aorta(), disturbance);
  Study other = study;
  other.spreads.clear();
  for (int k = 0; k < 2; ++k) {
    other.wires[static_cast<std::size_t>(k)] = disturbed_wire(study, k, disturbance);
  }
  other.insertion.residual_tolerance *= kRepeatTolerance;
  other.insertion.record_every = other.insertion.length;
  other.insertion.map_forces = false;
  const simulate::TrialResult direct = run_candidate(other, candidate, aorta());
  ASSERT_EQ(disturbed.pushes.size(), direct.pushes.size()) << disturbed.reason << direct.reason;
  EXPECT_EQ(disturbed.nodes, direct.nodes);
  EXPECT_EQ(disturbed.tools[1].push_force, direct.tools[1].push_force);
  const simulate::TrialResult assumed = run_candidate(study, candidate, aorta());
  EXPECT_NE(assumed.tools[1].push_force.front(), disturbed.tools[1].push_force.front());
  EXPECT_NE(assumed.nodes, disturbed.nodes);
}

}  // namespace
}  // namespace wireplan::plan
