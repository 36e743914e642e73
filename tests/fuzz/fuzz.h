#pragma once
/// What the fuzz targets share. A parser takes any bytes and either accepts them or throws `Error`;
/// anything else (a crash, another exception, a sanitizer's finding) is a defect.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "preprocess/base.h"

namespace wireplan::fuzz {

/// A folder of this process, in memory where the system has one there; removed at its end.
class Folder {
 public:
  Folder() {
    const std::filesystem::path memory = "/dev/shm";
    path_ =
        (std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path()) /
        ("wireplan-fuzz-" + std::to_string(::getpid()));
    std::filesystem::create_directories(path_);
    ::setenv("TMPDIR", path_.c_str(), 1);  // so what a reader writes lies in memory too
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  /// Writes the bytes under that name.
  std::filesystem::path write(const std::string& name, std::string_view bytes) const {
    const std::filesystem::path file = path_ / name;
    if (file.parent_path() != path_) std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }

 private:
  std::filesystem::path path_;
};

inline const Folder& folder() {
  static const Folder kFolder;
  return kFolder;
}

/// What stands between the files of an input that is a folder.
inline constexpr std::string_view kNextFile = "-next-file-";

/// The files of an input, at least one and at most so many that a folder shows all it can do.
inline std::vector<std::string_view> files_in(std::string_view bytes) {
  constexpr std::size_t kMost = 8;
  std::vector<std::string_view> files;
  for (std::size_t end = 0; end != std::string_view::npos && files.size() < kMost;) {
    end = bytes.find(kNextFile);
    files.push_back(bytes.substr(0, end));
    if (end != std::string_view::npos) bytes.remove_prefix(end + kNextFile.size());
  }
  return files;
}

inline std::string_view view(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace wireplan::fuzz
