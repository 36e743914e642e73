// What a trial's file keeps of it.
#include <gtest/gtest.h>

#include "pipeline/files/trial_file.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

TEST(TrialFile, KeepsEveryBitAndMakesNullOfWhatIsNoNumber) {
  const TemporaryFolder folder;
  plan::Study study;
  study.wires = {{.name = "soft", .radius = 0.4, .sections = {{.length = 100.0}}}};
  simulate::TrialResult trial;
  trial.outcome = simulate::Outcome::kNotConverged;
  trial.reason = "push 2 has no equilibrium";
  trial.terms = {"stretch", "bend"};
  trial.pushes.resize(2);
  trial.pushes[0].push_force = 0.1;  // no finite sum of powers of 2
  trial.pushes[0].tip = Vec3(1.0 / 3.0, 1e-300, -2e17);
  trial.pushes[1].residual = std::nan("");
  trial.pushes[1].iterations = 200;
  trial.nodes = Eigen::Matrix3Xd::Random(3, 5);
  trial.pushes[1].wall_displacement = 0.3;
  trial.pushes[1].wall_displacement_point = Vec3(0.1, 0.2, 0.3);
  trial.pushes[1].friction_force = 0.7;
  trial.pushes[1].push_work = 1.1;
  trial.pushes[1].stored_energy = 1.3;
  trial.pushes[1].friction_work = 1.7;
  trial.contacts = {{.node = 3,
                     .part = 0.1,
                     .triangle = 17,
                     .point = Vec3(1, 2, 3),
                     .normal_force = Vec3(0.1, 0.2, 0.3),
                     .friction_force = Vec3(0.7, 0.1, 0.2),
                     .penetration = 0.7,
                     .wall_displacement = 0.9}};
  trial.peak_forces = {{3, 0.1}, {17, 1.0 / 3.0}};
  trial.sections = Eigen::Matrix3Xd::Random(3, 4);
  trial.tips_at_rest = {Vec3(1.0 / 3.0, 0.1, -0.2), Vec3(0.7, 1.0 / 7.0, 1e-300)};
  trial.nodes_at_rest = Eigen::Matrix3Xd::Random(3, 5);
  fs::create_directories(folder / "trials");
  const fs::path file = folder / trial_file_name(12);
  EXPECT_EQ(file.filename(), "0012.json");
  write_text(trial_text(study, {}, trial), file);

  const std::optional<simulate::TrialResult> read = find_trial(file);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->outcome, trial.outcome);
  EXPECT_EQ(read->reason, trial.reason);
  EXPECT_EQ(read->terms, trial.terms);
  ASSERT_EQ(read->pushes.size(), 2u);
  EXPECT_EQ(read->pushes[0].push_force, 0.1);
  EXPECT_EQ(read->pushes[0].tip, trial.pushes[0].tip);
  EXPECT_TRUE(std::isnan(read->pushes[1].residual));
  EXPECT_EQ(read->pushes[1].iterations, 200);
  EXPECT_EQ(read->pushes[1].wall_displacement, 0.3);
  EXPECT_EQ(read->pushes[1].wall_displacement_point, Vec3(0.1, 0.2, 0.3));
  EXPECT_EQ(read->pushes[1].friction_force, 0.7);
  EXPECT_EQ(read->pushes[1].push_work, 1.1);
  EXPECT_EQ(read->pushes[1].stored_energy, 1.3);
  EXPECT_EQ(read->pushes[1].friction_work, 1.7);
  EXPECT_EQ(read->nodes, trial.nodes);
  EXPECT_EQ(read->sections, trial.sections);
  EXPECT_EQ(read->tips_at_rest, trial.tips_at_rest);
  EXPECT_EQ(read->nodes_at_rest, trial.nodes_at_rest);
  ASSERT_EQ(read->contacts.size(), 1u);
  const simulate::WireContact &contact = read->contacts[0], &written = trial.contacts[0];
  EXPECT_EQ(contact.node, 3);
  EXPECT_EQ(contact.part, 0.1);
  EXPECT_EQ(contact.triangle, 17);
  EXPECT_EQ(contact.point, written.point);
  EXPECT_EQ(contact.normal_force, written.normal_force);
  EXPECT_EQ(contact.friction_force, written.friction_force);
  EXPECT_EQ(contact.penetration, 0.7);
  EXPECT_EQ(contact.wall_displacement, 0.9);
  ASSERT_EQ(read->peak_forces.size(), 2u);
  EXPECT_EQ(read->peak_forces[1].triangle, 17);
  EXPECT_EQ(read->peak_forces[1].force, 1.0 / 3.0);

  write_text(read_text(file).substr(0, 200), file);
  EXPECT_FALSE(find_trial(file));
  EXPECT_FALSE(find_trial(folder / "absent.json"));
}

TEST(TrialFile, KeepsWhatASeatedCatheterBears) {
  const TemporaryFolder folder;
  plan::Study study;
  study.wires = {{.name = "soft", .radius = 0.4, .sections = {{.length = 100.0}}}};
  study.catheters.resize(1);
  simulate::TrialResult trial;
  for (const bool seated : {true, false}) {
    trial.support.reset();
    if (seated) trial.support = {.push = 1.0 / 3.0, .more = true};
    trial.reshaped = seated;
    write_text(trial_text(study, {.catheter = 0}, trial), folder / "trial.json");
    const std::optional<simulate::TrialResult> read = find_trial(folder / "trial.json");
    ASSERT_TRUE(read);
    EXPECT_EQ(read->reshaped, seated) << "its knee may lie off the way";
    ASSERT_EQ(read->support.has_value(), seated);
    if (!seated) continue;
    EXPECT_EQ(read->support->push, 1.0 / 3.0);
    EXPECT_TRUE(read->support->more);
  }
}

TEST(TrialFile, MovesAreReadAsTheyAreWritten) {
  const std::vector<simulate::Move> moves = {
      {.push = -10.0}, {.turn = 0.5 * kPi}, {.push = 3.0, .turn = -0.5 * kPi}};
  const std::vector<simulate::Move> read = moves_of(moves_json(moves));
  ASSERT_EQ(read.size(), moves.size());
  for (std::size_t k = 0; k < moves.size(); ++k) {
    EXPECT_EQ(read[k].push, moves[k].push);
    EXPECT_DOUBLE_EQ(read[k].turn, moves[k].turn);
  }
  EXPECT_EQ(moves_json(moves)[0].dump(), "{\"push_mm\":-10.0}");
}

TEST(TrialFile, StepsOfAScriptAreReadAsTheyAreWritten) {
  using simulate::Until;
  const std::vector<simulate::ToolStep> steps = {
      {.tool = 1, .push = 320.0, .steers = 8},
      {.tool = 0, .push = 302.5},
      {.tool = 0, .turn = -180.0 * kRadPerDeg, .until = Until::kFacing, .at = 25.0 * kRadPerDeg},
      {.tool = simulate::kBothTools, .push = -22.0, .until = Until::kLevel, .at = -5.0},
      {.tool = 1,
       .push = 60.0,
       .until = Until::kInBranch,
       .at = 18.0,
       .tries = 8,
       .try_pull = 3.0,
       .try_turn = -15.0 * kRadPerDeg},
      {.tool = 1, .at = 10.0, .spare = 0},
      {.tool = 0, .push = 120.0, .until = Until::kLevel, .at = 2.0, .side = 0},
      {.tool = 1, .push = 90.0, .until = Until::kInBranch, .at = 70.0, .side = 3},
      {.tool = 0, .push = 158.0, .until = Until::kBack, .at = 100.0 * kRadPerDeg},
      {.tool = 0, .push = -60.0, .until = Until::kInBranch, .at = 10.0, .seats = true}};
  EXPECT_EQ(steps_json(steps)[7].at("side_branch"), 4) << "as it is called: branch 4";
  EXPECT_FALSE(steps_json(steps)[0].contains("side_branch"));
  EXPECT_EQ(steps_of(steps_json(steps)), steps);
}

TEST(TrialFile, KeepsWhichWireIsInTheCatheterFromWhenOn) {
  const TemporaryFolder folder;
  plan::Study study;
  study.wires.resize(2);
  study.wires[0].name = "soft";
  study.wires[1].name = "stiff";
  study.catheters.emplace_back().tool.wire.name = "hook";
  const plan::Candidate candidate{.wire = 1,
                                  .moves = {},
                                  .catheter = 0,
                                  .steps = {{.tool = 1, .at = 10.0, .spare = 0}},
                                  .first_wire = 0};
  simulate::TrialResult trial;
  trial.tools.resize(2);
  trial.tools[0].name = "hook";
  trial.tools[1].name = "soft";
  trial.tools[1].changes = {{.from = 7, .name = "stiff"}};
  const fs::path file = folder / "trial.json";
  write_text(trial_text(study, candidate, trial), file);
  const Json json = read_json(file, "wireplan.trial/3");
  EXPECT_EQ(json.at("wire"), "stiff");
  EXPECT_EQ(json.at("first_wire"), "soft");
  const std::optional<simulate::TrialResult> read = find_trial(file);
  ASSERT_TRUE(read);
  ASSERT_EQ(read->tools.size(), 2U);
  EXPECT_TRUE(read->tools[0].changes.empty());
  ASSERT_EQ(read->tools[1].changes.size(), 1U);
  EXPECT_EQ(read->tools[1].changes[0].from, 7U);
  EXPECT_EQ(read->tools[1].changes[0].name, "stiff");
}

/// The times in FOLDER/NAME.pvd.
std::vector<double> times_in(const fs::path& series) {
  const std::string text = read_text(series), key = "timestep=\"";
  std::vector<double> times;
  for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
    times.push_back(std::atof(text.c_str() + at + key.size()));
  }
  return times;
}

TEST(TrialFile, NoTwoShapesOfASeriesHaveOneTime) {
  const TemporaryFolder folder;
  simulate::TrialResult trial;
  for (const double insertion : {5.0, 10.0, 15.0}) {
    trial.shapes.push_back({.insertion = insertion,
                            .nodes = Eigen::Matrix3Xd::Random(3, 4),
                            .contact_force = Eigen::VectorXd::Zero(4)});
  }
  write_shapes(trial, "pushed", folder.path());
  EXPECT_EQ(times_in(folder / "pushed.pvd"), std::vector<double>({5.0, 10.0, 15.0}));
  trial.shapes.push_back(trial.shapes.back());  // a turn of the hub
  trial.shapes.push_back(trial.shapes.front());
  write_shapes(trial, "moved", folder.path());
  EXPECT_EQ(times_in(folder / "moved.pvd"), std::vector<double>({0.0, 1.0, 2.0, 3.0, 4.0}));

  // The vessel is shown at the times of the wires in it.
  preprocess::Branch branch;
  branch.line = shapes::line_through({{0, 0, 0}, {0, 0, 40}}, 4.0);
  const simulate::SectionChain chain({branch}, {});
  for (simulate::Shape& shape : trial.shapes) shape.sections.setZero(3, chain.nodes());
  trial.shapes[1].sections.resize(3, 0);
  write_moved_vessel(trial.shapes, shapes::box({-1, -1, -1}, {1, 1, 1}), chain, "vessel",
                     folder.path());
  EXPECT_EQ(times_in(folder / "vessel.pvd"), std::vector<double>({0.0, 2.0, 3.0, 4.0}));
}

}  // namespace
}  // namespace wireplan::pipeline
