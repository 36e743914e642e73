#pragma once
/// What is recorded of each step of an insertion, and the table that all who write, read, check or
/// scale records go by.
#include <array>
#include <cstddef>
#include <variant>

#include "preprocess/base.h"

namespace wireplan::simulate {

/// So much wire makes one contact: the force at a contact is the norm of the sum of the wall's
/// forces on it, where it is largest. A length of its own, so that the force does not hang on how
/// far contact points are apart; about that of a short lesion, chosen [mm].
inline constexpr double kContactLength = 5.0;

/// State after one step of a push, pull or turn, in equilibrium. Forces are those of the wall on
/// the wire.
struct Push {
  double insertion = 0.0;            // wire beyond the introducer's point               [mm]
  double hub_angle = 0.0;            // turned since the start                          [rad]
  double push_force = 0.0;           // axial force of the hand on the wire, its mean over a push
                                     // or pull; after a turn, less the ripple           [N]
  double hub_torque = 0.0;           // of the hand, about the introducer's direction  [N mm]
  Vec3 tip = Vec3::Zero();           //                                                  [mm]
  double tip_force = 0.0;            // norm of the contact force on the last 2 mm       [N]
  double peak_contact_force = 0.0;   // on the kContactLength of wire with the largest   [N]
  double total_contact_force = 0.0;  // sum of the normal forces of all points           [N]
  double friction_force = 0.0;       // sum of the friction forces of all points         [N]
  double max_penetration = 0.0;      // of the wire's surface past the (yielded) wall    [mm]
  double wall_displacement = 0.0;    // largest of the wall under a contact              [mm]
  Vec3 wall_displacement_point = Vec3::Zero();  // where                                 [mm]
  double peak_curvature = 0.0;                  //                                       [1/mm]
  double push_work = 0.0;      // of the hand since the start, its turning included ...  [N mm]
  double stored_energy = 0.0;  // ... of wire, contact and wall now ...                  [N mm]
  double friction_work = 0.0;  // ... and turned into heat since the start; what is left of the
                               // work was released in jumps [N mm]
  double unbalanced = 0.0;     // see PushBalance::unbalanced()                        [N mm]
  double residual = 0.0;       //                                                        [N]
  int iterations = 0;          // Newton iterations of this step
};

/// One of the record's numbers, points and counts.
struct PushField {
  const char* name;  // in files, with its unit
  std::variant<double Push::*, Vec3 Push::*, int Push::*> member;
  /// A force, torque, work or energy: of a wire and a wall that are f times as stiff it is f times
  /// as large.
  bool is_load = false;
};

/// All of them, in the order of files.
inline constexpr std::array kPushFields = {
    PushField{"hub_angle_rad", &Push::hub_angle},
    PushField{"hub_torque_n_mm", &Push::hub_torque, true},
    PushField{"insertion_mm", &Push::insertion},
    PushField{"push_force_n", &Push::push_force, true},
    PushField{"tip_force_n", &Push::tip_force, true},
    PushField{"peak_contact_force_n", &Push::peak_contact_force, true},
    PushField{"total_contact_force_n", &Push::total_contact_force, true},
    PushField{"friction_force_n", &Push::friction_force, true},
    PushField{"max_penetration_mm", &Push::max_penetration},
    PushField{"wall_displacement_mm", &Push::wall_displacement},
    PushField{"peak_curvature_per_mm", &Push::peak_curvature},
    PushField{"push_work_n_mm", &Push::push_work, true},
    PushField{"stored_energy_n_mm", &Push::stored_energy, true},
    PushField{"friction_work_n_mm", &Push::friction_work, true},
    PushField{"energy_unbalanced_n_mm", &Push::unbalanced, true},
    PushField{"residual_n", &Push::residual, true},
    PushField{"tip_mm", &Push::tip},
    PushField{"wall_displacement_point_mm", &Push::wall_displacement_point},
    PushField{"iterations", &Push::iterations},
};

constexpr std::size_t bytes_of_push_fields() {
  std::size_t bytes = 0;
  for (const PushField& field : kPushFields) {
    bytes += std::visit([]<class T>(T Push::*) { return sizeof(T); }, field.member);
  }
  return bytes;
}
static_assert(sizeof(Push) - bytes_of_push_fields() < alignof(Push),
              "a field of Push is not in the table");

}  // namespace wireplan::simulate
