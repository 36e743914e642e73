#pragma once
/// The laboratory bench: one wire, its supports and loads, and its equilibrium (design section 5).
/// A scene with an insertion into a vessel is a trial (trial.h).
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "simulate/contact/wall_contact.h"
#include "simulate/equilibrium/solver.h"
#include "simulate/insertion/self_crossing.h"

namespace wireplan::simulate {

enum class WireEnd { kProximal, kDistal };

enum class SupportKind {
  kClamped,  // position and direction held
  kPinned,   // position held
  kGuided,   // direction held and sideways position, free along the direction
};

struct Support {
  WireEnd at = WireEnd::kProximal;
  SupportKind kind = SupportKind::kClamped;
  Vec3 point = Vec3::Zero();       //                                                   [mm]
  Vec3 direction = Vec3::UnitX();  // unit tangent, proximal to distal
  double roll = 0.0;               // of a clamped or guided end, see Scene               [rad]
};

struct Loads {
  Vec3 gravity = Vec3::Zero();     //                                                   [mm/s^2]
  Vec3 tip_force = Vec3::Zero();   // dead load on the distal node                      [N]
  Vec3 tip_moment = Vec3::Zero();  // axis times size, see TipMoment                    [N mm]
  double tip_torque = 0.0;         // about the wire's own axis; decoupled twist only   [N mm]
};

/// The residual that an equilibrium under nodal loads (3, n) [N] may have: as asked, but no more
/// than a thousandth of the largest load, so that none is taken for out of balance and left out.
double residual_under(const Eigen::Matrix3Xd& load, double asked);

/// Whether saddles may be left for what lies lower: out of a plane a moment about a fixed axis
/// spins an edge that leans toward the axis, without end.
bool may_leave_saddles(const Loads& loads, const std::optional<Vec3>& plane);

/// Whether they hold the rolls of both ends, and whether these differ, which twists even a straight
/// wire in a plane.
bool hold_both_rolls(const std::vector<Support>& supports);
bool twists_the_wire(const std::vector<Support>& supports);

/// How the wire's twist is found.
enum class Twist {
  kAuto,       // coupled where the wire is curved at rest or a strip, or where the rolls of two
               // ends are held and differ or, with Newton, no table holds the wire in a plane, out
               // of which it would twist; else not at all
  kCoupled,    // with the shape, by material directors
  kDecoupled,  // beside the shape, which it leaves as it is: paper Eq. (14)-(15)
};

enum class Method { kNewton, kConjugateGradient, kExplicitEuler, kSemiImplicitEuler };

struct SolverOptions {
  Method method = Method::kNewton;
  double residual_tolerance = 1e-6;  // largest nodal force out of balance                [N]
  int max_iterations = 200;          // Newton: per load step
  int load_steps = 1;                // Newton: loads grow in equal steps from 0; see Scene
  double time_step = 1e-3;           // the others: see MotionOptions                     [s]
  double duration = 1.0;             //                                                   [s]
  double damping = 0.0;              // Euler schemes                                     [1/s]
};

/// The wire starts in its rest shape, straight from the proximal support unless it is curved. A
/// distal support then moves and turns its end to where it is held: in the steps in which the loads
/// grow, or before the first time step. With Newton, no vessel, and a place far from where the
/// unloaded wire ends, it goes there on an EndPath, in at least as many steps, which get shorter by
/// themselves.
///
/// The roll of a distal support counts from the director that came there with the wire, carried
/// along its edges without twist, on an EndPath turned with the end; the roll of the proximal one
/// turns the whole wire at the start. Two whole turns and more may come off a bent wire: it then
/// passes round its end, and is left with two turns less in the same place.
struct Scene {
  Wire wire;
  int elements = 20;                   // of equal length along the wire, and
  std::vector<double> element_length;  // if not empty: as asked for in each section, shortened so
                                       // that whole elements fill it; 0: as `elements` gives [mm]
  Twist twist = Twist::kAuto;
  std::vector<Support> supports;
  Loads loads;
  std::optional<Vec3> plane;            // unit normal of a table, see Problem
  const VesselModel* vessel = nullptr;  // Newton only; null: none
  ContactOptions contact;               // with the vessel
  SolverOptions solver;
};

/// Length of the edges in a section, and of all edges, proximal to distal [mm].
double edge_length(const Scene& scene, std::size_t section);
Eigen::VectorXd edge_lengths(const Scene& scene);

enum class SceneOutcome {
  kConverged,
  kNotConverged,
  kUnstable,  // a time step method blew up
};
const char* outcome_name(SceneOutcome outcome);  // "converged", "not_converged", "unstable"

struct Reaction {
  WireEnd at = WireEnd::kProximal;
  Vec3 force = Vec3::Zero();   // of the support on the wire                        [N]
  Vec3 moment = Vec3::Zero();  // about the support's point, torque of a held roll included [N mm]
};

struct SceneResult {
  SceneOutcome outcome = SceneOutcome::kNotConverged;
  std::string reason;              // why it did not converge, or turns that it lost; else empty
  std::vector<std::string> terms;  // energy terms that were built
  Eigen::Matrix3Xd nodes;          // (3, n) proximal to distal                         [mm]
  Energy energy;
  double gravity_energy = 0.0;  // the parts of energy.load that are gravity ...      [N mm]
  double moment_energy = 0.0;   // ... and tip moment and torque                      [N mm]
  Eigen::VectorXd twist;  // (n) angle between a node's edges about the wire; empty unless built
                          //                                                         [rad]
  Eigen::VectorXd roll;   // (n) sum of the twist up to a node, hub's roll included: paper Eq.
                          // (15); decoupled twist only                               [rad]
  double residual = 0.0;  //                                                         [N]
  int iterations = 0;
  int steps = 0;                   // load steps or time steps
  double time = 0.0;               // simulated; 0 for Newton                         [s]
  double worst_energy_rise = 0.0;  // over one iteration or time step                 [N mm]
  double critical_time_step = std::numeric_limits<double>::infinity();  // see dynamics.h [s]
  double cpu_time_s = 0.0;                                              // of the solver alone
  std::vector<Reaction> reactions;
  std::vector<Touch> contacts;  // with the vessel, proximal to distal
  double friction_work = 0.0;   // turned into heat, Newton's load steps together      [N mm]
  std::optional<SelfCrossing> crossing;  // of a shape that converged
};

/// Static equilibrium on the paper's energy. Expects supports that hold the wire against rigid
/// motion; methods other than Newton's and the decoupled twist expect a wire that is straight at
/// rest, the former also no coupled twist, rolls of two held ends that differ, tip moment or table,
/// and one load step; the Euler schemes a mass.
SceneResult run_scene(const Scene& scene);

}  // namespace wireplan::simulate
