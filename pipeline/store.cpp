#include "pipeline/store.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

#include "pipeline/hash.h"
#include "pipeline/json_reader.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKeyFile = "key.txt";
constexpr const char* kManifestFile = "manifest.json";
constexpr const char* kManifestSchema = "wireplan.manifest/1";
constexpr const char* kPublishedFile = ".wireplan-files";  // in an output folder
constexpr fs::perms kReadOnly =
    fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read;

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

// A name that no other process and no other call uses, in the same folder as `place`: so that a
// rename between the two is one step of the file system.
fs::path name_beside(const fs::path& place) {
  static std::atomic<int> counter{0};
  return place.parent_path() /
         (".part-" + std::to_string(::getpid()) + "-" + std::to_string(counter++) + "-" +
          place.filename().string().substr(0, 16));
}

// Brings a file or folder to the disk.
void sync(const fs::path& path) {
  const int handle = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = handle >= 0 && ::fsync(handle) == 0;
  const int reason = errno;
  if (handle >= 0) ::close(handle);
  if (!synced) {
    throw Error(path.string() + ": cannot be brought to the disk (" + std::strerror(reason) +
                "); free some space or choose another folder with --cache");
  }
}

void write_text(const std::string& text, const fs::path& file) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) {
    throw Error(file.string() + ": cannot be written (" + std::strerror(errno) +
                "); free some space or choose another folder with --cache");
  }
}

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
      Json::parse(read_text(folder / kManifestFile), nullptr, /*allow_exceptions=*/false);
  if (!manifest.is_object() || manifest.value("schema", "") != kManifestSchema) return {};
  try {
    Artifact artifact{manifest.at("stage"), manifest.at("key"), folder, manifest.at("seconds"), {}};
    for (const Json& file : manifest.at("files")) {
      artifact.files.push_back({file.at("name"), file.at("bytes"), file.at("sha256")});
    }
    return artifact;
  } catch (const Json::exception&) {
    return {};
  }
}

bool is_intact(const Artifact& artifact) {
  return std::all_of(artifact.files.begin(), artifact.files.end(), [&](const ArtifactFile& file) {
    const fs::path path = artifact.folder / file.name;
    std::error_code failure;
    return fs::file_size(path, failure) == file.bytes && !failure && hash_file(path) == file.sha256;
  });
}

fs::path lock_file(const fs::path& folder, const std::string& key) {
  return folder / (key + ".lock");
}

fs::path pointer_file(const fs::path& root, const fs::path& case_file) {
  return root / "cases" / (hash_text(fs::weakly_canonical(case_file).string()) + ".json");
}

Json read_pointers(const fs::path& file) {
  const Json pointers = Json::parse(read_text(file), nullptr, /*allow_exceptions=*/false);
  return pointers.is_object() ? pointers : Json::object();
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

// Replaces `to` by a link to, or a copy of, `from`.
void place_file(const fs::path& from, const fs::path& to) {
  fs::create_directories(to.parent_path());
  const fs::path beside = name_beside(to);
  std::error_code cannot_link;
  fs::create_hard_link(from, beside, cannot_link);
  if (cannot_link) fs::copy_file(from, beside);
  fs::rename(beside, to);
}

}  // namespace

std::string key_text(const std::vector<KeyLine>& lines) {
  std::string text;
  for (const KeyLine& line : lines) {
    expects(line.name.find(": ") == std::string::npos && line.name.find('\n') == std::string::npos);
    expects(line.value.find('\n') == std::string::npos);
    text += line.name + ": " + line.value + "\n";
  }
  return text;
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
  return artifact;
}

Artifact Store::commit(const std::string& stage, const std::string& key_text,
                       const std::function<void(const fs::path&)>& make) const {
  Artifact artifact{stage, hash_text(key_text), root_ / stage / hash_text(key_text), 0.0, {}};
  const fs::path temporary = name_beside(artifact.folder);
  fs::create_directories(temporary);
  try {
    // The files, with their time.
    const auto start = std::chrono::steady_clock::now();
    make(temporary);
    artifact.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    write_text(key_text, temporary / kKeyFile);
    artifact.files = list_files(temporary);
    std::erase_if(artifact.files, [](const ArtifactFile& f) { return f.name == kKeyFile; });
    write_text(manifest_text(artifact), temporary / kManifestFile);

    // To the disk; read-only, since output folders may link to the same bytes.
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(temporary)) {
      sync(entry.path());
      if (entry.is_regular_file()) fs::permissions(entry.path(), kReadOnly);
    }
    sync(temporary);

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
  // Who still waits for the lock finds the artifact once it has it.
  fs::remove_all(unfinished(stage, key_text));
  fs::remove(lock_file(root_ / stage, artifact.key));
  return artifact;
}

fs::path Store::unfinished(const std::string& stage, const std::string& key_text) const {
  return root_ / stage / (hash_text(key_text) + ".unfinished");
}

StoreLock::~StoreLock() {
  if (file_ >= 0) ::close(file_);  // which also unlocks
}

std::optional<StoreLock> Store::lock(const std::string& stage, const std::string& key_text,
                                     const std::function<bool()>& give_up) const {
  fs::create_directories(root_ / stage);
  const fs::path path = lock_file(root_ / stage, hash_text(key_text));
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file < 0) {
    throw Error(path.string() + ": cannot be written (" + std::strerror(errno) +
                "); choose another folder with --cache");
  }
  StoreLock lock(file);
  while (::flock(file, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK && errno != EINTR) {
      throw Error(path.string() + ": cannot be locked (" + std::strerror(errno) +
                  "); choose a folder on another file system with --cache");
    }
    if (give_up && give_up()) return {};
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return lock;
}

void Store::forget(const std::string& stage, const std::string& key_text) const {
  fs::remove_all(root_ / stage / hash_text(key_text));
}

std::string Store::last_key_text(const fs::path& case_file, const std::string& stage) const {
  const Json pointers = read_pointers(pointer_file(root_, case_file));
  const auto key = pointers.find(stage);
  if (key == pointers.end() || !key->is_string()) return "";
  return read_text(root_ / stage / key->get<std::string>() / kKeyFile);
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
  // What is not there yet, or is another file.
  std::vector<std::string> names;
  for (const Artifact& artifact : artifacts) {
    for (const ArtifactFile& file : artifact.files) {
      const fs::path from = artifact.folder / file.name, to = folder / file.name;
      if (from.filename() == kFiguresFile || from.filename() == kTimingFile) continue;
      names.push_back(file.name);
      std::error_code absent;
      if (fs::equivalent(from, to, absent)) continue;
      const bool same = fs::is_regular_file(to) && fs::file_size(to) == file.bytes &&
                        hash_file(to) == file.sha256;
      if (!same) place_file(from, to);
    }
  }

  // What an earlier call put there and is no longer made.
  const fs::path list = folder / kPublishedFile;
  std::istringstream earlier(read_text(list));
  std::string now;
  for (const std::string& name : names) now += name + "\n";
  if (earlier.str() == now) return;
  for (std::string name; std::getline(earlier, name);) {
    if (std::find(names.begin(), names.end(), name) == names.end()) fs::remove(folder / name);
  }
  write_text(now, list);
}

}  // namespace wireplan::pipeline
