#include "simulate/contact/envelope_factor.h"

#include <algorithm>
#include <cmath>

#include "preprocess/base.h"

namespace wireplan::simulate {

void EnvelopeFactor::clear() {
  blocks_.clear();
  values_.clear();
}

void EnvelopeFactor::add_rows(int first) {
  const int own = rows();
  expects(first >= 0 && first <= own);
  blocks_.push_back({first, static_cast<std::ptrdiff_t>(values_.size() / kLane) - first});
  values_.resize(values_.size() + static_cast<std::size_t>(own - first) * kLane + kLane * kLane);
}

// What is WIDE is in one function for all rows, see lanes.h.
namespace {

/// sum -= the column of four rows, times x.
WIREPLAN_INLINE void subtract(const double* column, double x, Lane& sum) {
  Lane four;
  lanes::load(column, four);
  sum -= four * x;
}

template <class Block>
WIREPLAN_INLINE void factor_blocks(const Block* blocks, std::size_t count, double* values,
                                   double* reciprocal) {
  for (std::size_t b = 0; b < count; ++b) {
    const int rows = static_cast<int>(kLane * b);  // before these
    double* const own = values + kLane * blocks[b].offset;
    for (int q = blocks[b].first; q < rows + static_cast<int>(kLane); ++q) {
      const Block& other = blocks[static_cast<std::size_t>(q) / kLane];
      const double* const above =
          values + kLane * other.offset + static_cast<std::size_t>(q) % kLane;
      Lane sum[2] = {};  // so that none waits for the other
      lanes::load(own + kLane * q, sum[0]);
      int k = std::max(blocks[b].first, other.first);
      for (; k + 1 < q; k += 2) {
        subtract(own + kLane * k, above[kLane * k], sum[0]);
        subtract(own + kLane * (k + 1), above[kLane * (k + 1)], sum[1]);
      }
      if (k < q) subtract(own + kLane * k, above[kLane * k], sum[0]);
      Lane entry = sum[0] + sum[1];
      if (q < rows) {
        entry *= reciprocal[q];
      } else {
        const int r = q - rows;
        const double root = std::sqrt(entry[r]);
        reciprocal[q] = 1.0 / root;
        entry *= reciprocal[q];
        entry[r] = root;
        for (int before = 0; before < r; ++before) entry[before] = 0.0;
      }
      lanes::store(entry, own + kLane * q);
    }
  }
}

template <class Block>
WIREPLAN_WIDE void factor_blocks_wide(const Block* blocks, std::size_t count, double* values,
                                      double* reciprocal) {
  factor_blocks(blocks, count, values, reciprocal);
}

template <class Block>
WIREPLAN_INLINE void solve_blocks(const Block* blocks, std::size_t count, const double* values,
                                  const double* reciprocal, double* x) {
  for (std::size_t b = 0; b < count; ++b) {
    const int rows = static_cast<int>(kLane * b);
    const double* const own = values + kLane * blocks[b].offset;
    Lane sum[2] = {};
    lanes::load(x + rows, sum[0]);
    int q = blocks[b].first;
    for (; q + 1 < rows; q += 2) {
      subtract(own + kLane * q, x[q], sum[0]);
      subtract(own + kLane * (q + 1), x[q + 1], sum[1]);
    }
    if (q < rows) subtract(own + kLane * q, x[q], sum[0]);
    Lane left = sum[0] + sum[1];
    for (int r = 0; r < static_cast<int>(kLane); ++r) {
      const double found = left[r] * reciprocal[rows + r];
      subtract(own + kLane * (rows + r), found, left);
      left[r] = found;  // of those before it the factor has zeros there
    }
    lanes::store(left, x + rows);
  }
  for (std::size_t b = count; b-- > 0;) {
    const int rows = static_cast<int>(kLane * b);
    const double* const own = values + kLane * blocks[b].offset;
    for (int r = static_cast<int>(kLane); r-- > 0;) {
      const double* const column = own + kLane * (rows + r);
      double sum = x[rows + r];
      for (int s = r + 1; s < static_cast<int>(kLane); ++s) sum -= column[s] * x[rows + s];
      x[rows + r] = sum * reciprocal[rows + r];
    }
    const double* column = own + static_cast<std::ptrdiff_t>(kLane) * blocks[b].first;
    for (int q = blocks[b].first; q < rows; ++q, column += kLane) {
      x[q] -= (column[0] * x[rows] + column[2] * x[rows + 2]) +
              (column[1] * x[rows + 1] + column[3] * x[rows + 3]);
    }
  }
}

template <class Block>
WIREPLAN_WIDE void solve_blocks_wide(const Block* blocks, std::size_t count, const double* values,
                                     const double* reciprocal, double* x) {
  solve_blocks(blocks, count, values, reciprocal, x);
}

}  // namespace

void EnvelopeFactor::factor(bool wide) {
  reciprocal_.resize(static_cast<std::size_t>(rows()));
  if (wide) {
    factor_blocks_wide(blocks_.data(), blocks_.size(), values_.data(), reciprocal_.data());
  } else {
    factor_blocks(blocks_.data(), blocks_.size(), values_.data(), reciprocal_.data());
  }
}

void EnvelopeFactor::solve(double* x, bool wide) const {
  if (wide) {
    solve_blocks_wide(blocks_.data(), blocks_.size(), values_.data(), reciprocal_.data(), x);
  } else {
    solve_blocks(blocks_.data(), blocks_.size(), values_.data(), reciprocal_.data(), x);
  }
}

/// Blocks of rows from a column's own on that have it in their envelope.
template <class Visit>
void EnvelopeFactor::for_each_coupled_block(int column, Visit&& visit) const {
  const auto last = static_cast<std::size_t>(end_[static_cast<std::size_t>(column)]) / kLane;
  for (std::size_t b = block_of(column); b < last; ++b) {
    if (blocks_[b].first <= column) visit(b);
  }
}

void EnvelopeFactor::invert() {
  const int n = rows();
  end_.assign(static_cast<std::size_t>(n), 0);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    std::fill(end_.begin() + blocks_[b].first,
              end_.begin() + static_cast<std::ptrdiff_t>(kLane * (b + 1)),
              static_cast<int>(kLane * (b + 1)));
  }
  inverse_place_.resize(static_cast<std::size_t>(n));
  std::ptrdiff_t offset = 0;
  for (int row = 0; row < n; ++row) {
    inverse_place_[static_cast<std::size_t>(row)] = offset - first(row);
    offset += end_[static_cast<std::size_t>(row)] - first(row);
  }
  inverse_.resize(static_cast<std::size_t>(offset));
  sum_.resize(static_cast<std::size_t>(n));
  const auto row_of = [&](int row) {
    return inverse_.data() + inverse_place_[static_cast<std::size_t>(row)];
  };
  // With l the factor's column below its diagonal d: of rows that couple with it the inverse has
  // -Z l / d there, and (1/d + l' Z l / d) / d on the diagonal. Two such rows couple with each
  // other, so that all of Z that this takes is known.
  for (int j = n; j-- > 0;) {
    const int end = end_[static_cast<std::size_t>(j)];
    const auto after = static_cast<std::size_t>(end - j - 1);
    double* const sum = sum_.data() + j + 1;
    std::fill(sum, sum + after, 0.0);
    for_each_coupled_block(j, [&](std::size_t b) {
      const int begin = static_cast<int>(kLane * b);
      for (int k = std::max(begin, j + 1); k < begin + static_cast<int>(kLane); ++k) {
        lanes::add_scaled(at(k, j), row_of(k) + j + 1, sum, after);
      }
    });
    const double part = reciprocal_[static_cast<std::size_t>(j)];
    double diagonal = part;
    double* const own = row_of(j);
    for (int i = j + 1; i < end; ++i) own[i] = 0.0;
    for_each_coupled_block(j, [&](std::size_t b) {
      const int begin = static_cast<int>(kLane * b);
      for (int i = std::max(begin, j + 1); i < begin + static_cast<int>(kLane); ++i) {
        const double entry = -sum_[static_cast<std::size_t>(i)] * part;
        own[i] = row_of(i)[j] = entry;
        diagonal -= at(i, j) * entry;
      }
    });
    own[j] = diagonal * part;
  }
}

}  // namespace wireplan::simulate
