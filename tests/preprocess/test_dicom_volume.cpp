// DICOM images that lie evenly and yet are no volume: shifted, of values that
// are no HU.
#include "preprocess/volume/describe.h"
#include "tests/preprocess/field_dicom.h"

namespace wireplan::preprocess {
namespace {

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

  /// An element in every slice, of a value for each.
  void write_told(std::uint16_t group, std::uint16_t number, const std::string& vr,
                  const std::function<std::string(int)>& value) const {
    write_slices([&](const std::string& bytes, int k) {
      return with_element(bytes, group, number, vr, value(k));
    });
  }
};

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

}  // namespace
}  // namespace wireplan::preprocess
