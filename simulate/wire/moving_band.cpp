#include "simulate/wire/moving_band.h"

#include <algorithm>
#include <tuple>

#include "simulate/wire/lanes.h"

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

namespace {

/// Numbers per column of a block: whole registers.
constexpr int padded(int per_node) { return per_node <= 4 ? 4 : 8; }

}  // namespace

/// A section follows the last node that it couples with. One that couples with none comes right
/// before the first section that leads to it, those further away first.
void MovingBand::find_sequence(const SectionBlocks& blocks) {
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
}

/// Whether the order is of the same couplings.
bool MovingBand::has_order_of(int nodes, int per_node, const SectionBlocks& blocks) {
  asked_.assign({nodes, per_node, blocks.sections()});
  for (int j = 0; j < blocks.sections(); ++j) {
    const SectionBlocks::Cross& cross = blocks.of_section(j);
    asked_.insert(asked_.end(), {cross.size > 0 ? cross.first : 0, cross.size});
  }
  for (const SectionBlocks::Pair& pair : blocks.pairs()) {
    asked_.insert(asked_.end(), {pair.i, pair.j});
  }
  if (asked_ == pattern_) return true;
  asked_.swap(pattern_);
  return false;
}

void MovingBand::find_order(int nodes, int per_node, const SectionBlocks& blocks) {
  find_sequence(blocks);
  const int m = blocks.sections();
  per_node_ = per_node;
  rows_.clear();
  place_.resize(static_cast<std::size_t>(nodes + m));
  const auto add = [&](int id, int from, int rows) {
    const int at = static_cast<int>(rows_.size());
    place_[static_cast<std::size_t>(id)] = at;
    rows_.push_back({from, rows, at, 0});
  };
  std::size_t next = 0;
  const auto add_sections = [&](int node) {
    for (; next < queue_.size() && after_[static_cast<std::size_t>(queue_[next])] <= node; ++next) {
      add(nodes + queue_[next], per_node * nodes + 3 * queue_[next], 3);
    }
  };
  add_sections(-1);
  for (int i = 0; i < nodes; ++i) {
    add(i, per_node * i, per_node);
    add_sections(i);
  }
  // Where each row begins.
  const auto place = [&](int id) { return place_[static_cast<std::size_t>(id)]; };
  const auto begin_at = [&](int row, int column) {
    int& first = rows_[static_cast<std::size_t>(row)].first;
    first = std::min(first, column);
  };
  for (int i = 1; i < nodes; ++i) begin_at(place(i), place(std::max(0, i - 2)));
  for (int j = 0; j < m; ++j) {
    const SectionBlocks::Cross& cross = blocks.of_section(j);
    if (cross.size > 0) begin_at(place(nodes + j), place(cross.first));
  }
  for (const SectionBlocks::Pair& pair : blocks.pairs()) {
    const int a = place(nodes + pair.i), b = place(nodes + pair.j);
    begin_at(std::max(a, b), std::min(a, b));
  }
  const int size = per_node * padded(per_node);
  std::ptrdiff_t offset = 0;
  for (std::size_t at = 0; at < rows_.size(); ++at) {
    rows_[at].offset = offset;
    offset += static_cast<std::ptrdiff_t>(static_cast<int>(at) - rows_[at].first + 1) * size;
  }
  values_.resize(static_cast<std::size_t>(offset));
  const auto numbers = rows_.size() * static_cast<std::size_t>(per_node);
  inverse_.resize(numbers);
  ordered_.resize(numbers);
}

// ---------------------------------------------------------------- numbers

namespace {

/// A block of D columns, each filled up to P numbers.
template <int D, int P>
struct Tile {
  static constexpr int kLanes = P / 4;
  Lane of[D][kLanes];

  WIREPLAN_INLINE void take(const double* from) {
    for (int c = 0; c < D; ++c) {
      for (int q = 0; q < kLanes; ++q) {
        of[c][q] = *reinterpret_cast<const StoredLane*>(from + c * P + 4 * q);
      }
    }
  }
  WIREPLAN_INLINE void put(double* to) const {
    for (int c = 0; c < D; ++c) {
      for (int q = 0; q < kLanes; ++q) {
        *reinterpret_cast<StoredLane*>(to + c * P + 4 * q) = of[c][q];
      }
    }
  }
  WIREPLAN_INLINE double at(int r, int c) const { return of[c][r / 4][r % 4]; }
  WIREPLAN_INLINE void set(int r, int c, double value) { of[c][r / 4][r % 4] = value; }
  /// Less W L'.
  WIREPLAN_INLINE void subtract(const double* w, const double* l) {
    for (int m = 0; m < D; ++m) {
      for (int q = 0; q < kLanes; ++q) {
        const Lane here = *reinterpret_cast<const StoredLane*>(w + m * P + 4 * q);
        for (int c = 0; c < D; ++c) of[c][q] -= here * l[m * P + c];
      }
    }
  }
  /// Becomes itself times the inverse of L', L with ones on its diagonal.
  WIREPLAN_INLINE void solve_right(const double* l) {
    for (int c = 1; c < D; ++c) {
      for (int m = 0; m < c; ++m) {
        for (int q = 0; q < kLanes; ++q) of[c][q] -= of[m][q] * l[m * P + c];
      }
    }
  }
  /// Becomes L below its diagonal, of L D L'. False at a pivot that is not positive.
  WIREPLAN_INLINE bool factor(double* inverse) {
    for (int c = 0; c < D; ++c) {
      if (!(at(c, c) > 0.0)) return false;
      inverse[c] = 1.0 / at(c, c);
      for (int r = c + 1; r < D; ++r) {
        const double part = at(r, c) * inverse[c];
        for (int k = c + 1; k <= r; ++k) set(r, k, at(r, k) - part * at(k, c));
      }
      for (int r = c + 1; r < D; ++r) set(r, c, at(r, c) * inverse[c]);
    }
    return true;
  }
};

/// Blocks hold L times pivots until the row is done.
template <int D, class Row>
WIREPLAN_INLINE bool factor_row(const Row* rows, std::size_t at, double* values, double* inverse) {
  constexpr int P = padded(D), kSize = D * P;
  const Row& here = rows[at];
  double* const own = values + here.offset;  // of block here.first
  const int last = static_cast<int>(at);
  Tile<D, P> tile;
  // 1. Blocks before the diagonal.
  for (int c = here.first; c < last; ++c) {
    const Row& other = rows[c];
    const int from = std::max(here.first, other.first);
    const double* l =
        values + other.offset + static_cast<std::ptrdiff_t>(from - other.first) * kSize;
    const double* w = own + static_cast<std::ptrdiff_t>(from - here.first) * kSize;
    double* const target = own + static_cast<std::ptrdiff_t>(c - here.first) * kSize;
    tile.take(target);
    for (int k = from; k < c; ++k, l += kSize, w += kSize) tile.subtract(w, l);
    tile.solve_right(l);
    tile.put(target);
  }
  // 2. The diagonal's less what those leave, and L in their place.
  double* const diagonal = own + static_cast<std::ptrdiff_t>(last - here.first) * kSize;
  tile.take(diagonal);
  double* w = own;
  for (int k = here.first; k < last; ++k, w += kSize) {
    const double* const pivots = inverse + static_cast<std::ptrdiff_t>(k) * D;
    Tile<D, P> times_pivots, l;
    times_pivots.take(w);
    for (int m = 0; m < D; ++m) {
      for (int q = 0; q < P / 4; ++q) l.of[m][q] = times_pivots.of[m][q] * pivots[m];
    }
    l.put(w);
    for (int m = 0; m < D; ++m) {
      for (int q = 0; q < P / 4; ++q) {
        for (int c = 0; c < D; ++c) tile.of[c][q] -= times_pivots.of[m][q] * w[m * P + c];
      }
    }
  }
  // 3. Its own factors.
  if (!tile.factor(inverse + at * D)) return false;
  tile.put(diagonal);
  return true;
}

template <int D, class Row>
WIREPLAN_INLINE bool factor_rows(const std::vector<Row>& rows, double* values, double* inverse) {
  for (std::size_t at = 0; at < rows.size(); ++at) {
    if (!factor_row<D>(rows.data(), at, values, inverse)) return false;
  }
  return true;
}

template <int D, class Row>
WIREPLAN_WIDE bool factor_rows_wide(const std::vector<Row>& rows, double* values, double* inverse) {
  return factor_rows<D>(rows, values, inverse);
}

/// All rows forward, the pivots, and all rows back, in the order.
template <int D, class Row>
WIREPLAN_INLINE void solve_rows(const std::vector<Row>& rows, const double* values,
                                const std::vector<double>& inverse, double* x) {
  constexpr int P = padded(D), kSize = D * P, kLanes = P / 4;
  for (std::size_t at = 0; at < rows.size(); ++at) {
    const double* l = values + rows[at].offset;
    const double* known = x + static_cast<std::ptrdiff_t>(rows[at].first) * D;
    double* const own = x + at * D;
    Lane sums[D][kLanes] = {};  // one for each column, so that none waits for another
    for (; known < own; known += D, l += kSize) {
      for (int c = 0; c < D; ++c) {
        for (int q = 0; q < kLanes; ++q) {
          sums[c][q] += *reinterpret_cast<const StoredLane*>(l + c * P + 4 * q) * known[c];
        }
      }
    }
    for (int c = 1; c < D; ++c) {
      for (int q = 0; q < kLanes; ++q) sums[0][q] += sums[c][q];
    }
    for (int r = 0; r < D; ++r) {
      own[r] -= sums[0][r / 4][r % 4];
      for (int c = 0; c < r; ++c) own[r] -= l[c * P + r] * own[c];
    }
  }
  for (std::size_t k = 0; k < inverse.size(); ++k) x[k] *= inverse[k];
  for (std::size_t at = rows.size(); at-- > 0;) {
    const double* l = values + rows[at].offset;
    double* known = x + static_cast<std::ptrdiff_t>(rows[at].first) * D;
    double* const own = x + at * D;
    const double* const diagonal = l + (own - known) * P;
    for (int r = D - 1; r > 0; --r) {
      for (int c = 0; c < r; ++c) own[c] -= diagonal[c * P + r] * own[r];
    }
    double found[D];
    std::copy(own, own + D, found);
    for (; known < own; known += D, l += kSize) {
      for (int c = 0; c < D; ++c) {
        double sum = l[c * P] * found[0];
        for (int r = 1; r < D; ++r) sum += l[c * P + r] * found[r];
        known[c] -= sum;
      }
    }
  }
}

template <int D, class Row>
WIREPLAN_WIDE void solve_rows_wide(const std::vector<Row>& rows, const double* values,
                                   const std::vector<double>& inverse, double* x) {
  solve_rows<D>(rows, values, inverse, x);
}

}  // namespace

template <int D>
bool MovingBand::factor(BlockBand<D>& wire, const SectionBlocks& blocks, double shift) {
  constexpr int P = padded(D);
  const int nodes = wire.size();
  if (!has_order_of(nodes, D, blocks)) find_order(nodes, D, blocks);
  std::fill(values_.begin(), values_.end(), 0.0);
  // Of a block on the diagonal the lower triangle counts.
  const auto block_at = [&](int row_id, int column_id) {
    const Row& row = rows_[static_cast<std::size_t>(place_[static_cast<std::size_t>(row_id)])];
    const int column = place_[static_cast<std::size_t>(column_id)];
    return values_.data() + row.offset + static_cast<std::ptrdiff_t>(column - row.first) * D * P;
  };
  const auto put_wire = [&](int i, int j, const typename BlockBand<D>::Block& block) {
    double* const target = block_at(i, j);
    for (int c = 0; c < D; ++c) {
      for (int r = 0; r < D; ++r) target[c * P + r] = block(r, c);
    }
  };
  for (int i = 0; i < nodes; ++i) {
    put_wire(i, i, wire.own(i));
    double* const own = block_at(i, i);
    for (int c = 0; c < D; ++c) own[c * P + c] += shift;
    if (i >= 1) put_wire(i, i - 1, wire.one(i));
    if (i >= 2) put_wire(i, i - 2, wire.two(i));
  }
  const auto put_transposed = [&](int row_id, int column_id, const Mat3& block) {
    double* const target = block_at(row_id, column_id);
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) target[c * P + r] = block(c, r);
    }
  };
  for (int j = 0; j < blocks.sections(); ++j) {
    const SectionBlocks::Cross& cross = blocks.of_section(j);
    for (int k = 0; k < cross.size; ++k) {
      put_transposed(nodes + j, cross.first + k, cross.blocks[static_cast<std::size_t>(k)]);
    }
    double* const own = block_at(nodes + j, nodes + j);
    for (int c = 3; c < D; ++c) own[c * P + c] = 1.0;
  }
  for (const SectionBlocks::Pair& pair : blocks.pairs()) {
    const int i = nodes + pair.i, j = nodes + pair.j;
    if (place_[static_cast<std::size_t>(i)] >= place_[static_cast<std::size_t>(j)]) {
      put_transposed(i, j, pair.value.transpose());
    } else {
      put_transposed(j, i, pair.value);
    }
    if (i != j) continue;
    double* const own = block_at(i, i);
    for (int c = 0; c < 3; ++c) own[c * P + c] += shift;
  }
  return has_wide_registers() ? factor_rows_wide<D>(rows_, values_.data(), inverse_.data())
                              : factor_rows<D>(rows_, values_.data(), inverse_.data());
}

template <int D>
void MovingBand::solve_ordered() {
  if (has_wide_registers()) {
    solve_rows_wide<D>(rows_, values_.data(), inverse_, ordered_.data());
  } else {
    solve_rows<D>(rows_, values_.data(), inverse_, ordered_.data());
  }
}

void MovingBand::solve(Eigen::VectorXd& v) {
  double* x = ordered_.data();
  for (const Row& row : rows_) {
    for (int r = 0; r < per_node_; ++r) x[r] = r < row.rows ? v[row.from + r] : 0.0;
    x += per_node_;
  }
  switch (per_node_) {
    case 3:
      solve_ordered<3>();
      break;
    case 4:
      solve_ordered<4>();
      break;
    case 5:
      solve_ordered<5>();
      break;
    default:
      solve_ordered<6>();
  }
  x = ordered_.data();
  for (const Row& row : rows_) {
    for (int r = 0; r < row.rows; ++r) v[row.from + r] = x[r];
    x += per_node_;
  }
}

template bool MovingBand::factor<3>(BlockBand<3>&, const SectionBlocks&, double);
template bool MovingBand::factor<4>(BlockBand<4>&, const SectionBlocks&, double);
template bool MovingBand::factor<5>(BlockBand<5>&, const SectionBlocks&, double);
template bool MovingBand::factor<6>(BlockBand<6>&, const SectionBlocks&, double);

}  // namespace wireplan::simulate
