#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "simulate/insertion/trial.h"
#include "tests/shapes.h"

namespace wireplan::simulate {
namespace {

using preprocess::find_openings;
using preprocess::Opening;

Wire straight_wire(double EI) {
  return {.name = "straight",
          .radius = 0.445,
          .sections = {{.length = 400.0, .bending_stiffness = EI}}};
}

Wire curved_wire(double EI) {
  return {.name = "curved",
          .radius = 0.445,
          .sections = {{.length = 15.0, .bending_stiffness = 5.0, .rest_curvature = 1.0 / 12.0},
                       {.length = 30.0, .bending_stiffness = 0.2 * EI},
                       {.length = 400.0, .bending_stiffness = EI}}};
}

/// Lumen of 4 mm radius that bends by 90 degrees round 40 mm, from +z to +x.
const VesselModel& bend() {
  static const VesselModel vessel(shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5),
                                  {.grid_spacing = 0.6});
  return vessel;
}

Introducer along_z() { return {.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ()}; }
Goal end_of_bend() { return {.point = Vec3(80.0, 0.0, 80.0), .radius = 5.0}; }
InsertionOptions options() { return {.length = 160.0, .step = 2.0, .element_length = 2.0}; }

TEST(Trial, ReachesTheEndOfABendInsideTheLumen) {
  for (const double EI : {50.0, 520.0, 4857.0}) {
    SCOPED_TRACE(EI);
    const TrialResult trial =
        run_trial(straight_wire(EI), along_z(), end_of_bend(), bend(), options());
    EXPECT_EQ(trial.outcome, Outcome::kReached) << trial.reason;
    for (const Push& push : trial.pushes) {
      EXPECT_LE(push.residual, 1e-6);
      // The tip stands for half a millimetre of wire, 10 N/mm; the stiffest presses with 4 N.
      EXPECT_LT(push.max_penetration, 0.45);
    }
    EXPECT_LT((trial.pushes.back().tip - end_of_bend().point).norm(), 5.0);
    EXPECT_EQ(trial.terms, (std::vector<std::string>{"stretch", "bend", "contact"}));
  }
}

TEST(Trial, EndsWhereTheTipIsNearestToTheGoal) {
  const TrialResult trial =
      run_trial(straight_wire(520.0), along_z(), end_of_bend(), bend(), options());
  const std::vector<Push>& pushes = trial.pushes;
  const auto distance = [](const Push& push) { return (push.tip - end_of_bend().point).norm(); };
  for (const Push& push : pushes) EXPECT_GE(distance(push), distance(pushes.back()));
  EXPECT_TRUE(Vec3(trial.nodes.rightCols<1>()).isApprox(pushes.back().tip, 1e-12));
}

TEST(Trial, StifferWiresPressHarder) {
  const auto peak = [](double EI) {
    double force = 0.0;
    for (const Push& push :
         run_trial(straight_wire(EI), along_z(), end_of_bend(), bend(), options()).pushes) {
      force = std::max(force, push.peak_contact_force);
    }
    return force;
  };
  const double soft = peak(50.0), stiff = peak(500.0);
  EXPECT_GT(soft, 0.0);
  // Same shape within the clearance: forces grow nearly in proportion to EI.
  EXPECT_GT(stiff, 5.0 * soft);
}

TEST(Trial, IntroducerAndWallCarryTheWireTogether) {
  const TrialResult trial =
      run_trial(straight_wire(520.0), along_z(), end_of_bend(), bend(), options());
  Vec3 wall = Vec3::Zero();
  for (const WireContact& contact : trial.contacts) wall += contact.normal_force;
  EXPECT_GT(wall.norm(), 0.01);
  // Along the introducer, push and wall balance up to what bent wire gains by sliding out of a
  // straight sleeve, M^2/(2 EI) (Bigoni et al., "Eshelby-like forces acting on elastic structures",
  // Mech. Mater. 2015). M at the exit: on the line through the moments at the next two nodes.
  const auto node = [&](int i) -> Vec3 { return trial.nodes.col(i); };
  const auto moment = [&](int i) {
    const Vec3 a = node(i) - node(i - 1), b = node(i + 1) - node(i);
    return 520.0 * a.cross(b).y() / std::pow(options().element_length, 3);
  };
  const double first = node(1).z() - along_z().point.z();
  const double M = moment(1) - first * (moment(2) - moment(1)) / options().element_length;
  const double released = M * M / (2.0 * 520.0);
  EXPECT_GT(released, 1e-3);
  // The force at this very place, not the mean over the last push.
  Insertion insertion(straight_wire(520.0), along_z(), bend(), options());
  for (std::size_t k = 0; k < trial.pushes.size(); ++k) ASSERT_TRUE(insertion.push(options().step));
  ASSERT_EQ(insertion.depth(), trial.pushes.back().insertion);
  // Residual of 1e-6 N on 80 nodes; the line through the moments is 2 % off, where M turns.
  EXPECT_NEAR(wall.z() + insertion.hand_force(), -released, 0.05 * released + 1e-4);
}

TEST(Trial, CurvedTipTurnsWithTheHub) {
  // In a wide straight lumen the tip points to where its roll says.
  const VesselModel wide(shapes::straight_tube(15.0, 100.0, 4.0), {.grid_spacing = 1.0});
  for (const double roll : {0.0, 0.5 * kPi, kPi}) {
    SCOPED_TRACE(roll);
    Introducer introducer = along_z();
    introducer.roll = roll;
    InsertionOptions some = options();
    some.length = 40.0;
    const TrialResult trial =
        run_trial(curved_wire(500.0), introducer, {.point = Vec3(0.0, 0.0, 1e3)}, wide, some);
    EXPECT_EQ(trial.outcome, Outcome::kMissed);
    const Vec3 tip = trial.nodes.rightCols<1>();
    const Vec3 toward =
        std::cos(roll) * Vec3(0.0, -1.0, 0.0) + std::sin(roll) * Vec3(1.0, 0.0, 0.0);
    EXPECT_GT(tip.dot(toward), 4.0);
    EXPECT_EQ(trial.terms, (std::vector<std::string>{"stretch", "bend", "twist", "contact"}));
  }
}

/// A straight lumen along z, its ends closed or open.
VesselModel straight_lumen(double radius, double length, bool open = false) {
  const Surface surface = shapes::straight_tube(radius, length, 0.4 * radius);
  return VesselModel(surface, {.grid_spacing = 0.15 * radius,
                               .openings = open ? find_openings(surface) : std::vector<Opening>{}});
}

/// Off the lumen's axis and not along it, so that a wire need not choose where to buckle to.
Introducer a_little_aslant() {
  return {.point = Vec3(-1.0, 0.0, 5.0),
          .direction = Vec3(std::sin(2.0 * kRadPerDeg), 0.0, std::cos(2.0 * kRadPerDeg))};
}

TEST(Trial, WireAgainstAnEndIsNamedStuckWithThePlace) {
  // Friction holds the tip; without, a wire that buckles so far may as well slip and fold back.
  const VesselModel lumen = straight_lumen(4.0, 60.0);
  for (const double step : {1.0, 2.0}) {
    SCOPED_TRACE(step);
    InsertionOptions far = options();
    far.length = 150.0;
    far.step = step;
    far.friction = 0.3;
    const TrialResult trial = run_trial(straight_wire(50.0), a_little_aslant(),
                                        {.point = Vec3(0.0, 0.0, 1e3)}, lumen, far);
    EXPECT_EQ(trial.outcome, Outcome::kStuck)
        << outcome_name(trial.outcome) << ": " << trial.reason;
    EXPECT_LT(trial.pushes.back().insertion, 149.0);
    // The tip leans on the closed end at z = 60 mm.
    const Vec3 tip = trial.pushes.back().tip;
    EXPECT_NEAR(tip.z(), 60.0, 2.0);
    EXPECT_NE(trial.reason.find(place_text(tip) + " mm"), std::string::npos) << trial.reason;
  }
}

TEST(Trial, WireAgainstAnEndIsPushedOnWhereAsked) {
  const VesselModel lumen = straight_lumen(4.0, 60.0);
  InsertionOptions far = options();
  far.length = 110.0;
  far.friction = 0.3;
  const Goal nowhere{.point = Vec3(0.0, 0.0, 1e3)};
  const TrialResult stopped =
      run_trial(straight_wire(50.0), a_little_aslant(), nowhere, lumen, far);
  ASSERT_EQ(stopped.outcome, Outcome::kStuck) << stopped.reason;
  EXPECT_TRUE(stopped.stuck.empty());
  far.push_on = true;
  const TrialResult on = run_trial(straight_wire(50.0), a_little_aslant(), nowhere, lumen, far);
  EXPECT_EQ(on.outcome, Outcome::kMissed) << on.reason;
  EXPECT_NEAR(on.pushes.back().insertion, 110.0, 1e-9);
  // The same pushes as far as the other went, and then the tip is where it stayed.
  ASSERT_GT(on.pushes.size(), stopped.pushes.size());
  for (std::size_t k = 0; k < stopped.pushes.size(); ++k) {
    EXPECT_EQ(on.pushes[k].tip, stopped.pushes[k].tip);
  }
  ASSERT_FALSE(on.stuck.empty());
  const double end = stopped.pushes.back().insertion;
  EXPECT_NEAR(on.stuck.front().first, end - 20.0, 1e-9);
  EXPECT_GE(on.stuck.front().second, end);
  for (const auto& [from, to] : on.stuck) EXPECT_LT(from + 20.0, to + 1e-9);
}

TEST(Trial, SoftWireWhoseTipStaysBehindIsNamedProlapsed) {
  // It meets the wall of a wide lumen at 65 degrees, where friction holds its tip; the wire bows
  // and goes on ahead of it.
  InsertionOptions far = options();
  far.length = 200.0;
  far.friction = 1.0;
  const double slant = 65.0 * kRadPerDeg;
  const Introducer askew = {.point = Vec3(-8.0, 0.0, 20.0),
                            .direction = Vec3(std::sin(slant), 0.0, std::cos(slant))};
  const TrialResult trial = run_trial(straight_wire(20.0), askew, {.point = Vec3(0.0, 0.0, 1e3)},
                                      straight_lumen(12.0, 150.0), far);
  EXPECT_EQ(trial.outcome, Outcome::kProlapsed)
      << outcome_name(trial.outcome) << ": " << trial.reason;
  EXPECT_NE(trial.reason.find(" mm"), std::string::npos) << trial.reason;
}

TEST(Trial, WireThatLeavesThroughAnOpenEndIsNamedSo) {
  const TrialResult trial =
      run_trial(straight_wire(520.0), along_z(), {.point = Vec3(0.0, 0.0, 1e3)},
                straight_lumen(4.0, 60.0, true), options());
  EXPECT_EQ(trial.outcome, Outcome::kLeftImage) << outcome_name(trial.outcome) << trial.reason;
  EXPECT_GT(trial.pushes.back().tip.z(), 60.0);
  EXPECT_LT(trial.pushes.back().tip.z(), 68.0);
  EXPECT_NE(trial.reason.find(" mm"), std::string::npos) << trial.reason;
}

TEST(Trial, ATipThatTurnsAsideBeyondAnOpenEndHasLeftThroughIt) {
  // A tip that curls by 8 mm comes out of a tube of 2 mm and runs over its rim, beside the end.
  const Wire hook = {
      .name = "hook",
      .radius = 0.3,
      .sections = {{.length = 40.0, .bending_stiffness = 300.0, .rest_curvature = 1.0 / 8.0},
                   {.length = 200.0, .bending_stiffness = 300.0}}};
  for (const double step : {0.5, 1.0, 5.0, 20.0}) {
    InsertionOptions some = options();
    some.step = step;
    const TrialResult trial = run_trial(hook, along_z(), {.point = Vec3(0.0, 0.0, 1e3)},
                                        straight_lumen(2.0, 60.0, true), some);
    EXPECT_EQ(trial.outcome, Outcome::kLeftImage)
        << step << " " << outcome_name(trial.outcome) << ": " << trial.reason;
  }
}

TEST(Trial, NoPushGoesThroughTheWall) {
  // In a bend that 20 mm straight on leave, beyond the field of the wall; with another vessel 1 mm
  // outside it, which a wire that gets through would go on in.
  const Surface lumen = shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5);
  Surface outside = lumen;
  outside.vertices.colwise() += Vec3(-9.0, 0.0, 9.0);
  const VesselModel vessel(shapes::joined(lumen, outside), {.grid_spacing = 0.6});
  for (const double step : {1.0, 7.0, 20.0}) {
    for (const Wire& wire : {straight_wire(5.0), straight_wire(4857.0), curved_wire(520.0)}) {
      InsertionOptions some = options();
      some.step = step;
      some.length = 140.0;
      const TrialResult trial =
          run_trial(wire, along_z(), {.point = Vec3(0.0, 0.0, 1e3)}, vessel, some);
      EXPECT_EQ(trial.outcome, Outcome::kMissed) << step << trial.reason;
      for (const Push& push : trial.pushes) {
        EXPECT_LT(push.max_penetration, 0.45) << step;
        EXPECT_LE(push.residual, 1e-6) << step;
      }
      EXPECT_LT((trial.nodes.rightCols<1>() - Vec3(80.0, 0.0, 80.0)).norm(), 8.0)
          << step << " " << trial.nodes.rightCols<1>().transpose();
    }
  }
}

TEST(Trial, WireThatTheWallCannotHoldHasLeftTheLumen) {
  // A wall as soft as none under a stiff wire yields until the wire is beyond the field.
  const Surface surface = shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 3.0);
  const VesselModel soft(surface, shapes::extruded_wall(surface, 1.0, 1e-4), {.grid_spacing = 1.0});
  for (const double step : {1.0, 20.0}) {
    InsertionOptions some = options();
    some.step = step;
    const TrialResult trial =
        run_trial(straight_wire(4857.0), along_z(), end_of_bend(), soft, some);
    EXPECT_EQ(trial.outcome, Outcome::kLeftLumen)
        << outcome_name(trial.outcome) << ": " << trial.reason;
    EXPECT_TRUE(trial.nodes.allFinite());
    for (const Push& push : trial.pushes) EXPECT_TRUE(std::isfinite(push.push_force));
  }
}

TEST(Trial, WireOnTheAxisOfALumenNarrowerThanItselfIsInIt) {
  // On the axis the field has no direction, and the wall pushes from all sides alike.
  const int rows = 30;
  Eigen::Matrix3Xd axis = Eigen::Matrix3Xd::Zero(3, rows + 1);
  axis.row(2) = Eigen::RowVectorXd::LinSpaced(rows + 1, 0.0, 60.0);
  Eigen::VectorXd radius(rows + 1);
  for (int k = 0; k <= rows; ++k)
    radius[k] = std::min(4.0, 0.4 + 0.2 * std::abs(axis(2, k) - 30.0));
  const VesselModel stenosis(shapes::tube(axis, radius, 32), {.grid_spacing = 0.4});
  InsertionOptions some = options();
  some.length = 50.0;
  const TrialResult trial =
      run_trial(straight_wire(1000.0), along_z(), {.point = Vec3(0.0, 0.0, 1e3)}, stenosis, some);
  EXPECT_EQ(trial.outcome, Outcome::kMissed) << outcome_name(trial.outcome) << ": " << trial.reason;
  for (const Push& push : trial.pushes) EXPECT_LT(push.max_penetration, 0.1);
}

// ---------------------------------------------------------------- long elements

TEST(Trial, LongElementsFeelARidgeShorterThanTheyAre) {
  // A lumen of 4 mm radius is narrowed to 1.2 mm over 3 mm of its length; the wire comes 1.5 mm
  // off the axis and has to pass through.
  constexpr int kRows = 120;
  Eigen::Matrix3Xd axis = Eigen::Matrix3Xd::Zero(3, kRows + 1);
  axis.row(2) = Eigen::RowVectorXd::LinSpaced(kRows + 1, 0.0, 120.0);
  Eigen::VectorXd radius(kRows + 1);
  for (int k = 0; k <= kRows; ++k) {
    const double from_ridge = std::abs(axis(2, k) - 55.0);
    radius[k] = from_ridge < 1.5 ? 1.2 : std::min(4.0, 1.2 + 0.4 * (from_ridge - 1.5));
  }
  const VesselModel narrowed(shapes::tube(axis, radius, 24), {.grid_spacing = 0.4});
  const Introducer beside = {.point = Vec3(1.5, 0.0, 5.0), .direction = Vec3::UnitZ()};
  const auto run = [&](double element_length) {
    InsertionOptions some = options();
    some.element_length = element_length;
    some.length = 100.0;
    return run_trial(straight_wire(520.0), beside, {.point = Vec3(0.0, 0.0, 1e3)}, narrowed, some);
  };
  const TrialResult fine = run(1.0), coarse = run(10.0);
  ASSERT_EQ(fine.outcome, Outcome::kMissed) << fine.reason;
  ASSERT_EQ(coarse.outcome, Outcome::kMissed) << coarse.reason;
  int passed = 0;
  for (const TrialResult* trial : {&fine, &coarse}) {
    for (std::size_t k = 0; k < trial->pushes.size(); ++k) {
      EXPECT_LT(trial->pushes[k].max_penetration, 0.2) << k;
    }
    // Where the wire crosses the ridge it is within the narrow lumen.
    const Eigen::Matrix3Xd& x = trial->nodes;
    for (Eigen::Index i = 0; i + 1 < x.cols(); ++i) {
      if (x(2, i) > 55.0 || x(2, i + 1) <= 55.0) continue;
      const double part = (55.0 - x(2, i)) / (x(2, i + 1) - x(2, i));
      const Vec3 at = (1.0 - part) * x.col(i) + part * x.col(i + 1);
      EXPECT_LT(at.head<2>().norm(), 1.2 - 0.445 + 0.1);
      ++passed;
    }
  }
  EXPECT_EQ(passed, 2);
  // Elements of 10 mm over a lever of 50 mm: (h/L)^2 of the force, and the ridge's edge is met up
  // to a contact point further on.
  const double force = fine.pushes.back().total_contact_force;
  EXPECT_GT(force, 0.01);
  EXPECT_NEAR(coarse.pushes.back().total_contact_force, force, 0.1 * force);
}

// ---------------------------------------------------------------- friction

TrialResult rubbed(double friction, double step,
                   int max_iterations = InsertionOptions{}.max_iterations) {
  InsertionOptions some = options();
  some.max_iterations = max_iterations;
  some.friction = friction;
  some.step = step;
  some.length = 150.0;
  return run_trial(straight_wire(520.0), along_z(), {.point = Vec3(0.0, 0.0, 1e3)}, bend(), some);
}

TEST(FrictionTrial, AWireWithFrictionOfItsOwnDoesNotTakeTheInsertions) {
  InsertionOptions some = options();
  some.length = 110.0;
  some.friction = 0.2;
  const auto push = [&](std::optional<double> own) {
    Wire wire = straight_wire(520.0);
    wire.friction = own;
    const TrialResult trial =
        run_trial(wire, along_z(), {.point = Vec3(0.0, 0.0, 1e3)}, bend(), some);
    EXPECT_FALSE(trial.pushes.empty()) << trial.reason;
    return trial.pushes.back().push_force;
  };
  const double of_insertion = push({}), own = push(0.05);
  EXPECT_EQ(push(0.2), of_insertion);
  EXPECT_LT(own, 0.6 * of_insertion);
  // The factor is on both.
  some.friction_factor = 0.25;
  EXPECT_EQ(push({}), own);
  EXPECT_EQ(push(0.2), own);
  some.friction_factor = 0.0;
  EXPECT_LT(push(0.2), own);
}

TEST(FrictionTrial, PushOvercomesWhatTheWallHoldsBack) {
  // With the tip past the bend the wire slides along itself: without friction next to no push is
  // needed, with it the push is that of the contacts' friction, each sliding.
  const TrialResult smooth = rubbed(0.0, 1.0), rough = rubbed(0.1, 1.0);
  ASSERT_EQ(smooth.outcome, Outcome::kMissed) << smooth.reason;
  ASSERT_EQ(rough.outcome, Outcome::kMissed) << rough.reason;
  EXPECT_EQ(rough.terms, (std::vector<std::string>{"stretch", "bend", "contact", "friction"}));
  double push = 0.0, smooth_push = 0.0, friction = 0.0, normal = 0.0, smooth_normal = 0.0;
  for (std::size_t k = 130; k < 150; ++k) {  // facets make single pushes uneven
    push += rough.pushes[k].push_force / 20.0;
    smooth_push += smooth.pushes[k].push_force / 20.0;
    friction += rough.pushes[k].friction_force / 20.0;
    normal += rough.pushes[k].total_contact_force / 20.0;
    smooth_normal += smooth.pushes[k].total_contact_force / 20.0;
  }
  EXPECT_NEAR(friction, 0.1 * normal, 0.005 * normal);
  EXPECT_NEAR(push - smooth_push, friction, 0.15 * friction);
  // As on a capstan, mu times the normal forces, which the thrust changes by up to mu pi/2 = 16 %.
  EXPECT_NEAR(push - smooth_push, 0.1 * smooth_normal, 0.02 * smooth_normal);
}

TEST(FrictionTrial, WorkPutInIsStoredOrTurnedIntoHeat) {
  const auto lost = [](double step) {
    const Push last = rubbed(0.1, step).pushes.back();
    EXPECT_GT(last.friction_work, 0.1 * last.push_work);
    return std::abs(last.push_work - last.stored_energy - last.friction_work) / last.push_work;
  };
  const double coarse = lost(5.0), fine = lost(0.5);
  EXPECT_LT(coarse, 0.05);  // the trapezoidal rule over uneven pushes
  EXPECT_LT(fine, 0.005);
  EXPECT_LT(fine, coarse);
}

TEST(FrictionTrial, PushLengthHardlyChangesTheAnswer) {
  const Vec3 tip = rubbed(0.1, 1.0).pushes.back().tip;
  for (const double step : {0.2, 5.0}) {
    const TrialResult trial = rubbed(0.1, step);
    ASSERT_EQ(trial.outcome, Outcome::kMissed) << trial.reason;
    EXPECT_LT((trial.pushes.back().tip - tip).norm(), 0.5) << step;
  }
}

TEST(FrictionTrial, AWireThatRunsOutOfIterationsIsFollowed) {
  // With three iterations per solve most pushes take several, each with anchors that followed the
  // last one. They end in equilibrium, where one solve does.
  for (const double friction : {0.0, 0.1}) {
    SCOPED_TRACE(friction);
    const TrialResult whole = rubbed(friction, 2.0), followed = rubbed(friction, 2.0, 3);
    ASSERT_EQ(followed.outcome, Outcome::kMissed) << followed.reason;
    ASSERT_EQ(followed.pushes.size(), whole.pushes.size());
    int several = 0;
    for (const Push& push : followed.pushes) {
      EXPECT_LE(push.residual, 1e-6);
      several += push.iterations > 3 ? 1 : 0;
    }
    EXPECT_GT(several, 20);
    const Push &last = followed.pushes.back(), &of_one = whole.pushes.back();
    EXPECT_LT((last.tip - of_one.tip).norm(), 1e-4);
    EXPECT_NEAR(last.push_force, of_one.push_force, 1e-4);
    // Anchors follow through states that are not quite in equilibrium.
    EXPECT_NEAR(last.friction_work, of_one.friction_work, 0.01 * last.push_work);
    EXPECT_NEAR(last.push_work, last.stored_energy + last.friction_work, 0.02 * last.push_work);
  }
}

TEST(FrictionTrial, StaysWithinCoulombsConeEverywhere) {
  const TrialResult trial = rubbed(0.1, 2.0);
  ASSERT_FALSE(trial.contacts.empty());
  for (const WireContact& contact : trial.contacts) {
    EXPECT_LE(contact.friction_force.norm(),
              0.1 * contact.normal_force.norm() * (1.0 + 1e-3) + 1e-6);
    EXPECT_LT(std::abs(contact.friction_force.dot(contact.normal_force)),
              1e-3 * contact.normal_force.squaredNorm() + 1e-9);
  }
}

// ---------------------------------------------------------------- records

TEST(Trial, NamesTheTermsOfAStrip) {
  const InsertionOptions options = {.length = 10.0, .friction = 0.1};
  Wire wire = straight_wire(50.0);
  EXPECT_EQ(run_trial(wire, along_z(), end_of_bend(), bend(), options).terms,
            (std::vector<std::string>{"stretch", "bend", "contact", "friction"}));
  wire.sections[0].bending_stiffness_2 = 200.0;
  EXPECT_EQ(run_trial(wire, along_z(), end_of_bend(), bend(), options).terms,
            (std::vector<std::string>{"stretch", "bend", "twist", "strip", "contact", "friction"}));
}

TEST(Trial, ShapesAreKeptAtTheAskedSpacing) {
  InsertionOptions some = options();
  some.record_every = 10.0;
  const TrialResult trial = run_trial(straight_wire(520.0), along_z(), end_of_bend(), bend(), some);
  ASSERT_GE(trial.shapes.size(), 5u);
  for (std::size_t k = 1; k + 1 < trial.shapes.size(); ++k) {
    EXPECT_NEAR(trial.shapes[k].insertion - trial.shapes[k - 1].insertion, 10.0, 1e-9);
  }
  EXPECT_DOUBLE_EQ(trial.shapes.back().insertion, trial.pushes.back().insertion);
}

TEST(Trial, PushLengthHardlyChangesTheAnswer) {
  // Frictionless statics do not depend on the path, up to which of several equilibria is met.
  std::vector<Vec3> tips;
  for (const double step : {1.0, 2.0, 5.0}) {
    InsertionOptions some = options();
    some.step = step;
    some.length = 100.0;
    const TrialResult trial =
        run_trial(straight_wire(520.0), along_z(), {.point = Vec3(0.0, 0.0, 1e3)}, bend(), some);
    ASSERT_EQ(trial.outcome, Outcome::kMissed) << trial.reason;
    tips.push_back(trial.nodes.rightCols<1>());
  }
  EXPECT_LT((tips[1] - tips[0]).norm(), 1e-3);
  EXPECT_LT((tips[2] - tips[0]).norm(), 1e-3);
}

TEST(Trial, SameInputsGiveTheSameBits) {
  const TrialResult a = run_trial(curved_wire(500.0), along_z(), end_of_bend(), bend(), options());
  const TrialResult b = run_trial(curved_wire(500.0), along_z(), end_of_bend(), bend(), options());
  EXPECT_TRUE(a.nodes == b.nodes);
  EXPECT_EQ(a.pushes.size(), b.pushes.size());
}

}  // namespace
}  // namespace wireplan::simulate
