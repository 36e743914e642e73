// `wireplan render`: pictures of a report without a display.
#include <gtest/gtest.h>

#include <cstdlib>

#include "pipeline/files/case_file.h"
#include "pipeline/files/disk.h"
#include "pipeline/report/picture.h"
#include "pipeline/report/print.h"
#include "pipeline/report/render.h"
#include "pipeline/report/report.h"
#include "pipeline/stages/stages.h"
#include "tests/pipeline/finished_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

fs::path run_tube(const fs::path& folder) {
  write_finished_tube(folder);
  RunOptions options;
  options.cache = folder / "cache";
  publish(run_stages(read_case(folder / "case.json"), options).artifacts, folder / "out");
  return folder / "out" / "report.json";
}

// Pixels of about this color.
int count_like(const Picture& picture, const Color& color) {
  int count = 0;
  for (std::size_t k = 0; k + 2 < picture.rgb.size(); k += 3) {
    const Color here(picture.rgb[k], picture.rgb[k + 1], picture.rgb[k + 2]);
    if ((here - 255.0F * color).cwiseAbs().maxCoeff() < 2.0F) ++count;
  }
  return count;
}

TEST(Render, DrawsFourPicturesOfAReportWithoutADisplay) {
  const TemporaryFolder folder;
  const fs::path report = run_tube(folder.path());
  const std::string command = "env -u DISPLAY -u WAYLAND_DISPLAY '" WIREPLAN_PROGRAM "' render '" +
                              report.string() + "' -o '" + (folder / "pictures").string() +
                              "' > '" + (folder / "said").string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  for (const char* name : {"vessel.png", "forces.png", "angles.png", "numerics.png"}) {
    const std::string bytes = read_text(folder / "pictures" / name);
    EXPECT_EQ(bytes.substr(1, 3), "PNG") << name;
    EXPECT_GT(bytes.size(), 5000u) << name << " is not blank";
    EXPECT_NE(read_text(folder / "said").find(name), std::string::npos);
  }
}

TEST(Render, SaysWhichFileOfTheRunIsMissing) {
  const TemporaryFolder folder;
  const fs::path report = run_tube(folder.path());
  fs::remove(folder / "out" / "surface.vtp");
  try {
    render_report(report, folder / "pictures");
    FAIL() << "expected an error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("surface.vtp"), std::string::npos) << error.what();
  }
}

TEST(Render, SaysWhatIsMissingForASheetOnPaper) {
  const TemporaryFolder folder;
  const fs::path out = folder / "out";
  fs::create_directories(out);
  const auto said = [&]() -> std::string {
    try {
      print_sheet(out / "report.json", folder / "printed");
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing";
  };
  EXPECT_NE(said().find("report.html: is not there, expected the page"), std::string::npos);
  write_whole("<html>", out / "report.html");
  EXPECT_NE(said().find("an earlier wireplan made it; run the case again"), std::string::npos);

  write_whole("<html id=sheet-title>", out / "report.html");
  ::setenv("WIREPLAN_CHROMIUM", (folder / "none").c_str(), 1);
  EXPECT_NE(said().find("is no program, expected the path of Chromium"), std::string::npos);
  ::setenv("WIREPLAN_CHROMIUM", "/bin/false", 1);
  EXPECT_NE(said().find("/bin/false: printed no PDF of"), std::string::npos);
  ::unsetenv("WIREPLAN_CHROMIUM");
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder.path().c_str(), 1);
  EXPECT_NE(said().find("no Chromium or Chrome on the PATH"), std::string::npos);
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_FALSE(fs::exists(folder / "printed"));
}

TEST(Render, ColorsEachTrialOfTheGridByItsForce) {
  Json report = {{"name", "grid"}, {"trials", Json::array()}};
  const auto add = [&](double azimuth, double roll, const char* outcome, double force) {
    report["trials"].push_back({{"wire", "soft"},
                                {"inclination_deg", 10},
                                {"azimuth_deg", azimuth},
                                {"roll_deg", roll},
                                {"outcome", outcome},
                                {"reached", std::string(outcome) == "reached"},
                                {"peak_contact_force_n", force}});
  };
  add(0, 0, "reached", 1.0);
  add(0, 90, "reached", 0.5);
  add(90, 0, "stuck", 7.0);
  const Picture picture = draw_angles(report);
  // Cells of 70 x 32 pixels, less what their text covers; the bar has every color too.
  constexpr int kCell = 70 * 32, kText = 400, kBar = 140 * 14 / 20;
  for (const double part : {1.0, 0.5}) {
    const int count = count_like(picture, force_color(part));
    EXPECT_GT(count, kCell - kText);
    EXPECT_LT(count, kCell + kBar);
  }
  EXPECT_LT(count_like(picture, force_color(0.0)), kBar) << "a force of what did not reach is none";
}

TEST(Render, PaintsTheWallWhereItWasPushed) {
  const Surface tube = shapes::straight_tube(4.0, 36.0, 1.5);
  PictureMarks marks;
  const Picture plain = draw_picture(tube, {}, marks, {400, 500});
  marks.wall_force.assign(static_cast<std::size_t>(tube.triangles.cols()), 0.0);
  EXPECT_EQ(draw_picture(tube, {}, marks, {400, 500}).rgb, plain.rgb) << "no force, no paint";
  marks.wall_force[10] = 0.25;
  EXPECT_NE(draw_picture(tube, {}, marks, {400, 500}).rgb, plain.rgb);
}

}  // namespace
}  // namespace wireplan::pipeline
