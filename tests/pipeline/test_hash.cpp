// Digests of inputs.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/store/hash.h"
#include "preprocess/volume/image.h"
#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

TEST(Hash, MatchesThePublishedVectors) {
  // FIPS 180-4 examples and NIST's one million 'a'.
  EXPECT_EQ(hash_text(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hash_text("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hash_text(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Hash, OfAFileIsThatOfItsBytesOverManyPieces) {
  const TemporaryFolder folder;
  const std::string text(3500000, 'x');  // more than three buffers, not a whole number of them
  write_text(text, folder / "large");
  EXPECT_EQ(hash_file(folder / "large"), hash_text(text));
  EXPECT_THROW(hash_file(folder / "absent"), Error);
}

TEST(Hash, OfAFolderFollowsNamesAndContentsAndNotItsPlace) {
  const TemporaryFolder folder;
  write_text("1", folder / "a" / "image_1");
  write_text("2", folder / "a" / "image_2");
  fs::copy(folder / "a", folder / "b");
  const std::string first = hash_input(folder / "a");
  EXPECT_EQ(hash_input(folder / "b"), first);

  write_text("3", folder / "b" / "image_2");
  EXPECT_NE(hash_input(folder / "b"), first);
  write_text("2", folder / "b" / "image_2");
  fs::rename(folder / "b" / "image_2", folder / "b" / "image_3");
  EXPECT_NE(hash_input(folder / "b"), first);
}

TEST(Hash, FollowsTheVoxelsBesideEveryHeaderThatIsRead) {
  if (!preprocess::reads_volumes()) GTEST_SKIP() << "built without imaging";
  const auto meta = [](const std::string& data_line) {
    return "NDims = 3\nDimSize = 2 2 2\n\nElementSpacing = 1 1 1\nOffset = 0 0 0\n"
           "ElementType = MET_UCHAR\n" +
           data_line + "\n";
  };
  const auto nrrd = [](const std::string& data_line) {
    return "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 1\nencoding: raw\n"
           "data file:=a key of somebody's own\n" +
           data_line + "\n\n";
  };
  const TemporaryFolder folder;
  for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{
           {"a.mhd", meta("ElementDataFile = in/a.raw")},
           {"a.mha", meta("ElementDataFile = in/a.raw")},
           {"mark.mhd", meta("\xef\xbb\xbf"
                             "ElementDataFile = in/a.raw")},
           {"windows.mhd", meta("  ElementDataFile = in\\a.raw\r")},
           {"a.nhdr", nrrd("data file: in/a.raw")},
           {"a.nrrd", nrrd("data file: in/a.raw")},
           {"other.nhdr", nrrd("Datafile: in/a.raw")},
           {"letters.NHDR", nrrd("Data File: in/a.raw")}}) {
    SCOPED_TRACE(name);
    write_text(text, folder / name);
    write_text("abcdefgh", folder / "in/a.raw");
    EXPECT_EQ(preprocess::read_image(folder / name).values.front(), static_cast<float>('a'));
    const std::string first = hash_input(folder / name), stamp = input_stamp(folder / name);
    write_text("Abcdefgh", folder / "in/a.raw");
    EXPECT_EQ(preprocess::read_image(folder / name).values.front(), static_cast<float>('A'));
    EXPECT_NE(hash_input(folder / name), first);
    EXPECT_NE(input_stamp(folder / name), stamp);
  }
}

TEST(Hash, OfAHeaderFollowsTheVoxelsBesideIt) {
  const TemporaryFolder folder;
  for (const auto& [name, line] : {std::pair("a.mhd", "ElementDataFile = a.raw\n"),
                                   std::pair("a.nhdr", "data file: a.raw\n")}) {
    SCOPED_TRACE(name);
    write_text(std::string("first = 1\n") + line, folder / name);
    write_text("1", folder / "a.raw");
    const std::string first = hash_input(folder / name), stamp = input_stamp(folder / name);
    write_text("2", folder / "a.raw");
    EXPECT_NE(hash_input(folder / name), first);
    EXPECT_NE(input_stamp(folder / name), stamp);
    fs::remove(folder / "a.raw");
    EXPECT_EQ(hash_input(folder / name), hash_file(folder / name));
  }
}

}  // namespace
}  // namespace wireplan::pipeline
