#pragma once
/// What planning simulates, one run at a time, and where it is kept: planning asks the log before
/// it simulates and tells it afterwards, so that it goes on where it was stopped and what is known
/// is never computed again. The log is an interface: files in pipeline, a map in the tests.
#include <functional>
#include <optional>
#include <vector>

#include "plan/batch.h"
#include "plan/robustness.h"

namespace wireplan::plan {

/// How closely a trial is simulated (search.h).
enum class Level {
  kScout,  // rigid wall, long elements
  kProbe,  // rigid wall, the study's own elements
  kFull,   // the study as it is
};
const char* level_name(Level level);  // "scout", "probe", "full"

/// A plan again with other elements, to an insertion (refine.h).
struct OtherElements {
  double factor = 1.0;     // of the study's length
  double insertion = 0.0;  //                                                              [mm]
};

/// One simulated trial: all that tells it from the others of a case.
struct Run {
  Level level = Level::kFull;
  int id = -1;  // of the candidate in Plan::candidates; -1: of a script that may not become one
  Candidate candidate = {};
  std::optional<Disturbance> disturbance = {};
  std::optional<OtherElements> elements = {};
  bool shapes = false;  // those on the way are asked for: a trial kept without is none

  /// The trial of a candidate, and not one that tells how far it can be trusted.
  bool is_plain() const { return !disturbance && !elements; }
};

/// Scripts of moves that reach, and what finding them took.
struct Scripts {
  std::vector<Candidate> found = {};
  std::vector<int> starts = {};  // of each, the straight candidate that it went on from
  int starts_tried = 0;
  long branches = 0;  // pushes that were tried
};

/// Called from one thread at a time, but for keep(), which is called by any.
class TrialLog {
 public:
  virtual ~TrialLog() = default;

  virtual std::optional<Measured> find(const Run& run) = 0;
  /// `trial.shapes` is empty where nobody will ask for them.
  virtual void keep(const Run& run, const simulate::TrialResult& trial,
                    const Measured& measured) = 0;

  /// Those of the study, once they were searched for.
  virtual std::optional<Scripts> find_scripts() = 0;
  virtual void keep_scripts(const Scripts& scripts) = 0;
};

/// The vessel as the runs need it: what is costly is made where a run first asks for it. The use of
/// either model ends before the other is asked for.
struct PlanVessel {
  const Centerline& path;  // access to target
  bool yields = false;
  std::function<const simulate::VesselModel&()> model, rigid_model;
};

/// The study at a level.
Study study_at(const Study& study, Level level);

/// What was not in the log.
struct Spent {
  int runs = 0;
  double cpu_seconds = 0.0;  // timing, so never twice the same                             [s]
};

/// Finds each run in the log, or simulates it, many at once, and keeps it; adds to `spent` what
/// that took. In order of `runs`, which are of one level. Progress counts all of them, those found
/// first. Throws Interrupted; what was finished is kept by then.
std::vector<Measured> find_or_run(const Study& study, const PlanVessel& vessel,
                                  const std::vector<Run>& runs, TrialLog& log,
                                  const BatchOptions& batch, Spent& spent);

}  // namespace wireplan::plan
