// `wireplan new`: a case from a volume and points, which reads as one.
#include <gtest/gtest.h>

#include "pipeline/commands/new_case.h"
#include "pipeline/files/case_file.h"
#include "preprocess/volume/image.h"
#include "tests/messages.h"
#include "tests/pipeline/program.h"
#include "tests/preprocess/label_bytes.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

class NewCaseTest : public ::testing::Test {
 protected:
  void SetUp() override {
    preprocess::Image image;
    image.grid.size = {20, 30, 10};
    image.grid.spacing = {0.5, 0.8, 3.0};
    image.grid.origin = {-10.0, 20.0, 5.0};
    for (std::size_t k = 0; k < image.grid.voxels(); ++k) {
      const bool is_noisy = k / 20 % 2 == 0;                // rows of even j
      const float contrast = k % 20 < 10 ? 40.0F : 300.0F;  // from i = 10 on
      image.values.push_back(contrast +
                             (is_noisy ? static_cast<float>(k * 7919 % 61) - 30.0F : 0.0F));
    }
    fs::create_directories(folder_ / "scan");
    preprocess::write_image(image, folder_ / "scan/ct.nrrd");
  }

  /// Named points in LPS.
  fs::path points(const std::vector<std::pair<std::string, Vec3>>& named) {
    Json list = {{"type", "Fiducial"}, {"coordinateSystem", "LPS"}};
    for (const auto& [label, point] : named) {
      list["controlPoints"].push_back(
          {{"label", label}, {"position", to_json(point)}, {"positionStatus", "defined"}});
    }
    write_json({{"@schema", "markups-schema-v1.0.3.json#"}, {"markups", Json::array({list})}},
               folder_ / "scan/points.mrk.json");
    return folder_ / "scan/points.mrk.json";
  }

  NewCaseAnswer make(const fs::path& markups = {}) {
    return write_new_case({folder_ / "anna", folder_ / "scan/ct.nrrd", "", markups, /*labels=*/{}});
  }

  TemporaryFolder folder_;
};

const Vec3 kIn(-4.0, 24.0, 8.0), kOut(-3.0, 36.0, 26.0);  // voxels (12, 5, 1) and (14, 20, 7)

TEST_F(NewCaseTest, OfTwoPointsIsACase) {
  const NewCaseAnswer answer = make(points({{"target vessel", kOut}, {"Access", kIn}}));
  EXPECT_TRUE(answer.missing.empty()) << answer.missing.front();
  const Case read = read_case(folder_ / "anna");
  EXPECT_EQ(read.name, "anna");
  EXPECT_TRUE(fs::equivalent(read.volume->path, folder_ / "scan/ct.nrrd"));
  EXPECT_EQ(read.accesses[0].point, kIn);
  EXPECT_EQ(read.targets[0].point, kOut);
  const std::string readme = read_text(folder_ / "anna/README.md");
  EXPECT_TRUE(holds(readme, "\"Access\" at (-4.0, 24.0, 8.0) mm LPS, voxel (12, 5, 1): 300"))
      << readme;
  EXPECT_TRUE(holds(readme, "20 x 30 x 10")) << readme;
  EXPECT_TRUE(holds(readme, "## What is missing\nNothing.\n")) << readme;
}

TEST_F(NewCaseTest, NamesAreKeptWhereThereAreSeveral) {
  const Vec3 other(-4.0, 40.0, 8.0);
  make(points({{"access left", kIn}, {"access right", other}, {"target", kOut}, {"F-4", other}}));
  const Case read = read_case(folder_ / "anna");
  ASSERT_EQ(read.accesses.size(), 2u);
  EXPECT_EQ(read.accesses[1].name, "access right");
  EXPECT_TRUE(holds(read_text(folder_ / "anna/README.md"), "\"F-4\" is not used"));
}

TEST_F(NewCaseTest, WithoutNamesTheFirstOfTwoIsTheAccess) {
  const NewCaseAnswer answer = make(points({{"F-1", kIn}, {"F-2", kOut}}));
  EXPECT_TRUE(holds(answer.found.back(), "\"F-1\" is taken as the access")) << answer.found.back();
  EXPECT_EQ(read_case(folder_ / "anna").targets[0].point, kOut);
}

TEST_F(NewCaseTest, SaysWhatIsMissing) {
  const NewCaseAnswer none = make();
  ASSERT_EQ(none.missing.size(), 1u);
  EXPECT_TRUE(holds(none.missing[0], "anna/points.mrk.json")) << none.missing[0];
  EXPECT_TRUE(holds(message_of([&] { read_case(folder_ / "anna"); }), "no such file"));
  fs::copy_file(points({{"access", kIn}, {"target", kOut}}), folder_ / "anna/points.mrk.json");
  EXPECT_EQ(read_case(folder_ / "anna").accesses[0].point, kIn);

  EXPECT_TRUE(holds(message_of([&] { make(); }), "is there already")) << "nothing is written over";
  fs::remove_all(folder_ / "anna");
  const NewCaseAnswer half =
      make(points({{"access", Vec3(-9.0, 24.0, 8.0)}, {"x", kOut}, {"y", Vec3(0.0, 0.0, 99.0)}}));
  EXPECT_TRUE(holds(half.found[1], ": 40, less than blood with contrast has")) << half.found[1];
  ASSERT_EQ(half.missing.size(), 2u);
  EXPECT_TRUE(holds(half.missing[0], "\"y\" inside the volume")) << half.missing[0];
  EXPECT_TRUE(holds(half.missing[1], "A point named \"target\"")) << half.missing[1];
}

TEST_F(NewCaseTest, TheProgramTellsItAndRefusesWhatIsNoVolume) {
  points({{"access", kIn}, {"target", kOut}});
  const Answer good =
      run_program(folder_.path(), "new p --volume scan/ct.nrrd --markups scan/points.mrk.json");
  EXPECT_EQ(good.code, 0) << good.log;
  EXPECT_TRUE(holds(good.out, "found: \"access\" at")) << good.out;
  EXPECT_TRUE(holds(good.out, "case: p/case.json")) << good.out;
  EXPECT_EQ(read_json(folder_ / "p/case.json", "wireplan.case/1").at("volume").at("path"),
            "../scan/ct.nrrd");
  EXPECT_EQ(run_program(folder_.path(), "new q --volume scan/nothing.nrrd").code, 2);
  EXPECT_FALSE(fs::exists(folder_ / "q"));
}

/// A trunk along k and a branch along i, one file per class.
void write_classes(const fs::path& folder, const preprocess::Grid& grid) {
  const auto write = [&](const std::string& name, const auto& holds_voxel) {
    std::vector<std::uint8_t> values;
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i) values.push_back(holds_voxel(i, j, k) ? 1 : 0);
      }
    }
    write_text(preprocess::label_nifti(grid, values), folder / (name + ".nii"));
  };
  fs::create_directories(folder);
  write("aorta", [](int i, int j, int) { return std::hypot(i - 6, j - 10) < 4.5; });
  write("renal_artery_left",
        [](int i, int j, int k) { return i > 9 && i < 28 && std::hypot(j - 10, k - 15) < 2.5; });
  write("portal_vein_and_splenic_vein", [](int i, int j, int) { return i > 32 && j > 16; });
  write("kidney_left", [](int, int, int) { return false; });
}

TEST_F(NewCaseTest, OfLabelsAloneIsACase) {
  const preprocess::Grid grid{.size = {36, 20, 30}};
  write_classes(folder_ / "classes", grid);
  const NewCase given{.folder = folder_ / "anna",
                      .volume = {},
                      .series = {},
                      .markups = {},
                      .labels = folder_ / "classes"};
  const NewCaseAnswer answer = write_new_case(given);
  EXPECT_TRUE(answer.missing.empty()) << answer.missing.front();
  const Case read = read_case(folder_ / "anna");
  EXPECT_FALSE(read.volume);
  EXPECT_EQ(read.labels->choice.names, (std::vector<std::string>{"aorta", "renal_artery_left"}));
  const std::string readme = read_text(folder_ / "anna/README.md");
  EXPECT_TRUE(holds(readme, "portal_vein_and_splenic_vein (") && !holds(readme, "kidney"))
      << readme;
  EXPECT_TRUE(holds(readme,
                    "the access at the inferior end of aorta, the target at the distal end "
                    "of renal_artery_left"))
      << readme;
  EXPECT_NEAR(read.targets[0].point.x(), 26.0, 2.5);
  EXPECT_NEAR(read.accesses[0].point.z(), 4.0, 3.0);
}

TEST_F(NewCaseTest, NamesOfArteriesAreKnownHoweverTheyAreWritten) {
  const preprocess::Grid grid{.size = {36, 20, 30}};
  write_classes(folder_ / "classes", grid);
  fs::rename(folder_ / "classes/aorta.nii", folder_ / "classes/Aorta.nii");
  fs::rename(folder_ / "classes/renal_artery_left.nii", folder_ / "classes/Left Iliac Artery.nii");
  fs::rename(folder_ / "classes/portal_vein_and_splenic_vein.nii",
             folder_ / "classes/Femoral_Head.nii");
  NewCase given{.folder = folder_ / "anna",
                .volume = {},
                .series = {},
                .markups = {},
                .labels = folder_ / "classes"};
  write_new_case(given);
  const Case read = read_case(folder_ / "anna");
  EXPECT_EQ(read.labels->choice.names, (std::vector<std::string>{"Aorta", "Left Iliac Artery"}));
  EXPECT_NEAR(read.accesses[0].point.x(), 26.0, 2.5) << "from the groin";

  // Points outside of the labels are missing; a series is one of a volume.
  given.folder = folder_ / "berta";
  given.markups = points({{"access", Vec3(6, 10, 3)}, {"target", Vec3(34, 3, 3)}});
  const NewCaseAnswer outside = write_new_case(given);
  ASSERT_EQ(outside.missing.size(), 1u);
  EXPECT_TRUE(holds(outside.missing[0], "target.point is [34.0,3.0,3.0]") &&
              holds(outside.missing[0], "outside the labels"))
      << outside.missing[0];
  EXPECT_TRUE(holds(outside.found.back(), "\"target\" at (34.0, 3.0, 3.0) mm LPS"))
      << outside.found.back();
  given.series = "3";
  given.folder = folder_ / "clara";
  EXPECT_TRUE(holds(message_of([&] { write_new_case(given); }), "--series 3: given without"));
}

TEST_F(NewCaseTest, OfLabelsWithoutNamesSaysSo) {
  const preprocess::Grid grid{.size = {12, 12, 12}};
  std::vector<std::uint8_t> values(grid.voxels(), 0);
  for (std::size_t n = 0; n < values.size(); ++n) values[n] = n % 12 < 4 ? 2 : n % 12 < 8 ? 5 : 0;
  write_text(preprocess::label_nifti(grid, values), folder_ / "scan/seg.nii");
  NewCase given{.folder = folder_ / "anna",
                .volume = {},
                .series = {},
                .markups = {},
                .labels = folder_ / "scan/seg.nii"};
  const NewCaseAnswer answer = write_new_case(given);
  EXPECT_TRUE(holds(answer.found.front(), "labels label 2 (0.576 ml), label 5 (0.576 ml)"))
      << answer.found.front();
  ASSERT_EQ(answer.missing.size(), 2u);
  EXPECT_TRUE(holds(answer.missing[0], "labels.values") &&
              holds(answer.missing[0], "of label 2 (0.576 ml), label 5"))
      << answer.missing[0];
  const Json labels = read_json(folder_ / "anna/case.json", "wireplan.case/1").at("labels");
  EXPECT_FALSE(labels.contains("names")) << labels;  // an empty list is refused

  write_text("value,name\n2,aorta\n5,liver\n", folder_ / "scan/seg.csv");
  given.folder = folder_ / "berta";
  given.markups = points({{"access", Vec3(1, 6, 2)}, {"target", Vec3(1, 6, 10)}});
  EXPECT_TRUE(write_new_case(given).missing.empty());
  EXPECT_EQ(read_case(folder_ / "berta").labels->choice.names, std::vector<std::string>{"aorta"});

  given.folder = folder_ / "clara";
  given.labels = folder_ / "scan/none.nii";
  EXPECT_TRUE(holds(message_of([&] { write_new_case(given); }), "no such file"));
  const Answer neither = run_program(folder_.path(), "new dora");
  EXPECT_EQ(neither.code, 2);
  EXPECT_TRUE(holds(neither.log, "--volume or --labels")) << neither.log;
}

}  // namespace
}  // namespace wireplan::pipeline
