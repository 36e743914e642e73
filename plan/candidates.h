#pragma once
/// Which insertions are worth a trial: wires x inclination x azimuth x roll as one flat list.
#include <string>
#include <vector>

#include "plan/catheters.h"
#include "simulate/insertion/trial.h"

namespace wireplan::plan {

/// What the case asks, in internal units.
struct Study {
  std::vector<simulate::Wire> wires;
  std::vector<double> inclinations, azimuths, rolls;  //                            [rad]
  Vec3 access = Vec3::Zero();    //                                                 [mm]
  Vec3 tangent = Vec3::UnitZ();  // of the centerline at the access, into the vessel
  simulate::Goal goal;
  /// Cross-sections that others plan for from the same access: scouts are pushed toward all of them
  /// at once, and each gets its result.
  std::vector<simulate::Goal> others = {};
  simulate::InsertionOptions insertion;
  std::vector<WireSpread> spreads = {};  // of each wire; empty: its values are taken for known
  std::vector<Catheter> catheters = {};  // that wires may be pushed through, see tool_search.h
  ToolRules tool_rules = {};
  std::vector<std::string> suggested =
      {};  // why each catheter is there; empty: the case names them
};

struct Candidate {
  int wire = 0;                                         // index into Study::wires
  double inclination = 0.0, azimuth = 0.0, roll = 0.0;  //                          [rad]
  std::vector<simulate::Move> moves = {};               // before the last push
  int catheter = -1;  // index into Study::catheters, round the wire; -1: none
  std::vector<simulate::ToolStep> steps = {};  // of a script of catheter and wire
  int first_wire = -1;  // that a script begins with and exchanges for `wire`, its spare 0; -1: none
  bool operator==(const Candidate&) const = default;
};

/// All combinations, wires outermost, roll innermost. What cannot differ is listed once: at
/// inclination 0 only the first azimuth, for a straight round wire only the first roll, and an
/// angle that repeats an earlier one (0 and 360 deg) not again. Expects at least one of each.
std::vector<Candidate> list_candidates(const Study& study);

/// Unit direction of the introducer, into the vessel: `tangent` tilted by `inclination` toward the
/// side that `azimuth` names. Azimuth 0 is the patient's anterior (-y in LPS) made normal to the
/// tangent (superior, +z, where the tangent runs within 10 deg of front to back); positive azimuths
/// turn right-handed round the tangent. Expects a tangent of any length but 0.
Vec3 introducer_direction(const Vec3& tangent, double inclination, double azimuth);

/// Where and how the candidate enters the vessel.
simulate::Introducer make_introducer(const Study& study, const Candidate& candidate);

/// Scripts of a pair begin so: at the study's first inclination, azimuth and roll of both hubs.
Candidate first_candidate(const Study& study, const ToolPair& pair);

/// The catheter and the wire that a candidate with one begins with, from the outside in.
std::vector<simulate::Tool> tools_of(const Study& study, const Candidate& candidate);

/// The candidate's wires in the order of their use: one, or two where it exchanges them.
std::vector<int> wires_of(const Candidate& candidate);
int count_exchanges(const Candidate& candidate);

/// Its steps in words, and in one line (catheters.h), with what they call by name.
StepNames step_names(const Study& study, const Candidate& candidate);
std::vector<ToldStep> describe_steps(const Study& study, const Candidate& candidate,
                                     double insertion);
std::string describe_script(const Study& study, const Candidate& candidate, double insertion);

/// Elements of scripts of catheter and wire are so many times the study's: the two together are
/// stiffer than a wire alone, and halving them moved tips by half a millimetre (MEASUREMENTS.md).
inline constexpr double kToolElements = 2.0;
/// Of pushes between two recorded shapes: none is.
inline constexpr double kNoShapes = 1e4;  //                                            [mm]
simulate::ToolTrialOptions tool_options(const Study& study, const Candidate& candidate);
double element_length_of(const Study& study, const Candidate& candidate);  //             [mm]

/// "amplatz-stiff, inclination 15 deg, azimuth 90 deg, roll 0 deg"; " in cobra-c2" where it is in a
/// catheter, " in exchange for rosen" where it takes another's place.
std::string describe(const Study& study, const Candidate& candidate);

}  // namespace wireplan::plan
