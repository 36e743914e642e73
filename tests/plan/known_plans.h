#pragma once
/// What planning knows, made by hand, for tests of the verdict.
#include <algorithm>
#include <string>
#include <vector>

#include "plan/verdict.h"

namespace wireplan::plan {

using simulate::Outcome;

/// What planning knows, made by hand: only what the verdict reads.
struct WhatIsKnown {
  Study study;
  Plan plan;
  Limits limits;
  std::optional<WayFindings> way;
  std::vector<std::string> angled_wires;
  bool yields = true, moves = false;

  WhatIsKnown() {
    study.wires.push_back(
        {.name = "straight",
         .radius = 0.4,
         .sections = {{.length = 1500.0, .bending_stiffness = 50.0, .rest_curvature = 0.0}}});
    study.goal = {.radius = 2.5, .at_section = true};
    study.insertion.length = 400.0;
  }

  Metrics& add(Outcome outcome, Level level = Level::kFull) {
    plan.candidates.push_back({});
    plan.levels.push_back(level);
    Metrics& m = plan.trials.emplace_back(Measured{.outcome = outcome}).metrics;
    m.reached = outcome == Outcome::kReached;
    m.insertion = 120.0;
    m.peak_tip_force = 0.1;
    m.peak_contact_force = 0.2;
    return m;
  }
  void add_many(int count, Outcome outcome, Level level = Level::kFull) {
    for (int k = 0; k < count; ++k) add(outcome, level);
  }
  /// Repeats of a trial: so many that reach, and then some of another end.
  void repeat(int trial, int safe, int others = 0, Outcome outcome = Outcome::kPassedBy,
              double tip_force = 0.1) {
    RepeatedTrials& own = plan.repeated.emplace_back(RepeatedTrials{.trial = trial});
    for (int k = 0; k < safe + others; ++k) {
      Metrics& m =
          own.trials.emplace_back(Measured{.outcome = k < safe ? Outcome::kReached : outcome})
              .metrics;
      m.reached = own.trials.back().outcome == Outcome::kReached;
      m.peak_tip_force = tip_force;
    }
  }
  void refine(int trial, double tip_error) {
    plan.refinements.push_back({.trial = trial,
                                .rows = {},
                                .error = NumericalError{.tip = tip_error},
                                .observed_order = {},
                                .reason = "",
                                .cpu_seconds = {},
                                .others = {}});
  }
  /// A plan without anything against it.
  static WhatIsKnown good() {
    WhatIsKnown bench;
    bench.add(Outcome::kReached);
    bench.add(Outcome::kStuck);
    bench.repeat(0, 16);
    bench.refine(0, 0.12);
    return bench;
  }

  Verdict verdict() const {
    return find_verdict({.study = study,
                         .plan = plan,
                         .judgement = judge(study, plan, limits, {}),
                         .limits = limits,
                         .way = way,
                         .angled_wires = angled_wires,
                         .yields = yields,
                         .moves = moves});
  }
};

inline WayFindings wide_way() {
  return {.device = {.lumen = 5.0, .at = 312.0, .device = 1.67},
          .sheath = {.lumen = 6.75, .at = 20.0, .device = 2.7, .max_ratio = 1.05},
          .sheath_length = 110.0,
          .tortuosity = 1.1,
          .tortuosity_grade = 0,
          .bend = 130.0 * kRadPerDeg,
          .bend_at = 80.0,
          .bend_grade = 1,
          .bend_ostium = "",
          .wire_needed = 1400.0};
}

inline bool tells(const std::vector<std::string>& sentences, const std::string& text) {
  return std::any_of(sentences.begin(), sentences.end(), [&](const std::string& sentence) {
    return sentence.find(text) != std::string::npos;
  });
}

}  // namespace wireplan::plan
