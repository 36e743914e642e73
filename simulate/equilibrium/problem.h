#pragma once
/// What is to be in equilibrium: a rod, what holds and loads it, and the wall that it touches.
#include <optional>
#include <string>
#include <vector>

#include "simulate/contact/wall_contact.h"
#include "simulate/wire/rod.h"
#include "simulate/wire/tool_stack.h"

namespace wireplan::simulate {

/// How an end of the rod is held. `tangent` (unit, proximal to distal) is imposed by half a bend
/// element, which is second order where freezing the first edge is first order (design 7).
struct EndSupport {
  bool hold_along = false;    // the node's motion along `axis`
  bool hold_across = false;   // its motion normal to `axis`
  bool hold_roll = false;     // theta of the end's edge
  Vec3 axis = Vec3::UnitX();  // unit
  std::optional<Vec3> tangent;
};

/// Projector on the motions that an end support leaves to its node.
Mat3 free_directions(const EndSupport& support);

/// A moment on the distal edge about a fixed axis: it does work on the angle of the edge, seen
/// along the axis. In a plane normal to the axis this is the dead moment of textbooks. Has no value
/// where the edge lies along the axis.
struct TipMoment {
  Vec3 axis = Vec3::UnitZ();  // unit
  double size = 0.0;          //                                                         [N mm]
};

/// Springs that hold free nodes near places.
struct Springs {
  Eigen::Matrix3Xd place;     // (3, n)                                                   [mm]
  Eigen::VectorXd stiffness;  // (n)                                                      [N/mm]
};

/// What is in equilibrium. Nodes first..last-1 are free, apart from what the end supports hold;
/// nodes before and after are where they are, and their edges' theta too. Terms that are absent
/// cost nothing.
struct Problem {
  const Rod* rod = nullptr;
  int first = 0, last = 0;
  EndSupport proximal, distal;             // of nodes 0 and n-1, where those are free
  const Eigen::Matrix3Xd* load = nullptr;  // (3, n) dead forces on the nodes                [N]
  const Springs* springs = nullptr;        // their energy counts as load's
  std::optional<TipMoment> tip_moment;
  std::optional<Vec3>
      plane;  // unit normal of a table on which the wire lies: every node is held to the
              // plane through node 0, by springs as stiff as the wire's stretch
  const ToolTerms* tools = nullptr;  // of which the rod is made; null: one wire
  WallContact* contact = nullptr;    // of this rod; the solver samples it at its own states

  int twists() const { return tools != nullptr ? tools->twists() : rod->twisted ? 1 : 0; }
};

/// The terms of energy that a scene has, by name: those of the rod, `own` of the scene, and, where
/// there is a vessel, those of contact.
std::vector<std::string> name_terms(const Rod& rod, const std::vector<std::string>& own,
                                    const VesselModel* vessel, double friction);

/// Energy by term [N mm].
struct Energy {
  double stretch = 0.0, bend = 0.0, twist = 0.0, load = 0.0, contact = 0.0, wall = 0.0;
  double total() const { return stretch + bend + twist + load + contact + wall; }
};

/// What holds the part of a rod that is not free, against the rod alone.
struct HeldEnd {
  Vec3 force = Vec3::Zero();  //                                                           [N]
  double torque = 0.0;        // about its edges, which turn as one                     [N mm]
};

}  // namespace wireplan::simulate
