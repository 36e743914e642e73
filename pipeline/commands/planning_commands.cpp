#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <iostream>
#include <memory>
#include <mutex>

#include "pipeline/commands/batch_run.h"
#include "pipeline/commands/commands.h"
#include "pipeline/commands/subcommands.h"
#include "pipeline/files/case_file.h"
#include "pipeline/files/disk.h"
#include "pipeline/files/text.h"
#include "pipeline/report/anatomy_json.h"
#include "pipeline/report/overview.h"
#include "pipeline/report/page.h"
#include "pipeline/report/report.h"
#include "pipeline/report/verdict_json.h"
#include "pipeline/stages/sections.h"
#include "pipeline/stages/shards.h"
#include "pipeline/stages/stages.h"

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

std::shared_ptr<spdlog::logger> make_log() {
  auto log = std::make_shared<spdlog::logger>(
      "wireplan", std::make_shared<spdlog::sinks::stderr_color_sink_st>());
  log->set_pattern("%v");
  return log;
}

// "[#####.....]  12/36  about 40 s to go" on one line of a terminal; nothing elsewhere. From any
// thread.
class ProgressBar {
 public:
  ~ProgressBar() { clear(); }

  // A line of the log while work goes on.
  void tell(spdlog::logger& log, const std::string& line) {
    const std::lock_guard<std::mutex> lock(mutex_);
    clear();
    log.info(line);
  }

  void show(int done, int total) {
    if (!terminal_) return;
    const std::lock_guard<std::mutex> lock(mutex_);
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

  std::mutex mutex_;
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
  for (const std::string& warning : outcome.warnings) line += "\n            mind: " + warning;
  return line;
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
  options.on_stage = [](const StageOutcome& outcome) {
    std::cout << stage_line(outcome, /*with_reasons=*/true) << "\n";
  };
  for_each_section(given, options, [&](const Case& section, const RunOptions& own) {
    const std::string name = section_name(section);
    if (!name.empty()) std::cout << name << "\n";
    run_stages(section, own);
  });
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
  for_each_section(given, options, [&](const Case& section, const RunOptions& own) {
    const std::string name = section_name(section);
    std::cout << (name.empty() ? "" : name + ": ")
              << describe_share(share, run_share_of_case(section, own, share)) << "\n";
  });
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

void print_files(const fs::path& output) {
  std::cout << "report: " << (output / "report.json").string() << "\n";
  const fs::path page = output / "report.html";
  if (fs::exists(page)) std::cout << "page: " << page.string() << "\n";
}

// The answer of a case of one section, whose report is published.
int print_answer(const fs::path& output) {
  const Json report = read_report(output / "report.json");
  std::cout << describe_verdict(report) << describe_best(report) << "\n";
  print_files(output);
  return report.at("ranking").empty() || answer_of(report) == "not feasible" ? kNoPlan : kDone;
}

// The answer of a case of several, whose reports are published below.
int print_overview(const Case& given, const std::vector<Case>& sections, const fs::path& output) {
  std::vector<SectionReport> reports;
  for (const Case& section : sections) {
    const std::string folder = section_folder(section).string();
    reports.push_back({.access = section.accesses[section.access].name,
                       .target = section.targets[section.target].name,
                       .folder = folder,
                       .report = read_report(output / folder / "report.json")});
  }
  const Json overview = build_overview(given.name, reports);
  tell_sections(overview, output);
  write_json(overview, output / "report.json");
  write_whole(overview_csv(overview), output / "sections.csv");
  if (page_missing().empty()) write_whole(build_overview_page(overview), output / "report.html");
  std::cout << describe_overview(overview) << "\n";
  print_files(output);
  return serves_all_targets(overview) ? kDone : kNoPlan;
}

constexpr const char* kFirstPage = "preliminary.html";

int run_case(const RunArguments& arguments) {
  if (arguments.dry_run) return print_status(arguments);
  const Case given = read_case(arguments.case_path, arguments.overrides);
  const fs::path output =
      arguments.output.empty() ? fs::path("wireplan-out") / given.name : fs::path(arguments.output);
  require_folder(output, kResults);

  // The stages, each with a line in the log.
  const std::shared_ptr<spdlog::logger> log = make_log();
  ProgressBar bar;
  RunOptions options = run_options(arguments);
  options.work.progress = [&](int done, int total) { bar.show(done, total); };
  options.work.told = [&](const std::string& line) { bar.tell(*log, line); };
  options.on_stage = [&](const StageOutcome& outcome) {
    log->info(stage_line(outcome, arguments.explain));
  };
  if (page_missing().empty() && (options.to.empty() || options.to == "report")) {
    options.before_plans = [&](Workspace& work) {
      const fs::path page = output / section_folder(work.given()) / kFirstPage;
      fs::create_directories(page.parent_path());
      write_whole(make_first_page(work), page);
      bar.tell(*log, "first page, without errors and disturbances: " + page.string());
    };
  }
  std::signal(SIGINT, ask_to_stop);
  std::vector<Case> done;
  std::string last;
  for_each_section(given, options, [&](const Case& section, const RunOptions& own) {
    const std::string name = section_name(section);
    if (!name.empty()) log->info(name);
    const fs::path folder = output / section_folder(section);
    require_folder(folder, kResults);
    const RunResult result = run_stages(section, own);
    publish(result.artifacts, folder);
    fs::remove(folder / kFirstPage);
    const fs::path look = folder / "slices.png";
    if (fs::exists(look)) log->info("look first at the outline of the mask: " + look.string());
    const std::string missing = arguments.after_shards ? missing_shards(result) : "";
    if (!missing.empty()) log->warn(missing);
    for (const Artifact& made : result.artifacts) {
      if (made.stage != "anatomy" || result.stages.back().stage != made.stage) continue;
      std::cout << (name.empty() ? "" : name + "\n")
                << describe_anatomy(read_json(made.folder / kFiguresFile, "wireplan.anatomy/1"));
    }
    done.push_back(section);
    last = result.stages.back().stage;
  });

  if (last != "report") {
    std::cout << "done up to " << last << ": " << output.string() << "\n";
    return kDone;
  }
  return done.size() == 1 ? print_answer(output) : print_overview(given, done, output);
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
  require_folder(arguments.output, kResults);
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

void add_run(CLI::App& app, int& code) {
  const auto arguments = std::make_shared<RunArguments>();
  CLI::App* run = app.add_subcommand("run", "Plan a case: from its volume or surface to a ranking");
  add_case_options(*run, *arguments);
  add_stage_options(*run, *arguments);
  run->add_option("-o,--output", arguments->output, "Results [wireplan-out/CASE NAME]");
  add_trial_options(*run, *arguments);
  run->add_flag("--dry-run", arguments->dry_run, "Only say which stages would run, and why");
  run->add_flag("--explain", arguments->explain, "Say why each stage runs");
  run->footer("Example: wireplan run cases/abdomen -o out -j 2");
  run->callback([&code, arguments] { code = run_case(*arguments); });
}

void add_trials(CLI::App& app, int& code) {
  struct ShardArguments : RunArguments {
    std::string shard;
    int round = 1;
  };
  const auto arguments = std::make_shared<ShardArguments>();
  CLI::App* trials = app.add_subcommand("trials", "One part of a case's trials, for a cluster");
  add_case_options(*trials, *arguments);
  trials->add_option("--shard", arguments->shard, "K/N: part K of N, from 1")->required();
  trials
      ->add_option("--round", arguments->round,
                   "1: scouts, or all in full; 2 on: the probes and full runs that follow")
      ->check(CLI::Range(1, 1000));
  add_trial_options(*trials, *arguments);
  trials->footer(
      "Puts its trials into the cache and writes nothing else. Shards run in any order, on any\n"
      "machine that shares the cache; `wireplan report` takes them from there and runs what is\n"
      "missing. Example: wireplan trials cases/abdomen --shard 3/8");
  trials->callback(
      [&code, arguments] { code = run_shard(*arguments, arguments->shard, arguments->round); });
}

void add_report(CLI::App& app, int& code) {
  const auto arguments = std::make_shared<RunArguments>();
  arguments->after_shards = true;
  CLI::App* report =
      app.add_subcommand("report", "The report of a case whose trials were run in shards");
  add_case_options(*report, *arguments);
  report->add_option("-o,--output", arguments->output, "Results [wireplan-out/CASE NAME]");
  add_trial_options(*report, *arguments);
  report->footer(
      "The same files as `wireplan run`. What no shard has run is run here, and told.\n"
      "Example: wireplan report cases/abdomen -o out");
  report->callback([&code, arguments] { code = run_case(*arguments); });
}

void add_batch(CLI::App& app, int& code) {
  const auto arguments = std::make_shared<BatchArguments>();
  CLI::App* batch = app.add_subcommand("batch", "Plan many cases; one that fails stops no other");
  batch->add_option("CASE", arguments->cases, "Case files, case folders, or a folder of them")
      ->required();
  batch->add_option("-o,--output", arguments->output, "Folder for batch.json and the results");
  batch->add_option("-j,--threads", arguments->threads, "Cases at a time [all cores]")
      ->check(CLI::Range(1, 4096));
  batch
      ->add_option("--memory-gb", arguments->memory_gb,
                   "Memory of all cases together [3/4 of the machine's]")
      ->check(CLI::Range(0.1, 1e6));
  batch->add_flag("--list", arguments->list, "Only print name and file of each case");
  batch->add_flag("--fail-fast", arguments->fail_fast, "Stop after the first that fails");
  add_cache_option(*batch, arguments->cache);
  batch->footer(
      "Exits with the code of the case that ended worst. What is finished is kept: a batch that\n"
      "was stopped goes on from there. Example: wireplan batch study/ -o out --memory-gb 8");
  batch->callback([&code, arguments] { code = run_batch_command(*arguments); });
}

void add_status(CLI::App& app, int& code) {
  const auto arguments = std::make_shared<RunArguments>();
  CLI::App* status = app.add_subcommand("status", "Which stages are cached, which would run, why");
  add_case_options(*status, *arguments);
  add_stage_options(*status, *arguments);
  status->footer("Example: wireplan status cases/abdomen --set wall.thickness_mm=2");
  status->callback([&code, arguments] { code = print_status(*arguments); });
}

}  // namespace wireplan::pipeline
