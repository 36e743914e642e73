#pragma once
/// One insertion of one wire into one vessel: run_trial(wire, insertion, goal, vessel,
/// options) -> TrialResult. Serial and deterministic; shares the vessel read-only with other
/// trials.
#include <string>
#include <vector>

#include "simulate/rod.h"
#include "simulate/vessel_model.h"
#include "simulate/wall_contact.h"

namespace wireplan::simulate {

/// How finely and how far to push; the same for all trials of a study.
struct InsertionOptions {
  double length = 250.0;        // most wire to bring into the body                      [mm]
  double step = 1.0;            // of one push                                           [mm]
  double element_length = 1.0;  //                                                       [mm]
  /// If not empty: of each section of the wire, tip first, shortened so that whole elements fill
  /// it; 0: element_length [mm].
  std::vector<double> section_element_length = {};
  double contact_spacing = 1.0;      // most between two contact points along the wire   [mm]
  double friction = 0.0;             // Coulomb's coefficient
  double residual_tolerance = 1e-6;  // largest nodal force out of balance               [N]
  int max_iterations = 200;          // Newton iterations per push
  double record_every = 5.0;         // spacing of the stored shapes                     [mm]
};

/// The introducer: wire slides along its axis and is free beyond its point.
struct Introducer {
  Vec3 point = Vec3::Zero();       // where the wire becomes free, inside the lumen      [mm]
  Vec3 direction = Vec3::UnitZ();  // unit, into the vessel
  double roll = 0.0;               // of the hub, right-handed about the direction     [rad]
};

struct Goal {
  Vec3 point = Vec3::Zero();  //                                                  [mm]
  double radius = 4.0;        // the tip within this distance has reached it      [mm]
};

enum class Outcome {
  kReached,       // the tip came within the goal's radius; ends where it was nearest
  kMissed,        // all wire was pushed in, the goal not reached
  kStuck,         // pushing no longer advances the tip
  kProlapsed,     // the wire folded back on itself instead of advancing its tip
  kLeftOpening,   // the tip left the vessel through an inlet or outlet
  kLeftLumen,     // the wire went further through the wall than contact explains
  kNotConverged,  // a push had no equilibrium to the tolerance, also when cut smaller
  kFailed,        // our fault; the reason holds the message
};
const char* outcome_name(Outcome outcome);  // "reached", "missed", "stuck", ...

/// State after one push, in equilibrium. Forces are those of the wall on the wire. A contact is
/// a maximal run of neighbouring contact points that touch; its force is the norm of their sum.
struct Push {
  double insertion = 0.0;            // wire beyond the introducer's point               [mm]
  double push_force = 0.0;           // axial force of the hand on the wire              [N]
  Vec3 tip = Vec3::Zero();           //                                                  [mm]
  double tip_force = 0.0;            // norm of the contact force on the last 2 mm       [N]
  double peak_contact_force = 0.0;   // of the largest contact                           [N]
  double total_contact_force = 0.0;  // sum of the normal forces of all points           [N]
  double friction_force = 0.0;       // sum of the friction forces of all points         [N]
  double max_penetration = 0.0;      // of the wire's surface past the (yielded) wall    [mm]
  double wall_displacement = 0.0;    // largest of the wall under a contact              [mm]
  Vec3 wall_displacement_point = Vec3::Zero();  // where                                 [mm]
  double peak_curvature = 0.0;                  //                                       [1/mm]
  double push_work = 0.0;      // of the hand since the start ...                        [N mm]
  double stored_energy = 0.0;  // ... of wire, contact and wall now ...                  [N mm]
  double friction_work = 0.0;  // ... and turned into heat since the start; what is left of the
                               // work was released in jumps [N mm]
  double residual = 0.0;       //                                                        [N]
  int iterations = 0;          // Newton iterations of this push
};

/// Where the wire touches the wall in the final shape.
struct WireContact {
  int node = 0;                        // column of TrialResult::nodes, and how far ...
  double part = 0.0;                   // ... from there to the next node, 0 to below 1
  int triangle = -1;                   // of the surface; -1: none found there
  Vec3 point = Vec3::Zero();           // on the wire's surface toward the wall          [mm]
  Vec3 normal_force = Vec3::Zero();    // of the wall on the wire                        [N]
  Vec3 friction_force = Vec3::Zero();  // of the wall on the wire, along the wall        [N]
  double penetration = 0.0;            //                                                [mm]
  double wall_displacement = 0.0;      // outward                                        [mm]
};

/// The same, with the triangle that the point is on; nodes counted from the rod's proximal end.
WireContact contact_of(const Touch& touch, double wire_radius, const TriangleLocator& locator);

/// Largest normal force that a triangle of the surface took at any time.
struct TriangleForce {
  int triangle = 0;
  double force = 0.0;  //                                                                 [N]
};

/// A shape on the way, for pictures and time series.
struct Shape {
  double insertion = 0.0;         //                                                  [mm]
  Eigen::Matrix3Xd nodes;         // (3, k) beyond the introducer, proximal to distal [mm]
  Eigen::VectorXd contact_force;  // (k) norm per node                                [N]
};

struct TrialResult {
  Outcome outcome = Outcome::kFailed;
  std::string reason;        // one sentence; with the place in mm where it failed
  std::vector<Push> pushes;  // in order of insertion
  Eigen::Matrix3Xd nodes;    // (3, k) final shape beyond the introducer, proximal to distal
  std::vector<WireContact> contacts;       // of the final shape
  std::vector<TriangleForce> peak_forces;  // over all pushes, ascending triangles
  std::vector<Shape> shapes;               // every `record_every`, and the final one
  std::vector<std::string> terms;  // energy terms that the scene built: "stretch", "bend", ...
};

/// Pushes the wire in along the introducer until the tip reaches the goal, all wire is in, or a
/// named failure. Never throws for what the physics does. Expects a unit direction and positive
/// lengths.
TrialResult run_trial(const Wire& wire, const Introducer& introducer, const Goal& goal,
                      const VesselModel& vessel, const InsertionOptions& options);

}  // namespace wireplan::simulate
