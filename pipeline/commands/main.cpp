/// wireplan: its exit code, and what the user reads when something goes wrong; nothing else.
#include <malloc.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <system_error>

#include "pipeline/commands/commands.h"

namespace {

/// Stages allocate volumes one after the other: what one has freed the next one gets, in the place
/// of fresh pages that the system must clear.
void keep_freed_memory() {
  constexpr int kMega = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 128 * kMega);
  mallopt(M_TRIM_THRESHOLD, 256 * kMega);
}

/// Starts a run anew, which takes 0.1 s, with what libraries read from the environment at their
/// start alone: memory in huge pages, where the system gives them to who asks, and threads of loops
/// that sleep when they have nothing to do. That is a tenth of its CPU time. Where it cannot be
/// started, or the user has settings of the C library, it goes on as it is.
void set_up_libraries(char** argv) {
  constexpr const char* kTunables = "GLIBC_TUNABLES";
  std::error_code unknown;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (std::getenv(kTunables) != nullptr || unknown) return;
  if (::setenv(kTunables, "glibc.malloc.hugetlb=1", /*overwrite=*/0) != 0) return;
  ::setenv("OMP_WAIT_POLICY", "passive", /*overwrite=*/0);
  ::execv(program.c_str(), argv);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace wireplan;
  const std::string command = argc > 1 ? argv[1] : "";
  if (command == "run" || command == "batch" || command == "trials") set_up_libraries(argv);
  keep_freed_memory();
  try {
    return pipeline::run_command(argc, argv);
  } catch (...) {
    const pipeline::Failure failure = pipeline::describe_failure();
    std::cerr << failure.message << "\n";
    return failure.code;
  }
}
