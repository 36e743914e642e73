#include "simulate/wire/moving_band.h"

#include <algorithm>
#include <array>
#include <tuple>

namespace wireplan::simulate {

// ---------------------------------------------------------------- blocks

void SectionBlocks::reset(int nodes, int sections) {
  expects(nodes > 0 && sections > 0);
  if (sections != sections_) {
    sections_ = sections;
    cross_.resize(static_cast<std::size_t>(sections));
    slot_.assign(static_cast<std::size_t>(sections) * static_cast<std::size_t>(sections), -1);
    pairs_.clear();
  }
  for (Cross& cross : cross_) cross.size = 0;
  for (const Pair& pair : pairs_) {
    slot_[static_cast<std::size_t>(pair.i) * static_cast<std::size_t>(sections_) +
          static_cast<std::size_t>(pair.j)] = -1;
  }
  pairs_.clear();
}

Mat3& SectionBlocks::cross(int node, int section) {
  Cross& cross = cross_[static_cast<std::size_t>(section)];
  if (cross.size == 0) cross.first = node;
  const int before = std::max(0, cross.first - node);
  const int size = std::max(cross.size, node - cross.first + 1) + before;
  if (size > cross.size) {
    if (static_cast<int>(cross.blocks.size()) < size) {
      cross.blocks.resize(static_cast<std::size_t>(size));
    }
    const auto begin = cross.blocks.begin();
    if (before > 0) std::copy_backward(begin, begin + cross.size, begin + before + cross.size);
    std::fill(begin, begin + before, Mat3::Zero());
    std::fill(begin + before + cross.size, begin + size, Mat3::Zero());
    cross.first -= before;
    cross.size = size;
  }
  return cross.blocks[static_cast<std::size_t>(node - cross.first)];
}

Mat3& SectionBlocks::pair(int i, int j) {
  int& slot = slot_[static_cast<std::size_t>(i) * static_cast<std::size_t>(sections_) +
                    static_cast<std::size_t>(j)];
  if (slot < 0) {
    slot = static_cast<int>(pairs_.size());
    pairs_.push_back({i, j, Mat3::Zero()});
  }
  return pairs_[static_cast<std::size_t>(slot)].value;
}

void SectionBlocks::project(int node, const Mat3& P) {
  for (Cross& cross : cross_) {
    if (node < cross.first || node >= cross.first + cross.size) continue;
    Mat3& block = cross.blocks[static_cast<std::size_t>(node - cross.first)];
    block = (P * block).eval();
  }
}

// ---------------------------------------------------------------- factors

/// A section follows the last node that it couples with. One that couples with none comes right
/// before the first section that leads to it, those further away first.
void MovingBand::find_order(int nodes, int per_node, const SectionBlocks& blocks) {
  const int m = blocks.sections();
  after_.assign(static_cast<std::size_t>(m), -1);
  depth_.assign(static_cast<std::size_t>(m), -1);
  joined_.resize(static_cast<std::size_t>(m));
  for (auto& list : joined_) list.clear();
  for (const SectionBlocks::Pair& pair : blocks.pairs()) {
    if (pair.i == pair.j) continue;
    joined_[static_cast<std::size_t>(pair.i)].push_back(pair.j);
    joined_[static_cast<std::size_t>(pair.j)].push_back(pair.i);
  }
  queue_.clear();
  for (int j = 0; j < m; ++j) {
    const SectionBlocks::Cross& cross = blocks.of_section(j);
    if (cross.size == 0) continue;
    after_[static_cast<std::size_t>(j)] = cross.first + cross.size - 1;
    depth_[static_cast<std::size_t>(j)] = 0;
    queue_.push_back(j);
  }
  const auto after = [&](int j) { return after_[static_cast<std::size_t>(j)]; };
  std::stable_sort(queue_.begin(), queue_.end(), [&](int a, int b) { return after(a) < after(b); });
  for (std::size_t k = 0; k < queue_.size(); ++k) {
    const auto j = static_cast<std::size_t>(queue_[k]);
    for (const int other : joined_[j]) {
      const auto o = static_cast<std::size_t>(other);
      if (depth_[o] >= 0) continue;
      depth_[o] = depth_[j] + 1;
      after_[o] = after_[j];
      queue_.push_back(other);
    }
  }
  for (int j = 0; j < m; ++j) {
    if (depth_[static_cast<std::size_t>(j)] < 0) queue_.push_back(j);
  }
  std::stable_sort(queue_.begin(), queue_.end(), [&](int a, int b) {
    return std::tuple(after(a), -depth_[static_cast<std::size_t>(a)]) <
           std::tuple(after(b), -depth_[static_cast<std::size_t>(b)]);
  });

  rows_.clear();
  row_of_.clear();
  place_.resize(static_cast<std::size_t>(nodes + m));
  int column = 0;
  const auto add = [&](int id, int from, int rows) {
    place_[static_cast<std::size_t>(id)] = static_cast<int>(rows_.size());
    for (int r = 0; r < rows; ++r) row_of_.push_back(static_cast<int>(rows_.size()));
    rows_.push_back({from, rows, column, column, 0});
    column += rows;
  };
  std::size_t next = 0;
  const auto add_sections = [&](int node) {
    for (; next < queue_.size() && after(queue_[next]) <= node; ++next) {
      add(nodes + queue_[next], per_node * nodes + 3 * queue_[next], 3);
    }
  };
  add_sections(-1);
  for (int i = 0; i < nodes; ++i) {
    add(i, per_node * i, per_node);
    add_sections(i);
  }
  // Where each row begins.
  const auto row = [&](int id) -> Row& {
    return rows_[static_cast<std::size_t>(place_[static_cast<std::size_t>(id)])];
  };
  for (int i = 1; i < nodes; ++i) row(i).first = row(std::max(0, i - 2)).start;
  for (int j = 0; j < m; ++j) {
    const SectionBlocks::Cross& cross = blocks.of_section(j);
    if (cross.size > 0) row(nodes + j).first = row(cross.first).start;
  }
  for (const SectionBlocks::Pair& pair : blocks.pairs()) {
    Row &a = row(nodes + pair.i), &b = row(nodes + pair.j);
    Row &later = a.start > b.start ? a : b, &earlier = a.start > b.start ? b : a;
    later.first = std::min(later.first, earlier.start);
  }
  std::ptrdiff_t offset = 0;
  for (Row& each : rows_) {
    each.offset = offset;
    offset += static_cast<std::ptrdiff_t>(each.start + each.rows - each.first) * width_;
  }
  values_.assign(static_cast<std::size_t>(offset), 0.0);
  inverse_.resize(static_cast<std::size_t>(column));
  ordered_.resize(static_cast<std::size_t>(column));
}

/// Row of blocks by row of blocks. Columns hold L times pivots until the row is done.
template <int P>
bool MovingBand::factor_row(std::size_t at) {
  const Row& here = rows_[at];
  double* const own = values_.data() + here.offset;  // of column here.first
  // 1. Columns before the diagonal's block.
  for (int c = here.first; c < here.start; ++c) {
    const Row& other = rows_[static_cast<std::size_t>(row_of_[static_cast<std::size_t>(c)])];
    const int from = std::max(here.first, other.first);
    const double* l = values_.data() + other.offset +
                      static_cast<std::ptrdiff_t>(from - other.first) * P + (c - other.start);
    const double* w = own + static_cast<std::ptrdiff_t>(from - here.first) * P;
    double* const target = own + static_cast<std::ptrdiff_t>(c - here.first) * P;
    double sum[P];
    for (int r = 0; r < P; ++r) sum[r] = target[r];
    for (int k = from; k < c; ++k, l += P, w += P) {
      for (int r = 0; r < P; ++r) sum[r] -= w[r] * *l;
    }
    for (int r = 0; r < P; ++r) target[r] = sum[r];
  }
  // 2. The diagonal's block less what those leave, and L in their place.
  double block[P][P];
  double* const diagonal = own + static_cast<std::ptrdiff_t>(here.start - here.first) * P;
  for (int c = 0; c < here.rows; ++c) {
    for (int r = 0; r < P; ++r) block[c][r] = diagonal[c * P + r];
  }
  double* w = own;
  for (int k = here.first; k < here.start; ++k, w += P) {
    double l[P];
    for (int r = 0; r < P; ++r) l[r] = w[r] * inverse_[static_cast<std::size_t>(k)];
    for (int c = 0; c < here.rows; ++c) {
      for (int r = 0; r < P; ++r) block[c][r] -= w[r] * l[c];
    }
    for (int r = 0; r < P; ++r) w[r] = l[r];
  }
  // 3. Its own factors.
  for (int c = 0; c < here.rows; ++c) {
    if (!(block[c][c] > 0.0)) return false;
    const double inverse = 1.0 / block[c][c];
    inverse_[static_cast<std::size_t>(here.start + c)] = inverse;
    for (int r = c + 1; r < here.rows; ++r) {
      const double part = block[c][r] * inverse;
      for (int k = c + 1; k <= r; ++k) block[k][r] -= part * block[c][k];
    }
    for (int r = c + 1; r < here.rows; ++r) block[c][r] *= inverse;
  }
  for (int c = 0; c < here.rows; ++c) {
    for (int r = 0; r < P; ++r) diagonal[c * P + r] = r > c && r < here.rows ? block[c][r] : 0.0;
  }
  return true;
}

template <int D>
bool MovingBand::factor(BlockBand<D>& wire, const SectionBlocks& blocks, double shift) {
  constexpr int P = D <= 4 ? 4 : 8;
  const int nodes = wire.size();
  width_ = P;
  find_order(nodes, D, blocks);
  // Into the rows' columns; of a block on the diagonal the lower triangle counts.
  const auto put = [&](int row_id, int column_id, const auto& block) {
    const Row& row = rows_[static_cast<std::size_t>(place_[static_cast<std::size_t>(row_id)])];
    const Row& column =
        rows_[static_cast<std::size_t>(place_[static_cast<std::size_t>(column_id)])];
    double* target =
        values_.data() + row.offset + static_cast<std::ptrdiff_t>(column.start - row.first) * P;
    for (int c = 0; c < column.rows; ++c) {
      for (int r = 0; r < row.rows; ++r) target[c * P + r] += block(r, c);
    }
  };
  for (int i = 0; i < nodes; ++i) {
    typename BlockBand<D>::Block own = wire.own(i);
    own.diagonal().array() += shift;
    put(i, i, own);
    if (i >= 1) put(i, i - 1, wire.one(i));
    if (i >= 2) put(i, i - 2, wire.two(i));
  }
  Eigen::Matrix<double, 3, D> padded = Eigen::Matrix<double, 3, D>::Zero();
  for (int j = 0; j < blocks.sections(); ++j) {
    const SectionBlocks::Cross& cross = blocks.of_section(j);
    for (int k = 0; k < cross.size; ++k) {
      padded.template leftCols<3>() = cross.blocks[static_cast<std::size_t>(k)].transpose();
      put(nodes + j, cross.first + k, padded);
    }
  }
  for (const SectionBlocks::Pair& pair : blocks.pairs()) {
    Mat3 value = pair.value;
    if (pair.i == pair.j) value.diagonal().array() += shift;
    if (place_[static_cast<std::size_t>(nodes + pair.i)] >=
        place_[static_cast<std::size_t>(nodes + pair.j)]) {
      put(nodes + pair.i, nodes + pair.j, value);
    } else {
      put(nodes + pair.j, nodes + pair.i, value.transpose());
    }
  }
  for (std::size_t at = 0; at < rows_.size(); ++at) {
    if (!factor_row<P>(at)) return false;
  }
  return true;
}

namespace {

/// Both halves of a solve with the rows of one block row, P numbers per column of which those
/// beyond `rows` are 0.
template <int P>
void solve_row_forward(const double* l, int rows, int before, const double* known, double* own) {
  double sum[P] = {};
  for (int k = 0; k < before; ++k, l += P) {
    for (int r = 0; r < P; ++r) sum[r] += l[r] * known[k];
  }
  for (int r = 0; r < rows; ++r) {
    own[r] -= sum[r];
    for (int c = 0; c < r; ++c) own[r] -= l[c * P + r] * own[c];
  }
}

template <int P>
void solve_row_back(const double* l, int rows, int before, double* known, double* own) {
  const double* diagonal = l + static_cast<std::ptrdiff_t>(before) * P;
  double found[P] = {};
  for (int r = rows - 1; r >= 0; --r) {
    found[r] = own[r];
    for (int c = 0; c < r; ++c) own[c] -= diagonal[c * P + r] * own[r];
  }
  for (int k = 0; k < before; ++k, l += P) {
    double sum = 0.0;
    for (int r = 0; r < P; ++r) sum += l[r] * found[r];
    known[k] -= sum;
  }
}

}  // namespace

/// All rows forward, the pivots, and all rows back, in the order.
template <int P>
void MovingBand::solve_rows() {
  double* const x = ordered_.data();
  for (const Row& row : rows_) {
    solve_row_forward<P>(values_.data() + row.offset, row.rows, row.start - row.first,
                         x + row.first, x + row.start);
  }
  for (std::size_t k = 0; k < inverse_.size(); ++k) x[k] *= inverse_[k];
  for (std::size_t at = rows_.size(); at-- > 0;) {
    const Row& row = rows_[at];
    solve_row_back<P>(values_.data() + row.offset, row.rows, row.start - row.first, x + row.first,
                      x + row.start);
  }
}

void MovingBand::solve(Eigen::VectorXd& v) {
  for (const Row& row : rows_) {
    for (int r = 0; r < row.rows; ++r) {
      ordered_[static_cast<std::size_t>(row.start + r)] = v[row.from + r];
    }
  }
  width_ == 4 ? solve_rows<4>() : solve_rows<8>();
  for (const Row& row : rows_) {
    for (int r = 0; r < row.rows; ++r) {
      v[row.from + r] = ordered_[static_cast<std::size_t>(row.start + r)];
    }
  }
}

template bool MovingBand::factor<3>(BlockBand<3>&, const SectionBlocks&, double);
template bool MovingBand::factor<4>(BlockBand<4>&, const SectionBlocks&, double);
template bool MovingBand::factor<5>(BlockBand<5>&, const SectionBlocks&, double);
template bool MovingBand::factor<6>(BlockBand<6>&, const SectionBlocks&, double);

}  // namespace wireplan::simulate
