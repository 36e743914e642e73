#pragma once
/// What planning simulates, one run at a time, and where it is kept. Planning asks the log for each
/// run, and simulates and keeps it only if it is not there. So a stopped plan goes on where it was,
/// and nothing is computed twice. The log is an interface: files in pipeline, a map in the tests.
#include <functional>
#include <optional>
#include <vector>

#include "plan/batch.h"
#include "plan/manoeuvre.h"
#include "plan/robustness.h"
#include "plan/settings.h"
#include "plan/tool_search.h"

namespace wireplan::plan {

/// How closely a trial is simulated (search.h).
enum class Level {
  kScout,  // rigid wall, long elements
  kProbe,  // rigid wall, the study's own elements
  kFull,   // the study as it is
};
const char* level_name(Level level);  // "scout", "probe", "full"

/// The run of a plan with other elements, or with a setting changed that should not matter, up to
/// the insertion at which the plan ended (refine.h).
struct OtherElements {
  double factor = 1.0;                  // of the study's length
  double insertion = 0.0;               //                                             [mm]
  std::optional<Setting> setting = {};  // that is changed; empty: none
  bool operator==(const OtherElements&) const = default;
};

/// One simulated trial: all that tells it from the others of a case.
struct Run {
  Level level = Level::kFull;
  int id = -1;  // of the candidate in Plan::candidates; -1: of a script that may not become one
  Candidate candidate = {};
  std::optional<Disturbance> disturbance = {};
  std::optional<OtherElements> elements = {};
  bool shapes = false;  // shapes on the way are needed: a trial kept without them does not count

  /// Whether it is the trial of a candidate itself, and neither a repeat nor a refinement of it.
  bool is_plain() const { return !disturbance && !elements; }
};

/// A search for scripts of a wire alone, at one level.
struct MoveSearch {
  Level level = Level::kScout;
  SearchEffort effort = {};
};

/// Scripts of moves that reach, and what finding them took.
struct Scripts {
  std::vector<Candidate> found = {};
  std::vector<int> starts = {};  // of each, the straight candidate that it went on from
  int starts_tried = 0;
  long branches = 0;                      // pushes that were tried
  std::vector<MoveSearch> searches = {};  // of wires alone, in their order
  /// Of catheter and wire: their scripts stand in `found` too, with the start -1, and those of a
  /// pair without one that reaches as what came closest.
  std::vector<PairFindings> pairs = {};
};

/// keep() and keep_other() are called from many threads at once, everything else from one at a
/// time.
class TrialLog {
 public:
  virtual ~TrialLog() = default;

  virtual std::optional<Measured> find(const Run& run) = 0;
  /// `trial.shapes` is empty for runs whose shapes on the way nobody will ask for.
  virtual void keep(const Run& run, const simulate::TrialResult& trial,
                    const Measured& measured) = 0;

  /// The same scout for one of Study::others, found along with the study's own. A log that serves
  /// one target alone drops it.
  virtual void keep_other(std::size_t /*other*/, const Run& /*run*/,
                          const simulate::TrialResult& /*trial*/) {}

  /// The study's scripts; empty as long as they were not searched for.
  virtual std::optional<Scripts> find_scripts() = 0;
  virtual void keep_scripts(const Scripts& scripts) = 0;
};

/// The vessel as the runs need it. The models are costly, so each is made when a run first asks for
/// it. A reference to one model is no longer used once the other is asked for.
struct PlanVessel {
  const Centerline& path;  // access to target
  bool yields = false;
  std::function<const simulate::VesselModel&()> model, rigid_model;
  /// The rigid wall of a vessel that moves as a whole; empty: it does not.
  std::function<const simulate::VesselModel&()> moving_model = {};
  /// What scouts and probes meet.
  const simulate::VesselModel& scout_model() const {
    return moving_model ? moving_model() : rigid_model();
  }
};

/// What the wall of scouts and probes is, of a vessel that moves as a whole or does not: "a rigid
/// wall".
const char* wall_of_scouts(bool moves);

/// The study at a level.
Study study_at(const Study& study, Level level);

/// What simulating took of the runs that were not in the log.
struct Spent {
  int runs = 0;
  double cpu_seconds = 0.0;  // timing, so never twice the same                             [s]
};

/// Finds each run in the log; simulates and keeps those that are not there, many at once, and adds
/// to `spent` what that took. The results are in the order of `runs`, which must be of one level.
/// Progress counts all runs, starting with those found. Throws Interrupted when cancelled; what was
/// finished is kept by then.
std::vector<Measured> find_or_run(const Study& study, const PlanVessel& vessel,
                                  const std::vector<Run>& runs, TrialLog& log,
                                  const BatchOptions& batch, Spent& spent);

}  // namespace wireplan::plan
