#pragma once
/// Image files in a folder of the test's own.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "preprocess/volume/image.h"

namespace wireplan::preprocess {

namespace fs = std::filesystem;

/// A folder of the test's own, removed afterwards.
class ImageFile : public ::testing::Test {
 protected:
  ImageFile() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("wireplan_image_") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~ImageFile() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

  fs::path folder_;
};

inline std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The message of the Error that reading throws; a failure where it throws none.
template <typename Read>
std::string error_of(Read read) {
  try {
    read();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "no Error was thrown";
  return {};
}

inline std::string read_error(const fs::path& path) {
  return error_of([&] { read_image(path); });
}

inline bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace wireplan::preprocess
