#pragma once
/// Cholesky's factor of a symmetric matrix within an envelope, four rows at once.
#include <cstddef>
#include <vector>

#include "simulate/wire/lanes.h"

namespace wireplan::simulate {

/// A positive definite matrix of n rows, by blocks of four rows, each from its first column on; the
/// last block is filled up with rows of the identity. Memory only ever grows.
class EnvelopeFactor {
 public:
  void clear();
  /// Four more rows of zeros, from a column no further than their own on.
  void add_rows(int first);
  /// Rows so far, those that fill up among them.
  int rows() const { return static_cast<int>(kLane * blocks_.size()); }
  /// The first column of a row.
  int first(int row) const { return blocks_[block_of(row)].first; }
  /// Of the lower triangle: of the matrix, of its factor L after factor().
  double& at(int row, int column) { return values_[place(row, column)]; }

  /// Becomes L of L L'. In wide registers or not: the same bits.
  void factor(bool wide = has_wide_registers());
  /// Solves for a right side of rows() numbers, in place.
  void solve(double* x, bool wide = has_wide_registers()) const;
  /// After factor(): finds the inverse's entries within the envelope (Takahashi, Fagan & Chin
  /// 1973), from the last row upward.
  void invert();
  double inverse(int row, int column) const {  // column <= row, within the envelope
    return inverse_[static_cast<std::size_t>(inverse_place_[static_cast<std::size_t>(row)] +
                                             column)];
  }

 private:
  struct Block {
    int first;
    std::ptrdiff_t offset;  // of column 0, were it there, in registers
  };
  static std::size_t block_of(int row) { return static_cast<std::size_t>(row) / kLane; }
  std::size_t place(int row, int column) const {
    return static_cast<std::size_t>(blocks_[block_of(row)].offset + column) * kLane +
           static_cast<std::size_t>(row) % kLane;
  }
  template <class Visit>
  void for_each_coupled_block(int column, Visit&& visit) const;

  std::vector<Block> blocks_;
  std::vector<double> values_;      // of a block, column by column
  std::vector<double> reciprocal_;  // of the factor's diagonal
  // Of the inverse, whole rows: from the first column to the last row that couples with it.
  std::vector<std::ptrdiff_t> inverse_place_;  // of column 0 of each row, were it there
  std::vector<int> end_;
  std::vector<double> inverse_;
  std::vector<double> sum_;  // scratch
};

}  // namespace wireplan::simulate
