#pragma once
/// How many threads are worth starting, and the time that they take.
#include <filesystem>
#include <optional>
#include <string_view>

namespace wireplan {

/// Cores that this process may use, at least one: those that its affinity names (`taskset`, a batch
/// system), and no more than the quota of its control groups (a container), a part of a core
/// counting as one.
int core_count();

/// CPU time since the calling thread, or the process with all its threads, began [s].
double thread_cpu_seconds();
double process_cpu_seconds();

/// The least quota [cores] of a process and all groups above its own; nothing where none is set.
/// `groups` is its /proc/self/cgroup, `mounts` where the groups' files lie (/sys/fs/cgroup):
/// version 2 has `cpu.max`, version 1 `cpu/cpu.cfs_quota_us` and `cpu.cfs_period_us`. Files that
/// are not there or do not read as numbers limit nothing.
std::optional<double> core_quota(std::string_view groups, const std::filesystem::path& mounts);

}  // namespace wireplan
