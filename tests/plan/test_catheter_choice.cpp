// Which catheters an ostium asks for: their shapes, those that are suggested, and those that reach.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plan/catheter_choice.h"
#include "plan/tool_search.h"
#include "tests/goal.h"
#include "tests/plan/two_renals.h"

namespace wireplan::plan {
namespace {

/// Sections from the tip on: a straight length, then curves of so many degrees at a radius; a
/// radius below 0 curves the other way.
Catheter shaped(double straight, const std::vector<std::pair<double, double>>& curves) {
  Catheter catheter;
  catheter.tool.wire.name = "shaped";
  catheter.tool.wire.radius = 0.83;
  auto& sections = catheter.tool.wire.sections;
  sections.push_back({.length = straight, .bending_stiffness = 99.0});
  for (const auto& [angle, radius] : curves) {
    sections.push_back({.length = angle * kRadPerDeg * std::abs(radius),
                        .bending_stiffness = 99.0,
                        .rest_curvature = 1.0 / radius});
  }
  sections.push_back({.length = 600.0, .bending_stiffness = 332.0});
  return catheter;
}

Ostium turning_by(double angle, double trunk, double branch) {
  Ostium ostium;
  ostium.trunk = Vec3::UnitZ();
  ostium.branch = Vec3(std::sin(angle * kRadPerDeg), 0.0, std::cos(angle * kRadPerDeg));
  ostium.trunk_diameter = trunk;
  ostium.branch_diameter = branch;
  return ostium;
}

TEST(CatheterShapes, AreThoseOfCirclesAndLines) {
  const CurveShape quarter = find_shape(shaped(8.0, {{90.0, 10.0}}).tool.wire);
  EXPECT_NEAR(quarter.turn, 0.5 * kPi, 1e-9);
  EXPECT_NEAR(quarter.reach, 10.0 + 8.0, 0.01) << "radius, and the straight tip across";
  EXPECT_EQ(quarter.kind, CurveKind::kHooked);
  const CurveShape half = find_shape(shaped(8.0, {{180.0, 10.0}}).tool.wire);
  EXPECT_NEAR(half.reach, 20.0, 0.01);
  EXPECT_EQ(half.kind, CurveKind::kReversed);
  const CurveShape cobra = find_shape(shaped(8.0, {{90.0, 10.0}, {60.0, -30.0}}).tool.wire);
  EXPECT_EQ(cobra.kind, CurveKind::kHooked);
  EXPECT_EQ(find_shape(shaped(8.0, {}).tool.wire).kind, CurveKind::kStraight);
  EXPECT_EQ(find_shape(shaped(0.0, {{330.0, 7.0}}).tool.wire).kind, CurveKind::kRing);
  EXPECT_EQ(find_shape(shaped(8.0, {{45.0, 10.0}}).tool.wire).kind, CurveKind::kSimple);
}

TEST(CatheterChoice, FollowsTheTakeOffAndTheTrunk) {
  const std::vector<Catheter> known = {shaped(8.0, {{45.0, 10.0}}),                 // vertebral
                                       shaped(8.0, {{90.0, 8.0}, {60.0, -25.0}}),   // small Cobra
                                       shaped(8.0, {{90.0, 12.0}, {60.0, -30.0}}),  // large Cobra
                                       shaped(8.0, {{60.0, 8.0}, {170.0, 12.0}}),   // Simmons
                                       shaped(0.0, {{330.0, 7.0}})};                // pigtail
  const auto chosen = [&](double angle, double trunk, double branch) {
    std::vector<int> list;
    for (const Suggestion& s : suggest_catheters(known, turning_by(angle, trunk, branch))) {
      list.push_back(s.catheter);
    }
    return list;
  };
  EXPECT_EQ(chosen(150.0, 22.0, 5.0), (std::vector<int>{3, 2, 1, 0}))
      << "30 degrees down: reversed";
  EXPECT_EQ(chosen(90.0, 40.0, 5.0), (std::vector<int>{2, 1, 3, 0}))
      << "Cobras, the wider one first";
  EXPECT_EQ(chosen(90.0, 8.0, 5.0), (std::vector<int>{1, 2, 0, 3}));
  EXPECT_EQ(chosen(30.0, 22.0, 5.0), (std::vector<int>{0, 2, 1, 3}));
  // Simple curves begin 60 degrees off, reversed ones 120.
  EXPECT_EQ(chosen(106.0, 8.0, 5.0), (std::vector<int>{1, 2, 3, 0})) << "nearer to reversed";
  EXPECT_EQ(chosen(74.0, 40.0, 5.0), (std::vector<int>{2, 1, 0, 3})) << "nearer to simple";
  EXPECT_TRUE(chosen(90.0, 22.0, 1.6).empty()) << "thicker than the branch";
  const std::vector<Suggestion> simmons = suggest_catheters(known, turning_by(150.0, 22.0, 5.0));
  EXPECT_EQ(simmons.at(0).reason.find("the branch turns by 150 degrees from its trunk, which asks "
                                      "for a reversed curve; this one's whole shape is "),
            0U)
      << simmons.at(0).reason;
  const std::vector<Suggestion> next =
      suggest_catheters({known[0], known[1]}, turning_by(150.0, 22.0, 5.0));
  ASSERT_EQ(next.size(), 2U);
  EXPECT_EQ(next[0].catheter, 1);
  EXPECT_NE(next[0].reason.find("of which none is there; a hooked curve comes next"),
            std::string::npos);
}

/// Scripts that a search finds, from below, with a catheter that curves once by so much, into a
/// branch at that angle to the way down, 30 mm past the aorta's wall; that the first of them
/// reaches in full is expected.
int count_scripts(double between, double curve, double radius) {
  const double angle = between * kRadPerDeg, out = kAorta / std::sin(angle) + 30.0;
  const Vec3 aside(std::sin(angle), 0.0, -std::cos(angle)), from(0.0, 0.0, kHigh);
  const simulate::VesselModel vessel(oblique_surface(aside, out),
                                     simulate::LumenOptions{.grid_spacing = 0.6});
  Study study = toward(1.0);
  study.wires[0].sections[0].bending_stiffness = 5.0;
  study.wires[0].sections[1].bending_stiffness = 60.0;
  study.catheters = {shaped(8.0, {{curve, radius}})};
  study.catheters[0].tool.inner_radius = 0.5;
  const auto way = std::make_shared<simulate::Way>(
      line_through({{0.0, 0.0, 5.0}, from, from + out * aside}),
      std::vector<preprocess::Branch>{
          {line_through({{0.0, 0.0, 5.0}, {0.0, 0.0, kTop - 2.0}}), -1, 0.0},
          {line_through({from, from + (out + 14.0) * aside}), 0, kHigh - 5.0}});
  study.goal = simulate::goal_at_end(way);
  study.insertion.length = 300.0;
  const ToolScripts scripts = find_tool_scripts(study, vessel, {.threads = 2});
  const int count = scripts.pairs.at(0).found;
  if (count > 0) {
    const simulate::TrialResult trial = run_candidate(study, scripts.found.at(0), vessel);
    EXPECT_EQ(trial.outcome, simulate::Outcome::kReached) << trial.reason;
  }
  return count;
}

TEST(ToolSearch, ABranchThatRunsDownTakesAReversedCurve) {
  const double cobra = 90.0, reversed = 160.0;  // degrees by which the catheter curves
  EXPECT_GT(count_scripts(90.0, cobra, 8.0), 0);
  EXPECT_EQ(count_scripts(30.0, cobra, 8.0), 0) << "the wire comes no further than the ostium";
  EXPECT_GT(count_scripts(30.0, reversed, 7.0), 0);
}

}  // namespace
}  // namespace wireplan::plan
