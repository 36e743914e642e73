/// wireplan: its exit code, and what the user reads when something goes wrong; nothing else.
#include <iostream>

#include "pipeline/commands/commands.h"

int main(int argc, char** argv) {
  using namespace wireplan;
  try {
    return pipeline::run_command(argc, argv);
  } catch (...) {
    const pipeline::Failure failure = pipeline::describe_failure();
    std::cerr << failure.message << "\n";
    return failure.code;
  }
}
