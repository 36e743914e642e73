// Studies whose ranking is known by how the vessel is made.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "plan/batch.h"
#include "plan/ranking.h"
#include "tests/shapes.h"

namespace wireplan::plan {
namespace {

simulate::Wire wire_of(const std::string& name, double EI, double radius = 0.4) {
  return {.name = name, .radius = radius, .sections = {{.length = 120.0, .bending_stiffness = EI}}};
}

struct Answer {
  std::vector<Candidate> candidates;
  BatchResult batch;
  std::vector<Measured> measured;
  Ranking ranking;
};

Answer solve(const Study& study, const simulate::VesselModel& vessel, const Centerline& path) {
  Answer answer;
  answer.candidates = list_candidates(study);
  answer.batch = run_batch(study, answer.candidates, vessel, {.threads = 2});
  for (const simulate::TrialResult& trial : answer.batch.trials) {
    answer.measured.push_back(measure(trial, study, path));
  }
  answer.ranking = rank(study, answer.candidates, answer.measured, {}, {});
  return answer;
}

Centerline path_along(const Eigen::Matrix3Xd& axis, double radius) {
  Centerline path;
  path.points = axis;
  path.radius = Eigen::VectorXd::Constant(axis.cols(), radius);
  path.arc_length = arc_length_of(axis);
  return path;
}

/// A tube of radius 3 mm that bends by 90 deg on 25 mm, symmetric in y, and a target behind the
/// bend.
struct Bend {
  Eigen::Matrix3Xd axis = shapes::bend_axis(25.0, 0.5 * kPi, 20.0, 25.0, 1.0);
  simulate::VesselModel vessel{shapes::bend_tube(3.0, 25.0, 0.5 * kPi, 20.0, 25.0, 1.0)};
  Centerline path = path_along(axis, 3.0);
  Study study;

  Bend() {
    study.inclinations = study.azimuths = study.rolls = {0.0};
    study.access = Vec3(0.0, 0.0, 5.0);
    study.goal = {.point = axis.col(axis.cols() - 8), .radius = 3.5};
    study.insertion.length = 90.0;
    study.insertion.step = 2.0;
    study.insertion.element_length = 2.0;
    study.insertion.friction = 0.04;
  }
  Answer solved() const { return solve(study, vessel, path); }
};

TEST(Construction, AWireTooStiffForTheBendLosesAndSaysWhy) {
  Bend bend;
  bend.study.wires = {wire_of("rod", 1e6), wire_of("stiff", 600.0), wire_of("soft", 20.0)};
  const Answer answer = bend.solved();
  ASSERT_FALSE(answer.ranking.plans.empty());
  EXPECT_EQ(answer.candidates[answer.ranking.plans[0].trial].wire, 2);
  for (const RankedPlan& plan : answer.ranking.plans) EXPECT_NE(plan.trial, 0) << plan.sentence;
  ASSERT_FALSE(answer.ranking.excluded.empty());
  EXPECT_EQ(answer.ranking.excluded[0].trial, 0);
  EXPECT_GT(answer.ranking.excluded[0].reason.size(), 20u);
  if (answer.measured[1].metrics.reached) {
    EXPECT_GT(answer.measured[1].metrics.peak_contact_force,
              5.0 * answer.measured[2].metrics.peak_contact_force);
  }
}

TEST(Construction, AWireThickerThanTheLumenIsAnOutcomeWithItsReason) {
  // The thickest wire that a case may have, 3 mm, in a tube of 2.4 mm.
  const simulate::VesselModel vessel(shapes::straight_tube(1.2, 40.0, 0.5));
  Eigen::Matrix3Xd axis(3, 2);
  axis << 0.0, 0.0, 0.0, 0.0, 5.0, 35.0;
  Bend bend;
  bend.study.wires = {wire_of("hose", 20.0, 1.5)};
  bend.study.goal = {.point = Vec3(0.0, 0.0, 30.0), .radius = 1.0};
  const Answer answer = solve(bend.study, vessel, path_along(axis, 1.2));
  EXPECT_TRUE(answer.ranking.plans.empty());
  ASSERT_EQ(answer.ranking.excluded.size(), 1u);
  EXPECT_GT(answer.ranking.excluded[0].reason.size(), 20u);
  EXPECT_NE(answer.batch.trials[0].outcome, simulate::Outcome::kFailed)
      << "not a fault of ours: " << answer.ranking.excluded[0].reason;
}

TEST(Construction, MirroredAzimuthsMirror) {
  Bend bend;
  bend.study.wires = {wire_of("soft", 50.0)};
  bend.study.inclinations = {12.0 * kRadPerDeg};
  // Azimuth 0 is -y and the vessel lies in the plane of x and z: a and 180 deg - a are mirrored.
  const double a = 40.0 * kRadPerDeg;
  bend.study.azimuths = {a, kPi - a};
  const Answer answer = bend.solved();
  const simulate::TrialResult &one = answer.batch.trials[0], &other = answer.batch.trials[1];
  ASSERT_EQ(one.outcome, other.outcome);
  ASSERT_EQ(one.nodes.cols(), other.nodes.cols());
  Eigen::Matrix3Xd mirrored = other.nodes;
  mirrored.row(1) *= -1.0;
  EXPECT_GT(one.nodes.row(1).cwiseAbs().maxCoeff(), 1.0) << "not in the plane of symmetry";
  // The grid of the wall's field is not symmetric: its spline is off the facets by as much.
  EXPECT_LT((one.nodes - mirrored).colwise().norm().maxCoeff(), 0.05);
  EXPECT_NEAR(answer.measured[0].metrics.peak_contact_force,
              answer.measured[1].metrics.peak_contact_force,
              0.02 * answer.measured[0].metrics.peak_contact_force);
  if (!answer.ranking.plans.empty()) {
    EXPECT_EQ(answer.ranking.plans[0].tied_with.size(), 1u);
  }
}

TEST(Construction, AStraightTubeDoesNotCareForAzimuth) {
  const double length = 60.0;
  const simulate::VesselModel vessel(shapes::straight_tube(4.0, length, 1.0));
  Eigen::Matrix3Xd axis(3, 2);
  axis << 0.0, 0.0, 0.0, 0.0, 5.0, 45.0;
  Study study;
  study.wires = {wire_of("soft", 50.0)};
  study.inclinations = {15.0 * kRadPerDeg};
  study.azimuths = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0};
  study.rolls = {0.0};
  study.access = Vec3(0.0, 0.0, 5.0);
  study.goal = {.point = Vec3(0.0, 0.0, 45.0), .radius = 4.0};
  study.insertion.length = 50.0;
  study.insertion.step = 2.0;
  study.insertion.element_length = 2.0;
  const Answer answer = solve(study, vessel, path_along(axis, 4.0));
  ASSERT_EQ(answer.ranking.plans.size(), 6u);
  // The wall is off a circle by its facets' 0.03 mm, of 4 mm that the wire is bent by.
  const double force = answer.measured[0].metrics.peak_contact_force;
  EXPECT_GT(force, 0.01);
  for (const Measured& m : answer.measured) {
    EXPECT_NEAR(m.metrics.peak_contact_force, force, 0.05 * force);
  }
  for (const RankedPlan& plan : answer.ranking.plans) {
    EXPECT_EQ(plan.tied_with.size(), 5u) << plan.sentence;
  }
}

}  // namespace
}  // namespace wireplan::plan
