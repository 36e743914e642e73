// Where anatomy holds a vessel that moves as a whole, as a case gives it.
#include <gtest/gtest.h>

#include "pipeline/files/case_file.h"
#include "tests/pipeline/case_texts.h"

namespace wireplan::pipeline {
namespace {

TEST_F(CaseFile, PlacesThatHoldAVesselAreTheAccessUnlessTheCaseNamesThem) {
  Json json = volume_case();
  json["wall"]["support_kpa_per_mm"] = 1;
  ASSERT_EQ(read(json).wall.held.size(), 1u);
  EXPECT_EQ(case_parameters(read(json))["wall"]["held"],
            Json::parse(R"([{"at": "access", "radius_mm": 10.0, "factor": 100.0}])"));
  json["wall"]["held"] = Json::array(
      {{{"at", "ostia"}, {"radius_mm", 4}}, {{"at", "point"}, {"point_mm", {1, 2, 3}}}});
  const WallInput wall = read(json).wall;
  ASSERT_EQ(wall.held.size(), 2u);
  EXPECT_EQ(wall.held[0].at, HeldPlace::At::kOstia);
  EXPECT_EQ(wall.held[0].radius, 4.0);
  EXPECT_EQ(wall.held[1].point, Vec3(1, 2, 3));
  const Json told = case_parameters(read(json));
  json["wall"] = told["wall"];
  EXPECT_EQ(case_parameters(read(json))["wall"], told["wall"]);
  json["wall"]["held"] = Json::array();  // nothing holds it
  EXPECT_TRUE(read(json).wall.held.empty());

  json["wall"]["held"] = Json::array({{{"at", "spine"}}, {{"at", "point"}}, {{"at", "access"}}});
  json["wall"]["held"][2]["point_mm"] = {1, 2, 3};
  expect_mentions(problem(json),
                  {"wall.held[0].at", "expected one of \"access\", \"ostia\", \"point\"",
                   "wall.held[1].point_mm is missing", "wall.held[2].point_mm"});
  json["wall"].erase("support_kpa_per_mm");
  json["wall"]["held"] = Json::array({{{"at", "access"}}});
  expect_mentions(problem(json), {"wall.held is given", "wall.support_kpa_per_mm"});
}

}  // namespace
}  // namespace wireplan::pipeline
