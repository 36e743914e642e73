#pragma once
/// `wireplan cache`: what lies in the store, whether it is intact, and taking out what is not
/// needed.
#include <optional>
#include <string>
#include <vector>

#include "pipeline/store/store.h"

namespace wireplan::pipeline {

struct CacheEntry {
  Artifact artifact;
  std::uintmax_t bytes = 0;  // as the manifest says
  double days_unused = 0.0;  // since it was last made or looked up; 0 where the clock went back
};

/// Every artifact, by stage and key.
std::vector<CacheEntry> list_cache(const Store& store);

/// Bytes on the disk, each file once however often it is linked, with pieces and leftovers.
std::uintmax_t bytes_on_disk(const Store& store);

struct CacheDamage {
  std::filesystem::path place;  // of an artifact or a piece
  std::string what;
};

/// Reads every byte of every artifact and piece.
std::vector<CacheDamage> verify_cache(const Store& store);

struct PruneOptions {
  std::optional<double> unused_days;        // removes what was not used for this long
  std::optional<std::uintmax_t> max_bytes;  // then the longest unused, until so much is left
};

struct PruneResult {
  int artifacts = 0, pieces = 0, leftovers = 0;
  std::uintmax_t bytes = 0;  // that it freed on the disk
};

/// Removes what killed runs left (temporary files and folders, locks), what is damaged, what the
/// options say, and pieces older than a day that no artifact holds. Throws `Error` where another
/// process uses the cache.
PruneResult prune_cache(const Store& store, const PruneOptions& options);

}  // namespace wireplan::pipeline
