#include "pipeline/store/store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <future>
#include <sstream>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "pipeline/files/clock.h"
#include "pipeline/files/json_reader.h"
#include "pipeline/store/hash.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKeyFile = "key.txt";
constexpr const char* kManifestFile = "manifest.json";
constexpr const char* kManifestSchema = "wireplan.manifest/1";
constexpr const char* kUseFile = "in-use.lock";
constexpr const char* kPublishedFile = ".wireplan-files";  // in an output folder
constexpr fs::perms kReadOnly =
    fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read;

std::vector<ArtifactFile> list_files(const fs::path& folder) {
  std::vector<ArtifactFile> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    files.push_back({entry.path().lexically_relative(folder).generic_string(), entry.file_size(),
                     hash_file(entry.path())});
  }
  std::sort(files.begin(), files.end(),
            [](const ArtifactFile& a, const ArtifactFile& b) { return a.name < b.name; });
  return files;
}

// Brings all of them to the disk, some at once: it takes as long for these as for one.
void sync_all(const std::vector<fs::path>& paths) {
  constexpr std::size_t kAtOnce = 8;  // of 1, 4, 8 and 16 the fastest
  std::vector<std::future<void>> parts;
  for (std::size_t part = 0; part < std::min(kAtOnce, paths.size()); ++part) {
    parts.push_back(std::async(std::launch::async, [&paths, part] {
      for (std::size_t k = part; k < paths.size(); k += kAtOnce) sync(paths[k]);
    }));
  }
  for (std::future<void>& part : parts) part.get();
}

// Written without a line break at the end: cut at any byte it is no longer JSON.
std::string manifest_text(const Artifact& artifact) {
  Json files = Json::array();
  for (const ArtifactFile& file : artifact.files) {
    files.push_back({{"name", file.name}, {"bytes", file.bytes}, {"sha256", file.sha256}});
  }
  const Json manifest = {{"schema", kManifestSchema},
                         {"stage", artifact.stage},
                         {"key", artifact.key},
                         {"seconds", artifact.seconds},
                         {"files", files}};
  return manifest.dump(2);
}

// Nothing where the manifest is absent, cut or not ours: a miss, not an error.
std::optional<Artifact> read_manifest(const fs::path& folder) {
  const Json manifest =
      Json::parse(read_if_there(folder / kManifestFile), nullptr, /*allow_exceptions=*/false);
  if (!manifest.is_object()) return {};
  try {
    if (manifest.at("schema") != kManifestSchema) return {};
    Artifact artifact{manifest.at("stage"), manifest.at("key"), folder, manifest.at("seconds"), {}};
    for (const Json& file : manifest.at("files")) {
      artifact.files.push_back({file.at("name"), file.at("bytes"), file.at("sha256")});
    }
    return artifact;
  } catch (const Json::exception&) {
    return {};
  }
}

// Opens a lock file, making it where it is not; negative where the file system refuses. For
// writing where that may be: NFS gives no exclusive lock on a file that is open for reading alone.
int open_lock(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file >= 0) return file;
  return ::open(path.c_str(), O_RDONLY | O_CREAT | O_CLOEXEC, 0666);
}

// Whether the open file is still what stands under the name: a lock on a file that another process
// has removed locks nothing. The name is opened, which asks an NFS server; its attributes may be
// seconds old.
bool stands_at(int file, const fs::path& path) {
  const int again = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (again < 0) return false;
  const FileLock closed_at_end(again);
  struct stat open {
  }, named{};
  return ::fstat(file, &open) == 0 && ::fstat(again, &named) == 0 && open.st_ino == named.st_ino &&
         open.st_dev == named.st_dev;
}

// Removes what a killed process left under temporary names for that place. Only for the one that
// may write there.
void remove_leftovers(const fs::path& place) {
  const std::string ending = '-' + place.filename().string().substr(0, 16);
  std::vector<fs::path> leftovers;
  for (const fs::directory_entry& entry : fs::directory_iterator(place.parent_path())) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(kTemporaryPrefix) && name.ends_with(ending)) {
      leftovers.push_back(entry.path());
    }
  }
  for (const fs::path& leftover : leftovers) fs::remove_all(leftover);
}

fs::path pointer_file(const fs::path& root, const fs::path& case_file) {
  return root / "cases" / (hash_text(fs::weakly_canonical(case_file).string()) + ".json");
}

Json read_pointers(const fs::path& file) {
  const Json pointers = Json::parse(read_if_there(file), nullptr, /*allow_exceptions=*/false);
  const bool sound =
      pointers.is_object() && std::all_of(pointers.begin(), pointers.end(),
                                          [](const Json& pointer) { return pointer.is_string(); });
  return sound ? pointers : Json::object();
}

std::vector<KeyLine> parse_key_text(const std::string& text) {
  std::vector<KeyLine> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    const std::size_t colon = line.find(": ");
    if (colon != std::string::npos)
      lines.push_back({line.substr(0, colon), line.substr(colon + 2)});
  }
  return lines;
}

// A digest is told by its first digits, a long value by its beginning.
std::string shorten(const std::string& value) {
  const bool digest =
      value.size() == 64 && value.find_first_not_of("0123456789abcdef") == std::string::npos;
  if (digest) return value.substr(0, 8);
  return value.size() <= 60 ? value : value.substr(0, 57) + "...";
}

// Replaces `to` by a link to, or a copy of, `from`. Only for the one that may write there.
void place_file(const fs::path& from, const fs::path& to) {
  fs::create_directories(to.parent_path());
  remove_leftovers(to);
  const fs::path beside = name_beside(to);
  std::error_code cannot_link;
  fs::create_hard_link(from, beside, cannot_link);
  if (cannot_link) fs::copy_file(from, beside);
  fs::rename(beside, to);
}

// Whether `to` is a link to, or holds the same as, `from`.
bool is_same(const fs::path& from, const fs::path& to, const ArtifactFile& file) {
  std::error_code absent;
  if (fs::equivalent(from, to, absent)) return true;
  if (!fs::is_regular_file(to) || fs::file_size(to) != file.bytes) return false;
  return is_intact({.stage = {},
                    .key = {},
                    .folder = to.parent_path(),
                    .seconds = 0.0,
                    .files = {{to.filename().string(), file.bytes, file.sha256}}});
}

}  // namespace

bool is_intact(const Artifact& artifact) {
  const auto is_as_told = [&](const ArtifactFile& file) {
    const fs::path path = artifact.folder / file.name;
    std::error_code failure;
    return fs::file_size(path, failure) == file.bytes && !failure && hash_file(path) == file.sha256;
  };
  try {
    return std::all_of(artifact.files.begin(), artifact.files.end(), is_as_told);
  } catch (const Error&) {
    return false;
  }
}

std::string key_text(const std::vector<KeyLine>& lines) {
  std::string text;
  for (const KeyLine& line : lines) {
    expects(line.name.find(": ") == std::string::npos && line.name.find('\n') == std::string::npos);
    expects(line.value.find('\n') == std::string::npos);
    text += line.name + ": " + line.value + "\n";
  }
  return text;
}

std::string without_parameters(const std::string& key_text, const std::vector<std::string>& names) {
  std::string kept;
  std::istringstream stream(key_text);
  for (std::string line; std::getline(stream, line);) {
    const bool left_out = std::any_of(names.begin(), names.end(), [&](const std::string& name) {
      const std::string head = "parameter " + name;
      return line.starts_with(head) && line.size() > head.size() &&
             std::string_view(":.[").find(line.at(head.size())) != std::string_view::npos;
    });
    if (!left_out) kept += line + "\n";
  }
  return kept;
}

std::string with_values(const std::string& text, const std::vector<KeyLine>& lines) {
  std::vector<KeyLine> all = parse_key_text(text);
  for (const KeyLine& line : lines) {
    const auto own = std::find_if(all.begin(), all.end(),
                                  [&](const KeyLine& other) { return other.name == line.name; });
    expects(own != all.end());
    own->value = line.value;
  }
  return key_text(all);
}

std::vector<std::string> describe_difference(const std::string& before, const std::string& now) {
  const std::vector<KeyLine> old_lines = parse_key_text(before), new_lines = parse_key_text(now);
  const auto find = [](const std::vector<KeyLine>& lines, const std::string& name) {
    return std::find_if(lines.begin(), lines.end(),
                        [&](const KeyLine& line) { return line.name == name; });
  };
  std::vector<std::string> sentences;
  for (const KeyLine& line : new_lines) {
    const auto old = find(old_lines, line.name);
    if (old == old_lines.end()) {
      sentences.push_back(line.name + ": new, " + shorten(line.value));
    } else if (old->value != line.value) {
      sentences.push_back(line.name + ": " + shorten(old->value) + " -> " + shorten(line.value));
    }
  }
  for (const KeyLine& line : old_lines) {
    if (find(new_lines, line.name) == new_lines.end()) {
      sentences.push_back(line.name + ": no longer there, was " + shorten(line.value));
    }
  }
  return sentences;
}

std::string Artifact::contents() const {
  std::string lines;
  for (const ArtifactFile& file : files) {
    if (fs::path(file.name).filename() != kTimingFile) {
      lines += file.name + ": " + file.sha256 + "\n";
    }
  }
  return hash_text(lines);
}

Store::Store(fs::path root) : root_(std::move(root)) {}

fs::path Store::default_root() {
  // The XDG base directory specification: a relative path in the variable is to be ignored.
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  if (xdg != nullptr && fs::path(xdg).is_absolute()) return fs::path(xdg) / "wireplan";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home != '\0') return fs::path(home) / ".cache" / "wireplan";
  throw Error("no cache folder: neither XDG_CACHE_HOME nor HOME is set; give one with --cache DIR");
}

std::optional<Artifact> Store::find(const std::string& stage, const std::string& key_text) const {
  const std::string key = hash_text(key_text);
  std::optional<Artifact> artifact = read_manifest(root_ / stage / key);
  if (!artifact || artifact->stage != stage || artifact->key != key || !is_intact(*artifact)) {
    return {};
  }
  // When it was last used, for who tidies up; a cache that may not be written keeps no such times.
  ::utimensat(AT_FDCWD, artifact->folder.c_str(), nullptr, 0);
  return artifact;
}

Artifact Store::commit(const std::string& stage, const std::string& key_text,
                       const std::function<void(const fs::path&)>& make) const {
  Artifact artifact{stage, hash_text(key_text), root_ / stage / hash_text(key_text), 0.0, {}};
  fs::create_directories(artifact.folder.parent_path());
  remove_leftovers(artifact.folder);
  const fs::path temporary = name_beside(artifact.folder);
  fs::create_directories(temporary);
  try {
    // The files, with their time.
    const auto start = std::chrono::steady_clock::now();
    make(temporary);
    artifact.seconds = seconds_since(start);
    write_whole(key_text, temporary / kKeyFile, Durability::kChecked);
    artifact.files = list_files(temporary);
    std::erase_if(artifact.files, [](const ArtifactFile& f) { return f.name == kKeyFile; });
    write_whole(manifest_text(artifact), temporary / kManifestFile, Durability::kChecked);

    // To the disk; read-only, since output folders may link to the same bytes.
    std::vector<fs::path> made = {temporary};
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(temporary)) {
      if (entry.is_regular_file()) fs::permissions(entry.path(), kReadOnly);
      made.push_back(entry.path());
    }
    sync_all(made);

    // Into place. Where a folder stands there it is damaged (then it goes) or another process was
    // faster (then its files are as good as ours).
    std::error_code occupied;
    fs::rename(temporary, artifact.folder, occupied);
    if (occupied) {
      if (std::optional<Artifact> other = find(stage, key_text)) {
        fs::remove_all(temporary);
        return *other;
      }
      const fs::path damaged = name_beside(artifact.folder);
      fs::rename(artifact.folder, damaged);
      fs::rename(temporary, artifact.folder);
      fs::remove_all(damaged);
    }
    sync(artifact.folder.parent_path());
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(temporary, ignored);
    throw;
  }
  return artifact;
}

std::optional<fs::path> Store::find_piece(const std::string& key_text) const {
  std::error_code absent;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(pieces() / hash_text(key_text), absent)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(kTemporaryPrefix)) continue;
    try {
      if (hash_file(entry.path()) == name) return entry.path();
    } catch (const Error&) {  // cannot be read: made again
    }
  }
  return {};
}

fs::path Store::keep_piece(const std::string& key_text, const std::string& bytes) const {
  const fs::path file = pieces() / hash_text(key_text) / hash_text(bytes);
  fs::create_directories(file.parent_path());
  write_whole(bytes, file, Durability::kChecked);
  return file;
}

std::optional<FileLock> Store::lock(const std::string& stage, const std::string& key_text,
                                    const std::function<bool()>& give_up) const {
  fs::create_directories(root_ / stage);
  const fs::path path = root_ / stage / (hash_text(key_text) + ".lock");
  for (;;) {
    const int file = open_lock(path);
    if (file < 0) {
      throw DiskError(path.string() + ": cannot be written (" + std::strerror(errno) +
                      "); choose another folder with --cache");
    }
    FileLock open(file);
    if (::flock(file, LOCK_EX | LOCK_NB) == 0) {
      if (stands_at(file, path)) return FileLock(::dup(file), path);
      continue;
    }
    if (errno != EWOULDBLOCK && errno != EINTR) {
      throw DiskError(path.string() + ": cannot be locked (" + std::strerror(errno) +
                      "); choose a folder on another file system with --cache");
    }
    if (give_up && give_up()) return {};
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

std::optional<FileLock> Store::use() const {
  std::error_code refused;
  fs::create_directories(root_, refused);
  const int file = open_lock(root_ / kUseFile);
  if (file < 0) return {};
  FileLock lock(file);
  // Who removes needs seconds at most.
  while (::flock(file, LOCK_SH) != 0) {
    if (errno != EINTR) return {};
  }
  return lock;
}

std::optional<FileLock> Store::own() const {
  const int file = open_lock(root_ / kUseFile);
  if (file < 0) {
    throw DiskError((root_ / kUseFile).string() + ": cannot be written (" + std::strerror(errno) +
                    "); check the folder's permissions");
  }
  FileLock lock(file);
  if (::flock(file, LOCK_EX | LOCK_NB) != 0) return {};
  return lock;
}

std::vector<Artifact> Store::artifacts() const {
  std::vector<Artifact> found;
  std::error_code absent;
  for (const fs::directory_entry& stage : fs::directory_iterator(root_, absent)) {
    if (!stage.is_directory()) continue;
    for (const fs::directory_entry& entry : fs::directory_iterator(stage.path())) {
      if (std::optional<Artifact> artifact = read_manifest(entry.path())) {
        found.push_back(std::move(*artifact));
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const Artifact& a, const Artifact& b) {
    return std::tie(a.stage, a.key) < std::tie(b.stage, b.key);
  });
  return found;
}

void Store::forget(const std::string& stage, const std::string& key_text) const {
  fs::remove_all(root_ / stage / hash_text(key_text));
}

std::string Store::last_key_text(const fs::path& case_file, const std::string& stage) const {
  const Json pointers = read_pointers(pointer_file(root_, case_file));
  const auto key = pointers.find(stage);
  if (key == pointers.end() || !key->is_string()) return "";
  return read_if_there(root_ / stage / key->get<std::string>() / kKeyFile);
}

void Store::remember(const fs::path& case_file, const Artifact& artifact) const {
  const fs::path file = pointer_file(root_, case_file);
  Json pointers = read_pointers(file);
  if (pointers.value(artifact.stage, "") == artifact.key) return;
  pointers[artifact.stage] = artifact.key;
  fs::create_directories(file.parent_path());
  write_json(pointers, file);
}

void publish(const std::vector<Artifact>& artifacts, const fs::path& folder) {
  // One at a time, so that what has a temporary name was left by a process that is gone.
  fs::create_directories(folder);
  const int handle = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const FileLock lock(handle);
  while (handle >= 0 && ::flock(handle, LOCK_EX) != 0 && errno == EINTR) {
  }

  // What is not there yet, or is another file.
  std::vector<std::string> names;
  for (const Artifact& artifact : artifacts) {
    for (const ArtifactFile& file : artifact.files) {
      const fs::path from = artifact.folder / file.name, to = folder / file.name;
      if (from.filename() == kFiguresFile || from.filename() == kTimingFile ||
          file.name.starts_with(std::string(kKeptFolder) + "/")) {
        continue;
      }
      names.push_back(file.name);
      if (!is_same(from, to, file)) place_file(from, to);
    }
  }

  // What an earlier call put there and is no longer made.
  const fs::path list = folder / kPublishedFile;
  std::istringstream earlier(read_if_there(list));
  std::string now;
  for (const std::string& name : names) now += name + "\n";
  if (earlier.str() == now) return;
  for (std::string name; std::getline(earlier, name);) {
    const bool below = fs::path(name).is_relative() && !fs::path(name).empty() &&
                       *fs::path(name).lexically_normal().begin() != "..";
    if (below && std::find(names.begin(), names.end(), name) == names.end()) {
      std::error_code kept;  // a folder of that name that is not empty
      fs::remove(folder / name, kept);
    }
  }
  write_whole(now, list);
}

}  // namespace wireplan::pipeline
