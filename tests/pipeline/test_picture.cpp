#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "pipeline/report/picture.h"

namespace wireplan::pipeline {
namespace {

const Color kPure(0.0F, 0.0F, 1.0F);     // a wire in pure blue
constexpr PictureSize kSmall{400, 600};  // enough pixels to find a wire, fast under sanitizers
constexpr double kHeight = 200.0, kRadius = 10.0;  // mm

/// An upright tube round the z axis, open at its ends.
Surface upright_tube() {
  constexpr int kSides = 32;
  Surface tube;
  tube.vertices.resize(3, 2 * kSides);
  tube.triangles.resize(3, 2 * kSides);
  for (int k = 0; k < kSides; ++k) {
    const double angle = 2.0 * kPi * k / kSides;
    const Vec3 around(kRadius * std::cos(angle), kRadius * std::sin(angle), 0.0);
    tube.vertices.col(2 * k) = around;
    tube.vertices.col(2 * k + 1) = around + kHeight * Vec3::UnitZ();
    const int next = (k + 1) % kSides;
    tube.triangles.col(2 * k) << 2 * k, 2 * next, 2 * k + 1;
    tube.triangles.col(2 * k + 1) << 2 * next, 2 * next + 1, 2 * k + 1;
  }
  return tube;
}

/// A straight upright wire through (x, y).
PictureWire upright_wire(double x, double y) {
  PictureWire wire{.name = "wire", .nodes = {}, .contact_force = {}, .radius = 1.0, .color = kPure};
  wire.nodes.resize(3, 2);
  wire.nodes.col(0) << x, y, 20.0;
  wire.nodes.col(1) << x, y, kHeight - 20.0;
  return wire;
}

PictureMarks marks_on_axis() {
  return {.title = "tube", .access = Vec3(0, 0, 0), .target = Vec3(0, 0, kHeight)};
}

/// Pixels of half 0 (left view) or 1 above the legend whose color `matches` accepts.
struct Found {
  int count = 0;
  double mean_column = 0.0;  // from the middle of the half, to its right
};
template <class Matches>
Found find(const Picture& picture, int half, Matches matches) {
  Found found;
  const int width = picture.width / 2;
  for (int row = picture.height / 4; row < picture.height; ++row) {
    for (int column = 0; column < width; ++column) {
      const std::size_t pixel =
          static_cast<std::size_t>(row) * picture.width + half * width + column;
      if (!matches(picture.rgb[3 * pixel], picture.rgb[3 * pixel + 1], picture.rgb[3 * pixel + 2]))
        continue;
      ++found.count;
      found.mean_column += column + 0.5 - 0.5 * width;
    }
  }
  if (found.count > 0) found.mean_column /= found.count;
  return found;
}
/// The wire behind one layer of vessel seen face on; the access ball is too green to count.
bool is_blue(int red, int green, int blue) { return blue > red + 60 && blue > 2 * green + 60; }
bool is_red(int red, int green, int blue) { return red > green + 120 && red > blue + 120; }

TEST(Picture, WireInsideTheTubeIsSeenInBothViews) {
  const Picture picture =
      draw_picture(upright_tube(), {upright_wire(0, 0)}, marks_on_axis(), kSmall);
  for (const int half : {0, 1}) {
    SCOPED_TRACE(half);
    const Found wire = find(picture, half, is_blue);
    // 160 of 208 mm (tube and the target's ring) over about 400 pixels, at least 2 pixels wide.
    EXPECT_GT(wire.count, 400);
    EXPECT_NEAR(wire.mean_column, 0.0, 1.0);  // on the axis, to a pixel
  }
}

TEST(Picture, PatientsLeftIsOnTheRightOfTheFrontViewAndFrontOnTheLeftOfTheSideView) {
  // x points to the patient's left, y to the back: this wire lies left and in front of the axis.
  const Picture picture =
      draw_picture(upright_tube(), {upright_wire(4.0, -6.0)}, marks_on_axis(), kSmall);
  const double front = find(picture, 0, is_blue).mean_column;
  const double side = find(picture, 1, is_blue).mean_column;
  EXPECT_GT(front, 2.0);
  EXPECT_NEAR(side / front, -6.0 / 4.0, 0.2);  // one scale for both; a pixel of 10 is 0.15
}

TEST(Picture, TurnedFrameIsDrawnUprightTowardTheTarget) {
  // The tube along x with the target at the lower end: up is -x, so that the wire, which lies in
  // the half near the target, stands above the middle.
  Surface tube = upright_tube();
  const Mat3 turn = (Mat3() << 0, 0, -1, 0, 1, 0, 1, 0, 0).finished();
  tube.vertices = turn * tube.vertices;
  PictureWire wire = upright_wire(0, 0);
  wire.nodes.col(0).z() = 0.6 * kHeight;
  wire.nodes = turn * wire.nodes;
  PictureMarks marks = marks_on_axis();
  marks.target = Vec3(turn * *marks.target);
  const Picture picture = draw_picture(tube, {wire}, marks, kSmall);
  int above = 0, below = 0;
  for (int row = picture.height / 4; row < picture.height; ++row) {
    for (int column = 0; column < picture.width / 2; ++column) {
      const std::size_t i = 3 * (static_cast<std::size_t>(row) * picture.width + column);
      if (!is_blue(picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2])) continue;
      // The panel reaches from the legend (4 lines of 10 pixels) to 3 lines below the top.
      ++(row > (40 + picture.height - 30) / 2 ? above : below);
    }
  }
  EXPECT_GT(above, 200);  // 60 mm of 2 pixels each, 4 pixels wide
  EXPECT_EQ(below, 0);
}

TEST(Picture, VesselInFrontOfTheWirePalesItAndVesselBehindDoesNot) {
  const auto darkest_red = [](double y) {
    const Picture picture =
        draw_picture(upright_tube(), {upright_wire(0, y)}, marks_on_axis(), kSmall);
    const std::size_t middle =
        static_cast<std::size_t>(picture.height) / 2 * picture.width + picture.width / 4;
    return static_cast<int>(picture.rgb[3 * middle]);
  };
  EXPECT_EQ(darkest_red(-2 * kRadius), 0);  // in front of the tube: pure blue has no red
  const int inside = darkest_red(0.0), behind = darkest_red(2 * kRadius);
  EXPECT_GT(inside, 5);       // one layer
  EXPECT_GT(behind, inside);  // two layers
}

TEST(Picture, ContactsAreRedBeads) {
  PictureWire wire = upright_wire(0, 0);
  EXPECT_EQ(find(draw_picture({}, {wire}, marks_on_axis(), kSmall), 0, is_red).count, 0);
  wire.contact_force = Eigen::Vector2d(0.0, 0.2);
  const Found beads = find(draw_picture({}, {wire}, marks_on_axis(), kSmall), 0, is_red);
  EXPECT_GT(beads.count, 50);  // a ball of 6 pixels' radius has 113
  EXPECT_LT(beads.count, 130);
}

TEST(Picture, SmoothShadingLeavesNoSeamsBetweenTriangles) {
  // Along the tube's axis the picture must not change: one row of a panel equals the next.
  const Picture picture = draw_picture(upright_tube(), {}, marks_on_axis(), kSmall);
  int compared = 0;
  for (int row = 250; row < 350; ++row) {
    for (int column = 20; column < picture.width / 2 - 20; ++column) {
      const std::size_t i = 3 * (static_cast<std::size_t>(row) * picture.width + column);
      const std::size_t above = i + 3UL * picture.width;
      ASSERT_NEAR(picture.rgb[i], picture.rgb[above], 2) << row << ", " << column;
      if (picture.rgb[i] < 255) ++compared;
    }
  }
  EXPECT_GT(compared, 1000);
}

TEST(Picture, NamesNoSidesOfThePatientWhereTheAxesAreNotTheirs) {
  // The names are all that differs, and they stand in the margins: above, below and at the sides.
  PictureMarks marks = marks_on_axis();
  const Picture known = draw_picture(upright_tube(), {}, marks, kSmall);
  marks.patient_axes = false;
  const Picture unknown = draw_picture(upright_tube(), {}, marks, kSmall);
  int differ = 0, inside = 0;
  for (std::size_t k = 0; k < known.rgb.size(); ++k) {
    if (known.rgb[k] == unknown.rgb[k]) continue;
    ++differ;
    const int column = static_cast<int>(k / 3) % (known.width / 2),
              row = static_cast<int>(k / 3) / known.width;
    inside += std::abs(column - known.width / 4) > 20 && column > 30 &&
              column < known.width / 2 - 30 && row < 500;
  }
  EXPECT_GT(differ, 300);
  EXPECT_EQ(inside, 0);
}

TEST(Picture, FileIsAPngAndTheSameBytesEachTime) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "wireplan_test_picture";
  std::filesystem::create_directories(folder);
  std::string bytes[2];
  for (int k = 0; k < 2; ++k) {
    const std::filesystem::path file = folder / (std::to_string(k) + ".png");
    write_picture(upright_tube(), {upright_wire(0, 0)}, marks_on_axis(), file);
    std::ifstream in(file, std::ios::binary);
    bytes[k].assign(std::istreambuf_iterator<char>(in), {});
  }
  std::filesystem::remove_all(folder);
  ASSERT_GT(bytes[0].size(), 1000U);
  EXPECT_EQ(bytes[0].substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_TRUE(bytes[0] == bytes[1]);
}

TEST(Picture, FileThatCannotBeWrittenIsNamed) {
  try {
    write_picture({}, {upright_wire(0, 0)}, marks_on_axis(), "/no/such/folder/plan.png");
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("/no/such/folder/plan.png"), std::string::npos);
  }
}

TEST(Picture, DrawsAWireAloneWithoutVesselAndMarks) {
  PictureWire wire = upright_wire(0, 0);
  wire.color = Color(0.3F, 0.3F, 0.3F);
  const Picture bare = draw_picture(Surface(), {wire}, {.title = "bench"}, kSmall);
  const Picture marked =
      draw_picture(Surface(), {wire}, {.title = "bench", .access = Vec3(0, 0, 0)}, kSmall);
  const auto blue = [](const Picture& picture) {
    int count = 0;
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
      count += picture.rgb[i + 2] > picture.rgb[i] + 80;  // of the ball at the access
    }
    return count;
  };
  EXPECT_EQ(blue(bare), 0);
  EXPECT_GT(blue(marked), 20);
}

}  // namespace
}  // namespace wireplan::pipeline
