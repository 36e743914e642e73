// In the place of the benches where the program is built to be tested under sanitizers.
#include "pipeline/bench/bench.h"
#include "preprocess/base.h"

namespace wireplan::pipeline {

void run_bench(const std::string&, const std::filesystem::path&, const BenchOptions&) {
  throw Error("bench: this program is built for tests under sanitizers, without benches");
}

}  // namespace wireplan::pipeline
