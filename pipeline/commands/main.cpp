/// wireplan: its exit code, and what the user reads when something goes wrong; nothing else.
#include <malloc.h>

#include <iostream>

#include "pipeline/commands/commands.h"

namespace {

/// Stages allocate volumes one after the other: what one has freed the next one gets, in the place
/// of fresh pages that the system must clear.
void keep_freed_memory() {
  constexpr int kMega = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 128 * kMega);
  mallopt(M_TRIM_THRESHOLD, 256 * kMega);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace wireplan;
  keep_freed_memory();
  try {
    return pipeline::run_command(argc, argv);
  } catch (...) {
    const pipeline::Failure failure = pipeline::describe_failure();
    std::cerr << failure.message << "\n";
    return failure.code;
  }
}
