#include "pipeline/bench/opened_case.h"

namespace wireplan::pipeline {

Case read_one_section(const std::string& path, const std::vector<std::string>& overrides) {
  Case given = read_case(path, overrides);
  choose_section(given, 0, 0);
  given.accesses.resize(1);
  given.targets.resize(1);
  return given;
}

OpenedCase open_case(const Case& given, const std::filesystem::path& cache) {
  RunOptions options;
  options.cache = cache.empty() ? Store::default_root() : cache;
  options.to = "wall";
  OpenedCase opened{std::make_unique<Workspace>(given, options.work, Store(options.cache)),
                    run_stages(given, options)};
  for (const Artifact& artifact : opened.made.artifacts) opened.work->add(artifact);
  return opened;
}

}  // namespace wireplan::pipeline
