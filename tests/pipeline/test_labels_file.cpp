// Cases that enter at labels: the key, tables of names, places by a branch's name.
#include <gtest/gtest.h>

#include "pipeline/files/labels_file.h"
#include "tests/messages.h"
#include "tests/pipeline/case_texts.h"
#include "tests/preprocess/label_bytes.h"

namespace wireplan::pipeline {
namespace {

using LabelTable = CaseFile;

TEST_F(LabelTable, IsReadFromEveryKindOfFile) {
  const std::map<int, std::string> expected = {{1, "aorta"}, {7, "renal left"}};
  const std::vector<std::pair<std::string, std::string>> files = {
      {"dataset.json", R"({"name": "x", "labels": {"aorta": 1, "renal left": 7}})"},
      {"old.json", R"({"labels": {"1": "aorta", "7": "renal left"}})"},
      {"plain.json", R"({"1": "aorta", "7": "renal left"})"},
      {"turned.json", R"({"aorta": 1, "renal left": 7, "both": [1, 7]})"},
      {"t.csv", "value,name\n1,aorta\n7,renal left\n"},
      {"t.tsv", "aorta\t1\nrenal left\t7\r\n"},
      {"snap.txt", "# ITK-SnAP\n1 255 0 0 1 1 1 \"aorta\"\n7 0 255 0 1 1 1 \"renal left\"\n"},
      {"slicer.ctbl", "# Color\n1 aorta 255 0 0 255\n\n7 \"renal left\" 0 255 0 255\n"},
      {"spaces.txt", "1 aorta 255 0 0\n7 renal left 0 255 0\n"},
      {"statistics.csv", "1,aorta,4711\n7,renal left,815\n"},
      {"one.json", R"({"labels": {"background": 0, "aorta": [1], "renal left": [7]}})"},
      // The first line tells which columns are meant.
      {"last.csv", "name,r,g,b,value\naorta,2,0,0,1\nrenal left,1,255,0,7\n"},
      {"middle.csv", "\xef\xbb\xbfVoxels;Label Value;Segment\r\n5;1;aorta\r\n;7;renal left\r\n"},
      {"label.tsv", "index\tcolor\tlabel\n1\t9\taorta\n7\t9\trenal left\n"},
      {"label_name.csv", "label,name,id\n1,aorta,3\n7,renal left,4\n"},
      {"words.txt", "name r g b value\naorta 2 0 0 1\nrenal left 1 255 0 7\n"},
      {"classes.csv", "class_id,class_name\n1,aorta\n7,renal left\n"},
      {"rois.csv", "roi_id;organ\n1;aorta\n7;renal left\n"},
      {"mask.csv", "segment,mask_value,mean_value\naorta,1,300\nrenal left,7,250\n"},
      {"described.csv", "label,description\n1,aorta\n7,renal left\n"},
      {"pandas.csv", "label,vessel\n1.0,aorta\n7.0,renal left\n9.0,\n"},
      {"two.csv", "Wert;Beschreibung\n1;aorta\n7;\"renal left\"\n"}};
  for (const auto& [name, text] : files) {
    SCOPED_TRACE(name);
    std::map<int, std::string> read = read_label_table(write(name, text));
    read.erase(0);
    EXPECT_EQ(read, expected);
  }
}

TEST_F(LabelTable, ThatIsNoneIsRefused) {
  const auto refusal = [&](const std::string& name, const std::string& text) {
    return message_of([&] { read_label_table(write(name, text)); });
  };
  expect_mentions(refusal("a.json", "[1]"), {"a.json: no JSON object"});
  expect_mentions(refusal("b.json", R"({"a": 0.5})"), {"its entry 1 is 0.5"});
  const std::string deep = std::string(200000, '[') + std::string(200000, ']');
  expect_mentions(refusal("deep.json", R"({"a": {"b": )" + deep + "}}"),
                  {"deep.json: nested deeper"});
  expect_mentions(refusal("c.csv", "1,a\n2\n"), {"line 2 has no value and name"});
  expect_mentions(refusal("d.csv", "1,a\n1,b\n"), {"value 1 is named \"a\" and \"b\""});
  expect_mentions(refusal("e.csv", "# nothing\n"), {"holds no names"});
  expect_mentions(refusal("g.csv", "structure,volume_ml\naorta,2\n"),
                  {"g.csv: its first line heads no column of values"});
  expect_mentions(refusal("m.csv", "index,volume\n1,2.5\n"), {"line 2 has no value and name"});
  expect_mentions(refusal("h.csv", "name,r,value\naorta,2,x\n"), {"line 2 has no value and name"});
  expect_mentions(refusal("i.json", R"({"labels": {"a": 1,}})"), {"i.json: broken JSON at line 1"});
  expect_mentions(refusal("j.json", R"({"labels": {"1": "a", "1": "b"}})"),
                  {"labels.1 is given twice"});
  expect_mentions(refusal("k.csv", std::string("\xff\xfe", 2)), {"k.csv: is UTF-16"});
  expect_mentions(refusal("f.csv", "1,art\xe8re\n"), {"the name of value 1 is no UTF-8"});
}

TEST_F(LabelTable, IsFoundBesideTheLabelsOrAbove) {
  fs::create_directories(folder_ / "labelsTr");
  EXPECT_TRUE(find_label_table(folder_ / "labelsTr" / "p.nii.gz").names.empty());
  write("dataset.json", R"({"labels": {"above": 1}})");
  EXPECT_EQ(find_label_table(folder_ / "labelsTr" / "p.nii.gz").names.at(1), "above");
  write("labelsTr/p.json", R"({"Modality": "CT"})");  // beside it, but of something else
  EXPECT_EQ(find_label_table(folder_ / "labelsTr" / "p.nii.gz").names.at(1), "above");
  write("labelsTr/p.csv", "structure,volume_ml\nleft,1\n");
  EXPECT_EQ(find_label_table(folder_ / "labelsTr" / "p.nii.gz").names.at(1), "above");
  write("labelsTr/p.txt", "1 own\n");
  EXPECT_EQ(find_label_table(folder_ / "labelsTr" / "p.nii.gz").names.at(1), "own");
}

TEST_F(LabelTable, ThatIsBrokenIsToldWithTheNamesThatItLacks) {
  fs::create_directories(folder_ / "l");
  const fs::path labels = folder_ / "l" / "p.nii";
  write("l/p.nii", preprocess::branched_labels());
  write("dataset.json", R"({"labels": {"other": 1}})");
  write("l/p.csv", "structure,volume_ml\naorta,1\n");
  write("l/dataset.json", R"({"labels": {"aorta": 1, "renal": 2.5}})");
  const FoundTable found = find_label_table(labels);
  EXPECT_TRUE(found.names.empty());  // not those of the file above
  expect_mentions(found.problem, {"l/dataset.json", "\"labels.renal\" is 2.5"});
  LabelsInput given;
  given.path = labels;
  given.choice.names = {"aorta"};
  expect_mentions(message_of([&] { read_labels(given); }),
                  {"labels.names[0] is \"aorta\"", "l/dataset.json", "\"labels.renal\" is 2.5"});
  given.choice = {.values = {1, 2}};
  const std::vector<std::string> remarks = read_labels(given).remarks;
  ASSERT_EQ(remarks.size(), 1U);
  expect_mentions(remarks[0], {"l/dataset.json", "\"labels.renal\" is 2.5"});
  fs::remove(folder_ / "l" / "dataset.json");
  EXPECT_EQ(find_label_table(labels).names.at(1), "other");
  EXPECT_TRUE(find_label_table(labels).problem.empty());
}

using LabelsCase = CaseFile;

TEST_F(LabelsCase, NamesEachMistakeWithItsRemedy) {
  write("labels.nii", "");
  const auto told = [&](const Json& labels) {
    Json json = labels_case();
    json["labels"] = labels;
    return problem(json);
  };
  expect_mentions(told({{"values", {1}}}), {"labels.path is missing"});
  expect_mentions(told({{"path", "none.nii"}}), {"labels.path is \"none.nii\"", "none.nii"});
  expect_mentions(
      told({{"path", "labels.nii"}, {"values", {1.5, 2, 2}}}),
      {"labels.values[0] is 1.5, expected a whole number", "labels.values[2] is 2 again"});
  expect_mentions(told({{"path", "labels.nii"}, {"names", {"a", "a", 3, "b/c"}}}),
                  {"labels.names[1] is \"a\" again", "labels.names[2] is 3", "labels.names[3]"});
  expect_mentions(told({{"path", "labels.nii"}, {"values", {1, 2}}, {"names", {"a"}}}),
                  {"labels.names is 1 names", "labels.values, which has 2"});
  expect_mentions(told({{"path", "labels.nii"}, {"table", "none.csv"}}),
                  {"labels.table is \"none.csv\"", "no such file"});
  Json json = labels_case();
  json["segmentation"] = {{"lower_hu", 100}, {"upper_hu", 200}};
  expect_mentions(problem(json), {"segmentation is given beside labels"});
  json = surface_case();
  json["labels"] = {{"path", "labels.nii"}};
  expect_mentions(problem(json), {"surface.path is given beside labels"});
  json = labels_case();
  json["target"] = {{"branch", "renal"}, {"beyond_ostium_mm", 5}};
  json.erase("labels");
  json["volume"] = {{"path", "ct.nrrd"}};
  expect_mentions(problem(json), {"target.branch is \"renal\", expected labels in the case"});
}

TEST_F(LabelsCase, FindsPlacesByTheBranchTheyLieIn) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  write("tree.nii", preprocess::branched_labels());
  Json json = labels_case();
  json["labels"] = {{"path", "tree.nii"}, {"values", {1, 2}}, {"names", {"aorta", "renal"}}};
  json["access"] = {{"branch", "aorta"}, {"end", "inferior"}};
  json["target"] = {{"branch", "renal"}, {"beyond_ostium_mm", 10}};
  Case given = read(json);
  // The trunk's middle, its radius above the lower end; 10 mm beyond the wall, in the middle. Both
  // to the thickness of the layers whose middles are taken, 1.5 voxels.
  EXPECT_LT((given.accesses[0].point - Vec3(12, 12, 4.5)).norm(), 1.5)
      << given.accesses[0].point.transpose();
  EXPECT_LT((given.targets[0].point - Vec3(27, 12, 30)).norm(), 1.5)
      << given.targets[0].point.transpose();
  json["access"]["end"] = "superior";
  json["target"] = {{"branch", "renal"}, {"end", "distal"}};
  given = read(json);
  EXPECT_LT((given.accesses[0].point - Vec3(12, 12, 55)).norm(), 1.5);
  EXPECT_LT((given.targets[0].point - Vec3(37, 12, 30)).norm(), 1.5)
      << given.targets[0].point.transpose();

  const auto told = [&](const Json& target) {
    json["target"] = target;
    return problem(json);
  };
  expect_mentions(told({{"branch", "renl"}, {"end", "distal"}}),
                  {"target.branch is \"renl\"", "aorta, renal", "did you mean \"renal\"?"});
  json["friction"] = -1;
  expect_mentions(told({{"branch", "renl"}, {"end", "distal"}}),
                  {"target.branch is \"renl\"", "friction is -1"});
  json.erase("friction");
  expect_mentions(told({{"branch", "renal"}}), {"a place in it: beyond_ostium_mm, or end"});
  expect_mentions(told({{"branch", "renal"}, {"beyond_ostium_mm", 90}}),
                  {"target.beyond_ostium_mm is 90", "ends 21.5 mm", "beyond its ostium"});
  expect_mentions(told({{"branch", "renal"}, {"end", "inferior"}}), {"expected its distal end"});
  expect_mentions(told({{"branch", "aorta"}, {"beyond_ostium_mm", 3}}), {"is the trunk"});
  expect_mentions(told({{"branch", "renal"}, {"end", "distal"}, {"point_mm", {1, 2, 3}}}),
                  {"target.branch is given beside a point"});
}

}  // namespace
}  // namespace wireplan::pipeline
