#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "simulate/scene.h"
#include "simulate/solver.h"
#include "tests/shapes.h"
#include "tests/simulate/paper_wire.h"

namespace wireplan::simulate {
namespace {

Scene heavy_cantilever(int elements) {
  Scene scene;
  scene.wire = paper_wire();
  scene.elements = elements;
  scene.supports = {{.at = WireEnd::kProximal, .kind = SupportKind::kClamped}};
  scene.loads.gravity = Vec3(0.0, -9810.0, 0.0);
  scene.solver.residual_tolerance = 1e-10;
  return scene;
}

Scene tip_loaded_cantilever(double length, double EI, const Vec3& force, int elements) {
  Scene scene;
  scene.wire = {.name = "beam",
                .radius = 0.4,
                .sections = {{.length = length, .bending_stiffness = EI, .axial_stiffness = 1e5}}};
  scene.elements = elements;
  scene.supports = {{.at = WireEnd::kProximal, .kind = SupportKind::kClamped}};
  scene.loads.tip_force = force;
  scene.solver.residual_tolerance = 1e-8;  // rounding leaves 1e-9 at EA = 1e5 N
  return scene;
}

double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1.0p-52 - 1.0;
}

/// A crooked, twisted wire with a curved tip, and a problem on it that has every term.
struct Crooked {
  Rod rod;
  RodState state;
  Eigen::Matrix3Xd load;
  Lumen lumen{shapes::straight_tube(3.0, 30.0, 1.0), {.grid_spacing = 0.5}};
  Problem problem;

  Crooked() {
    const Wire wire{.name = "crooked",
                    .radius = 0.44,
                    .sections = {{.length = 6.0, .bending_stiffness = 3.0, .rest_curvature = 0.1},
                                 {.length = 50.0, .bending_stiffness = 20.0}}};
    rod = build_rod(wire, 12.0, 12);
    const RodState straight = straight_state(rod, Vec3(2.5, 0.0, 8.0), Vec3::UnitZ(), 0.3);
    state = straight;
    std::mt19937_64 random(4);
    for (int i = 0; i < rod.nodes(); ++i) {
      for (int d = 0; d < 3; ++d) state.x(d, i) += 0.2 * uniform(random);
    }
    for (int i = 0; i + 1 < rod.nodes(); ++i) state.theta[i] += uniform(random);
    transport_frames(straight, state, 0, rod.nodes() - 2);
    load = Eigen::Matrix3Xd::Constant(3, rod.nodes(), 0.01);
    problem.rod = &rod;
    problem.last = rod.nodes();
    problem.proximal.tangent = Vec3(0.0, 0.6, 0.8);
    problem.distal.tangent = Vec3(0.0, 0.0, 1.0);
    problem.load = &load;
    problem.lumen = &lumen;
  }

  /// Energy after a move of all x and theta, frames carried along.
  double energy_after(const Eigen::VectorXd& move) const {
    RodState moved = state;
    const int n = rod.nodes();
    for (int i = 0; i < n; ++i) moved.x.col(i) += move.segment<3>(3 * i);
    moved.theta += move.tail(n - 1);
    transport_frames(state, moved, 0, n - 2);
    Eigen::Matrix3Xd gradient(3, n);
    return Statics::evaluate(problem, moved, gradient).total();
  }
};

TEST(Energy, GradientAndHessianAgreeWithFiniteDifferences) {
  const Crooked c;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  Statics::derivatives(c.problem, c.state, gradient, hessian);
  Eigen::Matrix3Xd forces(3, c.rod.nodes());
  const Energy energy = Statics::evaluate(c.problem, c.state, forces);
  for (const double part : {energy.stretch, energy.bend, energy.twist, energy.contact}) {
    EXPECT_GT(std::abs(part), 1e-3);  // every term takes part
  }

  const Eigen::Index size = gradient.size();
  std::mt19937_64 random(5);
  for (int k = 0; k < 50; ++k) {
    Eigen::VectorXd d(size);
    for (Eigen::Index i = 0; i < size; ++i) d[i] = uniform(random);
    d.normalize();
    // Fourth-order differences: truncation h^4 against rounding 1e-13 E / h^2.
    const double h = 2e-3;
    const double f0 = c.energy_after(0.0 * d), f1 = c.energy_after(h * d),
                 m1 = c.energy_after(-h * d), f2 = c.energy_after(2 * h * d),
                 m2 = c.energy_after(-2 * h * d);
    const double slope = (8.0 * (f1 - m1) - (f2 - m2)) / (12.0 * h);
    const double curvature = (16.0 * (f1 + m1) - (f2 + m2) - 30.0 * f0) / (12.0 * h * h);
    EXPECT_NEAR(gradient.dot(d), slope, 1e-6 * (1.0 + gradient.norm()));
    // The wall's field is C2 only: its third derivative jumps within the stencil.
    EXPECT_NEAR(d.dot(hessian * d), curvature, 1e-4 * (1.0 + std::abs(curvature)));
  }
  EXPECT_LT((hessian - hessian.transpose()).norm(), 1e-9 * hessian.norm());
}

TEST(Energy, DoesNotChangeUnderRigidMotion) {
  Crooked c;
  c.problem.lumen = nullptr;
  c.problem.load = nullptr;
  c.problem.proximal.tangent.reset();
  c.problem.distal.tangent.reset();
  Eigen::Matrix3Xd gradient(3, c.rod.nodes());
  const Energy before = Statics::evaluate(c.problem, c.state, gradient);
  EXPECT_LT(gradient.rowwise().sum().norm(), 1e-10);  // forces balance
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(1.1, Vec3(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  c.state.x = (R * c.state.x).colwise() + Vec3(10.0, -20.0, 5.0);
  c.state.director = R * c.state.director;
  const Energy after = Statics::evaluate(c.problem, c.state, gradient);
  EXPECT_NEAR(after.bend, before.bend, 1e-10 * before.bend);
  EXPECT_NEAR(after.twist, before.twist, 1e-10 * before.twist);
  EXPECT_NEAR(after.stretch, before.stretch, 1e-10 * before.stretch);
}

TEST(Cantilever, SmallTipLoadBendsAsEulerBernoulliPredicts) {
  const double length = 50.0, EI = 20.0, load = 1e-4;           // mm, N mm^2, N
  const double beam = load * std::pow(length, 3) / (3.0 * EI);  // 0.208 mm: 0.4 % of length
  for (const int elements : {10, 20, 40}) {
    SCOPED_TRACE(elements);
    const SceneResult bent =
        run_scene(tip_loaded_cantilever(length, EI, Vec3(0.0, load, 0.0), elements));
    ASSERT_EQ(bent.outcome, SceneOutcome::kConverged);
    // Half a bend element at the clamp: the chain is softer by exactly 1/(2n^2).
    const double n = elements, expected = beam * (1.0 + 1.0 / (2.0 * n * n));
    EXPECT_NEAR(bent.nodes(1, elements), expected, 1e-4 * expected);  // finite rotation costs 2e-5
  }
}

TEST(Cantilever, FollowsTheElasticaUnderALargeTipLoad) {
  // references D2: alpha = P L^2/EI; axial and transverse displacement over L.
  struct Row {
    double alpha, axial, transverse;
  };
  for (const Row& row :
       {Row{1.0, 0.05643, 0.30172}, {5.0, 0.38763, 0.71379}, {10.0, 0.55500, 0.81061}}) {
    SCOPED_TRACE(row.alpha);
    const double length = 100.0, EI = 500.0, P = row.alpha * EI / (length * length);
    const SceneResult bent = run_scene(tip_loaded_cantilever(length, EI, Vec3(0.0, P, 0.0), 100));
    ASSERT_EQ(bent.outcome, SceneOutcome::kConverged);
    EXPECT_NEAR(1.0 - bent.nodes(0, 100) / length, row.axial, 0.005);  // D11, V1
    EXPECT_NEAR(bent.nodes(1, 100) / length, row.transverse, 0.005);
  }
}

TEST(Cantilever, PapersWireHangsWhereTheElasticaDoes) {
  const Vec3 reference(7.3710, -37.1520, 0.0);  // of the continuous, stretchable wire
  const SceneResult coarse = run_scene(heavy_cantilever(20)),
                    fine = run_scene(heavy_cantilever(100));
  ASSERT_EQ(coarse.outcome, SceneOutcome::kConverged);
  ASSERT_EQ(fine.outcome, SceneOutcome::kConverged);
  EXPECT_LT((coarse.nodes.col(20) - reference).norm(), 0.22);  // 0.55 % of the length
  EXPECT_LT((fine.nodes.col(100) - reference).norm(), 0.02);
}

TEST(Cantilever, ConvergesWithTheSquareOfTheElementLength) {
  const Vec3 reference = run_scene(heavy_cantilever(640)).nodes.col(640);
  const double e40 = (run_scene(heavy_cantilever(40)).nodes.col(40) - reference).norm();
  const double e80 = (run_scene(heavy_cantilever(80)).nodes.col(80) - reference).norm();
  EXPECT_NEAR(std::log2(e40 / e80), 2.0, 0.1);
}

TEST(Cantilever, SupportCarriesTheWeightAndItsMoment) {
  const SceneResult hanging = run_scene(heavy_cantilever(50));
  const double weight = 40.0 * 0.1e-6 * 9810.0;
  ASSERT_EQ(hanging.reactions.size(), 1u);
  EXPECT_TRUE(hanging.reactions[0].force.isApprox(Vec3(0.0, weight, 0.0), 1e-8));
  // Moments of the nodes' weights about the clamp.
  Vec3 moment = Vec3::Zero();
  for (int i = 0; i <= 50; ++i) {
    const double share = (i == 0 || i == 50 ? 0.5 : 1.0) * weight / 50.0;
    moment -= Vec3(hanging.nodes.col(i)).cross(Vec3(0.0, -share, 0.0));
  }
  EXPECT_TRUE(hanging.reactions[0].moment.isApprox(moment, 1e-6));
}

TEST(Newton, EnergyFallsAtEveryStepFromAFarStart) {
  for (const double gravity : {1e3, 1e4, 1e6}) {
    SCOPED_TRACE(gravity);
    Rod rod = build_rod(paper_wire(), 40.0, 40);
    RodState state = straight_state(rod, Vec3::Zero(), Vec3::UnitX(), 0.0);
    Eigen::Matrix3Xd load = Vec3(0.0, -gravity, 0.0) * rod.mass.transpose();
    Problem problem;
    problem.rod = &rod;
    problem.last = rod.nodes();
    problem.proximal = {.hold_along = true,
                        .hold_across = true,
                        .hold_roll = true,
                        .axis = Vec3::UnitX(),
                        .tangent = Vec3::UnitX()};
    problem.load = &load;
    Statics statics;
    const NewtonResult solve =
        statics.solve(problem, state, {.residual_tolerance = 1e-8, .max_iterations = 100});
    EXPECT_TRUE(solve.converged);
    EXPECT_LT(solve.worst_energy_rise, 1e-12);  // rounding of energies near 1 N mm
  }
}

TEST(CurvedTip, RestsInItsOwnShapeTowardItsDirector) {
  // A quarter circle of 10 mm radius ahead of a straight part, no load: the wire bends toward its
  // director.
  const double R = 10.0, arc = 0.5 * kPi * R;
  Scene scene;
  scene.wire = {.name = "J",
                .radius = 0.4,
                .sections = {{.length = arc, .bending_stiffness = 5.0, .rest_curvature = 1.0 / R},
                             {.length = 30.0, .bending_stiffness = 50.0}}};
  scene.elements = 200;
  scene.solver.residual_tolerance = 1e-9;
  for (const double roll : {0.0, 2.0}) {
    SCOPED_TRACE(roll);
    scene.supports = {{.at = WireEnd::kProximal,
                       .kind = SupportKind::kClamped,
                       .direction = Vec3::UnitZ(),
                       .roll = roll}};
    const SceneResult rest = run_scene(scene);
    ASSERT_EQ(rest.outcome, SceneOutcome::kConverged);
    const Vec3 toward =
        std::cos(roll) * Vec3(0.0, -1.0, 0.0) + std::sin(roll) * Vec3(1.0, 0.0, 0.0);
    const Vec3 tip = rest.nodes.rightCols<1>();
    // The joint of the sections falls inside an element of 0.23 mm: half of it, turned, is what is
    // allowed.
    EXPECT_LT((tip - (Vec3(0.0, 0.0, 30.0 + R) + R * toward)).norm(), 0.12);
    EXPECT_LT(rest.energy.bend, 1e-10);
  }
}

TEST(Ends, PinnedGuidedColumnShortensAlongItsAxisOnly) {
  Scene scene = tip_loaded_cantilever(50.0, 20.0, Vec3(1.0, 0.3, 0.0), 20);
  scene.supports = {
      {.at = WireEnd::kProximal, .kind = SupportKind::kPinned},
      {.at = WireEnd::kDistal, .kind = SupportKind::kGuided, .point = Vec3(50.0, 0.0, 0.0)}};
  const SceneResult result = run_scene(scene);
  ASSERT_EQ(result.outcome, SceneOutcome::kConverged);
  EXPECT_NEAR(result.nodes(1, 20), 0.0, 1e-12);  // held across
  EXPECT_NEAR(result.nodes(0, 20), 50.0 * (1.0 + 1.0 / 1e5),
              1e-6);  // free along: strain P/EA, of first order
  EXPECT_NEAR(result.reactions[0].force.x(), -1.0, 1e-7);
}

TEST(Terms, SceneNamesOnlyWhatItBuilt) {
  EXPECT_EQ(run_scene(heavy_cantilever(10)).terms,
            (std::vector<std::string>{"stretch", "bend", "gravity"}));
  EXPECT_EQ(run_scene(tip_loaded_cantilever(50.0, 20.0, Vec3(0.0, 0.1, 0.0), 10)).terms,
            (std::vector<std::string>{"stretch", "bend", "tip_force"}));
}

TEST(BlockBand, SolvesWhatADenseFactorisationSolves) {
  const int n = 7;
  std::mt19937_64 random(6);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  BlockBand<3> band;
  band.reset(n);
  for (int i = 0; i < n; ++i) {
    for (int j = std::max(0, i - 2); j <= i; ++j) {
      Mat3 block;
      for (int k = 0; k < 9; ++k) block(k / 3, k % 3) = uniform(random);
      if (i == j) block = (block + block.transpose() + 12.0 * Mat3::Identity()).eval();
      dense.block<3, 3>(3 * i, 3 * j) = block;
      dense.block<3, 3>(3 * j, 3 * i) = block.transpose();
      (i == j ? band.own(i) : i == j + 1 ? band.one(i) : band.two(i)) = block;
    }
  }
  Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(3 * n, -1.0, 1.0), x = b;
  ASSERT_TRUE(band.factor());
  band.solve(x);
  EXPECT_LT((dense * x - b).norm(), 1e-12);
}

TEST(BlockBand, FindsThatAMatrixIsNotPositiveDefinite) {
  BlockBand<3> band;
  band.reset(2);
  band.own(0) = band.own(1) = Mat3::Identity();
  band.one(1) = 1.5 * Mat3::Identity();
  EXPECT_FALSE(band.factor());
}

}  // namespace
}  // namespace wireplan::simulate
