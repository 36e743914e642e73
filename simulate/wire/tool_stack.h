#pragma once
/// Tools in one another, as a wire in a catheter in a sheath: where they overlap they share one
/// centreline. Their stiffnesses add, and the natural curvature of each acts turned by its own
/// angle of twist. From a rod for the straight parts, and what the curved ones add to it.
///
/// Of a node at arc length s_j, w_j is the hat function: 1 there and 0 from the next nodes on. With
/// K the sum of the tools' EI and kappa_i the natural curvature of tool i along its director m_i,
/// both at their places under the hat, the bend of the node by a turn phi costs least as
///   B |phi - sum r_i m_i|^2 / 2 + sum over pairs P_ik cos(psi_i - psi_k) + what does not change,
///   B = 1 / int w/K,  r_i = int w EI_i kappa_i / K,  P_ik = -int w EI_i EI_k kappa_i kappa_k / K.
/// So energies and, since the hats add up to 1 and have no jumps, forces are continuous as the end
/// of a tool passes a node.
#include <array>
#include <vector>

#include "simulate/wire/rod.h"

namespace wireplan::simulate {

struct Tool {
  Wire wire;                  // of the outer radius; no strips
  double inner_radius = 0.0;  // of its lumen; 0: it has none                             [mm]
};

/// How the hand holds a tool: its tip so far along the centreline, its hub turned so far about the
/// introducer's direction. Behind the introducer it runs straight to its hub.
struct ToolPlace {
  double insertion = 0.0;  //                                                             [mm]
  double roll = 0.0;       // as RodState::theta counts                                   [rad]
};

constexpr int kMostTools = 3;

/// A tool at one place of it; past its tip what its tip has.
struct ToolSpot {
  bool there = false;         // not past its tip
  double EI = 0.0, GJ = 0.0;  //                                                       [N mm^2]
  double curvature = 0.0;     //                                                         [1/mm]
};
/// `from_tip`: arc length; below 0 past the tip [mm].
ToolSpot look_at(const Wire& wire, double from_tip);

/// What the twists of curved tools add to a Rod, at its nodes. Straight tools have none.
struct ToolTerms {
  std::vector<int> tool;   // (T) index of each twisted tool in the stack, from the outside in
  Eigen::MatrixXd rest;    // (T, n) r_i; at an end of what its half hat covers          [rad]
  Eigen::MatrixXd mutual;  // (pairs, n) P_ik                                           [N mm]
  Eigen::MatrixXd twist;   // (T, n) GJ of each tool over the node's share, up to the ends; past
                           // its tip that of its tip, which carries no torque           [N mm]
  Eigen::VectorXd lead;    // (T) of the part that is still straight in the introducer   [N mm]
  Eigen::VectorXd roll;    // (T) of the hubs                                           [rad]
  double stored = 0.0;     // energy that no shape changes                              [N mm]

  int twists() const { return static_cast<int>(tool.size()); }
  /// Whether no tool has a curve at the node.
  bool is_straight(int node) const {
    return (rest.col(node).array() == 0.0).all() && (mutual.col(node).array() == 0.0).all();
  }
  /// Row of `mutual` of twisted tools i < k.
  static int pair(int i, int k) { return i + k - 1; }
};

/// Tools at their places: the rod that they make together, and what their curves add.
struct Composite {
  Rod rod;
  ToolTerms terms;
  Eigen::MatrixXd outside;   // (tools, n) the part of a node's share where a tool is the outermost
  Eigen::VectorXd axial;     // (n) integrals of w/EA, and ...                          [mm/N]
  std::vector<double> ends;  // ... places of ends of sections: scratch                   [mm]

  double edge_length() const { return rod.rest_length[0]; }  //                           [mm]
};

/// In `elements` equal edges along the longest of the insertions, so that energies have no kink
/// there either. From the outside in, no more than kMostTools. Expects at least 2 elements,
/// insertions from 0 to the tools' lengths, one of them above 0, and no strips.
Composite build_composite(const std::vector<Tool>& tools, const std::vector<ToolPlace>& places,
                          int elements);
/// The same in memory that is reused.
void build_composite(const std::vector<Tool>& tools, const std::vector<ToolPlace>& places,
                     int elements, Composite& composite);

}  // namespace wireplan::simulate
