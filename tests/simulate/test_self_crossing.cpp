#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "simulate/insertion/scene.h"
#include "simulate/insertion/trial.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

std::optional<SelfCrossing> find_crossing(const Eigen::Matrix3Xd& nodes, double radius) {
  return CrossingFinder().find(nodes, radius);
}

/// Least distance of points every 0.05 mm of a wire that are more than `apart` apart along it, and
/// in the middle between which: as slow as it is simple.
struct Nearest {
  double distance = 1e9;
  Vec3 point = Vec3::Zero();
};
Nearest nearest_parts(const Eigen::Matrix3Xd& nodes, double apart) {
  std::vector<Vec3> points;
  std::vector<double> arc;
  double before = 0.0;
  for (Eigen::Index i = 0; i + 1 < nodes.cols(); ++i) {
    const Vec3 edge = nodes.col(i + 1) - nodes.col(i);
    const int parts = static_cast<int>(std::ceil(edge.norm() / 0.05));
    for (int k = 0; k < parts; ++k) {
      const double part = static_cast<double>(k) / parts;
      points.push_back(nodes.col(i) + part * edge);
      arc.push_back(before + part * edge.norm());
    }
    before += edge.norm();
  }
  Nearest nearest;
  for (std::size_t a = 0; a < points.size(); ++a) {
    for (std::size_t b = a + 1; b < points.size(); ++b) {
      if (arc[b] - arc[a] <= apart) continue;
      const double distance = (points[a] - points[b]).norm();
      if (distance < nearest.distance) nearest = {distance, 0.5 * (points[a] + points[b])};
    }
  }
  return nearest;
}

TEST(SelfCrossing, IsFoundInAHelixWhosePitchIsLessThanTheWireIsThick) {
  const double R = 10.0, radius = 0.5;
  for (const double pitch : {0.9, 0.99, 1.01, 1.1}) {
    SCOPED_TRACE(pitch);
    const Eigen::Matrix3Xd helix = shapes::helix_axis(R, pitch, 6.0 * kPi, 0.5);
    const std::optional<SelfCrossing> found = find_crossing(helix, radius);
    EXPECT_EQ(found.has_value(), pitch < 2.0 * radius);
    if (!found) continue;
    // Turns lie side by side, as far apart as the pitch is seen along them; one turn lies between.
    const double turn = std::hypot(2.0 * kPi * R, pitch);
    EXPECT_NEAR(found->distance, pitch * 2.0 * kPi * R / turn, 1e-4);
    EXPECT_NEAR(found->other_from_tip - found->from_tip, turn, 0.05);
    EXPECT_NEAR(found->point.head<2>().norm(), R, 0.01);
  }
}

/// Along +x through the origin, round by 270 degrees, and back over the origin along -y, `height`
/// higher.
Eigen::Matrix3Xd make_loop(double height, double step) {
  std::vector<Vec3> points;
  for (double x = -20.0; x < 20.0 - 1e-9; x += step) points.emplace_back(x, 0.0, 0.0);
  const int arcs = static_cast<int>(1.5 * kPi * 20.0 / step);
  for (int k = 0; k <= arcs; ++k) {
    const double angle = -0.5 * kPi + 1.5 * kPi * k / arcs;
    points.emplace_back(20.0 + 20.0 * std::cos(angle), 20.0 + 20.0 * std::sin(angle),
                        height * k / arcs);
  }
  for (double y = 20.0 - step; y > -20.0 - 1e-9; y -= step) points.emplace_back(0.0, y, height);
  Eigen::Matrix3Xd nodes(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t k = 0; k < points.size(); ++k) {
    nodes.col(static_cast<Eigen::Index>(k)) = points[k];
  }
  return nodes;
}

TEST(SelfCrossing, IsToldWithItsPlaceAndBothParts) {
  for (const double step : {0.5, 1.25}) {
    SCOPED_TRACE(step);
    const std::optional<SelfCrossing> found = find_crossing(make_loop(0.36, step), 0.2);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->distance, 0.36, 1e-9);
    EXPECT_LT((found->point - Vec3(0.0, 0.0, 0.18)).norm(), 1e-6);
    EXPECT_NEAR(found->from_tip, 20.0, 1e-9);
    EXPECT_NEAR(found->other_from_tip, 20.0 + 20.0 + 1.5 * kPi * 20.0 + 20.0, 0.1);
    EXPECT_EQ(describe_crossing(*found, 0.2).substr(0, 44),
              "the wire crosses itself at (0.0, 0.0, 0.2) m");
    EXPECT_FALSE(find_crossing(make_loop(0.41, step), 0.2));
  }
}

TEST(SelfCrossing, IsNotSeenInBends) {
  // Straight, and bows of two turns of all sizes that a wire can have, their turns wide apart.
  EXPECT_FALSE(find_crossing(shapes::helix_axis(1e6, 0.0, 1e-4, 1.0), 0.5));
  for (const double radius : {1.5, 3.0, 12.0, 40.0}) {
    EXPECT_FALSE(find_crossing(shapes::helix_axis(radius, 3.0, 4.0 * kPi, 0.25), 0.45)) << radius;
  }
}

TEST(SelfCrossing, IsWhatASlowSearchFinds) {
  std::mt19937_64 generator(5);
  const auto draw = [&] { return 2.0 * static_cast<double>(generator() >> 11) * 0x1.0p-53 - 1.0; };
  int crossing = 0, free_of_it = 0;
  CrossingFinder finder;  // one for all: its memory is used again
  for (int n = 0; n < 40; ++n) {
    Eigen::Matrix3Xd waves(3, 8);
    for (double& part : waves.reshaped()) part = draw();
    Eigen::Matrix3Xd nodes(3, 240);
    for (Eigen::Index k = 0; k < nodes.cols(); ++k) {
      Vec3 point = Vec3::Zero();
      for (int wave = 0; wave < 4; ++wave) {
        const double angle = 0.6 * (wave + 1) * 2.0 * kPi * static_cast<double>(k) / 239.0;
        point +=
            8.0 / (wave + 1) *
            (std::cos(angle) * waves.col(2 * wave) + std::sin(angle) * waves.col(2 * wave + 1));
      }
      nodes.col(k) = point;
    }
    const double radius = 0.4;
    const std::optional<SelfCrossing> found = finder.find(nodes, radius);
    // Of edges that are only in part 2 mm apart, outer nodes alone are looked at: so it finds at
    // least what is two edges further apart, and nothing that is nearer. Points every 0.05 mm see
    // a distance of 0.8 mm to 0.002 mm, and one of nothing to 0.04 mm.
    const double edge = (nodes.rightCols(239) - nodes.leftCols(239)).colwise().norm().maxCoeff();
    const Nearest surely = nearest_parts(nodes, 2.0 + 2.0 * edge),
                  at_most = nearest_parts(nodes, 2.0);
    if (found) {
      EXPECT_GE(found->distance, at_most.distance - 0.05) << n;
      EXPECT_LE(found->distance, surely.distance + 1e-9) << n;
      ++crossing;
    } else {
      EXPECT_GE(surely.distance, 2.0 * radius) << n;
      ++free_of_it;
    }
  }
  EXPECT_GE(crossing, 5);
  EXPECT_GT(free_of_it, 5);
}

/// A soft wire of 0.36 mm pushed into a hollow sphere.
struct Packing {
  Wire wire{
      .name = "soft", .radius = 0.18, .sections = {{.length = 400.0, .bending_stiffness = 1.0}}};
  double radius;
  VesselModel vessel;
  InsertionOptions options{
      .length = 250.0, .step = 2.0, .element_length = 1.0, .friction = 0.1, .record_every = 2.0};

  explicit Packing(double size)
      : radius(size), vessel(shapes::sphere(Vec3::Zero(), size, 1.5), {.grid_spacing = 0.6}) {}
  TrialResult run() const {
    const Introducer introducer{.point = Vec3(1.0, 0.5, 2.0 - radius),
                                .direction = Vec3(0.1, 0.05, 1.0).normalized()};
    return run_trial(wire, introducer, {.point = Vec3(1e3, 0.0, 0.0), .radius = 1.0}, vessel,
                     options);
  }
};

TEST(Packing, EndsWhereTheWireCrossesItselfAndNotBefore) {
  int crossing = 0;
  for (const double size : {7.5, 15.0}) {
    SCOPED_TRACE(size);
    Packing packing(size);
    const TrialResult trial = packing.run();
    ASSERT_FALSE(trial.shapes.empty());
    const bool crosses = trial.outcome == Outcome::kCrossesItself;
    EXPECT_EQ(trial.crossing.has_value(), crosses) << trial.reason;
    for (std::size_t k = 0; k < trial.shapes.size(); ++k) {
      const bool last = crosses && k + 1 == trial.shapes.size();
      const double distance = nearest_parts(trial.shapes[k].nodes, 4.1).distance;
      if (!last) {
        EXPECT_GT(distance, 2.0 * packing.wire.radius - 1e-9) << k;
      }
    }
    if (!crosses) continue;
    ++crossing;
    const Nearest nearest = nearest_parts(trial.nodes, 4.1);
    EXPECT_LT(nearest.distance, 2.0 * packing.wire.radius + 0.01);
    EXPECT_LT((nearest.point - trial.crossing->point).norm(), 0.2);
    EXPECT_EQ(trial.crossing->insertion, trial.pushes.back().insertion);
    EXPECT_EQ(trial.reason.substr(0, 23), "the wire crosses itself");
  }
  EXPECT_GT(crossing, 0);
}

TEST(Packing, APushedOnWireGoesOnAndTellsWhereItCrossed) {
  Packing packing(7.5);
  packing.options.push_on = true;
  packing.options.length = 120.0;
  const TrialResult trial = packing.run();
  EXPECT_NE(trial.outcome, Outcome::kCrossesItself) << trial.reason;
  ASSERT_TRUE(trial.crossing);
  EXPECT_LT(trial.crossing->insertion, trial.pushes.back().insertion);
  for (const Shape& shape : trial.shapes) {
    const double distance = nearest_parts(shape.nodes, 4.1).distance;
    if (shape.insertion < trial.crossing->insertion - 1e-9) {
      EXPECT_GT(distance, 2.0 * packing.wire.radius - 1e-9) << shape.insertion;
    }
  }
}

TEST(Scene, TellsThatAWireThatIsRolledUpCrossesItself) {
  // Rolled up by an end moment to less and more than a whole circle, on a table.
  for (const double turns : {0.9, 1.1}) {
    SCOPED_TRACE(turns);
    Scene scene;
    scene.wire = {
        .name = "beam", .radius = 0.2, .sections = {{.length = 60.0, .bending_stiffness = 20.0}}};
    scene.elements = 120;
    scene.supports = {{.at = WireEnd::kProximal, .kind = SupportKind::kClamped}};
    scene.loads.tip_moment = 2.0 * kPi * turns * 20.0 / 60.0 * Vec3::UnitY();
    scene.plane = Vec3::UnitY();
    const SceneResult result = run_scene(scene);
    ASSERT_EQ(result.outcome, SceneOutcome::kConverged);
    EXPECT_EQ(result.crossing.has_value(), turns > 1.0);
  }
}

}  // namespace
}  // namespace wireplan::simulate
