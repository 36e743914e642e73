// What holds a vessel whose cross-sections move, among the disturbances.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "plan/robustness.h"
#include "tests/plan/tube_study.h"

namespace wireplan::plan {
namespace {

TEST(Disturbances, OfTheSupportLeaveTheOthersAsTheyAre) {
  RobustnessOptions options{.repeats = 32};
  const auto without = draw_disturbances(options, {});
  options.unknowns.support_low = 0.1;
  options.unknowns.support_high = 10.0;
  const auto with = draw_disturbances(options, {});
  double below = 0.0;
  for (std::size_t k = 0; k < with.size(); ++k) {
    EXPECT_EQ(without[k].support_factor, 1.0);
    EXPECT_EQ(with[k].wall_factor, without[k].wall_factor);
    EXPECT_EQ(with[k].tilt, without[k].tilt);
    EXPECT_EQ(with[k].inward, without[k].inward);
    EXPECT_GE(with[k].support_factor, 0.1);
    EXPECT_LE(with[k].support_factor, 10.0);
    below += with[k].support_factor < 1.0 ? 1.0 : 0.0;
  }
  EXPECT_EQ(below, 16.0);  // evenly in the logarithm, one in each part
}

TEST(RunDisturbed, ASupportFactorIsThatOfTheSupport) {
  const TubeStudy tube;
  preprocess::Branch middle;
  middle.line.points.resize(3, 51);
  for (int k = 0; k <= 50; ++k) middle.line.points.col(k) = Vec3(0.0, 0.0, k);
  middle.line.radius.setConstant(51, 4.0);
  middle.line.arc_length = Eigen::VectorXd::LinSpaced(51, 0.0, 50.0);
  const auto last = [&](double support, const Disturbance& disturbance) {
    simulate::VesselModel vessel = tube.vessel(0.056);
    vessel.sections = std::make_unique<simulate::SectionChain>(
        std::vector{middle}, simulate::SectionChainOptions{.support = support});
    const simulate::TrialResult trial =
        run_disturbed(tube.study, tube.candidate, vessel, disturbance);
    EXPECT_FALSE(trial.pushes.empty()) << trial.reason;
    return trial;
  };
  const auto moved = [](const simulate::TrialResult& trial) {
    return trial.sections.colwise().norm().maxCoeff();
  };
  const simulate::TrialResult soft = last(1e-3, {}), three = last(3e-3, {}),
                              factor = last(1e-3, {.support_factor = 3.0});
  EXPECT_GT(moved(soft), 1.5 * moved(three));
  EXPECT_NEAR(moved(factor), moved(three), 1e-3 * moved(three));  // repeats end at 1e-5 N
  EXPECT_NEAR(factor.pushes.back().total_contact_force, three.pushes.back().total_contact_force,
              1e-3 * three.pushes.back().total_contact_force);
}

}  // namespace
}  // namespace wireplan::plan
