#pragma once
/// Symmetric block-pentadiagonal matrices: a wire is a chain, its Hessian couples a node with two
/// neighbours on each side. Factored linearly in the number of nodes, nothing allocated.
/// Block rows at either end may lack their last unknown: those of the parts of a wire whose twist
/// is no unknown (twist_chain.h).
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace wireplan::simulate {

template <int D>
class BlockBand {
 public:
  using Block = Eigen::Matrix<double, D, D>;
  static constexpr int kNoRow = std::numeric_limits<int>::max();

  /// n block rows of zeros, of which the first `narrow` and those from `narrow_again` on lack their
  /// last unknown: it has the identity's row and column, and must stay 0 in vectors. Memory only
  /// ever grows.
  void reset(int n, int narrow = 0, int narrow_again = kNoRow) {
    resize(n);
    narrow_ = narrow;
    // The first two couple with all unknowns of those before them.
    wide_end_ = std::max(narrow, narrow_again < n - 2 ? narrow_again + 2 : n);
    for (int i = 0; i < n; ++i) {
      Row& row = rows_[static_cast<std::size_t>(i)];
      row.own.setZero();
      row.one.setZero();
      row.two.setZero();
      if (i < narrow || i >= narrow_again) row.own(D - 1, D - 1) = 1.0;
    }
  }
  /// n block rows of anything, none of them narrow.
  void resize(int n) {
    size_ = wide_end_ = n;
    narrow_ = 0;
    if (static_cast<int>(rows_.size()) < n) rows_.resize(static_cast<std::size_t>(n));
  }
  int size() const { return size_; }

  Block& own(int i) { return rows_[static_cast<std::size_t>(i)].own; }  // (i, i)
  Block& one(int i) { return rows_[static_cast<std::size_t>(i)].one; }  // (i, i-1)
  Block& two(int i) { return rows_[static_cast<std::size_t>(i)].two; }  // (i, i-2)

  /// Becomes the factors of A + shift I = L D L', L with ones on its diagonal: no pivot waits for a
  /// root. Of A only the lower triangle of own(i) is read. Returns false at the first pivot that is
  /// not positive: the matrix is then not positive definite.
  bool factor(const BlockBand& matrix, double shift = 0.0) {
    size_ = matrix.size_;
    narrow_ = matrix.narrow_;
    wide_end_ = matrix.wide_end_;
    rows_.resize(std::max(rows_.size(), matrix.rows_.size()));
    for (int i = 0; i < size_; ++i) {
      Row& row = rows_[static_cast<std::size_t>(i)];
      row = matrix.rows_[static_cast<std::size_t>(i)];
      row.own.diagonal().array() += shift;
      const bool narrow = i < narrow_ || i >= wide_end_;
      if (!(narrow ? factor_row<D - 1>(i) : factor_row<D>(i))) return false;
    }
    return true;
  }

  /// Solves A x = b with the factors; b, of size() * D values, becomes x.
  void solve(Eigen::Ref<Eigen::VectorXd> b) const {
    solve_lower<1>({b.data()});
    solve_upper(b);
  }
  /// The first half of that, b <- L^-1 b, of K at once, in less time than one after the other: a
  /// solve waits for itself. From block row `first` on; b is 0 before.
  template <int K>
  void solve_lower(std::array<double*, K> b, int first = 0) const {
    // The two unknowns before (or after) the one at hand stay in registers.
    Pair<K> known;
    for (int i = first; i < narrow_; ++i) solve_forward<D - 1, K>(i, b, known);
    for (int i = std::max(first, narrow_); i < wide_end_; ++i) solve_forward<D, K>(i, b, known);
    for (int i = std::max(first, wide_end_); i < size_; ++i) solve_forward<D - 1, K>(i, b, known);
  }
  /// b <- D^-1 b, for what needs no more than that half: b' A^-1 b is L^-1 b times D^-1 L^-1 b.
  void divide_by_pivots(Eigen::Ref<Eigen::VectorXd> b) const {
    for (int i = 0; i < size_; ++i) {
      b.segment<D>(D * i).array() *= rows_[static_cast<std::size_t>(i)].own.diagonal().array();
    }
  }
  /// The second half, b <- L^-T D^-1 b.
  void solve_upper(Eigen::Ref<Eigen::VectorXd> b) const {
    Pair<1> known;
    // The last two narrow rows couple with all unknowns of those after them.
    const int narrow = std::max(0, narrow_ - 2);
    for (int i = size_ - 1; i >= wide_end_; --i) solve_back<D - 1, 1>(i, {b.data()}, known);
    for (int i = wide_end_ - 1; i >= narrow; --i) solve_back<D, 1>(i, {b.data()}, known);
    for (int i = narrow - 1; i >= 0; --i) solve_back<D - 1, 1>(i, {b.data()}, known);
  }

 private:
  struct Row {
    Block own, one, two;
  };

  // Of a row, and of the rows that it couples with, the first R unknowns.

  template <int R>
  bool factor_row(int i) {
    using Square = Eigen::Matrix<double, R, R>;
    Row& row = rows_[static_cast<std::size_t>(i)];
    auto own = row.own.template topLeftCorner<R, R>();
    auto one = row.one.template topLeftCorner<R, R>();
    auto two = row.two.template topLeftCorner<R, R>();
    // First L's blocks times pivots, then without.
    if (i >= 2) {
      const Row& far = rows_[static_cast<std::size_t>(i - 2)];
      solve_right<R>(row.two, far.own);
      one.noalias() -=
          two *
          rows_[static_cast<std::size_t>(i - 1)].one.template topLeftCorner<R, R>().transpose();
      const Square scaled = two;
      two *= far.own.diagonal().template head<R>().asDiagonal();
      own.noalias() -= two * scaled.transpose();
    }
    if (i >= 1) {
      const Row& near = rows_[static_cast<std::size_t>(i - 1)];
      solve_right<R>(row.one, near.own);
      const Square scaled = one;
      one *= near.own.diagonal().template head<R>().asDiagonal();
      own.noalias() -= one * scaled.transpose();
    }
    return factor_block<R>(row.own);
  }

  /// Unknowns of K right sides in the rows next to the one at hand, and those after.
  template <int K>
  struct Pair {
    double near[D][K] = {}, far[D][K] = {};
    void take(const double (&v)[D][K]) {
      std::copy(&near[0][0], &near[0][0] + D * K, &far[0][0]);
      std::copy(&v[0][0], &v[0][0] + D * K, &near[0][0]);
    }
  };

  template <int R, int K>
  void solve_forward(int i, const std::array<double*, K>& x, Pair<K>& known) const {
    const Row& row = rows_[static_cast<std::size_t>(i)];
    double v[D][K] = {};
    for (int r = 0; r < R; ++r) {
      for (int k = 0; k < K; ++k) {
        double sum = x[k][D * i + r];
        for (int c = 0; c < R; ++c) {
          sum -= row.one(r, c) * known.near[c][k] + row.two(r, c) * known.far[c][k];
        }
        for (int c = 0; c < r; ++c) sum -= row.own(r, c) * v[c][k];
        x[k][D * i + r] = v[r][k] = sum;
      }
    }
    known.take(v);
  }

  template <int R, int K>
  void solve_back(int i, const std::array<double*, K>& x, Pair<K>& known) const {
    // What lies beyond the last row is multiplied by 0.
    const Row& row = rows_[static_cast<std::size_t>(i)];
    const Row& next = rows_[static_cast<std::size_t>(std::min(i + 1, size_ - 1))];
    const Row& after = rows_[static_cast<std::size_t>(std::min(i + 2, size_ - 1))];
    double v[D][K] = {};
    for (int r = R - 1; r >= 0; --r) {
      for (int k = 0; k < K; ++k) {
        double sum = x[k][D * i + r] * row.own(r, r);  // holds 1 / D_rr
        // In the order in which they became known, so as not to wait for the last of them.
        for (int c = R - 1; c >= 0; --c) sum -= after.two(c, r) * known.far[c][k];
        for (int c = R - 1; c >= 0; --c) sum -= next.one(c, r) * known.near[c][k];
        for (int c = R - 1; c > r; --c) sum -= row.own(c, r) * v[c][k];
        x[k][D * i + r] = v[r][k] = sum;
      }
    }
    known.take(v);
  }

  /// L and 1 / D in place of the lower triangle.
  template <int R>
  static bool factor_block(Block& a) {
    for (int c = 0; c < R; ++c) {
      if (!(a(c, c) > 0.0)) return false;
      const double inverse = 1.0 / a(c, c);
      a(c, c) = inverse;
      for (int r = c + 1; r < R; ++r) {
        const double part = a(r, c) * inverse;
        for (int k = c + 1; k <= r; ++k) a(r, k) -= part * a(k, c);
      }
      for (int r = c + 1; r < R; ++r) a(r, c) *= inverse;
    }
    return true;
  }

  /// b <- b L^-T, for the L made by factor_block().
  template <int R>
  static void solve_right(Block& b, const Block& factor) {
    for (int c = 1; c < R; ++c) {
      auto column = b.col(c).template head<R>();
      for (int k = 0; k < c; ++k) column -= factor(c, k) * b.col(k).template head<R>();
    }
  }

  int size_ = 0, narrow_ = 0, wide_end_ = 0;
  std::vector<Row> rows_;
};

/// The same in blocks of 3 and not symmetric, A = L U: the Hessian of a wire of which friction
/// follows the normal force. 1.5 times the time to factor, half the time to solve.
class UnsymmetricBand {
 public:
  /// Of 3x3; a fourth row of zeros makes each column two registers.
  using Block = Eigen::Matrix<double, 4, 3>;

  /// The symmetric matrix, not factored, of which the blocks own(i) are whole.
  void take(BlockBand<3>& symmetric) {
    size_ = symmetric.size();
    if (static_cast<int>(rows_.size()) < size_) rows_.resize(static_cast<std::size_t>(size_));
    for (int i = 0; i < size_; ++i) {
      copy(symmetric.own(i), row(i).own);
      copy(symmetric.one(i), row(i).one);
      copy(symmetric.two(i), row(i).two);
      if (i >= 1) copy(symmetric.one(i).transpose(), row(i - 1).next);
      if (i >= 2) copy(symmetric.two(i).transpose(), row(i - 2).after);
    }
  }

  /// Block (i, j) of a block row and a neighbour or itself.
  Block& at(int i, int j) { return i == j ? row(i).own : i > j ? row(i).one : row(i).next; }

  /// Returns false at the first pivot that is not positive, as where the symmetric part of A is not
  /// positive definite; its contents are then lost.
  bool factor() {
    for (int i = 0; i < size_; ++i) {
      Row& here = row(i);
      if (i >= 2) {
        const Row& far = row(i - 2);
        divide_right(here.two, far.own);
        subtract_product(here.two, far.next, here.one);
        subtract_product(here.two, far.after, here.own);
      }
      if (i >= 1) {
        const Row& near = row(i - 1);
        divide_right(here.one, near.own);
        subtract_product(here.one, near.next, here.own);
        subtract_product(here.one, near.after, here.next);
      }
      if (!factor_block(here.own)) return false;
      invert(here.own, here.inverse);
    }
    return true;
  }

  /// Solves A x = b after factor(); b, of 3 size() values, becomes x.
  void solve(Eigen::Ref<Eigen::VectorXd> b) const {
    // In scalars, which stay in registers: half the time of columns.
    double x[3], near[3] = {}, far[3] = {};
    const auto subtract = [&](const Block& a, const double(&v)[3]) {
      for (int r = 0; r < 3; ++r) x[r] -= a(r, 0) * v[0] + a(r, 1) * v[1] + a(r, 2) * v[2];
    };
    for (int i = 0; i < size_; ++i) {
      for (int r = 0; r < 3; ++r) x[r] = b[3 * i + r];
      if (i >= 2) subtract(row(i).two, far);
      if (i >= 1) subtract(row(i).one, near);
      for (int r = 0; r < 3; ++r) {
        far[r] = near[r];
        near[r] = b[3 * i + r] = x[r];
      }
    }
    for (int i = size_ - 1; i >= 0; --i) {
      for (int r = 0; r < 3; ++r) x[r] = b[3 * i + r];
      if (i + 2 < size_) subtract(row(i).after, far);
      if (i + 1 < size_) subtract(row(i).next, near);
      const Block& inverse = row(i).inverse;
      for (int r = 0; r < 3; ++r) {
        far[r] = near[r];
        near[r] = inverse(r, 0) * x[0] + inverse(r, 1) * x[1] + inverse(r, 2) * x[2];
        b[3 * i + r] = near[r];
      }
    }
  }

 private:
  struct Row {
    Block two, one, own, next, after;  // (i, i-2) to (i, i+2)
    // Of the block of U on its diagonal, so that a solve need not wait for itself. Not for the
    // factors: soft directions would be lost beside stiff ones.
    Block inverse;
  };
  Row& row(int i) { return rows_[static_cast<std::size_t>(i)]; }
  const Row& row(int i) const { return rows_[static_cast<std::size_t>(i)]; }

  template <class Square>
  static void copy(const Square& from, Block& to) {
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) to(r, c) = from(r, c);
      to(3, c) = 0.0;
    }
  }

  /// c <- c - a b, by columns.
  static void subtract_product(const Block& a, const Block& b, Block& c) {
    for (int k = 0; k < 3; ++k) {
      c.col(k) -= a.col(0) * b(0, k) + a.col(1) * b(1, k) + a.col(2) * b(2, k);
    }
  }

  /// L, with ones on its diagonal, and U in place of a block; 1 / U_cc on the diagonal.
  static bool factor_block(Block& a) {
    for (int c = 0; c < 3; ++c) {
      if (!(a(c, c) > 0.0)) return false;
      a(c, c) = 1.0 / a(c, c);
      for (int r = c + 1; r < 3; ++r) {
        a(r, c) *= a(c, c);
        for (int k = c + 1; k < 3; ++k) a(r, k) -= a(r, c) * a(c, k);
      }
    }
    return true;
  }

  /// b <- b a^-1, for a of factor_block().
  static void divide_right(Block& b, const Block& a) {
    b.col(0) *= a(0, 0);
    b.col(1) = (b.col(1) - a(0, 1) * b.col(0)) * a(1, 1);
    b.col(2) = (b.col(2) - a(0, 2) * b.col(0) - a(1, 2) * b.col(1)) * a(2, 2);
    b.col(1) -= a(2, 1) * b.col(2);
    b.col(0) -= a(1, 0) * b.col(1) + a(2, 0) * b.col(2);
  }

  static void invert(const Block& a, Block& inverse) {
    // Columns of L^-1, then back through U.
    const double l20 = a(2, 1) * a(1, 0) - a(2, 0);
    const double y[3][3] = {{1.0, -a(1, 0), l20}, {0.0, 1.0, -a(2, 1)}, {0.0, 0.0, 1.0}};
    for (int c = 0; c < 3; ++c) {
      inverse(2, c) = y[c][2] * a(2, 2);
      inverse(1, c) = (y[c][1] - a(1, 2) * inverse(2, c)) * a(1, 1);
      inverse(0, c) = (y[c][0] - a(0, 1) * inverse(1, c) - a(0, 2) * inverse(2, c)) * a(0, 0);
    }
  }

  int size_ = 0;
  std::vector<Row> rows_;
};

}  // namespace wireplan::simulate
