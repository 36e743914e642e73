#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "pipeline/files/case_file.h"
#include "pipeline/files/json_reader.h"
#include "pipeline/files/phantom_file.h"
#include "preprocess/files/vessel_io.h"
#include "preprocess/volume/image.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;
using preprocess::Phantom;
using preprocess::PhantomSpec;

const fs::path kAbdomen = fs::path(WIREPLAN_SOURCE_DIR) / "cases" / "abdomen";

class PhantomFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("wireplan_phantom_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  PhantomSpec read(const std::string& text) const {
    std::ofstream(folder_ / "spec.json") << text;
    return read_phantom_spec(folder_ / "spec.json");
  }
  std::string message_of(const std::string& text) const {
    try {
      read(text);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
};

/// A tube in a box, small enough to be made and written in a moment.
const std::string kTube = R"({
  "schema": "wireplan.phantom/1",
  "grid": {"size": [20, 18, 30], "spacing_mm": [1, 1, 1], "origin_mm": [-10, -9, -15]},
  "body": {"center_mm": [0, 0, 0], "semi_axes_mm": [60, 50, 100]},
  "tubes": [{"name": "artery", "kind": "artery", "hu": 350, "wall_mm": 1,
             "points_mm": [[0, 0, -30], [1, 0, 0], [0, 0, 30]], "radius_mm": [4, 5, 4]}]})";

/// The bundled phantom on a grid of 3 mm around the point, which is quick.
bool lies_in_true_lumen(PhantomSpec spec, const Vec3& point) {
  spec.grid.size = {3, 3, 3};
  spec.grid.spacing = Vec3::Constant(0.5);
  spec.grid.origin = point - Vec3::Constant(0.5);
  spec.blur_mm = spec.noise_hu = 0.0;
  spec.supersampling = 1;
  return make_phantom(spec).lumen.labels[13] == 1;
}

TEST_F(PhantomFile, DefaultsAndUnitsOfASmallOne) {
  const PhantomSpec spec = read(kTube);
  EXPECT_EQ(spec.grid.size, (std::array<int, 3>{20, 18, 30}));
  EXPECT_EQ(spec.grid.origin, Vec3(-10, -9, -15));
  ASSERT_EQ(spec.tubes.size(), 1U);
  EXPECT_EQ(spec.tubes[0].points.col(1), Vec3(1, 0, 0));
  EXPECT_EQ(spec.tubes[0].radius(1), 5.0);
  EXPECT_EQ(spec.noise_hu, PhantomSpec{}.noise_hu);
}

TEST_F(PhantomFile, AllProblemsAreToldAtOnce) {
  const std::string message = message_of(R"({
    "schema": "wireplan.phantom/1",
    "grid": {"size": [20, 18.5, 30], "spacing_mm": [1, 1], "origin_mm": [0, 0, 0]},
    "body": {"center_mm": [0, 0, 0], "semi_axes_mm": [60, 50, 100], "fat_mm": 70},
    "vertebrae": [{"center_mm": [0, 0, 0], "semi_axes_mm": [10, 8, 9], "shell_mm": 2}],
    "tubes": [{"name": "a/b", "kind": "nerve", "hu": 350, "points_mm": [[0, 0, 0], [0, 0, 0]],
               "radius_mm": [4]},
              {"name": "c", "kind": "vein", "hu": 120, "radius": [3],
               "points_mm": [[0, 0, 0], [0, 0, 9]], "radius_mm": [3, 3]},
              {"name": "c", "kind": "vein", "hu": 120,
               "points_mm": [[0, 0, 0], [0, 0, 9]], "radius_mm": [3, -3]}],
    "calcium": [{"tube": "d", "at": 0.5}, {"tube": "c", "at": 1.5, "thickness_mm": 1.5}]})");
  for (const std::string key :
       {"grid.size", "grid.spacing_mm", "body.fat_mm", "vertebrae[0].shell_mm", "tubes[0].name",
        "tubes[0].kind", "tubes[0].points_mm[1]", "tubes[0].radius_mm", "tubes[1].radius ",
        "tubes[2].name", "tubes[2].radius_mm[1]", "calcium[0].tube", "calcium[1].at",
        "calcium[1].thickness_mm"}) {
    EXPECT_NE(message.find("spec.json: " + key), std::string::npos) << key << " in:\n" << message;
  }
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n') + 1, 14) << message;
}

TEST_F(PhantomFile, PlacesThatNoBodyReachesAreToldByTheirKeys) {
  Json file = Json::parse(kTube);
  file["grid"]["origin_mm"][0] = 1e9;
  file["body"]["center_mm"][1] = -1e300;
  file["organs"] = {
      {{"name", "o"}, {"hu", 9}, {"center_mm", {0, 0, 2e4}}, {"semi_axes_mm", {1, 1, 1}}}};
  file["vertebrae"] = {{{"center_mm", {0, -2e4, 0}}, {"semi_axes_mm", {9, 9, 9}}}};
  file["tubes"][0]["points_mm"][1][2] = 1e300;
  const std::string message = message_of(file.dump());
  for (const std::string key : {"grid.origin_mm is", "body.center_mm is", "organs[0].center_mm is",
                                "vertebrae[0].center_mm is", "tubes[0].points_mm[1] is"}) {
    EXPECT_NE(message.find("spec.json: " + key), std::string::npos) << key << " in:\n" << message;
  }
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n') + 1, 5) << message;
}

TEST_F(PhantomFile, HuAlongATubeStentsABreathAndTextureAreRead) {
  Json file = Json::parse(kTube);
  file["tubes"][0]["hu"] = {300, 280, 250};
  file["tubes"].push_back({{"name", "sac"},
                           {"kind", "thrombus"},
                           {"hu", 50},
                           {"points_mm", {{0, 0, -9}, {0, 0, 9}}},
                           {"radius_mm", {8, 8}}});
  file["stents"] = {{{"tube", "artery"}, {"from", 0.2}, {"to", 0.6}, {"crowns", 7}}};
  file["breath"] = {{"above_z_mm", 4.5}, {"shift_mm", {2, -1, 0}}};
  file["noise_texture_mm"] = 0.7;
  const PhantomSpec spec = read(file.dump());
  EXPECT_EQ(spec.tubes[0].hu_along, Eigen::Vector3d(300, 280, 250));
  EXPECT_EQ(spec.tubes[1].kind, preprocess::PhantomTubeKind::kThrombus);
  EXPECT_EQ(spec.tubes[1].hu, 50.0);
  EXPECT_EQ(spec.tubes[1].hu_along.size(), 0);
  ASSERT_EQ(spec.stents.size(), 1U);
  EXPECT_EQ(spec.stents[0].to, 0.6);
  EXPECT_EQ(spec.stents[0].crowns, 7);
  ASSERT_TRUE(spec.breath.has_value());
  EXPECT_EQ(spec.breath->above_z_mm, 4.5);
  EXPECT_EQ(spec.breath->shift_mm, Vec3(2, -1, 0));
  EXPECT_EQ(spec.noise_texture_mm, 0.7);

  file["tubes"][0]["hu"] = {300, 280};
  file["stents"][0]["tube"] = "nowhere";
  file["stents"][0]["to"] = 0.1;
  file["breath"]["shift_mm"] = {2, -1};
  file["noise_texture_mm"] = 9;
  const std::string message = message_of(file.dump());
  for (const std::string key :
       {"tubes[0].hu", "stents[0].tube", "stents[0].to", "breath.shift_mm", "noise_texture_mm"}) {
    EXPECT_NE(message.find("spec.json: " + key), std::string::npos) << key << " in:\n" << message;
  }
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n') + 1, 5) << message;
}

TEST_F(PhantomFile, APatientIsWrittenWithACaseThatReads) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  std::uint64_t seed = 1;
  while (preprocess::draw_patient(seed).spec.grid.voxels() > 1'000'000) ++seed;
  const preprocess::RandomPatient patient = preprocess::draw_patient(seed);
  write_patient(patient, folder_ / "patient");
  const Case made = read_case(folder_ / "patient");
  EXPECT_EQ(made.name, "random-" + std::to_string(seed));
  const preprocess::Mask lumen =
      preprocess::read_mask(folder_ / "patient" / "truth" / "lumen.nrrd");
  for (const Vec3& point : {patient.access.point, patient.target.point}) {
    const Vec3 ijk = lumen.grid.ijk_from_lps(point).array().round();
    EXPECT_EQ(lumen.labels[lumen.grid.index(static_cast<int>(ijk.x()), static_cast<int>(ijk.y()),
                                            static_cast<int>(ijk.z()))],
              1);
  }
}

TEST_F(PhantomFile, WhatIsMissingIsToldOnce) {
  const std::string message = message_of(R"({"schema": "wireplan.phantom/1", "grid": {},
    "body": {"center_mm": [0, 0, 0]}, "tubes": [{"name": "a", "kind": "artery", "hu": 350}]})");
  for (const std::string key : {"grid.size", "grid.spacing_mm", "grid.origin_mm",
                                "body.semi_axes_mm", "tubes[0].points_mm", "tubes[0].radius_mm"}) {
    const std::size_t first = message.find(key + " is missing");
    ASSERT_NE(first, std::string::npos) << key << " in:\n" << message;
    EXPECT_EQ(message.find("spec.json: " + key, first + 1), std::string::npos) << message;
  }
}

TEST_F(PhantomFile, BundledAbdomenReadsAndItsCaseStartsAndEndsInTheLumen) {
  const PhantomSpec spec = read_phantom_spec(kAbdomen / "phantom.json");
  // read_case wants the volume, which only `wireplan phantom` makes: read the points alone.
  const Json file = read_json(kAbdomen / "case.json", "wireplan.case/1");
  std::vector<Vec3> inside;
  for (const Json& point : {file["access"]["point_mm"], file["target"]["point_mm"],
                            file["segmentation"]["seeds_mm"][0]}) {
    inside.emplace_back(point[0].get<double>(), point[1].get<double>(), point[2].get<double>());
  }
  // The targets that the README offers.
  inside.insert(inside.end(), {{5, -2.5, 109}, {-1.5, 9.5, 89.6}, {13, 6.5, 86.3}, {4, 7, 118}});
  for (const Vec3& point : inside) EXPECT_TRUE(lies_in_true_lumen(spec, point)) << point;
  EXPECT_FALSE(lies_in_true_lumen(spec, Vec3(-16, 0, 88)));  // vena cava
}

TEST_F(PhantomFile, BundledAbdomenIsOneTreeOfArteries) {
  PhantomSpec spec = read_phantom_spec(kAbdomen / "phantom.json");
  // The same volume at 1.8 mm.
  spec.grid.size = {128, 114, 160};
  spec.grid.spacing = Vec3::Constant(1.8);
  spec.supersampling = 1;
  spec.blur_mm = spec.noise_hu = 0.0;
  const Phantom phantom = make_phantom(spec);
  // Flood from the aorta, through corners too because the renal arteries are three voxels wide.
  const preprocess::Grid& grid = phantom.lumen.grid;
  const Vec3 seed = grid.ijk_from_lps(Vec3(4, 7, 118)).array().round();
  std::vector<Eigen::Array3i> stack = {seed.cast<int>().array()};
  std::vector<std::uint8_t> left = phantom.lumen.labels;
  while (!stack.empty()) {
    const Eigen::Array3i p = stack.back();
    stack.pop_back();
    for (int n = 0; n < 27; ++n) {
      const Eigen::Array3i q = p + Eigen::Array3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      if ((q < 0).any() || q(0) >= grid.size[0] || q(1) >= grid.size[1] || q(2) >= grid.size[2]) {
        continue;
      }
      std::uint8_t& label = left[grid.index(q(0), q(1), q(2))];
      if (label == 1) stack.push_back(q);
      label = 0;
    }
  }
  EXPECT_EQ(std::count(left.begin(), left.end(), 1), 0);
  EXPECT_GT(std::count(phantom.lumen.labels.begin(), phantom.lumen.labels.end(), 1), 15000);
}

TEST_F(PhantomFile, WritesVolumeAndTruthAndLeavesNothingElse) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  const Phantom phantom = make_phantom(read(kTube));
  const fs::path out = folder_ / "out";
  write_phantom(phantom, out);
  write_phantom(phantom, out);  // over an older one
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(out)) {
    files.push_back(entry.path().lexically_relative(out).generic_string());
  }
  std::sort(files.begin(), files.end());
  EXPECT_EQ(files, (std::vector<std::string>{"ct.nrrd", "truth", "truth/artery.vtp",
                                             "truth/centerlines.json", "truth/lumen.nrrd"}));

  const preprocess::Image image = preprocess::read_image(out / "ct.nrrd");
  EXPECT_EQ(image.grid.size, phantom.image.grid.size);
  ASSERT_EQ(image.values.size(), phantom.image.values.size());
  for (std::size_t i = 0; i < image.values.size(); ++i) {
    ASSERT_NEAR(image.values[i], phantom.image.values[i], 0.5 + 1e-4);  // rounded to whole HU
  }
  EXPECT_EQ(preprocess::read_mask(out / "truth/lumen.nrrd").labels, phantom.lumen.labels);
  const Centerline line = preprocess::read_centerline(out / "truth/artery.vtp");
  EXPECT_EQ(line.points, phantom.centerlines[0].points);
  const Json truth = read_json(out / "truth/centerlines.json", "wireplan.phantom-truth/1");
  ASSERT_EQ(truth["arteries"].size(), 1U);
  EXPECT_EQ(truth["arteries"][0]["name"], "artery");
  EXPECT_EQ(truth["arteries"][0]["points_mm"].size(), line.points.cols());
  EXPECT_EQ(truth["arteries"][0]["radius_mm"][0], line.radius(0));
}

TEST_F(PhantomFile, AFolderThatCannotBeMadeIsAnError) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  std::ofstream(folder_ / "file") << "in the way";
  const Phantom phantom = make_phantom(read(kTube));
  try {
    write_phantom(phantom, folder_ / "file");
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("cannot be written"), std::string::npos);
  }
}

}  // namespace
}  // namespace wireplan::pipeline
