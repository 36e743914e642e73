#pragma once
/// Linear algebra by other factorisations than those under test. Compiled once: Eigen's general
/// ones take ten seconds each.
#include <Eigen/SparseCore>
#include <memory>

namespace wireplan::simulate {

/// Sparse LU.
class SparseFactors {
 public:
  explicit SparseFactors(const Eigen::SparseMatrix<double>& matrix);
  ~SparseFactors();
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;

 private:
  struct Held;
  std::unique_ptr<Held> held_;
};

/// By LU with full pivoting.
Eigen::VectorXd solve_dense(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& b);

bool is_positive_definite(const Eigen::MatrixXd& symmetric);

double smallest_eigenvalue(const Eigen::MatrixXd& symmetric);

}  // namespace wireplan::simulate
