// The chain of cross-sections by itself: weights, energy, and what loads move.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "simulate/wall/section_chain.h"
#include "tests/simulate/random_values.h"

namespace wireplan::simulate {
namespace {

using preprocess::Branch;

constexpr double kRadius = 5.0, kLength = 120.0;  // mm

Centerline line_of(const std::function<Vec3(double)>& place, double length, double radius) {
  const int points = static_cast<int>(std::lround(length / 0.5)) + 1;
  Centerline line;
  line.points.resize(3, points);
  line.radius.setConstant(points, radius);
  for (int k = 0; k < points; ++k) {
    line.points.col(k) = place(length * k / (points - 1));
  }
  line.arc_length = arc_length_of(line.points);
  return line;
}

std::vector<Branch> straight_vessel(double length = kLength) {
  return {{.line = line_of([](double s) { return Vec3(0.0, 0.0, s); }, length, kRadius)}};
}

/// A trunk that ends in two limbs, which its end node carries.
std::vector<Branch> fork() {
  std::vector<Branch> tree = {
      {.line = line_of([](double s) { return Vec3(0.0, 0.0, s); }, 60.0, kRadius)}};
  for (const double side : {-1.0, 1.0}) {
    const Vec3 away = Vec3(0.5 * side, 0.0, std::sqrt(0.75));
    tree.push_back({.line = line_of([&](double s) { return Vec3(Vec3(0.0, 0.0, 60.0) + s * away); },
                                    60.0, kRadius),
                    .parent = 0,
                    .parent_arc = 60.0});
  }
  return tree;
}

Eigen::MatrixXd dense_stiffness(const SectionChain& chain) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(3 * chain.nodes(), 3 * chain.nodes());
  for (const SectionChain::Block& block : chain.stiffness()) {
    A.block<3, 3>(3 * block.i, 3 * block.j) = block.value;
    A.block<3, 3>(3 * block.j, 3 * block.i) = block.value.transpose();
  }
  return A;
}

/// Forces on the nodes of a load per length along a line, in steps of 0.1 mm.
Eigen::Matrix3Xd spread_load(const SectionChain& chain, const Centerline& line,
                             const std::function<Vec3(double)>& load) {
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, chain.nodes());
  std::vector<SectionChain::Weight> weights;
  const double length = line.arc_length[line.arc_length.size() - 1];
  const int steps = static_cast<int>(std::lround(10.0 * length));
  for (int k = 0; k < steps; ++k) {
    const double arc = (k + 0.5) * length / steps, part = arc / length;
    const Eigen::Index last = line.points.cols() - 1;
    const auto at = static_cast<Eigen::Index>(std::floor(part * static_cast<double>(last)));
    const double rest = part * static_cast<double>(last) - static_cast<double>(at);
    chain.find_weights(
        (1.0 - rest) * line.points.col(at) + rest * line.points.col(std::min(at + 1, last)), false,
        weights);
    for (const auto& weight : weights) {
      force.col(weight.node) += (weight.value * length / steps) * load(arc);
    }
  }
  return force;
}

Eigen::Matrix3Xd displacements(const SectionChain& chain, const Eigen::Matrix3Xd& force) {
  const Eigen::VectorXd u = dense_stiffness(chain).llt().solve(Eigen::VectorXd(force.reshaped()));
  return u.reshaped(3, chain.nodes());
}

TEST(SectionChain, WeightsAreOfSumOneAndTwiceDifferentiable) {
  const SectionChain chain(fork(), {.support = 1e-3});
  std::mt19937_64 random(5);
  std::vector<SectionChain::Weight> weights, ahead, behind;
  int checked = 0;
  for (int sample = 0; sample < 200; ++sample) {
    const Vec3 place(20.0 * uniform(random), 6.0 * uniform(random), 60.0 + 55.0 * uniform(random));
    chain.find_weights(place, true, weights);
    double sum = 0.0;
    Vec3 slope = Vec3::Zero();
    for (const auto& weight : weights) {
      sum += weight.value;
      slope += weight.slope;
      EXPECT_GT(weight.value, 0.0);
    }
    EXPECT_NEAR(sum, 1.0, 1e-14);
    EXPECT_LT(slope.norm(), 1e-14);
    const auto of = [](const std::vector<SectionChain::Weight>& list, int node) {
      for (const auto& weight : list) {
        if (weight.node == node) return weight;
      }
      return SectionChain::Weight{node, 0.0, Vec3::Zero(), Mat3::Zero()};
    };
    constexpr double kStep = 1e-4;  // mm; leaves 1e-8 of third derivatives
    for (int d = 0; d < 3; ++d) {
      chain.find_weights(place + kStep * Vec3::Unit(d), true, ahead);
      chain.find_weights(place - kStep * Vec3::Unit(d), true, behind);
      for (const auto& weight : weights) {
        const auto a = of(ahead, weight.node), b = of(behind, weight.node);
        EXPECT_NEAR((a.value - b.value) / (2.0 * kStep), weight.slope[d], 1e-7);
        EXPECT_LT(((a.slope - b.slope) / (2.0 * kStep) - weight.bend.col(d)).norm(), 1e-6);
        checked += weight.bend.norm() > 1e-4 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(checked, 1000);
}

TEST(SectionChain, TranslationCostsTheSupportAlone) {
  const SectionChain chain(straight_vessel(), {.support = 2e-3, .young_modulus = 0.5});
  const Vec3 moved(1.0, -2.0, 3.0);
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, chain.nodes());
  const double energy = chain.energy(moved.replicate(1, chain.nodes()), gradient);
  const double support = kPi * kRadius * 2e-3 * kLength;
  EXPECT_NEAR(energy, 0.5 * support * moved.squaredNorm(), 1e-10 * energy);
  EXPECT_LT((gradient.rowwise().sum() - support * moved).norm(), 1e-10 * support);
}

TEST(SectionChain, EnergyHasItsGradient) {
  const SectionChain chain(fork(), {.support = 2e-3, .young_modulus = 0.5});
  std::mt19937_64 random(7);
  Eigen::Matrix3Xd u(3, chain.nodes()), gradient = Eigen::Matrix3Xd::Zero(3, chain.nodes());
  for (double& value : u.reshaped()) value = uniform(random);
  chain.energy(u, gradient);
  for (int k = 0; k < u.size(); ++k) {
    Eigen::Matrix3Xd unused = Eigen::Matrix3Xd::Zero(3, chain.nodes()), ahead = u, behind = u;
    ahead.reshaped()[k] += 1e-3;
    behind.reshaped()[k] -= 1e-3;
    const double slope = (chain.energy(ahead, unused) - chain.energy(behind, unused)) / 2e-3;
    EXPECT_NEAR(slope, gradient.reshaped()[k], 1e-9);  // a quadratic: rounding alone
  }
  EXPECT_GT(gradient.norm(), 0.1);
}

TEST(SectionChain, UniformSideLoadMovesAStraightTubeByLoadOverSupport) {
  const std::vector<Branch> tree = straight_vessel();
  const SectionChain chain(tree, {.support = 1e-3, .young_modulus = 0.5});
  const double load = 0.02;  // N/mm
  const Eigen::Matrix3Xd u = displacements(
      chain, spread_load(chain, tree[0].line, [&](double) { return Vec3(load, 0.0, 0.0); }));
  const double expected = load / (kPi * kRadius * 1e-3);
  for (double z = 0.0; z <= kLength; z += 3.0) {
    // The energy is summed in steps of 2 mm, the load in steps of 0.1 mm.
    EXPECT_NEAR(chain.displacement(Vec3(0.0, 0.0, z), u)[0], expected, 2e-3 * expected) << z;
  }
}

TEST(SectionChain, LimbsOfABifurcationBalanceTheForceOnIt) {
  const std::vector<Branch> tree = fork();
  const SectionChainOptions options{.support = 1e-3, .young_modulus = 2.0};
  const SectionChain chain(tree, options);
  const Vec3 force(0.0, 1.0, 0.3), place(0.0, 0.0, 60.0);
  std::vector<SectionChain::Weight> weights;
  chain.find_weights(place, false, weights);
  Eigen::Matrix3Xd on_nodes = Eigen::Matrix3Xd::Zero(3, chain.nodes());
  for (const auto& weight : weights) on_nodes.col(weight.node) = weight.value * force;
  const Eigen::Matrix3Xd u = displacements(chain, on_nodes);
  // What the support of each limb carries; a limb has none of its own inside its parent.
  std::vector<Vec3> carried;
  for (const Branch& branch : tree) {
    Vec3 sum = Vec3::Zero();
    for (Eigen::Index k = 0; k + 1 < branch.line.points.cols(); ++k) {
      const Vec3 middle = 0.5 * (branch.line.points.col(k) + branch.line.points.col(k + 1));
      const double arc = 0.5 * (branch.line.arc_length[k] + branch.line.arc_length[k + 1]);
      if (branch.parent >= 0 && arc < kRadius) continue;
      sum += 0.5 * kPi * kRadius * options.support * chain.displacement(middle, u);
    }
    carried.push_back(sum);
  }
  // Sums in steps of 0.5 mm against the chain's of 2 mm, which ends inside the parent 1 mm off.
  EXPECT_LT((carried[0] + carried[1] + carried[2] - force).norm(), 0.01);
  for (const Vec3& part : carried) EXPECT_GT(part[1], 0.15);
  EXPECT_NEAR(carried[1][1], carried[2][1], 1e-9);
  EXPECT_NEAR(carried[1][0], -carried[2][0], 1e-9);
}

TEST(SectionChain, ConvergesWithTheSpacing) {
  // Waves of 60 mm, far from the ends: along the vessel by K + EA q^2, across it by K + EI q^4.
  const std::vector<Branch> tree = straight_vessel(360.0);
  const double q = 2.0 * kPi / 60.0;
  const SectionChainOptions base{.support = 1e-3, .young_modulus = 0.5};
  const double K = kPi * kRadius * base.support,
               EA = 2.0 * kPi * kRadius * base.thickness * base.young_modulus,
               EI = 0.5 * kRadius * kRadius * EA;
  const auto error = [&](double spacing, int direction, double stiffness) {
    SectionChainOptions options = base;
    options.spacing = spacing;
    const SectionChain chain(tree, options);
    const Eigen::Matrix3Xd u =
        displacements(chain, spread_load(chain, tree[0].line, [&](double s) {
                        return Vec3(stiffness * std::cos(q * s) * Vec3::Unit(direction));
                      }));
    double worst = 0.0;
    for (double z = 150.0; z <= 210.0; z += 1.0) {
      const double here = chain.displacement(Vec3(0.0, 0.0, z), u)[direction];
      worst = std::max(worst, std::abs(here - std::cos(q * z)));
    }
    return worst;
  };
  for (const auto& [direction, stiffness] :
       {std::pair(2, K + EA * q * q), std::pair(0, K + EI * q * q * q * q)}) {
    SCOPED_TRACE(direction);
    const double coarse = error(20.0, direction, stiffness),
                 middle = error(10.0, direction, stiffness),
                 fine = error(5.0, direction, stiffness);
    std::printf("waves of 60 mm, spacings of 20, 10 and 5 mm: errors %.2e %.2e %.2e\n", coarse,
                middle, fine);
    EXPECT_LT(middle, coarse / 3.5);  // second order
    EXPECT_LT(fine, middle / 3.5);
    EXPECT_LT(fine, 0.04);
  }
}

TEST(SectionChain, PinsHoldWhatIsNearThem) {
  const std::vector<Branch> tree = straight_vessel();
  const SectionChain chain(
      tree,
      {.support = 1e-3, .young_modulus = 0.5, .pins = {{.place = Vec3::Zero(), .radius = 10.0}}});
  const Eigen::Matrix3Xd u = displacements(
      chain, spread_load(chain, tree[0].line, [](double) { return Vec3(0.02, 0.0, 0.0); }));
  const double free = 0.02 / (kPi * kRadius * 1e-3);
  EXPECT_LT(chain.displacement(Vec3::Zero(), u)[0], 0.05 * free);
  EXPECT_NEAR(chain.displacement(Vec3(0.0, 0.0, 100.0), u)[0], free, 0.02 * free);
}

TEST(SectionChain, OfSeveralPinsTheStiffestCounts) {
  const std::vector<Branch> tree = straight_vessel();
  const Pin soft{.place = Vec3::Zero(), .radius = 10.0, .factor = 5.0};
  Pin stiff = soft;
  stiff.factor = 50.0;
  const auto energy = [&](std::vector<Pin> pins) {
    const SectionChain chain(tree, {.support = 1e-3, .young_modulus = 0.5, .pins = pins});
    const Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Ones(3, chain.nodes());
    Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, chain.nodes());
    return chain.energy(u, gradient);
  };
  EXPECT_GT(energy({stiff}), 1.5 * energy({soft}));
  EXPECT_DOUBLE_EQ(energy({soft, stiff}), energy({stiff}));
  EXPECT_DOUBLE_EQ(energy({stiff, soft, soft}), energy({stiff}));
}

}  // namespace
}  // namespace wireplan::simulate
