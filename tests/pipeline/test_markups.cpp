// Points of a case from the markups of 3D Slicer.
#include <gtest/gtest.h>

#include <cstdlib>

#include "pipeline/files/case_file.h"
#include "pipeline/files/markups_file.h"
#include "pipeline/files/scene_file.h"
#include "preprocess/volume/image.h"
#include "preprocess/volume/labels.h"
#include "tests/messages.h"
#include "tests/pipeline/small_case.h"
#include "tests/preprocess/label_bytes.h"

namespace wireplan::pipeline {
namespace {

class Markups : public ::testing::Test {
 protected:
  void SetUp() override { case_ = write_tube_case(folder_.path()); }

  /// A list of points in the frame, as 3D Slicer 5 writes it.
  static Json markups(const std::string& frame,
                      const std::vector<std::pair<std::string, Json>>& points) {
    Json list = {{"type", "Fiducial"}, {"coordinateSystem", frame}, {"coordinateUnits", "mm"}};
    for (const auto& [label, position] : points) {
      list["controlPoints"].push_back(
          {{"label", label}, {"position", position}, {"positionStatus", "defined"}});
    }
    return {{"@schema", "markups-schema-v1.0.3.json#"}, {"markups", Json::array({list})}};
  }

  void write(const std::string& name, const Json& file) { write_json(file, folder_ / name); }

  /// What reading the case says against it; empty where it reads.
  std::string refusal() {
    write("case.json", case_);
    return message_of([&] { read_case(folder_ / "case.json"); });
  }

  void point_at(const std::string& end, const Json& point) {
    case_[end].erase("point_mm");
    case_[end]["point"] = point;
  }

  TemporaryFolder folder_;
  Json case_;
};

TEST_F(Markups, PointsOfEitherFrameAreThoseOfTheNumbers) {
  write("case.json", case_);
  const Case numbers = read_case(folder_ / "case.json");
  const Vec3 access = numbers.accesses[0].point, target = numbers.targets[0].point;
  const Vec3 ras(-1.0, -1.0, 1.0);
  write("lps.mrk.json", markups("LPS", {{"in", to_json(access)}, {"out", to_json(target)}}));
  write("ras.mrk.json", markups("RAS", {{"only", to_json(ras.cwiseProduct(target).eval())}}));
  point_at("access", {{"markups", "lps.mrk.json"}, {"label", "in"}});
  point_at("target", {{"markups", "ras.mrk.json"}});
  write("case.json", case_);
  const Case marked = read_case(folder_ / "case.json");
  EXPECT_EQ(marked.accesses[0].point, access);
  EXPECT_EQ(marked.targets[0].point, target);
}

TEST_F(Markups, SeedsAndListsAreResolved) {
  write("p.mrk.json", markups("RAS", {{"a", {1, 2, 3}}, {"b", {4, 5, 6}}}));
  Json file =
      Json::parse(R"({"accesses": [{"name": "x", "point": {"markups": "p.mrk.json", "label": "a"}}],
      "segmentation": {"seeds_mm": [[7, 8, 9], {"markups": "p.mrk.json", "label": "b"}]}})");
  Problems problems("FILE");
  resolve_points(file, folder_.path(), problems);
  EXPECT_TRUE(problems.empty());
  EXPECT_EQ(file["accesses"][0]["point_mm"], Json::parse("[-1.0, -2.0, 3.0]"));
  EXPECT_FALSE(file["accesses"][0].contains("point"));
  EXPECT_EQ(file["segmentation"]["seeds_mm"][1], Json::parse("[-4.0, -5.0, 6.0]"));
}

TEST_F(Markups, AnyPointOfASceneMayBeOne) {
  write("points.mrk.json", markups("RAS", {{"hub", {-1, -2, 3}}, {"grip", {-30, 0, 5}}}));
  const Json hub = {{"markups", "points.mrk.json"}, {"label", "hub"}},
             grip = {{"markups", "points.mrk.json"}, {"label", "grip"}};
  const Json wire = {{"sections", Json::array({{{"length_mm", 40},
                                                {"element_length_mm", 1},
                                                {"bending_stiffness_n_mm2", 50},
                                                {"radius_mm", 0.4}}})}};
  Json bench = {{"schema", "wireplan.scene/1"}, {"wire", wire}};
  bench["supports"] = Json::array({{{"at", "proximal"}, {"kind", "clamped"}, {"point_mm", hub}},
                                   {{"at", "distal"}, {"kind", "pinned"}, {"point", grip}}});
  write("bench.json", bench);
  const SceneFile gripped = read_scene(folder_ / "bench.json");
  EXPECT_EQ(gripped.bench->supports[0].point, Vec3(1.0, 2.0, 3.0));
  EXPECT_EQ(gripped.bench->supports[1].point, Vec3(30.0, 0.0, 5.0));

  Json pushed = {{"schema", "wireplan.scene/1"}, {"wire", wire}};
  pushed["vessel"] = {{"surface", {{"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}}}};
  pushed["insertion"] = {{"point", hub}, {"direction", {0, 0, 1}}, {"length_mm", 20}};
  pushed["target"] = {{"point_mm", grip}};
  write("pushed.json", pushed);
  const SceneFile inserted = read_scene(folder_ / "pushed.json");
  EXPECT_EQ(inserted.insertion->introducer.point, Vec3(1.0, 2.0, 3.0));
  EXPECT_EQ(inserted.insertion->goal.point, Vec3(30.0, 0.0, 5.0));

  // What is wrong is told under its key.
  pushed["insertion"]["point"]["label"] = "hob";
  pushed["target"]["point_mm"] = {{"markups", "none.mrk.json"}};
  write("pushed.json", pushed);
  const std::string told = message_of([&] { read_scene(folder_ / "pushed.json"); });
  EXPECT_NE(told.find("insertion.point.label is \"hob\""), std::string::npos) << told;
  EXPECT_NE(told.find("did you mean \"hub\"?"), std::string::npos) << told;
  EXPECT_NE(told.find("target.point_mm.markups is none.mrk.json"), std::string::npos) << told;
  pushed["target"] = {{"point_mm", {{"ijk", {1, 2, 3}}}}};
  write("pushed.json", pushed);
  EXPECT_NE(message_of([&] { read_scene(folder_ / "pushed.json"); }).find("target.point_mm.ijk"),
            std::string::npos);
  pushed["target"]["point_mm"]["markups"] = "points.mrk.json";
  write("pushed.json", pushed);
  EXPECT_NE(message_of([&] {
              read_scene(folder_ / "pushed.json");
            }).find("target.point_mm.ijk is given beside target.point_mm.markups"),
            std::string::npos);
}

TEST_F(Markups, ALineOfASceneMayBeAllPointsOfAFile) {
  write("line.mrk.json", markups("RAS", {{"", {0, 0, 0}}, {"", {-2, 0, 10}}, {"", {-3, -1, 20}}}));
  Json scene = {{"schema", "wireplan.scene/1"},
                {"wire",
                 {{"sections", Json::array({{{"length_mm", 40},
                                             {"element_length_mm", 1},
                                             {"bending_stiffness_n_mm2", 50},
                                             {"radius_mm", 0.4}}})}}}};
  scene["vessel"] = {{"surface", {{"path", "tube.stl"}, {"unit", "mm"}, {"frame", "LPS"}}}};
  scene["insertion"] = {{"point_mm", {0, 0, 0}}, {"direction", {0, 0, 1}}};
  scene["start"]["nodes_mm"] = {{"markups", "line.mrk.json"}};
  write("scene.json", scene);
  const SceneFile read = read_scene(folder_ / "scene.json");
  EXPECT_EQ(read.insertion->start->nodes.col(1), Vec3(2.0, 0.0, 10.0));
  EXPECT_EQ(read.insertion->start->nodes.col(2), Vec3(3.0, 1.0, 20.0));

  write("line.mrk.json", markups("RAS", {{"", {0, 0, 0}}}));
  EXPECT_NE(message_of([&] {
              read_scene(folder_ / "scene.json");
            }).find("start.nodes_mm.markups is line.mrk.json, with 1 points"),
            std::string::npos);
}

TEST_F(Markups, FrameAndUnitMayBeListsAndNothingElse) {
  const Vec3 target(4.0, -5.0, 6.0);
  const auto with = [&](const char* key, const Json& value) {
    Json file = markups("RAS", {{"out", to_json(Vec3(-target.x(), -target.y(), target.z()))}});
    file["markups"][0][key] = value;
    write("points.mrk.json", file);
    return message_of([&] {
      EXPECT_LT((read_markups(folder_ / "points.mrk.json").points.at(0).point - target).norm(),
                1e-12);
    });
  };
  EXPECT_EQ(with("coordinateSystem", Json::array({"RAS"})), "no error");
  EXPECT_EQ(with("coordinateUnits", {"mm", "mm", "mm"}), "no error");
  EXPECT_EQ(with("coordinateUnits", {"mm", "UCUM", "millimeter"}), "no error");
  EXPECT_EQ(with("coordinateUnits", nullptr), "no error");
  EXPECT_NE(with("coordinateUnits", {"cm", "UCUM", "centimeter"}).find("in cm, expected mm"),
            std::string::npos);
  EXPECT_NE(with("coordinateUnits", {"cm", "cm", "cm"}).find("in cm, expected mm"),
            std::string::npos);
  for (const Json& other : {Json::array({"mm", "mm", "cm"}), Json::array(), Json(1.5), Json(true),
                            Json{{"unit", "mm"}}}) {
    EXPECT_NE(with("coordinateUnits", other).find("coordinateUnits is " + other.dump()),
              std::string::npos)
        << other;
  }
  EXPECT_NE(with("coordinateSystem", {"RAS", "LPS"}).find("coordinateSystem is [\"RAS\",\"LPS\"]"),
            std::string::npos);
}

TEST_F(Markups, TablesOfSlicer3AreReadAsRas) {
  write_text(
      "# Fiducial List file F.fcsv\n# version = 2\n# name = F\n"
      "# columns = label,x,y,z,sel,vis\nin,1,2,3,1,1\nout,-4,5.5,6,1,1\n",
      folder_ / "old.fcsv");
  const std::vector<MarkupPoint> points = read_markups(folder_ / "old.fcsv").points;
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[1].label, "out");
  EXPECT_EQ(points[1].point, Vec3(4.0, -5.5, 6.0));
}

TEST_F(Markups, OldTablesAreReadInTheirFrame) {
  const std::string head = "# Markups fiducial file version = 4.11\n";
  const std::string columns =
      "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
  const std::string row = "1,10.5,-20,30,0,0,0,1,1,1,0,\"left, upper\",,\n";
  const Vec3 in_file(10.5, -20.0, 30.0), turned(-10.5, 20.0, 30.0);
  for (const auto& [frame, expected] :
       std::vector<std::pair<std::string, Vec3>>{{"# CoordinateSystem = LPS\n", in_file},
                                                 {"# CoordinateSystem = 1\n", in_file},
                                                 {"# CoordinateSystem = RAS\n", turned},
                                                 {"# CoordinateSystem = 0\r\n", turned},
                                                 {"", turned}}) {
    SCOPED_TRACE(frame);
    write_text(head + frame + columns + row, folder_ / "p.fcsv");
    const std::vector<MarkupPoint> points = read_markups(folder_ / "p.fcsv").points;
    ASSERT_EQ(points.size(), 1U);
    EXPECT_EQ(points[0].label, "left, upper");
    EXPECT_EQ(points[0].point, expected);
  }
  // As Excel saves it: a mark of UTF-8, commas up to the longest line, lines of them alone.
  write_text("\xef\xbb\xbf" + head.substr(0, head.size() - 1) +
                 ",,,\r\n# CoordinateSystem = LPS,,,\r\n" + row + ",,,,\r\n",
             folder_ / "p.fcsv");
  EXPECT_EQ(read_markups(folder_ / "p.fcsv").points.at(0).point, in_file);
  write_text(head + "# CoordinateSystem = 2\n" + row, folder_ / "p.fcsv");  // voxels
  EXPECT_NE(message_of([&] { read_markups(folder_ / "p.fcsv"); }).find("expected LPS or RAS"),
            std::string::npos);
  write_text("a,b,c\n", folder_ / "p.fcsv");
  EXPECT_NE(message_of([&] { read_markups(folder_ / "p.fcsv"); }).find("no table of fiducials"),
            std::string::npos);
}

TEST_F(Markups, TablesAreReadByTheirColumns) {
  const auto read = [&](const std::string& name, const std::string& text) {
    write_text(text, folder_ / name);
    return read_markups(folder_ / name);
  };
  const std::string head = "# Markups fiducial file version = 5.2\n# CoordinateSystem = LPS\n";
  const std::vector<std::pair<std::string, std::string>> tables = {
      {"turned.fcsv", head + "# columns = label,z,y,x\n\"the \"\"left\"\"\",3,2,1\n"},
      {"script.fcsv", "# columns = x,y,z,label\n# CoordinateSystem = LPS\n1,2,3,the left\n"},
      {"hidden.fcsv", head +
                          "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,"
                          "associatedNodeID\n1,1,2,3,0,0,0,1,0,0,1,\"the \"\"left\"\"\",,,2,0\n"},
      {"ras.csv", "label,r,a,s,defined,selected\n\"the \"\"left\"\"\",-1,-2,3,1,0\n"},
      {"lps.csv", "\xef\xbb\xbflabel;l;p;s\r\n\"the \"\"left\"\"\";1;2;3\r\n"},
      {"lps.tsv", "s\tp\tl\tlabel\n3\t2\t1\t\"the \"\"left\"\"\"\n"}};
  for (const auto& [name, text] : tables) {
    SCOPED_TRACE(name);
    const auto found = read(name, text);
    ASSERT_EQ(found.points.size(), 1U);
    EXPECT_EQ(found.points[0].point, Vec3(1, 2, 3));
    const bool plain = name == "script.fcsv";
    EXPECT_EQ(found.points[0].label, plain ? "the left" : "the \"left\"");
    EXPECT_TRUE(found.unplaced.empty());
  }
  EXPECT_NE(message_of([&] {
              read("no.fcsv", head + "# columns = id,label\n1,a\n");
            }).find("its columns lack x, y or z"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              read("no.csv", "label,x,y,z\na,1,2,3\n");
            }).find("its coordinate system is not told, expected LPS or RAS"),
            std::string::npos);
}

TEST_F(Markups, RowsOfPointsThatWereNotPlacedAreNoPlaces) {
  const std::string head =
      "# Markups fiducial file version = 5.2\n# CoordinateSystem = LPS\n# columns = ";
  const std::string columns = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
  for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
           {"status.fcsv", head + columns +
                               "1,1,2,3,0,0,0,1,1,1,0,a,,,2,0\n"
                               "2,0,0,0,0,0,0,1,1,1,0,b,,,0,0\n"},
           {"word.fcsv", head + "label,x,y,z,sel\na,1,2,3,1\nb,0,0,0,undefined\n"},
           {"named.fcsv", head + "label,x,y,z,positionStatus\na,1,2,3,2\nb,0,0,0,3\n"},
           {"empty.fcsv", head + "label,x,y,z\na,1,2,3\nb,nan,nan,nan\n"},
           {"defined.csv", "label,l,p,s,defined\na,1,2,3,1\nb,0,0,0,0\n"}}) {
    SCOPED_TRACE(name);
    write_text(text, folder_ / name);
    const auto read = read_markups(folder_ / name);
    ASSERT_EQ(read.points.size(), 1U);
    EXPECT_EQ(read.points[0].point, Vec3(1, 2, 3));
    EXPECT_EQ(read.unplaced, std::vector<std::string>{"b"});
  }
}

TEST_F(Markups, WhatIsWrongIsToldWithFileAndLabels) {
  write("p.mrk.json",
        markups("LPS", {{"access", {0, 0, 6}}, {"twice", {1, 1, 1}}, {"twice", {2, 2, 2}}}));
  const std::string key = (folder_ / "case.json").string() + ": access.point";
  const auto expect_refusal = [&](const Json& point, const std::string& expected) {
    point_at("access", point);
    EXPECT_EQ(refusal(), key + expected);
  };
  expect_refusal({{"markups", "p.mrk.json"}, {"label", "acess"}},
                 ".label is \"acess\", expected one of the labels of p.mrk.json (\"access\", "
                 "\"twice\", \"twice\"; did you mean \"access\"?)");
  expect_refusal({{"markups", "p.mrk.json"}},
                 ".label is missing, expected one of the labels of p.mrk.json (\"access\", "
                 "\"twice\", \"twice\")");
  expect_refusal({{"markups", "p.mrk.json"}, {"label", "twice"}},
                 ".label is \"twice\", which 2 points have, expected the label of one point of "
                 "p.mrk.json (\"access\", \"twice\", \"twice\")");
  expect_refusal(
      {{"markups", "q.mrk.json"}},
      ".markups is q.mrk.json, expected a file of markups (" + (folder_ / "q.mrk.json").string() +
          ": no such file; expected markups of 3D Slicer (.mrk.json, .fcsv, or their table "
          "as .csv or .tsv))");
  write_text("{", folder_ / "q.mrk.json");
  expect_refusal({{"markups", "q.mrk.json"}},
                 ".markups is q.mrk.json, expected a file of markups (" +
                     (folder_ / "q.mrk.json").string() +
                     ": no JSON, or broken or cut short; expected markups of 3D Slicer (.mrk.json, "
                     ".fcsv, or their table as .csv or .tsv))");
  case_["access"]["point_mm"] = {0, 0, 6};
  EXPECT_EQ(refusal(), key + " is given beside access.point_mm, expected one of the two");
}

/// A volume that is turned 90 degrees round z, with voxels of (0.5, 0.8, 3) mm.
preprocess::Grid write_turned_volume(const std::filesystem::path& file) {
  preprocess::Image image;
  image.grid.size = {20, 30, 10};
  image.grid.spacing = {0.5, 0.8, 3.0};
  image.grid.origin = {-10.0, 20.0, 5.0};
  image.grid.direction << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  image.values.assign(image.grid.voxels(), 0.0F);
  preprocess::write_image(image, file);
  return image.grid;
}

TEST_F(Markups, VoxelsAreThoseOfTheVolume) {
  write_turned_volume(folder_ / "ct.nrrd");
  Json file = Json::parse(R"({"volume": {"path": "ct.nrrd"},
      "access": {"point": {"ijk": [0, 0, 0]}}, "targets": [{"point": {"ijk": [4, 10, 2.5]}}],
      "segmentation": {"seeds_mm": [{"ijk": [19, 29, 9]}]}})");
  Problems problems("FILE");
  resolve_points(file, folder_.path(), problems);
  EXPECT_TRUE(problems.empty());
  // By hand: i runs along y, j along -x.
  EXPECT_EQ(file["access"]["point_mm"], Json::parse("[-10.0, 20.0, 5.0]"));
  EXPECT_EQ(file["targets"][0]["point_mm"], Json::parse("[-18.0, 22.0, 12.5]"));
  EXPECT_NEAR(file["segmentation"]["seeds_mm"][0][0].get<double>(), -10.0 - 29 * 0.8, 1e-9);
  EXPECT_NEAR(file["segmentation"]["seeds_mm"][0][1].get<double>(), 20.0 + 19 * 0.5, 1e-9);
}

TEST_F(Markups, VoxelsThatAreNoneAreToldWithAllElse) {
  write_turned_volume(folder_ / "ct.nrrd");
  case_.erase("surface");
  case_["volume"] = {{"path", "ct.nrrd"}};
  case_["friction"] = -1;
  point_at("access", {{"ijk", {20, 0, 0}}});
  const std::string both = refusal();
  EXPECT_TRUE(both.find("access.point.ijk is [20.0,0.0,0.0], expected voxels from [0, 0, 0] to "
                        "[19.0,29.0,9.0]") != std::string::npos &&
              both.find("friction") != std::string::npos)
      << both;
  EXPECT_EQ(both.find("point_mm"), std::string::npos) << both;
  case_["friction"] = 0.1;
  write_text("", folder_ / "ct.nrrd");
  EXPECT_NE(refusal().find("expected voxels that can be read"), std::string::npos);
  case_["access"]["point"] = {{"ijk", {1, 2}}};
  EXPECT_NE(refusal().find("access.point.ijk is [1,2]"), std::string::npos) << refusal();
}

TEST_F(Markups, VoxelsAreThoseOfTheLabelsWhereTheyAreAllThereIs) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  write_text(preprocess::branched_labels(), folder_ / "tree.nii");
  case_.erase("surface");
  case_["labels"] = {{"path", "tree.nii"}, {"values", {1, 2}}, {"names", {"aorta", "renal"}}};
  point_at("access", {{"ijk", {12, 12, 4}}});
  write("case.json", case_);
  const preprocess::Grid grid = preprocess::read_labels(folder_ / "tree.nii", {.values = {1}}).grid;
  EXPECT_LT(
      (read_case(folder_ / "case.json").accesses[0].point - grid.lps_from_ijk(Vec3(12, 12, 4)))
          .norm(),
      1e-9);
  case_["labels"]["values"] = {1, 9};
  EXPECT_NE(refusal().find("access.point.ijk is [12.0,12.0,4.0]"), std::string::npos) << refusal();
}

TEST_F(Markups, ASurfaceHasNoVoxels) {
  point_at("access", {{"ijk", {1, 2, 3}}});
  EXPECT_NE(refusal().find("expected a case with volume.path or labels"), std::string::npos)
      << refusal();
}

TEST_F(Markups, FilesMayLieInTheFolderOfData) {
  std::filesystem::create_directories(folder_ / "data");
  write("data/p.mrk.json", markups("LPS", {{"a", {1, 2, 3}}}));
  point_at("access", {{"markups", "${WIREPLAN_DATA}/p.mrk.json"}, {"label", "a"}});
  const char* before = std::getenv("WIREPLAN_DATA");
  const std::string kept = before == nullptr ? "" : before;
  ::setenv("WIREPLAN_DATA", (folder_ / "data").c_str(), 1);
  write("case.json", case_);
  EXPECT_EQ(read_case(folder_ / "case.json").accesses[0].point, Vec3(1, 2, 3));
  if (before != nullptr) ::setenv("WIREPLAN_DATA", kept.c_str(), 1);
  if (before == nullptr) ::unsetenv("WIREPLAN_DATA");
}

TEST_F(Markups, PointsThatAreNotPlacedOrNoPlaceAreNotTaken) {
  Json file = markups("LPS", {{"a", {1, 2, 3}}, {"b", {4, 5, 6}}});
  file["markups"][0]["controlPoints"][1]["positionStatus"] = "undefined";
  write("p.mrk.json", file);
  EXPECT_EQ(read_markups(folder_ / "p.mrk.json").points.size(), 1U);
  EXPECT_EQ(read_markups(folder_ / "p.mrk.json").unplaced, std::vector<std::string>{"b"});
  for (const Json& position :
       {Json::array({1, 2}), Json::array({1, 2, "x"}), Json::array({1, 2, 1e9}), Json(nullptr)}) {
    file["markups"][0]["controlPoints"][0]["position"] = position;
    write("p.mrk.json", file);
    EXPECT_NE(message_of([&] { read_markups(folder_ / "p.mrk.json"); }).find("the point \"a\""),
              std::string::npos)
        << position;
  }
  file["markups"][0]["controlPoints"][0]["position"] = {1, 2, 3};
  write("p.mrk.json", file);
  point_at("access", {{"markups", "p.mrk.json"}, {"label", "b"}});
  EXPECT_NE(refusal().find("\"b\", which is in p.mrk.json but has no position"), std::string::npos)
      << refusal();
  write("p.mrk.json", markups("IJK", {{"a", {1, 2, 3}}}));
  EXPECT_NE(message_of([&] { read_markups(folder_ / "p.mrk.json"); }).find("is IJK, expected LPS"),
            std::string::npos);
}

}  // namespace
}  // namespace wireplan::pipeline
