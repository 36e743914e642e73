// Contact, friction and the yielding wall against theory: the pressed tip, a helix in a tube, the
// capstan, a uniform bend, sinusoidal buckling, and a wire with its wall as one system. Numbers and
// tolerances: references D7, D8 and D11.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "simulate/insertion/scene.h"
#include "tests/shapes.h"
#include "tests/simulate/contact_bench.h"

namespace wireplan::simulate {
namespace {

using preprocess::find_openings;

// ---------------------------------------------------------------- V6: the pressed tip

/// A rod of length and EI 1, clamped along the normal of a plane and pressed onto it by eps, with
/// its tip stuck right below the clamp: force along the normal, across, and angle of the tip.
struct PressedTip {
  double N = 0.0, H = 0.0, angle = 0.0;
};

/// theta'' = -(H cos theta + N sin theta) from the tip (theta' = 0) back to the clamp, theta from
/// the normal; Newton's method finds N, H and the tip's angle that bring the clamp to theta = 0,
/// right above the tip, at the height 1 - eps.
PressedTip press_tip(double eps) {
  const auto miss = [eps](const Vec3& unknown) -> Vec3 {
    constexpr int kSteps = 200;  // Runge-Kutta: error 1e-9
    const double N = unknown[0], H = unknown[1], h = 1.0 / kSteps;
    const auto rate = [&](const Eigen::Vector4d& y) -> Eigen::Vector4d {
      return {y[1], -(H * std::cos(y[0]) + N * std::sin(y[0])), std::sin(y[0]), std::cos(y[0])};
    };
    Eigen::Vector4d y(unknown[2], 0.0, 0.0, 0.0);
    for (int k = 0; k < kSteps; ++k) {
      const Eigen::Vector4d a = rate(y), b = rate(y + 0.5 * h * a), c = rate(y + 0.5 * h * b),
                            d = rate(y + h * c);
      y += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
    return {y[0], y[2], y[3] - (1.0 - eps)};
  };
  // From the mode of small eps: H/N = -0.448 sqrt(eps) for a tip that leans to the other side.
  Vec3 unknown(20.3, -0.448 * std::sqrt(eps) * 20.3, 2.5 * std::sqrt(eps));
  for (int round = 0; round < 30; ++round) {
    const Vec3 at = miss(unknown);
    Mat3 slope;
    for (int d = 0; d < 3; ++d) {
      slope.col(d) = (miss(unknown + 1e-6 * Vec3::Unit(d)) - at) / 1e-6;
    }
    unknown -= slope.partialPivLu().solve(at);
  }
  return {unknown[0], std::abs(unknown[1]), std::abs(unknown[2])};
}

/// References D8, up to where the tip lies flat.
struct TabledTip {
  double eps, N, friction, degrees;
};
constexpr std::array kPressedTips = {
    TabledTip{0.001, 20.198, 0.0141, 4.5}, TabledTip{0.01, 20.267, 0.0449, 14.3},
    TabledTip{0.02, 20.343, 0.0639, 20.3}, TabledTip{0.05, 20.573, 0.1035, 32.3},
    TabledTip{0.10, 20.959, 0.1528, 46.3}, TabledTip{0.20, 21.721, 0.2378, 67.2},
    TabledTip{0.30, 22.418, 0.3265, 84.9}};

TEST(PressedTipReference, IsTheMasterCurveOfTheReferences) {
  // References D8: N, H/N and the tip's angle, to the digits printed there.
  for (const TabledTip& row : kPressedTips) {
    SCOPED_TRACE(row.eps);
    const PressedTip tip = press_tip(row.eps);
    EXPECT_NEAR(tip.N, row.N, 1e-3);
    EXPECT_NEAR(tip.H / tip.N, row.friction, 1e-4);
    EXPECT_NEAR(tip.angle / kRadPerDeg, row.degrees, 0.1);
  }
}

/// A wire of 40 mm clamped along -z above the floor of a box, 0.01 mm of air below its tip.
class PressedWire {
 public:
  static constexpr double kLength = 40.0, kEI = 20.0, kRadius = 0.1, kSlip = 0.02;

  /// Penetration does not count as compression: see eps().
  explicit PressedWire(double friction, const ContactLaw& law = {})
      : vessel_(shapes::box(Vec3(-30.0, -30.0, 0.0), Vec3(30.0, 30.0, 60.0)),
                {.grid_spacing = 2.0, .band = 4.0}),
        bench_(round_wire(kLength, kRadius, kEI), 40, vessel_,
               {.law = law, .spacing = 1.0, .friction = friction, .slip = kSlip},
               [](double s) { return Vec3(0.0, 0.0, kRadius + 0.01 + kLength - s); }) {
    // So that it bows toward x as soon as it may, 0.2 % of what it presses with; straight it would
    // stand on its tip for long, and then spring aside.
    bias_ = Eigen::Matrix3Xd::Zero(3, bench_.rod.nodes());
    bias_.row(0).setConstant(1e-5);
    bench_.problem.load = &bias_;
    bench_.problem.proximal = pinned();
    bench_.problem.proximal.tangent = -Vec3::UnitZ();
    bench_.problem.plane = Vec3::UnitY();
  }

  /// Moves the clamp down until the wire would be compressed by eps if the wall were rigid.
  NewtonResult press_to(double eps) {
    const double move = kRadius + kLength * (1.0 - eps - sunk_) - bench_.state.x(2, 0);
    for (int i = 0; i < bench_.rod.nodes(); ++i) {
      bench_.state.x(2, i) += move * bench_.rod.tip_distance[i] / kLength;
    }
    return bench_.solve();
  }
  /// Bows it, and takes away what makes it bow toward x. Its load hardly grows from there, nor how
  /// deep it presses into the wall, which no longer counts as compression.
  void bow() {
    double pressed = 0.0;
    while (eps() < 0.0005 && pressed < 0.01) EXPECT_TRUE(press_to(pressed += 2e-5).converged);
    bias_.setZero();
    sunk_ = pressed - eps();
  }
  /// The same in steps of sqrt(eps), as the wire bows. Returns whether all converged.
  bool press_slowly_to(double eps, double step = 0.005) {
    const double start = std::sqrt(std::max(0.0, this->eps()));
    const int steps = static_cast<int>(std::ceil((std::sqrt(eps) - start) / step));
    for (int k = 1; k <= steps; ++k) {
      const double root = start + (std::sqrt(eps) - start) * k / steps;
      if (!press_to(root * root).converged) return false;
    }
    return true;
  }
  /// From where the tip is.
  double eps() const { return 1.0 - (bench_.state.x(2, 0) - tip().z()) / kLength; }
  Vec3 tip() const { return bench_.state.x.rightCols<1>(); }
  std::vector<Touch> touches() { return bench_.contact.touches(); }

 private:
  VesselModel vessel_;
  Bench bench_;
  Eigen::Matrix3Xd bias_;  // [N]
  double sunk_ = 0.0;      // into the wall, as a part of the length
};

TEST(PressedTip, PushesAndHoldsAsTheElasticaDoes) {  // V16
  // So hard a wall that a tip that lies nearly flat touches it but once.
  PressedWire wire(1.0, {LinearLaw{.stiffness = 200.0, .smoothing = 0.005}});
  wire.bow();
  for (const TabledTip& row : kPressedTips) {
    SCOPED_TRACE(row.eps);
    ASSERT_TRUE(wire.press_slowly_to(row.eps));
    const PressedTip theory = press_tip(wire.eps());
    const std::vector<Touch> touches = wire.touches();
    // 40 elements leave 0.1 %, the displacement that friction needs 0.1 %, but 2 % of so small a
    // force as that at 0.001; references D11 ask 2 %.
    ASSERT_EQ(touches.size(), 1u);
    const double part = row.eps < 0.01 ? 0.02 : 0.01;
    const double scale = PressedWire::kEI / (PressedWire::kLength * PressedWire::kLength);
    const double N = touches[0].normal_force, H = touches[0].friction.norm();
    EXPECT_NEAR(N, theory.N * scale, 0.5 * part * theory.N * scale);
    EXPECT_NEAR(H / N, theory.H / theory.N, part * theory.H / theory.N);
    EXPECT_LT(std::abs(wire.tip().x()), PressedWire::kSlip);  // sticks
  }
}

TEST(PressedTip, SlidesOffWhereFrictionIsOvercome) {  // V16
  for (const TabledTip& row : kPressedTips) {
    if (row.eps < 0.01) continue;  // bowed by less than the slip that friction needs
    const double friction = row.friction;
    SCOPED_TRACE(friction);
    // The compression at which H/N meets the friction, by bisection of the reference.
    double low = 0.005, high = 0.32;
    for (int k = 0; k < 40; ++k) {
      const double middle = 0.5 * (low + high);
      const PressedTip theory = press_tip(middle);
      (theory.H / theory.N < friction ? low : high) = middle;
    }
    // The compressions at which H/N is 2 % less and more.
    const auto eps_at = [&](double needed) {
      const double more = 1.01 * low,
                   slope =
                       std::log(press_tip(more).H / press_tip(more).N / friction) / std::log(1.01);
      return low * std::pow(needed / friction, 1.0 / slope);
    };
    PressedWire wire(friction);
    wire.bow();
    // A step of 0.005 is 5 % of the least of these, and throws the tip beyond where it holds.
    const double step = row.eps < 0.02 ? 0.001 : 0.005;
    ASSERT_TRUE(wire.press_slowly_to(eps_at(0.98 * friction), step));
    // Friction's full force needs the slip, and a tip that lies nearly flat rolls.
    EXPECT_LT(std::abs(wire.tip().x()), 2.0 * PressedWire::kSlip);
    wire.press_slowly_to(eps_at(1.02 * friction), step);
    EXPECT_GT(std::abs(wire.tip().x()), 10.0 * PressedWire::kSlip);
  }
}

// ---------------------------------------------------------------- V7: a helix in a tube

TEST(HelixInATube, HasTheWallForceAndPitchOfTheory) {
  // Weightless wire under a thrust F: the helix of least energy has q^2 = F/(2 EI), that is a pitch
  // of sqrt(8 pi^2 EI/F), and presses on the wall with F^2 r/(4 EI) per length. Angles to the axis
  // of 2 pi r/pitch = 0.08 change that by 0.6 %; what the free ends do decays within pitch/(4 pi).
  const double EI = 1000.0, pitch = 160.0, r = 2.0, radius = 0.25;
  const double q = 2.0 * kPi / pitch, F = 2.0 * EI * q * q;
  const VesselModel vessel(long_tube(r + radius, 700.0, 48), {.grid_spacing = 0.5, .band = 1.0});
  const double start_q = 1.1 * q, climb = 1.0 / std::hypot(1.0, r * start_q);
  Bench bench(round_wire(640.0, radius, EI), 160, vessel,
              {.law = {LinearLaw{.stiffness = 20.0, .smoothing = 0.005}}, .spacing = 4.0},
              [&](double s) {
                const double z = climb * s;
                return Vec3(r * std::cos(start_q * z), r * std::sin(start_q * z), 30.0 + z);
              });
  const int n = bench.rod.nodes();
  bench.problem.proximal =
      pinned();  // free to turn; without it the helix could roll round the axis
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, n);
  load(2, n - 1) = -F;
  bench.problem.load = &load;
  const NewtonResult solve = bench.solve();
  ASSERT_TRUE(solve.converged) << solve.residual;

  // The middle half: straight line through the azimuth over z, and the wall's force.
  const Eigen::Matrix3Xd& x = bench.state.x;
  const int first = n / 4, last = 3 * n / 4;
  double turned = 0.0;
  for (int i = first; i < last; ++i) {
    turned += std::atan2(x(0, i) * x(1, i + 1) - x(1, i) * x(0, i + 1),
                         x(0, i) * x(0, i + 1) + x(1, i) * x(1, i + 1));
  }
  const double rise = x(2, last) - x(2, first);
  EXPECT_NEAR(2.0 * kPi * rise / turned, pitch, 0.03 * pitch);
  const double force = normal_force(bench.contact.touches(), [&](const Touch& touch) {
    return touch.position.z() > x(2, first) && touch.position.z() < x(2, last);
  });
  const double expected = F * F * r / (4.0 * EI);
  EXPECT_NEAR(force / rise, expected, 0.03 * expected);
}

// ---------------------------------------------------------------- V8: the capstan

TEST(Capstan, TensionGrowsExponentiallyWithTheAngle) {
  // A soft wire on the inner side of a helical tube, held back by 1 N at its tip and pulled until
  // it slips all along. EI = 0.05 N mm^2 bends within sqrt(EI/T) = 0.2 mm: its stiffness is felt at
  // the ends alone. The tangent turns by a/sqrt(a^2 + b^2) = 0.999 of the azimuth.
  const double lumen = 2.0, axis_radius = 20.0, pitch = 6.0, radius = 0.2, hold = 1.0;
  const double path = axis_radius - lumen + radius, climb = pitch / (2.0 * kPi);
  const double start = 10.0 * kRadPerDeg, length_per_angle = std::hypot(path, climb);
  const double length = 400.0 * kRadPerDeg * length_per_angle;
  const Eigen::Matrix3Xd axis = shapes::helix_axis(axis_radius, pitch, 420.0 * kRadPerDeg, 0.9);
  const VesselModel vessel(shapes::tube(axis, Eigen::VectorXd::Constant(axis.cols(), lumen), 16),
                           {.grid_spacing = 0.5, .band = 1.0});
  for (const double friction : {0.1, 0.3}) {
    SCOPED_TRACE(friction);
    const auto point_at = [&](double s) {
      const double azimuth = start + s / length_per_angle;
      return Vec3(path * std::cos(azimuth), path * std::sin(azimuth), climb * azimuth);
    };
    Bench bench(round_wire(length, radius, 0.05, 2000.0), 128, vessel,
                {.law = {}, .spacing = 1.0, .friction = friction}, point_at);
    const int n = bench.rod.nodes();
    bench.problem.first = 1;  // the hand holds node 0
    Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, n);
    load.col(n - 1) = hold * (bench.state.x.col(n - 1) - bench.state.x.col(n - 2)).normalized();
    bench.problem.load = &load;
    ASSERT_TRUE(bench.solve().converged);
    for (int pull = 0; pull < 4; ++pull) {
      // The whole wire slides back along the tube by half a millimetre.
      const double turn = -0.5 / length_per_angle;
      bench.state.x = (Eigen::AngleAxisd(turn, Vec3::UnitZ()).matrix() * bench.state.x).eval();
      bench.state.x.row(2).array() += climb * turn;
      const NewtonResult solve = bench.solve();
      ASSERT_TRUE(solve.converged) << solve.residual;
    }

    // Tension at an azimuth, from the edges on either side of it.
    const Eigen::Matrix3Xd& x = bench.state.x;
    const auto azimuth_of = [&](int i) {
      const double turns =
          std::floor(x(2, i) / pitch - std::atan2(x(1, i), x(0, i)) / (2.0 * kPi) + 0.5);
      return std::atan2(x(1, i), x(0, i)) + 2.0 * kPi * turns;
    };
    const auto tension_at = [&](double azimuth) {
      const auto middle = [&](int e) { return 0.5 * (azimuth_of(e) + azimuth_of(e + 1)); };
      const auto tension = [&](int e) {
        const double ratio = (x.col(e + 1) - x.col(e)).norm() / bench.rod.rest_length[e];
        return 0.5 * bench.rod.stretch[e] * (ratio * ratio - 1.0) * ratio;
      };
      int e = 0;
      while (middle(e + 1) < azimuth) ++e;
      const double part = (azimuth - middle(e)) / (middle(e + 1) - middle(e));
      return (1.0 - part) * tension(e) + part * tension(e + 1);
    };
    const double tip_side = azimuth_of(n - 1) - 15.0 * kRadPerDeg;
    for (const double angle : {90.0, 180.0, 360.0}) {
      const double theta = angle * kRadPerDeg;
      const double expected = std::exp(friction * theta * path / length_per_angle);
      // Nodes turn by 3 degrees each: tan of half of it instead of the angle is 1e-4. Facets move
      // the stations by their angle at most, 2 degrees or 1 % at 0.3.
      EXPECT_NEAR(tension_at(tip_side - theta) / tension_at(tip_side), expected, 0.03 * expected)
          << angle;
    }
    for (const Touch& touch : bench.contact.touches()) {
      EXPECT_NEAR(touch.friction.norm(), friction * touch.normal_force,
                  1e-3 * touch.normal_force + 1e-6);  // it slips everywhere
    }
  }
}

// ---------------------------------------------------------------- V9: a uniform bend

TEST(UniformBend, IsFeltAtTheEndsOfTheWireAlone) {
  // A straight wire in a tube of constant curvature is bent uniformly and needs no force along its
  // length; over the last sqrt(12 r/kappa) at either end it crosses from the inner to the outer
  // side, where tip and inner wall make the couple EI kappa. So for r much less than 1/(12 kappa):
  // the wall pushes toward the centre of the bend alone, which leaves a thrust EI kappa^2, here 3 %
  // of the forces of the couple. The law is soft against the wire (spreads its forces over 10 mm),
  // so that the tube's facets are not felt as a line force.
  const double lumen = 2.0, bend_radius = 200.0, angle = 0.85, radius = 1.5, EI = 1000.0;
  const Eigen::Matrix3Xd axis = shapes::bend_axis(bend_radius, angle, 0.0, 0.0, 1.5);
  const VesselModel vessel(shapes::tube(axis, Eigen::VectorXd::Constant(axis.cols(), lumen), 40),
                           {.grid_spacing = 0.5});
  const double start = 0.05, end = 0.8, r = lumen - radius;
  Bench bench(round_wire(bend_radius * (end - start), radius, EI), 100, vessel,
              {.law = {LinearLaw{.stiffness = 0.5, .smoothing = 0.01}}, .spacing = 1.5},
              [&](double s) {
                const double at = start + s / bend_radius;
                return Vec3(bend_radius * (1.0 - std::cos(at)), 0.0, bend_radius * std::sin(at));
              });
  bench.problem.proximal = held_along(Vec3(std::sin(start), 0.0, std::cos(start)));
  const NewtonResult solve = bench.solve();
  ASSERT_TRUE(solve.converged) << solve.residual;

  // Moments at the middle: of the bent wire, and of all contact forces beyond.
  const Eigen::Matrix3Xd& x = bench.state.x;
  const int middle = bench.rod.nodes() / 2;
  const double moment = EI / bend_radius, lever = std::sqrt(12.0 * r * bend_radius);
  const Vec3 a = (x.col(middle) - x.col(middle - 1)).normalized(),
             b = (x.col(middle + 1) - x.col(middle)).normalized();
  EXPECT_NEAR(bench.rod.bend[middle] * a.cross(b).norm(), moment, 0.03 * moment);
  const std::vector<Touch> touches = bench.contact.touches();
  Vec3 couple = Vec3::Zero(), force = Vec3::Zero();
  for (const Touch& touch : touches) {
    if (touch.edge < middle) continue;
    const Vec3 f = touch.normal_force * touch.normal;
    couple += (touch.position - x.col(middle)).cross(f);
    force += f;
  }
  EXPECT_NEAR(couple.norm(), moment, 0.03 * moment);

  // The couple's force at the tip. The soft law lets the tip give way by 0.2 mm.
  const double at_tip =
      normal_force(touches, [&](const Touch& touch) { return touch.tip_distance < 0.5 * lever; });
  EXPECT_NEAR(at_tip, moment / lever, 0.1 * moment / lever);
  EXPECT_NEAR(force.norm(), moment / bend_radius, 0.03 * at_tip);  // that thrust in the middle

  // Between the two couples there is no line force, measured against the couple's force per lever.
  const double half = 0.5 * bench.rod.tip_distance[0] - 1.5 * lever;
  ASSERT_GT(half, 20.0);
  const double interior = normal_force(touches, [&](const Touch& touch) {
    return std::abs(touch.tip_distance - 0.5 * bench.rod.tip_distance[0]) < half;
  });
  EXPECT_LT(interior * lever / (2.0 * half), 0.03 * at_tip);
}

// ---------------------------------------------------------------- sinusoidal buckling

TEST(SinusoidalBuckling, StartsAtTheLoadOfDawsonAndPaslay) {
  // Pinned ends three half waves apart, of the wave length that buckles first: then the load is
  // that of an infinite wire, 2 sqrt(EI w/r).
  const double EI = 100.0, weight = 1e-3, r = 3.5, radius = 0.5;
  const double q = std::pow(weight / (EI * r), 0.25), length = 3.0 * kPi / q;
  const double theory = 2.0 * std::sqrt(EI * weight / r);
  const VesselModel vessel(long_tube(r + radius, length + 20.0, 128), {.grid_spacing = 0.8});
  const auto buckled_angle = [&](double thrust) {
    Bench bench(round_wire(length, radius, EI), 76, vessel,
                {.law = {LinearLaw{.stiffness = 20.0, .smoothing = 0.005}}, .spacing = 4.0},
                [&](double s) {
                  const double across = 0.02 * std::sin(q * s);
                  return Vec3(r * std::sin(across), 0.004 - r * std::cos(across), 10.0 + s);
                });
    const int n = bench.rod.nodes();
    bench.problem.proximal = pinned();
    bench.problem.distal = held_across(Vec3::UnitZ());
    Eigen::Matrix3Xd load = -weight * Vec3::UnitY() * bench.rod.share.transpose();
    load(2, n - 1) -= thrust;
    bench.problem.load = &load;
    const NewtonResult solve = bench.solve(1e-8);
    EXPECT_TRUE(solve.converged) << thrust << " " << solve.residual;
    return bench.state.x.row(0).cwiseAbs().maxCoeff() / r;
  };
  double low = 0.7 * theory, high = 1.4 * theory;
  ASSERT_LT(buckled_angle(low), 1e-3);
  ASSERT_GT(buckled_angle(high), 0.3);
  for (int k = 0; k < 7; ++k) {
    const double middle = 0.5 * (low + high);
    // The amplitude grows as sqrt(1.45 (F/F_c - 1)): 0.1 comes 0.7 % past the load.
    (buckled_angle(middle) < 0.1 ? low : high) = middle;
  }
  // Facets of 0.2 mm under a grid of 0.8 mm bend the floor by 2 % more or less than the circle;
  // references D11 ask 10 %.
  EXPECT_NEAR(0.5 * (low + high), theory, 0.03 * theory);
}

// ---------------------------------------------------------------- a wall that does not yield

TEST(Friction, ChangesWithTheNormalForceInTheUnsymmetricBandAsElsewhere) {
  const VesselModel vessel(shapes::bend_tube(1.5, 20.0, 0.5 * kPi, 0.0, 0.0, 0.8));
  ContactOptions options;
  options.friction = 0.3;
  // A wire along the bend that presses outward, and went on by half of what friction needs.
  const auto along_the_bend = [](double along) {
    return [=](double s) {
      const double at = 0.15 + (s + along) / 20.0, radius = 20.54;
      return Vec3(20.0 - radius * std::cos(at), 0.0, radius * std::sin(at));
    };
  };
  Bench bench(round_wire(20.0, 1.0, 50.0), 10, vessel, options, along_the_bend(0.0));
  const Bench further(round_wire(20.0, 1.0, 50.0), 10, vessel, options, along_the_bend(0.01));
  const int n = bench.rod.nodes();
  bench.contact.begin(further.state);
  bench.contact.refresh(true);

  const Eigen::VectorXd motion = Eigen::VectorXd::LinSpaced(3 * n, -1.0, 2.0);
  Eigen::VectorXd remainder = Eigen::VectorXd::Zero(3 * n);
  bench.contact.add_remainder({0, n, 3, motion}, remainder);
  EXPECT_GT(remainder.norm(), 1e-3);

  BlockBand<3> zero;
  zero.reset(n);
  UnsymmetricBand band;
  band.take(zero);
  bench.contact.add_remainder(0, band);
  Eigen::VectorXd product = Eigen::VectorXd::Zero(3 * n);
  for (int i = 0; i < n; ++i) {
    for (int j = std::max(0, i - 1); j <= std::min(n - 1, i + 1); ++j) {
      product.segment<3>(3 * i) += band.at(i, j).topRows<3>() * motion.segment<3>(3 * j);
    }
  }
  EXPECT_LT((product - remainder).norm(), 1e-12 * remainder.norm());
}

TEST(WallContact, FindsWhatTouchesAfterManyMotions) {
  // Points far from the wall are not looked at until they could have come near. A wire that wanders
  // about, now further and now less far out of its introducer, feels what a new one there feels.
  const VesselModel vessel(shapes::straight_tube(3.0, 60.0, 0.8));
  const Wire wire = round_wire(40.0, 0.4, 50.0);
  ContactOptions options;
  Bench bench(wire, 8, vessel, options, [](double s) { return Vec3(0.0, 0.0, 10.0 + s); });
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> side(-1.0, 1.0);
  double touched = 0.0, missed = 0.0;
  int followed = 0;
  const std::array<double, 4> strides = {3.2, 0.5, 0.02, 3e-4};
  for (int round = 0; round < 400; ++round) {
    const double out = 20.0 + 20.0 * side(random), shift = 2.0 * side(random);
    const double stride = strides[static_cast<std::size_t>(round) % strides.size()];
    const Vec3 by(stride * side(random), stride * side(random), 0.0);
    bench.contact.free_from(out);
    bench.contact.begin(bench.state);
    for (int i = 0; i < bench.rod.nodes(); ++i) {
      Vec3 p = bench.state.x.col(i) + by * (0.5 + 0.5 * std::sin(i + shift));
      p.head<2>() *= std::min(1.0, 2.7 / p.head<2>().norm());
      bench.state.x.col(i) = p;
    }
    const double found = bench.contact.sample(bench.state).energy.contact;
    WallContact fresh(bench.rod, vessel, options);
    fresh.start_at(bench.state);
    fresh.free_from(out);
    fresh.begin(bench.state);
    // Of a point that hardly moved the field is that of where it was, to second order: 2 N of force
    // times 1e-10 mm.
    SCOPED_TRACE(round);
    EXPECT_NEAR(found, fresh.energy().contact, 1e-9);
    const std::vector<Touch>& touches = bench.contact.touches();
    const std::vector<Touch>& expected = fresh.touches();
    ASSERT_EQ(touches.size(), expected.size());
    for (std::size_t k = 0; k < touches.size(); ++k) {
      EXPECT_EQ(touches[k].point, expected[k].point);
      EXPECT_NEAR(touches[k].normal_force, expected[k].normal_force, 1e-6);
      EXPECT_LT((touches[k].normal - expected[k].normal).norm(), 1e-6);
      followed += touches[k].normal_force != expected[k].normal_force ? 1 : 0;
    }
    (found > 0.0 ? touched : missed) += 1.0;
  }
  EXPECT_GT(touched, 50.0);
  EXPECT_GT(missed, 20.0);
  EXPECT_GT(followed, 20);  // by their last bits
}

// ---------------------------------------------------------------- steps

TEST(Newton, GivesUpSoonWhereTheEnergyJumps) {
  // Beyond the field's band, 2 mm outside the lumen, a wire feels nothing; within it the wall's
  // whole force. A load bends a wire from out there to where that starts, and no further.
  const VesselModel vessel(shapes::straight_tube(2.0, 40.0, 0.6), {.band = 2.0});
  Bench bench(round_wire(30.0, 0.5, 50.0), 30, vessel, {},
              [](double s) { return Vec3(4.5, 0.0, 5.0 + s); });
  bench.problem.proximal = pinned();
  bench.problem.proximal.tangent = Vec3::UnitZ();
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, bench.rod.nodes());
  load(0, bench.rod.nodes() - 1) = -0.01;  // bends the tip by 1.8 mm
  bench.problem.load = &load;
  const NewtonResult result = bench.statics.solve(bench.problem, bench.state, {});
  EXPECT_FALSE(result.converged);
  EXPECT_NEAR(bench.state.x(0, bench.rod.nodes() - 1), 4.0, 0.5);
  EXPECT_LT(result.iterations, 60);
}

TEST(Newton, LengthensStepsOfAWireThatJumps) {
  // A strut in a wide tube, all but straight, under a load far past the one at which it buckles: it
  // goes from the saddle to the wall and along that. With whole steps at most the five loads take
  // 74 to 86 iterations each, 400 in all; steps that are lengthened take 47 to 57, 260 in all.
  constexpr double kRadius = 12.0, kLength = 40.0, kStiffness = 50.0;
  const VesselModel vessel(shapes::straight_tube(kRadius, 60.0, 1.5), {.band = 4.0});
  int iterations = 0;
  for (const double factor : {18.0, 19.0, 20.0, 21.0, 22.0}) {
    Bench bench(round_wire(kLength, 0.5, kStiffness), 40, vessel, {},
                [](double s) { return Vec3(1e-4 * std::sin(kPi * s / kLength), 0.0, 10.0 + s); });
    bench.problem.proximal = pinned();
    bench.problem.distal = held_across(Vec3::UnitZ());
    Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, bench.rod.nodes());
    load(2, bench.rod.nodes() - 1) = -factor * kPi * kPi * kStiffness / (kLength * kLength);
    bench.problem.load = &load;
    SCOPED_TRACE(factor);
    const NewtonResult result = bench.statics.solve(bench.problem, bench.state, {});
    EXPECT_TRUE(result.converged);
    EXPECT_LE(bench.state.x.topRows<2>().colwise().norm().maxCoeff(), kRadius - 0.5 + 0.1);
    iterations += result.iterations;
  }
  EXPECT_LT(iterations, 330);
}

TEST(SafeStep, IsLengthenedNoFurtherThanItLooks) {
  // A load pulls a wire out of an open end, where nothing holds it: the lowest energy along a step
  // is infinitely far on.
  const Surface surface = shapes::straight_tube(2.0, 40.0, 0.6);
  const VesselModel vessel(surface, {.band = 2.0, .openings = find_openings(surface)});
  Bench bench(round_wire(30.0, 0.5, 50.0), 30, vessel, {},
              [](double s) { return Vec3(0.0, 0.0, 12.0 + s); });
  bench.problem.proximal = held_across(Vec3::UnitZ());
  bench.problem.proximal.tangent = Vec3::UnitZ();
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, bench.rod.nodes());
  load(2, bench.rod.nodes() - 1) = 0.01;
  bench.problem.load = &load;
  constexpr int kIterations = 4;
  const NewtonResult result =
      bench.statics.solve(bench.problem, bench.state, {.max_iterations = kIterations});
  EXPECT_FALSE(result.converged);
  const double way = bench.state.x(2, bench.rod.nodes() - 1) - 42.0;
  EXPECT_GT(way, 5.0);
  // A last doubling goes as far as one look, from where the steps before it led.
  EXPECT_LT(way, kIterations * 2.0 * (vessel.lumen.band() + 0.25));
}

TEST(SafeStep, SlidesAlongTheWallButNotThroughIt) {
  constexpr double kRadius = 5.0, kOff = 4.4;
  const VesselModel vessel(shapes::straight_tube(kRadius, 100.0, 1.0));
  Bench bench(round_wire(10.0, 0.5, 50.0), 10, vessel, {},
              [&](double s) { return Vec3(kOff, 0.0, 40.0 + s); });
  bench.contact.begin(bench.state);
  const double distance = vessel.lumen.distance(Vec3(kOff, 0.0, 45.0));
  constexpr double kInto = 0.25;  // a point may go so far past the wall                     [mm]
  // Largest way of the whole wire in one direction, of 20 mm.
  const auto way = [&](const Vec3& direction, int looks) {
    const Eigen::VectorXd motion = (20.0 * direction).replicate(bench.rod.nodes(), 1);
    return 20.0 * bench.contact.largest_safe_part({0, bench.rod.nodes(), 3, motion}, looks);
  };
  // One look: as far as it is from the wall and a quarter of a millimetre, whichever way.
  EXPECT_NEAR(way(Vec3::UnitZ(), 1), distance + kInto, 0.02);
  EXPECT_NEAR(way(Vec3::UnitX(), 1), distance + kInto, 0.02);
  // Along the wall each look leads on; across it none does.
  EXPECT_NEAR(way(Vec3::UnitZ(), 4), 4.0 * (distance + kInto), 0.08);
  EXPECT_TRUE(std::isinf(way(Vec3::UnitZ(), 32)));
  EXPECT_EQ(way(Vec3::UnitX(), 32), way(Vec3::UnitX(), 1));
  // Inward it goes to the wall on the other side, and aslant to where it comes to this one.
  const double across = way(-Vec3::UnitX(), 32);
  EXPECT_GT(across, kOff + kRadius - 0.3);
  EXPECT_LT(across, kOff + kRadius + kInto + 0.05);
  const Vec3 aslant(std::sin(0.1), 0.0, std::cos(0.1));
  const double slid = way(aslant, 32) * aslant[0];
  EXPECT_GT(slid, distance - 0.1);
  EXPECT_LT(slid, distance + kInto + 0.05);
}

}  // namespace
}  // namespace wireplan::simulate
