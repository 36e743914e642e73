// Tools in one another in a vessel: against what one wire does there, and a Cobra in an aorta.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "simulate/equilibrium/assemble.h"
#include "simulate/insertion/insertion.h"
#include "simulate/insertion/tool_bench.h"
#include "simulate/insertion/tool_trial.h"
#include "tests/shapes.h"
#include "tests/simulate/random_values.h"
#include "tests/simulate/tool_bench.h"
#include "tests/simulate/tool_vessels.h"

namespace wireplan::simulate {
namespace {

/// Lumen of 4 mm radius that bends by 90 degrees round 40 mm, from +z to +x.
const VesselModel& tool_bend() {
  static const VesselModel vessel(shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5),
                                  {.grid_spacing = 0.6});
  return vessel;
}

ToolScene near_the_bend(std::vector<Tool> tools, std::vector<ToolPlace> places) {
  ToolScene scene = tools_along_x(std::move(tools), std::move(places));
  scene.point = Vec3(0.0, 0.0, 20.0);
  scene.direction = Vec3::UnitZ();
  scene.vessel = &tool_bend();
  scene.residual_tolerance = 1e-7;
  return scene;
}

TEST(ToolVessel, GradientAgreesWithDifferencesWhereTheThicknessChanges) {
  const VesselModel vessel(shapes::straight_tube(3.0, 30.0, 1.0), {.grid_spacing = 0.5});
  Tool catheter = uniform_tool(40.0, 60.0, 0.02), wire = uniform_tool(40.0, 20.0, 0.05);
  catheter.wire.radius = 0.8;
  const Composite composite = build_composite({catheter, wire}, {{6.4, 0.3}, {12.0, 0.8}}, 12);
  EXPECT_NEAR(composite.rod.thinner[2], 0.0, 1e-12);
  EXPECT_NEAR(composite.rod.thinner[9], 0.3, 1e-12);
  EXPECT_GT(composite.rod.thinner[6], 0.01);
  EXPECT_LT(composite.rod.thinner[6], 0.29);
  ContactOptions options;
  options.spacing = 3.0;
  WallContact contact(composite.rod, vessel, options);
  Problem problem;
  problem.rod = &composite.rod;
  problem.tools = &composite.terms;
  problem.last = composite.rod.nodes();
  problem.contact = &contact;
  const RodState straight = straight_state(composite.rod, Vec3(2.35, 0.0, 8.0), Vec3::UnitZ(), 0.0);
  RodState state = straight;
  state.theta = Eigen::VectorXd::Zero(2 * (composite.rod.nodes() - 1));
  std::mt19937_64 random(4);
  for (double& value : state.x.reshaped()) value += 0.05 * uniform(random);
  transport_frames(straight, state, 0, composite.rod.nodes() - 2);
  Eigen::Matrix3Xd gradient(3, composite.rod.nodes()), unused(3, composite.rod.nodes());
  EXPECT_GT(Statics::evaluate(problem, state, gradient).contact, 1e-3);
  for (int k = 0; k < 20; ++k) {
    Eigen::Matrix3Xd move(3, composite.rod.nodes());
    for (double& value : move.reshaped()) value = uniform(random);
    const double h = 1e-5;
    const auto energy = [&](double part) {
      RodState moved = state;
      moved.x += part * move;
      transport_frames(state, moved, 0, composite.rod.nodes() - 2);
      return Statics::evaluate(problem, moved, unused).total();
    };
    const double slope = (energy(h) - energy(-h)) / (2.0 * h);
    EXPECT_NEAR(gradient.cwiseProduct(move).sum(), slope, 1e-5 * (1.0 + std::abs(slope)));
  }
}

/// Pushes of 1 mm; finds the hand's work.
void push_on(Insertion& insertion, int pushes, double& work) {
  for (int k = 0; k < pushes; ++k) {
    const auto push = insertion.push(1.0);
    ASSERT_TRUE(push);
    work = push->push_work;
  }
}

TEST(ToolVessel, OneStraightToolIsTheWireThatAnInsertionPushes) {
  const Wire wire{
      .name = "wire", .radius = 0.445, .sections = {{.length = 300.0, .bending_stiffness = 60.0}}};
  for (const double friction : {0.0, 0.15}) {
    SCOPED_TRACE(friction);
    Insertion insertion(wire, {.point = Vec3(0.0, 0.0, 20.0), .direction = Vec3::UnitZ()},
                        tool_bend(), {.length = 100.0, .friction = friction});
    double work = 0.0;
    ASSERT_NO_FATAL_FAILURE(push_on(insertion, 90, work));
    ToolScene scene = near_the_bend({{.wire = wire}}, {{5.0, 0.0}});
    scene.contact.friction = friction;
    scene.moves = {push_of({85.0})};
    ToolBench bench(scene);
    ASSERT_TRUE(bench.settled() && bench.move(scene.moves[0]));
    EXPECT_GT(bench.record().tools[0].tip.x(), 20.0);
    EXPECT_LT((bench.record().tools[0].tip - insertion.tip()).norm(), 0.2);
    // The first 5 mm are without a wall: no work. Elements do not lie at the same places.
    EXPECT_NEAR(bench.record().work, work, 0.05 * work);
    EXPECT_GT(work, 0.5);

    // Two halves of it in one another are the same tool.
    Wire half = wire;
    half.sections[0].bending_stiffness *= 0.5;
    ToolScene both = near_the_bend({{.wire = half}, {.wire = half}}, {{5.0, 0.0}, {5.0, 0.0}});
    both.contact.friction = friction;
    both.moves = {push_of({85.0, 85.0})};
    ToolBench halves(both);
    ASSERT_TRUE(halves.settled() && halves.move(both.moves[0]));
    EXPECT_LT((halves.state().x - bench.state().x).colwise().norm().maxCoeff(), 0.01);
  }
}

/// The bend, cross-sections of which move as wholes on a support [N/mm^3].
std::unique_ptr<const SectionChain> sections_of_the_bend(double support) {
  Centerline line;
  line.points = shapes::bend_axis(40.0, 0.5 * kPi, 40.0, 60.0, 1.0);
  line.radius.setConstant(line.points.cols(), 4.0);
  line.arc_length = arc_length_of(line.points);
  return std::make_unique<SectionChain>(
      std::vector<preprocess::Branch>{{.line = line}},
      SectionChainOptions{.support = support, .young_modulus = 0.3, .spacing = 8.0});
}

VesselModel moving_bend(double support) {
  VesselModel vessel(shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5),
                     {.grid_spacing = 0.6});
  vessel.sections = sections_of_the_bend(support);
  return vessel;
}

TEST(ToolVessel, OneToolMovesAVesselAsTheWireThatAnInsertionPushes) {
  const Wire wire{
      .name = "wire", .radius = 0.445, .sections = {{.length = 300.0, .bending_stiffness = 600.0}}};
  const VesselModel vessel = moving_bend(1e-3);
  for (const double friction : {0.0, 0.15}) {
    SCOPED_TRACE(friction);
    Insertion insertion(wire, {.point = Vec3(0.0, 0.0, 20.0), .direction = Vec3::UnitZ()}, vessel,
                        {.length = 120.0, .friction = friction});
    double work = 0.0;
    ASSERT_NO_FATAL_FAILURE(push_on(insertion, 110, work));
    ToolScene scene = near_the_bend({{.wire = wire}}, {{5.0, 0.0}});
    scene.vessel = &vessel;
    scene.contact.friction = friction;
    scene.moves = {push_of({105.0})};
    ToolBench bench(scene);
    ASSERT_TRUE(bench.settled() && bench.move(scene.moves[0]));
    const double moved = insertion.sections().colwise().norm().maxCoeff();
    EXPECT_GT(moved, 0.5);
    EXPECT_LT((bench.state().sections - insertion.sections()).colwise().norm().maxCoeff(),
              0.03 * moved);
    EXPECT_LT((bench.record().tools[0].tip - insertion.tip()).norm(), 0.2);
    EXPECT_NEAR(bench.record().work, work, 0.05 * work);
  }
}

TEST(ToolVessel, AScriptInAVesselThatMovesIsKeptInTheVesselAtRestToo) {
  const VesselModel vessel = moving_bend(1e-4);
  Tool sheath = uniform_tool(300.0, 600.0), wire = uniform_tool(300.0, 60.0);
  sheath.wire.radius = 0.8;
  sheath.inner_radius = 0.5;
  wire.wire.radius = 0.4;
  ToolTrialOptions options;
  options.insertion.element_length = 3.0;
  options.insertion.length = 200.0;
  ToolTrial trial({sheath, wire}, {.point = Vec3(0.0, 0.0, 20.0), .direction = Vec3::UnitZ()},
                  {.point = Vec3(0.0, 0.0, 500.0), .radius = 1.0}, vessel, options);
  ASSERT_TRUE(trial.make({.tool = 1, .push = 90.0}));
  const ToolTrial::Mark mark = trial.save();
  const std::size_t before = trial.pushes().size();
  ASSERT_TRUE(trial.make({.tool = 0, .push = 20.0}));
  trial.restore(mark);
  ASSERT_EQ(trial.pushes().size(), before);
  ASSERT_TRUE(trial.make({.tool = 0, .push = 70.0}));
  EXPECT_EQ((trial.tip_after(trial.pushes().size() - 1) - trial.foremost_tip()).norm(), 0.0);
  const TrialResult result = trial.finish();
  EXPECT_GT(result.sections.colwise().norm().maxCoeff(), 1.0);
  ASSERT_EQ(result.tips_at_rest.size(), result.pushes.size());
  ASSERT_EQ(result.nodes_at_rest.cols(), result.nodes.cols());
  // Carried on by the sections they are where the tools lie.
  const Eigen::Matrix3Xd moved = vessel.sections->carried(result.nodes_at_rest, result.sections);
  EXPECT_LT((moved - result.nodes).colwise().norm().maxCoeff(), 1e-6);
  EXPECT_GT((result.nodes_at_rest - result.nodes).colwise().norm().maxCoeff(), 0.5);
  EXPECT_LT((result.tips_at_rest.back() - result.nodes_at_rest.rightCols<1>()).norm(), 1e-9);
}

TEST(ToolVessel, EachToolRubsByItsOwnFriction) {
  const auto heat = [](double of_sheath, double of_wire) {
    Tool sheath = uniform_tool(300.0, 40.0), wire = uniform_tool(300.0, 30.0);
    wire.wire.radius = 0.4;
    sheath.wire.friction = of_sheath;
    wire.wire.friction = of_wire;
    ToolScene scene = near_the_bend({sheath, wire}, {{5.0, 0.0}, {10.0, 0.0}});
    scene.contact.friction = 0.9;  // not taken: each has its own
    scene.moves = {push_of({60.0, 90.0})};
    ToolBench bench(scene);
    EXPECT_TRUE(bench.settled() && bench.move(scene.moves[0]));
    EXPECT_GT(bench.record().tools[0].wall_force, 0.01);
    EXPECT_GT(bench.record().tools[1].wall_force, 0.01);
    return bench.record().heat;
  };
  const double none = heat(0.0, 0.0), by_sheath = heat(0.2, 0.0), by_both = heat(0.2, 0.2);
  EXPECT_EQ(none, 0.0);
  EXPECT_GT(by_sheath, 0.1);
  EXPECT_GT(by_both, 1.1 * by_sheath);
}

// ---------------------------------------------------------------- energy, and walls that yield

/// A curved catheter and a wire round the bend; then the wire back, the catheter turned and on, the
/// wire out, the catheter back.
ToolScene curved_round_the_bend(double friction) {
  Tool catheter = uniform_tool(300.0, 332.0), wire = uniform_tool(300.0, 60.0);
  catheter.wire.sections = {{.length = 30.0, .bending_stiffness = 99.0, .rest_curvature = 0.05},
                            {.length = 270.0, .bending_stiffness = 332.0}};
  wire.wire.radius = 0.4;
  ToolScene scene = near_the_bend({catheter, wire}, {{5.0, 0.0}, {10.0, 0.0}});
  scene.contact.friction = friction;
  scene.residual_tolerance = 1e-6;
  scene.moves = {push_of({60.0, 60.0}), push_of({0.0, -40.0}), turn_of({1.0, 0.0}),
                 push_of({20.0, 0.0}),  push_of({0.0, 40.0}),  push_of({-20.0, 0.0})};
  return scene;
}

VesselModel yielding_bend(double young_modulus) {
  const Surface surface = shapes::bend_tube(4.0, 40.0, 0.5 * kPi, 40.0, 60.0, 1.5);
  return {surface, shapes::extruded_wall(surface, 1.0, young_modulus),
          LumenOptions{.grid_spacing = 0.6}};
}

/// Makes the scene's moves; each is to balance to within a part of what it stored, rubbed away and
/// released.
void expect_balance(const ToolScene& scene, double part) {
  ToolBench bench(scene);
  ASSERT_TRUE(bench.settled());
  for (std::size_t k = 0; k < scene.moves.size(); ++k) {
    SCOPED_TRACE(k);
    const ToolRecord before = bench.record();
    ASSERT_TRUE(bench.move(scene.moves[k])) << bench.record().residual;
    const ToolRecord& after = bench.record();
    const double gained = after.energy.total() - before.energy.total();
    const double heat = after.heat - before.heat, released = after.released - before.released;
    EXPECT_NEAR(after.work - before.work, gained + heat + released, 1e-9);
    EXPECT_LT(std::abs(after.unbalanced - before.unbalanced),
              part * (std::abs(gained) + heat + released));
    EXPECT_EQ(heat > 1e-3, scene.contact.friction > 0.0);
    // Introducer and wall hold the tools.
    Vec3 sum = bench.introducer_force();
    for (const Touch& touch : bench.touches()) {
      sum += touch.normal_force * touch.normal + touch.friction;
    }
    EXPECT_LT(sum.norm(), 1e-5);
  }
}

TEST(ToolVessel, WorkOfTheHandsIsWhatIsStoredAndRubbedAway) {
  VesselModel yielding = yielding_bend(0.4), yielding_and_moving = yielding_bend(0.4);
  yielding_and_moving.sections = sections_of_the_bend(2e-3);
  const VesselModel moving = moving_bend(2e-3);
  for (const double friction : {0.0, 0.15}) {
    for (const VesselModel* vessel : std::initializer_list<const VesselModel*>{
             &tool_bend(), &yielding, &moving, &yielding_and_moving}) {
      SCOPED_TRACE(std::to_string(friction) + (vessel->compliance ? " yields" : "") +
                   (vessel->sections ? " moves" : ""));
      ToolScene scene = curved_round_the_bend(friction);
      scene.vessel = vessel;
      const double part = vessel->compliance ? 0.015 : 0.01;  // yielding has kinks
      expect_balance(scene, part);
      // Tools whose tips are level, pushed together and back.
      const Tool half = uniform_tool(300.0, 30.0);
      scene.tools = {half, half};
      scene.places = {{5.0, 0.0}, {5.0, 0.0}};
      scene.moves = {push_of({60.0, 60.0}), push_of({25.0, 25.0}), push_of({-20.0, -20.0}),
                     push_of({20.0, 20.0})};
      expect_balance(scene, part);
    }
  }
}

/// The move in so many pieces, each by a copy of the last one or by one bench; its iterations.
int move_in_pieces(ToolMove move, int count, bool copies, std::unique_ptr<ToolBench>& bench) {
  for (double& push : move.push) push /= count;
  for (double& turn : move.turn) turn /= count;
  int iterations = 0;
  for (int k = 0; k < count; ++k) {
    if (copies) bench = std::make_unique<ToolBench>(*bench);
    EXPECT_TRUE(bench->move(move));
    iterations += bench->record().iterations;
  }
  return iterations;
}

// A shaft that is curved by next to nothing has an unknown theta on every edge.
TEST(ToolVessel, AStraightShaftTwistsAsOneSpring) {
  const ToolScene one_spring = curved_round_the_bend(0.15);
  ToolScene every_theta = one_spring;
  every_theta.tools.front().wire.sections.back().rest_curvature = 1e-13;
  ToolBench bench(one_spring), other(every_theta);
  ASSERT_TRUE(bench.settled() && other.settled());
  bool was_loose = false;
  for (const ToolMove& move : one_spring.moves) {
    ASSERT_TRUE(bench.move(move) && other.move(move));
    if (bench.places().front().insertion > 40.0) {
      EXPECT_TRUE(find_chain_of(bench.problem(), bench.state()).exists());
    }
    // Ahead of its tip, and of the straight part behind that, a catheter carries no torque.
    const double ahead = bench.places()[1].insertion - bench.places()[0].insertion;
    const TwistChain chain = find_chain_of(bench.problem(), bench.state());
    const Eigen::VectorXd angle = bench.angles(0);
    if (ahead > 3.0) {
      was_loose = true;
      ASSERT_LT(chain.loose, angle.size());
      EXPECT_LT((angle.tail(angle.size() - chain.loose).array() - angle[chain.loose - 1])
                    .abs()
                    .maxCoeff(),
                1e-12);
    }
    EXPECT_FALSE(find_chain_of(other.problem(), other.state()).exists());
    EXPECT_LT((bench.state().x - other.state().x).colwise().norm().maxCoeff(), 1e-4);
    EXPECT_LT((bench.angles(0) - other.angles(0)).cwiseAbs().maxCoeff(), 1e-5);
    EXPECT_NEAR(bench.record().tools[0].hub_torque, other.record().tools[0].hub_torque, 1e-5);
    // Every edge is in balance, those of the shaft too.
    Eigen::VectorXd gradient;
    Eigen::MatrixXd hessian;
    Problem problem = bench.problem();
    problem.contact = nullptr;
    Statics::derivatives(problem, bench.state(), gradient, hessian);
    const Eigen::Index edges = bench.state().theta.size();
    EXPECT_LT(gradient.segment(3 * bench.state().x.cols(), edges).cwiseAbs().maxCoeff(), 1e-6);
  }
  EXPECT_TRUE(was_loose);
}

// What tools come off their way about a tip they are expected to do about it again where it has
// gone. Where it was, the catheter takes 504 iterations.
TEST(ToolVessel, GuessesGoAlongWithTheTips) {
  const VesselModel aorta(aorta_with_a_branch(), {.grid_spacing = 0.8});
  ToolScene scene = catheter_over_wire(cobra_tip(), aorta);
  scene.point = Vec3(0.0, 0.0, 5.0);
  scene.moves = {push_of({0.0, 110.0}), push_of({90.0, 0.0})};
  ToolBench bench(scene);
  ASSERT_TRUE(bench.settled() && bench.move(scene.moves[0]) && bench.move(scene.moves[1]));
  EXPECT_LT(bench.record().iterations, 490);
}

// As in trials a jump is made in one part, not looked for in ever smaller ones.
TEST(ToolVessel, JumpsThatAreNotCutLeadToTheSameShapes) {
  ToolScene cut = curved_round_the_bend(0.15), whole = cut;
  whole.cut_jumps = false;
  ToolBench bench(cut), other(whole);
  ASSERT_TRUE(bench.settled() && other.settled());
  int iterations = 0, of_other = 0;
  for (const ToolMove& move : cut.moves) {
    ASSERT_TRUE(bench.move(move) && other.move(move));
    iterations += bench.record().iterations;
    of_other += other.record().iterations;
    for (std::size_t i = 0; i < cut.tools.size(); ++i) {
      EXPECT_LT((bench.record().tools[i].tip - other.record().tools[i].tip).norm(), 1e-3);
    }
  }
  EXPECT_LT(of_other, iterations);
  EXPECT_NEAR(other.record().heat, bench.record().heat, 0.01 * bench.record().heat);
}

// As trials move their tools: two millimetres at a time.
TEST(ToolVessel, AMoveInPiecesEndsWhereTheWholeDoes) {
  const ToolScene scene = curved_round_the_bend(0.15);
  ToolBench whole(scene);
  auto pieces = std::make_unique<ToolBench>(scene), copies = std::make_unique<ToolBench>(scene);
  ASSERT_TRUE(whole.settled() && pieces->settled() && copies->settled());
  int iterations = 0, of_pieces = 0;
  for (const ToolMove& move : scene.moves) {
    ASSERT_TRUE(whole.move(move));
    iterations += whole.record().iterations;
    double longest = 0.0;
    for (const double push : move.push) longest = std::max(longest, std::abs(push));
    const int count = std::max(1, static_cast<int>(std::lround(longest / 2.0)));
    of_pieces += move_in_pieces(move, count, false, pieces);
    move_in_pieces(move, count, true, copies);
    EXPECT_EQ(copies->state().x, pieces->state().x);  // a copy goes on as the other
    for (std::size_t i = 0; i < scene.tools.size(); ++i) {
      EXPECT_LT((pieces->record().tools[i].tip - whole.record().tools[i].tip).norm(), 0.02);
    }
  }
  EXPECT_NEAR(pieces->record().heat, whole.record().heat, 0.01 * whole.record().heat);
  EXPECT_LT(of_pieces, 1.2 * iterations);  // no piece begins with short parts
}

TEST(ToolVessel, StifferWallsLeadToTheRigidOne) {
  const auto run = [](const VesselModel& vessel, double& work, double& yields) {
    ToolScene scene = curved_round_the_bend(0.15);
    scene.vessel = &vessel;
    ToolBench bench(scene);
    EXPECT_TRUE(bench.settled());
    Eigen::Matrix3Xd tips(3, 0);
    yields = 0.0;
    for (const ToolMove& move : scene.moves) {
      EXPECT_TRUE(bench.move(move));
      for (const ToolReport& tool : bench.record().tools) {
        tips.conservativeResize(3, tips.cols() + 1);
        tips.rightCols<1>() = tool.tip;
      }
      for (const Touch& touch : bench.touches()) yields = std::max(yields, touch.wall_displacement);
    }
    work = bench.record().work;
    return tips;
  };
  double work = 0.0, rigid_work = 0.0, yields = 0.0, none = 0.0;
  const Eigen::Matrix3Xd rigid = run(tool_bend(), rigid_work, none);
  EXPECT_EQ(none, 0.0);
  const Eigen::Matrix3Xd stiffest = run(yielding_bend(400.0), work, yields);
  // The field of a wall that yields reaches further: other samples.
  EXPECT_LT((stiffest - rigid).colwise().norm().maxCoeff(), 0.05);
  EXPECT_NEAR(work, rigid_work, 0.005);  // of 1.6 N mm turned into heat
  double last = 0.25;                    // [mm]
  for (const double young_modulus : {0.4, 4.0, 40.0}) {
    SCOPED_TRACE(young_modulus);
    const Eigen::Matrix3Xd tips = run(yielding_bend(young_modulus), work, yields);
    EXPECT_NEAR(yields, 0.07 * 0.4 / young_modulus, 0.035 * 0.4 / young_modulus);
    const double off = (tips - stiffest).colwise().norm().maxCoeff();
    EXPECT_LT(off, 0.5 * last);
    last = off;
  }
  EXPECT_GT(last, 1e-5);
}

TEST(ToolVessel, GoesOnFromAMarkInAMovingVesselAsItDidBefore) {
  ToolScene scene = curved_round_the_bend(0.15);
  const VesselModel vessel = moving_bend(2e-3);
  scene.vessel = &vessel;
  ToolBench bench(scene);
  ASSERT_TRUE(bench.settled() && bench.move(scene.moves[0]));
  const ToolBench::Mark mark = bench.save();
  ASSERT_TRUE(bench.move(scene.moves[1]));
  const RodState once = bench.state();
  bench.restore(mark);
  ASSERT_TRUE(bench.move(scene.moves[2]));
  bench.restore(mark);
  ASSERT_TRUE(bench.move(scene.moves[1]));
  EXPECT_EQ(bench.state().x, once.x);
  EXPECT_EQ(bench.state().sections, once.sections);
  EXPECT_GT(once.sections.colwise().norm().maxCoeff(), 0.05);
}

TEST(ToolVessel, AnEndlesslyStiffSupportIsTheVesselAtRest) {
  ToolScene scene = curved_round_the_bend(0.15);
  const VesselModel held = moving_bend(1e4);
  ToolBench at_rest(scene);
  scene.vessel = &held;
  ToolBench bench(scene);
  for (const ToolMove& move : scene.moves) {
    ASSERT_TRUE(at_rest.move(move) && bench.move(move));
    EXPECT_LT((bench.state().x - at_rest.state().x).colwise().norm().maxCoeff(), 1e-4);
  }
  EXPECT_GT(bench.record().heat, 0.1);
  EXPECT_NEAR(bench.record().heat, at_rest.record().heat, 1e-4);
}

// ---------------------------------------------------------------- catheters that take their curves

/// Where the tips of catheter and wire are after each move; the tools are held by introducer and
/// wall, and do not sink into it.
struct TipsAfter {
  std::vector<Vec3> catheter, wire;
  double released = 0.0;

  explicit TipsAfter(const ToolScene& scene) {
    ToolBench bench(scene);
    EXPECT_TRUE(bench.settled());
    for (const ToolMove& move : scene.moves) {
      if (!bench.settled() || !bench.move(move)) {
        ADD_FAILURE() << "no equilibrium: " << bench.record().residual;
        return;
      }
      catheter.push_back(bench.record().tools[0].tip);
      wire.push_back(bench.record().tools[1].tip);
      Vec3 sum = bench.introducer_force();
      for (const Touch& touch : bench.touches()) {
        sum += touch.normal_force * touch.normal + touch.friction;
        EXPECT_LT(touch.penetration, 0.3);
      }
      EXPECT_LT(sum.norm(), 1e-4);
    }
    const ToolRecord& record = bench.record();
    released = record.released;
    EXPECT_LT(std::abs(record.unbalanced), 0.03 * (std::abs(record.work) + record.heat));
  }
};

TEST(ToolVessel, CobraHooksABranchAndHoldsItWhileTheWireGoesOut) {
  const VesselModel vessel(aorta_with_a_branch(), {.grid_spacing = 0.8});
  ToolScene scene = catheter_over_wire(cobra_tip(), vessel);
  scene.point = Vec3(0.0, 0.0, 3.0);
  // Up over the wire, the wire back, up until the tip falls into the branch, the wire out.
  scene.moves = {push_of({70.0, 70.0}), push_of({0.0, -96.0}), push_of({35.0, 0.0}),
                 push_of({0.0, 110.0}), push_of({0.0, 12.0})};
  const TipsAfter tips(scene);
  ASSERT_EQ(tips.wire.size(), 5u);
  // Over the wire it is nearly straight; its curve brings the tip down and to the wall.
  EXPECT_GT(tips.catheter[0].z() - tips.catheter[1].z(), 3.0);
  EXPECT_LT(tips.catheter[1].y(), tips.catheter[0].y() - 4.0);
  EXPECT_GT(tips.catheter[1].y(), -7.0);  // in the aorta
  EXPECT_LT(tips.catheter[2].y(), -9.0);  // in the branch
  EXPECT_NEAR(tips.wire[3].y(), tips.catheter[3].y(), 3.0);
  // The wire leaves it by 12 mm, and it holds.
  EXPECT_LT(tips.wire[4].y(), tips.catheter[4].y() - 9.0);
  EXPECT_LT((tips.catheter[4] - tips.catheter[2]).norm(), 1.5);
}

TEST(ToolVessel, ToolsTooLongToLieFreeAreBroughtInTogether) {
  const VesselModel vessel(aorta_with_a_branch(), {.grid_spacing = 0.8});
  ToolScene scene = catheter_over_wire(cobra_tip(), vessel);
  scene.point = Vec3(0.0, 0.0, 3.0);
  scene.moves = {push_of({70.0, 70.0})};
  ToolBench pushed(scene);
  ASSERT_TRUE(pushed.settled() && pushed.move(scene.moves[0]));
  scene.places = {{80.0, 0.0}, {100.0, 0.0}};
  scene.moves.clear();
  const ToolBench there(scene);
  ASSERT_TRUE(there.settled());
  EXPECT_EQ(there.record().work, 0.0);
  EXPECT_EQ(there.record().heat, 0.0);
  EXPECT_GT(there.record().tools[0].wall_force, 0.1);
  for (const std::size_t i : {0, 1}) {
    EXPECT_LT((there.record().tools[i].tip - pushed.record().tools[i].tip).norm(), 1.0);
  }
}

TEST(ToolVessel, ToolsWithASupportAreNotTornOffIt) {
  // They do not lie free, and from further back they would not come to the support.
  const VesselModel vessel(aorta_with_a_branch(), {.grid_spacing = 0.8});
  ToolScene scene = catheter_over_wire(cobra_tip(), vessel);
  scene.point = Vec3(0.0, 0.0, 3.0);
  scene.places = {{80.0, 0.0}, {100.0, 0.0}};
  scene.distal =
      Support{.at = WireEnd::kDistal, .kind = SupportKind::kPinned, .point = Vec3(4.0, 0.0, 85.0)};
  const ToolBench bench(scene);
  EXPECT_EQ(bench.places()[1].insertion, 100.0);
  EXPECT_LT(bench.record().energy.stretch, 1e3);
}

TEST(ToolVessel, SimmonsIsFormedInTheArchAndPulledDownIntoABranch) {
  const VesselModel vessel(arch_with_a_branch(), {.grid_spacing = 0.8});
  ToolScene scene = catheter_over_wire(simmons_tip(), vessel);
  scene.point = Vec3(32.0, 0.0, -145.0);
  scene.element_length = 1.5;
  // Over the wire into the arch, the wire back, down with it, the wire out.
  scene.moves = {push_of({225.0, 225.0}), push_of({0.0, -200.0}), push_of({-115.0, 0.0}),
                 push_of({-21.0, 0.0}),   push_of({0.0, 75.0}),   push_of({0.0, 10.0})};
  const TipsAfter tips(scene);
  ASSERT_EQ(tips.wire.size(), 6u);
  EXPECT_LT(tips.catheter[0].x(), -20.0);  // beyond the arch's top
  EXPECT_LT(tips.wire[1].z(), -80.0);
  // The knee leads: the tip is nearer to the introducer than the 120 mm that the catheter is in;
  // then it falls into the branch.
  EXPECT_GT(tips.catheter[2].x(), 20.0);
  EXPECT_LT(tips.catheter[2].z(), -145.0 + 120.0 - 10.0);
  EXPECT_LT(tips.catheter[3].x(), 12.0);
  EXPECT_LT(tips.catheter[3].z(), -60.0);
  EXPECT_GT(tips.released, 2.0);
  // The wire leaves it by 20 mm, and it holds.
  EXPECT_LT(tips.wire[5].x(), tips.catheter[5].x() - 15.0);
  EXPECT_LT((tips.catheter[5] - tips.catheter[3]).norm(), 4.0);
}

}  // namespace
}  // namespace wireplan::simulate
