#include "simulate/contact/compliance_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace wireplan::simulate {

void ComplianceTable::grow() {
  const std::size_t side = std::max(kSmallest, 2 * side_);
  std::vector<double> grown(side * side);
  for (std::size_t row = 0; row < side_; ++row) {
    std::copy_n(values_.begin() + static_cast<std::ptrdiff_t>(row * side_), side_,
                grown.begin() + static_cast<std::ptrdiff_t>(row * side));
  }
  values_ = std::move(grown);
  for (std::size_t row = side; row-- > side_;) free_rows_.push_back(static_cast<int>(row));
  vertex_.resize(side);
  half_.resize(side);
  side_ = side;
}

void ComplianceTable::free_rows(const std::vector<SurfacePoint>& feet) {
  needed_.assign(side_, 0);
  for (const SurfacePoint& foot : feet) {
    if (foot.triangle < 0) continue;
    for (const int vertex : foot.vertex) {
      const int row = row_[static_cast<std::size_t>(vertex)];
      if (row >= 0) needed_[static_cast<std::size_t>(row)] = 1;
    }
  }
  for (std::size_t row = 0; row < side_; ++row) {
    if (needed_[row] != 0) continue;
    row_[static_cast<std::size_t>(vertex_[row])] = kNoRow;
    free_rows_.push_back(static_cast<int>(row));
  }
}

int ComplianceTable::row_of(const WallCompliance& wall, int vertex,
                            const std::vector<SurfacePoint>& feet) {
  int& row = row_[static_cast<std::size_t>(vertex)];
  if (row >= 0) return row;
  if (free_rows_.empty()) free_rows(feet);
  if (free_rows_.empty()) grow();
  row = free_rows_.back();
  free_rows_.pop_back();
  vertex_[static_cast<std::size_t>(row)] = vertex;
  half_[static_cast<std::size_t>(row)] = &wall.half_response(vertex);
  for (int other = 0; other < static_cast<int>(side_); ++other) {
    at(row, other) = at(other, row) = std::numeric_limits<double>::quiet_NaN();
  }
  return row;
}

void ComplianceTable::find_entry(int row, int column) {
  if (!std::isnan(entry(row, column))) return;
  at(row, column) = at(column, row) = WallCompliance::between(
      *half_[static_cast<std::size_t>(row)], *half_[static_cast<std::size_t>(column)]);
}

void ComplianceTable::take(const WallCompliance& wall, const std::vector<SurfacePoint>& feet) {
  row_.resize(static_cast<std::size_t>(wall.normals().cols()), kNoRow);
  foot_rows_.resize(feet.size());
  for (std::size_t i = 0; i < feet.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      foot_rows_[i][a] = feet[i].triangle >= 0 ? row_of(wall, feet[i].vertex[a], feet) : kNoRow;
    }
  }
}

double ComplianceTable::between(const Rows& one, const Vec3& weight, const Rows& other,
                                const Vec3& other_weight) {
  // What is not known yet makes a sum that is no number.
  const auto sum = [&] {
    const auto part = [&](std::size_t a) {
      return other_weight[0] * entry(one[a], other[0]) + other_weight[1] * entry(one[a], other[1]) +
             other_weight[2] * entry(one[a], other[2]);
    };
    return weight[0] * part(0) + weight[1] * part(1) + weight[2] * part(2);
  };
  const double known = sum();
  if (!std::isnan(known)) return known;
  for (const int row : one) {
    for (const int column : other) find_entry(row, column);
  }
  return sum();
}

}  // namespace wireplan::simulate
