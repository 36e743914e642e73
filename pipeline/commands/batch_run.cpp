#include "pipeline/commands/batch_run.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <deque>
#include <fstream>
#include <map>
#include <optional>
#include <system_error>
#include <thread>

#include "pipeline/commands/commands.h"
#include "pipeline/files/case_file.h"
#include "pipeline/files/clock.h"
#include "pipeline/files/text.h"
#include "pipeline/report/overview.h"
#include "pipeline/report/report.h"
#include "pipeline/report/verdict_json.h"
#include "pipeline/stages/stages.h"
#include "preprocess/cores.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// What a patient is expected to need before it is known: libraries and meshes, and of a volume its
// values, their smoothed copy, distances and masks.
constexpr double kMemoryOfAnyGb = 0.3, kMemoryPerInputByte = 8.0;
constexpr double kBytesPerGb = 1e9;
constexpr auto kPollInterval = std::chrono::milliseconds(20);

// ---- which cases -----------------------------------------------------------------------------

std::string name_of(const fs::path& path) {
  const fs::path absolute = fs::absolute(path).lexically_normal();
  const fs::path named = absolute.filename().empty() ? absolute.parent_path() : absolute;
  if (fs::is_directory(path)) return named.filename().string();
  return named.filename() == "case.json" ? named.parent_path().filename().string()
                                         : named.stem().string();
}

// A file that names another schema is no case; one that is broken shall be told as such.
bool may_be_case(const fs::path& file) {
  if (file.extension() != ".json" || !fs::is_regular_file(file)) return false;
  std::ifstream stream(file);
  const Json json = Json::parse(stream, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("schema")) return true;
  return json["schema"].is_string() &&
         json["schema"].get<std::string>().starts_with("wireplan.case/");
}

std::vector<fs::path> cases_below(const fs::path& folder) {
  std::vector<fs::path> cases;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const bool has_case = entry.is_directory() && fs::exists(entry.path() / "case.json");
    if (has_case || may_be_case(entry.path())) cases.push_back(entry.path());
  }
  std::sort(cases.begin(), cases.end());
  return cases;
}

// ---- one patient, in a process of its own ----------------------------------------------------

// All of the child: its log goes to a file, what went wrong through the pipe.
[[noreturn]] void run_patient(const BatchCase& patient, const BatchRunOptions& options,
                              const fs::path& log, int pipe) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::setpgid(0, 0);  // an interrupt of the terminal reaches it through its parent alone
  const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) {
    if (file >= 0) ::dup2(file, stream);
  }
  int code = kDone;
  std::string reason;
  try {
    code =
        run_one_case(patient.path, options.output / patient.name, options.cache, options.threads);
  } catch (...) {
    const Failure failure = describe_failure();
    code = failure.code;
    reason = failure.message;
    std::fprintf(stderr, "%s\n", reason.c_str());
  }
  // A pipe takes 64 kB without a reader; a message that long is cut.
  reason.resize(std::min<std::size_t>(reason.size(), 60000));
  const ssize_t written = ::write(pipe, reason.data(), reason.size());
  std::fflush(nullptr);
  ::_exit(written < 0 ? kOurFault : code);
}

struct Patient {
  const BatchCase* given = nullptr;
  double input_bytes = 0.0, expected_gb = 0.0;
  // Of its process.
  pid_t process = 0;
  int pipe = -1;
  Clock::time_point start;
  // How it ended; the times of all its processes.
  std::string outcome = "not_run", reason;
  int exit_code = kInterrupted;
  double wall_s = 0.0, cpu_s = 0.0, peak_gb = 0.0;
  int begun_again = 0;
};

double resident_gb(pid_t process) {
  std::ifstream stream("/proc/" + std::to_string(process) + "/statm");
  double all = 0.0, resident = 0.0;
  stream >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / kBytesPerGb;
}

double machine_gb() {
  return static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
         static_cast<double>(::sysconf(_SC_PAGESIZE)) / kBytesPerGb;
}

// 0 where the case cannot be read: its process will say why.
double input_bytes_of(const BatchCase& given) {
  try {
    const Case input = read_case(given.path);
    const fs::path path = input_path(input);
    if (fs::is_regular_file(path)) return static_cast<double>(fs::file_size(path));
    double bytes = 0.0;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path)) {
      if (entry.is_regular_file()) bytes += static_cast<double>(entry.file_size());
    }
    return bytes;
  } catch (const std::exception&) {
    return 0.0;
  }
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

class BatchRun {
 public:
  BatchRun(const std::vector<BatchCase>& cases, const BatchRunOptions& options)
      : options_(options), patients_(cases.size()) {
    limit_gb_ = options.memory_gb > 0.0 ? options.memory_gb : 0.75 * machine_gb();
    for (std::size_t k = 0; k < cases.size(); ++k) {
      patients_[k].given = &cases[k];
      patients_[k].input_bytes = input_bytes_of(cases[k]);
      patients_[k].expected_gb =
          kMemoryOfAnyGb + kMemoryPerInputByte * patients_[k].input_bytes / kBytesPerGb;
    }
    // The largest begin first, so that none of them ends long after all others.
    for (Patient& patient : patients_) waiting_.push_back(&patient);
    std::stable_sort(waiting_.begin(), waiting_.end(), [](const Patient* a, const Patient* b) {
      return a->input_bytes > b->input_bytes;
    });
  }

  Json run() {
    fs::create_directories(options_.output);
    write_state();
    while (!running_.empty() || (!waiting_.empty() && !stopping_)) {
      if (options_.cancelled && options_.cancelled()) stop_all();
      start_what_fits();
      std::this_thread::sleep_for(kPollInterval);
      hold_memory();
      collect();
    }
    return write_state();
  }

 private:
  void start_what_fits() {
    const auto most =
        static_cast<std::size_t>(options_.threads > 0 ? options_.threads : core_count());
    while (!stopping_ && !waiting_.empty() && running_.size() < most) {
      double taken = waiting_.front()->expected_gb;
      for (const Patient* patient : running_)
        taken += std::max(patient->peak_gb, patient->expected_gb);
      if (!running_.empty() && taken > limit_gb_) return;
      start(*waiting_.front());
      waiting_.pop_front();
    }
  }

  void start(Patient& patient) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw_refused("pipe");
    std::fflush(nullptr);  // what is not yet printed would be printed twice
    const fs::path log = options_.output / (patient.given->name + ".log");
    const pid_t process = ::fork();
    if (process < 0) throw_refused("process");
    if (process == 0) run_patient(*patient.given, options_, log, ends[1]);
    ::close(ends[1]);
    patient.process = process;
    patient.pipe = ends[0];
    patient.start = Clock::now();
    running_.push_back(&patient);
  }

  [[noreturn]] static void throw_refused(const std::string& what) {
    throw DiskError("batch: the system gives no other " + what + " (" + std::strerror(errno) +
                    "); end other programs or run fewer patients at a time with -j");
  }

  // Where all together take too much the youngest goes back to the queue.
  void hold_memory() {
    double sum = resident_gb(::getpid());
    for (Patient* patient : running_) {
      const double now = resident_gb(patient->process);
      patient->peak_gb = std::max(patient->peak_gb, now);
      sum += now;
    }
    peak_gb_ = std::max(peak_gb_, sum);
    if (sum <= limit_gb_ || running_.empty()) return;
    Patient& youngest = *running_.back();
    ::kill(youngest.process, SIGKILL);
    finish_process(youngest, 0);
    running_.pop_back();
    if (running_.empty()) {
      end(youngest, "failed", kBadInput,
          "it needs more than the " + Json(limit_gb_).dump() +
              " GB that --memory-gb allows; allow more, or crop the volume");
    } else {
      youngest.expected_gb = 1.2 * youngest.peak_gb;
      ++youngest.begun_again;
      waiting_.push_front(&youngest);
    }
  }

  // Waits for the end of a process; nothing where `flags` says not to wait and it still runs.
  std::optional<int> finish_process(Patient& patient, int flags) {
    int status = 0;
    rusage usage{};
    const pid_t ended = ::wait4(patient.process, &status, flags, &usage);
    if (ended == 0) return {};
    expects(ended == patient.process);
    const auto seconds = [](const timeval& time) {
      return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    patient.wall_s += seconds_since(patient.start);
    patient.cpu_s += seconds(usage.ru_utime) + seconds(usage.ru_stime);
    patient.peak_gb =
        std::max(patient.peak_gb, 1024.0 * static_cast<double>(usage.ru_maxrss) / kBytesPerGb);
    patient.reason.clear();
    std::array<char, 4096> buffer{};
    for (ssize_t count = 0; (count = ::read(patient.pipe, buffer.data(), buffer.size())) > 0;) {
      patient.reason.append(buffer.data(), static_cast<std::size_t>(count));
    }
    ::close(patient.pipe);
    return status;
  }

  void collect() {
    std::vector<Patient*> still_running;
    for (Patient* patient : running_) {
      const std::optional<int> status = finish_process(*patient, WNOHANG);
      if (!status) {
        still_running.push_back(patient);
      } else if (WIFSIGNALED(*status)) {
        end(*patient, "failed", kOurFault,
            std::string("it crashed (") + ::strsignal(WTERMSIG(*status)) + "); see " +
                patient->given->name + ".log");
      } else {
        const int code = WEXITSTATUS(*status);
        end(*patient,
            code == kDone          ? "planned"
            : code == kNoPlan      ? "no_plan"
            : code == kInterrupted ? "interrupted"
                                   : "failed",
            code, patient->reason);
      }
    }
    running_ = still_running;
  }

  void end(Patient& patient, const std::string& outcome, int code, const std::string& reason) {
    patient.outcome = outcome;
    patient.exit_code = code;
    patient.reason = reason;
    if (outcome == "failed" && options_.fail_fast) stop_all();
    const Json batch = write_state();
    if (!options_.on_line) return;
    const Json& row =
        batch.at("patients").at(static_cast<std::size_t>(&patient - patients_.data()));
    std::string line = patient.given->name + ": ";
    if (!row.at("summary").is_null()) line += row.at("summary").get<std::string>();
    if (row.at("summary").is_null()) line += outcome;
    if (!reason.empty()) line += ": " + first_line(reason);
    options_.on_line(line + format(" (%.1f s)", patient.wall_s));
  }

  void stop_all() {
    if (stopping_) return;
    stopping_ = true;
    for (const Patient* patient : running_) ::kill(patient->process, SIGINT);
  }

  Json row_of(const Patient& patient) const {
    Json row = {{"name", patient.given->name},
                {"case", patient.given->path.string()},
                {"outcome", patient.outcome},
                {"exit_code", patient.exit_code},
                {"reason", patient.reason.empty() ? Json(nullptr) : Json(patient.reason)},
                {"report", nullptr},
                {"verdict", nullptr},
                {"summary", nullptr},
                {"best_plan", nullptr}};
    if (patient.outcome != "planned" && patient.outcome != "no_plan") return row;
    const std::string name = patient.given->name + "/report.json";
    row["report"] = name;
    if (const std::optional<Json> overview = find_overview(options_.output / name)) {
      row["summary"] = describe_overview(*overview);
      return row;
    }
    const Json report = read_report(options_.output / name);
    row["verdict"] = report.at("verdict").at("answer");
    row["summary"] = answer_of(report) + "; " + describe_best(report);
    if (report.at("ranking").empty()) return row;
    const Json& best = report.at("ranking").front();
    for (const char* key :
         {"trial", "wire", "inclination_deg", "azimuth_deg", "roll_deg", "script", "score"}) {
      row["best_plan"][key] = best.at(key);
    }
    for (const char* key : {"catheter", "first_wire"}) {
      if (best.contains(key)) row["best_plan"][key] = best.at(key);
    }
    return row;
  }

  Json write_state() {
    Json batch;
    batch["schema"] = kBatchSchema;
    std::map<std::string, int> counts;
    batch["patients"] = Json::array();
    for (const Patient& patient : patients_) {
      batch["patients"].push_back(row_of(patient));
      ++counts[patient.outcome];
    }
    for (const char* outcome : {"planned", "no_plan", "failed", "interrupted", "not_run"}) {
      batch["counts"][outcome] = counts[outcome];
    }
    double cpu = 0.0;
    Json rows = Json::array();
    for (const Patient& patient : patients_) {
      cpu += patient.cpu_s;
      rows.push_back({{"name", patient.given->name},
                      {"wall_s", patient.wall_s},
                      {"cpu_s", patient.cpu_s},
                      {"peak_memory_mb", std::round(1000.0 * patient.peak_gb)},
                      {"begun_again_for_memory", patient.begun_again}});
    }
    batch["timing"] = {{"wall_s", seconds_since(start_)},
                       {"cpu_s", cpu},
                       {"memory_limit_gb", limit_gb_},
                       {"peak_memory_mb", std::round(1000.0 * peak_gb_)},
                       {"patients", rows}};
    write_json(batch, options_.output / "batch.json");
    return batch;
  }

  const BatchRunOptions& options_;
  std::vector<Patient> patients_;
  std::deque<Patient*> waiting_;
  std::vector<Patient*> running_;  // in the order of their start
  double limit_gb_ = 0.0, peak_gb_ = 0.0;
  bool stopping_ = false;
  Clock::time_point start_ = Clock::now();
};

}  // namespace

std::vector<BatchCase> list_batch_cases(const std::vector<std::string>& arguments) {
  std::vector<BatchCase> cases;
  for (const std::string& argument : arguments) {
    std::vector<fs::path> paths = {argument};
    if (fs::is_directory(argument) && !fs::exists(fs::path(argument) / "case.json")) {
      paths = cases_below(argument);
      if (paths.empty()) {
        throw Error(argument +
                    ": holds no case, expected case files or folders that have a case.json");
      }
    }
    for (const fs::path& path : paths) cases.push_back({name_of(path), path});
  }
  for (std::size_t k = 0; k < cases.size(); ++k) {
    for (std::size_t earlier = 0; earlier < k; ++earlier) {
      if (cases[k].name != cases[earlier].name) continue;
      throw Error("batch: " + cases[earlier].path.string() + " and " + cases[k].path.string() +
                  " are both named \"" + cases[k].name +
                  "\", expected a name of its own for each; rename a folder or file");
    }
  }
  return cases;
}

Json run_batch_cases(const std::vector<BatchCase>& cases, const BatchRunOptions& options) {
  return BatchRun(cases, options).run();
}

int exit_code_of(const Json& batch) {
  constexpr std::array kWorstFirst = {kOurFault, kBadInput, kInterrupted, kNoPlan};
  for (const int code : kWorstFirst) {
    for (const Json& patient : batch.at("patients")) {
      if (patient.at("exit_code") == code) return code;
    }
  }
  return kDone;
}

}  // namespace wireplan::pipeline
