// What the report tells of a vessel that moves as a whole, of motions whose answer is known.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "pipeline/report/motion_json.h"
#include "pipeline/stages/held_places.h"
#include "tests/messages.h"

namespace wireplan::pipeline {
namespace {

using preprocess::Branch;

Centerline straight_line(const Vec3& from, const Vec3& to, double radius) {
  const int count = 1 + static_cast<int>(std::lround((to - from).norm()));
  Centerline line{.points = Eigen::Matrix3Xd(3, count),
                  .radius = Eigen::VectorXd::Constant(count, radius),
                  .arc_length = Eigen::VectorXd::LinSpaced(count, 0.0, (to - from).norm())};
  for (int k = 0; k < count; ++k) line.points.col(k) = from + (to - from) * k / (count - 1);
  return line;
}

/// A trunk up z of 200 mm and a branch toward the patient's left that the way takes at 100 mm.
struct LeftBranch {
  std::vector<Branch> tree = {{.line = straight_line(Vec3::Zero(), Vec3(0, 0, 200), 10.0)},
                              {.line = straight_line(Vec3(0, 0, 100), Vec3(60, 0, 100), 3.0),
                               .parent = 0,
                               .parent_arc = 100.0}};
  simulate::Way way{join(), tree};
  simulate::SectionChain chain{tree, {.support = 1e-3}};

  Centerline join() const {
    Centerline line = straight_line(Vec3::Zero(), Vec3(0, 0, 150), 10.0);
    for (int k = 101; k <= 150; ++k) {
      line.points.col(k) = Vec3(k - 100.0, 0, 100);
      line.radius[k] = 3.0;
    }
    return line;
  }
  Json moved(const std::function<Vec3(const Vec3&)>& to, bool axes_known = true) const {
    Eigen::Matrix3Xd u = chain.places();
    for (auto column : u.colwise()) column = (to(Vec3(column)) - Vec3(column)).eval();
    return motion_json(way, chain, u, {}, axes_known);
  }
};

TEST(VesselMotion, OfATranslationIsTheSameForAllAndTurnsNothing) {
  const Vec3 along(1.0, -2.0, 2.0);
  const Json motion = LeftBranch().moved([&](const Vec3& p) { return Vec3(p + along); });
  EXPECT_NEAR(motion.at("most_mm"), 3.0, 1e-12);
  ASSERT_EQ(motion.at("ostia").size(), 1u);
  EXPECT_NEAR(motion.at("ostia")[0].at("shift_mm"), 3.0, 1e-12);
  EXPECT_NEAR(motion.at("moved_way_length_mm"), motion.at("way_length_mm"), 1e-9);
  ASSERT_EQ(motion.at("turns").size(), 1u);
  const Json& turn = motion.at("turns")[0];
  EXPECT_NEAR(turn.at("at_rest_deg"), 90.0, 0.1);
  EXPECT_NEAR(turn.at("moved_deg").get<double>(), turn.at("at_rest_deg").get<double>(), 1e-6);
  EXPECT_NEAR(turn.at("moved_from_access_mm").get<double>(),
              turn.at("from_access_mm").get<double>(), 1e-6);
  EXPECT_LT(turn.at("view_change_deg"), 1e-4);  // an arc cosine near 1
}

TEST(VesselMotion, OfATurnAboutTheTrunkTurnsTheArmAsFar) {
  // Trunk and branch lie in the coronal plane, seen from the front; turned by 8 degrees toward the
  // back the arm follows.
  const Mat3 turned(Eigen::AngleAxisd(8.0 * kRadPerDeg, Vec3::UnitZ()));
  const Json motion = LeftBranch().moved([&](const Vec3& p) { return Vec3(turned * p); });
  const Json& turn = motion.at("turns").at(0);
  EXPECT_NEAR(turn.at("view_at_rest").at("rotation_deg"), 0.0, 0.1);
  EXPECT_NEAR(turn.at("view_change_deg"), 8.0, 0.4);  // weights carry such motion within 0.5 %,
                                                      // less well round the fork
  EXPECT_NEAR(std::abs(turn.at("view_moved").at("rotation_deg").get<double>()), 8.0, 0.4);
  EXPECT_NEAR(turn.at("moved_deg"), 90.0, 1.0);
}

TEST(VesselMotion, WithoutKnownAxesOnlyTheChangeOfAViewIsTold) {
  const Mat3 turned(Eigen::AngleAxisd(8.0 * kRadPerDeg, Vec3::UnitZ()));
  const Json motion =
      LeftBranch().moved([&](const Vec3& p) { return Vec3(turned * p); }, /*axes_known=*/false);
  const Json& turn = motion.at("turns").at(0);
  EXPECT_TRUE(turn.at("view_at_rest").is_null() && turn.at("view_moved").is_null());
  EXPECT_NEAR(turn.at("view_change_deg"), 8.0, 0.4);
}

TEST(VesselMotion, ArteriesThatLeaveTheTrunkAreHeldAtTheirOstia) {
  const LeftBranch vessel;
  WallInput wall;
  wall.support = 1e-3;
  wall.held.clear();
  const auto moved_at = [&](const Vec3& place) {
    const auto chain = make_section_chain(wall, vessel.tree, Vec3::Zero(), 0.0);
    // What it costs to shift the sections near the place by 1 mm, which the support alone resists.
    Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, chain->nodes()), gradient = u;
    for (int k = 0; k < chain->nodes(); ++k) {
      if ((chain->places().col(k) - place).norm() < 6.0) u.col(k) = Vec3(1, 0, 0);
    }
    return chain->energy(u, gradient);
  };
  const Vec3 ostium(10, 0, 100), access(0, 0, 0), end(0, 0, 192);
  const double free_ostium = moved_at(ostium), free_access = moved_at(access),
               free_end = moved_at(end);
  wall.held = {{.at = HeldPlace::At::kOstia, .radius = 8.0, .factor = 100.0}};
  EXPECT_GT(moved_at(ostium), 20.0 * free_ostium);
  EXPECT_NEAR(moved_at(access), free_access, 1e-9 * free_access);
  EXPECT_NEAR(moved_at(end), free_end, 1e-9 * free_end);
  wall.held = {{.at = HeldPlace::At::kPoint, .point = end, .radius = 8.0, .factor = 10.0}};
  EXPECT_GT(moved_at(end), 5.0 * free_end);
  EXPECT_LT(moved_at(end), 10.0 * free_end);
  EXPECT_NEAR(moved_at(ostium), free_ostium, 1e-9 * free_ostium);
}

TEST(VesselMotion, APointThatHoldsNothingIsRefused) {
  const LeftBranch vessel;
  WallInput wall;
  wall.support = 1e-3;
  const HeldPlace near{.at = HeldPlace::At::kPoint, .point = Vec3(15, 0, 50), .radius = 8.0};
  HeldPlace far = near;
  far.point = Vec3(0, 17, 50);
  const auto make = [&] { make_section_chain(wall, vessel.tree, Vec3::Zero(), 0.0); };
  wall.held = {near};
  EXPECT_NO_THROW(make());
  wall.held = {near, far, far};
  const std::string text = message_of(make);
  for (const char* part :
       {"wall.held[1].point_mm is (0.0, 17.0, 50.0) mm, 17.0 mm from the middle of the vessel, "
        "expected less than 16, twice its radius_mm",
        "wall.held[2]"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
  EXPECT_EQ(text.find("wall.held[0]"), std::string::npos) << text;
}

TEST(VesselMotion, SpreadIsThatOfTheRepeats) {
  const LeftBranch vessel;
  std::vector<Json> repeats;
  for (const double far : {3.0, 1.0, 2.0}) {
    repeats.push_back(vessel.moved([&](const Vec3& p) { return Vec3(p + far * Vec3::UnitY()); }));
  }
  const Json spread = motion_spread_json(repeats);
  EXPECT_EQ(spread.at("repeats"), 3);
  EXPECT_NEAR(spread.at("most_mm").at("median"), 2.0, 1e-12);
  const Json& shift = spread.at("ostia").at(0).at("shift_mm");
  EXPECT_NEAR(shift.at("low"), 1.1, 1e-12);  // central 90 % of three values
  EXPECT_NEAR(shift.at("high"), 2.9, 1e-12);
  EXPECT_EQ(spread.at("ostia")[0].at("branch"), repeats[0].at("ostia")[0].at("branch"));
  EXPECT_NEAR(spread.at("turns").at(0).at("moved_deg").at("median"), 90.0, 0.1);

  // A turn that the first repeat undoes is that of the others.
  repeats[0].at("turns") = Json::array();
  const Json fewer = motion_spread_json(repeats);
  ASSERT_EQ(fewer.at("turns").size(), 1u);
  EXPECT_EQ(fewer.at("turns")[0].at("branch"), spread.at("turns")[0].at("branch"));
}

}  // namespace
}  // namespace wireplan::pipeline
