#pragma once
/// The program itself, run on the small case of small_case.h as a user runs it.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>

#include "tests/pipeline/small_case.h"

namespace wireplan::pipeline {

struct Answer {
  int code = -1;         // 128 + its number where a signal ended it
  std::string out, log;  // standard output and error
};

/// Runs `wireplan ARGUMENTS` in the folder, with its cache in folder/cache. `environment` stands
/// before the program: "NAME=value ".
inline Answer run_program(const std::filesystem::path& folder, const std::string& arguments,
                          const std::string& environment = "") {
  const std::string command = "cd '" + folder.string() + "' && " + environment +
                              " XDG_CACHE_HOME='" + (folder / "cache").string() + "' '" +
                              WIREPLAN_PROGRAM + "' " + arguments + " > out.txt 2> log.txt";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          read_text(folder / "out.txt"), read_text(folder / "log.txt")};
}

/// A report without what may differ between equal runs.
inline std::string report_without_timing(const std::filesystem::path& file) {
  Json report = read_json(file, "wireplan.report/2");
  report.erase("timing");
  return report.dump();
}

}  // namespace wireplan::pipeline
