// Wires in a vessel whose cross-sections move as wholes: derivatives across section boundaries,
// balance of forces, straightening against the closed form V18 of references M and against finite
// differences, and what an endlessly stiff support gives.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "simulate/equilibrium/sinks.h"
#include "simulate/insertion/trial.h"
#include "tests/simulate/contact_bench.h"
#include "tests/simulate/random_values.h"

namespace wireplan::simulate {
namespace {

using preprocess::Branch;

/// A vessel along y(x), from x = 0 on, at rest.
struct Wave {
  Eigen::Matrix3Xd axis;
  Centerline line;
};

Wave wave_along(double length, double step, double radius,
                const std::function<double(double)>& side) {
  const int points = static_cast<int>(std::lround(length / step)) + 1;
  Wave wave;
  wave.axis.resize(3, points);
  wave.line.radius.setConstant(points, radius);
  for (int k = 0; k < points; ++k) {
    const double x = length * k / (points - 1);
    wave.axis.col(k) << x, side(x), 0.0;
  }
  wave.line.arc_length = arc_length_of(wave.axis);
  wave.line.points = wave.axis;
  return wave;
}

ContactOptions contact_every(double spacing, double friction = 0.0) {
  ContactOptions options;
  options.spacing = spacing;
  options.friction = friction;
  return options;
}

void start_sections(Bench& bench, const VesselModel& vessel) {
  bench.state.sections.setZero(3, vessel.sections->nodes());
  bench.contact.start_at(bench.state);
}

// ---------------------------------------------------------------- derivatives

/// A wire that lies in the wall of a bent tube, sections pushed at random by some mm.
struct Pushed {
  Wave wave;
  VesselModel vessel;
  Bench bench;

  explicit Pushed(bool yields, double friction)
      : wave(wave_along(60.0, 1.0, 2.0, [](double x) { return 6.0 * std::sin(0.06 * x); })),
        vessel(make(wave, yields)),
        bench(round_wire(39.0, 0.5, 50.0), 26, vessel, contact_every(1.0, friction), [](double s) {
          const double x = 8.0 + s;
          return Vec3(x, 6.0 * std::sin(0.06 * x) + 1.45, 0.3 * std::sin(0.4 * s));
        }) {
    std::mt19937_64 random(11);
    Eigen::Matrix3Xd& u = bench.state.sections;
    u.resize(3, vessel.sections->nodes());
    for (double& value : u.reshaped()) value = 1.5 * uniform(random);
    // The wire goes with the sections, but for a tenth of a millimetre.
    for (int i = 0; i < bench.rod.nodes(); ++i) {
      bench.state.x.col(i) += vessel.sections->displacement(bench.state.x.col(i), u);
      for (int d = 0; d < 3; ++d) bench.state.x(d, i) += 0.1 * uniform(random);
    }
    bench.contact.start_at(bench.state);
  }

  static VesselModel make(const Wave& wave, bool yields) {
    const Surface surface = shapes::tube(wave.axis, wave.line.radius, 16);
    VesselModel vessel =
        yields ? VesselModel(surface, shapes::extruded_wall(surface, 1.0, 0.4), follow(surface))
               : VesselModel(surface, follow(surface));
    vessel.sections = std::make_unique<SectionChain>(
        std::vector<Branch>{{.line = wave.line}},
        SectionChainOptions{.support = 2e-3, .young_modulus = 0.3, .spacing = 6.0});
    return vessel;
  }

  int wire_unknowns() const { return 3 * bench.rod.nodes(); }
  Eigen::Index unknowns() const { return wire_unknowns() + bench.state.sections.size(); }
  RodState moved(const Eigen::VectorXd& motion, double part) const {
    RodState state = bench.state;
    state.x.reshaped() += part * motion.head(wire_unknowns());
    state.sections.reshaped() += part * motion.tail(state.sections.size());
    return state;
  }
  /// Of wire, then sections, of the sample that contact had last; with the Hessian.
  Eigen::VectorXd derivatives(Eigen::MatrixXd& hessian) {
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(unknowns());
    hessian.setZero(unknowns(), unknowns());
    DenseSink sink{bench.rod.nodes(), gradient, hessian, wire_unknowns()};
    bench.contact.add(sink);
    return gradient;
  }
};

TEST(MovingVessel, GradientAndHessianAreThoseOfTheEnergyAcrossSections) {
  for (const bool yields : {false, true}) {
    for (const double friction : {0.0, 0.3}) {
      SCOPED_TRACE(yields ? "yields" : "rigid");
      SCOPED_TRACE(friction);
      Pushed scene(yields, friction);
      WallContact& contact = scene.bench.contact;
      contact.begin(scene.bench.state);
      contact.refresh(true);
      if (friction > 0.0) {  // off the anchors
        RodState slid = scene.bench.state;
        slid.x.row(0).array() += 0.015;
        slid.x.row(2).array() += 0.01;
        scene.bench.state = slid;
        contact.sample(slid);
        contact.refresh(true);
      }
      contact.expect_nothing();
      contact.sample(scene.bench.state);
      EXPECT_GT(contact.latest().active.size(), 20u);
      Eigen::MatrixXd hessian, unused;
      const Eigen::VectorXd gradient = scene.derivatives(hessian);
      EXPECT_LT((hessian - hessian.transpose()).norm(), 1e-9 * hessian.norm());

      std::mt19937_64 random(3);
      for (int sample = 0; sample < 8; ++sample) {
        Eigen::VectorXd motion(scene.unknowns());
        for (double& value : motion) value = uniform(random);
        if (sample % 2 == 0) motion.head(scene.wire_unknowns()).setZero();
        constexpr double kStep = 2e-6;  // mm
        contact.sample(scene.moved(motion, kStep));
        const double energy_ahead = contact.energy().total();
        const Eigen::VectorXd ahead = scene.derivatives(unused);
        contact.sample(scene.moved(motion, -kStep));
        const double energy_behind = contact.energy().total();
        const Eigen::VectorXd behind = scene.derivatives(unused);
        EXPECT_NEAR((energy_ahead - energy_behind) / (2.0 * kStep), gradient.dot(motion),
                    1e-6 * gradient.norm());
        contact.sample(scene.bench.state);
        Eigen::VectorXd predicted = hessian * motion, rest = Eigen::VectorXd::Zero(motion.size());
        if (yields) {
          contact.add_remainder({0, scene.bench.rod.nodes(), 3, motion}, rest);
          EXPECT_GT(rest.norm(), 0.0);
        }
        predicted += rest;
        const Eigen::VectorXd found = (ahead - behind) / (2.0 * kStep);
        EXPECT_LT((predicted - found).norm(), 1e-4 * found.norm());
      }
    }
  }
}

TEST(MovingVessel, ForcesOfContactOnWireAndSectionsBalance) {
  Pushed scene(true, 0.3);
  scene.bench.contact.begin(scene.bench.state);
  scene.bench.contact.refresh(true);
  Eigen::MatrixXd unused;
  Eigen::VectorXd gradient = scene.derivatives(unused);
  Eigen::Matrix3Xd support = Eigen::Matrix3Xd::Zero(3, scene.bench.state.sections.cols());
  scene.vessel.sections->energy(scene.bench.state.sections, support);
  gradient.tail(support.size()) -= support.reshaped();
  const Vec3 on_wire =
      gradient.head(scene.wire_unknowns()).reshaped(3, scene.bench.rod.nodes()).rowwise().sum();
  const Vec3 on_sections =
      gradient.tail(support.size()).reshaped(3, support.cols()).rowwise().sum();
  EXPECT_GT(on_wire.norm(), 0.1);
  EXPECT_LT((on_wire + on_sections).norm(), 1e-10 * on_wire.norm());
  // And they are what the touches say.
  Vec3 touched = Vec3::Zero();
  for (const Touch& touch : scene.bench.contact.touches()) {
    touched += touch.normal_force * touch.normal + touch.friction;
  }
  EXPECT_LT((on_wire + touched).norm(), 1e-10 * on_wire.norm());
}

TEST(MovingVessel, WireAndSectionsTogetherMoveAtNoCostOfContact) {
  Pushed scene(true, 0.0);
  WallContact& contact = scene.bench.contact;
  contact.begin(scene.bench.state);
  const ContactEnergy before = contact.refresh(true).energy;
  RodState state = scene.bench.state;
  const Vec3 along(0.7, -2.0, 1.1);
  state.x.colwise() += along;
  state.sections.colwise() += along;
  const ContactEnergy after = contact.sample(state).energy;
  EXPECT_NEAR(after.contact, before.contact, 1e-9 * before.contact);
  EXPECT_NEAR(after.wall, before.wall, 1e-9 * before.wall);
  EXPECT_GT(std::abs(after.support - before.support), 0.01 * before.support);
}

// ---------------------------------------------------------------- factors

/// Wire and sections at random, diagonally dominant, and the same as a dense matrix. Of six
/// sections one couples with nodes far apart, as where a wire folds back, and two with sections
/// alone.
template <int D>
void expect_solves_like_dense(double shift) {
  constexpr int kNodes = 14, kSections = 6;
  constexpr int kSize = D * kNodes + 3 * kSections;
  std::mt19937_64 random(D);
  BlockBand<D> band;
  band.reset(kNodes);
  SectionBlocks sections;
  sections.reset(kNodes, kSections);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(kSize, kSize);
  const auto put = [&](int row, int column, auto& block) {
    for (double& value : block.reshaped()) value = uniform(random);
    if (row == column) {
      block = (0.5 * (block + block.transpose())).eval();
      block.diagonal().array() += 20.0;
    }
    dense.block(row, column, block.rows(), block.cols()) = block;
    dense.block(column, row, block.cols(), block.rows()) = block.transpose();
  };
  for (int i = 0; i < kNodes; ++i) {
    put(D * i, D * i, band.own(i));
    if (i >= 1) put(D * i, D * (i - 1), band.one(i));
    if (i >= 2) put(D * i, D * (i - 2), band.two(i));
  }
  const auto section = [](int j) { return D * kNodes + 3 * j; };
  for (const auto& [node, j] : {std::pair(3, 0), {4, 0}, {6, 1}, {5, 1}, {1, 2}, {12, 2}, {9, 3}}) {
    put(D * node, section(j), sections.cross(node, j));
  }
  for (int j = 0; j < kSections; ++j) {
    put(section(j), section(j), sections.pair(j, j));
    if (j > 0) put(section(j), section(j - 1), sections.pair(j, j - 1));
  }
  dense.diagonal().array() += shift;
  MovingBand factors;
  for (int round = 0; round < 2; ++round) {  // again, in the order of before
    ASSERT_TRUE(factors.factor(band, sections, shift));
    Eigen::VectorXd right(kSize);
    for (double& value : right) value = uniform(random);
    Eigen::VectorXd found = right;
    factors.solve(found);
    EXPECT_LT((dense * found - right).norm(), 1e-12 * right.norm());
  }
  sections.pair(5, 5)(1, 1) = -20.0 - shift;
  EXPECT_FALSE(factors.factor(band, sections, shift));
}

TEST(MovingVessel, FactorsOfWireAndSectionsSolveAsADenseMatrix) {
  for (const double shift : {0.0, 3.0}) {
    expect_solves_like_dense<3>(shift);
    expect_solves_like_dense<4>(shift);
    expect_solves_like_dense<6>(shift);
  }
}

// ---------------------------------------------------------------- what points know

/// Pushed and pulled along the vessel while sections wander: points that take over what others knew
/// and sleep by it feel what points feel that know nothing.
TEST(MovingVessel, WhatPointsRememberDoesNotChangeWhatTheyFeel) {
  Pushed pushed(true, 0.2);
  WallContact forgetful(pushed.bench.rod, pushed.vessel, contact_every(1.0, 0.2));
  forgetful.start_at(pushed.bench.state);
  std::mt19937_64 random(5);
  RodState state = pushed.bench.state;
  const auto lay = [&](double from) {
    for (int i = 0; i < pushed.bench.rod.nodes(); ++i) {
      const double s = from + 39.0 * i / (pushed.bench.rod.nodes() - 1), x = 5.0 + s;
      const Vec3 rest(x, 6.0 * std::sin(0.06 * x) + 1.5 * std::sin(0.3 * s), 0.2);
      state.x.col(i) = rest + pushed.vessel.sections->displacement(rest, state.sections);
    }
  };
  int touched = 0;
  double from = 3.0;
  for (const double distance : {1.0, 1.0, 1.0, 0.7, -1.0, -1.0, 2.0, 1.0, -0.5, 1.0}) {
    from += distance;
    for (double& value : state.sections.reshaped()) value += 0.3 * uniform(random);
    lay(from);
    for (WallContact* contact : {&pushed.bench.contact, &forgetful}) {
      contact->predict(distance);
      if (contact == &forgetful) contact->forget();
      contact->begin(state);
    }
    const ContactSample &found = pushed.bench.contact.latest(), &expected = forgetful.latest();
    ASSERT_EQ(found.active.size(), expected.active.size()) << from;
    for (std::size_t k = 0; k < found.active.size(); ++k) {
      ASSERT_EQ(found.active[k].point, expected.active[k].point) << from;
      EXPECT_LT((found.active[k].position - expected.active[k].position).norm(), 1e-8);
      EXPECT_NEAR(found.active[k].force, expected.active[k].force, 1e-7);
      touched += found.active[k].force > 0.0;
    }
    for (WallContact* contact : {&pushed.bench.contact, &forgetful}) contact->settle();
  }
  EXPECT_GT(touched, 30);
}

TEST(MovingVessel, TheEndOfAWireIsWhereAllOfItIsAtRest) {
  const Pushed pushed(false, 0.0);
  const RodState& state = pushed.bench.state;
  const SectionChain& chain = *pushed.vessel.sections;
  const Eigen::Matrix3Xd all = places_at_rest(&chain, state.sections, state.x);
  for (const double length : {0.5, 10.0, 20.0, 1e3}) {
    const Eigen::Matrix3Xd end = end_at_rest(chain, state.sections, state.x, length);
    // Weights by their series, from another place: 4e-10 of 1.5 mm for each of five.
    EXPECT_LT((end - all.rightCols(end.cols())).colwise().norm().maxCoeff(), 4e-9);
    double passed = 0.0;
    for (Eigen::Index k = 1; k < end.cols(); ++k) passed += (end.col(k) - end.col(k - 1)).norm();
    if (end.cols() < all.cols()) {
      EXPECT_GE(passed, length);
      EXPECT_LT(passed - (end.col(1) - end.col(0)).norm(), length);
    } else {
      EXPECT_EQ(length, 1e3);
    }
  }
}

// ---------------------------------------------------------------- V18: straightening

/// The wave of references M drawn out fivefold along its axis, so that slopes are small (the closed
/// form is linear): a wire 625 times as stiff has the same r = EI q^4 / K. The vessel is narrower
/// than there, its support per length the same: K = pi R k_s with R = 5 mm.
constexpr double kDrawnOut = 5.0, kAmplitude = 10.0, kWavelength = 120.0 * kDrawnOut;  // mm
constexpr double kTubeRadius = 2.0, kTableRadius = 5.0;                                // mm
constexpr double kWaveNumber = 2.0 * kPi / kWavelength;
constexpr double kStiffer = kDrawnOut * kDrawnOut * kDrawnOut * kDrawnOut;
constexpr double kBefore = 20.0;  // of the vessel, before the first crest and after the last  [mm]

double wave_at(double x) { return kAmplitude * std::cos(kWaveNumber * x); }

struct Straightened {
  double displacement = 0.0;  // of the vessel at a crest, toward the axis [mm]
  int iterations = 0;
  bool converged = false;
};

/// Two waves, from crest to crest, where the wire leaves along the axis and is free to move aside.
class Wavy {
 public:
  Wavy()
      : wave_(wave_along(2.0 * kWavelength + 2.0 * kBefore, 2.0, kTubeRadius,
                         [](double x) { return wave_at(x - kBefore); })),
        vessel_(shapes::tube(wave_.axis, wave_.line.radius, 32),
                LumenOptions{.grid_spacing = 0.4, .band = 2.5}) {}

  Straightened straighten(double EI, double support, double clearance, double spacing) {
    vessel_.sections = std::make_unique<SectionChain>(
        std::vector<Branch>{{.line = wave_.line}},
        SectionChainOptions{.support = support * kTableRadius / kTubeRadius, .spacing = spacing});
    Bench bench(round_wire(2.0 * kWavelength - 1.0, kTubeRadius - clearance, kStiffer * EI, 1e7),
                120, vessel_, contact_every(10.0),
                [](double s) { return Vec3(kBefore + 0.5 + s, wave_at(s) - 0.01, 0.0); });
    start_sections(bench, vessel_);
    bench.problem.proximal = held_along(Vec3::UnitX());
    bench.problem.proximal.tangent = Vec3::UnitX();
    bench.problem.distal.tangent = Vec3::UnitX();
    const NewtonResult result = bench.statics.solve(
        bench.problem, bench.state, {.residual_tolerance = 1e-6, .max_iterations = 500});
    const double crest = kBefore + kWavelength;
    const Vec3 moved =
        vessel_.sections->displacement(Vec3(crest, kAmplitude, 0.0), bench.state.sections);
    return {-moved[1], result.iterations, result.converged};
  }

 private:
  Wave wave_;
  VesselModel vessel_;
};

/// How far a support of K gives way, and how stiff it is then together with the contact law, where
/// a wire is `off` the middle: K u is what the law presses at the gap clearance - off + u.
std::pair<double, double> give_way(double off, double K, double clearance, const LinearLaw& law) {
  double low = 0.0, high = std::max(0.0, off - clearance) + law.reach();
  for (int k = 0; k < 60; ++k) {
    const double u = 0.5 * (low + high);
    (K * u + law.at(clearance - off + u).slope < 0.0 ? low : high) = u;
  }
  const double contact = law.at(clearance - off + low).curvature;
  return {low, contact > 0.0 ? K * contact / (K + contact) : 0.0};
}

/// The same by finite differences of half a wave from crest to crest: the lowest energy of
/// EI y''^2/2 and of what gives way, y' = y''' = 0 at both ends. The vessel moves by what it
/// must. Returns how far at the trough.
double straighten_by_differences(double EI, double K, double clearance, const LinearLaw& law = {}) {
  constexpr int kCells = 150;
  const double h = 0.5 * kWavelength / kCells;
  const int n = kCells + 1;
  const auto mirrored = [&](int i) { return i < 0 ? -i : i > kCells ? 2 * kCells - i : i; };
  Eigen::MatrixXd bend = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(n);
    row[mirrored(i - 1)] += 1.0 / (h * h);
    row[i] -= 2.0 / (h * h);
    row[mirrored(i + 1)] += 1.0 / (h * h);
    const double share = i == 0 || i == kCells ? 0.5 * h : h;
    bend += EI * share * row.transpose() * row;
  }
  Eigen::VectorXd y = Eigen::VectorXd::Zero(n), u = Eigen::VectorXd::Zero(n);
  for (int round = 0; round < 200; ++round) {
    Eigen::MatrixXd A = bend;
    Eigen::VectorXd g = bend * y;
    for (int i = 0; i < n; ++i) {
      const double share = (i == 0 || i == kCells ? 0.5 : 1.0) * h;
      const double off = y[i] - wave_at(i * h);
      const auto [moved, stiffness] = give_way(std::abs(off), K, clearance, law);
      u[i] = std::copysign(moved, off);
      g[i] += share * K * u[i];
      A(i, i) += share * std::max(stiffness, 1e-9 * K);
    }
    const Eigen::VectorXd step = A.ldlt().solve(g);
    y -= step;
    if (step.cwiseAbs().maxCoeff() < 1e-10) break;
  }
  return u[kCells];
}

/// References M, V18: a wire without clearance moves the vessel by A r / (1 + r), r = EI q^4 / K.
struct TableRow {
  double support, EI, closed_form;
};
std::vector<TableRow> table_rows() {
  std::vector<TableRow> rows;
  for (const double support : {1e-4, 1e-3, 1e-2, 2.5e-2}) {
    for (const double EI : {291.0, 377.0, 1849.0, 4857.0}) {
      const double q = kDrawnOut * kWaveNumber;
      const double r = EI * q * q * q * q / (kPi * kTableRadius * support);
      rows.push_back({support, EI, kAmplitude * r / (1.0 + r)});
    }
  }
  return rows;
}

TEST(Straightening, ByDifferencesIsTheClosedFormWhereThereIsNoClearance) {
  const LinearLaw hard{.stiffness = 1e4, .smoothing = 1e-6};
  for (const TableRow& row : table_rows()) {
    const double found =
        straighten_by_differences(kStiffer * row.EI, kPi * kTableRadius * row.support, 0.0, hard);
    EXPECT_NEAR(found, row.closed_form, 1e-3 * row.closed_form);  // of cells of 2 mm
  }
}

TEST(Straightening, IsThatOfDifferencesInAllRowsOfTheTable) {
  Wavy scene;
  constexpr double kClearance = 0.5;  // mm: the field is rounded within a cell of the axis
  for (const TableRow& row : table_rows()) {
    SCOPED_TRACE(row.support);
    SCOPED_TRACE(row.EI);
    const double expected =
        straighten_by_differences(kStiffer * row.EI, kPi * kTableRadius * row.support, kClearance);
    const Straightened found = scene.straighten(row.EI, row.support, kClearance, 20.0);
    ASSERT_TRUE(found.converged);
    std::printf(
        "k_s %5.1f kPa/mm, EI %4.0f: moved by %.4f mm, differences %.4f, without clearance "
        "%.4f, %d iterations\n",
        1e3 * row.support, row.EI, found.displacement, expected, row.closed_form, found.iterations);
    EXPECT_NEAR(found.displacement, expected, 0.02 * expected);
  }
}

TEST(Straightening, IsThatOfDifferencesWithMoreClearance) {
  Wavy scene;
  for (const double EI : {377.0, 4857.0}) {
    const double K = kPi * kTableRadius * 1e-3;
    const double expected = straighten_by_differences(kStiffer * EI, K, 1.5);
    const Straightened found = scene.straighten(EI, 1e-3, 1.5, 20.0);
    ASSERT_TRUE(found.converged);
    EXPECT_NEAR(found.displacement, expected, 0.02 * expected);
  }
}

// ---------------------------------------------------------------- trials

/// Pushed through an S of radius 2 with a yielding wall.
TrialResult push_through(double support, double EI, double young_modulus = 0.4) {
  const Wave wave = wave_along(120.0, 0.8, 2.0, [](double x) {
    return 6.0 * (1.0 - std::cos(2.0 * kPi * std::max(0.0, x - 15.0) / 80.0));
  });
  const Surface surface = shapes::tube(wave.axis, wave.line.radius, 16);
  VesselModel vessel(surface, shapes::extruded_wall(surface, 1.0, young_modulus), follow(surface));
  if (support > 0.0) {
    vessel.sections = std::make_unique<SectionChain>(
        std::vector<Branch>{{.line = wave.line}},
        SectionChainOptions{
            .support = support, .young_modulus = young_modulus, .pins = {{.place = Vec3::Zero()}}});
  }
  TrialResult result = run_trial(
      round_wire(130.0, 0.45, EI), {.point = Vec3(2.0, 0.0, 0.0), .direction = Vec3::UnitX()},
      {.point = Vec3(500.0, 0.0, 0.0), .radius = 1.0}, vessel, {.length = 90.0, .friction = 0.15});
  // At rest the wire is where the sections carry it from.
  EXPECT_EQ(result.tips_at_rest.size(), vessel.sections ? result.pushes.size() : 0u);
  EXPECT_EQ(result.nodes_at_rest.cols(), vessel.sections ? result.nodes.cols() : 0);
  if (vessel.sections && !result.tips_at_rest.empty()) {
    const Eigen::Matrix3Xd carried =
        vessel.sections->carried(result.nodes_at_rest, result.sections);
    EXPECT_LT((carried - result.nodes).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_LT((result.tips_at_rest.back() - result.nodes_at_rest.rightCols<1>()).norm(), 1e-9);
  }
  return result;
}

TEST(MovingVessel, AnEndlesslyStiffSupportIsTodaysWall) {
  const TrialResult held = push_through(1e7, 50.0), today = push_through(0.0, 50.0);
  EXPECT_EQ(held.outcome, today.outcome);
  ASSERT_EQ(held.pushes.size(), today.pushes.size());
  ASSERT_GT(today.pushes.size(), 80u);
  EXPECT_EQ(today.sections.size(), 0);
  EXPECT_LT((held.nodes - today.nodes).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(held.sections.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_NEAR(held.pushes.back().total_contact_force, today.pushes.back().total_contact_force,
              1e-5 * today.pushes.back().total_contact_force);
}

TEST(MovingVessel, MovesMoreUnderAStifferWireAndOnASofterSupport) {
  const auto moved = [](double support, double EI) {
    const TrialResult result = push_through(support, EI);
    EXPECT_NE(result.outcome, Outcome::kNotConverged);
    EXPECT_NE(result.outcome, Outcome::kLeftLumen);
    double iterations = 0.0;
    for (const Push& push : result.pushes) iterations += push.iterations;
    const Push& last = result.pushes.back();
    std::printf(
        "k_s %5.1f kPa/mm, EI %4.0f: %s after %.0f mm, moved by %.2f mm, %.2f iterations, "
        "unbalanced %.2f %%\n",
        1e3 * support, EI, outcome_name(result.outcome), last.insertion,
        result.sections.colwise().norm().maxCoeff(),
        iterations / static_cast<double>(result.pushes.size()),
        100.0 * last.unbalanced / last.push_work);
    EXPECT_LT(iterations / static_cast<double>(result.pushes.size()), 6.0);
    return result.sections.colwise().norm().maxCoeff();
  };
  const double soft = moved(1e-3, 50.0);
  EXPECT_GT(moved(1e-3, 400.0), 1.5 * soft);
  EXPECT_GT(soft, 2.0 * moved(1e-2, 50.0));
}

}  // namespace
}  // namespace wireplan::simulate
