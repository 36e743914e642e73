#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

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
