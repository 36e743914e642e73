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
#include "tests/simulate/paper_wire.h"
#include "tests/simulate/random_values.h"

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

enum class Section2 { kRound, kStrip };

/// A crooked, twisted wire with a curved tip, clamped at both ends, and a problem on it that has
/// every term. The strip's tip is stiffer toward its curvature, its shaft across it.
struct Crooked {
  Rod rod;
  RodState state;
  Eigen::Matrix3Xd load;
  VesselModel vessel{shapes::straight_tube(3.0, 30.0, 1.0), {.grid_spacing = 0.5}};
  std::optional<WallContact> contact;
  Problem problem;

  explicit Crooked(Section2 section) {
    const bool strip = section == Section2::kStrip;
    const Wire wire{.name = "crooked",
                    .radius = 0.44,
                    .sections = {{.length = 6.0,
                                  .bending_stiffness = 3.0,
                                  .bending_stiffness_2 = strip ? 0.3 : 0.0,
                                  .rest_curvature = 0.1},
                                 {.length = 50.0,
                                  .bending_stiffness = 20.0,
                                  .bending_stiffness_2 = strip ? 60.0 : 0.0,
                                  .rest_curvature = strip ? 0.2 : 0.0}}};
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
    contact.emplace(rod, vessel, ContactOptions());
    problem.contact = &*contact;
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

/// Holds gradient and Hessian against fourth-order differences along random directions.
void expect_exact_derivatives(const Crooked& c, double slope_tolerance,
                              double curvature_tolerance) {
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  Statics::derivatives(c.problem, c.state, gradient, hessian);
  const Eigen::Index size = gradient.size();
  std::mt19937_64 random(5);
  for (int k = 0; k < 50; ++k) {
    Eigen::VectorXd d(size);
    for (Eigen::Index i = 0; i < size; ++i) d[i] = uniform(random);
    d.normalize();
    const double h = 2e-3;  // truncation h^4 against rounding 1e-13 E / h^2
    const double f0 = c.energy_after(0.0 * d), f1 = c.energy_after(h * d),
                 m1 = c.energy_after(-h * d), f2 = c.energy_after(2 * h * d),
                 m2 = c.energy_after(-2 * h * d);
    const double slope = (8.0 * (f1 - m1) - (f2 - m2)) / (12.0 * h);
    const double curvature = (16.0 * (f1 + m1) - (f2 + m2) - 30.0 * f0) / (12.0 * h * h);
    EXPECT_NEAR(gradient.dot(d), slope, slope_tolerance * (1.0 + gradient.norm()));
    EXPECT_NEAR(d.dot(hessian * d), curvature, curvature_tolerance * (1.0 + std::abs(curvature)));
  }
  EXPECT_LT((hessian - hessian.transpose()).norm(), 1e-9 * hessian.norm());
}

TEST(Energy, GradientAndHessianAgreeWithFiniteDifferences) {
  for (const Section2 section : {Section2::kRound, Section2::kStrip}) {
    SCOPED_TRACE(section == Section2::kStrip);
    Crooked c(section);
    Eigen::Matrix3Xd forces(3, c.rod.nodes());
    const Energy energy = Statics::evaluate(c.problem, c.state, forces);
    for (const double part : {energy.stretch, energy.bend, energy.twist, energy.contact}) {
      EXPECT_GT(std::abs(part), 1e-3);  // every term takes part
    }
    // The wall's field is C2 only: its third derivative jumps within the stencil.
    expect_exact_derivatives(c, 1e-6, 1e-4);
    c.problem.contact = nullptr;
    expect_exact_derivatives(c, 1e-8, 1e-7);
    const Springs springs{.place = c.state.x.colwise() + Vec3(0.3, -0.2, 0.5),
                          .stiffness = Eigen::VectorXd::LinSpaced(c.rod.nodes(), 0.5, 2.0)};
    c.problem.springs = &springs;
    expect_exact_derivatives(c, 1e-8, 1e-7);
    c.problem.springs = nullptr;

    // Bending and the clamps alone, so that no stiff term hides them.
    c.rod.stretch.setZero();
    c.rod.twist.setZero();
    expect_exact_derivatives(c, 1e-8, 1e-7);
  }
}

TEST(Energy, DoesNotChangeUnderRigidMotion) {
  for (const Section2 section : {Section2::kRound, Section2::kStrip}) {
    SCOPED_TRACE(section == Section2::kStrip);
    Crooked c(section);
    c.problem.contact = nullptr;
    c.problem.load = nullptr;
    Eigen::Matrix3Xd gradient(3, c.rod.nodes());
    const Energy before = Statics::evaluate(c.problem, c.state, gradient);
    EXPECT_LT(gradient.rowwise().sum().norm(), 1e-10);  // forces balance
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(1.1, Vec3(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
    c.state.x = (R * c.state.x).colwise() + Vec3(10.0, -20.0, 5.0);
    c.state.director = R * c.state.director;
    for (EndSupport* end : {&c.problem.proximal, &c.problem.distal}) {
      end->tangent = Vec3(R * end->tangent.value());
    }
    const Energy after = Statics::evaluate(c.problem, c.state, gradient);
    EXPECT_NEAR(after.bend, before.bend, 1e-10 * before.bend);
    EXPECT_NEAR(after.twist, before.twist, 1e-10 * before.twist);
    EXPECT_NEAR(after.stretch, before.stretch, 1e-10 * before.stretch);
  }
}

TEST(Strip, WithEqualStiffnessesIsARoundWire) {
  const Crooked round(Section2::kRound);
  Crooked equal(Section2::kRound);
  const Wire wire{.name = "equal",
                  .radius = 0.44,
                  .sections = {{.length = 6.0,
                                .bending_stiffness = 3.0,
                                .bending_stiffness_2 = 3.0,
                                .rest_curvature = 0.1},
                               {.length = 50.0, .bending_stiffness = 20.0}}};
  equal.rod = build_rod(wire, 12.0, 12);
  Eigen::Matrix3Xd gradient(3, round.rod.nodes());
  EXPECT_EQ(Statics::evaluate(equal.problem, equal.state, gradient).total(),
            Statics::evaluate(round.problem, round.state, gradient).total());
}

TEST(Strip, BendsAsEachOfItsStiffnessesSays) {
  // A small tip load toward the material director, -y, meets EI; one across it, along z, EI_2.
  const double length = 50.0, load = 1e-4, EI = 20.0, EI_2 = 5.0;
  for (const bool swap : {false, true}) {
    SCOPED_TRACE(swap);
    Scene scene = tip_loaded_cantilever(length, swap ? EI_2 : EI, Vec3(0.0, load, load), 40);
    scene.wire.sections[0].bending_stiffness_2 = swap ? EI : EI_2;
    scene.wire.sections[0].twist_stiffness = 10.0;
    const SceneResult bent = run_scene(scene);
    ASSERT_EQ(bent.outcome, SceneOutcome::kConverged);
    const double beam = load * std::pow(length, 3) / 3.0 * (1.0 + 1.0 / (2.0 * 40.0 * 40.0));
    const double tolerance = 2e-3;  // the strip turns a little as it bends: (w/L)^2 (EI/GJ)
    EXPECT_NEAR(bent.nodes(1, 40), beam / (swap ? EI_2 : EI), tolerance * beam / EI_2);
    EXPECT_NEAR(bent.nodes(2, 40), beam / (swap ? EI : EI_2), tolerance * beam / EI_2);
    EXPECT_EQ(bent.terms,
              (std::vector<std::string>{"stretch", "bend", "twist", "strip", "tip_force"}));
    // Force and moment of the clamp balance the load.
    const Vec3 force(0.0, load, load), tip = bent.nodes.rightCols<1>();
    EXPECT_LT((bent.reactions[0].force + force).norm(), 1e-7);
    EXPECT_LT((bent.reactions[0].moment + tip.cross(force)).norm(), 1e-5 * load * length);
  }
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

/// A wire curved all along, an arc of 60 mm with a radius of 40 mm, clamped along z and rolled, and
/// at its other end too if `both`. Round, or a strip with `EI_2` across its curvature.
struct CurvedScene {
  static constexpr double kRadius = 40.0, kLength = 60.0, kRoll = 0.7;
  Scene scene;
  Vec3 toward = std::cos(kRoll) * Vec3(0.0, -1.0, 0.0) + std::sin(kRoll) * Vec3(1.0, 0.0, 0.0);

  CurvedScene(int elements, bool both, double EI_2) {
    scene.wire = {.name = "arc",
                  .radius = 0.4,
                  .sections = {{.length = kLength,
                                .bending_stiffness = 20.0,
                                .bending_stiffness_2 = EI_2,
                                .axial_stiffness = 1e5,
                                .twist_stiffness = 15.0,
                                .rest_curvature = 1.0 / kRadius}}};
    scene.elements = elements;
    scene.supports = {{.direction = Vec3::UnitZ(), .roll = kRoll}};
    const double turn = kLength / kRadius;
    if (both) {
      scene.supports.push_back(
          {.at = WireEnd::kDistal,
           .point = on_arc(kLength),
           .direction = std::cos(turn) * Vec3::UnitZ() + std::sin(turn) * toward,
           .roll = kRoll});
    }
    scene.solver.residual_tolerance = 1e-8;
  }

  Vec3 on_arc(double s) const {
    const double turn = s / kRadius;
    return kRadius * (std::sin(turn) * Vec3::UnitZ() + (1.0 - std::cos(turn)) * toward);
  }
};

const std::pair<bool, double> kCurvedCases[] = {{false, 0.0}, {true, 0.0},   {false, 2.0},
                                                {true, 2.0},  {false, 60.0}, {true, 60.0}};

/// A wire half out of an introducer whose hub was turned, pulled aside at its curved tip. A rest
/// curvature of the shaft, however small, makes every theta of it an unknown.
struct Turned {
  Rod rod;
  RodState state;
  Eigen::Matrix3Xd load;
  Problem problem;
  NewtonResult result;

  explicit Turned(double shaft_curvature, double turn) {
    const Wire wire{
        .name = "turned",
        .radius = 0.44,
        .sections = {
            {.length = 10.0, .bending_stiffness = 5.0, .rest_curvature = 0.1},
            {.length = 30.0, .bending_stiffness = 50.0, .rest_curvature = shaft_curvature},
            {.length = 60.0, .bending_stiffness = 200.0, .rest_curvature = shaft_curvature}}};
    rod = build_rod(wire, 80.0, 40);
    state = straight_state(rod, Vec3(1.0, 2.0, 3.0), Vec3::UnitZ(), 0.3);
    load = Eigen::Matrix3Xd::Zero(3, rod.nodes());
    load.col(rod.nodes() - 1) = Vec3(0.03, 0.05, -0.02);
    load.col(20) = Vec3(-0.2, 0.1, 0.0);
    problem.rod = &rod;
    problem.first = 5;
    problem.last = rod.nodes();
    problem.load = &load;
    state.theta.head(problem.first).array() += turn;
    // The edge at the exit turns with the hub; its reference director depends on the solver's way.
    const int exit = problem.first - 1;
    for (int round = 0; round < 4; ++round) {
      state.theta[exit] = state.theta[exit - 1] - state.reference_twist[exit];
      result = Statics().solve(problem, state, {.residual_tolerance = 1e-9});
    }
  }

  /// Material director of an edge.
  Vec3 material(int edge) const {
    const Vec3 t = (state.x.col(edge + 1) - state.x.col(edge)).normalized();
    const Vec3 d = state.director.col(edge);
    return std::cos(state.theta[edge]) * d + std::sin(state.theta[edge]) * t.cross(d);
  }
};

TEST(TwistChain, EndsWhereEveryThetaAsAnUnknownEnds) {
  for (const double turn : {0.0, 2.0, -9.0}) {
    SCOPED_TRACE(turn);
    const Turned chain(0.0, turn), each(1e-12, turn);
    ASSERT_TRUE(chain.result.converged && each.result.converged);
    // Both are within 1e-9 N of the same equilibrium; its softest mode, the tip's roll, has 1e-2
    // N/mm.
    EXPECT_LT((chain.state.x - each.state.x).cwiseAbs().maxCoeff(), 1e-6);
    for (int e = 0; e + 1 < chain.rod.nodes(); ++e) {
      EXPECT_LT((chain.material(e) - each.material(e)).norm(), 1e-6) << e;
    }
    EXPECT_NEAR(chain.result.energy, each.result.energy, 1e-9);
    const double torque = Statics::held_end(each.problem, each.state).torque;
    EXPECT_NEAR(Statics::held_end(chain.problem, chain.state).torque, torque, 1e-7);
    EXPECT_GT(std::abs(torque), 1e-3);
  }
}

TEST(TwistChain, LeavesEveryEdgeInBalance) {
  const Turned chain(0.0, 4.0);
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  Statics::derivatives(chain.problem, chain.state, gradient, hessian);
  const int n = chain.rod.nodes(), first = chain.problem.first;
  EXPECT_LT(gradient.segment(3 * first, 3 * (n - first)).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT(gradient.segment(3 * n + first, n - 1 - first).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(CurvedClamp, WireRestsOnItsArcToSecondOrder) {
  for (const auto& [both, EI_2] : kCurvedCases) {
    SCOPED_TRACE(testing::Message() << both << ", EI_2 " << EI_2);
    const auto error = [both = both, EI_2 = EI_2](int elements) {
      const CurvedScene arc(elements, both, EI_2);
      const SceneResult rest = run_scene(arc.scene);
      EXPECT_EQ(rest.outcome, SceneOutcome::kConverged);
      double largest = 0.0;
      for (int i = 0; i <= elements; ++i) {
        const Vec3 place = arc.on_arc(i * CurvedScene::kLength / elements);
        largest = std::max(largest, (rest.nodes.col(i) - place).norm());
      }
      return largest;
    };
    const double e20 = error(20), e40 = error(40), e80 = error(80);
    EXPECT_LT(e20, 0.001 * CurvedScene::kLength);
    EXPECT_NEAR(std::log2(e20 / e40), 2.0, 0.1);
    EXPECT_NEAR(std::log2(e40 / e80), 2.0, 0.1);
  }
}

TEST(CurvedClamp, LoadedWireConvergesToSecondOrder) {
  // A force out of the plane of the arc, on the tip or, with both ends held, all along.
  for (const auto& [both, EI_2] : kCurvedCases) {
    SCOPED_TRACE(testing::Message() << both << ", EI_2 " << EI_2);
    const auto middle_and_tip = [both = both, EI_2 = EI_2](int elements) {
      CurvedScene arc(elements, both, EI_2);
      const double scale = EI_2 == 0.0 ? 1.0 : std::min(1.0, EI_2 / 20.0);  // bent alike
      const Vec3 force = scale * Vec3(0.02, 0.01, -0.01);
      if (both) {
        arc.scene.wire.sections[0].mass_per_length = 1e-8;
        arc.scene.loads.gravity = 1e7 * force;
      } else {
        arc.scene.loads.tip_force = force;
      }
      const SceneResult bent = run_scene(arc.scene);
      EXPECT_EQ(bent.outcome, SceneOutcome::kConverged);
      Eigen::VectorXd places(6);
      places << bent.nodes.col(elements / 2), bent.nodes.col(elements);
      return places;
    };
    const Eigen::VectorXd a = middle_and_tip(80), b = middle_and_tip(160), c = middle_and_tip(320);
    EXPECT_GT((a.head<3>() - CurvedScene(80, both, EI_2).on_arc(30.0)).norm(), 1.0);  // it is bent
    EXPECT_NEAR(std::log2((b - a).norm() / (c - b).norm()), 2.0, 0.1);
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

}  // namespace
}  // namespace wireplan::simulate
