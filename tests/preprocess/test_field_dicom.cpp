// DICOM as scanners and archives write it, beside what the standard's first pages say.
#include "tests/preprocess/field_dicom.h"

namespace wireplan::preprocess {
namespace {

/// A head that tells this transfer syntax, or none where that is empty.
std::string head_of(const std::string& syntax, bool preamble = true) {
  std::string meta =
      of(2, 0x01, "OB", std::string("\0\1", 2)) + of(2, 0x02, "UI", "1.2.840.10008.5.1.4.1.1.2");
  if (!syntax.empty()) meta += of(2, 0x10, "UI", syntax);
  std::string length;
  dicom_files::append(length, static_cast<std::uint32_t>(meta.size()));
  return (preamble ? std::string(128, '\0') + "DICM" : "") + of(2, 0, "UL", length) + meta;
}

std::string with_head(const std::string& bytes, const std::string& head) {
  return head + bytes.substr(data_set_of(bytes));
}

/// The data set written anew with another order of bytes, in its pixels too, or without value
/// representations.
std::string rewritten(const std::string& bytes, bool explicit_vr, bool big, bool big_pixels) {
  std::string result;
  const auto put = [&](std::uint32_t number, std::size_t count, bool reverse) {
    std::string text(reinterpret_cast<const char*>(&number), count);
    if (reverse) std::reverse(text.begin(), text.end());
    result += text;
  };
  for (const Element& one : elements_of(bytes)) {
    std::string value = one.value;
    const bool swapped = one.vr == "US" ? big : one.vr == "OW" && big_pixels;
    for (std::size_t k = 0; swapped && k + 1 < value.size(); k += 2) {
      std::swap(value[k], value[k + 1]);
    }
    put(one.group, 2, big);
    put(one.number, 2, big);
    const auto size = static_cast<std::uint32_t>(value.size());
    if (!explicit_vr) {
      put(size, 4, big);
    } else if (one.vr == "OW") {
      result += one.vr + std::string(2, '\0');
      put(size, 4, big);
    } else {
      result += one.vr;
      put(size, 2, big);
    }
    result += value;
  }
  return result;
}

constexpr const char* kPlain = "1.2.840.10008.1.2.1";

// ---- Heads --------------------------------------------------------------------------------------

TEST_F(FieldDicom, SlicesWhoseHeadLacksPreambleLettersOrSyntaxAreRead) {
  write_slices([](const std::string& bytes, int k) {
    switch (k) {
      case 0:
      case 7:  // group 2 at once, at both ends of the stack
        return with_head(bytes, head_of(kPlain, /*preamble=*/false));
      case 1:  // zeros in the place of "DICM"
        return with_head(bytes, std::string(132, '\0') + head_of(kPlain, false));
      case 2:  // no room for it
        return with_head(bytes, std::string(128, '\0') + head_of(kPlain, false));
      case 3:
        return with_head(bytes, head_of(""));
      case 4:  // "DICM" and nothing else
        return with_head(bytes, std::string(128, '\0') + "DICM");
      case 5:
        return head_of("") + rewritten(bytes, false, false, false);
      default:
        return bytes;
    }
  });
  expect_whole();
}

TEST_F(FieldDicom, ABareSliceCutShortAndAnImageWithoutPixelsAreErrorsAndNotLeftOut) {
  const auto cut = [&](const std::string& bytes, int k) {
    if (k != 7) return bytes;
    const std::string bare = bytes.substr(data_set_of(bytes));
    return bare.substr(0, bare.size() - 3);
  };
  write_slices(cut);
  std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "3_7: a DICOM file that is damaged")) << error;
  write_slices([&](const std::string& bytes, int k) {
    return k == 7 ? with_element(bytes, 0x7fe0, 0x10, "OW", std::nullopt) : bytes;
  });
  error = read_error(folder_);
  EXPECT_TRUE(has(error, "3_7: an image without its pixels")) << error;
}

TEST_F(FieldDicom, AReportWithoutAClassBesideTheSlicesIsPassedOver) {
  write_slices([](const std::string& bytes, int) { return bytes; });
  write("report", std::string(128, '\0') + "DICM" + of(2, 0, "UL", std::string("\x1c\0\0\0", 4)) +
                      of(2, 0x10, "UI", kPlain) + of(8, 0x60, "CS", "SR") +
                      of(0x20, 0x0e, "UI", "1.99") + of(0x20, 0x11, "IS", "900"));
  expect_whole();
}

// ---- Transfer syntaxes --------------------------------------------------------------------------

TEST_F(FieldDicom, ImagesOfASyntaxThatTheLibraryDoesNotKnowAreToldWithIt) {
  for (const std::string syntax :
       {"1.2.840.10008.1.2.4.201", "1.2.840.10008.1.2.4.110", "1.2.3.4.5.6.7"}) {
    for (const int every : {1, 2}) {
      SCOPED_TRACE(syntax + " of every " + std::to_string(every));
      write_slices(
          [&](const std::string& bytes, int k) {
            return k % every == 0 ? with_head(bytes, head_of(syntax)) : bytes;
          },
          {.compressed = true});
      const std::string error = read_error(folder_);
      EXPECT_TRUE(has(error, "3_0: an image that GDCM does not read (transfer syntax " + syntax +
                                 "); export the series again, uncompressed"))
          << error;
    }
  }
}

TEST_F(FieldDicom, AnUnknownSyntaxWhoseElementsAreNotFoundIsNotGivenToTheLibrary) {
  // It took the letters behind the tag for a length, and asked for 2.6 GB.
  write_slices([](const std::string& bytes, int) {
    std::string other = with_head(bytes, head_of("1.2.3.4.5.6.7"));
    const std::size_t name = other.find("PN");
    EXPECT_NE(name, std::string::npos);
    return other.replace(name, 8, "P" + std::string(7, '\x9c'));
  });
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "GDCM does not read (transfer syntax 1.2.3.4.5.6.7)")) << error;
}

TEST_F(FieldDicom, AScoutInAnUnknownSyntaxDoesNotKeepAnotherSeriesFromBeingRead) {
  write_slices([](const std::string& bytes, int) { return bytes; });
  write_slices([](const std::string& bytes,
                  int) { return with_head(bytes, head_of("1.2.840.10008.1.2.4.201")); },
               {.series = "1.2.9", .number = "1", .compressed = true}, 2);
  expect_whole();
}

TEST_F(FieldDicom, BigEndianSlicesAreReadWithBytesBehindTheirPixelsToo) {
  write_slices([](const std::string& bytes, int k) {
    return head_of("1.2.840.10008.1.2.2") + rewritten(bytes, true, true, true) +
           std::string(static_cast<std::size_t>(k % 2 == 1 ? 100 : 0), '\0');
  });
  expect_whole();
}

TEST_F(FieldDicom, TheScannerMakersImplicitSyntaxWithBigEndianPixelsIsRead) {
  write_slices([](const std::string& bytes, int) {
    return head_of("1.2.840.113619.5.2") + rewritten(bytes, false, false, true);
  });
  expect_whole();
}

TEST_F(FieldDicom, PrivateElementsOfUnknownRepresentationsAreNoDamage) {
  const std::string creator = of(9, 0x10, "LO", "MAKER");
  for (const std::string& vr :
       {std::string("??"), std::string("  "), std::string(2, '\0'), std::string("ZZ")}) {
    for (const bool is_long : {false, true}) {
      if (vr == "ZZ" && !is_long) continue;  // a later one of the standard would be long
      SCOPED_TRACE(vr + (is_long ? " long" : " short"));
      const std::string element =
          std::string("\x09\0\x01\x10", 4) + vr +
          (is_long ? std::string("\0\0\4\0\0\0", 6) : std::string("\4\0", 2)) + "abcd";
      write_slices([&](const std::string& bytes, int) {
        for (const Element& one : elements_of(bytes)) {
          if (one.group < 9) continue;
          return bytes.substr(0, one.at) + creator + element + bytes.substr(one.at);
        }
        return bytes;
      });
      expect_whole();
    }
  }
}

// ---- What a stack needs -------------------------------------------------------------------------

TEST_F(FieldDicom, ImagesOfOneSeriesThatDifferAreRefusedWithBothAndTheirFiles) {
  const auto turned = [](double z) { return "1\\0\\0\\0\\" + std::to_string(z) + "\\0.0099998"; };
  for (const int from : {1, 3, 6}) {
    SCOPED_TRACE(from);
    write_slices([&](const std::string& bytes, int k) {
      return k == from || k == from + 1 ? with_element(bytes, 0x28, 0x30, "DS", "1.2\\1.1") : bytes;
    });
    std::string error = read_error(folder_);
    EXPECT_TRUE(has(error, "images of one series that differ: 6 have pixels of 0.6 x 0.8 mm") &&
                has(error, "2 have pixels of 1.1 x 1.2 mm") &&
                has(error, "3_" + std::to_string(from) + ", "))
        << error;
    write_slices([&](const std::string& bytes, int k) {
      return k == from || k == from + 1 ? with_element(bytes, 0x20, 0x37, "DS", turned(0.99995))
                                        : bytes;
    });
    error = read_error(folder_);
    EXPECT_TRUE(has(error, "6 have orientation 1\\0\\0\\0\\1\\0 ") &&
                has(error, "2 have orientation 1\\0\\0\\0\\1\\0.01 "))
        << error;
  }
}

TEST_F(FieldDicom, ALocalizerOfTheSameSeriesIsPassedOver) {
  write_slices([](const std::string& bytes, int) { return bytes; });
  const std::string across = dicom({.position = Vec3(0, 0, 500)});
  write("scout", with_element(across, 0x20, 0x37, "DS", "1\\0\\0\\0\\0\\-1"));
  expect_whole();
}

TEST_F(FieldDicom, SlicesThatDoNotTellWhereTheyLieAreRefusedWithWhatLacks) {
  struct Case {
    std::uint16_t group, number;
    const char* name;
  };
  for (const Case& one : {Case{0x28, 0x30, "Pixel Spacing (0028,0030)"},
                          Case{0x20, 0x32, "Image Position (Patient) (0020,0032)"},
                          Case{0x20, 0x37, "Image Orientation (Patient) (0020,0037)"}}) {
    for (const int every : {1, 5}) {
      SCOPED_TRACE(one.name);
      write_slices([&](const std::string& bytes, int k) {
        return k % every == 0 ? with_element(bytes, one.group, one.number, "DS", std::nullopt)
                              : bytes;
      });
      const std::string error = read_error(folder_);
      EXPECT_TRUE(has(error, "3_0: a slice that lacks ") && has(error, one.name)) << error;
    }
  }
}

TEST_F(FieldDicom, AnEnhancedFileWithoutOrientationIsToldByWhatItsFramesLack) {
  std::string bytes = enhanced({{.place = 0}, {.place = 1}, {.place = 2}});
  const std::string orientation =
      sequence(0x20, 0x9116, {of(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0")});
  const std::size_t at = bytes.find(orientation);
  ASSERT_NE(at, std::string::npos);
  // Of the same length, so that those around it hold.
  bytes.replace(at, orientation.size(),
                of(0x20, 0x4000, "LT", std::string(orientation.size() - 8, ' ')));
  write("ct.dcm", bytes);
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error,
                  "ct.dcm: a DICOM file of 3 frames that does not tell where each lies "
                  "(frame 1 lacks Image Orientation (Patient) (0020,0037))"))
      << error;
}

TEST_F(FieldDicom, ValuesShownInverselyAreReadAsTheyAreStored) {
  write_slices([](const std::string& bytes, int) {
    return with_element(bytes, 0x28, 0x04, "CS", "MONOCHROME1");
  });
  expect_whole();
}

TEST_F(FieldDicom, TheRescaleTypeOfEachSliceIsAskedAndThatOfNearlyHounsfieldUnitsTold) {
  const auto typed = [&](const std::string& first, const std::string& later) {
    write_slices([&](const std::string& bytes, int k) {
      return with_element(bytes, 0x28, 0x1054, "LO", k < 3 ? first : later);
    });
  };
  typed("HU", "OD");
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "3_3: a CT whose values are not in HU but, by its rescale type, OD"))
      << error;
  for (const char* unit : {"HU", "hu", "Hu", "Hounsfield", "HOUNSFIELD UNITS", "hounsfield_unit"}) {
    typed("HU", unit);
    expect_whole();
    EXPECT_EQ(read_image(folder_).unit, "HU") << unit;
  }
  for (const char* unit : {"HU_MOD", "US"}) {
    typed("HU", unit);
    expect_whole();
    EXPECT_EQ(read_image(folder_).unit, unit);
  }
}

// ---- Several series and files of several frames -------------------------------------------------

TEST_F(FieldDicom, SeriesOfOneNumberAndDescriptionAreChosenByTheKeyThatTheListGives) {
  write_slices([](const std::string& bytes, int) { return bytes; },
               {.series = "1.2.7", .number = "5", .description = "ART"});
  for (int k = 0; k < 9; ++k) {
    write("other_" + std::to_string(k), dicom({.series = "1.2.8",
                                               .number = "5",
                                               .position = Vec3(0, 0, 2.0 * k),
                                               .description = "ART"}));
  }
  const std::string error = error_of([&] { read_image(folder_, "5"); });
  EXPECT_TRUE(has(error, "has 8 images of 3 x 2 pixels of 0.6 x 0.8 mm, 1.5 mm apart")) << error;
  const std::size_t at = error.rfind('#', error.find("has 8 images"));
  ASSERT_NE(at, std::string::npos) << error;
  expect_whole(error.substr(at, 9));
}

TEST_F(FieldDicom, AnEnhancedFileIsReadByItsOwnNameAndOneOfSeveralIsAskedFor) {
  const fs::path file =
      write("a.dcm", enhanced({{.place = 4.5}, {.place = 0.0}, {.place = 1.5}, {.place = 3.0}}));
  const Image image = read_image(file);
  EXPECT_EQ(image.grid.size, (std::array<int, 3>{3, 2, 4}));
  EXPECT_EQ(image.values[0], 10.0F);
  write("b.dcm", enhanced({{.place = 10.5}, {.place = 6.0}, {.place = 7.5}, {.place = 9.0}}));
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "2 files of 4 frames each, expected one such file")) << error;
  EXPECT_TRUE(has(error, "into a folder of its own")) << error;
}

TEST_F(FieldDicom, FramesOfAnEnhancedCtAreSortedAndEachScaledByItsOwnSlope) {
  write("ct.dcm", enhanced({{.place = 4.5, .slope = "0.5"},
                            {.place = 0.0, .intercept = "-1000"},
                            {.place = 1.5},
                            {.place = 3.0, .slope = "2"}}));
  const Image image = read_image(folder_);
  ASSERT_EQ(image.grid.size, (std::array<int, 3>{3, 2, 4}));
  EXPECT_LT((image.grid.spacing - Vec3(0.6, 0.8, 1.5)).norm(), 1e-6);
  EXPECT_LT((image.grid.origin - Vec3(5, 6, 0)).norm(), 1e-6);
  EXPECT_EQ(image.modality, "CT");
  for (int n = 0; n < 6; ++n) {
    EXPECT_EQ(image.values[static_cast<std::size_t>(n)], 10.0F + static_cast<float>(n) - 1000.0F);
    EXPECT_EQ(image.values[static_cast<std::size_t>(6 + n)], 20.0F + static_cast<float>(n));
    EXPECT_EQ(image.values[static_cast<std::size_t>(12 + n)],
              2.0F * (30.0F + static_cast<float>(n)));
    EXPECT_EQ(image.values[static_cast<std::size_t>(18 + n)], 0.5F * static_cast<float>(n));
  }
}

TEST_F(FieldDicom, FramesInAnyOrderOfTheirPlacesGiveTheSameVolume) {
  for (const std::vector<int>& order : {std::vector<int>{0, 1, 2, 3, 4, 5},
                                        {5, 4, 3, 2, 1, 0},
                                        {3, 0, 5, 1, 4, 2},
                                        {5, 2, 4, 3, 1, 0}}) {
    std::vector<Frame> frames;
    for (const int k : order) {  // of frame n the values are 10 n and more: now those of its place
      const int shift = 10 * (k - static_cast<int>(frames.size()));
      frames.push_back({.place = 1.5 * k - 4.0, .intercept = std::to_string(shift)});
    }
    write("ct.dcm", enhanced(frames));
    const Image image = read_image(folder_);
    ASSERT_EQ(image.grid.size, (std::array<int, 3>{3, 2, 6}));
    EXPECT_LT((image.grid.spacing - Vec3(0.6, 0.8, 1.5)).norm(), 1e-6);  // decimals of a float
    EXPECT_LT((image.grid.origin - Vec3(5, 6, -4)).norm(), 1e-6);
    for (std::size_t n = 0; n < image.values.size(); ++n) {
      EXPECT_EQ(image.values[n], static_cast<float>(10 * (n / 6) + n % 6));
    }
  }
}

TEST_F(FieldDicom, FramesWithoutPlacesUnevenOrNotInHounsfieldUnitsAreRefused) {
  write("ct.dcm", enhanced({{.place = 0}, {.place = 1}, {.place = 2}}, /*placed=*/false));
  EXPECT_TRUE(has(read_error(folder_), "3 frames that does not tell where each lies"));
  write("ct.dcm", enhanced({{.place = 0}, {.place = 1}, {.place = 3}}));
  EXPECT_TRUE(has(read_error(folder_), "uneven slices")) << read_error(folder_);
  write("ct.dcm", enhanced({{.place = 0}, {.place = 1, .unit = "Z_EFF"}, {.place = 2}}));
  EXPECT_TRUE(has(read_error(folder_), "not in HU but, by its rescale type, Z_EFF"));
  for (const char* spacing : {"-0.8\\-0.6", "0\\0", "1e9\\1e9"}) {
    write("ct.dcm", enhanced({{.place = 0}, {.place = 1}, {.place = 2}}, true, spacing));
    EXPECT_TRUE(has(read_error(folder_), "expected positive spacing")) << read_error(folder_);
  }
}

TEST_F(FieldDicom, SlicesWithoutTheHeadOfAFileAndWithBytesBehindThePixelsAreRead) {
  for (int k = 0; k < 4; ++k) {
    std::string bytes =
        dicom({.position = Vec3(0, 0, 1.5 * k), .first_value = static_cast<std::int16_t>(10 * k)});
    // The data set begins with group 8.
    const std::size_t data_set = bytes.find(std::string("\x08\x00\x16\x00UI", 6));
    ASSERT_NE(data_set, std::string::npos);
    if (k % 2 == 1) bytes = bytes.substr(data_set);
    if (k >= 2) bytes += std::string(37, '\0');
    write("slice" + std::to_string(k), bytes);
  }
  const Image image = read_image(folder_);
  ASSERT_EQ(image.grid.size, (std::array<int, 3>{3, 2, 4}));
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(image.values[6 * k + 5], 10.0F * static_cast<float>(k) + 5.0F);
  }
}

TEST_F(FieldDicom, TheSeriesThatAloneIsAVolumeIsReadAmongScouts) {
  const auto write_slice = [&](const std::string& series, int k, double place) {
    write(series + "_" + std::to_string(k),
          dicom({.series = "1.2." + series, .number = series, .position = Vec3(0, 0, place)}));
  };
  for (int k = 0; k < 6; ++k) write_slice("3", k, 2.0 * k);
  for (int k = 0; k < 2; ++k) write_slice("1", k, 100.0 * k);
  EXPECT_EQ(read_image(folder_).grid.size[2], 6);
  for (int k = 0; k < 5; ++k) write_slice("4", k, 2.0 * k);
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "3 DICOM series") && has(error, "number 4 has 5 images of 3 x 2 pixels"))
      << error;
}

TEST_F(FieldDicom, ManyImagesOfOnePlaceAreNoVolume) {
  for (int k = 0; k < 5; ++k) {
    write("slice" + std::to_string(k), dicom({.position = Vec3(0, 0, k == 4 ? 1.0 : 0.0),
                                              .first_value = static_cast<std::int16_t>(k)}));
  }
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "at the same place (5 images, places: 2;")) << error;
}

}  // namespace
}  // namespace wireplan::preprocess
