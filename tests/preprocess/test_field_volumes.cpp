// Volumes as scanners, archives and programs write them, beside what the standards' first pages
// say.
#include <gtest/gtest.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <sstream>

#include "preprocess/volume/image.h"
#include "preprocess/volume/voxels.h"
#include "tests/preprocess/image_file.h"
#include "tests/preprocess/nifti_bytes.h"

namespace wireplan::preprocess {
namespace {

/// The same bytes in gzip members of so many bytes each.
std::string gzip(const std::string& bytes, std::size_t member) {
  std::string packed;
  for (std::size_t at = 0; at < bytes.size(); at += member) {
    std::string part(bytes.size() + 100, '\0');
    z_stream stream{};
    deflateInit2(&stream, 6, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
    std::string input = bytes.substr(at, member);
    stream.next_in = reinterpret_cast<unsigned char*>(input.data());
    stream.avail_in = static_cast<unsigned>(input.size());
    stream.next_out = reinterpret_cast<unsigned char*>(part.data());
    stream.avail_out = static_cast<unsigned>(part.size());
    EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    packed += part.substr(0, stream.total_out);
    deflateEnd(&stream);
  }
  return packed;
}

class FieldVolume : public ImageFile {};

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// ---- NIfTI --------------------------------------------------------------------------------------

TEST_F(FieldVolume, NiftiUnitsScaleSpacingAndPlace) {
  const Image mm = read_image(write("mm.nii", nifti({})));
  for (const auto& [code, factor] : {std::pair(char{1}, 1000.0F), std::pair(char{3}, 1e-3F)}) {
    NiftiHeader header{.units = code};
    for (float& number : header.rows) number /= factor;
    for (float& side : header.sides) side /= factor;
    const Image image = read_image(write("other.nii", nifti(header)));
    EXPECT_LT((image.grid.spacing - mm.grid.spacing).norm(), 1e-6);  // floats
    EXPECT_LT((image.grid.origin - mm.grid.origin).norm(), 1e-4);
    EXPECT_EQ(image.values, mm.values);
  }
  EXPECT_TRUE(has(read_error(write("odd.nii", nifti({.units = 7}))), "spatial unit has code 7"));
}

TEST_F(FieldVolume, NiftiOfARoundingShearIsReadAndOfALargerOneRefusedWithTheAngle) {
  std::array<float, 12> rows = NiftiHeader{}.rows;
  rows[1] = 3e-3F;  // of 3 mm along j: 1e-3
  EXPECT_EQ(read_image(write("small.nii", nifti({.rows = rows}))).values.size(), 24U);
  rows[1] = 1.0F;
  const std::string error = read_error(write("large.nii", nifti({.rows = rows})));
  EXPECT_TRUE(has(error, "large.nii") && has(error, "sheared by 18.4 degrees")) << error;
}

TEST_F(FieldVolume, NiftiGoesByItsQformWhereItHasNoOther) {
  // Half a turn about z, as RAS (-, -, +).
  const Image image =
      read_image(write("q.nii", nifti({.codes = {1, 0}, .quaternion = {0, 0, 1, 10, 20, 30}})));
  EXPECT_LT((image.grid.lps_from_ijk(Vec3(1, 2, 3)) - Vec3(-10 + 2, -20 + 6, 30 + 12)).norm(),
            1e-5);
}

TEST_F(FieldVolume, NiftiWhoseTwoFormsDifferIsRefusedAndWhoseFormsAgreeIsRead) {
  const std::array<float, 12> rows = {-2, 0, 0, 70, 0, -3, 0, -40, 0, 0, 4, 500};
  NiftiHeader header{.codes = {1, 1}, .quaternion = {0, 0, 1, 70, -40, 500}, .rows = rows};
  EXPECT_EQ(read_image(write("same.nii", nifti(header))).values.size(), 24U);
  EXPECT_TRUE(read_image(folder_ / "same.nii").remarks.empty());
  header.quaternion[3] = 70.2F;
  const std::vector<std::string> told = read_image(write("near.nii", nifti(header))).remarks;
  ASSERT_EQ(told.size(), 1U);
  EXPECT_TRUE(has(told[0], "place a corner 0.2 mm apart") && has(told[0], "the sform counts"));
  header.quaternion[3] = 75.0F;
  const std::string error = read_error(write("other.nii", nifti(header)));
  EXPECT_TRUE(has(error, "5.0 mm apart") && has(error, "qform and sform")) << error;
}

TEST_F(FieldVolume, NiftiOfAnEmptySformGoesByItsQform) {
  NiftiHeader header{.codes = {1, 1}, .quaternion = {0, 0, 1, 10, 20, 30}, .rows = {}};
  const Image image = read_image(write("q.nii", nifti(header)));
  EXPECT_LT((image.grid.lps_from_ijk(Vec3(1, 2, 3)) - Vec3(-10 + 2, -20 + 6, 30 + 12)).norm(),
            1e-5);
  header.codes = {0, 1};
  const std::string error = read_error(write("none.nii", nifti(header)));
  EXPECT_TRUE(has(error, "none.nii: its sform holds zeros") && !has(error, "damaged")) << error;
}

TEST_F(FieldVolume, NiftiOfASlopeThatIsNoNumberHasNone) {
  const float none = std::nanf("");
  const Image plain = read_image(write("plain.nii", nifti({})));
  for (const float slope : {none, HUGE_VALF, -HUGE_VALF, 0.0F}) {
    EXPECT_EQ(read_image(write("s.nii", nifti({.slope = slope, .intercept = none}))).values,
              plain.values);
  }
  const std::string error =
      read_error(write("inter.nii", nifti({.slope = 2.0F, .intercept = none})));
  EXPECT_TRUE(has(error, "scl_inter is no number") && !has(error, "damaged")) << error;
}

TEST_F(FieldVolume, NiftiIsReadBesideATwinOfTheOtherExtension) {
  const std::string wanted = nifti({.slope = 2.0F});
  write("ct.nii", nifti({}));
  const Image image = read_image(write("ct.nii.gz", gzip(wanted, wanted.size())));
  EXPECT_EQ(image.values[5], 10.0F);
  EXPECT_EQ(read_image(folder_ / "ct.nii").values[5], 5.0F);
}

TEST_F(FieldVolume, NiftiInSeveralMembersIsWholeAndWithoutItsLastByteIsNot) {
  const std::string packed = gzip(nifti({}), 100);
  EXPECT_EQ(read_image(write("members.nii.gz", packed)).values[23], 23.0F);
  EXPECT_TRUE(
      has(read_error(write("cut.nii.gz", packed.substr(0, packed.size() - 1))), "cut short"));
}

TEST_F(FieldVolume, NiftiThatPromisesMoreThanAFileCanHoldTakesNoMemoryForIt) {
  std::string bytes = nifti({});
  const std::array<std::int16_t, 4> dim = {3, 700, 700, 700};
  std::memcpy(bytes.data() + 40, dim.data(), sizeof dim);
  EXPECT_TRUE(has(read_error(write("huge.nii", bytes)), "cut short"));
}

TEST_F(FieldVolume, NiftiOfTheOtherOrderOfBytesAndOfTheSecondVersionAreRead) {
  const std::string first = nifti({.slope = 2.0F, .intercept = 1.0F});
  const Image expected = read_image(write("first.nii", first));

  std::string swapped = first;  // by the sizes of the header's fields that matter
  const auto swap = [&](std::size_t at, std::size_t size, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
      std::reverse(swapped.begin() + static_cast<std::ptrdiff_t>(at + k * size),
                   swapped.begin() + static_cast<std::ptrdiff_t>(at + (k + 1) * size));
    }
  };
  swap(0, 4, 1);
  swap(40, 2, 8);
  swap(70, 2, 2);
  swap(76, 4, 8);
  swap(108, 4, 3);
  swap(252, 2, 2);
  swap(256, 4, 18);
  swap(352, 2, 24);
  const Image big_endian = read_image(write("swapped.nii", swapped));
  EXPECT_EQ(big_endian.values, expected.values);
  EXPECT_EQ(big_endian.grid.origin, expected.grid.origin);

  std::string second(544, '\0');  // offsets of nifti2.h
  const auto put = [&](std::size_t at, auto value) {
    std::memcpy(second.data() + at, &value, sizeof value);
  };
  put(0, std::int32_t{540});
  put(4, std::array<char, 8>{'n', '+', '2', '\0', '\r', '\n', '\032', '\n'});
  put(12, std::int16_t{4});
  put(16, std::array<std::int64_t, 8>{3, 2, 3, 4, 1, 1, 1, 1});
  put(104, std::array<double, 8>{1, 2, 3, 4, 1, 1, 1, 1});
  put(168, std::int64_t{544});
  put(176, std::array<double, 2>{2.0, 1.0});
  put(348, std::int32_t{1});
  put(400, std::array<double, 12>{-2, 0, 0, 70, 0, 3, 0, -40, 0, 0, 4, 500});
  put(500, std::int32_t{2});
  const Image wide = read_image(write("second.nii", second + first.substr(352)));
  EXPECT_EQ(wide.values, expected.values);
  EXPECT_EQ(wide.grid.spacing, expected.grid.spacing);
  EXPECT_EQ(wide.grid.origin, expected.grid.origin);
}

// ---- NRRD and MetaImage -------------------------------------------------------------------------

TEST_F(FieldVolume, NrrdUnitsAreHonouredAndAnUnknownPackingNamed) {
  const auto nrrd = [](const std::string& more, const std::string& encoding) {
    return "NRRD0004\ntype: uint8\ndimension: 3\nspace: LPS\nsizes: 2 2 2\n"
           "space directions: (0.1,0,0) (0,0.2,0) (0,0,0.3)\nspace origin: (1,2,3)\nencoding: " +
           encoding + "\n" + more + "\nabcdefgh";
  };
  const Image image =
      read_image(write("cm.nrrd", nrrd("space units: \"cm\" \"cm\" \"cm\"\n", "raw")));
  EXPECT_LT((image.grid.spacing - Vec3(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((image.grid.origin - Vec3(10, 20, 30)).norm(), 1e-12);
  const std::string mixed =
      read_error(write("mixed.nrrd", nrrd("space units: \"cm\" \"mm\" \"cm\"\n", "raw")));
  EXPECT_TRUE(has(mixed, "mixed.nrrd: space units is \"cm\" \"mm\" \"cm\"")) << mixed;
  const std::string packed = read_error(write("b.nrrd", nrrd("", "bzip2")));
  EXPECT_TRUE(has(packed, "packed with \"bzip2\"") && !has(packed, "damaged")) << packed;
}

/// An NRRD of 2 x 2 x 2 values, "abcdefgh", of these lines of placement.
std::string nrrd_placed(const std::string& lines, int axes = 3) {
  return "NRRD0005\ntype: uint8\ndimension: " + std::to_string(axes) + "\n" + lines +
         "sizes: 2 2 2" + (axes == 4 ? " 1" : "") + "\nencoding: raw\n\nabcdefgh";
}

TEST_F(FieldVolume, NrrdIsPlacedByItsSpaceOrRefusedByName) {
  // One place in LPS, told in each space: x and y are negated where they run to the other side.
  const auto told = [](const std::string& space, const Vec3& signs, bool time) {
    const auto vector = [&](double x, double y, double z, int t) {
      std::ostringstream text;
      text << "(" << signs.x() * x << "," << signs.y() * y << "," << z;
      if (time) text << "," << t;
      text << ")";
      return text.str();
    };
    return "space: " + space + "\nspace directions: " + vector(0, 2, 0, 0) + " " +
           vector(3, 0, 0, 0) + " " + vector(0, 0, -4, 0) + (time ? " " + vector(0, 0, 0, 1) : "") +
           "\nspace origin: " + vector(10, 20, 30, 0) + "\n";
  };
  const Vec3 lps(1, 1, 1), ras(-1, -1, 1), las(1, -1, 1);
  for (const auto& [space, signs] :
       std::vector<std::pair<std::string, Vec3>>{{"left-posterior-superior", lps},
                                                 {"LPS", lps},
                                                 {"right-anterior-superior", ras},
                                                 {"RAS", ras},
                                                 {"Left-Anterior-Superior", las},
                                                 {"LAS", las},
                                                 {"left-posterior-superior-time", lps},
                                                 {"LPST", lps},
                                                 {"right-anterior-superior-time", ras},
                                                 {"RAST", ras},
                                                 {"left-anterior-superior-time", las},
                                                 {"LAST", las}}) {
    SCOPED_TRACE(space);
    const bool time = space.ends_with("-time") || space.size() == 4;
    const Image image =
        read_image(write("placed.nrrd", nrrd_placed(told(space, signs, time), time ? 4 : 3)));
    EXPECT_LT((image.grid.lps_from_ijk(Vec3(0, 0, 0)) - Vec3(10, 20, 30)).norm(), 1e-12);
    EXPECT_LT((image.grid.lps_from_ijk(Vec3(1, 1, 1)) - Vec3(13, 22, 26)).norm(), 1e-12);
    EXPECT_EQ(image.values[7], static_cast<float>('h'));
  }
  for (const char* space : {"scanner-xyz", "3D-left-handed", "3D-right-handed"}) {
    const std::string error = read_error(write("other.nrrd", nrrd_placed(told(space, lps, false))));
    EXPECT_TRUE(has(error, "other.nrrd: its space is " + lower(space)) &&
                has(error, "LPS, RAS, LAS"))
        << error;
  }
  const std::string nowhere = read_error(
      write("dim.nrrd", nrrd_placed("space dimension: 3\nspace directions: (1,0,0) (0,1,0) "
                                    "(0,0,1)\nspace origin: (1,2,3)\n")));
  EXPECT_TRUE(has(nowhere, "dim.nrrd: it has space directions, but its space is not named"))
      << nowhere;
  const std::string first = read_error(
      write("time.nrrd",
            "NRRD0005\ntype: uint8\ndimension: 4\nspace: LPST\nsizes: 1 2 2 2\nencoding: raw\n"
            "space directions: (0,0,0,1) (1,0,0,0) (0,1,0,0) (0,0,1,0)\n\nabcdefgh"));
  EXPECT_TRUE(has(first, "expected the first three axes")) << first;
}

TEST_F(FieldVolume, NrrdUnitsOfAnyAxisAndSpellingAreHonoured) {
  const auto directions_of = [](double unit) {
    std::ostringstream text;
    text << "space: LPS\nspace directions: (" << unit << ",0,0) (0," << 2 * unit << ",0) (0,0,"
         << 3 * unit << ")\nspace origin: (" << unit << "," << 2 * unit << "," << 3 * unit << ")\n";
    return text.str();
  };
  const std::string directions = directions_of(1.0);
  for (const auto& [unit, mm] : std::vector<std::pair<std::string, double>>{{"mm", 1},
                                                                            {"Millimeters", 1},
                                                                            {"millimetres", 1},
                                                                            {"cm", 10},
                                                                            {"centimeters", 10},
                                                                            {"m", 1000},
                                                                            {"meters", 1000},
                                                                            {"metre", 1000},
                                                                            {"um", 1e-3},
                                                                            {"microns", 1e-3},
                                                                            {"micrometers", 1e-3},
                                                                            {"\xc2\xb5m", 1e-3},
                                                                            {"\xce\xbcm", 1e-3}}) {
    SCOPED_TRACE(unit);
    const std::string three = "\"" + unit + "\" \"" + unit + "\" \"" + unit + "\"";
    const Image image = read_image(
        write("unit.nrrd", nrrd_placed(directions_of(1.0 / mm) + "space units: " + three + "\n")));
    EXPECT_LT((image.grid.spacing - Vec3(1, 2, 3)).norm(), 1e-12);
    EXPECT_LT((image.grid.origin - Vec3(1, 2, 3)).norm(), 1e-12);
    std::ostringstream spacings;
    spacings << "spacings: " << 1.0 / mm << " " << 2.0 / mm << " " << 3.0 / mm;
    const Image beside =
        read_image(write("beside.nrrd", nrrd_placed(spacings.str() + "\nunits: " + three + "\n")));
    EXPECT_LT((beside.grid.spacing - Vec3(1, 2, 3)).norm(), 1e-12);
  }
  const std::string time =
      "space: left-posterior-superior-time\nspace directions: (1,0,0,0) (0,1,0,0) (0,0,1,0) "
      "(0,0,0,1)\nspace origin: (1,2,3,0)\nspace units: \"cm\" \"cm\" \"cm\" \"s\"\n";
  EXPECT_EQ(read_image(write("time.nrrd", nrrd_placed(time, 4))).grid.spacing, Vec3(10, 10, 10));
  for (const char* units : {"\"inch\" \"inch\" \"inch\"", "\"mm\" \"mm\"", "mm mm mm"}) {
    const std::string error =
        read_error(write("odd.nrrd", nrrd_placed(directions + "space units: " + units + "\n")));
    EXPECT_TRUE(has(error, std::string("odd.nrrd: space units is ") + units)) << error;
  }
}

TEST_F(FieldVolume, NrrdWithoutEndianIsToldAndWithoutItsLastEmptyLineRead) {
  const std::string head =
      "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 1\nencoding: raw\n";
  const std::string error = read_error(write("order.nrrd", head + "\n" + std::string(16, 'a')));
  EXPECT_TRUE(has(error, "order.nrrd: endian is missing, expected little or big")) << error;
  write("beside.raw", std::string("\1\0\2\0\3\0\4\0\5\0\6\0\7\0\10\0", 16));
  EXPECT_EQ(
      read_image(write("beside.nhdr", head + "endian: little\ndata file: beside.raw\n")).values[7],
      8.0F);
}

TEST_F(FieldVolume, MetaImageMayHoldAnyTextAndItsUnitsAreHonoured) {
  const auto meta = [](const std::string& more) {
    return "ObjectType = Image\nNDims = 3\n" + more +
           "DimSize = 2 2 2\nElementSpacing = 1 2 3\nOffset = 4 5 6\nElementType = MET_UCHAR\n"
           "ElementDataFile = LOCAL\nabcdefgh";
  };
  for (const std::string& text :
       {std::string("Comment = J\xc3\xbcrgen, \xe5\xb7\xa6\n"),
        "Reason = " + std::string(5000, 'x') + "\n", std::string("\xc3\xbc = 1\n")}) {
    const Image image = read_image(write("text.mha", meta(text)));
    EXPECT_EQ(image.values[7], static_cast<float>('h'));
    EXPECT_EQ(image.grid.spacing, Vec3(1, 2, 3));
  }
  const Image cm = read_image(write("cm.mha", meta("DistanceUnits = cm\n")));
  EXPECT_EQ(cm.grid.spacing, Vec3(10, 20, 30));
  EXPECT_EQ(cm.grid.origin, Vec3(40, 50, 60));
  EXPECT_TRUE(
      has(read_error(write("ft.mha", meta("DistanceUnits = ft\n"))), "DistanceUnits is ft"));
}

TEST_F(FieldVolume, MetaImageMayHoldLinesThatAreNoKeysAndNameAnyFile) {
  const auto meta = [](const std::string& more, const std::string& file) {
    return more + "ObjectType = Image\n" + more + "NDims = 3\nDimSize\t=  2 2 2 \n" + more +
           "ElementSpacing = 1 2 3\r\nOffset = 4 5 6\nElementType = MET_UCHAR\n" + more +
           "ElementDataFile = " + file + "\n";
  };
  for (const char* more : {"", "a line of text\n", "My Key = 5\n", "\n", "   \n", "# a comment\n",
                           "# two = 2\n", "= 3\n", "Comment: hello\n", "\xef\xbb\xbf"}) {
    SCOPED_TRACE(more);
    const Image image = read_image(write("text.mha", meta(more, "LOCAL") + "abcdefgh"));
    EXPECT_EQ(image.values[7], static_cast<float>('h'));
    EXPECT_EQ(image.grid.spacing, Vec3(1, 2, 3));
    EXPECT_EQ(image.grid.origin, Vec3(4, 5, 6));
  }
  const std::string deep(120, 'd'), inside = deep + "/" + std::string(130, 'e') + ".raw";
  fs::create_directories(folder_ / deep);
  for (const std::string& file :
       {std::string("gr\xc3\xb6\xc3\x9f"
                    "e 1.raw"),
        std::string("\xe4\xbd\x93\xe6\x95\xb0.raw"), std::string("two  blanks.raw"), inside}) {
    SCOPED_TRACE(file);
    write(file, "abcdefgh");
    const Image image = read_image(write("beside.mhd", meta("", file)));
    EXPECT_EQ(image.values[7], static_cast<float>('h'));
    EXPECT_EQ(image.grid.spacing, Vec3(1, 2, 3));
  }
  // Keys and the file's ending in letters of another case.
  write("in.raw", "abcdefgh");
  const std::string small =
      "objecttype = Image\nndims = 3\ndimsize = 2 2 2\nelementspacing = 1 2 "
      "3\noffset = 4 5 6\nelementtype = MET_UCHAR\nelementdatafile = in.raw\n";
  for (const auto& [name, text] :
       {std::pair("small.mhd", small), std::pair("LARGE.MHD", meta("", "in.raw")),
        std::pair("data.mhd", "NDims = 3\n" + small.substr(small.find("dimsize")))}) {
    SCOPED_TRACE(name);
    EXPECT_EQ(read_image(write(name, text)).values[7], static_cast<float>('h'));
  }
  // The dimensions may be told behind what has as many numbers; no key twice.
  const std::string late =
      "ObjectType = Image\nDimSize = 2 2 2\nElementSpacing = 1 2 3\nNDims = 3\nElementType = "
      "MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh";
  EXPECT_EQ(read_image(write("late.mha", late)).grid.spacing, Vec3(1, 2, 3));
  const std::string twice = read_error(write("twice.mha", "NDims = 3\n" + late));
  EXPECT_TRUE(has(twice, "twice.mha: its header has two lines of NDims")) << twice;
}

TEST_F(FieldVolume, MetaImageTellsItsModality) {
  for (const auto& [told, modality] :
       {std::pair("Modality = MET_MOD_MR\n", "MR"), std::pair("Modality = MET_MOD_CT\n", "CT"),
        std::pair("Modality = MET_MOD_UNKNOWN\n", ""), std::pair("", "")}) {
    const Image image = read_image(
        write("told.mha", std::string("ObjectType = Image\nNDims = 3\n") + told +
                              "DimSize = 2 2 2\nElementSpacing = 1 2 3\nOffset = 4 5 6\n"
                              "ElementType = MET_UCHAR\nElementDataFile = LOCAL\nabcdefgh"));
    EXPECT_EQ(image.modality, modality) << told;
  }
}

// ---- Voxels between thick slices ----------------------------------------------------------------

TEST(ThickSlices, ABallBetweenTwoHoldsTheVoxelsThatItTouches) {
  const Grid grid{.size = {9, 9, 4}, .spacing = Vec3(1, 1, 5)};
  const std::vector<std::size_t> between = voxels_in_ball(grid, Vec3(4, 4, 7.5), 1.0);
  ASSERT_EQ(between.size(), 2U * 9U);
  for (const std::size_t n : between) {
    const Voxel v = voxel_at(grid, n);
    EXPECT_TRUE(v[2] == 1 || v[2] == 2);
    EXPECT_LE(std::max(std::abs(v[0] - 4), std::abs(v[1] - 4)), 1);
  }
  EXPECT_EQ(voxels_in_ball(grid, Vec3(4, 4, 5), 1.0).size(), 5U);  // a slice's own
  EXPECT_TRUE(voxels_in_ball(grid, Vec3(4, 4, 30), 1.0).empty());
}

}  // namespace
}  // namespace wireplan::preprocess
