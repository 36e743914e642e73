#pragma once
/// Contact points on a wall that yields: their forces couple through the wall (compliance.h).
#include <Eigen/Core>
#include <vector>

#include "simulate/contact/compliance_table.h"
#include "simulate/contact/contact_law.h"
#include "simulate/contact/envelope_factor.h"
#include "simulate/wall/compliance.h"
#include "simulate/wall/locator.h"

namespace wireplan::simulate {

/// Forces f >= 0 of m points with gaps g to the resting wall, where the wall gives way by w = C f
/// and each force follows the contact law at the gap g + w: the minimum over w of the energy of law
/// and wall. The matrices are kept within an envelope: the wall yields near a force alone, and
/// neighbours along the wire are neighbours on the wall. Memory only ever grows.
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
  /// S by the points that the law presses, in order; entries of others are 0.
  const std::vector<int>& pressed() const { return pressed_; }
  int first_pressed(int p) const { return factor_.first(p); }  // with which the p-th may couple
  double pressed_stiffness(int p, int q) const {               // q <= p, from the first on
    return root_[pressed_[static_cast<std::size_t>(p)]] * factor_.inverse(p, q) *
           root_[pressed_[static_cast<std::size_t>(q)]];
  }

  /// How C f changes as the points move along the wall: `slopes` of each foot's weights over the
  /// motion of its point (TriangleLocator::weight_slopes), of those that set_feet() had.
  void find_slopes(const std::vector<SurfacePoint>& feet, const std::vector<Mat3>& slopes,
                   const Eigen::VectorXd& f);
  /// Adds (dC) f to `w`, for motions (3, m) of the points.
  void add_change_of_compliance(const Eigen::Matrix3Xd& motion, Eigen::VectorXd& w) const;

 private:
  /// A symmetric matrix, of which row i has the columns from the first that it couples with to the
  /// last.
  class Envelope {
   public:
    struct Row {
      int first;
      std::size_t size, offset;  // of `first` among the values
    };
    /// Of zeros, from the first column of each row, none beyond its diagonal.
    void reset(const std::vector<int>& first);
    int size() const { return static_cast<int>(rows_.size()); }
    int first(int i) const { return rows()[i].first; }
    const Row* rows() const { return rows_.data(); }
    const double* values() const { return values_.data(); }
    /// Row i, indexed by column.
    double* row(int i) { return values_.data() + begin(i); }
    const double* row(int i) const { return values_.data() + begin(i); }

   private:
    std::ptrdiff_t begin(int i) const {  // of column 0, were it there
      return static_cast<std::ptrdiff_t>(rows()[i].offset) - first(i);
    }
    std::vector<Row> rows_;
    std::vector<int> end_;  // scratch
    std::vector<double> values_;
  };
  /// Round the vertices under eight feet, to pass by those that are far away.
  struct Box {
    Vec3 low, high;
  };

  /// Whether both points have feet, near enough to each other to feel each other's forces.
  bool may_couple(std::size_t i, std::size_t j) const;
  bool may_couple(std::size_t i, const Box& box) const;
  double compliance_between(const std::vector<SurfacePoint>& feet, std::size_t i, std::size_t j);
  int find_first_coupled(const std::vector<SurfacePoint>& feet, std::size_t i);
  /// Which of the feet before each of these is, in the same place; -1: none. Both are in the order
  /// of the wire.
  void find_known(const std::vector<SurfacePoint>& feet);
  void find_boxes();
  void multiply_by_compliance(const Eigen::VectorXd& f, Eigen::VectorXd& w) const;
  /// Of I + D^1/2 C D^1/2, D the law's stiffness. Points with none have rows and columns of the
  /// identity, which are left out.
  void factor();
  void solve_factored(Eigen::VectorXd& v);

  ComplianceTable table_;
  double squared_reach_ = 0.0;      // of the wall                                     [mm^2]
  Eigen::Matrix3Xd foot_place_;     // a vertex under each                               [mm]
  std::vector<Box> boxes_;          // of feet in turn
  std::vector<SurfacePoint> feet_;  // of `compliance_`
  std::vector<int> known_;          // see find_known()

  Envelope compliance_, before_;    // C; that of the feet before
  std::vector<int> first_coupled_;  // scratch

  EnvelopeFactor factor_;       // of the points that the law presses
  std::vector<int> pressed_;    // those, in order
  std::vector<int> place_;      // of each point there, or -1
  std::vector<double> values_;  // scratch, per row of the factor
  Eigen::VectorXd root_;        // D^1/2

  // How C f changes: at each point over its own motion (3, m), and for each point with a force the
  // values of its column, times the force, over its motion's x, y and z.
  Eigen::Matrix3Xd own_slope_;
  std::vector<int> sloped_;
  std::vector<double> slopes_;
  std::vector<std::size_t> slope_offset_;

  Eigen::VectorXd lawful_, residual_, step_;
};

}  // namespace wireplan::simulate
