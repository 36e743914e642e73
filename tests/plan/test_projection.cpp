// Views of the C-arm, against answers by hand.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "plan/anatomy/projection.h"

namespace wireplan::plan {
namespace {

void expect_view(const Projection& p, double rotation_deg, double tilt_deg) {
  EXPECT_NEAR(p.view.rotation / kRadPerDeg, rotation_deg, 1e-6);
  EXPECT_NEAR(p.view.tilt / kRadPerDeg, tilt_deg, 1e-6);
  EXPECT_NEAR(p.trunk_foreshortening, 0.0, 1e-9);
  EXPECT_NEAR(p.branch_foreshortening, 0.0, 1e-9);
}

TEST(Projection, OfBranchesOfAVerticalAorta) {
  const double c30 = std::cos(30 * kRadPerDeg), c45 = std::cos(45 * kRadPerDeg);
  const struct {
    Vec3 branch;
    double rotation_deg;
  } answers[] = {{Vec3(1, 0, 0), 0.0},         // to the left: from the front
                 {Vec3(-1, 0, 0), 0.0},        // to the right: too
                 {Vec3(0, -1, 0), 90.0},       // to the front: lateral, from the left
                 {Vec3(c30, 0.5, 0), 30.0},    // a left renal artery, 30 deg behind the left
                 {Vec3(c45, -c45, 0), -45.0},  // 45 deg in front of the left: from the right
                 {Vec3(c45, -c45, 1).normalized(), -45.0}};  // and upward: in the same plane
  for (const auto& [branch, rotation_deg] : answers) {
    SCOPED_TRACE(branch.transpose());
    for (const double sign : {1.0, -1.0}) {
      const Projections found = find_projections(sign * Vec3::UnitZ(), branch);
      EXPECT_TRUE(found.best.reachable);
      expect_view(found.best, rotation_deg, 0.0);
    }
  }
}

/// A direction turned by an angle about an axis across it.
Vec3 turned(const Vec3& direction, double angle, double about) {
  const Vec3 u = direction.unitOrthogonal(), v = direction.cross(u);
  return std::cos(angle) * direction +
         std::sin(angle) * (std::cos(about) * u + std::sin(about) * v);
}

TEST(Projection, NoiseOfATenthOfADegreeDoesNotChooseTheView) {
  const double c30 = std::cos(30 * kRadPerDeg), c45 = std::sqrt(0.5);
  const Vec3 up = Vec3::UnitZ(), left = Vec3::UnitX(), back = Vec3::UnitY();
  const Vec3 lean = Vec3(0.0, std::sin(20 * kRadPerDeg), std::cos(20 * kRadPerDeg));
  const struct {
    Vec3 trunk, branch;
    double lao, cranial, second_lao, second_cranial;  // NaN: not by hand
    bool reachable = true;
  } answers[] = {
      {up, left, 0, 0, 0, 30},
      {up, -left, 0, 0, 0, 30},
      {up, -back, 90, 0, 90, 30},
      {up, back, 90, 0, 90, 30},
      {up, Vec3(c30, 0.5, 0), 30, 0, 30, 30},
      {up, Vec3(-c30, 0.5, 0), -30, 0, -30, 30},
      {up, Vec3(c45, -c45, 0), -45, 0, -45, 30},
      {up, Vec3(-c45, -c45, 0), 45, 0, 45, 30},
      {lean, left, 0, 20, 0, -10},
      {Vec3(0, -lean.y(), lean.z()), left, 0, -20, 0, 10},
      // Along the table: to the front it is seen from head or feet, at 45 deg up at the arm's
      // limit.
      {left, up, 0, 0, 30, 0},
      {left, -back, 0, 90, 45, 45, false},
      {left, Vec3(0, -c45, c45), 0, -45, kNone, kNone},
      {left, Vec3(0, c30, -0.5), 0, -60, 0, -45, false},
      // In one line.
      {up, up, 0, 0, 30, 0},
      {left, left, 0, 0, 0, 30},
      {back, back, 90, 0, 90, 30},
  };
  const double noise = 0.1 * kRadPerDeg;
  for (const auto& of : answers) {
    for (int k = 0; k < 16; ++k) {
      SCOPED_TRACE(testing::Message()
                   << of.trunk.transpose() << " and " << of.branch.transpose() << ", " << k);
      const double sign = k % 2 == 0 ? 1.0 : -1.0;  // whichever way the trunk goes on
      const Projections found = find_projections(sign * turned(of.trunk, noise, 2.4 * k),
                                                 turned(of.branch, noise, 1.7 * k));
      ASSERT_TRUE(found.second);
      EXPECT_EQ(found.best.reachable, of.reachable);
      EXPECT_TRUE(found.second->reachable);
      EXPECT_NEAR(found.best.view.rotation / kRadPerDeg, of.lao, 0.3);
      EXPECT_NEAR(found.best.view.tilt / kRadPerDeg, of.cranial, 0.3);
      if (std::isnan(of.second_lao)) continue;
      // Where the best is out of reach the second is flat: 0.1 deg moves it by 0.6.
      const double moves = of.reachable ? 0.4 : 0.7;
      EXPECT_NEAR(found.second->view.rotation / kRadPerDeg, of.second_lao, moves);
      EXPECT_NEAR(found.second->view.tilt / kRadPerDeg, of.second_cranial, moves);
    }
  }
}

TEST(Projection, ATiltedTrunkAsksForATiltedArm) {
  // Its head end leans back, and a branch goes to the left: (0, sin t, cos t) x (1, 0, 0) is
  // (0, cos t, -sin t), so the detector stands at (0, -cos t, sin t), in front and toward the head.
  const double t = 20.0 * kRadPerDeg;
  const Vec3 trunk(0.0, std::sin(t), std::cos(t));
  expect_view(find_projections(trunk, Vec3::UnitX()).best, 0.0, 20.0);
  expect_view(find_projections(Vec3(0.0, -std::sin(t), std::cos(t)), Vec3::UnitX()).best, 0.0,
              -20.0);
}

TEST(Projection, OutOfReachIsToldAndTheSecondIsWithinReach) {
  // Trunk to the back, branch to the left: only from the head or the feet.
  const Projections found = find_projections(Vec3::UnitY(), Vec3::UnitX());
  EXPECT_FALSE(found.best.reachable);
  EXPECT_NEAR(found.best.view.tilt / kRadPerDeg, 90.0, 1e-6);
  EXPECT_EQ(found.best.view.rotation, 0.0);
  ASSERT_TRUE(found.second);
  EXPECT_TRUE(found.second->reachable);
  EXPECT_LE(std::abs(found.second->view.tilt), 45.0 * kRadPerDeg + 1e-9);
}

TEST(Projection, SecondIsThirtyDegreesAwayAcrossTheBranch) {
  // Across a branch to the left: views in the plane x = 0, 30 deg cranial or caudal, in which the
  // trunk is short by 1 - cos 30.
  const Projections found = find_projections(Vec3::UnitZ(), Vec3::UnitX());
  ASSERT_TRUE(found.second);
  EXPECT_NEAR(found.second->view.rotation, 0.0, 1e-6);  // sought to 1e-9
  EXPECT_NEAR(found.second->view.tilt / kRadPerDeg, 30.0, 1e-6);
  EXPECT_NEAR(found.second->branch_foreshortening, 0.0, 1e-9);
  EXPECT_NEAR(found.second->trunk_foreshortening, 1.0 - std::cos(30.0 * kRadPerDeg), 1e-9);
}

}  // namespace
}  // namespace wireplan::plan
