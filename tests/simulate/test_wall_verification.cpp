// A wire and a yielding wall as one, held against one large system of equations.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "simulate/insertion/scene.h"
#include "tests/shapes.h"
#include "tests/simulate/contact_bench.h"
#include "tests/simulate/direct_solvers.h"

namespace wireplan::simulate {
namespace {

// ---------------------------------------------------------------- wire and yielding wall as one

/// Wire and wall as one system: positions x of the nodes from 1 on, then displacements u of all
/// vertices. Energy: wire(x) + u'Ku/2 + the contact law at the gaps d(x) + c'u of the nodes, where
/// c'u is the outward displacement of the wall at the node's foot: of the vertices' displacements
/// along their normals, interpolated in the triangle. A foot moves with its node, but the wall's
/// force stays normal, so feet are held while the energy is differentiated.
class Monolith {
 public:
  Monolith(const Surface& surface, const Wall& wall, const VesselModel& vessel, Bench& wire)
      : vessel_(vessel), rod_(wire.rod), problem_(wire.problem), K_(wall_stiffness(surface, wall)) {
    problem_.contact = nullptr;
  }

  struct Solution {
    Eigen::Matrix3Xd x;     // (3, n)                                                     [mm]
    Eigen::VectorXd u;      // (3v)                                                       [mm]
    Eigen::VectorXd force;  // (n) normal                                                 [N]
    double residual = 0.0;  //                                                            [N]
  };
  /// Newton's method from the given state and a wall at rest, shortened until the energy falls.
  Solution solve(RodState state) const {
    const Eigen::Index v = K_.cols();
    Solution at;
    at.u = Eigen::VectorXd::Zero(v);
    for (int round = 0; round < 200; ++round) {
      find_feet(state);
      Eigen::VectorXd gradient;
      Eigen::SparseMatrix<double> hessian;
      differentiate(state, at, gradient, hessian);
      at.residual = gradient.cwiseAbs().maxCoeff();
      if (at.residual < 1e-10) break;
      Eigen::VectorXd step = -SparseFactors(hessian).solve(gradient);
      if (step.dot(gradient) > 0.0) step = -step;
      double part = std::min(1.0, 0.25 / step.cwiseAbs().maxCoeff());
      const double before = energy(state, at.u);
      RodState moved = state;
      Eigen::VectorXd u;
      for (int cut = 0; cut < 30; ++cut, part *= 0.5) {
        moved.x.rightCols(moved.x.cols() - 1).reshaped() =
            state.x.rightCols(moved.x.cols() - 1).reshaped() + part * step.head(step.size() - v);
        u = at.u + part * step.tail(v);
        if (energy(moved, u) <= before + 1e-13) break;
      }
      state = moved;
      at.u = u;
    }
    at.x = state.x;
    return at;
  }

 private:
  void find_feet(const RodState& state) const {
    feet_.clear();
    for (int i = 0; i < rod_.nodes(); ++i) {
      const WallSample wall = vessel_.lumen.sample(state.x.col(i));
      const bool near = wall.distance < rod_.radius + 1.0;
      feet_.push_back(
          near ? vessel_.locator.pierced(
                     state.x.col(i) - (wall.distance / wall.gradient.squaredNorm()) * wall.gradient,
                     wall.gradient)
               : SurfacePoint{});
    }
  }
  double yield_at(int i, const Eigen::VectorXd& u) const {
    double yield = 0.0;
    for (const auto& [vertex, part] : parts_at(i)) yield += part.dot(u.segment<3>(3 * vertex));
    return yield;
  }
  /// Vertices that move the wall under node i, and by how much of their motion.
  std::vector<std::pair<int, Vec3>> parts_at(int i) const {
    const SurfacePoint& foot = feet_[static_cast<std::size_t>(i)];
    std::vector<std::pair<int, Vec3>> parts;
    for (int b = 0; b < 3 && foot.triangle >= 0; ++b) {
      for (const auto& [vertex, part] : vessel_.compliance->spread(foot.vertex[b])) {
        parts.emplace_back(vertex,
                           foot.weight[b] * part * vessel_.compliance->normals().col(vertex));
      }
    }
    return parts;
  }
  double energy(const RodState& state, const Eigen::VectorXd& u) const {
    Eigen::Matrix3Xd unused(3, rod_.nodes());
    double sum = Statics::evaluate(problem_, state, unused).total() + 0.5 * u.dot(K_ * u);
    for (int i = 0; i < rod_.nodes(); ++i) {
      const double gap = vessel_.lumen.distance(state.x.col(i)) - rod_.radius + yield_at(i, u);
      sum += rod_.share[i] * law_.at(gap).energy;
    }
    return sum;
  }
  void differentiate(const RodState& state, Solution& at, Eigen::VectorXd& gradient,
                     Eigen::SparseMatrix<double>& hessian) const {
    // The wire, all but node 0.
    const int n = rod_.nodes(), free = 3 * (n - 1);
    Eigen::VectorXd wire_gradient;
    Eigen::MatrixXd wire_hessian;
    Statics::derivatives(problem_, state, wire_gradient, wire_hessian);
    std::vector<Eigen::Triplet<double>> entries;
    for (int i = 0; i < free; ++i) {
      for (int j = std::max(0, i - 8); j < std::min(free, i + 9); ++j) {
        entries.emplace_back(i, j, wire_hessian(3 + i, 3 + j));
      }
    }
    gradient.resize(free + K_.cols());
    gradient << wire_gradient.segment(3, free), K_ * at.u;

    // The wall.
    for (int k = 0; k < K_.outerSize(); ++k) {
      for (Eigen::SparseMatrix<double>::InnerIterator entry(K_, k); entry; ++entry) {
        entries.emplace_back(free + static_cast<int>(entry.row()),
                             free + static_cast<int>(entry.col()), entry.value());
      }
    }

    // Contact: derivatives of the gap by the node and by the three vertices of the foot.
    at.force = Eigen::VectorXd::Zero(n);
    for (int i = 1; i < n; ++i) {
      const WallSample wall = vessel_.lumen.sample(state.x.col(i));
      const ContactLaw::Value law = law_.at(wall.distance - rod_.radius + yield_at(i, at.u));
      if (law.slope == 0.0) continue;
      at.force[i] = -rod_.share[i] * law.slope * wall.gradient.norm();
      const std::vector<std::pair<int, Vec3>> parts = parts_at(i);
      const int size = 3 + 3 * static_cast<int>(parts.size());
      std::vector<int> place(static_cast<std::size_t>(size));
      Eigen::VectorXd by(size);
      for (int d = 0; d < 3; ++d) place[static_cast<std::size_t>(d)] = 3 * (i - 1) + d;
      by.head<3>() = wall.gradient;
      for (std::size_t k = 0; k < parts.size(); ++k) {
        for (std::size_t d = 0; d < 3; ++d) {
          place[3 + 3 * k + d] = free + 3 * parts[k].first + static_cast<int>(d);
        }
        by.segment<3>(3 + 3 * static_cast<Eigen::Index>(k)) = parts[k].second;
      }
      Eigen::MatrixXd H = rod_.share[i] * law.curvature * by * by.transpose();
      H.topLeftCorner<3, 3>() += rod_.share[i] * law.slope * wall.hessian;
      for (int p = 0; p < size; ++p) {
        const int row = place[static_cast<std::size_t>(p)];
        gradient[row] += rod_.share[i] * law.slope * by[p];
        for (int q = 0; q < size; ++q) {
          entries.emplace_back(row, place[static_cast<std::size_t>(q)], H(p, q));
        }
      }
    }
    hessian.resize(gradient.size(), gradient.size());
    hessian.setFromTriplets(entries.begin(), entries.end());
  }

  const VesselModel& vessel_;
  const Rod& rod_;
  Problem problem_;  // of the wire alone
  ContactLaw law_;
  Eigen::SparseMatrix<double> K_;
  mutable std::vector<SurfacePoint> feet_;
};

TEST(YieldingWall, BalancesTheWireAsOneLargeSystemDoes) {
  // A stiff wire clamped in a bend presses the wall outward by a few tenths of a millimetre.
  const double bend_radius = 20.0;
  const Surface surface = shapes::bend_tube(1.5, bend_radius, 0.5 * kPi, 0.0, 0.0, 0.8);
  const Wall wall = shapes::extruded_wall(surface, 1.0, 0.4);
  const VesselModel yielding(surface, wall), rigid(surface);
  const auto along_the_bend = [&](double s) {
    const double at = 0.15 + s / bend_radius;
    return Vec3(bend_radius * (1.0 - std::cos(at)), 0.0, bend_radius * std::sin(at));
  };
  const Wire wire = round_wire(27.0, 1.0, 50.0);
  ContactOptions at_nodes;
  at_nodes.spacing = 2.0;  // half of it in the last 20 mm
  Bench bench(wire, 27, yielding, at_nodes, along_the_bend);
  Bench start(wire, 27, rigid, at_nodes, along_the_bend);
  for (Bench* each : {&bench, &start}) {
    each->problem.proximal = pinned();
    each->problem.proximal.tangent = Vec3(std::sin(0.15), 0.0, std::cos(0.15));
  }
  const NewtonResult solve = bench.solve(1e-9);
  ASSERT_TRUE(solve.converged) << solve.residual;
  ASSERT_TRUE(start.solve().converged);

  // The large system starts from the shape in a rigid wall.
  const Monolith::Solution large = Monolith(surface, wall, yielding, bench).solve(start.state);
  ASSERT_LT(large.residual, 1e-10);
  EXPECT_GT((large.x - start.state.x).cwiseAbs().maxCoeff(), 0.05);
  EXPECT_LT((large.x - bench.state.x).cwiseAbs().maxCoeff(), 1e-6);
  int touching = 0;
  double deepest = 0.0;
  for (const Touch& touch : bench.contact.touches()) {
    const int node = touch.edge + (touch.part == 1.0 ? 1 : 0);
    if (node == 0) continue;
    EXPECT_NEAR(touch.normal_force, large.force[node], 1e-6) << node;
    deepest = std::max(deepest, touch.wall_displacement);
    ++touching;
  }
  EXPECT_EQ(touching, (large.force.array() > 0.0).count());
  EXPECT_GE(touching, 5);
  EXPECT_GT(deepest, 0.05);
}

TEST(YieldingWall, KnowsHowForcesChangeAsTheWireMoves) {
  // Also along the wall, which yields differently from place to place: what add() and
  // add_remainder() have together is the derivative of the forces.
  const double bend_radius = 20.0;
  const Surface surface = shapes::bend_tube(1.5, bend_radius, 0.5 * kPi, 0.0, 0.0, 0.8);
  const VesselModel vessel(surface, shapes::extruded_wall(surface, 1.0, 0.4));
  Bench bench(round_wire(27.0, 1.0, 50.0), 27, vessel, {}, [&](double s) {
    const double at = 0.15 + s / bend_radius, off = 0.52;  // presses outward everywhere
    return Vec3(bend_radius - (bend_radius + off) * std::cos(at), 0.02 * s,
                (bend_radius + off) * std::sin(at));
  });
  const int n = bench.rod.nodes();
  const auto gradient_at = [&](const RodState& state) {
    Eigen::Matrix3Xd gradient(3, n);
    Statics::evaluate(bench.problem, state, gradient);
    return gradient;
  };
  for (const Vec3& direction : {Vec3(0.0, 1.0, 0.0), Vec3(0.6, 0.0, 0.8)}) {
    Eigen::VectorXd motion(3 * n);
    for (int i = 0; i < n; ++i) {
      motion.segment<3>(3 * i) = (1.0 + 0.3 * std::sin(2.0 * i)) * direction;
    }
    constexpr double kStep = 1e-5;  // [mm]
    RodState there = bench.state, back = bench.state;
    there.x.reshaped() += kStep * motion;
    back.x.reshaped() -= kStep * motion;
    const Eigen::VectorXd found =
        ((gradient_at(there) - gradient_at(back)) / (2.0 * kStep)).reshaped();

    Eigen::VectorXd unused, predicted, remainder = Eigen::VectorXd::Zero(3 * n);
    Eigen::MatrixXd hessian;
    Statics::derivatives(bench.problem, bench.state, unused, hessian);
    bench.contact.add_remainder({0, n, 3, motion}, remainder);
    predicted = hessian.topLeftCorner(3 * n, 3 * n) * motion + remainder;
    EXPECT_LT((predicted - found).norm(), 1e-4 * remainder.norm());
  }
}

TEST(YieldingWall, HeldFeetAreRefreshedOnlyWhereTheyAreFarOff) {
  const Surface surface = shapes::straight_tube(1.5, 40.0, 0.8);
  const VesselModel vessel(surface, shapes::extruded_wall(surface, 1.0, 0.4));
  const double off = 0.6;
  // Energy with the lag of the state before, and with its own, after the wire went along the wall
  // and round it.
  const auto change = [&](double along, double round, bool held) {
    const auto wire_at = [&](double shift, double angle) {
      return [=](double s) {
        return Vec3(off * std::cos(angle), off * std::sin(angle), 5.0 + s + shift);
      };
    };
    Bench bench(round_wire(27.0, 1.0, 50.0), 27, vessel, {}, wire_at(0.0, 0.0));
    bench.contact.begin(bench.state);
    if (held) bench.contact.hold_feet();
    const Bench moved(round_wire(27.0, 1.0, 50.0), 27, vessel, {}, wire_at(along, round / off));
    const double before = bench.contact.sample(moved.state).energy.total();
    return bench.contact.refresh(true).energy.total() - before;
  };
  EXPECT_NEAR(change(0.2, 0.0, true), 0.0, 1e-12);
  EXPECT_GT(std::abs(change(0.2, 0.0, false)), 1e-6);
  EXPECT_GT(std::abs(change(0.3, 0.0, true)), 1e-6);
  EXPECT_NEAR(change(0.3, 0.0, true), change(0.3, 0.0, false), 1e-12);
  // What counts is how far the points went, not their places on the wall, here 0.5 mm.
  EXPECT_NEAR(change(0.0, 0.2, true), 0.0, 1e-12);
  EXPECT_GT(std::abs(change(0.0, 0.2, false)), 1e-6);
}

}  // namespace
}  // namespace wireplan::simulate
