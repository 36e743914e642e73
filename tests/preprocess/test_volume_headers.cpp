// Headers of NIfTI, NRRD and MetaImage that do not tell how large a voxel is or where it lies, or
// tell it twice.
#include <gtest/gtest.h>

#include "preprocess/volume/image.h"
#include "preprocess/volume/labels.h"
#include "tests/preprocess/image_file.h"
#include "tests/preprocess/nifti_bytes.h"

namespace wireplan::preprocess {
namespace {

class VolumeHeaders : public ImageFile {
 protected:
  void expect_refusal(const fs::path& path, const std::string& reason) const {
    const std::string error = read_error(path);
    EXPECT_TRUE(has(error, path.string() + ": " + reason) && !has(error, "damaged")) << error;
  }
};

// ---- NIfTI --------------------------------------------------------------------------------------

TEST_F(VolumeHeaders, NiftiWithoutPixdimIsRefusedUnlessItsSformTellsIt) {
  for (const float none : {0.0F, std::nanf("")}) {
    for (const std::array<std::int16_t, 2> codes :
         {std::array<std::int16_t, 2>{1, 0}, {0, 0}, {1, 1}}) {
      expect_refusal(write("a.nii", nifti({.codes = codes, .sides = {2, none, 4}})),
                     "its header lacks pixdim[2], which is ");
    }
    EXPECT_LT((read_image(write("s.nii", nifti({.sides = {none, none, none}}))).grid.spacing -
               Vec3(2, 3, 4))
                  .norm(),
              1e-6);
  }
}

TEST_F(VolumeHeaders, NiftiWhoseSformContradictsPixdimIsRefusedWithBoth) {
  expect_refusal(
      write("a.nii", nifti({.rows = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, .sides = {1, 1, 1.5F}})),
      "its sform has voxels of 1 mm along k, its pixdim[3] of 1.5 mm");
  // Rounded, it is the same.
  EXPECT_NEAR(read_image(write("b.nii", nifti({.sides = {2.01F, 2.99F, 4}}))).grid.spacing.x(), 2.0,
              1e-6);
}

TEST_F(VolumeHeaders, OfNoPlaceAreToldToBeTakenForUpright) {
  const std::string nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n";
  const std::string meta =
      "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\nElementSpacing = 1 1 1\n"
      "ElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh";
  for (const auto& [path, reason] : std::vector<std::pair<fs::path, std::string>>{
           {write("a.nii", nifti({.codes = {0, 0}})), "its qform_code and sform_code are 0"},
           {write("a.nrrd", nrrd + "spacings: 1 2 3\n\nabcdefgh"), "it has no space directions"},
           {write("b.nrrd", nrrd + "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n\n"
                                   "abcdefgh"),
            "has no space origin"},
           {write("c.nrrd", nrrd + "axis mins: 0 0 0\naxis maxs: 2 2 2\n\nabcdefgh"),
            "names no space"},
           {write("a.mha", meta), "it has no Offset"}}) {
    const std::vector<std::string> remarks = read_image(path).remarks;
    ASSERT_EQ(remarks.size(), 1U) << path;
    EXPECT_TRUE(has(remarks[0], reason)) << remarks[0];
  }
  // Of labels too.
  const LabelVolume labels =
      read_labels(write("l.nii", nifti({.codes = {0, 0}})), {.values = {1, 2}});
  ASSERT_EQ(labels.remarks.size(), 1U);
  EXPECT_TRUE(has(labels.remarks[0], "its qform_code and sform_code are 0"));
}

TEST_F(VolumeHeaders, NiftiNamesItsLabelsInAnExtension) {
  std::string text =
      "<CaretExtension><LabelTable><Label Key=\"0\"><![CDATA[???]]></Label>\n<Label Key=\"1\" "
      "Red=\"0.5\"><![CDATA[aorta]]></Label><Label Key=\"23\"><![CDATA[iliac left]]></Label>";
  text.resize(400);
  const fs::path file = write("l.nii", nifti({.extensions = text}));
  const LabelVolume read = read_labels(file, {.names = {"iliac left", "aorta"}});
  EXPECT_EQ(read.classes[0].value, 23);
  EXPECT_EQ(read.classes[1].value, 1);
  // Over what lies beside it, but not over a table that the case names.
  EXPECT_EQ(read_labels(file, {.names = {"aorta"}, .table = {{2, "aorta"}}}).classes[0].value, 1);
  EXPECT_EQ(read_labels(file, {.names = {"aorta"}, .table = {{2, "aorta"}}, .table_wins = true})
                .classes[0]
                .value,
            2);
  const std::size_t name = text.find("aorta");
  text[name] = '\xe8';
  EXPECT_TRUE(has(
      error_of([&] { read_labels(write("l.nii", nifti({.extensions = text})), {.values = {1}}); }),
      "the name of label 1 is no UTF-8"));
}

// ---- NRRD ---------------------------------------------------------------------------------------

/// Of 2 x 2 x 2 values, with these lines.
std::string nrrd_with(const std::string& lines) {
  return "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n" + lines +
         "\nabcdefgh";
}

TEST_F(VolumeHeaders, NrrdWithoutSpacingIsRefused) {
  expect_refusal(write("a.nrrd", nrrd_with("content: x\n")), "its header lacks space directions");
  const std::string one = read_error(write("b.nrrd", nrrd_with("spacings: 1 nan 1\n")));
  EXPECT_TRUE(has(one, "spacings (or axis mins and axis maxs) of axis j")) << one;
  expect_refusal(write("c.nrrd", nrrd_with("space: LPS\nspace origin: (1,2,3)\n")),
                 "its header has space, but no space directions");
  expect_refusal(write("d.nrrd", nrrd_with("space: right-anterior-superior\nspacings: 1 1 1.5\n"
                                           "space origin: (1,2,3)\n")),
                 "its header has space and spacings, but no space directions");
}

TEST_F(VolumeHeaders, NrrdIsPlacedByTheEndsOfItsAxes) {
  // Of two voxels: nodes lie at both ends, cells half a voxel from them.
  for (const auto& [lines, spacing, origin] : std::vector<std::tuple<std::string, Vec3, Vec3>>{
           {"centers: node node node\n", Vec3(10, 20, 3), Vec3(-5, 0, 7)},
           {"centerings: cell cell cell\n", Vec3(5, 10, 1.5), Vec3(-2.5, 5, 7.75)},
           {"", Vec3(5, 10, 1.5), Vec3(-2.5, 5, 7.75)},
           {"spacings: 5 10 1.5\n", Vec3(5, 10, 1.5), Vec3(-2.5, 5, 7.75)}}) {
    const Grid grid =
        read_image(write("a.nrrd", nrrd_with("axis mins: -5 0 7\naxismaxs: 5 20 10\n" + lines)))
            .grid;
    EXPECT_EQ(grid.spacing, spacing) << lines;
    EXPECT_EQ(grid.origin, origin) << lines;
    EXPECT_EQ(grid.direction, Mat3::Identity());
  }
  const Grid back = read_image(write("b.nrrd", nrrd_with("axis mins: 10 0 0\naxis maxs: 0 2 2\n"
                                                         "centers: node node node\n")))
                        .grid;
  EXPECT_EQ(back.lps_from_ijk(Vec3(1, 0, 0)), Vec3(0, 0, 0));
  expect_refusal(
      write("c.nrrd", nrrd_with("spacings: 1 1 1\naxis mins: 0 0 0\naxis maxs: 2 2 3\n")),
      "its spacings tell voxels of 1 along k, its axis mins and axis maxs of 1.5");
}

// ---- MetaImage ----------------------------------------------------------------------------------

std::string meta_with(const std::string& lines) {
  return "ObjectType = Image\nNDims = 3\n" + lines +
         "DimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh";
}

TEST_F(VolumeHeaders, MetaImageWithoutSpacingIsRefusedAndOfOtherLettersRead) {
  expect_refusal(write("a.mha", meta_with("Offset = 1 2 3\n")), "its header lacks ElementSpacing");
  const Grid grid = read_image(write("b.mha",
                                     "objecttype = Image\nNDIMS = 3\noffset = 4 5 6\n"
                                     "elementspacing = 1 2 3\ndimsize = 2 2 2\n"
                                     "elementtype = MET_UCHAR\nid = of nobody\n"
                                     "elementdatafile = LOCAL\nabcdefgh"))
                        .grid;
  EXPECT_EQ(grid.spacing, Vec3(1, 2, 3));
  EXPECT_EQ(grid.origin, Vec3(4, 5, 6));
  EXPECT_EQ(
      read_image(write("c.mha", meta_with("Offset = 1 2 3\nElementSize = 1 2 3\n"))).grid.spacing,
      Vec3(1, 2, 3));
  const std::string words = read_error(write("d.mha", meta_with("orientation = axial\n")));
  EXPECT_TRUE(has(words, "its Orientation is no text of 9 numbers")) << words;
}

TEST_F(VolumeHeaders, MetaImageOfTwoPlacesIsRefusedWithBoth) {
  const std::string spacing = "ElementSpacing = 1 2 3\n";
  expect_refusal(write("a.mha", meta_with(spacing + "Offset = 0 0 0\nPosition = -30 -20 -50\n")),
                 "its Offset is 0 0 0, its Position is -30 -20 -50, expected the same by both");
  expect_refusal(write("b.mha", meta_with(spacing + "TransformMatrix = 1 0 0 0 1 0 0 0 1\n"
                                                    "Orientation = -1 0 0 0 1 0 0 0 1\n")),
                 "its TransformMatrix is ");
  EXPECT_EQ(read_image(write("c.mha", meta_with(spacing + "Offset = 1 2 3\nOrigin = 1.0 2 3\n")))
                .grid.origin,
            Vec3(1, 2, 3));
}

// ---- all ----------------------------------------------------------------------------------------

TEST_F(VolumeHeaders, OfNoPatientsSizeAreRefusedWithTheKeyOfTheUnit) {
  expect_refusal(write("m.nii", nifti({.units = 1})),
                 "it is 4.0 x 9.0 x 16.0 m across by its xyzt_units (m), pixdim and sform");
  expect_refusal(write("um.nii", nifti({.units = 3})),
                 "it is 0.004 x 0.009 x 0.016 mm across by its xyzt_units (um)");
  expect_refusal(write("m.nrrd", nrrd_with("space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,2)\n"
                                           "space origin: (0,0,0)\n"
                                           "space units: \"m\" \"m\" \"m\"\n")),
                 "it is 2.0 x 2.0 x 4.0 m across by its space units and space directions");
  expect_refusal(write("mixed.nrrd", nrrd_with("spacings: 1 1 2\nunits: \"cm\" \"cm\" \"mm\"\n")),
                 "units is \"cm\" \"cm\" \"mm\", expected one of \"mm\", \"cm\", \"m\", \"um\", in "
                 "quotes, and the "
                 "same one for each of the three axes");
  expect_refusal(write("um.nrrd", nrrd_with("spacings: 1 1 2\nunits: \"um\" \"um\" \"um\"\n")),
                 "it is 0.002 x 0.002 x 0.004 mm across by its units and spacings");
  expect_refusal(write("um.mha", meta_with("ElementSpacing = 1 2 3\nDistanceUnits = um\n")),
                 "it is 0.002 x 0.004 x 0.006 mm across by its DistanceUnits and ElementSpacing");
}

TEST_F(VolumeHeaders, OfFilesThatAreNoneAreRefusedWithWhatToDo) {
  for (const char* name : {"a.hdr", "a.img", "a.img.gz"}) {
    expect_refusal(write(name, "x"), "one of a pair of files (.hdr and .img");
  }
  for (const char* name : {"a.nrrd.gz", "a.MHA.gz"}) {
    expect_refusal(write(name, "x"), "packed by gzip as a whole");
  }
}

}  // namespace
}  // namespace wireplan::preprocess
