#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "simulate/contact/contact_force.h"
#include "simulate/insertion/trial.h"
#include "tests/shapes.h"
#include "tests/simulate/random_values.h"

namespace wireplan::simulate {
namespace {

Touch touch_at(double tip_distance, double share, const Vec3& force) {
  Touch touch;
  touch.tip_distance = tip_distance;
  touch.share = share;
  touch.normal = force.normalized();
  touch.normal_force = force.norm();
  return touch;
}

double peak_of(const std::vector<Touch>& touches) {
  std::vector<Vec3> sums;
  return peak_force_on_length(touches, 5.0, sums);
}

TEST(ContactForce, AnEvenLoadDoesNotHangOnTheSpacing) {
  // 0.3 N/mm over 20 mm.
  for (const double spacing : {2.0, 1.0, 0.7, 0.5, 0.25}) {
    SCOPED_TRACE(spacing);
    std::vector<Touch> touches;
    for (double s = 40.0; s >= 20.0; s -= spacing) {
      touches.push_back(touch_at(s, spacing, Vec3(0.0, 0.3 * spacing, 0.0)));
    }
    EXPECT_NEAR(peak_of(touches), 1.5, 1e-12);
  }
}

TEST(ContactForce, AddsWhatLiesWithinTheLengthAndNoMore) {
  const Touch a = touch_at(30.0, 1.0, Vec3::UnitX()), b = touch_at(26.5, 1.0, Vec3::UnitY());
  EXPECT_NEAR(peak_of({a}), 1.0, 1e-12);
  EXPECT_NEAR(peak_of({a, b}), std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(peak_of({a, touch_at(20.0, 1.0, Vec3::UnitX())}), 1.0, 1e-12);
  EXPECT_NEAR(peak_of({a, touch_at(26.5, 1.0, -Vec3::UnitX())}), 1.0, 1e-12);  // opposite walls
  EXPECT_EQ(peak_of({}), 0.0);
}

TEST(ContactForce, FindsTheLargestOfAllPlaces) {
  std::mt19937_64 random(5);
  for (int run = 0; run < 50; ++run) {
    std::vector<Touch> touches;
    for (double s = 40.0; s > 0.5; s -= 1.0) {
      if (uniform(random) < 0.0) continue;
      touches.push_back(touch_at(s, 1.0, Vec3(uniform(random), uniform(random), 0.0)));
    }
    // Looked for in steps of 0.01 mm, from which the sum changes by no more than 0.02 N.
    double found = 0.0;
    for (double from = -6.0; from < 41.0; from += 0.01) {
      Vec3 sum = Vec3::Zero();
      for (const Touch& touch : touches) {
        sum += (part_within(touch, from + 5.0) - part_within(touch, from)) * force_on_wire(touch);
      }
      found = std::max(found, sum.norm());
    }
    const double peak = peak_of(touches);
    EXPECT_GE(peak, found - 1e-12);
    EXPECT_LE(peak, found + 0.03);
  }
}

TEST(ContactForce, PeaksOfATrialDoNotHangOnTheSpacing) {
  const VesselModel vessel(shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5),
                           {.grid_spacing = 0.6});
  const Wire wire = {
      .name = "w", .radius = 0.445, .sections = {{.length = 300.0, .bending_stiffness = 500.0}}};
  const auto peak = [&](double spacing) {
    double largest = 0.0;
    const TrialResult trial =
        run_trial(wire, {.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ()},
                  {.point = Vec3(0.0, 0.0, 1e3)}, vessel,
                  {.length = 110.0, .element_length = 1.0, .contact_spacing = spacing});
    for (const Push& push : trial.pushes) largest = std::max(largest, push.peak_contact_force);
    return largest;
  };
  const double fine = peak(0.25);
  EXPECT_GT(fine, 0.01);
  EXPECT_NEAR(peak(1.0), fine, 0.05 * fine);
  EXPECT_NEAR(peak(0.5), fine, 0.05 * fine);
}

}  // namespace
}  // namespace wireplan::simulate
