// Headers that promise what their files do not hold: refused at once, whatever the libraries would
// make of them.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <zlib.h>

#include "preprocess/volume/image.h"
#include "tests/dicom.h"
#include "tests/preprocess/image_file.h"

namespace wireplan::preprocess {
namespace {

using DamagedVolume = ImageFile;

/// The most memory that this process has held so far [MB].
double most_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

std::string nrrd(const std::string& sizes, const std::string& encoding, const std::string& more,
                 const std::string& voxels) {
  return "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: " + sizes +
         "\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nendian: little\nencoding: " + encoding +
         "\nspace origin: (0,0,0)\n" + more + "\n" + voxels;
}

std::string meta(const std::string& sizes, const std::string& more, const std::string& voxels,
                 const std::string& data_file = "LOCAL") {
  return "ObjectType = Image\nNDims = 3\n" + more +
         "Offset = 0 0 0\nElementSpacing = 1 1 1\nDimSize = " + sizes +
         "\nElementType = MET_SHORT\nElementDataFile = " + data_file + "\n" + voxels;
}

std::string deflated(const std::string& bytes) {
  std::string packed(compressBound(bytes.size()), '\0');
  uLongf size = packed.size();
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size,
                     reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()),
            Z_OK);
  return packed.substr(0, size);
}

TEST_F(DamagedVolume, OfAHugeSizeTakesNoMemoryForIt) {
  const std::string sizes = "900 900 900", few(64, '1');  // 1.4 GB
  const double before = most_memory();
  for (const char* encoding : {"raw", "gzip", "hex", "ascii"}) {
    SCOPED_TRACE(encoding);
    EXPECT_TRUE(has(read_error(write("huge.nrrd", nrrd(sizes, encoding, "", few))), "cut short"));
  }
  // Sizes whose product passes 64 bits.
  EXPECT_TRUE(
      has(read_error(write("huge.nrrd", nrrd("2147483647 2147483647 8", "raw", "", few))),
          "its sizes (2147483647 2147483647 8) is 2147483647, expected a number of voxels"));
  const std::string packed = "CompressedData = True\nBinaryData = True\n";
  for (const std::string& more :
       {packed, packed + "CompressedDataSize = 10\n", std::string("BinaryData = False\n"),
        std::string("BinaryData = True\nCompressedDataSize = 10\n")}) {
    SCOPED_TRACE(more);
    EXPECT_TRUE(has(read_error(write("huge.mha", meta(sizes, more, few))), "cut short"));
  }
  EXPECT_LT(most_memory() - before, 400.0);  // [MB]
}

TEST_F(DamagedVolume, OfAMetaImageThatDoesNotInflateIsNotReadAsZeros) {
  const std::string whole = deflated(std::string("a\0b\0c\0d\0e\0f\0g\0h\0", 16));
  const auto of = [&](const std::string& packed, const std::string& more = "") {
    return write("packed.mha",
                 meta("2 2 2", "BinaryData = True\nCompressedData = True\n" + more, packed));
  };
  const std::string size = "CompressedDataSize = " + std::to_string(whole.size()) + "\n";
  for (const std::string& told : {size, std::string()}) {  // MetaIO reads zeros without the size
    EXPECT_EQ(read_image(of(whole, told)).values[7], static_cast<float>('h'));
  }
  EXPECT_TRUE(has(read_error(of(std::string(whole.size(), 'x'))),
                  "its CompressedData is True, expected False"));
  EXPECT_TRUE(has(read_error(of(whole.substr(0, whole.size() - 5))), "cut short"));
  EXPECT_TRUE(has(read_error(of(deflated("a few bytes"))), "cut short"));
  std::string changed = whole;
  changed.back() ^= 1;  // of the check sum
  EXPECT_TRUE(has(read_error(of(changed)), "cut short"));
}

TEST_F(DamagedVolume, OfAMetaImageOfFewerNumbersIsNotFilledUp) {
  const auto of = [&](const std::string& text) {
    return write("text.mha", meta("2 2 2", "BinaryData = False\n", text));
  };
  EXPECT_EQ(read_image(of("0 1 2 3 4 5 6 -7.0\n")).values[7], -7.0F);
  EXPECT_TRUE(has(read_error(of("0 1 2 3 4 5 6 seven")), "cut short"));
  EXPECT_TRUE(has(read_error(of("0 1 2 3 4 5 6          ")), "cut short"));
}

TEST_F(DamagedVolume, WhoseVoxelsAreNoFileBesideItIsRefusedAndNotWaitedFor) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe.raw").c_str(), 0600), 0);
  for (const char* name : {"pipe.raw", "absent.raw", "-", "/dev/zero"}) {
    SCOPED_TRACE(name);
    const std::string data_file = std::string("data file: ") + name + "\n";
    for (const fs::path& path : {write("a.nhdr", nrrd("2 2 2", "raw", data_file, "")),
                                 write("a.mhd", meta("2 2 2", "", "", name))}) {
      const std::string error = read_error(path);
      EXPECT_TRUE(has(error, std::string("its voxels lie in ") + name)) << error;
    }
  }
  for (const char* list : {"LIST\na.raw\n", "v%03d.raw 1 2000000000 1\n", "v%d%s.raw 1 2 1\n"}) {
    SCOPED_TRACE(list);
    const std::string more = std::string("datafile: ") + list;
    EXPECT_TRUE(
        has(read_error(write("l.nhdr", nrrd("2 2 2", "raw", more, ""))), "in a list of files"));
  }
  write("Voxels.raw", std::string("\0\0\1\0\2\0\3\0\4\0\5\0\6\0\7\0", 16));
  const fs::path beside = write("b.nhdr", nrrd("2 2 2", "raw", "data file: Voxels.raw\n", ""));
  EXPECT_EQ(read_image(beside).values[7], 7.0F);
}

TEST_F(DamagedVolume, OfAnNrrdWhoseHeaderHasLongLinesEndsNotTheProgram) {
  const std::string voxels(16, '\1'), text(3000, 'x');
  for (const char* start : {"kinds: ", "units: ", "labels: ", "endian: ", "", "odd: "}) {
    SCOPED_TRACE(start);
    const std::string bytes = nrrd("2 2 2", "raw", start + text + "\n", voxels);
    EXPECT_TRUE(has(read_error(write("long.nrrd", bytes)),
                    " of its header has over 500 characters, expected fewer"));
  }
  for (const char* start : {"# ", "Segment0_Tags:=a: ", "content: "}) {
    SCOPED_TRACE(start);
    const std::string bytes = nrrd("2 2 2", "raw", start + text + "\n", voxels);
    EXPECT_EQ(read_image(write("long.nrrd", bytes)).values[7], 257.0F);
  }
}

TEST_F(DamagedVolume, BeyondAnyPatientIsRefused) {
  const std::string voxels(16, '\0');
  const auto nrrd_of = [&](const std::string& word, const std::string& other) {
    std::string text = nrrd("2 2 2", "raw", "", voxels);
    return write("far.nrrd", text.replace(text.find(word), word.size(), other));
  };
  EXPECT_TRUE(has(read_error(nrrd_of("(1,0,0)", "(1e200,0,0)")), "space directions has 1e200"));
  EXPECT_TRUE(has(read_error(nrrd_of("(1,0,0)", "(nan,0,0)")), "space directions has nan"));
  EXPECT_TRUE(has(read_error(nrrd_of("origin: (0", "origin: (1e9")), "space origin has 1e9"));
  std::string text = meta("2 2 2", "", voxels);
  text.replace(text.find("Spacing = 1"), 11, "Spacing = 1e9");
  EXPECT_TRUE(has(read_error(write("far.mha", text)), "within a kilometre"));
}

TEST_F(DamagedVolume, OfPackedDicomSlicesThatPromiseMoreThanTheyHoldIsRefused) {
  for (int k = 0; k < 2; ++k) {
    std::string bytes = dicom_files::dicom({.position = Vec3(0, 0, k), .compressed = true});
    const std::size_t rows = bytes.find(std::string("\x28\0\x10\0US", 6));
    ASSERT_NE(rows, std::string::npos);
    for (const std::size_t at : {rows, rows + 10}) {  // columns stand behind the rows
      bytes[at + 8] = '\0';
      bytes[at + 9] = '\x7f';
    }
    write("slice" + std::to_string(k), bytes);
  }
  const std::string error = read_error(folder_);
  EXPECT_TRUE(has(error, "slice0") && has(error, "cut short")) << error;
}

}  // namespace
}  // namespace wireplan::preprocess
