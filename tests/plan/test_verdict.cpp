#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "plan/number_text.h"
#include "plan/verdict.h"
#include "tests/plan/known_plans.h"
#include "tests/plan/two_renals.h"

namespace wireplan::plan {
namespace {

TEST(Verdict, OfAGoodPlanIsFeasibleAndTellsItsNumbers) {
  WhatIsKnown bench = WhatIsKnown::good();
  bench.way = wide_way();
  const Verdict verdict = bench.verdict();
  EXPECT_EQ(verdict.answer, Answer::kFeasible);
  EXPECT_EQ(verdict.headline,
            "The wire straight reaches the target within all limits, safe in 16 of 16 disturbed "
            "repeats, with at most 0.10 N at its tip.");
  EXPECT_EQ(
      verdict.reasons,
      (std::vector<std::string>{
          "Safe in 16 of 16 disturbed repeats, which is 100 % (81 to 100 % with 95 % confidence), "
          "where 90 % is asked for.",
          "Tip force at most 0.10 N, and 0.10 N in 95 % of the disturbed repeats: below the "
          "warning level of 0.3 N (limit 1.5 N).",
          "The tip's stated error is 0.12 mm, of the computation alone; the lumen at the target "
          "has a radius of 2.5 mm.",
          "The narrowest place of the way is 5 mm wide, 312 mm from the access; a device of "
          "1.67 mm passes.",
          "The sheath of 2.7 mm is 0.40 times as wide as the narrowest lumen in the first 110 mm "
          "(6.75 mm); below 1.05 it passes.",
          "The way is 1.10 times as long as the straight line between its ends: tortuosity below "
          "mild.",
          "The sharpest bend leaves 130 deg between its arms (180 is straight), 80 mm from the "
          "access: mild angulation."}));
  EXPECT_TRUE(verdict.changes.empty());
}

TEST(Verdict, NothingKnownOfTheWayIsNotSpokenOf) {
  const Verdict verdict = WhatIsKnown::good().verdict();
  EXPECT_EQ(verdict.answer, Answer::kFeasible);
  EXPECT_EQ(verdict.reasons.size(), 3U);
}

TEST(Verdict, ShareOfSafeRepeatsDecidesAtItsEdges) {
  struct Row {
    int safe, others;
    Answer answer;
  };
  // 15/16 is 94 % (72 to 99), 14/16 88 %. Where all are safe the interval starts at 44 % for 3, 51
  // % for 4, 68 % for 8, 70.1 % for 9; of 9 in 10 at 60 %; of 7 in 8 it is 53 to 98 %, of 6 in 8 41
  // to 93 %. Of 4 in 16 it ends at 49.5 %, of 5 in 16 at 56 %, of none in 4 at 49.0 %.
  for (const Row& row : {Row{15, 1, Answer::kFeasible}, Row{14, 2, Answer::kFeasibleWithRisk},
                         Row{9, 1, Answer::kUnsure}, Row{3, 0, Answer::kUnsure},
                         Row{4, 0, Answer::kUnsure}, Row{8, 0, Answer::kUnsure},
                         Row{9, 0, Answer::kFeasible}, Row{7, 1, Answer::kFeasibleWithRisk},
                         Row{6, 2, Answer::kUnsure}, Row{5, 11, Answer::kFeasibleWithRisk},
                         Row{4, 12, Answer::kUnsure}, Row{0, 4, Answer::kUnsure}}) {
    SCOPED_TRACE(std::to_string(row.safe) + " and " + std::to_string(row.others));
    WhatIsKnown bench = WhatIsKnown::good();
    bench.plan.repeated.clear();
    bench.repeat(0, row.safe, row.others);
    EXPECT_EQ(bench.verdict().answer, row.answer);
  }
}

TEST(Verdict, OfALowShareTellsReachedRepeatsAndWhatWouldMendThem) {
  WhatIsKnown bench = WhatIsKnown::good();
  bench.plan.repeated.clear();
  bench.repeat(0, 12, 4);
  // One of the safe ones breaks the limit of tip force.
  bench.plan.repeated[0].trials[0].metrics.peak_tip_force = 2.0;
  bench.angled_wires = {"angled-a", "angled-b"};
  const Verdict verdict = bench.verdict();
  EXPECT_EQ(verdict.answer, Answer::kFeasibleWithRisk);
  EXPECT_EQ(verdict.reasons.front(),
            "Safe in 11 of 16 disturbed repeats, which is 69 % (44 to 86 % with 95 % confidence), "
            "where 90 % is asked for; it reaches in 12.");
  EXPECT_TRUE(tells(verdict.changes,
                    "A wire with an angled tip: 4 of 5 failed repeats went past the branch, and no "
                    "such wire was tried (in the catalogue: angled-a and angled-b)."));
  EXPECT_TRUE(tells(verdict.changes, "1 of 5 failed repeats pressed the tip on the wall"));
  bench.angled_wires = {"a", "b", "c", "d", "e", "f", "g"};
  EXPECT_TRUE(tells(bench.verdict().changes, "(in the catalogue: a, b, c, d, e and 2 more)."));
}

TEST(Verdict, APlanThatMostlyFailsIsNoneToCountOn) {
  WhatIsKnown bench = WhatIsKnown::good();
  bench.plan.repeated.clear();
  bench.repeat(0, 3, 13);
  const Verdict verdict = bench.verdict();
  EXPECT_TRUE(verdict.headline.ends_with(
      " reaches the target within all limits, but in disturbed repeats it fails more often than "
      "not."));
  EXPECT_EQ(verdict.reasons.front(),
            "Safe in 3 of 16 disturbed repeats, which is 19 % (7 to 43 % with 95 % confidence), "
            "where 90 % is asked for; a plan that fails more often than not is none to count on.");
}

TEST(Verdict, AForceOfNothingIsZero) {
  EXPECT_EQ(two_digits(0.0), "0");
  EXPECT_EQ(two_digits(-4e-5), "0");
  EXPECT_EQ(two_digits(6e-5), "0.0001");
  EXPECT_EQ(two_digits(0.0814), "0.081");
}

TEST(Verdict, WithoutRepeatsIsUnsure) {
  WhatIsKnown bench = WhatIsKnown::good();
  bench.plan.repeated.clear();
  const Verdict verdict = bench.verdict();
  EXPECT_EQ(verdict.answer, Answer::kUnsure);
  EXPECT_TRUE(tells(verdict.reasons, "How often the plan stays safe is not known"));
  EXPECT_EQ(verdict.headline,
            "In the computation the wire straight reaches the target within all limits, but how "
            "often it stays safe is not known.");
  EXPECT_TRUE(tells(verdict.changes, "Repeating the plan under disturbances"));
}

TEST(Verdict, TipForceAboveTheWarningLevelIsARisk) {
  for (const double force : {0.3, 0.31}) {
    WhatIsKnown bench = WhatIsKnown::good();
    bench.plan.trials[0].metrics.peak_tip_force = force;
    const Verdict verdict = bench.verdict();
    EXPECT_EQ(verdict.answer, force > 0.3 ? Answer::kFeasibleWithRisk : Answer::kFeasible);
    EXPECT_EQ(tells(verdict.reasons, "0.31 N, and 0.10 N in 95 % of the disturbed repeats: above"),
              force > 0.3);
  }
  // Also where only the repeats are.
  WhatIsKnown bench = WhatIsKnown::good();
  bench.plan.repeated.clear();
  bench.repeat(0, 16, 0, Outcome::kStuck, 0.5);
  EXPECT_EQ(bench.verdict().answer, Answer::kFeasibleWithRisk);
}

TEST(Verdict, TipErrorThatIsUnknownOrLargeIsUnsure) {
  WhatIsKnown unknown = WhatIsKnown::good();
  unknown.plan.refinements.clear();
  EXPECT_EQ(unknown.verdict().answer, Answer::kUnsure);
  EXPECT_TRUE(tells(unknown.verdict().reasons, "The error of the tip's place is not known."));
  WhatIsKnown elsewhere = WhatIsKnown::good();
  elsewhere.plan.refinements[0].error.reset();
  EXPECT_EQ(elsewhere.verdict().answer, Answer::kUnsure);
  EXPECT_TRUE(tells(elsewhere.verdict().reasons, "pushes do not end there."));

  // Half of the lumen's radius of 2.5 mm.
  for (const double error : {1.24, 1.25}) {
    WhatIsKnown bench = WhatIsKnown::good();
    bench.plan.refinements[0].error->tip = error;
    EXPECT_EQ(bench.verdict().answer, error < 1.25 ? Answer::kFeasible : Answer::kUnsure);
  }
  // Of a sphere what is left to its border.
  for (const double error : {0.49, 0.51}) {
    WhatIsKnown bench = WhatIsKnown::good();
    bench.study.goal.at_section = false;
    bench.plan.trials[0].metrics.tip_to_target = 2.0;
    bench.plan.refinements[0].error->tip = error;
    const Verdict verdict = bench.verdict();
    EXPECT_EQ(verdict.answer, error < 0.5 ? Answer::kFeasible : Answer::kUnsure);
    EXPECT_EQ(tells(verdict.reasons, "so it may not be in the target"), error > 0.5);
  }
}

TEST(Verdict, AnEndThatHangsOnHowItIsComputedIsUnsure) {
  for (const double apart : {0.99, 1.01}) {
    WhatIsKnown bench = WhatIsKnown::good();
    bench.plan.refinements[0].others = {
        {.setting = Setting::kStep, .change = {.tip = apart}, .incomplete = ""}};
    const Verdict verdict = bench.verdict();
    EXPECT_EQ(verdict.answer, apart < 1.0 ? Answer::kFeasible : Answer::kUnsure);
    EXPECT_EQ(tells(verdict.reasons, "with pushes half as long its tip ends 1.0 mm away"),
              apart > 1.0);
    EXPECT_EQ(tells(verdict.reasons,
                    "does not hang on how it is computed: with pushes half as long its tip ends "
                    "0.99 mm away, where up to 1.0 mm may be."),
              apart < 1.0)
        << "only what was run is told";
    EXPECT_EQ(tells(verdict.changes, "Another wire, angle or roll whose end"), apart > 1.0);
    bench.study.goal.way = toward(1.0).goal.way;
    EXPECT_EQ(tells(bench.verdict().changes, "A shaped catheter that leads the wire"), apart > 1.0);
    bench.study.catheters = toward(1.0).catheters;
    EXPECT_EQ(tells(bench.verdict().changes, "Another wire, catheter, angle or roll whose end"),
              apart > 1.0);
  }
}

TEST(Verdict, AWallMovedBeyondItsModelIsARisk) {
  WhatIsKnown bench = WhatIsKnown::good();
  bench.plan.trials[0].metrics.wall_motion = {.displacement = 1.2, .radius = 3.0};
  EXPECT_EQ(bench.verdict().answer, Answer::kFeasibleWithRisk);
  EXPECT_TRUE(tells(bench.verdict().reasons, "The wall moves 1.2 mm where"));
  EXPECT_EQ(bench.verdict().changes,
            std::vector<std::string>{"A softer wire, which moves the wall less."});
  bench.moves = true;  // as a whole too, by more
  EXPECT_TRUE(tells(bench.verdict().reasons, "The wall is dented by 1.2 mm where"));
  EXPECT_TRUE(tells(bench.verdict().changes, "A softer wire, which dents the wall less."));
  bench.moves = false;

  // Rather another plan, where it is known to hold.
  bench.add(Outcome::kReached).peak_contact_force = 0.3;  // behind the first
  bench.plan.trials.back().metrics.wall_motion = {.displacement = 0.5, .radius = 3.0};
  bench.repeat(2, 16);
  bench.refine(2, 0.1);
  EXPECT_TRUE(tells(bench.verdict().changes, "Plan 2 in its place ("));
  EXPECT_TRUE(tells(bench.verdict().changes, "): the wall moves at most 0.50 mm."));
}

TEST(Verdict, OffersOnlyPlansThatAreKnownToHold) {
  enum class Lacks { kNothing, kRepeats, kSafety, kError, kRoom, kOneEnd };
  for (const Lacks lacks : {Lacks::kNothing, Lacks::kRepeats, Lacks::kSafety, Lacks::kError,
                            Lacks::kRoom, Lacks::kOneEnd}) {
    SCOPED_TRACE(static_cast<int>(lacks));
    WhatIsKnown bench = WhatIsKnown::good();
    bench.plan.trials[0].metrics.peak_tip_force = 0.4;  // above the warning level
    bench.add(Outcome::kReached).peak_contact_force = 0.9;
    if (lacks == Lacks::kSafety) {
      bench.repeat(2, 14, 2);
    } else if (lacks != Lacks::kRepeats) {
      bench.repeat(2, 15, 1);
    }
    if (lacks != Lacks::kError) bench.refine(2, lacks == Lacks::kRoom ? 104.0 : 0.1);
    if (lacks == Lacks::kOneEnd) {
      bench.plan.refinements.back().others = {
          {.setting = Setting::kStep, .change = {.tip = 5.0}, .incomplete = ""}};
    }
    const Verdict verdict = bench.verdict();
    ASSERT_EQ(verdict.answer, Answer::kFeasibleWithRisk);
    ASSERT_EQ(verdict.changes.size(), 1U);
    const bool offered = tells(verdict.changes, "): tip force at most 0.10 N.");
    EXPECT_EQ(offered, lacks == Lacks::kNothing);
    EXPECT_EQ(tells(verdict.changes, "A wire with a softer tip, which presses less on the wall."),
              !offered);
  }
}

TEST(Verdict, ADeviceIsHeldAgainstTheNarrowestPlaceAndWhatItsWidthIsUnknownBy) {
  // The wall's place is unknown by 0.25 mm at each side: 1.2 mm may be 1.7 mm.
  for (const auto& [lumen, answer] :
       {std::pair(1.1, Answer::kNotFeasible), std::pair(1.2, Answer::kFeasibleWithRisk),
        std::pair(1.67, Answer::kFeasibleWithRisk), std::pair(1.68, Answer::kFeasible)}) {
    SCOPED_TRACE(lumen);
    WhatIsKnown bench = WhatIsKnown::good();
    bench.way = wide_way();
    bench.way->device.lumen = lumen;
    bench.plan.robustness.unknowns.lumen = 0.1;  // what a thin wire's repeats can take
    const Verdict verdict = bench.verdict();
    EXPECT_EQ(verdict.answer, answer);
    EXPECT_EQ(tells(verdict.changes, "A device thinner than "), lumen < 1.68);
    if (answer == Answer::kNotFeasible) {
      EXPECT_EQ(
          verdict.headline,
          "The narrowest place of the way is 1.1 mm wide, 312 mm from the access; a device of "
          "1.67 mm does not pass.");
    }
  }
}

TEST(Verdict, WhatPassesAnOvalLumenByItsAreaAloneIsTold) {
  WhatIsKnown known = WhatIsKnown::good();
  known.way = wide_way();
  known.way->device.oval = known.way->sheath.oval = true;
  const Verdict verdict = known.verdict();
  EXPECT_EQ(verdict.answer, Answer::kFeasible);
  for (const char* device : {"device of 1.67 mm ", "below 1.05 it "}) {
    const std::string told = std::string(device) + "passes where the lumen, oval there, gives way.";
    EXPECT_TRUE(tells(verdict.reasons, told)) << told;
  }
}

TEST(Verdict, ADeviceThatIsOnlyAssumedForbidsNothing) {
  WhatIsKnown known = WhatIsKnown::good();
  known.way = wide_way();
  known.way->device.lumen = 0.6;
  known.way->device.assumed = known.way->sheath.assumed = true;
  const Verdict verdict = known.verdict();
  EXPECT_EQ(verdict.answer, Answer::kFeasibleWithRisk);
  EXPECT_EQ(verdict.reasons.front(),
            "The narrowest place of the way is 0.6 mm wide, 312 mm from the access; a device of "
            "1.67 mm, which is assumed, does not pass.");
  EXPECT_TRUE(tells({verdict.headline}, "The wire straight reaches the target"));
  EXPECT_TRUE(tells(verdict.reasons, "The sheath of 2.7 mm (assumed) is 0.40 times as wide"));
}

TEST(Verdict, SheathGradesAndShortWiresOfTheWay) {
  WhatIsKnown bench = WhatIsKnown::good();
  bench.way = wide_way();
  bench.way->sheath.lumen = 2.7 / 1.05;  // at the largest ratio
  EXPECT_EQ(bench.verdict().answer, Answer::kFeasibleWithRisk);
  EXPECT_TRUE(tells(bench.verdict().changes, "A sheath thinner than 2.7 mm, or another access."));

  bench.way = wide_way();
  bench.way->tortuosity_grade = 3;
  EXPECT_EQ(bench.verdict().answer, Answer::kFeasibleWithRisk);
  EXPECT_TRUE(tells(bench.verdict().changes, "Another access, from which the way is less bent."));

  bench.way = wide_way();
  bench.way->bend_grade = 3;
  EXPECT_EQ(bench.verdict().answer, Answer::kFeasibleWithRisk);
  bench.way->bend_ostium = "branch 3";  // a branch's own angle is none of the access
  EXPECT_EQ(bench.verdict().answer, Answer::kFeasible);
  EXPECT_TRUE(tells(bench.verdict().reasons, "where the way turns into branch 3."));

  bench.way = wide_way();
  bench.way->wire_needed = 1600.0;
  EXPECT_EQ(bench.verdict().answer, Answer::kFeasible);
  EXPECT_TRUE(tells(bench.verdict().changes, "A wire of at least 1600 mm"));

  EXPECT_TRUE(tells(bench.verdict().reasons, "are needed to take a catheter over it"));
  bench.study.catheters.emplace_back();
  bench.plan.candidates[0].catheter = 0;
  EXPECT_TRUE(tells(bench.verdict().reasons, "are needed to take the catheter over it"));
  // Of two wires the shorter one counts.
  bench.study.wires.push_back(bench.study.wires[0]);
  bench.study.wires[0].sections.back().length += 5000.0;
  EXPECT_FALSE(tells(bench.verdict().reasons, "are needed to take the catheter over it"));
  bench.plan.candidates[0].first_wire = 1;
  EXPECT_TRUE(tells(bench.verdict().reasons, "are needed to take the catheter over it"));
  bench.plan.candidates[0].first_wire = -1;
  bench.way->wire_needed = bench.study.wires[0].length();
  EXPECT_FALSE(tells(bench.verdict().reasons, "to take")) << "it is just long enough";
}

TEST(Verdict, WhereAllFailInFullIsNotFeasible) {
  WhatIsKnown bench;
  bench.add_many(7, Outcome::kPassedBy);
  bench.add_many(2, Outcome::kStuck);
  bench.add_many(11, Outcome::kStuck, Level::kScout);
  const Verdict verdict = bench.verdict();
  EXPECT_EQ(verdict.answer, Answer::kNotFeasible);
  EXPECT_EQ(verdict.headline, "None of 20 trials reaches the target.");
  EXPECT_EQ(verdict.reasons,
            (std::vector<std::string>{"Of 20 trials 13 got stuck and 7 passed by the branch; 9 of "
                                      "them were computed with fine elements, the others "
                                      "coarsely."}));
  EXPECT_EQ(verdict.changes.size(), 3U);
  EXPECT_TRUE(tells(verdict.changes, "Another access, or a wire of another stiffness: 13 of 20"));
  EXPECT_TRUE(tells(verdict.changes, "A wire with an angled tip: 7 of 20 trials"));
  EXPECT_TRUE(
      tells(verdict.changes,
            "Running all trials in full detail: the wall was taken for rigid in 11 of 20 trials."));
}

TEST(Verdict, OfOneTrialSpeaksOfOne) {
  WhatIsKnown past;
  past.add(Outcome::kPassedBy);
  past.study.wires[0].sections[0].rest_curvature = 0.04;
  EXPECT_EQ(past.verdict().headline, "The one trial does not reach the target.");
  EXPECT_EQ(past.verdict().changes,
            std::vector<std::string>{"Turning the wire at the branch: the one trial went past the "
                                     "branch; the wire was not turned."});
  WhatIsKnown rough;
  rough.add(Outcome::kReached).peak_tip_force = 2.0;
  EXPECT_EQ(rough.verdict().headline,
            "The one trial reaches the target, but not within the limits.");
  WhatIsKnown loop;
  loop.add(Outcome::kCrossesItself);
  EXPECT_TRUE(tells(loop.verdict().reasons, "The one trial made a loop that crosses itself."));
  WhatIsKnown held;
  held.add(Outcome::kStuck, Level::kProbe);
  EXPECT_TRUE(tells(held.verdict().reasons, "The one trial got stuck, folded back or went"));
  EXPECT_TRUE(tells(held.verdict().changes, "the wall was taken for rigid in the one trial."));
}

TEST(Verdict, AWayThatIsStraightIsCalledSo) {
  for (const double tortuosity : {1.004, 1.006}) {
    WhatIsKnown bench = WhatIsKnown::good();
    bench.way = wide_way();
    bench.way->tortuosity = tortuosity;
    EXPECT_TRUE(tells(bench.verdict().reasons,
                      tortuosity < 1.005
                          ? "The way is straight (1.00 times the line between its ends): tort"
                          : "The way is 1.01 times as long as the straight line"));
  }
}

TEST(Verdict, OfAWayWithoutABendTellsNoPlaceOfOne) {
  WhatIsKnown bench = WhatIsKnown::good();
  bench.way = wide_way();
  bench.way->bend = 176.0 * kRadPerDeg;
  bench.way->bend_grade = 0;
  EXPECT_TRUE(tells(bench.verdict().reasons,
                    "No bend of the way leaves less than 176 deg between its arms"));
  bench.way->bend = 165.0 * kRadPerDeg;
  EXPECT_TRUE(tells(bench.verdict().reasons,
                    "The sharpest bend leaves 165 deg between its arms (180 is straight), "));
  bench.way->bend = 176.0 * kRadPerDeg;  // and a case that asks for straighter
  bench.way->bend_grade = 1;
  EXPECT_TRUE(tells(bench.verdict().reasons, "176 deg between its arms (180 is straight), "));
}

TEST(Verdict, WhereAllThatReachBreakALimitIsNotFeasible) {
  WhatIsKnown bench;
  bench.add(Outcome::kReached).peak_tip_force = 2.0;
  bench.add(Outcome::kReached).max_penetration = 0.4;
  bench.add(Outcome::kStuck);
  const Verdict verdict = bench.verdict();
  EXPECT_EQ(verdict.answer, Answer::kNotFeasible);
  EXPECT_EQ(verdict.headline, "2 of 3 trials reach the target, none of them within the limits.");
  EXPECT_EQ(verdict.reasons.front(),
            "2 trials reach the target but break a limit: tip force above 1.5 N in 1 and "
            "wire more than 0.3 mm past the wall in 1.");
  EXPECT_TRUE(tells(verdict.changes, "A wire with a softer tip: 1 of 3 trials"));
  EXPECT_TRUE(tells(verdict.changes, "A softer wire: 1 of 3 trials"));
}

TEST(Verdict, WhatReachedCoarselyAloneIsNotSaidToBreakALimit) {
  WhatIsKnown bench;
  bench.add_many(8, Outcome::kStuck);
  bench.add(Outcome::kReached, Level::kScout);
  EXPECT_EQ(bench.verdict().headline,
            "1 of 9 trials reaches the target, but was not run in full detail.");
  bench.add(Outcome::kReached, Level::kScout);
  EXPECT_EQ(bench.verdict().headline,
            "2 of 10 trials reach the target, none of which was run in full detail.");
  bench.add(Outcome::kReached).peak_tip_force = 2.0;
  EXPECT_EQ(bench.verdict().headline,
            "3 of 11 trials reach the target: 1 breaks a limit, and 2 were not run in full "
            "detail.");
}

TEST(Verdict, WhereMuchEndsWithoutAResultIsUnsure) {
  // A quarter may, more may not.
  for (const int unclear : {2, 3}) {
    WhatIsKnown bench;
    bench.add_many(8 - unclear, Outcome::kStuck);
    bench.add_many(unclear, Outcome::kNotConverged);
    EXPECT_EQ(bench.verdict().answer, unclear == 2 ? Answer::kNotFeasible : Answer::kUnsure);
    EXPECT_TRUE(tells(bench.verdict().changes, "A finer computation: "));
  }
  WhatIsKnown ends;
  ends.add_many(5, Outcome::kStuck);
  ends.add_many(5, Outcome::kLeftImage);
  EXPECT_EQ(ends.verdict().answer, Answer::kUnsure);
  EXPECT_TRUE(tells(ends.verdict().reasons,
                    "5 of 10 trials ended without telling whether the wire would reach the target; "
                    "at most 25 % may."));
  EXPECT_TRUE(
      tells(ends.verdict().changes, "A scan that shows more of the vessel: 5 of 10 trials"));
}

TEST(Verdict, WhatWasOnlyScoutedIsUnsure) {
  WhatIsKnown scouted;
  scouted.add_many(9, Outcome::kStuck, Level::kScout);
  EXPECT_EQ(scouted.verdict().answer, Answer::kUnsure);
  EXPECT_EQ(scouted.verdict().reasons.front(), "No trial was computed with fine elements.");
  EXPECT_TRUE(tells(scouted.verdict().reasons, "All 9 trials got stuck, computed coarsely."));

  WhatIsKnown reached;
  reached.add_many(9, Outcome::kStuck);
  reached.add(Outcome::kReached, Level::kScout);
  EXPECT_EQ(reached.verdict().answer, Answer::kUnsure);
  EXPECT_EQ(reached.verdict().reasons.front(),
            "1 trial reaches the target against a rigid wall, and was not run in full detail.");
}

TEST(Verdict, WhatClearlyFailsInAProbeIsAFinding) {
  WhatIsKnown probed;
  probed.add_many(9, Outcome::kPassedBy, Level::kProbe);
  EXPECT_EQ(probed.verdict().answer, Answer::kNotFeasible);
  EXPECT_EQ(probed.verdict().reasons.front(), "All 9 trials passed by the branch.");
}

TEST(Verdict, ChangesFollowFromWhatWasTried) {
  WhatIsKnown bench;
  bench.add_many(9, Outcome::kWrongBranch);
  bench.study.wires[0].sections[0].rest_curvature = 0.04;
  EXPECT_TRUE(
      tells(bench.verdict().changes,
            "Turning the wire at the branch: all 9 trials went into another branch; the wire "
            "was not turned."));
  bench.plan.scripts.starts_tried = 2;
  EXPECT_TRUE(tells(bench.verdict().changes, "A shaped catheter that leads the wire"));
  EXPECT_TRUE(tells(bench.verdict().changes, "\"catheters\": \"suggest\" tries some"));

  WhatIsKnown wire;
  wire.add(Outcome::kMissed).insertion = 400.0;
  EXPECT_TRUE(tells(wire.verdict().changes,
                    "More wire in the vessel: the one trial ended before the target with all the "
                    "wire in that may go in, at most 400.0 mm."));
  // One in eleven is too few to speak of.
  wire.add_many(10, Outcome::kStuck);
  EXPECT_FALSE(tells(wire.verdict().changes, "More wire"));
}

TEST(Verdict, OfAWireThatIsTooShortAsksForALongerOne) {
  for (const Level level : {Level::kFull, Level::kScout}) {
    WhatIsKnown bench;
    bench.study.wires[0].sections[0].length = 120.0;
    bench.add(Outcome::kMissed, level).insertion = 120.0;
    const Verdict verdict = bench.verdict();
    EXPECT_TRUE(tells(verdict.reasons, "The one trial ended with all wire in"));
    EXPECT_TRUE(tells(verdict.changes,
                      "A longer wire: the one trial ended before the target with all of the wire "
                      "in."));
    EXPECT_FALSE(tells(verdict.changes, "More wire in the vessel"));
  }
}

TEST(Verdict, OfAMissWithWireLeftAsksForAnotherAim) {
  WhatIsKnown bench;
  bench.add(Outcome::kMissed);
  EXPECT_EQ(bench.verdict().changes,
            std::vector<std::string>{"Another wire, entry angle or roll: the one trial ended "
                                     "before the target or beside it, with wire left to "
                                     "push."});
  bench.study.goal.at_section = false;
  EXPECT_EQ(bench.verdict().changes,
            std::vector<std::string>{
                "A target that is the vessel's whole cross-section, or another wire, entry angle "
                "or roll: the one trial missed the sphere of 2.5 mm radius, which a wire may pass "
                "beside."});
}

TEST(Verdict, AnAssumedSheathLongerThanTheWayIsNotWeighed) {
  WhatIsKnown bench = WhatIsKnown::good();
  bench.way = wide_way();
  bench.way->sheath.lumen = 2.0;  // of 2.7 mm
  EXPECT_EQ(bench.verdict().answer, Answer::kFeasibleWithRisk);
  bench.way->weighs_sheath = false;
  bench.way->length = 84.0;
  const Verdict verdict = bench.verdict();
  EXPECT_EQ(verdict.answer, Answer::kFeasible);
  EXPECT_TRUE(tells(verdict.reasons,
                    "No sheath is weighed: the assumed one is 110 mm long, the way 84 mm."));
}

TEST(Verdict, OfARigidWallAloneSaysWhyThatIsEnoughOrIsUnsure) {
  WhatIsKnown bench;
  bench.add_many(8, Outcome::kPassedBy, Level::kProbe);
  EXPECT_TRUE(tells(bench.verdict().reasons, "rigid, which is enough here: all 8 trials ended in"));
  EXPECT_FALSE(tells(bench.verdict().reasons, "want of wire")) << "none ended so";
  EXPECT_FALSE(tells(bench.verdict().changes, "full detail")) << "it would change nothing";
  bench.add_many(2, Outcome::kStuck, Level::kProbe);
  const Verdict clear = bench.verdict();
  EXPECT_EQ(clear.answer, Answer::kNotFeasible);
  EXPECT_TRUE(tells(clear.reasons, "rigid, which is enough here: 8 of 10 trials ended in"));
  WhatIsKnown coils = bench;
  coils.add_many(4, Outcome::kMissed, Level::kProbe);
  EXPECT_TRUE(tells(coils.verdict().reasons,
                    "12 of 14 trials ended in another vessel or with a tip that went no further"));
  EXPECT_TRUE(tells(clear.changes, "Running all trials in full detail"));
  bench.add_many(7, Outcome::kStuck, Level::kProbe);
  const Verdict held = bench.verdict();
  EXPECT_EQ(held.answer, Answer::kUnsure);
  EXPECT_TRUE(
      tells(held.reasons, "9 of 17 trials got stuck, folded back or went through the wall"));
  bench.add(Outcome::kStuck);  // one in full
  EXPECT_EQ(bench.verdict().answer, Answer::kNotFeasible);
}

TEST(Verdict, TellsTheWallOfCoarseTrialsAsItIs) {
  // Of a vessel that moves as a whole it does so there too; one that is rigid is no other in full.
  enum class Wall { kYields, kMoves, kRigid };
  for (const Wall wall : {Wall::kYields, Wall::kMoves, Wall::kRigid}) {
    SCOPED_TRACE(static_cast<int>(wall));
    WhatIsKnown held, astray, reached;
    for (WhatIsKnown* bench : {&held, &astray, &reached}) {
      bench->moves = wall == Wall::kMoves;
      bench->yields = wall != Wall::kRigid;
    }
    held.add_many(9, Outcome::kStuck, Level::kProbe);
    astray.add_many(9, Outcome::kPassedBy, Level::kProbe);
    reached.add(Outcome::kReached, Level::kScout);
    const std::string taken =
        wall == Wall::kYields ? "taken for rigid" : "taken to move as a whole and take no dents";
    const bool yields = wall != Wall::kRigid;
    EXPECT_EQ(tells(held.verdict().reasons, "which was " + taken + ": one that gives"), yields);
    EXPECT_EQ(tells(astray.verdict().reasons, "The wall was " + taken + ", which is en"), yields);
    EXPECT_EQ(tells(held.verdict().changes, "the wall was " + taken + " in all 9 trials."), yields);
    EXPECT_EQ(tells(held.verdict().changes, "long elements were taken in all 9 trials."), !yields);
    EXPECT_EQ(held.verdict().answer, yields ? Answer::kUnsure : Answer::kNotFeasible);
    EXPECT_TRUE(tells(reached.verdict().reasons,
                      wall == Wall::kMoves
                          ? "against a wall that moves as a whole but takes no dents, and was not"
                          : "against a rigid wall, and was not"));
  }
}

TEST(Verdict, CameAnotherWayIsNotFoldedBack) {
  WhatIsKnown bench;
  bench.add_many(6, Outcome::kAnotherWay);
  bench.add_many(4, Outcome::kProlapsed);
  const Verdict verdict = bench.verdict();
  EXPECT_TRUE(
      tells(verdict.reasons, "6 came to the target another way and 4 folded back on the way"));
  EXPECT_TRUE(tells(verdict.changes, "6 of 10 trials came to the target another way"));
}

}  // namespace
}  // namespace wireplan::plan
