// report.html: what stands in it, in which bytes. How a browser shows it is tested in tests/page.
#include <gtest/gtest.h>

#include <cstring>
#include <set>

#include "pipeline/files/case_file.h"
#include "pipeline/report/page.h"
#include "pipeline/report/render.h"
#include "pipeline/report/report.h"
#include "pipeline/stages/stages.h"
#include "preprocess/files/vessel_io.h"
#include "tests/pipeline/finished_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

std::string decoded(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0, count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6U | static_cast<unsigned>(digits.find(c));
    count += 6;
    if (count >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 255U);
  }
  return bytes;
}

template <typename Number>
std::vector<Number> numbers(const Json& text) {
  const std::string bytes = decoded(text.get<std::string>());
  std::vector<Number> values(bytes.size() / sizeof(Number));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(Number));
  return values;
}

fs::path run_tube(const fs::path& folder, const std::string& cache, int threads) {
  RunOptions options;
  options.cache = folder / cache;
  options.work.threads = threads;
  return run_stages(read_case(folder / "case.json"), options).artifacts.back().folder;
}

TEST(Page, EncodesBytesAsRfc4648Does) {
  const std::vector<std::pair<std::string, std::string>> vectors = {{"", ""},
                                                                    {"f", "Zg=="},
                                                                    {"fo", "Zm8="},
                                                                    {"foo", "Zm9v"},
                                                                    {"foob", "Zm9vYg=="},
                                                                    {"fooba", "Zm9vYmE="},
                                                                    {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, text] : vectors) EXPECT_EQ(base64(plain.data(), plain.size()), text);
}

TEST(Page, EmbedsNamesThatCannotEndTheirScriptAndReadBackTheSame) {
  const Json hostile = {{"</script><script>alert(1)</script>", "<!-- & ]]> \u2028\u2029\u202e'\""}};
  const std::string text = embed_json(hostile);
  EXPECT_EQ(text.find_first_of("<>&"), std::string::npos) << text;
  for (const char c : text) EXPECT_TRUE(c >= ' ' && c <= '~') << "printable ASCII alone";
  EXPECT_EQ(Json::parse(text), hostile);
}

TEST(Page, HoldsTheReportAndTheShapesOfItsTrials) {
  if (!page_missing().empty()) GTEST_SKIP() << page_missing();
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const fs::path made = run_tube(folder.path(), "cache", 2);
  const std::string page = read_text(made / "report.html");
  Json report = read_json(made / "report.json", kReportSchema);
  EXPECT_EQ(Json::parse(page_block(page, "timing")), report.at("timing"));
  report.erase("timing");
  EXPECT_EQ(Json::parse(page_block(page, "report")), report);
  EXPECT_EQ(page.find("%WIREPLAN_"), std::string::npos);

  // A point of the surface, to the 16 bits over the box; the tube has a radius of 4 mm.
  const Json scene = Json::parse(page_block(page, "scene"));
  const std::vector<std::uint16_t> steps =
      numbers<std::uint16_t>(scene.at("surface").at("vertices"));
  const Json low = scene.at("box").at("low_mm"), size = scene.at("box").at("size_mm");
  ASSERT_GT(steps.size(), 300u);
  double widest = 0.0;
  for (std::size_t k = 0; k + 2 < steps.size(); k += 3) {
    const double x = low[0].get<double>() + steps[k] / 65535.0 * size[0].get<double>();
    const double y = low[1].get<double>() + steps[k + 1] / 65535.0 * size[1].get<double>();
    widest = std::max(widest, std::hypot(x, y));
  }
  EXPECT_NEAR(widest, 4.0, 0.02) << "remeshing and quantising move it by less";

  // Both plans can be played, the last shape has the tip where the report says.
  ASSERT_EQ(scene.at("insertions").size(), 2u);
  const Json& last = scene.at("insertions")[0].at("shapes").back();
  const std::vector<std::uint16_t> nodes = numbers<std::uint16_t>(last.at("nodes"));
  EXPECT_EQ(nodes.size() / 3, numbers<float>(last.at("force_n")).size());
  Vec3 tip;
  for (int axis = 0; axis < 3; ++axis) {
    tip[axis] = low[axis].get<double>() +
                nodes[nodes.size() - 3 + axis] / 65535.0 * size[axis].get<double>();
  }
  const Json& trial = report.at("trials")[scene.at("insertions")[0].at("trial").get<int>()];
  EXPECT_NEAR((tip - Vec3(0.0, 0.0, 28.0)).norm(), trial.at("tip_to_target_mm"), 2e-3)
      << "16 bits over 36 mm are steps of 0.0006 mm";
  EXPECT_FALSE(scene.at("panels").contains("slices")) << "the case starts from a surface";
}

TEST(Page, HoldsHowTheVesselFollowsItsCrossSections) {
  if (!page_missing().empty()) GTEST_SKIP() << page_missing();
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  RunOptions options;
  options.cache = folder / "cache";
  const Case given = read_case(
      folder / "case.json",
      {"wall.support_kpa_per_mm=0.2", "robustness.repeats=0", "access.inclination_deg=[20]"});
  const fs::path made = folder / "out";
  publish(run_stages(given, options).artifacts, made);
  const Json scene = Json::parse(page_block(read_text(made / "report.html"), "scene"));
  const auto counts = numbers<std::uint8_t>(scene.at("motion").at("counts"));
  const auto nodes = numbers<std::uint16_t>(scene.at("motion").at("nodes"));
  const auto weights = numbers<float>(scene.at("motion").at("weights"));
  const std::size_t points = (numbers<std::uint16_t>(scene.at("surface").at("vertices")).size() +
                              numbers<std::uint16_t>(scene.at("path")).size()) /
                             3;
  ASSERT_EQ(counts.size(), points + 2) << "and access and target";
  ASSERT_EQ(nodes.size(), weights.size());
  std::size_t at = 0;
  for (const std::uint8_t count : counts) {
    double sum = 0.0;
    for (int k = 0; k < count; ++k) sum += weights.at(at++);
    EXPECT_NEAR(sum, 1.0, 1e-5);
  }
  EXPECT_EQ(at, nodes.size());

  // The last shape's displacements are the trial's; the vessel as the files have it is moved by
  // them.
  const Json& insertion = scene.at("insertions")[0];
  const auto last = numbers<float>(insertion.at("shapes").back().at("sections"));
  EXPECT_EQ(last,
            numbers<float>(scene.at("trials")[insertion.at("trial").get<int>()].at("sections")));
  ASSERT_EQ(last.size() % 3, 0u);
  const fs::path states = made / "trials" / "plan-1-vessel";
  int count = 0;
  while (fs::exists(states / (std::to_string(count) + ".vtp"))) ++count;
  EXPECT_GE(count, 3);
  EXPECT_LE(count, 24);
  EXPECT_TRUE(fs::exists(made / "trials" / "plan-1-vessel.pvd"));
  const Surface rest = preprocess::read_surface_artifact(made / "surface.vtp"),
                moved = preprocess::read_surface_artifact(states /
                                                          (std::to_string(count - 1) + ".vtp"));
  ASSERT_EQ(rest.vertices.cols(), moved.vertices.cols());
  at = 0;
  double most = 0.0;
  for (Eigen::Index k = 0; k < rest.vertices.cols(); ++k) {
    Vec3 shift = Vec3::Zero();
    for (int n = 0; n < counts[static_cast<std::size_t>(k)]; ++n, ++at) {
      const float* u = last.data() + 3 * nodes[at];
      shift += weights[at] * Vec3(u[0], u[1], u[2]);
    }
    most = std::max(most, shift.norm());
    EXPECT_LT((rest.vertices.col(k) + shift - moved.vertices.col(k)).norm(), 1e-4);
  }
  EXPECT_GT(most, 0.01) << "the wire moved it";
  EXPECT_FALSE(render_report(made / "report.json", folder / "pictures").empty());
}

TEST(Page, IsTheSameAtAnyThreadCountOutsideItsTiming) {
  if (!page_missing().empty()) GTEST_SKIP() << page_missing();
  const TemporaryFolder folder;
  write_tube_case(folder.path());
  std::set<std::string> pages;
  for (const int threads : {1, 3}) {  // report.json is tested at more
    std::string page = read_text(
        run_tube(folder.path(), "cache-" + std::to_string(threads), threads) / "report.html");
    const std::string timing = page_block(page, "timing");
    EXPECT_GT(timing.size(), 100u);
    page.erase(page.find(timing), timing.size());
    pages.insert(page);
  }
  EXPECT_EQ(pages.size(), 1u);
}

TEST(Page, NamesNothingOfTheMachineAndAsksNothingOfTheNetwork) {
  if (!page_missing().empty()) GTEST_SKIP() << page_missing();
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const std::string page = read_text(run_tube(folder.path(), "cache", 1) / "report.html");
  EXPECT_EQ(page.find(folder.path().string()), std::string::npos);
  EXPECT_EQ(page.find(WIREPLAN_SOURCE_DIR), std::string::npos);
  for (const char* load : {"<script src", "<link rel=\"stylesheet", "@import", "@font-face"}) {
    EXPECT_EQ(page.find(load), std::string::npos) << load;
  }
}

TEST(Page, OrTheReasonWhyThereIsNone) {
  const TemporaryFolder folder;
  write_finished_tube(folder.path());
  const fs::path made = run_tube(folder.path(), "cache", 1);
  const std::string report = read_text(made / "report.json");
  EXPECT_EQ(fs::exists(made / "report.html"), page_missing().empty());
  EXPECT_EQ(report.find("the page report.html was left out: ") == std::string::npos,
            page_missing().empty());
  EXPECT_EQ(report.find("\"file\": \"report.html\"") != std::string::npos, page_missing().empty());
}

}  // namespace
}  // namespace wireplan::pipeline
