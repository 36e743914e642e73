#pragma once
/// Stretch and bend of a whole wire at once: what add_stretch() and add_bend() of elements.h sum
/// element by element, for the derivatives that most of a solve's time goes into. Each coordinate
/// lies in an array of its own, so that two nodes go through a register together.
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "simulate/wire/block_band.h"
#include "simulate/wire/rod.h"

namespace wireplan::simulate {

/// Reuses its memory from pass to pass.
class WirePass {
 public:
  struct Energy {
    double stretch = 0.0, bend = 0.0;  //                                              [N mm]
  };
  /// Of all elements that touch one of the nodes first..last-1 at x (3, n): their energy. Adds its
  /// derivatives with respect to these nodes to `gradient`, D numbers per node.
  template <int D>
  Energy add_gradient(const Rod& rod, int first, int last, const Eigen::Matrix3Xd& x,
                      Eigen::VectorXd& gradient);
  /// Writes the second derivatives of the energy of the last add_gradient() into the leading 3x3 of
  /// the blocks.
  template <int D>
  void set_hessian(BlockBand<D>& hessian) const;

 private:
  // Node p of the arrays is node first - 2 + p: what acts on a node are the edges p-2 to p+1 and
  // the bends p-1 to p+1, edge p from node p to p+1. What the wire has not is 0.
  using Array = std::vector<double>;
  int size_ = 0;
  std::array<Array, 3> x_, edge_, bend_, gradient_;  // bend: B u of add_bend()
  Array per_length_, k_, tension_, B_, work_;        // k: k_s; tension: k_s (|e|^2 - l^2)

  void take(const Rod& rod, int first, int last, const Eigen::Matrix3Xd& x);
  Energy find_forces(const Rod& rod, int first);
};

template <int D>
WirePass::Energy WirePass::add_gradient(const Rod& rod, int first, int last,
                                        const Eigen::Matrix3Xd& x, Eigen::VectorXd& gradient) {
  take(rod, first, last, x);
  const Energy energy = find_forces(rod, first);
  double* g = gradient.data();
  for (std::size_t p = 2; p < static_cast<std::size_t>(size_) - 2; ++p, g += D) {
    for (std::size_t c = 0; c < 3; ++c) g[c] += gradient_[c][p];
  }
  return energy;
}

template <int D>
void WirePass::set_hessian(BlockBand<D>& hessian) const {
  const double *ex = edge_[0].data(), *ey = edge_[1].data(), *ez = edge_[2].data();
  const double *per = per_length_.data(), *t = tension_.data(), *B = B_.data();
  // A symmetric matrix by its entries xx, yy, zz, yx, zx, zy; that of an edge is 2 k e e'.
  using Entries = std::array<double, 6>;
  const auto product = [&](int q) -> Entries {
    const double s = 2.0 * k_[static_cast<std::size_t>(q)];
    const double x = s * ex[q], y = s * ey[q], z = s * ez[q];
    return {x * ex[q], y * ey[q], z * ez[q], y * ex[q], z * ex[q], z * ey[q]};
  };
  const auto write = [](double sign, const Entries& e, double diagonal, auto& block) {
    block(0, 0) = sign * e[0] + diagonal;
    block(1, 1) = sign * e[1] + diagonal;
    block(2, 2) = sign * e[2] + diagonal;
    block(1, 0) = block(0, 1) = sign * e[3];
    block(2, 0) = block(0, 2) = sign * e[4];
    block(2, 1) = block(1, 2) = sign * e[5];
  };
  Entries before = product(1);
  for (int p = 2; p < size_ - 2; ++p) {
    const Entries after = product(p);
    Entries both;
    for (std::size_t k = 0; k < 6; ++k) both[k] = before[k] + after[k];
    const double a = per[p - 1], c = per[p], b = a + c, far = per[p - 2];
    write(1.0, both, t[p - 1] + t[p] + B[p - 1] * (a * a) + B[p] * (b * b) + B[p + 1] * (c * c),
          hessian.own(p - 2));
    write(-1.0, before, -(t[p - 1] + B[p - 1] * a * (far + a) + B[p] * b * a), hessian.one(p - 2));
    write(1.0, {}, B[p - 1] * a * far, hessian.two(p - 2));
    before = after;
  }
}

}  // namespace wireplan::simulate
