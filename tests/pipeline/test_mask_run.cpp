// What is no vessel ends with a reason, before a surface is made of it.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "preprocess/files/vessel_io.h"
#include "preprocess/volume/image.h"
#include "tests/messages.h"
#include "tests/pipeline/program.h"
#include "tests/pipeline/small_case.h"
#include "tests/preprocess/label_bytes.h"

namespace wireplan::pipeline {
namespace {

using preprocess::Grid;

class MaskRun : public testing::Test {
 protected:
  void SetUp() override {
    if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
    case_ = write_tube_case(folder_.path());
    case_["surface"] = {{"edge_length_mm", 1.5}};
  }

  /// Runs the case between two points on a cube of 1 mm voxels with these values, with `more` as
  /// arguments.
  Answer run_volume(int side, const std::function<int(const Vec3&)>& hu, const Vec3& access,
                    const Vec3& target, const std::string& more = "--to surface") {
    preprocess::Image image{.grid = {.size = {side, side, side}}, .values = {}};
    for (int k = 0; k < side; ++k) {
      for (int j = 0; j < side; ++j) {
        for (int i = 0; i < side; ++i) {
          image.values.push_back(static_cast<float>(hu(Vec3(i, j, k))));
        }
      }
    }
    preprocess::write_image(image, folder_ / "ct.nrrd");
    case_["volume"] = {{"path", "ct.nrrd"}};
    if (!case_.contains("segmentation")) {
      case_["segmentation"] = {{"lower_hu", 150}, {"upper_hu", 600}};
    }
    return run_between(access, target, more);
  }

  Answer run_labels(int side, const std::function<bool(int, int, int)>& inside, const Vec3& access,
                    const Vec3& target, const std::string& more = "--to surface") {
    std::vector<std::uint8_t> values;
    for (int k = 0; k < side; ++k) {
      for (int j = 0; j < side; ++j) {
        for (int i = 0; i < side; ++i) values.push_back(inside(i, j, k) ? 1 : 0);
      }
    }
    write_text(preprocess::label_nifti({.size = {side, side, side}}, values),
               folder_ / "labels.nii");
    case_["labels"] = {{"path", "labels.nii"}, {"values", {1}}, {"names", {"vessel"}}};
    return run_between(access, target, more);
  }

  Answer run_between(const Vec3& access, const Vec3& target, const std::string& more) {
    case_["access"]["point_mm"] = {access.x(), access.y(), access.z()};
    case_["target"]["point_mm"] = {target.x(), target.y(), target.z()};
    write_json(case_, folder_ / "case.json");
    return run_program(folder_.path(), "run case.json -o out " + more);
  }

  TemporaryFolder folder_;
  Json case_;
};

/// What the stage segment tells, as it lies in the cache.
std::string figures_of_segment(const std::filesystem::path& folder) {
  std::string text;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "cache")) {
    const bool of_segment = holds(entry.path().string(), "segment");
    if (of_segment && entry.path().filename() == "figures.json") text += read_text(entry.path());
  }
  return text;
}

/// Exit 2 with all of this, and no surface.
void expect_refused(const Answer& answer, const std::vector<std::string>& parts) {
  EXPECT_EQ(answer.code, 2) << answer.log;
  for (const std::string& part : parts) {
    EXPECT_TRUE(holds(answer.log, part)) << "\"" << part << "\" is not in: " << answer.log;
  }
  EXPECT_FALSE(holds(answer.log, "surface     made")) << answer.log;
}

TEST_F(MaskRun, NoiseIsRefusedAndMayBeAllowed) {
  std::mt19937_64 random(3);
  const Vec3 access(20, 20, 12), target(20, 20, 28);
  const auto noise = [&](const Vec3& p) {
    const bool tube = std::hypot(p.x() - 20.0, p.y() - 20.0) < 3.0 && p.z() > 8.0 && p.z() < 32.0;
    return tube || random() % 2 == 0 ? 300 : 40;
  };
  expect_refused(run_volume(40, noise, access, target),
                 {"stage segment: the mask has ", " handles (loops or holes) in ",
                  ": noise, expected a vessel", "raise mask.most_handles"});
  const Answer allowed = run_between(access, target, "--to segment --set mask.most_handles=100000");
  EXPECT_EQ(allowed.code, 0) << allowed.log;
}

TEST_F(MaskRun, ALatticeOfLabelsIsRefused) {
  const auto lattice = [](int i, int j, int k) {
    return (i % 12 < 4 ? 1 : 0) + (j % 12 < 4 ? 1 : 0) + (k % 12 < 4 ? 1 : 0) >= 2;
  };
  // 4^3 crossings and 3 * 16 * 3 ways: 144 - 64 + 1 handles.
  const Answer answer = run_labels(40, lattice, Vec3(1, 1, 2), Vec3(37, 37, 37));
  expect_refused(answer, {"stage segment: the mask has 81 handles (loops or holes) in ",
                          ": noise or veins", "choose the classes that are arteries"});
  EXPECT_EQ(run_program(folder_.path(), "check case.json").code, 2);
  EXPECT_EQ(
      run_between(Vec3(1, 1, 2), Vec3(37, 37, 37), "--to surface --set mask.most_handles=81").code,
      0);
}

TEST_F(MaskRun, LabelsInManyPiecesAreRefusedAsNoise) {
  // Bars of 3 x 2 x 2 voxels, 6 apart: 7^3 of them.
  const auto bars = [](int i, int j, int k) { return i % 6 < 3 && j % 6 < 2 && k % 6 < 2; };
  expect_refused(run_labels(40, bars, Vec3(1, 1, 1), Vec3(37, 37, 37)),
                 {"stage segment: the chosen classes lie in 343 pieces that are not connected: "
                  "noise, expected a vessel of at most 200 pieces",
                  "raise mask.most_handles"});
}

TEST_F(MaskRun, ABodyBesideTheAccessIsToldToLieApart) {
  const auto body = [](const Vec3& p) { return (p - Vec3(30, 30, 30)).norm() < 22.0; };
  expect_refused(run_labels(
                     60, [&](int i, int j, int k) { return body(Vec3(i, j, k)); }, Vec3(4, 4, 4),
                     Vec3(30, 30, 30)),
                 {"access.point_mm is [4.0,4.0,4.0], 23.", "mm outside the labels"});
  case_.erase("labels");
  // In a volume the access is a seed, and its value told.
  expect_refused(
      run_volume(
          60, [&](const Vec3& p) { return body(p) ? 300 : 40; }, Vec3(4, 4, 4), Vec3(30, 30, 30)),
      {"seed (4.0, 4.0, 4.0) mm lies outside the band"});
}

TEST_F(MaskRun, ABodyOfTooManyFacesIsRefused) {
  const auto body = [](const Vec3& p) { return (p - Vec3(30, 30, 30)).norm() < 22.0 ? 300 : 40; };
  expect_refused(run_volume(60, body, Vec3(30, 30, 20), Vec3(30, 30, 40),
                            "--to surface --set mask.most_faces=5000"),
                 {": an organ, bone or the whole body", "of at most 5 thousand outer faces",
                  "raise mask.most_faces"});
}

/// Tubes of radius 4 along z at these x, all y = 20.
std::function<int(const Vec3&)> tubes_at(const std::vector<double>& at) {
  return [at](const Vec3& p) {
    for (const double x : at) {
      if (std::hypot(p.x() - x, p.y() - 20.0) < 4.0) return 300;
    }
    return 40;
  };
}

TEST_F(MaskRun, TargetsInAnotherPieceAreNamed) {
  case_["targets"] = Json::array();
  for (const double x : {10.0, 30.0}) {
    Json target = case_["target"];
    target["point_mm"] = {x, 20, 30};
    target["name"] = x < 20.0 ? "near" : "far";
    case_["targets"].push_back(target);
  }
  case_.erase("target");
  case_["volume"] = {{"path", "ct.nrrd"}};
  case_["access"]["point_mm"] = {10, 20, 6};
  case_["segmentation"] = {{"lower_hu", 150}, {"upper_hu", 600}};
  preprocess::Image image{.grid = {.size = {40, 40, 36}}, .values = {}};
  for (std::size_t n = 0; n < image.grid.voxels(); ++n) {
    const auto i = static_cast<double>(n % 40), j = static_cast<double>(n / 40 % 40);
    image.values.push_back(static_cast<float>(tubes_at({10.0, 30.0})(Vec3(i, j, 0))));
  }
  preprocess::write_image(image, folder_ / "ct.nrrd");
  write_json(case_, folder_ / "case.json");
  expect_refused(run_program(folder_.path(), "run case.json --to surface -o out"),
                 {"targets[1].point_mm is [30.0,20.0,30.0], in another piece of the vessel than "
                  "access.point_mm, which comes no nearer than (13.0, 20.0, 30.0) mm"});
}

TEST_F(MaskRun, ATargetInADroppedPieceOfASurfaceIsNamed) {
  Surface beside = shapes::straight_tube(2.0, 20.0, 1.5);
  for (auto p : beside.vertices.colwise()) p += Vec3(10, 0, 8);
  write_stl(shapes::joined(shapes::straight_tube(4.0, 36.0, 1.5), beside), folder_ / "tube.stl");
  case_["surface"] = {{"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}};
  case_["target"]["point_mm"] = {10, 0, 18};
  write_json(case_, folder_ / "case.json");
  for (const char* command : {"run case.json --to centerline -o out", "check case.json"}) {
    const Answer answer = run_program(folder_.path(), command);
    EXPECT_EQ(answer.code, 2) << answer.log;
    EXPECT_TRUE(holds(answer.log, "target.point_mm") &&
                holds(answer.log,
                      "lies in a piece of the surface, 20 mm long, that is not joined "
                      "with the vessel and was dropped: it comes within 4"))
        << answer.log;
  }
}

TEST_F(MaskRun, ASeedInALargerPieceDoesNotTakeTheVesselAway) {
  // The other tube is twice as wide, and only a seed lies in it.
  const auto tubes = [](const Vec3& p) {
    return std::hypot(p.x() - 8.0, p.y() - 20.0) < 4.0    ? 300
           : std::hypot(p.x() - 28.0, p.y() - 20.0) < 8.0 ? 300
                                                          : 40;
  };
  case_["segmentation"] = {
      {"lower_hu", 150}, {"upper_hu", 600}, {"seeds_mm", Json::array({{28, 20, 18}})}};
  const Answer answer = run_volume(40, tubes, Vec3(8, 20, 6), Vec3(8, 20, 30));
  ASSERT_EQ(answer.code, 0) << answer.log;
  const Surface surface = preprocess::read_surface_artifact(folder_ / "out/surface.vtp");
  EXPECT_LT(surface.vertices.row(0).maxCoeff(), 14.0);
  EXPECT_TRUE(holds(figures_of_segment(folder_.path()),
                    " is not connected with that of access and target"));
}

TEST_F(MaskRun, WhatNoReportWillTellIsToldAsTheStagesEnd) {
  const Answer first = run_volume(
      40, [](const Vec3& p) { return std::hypot(p.x() - 20.0, p.y() - 20.0) < 4.0 ? 300 : 40; },
      Vec3(20, 20, 6), Vec3(20, 20, 30), "--to segment");
  ASSERT_EQ(first.code, 0) << first.log;
  const Answer cached = run_between(Vec3(20, 20, 6), Vec3(20, 20, 30), "--to centerline");
  for (const std::string& log : {first.log, cached.log}) {
    EXPECT_TRUE(holds(log, "mind: segment: the vessel touches the border of the volume")) << log;
  }
}

TEST_F(MaskRun, CalciumIsToldOfHounsfieldUnitsAlone) {
  for (const bool ct : {true, false}) {
    const auto hu = [&](const Vec3& p) {
      const double away = std::hypot(p.x() - 20.0, p.y() - 20.0);
      if (ct && p.y() < 4.0) return -1000;  // air
      if (away < 5.0) return 500;
      return away < 7.0 && p.x() > 20.0 && p.z() > 15.0 && p.z() < 25.0 ? 1000 : 60;
    };
    const Answer answer = run_volume(40, hu, {20, 20, 8}, {20, 20, 32}, "--to anatomy");
    ASSERT_EQ(answer.code, 0) << answer.log;
    EXPECT_EQ(
        holds(answer.out, "calcium in and beside the lumen: not known, the volume does not say "),
        !ct)
        << answer.out;
  }
}

TEST_F(MaskRun, ValuesOfNoModalityThatAreTakenAsNoHounsfieldUnitsAreTold) {
  for (const bool ct : {false, true}) {
    const auto values = [&](const Vec3& p) {
      const double away = std::hypot(p.x() - 10.0, p.y() - 20.0);
      if (away < 6.0) return 900;
      if (away >= 20.0) return ct ? -1000 : 0;
      return 60 + static_cast<int>(7.0 * p.x() + 13.0 * p.y() + 3.0 * p.z()) % 301;
    };
    const Answer answer = run_volume(40, values, Vec3(10, 20, 6), Vec3(10, 20, 34), "--to volume");
    const std::string told =
        "volume: its file names no modality, and values from 0 to 900 are not those of a CT, "
        "which has air below zero: taken as no Hounsfield units: bone is not told by its "
        "brightness, and calcium is not measured";
    EXPECT_EQ(holds(answer.log, told), !ct) << answer.log;
    EXPECT_EQ(holds(run_program(folder_.path(), "check case.json").out, told), !ct);
    EXPECT_TRUE(holds(run_program(folder_.path(), "inspect ct.nrrd").out,
                      ct ? "a case takes as HU" : "a case takes as no Hounsfield units"));
  }
}

TEST_F(MaskRun, CalciumIsToldWithWhatCountsAsLumen) {
  const auto is_plaque = [](const Vec3& p) {
    const double away = std::hypot(p.x() - 20.0, p.y() - 20.0);
    return away >= 5.0 && away < 7.0 && p.x() > 20.0 && p.z() > 15.0 && p.z() < 25.0;
  };
  const auto hu = [&](const Vec3& p) {
    if (p.y() < 4.0) return -1000;
    if (is_plaque(p)) return 1000;
    return std::hypot(p.x() - 20.0, p.y() - 20.0) < 5.0 ? 500 : 60;
  };
  int voxels = 0;  // of 1 mm3
  for (int n = 0; n < 64000; ++n) voxels += is_plaque(Vec3(n % 40, n / 40 % 40, n / 1600)) ? 1 : 0;
  ASSERT_GT(voxels, 100);
  for (const int upper : {600, 1500}) {  // beside the lumen, and taken for it
    case_["segmentation"] = {{"lower_hu", 150}, {"upper_hu", upper}};
    const Answer answer = run_volume(40, hu, {20, 20, 8}, {20, 20, 32}, "--to anatomy");
    ASSERT_EQ(answer.code, 0) << answer.log;
    EXPECT_TRUE(
        holds(answer.out, "calcium in and beside the lumen: " + std::to_string(voxels) + " mm3"))
        << answer.out;
    EXPECT_EQ(holds(answer.log, "of what counts as lumen along the way"), upper == 1500)
        << answer.log;
  }
}

TEST_F(MaskRun, HowToPartLimbsIsToldByWhatTheCaseGives) {
  // Two limbs of radius 4 that overlap at z = 20 and join at z = 42.
  const auto limbs = [](const Vec3& p) {
    const double x = std::abs(p.x() - 30.0), y = p.y() - 30.0;
    const double bow = 9.0 - 5.6 * std::exp(-std::pow((p.z() - 20.0) / 6.0, 2.0));
    const double off =
        p.z() > 42.0 ? std::hypot(std::hypot(x, p.z() - 42.0) - 9.0, y) : std::hypot(x - bow, y);
    return p.z() > 2.0 && off < 4.0 ? 300 : 40;
  };
  for (const bool band : {false, true}) {
    case_["segmentation"] = Json::object();
    if (band) case_["segmentation"] = {{"lower_hu", 150}, {"upper_hu", 600}};
    const Answer answer = run_volume(60, limbs, {21, 30, 6}, {39, 30, 6}, "--to segment");
    ASSERT_EQ(answer.code, 0) << answer.log;
    EXPECT_TRUE(holds(answer.log, "the way leads through the touch")) << answer.log;
    EXPECT_EQ(holds(answer.log, "raise segmentation.lower_hu and neck_opening_mm"), band);
    EXPECT_EQ(holds(answer.log, "give segmentation.lower_hu, upper_hu and neck_opening_mm"), !band);
  }
}

TEST_F(MaskRun, WhereTheWayMayLeaveItsVesselIsToldWithThePlace) {
  case_["segmentation"] = Json::object();
  const auto neck = [](const Vec3& p) {
    const double radius = std::min(6.0, 2.0 + 0.5 * std::abs(p.z() - 20.0));
    return std::hypot(p.x() - 20.0, p.y() - 20.0) < radius ? 300 : 40;
  };
  const Answer answer = run_volume(40, neck, Vec3(20, 20, 6), Vec3(20, 20, 34), "--to segment");
  ASSERT_EQ(answer.code, 0) << answer.log;
  EXPECT_TRUE(holds(answer.log, "mind: segment: the way narrows to ")) << answer.log;
  EXPECT_TRUE(holds(answer.log, "mm or more: a stenosis, or another vessel")) << answer.log;
  EXPECT_TRUE(holds(figures_of_segment(folder_.path()), "neck_radius_mm"));
  EXPECT_FALSE(holds(answer.log, " mm apart: vessels that pass")) << answer.log;
}

TEST_F(MaskRun, ThickSlicesAreToldToJoinWhatPassesWithinThem) {
  preprocess::Image image{.grid = {.size = {40, 40, 16}, .spacing = Vec3(1, 1, 3)}, .values = {}};
  for (std::size_t n = 0; n < image.grid.voxels(); ++n) {
    const auto i = static_cast<double>(n % 40), j = static_cast<double>(n / 40 % 40);
    image.values.push_back(std::hypot(i - 20.0, j - 20.0) < 5.0 ? 300.0F : 40.0F);
  }
  preprocess::write_image(image, folder_ / "ct.nrrd");
  case_["volume"] = {{"path", "ct.nrrd"}};
  case_["segmentation"] = Json::object();
  const Answer answer = run_between(Vec3(20, 20, 6), Vec3(20, 20, 36), "--to segment");
  ASSERT_EQ(answer.code, 0) << answer.log;
  EXPECT_TRUE(holds(answer.log,
                    "the volume's slices are 3.0 mm apart: vessels that pass each "
                    "other within one are not told apart"))
      << answer.log;
}

}  // namespace
}  // namespace wireplan::pipeline
