#pragma once
/// The one place where wireplan's own files are written: whole or not at all, whatever happens in
/// between. What the system refuses becomes a DiskError that names the file.
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "preprocess/base.h"

namespace wireplan::pipeline {

/// All bytes of a file; empty where it cannot be read, for files whose absence is no error.
std::string read_if_there(const std::filesystem::path& file);

/// Whether the bytes must be safe from a power failure when the call returns. Files that are
/// checked by their digest on reading need not be: what is lost is made again.
enum class Durability { kSynced, kChecked };

/// Writes under a temporary name beside the place and renames. A failure leaves the place as it was
/// and nothing beside it.
void write_whole(std::string_view text, const std::filesystem::path& file,
                 Durability durability = Durability::kSynced);

/// Brings a file or folder to the disk.
void sync(const std::filesystem::path& path);

/// Refuses a folder in whose place or way a file stands, or in which nothing may be written, before
/// work is done that would be lost. `purpose` says what it is for and how another is given: "the
/// results (--output)". Makes nothing. Throws `Error`, as who chose the folder can mend it.
void require_folder(const std::filesystem::path& folder, const std::string& purpose);

/// The same without asking whether something may be written: of a cache that may hold all.
void require_no_file(const std::filesystem::path& folder, const std::string& purpose);

/// A name in the same folder that no other process, of whatever machine, and no other call uses: so
/// that a rename between the two is one step of the file system. It starts with kTemporaryPrefix.
std::filesystem::path name_beside(const std::filesystem::path& place);
inline constexpr const char* kTemporaryPrefix = ".part-";

/// A lock on an open file, among all processes: held until the end of its scope or of the process.
class FileLock {
 public:
  /// Takes over the open file. `remove` is removed before the lock is let go; it may be empty.
  explicit FileLock(int file, std::filesystem::path remove = {})
      : file_(file), remove_(std::move(remove)) {}
  FileLock(FileLock&& other) noexcept;
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

 private:
  int file_;
  std::filesystem::path remove_;
};

}  // namespace wireplan::pipeline
