// Cross-sections across a line: how wide they are, what else runs through them, and that edges of
// a lumen that is not round are no branches of the tree.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "preprocess/centerline/centerline.h"
#include "preprocess/centerline/section_width.h"
#include "preprocess/surface/surface.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

/// A straight line along z, 10 to 50 mm, at this distance from the axis.
Centerline line_along_z(double beside) {
  constexpr Eigen::Index kPoints = 81;
  Centerline line{Eigen::Matrix3Xd::Zero(3, kPoints), Eigen::VectorXd::Constant(kPoints, 2.0),
                  Eigen::VectorXd::LinSpaced(kPoints, 0.0, 40.0)};
  line.points.row(0).setConstant(beside);
  line.points.row(2) = (line.arc_length.array() + 10.0).matrix().transpose();
  return line;
}

/// A tube along z of 60 mm whose section is an ellipse of these half axes along x and y [mm].
Surface oval_tube(double half_x, double half_y) {
  return shapes::level_set(
      [=](const Vec3& p) {
        const double part = std::hypot(p.x() / half_x, p.y() / half_y);
        return std::min({4.0 * (1.0 - part), p.z(), 60.0 - p.z()});
      },
      Vec3(-half_x - 1.0, -half_y - 1.0, -1.0), Vec3(half_x + 1.0, half_y + 1.0, 61.0), 0.5);
}

TEST(SectionWidth, OfATubeIsItsDiameterWhereverTheLineRuns) {
  const Surface tube = shapes::straight_tube(4.0, 60.0, 0.8);
  for (const double beside : {0.0, 2.5}) {
    const Eigen::VectorXd diameters = section_diameters(tube, line_along_z(beside));
    EXPECT_NEAR(diameters.minCoeff(), 8.0, 0.06);
    EXPECT_NEAR(diameters.maxCoeff(), 8.0, 0.06);
  }
}

TEST(SectionWidth, OfAnEllipseIsThatOfTheCircleOfItsArea) {
  const Eigen::VectorXd diameters = section_diameters(oval_tube(2.0, 5.0), line_along_z(0.0));
  EXPECT_NEAR(diameters.mean(), 2.0 * std::sqrt(10.0), 0.1);
}

TEST(SectionWidth, DoesNotCountTheBranchThatACutRunsInto) {
  // A branch of 1.5 mm, 20 mm long, at right angles to a tube of 4 mm: its cut is 60 mm^2 more.
  const Surface tube = shapes::level_set(
      [](const Vec3& p) {
        const double trunk = std::min({4.0 - std::hypot(p.x(), p.y()), p.z(), 60.0 - p.z()});
        const double branch =
            std::min({1.5 - std::hypot(p.y(), p.z() - 30.0), p.x(), 24.0 - p.x()});
        return std::max(trunk, branch);
      },
      Vec3(-5.0, -5.0, -1.0), Vec3(25.0, 5.0, 61.0), 0.5);
  for (const double beside : {-1.0, 0.0, 1.5}) {
    SCOPED_TRACE(beside);
    const Eigen::VectorXd diameters = section_diameters(tube, line_along_z(beside));
    EXPECT_NEAR(diameters.minCoeff(), 8.0, 0.15);
    EXPECT_NEAR(diameters.maxCoeff(), 8.0, 0.15);
  }
}

TEST(SectionWidth, IsAcrossTheVesselThatALineIsAboutToLeave) {
  // Along the axis of a tube of 8 mm and, from its middle on, out at right angles into a branch of
  // 3 mm: there the chord of one radius to either side runs at 45 degrees, and the cut across it
  // holds 1.4 times the tube's section and the branch.
  const Surface tube = shapes::level_set(
      [](const Vec3& p) {
        const double trunk = std::min({8.0 - std::hypot(p.x(), p.y()), p.z(), 60.0 - p.z()});
        const double branch =
            std::min({3.0 - std::hypot(p.y(), p.z() - 30.0), p.x(), 30.0 - p.x()});
        return std::max(trunk, branch);
      },
      Vec3(-9.0, -9.0, -1.0), Vec3(31.0, 9.0, 61.0), 0.7);
  Centerline line = line_along_z(0.0);
  line.radius.setConstant(7.9);
  for (Eigen::Index k = 41; k < line.points.cols(); ++k) {
    line.points.col(k) = Vec3(line.arc_length(k) - 20.0, 0.0, 30.0);
  }
  const Eigen::VectorXd diameters = section_diameters(tube, line);
  EXPECT_NEAR(diameters.head(38).minCoeff(), 16.0, 0.4);
  EXPECT_NEAR(diameters.head(38).maxCoeff(), 16.0, 0.8);
  EXPECT_NEAR(diameters(75), 6.0, 0.2);  // 17.5 mm from the trunk's axis
}

TEST(SectionWidth, WhereALineLeavesAVesselForABranchIsTheBranchs) {
  // Out of a tube of 8 mm into a branch of 2 mm at right angles: where that begins the line still
  // turns, and cuts across it go through the tube too.
  const Vec3 mouth(0.0, 0.0, 30.0), away(1.0, 0.0, 0.0);
  const Surface tube = shapes::level_set(
      [&](const Vec3& p) {
        const double trunk = std::min({8.0 - std::hypot(p.x(), p.y()), p.z(), 80.0 - p.z()});
        return std::max(trunk, shapes::depth_in_tube(p, mouth, mouth + 60.0 * away, 2.0));
      },
      Vec3(-9.0, -9.0, -1.0), Vec3(62.0, 9.0, 81.0), 0.7);
  const Centerline line = find_centerline(tube, Vec3(0.0, 0.0, 5.0), mouth + 55.0 * away);
  const Eigen::VectorXd diameters = section_diameters(tube, line);
  int outside = 0;
  for (Eigen::Index k = 0; k < line.points.cols(); ++k) {
    const double along = (line.points.col(k) - mouth).dot(away);
    if (along < 8.5 || along > 50.0) continue;
    ++outside;
    EXPECT_NEAR(diameters(k), 4.0, 0.5) << along << " mm from the trunk's axis";
  }
  EXPECT_GT(outside, 60);
}

TEST(SectionWidth, OfALongOvalIsWholeFromItsMiddle) {
  // Three times as long as wide, as a flattened lumen may be: no end of it is a branch.
  EXPECT_NEAR(section_diameters(oval_tube(2.0, 6.0), line_along_z(0.0)).mean(),
              2.0 * std::sqrt(12.0), 0.12);
}

TEST(SectionWidth, WhereNoCutGoesRoundThePointIsTheSpheres) {
  const Surface tube = shapes::straight_tube(4.0, 60.0, 0.8);
  EXPECT_DOUBLE_EQ(section_diameters(tube, line_along_z(10.0)).maxCoeff(), 4.0);
}

TEST(SharesSection, IsOfOneLumenNotOfTwoSideBySide) {
  const Centerline here = line_along_z(6.0), there = line_along_z(-6.0);
  EXPECT_TRUE(shares_section(oval_tube(10.0, 3.0), here, 40, there));
  const Surface two = shapes::joined(
      shapes::tube((Eigen::Matrix3Xd(3, 2) << 6.0, 6.0, 0.0, 0.0, 0.0, 60.0).finished(),
                   Eigen::Vector2d(4.0, 4.0), 24),
      shapes::tube((Eigen::Matrix3Xd(3, 2) << -6.0, -6.0, 0.0, 0.0, 0.0, 60.0).finished(),
                   Eigen::Vector2d(4.0, 4.0), 24));
  EXPECT_FALSE(shares_section(two, here, 40, there));
  EXPECT_TRUE(shares_section(two, here, 40, here));
  Centerline short_one = there;  // it does not come as far as the cut
  short_one.points.row(2) *= 0.5;
  EXPECT_FALSE(shares_section(oval_tube(10.0, 3.0), here, 60, short_one));
}

/// As in a dissected aorta: a flat lumen, half a ring round an axis along z from 0 to 90 mm, 5 mm
/// thick; with side branches of 2.5 mm that leave its middle forward at 45 mm and its edge at 60
/// mm.
double depth_in_crescent(const Vec3& p) {
  constexpr double kRing = 11.0, kHalf = 2.5;
  const double around = std::atan2(p.x(), -p.y());  // 0 in the middle, which lies toward -y
  const double edge = std::clamp(around, -0.5 * kPi, 0.5 * kPi);
  const Vec3 spine(kRing * std::sin(edge), -kRing * std::cos(edge),
                   std::clamp(p.z(), kHalf, 90.0 - kHalf));
  const double lumen = kHalf - (p - spine).norm();
  return std::max({lumen, shapes::depth_in_tube(p, {0.0, -kRing, 45.0}, {0.0, -40.0, 45.0}, 2.5),
                   shapes::depth_in_tube(p, {kRing, -2.0, 60.0}, {40.0, -2.0, 60.0}, 2.5)});
}

Vec3 last_point(const Centerline& line) { return line.points.col(line.points.cols() - 1); }

TEST(CenterlineTree, EdgesOfACrescentAreNoBranches) {
  const Surface crescent =
      shapes::level_set(depth_in_crescent, {-18.0, -45.0, -4.0}, {44.0, 8.0, 94.0}, 1.0);
  const std::vector<Branch> tree = find_tree(crescent, {0.0, -11.0, 6.0});
  // Up the lumen and down to its other end, and the branch; no edge along the way.
  const auto ends_at = [&](const Vec3& place, double within) {
    return std::count_if(tree.begin(), tree.end(), [&](const Branch& branch) {
      return (last_point(branch.line) - place).norm() < within;
    });
  };
  EXPECT_EQ(ends_at({0.0, -40.0, 45.0}, 3.0), 1) << "the side branch of the middle";
  EXPECT_EQ(ends_at({40.0, -2.0, 60.0}, 3.0), 1) << "that of the edge";
  for (const Branch& branch : tree) {
    for (const auto& p : branch.line.points.colwise()) {
      ASSERT_GT(depth_in_crescent(p), 0.0) << "no line leaves the lumen";
    }
    const Vec3 end = last_point(branch.line);
    const bool aside = end.y() > -20.0 && end.x() < 15.0 && end.z() > 15.0 && end.z() < 70.0;
    EXPECT_FALSE(aside) << end.transpose();
  }
}

}  // namespace
}  // namespace wireplan::preprocess
