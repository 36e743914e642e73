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
/// blocks couples with nothing.
template <int D>
void fill_at_random(int n, int narrow, BlockBand<D>& band, Eigen::MatrixXd& dense) {
  using Block = Eigen::Matrix<double, D, D>;
  std::mt19937_64 random(6);
  dense = Eigen::MatrixXd::Zero(D * n, D * n);
  band.reset(n, narrow);
  for (int i = 0; i < n; ++i) {
    for (int j = std::max(0, i - 2); j <= i; ++j) {
      Block block;
      for (int k = 0; k < D * D; ++k) block(k / D, k % D) = uniform(random);
      if (i == j) block = (block + block.transpose() + 4.0 * D * Block::Identity()).eval();
      if (i < narrow) block.row(D - 1).setZero();
      if (j < narrow) block.col(D - 1).setZero();
      if (i == j && i < narrow) block(D - 1, D - 1) = 1.0;
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
  fill_at_random(n, 0, band, dense);
  for (const double shift : {0.0, 2.0}) {
    Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(3 * n, -1.0, 1.0), x = b;
    ASSERT_TRUE(factors.factor(band, shift));
    factors.solve(x);
    EXPECT_LT((dense * x + shift * x - b).norm(), 1e-12) << shift;
  }
}

TEST(BlockBand, LeavesOutTheLastUnknownOfNarrowRowsAndSolvesByHalves) {
  const int n = 9;
  for (const int narrow : {1, 2, 3, 6, 9}) {
    SCOPED_TRACE(narrow);
    BlockBand<4> matrix, band;
    Eigen::MatrixXd dense;
    fill_at_random(n, narrow, matrix, dense);
    Eigen::MatrixXd b = Eigen::MatrixXd::NullaryExpr(4 * n, 3, [](Eigen::Index i, Eigen::Index k) {
      return std::sin(1.0 + static_cast<double>(i * (k + 1)));
    });
    for (int i = 0; i < narrow; ++i) b.row(4 * i + 3).setZero();
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
    fill_at_random(n, 0, symmetric, dense);
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
  const Eigen::VectorXd known = dense.fullPivLu().solve(b);
  EXPECT_GT(known.norm(), 1e4);
  EXPECT_LT((x - known).norm(), 1e-6 * known.norm());
}

}  // namespace
}  // namespace wireplan::simulate
