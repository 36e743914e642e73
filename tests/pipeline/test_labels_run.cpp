// From labels to a report, through the program: without the volume and in it, and on real data.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "pipeline/store/hash.h"
#include "preprocess/files/vessel_io.h"
#include "preprocess/volume/labels.h"
#include "tests/messages.h"
#include "tests/pipeline/program.h"
#include "tests/pipeline/small_case.h"
#include "tests/preprocess/label_bytes.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;
using preprocess::Grid;

/// Share of voxels of both: twice what they have in common over their sum. The surface's voxels are
/// those whose centre it encloses, by where it crosses the lines along k.
double dice(const Surface& surface, const Grid& grid, const std::vector<std::uint8_t>& labels) {
  std::vector<std::vector<double>> crossings(static_cast<std::size_t>(grid.size[0]) *
                                             static_cast<std::size_t>(grid.size[1]));
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    Mat3 p;
    for (int c = 0; c < 3; ++c) {
      p.col(c) = grid.ijk_from_lps(surface.vertices.col(surface.triangles(c, t)));
    }
    const Vec3 low = p.rowwise().minCoeff(), high = p.rowwise().maxCoeff();
    for (int i = static_cast<int>(std::ceil(low[0])); i <= std::floor(high[0]); ++i) {
      for (int j = static_cast<int>(std::ceil(low[1])); j <= std::floor(high[1]); ++j) {
        // Off the centre by so little that no line meets an edge.
        const double x = i + 1.234e-7, y = j + 2.345e-7;
        Eigen::Matrix2d edges;
        edges << p(0, 1) - p(0, 0), p(0, 2) - p(0, 0), p(1, 1) - p(1, 0), p(1, 2) - p(1, 0);
        const double area = edges.determinant();
        if (area == 0.0) continue;
        const double u = ((x - p(0, 0)) * edges(1, 1) - (y - p(1, 0)) * edges(0, 1)) / area,
                     v = ((y - p(1, 0)) * edges(0, 0) - (x - p(0, 0)) * edges(1, 0)) / area;
        if (u < 0.0 || v < 0.0 || u + v > 1.0) continue;
        if (i < 0 || j < 0 || i >= grid.size[0] || j >= grid.size[1]) continue;
        crossings[static_cast<std::size_t>(i + grid.size[0] * j)].push_back(
            p(2, 0) + u * (p(2, 1) - p(2, 0)) + v * (p(2, 2) - p(2, 0)));
      }
    }
  }
  double both = 0.0, sum = 0.0;
  for (std::size_t column = 0; column < crossings.size(); ++column) {
    std::sort(crossings[column].begin(), crossings[column].end());
    for (int k = 0; k < grid.size[2]; ++k) {
      const auto below = std::lower_bound(crossings[column].begin(), crossings[column].end(), k) -
                         crossings[column].begin();
      const bool in = below % 2 == 1;
      const bool label = labels[column + crossings.size() * static_cast<std::size_t>(k)] != 0;
      both += in && label ? 1.0 : 0.0;
      sum += (in ? 1.0 : 0.0) + (label ? 1.0 : 0.0);
    }
  }
  return 2.0 * both / sum;
}

/// The tubes of write_two_tubes() as labels: the first is 1, the second 2.
std::uint8_t tube_label(int i, int j) {
  const double y = j - 20.0;
  return std::hypot(i - 10.0, y) < 6.0 ? 1 : std::hypot(i - 30.0, y) < 6.0 ? 2 : 0;
}

class LabelsRun : public testing::Test {
 protected:
  void SetUp() override {
    if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
    case_ = write_tube_case(folder_.path());
    case_["surface"] = {{"edge_length_mm", 1.5}};
    case_["access"]["point_mm"] = {10, 20, 8};
    case_["target"]["point_mm"] = {10, 20, 30};
    write_two_tubes(folder_ / "ct.nrrd");
    for (int k = 0; k < grid_.size[2]; ++k) {
      for (int j = 0; j < grid_.size[1]; ++j) {
        for (int i = 0; i < grid_.size[0]; ++i) values_.push_back(tube_label(i, j));
      }
    }
    std::vector<std::uint8_t> first = values_;
    std::replace(first.begin(), first.end(), 2, 0);
    write_text(preprocess::label_nifti(grid_, first), folder_ / "classes/tube.nii");
    write_text(preprocess::label_nifti(grid_, values_), folder_ / "both.nii");
    write_text(preprocess::label_nrrd(grid_, {values_}, {{"other", 2, 0}, {"tube", 1, 0}}),
               folder_ / "both.seg.nrrd");
  }

  Answer run(const Json& labels, bool in_volume, const std::string& more) {
    Json file = case_;
    file["labels"] = labels;
    if (in_volume) file["volume"] = {{"path", "ct.nrrd"}};
    write_json(file, folder_ / "case.json");
    return run_program(folder_.path(), "run case.json " + more);
  }

  Grid grid_{.size = {40, 40, 36}};
  std::vector<std::uint8_t> values_;
  TemporaryFolder folder_;
  Json case_;
};

TEST_F(LabelsRun, OfAnyFormGivesTheSameBytesOfTheMask) {
  const std::vector<Json> forms = {{{"path", "classes/"}, {"names", {"tube"}}},
                                   {{"path", "both.nii"}, {"values", {1}}, {"names", {"tube"}}},
                                   {{"path", "both.seg.nrrd"}, {"names", {"tube"}}}};
  for (const bool in_volume : {false, true}) {
    std::string first;
    for (std::size_t k = 0; k < forms.size(); ++k) {
      const std::string out = "out" + std::to_string(k);
      const Answer answer = run(forms[k], in_volume, "--to segment -o " + out);
      ASSERT_EQ(answer.code, 0) << answer.log;
      const std::string bytes = read_text(folder_ / (out + "/mask.nrrd"));
      ASSERT_FALSE(bytes.empty());
      if (k == 0) first = bytes;
      EXPECT_EQ(bytes, first) << forms[k];
    }
  }
}

TEST_F(LabelsRun, EndsInAReportThatFollowsItsSchema) {
  const Json labels = {{"path", "both.nii"}, {"values", {1, 2}}, {"names", {"tube", "other"}}};
  Answer answer = run(labels, false, "-o out");
  ASSERT_EQ(answer.code, 0) << answer.out << answer.log;
  const Json report = read_json(folder_ / "out/report.json", "wireplan.report/2");
  // The nearest voxels of the tubes are 10 mm apart, their faces 9: left out, and said.
  const std::string warnings = report.at("provenance").at("warnings").dump();
  EXPECT_TRUE(holds(warnings, "a piece of other") && holds(warnings, "is left out: 9.0 mm"))
      << warnings;
  EXPECT_TRUE(holds(warnings, "every radius may be 0.5 mm more or less")) << warnings;
  EXPECT_TRUE(holds(warnings, "but the repeats move it by at most 0.36 mm")) << warnings;
  // As far as the wire leaves room for it (plan/make_plan.cpp); of a surface it would be 0.25.
  EXPECT_GT(report.at("robustness").at("unknowns").at("lumen_mm").get<double>(), 0.3);
  const Json& vessel = report.at("vessel");
  EXPECT_TRUE(vessel.at("image").is_null());
  EXPECT_EQ(vessel.at("segmentation").at("left_out").size(), 1u);
  EXPECT_EQ(vessel.at("branches").at(1).at("name"), "tube (branch 1)");
  EXPECT_TRUE(holds(read_text(folder_ / "out/tree.mrk.json"), "\"tube (branch 1)\""));
  // On voxels of 1 mm the tube's volume is that of its voxels.
  const double expected =
      36.0 * static_cast<double>(std::count(values_.begin(), values_.begin() + 1600, 1));
  EXPECT_NEAR(vessel.at("volume_mm3").get<double>(), expected, 0.03 * expected);

  // In the volume the wall is fitted, and both files are named.
  write_text("1,tube\n2,other\n", folder_ / "both.csv");
  answer = run(labels, true, "-o in");
  ASSERT_EQ(answer.code, 0) << answer.out << answer.log;
  const Json in = read_json(folder_ / "in/report.json", "wireplan.report/2");
  EXPECT_EQ(in.at("provenance").at("inputs").size(), 2u);
  EXPECT_EQ(in.at("provenance").at("inputs").at(1).at("name"), "both.nii");
  EXPECT_EQ(in.at("provenance").at("inputs").at(1).at("sha256"), hash_file(folder_ / "both.nii"));
  EXPECT_GT(in.at("vessel").at("segmentation").at("edge_contrast_hu").get<double>(), 150.0);
  expect_follows_schemas(folder_.path());
}

TEST_F(LabelsRun, FollowAllThatIsReadOfATableOfNames) {
  // The names in the file go before those of a table that lies beside it, not before a given one's.
  const Json named = {{"path", "both.seg.nrrd"}, {"values", {1}}};
  Json by_table = named;
  by_table["table"] = "both.csv";
  write_text("1,vessel\n2,x\n", folder_ / "both.csv");
  for (const auto& [labels, name] : {std::pair(named, "tube"), std::pair(by_table, "vessel")}) {
    const Answer answer = run(labels, false, "--to centerline -o out");
    ASSERT_EQ(answer.code, 0) << answer.log;
    const std::string tree = read_text(folder_ / "out/tree.mrk.json");
    EXPECT_TRUE(holds(tree, "\"" + std::string(name) + " (branch 1)\"")) << tree;
  }

  // What is told of a broken one is told no more when it is gone.
  const Json unnamed = {{"path", "both.nii"}, {"values", {1}}};
  const auto told = [&] { return run(unnamed, false, "--to segment -o out").log; };
  write_text("1,vessel\n1,x\n", folder_ / "both.csv");
  EXPECT_TRUE(holds(told(), "the labels have no names"));
  fs::remove(folder_ / "both.csv");
  EXPECT_FALSE(holds(told(), "the labels have no names"));
}

TEST_F(LabelsRun, ThatDoNotFitTheVolumeAreRefused) {
  Grid shifted = grid_;
  shifted.origin.x() += 10.0;
  write_text(preprocess::label_nifti(shifted, values_), folder_ / "shifted.nii");
  for (const char* command : {"run case.json", "check case.json"}) {
    run({{"path", "shifted.nii"}, {"values", {1}}}, true, "--dry-run");
    const Answer answer = run_program(folder_.path(), command);
    EXPECT_EQ(answer.code, 2) << command;
    EXPECT_TRUE(holds(answer.log, "it would fit shifted by (-10, 0, 0) mm")) << answer.log;
  }
  // The header is right, the voxels are not.
  std::vector<std::uint8_t> turned = values_;
  for (std::size_t n = 0; n < turned.size(); ++n) {
    const auto i = static_cast<int>(n % 40), j = static_cast<int>(n / 40 % 40);
    turned[n] = j >= 7 ? tube_label(i, j - 7) : std::uint8_t{0};
  }
  write_text(preprocess::label_nifti(grid_, turned), folder_ / "turned.nii");
  const Answer answer = run({{"path", "turned.nii"}, {"values", {1}}}, true, "");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(holds(answer.log, "they would fit shifted by (0, -7, 0) mm")) << answer.log;
}

TEST_F(LabelsRun, ADoubtfulFrameIsToldByCheckAndRunAlike) {
  // A crop whose first voxel is told 1.5 mm off.
  const Grid crop{.size = {38, 40, 36}, .spacing = Vec3(1, 1, 1), .origin = Vec3(2.5, 0, 0)};
  std::vector<std::uint8_t> values;
  for (int k = 0; k < crop.size[2]; ++k) {
    for (int j = 0; j < crop.size[1]; ++j) {
      for (int i = 0; i < crop.size[0]; ++i) values.push_back(tube_label(i + 1, j));
    }
  }
  write_text(preprocess::label_nifti(crop, values), folder_ / "crop.nii");
  const Answer answer = run({{"path", "crop.nii"}, {"values", {1}}}, true, "--to segment -o out");
  ASSERT_EQ(answer.code, 0) << answer.log;
  const std::string told =
      "mind: segment: the volume shows the labels' edges more clearly with the "
      "labels shifted by (-1";
  EXPECT_TRUE(holds(answer.log, told)) << answer.log;
  const Answer again = run_program(folder_.path(), "run case.json --to segment -o out");
  EXPECT_TRUE(holds(again.log, "cached") && holds(again.log, told)) << again.log;
  const Answer check = run_program(folder_.path(), "check case.json");
  EXPECT_TRUE(holds(check.out, told.substr(6))) << check.out;
  // As it is told right there is nothing to mind of it.
  Grid right = crop;
  right.origin.x() = 1.0;
  write_text(preprocess::label_nifti(right, values), folder_ / "crop.nii");
  EXPECT_FALSE(holds(run_program(folder_.path(), "check case.json").out, "more clearly"));
}

TEST_F(LabelsRun, TellsEveryPointThatLiesOutside) {
  case_["access"]["point_mm"] = {20, 20, 8};
  case_["target"]["point_mm"] = {30, 20, 30};
  const Answer answer =
      run({{"path", "both.nii"}, {"values", {1, 2}}, {"names", {"tube", "other"}}}, false, "");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(holds(answer.log, "access.point_mm is [20.0,20.0,8.0], 5.0 mm outside the labels"))
      << answer.log;
  EXPECT_TRUE(holds(answer.log, "target.point_mm") &&
              holds(answer.log, "it lies in other, of which"))
      << answer.log;
  // By the key that the case has.
  case_["access"].erase("point_mm");
  case_["access"]["point"] = {{"ijk", {20, 20, 8}}};
  const Answer voxel =
      run({{"path", "both.nii"}, {"values", {1, 2}}, {"names", {"tube", "other"}}}, false, "");
  EXPECT_TRUE(holds(voxel.log, "access.point is [20.0,20.0,8.0], 5.0 mm outside the labels"))
      << voxel.log;
}

TEST_F(LabelsRun, AreGrownToATargetThatTheyLack) {
  std::vector<std::uint8_t> half = values_;
  std::fill(half.begin() + 18 * 1600, half.end(), std::uint8_t{0});
  write_text(preprocess::label_nifti(grid_, half), folder_ / "half.nii");
  const Json labels = {{"path", "half.nii"}, {"values", {1}}, {"names", {"tube"}}};
  Answer answer = run(labels, false, "--to centerline -o out");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(holds(answer.log, "target.point_mm is [10.0,20.0,30.0], 13.0 mm outside the labels"))
      << answer.log;
  answer = run(labels, true, "--to centerline -o out");
  EXPECT_EQ(answer.code, 0) << answer.log;
  answer = run_program(folder_.path(), "check case.json");
  EXPECT_TRUE(holds(answer.out, "target.point_mm lies beyond the labels: tube was grown"))
      << answer.out;
  case_["target"]["point_mm"] = {30, 20, 30};  // in the other tube
  answer = run(labels, true, "--to centerline -o out");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(holds(answer.log, "no artery leads there from them")) << answer.log;
}

/// The dissected aorta of the shared data with labels made by a network.
TEST_F(LabelsRun, OfTheDissectionGiveItsBranchesByName) {
  const char* set = std::getenv("WIREPLAN_DATA");
  const fs::path data =
      (set != nullptr ? fs::path(set) : fs::path(WIREPLAN_SOURCE_DIR) / "../shared/data") /
      "ct-aorta-dissection-labelled";
  if (!fs::exists(data)) GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  const std::vector<std::string> names = {"aorta_true_lumen", "brachiocephalic_trunk",
                                          "common_carotid_artery_left"};
  Grid grid;
  std::vector<std::uint8_t> merged;
  {
    const preprocess::LabelVolume labels = preprocess::read_labels(data, {.names = names});
    grid = labels.grid;
    merged = labels.class_of;
  }
  case_.erase("target");
  case_["surface"] = {{"edge_length_mm", 1}};
  case_["access"] = {{"branch", names[0]}, {"end", "inferior"}, {"inclination_deg", {0}}};
  case_["targets"] = Json::array();
  for (const char* name : {"brachiocephalic_trunk", "common_carotid_artery_left"}) {
    case_["targets"].push_back({{"name", name}, {"branch", name}, {"beyond_ostium_mm", 15}});
  }
  case_["labels"] = {{"path", data.string()}, {"names", names}};
  for (const bool in_volume : {false, true}) {
    SCOPED_TRACE(in_volume);
    if (in_volume) case_["volume"] = {{"path", (data / "ct_cropped.nii.gz").string()}};
    write_json(case_, folder_ / "case.json");
    const Answer answer = run_program(folder_.path(), "run case.json --to centerline -o out");
    ASSERT_EQ(answer.code, 0) << answer.out << answer.log;
    const Surface surface =
        preprocess::read_surface_artifact(folder_ / ("out/brachiocephalic_trunk/surface.vtp"));
    const double agreement = dice(surface, grid, merged);
    EXPECT_GT(agreement, 0.97);
    const std::string curves = read_text(folder_ / "out/common_carotid_artery_left/tree.mrk.json");
    EXPECT_NE(curves.find("brachiocephalic trunk, then left common carotid artery (branch 2)"),
              std::string::npos);
    RecordProperty(in_volume ? "dice_in_volume" : "dice", std::to_string(agreement));
  }
}

}  // namespace
}  // namespace wireplan::pipeline
