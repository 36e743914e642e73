#pragma once
/// Where a point of the wire is in a vessel whose cross-sections have moved: the place at rest that
/// was carried to it, X + u(X) = p, u(X) = sum N_j(X) u_j (section_chain.h). All that contact knows
/// of a wall is of places at rest. A motion of the point and of the sections moves the place by
///   dX = G^-1 (dp - sum N_j du_j),  G = I + sum u_j N_j',
/// so a force g over dX is G^-T g on the wire and -N_j G^-T g on node j: no force is lost.
#include <vector>

#include "simulate/wall/section_chain.h"

namespace wireplan::simulate {

class MovingFrame {
 public:
  /// Finds the place for a point, by Newton's method from where it was.
  void find(const SectionChain& chain, const Eigen::Matrix3Xd& u, const Vec3& point);

  /// Whether a place was found yet; how far a point is from it, to first order [mm].
  bool is_known() const { return !known_.empty(); }
  Vec3 step_to(const Eigen::Matrix3Xd& u, const Vec3& point) const {
    return inverse_ * missing(u, point);
  }

  const Vec3& rest() const { return rest_; }        // X                                    [mm]
  const Mat3& inverse() const { return inverse_; }  // G^-1
  /// At X.
  const std::vector<SectionChain::Weight>& weights() const { return weights_; }

  /// Second derivatives of a function of X with the gradient `force` over p (G^-T g), beyond those
  /// of dX: the quadratic form -dX' B dX - 2 sum_j (force . du_j)(N_j' . dX). Finds B, of which a
  /// Hessian over X is to be less, and for each weight r_j = G^-T N_j'.
  void find_bend(const Eigen::Matrix3Xd& u, const Vec3& force, Mat3& B, std::vector<Vec3>& r) const;

 private:
  void look(const SectionChain& chain);
  void carry_weights();
  Vec3 missing(const Eigen::Matrix3Xd& u, const Vec3& point) const;
  void find_inverse(const Eigen::Matrix3Xd& u);

  Vec3 rest_ = Vec3::Zero();
  Mat3 inverse_ = Mat3::Identity();
  std::vector<SectionChain::Weight> weights_ = {};
  // Where the chain was asked last: near there weights are those of their Taylor series.
  Vec3 known_place_ = Vec3::Zero();  //                                                     [mm]
  std::vector<SectionChain::Weight> known_ = {};  // empty: nowhere yet
};

/// The places at rest (3, k) of points, on sections that have moved by u; the points themselves
/// where there is no chain [mm].
Eigen::Matrix3Xd places_at_rest(const SectionChain* chain, const Eigen::Matrix3Xd& u,
                                Eigen::Matrix3Xd points);

/// The same of a wire's last nodes alone, so many that they are `length` long at rest, or all [mm].
Eigen::Matrix3Xd end_at_rest(const SectionChain& chain, const Eigen::Matrix3Xd& u,
                             const Eigen::Ref<const Eigen::Matrix3Xd>& nodes, double length);

}  // namespace wireplan::simulate
