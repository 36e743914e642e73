// `wireplan inspect`: what a file or folder holds, as text and JSON, and never whose it is.
#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/report/inspect.h"
#include "preprocess/volume/image.h"
#include "tests/dicom.h"
#include "tests/messages.h"
#include "tests/pipeline/program.h"
#include "tests/preprocess/label_bytes.h"
#include "tests/preprocess/nifti_bytes.h"
#include "tests/shapes.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;
using dicom_files::DicomSlice;

class Inspect : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& bytes) {
    fs::create_directories((folder_ / name).parent_path());
    write_text(bytes, folder_ / name);
    return folder_ / name;
  }

  /// Slices 2 mm apart, each in a file of its own.
  void write_series(const std::string& folder, DicomSlice slice, int count) {
    for (int k = 0; k < count; ++k) {
      slice.position.z() = 2.0 * k;
      slice.first_value = static_cast<std::int16_t>(10 * k);
      write(folder + "/" + slice.number + "-" + std::to_string(k), dicom_files::dicom(slice));
    }
  }

  static void expect_nobody(const std::string& text) {
    ASSERT_FALSE(text.empty());
    for (const std::string& word : dicom_files::kPatient) {
      EXPECT_FALSE(holds(text, word)) << word << " in " << text;
    }
  }

  TemporaryFolder folder_;
};

/// NRRD of 8 bit labels, 4 x 3 x 2 voxels of 10 mm, 12 voxels of 1 and 4 of 2 after 8 of 0.
std::string label_nrrd(const std::string& more, const std::string& sizes = "4 3 2") {
  return "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: " +
         sizes +
         "\nspace directions: (10,0,0) (0,10,0) (0,0,10)\nkinds: domain domain domain\n"
         "encoding: raw\nspace origin: (0,0,0)\n" +
         more + "\n" + std::string(8, '\0') + std::string(12, '\1') + std::string(4, '\2');
}

TEST_F(Inspect, ASeriesIsToldByItsNumberSlicesAndPacking) {
  DicomSlice slice;
  slice.description = "Thorax 1.0 B30f";
  write_series("ct", slice, 6);
  const Json told = inspect(folder_ / "ct");
  EXPECT_EQ(told["kind"], "dicom");
  EXPECT_FALSE(told.contains("refused"));
  ASSERT_EQ(told["series"].size(), 1U);
  const Json& series = told["series"][0];
  EXPECT_EQ(series["number"], "3");
  EXPECT_EQ(series["description"], "Thorax 1.0 B30f");
  EXPECT_EQ(series["modality"], "CT");
  EXPECT_EQ(series["images"], 6);
  EXPECT_EQ(series["slice_spacing_mm"], 2.0);
  EXPECT_EQ(series["pixel_spacing_mm"], Json::parse("[0.6, 0.8]"));
  EXPECT_EQ(series["transfer_syntax"]["uid"], "1.2.840.10008.1.2.1");
  EXPECT_EQ(series["transfer_syntax"]["name"], "Explicit VR Little Endian");
  EXPECT_TRUE(series["read"].get<bool>());
  EXPECT_EQ(told["volume"]["size"], Json::parse("[3, 2, 6]"));
  EXPECT_EQ(told["volume"]["axes"], "LPS");
  EXPECT_EQ(told["volume"]["values"], Json::parse("[0, 55]"));
  const std::string text = inspect_text(told);
  EXPECT_TRUE(holds(text, "series 3 \"Thorax 1.0 B30f\", CT: the one that wireplan reads")) << text;
  EXPECT_TRUE(holds(text, "axial slices from feet to head")) << text;
  EXPECT_TRUE(holds(text, "0 to 55 HU")) << text;
}

TEST_F(Inspect, OfSeveralSeriesTheOneThatIsReadIsTold) {
  write_series("two", {}, 6);
  write_series("two", {.series = "1.2.3.5", .number = "1", .compressed = true}, 1);
  const Json told = inspect(folder_ / "two");
  ASSERT_EQ(told["series"].size(), 2U);
  const Json& scout = told["series"][0];
  EXPECT_EQ(scout["number"], "1");
  EXPECT_FALSE(scout["read"].get<bool>());
  EXPECT_TRUE(scout["slice_spacing_mm"].is_null());
  EXPECT_TRUE(holds(scout["problem"], "one DICOM slice"));
  EXPECT_EQ(scout["transfer_syntax"]["uid"], "1.2.840.10008.1.2.5");
  EXPECT_TRUE(told["series"][1]["read"].get<bool>());

  // with two of a volume's shape none is read
  write_series("two", {.series = "1.2.3.6", .number = "4"}, 7);
  const Json refused = inspect(folder_ / "two");
  ASSERT_EQ(refused["series"].size(), 3U);
  for (const Json& series : refused["series"]) EXPECT_FALSE(series["read"].get<bool>());
  EXPECT_TRUE(holds(refused["refused"], "3 DICOM series, expected one"));
}

TEST_F(Inspect, NobodyIsNamed) {
  const std::vector<std::string> telling = {
      "Thorax LOVELACE", "thorax augusta 2", "PATIENT-4711 arch",   "CT 21.03.1954",
      "from 2026-01-15", "ACC 0815",         "Analytical protocol", "run 15/01/26",
      "15 Jan 2026",     "CTA 21-Mar-54",    "Jan 15, 2026",        "CTA A.L. 1.5",
      "L. A. thorax"};
  for (std::size_t k = 0; k < telling.size(); ++k) {
    DicomSlice slice{.series = "1.2.3." + std::to_string(10 + k), .number = std::to_string(k)};
    slice.description = telling[k];
    write_series("ct", slice, 6);
  }
  const Json told = inspect(folder_ / "ct");
  ASSERT_EQ(told["series"].size(), telling.size());
  for (const Json& series : told["series"]) EXPECT_TRUE(series["description"].is_null()) << series;
  EXPECT_TRUE(told.contains("refused"));  // which lists the series too
  expect_nobody(inspect_text(told));
  expect_nobody(told.dump());

  // and by the program, with its log
  for (const char* arguments : {"inspect ct", "inspect ct --json", "inspect ct/0-0"}) {
    const Answer answer = run_program(folder_.path(), arguments);
    EXPECT_EQ(answer.code, holds(arguments, "0-0") ? 2 : 0) << answer.log;
    expect_nobody(answer.out + answer.log);
  }
}

TEST_F(Inspect, NobodyIsNamedByClassesOrTheirTables) {
  const std::string header =
      "DICOM.PatientName:=LOVELACE^AUGUSTA\n# Patient ID: PATIENT-4711\n"
      "Segment0_LabelValue:=1\nSegment0_Name:=aorta 1954-03-21\n"
      "Segment1_LabelValue:=2\nSegment1_Name:=Augusta renal\n";
  write("l.seg.nrrd", label_nrrd(header));
  write("t.nrrd", label_nrrd(""));
  write("t.csv", "# Patient name: Lovelace, Augusta\n1,aorta 19540321\n2,renal LOVELACE\n");
  write("j.nrrd", label_nrrd(""));
  write("j.json", R"({"patient_name": "LOVELACE^AUGUSTA",
                      "labels": {"aorta 21.03.1954": 1, "LOVELACE^AUGUSTA": 2}})");
  write("b.nrrd", label_nrrd(""));
  write("b.json", R"({"labels": {"aorta": 1}, "LOVELACE^AUGUSTA": {"PATIENT-4711": [1954}})");
  for (const char* name : {"l.seg.nrrd", "t.nrrd", "j.nrrd", "b.nrrd"}) {
    const Json told = inspect(folder_ / name);
    EXPECT_EQ(told["kind"], "labels");
    expect_nobody(told.dump());
    expect_nobody(inspect_text(told));
    EXPECT_TRUE(told["labels"][1]["name"].is_null() || told["labels"][1]["name"] == "") << told;
    const bool named = told["labels"][0]["name"] == "aorta";
    EXPECT_EQ(named, std::string(name) != "b.nrrd") << told;
  }
}

TEST_F(Inspect, ANumberThatMayBeADateAndNamesOfFilesAreNotShown) {
  write_series("ct", {.number = "19540321"}, 6);  // in the names of its files too
  const Json whole = inspect(folder_ / "ct");
  EXPECT_TRUE(whole["series"][0]["number"].is_null());
  const std::string key = whole["series"][0]["key"];
  EXPECT_TRUE(holds(inspect_text(whole), "series without number (\"" + key + "\" in a case)"));
  EXPECT_EQ(preprocess::read_image(folder_ / "ct", key).grid.size[2], 6);
  expect_nobody(inspect_text(whole));

  const std::string slice = dicom_files::dicom({});
  write("ct/19540321-2", slice.substr(0, slice.size() - 3));
  const Json cut = inspect(folder_ / "ct");
  EXPECT_TRUE(holds(cut["refused"], "file 3 of 6: a DICOM file that is damaged")) << cut;
  expect_nobody(inspect_text(cut));
  expect_nobody(cut["refused"]);
}

TEST_F(Inspect, FilesOfSeveralFramesAreNotSaidToBeRead) {
  for (const char* name : {"frames/a", "frames/b"}) {
    std::string bytes = dicom_files::dicom({});
    std::string frames;
    dicom_files::element(frames, 0x28, 0x08, "IS", "2");
    const std::size_t rows = bytes.find(std::string("\x28\0\x10\0US", 6));
    ASSERT_NE(rows, std::string::npos);
    bytes.insert(rows, frames);
    const std::size_t pixels = bytes.rfind(std::string("\xe0\x7f\x10\0OW", 6));
    bytes[pixels + 8] = 24;  // bytes
    write(name, bytes + bytes.substr(bytes.size() - 12));
  }
  const Json told = inspect(folder_ / "frames");
  EXPECT_FALSE(told["series"][0]["read"].get<bool>());
  EXPECT_TRUE(holds(told["series"][0]["problem"], "2 files of 2 frames each")) << told;
  EXPECT_TRUE(holds(told["refused"], "2 files of 2 frames each")) << told;
}

TEST_F(Inspect, ADamagedFileEndsNotWhatIsToldOfTheOthers) {
  write_series("ct", {}, 6);
  const std::string whole = dicom_files::dicom({});
  write("ct/9", whole.substr(0, whole.size() - 3));
  const Json told = inspect(folder_ / "ct");
  EXPECT_EQ(told["series"][0]["images"], 6);
  EXPECT_TRUE(holds(told["refused"], "damaged or cut short"));
}

TEST_F(Inspect, OneDicomFileIsToldAndRefused) {
  const Json told = inspect(write("slice", dicom_files::dicom({})));
  ASSERT_EQ(told["series"].size(), 1U);
  EXPECT_FALSE(told["series"][0]["read"].get<bool>());
  EXPECT_TRUE(holds(told["refused"], "a single DICOM file"));
}

TEST_F(Inspect, UnitsOfANiftiAreTold) {
  preprocess::NiftiHeader header;
  header.units = 3;
  for (std::size_t k = 0; k < 12; ++k) header.rows[k] *= 1e3F;
  header.sides = {2e3F, 3e3F, 4e3F};
  const Json told = inspect(write("ct.nii", preprocess::nifti(header)));
  EXPECT_EQ(told["format"], "NIfTI-1");
  EXPECT_EQ(told["kind"], "image");
  EXPECT_EQ(told["header"]["length_unit"], "um");
  EXPECT_EQ(told["header"]["mm_per_unit"], 1e-3);
  EXPECT_EQ(told["header"]["stored_as"], "int16");
  EXPECT_EQ(told["header"]["placed_by"], "sform");
  EXPECT_NEAR(told["volume"]["spacing_mm"][2].get<double>(), 4.0, 1e-6);  // float in the file
  EXPECT_EQ(told["volume"]["values"], Json::parse("[0, 23]"));
  const std::string text = inspect_text(told);
  EXPECT_TRUE(holds(text, "lengths in um, made mm by 0.001; placed by its sform")) << text;
}

TEST_F(Inspect, WhatACaseRefusesIsToldAsFarAsItsHeaderGoes) {
  preprocess::NiftiHeader sheared;
  sheared.rows[1] = 2.0F;
  const Json told = inspect(write("ct.nii", preprocess::nifti(sheared)));
  EXPECT_EQ(told["volume"]["size"], Json::parse("[2, 3, 4]"));
  EXPECT_TRUE(holds(told["refused"], "sheared by")) << told;
  EXPECT_TRUE(holds(inspect_text(told), "a case refuses it: the axes of the image"));

  const Json cut = inspect(write("cut.nii", preprocess::nifti({}).substr(0, 360)));
  EXPECT_TRUE(holds(cut["refused"], "damaged or cut short")) << cut;
  EXPECT_EQ(cut["volume"]["size"], Json::parse("[2, 3, 4]"));
}

TEST_F(Inspect, LabelsAreToldWithNamesAndVolumes) {
  const Json told = inspect(write("l.seg.nrrd", label_nrrd("Segment0_LabelValue:=1\n"
                                                           "Segment0_Layer:=0\n"
                                                           "Segment0_Name:=Aorta, left: upper\n"
                                                           "Segment1_LabelValue:=7\n"
                                                           "Segment1_Name:=empty\n")));
  EXPECT_EQ(told["kind"], "labels");
  ASSERT_EQ(told["labels"].size(), 3U) << told;
  EXPECT_EQ(told["labels"][0]["name"], "Aorta, left: upper");
  EXPECT_EQ(told["labels"][0]["voxels"], 12);
  EXPECT_NEAR(told["labels"][0]["volume_ml"].get<double>(), 12.0, 1e-9);
  EXPECT_TRUE(told["labels"][1]["name"].is_null());
  EXPECT_EQ(told["labels"][1]["voxels"], 4);
  EXPECT_EQ(told["labels"][2]["name"], "empty");
  EXPECT_EQ(told["labels"][2]["voxels"], 0);
}

TEST_F(Inspect, LayersAndFoldersOfLabelsAreToldWithNamesAndVolumes) {
  const preprocess::Grid grid{.size = {4, 3, 2}, .spacing = Vec3(10, 10, 10)};
  std::vector<std::uint8_t> one(24, 0), other(24, 0);
  std::fill(one.begin(), one.begin() + 12, std::uint8_t{1});
  std::fill(other.begin() + 6, other.begin() + 9, std::uint8_t{1});
  const Json layers = inspect(
      write("layers.seg.nrrd",
            preprocess::label_nrrd(grid, {one, other}, {{"aorta", 1, 0}, {"left renal", 1, 1}})));
  EXPECT_EQ(layers["kind"], "labels");
  ASSERT_EQ(layers["labels"].size(), 2U) << layers;
  EXPECT_EQ(
      layers["labels"][1],
      Json(
          {{"value", 1}, {"name", "left renal"}, {"voxels", 3}, {"volume_ml", 3.0}, {"layer", 1}}));
  EXPECT_TRUE(holds(inspect_text(layers), "1 in layer 1")) << inspect_text(layers);

  fs::create_directory(folder_ / "classes");
  write("classes/aorta.nii", preprocess::label_nifti(grid, one));
  write("classes/liver.nii", preprocess::label_nifti(grid, std::vector<std::uint8_t>(24, 0)));
  write("classes/ct.nii", preprocess::label_nifti(grid, std::vector<float>(24, -1000.0F)));
  const Json folder = inspect(folder_ / "classes");
  EXPECT_EQ(folder["kind"], "labels");
  EXPECT_EQ(folder["other_volumes"], 1);
  ASSERT_EQ(folder["labels"].size(), 2U) << folder;
  EXPECT_EQ(folder["labels"][0]["name"], "aorta");
  EXPECT_EQ(folder["labels"][0]["volume_ml"], 12.0);
  EXPECT_EQ(folder["labels"][1]["voxels"], 0);
  EXPECT_TRUE(holds(inspect_text(folder), "folder of labels, one file per class"));
  fs::create_directory(folder_ / "shown");
  write_json(layers, folder_ / "shown/layers.json");
  write_json(folder, folder_ / "shown/folder.json");
  expect_follows_schemas(folder_ / "shown");
}

TEST_F(Inspect, NrrdAndMetaImageAreToldWithTheirUnits) {
  const Json nrrd = inspect(write("l.nrrd", label_nrrd("space units: \"cm\" \"cm\" \"cm\"\n")));
  EXPECT_EQ(nrrd["header"]["length_unit"], "cm");
  EXPECT_EQ(nrrd["volume"]["spacing_mm"], Json::parse("[100, 100, 100]"));
  std::string packed = label_nrrd("");
  packed.replace(packed.find("raw"), 3, "bzip2");
  const Json refused = inspect(write("b.nrrd", packed));
  EXPECT_EQ(refused["volume"]["size"], Json::parse("[4, 3, 2]"));
  EXPECT_TRUE(holds(refused["refused"], "bzip2"));

  const Json meta = inspect(
      write("ct.mha",
            "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
            "TransformMatrix = 0 1 0 0 0 -1 -1 0 0\nOffset = 1 2 3\nElementSpacing = 1 1 2\n"
            "DistanceUnits = cm\nDimSize = 2 2 2\nElementType = MET_UCHAR\n"
            "ElementDataFile = LOCAL\n" +
                std::string("\x01\x05\x02\x60\x03\x07\x04\x08", 8)));
  EXPECT_EQ(meta["format"], "MetaImage");
  EXPECT_EQ(meta["kind"], "image");
  EXPECT_EQ(meta["header"]["length_unit"], "cm");
  EXPECT_EQ(meta["volume"]["spacing_mm"], Json::parse("[10, 10, 20]"));
  EXPECT_TRUE(holds(meta["volume"]["orientation"], "sagittal")) << meta;
}

TEST_F(Inspect, WhatAPersonShouldKnowOfHowItIsReadIsTold) {
  preprocess::NiftiHeader nowhere;
  nowhere.codes = {0, 0};
  const Json told = inspect(write("ct.nii", preprocess::nifti(nowhere)));
  ASSERT_EQ(told["remarks"].size(), 1U);
  EXPECT_TRUE(holds(told["remarks"][0], "its qform_code and sform_code are 0")) << told;
  EXPECT_TRUE(holds(inspect_text(told), "note         its header does not tell where it lies"));

  write("seg.csv", "name,value\naorta,one\n");
  const preprocess::Grid grid{.size = {4, 3, 2}, .spacing = Vec3(10, 10, 10)};
  std::vector<std::uint8_t> one(24, 0);
  one[3] = 1;
  const Json labels = inspect(write("seg.nii", preprocess::label_nifti(grid, one)));
  ASSERT_EQ(labels["remarks"].size(), 1U) << labels;
  EXPECT_TRUE(holds(labels["remarks"][0], "seg.csv: line 2 has no value and name"));

  const std::string latin = label_nrrd("Segment0_LabelValue:=1\nSegment0_Name:=Art\xe8re Doe\n");
  const Json refused = inspect(write("l.seg.nrrd", latin));
  EXPECT_TRUE(holds(refused["refused"], "its Segment0_Name is no UTF-8")) << refused;
  EXPECT_FALSE(holds(inspect_text(refused), "Doe"));
  EXPECT_TRUE(
      holds(message_of([&] { inspect(write("pair.hdr", "x")); }), "one of a pair of files"));
  EXPECT_TRUE(holds(message_of([&] { inspect(write("l.nrrd.gz", "x")); }), "packed by gzip"));

  fs::create_directory(folder_ / "shown");
  write_json(told, folder_ / "shown/told.json");
  write_json(labels, folder_ / "shown/labels.json");
  expect_follows_schemas(folder_ / "shown");
}

TEST_F(Inspect, ASurfaceIsToldInEveryUnit) {
  // a tube of radius 4 mm and length 60 mm in metres
  Surface tube = shapes::straight_tube(4.0, 60.0, 1.0);
  tube.vertices *= 1e-3;
  write_stl(tube, folder_ / "tube.stl");
  const Json told = inspect(folder_ / "tube.stl");
  const Json& surface = told["surface"];
  EXPECT_EQ(told["format"], "STL");
  EXPECT_EQ(surface["triangles"], tube.triangles.cols());
  EXPECT_EQ(surface["pieces"], 1);
  EXPECT_EQ(surface["closed_pieces"], 1);
  EXPECT_EQ(surface["fitting_units"], Json::parse(R"(["m"])"));
  EXPECT_TRUE(surface["frame"].is_null());
  EXPECT_EQ(surface["openings"].size(), 2U);
  EXPECT_NEAR(surface["openings"][0]["radius_mm"].get<double>(), 4.0, 0.4);  // its rim is wall
  const std::string text = inspect_text(told);
  EXPECT_TRUE(holds(text, "as m ")) << text;
  EXPECT_TRUE(holds(text, ": plausible for a vessel")) << text;

  Surface open = shapes::straight_tube(4.0, 60.0, 1.0);
  open.triangles.conservativeResize(Eigen::NoChange, open.triangles.cols() / 2);
  write_stl(open, folder_ / "open.stl");
  const Json half = inspect(folder_ / "open.stl");
  EXPECT_EQ(half["surface"]["closed_pieces"], 0);
}

TEST_F(Inspect, ASurfaceTooSmallForItsAreaHasNoRadius) {
  // 1e-82 squared and squared again is 0, so its area, but not its volume.
  const Json told = inspect(write("tiny.obj",
                                  "v 0 0 0\nv 1e-82 0 0\nv 0 1e-82 0\nv 0 0 1e-82\n"
                                  "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"));
  EXPECT_EQ(told["surface"]["closed_pieces"], 1);
  EXPECT_TRUE(told["surface"]["usual_radius"].is_null());
}

TEST_F(Inspect, WhatCannotBeToldIsOneErrorOfExitCodeTwo) {
  write("notes.txt", "no image");
  write("broken.nii.gz", "no image");
  write("broken.stl", "no surface");
  write("labels/a.nii.gz", "x");
  write("labels/b.nii.gz", "y");
  const std::vector<std::pair<std::string, std::string>> expected = {
      {"missing", "missing: no such file or folder; expected a folder of DICOM files"},
      {"notes.txt", "notes.txt: not a file that wireplan reads; expected a folder of DICOM files"},
      {"broken.nii.gz", "not a NIfTI image: it is text of another kind"},
      {"broken.stl", "broken.stl"},
      {"labels", "it holds other files that are read one by one: 2 .nii.gz"}};
  for (const auto& [name, words] : expected) {
    const Answer answer = run_program(folder_.path(), "inspect " + name);
    EXPECT_EQ(answer.code, 2) << name;
    EXPECT_EQ(answer.out, "");
    EXPECT_TRUE(holds(answer.log, words)) << answer.log;
  }
}

TEST_F(Inspect, WhatACaseRefusesIsToldFirstAndEndsWithTwo) {
  write("cut.nii", preprocess::nifti({}).substr(0, 360));
  write("ct.nii", preprocess::nifti({}));
  write_series("one", {}, 6);
  write("one/bad", dicom_files::dicom({}).substr(0, 400));
  write_series("two", {}, 6);
  write_series("two", {.series = "1.2.3.6", .number = "4"}, 6);
  for (const char* name : {"cut.nii", "one"}) {
    const Answer answer = run_program(folder_.path(), std::string("inspect ") + name);
    EXPECT_EQ(answer.code, 2) << answer.log;
    const std::size_t second = answer.out.find('\n') + 1;
    EXPECT_TRUE(answer.out.substr(second).starts_with("a case refuses it: ")) << answer.out;
    EXPECT_GT(std::count(answer.out.begin(), answer.out.end(), '\n'), 3) << answer.out;
  }
  EXPECT_EQ(run_program(folder_.path(), "inspect ct.nii").code, 0);
  // A choice that a case can make.
  const Answer several = run_program(folder_.path(), "inspect two");
  EXPECT_EQ(several.code, 0) << several.out;
  EXPECT_TRUE(holds(several.out, "as long as it names no series: 2 DICOM series")) << several.out;
}

TEST_F(Inspect, ItsJsonKeepsToTheSchema) {
  write_series("ct", {}, 6);
  write_series("ct", {.series = "1.2.3.5", .number = "1"}, 1);
  write("l.seg.nrrd", label_nrrd("Segment0_LabelValue:=1\nSegment0_Name:=aorta\n"));
  write("layers.seg.nrrd", label_nrrd("Segment0_Layer:=1\nSegment0_Name:=aorta\n", "4 3 9"));
  write("ct.nii", preprocess::nifti({}));
  write("cut.nii", preprocess::nifti({}).substr(0, 360));
  write_stl(shapes::straight_tube(4.0, 60.0, 1.0), folder_ / "tube.stl");
  fs::create_directory(folder_ / "told");
  for (const std::string name :
       {"ct", "ct/1-0", "l.seg.nrrd", "layers.seg.nrrd", "ct.nii", "cut.nii", "tube.stl"}) {
    const Json told = inspect(folder_ / name);
    write_json(told, folder_ / "told" / (fs::path(name).filename().string() + ".json"));
    EXPECT_FALSE(inspect_text(told).empty());
  }
  const Answer answer = run_program(folder_.path(), "inspect ct --json");
  ASSERT_EQ(answer.code, 0) << answer.log;
  EXPECT_EQ(Json::parse(answer.out)["schema"], kInspectSchema);
  expect_follows_schemas(folder_ / "told");
}

}  // namespace
}  // namespace wireplan::pipeline
