#include "pipeline/files/disk.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <random>
#include <sstream>

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void throw_refused(const fs::path& path, const std::string& what, int reason) {
  throw DiskError(path.string() + ": cannot be " + what + " (" + std::strerror(reason) +
                  "); check that its folder exists, its permissions and the free space");
}

// Returns 0 or the number of the system's error.
int write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

/// The folder, or what is there of those above it that it would be made in.
fs::path find_there(const fs::path& folder, const std::string& purpose) {
  for (fs::path place = fs::absolute(folder);; place = place.parent_path()) {
    std::error_code refused;
    const fs::file_status status = fs::status(place, refused),
                          link = fs::symlink_status(place, refused);
    const auto refuse = [&](const std::string& why) {
      throw Error(folder.string() + ": " + why + ", expected a folder for " + purpose +
                  "; give another, or move away what is there");
    };
    if (!fs::status_known(status)) refuse("cannot be reached (" + refused.message() + ")");
    if (fs::is_symlink(link) && !fs::exists(status)) {
      refuse(place.string() + " is a link that leads nowhere");
    }
    if (fs::is_directory(status) || !place.has_relative_path()) return place;
    if (!fs::exists(status)) continue;
    refuse(fs::equivalent(place, folder, refused)
               ? std::string("is a file")
               : "lies under " + place.string() + ", which is a file");
  }
}

}  // namespace

void require_no_file(const fs::path& folder, const std::string& purpose) {
  find_there(folder, purpose);
}

void require_folder(const fs::path& folder, const std::string& purpose) {
  const fs::path there = find_there(folder, purpose);
  // Tried, since root is told that it may write where nothing can be made, as in /proc.
  std::string tried = (there / ".wireplan-XXXXXX").string();
  if (::mkdtemp(tried.data()) != nullptr) {
    ::rmdir(tried.c_str());
    return;
  }
  throw Error(folder.string() + ": nothing may be written in " + there.string() + " (" +
              std::strerror(errno) + "), expected a folder for " + purpose +
              "; give another, or change its permissions");
}

std::string read_if_there(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void write_whole(std::string_view text, const fs::path& file, Durability durability) {
  // Beside the place, to the disk.
  const fs::path beside = name_beside(file);
  const int handle = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (handle < 0) throw_refused(file, "written", errno);
  int failure = write_all(handle, text);
  if (failure == 0 && durability == Durability::kSynced && ::fsync(handle) != 0) failure = errno;
  if (::close(handle) != 0 && failure == 0) failure = errno;

  // Into place.
  if (failure == 0 && std::rename(beside.c_str(), file.c_str()) != 0) failure = errno;
  if (failure != 0) {
    ::unlink(beside.c_str());
    throw_refused(file, "written", failure);
  }
}

void sync(const fs::path& path) {
  const int handle = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = handle >= 0 && ::fsync(handle) == 0;
  const int reason = errno;
  if (handle >= 0) ::close(handle);
  if (!synced) throw_refused(path, "brought to the disk", reason);
}

fs::path name_beside(const fs::path& place) {
  // Process numbers repeat among machines that share a folder, and children have their parent's
  // random number.
  static const unsigned random = std::random_device()();
  static std::atomic<int> counter{0};
  return place.parent_path() /
         (kTemporaryPrefix + std::to_string(random) + "-" + std::to_string(::getpid()) + "-" +
          std::to_string(counter++) + "-" + place.filename().string().substr(0, 16));
}

FileLock::FileLock(FileLock&& other) noexcept
    : file_(std::exchange(other.file_, -1)), remove_(std::move(other.remove_)) {}

FileLock::~FileLock() {
  if (file_ < 0) return;
  if (!remove_.empty()) ::unlink(remove_.c_str());
  ::close(file_);  // which also unlocks
}

}  // namespace wireplan::pipeline
