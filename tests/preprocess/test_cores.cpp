#include <gtest/gtest.h>
#include <sched.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "preprocess/cores.h"

namespace wireplan {
namespace {

namespace fs = std::filesystem;

/// A new folder of the test's name.
fs::path scratch() {
  fs::path folder =
      fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

TEST(Cores, OfAffinityAreThoseItNames) {
  cpu_set_t before, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  CPU_ZERO(&one);
  for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++cpu) {
    if (CPU_ISSET(cpu, &before)) CPU_SET(cpu, &one);
  }
  EXPECT_GE(core_count(), 1);
  EXPECT_LE(core_count(), CPU_COUNT(&before));
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  EXPECT_EQ(core_count(), 1);
  ASSERT_EQ(sched_setaffinity(0, sizeof before, &before), 0);
}

TEST(Cores, OfAQuotaAreTheLeastOfAllGroups) {
  const fs::path mounts = scratch();
  EXPECT_FALSE(core_quota("0::/jobs/one\n", mounts).has_value());
  write(mounts / "jobs/one/cpu.max", "max 100000\n");
  EXPECT_FALSE(core_quota("0::/jobs/one\n", mounts).has_value());
  write(mounts / "jobs/cpu.max", "250000 100000\n");
  EXPECT_DOUBLE_EQ(core_quota("0::/jobs/one\n", mounts).value(), 2.5);
  write(mounts / "jobs/one/cpu.max", "50000 100000\n");
  EXPECT_DOUBLE_EQ(core_quota("0::/jobs/one\n", mounts).value(), 0.5);
  // A container sees its own group as the root of them.
  write(mounts / "cpu.max", "100000 100000\n");
  EXPECT_DOUBLE_EQ(core_quota("0::/\n", mounts).value(), 1.0);
}

TEST(Cores, OfAQuotaInTheOlderVersion) {
  const fs::path mounts = scratch();
  const std::string groups = "5:memory:/jobs\n4:cpuset:/jobs\n3:cpu,cpuacct:/jobs\n0::/jobs\n";
  write(mounts / "cpu/jobs/cpu.cfs_quota_us", "-1\n");
  write(mounts / "cpu/jobs/cpu.cfs_period_us", "100000\n");
  EXPECT_FALSE(core_quota(groups, mounts).has_value());
  write(mounts / "cpu/jobs/cpu.cfs_quota_us", "300000\n");
  EXPECT_DOUBLE_EQ(core_quota(groups, mounts).value(), 3.0);
  EXPECT_FALSE(core_quota("4:cpuset:/jobs\n", mounts).has_value());
}

TEST(Cores, OfWhatIsNoQuotaAreNotLimited) {
  const fs::path mounts = scratch();
  for (const char* text : {"", "many\n", "100000\n", "0 100000\n", "-5 100000\n", "100000 0\n"}) {
    write(mounts / "cpu.max", text);
    EXPECT_FALSE(core_quota("0::/\n", mounts).has_value()) << text;
  }
  for (const char* groups : {"", "nothing", "0:", "::\n\n:"}) {
    EXPECT_NO_THROW(core_quota(groups, mounts)) << groups;
  }
}

}  // namespace
}  // namespace wireplan
