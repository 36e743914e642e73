#include "pipeline/commands/commands.h"

#include <CLI/CLI.hpp>

#include "pipeline/commands/subcommands.h"
#include "pipeline/report/report.h"
#include "plan/batch.h"

namespace wireplan::pipeline {

namespace fs = std::filesystem;

Failure describe_failure() {
  try {
    throw;
  } catch (const DiskError& error) {
    return {kOurFault, error.what()};
  } catch (const Error& error) {
    return {kBadInput, error.what()};
  } catch (const fs::filesystem_error& error) {
    return {kOurFault, error.path1().string() + ": " + error.code().message() +
                           " (check the disk's space and the folder's permissions)"};
  } catch (const plan::Interrupted& stop) {
    return {kInterrupted, stop.what()};
  } catch (const std::exception& error) {
    return {kOurFault, std::string("internal error, please report it: ") + error.what()};
  }
}

int run_command(int argc, const char* const* argv) {
  CLI::App app(
      "Plans which guidewire to push in, and how. Research use only; not a medical device.",
      "wireplan");
  app.set_version_flag("--version", build_info().at("version").get<std::string>() + " (" +
                                        build_info().at("revision").get<std::string>() + ")");
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 no plan reaches the target, 2 bad input, 3 our fault, 130 "
      "interrupted.");
  int code = kDone;

  // In the order of the help.
  for (const auto add : {add_run, add_trials, add_report, add_batch, add_cache, add_status,
                         add_check, add_inspect, add_new, add_wires, add_devices, add_compare,
                         add_simulate, add_phantom, add_render, add_bench}) {
    add(app, code);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kBadInput;
  }
  return code;
}

}  // namespace wireplan::pipeline
