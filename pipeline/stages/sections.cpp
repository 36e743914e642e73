#include "pipeline/stages/sections.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace wireplan::pipeline {
namespace {

// Stages that all sections have in common, and those that are made before a section's others.
constexpr std::array kCommon = {"volume", "segment", "surface", "wall"};
constexpr std::array kFirst = {"volume", "segment", "surface", "centerline"};

template <std::size_t N>
bool is_one_of(const std::array<const char*, N>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::vector<Case> sections_of(const Case& given) {
  std::vector<Case> sections;
  for (std::size_t access = 0; access < given.accesses.size(); ++access) {
    for (std::size_t target = 0; target < given.targets.size(); ++target) {
      choose_section(sections.emplace_back(given), access, target);
    }
  }
  return sections;
}

/// The options, told and forced for stages alone that `chosen` wants.
template <typename Chosen>
RunOptions limited_to(const RunOptions& options, const Chosen& chosen) {
  RunOptions own = options;
  std::erase_if(own.force, [&](const std::string& name) { return !chosen(name); });
  if (options.on_stage) {
    own.on_stage = [&options, chosen](const StageOutcome& outcome) {
      if (chosen(outcome.stage)) options.on_stage(outcome);
    };
  }
  return own;
}

/// The centerline of a section; nothing where a dry run finds that it is to be made.
std::optional<Artifact> make_line(const Case& section, const RunOptions& options, bool first) {
  RunOptions own = limited_to(options, [first](const std::string& name) {
    return is_one_of(kFirst, name) && (first || !is_one_of(kCommon, name));
  });
  if (!is_one_of(kFirst, options.to)) own.to = "centerline";
  own.instead = {};
  const RunResult result = run_stages(section, own);
  if (result.artifacts.empty() || result.artifacts.back().stage != "centerline") return {};
  return result.artifacts.back();
}

/// Of all sections, in their order.
std::vector<std::optional<Artifact>> make_lines(const std::vector<Case>& sections,
                                                const RunOptions& options) {
  std::vector<std::optional<Artifact>> lines;
  std::string problems;
  for (std::size_t k = 0; k < sections.size(); ++k) {
    lines.emplace_back();
    try {
      lines.back() = make_line(sections[k], options, k == 0);
    } catch (const StageError& error) {
      if (error.stage != "centerline") throw;  // of all sections
      const std::string text = error.what();
      if (problems.find(text) == std::string::npos)
        problems += (problems.empty() ? "" : "\n") + text;
    }
  }
  if (!problems.empty()) throw Error(problems);
  return lines;
}

}  // namespace

std::filesystem::path section_folder(const Case& section) {
  const auto of = [](const auto& places, std::size_t chosen) {
    return places.size() > 1 ? folder_name(places[chosen].name) : std::string();
  };
  const std::string access = of(section.accesses, section.access),
                    target = of(section.targets, section.target);
  return access + (access.empty() || target.empty() ? "" : kBetweenNames) + target;
}

void for_each_section(const Case& given, const RunOptions& options,
                      const std::function<void(const Case&, const RunOptions&)>& act) {
  const std::vector<Case> sections = sections_of(given);
  if (sections.size() == 1) return act(sections.front(), options);
  const std::vector<std::optional<Artifact>> lines = make_lines(sections, options);

  const auto models = std::make_shared<ModelStock>();
  for (std::size_t k = 0; k < sections.size(); ++k) {
    const bool first = k == 0;
    RunOptions own = limited_to(options, [first](const std::string& name) {
      return !is_one_of(kFirst, name) && (first || !is_one_of(kCommon, name));
    });
    own.work.models = models;
    for (std::size_t target = 0; target < given.targets.size(); ++target) {
      const auto& line = lines[sections[k].access * given.targets.size() + target];
      if (line) own.beside.emplace_back(centerline_toward(target), *line);
    }
    act(sections[k], own);
  }
}

}  // namespace wireplan::pipeline
