#pragma once
/// The straight pushes of a case, in rounds. The first round scouts all candidates; each later one
/// probes, or runs in full, those that the rounds before say may be among the best (search.h).
/// Where no search is needed, one round runs all in full.
#include <optional>
#include <vector>

#include "plan/search.h"
#include "plan/trial_log.h"

namespace wireplan::plan {

/// The limits and weights by which it is decided what to run: always the defaults, never the
/// case's. The case's own are applied to what was simulated (judge.h), so that changing them
/// simulates nothing.
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

/// What the scouts say before anything is run in full, for somebody who waits.
struct FirstAnswer {
  int trials = 0, reached = 0;
  std::optional<Candidate> best;  // of those that reached the first by score, such that break no
                                  // limit before the others
  Measured trial;                 // its scout
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
  FirstAnswer first_answer() const;              // expects the round of scouts alone
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
