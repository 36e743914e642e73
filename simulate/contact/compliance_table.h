#pragma once
/// Compliances between the vertices that a wire's feet stood on lately.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulate/wall/compliance.h"
#include "simulate/wall/locator.h"

namespace wireplan::simulate {

/// Rows of a square table belong to vertices and are freed for others where none of the feet needs
/// them; where all are needed the table grows. What was not asked for yet is NaN.
class ComplianceTable {
 public:
  static constexpr int kNoRow = -1;
  using Rows = std::array<int, 3>;  // of a foot's vertices; kNoRow: without a foot

  /// Rows for the vertices of all feet.
  void take(const WallCompliance& wall, const std::vector<SurfacePoint>& feet);
  const Rows& rows_of(std::size_t foot) const { return foot_rows_[foot]; }
  /// By how much one foot gives way under a unit force at the other [mm/N].
  double between(const Rows& one, const Vec3& weight, const Rows& other, const Vec3& other_weight);
  /// The same between the vertices of both, which between() has asked for.
  double entry(int row, int column) const {
    return values_[static_cast<std::size_t>(row) * side_ + static_cast<std::size_t>(column)];
  }

 private:
  int row_of(const WallCompliance& wall, int vertex, const std::vector<SurfacePoint>& feet);
  void free_rows(const std::vector<SurfacePoint>& feet);
  void grow();
  void find_entry(int row, int column);
  double& at(int row, int column) {
    return values_[static_cast<std::size_t>(row) * side_ + static_cast<std::size_t>(column)];
  }

  static constexpr std::size_t kSmallest = 300;
  std::size_t side_ = 0;
  std::vector<double> values_;  // side_ squared                                       [mm/N]
  std::vector<int> row_;        // of each of the wall's vertices, or kNoRow
  std::vector<int> vertex_;     // of each row; meaningless where it is free
  std::vector<const WallCompliance::HalfResponse*> half_;  // of each row
  std::vector<int> free_rows_;
  std::vector<char> needed_;  // rows; scratch
  std::vector<Rows> foot_rows_;
};

}  // namespace wireplan::simulate
