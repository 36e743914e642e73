#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "preprocess/files/vessel_io.h"
#include "tests/messages.h"
#include "tests/shapes.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

class VesselFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() / (std::string("wireplan_vessel_io_") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
};

std::string bytes_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// Numbers that use all 53 bits.
Eigen::VectorXd full_numbers(Eigen::Index count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Eigen::VectorXd values(count);
  for (double& value : values) value = 1000.0 * (static_cast<double>(random() >> 11) * 0x1p-53);
  return values;
}

Surface full_surface() {
  Surface surface = shapes::sphere({1.1, -2.2, 333.3}, 5.0, 1.0);
  surface.vertices +=
      1e-9 * full_numbers(surface.vertices.size(), 1).reshaped(3, surface.vertices.cols());
  return surface;
}

Centerline full_line() {
  return {.points = full_numbers(60, 2).reshaped(3, 20),
          .radius = full_numbers(20, 3),
          .arc_length = full_numbers(20, 4)};
}

Wall full_wall(const Surface& surface) {
  const Eigen::Index count = surface.triangles.cols();
  return {.apexes = full_numbers(3 * count, 5).reshaped(3, count),
          .height = full_numbers(count, 6),
          .young_modulus = 0.1 / 3.0,
          .poisson_ratio = 0.3};
}

TEST_F(VesselFile, SurfaceComesBackBitForBit) {
  const Surface surface = full_surface();
  write_surface(surface, folder_ / "surface.vtp");
  const Surface read = read_surface_artifact(folder_ / "surface.vtp");
  EXPECT_EQ(read.vertices, surface.vertices);
  EXPECT_EQ(read.triangles, surface.triangles);
}

TEST_F(VesselFile, CenterlineComesBackBitForBit) {
  const Centerline line = full_line();
  write_centerline(line, folder_ / "centerline.vtp");
  const Centerline read = read_centerline(folder_ / "centerline.vtp");
  EXPECT_EQ(read.points, line.points);
  EXPECT_EQ(read.radius, line.radius);
  EXPECT_EQ(read.arc_length, line.arc_length);
}

TEST_F(VesselFile, LinesOfATreeComeBackBitForBitAndInOrder) {
  const Centerline line = full_line();
  const Centerline part{.points = line.points.rightCols(2),
                        .radius = line.radius.tail(2),
                        .arc_length = line.arc_length.head(2)};
  write_centerlines({line, part, line}, folder_ / "tree.vtp");
  const std::vector<Centerline> read = read_centerlines(folder_ / "tree.vtp");
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[1].points, part.points);
  EXPECT_EQ(read[1].radius, part.radius);
  EXPECT_EQ(read[1].arc_length, part.arc_length);
  EXPECT_EQ(read[0].points, line.points);
  EXPECT_EQ(read[2].arc_length, line.arc_length);
}

TEST_F(VesselFile, WallComesBackBitForBit) {
  const Surface surface = full_surface();
  const Wall wall = full_wall(surface);
  write_wall(surface, wall, folder_ / "wall.vtu");
  const Wall read = read_wall(folder_ / "wall.vtu");
  EXPECT_EQ(read.apexes, wall.apexes);
  EXPECT_EQ(read.height, wall.height);
  EXPECT_EQ(read.young_modulus, wall.young_modulus);
  EXPECT_EQ(read.poisson_ratio, wall.poisson_ratio);
}

TEST_F(VesselFile, SameValuesGiveTheSameBytes) {
  const Surface surface = full_surface();
  for (const char* name : {"a", "b"}) {
    write_surface(surface, folder_ / (std::string(name) + ".vtp"));
    write_wall(surface, full_wall(surface), folder_ / (std::string(name) + ".vtu"));
  }
  EXPECT_EQ(bytes_of(folder_ / "a.vtp"), bytes_of(folder_ / "b.vtp"));
  EXPECT_EQ(bytes_of(folder_ / "a.vtu"), bytes_of(folder_ / "b.vtu"));
}

TEST_F(VesselFile, EveryFileSaysThatItIsLps) {
  const Surface surface = full_surface();
  write_surface(surface, folder_ / "surface.vtp");
  write_centerline(full_line(), folder_ / "line.vtp");
  write_wall(surface, full_wall(surface), folder_ / "wall.vtu");
  write_polyline(full_line().points, {}, folder_ / "wire.vtp");
  for (const char* name : {"surface.vtp", "line.vtp", "wall.vtu", "wire.vtp"}) {
    EXPECT_NE(bytes_of(folder_ / name).find("Name=\"SPACE\""), std::string::npos) << name;
  }
}

TEST_F(VesselFile, WireKeepsItsNamedArrays) {
  const Centerline line = full_line();
  const std::vector<double> force(20, 0.25), arc(line.arc_length.begin(), line.arc_length.end());
  write_polyline(line.points, {{"force_n", force}, {"arc_length_mm", arc}, {"radius_mm", force}},
                 folder_ / "wire.vtp");
  EXPECT_NE(bytes_of(folder_ / "wire.vtp").find("Name=\"force_n\""), std::string::npos);
  EXPECT_EQ(read_centerline(folder_ / "wire.vtp").arc_length, line.arc_length);
}

TEST_F(VesselFile, WallKeepsItselfBesideNamedArrays) {
  const Surface surface = full_surface();
  const Wall wall = full_wall(surface);
  std::vector<double> force(static_cast<std::size_t>(surface.triangles.cols()), 0.0);
  force.back() = 0.3;
  write_wall(surface, wall, folder_ / "forces.vtu", {{"peak_force_n", force}});
  EXPECT_NE(bytes_of(folder_ / "forces.vtu").find("Name=\"peak_force_n\""), std::string::npos);
  EXPECT_EQ(read_wall(folder_ / "forces.vtu").apexes, wall.apexes);
  EXPECT_EQ(read_wall(folder_ / "forces.vtu").height, wall.height);
  force.pop_back();
  EXPECT_THROW(write_wall(surface, wall, folder_ / "short.vtu", {{"peak_force_n", force}}),
               LogicError);
}

TEST_F(VesselFile, TimeSeriesNamesFilesBesideIt) {
  write_time_series({folder_ / "wire & 0.vtp", folder_ / "sub" / "wire_1.vtp"}, {0.0, 0.1},
                    folder_ / "wire.pvd");
  const std::string text = bytes_of(folder_ / "wire.pvd");
  EXPECT_NE(text.find("<DataSet timestep=\"0\" file=\"wire &amp; 0.vtp\"/>"), std::string::npos)
      << text;
  EXPECT_NE(text.find("<DataSet timestep=\"0.1\" file=\"sub/wire_1.vtp\"/>"), std::string::npos)
      << text;
}

TEST_F(VesselFile, MissingForeignAndDamagedFilesAreRefusedByName) {
  EXPECT_NE(message_of([&] {
              read_surface_artifact(folder_ / "absent.vtp");
            }).find("absent.vtp: no such file"),
            std::string::npos);
  write_centerline(full_line(), folder_ / "line.vtp");
  EXPECT_NE(message_of([&] { read_surface_artifact(folder_ / "line.vtp"); }).find("line.vtp"),
            std::string::npos);
  write_surface(full_surface(), folder_ / "surface.vtp");
  EXPECT_NE(
      message_of([&] { read_centerline(folder_ / "surface.vtp"); }).find("no array radius_mm"),
      std::string::npos);
}

TEST_F(VesselFile, AFileCutAnywhereIsRefused) {
  const Surface surface = full_surface();
  write_wall(surface, full_wall(surface), folder_ / "wall.vtu");
  write_surface(surface, folder_ / "surface.vtp");
  const std::string wall = bytes_of(folder_ / "wall.vtu"), vtp = bytes_of(folder_ / "surface.vtp");
  for (int part = 0; part < 20; ++part) {
    SCOPED_TRACE(part);
    std::ofstream(folder_ / "cut.vtu", std::ios::binary) << wall.substr(0, wall.size() * part / 20);
    EXPECT_NE(message_of([&] { read_wall(folder_ / "cut.vtu"); }), "no error");
    std::ofstream(folder_ / "cut.vtp", std::ios::binary) << vtp.substr(0, vtp.size() * part / 20);
    EXPECT_NE(message_of([&] { read_surface_artifact(folder_ / "cut.vtp"); }), "no error");
  }
}

TEST_F(VesselFile, AFolderThatIsNotThereIsAnError) {
  const fs::path path = folder_ / "absent" / "surface.vtp";
  EXPECT_NE(message_of([&] { write_surface(full_surface(), path); }).find("cannot be written"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              write_time_series({}, {}, folder_ / "absent" / "x.pvd");
            }).find("cannot be written"),
            std::string::npos);
}

TEST_F(VesselFile, AFullDiskIsAnError) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  EXPECT_NE(
      message_of([&] { write_surface(full_surface(), "/dev/full"); }).find("cannot be written"),
      std::string::npos);
}

TEST(PlaceText, HasNoMinusBeforeZero) {
  EXPECT_EQ(place_text(Vec3(-1e-9, -0.04, -0.06)), "(0.0, 0.0, -0.1)");
  EXPECT_EQ(place_text(Vec3(12.34, -4.56, 0.0)), "(12.3, -4.6, 0.0)");
}

}  // namespace
}  // namespace wireplan::preprocess
