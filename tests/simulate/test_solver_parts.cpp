// What the solver is made of: terms that are absent, the pass over the wire, block-banded matrices.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include "simulate/equilibrium/dynamics.h"
#include "simulate/equilibrium/elements.h"
#include "simulate/equilibrium/solver.h"
#include "simulate/insertion/scene.h"
#include "tests/shapes.h"
#include "tests/simulate/direct_solvers.h"
#include "tests/simulate/paper_wire.h"
#include "tests/simulate/random_values.h"

namespace wireplan::simulate {
namespace {

/// A straight round wire between clamps, the distal one turned round and moved aside: no loads.
struct Bare {
  Rod rod = build_rod(paper_wire(), 40.0, 20);
  RodState state = straight_state(rod, Vec3::Zero(), Vec3::UnitX(), 0.0);
  Eigen::Matrix3Xd load;
  Problem problem;

  Bare() {
    problem.rod = &rod;
    problem.last = rod.nodes();
    const EndSupport clamp{.hold_along = true,
                           .hold_across = true,
                           .hold_roll = true,
                           .axis = Vec3::UnitX(),
                           .tangent = Vec3(Vec3::UnitX())};
    problem.proximal = problem.distal = clamp;
    problem.distal.tangent = Vec3(-0.6, 0.8, 0.0);
    for (int i = 0; i < rod.nodes(); ++i) {
      state.x(1, i) = 0.3 * i;
      state.x(2, i) = std::sin(0.2 * i);
      state.x(0, i) *= 0.8;
    }
  }
  Bare(const Bare&) = delete;
  Bare& operator=(const Bare&) = delete;
};

const double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Spoils all that a term depends on and a bare wire does not; and puts the term in.
struct Poison {
  const char* term;
  void (*spoil)(Bare&);
  void (*put_in)(Bare&);
};

const Poison kPoisons[] = {
    {"gravity", [](Bare& b) { b.rod.mass.fill(kNaN); },
     [](Bare& b) {
       b.load = Vec3(0.0, -9810.0, 0.0) * b.rod.mass.transpose();
       b.problem.load = &b.load;
     }},
    {"twist",
     [](Bare& b) {
       b.rod.twist.fill(kNaN);
       b.state.theta.fill(kNaN);
       b.state.director.fill(kNaN);
       b.state.reference_twist.fill(kNaN);
     },
     [](Bare& b) { b.rod.twisted = true; }},
    {"rest bend",
     [](Bare& b) {
       b.rod.rest_angle.fill(kNaN);
       b.rod.proximal_rest_angle = b.rod.distal_rest_angle = kNaN;
     },
     [](Bare& b) { b.rod.twisted = true; }},
    {"strip",
     [](Bare& b) {
       b.rod.strip.fill(kNaN);
       b.rod.proximal_strip = b.rod.distal_strip = kNaN;
     },
     [](Bare& b) { b.rod.twisted = true; }},
    {"tip moment",
     [](Bare& b) {
       b.problem.tip_moment = TipMoment{.axis = Vec3::Constant(kNaN), .size = kNaN};
       b.problem.tip_moment.reset();
       b.state.tip_angle = kNaN;
     },
     [](Bare& b) { b.problem.tip_moment = TipMoment{.axis = Vec3::UnitZ(), .size = 1.0}; }},
    {"plane",
     [](Bare& b) {
       b.problem.plane = Vec3::Constant(kNaN);
       b.problem.plane.reset();
     },
     [](Bare& b) { b.problem.plane = Vec3::Constant(kNaN); }},
    // A wall is reached through a pointer, null here, and needs these of the wire.
    {"vessel",
     [](Bare& b) {
       b.rod.radius = kNaN;
       b.rod.share.fill(kNaN);
       b.rod.tip_distance.fill(kNaN);
     },
     nullptr},
};

/// What Newton's method and the conjugate gradient make of it.
std::vector<Eigen::Matrix3Xd> solve_both(const Bare& bare) {
  RodState newton = bare.state, gradient = bare.state;
  Statics statics;
  EXPECT_TRUE(statics.solve(bare.problem, newton, {.residual_tolerance = 1e-8}).converged);
  run_conjugate_gradient(bare.problem, gradient, {.duration = 0.5});
  return {newton.x, gradient.x};
}

TEST(AbsentTerms, NothingOfThemIsRead) {
  const std::vector<Eigen::Matrix3Xd> clean = solve_both(Bare());
  ASSERT_TRUE(clean[0].allFinite() && clean[1].allFinite());
  for (const Poison& poison : kPoisons) {
    SCOPED_TRACE(poison.term);
    Bare spoiled;
    poison.spoil(spoiled);
    const std::vector<Eigen::Matrix3Xd> found = solve_both(spoiled);
    EXPECT_EQ(found[0], clean[0]);  // to the last bit
    EXPECT_EQ(found[1], clean[1]);

    // It would show: with the term there is no energy.
    if (poison.put_in == nullptr) continue;
    poison.put_in(spoiled);
    Eigen::Matrix3Xd forces(3, spoiled.rod.nodes());
    EXPECT_TRUE(std::isnan(Statics::evaluate(spoiled.problem, spoiled.state, forces).total()));
  }
}

/// Gradient and dense Hessian over the x of all nodes, element by element.
struct ElementSink {
  static constexpr bool kHessian = true;
  Eigen::VectorXd g;
  Eigen::MatrixXd H;

  explicit ElementSink(int n)
      : g(Eigen::VectorXd::Zero(3 * n)), H(Eigen::MatrixXd::Zero(3 * n, 3 * n)) {}
  void gradient(int i, const Vec3& v) { g.segment<3>(3 * i) += v; }
  void hessian_scaled_identity(int i, int j, double v) {
    H.block<3, 3>(3 * i, 3 * j) += v * Mat3::Identity();
    if (i != j) H.block<3, 3>(3 * j, 3 * i) += v * Mat3::Identity();
  }
  void hessian_of_edge(int i, const Mat3& v) {
    for (const int a : {i, i + 1}) {
      for (const int b : {i, i + 1}) H.block<3, 3>(3 * a, 3 * b) += a == b ? v : Mat3(-v);
    }
  }
};

TEST(WirePass, SumsWhatTheElementsAreOneByOne) {
  // A wire of unequal elements with a curved tip, anyhow; all of it free, or not its ends.
  const Wire wire = {.name = "",
                     .radius = 0.4,
                     .sections = {{.length = 9.0, .bending_stiffness = 4.0, .rest_curvature = 0.1},
                                  {.length = 30.0, .bending_stiffness = 80.0}}};
  std::mt19937_64 random(8);
  Eigen::VectorXd edges(12);
  for (double& edge : edges) edge = 2.0 + uniform(random);
  const Rod rod = build_rod(wire, edges);
  ASSERT_TRUE(rod.twisted);
  const int n = rod.nodes();
  RodState state = straight_state(rod, Vec3::Zero(), Vec3::UnitZ(), 0.0);
  for (double& x : state.x.reshaped()) x += 0.3 * uniform(random);
  Problem problem;
  problem.rod = &rod;
  WirePass pass;
  for (const auto& [first, last] :
       {std::pair{0, n}, {1, n}, {2, n}, {7, n}, {0, n - 1}, {3, 6}, {n - 1, n}, {0, 1}, {5, 6}}) {
    SCOPED_TRACE(std::to_string(first) + " to " + std::to_string(last));
    problem.first = first;
    problem.last = last;
    ElementSink sum(n);
    double stretch = 0.0, bend = 0.0;
    for (int i = std::max(0, first - 1); i <= std::min(n - 2, last - 1); ++i) {
      stretch += add_stretch(problem, state, i, sum);
    }
    for (int i = std::max(1, first - 1); i <= std::min(n - 2, last); ++i) {
      bend += add_bend(problem, state, i, sum);
    }
    const int count = last - first;
    Eigen::VectorXd gradient = Eigen::VectorXd::Ones(4 * count);  // it adds to what is there
    const WirePass::Energy energy = pass.add_gradient<4>(rod, first, last, state.x, gradient);
    BlockBand<4> band;
    band.reset(count);
    pass.set_hessian(band);

    EXPECT_NEAR(energy.stretch, stretch, 1e-12 * stretch);
    EXPECT_NEAR(energy.bend, bend, 1e-12 * bend);
    const double force = sum.g.norm(), stiffness = sum.H.norm();
    EXPECT_GT(force, 1.0);
    for (int k = 0; k < count; ++k) {
      const int i = first + k;
      EXPECT_LT((gradient.segment<3>(4 * k) - Vec3::Ones() - sum.g.segment<3>(3 * i)).norm(),
                1e-12 * force);
      EXPECT_EQ(gradient[4 * k + 3], 1.0);
      for (int j = 0; j <= std::min(2, k); ++j) {
        const auto& block = j == 0 ? band.own(k) : j == 1 ? band.one(k) : band.two(k);
        const Mat3 found = block.topLeftCorner<3, 3>();
        EXPECT_LT((found - sum.H.block<3, 3>(3 * i, 3 * (i - j))).norm(), 1e-12 * stiffness);
        EXPECT_EQ(block.row(3).norm() + block.col(3).norm(), 0.0);
      }
    }
  }
}

/// A random diagonally dominant matrix of n blocks, twice. The last unknown of the first `narrow`
/// blocks, and of those from `narrow_again` on, couples with nothing.
template <int D>
void fill_at_random(int n, int narrow, int narrow_again, BlockBand<D>& band,
                    Eigen::MatrixXd& dense) {
  using Block = Eigen::Matrix<double, D, D>;
  std::mt19937_64 random(6);
  dense = Eigen::MatrixXd::Zero(D * n, D * n);
  const auto is_narrow = [&](int i) { return i < narrow || i >= narrow_again; };
  band.reset(n, narrow, narrow_again);
  for (int i = 0; i < n; ++i) {
    for (int j = std::max(0, i - 2); j <= i; ++j) {
      Block block;
      for (int k = 0; k < D * D; ++k) block(k / D, k % D) = uniform(random);
      if (i == j) block = (block + block.transpose() + 4.0 * D * Block::Identity()).eval();
      if (is_narrow(i)) block.row(D - 1).setZero();
      if (is_narrow(j)) block.col(D - 1).setZero();
      if (i == j && is_narrow(i)) block(D - 1, D - 1) = 1.0;
      dense.template block<D, D>(D * i, D * j) = block;
      dense.template block<D, D>(D * j, D * i) = block.transpose();
      (i == j ? band.own(i) : i == j + 1 ? band.one(i) : band.two(i)) = block;
    }
  }
}

TEST(BlockBand, SolvesWhatADenseFactorisationSolves) {
  const int n = 7;
  BlockBand<3> band, factors;
  Eigen::MatrixXd dense;
  fill_at_random(n, 0, n, band, dense);
  for (const double shift : {0.0, 2.0}) {
    Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(3 * n, -1.0, 1.0), x = b;
    ASSERT_TRUE(factors.factor(band, shift));
    factors.solve(x);
    EXPECT_LT((dense * x + shift * x - b).norm(), 1e-12) << shift;
  }
}

TEST(BlockBand, LeavesOutTheLastUnknownOfNarrowRowsAndSolvesByHalves) {
  const int n = 9;
  const std::vector<std::pair<int, int>> ends = {{1, n}, {2, n}, {3, n}, {6, n}, {9, n},
                                                 {0, 1}, {0, 4}, {2, 4}, {3, 7}, {3, 8}};
  for (const auto& [narrow, again] : ends) {
    SCOPED_TRACE(testing::Message() << narrow << " and from " << again << " on");
    BlockBand<4> matrix, band;
    Eigen::MatrixXd dense;
    fill_at_random(n, narrow, again, matrix, dense);
    Eigen::MatrixXd b = Eigen::MatrixXd::NullaryExpr(4 * n, 3, [](Eigen::Index i, Eigen::Index k) {
      return std::sin(1.0 + static_cast<double>(i * (k + 1)));
    });
    for (int i = 0; i < n; ++i) {
      if (i < narrow || i >= again) b.row(4 * i + 3).setZero();
    }
    Eigen::MatrixXd x = b;
    ASSERT_TRUE(band.factor(matrix));
    band.solve_lower<2>({x.col(0).data(), x.col(1).data()});
    band.solve_lower<1>({x.col(2).data()});
    const Eigen::MatrixXd half = x;
    // L^-1 b of the last one from the first row on that it is not 0 in.
    Eigen::VectorXd late = Eigen::VectorXd::Zero(4 * n);
    late.tail(8) = b.col(2).tail(8);
    Eigen::VectorXd from_there = late, all = late;
    band.solve_lower<1>({from_there.data()}, n - 2);
    band.solve_lower<1>({all.data()});
    EXPECT_EQ(from_there, all);
    // b' A^-1 b needs the first half alone.
    Eigen::MatrixXd part = x;
    for (int k = 0; k < 3; ++k) band.divide_by_pivots(part.col(k));
    for (int k = 0; k < 3; ++k) band.solve_upper(x.col(k));
    EXPECT_LT((dense * x - b).norm(), 1e-12);
    EXPECT_LT((half.transpose() * part - b.transpose() * x).norm(), 1e-12);
  }
}

TEST(BlockBand, FindsThatAMatrixIsNotPositiveDefinite) {
  BlockBand<3> band, factors;
  band.reset(2);
  band.own(0) = band.own(1) = Mat3::Identity();
  band.one(1) = 1.5 * Mat3::Identity();
  UnsymmetricBand unsymmetric;
  unsymmetric.take(band);
  EXPECT_FALSE(factors.factor(band));
  EXPECT_TRUE(factors.factor(band, 1.0));
  EXPECT_FALSE(unsymmetric.factor());
}

TEST(UnsymmetricBand, SolvesWhatADenseFactorisationSolves) {
  for (const int n : {1, 2, 3, 9}) {
    SCOPED_TRACE(n);
    BlockBand<3> symmetric;
    Eigen::MatrixXd dense;
    fill_at_random(n, 0, n, symmetric, dense);
    UnsymmetricBand band;
    band.take(symmetric);
    std::mt19937_64 random(7);
    for (int i = 0; i < n; ++i) {
      for (int j = std::max(0, i - 1); j <= std::min(n - 1, i + 1); ++j) {
        const Mat3 more = Mat3::NullaryExpr([&] { return uniform(random); });
        band.at(i, j).topRows<3>() += more;
        dense.block<3, 3>(3 * i, 3 * j) += more;
      }
    }
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(3 * n, -1.0, 1.0);
    Eigen::VectorXd x = b;
    ASSERT_TRUE(band.factor());
    band.solve(x);
    EXPECT_LT((dense * x - b).norm(), 1e-12);
  }
}

TEST(UnsymmetricBand, KeepsSoftDirectionsBesideStiffOnes) {
  // A chain that is 1e8 times as stiff along its edges, which turn from one to the next, as across.
  constexpr int kBlocks = 20;
  constexpr double kStiff = 1e6, kSoft = 1e-2;
  BlockBand<3> symmetric;
  symmetric.reset(kBlocks);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * kBlocks, 3 * kBlocks);
  for (int i = 0; i < kBlocks; ++i) {
    const Vec3 t(std::cos(0.1 * i), std::sin(0.1 * i), 0.0);
    const Mat3 K = kSoft * Mat3::Identity() + kStiff * t * t.transpose();
    symmetric.own(i) += K;
    dense.block<3, 3>(3 * i, 3 * i) += K;
    if (i == 0) continue;
    symmetric.own(i - 1) += K;
    symmetric.one(i) -= K;
    dense.block<3, 3>(3 * i - 3, 3 * i - 3) += K;
    dense.block<3, 3>(3 * i, 3 * i - 3) -= K;
    dense.block<3, 3>(3 * i - 3, 3 * i) -= K;
  }
  UnsymmetricBand band;
  band.take(symmetric);
  band.at(4, 5)(2, 0) += 1e-3;
  dense(3 * 4 + 2, 3 * 5) += 1e-3;
  const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(3 * kBlocks, -1.0, 1.0);
  Eigen::VectorXd x = b;
  ASSERT_TRUE(band.factor());
  band.solve(x);
  const Eigen::VectorXd known = solve_dense(dense, b);
  EXPECT_GT(known.norm(), 1e4);
  EXPECT_LT((x - known).norm(), 1e-6 * known.norm());
}

}  // namespace
}  // namespace wireplan::simulate
