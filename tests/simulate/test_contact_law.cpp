#include <gtest/gtest.h>

#include "simulate/contact/contact_law.h"

namespace wireplan::simulate {
namespace {

TEST(ContactLaw, IsThePapersLinearForceBelowItsSmoothing) {
  const ContactLaw law{LinearLaw{.stiffness = 20.0, .smoothing = 0.05}};
  EXPECT_DOUBLE_EQ(law.at(-0.3).slope, -20.0 * 0.3);  // f = k_c d
  EXPECT_DOUBLE_EQ(law.at(0.05).energy, 0.0);
  EXPECT_DOUBLE_EQ(law.at(1.0).slope, 0.0);
}

TEST(ContactLaw, EnergyForceAndStiffnessAreContinuousAndAgree) {
  const ContactLaw law{LinearLaw{.stiffness = 20.0, .smoothing = 0.05}};
  for (const double gap : {-0.05, 0.05}) {
    const ContactLaw::Value below = law.at(gap - 1e-9), above = law.at(gap + 1e-9);
    EXPECT_NEAR(below.energy, above.energy, 1e-8);
    EXPECT_NEAR(below.slope, above.slope, 1e-7);
    EXPECT_NEAR(below.curvature, above.curvature, 1e-5);
  }
  const double h = 1e-5;
  for (const double gap : {-0.2, -0.04, 0.0, 0.03}) {
    EXPECT_NEAR((law.at(gap + h).energy - law.at(gap - h).energy) / (2 * h), law.at(gap).slope,
                1e-7);
    EXPECT_NEAR((law.at(gap + h).slope - law.at(gap - h).slope) / (2 * h), law.at(gap).curvature,
                1e-6);
  }
}

TEST(ContactLaw, ChordPassesThroughTheForceAtTheGapAndTheExpectedOne) {
  const ContactLaw law{LinearLaw{.stiffness = 20.0, .smoothing = 0.05}};
  for (const double gap : {-0.3, -0.06, -0.04, 0.0, 0.03, 0.2}) {
    for (const double other : {-0.4, -0.05, -0.01, 0.02, 0.05}) {
      const double expected = -law.at(other).slope;
      EXPECT_NEAR(law.chord(gap, expected) * (gap - other), expected + law.at(gap).slope, 1e-12)
          << gap << " " << other;
    }
    if (gap > 0.05) continue;
    EXPECT_NEAR(law.chord(gap, -law.at(gap).slope), law.at(gap).curvature, 1e-9) << gap;
  }
  EXPECT_DOUBLE_EQ(law.chord(0.2, 0.0), 0.0);
}

}  // namespace
}  // namespace wireplan::simulate
