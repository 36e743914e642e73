#pragma once
/// A case whose vessel is made, or taken from the store, for what benches simulate in it. For use
/// in this folder.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/stages/stages.h"

namespace wireplan::pipeline {

/// One section of it, its first.
Case read_one_section(const std::string& path, const std::vector<std::string>& overrides = {});

struct OpenedCase {
  std::unique_ptr<Workspace> work;  // with the stages up to the wall
  RunResult made;                   // they stay in the store as long as this
};

/// In this store, or the default one where that is empty.
OpenedCase open_case(const Case& given, const std::filesystem::path& cache);

}  // namespace wireplan::pipeline
