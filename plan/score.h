#pragma once
/// What a plan costs: components of its metrics, their weights, and how far errors may change them.
#include <array>

#include "plan/metrics.h"

namespace wireplan::plan {

/// A trial beyond one of the `_fail` limits is excluded. A plan's sentence warns where its tip
/// force is beyond `tip_force_warn`, where the wall moved beyond linear theory (metrics.h), and
/// where the tip is so close to the target's border that its numerical error may put it outside.
struct Limits {
  double tip_force_warn = 0.3;    // references B3                                          [N]
  double tip_force_fail = 1.5;    // references B3                                          [N]
  double off_path_fail = 10.0;    // a wire further from the path's lumen came another way   [mm]
  double penetration_fail = 0.3;  // a wire further past the wall has left the lumen        [mm]
};

/// Weights of the score's components; none negative, those that act not all 0. From `support` on
/// they act in studies with catheters alone; assumed.
struct Weights {
  double reach = 1.0, peak_force = 1.0, mean_force = 0.5, margin = 0.5;
  double support = 0.25, hook = 0.1, wire_beyond = 0.1, hand_force = 0.1, hub_torque = 0.1,
         moves = 0.1, exchanges = 0.1;
};

/// What a plan costs: each component in [0, 1], 0 the best, and their weighted mean. The scales are
/// absolute, so that a score does not depend on which other plans were tried. With the scale of
/// force s = Limits::tip_force_warn (references B3), so that forces on the wall weigh as soon as
/// they are felt:
///   reach       tip_to_target / goal radius; of a cross-section 0    metric: references C1,
///   success peak_force  f / (f + s), f = peak_contact_force                 C1, contact force, max
///   mean_force  f / (f + s), f = mean_contact_force                 C1, contact force, mean
///   margin      peak_tip_force / Limits::tip_force_fail: what is used up of it   C1, tip force
/// f / (f + s) is 1/2 at f = s and never reaches 1, since no limit of side-wall forces is agreed
/// on. In studies with catheters, by ScriptMetrics; each is 1/2 at a scale of ScriptScales:
///   support, hook, wire_beyond   s / (s + x): 1 without a catheter that is seated
///   hand_force, hub_torque, moves, exchanges   x / (x + s)
struct Score {
  double total = 0.0;  // smaller is better
  double reach = 0.0, peak_force = 0.0, mean_force = 0.0, margin = 0.0;
  bool of_script = false;  // whether the others act
  double support = 0.0, hook = 0.0, wire_beyond = 0.0, hand_force = 0.0, hub_torque = 0.0,
         moves = 0.0, exchanges = 0.0;
};

/// Assumed: about what common scripts come to, so that they differ most there.
struct ScriptScales {
  double support = 0.1;       //                                                             [N]
  double hook = 5.0;          //                                                            [mm]
  double wire_beyond = 30.0;  //                                                            [mm]
  double hand_force = 1.0;    //                                                             [N]
  double hub_torque = 5.0;    //                                                          [N mm]
  double moves = 10.0;
  double exchanges = 1.0;
};
inline constexpr ScriptScales kScriptScales;

/// The components, their weights and their names in files.
struct ScorePart {
  const char* name;
  double Score::*cost;
  double Weights::*weight;
  const char* said;  // of a plan that loses most by it: "behind it mostly by ..."
  bool of_script = false;
};
inline constexpr std::array kScoreParts = {
    ScorePart{"reach", &Score::reach, &Weights::reach, "its distance from the centre"},
    ScorePart{"peak_force", &Score::peak_force, &Weights::peak_force, "its peak contact force"},
    ScorePart{"mean_force", &Score::mean_force, &Weights::mean_force, "its mean contact force"},
    ScorePart{"margin", &Score::margin, &Weights::margin, "its tip force"},
    ScorePart{"support", &Score::support, &Weights::support, "its catheter's support", true},
    ScorePart{"hook", &Score::hook, &Weights::hook, "how deep its catheter is seated", true},
    ScorePart{"wire_beyond", &Score::wire_beyond, &Weights::wire_beyond,
              "how far its wire is out of the catheter", true},
    ScorePart{"hand_force", &Score::hand_force, &Weights::hand_force, "the hand's force", true},
    ScorePart{"hub_torque", &Score::hub_torque, &Weights::hub_torque, "the hub's torque", true},
    ScorePart{"moves", &Score::moves, &Weights::moves, "the number of its moves", true},
    ScorePart{"exchanges", &Score::exchanges, &Weights::exchanges, "its exchange of wires", true},
};

/// How far a trial's numbers may be from those of infinitely short elements, on whichever path the
/// solver takes (refine.h): the true value lies within this of the trial's in 95 % of cases.
struct NumericalError {
  double position = 0.0;    // of the final shape, where it is largest                      [mm]
  double tip = 0.0;         // of the final tip                                             [mm]
  double peak_force = 0.0;  // of Metrics::peak_contact_force                               [N]
  double mean_force = 0.0;  // of Metrics::mean_contact_force                               [N]
  double tip_force = 0.0;   // of Metrics::peak_tip_force                                   [N]
  double push_force = 0.0;  // of Metrics::peak_push_force                                  [N]
  double support = 0.0;     // of ScriptMetrics::support                                    [N]
};

/// What is assumed of a trial that was not refined. Refining 15 plans in a bent tube at elements of
/// 1 mm found 0.02 to 0.62 mm, median 0.09, and forces within 4 %. It only decides ties, and is
/// never reported as an error.
inline constexpr double kAssumedPositionError = 0.2;        //                              [mm]
inline constexpr double kAssumedRelativeForceError = 0.05;  // of each force                [-]
NumericalError assumed_error(const Metrics& metrics);

/// Whether a component acts in a study with or without catheters.
inline bool acts(const ScorePart& part, bool of_script) { return of_script || !part.of_script; }

/// Weights of what acts, together.
double sum_of(const Weights& weights, bool of_script);

/// Expects positive limits, no negative weight, and one that acts.
Score compute_score(const Metrics& metrics, const simulate::Goal& goal, const Limits& limits,
                    const Weights& weights);

/// Largest change of the total score that the error allows, to first order. The components' changes
/// are added without regard to sign, since one cause may move all forces alike.
double compute_score_error(const Metrics& metrics, const NumericalError& error,
                           const simulate::Goal& goal, const Limits& limits,
                           const Weights& weights);

}  // namespace wireplan::plan
