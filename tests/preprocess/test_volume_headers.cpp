// Headers of NIfTI, NRRD and MetaImage that do not tell how large a voxel is or where it lies, or
// tell it twice.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

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

/// With a value at a place, by the offsets of nifti1.h.
template <typename Value>
std::string with_value(std::string bytes, std::size_t at, Value value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  return bytes;
}

TEST_F(VolumeHeaders, NiftiFieldsThatNoVolumeHasAreNamedWithTheirValue) {
  const std::string sound = nifti({}), by_qform = nifti({.codes = {1, 0}});
  const float none = std::nanf(""), far = 1e9F;
  const auto size = [&](std::size_t axis, std::int16_t value) {
    return with_value(sound, 40 + 2 * axis, value);
  };
  for (const auto& [bytes, reason] : std::vector<std::pair<std::string, std::string>>{
           {size(0, 0), "its dim[0] is 0, expected a number of axes from 1 to 7"},
           {size(1, -8), "its dim[1] is -8, expected a number of voxels from 1"},
           {size(2, 0), "its dim[2] is 0"},
           {nifti({.dim = {5, 2, 3, 4, 1, 3, 1, 1}}), "3 values per voxel"},
           {nifti({.dim = {4, 2, 3, 1, 9, 1, 1, 1}}), "9 volumes of one slice each (4D)"},
           {with_value(sound, 344, '\0'), "its magic is \"+1\", expected \"n+1\" (a header"},
           {with_value(sound, 344, 0),
            "its magic is empty, expected \"n+1\" (a header "
            "without it is of Analyze"},
           {with_value(sound, 0, 0), "not a NIfTI image: its sizeof_hdr is 0, expected 348 or 540"},
           {with_value(sound, 280, none), "its srow_x[0] is nan, expected a number within a kilo"},
           {with_value(sound, 308, far), "its srow_y[3] is 1e+09, expected a number within a kilo"},
           {with_value(sound, 280, 0.0F),
            "its srow_x[0], srow_y[0] and srow_z[0] is a step of 0 along i"},
           {with_value(by_qform, 256, none), "its quatern_b is nan, expected a number"},
           {with_value(by_qform, 260, 3.0F),
            "its quatern_b, quatern_c and quatern_d is of the "
            "length 3, expected at most 1"},
           {with_value(by_qform, 272, far), "its qoffset_y is 1e+09"},
           {with_value(sound, 108, none), "its vox_offset is nan, expected a place in the file"},
           {with_value(sound, 108, 5000.0F),
            "its vox_offset is 5000.0, expected a place in the file, which has 400 bytes"},
           {with_value(sound, 70, std::int16_t{1536}),
            "its datatype is 1536 (float128), expected"}}) {
    expect_refusal(write("a.nii", bytes), reason);
  }
  const std::string few = read_error(write("few.nii", sound.substr(0, 390)));
  EXPECT_TRUE(has(few, "promises 48 bytes of voxels by its sizes and their type, but 38 bytes are"))
      << few;
}

TEST_F(VolumeHeaders, OfFilesOfOtherKindsTheKindIsTold) {
  for (const auto& [bytes, kind] : std::vector<std::pair<std::string, std::string>>{
           {"", "it is empty"},
           {"version https://git-lfs.github.com/spec/v1\n", "it is a pointer of Git LFS"},
           {"<!DOCTYPE html><html></html>", "it is a page of HTML or XML"},
           {"BZh91AY&SY\x01\x02", "it is packed by bzip2"},
           {std::string("PK\x03\x04\0\0", 6), "it is packed by zip"},
           {std::string(128, '\0') + "DICM", "it is a DICOM file"},
           {"something else\n", "it is text of another kind"}}) {
    for (const auto& [name, format] : {std::pair("a.nii", "NIfTI"), std::pair("a.nrrd", "NRRD"),
                                       std::pair("a.mha", "MetaImage")}) {
      expect_refusal(write(name, bytes), std::string("not a ") + format + " image: " + kind);
    }
  }
}

// ---- NRRD ---------------------------------------------------------------------------------------

TEST_F(VolumeHeaders, NrrdFieldsThatContradictOneAnotherAreNamedWithTheirValue) {
  const std::string sound =
      "NRRD0004\ntype: short\ndimension: 3\nspace: LPS\nsizes: 2 2 2\n"
      "space directions: (1,0,0) (0,1,0) (0,0,1)\nkinds: domain domain domain\nendian: little\n"
      "encoding: raw\nspace origin: (0,0,0)\n\n0123456789abcdef";
  EXPECT_EQ(read_image(write("sound.nrrd", sound)).grid.spacing, Vec3(1, 1, 1));
  const auto with = [&](const std::string& before, const std::string& after) {
    std::string bytes = sound;
    return bytes.replace(bytes.find(before), before.size(), after);
  };
  for (const auto& [bytes, reason] : std::vector<std::pair<std::string, std::string>>{
           {with("NRRD0004", "NRRD0009"), "its first line is NRRD0009, expected NRRD0001"},
           {with("type: short", "type: half"), "its type is half, expected one of integers"},
           {with("type: short\n", ""), "its header lacks type, expected type, dimension, sizes"},
           {with("dimension: 3", "dimension: 4"),
            "its sizes is 2 2 2, expected one for each of its 4"},
           {with("sizes: 2 2 2", "sizes: 2 0 2"),
            "its sizes (2 0 2) is 0, expected a number of vo"},
           {with("(0,0,1)\n", "\n"), "its space directions is (1,0,0) (0,1,0), expected a vector"},
           {with("(0,1,0)", "(0,x,0)"),
            "its space directions is (1,0,0) (0,x,0) (0,0,1), expected"},
           {with("(0,0,0)", "0 0 0"), "its space origin is 0 0 0, expected one place, as (a,b,c)"},
           {with("kinds: domain ", "kinds: "), "its kinds is domain domain, expected one for each"},
           {with("little", "middle"), "its endian is middle, expected little or big"},
           {with("encoding", "type: float\nencoding"), "line 9 of its header tells type again"},
           {with("kinds", "patient name: LOVELACE\nkinds"),
            "line 7 of its header is none that NRRD"}}) {
    const fs::path file = write("a.nrrd", bytes);
    expect_refusal(file, reason);
    EXPECT_FALSE(has(read_error(file), "LOVELACE"));
  }
}

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

TEST_F(VolumeHeaders, MetaImageKeysThatNoVolumeHasAreNamedWithTheirValue) {
  const std::string sound = meta_with("ElementSpacing = 1 2 3\nPatientName = LOVELACE\n");
  const auto with = [&](const std::string& before, const std::string& after) {
    std::string bytes = sound;
    return bytes.replace(bytes.find(before), before.size(), after);
  };
  const auto more = [&](const std::string& line) { return with("DimSize", line + "\nDimSize"); };
  for (const auto& [bytes, reason] : std::vector<std::pair<std::string, std::string>>{
           {with("NDims = 3\n", ""),
            "its header lacks NDims, expected NDims, DimSize, ElementType"},
           {with("ElementType = MET_UCHAR\n", ""), "its header lacks ElementType"},
           {with("NDims = 3", "NDims = 7"), "its NDims is 7, expected 3"},
           {with("MET_UCHAR", "MET_FOO"), "its ElementType is MET_FOO, expected MET_SHORT"},
           {with("2 2 2", "2 0 2"), "its DimSize is 0, expected a number of voxels from 1"},
           {with("2 2 2", "2 2.5 2"), "its DimSize is 2 2.5 2, expected whole numbers"},
           {with("1 2 3", "1 0 3"), "its ElementSpacing is 1 0 3, expected lengths of more than 0"},
           {more("BinaryData = maybe"), "its BinaryData is maybe, expected True or False"},
           {more("CompressedData = yes"), "its CompressedData is yes, expected True or False"},
           {more("BinaryData = True\nCompressedData = True"),
            "its CompressedData is True, expected False, as its voxels do not begin as zlib"},
           {more("ElementByteOrderMSB = True\nBinaryDataByteOrderMSB = False"),
            "its ElementByteOrderMSB is True, its BinaryDataByteOrderMSB is False"},
           {more("ElementNumberOfChannels = 3"), "3 values per voxel"},
           {more("TransformMatrix = 2 0 0 0 2 0 0 0 2"),
            "its TransformMatrix is of directions with the lengths (2, 2, 2), expected"},
           {more("HeaderSize = 99999"), "its HeaderSize is 99999, expected -1, or"},
           {with("LOCAL", ""), "its ElementDataFile is empty, expected LOCAL"}}) {
    const fs::path file = write("a.mha", bytes);
    expect_refusal(file, reason);
    EXPECT_FALSE(has(read_error(file), "LOVELACE"));
  }
  // As programs on Windows name it, and in small letters.
  fs::create_directory(folder_ / "sub");
  write("sub/a.raw", "abcdefgh");
  std::string beside = with("LOCAL\nabcdefgh", "sub\\a.raw\n");
  beside.replace(beside.find("MET_UCHAR"), 9, "met_uchar");
  EXPECT_EQ(read_image(write("a.mhd", beside)).values.front(), static_cast<float>('a'));
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
