#pragma once
/// Each command of the program: its options, help and what it does. One function each adds it to
/// the application; when it is called, `code` becomes its exit code.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

namespace wireplan::pipeline {

// planning_commands.cpp: cases, from the input to the ranking.
void add_run(CLI::App& app, int& code);
void add_trials(CLI::App& app, int& code);
void add_report(CLI::App& app, int& code);
void add_batch(CLI::App& app, int& code);
void add_status(CLI::App& app, int& code);

// inspect.cpp: what a file holds. new_case.cpp: a case for it.
void add_inspect(CLI::App& app, int& code);
void add_new(CLI::App& app, int& code);

// device_commands.cpp: the catalogue.
void add_wires(CLI::App& app, int& code);
void add_devices(CLI::App& app, int& code);

// tool_commands.cpp: what stands by itself.
void add_cache(CLI::App& app, int& code);
void add_check(CLI::App& app, int& code);
void add_compare(CLI::App& app, int& code);
void add_simulate(CLI::App& app, int& code);
void add_phantom(CLI::App& app, int& code);
void add_render(CLI::App& app, int& code);
void add_bench(CLI::App& app, int& code);

/// The option --cache, and the folder that it names: the default where it is not given.
void add_cache_option(CLI::App& command, std::string& folder);
std::filesystem::path cache_folder(const std::string& given);

/// What a folder of --output is for, where it is refused (files/disk.h).
inline constexpr const char* kResults = "the results (--output)";

}  // namespace wireplan::pipeline
