#include "pipeline/commands.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <memory>

#include "pipeline/bench.h"
#include "pipeline/case_file.h"
#include "pipeline/catalogue.h"
#include "pipeline/check.h"
#include "pipeline/phantom_file.h"
#include "pipeline/report.h"
#include "pipeline/scene_run.h"
#include "pipeline/stages.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// Set by Ctrl-C. A signal handler reaches nothing but a global.
std::atomic<bool> stop_asked = false;
static_assert(std::atomic<bool>::is_always_lock_free);

// The second Ctrl-C ends the program at once.
void ask_to_stop(int signal) {
  stop_asked = true;
  std::signal(signal, SIG_DFL);
}

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 512> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

std::shared_ptr<spdlog::logger> make_log() {
  auto log = std::make_shared<spdlog::logger>(
      "wireplan", std::make_shared<spdlog::sinks::stderr_color_sink_st>());
  log->set_pattern("%v");
  return log;
}

// "[#####.....]  12/36  about 40 s to go" on one line of a terminal; nothing elsewhere.
class ProgressBar {
 public:
  ~ProgressBar() { clear(); }

  void show(int done, int total) {
    if (!terminal_) return;
    const auto now = std::chrono::steady_clock::now();
    if (first_ < 0) {
      first_ = done - 1;
      start_ = now;
    }
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    const double to_go = elapsed / (done - first_) * (total - done);
    constexpr int kWidth = 30;
    const int filled = kWidth * done / total;
    std::cerr << "\r[" << std::string(filled, '#') << std::string(kWidth - filled, '.') << "]  "
              << done << "/" << total << format("  about %.0f s to go   ", to_go) << std::flush;
    shown_ = true;
    if (done == total) clear();
  }

 private:
  void clear() {
    if (shown_) std::cerr << "\r" << std::string(70, ' ') << "\r" << std::flush;
    shown_ = false;
  }

  bool terminal_ = ::isatty(STDERR_FILENO) == 1;
  bool shown_ = false;
  int first_ = -1;  // trials done before the first call
  std::chrono::steady_clock::time_point start_;
};

// What `run` and `status` are asked for.
struct RunArguments {
  std::string case_path, output, cache, to;
  std::vector<std::string> force, overrides;
  int threads = 0;
  bool dry_run = false, explain = false;
};

const char* state_name(StageState state) {
  switch (state) {
    case StageState::kCached:
      return "cached";
    case StageState::kMade:
      return "made";
    case StageState::kWouldRun:
      return "would run";
  }
  return "";
}

std::string stage_line(const StageOutcome& outcome, bool with_reasons) {
  std::string line = format("%-10s  %-9s", outcome.stage.c_str(), state_name(outcome.state));
  if (outcome.state != StageState::kWouldRun) line += format("  %7.2f s", outcome.seconds);
  if (with_reasons) {
    constexpr std::size_t kShown = 6;  // a changed wire alone brings dozens
    const std::size_t count = outcome.reasons.size();
    for (std::size_t k = 0; k < std::min(kShown, count); ++k) {
      line += "\n            " + outcome.reasons[k];
    }
    if (count > kShown) {
      line += "\n            and " + std::to_string(count - kShown) + " differences more";
    }
  }
  return line;
}

RunOptions run_options(const RunArguments& arguments) {
  RunOptions options;
  options.cache = arguments.cache.empty() ? Store::default_root() : fs::path(arguments.cache);
  options.to = arguments.to;
  options.force = arguments.force;
  options.dry_run = arguments.dry_run;
  options.work.threads = arguments.threads;
  options.work.cancelled = [] { return stop_asked.load(); };
  return options;
}

// Which stages would run, as the answer.
int print_status(const RunArguments& arguments) {
  const Case given = read_case(arguments.case_path, arguments.overrides);
  RunOptions options = run_options(arguments);
  options.dry_run = true;
  for (const StageOutcome& outcome : run_stages(given, options).stages) {
    std::cout << stage_line(outcome, /*with_reasons=*/true) << "\n";
  }
  return kDone;
}

int run_case(const RunArguments& arguments) {
  if (arguments.dry_run) return print_status(arguments);
  const Case given = read_case(arguments.case_path, arguments.overrides);
  const fs::path output =
      arguments.output.empty() ? fs::path("wireplan-out") / given.name : fs::path(arguments.output);

  // The stages, each with a line in the log.
  const std::shared_ptr<spdlog::logger> log = make_log();
  ProgressBar bar;
  RunOptions options = run_options(arguments);
  options.work.progress = [&](int done, int total) { bar.show(done, total); };
  options.on_stage = [&](const StageOutcome& outcome) {
    log->info(stage_line(outcome, arguments.explain));
  };
  std::signal(SIGINT, ask_to_stop);
  const RunResult result = run_stages(given, options);
  publish(result.artifacts, output);

  // The answer.
  if (result.stages.back().stage != "report") {
    std::cout << "done up to " << result.stages.back().stage << ": " << output.string() << "\n";
    return kDone;
  }
  const fs::path file = output / "report.json";
  const Json report = read_json(file, kReportSchema);
  std::cout << describe_best(report) << "\nreport: " << file.string() << "\n";
  return report.at("ranking").empty() ? kNoPlan : kDone;
}

// The "schema" of a file, to tell a case from a scene; empty where it has none.
std::string schema_of(const fs::path& path) {
  if (!fs::is_regular_file(path)) return "";
  std::ifstream stream(path);
  const Json file = Json::parse(stream, nullptr, /*allow_exceptions=*/false);
  return file.is_object() && file.contains("schema") && file["schema"].is_string()
             ? file["schema"].get<std::string>()
             : "";
}

int check_file(const std::string& path, const std::vector<std::string>& overrides) {
  const std::string schema = schema_of(path);
  if (schema.rfind("wireplan.scene/", 0) == 0) {
    read_scene(path);
    std::cout << path << ": the scene is in order\n";
  } else if (schema.rfind("wireplan.phantom/", 0) == 0) {
    read_phantom_spec(path);
    std::cout << path << ": the description is in order\n";
  } else {
    const Case given = read_case(path, overrides);
    check_input(given);
    std::cout << given.file.string() << ": the case is in order, "
              << plan::list_candidates(given.study).size() << " trials\n";
  }
  return kDone;
}

// Sections run from the tip backwards, so the shaft is the last.
int print_wires() {
  std::cout << "name                          diameter  EI tip  EI shaft  tip\n"
               "                                    mm  N mm^2    N mm^2\n";
  for (const CatalogueWire& entry : catalogue()) {
    const simulate::Wire& wire = entry.wire;
    std::string tip = "straight";
    for (const simulate::Section& section : wire.sections) {
      if (section.rest_curvature != 0.0) {
        tip = format("curved, radius %.3g mm over %.3g mm", 1.0 / section.rest_curvature,
                     section.length);
      }
    }
    std::cout << format("%-28s  %8.3f  %6.4g  %8.4g  ", wire.name.c_str(), 2.0 * wire.radius,
                        wire.sections.front().bending_stiffness,
                        wire.sections.back().bending_stiffness)
              << tip << "\n    " << entry.title << ". EI: " << entry.section_sources.back() << "; "
              << entry.source << "\n";
  }
  return kDone;
}

int simulate_file(const std::string& path, const std::string& given_output) {
  const SceneFile scene = read_scene(path);
  const fs::path output =
      given_output.empty() ? fs::path("wireplan-out") / scene.name : fs::path(given_output);
  const SceneAnswer answer = run_scene_file(scene, output);
  std::cout << answer.line << "\nresult: " << (output / "result.json").string() << "\n";
  return answer.solved ? kDone : kNoPlan;
}

int make_phantom_files(const std::string& path, const std::string& output) {
  const preprocess::PhantomSpec spec = read_phantom_spec(path);
  write_phantom(preprocess::make_phantom(spec), output);
  std::cout << "volume: " << (fs::path(output) / "ct.nrrd").string() << "\n";
  return kDone;
}

void add_case_options(CLI::App& command, RunArguments& arguments) {
  command.add_option("CASE", arguments.case_path, "Case file, or a folder with a case.json")
      ->required();
  command.add_option(
      "--cache", arguments.cache,
      "Folder of the artifact store [$XDG_CACHE_HOME/wireplan or ~/.cache/wireplan]");
  command.add_option("--to", arguments.to, "Last stage to run");
  command.add_option("--force", arguments.force, "Stage to run again although it is cached")
      ->allow_extra_args(false);
  command
      .add_option("--set", arguments.overrides, "Change a value of the case: wall.thickness_mm=2")
      ->allow_extra_args(false);
}

}  // namespace

int run_command(int argc, const char* const* argv) {
  CLI::App app(
      "Plans which guidewire, pushed in at which angle, reaches a vessel with the least force.\n"
      "Research use only; not a medical device.",
      "wireplan");
  app.set_version_flag("--version", build_info().at("version").get<std::string>() + " (" +
                                        build_info().at("revision").get<std::string>() + ")");
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 ran but no plan reaches the target, 2 bad input, 3 our fault,\n"
      "130 interrupted. `wireplan COMMAND --help` tells more.");
  int code = kDone;

  RunArguments run_arguments;
  CLI::App* run = app.add_subcommand("run", "Plan a case: from its volume or surface to a ranking");
  add_case_options(*run, run_arguments);
  run->add_option("-o,--output", run_arguments.output, "Results [wireplan-out/CASE NAME]");
  run->add_option("-j,--threads", run_arguments.threads, "Threads of the trials [all cores]")
      ->check(CLI::Range(1, 4096));
  run->add_flag("--dry-run", run_arguments.dry_run, "Only say which stages would run, and why");
  run->add_flag("--explain", run_arguments.explain, "Say why each stage runs");
  run->footer("Example: wireplan run cases/abdomen -o out -j 2");
  run->callback([&] { code = run_case(run_arguments); });

  RunArguments status_arguments;
  CLI::App* status = app.add_subcommand("status", "Which stages are cached, which would run, why");
  add_case_options(*status, status_arguments);
  status->footer("Example: wireplan status cases/abdomen --set wall.thickness_mm=2");
  status->callback([&] { code = print_status(status_arguments); });

  std::string check_path;
  std::vector<std::string> check_overrides;
  CLI::App* check = app.add_subcommand("check", "Check a case or scene without running it");
  check->add_option("FILE", check_path, "Case file or folder, or a scene file")->required();
  check->add_option("--set", check_overrides, "Change a value of the case: wall.thickness_mm=2")
      ->allow_extra_args(false);
  check->footer("Tells all that is wrong at once. Example: wireplan check cases/abdomen");
  check->callback([&] { code = check_file(check_path, check_overrides); });

  CLI::App* wires = app.add_subcommand("wires", "The wire catalogue with its sources");
  wires->footer("Example: wireplan wires");
  wires->callback([&] { code = print_wires(); });

  std::string scene_path, scene_output;
  CLI::App* simulate = app.add_subcommand("simulate", "One wire, its supports, loads and vessel");
  simulate->add_option("SCENE", scene_path, "Scene file")->required();
  simulate->add_option("-o,--output", scene_output,
                       "Results [wireplan-out/NAME OF SCENE OR FOLDER]");
  simulate->footer(
      "Writes result.json, wire.vtp and wire.png; of an insertion the shapes on the way\n"
      "(shapes.pvd), in a vessel the forces on its wall (forces.vtu). Exits 1 where no\n"
      "equilibrium was found.\n"
      "Example: wireplan simulate cases/cantilever/scene.json -o out");
  simulate->callback([&] { code = simulate_file(scene_path, scene_output); });

  std::string spec_path, phantom_output;
  CLI::App* phantom =
      app.add_subcommand("phantom", "A CT volume from an anatomical description, with its truth");
  phantom->add_option("SPEC", spec_path, "Description")->required();
  phantom->add_option("-o,--output", phantom_output, "Folder for volume and truth")->required();
  phantom->footer("Example: wireplan phantom cases/abdomen/phantom.json -o cases/abdomen/data");
  phantom->callback([&] { code = make_phantom_files(spec_path, phantom_output); });

  std::string bench_name, bench_output = "wireplan-out/bench";
  BenchOptions bench_options;
  CLI::App* bench = app.add_subcommand("bench", "Error against run time, stability and throughput");
  bench->add_option("NAME", bench_name, "accuracy, stability or throughput")->required();
  bench->add_option("-o,--output", bench_output, "Folder for results [wireplan-out/bench]");
  bench->add_flag("--quick", bench_options.quick, "A small size, under 20 s");
  bench->add_option("--case", bench_options.case_path, "Throughput: the case whose vessel to take");
  bench->add_option("--set", bench_options.overrides, "Throughput: key=value of that case")
      ->allow_extra_args(false);
  bench->add_option("--cache", bench_options.cache, "Throughput: store of that case's stages");
  bench->footer(
      "Writes NAME.json, NAME.csv and the plot NAME.png, and prints the table.\n"
      "  accuracy   each method's error and time on scenes whose answer is known\n"
      "  stability  stiff and extreme scenes: which method converges, stops or fails\n"
      "  throughput insertions per second and core, rigid and yielding, with their error\n"
      "Example: wireplan bench accuracy -o out");
  bench->callback([&] { code = run_bench(bench_name, bench_output, bench_options); });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kBadInput;
  }
  return code;
}

}  // namespace wireplan::pipeline
