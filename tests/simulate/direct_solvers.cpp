#include "tests/simulate/direct_solvers.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SparseLU>

namespace wireplan::simulate {

struct SparseFactors::Held {
  Eigen::SparseMatrix<double> matrix;
  Eigen::SparseLU<Eigen::SparseMatrix<double>> lu;
};

SparseFactors::SparseFactors(const Eigen::SparseMatrix<double>& matrix)
    : held_(std::make_unique<Held>()) {
  held_->matrix = matrix;
  held_->lu.compute(held_->matrix);
}

SparseFactors::~SparseFactors() = default;

Eigen::VectorXd SparseFactors::solve(const Eigen::VectorXd& b) const { return held_->lu.solve(b); }

Eigen::VectorXd solve_dense(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& b) {
  return matrix.fullPivLu().solve(b);
}

bool is_positive_definite(const Eigen::MatrixXd& symmetric) {
  return symmetric.llt().info() == Eigen::Success;
}

double smallest_eigenvalue(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(symmetric, Eigen::EigenvaluesOnly);
  return modes.eigenvalues().minCoeff();
}

}  // namespace wireplan::simulate
