#pragma once
/// What the wire feels of the wall in one state, and what its points remember between two.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "simulate/wall/lumen.h"

namespace wireplan::simulate {

/// A point of the wire that touches the wall.
struct Touch {
  int point = 0;                    // its place among all contact points of the wire
  int edge = 0;                     // between nodes edge and edge + 1 ...
  double part = 0.0;                // ... at this part of it, 0 to 1
  Vec3 position = Vec3::Zero();     // on the wire's axis                                    [mm]
  Vec3 rest = Vec3::Zero();         // the same in the vessel at rest                        [mm]
  Vec3 rest_normal = Vec3::Zero();  // and the normal there
  Vec3 normal = Vec3::Zero();       // of the wall, unit, into the lumen
  double normal_force = 0.0;        //                                                       [N]
  Vec3 friction = Vec3::Zero();     // of the wall on the wire                               [N]
  double penetration = 0.0;         // of the wire's surface past the yielded wall           [mm]
  double wall_displacement = 0.0;   // outward                                             [mm]
  double tip_distance = 0.0;        // along the wire                                      [mm]
  double share = 0.0;               // length of wire that it stands for                   [mm]
  double thinner = 0.0;             // there than the rod's radius, of several tools       [mm]
};

/// Energies of the contact [N mm].
struct ContactEnergy {
  double contact = 0.0;   // of the contact law
  double wall = 0.0;      // of the yielded wall
  double support = 0.0;   // of the support of sections that moved
  double friction = 0.0;  // potential whose slope is the lagged friction; not stored anywhere
  double total() const { return contact + wall + support + friction; }
};

/// A smaller gradient of the field than this has no direction: the point is beyond the field, or on
/// the axis of a lumen.
constexpr double kSmallestSlope = 1e-6;

/// A point near enough to the wall to matter.
struct ActivePoint {
  int point;           // its place among all
  Vec3 position;       // in the vessel at rest                                         [mm]
  WallSample wall;     // there
  double force = 0.0;  // normal, of the potential: times the gradient's norm in newtons
  double yield = 0.0;  // displacement of the wall                                        [mm]
};

/// The contact of one state of the wire.
struct ContactSample {
  std::vector<ActivePoint> active;  // proximal to distal
  ContactEnergy energy;             // with the lag as it was then
  /// Whether a point is so far outside that the field knows no wall there: it feels nothing.
  bool lost = false;
  /// Whether that lag is this very state's, and nothing of a state of before is in it.
  bool own_lag = false;
};

/// What the points remember from one equilibrium to the next.
struct ContactMemory {
  Eigen::Matrix3Xd x;                  // (3, n) the wire's nodes in that equilibrium         [mm]
  Eigen::Matrix3Xd sections;           // (3, s) and the sections' displacements, if any      [mm]
  Eigen::VectorXd normal_force;        // (m); 0: nothing holds the point                     [N]
  Eigen::Matrix3Xd anchor;             // (3, m) where friction holds those that have one, at
                                       // rest                                               [mm]
  std::vector<std::int32_t> triangle;  // (m) of its foot on a wall that yields; -1: none
};

}  // namespace wireplan::simulate
