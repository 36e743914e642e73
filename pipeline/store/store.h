#pragma once
/// Content-addressed artifacts: what a stage made lies in CACHE/<stage>/<key>/, where the key is
/// the SHA-256 of a readable text of all that the stage read. Beside the files lie that text
/// (key.txt) and manifest.json (sizes and digests). A folder appears by one rename, complete or not
/// at all, and several processes may share one cache.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/files/disk.h"

namespace wireplan::pipeline {

/// What the store's folder is for, where it is refused (files/disk.h).
inline constexpr const char* kCachePurpose = "the cache (--cache, or XDG_CACHE_HOME)";

/// One thing that a key depends on: "parameter wall.thickness_mm", "1.0".
struct KeyLine {
  std::string name, value;
};

/// "name: value" on a line each. Expects neither to hold a line break and no name to hold ": ", so
/// that different lists never give the same text; values are JSON texts or digests.
std::string key_text(const std::vector<KeyLine>& lines);

/// The text without the lines of these parameters and of what lies below them: "wires" takes out
/// "parameter wires[0].name".
std::string without_parameters(const std::string& key_text, const std::vector<std::string>& names);

/// The text with other values in the lines of these names. Expects it to have a line of each.
std::string with_values(const std::string& key_text, const std::vector<KeyLine>& lines);

/// What differs between two such texts, one sentence each: "parameter wall.thickness_mm: 1.0 ->
/// 2.0"; of digests only the first digits.
std::vector<std::string> describe_difference(const std::string& before, const std::string& now);

/// A file of this name holds times: it is kept and checked like any other, but two artifacts that
/// differ in it alone have the same contents.
inline constexpr const char* kTimingFile = "timing.json";

/// A file of this name holds numbers for later stages; it is not put into output folders, nor are
/// times: the report has both.
inline constexpr const char* kFiguresFile = "figures.json";

/// What lies in a folder of this name is for later stages alone, as figures are.
inline constexpr const char* kKeptFolder = "kept";

struct ArtifactFile {
  std::string name;  // relative to the artifact's folder, with '/'
  std::uintmax_t bytes = 0;
  std::string sha256;
};

struct Artifact {
  std::string stage, key;
  std::filesystem::path folder;
  double seconds = 0.0;  // that making it took
  std::vector<ArtifactFile> files;

  /// SHA-256 over the names and digests of its files.
  std::string contents() const;
};

/// Whether every file is there and as the manifest says. What cannot be read is not.
bool is_intact(const Artifact& artifact);

class Store {
 public:
  explicit Store(std::filesystem::path root);

  /// $XDG_CACHE_HOME/wireplan, else ~/.cache/wireplan.
  static std::filesystem::path default_root();

  /// The artifact of this key, every file of it read and found as the manifest says; nothing where
  /// it is absent or damaged in any way.
  std::optional<Artifact> find(const std::string& stage, const std::string& key_text) const;

  /// Lets `make` fill an empty temporary folder, adds key.txt and manifest.json, brings all to the
  /// disk and renames it into place. A damaged artifact of that key is replaced. What `make` throws
  /// passes through and leaves nothing behind.
  Artifact commit(const std::string& stage, const std::string& key_text,
                  const std::function<void(const std::filesystem::path&)>& make) const;

  /// A piece of a stage's work, kept as soon as it is finished, so that an interrupted stage goes
  /// on from it and every other that needs the same piece takes it. `key_text` names all that it
  /// was made from. Nothing where it is absent or damaged.
  std::optional<std::filesystem::path> find_piece(const std::string& key_text) const;
  std::filesystem::path keep_piece(const std::string& key_text, const std::string& bytes) const;

  /// The right to make one artifact, among all processes that share the cache. Waits while another
  /// process makes it, so look it up again afterwards. `give_up` may be empty; else it is asked
  /// every tenth of a second while waiting, and where it says so nothing is returned.
  std::optional<FileLock> lock(const std::string& stage, const std::string& key_text,
                               const std::function<bool()>& give_up = {}) const;

  /// The lock of a process that reads or makes artifacts: as long as it is held nothing is removed
  /// from the cache. Empty where the cache cannot be written.
  std::optional<FileLock> use() const;

  /// The lock of a process that removes artifacts. Empty where the cache is in use.
  std::optional<FileLock> own() const;

  /// Takes the artifact out of the cache, so that it is made again.
  void forget(const std::string& stage, const std::string& key_text) const;

  /// The key text that a case last used in a stage, for `--explain`: remembered per absolute path
  /// of the case file. Empty where there is none.
  std::string last_key_text(const std::filesystem::path& case_file, const std::string& stage) const;
  void remember(const std::filesystem::path& case_file, const Artifact& artifact) const;

  /// Every artifact whose manifest can be read, by stage and key; its files are not read.
  std::vector<Artifact> artifacts() const;

  const std::filesystem::path& root() const { return root_; }
  std::filesystem::path pieces() const { return root_ / "pieces"; }

 private:
  std::filesystem::path root_;
};

/// Puts the artifacts' files, but for figures and times, into `folder` under their names, by hard
/// link where the file system can and else by copy; what is there already stays. A file that an
/// earlier call put there and that `artifacts` has no longer is removed; other files are not
/// touched.
void publish(const std::vector<Artifact>& artifacts, const std::filesystem::path& folder);

}  // namespace wireplan::pipeline
