#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <random>
#include <vector>

#include "simulate/contact/envelope_factor.h"
#include "simulate/wire/lanes.h"

namespace wireplan::simulate {
namespace {

/// Positive definite, 0 left of the first column of each row.
Eigen::MatrixXd random_matrix(const std::vector<int>& first, std::mt19937_64& random) {
  std::uniform_real_distribution<double> entry(-1.0, 1.0);
  const auto n = static_cast<Eigen::Index>(first.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = first[static_cast<std::size_t>(i)]; j < i; ++j) {
      matrix(i, j) = matrix(j, i) = entry(random);
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) matrix(i, i) = 1.0 + matrix.row(i).cwiseAbs().sum();
  return matrix;
}

EnvelopeFactor factor_of(const Eigen::MatrixXd& matrix, const std::vector<int>& first, bool wide) {
  EnvelopeFactor factor;
  const int n = static_cast<int>(matrix.rows());
  for (int begin = 0; begin < n; begin = factor.rows()) {
    const int end = std::min(n, begin + 4);
    factor.add_rows(*std::min_element(first.begin() + begin, first.begin() + end));
    for (int i = begin; i < end; ++i) {
      for (int j = factor.first(i); j <= i; ++j) factor.at(i, j) = matrix(i, j);
    }
    for (int i = end; i < factor.rows(); ++i) factor.at(i, i) = 1.0;
  }
  factor.factor(wide);
  return factor;
}

/// Up to eight columns before the diagonal, and now and then all of them.
std::vector<int> random_envelope(int rows, std::mt19937_64& random) {
  std::vector<int> first;
  for (int i = 0; i < rows; ++i) {
    const int reach = static_cast<int>(random() % 9);
    first.push_back(random() % 11 == 0 ? 0 : std::max(0, i - reach));
  }
  return first;
}

std::vector<double> solution(const EnvelopeFactor& factor, const Eigen::VectorXd& right,
                             bool wide) {
  std::vector<double> x(static_cast<std::size_t>(factor.rows()), 0.0);
  std::copy(right.data(), right.data() + right.size(), x.begin());
  factor.solve(x.data(), wide);
  return x;
}

TEST(EnvelopeFactor, SolvesAndInvertsAsDenseMatricesDo) {
  std::mt19937_64 random(5);
  for (int n = 0; n < 40; ++n) {
    const std::vector<int> first = random_envelope(n, random);
    const Eigen::MatrixXd matrix = random_matrix(first, random);
    EnvelopeFactor factor = factor_of(matrix, first, false);
    const Eigen::VectorXd right = Eigen::VectorXd::Random(n);
    const std::vector<double> x = solution(factor, right, false);
    const Eigen::Map<const Eigen::VectorXd> found(x.data(), n);
    if (n > 0) {
      EXPECT_LT((matrix * found - right).cwiseAbs().maxCoeff(), 1e-13) << n << " rows";
    }
    factor.invert();
    const Eigen::MatrixXd inverse = matrix.inverse();
    for (int i = 0; i < n; ++i) {
      for (int j = factor.first(i); j <= i; ++j) {
        EXPECT_NEAR(factor.inverse(i, j), inverse(i, j), 1e-13) << n << ": " << i << ", " << j;
      }
    }
  }
}

TEST(EnvelopeFactor, IsTheSameToTheBitInWideRegisters) {
  if (!has_wide_registers()) GTEST_SKIP() << "this processor has no registers of four numbers";
  std::mt19937_64 random(6);
  for (int n = 1; n < 60; ++n) {
    const std::vector<int> first = random_envelope(n, random);
    const Eigen::MatrixXd matrix = random_matrix(first, random);
    EnvelopeFactor narrow = factor_of(matrix, first, false), wide = factor_of(matrix, first, true);
    for (int i = 0; i < n; ++i) {
      for (int j = narrow.first(i); j <= i; ++j) EXPECT_EQ(narrow.at(i, j), wide.at(i, j));
    }
    const Eigen::VectorXd right = Eigen::VectorXd::Random(n);
    EXPECT_EQ(solution(narrow, right, false), solution(narrow, right, true)) << n << " rows";
  }
}

WIREPLAN_WIDE double wide_dot(const double* a, const double* b, std::size_t n) {
  return lanes::dot(a, b, n);
}
WIREPLAN_WIDE void wide_add(double s, const double* x, double* y, std::size_t n) {
  lanes::add_scaled(s, x, y, n);
}

TEST(Lanes, GiveTheSameBitsInWideAndInNarrowRegisters) {
  if (!has_wide_registers()) GTEST_SKIP() << "this processor has no registers of four numbers";
  for (Eigen::Index n = 0; n < 40; ++n) {
    const Eigen::VectorXd a = Eigen::VectorXd::Random(n), b = Eigen::VectorXd::Random(n);
    const auto count = static_cast<std::size_t>(n);
    EXPECT_EQ(lanes::dot(a.data(), b.data(), count), wide_dot(a.data(), b.data(), count));
    EXPECT_NEAR(lanes::dot(a.data(), b.data(), count), a.dot(b), 1e-14);
    Eigen::VectorXd narrow = b, wide = b;
    lanes::add_scaled(0.3, a.data(), narrow.data(), count);
    wide_add(0.3, a.data(), wide.data(), count);
    EXPECT_EQ(narrow, wide);
    EXPECT_EQ(narrow, b + 0.3 * a);
  }
}

}  // namespace
}  // namespace wireplan::simulate
