#pragma once
/// Whether the target can be reached, why, and what would change that: for who decides on the
/// procedure. Follows from what was simulated and measured; simulates nothing.
#include <optional>
#include <string>
#include <vector>

#include "plan/judge.h"

namespace wireplan::plan {

enum class Answer { kFeasible, kFeasibleWithRisk, kUnsure, kNotFeasible };
const char* answer_name(Answer answer);   // in files: "feasible", "feasible_with_risk", ...
const char* answer_words(Answer answer);  // to a reader: "feasible with risk"

struct Verdict {
  Answer answer = Answer::kUnsure;
  std::string headline;              // one sentence
  std::vector<std::string> reasons;  // sentences with their numbers, those that decide first
  std::vector<std::string> changes;  // what would change it, from what failed; empty: nothing known
};

/// A device and the narrowest place that it must pass.
struct Passage {
  double lumen = 0.0, at = 0.0;  // diameter; arc length from the access                    [mm]
  double device = 0.0;           // diameter                                                [mm]
  double max_ratio = 1.0;        // of device over lumen; at it, the device does not pass
  bool assumed = false;          // the device is a default; nobody said that it is to pass
  bool oval = false;  // the lumen is wide one way alone, the device thicker than the other
};

/// What is known of the way before a wire is pushed (anatomy/passage.h), with its grades.
struct WayFindings {
  Passage device, sheath;
  double sheath_length = 0.0;         // of the way, that the sheath lies in                [mm]
  bool weighs_sheath = true;          // false: its length is assumed, and longer than the way
  double length = 0.0;                // of the way                                         [mm]
  std::optional<double> tortuosity;   // empty where the way ends where it starts
  int tortuosity_grade = 0;           // of 3, grade_of()
  double bend = 0.0, bend_at = 0.0;   // sharpest, between its arms [rad]; arc length [mm]
  int bend_grade = 0;                 // of 3
  std::string bend_ostium;            // the branch that the way turns into there; else empty
  std::optional<double> wire_needed;  // by the first plan, with what is to be held and taken over
                                      // the wire                                           [mm]
};

/// Where one answer ends and the next begins. None of them was measured on patients.
struct VerdictRules {
  /// Of disturbed repeats that are safe: below, there is a risk. One attempt in ten that fails is
  /// what is borne; chosen.
  double safe_share = 0.9;
  /// A plan that works every other time is none to count on: unsure where the 95 % interval of the
  /// share is below. Where it holds both this and `safe_share`, the repeats do not tell the two
  /// apart: unsure too.
  double doubtful_share = 0.5;
  /// Feasible is said only where with 95 % confidence at least so many attempts are safe; chosen:
  /// of three failures in ten one would want to hear before. It takes 9 repeats that are all safe,
  /// or 15 of 16.
  double sure_share = 0.7;
  /// Of all trials: where more end without telling whether the wire would reach (at an end of the
  /// image, in a loop that crosses itself, without equilibrium, by our fault), "none reaches" is no
  /// finding. Chosen: the trials that reach are fewer than this in most cases.
  double unclear_part = 0.25;
};

struct Known {
  const Study& study;
  const Plan& plan;
  const Judgement& judgement;
  Limits limits = {};
  std::optional<WayFindings> way = {};
  std::vector<std::string> angled_wires = {};  // of the catalogue, that the case did not try
  bool yields = true;  // the study's wall; that of scouts and probes does not
  bool moves = false;  // the vessel's cross-sections, also under scouts and probes
  /// How far the wall may be off, in or out; repeats may move it less (largest_lumen_offset) [mm].
  double wall_offset = Unknowns{}.lumen;
};

/// The first of these that holds:
///   not feasible        the narrowest place is narrower than a device that was asked for by more
///                       than the wall's place is unknown (wall_offset, at both sides); or no
///                       trial is a plan, and nothing of what follows leaves that open
///   unsure              no plan, and: none computed with fine elements came to a clear end (probes
///                       count, since what clearly fails in one is not run in full), or more than
///                       `unclear_part` of all did not, or one reached that was not run in full,
///                       or none was and most got stuck, folded back or went through a wall that
///                       yields but was taken not to. A plan, but: it was not repeated, its share
///                       of safe repeats is not known well enough, or that of a plan that mostly
///                       fails, its tip's error is not known or too large, or its end hangs on how
///                       it is computed (RankedPlan::sensitive)
///   feasible with risk  tip force, also that of 19 in 20 repeats, above the level to warn of;
///                       share of safe repeats too low; wall moved beyond linear theory; sheath at
///                       its largest ratio to the lumen, or device as wide as the lumen; way or
///                       bend severe, but for the turn into a branch
///   feasible            else
/// "A plan" is the first of the ranking.
Verdict find_verdict(const Known& known, const VerdictRules& rules = {});

}  // namespace wireplan::plan
