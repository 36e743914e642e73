#include "preprocess/cores.h"

#include <sched.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include "preprocess/base.h"

namespace wireplan {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Of "quota period" in microseconds; "max" or -1 is none.
std::optional<double> quota_of(const std::string& text) {
  std::istringstream in(text);
  double quota = 0.0, period = 0.0;
  if (!(in >> quota >> period) || quota <= 0.0 || period <= 0.0) return std::nullopt;
  return quota / period;
}

double seconds_by(clockid_t clock) {
  timespec now{};
  expects(clock_gettime(clock, &now) == 0);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Whether a list such as "cpu,cpuacct" holds the controller of cores.
bool names_cpu(std::string_view controllers) {
  while (!controllers.empty()) {
    const std::size_t end = std::min(controllers.find(','), controllers.size());
    if (controllers.substr(0, end) == "cpu") return true;
    controllers.remove_prefix(std::min(end + 1, controllers.size()));
  }
  return false;
}

}  // namespace

std::optional<double> core_quota(std::string_view groups, const fs::path& mounts) {
  std::optional<double> least;
  std::istringstream lines{std::string(groups)};
  for (std::string line; std::getline(lines, line);) {
    // number:controllers:path; version 2 names no controllers.
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string_view controllers =
        std::string_view(line).substr(first + 1, second - first - 1);
    const bool newer = controllers.empty();
    if (!newer && !names_cpu(controllers)) continue;
    const fs::path root = newer ? mounts : mounts / "cpu";
    for (fs::path group = fs::path(line.substr(second + 1)).relative_path();;
         group = group.parent_path()) {
      const fs::path folder = root / group;
      const std::optional<double> quota =
          quota_of(newer ? text_of(folder / "cpu.max")
                         : text_of(folder / "cpu.cfs_quota_us") + " " +
                               text_of(folder / "cpu.cfs_period_us"));
      if (quota) least = std::min(quota.value(), least.value_or(quota.value()));
      if (group.empty()) break;
    }
  }
  return least;
}

int core_count() {
  int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  // More cores than the set has room for: then all count.
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) {
    cores = std::max(1, CPU_COUNT(&allowed));
  }
  const std::optional<double> quota = core_quota(text_of("/proc/self/cgroup"), "/sys/fs/cgroup");
  if (quota) cores = std::clamp(static_cast<int>(std::ceil(*quota)), 1, cores);
  return cores;
}

double thread_cpu_seconds() { return seconds_by(CLOCK_THREAD_CPUTIME_ID); }

double process_cpu_seconds() { return seconds_by(CLOCK_PROCESS_CPUTIME_ID); }

}  // namespace wireplan
