#include "pipeline/commands/commands.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iostream>
#include <memory>

#include "pipeline/bench/bench.h"
#include "pipeline/commands/batch_run.h"
#include "pipeline/commands/check.h"
#include "pipeline/commands/scene_run.h"
#include "pipeline/files/case_file.h"
#include "pipeline/files/catalogue.h"
#include "pipeline/files/phantom_file.h"
#include "pipeline/files/text.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/render.h"
#include "pipeline/report/report.h"
#include "pipeline/stages/shards.h"
#include "pipeline/stages/stages.h"
#include "pipeline/store/cache.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr double kBytesPerMb = 1e6;

// Set by Ctrl-C. A signal handler reaches nothing but a global.
std::atomic<bool> stop_asked = false;
static_assert(std::atomic<bool>::is_always_lock_free);

// The second Ctrl-C ends the program at once.
void ask_to_stop(int signal) {
  stop_asked = true;
  std::signal(signal, SIG_DFL);
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
    if (done < total) return;
    clear();
    first_ = -1;  // of the next work
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
  bool after_shards = false;  // told where shards left out trials that are then run here
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

fs::path cache_folder(const std::string& given) {
  return given.empty() ? Store::default_root() : fs::path(given);
}

RunOptions run_options(const RunArguments& arguments) {
  RunOptions options;
  options.cache = cache_folder(arguments.cache);
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

// One shard of a case's trials.
int run_shard(const RunArguments& arguments, const std::string& shard, int round) {
  const Share share = parse_share(shard, round);
  const Case given = read_case(arguments.case_path, arguments.overrides);
  const std::shared_ptr<spdlog::logger> log = make_log();
  ProgressBar bar;
  RunOptions options = run_options(arguments);
  options.work.progress = [&](int done, int total) { bar.show(done, total); };
  options.on_stage = [&](const StageOutcome& outcome) { log->info(stage_line(outcome, false)); };
  std::signal(SIGINT, ask_to_stop);
  std::cout << describe_share(share, run_share_of_case(given, options, share)) << "\n";
  return kDone;
}

// What shards left out, if the trials were made just now.
std::string missing_shards(const RunResult& result) {
  for (const StageOutcome& stage : result.stages) {
    if (stage.stage == "trials" && stage.state != StageState::kMade) return "";
  }
  for (const Artifact& artifact : result.artifacts) {
    if (artifact.stage != "trials") continue;
    const FirstRound first = read_first_round(artifact);
    if (first.run == 0) return "";
    return std::to_string(first.run) + " of the " + std::to_string(first.trials) +
           " trials of round 1 were in the store from no shard and were run here";
  }
  return "";
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
  if (arguments.after_shards) {
    const std::string missing = missing_shards(result);
    if (!missing.empty()) log->warn(missing);
  }

  // The answer.
  if (result.stages.back().stage != "report") {
    std::cout << "done up to " << result.stages.back().stage << ": " << output.string() << "\n";
    return kDone;
  }
  const fs::path file = output / "report.json";
  const Json report = read_report(file);
  std::cout << describe_best(report) << "\nreport: " << file.string() << "\n";
  const fs::path page = output / "report.html";
  if (fs::exists(page)) std::cout << "page: " << page.string() << "\n";
  return report.at("ranking").empty() ? kNoPlan : kDone;
}

struct BatchArguments {
  std::vector<std::string> cases;
  std::string output, cache;
  int threads = 0;
  double memory_gb = 0.0;
  bool fail_fast = false, list = false;
};

int run_batch_command(const BatchArguments& arguments) {
  if (arguments.list) {
    for (const BatchCase& entry : list_batch_cases(arguments.cases)) {
      if (!std::filesystem::exists(entry.path)) {
        throw Error("batch: " + entry.path.string() + ": no such file or folder");
      }
      std::cout << entry.name << "\t" << entry.path.string() << "\n";
    }
    return kDone;
  }
  if (arguments.output.empty()) {
    throw Error("batch: no folder for batch.json and the results, expected --output DIR");
  }
  BatchRunOptions options{.output = arguments.output,
                          .cache = cache_folder(arguments.cache),
                          .threads = arguments.threads,
                          .memory_gb = arguments.memory_gb,
                          .fail_fast = arguments.fail_fast,
                          .cancelled = [] { return stop_asked.load(); },
                          .on_line =
                              [](const std::string& line) {
                                std::cout << line << std::endl;  // at once, for who watches
                              }};
  std::signal(SIGINT, ask_to_stop);
  const Json batch = run_batch_cases(list_batch_cases(arguments.cases), options);
  std::string counts;
  for (const auto& [outcome, count] : batch.at("counts").items()) {
    if (count == 0) continue;
    counts += (counts.empty() ? "" : ", ") + count.dump() + " " + outcome;
  }
  std::cout << counts << "; batch: " << (fs::path(arguments.output) / "batch.json").string()
            << "\n";
  return exit_code_of(batch);
}

int print_cache(const std::string& folder) {
  const Store store(cache_folder(folder));
  std::cout << "stage       key           MB  unused days\n";
  for (const CacheEntry& entry : list_cache(store)) {
    std::cout << format("%-10s  %s  %8.2f  %11.1f\n", entry.artifact.stage.c_str(),
                        entry.artifact.key.substr(0, 8).c_str(),
                        static_cast<double>(entry.bytes) / kBytesPerMb, entry.days_unused);
  }
  std::cout << store.root().string() << ": "
            << format("%.1f MB on the disk\n",
                      static_cast<double>(bytes_on_disk(store)) / kBytesPerMb);
  return kDone;
}

int verify_cache_command(const std::string& folder) {
  const Store store(cache_folder(folder));
  const std::vector<CacheDamage> damages = verify_cache(store);
  for (const CacheDamage& damage : damages) {
    std::cout << damage.place.string() << ": " << damage.what << "\n";
  }
  std::cout << (damages.empty() ? "every artifact is intact"
                                : std::to_string(damages.size()) +
                                      " damaged; they will be made again when they are needed")
            << "\n";
  return damages.empty() ? kDone : kBadInput;
}

int prune_cache_command(const std::string& folder, const PruneOptions& options) {
  const PruneResult result = prune_cache(Store(cache_folder(folder)), options);
  std::cout << format("removed %d artifacts, %d trials and %d leftovers of stopped runs: %.1f MB\n",
                      result.artifacts, result.pieces, result.leftovers,
                      static_cast<double>(result.bytes) / kBytesPerMb);
  return kDone;
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
    const std::vector<std::string> mended = check_input(given);
    std::cout << given.file.string() << ": the case is in order, "
              << plan::list_candidates(given.study).size() << " trials\n";
    for (const std::string& line : mended) std::cout << "  mended: " << line << "\n";
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

int render_pictures(const std::string& report, const std::string& output) {
  for (const std::string& line : render_report(report, output)) std::cout << line << "\n";
  return kDone;
}

int make_phantom_files(const std::string& path, const std::string& output) {
  const preprocess::PhantomSpec spec = read_phantom_spec(path);
  write_phantom(preprocess::make_phantom(spec), output);
  std::cout << "volume: " << (fs::path(output) / "ct.nrrd").string() << "\n";
  return kDone;
}

void add_cache_option(CLI::App& command, std::string& folder) {
  command.add_option(
      "--cache", folder,
      "Folder of the artifact store [$XDG_CACHE_HOME/wireplan or ~/.cache/wireplan]");
}

void add_case_options(CLI::App& command, RunArguments& arguments) {
  command.add_option("CASE", arguments.case_path, "Case file, or a folder with a case.json")
      ->required();
  add_cache_option(command, arguments.cache);
  command
      .add_option("--set", arguments.overrides, "Change a value of the case: wall.thickness_mm=2")
      ->allow_extra_args(false);
}

void add_stage_options(CLI::App& command, RunArguments& arguments) {
  command.add_option("--to", arguments.to, "Last stage to run");
  command.add_option("--force", arguments.force, "Stage to run again although it is cached")
      ->allow_extra_args(false);
}

// How trials are run; for commands that run them.
void add_trial_options(CLI::App& command, RunArguments& arguments) {
  command.add_option("-j,--threads", arguments.threads, "Threads of the trials [all cores]")
      ->check(CLI::Range(1, 4096));
  command.add_flag(
      "--exhaustive",
      [&](std::int64_t) { arguments.overrides.push_back("search.exhaustive=true"); },
      "Run all candidates in full, not only those that a coarse trial lets hope");
}

}  // namespace

int run_one_case(const fs::path& case_path, const fs::path& output, const fs::path& cache,
                 int threads) {
  return run_case({.case_path = case_path.string(),
                   .output = output.string(),
                   .cache = cache.string(),
                   .to = {},
                   .force = {},
                   .overrides = {},
                   .threads = threads});
}

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
  } catch (const Interrupted& stop) {
    return {kInterrupted, stop.what()};
  } catch (const std::exception& error) {
    return {kOurFault, std::string("internal error, please report it: ") + error.what()};
  }
}

int run_command(int argc, const char* const* argv) {
  CLI::App app(
      "Plans which guidewire, pushed in at which angle, reaches a vessel with the least force.\n"
      "Research use only; not a medical device.",
      "wireplan");
  app.set_version_flag("--version", build_info().at("version").get<std::string>() + " (" +
                                        build_info().at("revision").get<std::string>() + ")");
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 no plan reaches the target, 2 bad input, 3 our fault, 130 "
      "interrupted.");
  int code = kDone;

  RunArguments run_arguments;
  CLI::App* run = app.add_subcommand("run", "Plan a case: from its volume or surface to a ranking");
  add_case_options(*run, run_arguments);
  add_stage_options(*run, run_arguments);
  run->add_option("-o,--output", run_arguments.output, "Results [wireplan-out/CASE NAME]");
  add_trial_options(*run, run_arguments);
  run->add_flag("--dry-run", run_arguments.dry_run, "Only say which stages would run, and why");
  run->add_flag("--explain", run_arguments.explain, "Say why each stage runs");
  run->footer("Example: wireplan run cases/abdomen -o out -j 2");
  run->callback([&] { code = run_case(run_arguments); });

  RunArguments shard_arguments;
  std::string shard;
  int round = 1;
  CLI::App* trials = app.add_subcommand("trials", "One part of a case's trials, for a cluster");
  add_case_options(*trials, shard_arguments);
  trials->add_option("--shard", shard, "K/N: part K of N, from 1")->required();
  trials
      ->add_option("--round", round,
                   "1: scouts, or all in full; 2 on: the probes and full runs that follow")
      ->check(CLI::Range(1, 1000));
  add_trial_options(*trials, shard_arguments);
  trials->footer(
      "Puts its trials into the cache and writes nothing else. Shards run in any order, on any\n"
      "machine that shares the cache; `wireplan report` takes them from there and runs what is\n"
      "missing. Example: wireplan trials cases/abdomen --shard 3/8");
  trials->callback([&] { code = run_shard(shard_arguments, shard, round); });

  RunArguments report_arguments;
  report_arguments.after_shards = true;
  CLI::App* report =
      app.add_subcommand("report", "The report of a case whose trials were run in shards");
  add_case_options(*report, report_arguments);
  report->add_option("-o,--output", report_arguments.output, "Results [wireplan-out/CASE NAME]");
  add_trial_options(*report, report_arguments);
  report->footer(
      "The same files as `wireplan run`. What no shard has run is run here, and told.\n"
      "Example: wireplan report cases/abdomen -o out");
  report->callback([&] { code = run_case(report_arguments); });

  BatchArguments batch_arguments;
  CLI::App* batch = app.add_subcommand("batch", "Plan many cases; one that fails stops no other");
  batch->add_option("CASE", batch_arguments.cases, "Case files, case folders, or a folder of them")
      ->required();
  batch->add_option("-o,--output", batch_arguments.output, "Folder for batch.json and the results");
  batch->add_option("-j,--threads", batch_arguments.threads, "Cases at a time [all cores]")
      ->check(CLI::Range(1, 4096));
  batch
      ->add_option("--memory-gb", batch_arguments.memory_gb,
                   "Memory of all cases together [3/4 of the machine's]")
      ->check(CLI::Range(0.1, 1e6));
  batch->add_flag("--list", batch_arguments.list, "Only print name and file of each case");
  batch->add_flag("--fail-fast", batch_arguments.fail_fast, "Stop after the first that fails");
  add_cache_option(*batch, batch_arguments.cache);
  batch->footer(
      "Exits with the code of the case that ended worst. What is finished is kept: a batch that\n"
      "was stopped goes on from there. Example: wireplan batch study/ -o out --memory-gb 8");
  batch->callback([&] { code = run_batch_command(batch_arguments); });

  std::string cache_root;
  PruneOptions prune_options;
  double unused_days = 0.0, max_gb = 0.0;
  CLI::App* cache = app.add_subcommand("cache", "List, verify or prune the artifact store");
  cache->require_subcommand(1);
  cache->footer("Example: wireplan cache prune --unused-days 30");
  CLI::App* list = cache->add_subcommand("list", "Every artifact, its size and when it was used");
  add_cache_option(*list, cache_root);
  list->callback([&] { code = print_cache(cache_root); });
  CLI::App* verify = cache->add_subcommand("verify", "Read every byte; exits 2 where some differ");
  add_cache_option(*verify, cache_root);
  verify->callback([&] { code = verify_cache_command(cache_root); });
  CLI::App* prune =
      cache->add_subcommand("prune", "Remove what is damaged, and what stopped runs left");
  add_cache_option(*prune, cache_root);
  CLI::Option* days =
      prune->add_option("--unused-days", unused_days, "Also what was not used for so many days")
          ->check(CLI::Range(0.0, 1e5));
  CLI::Option* most =
      prune->add_option("--max-gb", max_gb, "Also what was not used for longest, down to this size")
          ->check(CLI::Range(0.0, 1e6));
  prune->callback([&] {
    if (days->count() > 0) prune_options.unused_days = unused_days;
    if (most->count() > 0) {
      prune_options.max_bytes = static_cast<std::uintmax_t>(max_gb * 1e3 * kBytesPerMb);
    }
    code = prune_cache_command(cache_root, prune_options);
  });

  RunArguments status_arguments;
  CLI::App* status = app.add_subcommand("status", "Which stages are cached, which would run, why");
  add_case_options(*status, status_arguments);
  add_stage_options(*status, status_arguments);
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

  std::vector<fs::path> reports;
  CLI::App* compare = app.add_subcommand("compare", "Wires and plans of several reports");
  compare->add_option("REPORT", reports, "report.json of two cases or more")
      ->required()
      ->expected(2, 100000);
  compare->footer(
      "The same patient with other wires, or many patients with the same.\n"
      "Example: wireplan compare out/one/report.json out/two/report.json");
  compare->callback([&] { std::cout << compare_reports(reports); });

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

  std::string report_path, render_output;
  CLI::App* render = app.add_subcommand("render", "Pictures of a report, without a display");
  render->add_option("REPORT", report_path, "report.json among the files of its run")->required();
  render->add_option("-o,--output", render_output, "Folder for the pictures")->required();
  render->footer(
      "Writes vessel.png (the best plans), forces.png (the largest force on the wall),\n"
      "angles.png (every trial) and numerics.png (error against run time).\n"
      "Example: wireplan render wireplan-out/abdomen/report.json -o pictures");
  render->callback([&] { code = render_pictures(report_path, render_output); });

  std::string bench_name, bench_output = "wireplan-out/bench";
  BenchOptions bench_options;
  CLI::App* bench =
      app.add_subcommand("bench", "Error against run time, stability, throughput, preprocessing");
  bench->add_option("NAME", bench_name, "accuracy, stability, throughput or preprocess")
      ->required();
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
