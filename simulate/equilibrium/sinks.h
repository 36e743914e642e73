#pragma once
/// Where elements add their derivatives (elements.h says what they call).
#include <Eigen/Core>

#include "simulate/equilibrium/problem.h"
#include "simulate/wire/block_band.h"
#include "simulate/wire/moving_band.h"
#include "simulate/wire/rod.h"
#include "simulate/wire/wire_pass.h"

namespace wireplan::simulate {

/// Energy alone.
struct EnergySink {
  static constexpr bool kHessian = false;
  void gradient(int, const Vec3&) {}
  void gradient_theta(int, double, int = 0) {}
  void section_gradient(int, const Vec3&) {}
};

/// Sum of the gradient over the nodes and edges before `first`.
struct HeldSink {
  static constexpr bool kHessian = false;
  int first;
  HeldEnd sum = {};
  void gradient(int i, const Vec3& g) {
    if (i < first) sum.force += g;
  }
  void gradient_theta(int e, double g, int = 0) {
    if (e < first) sum.torque += g;
  }
  void section_gradient(int, const Vec3&) {}
};

/// Gradient with respect to every node of the wire; no Hessian.
struct GradientSink {
  static constexpr bool kHessian = false;
  Eigen::Ref<Eigen::Matrix3Xd> target;
  void gradient(int i, const Vec3& g) { target.col(i) += g; }
  void gradient_theta(int, double, int = 0) {}
  void section_gradient(int, const Vec3&) {}
};

/// Gradient and dense Hessian over all x, then all theta, tool by tool, then the sections.
struct DenseSink {
  static constexpr bool kHessian = true;
  int n;
  Eigen::VectorXd& g;
  Eigen::MatrixXd& H;
  int sections_from;

  int section(int j) const { return sections_from + 3 * j; }
  void section_gradient(int j, const Vec3& v) { g.segment<3>(section(j)) += v; }
  void section_cross(int i, int j, double scale, const Mat3& block) {
    H.block<3, 3>(3 * i, section(j)) += scale * block;
    H.block<3, 3>(section(j), 3 * i) += scale * block.transpose();
  }
  /// i >= j.
  void section_hessian(int i, int j, double scale, const Mat3& block) {
    H.block<3, 3>(section(i), section(j)) += scale * block;
    if (i != j) H.block<3, 3>(section(j), section(i)) += scale * block.transpose();
  }

  void gradient(int i, const Vec3& v) { g.segment<3>(3 * i) += v; }
  int theta(int e, int tool) const { return 3 * n + tool * (n - 1) + e; }
  void gradient_theta(int e, double v, int tool = 0) { g[theta(e, tool)] += v; }
  void hessian(int i, int j, const Mat3& block) {
    H.block<3, 3>(3 * i, 3 * j) += block;
    if (i != j) H.block<3, 3>(3 * j, 3 * i) += block.transpose();
  }
  void hessian_scaled(int i, int j, double scale, const Mat3& block) {
    hessian(i, j, scale * block);
  }
  void hessian_of_edge(int i, const Mat3& block) {
    hessian(i, i, block);
    hessian(i + 1, i + 1, block);
    hessian(i + 1, i, -block);
  }
  void hessian_scaled_identity(int i, int j, double v) { hessian(i, j, v * Mat3::Identity()); }
  void hessian_theta(int e, int i, const Vec3& v, int tool = 0) {
    H.block<3, 1>(3 * i, theta(e, tool)) += v;
    H.block<1, 3>(theta(e, tool), 3 * i) += v.transpose();
  }
  void hessian_theta_theta(int e, int f, double v, int tool = 0, int other = 0) {
    const int row = theta(e, tool), column = theta(f, other);
    H(row, column) += v;
    if (row != column) H(column, row) += v;
  }
};

/// Gradient of the free nodes: block k holds x of node first + k and, for D > 3, theta of its edge,
/// one for each of D - 3 tools. Sections follow, 3 each.
template <int D>
struct FreeSink {
  static constexpr bool kHessian = false;
  int first, last;
  WirePass& pass;
  Eigen::VectorXd& g;

  bool is_free(int i) const { return i >= first && i < last; }
  void add_to(Eigen::VectorXd& vector, int i, const Vec3& v) {
    if (is_free(i)) vector.template segment<3>(D * (i - first)) += v;
  }
  void gradient(int i, const Vec3& v) { add_to(g, i, v); }
  void gradient_theta(int e, double v, int tool = 0) {
    if (D > 3 && is_free(e)) g[D * (e - first) + 3 + tool] += v;
  }
  void section_gradient(int j, const Vec3& v) {
    g.template segment<3>(D * (last - first) + 3 * j) += v;
  }
  WirePass::Energy add_wire(const Rod& rod, const RodState& state) {
    return pass.add_gradient<D>(rod, first, last, state.x, g);
  }
};

/// And their banded Hessian, with what couples with sections.
template <int D>
struct BandSink : FreeSink<D> {
  static constexpr bool kHessian = true;
  using FreeSink<D>::first;
  using FreeSink<D>::is_free;
  BlockBand<D>& H;
  SectionBlocks& sections;

  void section_cross(int i, int j, double scale, const Mat3& v) {
    if (!is_free(i)) return;
    Mat3& target = sections.cross(i - first, j);
    for (int k = 0; k < 9; ++k) target.data()[k] += scale * v.data()[k];
  }
  /// i >= j.
  void section_hessian(int i, int j, double scale, const Mat3& v) {
    Mat3& target = sections.pair(i, j);
    for (int k = 0; k < 9; ++k) target.data()[k] += scale * v.data()[k];
  }

  WirePass::Energy add_wire(const Rod& rod, const RodState& state) {
    const WirePass::Energy energy = FreeSink<D>::add_wire(rod, state);
    this->pass.set_hessian(H);
    return energy;
  }
  typename BlockBand<D>::Block& block(int i, int j) {  // i >= j
    return i == j ? H.own(i - first) : i == j + 1 ? H.one(i - first) : H.two(i - first);
  }
  void hessian(int i, int j, const Mat3& v) { hessian_scaled(i, j, 1.0, v); }
  void hessian_scaled(int i, int j, double scale, const Mat3& v) {
    if (!is_free(i) || !is_free(j)) return;
    auto& target = block(i, j);
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) target(r, c) += scale * v(r, c);
    }
  }
  void hessian_of_edge(int i, const Mat3& v) {
    if (!is_free(i) || !is_free(i + 1)) {
      hessian(i, i, v);
      hessian(i + 1, i + 1, v);
      return;
    }
    auto& own = H.own(i - first);
    auto& next = H.own(i + 1 - first);
    auto& one = H.one(i + 1 - first);
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) {
        own(r, c) += v(r, c);
        next(r, c) += v(r, c);
        one(r, c) -= v(r, c);
      }
    }
  }
  void hessian_scaled_identity(int i, int j, double v) {
    if (is_free(i) && is_free(j))
      block(i, j).template topLeftCorner<3, 3>().diagonal().array() += v;
  }
  void hessian_theta(int e, int i, const Vec3& v, int tool = 0) {
    if constexpr (D > 3) {
      if (!is_free(e) || !is_free(i)) return;
      if (e >= i) {
        block(e, i).template block<1, 3>(3 + tool, 0) += v.transpose();
      }
      if (i >= e) {
        block(i, e).template block<3, 1>(0, 3 + tool) += v;
      }
    }
  }
  /// e >= f.
  void hessian_theta_theta(int e, int f, double v, int tool = 0, int other = 0) {
    if constexpr (D > 3) {
      if (!is_free(e) || !is_free(f)) return;
      block(e, f)(3 + tool, 3 + other) += v;
      if (e == f && tool != other) block(e, f)(3 + other, 3 + tool) += v;
    }
  }
};

}  // namespace wireplan::simulate
