// A wire in a catheter brought into a vessel: against the wire alone, mirrored, gone back to.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "preprocess/surface/openings.h"
#include "simulate/insertion/tool_script.h"
#include "tests/goal.h"
#include "tests/shapes.h"
#include "tests/simulate/hooked_tools.h"

namespace wireplan::simulate {
namespace {

// An aorta of 9 mm radius along z from 0 to 170 mm, with branches of 3 mm radius toward +x and -x
// at 110 mm; all ends are flat and closed.
constexpr double kOstium = 110.0, kAorta = 9.0, kRenal = 3.0;

Surface aorta_surface() {
  return shapes::level_set(
      [](const Vec3& p) {
        const auto renal = [&](double x) {
          return shapes::depth_in_tube(p, Vec3(0.0, 0.0, kOstium), Vec3(x, 0.0, kOstium), kRenal);
        };
        const double trunk =
            shapes::depth_in_tube(p, Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 170.0), kAorta);
        const auto soft = [](double depth) { return std::exp(depth / 0.5); };
        return 0.5 * std::log(soft(trunk) + soft(renal(40.0)) + soft(renal(-40.0)));
      },
      Vec3(-41.0, -10.0, -1.5), Vec3(41.0, 10.0, 171.5), 1.0);
}

const VesselModel& aorta() {
  static const VesselModel vessel(aorta_surface(), LumenOptions{.grid_spacing = 0.6});
  return vessel;
}

/// The same as an image shows it, whose vessels go on at their flat ends.
const VesselModel& open_aorta() {
  static const Surface surface = aorta_surface();
  static const VesselModel vessel(
      surface, LumenOptions{.grid_spacing = 0.6, .openings = preprocess::find_openings(surface)});
  return vessel;
}

const Introducer kUpward{.point = Vec3(0.0, 0.0, 5.0), .direction = Vec3::UnitZ()};
const Goal kNowhere{.point = Vec3(0.0, 0.0, 500.0), .radius = 1.0};

ToolTrial hooked_trial() {
  return {{hooked_catheter(), straight_wire(20.0)}, kUpward, kNowhere, aorta(), coarse()};
}

TEST(ToolTrial, TheWireOfACatheterThatStaysOutsideGoesAsTheWireAlone) {
  const VesselModel bend(shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5),
                         {.grid_spacing = 0.6});
  Centerline path;
  path.points = shapes::bend_axis(40.0, 0.5 * kPi, 40.0, 60.0, 0.5);
  const Eigen::Index n = path.points.cols();
  path.radius = Eigen::VectorXd::Constant(n, 4.0);
  path.arc_length = arc_length_of(path.points);
  Eigen::Index last = 0;
  while (path.arc_length[last] < 140.0) ++last;
  path.points = path.points.leftCols(last).eval();
  path.radius = path.radius.head(last).eval();
  path.arc_length = path.arc_length.head(last).eval();
  const auto way = std::make_shared<Way>(path);
  const Goal goal = goal_at_end(way);
  ToolTrialOptions options = coarse();
  options.insertion.element_length = 1.0;
  options.insertion.length = 200.0;
  const Introducer introducer{.point = Vec3(0.0, 0.0, 20.0), .direction = Vec3::UnitZ()};
  const Tool wire = straight_wire(60.0);
  const TrialResult alone = run_trial(wire.wire, introducer, goal, bend, options.insertion);
  const TrialResult both = run_tool_trial({hooked_catheter(), wire}, introducer, goal, bend,
                                          options, {{.tool = 1, .push = 196.0}});
  ASSERT_EQ(alone.outcome, Outcome::kReached) << alone.reason;
  ASSERT_EQ(both.outcome, Outcome::kReached) << both.reason;
  EXPECT_NEAR(both.pushes.back().insertion, alone.pushes.back().insertion, 2.1) << "steps of 2 mm";
  ASSERT_GT(both.shapes.size(), 4U);
  // At the last recorded shape of the same insertion the lines agree.
  double compared = 0.0;
  for (const Shape& shape : both.shapes) {
    for (const Shape& other : alone.shapes) {
      if (std::abs(shape.insertion - other.insertion) > 1e-6) continue;
      EXPECT_LT((shape.nodes.rightCols<1>() - other.nodes.rightCols<1>()).norm(), 0.3);
      ++compared;
    }
  }
  const double force = both.pushes.back().total_contact_force;
  EXPECT_NEAR(force, alone.pushes.back().total_contact_force, 0.15 * force);
  EXPECT_GT(force, 0.03);
  EXPECT_EQ(both.tools.size(), 2U);
  EXPECT_EQ(both.tools[1].insertion.back(), both.pushes.back().insertion);
}

TEST(ToolTrial, TurnsTheOtherWayEndOnTheOtherSide) {
  // Rolls count from the reference direction, y: x and -x are mirror images.
  std::vector<Vec3> tips;
  for (const double side : {1.0, -1.0}) {
    ToolTrial trial = hooked_trial();
    ASSERT_TRUE(trial.make({.tool = 1, .push = 110.0}));
    ASSERT_TRUE(trial.make({.tool = 0, .push = 95.0}));
    ASSERT_TRUE(trial.make({.tool = 1, .push = -50.0}));
    ASSERT_TRUE(trial.make({.tool = 0, .turn = side * 0.5 * kPi}));
    tips.push_back(trial.tip(0));
  }
  EXPECT_GT(std::abs(tips[0].x()), 4.0) << "the hook lies sideways";
  EXPECT_NEAR(tips[0].x(), -tips[1].x(), 0.6) << "the triangles are no mirror images";
  EXPECT_NEAR(tips[0].y(), tips[1].y(), 0.6);
  EXPECT_NEAR(tips[0].z(), tips[1].z(), 0.6);
}

TEST(ToolTrial, GoesOnFromAMarkAsItDidBefore) {
  ToolTrial trial = hooked_trial();
  ASSERT_TRUE(trial.make({.tool = 1, .push = 80.0}));
  ASSERT_TRUE(trial.make({.tool = 0, .push = 60.0}));
  const ToolTrial::Mark mark = trial.save();
  ASSERT_TRUE(trial.make({.tool = 1, .push = -40.0}));
  ASSERT_TRUE(trial.make({.tool = 0, .turn = 1.0}));
  trial.restore(mark);
  const ToolStep next{.tool = 0, .push = 10.0};
  ASSERT_TRUE(trial.make(next));
  const Vec3 once = trial.tip(0);
  const std::size_t pushes = trial.pushes().size();
  trial.restore(mark);
  ASSERT_TRUE(trial.make(next));
  EXPECT_EQ(trial.tip(0), once) << "bit for bit";
  EXPECT_EQ(trial.pushes().size(), pushes);
  EXPECT_NEAR(trial.insertion(0), 70.0, 1e-9);
}

TEST(ToolScripts, ComeToTheSameWhateverWasRunBefore) {
  const auto script = [](double depth, double turn) {
    return std::vector<ToolStep>{{.tool = 1, .push = 60.0},
                                 {.tool = 0, .push = depth},
                                 {.tool = 1, .push = -20.0},
                                 {.tool = 0, .turn = turn},
                                 {.tool = 1, .push = 30.0}};
  };
  const std::vector<std::vector<ToolStep>> scripts = {
      script(40.0, 1.0), script(40.0, -1.0), script(30.0, 1.0), {{.tool = 1, .push = 60.0}}};
  const std::vector<Tool> tools = {hooked_catheter(), straight_wire(20.0)};
  ToolScriptRunner runner(tools, kUpward, kNowhere, aorta(), coarse());
  std::vector<Vec3> tips;
  for (const std::vector<ToolStep>& steps : scripts) {
    SCOPED_TRACE(tips.size());
    const TrialResult alone = run_tool_trial(tools, kUpward, kNowhere, aorta(), coarse(), steps);
    const TrialResult shared = runner.run(steps, coarse().insertion.length);
    EXPECT_EQ(shared.outcome, alone.outcome);
    EXPECT_EQ(shared.reason, alone.reason);
    ASSERT_EQ(shared.nodes.cols(), alone.nodes.cols());
    EXPECT_EQ(shared.nodes, alone.nodes) << "bit for bit";
    ASSERT_EQ(shared.pushes.size(), alone.pushes.size());
    EXPECT_EQ(shared.steps, alone.steps);
    EXPECT_EQ(shared.shapes.size(), alone.shapes.size());
    for (std::size_t k = 0; k < alone.pushes.size(); ++k) {
      EXPECT_EQ(shared.pushes[k].tip, alone.pushes[k].tip);
      EXPECT_EQ(shared.pushes[k].push_work, alone.pushes[k].push_work);
    }
    tips.emplace_back(shared.nodes.rightCols<1>());
  }
  EXPECT_GT((tips[0] - tips[1]).norm(), 0.1) << "they are not all one script";
  EXPECT_GT((tips[0] - tips[2]).norm(), 0.1);
}

TEST(ToolScripts, MayEndAtOtherInsertions) {
  const std::vector<ToolStep> steps = {
      {.tool = 1, .push = 40.0}, {.tool = 0, .push = 20.0}, {.tool = 1, .push = 60.0}};
  ToolScriptRunner runner({hooked_catheter(), straight_wire(20.0)}, kUpward, kNowhere, aorta(),
                          coarse());
  for (const double length : {70.0, 90.0, 60.0}) {
    EXPECT_NEAR(runner.run(steps, length).pushes.back().insertion, length, 1e-6);
  }
}

TEST(ToolTrial, ACopyKnowsNothingOfWhatTheOtherDoesSince) {
  ToolTrial trial = hooked_trial();
  ASSERT_TRUE(trial.make({.tool = 1, .push = 26.0}));
  ASSERT_TRUE(trial.make({.tool = 0, .push = 20.0}));
  const ToolTrial::Mark mark = trial.save();
  ToolTrial copy(trial), early = hooked_trial();
  ASSERT_TRUE(trial.make({.tool = 1, .push = -20.0}));
  const ToolStep next{.tool = 0, .push = 4.0};
  trial.restore(mark);
  ASSERT_TRUE(trial.make(next));
  ASSERT_TRUE(copy.make(next));
  EXPECT_EQ(copy.tip(0), trial.tip(0)) << "bit for bit";
  EXPECT_EQ(copy.pushes().size(), trial.pushes().size());
  early.restore(mark);  // marks of one are the other's too
  ASSERT_TRUE(early.make(next));
  EXPECT_EQ(early.tip(0), trial.tip(0));
}

TEST(ToolTrial, ANewDivisionOfTheCentrelineKeepsTheShape) {
  for (const double h : {2.0, 3.5}) {
    SCOPED_TRACE(h);
    ToolScene scene;
    scene.tools = {hooked_catheter(), straight_wire(20.0)};
    scene.places = {{.insertion = 0.0}, {.insertion = 4.0}};
    scene.point = kUpward.point;
    scene.direction = kUpward.direction;
    scene.vessel = &aorta();
    scene.element_length = h;
    scene.max_iterations = 50;
    scene.moves = {
        {{0.0, 76.0}, {0.0, 0.0}}, {{60.0, 0.0}, {0.0, 0.0}}, {{0.0, -50.0}, {0.0, 0.0}}};
    ToolBench bench(scene);
    for (const ToolMove& move : scene.moves) ASSERT_TRUE(bench.move(move));
    const Vec3 before = bench.nodes_of(0).rightCols<1>();
    const Eigen::Index nodes = bench.state().x.cols();
    ASSERT_TRUE(bench.divide(60.0));
    EXPECT_LT(bench.state().x.cols(), nodes) << "the catheter leads, 60 mm in";
    EXPECT_LT((bench.nodes_of(0).rightCols<1>() - before).norm(), 0.5);
    EXPECT_LE(bench.state().x.cols() - 1, std::ceil(60.0 / h));
  }
}

TEST(ToolTrial, AWireThatComesUpInsideTheCatheterIsNotTakenForStuck) {
  // The catheter leads by 90 mm, which is more than the last push is given without progress.
  const auto way =
      std::make_shared<Way>(line_from(Vec3(0.0, 0.0, 5.0), Vec3(0.0, 0.0, 154.0), kAorta));
  const Goal goal = goal_at_end(way);
  const TrialResult result =
      run_tool_trial({hooked_catheter(), straight_wire(20.0)}, kUpward, goal, aorta(), coarse(),
                     {{.tool = 1, .push = 116.0},
                      {.tool = 0, .push = 110.0},
                      {.tool = 1, .push = -100.0},
                      {.tool = 1, .push = 180.0}});
  EXPECT_EQ(result.outcome, Outcome::kReached) << result.reason;
  EXPECT_GT(result.tools[1].insertion.back(), 140.0);
}

/// Along the aorta and out into the branch toward +x; steps may end at that.
ToolTrial watched_trial(double stiffness = 1.0, const VesselModel& vessel = aorta(),
                        double target = kRenal) {
  Centerline path;
  path.points.resize(3, 136);
  path.radius.resize(136);
  for (Eigen::Index k = 0; k < 136; ++k) {
    const double s = static_cast<double>(k), up = std::min(s, kOstium - 5.0);
    path.points.col(k) = Vec3(s - up, 0.0, 5.0 + up);
    path.radius[k] = s - up > kAorta - 1.0 ? kRenal : kAorta;
  }
  path.radius[135] = target;
  path.arc_length = Eigen::VectorXd::LinSpaced(136, 0.0, 135.0);
  const auto way = std::make_shared<Way>(path);
  const Goal goal{.point = way->section().center, .radius = 3.0, .at_section = true, .way = way};
  ToolTrialOptions options = coarse();
  options.take_off = TakeOff{
      .arc = kOstium - 5.0 + kAorta, .point = Vec3(kAorta, 0.0, kOstium), .trunk = Vec3::UnitZ()};
  Tool hook = hooked_catheter();
  for (Section& section : hook.wire.sections) section.bending_stiffness *= stiffness;
  return {{hook, straight_wire(20.0 * stiffness)}, kUpward, goal, vessel, options};
}

/// The hook turned into the branch, on a wire that is led out of it.
ToolTrial seated_trial(double stiffness) {
  ToolTrial trial = watched_trial(stiffness);
  EXPECT_TRUE(trial.make({.tool = 1, .push = 200.0, .until = Until::kLevel, .at = 15.0}));
  EXPECT_TRUE(trial.make({.tool = 0, .push = 200.0, .until = Until::kLevel, .at = 8.0}));
  EXPECT_TRUE(trial.make({.tool = 1, .push = -60.0}));
  EXPECT_TRUE(trial.make({.tool = 0, .turn = 2.0 * kPi, .until = Until::kFacing, .at = 0.0}));
  EXPECT_TRUE(trial.make({.tool = kBothTools, .push = -30.0, .until = Until::kLevel, .at = 0.0}));
  EXPECT_TRUE(trial.make({.tool = 1, .push = 80.0, .until = Until::kInBranch, .at = 12.0}));
  EXPECT_TRUE(trial.make({.tool = 0, .push = 6.0}));
  return trial;
}

TEST(ToolSupport, ACatheterFollowsIntoTheBranchOnceTheWireIsThere) {
  const ToolStep follows{
      .tool = 0, .push = 40.0, .until = Until::kInBranch, .at = 15.0, .seats = true};
  ToolTrial trial = seated_trial(1.0);
  ASSERT_FALSE(trial.make({.tool = 1, .push = 80.0}, true));
  ASSERT_TRUE(trial.reached()) << trial.reason();
  const std::string reason = trial.reason();
  const double before = trial.measure(Until::kInBranch, 0), wire = trial.insertion(1);
  EXPECT_LT(before, 13.0);
  const double weaker = trial.find_support()->push;
  trial.seat(follows);
  EXPECT_TRUE(trial.reached());
  EXPECT_NEAR(trial.measure(Until::kInBranch, 0), 15.0, 0.3);
  EXPECT_EQ(trial.insertion(1), wire);
  EXPECT_EQ(trial.reason().substr(0, 60), reason.substr(0, 60));
  EXPECT_GT(trial.find_support()->push, weaker) << "deeper in the branch";
  const TrialResult result = trial.finish();
  EXPECT_EQ(result.outcome, Outcome::kReached);
  EXPECT_EQ(result.steps.back(), result.steps.front() + 8);
}

TEST(ToolSupport, WhereTheCatheterDoesNotFollowAllIsAsItWas) {
  // As deep as the branch is not.
  ToolTrial trial = seated_trial(1.0);
  ASSERT_FALSE(trial.make({.tool = 1, .push = 80.0}, true));
  ASSERT_TRUE(trial.reached()) << trial.reason();
  const Eigen::Matrix3Xd before = trial.bench().state().x;
  const std::size_t pushes = trial.pushes().size();
  trial.seat({.tool = 0, .push = 10.0, .until = Until::kInBranch, .at = 60.0, .seats = true});
  EXPECT_TRUE(trial.reached());
  EXPECT_NE(trial.reason().find("the catheter does not follow"), std::string::npos);
  EXPECT_EQ(trial.bench().state().x, before) << "bit for bit";
  EXPECT_EQ(trial.finish().pushes.size(), pushes);
}

TEST(ToolSupport, ACatheterDoesNotFollowAWireThatWentElsewhere) {
  ToolTrial trial = watched_trial();
  trial.make({.tool = 1, .push = 400.0}, true);  // up the aorta
  ASSERT_TRUE(trial.ended() && !trial.reached());
  trial.seat({.tool = 0, .push = 40.0, .until = Until::kInBranch, .at = 15.0, .seats = true});
  EXPECT_EQ(trial.insertion(0), 0.0);
  EXPECT_FALSE(trial.find_support());
}

TEST(ToolSupport, OfAHookedCatheterIsThePressThatBacksItOut) {
  ToolTrial trial = seated_trial(1.0);
  EXPECT_GT(trial.measure(Until::kInBranch, 0), 10.0);
  EXPECT_FALSE(trial.find_support()) << "it has not ended";
  ToolBench bench(trial.bench());
  trial.finish();
  const std::optional<CatheterSupport> support = trial.find_support();
  ASSERT_TRUE(support);
  EXPECT_FALSE(support->more);
  // Pressed by so little more each time that it is known to 2 %.
  const Eigen::Matrix3Xd mouth = bench.nodes_of(0);
  const Vec3 back = (mouth.col(mouth.cols() - 2) - mouth.rightCols<1>()).normalized();
  double press = 0.0;
  while (bench.nodes_of(0).rightCols<1>().x() > kAorta && press < 1.0) {
    press += 1e-3;
    ASSERT_TRUE(bench.press(0, press * back));
  }
  EXPECT_GT(press, 0.03);
  EXPECT_NEAR(support->push, press, 0.04 * press);
}

TEST(ToolSupport, GrowsWithTheStiffnessOfTheTools) {
  // On a wall that is rigid all forces do; the contact's own give is the difference.
  double support[2];
  for (const int k : {0, 1}) {
    ToolTrial trial = seated_trial(k == 0 ? 1.0 : 3.0);
    trial.finish();
    const std::optional<CatheterSupport> found = trial.find_support();
    ASSERT_TRUE(found);
    support[k] = found->push;
  }
  EXPECT_NEAR(support[1] / support[0], 3.0, 0.3);
}

TEST(ToolTrial, StepsEndByWhatIsSeenOfTheTip) {
  // The shortest part of a push is 0.2 mm, of a turn 1.5 degrees.
  for (const double side : {1.0, -1.0}) {
    SCOPED_TRACE(side);
    ToolTrial trial = watched_trial();
    ASSERT_TRUE(trial.make({.tool = 1, .push = 200.0, .until = Until::kLevel, .at = 15.0}));
    EXPECT_NEAR(trial.tip(1).z(), kOstium + 15.0, 0.21);
    ASSERT_TRUE(trial.make({.tool = 0, .push = 200.0, .until = Until::kLevel, .at = 8.0}));
    EXPECT_NEAR(trial.tip(0).z(), kOstium + 8.0, 0.21);
    ASSERT_TRUE(trial.make({.tool = 1, .push = -60.0}));
    const Vec3 looked = trial.tip_direction(0);
    const double before = trial.measure(Until::kFacing, 0);
    EXPECT_NEAR(before, std::atan2(looked.y(), looked.x()), 1e-9) << "the branch goes along x";
    const double at = before + side * 150.0 * kRadPerDeg;
    ASSERT_TRUE(
        trial.make({.tool = 0, .turn = side * 1.9 * kPi, .until = Until::kFacing, .at = at}));
    EXPECT_NEAR(std::remainder(trial.measure(Until::kFacing, 0) - at, 2.0 * kPi), 0.0, 0.06);
    EXPECT_LT(std::abs(trial.bench().places()[0].roll), 1.8 * kPi) << "not the whole turn";
    ASSERT_TRUE(trial.make({.tool = kBothTools, .push = -60.0, .until = Until::kLevel, .at = 1.0}));
    EXPECT_NEAR(trial.tip(0).z(), kOstium + 1.0, 0.21);
    const double insertion = trial.insertion(0);
    ASSERT_TRUE(trial.make({.tool = kBothTools, .push = -60.0, .until = Until::kLevel, .at = 1.0}));
    EXPECT_EQ(trial.insertion(0), insertion) << "it is there already";
    ASSERT_TRUE(trial.make({.tool = kBothTools, .push = -2.0, .until = Until::kLevel, .at = -9.0}));
    EXPECT_NEAR(trial.insertion(0), insertion - 2.0, 1e-9) << "and no more than the step";
  }
}

/// Up, the wire back, turned to look so far from the branch and pulled to a level.
bool hooks(ToolTrial& trial, double facing, double level) {
  return trial.make({.tool = 1, .push = 120.0}) && trial.make({.tool = 0, .push = 110.0}) &&
         trial.make({.tool = 1, .push = -40.0}) &&
         trial.make({.tool = 0, .turn = 2.0 * kPi, .until = Until::kFacing, .at = facing}) &&
         trial.make({.tool = kBothTools, .push = -60.0, .until = Until::kLevel, .at = level});
}

TEST(ToolTrial, TriesGoFurtherBackEachRoundAndNotOnPastTheOstium) {
  ToolTrial trial = watched_trial();
  ASSERT_TRUE(hooks(trial, 0.5 * kPi, -12.0)) << "it looks aside of both branches";
  ASSERT_NEAR(trial.measure(Until::kLevel, 0), -12.0, 0.3);
  const double begun = trial.insertion(0), ahead = trial.insertion(1) - begun;
  const std::size_t before = trial.pushes().size();
  trial.make({.tool = 1, .push = 80.0, .tries = 16, .try_pull = 3.0});
  ASSERT_FALSE(trial.reached());
  // The catheter looks across, and lets the wire by.
  const TrialResult record = trial.finish();
  EXPECT_NE(record.reason.find("tried again 16 times"), std::string::npos) << record.reason;
  double least = begun, most = begun;
  for (std::size_t k = before; k < record.tools[0].insertion.size(); ++k) {
    least = std::min(least, record.tools[0].insertion[k]);
    most = std::max(most, record.tools[0].insertion[k]);
  }
  EXPECT_NEAR(begun - least, 24.0, 1e-6) << "3, 6, 12 and 24 mm";
  EXPECT_GT(most - begun, 12.1) << "from 12 mm short of the ostium to 6 mm past it";
  EXPECT_LT(most - begun, 22.0);
  EXPECT_GT(trial.insertion(1) - trial.insertion(0), ahead + 20.0) << "led out from there";
}

TEST(ToolTrial, TriesTurnTheCatheterAboveTheOstiumAndFirstTowardTheBranch) {
  ToolTrial trial = watched_trial();
  ASSERT_TRUE(hooks(trial, 0.5 * kPi, -12.0)) << "it looks aside of both branches";
  const double begun = trial.insertion(0), roll = trial.bench().places()[0].roll;
  const std::size_t before = trial.pushes().size();
  trial.make({.tool = 1, .push = 80.0, .tries = 4, .try_pull = 3.0, .try_turn = 15.0 * kRadPerDeg});
  ASSERT_FALSE(trial.reached());
  EXPECT_NEAR(trial.measure(Until::kLevel, 0), -12.0, 4.0) << "the wire that comes out moves it";
  const ToolTrack catheter = trial.finish().tools.at(0);
  double deepest = 0.0;
  std::vector<double> turned;  // to these places, one after the other
  for (std::size_t k = before; k < catheter.roll.size(); ++k) {
    deepest = std::max(deepest, catheter.insertion[k]);
    const double by = catheter.roll[k] - catheter.roll[k - 1];
    if (std::abs(by) < 1e-9) continue;
    EXPECT_EQ(catheter.insertion[k], catheter.insertion[k - 1]);
    EXPECT_GT(catheter.insertion[k], begun + 10.0);
    turned.push_back(catheter.roll[k]);
  }
  EXPECT_LT(deepest, 110.0 + 1e-9) << "no further than it has been";
  ASSERT_EQ(turned.size(), 3U) << "15 degrees to one side, then 30 to the other in two parts";
  const double start = catheter.roll[before - 1];
  EXPECT_NEAR(turned[0] - start, -15.0 * kRadPerDeg, 1e-9) << "from where it looks to the branch";
  EXPECT_NEAR(turned[2] - start, 15.0 * kRadPerDeg, 1e-9);
  EXPECT_NEAR(trial.bench().places()[0].roll - roll, 15.0 * kRadPerDeg, 1e-9);
}

TEST(ToolTrial, AWireOnItsWayUpIsStoppedShortOfTheEndOfTheImage) {
  ToolTrial trial = watched_trial(1.0, open_aorta());  // whose aorta ends at 170 mm
  ASSERT_TRUE(trial.make({.tool = 1, .push = 300.0, .steers = 8})) << trial.reason();
  EXPECT_LT(trial.tip(1).z(), 170.0 - kSteerBeforeEnd + 1.5) << "a part of a push further";
  EXPECT_GT(trial.tip(1).z(), 170.0 - kSteerBeforeEnd - 0.5);
  ToolTrial unseen = watched_trial(1.0, open_aorta());
  EXPECT_FALSE(unseen.make({.tool = 1, .push = 300.0}));
  EXPECT_EQ(unseen.finish().outcome, Outcome::kLeftImage);
}

TEST(ToolTrial, AWireThatComesToTheEndOfTheImageHasPassedTheBranchBy) {
  ToolTrial trial = watched_trial(1.0, open_aorta());
  ASSERT_TRUE(trial.make({.tool = 1, .push = 150.0}) && trial.make({.tool = 0, .push = 150.0}));
  ASSERT_LT(170.0 - trial.tip(0).z(), 19.0) << "less than what else tells that";
  trial.make({.tool = 1, .push = 80.0, .tries = 4, .try_pull = 3.0});
  const TrialResult record = trial.finish();
  EXPECT_EQ(record.outcome, Outcome::kLeftImage);
  EXPECT_NE(record.reason.find("tried again 4 times"), std::string::npos) << record.reason;
}

TEST(ToolTrial, NoTryLeadsTheToolsOutOfTheImage) {
  ToolTrial trial = watched_trial(1.0, open_aorta());
  ASSERT_TRUE(trial.make({.tool = 1, .push = 150.0}) && trial.make({.tool = 0, .push = 164.0}));
  ASSERT_LT(170.0 - trial.tip(0).z(), kTryBeyond) << "so far on it would be outside";
  trial.make({.tool = 1, .push = 80.0, .tries = 4, .try_pull = 8.0});
  const TrialResult record = trial.finish();
  EXPECT_EQ(record.outcome, Outcome::kLeftImage) << "at last, by the wire";
  EXPECT_NE(record.reason.find("tried again 4 times"), std::string::npos) << record.reason;
}

TEST(ToolTrial, AWireThatComesNoFurtherIsLedOutAnew) {
  // In a branch that ends 10 mm behind a cross-section too small to be passed.
  ToolTrial trial = watched_trial(1.0, aorta(), 1e-3);
  ASSERT_TRUE(hooks(trial, 0.0, -1.0));
  trial.make({.tool = 1, .push = 200.0, .tries = 2, .try_pull = 3.0}, true);
  EXPECT_GT(trial.tip(1).x(), 25.0);
  const TrialResult record = trial.finish();
  EXPECT_NE(record.reason.find("tried again 2 times"), std::string::npos) << record.reason;
}

TEST(ToolTrial, StepsWithoutATakeOffAreMadeWhole) {
  ToolTrial trial = hooked_trial();
  ASSERT_TRUE(trial.make({.tool = 1, .push = 80.0, .until = Until::kLevel, .at = -90.0}));
  EXPECT_NEAR(trial.insertion(1), 84.0, 1e-9);
  EXPECT_TRUE(std::isnan(trial.measure(Until::kLevel, 1)));
}

TEST(ToolTrial, RecordsWhatEachToolFeels) {
  ToolTrial trial = hooked_trial();
  ASSERT_TRUE(trial.make({.tool = 1, .push = 100.0}));
  ASSERT_TRUE(trial.make({.tool = 0, .push = 80.0}));
  ASSERT_TRUE(trial.make({.tool = 1, .push = -60.0}));
  const TrialResult result = trial.finish();
  EXPECT_EQ(result.outcome, Outcome::kMissed);
  ASSERT_EQ(result.tools.size(), 2U);
  for (const ToolTrack& track : result.tools) {
    for (const auto* column : {&track.insertion, &track.roll, &track.push_force, &track.hub_torque,
                               &track.tip_force, &track.wall_force}) {
      EXPECT_EQ(column->size(), result.pushes.size());
    }
  }
  EXPECT_NEAR(result.tools[0].insertion.back(), 80.0, 1e-9);
  EXPECT_NEAR(result.tools[1].insertion.back(), 44.0, 1e-9);
  EXPECT_EQ(result.tools[1].tip_force.back(), 0.0) << "it is inside the catheter";
  const simulate::Push& last = result.pushes.back();
  EXPECT_NEAR(result.tools[0].wall_force.back() + result.tools[1].wall_force.back(),
              last.total_contact_force, 1e-9);
  EXPECT_GT(last.total_contact_force, 0.003) << "the hook is wider than it is straight";
  EXPECT_EQ(result.shapes.back().tools, (std::vector<double>{80.0, 44.0}));
}

}  // namespace
}  // namespace wireplan::simulate
