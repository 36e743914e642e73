#pragma once
/// Symmetric block-pentadiagonal matrices: a wire is a chain, its Hessian couples a node with two
/// neighbours on each side. Cholesky in place, linear in the number of nodes, nothing allocated.
#include <Eigen/Core>
#include <cmath>
#include <vector>

namespace wireplan::simulate {

template <int D>
class BlockBand {
 public:
  using Block = Eigen::Matrix<double, D, D>;
  using Vector = Eigen::Matrix<double, D, 1>;

  /// n block rows of zeros. Memory only ever grows.
  void reset(int n) {
    size_ = n;
    if (static_cast<int>(rows_.size()) < n) rows_.resize(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) {
      Row& row = rows_[static_cast<std::size_t>(i)];
      row.own.setZero();
      row.one.setZero();
      row.two.setZero();
    }
  }
  int size() const { return size_; }

  Block& own(int i) { return rows_[static_cast<std::size_t>(i)].own; }  // (i, i)
  Block& one(int i) { return rows_[static_cast<std::size_t>(i)].one; }  // (i, i-1)
  Block& two(int i) { return rows_[static_cast<std::size_t>(i)].two; }  // (i, i-2)

  /// A = L L'. Only the lower triangle of own(i) is read. Returns false at the first pivot that is
  /// not positive: A is then not positive definite, and its contents are lost.
  bool factor() {
    for (int i = 0; i < size_; ++i) {
      Row& row = rows_[static_cast<std::size_t>(i)];
      if (i >= 2) solve_right(row.two, rows_[static_cast<std::size_t>(i - 2)].own);
      if (i >= 1) {
        const Row& above = rows_[static_cast<std::size_t>(i - 1)];
        if (i >= 2) row.one.noalias() -= row.two * above.one.transpose();
        solve_right(row.one, above.own);
        row.own.noalias() -= row.one * row.one.transpose();
        if (i >= 2) row.own.noalias() -= row.two * row.two.transpose();
      }
      if (!cholesky(row.own)) return false;
    }
    return true;
  }

  /// Solves A x = b after factor(); b, of size() * D values, becomes x.
  void solve(Eigen::Ref<Eigen::VectorXd> b) const {
    // The two unknowns before (or after) the one at hand stay in registers.
    Vector near = Vector::Zero(), far = Vector::Zero();
    double* x = b.data();
    for (int i = 0; i < size_; ++i, x += D) {
      const Row& row = rows_[static_cast<std::size_t>(i)];
      Vector v;
      for (int r = 0; r < D; ++r) {
        double sum = x[r];
        for (int c = 0; c < D; ++c) sum -= row.one(r, c) * near[c] + row.two(r, c) * far[c];
        for (int c = 0; c < r; ++c) sum -= row.own(r, c) * v[c];
        x[r] = v[r] = sum * row.own(r, r);  // holds 1 / L_rr
      }
      far = near;
      near = v;
    }
    near.setZero();
    far.setZero();
    const Row none{Block::Zero(), Block::Zero(), Block::Zero()};
    const Row *next = &none, *after = &none;
    for (int i = size_ - 1; i >= 0; --i) {
      x -= D;
      const Row& row = rows_[static_cast<std::size_t>(i)];
      Vector v;
      for (int r = D - 1; r >= 0; --r) {
        double sum = x[r];
        for (int c = 0; c < D; ++c) sum -= next->one(c, r) * near[c] + after->two(c, r) * far[c];
        for (int c = r + 1; c < D; ++c) sum -= row.own(c, r) * v[c];
        x[r] = v[r] = sum * row.own(r, r);
      }
      far = near;
      near = v;
      after = next;
      next = &row;
    }
  }

 private:
  struct Row {
    Block own, one, two;
  };

  /// Lower Cholesky factor in place, its diagonal inverted.
  static bool cholesky(Block& a) {
    for (int c = 0; c < D; ++c) {
      double pivot = a(c, c);
      for (int k = 0; k < c; ++k) pivot -= a(c, k) * a(c, k);
      if (!(pivot > 0.0)) return false;
      const double inverse = 1.0 / std::sqrt(pivot);
      a(c, c) = inverse;
      for (int r = c + 1; r < D; ++r) {
        double v = a(r, c);
        for (int k = 0; k < c; ++k) v -= a(r, k) * a(c, k);
        a(r, c) = v * inverse;
      }
    }
    return true;
  }

  /// b <- b L^-T, for the factor L made by cholesky().
  static void solve_right(Block& b, const Block& factor) {
    for (int c = 0; c < D; ++c) {
      for (int k = 0; k < c; ++k) b.col(c) -= factor(c, k) * b.col(k);
      b.col(c) *= factor(c, c);
    }
  }

  int size_ = 0;
  std::vector<Row> rows_;
};

}  // namespace wireplan::simulate
