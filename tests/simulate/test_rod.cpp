#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "simulate/wire/rod.h"

namespace wireplan::simulate {
namespace {

Wire two_sections() {
  return {.name = "two",
          .radius = 0.4,
          .sections = {{.length = 10.0, .bending_stiffness = 5.0},
                       {.length = 90.0, .bending_stiffness = 500.0, .mass_per_length = 1e-8}}};
}

TEST(Rod, SpreadsLengthAndMassOverItsNodes) {
  const Rod rod = build_rod(two_sections(), 100.0, 40);
  EXPECT_EQ(rod.nodes(), 41);
  EXPECT_NEAR(rod.rest_length.sum(), 100.0, 1e-12);  // rounding of 40 terms
  EXPECT_NEAR(rod.share.sum(), 100.0, 1e-12);
  EXPECT_NEAR(rod.mass.sum(), 90.0 * 1e-8, 1e-20);
  EXPECT_DOUBLE_EQ(rod.tip_distance[0], 100.0);
  EXPECT_DOUBLE_EQ(rod.tip_distance[40], 0.0);
}

TEST(Rod, ListsSectionsFromTheTipBackwards) {
  const Rod rod = build_rod(two_sections(), 100.0, 100);
  EXPECT_DOUBLE_EQ(rod.bend[95], 5.0);  // 5 mm from the tip, elements of 1 mm
  EXPECT_DOUBLE_EQ(rod.bend[50], 500.0);
}

TEST(Rod, ActsAsSpringsInSeriesWhereStiffnessChanges) {
  const Rod rod = build_rod(two_sections(), 100.0, 100);
  // The node at the joint, 10 mm from the tip, has half a millimetre of either side.
  EXPECT_NEAR(rod.bend[90], 1.0 / (0.5 / 5.0 + 0.5 / 500.0), 1e-12);
}

/// The integral of a taper's 1/EI from a to b of its length, by Simpson's rule on `law`, which has
/// EI at a place from 0 to 1.
template <class Law>
double integrate_compliance(const Law& law, double length, double a, double b) {
  constexpr int kParts = 2000;  // odd-even error (b - a)^4 / kParts^4
  double sum = 0.0;
  for (int i = 0; i <= kParts; ++i) {
    const double weight = i == 0 || i == kParts ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    sum += weight / law(a + (b - a) * i / kParts);
  }
  return sum * length * (b - a) / (3.0 * kParts);
}

TEST(Section, TapersGiveWayAsTheIntegralOfTheirCompliance) {
  Section section{.length = 60.0, .bending_stiffness = 3.0, .proximal_bending_stiffness = 521.0};
  const auto linear = [](double part) { return 3.0 + part * (521.0 - 3.0); };
  const auto cone = [](double part) {
    const double diameter = 1.0 + part * (std::pow(521.0 / 3.0, 0.25) - 1.0);  // of the thin end's
    return 3.0 * std::pow(diameter, 4);
  };
  for (const auto& [a, b] : {std::pair(0.0, 1.0), std::pair(0.0, 0.02), std::pair(0.3, 0.9)}) {
    SCOPED_TRACE(b);
    section.taper = Taper::kLinear;
    const double of_linear = integrate_compliance(linear, 60.0, a, b);
    EXPECT_NEAR(section.bend_compliance(60.0 * a, 60.0 * (b - a)), of_linear, 1e-6 * of_linear);
    section.taper = Taper::kCone;
    const double of_cone = integrate_compliance(cone, 60.0, a, b);
    const double bend = section.bend_compliance(60.0 * a, 60.0 * (b - a));
    EXPECT_NEAR(bend, of_cone, 1e-6 * of_cone);
    // EA and GJ follow EI along the taper, unless they are given.
    EXPECT_NEAR(section.twist_compliance(60.0 * a, 60.0 * (b - a)), 1.3 * bend, 1e-12 * bend);
    EXPECT_NEAR(section.axial_compliance(60.0 * a, 60.0 * (b - a), 0.4), 0.04 * bend, 1e-12 * bend);
  }
  section.axial_stiffness = 1e4;
  EXPECT_DOUBLE_EQ(section.axial_compliance(10.0, 20.0, 0.4), 20.0 / 1e4);
  EXPECT_DOUBLE_EQ(section.ea(0.4), 1e4);
}

TEST(Section, ATaperToNearlyTheSameStiffnessIsNoTaper) {
  Section section{.length = 60.0,
                  .bending_stiffness = 30.0,
                  .proximal_bending_stiffness = 30.0 * (1.0 + 1e-13)};
  for (const Taper taper : {Taper::kLinear, Taper::kCone}) {
    section.taper = taper;
    EXPECT_NEAR(section.bend_compliance(10.0, 40.0), 40.0 / 30.0, 1e-12);
  }
}

TEST(Rod, ATaperIsTheSameInOneSectionAsInMany) {
  // Each step with the EI of the taper's mean compliance over it: the same springs in series.
  Wire taper = two_sections(), steps = two_sections();
  taper.sections.insert(taper.sections.begin() + 1, {.length = 40.0,
                                                     .bending_stiffness = 5.0,
                                                     .proximal_bending_stiffness = 500.0,
                                                     .taper = Taper::kCone});
  const Section& whole = taper.sections[1];
  for (int k = 39; k >= 0; --k) {
    steps.sections.insert(
        steps.sections.begin() + 1,
        {.length = 1.0, .bending_stiffness = 1.0 / whole.bend_compliance(k, 1.0)});
  }
  const Rod one = build_rod(taper, 140.0, 70), many = build_rod(steps, 140.0, 70);
  EXPECT_TRUE(one.bend.isApprox(many.bend, 1e-12));
  EXPECT_TRUE(one.stretch.isApprox(many.stretch, 1e-12));
  EXPECT_TRUE(one.twist.isApprox(many.twist, 1e-12));
  EXPECT_GT(one.bend[55], 1.05 * one.bend[56]);  // 30 mm from the tip it rises from node to node
}

TEST(Rod, TakesSolidRoundStiffnessWhereNoneIsGiven) {
  const Rod rod = build_rod(two_sections(), 100.0, 100);
  EXPECT_DOUBLE_EQ(rod.stretch[0], 16.0 * 500.0 / (0.8 * 0.8));  // EA = 16 EI / d^2
  EXPECT_DOUBLE_EQ(rod.twist[50], 500.0 / 1.3);                  // G = E / 2.6
  EXPECT_FALSE(rod.twisted);
}

TEST(Rod, KnowsBothStiffnessesOfAStrip) {
  Wire wire = two_sections();
  wire.sections[0].bending_stiffness_2 = 2.0;
  EXPECT_TRUE(wire.straight());
  EXPECT_FALSE(wire.round());
  const Rod rod = build_rod(wire, 100.0, 100);
  EXPECT_TRUE(rod.twisted);
  EXPECT_DOUBLE_EQ(rod.bend[95], 2.0);  // the smaller one, elements of 1 mm
  EXPECT_DOUBLE_EQ(rod.strip[95], -3.0);
  EXPECT_EQ(rod.strip[50], 0.0);  // of the round section
  EXPECT_DOUBLE_EQ(rod.distal_bend, 4.0);
  EXPECT_DOUBLE_EQ(rod.distal_strip, -6.0);
  EXPECT_DOUBLE_EQ(rod.largest_bend(), 500.0);
}

TEST(Rod, RestShapeStartsAlongTheTangentOfItsEnd) {
  Wire wire = two_sections();
  for (Section& section : wire.sections) section.rest_curvature = 0.02;
  const Rod rod = build_rod(wire, 100.0, 50);  // edges of 2 mm turn by 0.04 rad
  const RodState state = rest_state(rod, Vec3::Zero(), Vec3::UnitX(), 0.0);
  const Vec3 first = state.x.col(1) - state.x.col(0);
  EXPECT_NEAR(std::atan2(-first.y(), first.x()), 0.02, 1e-12);  // toward the director, -y
  EXPECT_NEAR(rod.distal_rest_angle, 0.02, 1e-12);
}

TEST(Rod, RefusesMoreWireThanThereIs) {
  EXPECT_THROW(build_rod(two_sections(), 100.1, 10), LogicError);
}

TEST(ReferenceNormal, IsAnteriorMadeNormalToTheAxis) {
  EXPECT_TRUE(reference_normal(Vec3::UnitZ()).isApprox(Vec3(0.0, -1.0, 0.0)));
  EXPECT_TRUE(reference_normal(Vec3::UnitY()).isApprox(Vec3(0.0, 0.0, 1.0)));
  const Vec3 axis = Vec3(1.0, -2.0, 0.5).normalized();
  EXPECT_NEAR(reference_normal(axis).dot(axis), 0.0, 1e-15);
  EXPECT_LT(reference_normal(axis).y(), 0.0);
}

TEST(ParallelTransport, KeepsLengthAndNormalityWithoutTwist) {
  const Vec3 from = Vec3(1.0, 2.0, 3.0).normalized(), to = Vec3(2.0, -1.0, 2.0).normalized();
  const Vec3 v = 0.7 * from.unitOrthogonal();
  const Vec3 carried = parallel_transport(v, from, to);
  EXPECT_NEAR(carried.norm(), 0.7, 1e-15);
  EXPECT_NEAR(carried.dot(to), 0.0, 1e-15);
  // What is normal to both tangents stays as it is.
  const Vec3 axis = from.cross(to);
  EXPECT_TRUE(parallel_transport(axis, from, to).isApprox(axis, 1e-14));
}

TEST(TransportFrames, CarriesAClosedTourOfTheTangentIntoItsSolidAngle) {
  // The first edge turns x -> y -> z -> x, round an octant of the sphere: its director comes back
  // turned by the solid angle, pi/2, while the second edge and its director stay; the twist between
  // them is the difference.
  const Wire wire = two_sections();
  const Rod rod = build_rod(wire, 100.0, 2);
  RodState state = straight_state(rod, Vec3::Zero(), Vec3::UnitX(), 0.0);
  const auto with_first_edge = [&](const Vec3& direction) {
    RodState moved = state;
    moved.x.col(0) = moved.x.col(1) - 50.0 * direction;
    transport_frames(state, moved, 0, 0);
    return moved;
  };
  const double start = state.reference_twist[1];
  for (const Vec3& corner : {Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ()), Vec3(Vec3::UnitX())}) {
    state = with_first_edge(corner);
  }
  EXPECT_NEAR(std::abs(state.reference_twist[1] - start), 0.5 * kPi, 1e-12);
}

}  // namespace
}  // namespace wireplan::simulate
