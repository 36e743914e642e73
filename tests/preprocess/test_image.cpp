#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

#include "gdcmImageChangeTransferSyntax.h"
#include "gdcmImageReader.h"
#include "gdcmImageWriter.h"
#include "preprocess/volume/dicom_check.h"
#include "preprocess/volume/image.h"
#include "tests/dicom.h"
#include "tests/messages.h"
#include "tests/preprocess/image_file.h"
#include "tests/preprocess/nifti_bytes.h"

namespace wireplan::preprocess {
namespace {

using dicom_files::dicom;
using dicom_files::DicomSlice;

/// Values that tell every voxel from every other.
Image numbered_image(const Grid& grid) {
  Image image{.grid = grid, .values = std::vector<float>(grid.voxels())};
  for (std::size_t n = 0; n < image.values.size(); ++n) {
    image.values[n] = static_cast<float>(n) - 1000.0F;
  }
  return image;
}

void expect_same_grid(const Grid& grid, const Grid& expected, double tolerance) {
  EXPECT_EQ(grid.size, expected.size);
  EXPECT_LT((grid.spacing - expected.spacing).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT((grid.origin - expected.origin).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT((grid.direction - expected.direction).cwiseAbs().maxCoeff(), tolerance);
}

Mat3 oblique() { return Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix(); }

// ---- NRRD ---------------------------------------------------------------------------------------

TEST_F(ImageFile, NrrdRoundTripKeepsObliqueLeftHandedAndFlippedGrids) {
  const Mat3 flipped = Vec3(-1, -1, 1).asDiagonal(), mirrored = Vec3(1, 1, -1).asDiagonal();
  Mat3 permuted;
  permuted << 0, 0, 1, 1, 0, 0, 0, -1, 0;
  for (const Mat3& direction :
       {Mat3(Mat3::Identity()), oblique(), flipped, Mat3(oblique() * mirrored), permuted}) {
    SCOPED_TRACE(direction);
    const Image image = numbered_image({.size = {4, 3, 5},
                                        .spacing = Vec3(0.57, 0.8, 1.25),
                                        .origin = Vec3(-12.3, 45.6, -78.9),
                                        .direction = direction});
    write_image(image, folder_ / "image.nrrd");
    const Image back = read_image(folder_ / "image.nrrd");
    expect_same_grid(back.grid, image.grid, 1e-12);  // 17 digits are written
    EXPECT_EQ(back.values, image.values);
    EXPECT_TRUE(has(bytes_of(folder_ / "image.nrrd"), "space: left-posterior-superior"));
    EXPECT_TRUE(has(bytes_of(folder_ / "image.nrrd"), "encoding: gzip"));
  }
}

TEST_F(ImageFile, WrittenValuesAreRoundedAndKeptIn16Bits) {
  Image image = numbered_image({.size = {2, 2, 2}});
  image.values = {0.4F, 0.6F, -0.4F, -0.6F, 1e6F, -1e6F, 32767.0F, -32768.0F};
  write_image(image, folder_ / "image.nrrd");
  EXPECT_EQ(read_image(folder_ / "image.nrrd").values,
            (std::vector<float>{0, 1, 0, -1, 32767, -32768, 32767, -32768}));
}

TEST_F(ImageFile, MaskRoundTripAndItsBytesDependOnTheMaskAlone) {
  Mask mask{.grid = {.size = {7, 6, 5}, .spacing = Vec3(0.5, 0.6, 0.7), .direction = oblique()},
            .labels = std::vector<std::uint8_t>(210)};
  for (std::size_t n = 0; n < mask.labels.size(); ++n) {
    mask.labels[n] = n % 3 == 0;
  }
  write_mask(mask, folder_ / "a.nrrd");
  write_mask(mask, folder_ / "b.nrrd.part");  // the store writes beside and renames
  EXPECT_EQ(bytes_of(folder_ / "a.nrrd"), bytes_of(folder_ / "b.nrrd.part"));
  const Mask back = read_mask(folder_ / "a.nrrd");
  expect_same_grid(back.grid, mask.grid, 1e-12);
  EXPECT_EQ(back.labels, mask.labels);
}

TEST_F(ImageFile, MaskOfOtherValuesIsRefused) {
  write_image(numbered_image({.size = {3, 3, 3}}), folder_ / "image.nrrd");
  const std::string error = error_of([&] { read_mask(folder_ / "image.nrrd"); });
  EXPECT_TRUE(has(error, "image.nrrd") && has(error, "image of 0 and 1")) << error;
}

TEST_F(ImageFile, WritingIntoNoFolderIsAnErrorThatNamesThePath) {
  const fs::path path = folder_ / "absent" / "image.nrrd";
  const std::string error = error_of([&] {
    write_image(numbered_image({.size = {3, 3, 3}}), path);
  });
  EXPECT_TRUE(has(error, path.string()) && has(error, "cannot be written")) << error;
}

TEST_F(ImageFile, RasNrrdBecomesLps) {
  const std::string header =
      "NRRD0004\ntype: uchar\ndimension: 3\nspace: right-anterior-superior\nsizes: 2 2 2\n"
      "space directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (10,20,30)\nencoding: raw\n\n";
  const Image image = read_image(write("ras.nrrd", header + "abcdefgh"));
  EXPECT_LT((image.grid.lps_from_ijk(Vec3(1, 1, 1)) - Vec3(-12, -23, 34)).norm(), 1e-12);
}

TEST_F(ImageFile, ValuesThatAreNoNumbersAndColoursAreRefused) {
  const std::string geometry =
      "space directions: none (1,0,0) (0,1,0) (0,0,1)\nkinds: vector domain domain domain\n"
      "encoding: raw\n\n";
  const fs::path colour =
      write("colour.nrrd",
            "NRRD0004\ntype: uchar\ndimension: 4\nspace: left-posterior-superior\n"
            "sizes: 3 2 2 2\n" +
                geometry + std::string(24, 'a'));
  EXPECT_TRUE(has(read_error(colour), "3 values per voxel")) << read_error(colour);

  std::array<float, 8> values{};
  values[3] = std::numeric_limits<float>::quiet_NaN();
  const fs::path nan =
      write("nan.nrrd",
            "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 1\nendian: "
            "little\nencoding: raw\n\n" +
                std::string(reinterpret_cast<const char*>(values.data()), sizeof values));
  EXPECT_TRUE(has(read_error(nan), "1 voxels are not finite")) << read_error(nan);
}

TEST_F(ImageFile, ShearedGridIsRefused) {
  const fs::path path = write("sheared.nrrd",
                              "NRRD0004\ntype: uchar\ndimension: 3\nspace: "
                              "left-posterior-superior\nsizes: 2 2 2\nspace directions: (1,0,0) "
                              "(0.2,1,0) (0,0,1)\nencoding: raw\n\nabcdefgh");
  EXPECT_TRUE(has(read_error(path), "right angles")) << read_error(path);
}

// ---- MetaImage ----------------------------------------------------------------------------------

TEST_F(ImageFile, MetaImageHonoursTransformMatrixAndOffset) {
  const std::string header =
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
      "CompressedData = False\nTransformMatrix = -1 0 0 0 -1 0 0 0 1\nOffset = -150 -25 5\n"
      "ElementSpacing = 0.5 0.75 1.5\nDimSize = 2 3 2\nElementType = MET_UCHAR\n";
  const std::string voxels = "abcdefghijkl";
  const Image image = read_image(write("flip.mha", header + "ElementDataFile = LOCAL\n" + voxels));
  EXPECT_EQ(image.grid.size, (std::array<int, 3>{2, 3, 2}));
  EXPECT_LT((image.grid.lps_from_ijk(Vec3(1, 2, 1)) - Vec3(-150.5, -26.5, 6.5)).norm(), 1e-12);
  EXPECT_EQ(image.values[image.grid.index(1, 2, 1)], 'l');

  // the same with the voxels in a file of their own, and a scale in the header
  write("flip.raw", voxels);
  const Image scaled =
      read_image(write("flip.mhd", header + "ElementToIntensityFunctionSlope = 2\n"
                                            "ElementToIntensityFunctionOffset = -1000\n"
                                            "ElementDataFile = flip.raw\n"));
  EXPECT_EQ(scaled.values[0], 2.0F * 'a' - 1000.0F);
}

// ---- NIfTI --------------------------------------------------------------------------------------

TEST_F(ImageFile, AMetaImageWhoseHeaderBreaksOffIsRefusedBeforeItsLibraryReadsIt) {
  const std::string head = "ObjectType = Image\nNDims = 3\n";
  const std::string tail =
      "ElementSpacing = 1 1 1\nDimSize = 2 2 2\nElementType = MET_CHAR\nElementDataFile = LOCAL\n"
      "12345678";
  read_image(write("sound.mha", head + tail));
  for (const std::string middle : {"Offset = \xff 0 0\n", "Offset = 1 2\n", "NDims = 3\n"}) {
    EXPECT_TRUE(has(read_error(write("broken.mha", head + middle + tail)), "broken.mha: "));
  }
  for (const std::string dimensions : {"= 0", "= -1", "= 9", "= many", ""}) {
    const std::string broken = "ObjectType = Image\nNDims " + dimensions + "\n" + tail;
    EXPECT_TRUE(has(read_error(write("broken.mha", broken)), "broken.mha: "));
  }
}

TEST_F(ImageFile, NiftiIsScaledAndTurnedFromRasToLps) {
  const Image image =
      read_image(write("scaled.nii", nifti({.slope = 2.0F, .intercept = -1000.0F})));
  EXPECT_EQ(image.grid.size, (std::array<int, 3>{2, 3, 4}));
  for (std::size_t n = 0; n < image.values.size(); ++n) {
    EXPECT_EQ(image.values[n], 2.0F * static_cast<float>(n) - 1000.0F);
  }
  // voxel (1, 2, 3) is RAS (68, -34, 512); floats of the header carry 7 digits
  EXPECT_LT((image.grid.lps_from_ijk(Vec3(1, 2, 3)) - Vec3(-68, 34, 512)).norm(), 1e-4);
}

TEST_F(ImageFile, NiftiWhoseTransformIsNoNumberIsRefusedBeforeItsLibraryReadsIt) {
  std::string bytes = nifti({});
  bytes.replace(280, 4, "\xff\xff\xff\xff");  // a NaN in the first row
  EXPECT_TRUE(has(read_error(write("nan.nii", bytes)), "nan.nii: its srow_x[0] is "));
}

TEST_F(ImageFile, NiftiWithoutItsMarkOrWithPlacesBeyondAnyRoomIsRefusedAtOnce) {
  std::string bytes = nifti({});
  bytes[344] = '\0';  // Analyze, which promises no voxels
  EXPECT_TRUE(has(read_error(write("mark.nii", bytes)), "mark.nii: its magic is "));
  for (const float place : {2e8F, 1e30F}) {
    std::array<float, 12> rows = NiftiHeader{}.rows;
    rows[1] = place;
    EXPECT_TRUE(
        has(read_error(write("far.nii", nifti({.rows = rows}))), "far.nii: its srow_x[1] is "));
  }
}

TEST_F(ImageFile, NiftiSlopeOfZeroMeansUnscaled) {
  const Image image = read_image(write("plain.nii", nifti({.slope = 0.0F, .intercept = 7.0F})));
  EXPECT_EQ(image.values[5], 5.0F);
}

TEST_F(ImageFile, FourDimensionsAreReadOnlyWithOneVolume) {
  EXPECT_EQ(read_image(write("one.nii", nifti({.dim = {4, 2, 3, 4, 1, 1, 1, 1}}))).values.size(),
            24U);
  const std::string error = read_error(write("two.nii", nifti({.dim = {4, 2, 3, 4, 2, 1, 1, 1}})));
  EXPECT_TRUE(has(error, "two.nii") && has(error, "2 volumes (4D)")) << error;
}

TEST_F(ImageFile, SingleSliceIsRefused) {
  const std::string error = read_error(write("flat.nii", nifti({.dim = {2, 2, 3, 1, 1, 1, 1, 1}})));
  EXPECT_TRUE(has(error, "2 x 3 x 1 voxels")) << error;
}

// ---- DICOM --------------------------------------------------------------------------------------

class DicomFolder : public ImageFile {
 protected:
  /// Writes slices at the places [mm] along the normal, under names in another order.
  void write_series(const std::vector<double>& places, DicomSlice slice = {}) {
    const Vec3 origin = slice.position;
    for (std::size_t n = 0; n < places.size(); ++n) {
      slice.position = origin + places[n] * slice.direction.col(2);
      slice.first_value = static_cast<std::int16_t>(10 * n);
      write(slice.number + "_" + std::to_string((n * 7 + 3) % 11), dicom(slice));
    }
  }
};

TEST_F(DicomFolder, SlicesAreSortedByPositionAndRescaled) {
  write_series(
      {0.0, 1.5, 3.0, 4.5, 6.0},
      {.position = Vec3(-10, 20, -30), .direction = oblique(), .slope = 2.0, .intercept = -1000.0});
  write("notes.txt", "not an image");
  const Image image = read_image(folder_);
  // ten digits in the header
  expect_same_grid(image.grid,
                   {.size = {3, 2, 5},
                    .spacing = Vec3(0.6, 0.8, 1.5),
                    .origin = Vec3(-10, 20, -30),
                    .direction = oblique()},
                   1e-8);
  for (int k = 0; k < 5; ++k) {
    EXPECT_EQ(image.values[image.grid.index(0, 0, k)], 2.0F * 10.0F * static_cast<float>(k) - 1000);
    EXPECT_EQ(image.values[image.grid.index(2, 1, k)],
              2.0F * (10.0F * static_cast<float>(k) + 5) - 1000);
  }
}

TEST_F(DicomFolder, EachSliceIsRescaledByItsOwnHeader) {
  write("b",
        dicom({.position = Vec3(0, 0, 2), .slope = 3.0, .intercept = -5.5, .first_value = 10}));
  write("a", dicom({.position = Vec3(0, 0, 4), .first_value = 20}));
  const Image image = read_image(folder_);
  EXPECT_EQ(image.grid.origin, Vec3(0, 0, 2));
  EXPECT_EQ(image.values[0], 24.5F);
  EXPECT_EQ(image.values[6], 20.0F);
}

TEST_F(DicomFolder, PositionsRoundedByTheScannerAreAccepted) {
  for (const double step : {0.4, 0.5, 0.625, 0.75, 1.25}) {  // written with one decimal
    std::vector<double> places;
    for (int k = 0; k < 11; ++k) places.push_back(std::round(10.0 * step * k) / 10.0);
    write_series(places);
    EXPECT_NEAR(read_image(folder_).grid.spacing[2], step, 0.011);
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    places.erase(places.begin() + 4);
    write_series(places);
    EXPECT_TRUE(has(read_error(folder_), "uneven slices")) << step << read_error(folder_);
  }
}

TEST_F(DicomFolder, MissingSliceIsAnErrorWithItsPlaceAndWithoutThePatient) {
  write_series({0.0, 1.5, 3.0, 6.0, 7.5, 9.0});
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "the ones at 3 and 6 mm along the normal are 3 mm apart")) << error;
  EXPECT_TRUE(has(error, "the others 1.5 mm")) << error;
  EXPECT_FALSE(has(error, "LOVELACE")) << error;
}

TEST_F(DicomFolder, TwoPhasesInOneSeriesAreAnError) {
  write_series({0.0, 0.0, 1.5, 1.5, 3.0, 3.0});
  EXPECT_TRUE(has(read_error(folder_), "images lie at the same place")) << read_error(folder_);
}

TEST_F(DicomFolder, SeveralSeriesAreListedByNumberOfSlices) {
  write_series({0.0, 1.5}, {.series = "1.2.3.1", .number = "1"});
  write_series({0.0, 1.5, 3.0}, {.series = "1.2.3.2", .number = "2"});
  const std::string error = read_error(folder_);
  EXPECT_TRUE(
      has(error,
          "2 DICOM series, expected one: number 2 has 3 images of 3 x 2 pixels of 0.6 x 0.8 mm, "
          "1.5 mm apart; number 1 has 2 images"))
      << error;
  EXPECT_FALSE(has(error, "LOVELACE") || has(error, "1.2.3.")) << error;
}

TEST_F(DicomFolder, ASeriesThatLostASliceIsNotPassedOverForAnother) {
  write_series({0.0, 1.5, 3.0, 4.5, 6.0, 7.5}, {.series = "1.2.3.2", .number = "2"});
  write_series({0.0, 0.0, 0.0, 0.0, 0.0}, {.series = "1.2.3.3", .number = "3"});
  EXPECT_EQ(read_image(folder_).grid.size[2], 6) << "beside contrast tracking";
  write_series({0.0, 1.5, 3.0, 6.0, 7.5, 9.0}, {.series = "1.2.3.1", .number = "1"});
  std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "3 DICOM series, expected one")) << error;
  EXPECT_TRUE(has(error,
                  "number 1 has 6 images of 3 x 2 pixels of 0.6 x 0.8 mm, which are no even "
                  "stack"))
      << error;
  EXPECT_TRUE(has(message_of([&] { read_image(folder_, "1"); }), "uneven slices"));
  EXPECT_EQ(read_image(folder_, "2").grid.size[2], 6);
  // Nor is one of which each image is there twice.
  write_series({0.0, 0.0, 1.5, 1.5, 3.0, 3.0, 4.5, 4.5, 6.0, 6.0},
               {.series = "1.2.3.1", .number = "1"});
  error = read_error(folder_);
  EXPECT_TRUE(has(error, "3 DICOM series, expected one")) << error;
}

TEST_F(DicomFolder, ASeriesIsChosenByNumberOrDescription) {
  write_series({0.0, 1.5}, {.series = "1.2.3.1", .number = "1", .description = "portal"});
  write_series({0.0, 1.5, 3.0}, {.series = "1.2.3.2", .number = "2", .description = "arterial"});
  EXPECT_EQ(read_image(folder_, "1").grid.size[2], 2);
  EXPECT_EQ(read_image(folder_, "arterial").grid.size[2], 3);
  const std::string error = message_of([&] { read_image(folder_, "3"); });
  EXPECT_TRUE(has(error, "2 DICOM series, expected one of the number or description \"3\":"))
      << error;
  EXPECT_TRUE(has(error, "number 2 (arterial) has 3 images")) << error;
  write_image({.grid = {.size = {2, 2, 2}}, .values = std::vector<float>(8)}, folder_ / "a.nrrd");
  EXPECT_TRUE(has(message_of([&] { read_image(folder_ / "a.nrrd", "1"); }),
                  "expected a folder of DICOM files; a file holds one volume"));
}

TEST_F(DicomFolder, TiltedGantryIsAnError) {
  for (int n = 0; n < 5; ++n) {
    write(std::to_string(n), dicom({.position = Vec3(0, 0.5 * n, 1.5 * n)}));
  }
  EXPECT_TRUE(has(read_error(folder_), "tilted gantry")) << read_error(folder_);
}

TEST_F(DicomFolder, SliceCutShortIsAnErrorThatNamesIt) {
  for (const bool compressed : {false, true}) {
    SCOPED_TRACE(compressed);
    const std::string whole =
        dicom({.position = Vec3(0, 0, 1), .first_value = 300, .compressed = compressed});
    write("a", dicom({.position = Vec3(0, 0, 0)}));
    write("b", whole);
    EXPECT_EQ(read_image(folder_).values.back(), 305.0F);
    for (const std::size_t lost : {1, 6, 12}) {  // all 12 bytes of voxels, or of the compressed end
      SCOPED_TRACE(lost);
      const fs::path path = write("b", whole.substr(0, whole.size() - lost));
      const std::string error = read_error(folder_);
      EXPECT_TRUE(has(error, path.string()) && has(error, "cut short")) << error;
      EXPECT_FALSE(has(error, "LOVELACE")) << error;
    }
  }
}

/// Packs the pixels of a file anew.
void pack(const fs::path& path, gdcm::TransferSyntax::TSType syntax) {
  gdcm::ImageReader reader;
  reader.SetFileName(path.c_str());
  ASSERT_TRUE(reader.Read());
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(syntax);
  change.SetInput(reader.GetImage());
  ASSERT_TRUE(change.Change());
  gdcm::ImageWriter writer;
  writer.SetFile(reader.GetFile());
  writer.SetImage(change.GetOutput());
  writer.SetFileName(path.c_str());
  ASSERT_TRUE(writer.Write());
}

TEST_F(DicomFolder, CompressedSlicesHoldTheSameValues) {
  // a slice of 24 x 16 pixels, smooth and with a step, below and above zero
  std::vector<std::int16_t> values;
  for (int n = 0; n < 24 * 16; ++n) {
    values.push_back(static_cast<std::int16_t>(n % 24 < 12 ? 5 * n - 1000 : 300 - n));
  }
  using gdcm::TransferSyntax;
  for (const TransferSyntax::TSType syntax :
       {TransferSyntax::RLELossless, TransferSyntax::JPEGLosslessProcess14_1,
        TransferSyntax::JPEGLSLossless, TransferSyntax::JPEG2000Lossless}) {
    SCOPED_TRACE(TransferSyntax::GetTSString(syntax));
    for (const int k : {0, 1, 2}) {
      const fs::path path = write(
          "slice" + std::to_string(k),
          dicom({.position = Vec3(0, 0, 2.0 * k), .columns = 24, .rows = 16, .values = values}));
      pack(path, syntax);
    }
    const Image image = read_image(folder_);
    ASSERT_EQ(image.grid.size, (std::array<int, 3>{24, 16, 3}));
    for (std::size_t n = 0; n < image.values.size(); ++n) {
      ASSERT_EQ(image.values[n], values[n % values.size()]) << n;
    }
  }
}

TEST_F(DicomFolder, PixelsThatTheDecoderRefusesAreToldWithTheirPacking) {
  for (const int k : {0, 1, 2}) {
    const fs::path path = write("slice" + std::to_string(k),
                                dicom({.position = Vec3(0, 0, 2.0 * k),
                                       .columns = 24,
                                       .rows = 16,
                                       .values = std::vector<std::int16_t>(24 * 16, 7)}));
    pack(path, gdcm::TransferSyntax::JPEG2000Lossless);
    std::string bytes = bytes_of(path);
    const std::size_t tile =
        bytes.find("\xff\x90");  // start of tile: length, index, length of tile
    ASSERT_NE(tile, std::string::npos);
    bytes.replace(tile + 6, 4, "\x7f\xff\xff\xff");
    write("slice" + std::to_string(k), bytes);
  }
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "slice0: its pixels are packed as JPEG 2000")) << error;
  EXPECT_TRUE(has(error, "does not unpack them (\"Tile part length")) << error;
  EXPECT_TRUE(has(error, "): their bytes are damaged, or of a kind that it does not know"))
      << error;
}

TEST_F(DicomFolder, ASliceThatEndsTheProcessOfItsLibraryIsNamed) {
  write_series({0, 2, 4});
  std::string bytes = dicom({.position = Vec3(0, 0, 6), .first_value = 30});
  const std::size_t rows = bytes.find(std::string("\x28\0\x10\0US", 6));
  ASSERT_NE(rows, std::string::npos);
  bytes.replace(rows + 4, 2, "UL");  // well formed, but no number of rows
  const fs::path file = write("slice", bytes);
  ASSERT_EQ(check_dicom(file), DicomForm::kSound);
  EXPECT_EQ(read_error(folder_),
            file.string() +
                ": ends the library that reads DICOM: the file is damaged, or "
                "of a kind that GDCM does not expect; export the series again, "
                "uncompressed, or take the file out if it is no slice");
}

TEST_F(DicomFolder, SingleFileOrSliceAsksForTheSeries) {
  const fs::path file = write("IM0001", dicom({}));
  EXPECT_TRUE(has(read_error(file), "give the folder")) << read_error(file);
  EXPECT_TRUE(has(read_error(folder_), "one DICOM slice")) << read_error(folder_);
}

// ---- what is no image ---------------------------------------------------------------------------

TEST_F(ImageFile, MissingFileIsAnErrorThatNamesPathAndFormats) {
  const fs::path path = folder_ / "absent.nrrd";
  const std::string error = read_error(path);
  EXPECT_TRUE(has(error, path.string()) && has(error, "no such file")) << error;
  EXPECT_TRUE(has(error, "DICOM") && has(error, ".nii.gz") && has(error, ".mha")) << error;
}

TEST_F(ImageFile, FolderWithoutDicomIsAnErrorThatNamesPathAndFormats) {
  write("notes.txt", "not an image");
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, folder_.string()) && has(error, "without DICOM images")) << error;
  EXPECT_TRUE(has(error, ".nii.gz")) << error;
}

TEST_F(ImageFile, FileThatIsNoImageIsAnErrorThatNamesPathAndFormats) {
  for (const std::string name :
       {"a.txt", "a.nii", "a.nii.gz", "a.nrrd", "a.nhdr", "a.mha", "a.mhd", "noextension"}) {
    for (const std::string& bytes :
         {std::string("just some text, no image\n"), std::string(), std::string(2000, '\0')}) {
      SCOPED_TRACE(name);
      const fs::path path = write(name, bytes);
      const std::string error = read_error(path);
      EXPECT_TRUE(has(error, path.string()) && has(error, ".nii.gz")) << error;
    }
  }
}

TEST_F(ImageFile, FileCutShortIsAnError) {
  write_image(numbered_image({.size = {9, 9, 9}}), folder_ / "whole.nrrd");
  const std::string meta =
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = 9 9 9\nElementSpacing = 1 1 1\n"
      "ElementType = MET_SHORT\nElementDataFile = LOCAL\n" +
      std::string(1458, 'a');
  const std::vector<std::pair<std::string, std::string>> files = {
      {"a.nrrd", bytes_of(folder_ / "whole.nrrd")},
      {"a.nii", nifti({.dim = {3, 9, 9, 9, 1, 1, 1, 1}})},
      {"a.mha", meta}};
  for (const auto& [name, bytes] : files) {
    SCOPED_TRACE(name);
    EXPECT_NO_THROW(read_image(write(name, bytes)));
    for (const std::size_t lost : {20, 200}) {  // gzip ends with 8 bytes that are no voxels
      const fs::path path = write(name, bytes.substr(0, bytes.size() - lost));
      const std::string error = read_error(path);
      EXPECT_TRUE(has(error, path.string()) && has(error, "cut short")) << error;
    }
  }
}

// ---- real data ----------------------------------------------------------------------------------

/// Folder of the real inputs: WIREPLAN_DATA, else beside the checkout.
fs::path data_folder() {
  const char* folder = std::getenv("WIREPLAN_DATA");
  return folder != nullptr ? fs::path(folder) : fs::path(WIREPLAN_SOURCE_DIR) / "../shared/data";
}

/// Value of the voxel nearest to the point [mm].
float value_at(const Image& image, const Vec3& point) {
  const Eigen::Vector3i v = image.grid.ijk_from_lps(point).array().round().cast<int>();
  return image.values.at(image.grid.index(v[0], v[1], v[2]));
}

TEST(RealImage, MraFallsOnTheVesselWhereItsReadmeSays) {
  const fs::path path = data_folder() / "mra-aorta-iliac-vmtk/aorta.mha";
  if (!fs::exists(path)) {
    GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  }
  const Image image = read_image(path);
  EXPECT_EQ(image.grid.size, (std::array<int, 3>{157, 393, 34}));
  EXPECT_EQ(image.grid.direction, Mat3(Vec3(-1, -1, 1).asDiagonal()));
  EXPECT_GT(value_at(image, {-189.8, -28.1, 46.5}), 1100.0F);   // iliac, where the signal fades
  EXPECT_GT(value_at(image, {-254.0, -228.5, 28.5}), 1500.0F);  // renal
}

TEST_F(ImageFile, CompressedFilesCutShortAreErrors) {
  for (const std::string name :
       {"mra-aorta-iliac-vmtk/aorta.mha", "ct-aorta-dissection-labelled/ct_cropped.nii.gz"}) {
    SCOPED_TRACE(name);
    const fs::path path = data_folder() / name;
    if (!fs::exists(path)) {
      GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
    }
    const std::string bytes = bytes_of(path);
    for (const std::size_t kept : {bytes.size() / 2, bytes.size() - 1}) {
      const std::string error = read_error(write(path.filename().string(), bytes.substr(0, kept)));
      EXPECT_TRUE(has(error, "cut short")) << error;
    }
  }
}

TEST(RealImage, CtAbdomenDicomHasContrastAtItsSeeds) {
  const fs::path path = data_folder() / "ct-abdomen-dicom/PATIENT_DICOM";
  if (!fs::exists(path)) {
    GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  }
  const Image image = read_image(path);
  expect_same_grid(image.grid,
                   {.size = {512, 512, 80},
                    .spacing = Vec3(0.57, 0.57, 1.6),
                    .origin = Vec3(0, 0, 16),
                    .direction = Mat3::Identity()},
                   1e-3);  // the README's digits
  // mean of 27 voxels round the aortic seed: 190-212 HU, noise 15-20 HU
  double mean = 0.0;
  for (int n = 0; n < 27; ++n) {
    mean +=
        value_at(image, Vec3(146.5, 130.5, 32.0) +
                            Vec3(0.57 * (n % 3 - 1), 0.57 * (n / 3 % 3 - 1), 1.6 * (n / 9 - 1))) /
        27.0;
  }
  EXPECT_NEAR(mean, 200.0, 15.0);
}

TEST(RealImage, CtDissectionNiftiLiesOnItsLabels) {
  const fs::path folder = data_folder() / "ct-aorta-dissection-labelled";
  if (!fs::exists(folder)) {
    GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  }
  const Image image = read_image(folder / "ct_cropped.nii.gz");
  const Mask lumen = read_mask(folder / "aorta_true_lumen.nii.gz");
  // the header holds 7 digits
  EXPECT_LT((image.grid.lps_from_ijk(Vec3(44, 71, 8)) - Vec3(-5.658, -149.158, 552.2)).norm(),
            1e-3);
  expect_same_grid(lumen.grid, image.grid, 1e-3);
  std::vector<float> inside;
  for (std::size_t n = 0; n < lumen.labels.size(); ++n) {
    if (lumen.labels[n] != 0) {
      inside.push_back(image.values[n]);
    }
  }
  ASSERT_GT(inside.size(), 1000U);
  std::nth_element(inside.begin(), inside.begin() + inside.size() / 2, inside.end());
  EXPECT_NEAR(inside[inside.size() / 2], 471.0F, 0.5F);  // the README's median
}

TEST(RealImage, HeadNiftiIsScaledByItsSlope) {
  const fs::path path = data_folder() / "ct-head-avm/CT_AVM.nii.gz";
  if (!fs::exists(path)) {
    GTEST_SKIP() << "real data not found; set WIREPLAN_DATA";
  }
  const Image image = read_image(path);
  EXPECT_NEAR(*std::max_element(image.values.begin(), image.values.end()), 563.0F, 1.0F);
}

}  // namespace
}  // namespace wireplan::preprocess
