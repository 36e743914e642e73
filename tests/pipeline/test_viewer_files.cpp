// Files for 3D Slicer and spreadsheets, and where things lie in them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <sstream>

#include "pipeline/files/case_file.h"
#include "pipeline/files/viewer_files.h"
#include "pipeline/report/report.h"
#include "pipeline/report/sheet_csv.h"
#include "pipeline/stages/stages.h"
#include "preprocess/files/vessel_io.h"
#include "preprocess/volume/image.h"
#include "tests/pipeline/finished_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

Json read_markups(const fs::path& path) { return Json::parse(read_text(path)).at("markups"); }

Vec3 position(const Json& control) {
  const Json& p = control.at("position");
  return {p[0].get<double>(), p[1].get<double>(), p[2].get<double>()};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find("\r\n", at);
    lines.push_back(text.substr(at, end - at));
    at = end + 2;
  }
  return lines;
}

TEST(ViewerFiles, PutWireEntryAndTargetOfAPlanIntoOneMarkupsFile) {
  const TemporaryFolder folder;
  Eigen::Matrix3Xd nodes(3, 11);
  for (int k = 0; k < 11; ++k) nodes.col(k) << 0.0, 0.1 * k, 1.0 * k;
  write_plan_markups({.name = "plan-1",
                      .nodes = nodes,
                      .access = {0.0, 0.0, 0.0},
                      .direction = {0.0, 0.0, 2.0},
                      .target = {1.0, 2.0, 12.0}},
                     folder / "plan.mrk.json");
  const Json markups = read_markups(folder / "plan.mrk.json");
  ASSERT_EQ(markups.size(), 3u);
  for (const Json& markup : markups) {
    EXPECT_EQ(markup.at("coordinateSystem"), "LPS");
    EXPECT_EQ(markup.at("coordinateUnits"), "mm");
  }
  EXPECT_EQ(markups[0].at("type"), "Curve");
  EXPECT_EQ(position(markups[0].at("controlPoints").front()), nodes.col(0));
  EXPECT_EQ(position(markups[0].at("controlPoints").back()), nodes.col(10));
  EXPECT_EQ(markups[1].at("type"), "Line");
  EXPECT_EQ(position(markups[1].at("controlPoints")[0]), Vec3(0.0, 0.0, -40.0)) << "from outside";
  EXPECT_EQ(position(markups[1].at("controlPoints")[1]), Vec3(0.0, 0.0, 0.0));
  EXPECT_EQ(markups[2].at("type"), "Fiducial");
  EXPECT_EQ(position(markups[2].at("controlPoints")[1]), Vec3(1.0, 2.0, 12.0));
}

TEST(ViewerFiles, CurvesOfStepsAreCalledByWhatTheHandDoes) {
  const TemporaryFolder folder;
  simulate::TrialResult trial;
  trial.tools.resize(2);
  for (const int tool : {0, 1}) {
    trial.tools[static_cast<std::size_t>(tool)].insertion = {tool == 0 ? 10.0 : 30.0};
    trial.tools[static_cast<std::size_t>(tool)].roll = {0.0};
  }
  trial.steps = {0};
  simulate::Shape& shape = trial.shapes.emplace_back();
  shape.nodes = Eigen::Matrix3Xd::Zero(3, 31);
  shape.nodes.row(2) = Eigen::RowVectorXd::LinSpaced(31, 0.0, 30.0);
  shape.tools = {10.0, 30.0};
  write_step_markups(trial, {{"advance the wire to 30 mm", "If it goes elsewhere, stop."}}, "plan",
                     {"catheter", "wire"}, folder.path());
  const Json markups = read_markups(folder / "plan-wire-steps.mrk.json");
  ASSERT_EQ(markups.size(), 1u);
  EXPECT_EQ(markups[0].at("name"), "step 1: advance the wire to 30 mm");
  EXPECT_EQ(position(markups[0].at("controlPoints").back()), Vec3(0.0, 0.0, 30.0));
  const Json catheter = read_markups(folder / "plan-catheter-steps.mrk.json");
  EXPECT_EQ(position(catheter[0].at("controlPoints").back()), Vec3(0.0, 0.0, 10.0));
}

TEST(ViewerFiles, ListEveryTrialWithUnitsInTheHeader) {
  const Json report = {{"ranking", {{{"trial", 1}, {"rank", 1}}}},
                       {"trials",
                        {{{"id", 0},
                          {"wire", "say \"x\", please"},
                          {"insertion_mm", nullptr},
                          {"reached", false},
                          {"wall_motion", nullptr},
                          {"null_reasons", {{"insertion_mm", "stuck"}}}},
                         {{"id", 1},
                          {"wire", "soft"},
                          {"insertion_mm", 30.5},
                          {"reached", true},
                          {"wall_motion", nullptr}}}}};
  EXPECT_EQ(trials_csv(report),
            "rank,id,wire,insertion_mm,reached\r\n"
            ",0,\"say \"\"x\"\", please\",,false\r\n"
            "1,1,\"soft\",30.5,true\r\n");
  Json tools = report;
  tools["trials"][1]["catheter"] = "cobra-c2";
  EXPECT_EQ(trials_csv(tools),
            "rank,id,wire,insertion_mm,reached,catheter\r\n"
            ",0,\"say \"\"x\"\", please\",,false,\r\n"
            "1,1,\"soft\",30.5,true,\"cobra-c2\"\r\n");
  tools["trials"][1].update({{"first_wire", "softer"}, {"exchanges", 1}});
  EXPECT_EQ(trials_csv(tools),
            "rank,id,wire,insertion_mm,reached,catheter,first_wire,exchanges\r\n"
            ",0,\"say \"\"x\"\", please\",,false,,,\r\n"
            "1,1,\"soft\",30.5,true,\"cobra-c2\",\"softer\",1\r\n");
}

TEST(ViewerFiles, ListTheFiguresOfTheSheet) {
  const Json report = {
      {"verdict",
       {{"answer", "feasible"},
        {"headline", "A \"plan\"."},
        {"reasons", {"So."}},
        {"changes", Json::array()}}},
      {"provenance",
       {{"parameters", {{"limits", {{"tip_force_warn_n", 0.3}}}}}, {"warnings", Json::array()}}},
      {"statement", "Research use only."},
      {"ranking",
       {{{"trial", 0},
         {"wire", "soft"},
         {"inclination_deg", 10},
         {"azimuth_deg", 90},
         {"roll_deg", 0},
         {"script", ""},
         {"score", 0.25}}}},
      {"trials",
       {{{"insertion_mm", 30.5}, {"peak_tip_force_n", 0.125}, {"peak_contact_force_n", 0.5}}}},
      {"numerics", {{"plans", {{{"trial", 0}, {"tip_error_mm", nullptr}}}}}},
      {"robustness",
       {{"plans",
         {{{"trial", 0},
           {"successes", 3},
           {"repeats", 4},
           {"success_rate_interval", {0.25, 0.75}}}}},
        {"sensitivity", {{"shares", {{{"unknown", "lumen"}, {"share", 0.5}}}}}}}}};
  EXPECT_EQ(sheet_csv(report),
            "section,quantity,value,unit,limit,note\r\n"
            "\"verdict\",\"answer\",\"feasible\",,,\"A \"\"plan\"\".\"\r\n"
            "\"verdict\",\"reason\",,,,\"So.\"\r\n"
            "\"plan 1\",\"wire\",\"soft\",,,\r\n"
            "\"plan 1\",\"inclination\",10,\"deg\",,\r\n"
            "\"plan 1\",\"azimuth\",90,\"deg\",,\r\n"
            "\"plan 1\",\"roll of the tip\",0,\"deg\",,\r\n"
            "\"plan 1\",\"wire in the vessel\",30.5,\"mm\",,\r\n"
            "\"plan 1\",\"tip force\",0.125,\"N\",0.3,\r\n"
            "\"plan 1\",\"largest force on 5 mm of wire\",0.5,\"N\",,\r\n"
            "\"plan 1\",\"score\",0.25,,,\r\n"
            "\"plan 1\",\"safe repeats\",3,,4,\r\n"
            "\"plan 1\",\"share safe, low end of 95 % interval\",0.25,,,\r\n"
            "\"plan 1\",\"share safe, high end of 95 % interval\",0.75,,,\r\n"
            "\"plan 1\",\"stated error of the tip\",,\"mm\",,\r\n"
            "\"uncertain\",\"share of lumen in what moves the plans\",0.5,,,\r\n"
            "\"statement\",\"statement\",,,,\"Research use only.\"\r\n");
}

TEST(ViewerFiles, TheSheetsTableHasEachStepItsViewAndWhatElseToDo) {
  Json plan = {{"trial", 0},    {"wire", "soft"},      {"inclination_deg", 0}, {"azimuth_deg", 0},
               {"roll_deg", 0}, {"script", "out; in"}, {"catheter", "hook"},   {"score", 0.25}};
  plan.update({{"first_wire", "softer"}, {"exchanges", 1}});
  plan["steps"] = {{{"text", "out"}, {"otherwise", "If not, back."}}, {{"text", "in"}}};
  plan["step_views"] = {
      {{"text", "out"}, {"at", "ostium of left renal"}, {"view", "LAO 30, CRA 0"}},
      {{"text", "in"}, {"at", nullptr}, {"view", nullptr}}};
  Json report = {
      {"verdict",
       {{"answer", "feasible"},
        {"headline", ""},
        {"reasons", Json::array()},
        {"changes", Json::array()}}},
      {"provenance",
       {{"parameters", {{"limits", {{"tip_force_warn_n", 0.3}}}}}, {"warnings", Json::array()}}},
      {"statement", ""},
      {"ranking", {plan}},
      {"trials",
       {{{"insertion_mm", 1},
         {"peak_tip_force_n", 0},
         {"peak_contact_force_n", 0},
         {"tools",
          {{"each", Json::array()},
           {"hook_depth_mm", 10.5},
           {"support_n", 0.25},
           {"support_is_least", true},
           {"moves", 7}}}}}},
      {"numerics", {{"plans", Json::array()}}},
      {"robustness", {{"plans", Json::array()}, {"sensitivity", {{"shares", Json::array()}}}}}};
  const auto expect_rows = [&](const std::string& rows) {
    EXPECT_NE(sheet_csv(report).find(rows), std::string::npos) << sheet_csv(report);
  };
  expect_rows(
      "\"plan 1\",\"catheter\",\"hook\",,,\r\n"
      "\"plan 1\",\"wire to begin with\",\"softer\",,,\r\n"
      "\"plan 1\",\"exchanges of the wire\",1,,,\r\n"
      "\"plan 1\",\"step 1\",\"out\",,,\"LAO 30, CRA 0: ostium of left renal\"\r\n"
      "\"plan 1\",\"step 1, otherwise\",\"If not, back.\",,,\r\n"
      "\"plan 1\",\"step 2\",\"in\",,,\r\n"
      "\"plan 1\",\"catheter past the ostium\",10.5,\"mm\",,\r\n"
      "\"plan 1\",\"push that the seated catheter bears\",0.25,\"N\",,\"at least\"\r\n"
      "\"plan 1\",\"moves of the hand\",7,,,\r\n");
  for (const char* key : {"catheter", "steps"}) report["ranking"][0].erase(key);
  expect_rows(
      "\"plan 1\",\"step 1\",\"out\",,,\"LAO 30, CRA 0: ostium of left renal\"\r\n"
      "\"plan 1\",\"step 2\",\"in\",,,\r\n");
}

TEST(ViewerFiles, ComeWithEveryRankedPlanOfARun) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  RunOptions options;
  options.cache = folder / "cache";
  const fs::path made =
      run_stages(read_case(folder / "case.json"), options).artifacts.back().folder;
  const Json report = read_json(made / "report.json", kReportSchema);
  const std::size_t ranked = report.at("ranking").size();
  ASSERT_EQ(ranked, 2u);
  for (std::size_t k = 1; k <= ranked; ++k) {
    const Json markups =
        read_markups(made / "trials" / ("plan-" + std::to_string(k) + ".mrk.json"));
    const Json& curve = markups[0].at("controlPoints");
    const int trial = report.at("ranking")[k - 1].at("trial");
    EXPECT_NEAR((position(curve.back()) - Vec3(0.0, 0.0, 28.0)).norm(),
                report.at("trials")[static_cast<std::size_t>(trial)].at("tip_to_target_mm"), 1e-4)
        << "the wire ends at its tip, in single precision";
    EXPECT_NEAR((position(curve.front()) - Vec3(0.0, 0.0, 6.0)).norm(), 0.0, 2.1)
        << "an element of 2 mm at most from the access";
  }
  const std::vector<std::string> rows = lines_of(read_text(made / "trials.csv"));
  ASSERT_EQ(rows.size(), 1 + report.at("trials").size());
  EXPECT_NE(rows[0].find(",peak_contact_force_n,"), std::string::npos);
  for (const std::string& row : rows) {
    EXPECT_EQ(std::count(row.begin(), row.end(), ','),
              std::count(rows[0].begin(), rows[0].end(), ','))
        << "no name of this case has a comma";
  }
}

// The header of an NRRD file as another program reads it: lines of "key: value" up to a blank one.
std::vector<double> header_numbers(const fs::path& nrrd, const std::string& key) {
  std::istringstream header(read_text(nrrd));
  for (std::string line; std::getline(header, line) && !line.empty();) {
    if (line.rfind(key + ":", 0) != 0) continue;
    for (char& c : line) {
      if (c == '(' || c == ')' || c == ',') c = ' ';
    }
    std::istringstream values(line.substr(key.size() + 1));
    return {std::istream_iterator<double>(values), {}};
  }
  return {};
}

TEST(ViewerFiles, MaskSurfaceAndCtLieOnOneAnotherInLps) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  // A bright tube of radius 5 mm along a line askew to a grid that is askew itself.
  const Vec3 start(20.0, -30.0, 100.0), along = Vec3(0.2, -0.1, 1.0).normalized();
  const double radius = 5.0, length = 50.0;
  preprocess::Image ct;
  ct.grid.size = {40, 44, 72};
  ct.grid.spacing = {0.9, 0.9, 0.9};
  ct.grid.direction = Eigen::AngleAxisd(0.3, Vec3(1.0, -1.0, 2.0).normalized()).toRotationMatrix();
  ct.grid.origin =
      start + 0.5 * length * along - ct.grid.direction * (0.45 * Vec3(40.0, 44.0, 72.0));
  const auto off_axis = [&](const Vec3& p) { return (p - start).cross(along).norm(); };
  const auto inside = [&](const Vec3& p) {
    const double s = (p - start).dot(along);
    return s > 0.0 && s < length && off_axis(p) < radius;
  };
  for (int k = 0; k < 72; ++k) {
    for (int j = 0; j < 44; ++j) {
      for (int i = 0; i < 40; ++i) {
        ct.values.push_back(inside(ct.grid.lps_from_ijk(Vec3(i, j, k))) ? 400.0F : 40.0F);
      }
    }
  }
  const TemporaryFolder folder;
  preprocess::write_image(ct, folder / "ct.nrrd");
  Json given = write_tube_case(folder.path());
  given.erase("surface");
  given["volume"] = {{"path", "ct.nrrd"}};
  given["segmentation"] = {{"lower_hu", 200}, {"upper_hu", 600}};
  given["access"]["point_mm"] = to_json(Vec3(start + 8.0 * along));
  given["target"]["point_mm"] = to_json(Vec3(start + 35.0 * along));
  write_json(given, folder / "case.json");
  RunOptions options;
  options.cache = folder / "cache";
  options.to = "surface";
  publish(run_stages(read_case(folder / "case.json"), options).artifacts, folder / "out");

  // Mask and CT have the same frame, by their headers.
  for (const char* key : {"space directions", "space origin"}) {
    const std::vector<double> mask = header_numbers(folder / "out" / "mask.nrrd", key);
    const std::vector<double> volume = header_numbers(folder / "ct.nrrd", key);
    ASSERT_FALSE(mask.empty());
    ASSERT_EQ(mask.size(), volume.size());
    for (std::size_t k = 0; k < mask.size(); ++k) EXPECT_NEAR(mask[k], volume[k], 1e-9) << key;
  }
  EXPECT_NE(read_text(folder / "out" / "mask.nrrd").find("space: left-posterior-superior"),
            std::string::npos);

  // Its labelled voxels, placed by the header alone, are those of the tube.
  const std::vector<double> d = header_numbers(folder / "out" / "mask.nrrd", "space directions");
  const std::vector<double> o = header_numbers(folder / "out" / "mask.nrrd", "space origin");
  const preprocess::Mask mask = preprocess::read_mask(folder / "out" / "mask.nrrd");
  int labelled = 0;
  for (int k = 0; k < 72; ++k) {
    for (int j = 0; j < 44; ++j) {
      for (int i = 0; i < 40; ++i) {
        const Vec3 p = Vec3(o[0], o[1], o[2]) + i * Vec3(d[0], d[1], d[2]) +
                       j * Vec3(d[3], d[4], d[5]) + k * Vec3(d[6], d[7], d[8]);
        const bool label = mask.labels[mask.grid.index(i, j, k)] != 0;
        EXPECT_EQ(label, inside(p)) << p.transpose();
        labelled += label ? 1 : 0;
      }
    }
  }
  EXPECT_GT(labelled, 3000);

  // So is the surface: between the ends, its vertices are the radius off the axis.
  const Surface surface = preprocess::read_surface_artifact(folder / "out" / "surface.vtp");
  int checked = 0;
  double sum = 0.0;
  for (const Vec3& p : surface.vertices.colwise()) {
    const double s = (p - start).dot(along);
    if (s < 5.0 || s > length - 5.0) continue;
    EXPECT_NEAR(off_axis(p), radius, 0.9) << "a voxel";
    sum += off_axis(p);
    ++checked;
  }
  ASSERT_GT(checked, 300);
  EXPECT_NEAR(sum / checked, radius, 0.3) << "a third of a voxel on average";
}

}  // namespace
}  // namespace wireplan::pipeline
