#pragma once
/// The straight pushes of a case in rounds: first the scouts of all candidates, then probes and
/// full runs of those that may be among the best, by what is known of the rounds before (search.h);
/// or all in full at once.
#include <optional>
#include <vector>

#include "plan/search.h"
#include "plan/trial_log.h"

namespace wireplan::plan {

/// By what the case's own trials are judged while it is decided which of them to run. Never the
/// case's limits and weights: those judge what was simulated, so that a changed one simulates
/// nothing (judge.h).
struct Yardstick {
  Limits limits = {};
  Weights weights = {};
};

/// What scouting came to; the report's numerics.scout.
struct ScoutSummary {
  double element_length = 0.0, step = 0.0;  //                                             [mm]
  int trials = 0, probed = 0;
  ScoutError error;
};

class Rounds {
 public:
  /// Keeps references.
  Rounds(const Study& study, const PlanVessel& vessel, const std::vector<Candidate>& candidates,
         bool exhaustive);

  /// The runs of the next round, by rising id, all of one level; none where all is known. Expects
  /// take() of what came of the round before.
  std::vector<Run> next();
  void take(std::vector<Measured> found);
  Level level() const { return level_; }  // of the last round

  /// Per candidate the trial of the highest level that ran it, and that level.
  const std::vector<Measured>& trials() const { return trials_; }
  const std::vector<Level>& levels() const { return levels_; }
  std::optional<ScoutSummary> scouting() const;  // empty where all run in full

 private:
  Sighting look(int id, const Measured& trial) const;

  const Study& study_;
  const PlanVessel& vessel_;
  const std::vector<Candidate>& candidates_;
  bool scouted_;
  std::vector<Measured> trials_;
  std::vector<Level> levels_;
  Sightings seen_;  // none where all are run in full
  Level level_ = Level::kFull;
  std::vector<int> ids_;  // of the last round
  int round_ = 0;
};

}  // namespace wireplan::plan
