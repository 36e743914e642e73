#pragma once
/// Contact points on a wall that yields: their forces couple through the wall (compliance.h).
#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulate/contact/contact_law.h"
#include "simulate/wall/compliance.h"
#include "simulate/wall/locator.h"

namespace wireplan::simulate {

/// Forces f >= 0 of m points with gaps g to the resting wall, where the wall gives way by w = C f
/// and each force follows the contact law at the gap g + w: the minimum over w of the energy of law
/// and wall. The matrices are kept by rows within an envelope: the wall yields near a force alone,
/// and neighbours along the wire are neighbours on the wall. Memory only ever grows.
class Yielding {
 public:
  /// Where the points' forces act, in the order of the wire; finds C.
  void set_feet(const WallCompliance& wall, const std::vector<SurfacePoint>& feet);
  int size() const { return compliance_.size(); }

  /// Finds the forces, starting from what they are, and w; `share` is each point's length of wire
  /// [mm]. All of size(). Returns the energy of the contact law [N mm].
  double solve(const ContactLaw& law, const Eigen::VectorXd& gap, const Eigen::VectorXd& share,
               Eigen::VectorXd& force, Eigen::VectorXd& w);

  /// S = -d force / d gap = (C + 1/law's stiffness)^-1 where solve() ended [N/mm]: its entries
  /// within the envelope, which find_stiffness() fills, and all of it as a product in place.
  void find_stiffness(const Eigen::VectorXd& law_stiffness);
  double stiffness(int i, int j) const;  // j <= i; 0 beyond the envelope
  int first_coupled(int i) const { return compliance_.first(i); }
  void multiply_by_stiffness(Eigen::VectorXd& v);

  /// How C changes as the points move along the wall: `slopes` of each foot's weights over the
  /// motion of its point (TriangleLocator::weight_slopes), of those that set_feet() had.
  void find_slopes(const std::vector<SurfacePoint>& feet, const std::vector<Mat3>& slopes);
  /// Adds (dC) f to `w`, for motions (3, m) of the points.
  void add_change_of_compliance(const Eigen::Matrix3Xd& motion, const Eigen::VectorXd& f,
                                Eigen::VectorXd& w) const;

 private:
  /// Lower triangle of a symmetric matrix, row i from column first(i) on.
  class Envelope {
   public:
    void clear();
    /// One more row of zeros.
    void add_row(int first);
    int size() const { return static_cast<int>(first_.size()); }
    std::size_t entries() const { return values_.size(); }
    int first(int i) const { return first_[static_cast<std::size_t>(i)]; }
    /// Row i, indexed by column.
    double* row(int i) { return values_.data() + offset(i); }
    const double* row(int i) const { return values_.data() + offset(i); }
    /// Place of column 0 of row i among the entries, were it there.
    std::ptrdiff_t offset(int i) const { return offset_[static_cast<std::size_t>(i)]; }

   private:
    std::vector<int> first_;
    std::vector<std::ptrdiff_t> offset_;
    std::vector<double> values_;
  };
  /// Row of a vertex in the table, which it enters if it is new. Where the table is full, rows of
  /// vertices that none of the feet needs are freed; where there are none, the table grows.
  int row_of(const WallCompliance& wall, int vertex, const std::vector<SurfacePoint>& feet);
  void free_rows(const std::vector<SurfacePoint>& feet);
  void grow();
  /// Whether both points have feet, near enough to each other to feel each other's forces.
  bool may_couple(std::size_t i, std::size_t j) const {
    if (foot_rows_[i][0] == kNoRow || foot_rows_[j][0] == kNoRow) return false;
    const auto from = foot_place_.col(static_cast<Eigen::Index>(i));
    const auto to = foot_place_.col(static_cast<Eigen::Index>(j));
    return (from - to).squaredNorm() <= squared_reach_;
  }
  /// Has the table know the compliance between the vertices of two rows.
  void find_entry(int a, int b);
  double& entry(int a, int b) {
    return table_[static_cast<std::size_t>(a) * table_side_ + static_cast<std::size_t>(b)];
  }
  void multiply_by_compliance(const Eigen::VectorXd& f, Eigen::VectorXd& w) const;
  /// Of I + D^1/2 C D^1/2, D the law's stiffness. Points with none have rows and columns of the
  /// identity, which are left out.
  void factor();
  void solve_factored(Eigen::VectorXd& v);

  /// Which of the feet before each of these is, in the same place; -1: none. Both are in the order
  /// of the wire.
  void find_known(const std::vector<SurfacePoint>& feet);

  /// Compliances between the vertices that feet stood on lately, NaN where not asked for yet.
  static constexpr std::size_t kSmallestTable = 300;
  static constexpr int kNoRow = -1;
  std::size_t table_side_ = 0;
  std::vector<double> table_;  // table_side_ squared                        [mm/N]
  std::vector<int> row_;       // of each of the wall's vertices in the table, or kNoRow
  std::vector<int> vertex_;    // of each row; meaningless where it is free
  std::vector<const WallCompliance::HalfResponse*> half_;  // of each row
  std::vector<int> free_rows_;
  std::vector<char> needed_;                   // rows; scratch
  std::vector<std::array<int, 3>> foot_rows_;  // kNoRow: without a foot
  Eigen::Matrix3Xd foot_place_;                // a vertex under each                  [mm]
  double squared_reach_ = 0.0;                 // of the wall                        [mm^2]
  std::vector<SurfacePoint> feet_;             // of `compliance_`
  std::vector<int> known_;                     // see find_known()

  Envelope compliance_, factor_, inverse_;  // of all points; of those with a stiff law
  Envelope before_;                         // the compliance of the feet before; scratch
  std::vector<int> stiff_, place_;          // those, in order; the place of each point there, or -1
  std::vector<double> reciprocal_;          // of the factor's diagonal
  std::vector<int> last_coupled_;           // of the factor: last row with an entry in each column
  std::vector<Eigen::Matrix<double, 3, 2>> slope_;  // of each entry of C, over either motion
  Eigen::VectorXd root_;                            // D^1/2
  Eigen::VectorXd lawful_, residual_, step_, stiff_values_;
};

}  // namespace wireplan::simulate
