// DICOM images that lie evenly and yet are no volume: of several phases, shifted, of values that
// are no HU, projections; and objects of other kinds beside a scan.
#include "preprocess/volume/describe.h"
#include "preprocess/volume/labels.h"
#include "tests/preprocess/field_dicom.h"

namespace wireplan::preprocess {
namespace {

std::string as_they_are(const std::string& bytes, int) { return bytes; }

std::string long_value(std::uint32_t value) {
  std::string bytes;
  dicom_files::append(bytes, value);
  return bytes;
}

std::string double_value(double value) {
  std::string bytes;
  dicom_files::append(bytes, value);
  return bytes;
}

/// A tag as the value of an element.
std::string tag_value(std::uint16_t group, std::uint16_t number) {
  return dicom_files::short_value(group) + dicom_files::short_value(number);
}

/// More elements in front of an element of the file that is given as bytes.
std::string with_before(std::string bytes, const std::string& before, const std::string& more) {
  const std::size_t at = bytes.find(before);
  EXPECT_NE(at, std::string::npos);
  return bytes.insert(at, more);
}

class DicomVolume : public FieldDicom {
 protected:
  /// Reading and inspecting say the same, and nothing of the patient.
  void expect_refused(const std::vector<std::string>& texts, const fs::path& path = {}) const {
    const fs::path read = path.empty() ? folder_ : path;
    const std::string error = read_error(read);
    const VolumeDescription told = describe_volume(read);
    for (const std::string& text : texts) {
      EXPECT_TRUE(has(error, text)) << error;
      if (has(text, "3_")) continue;  // inspecting tells "file 4 of 8"
      EXPECT_TRUE(std::any_of(told.series.begin(), told.series.end(), [&](const auto& series) {
        return has(series.problem, text);
      })) << text;
      EXPECT_TRUE(has(told.refused, text)) << told.refused;
    }
    EXPECT_FALSE(told.refused.empty());
    for (const SeriesDescription& series : told.series) EXPECT_FALSE(series.read);
    for (const std::string& secret : dicom_files::kPatient) {
      EXPECT_FALSE(has(error, secret)) << error;
      EXPECT_FALSE(has(told.refused, secret)) << told.refused;
    }
  }

  void expect_read() const {
    expect_whole();
    const VolumeDescription told = describe_volume(folder_);
    EXPECT_TRUE(told.refused.empty()) << told.refused;
    EXPECT_EQ(std::count_if(told.series.begin(), told.series.end(),
                            [](const SeriesDescription& series) { return series.read; }),
              1);
  }

  /// Of the series, as the refusal of several parts gives it.
  std::string key() const {
    const std::string error = read_error(folder_);
    return error.substr(error.find("\"#") + 1, 9);
  }

  void expect_part(int part, const std::array<int, 3>& size, float first) const {
    const Image image = read_image(folder_, key() + "." + std::to_string(part));
    EXPECT_EQ(image.grid.size, size);
    EXPECT_EQ(image.values.front(), first);
  }

  /// An element in every slice, of a value for each.
  void write_told(std::uint16_t group, std::uint16_t number, const std::string& vr,
                  const std::function<std::string(int)>& value) const {
    write_slices([&](const std::string& bytes, int k) {
      return with_element(bytes, group, number, vr, value(k));
    });
  }
};

// ---- Phases -------------------------------------------------------------------------------------

/// Eight frames 1.5 mm apart, first those of even numbers along z and then the odd ones, each with
/// a functional group.
std::string two_by_turns(const std::function<std::string(int place, int frame)>& group) {
  std::vector<Frame> frames;
  for (int k = 0; k < 8; ++k) {
    const int place = k < 4 ? 2 * k : 2 * (k - 4) + 1;
    frames.push_back({.place = 1.5 * place, .more = group(place, k)});
  }
  return enhanced(frames);
}

std::string content(const std::string& elements) { return sequence(0x20, 0x9111, {elements}); }

TEST_F(DicomVolume, FramesOfTwoStacksOrPhasesHalfAStepApartAreRefusedWithTheirFrames) {
  struct Kind {
    std::string told;
    std::function<std::string(int part)> group;
  };
  const std::vector<Kind> kinds = {
      {"2 stacks (Stack ID (0020,9056))",
       [](int part) { return content(of(0x20, 0x9056, "SH", std::to_string(part))); }},
      {"2 temporal positions (Temporal Position Index (0020,9128))",
       [](int part) {
         return content(of(0x20, 0x9128, "UL", long_value(static_cast<std::uint32_t>(part))));
       }},
      {"2 acquisitions (Frame Acquisition Number (0020,9156)) that lie between one another",
       [](int part) {
         return content(
             of(0x20, 0x9156, "US", dicom_files::short_value(static_cast<std::uint16_t>(part))));
       }},
      {"2 values of a dimension (Dimension Index Values (0020,9157), number 1)",
       [](int part) {
         return content(of(0x20, 0x9157, "UL", long_value(static_cast<std::uint32_t>(part))));
       }},
      {"2 phases of the heart (Nominal Percentage of Cardiac Phase (0020,9241))",
       [](int part) {
         return sequence(0x18, 0x9118, {of(0x20, 0x9241, "FD", double_value(30.0 * part))});
       }},
      {"2 phases of breath (Nominal Percentage of Respiratory Phase (0020,9245))",
       [](int part) {
         return sequence(0x20, 0x9253, {of(0x20, 0x9245, "FD", double_value(50.0 * part))});
       }},
      {"2 times (Temporal Position Time Offset (0020,930D)) that lie between one another",
       [](int part) {
         return sequence(0x20, 0x9310, {of(0x20, 0x930d, "FD", double_value(20.0 * part))});
       }},
      {"2 contrast phases (Contrast/Bolus Agent Phase (0018,9344))", [](int part) {
         return sequence(
             0x18, 0x9341,
             {of(0x18, 0x9344, "CS", part == 1 ? "DURING_INJECTION" : "POST_INJECTION")});
       }}};
  for (const Kind& kind : kinds) {
    SCOPED_TRACE(kind.told);
    write("ct.dcm", two_by_turns([&](int place, int) { return kind.group(1 + place % 2); }));
    expect_refused({"images of " + kind.told,
                    "expected one: 4 frames (1 to 4); 4 frames (5 to 8); name the one to plan on "
                    "by \"series\" in the case's volume",
                    "or export the one to plan on as a series of its own"});
    expect_part(1, {3, 2, 4}, 0.0F);
    expect_part(2, {3, 2, 4}, 40.0F);
  }
}

TEST_F(DicomVolume, APartOfAnEnhancedFileKeepsItsFramesScalesAndAxes) {
  // Three axial frames downwards, then four coronal ones, each with a slope of its own.
  std::vector<Frame> frames;
  for (int k = 0; k < 7; ++k) {
    const bool axial = k < 3;
    const double along = axial ? 30.0 - 2.0 * k : 1.5 * k;
    const std::string place = axial ? "5\\6\\" + std::to_string(along).substr(0, 6)
                                    : "5\\" + std::to_string(along).substr(0, 6) + "\\9";
    std::string group = sequence(0x20, 0x9113, {of(0x20, 0x32, "DS", place)}) +
                        content(of(0x20, 0x9056, "SH", axial ? "axial" : "coronal"));
    if (!axial) group += sequence(0x20, 0x9116, {of(0x20, 0x37, "DS", "1\\0\\0\\0\\0\\-1")});
    frames.push_back({.slope = std::to_string(k + 1), .more = group});
  }
  write("ct.dcm", enhanced(frames, false));
  expect_refused(
      {"2 stacks (Stack ID (0020,9056)), expected one: 3 frames (1 to 3); 4 frames "
       "(4 to 7)"});
  expect_part(1, {3, 2, 3}, 3.0F * 20.0F);  // from the lowest, which is the third
  expect_part(2, {3, 2, 4}, 4.0F * 30.0F);
  const Image coronal = read_image(folder_ / "ct.dcm", key() + ".2");  // the file itself
  EXPECT_NEAR(coronal.grid.spacing[2], 1.5, 1e-9);
  EXPECT_TRUE(coronal.grid.direction.col(2).isApprox(Vec3(0, 1, 0)));
  EXPECT_EQ(coronal.values.back(), 7.0F * 65.0F);
}

TEST_F(DicomVolume, ADimensionIsToldByWhatItPointsToAndOneOfPlacesIsNone) {
  const auto by_dimensions = [&](std::uint16_t group, std::uint16_t number, bool by_place) {
    const auto index = [](int k) { return long_value(static_cast<std::uint32_t>(k)); };
    const std::string bytes = two_by_turns([&](int place, int) {
      return content(
          of(0x20, 0x9157, "UL", index(1) + index(1 + (by_place ? place / 2 : place % 2))));
    });
    const auto pointer = [](std::uint16_t to_group, std::uint16_t to_number) {
      return of(0x20, 0x9165, "AT", tag_value(to_group, to_number));
    };
    const std::string dimensions =
        sequence(0x20, 0x9222, {pointer(0x20, 0x9056), pointer(group, number)});
    write("ct.dcm",
          with_before(bytes, of(0x28, 0x02, "US", dicom_files::short_value(1)), dimensions));
  };
  by_dimensions(0x20, 0x9241, false);
  expect_refused({"2 phases of the heart (Nominal Percentage of Cardiac Phase (0020,9241))"});
  by_dimensions(0x18, 0x9087, false);
  expect_refused({"2 values of a dimension (Dimension (0018,9087)) that lie between one another"});
  by_dimensions(0x20, 0x9057, false);  // in-stack positions, however they are counted
  EXPECT_EQ(read_image(folder_).grid.size[2], 8);
  by_dimensions(0x18, 0x9087, true);
  EXPECT_EQ(read_image(folder_).grid.size[2], 8);
}

TEST_F(DicomVolume, StacksOneBehindTheOtherAreRefusedAndFramesOfTheirOwnTimesAreRead) {
  write("ct.dcm", two_by_turns([](int place, int) {
          return content(of(0x20, 0x9056, "SH", place < 4 ? "1" : "2"));
        }));
  expect_refused(
      {"2 stacks (Stack ID (0020,9056)), expected one: 4 frames (1 to 2, 5 to 6); 4 frames "
       "(3 to 4, 7 to 8)"});
  write("ct.dcm", two_by_turns([](int place, int) {  // as a helical scan has it
          return content(of(0x18, 0x9074, "DT", "2020010112000" + std::to_string(place / 2)) +
                         of(0x20, 0x9128, "UL", long_value(static_cast<std::uint32_t>(place + 1))) +
                         of(0x20, 0x9156, "US",
                            dicom_files::short_value(static_cast<std::uint16_t>(place / 4))));
        }));
  EXPECT_EQ(read_image(folder_).grid.size[2], 8);
}

TEST_F(DicomVolume, TwoAcquisitionsOfOneSeriesBetweenOneAnotherAreRefusedWithTheirFiles) {
  write_told(0x20, 0x12, "IS", [](int k) { return std::to_string(1 + k % 2); });
  expect_refused(
      {"2 acquisitions (Acquisition Number (0020,0012)) that lie between one another, "
       "expected one: 4 slices (",
       "3_2 and 2 more); 4 slices (", "3_1, ",
       "put the files of the one to plan on into a folder of their own"});
  expect_part(1, {3, 2, 4}, 0.0F);
  expect_part(2, {3, 2, 4}, 10.0F);
  for (const char* none : {".3", ".0", ".x"}) {
    EXPECT_TRUE(
        has(error_of([&] { read_image(folder_, key() + none); }), "expected a part from 1 to 2"));
  }
  write_told(0x20, 0x100, "IS", [](int k) { return std::to_string(1 + k % 2); });
  expect_refused({"2 temporal positions (Temporal Position Identifier (0020,0100)), expected one"});
  write_told(0x20, 0x100, "IS", [](int k) { return std::to_string(1 + k / 4); });
  expect_refused({"2 temporal positions (Temporal Position Identifier (0020,0100)), expected one"});
}

TEST_F(DicomVolume, AcquisitionsOneBehindTheOtherAreOneVolume) {
  for (const int each : {1, 2, 3, 4, 8}) {
    write_told(0x20, 0x12, "IS", [&](int k) { return std::to_string(9 - k / each); });
    expect_read();
  }
  // The number may be empty: that is no other acquisition.
  write_told(0x20, 0x12, "IS", [](int k) { return std::string(k % 3 == 1 ? "" : "7"); });
  expect_read();
}

// ---- Places and decimals ------------------------------------------------------------------------

TEST_F(DicomVolume, SlicesOffTheLineAreRefusedWithFileAndShiftAndJitterIsNot) {
  const auto write_shifted = [&](int from, int to, double shift) {
    write_slices([&](const std::string& bytes, int k) {
      const double x = k >= from && k < to ? shift : 0.0;
      return with_element(bytes, 0x20, 0x32, "DS",
                          dicom_files::decimals(Vec3(x, -0.5 * x, 1.5 * k)));
    });
  };
  write_shifted(3, 6, 3.0);  // pixels of 0.6 mm
  expect_refused({"3_3: this slice is shifted by 3.4 mm in its plane against the one before"});
  write_shifted(5, 8, -2.0);
  expect_refused({"3_5: this slice is shifted by 2.2 mm in its plane against the one before"});
  write_shifted(4, 5, 0.3);
  expect_refused({"3_4: this slice is shifted by 0.3 mm", "slices lie up to 0.3 mm off the line"});
  for (const int to : {4, 5, 8}) {
    write_shifted(3, to, 0.14);
    expect_read();
  }
  write_slices([](const std::string& bytes, int k) {
    return with_element(bytes, 0x20, 0x32, "DS", dicom_files::decimals(Vec3(0, 0.4 * k, 1.5 * k)));
  });
  expect_refused({"2.8 mm in their plane from first to last (tilted gantry, 14.9 degrees)"});
}

TEST_F(DicomVolume, DecimalsThatAreNoNumbersAreRefusedWithTagAndValue) {
  struct Case {
    std::uint16_t group, number;
    std::string value, name;
  };
  for (const Case& one :
       {Case{0x28, 0x30, "0,7\\0,7", "Pixel Spacing (0028,0030)"},
        Case{0x28, 0x30, "0.8mm\\0.6mm", "Pixel Spacing (0028,0030)"},
        Case{0x28, 0x30, "0.8\\nan", "Pixel Spacing (0028,0030)"},
        Case{0x20, 0x32, "-30,5\\-20,5\\-50,00", "Image Position (Patient) (0020,0032)"},
        Case{0x20, 0x37, "1\\0\\0\\0\\1\\0x0", "Image Orientation (Patient) (0020,0037)"},
        Case{0x28, 0x1052, "-1024 HU", "Rescale Intercept (0028,1052)"},
        Case{0x28, 0x1053, "0,5", "Rescale Slope (0028,1053)"}}) {
    for (const int from : {0, 5}) {
      SCOPED_TRACE(one.value);
      write_slices([&](const std::string& bytes, int k) {
        return k < from ? bytes : with_element(bytes, one.group, one.number, "DS", one.value);
      });
      expect_refused(
          {"3_" + std::to_string(from) + ": its ",
           one.name + " is \"" + one.value + "\", expected numbers with decimal points"});
    }
  }
  write_told(0x28, 0x1053, "DS", [](int) { return std::string("1 LOVELACE"); });
  expect_refused({"its Rescale Slope (0028,1053) is not shown"});
  write_told(0x28, 0x1053, "DS", [](int) { return std::string(" +1.0E0 "); });
  expect_read();
}

TEST_F(DicomVolume, DecimalsOfFramesThatAreNoNumbersAreToldWithTheFrame) {
  write("ct.dcm", enhanced({{.place = 0}, {.place = 1}, {.place = 2, .slope = "0,5"}}));
  expect_refused({"its Rescale Slope (0028,1053) of frame 3 is \"0,5\""});
  write("ct.dcm", enhanced({{.place = 0}, {.place = 1}, {.place = 2}}, true, "0,8\\0,6"));
  expect_refused({"its Pixel Spacing (0028,0030) of frame 1 is \"0,8\\0,6\""});
}

TEST_F(DicomVolume, AScaleOfZeroAndDirectionsWithoutLengthAreRefusedWithTagAndValue) {
  for (const char* zero : {"0", "0.0", "-0"}) {
    write_slices([&](const std::string& bytes, int k) {
      return k == 5 ? with_element(bytes, 0x28, 0x1053, "DS", zero) : bytes;
    });
    expect_refused({"3_5: its ", std::string("Rescale Slope (0028,1053) is \"") + zero +
                                     "\", expected another number than 0"});
  }
  for (const char* none : {"0\\0\\0\\0\\0\\0", "1\\0\\0\\0\\0.5\\0"}) {
    write_told(0x20, 0x37, "DS", [&](int) { return std::string(none); });
    expect_refused({"3_0: its ", std::string("Image Orientation (Patient) (0020,0037) is \"") +
                                     none + "\", expected two directions of length 1"});
  }
  for (int k = 0; k < 8; ++k) fs::remove(folder_ / ("3_" + std::to_string(k)));
  write("ct.dcm", enhanced({{.place = 0}, {.place = 1, .slope = "0"}, {.place = 2}}));
  expect_refused({"its Rescale Slope (0028,1053) of frame 2 is \"0\", expected another number"});
  std::string bytes = enhanced({{.place = 0}, {.place = 1}, {.place = 2}});
  const std::string axes = "1\\0\\0\\0\\1\\0";
  bytes.replace(bytes.find(axes), axes.size(), "0\\0\\0\\0\\0\\0");
  write("ct.dcm", bytes);
  expect_refused(
      {"its Image Orientation (Patient) (0020,0037) of frame 1 is "
       "\"0\\0\\0\\0\\0\\0\", expected two directions of length 1"});
}

TEST_F(DicomVolume, AnotherCountOfFramesThanOfTheirPlacesIsToldWithBoth) {
  const std::string bytes = enhanced({{.place = 0}, {.place = 1}, {.place = 2}});
  for (const char* count : {"2", "4", "1"}) {
    std::string other = bytes;
    const std::string three = of(0x28, 0x08, "IS", "3");
    other.replace(other.find(three), three.size(), of(0x28, 0x08, "IS", count));
    write("ct.dcm", other);
    expect_refused({std::string("its Number of Frames (0028,0008) is ") + count +
                    ", but it tells the places of 3 (Per-frame Functional Groups Sequence"});
  }
}

TEST_F(DicomVolume, AFileThatIsThereTwiceAndTwoImagesOfOnePlaceAreNamed) {
  write_slices(as_they_are);
  for (const char* copy : {"3_3 (copy)", "a"}) {  // behind and before it
    const fs::path file = write(copy, bytes_of(folder_ / "3_3"));
    expect_refused({": the same image as ", "(of one SOP Instance UID (0008,0018) and place)"});
    const std::string error = read_error(folder_);
    EXPECT_TRUE(has(error, file.string()) && has(error, "/3_3")) << error;
    fs::remove(file);
  }
  const fs::path other = write("b", dicom({.position = Vec3(0, 0, 4.5), .first_value = 77}));
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "keep one phase or reconstruction in the folder; it is at 2 slices (") &&
              has(error, other.string()) && has(error, "/3_3"))
      << error;
}

// ---- Values -------------------------------------------------------------------------------------

/// As many columns as rows of soft tissue with air around it.
DicomSlice body(std::int16_t offset) {
  DicomSlice slice{.columns = 10, .rows = 10};
  for (int n = 0; n < 100; ++n) {
    const bool air = n < 20;
    slice.values.push_back(static_cast<std::int16_t>((air ? -1000 + n % 7 : 40 + n % 5) + offset));
  }
  return slice;
}

TEST_F(DicomVolume, ACtThatDoesNotTellItsScaleIsReadWhereItsValuesCanBeNothingButHounsfieldUnits) {
  const auto write_without = [&](bool intercept, bool slope, std::int16_t offset, int every) {
    write_slices(
        [&](std::string bytes, int k) {
          if (k % every != every - 1) return bytes;
          if (intercept) bytes = with_element(bytes, 0x28, 0x1052, "DS", std::nullopt);
          return slope ? with_element(bytes, 0x28, 0x1053, "DS", std::nullopt) : bytes;
        },
        body(offset));
  };
  write_without(true, true, 1024, 1);
  expect_refused(
      {"3_0: a CT whose images lack Rescale Intercept (0028,1052) and Rescale Slope "
       "(0028,1053), and whose stored values are not seen to be HU"});
  write_slices(  // its class says that it is a CT
      [](const std::string& bytes, int) {
        std::string less = with_element(bytes, 0x08, 0x60, "CS", std::nullopt);
        less = with_element(less, 0x28, 0x1052, "DS", std::nullopt);
        return with_element(less, 0x28, 0x1053, "DS", std::nullopt);
      },
      body(1024));
  expect_refused({"3_0: a CT whose images lack Rescale Intercept"});
  write_without(true, true, -24, 1);
  EXPECT_EQ(read_image(folder_).values[0], -1024.0F);
  write_without(true, false, 1024, 1);
  expect_refused({"3_0: a CT whose images lack Rescale Intercept (0028,1052), and whose"});
  write_without(true, true, 0, 1);
  EXPECT_EQ(read_image(folder_).values[0], -1000.0F);
  EXPECT_TRUE(describe_volume(folder_).series.front().read);
  for (const std::int16_t offset : {std::int16_t{0}, std::int16_t{1024}}) {
    write_without(true, true, offset, 2);
    expect_refused({"3_1: lacks Rescale Intercept (0028,1052), as 4 of 8 images do"});
    write_without(false, true, offset, 8);
    expect_refused({"3_7: lacks Rescale Slope (0028,1053), as 1 of 8 images do"});
  }
}

TEST_F(DicomVolume, AScaleOfTheWholeEnhancedFileCountsWhereItsFramesTellNone) {
  const std::string scale = of(0x28, 0x1052, "DS", "-1024") + of(0x28, 0x1053, "DS", "2");
  const auto enhanced_of = [&](const std::vector<Frame>& frames) {
    return with_before(enhanced(frames), of(0x28, 0x103, "US", dicom_files::short_value(1)), scale);
  };
  write("ct.dcm", enhanced_of({{.place = 1.5, .slope = ""},
                               {.place = 0, .slope = ""},
                               {.place = 3, .slope = "3", .intercept = "5"}}));
  const Image image = read_image(folder_);
  EXPECT_EQ(image.values[0], 2.0F * 10.0F - 1024.0F);
  EXPECT_EQ(image.values[6], 2.0F * 0.0F - 1024.0F);
  EXPECT_EQ(image.values[12], 3.0F * 20.0F + 5.0F);
  write("ct.dcm", enhanced({{.place = 0}, {.place = 1.5, .slope = ""}, {.place = 3}}));
  expect_refused({"frame 2: lacks Rescale Intercept (0028,1052), as 1 of 3 images do"});

  fs::remove(folder_ / "ct.dcm");
  for (int k = 0; k < 3; ++k) {  // enhanced files of one frame each
    write(std::to_string(k), enhanced_of({{.place = 1.5 * k, .slope = ""}}));
  }
  EXPECT_EQ(read_image(folder_).values[1], 2.0F * 1.0F - 1024.0F);
}

// ---- Objects that are no scans ------------------------------------------------------------------

TEST_F(DicomVolume, ProjectionsAndThickSlabsAreRefusedAndOverlappingSlicesAreNot) {
  for (const char* type : {"DERIVED\\SECONDARY\\AXIAL\\MIP", "DERIVED\\SECONDARY\\MIP_THIN",
                           "DERIVED\\PRIMARY\\VOLUME\\MIN_IP", "DERIVED\\SECONDARY\\AXIAL\\MinIP",
                           "DERIVED\\SECONDARY\\PROJECTION IMAGE", "DERIVED\\SECONDARY\\VRT"}) {
    SCOPED_TRACE(type);
    write_told(0x08, 0x08, "CS", [&](int) { return std::string(type); });
    expect_refused({"3_0: a projection or a picture of a volume (its image type says"});
  }
  const auto write_thick = [&](const std::string& thickness, const std::string& type) {
    write_slices([&](const std::string& bytes, int) {
      return with_element(with_element(bytes, 0x18, 0x50, "DS", thickness), 0x08, 0x08, "CS", type);
    });
  };
  for (const char* thickness : {"1.5", "3", "4.5", "7.5", "1,5"}) {  // the last one is not needed
    for (const char* type : {"ORIGINAL\\PRIMARY\\AXIAL", "DERIVED\\SECONDARY\\MPR"}) {
      write_thick(thickness, type);
      expect_read();
    }
  }
  write_thick("10.5", "DERIVED\\SECONDARY\\AXIAL");
  expect_refused({"3_0: a slab of 10.5 mm (Slice Thickness (0018,0050)) in images 1.5 mm apart"});
  write_thick("10.5", "ORIGINAL\\PRIMARY\\AXIAL");
  expect_refused({"3_0: a slab of 10.5 mm"});
}

/// An enhanced file that says to be of another kind of a series of its own.
std::string other_object(const std::string& sop_class, const std::string& modality) {
  std::vector<Frame> frames;
  for (int k = 0; k < 6; ++k) frames.push_back({.place = 1.5 * k});
  std::string bytes = enhanced(frames);
  const auto replace = [&](const std::string& old, const std::string& now) {
    const std::size_t at = bytes.find(old);
    ASSERT_NE(at, std::string::npos);
    bytes.replace(at, old.size(), now);
  };
  replace(of(0x08, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.2.1"), of(0x08, 0x16, "UI", sop_class));
  replace(of(0x08, 0x60, "CS", "CT"), of(0x08, 0x60, "CS", modality));
  return bytes;
}

TEST_F(DicomVolume, ASegmentationIsRefusedByNameAsAVolumeAndAsLabels) {
  const fs::path file = write("seg.dcm", other_object("1.2.840.10008.5.1.4.1.1.66.4", "SEG"));
  const std::string expected = "a DICOM segmentation (SEG) is not read; export it as NIfTI or NRRD";
  expect_refused({expected});
  expect_refused({expected}, file);
  const std::string error = error_of([&] { list_labels(file, {}); });
  EXPECT_TRUE(has(error, expected)) << error;
}

/// A file of a CT that holds a picture in colours.
std::string in_colours(const std::string& bytes) {
  std::string colour = with_element(bytes, 0x28, 0x02, "US", dicom_files::short_value(3));
  colour = with_element(colour, 0x28, 0x04, "CS", "RGB");
  colour = with_element(colour, 0x28, 0x06, "US", dicom_files::short_value(0));
  colour = with_element(colour, 0x28, 0x100, "US", dicom_files::short_value(8));
  colour = with_element(colour, 0x28, 0x101, "US", dicom_files::short_value(8));
  colour = with_element(colour, 0x28, 0x102, "US", dicom_files::short_value(7));
  colour = with_element(colour, 0x28, 0x103, "US", dicom_files::short_value(0));
  colour = with_element(colour, 0x28, 0x1052, "DS", std::nullopt);
  colour = with_element(colour, 0x28, 0x1053, "DS", std::nullopt);
  const std::size_t pixels = elements_of(colour).back().at;
  return colour.substr(0, pixels) + of(0x7fe0, 0x10, "OW", std::string(18, '\x70'));
}

TEST_F(DicomVolume, PicturesInColoursAreRefusedAsSuchAndPassedOverBesideACt) {
  const auto paint = [](const std::string& bytes, int) { return in_colours(bytes); };
  write_slices(paint, {.series = "1.2.88", .number = "88"});
  expect_refused({"a colour image (Samples per Pixel (0028,0002) is 3)"});
  write_slices(as_they_are);
  expect_read();
}

TEST_F(DicomVolume, AStructureSetIsRefusedByNameAsAVolumeAndDicomOfAnyKindAsLabels) {
  const auto labels_error = [](const fs::path& path) {
    return error_of([&] { read_labels(path, {.names = {"aorta"}}, nullptr); });
  };
  const std::string rtstruct =
      std::string(128, '\0') + "DICM" + of(2, 0, "UL", std::string("\x1c\0\0\0", 4)) +
      of(2, 0x10, "UI", "1.2.840.10008.1.2.1") +
      of(8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.481.3") + of(8, 0x60, "CS", "RTSTRUCT");
  const fs::path file = write("rs.dcm", rtstruct);
  EXPECT_TRUE(has(read_error(file), "a DICOM structure set (RTSTRUCT) without an image"));
  const std::string expected =
      "a DICOM structure set (RTSTRUCT) is not read; export it as NIfTI or NRRD";
  EXPECT_TRUE(has(labels_error(file), "rs.dcm: " + expected)) << labels_error(file);
  EXPECT_TRUE(has(labels_error(folder_), "holds no volumes") &&
              has(labels_error(folder_), expected))
      << labels_error(folder_);
  fs::remove(file);
  write_slices(as_they_are);
  const std::string no_labels =
      "a DICOM image (CT or MR) holds no labels that are read; export the segmentation as NIfTI or "
      "NRRD";
  for (const fs::path& path : {folder_, folder_ / "3_0"}) {
    EXPECT_TRUE(has(labels_error(path), no_labels)) << labels_error(path);
  }
}

TEST_F(DicomVolume, WhatIdentifiesThePatientIsNotShownHoweverItIsSplitOrParted) {
  const auto shown = [&](const std::string& id, const std::string& name,
                         const std::string& description) {
    write_slices(
        [&](const std::string& bytes, int) {
          return with_element(with_element(bytes, 0x10, 0x20, "LO", id), 0x10, 0x10, "PN", name);
        },
        {.description = description});
    return describe_volume(folder_).series.at(0).description;
  };
  for (const char* told :
       {"MRN 1234567 arterial 1.0 B30f", "MRN-123-4567 thin", "art 1234567", "art 12 345 67 1.0",
        "mrn_1_2_3_4_5_6_7", "LOVE-LACE thin", "L O V E L A C E", "thin VAN DER BERG",
        "vander berg", "id1234567x", "AUGU STA"}) {
    EXPECT_EQ(shown("MRN1234567", "LOVELACE-VAN DER BERG^AUGUSTA", told), "") << told;
  }
  for (const char* told : {"id AB 1234", "AB1234", "A B-12.34", "jo_ann"}) {
    EXPECT_EQ(shown("AB-12-34", "SMITH^JO ANN", told), "") << told;
  }
  for (const char* told : {"Thorax 1.0 B30f", "MR arterial 123 kV", "CTA 1234 mm", "love 1 lac"}) {
    EXPECT_EQ(shown("MRN1234567", "LOVELACE^AUGUSTA", told), told) << told;
  }
}

TEST_F(DicomVolume, ACtIsReadBesideADoseASegmentationAPictureAndItsProjection) {
  write_slices(as_they_are);
  write("dose", other_object("1.2.840.10008.5.1.4.1.1.481.2", "RTDOSE"));
  expect_read();
  EXPECT_EQ(describe_volume(folder_).series.size(), 2u);
  write("seg", other_object("1.2.840.10008.5.1.4.1.1.66.4", "SEG"));
  write("film", other_object("1.2.840.10008.5.1.4.1.1.7.2", "CT"));
  expect_read();
  expect_whole("3");
  write_slices(
      [](const std::string& bytes, int) {
        return with_element(bytes, 0x08, 0x08, "CS", "DERIVED\\SECONDARY\\AXIAL\\MIP");
      },
      {.series = "1.2.77", .number = "77"});
  expect_read();
  const std::string error = error_of([&] { read_image(folder_, "77"); });
  EXPECT_TRUE(has(error, "77_0: a projection")) << error;
}

}  // namespace
}  // namespace wireplan::preprocess
