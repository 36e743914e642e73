// make_large_page OUT.html NAME: a page, of a case called NAME, as large as a case of 25 000
// triangles, 300 trials and 20 stored insertions makes it, of made-up results, for the tests in a
// browser.
#include <cmath>
#include <iostream>
#include <random>

#include "pipeline/files/disk.h"
#include "pipeline/report/anatomy_json.h"
#include "pipeline/report/page.h"
#include "pipeline/report/report.h"
#include "pipeline/report/slices.h"
#include "tests/shapes.h"

namespace wireplan::pipeline {
namespace {

constexpr double kRadius = 6.0, kLength = 250.0;  // of the vessel, along z            [mm]
// Of a length that no table has room for.
const std::string kMaker =
    " wire of a maker whose names go on for much longer than anybody who lays out a table expects";
constexpr int kPushes = 300, kShapes = 60, kInsertions = 20;

double draw(std::mt19937_64& random) { return static_cast<double>(random() >> 11U) * 0x1p-53; }

plan::Study make_study() {
  plan::Study study;
  for (const char* name : {"soft", "medium", "stiff"}) {
    study.wires.push_back(
        {.name = name + kMaker,
         .radius = 0.445,
         .sections = {{.length = 500.0, .bending_stiffness = 50.0, .rest_curvature = 0.04}}});
  }
  for (int k = 0; k < 4; ++k) study.inclinations.push_back(kRadPerDeg * (5.0 + 10.0 * k));
  for (int k = 0; k < 5; ++k) study.azimuths.push_back(kRadPerDeg * 72.0 * k);
  for (int k = 0; k < 5; ++k) study.rolls.push_back(kRadPerDeg * 72.0 * k);
  study.access = {0.0, 0.0, 5.0};
  study.goal = {.point = {0.0, 0.0, kLength - 10.0}, .radius = 4.0};
  return study;
}

/// A wire of nodes 1 mm apart, bent to and fro in the vessel.
Eigen::Matrix3Xd bent_wire(double length, double phase) {
  Eigen::Matrix3Xd nodes(3, std::max(2, static_cast<int>(length)));
  for (Eigen::Index k = 0; k < nodes.cols(); ++k) {
    const double z = 5.0 + static_cast<double>(k) * (kLength - 20.0) / kPushes;
    nodes.col(k) << 4.0 * std::sin(0.05 * z + phase), 4.0 * std::cos(0.03 * z + phase), z;
  }
  return nodes;
}

simulate::TrialResult make_trial(const Surface& surface, std::mt19937_64& random) {
  simulate::TrialResult trial;
  const bool reached = draw(random) < 0.5;
  trial.outcome = reached ? simulate::Outcome::kReached : simulate::Outcome::kStuck;
  trial.reason = reached ? "" : "pushing no longer advances the tip";
  trial.terms = {"stretch", "bend"};
  const double phase = 6.0 * draw(random), force = 0.05 + draw(random);
  for (int k = 1; k <= kPushes; ++k) {
    const double part = static_cast<double>(k) / kPushes;
    trial.pushes.push_back({.insertion = static_cast<double>(k),
                            .push_force = 0.3 * force * part,
                            .tip = {0.0, 0.0, kLength * part},
                            .tip_force = 0.1 * force * part,
                            .peak_contact_force = force * part,
                            .total_contact_force = 2.0 * force * part});
  }
  trial.pushes.back().tip = make_study().goal.point + Vec3(0.0, 0.0, 3.0 * draw(random));
  trial.nodes = bent_wire(kPushes, phase);
  for (int k = 1; k <= kShapes; ++k) {
    simulate::Shape shape;
    shape.insertion = static_cast<double>(kPushes * k) / kShapes;
    shape.nodes = bent_wire(shape.insertion, phase);
    shape.contact_force = shape.nodes.row(0).cwiseAbs() * force / 4.0;
    trial.shapes.push_back(shape);
  }
  for (int k = 0; k < surface.triangles.cols(); k += 10) {
    trial.peak_forces.push_back({k, force * draw(random)});
  }
  return trial;
}

/// A bright vessel in soft tissue, 256^2 x 128 voxels.
preprocess::Image make_volume() {
  preprocess::Image image;
  image.grid.size = {256, 256, 128};
  image.grid.spacing = {0.7, 0.7, 2.0};
  image.grid.origin = {-89.25, -89.25, 0.0};
  std::mt19937_64 random(3);
  image.values.resize(image.grid.voxels());
  for (int k = 0; k < 128; ++k) {
    for (int j = 0; j < 256; ++j) {
      for (int i = 0; i < 256; ++i) {
        const Vec3 p = image.grid.lps_from_ijk(Vec3(i, j, k));
        const double bright = p.head<2>().norm() < kRadius ? 350.0 : 40.0;
        image.values[image.grid.index(i, j, k)] =
            static_cast<float>(bright + 60.0 * (draw(random) - 0.5));
      }
    }
  }
  return image;
}

Json figures(const Surface& surface) {
  const Json none = Json::array();
  return {{"surface",
           {{"warnings", none},
            {"volume_mm3", 1.0},
            {"area_mm2", 1.0},
            {"triangles", surface.triangles.cols()},
            {"euler_number", 2},
            {"handles", Json::array()},
            {"openings", none}}},
          {"centerline",
           {{"warnings", none},
            {"length_mm", kLength},
            {"mean_diameter_mm", 12.0},
            {"min_diameter_mm", 12.0},
            {"max_diameter_mm", 12.0},
            {"tortuosity", 1.0},
            {"target_lumen_radius_mm", 4.0},
            {"branches", none}}},
          {"wall",
           {{"warnings", none},
            {"tetrahedra", surface.triangles.cols()},
            {"thickness_mm", 1.0},
            {"young_modulus_kpa", 56.0},
            {"normal_stiffness_kpa_per_mm", 25.0},
            {"inverted_tetrahedra", 0},
            {"limited_tetrahedra", 0},
            {"min_height_mm", 1.0}}},
          {"manoeuvres", {{"warnings", none}, {"searches", none}}},
          {"trials",
           {{"warnings", none},
            {"scout", nullptr},
            {"lumen_grid_mm", 1.0},
            {"lumen_max_deviation_mm", 0.1},
            {"lumen_mean_deviation_mm", 0.01}}}};
}

Json parameters() {
  return {
      {"wall", {{"model", "elastic"}}},
      {"access", {{"inclination_deg", {5, 15, 25, 35}}, {"azimuth_deg", {0, 72, 144, 216, 288}}}},
      {"wires",
       {{{"name", "soft" + kMaker}}, {{"name", "medium" + kMaker}}, {{"name", "stiff" + kMaker}}}},
      {"tip_roll_deg", {0, 72, 144, 216, 288}},
      {"friction", 0.04},
      {"limits", {{"tip_force_warn_n", 0.3}}},
      {"ranking", {{"weights", {{"reach", 1}, {"peak_force", 1}}}}}};
}

/// The five best plans, repeated under disturbances.
Json robustness(const plan::Ranking& ranking) {
  const Json spread = {{"low", 0.1}, {"median", 0.2}, {"high", 0.4}};
  Json plans = Json::array();
  for (std::size_t k = 0; k < 5; ++k) {
    plans.push_back({{"trial", ranking.plans.at(k).trial},
                     {"repeats", 16},
                     {"successes", 14},
                     {"success_rate", 0.875},
                     {"success_rate_interval", {0.64, 0.965}},
                     {"mean_score", 0.3},
                     {"peak_contact_force_n", spread},
                     {"failures", {{{"repeat", 3}, {"reason", "the target was missed"}}}}});
  }
  return {{"repeats", 16},
          {"seed", 1},
          {"unknowns",
           {{"friction_factor", {0.5, 2.0}},
            {"stiffness_factor", {0.9, 1.1}},
            {"wall_factor", {0.5, 2.0}},
            {"angle_deg", 5.0},
            {"entry_mm", 1.0},
            {"lumen_mm", 0.3}}},
          {"plans", plans},
          {"sensitivity",
           {{"explained", 0.8}, {"shares", {{{"unknown", "friction"}, {"share", 0.6}}}}}}};
}

/// More and longer sentences than the sheet has room for.
plan::Verdict long_verdict() {
  plan::Verdict verdict{.answer = plan::Answer::kFeasibleWithRisk,
                        .headline = "The" + kMaker + " reaches the target," + kMaker + kMaker,
                        .reasons = {},
                        .changes = {}};
  for (int k = 0; k < 14; ++k) {
    verdict.reasons.push_back("Reason " + std::to_string(k) + kMaker + kMaker + kMaker);
    verdict.changes.push_back("Change " + std::to_string(k) + kMaker + kMaker + kMaker);
  }
  return verdict;
}

std::string make_page(const std::string& name) {
  const Surface surface = shapes::straight_tube(kRadius, kLength, 0.93);
  Centerline path;
  constexpr Eigen::Index kPoints = 118;
  path.points = Eigen::Matrix3Xd::Zero(3, kPoints);
  path.points.row(2).setLinSpaced(kPoints, 5.0, kLength - 10.0);
  path.radius = Eigen::VectorXd::Constant(kPoints, kRadius);
  path.arc_length = path.points.row(2).transpose().array() - 5.0;

  ReportInput report;
  report.name = name;
  report.input_name = "made-up";
  report.input_sha256 = std::string(64, '0');
  report.parameters = parameters();
  report.stages = {"surface", "centerline", "wall", "trials"};
  report.figures = figures(surface);
  report.study = make_study();
  for (const simulate::Wire& wire : report.study.wires) {
    DeviceWire& device = report.devices.emplace_back();
    device.wire = wire;
    NamedValue& value = device.values.emplace_back();
    value.key = "sections[0].bending_stiffness_n_mm2";
    value.value.source = "assumed";
    value.value.confidence = Confidence::kAssumed;
  }
  plan::Plan& plan = report.plan;
  plan.candidates = plan::list_candidates(report.study);
  plan.levels.assign(plan.candidates.size(), plan::Level::kFull);

  PageInput page;
  page.surface = surface;
  page.path = path;
  page.access = report.study.access;
  page.target = report.study.goal.point;
  page.target_radius = report.study.goal.radius;
  std::mt19937_64 random(1);
  for (std::size_t id = 0; id < plan.candidates.size(); ++id) {
    const simulate::TrialResult trial = make_trial(surface, random);
    plan.trials.push_back(plan::measure(trial, report.study, path));
    page.trials.push_back(page_trial(trial));
    page.trials.back().direction =
        plan::make_introducer(report.study, plan.candidates[id]).direction;
    if (id < kInsertions) {
      page.insertions.push_back({static_cast<int>(id), trial.shapes, trial.peak_forces});
    }
  }
  report.judgement = plan::judge(report.study, plan, {}, {});
  // A script of nine steps, which are to stand whole on the sheet.
  const auto best = static_cast<std::size_t>(report.judgement.ranking.plans.front().trial);
  for (int k = 0; k < 4; ++k) {
    plan.candidates[best].moves.push_back({.push = 20.0});
    plan.candidates[best].moves.push_back({.turn = 0.5});
  }
  report.robustness = robustness(report.judgement.ranking);
  report.verdict = long_verdict();
  for (int k = 0; k < 9; ++k) {
    report.warnings.push_back("trials: warning " + std::to_string(k) + kMaker + kMaker);
  }
  const simulate::Way way(path, {preprocess::Branch{.line = path}});
  Json anatomy = anatomy_figures(way, 2.0 * path.radius, {});
  anatomy["warnings"] = Json::array();
  anatomy["access"]["calcium"] = calcium_json(12.5, "", {});
  report.figures["anatomy"] = anatomy;
  page.panels["anatomy"] = anatomy_panel(way);
  report.timing = {{"threads", 1}, {"stages", Json::array()}, {"numerics", Json::array()}};
  for (Eigen::Index k = 0; k < surface.triangles.cols(); ++k)
    page.peak_force.push_back(draw(random));

  std::vector<Place> places;
  for (int k = 0; k <= 12; ++k) {
    places.push_back({"place " + std::to_string(k), {0.0, 0.0, 5.0 + 19.0 * k}, {}});
  }
  page.panels["slices"] = slices_json(
      cut_slices(make_volume(), surface, places, {.window_low = -200.0, .window_high = 500.0}));
  std::cerr << surface.triangles.cols() << " triangles, " << plan.trials.size() << " trials, "
            << page.insertions.size() << " insertions\n";
  return build_page(build_report(report), page);
}

}  // namespace
}  // namespace wireplan::pipeline

int main(int argc, char** argv) {
  wireplan::expects(argc == 3);
  wireplan::pipeline::write_whole(wireplan::pipeline::make_page(argv[2]), argv[1]);
  return 0;
}
