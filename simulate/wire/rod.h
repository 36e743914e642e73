#pragma once
/// The guidewire as a chain of straight edges: what it is (Wire, Rod) and where it is (RodState).
/// Symbols and equation numbers: the paper "FEM model for real-time guide wire simulation in
/// vasculature". Directors, twist and their derivatives: Bergou et al., "Discrete Viscous Threads",
/// SIGGRAPH 2010. Departures from both are named where they occur.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "preprocess/base.h"

namespace wireplan::simulate {

/// How EI runs along a section from the end toward the tip to the other.
enum class Taper {
  kLinear,  // EI is linear
  kCone,    // of a round core of one material whose diameter is linear: the fourth root of EI is
};

/// A stretch of wire with constant properties, but for a taper of EI.
struct Section {
  double length = 0.0;               //                                                   [mm]
  double bending_stiffness = 0.0;    // EI; of a strip: toward the material director      [N mm^2]
  double bending_stiffness_2 = 0.0;  // EI of a strip across it; 0: the same, a round wire [N mm^2]
  double axial_stiffness = 0.0;      // EA; 0: that of a solid round rod, 16 EI / d^2     [N]
  double twist_stiffness = 0.0;      // GJ; 0: that of a solid round rod, EI / 1.3        [N mm^2]
  double mass_per_length = 0.0;      //                                                   [t/mm]
  double rest_curvature = 0.0;       // of the unloaded wire toward the material director, 1/radius
                                     //                                                   [1/mm]
  double proximal_bending_stiffness = 0.0;  // EI at the end away from the tip, where a round wire
                                            // tapers; 0: the same                        [N mm^2]
  Taper taper = Taper::kLinear;

  bool round() const {
    return bending_stiffness_2 == 0.0 || bending_stiffness_2 == bending_stiffness;
  }
  bool tapered() const {
    return proximal_bending_stiffness > 0.0 && proximal_bending_stiffness != bending_stiffness;
  }
  /// EI at the section's end away from the tip [N mm^2].
  double proximal_EI() const { return tapered() ? proximal_bending_stiffness : bending_stiffness; }
  /// EI so far from the end toward the tip [N mm^2].
  double EI(double from) const;
  /// Integrals of 1/EI, 1/EA and 1/GJ over a part of the section, which begins `from` its end
  /// toward the tip [mm]: what springs in series give way. The radius is the wire's.
  double bend_compliance(double from, double part) const;                  // [1/(N mm)]
  double axial_compliance(double from, double part, double radius) const;  // [mm/N]
  double twist_compliance(double from, double part) const;                 // [1/(N mm)]
  /// EA as it acts; of a taper the mean that stretches as the whole section does [N].
  double ea(double radius) const { return length / axial_compliance(0.0, length, radius); }
};

/// A device: sections listed from the tip backwards.
struct Wire {
  std::string name;
  double radius = 0.0;  //                                                                [mm]
  std::vector<Section> sections;
  std::optional<double> friction = {};  // Coulomb's coefficient of its own; empty: the insertion's

  double length() const;
  bool straight() const;  // no section has a rest curvature
  bool round() const;     // no section is a strip: if it is straight too, its roll has no effect
};

/// What the discretised wire is: n nodes, n-1 edges, node 0 proximal, node n-1 the tip. Built once
/// per wire, shared read-only. Node quantities vanish where the node has no two edges.
struct Rod {
  Eigen::VectorXd rest_length;   // (n-1)  l                                              [mm]
  Eigen::VectorXd per_length;    // (n-1)  1/l: divisions are slow                      [1/mm]
  Eigen::VectorXd stretch;       // (n-1)  EA                                             [N]
  Eigen::VectorXd bend;          // (n)    EI over the node's share of length, of a strip the
                                 //        smaller one                                    [N mm]
  Eigen::VectorXd strip;         // (n)    EI across the material director minus EI toward it, over
                                 //        the same                                       [N mm]
  Eigen::VectorXd twist;         // (n)    GJ over the same, up to the wire's ends        [N mm]
  Eigen::VectorXd rest_angle;    // (n)    turning angle at rest                          [rad]
  Eigen::VectorXd share;         // (n)    length that the node stands for                [mm]
  Eigen::VectorXd mass;          // (n)                                                   [t]
  Eigen::VectorXd tip_distance;  // (n)    arc length from the tip                        [mm]
  double radius = 0.0;           //                                                       [mm]
  Eigen::VectorXd thinner;       // (n)    than `radius`, of several tools; empty: nowhere [mm]
  Eigen::VectorXd rubs;          // (n)    part of the coefficient of friction; empty: all  [-]
  // Half a bend element, over half of the first and of the last edge: a clamp needs it to be second
  // order (design 7).
  double proximal_bend = 0.0, distal_bend = 0.0;              // EI / (l/2)              [N mm]
  double proximal_strip = 0.0, distal_strip = 0.0;            // as `strip`               [N mm]
  double proximal_rest_angle = 0.0, distal_rest_angle = 0.0;  //                          [rad]
  bool twisted = false;  // has a rest angle or is a strip somewhere, so that twist matters

  int nodes() const { return static_cast<int>(share.size()); }
  double largest_bend() const;  // of a strip, the larger one of each node               [N mm]
};

/// The distal part of the wire in edges of the given lengths, proximal to distal. EI at a node
/// between two edges is that of springs in series; so are EA and GJ along an edge that spans
/// sections. `twisted` asks for twist even where the wire is straight. Expects at least 2 edges,
/// all longer than 0, together no longer than the wire.
Rod build_rod(const Wire& wire, const Eigen::VectorXd& edge_lengths, bool twisted = false);

/// The same in `elements` equal edges over `length`.
Rod build_rod(const Wire& wire, double length, int elements);

/// Where the wire is. One per trial, never shared.
struct RodState {
  Eigen::Matrix3Xd x;               // (3, n)  node positions                             [mm]
  Eigen::VectorXd theta;            // (n-1)   reference to material director, per edge; of
                                    //         several tools one after the other          [rad]
  Eigen::Matrix3Xd director;        // (3, n-1) reference director, normal to the edge    [-]
  Eigen::VectorXd reference_twist;  // (n)     of the reference directors, at nodes       [rad]
  double tip_angle = 0.0;  // of the last edge about a moment's axis, all turns counted [rad]
  Eigen::Matrix3Xd sections =
      {};  // (3, m)  how far the vessel's cross-sections have moved; empty where
           //         they do not (section_chain.h)                   [mm]
};

/// The wire straight from `point` along the unit `direction`, its material director turned by
/// `roll` from reference_normal(direction). A curved tip bends toward its material director.
RodState straight_state(const Rod& rod, const Vec3& point, const Vec3& direction, double roll);

/// The wire unloaded, in its rest shape: as straight_state, but from the end's tangent `direction`
/// on it turns toward the material director, by half of the first edge's rest angle before that
/// edge and by its rest angle at each node, all in one plane.
RodState rest_state(const Rod& rod, const Vec3& point, const Vec3& direction, double roll);

/// The direction that roll and azimuth count from: the patient's anterior (-y) made normal to the
/// axis; superior (+z) where the axis runs within 10 degrees of it. Unit.
Vec3 reference_normal(const Vec3& axis);

/// Turns a vector normal to unit `from` into one normal to unit `to`, without twist about it.
inline Vec3 parallel_transport(const Vec3& vector, const Vec3& from, const Vec3& to) {
  const double chi = 1.0 + from.dot(to);
  return vector - (vector.dot(to) / chi) * (from + to);  // vector is normal to `from`
}

/// Moves directors and reference twist along with nodes that moved from those of `base`; copies
/// theta. Called only for twisted rods. `first` and `last` bound the edges that moved. Of
/// `plain_edges` edges from `first_plain` on the directors follow those behind without twist and
/// are not written; reference twist of all their nodes is that of the node after them.
void transport_frames(const RodState& base, RodState& moved, int first_edge, int last_edge,
                      int first_plain = 0, int plain_edges = 0);

}  // namespace wireplan::simulate
