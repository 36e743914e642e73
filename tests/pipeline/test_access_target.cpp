// Cases of several accesses and targets.
#include <gtest/gtest.h>

#include "pipeline/files/case_file.h"
#include "pipeline/stages/sections.h"
#include "tests/messages.h"
#include "tests/pipeline/case_texts.h"

namespace wireplan::pipeline {
namespace {

TEST_F(CaseFile, TakesListsOfNamedAccessesAndTargets) {
  const Case given = read(listed_case());
  ASSERT_EQ(given.accesses.size(), 2u);
  ASSERT_EQ(given.targets.size(), 3u);
  EXPECT_EQ(section_name(given), "right femoral to sac");
  EXPECT_EQ(given.study.goal.radius, 5.0);
  EXPECT_EQ(case_parameters(given)["accesses"].size(), 2u);
  EXPECT_EQ(case_parameters(read(case_parameters(given))), case_parameters(given));
  Case other = given;
  choose_section(other, 1, 2);
  EXPECT_EQ(section_name(other), "left femoral to renal");
  EXPECT_EQ(other.study.access, Vec3(1, 2, 4));
  EXPECT_TRUE(other.study.goal.at_section);
  EXPECT_EQ(access_key(other), "accesses[1]");
  EXPECT_EQ(end_points(given).back().first, "targets[2].point_mm");

  Json one = listed_case();
  one["accesses"].erase(1);
  one["targets"].erase(2);
  one["targets"].erase(1);
  EXPECT_EQ(section_name(read(one)), "") << "a list of one is the singular form";
  EXPECT_EQ(end_points(read(one)).front().first, "accesses[0].point_mm") << "as the file has it";
  EXPECT_EQ(end_points(read(one)).back().first, "targets[0].point_mm");
  EXPECT_TRUE(case_parameters(read(one)).contains("target"));
  // Its name is kept; folders and sections are not called after it.
  EXPECT_EQ(read(one).targets[0].name, one["targets"][0]["name"]);
  EXPECT_EQ(section_folder(read(one)), "");
  Json singular = case_parameters(read(one));
  EXPECT_EQ(singular["access"]["name"], "right femoral");
  EXPECT_EQ(end_points(read(singular)).front().first, "access.point_mm");
  EXPECT_EQ(case_parameters(read(singular)), singular);
  one["targets"] = listed_case()["targets"];
  EXPECT_EQ(section_folder(read(one)), "sac");
  EXPECT_EQ(section_name(read(one)), "sac");
}

TEST_F(CaseFile, KeysOfPointsAreThoseOfTheFile) {
  Json file;
  file["accesses"] = {{{"branch", "aorta"}}, {{"point", {{"ijk", {1, 2, 3}}}}}, {{"name", "x"}}};
  file["target"]["point_mm"] = {1, 2, 3};
  const PointKeys keys = find_point_keys(file);
  EXPECT_EQ(keys.accesses, (std::vector<std::string>{"branch", "point", "point_mm"}));
  EXPECT_EQ(keys.targets, std::vector<std::string>{"point_mm"});
  EXPECT_TRUE(find_point_keys({{"access", 3}}).targets.empty());
}

TEST_F(CaseFile, NamesMistakesOfListedAccessesAndTargets) {
  const auto told = [&](const std::function<void(Json&)>& change) {
    Json json = listed_case();
    change(json);
    return problem(json);
  };
  expect_mentions(told([](Json& j) { j["access"] = j["accesses"][0]; }),
                  {"accesses is given beside access", "one of the two"});
  expect_mentions(told([](Json& j) { j["accesses"] = Json::array(); }),
                  {"accesses is [], expected a list of objects"});
  expect_mentions(told([](Json& j) { j.erase("accesses"); }), {"access is missing"});
  expect_mentions(told([](Json& j) { j["accesses"][0]["beyond_ostium_mm"] = 15; }),
                  {"accesses[0].beyond_ostium_mm is given without branch, expected \"branch\""});
  expect_mentions(told([](Json& j) { j["targets"][2]["end"] = "distal"; }),
                  {"targets[2].end is given without branch"});
  expect_mentions(told([](Json& j) { j["targets"][1].erase("name"); }),
                  {"targets[1].name is missing"});
  expect_mentions(told([](Json& j) { j["targets"][1]["name"] = "../sac"; }),
                  {"targets[1].name is \"../sac\"", "folders are named after it"});
  expect_mentions(told([](Json& j) { j["targets"][1]["name"] = "report.json"; }),
                  {"targets[1].name is \"report.json\"", "does not end in .json"});
  expect_mentions(told([](Json& j) { j["targets"][1]["name"] = "a -b"; }),
                  {"targets[1].name is \"a -b\"", "no two dashes or spaces in a row"});
  expect_mentions(told([](Json& j) {
                    j["targets"][1]["name"] = std::string(300, 'a');
                    j["name"] = std::string(300, 'b');
                  }),
                  {"targets[1].name is \"aaa", "name is \"bbb", "at most 80 letters"});
  expect_mentions(told([](Json& j) {
                    j["targets"][0]["name"] = "a b";
                    j["targets"][1]["name"] = "a-b";
                  }),
                  {"targets[1].name is \"a-b\" again", "a name of its own"});
  expect_mentions(told([](Json& j) {
                    j["targets"][2]["point_mm"] = {1, 2, 4};
                  }),
                  {"targets[2].point_mm", "another point than accesses[1].point_mm"});
  expect_mentions(told([](Json& j) { j["targets"][0]["beyond_mm"] = 3; }),
                  {"targets[0].beyond_mm is given beside targets[0].radius_mm"});
}

}  // namespace
}  // namespace wireplan::pipeline
