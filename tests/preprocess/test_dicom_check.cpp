// What stands between a damaged DICOM file and a library that would end the program on it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <string>

#include "preprocess/volume/dicom_check.h"

namespace wireplan::preprocess {
namespace {

namespace fs = std::filesystem;

class DicomCheck : public testing::Test {
 protected:
  DicomCheck()
      : file_(fs::temp_directory_path() / ("wireplan-dicom-" + std::to_string(::getpid()))) {
    std::ifstream stream(fs::path(WIREPLAN_SOURCE_DIR) / "tests/fuzz/corpus/dicom/series.dcm",
                         std::ios::binary);
    const std::string two_slices(std::istreambuf_iterator<char>(stream), {});
    slice_ = two_slices.substr(1, two_slices.find("-next-file-") - 1);
  }
  ~DicomCheck() override { fs::remove(file_); }

  DicomForm form_of(const std::string& bytes) const {
    std::ofstream(file_, std::ios::binary) << bytes;
    return check_dicom(file_);
  }

  fs::path file_;
  std::string slice_;
};

TEST_F(DicomCheck, AWholeSliceIsSoundAndACutOneIsNot) {
  ASSERT_GT(slice_.size(), 400u);
  EXPECT_EQ(form_of(slice_), DicomForm::kSound);
  const std::size_t data_set = slice_.find("1.2.840.10008.1.2.1") + 20;
  int between_elements = 0;
  for (std::size_t length = 0; length < slice_.size(); ++length) {
    const DicomForm form = form_of(slice_.substr(0, length));
    EXPECT_EQ(form == DicomForm::kNone, length < 132) << length;
    // A cut between two elements leaves a sound file of fewer, which has no pixels.
    between_elements += form == DicomForm::kSound;
    EXPECT_TRUE(form != DicomForm::kSound || length >= data_set) << length;
  }
  EXPECT_EQ(between_elements, 21);  // before each element after its head
}

TEST_F(DicomCheck, APaddedFileAndABareDataSetAreKnownAndWhereTheirPixelsEnd) {
  std::size_t end = 0;
  const auto look = [&](const std::string& bytes) {
    std::ofstream(file_, std::ios::binary) << bytes;
    const DicomLook found = look_at_dicom(file_);
    end = found.end;
    return found.form;
  };
  for (const std::size_t padding : {1, 8, 37, 400}) {
    EXPECT_EQ(look(slice_ + std::string(padding, '\0')), DicomForm::kPadded) << padding;
    EXPECT_EQ(end, slice_.size());
  }
  const std::size_t data_set = slice_.find("1.2.840.10008.1.2.1") + 20;
  const std::string bare = slice_.substr(data_set);
  EXPECT_EQ(look(bare), DicomForm::kBare);
  EXPECT_EQ(end, bare.size());
  EXPECT_EQ(look(bare.substr(0, bare.size() - 1)), DicomForm::kDamaged);
  EXPECT_EQ(look(std::string("\x08\x00", 2) + std::string(500, 'x')), DicomForm::kNone);
}

TEST_F(DicomCheck, LengthsBeyondTheEndAndUnknownRepresentationsAreDamage) {
  const std::size_t rows = slice_.find(std::string("\x28\x00\x10\x00US", 6));
  ASSERT_NE(rows, std::string::npos);
  std::string changed = slice_;
  changed[rows + 7] = '\x7f';  // 32 kB of rows
  EXPECT_EQ(form_of(changed), DicomForm::kDamaged);
  changed = slice_;
  changed[rows + 4] = 'X';
  EXPECT_EQ(form_of(changed), DicomForm::kDamaged);
}

TEST_F(DicomCheck, AnElementWhoseHeadLeavesItsItemIsDamage) {
  // An item of 4 bytes, in which a sequence begins whose length counts from beyond it.
  const std::string item("\xfe\xff\x00\xe0", 4), sequence("\x40\x00\x30\xa7SQ\0\0", 8);
  const std::string inside = item + std::string("\x04\0\0\0", 4);
  const std::string beyond = sequence + std::string("\xff\xff\xff\x7f", 4) + item +
                             std::string("\0\0\x01\0", 4) +
                             std::string("\x08\0\x60\0CS\xff\x7f", 8);
  const std::string damaged =
      sequence + std::string("\x0c\0\0\0", 4) + inside + beyond + std::string(16, '\0');
  const std::size_t rows = slice_.find(std::string("\x28\x00\x10\x00US", 6));
  ASSERT_NE(rows, std::string::npos);
  EXPECT_EQ(form_of(slice_.substr(0, rows) + damaged), DicomForm::kDamaged);
}

TEST_F(DicomCheck, SamplesPerPixelThatNoImageHasAreDamage) {
  const std::size_t samples = slice_.find(std::string("\x28\x00\x02\x00US", 6));
  ASSERT_NE(samples, std::string::npos);
  std::string changed = slice_;
  changed[samples + 8] = 2;
  EXPECT_EQ(form_of(changed), DicomForm::kDamaged);
}

}  // namespace
}  // namespace wireplan::preprocess
