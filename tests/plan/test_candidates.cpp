#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <set>
#include <tuple>

#include "plan/candidates.h"

namespace wireplan::plan {
namespace {

simulate::Wire straight_wire(const std::string& name) {
  return {.name = name, .radius = 0.4, .sections = {{.length = 300.0, .bending_stiffness = 500.0}}};
}

simulate::Wire curved_wire(const std::string& name) {
  simulate::Wire wire = straight_wire(name);
  wire.sections.front().rest_curvature = 0.1;
  return wire;
}

Study study_of(std::vector<simulate::Wire> wires) {
  Study study;
  study.wires = std::move(wires);
  study.inclinations = {0.0, 15.0 * kRadPerDeg, 30.0 * kRadPerDeg};
  study.azimuths = {0.0, 90.0 * kRadPerDeg, 180.0 * kRadPerDeg, 270.0 * kRadPerDeg};
  study.rolls = {0.0, 90.0 * kRadPerDeg};
  return study;
}

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

TEST(ListCandidates, ListsEachWayOfEnteringOnce) {
  // A straight wire: 1 + 2 x 4 directions. A curved one: as many, each with two rolls.
  const auto candidates = list_candidates(study_of({straight_wire("a"), curved_wire("b")}));
  ASSERT_EQ(candidates.size(), 9u + 18u);
  std::set<std::tuple<int, double, double, double>> distinct;
  for (const Candidate& c : candidates) {
    distinct.insert({c.wire, c.inclination, c.inclination == 0.0 ? 0.0 : c.azimuth,
                     c.wire == 0 ? 0.0 : c.roll});
  }
  EXPECT_EQ(distinct.size(), candidates.size());
}

TEST(ListCandidates, KeepsWiresOutermostAndRollInnermost) {
  const auto candidates = list_candidates(study_of({curved_wire("a"), curved_wire("b")}));
  const auto key = [](const Candidate& c) {
    return std::tuple(c.wire, c.inclination, c.azimuth, c.roll);
  };
  ASSERT_EQ(candidates.size(), 36u);
  for (std::size_t k = 1; k < candidates.size(); ++k) {
    EXPECT_LT(key(candidates[k - 1]), key(candidates[k])) << k;
  }
}

TEST(ListCandidates, DropsAnglesThatRepeatAFullTurn) {
  Study study = study_of({curved_wire("a")});
  study.inclinations = {0.2, 0.2};
  study.azimuths = {0.0, kPi, 2.0 * kPi, -kPi};
  study.rolls = {0.5, 0.5 + 2.0 * kPi};
  EXPECT_EQ(list_candidates(study).size(), 2u);
}

TEST(ListCandidates, RefusesAnEmptyList) {
  Study study = study_of({straight_wire("a")});
  study.azimuths.clear();
  EXPECT_THROW(list_candidates(study), LogicError);
}

TEST(IntroducerDirection, IsTiltedFromTheTangentByTheInclination) {
  // Tangents along the axes, among them front to back, and a general one.
  const Vec3 tangents[] = {Vec3::UnitX(),
                           Vec3::UnitY(),
                           -Vec3::UnitY(),
                           -Vec3::UnitZ(),
                           Vec3(0.02, 1.0, 0.03).normalized(),
                           Vec3(1.0, -2.0, 2.0) / 3.0};
  for (const Vec3& tangent : tangents) {
    SCOPED_TRACE(tangent.transpose());
    for (const double inclination : {0.0, 0.3, 1.2}) {
      for (const double azimuth : {0.0, 1.0, 4.0}) {
        const Vec3 d = introducer_direction(tangent, inclination, azimuth);
        EXPECT_NEAR(d.norm(), 1.0, 1e-15);                           // rounding
        EXPECT_NEAR(angle_between(tangent, d), inclination, 1e-14);  // rounding
      }
    }
  }
}

TEST(IntroducerDirection, AzimuthZeroIsAnteriorAndTurnsRightHanded) {
  // Up the aorta (+z): anterior is -y, and right-handed round +z leads from -y to +x.
  const Vec3 up = Vec3::UnitZ();
  const double tilt = 0.3, c = std::cos(tilt), s = std::sin(tilt);
  const auto is_near = [](const Vec3& a, const Vec3& b) { return (a - b).norm() < 1e-15; };
  EXPECT_TRUE(is_near(introducer_direction(up, tilt, 0.0), Vec3(0.0, -s, c)));
  EXPECT_TRUE(is_near(introducer_direction(up, tilt, 0.5 * kPi), Vec3(s, 0.0, c)));
  EXPECT_TRUE(is_near(introducer_direction(up, tilt, kPi), Vec3(0.0, s, c)));
  // Down the aorta the same azimuth turns the other way as seen from above.
  EXPECT_TRUE(is_near(introducer_direction(-up, tilt, 0.5 * kPi), Vec3(-s, 0.0, -c)));
}

TEST(IntroducerDirection, AzimuthZeroIsSuperiorWhereTheTangentRunsFrontToBack) {
  const double tilt = 0.3, c = std::cos(tilt), s = std::sin(tilt);
  EXPECT_LT((introducer_direction(Vec3::UnitY(), tilt, 0.0) - Vec3(0.0, c, s)).norm(), 1e-15);
  EXPECT_LT((introducer_direction(-Vec3::UnitY(), tilt, 0.0) - Vec3(0.0, -c, s)).norm(), 1e-15);
  // Right-handed round +y leads from +z to +x.
  EXPECT_LT((introducer_direction(Vec3::UnitY(), tilt, 0.5 * kPi) - Vec3(s, c, 0.0)).norm(), 1e-15);
}

TEST(IntroducerDirection, TurnsWithTheAzimuthByTheSameAngle) {
  const Vec3 tangent = Vec3(1.0, -2.0, 2.0) / 3.0;
  const Vec3 start = introducer_direction(tangent, 0.4, 0.7);
  const Vec3 turned = Eigen::AngleAxisd(1.1, tangent) * start;
  EXPECT_LT((introducer_direction(tangent, 0.4, 1.8) - turned).norm(), 1e-15);  // rounding
}

TEST(IntroducerDirection, TakesATangentOfAnyLengthButZero) {
  const Vec3 tangent(1.0, -2.0, 2.0);
  const Vec3 d = introducer_direction(7.0 * tangent, 0.4, 0.7);
  EXPECT_LT((d - introducer_direction(tangent, 0.4, 0.7)).norm(), 1e-15);  // rounding
  EXPECT_THROW(introducer_direction(Vec3::Zero(), 0.4, 0.7), LogicError);
}

TEST(Describe, NamesTheWireAndItsAnglesInDegrees) {
  const Study study = study_of({straight_wire("amplatz-stiff")});
  const Candidate candidate{
      .wire = 0, .inclination = 22.5 * kRadPerDeg, .azimuth = 270.0 * kRadPerDeg, .roll = -0.0};
  EXPECT_EQ(describe(study, candidate),
            "amplatz-stiff, inclination 22.5 deg, azimuth 270 deg, roll 0 deg");
}

}  // namespace
}  // namespace wireplan::plan
