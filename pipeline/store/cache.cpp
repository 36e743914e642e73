#include "pipeline/store/cache.h"

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "pipeline/store/hash.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// A trial that is younger may belong to a run that was stopped and will go on.
constexpr double kDaysOfAPiece = 1.0;

double days_since_written(const fs::path& path) {
  std::error_code gone;
  const fs::file_time_type time = fs::last_write_time(path, gone);
  if (gone) return 0.0;
  const std::chrono::duration<double> age = fs::file_time_type::clock::now() - time;
  return std::max(0.0, age.count() / 86400.0);  // the clock may have been set back
}

bool is_temporary(const fs::path& path) {
  return path.filename().string().starts_with(kTemporaryPrefix);
}

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code absent;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, absent)) {
    entries.push_back(entry.path());
  }
  std::sort(entries.begin(), entries.end());
  return entries;
}

std::vector<fs::path> list_pieces(const Store& store) {
  std::vector<fs::path> pieces;
  for (const fs::path& key : entries_of(store.pieces())) {
    for (const fs::path& piece : entries_of(key)) {
      if (!is_temporary(piece)) pieces.push_back(piece);
    }
  }
  return pieces;
}

bool is_piece_intact(const fs::path& piece) {
  try {
    return hash_file(piece) == piece.filename().string();
  } catch (const Error&) {
    return false;
  }
}

// What no artifact, piece or record of a case is: left by runs that were killed, and folders whose
// manifest cannot be read.
std::vector<fs::path> list_leftovers(const Store& store) {
  std::set<fs::path> artifacts;
  for (const Artifact& artifact : store.artifacts()) artifacts.insert(artifact.folder);
  std::vector<fs::path> leftovers;
  for (const fs::path& folder : entries_of(store.root())) {
    if (!fs::is_directory(folder)) {
      if (is_temporary(folder)) leftovers.push_back(folder);
      continue;
    }
    const bool holds_pieces = folder == store.pieces();
    for (const fs::path& entry : entries_of(folder)) {
      const bool known = entry.extension() == ".json" || artifacts.contains(entry);
      if (is_temporary(entry) || (!holds_pieces && !known)) leftovers.push_back(entry);
      if (!holds_pieces) continue;
      for (const fs::path& piece : entries_of(entry)) {
        if (is_temporary(piece)) leftovers.push_back(piece);
      }
    }
  }
  return leftovers;
}

bool holds(const Artifact& artifact, const fs::path& piece) {
  return std::any_of(artifact.files.begin(), artifact.files.end(), [&](const ArtifactFile& file) {
    return file.sha256 == piece.filename().string();
  });
}

}  // namespace

std::vector<CacheEntry> list_cache(const Store& store) {
  std::vector<CacheEntry> entries;
  for (Artifact& artifact : store.artifacts()) {
    CacheEntry entry{.artifact = std::move(artifact)};
    for (const ArtifactFile& file : entry.artifact.files) entry.bytes += file.bytes;
    entry.days_unused = days_since_written(entry.artifact.folder);
    entries.push_back(std::move(entry));
  }
  return entries;
}

std::uintmax_t bytes_on_disk(const Store& store) {
  std::set<std::pair<dev_t, ino_t>> counted;
  std::uintmax_t bytes = 0;
  std::error_code absent;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(store.root(), absent)) {
    struct stat status {};
    if (::lstat(entry.path().c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    if (counted.insert({status.st_dev, status.st_ino}).second) {
      bytes += static_cast<std::uintmax_t>(status.st_size);
    }
  }
  return bytes;
}

std::vector<CacheDamage> verify_cache(const Store& store) {
  std::vector<CacheDamage> damages;
  std::set<fs::path> told;
  for (const Artifact& artifact : store.artifacts()) {
    told.insert(artifact.folder);
    if (artifact.folder != store.root() / artifact.stage / artifact.key) {
      damages.push_back({artifact.folder, "is not where its manifest says"});
    } else if (!is_intact(artifact)) {
      damages.push_back({artifact.folder, "files differ from the manifest"});
    }
  }
  for (const fs::path& stage : entries_of(store.root())) {
    if (stage == store.pieces()) continue;
    for (const fs::path& folder : entries_of(stage)) {
      const bool named_as_one = folder.filename().string().size() == hash_text("").size();
      if (named_as_one && !told.contains(folder)) {
        damages.push_back({folder, "has no manifest that can be read"});
      }
    }
  }
  for (const fs::path& piece : list_pieces(store)) {
    if (!is_piece_intact(piece)) damages.push_back({piece, "differs from its digest"});
  }
  return damages;
}

PruneResult prune_cache(const Store& store, const PruneOptions& options) {
  PruneResult result;
  if (!fs::is_directory(store.root())) return result;
  const std::optional<FileLock> own = store.own();
  if (!own) {
    throw Error(store.root().string() +
                ": another run uses this cache, expected none; wait until it ends");
  }
  const std::uintmax_t before = bytes_on_disk(store);

  // What is damaged, and what killed runs left.
  for (const CacheDamage& damage : verify_cache(store)) {
    const bool piece = damage.place.parent_path().parent_path() == store.pieces();
    fs::remove_all(damage.place);
    ++(piece ? result.pieces : result.artifacts);
  }
  for (const fs::path& leftover : list_leftovers(store)) {
    fs::remove_all(leftover);
    ++result.leftovers;
  }

  // What was not used for as long as asked, then what was not used for longest.
  std::vector<CacheEntry> entries = list_cache(store);
  std::sort(entries.begin(), entries.end(),
            [](const CacheEntry& a, const CacheEntry& b) { return a.days_unused > b.days_unused; });
  std::uintmax_t kept = 0;
  for (const CacheEntry& entry : entries) kept += entry.bytes;
  std::vector<Artifact> left;
  for (CacheEntry& entry : entries) {
    const bool old = options.unused_days && entry.days_unused >= *options.unused_days;
    const bool too_much = options.max_bytes && kept > *options.max_bytes;
    if (old || too_much) {
      fs::remove_all(entry.artifact.folder);
      kept -= entry.bytes;
      ++result.artifacts;
    } else {
      left.push_back(std::move(entry.artifact));
    }
  }

  // Pieces that no artifact holds, and the folders that became empty.
  for (const fs::path& piece : list_pieces(store)) {
    const bool held = std::any_of(left.begin(), left.end(),
                                  [&](const Artifact& artifact) { return holds(artifact, piece); });
    if (held || (days_since_written(piece) < kDaysOfAPiece && !options.max_bytes)) continue;
    fs::remove(piece);
    ++result.pieces;
  }
  for (const fs::path& key : entries_of(store.pieces())) {
    if (fs::is_empty(key)) fs::remove(key);
  }
  const std::uintmax_t after = bytes_on_disk(store);
  result.bytes = before > after ? before - after : 0;
  return result;
}

}  // namespace wireplan::pipeline
