#pragma once
/// The vessel as a chain of cross-sections that move as wholes on a soft support: nodes along the
/// tree of its middle lines, each with a displacement u. The lumen at a place X of the vessel at
/// rest is carried to X + u(X), with u(X) the mean of nearby nodes' displacements by smooth
/// weights. References M: "moving cross-sections". The energy is quadratic,
///   integral along the lines of K |u|^2/2 + EA (t . u')^2/2 + EI |u'' - t (t . u'')|^2/2,
/// K = pi R k_s the support, EA = 2 pi R h E and EI = pi R^3 h E those of the artery's wall; it has
/// no layers and no prestress. Support and stretch are found with the same weights (Galerkin), so
/// that smooth displacements have the energy of the continuum whatever the spacing; bending by
/// differences between nodes, of second order in it.
#include <Eigen/Core>
#include <vector>

#include "preprocess/centerline/centerline.h"

namespace wireplan::simulate {

/// A place where anatomy holds the vessel: within `radius` the support is `factor` times as stiff,
/// and falls to what it is elsewhere over as much again. Of several the stiffest counts.
struct Pin {
  Vec3 place = Vec3::Zero();  //                                                          [mm]
  double radius = 10.0;       //                                                          [mm]
  double factor = 100.0;
};

struct SectionChainOptions {
  double support = 1e-3;       // k_s: force per area that the vessel covers, per displacement
                               // [N/mm^3], 1e-3 = 1 kPa/mm
  double young_modulus = 0.0;  // of the wall, along the vessel; 0: sections do not feel each other
                               // [MPa]
  double thickness = 1.0;      // of the wall                                            [mm]
  double spacing = 8.0;        // most between two nodes along a line, 5 to 10            [mm]
  std::vector<Pin> pins = {};
};

class SectionChain {
 public:
  /// Weight of a node at a place at rest, with its derivatives over that place.
  struct Weight {
    int node;
    double value;
    Vec3 slope;  // [1/mm]
    Mat3 bend;   // [1/mm^2]; 0 where not asked for
  };

  /// Expects a tree of at least one line, parents before their branches, and positive options.
  SectionChain(const std::vector<preprocess::Branch>& tree, const SectionChainOptions& options);

  int nodes() const { return static_cast<int>(places_.cols()); }
  const Eigen::Matrix3Xd& places() const { return places_; }  // at rest                  [mm]

  /// The nodes that carry a place at rest, with weights of sum 1, twice differentiable over the
  /// place: the normalised bell curves round the nodes, without those whose part is next to
  /// nothing.
  void find_weights(const Vec3& rest, bool with_bend, std::vector<Weight>& weights) const;

  /// u of a place at rest [mm], for displacements (3, nodes).
  Vec3 displacement(const Vec3& rest, const Eigen::Matrix3Xd& u) const;

  /// Places at rest (3, k) as the vessel carries them [mm].
  Eigen::Matrix3Xd carried(const Eigen::Matrix3Xd& rest, const Eigen::Matrix3Xd& u) const;

  /// Energy [N mm] and, added to `gradient` (3, nodes), its derivatives [N].
  double energy(const Eigen::Matrix3Xd& u, Eigen::Ref<Eigen::Matrix3Xd> gradient) const;

  /// The energy's Hessian: blocks of nodes j <= i, the others are 0 [N/mm].
  struct Block {
    int i, j;
    Mat3 value;
  };
  const std::vector<Block>& stiffness() const { return stiffness_; }

 private:
  struct Knot {
    double arc;  // on its line                                                            [mm]
    int node;
  };
  std::vector<std::vector<Knot>> place_nodes(const std::vector<preprocess::Branch>& tree,
                                             double spacing);
  void build_cells();
  void add_line(const Centerline& line, double inside, const SectionChainOptions& options,
                std::vector<Block>& dense) const;
  void add_bending(const Centerline& line, const std::vector<Knot>& knots,
                   const SectionChainOptions& options, std::vector<Block>& dense) const;
  void add_square(const Eigen::VectorXd& row, double stiffness, const Mat3& direction,
                  std::vector<Block>& dense) const;
  const std::vector<int>& candidates(const Vec3& rest) const;

  Eigen::Matrix3Xd places_;
  double width_ = 0.0;  // of the bell curves: their standard deviation                     [mm]
  std::vector<Block> stiffness_;

  // Nodes that may have a part of a place, by cells of a grid round the nodes; all beyond it.
  Vec3 origin_ = Vec3::Zero();
  Eigen::Vector3i cells_ = Eigen::Vector3i::Zero();
  std::vector<std::vector<int>> near_;
  std::vector<int> all_;
};

}  // namespace wireplan::simulate
