#include "simulate/wire/wire_pass.h"

#include <algorithm>
#include <cmath>

namespace wireplan::simulate {

void WirePass::take(const Rod& rod, int first, int last, const Eigen::Matrix3Xd& x) {
  const int n = rod.nodes(), start = first - 2;
  size_ = last - first + 4;
  const std::size_t size = static_cast<std::size_t>(size_);
  if (per_length_.size() < size) {
    for (auto* arrays : {&x_, &edge_, &bend_, &gradient_}) {
      for (Array& array : *arrays) array.resize(size);
    }
    for (Array* array : {&per_length_, &k_, &tension_, &B_, &work_}) array->resize(size);
  }
  for (Array* array : {&x_[0], &x_[1], &x_[2], &per_length_, &k_, &B_, &work_}) {
    std::fill_n(array->begin(), size, 0.0);
  }
  const int low = std::max(0, -start), nodes = std::min(size_, n - start);
  const int edges = std::min(size_, n - 1 - start);
  for (int p = low; p < nodes; ++p) {
    const double* at = x.col(start + p).data();
    for (std::size_t c = 0; c < 3; ++c) x_[c][static_cast<std::size_t>(p)] = at[c];
  }
  const double *l = rod.rest_length.data() + start, *per = rod.per_length.data() + start;
  const double *EA = rod.stretch.data() + start, *bend = rod.bend.data() + start;
  double *per_length = per_length_.data(), *k = k_.data(), *B = B_.data(), *work = work_.data();
#pragma omp simd
  for (int p = low; p < edges; ++p) {
    per_length[p] = per[p];
    k[p] = 0.5 * EA[p] * per[p] * per[p] * per[p];  // k_s, paper Eq. (5)
    work[p] = l[p] * l[p];
  }
  // Neither end of the wire bends.
  for (int p = std::max(low, 1 - start); p < edges; ++p) B[p] = bend[p];
}

WirePass::Energy WirePass::find_forces(const Rod& rod, int first) {
  const int m = size_;
  const double *x = x_[0].data(), *y = x_[1].data(), *z = x_[2].data();
  double *ex = edge_[0].data(), *ey = edge_[1].data(), *ez = edge_[2].data();
  double *fx = bend_[0].data(), *fy = bend_[1].data(), *fz = bend_[2].data();
  double *gx = gradient_[0].data(), *gy = gradient_[1].data(), *gz = gradient_[2].data();
  const double *per = per_length_.data(), *k = k_.data();
  double *B = B_.data(), *t = tension_.data(), *work = work_.data();
  Energy energy;

  // 1. Edges: W = k/4 s^2, s = |e|^2 - l^2, paper Eq. (5). The energy is of those that touch a free
  // node, and summed in their order.
#pragma omp simd
  for (int q = 0; q < m - 1; ++q) {
    ex[q] = x[q + 1] - x[q];
    ey[q] = y[q + 1] - y[q];
    ez[q] = z[q + 1] - z[q];
    const double s = ex[q] * ex[q] + ey[q] * ey[q] + ez[q] * ez[q] - work[q];
    t[q] = k[q] * s;
    work[q] = t[q] * s;
  }
  for (int q = 1; q < m - 2; ++q) energy.stretch += 0.25 * work[q];

  // 2. Bends: W = B/2 |u|^2, see add_bend() for rest angles.
  for (int p = 1; rod.twisted && p < m - 1; ++p) {
    const int i = first - 2 + p;
    if (i < 1 || i > rod.nodes() - 2 || rod.rest_angle[i] == 0.0) continue;
    const double cosine = std::cos(rod.rest_angle[i]);
    energy.bend += B[p] * (1.0 - cosine);
    B[p] *= cosine;
  }
#pragma omp simd
  for (int p = 1; p < m - 1; ++p) {
    const double ux = per[p] * ex[p] - per[p - 1] * ex[p - 1];
    const double uy = per[p] * ey[p] - per[p - 1] * ey[p - 1];
    const double uz = per[p] * ez[p] - per[p - 1] * ez[p - 1];
    fx[p] = B[p] * ux;
    fy[p] = B[p] * uy;
    fz[p] = B[p] * uz;
    work[p] = fx[p] * ux + fy[p] * uy + fz[p] * uz;
  }
  for (int p = 1; p < m - 1; ++p) energy.bend += 0.5 * work[p];

    // 3. A free node is the end of the edge before it and the start of the one after.
#pragma omp simd
  for (int p = 2; p < m - 2; ++p) {
    const double a = per[p - 1], c = per[p], b = a + c, s = t[p - 1], r = t[p];
    gx[p] = s * ex[p - 1] - r * ex[p] + (a * fx[p - 1] - b * fx[p] + c * fx[p + 1]);
    gy[p] = s * ey[p - 1] - r * ey[p] + (a * fy[p - 1] - b * fy[p] + c * fy[p + 1]);
    gz[p] = s * ez[p - 1] - r * ez[p] + (a * fz[p - 1] - b * fz[p] + c * fz[p + 1]);
  }
  return energy;
}

}  // namespace wireplan::simulate
